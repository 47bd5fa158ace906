//! Standard deviations of points against what the chain makes of targets in noise.

use catseye::adc::Cube;
use catseye::adc::cpu::synthesis::synthesise;
use catseye::adc::noise::Noise;
use catseye::adc::synthesis::{Plan, point_echo};
use catseye::base::control::Control;
use catseye::base::frames::{Pose, direction_from_angles};
use catseye::base::rng::philox4x32_10;
use catseye::base::units::{C0, power_from_db, wavenumber};
use catseye::detect::ambiguity::SlotFolds;
use catseye::detect::points::peaks;
use catseye::detect::{Point, locate};
use catseye::dsp::RangeDoppler;
use catseye::dsp::doa_beamform::Grid;
use catseye::engine::{Engine, Precision};
use catseye::scene::radar::*;
use catseye::trace::Echoes;
use glam::DVec3;
use num_complex::Complex64;

fn antenna(y: f64, z: f64) -> Antenna {
    Antenna {
        position_m: DVec3::new(0.0, y, z),
        polarisation: Polarisation { v: Complex64::ONE, h: Complex64::ZERO },
        gain_dbi: 0.0,
        pattern: Pattern::Isotropic,
    }
}

/// 3 × 4 channels: eight in a row and four a wavelength above, their middle in the sensor's origin, from
/// which angles count. The whole ramp is sampled.
fn radar(window: Window, sampling: Sampling) -> Radar {
    let half = 0.5 * C0 / 77e9;
    Radar {
        name: "test".into(),
        carrier_hz: 77e9,
        waveform: catseye::scene::waveform::Waveform::chirp(200e6, 10e-6, 20e-6),
        multiplex: catseye::scene::waveform::Multiplex::Tdm,
        adc_start_s: 0.0,
        sample_rate_hz: 6.4e6,
        samples: 64,
        chirps: 32,
        sampling,
        tx: [(-2.0, -2.0), (2.0, -2.0), (0.0, 4.0)].map(|(y, z)| antenna(y * half, z / 3.0 * half)).to_vec(),
        rx: (0..4).map(|i| antenna((f64::from(i) - 1.5) * half, 0.0)).collect(),
        tx_power_dbm: 12.0,
        noise_figure_db: 12.0,
        thermal_noise: true,
        front_end: Default::default(),
        mounting: Pose::IDENTITY,
        motion: None,
        processing: Processing {
            range_window: window,
            doppler_window: window,
            angle_window: window,
            range_fft: 64,
            doppler_fft: 32,
            azimuth_bins: 49,
            azimuth_fov_rad: 60f64.to_radians(),
            elevation_bins: 17,
            elevation_fov_rad: 25f64.to_radians(),
            angle: AngleSettings::default(),
            remove_static: false,
            keystone: false,
            migration_max_mps: 0.0,
            group: [0; 2],
            cfar: Cfar { kind: CfarKind::Ca, guard: [3, 3], train: [5, 6], pfa: 1e-6 },
            max_points: 1,
        },
    }
}

/// The map, its detections and snapshots of one target in noise, and the echo itself.
fn chain(radar: &Radar, target: [f64; 4], dbsm: f64, seed: u64) -> (RangeDoppler<f64>, Echoes) {
    let [range, rate, azimuth, elevation] = target;
    let u = direction_from_angles(azimuth, elevation);
    let echoes =
        Echoes { list: vec![point_echo(u * range, u * rate, power_from_db(dbsm), 1)], ..Default::default() };
    let mut cube: Cube<f64> = synthesise(&Plan::new(radar, &echoes).unwrap(), Control::default()).unwrap();
    catseye::adc::cpu::noise::add(&mut cube, &Noise::thermal(radar, seed, 0).unwrap());
    (catseye::dsp::cpu::process(&cube, radar).unwrap().1, echoes)
}

fn measure(radar: &Radar, target: [f64; 4], dbsm: f64, seed: u64) -> Option<Point> {
    let (found, _) = chain(radar, target, dbsm, seed);
    let engine = Engine::Cpu(Precision::F64);
    locate::points(&engine, radar, &mut [found], None).unwrap().into_iter().next()
}

/// Root mean square of error over standard deviation, for targets anywhere between cells and beams, in
/// range, range rate, azimuth and elevation; the mean SNR; and the root mean square error of the RCS, dB.
fn normalised_errors(radar: &Radar, dbsm: f64, trials: u64) -> ([f64; 4], f64, f64) {
    let accuracy = locate::accuracy(radar).unwrap();
    let (mut sums, mut snr, mut level) = ([0.0; 4], 0.0, 0.0);
    for trial in 0..trials {
        let w = philox4x32_10([trial as u32, 0, 0, 0], [7, 0]).map(|w| f64::from(w) / 4_294_967_296.0 - 0.5);
        let target = [12.0 + 2.0 * w[0], 8.0 * w[1], 1.2 * w[2], 0.3 * w[3]];
        let p = measure(radar, target, dbsm, trial).expect("a point");
        let std = accuracy.std(power_from_db(p.snr_db), p.azimuth_rad, p.elevation_rad);
        let ratio = [
            (p.range_m - target[0]) / std.range_m,
            (p.range_rate_mps - target[1]) / std.range_rate_mps,
            (p.azimuth_rad - target[2]) / std.azimuth_rad.unwrap(),
            (p.elevation_rad - target[3]) / std.elevation_rad.unwrap(),
        ];
        sums.iter_mut().zip(ratio).for_each(|(s, r)| *s += r * r);
        snr += p.snr_db;
        level += (p.rcs_dbsm - dbsm).powi(2);
    }
    let n = trials as f64;
    (sums.map(|s| (s / n).sqrt()), snr / n, (level / n).sqrt())
}

/// Root-mean-square errors over those predicted, within a fifth, from 20 dB to 60 dB; and the RCS of a target anywhere between cells,
/// which are up to 1.4 dB lower on each axis, as good as noise allows.
#[test]
fn points_err_as_much_as_they_say() {
    // Hamming and a rectangle only where their side lobes stay under the noise, of which the SNR speaks.
    let levels: &[f64] = &[8.0, 20.0, 50.0];
    for (window, sampling, levels) in [
        (Window::Hann, Sampling::Iq, levels),
        (Window::Hamming, Sampling::Real, &levels[..2]),
        (Window::Rectangle, Sampling::Iq, &levels[..1]),
    ] {
        let radar = radar(window, sampling);
        for &dbsm in levels {
            let (ratio, snr, level) = normalised_errors(&radar, dbsm, 250);
            println!("{window:?} {sampling:?} at {snr:.1} dB: {ratio:.3?}, RCS {level:.3} dB");
            // A tone's level errs by 8.69/sqrt(2 SNR K) dB; the place between cells adds to that, most beside empty cells.
            let channels = locate::accuracy(&radar).unwrap().elements.len() as f64;
            let noise_db = 8.69 / (2.0 * power_from_db(snr) * channels).sqrt();
            let share = if window == Window::Rectangle { 2.0 } else { 1.3 };
            assert!(level < share * noise_db, "{window:?} at {snr} dB: {level} for {noise_db}");
            // At 58 dB the place between cells, a bound of which is stated, outweighs the noise.
            let least = if dbsm > 40.0 { 0.75 } else { 0.8 };
            for r in ratio {
                assert!(r > least && r < 1.2, "{window:?} at {snr} dB: {ratio:?}");
            }
        }
    }
}

/// Bodies faster than the transmitters' turns can follow: the array says by how many folds.
#[test]
fn the_array_finds_the_fold() {
    let radar = radar(Window::Hann, Sampling::Iq);
    let channels: Vec<(DVec3, usize)> =
        locate::accuracy(&radar).unwrap().elements.iter().map(|e| (e.position_m, e.slot)).collect();
    let grid = Grid::new(&radar).unwrap();
    let directions: Vec<(f64, f64)> =
        grid.azimuth_rad.iter().flat_map(|a| grid.elevation_rad.iter().map(|e| (*a, *e))).collect();
    let k = wavenumber(radar.sample_centre_hz());
    let periods_s = [radar.chirp_period_s(), radar.loop_period_s()];
    let folds = SlotFolds::new(&channels, radar.tx.len(), k, periods_s, &directions).unwrap();
    let ambiguity = folds.ambiguity_mps();
    assert!((ambiguity - 2.0 * radar.max_velocity_mps()).abs() < 1e-9);
    println!("folds are {:.2} dB apart", folds.separation_db());
    for (seed, rate) in [(0, 7.0), (1, 7.0 - ambiguity), (2, 7.0 + ambiguity), (3, -9.0 - ambiguity)] {
        let (found, _) = chain(&radar, [12.0, rate, 0.3, 0.1], 14.0, seed);
        let (_, rates) = peaks(&radar, &found, &locate::accuracy(&radar).unwrap());
        let noise = found.noise[0];
        let t = folds.test(found.snapshots.of(0), rates[0], noise, 1e-2, None);
        assert!(t.is_found, "{rate}: {t:?}");
        assert!((t.range_rate_mps - rate).abs() < 0.1, "{rate}: {t:?}");
    }
}
