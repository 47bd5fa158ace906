//! Directions that an array confuses: the lobes of its pattern that are nearly as high as the main lobe (Van Trees, *Optimum
//! Array Processing*, 2002, section 2.4).

use glam::{DVec2, DVec3};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// A lobe of an array's pattern beside the main lobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GratingLobe {
    /// Distance from the main lobe, as sines: of the direction's y and z components.
    pub sine: DVec2,
    /// Power over that of the main lobe.
    pub power: f64,
}

/// Power of a lobe, over that of the main lobe, from which on it counts.
const HIGH: f64 = 0.5;
/// Samples of the pattern to the width λ/D of a beam along each axis.
const PER_BEAM: f64 = 4.0;
/// Apertures below this many wavelengths do not resolve an axis.
const BLIND: f64 = 0.1;
/// Most samples along an axis: arrays of some hundred wavelengths.
const MOST: usize = 2048;

/// The lobes of half the main lobe's power and more that directions of the half space in front of the array can be confused by.
/// `elements`: place in m, and weight. Sorted by their distance from the main lobe; with each lobe the one opposite to it is listed.
pub fn grating_lobes(elements: &[(DVec3, f64)], wavenumber: f64) -> Vec<GratingLobe> {
    let wavelength_m = TAU / wavenumber;
    let aperture = |axis: usize| {
        let at = || elements.iter().map(|(p, _)| p[axis]);
        (at().fold(f64::NEG_INFINITY, f64::max) - at().fold(f64::INFINITY, f64::min)) / wavelength_m
    };
    let apertures = [aperture(1), aperture(2)];
    let total: f64 = elements.iter().map(|(_, w)| w).sum();
    let power = |s: DVec2| {
        let sum: Complex64 =
            elements.iter().map(|(p, w)| w * Complex64::cis(wavenumber * (s.x * p.y + s.y * p.z))).sum();
        sum.norm_sqr() / (total * total)
    };
    // An axis without an aperture has one sample.
    let half = apertures
        .map(|a| if a < BLIND { 0 } else { ((2.0 * PER_BEAM * a).ceil() as usize).clamp(8, MOST / 2) });
    let step = half.map(|n| if n == 0 { 0.0 } else { 2.0 / n as f64 });
    let at = |i: i64, j: i64| DVec2::new(i as f64 * step[0], j as f64 * step[1]);
    let [across, up] = half.map(|n| n as i64);
    // The pattern is even: the half with a positive y (or z on the axis) says all.
    let columns = (across + 1) as usize;
    let powers: Vec<f64> =
        (-up..=up).flat_map(|j| (0..=across).map(move |i| (i, j))).map(|(i, j)| power(at(i, j))).collect();
    let known = |i: i64, j: i64| match i < 0 {
        true => powers.get(((-j + up) as usize) * columns + (-i) as usize),
        false => powers.get(((j + up) as usize) * columns + i as usize),
    };
    let mut found: Vec<GratingLobe> = Vec::new();
    for j in -up..=up {
        for i in 0..=across {
            let s = at(i, j);
            // Not within the main lobe: a beam's width λ/D along each axis.
            let in_main = (s.x * apertures[0]).abs() < 1.0 && (s.y * apertures[1]).abs() < 1.0;
            if in_main || (i == 0 && j < 0) {
                continue;
            }
            let own = known(i, j).copied().unwrap_or(0.0);
            let inside = |i: i64, j: i64| i.abs() <= across && j.abs() <= up;
            let around = (-1..=1).flat_map(|b| (-1..=1).map(move |a| (i + a, j + b)));
            let is_top =
                around.filter(|(a, b)| inside(*a, *b)).all(|(a, b)| known(a, b).is_none_or(|p| *p <= own));
            // A sample is at most half a step off a lobe's top, where it has 0.9 of its power along each axis.
            if !is_top || own < 0.75 * HIGH {
                continue;
            }
            let (sine, power) = climbed(s, DVec2::from(step), &power);
            let is_known = found.iter().any(|f| {
                let off = f.sine - sine;
                (off.x * apertures[0]).abs() < 0.5 && (off.y * apertures[1]).abs() < 0.5
            });
            if power >= HIGH && sine.abs().max_element() <= 2.0 && !is_known {
                found.push(GratingLobe { sine, power });
            }
        }
    }
    let opposite: Vec<GratingLobe> = found
        .iter()
        .filter(|f| f.sine.x > 1e-9 || f.sine.y > 1e-9)
        .map(|f| GratingLobe { sine: -f.sine, ..*f })
        .collect();
    for lobe in opposite {
        let is_known = found.iter().any(|f| (f.sine - lobe.sine).length() < 1e-6);
        if !is_known {
            found.push(lobe);
        }
    }
    found.sort_by(|a, b| a.sine.length().total_cmp(&b.sine.length()).then(a.sine.x.total_cmp(&b.sine.x)));
    found
}

/// The top of a lobe, from near it, by steps that are halved.
fn climbed(mut s: DVec2, mut step: DVec2, power: &impl Fn(DVec2) -> f64) -> (DVec2, f64) {
    let mut best = power(s);
    for _ in 0..40 {
        let tries = [
            DVec2::new(step.x, 0.0),
            DVec2::new(-step.x, 0.0),
            DVec2::new(0.0, step.y),
            DVec2::new(0.0, -step.y),
        ];
        let moved = tries.map(|d| (s + d, power(s + d)));
        match moved.into_iter().filter(|(_, p)| *p > best).max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((to, p)) => (s, best) = (to, p),
            None => step *= 0.5,
        }
    }
    (s, best)
}

/// Half the sector about boresight, along y or z, in which no two directions are confused, rad: π/2 without lobes along that axis.
///
/// # Example
/// Elements a whole wavelength apart confuse directions whose sines differ by 1: only ±30° are unambiguous.
///
/// ```
/// use catseye::base::units::wavenumber;
/// use catseye::scene::grating_lobes::{grating_lobes, unambiguous_half_rad};
/// use glam::DVec3;
///
/// let k = wavenumber(77e9);
/// let line = |step_m: f64| (0..8).map(|i| (DVec3::Y * step_m * f64::from(i), 1.0)).collect::<Vec<_>>();
/// let lambda_m = std::f64::consts::TAU / k;
/// let half_deg = |step_m: f64| unambiguous_half_rad(&grating_lobes(&line(step_m), k), 0).to_degrees();
/// assert!((half_deg(lambda_m) - 30.0).abs() < 0.01);
/// assert!((half_deg(0.5 * lambda_m) - 90.0).abs() < 0.01);
/// ```
pub fn unambiguous_half_rad(lobes: &[GratingLobe], axis: usize) -> f64 {
    let other = 1 - axis;
    let along = lobes.iter().filter(|l| l.sine[other].abs() < l.sine[axis].abs());
    let nearest = along.map(|l| l.sine[axis].abs()).fold(f64::INFINITY, f64::min);
    (0.5 * nearest).min(1.0).asin()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(n: usize, half_wavelengths: f64, along: DVec3) -> Vec<(DVec3, f64)> {
        (0..n).map(|i| (along * (0.5 * half_wavelengths * i as f64), 1.0)).collect()
    }

    /// Wavelength 1 m. Elements d apart: lobes at whole multiples of λ/d, all as high as the main lobe.
    #[test]
    fn a_line_has_lobes_at_multiples_of_the_wavelength_over_the_spacing() {
        assert!(grating_lobes(&line(8, 0.9, DVec3::Y), TAU).iter().all(|l| l.sine.x.abs() > 2.0 - 0.2));
        for (half_wavelengths, want) in [(2.0, vec![1.0, 2.0]), (3.0, vec![2.0 / 3.0, 4.0 / 3.0, 2.0])] {
            let lobes = grating_lobes(&line(8, half_wavelengths, DVec3::Y), TAU);
            let right: Vec<f64> = lobes.iter().map(|l| l.sine.x).filter(|x| *x > 0.0).collect();
            assert_eq!(right.len(), want.len(), "{half_wavelengths}: {lobes:?}");
            assert!(right.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-6), "{right:?}");
            assert!(lobes.iter().all(|l| (l.power - 1.0).abs() < 1e-9 && l.sine.y == 0.0));
            // Each has its opposite.
            assert_eq!(lobes.len(), 2 * want.len());
            let half = unambiguous_half_rad(&lobes, 0);
            assert!((half - (0.5 * want[0]).asin()).abs() < 1e-6);
        }
        // Half a wavelength: the first is at the end of what there is, and all of the half space is unambiguous.
        let lobes = grating_lobes(&line(12, 1.0, DVec3::Y), TAU);
        assert!((unambiguous_half_rad(&lobes, 0) - std::f64::consts::FRAC_PI_2).abs() < 1e-4, "{lobes:?}");
        assert_eq!(unambiguous_half_rad(&lobes, 1), std::f64::consts::FRAC_PI_2);
    }

    /// A plane of 4 x 3 elements, a wavelength apart along y and two thirds along z.
    #[test]
    fn a_plane_has_a_lattice_of_lobes() {
        let plane: Vec<(DVec3, f64)> =
            (0..12).map(|i| (DVec3::new(0.0, f64::from(i % 4), f64::from(i / 4) / 1.5), 1.0)).collect();
        let lobes = grating_lobes(&plane, TAU);
        for (y, z) in [(1.0, 0.0), (0.0, 1.5), (1.0, 1.5), (-1.0, 1.5), (2.0, 0.0), (-2.0, -1.5)] {
            let at = DVec2::new(y, z);
            assert!(
                lobes.iter().any(|l| (l.sine - at).length() < 1e-6 && l.power > 0.999_999),
                "{at}: {lobes:?}"
            );
        }
        assert!((unambiguous_half_rad(&lobes, 1) - 0.75f64.asin()).abs() < 1e-6);
    }

    /// Minimum-redundancy spacing has no lobe of half the power; a lone element and two in one place have none either.
    #[test]
    fn uneven_lines_have_lower_lobes() {
        let uneven: Vec<(DVec3, f64)> = [0.0, 1.0, 4.0, 6.0].map(|y| (DVec3::Y * (0.5 * y), 1.0)).to_vec();
        assert!(grating_lobes(&uneven, TAU).iter().all(|l| l.power < 0.999 || l.sine.x.abs() > 1.9));
        assert!(grating_lobes(&[(DVec3::ZERO, 1.0)], TAU).is_empty());
        assert!(grating_lobes(&[(DVec3::ZERO, 1.0), (DVec3::X, 1.0)], TAU).is_empty());
    }
}
