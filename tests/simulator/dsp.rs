//! Processing: the cpu engine against slow definitions, closed forms and statistics, and the GPU
//! against the cpu engine.

use catseye::adc::{Cube, CubePiece, DeviceCube};
use catseye::base::frames::{Pose, direction_from_angles};
use catseye::dsp::cpu;
use catseye::dsp::doa_beamform::{self, Beamformer};
use catseye::dsp::{
    Cell, Detection, PowerMap, Real, Snapshots, cfar_ca, cfar_go_so, cfar_noise, device, fft, integrate,
    keystone, peaks, power, spectrum, stream, transform, zero_doppler,
};
use catseye::gpu::compare::{check_close, opened_for_tests, test_gpu};
use catseye::scene::radar::*;
use catseye::scene::waveform::{Multiplex, Waveform};
use glam::DVec3;
use num_complex::{Complex32, Complex64};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// SplitMix64 (Steele et al. 2014): enough for test noise, and its own code.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
    /// In (0, 1].
    fn uniform(&mut self) -> f64 {
        ((self.next() >> 11) + 1) as f64 / (1u64 << 53) as f64
    }
    /// Complex, unit variance.
    fn normal(&mut self) -> Complex64 {
        Complex64::from_polar((-self.uniform().ln()).sqrt(), TAU * self.uniform())
    }
    /// Mean of `looks` unit exponentials.
    fn gamma(&mut self, looks: usize) -> f64 {
        -(0..looks).map(|_| self.uniform().ln()).sum::<f64>() / looks as f64
    }
}

fn antenna(x: f64, y: f64, z: f64) -> Antenna {
    let one = Complex64::new(1.0, 0.0);
    Antenna {
        position_m: DVec3::new(x, y, z),
        polarisation: Polarisation { v: one, h: Complex64::default() },
        gain_dbi: 0.0,
        pattern: Pattern::Isotropic,
    }
}

/// 3 x 4 MIMO: a filled line of 8 half wavelengths, and four more a half wavelength up.
fn radar(chirps: usize, samples: usize, sampling: Sampling) -> Radar {
    let carrier_hz = 77e9;
    let half = 0.5 * catseye::base::units::wavelength_m(carrier_hz);
    Radar {
        name: "test".into(),
        carrier_hz,
        waveform: Waveform::chirp(1e9, 40e-6, 55e-6),
        multiplex: Multiplex::Tdm,
        adc_start_s: 0.0,
        sample_rate_hz: 12.8e6,
        samples,
        chirps,
        sampling,
        tx: vec![antenna(0.0, 0.0, 0.0), antenna(0.0, 4.0 * half, 0.0), antenna(0.0, 2.0 * half, half)],
        rx: (0..4).map(|i| antenna(0.0, i as f64 * half, 0.0)).collect(),
        tx_power_dbm: 12.0,
        noise_figure_db: 10.0,
        thermal_noise: false,
        front_end: Default::default(),
        mounting: Pose::IDENTITY,
        motion: None,
        processing: Processing {
            range_window: Window::Hann,
            doppler_window: Window::Hamming,
            angle_window: Window::Rectangle,
            range_fft: samples.next_power_of_two(),
            doppler_fft: chirps.next_power_of_two(),
            azimuth_bins: 64,
            azimuth_fov_rad: 70f64.to_radians(),
            elevation_bins: 1,
            elevation_fov_rad: 0.0,
            angle: AngleSettings::default(),
            remove_static: false,
            keystone: false,
            migration_max_mps: 0.0,
            group: [0; 2],
            cfar: Cfar { kind: CfarKind::Os { rank: 162 }, guard: [2, 1], train: [8, 4], pfa: 1e-6 },
            max_points: 2000,
        },
    }
}

/// A far target.
#[derive(Clone, Copy)]
struct Target {
    /// Range cell and Doppler row, with fractions.
    cell: (f64, f64),
    azimuth: f64,
    elevation: f64,
    amplitude: Complex64,
}

/// Written from eq. 9, 10 and 12, without a line of the engine.
fn add_target(cube: &mut Cube<f64>, radar: &Radar, target: Target) {
    let k = TAU / radar.wavelength_m();
    let (range, row) = target.cell;
    let fft = radar.processing.doppler_fft;
    let cycles_per_loop = (row - (fft / 2) as f64) / fft as f64;
    let u = direction_from_angles(target.azimuth, target.elevation);
    let n_tx = radar.tx.len();
    for m in 0..cube.chirps {
        for (t, tx) in radar.tx.iter().enumerate() {
            for (r, rx) in radar.rx.iter().enumerate() {
                let shorter = u.dot(tx.position_m + rx.position_m);
                let slow = cycles_per_loop * (m as f64 + t as f64 / n_tx as f64);
                let channel = t * radar.rx.len() + r;
                for n in 0..cube.samples {
                    let fast = range * n as f64 / radar.processing.range_fft as f64;
                    let z = target.amplitude * Complex64::cis(TAU * (fast + slow) - k * shorter);
                    cube.data[(m * cube.channels + channel) * cube.samples + n] += match radar.sampling {
                        Sampling::Iq => z,
                        Sampling::Real => Complex64::new(2f64.sqrt() * z.re, 0.0),
                    };
                }
            }
        }
    }
}

fn noise_cube(radar: &Radar, seed: u64) -> Cube<f64> {
    let mut random = Random(seed);
    let mut cube = Cube::zeros(radar.chirps, radar.channels(), radar.samples);
    for z in &mut cube.data {
        *z = random.normal();
        if radar.sampling == Sampling::Real {
            z.im = 0.0;
        }
    }
    cube
}

fn relative_l2(got: &[Complex64], want: &[Complex64]) -> f64 {
    if got.len() != want.len() {
        return f64::INFINITY;
    }
    let error: f64 = got.iter().zip(want).map(|(g, w)| (g - w).norm_sqr()).sum();
    (error / want.iter().map(|w| w.norm_sqr()).sum::<f64>()).sqrt()
}

fn wide(z: &[Complex32]) -> Vec<Complex64> {
    z.iter().map(|z| Complex64::new(z.re.into(), z.im.into())).collect()
}

#[test]
fn the_comparison_sees_differences() {
    let a = [Complex64::new(1.0, 2.0), Complex64::new(-3.0, 0.5)];
    assert_eq!(relative_l2(&a, &a), 0.0);
    assert!(relative_l2(&[a[0], -a[1]], &a) > 0.5);
    assert!(relative_l2(&[a[0], Complex64::new(f64::NAN, 0.0)], &a).is_nan());
    assert!(relative_l2(&a[..1], &a).is_infinite());
}

/// Eq. 14 as it is written.
fn slow_spectrum(cube: &Cube<f64>, radar: &Radar) -> Vec<Complex64> {
    let p = &radar.processing;
    let w = |window, n| catseye::dsp::window::coefficients(window, n).unwrap();
    let (wr, wd) = (w(p.range_window, cube.samples), w(p.doppler_window, cube.chirps));
    let gain = if radar.sampling == Sampling::Real { 2f64.sqrt() } else { 1.0 };
    let scale = gain / (wr.iter().sum::<f64>() * wd.iter().sum::<f64>());
    let mut out = Vec::new();
    for row in 0..p.doppler_fft {
        let d = row as f64 - (p.doppler_fft / 2) as f64;
        for c in 0..cube.channels {
            for r in 0..radar.range_bins() {
                let mut sum = Complex64::default();
                for (m, wd) in wd.iter().enumerate() {
                    for (n, x) in cube.row(m, c).iter().enumerate() {
                        let turns =
                            r as f64 * n as f64 / p.range_fft as f64 + d * m as f64 / p.doppler_fft as f64;
                        sum += x * wr[n] * wd * Complex64::cis(-TAU * turns);
                    }
                }
                out.push(sum * scale);
            }
        }
    }
    out
}

#[test]
fn spectrum_is_the_sum_of_eq_14() {
    for (chirps, samples, sampling) in
        [(8, 16, Sampling::Iq), (6, 13, Sampling::Iq), (5, 16, Sampling::Real), (1, 1, Sampling::Iq)]
    {
        let mut radar = radar(chirps, samples, sampling);
        radar.processing.cfar = Cfar { kind: CfarKind::Ca, guard: [0, 0], train: [0, 1], pfa: 0.1 };
        radar.processing.range_fft = radar.processing.range_fft.max(4);
        let cube = noise_cube(&radar, 7);
        let (spectrum, _) = cpu::process(&cube, &radar).unwrap();
        let want = slow_spectrum(&cube, &radar);
        let error = relative_l2(&spectrum.data, &want);
        assert!(error < 1e-14, "{chirps} x {samples} {sampling:?}: {error:e}");
        let (single, _) = cpu::process(&cube.to_f32(), &radar).unwrap();
        let error = relative_l2(&wide(&single.data), &want);
        assert!(error < 4.0 * f64::from(f32::EPSILON), "{chirps} x {samples} f32: {error:e}");
    }
}

/// Parseval: sum |X|^2 / (N M) = sum |w x|^2 / (sum w)^2, at a size that blocks the columns.
#[test]
fn energy_is_kept() {
    let mut radar = radar(60, 100, Sampling::Iq);
    radar.processing.range_window = Window::Blackman;
    let cube = noise_cube(&radar, 3);
    let (spectrum, _) = cpu::process(&cube, &radar).unwrap();
    let w = |window, n| catseye::dsp::window::coefficients(window, n).unwrap();
    let (wr, wd) = (w(Window::Blackman, 100), w(Window::Hamming, 60));
    let mut energy = 0.0;
    for (m, wd) in wd.iter().enumerate() {
        for c in 0..12 {
            energy += cube.row(m, c).iter().zip(&wr).map(|(x, w)| (x * w * wd).norm_sqr()).sum::<f64>();
        }
    }
    energy /= (wr.iter().sum::<f64>() * wd.iter().sum::<f64>()).powi(2);
    let got = spectrum.data.iter().map(|x| x.norm_sqr()).sum::<f64>() / (128.0 * 64.0);
    assert!((got / energy - 1.0).abs() < 1e-13, "{got} {energy}");
}

#[test]
fn targets_are_where_they_are_put() {
    for sampling in [Sampling::Iq, Sampling::Real] {
        let mut radar = radar(64, 128, sampling);
        radar.processing.elevation_bins = 17;
        radar.processing.elevation_fov_rad = 0.5;
        let mut cube = noise_cube(&radar, 11);
        for z in &mut cube.data {
            *z *= 1e-9;
        }
        // One recedes, one approaches; left and right, up and down. The first is in the middle of its
        // cell.
        let targets = [((40.0, 41.0), 0.35, 0.1, 4e-12), ((22.3, 11.4), -0.5, -0.12, 1e-12)];
        for (cell, azimuth, elevation, power) in targets {
            let amplitude = Complex64::from_polar(f64::sqrt(power), 1.0);
            add_target(&mut cube, &radar, Target { cell, azimuth, elevation, amplitude });
        }
        let (_, found) = cpu::process(&cube, &radar).unwrap();
        let beam = Beamformer::new(&radar).unwrap();
        assert!(found.cells.len() >= 2);
        for (i, ((range, row), azimuth, elevation, power)) in targets.into_iter().enumerate() {
            let peak = peaks::place(&found.map, found.cells[i], [None, None]);
            assert!((peak.range - range).abs() < 0.03 && (peak.doppler - row).abs() < 0.03, "{peak:?}");
            // The parabola overshoots between cells: by the closed form of Hann at most 0.33 dB an axis.
            let off_db = 10.0 * (peak.power / power).log10();
            assert!(off_db > -0.02 && off_db < if i == 0 { 0.02 } else { 0.66 }, "{peak:?}");
            let v = (peak.doppler - 32.0) * radar.velocity_bin_mps();
            let only = Snapshots { channels: 12, data: found.snapshots.of(i).to_vec() };
            let spectrum = cpu::doa_beamform::spectra(&beam, &only, &[v]);
            let angle = beam.strongest(&spectrum, only.of(0), v).unwrap();
            assert!((angle.azimuth_rad - azimuth).abs() < 0.01, "{angle:?}");
            assert!((angle.elevation_rad - elevation).abs() < 0.02, "{angle:?}");
            if i == 0 {
                assert!((found.map.at(41, 40) / power - 1.0).abs() < 2e-3);
                assert!((angle.amplitude.norm_sqr() / power - 1.0).abs() < 3e-3, "{angle:?}");
            }
        }
    }
}

/// Without the second factor of eq. 19 the same target stands elsewhere, or not in focus.
#[test]
fn tdm_correction_matters() {
    let radar = radar(64, 64, Sampling::Iq);
    let mut cube = Cube::zeros(64, 12, 64);
    let amplitude = Complex64::new(1.0, 0.0);
    add_target(&mut cube, &radar, Target { cell: (20.0, 50.0), azimuth: 0.2, elevation: 0.0, amplitude });
    let (_, found) = cpu::process(&cube, &radar).unwrap();
    let beam = Beamformer::new(&radar).unwrap();
    let snapshot = Snapshots { channels: 12, data: found.snapshots.of(0).to_vec() };
    let at = |v: f64| {
        let power = cpu::doa_beamform::spectra(&beam, &snapshot, &[v]);
        beam.strongest(&power, snapshot.of(0), v).unwrap()
    };
    let right = at(18.0 * radar.velocity_bin_mps());
    assert!((right.azimuth_rad - 0.2).abs() < 0.005 && (right.amplitude.norm() - 1.0).abs() < 1e-3);
    let wrong = at(0.0);
    assert!((wrong.azimuth_rad - 0.2).abs() > 0.03 || wrong.amplitude.norm() < 0.95);
}

#[test]
fn two_targets_in_one_cell() {
    let radar = radar(32, 32, Sampling::Iq);
    let beam = Beamformer::new(&radar).unwrap();
    let mut cube = Cube::zeros(32, 12, 32);
    for (azimuth, amplitude) in [(0.5, Complex64::new(1.0, 0.0)), (-0.4, Complex64::new(0.0, 0.8))] {
        add_target(&mut cube, &radar, Target { cell: (9.0, 16.0), azimuth, elevation: 0.0, amplitude });
    }
    let (_, found) = cpu::process(&cube, &radar).unwrap();
    let one = Snapshots { channels: 12, data: found.snapshots.of(0).to_vec() };
    let power = cpu::doa_beamform::spectra(&beam, &one, &[0.0]);
    let angles = beam.peaks(&power, one.of(0), 0.0, 6.0);
    assert_eq!(angles.len(), 2, "{angles:?}");
    assert!((angles[0].azimuth_rad - 0.5).abs() < 0.05 && (angles[1].azimuth_rad + 0.4).abs() < 0.05);
    assert_eq!(beam.peaks(&power, one.of(0), 0.0, 0.0).len(), 1);
}

/// What a detector says about every cell.
struct Judged<T> {
    mask: Vec<bool>,
    noise: Vec<T>,
    /// Power that a cell has to exceed.
    threshold: Vec<T>,
}

/// Straight from the definition: training cells listed one by one.
fn slow_cfar(map: &PowerMap<f64>, cfar: &Cfar, looks: usize) -> Judged<f64> {
    let (rows, cols) = (map.doppler_bins as i64, map.range_bins as i64);
    let full = window_cells(cfar.guard, cfar.train);
    let mut out = Judged { mask: vec![], noise: vec![], threshold: vec![] };
    let [hd, hr] = [0, 1].map(|i| (cfar.guard[i] + cfar.train[i]) as i64);
    for d in 0..rows {
        for r in 0..cols {
            let mut cells = vec![];
            let (mut before, mut after) = (vec![], vec![]);
            for dd in -hd..=hd {
                for dr in -hr..=hr {
                    let guard = dd.abs() <= cfar.guard[0] as i64 && dr.abs() <= cfar.guard[1] as i64;
                    if !guard && (0..cols).contains(&(r + dr)) {
                        let p = map.at((d + dd).rem_euclid(rows) as usize, (r + dr) as usize);
                        cells.push(p);
                        let side = if cfar.train[1] == 0 { dd } else { dr };
                        if side < 0 {
                            before.push(p);
                        } else if side > 0 {
                            after.push(p);
                        }
                    }
                }
            }
            let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
            let (threshold, noise) = match cfar.kind {
                CfarKind::Ca => {
                    let mean = mean(&cells);
                    (cfar_ca::factor(looks, cells.len(), cfar.pfa).unwrap() * mean, mean)
                }
                CfarKind::Go | CfarKind::So => {
                    let f =
                        cfar_go_so::factor(cfar.kind, looks, [before.len(), after.len()], cfar.pfa).unwrap();
                    let means: Vec<f64> =
                        [before, after].iter().filter(|v| !v.is_empty()).map(|v| mean(v)).collect();
                    let statistic = match cfar.kind {
                        CfarKind::Go => means.iter().copied().fold(0.0, f64::max),
                        _ => means.iter().copied().fold(f64::INFINITY, f64::min),
                    };
                    (f.factor * statistic, statistic / f.expectation)
                }
                CfarKind::Os { rank } => {
                    cells.sort_by(f64::total_cmp);
                    let rank = ((rank * cells.len()) as f64 / full as f64).round().max(1.0) as usize;
                    let os = catseye::dsp::cfar_os::factor(looks, cells.len(), rank, cfar.pfa).unwrap();
                    (os.factor * cells[rank - 1], cells[rank - 1] / os.expectation)
                }
            };
            out.mask.push(map.at(d as usize, r as usize) > threshold);
            out.noise.push(noise);
            out.threshold.push(threshold);
        }
    }
    out
}

fn all_cells<T>(map: &PowerMap<T>) -> Vec<Cell> {
    let cols = map.range_bins as u32;
    (0..map.data.len() as u32).map(|at| Cell { doppler: at / cols, range: at % cols }).collect()
}

/// The cpu engine on every cell.
fn cpu_judged<T: Real>(map: &PowerMap<T>, cfar: &Cfar, looks: usize) -> Judged<T> {
    let found = cpu::detect(map, cfar, looks).unwrap();
    judged(found, cpu::noise(map, cfar, looks, &all_cells(map)).unwrap())
}

fn judged<T: Real>(found: Detection<T>, noise: Vec<T>) -> Judged<T> {
    let threshold = noise.iter().zip(found.ratio.iter().cycle()).map(|(n, r)| *n * *r).collect();
    Judged { mask: found.mask, noise, threshold }
}

fn window_cells(guard: [usize; 2], train: [usize; 2]) -> usize {
    let outer = (2 * (guard[0] + train[0]) + 1) * (2 * (guard[1] + train[1]) + 1);
    outer - (2 * guard[0] + 1) * (2 * guard[1] + 1)
}

fn noise_map(rows: usize, cols: usize, looks: usize, seed: u64) -> PowerMap<f64> {
    let mut random = Random(seed);
    let data = (0..rows * cols).map(|_| random.gamma(looks)).collect();
    PowerMap { doppler_bins: rows, range_bins: cols, data }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]
    #[test]
    fn cfar_is_its_definition(
        rows in 9usize..20, cols in 5usize..20, looks in 1usize..5,
        guard in [0usize..2, 0usize..2], train in [0usize..3, 1usize..4], share in 0.01..1.0f64,
        kind in 0..4u8, seed: u64,
    ) {
        let mut map = noise_map(rows, cols, looks, seed);
        map.data[cols + 3] = 1e15;
        let rank = (share * window_cells(guard, train) as f64).ceil() as usize;
        let kind = match kind {
            0 => CfarKind::Ca,
            1 => CfarKind::Go,
            2 => CfarKind::So,
            _ => CfarKind::Os { rank },
        };
        let cfar = Cfar { kind, guard, train, pfa: 0.05 };
        let got = cpu_judged(&map, &cfar, looks);
        let want = slow_cfar(&map, &cfar, looks);
        prop_assert_eq!(&got.mask, &want.mask);
        for i in 0..map.data.len() {
            let (a, b) = (got.noise[i], want.noise[i]);
            prop_assert!((a / b - 1.0).abs() < 1e-12, "cell {}: {} {}", i, a, b);
            prop_assert!((got.threshold[i] / want.threshold[i] - 1.0).abs() < 1e-12);
        }
    }

    /// Maps wide enough for the blocks of the counting loop, with many equal cells.
    #[test]
    fn counting_is_selection(
        rows in 5usize..9, cols in 36usize..140, guard in [0usize..2, 0usize..3], train in [0usize..2, 1usize..9],
        share in 0.01..1.0f64, seed: u64, coarse: bool,
    ) {
        let mut map = noise_map(rows, cols, 2, seed);
        if coarse {
            map.data.iter_mut().for_each(|p| *p = (*p * 4.0).floor());
        }
        let rank = (share * window_cells(guard, train) as f64).ceil() as usize;
        let cfar = Cfar { kind: CfarKind::Os { rank }, guard, train, pfa: 0.1 };
        let want = slow_cfar(&map, &cfar, 2);
        prop_assert_eq!(&cpu::detect(&map, &cfar, 2).unwrap().mask, &want.mask);
        // In f32 the products are rounded as those of the definition are.
        let map = f32_map(&map);
        let got = cpu::detect(&map, &cfar, 2).unwrap();
        let statistic = cpu::noise(&map, &cfar, 2, &all_cells(&map)).unwrap();
        let columns = catseye::dsp::cfar::columns(&cfar, 2, rows, cols).unwrap();
        for (i, p) in map.data.iter().enumerate() {
            let column = &columns[i % cols];
            let mut near: Vec<f32> = window(&map, &cfar, i);
            near.sort_by(f32::total_cmp);
            let kth = near[column.rank as usize - 1];
            prop_assert_eq!(got.mask[i], *p > column.factor as f32 * kth);
            prop_assert_eq!(statistic[i], column.scale as f32 * kth);
        }
    }
}

/// The training cells of cell `at`.
fn window(map: &PowerMap<f32>, cfar: &Cfar, at: usize) -> Vec<f32> {
    let (rows, cols) = (map.doppler_bins as i64, map.range_bins as i64);
    let (d, r) = (at as i64 / cols, at as i64 % cols);
    let [hd, hr] = [0, 1].map(|i| (cfar.guard[i] + cfar.train[i]) as i64);
    let [gd, gr] = cfar.guard.map(|g| g as i64);
    let mut out = vec![];
    for dd in -hd..=hd {
        for dr in -hr..=hr {
            if (dd.abs() > gd || dr.abs() > gr) && (0..cols).contains(&(r + dr)) {
                out.push(map.at((d + dd).rem_euclid(rows) as usize, (r + dr) as usize));
            }
        }
    }
    out
}

/// The central 99 % interval of a binomial count.
fn binomial_99(trials: u64, p: f64) -> (u64, u64) {
    use statrs::distribution::{Binomial, DiscreteCDF};
    let b = Binomial::new(p, trials).unwrap();
    (b.inverse_cdf(0.005), b.inverse_cdf(0.995))
}

/// Cells whose windows do not overlap are independent, so their count is binomial exactly. Of each
/// window's height one row is counted, in the first, the middle and the last column, so that the
/// edges stand for themselves. Counts on one fixed seed, each at 99 %: of 60, one outside is expected in
/// two of five seeds.
#[test]
fn false_alarm_rate() {
    const TRIALS: usize = 20_000;
    for (name, kind, guard, train) in [
        ("CA 1-D", CfarKind::Ca, [0, 2], [0, 8]),
        ("OS 1-D", CfarKind::Os { rank: 12 }, [0, 2], [0, 8]),
        ("CA 2-D", CfarKind::Ca, [1, 1], [2, 2]),
        ("OS 2-D", CfarKind::Os { rank: 30 }, [1, 1], [2, 2]),
        ("GO 1-D", CfarKind::Go, [0, 2], [0, 8]),
        ("SO 1-D", CfarKind::So, [0, 2], [0, 8]),
        ("GO 2-D", CfarKind::Go, [1, 1], [2, 2]),
        ("SO 2-D", CfarKind::So, [1, 1], [2, 2]),
        ("GO along Doppler", CfarKind::Go, [1, 0], [4, 0]),
        ("SO along Doppler", CfarKind::So, [1, 1], [4, 0]),
    ] {
        for looks in [1, 12] {
            let cfar = Cfar { kind, guard, train, pfa: 0.01 };
            let step = 2 * (guard[0] + train[0]) + 1;
            let cols = 2 * (guard[1] + train[1]) + 1;
            let map = noise_map(step * TRIALS, cols, looks, 42);
            let found = cpu_judged(&map, &cfar, looks);
            for column in [0, cols / 2, cols - 1] {
                let at = |i: usize| i * step * cols + column;
                let alarms = (0..TRIALS).filter(|i| found.mask[at(*i)]).count() as u64;
                let (low, high) = binomial_99(TRIALS as u64, 0.01);
                println!("{name}, {looks} looks, column {column}: {alarms} in {low}..={high}");
                assert!((low..=high).contains(&alarms), "{name}, {looks} looks, column {column}: {alarms}");
                // The noise estimate is unbiased: its mean is 1 within four standard errors.
                let n: Vec<f64> = (0..TRIALS).map(|i| found.noise[at(i)]).collect();
                let mean = n.iter().sum::<f64>() / TRIALS as f64;
                let variance = n.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / TRIALS as f64;
                let error = (variance / TRIALS as f64).sqrt();
                assert!((mean - 1.0).abs() < 4.0 * error, "{name}: {mean} +- {error}");
            }
        }
    }
}

/// A strong target leaves its own noise estimate what it was (the guard cells hold it).
#[test]
fn a_strong_target_does_not_raise_its_own_threshold() {
    let mut map = noise_map(64, 64, 4, 5);
    for p in &mut map.data {
        *p *= 1e-18;
    }
    let cfar = Cfar { kind: CfarKind::Ca, guard: [2, 2], train: [4, 4], pfa: 1e-4 };
    let at = 20 * 64 + 20;
    let cell = [Cell { doppler: 20, range: 20 }];
    let before = cpu::noise(&map, &cfar, 4, &cell).unwrap();
    map.data[at] = 1.0;
    assert!(cpu::detect(&map, &cfar, 4).unwrap().mask[at]);
    assert_eq!(cpu::noise(&map, &cfar, 4, &cell).unwrap(), before);
}

#[test]
fn peaks_are_local_maxima() {
    let map = noise_map(12, 9, 1, 99);
    let mask: Vec<bool> = map.data.iter().map(|p| *p > 0.7).collect();
    let got = cpu::peaks::peaks(&map, &mask);
    let mut want = vec![];
    for d in 0..12i64 {
        for r in 0..9i64 {
            let here = map.at(d as usize, r as usize);
            let mut best = f64::NEG_INFINITY;
            for dd in -1..=1i64 {
                for dr in -1..=1i64 {
                    if (dd, dr) != (0, 0) && (0..9).contains(&(r + dr)) {
                        best = best.max(map.at((d + dd).rem_euclid(12) as usize, (r + dr) as usize));
                    }
                }
            }
            if here > best && here > 0.7 {
                want.push((here, Cell { doppler: d as u32, range: r as u32 }));
            }
        }
    }
    want.sort_by(|a, b| b.0.total_cmp(&a.0));
    assert!(want.len() > 5);
    assert_eq!(got, want.iter().map(|w| w.1).collect::<Vec<_>>());
    // A plateau has one peak, its first cell.
    let flat = PowerMap { doppler_bins: 3, range_bins: 3, data: vec![1.0f32; 9] };
    assert_eq!(cpu::peaks::peaks(&flat, &[true; 9]), [Cell { doppler: 0, range: 0 }]);
}

#[test]
fn wrong_input_is_refused() {
    let radar = radar(32, 32, Sampling::Iq);
    let cube = Cube::<f32>::zeros(32, 11, 32);
    assert_eq!(cpu::process(&cube, &radar).unwrap_err().exit_code(), 2);
    let mut cube = Cube::<f32>::zeros(32, 12, 32);
    cube.data[5].re = f32::NAN;
    assert!(cpu::process(&cube, &radar).unwrap_err().to_string().contains("not a finite power"));
    let mut short = radar.clone();
    short.processing.doppler_fft = 16;
    assert_eq!(cpu::process(&cube, &short).unwrap_err().exit_code(), 2);
    let mut wide = radar.clone();
    wide.processing.azimuth_fov_rad = 2.0;
    assert!(Beamformer::new(&wide).is_err());
    wide.processing.azimuth_bins = 0;
    assert!(Beamformer::new(&wide).is_err());
}

#[test]
fn an_axis_without_aperture_has_one_bin() {
    let mut radar = radar(32, 32, Sampling::Iq);
    (radar.processing.elevation_bins, radar.processing.elevation_fov_rad) = (9, 0.2);
    assert_eq!(Beamformer::new(&radar).unwrap().grid.len(), 64 * 9);
    // Without the third transmitter all stand in one row.
    radar.tx.truncate(2);
    let grid = Beamformer::new(&radar).unwrap().grid;
    assert_eq!((grid.azimuth_rad.len(), grid.elevation_rad), (64, vec![0.0]));
    radar.tx.truncate(1);
    radar.rx.truncate(1);
    assert_eq!(Beamformer::new(&radar).unwrap().grid.azimuth_rad, [0.0]);
    // A transmitter above another: elevation alone.
    radar.tx.push(radar.tx[0].clone());
    radar.tx[1].position_m.z += 0.5 * radar.wavelength_m();
    let grid = Beamformer::new(&radar).unwrap().grid;
    assert_eq!((grid.azimuth_rad, grid.elevation_rad.len()), (vec![0.0], 9));
}

/// The picture of the threshold is the one that the detector compared with, for every kind and with bands.
#[test]
fn the_threshold_is_what_was_detected_by() {
    let (guard, train) = ([2, 1], [8, 4]);
    for kind in [CfarKind::Ca, CfarKind::Go, CfarKind::So, CfarKind::Os { rank: 100 }] {
        for multiplex in [Multiplex::Tdm, Multiplex::Ddm { bands: 4 }] {
            let mut radar = Radar { multiplex, ..radar(128, 32, Sampling::Iq) };
            radar.processing.cfar = Cfar { kind, guard, train, pfa: 1e-2 };
            let mut cube = Cube::<f64>::zeros(radar.rows(), radar.channels(), radar.samples);
            let mut random = Random(5);
            cube.data.iter_mut().for_each(|z| *z = random.normal());
            let (_, found) = cpu::process(&cube, &radar).unwrap();
            let level = cpu::threshold(&found.map, &radar.processing.cfar, found.snapshots.channels).unwrap();
            let above: Vec<bool> = found.map.data.iter().zip(&level).map(|(p, t)| p > t).collect();
            assert!(above.contains(&true) && above.contains(&false));
            assert_eq!(above, found.detection.mask, "{kind:?} {multiplex:?}");
        }
    }
}

#[test]
fn a_silent_cube_has_no_detections() {
    let radar = radar(32, 32, Sampling::Iq);
    let (_, found) = cpu::process(&Cube::<f64>::zeros(32, 12, 32), &radar).unwrap();
    assert!(found.cells.is_empty() && found.snapshots.data.is_empty());
}

// ---- GPU ----

fn ca(guard: [usize; 2], train: [usize; 2], pfa: f64) -> Cfar {
    Cfar { kind: CfarKind::Ca, guard, train, pfa }
}

/// Noise and two targets 50 dB over it.
fn scene(radar: &Radar) -> Cube<f64> {
    let mut cube = noise_cube(radar, 21);
    let (m, n) = (radar.processing.doppler_fft as f64, radar.range_bins() as f64);
    for (row, range, azimuth) in [(0.3, 0.4, 0.3), (0.7, 0.8, -0.2)] {
        let target = Target {
            cell: (range * n, row * m),
            azimuth,
            elevation: 0.0,
            amplitude: Complex64::new(9.0, 3.0),
        };
        add_target(&mut cube, radar, target);
    }
    // What the GPU gets, so that only its own rounding counts.
    cube.to_f32().to_f64()
}

fn parts(z: &[Complex32]) -> &[f32] {
    bytemuck::cast_slice(z)
}

fn parts_f64(z: &[Complex64]) -> &[f64] {
    bytemuck::cast_slice(z)
}

#[test]
fn gpu_chain_agrees_with_the_cpu() {
    for (chirps, samples, sampling, os) in [
        (64, 128, Sampling::Iq, true),
        (40, 100, Sampling::Real, true),
        (32, 512, Sampling::Iq, false),
        (200, 30, Sampling::Iq, false),
    ] {
        let name = format!("{chirps} x {samples} {sampling:?}");
        let mut radar = radar(chirps, samples, sampling);
        radar.processing.cfar.pfa = 1e-3;
        if !os {
            radar.processing.cfar.kind = CfarKind::Ca;
        }
        let cube = scene(&radar);
        let (spectrum, _) = cpu::process(&cube, &radar).unwrap();
        let map = cpu::power::power(&spectrum);
        let (on_device, got) = device::process(test_gpu(), &cube.to_f32(), &radar).unwrap();
        let read = on_device.read(test_gpu()).unwrap();
        let d = check_close(parts(&read.data), parts_f64(&spectrum.data), fft::KERNEL.tolerance.relative_l2)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        println!("{name}: spectrum {:.2e}", d.relative_l2);
        let d = check_close(&got.map.data, &map.data, power::KERNEL.tolerance.relative_l2)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        println!("{name}: map {:.2e}", d.relative_l2);
        // The detector, the list and the snapshots on the GPU's own map and spectrum, to the bit.
        let cfar = &radar.processing.cfar;
        let want = cpu_judged(&got.map, cfar, 12);
        assert_eq!(got.detection.ratio, cpu::detect(&got.map, cfar, 12).unwrap().ratio);
        compare_masks(&name, &got.map, &got.detection.mask, &want, os);
        let noise = cpu::noise(&got.map, cfar, 12, &got.cells).unwrap();
        compare_noise(&name, &got.noise, &noise, os);
        assert!(got.cells.len() >= 2, "{name}");
        assert_eq!(got.cells, cpu::peaks::peaks(&got.map, &got.detection.mask), "{name}");
        assert_eq!(got.snapshots, cpu::snapshot::snapshots(&read, &got.cells), "{name}");
    }
}

/// OS: the same to the bit. Else the same but for cells whose power is as close to the threshold as the
/// rounding of the sums.
fn compare_masks(name: &str, map: &PowerMap<f32>, got: &[bool], want: &Judged<f32>, os: bool) {
    assert_eq!(got.len(), map.data.len(), "{name}");
    let bound = if os { 0.0 } else { cfar_ca::KERNEL.tolerance.relative_l2 };
    for (i, p) in map.data.iter().enumerate() {
        if got[i] != want.mask[i] {
            let margin = f64::from((p - want.threshold[i]) / want.threshold[i]).abs();
            assert!(margin < 2.0 * bound, "{name}: cell {i} is {margin:e} from its threshold");
        }
    }
}

/// Cell by cell, since one strong cell would rule a sum.
fn compare_noise(name: &str, got: &[f32], want: &[f32], os: bool) {
    assert_eq!(got.len(), want.len(), "{name}");
    let bound = if os { 0.0 } else { cfar_noise::KERNEL.tolerance.relative_l2 };
    for (i, (a, b)) in got.iter().zip(want).enumerate() {
        let apart = if a == b { 0.0 } else { f64::from((a - b) / b).abs() };
        assert!(apart <= bound, "{name}: cell {i}: {a} {b}");
    }
}

fn f32_map(map: &PowerMap<f64>) -> PowerMap<f32> {
    PowerMap {
        doppler_bins: map.doppler_bins,
        range_bins: map.range_bins,
        data: map.data.iter().map(|p| *p as f32).collect(),
    }
}

#[test]
fn gpu_detectors_agree_with_the_cpu() {
    for (rows, cols, guard, train, rank) in [
        (37, 53, [2, 1], [8, 4], 162),
        (16, 16, [0, 2], [0, 8], 12),
        (64, 7, [3, 0], [6, 0], 1),
        (9, 40, [0, 0], [1, 1], 8),
        (33, 5, [1, 2], [2, 9], 90),
        (140, 60, [4, 1], [50, 3], 600),
    ] {
        let mut map = noise_map(rows, cols, 2, 77);
        // Strong, equal and zero cells.
        map.data[rows * cols / 2] = 1e12;
        for i in 0..cols.min(9) {
            map.data[i] = 0.0;
            map.data[3 * cols + i % cols] = 1.0;
        }
        let map = f32_map(&map);
        for kind in [CfarKind::Os { rank }, CfarKind::Ca, CfarKind::Go, CfarKind::So] {
            let cfar = Cfar { kind, guard, train, pfa: 0.02 };
            let name = format!("{rows} x {cols} {kind:?}");
            let got = device::detect(test_gpu(), &map, &cfar, 2).unwrap();
            let want = cpu_judged(&map, &cfar, 2);
            let os = kind == CfarKind::Os { rank };
            compare_masks(&name, &map, &got.mask, &want, os);
            let noise = device::noise(test_gpu(), &map, &cfar, 2, &all_cells(&map)).unwrap();
            compare_noise(&name, &noise, &want.noise, os);
            assert!(want.mask.iter().any(|m| *m), "{name}");
        }
    }
}

/// The spectrum on the device by a method, and the same by the cpu engine in f64, of noise rounded to f32.
fn spectra(
    t: &transform::Transform,
    sampling: Sampling,
    method: fft::Method,
    seed: u64,
) -> (Vec<Complex32>, Vec<Complex64>) {
    let mut random = Random(seed);
    let mut cube = Cube::<f32>::zeros(t.chirps, t.channels, t.samples);
    for z in &mut cube.data {
        let x = random.normal();
        *z = Complex32::new(x.re as f32, if sampling == Sampling::Real { 0.0 } else { x.im as f32 });
    }
    let want = cpu::fft::spectrum(&cube.to_f64(), t).data;
    let mut recorder = test_gpu().recorder("spectra");
    let got = spectrum::record_by(&mut recorder, test_gpu(), &cube, t, Some(method)).unwrap();
    recorder.submit().unwrap();
    (got.read(test_gpu()).unwrap().data, want)
}

fn processing(range_fft: usize, doppler_fft: usize) -> Processing {
    let p = radar(1, 1, Sampling::Iq).processing;
    Processing { range_fft, doppler_fft, range_window: Window::Hann, doppler_window: Window::Hamming, ..p }
}

#[test]
fn every_gpu_length_agrees_with_the_cpu() {
    use fft::Method::{Passes, Workgroup};
    let mut worst = 0.0f64;
    let powers = (0..=12).flat_map(|l| [(1 << l, Workgroup), (1 << l, Passes)]);
    // 2^13 and 2^14; every small radix; primes and other products for Bluestein.
    let others = [
        16384, 8192, 3, 5, 6, 7, 11, 12, 15, 17, 20, 24, 30, 31, 36, 37, 40, 48, 60, 96, 97, 100, 105, 111,
        120, 127, 144, 211, 240, 360, 499, 600, 720, 1000, 1009, 1500, 1536, 2401, 3000, 6000, 6859, 10007,
        12000, 16383,
    ];
    for (n, method) in powers.chain(others.map(|n| (n, Passes))) {
        for axis in 0..2 {
            // Some of the lengths with padding, too.
            let count = if n % 3 == 0 { n - n / 3 } else { n };
            let (chirps, samples) = if axis == 0 { (3, count) } else { (count, 2) };
            let p = if axis == 0 { processing(n, 4) } else { processing(2, n) };
            let t = transform::Transform::new(chirps, 2, samples, Sampling::Iq, &p).unwrap();
            let (got, want) = spectra(&t, Sampling::Iq, method, 1 + n as u64);
            let d = check_close(parts(&got), parts_f64(&want), fft::KERNEL.tolerance.relative_l2)
                .unwrap_or_else(|e| panic!("{n} {method:?} axis {axis}: {e}"));
            worst = worst.max(d.relative_l2);
        }
    }
    println!("worst {worst:.2e}");
}

/// Real samples, and samples in falling order, on both engines and against the sum of eq. 14.
#[test]
fn real_and_reversed_samples() {
    for (sampling, reversed, chirps, samples, range_fft, doppler_fft) in [
        (Sampling::Real, false, 7, 30, 40, 8),
        (Sampling::Real, true, 5, 33, 37, 5),
        (Sampling::Iq, true, 6, 20, 32, 12),
        (Sampling::Real, false, 1, 16, 16, 1),
    ] {
        let p = processing(range_fft, doppler_fft);
        let mut t = transform::Transform::new(chirps, 3, samples, sampling, &p).unwrap();
        t.reversed = reversed;
        let mut cube = Cube::<f64>::zeros(chirps, 3, samples);
        let mut random = Random(5);
        for z in &mut cube.data {
            *z = random.normal();
            if sampling == Sampling::Real {
                z.im = 0.0;
            }
        }
        let cube = cube.to_f32().to_f64();
        let got = cpu::fft::spectrum(&cube, &t);
        let mut want = vec![];
        for row in 0..doppler_fft {
            for c in 0..3 {
                for r in 0..t.range_bins {
                    let mut sum = Complex64::default();
                    for m in 0..chirps {
                        for n in 0..samples {
                            let x = cube.row(m, c)[if reversed { samples - 1 - n } else { n }];
                            let d = row as f64 - (doppler_fft / 2) as f64;
                            let turns = (r * n) as f64 / range_fft as f64 + d * m as f64 / doppler_fft as f64;
                            sum += x * t.range_window[n] * t.doppler_window[m] * Complex64::cis(-TAU * turns);
                        }
                    }
                    want.push(sum);
                }
            }
        }
        assert!(relative_l2(&got.data, &want) < 1e-14, "{sampling:?} {reversed}");
        let mut recorder = test_gpu().recorder("real");
        let device = spectrum::record(&mut recorder, test_gpu(), &cube.to_f32(), &t).unwrap();
        recorder.submit().unwrap();
        let device = device.read(test_gpu()).unwrap();
        check_close(parts(&device.data), parts_f64(&want), fft::KERNEL.tolerance.relative_l2).unwrap();
    }
}

/// Blocks of channels give what the whole cube gives, to the bit, on both engines.
#[test]
fn streaming_changes_no_bit() {
    for sampling in [Sampling::Iq, Sampling::Real] {
        let mut radar = radar(60, 100, sampling);
        radar.processing.cfar.pfa = 1e-2;
        let (cube, cfar) = (scene(&radar).to_f32(), radar.processing.cfar);
        let t = transform::Transform::of_cube(&cube, &radar).unwrap();
        let (_, want) = cpu::process(&cube, &radar).unwrap();
        assert!(want.cells.len() > 2);
        for budget in [0, 500_000, 1 << 30] {
            let mut asked = vec![];
            let mut read = stream::from_cube(&cube);
            let mut source = |c: std::ops::Range<usize>, out: &mut [Complex32]| {
                asked.push(c.clone());
                read(c, out)
            };
            let got = cpu::stream::process(&t, &cfar, budget, &mut source).unwrap();
            assert!(got == want, "{sampling:?} {budget}");
            assert_eq!(asked.len() == 1, budget > 1 << 20, "{asked:?}");
        }
        let (_, want) = device::process(test_gpu(), &cube, &radar).unwrap();
        for limit in [1 << 27, 200 << 10] {
            let gpu = opened_for_tests();
            let gpu = gpu.with_poisoned_buffers().with_binding_limit(limit);
            let got = stream::process(&gpu, &t, &cfar, &mut stream::from_cube(&cube)).unwrap();
            assert!(got == want, "{sampling:?} {limit}");
        }
        let mut broken = |_: std::ops::Range<usize>, _: &mut [Complex32]| {
            Err(catseye::base::error::Error::Failed("the file ends".into()))
        };
        assert!(cpu::stream::process(&t, &cfar, 0, &mut broken).unwrap_err().to_string().contains("ends"));
        assert!(
            stream::process(test_gpu(), &t, &cfar, &mut broken).unwrap_err().to_string().contains("ends")
        );
    }
}

/// Eq. 88 on both engines: what rests is gone, what moves by whole cycles a frame stays.
#[test]
fn the_mean_over_chirps_is_removed() {
    let (chirps, channels, samples) = (48, 3, 37);
    let columns = channels * samples;
    let (mut moving, mut cube) =
        (Cube::<f64>::zeros(chirps, channels, samples), Cube::zeros(chirps, channels, samples));
    let mut random = Random(2);
    let rest: Vec<Complex64> = (0..columns).map(|_| random.normal() * 50.0).collect();
    for m in 0..chirps {
        for (i, rest) in rest.iter().enumerate() {
            let z = Complex64::cis(TAU * (7 * m) as f64 / chirps as f64 + i as f64);
            moving.data[m * columns + i] = z;
            cube.data[m * columns + i] = z + rest;
        }
    }
    let cube = cube.to_f32();
    let mut on_device = test_gpu().recorder("zero Doppler");
    let pieces = [0..20, 20..48]
        .into_iter()
        .map(|m: std::ops::Range<usize>| {
            let part: Vec<[f32; 2]> =
                cube.data[m.start * columns..m.end * columns].iter().map(|z| [z.re, z.im]).collect();
            CubePiece { first_chirp: m.start, chirps: m.len(), data: on_device.upload("piece", &part) }
        })
        .collect();
    let on = DeviceCube { chirps, channels, samples, pieces };
    let rest = zero_doppler::AtRest::turning(chirps, 1, 1);
    zero_doppler::record(&mut on_device, &on, &rest);
    let pending = on.read(&mut on_device);
    let got = on.take(&mut on_device.submit().unwrap(), pending);
    let bound = zero_doppler::KERNEL.tolerance.relative_l2;
    let scale = relative_l2(&wide(&cube.data), &vec![Complex64::default(); cube.data.len()]);
    assert!(scale.is_infinite());
    let norm = |z: &[Complex64]| z.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
    let apart = |got: &[Complex32]| {
        let d: Vec<_> = wide(got).iter().zip(&moving.data).map(|(a, b)| a - b).collect();
        norm(&d) / norm(&wide(&cube.data))
    };
    let mut on_cpu = cube.clone();
    cpu::zero_doppler::remove(&mut on_cpu.data, columns, &rest);
    println!("zero Doppler: gpu {:.2e}, cpu f32 {:.2e}", apart(&got.data), apart(&on_cpu.data));
    assert!(apart(&got.data) < bound && apart(&on_cpu.data) < bound && apart(&cube.data) > 0.9);
    let mut exact = cube.to_f64();
    cpu::zero_doppler::remove(&mut exact.data, columns, &rest);
    assert!(relative_l2(&exact.data, &moving.data) < 5e-6);
}

/// A target that moves over six range cells, from the exact phase of eq. 12 at a delay that grows from chirp
/// to chirp: without the transform its energy is spread, with it the target stands as one at rest does.
#[test]
fn keystone_focuses_a_migrating_target() {
    for (sampling, fold) in [(Sampling::Iq, 0), (Sampling::Real, 0), (Sampling::Iq, 1)] {
        let mut radar = radar(256, 128, sampling);
        radar.tx.truncate(1);
        radar.rx.truncate(2);
        radar.waveform = Waveform::chirp(4e9, 20e-6, radar.chirp_period_s());
        radar.sample_rate_hz = 128.0 / 20e-6;
        radar.processing.doppler_window = Window::Hann;
        radar.processing.doppler_fft = 300;
        let cell = radar.range_bin_m();
        let frame = radar.frame_time_s();
        let ambiguous = 2.0 * radar.max_velocity_mps();
        // Six cells a frame; in the folded case the same and whole turns more.
        let mut v = 6.0 * cell / frame;
        if fold == 0 {
            // Below the ambiguity the frame has to be long for that.
            radar.waveform = Waveform::chirp(4e9, 20e-6, radar.wavelength_m() / 4.0 / (v * 1.3));
            v = 6.0 * cell / radar.frame_time_s();
            v = v.min(0.9 * radar.max_velocity_mps());
        } else {
            v = (v / ambiguous).round().max(1.0) * ambiguous + 0.2 * ambiguous;
        }
        let migration = v * radar.frame_time_s() / cell;
        let turns = (v / (2.0 * radar.max_velocity_mps())).round() as i32;
        let cube_of = |v: f64| {
            let mut cube = Cube::<f64>::zeros(256, 2, 128);
            for m in 0..256 {
                let t = (m as f64 - 127.5) * radar.loop_period_s();
                let tau = 2.0 * (40.4 * cell + v * t) / catseye::base::units::C0;
                for c in 0..2 {
                    for n in 0..128 {
                        let f = radar.start_hz() + radar.slope_hz_per_s() * n as f64 / radar.sample_rate_hz;
                        let z = Complex64::cis(TAU * f * tau + c as f64);
                        cube.data[(m * 2 + c) * 128 + n] = match sampling {
                            Sampling::Iq => z,
                            Sampling::Real => Complex64::new(2f64.sqrt() * z.re, 0.0),
                        };
                    }
                }
            }
            cube
        };
        let (still, moving) = (cube_of(0.0), cube_of(v));
        let t = transform::Transform::of_cube(&still, &radar).unwrap();
        let scale = transform::line_scale(&radar);
        let peak = |s: &catseye::dsp::Spectrum<f64>| {
            let map = cpu::power::power(s);
            let at = (0..map.data.len()).max_by(|a, b| map.data[*a].total_cmp(&map.data[*b])).unwrap();
            (at / map.range_bins, at % map.range_bins, 10.0 * map.data[at].log10())
        };
        // Place the still target in the same fraction of a Doppler cell: its level is a bound otherwise.
        let reference = peak(&cpu::fft::spectrum(&still, &t));
        let plain = peak(&cpu::fft::spectrum(&moving, &t));
        let focused = cpu::keystone::spectrum(&moving, &t, &scale, turns).unwrap();
        let map = cpu::power::power(&focused);
        let found = peak(&focused);
        let cell_at = Cell { doppler: found.0 as u32, range: found.1 as u32 };
        let w = |window, n| catseye::dsp::window::coefficients(window, n).unwrap();
        let doppler = peaks::Interpolator::new(&w(Window::Hann, 256), 300).unwrap();
        let at = |d: usize| map.at(d % 300, found.1);
        let (offset, height) = doppler.peak(at(found.0 + 299), at(found.0), at(found.0 + 1));
        let level = 10.0 * height.log10();
        println!(
            "{sampling:?} fold {turns}: {migration:.1} cells, plain {:.2} dB, keystone {level:.3} dB at {cell_at:?}, still {:.3} dB",
            plain.2, reference.2
        );
        assert!(migration > 5.5 && plain.2 < reference.2 - 3.0);
        assert!((level - reference.2).abs() < 0.1 && found.1 == reference.1);
        let rate = (found.0 as f64 + offset - 150.0) * radar.velocity_bin_mps()
            + f64::from(turns) * 2.0 * radar.max_velocity_mps();
        assert!((rate - v).abs() < 0.02 * radar.velocity_bin_mps(), "{rate} {v}");
        if fold == 1 {
            assert!(turns >= 1);
        }
        // A scale of one is the plain transform.
        let one = cpu::keystone::spectrum(&moving, &t, &vec![1.0; 128], 0).unwrap();
        assert!(relative_l2(&one.data, &cpu::fft::spectrum(&moving, &t).data) < 1e-12);
        let single = cpu::keystone::spectrum(&moving.to_f32(), &t, &scale, turns).unwrap();
        assert!(relative_l2(&wide(&single.data), &focused.data) < 2e-6);
        assert!(cpu::keystone::spectrum(&moving, &t, &scale[1..], 0).is_err());
        let t = transform::Transform { keystone: Some(transform::Keystone { scale, fold: turns }), ..t };
        let mut recorder = test_gpu().recorder("keystone");
        let on_device = spectrum::record(&mut recorder, test_gpu(), &moving.to_f32(), &t).unwrap();
        recorder.submit().unwrap();
        let got = on_device.read(test_gpu()).unwrap();
        let single =
            cpu::keystone::spectrum(&moving.to_f32().to_f64(), &t, &transform::line_scale(&radar), turns);
        let bound = keystone::KERNEL.tolerance.relative_l2;
        let d = check_close(parts(&got.data), parts_f64(&single.unwrap().data), bound).unwrap();
        println!("gpu {:.2e}", d.relative_l2);
    }
}

/// Maps of four groups of chirps keep the false-alarm rate with their looks added.
#[test]
fn integrated_maps_keep_their_false_alarms() {
    let maps: Vec<_> = (0..4).map(|i| noise_map(5 * 20_000, 5, 3, 60 + i)).collect();
    let (map, looks) = integrate::integrate(&maps.iter().map(|m| (m, 3)).collect::<Vec<_>>()).unwrap();
    assert_eq!(looks, 12);
    let cfar = Cfar { kind: CfarKind::Go, guard: [0, 0], train: [2, 2], pfa: 0.01 };
    let found = cpu::detect(&map, &cfar, looks).unwrap();
    let alarms = (0..20_000).filter(|i| found.mask[i * 25 + 2]).count() as u64;
    let (low, high) = binomial_99(20_000, 0.01);
    assert!((low..=high).contains(&alarms), "{alarms} in {low}..={high}");
    let wrong = cpu::detect(&map, &cfar, 3).unwrap();
    assert!(((0..20_000).filter(|i| wrong.mask[i * 25 + 2]).count() as u64) < low);
    let small = noise_map(4, 4, 1, 1);
    assert!(integrate::integrate(&[(&maps[0], 3), (&small, 3)]).is_err());
    assert!(integrate::integrate::<f64>(&[]).is_err());
    let cube = noise_cube(&radar(10, 8, Sampling::Iq), 3);
    let groups = integrate::chirp_groups(&cube, 3).unwrap();
    assert!(groups.len() == 3 && groups[2].chirps == 3 && groups[2].row(0, 5) == cube.row(6, 5));
    assert!(integrate::chirp_groups(&cube, 11).is_err());
}

/// A cube in pieces on the device goes through one submission, whatever the chunks.
#[test]
fn cubes_on_the_device() {
    let mut radar = radar(60, 100, Sampling::Iq);
    radar.processing.cfar.pfa = 1e-2;
    let cube = scene(&radar).to_f32();
    let (_, want) = device::process(test_gpu(), &cube, &radar).unwrap();
    let t = transform::Transform::of_cube(&cube, &radar).unwrap();
    for limit in [1 << 27, 300 << 10, (32 << 10) + 100] {
        let gpu = opened_for_tests();
        let gpu = gpu.with_poisoned_buffers().with_binding_limit(limit);
        let mut recorder = gpu.recorder("cube on the device");
        let most = (limit as usize / (8 * 12 * 100)).min(25);
        let pieces = (0..60)
            .step_by(most)
            .map(|first| {
                let chirps = most.min(60 - first);
                let part: Vec<[f32; 2]> =
                    cube.data[first * 1200..(first + chirps) * 1200].iter().map(|z| [z.re, z.im]).collect();
                CubePiece { first_chirp: first, chirps, data: recorder.upload("piece", &part) }
            })
            .collect();
        let on_device = DeviceCube { chirps: 60, channels: 12, samples: 100, pieces };
        let recorded = device::record(&mut recorder, &gpu, &on_device, &t, &radar.processing.cfar).unwrap();
        assert_eq!(recorded.take(&gpu, &mut recorder.submit().unwrap()).unwrap().1, want, "{limit}");
    }
}

#[test]
fn chunks_change_no_bit() {
    for sampling in [Sampling::Iq, Sampling::Real] {
        let mut radar = radar(60, 100, sampling);
        radar.processing.cfar.pfa = 1e-2;
        let cube = scene(&radar).to_f32();
        let (whole, want) = device::process(test_gpu(), &cube, &radar).unwrap();
        assert_eq!(whole.chunks(), 1);
        let whole = whole.read(test_gpu()).unwrap();
        // The map of 64 x 128 takes 32 KiB; all channels together 1.5 times 512 KiB.
        for (limit, least) in [(300 << 10, 2), (64 << 10, 6), ((32 << 10) + 100, 12)] {
            let gpu = opened_for_tests();
            let gpu = gpu.with_poisoned_buffers().with_binding_limit(limit);
            let (chunks, got) = device::process(&gpu, &cube, &radar).unwrap();
            println!("{sampling:?} {limit}: {} chunks", chunks.chunks());
            assert!(chunks.chunks() >= least, "{limit}: {}", chunks.chunks());
            assert_eq!(chunks.read(&gpu).unwrap(), whole, "{limit}");
            assert_eq!(got, want, "{limit}");
        }
    }
}

#[test]
fn more_cells_than_expected_are_all_found() {
    let mut radar = radar(256, 256, Sampling::Iq);
    radar.rx.truncate(1);
    radar.processing.range_window = Window::Rectangle;
    radar.processing.doppler_window = Window::Rectangle;
    radar.processing.cfar = ca([0, 0], [0, 8], 0.5);
    let cube = noise_cube(&radar, 4).to_f32();
    let (spectrum, got) = device::process(test_gpu(), &cube, &radar).unwrap();
    assert!(got.cells.len() > 4096, "{}", got.cells.len());
    assert_eq!(got.cells, cpu::peaks::peaks(&got.map, &got.detection.mask));
    assert_eq!(got.snapshots, cpu::snapshot::snapshots(&spectrum.read(test_gpu()).unwrap(), &got.cells));
}

#[test]
fn gpu_beamformer_agrees_with_the_cpu() {
    let mut radar = radar(64, 64, Sampling::Iq);
    radar.processing.elevation_bins = 5;
    radar.processing.elevation_fov_rad = 0.4;
    radar.processing.angle_window = Window::Hamming;
    let beam = Beamformer::new(&radar).unwrap();
    let mut random = Random(8);
    let data: Vec<Complex32> =
        (0..12 * 100).map(|_| random.normal()).map(|z| Complex32::new(z.re as f32, z.im as f32)).collect();
    let v: Vec<f64> = (0..100).map(|i| -10.0 + 0.21 * f64::from(i)).collect();
    let want = cpu::doa_beamform::spectra(&beam, &Snapshots { channels: 12, data: wide(&data) }, &v);
    let snapshots = Snapshots { channels: 12, data };
    let got = doa_beamform::spectra(test_gpu(), &beam, &snapshots, &v).unwrap();
    let d = check_close(&got, &want, doa_beamform::KERNEL.tolerance.relative_l2).unwrap();
    println!("beamformer {:.2e}", d.relative_l2);
    // Chunks of cells change no bit; the steering matrix takes 30 KiB.
    let gpu = opened_for_tests().with_poisoned_buffers();
    let chunked = doa_beamform::spectra(&gpu.with_binding_limit(32 << 10), &beam, &snapshots, &v).unwrap();
    assert_eq!(chunked, got);
    let none = Snapshots { channels: 12, data: vec![] };
    assert!(doa_beamform::spectra(test_gpu(), &beam, &none, &[]).unwrap().is_empty());
}

#[test]
fn gpu_refuses_what_it_cannot_do() {
    let cube = Cube::<f32>::zeros(32, 12, 32);
    for (n, name) in [(8192, "8192"), (48, "48")] {
        let t = transform::Transform::new(32, 12, 32, Sampling::Iq, &processing(n, 32)).unwrap();
        let mut recorder = test_gpu().recorder("refused");
        let method = Some(fft::Method::Workgroup);
        let error = spectrum::record_by(&mut recorder, test_gpu(), &cube, &t, method).err().unwrap();
        assert!(error.exit_code() == 2 && error.to_string().contains(name), "{error}");
    }
    let mut wide = radar(128, 32, Sampling::Iq);
    wide.processing.cfar = Cfar { kind: CfarKind::Os { rank: 1 }, guard: [0, 0], train: [60, 12], pfa: 1e-3 };
    let error = device::process(test_gpu(), &Cube::zeros(128, 12, 32), &wide).err().unwrap();
    assert!(error.exit_code() == 2 && error.to_string().contains("121 x 25 cells"), "{error}");
    let mut nan = Cube::<f32>::zeros(32, 12, 32);
    nan.data[77].im = f32::NAN;
    let error = device::process(test_gpu(), &nan, &radar(32, 32, Sampling::Iq)).err().unwrap();
    assert!(error.to_string().contains("not a finite power"), "{error}");
}
