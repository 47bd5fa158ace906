//! Figures and tables of the trial.

use crate::trial::report::{Row, Sheet, Step};
use crate::trial::signature::looks::{Located, RowPicture, WordRead, Worse, stds};
use crate::trial::signature::mapped::Moving;
use crate::trial::signature::settings::{CodeName, Settings, bits};
use crate::trial::stats::{mean, over_runs, rms};
use catseye_lane::LaneError;
use catseye_lane::signature::codewords::Zone;
use catseye_lane::signature::map::SignatureMap;

pub(super) fn place_rows(places: &[Located]) -> Vec<Row> {
    let of_runs = |of: &dyn Fn(&[&Located]) -> Option<f64>| over_runs(places, |p| p.run, of);
    let rms = |k: usize| of_runs(&|run| rms(run.iter().filter_map(|p| Some(p.error?[k]))));
    let plane: Vec<f64> = rms(0).iter().zip(rms(1)).map(|(a, b)| a.hypot(b)).collect();
    let heading: Vec<f64> = rms(2).iter().map(|h| h.to_degrees()).collect();
    let share = |of: &dyn Fn(&Located) -> bool| {
        of_runs(&|run| Some(100.0 * run.iter().filter(|p| of(p)).count() as f64 / run.len().max(1) as f64))
    };
    let error = |p: &Located| p.error.map(|e| e[0].hypot(e[1]));
    let worst = places.iter().filter_map(error).max_by(f64::total_cmp);
    let nees = of_runs(&|run| mean(run.iter().filter_map(|p| p.nees)).map(|n| n / 3.0));
    let first = of_runs(&|run| {
        let p = run.first()?;
        Some(if error(p).is_some_and(|e| e < 0.5) { 100.0 } else { 0.0 })
    });
    let wrong = share(&|p| error(p).is_some_and(|e| e > 0.5));
    let none = "the document gives no figure";
    vec![
        Row::mean("place error in the plane (rms)", "m", &plane).why(format!("{none}; asked for: below 0.2")),
        Row::mean("place error along the road (rms)", "m", &rms(0)).why(none),
        Row::mean("place error across the road (rms)", "m", &rms(1)).why(none),
        Row::mean("heading error of the place (rms)", "deg", &heading).why(none),
        Row::new("largest place error", "m", worst).why("over all looks with a place"),
        Row::mean("looks with a place", "%", &share(&|p| p.place.is_some())),
        Row::mean("looks with a place within 0.2 m", "%", &share(&|p| error(p).is_some_and(|e| e < 0.2))),
        Row::mean("looks with a wrong place (over 0.5 m)", "%", &wrong),
        Row::mean("first search along the whole map right", "%", &first)
            .why("without GNSS, nothing known before"),
        Row::mean("squared error over its covariance, per freedom", "", &nees)
            .why("1 where the covariance is honest; the map's own error is shared by all looks"),
    ]
}

pub(super) fn map_rows(map: &SignatureMap, errors: &[f64], moving: &Moving) -> Vec<Row> {
    let rms = rms(errors.iter().copied());
    let percent = |a: usize, b: usize| (b > 0).then(|| 100.0 * a as f64 / b as f64);
    vec![
        Row::new("landmarks of the map", "", Some(map.landmarks().len() as f64)),
        Row::new("distance of landmarks from their markers (rms)", "m", rms)
            .why("of those within 0.5 m of a marker; inertial error in it"),
        Row::new("points of moving things taken out", "%", percent(moving.moving_out, moving.moving))
            .why("by range rate and own speed, as the document asks"),
        Row::new("points of standing things taken out", "%", percent(moving.standing_out, moving.standing)),
    ]
    .into_iter()
    .filter(|r| r.ours.is_some())
    .collect()
}

pub(super) fn word_rows(s: &Settings, words: &[WordRead]) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut runs: Vec<u32> = words.iter().map(|w| w.run).collect();
    runs.sort_unstable();
    runs.dedup();
    for (i, table) in s.row.iter().enumerate().filter(|(_, t)| t.word.is_some()) {
        for worse in [Worse::No, Worse::Row, Worse::Looks] {
            let shares = format!("{:.0} % missing and {:.0} % extra", 100.0 * s.worse, 100.0 * s.worse);
            let with = match worse {
                Worse::No => String::new(),
                Worse::Row => format!(", {shares}"),
                Worse::Looks => format!(", {shares} in each look by itself"),
            };
            let share = |of: &dyn Fn(&WordRead) -> bool| -> Vec<f64> {
                runs.iter()
                    .map(|r| {
                        let all: Vec<_> =
                            words.iter().filter(|w| (w.run, w.row, w.worse) == (*r, i, worse)).collect();
                        100.0 * all.iter().filter(|w| of(w)).count() as f64 / all.len().max(1) as f64
                    })
                    .collect()
            };
            let sure = |w: &WordRead| w.reading.as_ref().is_some_and(|r| r.sure);
            let last: Vec<f64> = runs
                .iter()
                .filter_map(|r| {
                    let of_run = words.iter().filter(|w| (w.run, w.row, w.worse) == (*r, i, worse));
                    let w = of_run.max_by_key(|w| w.frame)?;
                    Some(if sure(w) && w.right == Some(true) { 100.0 } else { 0.0 })
                })
                .collect();
            let name = &table.name;
            rows.push(
                Row::mean(format!("word of the row {name} read at the end{with}"), "%", &last)
                    .why("right and sure; the document asks for words and gives no code"),
            );
            rows.push(Row::mean(
                format!("looks at which the row {name} is read{with}"),
                "%",
                &share(&|w| sure(w) && w.right == Some(true)),
            ));
            rows.push(Row::mean(
                format!("looks at which the row {name} is read wrongly and called sure{with}"),
                "%",
                &share(&|w| sure(w) && w.right == Some(false)),
            ));
        }
    }
    rows
}

pub(super) fn sheets(s: &Settings, map: &SignatureMap, places: &[Located], words: &[WordRead]) -> Vec<Sheet> {
    let f = |v: f64| format!("{v:.4}");
    let opt = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.4}"));
    let mut out = Vec::new();
    let mut sheet = Sheet::new("map", "x_m y_m std_x_m std_y_m hits occupancy");
    for l in map.landmarks() {
        let [xx, _, yy] = l.covariance_m2;
        sheet.row(&[
            &f(l.position_m[0]),
            &f(l.position_m[1]),
            &f(xx.max(0.0).sqrt()),
            &f(yy.max(0.0).sqrt()),
            &l.hits,
            &f(l.occupancy()),
        ]);
    }
    out.push(sheet);
    let columns = "run time_s way_m true_x_m true_y_m x_m y_m along_m across_m heading_deg std_along_m \
             std_across_m points explained rivals probability tracked";
    let mut sheet = Sheet::new("places", columns);
    for p in places {
        let std = |axis: usize| p.place.as_ref().map(|q| stds(q)[axis]);
        let radar = p.place.as_ref().map(|q| &q.radar);
        let text = |v: Option<String>| v.unwrap_or_default();
        sheet.row(&[
            &p.run,
            &f(p.time_s),
            &f(p.way_m),
            &f(p.truth.x_m),
            &f(p.truth.y_m),
            &opt(p.place.as_ref().map(|q| q.vehicle.x_m)),
            &opt(p.place.as_ref().map(|q| q.vehicle.y_m)),
            &opt(p.error.map(|e| e[0])),
            &opt(p.error.map(|e| e[1])),
            &opt(p.error.map(|e| e[2].to_degrees())),
            &opt(std(0)),
            &opt(std(1)),
            &text(radar.map(|r| r.points.to_string())),
            &opt(radar.map(|r| r.explained)),
            &text(radar.map(|r| r.rivals.len().to_string())),
            &opt(radar.map(|r| r.probability)),
            &text(p.place.as_ref().map(|q| u8::from(q.tracked).to_string())),
        ]);
    }
    out.push(sheet);
    if !s.row.is_empty() {
        let columns = "run frame row worse points word log_odds sure right missing extra zone";
        let mut sheet = Sheet::new("words", columns);
        for w in words {
            let r = w.reading.as_ref();
            let text = |v: Option<String>| v.unwrap_or_default();
            let zone = r
                .filter(|r| r.sure && s.row[w.row].code == CodeName::Bch15x7)
                .and_then(|r| Zone::from_message(r.message));
            sheet.row(&[
                &w.run,
                &w.frame,
                &s.row[w.row].name,
                &(w.worse as u8),
                &w.points,
                &text(r.map(|r| bits(&r.word))),
                &opt(r.map(|r| r.log_odds)),
                &text(r.map(|r| u8::from(r.sure).to_string())),
                &text(w.right.map(|r| u8::from(r).to_string())),
                &text(r.map(|r| r.missing.to_string())),
                &text(r.map(|r| r.extra.to_string())),
                &text(zone.map(|z| said(&z))),
            ]);
        }
        out.push(sheet);
    }
    out
}

/// A zone in words.
fn said(zone: &Zone) -> String {
    let ten = |n: u8| 10 * u32::from(n);
    match zone {
        Zone::SpeedLimit { tens_kmh } => format!("speed limit {} km/h", ten(*tens_kmh)),
        Zone::TunnelAhead { tens_m } => format!("tunnel in {} m", ten(*tens_m)),
        Zone::TunnelEnd => "end of the tunnel".into(),
        Zone::SharpBendLeft { tens_m } => format!("bend to the left; radius {} m", ten(*tens_m)),
        Zone::SharpBendRight { tens_m } => format!("bend to the right; radius {} m", ten(*tens_m)),
        Zone::CrossingAhead { tens_m } => format!("crossing in {} m", ten(*tens_m)),
        Zone::Place { number } => format!("place {number}"),
        Zone::Line { solid, yellow } => {
            let [a, b] = [if *solid { "solid" } else { "dashed" }, if *yellow { "yellow" } else { "white" }];
            format!("{a} {b} line")
        }
    }
}

pub(super) fn notes(steps: &[Step], rows: &[Option<RowPicture>]) -> Vec<String> {
    let mut out = vec![
        "Lane lines come from a survey in the map's coordinates; the place of the vehicle comes from radar points alone, \
         without GNSS. Poses of the mapped drive are those of an inertial system with the errors of the settings."
            .to_string(),
    ];
    for r in rows.iter().flatten() {
        let word = bits(&r.reading.word);
        let zone = (r.reading.sure && r.table.code == CodeName::Bch15x7)
            .then(|| Zone::from_message(r.reading.message))
            .flatten();
        let says = zone.map_or_else(|| "no zone that is sure".into(), |z| said(&z));
        out.push(format!("Row {}: last read {word} ({says}).", r.table.name));
    }
    let refused: Vec<String> = steps
        .iter()
        .filter_map(|s| match &s.estimate.no_lane {
            Some(LaneError::Refused { why }) => Some(why.clone()),
            Some(other) => Some(other.to_string()),
            None => None,
        })
        .collect();
    if let Some(first) = refused.first() {
        out.push(format!("{} looks told no lane, the first because: {first}.", refused.len()));
    }
    out
}
