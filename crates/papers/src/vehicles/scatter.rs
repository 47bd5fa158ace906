//! Statistics of looks, each beside what is published.

use super::look::{Look, Region};
use super::numbers::{Ks, Summary, normal_cdf, percentile};
use super::published::{Published, published};
use catseye::road::vehicle::Kind;

/// A quarter of the directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sector {
    /// All directions.
    All,
    /// Within 45 degrees of the front.
    Front,
    /// Within 45 degrees of the left or the right.
    Side,
    /// Within 45 degrees of the rear.
    Rear,
}

impl Sector {
    const EACH: [Sector; 4] = [Sector::All, Sector::Front, Sector::Side, Sector::Rear];

    /// Name of the sector in tables.
    pub fn name(self) -> &'static str {
        ["all", "front", "side", "rear"][self as usize]
    }

    fn holds(self, aspect_deg: f64) -> bool {
        let from_front = aspect_deg.rem_euclid(360.0).min(360.0 - aspect_deg.rem_euclid(360.0));
        match self {
            Sector::All => true,
            Sector::Front => from_front < 45.0,
            Sector::Side => (45.0..=135.0).contains(&from_front),
            Sector::Rear => from_front > 135.0,
        }
    }
}

/// The level of a look that is described.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// All echoes of the body.
    Body,
    /// The strongest point.
    Strongest,
    /// The sum of all points.
    Points,
}

impl Quantity {
    const EACH: [Quantity; 3] = [Quantity::Body, Quantity::Strongest, Quantity::Points];

    /// Name of the quantity in tables.
    pub fn name(self) -> &'static str {
        ["body", "strongest", "points"][self as usize]
    }

    fn of(self, look: &Look) -> Option<f64> {
        match self {
            Quantity::Body => look.seen.body_dbsm,
            Quantity::Strongest => look.seen.strongest.map(|s| s.rcs_dbsm),
            Quantity::Points => look.seen.points_dbsm,
        }
    }
}

/// One statistic.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// A kind of the library, or `cars` for all its passenger cars.
    pub group: String,
    /// Distance, m.
    pub distance_m: f64,
    /// Directions.
    pub sector: &'static str,
    /// What is described: body, strongest, points, or place.
    pub quantity: &'static str,
    /// Name of the statistic.
    pub statistic: String,
    /// Unit of all its values.
    pub unit: &'static str,
    /// Number of looks that count.
    pub looks: usize,
    /// The value here.
    pub ours: f64,
    /// The value that is published, for the same directions.
    pub published: Option<f64>,
    /// The corridor: the published value less and plus the published standard deviation of one level.
    pub corridor: Option<[f64; 2]>,
    /// How far ours is outside the corridor: 0 inside, negative below, positive above. None without a corridor.
    pub outside: Option<f64>,
    /// The published value's source.
    pub source: Option<&'static str>,
}

/// The kind of all passenger cars in [`Row::group`].
pub const CARS: &str = "cars";

fn outside(x: f64, [low, high]: [f64; 2]) -> f64 {
    (x - high).max(0.0) + (x - low).min(0.0)
}

/// A row under construction shares these with its neighbours.
struct Of<'a> {
    group: &'a str,
    distance_m: f64,
    law: Option<Published>,
}

impl Of<'_> {
    fn row(&self, sector: Sector, quantity: &'static str, statistic: &str, looks: usize, ours: f64) -> Row {
        Row {
            group: self.group.into(),
            distance_m: self.distance_m,
            sector: sector.name(),
            quantity,
            statistic: statistic.into(),
            unit: "",
            looks,
            ours,
            published: None,
            corridor: None,
            outside: None,
            source: None,
        }
    }

    fn levels(&self, sector: Sector, quantity: Quantity, looks: &[&Look], rows: &mut Vec<Row>) {
        let held: Vec<&&Look> = looks.iter().filter(|l| sector.holds(l.aspect_deg)).collect();
        if held.is_empty() {
            return;
        }
        let seen: Vec<(f64, [f64; 2])> =
            held.iter().filter_map(|l| Some((quantity.of(l)?, [l.aspect_deg, l.zenith_deg]))).collect();
        let (levels, directions): (Vec<f64>, Vec<[f64; 2]>) = seen.into_iter().unzip();
        let share = levels.len() as f64 / held.len() as f64;
        rows.push(self.row(sector, quantity.name(), "share_seen", held.len(), share));
        let Some(ours) = Summary::of(&levels) else { return };
        let expected = self.law.and_then(|p| p.expected(&directions));
        let mean_only = self.law.and_then(|p| p.expected_mean_dbsm(&directions));
        let of = |f: fn(&Summary) -> f64| (f(&ours), expected.as_ref().map(f));
        for (statistic, unit, (value, theirs)) in [
            ("mean", "dBsm", (ours.mean_power_db, mean_only)),
            ("mean_of_db", "dBsm", of(|s| s.mean_db)),
            ("median", "dBsm", of(|s| s.median_db)),
            ("p05", "dBsm", of(|s| s.p05_db)),
            ("p95", "dBsm", of(|s| s.p95_db)),
            ("std", "dB", of(|s| s.std_db)),
        ] {
            let corridor = theirs.zip(self.law.and_then(|p| p.sigma_db)).map(|(t, s)| [t - s, t + s]);
            rows.push(Row {
                unit,
                published: theirs,
                corridor,
                outside: corridor.map(|c| outside(value, c)),
                source: theirs.and(self.law).map(|p| p.source),
                ..self.row(sector, quantity.name(), statistic, ours.count, value)
            });
        }
        let Some((law, sigma)) = self.law.and_then(|p| Some((p, p.sigma_db?))) else { return };
        let off: Vec<f64> =
            levels.iter().zip(&directions).map(|(x, d)| (x - law.median_dbsm(d[0], d[1])) / sigma).collect();
        let mut sorted = off.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let middle = percentile(&sorted, 0.5);
        let centred: Vec<f64> = off.iter().map(|x| x - middle).collect();
        // The law itself, and its shape alone: the levels moved so that their median fits.
        for (name, values) in [("ks", &off), ("ks_shape", &centred)] {
            let Some(ks) = Ks::of(values, normal_cdf) else { continue };
            for (part, value) in [("distance", ks.distance), ("p", ks.p_value)] {
                rows.push(Row {
                    source: Some(law.source),
                    ..self.row(sector, quantity.name(), &format!("{name}_{part}"), ours.count, value)
                });
            }
        }
    }

    fn places(&self, looks: &[&Look], rows: &mut Vec<Row>) {
        let mut put = |statistic: &str, unit: &'static str, count: usize, value: f64| {
            rows.push(Row { unit, ..self.row(Sector::All, "place", statistic, count, value) });
        };
        let sorted = |mut x: Vec<f64>| {
            x.sort_unstable_by(f64::total_cmp);
            x
        };
        let mut spans = |name: &str, unit: &'static str, values: Vec<f64>| {
            let values = sorted(values);
            for (part, share) in [("p05", 0.05), ("median", 0.5), ("p95", 0.95)] {
                if !values.is_empty() {
                    put(&format!("{name}_{part}"), unit, values.len(), percentile(&values, share));
                }
            }
        };
        spans("points", "", looks.iter().map(|l| l.seen.points as f64).collect());
        let spread = |i: usize| looks.iter().filter_map(|l| Some(l.seen.spread_m?[i])).collect::<Vec<f64>>();
        spans("spread_along", "m", spread(0));
        spans("spread_across", "m", spread(1));
        let spots: Vec<_> = looks.iter().filter_map(|l| l.seen.strongest).collect();
        spans("inwards", "m", spots.iter().map(|s| s.inwards_m).collect());
        for region in Region::ALL {
            let there = spots.iter().filter(|s| s.region == region).count();
            if !spots.is_empty() {
                put(&format!("share_{}", region.name()), "", spots.len(), there as f64 / spots.len() as f64);
            }
        }
    }
}

/// All statistics of looks: for each kind, and for all passenger cars where there are several kinds of them, at each distance.
pub fn statistics(looks: &[Look]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (group, kinds) in groups(looks) {
        let mut distances: Vec<f64> = looks.iter().map(|l| l.distance_m).collect();
        distances.sort_unstable_by(f64::total_cmp);
        distances.dedup();
        for distance_m in distances {
            let here: Vec<&Look> =
                looks.iter().filter(|l| kinds.contains(&l.kind) && l.distance_m == distance_m).collect();
            let of = Of { group: &group, distance_m, law: kinds.first().and_then(|k| published(*k)) };
            for quantity in Quantity::EACH {
                for sector in Sector::EACH {
                    of.levels(sector, quantity, &here, &mut rows);
                }
            }
            of.places(&here, &mut rows);
        }
    }
    rows
}

/// Names and kinds of what is described together.
pub fn groups(looks: &[Look]) -> Vec<(String, Vec<Kind>)> {
    let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|k| looks.iter().any(|l| l.kind == *k)).collect();
    let cars: Vec<Kind> = kinds.iter().copied().filter(|k| k.class() == "car").collect();
    let all_cars = (cars.len() > 1).then(|| (CARS.to_string(), cars));
    all_cars.into_iter().chain(kinds.into_iter().map(|k| (k.name().to_string(), vec![k]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicles::look::{Seen, Spot};
    use catseye::base::rng::Draws;

    fn look(kind: Kind, aspect_deg: f64, level: f64) -> Look {
        let spot =
            Spot { rcs_dbsm: level - 1.0, along: 0.9, across: 0.0, region: Region::Front, inwards_m: 0.2 };
        let seen = Seen {
            body_dbsm: Some(level),
            strongest: Some(spot),
            points_dbsm: Some(level),
            points: 3,
            spread_m: Some([0.4, 0.1]),
        };
        Look { kind, body: 0, distance_m: 15.0, aspect_deg, zenith_deg: 90.0, seen }
    }

    fn find<'a>(rows: &'a [Row], group: &str, sector: &str, quantity: &str, statistic: &str) -> &'a Row {
        let is = |r: &&Row| {
            (&*r.group, r.sector, r.quantity, &*r.statistic) == (group, sector, quantity, statistic)
        };
        rows.iter().find(is).unwrap_or_else(|| panic!("{group} {sector} {quantity} {statistic}"))
    }

    /// Levels drawn from the published law lie inside all its corridors and pass the test; 8 dB above they do neither, except that
    /// their shape is still right.
    #[test]
    fn the_law_agrees_with_itself_and_not_with_another() {
        let law = published(Kind::Sedan).unwrap();
        let sample = |more: f64| -> Vec<Look> {
            let mut draws = Draws::new(11, 0);
            let kinds = [Kind::Sedan, Kind::Suv];
            (0..288)
                .map(|i| {
                    let aspect_deg = 1.25 * f64::from(i);
                    let level = law.median_dbsm(aspect_deg, 90.0) + 3.41 * draws.normal() + more;
                    look(kinds[i as usize % 2], aspect_deg, level)
                })
                .collect()
        };
        let rows = statistics(&sample(0.0));
        for sector in ["all", "front", "side", "rear"] {
            for statistic in ["mean", "mean_of_db", "median", "p05", "p95", "std"] {
                let r = find(&rows, CARS, sector, "body", statistic);
                assert_eq!(r.outside, Some(0.0), "{r:?}");
                assert!((r.ours - r.published.unwrap()).abs() < 1.7, "{r:?}");
            }
        }
        assert!(find(&rows, CARS, "all", "body", "ks_p").ours > 0.01);
        assert_eq!(find(&rows, "suv", "all", "body", "median").looks, 144);
        let rows = statistics(&sample(8.0));
        let median = find(&rows, CARS, "all", "body", "median");
        let off = median.ours - median.published.unwrap() - 3.41;
        assert!((median.outside.unwrap() - off).abs() < 1e-9 && off > 3.0, "{median:?}");
        assert!(find(&rows, CARS, "all", "body", "ks_p").ours < 1e-6);
        assert!(find(&rows, CARS, "all", "body", "ks_shape_p").ours > 0.01);
    }

    #[test]
    fn what_is_not_published_has_no_verdict() {
        let rows = statistics(&[look(Kind::Truck, 0.0, 20.0), look(Kind::Cyclist, 90.0, -5.0)]);
        let truck = find(&rows, "truck", "all", "body", "mean");
        assert_eq!((truck.published, truck.outside, truck.source), (None, None, None));
        let cyclist = find(&rows, "cyclist", "side", "body", "mean");
        assert_eq!((cyclist.published, cyclist.outside), (Some(-8.1), None));
        assert!(cyclist.source.is_some());
        assert_eq!(find(&rows, "truck", "all", "place", "share_front").ours, 1.0);
        assert_eq!(find(&rows, "truck", "all", "place", "points_median").ours, 3.0);
        assert_eq!(outside(-9.0, [-5.0, 2.0]), -4.0);
        assert_eq!(outside(3.0, [-5.0, 2.0]), 1.0);
    }
}
