//! Rows, tables and pictures.

use crate::trial::pictures::{FOUND, OTHER, SEEN, TRUE};
use crate::trial::report::{Row, Sheet, Step, Trial, common_rows};
use crate::trial::uwb::runs::{Run, RunResult, UwbResults};
use crate::trial::uwb::settings::StandsFor;
use crate::trial::uwb::tuning::{Tuned, energy, failed, wide};
use catseye::error::Result;
use catseye_lane::uwb::{self, EventKind, Histogram};
use catseye_plot::{Axis, Chart, Layer, Mark, Paint, Pen, Symbol, class_colour, finite_range};

/// Bins of the histograms.
const BINS: usize = 60;

/// Figures of document K that rows are compared with.
#[derive(Default)]
struct Document {
    /// Samples of the histogram over the threshold, %.
    histogram: Option<f64>,
    /// Detection rate in runs, %.
    runs: Option<f64>,
    /// Mean and worst spacing error, m.
    mean_m: Option<f64>,
    worst_m: Option<f64>,
    /// Largest energy of a pass over the threshold, dB.
    contrast_db: Option<f64>,
    /// Runs that warn, %.
    warned: Option<f64>,
    /// Largest energy where the departed plate was due, over the threshold, dB.
    departed_db: Option<f64>,
    /// Covers over the threshold, and rejected, %.
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

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

/// Mean over runs, where a run has a value.
fn over_runs(name: String, unit: &str, runs: &[Run], of: impl Fn(&Run) -> Option<f64>) -> Row {
    let values: Vec<f64> = runs.iter().filter_map(of).filter(|v| v.is_finite()).collect();
    Row::mean(name, unit, &values)
}

pub(super) fn fill(trial: &mut Trial, made: &UwbResults<'_>, steps: Vec<Step>) -> Result<()> {
    trial.rows = common_rows(&steps);
    trial.steps = steps;
    let d = document(made.settings.stands_for);
    for (e, eye) in made.impulse_radars.iter().enumerate() {
        let of = if made.impulse_radars.len() > 1 { format!("{}, ", eye.name) } else { String::new() };
        let gate = Row::new(format!("{of}far end of the gate"), "m", Some(eye.gate.max_m));
        let gate = match made.settings.stands_for {
            Some(_) => gate.document(3.65).why("K (3) with its own lengths gives 3.25"),
            None => gate,
        };
        trial.rows.push(gate);
        for (r, rule) in made.rules.iter().enumerate() {
            let of = format!("{of}{}: ", rule.name);
            rows(trial, made, &d, r, e, &of)?;
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

/// Shares of scans beside a plate and of the others that are over the threshold, of the slow drive.
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

fn rows(trial: &mut Trial, made: &UwbResults<'_>, d: &Document, r: usize, e: usize, of: &str) -> Result<()> {
    let tuned = &made.tuned[r][e];
    let (level, floor) = (tuned.threshold.energy, tuned.threshold.floor_energy);
    let runs = &made.runs;
    let of_seen = |name: &str, unit: &str, f: &dyn Fn(&Run, &RunResult) -> Option<f64>| {
        over_runs(format!("{of}{name}"), unit, runs, |run| f(run, &run.seen[r][e]))
    };
    let mut push = |row: Row| {
        if row.ours.is_some() {
            trial.rows.push(row);
        }
    };
    push(
        Row::new(format!("{of}threshold over the mean of the bare road"), "dB", Some(db(level / floor)))
            .why(format!("largest of {} scans, or the tail's quantile", tuned.bare.len())),
    );
    let alarms = uwb::exceedance_rate(&tuned.bare, level).map_err(|r| failed("false alarms", r))?;
    let alarms = Row::new(format!("{of}false alarms on these scans"), "%", Some(100.0 * alarms));
    push(alarms.document(made.settings.stands_for.map(|_| 0.0)));
    let [beside, between] = slow_shares(made, tuned, e)?;
    let row = Row::new(format!("{of}slow drive: scans beside a plate over the threshold"), "%", beside);
    push(row.document(d.histogram).why("the document does not say whether scans between plates are in its share; a strip 0.15 m wide has nulls 0.15 and 0.31 m to the side"));
    push(Row::new(format!("{of}slow drive: scans between plates over the threshold"), "%", between));
    let row = of_seen("scans over the threshold", "%", &|_, s| {
        let over = s.energies.iter().filter(|v| **v > level).count();
        (!s.energies.is_empty()).then(|| 100.0 * over as f64 / s.energies.len() as f64)
    });
    push(match made.settings.stands_for {
        Some(StandsFor::Scenario1) => row.document(0.0),
        _ => row,
    });
    let row = of_seen("largest energy beside a plate over the threshold", "dB", &|run, s| {
        let beside = s.energies.iter().zip(&run.beside[e]).filter(|(_, b)| b.is_some());
        beside.map(|(v, _)| *v).max_by(f64::total_cmp).map(|v| db(v / level))
    });
    push(row.document(d.contrast_db).why("the document's passes reach 6 to 7 mW over 5.4 mW"));
    let row = of_seen("mean energy beside a plate over the bare road", "dB", &|run, s| {
        let beside: Vec<f64> =
            s.energies.iter().zip(&run.beside[e]).filter(|(_, b)| b.is_some()).map(|(v, _)| *v).collect();
        (!beside.is_empty()).then(|| db(beside.iter().sum::<f64>() / beside.len() as f64 / floor))
    });
    push(row);
    let percent = |v: Option<f64>| v.map(|v| 100.0 * v);
    let row = of_seen("plates found", "%", &|_, s| percent(s.score.marker_rate()));
    push(row.document(d.runs).why("the document's rate in runs: of scans, plates or spacings is not said"));
    let row = of_seen("spacings right", "%", &|_, s| percent(s.score.spacing_rate()));
    push(row.document(d.runs));
    let errors: Vec<f64> =
        runs.iter().flat_map(|run| run.seen[r][e].score.spacing_errors_m.iter().copied()).collect();
    let row = of_seen("mean spacing error", "m", &|_, s| {
        let n = s.score.spacing_errors_m.len();
        (n > 0).then(|| s.score.spacing_errors_m.iter().map(|v| v.abs()).sum::<f64>() / n as f64)
    });
    push(row.document(d.mean_m).why(format!("{} spacings", errors.len())));
    let worst = errors.iter().map(|v| v.abs()).max_by(f64::total_cmp);
    push(Row::new(format!("{of}worst spacing error"), "m", worst).document(d.worst_m));
    push(of_seen("passes without a plate, a run", "", &|_, s| Some(s.score.false_passes as f64)));
    push(of_seen("scans with a lane", "%", &|_, s| {
        let n = s.result.lane_present.len();
        (n > 0).then(|| 100.0 * s.result.lane_present.iter().filter(|p| **p).count() as f64 / n as f64)
    }));
    let row = of_seen("runs with a warning where no plate was due", "%", &|_, s| {
        Some(100.0 * f64::from(u8::from(s.warnings_right > 0)))
    });
    push(row.document(d.warned));
    push(of_seen("warnings where a plate was due, a run", "", &|_, s| Some(s.warnings_wrong as f64)));
    let departed = |s: &RunResult| s.result.departures().last().map(|(_, d)| *d);
    push(of_seen("warning behind the missing plate's place", "m", &|_, s| departed(s).map(|d| d.delay_m)));
    let row = of_seen("largest energy since the last plate over the threshold", "dB", &|_, s| {
        departed(s).map(|d| db(d.peak_energy / level))
    });
    push(row.document(d.departed_db));
    let row = of_seen("covers over the threshold", "%", &|run, s| {
        let n = run.covers[e].len();
        let over = run.covers[e].iter().filter(|t| over_near(run, s, **t, level)).count();
        (n > 0).then(|| 100.0 * over as f64 / n as f64)
    });
    push(row.document(d.covers.map(|c| c[0])));
    let row = of_seen("passes rejected for want of a period", "%", &|run, s| {
        let n = s.result.markers.len();
        (n > 0 && !run.covers[e].is_empty()).then(|| {
            100.0 * s.result.markers.iter().filter(|m| m.verdict != uwb::Verdict::Lane).count() as f64
                / n as f64
        })
    });
    push(row.document(d.covers.map(|c| c[1])));
    push(of_seen("distance by counted plates, error", "m", &|_, s| s.odometer_m.map(|o| o[0].abs())));
    push(of_seen("distance by the speed alone, error", "m", &|_, s| s.odometer_m.map(|o| o[1].abs())));
    Ok(())
}

/// Whether the energy passes the threshold within half a second of a time.
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
            "The document's rule takes the scans as they are and the scan of the greatest energy as the centre of a pass. The settings' \
             rule first takes the mean scan of the bare road away, which is mostly the mirror reflection under the radar."
                .into(),
        );
    }
}

fn tables(trial: &mut Trial, made: &UwbResults<'_>) -> Result<()> {
    let mut scans = Sheet::new("energies", "run radar rule time_s energy beside_plate lane");
    let mut spacings = Sheet::new("passes", "run radar rule time_s distance_m spacing_m peak_energy verdict");
    scans.comments.push("energy and peak_energy over the mean of the bare road".into());
    spacings.comments.push("spacing_m to the marker that the pass was paired with".into());
    for (k, run) in made.runs.iter().enumerate() {
        for (r, rule) in made.rules.iter().enumerate() {
            for (e, eye) in made.impulse_radars.iter().enumerate() {
                let (seen, tuned) = (&run.seen[r][e], &made.tuned[r][e]);
                let floor = tuned.threshold.floor_energy;
                for (i, v) in seen.energies.iter().enumerate() {
                    let beside = u8::from(run.beside[e][i].is_some());
                    let lane = u8::from(seen.result.lane_present[i]);
                    let time = format!("{:.4}", run.times_s[i]);
                    scans.row(&[
                        &k,
                        &eye.name,
                        &rule.name,
                        &time,
                        &format!("{:.6}", v / floor),
                        &beside,
                        &lane,
                    ]);
                }
                for m in &seen.result.markers {
                    let spacing = m.spacing.map_or_else(String::new, |s| format!("{:.4}", s.estimate_m));
                    let (time, way) = (format!("{:.4}", m.pass.time_s), format!("{:.4}", m.pass.distance_m));
                    let peak = format!("{:.6}", m.pass.peak_energy / floor);
                    let verdict = format!("{:?}", m.verdict).to_lowercase();
                    spacings.row(&[&k, &eye.name, &rule.name, &time, &way, &spacing, &peak, &verdict]);
                }
            }
        }
    }
    trial.sheets.push(scans);
    trial.sheets.push(spacings);
    let mut histogram = Sheet::new("histogram", "radar rule from to bare beside_plates");
    histogram.comments.push("from and to over the mean of the bare road".into());
    for (r, rule) in made.rules.iter().enumerate() {
        for (e, eye) in made.impulse_radars.iter().enumerate() {
            let Some((bare, marked)) = histograms(made, r, e)? else { continue };
            for i in 0..bare.counts.len() {
                let (from, to) = (format!("{:.6}", bare.edges[i]), format!("{:.6}", bare.edges[i + 1]));
                histogram.row(&[&eye.name, &rule.name, &from, &to, &bare.counts[i], &marked.counts[i]]);
            }
        }
    }
    trial.sheets.push(histogram);
    Ok(())
}

/// Of the bare road and of scans beside plates in the slow drive, on common edges in units of the bare road's mean.
fn histograms(made: &UwbResults<'_>, r: usize, e: usize) -> Result<Option<(Histogram, Histogram)>> {
    let tuned = &made.tuned[r][e];
    let floor = tuned.threshold.floor_energy;
    let mut marked = Vec::new();
    for slow in &made.slow {
        for (scan, _) in slow.scans.iter().zip(&slow.beside[e]).filter(|(_, b)| b.is_some()) {
            marked.push(energy(&tuned.options, &scan[e])?.energy / floor);
        }
    }
    let bare: Vec<f64> = tuned.bare.iter().map(|v| v / floor).collect();
    let Some((low, high)) = finite_range(bare.iter().chain(&marked).copied()) else { return Ok(None) };
    let high = if high > low { high } else { low + 1e-3 };
    let edges: Vec<f64> = (0..=BINS).map(|i| low + (high - low) * i as f64 / BINS as f64).collect();
    let of = |values: &[f64]| match values.is_empty() {
        true => Ok(Histogram { edges: edges.clone(), counts: vec![0; BINS], outside: [0; 2] }),
        false => Histogram::with_edges(values, edges.clone()).map_err(|r| failed("histogram", r)),
    };
    Ok(Some((of(&bare)?, of(&marked)?)))
}

fn pictures(trial: &mut Trial, made: &UwbResults<'_>) -> Result<()> {
    for e in 0..made.impulse_radars.len() {
        let suffix = if made.impulse_radars.len() > 1 { format!("_{}", e + 1) } else { String::new() };
        for (r, rule) in made.rules.iter().enumerate() {
            let name = |what: &str| match r + 1 == made.rules.len() && made.rules.len() > 1 {
                true => format!("{what}{suffix}"),
                false => format!("{what}_document{suffix}"),
            };
            if let Some(run) = made.runs.first() {
                trial.pictures.push((name("energy"), energy_chart(made, run, r, e, rule.name).draw()?));
            }
            if let Some((bare, marked)) = histograms(made, r, e)? {
                let title = format!("Energies of scans, {}", rule.name);
                let level = made.tuned[r][e].threshold.energy / made.tuned[r][e].threshold.floor_energy;
                let chart = histogram_chart(&title, &bare, &marked, level);
                trial.pictures.push((name("histogram"), chart.draw()?));
            }
        }
        if let Some(chart) = signal_chart(made, e)? {
            trial.pictures.push((format!("signal{suffix}"), chart.draw()?));
        }
    }
    if let Some(chart) = sweep_chart(made)? {
        trial.pictures.push(("lateral_distance".into(), chart.draw()?));
    }
    if let Some(chart) = spacing_chart(made) {
        trial.pictures.push(("spacing_errors".into(), chart.draw()?));
    }
    Ok(())
}

/// Energy against time with the places of plates, K figures 8 to 11, 13 and 14.
fn energy_chart(made: &UwbResults<'_>, run: &Run, r: usize, e: usize, rule: &str) -> Chart {
    let (seen, tuned) = (&run.seen[r][e], &made.tuned[r][e]);
    let floor = tuned.threshold.floor_energy;
    let level = tuned.threshold.energy / floor;
    let points: Vec<[f64; 2]> =
        run.times_s.iter().zip(&seen.energies).map(|(t, v)| [*t, v / floor]).collect();
    let (t0, t1) = finite_range(points.iter().map(|p| p[0])).unwrap_or((0.0, 1.0));
    let top = points.iter().map(|p| p[1]).fold(level, f64::max);
    let low = points.iter().map(|p| p[1]).fold(level, f64::min);
    let (low, top) = ((low - 0.08 * (top - low)).max(0.0), top + 0.08 * (top - low));
    let x = Axis::new("time (s)", t0, t1);
    let mut chart = Chart::new(
        format!("Energy in the gate, run 1, {rule}"),
        x,
        Axis::new("energy over the mean of the bare road", low, top),
    );
    chart.width = 760.0;
    let grey = (TRUE, 0.3);
    for [from, to] in stretches(&run.times_s, &run.beside[e]) {
        let polygon = vec![[from, low], [to, low], [to, top], [from, top]];
        chart.layers.push(Layer::Area { polygon, fill: Some(grey), stroke: None });
    }
    let blue = Pen::solid(SEEN, 1.6);
    chart.layers.push(Layer::Line { points, pen: blue });
    let red = Pen::dashed(FOUND, 1.4, [6.0, 4.0]);
    chart.layers.push(Layer::Line { points: vec![[t0, level], [t1, level]], pen: red });
    let at = |t: f64, v: f64| [t, v / floor];
    let mark = |lane: bool| -> Vec<[f64; 2]> {
        let chosen = seen.result.markers.iter().filter(|m| (m.verdict == uwb::Verdict::Lane) == lane);
        chosen.map(|m| at(m.pass.time_s, m.pass.peak_energy)).collect()
    };
    let (dot, ring) = (Mark::Dot { radius: 4.0 }, Mark::Diamond { radius: 5.0 });
    chart.layers.push(Layer::Marks { points: mark(true), mark: dot, paint: Paint::Fixed(OTHER) });
    chart.layers.push(Layer::Marks { points: mark(false), mark: ring, paint: Paint::Fixed(FOUND) });
    for (event, _) in seen.result.departures() {
        let pen = Pen::solid(FOUND, 1.6);
        chart.layers.push(Layer::Line { points: vec![[event.time_s, low], [event.time_s, top]], pen });
    }
    let covers: Vec<[f64; 2]> = run.covers[e].iter().map(|t| [*t, low + 0.03 * (top - low)]).collect();
    if !covers.is_empty() {
        chart.marks("cover", covers, Mark::Dot { radius: 5.0 }, class_colour("manhole"));
    }
    chart.key("energy", Symbol::Line(blue));
    chart.key("threshold", Symbol::Line(red));
    if run.beside[e].iter().any(Option::is_some) {
        chart.key("beside a plate", Symbol::Area { fill: grey, stroke: Pen::solid(TRUE, 0.5) });
    }
    chart.key("pass, of the lane", Symbol::Mark(dot, OTHER));
    chart.key("pass, not", Symbol::Mark(ring, FOUND));
    if seen.result.events.iter().any(|e| matches!(e.kind, EventKind::Departure(_))) {
        chart.key("departure warning", Symbol::Line(Pen::solid(FOUND, 1.6)));
    }
    chart
}

/// Stretches of time beside a plate.
fn stretches(times_s: &[f64], beside: &[Option<f64>]) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = Vec::new();
    let mut open = false;
    for (t, b) in times_s.iter().zip(beside) {
        match (b.is_some(), open) {
            (true, false) => all.push([*t, *t]),
            (true, true) => {
                if let Some(last) = all.last_mut() {
                    last[1] = *t;
                }
            }
            _ => {}
        }
        open = b.is_some();
    }
    all
}

/// K figure 7: shares of scans in bins of energy.
fn histogram_chart(title: &str, bare: &Histogram, marked: &Histogram, level: f64) -> Chart {
    let (low, high) = (bare.edges[0], bare.edges[bare.edges.len() - 1]);
    let share = |h: &Histogram| -> Vec<f64> {
        let all = h.counts.iter().sum::<u64>().max(1) as f64;
        h.counts.iter().map(|c| 100.0 * *c as f64 / all).collect()
    };
    let (a, b) = (share(bare), share(marked));
    let top = a.iter().chain(&b).fold(0.0, |m: f64, v| m.max(*v)) * 1.08;
    let margin = 0.02 * (high - low);
    let mut chart = Chart::new(
        title,
        Axis::new("energy over the mean of the bare road", low - margin, high + margin),
        Axis::new("share of scans (%)", 0.0, top),
    );
    let mut bars = |h: &Histogram, shares: &[f64], rgb, label: &str| {
        for (i, v) in shares.iter().enumerate().filter(|(_, v)| **v > 0.0) {
            let (x, y) = (h.edges[i], h.edges[i + 1]);
            let polygon = vec![[x, 0.0], [y, 0.0], [y, *v], [x, *v]];
            chart.layers.push(Layer::Area {
                polygon,
                fill: Some((rgb, 0.45)),
                stroke: Some(Pen::solid(rgb, 0.8)),
            });
        }
        chart.key(label, Symbol::Area { fill: (rgb, 0.45), stroke: Pen::solid(rgb, 0.8) });
    };
    bars(bare, &a, SEEN, "bare road");
    if marked.counts.iter().any(|c| *c > 0) {
        bars(marked, &b, OTHER, "beside a plate");
    }
    let red = Pen::dashed(FOUND, 1.6, [6.0, 4.0]);
    chart.layers.push(Layer::Line { points: vec![[level, 0.0], [level, top]], pen: red });
    chart.key("threshold", Symbol::Line(red));
    chart
}

/// The scan of the greatest energy of the first run and a bare one, K figures 8 and 9.
fn signal_chart(made: &UwbResults<'_>, e: usize) -> Result<Option<Chart>> {
    let (Some(run), Some(tuned)) = (made.runs.first(), made.tuned.last()) else { return Ok(None) };
    let eye = &made.impulse_radars[e];
    let energies = &run.seen[run.seen.len() - 1][e].energies;
    let beside = |i: &usize| run.beside[e][*i].is_some();
    let most = |all: Vec<usize>| all.into_iter().max_by(|a, b| energies[*a].total_cmp(&energies[*b]));
    let Some(best) =
        most((0..energies.len()).filter(beside).collect()).or(most((0..energies.len()).collect()))
    else {
        return Ok(None);
    };
    let Some(quiet) = made.quiet.first() else { return Ok(None) };
    let points = |values: &[f64]| -> Vec<[f64; 2]> {
        let at = |i: usize| eye.axis.start_m + i as f64 * eye.axis.step_m;
        values.iter().enumerate().map(|(i, v)| [at(i), v * 1e3]).collect()
    };
    let scan = wide(&run.scans[best][e]);
    let bare = wide(&quiet[e]);
    let mut curves = vec![(points(&bare), TRUE, "bare road"), (points(&scan), SEEN, "greatest energy")];
    if let Some(b) = &tuned[e].options.background {
        let rest = b.taken_from(&scan).map_err(|r| failed("background", r))?;
        curves.push((points(&rest), FOUND, "without the mean of the bare road"));
    }
    let all = curves.iter().flat_map(|c| c.0.iter().map(|p| p[1].abs()));
    let top = 1.1 * all.fold(0.0, f64::max);
    let (x0, x1) = (eye.gate.min_m - 0.3, eye.gate.max_m);
    let title = format!("Scan at {:.2} s of run 1", run.times_s[best]);
    let mut chart =
        Chart::new(title, Axis::new("range (m)", x0, x1), Axis::new("signal (0.001 √W)", -top, top));
    chart.width = 760.0;
    for (points, rgb, label) in curves {
        let pen = Pen::solid(rgb, 1.2);
        chart.layers.push(Layer::Line { points, pen });
        chart.key(label, Symbol::Line(pen));
    }
    let gate = Pen::dashed([60; 3], 1.2, [6.0, 4.0]);
    let near = eye.gate.min_m;
    chart.layers.push(Layer::Line { points: vec![[near, -top], [near, top]], pen: gate });
    chart.key("begin of the gate", Symbol::Line(gate));
    Ok(Some(chart))
}

/// Energy at the middle of a plate against the lateral distance, under each rule.
fn sweep_chart(made: &UwbResults<'_>) -> Result<Option<Chart>> {
    if made.sweep.is_empty() {
        return Ok(None);
    }
    let mut curves = Vec::new();
    for (r, rule) in made.rules.iter().enumerate() {
        let t = &made.tuned[r][0];
        let value = |scan: &[f32]| energy(&t.options, scan).map(|e| db(e.energy / t.threshold.floor_energy));
        let points =
            made.sweep.iter().map(|(d, s)| Ok([*d, value(s)?])).collect::<Result<Vec<[f64; 2]>>>()?;
        curves.push((points, db(t.threshold.energy / t.threshold.floor_energy), rule.name));
    }
    let all = || curves.iter().flat_map(|c| c.0.iter().map(|p| p[1]).chain([c.1]));
    let (low, high) = finite_range(all()).unwrap_or((0.0, 1.0));
    let end = made.sweep.last().map_or(1.0, |s| s.0);
    let mut chart = Chart::new(
        "Energy beside the middle of a plate",
        Axis::new("lateral distance of plate and radar (m)", 0.0, end),
        Axis::new("energy over the mean of the bare road (dB)", low - 1.0, high + 1.0),
    );
    chart.width = 760.0;
    for ((points, level, name), rgb) in curves.into_iter().zip([SEEN, OTHER]) {
        let (pen, dashed) = (Pen::solid(rgb, 1.6), Pen::dashed(rgb, 1.2, [6.0, 4.0]));
        chart.layers.push(Layer::Line { points, pen });
        chart.layers.push(Layer::Line { points: vec![[0.0, level], [end, level]], pen: dashed });
        chart.key(name, Symbol::Line(pen));
        chart.key("its threshold", Symbol::Line(dashed));
    }
    Ok(Some(chart))
}

/// Spacing errors of each run under each rule.
fn spacing_chart(made: &UwbResults<'_>) -> Option<Chart> {
    let limit = made.settings.largest_error_m();
    let (dot, ring) = (Mark::Dot { radius: 3.5 }, Mark::Diamond { radius: 4.5 });
    let of = |r: usize| -> Vec<[f64; 2]> {
        let runs = made.runs.iter().enumerate();
        let errors = runs.flat_map(|(k, run)| {
            let each = run.seen[r].iter().flat_map(|s| s.score.spacing_errors_m.iter().copied());
            each.map(move |v| [(k + 1) as f64 + 0.15 * (r as f64 - 0.5), v])
        });
        errors.collect()
    };
    let all: Vec<Vec<[f64; 2]>> = (0..made.rules.len()).map(of).collect();
    if all.iter().all(Vec::is_empty) {
        return None;
    }
    let top = all.iter().flatten().map(|p| p[1].abs()).fold(limit, f64::max) * 1.15;
    let end = made.runs.len() as f64 + 0.5;
    let mut chart = Chart::new(
        "Errors of spacings between neighbouring plates",
        Axis::new("run", 0.5, end),
        Axis::new("estimate less spacing (m)", -top, top),
    );
    let grey = Pen::dashed([60; 3], 1.2, [6.0, 4.0]);
    for y in [-limit, limit] {
        chart.layers.push(Layer::Line { points: vec![[0.5, y], [end, y]], pen: grey });
    }
    for (r, points) in all.into_iter().enumerate() {
        let last = r + 1 == made.rules.len() && made.rules.len() > 1;
        let (mark, rgb) = if last { (dot, OTHER) } else { (ring, SEEN) };
        chart.layers.push(Layer::Marks { points, mark, paint: Paint::Fixed(rgb) });
        chart.key(made.rules[r].name, Symbol::Mark(mark, rgb));
    }
    chart.key("largest error that is right", Symbol::Line(grey));
    Some(chart)
}
