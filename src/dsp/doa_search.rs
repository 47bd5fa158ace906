//! Minima over a grid of directions and between its points.

use super::doa_beamform::Grid;

/// Finds the local minima of `cost`, `[elevation, azimuth]`, in the 3 x 3 neighbourhood, lowest first; of equal ones it
/// takes the first. Minima on the border count.
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

/// Moves from a point of the grid to the minimum of a smooth `cost` of (azimuth, elevation) next to it:
/// vertices of the paraboloid through a stencil (with its cross term) whose size shrinks from `scale`
/// steps of the grid to 1e-5 rad, where the vertex is right to some 1e-8. Stays within the grid; an
/// axis of one value stays fixed.
pub fn refine(cost: impl Fn(f64, f64) -> f64, grid: &Grid, start: (f64, f64), scale: f64) -> (f64, f64) {
    const FINEST: f64 = 1e-5;
    let axes = [&grid.azimuth_rad, &grid.elevation_rad];
    let limits = axes.map(|a| (a[0].min(a[a.len() - 1]), a[0].max(a[a.len() - 1])));
    let mut step = axes.map(|a| scale * (a[a.len() - 1] - a[0]).abs() / (a.len().max(2) - 1) as f64);
    let free: Vec<usize> = (0..2).filter(|k| step[*k] > 0.0).collect();
    let at = |p: [f64; 2]| {
        let p = [p[0].clamp(limits[0].0, limits[0].1), p[1].clamp(limits[1].0, limits[1].1)];
        (p, cost(p[0], p[1]))
    };
    let mut best = at([start.0, start.1]);
    for _ in 0..40 {
        let centre = best;
        let beside = |k: usize, sign: f64| {
            let mut p = centre.0;
            p[k] += sign * step[k];
            at(p)
        };
        // Slopes and curvatures in steps.
        let (mut slope, mut bend, mut cross) = ([0.0; 2], [0.0; 2], 0.0);
        let mut lowest = centre;
        let mut keep = |p: ([f64; 2], f64)| {
            if p.1 < lowest.1 {
                lowest = p;
            }
            p.1
        };
        let mut ahead = [centre.1; 2];
        for &k in &free {
            let (low, high) = (keep(beside(k, -1.0)), keep(beside(k, 1.0)));
            (slope[k], bend[k], ahead[k]) = (0.5 * (high - low), high + low - 2.0 * centre.1, high);
        }
        if free.len() == 2 {
            let corner = keep(at([centre.0[0] + step[0], centre.0[1] + step[1]]));
            cross = corner - ahead[0] - ahead[1] + centre.1;
        }
        let det = bend[0] * bend[1] - cross * cross;
        let vertex = match free[..] {
            [k] if bend[k] > 0.0 => {
                let mut v = [0.0; 2];
                v[k] = -slope[k] / bend[k];
                Some(v)
            }
            [_, _] if det > 0.0 && bend[0] > 0.0 => Some([
                (cross * slope[1] - bend[1] * slope[0]) / det,
                (cross * slope[0] - bend[0] * slope[1]) / det,
            ]),
            _ => None,
        };
        let mut settled = lowest.1 >= centre.1;
        if let Some(v) = vertex {
            let v = v.map(|v| v.clamp(-2.0, 2.0));
            let there = at([centre.0[0] + v[0] * step[0], centre.0[1] + v[1] * step[1]]);
            if there.1 < lowest.1 {
                lowest = there;
            }
            settled |= v.iter().all(|v| v.abs() < 0.5);
        }
        best = lowest;
        if settled {
            if free.iter().all(|k| step[*k] <= FINEST) {
                break;
            }
            step = step.map(|h| (0.1 * h).max(if h > 0.0 { FINEST } else { 0.0 }));
        }
    }
    (best.0[0], best.0[1])
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
        let first = refine(cost, &g, at(tops[0]), 1.0);
        assert!((first.0 - 0.333).abs() < 1e-6 && (first.1 + 0.21).abs() < 1e-6, "{first:?}");
        let second = refine(cost, &g, at(tops[1]), 1.0);
        assert!((second.0 + 0.61).abs() < 1e-6 && (second.1 - 0.4).abs() < 1e-6, "{second:?}");
    }

    #[test]
    fn borders_hold_and_plateaus_count_once() {
        let g = Grid { azimuth_rad: vec![-0.1, 0.0, 0.1], elevation_rad: vec![0.3] };
        assert_eq!(refine(|a, _| -a, &g, (0.0, 0.3), 1.0), (0.1, 0.3));
        assert_eq!(minima(&[1.0, 1.0, 1.0], &g), [0]);
        assert_eq!(minima(&[1.0, 2.0, 0.5], &g), [2, 0]);
    }
}
