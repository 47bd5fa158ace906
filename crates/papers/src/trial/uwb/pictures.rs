//! Pictures in the form of Kim's figures 7 to 14.

use crate::trial::kit::*;
use crate::trial::uwb::runs::{Run, UwbResults, db};
use crate::trial::uwb::tuning::{energy, failed, wide};
use catseye_lane::uwb::{self, EventKind, Histogram};

pub(super) fn pictures(trial: &mut Trial, made: &UwbResults<'_>) -> Result<()> {
    let mut put = |name: String, chart: Option<Chart>| -> Result<()> {
        if let Some(chart) = chart {
            trial.pictures.push((name, chart.draw()?));
        }
        Ok(())
    };
    for e in 0..made.impulse_radars.len() {
        let suffix = if made.impulse_radars.len() > 1 { format!("_{}", e + 1) } else { String::new() };
        for (r, rule) in made.rules.iter().enumerate() {
            let name = |what: &str| match r + 1 == made.rules.len() && made.rules.len() > 1 {
                true => format!("{what}{suffix}"),
                false => format!("{what}_document{suffix}"),
            };
            let first = made.runs.first();
            put(name("energy"), first.map(|run| energy_chart(made, run, r, e, rule.name)))?;
            let threshold = made.tuned[r][e].threshold;
            let chart = made.histograms(r, e)?.map(|(bare, marked)| {
                let title = format!("Energies of scans, {}", rule.name);
                histogram_chart(&title, &bare, &marked, threshold.energy / threshold.floor_energy)
            });
            put(name("histogram"), chart)?;
        }
        put(format!("signal{suffix}"), signal_chart(made, e)?)?;
    }
    put("lateral_distance".into(), sweep_chart(made)?)?;
    put("spacing_errors".into(), spacing_chart(made))
}

const ENERGY: &str = "energy over the mean of the bare road";

/// Energy against time with the places of plates, Kim, figures 8 to 11, 13 and 14.
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
    let (x, y) = (Axis::new("time (s)", t0, t1), Axis::new(ENERGY, low, top));
    let mut chart = Chart::new(format!("Energy in the gate, run 1, {rule}"), x, y);
    chart.width = 760.0;
    let (grey, warning) = ((TRUE, 0.3), Pen::solid(FOUND, 1.6));
    for [from, to] in stretches(&run.times_s, &run.beside[e]) {
        chart.area(vec![[from, low], [to, low], [to, top], [from, top]], grey, None);
    }
    let (blue, red) = (Pen::solid(SEEN, 1.6), Pen::dashed(FOUND, 1.4, [6.0, 4.0]));
    chart.line(points, blue);
    chart.line(vec![[t0, level], [t1, level]], red);
    let mark = |lane: bool| -> Vec<[f64; 2]> {
        let chosen = seen.result.markers.iter().filter(|m| (m.verdict == uwb::Verdict::Lane) == lane);
        chosen.map(|m| [m.pass.time_s, m.pass.peak_energy / floor]).collect()
    };
    let (dot, ring) = (Mark::Dot { radius: 4.0 }, Mark::Diamond { radius: 5.0 });
    chart.dots(mark(true), dot, OTHER);
    chart.dots(mark(false), ring, FOUND);
    for (event, _) in seen.result.departures() {
        chart.line(vec![[event.time_s, low], [event.time_s, top]], warning);
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
        chart.key("departure warning", Symbol::Line(warning));
    }
    chart
}

/// Stretches of time beside a plate.
fn stretches(times_s: &[f64], beside: &[Option<f64>]) -> Vec<[f64; 2]> {
    let all: Vec<(&f64, bool)> = times_s.iter().zip(beside.iter().map(Option::is_some)).collect();
    let open = all.split(|(_, beside)| !beside);
    open.filter_map(|part| Some([*part.first()?.0, *part.last()?.0])).collect()
}

/// Kim, figure 7: shares of scans in bins of energy.
fn histogram_chart(title: &str, bare: &Histogram, marked: &Histogram, level: f64) -> Chart {
    let (low, high) = (bare.edges[0], bare.edges[bare.edges.len() - 1]);
    let share = |h: &Histogram| -> Vec<f64> {
        let all = h.counts.iter().sum::<u64>().max(1) as f64;
        h.counts.iter().map(|c| 100.0 * *c as f64 / all).collect()
    };
    let (a, b) = (share(bare), share(marked));
    let top = a.iter().chain(&b).fold(0.0, |m: f64, v| m.max(*v));
    let top = (1.08 * top).min(100.0);
    let margin = 0.02 * (high - low);
    let x = Axis::new(ENERGY, low - margin, high + margin);
    let mut chart = Chart::new(title, x, Axis::new("share of scans (%)", 0.0, top));
    let mut bars = |h: &Histogram, shares: &[f64], rgb, label: &str| {
        let (fill, stroke) = ((rgb, 0.45), Pen::solid(rgb, 0.8));
        for (edges, v) in h.edges.windows(2).zip(shares).filter(|(_, v)| **v > 0.0) {
            let (x, y) = (edges[0], edges[1]);
            chart.area(vec![[x, 0.0], [y, 0.0], [y, *v], [x, *v]], fill, Some(stroke));
        }
        chart.key(label, Symbol::Area { fill, stroke });
    };
    bars(bare, &a, SEEN, "bare road");
    if marked.counts.iter().any(|c| *c > 0) {
        bars(marked, &b, OTHER, "beside a plate");
    }
    let threshold = vec![[level, 0.0], [level, top]];
    chart.named_line("threshold", threshold, Pen::dashed(FOUND, 1.6, [6.0, 4.0]));
    chart
}

/// The scan of the greatest energy of the first run and a bare one, Kim, figures 8 and 9.
fn signal_chart(made: &UwbResults<'_>, e: usize) -> Result<Option<Chart>> {
    let (Some(run), Some(tuned), Some(quiet)) = (made.runs.first(), made.tuned.last(), made.quiet.first())
    else {
        return Ok(None);
    };
    let radar = &made.impulse_radars[e];
    let energies = &run.seen[run.seen.len() - 1][e].energies;
    let most = |all: &dyn Fn(&usize) -> bool| {
        let chosen = (0..energies.len()).filter(all);
        chosen.max_by(|a, b| energies[*a].total_cmp(&energies[*b]))
    };
    let Some(best) = most(&|i| run.beside[e][*i].is_some()).or_else(|| most(&|_| true)) else {
        return Ok(None);
    };
    let points = |values: &[f64]| -> Vec<[f64; 2]> {
        let at = |i: usize| radar.axis.start_m + i as f64 * radar.axis.step_m;
        values.iter().enumerate().map(|(i, v)| [at(i), v * 1e3]).collect()
    };
    let scan = wide(&run.scans[best][e]);
    let bare = points(&wide(&quiet[e]));
    let mut curves = vec![(bare, TRUE, "bare road"), (points(&scan), SEEN, "greatest energy")];
    if let Some(b) = &tuned[e].options.background {
        let rest = b.taken_from(&scan).map_err(|r| failed("background", r))?;
        curves.push((points(&rest), FOUND, "without the mean of the bare road"));
    }
    let all = curves.iter().flat_map(|c| c.0.iter().map(|p| p[1].abs()));
    let top = 1.1 * all.fold(0.0, f64::max);
    let near = radar.gate.min_m;
    let title = format!("Scan at {:.2} s of run 1", run.times_s[best]);
    let x = Axis::new("range (m)", near - 0.3, radar.gate.max_m);
    let mut chart = Chart::new(title, x, Axis::new("signal (0.001 √W)", -top, top));
    chart.width = 760.0;
    for (points, rgb, label) in curves {
        chart.named_line(label, points, Pen::solid(rgb, 1.2));
    }
    let gate = Pen::dashed([60; 3], 1.2, [6.0, 4.0]);
    chart.named_line("begin of the gate", vec![[near, -top], [near, top]], gate);
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
    let x = Axis::new("lateral distance of plate and radar (m)", 0.0, end);
    let y = Axis::new(format!("{ENERGY} (dB)"), low - 1.0, high + 1.0);
    let mut chart = Chart::new("Energy beside the middle of a plate", x, y);
    chart.width = 760.0;
    for ((points, level, name), rgb) in curves.into_iter().zip([SEEN, OTHER]) {
        chart.named_line(name, points, Pen::solid(rgb, 1.6));
        let threshold = vec![[0.0, level], [end, level]];
        chart.named_line("its threshold", threshold, Pen::dashed(rgb, 1.2, [6.0, 4.0]));
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
    let y = Axis::new("estimate less spacing (m)", -top, top);
    let mut chart =
        Chart::new("Errors of spacings between neighbouring plates", Axis::new("run", 0.5, end), y);
    let grey = Pen::dashed([60; 3], 1.2, [6.0, 4.0]);
    for y in [-limit, limit] {
        chart.line(vec![[0.5, y], [end, y]], grey);
    }
    for (r, points) in all.into_iter().enumerate() {
        let last = r + 1 == made.rules.len() && made.rules.len() > 1;
        let (mark, rgb) = if last { (dot, OTHER) } else { (ring, SEEN) };
        chart.marks(made.rules[r].name, points, mark, rgb);
    }
    chart.key("largest error that is right", Symbol::Line(grey));
    Some(chart)
}
