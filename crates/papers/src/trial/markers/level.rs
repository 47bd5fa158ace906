//! The cross section of a scene's markers, for the check of levels (Feng 2019, section 5.1.5).

use crate::trial::kit::*;
use catseye::rcs::{Aspect, BistaticAspect, RcsOptions};
use catseye::road::reflector::Reflector;
use catseye::scene::material;
use catseye_lane::markers::estimator::MarkerRcs;

/// Distances for whose elevations the cross section is computed, m.
const DISTANCES_M: [f64; 7] = [4.0, 6.0, 9.0, 14.0, 22.0, 35.0, 60.0];
/// Largest azimuth to each side and step between azimuths, degrees.
const WIDEST_DEG: i32 = 75;
const STEP_DEG: i32 = 3;
/// Offsets of the directions that are averaged for each azimuth, degrees: a row's direction is not known to
/// the width of its lobes.
const SPREAD_DEG: [f64; 3] = [-1.0, 0.0, 1.0];

#[derive(Serialize, Deserialize)]
struct Table {
    azimuth_rad: Vec<f64>,
    elevation_rad: Vec<f64>,
    dbsm: Vec<f64>,
}

/// Cross section of the reflector of the first row in the scene, for the radar's polarisation (V), in free
/// space: the road under it changes the level of a whole row alike. None without a row or an echo from ahead.
pub fn of_first_row(given: &TrialContext<'_>, site: &Site, radar: &Radar) -> Result<Option<MarkerRcs>> {
    let Some(row) = site.road.iter().flat_map(|r| &r.marker_rows).next() else { return Ok(None) };
    let table = given.kept("marker_rcs", || table(given, &row.reflector, radar))?;
    Ok(MarkerRcs::new(table.azimuth_rad, table.elevation_rad, table.dbsm).ok())
}

fn table(given: &TrialContext<'_>, spec: &str, radar: &Radar) -> Result<Table> {
    let scene = Reflector::parse(spec)?.to_scene(&material::parse_spec)?;
    let height_m = radar.mounting.translation_m.z.max(0.01);
    // Rising: the farthest is the flattest.
    let mut elevation_rad: Vec<f64> = DISTANCES_M.iter().map(|d| (height_m / d).min(0.9).asin()).collect();
    elevation_rad.sort_by(f64::total_cmp);
    let azimuth_rad: Vec<f64> =
        (-WIDEST_DEG..=WIDEST_DEG).step_by(STEP_DEG as usize).map(|a| f64::from(a).to_radians()).collect();
    let mut looks = Vec::new();
    for elevation in &elevation_rad {
        for azimuth in &azimuth_rad {
            for off in SPREAD_DEG {
                let aspect = Aspect { azimuth: azimuth + off.to_radians(), elevation: *elevation };
                looks.push(BistaticAspect::monostatic(aspect));
            }
        }
    }
    let options = RcsOptions { last: false, ..RcsOptions::default() };
    let s = given.engine.rcs(&scene, &[radar.carrier_hz], &looks, &options)?;
    let dbsm = s
        .chunks(SPREAD_DEG.len())
        .map(|c| {
            let power = c.iter().map(|s| s.every[0][0].norm_sqr()).sum::<f64>() / c.len() as f64;
            // Silence is as far down as files hold it.
            (10.0 * (4.0 * std::f64::consts::PI * power).log10()).max(-300.0)
        })
        .collect();
    Ok(Table { azimuth_rad, elevation_rad, dbsm })
}
