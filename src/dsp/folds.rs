//! Targets of all Doppler folds in their range cells: the chain once for each fold, and of what it finds the strongest
//! (CONVENTIONS eq. 89a).

use super::transform::Transform;
use super::{RangeDoppler, Snapshots};
use crate::adc::Cube;
use crate::base::error::Result;
use crate::scene::radar::{Cfar, Radar};
use num_complex::Complex64;

/// Half the width of a peak with any of the usual windows, in cells of a transform without zeros.
const PEAK: f64 = 2.0;
/// Cells to each side of a detected cell of another fold over which the map is that of its fold.
const SHOWN: i64 = 2;

/// Finds detections with `process`, which is given the transform and the detector, over the Doppler folds that the
/// radar's processing asks for. With K folds each map has the K-th part of the false alarm probability, so that all
/// together have no more than was asked for; one fold is processed as if there were no others.
///
/// # Errors
/// Returns an error if the cube's shape is not the radar's, and what `process` fails with.
pub fn over_ambiguities<T>(
    radar: &Radar,
    cube: &Cube<T>,
    process: impl Fn(&Transform, &Cfar) -> Result<RangeDoppler<f64>>,
) -> Result<RangeDoppler<f64>> {
    let mut transform = Transform::of_cube(cube, radar)?;
    let folds = radar.migration_ambiguities();
    let count = folds.clone().count();
    if count == 1 {
        return process(&transform, &radar.processing.cfar);
    }
    let cfar = Cfar { pfa: radar.processing.cfar.pfa / count as f64, ..radar.processing.cfar };
    let mut found = Vec::with_capacity(count);
    for fold in folds {
        if let Some(keystone) = &mut transform.keystone {
            keystone.fold = fold;
        }
        found.push((fold, process(&transform, &cfar)?));
    }
    Ok(strongest(found, &Smear::new(radar, &transform)))
}

/// Number of cells `[doppler, range]` over which a target is smeared in the map of another fold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smear {
    /// Number of cells of the smear for each fold by which the two differ.
    pub per_fold: [f64; 2],
    /// Half the width of a peak, cells.
    pub peak: [f64; 2],
}

impl Smear {
    /// Computes the smear: how much farther a target of the next fold walks during its chirps, and how much its Doppler
    /// frequency changes over the ramp.
    pub fn new(radar: &Radar, t: &Transform) -> Smear {
        let lines = radar.lines();
        let walk_m = 2.0 * radar.max_velocity_mps() * radar.burst_time_s();
        let band = lines.count as f64 * lines.step_hz.abs() / radar.sample_centre_hz();
        Smear {
            per_fold: [t.doppler_rows() as f64 * band, walk_m / radar.range_bin_m()],
            peak: [
                PEAK * t.doppler_fft as f64 / t.chirps as f64,
                PEAK * t.range_fft as f64 / t.samples as f64,
            ],
        }
    }

    /// Cells to each side between which a target of a fold so many folds off may show.
    fn reach(&self, folds: u32) -> [f64; 2] {
        [0, 1].map(|axis| 0.5 * self.per_fold[axis] * f64::from(folds) + self.peak[axis])
    }
}

/// Keeps of the cells that were found with each fold those that no stronger cell of another fold explains: within the
/// smear of that one the strongest has the right fold. The map is that of fold zero, and about each cell of another
/// fold that of its own.
fn strongest(mut found: Vec<(i32, RangeDoppler<f64>)>, smear: &Smear) -> RangeDoppler<f64> {
    let (rows, columns) = (found[0].1.map.doppler_bins, found[0].1.map.range_bins);
    // (power, map, index), strongest first; equal ones as the maps have them, those of slower folds before others.
    found.sort_by_key(|(fold, _)| fold.abs());
    let mut all: Vec<(f64, usize, usize)> = Vec::new();
    for (map, (_, of)) in found.iter().enumerate() {
        let power = |i: usize| of.map.at(of.cells[i].doppler as usize, of.cells[i].range as usize);
        all.extend((0..of.cells.len()).map(|i| (power(i), map, i)));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let span =
        found.iter().map(|(f, _)| *f).max().unwrap_or(0) - found.iter().map(|(f, _)| *f).min().unwrap_or(0);
    let farthest = (smear.reach(span.unsigned_abs())[0] as usize).min(rows / 2);
    // Range and fold of what is kept, by row.
    let mut by_row: Vec<Vec<(u32, i32)>> = vec![Vec::new(); rows];
    let mut kept: Vec<(usize, usize)> = Vec::new();
    for (_, map, i) in all {
        let (fold, of) = (found[map].0, &found[map].1);
        let cell = of.cells[i];
        let row = cell.doppler as usize;
        let explained = (0..=2 * farthest).any(|k| {
            let off = k.abs_diff(farthest) as f64;
            by_row[(row + rows + k - farthest) % rows].iter().any(|(range, other)| {
                let [doppler, along] = smear.reach(fold.abs_diff(*other));
                *other != fold && off <= doppler && f64::from(range.abs_diff(cell.range)) <= along
            })
        });
        if !explained {
            by_row[row].push((cell.range, fold));
            kept.push((map, i));
        }
    }
    let channels = found[0].1.snapshots.channels;
    let mut cells = Vec::with_capacity(kept.len());
    let mut noise = Vec::with_capacity(kept.len());
    let mut data: Vec<Complex64> = Vec::with_capacity(kept.len() * channels);
    for (map, i) in &kept {
        let of = &found[*map].1;
        cells.push(of.cells[*i]);
        noise.push(of.noise[*i]);
        data.extend(of.snapshots.of(*i));
    }
    let (mut map, mut detection) = (found[0].1.map.clone(), found[0].1.detection.clone());
    // The strongest is written last.
    for ((which, _), cell) in kept.iter().zip(&cells).rev() {
        let of = &found[*which].1;
        for d in -SHOWN..=SHOWN {
            let row = (i64::from(cell.doppler) + d).rem_euclid(rows as i64) as usize;
            let first = (i64::from(cell.range) - SHOWN).max(0) as usize;
            let last = ((i64::from(cell.range) + SHOWN) as usize).min(columns - 1);
            let range = row * columns + first..=row * columns + last;
            map.data[range.clone()].copy_from_slice(&of.map.data[range.clone()]);
            detection.mask[range.clone()].copy_from_slice(&of.detection.mask[range]);
        }
    }
    RangeDoppler { map, detection, cells, noise, snapshots: Snapshots { channels, data } }
}
