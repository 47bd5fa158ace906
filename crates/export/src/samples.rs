//! A small sequence whose every value is known, for the tests here and for the public readers (`python/tests/readers`), which get
//! it as files in the folder of the environment variable `CATSEYE_SAMPLES`.

use super::*;
use catseye::road::mask::CellClass;
use serde_json::{Value, json};

/// A sweep of nothing.
pub fn empty(radar: &str, frame: u64, time_ns: i64) -> Sweep {
    Sweep {
        time_ns,
        frame,
        radar: radar.into(),
        sensor_in_vehicle: Pose::IDENTITY,
        vehicle_in_world: Pose::IDENTITY,
        vehicle_velocity_mps: DVec3::ZERO,
        yaw_rate_rad_per_s: 0.0,
        sensor_velocity_mps: DVec3::ZERO,
        points: Vec::new(),
        missing_flags: Vec::new(),
        boxes: Vec::new(),
        range_doppler: None,
        lanes: Vec::new(),
        drivable: Vec::new(),
        grids: Vec::new(),
        lidar: None,
    }
}

/// What a radar measures of a place that moves: from the definitions, not from [`Sweep`]'s own helpers.
fn seen(sweep: &Sweep, place_m: DVec3, velocity_mps: DVec3, object: Option<&SweepBox>) -> SweepPoint {
    let pose = sweep.sensor_in_world();
    let p = pose.inverse().point(place_m);
    let ray = (place_m - pose.translation_m).normalize();
    SweepPoint {
        position_m: p,
        range_m: p.length(),
        azimuth_rad: p.y.atan2(p.x),
        elevation_rad: p.z.atan2(p.x.hypot(p.y)),
        range_rate_mps: (velocity_mps - sweep.sensor_velocity_mps).dot(ray),
        rcs_dbsm: 3.25,
        snr_db: 21.5,
        power_dbm: -84.75,
        range_std_m: 0.02,
        azimuth_std_rad: Some(0.004),
        elevation_std_rad: None,
        range_rate_std_mps: 0.03,
        object_id: object.map_or(0, |b| b.id),
        class: object.map_or(String::new(), |b| b.class.clone()),
        ghost: false,
        moving: object.map(|b| b.moving),
    }
}

fn truth(time_s: f64) -> Vec<SweepBox> {
    let about = |id, class: &str, centre: DVec3, size: DVec3, yaw: f64, velocity: DVec3| SweepBox {
        id,
        class: class.into(),
        centre_m: centre + velocity * time_s,
        size_m: size,
        rotation: DQuat::from_rotation_z(yaw),
        velocity_mps: velocity,
        moving: velocity != DVec3::ZERO,
    };
    vec![
        about(
            7,
            "car",
            DVec3::new(30.0, 6.0, 0.8),
            DVec3::new(4.5, 1.8, 1.5),
            0.2,
            DVec3::new(9.0, 1.8, 0.0),
        ),
        about(
            8,
            "truck",
            DVec3::new(60.0, 10.0, 1.9),
            DVec3::new(12.0, 2.5, 3.6),
            -2.9,
            DVec3::new(-14.0, -3.4, 0.0),
        ),
        about(12, "guard_rail", DVec3::new(40.0, -6.0, 0.6), DVec3::new(80.0, 0.1, 0.3), 0.0, DVec3::ZERO),
    ]
}

/// A lane 3.5 m wide along x at y = -1.5 m that bends left by 5 m over 60 m, in the world.
fn lane_area() -> LaneArea {
    let line = |offset: f64| {
        (0..=40)
            .map(|i| {
                let x = 2.0 * f64::from(i) - 20.0;
                DVec3::new(x, -1.5 + offset + if x > 0.0 { 5.0 * (x / 60.0).powi(2) } else { 0.0 }, 0.0)
            })
            .collect()
    };
    LaneArea { left_m: line(1.75), right_m: line(-1.75) }
}

/// A grid with a lane that parts of two vehicles cover, a slanted line of the first class, and a few points.
fn grid(name: &str, rows: usize, columns: usize, classes: [CellClass; 2], frame: u64) -> MaskedGrid {
    let mut mask = vec![CellClass::Undefined as u8; rows * columns];
    let mut planes = vec![0f32; 4 * rows * columns];
    for row in 0..rows {
        for column in 0..columns {
            let at = row * columns + column;
            let line = (columns - 4).abs_diff(column) == row / 8;
            let near = (4..9).contains(&row) && (6..10).contains(&column);
            let far = row >= rows - 3 && (3..12).contains(&(column + frame as usize));
            mask[at] = match () {
                () if near || far => CellClass::Vehicle as u8,
                () if line => classes[0] as u8,
                () if (5..14).contains(&column) => CellClass::Lane as u8,
                () => CellClass::Undefined as u8,
            };
            if (row + 3 * column) % 17 == 0 {
                let count = 1 + (row + column) % 3;
                let values = [count as f32, 1.0 / (1 + row) as f32, row as f32, 0.01 * column as f32 - 0.1];
                for (plane, value) in values.into_iter().enumerate() {
                    planes[plane * rows * columns + at] = value;
                }
            }
        }
    }
    MaskedGrid {
        name: name.into(),
        rows,
        columns,
        cell_m: [1.0, 0.5],
        mask,
        classes: classes.to_vec(),
        planes,
    }
}

/// Two radars and two frames of a car that turns left; the last sweep has no points.
pub fn sweeps() -> Vec<Sweep> {
    let mut out = Vec::new();
    for frame in 0..2u64 {
        let time_s = 0.05 * frame as f64;
        for (radar, place, yaw) in
            [("front", DVec3::new(3.7, 0.1, 0.5), 0.05), ("left", DVec3::new(3.2, 0.9, 0.6), 1.1)]
        {
            let mut s = empty(radar, frame, 1_000_000_000 + (time_s * 1e9) as i64);
            s.vehicle_in_world = Pose::from_yaw_pitch_roll(
                DVec3::new(2.0 + 12.0 * time_s, -1.5, 0.0),
                0.3 + 0.2 * time_s,
                0.0,
                0.0,
            );
            s.sensor_in_vehicle = Pose::from_yaw_pitch_roll(place, yaw, -0.02, 0.01);
            s.yaw_rate_rad_per_s = 0.2;
            s.vehicle_velocity_mps = s.vehicle_in_world.rotation * DVec3::new(12.0, 0.0, 0.0);
            let arm = s.vehicle_in_world.rotation * place;
            s.sensor_velocity_mps = s.vehicle_velocity_mps + DVec3::new(0.0, 0.0, 0.2).cross(arm);
            s.boxes = truth(time_s);
            let boxes = s.boxes.clone();
            if (frame, radar) != (1, "left") {
                let at = |b: &SweepBox, offset: DVec3| b.centre_m + b.rotation * offset;
                let back = DVec3::new(-2.2, 0.3, -0.1);
                s.points = vec![
                    seen(&s, at(&boxes[0], back), boxes[0].velocity_mps, Some(&boxes[0])),
                    seen(&s, at(&boxes[1], -back), boxes[1].velocity_mps, Some(&boxes[1])),
                    seen(&s, at(&boxes[2], DVec3::new(5.0, 0.0, 0.1)), DVec3::ZERO, Some(&boxes[2])),
                    seen(&s, DVec3::new(25.0, 20.0, 1.0), DVec3::ZERO, None),
                    // The mirror image of the car behind the rail.
                    SweepPoint {
                        ghost: true,
                        ..seen(&s, DVec3::new(30.0, -18.0, 0.8), DVec3::new(9.0, -1.8, 0.0), Some(&boxes[0]))
                    },
                ];
                s.points[1].rcs_dbsm = -11.5;
                s.points[2].azimuth_std_rad = None;
            }
            let (rows, columns) = (8, 16);
            s.range_doppler = Some(PowerImage {
                doppler_rows: rows,
                range_columns: columns,
                // Every cell another level: 1 dB a column, 20 dB a row, below -30 dBm.
                power_w: (0..rows * columns)
                    .map(|i| {
                        let db = -60.0 - (i % columns) as f64 - 10.0 * ((i / columns) as f64 - 3.0).abs();
                        10f64.powf(0.1 * db) as f32
                    })
                    .collect(),
                first_range_m: 0.5,
                range_step_m: 0.75,
                first_range_rate_mps: -4.0,
                range_rate_step_mps: 1.0,
            });
            s.lanes = [(1u32, "left", 1.75), (2, "right", -1.75)]
                .map(|(id, name, y)| SweepLane {
                    id,
                    name: name.into(),
                    points_m: (0..=20)
                        .map(|i| {
                            let x = 5.0 * f64::from(i) - 10.0;
                            DVec3::new(x, y + 2e-3 * x * x, 1e-3 * x * x * f64::from(id - 1))
                        })
                        .collect(),
                })
                .to_vec();
            s.drivable = vec![lane_area()];
            s.grids = vec![grid("road", 48, 32, [CellClass::GuardRail, CellClass::Vehicle], frame)];
            s.grids.push(grid("markers", 20, 20, [CellClass::Marker, CellClass::Vehicle], frame));
            // One lidar on the vehicle, tilted and turned, which sees places of the world: the car's rear, and some beside it.
            let in_vehicle = Pose::from_yaw_pitch_roll(DVec3::new(0.9, 0.0, 1.9), 0.1, 0.03, 0.0);
            let into = in_vehicle.then(&s.vehicle_in_world).inverse();
            let car = &s.boxes[0];
            let rear = car.centre_m + car.rotation * DVec3::new(-2.2, 0.3, -0.1);
            let places = [rear, DVec3::new(20.0, -3.0, 0.0), DVec3::new(25.0, 20.0, 1.0)];
            s.lidar = Some(LidarCloud {
                in_vehicle,
                points: (0u32..)
                    .zip(places)
                    .map(|(channel, p)| LidarPlace {
                        position_m: into.point(p),
                        cos_incidence: 1.0 - 0.25 * f64::from(channel),
                        channel,
                    })
                    .collect(),
            });
            out.push(s);
        }
    }
    out
}

fn pose_json<A, B>(pose: &Pose<A, B>) -> Value {
    json!({ "position_m": pose.translation_m.to_array(), "rotation_xyzw": pose.rotation.to_array() })
}

/// The sweeps in plain numbers, for readers in other languages.
pub fn expected(sweeps: &[Sweep]) -> Value {
    let points = |s: &Sweep| -> Vec<Value> {
        s.points
            .iter()
            .map(|p| {
                json!({
                    "position_m": p.position_m.to_array(), "range_m": p.range_m, "azimuth_rad": p.azimuth_rad,
                    "elevation_rad": p.elevation_rad, "range_rate_mps": p.range_rate_mps, "rcs_dbsm": p.rcs_dbsm,
                    "snr_db": p.snr_db, "power_dbm": p.power_dbm, "range_std_m": p.range_std_m,
                    "azimuth_std_rad": p.azimuth_std_rad, "range_rate_std_mps": p.range_rate_std_mps,
                    "object_id": p.object_id, "class": p.class, "ghost": p.ghost, "moving": p.moving,
                })
            })
            .collect()
    };
    let list = sweeps.iter().map(|s| {
        json!({
            "time_ns": s.time_ns, "frame": s.frame, "radar": s.radar,
            "sensor_in_vehicle": pose_json(&s.sensor_in_vehicle),
            "vehicle_in_world": pose_json(&s.vehicle_in_world),
            "vehicle_velocity_mps": s.vehicle_velocity_mps.to_array(),
            "sensor_velocity_mps": s.sensor_velocity_mps.to_array(),
            "yaw_rate_rad_per_s": s.yaw_rate_rad_per_s,
            "points": points(s),
            "boxes": s.boxes.iter().map(|b| json!({
                "id": b.id, "class": b.class, "centre_m": b.centre_m.to_array(), "size_m": b.size_m.to_array(),
                "rotation_xyzw": b.rotation.to_array(), "velocity_mps": b.velocity_mps.to_array(), "moving": b.moving,
            })).collect::<Vec<_>>(),
            "lidar": s.lidar.as_ref().map(|l| json!({
                "in_vehicle": pose_json(&l.in_vehicle),
                "position_m": l.points.iter().map(|p| p.position_m.to_array()).collect::<Vec<_>>(),
                "cos_incidence": l.points.iter().map(|p| p.cos_incidence).collect::<Vec<_>>(),
                "channel": l.points.iter().map(|p| p.channel).collect::<Vec<_>>(),
            })),
            "range_doppler": s.range_doppler.as_ref().map(|m| json!({
                "rows": m.doppler_rows, "columns": m.range_columns, "power_w": m.power_w,
            })),
            "drivable": s.drivable.iter().map(|l| json!({
                "left_m": l.left_m.iter().map(|p| p.to_array()).collect::<Vec<_>>(),
                "right_m": l.right_m.iter().map(|p| p.to_array()).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
            "grids": s.grids.iter().map(|g| json!({
                "name": g.name, "rows": g.rows, "columns": g.columns, "cell_m": g.cell_m, "mask": g.mask, "planes": g.planes,
                "classes": g.classes.iter().map(|c| c.name()).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
            "lanes": s.lanes.iter().map(|l| json!({
                "id": l.id, "name": l.name, "points_m": l.points_m.iter().map(|p| p.to_array()).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
        })
    });
    Value::Array(list.collect())
}

/// Level of white in the sample's pictures, dBm.
#[cfg(feature = "mcap")]
pub const WHITE_DBM: f64 = -20.0;

/// Every format once, twice: the same bytes. Kept where `CATSEYE_SAMPLES` says.
#[test]
fn written_for_the_public_readers() {
    let t = tempfile::tempdir().unwrap();
    let kept = std::env::var_os("CATSEYE_SAMPLES").map(std::path::PathBuf::from);
    let folder = kept.unwrap_or_else(|| t.path().join("samples"));
    std::fs::create_dir_all(&folder).unwrap();
    let sweeps = sweeps();
    let text = serde_json::to_string_pretty(&expected(&sweeps)).unwrap();
    std::fs::write(folder.join("expected.json"), text).unwrap();
    let formats = |folder: &std::path::Path| -> Vec<Box<dyn Exporter>> {
        vec![
            Box::new(pcd::Clouds::create(&folder.join("pcd"), true).unwrap()),
            Box::new(
                nuscenes::Tables::create(
                    &folder.join("nuscenes"),
                    nuscenes::Settings { scene: "scene-0001".into(), key_interval_s: 0.5 },
                    true,
                )
                .unwrap(),
            ),
            Box::new(
                kitti::Folder::create(&folder.join("kitti"), tusimple::Camera::default(), true).unwrap(),
            ),
            Box::new(coco::Folder::create(&folder.join("coco"), true).unwrap()),
            Box::new(
                tusimple::LaneFile::create(&folder.join("lanes.json"), tusimple::Camera::default(), true)
                    .unwrap(),
            ),
            #[cfg(feature = "hdf5")]
            Box::new(radarscenes::Sequence::create(&folder.join("radarscenes"), "sequence_1", true).unwrap()),
            #[cfg(feature = "mcap")]
            Box::new(mcap::Recording::create(&folder.join("run.mcap"), WHITE_DBM, true).unwrap()),
            #[cfg(feature = "osi")]
            Box::new(osi::Trace::create(&folder.join("run_sd.osi"), true).unwrap()),
        ]
    };
    let again = t.path().join("again");
    for folder in [&folder, &again] {
        for mut exporter in formats(folder) {
            for s in &sweeps {
                exporter.push(s).unwrap();
            }
            let done = exporter.finish().unwrap();
            assert!(done.output.exists(), "{done:?}");
            assert!(done.sweeps == 4 || done.output.ends_with("lanes.json"), "{done:?}");
        }
    }
    let sums = |folder| {
        let mut sums = catseye::formats::stage::checksums(folder).unwrap();
        sums.remove("expected.json");
        sums
    };
    assert_eq!(sums(&folder), sums(&again));
    assert!(sums(&again).len() >= 6);
}
