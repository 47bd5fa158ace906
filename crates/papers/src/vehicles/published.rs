//! Published cross sections of road users, with where each figure was read.
//!
//! Only figures that were read in a source are here. For vans, trucks, motorcycles and children, and for where on a body radars find
//! points, none was found that could be read and cited.

use super::numbers::{Summary, normal_cdf};
use catseye::base::units::{db_from_power, power_from_db};
use catseye::road::vehicle::Kind;
use std::f64::consts::LN_10;

/// A lobe of a vehicle's mean cross section.
struct Lobe {
    azimuth_deg: f64,
    azimuth_width_deg: f64,
    zenith_deg: f64,
    zenith_width_deg: f64,
    peak_dbsm: f64,
    depth_db: f64,
}

const fn lobe(azimuth: [f64; 2], zenith: [f64; 2], peak_dbsm: f64, depth_db: f64) -> Lobe {
    Lobe {
        azimuth_deg: azimuth[0],
        azimuth_width_deg: azimuth[1],
        zenith_deg: zenith[0],
        zenith_width_deg: zenith[1],
        peak_dbsm,
        depth_db,
    }
}

/// 3GPP TR 38.901 V19.4.0, table 7.9.2.1-4: front, left, back and right, each for the quarter about it. The roof's lobe begins 60
/// degrees above the road, where no radar of a car stands.
const VEHICLE: [Lobe; 4] = [
    lobe([0.0, 40.54], [71.75, 29.13], 15.52, 8.45),
    lobe([90.0, 26.90], [79.70, 44.42], 20.75, 13.68),
    lobe([180.0, 36.32], [79.65, 36.73], 14.56, 7.50),
    lobe([270.0, 26.90], [79.70, 44.42], 20.75, 13.68),
];

/// How the mean cross section depends on the direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Law {
    /// Four lobes.
    Vehicle,
    /// One level.
    Human,
    /// Three levels by the angle from the road's direction.
    Bicycle,
}

/// What is published of a kind of road user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    law: Law,
    /// Standard deviation of the decibels about the law, dB, of a log-normal distribution whose mean power the law gives; None where
    /// only mean levels are published.
    pub sigma_db: Option<f64>,
    /// Title, year and table.
    pub source: &'static str,
    /// Band and circumstances of the figures, where they differ from ours.
    pub caveat: &'static str,
    /// Address of the page on which the figures were read.
    pub page: &'static str,
}

/// The model as Sionna RT documents it. The figures were read in the tables of Sionna RT and of a program by NIST (2025), which agree.
const PAGE_3GPP: &str = "https://nvlabs.github.io/sionna/rt/api/rcs.html";
const BELOW: &str = "a channel model for 0.5 to 52.6 GHz, far field";

/// What is published of a kind; None where nothing was found that could be read and cited.
pub fn published(kind: Kind) -> Option<Published> {
    match kind {
        Kind::Sedan | Kind::Hatchback | Kind::Suv => Some(Published {
            law: Law::Vehicle,
            sigma_db: Some(3.41),
            source: "3GPP TR 38.901 V19.4.0 (Release 19), table 7.9.2.1-4",
            caveat: BELOW,
            page: PAGE_3GPP,
        }),
        Kind::Pedestrian => Some(Published {
            law: Law::Human,
            sigma_db: Some(3.94),
            source: "3GPP TR 38.901 V19.4.0 (Release 19), table 7.9.2.1-1",
            caveat: BELOW,
            page: PAGE_3GPP,
        }),
        Kind::Cyclist => Some(Published {
            law: Law::Bicycle,
            sigma_db: None,
            source: "Belgiovane and Chen, Bicycles and Human Riders Backscattering at 77 GHz for Automotive Radar (EuCAP 2016)",
            caveat: "77 GHz, read at second hand in the function bicyclistrcs of the Radar Toolbox (2019), which calls them mean values of bicycle sectors",
            page: "https://mathworks.com/help/radar/ref/backscatterbicyclist.html",
        }),
        Kind::Van | Kind::Truck | Kind::SemiTrailer | Kind::Motorcycle | Kind::Child => None,
    }
}

impl Published {
    /// Mean cross section, dBsm, seen from an azimuth (0 from the front, 90 from the left) and a zenith angle, degrees.
    pub fn mean_dbsm(&self, azimuth_deg: f64, zenith_deg: f64) -> f64 {
        let azimuth = azimuth_deg.rem_euclid(360.0);
        match self.law {
            Law::Human => -1.37,
            Law::Bicycle => match azimuth.min(360.0 - azimuth).min((azimuth - 180.0).abs()) {
                a if a <= 30.0 => -11.57,
                a if a <= 60.0 => -13.24,
                _ => -8.1,
            },
            Law::Vehicle => {
                let quarter = (((azimuth + 45.0) / 90.0).floor() as usize) % 4;
                let l = &VEHICLE[quarter];
                let off = (azimuth - l.azimuth_deg + 180.0).rem_euclid(360.0) - 180.0;
                let down = |off: f64, width: f64| (12.0 * (off / width).powi(2)).min(l.depth_db);
                let both =
                    down(off, l.azimuth_width_deg) + down(zenith_deg - l.zenith_deg, l.zenith_width_deg);
                l.peak_dbsm - both.min(l.depth_db)
            }
        }
    }

    /// Median of the decibels in a direction: a log-normal variable's mean power lies ln(10)/20 times its variance above it.
    pub fn median_dbsm(&self, azimuth_deg: f64, zenith_deg: f64) -> f64 {
        let sigma = self.sigma_db.unwrap_or(0.0);
        self.mean_dbsm(azimuth_deg, zenith_deg) - LN_10 / 20.0 * sigma * sigma
    }

    /// What the law expects of levels from these directions, as (azimuth, zenith) in degrees. None without a direction or where no
    /// scatter is published.
    pub fn expected(&self, directions_deg: &[[f64; 2]]) -> Option<Summary> {
        let sigma = self.sigma_db?;
        let n = directions_deg.len() as f64;
        let medians: Vec<f64> = directions_deg.iter().map(|d| self.median_dbsm(d[0], d[1])).collect();
        let middle = Summary::of(&medians)?;
        let below = |x: f64| medians.iter().map(|m| normal_cdf((x - m) / sigma)).sum::<f64>() / n;
        let level = |share: f64| {
            let (mut lo, mut hi) = (middle.p05_db - 20.0 * sigma, middle.p95_db + 20.0 * sigma);
            // Eighty halvings leave less than the last digit.
            for _ in 0..80 {
                let x = 0.5 * (lo + hi);
                if below(x) < share { lo = x } else { hi = x }
            }
            0.5 * (lo + hi)
        };
        Some(Summary {
            count: medians.len(),
            mean_power_db: self.expected_mean_dbsm(directions_deg)?,
            mean_db: middle.mean_db,
            median_db: level(0.5),
            p05_db: level(0.05),
            p95_db: level(0.95),
            std_db: middle.std_db.hypot(sigma),
        })
    }

    /// Mean power over these directions, in dBsm; None without one.
    pub fn expected_mean_dbsm(&self, directions_deg: &[[f64; 2]]) -> Option<f64> {
        let sum: f64 = directions_deg.iter().map(|d| power_from_db(self.mean_dbsm(d[0], d[1]))).sum();
        (!directions_deg.is_empty()).then(|| db_from_power(sum / directions_deg.len() as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::base::rng::Draws;

    /// Peaks and floors of the table, its quarters' borders, and its symmetry.
    #[test]
    fn a_vehicle_has_four_lobes() {
        let p = published(Kind::Sedan).unwrap();
        assert!((p.mean_dbsm(90.0, 79.70) - 20.75).abs() < 1e-12);
        assert!((p.mean_dbsm(-90.0, 79.70) - 20.75).abs() < 1e-12);
        assert!((p.mean_dbsm(180.0, 79.65) - 14.56).abs() < 1e-12);
        assert!((p.mean_dbsm(360.0, 71.75) - 15.52).abs() < 1e-12);
        // Half the width off the peak is 3 dB down.
        assert!((p.mean_dbsm(90.0 + 13.45, 79.70) - 17.75).abs() < 1e-9);
        for between in [44.0, 46.0, 134.0, 136.0, 226.0, 314.0] {
            assert!((p.mean_dbsm(between, 79.7) - 7.07).abs() < 0.011, "{between}");
        }
        for a in 0..180 {
            let a = f64::from(a) + 0.5;
            assert!((p.mean_dbsm(a, 90.0) - p.mean_dbsm(-a, 90.0)).abs() < 1e-12, "{a}");
        }
    }

    #[test]
    fn a_cyclist_has_three_levels() {
        let p = published(Kind::Cyclist).unwrap();
        let at = |a: f64| p.mean_dbsm(a, 90.0);
        assert_eq!(
            [at(0.0), at(45.0), at(90.0), at(135.0), at(180.0)],
            [-11.57, -13.24, -8.1, -13.24, -11.57]
        );
        assert_eq!([at(-10.0), at(-45.0), at(270.0)], [-11.57, -13.24, -8.1]);
        assert_eq!(p.expected(&[[0.0, 90.0]]), None);
    }

    /// One direction has the log-normal distribution's own numbers; many have those of draws from the law.
    #[test]
    fn expected_numbers_are_those_of_draws() {
        let human = published(Kind::Pedestrian).unwrap();
        let e = human.expected(&[[10.0, 90.0]]).unwrap();
        let median = -1.37 - LN_10 / 20.0 * 3.94 * 3.94;
        assert!((e.median_db - median).abs() < 1e-9 && (e.mean_power_db + 1.37).abs() < 1e-9, "{e:?}");
        assert!((e.p95_db - median - 1.644_853_627 * 3.94).abs() < 1e-6, "{e:?}");
        let car = published(Kind::Suv).unwrap();
        let around: Vec<[f64; 2]> = (0..72).map(|i| [5.0 * f64::from(i), 90.0]).collect();
        let e = car.expected(&around).unwrap();
        let mut draws = Draws::new(5, 0);
        let drawn: Vec<f64> = (around.iter().cycle().take(72 * 2000))
            .map(|d| car.median_dbsm(d[0], d[1]) + 3.41 * draws.normal())
            .collect();
        let d = Summary::of(&drawn).unwrap();
        for (a, b) in [
            (e.mean_power_db, d.mean_power_db),
            (e.mean_db, d.mean_db),
            (e.median_db, d.median_db),
            (e.p05_db, d.p05_db),
            (e.p95_db, d.p95_db),
            (e.std_db, d.std_db),
        ] {
            assert!((a - b).abs() < 0.08, "{e:?} {d:?}");
        }
    }
}
