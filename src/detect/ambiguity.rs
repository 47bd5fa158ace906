//! Range rates beyond what one burst can tell: transmitters in turn and empty Doppler bands, and what each
//! range rate is known by (CONVENTIONS eq. 118).

use crate::base::error::{BadInput, Result};
use crate::base::frames::direction_from_angles;
use crate::scene::radar::Radar;
use glam::{DMat2, DVec2, DVec3};
use num_complex::Complex64;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// How far a point's range rate (or its pair of range and range rate) can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ambiguity {
    /// Nothing within the limits of speed folds onto anything else.
    Unambiguous,
    /// It could have been several values, and all others within ±[`FASTEST_MPS`] were ruled out (eq. 118a).
    Resolved,
    /// It is what something that stands gives at the radar's own speed, which decided among values that the radar itself cannot
    /// tell apart.
    #[serde(rename = "ego_speed")]
    EgoSpeed,
    /// Several values are left, whole multiples of the point's `modulo_mps` apart; the likeliest is given, of those that look
    /// alike the slowest.
    Ambiguous,
    /// Nothing was tried, or nothing fits: the value is as measured.
    Unresolved,
}

impl Ambiguity {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        match self {
            Ambiguity::Unambiguous => "unambiguous",
            Ambiguity::Resolved => "resolved",
            Ambiguity::EgoSpeed => "ego_speed",
            Ambiguity::Ambiguous => "ambiguous",
            Ambiguity::Unresolved => "unresolved",
        }
    }

    /// Whether one value was found to be right.
    pub fn is_settled(self) -> bool {
        matches!(self, Ambiguity::Unambiguous | Ambiguity::Resolved | Ambiguity::EgoSpeed)
    }

    /// `ambig_state` of nuScenes' radar files: 1 ambiguous, 3 unambiguous, 4 a candidate for something that stands.
    pub fn ambig_state(self) -> u8 {
        match self {
            Ambiguity::Unambiguous | Ambiguity::Resolved => 3,
            Ambiguity::EgoSpeed => 4,
            Ambiguity::Ambiguous | Ambiguity::Unresolved => 1,
        }
    }
}

/// A range rate known up to whole multiples of `ambiguity_mps` (λ/2T for chirps T apart).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Folded {
    /// The range rate as measured, m/s.
    pub range_rate_mps: f64,
    /// What it may be off by a multiple of, m/s.
    pub ambiguity_mps: f64,
    /// Standard deviation, m/s.
    pub std_mps: f64,
}

/// A radar that moves among things that stand, whose range rate it knows from their direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// The radar's own, in its frame, m/s.
    pub velocity_mps: DVec3,
    /// Largest difference of a range rate that still counts as standing, m/s.
    pub tolerance_mps: f64,
}

impl Standing {
    /// For a radar that moves at `velocity_mps` in its own frame.
    pub fn seen_by(radar: &Radar, velocity_mps: DVec3) -> Standing {
        // A body's peak is as wide as the burst is short, and its direction is not exact either.
        let cell_mps = 2.0 * radar.max_velocity_mps() / radar.chirps as f64;
        Standing { velocity_mps, tolerance_mps: 1.5 * cell_mps + 0.01 * velocity_mps.length() }
    }

    /// How many times `modulo_mps` a range rate seen at (azimuth, elevation) has to grow to be that of something that stands; None
    /// where no multiple is near. Where rates that are near come often the tolerance is an eighth of them.
    pub fn fold(
        &self,
        range_rate_mps: f64,
        (azimuth, elevation): (f64, f64),
        modulo_mps: f64,
    ) -> Option<f64> {
        let missing = -self.velocity_mps.dot(direction_from_angles(azimuth, elevation)) - range_rate_mps;
        let folds = (missing / modulo_mps).round();
        let off = (missing - folds * modulo_mps).abs();
        (off <= self.tolerance_mps.min(modulo_mps / 8.0)).then_some(folds)
    }
}

pub use crate::scene::radar_figures::FASTEST_MPS;

/// Whether a range rate known but for multiples of `modulo_mps` is the only one of them within ±[`FASTEST_MPS`].
pub fn is_alone(range_rate_mps: f64, modulo_mps: f64) -> bool {
    if !modulo_mps.is_finite() {
        return true;
    }
    let slowest = range_rate_mps - modulo_mps * (range_rate_mps / modulo_mps).round();
    let second = modulo_mps - slowest.abs();
    (range_rate_mps - slowest).abs() < 0.5 * modulo_mps && second > FASTEST_MPS
}

/// Whether a range rate known but for multiples of `modulo_mps` is known better than one ramp's Doppler map tells, in which it is known
/// but for twice the `max_velocity_mps` of its edge. Half as much again keeps rounding out: the next modulus is twice as wide.
pub fn is_unfolded(modulo_mps: f64, max_velocity_mps: f64) -> bool {
    modulo_mps.is_finite() && modulo_mps > 3.0 * max_velocity_mps
}

/// Power of the weakest transmitter's band over the mean of all, of one body.
const ALIKE: f64 = 0.4;

/// The test of folds by empty Doppler bands. `empty_w`: mean power of a channel in the bands that the chosen fold says are empty;
/// `second_w`: the same of the best other fold; `values`: bands times receivers that these are means of; `noise_w`: of a channel.
/// Both are noise if the fold is right, and e^{−n(second − empty)/noise} is how likely the other one is beside it. Unresolved
/// where what should be empty is more than noise; the other fold is ruled out at 10⁻⁵. Several bodies in the cell show in bands
/// that are not alike: with less than 0.4 of the others' mean in one of them (`least_share`) it is Ambiguous.
pub fn empty_bands(least_share: f64, empty_w: f64, second_w: f64, values: usize, noise_w: f64) -> Ambiguity {
    let n = values as f64;
    let is_noise =
        ChiSquared::new(2.0 * n).is_ok_and(|chi| 2.0 * n * empty_w / noise_w <= chi.inverse_cdf(AGREEMENT));
    match is_noise {
        false => Ambiguity::Unresolved,
        true if least_share < ALIKE => Ambiguity::Ambiguous,
        true if n * (second_w - empty_w) / noise_w >= -(1.0 - SURE_OF_ANOTHER).ln() => Ambiguity::Resolved,
        true => Ambiguity::Ambiguous,
    }
}

/// Power of a beam, and its direction (azimuth, elevation).
type Beam = (f64, (f64, f64));

/// Probability with which what is left of one body passes as noise.
const AGREEMENT: f64 = 0.999;
/// A peak's row is as that of one body to this share of a cell, which more than one scatterer of it makes uncertain.
pub(super) const ROW_CELLS: f64 = 0.1;

/// Probability from which a fold is taken: the one that was measured, another one.
const SURE: f64 = 0.999;
const SURE_OF_ANOTHER: f64 = 0.999_99;
/// Probability up to which a fold is out of the question.
const RULED_OUT: f64 = 1e-3;

/// The test of folds of a radar whose transmitters send in slots T_c apart, in turn (TDM) or all in each with signs of a code (BPM), in
/// loops of T_loop (as many T_c as there are slots with one ramp, more where other ramps follow). Between slots a body that is q
/// ambiguities λ/(2T_loop) faster has turned by q T_c/T_loop more, so that
/// only the right fold, taken out by eq. 19, leaves a plane wave on the array. Rates λ/(2T_c) apart look alike: the folds within
/// ±λ/(4T_c) are tried.
#[derive(Debug, Clone, PartialEq)]
pub struct SlotFolds {
    transmitters: usize,
    wavenumber: f64,
    chirp_period_s: f64,
    loop_period_s: f64,
    channels: Vec<(DVec3, usize)>,
    directions: Vec<(f64, f64)>,
    /// e^{+jk u·p} by direction, `[direction, channel]`.
    steering: Vec<Complex64>,
    code: Option<Code>,
}

/// Signs with which transmitters send at once.
#[derive(Debug, Clone, PartialEq)]
struct Code {
    receivers: usize,
    slots: usize,
    /// `[slot, transmitter]`, columns orthogonal.
    signs: Vec<f64>,
}

/// Result of the test of one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct FoldTest {
    /// Range rate as measured, plus the likeliest number of ambiguities unless unresolved, m/s; of rates λ/(2T_c)
    /// apart, which look alike, the slowest.
    pub range_rate_mps: f64,
    /// Resolved when the fold is found and no rate λ/(2T_c) from it lies within ±[`FASTEST_MPS`].
    pub state: Ambiguity,
    /// Whether the array tells the fold among those within ±λ/(4T_c): the direction and the rate but for multiples of λ/(2T_c)
    /// are then certain.
    pub is_found: bool,
    /// The radar itself knows the rate but for multiples of this: λ/(2T_c) where the array tells the folds apart and the loop
    /// is a whole number of turns, else λ/(2T_loop).
    pub modulo_mps: f64,
    /// Numbers of ambiguities that were tried, with the posterior probability of each, likeliest first.
    pub folds: Vec<(i32, f64)>,
    /// Azimuth and elevation that each of `folds` gives the body, rad.
    pub directions: Vec<(f64, f64)>,
}

impl SlotFolds {
    /// `channels`: position p_tx + p_rx and transmitter's turn of each; `chirp_period_s`: from one turn to the next;
    /// `loop_period_s`: from a transmitter's turn to its next one with the same ramp; `directions`: (azimuth,
    /// elevation) that bodies may stand in, two or more to a beamwidth.
    ///
    /// # Errors
    /// Returns an error if there are no channels or directions, for a turn beyond `transmitters`, or for a loop that
    /// the turns do not fit into.
    pub fn new(
        channels: &[(DVec3, usize)],
        transmitters: usize,
        wavenumber: f64,
        [chirp_period_s, loop_period_s]: [f64; 2],
        directions: &[(f64, f64)],
    ) -> Result<SlotFolds> {
        let problem = if channels.is_empty() {
            Some("there are no channels")
        } else if directions.is_empty() {
            Some("there are no directions")
        } else if channels.iter().any(|(_, slot)| *slot >= transmitters) {
            Some("a channel belongs to a transmitter without a chirp in the loop")
        } else if !(chirp_period_s > 0.0
            && loop_period_s.is_finite()
            && loop_period_s >= transmitters as f64 * chirp_period_s * (1.0 - 1e-9))
        {
            Some("the loop is shorter than the chirps of its transmitters")
        } else {
            None
        };
        if let Some(problem) = problem {
            return Err(BadInput::new(problem).key("ambiguity test").into());
        }
        let steering = directions
            .iter()
            .flat_map(|(a, e)| {
                let u = direction_from_angles(*a, *e);
                channels.iter().map(move |(p, _)| Complex64::cis(wavenumber * u.dot(*p)))
            })
            .collect();
        Ok(SlotFolds {
            transmitters,
            wavenumber,
            chirp_period_s,
            loop_period_s,
            channels: channels.to_vec(),
            directions: directions.to_vec(),
            steering,
            code: None,
        })
    }

    /// The same for transmitters that send at once, with `signs` `[slot, transmitter]` whose columns are orthogonal. Channels are
    /// `[transmitter, receiver]`, and snapshots `[slot, receiver]`.
    #[must_use]
    pub fn coded(self, signs: Vec<f64>) -> SlotFolds {
        let receivers = self.channels.len() / self.transmitters.max(1);
        let slots = signs.len() / self.transmitters.max(1);
        SlotFolds { code: Some(Code { receivers, slots, signs }), ..self }
    }

    /// Width of the unambiguous interval λ/(2T_loop), m/s.
    pub fn ambiguity_mps(&self) -> f64 {
        TAU / self.wavenumber / (2.0 * self.loop_period_s)
    }

    /// Folds of a measured rate within ±λ/(4T_c), as multiples of the ambiguity.
    fn folds(&self, range_rate_mps: f64) -> std::ops::RangeInclusive<i32> {
        let half = 0.5 * self.loop_period_s / self.chirp_period_s;
        let at = range_rate_mps / self.ambiguity_mps();
        // The two ends look alike: a little less than the one of them, a little more than the other.
        let within = |edge: f64| edge - at - 1e-9;
        within(-half).ceil() as i32..=within(half).floor() as i32
    }

    /// The phase that is taken out of a slot for fold q on top of the measured rate.
    fn turn(&self, slot: usize, range_rate_mps: f64, fold: i32) -> Complex64 {
        let rate = 2.0 * self.wavenumber * self.chirp_period_s * range_rate_mps;
        let turns = f64::from(fold) * self.chirp_period_s / self.loop_period_s;
        Complex64::cis(-(rate + TAU * turns) * slot as f64)
    }

    /// The channels of a snapshot with the turns of a rate and fold q taken out.
    fn channels_of(&self, snapshot: &[Complex64], range_rate_mps: f64, fold: i32) -> Vec<Complex64> {
        let Some(code) = &self.code else {
            let turned = |(x, c): (&Complex64, &(DVec3, usize))| x * self.turn(c.1, range_rate_mps, fold);
            return snapshot.iter().zip(&self.channels).map(turned).collect();
        };
        let mut out = vec![Complex64::ZERO; self.channels.len()];
        for (slot, (seen, signs)) in
            snapshot.chunks_exact(code.receivers).zip(code.signs.chunks(self.transmitters)).enumerate()
        {
            let back = self.turn(slot, range_rate_mps, fold) / code.slots as f64;
            for (own, sign) in out.chunks_mut(code.receivers).zip(signs) {
                own.iter_mut().zip(seen).for_each(|(c, x)| *c += x * back * *sign);
            }
        }
        out
    }

    /// The snapshot of these channels at rest.
    fn snapshot_of(&self, channels: Vec<Complex64>) -> Vec<Complex64> {
        let Some(code) = &self.code else { return channels };
        let slot = |signs: &[f64]| -> Vec<Complex64> {
            let sum = |r: usize| {
                signs.iter().enumerate().map(|(tx, sign)| channels[tx * code.receivers + r] * *sign).sum()
            };
            (0..code.receivers).map(sum).collect()
        };
        code.signs.chunks(self.transmitters).flat_map(slot).collect()
    }

    /// Largest |y|² of a snapshot over directions, all channels with the same weight, and where it is: the best of the
    /// grid, then between its directions.
    fn sharpest(&self, x: &[Complex64]) -> Beam {
        let n = x.len() as f64;
        let (mut at, mut best) = ((0.0, 0.0), -1.0);
        for (steer, direction) in self.steering.chunks_exact(x.len()).zip(&self.directions) {
            let power = x.iter().zip(steer).map(|(x, s)| x * s).sum::<Complex64>().norm_sqr() / (n * n);
            if power > best {
                (at, best) = (*direction, power);
            }
        }
        let (_, mut step) = self.beam(x, at);
        for _ in 0..6 {
            let next = (at.0 + step.x, at.1 + step.y);
            let (power, more) = self.beam(x, next);
            if power > best {
                (at, best, step) = (next, power, more);
            } else {
                step *= 0.5;
            }
        }
        (best, at)
    }

    /// |y|² towards (azimuth, elevation), and the Gauss–Newton step to where phases are even.
    fn beam(&self, x: &[Complex64], (azimuth, elevation): (f64, f64)) -> (f64, DVec2) {
        let n = x.len() as f64;
        let u = direction_from_angles(azimuth, elevation);
        let (sa, ca) = azimuth.sin_cos();
        let (se, ce) = elevation.sin_cos();
        let by_azimuth = DVec3::new(-ce * sa, ce * ca, 0.0);
        let by_elevation = DVec3::new(-se * ca, -se * sa, ce);
        let k = self.wavenumber;
        let slope = |p: DVec3| k * DVec2::new(by_azimuth.dot(p), by_elevation.dot(p));
        let turned = |(x, c): (&Complex64, &(DVec3, usize))| x * Complex64::cis(k * u.dot(c.0));
        let y = x.iter().zip(&self.channels).map(turned).sum::<Complex64>() / n;
        let mean = self.channels.iter().map(|c| slope(c.0)).sum::<DVec2>() / n;
        let (mut g, mut b) = (DMat2::ZERO, DVec2::ZERO);
        for pair in x.iter().zip(&self.channels) {
            let d = slope(pair.1.0) - mean;
            g += DMat2::from_cols(d * d.x, d * d.y);
            b += d * (turned(pair) * y.conj()).im;
        }
        // An angle that the array cannot tell has no slope: a little on the diagonal keeps it still.
        let little = 1e-9 * (g.x_axis.x + g.y_axis.y) + f64::MIN_POSITIVE;
        let step = (g + DMat2::from_diagonal(DVec2::splat(little))).inverse() * b / -y.norm_sqr();
        (y.norm_sqr(), if step.is_finite() { step } else { DVec2::ZERO })
    }

    /// How many dB the beam of the best wrong fold falls short of the right one, for the direction in which that is
    /// least. It is 0 when the array can tell nothing (a receiver that no two transmitters double, say), and decides
    /// the SNR that a decision takes.
    pub fn separation_db(&self) -> f64 {
        let channels = self.channels.len();
        let mut worst: f64 = 0.0;
        for wave in self.steering.chunks_exact(channels) {
            let right = self.snapshot_of(wave.iter().map(|s| s.conj()).collect());
            for fold in self.folds(0.0).filter(|q| *q != 0) {
                let x = self.channels_of(&right, 0.0, fold);
                worst = worst.max(self.sharpest(&x).0);
            }
        }
        -crate::base::units::db_from_power(worst.min(1.0))
    }

    /// Tests the folds of a measured rate on the snapshot of its cell, before eq. 19 takes any phase
    /// out. With one body and noise of `noise_w` per channel (plus `model_error` of the body's power, for
    /// arrays that are not perfectly known) the likelihood of a fold goes with exp(K|y|²/noise).
    /// Found from a probability of 99.9 %, and of 99.999 % for another fold than the one that was measured: cells that hold more
    /// than one body, or side lobes of others, look like any fold now and then. Resolved when it is found and no rate that looks alike is within the limits of speed, else
    /// Ambiguous; Unresolved when no fold leaves
    /// a plane wave (several bodies in the cell) and with one transmitter.
    ///
    /// With `standing` the likeliest fold that is not ruled out and leaves something that stands is taken instead, EgoSpeed; where the
    /// array finds the fold, only rates λ/(2T_c) apart are chosen from.
    pub fn test(
        &self,
        snapshot: &[Complex64],
        range_rate_mps: f64,
        noise_w: f64,
        model_error: f64,
        standing: Option<&Standing>,
    ) -> FoldTest {
        let channels = self.channels.len() as f64;
        let mut beams: Vec<(i32, Beam)> = self
            .folds(range_rate_mps)
            .map(|q| (q, self.sharpest(&self.channels_of(snapshot, range_rate_mps, q))))
            .collect();
        beams.sort_by(|a, b| b.1.0.total_cmp(&a.1.0).then(a.0.abs().cmp(&b.0.abs())));
        // Slots that send at once hold every channel: the mean over them counts.
        let slots = self.code.as_ref().map_or(1, |c| c.slots) as f64;
        let total = snapshot.iter().map(|x| x.norm_sqr()).sum::<f64>() / slots / channels;
        let noise = noise_w + model_error * total;
        let (best, (power, _)) = beams[0];
        let likelihood: Vec<f64> =
            beams.iter().map(|(_, (p, _))| (channels * (p - power) / noise).exp()).collect();
        let sum: f64 = likelihood.iter().sum();
        let folds: Vec<(i32, f64)> = beams.iter().zip(&likelihood).map(|((q, _), l)| (*q, l / sum)).collect();
        // What a plane wave leaves over is noise: 2K(total − |y|²)/noise, chi-square with 2K − 2 degrees; codes that no transmitter uses
        // add theirs.
        let left = 2.0 * channels * (total - power) / noise;
        let plane = ChiSquared::new((2.0 * snapshot.len() as f64 - 2.0).max(1.0))
            .is_ok_and(|chi| left <= chi.inverse_cdf(AGREEMENT));
        let is_plane = self.transmitters > 1 && plane;
        let is_found = is_plane && folds[0].1 >= if best == 0 { SURE } else { SURE_OF_ANOTHER };
        let rate_of = |fold: i32| range_rate_mps + f64::from(fold) * self.ambiguity_mps();
        let period_mps = self.ambiguity_mps() * self.loop_period_s / self.chirp_period_s;
        // With other ramps between a transmitter's turns, λ/(2T_c) may be no multiple of λ/(2T_loop): what looks alike then is
        // nearly so, in several folds beyond those that were tried.
        let turns = self.loop_period_s / self.chirp_period_s;
        let is_whole = (turns - turns.round()).abs() < 1e-6 * turns;
        let modulo_mps = if is_found && is_whole { period_mps } else { self.ambiguity_mps() };
        let state = match is_plane {
            true if is_found && is_alone(rate_of(best), modulo_mps) => Ambiguity::Resolved,
            true => Ambiguity::Ambiguous,
            false => Ambiguity::Unresolved,
        };
        let possible = beams
            .iter()
            .zip(&folds)
            .filter(|((fold, _), (_, p))| !is_plane || *p > RULED_OUT && (!is_found || *fold == best));
        let stands = standing.and_then(|s| {
            possible.into_iter().find_map(|((fold, (_, at)), _)| {
                let rate = rate_of(*fold);
                Some(rate + period_mps * s.fold(rate, *at, period_mps)?)
            })
        });
        let (rate, state) = match (stands, state) {
            // What the radar found by itself needs no other reason.
            (Some(rate), Ambiguity::Resolved) if rate == rate_of(best) => (rate, state),
            (Some(rate), _) => (rate, Ambiguity::EgoSpeed),
            (None, Ambiguity::Unresolved) => (range_rate_mps, state),
            (None, _) => (rate_of(best), state),
        };
        let directions = beams.iter().map(|(_, (_, at))| *at).collect();
        FoldTest { range_rate_mps: rate, state, is_found, modulo_mps, folds, directions }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Draws;

    #[test]
    fn alone_is_what_no_other_within_the_limits_looks_like() {
        assert!(is_alone(5.0, 120.0) && !is_alone(30.0, 120.0) && !is_alone(-30.0, 120.0));
        // The other one is at 100.2 m/s.
        assert!(is_alone(19.8, 120.0) && !is_alone(20.2, 120.0));
        // Not the slowest of those that look alike.
        assert!(!is_alone(115.0, 120.0) && !is_alone(3.0, 35.4));
        assert!(is_alone(99.0, f64::INFINITY));
        assert_eq!((Ambiguity::Unambiguous.ambig_state(), Ambiguity::Ambiguous.ambig_state()), (3, 1));
    }

    const K: f64 = TAU / 3.9e-3;

    fn directions() -> Vec<(f64, f64)> {
        (-100..=100).map(|i| ((0.0085 * f64::from(i)).asin(), 0.0)).collect()
    }

    /// Transmitters `spacing` half wavelengths apart, receivers one.
    fn array(tx: usize, rx: usize, spacing: f64) -> Vec<(DVec3, usize)> {
        let half = 0.5 * 3.9e-3;
        (0..tx)
            .flat_map(|k| (0..rx).map(move |r| (DVec3::Y * half * (spacing * k as f64 + r as f64), k)))
            .collect()
    }

    /// A body's snapshot with noise of variance 1.
    fn snapshot(
        d: &mut Draws,
        array: &[(DVec3, usize)],
        (azimuth, rate): (f64, f64),
        amplitude: f64,
        period: f64,
    ) -> Vec<Complex64> {
        let u = direction_from_angles(azimuth, 0.0);
        array
            .iter()
            .map(|(p, slot)| {
                let phase = -K * u.dot(*p) + 2.0 * K * period * rate * *slot as f64;
                let noise = Complex64::new(d.normal(), d.normal()) / 2f64.sqrt();
                amplitude * Complex64::cis(phase) + noise
            })
            .collect()
    }

    #[test]
    fn folds_are_found_and_doubts_are_marked() {
        let period = 50e-6;
        let array = array(3, 4, 4.0);
        let folds = SlotFolds::new(&array, 3, K, [period, 3.0 * period], &directions()).unwrap();
        let ambiguity = folds.ambiguity_mps();
        assert!((ambiguity - 13.0).abs() < 1e-9);
        assert!(folds.separation_db() > 0.5, "{}", folds.separation_db());
        let (mut right, mut wrong) = (0, 0);
        for trial in 0..300 {
            let mut d = Draws::new(trial, 52);
            let measured = ambiguity * (d.uniform() - 0.5);
            let fold = (3.0 * d.uniform()) as i32 - 1;
            let rate = measured + f64::from(fold) * ambiguity;
            let azimuth = 0.9 * (d.uniform() - 0.5);
            // 17 dB in one channel.
            let x = snapshot(&mut d, &array, (azimuth, rate), 7.0, period);
            let t = folds.test(&x, measured, 1.0, 0.0, None);
            assert!((t.folds.iter().map(|f| f.1).sum::<f64>() - 1.0).abs() < 1e-12);
            if t.is_found {
                if (t.range_rate_mps - rate).abs() < 1e-9 { right += 1 } else { wrong += 1 }
            }
        }
        println!("{right} right, {wrong} wrong of 300; separation {:.2} dB", folds.separation_db());
        assert!(right >= 280 && wrong <= 1);
    }

    /// Transmitters that send at once with the signs of Sylvester's matrix: the slots' turns mix them, which only the right fold undoes.
    #[test]
    fn folds_of_codes_are_found() {
        let period = 50e-6;
        // Two codes exchange their transmitters in the other fold, which looks alike near the boresight.
        for (transmitters, slots, least) in [(2, 2, 160), (3, 4, 180), (4, 4, 180)] {
            let array = array(transmitters, 4, 4.0);
            let sign = |slot: usize, tx: usize| 1.0 - 2.0 * f64::from((slot & tx).count_ones() % 2);
            let signs: Vec<f64> =
                (0..slots).flat_map(|s| (0..transmitters).map(move |tx| sign(s, tx))).collect();
            let folds =
                SlotFolds::new(&array, transmitters, K, [period, slots as f64 * period], &directions())
                    .unwrap()
                    .coded(signs.clone());
            let ambiguity = folds.ambiguity_mps();
            let (mut right, mut wrong, mut given) = (0, 0, 0);
            for trial in 0..200 {
                let mut d = Draws::new(trial, 54);
                let measured = ambiguity * (d.uniform() - 0.5);
                let fold = (slots as f64 * d.uniform()) as i32 - slots as i32 / 2;
                let rate = measured + f64::from(fold) * ambiguity;
                let azimuth = 0.9 * (d.uniform() - 0.5);
                let u = direction_from_angles(azimuth, 0.0);
                // 17 dB in a slot of one transmitter.
                let mut x = Vec::new();
                for slot in 0..slots {
                    let turn = Complex64::cis(2.0 * K * period * rate * slot as f64);
                    for r in 0..4 {
                        let sent = |tx: usize| {
                            Complex64::cis(-K * u.dot(array[tx * 4 + r].0)) * signs[slot * transmitters + tx]
                        };
                        let noise = Complex64::new(d.normal(), d.normal()) / 2f64.sqrt();
                        x.push((0..transmitters).map(sent).sum::<Complex64>() * turn * 7.0 + noise);
                    }
                }
                let t = folds.test(&x, measured, 1.0 / slots as f64, 0.0, None);
                let is_same = |q: i32| {
                    let periods = (f64::from(q - fold)) / slots as f64;
                    (periods - periods.round()).abs() < 1e-9
                };
                if t.is_found {
                    if is_same(t.folds[0].0) {
                        right += 1
                    } else {
                        wrong += 1
                    }
                    let (at, _) = t.directions[0];
                    given += usize::from((at - azimuth).abs() < 0.02);
                }
            }
            println!("{transmitters} in {slots} slots: {right} right, {wrong} wrong of 200");
            assert!(right >= least && wrong <= 1 && given >= right, "{right} {wrong} {given}");
        }
    }

    /// One receiver: the fold and the direction are confused. The right direction is that of the measured fold or among the others.
    #[test]
    fn directions_of_other_folds_are_given() {
        use crate::detect::angle_ambiguity::ByFolds;
        let period = 50e-6;
        let row = array(4, 1, 1.0);
        let folds = SlotFolds::new(&row, 4, K, [period, 4.0 * period], &directions()).unwrap();
        for trial in 0..100 {
            let mut d = Draws::new(trial, 55);
            let measured = folds.ambiguity_mps() * (d.uniform() - 0.5);
            let fold = (4.0 * d.uniform()) as i32 - 2;
            let azimuth = 0.9 * (d.uniform() - 0.5);
            let rate = measured + f64::from(fold) * folds.ambiguity_mps();
            let t =
                folds.test(&snapshot(&mut d, &row, (azimuth, rate), 10.0, period), measured, 1.0, 0.0, None);
            assert!(!t.is_found);
            let by_folds = ByFolds::of(&t);
            let own = t.folds.iter().zip(&t.directions).find(|((q, _), _)| *q == 0).unwrap().1;
            let all = by_folds.directions.iter().flatten().map(|(at, _)| at[0]).chain([own.0]);
            let nearest = all.map(|a| (a.sin() - azimuth.sin()).abs()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.05, "{azimuth}: {t:?}");
        }
    }

    /// Where the noise leaves doubt, what is called resolved still is, as often as stated.
    #[test]
    fn weak_bodies_are_seldom_resolved_wrong() {
        let (period, array) = (50e-6, array(2, 4, 4.0));
        let folds = SlotFolds::new(&array, 2, K, [period, 2.0 * period], &directions()).unwrap();
        let (mut right, mut wrong) = (0, 0);
        for trial in 0..1500 {
            let mut d = Draws::new(trial, 54);
            let measured = folds.ambiguity_mps() * (d.uniform() - 0.5);
            let fold = f64::from((2.0 * d.uniform()) as i32 - 1);
            let azimuth = 0.9 * (d.uniform() - 0.5);
            // 5 dB in one channel.
            let rate = measured + fold * folds.ambiguity_mps();
            let x = snapshot(&mut d, &array, (azimuth, rate), 1.8, period);
            let t = folds.test(&x, measured, 1.0, 0.0, None);
            if t.is_found {
                // Two ambiguities apart they look alike.
                let apart = (t.range_rate_mps - rate) / (2.0 * folds.ambiguity_mps());
                assert!(t.range_rate_mps.abs() <= folds.ambiguity_mps() + 1e-9);
                if (apart - apart.round()).abs() < 1e-9 { right += 1 } else { wrong += 1 }
            }
        }
        println!("{right} right, {wrong} wrong, others in doubt; separation {:.2} dB", folds.separation_db());
        assert!(right > 500 && right < 1450, "{right}");
        // A thousandth of those resolved; five or more have a probability below 0.4 %.
        assert!(wrong < 5, "{wrong}");
    }

    /// However strong a body is and between whatever directions, it is a plane wave.
    #[test]
    fn strong_bodies_fit_between_the_directions() {
        let (period, array) = (50e-6, array(3, 4, 4.0));
        let few: Vec<(f64, f64)> = (-10..=10).map(|i| ((0.08 * f64::from(i)).asin(), 0.0)).collect();
        let folds = SlotFolds::new(&array, 3, K, [period, 3.0 * period], &few).unwrap();
        let mut passed = 0;
        for trial in 0..100 {
            let mut d = Draws::new(trial, 55);
            let azimuth = 1.2 * (d.uniform() - 0.5);
            let x = snapshot(&mut d, &array, (azimuth, 2.0 - folds.ambiguity_mps()), 3e3, period);
            let t = folds.test(&x, 2.0, 1.0, 0.0, None);
            assert_eq!(t.folds[0].0, -1, "{azimuth}");
            passed += u32::from(t.is_found);
        }
        // 99.9 % of plane waves pass the test of being one.
        assert!(passed >= 98, "{passed}");
    }

    #[test]
    fn what_cannot_be_told_is_said() {
        let period = 50e-6;
        let mut d = Draws::new(0, 53);
        // One receiver: a fold looks like another direction.
        let lone = array(3, 1, 1.0);
        let folds = SlotFolds::new(&lone, 3, K, [period, 3.0 * period], &directions()).unwrap();
        assert!(folds.separation_db() < 0.1, "{}", folds.separation_db());
        let x = snapshot(&mut d, &lone, (0.1, 2.0), 30.0, period);
        assert_eq!(folds.test(&x, 2.0, 1.0, 0.0, None).state, Ambiguity::Ambiguous);
        // Transmitters that double one another's elements need no directions.
        let doubled = array(3, 4, 0.0);
        let folds = SlotFolds::new(&doubled, 3, K, [period, 3.0 * period], &directions()).unwrap();
        assert!(folds.separation_db() > 20.0, "{}", folds.separation_db());
        // Two bodies in a cell: no fold leaves a plane wave.
        let row = array(3, 4, 4.0);
        let folds = SlotFolds::new(&row, 3, K, [period, 3.0 * period], &directions()).unwrap();
        let mut x = snapshot(&mut d, &row, (0.3, 2.0), 30.0, period);
        let other = snapshot(&mut d, &row, (-0.4, 2.0), 25.0, period);
        x.iter_mut().zip(&other).for_each(|(x, o)| *x += o);
        let t = folds.test(&x, 2.0, 2.0, 0.0, None);
        assert_eq!((t.state, t.range_rate_mps), (Ambiguity::Unresolved, 2.0));
        // One transmitter.
        let plain = array(1, 8, 0.0);
        let folds = SlotFolds::new(&plain, 1, K, [period; 2], &directions()).unwrap();
        let x = snapshot(&mut d, &plain, (0.3, 2.0), 30.0, period);
        assert_eq!(folds.test(&x, 2.0, 1.0, 0.0, None).state, Ambiguity::Unresolved);
        // An array that is known to a thousandth in power only.
        let folds = SlotFolds::new(&row, 3, K, [period, 3.0 * period], &directions()).unwrap();
        let x: Vec<Complex64> = snapshot(&mut d, &row, (0.3, 2.0), 1e3, period)
            .iter()
            .map(|x| x * Complex64::cis(0.02 * d.normal()))
            .collect();
        assert_eq!(folds.test(&x, 2.0, 1.0, 0.0, None).state, Ambiguity::Unresolved);
        let t = folds.test(&x, 2.0, 1.0, 1e-3, None);
        // Rates 39 m/s apart look alike.
        assert_eq!((t.state, t.is_found, t.folds[0].0), (Ambiguity::Ambiguous, true, 0));
        assert!(SlotFolds::new(&[], 1, K, [period; 2], &directions()).is_err());
        assert!(SlotFolds::new(&row, 2, K, [period, 2.0 * period], &directions()).is_err());
        assert!(SlotFolds::new(&row, 3, K, [period, 3.0 * period], &[]).is_err());
        assert!(SlotFolds::new(&row, 3, K, [period, 2.9 * period], &directions()).is_err());
    }
}
