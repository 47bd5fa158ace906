//! `tracks.csv`: one row for each track and frame.

use super::files::write_rows;
use super::tracker::{Track, TrackState, Tracker};
use crate::formats::column::{Column, Get};
use std::io::Write;

/// Columns of the table in their order. Positions and velocities are over the ground, in the world's plane.
pub const TRACKS: [Column<TrackRow>; 14] = [
    Column { name: "frame", about: "number of the frame", get: Get::Count(|r| r.frame) },
    Column::number("time_s", "time of the middle of the frame, from the middle of frame 0", |r| r.time_s),
    Column {
        name: "track_id",
        about: "number of the track, unique in a run",
        get: Get::Count(|r| r.track_id as u32),
    },
    Column::number("x_m", "position along the world's x axis", |r| r.x_m),
    Column::number("y_m", "position along the world's y axis", |r| r.y_m),
    Column::number("vx_mps", "velocity over the ground along the world's x axis", |r| r.vx_mps),
    Column::number("vy_mps", "velocity over the ground along the world's y axis", |r| r.vy_mps),
    Column::number("x_std_m", "standard deviation of x_m", |r| r.x_std_m),
    Column::number("y_std_m", "standard deviation of y_m", |r| r.y_std_m),
    Column::number("vx_std_mps", "standard deviation of vx_mps", |r| r.vx_std_mps),
    Column::number("vy_std_mps", "standard deviation of vy_mps", |r| r.vy_std_mps),
    Column {
        name: "state",
        about: "confirmed: updated in this frame; coasting: predicted from earlier frames",
        get: Get::Text(12, |r| r.state.name().into()),
    },
    Column {
        name: "points",
        about: "number of points of the track's plot in this frame; 0 while coasting",
        get: Get::Count(|r| r.points as u32),
    },
    Column::flag(
        "moving",
        "true: the speed over the ground exceeds 0.5 m/s and three standard deviations",
        |r| r.moving,
    ),
];

/// Slowest speed of what counts as moving, m/s: below it standing objects and slow pedestrians are not distinguished.
const SLOWEST_MPS: f64 = 0.5;

/// A track as it was after a frame, in the tracker's plane.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrackRow {
    /// Number of the frame.
    pub frame: u32,
    /// Time of the frame, s.
    pub time_s: f64,
    /// Number of the track.
    pub track_id: u64,
    /// Position along x, m.
    pub x_m: f64,
    /// Position along y, m.
    pub y_m: f64,
    /// Velocity along x, m/s.
    pub vx_mps: f64,
    /// Velocity along y, m/s.
    pub vy_mps: f64,
    /// Standard deviation along x, m.
    pub x_std_m: f64,
    /// Standard deviation along y, m.
    pub y_std_m: f64,
    /// Standard deviation of the velocity along x, m/s.
    pub vx_std_mps: f64,
    /// Standard deviation of the velocity along y, m/s.
    pub vy_std_mps: f64,
    /// State of the track.
    pub state: TrackState,
    /// Points of its plot in this frame; 0 while coasting.
    pub points: usize,
    /// Whether its speed over the ground exceeds 0.5 m/s and three standard deviations.
    #[serde(default)]
    pub moving: bool,
}

impl TrackRow {
    /// The row of a track after a frame.
    pub fn of(frame: u32, time_s: f64, track: &Track) -> TrackRow {
        let [x_m, y_m, vx_mps, vy_mps] = track.estimate.state.to_array();
        let p = &track.estimate.covariance;
        TrackRow {
            frame,
            time_s,
            track_id: track.id,
            x_m,
            y_m,
            vx_mps,
            vy_mps,
            x_std_m: p.x_axis.x.sqrt(),
            y_std_m: p.y_axis.y.sqrt(),
            vx_std_mps: p.z_axis.z.sqrt(),
            vy_std_mps: p.w_axis.w.sqrt(),
            state: track.state,
            points: track.points,
            moving: is_moving(track),
        }
    }

    /// Rows of a frame, by id: all tracks, or only confirmed and coasting ones.
    pub fn of_frame(frame: u32, time_s: f64, tracker: &Tracker, tentative: bool) -> Vec<TrackRow> {
        tracker
            .tracks()
            .iter()
            .filter(|t| tentative || t.state != TrackState::Tentative)
            .map(|t| TrackRow::of(frame, time_s, t))
            .collect()
    }
}

/// Whether a track's speed over the ground is certain to be more than none.
pub fn is_moving(track: &Track) -> bool {
    let v = glam::DVec2::new(track.estimate.state.z, track.estimate.state.w);
    let (speed, p) = (v.length(), &track.estimate.covariance);
    let variance = v.x * v.x * p.z_axis.z + 2.0 * v.x * v.y * p.z_axis.w + v.y * v.y * p.w_axis.w;
    speed > SLOWEST_MPS && speed > 3.0 * variance.max(0.0).sqrt() / speed
}

/// Writes rows as CSV with a header; the columns are [`TRACKS`].
///
/// # Errors
/// Returns an error if the output cannot be written.
pub fn write_tracks<W: Write>(out: W, rows: &[TrackRow]) -> std::io::Result<W> {
    write_rows(out, &TRACKS, rows)
}
