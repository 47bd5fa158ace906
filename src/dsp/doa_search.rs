//! Minima over a grid of directions and between its points.

use super::doa_beamform::Grid;

/// Local minima of `cost`, `[elevation, azimuth]`, in the 3 x 3 neighbourhood, lowest first; of
/// equals the first. Minima on the border count.
pub fn minima<T: Copy + PartialOrd>(cost: &[T], grid: &Grid) -> Vec<usize> {
    let (rows, cols) = (grid.elevation_rad.len(), grid.azimuth_rad.len());
    let mut found = Vec::new();
    for e in 0..rows {
        for a in 0..cols {
            let here = e * cols + a;
            let lowest = (e.saturating_sub(1)..=(e + 1).min(rows - 1))
                .flat_map(|i| (a.saturating_sub(1)..=(a + 1).min(cols - 1)).map(move |j| i * cols + j))
                .all(|i| i == here || cost[here] < cost[i] || (cost[here] == cost[i] && here < i));
            if lowest {
                found.push(here);
            }
        }
    }
    found.sort_by(|a, b| cost[*a].partial_cmp(&cost[*b]).unwrap_or(std::cmp::Ordering::Equal).then(a.cmp(b)));
    found
}

/// Moves from a point of the grid to the minimum of a smooth `cost` of (azimuth, elevation) next to
/// it: parabolas along each axis with steps that shrink to 1e-7 rad. Stays within the grid; an axis
/// of one value stays fixed.
pub fn refine(cost: impl Fn(f64, f64) -> f64, grid: &Grid, start: (f64, f64)) -> (f64, f64) {
    const FINEST: f64 = 1e-7;
    let axes = [&grid.azimuth_rad, &grid.elevation_rad];
    let limits = axes.map(|a| (a[0], a[a.len() - 1]));
    let mut step = axes.map(|a| (a[a.len() - 1] - a[0]).abs() / (a.len().max(2) - 1) as f64);
    let mut at = [start.0, start.1];
    let mut value = cost(at[0], at[1]);
    for _ in 0..60 {
        let mut moved = 0.0f64;
        for axis in 0..2 {
            let h = step[axis];
            if h <= 0.0 {
                continue;
            }
            let try_at = |x: f64| {
                let mut p = at;
                p[axis] = x.clamp(limits[axis].0, limits[axis].1);
                (p, cost(p[0], p[1]))
            };
            let (low, high) = (try_at(at[axis] - h), try_at(at[axis] + h));
            let curvature = low.1 + high.1 - 2.0 * value;
            let mut best = (at, value);
            let slope = low.1 - high.1;
            let vertex = if curvature > 0.0 {
                try_at(at[axis] + 0.5 * h * (slope / curvature).clamp(-2.0, 2.0))
            } else {
                low
            };
            for candidate in [low, high, vertex] {
                if candidate.1 < best.1 {
                    best = candidate;
                }
            }
            moved = moved.max((best.0[axis] - at[axis]).abs() / h);
            (at, value) = best;
        }
        if moved < 0.5 {
            step = step.map(|h| 0.2 * h);
        }
        if step.iter().all(|h| *h < FINEST) {
            break;
        }
    }
    (at[0], at[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid {
        let axis = |n: usize| (0..n).map(|i| -1.0 + 2.0 * i as f64 / (n - 1) as f64).collect();
        Grid { azimuth_rad: axis(41), elevation_rad: axis(21) }
    }

    #[test]
    fn two_hollows_and_a_slanted_valley() {
        let cost = |a: f64, e: f64| {
            let (x, y) = (a - 0.333, e + 0.21);
            let (v, w) = (a + 0.61, e - 0.4);
            let first = 1.0 - (-20.0 * (x * x + y * y + 1.6 * x * y)).exp();
            let second = 1.0 - 0.5 * (-20.0 * (v * v + w * w)).exp();
            first.min(second)
        };
        let g = grid();
        let table: Vec<f64> =
            g.elevation_rad.iter().flat_map(|e| g.azimuth_rad.iter().map(move |a| cost(*a, *e))).collect();
        let tops = minima(&table, &g);
        let at = |i: usize| (g.azimuth_rad[i % 41], g.elevation_rad[i / 41]);
        let first = refine(cost, &g, at(tops[0]));
        assert!((first.0 - 0.333).abs() < 1e-6 && (first.1 + 0.21).abs() < 1e-6, "{first:?}");
        let second = refine(cost, &g, at(tops[1]));
        assert!((second.0 + 0.61).abs() < 1e-6 && (second.1 - 0.4).abs() < 1e-6, "{second:?}");
    }

    #[test]
    fn borders_hold_and_plateaus_count_once() {
        let g = Grid { azimuth_rad: vec![-0.1, 0.0, 0.1], elevation_rad: vec![0.3] };
        assert_eq!(refine(|a, _| -a, &g, (0.0, 0.3)), (0.1, 0.3));
        assert_eq!(minima(&[1.0, 1.0, 1.0], &g), [0]);
        assert_eq!(minima(&[1.0, 2.0, 0.5], &g), [2, 0]);
    }
}
