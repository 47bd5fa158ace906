//! Finds the centre of a marker pass along the road.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Definition of the centre of a marker pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Centre {
    /// The scan of maximum energy (Kim). Over a flat plate it can be anywhere on the plateau.
    Maximum,
    /// Centroid of the energy above the release threshold.
    Centroid,
    /// Midpoint between the rise and the fall of the energy through the release threshold.
    Edges,
    /// Matched filter: the position at which a window of one plate length with sloping ends holds the most
    /// energy. The window is between those of a smooth plate (a box) and a rough plate (a hump), and has the
    /// smallest spacing error over both shapes.
    Matched,
    /// As [`Centre::Matched`], on the energy clipped between the release threshold and the detection
    /// threshold. The echo of a smooth plate has side lobes to the side: for a radar that drifts by
    /// centimetres along a plate the energy rises or falls several times, which shifts the centre of the
    /// energy towards the brighter end.
    Level,
}

/// One scan that shows new road.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) time_s: f64,
    pub(super) distance_m: f64,
    pub(super) energy: f64,
    pub(super) range_m: Option<f64>,
}

/// Centroid of the energy above `release` in the samples from `first` to `last`, which rise and fall at
/// `ends_m`, m along the road.
pub(super) fn centroid_m(
    samples: &[Sample],
    first: usize,
    last: usize,
    release: f64,
    ends_m: [f64; 2],
) -> f64 {
    let (mut weight, mut moment) = (0.0, 0.0);
    for i in first..=last {
        let s = samples[i];
        let from = if i > first { samples[i - 1].distance_m } else { ends_m[0] };
        let to = if i < last { samples[i + 1].distance_m } else { ends_m[1] };
        let w = (s.energy - release).max(0.0) * (to - from);
        weight += w;
        // Measured from the start, which keeps precision on long drives.
        moment += w * (s.distance_m - ends_m[0]);
    }
    let centre = ends_m[0] + moment / weight;
    if centre.is_finite() { centre } else { (ends_m[0] + ends_m[1]) / 2.0 }
}

/// Share of the window's length by which each end slopes inwards and outwards. Of 0, 0.1, 0.2, 0.3 and 0.4 on
/// mirror and rough plates with speckle, 0.2 beats the centroid on both.
const WINDOW_SLOPE: f64 = 0.2;
/// Number of windows whose mean is the sloping one.
const WINDOWS: usize = 5;
/// Number of places tried along a pass.
const WINDOW_PLACES: usize = 256;

/// Centre, within the pass, of the sloping window of `length_m` that holds the most energy; energies are
/// linear between samples. Windows that share the maximum give their middle.
pub(super) fn matched_m(samples: &[Sample], ends_m: [f64; 2], length_m: f64) -> f64 {
    let middle_m = (ends_m[0] + ends_m[1]) / 2.0;
    // Integral of the energy from the first sample on.
    let mut integral = Vec::with_capacity(samples.len());
    let mut total = 0.0;
    for (i, s) in samples.iter().enumerate() {
        if i > 0 {
            let p = samples[i - 1];
            total += (s.energy + p.energy) / 2.0 * (s.distance_m - p.distance_m);
        }
        integral.push(total);
    }
    let upto = |x_m: f64| {
        let i = samples.partition_point(|s| s.distance_m <= x_m);
        match (i.checked_sub(1).map(|k| samples[k]), samples.get(i)) {
            (Some(a), Some(b)) => {
                let d = x_m - a.distance_m;
                let slope = (b.energy - a.energy) / (b.distance_m - a.distance_m);
                integral[i - 1] + d * (a.energy + slope * d / 2.0)
            }
            // Beyond the samples the outermost energy continues.
            (Some(a), None) => total + (x_m - a.distance_m) * a.energy,
            (None, Some(b)) => (x_m - b.distance_m) * b.energy,
            (None, None) => 0.0,
        }
    };
    let halves_m = (0..WINDOWS).map(|j| {
        let share = 2.0 * j as f64 / (WINDOWS - 1) as f64 - 1.0;
        length_m * (0.5 + WINDOW_SLOPE * share)
    });
    let at = |k: usize| ends_m[0] + (ends_m[1] - ends_m[0]) * (k as f64 / WINDOW_PLACES as f64);
    let held: Vec<f64> = (0..=WINDOW_PLACES)
        .map(|k| halves_m.clone().map(|h| upto(at(k) + h) - upto(at(k) - h)).sum())
        .collect();
    let most = held.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !most.is_finite() {
        return middle_m;
    }
    let near = most - 1e-9 * most.abs();
    let (mut sum, mut count) = (0.0, 0);
    for (k, _) in held.iter().enumerate().filter(|(_, h)| **h >= near) {
        sum += at(k) - ends_m[0];
        count += 1;
    }
    ends_m[0] + sum / count as f64
}

/// [`matched_m`] on the energy clipped below `release` and above `threshold`; on the energy itself where
/// these are equal.
pub(super) fn level_m(
    samples: &[Sample],
    [release, threshold]: [f64; 2],
    ends_m: [f64; 2],
    length_m: f64,
) -> f64 {
    if threshold <= release {
        return matched_m(samples, ends_m, length_m);
    }
    let level = |s: &Sample| Sample { energy: s.energy.clamp(release, threshold), ..*s };
    let levels: Vec<Sample> = samples.iter().map(level).collect();
    matched_m(&levels, ends_m, length_m)
}

/// Time at which the radar was at this distance, s.
pub(super) fn time_at(samples: &[Sample], distance_m: f64) -> f64 {
    let i = samples.partition_point(|s| s.distance_m <= distance_m);
    match (i.checked_sub(1).map(|k| samples[k]), samples.get(i)) {
        (Some(a), Some(b)) => {
            let share = (distance_m - a.distance_m) / (b.distance_m - a.distance_m);
            a.time_s + share * (b.time_s - a.time_s)
        }
        (Some(s), None) => s.time_s,
        (None, Some(s)) => s.time_s,
        (None, None) => 0.0,
    }
}
