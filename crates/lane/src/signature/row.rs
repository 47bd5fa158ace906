//! Extracts the marker row beside a vehicle from its scans. Stationary points are collected along the
//! vehicle's own path (dead reckoning over some ten metres); the row is the strip with most of them, and its
//! points are converted to positions along and beside it.

use super::codewords::{Alphabet, Code, ReadSettings, Reader, Reading, RowPoint, Zone};
use super::map::{MapSettings, Pose, ScanPoint, SignatureMap};
use crate::Measured;
use crate::error::{self, LaneError};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// Settings of a marker row and of how it is read.
#[derive(Debug, Clone, PartialEq)]
pub struct RowOptions {
    /// Name of the row, which readings state.
    pub name: String,
    /// Least and largest lateral position of the row's line beside the vehicle, m, positive to the left.
    pub beside_m: [f64; 2],
    /// The code of the row's words.
    pub code: Code,
    /// How bits are written in the row.
    pub alphabet: Alphabet,
    /// How words are read.
    pub read: ReadSettings,
    /// Minimum and maximum range of points, m.
    pub range_m: [f64; 2],
    /// Half the width of the strip beyond what the alphabet takes, m.
    pub half_m: f64,
    /// Least number of scans in which a point was seen.
    pub least_hits: u32,
    /// Length of path that is remembered, m.
    pub memory_m: f64,
    /// Standard deviation of each point of the row beyond its own uncertainty, m: dead reckoning, and markers
    /// slightly out of place.
    pub floor_std_m: f64,
    /// Standard deviation of the angle of points ahead, rad: a pair of markers in one cell biases its angle
    /// over many scans, which does not average out.
    pub angle_floor_rad: f64,
}

impl RowOptions {
    /// Makes default settings for a row of this name, lateral position, code and alphabet.
    pub fn new(name: &str, beside_m: [f64; 2], code: Code, alphabet: Alphabet) -> RowOptions {
        RowOptions {
            name: name.into(),
            beside_m,
            code,
            alphabet,
            read: ReadSettings::default(),
            range_m: [3.0, 30.0],
            half_m: 0.2,
            least_hits: 3,
            memory_m: 40.0,
            floor_std_m: 0.03,
            angle_floor_rad: 0.004,
        }
    }

    fn side_m(&self) -> f64 {
        match self.alphabet {
            Alphabet::Sides { side_m, .. } => side_m,
            Alphabet::Gaps { .. } => 0.0,
        }
    }
}

/// A row that was picked: its points and their origin.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picked {
    /// The points of the row.
    pub points: Vec<RowPoint>,
    /// Indices of the points in the input.
    pub members: Vec<usize>,
}

/// Largest slope (rad) and curvature (1/m) of a row relative to the vehicle's path.
const MOST_SLOPE: f64 = 0.06;
const MOST_BEND_PER_M: f64 = 0.01;
/// Least number of points of a row.
const LEAST: usize = 5;

/// Picks a row from positions (along, beside) the vehicle's path, m, with their standard deviations; the
/// vehicle is at (0, 0). Of the lines that pass beside the vehicle within `options.beside_m` it takes the one
/// with most positions near it. `bend_per_m` is the curvature of the path, which stretches or shortens
/// lengths beside it. None for fewer than five points.
pub fn pick(places: &[(DVec2, [f64; 2])], options: &RowOptions, bend_per_m: f64) -> Option<Picked> {
    let side = options.side_m();
    let half = options.half_m + side;
    let [low, high] = options.beside_m;
    let usable: Vec<usize> = (0..places.len())
        .filter(|i| {
            let (p, std) = &places[*i];
            p.is_finite() && std.iter().all(|s| s.is_finite() && *s > 0.0) && std[1] < half
        })
        .filter(|i| places[*i].0.y > low - 4.0 && places[*i].0.y < high + 4.0)
        .collect();
    let inside = |a: f64, b: f64, c: f64, half: f64| -> Vec<usize> {
        let on = |i: &usize| {
            let p = places[*i].0;
            (p.y - a - p.x * (b + 0.5 * c * p.x)).abs() <= half
        };
        usable.iter().copied().filter(on).collect()
    };
    let mut best: (usize, f64, f64, f64) = (0, 0.0, 0.0, 0.0);
    for (k, i) in usable.iter().enumerate() {
        for j in &usable[k + 1..] {
            let (p, q) = (places[*i].0, places[*j].0);
            let along = q.x - p.x;
            if along.abs() < 4.0 || (q.y - p.y).abs() > MOST_SLOPE * along.abs() + 2.0 * side {
                continue;
            }
            let b = ((q.y - p.y) / along).clamp(-MOST_SLOPE, MOST_SLOPE);
            let a = 0.5 * (p.y + q.y) - 0.5 * b * (p.x + q.x);
            if a < low || a > high {
                continue;
            }
            let n = inside(a, b, 0.0, half).len();
            // The first of equals stays, so that the order of the positions decides, not chance.
            if n > best.0 {
                best = (n, a, b, 0.0);
            }
        }
    }
    if best.0 < LEAST {
        return None;
    }
    let (_, mut a, mut b, mut c) = best;
    let mut members = inside(a, b, c, half);
    for _ in 0..6 {
        let fitted = parabola(&members.iter().map(|i| places[*i]).collect::<Vec<_>>())?;
        [a, b, c] = fitted;
        b = b.clamp(-2.0 * MOST_SLOPE, 2.0 * MOST_SLOPE);
        c = c.clamp(-MOST_BEND_PER_M, MOST_BEND_PER_M);
        if side > 0.0 {
            a += middle(&members, places, [a, b, c]);
        }
        let next = inside(a, b, c, half);
        if next == members {
            break;
        }
        members = next;
        if members.len() < LEAST {
            return None;
        }
    }
    members.sort_by(|i, j| places[*i].0.x.total_cmp(&places[*j].0.x));
    let mut s = 0.0;
    let mut last: Option<f64> = None;
    let points = members
        .iter()
        .map(|i| {
            let (p, std) = places[*i];
            let slope = b + c * p.x;
            if let Some(x) = last {
                let (mid, mean) = (0.5 * (x + p.x), b + 0.5 * c * (x + p.x));
                let beside = a + mid * (b + 0.5 * c * mid);
                s += (p.x - x) * (1.0 - bend_per_m * beside).hypot(mean);
            }
            last = Some(p.x);
            RowPoint {
                s_m: s,
                t_m: (p.y - a - p.x * (b + 0.5 * c * p.x)) / 1f64.hypot(slope),
                s_std_m: std[0].hypot(options.floor_std_m),
                t_std_m: std[1].hypot(options.floor_std_m),
            }
        })
        .collect();
    Some(Picked { points, members })
}

/// Least squares fit of y = a + b x + c x²/2, with priors that keep slope and curvature small.
fn parabola(points: &[(DVec2, [f64; 2])]) -> Option<[f64; 3]> {
    use glam::{DMat3, DVec3};
    let (mut m, mut r) = (DMat3::ZERO, DVec3::ZERO);
    for (p, std) in points {
        let j = DVec3::new(1.0, p.x, 0.5 * p.x * p.x);
        let w = 1.0 / (std[1] * std[1] + 0.05 * 0.05);
        m += DMat3::from_cols(j * j.x, j * j.y, j * j.z) * w;
        r += j * (p.y * w);
    }
    // A row of a lane is nearly parallel to the path: slopes and curvatures are small unless points show
    // otherwise.
    m.y_axis.y += 0.02f64.powi(-2);
    m.z_axis.z += 0.002f64.powi(-2);
    let out = m.inverse() * r;
    out.is_finite().then(|| out.to_array())
}

/// Lateral position of the centre between both sides of a zigzag relative to the line: the one that leaves
/// its points closest to a side.
fn middle(members: &[usize], places: &[(DVec2, [f64; 2])], [a, b, c]: [f64; 3]) -> f64 {
    let off: Vec<f64> = members
        .iter()
        .map(|i| {
            let p = places[*i].0;
            p.y - a - p.x * (b + 0.5 * c * p.x)
        })
        .collect();
    let (mut up, mut down) = (f64::NEG_INFINITY, f64::INFINITY);
    off.iter().for_each(|o| (up, down) = (up.max(*o), down.min(*o)));
    for _ in 0..20 {
        let split = 0.5 * (up + down);
        let mean = |above: bool| {
            let v: Vec<f64> = off.iter().copied().filter(|o| (*o > split) == above).collect();
            (!v.is_empty()).then(|| v.iter().sum::<f64>() / v.len() as f64)
        };
        let (Some(u), Some(d)) = (mean(true), mean(false)) else { break };
        (up, down) = (u, d);
    }
    0.5 * (up + down)
}

/// The word that was read from one row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ZoneReading {
    /// Name of the row, as in [`RowOptions`].
    pub row: String,
    /// The word as it was read.
    pub reading: Reading,
    /// Meaning of the word, where it is certain and has one.
    pub zone: Option<Zone>,
}

/// Collects one row along the path of a vehicle and reads its word.
#[derive(Debug, Clone)]
pub struct RowReader {
    options: RowOptions,
    reader: Reader,
    map: SignatureMap,
    /// Poses of the vehicle by dead reckoning, one for each scan.
    way: Vec<Pose>,
    yaw_rate_rad_per_s: f64,
    speed_mps: f64,
}

impl RowReader {
    /// Makes a reader of one row.
    ///
    /// # Errors
    /// Returns an error for an option, code or setting outside its range.
    pub fn new(options: RowOptions) -> Result<RowReader, LaneError> {
        let [near, far] = options.range_m;
        let rules: [(&'static str, bool); 6] = [
            ("angle_floor_rad", (0.0..=0.2).contains(&options.angle_floor_rad)),
            (
                "beside_m",
                options.beside_m[0] < options.beside_m[1] && options.beside_m.iter().all(|x| x.abs() < 50.0),
            ),
            ("range_m", near >= 0.0 && far > near && far <= 200.0),
            ("half_m", options.half_m > 0.0 && options.half_m <= 2.0),
            ("memory_m", options.memory_m >= 0.0 && options.memory_m <= 1000.0),
            ("floor_std_m", options.floor_std_m > 0.0 && options.floor_std_m <= 1.0),
        ];
        error::settings(&rules)?;
        let reader = Reader::new(options.code, options.alphabet, options.read)?;
        let map = SignatureMap::new(RowReader::settings(&options))?;
        Ok(RowReader { options, reader, map, way: Vec::new(), yaw_rate_rad_per_s: 0.0, speed_mps: 0.0 })
    }

    fn settings(options: &RowOptions) -> MapSettings {
        let [near_m, far_m] = options.range_m;
        MapSettings { near_m, far_m, half_view_rad: 1.5, ..MapSettings::default() }
    }

    /// The options of the row.
    pub fn options(&self) -> &RowOptions {
        &self.options
    }

    /// The reader of the row's words.
    pub fn reader(&self) -> &Reader {
        &self.reader
    }

    /// Adds the stationary points of a scan, taken `dt_s` after the one before, between which the vehicle
    /// moved at a mean speed.
    pub fn add(
        &mut self,
        dt_s: f64,
        speed: Measured,
        yaw_rate: Option<Measured>,
        radar_m: [f64; 2],
        points: &[ScanPoint],
    ) {
        let yaw = yaw_rate.map_or(0.0, |y| y.value);
        if !(dt_s.is_finite() && speed.value.is_finite() && yaw.is_finite()) {
            return;
        }
        let way_m = speed.value * dt_s;
        // A jump in time or position: what was collected is elsewhere.
        if dt_s < 0.0 || way_m.abs() > 0.5 * self.options.memory_m.max(1.0) {
            self.forget();
        }
        let last = self.way.last().copied().unwrap_or(Pose { x_m: 0.0, y_m: 0.0, heading_rad: 0.0 });
        let step = DVec2::from_angle(last.heading_rad + 0.5 * yaw * dt_s.max(0.0))
            * if self.way.is_empty() { 0.0 } else { way_m };
        let turn = if self.way.is_empty() { 0.0 } else { yaw * dt_s };
        let now =
            Pose { x_m: last.x_m + step.x, y_m: last.y_m + step.y, heading_rad: last.heading_rad + turn };
        (self.yaw_rate_rad_per_s, self.speed_mps) = (yaw, speed.value);
        let arm = DVec2::from_angle(now.heading_rad).rotate(DVec2::from_array(radar_m));
        let radar = Pose { x_m: now.x_m + arm.x, y_m: now.y_m + arm.y, ..now };
        if self.map.add_scan(radar, [0.01, 0.01, 0.001], None, points).is_err() {
            self.forget();
            return;
        }
        self.way.push(now);
        // Landmarks far behind are dropped.
        let most = self.options.memory_m + self.options.range_m[1];
        let near = |l: &super::map::Landmark| DVec2::from_array(l.position_m).distance(now.place()) <= most;
        if self.map.landmarks().iter().any(|l| !near(l)) {
            let kept = self.map.landmarks().iter().filter(|l| near(l)).copied().collect();
            if let Ok(map) = SignatureMap::from_parts(*self.map.settings(), kept, Vec::new()) {
                self.map = map;
            }
        }
        let excess = self.way.len().saturating_sub(5000);
        self.way.drain(..excess);
    }

    /// Drops everything that was collected.
    pub fn forget(&mut self) {
        self.way.clear();
        if let Ok(map) = SignatureMap::new(RowReader::settings(&self.options)) {
            self.map = map;
        }
    }

    /// The row as collected so far; None without enough points.
    pub fn picked(&self) -> Option<Picked> {
        let now = *self.way.last()?;
        let mut map = self.map.clone();
        map.prune(self.options.least_hits, 0.0);
        let bend = if self.speed_mps.abs() > 0.5 { self.yaw_rate_rad_per_s / self.speed_mps } else { 0.0 };
        // Yaw rates are noisy: the curvature is that of the path itself where that is long enough.
        let bend = self.bend_per_m().unwrap_or(bend);
        let places: Vec<(DVec2, [f64; 2])> = map
            .landmarks()
            .iter()
            .filter_map(|l| {
                let q =
                    DVec2::from_angle(-now.heading_rad).rotate(DVec2::from_array(l.position_m) - now.place());
                let [xx, xy, yy] = l.covariance_m2;
                // Positions along and beside the path at each landmark.
                let (along, beside) = along_arc(q, bend)?;
                let u = DVec2::from_angle(now.heading_rad + bend * along);
                let spread =
                    |u: DVec2| (u.x * u.x * xx + 2.0 * u.x * u.y * xy + u.y * u.y * yy).max(1e-8).sqrt();
                let across = spread(u.perp()).hypot(self.options.angle_floor_rad * along.max(0.0));
                Some((DVec2::new(along, beside), [spread(u), across]))
            })
            .filter(|(p, _)| p.x >= -self.options.memory_m)
            .collect();
        pick(&places, &self.options, bend)
    }

    /// Curvature of the path over the last twenty metres, 1/m.
    fn bend_per_m(&self) -> Option<f64> {
        let last = self.way.last()?;
        let first = self.way.iter().rev().find(|p| p.place().distance(last.place()) > 20.0)?;
        Some((last.heading_rad - first.heading_rad) / last.place().distance(first.place()))
    }

    /// Reads the word from all that was collected.
    ///
    /// # Errors
    /// Returns an error if there is no row or no word in it.
    pub fn read(&self) -> Result<Reading, LaneError> {
        let picked = self.picked().ok_or(LaneError::too_few("usable points", 0, LEAST))?;
        self.reader.read(&[picked.points])
    }

    /// Reads the word together with its meaning.
    ///
    /// # Errors
    /// Returns an error if there is no row or no word in it.
    pub fn zone(&self) -> Result<ZoneReading, LaneError> {
        let reading = self.read()?;
        let has_zones = self.options.code == Code::Bch15x7 && reading.sure;
        let zone = has_zones.then(|| Zone::from_message(reading.message)).flatten();
        Ok(ZoneReading { row: self.options.name.clone(), reading, zone })
    }
}

/// Position along and to the left of a circle through the origin that starts along x; None beyond half of it.
fn along_arc(p: DVec2, bend_per_m: f64) -> Option<(f64, f64)> {
    if bend_per_m.abs() < 1e-6 {
        return Some((p.x, p.y));
    }
    let radius = 1.0 / bend_per_m;
    let from = p - DVec2::new(0.0, radius);
    let angle = from.x.atan2(-from.y * radius.signum());
    let along = angle * radius.abs();
    let beside = radius - from.length() * radius.signum();
    (angle.abs() < 1.5).then_some((along, beside))
}
