//! A sphere that waves enter, alone: the series of Mie, with its layers as shells (`em::mie`).

use super::{BistaticAspect, Scattering};
use crate::base::error::Result;
use crate::base::frames::{direction_from_angles, polarisation_basis};
use crate::base::units::wavenumber;
use crate::em::layers::Backing;
use crate::em::mie::{Core, Shell, SphereSeries};
use crate::geom::Surface;
use glam::DVec3;
use num_complex::Complex64;

/// The series of a sphere of this radius, m, whose front is `surface`: the layers lie inside the radius, on a core of what backs them. None
/// where the surface is not one that waves enter, or its layers fill the sphere.
///
/// # Errors
/// Returns the errors of [`SphereSeries::layered`].
pub fn series(surface: &Surface, radius_m: f64, freq_hz: f64) -> Result<Option<SphereSeries>> {
    let Backing::HalfSpace(eps_r) = surface.stack.backing else { return Ok(None) };
    let core_m = radius_m - surface.stack.thickness_m();
    if core_m <= 0.0 {
        return Ok(None);
    }
    let mut shells = Vec::with_capacity(surface.stack.layers.len());
    let mut outer_m = core_m;
    for layer in surface.stack.layers.iter().rev() {
        outer_m += layer.thickness_m;
        shells.push(Shell { radius_m: outer_m, eps_r: layer.eps_r });
    }
    SphereSeries::layered(Core::Dielectric { radius_m: core_m, eps_r }, &shells, freq_hz).map(Some)
}

/// S of a sphere at `centre` for each aspect, phases referred to the world's origin. Every bounce is in it: both conventions agree.
pub fn scattering(
    series: &SphereSeries,
    centre: DVec3,
    freq_hz: f64,
    aspects: &[BistaticAspect],
) -> Vec<Scattering> {
    let k = wavenumber(freq_hz);
    aspects
        .iter()
        .map(|a| {
            let [t, r] = [a.transmit, a.receive].map(|a| direction_from_angles(a.azimuth, a.elevation));
            let (cross, angle) = (t.cross(r), t.cross(r).length().atan2(t.dot(r)));
            // Any plane holds both directions where they are one line.
            let across = cross.try_normalize().unwrap_or_else(|| t.any_orthonormal_vector());
            let (s_across, s_along) = series.bistatic_m(angle);
            let basis = |u| {
                let (v, h) = polarisation_basis(u);
                [v, h]
            };
            let (tx, rx) = (basis(t), basis(r));
            let (along_t, along_r) = (across.cross(t), across.cross(r));
            let phase = Complex64::cis(k * (t + r).dot(centre));
            let entry = |i: usize, j: usize| {
                phase
                    * (s_across * (rx[i].dot(across) * tx[j].dot(across))
                        + s_along * (rx[i].dot(along_r) * tx[j].dot(along_t)))
            };
            let s = [0, 1].map(|i| [0, 1].map(|j| entry(i, j)));
            Scattering { every: s, last: s }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::em::layers::{Layer, Stack};
    use crate::rcs::Aspect;

    fn aspect(azimuth_deg: f64, elevation_deg: f64) -> Aspect {
        Aspect { azimuth: azimuth_deg.to_radians(), elevation: elevation_deg.to_radians() }
    }

    fn front(layers: Vec<Layer>) -> Surface {
        let eps = Complex64::new(2.19, -0.0074);
        Surface {
            stack: Stack { layers, backing: Backing::HalfSpace(eps) },
            roughness_rms_m: 0.0,
            backscatter: None,
        }
    }

    #[test]
    fn a_sphere_is_the_same_from_everywhere_and_in_both_bases() {
        let series = series(&front(Vec::new()), 5e-3, 77e9).unwrap().unwrap();
        let level = scattering(
            &series,
            DVec3::ZERO,
            77e9,
            &[BistaticAspect { transmit: aspect(0.0, 0.0), receive: aspect(50.0, 0.0) }],
        );
        // In the level plane V is across it.
        let (across, along) = series.bistatic_m(50f64.to_radians());
        assert!((level[0].every[0][0] - across).norm() < 1e-15 * across.norm());
        assert!((level[0].every[1][1] - along).norm() < 1e-15 * along.norm());
        assert!(level[0].every[0][1].norm() < 1e-15);
        for a in [aspect(0.0, 0.0), aspect(70.0, 33.0), aspect(-160.0, -80.0)] {
            let s = scattering(&series, DVec3::ZERO, 77e9, &[BistaticAspect::monostatic(a)])[0].every;
            assert!((s[0][0] - series.backscatter_m()).norm() < 1e-12 * s[0][0].norm());
            assert!(
                (s[1][1] - s[0][0]).norm() < 1e-12 * s[0][0].norm()
                    && s[0][1].norm() < 1e-12 * s[0][0].norm()
            );
        }
        // Ways exchanged, S is transposed; a shift turns the phase alone.
        let both = BistaticAspect { transmit: aspect(10.0, 20.0), receive: aspect(75.0, -5.0) };
        let back = BistaticAspect { transmit: both.receive, receive: both.transmit };
        let s = scattering(&series, DVec3::ZERO, 77e9, &[both, back]);
        let moved = scattering(&series, DVec3::new(0.1, 0.02, -0.3), 77e9, &[both]);
        for i in 0..2 {
            for j in 0..2 {
                assert!((s[0].every[i][j] - s[1].every[j][i]).norm() < 1e-12);
                assert!((s[0].every[i][j].norm() - moved[0].every[i][j].norm()).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn layers_are_shells_inside_the_radius() {
        let eps_r = Complex64::new(2.19, -0.0074);
        let plain = series(&front(Vec::new()), 5e-3, 77e9).unwrap().unwrap().backscatter_m();
        // A layer of what lies under it changes nothing; one of something else does.
        let same = series(&front(vec![Layer { eps_r, thickness_m: 1e-3 }]), 5e-3, 77e9).unwrap().unwrap();
        assert!((same.backscatter_m() - plain).norm() < 1e-9 * plain.norm());
        let other = front(vec![Layer { eps_r: Complex64::new(4.0, 0.0), thickness_m: 1e-3 }]);
        let other = series(&other, 5e-3, 77e9).unwrap().unwrap().backscatter_m();
        assert!((other - plain).norm() > 0.1 * plain.norm());
        let thick = front(vec![Layer { eps_r, thickness_m: 6e-3 }]);
        assert!(series(&thick, 5e-3, 77e9).unwrap().is_none());
    }
}
