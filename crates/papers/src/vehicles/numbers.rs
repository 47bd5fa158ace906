//! What a list of levels in decibels is described by, and how far it is from a distribution.

use catseye::base::units::{db_from_power, power_from_db};
use catseye_io::sensor_fit::compare::ks_p_value;
use statrs::function::erf::erfc;
use std::f64::consts::SQRT_2;

/// Description of a list of levels.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Number of levels.
    pub count: usize,
    /// The mean power, in decibels.
    pub mean_power_db: f64,
    /// The mean of the decibels.
    pub mean_db: f64,
    /// The median, dB.
    pub median_db: f64,
    /// The 5th percentile, dB.
    pub p05_db: f64,
    /// The 95th percentile, dB.
    pub p95_db: f64,
    /// Standard deviation of the decibels about their mean, with divisor n, dB.
    pub std_db: f64,
}

impl Summary {
    /// Describes levels in decibels; None for an empty list.
    pub fn of(levels_db: &[f64]) -> Option<Summary> {
        let n = levels_db.len() as f64;
        if levels_db.is_empty() {
            return None;
        }
        let mut sorted = levels_db.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let mean_db = sorted.iter().sum::<f64>() / n;
        let variance = sorted.iter().map(|x| (x - mean_db).powi(2)).sum::<f64>() / n;
        Some(Summary {
            count: sorted.len(),
            mean_power_db: db_from_power(sorted.iter().map(|x| power_from_db(*x)).sum::<f64>() / n),
            mean_db,
            median_db: percentile(&sorted, 0.5),
            p05_db: percentile(&sorted, 0.05),
            p95_db: percentile(&sorted, 0.95),
            std_db: variance.sqrt(),
        })
    }
}

/// The value that a share of an ascending list does not exceed, linear between neighbours (Hyndman and Fan 1996, definition 7); NaN
/// for an empty list.
pub fn percentile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = share.clamp(0.0, 1.0) * last as f64;
    let (i, rest) = (at.floor() as usize, at.fract());
    sorted[i] + rest * (sorted[(i + 1).min(last)] - sorted[i])
}

/// Probability that a standard normal variable does not exceed `x`.
pub fn normal_cdf(x: f64) -> f64 {
    0.5 * erfc(-x / SQRT_2)
}

/// One-sample Kolmogorov–Smirnov test.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Ks {
    /// Largest distance between the list's distribution function and the given one.
    pub distance: f64,
    /// Probability of at least this distance for independent values of that distribution (asymptotic; Stephens 1970).
    pub p_value: f64,
}

impl Ks {
    /// Compares values with a continuous distribution function; None for an empty list.
    pub fn of(values: &[f64], cdf: impl Fn(f64) -> f64) -> Option<Ks> {
        let n = values.len() as f64;
        if values.is_empty() {
            return None;
        }
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let distance = sorted.iter().enumerate().fold(0.0f64, |d, (i, x)| {
            let f = cdf(*x);
            d.max((i as f64 + 1.0) / n - f).max(f - i as f64 / n)
        });
        Some(Ks { distance, p_value: ks_p_value(distance, n) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::base::rng::Draws;

    #[test]
    fn levels_of_a_ramp_by_hand() {
        let s = Summary::of(&[4.0, 0.0, 3.0, 1.0, 2.0]).unwrap();
        assert_eq!((s.count, s.mean_db, s.median_db), (5, 2.0, 2.0));
        assert!((s.p05_db - 0.2).abs() < 1e-12 && (s.p95_db - 3.8).abs() < 1e-12, "{s:?}");
        assert!((s.std_db - 2f64.sqrt()).abs() < 1e-12, "{s:?}");
        let power = Summary::of(&[0.0, 10.0]).unwrap().mean_power_db;
        assert!((power - 10.0 * 5.5f64.log10()).abs() < 1e-12, "{power}");
        assert_eq!(Summary::of(&[]), None);
        assert!(percentile(&[], 0.5).is_nan());
    }

    #[test]
    fn normal_distribution_function_at_known_places() {
        for (x, p) in [(0.0, 0.5), (1.0, 0.841_344_746_068_543), (-1.959_963_984_540_054, 0.025)] {
            assert!((normal_cdf(x) - p).abs() < 1e-9, "{x}");
        }
    }

    /// For the middles of n equal steps the distance is half a step; a normal sample passes, and the same moved by 0.5 does not.
    #[test]
    fn kolmogorov_smirnov_of_known_samples() {
        let middles: Vec<f64> = (0..10).map(|i| 0.05 + 0.1 * f64::from(i)).collect();
        let k = Ks::of(&middles, |x| x).unwrap();
        assert!((k.distance - 0.05).abs() < 1e-12 && k.p_value > 0.999, "{k:?}");
        let one = Ks::of(&[0.9], |x| x).unwrap();
        assert!((one.distance - 0.9).abs() < 1e-12, "{one:?}");
        let mut draws = Draws::new(3, 1);
        let sample: Vec<f64> = (0..400).map(|_| draws.normal()).collect();
        let same = Ks::of(&sample, normal_cdf).unwrap();
        assert!(same.p_value > 0.01, "{same:?}");
        let moved = Ks::of(&sample, |x| normal_cdf(x - 0.5)).unwrap();
        assert!(moved.p_value < 1e-6 && moved.distance > 0.12, "{moved:?}");
        assert_eq!(Ks::of(&[], |x| x), None);
    }
}
