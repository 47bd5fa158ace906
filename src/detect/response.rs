//! The response of a radar's windows and array to one echo in the cell and direction of a point (CONVENTIONS eq. 160).

use super::points::{Point, wavelength_ratio};
use crate::adc::front_end::spill::Spill;
use crate::adc::shaping::{self, Shaping};
use crate::adc::{Cube, cpu};
use crate::base::error::Result;
use crate::base::frames::direction_from_angles;
use crate::base::memo::Memo;
use crate::base::units::{C0, wavenumber};
use crate::dsp::window;
use crate::scene::radar::{Radar, Sampling};
use crate::scene::waveform::{Multiplex, Waveform};
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Samples of a window's transform per resolution cell; between them it is interpolated linearly, to 1 %.
const STEPS: usize = 8;
/// Smallest power of an echo inside its main lobe, as a share of its power towards the echo itself: the first side lobe of equal
/// weights is 13 dB down.
const MAIN_LOBE: f64 = 0.1;
/// Outside of the main lobe, a direction with at least this share of the power is a grating lobe, one with less a side lobe.
const GRATING_LOBE: f64 = 0.5;
/// Largest path curvature over a frame, as a phase in rad, and largest range migration, in cells, that leave the windows'
/// responses as they are: each changes the peak by less than 2 %.
const STEADY_RAD: f64 = 0.3;
const STEADY_CELLS: f64 = 0.2;
/// Largest turn of an echo's phase between the chirps that are summed, rad, and the fewest chirps of a frame that are: the sum's nearest alias
/// is then 25 cells away, where a rectangular window is at -38 dB and a Hann window below -90 dB.
const TURN_RAD: f64 = 1.0;
const FEWEST_CHIRPS: usize = 32;
/// By how much an echo moves between two places where the range response is taken, cells: half a step of the window's table.
const KNOT_CELLS: f64 = 0.5 / STEPS as f64;

/// The transform of weights over lines or chirps, about their middle, over the distance in resolution cells.
#[derive(Debug, Clone)]
struct WindowResponse {
    /// Over one period.
    table: Vec<Complex64>,
    /// The largest magnitude at each distance to either side, or beyond it, to half a period.
    envelope: Vec<f64>,
    /// Cells after which the transform repeats itself.
    period: f64,
    /// Half the width of the main lobe: cells to the first minimum beside it; infinite where there is none.
    main_lobe_cells: f64,
}

impl WindowResponse {
    /// Of a window, with 1 in its middle.
    fn new(weights: &[f64]) -> WindowResponse {
        let sum: f64 = weights.iter().sum();
        WindowResponse::of(weights.iter().map(|w| Complex64::from(w / sum)).collect())
    }

    fn of(mut weights: Vec<Complex64>) -> WindowResponse {
        let n = weights.len();
        weights.resize(STEPS * n, Complex64::ZERO);
        catseye_math::fft::inverse::<f64>(STEPS * n).process(&mut weights);
        let middle = 0.5 * (n as f64 - 1.0) / (STEPS * n) as f64;
        // Phases count from the middle of the weights; the distance is the nearest one.
        let turned = |(i, z): (usize, &Complex64)| {
            let cells = if 2 * i > STEPS * n { i as f64 - (STEPS * n) as f64 } else { i as f64 };
            z * Complex64::cis(-TAU * middle * cells)
        };
        let table: Vec<Complex64> = weights.iter().enumerate().map(turned).collect();
        let half = STEPS * n / 2;
        let mut envelope: Vec<f64> =
            (0..=half).map(|i| table[i].norm().max(table[(STEPS * n - i) % (STEPS * n)].norm())).collect();
        let null = (1..half).find(|&i| table[i].norm() < 0.5 && table[i].norm() < table[i + 1].norm());
        for i in (1..envelope.len()).rev() {
            envelope[i - 1] = envelope[i - 1].max(envelope[i]);
        }
        let main_lobe_cells = null.map_or(f64::INFINITY, |i| i as f64 / STEPS as f64);
        WindowResponse { table, envelope, period: n as f64, main_lobe_cells }
    }

    /// The distance from the tone or from its nearest repetition, cells.
    fn wrapped(&self, cells: f64) -> f64 {
        if 2.0 * cells.abs() < self.period {
            return cells;
        }
        cells - self.period * (cells / self.period).round()
    }

    /// The response `cells` away from the tone.
    fn at(&self, cells: f64) -> Complex64 {
        let place = self.wrapped(cells) * STEPS as f64;
        // Truncation, because `floor` is a call on processors of no stated kind.
        let truncated = place as isize;
        let below = truncated - isize::from(truncated as f64 > place);
        let [low, high] = [below, below + 1]
            .map(|i| self.table[if i < 0 { i + self.table.len() as isize } else { i } as usize]);
        low + (high - low) * (place - below as f64)
    }

    /// A bound of the response this far from the tone or farther, within half a period, cells.
    fn bound(&self, distance: f64) -> f64 {
        let i = (distance * STEPS as f64) as usize;
        self.envelope[i.min(self.envelope.len() - 1)]
    }
}

/// The range windows' response. What a moving echo's phase turns within one record of a code leaves range side lobes of its own:
/// they are a series in the phase of half a record, of which three terms are taken.
#[derive(Debug, Clone)]
struct RangeResponse {
    orders: Vec<WindowResponse>,
}

impl RangeResponse {
    fn new(radar: &Radar) -> Result<RangeResponse> {
        let lines = radar.lines();
        let weights = window::coefficients(radar.processing.range_window, lines.count)?;
        let sum: f64 = weights.iter().sum();
        match &radar.waveform {
            Waveform::Fmcw(_) | Waveform::Stepped { .. } => {
                Ok(RangeResponse { orders: vec![WindowResponse::new(&weights)] })
            }
            Waveform::Pulse { .. } => {
                let spectrum = shaping::spectrum(radar, &lines);
                let weights: Vec<f64> =
                    weights.iter().zip(&spectrum).map(|(w, s)| w * s.norm_sqr()).collect();
                Ok(RangeResponse { orders: vec![WindowResponse::new(&weights)] })
            }
            Waveform::Coded { .. } => {
                let mut one =
                    Radar { multiplex: Multiplex::Tdm, chirps: 1, adc_start_s: 0.0, ..radar.clone() };
                one.tx.truncate(1);
                one.rx.truncate(1);
                let Some(shape) = Shaping::of(&one, 0.0) else {
                    return Ok(RangeResponse { orders: vec![WindowResponse::new(&weights)] });
                };
                let mut echo = Cube::<f64>::zeros(1, 1, lines.count);
                echo.data.fill(Complex64::ONE);
                let order = |q: u32| {
                    let mut samples = Cube::<f64>::zeros(1, 1, one.samples);
                    cpu::shaping::add(&shape, &echo, q, &mut samples);
                    let seen = crate::dsp::cpu::lines::lines(&samples, &one)?;
                    let weighted = seen.data.iter().zip(&weights).map(|(z, w)| z * (w / sum));
                    Ok(WindowResponse::of(weighted.collect()))
                };
                Ok(RangeResponse { orders: (0..3).map(order).collect::<Result<_>>()? })
            }
        }
    }

    /// (jθ)^q/q! for each order.
    fn at(&self, cells: f64, half_turn_rad: f64) -> Complex64 {
        let mut sum = self.first().at(cells);
        let mut term = Complex64::ONE;
        for (q, response) in self.orders.iter().enumerate().skip(1) {
            term *= Complex64::new(0.0, half_turn_rad / q as f64);
            sum += term * response.at(cells);
        }
        sum
    }

    fn bound(&self, span: Span, half_turn_rad: f64) -> f64 {
        let distance = span.distance(self.first().period);
        let mut sum = self.first().bound(distance);
        let mut term = 1.0;
        for (q, response) in self.orders.iter().enumerate().skip(1) {
            term *= half_turn_rad.abs() / q as f64;
            sum += term * response.bound(distance);
        }
        sum
    }

    fn first(&self) -> &WindowResponse {
        &self.orders[0]
    }
}

/// An interval of distances, cells.
#[derive(Debug, Clone, Copy)]
struct Span {
    low: f64,
    high: f64,
}

impl Span {
    /// The distance from zero to the interval, which repeats with `period`.
    fn distance(self, period: f64) -> f64 {
        let twice_middle = self.low + self.high;
        let turns =
            if twice_middle.abs() < period { 0.0 } else { period * (0.5 * twice_middle / period).round() };
        (self.low - turns).max(turns - self.high).max(0.0)
    }
}

/// Where an echo appears over the frame: a cubic range in time about the middle of the chirps, and the directions in
/// which it leaves and returns.
#[derive(Debug, Clone, Copy)]
pub(super) struct EchoPath {
    /// Range and its first three derivatives in the middle of the chirps, m to m/s³.
    range: [f64; 4],
    /// Smallest and largest beat over the frame, as a range, m.
    beat_m: [f64; 2],
    /// Smallest and largest range rate over the frame, m/s.
    rate_mps: [f64; 2],
    /// Whether range rate and range cell are steady over the frame.
    steady: bool,
    /// Unit vectors in the sensor frame.
    departure: DVec3,
    arrival: DVec3,
    /// The echo's image at the negative beat frequency, which real samples have too.
    image: bool,
}

impl EchoPath {
    /// Range in the middle of the chirps, m.
    pub fn range_m(&self) -> f64 {
        self.range[0]
    }
    /// The direction in which a radar with transmitters and receivers in one place sees the echo.
    pub fn direction(&self) -> DVec3 {
        (self.departure + self.arrival).normalize_or(self.arrival)
    }
    /// The image at the negative beat frequency.
    pub fn image(&self) -> EchoPath {
        EchoPath {
            range: self.range.map(|x| -x),
            beat_m: [-self.beat_m[1], -self.beat_m[0]],
            rate_mps: [-self.rate_mps[1], -self.rate_mps[0]],
            departure: -self.departure,
            arrival: -self.arrival,
            image: true,
            ..*self
        }
    }
}

/// How the place of a point differs from that of an echo, whatever the reason.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Offset {
    /// In a side lobe along range, range rate or direction.
    pub side_lobe: bool,
    /// The beat frequency is outside of the sampled band: ramps and stepped frequencies sample it.
    pub aliased: bool,
    /// The range is beyond one period of pulses or codes.
    pub beyond_period: bool,
    /// Doppler ambiguity intervals from the point's range rate to the echo's.
    pub doppler_intervals: f64,
    /// In a grating lobe of the array.
    pub grating_lobe: bool,
}

/// A radar's windows and array.
#[derive(Debug, Clone)]
pub(super) struct Response {
    range: RangeResponse,
    /// Time of half a record of a code, s; 0 for other waveforms.
    half_record_s: f64,
    doppler: WindowResponse,
    /// Of the mean over chirps, where it is taken out (`processing.remove_static`).
    mean: Option<WindowResponse>,
    /// Weights of the chirps, of sum 1.
    doppler_weights: Vec<f64>,
    /// Widths of the resolution cells, and of the bins of the map.
    range_cell_m: f64,
    rate_cell_mps: f64,
    /// Cells in range and range rate, 1/m and s/m.
    cells_per_unit: [f64; 2],
    bin_m: f64,
    bin_mps: f64,
    /// From range rate to range: by the Doppler shift of the beat, and with the time from the middle of the frame to that of the
    /// chirps.
    doppler_coupling_s: f64,
    coupling_s: f64,
    /// Time from chirp to chirp of a transmitter, and of their middle from that of the frame.
    loop_s: f64,
    middle_s: f64,
    /// Whether targets are held in their range cells.
    keystone: bool,
    /// Whether real samples show the image of a beat frequency too.
    real: bool,
    /// Whether delays are found as beat frequencies.
    beats: bool,
    ambiguity_mps: f64,
    tx_m: Vec<DVec3>,
    rx_m: Vec<DVec3>,
    /// w_c / Σw of eq. 19, `[tx, rx]`.
    weights: Vec<f64>,
    /// Half the width of the main lobe along y and z, as a sine; infinite along an axis without an aperture.
    main_lobe_sine: [f64; 2],
    wavenumber: f64,
    centre_hz: f64,
    /// Phase that a slot adds for each m/s, rad.
    slot_phase: f64,
    /// By which share the wavelength of eq. 16a is shorter than that of an echo, for each m of its range.
    shorter_per_m: f64,
    /// Signs of transmitters that send at once, `[slot, tx]`; empty where each has its own slot.
    signs: Vec<f64>,
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
        let z: Vec<f64> = tx_m.iter().flat_map(|t| rx_m.iter().map(move |r| t.z + r.z)).collect();
        let mut weights = window::at_positions(p.angle_window, &y)?;
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        let slot_phase = match radar.multiplex {
            Multiplex::Tdm | Multiplex::Bpm => {
                TAU * 2.0 / radar.sample_wavelength_m() * radar.chirp_period_s()
            }
            Multiplex::Ddm { .. } => 0.0,
        };
        let signs = match radar.multiplex {
            Multiplex::Bpm => {
                let of = |slot| (0..radar.tx.len()).map(move |tx| radar.multiplex.weight(slot, tx));
                (0..radar.slots()).flat_map(of).collect()
            }
            _ => Vec::new(),
        };
        let mut doppler_weights = window::coefficients(p.doppler_window, radar.chirps)?;
        let doppler = WindowResponse::new(&doppler_weights);
        let sum: f64 = doppler_weights.iter().sum();
        doppler_weights.iter_mut().for_each(|w| *w /= sum);
        // Elements of a filled line: its main lobe in cells of one over the aperture is that of any line with this window.
        let line = WindowResponse::new(&window::coefficients(p.angle_window, 64)?).main_lobe_cells;
        let main_lobe_sine =
            [y, z].map(|at| line * radar.sample_wavelength_m() / aperture_m(at, radar.sample_wavelength_m()));
        let coupling_s = radar.range_per_rate_s();
        let range_cell_m = C0 / (2.0 * lines.step_hz.abs() * lines.count as f64);
        let rate_cell_mps = radar.velocity_cell_mps();
        Ok(Response {
            range: RangeResponse::new(radar)?,
            half_record_s: match radar.waveform {
                Waveform::Coded { .. } => 0.5 * radar.samples as f64 / radar.sample_rate_hz,
                _ => 0.0,
            },
            doppler,
            mean: p.remove_static.then(|| WindowResponse::new(&vec![1.0; radar.chirps])),
            doppler_weights,
            range_cell_m,
            rate_cell_mps,
            cells_per_unit: [1.0 / range_cell_m, 1.0 / rate_cell_mps],
            bin_m: radar.range_bin_m(),
            bin_mps: radar.velocity_bin_mps(),
            doppler_coupling_s: coupling_s - radar.middle_s(),
            coupling_s,
            loop_s: radar.loop_period_s(),
            middle_s: radar.middle_s(),
            keystone: p.keystone,
            real: radar.line_sampling() == Sampling::Real,
            beats: matches!(radar.waveform, Waveform::Fmcw(_) | Waveform::Stepped { .. }),
            ambiguity_mps: 2.0 * radar.max_velocity_mps(),
            tx_m,
            rx_m,
            weights,
            main_lobe_sine,
            wavenumber: wavenumber(radar.sample_centre_hz()),
            centre_hz: radar.sample_centre_hz(),
            slot_phase,
            shorter_per_m: 1.0 - 1.0 / wavelength_ratio(radar, 1.0),
            signs,
        })
    }

    /// The path of an echo of this length with its derivatives in the middle of the frame, m to m/s³, in the middle of the chirps.
    pub fn path(&self, length: [f64; 4], departure: DVec3, arrival: DVec3) -> EchoPath {
        let [r, v, a, j] = length.map(|x| 0.5 * x);
        let t = self.middle_s;
        let range = [r + t * (v + 0.5 * t * (a + t * j / 3.0)), v + t * (a + 0.5 * t * j), a + t * j, j];
        let half_s = 0.5 * self.loop_s * (self.doppler_weights.len() as f64 - 1.0);
        // A cubic's extremes are missed by at most a few per cent of its bend.
        let times = (-4..=4).map(|i| half_s * f64::from(i) / 4.0);
        let extent = |of: &dyn Fn(f64) -> f64| {
            times
                .clone()
                .map(of)
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
        };
        let beat_m = extent(&|u| self.beat_m(&range, u));
        let rate_mps = extent(&|u| range[1] + u * (range[2] + 0.5 * u * range[3]));
        let curved_m = half_s * half_s * (0.5 * range[2].abs() + half_s * range[3].abs() / 6.0);
        let steady = 2.0 * self.wavenumber * curved_m < STEADY_RAD
            && beat_m[1] - beat_m[0] < STEADY_CELLS * self.range_cell_m;
        EchoPath { range, beat_m, rate_mps, steady, departure, arrival, image: false }
    }

    /// The beat of a path at time `u` from the middle of the chirps, as a range.
    fn beat_m(&self, range: &[f64; 4], u: f64) -> f64 {
        let [r, v, a, j] = *range;
        let migration = if self.keystone { 0.0 } else { u * v };
        let rate = v + u * (a + 0.5 * u * j);
        r + migration + 0.5 * u * u * (a + u * j / 3.0) + rate * self.doppler_coupling_s
    }

    /// Whether real samples show every beat frequency's image too.
    pub fn has_images(&self) -> bool {
        self.real
    }

    /// Phase by which an echo turns within half a record of a code.
    fn half_turn_rad(&self, rate_mps: f64) -> f64 {
        2.0 * self.wavenumber * rate_mps * self.half_record_s
    }

    /// Resolution cells of a difference of range rates, wrapped as the map wraps.
    fn rate_cells(&self, mps: f64) -> f64 {
        (mps - self.ambiguity_mps * (mps / self.ambiguity_mps).round()) / self.rate_cell_mps
    }

    /// Width of a resolution cell in range, m.
    pub fn range_cell_m(&self) -> f64 {
        self.range_cell_m
    }

    /// By how much an error of the range rate moves a point in range, m per m/s.
    pub fn coupling_s(&self) -> f64 {
        self.coupling_s
    }

    /// Width of the interval of unambiguous range rates of a map, m/s.
    pub fn ambiguity_mps(&self) -> f64 {
        self.ambiguity_mps
    }

    /// Phase of an echo in the middle of the chirps over its amplitude at zero delay.
    pub fn phase(&self, path: &EchoPath) -> Complex64 {
        Complex64::cis(2.0 * self.wavenumber * path.range[0])
    }

    /// The response to one point, in the cell where the map shows it.
    pub fn to<'r>(&'r self, point: &Point) -> PointResponse<'r> {
        let towards = direction_from_angles(point.azimuth_rad, point.elevation_rad);
        let [range_m, range_rate_mps] = point.cell.unwrap_or([point.range_m, point.range_rate_mps]);
        PointResponse {
            of: self,
            beat_m: range_m + range_rate_mps * self.coupling_s,
            range_rate_mps: range_rate_mps * (1.0 - self.shorter_per_m * range_m),
            placed_mps: point.range_rate_mps,
            towards,
            steering: self.steering(towards),
        }
    }

    fn steering(&self, towards: DVec3) -> Steering {
        let steer = |list: &[DVec3]| {
            list.iter().map(|p| Complex64::cis(self.wavenumber * towards.dot(*p))).collect::<Vec<_>>()
        };
        Steering { tx: steer(&self.tx_m), rx: steer(&self.rx_m) }
    }

    /// What the separation of transmitters makes of their amplitudes, of something that is faster by this than the range rate whose turn
    /// from slot to slot is taken out. Slots count from the middle of a loop.
    fn separated(&self, mut sent: Vec<Complex64>, faster_mps: f64) -> Vec<Complex64> {
        if self.slot_phase == 0.0 || faster_mps == 0.0 {
            return sent;
        }
        let transmitters = sent.len();
        let slots = if self.signs.is_empty() { transmitters } else { self.signs.len() / transmitters };
        let turn = |slot: usize| {
            Complex64::cis(self.slot_phase * faster_mps * (slot as f64 - 0.5 * (slots as f64 - 1.0)))
        };
        if self.signs.is_empty() {
            sent.iter_mut().enumerate().for_each(|(slot, a)| *a *= turn(slot));
            return sent;
        }
        let mut out = vec![Complex64::ZERO; transmitters];
        for (slot, signs) in self.signs.chunks(transmitters).enumerate() {
            let received: Complex64 = sent.iter().zip(signs).map(|(a, sign)| a * *sign).sum();
            let turned = received * turn(slot) / slots as f64;
            out.iter_mut().zip(signs).for_each(|(a, sign)| *a += turned * *sign);
        }
        out
    }
}

/// Length of a line of elements with half a mean spacing at each end, m; 0 where they are all at one place, to a tenth of a
/// wavelength.
fn aperture_m(mut at: Vec<f64>, wavelength_m: f64) -> f64 {
    at.sort_by(f64::total_cmp);
    at.dedup_by(|a, b| (*a - *b).abs() < 0.1 * wavelength_m);
    match at[..] {
        [first, .., last] => (last - first) * at.len() as f64 / (at.len() as f64 - 1.0),
        _ => 0.0,
    }
}

/// The cell and the beam of one point.
#[derive(Clone)]
pub(super) struct PointResponse<'r> {
    of: &'r Response,
    /// Range of the point's column with the Doppler coupling in it, m.
    beat_m: f64,
    range_rate_mps: f64,
    /// The range rate with which the point's range was found, m/s.
    placed_mps: f64,
    towards: DVec3,
    /// Towards the point.
    steering: Steering,
}

/// e^{+jk u·p} of each antenna in a direction u.
#[derive(Clone)]
struct Steering {
    tx: Vec<Complex64>,
    rx: Vec<Complex64>,
}

impl PointResponse<'_> {
    /// The same by so many bins of range and range rate beside the point.
    pub fn beside(&self, range_bins: f64, rate_bins: f64) -> Self {
        let range_rate_mps = self.range_rate_mps + rate_bins * self.of.bin_mps;
        PointResponse { beat_m: self.beat_m + range_bins * self.of.bin_m, range_rate_mps, ..self.clone() }
    }

    /// Range cells and rate cells from the point to all that an echo goes through over the frame.
    fn spans(&self, echo: &EchoPath) -> [Span; 2] {
        let of = self.of;
        let [per_range_cell, per_rate_cell] = of.cells_per_unit;
        let range = echo.beat_m.map(|b| (b - self.beat_m) * per_range_cell);
        let rate = echo.rate_mps.map(|v| (v - self.range_rate_mps) * per_rate_cell);
        [Span { low: range[0], high: range[1] }, Span { low: rate[0], high: rate[1] }]
    }

    /// Range rates of one ambiguity interval, in cells.
    fn rate_period(&self) -> f64 {
        self.of.ambiguity_mps * self.of.cells_per_unit[1]
    }

    /// How the point's place differs from the echo's. It is in a side lobe past the first minimum of the range or the Doppler
    /// window, or in a direction in which the array's response to the echo is weak.
    pub fn offset(&self, echo: &EchoPath) -> Offset {
        let of = self.of;
        let [range, rate] = self.spans(echo);
        let mut side_lobe = range.distance(of.range.first().period) > of.range.first().main_lobe_cells
            || rate.distance(self.rate_period()) > of.doppler.main_lobe_cells;
        let periods = (0.5 * (range.low + range.high) / of.range.first().period).round();
        let is_beyond = echo.image || periods != 0.0;
        // An echo over a reflecting surface may leave in one direction and return from another.
        let own = [echo.arrival, echo.departure, echo.direction()];
        let powers = own.map(|u| self.array_towards(&of.steering(u), echo).norm_sqr());
        let largest = powers.iter().copied().fold(0.0, f64::max);
        let share = self.array(echo).norm_sqr() / largest.max(f64::MIN_POSITIVE);
        let off = |u: &DVec3| {
            let [y, z] = [(u.y - self.towards.y).abs(), (u.z - self.towards.z).abs()];
            let [lobe_y, lobe_z] = of.main_lobe_sine;
            y > lobe_y || z > lobe_z
        };
        let outside = own.iter().all(off);
        let grating_lobe = outside && share >= GRATING_LOBE;
        side_lobe |= if outside { share < GRATING_LOBE } else { share < MAIN_LOBE };
        let faster = (echo.range[1] - self.placed_mps) / of.ambiguity_mps;
        Offset {
            side_lobe,
            aliased: is_beyond && of.beats,
            beyond_period: is_beyond && !of.beats,
            doppler_intervals: if of.doppler_weights.len() > 1 { faster.round() } else { 0.0 },
            grating_lobe,
        }
    }

    /// A bound of |[`Self::cell`]|.
    pub fn bound(&self, echo: &EchoPath) -> f64 {
        let of = self.of;
        let [range, rate] = self.spans(echo);
        let range = of.range.bound(range, of.half_turn_rad(echo.range[1]));
        if of.mean.is_some() {
            return 2.0 * range;
        }
        // A cell more on each side: a swept tone's ends ripple.
        let slack = if echo.steady { 0.0 } else { 1.0 };
        let distance = Span { low: rate.low - slack, high: rate.high + slack }.distance(self.rate_period());
        range * of.doppler.bound(distance)
    }

    /// The factor of the windows on an echo of unit amplitude in the middle of the chirps. Range and Doppler are coupled as the
    /// waveform couples them, and both wrap as the transforms do.
    pub fn cell(&self, echo: &EchoPath) -> Complex64 {
        let of = self.of;
        let removed = |range: Complex64| {
            of.mean.as_ref().map_or(Complex64::ZERO, |mean| {
                range
                    * mean.at(of.rate_cells(echo.range[1]))
                    * of.doppler.at(of.rate_cells(-self.range_rate_mps))
            })
        };
        if echo.steady {
            let beat_m = of.beat_m(&echo.range, 0.0);
            let turn = of.half_turn_rad(echo.range[1]);
            let range = of.range.at((beat_m - self.beat_m) / of.range_cell_m, turn);
            let rate = of.rate_cells(echo.range[1] - self.range_rate_mps);
            return range * of.doppler.at(rate) - removed(range);
        }
        let v = echo.range[1];
        let chirps = of.doppler_weights.len();
        // Chirps are as good as every few of them while the phase turns little from one to the next. Whole ambiguity intervals turn it by
        // whole turns, which leaves their phase at the first chirp.
        let intervals = ((v - self.range_rate_mps) / of.ambiguity_mps).round();
        let alias_mps = self.range_rate_mps + intervals * of.ambiguity_mps;
        let fastest = echo.rate_mps.into_iter().map(|rate| (rate - alias_mps).abs()).fold(0.0, f64::max);
        let step_rad = 2.0 * of.wavenumber * fastest * of.loop_s;
        let stride = ((TURN_RAD / step_rad) as usize).clamp(1, (chirps / FEWEST_CHIRPS).max(1));
        let total: f64 = of.doppler_weights.iter().skip(stride / 2).step_by(stride).sum();
        let middle = 0.5 * (chirps as f64 - 1.0);
        let seen = self.sum(echo, alias_mps, stride, &of.doppler_weights) / total
            * Complex64::cis(-TAU * (intervals * middle).fract());
        if of.mean.is_none() {
            return seen;
        }
        let mean = self.sum(echo, 0.0, 1, &vec![1.0 / chirps as f64; chirps]);
        seen - mean * of.doppler.at(of.rate_cells(-self.range_rate_mps))
    }

    /// The sum of weights times the range response to an echo, mixed down by a range rate, over every `stride`-th chirp.
    fn sum(&self, echo: &EchoPath, rate_mps: f64, stride: usize, weights: &[f64]) -> Complex64 {
        let of = self.of;
        let [_, v, a, j] = echo.range;
        let middle = 0.5 * (weights.len() as f64 - 1.0);
        let start = stride / 2;
        let count = (weights.len() - start).div_ceil(stride);
        let first = (start as f64 - middle) * of.loop_s;
        let step = stride as f64 * of.loop_s;
        // The phase is a cubic in time: its differences from chirp to chirp turn by differences of their own, and the third is constant.
        let k = 2.0 * of.wavenumber;
        let [c1, c2, c3] = [k * (v - rate_mps), k * a / 2.0, k * j / 6.0];
        let mut tone = Complex64::cis(first * (c1 + first * (c2 + first * c3)));
        let mut turn = Complex64::cis(
            step * (c1
                + c2 * (2.0 * first + step)
                + c3 * (3.0 * first * first + 3.0 * first * step + step * step)),
        );
        let mut turn_of_turn = Complex64::cis(2.0 * step * step * (c2 + 3.0 * c3 * (first + step)));
        let last = Complex64::cis(6.0 * c3 * step * step * step);
        // The range response is taken each time the echo has moved by a small part of a cell, and is linear between.
        let half_turn = of.half_turn_rad(v);
        let range_at = |i: usize| {
            let beat_m = of.beat_m(&echo.range, first + i as f64 * step);
            of.range.at((beat_m - self.beat_m) / of.range_cell_m, half_turn)
        };
        let moved_cells = (echo.beat_m[1] - echo.beat_m[0]) / of.range_cell_m;
        let spans = ((moved_cells / KNOT_CELLS) as usize + 1).min(count);
        let mut sum = Complex64::ZERO;
        let mut range = range_at(0);
        for span in 0..spans {
            let [from, to] = [span, span + 1].map(|s| s * count / spans);
            let next = range_at(to);
            let slope = (next - range) / (to - from) as f64;
            for weight in weights[start + from * stride..].iter().step_by(stride).take(to - from) {
                sum += range * tone * *weight;
                range += slope;
                tone *= turn;
                turn *= turn_of_turn;
                turn_of_turn *= last;
            }
            range = next;
        }
        sum
    }

    /// The factor of the array on an echo of unit amplitude: the beam towards the point, with the echo's departure at
    /// the transmitters and its arrival at the receivers. Slots see the difference of the range rates too: with TDM each transmitter
    /// in its own, with BPM each code in all.
    pub fn array(&self, echo: &EchoPath) -> Complex64 {
        self.array_towards(&self.steering, echo)
    }

    fn array_towards(&self, steering: &Steering, echo: &EchoPath) -> Complex64 {
        let of = self.of;
        let faster_mps = echo.range[1] - self.range_rate_mps;
        let rx: Vec<Complex64> = of
            .rx_m
            .iter()
            .zip(&steering.rx)
            .map(|(p, steer)| steer * Complex64::cis(-of.wavenumber * echo.arrival.dot(*p)))
            .collect();
        let sent = of.tx_m.iter().map(|p| Complex64::cis(-of.wavenumber * echo.departure.dot(*p))).collect();
        of.separated(sent, faster_mps)
            .iter()
            .zip(&steering.tx)
            .zip(of.weights.chunks(rx.len().max(1)))
            .map(|((sent, steer), weights)| {
                let received: Complex64 = rx.iter().zip(weights).map(|(r, w)| r * *w).sum();
                steer * sent * received
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
        let receivers = rx.len();
        let at_rest = |a: Complex64, delay_s: f64| {
            let tone = a.conj() * Complex64::cis(TAU * of.centre_hz * delay_s) * gain(delay_s);
            tone * self.cell(&of.path([C0 * delay_s, 0.0, 0.0, 0.0], DVec3::X, DVec3::X))
        };
        let seen: Vec<Complex64> = spill.channels.iter().map(|(a, delay_s)| at_rest(*a, *delay_s)).collect();
        let mut sum = Complex64::ZERO;
        for (r, steer) in rx.iter().enumerate() {
            let sent = seen.iter().skip(r).step_by(receivers).copied().collect();
            let own = of.separated(sent, -self.range_rate_mps);
            let weights = of.weights.iter().skip(r).step_by(receivers);
            sum += own.iter().zip(tx).zip(weights).map(|((a, t), w)| a * t * *w).sum::<Complex64>() * steer;
        }
        sum
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
        assert!(hann.at(100.0).norm() < 1e-5);
        // Main lobes end at the first nulls, and so do those of the repetitions; a single chirp has no side lobes.
        assert_eq!((flat.main_lobe_cells, hann.main_lobe_cells), (1.0, 2.0));
        let blackman = window::coefficients(crate::scene::radar::Window::Blackman, 256).unwrap();
        assert!((WindowResponse::new(&blackman).main_lobe_cells - 3.0).abs() < 0.2);
        // A single chirp has no side lobes.
        assert_eq!(WindowResponse::new(&[1.0]).main_lobe_cells, f64::INFINITY);
        assert_eq!(WindowResponse::new(&[1.0]).at(0.3), Complex64::ONE);
    }

    /// A target that accelerates and crosses range cells, against the sum over every sample of every chirp.
    #[test]
    fn a_moving_echo_against_the_sum_over_all_samples() {
        let radar = crate::scene::radar_toml::preset("demo77").unwrap();
        let response = Response::new(&radar).unwrap();
        let lines = radar.lines();
        let chirps = radar.chirps;
        let range_weights = window::coefficients(radar.processing.range_window, lines.count).unwrap();
        let sum: f64 = range_weights.iter().sum();
        let span_s = radar.burst_time_s();
        // Curvature of some Doppler cells, and a range migration of some range cells.
        let acceleration = 6.0 * response.rate_cell_mps / span_s;
        let rate = 2.5 * response.range_cell_m / span_s;
        for (rate, acceleration) in [(rate, 0.0), (0.0, acceleration), (-rate, -acceleration), (0.1, 0.0)] {
            let length = [40.0, 2.0 * rate, 2.0 * acceleration, 0.0];
            let echo = response.path(length, DVec3::X, DVec3::X);
            let range_at = |t: f64| 20.0 + rate * t + 0.5 * acceleration * t * t;
            for (cells, rows) in [(0.0, 0.0), (0.6, -0.8), (-1.4, 2.2)] {
                let point_rate = rate + rows * response.rate_cell_mps;
                let column_m = echo.range[0]
                    + echo.range[1] * response.doppler_coupling_s
                    + cells * response.range_cell_m;
                let to = PointResponse {
                    of: &response,
                    beat_m: column_m,
                    range_rate_mps: point_rate,
                    placed_mps: point_rate,
                    towards: DVec3::X,
                    steering: response.steering(DVec3::X),
                };
                let mut want = Complex64::ZERO;
                for m in 0..chirps {
                    let u = (m as f64 - 0.5 * (chirps as f64 - 1.0)) * response.loop_s;
                    for (n, w) in range_weights.iter().enumerate() {
                        let ramp_s = (n as f64 - 0.5 * (lines.count as f64 - 1.0)) * lines.step_s;
                        let hz = lines.first_hz + n as f64 * lines.step_hz;
                        let at = range_at(response.middle_s + u + ramp_s);
                        let phase = TAU * 2.0 / C0 * hz * at
                            - 2.0 * response.wavenumber * (echo.range[0] + point_rate * u)
                            - TAU * 2.0 / C0 * (hz - response.centre_hz) * column_m;
                        want += response.doppler_weights[m] * w / sum * Complex64::cis(phase);
                    }
                }
                let got = to.cell(&echo);
                // Linear interpolation of the window's table, and the steady response, are exact to 2 %.
                assert!((got - want).norm() < 0.025, "{rate} {acceleration} {cells} {rows}: {got} {want}");
                assert!(got.norm() <= 1.01 * to.bound(&echo));
            }
        }
    }
}
