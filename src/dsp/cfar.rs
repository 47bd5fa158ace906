//! What the CFAR detectors have in common: the training region, how it shrinks at the ends of the range axis, and the
//! table of factors (CONVENTIONS eq. 17).
//!
//! A cell is detected when its power exceeds a factor times a statistic of the training cells around it. The factor
//! gives the probability of false alarm on noise alone, where each cell is the mean of as many independent exponentials
//! as there are channels. Correlation between cells, by windows and zero padding, is outside that model, and so are
//! echoes in the training cells, which raise the threshold and can hide weak targets.

use super::cfar_factor::Factor;
use super::cfar_window::{Column, Halves, Reach, Window, halves, kind_number, reach, upload_columns};
use super::{Cell, PowerMap, Real, cfar_ca, cfar_go_so, cfar_noise, cfar_os};
use crate::base::error::{BadInput, Error, Result};
use crate::base::tasks::Tasks;
use crate::gpu::{AnyBuffer, Buffer, Recorder, Threads};
use crate::scene::radar::{Cfar, CfarKind};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::sync::{Mutex, PoisonError};

/// One [`Column`] for each range bin. The training region is the full rectangle of half widths
/// guard + train less the rectangle of half widths guard; the Doppler axis wraps; at the ends of
/// the range axis the missing cells are left out, the OS rank is scaled with the number that remain
/// (rounded to nearest, at least 1), and the factor is the one for that number and rank.
///
/// GO and SO take the means of two halves of the region (eq. 85); where one has no cells the other is taken alone.
/// `channels` is the number of looks that the map is the mean of.
///
/// # Errors
/// Returns an error for a window taller than the map, no training cells, a rank outside 1..=cells, or pfa outside 0..1.
pub fn columns(cfar: &Cfar, channels: usize, doppler_bins: usize, range_bins: usize) -> Result<Vec<Column>> {
    let rows = 2 * (cfar.guard[0] + cfar.train[0]) + 1;
    if rows > doppler_bins {
        return Err(BadInput::new("the CFAR window is taller than the map")
            .key("cfar.guard + cfar.train (doppler)")
            .value(cfar.guard[0] + cfar.train[0])
            .allowed(format!(
                "at most {} each side on {doppler_bins} Doppler bins",
                doppler_bins.saturating_sub(1) / 2
            ))
            .remedy("use fewer training cells or more chirps")
            .into());
    }
    if cfar.train == [0, 0] {
        return Err(BadInput::new("the CFAR has no training cells")
            .key("cfar.train")
            .value("[0, 0]")
            .allowed("at least one cell on one axis")
            .into());
    }
    if channels == 0 {
        return Err(BadInput::new("the CFAR needs at least one channel").key("channels").value(0).into());
    }
    let guard_rows = 2 * cfar.guard[0] + 1;
    let full_width = 2 * (cfar.guard[1] + cfar.train[1]) + 1;
    let full = rows * full_width - guard_rows * (2 * cfar.guard[1] + 1);
    if let CfarKind::Os { rank } = cfar.kind
        && (rank == 0 || rank > full)
    {
        return Err(BadInput::new("the OS-CFAR rank exceeds the number of training cells, or is 0")
            .key("cfar.rank")
            .value(rank)
            .allowed(format!("1..={full}"))
            .remedy("three quarters of the training cells is usual")
            .into());
    }
    let parts: Vec<[usize; 2]> = (0..range_bins)
        .map(|r| {
            let Reach { outer, inner } = reach(cfar, r, range_bins);
            // Training cells in columns from..to.
            let cells = |from: usize, to: usize| {
                let guard = to.min(inner.1 + 1).saturating_sub(from.max(inner.0));
                (to - from) * rows - guard * guard_rows
            };
            let parts = match (cfar.kind, halves(cfar)) {
                (CfarKind::Ca | CfarKind::Os { .. }, _) => [0, cells(outer.0, outer.1 + 1)],
                (_, Halves::AlongRange) => [cells(outer.0, r), cells(r + 1, outer.1 + 1)],
                (_, Halves::AlongDoppler) => [cells(outer.0, outer.1 + 1) / 2; 2],
            };
            if parts == [0, 0] {
                return Err(BadInput::new(format!("the CFAR has no training cells at range bin {r}"))
                    .key("cfar.guard, cfar.train")
                    .value(format!("{:?}, {:?}", cfar.guard, cfar.train))
                    .allowed(format!("a window that fits {range_bins} range bins"))
                    .into());
            }
            Ok(parts)
        })
        .collect::<Result<_>>()?;
    let mut distinct = parts.clone();
    distinct.sort_unstable();
    distinct.dedup();
    let columns: Vec<Column> =
        distinct.par_iter().map_tasks(|p| column(cfar, channels, full, *p)).collect::<Result<_>>()?;
    let known: HashMap<[usize; 2], Column> = distinct.into_iter().zip(columns).collect();
    Ok(parts.iter().map(|p| known[p]).collect())
}

/// How a cell with these training cells (of GO and SO: before and after) is judged; `full` is their number
/// in a whole window. Frames of one radar ask for the same ones, so that they are remembered.
fn column(cfar: &Cfar, channels: usize, full: usize, parts: [usize; 2]) -> Result<Column> {
    type Key = (u32, usize, usize, [usize; 2], u64);
    static KNOWN: Mutex<BTreeMap<Key, Column>> = Mutex::new(BTreeMap::new());
    // A panic elsewhere leaves the map whole.
    let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let count = parts[0] + parts[1];
    let rank = match cfar.kind {
        CfarKind::Os { rank } => ((rank * count) as f64 / full as f64).round().max(1.0) as usize,
        _ => 0,
    };
    let key = (kind_number(cfar.kind), channels, rank, parts, cfar.pfa.to_bits());
    if let Some(column) = known().get(&key) {
        return Ok(*column);
    }
    let found = match cfar.kind {
        CfarKind::Ca => Factor { factor: cfar_ca::factor(channels, count, cfar.pfa)?, expectation: 1.0 },
        CfarKind::Go | CfarKind::So => cfar_go_so::factor(cfar.kind, channels, parts, cfar.pfa)?,
        CfarKind::Os { .. } => cfar_os::factor(channels, count, rank, cfar.pfa)?,
    };
    let column = Column {
        count: count as u32,
        before: parts[0] as u32,
        rank: rank as u32,
        factor: found.factor,
        scale: 1.0 / found.expectation,
    };
    let mut known = known();
    if known.len() >= REMEMBERED {
        known.clear();
    }
    known.insert(key, column);
    Ok(column)
}

/// Factors kept at most.
const REMEMBERED: usize = 4096;

/// Threshold over noise for each column, as [`super::Detection::ratio`] holds it.
pub(crate) fn ratios<T: Real>(columns: &[Column]) -> Vec<T> {
    columns.iter().map(|c| T::of(c.factor / c.scale)).collect()
}

/// Iterations of all its loops together that a kernel may ask of a thread. Mesa's llvmpipe leaves
/// loops, without a word, after 65,535.
const ITERATIONS: usize = 65_000;

/// Refuses windows that a thread cannot go through in [`ITERATIONS`], as often as the detector needs to.
pub(crate) fn check_window(cfar: &Cfar) -> Result<()> {
    let passes = match cfar.kind {
        CfarKind::Os { .. } => cfar_noise::PASSES,
        _ => 1,
    };
    let [rows, width] = [0, 1].map(|i| 2 * (cfar.guard[i] + cfar.train[i]) + 1);
    // Each row costs its cells and a step of the outer loop; the mask's threads have three more cells in reach.
    if passes * (rows * (width + 1) + 1) <= ITERATIONS && rows * (width + 4) < ITERATIONS {
        return Ok(());
    }
    Err(BadInput::new("the CFAR window is too large for the GPU")
        .key("cfar.guard + cfar.train")
        .value(format!("{rows} x {width} cells"))
        .allowed(format!("about {} cells", ITERATIONS / passes))
        .remedy("use fewer training cells, or --device cpu")
        .into())
}

/// Records the detector that `cfar` names on a map of `[doppler bins, range bins]`: 1 in each cell that it
/// detects, else 0. Errors: a window that a thread cannot go through.
pub(crate) fn record(
    recorder: &mut Recorder<'_>,
    map: &Buffer<f32>,
    size: [usize; 2],
    cfar: &Cfar,
    columns: &[Column],
) -> Result<Buffer<u32>> {
    check_window(cfar)?;
    let w = Window::new(size, cfar);
    let columns = upload_columns(recorder, columns);
    let mask = recorder.buffer::<u32>("cfar mask", size[0] * size[1]);
    // Four cells a thread.
    let threads = Threads::Grid([size[1].div_ceil(4) as u32, size[0] as u32, 1]);
    let storage: [&dyn AnyBuffer; 3] = [map, &columns, &mask];
    match cfar.kind {
        CfarKind::Ca => recorder.dispatch(&cfar_ca::KERNEL, &w, &storage, threads),
        CfarKind::Os { .. } => recorder.dispatch(&cfar_os::KERNEL, &w, &storage, threads),
        CfarKind::Go | CfarKind::So => {
            let params = cfar_go_so::CfarGoSoParams {
                doppler_bins: w.doppler_bins,
                range_bins: w.range_bins,
                guard_doppler: w.guard_doppler,
                half_doppler: w.half_doppler,
                guard_range: w.guard_range,
                half_range: w.half_range,
                kind: kind_number(cfar.kind),
                along_doppler: u32::from(halves(cfar) == Halves::AlongDoppler),
            };
            recorder.dispatch(&cfar_go_so::KERNEL, &params, &storage, threads);
        }
    }
    Ok(mask)
}

/// Refuses a map that no detector can judge.
pub(crate) fn check_map<T: Real>(map: &PowerMap<T>) -> Result<()> {
    if map.data.len() != map.doppler_bins * map.range_bins {
        return Err(Error::Failed(format!(
            "the power map has {} cells, not {} x {}",
            map.data.len(),
            map.doppler_bins,
            map.range_bins
        )));
    }
    match map.data.iter().position(|p| !(*p >= T::zero() && p.is_finite())) {
        None => Ok(()),
        Some(i) => Err(Error::Failed(format!(
            "the power map has in cell [doppler {}, range {}] the value {:?}, which is not a finite power",
            i / map.range_bins,
            i % map.range_bins,
            map.data[i]
        ))),
    }
}

pub(crate) fn check_cells<T>(map: &PowerMap<T>, cells: &[Cell]) -> Result<()> {
    match cells.iter().find(|c| c.doppler as usize >= map.doppler_bins || c.range as usize >= map.range_bins)
    {
        None => Ok(()),
        Some(cell) => Err(BadInput::new("the cell is outside the map")
            .key("[doppler, range]")
            .value(format!("[{}, {}]", cell.doppler, cell.range))
            .allowed(format!("less than [{}, {}]", map.doppler_bins, map.range_bins))
            .into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dsp::cfar_factor::{ln_lower, ln_series, ln_upper};
    use statrs::function::gamma::{gamma_lr, gamma_ur};

    fn cfar(kind: CfarKind) -> Cfar {
        Cfar { kind, guard: [2, 1], train: [8, 4], pfa: 1e-3 }
    }

    #[test]
    fn edges_have_fewer_cells() {
        let c = columns(&cfar(CfarKind::Os { rank: 162 }), 12, 64, 32).unwrap();
        assert_eq!((c[16].count, c[16].rank), (216, 162));
        // At column 0: 21 x 6 - 5 x 2.
        assert_eq!((c[0].count, c[0].rank), (116, 87));
        assert_eq!((c[31].count, c[3].count), (116, 21 * 9 - 15));
        assert_eq!(c[0].factor, c[31].factor);
        assert!(c[0].factor != c[16].factor);
        let c = columns(&cfar(CfarKind::Ca), 12, 64, 32).unwrap();
        assert!(c[0].factor > c[16].factor && c[0].scale == 1.0);
        // A map narrower than the window.
        assert_eq!(columns(&cfar(CfarKind::Ca), 1, 21, 1).unwrap()[0].count, 16);
    }

    #[test]
    fn impossible_windows_are_errors() {
        for (kind, doppler, range) in
            [(CfarKind::Ca, 20, 32), (CfarKind::Os { rank: 0 }, 64, 32), (CfarKind::Os { rank: 217 }, 64, 32)]
        {
            let e = columns(&cfar(kind), 1, doppler, range).unwrap_err();
            assert_eq!(e.exit_code(), 2);
        }
        let none = Cfar { train: [0, 0], ..cfar(CfarKind::Ca) };
        assert!(columns(&none, 1, 64, 32).is_err());
        let narrow = Cfar { guard: [0, 3], train: [0, 2], ..cfar(CfarKind::Ca) };
        assert!(columns(&narrow, 1, 64, 3).is_err());
        for pfa in [0.0, 1.0, -1.0, f64::NAN] {
            assert!(columns(&Cfar { pfa, ..cfar(CfarKind::Ca) }, 1, 64, 32).is_err());
        }
    }

    #[test]
    fn bad_maps_are_named() {
        let mut map = PowerMap { doppler_bins: 2, range_bins: 3, data: vec![1.0f32; 6] };
        assert!(check_map(&map).is_ok());
        for bad in [f32::NAN, -1.0, f32::INFINITY] {
            map.data[4] = bad;
            assert!(check_map(&map).unwrap_err().to_string().contains("[doppler 1, range 1]"));
        }
    }

    #[test]
    fn incomplete_gamma() {
        for k in [1, 2, 12, 48, 192] {
            for x in [1e-3, 0.3, 1.0, 5.0, 12.0, 50.0, 190.0, 193.5, 250.0, 400.0] {
                let (p, q) = (gamma_lr(k as f64, x), gamma_ur(k as f64, x));
                if p > 1e-280 {
                    assert!((ln_lower(k, x) - p.ln()).abs() < 1e-9 * (1.0 + p.ln().abs()), "P {k} {x}");
                }
                if q > 1e-280 {
                    assert!((ln_upper(k, x) - q.ln()).abs() < 1e-9 * (1.0 + q.ln().abs()), "Q {k} {x}");
                }
            }
        }
        // Beyond f64: Q(3, x) = e^-x (1 + x + x^2/2).
        assert!((ln_upper(3, 2000.0) - (-2000.0 + (1.0 + 2000.0 + 2e6f64).ln())).abs() < 1e-9);
    }

    #[test]
    fn series_beyond_f64() {
        // e^1000 as its Taylor series.
        let ln = ln_series((1..4000).map(|j| 1000.0 / j as f64));
        assert!((ln - 1000.0).abs() < 1e-9);
    }
}
