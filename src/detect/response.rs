//! What a radar's windows and array make of one echo at the place of a point (CONVENTIONS eq. 160).

use super::points::Point;
use crate::adc::front_end::spill::Spill;
use crate::dsp::window;
use crate::error::Result;
use crate::frames::direction_from_angles;
use crate::scene::radar::Radar;
use crate::scene::waveform::Multiplex;
use crate::units::{C0, wavenumber};
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Samples of a window's transform per resolution cell; between them it is interpolated linearly, to 1 %.
const STEPS: usize = 8;
/// Cells to each side that are tabulated. Side lobes of a Hann window lie 100 dB below there.
const REACH: usize = 32;

/// The transform of a window, normalised to 1 in its middle, over the distance in resolution cells.
#[derive(Debug, Clone)]
struct WindowResponse {
    table: Vec<Complex64>,
    /// Cells after which the transform repeats itself.
    period: f64,
}

impl WindowResponse {
    fn new(weights: &[f64]) -> WindowResponse {
        let n = weights.len() as f64;
        let sum: f64 = weights.iter().sum();
        let at = |i: usize| {
            let turns = i as f64 / STEPS as f64 / n;
            let tone = |(m, w): (usize, &f64)| w * Complex64::cis(TAU * turns * (m as f64 - 0.5 * (n - 1.0)));
            weights.iter().enumerate().map(tone).sum::<Complex64>() / sum
        };
        WindowResponse { table: (0..=REACH * STEPS).map(at).collect(), period: n }
    }

    /// The response `cells` away from the tone; 0 beyond the table.
    fn at(&self, cells: f64) -> Complex64 {
        let cells = cells - self.period * (cells / self.period).round();
        let place = cells.abs() * STEPS as f64;
        let i = place as usize;
        let Some([low, high]) = self.table.get(i..).and_then(<[Complex64]>::first_chunk) else {
            return Complex64::ZERO;
        };
        let value = low + (high - low) * (place - i as f64);
        if cells < 0.0 { value.conj() } else { value }
    }
}

/// Where an echo appears: its range, range rate and the directions in which it leaves and comes back.
#[derive(Debug, Clone, Copy)]
pub(super) struct EchoPlace {
    pub range_m: f64,
    pub range_rate_mps: f64,
    /// Unit vectors in the sensor frame.
    pub departure: DVec3,
    pub arrival: DVec3,
}

/// A radar's windows and array.
#[derive(Debug, Clone)]
pub(super) struct Response {
    range: WindowResponse,
    doppler: WindowResponse,
    /// Of the mean over chirps, where it is taken out (`processing.remove_static`).
    mean: Option<WindowResponse>,
    /// Widths of the resolution cells.
    range_cell_m: f64,
    rate_cell_mps: f64,
    coupling_s: f64,
    fold_mps: f64,
    tx_m: Vec<DVec3>,
    rx_m: Vec<DVec3>,
    /// w_c / Σw of eq. 19, `[tx, rx]`.
    weights: Vec<f64>,
    wavenumber: f64,
    carrier_hz: f64,
    /// Phase that a transmitter's turn adds for each m/s, rad.
    slot_phase: f64,
}

impl Response {
    /// # Errors
    /// Those of the radar's windows.
    pub fn new(radar: &Radar) -> Result<Response> {
        let p = &radar.processing;
        let lines = radar.lines();
        let (tx_m, rx_m): (Vec<DVec3>, Vec<DVec3>) = (
            radar.tx.iter().map(|a| a.position_m).collect(),
            radar.rx.iter().map(|a| a.position_m).collect(),
        );
        let y: Vec<f64> = tx_m.iter().flat_map(|t| rx_m.iter().map(move |r| t.y + r.y)).collect();
        let mut weights = window::at_positions(p.angle_window, &y)?;
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        let slot_phase = match radar.multiplex {
            Multiplex::Tdm => TAU * 2.0 / radar.wavelength_m() * radar.chirp_period_s(),
            Multiplex::Bpm | Multiplex::Ddm { .. } => 0.0,
        };
        Ok(Response {
            range: WindowResponse::new(&window::coefficients(p.range_window, lines.count)?),
            doppler: WindowResponse::new(&window::coefficients(p.doppler_window, radar.chirps)?),
            mean: p.remove_static.then(|| WindowResponse::new(&vec![1.0; radar.chirps])),
            range_cell_m: C0 / (2.0 * lines.step_hz.abs() * lines.count as f64),
            rate_cell_mps: radar.wavelength_m() / (2.0 * radar.frame_time_s()),
            coupling_s: radar.range_per_rate_s(),
            fold_mps: 2.0 * radar.max_velocity_mps(),
            tx_m,
            rx_m,
            weights,
            wavenumber: wavenumber(radar.carrier_hz),
            carrier_hz: radar.carrier_hz,
            slot_phase,
        })
    }

    /// Width of a resolution cell in range, m.
    pub fn range_cell_m(&self) -> f64 {
        self.range_cell_m
    }

    /// The response to one point.
    pub fn to<'r>(&'r self, point: &Point) -> PointResponse<'r> {
        let steer = |list: &[DVec3]| {
            let u = direction_from_angles(point.azimuth_rad, point.elevation_rad);
            list.iter().map(|p| Complex64::cis(self.wavenumber * u.dot(*p))).collect::<Vec<_>>()
        };
        PointResponse {
            of: self,
            range_m: point.range_m,
            range_rate_mps: point.range_rate_mps,
            tx: steer(&self.tx_m),
            rx: steer(&self.rx_m),
        }
    }
}

/// The cell and the beam of one point.
pub(super) struct PointResponse<'r> {
    of: &'r Response,
    range_m: f64,
    range_rate_mps: f64,
    /// e^{+jk u·p} of each antenna towards the point.
    tx: Vec<Complex64>,
    rx: Vec<Complex64>,
}

impl PointResponse<'_> {
    /// The factor of the windows on an echo of unit amplitude. Range and Doppler are coupled as the waveform couples
    /// them, and both wrap as the transforms do.
    pub fn cell(&self, range_m: f64, range_rate_mps: f64) -> Complex64 {
        let of = self.of;
        let faster = range_rate_mps - self.range_rate_mps;
        let range = of.range.at((range_m - self.range_m + faster * of.coupling_s) / of.range_cell_m);
        if range == Complex64::ZERO {
            return range;
        }
        let cells = |mps: f64| (mps - of.fold_mps * (mps / of.fold_mps).round()) / of.rate_cell_mps;
        let doppler = of.doppler.at(cells(faster));
        let removed = of.mean.as_ref().map_or(Complex64::ZERO, |mean| {
            mean.at(cells(range_rate_mps)) * of.doppler.at(cells(-self.range_rate_mps))
        });
        range * (doppler - removed)
    }

    /// The factor of the array on an echo of unit amplitude: the beam towards the point, with the echo's departure at
    /// the transmitters and its arrival at the receivers. Transmitters in turn see the difference of the range rates
    /// too. A point's rate may have been unfolded after its direction was measured, so that the stronger of the two
    /// responses, with the folds and without, counts.
    pub fn array(&self, echo: &EchoPlace) -> Complex64 {
        let of = self.of;
        let faster = echo.range_rate_mps - self.range_rate_mps;
        let folded = of.fold_mps * (faster / of.fold_mps).round();
        let with = self.beam(echo, faster);
        if folded == 0.0 || of.slot_phase == 0.0 {
            return with;
        }
        let without = self.beam(echo, faster - folded);
        if without.norm_sqr() > with.norm_sqr() { without } else { with }
    }

    fn beam(&self, echo: &EchoPlace, faster_mps: f64) -> Complex64 {
        let of = self.of;
        let rx: Vec<Complex64> = of
            .rx_m
            .iter()
            .zip(&self.rx)
            .map(|(p, steer)| steer * Complex64::cis(-of.wavenumber * echo.arrival.dot(*p)))
            .collect();
        of.tx_m
            .iter()
            .zip(&self.tx)
            .zip(of.weights.chunks(rx.len().max(1)))
            .enumerate()
            .map(|(slot, ((p, steer), weights))| {
                let turn = of.slot_phase * faster_mps * slot as f64 - of.wavenumber * echo.departure.dot(*p);
                let heard: Complex64 = rx.iter().zip(weights).map(|(r, w)| r * *w).sum();
                steer * Complex64::cis(turn) * heard
            })
            .sum()
    }

    /// What a path inside the radar brings to the point, √W; 0 where channels are not pairs of antennas.
    pub fn spill(&self, spill: &Spill, gain: impl Fn(f64) -> Complex64) -> Complex64 {
        let of = self.of;
        if spill.channels.len() != of.weights.len() {
            return Complex64::ZERO;
        }
        let steer = self.tx.iter().flat_map(|t| self.rx.iter().map(move |r| t * r));
        let slots = (0..self.tx.len()).flat_map(|slot| std::iter::repeat_n(slot as f64, self.rx.len()));
        spill
            .channels
            .iter()
            .zip(&of.weights)
            .zip(steer.zip(slots))
            .map(|(((a, delay_s), weight), (steer, slot))| {
                let still = Complex64::cis(-of.slot_phase * self.range_rate_mps * slot);
                let tone = a.conj() * Complex64::cis(TAU * of.carrier_hz * delay_s) * gain(*delay_s);
                tone * *weight * steer * still * self.cell(0.5 * C0 * delay_s, 0.0)
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_has_its_known_lobes() {
        // A rectangle: sin(πx)/(N sin(πx/N)).
        let flat = WindowResponse::new(&[1.0; 64]);
        for x in [0.0, 0.25, 0.5, 1.0, -1.5, 2.3, 64.25] {
            let turned: f64 = x - 64.0 * f64::round(x / 64.0);
            let half = std::f64::consts::PI * turned;
            let want = if turned == 0.0 { 1.0 } else { half.sin() / (64.0 * (half / 64.0).sin()) };
            assert!((flat.at(x) - want).norm() < 0.01, "{x}: {} {want}", flat.at(x));
        }
        // Hann: half the amplitude one cell away, nothing at two, the first side lobe 31.5 dB down.
        let w = window::coefficients(crate::scene::radar::Window::Hann, 256).unwrap();
        let hann = WindowResponse::new(&w);
        assert!((hann.at(1.0).norm() - 0.5).abs() < 1e-3 && hann.at(2.0).norm() < 1e-3);
        assert!((20.0 * hann.at(2.375).norm().log10() + 31.5).abs() < 0.3);
        assert_eq!(hann.at(100.0), Complex64::ZERO);
    }
}
