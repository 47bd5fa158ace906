//! Synthesis by gridding: how a set of echoes is summed without visiting every echo at every sample
//! (CONVENTIONS eq. 80-84). The engines follow the [`Layout`] that is made here.
//!
//! Chirps are cut into blocks. In a block, about its middle, the phase of an echo is
//! a0 + n b0 + m a1 + b1 m n + c n² + a2 m² turns, and b1, c and a2 come from the same motion as a1:
//! b1 = κ a1 + κ₀ and so on, nearly the same for all echoes. So the phase is n b0 + a1 t(m, n) with
//! a slow time t = m + κ m n + γ n² + α m² that the sample warps (keystone), and what κ₀, γ₀ and α₀ add
//! is known. Echoes are spread on a grid of b0 (cells) and a1 (lines); each line is transformed to
//! samples; at each sample the lines are added up with e^{2πj t a1}. The cost of a sample does not
//! depend on the number of echoes, nor on how far they migrate.

use super::methods::{Gridded, Method};
use super::synthesis::Plan;
use num_complex::Complex32;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Cells over which an echo is spread, on each axis.
pub const TAPS: usize = 8;

/// Lines for each line that the band of slow time alone would need.
const LINE_OVERSAMPLING: f64 = 1.4;

/// Bounds of the phase that the warp leaves over at the corners of a block, rad: of the echo that is
/// worst, and in the mean over echoes by power.
const WORST_RESIDUAL: f64 = 7e-5;

const MEAN_RESIDUAL: f64 = 2e-5;

/// Bounds of what bent paths leave over at the ends of a block, rad: of the worst echo, and as a share of the cube (-60 dB).
const WORST_BEND: f64 = 0.3;

const MEAN_BEND: f64 = 1e-3;

/// Rounding in f32: transforms of some hundred values and as many terms of a polynomial.
const ROUNDING: f64 = 1.5e-6;

/// Most echoes whose sum in one cell is left to f32 alone: equal ones lose 3e-5 of the peak.
const PORTION: usize = 512;

/// Echoes times channels whose coefficients are kept at a time (64 bytes each).
pub const ECHOES_KEPT: usize = 1 << 21;

/// The bell that spreads an echo over [`TAPS`] cells: I₀(β√(1 − d²))/I₀(β), d from -1 to 1
/// (Kaiser-Bessel). Its transform is known in closed form.
#[derive(Debug, Clone, PartialEq)]
pub struct Bell {
    beta: f64,
    /// I₀(β).
    peak: f64,
    /// Polynomial in 1 − d², lowest order first; positive terms, so that nothing cancels.
    pub polynomial: [f32; DEGREE + 1],
}

/// Degree of the polynomial of a bell: within 5e-7 of its peak at the widest oversampling.
pub const DEGREE: usize = 13;

impl Bell {
    /// For frequencies up to 1/(2 oversampling) cycles a cell. β puts the first zero of the transform
    /// where the image of that band begins.
    pub fn new(oversampling: f64) -> Bell {
        let beta = 0.98 * PI * TAPS as f64 * (1.0 - 0.5 / oversampling);
        let peak = bessel_i0(beta);
        let f = |s: f64| bessel_i0(beta * s.max(0.0).sqrt()) / peak;
        Bell { beta, peak, polynomial: economised(f).map(|c| c as f32) }
    }

    /// Its value at distance d, in halves of its width.
    pub fn at(&self, d: f64) -> f64 {
        if d.abs() > 1.0 { 0.0 } else { bessel_i0(self.beta * (1.0 - d * d).sqrt()) / self.peak }
    }

    /// ∫ bell e^{2πj f x} dx, x in cells.
    pub fn transform(&self, f: f64) -> f64 {
        let w = TAPS as f64;
        let q = self.beta * self.beta - (PI * w * f).powi(2);
        let r = q.abs().sqrt();
        let shape = match () {
            () if r < 1e-4 => 1.0,
            () if q > 0.0 => r.sinh() / r,
            () => r.sin() / r,
        };
        w * shape / self.peak
    }

    /// What images add at frequencies up to 1/(2 oversampling), relative to the signal: the largest.
    pub fn aliasing(&self, oversampling: f64) -> f64 {
        let band = 0.5 / oversampling;
        let at = |f: f64| {
            let images: f64 = (1..40)
                .flat_map(|k| [f64::from(k), -f64::from(k)])
                .map(|k| self.transform(f + k).powi(2))
                .sum();
            images.sqrt() / self.transform(f)
        };
        (0..=32).map(|i| at(band * f64::from(i) / 32.0)).fold(0.0, f64::max)
    }
}

/// Modified Bessel function of the first kind, order zero, by its series.
fn bessel_i0(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-17 * sum {
        term *= quarter / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}

/// Coefficients of the polynomial through f at the Chebyshev nodes of [0, 1].
fn economised(f: impl Fn(f64) -> f64) -> [f64; DEGREE + 1] {
    const N: usize = DEGREE + 1;
    let node = |i: usize| (PI * (i as f64 + 0.5) / N as f64).cos();
    let values: Vec<f64> = (0..N).map(|i| f(0.5 + 0.5 * node(i))).collect();
    let mut sum = [0.0; N];
    // Shifted Chebyshev polynomials T_k(2s − 1) by powers of s.
    let (mut before, mut this) = ([0.0; N], [0.0; N]);
    (before[0], this[0]) = (0.0, 1.0);
    for k in 0..N {
        let weight: f64 =
            (0..N).map(|i| values[i] * (PI * k as f64 * (i as f64 + 0.5) / N as f64).cos()).sum::<f64>()
                * if k == 0 { 1.0 } else { 2.0 }
                / N as f64;
        for (s, t) in sum.iter_mut().zip(&this) {
            *s += weight * t;
        }
        let scale = if k == 0 { 1.0 } else { 2.0 };
        let next: [f64; N] = std::array::from_fn(|i| {
            let shifted = if i > 0 { 2.0 * this[i - 1] } else { 0.0 };
            scale * (shifted - this[i]) - if k == 0 { 0.0 } else { before[i] }
        });
        (before, this) = (this, next);
    }
    sum
}

/// Coefficients of some echoes about the middle of frame and ramp, `[channel, echo]`.
#[derive(Debug, Clone, Default)]
pub struct GridEchoes {
    /// Number of echoes.
    pub count: usize,
    /// Number of virtual channels.
    pub channels: usize,
    /// Amplitudes at the middle, `[channel, echo]`, √W.
    pub amplitude: Vec<Complex32>,
    /// Turns, within half a turn.
    pub a0: Vec<f64>,
    /// Linear in the chirp, turns (eq. 12).
    pub a1: Vec<f64>,
    /// Quadratic in the chirp, turns.
    pub a2: Vec<f64>,
    /// Cubic in the chirp, turns.
    pub a3: Vec<f64>,
    /// Linear in the sample, turns.
    pub b0: Vec<f64>,
    /// Mixed in chirp and sample, turns.
    pub b1: Vec<f64>,
    /// Linear in the sample and quadratic in the chirp, turns.
    pub b2: Vec<f64>,
    /// Quadratic in the sample, turns.
    pub c: Vec<f64>,
    /// Σ|A|² of all echoes that the cube is a sum of, in all these channels: errors are shares of it.
    pub power: f64,
}

/// Chirp and sample that coefficients are taken about.
pub fn origin(plan: &Plan) -> [f64; 2] {
    [(plan.chirps / 2) as f64, (plan.samples / 2) as f64]
}

impl GridEchoes {
    /// By how much the a1 of an echo moves from the middle of the frame to a place `all_m` loops from it: 2 m a2 + 3 m² a3.
    fn moved(&self, i: usize, all_m: f64) -> f64 {
        all_m * (2.0 * self.a2[i].abs() + 3.0 * all_m * self.a3[i].abs())
    }

    /// `indices` into the returns of the plan, in some channels.
    pub fn new(plan: &Plan, indices: &[u32], channels: Range<usize>) -> GridEchoes {
        let (count, total) = (indices.len(), indices.len() * channels.len());
        let column = || vec![0.0; total];
        let mut e = GridEchoes {
            count,
            channels: channels.len(),
            amplitude: vec![Complex32::ZERO; total],
            a0: column(),
            a1: column(),
            a2: column(),
            a3: column(),
            b0: column(),
            b1: column(),
            b2: column(),
            c: column(),
            power: channels.clone().map(|c| plan.power(c)).sum(),
        };
        if total == 0 {
            return e;
        }
        const PART: usize = 1024;
        let [m, n] = origin(plan);
        // Each part of each column of a channel is filled by one task.
        let parts = |v| <[f64]>::chunks_mut(v, count).flat_map(|c| c.chunks_mut(PART)).collect::<Vec<_>>();
        let (a0, a1, a2) = (parts(&mut e.a0), parts(&mut e.a1), parts(&mut e.a2));
        let (b0, b1, c) = (parts(&mut e.b0), parts(&mut e.b1), parts(&mut e.c));
        let (a3, b2) = (parts(&mut e.a3), parts(&mut e.b2));
        let amplitude: Vec<_> = e.amplitude.chunks_mut(count).flat_map(|c| c.chunks_mut(PART)).collect();
        let in_channel = count.div_ceil(PART);
        (amplitude, a0, a1, a2, a3, b0, b1, b2, c).into_par_iter().enumerate().for_each(
            |(part, (amplitude, a0, a1, a2, a3, b0, b1, b2, c))| {
                let (channel, first) = (channels.start + part / in_channel, part % in_channel * PART);
                let of_channel = plan.channel(channel);
                for (i, index) in indices[first..first + a0.len()].iter().enumerate() {
                    let k = of_channel.coefficients(*index).about(m, n);
                    amplitude[i] = Complex32::new(k.amplitude.re as f32, k.amplitude.im as f32);
                    (a0[i], a1[i], a2[i]) = (k.a0 - k.a0.round(), k.a1, k.a2);
                    (b0[i], b1[i], c[i]) = (k.b0, k.b1, k.c);
                    (a3[i], b2[i]) = (k.a3, k.b2);
                }
            },
        );
        e
    }
}

/// y = slope x + offset fitted to all echoes, and what it leaves over.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Line {
    /// Slope.
    pub slope: f64,
    /// Value at x = 0.
    pub offset: f64,
    worst: f64,
    mean: f64,
}

/// b1, c and a2 as straight lines over a1, by least squares; half of the weight goes by power and half
/// to all echoes alike.
fn fit(echoes: &GridEchoes) -> [Line; 3] {
    let columns = [&echoes.b1[..], &echoes.c, &echoes.a2];
    let x = &echoes.a1[..];
    const PART: usize = 4096;
    let parts: Vec<Range<usize>> = (0..x.len()).step_by(PART).map(|i| i..(i + PART).min(x.len())).collect();
    let power = |i: usize| f64::from(echoes.amplitude[i].norm_sqr());
    // Parts are added in their order, whatever thread they come from.
    let all: f64 = echoes.amplitude.iter().map(|a| f64::from(a.norm_sqr())).sum();
    let equal = 1.0 / x.len() as f64;
    let per_power = if all > 0.0 { 0.5 / all } else { 0.0 };
    let equal = if all > 0.0 { 0.5 * equal } else { equal };
    let origin = columns.map(|y| y[0]);
    let sums = parts.par_iter().map(|part| {
        let (mut o, mut by_column) = ([0.0; 2], [[0.0; 2]; 3]);
        for i in part.clone() {
            let (w, x) = (equal + per_power * power(i), x[i] - x[0]);
            o = [o[0] + w * x, o[1] + w * x * x];
            for k in 0..3 {
                let y = w * (columns[k][i] - origin[k]);
                by_column[k] = [by_column[k][0] + y, by_column[k][1] + y * x];
            }
        }
        (o, by_column)
    });
    let (mut o, mut by_column) = ([0.0; 2], [[0.0; 2]; 3]);
    for (p, columns) in sums.collect::<Vec<_>>() {
        o = [o[0] + p[0], o[1] + p[1]];
        by_column = std::array::from_fn(|k| [0, 1].map(|j| by_column[k][j] + columns[k][j]));
    }
    let spread = o[1] - o[0] * o[0];
    let mut lines: [Line; 3] = std::array::from_fn(|k| {
        let [y, xy] = by_column[k];
        let slope = if spread > 1e-12 * o[1] { (xy - o[0] * y) / spread } else { 0.0 };
        Line { slope, offset: origin[k] + y - slope * (x[0] + o[0]), ..Line::default() }
    });
    let left = parts.par_iter().map(|part| {
        let (mut worst, mut squares) = ([0.0f64; 3], [0.0; 3]);
        for i in part.clone() {
            let w = equal + per_power * power(i);
            for k in 0..3 {
                let d = columns[k][i] - lines[k].slope * x[i] - lines[k].offset;
                worst[k] = worst[k].max(d.abs());
                squares[k] += w * d * d;
            }
        }
        (worst, squares)
    });
    let mut squares = [0.0; 3];
    for (worst, s) in left.collect::<Vec<_>>() {
        for k in 0..3 {
            lines[k].worst = lines[k].worst.max(worst[k]);
            squares[k] += s[k];
        }
    }
    for (line, s) in lines.iter_mut().zip(squares) {
        line.mean = s.sqrt();
    }
    lines
}

/// Warped slow time of eq. 81 and the phase that all echoes share, in turns.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Warp {
    /// b1 as a function of a1.
    pub b1: Line,
    /// c as a function of a1.
    pub c: Line,
    /// a2 as a function of a1.
    pub a2: Line,
}

impl Warp {
    /// Warped slow time of chirp `m` and sample `n`, counted from the middle, in chirps.
    pub fn time(&self, m: f64, n: f64) -> f64 {
        m + self.b1.slope * m * n + self.c.slope * n * n + self.a2.slope * m * m
    }

    /// Phase that all echoes share at chirp `m` and sample `n`, turns.
    pub fn shared_turns(&self, m: f64, n: f64) -> f64 {
        self.b1.offset * m * n + self.c.offset * n * n + self.a2.offset * m * m
    }

    /// Phase left over at the corners of a block of 2 `m` chirps by 2 `n` samples, rad: (worst, mean). With `bent` paths what
    /// a2 leaves over is not among it.
    fn residual(&self, m: f64, n: f64, bent: bool) -> (f64, f64) {
        let along = if bent { 0.0 } else { m * m };
        let sum =
            |f: fn(&Line) -> f64| TAU * (f(&self.b1) * m * n + f(&self.c) * n * n + f(&self.a2) * along);
        (sum(|l| l.worst), sum(|l| l.mean))
    }
}

/// What bent paths leave over within a block: a2 that the warp does not hold, and its change over the frame.
#[derive(Debug, Clone, Copy, Default)]
struct Bends {
    any: bool,
    /// Turns a chirp², the worst and the root mean square by share of the cube's power.
    a2: [f64; 2],
    /// The same of the change of b1, turns a chirp and sample.
    b1: [f64; 2],
    /// The same of the change of a1 from the middle of the frame to its ends, turns a chirp: the warp of a block takes b1 and c
    /// to follow it, where the coefficients hold c.
    a1: [f64; 2],
}

/// Phases left over, rad: see [`Bends`].
struct Bent {
    worst: f64,
    mean: f64,
}

impl Bent {
    fn is_small(&self) -> bool {
        self.worst <= WORST_BEND && self.mean <= MEAN_BEND
    }
}

impl Bends {
    fn of(echoes: &GridEchoes, warp: &Warp, all_m: f64) -> Bends {
        let any = echoes.a3.iter().chain(&echoes.b2).any(|x| *x != 0.0);
        if !any {
            return Bends::default();
        }
        let (mut worst, mut squares) = ([0.0f64; 3], [0.0; 3]);
        for (i, a) in echoes.amplitude.iter().enumerate() {
            let p = f64::from(a.norm_sqr());
            let a2 = (echoes.a2[i] - warp.a2.slope * echoes.a1[i] - warp.a2.offset).abs()
                + 3.0 * all_m * echoes.a3[i].abs();
            let b1 = 2.0 * all_m * echoes.b2[i].abs();
            for (k, d) in [a2, b1, echoes.moved(i, all_m)].into_iter().enumerate() {
                worst[k] = worst[k].max(d);
                squares[k] += p * d * d;
            }
        }
        let share = |s: f64| if echoes.power > 0.0 { (s / echoes.power).sqrt() } else { 0.0 };
        let [a2, b1, a1] = [0, 1, 2].map(|k| [worst[k], share(squares[k])]);
        Bends { any, a2, b1, a1 }
    }

    fn residual(&self, warp: &Warp, m: f64, n: f64) -> Bent {
        let along = |a1: f64| a1 * (warp.b1.slope.abs() * m * n + warp.c.slope.abs() * n * n);
        let at = |k: usize| TAU * (self.a2[k] * m * m + self.b1[k] * m * n + along(self.a1[k]));
        Bent { worst: at(0), mean: at(1) }
    }
}

/// Time that the parts of the work take on an engine, ns.
#[derive(Debug, Clone, Copy)]
pub struct Costs {
    /// One echo at one sample, directly.
    pub direct: f64,
    /// One echo in one channel and one block, on one line, and on [`TAPS`] of them.
    pub spread: [f64; 2],
    /// A cell of a transform, per factor of two.
    pub transform: f64,
    /// A sample on a line.
    pub line: f64,
    /// A sample, once.
    pub sample: f64,
    /// A chirp and sample of a block, for tables that channels share.
    pub table: f64,
    /// Whether transforms have to be powers of two, and the longest.
    pub power_of_two: bool,
    /// Longest line that a transform of the engine takes, cells.
    pub longest: usize,
    /// Most lines of a block.
    pub lines: usize,
    /// Most cells of all blocks of a channel.
    pub largest_grid: usize,
}

/// Grid and blocks of a set of echoes: all that an engine needs beside the echoes.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Number of chirps.
    pub chirps: usize,
    /// Number of samples of a chirp.
    pub samples: usize,
    /// Chirps of a block; the last may be shorter.
    pub block: usize,
    /// Cells of a line, one turn of b0.
    pub cells: usize,
    /// Bell that spreads an echo over cells.
    pub cell_bell: Bell,
    /// Lines; with one line nothing is spread over lines.
    pub lines: usize,
    /// a1 on line zero, and from line to line, turns.
    pub first_line: f64,
    /// Distance between lines, turns a chirp.
    pub line_step: f64,
    /// Bell that spreads an echo over lines.
    pub line_bell: Bell,
    /// The slow time that the lines live in.
    pub warp: Warp,
    /// After so many echoes sums are put aside: many equal ones in a row would all round the same way.
    pub portion: usize,
    /// Estimates of what it costs here, ns, and of its error.
    pub cost: f64,
    /// Bound of the relative error of the sum.
    pub error: f64,
}

/// Transforms of these lengths are fast.
fn is_smooth(mut n: usize) -> bool {
    for p in [2, 3] {
        while n.is_multiple_of(p) {
            n /= p;
        }
    }
    n == 1
}

/// Cells of a line for this many samples.
pub fn cells(samples: usize, costs: &Costs) -> usize {
    let least = (1.375 * samples as f64).ceil() as usize;
    let least = least.max(2 * TAPS);
    if costs.power_of_two {
        return least.next_power_of_two();
    }
    (least..).find(|n| n % 8 == 0 && is_smooth(*n)).unwrap_or(least)
}

/// What a transform of `cells` costs, ns.
fn transform_ns(cells: usize, costs: &Costs) -> f64 {
    costs.transform * cells as f64 * (cells as f64).log2()
}

impl Layout {
    /// For echoes that do not change from chirp to chirp: one chirp, one line.
    pub fn still(samples: usize, costs: &Costs) -> Layout {
        let cells = cells(samples, costs);
        let oversampling = cells as f64 / samples.max(1) as f64;
        let cell_bell = Bell::new(oversampling);
        Layout {
            chirps: 1,
            samples,
            block: 1,
            cells,
            error: cell_bell.aliasing(oversampling).hypot(ROUNDING),
            line_bell: cell_bell.clone(),
            cell_bell,
            lines: 1,
            first_line: 0.0,
            line_step: 0.0,
            warp: Warp::default(),
            portion: PORTION,
            cost: 0.0,
        }
    }

    /// For echoes that do not change from chirp to chirp, if gridding them pays and is accurate.
    pub fn choose_still(samples: usize, echoes: &GridEchoes, costs: &Costs) -> Option<Layout> {
        let layout = Layout::still(samples, costs);
        let pays = Layout::still_pays(echoes.count, samples, costs);
        (pays && Layout::still_residual(echoes, samples) <= layout.error).then_some(layout)
    }

    /// Phase that a layout of echoes at rest leaves out at the ends of the ramp, rad.
    pub fn still_residual(echoes: &GridEchoes, samples: usize) -> f64 {
        TAU * echoes.c.iter().map(|c| c.abs()).fold(0.0, f64::max) * (0.5 * samples as f64).powi(2)
    }

    /// Whether gridding `echoes` echoes that stand still pays.
    pub fn still_pays(echoes: usize, samples: usize, costs: &Costs) -> bool {
        let n = samples as f64;
        let cells = cells(samples, costs);
        let gridded = echoes as f64 * costs.spread[0] + transform_ns(cells, costs) + n * costs.line;
        cells <= costs.longest && gridded < echoes as f64 * n * costs.direct
    }

    /// The cheapest layout that is accurate enough, if there is one cheaper than the direct sum.
    pub fn choose(chirps: usize, samples: usize, echoes: &GridEchoes, costs: &Costs) -> Option<Layout> {
        if echoes.count == 0 || chirps == 0 || samples == 0 {
            return None;
        }
        let cells = cells(samples, costs);
        let (pairs, channels) = ((echoes.count * echoes.channels) as f64, echoes.channels as f64);
        let (all_m, n) = (0.5 * chirps as f64, 0.5 * samples as f64);
        let direct = pairs * (chirps * samples) as f64 * costs.direct;
        // No layout is cheaper than one line of each chirp.
        let least = channels * chirps as f64 * transform_ns(cells, costs);
        if cells > costs.longest || direct < least {
            return None;
        }
        let [b1, c, a2] = fit(echoes);
        let warp = Warp { b1, c, a2 };
        let bends = Bends::of(echoes, &warp, all_m);
        let (mut low, mut high, mut most) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
        for (i, a1) in echoes.a1.iter().enumerate() {
            let moved = echoes.moved(i, all_m);
            (low, high, most) = (low.min(a1 - moved), high.max(a1 + moved), most.max(moved));
        }
        // With bent paths it is among what they leave over.
        let bend = if bends.any { 0.0 } else { most };
        let oversampling = cells as f64 / samples as f64;
        let (cell_bell, line_bell) = (Bell::new(oversampling), Bell::new(LINE_OVERSAMPLING));
        let aliasing = cell_bell.aliasing(oversampling).hypot(line_bell.aliasing(LINE_OVERSAMPLING));
        let mut best: Option<Layout> = None;
        let mut blocks = 1;
        while blocks <= chirps {
            let block = chirps.div_ceil(blocks);
            let m = if block == 1 { 0.0 } else { 0.5 * block as f64 };
            let longest =
                [(-m, -n), (m, -n), (-m, n), (m, n), (0.0, -n), (0.0, n)].map(|(m, n)| warp.time(m, n).abs());
            let longest = longest.into_iter().fold(0.0, f64::max);
            let (mut worst, mut mean) = warp.residual(m, n, bends.any);
            let kept = TAU * bend * (warp.b1.slope.abs() * m * n + warp.c.slope.abs() * n * n);
            (worst, mean) = (worst + kept, mean + kept);
            let across = TAU * 0.5 * (high - low) * longest;
            let (lines, first_line, line_step) = if across < 0.5 * MEAN_RESIDUAL {
                (worst, mean) = (worst + across, mean + across);
                (1, 0.5 * (low + high), 0.0)
            } else {
                let step = 0.5 / (LINE_OVERSAMPLING * longest);
                let half = 0.5 * TAPS as f64;
                (((high - low) / step).ceil() as usize + TAPS + 1, low - step * (half + 0.25), step)
            };
            let count = chirps.div_ceil(block) as f64;
            let cost = pairs * count * costs.spread[usize::from(lines > 1)]
                + channels * count * lines as f64 * transform_ns(cells, costs)
                + channels * (chirps * samples) as f64 * (costs.line * lines as f64 + costs.sample)
                + (block * samples) as f64 * costs.table;
            let bent = bends.residual(&warp, m, n);
            let accurate = worst <= WORST_RESIDUAL && mean <= MEAN_RESIDUAL && bent.is_small();
            let fits = lines <= costs.lines
                && (lines * cells).saturating_mul(chirps.div_ceil(block)) <= costs.largest_grid;
            if accurate && fits && cost < best.as_ref().map_or(direct, |b| b.cost) {
                best = Some(Layout {
                    chirps,
                    samples,
                    block,
                    cells,
                    cell_bell: cell_bell.clone(),
                    lines,
                    first_line,
                    line_step,
                    line_bell: line_bell.clone(),
                    warp,
                    portion: usize::MAX,
                    cost,
                    error: aliasing.hypot(mean).hypot(ROUNDING).hypot(bent.mean),
                });
            }
            if block == 1 {
                break;
            }
            // The next number of blocks that makes them shorter, growing by about a quarter.
            let mut next = blocks + (blocks / 4).max(1);
            while chirps.div_ceil(next) == block {
                next += 1;
            }
            blocks = next;
        }
        if let Some(layout) = &mut best
            && layout.crowding(echoes) > PORTION
        {
            layout.portion = PORTION;
        }
        best
    }

    /// Most echoes of the first channel that meet in one square of [`TAPS`] cells by lines.
    fn crowding(&self, echoes: &GridEchoes) -> usize {
        let across = self.cells.div_ceil(TAPS);
        let mut squares = vec![0; across * self.lines.div_ceil(TAPS)];
        let per_step = if self.lines == 1 { 0.0 } else { 1.0 / self.line_step };
        for (a1, b0) in echoes.a1.iter().zip(&echoes.b0).take(echoes.count) {
            let cell = ((b0 - b0.floor()) * self.cells as f64) as usize % self.cells;
            let line = ((a1 - self.first_line) * per_step) as usize;
            squares[line.min(self.lines - 1) / TAPS * across + cell / TAPS] += 1;
        }
        squares.into_iter().max().unwrap_or(0)
    }

    /// Number of blocks of chirps.
    pub fn blocks(&self) -> usize {
        self.chirps.div_ceil(self.block)
    }

    /// Chirp of the middle of a block, counted from the middle of the frame.
    pub fn middle(&self, block: usize) -> f64 {
        (block * self.block + self.block / 2) as f64 - (self.chirps / 2) as f64
    }

    /// Line about which the sum over lines is taken.
    pub fn middle_line(&self) -> usize {
        self.lines / 2
    }

    /// What remains to be done to the sums over lines.
    pub fn finish(&self) -> Finish<'_> {
        let place = |n: usize| n as f64 - (self.samples / 2) as f64;
        let cells =
            (0..self.samples).map(|n| self.cell_bell.transform(place(n) / self.cells as f64)).collect();
        Finish { layout: self, cells }
    }

    /// The method as results state it.
    pub fn method(&self) -> Method {
        Method::Gridded(Gridded {
            blocks: self.blocks(),
            lines: self.lines,
            oversampling: self.cells as f64 / self.samples as f64,
            taps: TAPS,
            error: self.error,
        })
    }
}

/// Phase from line to line and the factor of the sum over lines.
pub struct Finish<'a> {
    layout: &'a Layout,
    /// Transform of the bell across cells at each sample.
    cells: Vec<f64>,
}

impl Finish<'_> {
    /// At chirp `i` of a block and sample `n` of the ramp: turns from line to line, and the factor's
    /// turns and magnitude.
    pub fn at(&self, i: usize, n: usize) -> (f64, f64, f64) {
        let layout = self.layout;
        let m = i as f64 - (layout.block / 2) as f64;
        let cells = self.cells[n];
        let n = n as f64 - (layout.samples / 2) as f64;
        let t = layout.warp.time(m, n);
        let a1 = layout.first_line + layout.middle_line() as f64 * layout.line_step;
        let turns = t * a1 + layout.warp.shared_turns(m, n);
        let lines = if layout.lines == 1 { 1.0 } else { layout.line_bell.transform(t * layout.line_step) };
        (t * layout.line_step, turns, 1.0 / (cells * lines))
    }
}

/// Indices of the echoes that move, apart by how much their paths bend, in portions of which `limit` echoes times channels are kept
/// at a time.
pub fn moving_portions<'p>(plan: &'p Plan, limit: usize) -> Vec<&'p [u32]> {
    let most = (limit / plan.channels.max(1)).max(1);
    plan.moving_classes().flat_map(|class| class.chunks(most)).collect()
}
