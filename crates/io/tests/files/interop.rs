//! Cubes and configurations of others, through files on the disk and the radar TOML.

use catseye::scene::radar::Sampling;
use catseye::scene::radar_toml;
use catseye_io::cube::{CubeAbout, CubeOptions, open_cube, write_cube};
use catseye_io::ti_cfg::{Board, Multiplex, TiRadar};
use num_complex::Complex64;
use std::path::Path;

const CFG: &str = "% xWR1843, two transmitters
flushCfg
dfeDataOutputMode 1
channelCfg 15 5 0
adcCfg 2 1
adcbufCfg -1 0 1 1 1
profileCfg 0 77 25 6 58 0 0 60 1 256 5000 0 0 30
chirpCfg 0 0 0 0 0 0 0 1
chirpCfg 1 1 0 0 0 0 0 4
frameCfg 0 1 64 0 50 1 0
lvdsStreamCfg -1 0 1 0
";

#[test]
fn a_configuration_becomes_a_radar() {
    let ti = TiRadar::parse("a.cfg", CFG).unwrap();
    let text = ti.to_radar_toml("board \"a\"", Some(Board::Line)).unwrap();
    let r = radar_toml::parse(Path::new("a.toml"), &text).unwrap();
    // 77 GHz + 60 MHz/us * 58 us / 2.
    assert_eq!((r.carrier_hz, r.bandwidth_hz()), (78.74e9, 3.48e9));
    assert_eq!(r.start_hz(), 77e9);
    assert!((r.slope_hz_per_s() / 60e12 - 1.0).abs() < 1e-14);
    assert_eq!((r.waveform.ramp().unwrap().time_s, r.chirp_period_s(), r.adc_start_s), (58e-6, 83e-6, 6e-6));
    assert_eq!((r.samples, r.sample_rate_hz, r.chirps), (256, 5e6, 64));
    assert_eq!((r.sampling, r.tx.len(), r.rx.len(), r.tx_power_dbm), (Sampling::Iq, 2, 4, 12.0));
    assert_eq!([r.chirps, r.channels(), r.samples], ti.shape());
    // A filled line of eight: neighbours half a wavelength apart, to the left.
    let half = 0.5 * r.wavelength_m();
    for (c, (t, x)) in r.tx.iter().flat_map(|t| r.rx.iter().map(move |x| (t, x))).enumerate() {
        assert!((t.position_m + x.position_m).distance(glam::DVec3::Y * (c as f64 * half)) < 1e-12);
    }

    // Real samples, less power, a sub-band in which the board's spacing is not half a wavelength.
    let isk = CFG
        .replace("adcCfg 2 1", "adcCfg 2 0")
        .replace("adcbufCfg -1 0", "adcbufCfg -1 1")
        .replace("0 77 25 6 58 0", "0 60 25 6 58 394758")
        .replace("channelCfg 15 5", "channelCfg 15 7")
        .replace("frameCfg 0 1", "chirpCfg 2 2 0 0 0 0 0 2\nframeCfg 0 2");
    let ti = TiRadar::parse("a.cfg", &isk).unwrap();
    let r = radar_toml::parse(Path::new("a.toml"), &ti.to_radar_toml("isk", Some(Board::Iwr6843)).unwrap())
        .unwrap();
    assert_eq!((r.sampling, r.tx_power_dbm), (Sampling::Real, 6.0));
    let d = 0.5 * 299_792_458.0 / 62e9;
    for (a, b) in [
        (r.rx[3].position_m - r.rx[2].position_m, [0.0, d, 0.0]),
        // In the order of sending: TX1, TX3, TX2.
        (r.tx[1].position_m - r.tx[0].position_m, [0.0, 4.0 * d, 0.0]),
        (r.tx[2].position_m - r.tx[0].position_m, [0.0, 2.0 * d, d]),
    ] {
        assert!(a.distance(glam::DVec3::from(b)) < 1e-12, "{a}");
    }

    // Other boards: masks, antennas on the package, and one that is not there.
    let places = |cfg: &str, board: Board| {
        let ti = TiRadar::parse("a.cfg", cfg).unwrap();
        let r = radar_toml::parse(Path::new("a.toml"), &ti.to_radar_toml("x", Some(board))?).unwrap();
        let half = 0.5 * r.wavelength_m();
        let of = |list: &[catseye::scene::radar::Antenna]| -> Vec<[i32; 2]> {
            let at = |a: &catseye::scene::radar::Antenna| (a.position_m - list[0].position_m) / half;
            list.iter().map(|a| [at(a).y.round() as i32, at(a).z.round() as i32]).collect()
        };
        Ok::<_, catseye::base::error::Error>([of(&r.tx), of(&r.rx)])
    };
    let second = |tx: u32| {
        CFG.replace("channelCfg 15 5", "channelCfg 15 7").replace("0 0 0 0 0 4", &format!("0 0 0 0 0 {tx}"))
    };
    let row = vec![[0, 0], [1, 0], [2, 0], [3, 0]];
    assert_eq!(places(CFG, Board::Awr1843).unwrap(), [vec![[0, 0], [4, 0]], row.clone()]);
    assert_eq!(places(&second(2), Board::Awr1843).unwrap(), [vec![[0, 0], [2, 1]], row]);
    // RX2 and RX4 alone, TX2 before TX1.
    let masked =
        second(1).replace("channelCfg 15", "channelCfg 10").replacen("0 0 0 0 0 1", "0 0 0 0 0 2", 1);
    assert_eq!(places(&masked, Board::Awr1843).unwrap(), [vec![[0, 0], [-2, -1]], vec![[0, 0], [2, 0]]]);
    let package = places(&second(4), Board::Iwr6843Aop).unwrap();
    assert_eq!(package, [vec![[0, 0], [0, -2]], vec![[0, 0], [0, 1], [-1, 0], [-1, 1]]]);
    // A fourth transmitter, which no board here has.
    let fourth = CFG.replace("channelCfg 15 5", "channelCfg 15 9").replace("0 0 0 0 0 4", "0 0 0 0 0 8");
    let e = places(&fourth, Board::Awr1843).unwrap_err();
    assert!(e.to_string().contains("awr1843 has no TX4") && e.exit_code() == 2, "{e}");

    // What the TOML has no words for is refused.
    let falling = TiRadar { slope_hz_per_s: -60e12, ..ti.clone() };
    let together = TiRadar { multiplex: Multiplex::Together, ..ti };
    for (radar, expect) in [(falling, "the ramp falls"), (together, "transmit simultaneously")] {
        let e = radar.to_radar_toml("x", Some(Board::Line)).unwrap_err();
        assert!(e.to_string().contains(expect) && e.exit_code() == 2, "{e}");
    }
}

#[test]
fn a_recording_keeps_a_target_in_its_cell() {
    // A beat of 20 cycles over the samples and 5 over the chirps, in every layout of the words.
    let dir = tempfile::tempdir().unwrap();
    for (i, cfg) in [
        CFG.to_string(),
        CFG.replace("adcbufCfg -1 0 1 1", "adcbufCfg -1 0 0 1"),
        CFG.replace("adcbufCfg -1 0 1 1", "adcbufCfg -1 0 0 0"),
    ]
    .iter()
    .enumerate()
    {
        let ti = TiRadar::parse("a.cfg", cfg).unwrap();
        let [chirps, channels, samples] = ti.shape();
        let turn = |x: f64| Complex64::from_polar(1e-5, std::f64::consts::TAU * x);
        let tone = |m: usize, c: usize, n: usize| {
            turn(20.0 * n as f64 / samples as f64 + 5.0 * m as f64 / chirps as f64 + 0.125 * c as f64)
        };
        let mut cube = Vec::new();
        for m in 0..chirps {
            for c in 0..channels {
                cube.extend((0..samples).map(|n| tone(m, c, n)));
            }
        }
        let path = dir.path().join(format!("{i}.bin"));
        let about = CubeAbout { ti_radar: Some(ti.clone()), ..Default::default() };
        write_cube(&path, ti.shape(), &cube, &about, false).unwrap();
        let mut source = open_cube(&path, &CubeOptions::default(), Some(ti.shape())).unwrap();
        let back: Vec<Complex64> = source.channels(0, 3..6).unwrap();
        // Matched sum: a conjugate or a swap of axes would leave nothing.
        for c in 3..6 {
            let mut sum = Complex64::default();
            for m in 0..chirps {
                for n in 0..samples {
                    sum += back[(m * 3 + c - 3) * samples + n] * tone(m, c, n).conj();
                }
            }
            let mean = sum / (chirps * samples) as f64 / 1e-10;
            assert!((mean - 1.0).norm() < 1e-5, "{mean}");
        }
    }
}

#[cfg(feature = "hdf5")]
#[test]
fn what_h5py_writes_is_read() {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/data/hdf5/cube_h5py.h5");
    let cube = |scale: [f64; 2]| -> Vec<Complex64> {
        (0..30)
            .map(|i| {
                let (chirp, rx, sample) = ((i / 10) as f64, (i / 5 % 2) as f64, (i % 5) as f64);
                let re = (1000.0 * chirp + 100.0 * rx + sample) / 8.0;
                Complex64::new(scale[0] * re, -scale[1] * (chirp - rx + 10.0 * sample) / 16.0)
            })
            .collect()
    };
    for (dataset, axes, scale) in [
        ("complex64", None, [1.0, 1.0]),
        ("complex128", None, [1.0, 1.0]),
        ("big_endian", None, [1.0, 1.0]),
        ("group/i,group/q", None, [8.0, 16.0]),
        ("iq_last", None, [8.0, 16.0]),
        ("sample_first", Some("sample,chirp,rx"), [1.0, 1.0]),
    ] {
        let options = CubeOptions {
            dataset: Some(dataset.into()),
            axes: axes.map(|a| catseye_io::cube_layout::axes_from(a).unwrap()),
            ..Default::default()
        };
        let mut source = open_cube(&path, &options, Some([3, 2, 5])).unwrap();
        assert!(source.is_complex());
        assert_eq!(source.frame::<f64>(0).unwrap(), cube(scale), "{dataset}");
        let one: Vec<Complex64> = source.channels(0, 1..2).unwrap();
        assert_eq!(one[5..10], cube(scale)[15..20], "{dataset}");
    }
    let e = open_cube(&path, &CubeOptions::default(), None).err().unwrap().to_string();
    assert!(
        e.contains("the file has 5 datasets, and none is known to be the cube") && e.contains("complex64"),
        "{e}"
    );
}

/// A radar that is named for a recording must be the one of its `.cfg`: a slope of twice the value would put 12 m at 6 m.
#[test]
fn a_radar_that_the_configuration_contradicts_is_refused() {
    let ti = TiRadar::parse("a.cfg", CFG).unwrap();
    let own = ti.to_radar_toml("own", Some(Board::Awr1843)).unwrap();
    let check = |text: &str| {
        let radar = radar_toml::parse(Path::new("b.toml"), text).unwrap();
        ti.check_agrees(Path::new("a.cfg"), &radar)
    };
    check(&own).unwrap();
    for (key, value, expect) in [
        ("bandwidth_hz", "1.74e9", "another slope"),
        ("sample_rate_hz", "10e6", "another sample rate"),
        ("chirp_period_s", "90e-6", "another chirp period"),
        ("carrier_hz", "79e9", "another start frequency"),
        ("adc_start_s", "1e-6", "at another time"),
    ] {
        let line = |l: &str| if l.starts_with(key) { format!("{key} = {value}") } else { l.to_string() };
        let changed: Vec<String> = own.lines().map(line).collect();
        let e = check(&changed.join("\n")).unwrap_err();
        let text = e.to_string();
        assert!(
            text.contains(expect) && text.contains("--radar") && text.contains("as in the .cfg"),
            "{text}"
        );
        assert_eq!((e.exit_code(), text.lines().count()), (2, 1));
    }
}
