//! What a radar's windows and array make of one echo at the place of a point (CONVENTIONS eq. 160).

use super::points::Point;
use crate::adc::front_end::spill::Spill;
use crate::base::error::Result;
use crate::base::frames::direction_from_angles;
use crate::base::memo::Memo;
use crate::base::units::{C0, wavenumber};
use crate::dsp::window;
use crate::scene::radar::Radar;
use crate::scene::waveform::Multiplex;
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Samples of a window's transform per resolution cell; between them it is interpolated linearly, to 1 %.
const STEPS: usize = 8;
/// Least power that the array hears of an echo in its main lobe, as a share of what it hears in the echo's own
/// direction: the first side lobe of equal weights is 13 dB down.
const LEAST_OF_MAIN_LOBE: f64 = 0.1;
/// Cells to each side that are tabulated. Side lobes of a Hann window lie 100 dB below there.
const REACH: usize = 32;

/// The transform of a window, normalised to 1 in its middle, over the distance in resolution cells.
#[derive(Debug, Clone)]
struct WindowResponse {
    table: Vec<Complex64>,
    /// Cells after which the transform repeats itself.
    period: f64,
    /// Half the width of the main lobe: cells to the first minimum beside it; infinite where there is none.
    main_lobe_cells: f64,
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
        let table: Vec<Complex64> = (0..=REACH * STEPS).map(at).collect();
        let level = |i: usize| table[i].norm();
        let null = (1..REACH * STEPS).find(|&i| level(i) < 0.5 && level(i) < level(i + 1));
        let main_lobe_cells = null.map_or(f64::INFINITY, |i| i as f64 / STEPS as f64);
        WindowResponse { table, period: n, main_lobe_cells }
    }

    /// The distance from the tone or from its nearest repetition, cells.
    fn wrapped(&self, cells: f64) -> f64 {
        cells - self.period * (cells / self.period).round()
    }

    /// Whether a place `cells` away from the tone lies in its side lobes.
    fn is_side_lobe(&self, cells: f64) -> bool {
        self.wrapped(cells).abs() > self.main_lobe_cells
    }

    /// The response `cells` away from the tone; 0 beyond the table.
    fn at(&self, cells: f64) -> Complex64 {
        let cells = self.wrapped(cells);
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
    /// That of a radar, which is made once for all frames.
    ///
    /// # Errors
    /// Returns an error if a window of the radar's settings cannot be computed.
    pub fn of(radar: &Radar) -> Result<Arc<Response>> {
        static MADE: Memo<Radar, Response> = Memo::new();
        MADE.get(radar, || Response::new(radar))
    }

    fn new(radar: &Radar) -> Result<Response> {
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
            rate_cell_mps: radar.velocity_cell_mps(),
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

    /// Resolution cells of a difference of range rates, wrapped as the map wraps.
    fn rate_cells(&self, mps: f64) -> f64 {
        (mps - self.fold_mps * (mps / self.fold_mps).round()) / self.rate_cell_mps
    }

    /// Width of a resolution cell in range, m.
    pub fn range_cell_m(&self) -> f64 {
        self.range_cell_m
    }

    /// The response to one point.
    pub fn to<'r>(&'r self, point: &Point) -> PointResponse<'r> {
        PointResponse {
            of: self,
            range_m: point.range_m,
            range_rate_mps: point.range_rate_mps,
            steering: self.steering(direction_from_angles(point.azimuth_rad, point.elevation_rad)),
        }
    }

    fn steering(&self, towards: DVec3) -> Steering {
        let steer = |list: &[DVec3]| {
            list.iter().map(|p| Complex64::cis(self.wavenumber * towards.dot(*p))).collect::<Vec<_>>()
        };
        Steering { tx: steer(&self.tx_m), rx: steer(&self.rx_m) }
    }
}

/// The cell and the beam of one point.
pub(super) struct PointResponse<'r> {
    of: &'r Response,
    range_m: f64,
    range_rate_mps: f64,
    /// Towards the point.
    steering: Steering,
}

/// e^{+jk u·p} of each antenna in a direction u.
struct Steering {
    tx: Vec<Complex64>,
    rx: Vec<Complex64>,
}

impl PointResponse<'_> {
    /// Cells of range and of range rate from the point to an echo, coupled as the waveform couples them.
    fn cells_to(&self, range_m: f64, range_rate_mps: f64) -> [f64; 2] {
        let of = self.of;
        let faster = range_rate_mps - self.range_rate_mps;
        let range_cells = (range_m - self.range_m + faster * of.coupling_s) / of.range_cell_m;
        [range_cells, of.rate_cells(faster)]
    }

    /// Whether the point lies in a side lobe of an echo: past the first minimum of the range or the Doppler window, or in a
    /// direction in which the array hears the echo with less than a tenth of the power that it has in the echo's own.
    pub fn is_side_lobe(&self, echo: &EchoPlace) -> bool {
        let of = self.of;
        let [range, rate] = self.cells_to(echo.range_m, echo.range_rate_mps);
        if of.range.is_side_lobe(range) || of.doppler.is_side_lobe(rate) {
            return true;
        }
        // An echo over a mirror may leave in one direction and come back from another.
        let between = (echo.departure + echo.arrival).normalize_or(echo.arrival);
        let own = [echo.arrival, echo.departure, between]
            .into_iter()
            .map(|u| self.array_towards(&of.steering(u), echo).norm_sqr())
            .fold(0.0, f64::max);
        self.array(echo).norm_sqr() < LEAST_OF_MAIN_LOBE * own
    }

    /// The factor of the windows on an echo of unit amplitude. Range and Doppler are coupled as the waveform couples
    /// them, and both wrap as the transforms do.
    pub fn cell(&self, range_m: f64, range_rate_mps: f64) -> Complex64 {
        let of = self.of;
        let [range_cells, rate_cells] = self.cells_to(range_m, range_rate_mps);
        let range = of.range.at(range_cells);
        if range == Complex64::ZERO {
            return range;
        }
        let doppler = of.doppler.at(rate_cells);
        let removed = of.mean.as_ref().map_or(Complex64::ZERO, |mean| {
            mean.at(of.rate_cells(range_rate_mps)) * of.doppler.at(of.rate_cells(-self.range_rate_mps))
        });
        range * (doppler - removed)
    }

    /// The factor of the array on an echo of unit amplitude: the beam towards the point, with the echo's departure at
    /// the transmitters and its arrival at the receivers. Transmitters in turn see the difference of the range rates
    /// too. A point's rate may have been unfolded after its direction was measured, so that the stronger of the two
    /// responses, with the folds and without, counts.
    pub fn array(&self, echo: &EchoPlace) -> Complex64 {
        self.array_towards(&self.steering, echo)
    }

    fn array_towards(&self, steering: &Steering, echo: &EchoPlace) -> Complex64 {
        let of = self.of;
        let faster = echo.range_rate_mps - self.range_rate_mps;
        let folded = of.fold_mps * (faster / of.fold_mps).round();
        let with = self.beam(steering, echo, faster);
        if folded == 0.0 || of.slot_phase == 0.0 {
            return with;
        }
        let without = self.beam(steering, echo, faster - folded);
        if without.norm_sqr() > with.norm_sqr() { without } else { with }
    }

    fn beam(&self, steering: &Steering, echo: &EchoPlace, faster_mps: f64) -> Complex64 {
        let of = self.of;
        let rx: Vec<Complex64> = of
            .rx_m
            .iter()
            .zip(&steering.rx)
            .map(|(p, steer)| steer * Complex64::cis(-of.wavenumber * echo.arrival.dot(*p)))
            .collect();
        of.tx_m
            .iter()
            .zip(&steering.tx)
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
        let Steering { tx, rx } = &self.steering;
        let steer = tx.iter().flat_map(|t| rx.iter().map(move |r| t * r));
        let slots = (0..tx.len()).flat_map(|slot| std::iter::repeat_n(slot as f64, rx.len()));
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
        // Main lobes end at the first nulls, and so do those of the repetitions; a single chirp has no side lobes.
        assert_eq!((flat.main_lobe_cells, hann.main_lobe_cells), (1.0, 2.0));
        let blackman = window::coefficients(crate::scene::radar::Window::Blackman, 256).unwrap();
        assert!((WindowResponse::new(&blackman).main_lobe_cells - 3.0).abs() < 0.2);
        assert!(hann.is_side_lobe(2.4) && hann.is_side_lobe(-2.4) && hann.is_side_lobe(253.0));
        assert!(!hann.is_side_lobe(1.9) && !hann.is_side_lobe(255.0) && !hann.is_side_lobe(-257.0));
        assert!(!WindowResponse::new(&[1.0]).is_side_lobe(0.5));
    }
}
