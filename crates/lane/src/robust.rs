//! Fits curves to points with outliers, whose weight falls with their distance (Cauchy).

use crate::curve::{Fitted, Shape, fit};
use glam::DVec2;

/// Standard deviations off the curve at which a point's weight is halved.
const HALF_WEIGHT: f64 = 2.0;
/// Least standard deviation of points for a first curve, m, lest a few precise points outweigh all others.
const AT_FIRST_M: f64 = 0.08;
/// Default number of iterations in which points off the curve lose weight.
pub(crate) const WEIGHINGS: usize = 3;

/// Standard deviations for a first curve, m.
pub(crate) fn at_first(std_m: &[f64]) -> Vec<f64> {
    std_m.iter().map(|s| s.hypot(AT_FIRST_M)).collect()
}

/// Distance of a point from a curve, scaled to 1 where its weight is halved.
fn off(fitted: &Fitted, place: DVec2, std_m: f64) -> f64 {
    fitted.curve.foot(place).left_m / (HALF_WEIGHT * std_m)
}

/// The curve fitted again with weights by the points' distances; the curve itself where that fails.
pub(crate) fn weighed(fitted: Fitted, places: &[DVec2], std_m: &[f64]) -> Fitted {
    let weighed: Vec<f64> =
        places.iter().zip(std_m).map(|(p, s)| s * (1.0 + off(&fitted, *p, *s).powi(2)).sqrt()).collect();
    fit(places, &weighed, fitted.shape).unwrap_or(fitted)
}

/// Fits the simplest shape that points with outliers support, by Cauchy's measure of each shape's own best
/// fit: the weights of one shape would make outliers of what only another one fits. A further parameter has
/// to lower the measure by more than `gain`.
pub(crate) fn robust(places: &[DVec2], std_m: &[f64], gain: f64, weighings: usize) -> Option<Fitted> {
    let first = at_first(std_m);
    let mut best: Option<(f64, Fitted)> = None;
    for shape in [Shape::Line, Shape::Arc, Shape::Clothoid] {
        let Some(fitted) = fit(places, &first, shape) else { continue };
        let fitted = (0..weighings).fold(fitted, |f, _| weighed(f, places, std_m));
        let measure = |(p, s): (&DVec2, &f64)| HALF_WEIGHT.powi(2) * off(&fitted, *p, *s).powi(2).ln_1p();
        let cost: f64 = places.iter().zip(std_m).map(measure).sum();
        let more = best.as_ref().map_or(0, |b| shape.parameters() - b.1.shape.parameters());
        if best.as_ref().is_none_or(|b| b.0 - cost > gain * more as f64) {
            best = Some((cost, fitted));
        }
    }
    best.map(|b| b.1)
}
