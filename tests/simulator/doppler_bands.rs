//! Doppler bands (DDM), range migration and the removal of what rests, one by one and together, on both engines.

use catseye::adc::synthesis::point_echo;
use catseye::adc::{Cube, CubePiece, DeviceCube};
use catseye::base::control::Control;
use catseye::base::units::C0;
use catseye::detect::points::range_rate_mps;
use catseye::dsp::cpu;
use catseye::dsp::multiplex::decode;
use catseye::dsp::transform::{self, Keystone};
use catseye::dsp::{Cell, RangeDoppler, device, fft, keystone, peaks, power, spectrum, stream, zero_doppler};
use catseye::engine::{AnyCube, Engine, Extent, FrameInput, Precision};
use catseye::gpu::Gpu;
use catseye::gpu::compare::{check_close, opened_for_tests, test_gpu};
use catseye::scene::radar::{Cfar, CfarKind, Radar, Sampling};
use catseye::scene::radar_toml::parse;
use catseye::trace::Echoes;
use glam::DVec3;
use num_complex::{Complex32, Complex64};
use std::f64::consts::TAU;
use std::path::Path;

/// Two transmitters, three receivers.
fn radar(multiplex: &str, sampling: &str, chirps: usize, processing: &str) -> Radar {
    let text = format!(
        "name = \"m\"\n[waveform]\ncarrier_hz = 77e9\nbandwidth_hz = 4e9\nramp_time_s = 20e-6\nchirp_period_s = 25e-6\n\
         chirps = {chirps}\n{multiplex}\n[receiver]\nsampling = \"{sampling}\"\nsample_rate_hz = 6.4e6\nsamples = 128\n\
         noise_figure_db = 10\nthermal_noise = false\n[transmitter]\npower_dbm = 10\n\
         [[tx]]\nposition_half_wavelengths = [0, 0, 0]\n[[tx]]\nposition_half_wavelengths = [0, 3, 0]\n\
         [[rx]]\nposition_half_wavelengths = [0, 0, 0]\n[[rx]]\nposition_half_wavelengths = [0, 1, 0]\n\
         [[rx]]\nposition_half_wavelengths = [0, 2, 0]\n[processing]\n{processing}\n"
    );
    parse(Path::new("m.toml"), &text).unwrap_or_else(|e| panic!("{e}"))
}

const DDM: &str = "multiplex = \"ddm\"\nempty_bands = 1";

/// Complex, unit variance, from SplitMix64 (Steele et al. 2014).
fn noise(seed: u64, len: usize) -> Vec<Complex64> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (((z ^ (z >> 31)) >> 11) + 1) as f64 / (1u64 << 53) as f64
    };
    (0..len).map(|_| Complex64::from_polar((-next().ln()).sqrt(), TAU * next())).collect()
}

/// Target at `range_m` in mid-frame, from the exact phase of eq. 12 with the delay of each chirp; transmitter
/// `tx` is turned by -tx/3 from chirp to chirp, and channels are 0.7 rad apart.
fn add(cube: &mut Cube<f64>, radar: &Radar, range_m: f64, rate_mps: f64, amplitude: f64) {
    let middle = 0.5 * (radar.chirps as f64 - 1.0);
    for m in 0..radar.chirps {
        let t = (m as f64 - middle) * radar.loop_period_s();
        let tau = 2.0 * (range_m + rate_mps * t) / C0;
        for rx in 0..radar.rx.len() {
            for n in 0..radar.samples {
                let f = radar.start_hz() + radar.slope_hz_per_s() * n as f64 / radar.sample_rate_hz;
                for tx in 0..radar.tx.len() {
                    let turn = -((tx * m) as f64) / 3.0;
                    let z = amplitude * Complex64::cis(TAU * (f * tau + turn) - 0.7 * (3 * tx + rx) as f64);
                    cube.data[(m * radar.rx.len() + rx) * radar.samples + n] += match radar.sampling {
                        Sampling::Iq => z,
                        Sampling::Real => Complex64::new(2f64.sqrt() * z.re, 0.0),
                    };
                }
            }
        }
    }
}

fn cube_of(radar: &Radar, targets: &[(f64, f64, f64)], noise_amplitude: f64) -> Cube<f64> {
    let mut cube = Cube::zeros(radar.chirps, radar.channels(), radar.samples);
    for (range, rate, amplitude) in targets {
        add(&mut cube, radar, *range, *rate, *amplitude);
    }
    let len = cube.data.len();
    for (x, n) in cube.data.iter_mut().zip(noise(7, len)) {
        *x += match radar.sampling {
            Sampling::Iq => n * noise_amplitude,
            Sampling::Real => Complex64::new(n.re * noise_amplitude, 0.0),
        };
    }
    // What the gpu gets, so that only its own rounding counts.
    cube.to_f32().to_f64()
}

fn parts(z: &[Complex32]) -> &[f32] {
    bytemuck::cast_slice(z)
}

fn parts_f64(z: &[Complex64]) -> &[f64] {
    bytemuck::cast_slice(z)
}

fn apart(got: &[Complex64], want: &[Complex64]) -> f64 {
    assert_eq!(got.len(), want.len());
    let error: f64 = got.iter().zip(want).map(|(g, w)| (g - w).norm_sqr()).sum();
    (error / want.iter().map(|w| w.norm_sqr()).sum::<f64>()).sqrt()
}

fn on_gpu(
    gpu: &Gpu,
    cube: &Cube<f64>,
    t: &transform::Transform,
    method: Option<fft::Method>,
) -> Vec<Complex32> {
    let mut recorder = gpu.recorder("spectrum");
    let spectrum = spectrum::record_by(&mut recorder, gpu, &cube.to_f32(), t, method).unwrap();
    recorder.submit().unwrap();
    spectrum.read(gpu).unwrap().data
}

/// Eq. 89 with bands, as a sum: the band of transmitter k at fold a turns k/B of a turn from chirp to chirp at all
/// samples, and what the target's range rate adds grows with the frequency of the sample.
fn slow_keystone(cube: &Cube<f64>, t: &transform::Transform, k: &Keystone) -> Vec<Complex64> {
    let (bands, rows) = (t.bands, t.doppler_fft / t.bands);
    let middle = 0.5 * (t.chirps as f64 - 1.0);
    let mut out = Vec::new();
    for d in 0..rows {
        let nu = (d as f64 - (rows / 2) as f64) / t.doppler_fft as f64 + f64::from(k.fold) / bands as f64;
        for b in 0..bands {
            let tx = (b as i32 + k.fold).rem_euclid(bands as i32);
            for c in 0..cube.channels {
                let line: Vec<Complex64> = (0..cube.samples)
                    .map(|n| {
                        let over_chirps = |m: usize| {
                            let warped = nu * (middle + k.scale[n] * (m as f64 - middle));
                            let turn = f64::from(tx) * m as f64 / bands as f64;
                            cube.row(m, c)[n] * t.doppler_window[m] * Complex64::cis(-TAU * (warped - turn))
                        };
                        (0..cube.chirps).map(over_chirps).sum()
                    })
                    .collect();
                for r in 0..t.range_bins {
                    let turns = |n: usize| r as f64 * n as f64 / t.range_fft as f64;
                    out.push(
                        (0..cube.samples)
                            .map(|n| (n, if t.reversed { cube.samples - 1 - n } else { n }))
                            .map(|(n, i)| line[i] * t.range_window[n] * Complex64::cis(-TAU * turns(n)))
                            .sum(),
                    );
                }
            }
        }
    }
    out
}

#[test]
fn keystone_is_its_sum() {
    for (chirps, doppler_fft, samples, bands, fold) in [
        (16, 16, 16_usize, 1, 0),
        (13, 21, 11, 1, 2),
        (12, 12, 8, 3, 0),
        (14, 18, 9, 3, 1),
        (15, 20, 8, 4, -2),
        (1, 1, 5, 1, -1),
    ] {
        let mut p = radar(DDM, "iq", 12, "").processing;
        p.doppler_fft = doppler_fft;
        p.range_fft = if bands == 1 { samples.next_power_of_two() } else { samples + 3 };
        let mut t = transform::Transform::new(chirps, 2, samples, Sampling::Iq, &p).unwrap();
        t.bands = bands;
        // As of a falling chirp.
        t.reversed = fold > 0;
        let scale: Vec<f64> = (0..samples).map(|n| 0.97 + 0.08 * n as f64 / samples as f64).collect();
        let k = Keystone { scale, fold };
        let cube = Cube { chirps, channels: 2, samples, data: noise(3, chirps * 2 * samples) };
        let cube = cube.to_f32().to_f64();
        let want = slow_keystone(&cube, &t, &k);
        let got = cpu::keystone::spectrum(&cube, &t, &k.scale, fold).unwrap();
        assert_eq!((got.doppler_bins, got.channels), (doppler_fft / bands, 2 * bands));
        let error = apart(&got.data, &want);
        t.keystone = Some(k);
        println!("{bands} bands, fold {fold}: cpu {error:.1e}");
        assert!(error < 1e-13, "{bands} {fold}");
        for method in [fft::Method::Passes, fft::Method::Workgroup] {
            if method == fft::Method::Workgroup && !t.range_fft.is_power_of_two() {
                continue;
            }
            let got = on_gpu(test_gpu(), &cube, &t, Some(method));
            let d = check_close(parts(&got), parts_f64(&want), keystone::KERNEL.tolerance.relative_l2)
                .unwrap_or_else(|e| panic!("{bands} bands, fold {fold}: {e}"));
            println!("{bands} bands, fold {fold}: gpu {method:?} {:.1e}", d.relative_l2);
        }
        // As if all samples had the carrier's frequency: far off, so the comparison sees the scale.
        if let Some(k) = &mut t.keystone {
            k.scale.fill(1.0);
        }
        if chirps > 1 {
            let plain = on_gpu(test_gpu(), &cube, &t, None);
            assert!(check_close(parts(&plain), parts_f64(&want), 1e-2).is_err());
        }
    }
}

/// Sizes of real frames, against f64.
#[test]
fn keystone_on_the_gpu_agrees_with_f64() {
    for (chirps, doppler_fft, samples, bands, fold) in [
        (256, 300, 128, 1, 0),
        (256, 256, 128, 1, 9),
        (500, 512, 60, 1, -3),
        (240, 240, 64, 3, 1),
        (2000, 2048, 20, 1, 1),
    ] {
        let mut p = radar(DDM, "iq", 12, "").processing;
        (p.doppler_fft, p.range_fft) = (doppler_fft, 2 * samples);
        let mut t = transform::Transform::new(chirps, 2, samples, Sampling::Iq, &p).unwrap();
        t.bands = bands;
        let scale: Vec<f64> = (0..samples).map(|n| 0.97 + 0.06 * n as f64 / samples as f64).collect();
        let cube = Cube { chirps, channels: 2, samples, data: noise(4, chirps * 2 * samples) };
        let cube = cube.to_f32().to_f64();
        let want = cpu::keystone::spectrum(&cube, &t, &scale, fold).unwrap();
        t.keystone = Some(Keystone { scale, fold });
        let got = on_gpu(test_gpu(), &cube, &t, None);
        let d = check_close(parts(&got), parts_f64(&want.data), keystone::KERNEL.tolerance.relative_l2)
            .unwrap_or_else(|e| panic!("{chirps}: {e}"));
        println!("{chirps} chirps to {doppler_fft}, {bands} bands, fold {fold}: {:.2e}", d.relative_l2);
    }
    let mut t =
        transform::Transform::new(8, 2, 8, Sampling::Iq, &radar(DDM, "iq", 12, "").processing).unwrap();
    t.keystone = Some(Keystone { scale: vec![1.0; 7], fold: 0 });
    let mut recorder = test_gpu().recorder("refused");
    let error = spectrum::record(&mut recorder, test_gpu(), &Cube::zeros(8, 2, 8), &t).err().unwrap();
    assert!(error.exit_code() == 2 && error.to_string().contains("positive scale"), "{error}");
}

/// Every detection stage of the gpu on bands.
#[test]
fn maps_cells_and_snapshots_agree() {
    for (multiplex, sampling, processing) in [
        (DDM, "iq", ""),
        (DDM, "real", "doppler_fft = 150"),
        (DDM, "iq", "range_migration = \"keystone\""),
        (DDM, "real", "range_migration = \"keystone\"\nremove_static = true"),
        ("", "real", "range_migration = \"keystone\""),
    ] {
        let name = format!("{multiplex} {sampling} {processing}").replace('\n', " ");
        let mut radar = radar(multiplex, sampling, 120, processing);
        radar.processing.cfar =
            Cfar { kind: CfarKind::Os { rank: 100 }, guard: [2, 1], train: [6, 4], pfa: 1e-3 };
        let cell = radar.range_bin_m();
        let targets = [(20.3 * cell, 9.0, 1.0), (31.0 * cell, -23.0, 0.7), (44.8 * cell, 0.0, 2.0)];
        let cube = match multiplex {
            DDM => cube_of(&radar, &targets, 0.3),
            _ => {
                let mut cube = Cube::zeros(radar.chirps, radar.channels(), radar.samples);
                cube.data = noise(9, cube.data.len()).iter().map(|z| z.re.into()).collect();
                cube.to_f32().to_f64()
            }
        };
        let mut lines = cube.clone();
        if radar.processing.remove_static {
            lines = cpu::lines::prepared(&cube, &radar).unwrap().into_owned().to_f32().to_f64();
        }
        let (spectrum, want) = cpu::process(&lines, &radar).unwrap();
        let (on_device, got) = device::process(test_gpu(), &lines.to_f32(), &radar).unwrap();
        let read = on_device.read(test_gpu()).unwrap();
        assert_eq!((read.doppler_bins, read.channels), (spectrum.doppler_bins, spectrum.channels));
        let bound = keystone::KERNEL.tolerance.relative_l2;
        let s = check_close(parts(&read.data), parts_f64(&spectrum.data), bound)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let m = check_close(&got.map.data, &want.map.data, power::KERNEL.tolerance.relative_l2)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        println!(
            "{name}: spectrum {:.1e}, map {:.1e}, {} cells",
            s.relative_l2,
            m.relative_l2,
            got.cells.len()
        );
        // Detector, list and snapshots on the gpu's own map and spectrum, to the bit.
        let cfar = &radar.processing.cfar;
        let channels = spectrum.channels;
        let judged = cpu::detect(&got.map, cfar, channels).unwrap();
        assert_eq!(got.detection, judged, "{name}");
        assert_eq!(got.cells, cpu::peaks::peaks(&got.map, &got.detection.mask), "{name}");
        assert_eq!(got.noise, cpu::noise(&got.map, cfar, channels, &got.cells).unwrap(), "{name}");
        assert_eq!(got.snapshots, cpu::snapshot::snapshots(&read, &got.cells), "{name}");
        if multiplex == DDM {
            let strong = if radar.processing.remove_static { 2 } else { 3 };
            assert_eq!(got.cells[..strong], want.cells[..strong], "{name}");
        }
    }
}

/// A limit of bytes on the device changes no bit, nor do cubes that lie there in pieces.
#[test]
fn chunks_change_no_bit() {
    for processing in ["", "range_migration = \"keystone\""] {
        for multiplex in [DDM, ""] {
            let mut radar = radar(multiplex, "iq", 60, processing);
            radar.processing.cfar.pfa = 1e-2;
            let (chirps, channels, samples) = (60, radar.channels(), 128);
            let data = noise(5, chirps * channels * samples);
            let cube = Cube { chirps, channels, samples, data }.to_f32();
            let (whole, want) = device::process(test_gpu(), &cube, &radar).unwrap();
            let whole = whole.read(test_gpu()).unwrap();
            // One channel's rows take 64 KiB, the map of DDM 20 KiB, of TDM 64.
            let least = radar.doppler_rows() as u64 * 128 * 4;
            for limit in [300 << 10, 150 << 10, least + 100] {
                let gpu = opened_for_tests();
                let gpu = gpu.with_poisoned_buffers().with_binding_limit(limit);
                let (chunks, got) = device::process(&gpu, &cube, &radar).unwrap();
                println!("{multiplex:?} {processing:?} {limit}: {} chunks", chunks.chunks());
                assert!(limit > 160 << 10 || chunks.chunks() > 1);
                assert_eq!(chunks.read(&gpu).unwrap(), whole, "{limit}");
                assert_eq!(got, want, "{limit}");

                let mut recorder = gpu.recorder("cube on the device");
                let row = channels * samples;
                let most = (limit as usize / (8 * row)).clamp(1, 25);
                let pieces = (0..chirps)
                    .step_by(most)
                    .map(|first| {
                        let chirps = most.min(chirps - first);
                        let part = &cube.data[first * row..(first + chirps) * row];
                        let part: Vec<[f32; 2]> = part.iter().map(|z| [z.re, z.im]).collect();
                        CubePiece { first_chirp: first, chirps, data: recorder.upload("piece", &part) }
                    })
                    .collect();
                let on = DeviceCube { chirps, channels, samples, pieces };
                let t = transform::Transform::of_cube(&cube, &radar).unwrap();
                let recorded = device::record(&mut recorder, &gpu, &on, &t, &radar.processing.cfar).unwrap();
                assert_eq!(recorded.take(&gpu, &mut recorder.submit().unwrap()).unwrap().1, want, "{limit}");
            }
            // Blocks of channels: with keystone, too; bands are refused.
            let t = transform::Transform::of_cube(&cube, &radar).unwrap();
            let cfar = &radar.processing.cfar;
            let on_gpu = stream::process(test_gpu(), &t, cfar, &mut stream::from_cube(&cube));
            let on_cpu = cpu::stream::process(&t, cfar, 1 << 17, &mut stream::from_cube(&cube));
            if multiplex == DDM {
                assert!(on_gpu.unwrap_err().to_string().contains("DDM") && on_cpu.is_err());
            } else {
                assert_eq!(on_gpu.unwrap(), want);
                assert_eq!(on_cpu.unwrap(), cpu::process(&cube, &radar).unwrap().1);
            }
        }
    }
}

/// What rests is gone in all bands, also of frames that are no whole number of periods; what moves stays. The
/// projection is idempotent, and for one transmitter it is the mean.
#[test]
fn what_rests_is_removed_from_all_bands() {
    let mean = zero_doppler::AtRest::turning(40, 1, 1);
    assert!(mean.period == 1 && (mean.projection[0] - 1.0 / 40.0).norm() < 1e-15);
    for chirps in [120, 121, 122, 5, 2] {
        let mut radar = radar(DDM, "iq", 120, "");
        radar.chirps = chirps;
        let cell = radar.range_bin_m();
        let still = cube_of(&radar, &[(20.3 * cell, 0.0, 3.0), (50.0 * cell, 0.0, 1.0)], 0.0);
        let rest = zero_doppler::AtRest::of(&radar);
        assert_eq!(rest.period, 3);
        let columns = radar.channels() * radar.samples;
        let mut left = still.clone();
        cpu::zero_doppler::remove(&mut left.data, columns, &rest);
        let norm = |z: &[Complex64]| z.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
        // The cube is rounded to f32.
        assert!(norm(&left.data) < 1e-7 * norm(&still.data), "{chirps}: {}", norm(&left.data));
        // The mean alone leaves the second transmitter.
        let mut wrong = still.clone();
        let mean = zero_doppler::AtRest::turning(chirps, 1, 1);
        cpu::zero_doppler::remove(&mut wrong.data, columns, &mean);
        assert!(norm(&wrong.data) > 0.3 * norm(&still.data));

        let mixed = cube_of(&radar, &[(20.3 * cell, 0.0, 3.0), (31.0 * cell, 9.0, 1.0)], 0.1);
        let mut once = mixed.clone();
        cpu::zero_doppler::remove(&mut once.data, columns, &rest);
        let mut twice = once.clone();
        cpu::zero_doppler::remove(&mut twice.data, columns, &rest);
        assert!(norm(&once.data) == 0.0 || apart(&twice.data, &once.data) < 1e-12 || chirps < 3);

        let cube = mixed.to_f32();
        let mut recorder = test_gpu().recorder("rest");
        let cut = chirps / 3 + 1;
        let pieces = [0..cut, cut..chirps]
            .into_iter()
            .filter(|m| !m.is_empty())
            .map(|m: std::ops::Range<usize>| {
                let part = &cube.data[m.start * columns..m.end * columns];
                let part: Vec<[f32; 2]> = part.iter().map(|z| [z.re, z.im]).collect();
                CubePiece { first_chirp: m.start, chirps: m.len(), data: recorder.upload("piece", &part) }
            })
            .collect();
        let on = DeviceCube { chirps, channels: radar.channels(), samples: radar.samples, pieces };
        zero_doppler::record(&mut recorder, &on, &rest);
        let pending = on.read(&mut recorder);
        let got = on.take(&mut recorder.submit().unwrap(), pending).to_f64();
        let d: Vec<_> = got.data.iter().zip(&once.data).map(|(a, b)| a - b).collect();
        println!("{chirps} chirps: {:.1e}", norm(&d) / norm(&mixed.data));
        assert!(norm(&d) < zero_doppler::KERNEL.tolerance.relative_l2 * norm(&mixed.data));
    }
}

fn strongest(found: &RangeDoppler<f64>) -> (Cell, f64) {
    let cell = found.cells[0];
    (cell, peaks::place(&found.map, cell, [None, None]).doppler)
}

/// A target that walks over six cells, beside a strong one at rest that is taken out: in its cell of mid-frame, at
/// the power of one that does not walk, with its range rate, its transmitters told apart, on both engines.
#[test]
fn a_walking_target_stays_in_its_cell() {
    let mut radar = radar(DDM, "iq", 1536, "range_migration = \"keystone\"\nremove_static = true");
    radar.processing.cfar = Cfar { kind: CfarKind::Ca, guard: [2, 1], train: [6, 4], pfa: 1e-6 };
    let cell = radar.range_bin_m();
    let rate = 0.87 * radar.max_velocity_mps();
    let walk = rate * radar.frame_time_s() / cell;
    assert!(walk > 5.0, "{walk}");
    let targets = [(30.0 * cell, rate, 1.0), (60.0 * cell, 0.0, 30.0)];
    let cube = cube_of(&radar, &targets, 0.05);
    let mut plain = radar.clone();
    plain.processing.keystone = false;
    let gpu = Engine::Gpu(Box::new(opened_for_tests()));
    for (engine, cube) in
        [(&gpu, AnyCube::F32(cube.to_f32())), (&Engine::Cpu(Precision::F64), AnyCube::F64(cube.clone()))]
    {
        let found = engine.range_doppler(&radar, &cube).unwrap();
        let (at, row) = strongest(&found);
        assert_eq!(at.range, 30);
        let power = found.map.at(at.doppler as usize, 30);
        let seen = range_rate_mps(&radar, row);
        let decoded = decode(&radar, found.snapshots.of(0), seen);
        println!("{:.3} of {rate:.3} m/s, {power:.3} W, {walk:.1} cells", decoded.range_rate_mps);
        assert!((decoded.range_rate_mps - rate).abs() < 0.1 * radar.velocity_bin_mps());
        // Hann between cells loses up to 1.42 dB.
        assert!(power > 0.7 && power < 1.05, "{power}");
        for (c, z) in decoded.channels.iter().enumerate() {
            let want = Complex64::cis(-0.7 * c as f64);
            let got = z / decoded.channels[0];
            assert!((got - want).norm() < 0.02, "channel {c}: {got} for {want}");
        }
        // Nothing is left of the other.
        let left = (0..found.map.doppler_bins).map(|d| found.map.at(d, 60)).fold(0.0, f64::max);
        assert!(left < 1e-4 * power, "{left}");
        let walked = engine.range_doppler(&plain, &cube).unwrap();
        let best = walked.map.data.iter().copied().fold(0.0, f64::max);
        println!("without: {best:.3} W");
        assert!(best < 0.5 * power);
    }
}

/// The empty band tells the fold, with and without the keystone transform.
#[test]
fn the_empty_band_unfolds_on_the_gpu() {
    let gpu = Engine::Gpu(Box::new(opened_for_tests()));
    for processing in ["", "range_migration = \"keystone\"", "remove_static = true"] {
        let radar = radar(DDM, "iq", 240, processing);
        let cell = radar.range_bin_m();
        let width = 2.0 * radar.max_velocity_mps();
        for rate in [0.2 * width, 0.8 * width, -1.1 * width, -0.35 * width] {
            let cube = cube_of(&radar, &[(30.0 * cell, rate, 1.0)], 0.02);
            let found = gpu.range_doppler(&radar, &AnyCube::F32(cube.to_f32())).unwrap();
            let (_, row) = strongest(&found);
            let seen = range_rate_mps(&radar, row);
            let decoded = decode(&radar, found.snapshots.of(0), seen);
            println!("{processing}: {seen:.2} -> {:.2} for {rate:.2}", decoded.range_rate_mps);
            assert!((decoded.range_rate_mps - rate).abs() < 0.15 * radar.velocity_bin_mps());
            assert_eq!(decoded.channels.len(), 6);
            for (c, z) in decoded.channels.iter().enumerate() {
                let got = z / decoded.channels[0];
                assert!((got - Complex64::cis(-0.7 * c as f64)).norm() < 0.05, "{c}: {got}");
            }
        }
    }
}

/// Whole frames, of which those of transmitters in turn, and of a single one in bands, are one submission.
#[test]
fn frames_agree_with_f64() {
    let gpu = Engine::Gpu(Box::new(opened_for_tests()));
    let truth = Engine::Cpu(Precision::F64);
    let echo = |i: f64, range: f64, rate: f64| {
        let u = DVec3::new(1.0, 0.2 * i - 0.2, 0.0).normalize();
        point_echo(u * range, u * rate, 1.0, i as u32 + 1)
    };
    let list = Echoes {
        list: vec![echo(0.0, 1.1, 6.0), echo(1.0, 1.9, 0.0), echo(2.0, 2.6, -9.0)],
        ..Default::default()
    };
    for (multiplex, transmitters, processing) in [
        ("", 2, "range_migration = \"keystone\""),
        ("", 2, "range_migration = \"keystone\"\nremove_static = true"),
        (DDM, 2, ""),
        (DDM, 2, "range_migration = \"keystone\"\nremove_static = true"),
        (DDM, 1, "range_migration = \"keystone\"\nremove_static = true"),
    ] {
        let mut radar = radar(multiplex, "iq", 240, processing);
        radar.tx.truncate(transmitters);
        let run = |engine: &Engine| {
            let (echoes, interference) = (&list, &[]);
            let input =
                FrameInput { radar: &radar, echoes, interference, seed: 5, frame: 1, extent: Extent::CELLS };
            let made = engine.frame(&input, Control::default()).unwrap();
            made.maps[0].clone()
        };
        let (got, want) = (run(&gpu), run(&truth));
        let d: f64 = got.map.data.iter().zip(&want.map.data).map(|(a, b)| (a - b).powi(2)).sum();
        let error = (d / want.map.data.iter().map(|b| b * b).sum::<f64>()).sqrt();
        println!("{multiplex} {transmitters} {processing}: {error:.1e}, {} cells", want.cells.len());
        // As of every frame on the device: rounding of the synthesis.
        assert!(error < 1e-4, "{error}");
        let moving = if radar.processing.remove_static { 2 } else { 3 };
        assert_eq!(got.cells[..moving], want.cells[..moving]);
        let channels = got.snapshots.channels;
        assert_eq!(channels, want.snapshots.channels);
        let n = moving * channels;
        assert!(apart(&got.snapshots.data[..n], &want.snapshots.data[..n]) < 1e-4);
    }
}
