//! Which of the directions that an array confuses a point may have (CONVENTIONS eq. 117a): each grating lobe within the
//! directions that are searched is another candidate, unless the pattern and the SNR rule it out.

use super::ambiguity::Ambiguity;
use crate::base::frames::{angles_from_direction, direction_from_angles};
use crate::scene::grating_lobes::GratingLobe;
use glam::DVec3;

/// A candidate is ruled out where it is less likely than the direction found by this factor.
const SURE: f64 = 1e3;
/// Candidates within this factor in likelihood are alike: of these the one nearest to the boresight is given.
const ALIKE: f64 = 1.1;
/// Share of a cell's power that the model of one source leaves over, for channels that are not perfectly alike and cells that hold more
/// than one scatterer.
pub(super) const MODEL_ERROR: f64 = 1e-2;

/// The directions that an array confuses.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleLobes {
    /// Lobes of the array, those beyond the searched directions left out as each point demands.
    pub lobes: Vec<GratingLobe>,
    /// Half the searched azimuths and elevations, rad; 0 for an axis that is not searched.
    pub fov_rad: [f64; 2],
    /// Sum of the squares of the beamformer's weights, which have the sum 1.
    pub noise_share: f64,
}

/// A direction, and what else it may be.
#[derive(Debug, Clone, PartialEq)]
pub struct Resolved {
    /// Azimuth and elevation, rad: the likeliest, of those alike the one nearest to the boresight.
    pub angles_rad: [f64; 2],
    /// Unambiguous where no grating lobe is within the searched directions, resolved where all are ruled out.
    pub state: Ambiguity,
    /// Azimuth and elevation of the other candidates, rad, the one nearest to the boresight first.
    pub others_rad: Vec<[f64; 2]>,
    /// What the other candidates add to the variance of azimuth and elevation, rad².
    pub variance: [f64; 2],
}

impl AngleLobes {
    /// The candidates for a direction with `power_w` after beamforming over the noise `noise_w` of a channel.
    pub fn resolve(&self, angles_rad: [f64; 2], power_w: f64, noise_w: f64) -> Resolved {
        let [azimuth, elevation] = angles_rad;
        let u = direction_from_angles(azimuth, elevation);
        let in_sector = |a: &[f64; 2]| a.iter().zip(self.fov_rad).all(|(a, fov)| a.abs() <= fov + 1e-9);
        let lobes: Vec<([f64; 2], f64)> = self
            .lobes
            .iter()
            .filter_map(|lobe| {
                let (y, z) = (u.y + lobe.sine.x, u.z + lobe.sine.y);
                let x = 1.0 - y * y - z * z;
                let (a, e) = (x > 0.0).then(|| angles_from_direction(DVec3::new(x.sqrt(), y, z)))?;
                let elevation = if self.fov_rad[1] > 0.0 { e } else { elevation };
                Some(([a, elevation], lobe.power)).filter(|(a, _)| in_sector(a))
            })
            .collect();
        if lobes.is_empty() {
            return Resolved {
                angles_rad,
                state: Ambiguity::Unambiguous,
                others_rad: vec![],
                variance: [0.0; 2],
            };
        }
        let scale = power_w / ((noise_w + MODEL_ERROR * power_w) * self.noise_share);
        let mut left: Vec<([f64; 2], f64)> = lobes
            .into_iter()
            .map(|(a, power)| (a, (-scale * (1.0 - power).max(0.0)).exp()))
            .filter(|(_, likelihood)| *likelihood >= 1.0 / SURE)
            .collect();
        if left.is_empty() {
            return Resolved {
                angles_rad,
                state: Ambiguity::Resolved,
                others_rad: vec![],
                variance: [0.0; 2],
            };
        }
        left.push((angles_rad, 1.0));
        let off = |a: &[f64; 2]| -direction_from_angles(a[0], a[1]).x;
        left.sort_by(|a, b| off(&a.0).total_cmp(&off(&b.0)));
        let chosen = left.iter().position(|(_, l)| *l >= 1.0 / ALIKE).unwrap_or(0);
        let (best, _) = left.remove(chosen);
        let total: f64 = 1.0 + left.iter().map(|(_, l)| l).sum::<f64>();
        let variance =
            [0, 1].map(|k| left.iter().map(|(a, l)| l * (a[k] - best[k]).powi(2)).sum::<f64>() / total);
        let others_rad = left.into_iter().map(|(a, _)| a).collect();
        Resolved { angles_rad: best, state: Ambiguity::Ambiguous, others_rad, variance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    /// Elements a wavelength apart: sines known but for whole numbers.
    fn sparse(power: f64) -> AngleLobes {
        let lobes = [1.0, -1.0].map(|x| GratingLobe { sine: DVec2::new(x, 0.0), power }).to_vec();
        AngleLobes { lobes, fov_rad: [70f64.to_radians(), 0.0], noise_share: 0.125 }
    }

    #[test]
    fn equal_lobes_are_ambiguous_and_the_nearest_to_boresight_is_given() {
        for true_deg in [5.0f64, 20.0, -20.0, 29.0] {
            let seen = true_deg.to_radians().sin() - true_deg.signum();
            for azimuth in [true_deg.to_radians(), seen.asin()] {
                let found = sparse(1.0).resolve([azimuth, 0.0], 1e-9, 1e-12);
                assert_eq!((found.state, found.others_rad.len()), (Ambiguity::Ambiguous, 1));
                assert!((found.angles_rad[0] - true_deg.to_radians()).abs() < 1e-9, "{true_deg}");
                assert!((found.others_rad[0][0] - seen.asin()).abs() < 1e-9);
                // Half the squared distance: two candidates alike.
                let want = 0.5 * (true_deg.to_radians() - seen.asin()).powi(2);
                assert!((found.variance[0] / want - 1.0).abs() < 1e-9 && found.variance[1] == 0.0);
            }
        }
        // Outside of the searched sector there is none.
        let straight = AngleLobes { fov_rad: [0.3, 0.0], ..sparse(1.0) };
        assert_eq!(straight.resolve([0.1, 0.0], 1e-9, 1e-12).state, Ambiguity::Unambiguous);
    }

    #[test]
    fn lower_lobes_are_ruled_out_by_the_snr() {
        let found = sparse(0.7).resolve([0.2, 0.0], 1e-9, 1e-12);
        assert_eq!((found.state, found.variance), (Ambiguity::Resolved, [0.0; 2]));
        // SNR 0 dB in a channel: e^(−0.3·8/1.01) is 9 %, and the direction found stays.
        let weak = sparse(0.7).resolve([-0.9, 0.0], 1e-12, 1e-12);
        assert_eq!((weak.state, weak.angles_rad[0]), (Ambiguity::Ambiguous, -0.9));
        let share = (-0.3f64 * 8.0 / 1.01).exp();
        let other = (1.0 - 0.9f64.sin()).asin();
        let want = share / (1.0 + share) * (other + 0.9).powi(2);
        assert!((weak.variance[0] / want - 1.0).abs() < 1e-9);
    }
}
