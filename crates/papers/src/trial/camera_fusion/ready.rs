//! The method among others on one drive: in each of its lights the camera alone and with the radar.

use crate::trial::camera::View;
use crate::trial::camera_fusion::settings::{Condition, Settings};
use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::ready::{Finds, ReadyMethod, Sense, chirp_radar};
use crate::trial::sensors::OwnedInput;
use catseye::error::Result;
use catseye::geom::Geometry;
use catseye::rng::Draws;
use catseye_lane::camera_fusion::Image;
use std::cell::RefCell;
use std::rc::Rc;

/// The camera of one vehicle: all variants of the method see the same pictures.
struct SharedCamera {
    settings: Settings,
    carrier_hz: f64,
    seed: u64,
    shake: Draws,
    /// Of the last look: its number, the scene, the sight of it, pictures by light.
    seen: Option<(u32, Geometry, View)>,
    lit: Vec<(Condition, Image)>,
}

impl SharedCamera {
    fn picture(&mut self, drive: &Drive<'_>, index: u32, time_s: f64, condition: Condition) -> Result<Image> {
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
        let image = view.lit(geometry, &self.settings.light(condition), noise)?;
        self.lit.push((condition, image.clone()));
        Ok(image)
    }
}

pub(in crate::trial) fn ready_methods(
    given: &TrialContext<'_>,
    settings: &Settings,
    drive: &Drive<'_>,
    run: u32,
) -> Result<Vec<(String, ReadyMethod)>> {
    let which = chirp_radar(given)?;
    let seed = given.scenario_of(run).seed;
    let eye = Rc::new(RefCell::new(SharedCamera {
        settings: settings.clone(),
        carrier_hz: drive.radar(which).carrier_hz,
        seed,
        shake: Draws::new(seed as u32 ^ (seed >> 32) as u32, 0x5a4e),
        seen: None,
        lit: Vec::new(),
    }));
    let mut out = Vec::new();
    for condition in &settings.conditions {
        for (name, tracks) in [("camera and radar", true), ("camera alone", false)] {
            let (eye, condition) = (eye.clone(), *condition);
            let sense: Sense = Box::new(move |drive, _, index, look: &mut OwnedInput| {
                let time_s = look.time_s;
                look.image = Some(eye.borrow_mut().picture(drive, index, time_s, condition)?);
                Ok(())
            });
            let rival = ReadyMethod {
                estimator: Box::new(settings.estimator_with(drive.radar(which))?),
                finds: Finds::OwnLines,
                radar: tracks.then_some(which),
                points: false,
                tracks,
                sense: Some(sense),
            };
            out.push((format!("{}, {name}", condition.name()), rival));
        }
    }
    Ok(out)
}
