//! Trajectories: places and headings at given times, in the scenario or in a CSV file, as a motion whose velocity and
//! acceleration are the slopes of the curve through them.

use super::motion::{Channel, Interpolation, Joint, Linear, Motion};
use super::toml_file::{At, Document};
use crate::base::error::{BadInput, Result};
use crate::base::frames::{Pose, Target, World};
use crate::formats::csv::Table;
use glam::{DQuat, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// Longest time between two keys of a rotation, s. A cubic between them leaves out less than a microradian of a turn of 1 rad/s.
const KEY_S: f64 = 0.05;
/// So long before its first and after its last waypoint a trajectory keeps to its curve, no longer than its first and last piece,
/// before it goes straight on: frames about these times lie on one smooth curve.
pub(super) const LEAD_S: f64 = 0.1;
/// What goes more slowly stands, m/s: it keeps its heading.
pub const STANDING_MPS: f64 = 0.1;
/// Most waypoints of a trajectory.
const MOST: usize = 1_000_000;
/// Longest time from the first to the last waypoint, s: what is sampled for headings and ways stays within memory.
pub(super) const LONGEST_S: f64 = 2e5;
/// Greatest coordinate in the world, m.
pub(super) const FAR_M: f64 = 1e6;
/// Fastest motion, m/s.
const FASTEST_MPS: f64 = 1e5;

/// Interpolation of positions between waypoints.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Between {
    /// Cubic spline with continuous velocity and acceleration (not-a-knot ends).
    #[default]
    Spline,
    /// Monotone piecewise cubic (Fritsch and Carlson) with continuous velocity and no overshoot: an object that stops stays at rest.
    Pchip,
    /// Linear; the velocity is discontinuous at each waypoint.
    Linear,
}

/// Motion before the first and after the last waypoint.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Outside {
    /// Straight on with the velocity at that waypoint.
    #[default]
    GoOn,
    /// At rest at that waypoint.
    Stay,
}

impl Outside {
    fn ends<T: Linear>(self, channel: Channel<T>) -> Channel<T> {
        if self == Outside::GoOn { channel.going_on() } else { channel }
    }
}

/// A trajectory through waypoints, in place of position, heading and velocity.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrajectoryTable {
    /// CSV file of waypoints, relative to this file: columns time_s, x_m, y_m and optionally z_m, yaw_deg,
    /// pitch_deg, roll_deg; other columns are ignored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<At<String>>,
    /// The waypoints with ascending times, in place of a file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waypoint: Vec<WaypointTable>,
    /// Interpolation between waypoints.
    #[serde(default)]
    pub interpolation: Between,
    /// Motion before the first and after the last waypoint.
    #[serde(default)]
    pub outside: Outside,
    /// Time of the waypoints that corresponds to the middle of frame 0, s.
    #[serde(default)]
    pub start_s: At<f64>,
    /// Position in the coordinates of the waypoints that becomes the origin of the world, m, for example to
    /// make large map coordinates small.
    #[serde(default)]
    pub origin_m: At<[f64; 3]>,
}

/// A waypoint: a position at a time.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaypointTable {
    /// Time of the waypoint, s.
    pub time_s: At<f64>,
    /// Position of the waypoint, [forward, left, up] in the world, m.
    pub position_m: At<[f64; 3]>,
    /// Heading, degrees, positive to the left; given for all waypoints or for none. Default: the direction of the path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yaw_deg: Option<At<f64>>,
    /// Pitch, degrees, positive nose down.
    #[serde(default)]
    pub pitch_deg: At<f64>,
    /// Roll, degrees, positive left side up.
    #[serde(default)]
    pub roll_deg: At<f64>,
}

/// A trajectory that has been read and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Motion, in the world, of what follows the trajectory, from the middle of frame 0.
    pub motion: Arc<Motion>,
    /// Way since time zero, m, and its rate; what rolls or walks keeps to it.
    pub way_m: Arc<Channel<f64>>,
    /// Mean speed while it moves, m/s.
    pub mean_speed_mps: f64,
    /// First and last waypoint, s.
    pub span_s: (f64, f64),
    /// What happens outside of them.
    pub outside: Outside,
    /// Columns of its file that are passed over, although their names are like those of a heading or a height that the file lacks.
    pub passed_over: Vec<String>,
}

/// One coordinate or angle at the waypoints.
struct Curve {
    values: Vec<f64>,
    /// (into, out of) each waypoint, per second.
    slopes: Vec<(f64, f64)>,
}

impl Curve {
    fn new(times_s: &[f64], values: Vec<f64>, between: Between) -> Curve {
        let smooth = |slopes: Vec<f64>| slopes.into_iter().map(|s| (s, s)).collect();
        let slopes = match between {
            Between::Spline => smooth(spline_slopes(times_s, &values)),
            Between::Pchip => smooth(pchip_slopes(times_s, &values)),
            Between::Linear => {
                let secants = secants(times_s, &values);
                let last = secants.len() - 1;
                (0..values.len()).map(|i| (secants[i.saturating_sub(1)], secants[i.min(last)])).collect()
            }
        };
        Curve { values, slopes }
    }

    /// Value, rate and second derivative at a share `u` of the way from waypoint `i` to the next, `length_s` later; `u` may lie
    /// outside of 0..=1, where the same cubic goes on.
    fn at(&self, i: usize, u: f64, length_s: f64) -> [f64; 3] {
        let (a, b) = (self.values[i], self.values[i + 1]);
        let (out, into) = (self.slopes[i].1 * length_s, self.slopes[i + 1].0 * length_s);
        // Monomials about the first of the two: exact where it is straight.
        let c2 = 3.0 * (b - a) - 2.0 * out - into;
        let c3 = 2.0 * (a - b) + out + into;
        [
            a + u * (out + u * (c2 + u * c3)),
            (out + u * (2.0 * c2 + 3.0 * u * c3)) / length_s,
            (2.0 * c2 + 6.0 * u * c3) / (length_s * length_s),
        ]
    }
}

fn secants(t: &[f64], y: &[f64]) -> Vec<f64> {
    t.windows(2).zip(y.windows(2)).map(|(t, y)| (y[1] - y[0]) / (t[1] - t[0])).collect()
}

/// Slopes of the cubic spline with continuous second derivatives whose third derivative is continuous too at the second and at the
/// last but one knot (de Boor, *A Practical Guide to Splines*, ch. IV): a cubic comes back exactly.
fn spline_slopes(t: &[f64], y: &[f64]) -> Vec<f64> {
    let n = t.len();
    let h: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    let d = secants(t, y);
    if n == 2 {
        return vec![d[0]; 2];
    }
    if n == 3 {
        let bend = (d[1] - d[0]) / (h[0] + h[1]);
        return vec![d[0] - bend * h[0], d[0] + bend * h[0], d[1] + bend * h[1]];
    }
    // Rows (lower, diagonal, upper | right side), eliminated as they are made.
    let (mut upper, mut right) = (vec![0.0; n], vec![0.0; n]);
    let first = h[0] + h[1];
    upper[0] = first / h[1];
    right[0] = ((h[0] + 2.0 * first) * h[1] * d[0] + h[0] * h[0] * d[1]) / (first * h[1]);
    for i in 1..n - 1 {
        let pivot = 2.0 * (h[i - 1] + h[i]) - h[i] * upper[i - 1];
        upper[i] = h[i - 1] / pivot;
        right[i] = (3.0 * (h[i] * d[i - 1] + h[i - 1] * d[i]) - h[i] * right[i - 1]) / pivot;
    }
    let (a, b) = (h[n - 3], h[n - 2]);
    let last = a + b;
    let value = (b * b * d[n - 3] + (2.0 * last + b) * a * d[n - 2]) / last;
    right[n - 1] = (value - last * right[n - 2]) / (a - last * upper[n - 2]);
    for i in (0..n - 1).rev() {
        right[i] -= upper[i] * right[i + 1];
    }
    right
}

/// Slopes that leave no value outside of those at the two waypoints about it (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980)
/// 238; weights and ends of Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300).
fn pchip_slopes(t: &[f64], y: &[f64]) -> Vec<f64> {
    let n = t.len();
    let h: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    let d = secants(t, y);
    if n == 2 {
        return vec![d[0]; 2];
    }
    let end = |h0: f64, h1: f64, d0: f64, d1: f64| {
        let s = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
        if s * d0 <= 0.0 {
            0.0
        } else if d0 * d1 <= 0.0 && s.abs() > 3.0 * d0.abs() {
            3.0 * d0
        } else {
            s
        }
    };
    let mut slopes = vec![0.0; n];
    slopes[0] = end(h[0], h[1], d[0], d[1]);
    slopes[n - 1] = end(h[n - 2], h[n - 3], d[n - 2], d[n - 3]);
    for i in 1..n - 1 {
        if d[i - 1] * d[i] > 0.0 {
            let (w1, w2) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
            slopes[i] = (w1 + w2) / (w1 / d[i - 1] + w2 / d[i]);
        }
    }
    slopes
}

/// Waypoints as columns, and where to point when one of them is wrong.
struct Waypoints {
    times_s: Vec<f64>,
    places_m: Vec<DVec3>,
    /// Yaw where it is given, pitch, roll; radians.
    yaw_rad: Option<Vec<f64>>,
    pitch_rad: Vec<f64>,
    roll_rad: Vec<f64>,
    passed_over: Vec<String>,
}

/// Reads and checks a trajectory; `key` is that of its table.
///
/// # Errors
/// Returns an error with file, line and key for waypoints given twice or not at all, fewer than two, times that do not
/// rise, values that are not finite or too large, or a heading that only some waypoints have.
pub fn build(doc: &Document<'_>, key: &str, t: &TrajectoryTable) -> Result<Trajectory> {
    let start_s = doc.finite(&t.start_s, "give the time in seconds at which the scenario begins")?;
    let origin_m = DVec3::from(t.origin_m.value);
    if !origin_m.is_finite() {
        return Err(doc.bad(&t.origin_m.span, "is not three finite numbers").remedy("give metres").into());
    }
    let own = || BadInput::new("").file(doc.file()).key(key);
    let (mut points, at): (Waypoints, Box<dyn Fn(usize) -> BadInput + '_>) = match &t.file {
        Some(file) => {
            if let Some(first) = t.waypoint.first() {
                return Err(doc
                    .bad(&first.time_s.span, "file and waypoint exclude each other")
                    .remedy("keep one of them")
                    .into());
            }
            let path = doc.beside(file)?;
            let table = Table::read(&path)?;
            let points = columns(&path, &table)?;
            let named = path.clone();
            (points, Box::new(move |i| BadInput::new("").file(&named).line(table.line(i))))
        }
        None if t.waypoint.is_empty() => {
            return Err(BadInput { problem: "has no waypoints".into(), ..own() }
                .remedy("give file = \"drive.csv\" with the columns time_s, x_m, y_m, or waypoint = [{ time_s = 0, position_m = [0, 0, 0] }, …]")
                .into());
        }
        None => {
            let at = |i: usize| doc.bad(&t.waypoint[i].time_s.span, "");
            (inline(doc, &t.waypoint)?, Box::new(at))
        }
    };
    let wrong = |i: usize, problem: &str, value: String, allowed: &str| -> BadInput {
        BadInput { problem: problem.into(), ..at(i) }.value(value).allowed(allowed)
    };
    let n = points.times_s.len();
    if n < 2 {
        let b = match n {
            0 => BadInput { problem: "has no waypoints".into(), ..own() },
            _ => BadInput { problem: "has one waypoint".into(), ..at(0) },
        };
        return Err(b.allowed("two or more").remedy("give position_m for a static object").into());
    }
    if n > MOST {
        let e = wrong(MOST, "has too many waypoints", n.to_string(), "up to a million");
        return Err(e.remedy("leave out some of them").into());
    }
    for (time, place) in points.times_s.iter_mut().zip(&mut points.places_m) {
        *time -= start_s;
        *place -= origin_m;
    }
    for i in 0..n {
        let (time, place) = (points.times_s[i], points.places_m[i]);
        if place.abs().max_element() > FAR_M {
            let value = format!("[{}, {}, {}] m", place.x, place.y, place.z);
            let allowed = "-1e6..=1e6 each, after origin_m is subtracted";
            let e = wrong(i, "the waypoint is too far from the origin", value, allowed).key("position_m");
            return Err(e
                .remedy("set origin_m to a position near the radar: it becomes the origin of the world")
                .into());
        }
        let Some(before) = i.checked_sub(1) else { continue };
        let gap_s = time - points.times_s[before];
        if !gap_s.is_finite() || gap_s <= 0.0 {
            let value = format!("{} s after {} s", time + start_s, points.times_s[before] + start_s);
            let e =
                wrong(i, "the times of the waypoints do not ascend", value, "each later than the one before");
            return Err(e.remedy("sort them, and keep one waypoint for each time").into());
        }
        let speed = place.distance(points.places_m[before]) / gap_s;
        if speed > FASTEST_MPS {
            let e = wrong(
                i,
                "the motion to this waypoint is too fast",
                format!("{speed:.3e} m/s"),
                "below 1e5 m/s",
            );
            return Err(e.remedy("check that the units are metres and seconds").into());
        }
    }
    let lasts_s = points.times_s[n - 1] - points.times_s[0];
    if lasts_s > LONGEST_S {
        let e = wrong(n - 1, "the trajectory lasts too long", format!("{lasts_s} s"), "up to 2e5 s");
        return Err(e.remedy("leave out the waypoints before and after the frames").into());
    }
    points.trajectory(t)
}

fn columns(path: &Path, table: &Table) -> Result<Waypoints> {
    let finite = |name: &str| -> Result<Vec<f64>> {
        let list = table.numbers(name)?;
        match list.iter().position(|x| !x.is_finite()) {
            None => Ok(list),
            Some(i) => Err(BadInput::new("is empty or not finite")
                .file(path)
                .line(table.line(i))
                .key(name)
                .value(list[i])
                .allowed("a finite number")
                .remedy("fill it in, or leave the row out")
                .into()),
        }
    };
    let times_s = finite("time_s")?;
    let n = times_s.len();
    let optional = |name: &str| match table.has(name) {
        true => finite(name),
        false => Ok(vec![0.0; n]),
    };
    let (x, y, z) = (finite("x_m")?, finite("y_m")?, optional("z_m")?);
    let places_m = x.into_iter().zip(y).zip(z).map(|((x, y), z)| DVec3::new(x, y, z)).collect();
    let radians = |v: Vec<f64>| v.into_iter().map(f64::to_radians).collect::<Vec<f64>>();
    let yaw_rad = match table.has("yaw_deg") {
        true => Some(radians(finite("yaw_deg")?)),
        false => None,
    };
    let (pitch_rad, roll_rad) = (radians(optional("pitch_deg")?), radians(optional("roll_deg")?));
    Ok(Waypoints { times_s, places_m, yaw_rad, pitch_rad, roll_rad, passed_over: near_misses(&table.header) })
}

/// Columns that look like a heading, an attitude or a height, where the column that is read for it is missing.
fn near_misses(header: &[String]) -> Vec<String> {
    let has = |name: &str| header.iter().any(|h| h == name);
    let like = |name: &str, words: &[&str]| {
        let first = name.to_ascii_lowercase();
        words
            .iter()
            .any(|w| first.strip_prefix(w).is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphabetic())))
    };
    let read = [
        ("yaw_deg", &["yaw", "heading", "hdg", "course", "azimuth", "qw", "qx", "qy", "qz", "quat"][..]),
        ("pitch_deg", &["pitch"][..]),
        ("roll_deg", &["roll"][..]),
        ("z_m", &["z", "alt", "altitude", "height", "up"][..]),
    ];
    header
        .iter()
        .filter(|h| read.iter().any(|(name, words)| !has(name) && *h != name && like(h, words)))
        .cloned()
        .collect()
}

fn inline(doc: &Document<'_>, list: &[WaypointTable]) -> Result<Waypoints> {
    let angle = |a: &At<f64>| doc.finite(a, "give an angle in degrees").map(f64::to_radians);
    let mut out = Waypoints {
        times_s: Vec::with_capacity(list.len()),
        places_m: Vec::with_capacity(list.len()),
        yaw_rad: list[0].yaw_deg.is_some().then(Vec::new),
        pitch_rad: Vec::with_capacity(list.len()),
        roll_rad: Vec::with_capacity(list.len()),
        passed_over: Vec::new(),
    };
    for w in list {
        out.times_s.push(doc.finite(&w.time_s, "give seconds")?);
        // How far it may lie is known when the origin has been taken off.
        let place = DVec3::from(w.position_m.value);
        if !place.is_finite() {
            let e = doc.bad(&w.position_m.span, "is not three finite numbers");
            return Err(e.remedy("give [x, y, z] in metres").into());
        }
        out.places_m.push(place);
        out.pitch_rad.push(angle(&w.pitch_deg)?);
        out.roll_rad.push(angle(&w.roll_deg)?);
        match (&mut out.yaw_rad, &w.yaw_deg) {
            (Some(list), Some(yaw)) => list.push(angle(yaw)?),
            (None, None) => {}
            (known, _) => {
                let problem = match known {
                    Some(_) => "has no yaw_deg, and the waypoints before it have one",
                    None => "has a yaw_deg, and the waypoints before it have none",
                };
                return Err(doc
                    .bad(&w.time_s.span, format!("the waypoint {problem}"))
                    .remedy(
                        "give all waypoints a yaw_deg, or none, so that the heading follows the trajectory",
                    )
                    .into());
            }
        }
    }
    Ok(out)
}

/// Each angle within half a turn of the one before it.
fn unwound(mut angles: Vec<f64>) -> Vec<f64> {
    for i in 1..angles.len() {
        angles[i] = near(angles[i], angles[i - 1]);
    }
    angles
}

/// The angle plus whole turns that lies nearest to another one.
fn near(angle: f64, to: f64) -> f64 {
    angle - std::f64::consts::TAU * ((angle - to) / std::f64::consts::TAU).round()
}

/// A time on the curve: its waypoint, the share of the way to the next, and the time itself.
#[derive(Clone, Copy)]
struct Sample {
    i: usize,
    u: f64,
    length_s: f64,
    time_s: f64,
}

/// An angle and its rates before and after a time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Angle {
    rad: f64,
    into: f64,
    out: f64,
}

impl Waypoints {
    fn trajectory(self, t: &TrajectoryTable) -> Result<Trajectory> {
        let times = &self.times_s;
        let n = times.len();
        let curve = |values: Vec<f64>| Curve::new(times, values, t.interpolation);
        let axis = |k: usize| curve(self.places_m.iter().map(|p| p[k]).collect());
        let place = [axis(0), axis(1), axis(2)];
        let at = |s: Sample, order: usize| {
            DVec3::from_array([0, 1, 2].map(|k: usize| place[k].at(s.i, s.u, s.length_s)[order]))
        };
        let samples = samples(times, t.outside == Outside::GoOn && t.interpolation != Between::Linear);

        // Places: the waypoints themselves, and where the curve ends.
        let key = |s: &Sample| {
            let slope = at(*s, 1);
            (s.time_s, at(*s, 0), (slope, slope))
        };
        let vector = |f: &dyn Fn(&Curve) -> f64| DVec3::from_array([0, 1, 2].map(|k: usize| f(&place[k])));
        let mut keys: Vec<(f64, DVec3, (DVec3, DVec3))> = Vec::with_capacity(n + 4);
        keys.extend(samples.iter().filter(|s| s.time_s < times[0]).map(key));
        keys.extend((0..n).map(|i| {
            let slopes = (vector(&|c| c.slopes[i].0), vector(&|c| c.slopes[i].1));
            (times[i], self.places_m[i], slopes)
        }));
        keys.extend(samples.iter().filter(|s| s.time_s > times[n - 1]).map(key));
        let position = Channel::new(
            keys.iter().map(|k| k.0).collect(),
            keys.iter().map(|k| k.1).collect(),
            keys.iter().map(|k| k.2).collect(),
            Interpolation::Cubic,
        )?;
        let position = Arc::new(t.outside.ends(position));

        // Rotations: angles on a fine grid, so that a cubic between quaternions is short.
        let headings = match &self.yaw_rad {
            Some(yaw) => given(&curve(unwound(yaw.clone())), &samples),
            None => along_way(&samples, &at),
        };
        let given_turn = |angles: &[f64]| given(&curve(unwound(angles.to_vec())), &samples);
        let (pitch, roll) = (given_turn(&self.pitch_rad), given_turn(&self.roll_rad));
        let same = |list: &[Angle]| list.iter().all(|a| *a == Angle { into: 0.0, out: 0.0, ..list[0] });
        let mut joints = Vec::with_capacity(2);
        let rotation = match same(&headings) && same(&pitch) && same(&roll) {
            true => {
                joints.push(Joint::Fixed(turned(headings[0].rad, pitch[0].rad, roll[0].rad), DVec3::ZERO));
                None
            }
            false => Some(Arc::new(rotations(&samples, &headings, &pitch, &roll)?)),
        };
        joints.push(Joint::Track { position_m: Some(position), rotation });

        let (way_m, mean_speed_mps) = way(&samples, &headings, &at, t.outside)?;
        Ok(Trajectory {
            motion: Arc::new(Motion { joints }),
            way_m: Arc::new(way_m),
            mean_speed_mps,
            span_s: (times[0], times[n - 1]),
            outside: t.outside,
            passed_over: self.passed_over,
        })
    }
}

/// A fine grid over the whole curve, and with `lead` a little beyond its ends. Each inner waypoint comes twice: as the end of one
/// piece and as the beginning of the next.
fn samples(times_s: &[f64], lead: bool) -> Vec<Sample> {
    let last = times_s.len() - 2;
    let mut out = Vec::new();
    for i in 0..=last {
        let (from, length_s) = (times_s[i], times_s[i + 1] - times_s[i]);
        let at = |u: f64, time_s: f64| Sample { i, u, length_s, time_s };
        let lead_u = (LEAD_S / length_s).min(1.0);
        if lead && i == 0 {
            out.push(at(-lead_u, from - lead_u * length_s));
        }
        let pieces = (length_s / KEY_S).ceil().clamp(1.0, 1e6) as usize;
        out.extend((0..pieces).map(|k| {
            let u = k as f64 / pieces as f64;
            at(u, from + u * length_s)
        }));
        out.push(at(1.0, times_s[i + 1]));
        if lead && i == last {
            out.push(at(1.0 + lead_u, times_s[i + 1] + lead_u * length_s));
        }
    }
    out
}

/// An angle that the waypoints give, on the grid.
fn given(curve: &Curve, samples: &[Sample]) -> Vec<Angle> {
    let angle = |s: &Sample| {
        let [rad, rate, _] = curve.at(s.i, s.u, s.length_s);
        Angle { rad, into: rate, out: rate }
    };
    samples.iter().map(angle).collect()
}

/// The heading of a way: that of its velocity seen from above. Where it is slower than [`STANDING_MPS`] it turns evenly from the
/// heading before to the one after, and what turns back by more than 135 degrees at once goes backwards.
fn along_way(samples: &[Sample], at: &dyn Fn(Sample, usize) -> DVec3) -> Vec<Angle> {
    let mut known: Option<f64> = None;
    let moving: Vec<Option<(f64, f64)>> = samples
        .iter()
        .map(|s| {
            let (v, a) = (at(*s, 1).truncate(), at(*s, 2).truncate());
            if v.length() < STANDING_MPS {
                return None;
            }
            let mut rad = v.to_angle();
            if let Some(before) = known {
                rad = near(rad, before);
                if (rad - before).abs() > 0.75 * std::f64::consts::PI {
                    rad = near(rad + std::f64::consts::PI, before);
                }
            }
            known = Some(rad);
            Some((rad, v.perp_dot(a) / v.length_squared()))
        })
        .collect();
    let Some(first) = moving.iter().flatten().next().map(|m| m.0) else {
        return vec![Angle { rad: 0.0, into: 0.0, out: 0.0 }; samples.len()];
    };
    let mut out = Vec::with_capacity(samples.len());
    let (mut i, mut before) = (0, None::<(f64, f64)>);
    while i < samples.len() {
        if let Some((rad, rate)) = moving[i] {
            out.push(Angle { rad, into: rate, out: rate });
            before = Some((samples[i].time_s, rad));
            i += 1;
            continue;
        }
        let end = (i..samples.len()).find(|k| moving[*k].is_some());
        let after = end.and_then(|k| moving[k].map(|m| (samples[k].time_s, m.0)));
        let rate = match (before, after) {
            (Some((t, a)), Some((u, b))) if u > t => (b - a) / (u - t),
            _ => 0.0,
        };
        let (from_s, from_rad) = before.unwrap_or((0.0, after.map_or(first, |a| a.1)));
        let end = end.unwrap_or(samples.len());
        out.extend(samples[i..end].iter().map(|s| Angle {
            rad: if rate == 0.0 { from_rad } else { from_rad + rate * (s.time_s - from_s) },
            into: rate,
            out: rate,
        }));
        i = end;
    }
    out
}

fn turned(yaw: f64, pitch: f64, roll: f64) -> DQuat {
    Pose::<Target, World>::from_yaw_pitch_roll(DVec3::ZERO, yaw, pitch, roll).rotation
}

/// Quaternions over time with their slopes.
fn rotations(samples: &[Sample], yaw: &[Angle], pitch: &[Angle], roll: &[Angle]) -> Result<Channel<DQuat>> {
    let (mut times, mut values, mut slopes) = (Vec::new(), Vec::<DQuat>::new(), Vec::<(DQuat, DQuat)>::new());
    for (k, s) in samples.iter().enumerate() {
        let (y, p, r) = (yaw[k], pitch[k], roll[k]);
        let mut q = turned(y.rad, p.rad, r.rad);
        // Neighbours on one side, so that a cubic between them is short.
        if values.last().is_some_and(|before| before.dot(q) < 0.0) {
            q = -q;
        }
        let slope = |yaw: f64, pitch: f64, roll: f64| {
            let (z, y_turn) = (DQuat::from_rotation_z(y.rad), DQuat::from_rotation_y(p.rad));
            let spin = DVec3::Z * yaw + z * (DVec3::Y * pitch) + z * (y_turn * (DVec3::X * roll));
            DQuat::from_xyzw(spin.x, spin.y, spin.z, 0.0) * q * 0.5
        };
        let (into, out) = (slope(y.into, p.into, r.into), slope(y.out, p.out, r.out));
        if times.last() == Some(&s.time_s) {
            // The beginning of the next piece.
            if let Some(last) = slopes.last_mut() {
                last.1 = out;
            }
            continue;
        }
        times.push(s.time_s);
        values.push(q);
        slopes.push((into, out));
    }
    Channel::new(times, values, slopes, Interpolation::Cubic)
}

/// Way since time zero, negative where it goes backwards, and the mean speed while it moves.
fn way(
    samples: &[Sample],
    headings: &[Angle],
    at: &dyn Fn(Sample, usize) -> DVec3,
    outside: Outside,
) -> Result<(Channel<f64>, f64)> {
    let speed = |s: Sample, heading: f64| {
        let v = at(s, 1);
        let ahead = glam::DVec2::from_angle(heading);
        if v.truncate().dot(ahead) < 0.0 { -v.length() } else { v.length() }
    };
    let (mut times, mut ways, mut speeds) = (Vec::new(), Vec::new(), Vec::<(f64, f64)>::new());
    let (mut gone, mut path, mut moving_s) = (0.0, 0.0, 0.0);
    for (k, s) in samples.iter().enumerate() {
        let now = speed(*s, headings[k].rad);
        if times.last() == Some(&s.time_s) {
            if let Some(last) = speeds.last_mut() {
                last.1 = now;
            }
            continue;
        }
        if k > 0 {
            // Simpson over a piece of one cubic.
            let before = samples[k - 1];
            let middle = Sample { u: 0.5 * (before.u + s.u), i: s.i, length_s: s.length_s, time_s: 0.0 };
            let length_s = s.time_s - before.time_s;
            let heading = 0.5 * (headings[k - 1].rad + headings[k].rad);
            let first = speeds.last().map_or(now, |p: &(f64, f64)| p.1);
            let step = length_s / 6.0 * (first + 4.0 * speed(middle, heading) + now);
            gone += step;
            if now.abs() > STANDING_MPS {
                path += step.abs();
                moving_s += length_s;
            }
        }
        times.push(s.time_s);
        ways.push(gone);
        speeds.push((now, now));
    }
    let way = Channel::new(times.clone(), ways.clone(), speeds.clone(), Interpolation::Cubic)?;
    let way = outside.ends(way);
    let start = way.at(0.0).0;
    let ways = ways.into_iter().map(|w| w - start).collect();
    let mean = if moving_s > 0.0 { path / moving_s } else { 0.0 };
    Ok((outside.ends(Channel::new(times, ways, speeds, Interpolation::Cubic)?), mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn read(text: &str) -> Result<Trajectory> {
        let doc = Document::parse("s.toml", text)?;
        build(&doc, "ego.trajectory", &doc.read()?)
    }

    fn through(points: &[(f64, [f64; 3])], more: &str) -> String {
        let list = points
            .iter()
            .map(|(t, p)| format!("{{ time_s = {t:?}, position_m = {p:?} }}"))
            .collect::<Vec<_>>()
            .join(", ");
        format!("waypoint = [{list}]\n{more}")
    }

    /// Velocity and spin are the slopes of place and rotation.
    fn check_rates(t: &Trajectory, times: impl Iterator<Item = f64>) {
        let h = 1e-5;
        for time in times {
            let (a, b, c) = (t.motion.at(time - h), t.motion.at(time), t.motion.at(time + h));
            let v = (c.translation_m - a.translation_m) / (2.0 * h);
            assert!((v - b.velocity_mps).length() < 1e-6, "{time}: {v} {}", b.velocity_mps);
            let mut turn = c.rotation * a.rotation.inverse();
            if turn.w < 0.0 {
                turn = -turn;
            }
            let spin = turn.to_scaled_axis() / (2.0 * h);
            assert!((spin - b.spin_rad_per_s).length() < 1e-5, "{time}: {spin} {}", b.spin_rad_per_s);
        }
    }

    /// Uneven times through a cubic in each coordinate: places, velocities, heading and yaw rate are those of the cubic, also a
    /// little before the first and after the last waypoint; further out it goes straight on.
    #[test]
    fn a_cubic_comes_back() {
        let place =
            |t: f64| DVec3::new(12.0 * t + 0.7 * t * t - 0.05 * t * t * t, 0.4 * t * t, 1.0 - 0.1 * t);
        let speed = |t: f64| DVec3::new(12.0 + 1.4 * t - 0.15 * t * t, 0.8 * t, -0.1);
        let bend = |t: f64| DVec3::new(1.4 - 0.3 * t, 0.8, 0.0);
        let times = [0.0, 0.3, 1.1, 1.9, 2.0, 3.5];
        let points: Vec<(f64, [f64; 3])> = times.iter().map(|t| (*t, place(*t).to_array())).collect();
        let t = read(&through(&points, "")).unwrap();
        for time in [-0.09, 0.0, 0.17, 0.9, 1.95, 2.7, 3.5, 3.59] {
            let m = t.motion.at(time);
            assert!(m.translation_m.distance(place(time)) < 1e-12, "{time}");
            assert!(m.velocity_mps.distance(speed(time)) < 1e-11, "{time}");
            let (v, a) = (speed(time).truncate(), bend(time).truncate());
            let ahead = (m.rotation * DVec3::X).truncate();
            assert!(ahead.angle_to(v).abs() < 1e-6, "{time}");
            // Rotations have no lead beyond their last key.
            if (0.0..3.5).contains(&time) {
                let rate = v.perp_dot(a) / v.length_squared();
                assert!((m.spin_rad_per_s - DVec3::Z * rate).length() < 1e-5, "{time}");
            }
        }
        check_rates(&t, [0.013, 0.71, 1.96, 3.3].into_iter());
        let (a, b) = (t.motion.at(5.0), t.motion.at(3.6));
        assert!(a.velocity_mps.distance(b.velocity_mps) < 1e-12);
        assert!(a.translation_m.distance(b.translation_m + b.velocity_mps * 1.4) < 1e-9);
        // A run may have more frames than the scenario says.
        let far = t.motion.at(5000.0).translation_m - b.translation_m;
        assert!(far.distance(b.velocity_mps * 4996.4) < 1e-6 && t.way_m.at(5000.0).1 > 1.0);
        // The way is the integral of the speed.
        let n = 100_000;
        let sum: f64 = (0..n).map(|i| speed(3.5 * (f64::from(i) + 0.5) / f64::from(n)).length()).sum();
        assert!((t.way_m.at(3.5).0 - sum * 3.5 / f64::from(n)).abs() < 1e-5);
        assert_eq!(t.way_m.at(0.0).0, 0.0);
    }

    /// A circle of 50 m at 10 m/s, a waypoint each half second: the spline's own error, (h/r)⁴ of the radius over 384.
    #[test]
    fn a_circle_is_round() {
        let (r, w) = (50.0, 0.2);
        let place = |t: f64| DVec3::new(r * (w * t).sin(), r * (1.0 - (w * t).cos()), 0.0);
        let points: Vec<(f64, [f64; 3])> =
            (0..=40).map(|i| (0.5 * f64::from(i), place(0.5 * f64::from(i)).to_array())).collect();
        let t = read(&through(&points, "")).unwrap();
        for i in 0..200 {
            let time = 2.0 + 0.08 * f64::from(i);
            let m = t.motion.at(time);
            assert!(m.translation_m.distance(place(time)) < 2e-5, "{time}");
            assert!((m.velocity_mps.length() - 10.0).abs() < 1e-4, "{time}");
            assert!((m.spin_rad_per_s - DVec3::Z * w).length() < 1e-3, "{time} {}", m.spin_rad_per_s);
        }
        // Unwound: two thirds of a turn, without a jump.
        check_rates(&t, (0..40).map(|i| 0.21 + 0.43 * f64::from(i)));
        assert!((t.mean_speed_mps - 10.0).abs() < 1e-3);
    }

    /// A car that stops at 40 m, stands, and goes back: pchip stays where it stops; backwards it keeps its nose ahead, and the way
    /// runs back.
    #[test]
    fn stops_and_goes_back() {
        let points: Vec<(f64, [f64; 3])> =
            [(0.0, 0.0), (2.0, 20.0), (4.0, 40.0), (6.0, 40.0), (8.0, 40.0), (10.0, 25.0), (12.0, 5.0)]
                .map(|(t, x)| (t, [x, x, 0.0]))
                .to_vec();
        let t = read(&through(&points, "interpolation = \"pchip\"")).unwrap();
        for i in 0..=120 {
            let time = 0.1 * f64::from(i);
            let m = t.motion.at(time);
            assert!(m.translation_m.x < 40.0 + 1e-12, "{time}");
            if (4.0..=8.0).contains(&time) {
                assert!(m.velocity_mps.length() < 1e-12 && m.translation_m.x > 40.0 - 1e-12, "{time}");
            }
            let ahead = m.rotation * DVec3::X;
            assert!((ahead - DVec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-9, "{time} {ahead}");
        }
        assert!((t.way_m.at(12.0).0 - 5.0 * 2f64.sqrt()).abs() < 1e-6);
        assert!(t.way_m.at(11.0).1 < -1.0);
        // The spline overshoots there, and says so by going on.
        let spline = read(&through(&points, "")).unwrap();
        assert!((0..40).any(|i| spline.motion.at(4.0 + 0.1 * f64::from(i)).translation_m.x > 40.1));
        check_rates(&t, [0.5, 3.3, 9.1, 11.7].into_iter());
    }

    #[test]
    fn straight_lines_and_ends() {
        let points = [(1.0, [0.0, 0.0, 0.0]), (2.0, [10.0, 0.0, 0.0]), (4.0, [10.0, 10.0, 0.0])];
        let t = read(&through(&points, "interpolation = \"linear\"\noutside = \"stay\"")).unwrap();
        let m = t.motion.at(1.75);
        assert_eq!((m.translation_m, m.velocity_mps), (DVec3::X * 7.5, DVec3::X * 10.0));
        let m = t.motion.at(3.0);
        assert!((m.velocity_mps - DVec3::Y * 5.0).length() < 1e-12);
        assert!((m.rotation * DVec3::X - DVec3::Y).length() < 1e-12);
        for time in [0.0, 7.0] {
            assert_eq!(t.motion.at(time).velocity_mps, DVec3::ZERO);
        }
        let t = read(&through(&points, "interpolation = \"linear\"")).unwrap();
        assert!((t.motion.at(0.0).translation_m + DVec3::X * 10.0).length() < 1e-12);
        assert!((t.motion.at(6.0).translation_m - DVec3::new(10.0, 20.0, 0.0)).length() < 1e-12);
        // The file's own time and origin.
        let map = through(&points, "start_s = 1.5\norigin_m = [5, 0, 0]\ninterpolation = \"linear\"");
        let t = read(&map).unwrap();
        assert!(t.motion.at(0.0).translation_m.length() < 1e-12);
        assert_eq!(t.span_s, (-0.5, 2.5));
    }

    /// Yaw, pitch and roll that the waypoints give, over the step from 180 to -180 degrees.
    #[test]
    fn given_headings_go_the_short_way_round() {
        let text = "waypoint = [{ time_s = 0, position_m = [0, 0, 0], yaw_deg = 170 }, \
                    { time_s = 1, position_m = [0, 0, 0], yaw_deg = -170, pitch_deg = 4 }, \
                    { time_s = 2, position_m = [0, 0, 0], yaw_deg = -150, roll_deg = 2 }]";
        let t = read(text).unwrap();
        let want = |yaw: f64, pitch: f64, roll: f64| {
            Pose::<Target, World>::from_yaw_pitch_roll(
                DVec3::ZERO,
                yaw.to_radians(),
                pitch.to_radians(),
                roll.to_radians(),
            )
            .rotation
        };
        for (time, q) in
            [(0.0, want(170.0, 0.0, 0.0)), (1.0, want(190.0, 4.0, 0.0)), (2.0, want(210.0, 0.0, 2.0))]
        {
            assert!(t.motion.at(time).rotation.dot(q).abs() > 1.0 - 1e-14, "{time}");
        }
        // From 170 to 190 and 210 at an even rate.
        let spin = t.motion.at(0.5).spin_rad_per_s;
        assert!((spin.z - 20f64.to_radians()).abs() < 0.01, "{spin}");
        check_rates(&t, [0.11, 0.5, 1.3, 1.9].into_iter());
        assert_eq!(t.mean_speed_mps, 0.0);
    }

    #[test]
    fn is_checked() {
        let two = "{ time_s = 0, position_m = [0, 0, 0] }, { time_s = 1, position_m = [1, 0, 0] }";
        for (text, says) in [
            ("outside = \"stay\"", "s.toml: ego.trajectory: has no waypoints"),
            ("waypoint = [{ time_s = 0, position_m = [0, 0, 0] }]", "has one waypoint; allowed: two or more"),
            (&format!("waypoint = [{two}, {{ time_s = 1, position_m = [1, 0, 0] }}]"), "do not ascend"),
            (
                &format!("waypoint = [{two}, {{ time_s = 2, position_m = [1, 0, 0], yaw_deg = 1 }}]"),
                "a yaw_deg, and",
            ),
            (&format!("waypoint = [{two}, {{ time_s = 2, position_m = [1e7, 0, 0] }}]"), "set origin_m"),
            (&format!("waypoint = [{two}, {{ time_s = 1.000001, position_m = [5, 0, 0] }}]"), "too fast"),
            (
                &format!("waypoint = [{two}, {{ time_s = 2, position_m = [inf, 0, 0] }}]"),
                "position_m = [inf, 0, 0]: is not three finite numbers",
            ),
            (
                &format!("waypoint = [{two}, {{ time_s = nan, position_m = [1, 0, 0] }}]"),
                "not a finite number",
            ),
            (&format!("waypoint = [{two}]\ninterpolation = \"cubic\""), "spline"),
            (&format!("waypoint = [{two}]\nfile = \"a.csv\""), "file and waypoint exclude each other"),
            ("file = \"a.csv\"", "no such file"),
        ] {
            let e = read(text).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            assert!(e.to_string().contains(says), "{text}: {e}");
        }
    }

    #[test]
    fn files_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let toml = dir.path().join("s.toml");
        let read = |csv: &str| {
            std::fs::write(dir.path().join("d.csv"), csv).unwrap();
            let doc = Document::parse(&toml, "file = \"d.csv\"").unwrap();
            build(&doc, "ego.trajectory", &doc.read().unwrap())
        };
        let t = read("# a log\ntime_s,x_m,y_m,yaw_deg,speed\n0,0,0,90,3\n1,2,0,90,3\n2,4,0,90,3\n").unwrap();
        let m = t.motion.at(0.5);
        assert!((m.translation_m - DVec3::X).length() < 1e-12);
        assert!((m.rotation * DVec3::X - DVec3::Y).length() < 1e-12);
        assert!((m.rotation.to_scaled_axis().z - 0.5 * PI).abs() < 1e-12);
        for (csv, says) in [
            (
                "time_s,x_m,y_m\n0,0,0\n0,1,0\n",
                "d.csv:3: 0 s after 0 s: the times of the waypoints do not ascend",
            ),
            ("time_s,x_m\n0,0\n1,1\n", "y_m"),
            ("time_s,x_m,y_m\n0,0,0\n1,,0\n", "d.csv:3: x_m = NaN: is empty or not finite"),
            ("time_s,x_m,y_m\n0,0,0\n1,east,0\n", "d.csv:3: x_m = east: not a number"),
            ("time_s,x_m,y_m\n", "has no waypoints"),
        ] {
            let e = read(csv).unwrap_err();
            assert_eq!(e.exit_code(), 2);
            assert!(e.to_string().contains(says), "{csv:?}: {e}");
        }
    }
}
