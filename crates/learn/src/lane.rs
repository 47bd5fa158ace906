//! The lane method segmentation: a network of grids says which cells before the radar are of a lane, and the edges of the
//! region that leads ahead are the estimate ([`catseye_lane::segmentation`]). It takes the points of a look and the speed
//! and the yaw rate of the vehicle's bus, and nothing else.
//!
//! ```
//! use catseye_lane::{LaneEstimator, Registry, SensorInput};
//!
//! let mut registry = Registry::of_methods();
//! catseye_learn::lane::register(&mut registry).unwrap();
//! let mut method = registry.make("segmentation", Some(r#"{"weights": "road"}"#)).unwrap();
//! assert!(method.estimate(&SensorInput::default()).no_lane.is_some());
//! ```

use crate::device;
use crate::joint::{Joint, Place, ScaledGrid};
use crate::model::Model;
use crate::scan::{GridKind, Scan};
use crate::task::Task;
use catseye::base::error::{BadInput, Result};
use catseye::detect::grid::{PlacedPoint, PointGrid};
use catseye::road::mask::CellClass;
use catseye_lane::registry::BoxedEstimator;
use catseye_lane::segmentation::{
    LaneCells, METHOD, RadarMount, RegionLimits, SegmentationOptions, estimate,
};
use catseye_lane::{LaneError, LaneEstimate, LaneEstimator, LanePoint, Registry, SensorInput, limits};
use glam::DVec2;
use std::path::Path;

/// Estimates the edges of the lanes from what a network says of each cell.
pub struct Segmentation {
    model: Model,
    kind: GridKind,
    cells: ScaledGrid,
    classes: usize,
    /// Places of the classes lane and vehicle among the network's.
    lane: usize,
    vehicle: Option<usize>,
    limits: RegionLimits,
    mount: RadarMount,
    /// The scans that are taken together, and where the vehicle was at the last one.
    joint: Option<(Joint, Option<Odometer>)>,
    scans: usize,
}

/// Where a vehicle is by its own bus, in a frame of its own.
#[derive(Debug, Clone, Copy)]
struct Odometer {
    at_m: DVec2,
    heading_rad: f64,
    time_s: f64,
    speed_mps: f64,
    yaw_rate_rad_per_s: f64,
}

impl Odometer {
    /// The place at a later look, with the mean speed and yaw rate of both.
    fn after(self, time_s: f64, speed_mps: f64, yaw_rate_rad_per_s: f64) -> Odometer {
        let dt = time_s - self.time_s;
        let turn = 0.5 * (self.yaw_rate_rad_per_s + yaw_rate_rad_per_s) * dt;
        let way = 0.5 * (self.speed_mps + speed_mps) * dt;
        let at_m = self.at_m + DVec2::from_angle(self.heading_rad + 0.5 * turn) * way;
        Odometer { at_m, heading_rad: self.heading_rad + turn, time_s, speed_mps, yaw_rate_rad_per_s }
    }
}

impl Segmentation {
    /// Makes the method from a trained network. The options' own place of the radar is not looked at.
    ///
    /// # Errors
    /// Returns the errors of [`SegmentationOptions::check`], and `BadInput` for a network of points and for one that knows no
    /// lanes.
    pub fn new(model: Model, options: &SegmentationOptions, mount: RadarMount) -> Result<Segmentation> {
        options.check()?;
        let key = "lane.segmentation.weights";
        let Some(task) = model.grids() else {
            let bad = BadInput::new("is a network of points, which cannot detect lanes").key(key);
            let bad = bad.value(&options.weights).allowed("a segnet");
            return Err(bad.remedy("use a network of grids, such as road").into());
        };
        let (kind, cells) = (task.kind(), task.cells());
        let count = task.classes().count();
        let place = |class| (0..count).find(|k| task.classes().class(*k) == class);
        let (lane, vehicle) = (place(CellClass::Lane), place(CellClass::Vehicle));
        let Some(lane) = lane else {
            let bad = BadInput::new("is a network without the class lane").key(key).value(&options.weights);
            let bad = bad.allowed("a network with the class lane");
            return Err(bad.remedy("train one with lane among data.classes").into());
        };
        let scans = options.scans as usize;
        let limits =
            RegionLimits { probability: options.probability, least_length_m: options.least_length_m };
        let joint = (scans > 1).then(|| (Joint::new(cells, count, scans), None));
        Ok(Segmentation { model, kind, cells, classes: count, lane, vehicle, limits, mount, joint, scans })
    }

    /// Opens the network that the options name and makes the method; a folder is relative to `base`.
    ///
    /// # Errors
    /// Returns the errors of [`Model::open`] and [`Segmentation::new`].
    pub fn open(base: &Path, options: &SegmentationOptions, mount: RadarMount) -> Result<Segmentation> {
        options.check()?;
        let model = Model::open(base, Path::new(&options.weights), &device(false)?)?;
        Segmentation::new(model, options, mount)
    }

    /// The cells of a look that hold points, as the network's training had them. Amplitudes come from the powers; where a point tells
    /// none, those of the whole look come from the signal-to-noise ratios, whose noise the detector estimates anew around each cell.
    pub fn scan(&self, points: &[LanePoint]) -> Scan {
        let told = points.iter().all(|p| p.power_dbm.is_some());
        let placed = |p: &LanePoint| PlacedPoint {
            at_m: self.mount.from_vehicle(DVec2::from_array(p.at_m)),
            power_db: p.power_dbm.filter(|_| told).unwrap_or(p.snr_db),
            range_m: p.range_m,
            azimuth_rad: p.azimuth_rad - self.mount.yaw_rad,
        };
        let sound = |p: &PlacedPoint| {
            p.at_m.is_finite() && p.power_db.is_finite() && p.range_m.is_finite() && p.azimuth_rad.is_finite()
        };
        let grid = self.kind.grid();
        Scan::new(&PointGrid::of_placed(grid, points.iter().map(placed).filter(sound)))
    }

    /// Probabilities of the classes in all cells, `[cell, class]`, of this look or of the last ones together.
    fn probabilities(
        &mut self,
        input: &SensorInput<'_>,
        scan: &Scan,
    ) -> std::result::Result<Vec<f32>, LaneError> {
        let single = self.model.cell_probabilities(scan);
        let Some((joint, last)) = &mut self.joint else { return Ok(single) };
        let speed = input.speed_mps.ok_or(LaneError::NoSpeed)?.value;
        let what = "the yaw rate from the vehicle's bus, to combine scans";
        let yaw_rate = input.yaw_rate_rad_per_s.ok_or(LaneError::NotGiven { what: what.into() })?.value;
        if !(speed.is_finite() && yaw_rate.is_finite() && input.time_s.is_finite()) {
            return Err(LaneError::refused("the speed, the yaw rate or the time of the frame is not finite"));
        }
        // Looks come in order of time; one that goes back begins anew.
        let first = Odometer {
            at_m: DVec2::ZERO,
            heading_rad: 0.0,
            time_s: input.time_s,
            speed_mps: speed,
            yaw_rate_rad_per_s: yaw_rate,
        };
        let now = match *last {
            Some(before) if before.time_s <= input.time_s => before.after(input.time_s, speed, yaw_rate),
            Some(_) => {
                *joint = Joint::new(self.cells, self.classes, self.scans);
                first
            }
            None => first,
        };
        *last = Some(now);
        let ahead = DVec2::from_angle(now.heading_rad);
        let place = Place {
            at_m: now.at_m + ahead.rotate(self.mount.at_m),
            ahead: DVec2::from_angle(now.heading_rad + self.mount.yaw_rad),
        };
        Ok(joint.add(place, &single))
    }
}

impl LaneEstimator for Segmentation {
    fn method(&self) -> &'static str {
        METHOD
    }

    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate {
        let given = input.points.len();
        let none = |why| LaneEstimate::none(METHOD, input.time_s, given, why);
        if given == 0 {
            return none(LaneError::Empty);
        }
        let scan = self.scan(input.points);
        let used = scan.cells.iter().map(|c| c.count as usize).sum();
        if used == 0 {
            let g = self.kind.grid();
            return none(LaneError::refused(format!(
                "no point is in the {} x {} m in front of the radar that the network covers",
                g.ahead_m, g.across_m
            )));
        }
        let all = match self.probabilities(input, &scan) {
            Ok(all) => all,
            Err(why) => return none(why),
        };
        let classes = self.classes;
        let lane: Vec<f32> = all.chunks_exact(classes).map(|p| p[self.lane]).collect();
        // A vehicle hides a lane where it is the likelier of the two.
        let is_hidden =
            |p: &[f32]| self.vehicle.is_some_and(|v| p.iter().enumerate().all(|(k, q)| k == v || *q < p[v]));
        let hidden: Vec<bool> = all.chunks_exact(classes).map(is_hidden).collect();
        let cells = LaneCells {
            rows: self.cells.rows,
            columns: self.cells.columns,
            cell_m: self.cells.cell_m.to_array(),
            left_m: self.cells.left_m,
            lane: &lane,
            hidden: &hidden,
        };
        estimate(input.time_s, [given, used], &cells, &self.mount, &self.limits)
    }
}

/// Makes the method from options as JSON text; a folder of weights is relative to the working directory.
///
/// # Errors
/// Returns an error for options that are unknown or outside their ranges, and the errors of [`Segmentation::open`].
pub fn from_json(options: &str) -> Result<BoxedEstimator> {
    let options: SegmentationOptions = limits::read_json(METHOD, options)?;
    Ok(Box::new(Segmentation::open(Path::new(""), &options, options.mount())?))
}

/// Adds the method to a registry.
///
/// # Errors
/// Returns an error if the name is taken.
pub fn register(registry: &mut Registry) -> Result<()> {
    registry.register(METHOD, from_json)
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye_lane::Measured;

    /// A rail on either side of the vehicle, 2.45 m to the right and to the left, every metre up to 50 m, and off the borders of
    /// cells.
    fn rails() -> Vec<LanePoint> {
        let place = |k: i32, y: f64| {
            let at = DVec2::new(f64::from(k) + 0.05, y);
            LanePoint {
                at_m: at.to_array(),
                std_m: [0.05, 0.1],
                range_rate_mps: 0.0,
                range_rate_std_mps: 0.1,
                range_m: at.length(),
                azimuth_rad: at.to_angle(),
                rcs_dbsm: 0.0,
                snr_db: 60.0 - 40.0 * at.length().log10(),
                power_dbm: None,
            }
        };
        (4..50).flat_map(|k| [place(k, -2.45), place(k, 2.45)]).collect()
    }

    fn look(points: &[LanePoint], time_s: f64) -> SensorInput<'_> {
        let speed = Measured { value: 10.0, std: 0.1 };
        let yaw_rate = Measured { value: 0.0, std: 0.01 };
        let (speed_mps, yaw_rate_rad_per_s) = (Some(speed), Some(yaw_rate));
        SensorInput { time_s, points, speed_mps, yaw_rate_rad_per_s, ..SensorInput::default() }
    }

    fn method(options: &str) -> BoxedEstimator {
        let mut registry = Registry::of_methods();
        register(&mut registry).unwrap();
        registry.make(METHOD, Some(options)).unwrap()
    }

    fn refusal(options: &str) -> String {
        from_json(options).err().map(|e| format!("{} {e}", e.exit_code())).unwrap_or_default()
    }

    #[test]
    fn it_is_registered_beside_the_others_and_says_what_is_wrong() {
        let mut registry = Registry::of_methods();
        register(&mut registry).unwrap();
        assert_eq!(registry.names().last(), Some("segmentation"));
        assert!(register(&mut registry).is_err());
        assert_eq!(method("{}").method(), "segmentation");
        let e = refusal(r#"{"weights": "nowhere"}"#);
        assert!(e.starts_with("2 ") && e.contains("nowhere") && e.contains("a shipped network: road"), "{e}");
        let e = refusal(r#"{"scans": 0}"#);
        assert!(e.starts_with("2 ") && e.contains("lane.segmentation.scans = 0"), "{e}");
        assert!(refusal(r#"{"weight": "road"}"#).contains("weight"));
    }

    /// A folder that holds another kind of network is refused, and one that cannot be read is named.
    #[test]
    fn foreign_folders_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let shipped = crate::shipped::find("road").unwrap();
        let write = |config: &str, weights: &[u8]| {
            std::fs::write(dir.path().join(crate::model::CONFIG), config).unwrap();
            std::fs::write(dir.path().join(crate::model::WEIGHTS), weights).unwrap();
            let options = SegmentationOptions { weights: ".".into(), ..SegmentationOptions::default() };
            let made = Segmentation::open(dir.path(), &options, RadarMount::default());
            made.err().map(|e| format!("{} {e}", e.exit_code())).unwrap_or_default()
        };
        assert_eq!(write(shipped.config, shipped.weights), "");
        let e = write(shipped.config, b"no weights");
        assert!(e.starts_with("2 ") && e.contains("weights.bpk") && e.contains("does not fit"), "{e}");
        let other = shipped.config.replace("channels = 16", "channels = 8");
        assert!(write(&other, shipped.weights).contains("does not fit"));
    }

    /// The points of a look alone decide: their order does not, and a mirrored look has no more than a mirrored scan.
    #[test]
    fn a_look_is_its_points() {
        let points = rails();
        let backwards: Vec<LanePoint> = points.iter().rev().copied().collect();
        let mut network = method("{}");
        let (a, b) = (network.estimate(&look(&points, 0.0)), network.estimate(&look(&backwards, 0.0)));
        assert_eq!(a, b);
        assert_eq!((a.provenance.given, a.provenance.used), (92, 92));
        // What cannot be seen has its reason.
        let none = network.estimate(&SensorInput::default()).no_lane;
        assert_eq!(none, Some(LaneError::Empty));
        let mut behind = points[0];
        behind.at_m = [-5.0, 0.0];
        let e = network.estimate(&look(&[behind], 0.0)).no_lane.unwrap().to_string();
        assert!(e.contains("no point is in the 60 x 40 m"), "{e}");
        behind.at_m = [f64::NAN, 0.0];
        assert!(network.estimate(&look(&[behind], 0.0)).no_lane.is_some());
    }

    /// Turning the radar on the vehicle turns the picture back: the network sees the same cells.
    #[test]
    fn the_mount_is_taken_out_of_the_picture() {
        let options = SegmentationOptions::default();
        let of = |mount: RadarMount, points: &[LanePoint]| {
            Segmentation::open(Path::new(""), &options, mount).unwrap().scan(points)
        };
        let points = rails();
        let straight = of(RadarMount::default(), &points);
        let mount = RadarMount { at_m: DVec2::new(3.5, -0.4), yaw_rad: 0.2 };
        let moved: Vec<LanePoint> = points
            .iter()
            .map(|p| LanePoint {
                at_m: mount.to_vehicle(DVec2::from_array(p.at_m)).to_array(),
                azimuth_rad: p.azimuth_rad + mount.yaw_rad,
                ..*p
            })
            .collect();
        let turned = of(mount, &moved);
        assert!(straight.cells.len() > 80 && straight.cells.len() == turned.cells.len());
        for (a, b) in straight.cells.iter().zip(&turned.cells) {
            assert_eq!((a.cell, a.count, a.amplitude), (b.cell, b.count, b.amplitude), "{a:?} {b:?}");
            assert!((a.azimuth_rad - b.azimuth_rad).abs() < 1e-6);
        }
    }

    /// Scans together need the bus; at rest the same scan twice decides as it did once.
    #[test]
    fn scans_are_joined_by_the_bus() {
        let points = rails();
        let mut three = method(r#"{"scans": 3}"#);
        let silent = SensorInput { speed_mps: None, ..look(&points, 0.0) };
        assert_eq!(three.estimate(&silent).no_lane, Some(LaneError::NoSpeed));
        let silent = SensorInput { yaw_rate_rad_per_s: None, ..look(&points, 0.0) };
        assert!(matches!(three.estimate(&silent).no_lane, Some(LaneError::NotGiven { .. })));
        let mut one = method("{}");
        // The first look is that of one scan, but for rounding; later ones are not.
        let (a, b) = (one.estimate(&look(&points, 0.0)), three.estimate(&look(&points, 0.0)));
        assert_eq!(a.lines.len(), b.lines.len());
        for (x, y) in a.lines.iter().zip(&b.lines) {
            let [p, q] = [x, y].map(|l| l.fitted.curve.at(10.0).at_m);
            assert!(p.distance(q) < 0.05, "{p} {q}");
        }
        let later = three.estimate(&look(&points, 0.1));
        assert_ne!(later.lines, b.lines);
        // A look that goes back in time begins anew.
        let again = three.estimate(&look(&points, 0.0));
        assert_eq!(again.lines, b.lines);
    }
}
