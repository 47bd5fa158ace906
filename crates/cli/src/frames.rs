//! What `simulate`, `process` and `demo` share: the pictures of a frame.

use super::footprint::footprint;
use catseye::base::error::Result;
use catseye::base::units::dbm_from_w;
use catseye::detect::{Point, locate, unmarked};
use catseye::dsp::{Cell, RangeDoppler as Map};
use catseye::road::TruthBox;
use catseye::road::actors::{actor_boxes, is_ground};
use catseye::road::mask::{self, CellClass, Grid, Level};
use catseye::scene::radar::Radar;
use catseye::scene::scenario::SitedScenario;
use catseye::scene::{Object, Scene, Shape};
use catseye::simulate::Frame;
use catseye::simulate::thermal_floor::thermal_floor_w;
use catseye::simulate::truth::Truth;
use catseye_io::manifest::Axes;
use catseye_plot::{
    BirdsEye, BirdsEyePoint, FieldOfView, LabelledPoint, Labels, MaskPicture, Outline, RangeDoppler,
    RangeProfile, RoadLine, Unmarked, birds_eye, labels, mask_picture, range_doppler, range_profile,
};
use glam::DVec3;
use std::path::Path;

/// Range-Doppler map and range profile.
pub fn draw_map(title: &str, radar: &Radar, map: &Map<f64>, points: &[Point], dir: &Path) -> Result<()> {
    let axes = Axes::of(radar);
    let (range_m, range_rate_mps) = (axes.range_m.values(), axes.range_rate_mps.values());
    let power_w: Vec<f32> = map.map.data.iter().map(|p| *p as f32).collect();
    let detections: Vec<[f64; 2]> = points.iter().map(|p| [p.range_m, p.range_rate_mps]).collect();
    // The map is the first ramp's.
    let part = radar.part(0);
    let none: Vec<Unmarked> = unmarked::of_map(&part, map, points, &locate::accuracy(&part)?)
        .into_iter()
        .map(|(c, why)| Unmarked {
            at: [range_m[c.range as usize], range_rate_mps[c.doppler as usize]],
            why: why.text(),
        })
        .collect();
    range_doppler(&RangeDoppler {
        title: &format!("{title}: range-Doppler map, {} points", points.len()),
        power_w: &power_w,
        range_m: &range_m,
        range_rate_mps: &range_rate_mps,
        detections: &detections,
        unmarked: &none,
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
    let noise = catseye::dsp::cpu::noise(&map.map, &radar.processing.cfar, map.snapshots.channels, &line)?;
    let threshold: Vec<f64> = noise.iter().zip(&map.detection.ratio).map(|(n, r)| dbm(n * r)).collect();
    let marks: Vec<[f64; 2]> = map
        .cells
        .iter()
        .filter(|c| c.doppler as usize == row)
        .map(|c| [range_m[c.range as usize], power[c.range as usize]])
        .collect();
    let none: Vec<Unmarked> = unmarked::of_row(&part, map, row)
        .into_iter()
        .map(|(r, why)| Unmarked { at: [range_m[r], power[r]], why: why.text() })
        .collect();
    range_profile(&RangeProfile {
        title: &format!(
            "{title}: range profile at {} m/s range rate",
            format!("{:.2}", range_rate_mps[row]).replace('-', "−")
        ),
        range_m: &range_m,
        power_dbm: &power,
        threshold_dbm: &threshold,
        noise_dbm: thermal_floor_w(radar).map(dbm),
        detections: &marks,
        unmarked: &none,
    })?
    .write(dir.join("range_profile.png"), true)?;
    Ok(())
}

/// All pictures of a simulated frame.
///
/// # Errors
/// Returns an error for a picture that cannot be drawn or written.
pub fn draw_frame(
    scenario: &SitedScenario,
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

    let objects = outlines(scene, &truth.boxes, frame.time_s);
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
    draw_labels(&title, scenario, scene, frame, truth, dir)
}

/// Outlines of the objects of a scene seen from above at a time, in s, the ground first; `boxes` are those of the objects.
pub fn outlines(scene: &Scene, boxes: &[TruthBox], time_s: f64) -> Vec<Outline> {
    let mut objects: Vec<Outline> = Vec::new();
    let mut order: Vec<usize> = (0..scene.objects.len()).collect();
    order.sort_by_key(|&i| !is_ground(&scene.objects[i].class));
    for i in order {
        let (o, b) = (&scene.objects[i], &boxes[i]);
        match o.shape {
            Shape::Point { .. } | Shape::Table(_) => {
                objects.push(Outline::whole(&o.class, vec![[b.centre_m[0], b.centre_m[1]]]));
            }
            Shape::Mesh(_) => objects.extend(footprint(scene, o, time_s, corners(o, b))),
        }
    }
    objects
}

/// The truth of a frame with its labelled points, and the masks where they are asked for.
fn draw_labels(
    title: &str,
    scenario: &SitedScenario,
    scene: &Scene,
    frame: &Frame,
    truth: &Truth,
    dir: &Path,
) -> Result<()> {
    let at = frame.pose.translation_m;
    let boxes = actor_boxes(scene, frame.time_s);
    let objects: Vec<Outline> = boxes
        .iter()
        .map(|b| (b, &scene.objects[b.parts[0]]))
        .filter(|(_, o)| !is_ground(&o.class))
        .flat_map(|(b, o)| match (b.size_m() == DVec3::ZERO, &b.parts[..]) {
            (true, _) => vec![Outline::whole(&o.class, vec![b.outline_m()[0]])],
            (false, [_]) => footprint(scene, o, frame.time_s, b.outline_m()),
            (false, _) => vec![Outline::whole(&o.class, b.outline_m().to_vec())],
        })
        .collect();
    let flat = |line: &[[f64; 3]]| line.iter().map(|p| [p[0], p[1]]).collect();
    let edges = truth.lanes.iter().flat_map(|l| [&l.left_m, &l.right_m]);
    let lines: Vec<RoadLine> = edges
        .map(|l| RoadLine { points_m: flat(l), edge: true })
        .chain(truth.lane_lines.iter().map(|l| RoadLine { points_m: flat(&l.points_m), edge: false }))
        .collect();
    let labelled = |place: &dyn Fn(DVec3) -> [f64; 2]| -> Vec<LabelledPoint> {
        let of = |p: &Point| LabelledPoint {
            at_m: place(frame.pose.point(p.position_m)),
            class: p.class.clone(),
            flag: p.flag(),
        };
        frame.points.iter().map(of).collect()
    };
    labels(&Labels {
        scene: BirdsEye {
            title: &format!("{title}: labels"),
            objects: &objects,
            radars: &[FieldOfView { x_m: at.x, y_m: at.y, ..Default::default() }],
            limits_m: limits(scene, truth, at, scenario.radars[frame.radar].max_range_m()),
            ..Default::default()
        },
        lines: &lines,
        free_space_m: truth.free_space.as_ref().map_or(&[], |f| f.polygon_m.as_slice()),
        points: &labelled(&|p| [p.x, p.y]),
    })?
    .write(dir.join("labels.png"), true)?;
    if !scenario.output.masks {
        return Ok(());
    }
    let level = Level::of(&frame.pose);
    let names = CellClass::ALL.map(CellClass::name);
    for (name, grid, classes) in
        [("road", Grid::ROAD, &mask::ROAD_CLASSES), ("markers", Grid::MARKERS, &mask::MARKER_CLASSES)]
    {
        mask_picture(&MaskPicture {
            title: &format!("{title}: mask_{name}.npy and points"),
            cells: &mask::mask(&grid, scene, frame.time_s, &frame.pose, &truth.lanes, classes),
            rows: grid.rows,
            columns: grid.columns,
            ahead_m: grid.ahead_m,
            across_m: grid.across_m,
            names: &names,
            points: &labelled(&|p| level.from_world(p).to_array()),
        })?
        .write(dir.join(format!("mask_{name}.png")), true)?;
    }
    Ok(())
}

/// Corners of an object's box seen from above.
fn corners(object: &Object, truth: &TruthBox) -> [[f64; 2]; 4] {
    let half = 0.5 * DVec3::from_array(truth.size_m);
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(sx, sy)| {
        let out = object.pose.direction(DVec3::new(sx * half.x, sy * half.y, 0.0));
        [truth.centre_m[0] + out.x, truth.centre_m[1] + out.y]
    })
}

/// What the radar can see of the scene: the objects that are not ground, cut at its largest range.
fn limits(scene: &Scene, truth: &Truth, radar: DVec3, range_m: f64) -> Option<[[f64; 2]; 2]> {
    let mut lo = [radar.x, radar.y];
    let mut hi = lo;
    for (o, b) in scene.objects.iter().zip(&truth.boxes) {
        if is_ground(&o.class) {
            continue;
        }
        for c in corners(o, b) {
            for (k, x) in c.into_iter().enumerate() {
                let x = x.clamp([radar.x, radar.y][k] - range_m, [radar.x, radar.y][k] + range_m);
                lo[k] = lo[k].min(x);
                hi[k] = hi[k].max(x);
            }
        }
    }
    let margin = 2.0;
    (hi[0] - lo[0] > 1.0).then(|| [[lo[0] - margin, lo[1] - margin], [hi[0] + margin, hi[1] + margin]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::engine::{Engine, Precision};
    use catseye::formats::npy;
    use catseye::road::{build, scene_toml};
    use catseye::scene::scenario;
    use catseye::simulate::simulate;
    use catseye_io::files::write_masks;
    use std::time::Instant;

    const ROAD: &str = r#"
name = "walled bend"
[[road]]
name = "main"
plan = [{ kind = "straight", length_m = 25 }, { kind = "arc", length_m = 90, radius_m = 120 }]
left = [{ number = 1, width_m = 3.5, driven = "backward", line = "solid" }]
right = [{ number = 2, width_m = 3.5, line = "solid" }, { number = 3, kind = "shoulder", width_m = 1.5 }]
centre_line = "dashed"
verge = [{ side = "left", width_m = 8 }]
[[road.wall]]
lateral = { edge = "right", offset_m = -0.5 }
material = "aluminium"
[[road.rail]]
lateral = { edge = "left", offset_m = 0.8 }
[[road.markers]]
name = "coded"
reflector = "type1:width_m=0.16,height_m=0.01,length_m=0.117"
lateral = { lane = 2, side = "right", offset_m = 0.3 }
from_m = 6
code = { word = "1011", zero_m = 2, one_m = 3, sync_m = 5 }
[[road.vehicle]]
kind = "sedan"
name = "ahead"
s_m = 30
lateral = { lane = 2 }
speed_mps = 8
[[road.vehicle]]
kind = "van"
name = "coming"
s_m = 45
lateral = { lane = 1 }
speed_mps = 12
"#;

    /// CATSEYE_PICTURE_DIR keeps the pictures.
    #[test]
    fn pictures_and_masks_of_a_road() {
        let plan = scene_toml::parse(Path::new("road.toml"), ROAD).unwrap();
        let (scene, road) = build::build(&plan).unwrap();
        let text = "name = \"bend\"\nradar = \"demo77\"\n[[point]]\nposition_m = [500, 0, 0]\nrcs_dbsm = 0\n\
                    [ego]\nposition_m = [3, -1.5, 0]\nspeed_mps = 10\n[output]\nmasks = true\n[trace]\nfacets = 0\n";
        let s = scenario::parse(Path::new("s.toml"), text).unwrap().without_roads().unwrap();
        let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
        let start = Instant::now();
        let truth = Truth::new(&s, &scene, &frame, Some(&road));
        println!(
            "truth {:.1} ms of {} triangles",
            1e3 * start.elapsed().as_secs_f64(),
            scene.triangle_count()
        );
        let kept = std::env::var("CATSEYE_PICTURE_DIR");
        let t = tempfile::tempdir().unwrap();
        let dir = kept.map_or(t.path().to_path_buf(), std::path::PathBuf::from);
        let start = Instant::now();
        write_masks(&dir, &scene, &frame, &truth).unwrap();
        println!("masks {:.1} ms", 1e3 * start.elapsed().as_secs_f64());
        draw_frame(&s, &scene, &frame, &truth, &dir).unwrap();
        for name in ["birds_eye", "labels", "mask_road", "mask_markers", "range_doppler", "range_profile"] {
            assert!(dir.join(format!("{name}.png")).is_file(), "{name}");
        }
        // A car of several parts is one actor.
        let cars: Vec<_> = truth.actors.iter().filter(|a| a.whole.class == "car").collect();
        assert_eq!((cars.len(), cars[0].parts.len() > 4), (1, true));
        let place = truth.ego_lane.as_ref().unwrap();
        assert!(place.number == 2 && (place.offset_m - 0.25).abs() < 1e-9, "{place:?}");
        assert!(truth.markers.iter().any(|m| m.bit == Some(3) && m.word.as_deref() == Some("1011")));
        // The mask's file has the van of the oncoming lane left of the car ahead.
        let mask: npy::Array<u8> = npy::read(dir.join("mask_road.npy")).unwrap();
        assert_eq!(mask.shape, [450, 300]);
        let level = Level::of(&frame.pose);
        for (class, left) in [("car", false), ("van", true)] {
            let a = truth.actors.iter().find(|a| a.whole.class == class).unwrap();
            let at = level.from_world(DVec3::from_array(a.whole.centre_m));
            let cell = Grid::ROAD.cell(at.x, at.y).unwrap();
            assert_eq!(mask.data[cell], CellClass::Vehicle as u8, "{class}");
            assert!(!left || at.y > 3.0, "{at}");
        }
        let wall = mask.data.iter().enumerate().filter(|(_, c)| **c == CellClass::GuardRail as u8);
        let (left, right): (Vec<_>, Vec<_>) =
            wall.filter(|(i, _)| i / 300 < 100).partition(|(i, _)| i % 300 < 150);
        assert!(left.len() > 50 && right.len() > 50, "{} {}", left.len(), right.len());
        let planes: npy::Array<f32> = npy::read(dir.join("grid_road.npy")).unwrap();
        assert_eq!(planes.shape, [4, 450, 300]);
        assert!(planes.data[..450 * 300].iter().sum::<f32>() > 0.0);
    }
}
