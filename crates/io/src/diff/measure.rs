//! Comparison of two numbers of a column or key, by the unit at the end of its name.

use super::differences::Tolerances;

/// Magnitude below which a number counts as zero where only the ratio counts.
const ZERO: f64 = 1e-12;

#[derive(Debug, Clone, Copy, PartialEq)]
enum How {
    Absolute,
    /// Angles in degrees, modulo 360.
    Angle,
    /// Powers, compared by their ratio in dB.
    Ratio,
    /// Difference divided by the larger of the two, or by this value where it is larger still.
    Relative(f64),
}

/// Method of comparing the numbers of one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    how: How,
    allowed: f64,
    unit: &'static str,
    /// Whether whole numbers have to be equal, as counts and identifiers do.
    exact_counts: bool,
}

/// Distance of two numbers, and the allowed distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apart {
    /// Distance; infinite where one of the two is not finite.
    pub apart: f64,
    /// Allowed distance; 0 for counts and identifiers.
    pub allowed: f64,
    /// Unit of both distances.
    pub unit: &'static str,
}

impl Apart {
    /// Whether the distance is more than is allowed.
    pub fn is_too_far(&self) -> bool {
        self.apart > self.allowed
    }
}

impl Measure {
    /// The measure for the name of a column or key.
    pub fn of(name: &str, t: &Tolerances) -> Measure {
        let ends = |ends: &[&str]| ends.iter().any(|e| name.ends_with(e));
        let new = |how, allowed, unit| Measure { how, allowed, unit, exact_counts: false };
        match () {
            () if ends(&["_db", "_dbm", "_dbsm"]) => new(How::Absolute, t.tolerance_db, "dB"),
            () if ends(&["_w"]) => new(How::Ratio, t.tolerance_db, "dB"),
            () if ends(&["_m"]) => new(How::Absolute, t.tolerance_m, "m"),
            () if ends(&["_mps"]) => new(How::Absolute, t.tolerance_mps, "m/s"),
            () if ends(&["_deg"]) => new(How::Angle, t.tolerance_deg, "deg"),
            // The parts of a quaternion are those of a length of 1.
            () if name.contains("rotation") => new(How::Relative(1.0), t.relative, "relative"),
            () => Measure { exact_counts: !ends(&["_s", "_hz"]), ..Measure::relative(t) },
        }
    }

    /// The measure for levels in dB, whatever the name.
    pub fn level(t: &Tolerances) -> Measure {
        Measure { how: How::Absolute, allowed: t.tolerance_db, unit: "dB", exact_counts: false }
    }

    /// The measure by the difference divided by the larger of the two.
    pub fn relative(t: &Tolerances) -> Measure {
        Measure { how: How::Relative(0.0), allowed: t.relative, unit: "relative", exact_counts: false }
    }

    /// Distance of two numbers. `scale` is the size of what they are parts of, as the length of a vector; 0
    /// for none. NaN has the distance 0 from NaN, and an infinite one from numbers.
    pub fn apart(&self, a: f64, b: f64, scale: f64) -> Apart {
        let all = |apart| Apart { apart, allowed: self.allowed, unit: self.unit };
        if a == b || (a.is_nan() && b.is_nan()) {
            return all(0.0);
        }
        // A non-finite distance passes no finite tolerance.
        if !a.is_finite() || !b.is_finite() {
            return all(f64::INFINITY);
        }
        let d = (a - b).abs();
        match self.how {
            How::Absolute => all(d),
            How::Angle => {
                let turn = d % 360.0;
                all(turn.min(360.0 - turn))
            }
            How::Ratio if a > 0.0 && b > 0.0 => all(10.0 * (a / b).log10().abs()),
            How::Ratio => all(f64::INFINITY),
            How::Relative(_) if self.exact_counts && a.fract() == 0.0 && b.fract() == 0.0 => Apart {
                apart: d,
                allowed: if self.allowed.is_finite() { 0.0 } else { f64::INFINITY },
                unit: "",
            },
            How::Relative(least) => {
                all(if d <= ZERO { 0.0 } else { d / a.abs().max(b.abs()).max(scale).max(least) })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_decides() {
        let t = Tolerances::default();
        let far = |name: &str, a: f64, b: f64| Measure::of(name, &t).apart(a, b, 0.0).is_too_far();
        assert!(!far("rcs_dbsm", 1.0, 1.09) && far("rcs_dbsm", 1.0, 1.11));
        assert!(
            !far("power_w", 1e-20, 1.02e-20) && far("power_w", 1e-20, 1.03e-20) && far("power_w", 0.0, 1e-20)
        );
        assert!(!far("azimuth_deg", 179.98, -179.98) && far("azimuth_deg", 10.0, 10.2));
        assert!(!far("rotation_x", 0.0, 1e-4) && far("rotation_x", 0.0, 1e-2));
        assert!(
            far("object_id", 5000.0, 5001.0) && far("points", 5000.0, 5001.0) && !far("share", 0.5, 0.5001)
        );
        assert!(!far("carrier_hz", 77e9, 77.01e9) && far("carrier_hz", 77e9, 78e9));
        assert!(!far("x", f64::NAN, f64::NAN) && far("x", f64::NAN, 1.0) && far("x_db", f64::INFINITY, 1.0));
        assert!(!far("x_db", f64::NEG_INFINITY, f64::NEG_INFINITY));
        // Infinite: anything passes.
        let t = Tolerances { relative: f64::INFINITY, tolerance_db: f64::INFINITY, ..t };
        let far = |name: &str, a: f64, b: f64| Measure::of(name, &t).apart(a, b, 0.0).is_too_far();
        assert!(!far("object_id", 1.0, 2.0) && !far("rcs_dbsm", f64::NAN, 2.0));
    }
}
