//! What is counted of a scene over all runs.

use crate::trial::hd_map::drawing::Drawing;
use catseye_lane::hd_map::accuracy::{AccuracyTable, SceneKind, Tally};

/// The ways of reading the same tracks.
pub const READINGS: [&str; 3] = ["as set", "document's line across", "tracks as they are"];

/// Of one scene, over all runs.
#[derive(Default)]
pub struct Scene {
    pub name: String,
    pub document: Option<(u32, f64)>,
    /// By reading; all under one kind of the table.
    pub tables: [AccuracyTable; 3],
    /// Right and all scans, by reading.
    pub scans: [[u32; 2]; 3],
    /// Of scans, by cause.
    pub wrong_scans: [u32; 5],
    pub missed: u32,
    pub strays: [u32; 2],
    /// (tracked, moved to the middle) across towards the radar, along; range; aspect.
    pub errors: Vec<TrackError>,
    pub drawing: Drawing,
}

/// Of a track against its vehicle's middle.
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
