//! Which of the directions that an array confuses a point may have (CONVENTIONS eq. 117a): each grating lobe within the
//! directions that are searched is another candidate, unless the pattern and the SNR rule it out.

use super::ambiguity::{Ambiguity, FoldTest};
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

/// Directions that a cell has by other folds of its range rate: at most four, the likeliest first. The transmitters' slots turn with
/// the range rate, so that a wrong fold looks like another direction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ByFolds {
    /// Azimuth and elevation, rad, and likelihood over that of the fold that was taken.
    pub directions: [Option<([f64; 2], f64)>; 4],
}

impl ByFolds {
    /// Those of a test that left the range rate as it was measured.
    pub fn of(test: &FoldTest) -> ByFolds {
        let list = || test.folds.iter().zip(&test.directions);
        let own = list().find(|((fold, _), _)| *fold == 0).map_or(1.0, |((_, p), _)| *p);
        let mut directions = [None; 4];
        let others = list().filter(|((fold, p), _)| *fold != 0 && *p >= own / SURE);
        for (slot, ((_, p), (azimuth, elevation))) in directions.iter_mut().zip(others) {
            *slot = Some(([*azimuth, *elevation], (p / own.max(f64::MIN_POSITIVE)).min(SURE)));
        }
        ByFolds { directions }
    }
}

/// Directions as near to the one found as this are no others, in standard deviations and rad.
const NEAR_STD: f64 = 3.0;
const NEAR_RAD: f64 = 0.01;

impl Resolved {
    /// The same with the directions of other folds, of a point whose angles have these deviations where they are measured.
    pub fn with_ambiguities(
        mut self,
        by_folds: &ByFolds,
        lobes: &AngleLobes,
        std_rad: [Option<f64>; 2],
    ) -> Resolved {
        let mut others = Vec::new();
        for (mut at, likelihood) in by_folds.directions.iter().flatten().copied() {
            for k in 0..2 {
                at[k] =
                    if std_rad[k].is_some() && lobes.fov_rad[k] > 0.0 { at[k] } else { self.angles_rad[k] };
            }
            let is_off = |k: usize| {
                let near = (NEAR_STD * std_rad[k].unwrap_or(0.0)).max(NEAR_RAD);
                (at[k] - self.angles_rad[k]).abs() > near
            };
            if lobes.has_in_view(&at) && (is_off(0) || is_off(1)) {
                others.push((at, likelihood));
            }
        }
        if others.is_empty() {
            return self;
        }
        self.state = Ambiguity::Ambiguous;
        let total = 1.0 + others.iter().map(|(_, l)| l).sum::<f64>();
        for k in 0..2 {
            let spread: f64 = others.iter().map(|(at, l)| l * (at[k] - self.angles_rad[k]).powi(2)).sum();
            self.variance[k] += spread / total;
        }
        self.others_rad.extend(others.into_iter().map(|(at, _)| at));
        self
    }
}

impl AngleLobes {
    /// Whether a direction is among those that are searched.
    fn has_in_view(&self, angles_rad: &[f64; 2]) -> bool {
        angles_rad.iter().zip(self.fov_rad).all(|(a, fov)| fov == 0.0 || a.abs() <= fov + 1e-9)
    }

    /// The candidates for a direction with `power_w` after beamforming over the noise `noise_w` of a channel.
    pub fn resolve(&self, angles_rad: [f64; 2], power_w: f64, noise_w: f64) -> Resolved {
        let [azimuth, elevation] = angles_rad;
        let u = direction_from_angles(azimuth, elevation);
        let lobes: Vec<([f64; 2], f64)> = self
            .lobes
            .iter()
            .filter_map(|lobe| {
                let (y, z) = (u.y + lobe.sine.x, u.z + lobe.sine.y);
                let x = 1.0 - y * y - z * z;
                let (a, e) = (x > 0.0).then(|| angles_from_direction(DVec3::new(x.sqrt(), y, z)))?;
                let elevation = if self.fov_rad[1] > 0.0 { e } else { elevation };
                Some(([a, elevation], lobe.power)).filter(|(a, _)| self.has_in_view(a))
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
