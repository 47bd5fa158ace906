//! Lanes from radar: what an estimator is given and what it answers. Estimators take points from any source; places are in the
//! vehicle's level frame, x forward, y left, the origin on the road under the vehicle's reference point.

pub mod body;
pub mod camera_fusion;
pub mod curve;
pub mod error;
pub mod hd_map;
pub mod markers;
mod matrix;
mod numeric;
pub mod range_doppler;
pub mod road_shape;
mod robust;
pub mod score;
mod side;
pub mod signature;
mod standing;
pub mod track;
pub mod uwb;

use curve::Fitted;
pub use error::LaneError;
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
    /// The mean by weights of one over the variance. None without values, or where no weight is finite.
    pub(crate) fn mean(all: impl Iterator<Item = Measured> + Clone) -> Option<Measured> {
        let weight: f64 = all.clone().map(|m| m.std.powi(-2)).sum();
        let value = all.map(|m| m.value * m.std.powi(-2)).sum::<f64>() / weight;
        (weight.is_finite() && weight > 0.0).then(|| Measured { value, std: weight.powf(-0.5) })
    }
}

/// A detected point as lane estimators take it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LanePoint {
    /// Vehicle's level frame.
    pub at_m: [f64; 2],
    /// One standard deviation along and across the direction from the radar.
    pub std_m: [f64; 2],
    /// Positive when receding.
    pub range_rate_mps: f64,
    /// Standard deviation of the range rate, m/s.
    pub range_rate_std_mps: f64,
    /// From the radar, which need not stand at the origin.
    pub range_m: f64,
    /// In the level frame, positive left.
    pub azimuth_rad: f64,
    /// Radar cross-section, dBsm.
    pub rcs_dbsm: f64,
    /// Signal-to-noise ratio, dB.
    pub snr_db: f64,
}

/// Something that moves, as a tracker gives it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LaneTrack {
    /// Number of the track, the same from one instant to the next.
    pub id: u64,
    /// Vehicle's level frame.
    pub at_m: [f64; 2],
    /// Standard deviation along both axes, m.
    pub std_m: [f64; 2],
    /// Over the ground, along the axes of that frame.
    pub velocity_mps: [f64; 2],
}

/// A scan of an impulse radar at a time of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct PulseScan {
    /// Time of the scan, s.
    pub time_s: f64,
    /// Of the vehicle at that time.
    pub speed_mps: Option<Measured>,
    /// Samples of the scan, near ranges first.
    pub samples: Vec<f64>,
}

/// All that one instant gives to an estimator, which takes of it what it needs. What a source does not give stays empty.
#[derive(Debug, Clone, Copy, Default)]
pub struct SensorInput<'a> {
    /// Time of the instant, s.
    pub time_s: f64,
    /// Of the vehicle, as its bus tells.
    pub speed_mps: Option<Measured>,
    /// Positive to the left.
    pub yaw_rate_rad_per_s: Option<Measured>,
    /// Detected points of the radar's scan.
    pub points: &'a [LanePoint],
    /// Tracks of what moves.
    pub tracks: &'a [LaneTrack],
    /// Samples of an impulse radar's scan.
    pub pulse: Option<&'a [f64]>,
    /// Scans since the look before, of an impulse radar that takes more of them than there are looks; the oldest first.
    pub scans: &'a [PulseScan],
    /// Picture of a camera.
    pub image: Option<&'a camera_fusion::Image>,
    /// Of the radar on the earth.
    pub place: Option<hd_map::RadarPose>,
}

/// A method that finds lanes. It may remember earlier looks, which come in the order of their times.
pub trait LaneEstimator {
    /// As on the command line.
    fn method(&self) -> &'static str;

    /// Never fails: what cannot be told is stated with its reason ([`LaneEstimate::no_lane`]).
    fn estimate(&mut self, input: &SensorInput<'_>) -> LaneEstimate;
}

/// A line that bounds a lane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// The curve of the line with its covariance.
    pub fitted: Fitted,
    /// 0 to 1.
    pub confidence: f64,
    /// Indices of the points that it was fitted to.
    pub members: Vec<usize>,
}

/// What a method says of the lane at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaneEstimate {
    /// Time of the estimate, s.
    pub time_s: f64,
    /// From right to left where the vehicle stands.
    pub lines: Vec<Line>,
    /// Number of the vehicle's lane in a map.
    pub lane_number: Option<i32>,
    /// Width of the vehicle's lane, m.
    pub width_m: Option<Measured>,
    /// Of the vehicle from the middle of its lane, positive left.
    pub offset_m: Option<Measured>,
    /// Of the vehicle against the lane, positive left.
    pub heading_rad: Option<Measured>,
    /// Of the lane where the vehicle stands, positive left; its reciprocal is the radius.
    pub curvature_per_m: Option<Measured>,
    /// 0 to 1; 0 where there is no lane.
    pub confidence: f64,
    /// Why there is no lane; None where there is one.
    pub no_lane: Option<LaneError>,
    /// The mirrored lane fits as well: offset, heading, curvature and lines hold up to one common sign.
    #[serde(default)]
    pub mirror: bool,
    /// The method, and how many points it took.
    pub provenance: Provenance,
}

/// Where an estimate comes from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// As on the command line.
    pub method: String,
    /// Points that were given, and that the lines rest on.
    pub given: usize,
    /// Number of points that the lines rest on.
    pub used: usize,
}

impl LaneEstimate {
    /// Nothing found, and why.
    pub fn none(method: &str, time_s: f64, given: usize, why: LaneError) -> LaneEstimate {
        LaneEstimate { no_lane: Some(why.stated()), ..LaneEstimate::empty(method, time_s, given) }
    }

    /// Nothing known yet.
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

    /// The lane between the nearest line on the left and on the right of the vehicle, from lines in any order.
    pub fn of_lines(method: &str, time_s: f64, given: usize, lines: Vec<Line>) -> LaneEstimate {
        let mut beside: Vec<(f64, Line)> =
            lines.into_iter().map(|l| (left_of_origin(&l.fitted).0, l)).collect();
        beside.sort_by(|a, b| a.0.total_cmp(&b.0));
        // A line far ahead, whose place beside the vehicle nobody knows, bounds its lane only where no other does.
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

/// Standard deviation beside the vehicle from which on a line may be any lane's, m: a lane.
pub(crate) const UNKNOWN_M: f64 = 3.0;

fn beside_origin(f: &Fitted) -> curve::CurvePoint {
    f.curve.at(f.curve.foot(glam::DVec2::ZERO).s_m)
}

/// How far to the left of the vehicle a line lies, and its standard deviation there, m.
fn left_of_origin(f: &Fitted) -> (f64, f64) {
    let foot = f.curve.foot(glam::DVec2::ZERO);
    let at = f.curve.at(foot.s_m);
    // A line that runs towards the vehicle has its left on the other side.
    let ahead = if at.heading_rad.cos() < 0.0 { -1.0 } else { 1.0 };
    (-foot.left_m * ahead, f.lateral_std_m(foot.s_m))
}
