//! DBSCAN over (x, y, range rate) (Ester, Kriegel, Sander and Xu, KDD 1996; CONVENTIONS eq. 122).
//!
//! Own rather than a crate's: those in reach bring a linear-algebra stack or search all pairs, and
//! number clusters and give out border points in the order of their search. Here labels depend on
//! the points alone.

use crate::base::error::{BadInput, Result};
use std::collections::HashMap;

/// A point for clustering: its place in metres in any plane, and its range rate in m/s. With points of a moving radar
/// take the range rate that is left when its own motion is taken out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClusterPoint {
    /// Along x, m.
    pub x_m: f64,
    /// Along y, m.
    pub y_m: f64,
    /// Range rate, m/s.
    pub range_rate_mps: f64,
}

/// Clustering by density. Two points are neighbours when (Δx² + Δy²)/position² + Δrate²/rate² ≤ 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dbscan {
    /// Distance that counts as one, m.
    pub position_m: f64,
    /// Scale of the range rate, m/s; infinite to leave range rate out.
    pub range_rate_mps: f64,
    /// A point with so many neighbours, itself counted, is a core.
    pub min_points: usize,
}

impl Default for Dbscan {
    /// For cars: parts of one stand within 1.5 m and 1 m/s of each other.
    fn default() -> Self {
        Dbscan { position_m: 1.5, range_rate_mps: 1.0, min_points: 2 }
    }
}

impl Dbscan {
    /// The cluster of each point, numbered from 0 in the order of the clusters' first cores among `points`; None for
    /// noise, and for points with a NaN or an infinity. Cores within reach of one another share a cluster. A point
    /// that is no core but within reach of some belongs to the nearest of them (of equals, the first): the partition
    /// does not depend on the order of the points unless distances are equal.
    ///
    /// # Errors
    /// Returns an error for scales that are not positive, or `min_points` = 0.
    ///
    /// # Example
    /// A car and a cyclist beside it are near each other, but differ in range rate; a single point elsewhere is noise.
    ///
    /// ```
    /// use catseye::detect::cluster::{ClusterPoint, Dbscan};
    ///
    /// let at = |x_m, y_m, range_rate_mps| ClusterPoint { x_m, y_m, range_rate_mps };
    /// let car = [at(20.0, 0.0, -8.0), at(20.8, 0.5, -8.1), at(21.4, -0.4, -7.9)];
    /// let cyclist = [at(20.5, 1.0, -4.0), at(20.9, 1.1, -4.3)];
    /// let points = [&car[..], &cyclist, &[at(50.0, 10.0, 0.0)]].concat();
    /// let labels = Dbscan::default().labels(&points)?;
    /// assert_eq!(labels, [Some(0), Some(0), Some(0), Some(1), Some(1), None]);
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn labels(&self, points: &[ClusterPoint]) -> Result<Vec<Option<usize>>> {
        for (key, value, top) in [
            ("position_m", self.position_m, f64::MAX),
            ("range_rate_mps", self.range_rate_mps, f64::INFINITY),
        ] {
            if !(value > 0.0 && value <= top) {
                return Err(BadInput::new("is not a scale of clusters")
                    .key(format!("cluster.{key}"))
                    .value(value)
                    .allowed("a positive number")
                    .into());
            }
        }
        if self.min_points == 0 {
            return Err(BadInput::new("a cluster needs at least one point")
                .key("cluster.min_points")
                .value(0)
                .allowed("1 or more")
                .into());
        }
        let scaled: Vec<[f64; 3]> = points
            .iter()
            .map(|p| {
                [p.x_m / self.position_m, p.y_m / self.position_m, p.range_rate_mps / self.range_rate_mps]
            })
            .collect();
        Ok(labels(&scaled, self.min_points, &Grid::new(&scaled)))
    }
}

/// The points by columns about as wide as the neighbourhood's radius, and up each column.
struct Grid {
    /// Indices of points, those of one column together, ascending in the third coordinate.
    order: Vec<usize>,
    columns: HashMap<[i64; 2], std::ops::Range<usize>>,
}

/// A little more than the radius, so that rounding puts no neighbour two columns away.
const SIDE: f64 = 1.0 + 1e-6;

fn column(p: &[f64; 3]) -> [i64; 2] {
    [(p[0] / SIDE).floor() as i64, (p[1] / SIDE).floor() as i64]
}

impl Grid {
    fn new(points: &[[f64; 3]]) -> Grid {
        let finite = |i: &usize| points[*i].iter().all(|x| x.is_finite());
        let mut order: Vec<usize> = (0..points.len()).filter(finite).collect();
        order.sort_by(|a, b| {
            let (p, q) = (&points[*a], &points[*b]);
            column(p).cmp(&column(q)).then(p[2].total_cmp(&q[2])).then(a.cmp(b))
        });
        let mut columns = HashMap::new();
        let mut first = 0;
        for chunk in order.chunk_by(|a, b| column(&points[*a]) == column(&points[*b])) {
            columns.insert(column(&points[chunk[0]]), first..first + chunk.len());
            first += chunk.len();
        }
        Grid { order, columns }
    }

    /// Calls `visit` with each point within 1 of point `i`, itself included, and its squared distance.
    fn neighbours(&self, points: &[[f64; 3]], i: usize, mut visit: impl FnMut(usize, f64)) {
        let [x, y] = column(&points[i]);
        let near = |j: &usize| points[*j][2] - points[i][2];
        for dx in -1..=1 {
            for dy in -1..=1 {
                let (Some(x), Some(y)) = (x.checked_add(dx), y.checked_add(dy)) else { continue };
                let Some(range) = self.columns.get(&[x, y]) else { continue };
                let list = &self.order[range.clone()];
                let first = list.partition_point(|j| near(j) < -1.0);
                for j in list[first..].iter().take_while(|j| near(j) <= 1.0) {
                    let d = squared_distance(&points[i], &points[*j]);
                    if d <= 1.0 {
                        visit(*j, d);
                    }
                }
            }
        }
    }
}

fn squared_distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

/// Root of `i` with the path to it halved.
fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

fn labels(points: &[[f64; 3]], min_points: usize, grid: &Grid) -> Vec<Option<usize>> {
    let mut core = vec![false; points.len()];
    for i in &grid.order {
        let mut count = 0;
        grid.neighbours(points, *i, |_, _| count += 1);
        core[*i] = count >= min_points;
    }
    let mut parent: Vec<usize> = (0..points.len()).collect();
    // (squared distance, index) of the nearest core of a point that is none itself.
    let mut nearest: Vec<Option<(f64, usize)>> = vec![None; points.len()];
    for i in grid.order.iter().copied() {
        grid.neighbours(points, i, |j, d| {
            if !core[j] {
                return;
            }
            if !core[i] {
                let better = nearest[i].is_none_or(|best| (d, j) < best);
                if better {
                    nearest[i] = Some((d, j));
                }
            } else if j < i {
                // The smaller root stays, so that a cluster's root is its first core.
                let (a, b) = (root(&mut parent, i), root(&mut parent, j));
                parent[a.max(b)] = a.min(b);
            }
        });
    }
    let mut number = vec![None; points.len()];
    let mut clusters = 0;
    for i in (0..points.len()).filter(|i| core[*i]) {
        if root(&mut parent, i) == i {
            number[i] = Some(clusters);
            clusters += 1;
        }
    }
    (0..points.len())
        .map(|i| {
            let at = if core[i] { Some(i) } else { nearest[i].map(|n| n.1) };
            at.and_then(|i| number[root(&mut parent, i)])
        })
        .collect()
}

/// The members of each cluster, ascending, in the order of its number.
pub fn members(labels: &[Option<usize>]) -> Vec<Vec<usize>> {
    let count = labels.iter().flatten().max().map_or(0, |m| m + 1);
    let mut out = vec![Vec::new(); count];
    for (i, label) in labels.iter().enumerate() {
        if let Some(c) = label {
            out[*c].push(i);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::philox4x32_10;
    use proptest::prelude::*;

    /// The definition, read off: cores by counting all pairs, components by flooding.
    fn brute(points: &[[f64; 3]], min_points: usize) -> Vec<Option<usize>> {
        let near = |i: usize, j: usize| squared_distance(&points[i], &points[j]) <= 1.0;
        let n = points.len();
        let core: Vec<bool> = (0..n).map(|i| (0..n).filter(|j| near(i, *j)).count() >= min_points).collect();
        let mut out = vec![None; n];
        let mut next = 0;
        for i in 0..n {
            if !core[i] || out[i].is_some() {
                continue;
            }
            let mut stack = vec![i];
            while let Some(k) = stack.pop() {
                out[k] = Some(next);
                stack.extend((0..n).filter(|j| core[*j] && out[*j].is_none() && near(k, *j)));
            }
            next += 1;
        }
        let cores = out.clone();
        for i in (0..n).filter(|i| !core[*i]) {
            out[i] = (0..n)
                .filter(|j| core[*j] && near(i, *j))
                .min_by(|a, b| {
                    let d = |j: usize| squared_distance(&points[i], &points[j]);
                    d(*a).total_cmp(&d(*b))
                })
                .and_then(|j| cores[j]);
        }
        out
    }

    fn uniform(i: u32, key: u32) -> [f64; 3] {
        let w = philox4x32_10([i, 0, 0, 0], [key, 0]);
        [0, 1, 2].map(|k| f64::from(w[k]) / 4_294_967_296.0)
    }

    proptest! {
        #[test]
        fn as_by_all_pairs(
            key in 0u32..1000,
            n in 0usize..120,
            side in 1.0..12.0f64,
            min_points in 1usize..6,
        ) {
            let points: Vec<[f64; 3]> =
                (0..n as u32).map(|i| uniform(i, key).map(|x| side * (x - 0.5))).collect();
            prop_assert_eq!(labels(&points, min_points, &Grid::new(&points)), brute(&points, min_points));
        }

        #[test]
        fn the_order_of_points_does_not_matter(key in 0u32..1000, shift in 1usize..60) {
            let points: Vec<[f64; 3]> = (0..60).map(|i| uniform(i, key).map(|x| 5.0 * x)).collect();
            let mut turned = points.clone();
            turned.rotate_left(shift);
            let a = labels(&points, 3, &Grid::new(&points));
            let mut b = labels(&turned, 3, &Grid::new(&turned));
            b.rotate_right(shift);
            for i in 0..60 {
                prop_assert_eq!(a[i].is_some(), b[i].is_some());
                for j in 0..60 {
                    if a[i].is_some() && a[j].is_some() {
                        prop_assert_eq!(a[i] == a[j], b[i] == b[j]);
                    }
                }
            }
        }
    }

    fn place(x_m: f64, y_m: f64, range_rate_mps: f64) -> ClusterPoint {
        ClusterPoint { x_m, y_m, range_rate_mps }
    }

    #[test]
    fn scales_and_noise() {
        let d = Dbscan { position_m: 2.0, range_rate_mps: 0.5, min_points: 2 };
        let points = [
            place(f64::NAN, 0.0, 0.0),
            place(10.0, 0.0, 0.0),
            place(0.0, 0.0, 0.0),
            place(1.9, 0.0, 0.0),
            place(1.9, 0.0, 0.6),
            place(11.0, 1.0, 0.3),
            place(f64::INFINITY, 0.0, 0.0),
        ];
        let expected = [None, Some(0), Some(1), Some(1), None, Some(0), None];
        assert_eq!(d.labels(&points).unwrap(), expected);
        assert_eq!(members(&expected), [vec![1, 5], vec![2, 3]]);
        let still = Dbscan { range_rate_mps: f64::INFINITY, ..d };
        assert_eq!(still.labels(&points).unwrap()[4], Some(1));
        assert!(d.labels(&[]).unwrap().is_empty());
        for bad in [
            Dbscan { position_m: f64::INFINITY, ..d },
            Dbscan { range_rate_mps: f64::NAN, ..d },
            Dbscan { min_points: 0, ..d },
        ] {
            assert_eq!(bad.labels(&points).unwrap_err().exit_code(), 2);
        }
        // One apart only after rounding.
        let edge = [[-1e-17, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert_eq!(labels(&edge, 2, &Grid::new(&edge)), brute(&edge, 2));
        // Columns at the end of the numbers have no neighbours beyond it.
        let far = [place(1e300, 0.0, 0.0), place(1e300, 0.0, 0.0), place(-1e300, 0.0, 0.0)];
        assert_eq!(d.labels(&far).unwrap(), [Some(0), Some(0), None]);
    }

    #[test]
    #[ignore = "a measurement: run it by name"]
    fn ten_thousand_points() {
        let points: Vec<ClusterPoint> = (0..10_000)
            .map(|i| {
                let [x, y, v] = uniform(i, 7);
                place(120.0 * x, 60.0 * (y - 0.5), 40.0 * (v - 0.5))
            })
            .collect();
        let start = std::time::Instant::now();
        let labels = Dbscan::default().labels(&points).unwrap();
        println!("{:?} for {} clusters", start.elapsed(), members(&labels).len());
    }
}
