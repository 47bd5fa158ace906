//! Array manifold: what a wave from a direction leaves on the channels of any array
//! (CONVENTIONS eq. 90), and the lattices on which shift-invariance methods stand.

use super::doa_residual::Residual;
use crate::base::error::{BadInput, Result};
use crate::base::frames::direction_from_angles;
use crate::scene::radar::Radar;
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Matrices of the angle estimators.
pub use catseye_math::Matrix;

/// Channels (pairs of a transmitter and a receiver) with their gains, seen at one wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifold {
    tx_m: Vec<DVec3>,
    rx_m: Vec<DVec3>,
    wavelength_m: f64,
    gain: Vec<Complex64>,
    range_m: Option<f64>,
    residual: Option<Arc<Residual>>,
}

impl Manifold {
    /// The manifold of an array with one transmitter and one receiver position for each channel, m, sensor frame.
    ///
    /// # Errors
    /// Returns an error if there are no channels, for lists of different length, for positions or a wavelength that are
    /// not finite, or for two channels with the same transmitter and the same receiver.
    pub fn new(tx_m: Vec<DVec3>, rx_m: Vec<DVec3>, wavelength_m: f64) -> Result<Self> {
        if tx_m.is_empty() || tx_m.len() != rx_m.len() {
            return Err(BadInput::new("channels need one transmitter and one receiver each")
                .key("tx, rx")
                .value(format!("{} and {} positions", tx_m.len(), rx_m.len()))
                .into());
        }
        if !(wavelength_m > 0.0 && wavelength_m.is_finite()) {
            return Err(BadInput::new("is not a wavelength").value(wavelength_m).allowed("above 0 m").into());
        }
        if let Some(c) = tx_m.iter().zip(&rx_m).position(|(t, r)| !(t.is_finite() && r.is_finite())) {
            return Err(BadInput::new("the position is not finite").key(format!("channel {c}")).into());
        }
        let near = wavelength_m * SAME_PLACE;
        for c in 0..tx_m.len() {
            for b in 0..c {
                if tx_m[b].distance(tx_m[c]) < near && rx_m[b].distance(rx_m[c]) < near {
                    return Err(BadInput::new(
                        "coincident elements: the two channels have the same antennas",
                    )
                    .key(format!("channels {b} and {c}"))
                    .remedy("remove one of them")
                    .into());
                }
            }
        }
        let gain = vec![Complex64::ONE; tx_m.len()];
        Ok(Manifold { tx_m, rx_m, wavelength_m, gain, range_m: None, residual: None })
    }

    /// The manifold of an array that only receives: one transmitter at the origin.
    ///
    /// # Errors
    /// Returns an error for a radar whose antennas make no array: none, or two in one place.
    pub fn receivers(rx_m: Vec<DVec3>, wavelength_m: f64) -> Result<Self> {
        Self::new(vec![DVec3::ZERO; rx_m.len()], rx_m, wavelength_m)
    }

    /// The manifold of the radar's virtual channels, c = tx x N_rx + rx, at the middle frequency of its
    /// samples.
    ///
    /// # Errors
    /// Returns an error for a radar whose antennas make no array: none, or two in one place.
    pub fn of_radar(radar: &Radar) -> Result<Self> {
        let pairs = radar.tx.iter().flat_map(|t| radar.rx.iter().map(|r| (t.position_m, r.position_m)));
        let (tx, rx) = pairs.unzip();
        Self::new(tx, rx, radar.sample_wavelength_m())
    }

    /// The manifold with a complex amplitude gain of each channel, the same in all directions.
    ///
    /// # Errors
    /// Returns an error if there are not as many gains as channels, or for a gain that is zero or not finite.
    pub fn with_gains(mut self, gain: Vec<Complex64>) -> Result<Self> {
        if gain.len() != self.channels() {
            return Err(BadInput::new("wrong number of channel gains")
                .value(gain.len())
                .allowed(self.channels().to_string())
                .into());
        }
        if let Some(c) = gain.iter().position(|g| !(g.norm_sqr() > 0.0 && g.norm_sqr().is_finite())) {
            return Err(BadInput::new("is not a gain").key(format!("channel {c}")).value(gain[c]).into());
        }
        let mean = gain.iter().map(|g| g.norm_sqr()).sum::<f64>() / gain.len() as f64;
        self.gain = gain.iter().map(|g| g / mean.sqrt()).collect();
        Ok(self)
    }

    /// The manifold for sources at this distance from the sensor's origin instead of infinitely far.
    ///
    /// # Errors
    /// Returns an error if the range lies within the array.
    pub fn at_range(mut self, range_m: f64) -> Result<Self> {
        let extent = self.tx_m.iter().chain(&self.rx_m).map(|p| p.length()).fold(0.0, f64::max);
        if !(range_m > extent && range_m.is_finite()) {
            return Err(BadInput::new("the range is within the array")
                .key("range_m")
                .value(range_m)
                .allowed(format!("above {extent}"))
                .into());
        }
        self.range_m = Some(range_m);
        Ok(self)
    }

    /// The manifold without what was measured, for sources at infinity.
    pub(super) fn unmeasured(&self) -> Manifold {
        Manifold { range_m: None, residual: None, ..self.clone() }
    }

    /// The manifold with what a measurement has over [`Self::unmeasured`].
    pub(super) fn with_residual(mut self, residual: Residual) -> Manifold {
        self.residual = Some(Arc::new(residual));
        self
    }

    /// Number of virtual channels.
    pub fn channels(&self) -> usize {
        self.gain.len()
    }

    /// Wavelength that the manifold holds for, m.
    pub fn wavelength_m(&self) -> f64 {
        self.wavelength_m
    }

    /// Virtual position p_tx + p_rx of a channel, m.
    pub fn position_m(&self, channel: usize) -> DVec3 {
        self.tx_m[channel] + self.rx_m[channel]
    }

    /// Distance of the sources, if it is not infinite.
    pub fn range_m(&self) -> Option<f64> {
        self.range_m
    }

    /// Whether the manifold was measured, not only computed from positions.
    pub fn is_calibrated(&self) -> bool {
        self.residual.is_some()
    }

    /// Azimuth and elevation over which steering vectors are known, rad: all without calibration.
    pub fn covers(&self, azimuth_rad: f64, elevation_rad: f64) -> bool {
        self.residual.as_ref().is_none_or(|r| r.covers(azimuth_rad, elevation_rad))
    }

    /// Gains of the channels over all directions: what [`Self::with_gains`] was given, times the mean
    /// of a calibration over its angles. Dividing by them leaves an ideal array as well as constants can.
    pub fn mean_gains(&self) -> Vec<Complex64> {
        match &self.residual {
            Some(r) => self.gain.iter().zip(r.mean()).map(|(g, m)| g * m).collect(),
            None => self.gain.clone(),
        }
    }

    /// The same array with gains of one and no calibration.
    pub fn ideal(&self) -> Manifold {
        Manifold { gain: vec![Complex64::ONE; self.channels()], residual: None, ..self.clone() }
    }

    /// The manifold of some of the channels, in the order given, without a calibration.
    pub fn subset(&self, channels: &[usize]) -> Manifold {
        Manifold {
            tx_m: channels.iter().map(|c| self.tx_m[*c]).collect(),
            rx_m: channels.iter().map(|c| self.rx_m[*c]).collect(),
            gain: channels.iter().map(|c| self.gain[*c]).collect(),
            residual: None,
            ..*self
        }
    }

    /// Steering vector of eq. 90, one value per channel, mean square 1.
    ///
    /// # Example
    /// On a line of receivers half a wavelength apart the phase advances by −π sin θ from one to the next (eq. 90).
    ///
    /// ```
    /// use catseye::dsp::doa_manifold::Manifold;
    /// use glam::DVec3;
    /// use std::f64::consts::PI;
    ///
    /// let lambda_m = 3.9e-3;
    /// let line = (0..8).map(|i| DVec3::Y * 0.5 * lambda_m * f64::from(i)).collect();
    /// let array = Manifold::receivers(line, lambda_m)?;
    /// let azimuth_rad = 20f64.to_radians();
    /// let a = array.steering(azimuth_rad, 0.0);
    /// assert!(a.windows(2).all(|pair| ((pair[1] / pair[0]).arg() + PI * azimuth_rad.sin()).abs() < 1e-9));
    /// # Ok::<(), catseye::Error>(())
    /// ```
    pub fn steering(&self, azimuth_rad: f64, elevation_rad: f64) -> Vec<Complex64> {
        let k = TAU / self.wavelength_m;
        let u = direction_from_angles(azimuth_rad, elevation_rad);
        let mut out: Vec<Complex64> = (0..self.channels())
            .map(|c| {
                let excess = match self.range_m {
                    None => -u.dot(self.position_m(c)),
                    Some(r) => [self.tx_m[c], self.rx_m[c]].iter().map(|p| nearer(u, r, *p)).sum(),
                };
                self.gain[c] * Complex64::cis(k * excess)
            })
            .collect();
        if let Some(residual) = &self.residual {
            for (a, g) in out.iter_mut().zip(residual.at(azimuth_rad, elevation_rad)) {
                *a *= g;
            }
            let mean = out.iter().map(|a| a.norm_sqr()).sum::<f64>() / out.len() as f64;
            out.iter_mut().for_each(|a| *a /= mean.sqrt());
        }
        out
    }

    /// Steering vectors of these angles as columns.
    pub fn matrix(&self, angles: &[(f64, f64)]) -> Matrix {
        let columns: Vec<Vec<Complex64>> = angles.iter().map(|(a, e)| self.steering(*a, *e)).collect();
        Matrix::from_fn(self.channels(), angles.len(), |c, s| columns[s][c])
    }

    /// Derivatives of the steering vector with azimuth and elevation, per rad (central differences).
    pub fn derivatives(&self, azimuth_rad: f64, elevation_rad: f64) -> [Vec<Complex64>; 2] {
        const H: f64 = 1e-5;
        let difference = |a: Vec<Complex64>, b: Vec<Complex64>| -> Vec<Complex64> {
            a.iter().zip(b).map(|(a, b)| (a - b) / (2.0 * H)).collect()
        };
        let (a, e) = (azimuth_rad, elevation_rad);
        [
            difference(self.steering(a + H, e), self.steering(a - H, e)),
            difference(self.steering(a, e + H), self.steering(a, e - H)),
        ]
    }

    /// Whether all phase centres lie on one line.
    pub fn is_line(&self) -> bool {
        let first = self.position_m(0);
        let far = (0..self.channels())
            .map(|c| self.position_m(c) - first)
            .max_by(|a, b| a.length().total_cmp(&b.length()))
            .unwrap_or(DVec3::ZERO);
        let axis = far.normalize_or_zero();
        let tolerance = self.wavelength_m * SAME_PLACE;
        (0..self.channels()).all(|c| (self.position_m(c) - first).cross(axis).length() < tolerance)
    }

    /// The line or rectangle that the channels fill evenly, if they do.
    pub fn lattice(&self) -> Option<Lattice> {
        let p: Vec<DVec3> = (0..self.channels()).map(|c| self.position_m(c)).collect();
        Lattice::of(&p, self.wavelength_m)
    }

    /// Channel that lies opposite each channel with respect to the array's middle, if all have one.
    pub fn mirrored(&self) -> Option<Vec<usize>> {
        let p: Vec<DVec3> = (0..self.channels()).map(|c| self.position_m(c)).collect();
        let twice = p.iter().sum::<DVec3>() * (2.0 / p.len() as f64);
        let mut taken = vec![false; p.len()];
        p.iter()
            .map(|here| {
                let there = twice - *here;
                let i = (0..p.len())
                    .find(|i| !taken[*i] && p[*i].distance(there) < self.wavelength_m * SAME_PLACE)?;
                taken[i] = true;
                Some(i)
            })
            .collect()
    }
}

/// In wavelengths: places closer than this (0.36 degrees of phase) are the same.
const SAME_PLACE: f64 = 1e-3;

/// |r u - p| - r without the cancellation.
fn nearer(u: DVec3, range_m: f64, p: DVec3) -> f64 {
    let d = u * range_m - p;
    (p.length_squared() - 2.0 * range_m * u.dot(p)) / (d.length() + range_m)
}

/// Channels on an even line (`size[0]` = 1) or parallelogram.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// Number of rows and columns.
    pub size: [usize; 2],
    /// From one row to the next and from one column to the next, of p_tx + p_rx. Zero for one row.
    pub step_m: [DVec3; 2],
    /// Channel at `[row, column]`. Of channels whose phase centres coincide the first is taken.
    pub channel: Vec<usize>,
}

impl Lattice {
    fn of(positions: &[DVec3], wavelength_m: f64) -> Option<Lattice> {
        let tolerance = wavelength_m * SAME_PLACE;
        let mut first: Vec<usize> = Vec::new();
        for (c, p) in positions.iter().enumerate() {
            if first.iter().all(|b| positions[*b].distance(*p) > tolerance) {
                first.push(c);
            }
        }
        if first.len() < 2 {
            return None;
        }
        let centre = first.iter().map(|c| positions[*c]).sum::<DVec3>() / first.len() as f64;
        let far = |c: &usize| positions[*c].distance(centre);
        let corner = positions[*first.iter().max_by(|a, b| far(a).total_cmp(&far(b)))?];
        let mut steps: Vec<DVec3> =
            first.iter().map(|c| positions[*c] - corner).filter(|d| d.length() > tolerance).collect();
        steps.sort_by(|a, b| a.length().total_cmp(&b.length()));
        let a = steps[0];
        let b = steps.iter().copied().find(|s| s.cross(a).length() > tolerance * a.length());
        // The columns run more along y than the rows.
        let (col, row) = match b {
            Some(b) if b.normalize().y.abs() > a.normalize().y.abs() => (b, a),
            Some(b) => (a, b),
            None => (a, DVec3::ZERO),
        };
        let (col, row) = (ahead(col), ahead(row));
        let place = |d: DVec3| {
            if row == DVec3::ZERO {
                return (0.0, d.dot(col) / col.length_squared());
            }
            let n = col.cross(row);
            let n2 = n.length_squared();
            (col.cross(d).dot(n) / n2, d.cross(row).dot(n) / n2)
        };
        let mut at = Vec::new();
        for c in &first {
            let d = positions[*c] - corner;
            let (r, q) = place(d);
            let (r, q) = (r.round(), q.round());
            if (row * r + col * q).distance(d) > tolerance {
                return None;
            }
            at.push((r as i64, q as i64, *c));
        }
        let low = (at.iter().map(|p| p.0).min()?, at.iter().map(|p| p.1).min()?);
        let high = (at.iter().map(|p| p.0).max()?, at.iter().map(|p| p.1).max()?);
        let size = [(high.0 - low.0 + 1) as usize, (high.1 - low.1 + 1) as usize];
        if size[0].checked_mul(size[1])? != first.len() {
            return None;
        }
        at.sort_unstable();
        Some(Lattice { size, step_m: [row, col], channel: at.iter().map(|p| p.2).collect() })
    }

    /// Direction whose phase advances by -`turn[i]` rad from one row (0), column (1) to the next
    /// (eq. 90), in front of the array. `fixed_rad`: for a line, the angle that it cannot tell
    /// (elevation for a line that is nearer the horizontal, else azimuth). Phases beyond end-fire are
    /// put on it.
    pub fn angles(&self, turn: [f64; 2], wavelength_m: f64, fixed_rad: f64) -> (f64, f64) {
        let path = turn.map(|t| t * wavelength_m / TAU);
        let [row, col] = self.step_m;
        if self.size[0] == 1 {
            let d = col.normalize();
            let s = (path[1] / col.length()).clamp(-1.0, 1.0);
            let (sf, cf) = fixed_rad.sin_cos();
            return if self.tells_azimuth() {
                (towards(d.x * cf, d.y * cf, s - d.z * sf), fixed_rad)
            } else {
                (fixed_rad, towards(d.x * cf + d.y * sf, d.z, s))
            };
        }
        // The part of the direction in the plane by the reciprocal steps, the rest along the normal.
        let n = col.cross(row);
        let n2 = n.length_squared();
        let flat = row.cross(n) / n2 * path[1] + n.cross(col) / n2 * path[0];
        let flat = if flat.length() > 1.0 { flat.normalize() } else { flat };
        let out = n.normalize() * (1.0 - flat.length_squared()).max(0.0).sqrt();
        let out = if out.x < 0.0 { -out } else { out };
        crate::base::frames::angles_from_direction(flat + out)
    }

    /// Whether a line of channels lies nearer the horizontal plane than the vertical.
    pub fn tells_azimuth(&self) -> bool {
        let d = self.step_m[1];
        d.z.abs() <= d.x.hypot(d.y)
    }

    /// Whether another direction gives the same phases as one in front: a step longer than half a
    /// wavelength.
    pub fn is_ambiguous(&self, wavelength_m: f64) -> bool {
        self.step_m.iter().any(|s| s.length() > 0.5 * wavelength_m * (1.0 + SAME_PLACE))
    }
}

/// The vector or its opposite: along +y, else +z, else +x.
fn ahead(d: DVec3) -> DVec3 {
    let small = 1e-9 * d.length();
    let key = [d.y, d.z, d.x].into_iter().find(|v| v.abs() > small).unwrap_or(0.0);
    if key < 0.0 { -d } else { d }
}

/// The solution of p cos a + q sin a = s nearest to zero.
fn towards(p: f64, q: f64, s: f64) -> f64 {
    let middle = q.atan2(p);
    let side = (s / p.hypot(q)).clamp(-1.0, 1.0).acos();
    let wrap = |a: f64| (a + std::f64::consts::PI).rem_euclid(TAU) - std::f64::consts::PI;
    let (a, b) = (wrap(middle + side), wrap(middle - side));
    if a.abs() < b.abs() { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LAMBDA: f64 = 3.8934e-3;

    fn line(n: usize) -> Manifold {
        let y = |i: usize| DVec3::new(0.0, 0.5 * LAMBDA * i as f64, 0.0);
        Manifold::receivers((0..n).map(y).collect(), LAMBDA).unwrap()
    }

    #[test]
    fn half_a_wavelength_to_the_left_is_half_a_turn_behind_at_end_fire() {
        let a = line(2).steering(std::f64::consts::FRAC_PI_2, 0.0);
        assert!((a[1] - Complex64::new(-1.0, 0.0)).norm() < 1e-12);
        // A source to the left is nearer to the element on the left: its phase, that of +kL, lags.
        let a = line(2).steering(0.1, 0.0);
        assert!((a[1].arg() + std::f64::consts::PI * 0.1f64.sin()).abs() < 1e-12);
    }

    #[test]
    fn near_field_is_the_path_and_tends_to_far_field() {
        let tx = vec![DVec3::new(0.01, -0.02, 0.0); 3];
        let rx: Vec<DVec3> = (0..3).map(|i| DVec3::new(0.0, 0.05 * i as f64, 0.03)).collect();
        let far = Manifold::new(tx.clone(), rx.clone(), LAMBDA).unwrap();
        let near = far.clone().at_range(0.5).unwrap().steering(0.3, -0.1);
        let p = direction_from_angles(0.3, -0.1) * 0.5;
        for c in 0..3 {
            let path = p.distance(tx[c]) + p.distance(rx[c]) - 1.0;
            assert!((near[c] - Complex64::cis(TAU / LAMBDA * path)).norm() < 1e-10);
        }
        let very_far = far.clone().at_range(1e7).unwrap().steering(0.3, -0.1);
        for (a, b) in very_far.iter().zip(far.steering(0.3, -0.1)) {
            assert!((a - b).norm() < 1e-5);
        }
        assert!(far.at_range(0.05).unwrap_err().to_string().contains("within the array"));
    }

    #[test]
    fn lattices_are_found_in_any_order_and_others_are_not() {
        let l = line(5).lattice().unwrap();
        assert_eq!((l.size, l.channel), ([1, 5], vec![0, 1, 2, 3, 4]));
        let grid: Vec<DVec3> =
            (0..12).map(|i| DVec3::new(0.0, -0.002 * (i % 4) as f64, 0.003 * (i / 4) as f64)).rev().collect();
        let m = Manifold::receivers(grid.clone(), LAMBDA).unwrap();
        let l = m.lattice().unwrap();
        assert_eq!(l.size, [3, 4]);
        assert!(l.step_m[1].distance(DVec3::Y * 0.002) < 1e-12 && l.step_m[0].z > 0.0);
        for r in 0..3 {
            for c in 0..4 {
                let there = m.position_m(l.channel[0]) + l.step_m[0] * r as f64 + l.step_m[1] * c as f64;
                assert!(m.position_m(l.channel[r * 4 + c]).distance(there) < 1e-12);
            }
        }
        let mut sparse = grid;
        sparse.remove(5);
        assert!(Manifold::receivers(sparse, LAMBDA).unwrap().lattice().is_none());
        let y = [0.0, 1.0, 4.0, 6.0].map(|y| DVec3::new(0.0, y * LAMBDA / 2.0, 0.0));
        let m = Manifold::receivers(y.to_vec(), LAMBDA).unwrap();
        assert!(m.lattice().is_none() && m.mirrored().is_none() && m.is_line());
        assert_eq!(line(4).mirrored().unwrap(), [3, 2, 1, 0]);
    }

    #[test]
    fn overlapping_virtual_channels_are_one_place_of_the_lattice() {
        // Two transmitters four elements apart over five receivers: one place twice.
        let step = 0.5 * LAMBDA;
        let (mut tx, mut rx) = (Vec::new(), Vec::new());
        for t in 0..2 {
            for r in 0..5 {
                tx.push(DVec3::Y * (4.0 * step * t as f64));
                rx.push(DVec3::Y * (step * r as f64));
            }
        }
        let m = Manifold::new(tx, rx, LAMBDA).unwrap();
        let l = m.lattice().unwrap();
        assert_eq!((l.size, l.channel), ([1, 9], vec![0, 1, 2, 3, 4, 6, 7, 8, 9]));
    }

    #[test]
    fn bad_arrays_are_refused() {
        let message = |r: Result<Manifold>| r.unwrap_err().to_string();
        let p = vec![DVec3::ZERO, DVec3::Y, DVec3::Y];
        assert_eq!(
            message(Manifold::receivers(p, 0.004)),
            "channels 1 and 2: coincident elements: the two channels have the same antennas; remove one of them"
        );
        assert!(message(Manifold::receivers(vec![], 0.004)).contains("one transmitter"));
        assert!(message(Manifold::receivers(vec![DVec3::NAN], 0.004)).contains("channel 0"));
        assert!(message(Manifold::receivers(vec![DVec3::Y], 0.0)).contains("wavelength"));
        assert!(message(line(2).with_gains(vec![Complex64::ONE])).contains("gains"));
        assert!(message(line(2).with_gains(vec![Complex64::ONE, Complex64::ZERO])).contains("channel 1"));
    }

    proptest! {
        #[test]
        fn phases_of_a_plane_lattice_give_the_angles_back(
            az in -1.4..1.4f64, el in -1.2..1.2f64, tilt in -0.4..0.4f64, skew in -0.3..0.3f64,
        ) {
            let (col, row) = (DVec3::new(tilt, 1.0, skew) * 0.0019, DVec3::new(0.0, skew, 1.0) * 0.0018);
            let p = (0..6).map(|i| col * (i % 3) as f64 + row * (i / 3) as f64).collect();
            let m = Manifold::receivers(p, LAMBDA).unwrap();
            let l = m.lattice().unwrap();
            let u = direction_from_angles(az, el);
            let n = col.cross(row);
            prop_assume!(u.dot(n) > 0.05 * n.length());
            let turn = l.step_m.map(|s| TAU / LAMBDA * u.dot(s));
            let (a, e) = l.angles(turn, LAMBDA, 0.0);
            prop_assert!((a - az).abs() < 1e-9 && (e - el).abs() < 1e-9);
        }

        #[test]
        fn phases_of_a_line_give_the_angle_back(angle in -1.5..1.5f64, fixed in -0.5..0.5f64, upright: bool) {
            let axis = if upright { DVec3::Z } else { DVec3::Y };
            let p = (0..4).map(|i| axis * (0.0019 * i as f64)).collect();
            let l = Manifold::receivers(p, LAMBDA).unwrap().lattice().unwrap();
            let (az, el) = if upright { (fixed, angle) } else { (angle, fixed) };
            let turn = TAU / LAMBDA * direction_from_angles(az, el).dot(l.step_m[1]);
            let (a, e) = l.angles([0.0, turn], LAMBDA, fixed);
            prop_assert!((a - az).abs() < 1e-7 && (e - el).abs() < 1e-7);
        }
    }
}
