//! Ramps of one slope see every body in the same cell: what their maps show is put together without regard to phase.

use super::accuracy::PointAccuracy;
use super::ambiguity::Ambiguity;
use super::points::{Detected, range_rate_mps};
use crate::base::frames::direction_from_angles;
use crate::scene::radar::Radar;
use num_complex::Complex64;

/// Slopes that differ by less than this, relatively, are one.
const EQUAL: f64 = 1e-6;
/// Directions are one where a beam on one of them has at least half its power on the other.
const HALF: f64 = 0.5;

/// Ramps of each slope of a radar: their numbers, slopes in the order in which they come.
pub fn ramps(radar: &Radar) -> Vec<Vec<usize>> {
    let slopes: Vec<f64> = (0..radar.waveform.parts()).map(|i| radar.part(i).slope_hz_per_s()).collect();
    groups(&slopes)
}

/// The same of a list: indices into `slopes_hz_per_s`, in the order in which they come.
fn groups(slopes_hz_per_s: &[f64]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (i, s) in slopes_hz_per_s.iter().enumerate() {
        match groups.iter_mut().find(|g| (slopes_hz_per_s[g[0]] - s).abs() <= EQUAL * s.abs()) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

/// What the maps of ramps of one slope show, strongest first. Detections of different ramps within one resolution cell in range,
/// range rate and direction are one body: its places are means weighted with the SNR, its power and noise plain means over
/// the ramps that saw it (`Detected::looks`). What one ramp alone saw stays, so false alarms of all ramps add up; of the
/// bodies of several lists `Processing::max_points` are kept.
/// `radar` and `accuracy` are those of one of the ramps.
pub fn together(radar: &Radar, accuracy: &PointAccuracy, lists: &[Vec<Detected>]) -> Vec<Detected> {
    let Some((first, more)) = lists.split_first() else { return Vec::new() };
    if more.is_empty() {
        return first.clone();
    }
    let p = &radar.processing;
    let same = Same {
        columns: p.range_fft as f64 / radar.lines().count.max(1) as f64,
        rows: p.doppler_fft as f64 / radar.chirps.max(1) as f64,
        all_rows: radar.doppler_rows() as f64,
        accuracy,
    };
    let mut bodies: Vec<Vec<Detected>> = first.iter().map(|d| vec![*d]).collect();
    for list in more {
        bodies.sort_by(|a, b| a[0].range_bin.total_cmp(&b[0].range_bin));
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (j, d) in list.iter().enumerate() {
            let from = bodies.partition_point(|b| b[0].range_bin < d.range_bin - same.columns);
            let near = bodies[from..].iter().take_while(|b| b[0].range_bin <= d.range_bin + same.columns);
            pairs.extend(near.enumerate().filter_map(|(i, b)| Some((same.distance(&b[0], d)?, from + i, j))));
        }
        // The nearest first; each body takes one detection of a ramp.
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let (mut taken, mut placed) = (vec![false; bodies.len()], vec![false; list.len()]);
        for (_, i, j) in pairs {
            if !taken[i] && !placed[j] {
                (taken[i], placed[j]) = (true, true);
                bodies[i].push(list[j]);
            }
        }
        bodies.extend(list.iter().zip(placed).filter(|(_, placed)| !placed).map(|(d, _)| vec![*d]));
    }
    let mut out: Vec<Detected> = bodies.iter().map(|b| mean(radar, b)).collect();
    out.sort_by(|a, b| b.power_w.total_cmp(&a.power_w).then(a.range_bin.total_cmp(&b.range_bin)));
    out.truncate(p.max_points);
    out
}

/// Difference of two rows, the short way round a map of `all` rows.
fn turn(rows: f64, all: f64) -> f64 {
    if all > 0.0 { rows - all * (rows / all).round() } else { rows }
}

/// When two detections are of one body.
struct Same<'a> {
    /// Cells of one resolution.
    columns: f64,
    rows: f64,
    all_rows: f64,
    accuracy: &'a PointAccuracy,
}

impl Same<'_> {
    fn distance(&self, a: &Detected, b: &Detected) -> Option<f64> {
        let column = (a.range_bin - b.range_bin) / self.columns;
        let row = turn(a.doppler_row - b.doppler_row, self.all_rows) / self.rows;
        let alike = self.alike(a, b);
        (column.abs() <= 1.0 && row.abs() <= 1.0 && alike >= HALF)
            .then_some(column * column + row * row + 1.0 - alike)
    }

    /// Power of a beam on one direction that falls on the other.
    fn alike(&self, a: &Detected, b: &Detected) -> f64 {
        let apart = direction_from_angles(a.azimuth_rad, a.elevation_rad)
            - direction_from_angles(b.azimuth_rad, b.elevation_rad);
        let elements = &self.accuracy.elements;
        let beam: Complex64 =
            elements.iter().map(|e| Complex64::cis(self.accuracy.wavenumber * apart.dot(e.position_m))).sum();
        (beam / elements.len().max(1) as f64).norm_sqr()
    }
}

fn mean(radar: &Radar, seen: &[Detected]) -> Detected {
    let first = seen[0];
    if seen.len() == 1 {
        return first;
    }
    let weight = |d: &Detected| if d.noise_w > 0.0 { d.power_w / d.noise_w } else { 1.0 };
    let total: f64 = seen.iter().map(weight).sum();
    let placed =
        |value: &dyn Fn(&Detected) -> f64| seen.iter().map(|d| weight(d) * value(d)).sum::<f64>() / total;
    let plain = |value: &dyn Fn(&Detected) -> f64| seen.iter().map(value).sum::<f64>() / seen.len() as f64;
    // The fold is that of the ramp that is surest of it.
    let sure = |d: &Detected| match d.ambiguity {
        Ambiguity::Unambiguous | Ambiguity::Resolved | Ambiguity::EgoSpeed => 2,
        Ambiguity::Ambiguous => 1,
        Ambiguity::Unresolved => 0,
    };
    let surer = |d: &Detected, than: &Detected| {
        sure(d) > sure(than) || sure(d) == sure(than) && d.modulo_mps > than.modulo_mps
    };
    let best = seen.iter().fold(&first, |best, d| if surer(d, best) { d } else { best });
    let all_rows = radar.doppler_rows() as f64;
    let fold = all_rows * radar.velocity_bin_mps();
    let rate = |d: &Detected| range_rate_mps(radar, d.doppler_row) + d.unfolded_mps;
    let disagree = seen.iter().any(|d| sure(d) == 2 && (rate(d) - rate(best)).abs() > 0.5 * fold);
    let doppler_row = first.doppler_row + placed(&|d| turn(d.doppler_row - first.doppler_row, all_rows));
    // Rows next to the edge of the map may lie on both sides of it.
    let from_row = rate(best) - range_rate_mps(radar, doppler_row);
    let across = ((from_row - best.unfolded_mps) / fold).round() * fold;
    let known: Vec<[f64; 2]> = seen.iter().filter_map(|d| d.angle_std_rad).collect();
    let std = |i: usize| known.iter().map(|s| s[i].powi(-2)).sum::<f64>().sqrt().recip();
    Detected {
        range_bin: placed(&|d| d.range_bin),
        doppler_row,
        unfolded_mps: best.unfolded_mps + across,
        azimuth_rad: placed(&|d| d.azimuth_rad),
        elevation_rad: placed(&|d| d.elevation_rad),
        power_w: plain(&|d| d.power_w),
        scalloping: plain(&|d| d.power_w * d.scalloping) / plain(&|d| d.power_w),
        noise_w: plain(&|d| d.noise_w),
        ambiguity: if disagree { Ambiguity::Ambiguous } else { best.ambiguity },
        modulo_mps: best.modulo_mps,
        angle_std_rad: (known.len() == seen.len()).then(|| [std(0), std(1)]),
        looks: seen.iter().map(|d| d.looks).sum(),
        at_search_edge: seen.iter().any(|d| d.at_search_edge),
        // A fold that is known in one ramp is known.
        by_folds: best.by_folds,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Draws;
    use crate::detect::locate;
    use crate::detect::points::point;
    use crate::scene::radar_toml;

    fn seen(range_bin: f64, doppler_row: f64, azimuth_rad: f64, power_w: f64) -> Detected {
        Detected {
            range_bin,
            doppler_row,
            unfolded_mps: 0.0,
            azimuth_rad,
            elevation_rad: 0.0,
            power_w,
            scalloping: 1.0,
            noise_w: 1.0,
            ambiguity: Ambiguity::Unresolved,
            modulo_mps: f64::INFINITY,
            angle_std_rad: None,
            looks: 1,
            at_search_edge: false,
            by_folds: Default::default(),
        }
    }

    #[test]
    fn slopes_are_told_apart() {
        assert_eq!(groups(&[1.0, 1.0 + 1e-9, -1.0]), [vec![0, 1], vec![2]]);
        assert_eq!(groups(&[-2.0, 1.0, -2.0, 3.0]), [vec![0, 2], vec![1], vec![3]]);
        assert!(groups(&[]).is_empty());
    }

    /// Bodies keep their number, strays stay, and order and power are right.
    #[test]
    fn bodies_meet_themselves() {
        let radar = radar_toml::preset("demo77").unwrap();
        let accuracy = locate::accuracy(&radar).unwrap();
        let rows = radar.doppler_rows() as f64;
        // The same place twice, seen as two directions; one at the edge of the map; one that one ramp alone saw.
        let a = [seen(50.0, 3.0, 0.4, 100.0), seen(50.0, 3.0, -0.4, 80.0), seen(70.0, 0.1, 0.0, 60.0)];
        let b = [
            seen(50.2, 3.1, -0.41, 90.0),
            seen(49.9, 3.0, 0.4, 110.0),
            seen(70.0, rows - 0.2, 0.0, 60.0),
            seen(20.0, 9.0, 0.1, 500.0),
        ];
        let got = together(&radar, &accuracy, &[a.to_vec(), b.to_vec()]);
        let looks: Vec<u32> = got.iter().map(|d| d.looks).collect();
        let power: Vec<f64> = got.iter().map(|d| d.power_w).collect();
        assert_eq!((looks, power), (vec![1, 2, 2, 2], vec![500.0, 105.0, 85.0, 60.0]));
        assert!((got[1].azimuth_rad - 0.4).abs() < 1e-12);
        assert!((got[1].range_bin - (50.0 * 100.0 + 49.9 * 110.0) / 210.0).abs() < 1e-12);
        assert!((got[2].azimuth_rad + (0.4 * 80.0 + 0.41 * 90.0) / 170.0).abs() < 1e-12);
        assert!((got[3].doppler_row + 0.05).abs() < 1e-9);
        // The rate belongs to one side of the edge, whichever the mean row is on.
        let rate = range_rate_mps(&radar, got[3].doppler_row) + got[3].unfolded_mps;
        assert!((rate - range_rate_mps(&radar, 0.0)).abs() < 0.2 * radar.velocity_bin_mps(), "{rate}");
        let mut few = radar.clone();
        few.processing.max_points = 2;
        assert_eq!(together(&few, &accuracy, &[a.to_vec(), b.to_vec()]), got[..2]);
        // One list stays as it is.
        assert_eq!(together(&radar, &accuracy, &[a.to_vec()]), a);
        assert!(together(&radar, &accuracy, &[]).is_empty());
    }

    /// Two looks are as much better as the standard deviations of the points say.
    #[test]
    fn errors_average() {
        let radar = radar_toml::preset("demo77").unwrap();
        let accuracy = locate::accuracy(&radar).unwrap();
        let (snr, n) = (40.0, 2000);
        let one = accuracy.range.std_cells(snr * accuracy.elements.len() as f64);
        let (mut squared, mut said) = (0.0, 0.0);
        for key in 0..n {
            let mut d = Draws::new(key, 71);
            let list = |d: &mut Draws| vec![seen(50.0 + one * d.normal(), 3.0, 0.1, snr)];
            let lists = [list(&mut d), list(&mut d)];
            let got = together(&radar, &accuracy, &lists);
            assert_eq!(got.len(), 1);
            squared += (got[0].range_bin - 50.0).powi(2) / f64::from(n);
            said = point(&radar, &got[0], &accuracy).beat_std_cells;
        }
        // Of 2000 draws a standard deviation is known to 1.6 %.
        assert!((squared.sqrt() / (one / 2f64.sqrt()) - 1.0).abs() < 0.06, "{}", squared.sqrt() / one);
        // Twice the SNR halves the variance.
        assert_eq!(said, accuracy.range.std_cells(2.0 * snr * accuracy.elements.len() as f64));
        assert!((said / (one / 2f64.sqrt()) - 1.0).abs() < 1e-3, "{said} {one}");
    }
}
