//! Which echoes are summed how: directly, or on grids with blocks of chirps of their own length (CONVENTIONS eq. 79).
//!
//! What a grid leaves out of an echo shrinks as its blocks get shorter, and each block costs one more spreading. Strong echoes whose
//! paths bend need short blocks, weak ones do not: blocks are as long as lets the same power of error be saved by one more block of
//! any echo. That is the least work for a sum of errors. Echoes of neighbouring steps share a grid where its transforms cost more
//! than the longer blocks would save.

use super::grid_echoes::origin;
use super::gridding::{self, Bells, Costs, GridLayout, Line, Warp, transform_ns};
use super::methods::{Gridded, Method};
use super::synthesis::{PhasePolynomial, Plan, Set};
use crate::base::tasks::{Tasks, in_parts};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Power of all that grids leave out of the echoes over Σ|A|², predicted (-86 dB): on frames of the bench -86 to -90 dB were measured.
const ERROR: f64 = 2.5e-9;
/// The same over the noise of a cell of the map, for frames whose strongest echo stands far above it.
const ERROR_OVER_NOISE: f64 = 0.1;
/// Below this share of Σ|A|² single precision says no more.
const LEAST_ERROR: f64 = 1e-11;
/// Largest phase that is left out of any echo, rad.
const LARGEST: f32 = 0.3;
/// Numbers of blocks that are tried; the last grid has a block for each chirp.
const STEPS: [usize; 15] = [1, 2, 4, 6, 8, 12, 16, 24, 32, 48, 64, 128, 256, 512, 1024];
/// Times that the warp is fitted; more change nothing.
const FITS: usize = 3;
/// Echoes that say where the limit lies.
const SAMPLE: usize = 4096;
/// Echoes that are scheduled together (some 150 bytes each).
const TOGETHER: usize = 1 << 20;

/// Some echoes that share a grid.
#[derive(Debug, Clone)]
pub struct Group {
    /// Which, as the caller numbers them.
    pub echoes: Vec<u32>,
    /// Grid of the group's echoes, or None where the direct sum is cheaper.
    pub layout: Option<GridLayout>,
    /// Power that the grid leaves out, predicted, W.
    pub error_w: f64,
}

/// How the echoes that move are summed.
#[derive(Debug, Clone, Default)]
pub struct Schedule {
    /// Echoes of a grid, as indices into the frame's returns, with the grid.
    pub grids: Vec<(Vec<u32>, GridLayout)>,
    /// Echoes that are summed directly.
    pub directly: Vec<u32>,
    /// Power that grids leave out over Σ|A|², predicted.
    error: f64,
}

impl Schedule {
    /// The schedule of the plan's echoes that move, on an engine of these costs.
    pub fn new(plan: &Plan, costs: &Costs) -> Schedule {
        let mut schedule = Schedule::default();
        let moving = plan.set(Set::Moving);
        if moving.is_empty() || plan.chirps == 0 || plan.samples == 0 || plan.channels == 0 {
            return schedule;
        }
        let [m, n] = origin(plan);
        let power_w = plan.mean_power_w();
        let over_noise = |w: f64| (ERROR_OVER_NOISE * w / power_w).clamp(LEAST_ERROR, ERROR);
        let allowed = plan.noise_of_cell_w().map_or(ERROR, over_noise);
        // Slots of a loop differ in time, and so in the rate of a bent path; elements of the array in the rate alone, as far as it counts.
        let ends = [0, plan.channels - 1].map(|c| (plan.at_phase_centre(c), plan.code_turns(c)));
        for some in moving.chunks(TOGETHER) {
            let term = |i: &u32, end: usize| {
                let (channel, code) = &ends[end];
                let mut k = channel.coefficients(*i);
                k.a1 -= code;
                k.about(m, n)
            };
            let terms: Vec<Term> = some
                .par_iter()
                .zip(plan.echo_powers_w(some))
                .map_tasks(|(i, power_w)| {
                    let (polynomial, last) = (term(i, 0), term(i, 1));
                    let array_a1 = plan.spread_over_array(&plan.echoes[*i as usize]);
                    Term { polynomial, last_a1: [last.a1, last.a2, last.a3], array_a1, power_w }
                })
                .collect();
            let shape = Shape { chirps: plan.chirps, samples: plan.samples, channels: plan.channels };
            for group in groups(&shape, &terms, allowed, costs) {
                let echoes: Vec<u32> = group.echoes.iter().map(|i| some[*i as usize]).collect();
                match group.layout {
                    Some(layout) => {
                        schedule.error += if power_w > 0.0 { group.error_w / power_w } else { 0.0 };
                        schedule.grids.push((echoes, layout));
                    }
                    None => schedule.directly.extend(echoes),
                }
            }
        }
        // Tiles of the direct sum hold neighbours.
        schedule.directly.sort_unstable();
        schedule
    }

    /// Drops the grids that an engine cannot take (`fits` is false), so that their echoes are summed directly.
    pub fn keep(&mut self, mut fits: impl FnMut(&[u32], &GridLayout) -> bool) {
        let (kept, left): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.grids).into_iter().partition(|(echoes, layout)| fits(echoes, layout));
        self.grids = kept;
        self.directly.extend(left.into_iter().flat_map(|(echoes, _)| echoes));
        self.directly.sort_unstable();
    }

    /// The method as results state it; of several grids it has the numbers of the finest.
    pub fn method(&self) -> Method {
        let finest = self.grids.iter().max_by_key(|(_, layout)| layout.blocks());
        finest.map_or(Method::Direct, |(_, layout)| {
            Method::Gridded(Gridded {
                grids: self.grids.len(),
                lines: self.grids.iter().map(|(_, l)| l.lines).max().unwrap_or(0),
                ..layout.gridded(self.error.sqrt())
            })
        })
    }
}

/// Size of the cube that is synthesised.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// Number of chirps.
    pub chirps: usize,
    /// Number of samples of a chirp.
    pub samples: usize,
    /// Number of channels.
    pub channels: usize,
}

/// The terms of an echo on which the choice of a grid depends.
#[derive(Debug, Clone, Copy)]
pub struct Term {
    /// Phase at the phase centre in the first slot, about the middle of frame and ramp, without what the transmitter's
    /// code adds.
    pub polynomial: PhasePolynomial,
    /// a1, a2 and a3 in the last slot.
    pub last_a1: [f64; 3],
    /// Largest difference of a1 in any channel from that of `polynomial`, turns.
    pub array_a1: f64,
    /// |A|², mean over channels, W.
    pub power_w: f64,
}

impl Term {
    /// Least and largest a1 in the frame, turns a chirp.
    fn range(&self, half: f64) -> [f64; 2] {
        let p = &self.polynomial;
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for [a1, a2, a3] in [[p.a1, p.a2, p.a3], self.last_a1] {
            let moved = self.array_a1 + half * (2.0 * a2.abs() + 3.0 * half * a3.abs());
            range = [range[0].min(a1 - moved), range[1].max(a1 + moved)];
        }
        range
    }
}

/// How far an echo's terms are from the warp at a chirp, turns.
struct Deviation {
    a2: f64,
    b1: f64,
    c: f64,
}

impl Deviation {
    fn of(p: &PhasePolynomial, warp: &Warp, m: f64) -> Deviation {
        let a1 = p.a1 + m * (2.0 * p.a2 + 3.0 * m * p.a3);
        Deviation {
            a2: p.a2 + 3.0 * m * p.a3 - warp.a2.at(a1),
            b1: p.b1 + 2.0 * m * p.b2 - warp.b1.at(a1),
            c: p.c + m * p.c1 - warp.c.at(a1),
        }
    }

    /// The three deviations at `half` chirps and `n` samples from the middle, rad.
    fn corner(&self, half: f64, n: f64) -> [f64; 3] {
        [self.a2 * half * half, self.b1 * half * n, self.c * n * n].map(|turns| TAU * turns.abs())
    }
}

/// What a grid leaves out of an echo at the corners of the frame: rad if there is one block. The first goes with the square of
/// blocks' length, the second with their length, the third not.
#[derive(Debug, Clone, Copy)]
struct Residual {
    along: f32,
    mixed: f32,
    across: f32,
    power: f32,
}

impl Residual {
    fn of(term: &Term, warp: &Warp, half: f64, n: f64) -> Residual {
        // At the start, in the middle and at the end of the frame: the warp follows the rate.
        let [along, mixed, across] = [-half, 0.0, half]
            .map(|m| Deviation::of(&term.polynomial, warp, m).corner(half, n))
            .into_iter()
            .fold([0.0f64; 3], |most, left| std::array::from_fn(|k| most[k].max(left[k])));
        Residual {
            along: along as f32,
            mixed: mixed as f32,
            across: across as f32,
            power: term.power_w as f32,
        }
    }

    fn parts(&self, step: &Step) -> [f32; 3] {
        [self.along * step.share * step.share, self.mixed * step.share, self.across]
    }

    /// Power that is left out with such blocks, W: the mean over a block of the square of what a constant and a slope do not take.
    fn error(&self, step: &Step) -> f32 {
        let [x, y, z] = self.parts(step);
        let [bend, mixed] = step.discrete;
        self.power * ((bend * x * x + z * z) * (4.0 / 45.0) + mixed * y * y / 9.0)
    }

    /// The fewest blocks of `steps` for which each block more would save less than `limit` of power; their number where there are none.
    fn step(&self, steps: &[Step], limit: f32) -> usize {
        let small = |s: &Step| self.parts(s).into_iter().sum::<f32>() <= LARGEST;
        let enough = |s: &Step| self.error(s) <= limit * s.blocks as f32 && small(s);
        steps.iter().position(enough).unwrap_or(steps.len())
    }
}

/// A number of blocks that is tried.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    /// Chirps of a block.
    block: usize,
    blocks: usize,
    /// Length of a block over that of the frame; a block of one chirp has none.
    share: f32,
    /// The mean squares of what a straight line leaves of m² and a mean leaves of m, for m the chirps of a block over those for a
    /// continuous m.
    discrete: [f32; 2],
}

/// The numbers of blocks for so many chirps, growing.
fn steps(chirps: usize) -> Vec<Step> {
    let mut blocks: Vec<usize> = STEPS.into_iter().chain([chirps]).map(|b| chirps.div_ceil(b)).collect();
    blocks.sort_unstable_by_key(|b| std::cmp::Reverse(*b));
    blocks.dedup();
    let step = |block: usize| Step {
        block,
        blocks: chirps.div_ceil(block),
        share: if block == 1 { 0.0 } else { block as f32 / chirps as f32 },
        discrete: {
            let squared = (block * block) as f32;
            let mixed = 1.0 - 1.0 / squared;
            [(mixed * (1.0 - 4.0 / squared)).max(0.0), mixed]
        },
    };
    blocks.into_iter().map(step).collect()
}

/// b1, c and a2 as straight lines over a1, by least squares; half of the weight goes by power and half to all echoes alike, and less
/// to an echo the farther it is from the lines before: what lies far off gets short blocks anyway, and shall not take others along.
fn fit(terms: &[Term], half: f64, n: f64) -> Warp {
    let all: f64 = terms.iter().map(|t| t.power_w).sum();
    let equal = 1.0 / terms.len() as f64;
    let weight = |t: &Term| if all > 0.0 { 0.5 * equal + 0.5 * t.power_w / all } else { equal };
    let mut warp = fit_weighted(terms, weight);
    for _ in 1..FITS {
        let before = warp;
        let off = |t: &Term| {
            let left = Deviation::of(&t.polynomial, &before, 0.0);
            let [x, y, z] = left.corner(half, n);
            x * x + y * y + z * z
        };
        warp = fit_weighted(terms, |t| weight(t) / (1.0 + off(t)));
    }
    warp
}

/// The same with given weights.
fn fit_weighted(terms: &[Term], weight: impl Fn(&Term) -> f64 + Sync) -> Warp {
    const PART: usize = 4096;
    let columns = |t: &Term| [t.polynomial.b1, t.polynomial.c, t.polynomial.a2];
    let (x0, y0) = (terms[0].polynomial.a1, columns(&terms[0]));
    // Parts are added in their order, whatever thread they come from.
    let sums: Vec<([f64; 3], [[f64; 2]; 3])> = terms
        .par_chunks(PART)
        .map_tasks(|part| {
            let (mut o, mut by_column) = ([0.0; 3], [[0.0; 2]; 3]);
            for t in part {
                let (w, x, y) = (weight(t), t.polynomial.a1 - x0, columns(t));
                o = [o[0] + w, o[1] + w * x, o[2] + w * x * x];
                for k in 0..3 {
                    let y = w * (y[k] - y0[k]);
                    by_column[k] = [by_column[k][0] + y, by_column[k][1] + y * x];
                }
            }
            (o, by_column)
        })
        .collect();
    let (mut o, mut by_column) = ([0.0; 3], [[0.0; 2]; 3]);
    for (p, columns) in sums {
        o = std::array::from_fn(|k| o[k] + p[k]);
        by_column = std::array::from_fn(|k| [0, 1].map(|j| by_column[k][j] + columns[k][j]));
    }
    let [weights, x, xx] = [o[0], o[1] / o[0], o[2] / o[0]];
    let spread = xx - x * x;
    let [b1, c, a2] = std::array::from_fn(|k| {
        let [y, xy] = by_column[k].map(|sum| sum / weights);
        let slope = if spread > 1e-12 * xx { (xy - x * y) / spread } else { 0.0 };
        Line { slope, offset: y0[k] + y - slope * (x0 + x) }
    });
    Warp { b1, c, a2 }
}

/// Shares echoes out over grids such that they leave out `allowed` of the power of all together, at the least cost.
pub fn groups(shape: &Shape, terms: &[Term], allowed: f64, costs: &Costs) -> Vec<Group> {
    let Shape { chirps, samples, channels } = *shape;
    let directly = || Group { echoes: (0..terms.len() as u32).collect(), layout: None, error_w: 0.0 };
    let pairs = (terms.len() * channels) as f64;
    // No grid is cheaper than one line of one block.
    let least = channels as f64 * transform_ns(gridding::cells(samples, costs), costs);
    if terms.is_empty() || pairs * (chirps * samples) as f64 * costs.direct < least {
        return vec![directly()];
    }
    let (half, n) = (0.5 * chirps as f64, 0.5 * samples as f64);
    let warp = fit(terms, half, n);
    let residuals: Vec<Residual> = in_parts(terms, |t| Residual::of(t, &warp, half, n));
    let steps = steps(chirps);
    let limit = limit(&residuals, &steps, allowed);
    let step: Vec<u8> = in_parts(&residuals, |r| r.step(&steps, limit) as u8);

    let mut counts = vec![0usize; steps.len() + 1];
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; steps.len()];
    let wider = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    for (s, term) in step.iter().zip(terms) {
        counts[*s as usize] += 1;
        if let Some(range) = ranges.get_mut(*s as usize) {
            *range = wider(*range, term.range(half));
        }
    }
    let range_of = |steps: std::ops::Range<usize>| {
        ranges[steps].iter().fold([f64::INFINITY, f64::NEG_INFINITY], |a, b| wider(a, *b))
    };
    // The least cost of what needs up to so many steps, the step before its last grid and whether that is a grid at all.
    let mut best = vec![(f64::INFINITY, 0, false); steps.len() + 1];
    best[0].0 = 0.0;
    for end in 1..=steps.len() {
        for from in 0..end {
            let count: usize = counts[from..end].iter().sum();
            let size =
                GridSize { shape, step: &steps[end - 1], range: range_of(from..end), warp: &warp, count };
            let direct = (count * channels * chirps * samples) as f64 * costs.direct;
            let gridded = if count == 0 { f64::INFINITY } else { size.cost(costs) };
            let cost = best[from].0 + direct.min(gridded);
            if cost < best[end].0 {
                best[end] = (cost, from, gridded < direct);
            }
        }
    }
    let bells = Bells::new(samples, costs);
    let mut list = Vec::new();
    let members = |from: usize, end: usize| -> Vec<u32> {
        let range = from as u8..end as u8;
        let mut list: Vec<u32> =
            (0..).zip(&step).filter(|(_, s)| range.contains(s)).map(|(i, _)| i).collect();
        // Neighbours meet on the same lines, which then stay in the cache.
        let a1 = |i: &u32| terms[*i as usize].polynomial.a1;
        list.sort_by(|i, j| a1(i).total_cmp(&a1(j)));
        list
    };
    let mut end = steps.len();
    // What no grid takes.
    if counts[end] > 0 {
        list.push(Group { echoes: members(end, end + 1), layout: None, error_w: 0.0 });
    }
    while end > 0 {
        let (_, from, is_grid) = best[end];
        let echoes = members(from, end);
        if !echoes.is_empty() {
            let step = &steps[end - 1];
            let layout = is_grid.then(|| {
                GridLayout::moving((chirps, samples), step.block, range_of(from..end), warp, &bells)
            });
            let error = |i: &u32| f64::from(residuals[*i as usize].error(step));
            let error_w = if is_grid { echoes.iter().map(error).sum() } else { 0.0 };
            list.push(Group { echoes, layout, error_w });
        }
        end = from;
    }
    list.reverse();
    list
}

/// The power that one more block has to save, such that all echoes together leave out `allowed` of theirs.
fn limit(residuals: &[Residual], steps: &[Step], allowed: f64) -> f32 {
    let total: f64 = residuals.iter().map(|r| f64::from(r.power)).sum();
    let stride = residuals.len().div_ceil(SAMPLE);
    let (mut low, mut high) = (total * 1e-24, total);
    for _ in 0..40 {
        let middle = (low * high).sqrt();
        let left_out =
            |r: &Residual| steps.get(r.step(steps, middle as f32)).map_or(0.0, |s| f64::from(r.error(s)));
        let sum: f64 = stride as f64 * residuals.iter().step_by(stride).map(left_out).sum::<f64>();
        if sum > allowed * total {
            high = middle;
        } else {
            low = middle;
        }
    }
    low as f32
}

/// A grid that some echoes could share.
struct GridSize<'a> {
    shape: &'a Shape,
    step: &'a Step,
    range: [f64; 2],
    warp: &'a Warp,
    count: usize,
}

impl GridSize<'_> {
    /// What it costs, ns; without end where an engine does not take it.
    fn cost(&self, costs: &Costs) -> f64 {
        let Shape { chirps, samples, channels } = *self.shape;
        let Step { block, blocks, .. } = *self.step;
        let cells = gridding::cells(samples, costs);
        let (lines, ..) = gridding::lines(block, samples, self.range, self.warp);
        if cells > costs.longest
            || lines > costs.lines
            || (lines * cells).saturating_mul(blocks) > costs.largest_grid
        {
            return f64::INFINITY;
        }
        let (blocks, lines, channels) = (blocks as f64, lines as f64, channels as f64);
        let cube = channels * (chirps * samples) as f64;
        self.count as f64 * channels * blocks * costs.spread[usize::from(lines > 1.0)]
            + channels * blocks * lines * transform_ns(cells, costs)
            + cube * (costs.line * lines + costs.sample)
            + (block * samples) as f64 * costs.table
    }
}
