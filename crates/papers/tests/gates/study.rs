//! Studies from file to report: closed forms, mistakes in files, resuming, the ready studies.

use catseye::base::units::dbsm_from_amplitude;
use catseye::engine::solver::Solver;
use catseye::engine::sweep::{Accuracy, Sweep};
use catseye::engine::{Engine, EngineReport, Precision, Purpose, Tracing};
use catseye::rcs::{Aspect, BistaticAspect, Distance, Ground, RcsOptions, Scattering};
use catseye::road::reflector::Reflector;
use catseye::scene::{Scene, material};
use catseye_papers::study::file;
use catseye_papers::study::outcome::{Outcome, compute};
use catseye_papers::study::report::StudyResult;
use catseye_papers::study::run::{self, RunOptions};
use catseye_papers::study::search::{Design, best};
use catseye_papers::study::spec::{Goal, Study};
use num_complex::Complex64;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

const LAMBDA: f64 = 299_792_458.0 / 77e9;

fn parse(text: &str) -> catseye::Result<Study> {
    file::parse(Path::new("s.toml"), text, false)
}

fn outcome(text: &str) -> Outcome {
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    compute(&engine, &parse(text).unwrap(), None, &|_, _| {}).unwrap()
}

fn complaint(text: &str) -> String {
    let e = parse(text).unwrap_err();
    assert_eq!(e.exit_code(), 2, "{e}");
    let e = e.to_string();
    assert!(!e.contains('\n'), "{e}");
    e
}

const DETECTION: &str = "[detection]\nradar = \"feng77\"\nmethod = \"measured\"\nreference_rcs_dbsm = 14.4\n\
                         reference_db = [[1, 0], [10, -40], [100, -80]]\nnoise_db = -60\n";

/// Physical optics of a square plate in the plane of incidence: 4 pi A^2/lambda^2 cos^2 sinc^2(k a sin).
fn plate_dbsm(side: f64, angle: f64) -> f64 {
    let x = 2.0 * PI / LAMBDA * side * angle.sin();
    let sinc = if x == 0.0 { 1.0 } else { x.sin() / x };
    10.0 * (4.0 * PI * (side * side / LAMBDA * sinc * angle.cos()).powi(2)).log10()
}

#[test]
fn a_plate_against_angle_and_size() {
    let o = outcome(
        "name = \"plate\"\ntitle = \"\"\n[set]\ntarget = \"plate:width_m=0.02,height_m=0.02\"\n\
         [[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [0, 2, 7]\n\
         [[sweep]]\nparameter = \"target.width_m\"\nvalues = [0.02, 0.03]\n",
    );
    assert_eq!(o.shape(), [3, 2]);
    for (i, angle) in [0.0f64, 2.0, 7.0].into_iter().enumerate() {
        let square = plate_dbsm(0.02, angle.to_radians());
        assert!((o.fields[0].values[2 * i] - square).abs() < 0.05, "{angle}");
    }
    // Half as wide again at normal incidence: 20 lg 1.5.
    assert!((o.fields[0].values[1] - o.fields[0].values[0] - 20.0 * 1.5f64.log10()).abs() < 0.01);
}

#[test]
fn a_point_on_the_road_is_detected_where_hand_calculation_says() {
    // Reference 14.4 dBsm with 40 dB a decade; floor -60 + 10. On the axis sigma_min = 14.4 + 40 lg R - 50, so a
    // point of -10 dBsm is seen up to 40 lg R = 25.6.
    let text = format!(
        "name = \"p\"\ntitle = \"\"\nquantities = [\"margin_db\"]\n\
         [set]\ntarget = \"point:rcs_dbsm=-10\"\nradar_height_m = 0\nlateral_m = 0\nsnr_db = 10\n\
         [[sweep]]\nparameter = \"radar_azimuth_deg\"\nvalues = [0, 40]\n\
         [[sweep]]\nparameter = \"longitudinal_m\"\nstart = 1\nstop = 12\nstep = 0.01\nreduce = \"detection-range\"\n{DETECTION}"
    );
    let o = outcome(&text);
    assert_eq!(o.fields[0].name, "detection_range_m");
    let expected = 10f64.powf(25.6 / 40.0);
    assert!((o.fields[0].values[0] - expected).abs() < 1e-3, "{} {expected}", o.fields[0].values[0]);
    // 40 deg off: cos^1.6 once on transmit and once on receive.
    let gain = 20.0 * 1.6 * 40f64.to_radians().cos().log10();
    let expected = 10f64.powf((25.6 + gain) / 40.0);
    assert!((o.fields[0].values[1] - expected).abs() < 1e-3, "{} {expected}", o.fields[0].values[1]);
    // A tighter ratio by 10 dB shortens the range by a quarter decade.
    let strict = outcome(&text.replace("snr_db = 10", "snr_db = 20"));
    assert!((strict.fields[0].values[0] - 10f64.powf(15.6 / 40.0)).abs() < 1e-3);
}

/// The ground stays at the road: a point over a conductor has the two rays of its own height and the radar's, and the very
/// numbers of a cross section whose angles are seen from the point's foot.
#[test]
fn a_marker_stands_over_the_ground_and_not_with_it() {
    let study = |longitudinal: &str, height: &str, ground: &str, polarisation: &str| {
        outcome(&format!(
            "name = \"p\"\ntitle = \"\"\n[set]\ntarget = \"point:rcs_dbsm=10\"\nradar_height_m = 0.5\n\
             ground = \"{ground}\"\npolarisation = \"{polarisation}\"\n\
             [[sweep]]\nparameter = \"longitudinal_m\"\nvalues = [{longitudinal}]\n\
             [[sweep]]\nparameter = \"marker_height_m\"\nvalues = [{height}]\n"
        ))
        .fields[0]
            .values
            .clone()
    };
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let point = Reflector::parse("point:rcs_dbsm=10").unwrap().to_scene(&material::by_name).unwrap();
    for (i, polarisation) in ["vv", "hh"].into_iter().enumerate() {
        let found = study("20, 40, 77", "0.3", "pec", polarisation);
        for (d, ours) in [20.0f64, 40.0, 77.0].into_iter().zip(found) {
            // The reflected way against the straight one, and the image turns H about.
            let ways = [d.hypot(0.5 - 0.3), d.hypot(0.5 + 0.3)];
            let turned = if i == 0 { 1.0 } else { -1.0 };
            let two = Complex64::ONE
                + turned * ways[0] / ways[1]
                    * Complex64::from_polar(1.0, -2.0 * PI / LAMBDA * (ways[1] - ways[0]));
            let expected = 10.0 + 40.0 * two.norm().log10();
            // Near a null the amplitudes of the two ways count to their last digit.
            assert!(
                (ours - expected).abs() < 0.05 || (ours < -40.0 && expected < -40.0),
                "{d}: {ours} {expected}"
            );
            let options = RcsOptions {
                distance: Distance::At(d.hypot(0.5)),
                ground: Ground::Plane(material::by_name("pec").unwrap()),
                height_m: 0.3,
                last: false,
                ..Default::default()
            };
            let aspect = Aspect { azimuth: 0.0, elevation: 0.5f64.atan2(d) };
            let s = engine.rcs(&point, &[77e9], &[BistaticAspect::monostatic(aspect)], &options).unwrap()[0];
            let level = dbsm_from_amplitude(s.every[i][i].norm());
            assert!((level - ours).abs() < 1e-6 || level < -90.0, "{d}: {level} {ours}");
        }
    }
    // As high as the radar and higher; without a ground a point is as strong as it is, however high.
    assert!(study("10", "0.5, 0.6, 3", "pec", "vv").iter().all(|x| x.is_finite()));
    for level in study("10", "0.5, 0.6, 5", "none", "vv") {
        assert!((level - 10.0).abs() < 1e-9, "{level}");
    }
    // Without a road, angles and range are seen from the foot as well, and the plane stays under the marker.
    let direct = outcome(
        "name = \"p\"\ntitle = \"\"\n[set]\ntarget = \"point:rcs_dbsm=10\"\nground = \"pec\"\nmarker_height_m = 0.3\n\
         elevation_deg = 0.7161599454704085\n[[sweep]]\nparameter = \"range_m\"\nvalues = [40.00312487793922]\n",
    );
    assert!((direct.fields[0].values[0] - study("40", "0.3", "pec", "vv")[0]).abs() < 1e-6);
}

/// A study and a sweep take any solver in place of an engine.
#[test]
fn another_solver_takes_the_place_of_an_engine() {
    /// Whatever is seen from wherever has two square metres.
    struct TwoSquareMetres;
    impl Solver for TwoSquareMetres {
        fn report(&self) -> EngineReport {
            EngineReport {
                engine: "constant",
                precision: Precision::F64,
                adapter: "constant".into(),
                driver: String::new(),
                driver_info: String::new(),
                trace: Tracing::Host,
            }
        }
        fn scattering(
            &self,
            _: &Scene,
            frequencies_hz: &[f64],
            aspects: &[BistaticAspect],
            _: &RcsOptions,
            watch: &(dyn Fn(u64) + Sync),
        ) -> catseye::Result<Vec<Scattering>> {
            watch(aspects.len() as u64);
            let s = Complex64::from((2.0 / (4.0 * PI)).sqrt());
            let every = [[s, Complex64::ZERO], [Complex64::ZERO, s]];
            Ok(vec![Scattering { every, last: every }; frequencies_hz.len() * aspects.len()])
        }
    }
    let study = "name = \"p\"\ntitle = \"\"\n[set]\ntarget = \"plate\"\n[[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [0, 2, 7]\n";
    let table = compute(&TwoSquareMetres, &parse(study).unwrap(), None, &|_, _| {}).unwrap();
    let two_dbsm = 10.0 * 2.0f64.log10();
    assert_eq!(table.fields[0].values.len(), 3);
    assert!(table.fields[0].values.iter().all(|v| (v - two_dbsm).abs() < 1e-9));

    let sweep = Sweep {
        frequencies_hz: vec![24e9, 77e9],
        transmit: vec![Aspect { azimuth: 0.1, elevation: 0.0 }],
        receive: None,
        options: RcsOptions::default(),
    };
    let plate = Reflector::parse("plate").unwrap().to_scene(&material::by_name).unwrap();
    let done = AtomicU64::new(0);
    let mut said = Vec::new();
    let found = sweep
        .take(&TwoSquareMetres, &plate, &mut |w| said.push(w.to_string()), &|n| {
            done.fetch_add(n, Ordering::Relaxed);
        })
        .unwrap();
    assert_eq!((found.scattering.len(), done.into_inner(), found.accuracy), (2, 1, Accuracy::Unknown));
    assert!(said.is_empty(), "physical optics speaks for another method: {said:?}");
}

#[test]
fn of_several_radars_the_best_one_counts() {
    let text = format!(
        "name = \"m\"\ntitle = \"\"\nquantities = [\"sigma_min_dbsm\"]\n\
         [set]\nradar_height_m = 0\nsnr_db = 10\nlongitudinal_m = 10\n\
         [[sweep]]\nparameter = \"lateral_m\"\nvalues = [-10, 0, 10]\n{DETECTION}"
    );
    let one = outcome(&text);
    let three =
        outcome(&format!("{text}[[mount]]\n[[mount]]\nazimuth_deg = 45\n[[mount]]\nazimuth_deg = -45\n"));
    let gain = -20.0 * 1.6 * 45f64.to_radians().cos().log10();
    for i in [0, 2] {
        assert!((one.fields[0].values[i] - three.fields[0].values[i] - gain).abs() < 1e-9);
    }
    assert_eq!(one.fields[0].values[1], three.fields[0].values[1]);
}

#[test]
fn balls_follow_count_and_shadow() {
    let text = "name = \"b\"\ntitle = \"\"\nquantities = [\"rcs_dbsm\", \"ball_rcs_dbsm\", \"ball_count\"]\n\
                [set]\ntarget = \"balls\"\nball_radius_m = 0.0062\nmarking_width_m = 0.15\nmarking_length_m = 2\nrange_m = 20\n\
                [[sweep]]\nparameter = \"elevation_deg\"\nvalues = [1, 30]\n\
                [[sweep]]\nparameter = \"ball_model\"\nvalues = [\"all\", \"lit\"]\n";
    let o = outcome(text);
    let [total, one, count] = [0, 1, 2].map(|i| &o.fields[i].values);
    assert!((count[0] - 0.3 / 0.0124f64.powi(2)).abs() < 1e-9);
    assert!((total[0] - one[0] - 10.0 * count[0].log10()).abs() < 1e-9);
    // Optical region: pi r^2 within the ripple of the series.
    assert!((one[0] - 10.0 * (PI * 0.0062f64.powi(2)).log10()).abs() < 0.5);
    assert!((total[3] - total[2] - 10.0 * 0.5f64.log10()).abs() < 1e-9);
}

#[test]
fn mistakes_are_one_line_with_the_remedy() {
    let ok = "name = \"x\"\ntitle = \"t\"\n[set]\ntarget = \"type1\"\n[[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [0, 1]\n";
    assert!(parse(ok).is_ok());
    let search = "[search]\ngoal = \"coverage\"\nfront = \"target.height_m\"\nfront_values = [1]\n";
    for (text, expect) in [
        (ok.replace("title", "titel"), "s.toml:2: titel: unknown key"),
        (ok.replace("title", "titel"), "did you mean 'title'?"),
        (ok.replace("\"x\"", "\"../x\""), "s.toml:1: name = \"../x\": is not a valid file name"),
        (
            ok.replace("parameter = \"azimuth_deg\"", "parameter = \"azimut_deg\""),
            "did you mean 'azimuth_deg'?",
        ),
        (ok.replace("azimuth_deg", "target.hieght_m"), "did you mean 'height_m'?"),
        (
            ok.replace("[0, 1]", "[0, 400]"),
            "s.toml:7: sweep[0].values = [0, 400]: is out of range; allowed: -360..=360",
        ),
        (ok.replace("[0, 1]", "[\"a\"]"), "must be a number"),
        (ok.replace("[0, 1]", "[0, [1]]"), "a number or a word"),
        (ok.replace("values = [0, 1]", "start = 0\nstop = 1"), "the sweep has no values"),
        (ok.replace("values = [0, 1]", "start = 0\nstop = 1\nstep = -1"), "does not lead from start to stop"),
        (ok.replace("values = [0, 1]", "start = 0\nstop = 1\nstep = 1e-9"), "too many"),
        (ok.replace("[set]", "[set]\nradar_height_m = 1"), "radar_height_m needs a road"),
        (ok.replace("[set]", "[set]\nlateral_m = 1\nradar_height_m = 1"), "describe two kinds of position"),
        (ok.replace("[set]", "[set]\nazimuth_deg = 1"), "is set and swept"),
        (ok.replace("[set]", "[set]\nground = \"asfalt\""), "did you mean 'asphalt'?"),
        (ok.replace("[set]", "[set]\npolarisation = \"v\""), "is not one of the choices"),
        (ok.replace("\"type1\"", "\"type0\""), "unknown kind of reflector"),
        (ok.replace("\"type1\"", "\"x.glb\""), "no such file"),
        (ok.replace("[set]", "quantities = [\"rcs_dbms\"]\n[set]"), "did you mean 'rcs_dbsm'?"),
        (ok.replace("[set]", "quantities = [\"margin_db\"]\n[set]"), "detection: is missing"),
        (format!("{ok}[solver]\nbounces = 99\n"), "s.toml:9: solver.bounces = 99: is out of range"),
        (format!("{ok}[picture]\nkind = \"map\"\n"), "a map has two axes"),
        (format!("{ok}{DETECTION}"), "set.snr_db: is missing"),
        (format!("{ok}{DETECTION}").replace("\"feng77\"", "\"feng78\""), "did you mean 'feng77'?"),
        (format!("{ok}[[fact]]\ntext = \"f\"\nof = \"value\"\n"), "a value needs a single point"),
        (
            format!("{ok}[[fact]]\ntext = \"f\"\nof = \"value\"\nat = {{ azimuth_deg = 3 }}\n"),
            "has no such value",
        ),
        (
            format!("{ok}[[fact]]\ntext = \"f\"\nof = \"value\"\nat = {{ elevation_deg = 3 }}\n"),
            "is not an axis",
        ),
        (format!("{ok}[[fact]]\ntext = \"f\"\nof = \"medium\"\n"), "is not one of the choices"),
        (format!("{ok}[[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [1]\n"), "is swept twice"),
        (format!("{ok}{search}parameter = []\n"), "search.parameter = []: has 0 elements; allowed: 1 to 8"),
        (
            format!("{ok}{search}parameter = [{{ name = \"target.width_m\", min = 0.1, max = 0.2 }}]\n"),
            "[detection]",
        ),
    ] {
        let e = complaint(&text);
        assert!(e.contains(expect), "{text}\n gave {e}\n not {expect}");
    }
}

fn nothing(_: &Study, _: &StudyResult) -> catseye::Result<Vec<u8>> {
    Ok(b"picture".to_vec())
}

#[test]
fn an_interrupted_run_goes_on_and_leaves_the_same_bytes() {
    let t = tempfile::tempdir().unwrap();
    // Finite ranges: one call for each point, so that several parts are kept.
    let text = "name = \"r\"\ntitle = \"\"\n[set]\ntarget = \"plate:width_m=0.004,height_m=0.004\"\nradar_height_m = 0.5\nlateral_m = 0\n\
                [[sweep]]\nparameter = \"longitudinal_m\"\nstart = 1\nstop = 400\nstep = 1\n";
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let done = AtomicU64::new(0);
    let stop_at = AtomicU64::new(u64::MAX);
    let run_it = |out: &Path| {
        done.store(0, Ordering::Relaxed);
        let picture = |s: &Study, g: &StudyResult| match stop_at.load(Ordering::Relaxed) {
            u64::MAX => nothing(s, g),
            _ => Err(catseye::Error::Failed("interrupted".into())),
        };
        run::run(
            &engine,
            vec![("s.toml".into(), parse(text))],
            out,
            &RunOptions {
                force: false,
                picture: &picture,
                rule: None,
                progress: &|_, n, _| {
                    done.fetch_add(n, Ordering::Relaxed);
                },
            },
        )
    };
    let whole = t.path().join("whole");
    run_it(&whole).unwrap();
    let broken = t.path().join("broken");
    stop_at.store(0, Ordering::Relaxed);
    assert!(run_it(&broken).unwrap_err().to_string().contains("interrupted"));
    assert!(!broken.exists());
    // One part of the finished work is lost, the others are found again.
    let cache = t.path().join(".broken.unfinished/notes");
    let parts: Vec<_> = std::fs::read_dir(&cache).unwrap().map(|e| e.unwrap().path()).collect();
    assert!(parts.len() >= 3, "{}", parts.len());
    std::fs::write(&parts[0], b"cut off").unwrap();
    stop_at.store(u64::MAX, Ordering::Relaxed);
    run_it(&broken).unwrap();
    assert_eq!(done.load(Ordering::Relaxed), 400);
    for name in ["r.csv", "r.png", "REPORT.md", "manifest.json"] {
        let bytes = |d: &Path| std::fs::read(d.join(name)).unwrap();
        assert!(bytes(&whole) == bytes(&broken), "{name}");
    }
    assert!(!t.path().join(".broken.unfinished").exists());
    // Without --force nothing is replaced.
    assert_eq!(run_it(&whole).unwrap_err().exit_code(), 2);
}

#[test]
fn one_study_that_cannot_run_does_not_stop_the_others() {
    let t = tempfile::tempdir().unwrap();
    let write = |name: &str, target: &str| {
        std::fs::write(
            t.path().join(name),
            format!(
                "name = \"{}\"\ntitle = \"t\"\n[set]\ntarget = \"{target}\"\n[[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [0, 1]\n\
                 [[fact]]\ntext = \"peak\"\ndocument = -10\nunit = \"dBsm\"\nof = \"maximum\"\nwhy = \"because\"\n",
                name.trim_end_matches(".toml")
            ),
        )
        .unwrap();
    };
    write("a.toml", "plate:width_m=0.02,height_m=0.02");
    write("b.toml", "type99");
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let files = run::files(t.path()).unwrap();
    let studies = run::load_all(&files, true).unwrap();
    let out = t.path().join("out");
    let options = RunOptions { force: false, picture: &nothing, rule: None, progress: &|_, _, _| {} };
    let report = run::run(&engine, studies, &out, &options).unwrap();
    assert_eq!(report.failed.unwrap().exit_code(), 2);
    assert!(report.studies[0].error.is_none());
    assert!(report.studies[1].error.as_ref().unwrap().contains("type99"));
    let text = std::fs::read_to_string(out.join("REPORT.md")).unwrap();
    assert!(text.contains("| peak | −10.0 dBsm | −8.77 dBsm | 1.23 dBsm | because |"), "{text}");
    assert!(text.contains("Did not run") && out.join("a.csv").exists() && !out.join("b.csv").exists());
    // Two of one name would write one file.
    std::fs::copy(t.path().join("a.toml"), t.path().join("c.toml")).unwrap();
    let e = run::load_all(&run::files(t.path()).unwrap(), true).unwrap_err();
    assert!(e.to_string().contains("has the same name"), "{e}");
}

#[test]
fn the_search_finds_the_known_best_plate() {
    // The least cross section over 0 and 6 deg: a wide plate is strong ahead and has a null at lambda/(2 sin 6 deg)
    // = 18.6 mm; the best width lies where the two directions balance before it.
    let text = "name = \"s\"\ntitle = \"\"\n[set]\ntarget = \"plate\"\n[[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [0, 6]\n\
                [search]\ngoal = \"least-rcs\"\nfront = \"target.height_m\"\nfront_values = [0.01, 0.02]\nstarts = 3\nsteps = 30\n\
                [[search.parameter]]\nname = \"target.width_m\"\nmin = 0.002\nmax = 0.018\n";
    let study = parse(text).unwrap();
    let search = study.search.as_ref().unwrap();
    assert_eq!(search.goal, Goal::LeastRcs);
    let engine = Engine::open("cpu", Precision::F32).unwrap();
    let level = |w: f64, h: f64| {
        let at = |a: f64| {
            let x = 2.0 * PI / LAMBDA * w * a.sin();
            let sinc = if x == 0.0 { 1.0 } else { x.sin() / x };
            10.0 * (4.0 * PI * (w * h / LAMBDA * sinc * a.cos()).powi(2)).log10()
        };
        at(0.0).min(at(6f64.to_radians()))
    };
    for (i, &h) in search.front_values.value.iter().enumerate() {
        let known =
            (0..=1600).map(|k| level(0.002 + 1e-5 * f64::from(k), h)).fold(f64::NEG_INFINITY, f64::max);
        let found = best(&engine, &study, search, h, i as u32).unwrap();
        assert!((found.worth - known).abs() < 0.1, "{found:?} {known}");
        assert_eq!(found, best(&engine, &study, search, h, i as u32).unwrap());
    }
}

#[test]
fn a_search_says_where_its_sweep_ended_before_the_range() {
    let found = |stop_m: f64| {
        let text = format!(
            r#"
            name = "s"
            title = ""
            quantities = ["margin_db"]
            [set]
            radar_height_m = 0.15
            snr_db = 10
            target = "type1:width_m=0.16,length_m=0.117"
            [[sweep]]
            parameter = "longitudinal_m"
            start = 5
            stop = {stop_m}
            step = 0.5
            [detection]
            radar = "feng77"
            method = "measured"
            reference_rcs_dbsm = 14.4
            reference_rise_m = 0.2
            peaks_fit = [1.62, 14.8]
            troughs_fit = [4.18, 21.06]
            noise_db = -107.14
            [search]
            goal = "detection-range"
            front = "target.height_m"
            front_values = [0.005]
            starts = 1
            steps = 3
            [[search.parameter]]
            name = "target.width_m"
            min = 0.12
            max = 0.16
            "#
        );
        let study = parse(&text).unwrap();
        let engine = Engine::open("cpu", Precision::F32).unwrap();
        best(&engine, &study, study.search.as_ref().unwrap(), 0.005, 0).unwrap()
    };
    let ended =
        |d: &Design| d.limits.iter().filter(|l| l.contains("the end of the sweep of longitudinal_m")).count();
    let (short, long) = (found(20.0), found(80.0));
    assert!(short.worth == 20.0 && ended(&short) == 1, "{short:?}");
    assert!((20.5..80.0).contains(&long.worth) && ended(&long) == 0, "{long:?}");
}

#[test]
fn the_template_and_the_ready_studies_can_be_read() {
    let template = catseye::scene::scenario::template("study").unwrap();
    let study = parse(template).unwrap();
    assert_eq!((study.name.as_str(), study.points()), ("my-study", 182));
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/studies");
    let files = run::files(&folder).unwrap();
    assert!(files.len() >= 25, "{}", files.len());
    for (file, study) in run::load_all(&files, true).unwrap() {
        let study = study.unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let with_facts = study.search.is_some() || !study.facts.is_empty();
        assert!(with_facts, "{}", file.display());
    }
}

/// CATSEYE_WRITE_SCHEMA=1 writes the file instead, after the keys were changed on purpose.
#[test]
fn the_committed_schema_is_that_of_the_code() {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("schema/study.schema.json");
    let text = file::schema();
    if std::env::var_os("CATSEYE_WRITE_SCHEMA").is_some() {
        std::fs::write(&path, &text).unwrap();
        return;
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(committed == text, "study.schema.json is out of date: run this test with CATSEYE_WRITE_SCHEMA=1");
}

/// One study with a target that waves pass through decides for all of a run; what cannot be loaded decides nothing.
#[test]
fn studies_of_dielectric_targets_go_to_the_processors() {
    let target = |spec: &str| {
        parse(&format!(
            "name = \"x\"\ntitle = \"t\"\nreference = \"r\"\nquantities = [\"rcs_dbsm\"]\n\
             [set]\ntarget = \"{spec}\"\n[[sweep]]\nparameter = \"azimuth_deg\"\nvalues = [0, 1]\n"
        ))
    };
    let metal = || ("metal.toml".into(), target("plate:width_m=0.02,height_m=0.02"));
    let sheet = ("sheet.toml".into(), target("plate:width_m=0.02,height_m=0.02,material=air+glass:0.004"));
    let broken = ("broken.toml".into(), target("nothing"));
    assert_eq!(run::purpose(&[metal(), broken]), Purpose::General);
    assert_eq!(run::purpose(&[metal(), sheet]), Purpose::Penetrable);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/studies");
    let filled = run::load_all(&[folder.join("fig_4_15a.toml")], true).unwrap();
    assert_eq!(run::purpose(&filled), Purpose::Penetrable);
}
