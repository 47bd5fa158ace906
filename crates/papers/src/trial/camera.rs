//! Images of a scene from a camera on the vehicle, by the same geometry and acceleration tree as the radar's
//! rays: closest hits, reflectance by material, sun with shadows and glint, sky, fog, headlamps, stray light,
//! exposure and noise.
//!
//! Light is in photometric units; the grey of an image is the number of electrons divided by the full well.
//! Reflectances are round values for dry clean surfaces, good for contrasts and not for colours.

use crate::trial::stats::draws;
use catseye::base::error::{BadInput, Result};
use catseye::base::frames::{Pose, Vehicle, World};
use catseye::base::rng::philox4x32_10;
use catseye::geom::Geometry;
use catseye::road::actors::is_vehicle;
use catseye::scene::{Material, Scene};
use catseye_lane::camera_fusion::{Camera, Image};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

/// Size of the grains of an asphalt surface's texture, m.
const GRAIN_M: f64 = 0.04;
/// Relative standard deviation of the reflectance from grain to grain.
const GRAIN: f64 = 0.15;
/// Number of rays along each side of a pixel that is not uniform.
const FINE: usize = 4;
/// Number of electrons of a full pixel, and standard deviation of the read-out noise.
const FULL_WELL: f64 = 10_000.0;
const READ_NOISE: f64 = 8.0;
/// Illuminance of a clear noon at which a white surface fills a pixel at exposure 1, lx.
const NOON_LX: f64 = 65_000.0;
/// Mean grey below the horizon that the exposure aims at, and limits of the exposure.
const MEAN_GREY: f64 = 0.35;
const EXPOSURES: [f64; 2] = [0.05, 200.0];
/// Coefficient of retroreflected luminance (cd/m² per lx) of dry marking paint with glass beads (EN 1436,
/// class R3), and of asphalt.
const RETRO_PAINT: f64 = 0.15;
const RETRO_ASPHALT: f64 = 0.015;
/// Positions of the headlamps in the vehicle frame, m.
const LAMPS_M: [DVec3; 2] = [DVec3::new(3.7, 0.6, 0.65), DVec3::new(3.7, -0.6, 0.65)];
/// Luminous intensity of one low beam just below its cut-off, cd.
const LAMP_CD: f64 = 18_000.0;

/// Light on a scene. Angles are in the vehicle frame at the time of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Illuminance by the sun on a surface perpendicular to its rays, lx.
    pub sun_lx: f64,
    /// Azimuth of the sun, rad.
    pub sun_azimuth_rad: f64,
    /// Elevation of the sun, rad.
    pub sun_elevation_rad: f64,
    /// Illuminance of level ground by the sky alone, lx.
    pub sky_lx: f64,
    /// Meteorological visibility in fog (contrast 0.02), m; None: clear.
    pub visibility_m: Option<f64>,
    /// Whether the low beams are on.
    pub lamps: bool,
    /// Stray light of lens and windscreen relative to that of a healthy eye (Stiles and Holladay: 10 E / θ²,
    /// θ in degrees).
    pub stray: f64,
}

impl Light {
    /// Noon in a clear sky, with the sun high on the right behind.
    pub const CLEAR: Light = Light {
        sun_lx: 50_000.0,
        sun_azimuth_rad: -2.4,
        sun_elevation_rad: 0.9,
        sky_lx: 15_000.0,
        visibility_m: None,
        lamps: false,
        stray: 1.0,
    };

    /// A moonless night outside towns, with low beams.
    pub fn night() -> Light {
        Light { sun_lx: 0.0, sky_lx: 0.01, lamps: true, ..Light::CLEAR }
    }

    /// Daytime fog that hides the sun, with this meteorological visibility (m).
    pub fn fog(visibility_m: f64) -> Light {
        Light { sun_lx: 0.0, sky_lx: 15_000.0, visibility_m: Some(visibility_m), lamps: true, ..Light::CLEAR }
    }

    /// The sun low ahead at `elevation_rad`, through a windscreen with `stray` times the stray light of a
    /// healthy eye.
    pub fn glare(elevation_rad: f64, stray: f64) -> Light {
        Light {
            sun_lx: 40_000.0,
            sun_azimuth_rad: 0.0,
            sun_elevation_rad: elevation_rad,
            sky_lx: 8_000.0,
            stray,
            ..Light::CLEAR
        }
    }

    fn sun_towards(&self) -> DVec3 {
        catseye::base::frames::direction_from_angles(self.sun_azimuth_rad, self.sun_elevation_rad)
    }
}

/// Optical properties of a surface.
#[derive(Debug, Clone, Copy)]
struct Look {
    albedo: f64,
    retro: f64,
    /// Roughness of the microfacets of the glint (GGX); 0 for no glint.
    roughness: f64,
    grain: bool,
}

fn look_of(material: &Material, on_vehicle: bool) -> Look {
    // The outermost layer is the visible one.
    let top = material.name.rsplit('+').next().unwrap_or_default().split(':').next().unwrap_or_default();
    let dull = |albedo| Look { albedo, retro: 0.0, roughness: 0.0, grain: false };
    match top {
        "paint-white" => Look { albedo: 0.6, retro: RETRO_PAINT, roughness: 0.65, grain: false },
        t if t.contains("paint") => Look { albedo: 0.4, retro: RETRO_PAINT, roughness: 0.65, grain: false },
        "asphalt" => Look { albedo: 0.1, retro: RETRO_ASPHALT, roughness: 0.55, grain: true },
        "concrete" | "gravel" => Look { albedo: 0.27, retro: RETRO_ASPHALT, roughness: 0.6, grain: true },
        "water" | "ice" => Look { albedo: 0.06, retro: 0.0, roughness: 0.12, grain: false },
        "grass" | "meadow" | "leaves" | "arable-land" => Look { grain: true, ..dull(0.14) },
        "soil" => Look { grain: true, ..dull(0.18) },
        "rubber" => dull(0.04),
        "glass" => dull(0.06),
        "snow" => dull(0.8),
        "skin" => dull(0.4),
        // Sheet metal of vehicles is painted.
        _ if on_vehicle => dull(0.3),
        _ => dull(0.45),
    }
}

/// The surface that one ray meets.
#[derive(Debug, Clone, Copy)]
struct Sight {
    /// Index of the pixel.
    pixel: u32,
    /// Distance, m; infinite for the sky.
    distance_m: f32,
    towards: DVec3,
    normal: DVec3,
    look: Look,
    /// Relative change of the reflectance by the grain.
    grain: f32,
}

/// Uniform in (-√3, √3), so of variance one, for each cell of the ground.
fn grain_at(p: DVec3) -> f64 {
    let cell = (p / GRAIN_M).floor();
    let word = |x: f64| (x as i64) as u32;
    let [w, ..] = philox4x32_10([word(cell.x), word(cell.y), word(cell.z), 0], [0x6ea1, 0]);
    (f64::from(w) / 2f64.powi(31) - 1.0) * 3f64.sqrt()
}

/// A scene as the camera sees it, without light, from which one image for each [`Light`] is made.
pub struct View {
    camera: Camera,
    sights: Vec<Sight>,
    /// Pose of the vehicle in the world.
    pose: Pose<Vehicle, World>,
    eye: DVec3,
}

impl View {
    /// Finds the closest hits through every pixel, with sixteen rays where a pixel's neighbours differ, so
    /// that thin paint keeps its share.
    ///
    /// # Errors
    /// Returns an error for a camera that fails [`Camera::validate`].
    pub fn new(
        geometry: &Geometry,
        scene: &Scene,
        pose: &Pose<Vehicle, World>,
        camera: &Camera,
    ) -> Result<View> {
        let why = |e: catseye_lane::LaneError| BadInput::new(e.to_string()).key("camera");
        camera.validate().map_err(why)?;
        let painted: Vec<[Look; 2]> =
            geometry.materials.iter().map(|m| [look_of(m, false), look_of(m, true)]).collect();
        let of_vehicle = |id: u32| scene.object_by_id(id).is_some_and(|o| is_vehicle(&o.class));
        let on_vehicle: Vec<bool> = geometry.bodies.iter().map(|b| of_vehicle(b.id)).collect();
        let eye = pose.point(camera.position_m);
        let (w, h) = (camera.width_px, camera.height_px);
        let corner = camera.ray(DVec2::ZERO);
        let (du, dv) = (camera.ray(DVec2::X) - corner, camera.ray(DVec2::Y) - corner);
        // (surface, body), which tell whether neighbours differ.
        let see = |p: DVec2, pixel: u32| -> (Sight, [u32; 2]) {
            let towards = pose.direction((corner + du * p.x + dv * p.y).normalize());
            let hit = geometry.bvh.closest_hit(&geometry.triangles, eye, towards, u32::MAX, f64::INFINITY);
            let none = Look { albedo: 0.0, retro: 0.0, roughness: 0.0, grain: false };
            let Some(hit) = hit else {
                let (distance_m, normal) = (f32::INFINITY, -towards);
                return (Sight { pixel, distance_m, towards, normal, look: none, grain: 0.0 }, [u32::MAX; 2]);
            };
            let t = &geometry.triangles[hit.triangle as usize];
            let look = painted
                .get(t.surface as usize)
                .map_or(none, |l| l[usize::from(on_vehicle.get(t.body as usize).copied().unwrap_or(false))]);
            let normal = if t.normal.dot(towards) > 0.0 { -t.normal } else { t.normal };
            let grain = if look.grain { grain_at(eye + towards * hit.t) as f32 } else { 0.0 };
            (Sight { pixel, distance_m: hit.t as f32, towards, normal, look, grain }, [t.surface, t.body])
        };
        let coarse: Vec<(Sight, [u32; 2])> = (0..w * h)
            .into_par_iter()
            .with_min_len(4 * w)
            .map(|i| see(DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5), i as u32))
            .collect();
        let uneven = |i: usize| {
            let (u, v) = (i % w, i / w);
            let around = (v.saturating_sub(1)..(v + 2).min(h))
                .flat_map(|y| (u.saturating_sub(1)..(u + 2).min(w)).map(move |x| y * w + x));
            around.into_iter().any(|j| coarse[j].1 != coarse[i].1)
        };
        let rows: Vec<Vec<Sight>> = (0..h)
            .into_par_iter()
            .map(|v| {
                let mut out = Vec::with_capacity(2 * w);
                for u in 0..w {
                    let i = v * w + u;
                    // Grain is finer than a far pixel, and one ray would alias it.
                    let rough = coarse[i].0.look.grain && coarse[i].0.distance_m < 40.0;
                    if !uneven(i) && !rough {
                        out.push(coarse[i].0);
                        continue;
                    }
                    let fine = if uneven(i) { FINE } else { 2 };
                    for k in 0..fine * fine {
                        let at = |k: usize| (k as f64 + 0.5) / fine as f64;
                        let p = DVec2::new(u as f64 + at(k % fine), v as f64 + at(k / fine));
                        out.push(see(p, i as u32).0);
                    }
                }
                out
            })
            .collect();
        let sights = rows.concat();
        Ok(View { camera: camera.clone(), sights, pose: *pose, eye })
    }

    /// Makes the image in this light. `geometry` must be that of the view, as the sun's shadows are traced in
    /// it.
    ///
    /// # Errors
    /// Returns an error if a value of `light` is non-finite or negative.
    pub fn lit(&self, geometry: &Geometry, light: &Light, seed: u64) -> Result<Image> {
        let sound = |v: f64| v.is_finite() && v >= 0.0;
        let levels = sound(light.sun_lx) && sound(light.sky_lx) && sound(light.stray);
        let direction = (light.sun_azimuth_rad + light.sun_elevation_rad).is_finite();
        if !(levels && direction) || light.visibility_m.is_some_and(|v| !(v.is_finite() && v > 0.0)) {
            let all = format!("{light:?}");
            return Err(BadInput::new("is not possible for a light")
                .value(all)
                .allowed("finite, not negative")
                .into());
        }
        let luminance: Vec<f64> =
            self.sights.par_iter().with_min_len(4096).map(|s| self.luminance(geometry, light, s)).collect();
        let pixels = self.camera.width_px * self.camera.height_px;
        let (mut sum, mut count) = (vec![0.0; pixels], vec![0u32; pixels]);
        for (s, l) in self.sights.iter().zip(&luminance) {
            sum[s.pixel as usize] += l;
            count[s.pixel as usize] += 1;
        }
        let mut grey: Vec<f64> = sum.iter().zip(&count).map(|(s, n)| s / f64::from((*n).max(1))).collect();
        self.stray(light, &mut grey);
        // White under noon light fills a pixel at exposure 1.
        let white = NOON_LX / PI;
        let horizon = self.camera.centre_px.y - self.camera.focal_px.y * self.camera.pitch_rad.tan();
        let first = horizon.clamp(0.0, 0.9 * self.camera.height_px as f64) as usize * self.camera.width_px;
        let mean = grey[first..].iter().sum::<f64>() / (pixels - first).max(1) as f64 / white;
        let exposure = (MEAN_GREY / mean.max(1e-12)).clamp(EXPOSURES[0], EXPOSURES[1]);
        let mut draws = draws(seed, 0xca3e);
        let out = grey.iter().map(|l| {
            let electrons = (l / white * exposure * FULL_WELL).min(1e9);
            let noisy = electrons + (electrons + READ_NOISE * READ_NOISE).sqrt() * draws.normal();
            (noisy / FULL_WELL).clamp(0.0, 1.0) as f32
        });
        let why = |e: catseye_lane::LaneError| BadInput::new(e.to_string()).key("camera");
        Ok(Image::new(self.camera.width_px, self.camera.height_px, out.collect()).map_err(why)?)
    }

    /// Luminance along one ray, cd/m².
    fn luminance(&self, geometry: &Geometry, light: &Light, s: &Sight) -> f64 {
        let sky = light.sky_lx / PI;
        let extinction = light.visibility_m.map_or(0.0, |v| 50f64.ln() / v);
        // Fog has the sky's luminance (Koschmieder); at night it is dark.
        let passed = (-extinction * f64::from(s.distance_m)).exp();
        if s.distance_m.is_infinite() {
            // The overcast horizon is half as bright again as the mean; fog leaves its own.
            return if light.visibility_m.is_some() { sky } else { 1.3 * sky };
        }
        let at = self.eye + s.towards * f64::from(s.distance_m);
        let albedo = s.look.albedo * (1.0 + GRAIN * f64::from(s.grain));
        let mut out = albedo / PI * light.sky_lx * 0.5 * (1.0 + s.normal.z);
        let sun = self.pose.direction(light.sun_towards());
        let facing = s.normal.dot(sun);
        let lift = s.normal * 1e-3;
        if light.sun_lx > 0.0
            && facing > 0.0
            && !geometry.bvh.any_hit(&geometry.triangles, at + lift, sun, u32::MAX, f64::INFINITY)
        {
            out += light.sun_lx * facing * (albedo / PI + glint(s, sun));
        }
        if light.lamps {
            out += LAMPS_M.iter().map(|lamp| self.by_lamp(s, *lamp, at, albedo)).sum::<f64>();
        }
        out * passed + sky * (1.0 - passed)
    }

    /// Luminance by one headlamp, cd/m²: diffuse (Lambert) and retroreflected by paint and asphalt.
    fn by_lamp(&self, s: &Sight, lamp: DVec3, at: DVec3, albedo: f64) -> f64 {
        let from = at - self.pose.point(lamp);
        let own = self.pose.rotation.inverse() * from;
        if own.x <= 0.1 {
            return 0.0;
        }
        let distance2 = from.length_squared();
        let (azimuth, elevation) = (own.y.atan2(own.x), own.z.atan2(own.x.hypot(own.y)));
        // 1 % below the level lies the cut-off; light falls off below it over some degrees, and to the sides over twelve.
        let below = -0.01 - elevation;
        let upright = if below > 0.0 { (-below / 0.06).exp() } else { 0.02 };
        let across_lx = LAMP_CD * upright * (-0.5 * (azimuth / 0.2).powi(2)).exp() / distance2;
        let facing = (-s.normal.dot(from) / distance2.sqrt()).max(0.0);
        across_lx * (albedo / PI * facing + s.look.retro * (1.0 + GRAIN * f64::from(s.grain)))
    }

    /// Adds the stray light from the sun and from the sky in the image to all pixels, cd/m².
    fn stray(&self, light: &Light, grey: &mut [f64]) {
        if light.sun_lx == 0.0 {
            return;
        }
        let sun = light.sun_towards();
        let corner = self.camera.ray(DVec2::ZERO);
        let (du, dv) = (self.camera.ray(DVec2::X) - corner, self.camera.ray(DVec2::Y) - corner);
        let w = self.camera.width_px;
        for (i, g) in grey.iter_mut().enumerate() {
            let p = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
            let off = (corner + du * p.x + dv * p.y).angle_between(sun);
            // The sun behind the roof does not light the windscreen.
            if off < FRAC_PI_2 {
                *g += light.stray * 10.0 * light.sun_lx / off.to_degrees().max(0.27).powi(2);
            }
        }
    }
}

/// The sun's reflection in rough asphalt or paint, 1/sr: Cook and Torrance with GGX facets, refractive index
/// 1.5.
fn glint(s: &Sight, sun: DVec3) -> f64 {
    if s.look.roughness <= 0.0 {
        return 0.0;
    }
    let eye = -s.towards;
    let Some(half) = (eye + sun).try_normalize() else { return 0.0 };
    let (no, ni, nh) =
        (s.normal.dot(eye).max(1e-3), s.normal.dot(sun).max(1e-3), s.normal.dot(half).max(0.0));
    let a2 = s.look.roughness.powi(4);
    let facets = a2 / (PI * (nh * nh * (a2 - 1.0) + 1.0).powi(2));
    let hidden = |c: f64| 2.0 * c / (c + (a2 + (1.0 - a2) * c * c).sqrt());
    let c = eye.dot(half).clamp(0.0, 1.0);
    let fresnel = 0.04 + 0.96 * (1.0 - c).powi(5);
    // A grain is a facet of its own.
    let grain = (1.0 + 2.0 * GRAIN * f64::from(s.grain)).max(0.0);
    fresnel * facets * hidden(no) * hidden(ni) / (4.0 * no * ni) * grain
}
