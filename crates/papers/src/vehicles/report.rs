//! The tables and the picture of the scatter, and its lines for people.

use super::look::{Grid, Look};
use super::numbers::normal_cdf;
use super::published::{Published, published};
use super::scatter::{Row, groups};
use catseye::base::error::Result;
use catseye::road::vehicle::Kind;
use catseye_plot::{Axis, Chart, Curve, Layer, Mark, Pen, Picture, Symbol, curve_pen, lines};
use std::fmt::Write;

/// `statistics.csv`: one statistic a row. Sources stand in comment lines before the head.
pub fn statistics_csv(rows: &[Row]) -> String {
    let mut text = String::new();
    let mut known: Vec<&str> = Vec::new();
    for p in Kind::ALL.into_iter().filter_map(published) {
        if !known.contains(&p.source) && rows.iter().any(|r| r.source == Some(p.source)) {
            known.push(p.source);
            let _ = writeln!(text, "# source {}: {}; {}; {}", known.len(), p.source, p.caveat, p.page);
        }
    }
    text += "group,distance_m,sector,quantity,statistic,unit,looks,ours,published,low,high,outside,source\n";
    let show = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.4}"));
    for r in rows {
        let source = r.source.and_then(|s| known.iter().position(|k| *k == s)).map(|i| (i + 1).to_string());
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{:.4},{},{},{},{},{}",
            r.group,
            r.distance_m,
            r.sector,
            r.quantity,
            r.statistic,
            r.unit,
            r.looks,
            r.ours,
            show(r.published),
            show(r.corridor.map(|c| c[0])),
            show(r.corridor.map(|c| c[1])),
            show(r.outside),
            source.unwrap_or_default()
        );
    }
    text
}

/// `looks.csv`: one look a row; what a frame does not show is empty.
pub fn looks_csv(looks: &[Look]) -> String {
    let mut text = String::from(
        "kind,body,distance_m,aspect_deg,zenith_deg,body_dbsm,points,points_dbsm,strongest_dbsm,along,across,region,inwards_m,\
         spread_along_m,spread_across_m\n",
    );
    let show = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.4}"));
    for l in looks {
        let (s, spot) = (&l.seen, l.seen.strongest);
        let _ = writeln!(
            text,
            "{},{},{},{:.4},{:.4},{},{},{},{},{},{},{},{},{},{}",
            l.kind.name(),
            l.body,
            l.distance_m,
            l.aspect_deg,
            l.zenith_deg,
            show(s.body_dbsm),
            s.points,
            show(s.points_dbsm),
            show(spot.map(|x| x.rcs_dbsm)),
            show(spot.map(|x| x.along)),
            show(spot.map(|x| x.across)),
            spot.map_or("", |x| x.region.name()),
            show(spot.map(|x| x.inwards_m)),
            show(s.spread_m.map(|x| x[0])),
            show(s.spread_m.map(|x| x[1])),
        );
    }
    text
}

/// The lines that the command prints: levels, then places, one line a group and distance.
pub fn summary(grid: &Grid, looks: &[Look], rows: &[Row]) -> String {
    let find = |group: &str, distance_m: f64, sector: &str, quantity: &str, statistic: &str| {
        rows.iter().find(|r| {
            (&*r.group, r.distance_m, r.sector, r.quantity, &*r.statistic)
                == (group, distance_m, sector, quantity, statistic)
        })
    };
    let number = |r: Option<&Row>, digits: usize| r.map_or("-".into(), |r| format!("{:.digits$}", r.ours));
    let mut text = format!(
        "{} looks: {} directions, looks in each: {}; levels in VV at 77 GHz, dBsm, of all echoes of a body as mean power over the band\n\
         (p: probability of so large a Kolmogorov-Smirnov distance under the published law; x dB: outside its corridor of one standard deviation)\n\
         {:12} {:>5} {:>6} {:>7} {:>6} {:>6} {:>5} | {:>9} {:>9} {:>6} {:>6} | {:>8} {:>8} {:>8} | {:>6} {:>6} {:>7}\n",
        looks.len(),
        grid.aspects,
        grid.bodies,
        "",
        "m",
        "mean",
        "median",
        "5 %",
        "95 %",
        "std",
        "published",
        "median",
        "mean",
        "median",
        "front",
        "side",
        "rear",
        "KS",
        "p",
        "p shape"
    );
    for (group, _) in groups(looks) {
        for d in &grid.distances_m {
            let at = |sector: &str, statistic: &str| find(&group, *d, sector, "body", statistic);
            let beside = |sector: &str, statistic: &str| match at(sector, statistic) {
                Some(Row { outside: Some(0.0), .. }) => "inside".into(),
                Some(Row { outside: Some(x), .. }) => format!("{x:+.1}"),
                Some(Row { published: Some(p), ours, .. }) => format!("({:+.1})", ours - p),
                _ => "-".to_string(),
            };
            let theirs = |statistic: &str| {
                at("all", statistic).and_then(|r| r.published).map_or("-".into(), |p| format!("{p:.1}"))
            };
            let _ = writeln!(
                text,
                "{group:12} {d:5} {:>6} {:>7} {:>6} {:>6} {:>5} | {:>9} {:>9} {:>6} {:>6} | {:>8} {:>8} {:>8} | {:>6} {:>6} {:>7}",
                number(at("all", "mean"), 1),
                number(at("all", "median"), 1),
                number(at("all", "p05"), 1),
                number(at("all", "p95"), 1),
                number(at("all", "std"), 1),
                theirs("mean"),
                theirs("median"),
                beside("all", "mean"),
                beside("all", "median"),
                beside("front", "mean"),
                beside("side", "mean"),
                beside("rear", "mean"),
                number(at("all", "ks_distance"), 2),
                number(at("all", "ks_p"), 3),
                number(at("all", "ks_shape_p"), 3),
            );
        }
    }
    let _ = writeln!(
        text,
        "points of a frame, and the strongest one: its level (dBsm), its place and how far inside the outline it lies; spread of points by power\n\
         {:12} {:>5} {:>6} {:>6} {:>6} {:>6} | {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} | {:>8} {:>7} {:>7}",
        "",
        "m",
        "points",
        "seen",
        "mean",
        "median",
        "wheel",
        "corner",
        "front",
        "rear",
        "side",
        "middle",
        "inside m",
        "along",
        "across"
    );
    for (group, _) in groups(looks) {
        for d in &grid.distances_m {
            let place = |statistic: &str| find(&group, *d, "all", "place", statistic);
            let share = |r: Option<&Row>| r.map_or("-".into(), |r| format!("{:.0} %", 100.0 * r.ours));
            let strongest = |statistic: &str| find(&group, *d, "all", "strongest", statistic);
            let _ = writeln!(
                text,
                "{group:12} {d:5} {:>6} {:>6} {:>6} {:>6} | {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} | {:>8} {:>7} {:>7}",
                number(place("points_median"), 1),
                share(strongest("share_seen")),
                number(strongest("mean"), 1),
                number(strongest("median"), 1),
                share(place("share_wheel")),
                share(place("share_corner")),
                share(place("share_front")),
                share(place("share_rear")),
                share(place("share_side")),
                share(place("share_middle")),
                number(place("inwards_median"), 2),
                number(place("spread_along_median"), 2),
                number(place("spread_across_median"), 2),
            );
        }
    }
    let mut said: Vec<&str> = Vec::new();
    for p in groups(looks).iter().filter_map(|(_, kinds)| published(*kinds.first()?)) {
        if !said.contains(&p.source) {
            said.push(p.source);
            let _ = writeln!(text, "source: {} ({})", p.source, p.caveat);
        }
    }
    text.trim_end().to_string()
}

/// Levels over the direction for passenger cars, large vehicles, two-wheelers and people, the distribution of cars about the
/// published law, and where cars' strongest points lie.
///
/// # Errors
/// Returns an error if a panel cannot be drawn.
pub fn picture(grid: &Grid, looks: &[Look]) -> Result<Picture> {
    let groups: [(&str, &[Kind]); 4] = [
        ("passenger cars", &[Kind::Sedan, Kind::Hatchback, Kind::Suv]),
        ("vans and trucks", &[Kind::Van, Kind::Truck, Kind::SemiTrailer]),
        ("two-wheelers with riders (published: a cyclist)", &[Kind::Cyclist, Kind::Motorcycle]),
        ("people on foot (published: an adult)", &[Kind::Pedestrian, Kind::Child]),
    ];
    let mut panels = Vec::new();
    for (name, kinds) in groups {
        let here: Vec<&Look> = looks.iter().filter(|l| kinds.contains(&l.kind)).collect();
        if !here.is_empty() {
            panels.push(levels(name, grid, &here, published(kinds[0])).draw()?);
        }
    }
    let cars: Vec<&Look> = looks.iter().filter(|l| l.kind.class() == "car").collect();
    if !cars.is_empty() {
        panels.push(distribution(grid, &cars).draw()?);
        panels.push(plan(grid, &cars).draw()?);
    }
    Ok(Picture::sheet(&panels, 2))
}

const DOT: Mark = Mark::Dot { radius: 2.6 };

fn levels(name: &str, grid: &Grid, looks: &[&Look], law: Option<Published>) -> Chart {
    let level = |l: &Look| Some([l.aspect_deg, l.seen.body_dbsm?]);
    let all: Vec<[f64; 2]> = looks.iter().filter_map(|l| level(l)).collect();
    let lowest = all.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min).max(-40.0);
    let highest = all.iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max).max(lowest + 10.0);
    let mut chart = Chart::new(
        name,
        Axis::new("direction (deg), 0 from the front, 90 from the left", 0.0, 360.0).degrees(),
        Axis::new("RCS of all echoes (dBsm)", lowest - 3.0, highest + 3.0),
    );
    for (i, d) in grid.distances_m.iter().enumerate() {
        let points = looks.iter().filter(|l| l.distance_m == *d).filter_map(|l| level(l)).collect();
        chart.marks(format!("{d} m"), points, DOT, curve_pen(i).colour);
    }
    if let Some(p) = law {
        let line = |more: f64| -> Vec<[f64; 2]> {
            (0..=720).map(|i| 0.5 * f64::from(i)).map(|a| [a, p.mean_dbsm(a, 90.0) + more]).collect()
        };
        let pen = Pen::solid([25, 25, 25], 1.6);
        chart.layers.push(Layer::Line { points: line(0.0), pen });
        chart.key("published mean", Symbol::Line(pen));
        if let Some(sigma) = p.sigma_db {
            let pen = Pen::dashed([25, 25, 25], 1.0, [5.0, 4.0]);
            // The 5th and the 95th percentile about the median.
            let median = p.median_dbsm(0.0, 90.0) - p.mean_dbsm(0.0, 90.0);
            for side in [-1.0, 1.0] {
                let points = line(median + side * 1.644_853_6 * sigma);
                chart.layers.push(Layer::Line { points, pen });
            }
            chart.key("published 5 and 95 %", Symbol::Line(pen));
        }
    }
    chart
}

fn distribution(grid: &Grid, cars: &[&Look]) -> Chart {
    let mut curves: Vec<Curve> = Vec::new();
    let Some((law, sigma)) = published(Kind::Sedan).and_then(|p| Some((p, p.sigma_db?))) else {
        return lines("", "", "", &curves);
    };
    let step = |i: i32| 0.25 * f64::from(i);
    curves.push(Curve {
        label: "published".into(),
        points: (-100..=80).map(|i| [step(i), normal_cdf(step(i) / sigma)]).collect(),
    });
    for d in &grid.distances_m {
        let off = |l: &Look| Some(l.seen.body_dbsm? - law.median_dbsm(l.aspect_deg, l.zenith_deg));
        let mut off: Vec<f64> = cars.iter().filter(|l| l.distance_m == *d).filter_map(|l| off(l)).collect();
        off.sort_unstable_by(f64::total_cmp);
        let n = off.len() as f64;
        let stairs =
            off.iter().enumerate().flat_map(|(i, x)| [[*x, i as f64 / n], [*x, (i as f64 + 1.0) / n]]);
        curves.push(Curve { label: format!("{d} m"), points: stairs.collect() });
    }
    let mut chart = lines(
        "passenger cars about the published median of their direction",
        "level less the published median (dB)",
        "share of frames",
        &curves,
    );
    chart.x = Axis::new(chart.x.label.clone(), -25.0, 20.0);
    chart
}

/// Middle of each strongest point on a car of length 4.6 m and width 1.8 m, to which all places are scaled.
fn plan(grid: &Grid, cars: &[&Look]) -> Chart {
    const HALF: [f64; 2] = [2.3, 0.9];
    let mut chart = Chart::new(
        "strongest point of passenger cars, scaled to one box",
        Axis::new("along the car (m), front to the right", -3.6, 3.6),
        Axis::new("across (m), left up", -2.2, 2.2),
    )
    .equal_scale(600.0, 400.0);
    let [x, y] = HALF;
    chart.layers.push(Layer::Area {
        polygon: vec![[-x, -y], [x, -y], [x, y], [-x, y]],
        fill: Some(([226, 226, 226], 0.6)),
        stroke: Some(Pen::solid([105, 105, 105], 1.0)),
    });
    for (i, d) in grid.distances_m.iter().enumerate() {
        let at = |l: &Look| l.seen.strongest.map(|s| [s.along * x, s.across * y]);
        let points = cars.iter().filter(|l| l.distance_m == *d).filter_map(|l| at(l)).collect();
        chart.marks(format!("{d} m"), points, DOT, curve_pen(i + 1).colour);
    }
    chart
}
