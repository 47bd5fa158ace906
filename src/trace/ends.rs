//! End terms of a tube's footprint (CONVENTIONS eq. 6a). Both engines decide and emit by these rules.

use super::Return;
use glam::DVec3;
use num_complex::Complex64;

/// Phase gradient, in wavenumbers, above which an end term is taken instead of the whole footprint:
/// 0.1 is three degrees off the mirror direction, where an end term is already small.
pub const STEEP: f64 = 0.1;
/// Half the phase across a footprint above which its two ends are separate echoes, rad: they lie apart in
/// range, and only so does their difference hold over the whole band of the radar.
const APART: f64 = 1.0;

/// The edge of the tube along which end terms are taken. It has to be the same for all tubes on one
/// patch, or end terms would not cancel; the phase changes fastest along elevation on what lies, along
/// azimuth on what stands.
pub fn end_axis(normal: DVec3) -> usize {
    if normal.z.abs() > std::f64::consts::FRAC_1_SQRT_2 { 1 } else { 0 }
}

/// Which ends of a footprint stay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    Both,
    Lower,
    Upper,
}

impl Ends {
    /// From whether the lit patch goes on beyond the lower and the upper end; None when nothing stays.
    pub fn of(goes_on: [bool; 2]) -> Option<Ends> {
        match goes_on {
            [true, true] => None,
            [true, false] => Some(Ends::Upper),
            [false, true] => Some(Ends::Lower),
            [false, false] => Some(Ends::Both),
        }
    }

    /// Emits the echoes of a footprint: `r` is its middle without the sinc of `x`, half the phase across it
    /// from the lower end to the upper.
    ///
    /// sinc x = (e^{jx} - e^{-jx}) / 2jx: the first term is the lower end, whose path is shorter by x/k, the
    /// second the upper.
    pub fn emit(self, r: Return, x: f64, wavenumber: f64, out: &mut Vec<Return>) {
        let end = |sign: f64| {
            let mut e = r.clone();
            let factor = Complex64::new(0.0, -0.5 * sign / x);
            e.spread = e.spread.map(|row| row.map(|z| z * factor));
            let shift = -sign * x / wavenumber;
            e.path_length_m += shift;
            e.first_range_m += 0.5 * shift;
            e.last_range_m += 0.5 * shift;
            e
        };
        match self {
            Ends::Lower => out.push(end(1.0)),
            Ends::Upper => out.push(end(-1.0)),
            Ends::Both if x.abs() > APART => out.extend([end(1.0), end(-1.0)]),
            Ends::Both => {
                let mut e = r;
                let sinc = if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x };
                e.spread = e.spread.map(|row| row.map(|z| z * sinc));
                out.push(e);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::MAX_BOUNCES;

    #[test]
    fn ends_add_up_to_the_footprint() {
        let k = 1613.8;
        for x in [-7.3, -0.4, 1e-6, 0.9, 1.1, 40.0] {
            let r = Return {
                path_length_m: 10.0,
                path_rate_mps: 0.0,
                departure: DVec3::X,
                first_range_m: 5.0,
                arrival: DVec3::X,
                last_range_m: 5.0,
                spread: [[Complex64::ONE; 2]; 2],
                chain: [0; MAX_BOUNCES],
                bounces: 1,
            };
            let sum = |ends: &[Ends]| -> Complex64 {
                let mut out = Vec::new();
                for e in ends {
                    e.emit(r.clone(), x, k, &mut out);
                }
                out.iter().map(|r| r.spread[0][1] * Complex64::cis(-k * (r.path_length_m - 10.0))).sum()
            };
            let whole = sum(&[Ends::Both]);
            assert!((whole - x.sin() / x).norm() < 1e-9, "{x} {whole}");
            // Each end is large where the phase hardly changes: relative to that.
            let parts = sum(&[Ends::Lower, Ends::Upper]);
            assert!((parts - whole).norm() < 1e-9 * (1.0 + 1.0 / x.abs()), "{x} {parts}");
        }
        assert_eq!(Ends::of([true, true]), None);
        assert_eq!(Ends::of([true, false]), Some(Ends::Upper));
    }
}
