//! Road marking filled with metal balls (Feng 2019, section 3.2.1, Table 3.2, Fig 3.4 and 3.5).
//!
//! Upper bound of its radar cross section: every ball is lit and they add up incoherently. Two limits of
//! range take from it (CONVENTIONS eq. 28): seen from a low radar, balls hide each other, and only the projected
//! area counts; and the marking is longer than a range bin, so a bin holds a share of its balls.

use super::mie::SphereSeries;
use crate::base::error::{BadInput, Result};
use crate::base::units::{db_from_power, wavenumber};
use std::f64::consts::PI;

/// A strip of road paved with balls that touch, in a square lattice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marking {
    /// Width across the road, m.
    pub width_m: f64,
    /// Length along the road, m.
    pub length_m: f64,
}

impl Marking {
    /// The marking of the document's table 3.2.
    pub const DOCUMENT: Marking = Marking { width_m: 0.15, length_m: 2.0 };

    /// Area of the strip, m².
    pub fn area_m2(&self) -> f64 {
        self.width_m * self.length_m
    }

    /// Number of balls of `radius_m`, one on each square of their diameter.
    pub fn balls(&self, radius_m: f64) -> f64 {
        self.area_m2() / (4.0 * radius_m * radius_m)
    }
}

/// Cross section of a small perfectly conducting ball, 9 (ka)^4 pi a^2, m^2 (Ruck 1970, section 3.2.1.2);
/// 0.1 dB over the series at ka = 0.32, 0.6 dB at 0.65.
pub fn rayleigh_m2(radius_m: f64, freq_hz: f64) -> f64 {
    9.0 * (wavenumber(freq_hz) * radius_m).powi(4) * optical_m2(radius_m)
}

/// Cross section of a large sphere, pi a^2, m².
pub fn optical_m2(radius_m: f64) -> f64 {
    PI * radius_m * radius_m
}

/// Cross section of a perfectly conducting sphere, m², exact (Mie series).
///
/// # Errors
/// Returns an error for a size that the Mie series does not take, or for lengths that are not positive.
pub fn mie_m2(radius_m: f64, freq_hz: f64) -> Result<f64> {
    Ok(4.0 * PI * SphereSeries::pec(radius_m, freq_hz)?.backscatter_m().norm_sqr())
}

/// Sine of the grazing angle at ground range `range_m` from a radar at `height_m`: the share of the marking
/// that a wave meets.
pub fn projection(range_m: f64, height_m: f64) -> f64 {
    height_m / height_m.hypot(range_m)
}

/// Power response of a range bin to an echo `offset` bins away, peak 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BinShape {
    /// Unweighted transform without padding: sinc^2.
    Rectangle,
    /// Hann window without padding: [sinc(x)/(1 - x^2)]^2.
    Hann,
}

impl BinShape {
    /// Response of a bin at an offset from its middle, in bins.
    pub fn response(&self, offset: f64) -> f64 {
        let sinc = |x: f64| if x.abs() < 1e-8 { 1.0 } else { (PI * x).sin() / (PI * x) };
        match self {
            BinShape::Rectangle => sinc(offset).powi(2),
            // sinc(x) + (sinc(x-1) + sinc(x+1))/2 has no pole at x = 1.
            BinShape::Hann => (sinc(offset) + 0.5 * (sinc(offset - 1.0) + sinc(offset + 1.0))).powi(2),
        }
    }

    /// Noise bandwidth in bins: the power that a bin collects of an endless marking, over that of one bin.
    pub fn noise_bandwidth(&self) -> f64 {
        match self {
            BinShape::Rectangle => 1.0,
            BinShape::Hann => 1.5,
        }
    }
}

/// Share of a marking's power that the bin in its middle collects: the mean response over its length,
/// seen along the road. `bin_m` is the bin's width, c/2B. Fails unless both lengths are positive.
///
/// # Errors
/// Returns an error for a size that the Mie series does not take, or for lengths that are not positive.
pub fn bin_share(length_m: f64, bin_m: f64, shape: BinShape) -> Result<f64> {
    for (key, value) in [("length_m", length_m), ("bin_m", bin_m)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(BadInput::new("is not a positive length").key(key).value(value).into());
        }
    }
    let half = 0.5 * length_m / bin_m;
    // Simpson's rule, 64 intervals a bin, ends at the outer side lobes beyond which 1/(pi x)^2 remains.
    let end = half.min(400.0);
    let n = 2 * (32.0 * end).ceil().max(32.0) as usize;
    let h = end / n as f64;
    let weight = |i: usize| if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
    let sum: f64 = (0..=n).map(|i| weight(i) * shape.response(i as f64 * h)).sum();
    Ok(sum * h / 3.0 / half)
}

/// One row of the table, ours beside the document's.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Radius of a ball, m.
    pub radius_m: f64,
    /// The formula that the document uses for it.
    pub region: &'static str,
    /// Number of balls on the strip.
    pub balls: f64,
    /// Cross section of one ball by Rayleigh's formula, dBsm.
    pub rayleigh_dbsm: f64,
    /// Cross section of one ball by the Mie series, dBsm.
    pub mie_dbsm: f64,
    /// Cross section of one ball by geometrical optics, dBsm.
    pub optical_dbsm: f64,
    /// All balls by the Mie series, lit and incoherent, dBsm.
    pub total_dbsm: f64,
    /// What the document prints for this radius.
    pub document: Printed,
    /// Why they differ.
    pub remark: &'static str,
}

/// The values that the document prints in its table 3.2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printed {
    /// Cross section of one ball, dBsm.
    pub ball_dbsm: f64,
    /// Number of balls.
    pub balls: f64,
    /// Cross section of the strip, dBsm.
    pub total_dbsm: f64,
}

/// Table 3.2 at `freq_hz` (the document's is 77 GHz). Fails as [`mie_m2`].
///
/// # Errors
/// Returns an error for a size that the Mie series does not take, or for lengths that are not positive.
pub fn table(marking: &Marking, freq_hz: f64) -> Result<Vec<Row>> {
    const RAYLEIGH: &str =
        "its Rayleigh values follow (64/9)(ka)^4 pi a^2 instead of 9 (ka)^4 pi a^2, 1 dB less";
    let printed = |ball_dbsm, balls, total_dbsm| Printed { ball_dbsm, balls, total_dbsm };
    [
        (0.10e-3, "Rayleigh", printed(-98.2, 7.5e6, -29.4), RAYLEIGH),
        (0.20e-3, "Rayleigh", printed(-80.2, 1.9e6, -17.5), RAYLEIGH),
        (
            0.40e-3,
            "Rayleigh",
            printed(-62.1, 9.4e5, -2.4),
            "twice the balls that fit; and (64/9)(ka)^4 pi a^2, which at ka = 0.65 is below the series",
        ),
        (
            0.62e-3,
            "Mie maximum",
            printed(-53.2, 2.0e5, -0.3),
            "4 pi a^2 is a bound; the series' first maximum is 3.6 pi a^2",
        ),
        (6.20e-3, "optical", printed(-39.2, 1950.0, -6.3), ""),
    ]
    .into_iter()
    .map(|(radius_m, region, document, remark)| {
        let balls = marking.balls(radius_m);
        let mie = mie_m2(radius_m, freq_hz)?;
        Ok(Row {
            radius_m,
            region,
            balls,
            rayleigh_dbsm: db_from_power(rayleigh_m2(radius_m, freq_hz)),
            mie_dbsm: db_from_power(mie),
            optical_dbsm: db_from_power(optical_m2(radius_m)),
            total_dbsm: db_from_power(balls * mie),
            document,
            remark,
        })
    })
    .collect()
}

/// Cross section in one range bin at ground range `range_m`, m^2 (CONVENTIONS eq. 28): all balls times the
/// projection times the bin's share. The marking has to be short against the range.
///
/// # Errors
/// Returns the errors of [`mie_m2`] and [`bin_share`].
pub fn seen_m2(
    marking: &Marking,
    radius_m: f64,
    freq_hz: f64,
    (range_m, height_m): (f64, f64),
    (bin_m, shape): (f64, BinShape),
) -> Result<f64> {
    let all = marking.balls(radius_m) * mie_m2(radius_m, freq_hz)?;
    Ok(all * projection(range_m, height_m) * bin_share(marking.length_m, bin_m, shape)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_3_2() {
        let rows = table(&Marking::DOCUMENT, 77e9).unwrap();
        for r in &rows {
            println!(
                "R {:.2} mm: {:.3e} balls, Rayleigh {:.2} Mie {:.2} optical {:.2} total {:.2} dBsm; printed {:?}",
                1e3 * r.radius_m,
                r.balls,
                r.rayleigh_dbsm,
                r.mie_dbsm,
                r.optical_dbsm,
                r.total_dbsm,
                r.document
            );
            // The document's own sums are right with its own counts.
            let own = r.document.ball_dbsm + db_from_power(r.document.balls);
            assert!((own - r.document.total_dbsm).abs() < 0.15, "{own}");
            // Its Rayleigh formula as the remark has it.
            if r.region == "Rayleigh" {
                let theirs = r.rayleigh_dbsm + db_from_power(64.0 / 81.0);
                assert!((theirs - r.document.ball_dbsm).abs() < 0.1, "{theirs}");
            }
            // Counts agree but for the row of the errata.
            let ratio = r.document.balls / r.balls;
            assert!((ratio - if r.radius_m == 0.4e-3 { 2.0 } else { 1.0 }).abs() < 0.03, "{ratio}");
        }
        // Small balls are Rayleigh's, large ones optical; the resonance lies between pi a^2 and its bound.
        assert!((rows[0].mie_dbsm - rows[0].rayleigh_dbsm).abs() < 0.2);
        assert!((rows[4].mie_dbsm - rows[4].optical_dbsm).abs() < 1.0);
        let over = rows[3].mie_dbsm - rows[3].optical_dbsm;
        assert!(over > 5.0 && over < db_from_power(4.0), "{over}");
    }

    #[test]
    fn projection_is_the_sine() {
        assert!((projection(20.0, 0.15) - (0.15f64 / 20.0).atan().sin()).abs() < 1e-15);
        assert_eq!(projection(0.0, 0.15), 1.0);
    }

    #[test]
    fn bins_collect_their_bandwidth() {
        for shape in [BinShape::Rectangle, BinShape::Hann] {
            // A long marking: noise bandwidth over length, but for what lies beyond its ends.
            let share = bin_share(50.0, 0.061, shape).unwrap();
            let expect = shape.noise_bandwidth() * 0.061 / 50.0;
            assert!((share / expect - 1.0).abs() < 1e-3, "{share} {expect}");
            // A short one is whole in it.
            assert!((bin_share(1e-4, 0.061, shape).unwrap() - 1.0).abs() < 1e-5);
            assert!((shape.response(1.0 + 1e-9) - shape.response(1.0)).abs() < 1e-7);
        }
        assert!((BinShape::Hann.response(1.0) - 0.25).abs() < 1e-12);
        assert!(bin_share(-1.0, 0.061, BinShape::Hann).is_err());
        // The document's marking in its radar's bins: a share of 1/33 with a rectangle, 15 dB.
        let db = db_from_power(bin_share(2.0, 0.061, BinShape::Rectangle).unwrap());
        assert!((db + 15.2).abs() < 0.1, "{db}");
    }

    #[test]
    fn both_limits_multiply() {
        let m = Marking::DOCUMENT;
        let seen = seen_m2(&m, 0.62e-3, 77e9, (20.0, 0.15), (0.061, BinShape::Hann)).unwrap();
        let by_hand = 0.3 / (1.24e-3f64).powi(2)
            * mie_m2(0.62e-3, 77e9).unwrap()
            * (0.15f64 / 20.0).atan().sin()
            * bin_share(2.0, 0.061, BinShape::Hann).unwrap();
        assert!((seen / by_hand - 1.0).abs() < 1e-12);
    }
}
