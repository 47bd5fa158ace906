//! The camera of a vehicle on a drive, with its images by frame and light.

use crate::trial::camera::{Light, View};
use crate::trial::kit::*;
use catseye::geom::Geometry;
use catseye_lane::camera_fusion::Image;
use catseye_lane::camera_fusion::{CameraFusionOptions, Condition};

/// A camera whose pitch varies from frame to frame.
pub struct VehicleCamera {
    settings: CameraFusionOptions,
    carrier_hz: f64,
    seed: u64,
    shake: Draws,
    /// Data of the last look: its frame number, the scene and the view of it; `lit` holds its images by
    /// light.
    seen: Option<(u32, Geometry, View)>,
    lit: Vec<(Condition, Image)>,
}

impl VehicleCamera {
    pub fn new(settings: &CameraFusionOptions, carrier_hz: f64, seed: u64) -> VehicleCamera {
        let (settings, shake) = (settings.clone(), draws(seed, 0x5a4e));
        VehicleCamera { settings, carrier_hz, seed, shake, seen: None, lit: Vec::new() }
    }

    /// The image of a frame in a light condition, made once; frames must come in order.
    pub fn picture(
        &mut self,
        drive: &Drive<'_>,
        index: u32,
        time_s: f64,
        condition: Condition,
    ) -> Result<Image> {
        let site = drive.site;
        let (_, geometry, view) = match self.seen.take() {
            Some(seen) if seen.0 == index => self.seen.insert(seen),
            _ => {
                self.lit.clear();
                let geometry = Geometry::build(&site.scene, time_s, self.carrier_hz)?;
                let mut camera = self.settings.camera.camera();
                camera.pitch_rad += self.settings.pitch_std_deg.to_radians() * self.shake.normal();
                let view = View::new(&geometry, &site.scene, &site.scenario.ego.pose(time_s), &camera)?;
                self.seen.insert((index, geometry, view))
            }
        };
        if let Some((_, image)) = self.lit.iter().find(|l| l.0 == condition) {
            return Ok(image.clone());
        }
        let noise = self.seed.wrapping_mul(1000).wrapping_add(u64::from(index));
        let image = view.lit(geometry, &light(&self.settings, condition), noise)?;
        self.lit.push((condition, image.clone()));
        Ok(image)
    }
}

/// The light of a condition.
fn light(settings: &CameraFusionOptions, condition: Condition) -> Light {
    match condition {
        Condition::Clear => Light::CLEAR,
        Condition::Night => Light::night(),
        Condition::Fog => Light::fog(settings.fog_visibility_m),
        Condition::Glare => Light::glare(settings.glare_elevation_deg.to_radians(), settings.glare_stray),
    }
}
