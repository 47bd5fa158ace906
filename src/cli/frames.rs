//! What `simulate`, `process` and `demo` share: the pictures of a frame.

use crate::cpu;
use crate::dataset::files::Truth;
use crate::dataset::frame::Frame;
use crate::dataset::manifest::Axes;
use crate::detect::Point;
use crate::dsp::{Cell, RangeDoppler as Map};
use crate::error::Result;
use crate::plot::{
    BirdsEye, BirdsEyePoint, FieldOfView, Outline, RangeDoppler, RangeProfile, birds_eye, range_doppler,
    range_profile,
};
use crate::scene::radar::Radar;
use crate::scene::scenario::Scenario;
use crate::scene::{Scene, Shape};
use crate::units::dbm_from_w;
use glam::DVec3;
use std::path::Path;

/// Classes of ground, drawn first.
const GROUND: [&str; 4] = ["road", "verge", "ground", "terrain"];

/// Range-Doppler map and range profile.
pub fn draw_map(title: &str, radar: &Radar, map: &Map<f64>, points: &[Point], dir: &Path) -> Result<()> {
    let axes = Axes::of(radar);
    let (range_m, range_rate_mps) = (axes.range_m.values(), axes.range_rate_mps.values());
    let power_w: Vec<f32> = map.map.data.iter().map(|p| *p as f32).collect();
    let detections: Vec<[f64; 2]> = points.iter().map(|p| [p.range_m, p.range_rate_mps]).collect();
    range_doppler(&RangeDoppler {
        title: &format!("{title}: range-Doppler map, {} points", points.len()),
        power_w: &power_w,
        range_m: &range_m,
        range_rate_mps: &range_rate_mps,
        detections: &detections,
    })?
    .write(dir.join("range_doppler.png"), true)?;

    // The row in which most cells were detected shows most of the detector's work.
    let mut count = vec![0usize; map.map.doppler_bins];
    for c in &map.cells {
        count[c.doppler as usize] += 1;
    }
    let row = (0..count.len()).max_by_key(|&d| (count[d], std::cmp::Reverse(d))).unwrap_or(0);
    let bins = map.map.range_bins;
    let cells = row * bins..(row + 1) * bins;
    let dbm = |w: f64| dbm_from_w(w);
    let power: Vec<f64> = map.map.data[cells.clone()].iter().map(|p| dbm(*p)).collect();
    let line: Vec<Cell> = (0..bins).map(|r| Cell { doppler: row as u32, range: r as u32 }).collect();
    let noise = cpu::dsp::noise(&map.map, &radar.processing.cfar, map.snapshots.channels, &line)?;
    let threshold: Vec<f64> = noise.iter().zip(&map.detection.ratio).map(|(n, r)| dbm(n * r)).collect();
    let marks: Vec<[f64; 2]> = map
        .cells
        .iter()
        .filter(|c| c.doppler as usize == row)
        .map(|c| [range_m[c.range as usize], power[c.range as usize]])
        .collect();
    range_profile(&RangeProfile {
        title: &format!("{title}: range profile at {:.2} m/s range rate", range_rate_mps[row]),
        range_m: &range_m,
        power_dbm: &power,
        threshold_dbm: &threshold,
        noise_dbm: thermal_floor_w(radar).map(dbm),
        detections: &marks,
    })?
    .write(dir.join("range_profile.png"), true)?;
    Ok(())
}

/// Mean thermal noise in a cell of the map: windows widen the noise bandwidth.
fn thermal_floor_w(radar: &Radar) -> Option<f64> {
    let noise = crate::adc::noise::Noise::thermal(radar, 0, 0)?;
    let spread = |w, n: usize| -> Option<f64> {
        let c = crate::dsp::window::coefficients(w, n).ok()?;
        let sum: f64 = c.iter().sum();
        Some(c.iter().map(|x| x * x).sum::<f64>() / (sum * sum))
    };
    let p = &radar.processing;
    // A real sample has half the variance of a complex one, and its spectrum is doubled.
    Some(
        2.0 * noise.sigma
            * noise.sigma
            * spread(p.range_window, radar.samples)?
            * spread(p.doppler_window, radar.chirps)?,
    )
}

/// All pictures of a simulated frame.
pub fn draw_frame(
    scenario: &Scenario,
    scene: &Scene,
    frame: &Frame,
    truth: &Truth,
    dir: &Path,
) -> Result<()> {
    let mut title = scenario.name.clone();
    if scenario.radars.len() > 1 {
        title += &format!(", radar {}", scenario.radars[frame.radar].name);
    }
    if scenario.frames.count > 1 {
        title += &format!(", frame {}", frame.index);
    }
    draw_map(&title, &scenario.radars[frame.radar], &frame.maps[0], &frame.points, dir)?;

    let mut objects: Vec<Outline> = Vec::new();
    let mut order: Vec<usize> = (0..scene.objects.len()).collect();
    order.sort_by_key(|&i| !GROUND.contains(&scene.objects[i].class.as_str()));
    for i in order {
        let (o, b) = (&scene.objects[i], &truth.boxes[i]);
        let centre = DVec3::from_array(b.centre_m);
        let half = 0.5 * DVec3::from_array(b.size_m);
        let polygon = match o.shape {
            Shape::Point { .. } | Shape::Table(_) => vec![[centre.x, centre.y]],
            Shape::Mesh(_) => [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .iter()
                .map(|(sx, sy)| {
                    let p = centre + o.pose.direction(DVec3::new(sx * half.x, sy * half.y, 0.0));
                    [p.x, p.y]
                })
                .collect(),
        };
        objects.push(Outline { class: o.class.clone(), polygon });
    }
    let points: Vec<BirdsEyePoint> = frame
        .points
        .iter()
        .map(|p| {
            let at = frame.pose.point(p.position_m);
            BirdsEyePoint { x_m: at.x, y_m: at.y, value: p.range_rate_mps }
        })
        .collect();
    let ahead = frame.pose.direction(DVec3::X);
    let at = frame.pose.translation_m;
    let radar = &scenario.radars[frame.radar];
    let field = FieldOfView {
        x_m: at.x,
        y_m: at.y,
        yaw_rad: ahead.y.atan2(ahead.x),
        half_angle_rad: radar.processing.azimuth_fov_rad,
        range_m: radar.max_range_m(),
    };
    birds_eye(&BirdsEye {
        title: &format!("{title}: scene from above and points"),
        objects: &objects,
        points: &points,
        radars: &[field],
        limits_m: limits(scene, truth, at, radar.max_range_m()),
        colour_label: None,
    })?
    .write(dir.join("birds_eye.png"), true)?;
    Ok(())
}

/// What the radar can see of the scene: the objects that are not ground, cut at its largest range.
fn limits(scene: &Scene, truth: &Truth, radar: DVec3, range_m: f64) -> Option<[[f64; 2]; 2]> {
    let mut lo = [radar.x, radar.y];
    let mut hi = lo;
    for (o, b) in scene.objects.iter().zip(&truth.boxes) {
        if GROUND.contains(&o.class.as_str()) {
            continue;
        }
        let half = 0.5 * DVec3::from_array(b.size_m);
        for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let c =
                DVec3::from_array(b.centre_m) + o.pose.direction(DVec3::new(sx * half.x, sy * half.y, 0.0));
            for (k, x) in [c.x, c.y].into_iter().enumerate() {
                let x = x.clamp([radar.x, radar.y][k] - range_m, [radar.x, radar.y][k] + range_m);
                lo[k] = lo[k].min(x);
                hi[k] = hi[k].max(x);
            }
        }
    }
    let margin = 2.0;
    (hi[0] - lo[0] > 1.0).then(|| [[lo[0] - margin, lo[1] - margin], [hi[0] + margin, hi[1] + margin]])
}
