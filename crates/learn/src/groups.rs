//! How points are sampled, grouped and interpolated (Qi, Yi, Su and Guibas, NIPS 2017). Places alone decide it, in metres.

use glam::DVec2;

/// Number of neighbours from which features are interpolated.
pub const NEIGHBOURS: usize = 3;

/// Farthest point sampling: the point nearest to the radar, then always the one that is farthest from all that were taken; of equal
/// ones the first. Returns numbers of points, at most `count`.
pub fn farthest_points(at_m: &[DVec2], count: usize) -> Vec<usize> {
    let nearest =
        (0..at_m.len()).min_by(|a, b| at_m[*a].length_squared().total_cmp(&at_m[*b].length_squared()));
    let Some(first) = nearest.filter(|_| count > 0) else { return Vec::new() };
    let mut apart = vec![f64::INFINITY; at_m.len()];
    let mut taken = vec![first];
    while taken.len() < count.min(at_m.len()) {
        let last = taken[taken.len() - 1];
        // A point that was taken is not taken again, also where others stand at its place.
        apart[last] = f64::NEG_INFINITY;
        let mut next = 0;
        for (k, p) in at_m.iter().enumerate() {
            apart[k] = apart[k].min(p.distance_squared(at_m[last]));
            if apart[k] > apart[next] {
                next = k;
            }
        }
        taken.push(next);
    }
    taken
}

/// Ball query: `most` numbers of points within `radius_m` of a place. Where more lie there, they are taken evenly from their order by
/// distance, so that the group reaches to the rim; where fewer do, they are repeated in turn. Empty without a point in the ball.
pub fn ball(at_m: &[DVec2], centre_m: DVec2, radius_m: f64, most: usize) -> Vec<usize> {
    let mut inside: Vec<(f64, usize)> = at_m
        .iter()
        .enumerate()
        .map(|(k, p)| (p.distance_squared(centre_m), k))
        .filter(|(d, _)| *d <= radius_m * radius_m)
        .collect();
    inside.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let held = inside.len();
    if held == 0 {
        return Vec::new();
    }
    (0..most).map(|k| if held > most { k * held / most } else { k % held }).map(|k| inside[k].1).collect()
}

/// The three nearest points of a place with their weights, which are as 1/d² and add up to 1. With fewer points the weight of the
/// missing ones is 0. `at_m` must hold a point.
pub fn nearest(at_m: &[DVec2], place_m: DVec2) -> [(usize, f64); NEIGHBOURS] {
    let mut best = [(f64::INFINITY, 0); NEIGHBOURS];
    for (k, p) in at_m.iter().enumerate() {
        let d = p.distance_squared(place_m);
        if d < best[NEIGHBOURS - 1].0 {
            best[NEIGHBOURS - 1] = (d, k);
            // The new one is last and moves forward past those that are farther.
            for i in (1..NEIGHBOURS).rev() {
                if best[i].0 < best[i - 1].0 {
                    best.swap(i, i - 1);
                }
            }
        }
    }
    // At a place of a point that one alone counts, but for one part in 10¹⁰.
    let weights = best.map(|(d, _)| 1.0 / d.max(1e-10));
    let sum: f64 = weights.iter().sum();
    std::array::from_fn(|k| (best[k].1, weights[k] / sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(places: &[f64]) -> Vec<DVec2> {
        places.iter().map(|x| DVec2::new(*x, 0.0)).collect()
    }

    /// On a line of points at 1, 2, 3, 4 and 9 m: the nearest, then 9, then 4 (3 from 1, 5 from 9), then 2 before its equal 3.
    #[test]
    fn farthest_points_on_a_line() {
        let at = line(&[3.0, 1.0, 9.0, 2.0, 4.0]);
        assert_eq!(farthest_points(&at, 3), [1, 2, 4]);
        let mut all = farthest_points(&at, 99);
        assert_eq!(all.len(), 5);
        all.sort_unstable();
        assert_eq!(all, [0, 1, 2, 3, 4]);
        // Points at one place are all taken once.
        assert_eq!(farthest_points(&line(&[1.0, 1.0, 1.0]), 3), [0, 1, 2]);
        assert!(farthest_points(&[], 3).is_empty());
    }

    #[test]
    fn balls_on_a_line() {
        let at = line(&[5.0, 0.0, 1.0, 2.0, 3.0, 4.0]);
        // Four of 0, 1, 2, 3, 4 m.
        assert_eq!(ball(&at, DVec2::ZERO, 4.0, 4), [1, 2, 3, 4]);
        assert_eq!(ball(&at, DVec2::ZERO, 4.0, 2), [1, 3]);
        assert_eq!(ball(&at, DVec2::ZERO, 1.5, 5), [1, 2, 1, 2, 1]);
        assert!(ball(&at, DVec2::new(0.0, 50.0), 1.5, 5).is_empty());
    }

    /// Of 1 m, 2 m and 4 m with 1/d² the weights are 16, 4 and 1 of 21.
    #[test]
    fn weights_by_hand() {
        let w = nearest(&line(&[9.0, 4.0, -1.0, 2.0]), DVec2::ZERO);
        assert_eq!(w.map(|x| x.0), [2, 3, 1]);
        for (found, wanted) in w.iter().zip([16.0, 4.0, 1.0]) {
            assert!((found.1 - wanted / 21.0).abs() < 1e-12);
        }
        let alone = nearest(&line(&[7.0]), DVec2::ZERO);
        assert_eq!((alone[0], alone[1].1, alone[2].1), ((0, 1.0), 0.0, 0.0));
        assert!(nearest(&line(&[1.0, 0.0]), DVec2::ZERO)[0].1 > 1.0 - 1e-9);
    }
}
