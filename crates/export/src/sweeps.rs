//! The frames of a run folder (`catseye simulate`) as sweeps for the exporters of [`crate`]: points from
//! `points.csv`, poses, boxes and lane lines from `truth.json`, maps from `range_doppler.npy`.

use crate::{
    LaneArea, LidarCloud, LidarPlace, MaskedGrid, PowerImage, Sweep, SweepBox, SweepLane, SweepPoint,
};
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::base::frames::{Pose, Sensor, Vehicle, World};
use catseye::base::units::dbm_from_w;
use catseye::detect::columns::OUT_OF_PLACE;
use catseye::formats::csv::Table;
use catseye::formats::stage::MANIFEST;
use catseye::formats::{input, npy, text};
use catseye::road::layout::LaneKind;
use catseye::road::mask::{self, CellClass, Grid};
use catseye_io::files::frame_name;
use catseye_io::manifest::{Axes, PerRadar};
use glam::{DQuat, DVec3};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::collections::{BTreeSet, HashMap};
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

/// What of `manifest.json` is needed here.
#[derive(Deserialize)]
struct Manifest {
    #[serde(default)]
    axes: Option<PerRadar<Axes>>,
    #[serde(default)]
    frames: Vec<FrameHead>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct FrameHead {
    index: u32,
    radar: String,
    time_s: f64,
}

/// What of `truth.json` is needed here.
#[derive(Deserialize)]
struct Truth {
    ego: PoseRead,
    radar: PoseRead,
    /// The lidar, where the run has its points.
    lidar: Option<PoseRead>,
    #[serde(default)]
    boxes: Vec<BoxRead>,
    /// Boxes of whole things, where the run knows them.
    actors: Option<Vec<BoxRead>>,
    /// Lane lines are those that have points, under either name.
    #[serde(default)]
    lane_lines: Vec<LineRead>,
    #[serde(default)]
    lanes: Vec<LaneRead>,
}

#[derive(Deserialize)]
struct PoseRead {
    position_m: [f64; 3],
    rotation_xyzw: [f64; 4],
    velocity_mps: [f64; 3],
    spin_rad_per_s: Option<[f64; 3]>,
}

impl PoseRead {
    fn pose<A>(&self) -> Pose<A, World> {
        Pose::new(DQuat::from_array(self.rotation_xyzw).normalize(), DVec3::from_array(self.position_m))
    }
}

#[derive(Deserialize)]
struct BoxRead {
    id: u32,
    class: String,
    centre_m: [f64; 3],
    size_m: [f64; 3],
    rotation_xyzw: [f64; 4],
    velocity_mps: [f64; 3],
    /// Ids of its objects.
    #[serde(default)]
    parts: Vec<u32>,
}

#[derive(Deserialize)]
struct LineRead {
    #[serde(default)]
    name: String,
    #[serde(default)]
    points_m: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
struct LaneRead {
    #[serde(flatten)]
    line: LineRead,
    kind: Option<LaneKind>,
    #[serde(default)]
    left_m: Vec<[f64; 3]>,
    #[serde(default)]
    right_m: Vec<[f64; 3]>,
}

/// What a sweep holds besides points and truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Extras {
    /// The range-Doppler map, if there is one.
    pub map: bool,
    /// The grids of points with their masks, which then have to be there.
    pub grids: bool,
    /// The points of the lidar, if the run has them.
    pub lidar: bool,
}

/// Frames that exporters write, in the order of time.
pub trait Sweeps {
    /// Number of sweeps.
    fn len(&self) -> usize;

    /// Whether there is no sweep.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sweep number `at`, with the extras that are asked for.
    ///
    /// # Errors
    /// Returns `BadInput` for what is missing or damaged.
    fn sweep(&self, at: usize, extras: Extras) -> Result<Sweep>;

    /// The highest level of all maps, dBm; `None` where there is no map with power.
    ///
    /// # Errors
    /// Returns an error for a map that cannot be read.
    fn highest_dbm(&self) -> Result<Option<f64>>;
}

impl Sweeps for Run {
    fn len(&self) -> usize {
        Run::len(self)
    }

    fn sweep(&self, at: usize, extras: Extras) -> Result<Sweep> {
        Run::sweep(self, at, extras)
    }

    fn highest_dbm(&self) -> Result<Option<f64>> {
        Run::highest_dbm(self)
    }
}

/// A run folder.
pub struct Run {
    folder: PathBuf,
    /// Sorted by time, those of one time by radar as the run has them.
    frames: Vec<FrameHead>,
    axes: Option<PerRadar<Axes>>,
    several: bool,
    /// By frame, where the truth does not say it.
    yaw_rates: HashMap<u32, f64>,
}

fn read_json<T: DeserializeOwned>(path: &Path, missing: &str) -> Result<T> {
    if matches!(std::fs::metadata(path), Err(e) if e.kind() == std::io::ErrorKind::NotFound) {
        return Err(BadInput::new("no such file").file(path).remedy(missing).into());
    }
    let text = text::read(path, "a JSON file", input::LARGEST_TEXT)?;
    serde_json::from_str(&text).map_err(|e| {
        BadInput::new(format!("was not written by catseye: {}", json_in_words(&e)))
            .file(path)
            .line(e.line())
            .into()
    })
}

const NO_TRUTH: &str = "export needs the truth: simulate with [output] truth = true";

impl Run {
    /// Opens the folder of a run.
    ///
    /// # Errors
    /// `BadInput` for a folder without `manifest.json`, one without frames (`catseye process` knows no poses), and for frames without
    /// `truth.json`.
    pub fn open(folder: &Path) -> Result<Run> {
        let path = folder.join(MANIFEST);
        let manifest: Manifest = read_json(&path, "give the folder that catseye simulate wrote")?;
        if manifest.frames.is_empty() {
            return Err(BadInput::new("the folder has no frames with poses")
                .file(&path)
                .key("frames")
                .remedy("give a folder that catseye simulate wrote")
                .into());
        }
        let mut frames = manifest.frames;
        if let Some(bad) = frames.iter().find(|f| !f.time_s.is_finite()) {
            return Err(BadInput::new("is not a time").file(&path).key("time_s").value(bad.time_s).into());
        }
        frames.sort_by(|a, b| a.time_s.total_cmp(&b.time_s).then(a.index.cmp(&b.index)));
        let radars: BTreeSet<&str> = frames.iter().map(|f| f.radar.as_str()).collect();
        let several = radars.len() > 1;
        let mut run = Run {
            folder: folder.to_path_buf(),
            frames,
            axes: manifest.axes,
            several,
            yaw_rates: HashMap::new(),
        };
        run.yaw_rates = run.turning()?;
        Ok(run)
    }

    /// Number of sweeps.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether the run has no frame.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    fn dir(&self, head: &FrameHead) -> PathBuf {
        let dir = self.folder.join(frame_name(head.index));
        if self.several { dir.join(&head.radar) } else { dir }
    }

    /// Yaw rate of each frame from the headings beside it.
    fn turning(&self) -> Result<HashMap<u32, f64>> {
        let mut seen: Vec<(u32, f64, f64)> = Vec::new();
        for head in &self.frames {
            if seen.last().is_some_and(|s| s.0 == head.index) {
                continue;
            }
            let truth: Truth = read_json(&self.dir(head).join("truth.json"), NO_TRUTH)?;
            if truth.ego.spin_rad_per_s.is_some() {
                // This run says it itself.
                return Ok(HashMap::new());
            }
            let ahead = truth.ego.pose::<Vehicle>().direction(DVec3::X);
            seen.push((head.index, head.time_s, ahead.y.atan2(ahead.x)));
        }
        let rate = |i: usize| {
            let (a, b) = (seen[i.saturating_sub(1)], seen[(i + 1).min(seen.len() - 1)]);
            let turn = (b.2 - a.2 + PI).rem_euclid(TAU) - PI;
            if b.1 > a.1 { turn / (b.1 - a.1) } else { 0.0 }
        };
        Ok((0..seen.len()).map(|i| (seen[i].0, rate(i))).collect())
    }

    /// Number `at` of the run's sweeps, in the order of time, with the extras that are asked for.
    ///
    /// # Errors
    /// Returns `BadInput` for files that are missing or not what the run wrote.
    pub fn sweep(&self, at: usize, extras: Extras) -> Result<Sweep> {
        let head = self.frames.get(at).ok_or_else(|| {
            Error::Failed(format!("{}: sweep {at} of {}", self.folder.display(), self.frames.len()))
        })?;
        let dir = self.dir(head);
        let truth: Truth = read_json(&dir.join("truth.json"), NO_TRUTH)?;
        let vehicle_in_world = truth.ego.pose();
        let spin = truth.ego.spin_rad_per_s.map(|s| s[2]);
        let boxes = truth.actors.as_ref().unwrap_or(&truth.boxes);
        let mut sweep = Sweep {
            time_ns: (head.time_s * 1e9).round() as i64,
            frame: u64::from(head.index),
            radar: head.radar.clone(),
            sensor_in_vehicle: truth.radar.pose().then(&vehicle_in_world.inverse()),
            vehicle_in_world,
            vehicle_velocity_mps: DVec3::from_array(truth.ego.velocity_mps),
            yaw_rate_rad_per_s: spin.or(self.yaw_rates.get(&head.index).copied()).unwrap_or(0.0),
            sensor_velocity_mps: DVec3::from_array(truth.radar.velocity_mps),
            points: Vec::new(),
            missing_flags: Vec::new(),
            boxes: boxes.iter().map(read_box).collect(),
            range_doppler: None,
            lanes: lanes(&truth, &vehicle_in_world.inverse()),
            drivable: drivable(&truth),
            grids: Vec::new(),
            lidar: None,
        };
        (sweep.points, sweep.missing_flags) = read_points(&dir.join("points.csv"), boxes)?;
        if extras.map {
            sweep.range_doppler = self.map(head)?;
        }
        if let Some(pose) = truth.lidar.as_ref().filter(|_| extras.lidar) {
            // It stands on the vehicle, so its file lies beside the folders of several radars.
            let path = self.folder.join(frame_name(head.index)).join("lidar.csv");
            sweep.lidar = Some(lidar_cloud(&path, pose.pose().then(&vehicle_in_world.inverse()))?);
        }
        if extras.grids {
            sweep.grids = vec![
                masked_grid(&dir, "road", Grid::ROAD, &mask::ROAD_CLASSES)?,
                masked_grid(&dir, "markers", Grid::MARKERS, &mask::MARKER_CLASSES)?,
            ];
        }
        Ok(sweep)
    }

    fn map(&self, head: &FrameHead) -> Result<Option<PowerImage>> {
        let path = self.dir(head).join("range_doppler.npy");
        let axes = self.axes.as_ref().and_then(|axes| axes.get(&head.radar));
        let Some(axes) = axes.filter(|_| path.is_file()) else {
            return Ok(None);
        };
        let array = npy::read_f32(&path)?;
        let expected = [axes.range_rate_mps.count, axes.range_m.count];
        if array.shape != expected {
            return Err(BadInput::new("the size of the map differs from that in manifest.json")
                .file(&path)
                .key("shape")
                .value(format!("{:?}", array.shape))
                .allowed(format!("{expected:?}"))
                .into());
        }
        Ok(Some(PowerImage {
            doppler_rows: expected[0],
            range_columns: expected[1],
            power_w: array.data,
            first_range_m: axes.range_m.first,
            range_step_m: axes.range_m.step,
            first_range_rate_mps: axes.range_rate_mps.first,
            range_rate_step_mps: axes.range_rate_mps.step,
        }))
    }

    /// The highest level of all maps, dBm; `None` where there is no map with power.
    ///
    /// # Errors
    /// Returns an error for a map that cannot be read.
    pub fn highest_dbm(&self) -> Result<Option<f64>> {
        let mut highest = 0f32;
        for head in &self.frames {
            if let Some(map) = self.map(head)? {
                highest = map.power_w.iter().fold(highest, |m, p| m.max(*p));
            }
        }
        Ok((highest > 0.0).then(|| dbm_from_w(f64::from(highest))))
    }
}

fn read_box(b: &BoxRead) -> SweepBox {
    let velocity_mps = DVec3::from_array(b.velocity_mps);
    SweepBox {
        id: b.id,
        class: b.class.clone(),
        centre_m: DVec3::from_array(b.centre_m),
        size_m: DVec3::from_array(b.size_m),
        rotation: DQuat::from_array(b.rotation_xyzw).normalize(),
        velocity_mps,
        moving: velocity_mps != DVec3::ZERO,
    }
}

fn lanes(truth: &Truth, into_vehicle: &Pose<World, Vehicle>) -> Vec<SweepLane> {
    let of_lanes = truth.lanes.iter().map(|l| &l.line);
    let lines = truth.lane_lines.iter().chain(of_lanes).filter(|l| !l.points_m.is_empty());
    lines
        .zip(1u32..)
        .map(|(l, id)| SweepLane {
            id,
            name: l.name.clone(),
            points_m: l.points_m.iter().map(|p| into_vehicle.point(DVec3::from_array(*p))).collect(),
        })
        .collect()
}

fn drivable(truth: &Truth) -> Vec<LaneArea> {
    let lanes = truth.lanes.iter().filter(|l| l.kind.is_some_and(LaneKind::is_drivable));
    let line = |points: &[[f64; 3]], count| points[..count].iter().map(|p| DVec3::from_array(*p)).collect();
    lanes
        .map(|l| {
            let count = l.left_m.len().min(l.right_m.len());
            LaneArea { left_m: line(&l.left_m, count), right_m: line(&l.right_m, count) }
        })
        .filter(|l| l.left_m.len() >= 2)
        .collect()
}

/// `mask_NAME.npy` and `grid_NAME.npy`, checked against the grid that they are made on.
fn masked_grid(dir: &Path, name: &str, grid: Grid, classes: &[CellClass]) -> Result<MaskedGrid> {
    let file = |kind: &str| -> Result<PathBuf> {
        let path = dir.join(format!("{kind}_{name}.npy"));
        match path.is_file() {
            true => Ok(path),
            false => Err(BadInput::new("no such file")
                .file(path)
                .remedy("export needs the grids: simulate with [output] masks = true")
                .into()),
        }
    };
    let shaped = |path: &Path, shape: &[usize], expected: &[usize]| -> Result<()> {
        if shape == expected {
            return Ok(());
        }
        Err(BadInput::new("the array does not have the size that catseye writes")
            .file(path)
            .key("shape")
            .value(format!("{shape:?}"))
            .allowed(format!("{expected:?}"))
            .into())
    };
    let path = file("mask")?;
    let cells: npy::Array<u8> = npy::read(&path)?;
    shaped(&path, &cells.shape, &[grid.rows, grid.columns])?;
    if let Some(bad) = cells.data.iter().find(|c| usize::from(**c) >= CellClass::ALL.len()) {
        let allowed = format!("0 to {}", CellClass::ALL.len() - 1);
        return Err(BadInput::new("is not a class of a mask").file(&path).value(bad).allowed(allowed).into());
    }
    let path = file("grid")?;
    let planes = npy::read_f32(&path)?;
    shaped(&path, &planes.shape, &[4, grid.rows, grid.columns])?;
    npy::check_finite(&path, &planes, f32::is_finite)?;
    Ok(MaskedGrid {
        name: name.into(),
        rows: grid.rows,
        columns: grid.columns,
        cell_m: [grid.ahead_m / grid.rows as f64, grid.across_m / grid.columns as f64],
        mask: cells.data,
        classes: classes.to_vec(),
        planes: planes.data,
    })
}

/// `lidar.csv`, whose places are in the vehicle's axes.
fn lidar_cloud(path: &Path, in_vehicle: Pose<Sensor, Vehicle>) -> Result<LidarCloud> {
    if !path.is_file() {
        return Err(BadInput::new("no such file")
            .file(path)
            .remedy("simulate again with [output] lidar = true, since truth.json names a lidar")
            .into());
    }
    let table = Table::read(path)?;
    let numbers = |name: &str| table.numbers(name);
    let (x, y, z) = (numbers("x_m")?, numbers("y_m")?, numbers("z_m")?);
    let (incidence_deg, channel) = (numbers("incidence_deg")?, numbers("channel")?);
    let from_vehicle = in_vehicle.inverse();
    let point = |i: usize| {
        let number = channel[i];
        if !(number >= 0.0 && number <= f64::from(u32::MAX) && number.fract() == 0.0) {
            return Err(BadInput::new("is not the number of a channel")
                .file(path)
                .line(table.line(i))
                .key("channel")
                .value(number)
                .allowed("0 to 4294967295")
                .into());
        }
        Ok(LidarPlace {
            position_m: from_vehicle.point(DVec3::new(x[i], y[i], z[i])),
            cos_incidence: incidence_deg[i].to_radians().cos().clamp(0.0, 1.0),
            channel: number as u32,
        })
    };
    Ok(LidarCloud { in_vehicle, points: (0..table.len()).map(point).collect::<Result<_>>()? })
}

/// Columns of what a radar measures of points, as tables and files of points have them.
pub(crate) struct MeasuredColumns {
    range_m: Vec<f64>,
    range_rate_mps: Vec<f64>,
    azimuth_deg: Vec<f64>,
    elevation_deg: Vec<f64>,
    power_dbm: Vec<f64>,
    snr_db: Vec<f64>,
    rcs_dbsm: Vec<f64>,
    range_std_m: Vec<f64>,
    range_rate_std_mps: Vec<f64>,
    azimuth_std_deg: Vec<f64>,
    elevation_std_deg: Vec<f64>,
}

/// What is known of a point beside its measurement.
pub(crate) struct PointLabel {
    pub object_id: u32,
    pub class: String,
    pub ghost: bool,
    pub moving: Option<bool>,
}

impl MeasuredColumns {
    /// Reads the columns by their names.
    pub fn read(numbers: impl Fn(&str) -> Result<Vec<f64>>) -> Result<MeasuredColumns> {
        Ok(MeasuredColumns {
            range_m: numbers("range_m")?,
            range_rate_mps: numbers("range_rate_mps")?,
            azimuth_deg: numbers("azimuth_deg")?,
            elevation_deg: numbers("elevation_deg")?,
            power_dbm: numbers("power_dbm")?,
            snr_db: numbers("snr_db")?,
            rcs_dbsm: numbers("rcs_dbsm")?,
            range_std_m: numbers("range_std_m")?,
            range_rate_std_mps: numbers("range_rate_std_mps")?,
            azimuth_std_deg: numbers("azimuth_std_deg")?,
            elevation_std_deg: numbers("elevation_std_deg")?,
        })
    }

    /// The point of row `i`.
    pub fn point(&self, i: usize, position_m: DVec3, label: PointLabel) -> SweepPoint {
        // No number: the array does not measure the angle.
        let known = |deg: f64| Some(deg.to_radians()).filter(|s| s.is_finite());
        let PointLabel { object_id, class, ghost, moving } = label;
        SweepPoint {
            position_m,
            range_m: self.range_m[i],
            azimuth_rad: self.azimuth_deg[i].to_radians(),
            elevation_rad: self.elevation_deg[i].to_radians(),
            range_rate_mps: self.range_rate_mps[i],
            rcs_dbsm: self.rcs_dbsm[i],
            snr_db: self.snr_db[i],
            power_dbm: self.power_dbm[i],
            range_std_m: self.range_std_m[i],
            azimuth_std_rad: known(self.azimuth_std_deg[i]),
            elevation_std_rad: known(self.elevation_std_deg[i]),
            range_rate_std_mps: self.range_rate_std_mps[i],
            object_id,
            class,
            ghost,
            moving,
        }
    }
}

/// Points carry the id of the box that their object is a part of.
fn read_points(path: &Path, boxes: &[BoxRead]) -> Result<(Vec<SweepPoint>, Vec<&'static str>)> {
    if !path.is_file() {
        return Err(BadInput::new("no such file")
            .file(path)
            .remedy("export needs the points: simulate with [output] points = true")
            .into());
    }
    let whole: HashMap<u32, &BoxRead> =
        boxes.iter().flat_map(|b| b.parts.iter().chain([&b.id]).map(move |part| (*part, b))).collect();
    let table = Table::read(path)?;
    let numbers = |name: &str| table.numbers(name);
    let (x, y, z) = (numbers("x_m")?, numbers("y_m")?, numbers("z_m")?);
    let measured = MeasuredColumns::read(numbers)?;
    let (id, class) = (numbers("object_id")?, table.text("class")?);
    // Runs of older versions do not have all of them.
    let flag = |name: &str| match table.has(name) {
        true => Ok(table.text(name)?.iter().map(|cell| matches!(&**cell, "1" | "true")).collect()),
        false => Ok::<_, Error>(vec![false; table.len()]),
    };
    let flags: Vec<Vec<bool>> = OUT_OF_PLACE.iter().map(|name| flag(name)).collect::<Result<_>>()?;
    let missing = OUT_OF_PLACE.into_iter().filter(|name| !table.has(name)).collect();
    let points = (0..table.len())
        .map(|i| {
            let object = id[i];
            if !(object >= 0.0 && object <= f64::from(u32::MAX) && object.fract() == 0.0) {
                return Err(BadInput::new("is not the id of an object")
                    .file(path)
                    .line(table.line(i))
                    .key("object_id")
                    .value(object)
                    .allowed("0 to 4294967295")
                    .into());
            }
            let object = object as u32;
            let owner = whole.get(&object);
            let label = PointLabel {
                object_id: owner.map_or(object, |b| b.id),
                class: owner.map_or_else(|| class[i].to_string(), |b| b.class.clone()),
                ghost: flags.iter().any(|f| f[i]),
                moving: owner.map(|b| b.velocity_mps != [0.0; 3]),
            };
            Ok(measured.point(i, DVec3::new(x[i], y[i], z[i]), label))
        })
        .collect::<Result<_>>()?;
    Ok((points, missing))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const MAP: Extras = Extras { map: true, grids: false, lidar: false };
    const POINTS: &str = "range_m,range_rate_mps,azimuth_deg,elevation_deg,x_m,y_m,z_m,power_dbm,snr_db,rcs_dbsm,object_id,class,\
        range_std_m,range_rate_std_mps,azimuth_std_deg,elevation_std_deg,ambiguity,bounces,ghost,share,side_lobe\n\
        20,-3,30,0,17.3,10,0,-80,25,10,4,car.wheel,0.01,0.02,0.5,,unambiguous,1,0,0.9,0\n\
        25,1,-10,2,24.6,-4.3,0.9,-90,15,0,0,,0.01,0.02,,,unambiguous,2,1,0.5,0\n\
        22,-3,30,0,19.1,11,0,-120,12,-30,4,car.wheel,0.01,0.02,0.5,,unambiguous,1,0,0.9,1\n";

    fn truth(x: f64, heading: f64, more: &str) -> String {
        let (s, c) = (0.5 * heading).sin_cos();
        format!(
            r#"{{"frame":0,"time_s":0,"ego":{{"position_m":[{x},0,0],"rotation_xyzw":[0,0,{s},{c}],"velocity_mps":[1,0,0]}},
            "radar":{{"position_m":[{},{},0.5],"rotation_xyzw":[0,0,{s},{c}],"velocity_mps":[1,0,0]}},
            "boxes":[{{"id":3,"class":"car","centre_m":[20,1,0.7],"size_m":[4,2,1.4],"rotation_xyzw":[0,0,0,1],
              "velocity_mps":[5,0,0]}}]{more}}}"#,
            x + 2.0 * heading.cos(),
            2.0 * heading.sin()
        )
    }

    fn run(folder: &Path, more: &str) -> Result<Run> {
        let head = |i: u32| format!(r#"{{"index":{i},"radar":"front","time_s":{}}}"#, 0.1 * f64::from(i));
        let axes = r#"{"range_m":{"first":0,"step":0.5,"count":3},"range_rate_mps":{"first":-1,"step":1,"count":2}}"#;
        // Not in the order of time.
        let text = format!(r#"{{"axes":{axes},"frames":[{},{},{}]}}"#, head(1), head(0), head(2));
        fs::write(folder.join(MANIFEST), text).unwrap();
        for i in 0..3u32 {
            let dir = folder.join(frame_name(i));
            fs::create_dir_all(&dir).unwrap();
            fs::write(dir.join("truth.json"), truth(f64::from(i), 3.1 + 0.05 * f64::from(i), more)).unwrap();
            fs::write(dir.join("points.csv"), POINTS).unwrap();
            npy::write(dir.join("range_doppler.npy"), &[2, 3], &[0f32, 1e-9, 0.0, 0.0, 0.0, 1e-12]).unwrap();
        }
        Run::open(folder)
    }

    #[test]
    fn frames_in_order_with_poses_and_wholes() {
        let t = tempfile::tempdir().unwrap();
        let lines = r#","lanes":[{"name":"left","points_m":[[0,1,0],[9,1,0]]}]"#;
        let r = run(t.path(), lines).unwrap();
        assert_eq!(r.len(), 3);
        let s = r.sweep(1, MAP).unwrap();
        assert_eq!((s.frame, s.time_ns), (1, 100_000_000));
        let mount = s.sensor_in_vehicle.translation_m;
        assert!((mount - DVec3::new(2.0, 0.0, 0.5)).length() < 1e-12, "{mount}");
        // Over the jump of the heading at pi.
        assert!((s.yaw_rate_rad_per_s - 0.5).abs() < 1e-9);
        assert!(
            (s.vehicle_in_world.point(s.lanes[0].points_m[1]) - DVec3::new(9.0, 1.0, 0.0)).length() < 1e-12
        );
        // No actors here: object 4 is in no box.
        assert_eq!((s.points[0].object_id, s.points[0].moving), (4, None));
        assert_eq!(s.points[1].azimuth_std_rad, None);
        // As `catseye simulate` writes it: a mirror image and a side lobe are not where their object is.
        assert_eq!(s.points.iter().map(|p| p.ghost).collect::<Vec<_>>(), [false, true, true]);
        // An older run knows no side lobes.
        let before: String = POINTS.lines().map(|l| format!("{}\n", l.rsplit_once(',').unwrap().0)).collect();
        fs::write(t.path().join("frame_000001/points.csv"), before).unwrap();
        let old = r.sweep(1, Extras::default()).unwrap();
        assert_eq!(old.points.iter().map(|p| p.ghost).collect::<Vec<_>>(), [false, true, false]);
        assert_eq!(s.range_doppler.unwrap().range_columns, 3);
        assert!((r.highest_dbm().unwrap().unwrap() + 60.0).abs() < 1e-4);
        // A run that knows wholes and turning.
        let parts = r#","lanes":[{"number":1,"kind":"driving","left_m":[[0,2,0],[9,2,0]],"right_m":[[0,-2,0],[9,-2,0]]},
            {"kind":"verge","left_m":[[0,3,0],[9,3,0]],"right_m":[[0,2,0],[9,2,0]]},{"number":3}],
            "lane_lines":[{"name":"l","kind":"none","points_m":[[0,0,0]]}],
            "actors":[{"id":3,"class":"car","centre_m":[20,1,0.7],"size_m":[4,2,1.4],"rotation_xyzw":[0,0,0,1],
            "velocity_mps":[5,0,0],"parts":[3,4]}]"#;
        let s = run(t.path(), parts).unwrap().sweep(0, Extras::default()).unwrap();
        assert_eq!(
            (s.points[0].object_id, s.points[0].class.as_str(), s.points[0].moving),
            (3, "car", Some(true))
        );
        assert_eq!((s.lanes.len(), s.range_doppler), (1, None));
        // A lane that is driven; a verge is none, and a line's kind is not a lane's.
        assert_eq!(s.drivable.len(), 1);
        assert_eq!(
            (s.drivable[0].left_m[1], s.drivable[0].right_m[0]),
            (DVec3::new(9.0, 2.0, 0.0), DVec3::new(0.0, -2.0, 0.0))
        );
    }

    #[test]
    fn what_is_missing() {
        let t = tempfile::tempdir().unwrap();
        let remedy = |e: Error| (e.exit_code(), e.to_string());
        let (code, text) = remedy(Run::open(t.path()).err().unwrap());
        assert!(code == 2 && text.contains("simulate"), "{text}");
        let r = run(t.path(), "").unwrap();
        fs::remove_file(t.path().join("frame_000001/points.csv")).unwrap();
        let (code, text) = remedy(r.sweep(1, Extras::default()).unwrap_err());
        assert!(code == 2 && text.contains("points = true"), "{text}");
        fs::write(t.path().join("frame_000002/truth.json"), "{}").unwrap();
        let (code, text) = remedy(r.sweep(2, Extras::default()).unwrap_err());
        assert!(code == 2 && text.contains("truth.json"), "{text}");
        npy::write(t.path().join("frame_000000/range_doppler.npy"), &[3, 2], &[0f32; 6]).unwrap();
        assert_eq!(r.sweep(0, MAP).unwrap_err().exit_code(), 2);
        r.sweep(0, Extras::default()).unwrap();
        fs::write(t.path().join(MANIFEST), r#"{"frames":[]}"#).unwrap();
        assert_eq!(Run::open(t.path()).err().unwrap().exit_code(), 2);
    }
}
