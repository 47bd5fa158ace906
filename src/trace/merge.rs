//! Echoes of one place by one way are one echo (CONVENTIONS eq. 66).
//!
//! The corner that several facets share gives each of them a wave of its own. All of these have one path and one set of directions, and
//! on a smooth surface they cancel to a small rest. Their sum is exact, and whatever looks at single echoes (budgets, floors, lists of
//! returns) has to look at the sum: a facet's share of a corner says nothing of what the corner returns.

use super::Echo;
use crate::geom::hash::{FastMap, firsts};
use glam::DVec3;
use num_complex::Complex64;

/// Lengths that differ by less belong to one place, m. What is left of it is in the amplitude, by its phase.
const SAME_M: f64 = 1e-6;
/// A sum of this share of its terms is what rounding leaves of zero.
const NOTHING: f64 = 1e-12;

/// Path, places of the first and the last bounce, and what the path changes by until the frame's end, in units of [`SAME_M`];
/// then the chain of objects.
type Key = ([i64; 10], [u32; super::MAX_BOUNCES]);

fn key(r: &Echo, reach_s: f64) -> Key {
    let whole = |x: f64| (x / SAME_M).round() as i64;
    let place = |d: DVec3, range: f64| (d * range).to_array().map(whole);
    let ([a, b, c], [d, e, f]) = (place(r.departure, r.first_range_m), place(r.arrival, r.last_range_m));
    let [acceleration, jerk] = r.path_acceleration_and_jerk;
    let change = [reach_s, 0.5 * reach_s.powi(2) * acceleration, reach_s.powi(3) * jerk / 6.0];
    let rate = r.path_rate_mps * if reach_s > 0.0 { change[0] } else { 1.0 };
    ([whole(r.path_length_m), a, b, c, d, e, f, whole(rate), whole(change[1]), whole(change[2])], r.chain)
}

/// Adds up echoes of one place by one way, for waves of `wavenumber` (rad/m) in a frame that lasts from `reach_s`
/// before its middle to `reach_s` after it; the sum stands where the first of them stood. Returns how many were added
/// to others and removed.
pub fn merge(list: &mut Vec<Echo>, wavenumber: f64, reach_s: f64) -> u64 {
    let before = list.len();
    let firsts = firsts(before, |i| Some(key(&list[i], reach_s)));
    let is_first = |i: usize| firsts[i] as usize == i;
    // Index of the sum and how much came into it, for those that are sums.
    let mut shares: FastMap<u32, f64> = FastMap::default();
    for i in (0..before).filter(|i| !is_first(*i)) {
        let (head, tail) = list.split_at_mut(i);
        let (sum, one) = (&mut head[firsts[i] as usize], &tail[0]);
        let share = shares.entry(firsts[i]).or_insert_with(|| super::strength(sum));
        *share += super::strength(one);
        let turn = Complex64::cis(-wavenumber * (one.path_length_m - sum.path_length_m));
        for (to, from) in sum.path_gain.as_flattened_mut().iter_mut().zip(one.path_gain.as_flattened()) {
            *to += from * turn;
        }
    }
    let mut numbers = 0..before;
    list.retain(|r| {
        let is_whole = |i| shares.get(&(i as u32)).is_none_or(|all| super::strength(r) > NOTHING * all);
        numbers.next().is_some_and(|i| is_first(i) && is_whole(i))
    });
    (before - list.len()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::wavenumber;

    fn echo(length: f64, gain: Complex64) -> Echo {
        let u = DVec3::new(0.8, 0.6, 0.0);
        Echo {
            path_length_m: length,
            path_rate_mps: -3.0,
            path_acceleration_and_jerk: [0.1, 0.2],
            departure: u,
            first_range_m: 0.5 * length,
            first_velocity_mps: DVec3::ZERO,
            arrival: u,
            last_range_m: 0.5 * length,
            last_velocity_mps: DVec3::ZERO,
            path_gain: [[gain, Complex64::ZERO], [Complex64::ZERO, -gain]],
            chain: [7, 0, 0, 0, 0, 0, 0, 0],
            bounces: 1,
            between_m: Box::default(),
        }
    }

    /// A length that lies in the middle of its unit, so that small changes stay in it.
    const LENGTH: f64 = 40.0;

    #[test]
    fn one_place_by_one_way_is_one_echo() {
        let k = wavenumber(77e9);
        let (a, b) = (Complex64::new(1e-3, 2e-3), Complex64::new(-0.9e-3, -2.1e-3));
        let other = Echo { chain: [8, 0, 0, 0, 0, 0, 0, 0], ..echo(LENGTH, a) };
        let faster = Echo { path_rate_mps: -3.1, ..echo(LENGTH, a) };
        let bent = Echo { path_acceleration_and_jerk: [40.0, 0.2], ..echo(LENGTH, a) };
        let off = 2e-7;
        let mut list =
            vec![echo(LENGTH, a), other.clone(), echo(LENGTH + off, b), faster.clone(), bent.clone()];
        assert_eq!(merge(&mut list, k, 0.02), 1);
        let sum = a + b * Complex64::cis(-k * off);
        assert!((list[0].path_gain[0][0] - sum).norm() < 1e-13);
        assert_eq!(list[1..], [other, faster, bent]);
        // Nothing is left to add up.
        assert_eq!(merge(&mut list, k, 0.02), 0);
    }

    #[test]
    fn what_cancels_goes() {
        let a = Complex64::new(0.3, -0.1);
        let mut list = vec![echo(LENGTH, a), echo(LENGTH + 1.0, a), echo(LENGTH, -a)];
        assert_eq!(merge(&mut list, wavenumber(77e9), 0.0), 2);
        assert_eq!(list, [echo(LENGTH + 1.0, a)]);
    }

    /// Sums do not change by a place's own phase: the same echo in thirds is the echo.
    #[test]
    fn thirds_make_a_whole() {
        let a = Complex64::new(0.3, -0.1);
        let mut list: Vec<Echo> = (0..300).map(|i| echo(LENGTH + f64::from(i % 100), a / 3.0)).collect();
        assert_eq!(merge(&mut list, wavenumber(77e9), 0.02), 200);
        for (i, r) in list.iter().enumerate() {
            assert_eq!(r.path_length_m, LENGTH + i as f64);
            assert!((r.path_gain[0][0] - a).norm() < 1e-15);
        }
    }
}
