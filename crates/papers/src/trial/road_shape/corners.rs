//! Two corner reflectors at one range, which MUSIC and ESPRIT resolve and beamforming does not (Miyake, Figs.
//! 1 and 2), and the cost of tracking the subspace compared with decomposition (Miyake, Table I).

use crate::trial::kit::*;
use crate::trial::road_shape::input::chosen;
use catseye::dsp::doa_bisvd::costs;
use catseye_lane::road_shape::RoadShapeOptions;
use catseye_lane::road_shape::image::{Angles, ImageSettings, Imager};

/// Data of one run: for each method and frame the directions found, rad, and the true ones of each frame.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct KeptRun {
    truth_rad: Vec<[f64; 2]>,
    directions_rad: Vec<Vec<Vec<f64>>>,
    /// Data of the frame that is shown: the grid (rad); `spectra_db` holds each method's spectrum relative to
    /// its maximum, dB.
    grid_rad: Vec<f64>,
    spectra_db: Vec<Vec<f64>>,
    /// Number of multiplications and additions of an update by tracking and by decomposition.
    operations: [[u64; 2]; 2],
}

/// An angle estimation method: name, method, and whether it averages over subarrays.
type AngleMethod = (&'static str, Angles, bool);

const METHODS: [AngleMethod; 5] = [
    ("MUSIC", Angles::Music, true),
    ("Bi-SVD MUSIC", Angles::BiSvd, true),
    ("ESPRIT", Angles::Esprit, true),
    ("beamforming", Angles::Bartlett, false),
    ("MUSIC without subarrays", Angles::Music, false),
];

/// The site with both reflectors, displaced along their lines of sight by random draws of this run.
fn put_up(given: &TrialContext<'_>, run: u32, settings: &RoadShapeOptions) -> Result<Site> {
    let mut scenario = given.scenario_of(run);
    let at = scenario.ego.free().map_or(DVec3::ZERO, |ego| ego.position_m);
    let mut draws = catseye::base::rng::Draws::new(scenario.seed as u32, 0x6d75_7369);
    let mut shift = |p: &mut DVec3| {
        let line = (*p - at).normalize_or(DVec3::X);
        *p += line * (settings.placement_std_m * draws.normal());
    };
    scenario.points.iter_mut().for_each(|p| shift(&mut p.position_m));
    scenario.objects.iter_mut().for_each(|o| shift(&mut o.pose.translation_m));
    if scenario.points.len() + scenario.objects.len() != 2 {
        let bad = BadInput::new("the comparison of angle methods needs two reflectors").key("object");
        let bad = bad.value(scenario.points.len() + scenario.objects.len());
        let bad = bad.allowed("two of [[object]] and [[point]]");
        return Err(bad.remedy("follow scenes/lane/road_shape_corners.toml, or set task = \"edges\"").into());
    }
    Site::new(&scenario)
}

fn one_run(given: &TrialContext<'_>, run: u32, settings: &RoadShapeOptions, shown: u32) -> Result<KeptRun> {
    let site = put_up(given, run, settings)?;
    let (which, by_image) = chosen(&site.scenario.radars, settings)?;
    if !by_image {
        let bad =
            BadInput::new("the comparison of angle methods needs FM-CW with two chirp types").key("radar");
        return Err(bad.remedy("take fmcw76").into());
    }
    let drive = Drive::new(&site, given.engine)?;
    let radar = drive.radar(which);
    let least = settings.sources + 1;
    let subarray = settings.subarray.max(least);
    if subarray > radar.rx.len() {
        let bad = BadInput::new("no subarray of this line can separate this number of sources");
        let bad = bad.key("lane.road_shape.subarray").value(subarray);
        return Err(bad.allowed(format!("{least}..={}", radar.rx.len())).into());
    }
    let imager = |(_, angles, averages): &AngleMethod| {
        let subarray = if *averages { subarray } else { 0 };
        Imager::new(radar, &ImageSettings { angles: *angles, subarray, exact: true, ..settings.image() })
    };
    let mut imagers = METHODS.iter().map(imager).collect::<Result<Vec<_>>>()?;
    let reflectors: Vec<usize> = {
        let n = site.scene.objects.len();
        (n - site.scenario.points.len() - site.scenario.objects.len()..n).collect()
    };
    let mut out = KeptRun { directions_rad: vec![Vec::new(); METHODS.len()], ..KeptRun::default() };
    for index in 0..drive.frames() {
        let frame = drive.frame(which, index)?;
        let back = frame.pose.rotation.inverse();
        let mut truth: Vec<f64> = reflectors
            .iter()
            .map(|k| {
                let d =
                    back * (site.scene.objects[*k].at(frame.time_s).translation_m - frame.pose.translation_m);
                d.y.atan2(d.x)
            })
            .collect();
        truth.sort_by(f64::total_cmp);
        let truth = [truth[0], truth[1]];
        out.truth_rad.push(truth);
        for (k, imager) in imagers.iter_mut().enumerate() {
            let with = run == 0 && index == shown;
            let [image, _] = imager.look(given.engine, frame.samples()?, with)?;
            let row = (0..image.row_w.len()).max_by(|a, b| image.row_w[*a].total_cmp(&image.row_w[*b]));
            let Some(row) = row else { continue };
            let mut found: Vec<f64> = image.sources[row].iter().map(|s| s.azimuth_rad).collect();
            found.sort_by(f64::total_cmp);
            out.directions_rad[k].push(found);
            if with {
                let n = image.azimuth_rad.len();
                let values = image.spectrum.get(row * n..(row + 1) * n).unwrap_or(&[]);
                let top = values.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
                let db = |v: &f64| (10.0 * (v / top).max(1e-12).log10()).max(-60.0);
                out.spectra_db.push(values.iter().map(db).collect());
                out.grid_rad.clone_from(&image.azimuth_rad);
            }
            if k == 0 && index == 0 {
                // As the document counts: the whole line, one snapshot.
                let all = imager.snapshots(frame.samples()?, 0)?;
                let n = radar.rx.len();
                let each = radar.chirps * n;
                let c = costs(&all[row * each..(row + 1) * each], n, settings.sources, settings.forgetting)?;
                out.operations = [c.tracking, c.decomposition].map(|o| [o.multiplications, o.additions]);
            }
        }
        given.report_frame(run, index, drive.frames());
    }
    Ok(out)
}

pub fn run(given: &TrialContext<'_>, settings: &RoadShapeOptions) -> Result<Trial> {
    let mut trial = Trial::new("road-shape", format!("Two reflectors: {}", given.scenario.name));
    let count = given.scenario.frames.count;
    let shown = settings.picture_frame.unwrap_or(0).min(count.saturating_sub(1));
    let mut runs = Vec::new();
    for run in 0..given.runs {
        runs.push(given.kept(&format!("run{run}"), || one_run(given, run, settings, shown))?);
    }
    let Some(first) = runs.first() else {
        return Err(Error::Failed("an evaluation needs at least one run".into()));
    };
    let gap = |t: &[f64; 2]| t[1] - t[0];
    let mut sheet = Sheet::new("directions", "run frame method true_deg found_deg");
    let text = |v: &[f64]| v.iter().map(|a| format!("{:.3}", a.to_degrees())).collect::<Vec<_>>().join(" ");
    for (r, run) in runs.iter().enumerate() {
        for ((method, ..), directions) in METHODS.iter().zip(&run.directions_rad) {
            for (f, (found, truth)) in directions.iter().zip(&run.truth_rad).enumerate() {
                sheet.row(&[&r, &f, method, &text(truth), &text(found)]);
            }
        }
    }
    let rows = &mut trial.rows;
    let apart: Vec<f64> = runs.iter().flat_map(|r| r.truth_rad.iter().map(|t| gap(t).to_degrees())).collect();
    rows.one("angle between the reflectors", "deg", Some(mean(apart).unwrap_or(0.0)))
        .document((2.0 * (1.5f64 / 17.0).atan()).to_degrees())
        .why("3.0 m at 17 m");
    for (k, (method, angles, averages)) in METHODS.iter().enumerate() {
        // Right: two directions, each within a quarter of the gap of its own.
        let right = |(found, truth): &(&Vec<f64>, &[f64; 2])| {
            found.len() == 2 && (0..2).all(|i| (found[i] - truth[i]).abs() < 0.25 * gap(truth))
        };
        let (mut share, mut counts, mut errors) = (Vec::new(), Vec::new(), Vec::new());
        for r in &runs {
            let frames = r.truth_rad.len().max(1) as f64;
            let looks = || r.directions_rad[k].iter().zip(&r.truth_rad);
            share.push(100.0 * looks().filter(right).count() as f64 / frames);
            counts.push(r.directions_rad[k].iter().map(|f| f.len() as f64).sum::<f64>() / frames);
            let e = looks().filter(right).flat_map(|(f, t)| [f[0] - t[0], f[1] - t[1]]);
            errors.extend(rms(e).map(f64::to_degrees));
        }
        let row = rows.mean(format!("{method}: directions"), "", &counts);
        if *angles == Angles::Bartlett {
            row.document(1.0)
                .why("at half of the relative phases of two equal echoes a beam has a dip between them, or two lobes beside them");
        } else if *averages {
            row.document(2.0);
        }
        rows.mean(format!("{method}: both reflectors separated"), "%", &share)
            .why("two directions, each within a quarter of the gap");
        rows.mean(format!("{method}: error of a direction (rms)"), "deg", &errors);
    }
    let counted = [
        ("Bi-SVD", [928.0, 926.0], "of real numbers, counted as they are done"),
        (
            "decomposition",
            [3335.0, 3335.0],
            "update of the covariance and Jacobi's rotations to 1e-6; the document does not name its algorithm",
        ),
    ];
    for ((what, document, why), operations) in counted.into_iter().zip(first.operations) {
        for (j, kind) in ["multiplications", "additions"].into_iter().enumerate() {
            rows.one(format!("{what}: {kind} an update"), "", Some(operations[j] as f64))
                .document(document[j])
                .why(why);
        }
    }
    let [track, whole] = first.operations.map(|o| o[0] as f64);
    rows.one("multiplications that tracking saves", "%", Some(100.0 * (1.0 - track / whole)))
        .document(100.0 * (1.0 - 928.0 / 3335.0))
        .why("the document's time falls by about 45 % only; ours is in the notes of the method");
    trial.pictures.push(("spectra".into(), picture(first, shown)?));
    trial.sheets.push(sheet);
    trial.notes.push(
        "The reflectors' distances are drawn anew in each run: the relative phase of their echoes is random, because that of the document is unknown."
            .into(),
    );
    Ok(trial)
}

fn picture(run: &KeptRun, shown: u32) -> Result<Picture> {
    let x = Axis::new("direction to the left (deg)", -20.0, 20.0);
    let y = Axis::new("spectrum (dB)", -40.0, 2.0);
    let mut chart = Chart::new("Two corner reflectors at 17 m (M, Fig. 2)", x, y);
    chart.width = 680.0;
    let drawn = METHODS.iter().zip(&run.spectra_db).filter(|(_, values)| !values.is_empty());
    for (k, ((name, ..), values)) in drawn.enumerate() {
        let points = run.grid_rad.iter().zip(values).map(|(a, v)| [a.to_degrees(), *v]).collect();
        chart.named_line(*name, points, curve_pen(k));
    }
    let grey = Pen::dashed(TRUE, 1.5, [5.0, 4.0]);
    for a in run.truth_rad.get(shown as usize).into_iter().flatten() {
        let a = a.to_degrees();
        chart.line(vec![[a, -40.0], [a, 2.0]], grey);
    }
    chart.key("true", Symbol::Line(grey));
    let esprit = METHODS.iter().position(|m| m.1 == Angles::Esprit).unwrap_or(0);
    let found = run.directions_rad[esprit].get(shown as usize).into_iter().flatten();
    let points = found.map(|a| [a.to_degrees(), 0.0]).collect();
    chart.marks("ESPRIT", points, Mark::Diamond { radius: 6.0 }, [214, 39, 40]);
    chart.draw()
}
