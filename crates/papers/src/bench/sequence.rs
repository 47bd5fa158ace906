//! W5: a sequence of frames of W3, each written while the next is computed.

use super::scratch::Scratch;
use super::sheet::{Outcome, Settings, Sheet};
use catseye::base::control::Control;
use catseye::base::error::{Error, Result};
use catseye::base::frames::Pose;
use catseye::engine::Engine;
use catseye::road::site::Site;
use catseye::road::w3::RADAR_HEIGHT_M;
use catseye::scene::scenario::{self, Scenario};
use catseye::simulate::{Frame, Prepared};
use catseye_io::store::{Array, Column, Compression, Data, DatasetLayout, Format, Record, Table};
use glam::{DQuat, DVec3};
use std::path::Path;
use std::sync::mpsc::sync_channel;

/// The ego vehicle advances 0.1 m from frame to frame.
const SCENARIO: &str = "name = \"W5\"\nradar = \"front77\"\nscene = { builtin = \"w3-moving\" }\n\
    ego = { speed_mps = 10 }\nframes = { count = 100, interval_s = 0.01 }\n";

fn scenario(seed: u64) -> Result<Scenario> {
    let mut s = scenario::parse(Path::new("w5.toml"), SCENARIO)?;
    s.seed = seed;
    s.radars[0].mounting = Pose::new(DQuat::IDENTITY, DVec3::new(0.0, 0.0, RADAR_HEIGHT_M));
    Ok(s)
}

/// A record of samples and points, as a dataset stores them.
fn record(number: u64, mut frame: Frame) -> Result<Record> {
    let of = |f: fn(&catseye::detect::Point) -> f64| Column::F64(frame.points.iter().map(f).collect());
    let points = vec![
        ("range_m".to_string(), of(|p| p.range_m)),
        ("range_rate_mps".to_string(), of(|p| p.range_rate_mps)),
        ("azimuth_deg".to_string(), of(|p| p.azimuth_rad.to_degrees())),
        ("snr_db".to_string(), of(|p| p.snr_db)),
    ];
    let cube = frame.take_samples()?.into_f32();
    let adc = Array {
        name: "adc".into(),
        dims: ["chirp", "virtual_channel", "sample"].map(String::from).to_vec(),
        shape: vec![cube.chirps, cube.channels, cube.samples],
        data: Data::C32(cube.data),
        unit: "sqrt(W)".into(),
    };
    Ok(Record {
        frame: number,
        arrays: vec![adc],
        tables: vec![Table { name: "points".into(), columns: points }],
    })
}

pub(super) fn w5(engine: &Engine, settings: &Settings, mut sheet: Sheet<'_>) -> Result<Outcome> {
    let frames: u32 = if settings.quick { 20 } else { 100 };
    let Site { scenario, scene, .. } = Site::new(&scenario(settings.seed)?)?;
    let prepared = Prepared::new(&scenario, &scene)?;
    let of = |index| prepared.frame(engine, 0, index, Control::default());
    let first = record(0, sheet.part("steady_frame", || of(0))?)?;
    let steady = sheet.outcome.stages.last().map_or(f64::NAN, |s| s.seconds);
    let layout = DatasetLayout {
        format: Format::Frames,
        compression: Compression::None,
        frames: frames.into(),
        frames_per_shard: frames.into(),
        arrays: first.arrays.iter().map(Array::spec).collect(),
        tables: first.tables.iter().map(Table::spec).collect(),
        attributes: serde_json::Map::new(),
    };
    sheet.count("frames", frames);
    sheet.count("bytes_a_frame", layout.array_bytes());
    drop(first);
    let folder = Scratch::new("w5");
    sheet.stage("frames_written", || {
        layout.create(folder.path())?;
        std::thread::scope(|scope| {
            let (to, from) = sync_channel(1);
            let written = scope.spawn(|| {
                let from = from;
                let next = &mut |_| from.recv().map_err(|_| Error::Failed("no frame came".into()));
                layout.write_shard(folder.path(), 0, next)
            });
            let mut computed = Ok(());
            for index in 0..frames {
                match of(index).and_then(|frame| record(index.into(), frame)).map(|record| to.send(record)) {
                    Ok(Ok(())) => {}
                    // A writer that has ended reports its own error.
                    Ok(Err(_)) => break,
                    Err(e) => {
                        computed = Err(e);
                        break;
                    }
                }
            }
            drop(to);
            let written = written.join().map_err(|_| Error::Failed("the writer ended early".into()))?;
            computed.and(written.map(|_| ()))
        })
    })?;
    let total = sheet.outcome.total_seconds;
    sheet.accuracy("frames_a_second", f64::from(frames) / total);
    sheet.accuracy("over_as_many_steady_frames", total / (f64::from(frames) * steady));
    sheet.note("a steady frame is the median of three after one that warms up, and nothing is written of it");
    Ok(sheet.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ego_drives_a_tenth_of_a_metre_a_frame() {
        let s = scenario(1).unwrap().without_roads().unwrap();
        let at = |k| s.ego.pose(s.frames.time_s(k)).translation_m;
        assert!((at(1) - at(0) - DVec3::X * 0.1).length() < 1e-12);
        assert_eq!(s.frames.count, 100);
    }
}
