//! Two corner reflectors at one range, told apart by MUSIC and ESPRIT and not by beamforming (M, Figs. 1 and 2), and what tracking
//! the subspace costs against decomposing (M, Table I).

use crate::trial::context::TrialContext;
use crate::trial::drive::Drive;
use crate::trial::pictures::TRUE;
use crate::trial::report::{Row, Sheet, Trial};
use crate::trial::road_shape::input::chosen;
use crate::trial::road_shape::settings::Settings;
use crate::trial::stats::{mean, rms};
use catseye::dsp::doa_bisvd::{BiSvd, costs};
use catseye::dsp::doa_covariance::{add_outer, eigen};
use catseye::dsp::doa_manifold::Matrix;
use catseye::error::{BadInput, Error, Result};
use catseye::road::site::Site;
use catseye_lane::road_shape::image::{Angles, ImageSettings, Imager};
use catseye_plot::{Axis, Chart, Layer, Mark, Paint, Pen, Picture, Symbol, curve_pen};
use glam::DVec3;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Of one run: for each method and frame the directions found, rad, and the true ones of each frame.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct KeptRun {
    truth_rad: Vec<[f64; 2]>,
    directions_rad: Vec<Vec<Vec<f64>>>,
    /// Of the frame that is shown: grid (rad) and, of each method that has one, its spectrum over its greatest value, dB.
    grid_rad: Vec<f64>,
    spectra_db: Vec<Vec<f64>>,
    /// Multiplications and additions of an update by tracking and by decomposition.
    operations: [[u64; 2]; 2],
}

struct WallPath {
    name: &'static str,
    angles: Angles,
    subarray: bool,
}

const WAYS: [WallPath; 5] = [
    WallPath { name: "MUSIC", angles: Angles::Music, subarray: true },
    WallPath { name: "Bi-SVD MUSIC", angles: Angles::BiSvd, subarray: true },
    WallPath { name: "ESPRIT", angles: Angles::Esprit, subarray: true },
    WallPath { name: "beamforming", angles: Angles::Bartlett, subarray: false },
    WallPath { name: "MUSIC without subarrays", angles: Angles::Music, subarray: false },
];

/// Both reflectors, moved along their lines of sight by draws of this run.
fn put_up(given: &TrialContext<'_>, run: u32, settings: &Settings) -> Result<Site> {
    let mut scenario = given.scenario_of(run);
    let at = scenario.ego.position_m;
    let mut draws = catseye::rng::Draws::new(scenario.seed as u32, 0x6d75_7369);
    let mut shift = |p: &mut DVec3| {
        let line = (*p - at).normalize_or(DVec3::X);
        *p += line * (settings.placement_std_m * draws.normal());
    };
    scenario.points.iter_mut().for_each(|p| shift(&mut p.position_m));
    scenario.objects.iter_mut().for_each(|o| shift(&mut o.pose.translation_m));
    if scenario.points.len() + scenario.objects.len() != 2 {
        return Err(BadInput::new("the comparison of angle methods takes two reflectors")
            .key("object")
            .value(scenario.points.len() + scenario.objects.len())
            .allowed("two of [[object]] and [[point]]")
            .remedy("as in scenes/lane/road_shape_corners.toml, or task = \"edges\"")
            .into());
    }
    Site::new(&scenario)
}

fn one_run(given: &TrialContext<'_>, run: u32, settings: &Settings, shown: u32) -> Result<KeptRun> {
    let site = put_up(given, run, settings)?;
    let (which, by_image) = chosen(&site.scenario.radars, settings)?;
    if !by_image {
        return Err(BadInput::new("the comparison of angle methods needs FM-CW with two slopes")
            .key("radar")
            .remedy("take fmcw76")
            .into());
    }
    let drive = Drive::new(&site, given.engine)?;
    let radar = drive.radar(which);
    let least = settings.sources + 1;
    let subarray = settings.subarray.max(least);
    if subarray > radar.rx.len() {
        return Err(BadInput::new("no subarray of this line tells so many sources")
            .key("lane.road_shape.subarray")
            .value(subarray)
            .allowed(format!("{least}..={}", radar.rx.len()))
            .into());
    }
    let mut imagers = Vec::new();
    for way in &WAYS {
        let s = ImageSettings {
            angles: way.angles,
            subarray: if way.subarray { subarray } else { 0 },
            exact: true,
            ..settings.image()
        };
        imagers.push(Imager::new(radar, &s)?);
    }
    let reflectors: Vec<usize> = {
        let n = site.scene.objects.len();
        (n - site.scenario.points.len() - site.scenario.objects.len()..n).collect()
    };
    let mut out = KeptRun { directions_rad: vec![Vec::new(); WAYS.len()], ..KeptRun::default() };
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
            let [image, _] = imager.look(given.engine, &frame.cube, with)?;
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
                let all = imager.snapshots(&frame.cube, 0)?;
                let n = radar.rx.len();
                let each = radar.chirps * n;
                let c = costs(&all[row * each..(row + 1) * each], n, settings.sources, settings.forgetting)?;
                out.operations = [c.tracking, c.decomposition].map(|o| [o.multiplications, o.additions]);
            }
        }
        let all = u64::from(given.runs) * u64::from(drive.frames());
        (given.watch)(u64::from(run) * u64::from(drive.frames()) + u64::from(index) + 1, all);
    }
    Ok(out)
}

pub fn run(given: &TrialContext<'_>, settings: &Settings) -> Result<Trial> {
    let mut trial = Trial::new("road-shape", format!("Two reflectors: {}", given.scenario.name));
    let count = given.scenario.frames.count;
    let shown = settings.picture_frame.unwrap_or(0).min(count.saturating_sub(1));
    let mut runs = Vec::new();
    for run in 0..given.runs {
        runs.push(given.kept(&format!("run{run}"), || one_run(given, run, settings, shown))?);
    }
    let Some(first) = runs.first() else { return Err(Error::Failed("a trial has one run or more".into())) };
    let gap = |t: &[f64; 2]| t[1] - t[0];
    let mut sheet = Sheet::new("directions", "run frame method true_deg found_deg");
    for (r, run) in runs.iter().enumerate() {
        for (k, way) in WAYS.iter().enumerate() {
            for (f, (found, truth)) in run.directions_rad[k].iter().zip(&run.truth_rad).enumerate() {
                let text = |v: &[f64]| {
                    v.iter().map(|a| format!("{:.3}", a.to_degrees())).collect::<Vec<_>>().join(" ")
                };
                sheet.row(&[&r, &f, &way.name, &text(truth), &text(found)]);
            }
        }
    }
    let apart: Vec<f64> = runs.iter().flat_map(|r| r.truth_rad.iter().map(|t| gap(t).to_degrees())).collect();
    trial.rows.push(
        Row::new("angle between the reflectors", "deg", Some(mean(apart).unwrap_or(0.0)))
            .document((2.0 * (1.5f64 / 17.0).atan()).to_degrees())
            .why("3.0 m at 17 m"),
    );
    for (k, way) in WAYS.iter().enumerate() {
        // Right: two directions, each within a quarter of the gap of its own.
        let right = |found: &Vec<f64>, truth: &[f64; 2]| {
            found.len() == 2 && (0..2).all(|i| (found[i] - truth[i]).abs() < 0.25 * gap(truth))
        };
        let share: Vec<f64> = runs
            .iter()
            .map(|r| {
                let n = r.directions_rad[k].iter().zip(&r.truth_rad).filter(|(f, t)| right(f, t)).count();
                100.0 * n as f64 / r.truth_rad.len().max(1) as f64
            })
            .collect();
        let counts: Vec<f64> = runs
            .iter()
            .map(|r| {
                r.directions_rad[k].iter().map(|f| f.len() as f64).sum::<f64>()
                    / r.truth_rad.len().max(1) as f64
            })
            .collect();
        let errors: Vec<f64> = runs
            .iter()
            .filter_map(|r| {
                let e = r.directions_rad[k]
                    .iter()
                    .zip(&r.truth_rad)
                    .filter(|(f, t)| right(f, t))
                    .flat_map(|(f, t)| [f[0] - t[0], f[1] - t[1]]);
                rms(e).map(f64::to_degrees)
            })
            .collect();
        let shown = Row::mean(format!("{}: directions", way.name), "", &counts);
        trial.rows.push(match way.angles {
            Angles::Bartlett => shown
                .document(1.0)
                .why("at half of the relative phases of two equal echoes a beam has a dip between them, or two lobes beside them"),
            _ if way.subarray => shown.document(2.0),
            _ => shown,
        });
        trial.rows.push(
            Row::mean(format!("{}: both reflectors told apart", way.name), "%", &share)
                .why("two directions, each within a quarter of the gap"),
        );
        trial.rows.push(Row::mean(format!("{}: error of a direction (rms)", way.name), "deg", &errors));
    }
    for (i, (what, by)) in
        [("Bi-SVD", [928.0, 926.0]), ("decomposition", [3335.0, 3335.0])].into_iter().enumerate()
    {
        for (j, kind) in ["multiplications", "additions"].into_iter().enumerate() {
            trial.rows.push(
                Row::new(format!("{what}: {kind} an update"), "", Some(first.operations[i][j] as f64))
                    .document(by[j])
                    .why(match i {
                        0 => "of real numbers, counted as they are done",
                        _ => "update of the covariance and Jacobi's rotations to 1e-6; the document does not name its algorithm",
                    }),
            );
        }
    }
    let [track, whole] = first.operations.map(|o| o[0] as f64);
    trial.rows.push(
        Row::new("multiplications that tracking saves", "%", Some(100.0 * (1.0 - track / whole)))
            .document(100.0 * (1.0 - 928.0 / 3335.0))
            .why("the document's time falls by about 45 % only; ours is in the notes of the method"),
    );
    trial.pictures.push(("spectra".into(), picture(first, shown)?));
    trial.sheets.push(sheet);
    trial.notes.push(
        "The reflectors' distances are drawn anew in each run: the relative phase of their echoes is any, as nothing is known of the \
         document's."
            .into(),
    );
    Ok(trial)
}

fn picture(run: &KeptRun, shown: u32) -> Result<Picture> {
    let x = Axis::new("direction to the left (deg)", -20.0, 20.0);
    let mut chart =
        Chart::new("Two corner reflectors at 17 m (M, Fig. 2)", x, Axis::new("spectrum (dB)", -40.0, 2.0));
    chart.width = 680.0;
    let mut drawn = 0;
    for (k, way) in WAYS.iter().enumerate() {
        let Some(values) = run.spectra_db.get(k).filter(|v| !v.is_empty()) else { continue };
        let pen = curve_pen(drawn);
        drawn += 1;
        let points = run.grid_rad.iter().zip(values).map(|(a, v)| [a.to_degrees(), *v]).collect();
        chart.layers.push(Layer::Line { points, pen });
        chart.key(way.name, Symbol::Line(pen));
    }
    let grey = Pen::dashed(TRUE, 1.5, [5.0, 4.0]);
    for a in run.truth_rad.get(shown as usize).into_iter().flatten() {
        let a = a.to_degrees();
        chart.layers.push(Layer::Line { points: vec![[a, -40.0], [a, 2.0]], pen: grey });
    }
    chart.key("true", Symbol::Line(grey));
    let esprit = WAYS.iter().position(|w| w.angles == Angles::Esprit).unwrap_or(0);
    let found = run.directions_rad[esprit].get(shown as usize).cloned().unwrap_or_default();
    let mark = Mark::Diamond { radius: 6.0 };
    let colour = [214, 39, 40];
    let points = found.iter().map(|a| [a.to_degrees(), 0.0]).collect();
    chart.layers.push(Layer::Marks { points, mark, paint: Paint::Fixed(colour) });
    chart.key("ESPRIT", Symbol::Mark(mark, colour));
    chart.draw()
}

/// Seconds of one update: by tracking (Bi-SVD) and by updating the covariance and decomposing it, as the chain does, medians over
/// `rounds` of `snapshots`, `[snapshot, channel]`. For a bench: what it gives differs from machine to machine.
///
/// Errors: a rank that is not below the number of channels.
pub fn subspace_seconds(
    snapshots: &[Complex64],
    channels: usize,
    rank: usize,
    rounds: usize,
) -> Result<[f64; 2]> {
    const FORGETTING: f64 = 0.9;
    let mut tracker = BiSvd::new(channels, rank, FORGETTING)?;
    let count = (snapshots.len() / channels.max(1)).max(1) as f64;
    let mut times = [Vec::new(), Vec::new()];
    let mut r = Matrix::from_fn(channels, channels, |_, _| Complex64::ZERO);
    let mut sink = 0.0;
    for _ in 0..rounds.max(1) {
        let clock = Instant::now();
        for x in snapshots.chunks_exact(channels) {
            tracker.update(x);
        }
        times[0].push(clock.elapsed().as_secs_f64() / count);
        let clock = Instant::now();
        for x in snapshots.chunks_exact(channels) {
            for i in 0..channels {
                for j in 0..channels {
                    r[(i, j)] *= FORGETTING;
                }
            }
            add_outer(&mut r, x, 1.0 - FORGETTING);
            sink += eigen(&r)?.values[0];
        }
        times[1].push(clock.elapsed().as_secs_f64() / count);
    }
    std::hint::black_box(sink);
    Ok(times.map(|mut t| {
        t.sort_by(f64::total_cmp);
        t[t.len() / 2]
    }))
}
