//! Reconstructs the blind middle between the near and the far part by a road model (Sangeetha Lakshmi section
//! 4.3).

use super::curve::Arc;
use crate::error::{LaneError, positive, within};
use crate::numeric::wrapped;
use glam::DVec2;
use std::fmt;

/// The document's five road models (figure 9, a to e).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RoadModel {
    /// A straight road.
    Straight,
    /// A right-angle bend to the right.
    RightAngleRight,
    /// A curve to the right.
    CurveRight,
    /// A curve to the left.
    CurveLeft,
    /// A right-angle bend to the left.
    RightAngleLeft,
}

impl RoadModel {
    /// All models, in the order of the document.
    pub const ALL: [RoadModel; 5] = [
        RoadModel::Straight,
        RoadModel::RightAngleRight,
        RoadModel::CurveRight,
        RoadModel::CurveLeft,
        RoadModel::RightAngleLeft,
    ];
}

impl fmt::Display for RoadModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            RoadModel::Straight => "straight",
            RoadModel::RightAngleRight => "right-angle bend to the right",
            RoadModel::CurveRight => "curve to the right",
            RoadModel::CurveLeft => "curve to the left",
            RoadModel::RightAngleLeft => "right-angle bend to the left",
        })
    }
}

/// The end of the near part or the start of the far part, both pointing away from the car.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeOfPart {
    /// Position, direction and curvature there.
    pub arc: Arc,
    /// Standard deviation of the part's curvature, 1/m; infinite when unknown.
    pub sigma_curvature_1pm: f64,
}

/// The reconstructed middle.
#[derive(Debug, Clone, PartialEq)]
pub struct Middle {
    /// Points from the near end to the far end, both included, m.
    pub points_m: Vec<DVec2>,
    /// Radius of a right-angle bend's arc, m.
    pub radius_m: Option<f64>,
    /// Weight of a curve's hyperbola: 1 is a parabola, larger values lie nearer to the tangents.
    pub hyperbola_weight: Option<f64>,
}

/// Joins two ends by a road model, with `points` points at even parameters.
///
/// * Straight: weighted fusion. Each part is extended by its arc, and the weight moves from the near to the
///   far one as 3t² - 2t³, so that position and slope are kept at both ends.
/// * Right angle: an arc tangent to both ends' tangents, with a straight piece on the longer one (two
///   positions and two slopes are one condition more than an arc can meet).
/// * Curve: the branch of a hyperbola through both ends that touches both slopes. These leave one number
///   open, the weight of the conic; it is the one that suits the curvatures of the two parts best, within the
///   hyperbolas.
///
/// # Errors
/// Returns an error if `points` is outside 2 to 100000, an end is non-finite, the ends coincide, or their
/// tangents do not meet between them as the model needs.
pub fn reconstruct(
    model: RoadModel,
    near: &EdgeOfPart,
    far: &EdgeOfPart,
    points: usize,
) -> Result<Middle, LaneError> {
    within("the number of points", points as f64, 2.0..=100_000.0)?;
    let (p, q) = (near.arc.point_m, far.arc.point_m);
    let chord = q - p;
    let all = near.arc.heading_rad + far.arc.heading_rad + near.arc.curvature_1pm + far.arc.curvature_1pm;
    if !(chord.is_finite() && all.is_finite()) {
        return Err(LaneError::not_finite("the edge of a part"));
    }
    positive("the gap between the parts", chord.length())?;
    let share = |i: usize| i as f64 / (points - 1) as f64;
    match model {
        RoadModel::Straight => {
            let length = chord.length();
            let points_m = (0..points).map(share).map(|t| {
                let w = t * t * (3.0 - 2.0 * t);
                near.arc.point(t * length).lerp(far.arc.point((t - 1.0) * length), w)
            });
            Ok(Middle { points_m: points_m.collect(), radius_m: None, hyperbola_weight: None })
        }
        RoadModel::RightAngleLeft | RoadModel::RightAngleRight => {
            let (a, b, turn) = tangents(model, &near.arc, &far.arc)?;
            let half = (0.5 * turn.abs()).tan();
            let tangent = a.min(b);
            let radius = tangent / half;
            let start = Arc { curvature_1pm: 0.0, ..near.arc };
            let bend =
                Arc { point_m: start.point(a - tangent), curvature_1pm: turn.signum() / radius, ..near.arc };
            let arc_m = radius * turn.abs();
            let last = Arc { curvature_1pm: 0.0, ..far.arc };
            let total = (a - tangent) + arc_m + (b - tangent);
            let points_m = (0..points).map(|i| {
                let s = share(i) * total;
                if s <= a - tangent {
                    start.point(s)
                } else if s <= a - tangent + arc_m {
                    bend.point(s - (a - tangent))
                } else {
                    last.point(s - total)
                }
            });
            Ok(Middle { points_m: points_m.collect(), radius_m: Some(radius), hyperbola_weight: None })
        }
        RoadModel::CurveLeft | RoadModel::CurveRight => {
            let (a, b, turn) = tangents(model, &near.arc, &far.arc)?;
            let corner = p + DVec2::from_angle(near.arc.heading_rad) * a;
            let area = 0.5 * a * b * turn.sin().abs();
            // Curvature at the ends of a rational quadratic with inner weight w: area / (w² a³), area / (w²
            // b³).
            let at_ends = [area / a.powi(3), area / b.powi(3)];
            let known = [near, far].map(|e| (e.arc.curvature_1pm * turn.signum(), e.sigma_curvature_1pm));
            let cost = |w: f64| {
                let fit: f64 = (at_ends.iter().zip(known))
                    .filter(|(_, (_, sigma))| sigma.is_finite())
                    .map(|(k, (measured, sigma))| {
                        // A part's curvature is that of its own length: the road between may bend quite
                        // differently (straight, arc, straight), so it is trusted to its whole size at best.
                        let sigma = sigma.max(*k).max(1e-6);
                        ((k / (w * w) - measured) / sigma).powi(2)
                    })
                    .sum();
                // Where the curvatures say nothing, stay near the parabola.
                fit + (w.ln() / 0.3).powi(2)
            };
            let weight = (1..=200)
                .map(|i| (i as f64 * 0.01 * 3f64.ln()).exp().min(9.0))
                .min_by(|x, y| cost(*x).total_cmp(&cost(*y)))
                .unwrap_or(1.01);
            let points_m = (0..points).map(share).map(|t| {
                let (c0, c1, c2) = ((1.0 - t).powi(2), 2.0 * weight * t * (1.0 - t), t * t);
                (p * c0 + corner * c1 + q * c2) / (c0 + c1 + c2)
            });
            Ok(Middle { points_m: points_m.collect(), radius_m: None, hyperbola_weight: Some(weight) })
        }
    }
}

/// Lengths of the two tangents from the ends to the point where they meet (m), and the turn between them
/// (rad). The meeting point must lie ahead of the near end and before the far one, and the turn must have the
/// model's sign.
fn tangents(model: RoadModel, near: &Arc, far: &Arc) -> Result<(f64, f64, f64), LaneError> {
    let turn = wrapped(far.heading_rad - near.heading_rad);
    let (e, f) = (DVec2::from_angle(near.heading_rad), DVec2::from_angle(far.heading_rad));
    let chord = far.point_m - near.point_m;
    let cross = e.perp_dot(f);
    let left = matches!(model, RoadModel::CurveLeft | RoadModel::RightAngleLeft);
    let refused = Err(LaneError::refused(format!(
        "the tangents at the edges do not meet between them as the model '{model}' needs"
    )));
    if cross.abs() < 1e-6 || (turn > 0.0) != left || turn.abs() > 3.0 {
        return refused;
    }
    let (a, b) = (chord.perp_dot(f) / cross, e.perp_dot(chord) / cross);
    let least = 1e-6 * chord.length();
    if a > least && b > least { Ok((a, b, turn)) } else { refused }
}

#[cfg(test)]
mod tests {
    use super::super::synth::{Draws, Road};
    use super::*;

    fn edge(road: &Road, s: f64, sigma: f64) -> EdgeOfPart {
        let (point_m, heading_rad) = road.at(s, 0.0);
        let inside = s > road.lead_m && s < road.lead_m + road.turn_rad / road.curvature_1pm.abs();
        let curvature_1pm = if inside || road.lead_m < 0.0 { road.curvature_1pm } else { 0.0 };
        EdgeOfPart { arc: Arc { point_m, heading_rad, curvature_1pm }, sigma_curvature_1pm: sigma }
    }

    fn off(road: &Road, m: &Middle) -> f64 {
        m.points_m.iter().map(|p| road.frenet(*p).1.abs()).fold(0.0, f64::max)
    }

    fn ends_touch(m: &Middle, near: &EdgeOfPart, far: &EdgeOfPart) {
        let n = m.points_m.len();
        assert!(
            m.points_m[0].distance(near.arc.point_m) < 1e-6
                && m.points_m[n - 1].distance(far.arc.point_m) < 1e-6
        );
        for (d, h) in [(m.points_m[1] - m.points_m[0], near), (m.points_m[n - 1] - m.points_m[n - 2], far)] {
            assert!(wrapped(d.to_angle() - h.arc.heading_rad).abs() < 0.02, "{d} {h:?}");
        }
    }

    #[test]
    fn right_angles_are_arcs() {
        for (sign, model) in [(1.0, RoadModel::RightAngleLeft), (-1.0, RoadModel::RightAngleRight)] {
            for (lead, radius, end) in [(30.0, 15.0, 53.6), (35.0, 12.0, 70.0), (26.0, 25.0, 90.0)] {
                let road = Road::bend(lead, radius, sign * std::f64::consts::FRAC_PI_2);
                let (near, far) = (edge(&road, 25.0, 1e-3), edge(&road, end, 1e-3));
                let m = reconstruct(model, &near, &far, 500).unwrap();
                ends_touch(&m, &near, &far);
                println!(
                    "{model}, radius {radius} m: built {:.2} m, off by {:.2} m at most",
                    m.radius_m.unwrap(),
                    off(&road, &m)
                );
            }
            // With an edge where the bend begins, the arc is the road's own.
            let road = Road::bend(25.0, 20.0, sign * std::f64::consts::FRAC_PI_2);
            let m = reconstruct(model, &edge(&road, 25.0, 1.0), &edge(&road, 75.0, 1.0), 300).unwrap();
            assert!((m.radius_m.unwrap() - 20.0).abs() < 1e-6 && off(&road, &m) < 1e-6);
        }
    }

    #[test]
    fn curves_are_hyperbolas() {
        let mut draws = Draws::new(31, 0);
        let (mut worst, mut sum, mut runs) = (0.0f64, 0.0, 0);
        for _ in 0..300 {
            let turn = (0.15 + 0.7 * draws.uniform()) * if draws.uniform() < 0.5 { 1.0 } else { -1.0 };
            let road = Road::bend(20.0 + 15.0 * draws.uniform(), 40.0 + 60.0 * draws.uniform(), turn);
            let end = road.lead_m + turn.abs() / road.curvature_1pm.abs() + 5.0;
            let model = if turn > 0.0 { RoadModel::CurveLeft } else { RoadModel::CurveRight };
            let (near, far) = (edge(&road, 25.0, 1e-3), edge(&road, end, 1e-3));
            let m = reconstruct(model, &near, &far, 200).unwrap();
            ends_touch(&m, &near, &far);
            let w = m.hyperbola_weight.unwrap();
            assert!(w > 1.0);
            let e = off(&road, &m);
            (worst, sum, runs) = (worst.max(e), sum + e * e, runs + 1);
        }
        let rms = (sum / f64::from(runs)).sqrt();
        println!(
            "hyperbola over straight-arc-straight curves: largest distance {rms:.3} m rms, {worst:.3} m worst"
        );
        assert!(rms < 0.5 && worst < 1.5);
        // On one long arc a hyperbola cannot follow the circle; the parabola beside it is nearly as good.
        let road = Road::curve(80.0, true);
        let m = reconstruct(RoadModel::CurveLeft, &edge(&road, 25.0, 1e-4), &edge(&road, 65.0, 1e-4), 100)
            .unwrap();
        assert!(off(&road, &m) < 0.15, "{}", off(&road, &m));
    }

    #[test]
    fn straight_is_a_blend() {
        let road = Road { heading_rad: 0.02, ..Road::straight() };
        let m =
            reconstruct(RoadModel::Straight, &edge(&road, 25.0, 1e-4), &edge(&road, 60.0, 1e-4), 50).unwrap();
        assert!(off(&road, &m) < 1e-9);
        let mut far = edge(&road, 60.0, 1e-4);
        far.arc.point_m += DVec2::Y * 0.4;
        let m = reconstruct(RoadModel::Straight, &edge(&road, 25.0, 1e-4), &far, 51).unwrap();
        ends_touch(&m, &edge(&road, 25.0, 1e-4), &far);
        assert!((road.frenet(m.points_m[25]).1 - 0.2).abs() < 1e-3);
    }

    #[test]
    fn what_cannot_be_joined_is_refused() {
        let road = Road::bend(30.0, 20.0, 1.5);
        let (near, far) = (edge(&road, 25.0, 1.0), edge(&road, 70.0, 1.0));
        for model in [RoadModel::CurveRight, RoadModel::RightAngleRight] {
            assert_eq!(
                reconstruct(model, &near, &far, 10),
                Err(LaneError::refused(format!(
                    "the tangents at the edges do not meet between them as the model '{model}' needs"
                )))
            );
        }
        assert!(reconstruct(RoadModel::CurveLeft, &far, &near, 10).is_err());
        assert!(reconstruct(RoadModel::Straight, &near, &near, 10).is_err());
        assert!(reconstruct(RoadModel::Straight, &near, &far, 1).is_err());
        let mut bad = near;
        bad.arc.heading_rad = f64::INFINITY;
        assert!(RoadModel::ALL.iter().all(|m| reconstruct(*m, &bad, &far, 10).is_err()));
    }
}
