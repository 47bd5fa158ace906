//! `points.csv` and `returns.csv`.

use super::points::Point;
use crate::adc::synthesis::Levels;
use crate::base::frames::angles_from_direction;
use crate::base::units::dbm_from_w;
use crate::formats::csv::Writer;
use crate::scene::radar::Radar;
use crate::trace::Echoes;
use std::io::Write;

/// Standard deviations are empty where the array cannot tell the angle, and `range_rate_modulo_mps` is where nothing folds. `ghost`,
/// `at_search_edge` and `side_lobe` are 0 or 1; `share` is a share of power (CONVENTIONS eq. 160).
pub const POINT_COLUMNS: [&str; 23] = [
    "range_m",
    "range_rate_mps",
    "azimuth_deg",
    "elevation_deg",
    "x_m",
    "y_m",
    "z_m",
    "power_dbm",
    "snr_db",
    "rcs_dbsm",
    "object_id",
    "class",
    "range_std_m",
    "range_rate_std_mps",
    "azimuth_std_deg",
    "elevation_std_deg",
    "ambiguity",
    "bounces",
    "ghost",
    "share",
    "range_rate_modulo_mps",
    "at_search_edge",
    "side_lobe",
];

/// `chain` is the ids of the objects met, in order, with blanks between. Angles are those of arrival;
/// power is the mean over channels, of this echo alone.
pub const RETURN_COLUMNS: [&str; 7] =
    ["range_m", "range_rate_mps", "azimuth_deg", "elevation_deg", "power_dbm", "chain", "bounces"];

/// Writes points as CSV with a header; columns in docs/reference/files.md.
///
/// # Errors
/// What the writer fails with.
pub fn write_points<W: Write>(out: W, points: &[Point]) -> std::io::Result<W> {
    let mut table = Writer::new(out, &[], &POINT_COLUMNS)?;
    let degrees = |x: Option<f64>| x.map_or_else(String::new, |r| r.to_degrees().to_string());
    for p in points {
        table.row([
            &p.range_m as &dyn std::fmt::Display,
            &p.range_rate_mps,
            &p.azimuth_rad.to_degrees(),
            &p.elevation_rad.to_degrees(),
            &p.position_m.x,
            &p.position_m.y,
            &p.position_m.z,
            &p.power_dbm,
            &p.snr_db,
            &p.rcs_dbsm,
            &p.object_id,
            &p.class,
            &p.std.range_m,
            &p.std.range_rate_mps,
            &degrees(p.std.azimuth_rad),
            &degrees(p.std.elevation_rad),
            &p.ambiguity.name(),
            &p.bounces,
            &u8::from(p.ghost),
            &p.share,
            &if p.modulo_mps.is_finite() { p.modulo_mps.to_string() } else { String::new() },
            &u8::from(p.at_search_edge),
            &u8::from(p.side_lobe),
        ])?;
    }
    table.finish()
}

/// Writes echoes as CSV with a header; columns in docs/reference/files.md.
///
/// # Errors
/// What the writer fails with.
pub fn write_echoes<W: Write>(out: W, radar: &Radar, echoes: &Echoes) -> std::io::Result<W> {
    let mut table = Writer::new(out, &[], &RETURN_COLUMNS)?;
    let levels = Levels::new(radar);
    for r in &echoes.list {
        let (azimuth, elevation) = angles_from_direction(r.arrival);
        let chain: Vec<String> = r.chain.iter().take_while(|id| **id != 0).map(u32::to_string).collect();
        table.row([
            &r.range_m() as &dyn std::fmt::Display,
            &r.range_rate_mps(),
            &azimuth.to_degrees(),
            &elevation.to_degrees(),
            &dbm_from_w(levels.amplitude(r).norm_sqr()),
            &chain.join(" "),
            &r.bounces,
        ])?;
    }
    table.finish()
}
