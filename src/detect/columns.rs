//! The columns of points and echoes, each told once: `points.csv` and `returns.csv`, the tables of datasets, Python's structured
//! arrays and the page of tables in the manual are made of these lists.

use super::points::Point;
use super::spectra::SpectrumCell;
use crate::adc::synthesis::Levels;
use crate::base::frames::angles_from_direction;
use crate::base::units::dbm_from_w;
use crate::formats::column::{Column, Get};
use crate::scene::radar::Radar;
use crate::trace::{Echo, Echoes};
use std::borrow::Cow;

/// Columns of detected points, in the sensor frame. Standard deviations are not a number where the array cannot tell the angle, and
/// `range_rate_modulo_mps` is infinite where nothing folds; `share` is a share of power (CONVENTIONS eq. 160).
pub const POINTS: [Column<Point>; 27] = [
    Column::number("range_m", "range in the middle of the frame", |p| p.range_m),
    Column::number("range_rate_mps", "range rate, positive when the target recedes", |p| p.range_rate_mps),
    Column::number("azimuth_deg", "azimuth, positive to the left", |p| p.azimuth_rad.to_degrees()),
    Column::number("elevation_deg", "elevation, positive up", |p| p.elevation_rad.to_degrees()),
    Column::number("x_m", "forward coordinate", |p| p.position_m.x),
    Column::number("y_m", "left coordinate", |p| p.position_m.y),
    Column::number("z_m", "up coordinate", |p| p.position_m.z),
    Column::number("power_dbm", "power after beamforming, at the interpolated peak", |p| p.power_dbm),
    Column::number(
        "snr_db",
        "signal-to-noise ratio: power after beamforming relative to the noise of one channel in a cell",
        |p| p.snr_db,
    ),
    Column::number("rcs_dbsm", "radar cross section in the antennas' polarisation", |p| p.rcs_dbsm),
    Column {
        name: "object_id",
        about: "id of the object whose echoes caused the point, 0 for none",
        get: Get::Count(|p| p.object_id),
    },
    Column {
        name: "class",
        about: "class of the object; for a point without an object: leakage (inside the radar), noise (also other radars) or weather",
        get: Get::Text(32, |p| Cow::Borrowed(&p.class)),
    },
    Column::number("range_std_m", "standard deviation of the range", |p| p.std.range_m),
    Column::number("range_rate_std_mps", "standard deviation of the range rate", |p| p.std.range_rate_mps),
    Column::number(
        "azimuth_std_deg",
        "standard deviation of the azimuth; NaN where the array does not measure it",
        |p| degrees(p.std.azimuth_rad),
    ),
    Column::number(
        "elevation_std_deg",
        "standard deviation of the elevation; NaN where the array does not measure it",
        |p| degrees(p.std.elevation_rad),
    ),
    Column {
        name: "ambiguity",
        about: "ambiguity of the range rate: unambiguous, resolved, ego_speed, ambiguous or unresolved",
        get: Get::Text(12, |p| p.ambiguity.name().into()),
    },
    Column {
        name: "bounces",
        about: "number of bounces of the point's strongest echo",
        get: Get::Small(|p| p.bounces),
    },
    Column::flag(
        "ghost",
        "true: the point is not at its object, because its strongest echo was also reflected by another object, or more than once",
        |p| p.ghost,
    ),
    Column::number("share", "share of the object in the power of the cell's echoes, 0 to 1", |p| p.share),
    Column {
        name: "range_rate_modulo_mps",
        about: "ambiguity interval of the range rate that the radar itself leaves; infinite: unambiguous",
        get: Get::Bound(|p| p.modulo_mps),
    },
    Column::flag(
        "at_search_edge",
        "true: the direction is at the edge of the searched angles: a bound, not a measurement",
        |p| p.at_search_edge,
    ),
    Column::flag(
        "side_lobe",
        "true: the point is in a side lobe of its strongest echo, which is elsewhere in range, range rate or direction",
        |p| p.side_lobe,
    ),
    Column::flag(
        "folded",
        "true: the point's position is wrong by an ambiguity interval of range rate (which shifts the range), range or direction",
        |p| p.folded,
    ),
    Column::flag(
        "aliased",
        "true: the point's strongest echo is beyond the sampled band of beat frequencies",
        |p| p.aliased,
    ),
    Column {
        name: "angle_ambiguity",
        about: "ambiguity of the direction: unambiguous, resolved (grating lobes ruled out) or ambiguous; empty without a direction",
        get: Get::Text(12, |p| p.angle_ambiguity.map_or("", |a| a.name()).into()),
    },
    Column {
        name: "other_angles_deg",
        about: "azimuth/elevation of up to four alternative directions of an ambiguous point, separated by blanks",
        get: Get::Text(64, |p| other_angles(&p.other_angles_rad).into()),
    },
];

fn other_angles(angles_rad: &[[f64; 2]]) -> String {
    let pair = |a: &[f64; 2]| format!("{:.2}/{:.2}", a[0].to_degrees(), a[1].to_degrees());
    angles_rad.iter().take(4).map(pair).collect::<Vec<_>>().join(" ")
}

/// The flags of [`POINTS`] that say that a point is not where its object is; at most one is set.
pub const OUT_OF_PLACE: [&str; 4] = ["ghost", "side_lobe", "folded", "aliased"];

fn degrees(angle_rad: Option<f64>) -> f64 {
    angle_rad.map_or(f64::NAN, f64::to_degrees)
}

/// Columns of the cells of `angle_spectra.npy`, in the order of its first axis.
pub const ANGLE_CELLS: [Column<SpectrumCell>; 4] = [
    Column { name: "range_bin", about: "column of the range-Doppler map", get: Get::Count(|c| c.range_bin) },
    Column { name: "doppler_row", about: "row of the range-Doppler map", get: Get::Count(|c| c.doppler_row) },
    Column::number("range_m", "range of the interpolated peak, in the middle of the frame", |c| c.range_m),
    Column::number(
        "range_rate_mps",
        "range rate of the peak, positive when the target recedes; the Doppler ambiguity is resolved as far as the cell alone allows",
        |c| c.range_rate_mps,
    ),
];

/// An echo as its radar hears it.
pub struct ReceivedEcho<'a> {
    /// The echo.
    pub echo: &'a Echo,
    /// Power of this echo alone, mean over channels, dBm.
    pub power_dbm: f64,
    /// Azimuth and elevation of arrival, degrees.
    pub angles_deg: [f64; 2],
}

/// The echoes of a frame as their radar hears them, in their order.
pub fn received<'a>(radar: &Radar, echoes: &'a Echoes) -> Vec<ReceivedEcho<'a>> {
    let levels = Levels::new(radar);
    let received = |echo: &'a Echo| {
        let (azimuth, elevation) = angles_from_direction(echo.arrival);
        ReceivedEcho {
            echo,
            power_dbm: dbm_from_w(levels.amplitude(echo).norm_sqr()),
            angles_deg: [azimuth, elevation].map(f64::to_degrees),
        }
    };
    echoes.list.iter().map(received).collect()
}

/// Columns of echoes as the tracer found them, in the sensor frame.
pub const fn echoes<'a>() -> [Column<ReceivedEcho<'a>>; 7] {
    [
        Column::number("range_m", "range: half the path length, in the middle of the frame", |e| {
            e.echo.range_m()
        }),
        Column::number("range_rate_mps", "range rate, positive when the target recedes", |e| {
            e.echo.range_rate_mps()
        }),
        Column::number("azimuth_deg", "azimuth of arrival, positive to the left", |e| e.angles_deg[0]),
        Column::number("elevation_deg", "elevation of arrival, positive up", |e| e.angles_deg[1]),
        Column::number("power_dbm", "power of this echo alone, mean over channels", |e| e.power_dbm),
        Column {
            name: "chain",
            about: "ids of the objects that the path meets, in order",
            get: Get::Ids(|e| e.echo.chain),
        },
        Column { name: "bounces", about: "number of bounces", get: Get::Small(|e| e.echo.bounces) },
    ]
}
