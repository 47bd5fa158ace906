//! Directions of arrival: the estimators against bounds, closed forms and echoes of the whole chain,
//! and the GPU against the cpu engine.

use catseye::adc::Cube;
use catseye::adc::cpu::synthesis::synthesise;
use catseye::adc::synthesis::{Plan, point_echo};
use catseye::base::control::Control;
use catseye::base::error::Result;
use catseye::base::frames::direction_from_angles;
use catseye::base::rng::philox4x32_10;
use catseye::base::units::wavelength_m;
use catseye::dsp::doa_beamform::{Beamformer, Grid};
use catseye::dsp::doa_bisvd::BiSvd;
use catseye::dsp::doa_calibration::{Calibration, TurntableOptions};
use catseye::dsp::doa_covariance::{
    covariance, eigen, forward_backward, principal_angle, subarray_snapshots, subarrays, with_backward,
};
use catseye::dsp::doa_crb::standard_deviations;
use catseye::dsp::doa_estimate::{Cells, Estimator, Method, Options, Smoothing, Source, SourceNumber};
use catseye::dsp::doa_manifold::{Manifold, Matrix};
use catseye::dsp::doa_order::{Criterion, source_number};
use catseye::dsp::doa_spectrum::{self, Forms, Steering};
use catseye::gpu::compare::{check_close, opened_for_tests, test_gpu};
use catseye::scene::radar::Radar;
use catseye::scene::radar_toml;
use catseye::trace::Echoes;
use glam::DVec3;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Unit-variance complex normal number of (trial, snapshot, index).
fn normal(trial: u32, snapshot: u32, index: u32) -> Complex64 {
    let u = philox4x32_10([trial, snapshot, index, 0], [4, 77]);
    let u = u.map(|u| (f64::from(u) + 0.5) / 4_294_967_296.0);
    Complex64::from_polar((-u[0].ln()).sqrt(), TAU * u[1])
}

fn lambda() -> f64 {
    wavelength_m(77e9)
}

fn line(n: usize) -> Manifold {
    Manifold::receivers((0..n).map(|i| DVec3::Y * (0.5 * lambda() * i as f64)).collect(), lambda()).unwrap()
}

fn rectangle(rows: usize, cols: usize) -> Manifold {
    let half = 0.5 * lambda();
    let p = (0..rows * cols).map(|i| DVec3::new(0.0, half * (i % cols) as f64, half * (i / cols) as f64));
    Manifold::receivers(p.collect(), lambda()).unwrap()
}

fn sparse() -> Manifold {
    let y = [0.0, 1.0, 4.0, 6.0, 13.0, 14.0];
    Manifold::receivers(y.map(|y| DVec3::Y * (0.5 * lambda() * y)).to_vec(), lambda()).unwrap()
}

/// Azimuths from -`deg` to `deg`, elevation 0.
fn azimuths(deg: f64, count: usize) -> Grid {
    let at = |i: usize| (-deg + 2.0 * deg * i as f64 / (count - 1) as f64).to_radians();
    Grid { azimuth_rad: (0..count).map(at).collect(), elevation_rad: vec![0.0] }
}

fn both(deg: f64, count: usize) -> Grid {
    let axis = azimuths(deg, count).azimuth_rad;
    Grid { azimuth_rad: axis.clone(), elevation_rad: axis }
}

fn on_cpu(steering: &Steering, forms: &Forms) -> Result<Vec<f64>> {
    Ok(catseye::dsp::cpu::doa_spectrum::spectra(steering, forms))
}

/// Waves of amplitude sqrt(power) and independent normal amplitudes in noise, `[snapshot, channel]`.
fn waves(m: &Manifold, at: &[(f64, f64, f64)], noise_w: f64, snapshots: u32, trial: u32) -> Vec<Complex64> {
    let a: Vec<Vec<Complex64>> = at.iter().map(|(az, el, _)| m.steering(*az, *el)).collect();
    (0..snapshots)
        .flat_map(|t| {
            let s: Vec<Complex64> =
                (0..at.len()).map(|i| normal(trial, t, 1000 + i as u32) * at[i].2.sqrt()).collect();
            (0..m.channels())
                .map(|c| {
                    let wave: Complex64 = s.iter().zip(&a).map(|(s, a)| s * a[c]).sum();
                    wave + normal(trial, t, c as u32) * noise_w.sqrt()
                })
                .collect::<Vec<_>>()
        })
        .collect()
}

fn one_cell(e: &Estimator, x: &[Complex64], noise_w: Option<f64>) -> Result<Vec<Source>> {
    let snapshots = x.len() / e.manifold().channels();
    let noise = noise_w.map(|w| [w]);
    let cells = Cells { snapshots, data: x, noise_w: noise.as_ref().map(|w| &w[..]) };
    Ok(e.estimate_cells(&cells, on_cpu)?.remove(0))
}

fn options(method: Method, sources: usize) -> Options {
    Options { method, sources: SourceNumber::Given(sources), ..Default::default() }
}

/// Azimuths, ascending.
fn sorted(sources: &[Source]) -> Vec<f64> {
    let mut az: Vec<f64> = sources.iter().map(|s| s.azimuth_rad).collect();
    az.sort_by(f64::total_cmp);
    az
}

const GRID_METHODS: [Method; 5] =
    [Method::Bartlett, Method::Capon, Method::Ml, Method::Music, Method::BiSvd { forgetting: 0.99 }];

// --- against the rest of the chain ---------------------------------------------------------------

#[test]
fn steering_is_that_of_the_beamformer() {
    let radar = radar_toml::preset("front77").unwrap();
    let (m, beam) = (Manifold::of_radar(&radar).unwrap(), Beamformer::new(&radar).unwrap());
    for (az, el) in [(0.4, 0.1), (-0.7, -0.3)] {
        let y = beam.amplitude(&m.steering(az, el), 0.0, az, el);
        assert!((y - 1.0).norm() < 1e-12);
    }
}

/// The radar with other receivers and few, short chirps; one transmitter at the origin.
fn small_radar(rx: &[DVec3]) -> Radar {
    let mut radar = radar_toml::preset("front77").unwrap();
    let antenna = radar.rx[0].clone();
    let at = |p: DVec3| {
        let mut a = antenna.clone();
        a.position_m = p;
        a
    };
    radar.tx = vec![at(DVec3::ZERO)];
    radar.rx = rx.iter().map(|p| at(*p)).collect();
    radar.samples = 256;
    radar.waveform = catseye::scene::waveform::Waveform::chirp(1e9, 20e-6, radar.chirp_period_s());
    radar.chirps = 16;
    radar.processing.range_fft = 256;
    radar.processing.doppler_fft = 16;
    radar.thermal_noise = false;
    radar
}

/// Snapshot of all channels in the strongest cell of point targets, through synthesis and both
/// transforms.
fn chain(radar: &Radar, targets: &[(DVec3, f64)]) -> Vec<Complex64> {
    let list = targets.iter().enumerate();
    let echoes = list.map(|(i, (p, sigma))| point_echo(*p, DVec3::ZERO, *sigma, i as u32 + 1)).collect();
    let echoes = Echoes { list: echoes, ..Default::default() };
    let cube: Cube<f64> = synthesise(&Plan::new(radar, &echoes).unwrap(), Control::default()).unwrap();
    let (spectrum, found) = catseye::dsp::cpu::process(&cube, radar).unwrap();
    let strongest =
        (0..found.map.data.len()).max_by(|a, b| found.map.data[*a].total_cmp(&found.map.data[*b]));
    let cell = strongest.unwrap();
    let (doppler, range) = (cell / found.map.range_bins, cell % found.map.range_bins);
    let at = |c: usize| spectrum.data[(doppler * spectrum.channels + c) * spectrum.range_bins + range];
    (0..spectrum.channels).map(at).collect()
}

#[test]
fn echoes_stand_where_they_are_left_right_up_and_down() {
    let half = 0.5 * lambda();
    let rx: Vec<DVec3> =
        (0..20).map(|i| DVec3::new(0.0, half * (i % 5) as f64, half * (i / 5) as f64)).collect();
    let radar = small_radar(&rx);
    let m = Manifold::of_radar(&radar).unwrap();
    for (az, el) in [(0.4, 0.12), (-0.3, -0.2)] {
        let x = chain(&radar, &[(direction_from_angles(az, el) * 30.0, 10.0)]);
        for method in [Method::Ml, Method::Music, Method::Capon, Method::Esprit, Method::Bartlett] {
            let e = Estimator::new(m.clone(), both(45.0, 31), options(method, 1)).unwrap();
            let s = one_cell(&e, &x, None).unwrap();
            assert_eq!(s.len(), 1, "{method:?}");
            // The wave front over 10 mm at 30 m is flat within k p^2/2r = 3 mrad of phase, and the
            // channels' range walk through the window is as small.
            assert!((s[0].azimuth_rad - az).abs() < 1e-3, "{method:?} {s:?}");
            assert!((s[0].elevation_rad - el).abs() < 1e-3, "{method:?} {s:?}");
            assert!(!s[0].ambiguous);
        }
    }
}

#[test]
fn a_near_echo_has_the_near_field_vector() {
    let rx: Vec<DVec3> = (0..12).map(|i| DVec3::Y * (0.5 * lambda() * (4 * i) as f64)).collect();
    let radar = small_radar(&rx);
    let range = 4.0;
    let az = 0.1;
    let x = chain(&radar, &[(direction_from_angles(az, 0.0) * range, 1.0)]);
    let likeness = |m: &Manifold| {
        let a = m.steering(az, 0.0);
        let dot: Complex64 = a.iter().zip(&x).map(|(a, x)| a.conj() * x).sum();
        dot.norm_sqr() / (12.0 * x.iter().map(|z| z.norm_sqr()).sum::<f64>())
    };
    let far = Manifold::of_radar(&radar).unwrap();
    let near = far.clone().at_range(range).unwrap();
    // 86 mm from end to end at 4 m: the front is curved by k p^2/2r = 1.5 rad.
    assert!(likeness(&far) < 0.95, "{}", likeness(&far));
    assert!(likeness(&near) > 0.9999, "{}", likeness(&near));
}

// --- gates -----------------------------------------------------------------------------------------

/// Root-mean-square error of two uncorrelated sources over trials, over the Cramér-Rao bound.
fn efficiency(method: Method, n: usize, at: [f64; 2], snapshots: u32, snr: f64, trials: u32) -> f64 {
    let m = line(n);
    let o = Options { smoothing: Smoothing::Off, ..options(method, 2) };
    let e = Estimator::new(m.clone(), azimuths(60.0, 241), o).unwrap();
    let power = snr;
    let mut sum = 0.0;
    for trial in 0..trials {
        let x = waves(&m, &[(at[0], 0.0, power), (at[1], 0.0, power)], 1.0, snapshots, trial);
        let az = sorted(&one_cell(&e, &x, Some(1.0)).unwrap());
        assert_eq!(az.len(), 2, "{method:?} trial {trial}");
        sum += (az[0] - at[0]).powi(2) + (az[1] - at[1]).powi(2);
    }
    let p = Matrix::from_fn(2, 2, |i, j| if i == j { Complex64::from(power) } else { Complex64::ZERO });
    let directions = [(at[0], 0.0), (at[1], 0.0)];
    let bound = standard_deviations(&m, &directions, [true, false], &p, 1.0, snapshots as usize);
    (sum / f64::from(trials) / (bound[0][0].powi(2) + bound[1][0].powi(2))).sqrt()
}

#[test]
fn errors_are_near_the_bound() {
    let at = [-0.12, 0.2];
    let run = |method, n| efficiency(method, n, at, 100, 100.0, 400);
    for method in [Method::Music, Method::RootMusic, Method::Ml] {
        let ratio = run(method, 8);
        println!("{method:?}: {ratio:.3} of the bound");
        // 800 errors: the ratio itself is known to 2.5 % (one sigma).
        assert!(ratio < 1.2 && ratio > 0.9, "{method:?} {ratio}");
    }
    for n in [5, 8] {
        let ratio = run(Method::Esprit, n);
        let nf = n as f64;
        let limit = 1.1 * (nf * (nf + 1.0) / (6.0 * (nf - 1.0))).sqrt();
        println!("ESPRIT, {n} elements: {ratio:.3} of the bound, allowed {limit:.3}");
        assert!(ratio < limit && ratio > 0.9, "{ratio} {limit}");
    }
}

#[test]
fn the_bisvd_is_nearly_as_good() {
    // A memory of 1/(1 - alpha) = 100 snapshots' weights; 400 snapshots fill it.
    let ratio = efficiency(Method::BiSvd { forgetting: 0.995 }, 8, [-0.12, 0.2], 400, 100.0, 100);
    // Exponential weights leave (1 + alpha)/(1 - alpha) = 399 x (1 - e^-2)/(1 + e^-2) = 304 looks of
    // the 400.
    let lost = (400.0f64 / 304.0).sqrt();
    println!("Bi-SVD: {ratio:.3} of the bound, {lost:.3} by its weights");
    assert!(ratio < 1.2 * lost && ratio > 0.9, "{ratio}");
}

#[test]
fn stated_deviations_are_those_that_occur() {
    let m = rectangle(3, 4);
    let at = [(0.2, -0.1, 50.0), (-0.35, 0.25, 20.0)];
    let o = Options { smoothing: Smoothing::Off, ..options(Method::Ml, 2) };
    let e = Estimator::new(m.clone(), both(50.0, 21), o).unwrap();
    let (mut scaled, trials) = ([0.0; 2], 60);
    for trial in 0..trials {
        let x = waves(&m, &at, 1.0, 10, trial);
        let s = one_cell(&e, &x, if trial % 2 == 0 { Some(1.0) } else { None }).unwrap();
        for t in at {
            let near = |s: &&Source| (s.azimuth_rad - t.0).hypot(s.elevation_rad - t.1);
            let s = s.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
            scaled[0] += ((s.azimuth_rad - t.0) / s.azimuth_std_rad).powi(2);
            scaled[1] += ((s.elevation_rad - t.1) / s.elevation_std_rad).powi(2);
        }
    }
    for sum in scaled {
        // Chi squared of 120 degrees of freedom, 0.1 % to each side.
        let mean = sum / f64::from(2 * trials);
        assert!(mean > 0.65 && mean < 1.46, "{scaled:?}");
    }
}

/// Document M: two corner reflectors at 17 m, 3 m apart, five elements, through the whole chain.
#[test]
fn two_corner_reflectors_at_17_m() {
    let rx: Vec<DVec3> = (0..5).map(|i| DVec3::Y * (0.5 * lambda() * i as f64)).collect();
    let radar = small_radar(&rx);
    let m = Manifold::of_radar(&radar).unwrap();
    let truth = (1.5f64 / 17.0).asin();
    let place = |az: f64| direction_from_angles(az, 0.0) * 17.0;
    let x = chain(&radar, &[(place(truth), 10.0), (place(-truth), 10.0)]);
    let grid = azimuths(45.0, 181);
    let show = |method, sources| {
        let o =
            Options { smoothing: Smoothing::Subarray([1, 4]), below_db: 10.0, ..options(method, sources) };
        let e = Estimator::new(m.clone(), grid.clone(), o).unwrap();
        (sorted(&one_cell(&e, &x, None).unwrap()), e)
    };
    for method in
        [Method::Music, Method::Esprit, Method::RootMusic, Method::BiSvd { forgetting: 0.9 }, Method::Ml]
    {
        let (az, _) = show(method, 2);
        println!("{}: {:.2?} deg", method.name(), az.iter().map(|a| a.to_degrees()).collect::<Vec<_>>());
        assert_eq!(az.len(), 2, "{method:?}");
        // Half a degree: the wave front at 17 m is curved by 2 mrad of phase, and nothing else errs.
        for (a, t) in az.iter().zip([-truth, truth]) {
            assert!((a - t).abs() < 0.5f64.to_radians(), "{method:?} {az:?}");
        }
    }
    // Beamforming: one lobe.
    let (az, e) = show(Method::Bartlett, 2);
    println!("Bartlett: {:.2?} deg", az.iter().map(|a| a.to_degrees()).collect::<Vec<_>>());
    assert_eq!(az.len(), 1);
    // MUSIC without subarrays cannot part them: one look, two sources.
    let o = Options { smoothing: Smoothing::Off, ..options(Method::Music, 2) };
    let bare = Estimator::new(m.clone(), grid.clone(), o).unwrap();
    let refused = one_cell(&bare, &x, None).unwrap_err().to_string();
    assert!(
        refused.starts_with("snapshots = 1: MUSIC cannot estimate 2 sources from this cell"),
        "{refused}"
    );
    // The picture: MUSIC has two peaks, the beamformer one, in the lobe.
    let tops = |s: &[f64]| {
        let top = s.iter().copied().fold(0.0, f64::max);
        (1..s.len() - 1).filter(|i| s[*i] > s[i - 1] && s[*i] >= s[i + 1] && s[*i] > 0.1 * top).count()
    };
    let cell = Cells { snapshots: 1, data: &x, noise_w: None };
    assert_eq!(tops(&e.spectra(&cell, on_cpu).unwrap()), 1);
    let (_, music) = show(Method::Music, 2);
    let spectrum = music.spectra(&cell, on_cpu).unwrap();
    assert!(spectrum.iter().all(|s| *s >= 1.0 - 1e-9));
    let peaks = |i: &usize| spectrum[*i] > spectrum[i - 1] && spectrum[*i] >= spectrum[i + 1];
    let peaks: Vec<usize> = (1..spectrum.len() - 1).filter(peaks).filter(|i| spectrum[*i] > 100.0).collect();
    assert_eq!(peaks.len(), 2);
    // The subspace of the tracker is that of the decomposition.
    let sets = subarrays(&m.lattice().unwrap(), [1, 4]).unwrap();
    let parts = subarray_snapshots(&x, 5, &sets);
    let mirror = [3, 2, 1, 0];
    let truth = eigen(&forward_backward(&covariance(&parts, 4), &mirror)).unwrap().signal(2);
    let mut tracker = BiSvd::new(4, 2, 0.9).unwrap();
    for _ in 0..50 {
        with_backward(&parts, 4, &mirror).chunks(4).for_each(|x| tracker.update(x));
    }
    let angle = principal_angle(&truth, &tracker.basis()).unwrap();
    println!("Bi-SVD and eigenvectors: {angle:.1e} rad apart");
    assert!(angle < 1e-4, "{angle}");
    // A tracker that is fed from outside gives what the estimator's own gives.
    let mut tracker = BiSvd::new(music.elements(1), 2, 0.9).unwrap();
    for _ in 0..50 {
        music.looks(&x).chunks(4).for_each(|x| tracker.update(x));
    }
    let bases = [tracker.basis()];
    let got = sorted(&music.track_cells(&bases, &cell, on_cpu).unwrap()[0]);
    let (own, _) = show(Method::BiSvd { forgetting: 0.9 }, 2);
    assert!(got.iter().zip(&own).all(|(a, b)| (a - b).abs() < 1e-4), "{got:?} {own:?}");
    let spectrum = music.track_spectra(&bases, 1, on_cpu).unwrap();
    assert!(spectrum.len() == 181 && spectrum.iter().any(|s| *s > 1e3));
    let e = music.track_spectra(&[Matrix::identity(5, 2)], 1, on_cpu).unwrap_err().to_string();
    assert_eq!(e, "basis = 5 x 2: the subspace does not fit the array; allowed: 4 x 1 to 4 x 3");
}

#[test]
fn the_number_of_sources_is_found() {
    let m = line(8);
    for (count, at) in [
        (0, vec![]),
        (1, vec![(0.1, 0.0, 30.0)]),
        (2, vec![(0.1, 0.0, 30.0), (-0.3, 0.0, 10.0)]),
        (3, vec![(0.1, 0.0, 30.0), (-0.3, 0.0, 10.0), (0.6, 0.0, 10.0)]),
    ] {
        let (mut mdl, mut aic, mut fb) = (0, 0, 0);
        for trial in 0..100 {
            let x = waves(&m, &at, 1.0, 60, trial);
            let r = covariance(&x, 8);
            let values = eigen(&r).unwrap().values;
            mdl += u32::from(source_number(&values, 60.0, Criterion::Mdl, false) == count);
            aic += u32::from(source_number(&values, 60.0, Criterion::Aic, false) == count);
            let values = eigen(&forward_backward(&r, &m.mirrored().unwrap())).unwrap().values;
            fb += u32::from(source_number(&values, 60.0, Criterion::Mdl, true) == count);
        }
        println!("{count} sources: MDL {mdl}, AIC {aic}, MDL forward-backward {fb} of 100");
        // AIC keeps a chance of about a tenth of one too many, however many looks.
        assert!(mdl >= 99 && fb >= 99 && aic >= 75, "{count}: {mdl} {fb} {aic}");
    }
    let o = Options {
        sources: SourceNumber::Found(Criterion::Mdl),
        smoothing: Smoothing::Off,
        ..options(Method::Music, 1)
    };
    let e = Estimator::new(m.clone(), azimuths(60.0, 121), o).unwrap();
    let two = waves(&m, &[(0.1, 0.0, 30.0), (-0.3, 0.0, 10.0)], 1.0, 60, 5);
    assert_eq!(one_cell(&e, &two, None).unwrap().len(), 2);
    assert!(one_cell(&e, &waves(&m, &[], 1.0, 60, 5), None).unwrap().is_empty());
}

#[test]
fn the_residual_tells_how_many_in_single_snapshots() {
    // On any array, where information criteria have nothing to compare with.
    for (m, name) in [(line(12), "line"), (sparse(), "sparse"), (rectangle(3, 4), "rectangle")] {
        let plane = name == "rectangle";
        let grid = if plane { both(50.0, 25) } else { azimuths(60.0, 181) };
        let el = if plane { 0.2 } else { 0.0 };
        let all = [(0.1, 0.0), (-0.35, el), (0.5, -el)];
        for count in 0..=3 {
            if name == "sparse" && count == 3 {
                continue;
            }
            let mut right = 0;
            let mut data = Vec::new();
            let cells = 40;
            for trial in 0..cells {
                let phase = |i: u32| Complex64::cis(TAU * f64::from(trial * (3 * i + 1)) / 7.0);
                let a: Vec<Vec<Complex64>> =
                    all[..count].iter().map(|(az, el)| m.steering(*az, *el)).collect();
                data.extend((0..m.channels()).map(|c| {
                    let wave: Complex64 =
                        (0..count).map(|i| a[i][c] * phase(i as u32) * (20.0 - 4.0 * i as f64)).sum();
                    wave + normal(trial, 0, c as u32)
                }));
            }
            let noise = vec![1.0; cells as usize];
            for method in [Method::Ml, Method::Music] {
                if method == Method::Music && name == "sparse" {
                    continue;
                }
                let o = Options {
                    sources: SourceNumber::Residual { false_alarm: 1e-3, model_error: 1e-6 },
                    ..options(method, 1)
                };
                let e = Estimator::new(m.clone(), grid.clone(), o).unwrap();
                let all = Cells { snapshots: 1, data: &data, noise_w: Some(&noise) };
                let got = e.estimate_cells(&all, on_cpu).unwrap();
                right = got.iter().filter(|s| s.len() == count).count();
                // At most a few of forty at a false-alarm probability of 1e-3.
                assert!(right >= 38, "{name} {method:?}: {right} of {cells} for {count}");
            }
            println!("{name}, {count} sources: {right} of {cells}");
        }
    }
    let o = Options {
        sources: SourceNumber::Residual { false_alarm: 1e-3, model_error: 0.0 },
        ..options(Method::Ml, 1)
    };
    let e = Estimator::new(line(4), azimuths(60.0, 61), o).unwrap();
    let refused = one_cell(&e, &[Complex64::ONE; 4], None).unwrap_err().to_string();
    assert!(refused.starts_with("noise_w: the number of sources by residual needs"), "{refused}");
    let o = Options { sources: SourceNumber::Residual { false_alarm: 0.0, model_error: 0.0 }, ..o };
    let e = Estimator::new(line(4), azimuths(60.0, 61), o).unwrap_err().to_string();
    assert_eq!(e, "false_alarm = 0: is not a share; allowed: above 0 and below 1");
}

// --- arrays that are not what they should be --------------------------------------------------------

/// `m` with its elements up to a twelfth of a wavelength off their places and its gains off by some dB
/// and half a radian.
fn spoilt(m: &Manifold) -> Manifold {
    let off = |c: usize, k: u32| normal(9, k, c as u32).re.clamp(-1.5, 1.5) * 0.05 * lambda();
    let p = (0..m.channels()).map(|c| m.position_m(c) + DVec3::new(off(c, 0), off(c, 1), 0.0)).collect();
    let gain = |c: u32| Complex64::from_polar((0.2 * normal(9, 2, c).re).exp(), 0.5 * normal(9, 3, c).re);
    Manifold::receivers(p, lambda())
        .unwrap()
        .with_gains((0..m.channels() as u32).map(gain).collect())
        .unwrap()
}

#[test]
fn calibration_takes_the_bias_out() {
    let ideal = line(8);
    let real = spoilt(&ideal);
    // A turntable at 30 dB a channel, 1 deg apart.
    let angles: Vec<f64> = (-70..=70).map(f64::from).collect();
    let turns: Vec<Vec<Complex64>> = angles
        .iter()
        .enumerate()
        .map(|(i, a)| waves(&real, &[(a.to_radians(), 0.0, 1000.0)], 1.0, 4, 5000 + i as u32))
        .collect();
    let o = TurntableOptions { unit_modulus: false, smoothing_deg: 15.0 };
    let c = Calibration::from_turntable(&ideal, angles, vec![0.0], None, &turns, &o).unwrap();
    let calibrated = ideal.clone().with_calibration(&c).unwrap();
    let grid = azimuths(60.0, 121);
    // Mean error of many trials in rad, the worst of some directions.
    let bias = |m: &Manifold, method: Method| {
        let o = Options { smoothing: Smoothing::Off, ..options(method, 1) };
        let e = Estimator::new(m.clone(), grid.clone(), o).unwrap();
        let mut worst = 0.0f64;
        for az in [-0.8, -0.31, 0.02, 0.44, 0.9] {
            let trials = 100;
            let errors: Vec<f64> = (0..trials)
                .map(|t| {
                    let x = waves(&real, &[(az, 0.0, 100.0)], 1.0, 2, t);
                    one_cell(&e, &x, None).unwrap()[0].azimuth_rad - az
                })
                .collect();
            worst = worst.max((errors.iter().sum::<f64>() / f64::from(trials)).abs());
        }
        worst
    };
    let without = bias(&ideal, Method::Ml);
    println!("bias without calibration {:.2} mrad", 1e3 * without);
    for method in [Method::Ml, Method::Capon, Method::Bartlett] {
        let with = bias(&calibrated, method);
        println!("bias of {method:?} with calibration {:.2} mrad", 1e3 * with);
        // The bound for one trial is 3 to 5 mrad: means of a hundred lie within 3 sigma of zero below
        // 1.5.
        assert!(with < 1.5e-3 && without > 5.0 * with, "{method:?} {with} {without}");
    }
    // Two sources, coherent, one snapshot: more than any subspace method takes from such an array.
    let o = options(Method::Ml, 2);
    let e = Estimator::new(calibrated.clone(), grid.clone(), o).unwrap();
    let (a, b) = (real.steering(-0.2, 0.0), real.steering(0.25, 0.0));
    let x: Vec<Complex64> =
        (0..8).map(|i| a[i] * 30.0 + b[i] * Complex64::new(3.0, -20.0) + normal(1, 0, i as u32)).collect();
    let az = sorted(&one_cell(&e, &x, None).unwrap());
    assert!((az[0] + 0.2).abs() < 0.02 && (az[1] - 0.25).abs() < 0.02, "{az:?}");
    // The ambiguity matrix is 1 on its diagonal and symmetric.
    let s = c.ambiguity();
    let n = c.azimuth_deg.len();
    for i in 0..n {
        assert!((s[i * n + i] - 1.0).abs() < 1e-12);
        assert!((0..n).all(|j| (s[i * n + j] - s[j * n + i]).abs() < 1e-12 && s[i * n + j] < 1.0 + 1e-12));
    }
    let e = Estimator::new(calibrated, azimuths(80.0, 11), o).unwrap_err().to_string();
    assert_eq!(
        e,
        "azimuth, elevation = -80.00 deg, 0.00 deg: the calibration does not include this direction of the grid; \
         reduce the field of view, or calibrate over a wider one"
    );
}

#[test]
fn constant_gains_are_taken_out_before_subarrays() {
    let m = line(8);
    let gain: Vec<Complex64> =
        (0..8).map(|c| Complex64::from_polar(1.0 + 0.1 * f64::from(c % 3), f64::from(c * c))).collect();
    let real = m.clone().with_gains(gain).unwrap();
    let (a, b) = (real.steering(-0.15, 0.0), real.steering(0.2, 0.0));
    let x: Vec<Complex64> = a.iter().zip(&b).map(|(a, b)| a + b * Complex64::new(0.3, 0.8)).collect();
    for method in [Method::Music, Method::RootMusic, Method::Esprit] {
        let e = Estimator::new(real.clone(), azimuths(60.0, 241), options(method, 2)).unwrap();
        let s = one_cell(&e, &x, Some(1e-6)).unwrap();
        let az = sorted(&s);
        assert!((az[0] + 0.15).abs() < 1e-5 && (az[1] - 0.2).abs() < 1e-5, "{method:?} {az:?}");
        assert!((s[0].power_w - 1.0).abs() < 1e-3 && (s[1].power_w - 0.73).abs() < 1e-3, "{s:?}");
    }
}

#[test]
fn sparse_arrays_take_maximum_likelihood_and_refuse_the_rest() {
    let (m, grid) = (sparse(), azimuths(60.0, 361));
    let x = waves(&m, &[(0.3, 0.0, 1e4), (0.1, 0.0, 1e4)], 1.0, 1, 3);
    let e = Estimator::new(m.clone(), grid.clone(), options(Method::Ml, 2)).unwrap();
    let az = sorted(&one_cell(&e, &x, None).unwrap());
    assert!((az[0] - 0.1).abs() < 0.01 && (az[1] - 0.3).abs() < 0.01, "{az:?}");
    let message = |o: Options, x: &[Complex64]| match Estimator::new(m.clone(), grid.clone(), o) {
        Ok(e) => one_cell(&e, x, None).unwrap_err().to_string(),
        Err(e) => e.to_string(),
    };
    assert_eq!(
        message(options(Method::Music, 2), &x),
        "snapshots = 1: MUSIC cannot estimate 2 sources from this cell; allowed: 2 or more, because the array gives no \
         subarrays here; give more snapshots, use subarrays of a uniform array, or use maximum likelihood"
    );
    assert_eq!(
        message(options(Method::RootMusic, 2), &x),
        "method: root-MUSIC needs a uniform line and distant sources; use MUSIC or maximum likelihood, which work on any array"
    );
    let o = Options { smoothing: Smoothing::Subarray([1, 4]), ..options(Method::Music, 2) };
    assert!(message(o, &x).starts_with("subarray: the array is not a uniform line or rectangle"));
    let o = Options { forward_backward: Some(true), ..options(Method::Music, 2) };
    assert!(message(o, &x).contains("point-symmetric array"));
    assert_eq!(
        message(options(Method::Music, 6), &x),
        "sources = 6: MUSIC cannot estimate this number of sources with 6 channels; allowed: 1 to 5"
    );
    assert!(message(options(Method::Ml, 0), &x).starts_with("sources = 0"));
    let o = Options { loading: 0.0, ..options(Method::Capon, 1) };
    assert!(message(o, &x).starts_with("loading: Capon cannot invert"));
    let o = Options { loading: -1.0, ..options(Method::Capon, 1) };
    assert!(message(o, &x).starts_with("loading = -1"));
    assert!(message(options(Method::BiSvd { forgetting: 1.0 }, 1), &x).starts_with("forgetting = 1"));
    let mut bad = x.clone();
    bad[4] = Complex64::new(f64::NAN, 0.0);
    assert!(message(options(Method::Ml, 1), &bad).starts_with("cell 0, channel 4"));
    assert!(message(options(Method::Ml, 1), &x[..5]).starts_with("snapshots = 5"));
    let e = Estimator::new(m.clone(), both(40.0, 9), options(Method::Ml, 1)).unwrap_err().to_string();
    assert_eq!(e, "elevation_bins = 9: an array on one line measures one angle only; allowed: 1");
}

#[test]
fn directions_that_look_alike_are_marked() {
    let wide = Manifold::receivers((0..6).map(|i| DVec3::Y * (lambda() * i as f64)).collect(), lambda());
    for (m, marked) in [(wide.unwrap(), true), (line(6), false), (sparse(), false)] {
        for method in [Method::Ml, Method::Music] {
            let o = Options { smoothing: Smoothing::Off, ..options(method, 1) };
            let e = Estimator::new(m.clone(), azimuths(60.0, 181), o).unwrap();
            let s = one_cell(&e, &waves(&m, &[(0.2, 0.0, 1e4)], 1.0, 8, 1), None).unwrap();
            assert_eq!(s[0].ambiguous, marked, "{method:?} {s:?}");
        }
    }
}

#[test]
fn two_directions_that_look_alike_have_finite_powers() {
    let m =
        Manifold::receivers((0..6).map(|i| DVec3::Y * (lambda() * i as f64)).collect(), lambda()).unwrap();
    let o = Options { smoothing: Smoothing::Off, ..options(Method::Music, 2) };
    let e = Estimator::new(m.clone(), azimuths(60.0, 181), o).unwrap();
    // One source, and its grating lobe at sin = sin(0.2) - 1.
    let s = one_cell(&e, &waves(&m, &[(0.2, 0.0, 1e4)], 1.0, 8, 1), None).unwrap();
    assert_eq!(s.len(), 2);
    for (got, sine) in sorted(&s).iter().zip([0.2f64.sin() - 1.0, 0.2f64.sin()]) {
        assert!((got.sin() - sine).abs() < 1e-2, "{s:?}");
    }
    assert!(s.iter().all(|s| s.power_w.is_finite() && s.power_w < 1e5 && s.ambiguous), "{s:?}");
}

#[test]
fn a_line_of_five_takes_four_sources_from_many_snapshots() {
    let m = line(5);
    let at = [-0.6, -0.1, 0.3, 0.8];
    let x = waves(&m, &at.map(|a| (a, 0.0, 1e3)), 1.0, 200, 1);
    let e = Estimator::new(m, azimuths(70.0, 281), options(Method::Music, 4)).unwrap();
    for (got, want) in sorted(&one_cell(&e, &x, None).unwrap()).iter().zip(at) {
        assert!((got - want).abs() < 0.01, "{got} {want}");
    }
    let refused = one_cell(&e, &x[..5], None).unwrap_err().to_string();
    assert!(refused.starts_with("snapshots = 1: MUSIC cannot estimate 4 sources"), "{refused}");
    let o = Options { sources: SourceNumber::Found(Criterion::Mdl), ..options(Method::Ml, 1) };
    let e = Estimator::new(line(5), azimuths(70.0, 281), o).unwrap();
    assert_eq!(
        one_cell(&e, &x[..5], None).unwrap_err().to_string(),
        "snapshots = 1: maximum likelihood cannot estimate 2 sources from this cell; allowed: 2 or more for an \
         information criterion; give the number of sources, or use the residual"
    );
}

#[test]
fn planes_tell_both_angles_with_coherent_sources_too() {
    let m = rectangle(4, 6);
    let at = [(0.25, 0.15), (-0.1, 0.15), (0.25, -0.2)];
    let s = [Complex64::ONE, Complex64::new(0.2, 0.9), Complex64::new(-0.7, 0.3)];
    let a: Vec<Vec<Complex64>> = at.iter().map(|(az, el)| m.steering(*az, *el)).collect();
    // One snapshot: the sources are coherent.
    let x: Vec<Complex64> = (0..24).map(|c| (0..3).map(|i| a[i][c] * s[i]).sum()).collect();
    for method in [Method::Music, Method::Esprit, Method::Ml, Method::BiSvd { forgetting: 0.9 }] {
        let e = Estimator::new(m.clone(), both(45.0, 61), options(method, 3)).unwrap();
        let got = one_cell(&e, &x, Some(1e-8)).unwrap();
        assert_eq!(got.len(), 3, "{method:?}");
        for (i, (az, el)) in at.into_iter().enumerate() {
            let near = |s: &Source| (s.azimuth_rad - az).hypot(s.elevation_rad - el);
            let hit = got.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
            assert!(near(hit) < 1e-4, "{method:?} {got:?}");
            assert!((hit.power_w / s[i].norm_sqr() - 1.0).abs() < 1e-2, "{method:?} {got:?}");
        }
    }
}

#[test]
fn upright_lines_tell_elevation() {
    let m = Manifold::receivers((0..6).map(|i| DVec3::Z * (0.5 * lambda() * i as f64)).collect(), lambda());
    let m = m.unwrap();
    let grid = Grid { azimuth_rad: vec![0.0], elevation_rad: azimuths(50.0, 101).azimuth_rad };
    let x = waves(&m, &[(0.0, 0.3, 1e4)], 1.0, 1, 2);
    for method in GRID_METHODS.into_iter().chain([Method::RootMusic, Method::Esprit]) {
        let e = Estimator::new(m.clone(), grid.clone(), options(method, 1)).unwrap();
        let s = one_cell(&e, &x, Some(1.0)).unwrap();
        assert!((s[0].elevation_rad - 0.3).abs() < 0.02 && s[0].azimuth_rad == 0.0, "{method:?} {s:?}");
        assert!(
            s[0].elevation_std_rad > 1e-4 && s[0].elevation_std_rad < 1e-2 && s[0].azimuth_std_rad == 0.0
        );
    }
}

#[test]
fn silent_cells_have_no_sources_and_no_cells_none() {
    let m = line(6);
    for method in GRID_METHODS.into_iter().chain([Method::RootMusic, Method::Esprit]) {
        let e = Estimator::new(m.clone(), azimuths(60.0, 61), options(method, 1)).unwrap();
        assert!(one_cell(&e, &[Complex64::ZERO; 6], None).unwrap().is_empty(), "{method:?}");
        let none = Cells { snapshots: 1, data: &[], noise_w: None };
        assert!(e.estimate_cells(&none, on_cpu).unwrap().is_empty());
    }
}

// --- engines -----------------------------------------------------------------------------------------

/// Forms of many cells and ranks.
fn forms(channels: usize, cells: usize, rank: usize) -> Forms {
    let data = (0..cells * rank * channels).map(|i| normal(1, 2, i as u32)).collect();
    Forms { cells, rank, channels, data }
}

#[test]
fn the_cpu_engine_is_the_plain_sum() {
    let m = rectangle(2, 3);
    let steering = Steering::new(&m, &both(40.0, 7));
    let f = forms(6, 3, 4);
    let got: Vec<f64> = catseye::dsp::cpu::doa_spectrum::spectra(&steering, &f);
    for cell in 0..3 {
        // a^H B a with B = F F^H spelt out.
        let f = &f.data[cell * 24..(cell + 1) * 24];
        let b = |i: usize, j: usize| (0..4).map(|k| f[k * 6 + i] * f[k * 6 + j].conj()).sum::<Complex64>();
        for d in 0..49 {
            let a = &steering.data[d * 6..(d + 1) * 6];
            let q: Complex64 = (0..36).map(|p| a[p / 6].conj() * b(p / 6, p % 6) * a[p % 6]).sum();
            assert!((got[cell * 49 + d] - q.re).abs() < 1e-12 * 24.0);
        }
    }
}

#[test]
fn gpu_spectra_agree_with_the_cpu() {
    for (m, grid, cells, rank) in [
        (line(12), azimuths(60.0, 64), 100, 9),
        (rectangle(4, 6), both(45.0, 15), 20, 24),
        (line(2), azimuths(10.0, 3), 1, 1),
        (line(192), azimuths(60.0, 33), 5, 2),
    ] {
        let steering = Steering::new(&m, &grid);
        let f = forms(m.channels(), cells, rank);
        let want: Vec<f64> = catseye::dsp::cpu::doa_spectrum::spectra(&steering, &f);
        let got = doa_spectrum::spectra(test_gpu(), &steering, &f).unwrap();
        let d = check_close(&got, &want, doa_spectrum::KERNEL.tolerance.relative_l2).unwrap();
        println!("{} channels, rank {rank}: {:.2e}", m.channels(), d.relative_l2);
    }
    // Pieces of cells change no bit; the steering vectors take 6 KiB, a cell's factor 864 B.
    let steering = Steering::new(&line(12), &azimuths(60.0, 64));
    let f = forms(12, 100, 9);
    let gpu = opened_for_tests().with_poisoned_buffers();
    let pieces = doa_spectrum::spectra(&gpu.with_binding_limit(8 << 10), &steering, &f).unwrap();
    assert_eq!(pieces, doa_spectrum::spectra(test_gpu(), &steering, &f).unwrap());
    let none = Forms { cells: 0, rank: 0, channels: 12, data: vec![] };
    assert!(doa_spectrum::spectra(test_gpu(), &steering, &none).unwrap().is_empty());
}

#[test]
fn estimates_are_the_same_on_both_engines() {
    let m = line(8);
    let cells: u32 = 40;
    let data: Vec<Complex64> = (0..cells)
        .flat_map(|t| waves(&m, &[(0.02 * f64::from(t) - 0.4, 0.0, 1e-9), (0.5, 0.0, 3e-10)], 1e-13, 1, t))
        .collect();
    let noise = vec![1e-13; cells as usize];
    let all = Cells { snapshots: 1, data: &data, noise_w: Some(&noise) };
    for method in GRID_METHODS {
        let e = Estimator::new(m.clone(), azimuths(60.0, 121), options(method, 2)).unwrap();
        let want = e.estimate_cells(&all, on_cpu).unwrap();
        let got = e.estimate_cells(&all, |s, f| doa_spectrum::spectra(test_gpu(), s, f)).unwrap();
        assert_eq!(want.len(), cells as usize);
        for (got, want) in got.iter().zip(&want) {
            assert_eq!(got.len(), want.len(), "{method:?}");
            // The grid only says where to start: places between its points are f64 on both.
            for (g, w) in got.iter().zip(want) {
                assert!((g.azimuth_rad - w.azimuth_rad).abs() < 1e-6, "{method:?} {g:?} {w:?}");
                assert!((g.power_w / w.power_w - 1.0).abs() < 1e-4, "{method:?} {g:?} {w:?}");
            }
        }
        let again = rayon_of(1, || e.estimate_cells(&all, on_cpu).unwrap());
        assert_eq!(again, want, "{method:?}: one thread and many");
    }
}

fn rayon_of<R: Send>(threads: usize, f: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(f)
}

#[test]
fn half_a_turn_of_phase_is_end_fire() {
    // The sign of everything at once: a source at the far left of a line along y.
    let m = line(4);
    let x = m.steering(0.9, 0.0);
    let e = Estimator::new(m, azimuths(80.0, 161), options(Method::Esprit, 1)).unwrap();
    let s = one_cell(&e, &x, Some(1e-3)).unwrap();
    assert!((s[0].azimuth_rad - 0.9).abs() < 1e-9, "{s:?}");
    assert!((x[1].arg() + PI * 0.9f64.sin()).abs() < 1e-12);
}
