//! Order-statistic CFAR (CONVENTIONS eq. 17, 85): the mask by counting, the noise of single cells by
//! selection.

use crate::base::simd::{Vectorised, vectorised};
use crate::base::tasks::Tasks;
use crate::dsp::cfar_window::{Column, Reach, reach};
use crate::dsp::{PowerMap, Real};
use crate::scene::radar::Cfar;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::ops::Range;

/// Cells of a row that are judged together: their counts stay in registers.
const BLOCK: usize = 32;

/// One row of the map, judged at the columns whose window is whole.
struct Row<'a, T> {
    /// The map times the factor, rounded to `T`.
    scaled: &'a [T],
    /// Power of the map in this row.
    power: &'a [T],
    mask: &'a mut [bool],
    /// Where the rows of the window begin in `scaled`, and whether the guard cells cut them.
    rows: &'a [(usize, bool)],
    columns: Range<usize>,
    guard: usize,
    half: usize,
    count: u32,
    rank: u32,
}

impl<T: Real> Vectorised for Row<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run<const FMA: bool>(mut self) {
        let mut first = self.columns.start;
        while first < self.columns.end {
            // The last block reaches back over cells that are judged already, to the same result.
            let start = first.min(self.columns.end.saturating_sub(BLOCK)).max(self.columns.start);
            if self.columns.end - start >= BLOCK {
                self.block(start);
            } else {
                for column in start..self.columns.end {
                    self.mask[column] = self.single(column);
                }
            }
            first = start + BLOCK;
        }
    }
}

impl<T: Real> Row<'_, T> {
    #[inline(always)]
    fn block(&mut self, start: usize) {
        let mut power = [T::zero(); BLOCK];
        power.copy_from_slice(&self.power[start..start + BLOCK]);
        let mut below = [0u32; BLOCK];
        let (half, guard) = (self.half, self.guard);
        let width = 2 * half + 1;
        let mut left = self.count;
        for (at, cut) in self.rows {
            let from = at + start - half;
            if *cut {
                count(&self.scaled[from..], 0..half - guard, &power, &mut below);
                count(&self.scaled[from..], half + guard + 1..width, &power, &mut below);
                left -= (width - 2 * guard - 1) as u32;
            } else {
                count(&self.scaled[from..], 0..width, &power, &mut below);
                left -= width as u32;
            }
            // Cells of noise are settled long before the window is through.
            if below.iter().fold(0, |most, b| most.max(*b)) + left < self.rank {
                break;
            }
        }
        for (mask, below) in self.mask[start..start + BLOCK].iter_mut().zip(&below) {
            *mask = *below >= self.rank;
        }
    }

    #[inline(always)]
    fn single(&self, column: usize) -> bool {
        let power = self.power[column];
        let (half, guard) = (self.half, self.guard);
        let mut below = 0;
        for (at, cut) in self.rows {
            let row = &self.scaled[at + column - half..][..2 * half + 1];
            if *cut {
                below += under(&row[..half - guard], power) + under(&row[half + guard + 1..], power);
            } else {
                below += under(row, power);
            }
        }
        below >= self.rank
    }
}

/// For each cell of a block, adds how many of the cells at `offsets` from it lie under its power.
#[inline(always)]
fn count<T: Real>(cells: &[T], offsets: Range<usize>, power: &[T; BLOCK], below: &mut [u32; BLOCK]) {
    for offset in offsets {
        let Some(cells) = cells[offset..].first_chunk::<BLOCK>() else {
            return;
        };
        for i in 0..BLOCK {
            below[i] += u32::from(cells[i] < power[i]);
        }
    }
}

#[inline(always)]
fn under<T: Real>(cells: &[T], power: T) -> u32 {
    cells.iter().map(|x| u32::from(*x < power)).sum()
}

/// Which cells are detected: those for which at least `rank` of the training cells, times the factor, lie
/// under their power (eq. 85). The factor is rounded to `T` and the products are taken in `T`, so that
/// they are ordered as the cells are, and the f32 engine and the GPU judge every cell alike.
pub fn cfar_os<T: Real>(map: &PowerMap<T>, cfar: &Cfar, columns: &[Column]) -> Vec<bool> {
    let (rows, cols) = (map.doppler_bins, map.range_bins);
    let half = [0, 1].map(|i| cfar.guard[i] + cfar.train[i]);
    // Where the window is whole the factor is one, and each product is taken once.
    let whole = if cols > 2 * half[1] { half[1]..cols - half[1] } else { 0..0 };
    let scaled: Vec<T> = match columns.get(whole.start) {
        Some(column) if !whole.is_empty() => {
            let factor = T::of(column.factor);
            map.data.par_iter().with_min_len(1 << 14).map(|p| factor * *p).collect()
        }
        _ => Vec::new(),
    };
    let mut mask = vec![false; map.data.len()];
    mask.par_chunks_mut(cols).enumerate().with_min_len(8).for_each_init_tasks(
        Vec::new,
        |window, (d, mask)| {
            window.clear();
            window.extend((0..=2 * half[0]).map(|i| {
                let row = (d + rows + i - half[0]) % rows;
                (row * cols, i.abs_diff(half[0]) <= cfar.guard[0])
            }));
            let power = &map.data[d * cols..][..cols];
            if !whole.is_empty() {
                let column = columns[whole.start];
                vectorised(Row {
                    scaled: &scaled,
                    power,
                    mask,
                    rows: window,
                    columns: whole.clone(),
                    guard: cfar.guard[1],
                    half: half[1],
                    count: column.count,
                    rank: column.rank,
                });
            }
            for r in (0..whole.start).chain(whole.end..cols) {
                let Reach { outer, inner } = reach(cfar, r, cols);
                let factor = T::of(columns[r].factor);
                let count = |cells: &[T]| cells.iter().filter(|x| factor * **x < power[r]).count();
                let below: usize = window
                    .iter()
                    .map(|(at, cut)| {
                        let row = &map.data[*at..*at + cols];
                        if *cut {
                            count(&row[outer.0..inner.0]) + count(&row[inner.1 + 1..outer.1 + 1])
                        } else {
                            count(&row[outer.0..=outer.1])
                        }
                    })
                    .sum();
                mask[r] = below >= columns[r].rank as usize;
            }
        },
    );
    mask
}

/// The order statistic of training cells, which are put in another order.
pub(super) fn statistic<T: Real>(cells: &mut [T], rank: u32) -> T {
    // No NaN gets here: the map was checked.
    let order = |a: &T, b: &T| a.partial_cmp(b).unwrap_or(Ordering::Equal);
    *cells.select_nth_unstable_by(rank as usize - 1, order).1
}
