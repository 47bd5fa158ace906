//! Rows and tables of the trial.

use crate::trial::kit::*;
use crate::trial::uwb::pictures::pictures;
use crate::trial::uwb::runs::{Run, RunResult, UwbResults, db};
use crate::trial::uwb::settings::StandsFor;
use crate::trial::uwb::tuning::{Tuned, energy, failed};
use catseye_lane::uwb;

/// Values of Kim's document with which rows are compared.
#[derive(Default)]
struct Document {
    /// Share of the histogram's samples above the threshold, %.
    histogram: Option<f64>,
    /// Detection rate in runs, %.
    runs: Option<f64>,
    /// Mean and worst spacing error, m.
    mean_m: Option<f64>,
    worst_m: Option<f64>,
    /// Largest energy of a pass relative to the threshold, dB.
    contrast_db: Option<f64>,
    /// Share of runs with a warning, %.
    warned: Option<f64>,
    /// Largest energy where the plate was due after the departure, relative to the threshold, dB.
    departed_db: Option<f64>,
    /// Shares of covers above the threshold, and of covers rejected, %.
    covers: Option<[f64; 2]>,
}

fn document(stands_for: Option<StandsFor>) -> Document {
    let db = |mw: f64| 10.0 * (mw / 5.4).log10();
    match stands_for {
        None | Some(StandsFor::Scenario1) => Document::default(),
        Some(StandsFor::Scenario2) => Document {
            histogram: Some(98.7),
            runs: Some(94.0),
            mean_m: Some(0.22),
            worst_m: Some(0.25),
            contrast_db: Some(db(6.5)),
            ..Document::default()
        },
        Some(StandsFor::Scenario3) => Document {
            histogram: Some(90.9),
            runs: Some(86.0),
            mean_m: Some(0.38),
            worst_m: Some(0.97),
            ..Document::default()
        },
        Some(StandsFor::Scenario4) => Document {
            worst_m: Some(1.39),
            warned: Some(100.0),
            departed_db: Some(db(4.96)),
            ..Document::default()
        },
        Some(StandsFor::Manholes) => Document { covers: Some([100.0, 100.0]), ..Document::default() },
    }
}

pub(super) fn fill(trial: &mut Trial, made: &UwbResults<'_>, steps: Vec<Step>) -> Result<()> {
    trial.rows = common_rows(&steps);
    trial.steps = steps;
    let d = document(made.settings.stands_for);
    for (e, radar) in made.impulse_radars.iter().enumerate() {
        let of = if made.impulse_radars.len() > 1 { format!("{}, ", radar.name) } else { String::new() };
        let gate = trial.rows.one(format!("{of}far end of the gate"), "m", Some(radar.gate.max_m));
        if made.settings.stands_for.is_some() {
            gate.document(3.65).why("K (3) with its own lengths gives 3.25");
        }
        for (r, rule) in made.rules.iter().enumerate() {
            let mut more = Vec::new();
            rows(&mut more, made, &d, (r, e), &format!("{of}{}: ", rule.name))?;
            trial.rows.extend(more.into_iter().filter(|r| r.ours.is_some()));
        }
    }
    for row in &mut trial.rows {
        // An interval of one run says nothing.
        row.half = row.half.filter(|_| made.runs.len() > 1);
    }
    notes(trial, made);
    tables(trial, made)?;
    pictures(trial, made)
}

/// Shares of scans above the threshold in the slow drive, of those beside a plate and of the others.
fn slow_shares(made: &UwbResults<'_>, tuned: &Tuned, e: usize) -> Result<[Option<f64>; 2]> {
    let mut counts = [[0_u32; 2]; 2];
    for slow in &made.slow {
        for (scan, beside) in slow.scans.iter().zip(&slow.beside[e]) {
            let over = energy(&tuned.options, &scan[e])?.energy > tuned.threshold.energy;
            let c = &mut counts[usize::from(beside.is_none())];
            c[0] += 1;
            c[1] += u32::from(over);
        }
    }
    Ok(counts.map(|[all, over]| (all > 0).then(|| 100.0 * f64::from(over) / f64::from(all))))
}

fn rows(
    rows: &mut Vec<Row>,
    made: &UwbResults<'_>,
    d: &Document,
    (r, e): (usize, usize),
    of: &str,
) -> Result<()> {
    let (tuned, runs) = (&made.tuned[r][e], &made.runs);
    let (level, floor) = (tuned.threshold.energy, tuned.threshold.floor_energy);
    let named = |name: &str| format!("{of}{name}");
    // Over runs, where a run has a value.
    let over = |of: &dyn Fn(&Run, &RunResult) -> Option<f64>| -> Vec<f64> {
        let each = runs.iter().filter_map(|run| of(run, &run.seen[r][e]));
        each.filter(|v| v.is_finite()).collect()
    };
    let share = |part: usize, all: usize| (all > 0).then(|| 100.0 * part as f64 / all as f64);
    rows.one(named("threshold over the mean of the bare road"), "dB", Some(db(level / floor)))
        .why(format!("largest of {} scans, or the tail's quantile", tuned.bare.len()));
    let alarms = uwb::exceedance_rate(&tuned.bare, level).map_err(|r| failed("false alarms", r))?;
    rows.one(named("false alarms on these scans"), "%", Some(100.0 * alarms))
        .document(made.settings.stands_for.map(|_| 0.0));
    let [beside, between] = slow_shares(made, tuned, e)?;
    rows.one(named("slow drive: scans beside a plate over the threshold"), "%", beside)
        .document(d.histogram)
        .why("the document does not state whether scans between plates are in its share; a strip 0.15 m wide has nulls 0.15 and 0.31 m to the side");
    rows.one(named("slow drive: scans between plates over the threshold"), "%", between);
    let exceeded = over(&|_, s| share(s.energies.iter().filter(|v| **v > level).count(), s.energies.len()));
    let none = (made.settings.stands_for == Some(StandsFor::Scenario1)).then_some(0.0);
    rows.mean(named("scans over the threshold"), "%", &exceeded).document(none);
    let beside = |run: &Run, s: &RunResult| -> Vec<f64> {
        s.energies.iter().zip(&run.beside[e]).filter(|(_, b)| b.is_some()).map(|(v, _)| *v).collect()
    };
    let largest = over(&|run, s| beside(run, s).into_iter().max_by(f64::total_cmp).map(|v| db(v / level)));
    rows.mean(named("largest energy beside a plate over the threshold"), "dB", &largest)
        .document(d.contrast_db)
        .why("the document's passes reach 6 to 7 mW over 5.4 mW");
    let middle = over(&|run, s| {
        let beside = beside(run, s);
        (!beside.is_empty()).then(|| db(beside.iter().sum::<f64>() / beside.len() as f64 / floor))
    });
    rows.mean(named("mean energy beside a plate over the bare road"), "dB", &middle);
    let found = over(&|_, s| s.score.marker_rate().map(|v| 100.0 * v));
    rows.mean(named("plates found"), "%", &found)
        .document(d.runs)
        .why("the document's rate in runs: whether of scans, plates or spacings is not stated");
    let right = over(&|_, s| s.score.spacing_rate().map(|v| 100.0 * v));
    rows.mean(named("spacings right"), "%", &right).document(d.runs);
    let errors = || runs.iter().flat_map(|run| &run.seen[r][e].score.spacing_errors_m);
    let mean_error = over(&|_, s| {
        let n = s.score.spacing_errors_m.len();
        (n > 0).then(|| s.score.spacing_errors_m.iter().map(|v| v.abs()).sum::<f64>() / n as f64)
    });
    rows.mean(named("mean spacing error"), "m", &mean_error)
        .document(d.mean_m)
        .why(format!("{} spacings", errors().count()));
    let worst = errors().map(|v| v.abs()).max_by(f64::total_cmp);
    rows.one(named("worst spacing error"), "m", worst).document(d.worst_m);
    let false_passes = over(&|_, s| Some(s.score.false_passes as f64));
    rows.mean(named("passes without a plate, a run"), "", &false_passes);
    let present = over(&|_, s| {
        let present = &s.result.lane_present;
        share(present.iter().filter(|p| **p).count(), present.len())
    });
    rows.mean(named("scans with a lane"), "%", &present);
    let warned = over(&|_, s| Some(100.0 * f64::from(u8::from(s.warnings_right > 0))));
    rows.mean(named("runs with a warning where no plate was due"), "%", &warned).document(d.warned);
    let wrong = over(&|_, s| Some(s.warnings_wrong as f64));
    rows.mean(named("warnings where a plate was due, a run"), "", &wrong);
    let departed = |s: &RunResult| s.result.departures().last().map(|(_, d)| *d);
    let delay = over(&|_, s| departed(s).map(|d| d.delay_m));
    rows.mean(named("warning behind the position of the missing plate"), "m", &delay);
    let since = over(&|_, s| departed(s).map(|d| db(d.peak_energy / level)));
    rows.mean(named("largest energy since the last plate over the threshold"), "dB", &since)
        .document(d.departed_db);
    let covers = over(&|run, s| {
        let covers = &run.covers[e];
        share(covers.iter().filter(|t| over_near(run, s, **t, level)).count(), covers.len())
    });
    rows.mean(named("covers over the threshold"), "%", &covers).document(d.covers.map(|c| c[0]));
    let rejected = over(&|run, s| {
        let outside = s.result.markers.iter().filter(|m| m.verdict != uwb::Verdict::Lane).count();
        share(outside, s.result.markers.len()).filter(|_| !run.covers[e].is_empty())
    });
    rows.mean(named("passes rejected because they are not periodic"), "%", &rejected)
        .document(d.covers.map(|c| c[1]));
    for (k, by) in ["counted plates", "the speed alone"].into_iter().enumerate() {
        let error = over(&|_, s| s.odometer_m.map(|o| o[k].abs()));
        rows.mean(named(&format!("distance by {by}, error")), "m", &error);
    }
    Ok(())
}

/// Whether the energy exceeds the threshold within half a second of a time.
fn over_near(run: &Run, s: &RunResult, time_s: f64, level: f64) -> bool {
    run.times_s.iter().zip(&s.energies).any(|(t, v)| (t - time_s).abs() < 0.5 && *v > level)
}

fn notes(trial: &mut Trial, made: &UwbResults<'_>) {
    let a = made.settings.asphalt;
    trial.notes.push(format!(
        "Energies are sums of squares over the samples in the gate, in units of the mean of the bare road. Asphalt outside the band of \
         the table of materials: permittivity {}, height {} mm rms.",
        a.relative_permittivity, a.roughness_mm
    ));
    if made.rules.len() > 1 {
        trial.notes.push(
            "The document's rule takes the scans as they are and the scan of the greatest energy as the \
             centre of a pass. The settings' rule first subtracts the mean scan of the bare road, which is \
             mostly the specular reflection under the radar."
                .into(),
        );
    }
}

fn tables(trial: &mut Trial, made: &UwbResults<'_>) -> Result<()> {
    let mut scans = Sheet::new("energies", "run radar rule time_s energy beside_plate lane");
    let mut spacings = Sheet::new("passes", "run radar rule time_s distance_m spacing_m peak_energy verdict");
    scans.comments.push("energy and peak_energy over the mean of the bare road".into());
    spacings.comments.push("spacing_m to the marker that the pass was paired with".into());
    let four = |v: f64| fixed(Some(v), 4);
    let six = |v: f64| fixed(Some(v), 6);
    for (k, run) in made.runs.iter().enumerate() {
        for (r, rule) in made.rules.iter().enumerate() {
            for (e, radar) in made.impulse_radars.iter().enumerate() {
                let (seen, radar, rule) = (&run.seen[r][e], &radar.name, &rule.name);
                let floor = made.tuned[r][e].threshold.floor_energy;
                for (i, v) in seen.energies.iter().enumerate() {
                    let beside = u8::from(run.beside[e][i].is_some());
                    let lane = u8::from(seen.result.lane_present[i]);
                    let (time, energy) = (four(run.times_s[i]), six(v / floor));
                    scans.row(&[&k, radar, rule, &time, &energy, &beside, &lane]);
                }
                for m in &seen.result.markers {
                    let (time, way) = (four(m.pass.time_s), four(m.pass.distance_m));
                    let spacing = fixed(m.spacing.map(|s| s.estimate_m), 4);
                    let peak = six(m.pass.peak_energy / floor);
                    let verdict = format!("{:?}", m.verdict).to_lowercase();
                    spacings.row(&[&k, radar, rule, &time, &way, &spacing, &peak, &verdict]);
                }
            }
        }
    }
    let mut histogram = Sheet::new("histogram", "radar rule from to bare beside_plates")
        .noted("from and to over the mean of the bare road");
    for (r, rule) in made.rules.iter().enumerate() {
        for (e, radar) in made.impulse_radars.iter().enumerate() {
            let Some((bare, marked)) = made.histograms(r, e)? else { continue };
            for (i, (edges, n)) in bare.edges.windows(2).zip(&bare.counts).enumerate() {
                let (from, to) = (six(edges[0]), six(edges[1]));
                histogram.row(&[&radar.name, &rule.name, &from, &to, n, &marked.counts[i]]);
            }
        }
    }
    trial.sheets.extend([scans, spacings, histogram]);
    Ok(())
}
