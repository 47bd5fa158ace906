//! Peaks that stand over the detector's threshold and became no point, and why.

use super::accuracy::PointAccuracy;
use super::points::{Point, min_range_m, range_m};
use crate::dsp::peaks::group;
use crate::dsp::{Cell, RangeDoppler};
use crate::scene::radar::Radar;
use std::collections::HashSet;

/// Why a peak has no mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Why {
    /// It is the flank of a peak whose top lies at another range rate.
    OtherRate,
    /// A stronger cell stands for it (`processing.group`).
    Grouped,
    /// As many cells as `processing.max_points` allows are stronger.
    BeyondLimit,
    /// The method for angles found no direction.
    NoDirection,
    /// It is nearer than anything that can be separated from the radar itself ([`min_range_m`]).
    AtRadar,
}

impl Why {
    /// The reason in words.
    pub fn text(self) -> &'static str {
        match self {
            Why::OtherRate => "maximum at another range rate",
            Why::Grouped => "joined to a stronger neighbour",
            Why::BeyondLimit => "beyond the limit max_points",
            Why::NoDirection => "no direction found",
            Why::AtRadar => "within half a cell of the radar",
        }
    }
}

/// Peaks of a whole map that are not among its cells, strongest first. `found` is as [`super::locate::points`] leaves it.
fn dropped(radar: &Radar, found: &RangeDoppler<f64>) -> Vec<(Cell, Why)> {
    let all = crate::dsp::cpu::peaks::peaks(&found.map, &found.detection.mask);
    let kept: HashSet<[u32; 2]> = found.cells.iter().map(key).collect();
    // Without an extent every peak stands for itself.
    let groups = group(&found.map, &all, radar.processing.group);
    let heads: HashSet<[u32; 2]> = groups.iter().map(|g| key(&all[g.members[0]])).collect();
    let why = |c: &Cell| if heads.contains(&key(c)) { Why::BeyondLimit } else { Why::Grouped };
    all.iter().filter(|c| !kept.contains(&key(c))).map(|c| (*c, why(c))).collect()
}

fn key(c: &Cell) -> [u32; 2] {
    [c.doppler, c.range]
}

/// Peaks of the map over the threshold that gave no point. Of a radar with several ramps, whose points are put together
/// from all their maps, only those that this map's list of cells leaves out.
pub fn of_map(
    radar: &Radar,
    found: &RangeDoppler<f64>,
    points: &[Point],
    accuracy: &PointAccuracy,
) -> Vec<(Cell, Why)> {
    let mut out = dropped(radar, found);
    if radar.waveform.parts() > 1 {
        return out;
    }
    let rows = found.map.doppler_bins;
    let step = range_m(radar, 1.0, 0.0, 0.0) - range_m(radar, 0.0, 0.0, 0.0);
    // The cells that a point may have come from: it lies within half a cell of them.
    let near = |at: f64| {
        let cells = [at.floor(), at.ceil()];
        cells.into_iter().filter(move |c| (at - c).abs() < 0.51)
    };
    let mut gave: HashSet<[u32; 2]> = HashSet::new();
    for p in points {
        let bin = (p.range_m - range_m(radar, 0.0, p.range_rate_mps, accuracy.coupling_s)) / step;
        // Folds add whole turns of the rows.
        let row =
            if rows < 2 { 0.0 } else { p.range_rate_mps / radar.velocity_bin_mps() + (rows / 2) as f64 };
        for d in near(row) {
            gave.extend(near(bin).map(|r| [d.rem_euclid(rows as f64) as u32, r.max(0.0) as u32]));
        }
    }
    // A point lies within half a cell of its cell's middle.
    let most_rate = radar.max_velocity_mps() * accuracy.coupling_s.abs();
    let nearest = |c: &Cell| range_m(radar, f64::from(c.range), 0.0, 0.0) - 0.5 * step - most_rate;
    let why = |c: &Cell| if nearest(c) < min_range_m(radar) { Why::AtRadar } else { Why::NoDirection };
    out.extend(found.cells.iter().filter(|c| !gave.contains(&key(c))).map(|c| (*c, why(c))));
    out
}

/// Peaks along range of one row of the map over the threshold, as range bins, that are not among its cells.
pub fn of_row(radar: &Radar, found: &RangeDoppler<f64>, row: usize) -> Vec<(usize, Why)> {
    let bins = found.map.range_bins;
    let (power, mask) = (&found.map.data[row * bins..][..bins], &found.detection.mask[row * bins..][..bins]);
    let top = |r: usize| (r == 0 || power[r - 1] < power[r]) && (r + 1 == bins || power[r + 1] <= power[r]);
    let dropped = dropped(radar, found);
    let cell = |r: usize| Cell { doppler: row as u32, range: r as u32 };
    (0..bins)
        .filter(|r| mask[*r] && top(*r) && !found.cells.contains(&cell(*r)))
        .map(|r| {
            let why = dropped.iter().find(|d| d.0 == cell(r));
            (r, why.map_or(Why::OtherRate, |d| d.1))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::locate;
    use crate::dsp::{Detection, PowerMap, Snapshots};
    use crate::scene::radar_toml;
    use num_complex::Complex64;

    /// A map with peaks at (row, column, power), all over the threshold where they exceed 1.
    fn map(radar: &Radar, peaks: &[(usize, usize, f64)]) -> RangeDoppler<f64> {
        let (rows, bins) = (radar.doppler_rows(), radar.processing.range_fft / 2);
        let mut data = vec![0.1; rows * bins];
        for (d, r, p) in peaks {
            data[d * bins + r] = *p;
        }
        let map = PowerMap { doppler_bins: rows, range_bins: bins, data };
        let mask: Vec<bool> = map.data.iter().map(|p| *p > 1.0).collect();
        let cells = crate::dsp::cpu::peaks::peaks(&map, &mask);
        let channels = radar.channels();
        RangeDoppler {
            detection: Detection { mask, ratio: vec![10.0; bins] },
            noise: vec![0.1; cells.len()],
            snapshots: Snapshots { channels, data: vec![Complex64::ONE; cells.len() * channels] },
            map,
            cells,
        }
    }

    #[test]
    fn every_peak_without_a_mark_has_its_reason() {
        let mut radar = radar_toml::preset("demo77").unwrap();
        radar.processing.group = [2, 3];
        radar.processing.max_points = 2;
        let accuracy = locate::accuracy(&radar).unwrap();
        // A peak; its flank at the next range rate; one beside it; two further ones, the weaker beyond the limit.
        let peaks = [(20, 40, 9.0), (21, 41, 5.0), (22, 43, 3.0), (40, 80, 8.0), (20, 120, 2.0)];
        let mut found = map(&radar, &peaks);
        let engine = crate::engine::Engine::Cpu(crate::engine::Precision::F64);
        let points = locate::points(&engine, &radar, std::slice::from_mut(&mut found), None).unwrap();
        assert_eq!((points.len(), found.cells.len()), (2, 2));
        let cell = |doppler, range| Cell { doppler, range };
        let of_map = |points: &[Point]| of_map(&radar, &found, points, &accuracy);
        let listed = [(cell(22, 43), Why::Grouped), (cell(20, 120), Why::BeyondLimit)];
        assert_eq!(of_map(&points), listed);
        assert_eq!(of_row(&radar, &found, 20), [(120, Why::BeyondLimit)]);
        assert_eq!(of_row(&radar, &found, 21), [(41, Why::OtherRate)]);
        assert_eq!(of_row(&radar, &found, 22), [(43, Why::Grouped)]);
        // A cell without its point.
        let without = of_map(&points[..1]);
        assert_eq!(without.last(), Some(&(cell(40, 80), Why::NoDirection)));
    }
}
