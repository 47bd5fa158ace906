//! Values and tables of the trial.

use crate::trial::kit::*;
use crate::trial::signature::looks::{Located, RowPicture, WordRead, Worse, stds};
use crate::trial::signature::mapped::Moving;
use crate::trial::signature::settings::{CodeName, RowTable, Settings, bits};
use catseye_lane::signature::codewords::{Reading, Zone};
use catseye_lane::signature::map::SignatureMap;
use std::fmt::Display;

pub(super) fn place_rows(rows: &mut Vec<Row>, places: &[Located]) {
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
    let none = "the document gives no figure";
    rows.mean("position error in the plane (rms)", "m", &plane).why(format!("{none}; asked for: below 0.2"));
    rows.mean("position error along the road (rms)", "m", &rms(0)).why(none);
    rows.mean("position error across the road (rms)", "m", &rms(1)).why(none);
    rows.mean("heading error of the position (rms)", "deg", &heading).why(none);
    rows.one("largest position error", "m", worst).why("over all frames with a position");
    rows.mean("frames with a position", "%", &share(&|p| p.place.is_some()));
    rows.mean("frames with a position within 0.2 m", "%", &share(&|p| error(p).is_some_and(|e| e < 0.2)));
    let wrong = share(&|p| error(p).is_some_and(|e| e > 0.5));
    rows.mean("frames with a wrong position (over 0.5 m)", "%", &wrong);
    rows.mean("first search along the whole map right", "%", &first)
        .why("without GNSS and without prior knowledge");
    rows.mean("squared error over its covariance, per degree of freedom", "", &nees)
        .why("1 where the covariance is correct; the error of the map is common to all frames");
}

pub(super) fn map_rows(rows: &mut Vec<Row>, map: &SignatureMap, errors: &[f64], moving: &Moving) {
    rows.one("landmarks of the map", "", Some(map.landmarks().len() as f64));
    if let Some(rms) = rms(errors.iter().copied()) {
        rows.one("distance of landmarks from their markers (rms)", "m", Some(rms))
            .why("of those within 0.5 m of a marker; inertial error in it");
    }
    let mut taken_out = |what: &str, [all, out]: [usize; 2], why: &str| {
        if all > 0 {
            let share = 100.0 * out as f64 / all as f64;
            rows.one(format!("points of {what} objects removed"), "%", Some(share)).why(why);
        }
    };
    taken_out("moving", moving.moving, "by range rate and own speed, as the document asks");
    taken_out("standing", moving.standing, "");
}

pub(super) fn word_rows(rows: &mut Vec<Row>, s: &Settings, words: &[WordRead]) {
    for (i, table) in s.row.iter().enumerate().filter(|(_, t)| t.word.is_some()) {
        for worse in [Worse::No, Worse::Row, Worse::Looks] {
            let shares = format!("{:.0} % missing and {:.0} % extra", 100.0 * s.worse, 100.0 * s.worse);
            let with = match worse {
                Worse::No => String::new(),
                Worse::Row => format!(", {shares}"),
                Worse::Looks => format!(", {shares} in each frame separately"),
            };
            let over_runs = |of: &dyn Fn(&[&WordRead]) -> Option<f64>| {
                over_runs(
                    words,
                    |w| w.run,
                    |run| {
                        let all: Vec<&WordRead> =
                            run.iter().copied().filter(|w| (w.row, w.worse) == (i, worse)).collect();
                        of(&all)
                    },
                )
            };
            let sure = |w: &WordRead| w.reading.as_ref().is_some_and(|r| r.sure);
            let is_read = |w: &WordRead, right: bool| sure(w) && w.right == Some(right);
            let share = |right: bool| {
                over_runs(&|all| {
                    let count = all.iter().filter(|w| is_read(w, right)).count();
                    Some(100.0 * count as f64 / all.len().max(1) as f64)
                })
            };
            let last = over_runs(&|all| {
                let w = all.iter().max_by_key(|w| w.frame)?;
                Some(if is_read(w, true) { 100.0 } else { 0.0 })
            });
            let name = &table.name;
            rows.mean(format!("word of the row {name} decoded at the end{with}"), "%", &last)
                .why("correct and certain; the document asks for words and gives no code");
            rows.mean(format!("frames in which the row {name} is decoded{with}"), "%", &share(true));
            let wrongly =
                format!("frames in which the row {name} is decoded wrongly, but called certain{with}");
            rows.mean(wrongly, "%", &share(false));
        }
    }
}

pub(super) fn sheets(s: &Settings, map: &SignatureMap, places: &[Located], words: &[WordRead]) -> Vec<Sheet> {
    let opt = |v: Option<f64>| fixed(v, 4);
    let f = |v: f64| opt(Some(v));
    fn text<T: Display>(v: Option<T>) -> String {
        v.map_or_else(String::new, |v| v.to_string())
    }
    let mut of_map = Sheet::new("map", "x_m y_m std_x_m std_y_m hits occupancy");
    for l in map.landmarks() {
        let ([x, y], [xx, _, yy]) = (l.position_m, l.covariance_m2);
        let [x, y, std_x, std_y] = [x, y, xx.max(0.0).sqrt(), yy.max(0.0).sqrt()].map(f);
        of_map.row(&[&x, &y, &std_x, &std_y, &l.hits, &f(l.occupancy())]);
    }
    let columns = "run time_s way_m true_x_m true_y_m x_m y_m along_m across_m heading_deg std_along_m std_across_m points \
                   explained rivals probability tracked";
    let mut of_places = Sheet::new("places", columns);
    for p in places {
        let (vehicle, radar) = (p.place.as_ref().map(|q| &q.vehicle), p.place.as_ref().map(|q| &q.radar));
        let [along, across] = p.place.as_ref().map(stds).map_or([None; 2], |s| s.map(Some));
        let mut row = vec![p.run.to_string()];
        row.extend([p.time_s, p.way_m, p.truth.x_m, p.truth.y_m].map(f));
        row.extend([vehicle.map(|v| v.x_m), vehicle.map(|v| v.y_m)].map(opt));
        row.extend([0, 1].map(|k| opt(p.error.map(|e| e[k]))));
        row.extend([p.error.map(|e| e[2].to_degrees()), along, across].map(opt));
        row.extend([text(radar.map(|r| r.points)), opt(radar.map(|r| r.explained))]);
        row.extend([text(radar.map(|r| r.rivals.len())), opt(radar.map(|r| r.probability))]);
        row.push(text(p.place.as_ref().map(|q| u8::from(q.tracked))));
        of_places.rows.push(row);
    }
    if s.row.is_empty() {
        return vec![of_map, of_places];
    }
    let columns = "run frame row worse points word log_odds sure right missing extra zone";
    let mut of_words = Sheet::new("words", columns);
    for w in words {
        let r = w.reading.as_ref();
        let zone = r.and_then(|r| zone(&s.row[w.row], r));
        let [sure, right] = [r.map(|r| r.sure), w.right].map(|v| text(v.map(u8::from)));
        let [missing, extra] = [text(r.map(|r| r.missing)), text(r.map(|r| r.extra))];
        let (word, odds) = (text(r.map(|r| bits(&r.word))), opt(r.map(|r| r.log_odds)));
        let (name, worse, zone) = (&s.row[w.row].name, w.worse as u8, text(zone.map(|z| said(&z))));
        let whose: [&dyn Display; 5] = [&w.run, &w.frame, name, &worse, &w.points];
        of_words.row(&[&whose[..], &[&word, &odds, &sure, &right, &missing, &extra, &zone]].concat());
    }
    vec![of_map, of_places, of_words]
}

/// Meaning of a row's word, where the reading is sure and its code has zones.
fn zone(table: &RowTable, r: &Reading) -> Option<Zone> {
    (r.sure && table.code == CodeName::Bch15x7).then(|| Zone::from_message(r.message)).flatten()
}

/// A zone as text.
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
        "Lane lines come from a survey in the map's coordinates; the position of the vehicle comes from \
         radar points alone, without GNSS. Poses of the mapped drive are those of an inertial system with \
         the errors of the settings."
            .to_string(),
    ];
    for r in rows.iter().flatten() {
        let word = bits(&r.reading.word);
        let says = zone(&r.table, &r.reading).map_or_else(|| "no certain zone".into(), |z| said(&z));
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
        out.push(format!("{} frames have no lane, the first because: {first}.", refused.len()));
    }
    out
}
