//! Peaks: their order, their place between cells (CONVENTIONS eq. 18), and the host side of the
//! kernel that lists them.

use super::{Cell, PowerMap, Real};
use crate::base::error::{BadInput, Result};
use crate::gpu::{Access, Buffer, Kernel, Recorder, Threads, Tolerance};
use crate::gpu_struct;
use num_complex::Complex64;
use std::f64::consts::TAU;

gpu_struct! {
    /// Uniform of `shaders/dsp/peaks.wgsl`.
    pub struct PeakParams {
        pub doppler_bins: u32,
        pub range_bins: u32,
        pub capacity: u32,
        pub phase: u32,
        pub blocks: u32,
    }
}

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "dsp/peaks",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/dsp/peaks.wgsl"),
    ],
    workgroup: [256, 1, 1],
    params: Some(PeakParams::LAYOUT),
    storage: &[Access::Read, Access::Read, Access::ReadWrite, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance { relative_l2: 0.0, reason: "compares and counts" },
};

/// Cells that one workgroup looks at: its threads x the stretch of each in the shader.
const BLOCK: usize = 256 * 16;

/// Lists the peaks of a map of `[doppler bins, range bins]` among its masked cells: first how many there
/// are, then up to `capacity` of them as doppler x range_bins + range, in the order of the map.
pub fn record(
    recorder: &mut Recorder<'_>,
    map: &Buffer<f32>,
    mask: &Buffer<u32>,
    size: [usize; 2],
    capacity: usize,
) -> Buffer<u32> {
    let list = recorder.buffer::<u32>("detected cells", capacity + 1);
    let blocks = (size[0] * size[1]).div_ceil(BLOCK);
    let places = recorder.buffer::<u32>("places of detected cells", blocks);
    let threads = (blocks * KERNEL.workgroup[0] as usize) as u64;
    for (phase, threads) in
        [(0, Threads::Linear(threads)), (1, Threads::Workgroups([1, 1, 1])), (2, Threads::Linear(threads))]
    {
        let params = PeakParams {
            doppler_bins: size[0] as u32,
            range_bins: size[1] as u32,
            capacity: capacity as u32,
            phase,
            blocks: blocks as u32,
        };
        recorder.dispatch(&KERNEL, &params, &[map, mask, &places, &list], threads);
    }
    list
}

/// Place of a peak between cells, and its height there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Row of the map, with a fraction.
    pub doppler: f64,
    /// Column of the map, with a fraction.
    pub range: f64,
    /// Power at the top in W: that of a target alone by the windows' responses, while a parabola overshoots between cells, with a
    /// Hann window by up to 0.33 dB an axis.
    pub power: f64,
}

/// Offset in cells, within +-0.5, and height of the parabola through the logarithms of three powers
/// of which the middle is the largest. When the middle is not the largest, or one is not positive,
/// the peak is left on its cell.
///
/// # Example
/// The logarithm of a Gaussian is a parabola, so that a Gaussian peak is found exactly.
///
/// ```
/// use catseye::dsp::peaks::parabola;
///
/// let power = |cell: f64| 5.0 * (-(cell - 0.2).powi(2)).exp();
/// let (offset, peak) = parabola(power(-1.0), power(0.0), power(1.0));
/// assert!((offset - 0.2).abs() < 1e-12 && (peak - 5.0).abs() < 1e-12);
/// ```
pub fn parabola(before: f64, at: f64, after: f64) -> (f64, f64) {
    if !(before > 0.0 && after > 0.0 && at >= before && at >= after) {
        return (0.0, at);
    }
    // Ratios, so that powers near the ends of the number range stay exact.
    let (a, c) = ((before / at).ln(), (after / at).ln());
    let curvature = a + c;
    if curvature >= 0.0 {
        return (0.0, at);
    }
    let offset = 0.5 * (a - c) / curvature;
    (offset, at * (-0.25 * (a - c) * offset).exp())
}

/// A peak between cells, by the responses of `[doppler, range]`, where there are any, else by parabolas (eq. 18). The Doppler axis
/// wraps, and a peak in the first or last range column stays on it.
pub fn place<T: Real>(map: &PowerMap<T>, cell: Cell, by: [Option<&Interpolator>; 2]) -> Peak {
    let top = |by: Option<&Interpolator>, before, at, after| match by {
        Some(i) => i.peak(before, at, after),
        None => parabola(before, at, after),
    };
    let (d, r, rows) = (cell.doppler as usize, cell.range as usize, map.doppler_bins);
    let p = |d: usize, r: usize| map.at(d % rows, r).wide();
    let centre = p(d, r);
    let (doppler, by_doppler) =
        if rows < 3 { (0.0, centre) } else { top(by[0], p(d + rows - 1, r), centre, p(d + 1, r)) };
    let (range, by_range) = if r == 0 || r + 1 >= map.range_bins {
        (0.0, centre)
    } else {
        top(by[1], p(d, r - 1), centre, p(d, r + 1))
    };
    // A separable peak: the gains of the two axes multiply.
    let power = if centre > 0.0 { by_doppler * (by_range / centre) } else { centre };
    Peak { doppler: d as f64 + doppler, range: r as f64 + range, power }
}

/// Interpolates peaks between cells, exactly for a single target and a given window: the parabola, with its error taken
/// out.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpolator {
    /// Of true offsets -0.5..=0.5: that of the parabola, and the power in the middle cell over that at the peak.
    table: Vec<(f64, f64)>,
    /// False: only heights are put right.
    places: bool,
}

/// Intervals of the table.
const OFFSETS: usize = 128;

impl Interpolator {
    /// The interpolator for data with these weights and a transform of length `fft`.
    ///
    /// # Errors
    /// Returns an error if there are no weights or the transform is shorter, or for a window that is not symmetric or
    /// whose offsets the parabola does not tell apart.
    pub fn new(weights: &[f64], fft: usize) -> Result<Interpolator> {
        let response = |cells: f64| {
            let step = Complex64::cis(-TAU * cells / fft as f64);
            let (mut turned, mut sum) = (Complex64::ONE, Complex64::ZERO);
            for w in weights {
                sum += turned * w;
                turned *= step;
            }
            sum.norm_sqr()
        };
        let top = response(0.0);
        let table: Vec<(f64, f64)> = (0..=OFFSETS)
            .map(|i| {
                let offset = i as f64 / OFFSETS as f64 - 0.5;
                let at = response(offset);
                // Rounding decides which of two equal cells at the ends is the larger.
                let (before, after) = (response(1.0 + offset).min(at), response(1.0 - offset).min(at));
                // Where cells beside a target are empty, as those of a rectangle.
                let found = if offset == 0.0 { 0.0 } else { parabola(before, at, after).0 };
                (found, at / top)
            })
            .collect();
        let rises = table.windows(2).all(|w| w[0].0 < w[1].0);
        if weights.is_empty() || fft < weights.len() || !rises {
            return Err(BadInput::new(
                "the positions of peaks cannot be found with the response of this window",
            )
            .key("window")
            .value(format!("{} weights on a transform of {fft}", weights.len()))
            .allowed("a symmetric window and a transform that is not shorter")
            .remedy("use the parabola, or a transform twice as long")
            .into());
        }
        Ok(Interpolator { table, places: true })
    }

    /// Offset in cells, within +-0.5, and height of the peak through three powers of which the middle is the
    /// largest. When it is not, or one is not positive, the peak is left on its cell.
    pub fn peak(&self, before: f64, at: f64, after: f64) -> (f64, f64) {
        if !(before > 0.0 && after > 0.0 && at >= before && at >= after) {
            return (0.0, at);
        }
        let found = parabola(before, at, after).0;
        let (offset, gain) = self.at(found);
        (if self.places { offset } else { found }, at / gain)
    }

    /// The interpolator that gives the parabola's places: for windows under which noise moves the true ones much.
    pub fn of_heights(self) -> Interpolator {
        Interpolator { places: false, ..self }
    }

    /// (true offset, power in the middle cell over that at the peak) where the parabola says `found`.
    fn at(&self, found: f64) -> (f64, f64) {
        let i = self.table.partition_point(|v| v.0 < found).clamp(1, OFFSETS);
        let (a, b) = (self.table[i - 1], self.table[i]);
        let share = ((found - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
        (((i - 1) as f64 + share) / OFFSETS as f64 - 0.5, a.1 + share * (b.1 - a.1))
    }

    /// Change of the offset with that of the parabola, at a true offset within +-0.5.
    pub fn slope(&self, offset: f64) -> f64 {
        let i = (((offset + 0.5) * OFFSETS as f64) as usize).min(OFFSETS - 1);
        1.0 / (OFFSETS as f64 * (self.table[i + 1].0 - self.table[i].0))
    }
}

/// A group of detections that stand for one: the strongest and those around it.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// The strongest cell.
    pub cell: Cell,
    /// Indices into the list, the strongest first.
    pub members: Vec<usize>,
}

/// Groups cells, which are listed strongest first: each joins the strongest cell within `extent`
/// `[doppler, range]` cells of it on both axes (Doppler wraps) that stands for a group, or begins one.
pub fn group<T: Real>(map: &PowerMap<T>, cells: &[Cell], extent: [usize; 2]) -> Vec<Group> {
    let (rows, columns) = (map.doppler_bins, map.range_bins);
    let mut owner: Vec<Option<u32>> = vec![None; rows * columns];
    let mut groups: Vec<Group> = Vec::new();
    let reach = extent[0].min(rows / 2);
    for (i, cell) in cells.iter().enumerate() {
        let (d, r) = (cell.doppler as usize, cell.range as usize);
        if let Some(g) = owner[d * columns + r] {
            groups[g as usize].members.push(i);
            continue;
        }
        for step in 0..=2 * reach {
            let row = (d + rows + step - reach) % rows * columns;
            for at in r.saturating_sub(extent[1])..=(r + extent[1]).min(columns - 1) {
                owner[row + at].get_or_insert(groups.len() as u32);
            }
        }
        groups.push(Group { cell: *cell, members: vec![i] });
    }
    groups
}

/// Sorts cells, strongest first; equal powers by row, then column.
pub fn sort<T: Real>(map: &PowerMap<T>, cells: &mut [Cell]) {
    let power = |c: &Cell| map.at(c.doppler as usize, c.range as usize).wide();
    cells.sort_by(|a, b| power(b).total_cmp(&power(a)).then((a.doppler, a.range).cmp(&(b.doppler, b.range))));
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_gaussian_is_found_exactly() {
        let (d0, r0) = (7.3, 4.8);
        let mut map = PowerMap { doppler_bins: 16, range_bins: 10, data: vec![0.0; 160] };
        for d in 0..16 {
            for r in 0..10 {
                let (x, y) = (d as f64 - d0, r as f64 - r0);
                map.data[d * 10 + r] = 3e-12 * (-0.7 * x * x - 1.1 * y * y).exp();
            }
        }
        let peak = place(&map, Cell { doppler: 7, range: 5 }, [None, None]);
        assert!((peak.doppler - d0).abs() < 1e-12 && (peak.range - r0).abs() < 1e-12);
        assert!((peak.power / 3e-12 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn edges_and_zeros_stay_on_the_cell() {
        let map = PowerMap { doppler_bins: 3, range_bins: 2, data: vec![0.0, 0.0, 1.0, 0.5, 0.2, 0.1f64] };
        let peak = place(&map, Cell { doppler: 1, range: 0 }, [None, None]);
        assert_eq!((peak.doppler, peak.range, peak.power), (1.0, 0.0, 1.0));
        assert_eq!(parabola(2.0, 1.0, 0.5), (0.0, 1.0));
        assert_eq!(parabola(1.0, 1.0, 1.0), (0.0, 1.0));
    }

    /// Largest error over a cell in cells, of the parabola and of the window's own response.
    #[test]
    fn bias_of_the_two_interpolations() {
        use crate::dsp::window::coefficients;
        use crate::scene::radar::Window;
        for (window, padding, bound) in [
            (Window::Hann, 1, 0.06),
            (Window::Hann, 2, 0.006),
            (Window::Hamming, 1, 0.08),
            (Window::Blackman, 1, 0.03),
            (Window::DolphChebyshev { side_lobe_db: 60.0 }, 1, 0.05),
            (Window::Rectangle, 2, 0.04),
        ] {
            let n = 128;
            let w = coefficients(window, n).unwrap();
            let own = Interpolator::new(&w, padding * n).unwrap();
            let mut worst = [0.0f64; 4];
            for i in 0..=200 {
                let offset = f64::from(i) / 200.0 - 0.5;
                let p = [-1.0, 0.0, 1.0].map(|k: f64| {
                    let turns = (k - offset) / (padding * n) as f64;
                    let z: Complex64 =
                        w.iter().enumerate().map(|(m, w)| *w * Complex64::cis(-TAU * turns * m as f64)).sum();
                    z.norm_sqr() / w.iter().sum::<f64>().powi(2)
                });
                for (j, (got, height)) in
                    [parabola(p[0], p[1], p[2]), own.peak(p[0], p[1], p[2])].into_iter().enumerate()
                {
                    worst[j] = worst[j].max((got - offset).abs());
                    worst[2 + j] = worst[2 + j].max((10.0 * height.log10()).abs());
                }
            }
            println!("{window:?} x {padding}: {worst:?} cells, dB");
            assert!(worst[0] < bound && worst[0] > 20.0 * worst[1], "{window:?}: {worst:?}");
            assert!(worst[1] < 1e-4 && worst[3] < 1e-3, "{window:?}: {worst:?}");
        }
        assert!(Interpolator::new(&[], 4).is_err() && Interpolator::new(&[1.0; 8], 4).is_err());
    }

    #[test]
    fn groups_take_what_lies_around() {
        let map = PowerMap { doppler_bins: 8, range_bins: 20, data: vec![1.0f64; 160] };
        let cell = |doppler, range| Cell { doppler, range };
        let cells = [cell(0, 5), cell(7, 7), cell(1, 3), cell(4, 5), cell(0, 8), cell(0, 19)];
        let groups = group(&map, &cells, [1, 2]);
        let members: Vec<_> = groups.iter().map(|g| g.members.clone()).collect();
        assert_eq!(members, [vec![0, 1, 2], vec![3], vec![4], vec![5]]);
        // Nothing is lost, and an extent of nothing groups nothing.
        assert_eq!(group(&map, &cells, [0, 0]).len(), cells.len());
        assert_eq!(group(&map, &cells, [100, 100]).len(), 1);
    }

    #[test]
    fn doppler_wraps() {
        let map = PowerMap { doppler_bins: 4, range_bins: 1, data: vec![1.0, 0.5, 0.1, 0.8f64] };
        let peak = place(&map, Cell { doppler: 0, range: 0 }, [None, None]);
        assert!(peak.doppler < 0.0 && peak.doppler > -0.5);
    }

    proptest! {
        #[test]
        fn offset_is_within_half_a_cell(a in 1e-30..1.0f64, b in 1e-30..1.0f64, c in 1e-30..1.0f64) {
            let top = a.max(b).max(c);
            let (offset, height) = parabola(a, top, c);
            prop_assert!(offset.abs() <= 0.5 && height >= top * (1.0 - 1e-12));
        }
    }
}
