//! Lanes from radar: the input that estimators take and the estimates that they return. Estimators take
//! points from any source. Positions are in the vehicle's level frame: x forward, y left, the origin on the
//! road under the vehicle's reference point.

pub mod body;
pub mod camera_fusion;
pub mod curve;
pub mod error;
pub mod hd_map;
pub mod limits;
pub mod markers;
mod matrix;
mod numeric;
pub mod range_doppler;
pub mod registry;
pub mod road_shape;
mod robust;
pub mod score;
pub mod segmentation;
mod side;
pub mod signature;
mod standing;
pub mod track;
pub mod uwb;

use curve::Fitted;
pub use error::LaneError;
pub use registry::Registry;
use serde::{Deserialize, Serialize};

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Its standard deviation, in the value's unit.
    pub std: f64,
}

impl Measured {
    /// The mean weighted by the inverse variances. None without values, or where the sum of weights is not
    /// positive and finite.
    pub(crate) fn mean(all: impl Iterator<Item = Measured> + Clone) -> Option<Measured> {
        let weight: f64 = all.clone().map(|m| m.std.powi(-2)).sum();
        let value = all.map(|m| m.value * m.std.powi(-2)).sum::<f64>() / weight;
        (weight.is_finite() && weight > 0.0).then(|| Measured { value, std: weight.powf(-0.5) })
    }
}

/// A detected point as input of lane estimators.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LanePoint {
    /// Position in the vehicle's level frame, m.
    pub at_m: [f64; 2],
    /// Standard deviations along and across the direction from the radar, m.
    pub std_m: [f64; 2],
    /// Range rate, m/s, positive when receding.
    pub range_rate_mps: f64,
    /// Standard deviation of the range rate, m/s.
    pub range_rate_std_mps: f64,
    /// Range from the radar, m; the radar need not stand at the origin.
    pub range_m: f64,
    /// Azimuth in the level frame, rad, positive to the left.
    pub azimuth_rad: f64,
    /// Radar cross-section, dBsm.
    pub rcs_dbsm: f64,
    /// Signal-to-noise ratio, dB.
    pub snr_db: f64,
    /// Received power, dBm, or dB over any level that all points of a look share; None where the sensor does not tell it.
    #[serde(default)]
    pub power_dbm: Option<f64>,
}

/// A moving object as a tracker reports it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LaneTrack {
    /// Identifier of the track, the same from one look to the next.
    pub id: u64,
    /// Position in the vehicle's level frame, m.
    pub at_m: [f64; 2],
    /// Standard deviation of the position along both axes, m.
    pub std_m: [f64; 2],
    /// Velocity over the ground along the axes of that frame, m/s.
    pub velocity_mps: [f64; 2],
}

/// One scan of an impulse radar with its own time.
#[derive(Debug, Clone, PartialEq)]
pub struct PulseScan {
    /// Time of the scan, s.
    pub time_s: f64,
    /// Speed of the vehicle at that time, m/s.
    pub speed_mps: Option<Measured>,
    /// Samples of the scan, near ranges first.
    pub samples: Vec<f64>,
}

/// All input of one look. An estimator takes from it what it needs; what a source does not give stays empty.
#[derive(Debug, Clone, Copy, Default)]
pub struct SensorInput<'a> {
    /// Time of the look, s.
    pub time_s: f64,
    /// Speed of the vehicle as reported by its bus, m/s.
    pub speed_mps: Option<Measured>,
    /// Yaw rate of the vehicle, rad/s, positive to the left.
    pub yaw_rate_rad_per_s: Option<Measured>,
    /// Detected points of the radar's scan.
    pub points: &'a [LanePoint],
    /// Tracks of moving objects.
    pub tracks: &'a [LaneTrack],
    /// Samples of an impulse radar's scan.
    pub pulse: Option<&'a [f64]>,
    /// Scans since the last look, the oldest first, of an impulse radar that scans more often than there are
    /// looks.
    pub scans: &'a [PulseScan],
    /// Image of a camera.
    pub image: Option<&'a camera_fusion::Image>,
    /// Position and direction of the radar on the earth.
    pub place: Option<hd_map::RadarPose>,
}

/// A method that finds lanes. It may remember earlier looks, which must come in order of time.
pub trait LaneEstimator {
    /// The method's name, as on the command line.
    fn method(&self) -> &'static str;

    /// Estimates the lane. It never fails: what cannot be estimated is stated with its reason
    /// ([`LaneEstimate::no_lane`]).
    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate;
}

/// A line that bounds a lane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// The curve of the line with its covariance.
    pub fitted: Fitted,
    /// Confidence in the line, 0 to 1.
    pub confidence: f64,
    /// Indices of the points to which it was fitted.
    pub members: Vec<usize>,
}

/// The lane that a method estimates for one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaneEstimate {
    /// Time of the estimate, s.
    pub time_s: f64,
    /// Lines from right to left where the vehicle stands.
    pub lines: Vec<Line>,
    /// Number of the vehicle's lane in a map.
    pub lane_number: Option<i32>,
    /// Width of the vehicle's lane, m.
    pub width_m: Option<Measured>,
    /// Offset of the vehicle from the lane's centre line, m, positive to the left.
    pub offset_m: Option<Measured>,
    /// Heading of the vehicle relative to the lane, rad, positive to the left.
    pub heading_rad: Option<Measured>,
    /// Curvature of the lane where the vehicle stands, 1/m, positive to the left; its reciprocal is the
    /// radius.
    pub curvature_per_m: Option<Measured>,
    /// Confidence in the lane, 0 to 1; 0 where there is no lane.
    pub confidence: f64,
    /// The reason why there is no lane; None where there is one.
    pub no_lane: Option<LaneError>,
    /// Whether the mirrored lane fits as well: offset, heading, curvature and lines are then known only up to
    /// one common sign.
    #[serde(default)]
    pub mirror: bool,
    /// The method and the number of points that it took.
    pub provenance: Provenance,
}

/// The origin of an estimate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// The method's name, as on the command line.
    pub method: String,
    /// Number of points that were given.
    pub given: usize,
    /// Number of points that the lines rest on.
    pub used: usize,
}

impl LaneEstimate {
    /// Makes an estimate without a lane, with its reason.
    pub fn none(method: &str, time_s: f64, given: usize, why: LaneError) -> LaneEstimate {
        LaneEstimate { no_lane: Some(why.stated()), ..LaneEstimate::empty(method, time_s, given) }
    }

    /// Makes an estimate that states nothing yet.
    pub(crate) fn empty(method: &str, time_s: f64, given: usize) -> LaneEstimate {
        LaneEstimate {
            time_s,
            lines: Vec::new(),
            lane_number: None,
            width_m: None,
            offset_m: None,
            heading_rad: None,
            curvature_per_m: None,
            confidence: 0.0,
            no_lane: None,
            mirror: false,
            provenance: Provenance { method: method.into(), given, used: 0 },
        }
    }

    /// Makes an estimate of the lane between the nearest lines to the left and to the right of the vehicle,
    /// from lines in any order.
    pub fn of_lines(method: &str, time_s: f64, given: usize, lines: Vec<Line>) -> LaneEstimate {
        let mut beside: Vec<(f64, Line)> =
            lines.into_iter().map(|l| (left_of_origin(&l.fitted).0, l)).collect();
        beside.sort_by(|a, b| a.0.total_cmp(&b.0));
        // A line far ahead whose position beside the vehicle is unknown bounds its lane only where no other
        // does.
        let known = |l: &Line| left_of_origin(&l.fitted).1 < UNKNOWN_M;
        let on_left = |i: &(f64, Line)| i.0 > 0.0;
        let left =
            beside.iter().position(|b| on_left(b) && known(&b.1)).or_else(|| beside.iter().position(on_left));
        let right = beside
            .iter()
            .rposition(|b| !on_left(b) && known(&b.1))
            .or_else(|| beside.iter().rposition(|b| !on_left(b)));
        let line = |i: Option<usize>| i.map(|i| &beside[i].1);
        let (l, r) = (line(left), line(right));
        let mut out = LaneEstimate::empty(method, time_s, given);
        if let (Some(l), Some(r)) = (l, r) {
            let ((yl, sl), (yr, sr)) = (left_of_origin(&l.fitted), left_of_origin(&r.fitted));
            out.width_m = Some(Measured { value: yl - yr, std: sl.hypot(sr) });
            out.offset_m = Some(Measured { value: -0.5 * (yl + yr), std: 0.5 * sl.hypot(sr) });
        }
        let mean = |of: &dyn Fn(&Fitted) -> Measured| {
            Measured::mean([l, r].into_iter().flatten().map(|x| of(&x.fitted)))
        };
        out.heading_rad = mean(&|f| Measured {
            value: -beside_origin(f).heading_rad,
            std: f.covariance[1][1].sqrt().max(1e-9),
        });
        out.curvature_per_m = mean(&|f| Measured {
            value: beside_origin(f).curvature_per_m,
            std: f.covariance[2][2].sqrt().max(1e-9),
        });
        out.confidence = [l, r].into_iter().flatten().map(|x| x.confidence).fold(0.0, f64::max);
        out.provenance.used = beside.iter().map(|(_, l)| l.members.len()).sum();
        out.lines = beside.into_iter().map(|(_, l)| l).collect();
        out
    }
}

/// Standard deviation beside the vehicle from which on a line may belong to any lane, m: about one lane's
/// width.
pub(crate) const UNKNOWN_M: f64 = 3.0;

fn beside_origin(f: &Fitted) -> curve::CurvePoint {
    f.curve.at(f.curve.foot(glam::DVec2::ZERO).s_m)
}

/// Distance of a line to the left of the vehicle, and its standard deviation there, m.
fn left_of_origin(f: &Fitted) -> (f64, f64) {
    let foot = f.curve.foot(glam::DVec2::ZERO);
    let at = f.curve.at(foot.s_m);
    // A line that runs towards the vehicle has its left on the other side.
    let ahead = if at.heading_rad.cos() < 0.0 { -1.0 } else { 1.0 };
    (-foot.left_m * ahead, f.lateral_std_m(foot.s_m))
}
