//! What the CFAR detectors have in common: the training region, how it shrinks at the ends of the
//! range axis, and the table of factors (CONVENTIONS eq. 17).

use super::device::DeviceDetection;
use super::{PowerMap, Real, cfar_ca, cfar_os};
use crate::error::{BadInput, Error, Result};
use crate::gpu::{Buffer, Kernel, Recorder, Threads};
use crate::gpu_struct;
use crate::scene::radar::{Cfar, CfarKind};
use std::collections::HashMap;

/// How a cell is judged in one range column: detected when power > factor x statistic, where the
/// statistic is the mean (CA) or the `rank`-th smallest (OS) of `count` training cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Training cells.
    pub count: u32,
    /// 1-based rank (OS); 0 for CA.
    pub rank: u32,
    pub factor: f64,
    /// Noise power / statistic: 1 for CA, 1/E[statistic on unit-mean noise] for OS.
    pub scale: f64,
}

/// The columns `lo..=hi` that the training rectangle and the guard rectangle around `range` have,
/// both cut to the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    pub outer: (usize, usize),
    pub inner: (usize, usize),
}

pub(crate) fn reach(cfar: &Cfar, range: usize, range_bins: usize) -> Reach {
    let cut = |half: usize| (range.saturating_sub(half), (range + half).min(range_bins - 1));
    Reach { outer: cut(cfar.guard[1] + cfar.train[1]), inner: cut(cfar.guard[1]) }
}

/// One [`Column`] for each range bin. The training region is the full rectangle of half widths
/// guard + train less the rectangle of half widths guard; the Doppler axis wraps; at the ends of
/// the range axis the missing cells are left out, the OS rank is scaled with the number that remain
/// (rounded to nearest, at least 1), and the factor is the one for that number and rank.
///
/// `channels` is the number of looks that the map is the mean of. Errors: a window taller than the
/// map, no training cells, a rank outside 1..=cells, pfa outside 0..1.
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
            .remedy("take fewer training cells or more chirps")
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
        return Err(BadInput::new("the OS-CFAR rank is not one of the training cells")
            .key("cfar.rank")
            .value(rank)
            .allowed(format!("1..={full}"))
            .remedy("three quarters of the training cells is usual")
            .into());
    }
    let mut known: HashMap<usize, Column> = HashMap::new();
    (0..range_bins)
        .map(|r| {
            let Reach { outer, inner } = reach(cfar, r, range_bins);
            let (outer, inner) = (outer.1 - outer.0 + 1, inner.1 - inner.0 + 1);
            let count = rows * outer - guard_rows * inner;
            if count == 0 {
                return Err(BadInput::new(format!("the CFAR has no training cells at range bin {r}"))
                    .key("cfar.guard, cfar.train")
                    .value(format!("{:?}, {:?}", cfar.guard, cfar.train))
                    .allowed(format!("a window that fits {range_bins} range bins"))
                    .into());
            }
            if let Some(column) = known.get(&count) {
                return Ok(*column);
            }
            let column = match cfar.kind {
                CfarKind::Ca => Column {
                    count: count as u32,
                    rank: 0,
                    factor: cfar_ca::factor(channels, count, cfar.pfa)?,
                    scale: 1.0,
                },
                CfarKind::Os { rank } => {
                    let rank = ((rank * count) as f64 / full as f64).round().max(1.0) as usize;
                    let os = cfar_os::factor(channels, count, rank, cfar.pfa)?;
                    Column {
                        count: count as u32,
                        rank: rank as u32,
                        factor: os.factor,
                        scale: 1.0 / os.expectation,
                    }
                }
            };
            known.insert(count, column);
            Ok(column)
        })
        .collect()
}

/// Threshold over noise for each column, as [`super::Detection::ratio`] holds it.
pub(crate) fn ratios<T: Real>(columns: &[Column]) -> Vec<T> {
    columns.iter().map(|c| T::of(c.factor / c.scale)).collect()
}

gpu_struct! {
    /// Uniform of both CFAR shaders.
    pub struct Params {
        pub doppler_bins: u32,
        pub range_bins: u32,
        pub guard_doppler: u32,
        pub half_doppler: u32,
        pub guard_range: u32,
        pub half_range: u32,
    }
}

/// [`Column`] as the shaders have it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct DeviceColumn {
    count: u32,
    rank: u32,
    factor: f32,
    scale: f32,
}

impl DeviceColumn {
    pub const LAYOUT: crate::gpu::StructLayout = crate::gpu::StructLayout {
        name: "Column",
        size: size_of::<DeviceColumn>(),
        fields: &[
            ("count", std::mem::offset_of!(DeviceColumn, count)),
            ("rank", std::mem::offset_of!(DeviceColumn, rank)),
            ("factor", std::mem::offset_of!(DeviceColumn, factor)),
            ("scale", std::mem::offset_of!(DeviceColumn, scale)),
        ],
    };
}

/// Iterations of all its loops together that a kernel may ask of a thread. Mesa's llvmpipe leaves
/// loops, without a word, after 65,535.
const ITERATIONS: usize = 65_000;

/// Refuses windows that a thread cannot go through in [`ITERATIONS`]. `passes`: how often at most.
pub(crate) fn check_window(cfar: &Cfar, passes: usize) -> Result<()> {
    let [rows, width] = [0, 1].map(|i| 2 * (cfar.guard[i] + cfar.train[i]) + 1);
    // Each row costs its cells and a step of the outer loop.
    if passes * (rows * (width + 1) + 1) <= ITERATIONS {
        return Ok(());
    }
    Err(BadInput::new("the CFAR window is too large for the GPU")
        .key("cfar.guard + cfar.train")
        .value(format!("{rows} x {width} cells"))
        .allowed(format!("about {} cells", ITERATIONS / passes))
        .remedy("take fewer training cells, or the device cpu")
        .into())
}

/// Records a CFAR kernel on a map of `[doppler bins, range bins]`.
pub(crate) fn record(
    recorder: &mut Recorder<'_>,
    kernel: &'static Kernel,
    map: &Buffer<f32>,
    size: [usize; 2],
    cfar: &Cfar,
    columns: &[Column],
) -> DeviceDetection {
    let half = [0, 1].map(|i| cfar.guard[i] + cfar.train[i]);
    let params = Params {
        doppler_bins: size[0] as u32,
        range_bins: size[1] as u32,
        guard_doppler: cfar.guard[0] as u32,
        half_doppler: half[0] as u32,
        guard_range: cfar.guard[1] as u32,
        half_range: half[1] as u32,
    };
    let columns: Vec<DeviceColumn> = columns
        .iter()
        .map(|c| DeviceColumn {
            count: c.count,
            rank: c.rank,
            factor: c.factor as f32,
            scale: c.scale as f32,
        })
        .collect();
    let columns = recorder.upload("cfar columns", &columns);
    let mask = recorder.buffer::<u32>("cfar mask", size[0] * size[1]);
    let noise = recorder.buffer::<f32>("cfar noise", size[0] * size[1]);
    let threads = Threads::Grid([size[1] as u32, size[0] as u32, 1]);
    recorder.dispatch(kernel, &params, &[map, &columns, &mask, &noise], threads);
    DeviceDetection { mask, noise }
}

/// Refuses a map that no detector can judge.
pub(crate) fn check_map<T: Real>(map: &PowerMap<T>) -> Result<()> {
    if map.data.len() != map.doppler_bins * map.range_bins {
        return Err(Error::Failed(format!(
            "power map holds {} cells, not {} x {}",
            map.data.len(),
            map.doppler_bins,
            map.range_bins
        )));
    }
    match map.data.iter().position(|p| !(*p >= T::zero() && p.is_finite())) {
        None => Ok(()),
        Some(i) => Err(Error::Failed(format!(
            "power map: cell [doppler {}, range {}] is {:?}, not a finite power",
            i / map.range_bins,
            i % map.range_bins,
            map.data[i]
        ))),
    }
}

pub(crate) fn check_pfa(pfa: f64) -> Result<()> {
    if pfa > 0.0 && pfa < 1.0 {
        return Ok(());
    }
    Err(BadInput::new("not a probability of false alarm")
        .key("cfar.pfa")
        .value(pfa)
        .allowed("0 < pfa < 1")
        .into())
}

/// A sum of positive terms, each the last times a ratio, that may pass the range of f64.
/// Returns the logarithm.
pub(crate) fn ln_series(ratios: impl Iterator<Item = f64>) -> f64 {
    const BIG: f64 = 1e280;
    let (mut term, mut sum, mut shift) = (1.0f64, 1.0f64, 0.0f64);
    for ratio in ratios {
        term *= ratio;
        sum += term;
        if sum > BIG {
            sum /= BIG;
            term /= BIG;
            shift += BIG.ln();
        }
        if term < 1e-18 * sum && ratio < 0.5 {
            break;
        }
    }
    shift + sum.ln()
}

/// The factor at which the falling function `ln_pfa` of the factor meets `ln_wanted`.
pub(crate) fn solve_factor(ln_pfa: impl Fn(f64) -> f64, ln_wanted: f64) -> Result<f64> {
    let f = |s: f64| ln_pfa(s.exp()) - ln_wanted;
    let (mut a, mut b) = (0.0f64, 0.0f64);
    let (mut fa, mut fb) = (f(a), f(a));
    // Grow the bracket from factor 1 until fa >= 0 >= fb.
    let mut step = 0.5;
    while fb > 0.0 {
        (a, fa) = (b, fb);
        b += step;
        fb = f(b);
        step *= 1.5;
        if b > 600.0 {
            return Err(Error::Failed("CFAR factor: no solution below e^600".into()));
        }
    }
    step = 0.5;
    while fa < 0.0 {
        (b, fb) = (a, fa);
        a -= step;
        fa = f(a);
        step *= 1.5;
        if a < -600.0 {
            return Err(Error::Failed("CFAR factor: no solution above e^-600".into()));
        }
    }
    // Regula falsi (Illinois), with a bisection whenever it does not halve the bracket.
    for _ in 0..200 {
        if fa == 0.0 {
            return Ok(a.exp());
        }
        if fb == 0.0 || (b - a) <= 4e-15 * (1.0 + a.abs().max(b.abs())) {
            return Ok(b.exp());
        }
        let width = b - a;
        for halve in [false, true] {
            if halve && (b - a) <= 0.5 * width {
                break;
            }
            let c = if halve { 0.5 * (a + b) } else { (a * fb - b * fa) / (fb - fa) };
            let c = if c > a && c < b { c } else { 0.5 * (a + b) };
            let fc = f(c);
            if fc > 0.0 {
                (a, fa) = (c, fc);
            } else {
                (b, fb) = (c, fc);
            }
        }
    }
    Ok((0.5 * (a + b)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn series_beyond_f64() {
        // e^1000 as its Taylor series.
        let ln = ln_series((1..4000).map(|j| 1000.0 / j as f64));
        assert!((ln - 1000.0).abs() < 1e-9);
    }
}
