//! `tracks.csv`: one row for each track and frame.

use super::tracker::{Track, TrackState, Tracker};
use crate::formats::csv::Writer;
use std::io::Write;

/// Columns of the table in their order.
pub const TRACK_COLUMNS: [&str; 13] = [
    "frame",
    "time_s",
    "track_id",
    "x_m",
    "y_m",
    "vx_mps",
    "vy_mps",
    "x_std_m",
    "y_std_m",
    "vx_std_mps",
    "vy_std_mps",
    "state",
    "points",
];

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

/// Writes rows as CSV with a header.
///
/// # Errors
/// Returns an error if the output cannot be written.
pub fn write_tracks<W: Write>(out: W, rows: &[TrackRow]) -> std::io::Result<W> {
    let mut table = Writer::new(out, &[], &TRACK_COLUMNS)?;
    for r in rows {
        table.row([
            &r.frame as &dyn std::fmt::Display,
            &r.time_s,
            &r.track_id,
            &r.x_m,
            &r.y_m,
            &r.vx_mps,
            &r.vy_mps,
            &r.x_std_m,
            &r.y_std_m,
            &r.vx_std_mps,
            &r.vy_std_mps,
            &r.state.name(),
            &r.points,
        ])?;
    }
    table.finish()
}
