//! Finds which far part continues which near part (Sangeetha Lakshmi section 4.1).

use super::curve::Arc;
use super::targets::Trail;
use crate::error::{LaneError, finite, positive, within};
use crate::numeric::wrapped;
use glam::DVec2;

/// Settings of [`match_lane`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatchSettings {
    /// Least goodness of fit R², the document's a, which it does not state. In a lane 3.5 m wide 0.2 is an
    /// rms distance of 0.9 m; half a lane would be -2.
    pub least_r_squared: f64,
    /// Largest angle between the two extensions at the middle of the gap, rad.
    pub slope_gap_rad: f64,
    /// Number of lanes tried to each side.
    pub most_lanes: i32,
}

impl Default for MatchSettings {
    fn default() -> Self {
        MatchSettings { least_r_squared: 0.2, slope_gap_rad: 0.2, most_lanes: 4 }
    }
}

/// The lane of a far path relative to the near lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaneMatch {
    /// Lane of the far path, counted from the near one, positive to the left.
    pub lane: i32,
    /// Goodness of fit R² of the two extensions over the gap, against a line of unknown place in its lane.
    pub r_squared: f64,
    /// Goodness of fit R² of the next best lane.
    pub next_r_squared: f64,
    /// Slope of the far extension minus that of the near one at the middle of the gap, rad.
    pub slope_gap_rad: f64,
    /// Distance between the ends of the near and the far part, m.
    pub gap_m: f64,
}

/// Coefficient of determination of `fitted` for `observed`, 1 - sum (Y - y)² / sum (Y - mean Y)². The
/// document's printed form has no residual in it and is taken as a misprint. On a straight level line the
/// total is zero and R² does not exist; `spread_m2` therefore adds a variance (m²) to each point's total for
/// what is unknown beyond the line's shape.
///
/// # Errors
/// Returns an error if the lists differ in length or hold fewer than two values, if the total is zero, or if
/// R² is non-finite.
pub fn r_squared(fitted: &[f64], observed: &[f64], spread_m2: f64) -> Result<f64, LaneError> {
    if fitted.len() != observed.len() || observed.len() < 2 {
        return Err(LaneError::too_few("pairs of samples", fitted.len().min(observed.len()), 2));
    }
    let mean = observed.iter().sum::<f64>() / observed.len() as f64;
    let total: f64 = observed.iter().map(|y| (y - mean).powi(2) + spread_m2).sum();
    let left: f64 = fitted.iter().zip(observed).map(|(f, y)| (f - y).powi(2)).sum();
    let r = 1.0 - left / total;
    if total <= 0.0 {
        return Err(LaneError::undetermined("R², because the observed values do not differ"));
    }
    finite("R²", r)
}

/// Finds the lane of a far path from the middle of the near lane's end and the path's start. Both are
/// extended into the gap by their arcs and sampled evenly along the chord between them. For each lane the far
/// arc is moved sideways, and the best R² counts. A line of unknown place in a lane of width w has the
/// variance w²/12, which replaces the level line's missing spread.
///
/// # Errors
/// Returns an error if a width or setting is out of range, a part's end is non-finite, or no lane fits well
/// enough.
pub fn match_lane(
    near_end: &Arc,
    far: &Trail,
    lane_width_m: f64,
    settings: &MatchSettings,
) -> Result<LaneMatch, LaneError> {
    positive("the lane's width", lane_width_m)?;
    within("the number of lanes tried", f64::from(settings.most_lanes), 0.0..=50.0)?;
    let chord = far.near.point_m - near_end.point_m;
    let gap_m = chord.length();
    if !(gap_m.is_finite() && near_end.heading_rad.is_finite() && near_end.curvature_1pm.is_finite()) {
        return Err(LaneError::not_finite("the end of a part"));
    }
    let overlap = gap_m < 1.0 || chord.dot(DVec2::from_angle(near_end.heading_rad)) <= 0.0;
    let mut tried: Vec<(f64, i32, f64)> = Vec::new();
    for lane in -settings.most_lanes..=settings.most_lanes {
        let left = -f64::from(lane) * lane_width_m;
        // The far path moved into the near lane, as an arc that runs back towards the car.
        let normal = DVec2::from_angle(far.near.heading_rad).perp();
        let shrink = 1.0 - far.near.curvature_1pm * left;
        if shrink <= 0.1 {
            continue;
        }
        let start = far.near.point_m + normal * left;
        let back = Arc { point_m: start, curvature_1pm: far.near.curvature_1pm / shrink, ..far.near };
        // With an overlap the comparison is made beside the far start, else over the gap.
        let d = start - near_end.point_m;
        let along = if overlap { DVec2::from_angle(near_end.heading_rad) } else { d.normalize_or_zero() };
        let reach = if overlap { 2.0 * lane_width_m } else { d.length() };
        let count = 21;
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for i in 0..count {
            let x = reach * i as f64 / (count - 1) as f64;
            let (Some(a), Some(b)) =
                (beside(near_end, near_end.point_m, along, x), beside(&back, near_end.point_m, along, x))
            else {
                break;
            };
            ours.push(a);
            theirs.push(b);
        }
        if ours.len() < count {
            continue;
        }
        let r = r_squared(&ours, &theirs, lane_width_m * lane_width_m / 12.0)?;
        let slope = wrapped(back.heading_at(-0.5 * reach) - near_end.heading_at(0.5 * reach));
        tried.push((r, lane, slope));
    }
    tried.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let Some((best, lane, slope)) = tried.first().copied() else {
        return Err(no_match(f64::NEG_INFINITY, f64::NAN));
    };
    if !(best >= settings.least_r_squared && slope.abs() <= settings.slope_gap_rad) {
        return Err(no_match(best, slope));
    }
    let next_r_squared = tried.get(1).map_or(f64::NEG_INFINITY, |t| t.0);
    Ok(LaneMatch { lane, r_squared: best, next_r_squared, slope_gap_rad: slope, gap_m })
}

fn no_match(best_r_squared: f64, slope_gap_rad: f64) -> LaneError {
    LaneError::refused(format!(
        "the far part continues no lane near the car: the best goodness of fit is {best_r_squared:.3} with slopes {slope_gap_rad:.3} rad \
         apart"
    ))
}

/// Lateral distance, m, to the left of the line from `origin` along `along`, at which an arc crosses the
/// normal of that line at `x_m`. None where the arc turns away before it gets there.
fn beside(arc: &Arc, origin_m: DVec2, along: DVec2, x_m: f64) -> Option<f64> {
    let mut s = 0.0;
    for _ in 0..30 {
        let p = arc.point(s) - origin_m;
        let rate = along.dot(DVec2::from_angle(arc.heading_at(s)));
        if rate < 0.2 {
            return None;
        }
        let miss = x_m - p.dot(along);
        if miss.abs() < 1e-6 {
            return Some(along.perp_dot(p));
        }
        s += miss / rate;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::synth::{Draws, Road, way};
    use super::*;

    #[test]
    fn r_squared_by_hand() {
        assert_eq!(r_squared(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0], 0.0), Ok(1.0));
        // Residuals 1, 0, -1 of observed 0, 2, 4: 1 - 2/8.
        assert_eq!(r_squared(&[1.0, 2.0, 3.0], &[0.0, 2.0, 4.0], 0.0), Ok(0.75));
        assert_eq!(r_squared(&[2.0; 3], &[0.0, 2.0, 4.0], 0.0), Ok(0.0));
        assert!(r_squared(&[1.0; 3], &[1.0; 3], 0.0).is_err());
        assert_eq!(r_squared(&[1.5; 3], &[1.0; 3], 1.0), Ok(0.75));
        assert!(r_squared(&[], &[], 1.0).is_err() && r_squared(&[1.0], &[1.0, 2.0], 1.0).is_err());
        assert!(r_squared(&[f64::NAN, 1.0], &[1.0, 2.0], 1.0).is_err());
    }

    #[test]
    fn the_right_lane_on_straight_and_curved_roads() {
        let mut draws = Draws::new(21, 0);
        for noise in [0.0, 0.15, 0.3] {
            let (mut right, mut wrong, mut refused) = (0, 0, 0);
            for run in 0..200 {
                let road = if run % 3 == 0 {
                    Road::straight()
                } else {
                    Road::curve(150.0 + 800.0 * draws.uniform(), run % 2 == 0)
                };
                let lane = run as i32 % 3 - 1;
                let trail =
                    Trail::fit(&way(&road, 45.0, 85.0, 3.5 * f64::from(lane), 40, noise, run)).unwrap();
                // The camera's part ends at 28 m with 3 cm, 0.2 degrees and 3e-4 1/m.
                let (p, h) = road.at(28.0, 0.0);
                let near = Arc {
                    point_m: p + DVec2::Y * 0.03 * draws.normal(),
                    heading_rad: h + 0.0035 * draws.normal(),
                    curvature_1pm: road.curvature_1pm + 3e-4 * draws.normal(),
                };
                match match_lane(&near, &trail, 3.5, &MatchSettings::default()) {
                    Ok(m) if m.lane == lane => right += 1,
                    Ok(_) => wrong += 1,
                    Err(_) => refused += 1,
                }
            }
            println!("noise {noise} m: {right} right, {wrong} wrong, {refused} refused of 200");
            assert!(right >= 180 && wrong <= 2, "{noise}");
        }
    }

    #[test]
    fn a_right_angle_is_not_matched_by_extension() {
        let road = Road::bend(32.0, 18.0, std::f64::consts::FRAC_PI_2);
        let trail = Trail::fit(&way(&road, 64.0, 100.0, 0.0, 30, 0.0, 1)).unwrap();
        let (point_m, heading_rad) = road.at(28.0, 0.0);
        let near = Arc { point_m, heading_rad, curvature_1pm: 0.0 };
        let m = match_lane(&near, &trail, 3.5, &MatchSettings::default());
        assert!(matches!(m, Err(LaneError::Refused { .. })), "{m:?}");
        let bad = Arc { heading_rad: f64::NAN, ..near };
        assert!(match_lane(&bad, &trail, 3.5, &MatchSettings::default()).is_err());
        assert!(match_lane(&near, &trail, 0.0, &MatchSettings::default()).is_err());
    }
}
