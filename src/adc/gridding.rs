//! Synthesis by gridding: how a set of echoes is summed without visiting every echo at every sample
//! (CONVENTIONS eq. 80-84). Which echoes share a grid, and how many blocks it has, is chosen in [`super::schedule`]; the
//! engines follow the [`GridLayout`].
//!
//! Chirps are cut into blocks. In a block, about its middle, the phase of an echo is
//! a0 + n b0 + m a1 + b1 m n + c n² + a2 m² turns, and b1, c and a2 come from the same motion as a1:
//! b1 = κ a1 + κ₀ and so on, nearly the same for all echoes. So the phase is n b0 + a1 t(m, n) with
//! a slow time t = m + κ m n + γ n² + α m² that the sample warps (keystone), and what κ₀, γ₀ and α₀ add
//! is known. Echoes are spread on a grid of b0 (cells) and a1 (lines); each line is transformed to
//! samples; at each sample the lines are added up with e^{2πj t a1}. The cost of a sample does not
//! depend on the number of echoes, nor on how far they migrate.

use super::grid_echoes::GridEchoes;
use super::methods::Gridded;
use num_complex::Complex32;
use std::f64::consts::{PI, TAU};

/// Cells over which an echo is spread, on each axis.
pub const TAPS: usize = 8;

/// Lines for each line that the band of slow time alone would need.
const LINE_OVERSAMPLING: f64 = 1.4;

/// Phase across a grid that one line may leave out, rad.
const ACROSS: f64 = 1e-5;

/// Rounding in f32: transforms of some hundred values and as many terms of a polynomial.
const ROUNDING: f64 = 1.5e-6;

/// Most equal echoes whose sum in one cell is left to f32 alone: they lose at most 3e-5 of the peak.
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
    /// The bell for frequencies up to 1/(2 oversampling) cycles a cell. β puts the first zero of the transform where
    /// the image of that band begins.
    pub fn new(oversampling: f64) -> Bell {
        let beta = 0.98 * PI * TAPS as f64 * (1.0 - 0.5 / oversampling);
        let peak = bessel_i0(beta);
        let f = |s: f64| bessel_i0(beta * s.max(0.0).sqrt()) / peak;
        Bell { beta, peak, polynomial: economised(f).map(|c| c as f32) }
    }

    /// Value of the bell at distance d, in halves of its width.
    pub fn at(&self, d: f64) -> f64 {
        if d.abs() > 1.0 { 0.0 } else { bessel_i0(self.beta * (1.0 - d * d).sqrt()) / self.peak }
    }

    /// Transform of the bell at frequency f, ∫ bell e^{2πj f x} dx, x in cells.
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

    /// Largest amplitude of images at frequencies up to 1/(2 oversampling), relative to the signal.
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

/// A straight line y = slope x + offset.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Line {
    /// Slope.
    pub slope: f64,
    /// Value at x = 0.
    pub offset: f64,
}

impl Line {
    /// Value at x.
    #[inline]
    pub fn at(&self, x: f64) -> f64 {
        self.slope * x + self.offset
    }
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
}

/// Time that the parts of the work take on an engine, ns.
#[derive(Debug, Clone, Copy)]
pub struct Costs {
    /// Cost of one echo at one sample, summed directly.
    pub direct: f64,
    /// Cost of one echo in one channel and one block: on one line, and on [`TAPS`] of them.
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
    /// Length of the longest line that a transform of the engine takes, cells.
    pub longest: usize,
    /// Largest number of lines of a block.
    pub lines: usize,
    /// Largest number of cells in all blocks of a channel.
    pub largest_grid: usize,
}

/// Grid and blocks of a set of echoes: all that an engine needs beside the echoes.
#[derive(Debug, Clone)]
pub struct GridLayout {
    /// Number of chirps.
    pub chirps: usize,
    /// Number of samples of a chirp.
    pub samples: usize,
    /// Number of chirps of a block; the last block may be shorter.
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
    /// Error that images and rounding make, as a share of the root of Σ|A|².
    pub error: f64,
}

/// The line mean + slope m, which is nearest to m² over the chirps m of a block as counted from [`GridLayout::middle`], and
/// the mean of m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Mean of m, chirps.
    pub centre: f64,
    /// Value at m = 0, chirps².
    pub mean: f64,
    /// Slope over m, chirps.
    pub slope: f64,
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

/// Number of cells of a line for this many samples.
pub fn cells(samples: usize, costs: &Costs) -> usize {
    let least = (1.375 * samples as f64).ceil() as usize;
    let least = least.max(2 * TAPS);
    if costs.power_of_two {
        return least.next_power_of_two();
    }
    (least..).find(|n| n % 8 == 0 && is_smooth(*n)).unwrap_or(least)
}

/// What a transform of `cells` costs, ns.
pub(super) fn transform_ns(cells: usize, costs: &Costs) -> f64 {
    costs.transform * cells as f64 * (cells as f64).log2()
}

/// The bells of grids of one length of ramp, which all blocks share.
pub struct Bells {
    cells: usize,
    cell: Bell,
    line: Bell,
    error: f64,
}

impl Bells {
    /// The bells for this many samples on an engine of these costs.
    pub fn new(samples: usize, costs: &Costs) -> Bells {
        let cells = cells(samples, costs);
        let oversampling = cells as f64 / samples.max(1) as f64;
        let (cell, line) = (Bell::new(oversampling), Bell::new(LINE_OVERSAMPLING));
        let aliasing = cell.aliasing(oversampling).hypot(line.aliasing(LINE_OVERSAMPLING));
        Bells { cells, cell, line, error: aliasing.hypot(ROUNDING) }
    }
}

/// Number of lines of a block of `block` chirps for a1 over `range`, the a1 on the first and from line to line.
pub(super) fn lines(block: usize, samples: usize, [low, high]: [f64; 2], warp: &Warp) -> (usize, f64, f64) {
    let (m, n) = (if block == 1 { 0.0 } else { 0.5 * block as f64 }, 0.5 * samples as f64);
    let corners = [(-m, -n), (m, -n), (-m, n), (m, n), (0.0, -n), (0.0, n)];
    let longest = corners.map(|(m, n)| warp.time(m, n).abs()).into_iter().fold(0.0, f64::max);
    if TAU * 0.5 * (high - low) * longest < ACROSS {
        return (1, 0.5 * (low + high), 0.0);
    }
    let step = 0.5 / (LINE_OVERSAMPLING * longest);
    let half = 0.5 * TAPS as f64;
    (((high - low) / step).ceil() as usize + TAPS + 1, low - step * (half + 0.25), step)
}

impl GridLayout {
    /// Layout for echoes that do not change from chirp to chirp: one chirp, one line.
    pub fn still(samples: usize, costs: &Costs) -> GridLayout {
        let cells = cells(samples, costs);
        let oversampling = cells as f64 / samples.max(1) as f64;
        let cell_bell = Bell::new(oversampling);
        GridLayout {
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
        }
    }

    /// Whether gridding of `echoes` echoes that stand still costs less than the direct sum.
    pub fn still_pays(echoes: usize, samples: usize, costs: &Costs) -> bool {
        let n = samples as f64;
        let cells = cells(samples, costs);
        let gridded = echoes as f64 * costs.spread[0] + transform_ns(cells, costs) + n * costs.line;
        cells <= costs.longest && gridded < echoes as f64 * n * costs.direct
    }

    /// Layout for echoes whose a1 goes over `range` during the frame, in blocks of `block` chirps.
    pub fn moving(
        (chirps, samples): (usize, usize),
        block: usize,
        range: [f64; 2],
        warp: Warp,
        bells: &Bells,
    ) -> GridLayout {
        let (lines, first_line, line_step) = lines(block, samples, range, &warp);
        GridLayout {
            chirps,
            samples,
            block,
            cells: bells.cells,
            cell_bell: bells.cell.clone(),
            lines,
            first_line,
            line_step,
            line_bell: bells.line.clone(),
            warp,
            error: bells.error,
        }
    }

    /// The layout for a channel in which every a1 is larger by `turns`.
    pub fn turned(&self, turns: f64) -> GridLayout {
        let moved = |l: Line| Line { offset: l.offset - l.slope * turns, ..l };
        GridLayout {
            first_line: self.first_line + turns,
            warp: Warp { b1: moved(self.warp.b1), c: moved(self.warp.c), a2: moved(self.warp.a2) },
            ..self.clone()
        }
    }

    /// Finds where a sum in single precision has to be put aside: before these echoes of the first channel, so that in
    /// no square of [`TAPS`] cells by lines more than what 512 equal echoes (`PORTION`) make adds up in between. The last
    /// entry is the number of echoes.
    pub fn portions(&self, echoes: &GridEchoes) -> Vec<usize> {
        let mut cuts = Vec::new();
        if echoes.count > PORTION {
            let mut squares = self.squares();
            for (i, square) in self.squares_of(echoes).enumerate() {
                if squares[square].is_full() {
                    cuts.push(i);
                    squares.fill(Square::default());
                }
                squares[square].add(echoes, i);
            }
        }
        cuts.push(echoes.count);
        cuts
    }

    /// Whether the sum of the echoes of the first channel has to be put aside somewhere.
    pub fn is_crowded(&self, echoes: &GridEchoes) -> bool {
        self.portions(echoes).len() > 1
    }

    fn squares(&self) -> Vec<Square> {
        vec![Square::default(); self.cells.div_ceil(TAPS) * self.lines.div_ceil(TAPS)]
    }

    /// The square of [`TAPS`] cells by lines in which each echo of the first channel lies in the middle of the frame.
    fn squares_of<'a>(&'a self, echoes: &'a GridEchoes) -> impl Iterator<Item = usize> + 'a {
        let across = self.cells.div_ceil(TAPS);
        let per_step = if self.lines == 1 { 0.0 } else { 1.0 / self.line_step };
        echoes.a1.iter().zip(&echoes.b0).take(echoes.count).map(move |(a1, b0)| {
            let cell = ((b0 - b0.floor()) * self.cells as f64) as usize % self.cells;
            let line = ((a1 - self.first_line) * per_step) as usize;
            line.min(self.lines - 1) / TAPS * across + cell / TAPS
        })
    }

    /// Number of blocks of chirps.
    pub fn blocks(&self) -> usize {
        self.chirps.div_ceil(self.block)
    }

    /// Chirp of the middle of a block, counted from the middle of the frame.
    pub fn middle(&self, block: usize) -> f64 {
        (block * self.block + self.block / 2) as f64 - (self.chirps / 2) as f64
    }

    /// The straight line that is nearest to the square of the chirp over a block.
    pub fn level(&self) -> Level {
        let centre = if self.block.is_multiple_of(2) { -0.5 } else { 0.0 };
        let mean = ((self.block * self.block) as f64 - 1.0) / 12.0 - centre * centre;
        Level { centre, mean, slope: 2.0 * centre }
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

    /// The grid as results state it, for `echoes` echoes.
    pub fn gridded(&self, error: f64) -> Gridded {
        Gridded {
            grids: 1,
            blocks: self.blocks(),
            lines: self.lines,
            oversampling: self.cells as f64 / self.samples as f64,
            taps: TAPS,
            error: self.error.hypot(error),
        }
    }
}

/// What has come together in one square of a grid.
#[derive(Debug, Clone, Copy, Default)]
struct Square {
    count: f32,
    sum: Complex32,
    power: f32,
}

impl Square {
    fn add(&mut self, echoes: &GridEchoes, i: usize) {
        let (s, c) = (TAU as f32 * echoes.a0[i] as f32).sin_cos();
        self.count += 1.0;
        self.sum += echoes.amplitude[i] * Complex32::new(c, s);
        self.power += echoes.amplitude[i].norm_sqr();
    }

    /// Whether the sum is as large as that of [`PORTION`] equal echoes. Each of those rounds the same way; what comes with a phase of
    /// its own does not, and stays far below.
    fn is_full(&self) -> bool {
        let most = PORTION as f32;
        self.sum.norm_sqr() * self.count >= most * most * self.power && self.power > 0.0
    }
}

/// Phase from line to line and the factor of the sum over lines.
pub struct Finish<'a> {
    layout: &'a GridLayout,
    /// Transform of the bell across cells at each sample.
    cells: Vec<f64>,
}

impl Finish<'_> {
    /// The factor at chirp `i` of a block and sample `n` of the ramp: its turns from line to line, its turns and its
    /// magnitude.
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
