//! Tables of points and of echoes: rows are matched one to one by range, range rate and azimuth, whatever their order.

use super::differences::{Difference, DifferenceTally, Tolerances};
use super::table::{self, Cells, Grid};
use serde_json::{Value, json};

/// Columns by which points are matched.
pub const PLACE: [&str; 3] = ["range_m", "range_rate_mps", "azimuth_deg"];

/// Largest number of candidate partners of a point.
const PARTNERS: usize = 32;

/// Largest differences of matched points: range in m, range rate in m/s, azimuth in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate(pub [f64; 3]);

impl Gate {
    /// The gate for echoes, of which a cell has many: they match within the tolerances of their columns.
    pub fn tight(t: &Tolerances) -> Gate {
        let finite = |x: f64, most: f64| if x.is_finite() { x.min(most) } else { most };
        Gate([finite(t.tolerance_m, 0.5), finite(t.tolerance_mps, 0.5), finite(t.tolerance_deg, 2.0)])
    }
}

/// Whether a table holds points or echoes.
pub fn is_points(grid: &Grid) -> bool {
    PLACE.iter().all(|c| grid.numbers(c).is_some())
}

struct Points<'a> {
    place: [&'a [f64]; 3],
    /// Key of each row: only points of one radar match, and echoes of one chain of objects.
    key: Vec<String>,
}

impl<'a> Points<'a> {
    fn of(grid: &'a Grid) -> Points<'a> {
        let names: Vec<&Cells> = ["radar", "chain"].iter().filter_map(|c| grid.column(c)).collect();
        let key = |row: usize| names.iter().map(|c| c.text(row)).collect::<Vec<_>>().join("|");
        Points {
            place: PLACE.map(|c| grid.numbers(c).unwrap_or(&[])),
            key: if names.is_empty() { Vec::new() } else { (0..grid.rows).map(key).collect() },
        }
    }

    /// Sum of the squared differences divided by the gate's; None where one is outside.
    fn distance(&self, i: usize, other: &Points<'_>, j: usize, gate: Gate) -> Option<f64> {
        if self.key.get(i) != other.key.get(j) {
            return None;
        }
        let mut sum = 0.0;
        for c in 0..3 {
            let mut d = (self.place[c][i] - other.place[c][j]).abs();
            if c == 2 {
                d = (d % 360.0).min(360.0 - d % 360.0);
            }
            // NaN is outside, too.
            if d.is_nan() || d > gate.0[c] {
                return None;
            }
            sum += if d > 0.0 { (d / gate.0[c]).powi(2) } else { 0.0 };
        }
        Some(sum)
    }
}

/// Pairs within the gate, nearest first; each row is in one pair at most.
fn matched(a: &Points<'_>, b: &Points<'_>, gate: Gate) -> Vec<(usize, usize)> {
    let range = b.place[0];
    let mut order: Vec<usize> = (0..range.len()).filter(|j| !range[*j].is_nan()).collect();
    order.sort_by(|i, j| range[*i].total_cmp(&range[*j]));
    let mut all: Vec<(f64, usize, usize)> = Vec::new();
    let mut near: Vec<(f64, usize, usize)> = Vec::new();
    for (i, r) in a.place[0].iter().enumerate().filter(|(_, r)| !r.is_nan()) {
        near.clear();
        let from = order.partition_point(|j| range[*j] < r - gate.0[0]);
        let within = order[from..].iter().take_while(|j| range[**j] <= r + gate.0[0]);
        near.extend(within.filter_map(|j| Some((a.distance(i, b, *j, gate)?, i, *j))));
        near.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.2.cmp(&y.2)));
        all.extend(near.iter().take(PARTNERS));
    }
    all.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let (mut of_a, mut of_b) = (vec![false; a.place[0].len()], vec![false; b.place[0].len()]);
    let mut pairs = Vec::new();
    for (_, i, j) in all {
        if !of_a[i] && !of_b[j] {
            (of_a[i], of_b[j]) = (true, true);
            pairs.push((i, j));
        }
    }
    pairs.sort_unstable();
    pairs
}

/// A point as JSON text.
fn told(grid: &Grid, row: usize) -> Value {
    let of = |c: &str| grid.numbers(c).map_or(f64::NAN, |v| v[row]);
    json!(format!("{:.3} m, {:.3} m/s, {:.3} deg", of(PLACE[0]), of(PLACE[1]), of(PLACE[2])))
}

/// Compares two tables of points. Those without a partner are missing or extra; the others are compared by columns.
pub fn compare(file: &str, a: &Grid, b: &Grid, gate: Gate, t: &Tolerances, found: &mut DifferenceTally) {
    // Most results that are alike have the same order.
    if a.rows == b.rows {
        let mut in_order = found.empty_like();
        table::rows(file, a, b, t, &mut in_order);
        if in_order.is_alike() {
            found.add(in_order);
            return;
        }
    }
    table::headers(file, a, b, found);
    let (here, there) = (Points::of(a), Points::of(b));
    let pairs = matched(&here, &there, gate);
    table::pairs(file, a, b, &pairs, t, found);
    if a.rows != b.rows {
        found.note(Difference::unequal(file, "rows", "number of rows", a.rows.into(), b.rows.into()));
    }
    let mut has = [vec![false; a.rows], vec![false; b.rows]];
    pairs.iter().for_each(|&(i, j)| (has[0][i], has[1][j]) = (true, true));
    for row in (0..a.rows).filter(|i| !has[0][*i]) {
        found.note(Difference::unequal(file, "missing in B", a.place(row), told(a, row), Value::Null));
    }
    for row in (0..b.rows).filter(|j| !has[1][*j]) {
        found.note(Difference::unequal(file, "extra in B", b.place(row), Value::Null, told(b, row)));
    }
}
