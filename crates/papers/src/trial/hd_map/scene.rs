//! Counts of a scene over all runs.

use crate::trial::hd_map::drawing::Drawing;
use catseye_lane::hd_map::accuracy::{AccuracyTable, SceneKind, Tally};

/// The ways of reading the same tracks.
pub const READINGS: [&str; 3] = ["as set", "document's line across", "tracks as they are"];

/// Results of one scene over all runs.
#[derive(Default)]
pub struct Scene {
    pub name: String,
    pub document: Option<(u32, f64)>,
    /// Tables by reading; all counts are under one kind of scene.
    pub tables: [AccuracyTable; 3],
    /// Number of right scans and of all scans, by reading.
    pub scans: [[u32; 2]; 3],
    /// Number of wrong scans, by cause.
    pub wrong_scans: [u32; 5],
    pub missed: u32,
    pub strays: [u32; 2],
    /// Errors of the tracks.
    pub errors: Vec<TrackError>,
    pub drawing: Drawing,
}

/// Errors of a track relative to its vehicle's middle.
#[derive(Debug, Clone, Copy)]
pub struct TrackError {
    pub across_m: [f64; 2],
    pub aspect_rad: f64,
}

pub const KIND: SceneKind = SceneKind::Straight;

impl Scene {
    pub fn tally(&self, reading: usize) -> &Tally {
        self.tables[reading].tally(KIND)
    }
}
