//! Tables of cross sections: rows of one frequency and direction are compared, with levels where they count.

use super::differences::{Difference, DifferenceTally, Tolerances, number};
use super::measure::Measure;
use catseye::base::error::Result;
use catseye::formats::rcs_csv::{self, RawRow};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Polarisations in the order of the columns, receive first, and their places in S.
const CHANNELS: [(&str, usize, usize); 4] = [("vv", 0, 0), ("vh", 0, 1), ("hv", 1, 0), ("hh", 1, 1)];

/// Frequency to the hertz and angles to a millionth of a degree, and how often the same stood before.
type Key = ([i64; 5], usize);

fn keyed(rows: &[RawRow]) -> BTreeMap<Key, &RawRow> {
    let mut seen: BTreeMap<[i64; 5], usize> = BTreeMap::new();
    let micro = |x: f64| (x * 1e6).round() as i64;
    let key = |r: &RawRow| {
        let (rx_azimuth, rx_elevation) = r.receive_deg.unwrap_or((0.0, 0.0));
        let angles = [r.azimuth_deg, r.elevation_deg, rx_azimuth, rx_elevation].map(micro);
        [r.frequency_hz.round() as i64, angles[0], angles[1], angles[2], angles[3]]
    };
    rows.iter()
        .map(|r| {
            let n = seen.entry(key(r)).or_default();
            *n += 1;
            ((key(r), *n), r)
        })
        .collect()
}

fn told(r: &RawRow) -> Value {
    json!(format!("{} Hz, azimuth {} deg, elevation {} deg", r.frequency_hz, r.azimuth_deg, r.elevation_deg))
}

fn place(r: &RawRow, other: &RawRow) -> String {
    let lines = match r.line == other.line {
        true => format!("line {}", r.line),
        false => format!("line {}, line {}", r.line, other.line),
    };
    format!("{lines} (azimuth {} deg, elevation {} deg)", r.azimuth_deg, r.elevation_deg)
}

/// Compares two tables as `catseye rcs` writes them.
///
/// # Errors
/// Returns `BadInput` for a table that does not hold cross sections.
pub fn compare(file: &str, a: &Path, b: &Path, t: &Tolerances, found: &mut DifferenceTally) -> Result<()> {
    let (a, b) = (rcs_csv::read(a)?.1, rcs_csv::read(b)?.1);
    let bistatic = [&a, &b].map(|rows| rows.iter().any(|r| r.receive_deg.is_some()));
    if bistatic[0] != bistatic[1] {
        found.note(Difference::unequal(
            file,
            "receiver's direction",
            "header",
            bistatic[0].into(),
            bistatic[1].into(),
        ));
        return Ok(());
    }
    let peak = a.iter().chain(&b).flat_map(|r| r.dbsm);
    let peak = peak.filter(|x| x.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let least = match t.above_db.is_finite() {
        true => peak - t.above_db,
        false => f64::NEG_INFINITY,
    };
    let (level, phase) = (Measure::level(t), t.phase_deg.unwrap_or(f64::INFINITY));
    let levels = CHANNELS.map(|(name, _, _)| format!("{name}_dbsm"));
    let (here, there) = (keyed(&a), keyed(&b));
    for (key, x) in &here {
        let Some(y) = there.get(key) else {
            found.note(Difference::unequal(
                file,
                "missing in B",
                format!("line {}", x.line),
                told(x),
                Value::Null,
            ));
            continue;
        };
        for (c, (name, rx, tx)) in CHANNELS.iter().enumerate() {
            let (p, q) = (x.dbsm[c], y.dbsm[c]);
            found.values += 1;
            // Above is true of NaN on one side.
            if p <= least && q <= least {
                continue;
            }
            let d = level.apart(p, q, 0.0);
            found.measure(&levels[c], (d.apart, d.allowed), d.unit, || place(x, y));
            if d.is_too_far() {
                let of = Difference::unequal(file, &levels[c], place(x, y), number(p), number(q));
                found.note(of.by(d.apart, d.allowed, d.unit));
            }
            if phase.is_finite() {
                let (s, z) = (x.s[*rx][*tx], y.s[*rx][*tx]);
                let turn = (s * z.conj()).arg().to_degrees().abs();
                if turn > phase || (turn.is_nan() && !(s.is_nan() && z.is_nan())) {
                    let degrees = [s, z].map(|z| number(z.arg().to_degrees()));
                    let [s, z] = degrees;
                    let of = Difference::unequal(file, &format!("{name} phase"), place(x, y), s, z);
                    found.note(of.by(turn, phase, "deg"));
                }
            }
        }
    }
    for (_, y) in there.iter().filter(|(key, _)| !here.contains_key(key)) {
        found.note(Difference::unequal(file, "extra in B", format!("line {}", y.line), Value::Null, told(y)));
    }
    Ok(())
}
