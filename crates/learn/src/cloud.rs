//! The points of one scan as a network sees them, and the class that the simulation knows for each.
//!
//! [`PointFeatures`] are made of measured points alone. Nothing turns labels into features:
//!
//! ```compile_fail
//! use catseye_learn::cloud::{PointFeatures, Sight};
//! use catseye_learn::data::Labels;
//! fn leak(sight: &Sight, labels: &Labels) -> PointFeatures {
//!     PointFeatures::new(sight, labels)
//! }
//! ```
//!
//! The same with a cloud compiles:
//!
//! ```
//! use catseye_learn::cloud::{Cloud, PointFeatures, Sight};
//! fn see(sight: &Sight, cloud: &Cloud) -> PointFeatures {
//!     PointFeatures::new(sight, cloud)
//! }
//! ```

use crate::groups::{NEIGHBOURS, ball, farthest_points, nearest};
use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// Unit of places in features, m; also how far r_min reaches.
const FAR_M: f64 = 64.0;
/// Unit of range rates in features, m/s.
const RATE_MPS: f64 = 10.0;

/// One measured point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPoint {
    /// Place in the level axes of the radar, x forward and y left, m.
    pub at_m: DVec2,
    /// √power over the largest of the scan, 0 to 1.
    pub amplitude: f64,
    /// Range rate, m/s, positive receding.
    pub range_rate_mps: f64,
}

impl MeasuredPoint {
    /// An order that does not depend on how the points are listed: two points that are equal in it are equal in all.
    fn order(&self, other: &MeasuredPoint) -> Ordering {
        let key = |p: &MeasuredPoint| [p.at_m.x, p.at_m.y, p.amplitude, p.range_rate_mps];
        let pairs = key(self).into_iter().zip(key(other));
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
    }
}

/// What a radar measured in one scan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cloud {
    /// Points in their given order.
    pub points: Vec<MeasuredPoint>,
}

/// A feature of a point in addition to its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Feature {
    /// Amplitude (√power) relative to the largest of the scan.
    Amplitude,
    /// Range rate.
    RangeRate,
    /// Number of points in each of the concentric circles around it (Feng 2019, section 5.3.3, test 3).
    Counts,
    /// Covariance of the positions in each of these circles (the same test).
    Covariance,
    /// Distance of the nearest point that is not part of its own lobe (the same section, test 2).
    RMin,
}

impl Feature {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Feature::Amplitude => "amplitude",
            Feature::RangeRate => "range_rate",
            Feature::Counts => "counts",
            Feature::Covariance => "covariance",
            Feature::RMin => "r_min",
        }
    }
}

/// One step from points to centroids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Radius of the groups, m.
    pub radius_m: f64,
    /// Largest number of centroids of a frame.
    pub centroids: usize,
}

/// What a network sees of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    /// What it is told of a point beside its place.
    pub features: Vec<Feature>,
    /// Radii of the concentric circles, m.
    pub circles_m: Vec<f64>,
    /// Points nearer than this count as of the same lobe for r_min, m.
    pub threshold_m: f64,
    /// Steps of sampling and grouping; without one the whole frame is the only group.
    pub steps: Vec<Step>,
    /// Points of a group.
    pub samples: usize,
}

impl Sight {
    /// Number of values for each point.
    pub fn width(&self) -> usize {
        let one = |f: &Feature| match f {
            Feature::Amplitude | Feature::RangeRate | Feature::RMin => 1,
            Feature::Counts => self.circles_m.len(),
            Feature::Covariance => 3 * self.circles_m.len(),
        };
        2 + self.features.iter().map(one).sum::<usize>()
    }

    /// The values of one point of a scan: its place over 64 m, then what is asked for.
    fn values(&self, points: &[MeasuredPoint], own: usize) -> Vec<f64> {
        let p = &points[own];
        let mut values = vec![p.at_m.x / FAR_M, p.at_m.y / FAR_M];
        for feature in &self.features {
            match feature {
                Feature::Amplitude => values.push(p.amplitude),
                Feature::RangeRate => values.push(p.range_rate_mps / RATE_MPS),
                Feature::Counts => {
                    let counts = self.circles_m.iter().map(|r| circle(points, p.at_m, *r).0);
                    values.extend(counts.map(f64::ln));
                }
                Feature::Covariance => {
                    values.extend(self.circles_m.iter().flat_map(|r| circle(points, p.at_m, *r).1));
                }
                Feature::RMin => values.push(r_min_m(points, p.at_m, self.threshold_m).min(FAR_M) / FAR_M),
            }
        }
        values
    }
}

/// Number of the points within a radius of a point, itself counted, and the covariance xx, xy, yy of their places around their mean
/// over the radius squared.
fn circle(points: &[MeasuredPoint], centre_m: DVec2, radius_m: f64) -> (f64, [f64; 3]) {
    let inside = || points.iter().map(|p| p.at_m - centre_m).filter(|d| d.length() <= radius_m);
    let n = inside().count().max(1) as f64;
    let mean = inside().sum::<DVec2>() / n;
    let sums = inside()
        .map(|d| d - mean)
        .fold([0.0; 3], |s, d| [s[0] + d.x * d.x, s[1] + d.x * d.y, s[2] + d.y * d.y]);
    (n, sums.map(|s| s / n / (radius_m * radius_m)))
}

/// Distance of the nearest point that is at least so far away, m; infinite without one.
fn r_min_m(points: &[MeasuredPoint], centre_m: DVec2, threshold_m: f64) -> f64 {
    let apart = points.iter().map(|p| p.at_m.distance(centre_m));
    // A threshold of 0 leaves out the point itself and others at its place.
    apart.filter(|d| *d > 0.0 && *d >= threshold_m).fold(f64::INFINITY, f64::min)
}

/// One step of a frame, worked out: who belongs to whom.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Level {
    /// Number of centroids.
    pub(crate) centroids: usize,
    /// Rows of the step before, `[centroid, sample]`.
    pub(crate) members: Vec<usize>,
    /// Places of the members from their centroid over the radius, `[centroid, sample, 2]`.
    pub(crate) offsets: Vec<f32>,
    /// The nearest centroids of each row of the step before, `[row, neighbour]`.
    pub(crate) near: Vec<usize>,
    /// Their weights, `[row, neighbour]`.
    pub(crate) weights: Vec<f32>,
}

impl Level {
    fn new(at_m: &[DVec2], step: &Step, samples: usize) -> (Level, Vec<DVec2>) {
        let centres = farthest_points(at_m, step.centroids);
        let centres_m: Vec<DVec2> = centres.iter().map(|c| at_m[*c]).collect();
        let (mut members, mut offsets) = (Vec::new(), Vec::new());
        for centre in &centres_m {
            for k in ball(at_m, *centre, step.radius_m, samples) {
                members.push(k);
                offsets.extend(((at_m[k] - centre) / step.radius_m).to_array().map(|v| v as f32));
            }
        }
        let neighbours: Vec<[(usize, f64); NEIGHBOURS]> =
            at_m.iter().map(|p| nearest(&centres_m, *p)).collect();
        let level = Level {
            centroids: centres.len(),
            members,
            offsets,
            near: neighbours.iter().flatten().map(|n| n.0).collect(),
            weights: neighbours.iter().flatten().map(|n| n.1 as f32).collect(),
        };
        (level, centres_m)
    }
}

/// What a network sees of the points of one scan. It is made of measured points alone, and what it holds of a point does not depend on
/// the order in which the points are listed.
#[derive(Debug, Clone, PartialEq)]
pub struct PointFeatures {
    /// `[row, feature]`, in an order that follows from the points and not from their list.
    pub(crate) values: Vec<f32>,
    /// The row of each point of the list.
    pub(crate) rows: Vec<usize>,
    pub(crate) levels: Vec<Level>,
}

impl PointFeatures {
    /// The features of a scan.
    pub fn new(sight: &Sight, cloud: &Cloud) -> PointFeatures {
        let mut order: Vec<usize> = (0..cloud.points.len()).collect();
        order.sort_by(|a, b| cloud.points[*a].order(&cloud.points[*b]));
        let sorted: Vec<MeasuredPoint> = order.iter().map(|k| cloud.points[*k]).collect();
        let mut rows = vec![0; order.len()];
        order.iter().enumerate().for_each(|(row, point)| rows[*point] = row);
        let mut at_m: Vec<DVec2> = sorted.iter().map(|p| p.at_m).collect();
        let mut levels = Vec::new();
        for step in sight.steps.iter().filter(|_| !sorted.is_empty()) {
            let (level, centres_m) = Level::new(&at_m, step, sight.samples);
            levels.push(level);
            at_m = centres_m;
        }
        let values = (0..sorted.len()).flat_map(|k| sight.values(&sorted, k)).map(|v| v as f32);
        PointFeatures { values: values.collect(), rows, levels }
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.rows.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(places: &[[f64; 2]]) -> Cloud {
        let point = |(k, at): (usize, &[f64; 2])| MeasuredPoint {
            at_m: DVec2::from_array(*at),
            amplitude: 0.1 * k as f64,
            range_rate_mps: -5.0,
        };
        Cloud { points: places.iter().enumerate().map(point).collect() }
    }

    fn sight(features: &[Feature]) -> Sight {
        Sight {
            features: features.to_vec(),
            circles_m: vec![1.0, 4.0],
            threshold_m: 0.5,
            steps: vec![Step { radius_m: 4.0, centroids: 2 }],
            samples: 3,
        }
    }

    /// A point with neighbours at ±3 m ahead and one in its lobe: in 1 m two points, in 4 m four.
    #[test]
    fn features_by_hand() {
        use Feature::*;
        let c = cloud(&[[10.0, 0.0], [13.0, 0.0], [7.0, 0.0], [10.0, 0.2]]);
        let s = sight(&[Counts, Covariance, RMin, Amplitude, RangeRate]);
        assert_eq!(s.width(), 13);
        let v = s.values(&c.points, 0);
        assert_eq!(v.len(), 13);
        let wanted = [
            10.0 / 64.0,
            0.0,
            2f64.ln(),
            4f64.ln(),
            // Of y = 0 and 0.2: 0.1 squared.
            0.0,
            0.0,
            0.01,
            // Of x = -3, 0, 0, 3 and y = 0, 0, 0, 0.2, over 16.
            4.5 / 16.0,
            0.0,
            0.0075 / 16.0,
            3.0 / 64.0,
            0.0,
            -0.5,
        ];
        for (k, (found, wanted)) in v.iter().zip(wanted).enumerate() {
            assert!((found - wanted).abs() < 1e-12, "{k}: {found} {wanted}");
        }
        // Points on a line at 45 degrees vary together.
        let slanted = cloud(&[[5.0, 5.0], [6.0, 6.0]]);
        let v = sight(&[Covariance]).values(&slanted.points, 0);
        assert!(v[5..8].iter().all(|x| (x - 0.25 / 16.0).abs() < 1e-12), "{v:?}");
        let alone = sight(&[RMin, Counts]).values(&cloud(&[[1.0, 1.0]]).points, 0);
        assert_eq!(alone[2..], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn features_do_not_depend_on_the_list() {
        let c = cloud(&[[10.0, 0.0], [13.0, 1.0], [7.0, -2.0], [10.0, 0.2], [10.0, 0.0], [30.0, 5.0]]);
        let s = sight(&[Feature::Counts, Feature::Amplitude]);
        let one = PointFeatures::new(&s, &c);
        let turned = Cloud { points: c.points.iter().rev().copied().collect() };
        let other = PointFeatures::new(&s, &turned);
        assert_eq!((&one.values, &one.levels), (&other.values, &other.levels));
        assert_eq!(one.rows, other.rows.iter().rev().copied().collect::<Vec<_>>());
        assert_eq!(one.levels[0].centroids, 2);
        assert_eq!((one.levels[0].members.len(), one.levels[0].near.len()), (6, 18));
        assert_eq!(PointFeatures::new(&s, &Cloud::default()).points(), 0);
    }
}
