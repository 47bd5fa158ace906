//! The radar's own motion from standing things (CONVENTIONS eq. 124; Kellner, Barjenbruch, Klappstein,
//! Dickmann and Dietmayer, IEEE ITSC 2013, 869).

use crate::base::error::{BadInput, Result};
use crate::base::frames::direction_from_angles;
use crate::base::rng::philox4x32_10;
use glam::{DVec2, DVec3};

/// Pose of a radar on its vehicle: origin at the rear-axle centre, x forward, y left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// Place of the radar, m.
    pub position_m: DVec2,
    /// Direction of boresight in the vehicle's frame, rad, positive to the left.
    pub yaw_rad: f64,
}

/// Range rate of a point in a direction of its radar's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radial {
    /// Azimuth, rad.
    pub azimuth_rad: f64,
    /// Elevation, rad.
    pub elevation_rad: f64,
    /// Range rate, m/s, positive when receding.
    pub range_rate_mps: f64,
    /// Standard deviation of the range rate, m/s.
    pub range_rate_std_mps: f64,
    /// The range rate is known but for whole multiples of this, m/s; infinite where it is known.
    pub ambiguity_mps: f64,
    /// Which of the mounts; 0 for one radar.
    pub radar: usize,
}

/// The parameters of the motion that are estimated.
#[derive(Debug, Clone, PartialEq)]
pub enum EgoModel {
    /// Velocity of one radar in its own axes: (v_x, v_y).
    Sensor,
    /// A car whose rear wheels do not slip: (speed of the rear axle, yaw rate). Takes a radar off the rear
    /// axle, or several.
    Car(Vec<Mount>),
    /// Free motion in the plane: (v_x, v_y of the vehicle's origin, yaw rate). Takes two radars apart.
    Plane(Vec<Mount>),
}

/// Settings of the search for the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EgoSettings {
    /// A point stands when its range rate fits within so many standard deviations.
    pub gate: f64,
    /// Least tolerance of a range rate, m/s: what standing things scatter beyond their noise.
    pub tolerance_mps: f64,
    /// Share of the points that has to stand, at least.
    pub min_inliers: f64,
    /// Number of samples that are drawn.
    pub draws: u32,
    /// Largest speed of the vehicle, m/s: motions beyond it are not tried.
    pub max_speed_mps: f64,
    /// The speed as another sensor of the vehicle knows it, which decides between motions that explain the range rates alike.
    pub speed: Option<KnownSpeed>,
    /// Seed of the random samples.
    pub seed: u64,
    /// Number of the frame, which selects the random samples.
    pub frame: u32,
}

/// A vehicle's speed from another sensor, as its bus reports it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownSpeed {
    /// Speed along `direction_rad`, m/s; negative in reverse.
    pub speed_mps: f64,
    /// Direction of the vehicle's x axis in the axes of the model, rad: 0 in the vehicle's own, minus its mounting's yaw in a sensor's.
    pub direction_rad: f64,
    /// Largest error of it, m/s.
    pub tolerance_mps: f64,
    /// Largest velocity across that direction, m/s, to either side; infinite for any.
    pub lateral_mps: f64,
    /// Largest yaw rate, rad/s, to either side; infinite for any.
    pub yaw_rate_rad_per_s: f64,
}

impl KnownSpeed {
    /// What a car can do whose bus reports this speed, where a radar stands at `arm_m` from its rear axle: its tyres hold 10 m/s² across,
    /// its smallest turn takes 1.7 rad/s, and its rear wheels slip by up to 0.1 rad and 1 m/s (a drift, or a bank). These are generous
    /// assumptions. `tolerance_mps` is the bus's own.
    pub fn of_car(speed_mps: f64, direction_rad: f64, tolerance_mps: f64, arm_m: DVec2) -> KnownSpeed {
        let speed = speed_mps.abs();
        let yaw_rate_rad_per_s = MAX_YAW_RATE_RAD_PER_S.min(MAX_LATERAL_MPS2 / speed.max(1e-3));
        KnownSpeed {
            speed_mps,
            direction_rad,
            tolerance_mps: tolerance_mps + yaw_rate_rad_per_s * arm_m.y.abs(),
            lateral_mps: SLIDE_MPS + SLIP_RAD * speed + yaw_rate_rad_per_s * arm_m.x.abs(),
            yaw_rate_rad_per_s,
        }
    }
}

/// What a car can do: acceleration across, m/s², yaw rate, and how its rear wheels slip, as an angle and beside it.
const MAX_LATERAL_MPS2: f64 = 10.0;
const MAX_YAW_RATE_RAD_PER_S: f64 = 1.7;
const SLIP_RAD: f64 = 0.1;
const SLIDE_MPS: f64 = 1.0;

/// Largest speed of a vehicle, m/s.
pub const MAX_SPEED_MPS: f64 = 70.0;

impl Default for EgoSettings {
    /// With a third of the points standing, 200 draws of two miss them all once in 10¹⁰ scans, of three
    /// once in 1,900.
    fn default() -> Self {
        EgoSettings {
            gate: 3.0,
            tolerance_mps: 0.05,
            min_inliers: 0.3,
            draws: 200,
            max_speed_mps: MAX_SPEED_MPS,
            speed: None,
            seed: 0,
            frame: 0,
        }
    }
}

/// The motion, in the order of the model's parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct EgoMotion {
    /// Values of the motion: speeds in m/s, yaw rate in rad/s; as many as the model has, then 0.
    pub value: [f64; 3],
    /// Covariance of `value`, row by row.
    pub covariance: [[f64; 3]; 3],
    /// Which points stand.
    pub standing: Vec<bool>,
    /// Root mean square of the standing points' differences, over their standard deviations.
    pub spread: f64,
}

/// Samples times folds that are tried at most.
const MAX_TRIES: f64 = 2e6;

/// Philox stream of the draws.
const EGO_STREAM: u32 = 0x0065_676f;

type Row = [f64; 3];

fn dot(a: &Row, b: &Row) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl EgoModel {
    fn parameters(&self) -> usize {
        match self {
            EgoModel::Sensor | EgoModel::Car(_) => 2,
            EgoModel::Plane(_) => 3,
        }
    }

    /// The range rate that is left of a point when the radar's own motion is taken out: 0 for one that
    /// stands, up to whole ambiguities. Panics when the point's radar has no mount.
    pub fn over_ground_mps(&self, point: &Radial, motion: &EgoMotion) -> f64 {
        point.range_rate_mps - dot(&self.row(point), &motion.value)
    }

    /// h of v_r = h·(parameters): a standing point's range rate (eq. 124).
    fn row(&self, p: &Radial) -> Row {
        let u = direction_from_angles(p.azimuth_rad, p.elevation_rad);
        let mounts = match self {
            EgoModel::Sensor => return [-u.x, -u.y, 0.0],
            EgoModel::Car(m) | EgoModel::Plane(m) => m,
        };
        let m = &mounts[p.radar];
        let d = DVec2::from_angle(m.yaw_rad).rotate(u.truncate());
        let turn = d.y * m.position_m.x - d.x * m.position_m.y;
        match self {
            EgoModel::Plane(_) => [-d.x, -d.y, -turn],
            _ => [-d.x, -turn, 0.0],
        }
    }
}

/// Solves the normal equations of `n` parameters; the inverse as well. None when directions are so
/// alike that some combination of parameters does not show.
fn solve(a: &[Row; 3], b: &Row, n: usize) -> Option<(Row, [Row; 3])> {
    // Cholesky of the matrix scaled to a diagonal of ones: its pivots are 1 − R² of each column.
    let scale: Vec<f64> = (0..n).map(|i| a[i][i].sqrt()).collect();
    if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let mut l = [[0.0; 3]; 3];
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = a[i][j] / (scale[i] * scale[j]) - sum;
            if i == j {
                if rest < 1e-6 {
                    return None;
                }
                l[i][i] = rest.sqrt();
            } else {
                l[i][j] = rest / l[j][j];
            }
        }
    }
    let back = |b: &Row| {
        let mut x = [0.0; 3];
        for i in 0..n {
            let sum: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
            x[i] = (b[i] / scale[i] - sum) / l[i][i];
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|k| l[k][i] * x[k]).sum();
            x[i] = (x[i] - sum) / l[i][i];
        }
        (0..n).for_each(|i| x[i] /= scale[i]);
        x
    };
    let mut inverse = [[0.0; 3]; 3];
    for i in 0..n {
        let mut unit = [0.0; 3];
        unit[i] = 1.0;
        let column = back(&unit);
        (0..n).for_each(|k| inverse[k][i] = column[k]);
    }
    Some((back(b), inverse))
}

/// Points as the fit sees them.
struct Problem<'a> {
    rows: Vec<Row>,
    rates: Vec<f64>,
    std: Vec<f64>,
    ambiguities: Vec<f64>,
    settings: &'a EgoSettings,
    /// Whether the parameters are a speed and a yaw rate.
    is_car: bool,
    n: usize,
}

fn reach(ambiguity_mps: f64, max_speed_mps: f64) -> i32 {
    if ambiguity_mps.is_finite() { (max_speed_mps / ambiguity_mps + 0.5).ceil() as i32 } else { 0 }
}

impl Problem<'_> {
    /// Range rate less that of the motion, next to zero where rates are ambiguous.
    fn difference(&self, i: usize, motion: &Row) -> f64 {
        let d = self.rates[i] - dot(&self.rows[i], motion);
        let width = self.ambiguities[i];
        if width.is_finite() { d - width * (d / width).round() } else { d }
    }

    /// Whether a vehicle may move so.
    fn is_possible(&self, motion: &Row) -> bool {
        let speed = if self.is_car { motion[0].abs() } else { motion[0].hypot(motion[1]) };
        speed <= self.settings.max_speed_mps
            && self.settings.speed.is_none_or(|k| {
                let ahead = DVec2::from_angle(k.direction_rad);
                let velocity = DVec2::new(motion[0], motion[1]);
                let [along, across, yaw_rate] = match self.is_car {
                    true => [motion[0], 0.0, motion[1]],
                    false => [ahead.dot(velocity), ahead.perp_dot(velocity), motion[2]],
                };
                (along - k.speed_mps).abs() <= k.tolerance_mps
                    && across.abs() <= k.lateral_mps
                    && yaw_rate.abs() <= k.yaw_rate_rad_per_s
            })
    }

    /// Ambiguity intervals to each side that a range rate of a standing point may need.
    fn reach(&self, i: usize) -> i32 {
        reach(self.ambiguities[i], self.settings.max_speed_mps)
    }

    fn stands(&self, i: usize, motion: &Row) -> bool {
        self.difference(i, motion).abs() <= self.settings.gate * self.std[i]
    }

    /// How many stand, and the sum of their squared differences over the gate's.
    fn score(&self, motion: &Row) -> (usize, f64) {
        let mut found = (0, 0.0);
        for i in 0..self.rows.len() {
            if self.stands(i, motion) {
                found.0 += 1;
                found.1 += (self.difference(i, motion) / self.std[i]).powi(2);
            }
        }
        found
    }

    /// The motion through a few points whose rates are moved by `folds` ambiguities.
    fn through(&self, sample: &[usize], folds: &[i32]) -> Option<Row> {
        let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
        for (i, q) in sample.iter().zip(folds) {
            let off = if *q == 0 { 0.0 } else { f64::from(*q) * self.ambiguities[*i] };
            self.add(&mut a, &mut b, *i, self.rates[*i] + off, 1.0);
        }
        solve(&a, &b, self.n).map(|s| s.0)
    }

    fn add(&self, a: &mut [Row; 3], b: &mut Row, i: usize, rate: f64, weight: f64) {
        let h = &self.rows[i];
        for j in 0..self.n {
            (0..self.n).for_each(|k| a[j][k] += weight * h[j] * h[k]);
            b[j] += weight * h[j] * rate;
        }
    }

    /// Least squares over the points that stand, weight 1/std²; their rates unfolded next to `motion`.
    fn fit(&self, motion: &Row, standing: &[bool]) -> Option<(Row, [Row; 3])> {
        let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
        for i in (0..self.rows.len()).filter(|i| standing[*i]) {
            let rate = dot(&self.rows[i], motion) + self.difference(i, motion);
            self.add(&mut a, &mut b, i, rate, self.std[i].powi(-2));
        }
        solve(&a, &b, self.n)
    }
}

/// The motion that most points agree with: as many random samples as `draws`, of as many points as the
/// model has parameters, each gives a motion; the one with most standing points (of equals, the least
/// sum of squares) is refined by weighted least squares over those, until they stay the same.
/// Points with values that are not finite are left out: they do not stand. Draws come from Philox,
/// keyed on (seed, frame), so that the result repeats.
///
/// The covariance is that of the least squares, times the squared spread where points scatter more
/// than they say.
///
/// # Errors
/// Returns an error (exit code 1, as the scene does not allow an estimate) for fewer points than parameters plus one;
/// directions that do not tell the parameters apart (all points in one line of sight); fewer standing points than the
/// settings ask for; folded range rates that two motions explain nearly as well. Settings and mounts outside their
/// ranges are bad input.
///
/// # Example
/// The range rates of static points are −v cos α. Seven of them, and a car that drives ahead, give the radar's own
/// speed of 15 m/s and show which point moves.
///
/// ```
/// use catseye::detect::ego_motion::{EgoModel, EgoSettings, Radial, ego_motion};
///
/// let radial = |azimuth_rad: f64, range_rate_mps: f64| Radial {
///     azimuth_rad,
///     elevation_rad: 0.0,
///     range_rate_mps,
///     range_rate_std_mps: 0.05,
///     ambiguity_mps: f64::INFINITY,
///     radar: 0,
/// };
/// let azimuths_rad = [-0.9, -0.6, -0.3, 0.1, 0.4, 0.7, 1.0];
/// let mut points: Vec<Radial> = azimuths_rad.map(|a: f64| radial(a, -15.0 * a.cos())).into();
/// points.push(radial(0.05, 2.0));
/// let motion = ego_motion(&points, &EgoModel::Sensor, &EgoSettings::default())?;
/// assert!((motion.value[0] - 15.0).abs() < 1e-6 && motion.value[1].abs() < 1e-6);
/// assert_eq!(motion.standing.iter().position(|is_static| !is_static), Some(7));
/// # Ok::<(), catseye::Error>(())
/// ```
pub fn ego_motion(points: &[Radial], model: &EgoModel, settings: &EgoSettings) -> Result<EgoMotion> {
    check(points, model, settings)?;
    let n = model.parameters();
    let usable: Vec<usize> = (0..points.len())
        .filter(|i| {
            let p = &points[*i];
            [p.azimuth_rad, p.elevation_rad, p.range_rate_mps].iter().all(|x| x.is_finite())
                && p.range_rate_std_mps.is_finite()
                && p.range_rate_std_mps >= 0.0
                && p.ambiguity_mps > 0.0
        })
        .collect();
    let failed = |what: String| crate::base::error::Error::Failed(format!("ego motion: {what}"));
    if usable.len() < n + 1 {
        let have = usable.len();
        return Err(failed(format!("{have} points for {n} unknowns; {} or more are needed", n + 1)));
    }
    let problem = Problem {
        rows: usable.iter().map(|i| model.row(&points[*i])).collect(),
        rates: usable.iter().map(|i| points[*i].range_rate_mps).collect(),
        std: usable.iter().map(|i| points[*i].range_rate_std_mps.hypot(settings.tolerance_mps)).collect(),
        ambiguities: usable.iter().map(|i| points[*i].ambiguity_mps).collect(),
        settings,
        is_car: matches!(model, EgoModel::Car(_)),
        n,
    };
    let (motion, rival) = search(&problem).ok_or_else(|| {
        failed(match settings.speed {
            Some(k) => format!(
                "no possible motion of a vehicle within {:.1} m/s of {:.1} m/s explains the points",
                k.tolerance_mps, k.speed_mps
            ),
            None => "the points are in one line of sight, which does not determine the unknowns".into(),
        })
    })?;
    let (mut motion, mut standing) = (motion, Vec::new());
    let mut inverse = [[0.0; 3]; 3];
    // Ten rounds are ample: the set settles in two or three.
    for _ in 0..10 {
        let now: Vec<bool> = (0..problem.rows.len()).map(|i| problem.stands(i, &motion)).collect();
        if now == standing {
            break;
        }
        standing = now;
        (motion, inverse) = problem.fit(&motion, &standing).ok_or_else(|| {
            failed("the static points are in one line of sight, which does not determine the unknowns".into())
        })?;
    }
    let count = standing.iter().filter(|s| **s).count();
    let least = (settings.min_inliers * usable.len() as f64).ceil() as usize;
    if count < least.max(n + 1) {
        let (all, least) = (usable.len(), least.max(n + 1));
        return Err(failed(format!(
            "{count} of {all} points agree; {least} or more static points are needed"
        )));
    }
    if let Some((other, agree)) = rival.filter(|(m, _)| differ(m, &motion, &problem))
        && (agree + 2 > count || agree as f64 >= 0.9 * count as f64)
    {
        return Err(failed(format!(
            "the range rates are ambiguous: {:.2} m/s explains {agree} points, and {:.2} m/s explains {count}; points with a larger spread in azimuth would resolve this",
            DVec3::from(other).length(),
            DVec3::from(motion).length()
        )));
    }
    let squares: f64 = (0..standing.len())
        .filter(|i| standing[*i])
        .map(|i| (problem.difference(i, &motion) / problem.std[i]).powi(2))
        .sum();
    let spread2 = squares / (count - n).max(1) as f64;
    let mut all = vec![false; points.len()];
    usable.iter().zip(&standing).for_each(|(i, s)| all[*i] = *s);
    Ok(EgoMotion {
        value: motion,
        covariance: inverse.map(|row| row.map(|x| x * spread2.max(1.0))),
        standing: all,
        spread: (squares / count as f64).sqrt(),
    })
}

/// Motions that are different answers, not the same one drawn twice: they put the range rate of some point into different ambiguity
/// intervals.
fn differ(a: &Row, b: &Row, problem: &Problem) -> bool {
    let off = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    problem.rows.iter().zip(&problem.ambiguities).any(|(row, width)| dot(row, &off).abs() > 0.5 * width)
}

/// The best motion of all samples, and the best of those that differ from it, with its count. None when
/// no sample tells the unknowns apart.
fn search(problem: &Problem) -> Option<(Row, Option<(Row, usize)>)> {
    let s = problem.settings;
    let points = problem.rows.len() as u32;
    let mut answers: Vec<((usize, f64), Row)> = Vec::new();
    let mut most = 0;
    for draw in 0..s.draws {
        let w = philox4x32_10([draw, 0, (s.seed >> 32) as u32, EGO_STREAM], [s.seed as u32, s.frame]);
        let mut sample: Vec<usize> = Vec::with_capacity(problem.n);
        for (k, w) in w.iter().take(problem.n).enumerate() {
            // Without putting back: the j-th of those that are left.
            let mut at = ((u64::from(*w) * u64::from(points - k as u32)) >> 32) as usize;
            let mut taken = sample.clone();
            taken.sort_unstable();
            taken.iter().for_each(|t| at += usize::from(at >= *t));
            sample.push(at);
        }
        let reaches: Vec<i32> = sample.iter().map(|i| problem.reach(*i)).collect();
        let codes: u64 = reaches.iter().map(|r| (2 * r + 1) as u64).product();
        for code in 0..codes {
            let mut left = code;
            let next = |r: &i32| {
                let width = (2 * r + 1) as u64;
                let q = (left % width) as i32 - r;
                left /= width;
                q
            };
            let q: Vec<i32> = reaches.iter().map(next).collect();
            let Some(motion) = problem.through(&sample, &q).filter(|m| problem.is_possible(m)) else {
                continue;
            };
            let score = problem.score(&motion);
            most = most.max(score.0);
            // Neither the best nor its rival has less than this.
            if 5 * score.0 >= 4 * most {
                answers.push((score, motion));
            }
        }
    }
    answers.sort_by(|a, b| (b.0.0.cmp(&a.0.0)).then(a.0.1.total_cmp(&b.0.1)));
    let best = answers.first()?.1;
    let rival = answers.iter().find(|(_, m)| differ(m, &best, problem)).map(|((count, _), m)| (*m, *count));
    Some((best, rival))
}

fn check(points: &[Radial], model: &EgoModel, s: &EgoSettings) -> Result<()> {
    let bad = |key: &str, value: &dyn std::fmt::Display, allowed: &str| {
        Err(BadInput::new("cannot estimate ego motion").key(key).value(value).allowed(allowed).into())
    };
    if let EgoModel::Car(m) | EgoModel::Plane(m) = model {
        if m.iter().any(|m| !(m.position_m.is_finite() && m.yaw_rad.is_finite())) {
            return bad("mounts", &"NaN", "finite numbers");
        }
        if let Some(p) = points.iter().find(|p| p.radar >= m.len()) {
            return bad("radar", &p.radar, &format!("below {}, the number of mounts", m.len()));
        }
    }
    for (key, value) in [("gate", s.gate), ("tolerance_mps", s.tolerance_mps)] {
        if !(value.is_finite() && value > 0.0) {
            return bad(key, &value, "a positive number");
        }
    }
    if !(0.0..=1.0).contains(&s.min_inliers) {
        return bad("min_inliers", &s.min_inliers, "0 to 1");
    }
    if !(1..=100_000).contains(&s.draws) {
        return bad("draws", &s.draws, "1..=100000");
    }
    if !(s.max_speed_mps.is_finite() && s.max_speed_mps > 0.0) {
        return bad("max_speed_mps", &s.max_speed_mps, "a positive number");
    }
    if let Some(k) = s.speed {
        for (key, value) in [("speed.speed_mps", k.speed_mps), ("speed.direction_rad", k.direction_rad)] {
            if !value.is_finite() {
                return bad(key, &value, "a number");
            }
        }
        for (key, value) in
            [("speed.lateral_mps", k.lateral_mps), ("speed.yaw_rate_rad_per_s", k.yaw_rate_rad_per_s)]
        {
            if value.is_nan() || value < 0.0 {
                return bad(key, &value, "0 or more");
            }
        }
        if !(k.tolerance_mps.is_finite() && k.tolerance_mps >= 0.0) {
            return bad("speed.tolerance_mps", &k.tolerance_mps, "0 or more");
        }
    }
    let positive = points.iter().map(|p| p.ambiguity_mps).filter(|a| *a > 0.0);
    let narrowest = positive.fold(f64::INFINITY, f64::min);
    let intervals = f64::from(2 * reach(narrowest, s.max_speed_mps) + 1);
    let tries = f64::from(s.draws) * intervals.powi(model.parameters() as i32);
    if s.max_speed_mps > 100.0 * narrowest || tries > MAX_TRIES {
        let allowed =
            format!("draws · intervals^unknowns up to {MAX_TRIES:.0e}; use fewer draws or a lower speed");
        return bad("max_speed_mps", &s.max_speed_mps, &allowed);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Draws;

    const STD: f64 = 0.1;

    /// Points of radars on a vehicle that moves with (v_x, v_y) and turns; a share of them moves on its own.
    fn scene(
        d: &mut Draws,
        mounts: &[Mount],
        (velocity, yaw_rate): (DVec2, f64),
        count: usize,
        moving: f64,
    ) -> (Vec<Radial>, Vec<bool>) {
        let mut truth = Vec::new();
        let points = (0..count)
            .map(|i| {
                let radar = i % mounts.len();
                let m = &mounts[radar];
                let azimuth_rad = 2.0 * (d.uniform() - 0.5);
                let elevation_rad = 0.2 * (d.uniform() - 0.5);
                let own = velocity + yaw_rate * m.position_m.perp();
                let at = DVec2::from_angle(-m.yaw_rad).rotate(own);
                let u = direction_from_angles(azimuth_rad, elevation_rad);
                let stands = d.uniform() >= moving;
                let other = if stands { 0.0 } else { 3.0 + 12.0 * d.uniform() };
                truth.push(stands);
                let range_rate_mps = -u.truncate().dot(at) + other + STD * d.normal();
                Radial {
                    azimuth_rad,
                    elevation_rad,
                    range_rate_mps,
                    range_rate_std_mps: STD,
                    ambiguity_mps: f64::INFINITY,
                    radar,
                }
            })
            .collect();
        (points, truth)
    }

    const FRONT: Mount = Mount { position_m: DVec2::new(3.5, 0.0), yaw_rad: 0.0 };
    const LEFT: Mount = Mount { position_m: DVec2::new(3.3, 0.8), yaw_rad: 0.7 };
    const RIGHT: Mount = Mount { position_m: DVec2::new(3.3, -0.8), yaw_rad: -0.7 };
    const QUIET: EgoSettings = EgoSettings {
        gate: 3.0,
        tolerance_mps: 0.01,
        min_inliers: 0.3,
        draws: 200,
        max_speed_mps: 40.0,
        speed: None,
        seed: 5,
        frame: 0,
    };

    /// Runs of a model against the truth: errors over the covariance are chi-square, and points are told
    /// apart.
    fn consistent(model: &EgoModel, mounts: &[Mount], motion: (DVec2, f64), truth: [f64; 3], moving: f64) {
        let n = model.parameters();
        let runs = 200;
        let (mut sum, mut wrong, mut all) = (0.0, 0, 0);
        for run in 0..runs {
            let mut d = Draws::new(run, 71);
            let (points, stands) = scene(&mut d, mounts, motion, 80, moving);
            let e = ego_motion(&points, model, &EgoSettings { frame: run, ..QUIET }).unwrap();
            let error = [0, 1, 2].map(|i| e.value[i] - truth[i]);
            let inverse = solve(&e.covariance, &error, n).unwrap().0;
            sum += dot(&error, &inverse);
            all += stands.len();
            wrong += e.standing.iter().zip(&stands).filter(|(a, b)| a != b).count();
        }
        let (mean, share) = (sum / f64::from(runs), f64::from(wrong as u32) / all as f64);
        println!("{n} parameters: mean squared error over covariance {mean:.2}, {share:.4} wrong");
        // 99.9 % of chi-square with 200 n degrees is within a third; points beyond 3σ are left out.
        assert!((mean / n as f64 - 1.0).abs() < 0.33, "{mean} of {n}");
        assert!(share < 0.01, "{share}");
    }

    #[test]
    fn one_radar_finds_its_velocity() {
        let (v, w) = (DVec2::new(12.0, -0.4), 0.0);
        let mount = Mount { position_m: DVec2::ZERO, yaw_rad: 0.0 };
        consistent(&EgoModel::Sensor, &[mount], (v, w), [12.0, -0.4, 0.0], 0.4);
        consistent(&EgoModel::Sensor, &[mount], (DVec2::ZERO, 0.0), [0.0; 3], 0.4);
    }

    #[test]
    fn a_car_finds_speed_and_yaw_rate() {
        let motion = (DVec2::new(15.0, 0.0), 0.3);
        consistent(&EgoModel::Car(vec![FRONT]), &[FRONT], motion, [15.0, 0.3, 0.0], 0.4);
        let both = [LEFT, RIGHT];
        consistent(&EgoModel::Car(both.to_vec()), &both, motion, [15.0, 0.3, 0.0], 0.4);
    }

    #[test]
    fn two_radars_find_all_motion_in_the_plane() {
        let motion = (DVec2::new(8.0, 0.7), -0.5);
        let both = [LEFT, RIGHT];
        consistent(&EgoModel::Plane(both.to_vec()), &both, motion, [8.0, 0.7, -0.5], 0.4);
    }

    #[test]
    fn folded_rates_are_unfolded() {
        let mount = Mount { position_m: DVec2::ZERO, yaw_rad: 0.0 };
        let ambiguity_mps = 11.8;
        for run in 0..20 {
            let mut d = Draws::new(run, 72);
            let v = DVec2::new(10.0 + 25.0 * d.uniform(), d.uniform());
            let (mut points, _) = scene(&mut d, &[mount], (v, 0.0), 80, 0.3);
            for p in &mut points {
                p.range_rate_mps -= ambiguity_mps * (p.range_rate_mps / ambiguity_mps).round();
                p.ambiguity_mps = ambiguity_mps;
            }
            let s = EgoSettings { draws: 60, ..QUIET };
            let e = ego_motion(&points, &EgoModel::Sensor, &s).unwrap();
            assert!((e.value[0] - v.x).abs() < 0.15 && (e.value[1] - v.y).abs() < 0.3, "{:?} {v}", e.value);
            // Straight ahead alone, folds cannot be told from one another.
            points.iter_mut().for_each(|p| {
                p.azimuth_rad *= 0.02;
                let rate = -v.x * p.azimuth_rad.cos() - v.y * p.azimuth_rad.sin();
                p.range_rate_mps = rate - ambiguity_mps * (rate / ambiguity_mps).round();
                p.elevation_rad = 0.0;
            });
            let e = ego_motion(&points, &EgoModel::Sensor, &s).unwrap_err();
            assert!(e.to_string().contains("ambiguous"), "{e}");
            // The vehicle's bus decides, and so do a few range rates that are known.
            let speed = Some(KnownSpeed::of_car(v.x + 0.4, 0.0, 2.0, DVec2::ZERO));
            let e = ego_motion(&points, &EgoModel::Sensor, &EgoSettings { speed, ..s }).unwrap();
            assert!((e.value[0] - v.x).abs() < 0.15, "{:?} {v}", e.value);
            for p in points.iter_mut().step_by(4) {
                let rate = -v.x * p.azimuth_rad.cos() - v.y * p.azimuth_rad.sin();
                (p.range_rate_mps, p.ambiguity_mps) = (rate, f64::INFINITY);
            }
            let e = ego_motion(&points, &EgoModel::Sensor, &s).unwrap();
            assert!((e.value[0] - v.x).abs() < 0.15, "{:?} {v}", e.value);
        }
    }

    /// More points agree with a car that slides sideways than with one that drives on: what its bus reports leaves the second.
    #[test]
    fn a_car_turns_and_slips_as_a_car_can() {
        let mount = Mount { position_m: DVec2::ZERO, yaw_rad: 0.0 };
        let mut d = Draws::new(0, 74);
        let (ahead, sideways) = (DVec2::new(33.0, 0.0), DVec2::new(33.7, -23.8));
        let (mut points, _) = scene(&mut d, &[mount], (ahead, 0.0), 40, 0.0);
        points.extend(scene(&mut d, &[mount], (sideways, 0.0), 55, 0.0).0);
        let found = |speed| {
            let s = EgoSettings { speed, max_speed_mps: 60.0, ..QUIET };
            let e = ego_motion(&points, &EgoModel::Sensor, &s).unwrap();
            DVec2::new(e.value[0], e.value[1])
        };
        assert!((found(None) - sideways).length() < 0.3);
        for arm_m in [DVec2::ZERO, DVec2::new(3.6, 0.4)] {
            assert!((found(Some(KnownSpeed::of_car(33.0, 0.0, 2.0, arm_m))) - ahead).length() < 0.3);
        }
        // A car of a slow turn, and one that reverses, are possible.
        let car = |speed: f64| KnownSpeed::of_car(speed, 0.0, 1.0, DVec2::new(3.6, 0.0));
        assert!(car(5.0).lateral_mps > 3.6 * 1.2 && car(5.0).yaw_rate_rad_per_s > 1.2);
        assert_eq!(car(-20.0).yaw_rate_rad_per_s, 0.5);
    }

    #[test]
    fn what_the_scene_does_not_allow_is_said() {
        let point = |azimuth_rad, range_rate_mps| Radial {
            azimuth_rad,
            elevation_rad: 0.0,
            range_rate_mps,
            range_rate_std_mps: STD,
            ambiguity_mps: f64::INFINITY,
            radar: 0,
        };
        let message = |points: &[Radial], model: &EgoModel| {
            let e = ego_motion(points, model, &QUIET).unwrap_err();
            assert_eq!(e.exit_code(), 1);
            e.to_string()
        };
        assert!(message(&[], &EgoModel::Sensor).contains("0 points for 2 unknowns"));
        let nan = [point(0.1, f64::NAN), point(f64::NAN, 0.0), point(0.0, 1.0), point(0.2, 1.0)];
        assert!(message(&nan, &EgoModel::Sensor).contains("2 points for 2 unknowns"));
        let line: Vec<Radial> = (0..20).map(|_| point(0.3, -5.0)).collect();
        assert!(message(&line, &EgoModel::Sensor).contains("one line of sight"));
        // A radar on the rear axle does not see the car turn.
        let spread: Vec<Radial> = (0..20).map(|i| point(0.1 * f64::from(i) - 1.0, -5.0)).collect();
        let rear = Mount { position_m: DVec2::ZERO, yaw_rad: 0.0 };
        assert!(message(&spread, &EgoModel::Car(vec![rear])).contains("one line of sight"));
        let mut d = Draws::new(0, 73);
        let chaos: Vec<Radial> =
            (0..60).map(|_| point(2.0 * d.uniform() - 1.0, 60.0 * d.uniform() - 30.0)).collect();
        assert!(message(&chaos, &EgoModel::Sensor).contains("points agree"));
    }

    #[test]
    fn bad_settings_and_repetition() {
        let mut d = Draws::new(0, 74);
        let mount = Mount { position_m: DVec2::ZERO, yaw_rad: 0.0 };
        let (points, _) = scene(&mut d, &[mount], (DVec2::new(5.0, 0.0), 0.0), 40, 0.2);
        let once = ego_motion(&points, &EgoModel::Sensor, &QUIET).unwrap();
        assert_eq!(once, ego_motion(&points, &EgoModel::Sensor, &QUIET).unwrap());
        for (p, stands) in points.iter().zip(&once.standing) {
            assert_eq!(EgoModel::Sensor.over_ground_mps(p, &once).abs() < 0.35, *stands);
        }
        for bad in [
            EgoSettings { gate: 0.0, ..QUIET },
            EgoSettings { tolerance_mps: f64::NAN, ..QUIET },
            EgoSettings { min_inliers: 1.5, ..QUIET },
            EgoSettings { draws: 0, ..QUIET },
            EgoSettings { max_speed_mps: 0.0, ..QUIET },
            EgoSettings { speed: Some(KnownSpeed::of_car(1.0, 0.0, -1.0, DVec2::ZERO)), ..QUIET },
        ] {
            assert_eq!(ego_motion(&points, &EgoModel::Sensor, &bad).unwrap_err().exit_code(), 2);
        }
        let far = [Radial { radar: 1, ..points[0] }];
        assert_eq!(ego_motion(&far, &EgoModel::Car(vec![FRONT]), &QUIET).unwrap_err().exit_code(), 2);
    }
}
