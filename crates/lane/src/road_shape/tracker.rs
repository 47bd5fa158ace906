//! Tracks both edges of the road, scan after scan: gate, vote, fit, filter (Miyake, section IV).

use super::{
    ClothoidFilter, ClothoidSettings, EdgeFit, Ego, FitSettings, HoughSettings, Peak, RadarMount, RoadWidth,
    Side, StaticGate, StaticPoint, Update, VoteMap, fit_edge, fit_parallel, static_points,
};
use crate::error::{Result, finite, not_negative, positive};
use serde::{Deserialize, Serialize};

/// Settings of every step from peaks to tracked edges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerSettings {
    /// Position and yaw of the radar.
    pub mount: RadarMount,
    /// Gate of the stationary points.
    pub gate: StaticGate,
    /// Settings of the vote.
    pub hough: HoughSettings,
    /// Settings of the refinement.
    pub fit: FitSettings,
    /// Settings of the filter.
    pub filter: ClothoidSettings,
    /// Whether both edges are sought with one curvature, which is passed on to an edge that is not seen.
    pub parallel: bool,
    /// Known distance between the edges; used only with `parallel`.
    pub width: Option<RoadWidth>,
    /// Number of scans with the edge until it is confirmed.
    pub confirm_scans: usize,
    /// Time after which an edge that is not seen is dropped, s.
    pub coast_s: f64,
    /// Distance driven after which an edge that is not seen is dropped, m.
    pub coast_m: f64,
    /// Standard deviation of b at which an edge that is not seen is dropped, m.
    pub coast_b_std_m: f64,
    /// Number of successive scans refused by the gate after which the edge is started again.
    pub restart_scans: usize,
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self {
            mount: RadarMount::default(),
            gate: StaticGate::default(),
            hough: HoughSettings::default(),
            fit: FitSettings::default(),
            filter: ClothoidSettings::default(),
            parallel: false,
            width: None,
            confirm_scans: 3,
            coast_s: 3.0,
            coast_m: 60.0,
            coast_b_std_m: 1.5,
            restart_scans: 5,
        }
    }
}

/// Status of a tracked edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeStatus {
    /// The edge is seen, but not yet often enough.
    Tentative,
    /// The edge was seen often enough to be stated.
    Confirmed,
    /// The edge was confirmed and is not seen in this scan.
    Coasting,
}

/// State of one edge after a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeTrack {
    /// The side of the vehicle on which the edge lies.
    pub side: Side,
    /// How far the edge is established.
    pub status: EdgeStatus,
    /// The filter that follows the edge.
    pub filter: ClothoidFilter,
    /// Number of scans in which it was seen.
    pub hits: usize,
    /// Time since it was last seen, s.
    pub unseen_s: f64,
    /// Distance driven since it was last seen, m.
    pub unseen_m: f64,
    refused: usize,
}

/// Result of one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct RoadShape {
    /// Stationary points in the vehicle frame.
    pub points: Vec<StaticPoint>,
    /// Number of moving peaks.
    pub moving: usize,
    /// Fit of this scan for left and right, or the reason why there is none.
    pub fits: [Result<EdgeFit>; 2],
    /// Filter update for left and right; None where the filter was started, or there was no fit.
    pub updates: [Option<Update>; 2],
    /// Left and right edge after this scan.
    pub edges: [Option<EdgeTrack>; 2],
}

impl RoadShape {
    /// The edge on one side, where one is tracked.
    pub fn edge(&self, side: Side) -> Option<&EdgeTrack> {
        self.edges[side.index()].as_ref()
    }
}

/// Tracks both edges.
#[derive(Debug, Clone)]
pub struct RoadTracker {
    settings: TrackerSettings,
    pub(super) edges: [Option<EdgeTrack>; 2],
}

impl RoadTracker {
    /// Makes a tracker without tracks.
    ///
    /// # Errors
    /// Returns an error for the first setting outside its range.
    pub fn new(settings: &TrackerSettings) -> Result<Self> {
        settings.hough.validate()?;
        settings.fit.validate()?;
        settings.filter.validate()?;
        not_negative("coast_s", settings.coast_s)?;
        not_negative("coast_m", settings.coast_m)?;
        positive("coast_b_std_m", settings.coast_b_std_m)?;
        Ok(Self { settings: settings.clone(), edges: [None, None] })
    }

    /// Processes the peaks of a scan `dt_s` after the last one.
    ///
    /// # Errors
    /// Returns an error if the time, the ego-motion or the mounting is invalid; the tracks are then
    /// unchanged. A scan without an edge is no error: `fits` holds the reason.
    pub fn step(&mut self, peaks: &[Peak], dt_s: f64, ego: &Ego) -> Result<RoadShape> {
        not_negative("time step", dt_s)?;
        let s = &self.settings;
        let scan = static_points(peaks, &s.mount, ego, &s.gate)?;
        self.step_points(scan.points, scan.moving, dt_s, ego)
    }

    /// Processes points that are known to be stationary; `moving` is passed on to the result.
    ///
    /// # Errors
    /// Returns an error if the time or the ego-motion is invalid; the tracks are then unchanged.
    pub fn step_points(
        &mut self,
        points: Vec<StaticPoint>,
        moving: usize,
        dt_s: f64,
        ego: &Ego,
    ) -> Result<RoadShape> {
        not_negative("time step", dt_s)?;
        finite("ego speed", ego.speed_mps)?;
        let s = &self.settings;
        let mut edges = self.edges.clone();
        for edge in edges.iter_mut().flatten() {
            edge.filter.predict(dt_s, ego.speed_mps)?;
            edge.unseen_s += dt_s;
            edge.unseen_m += (ego.speed_mps * dt_s).abs();
        }
        let fits = measure(&points, &edges, s);
        let mut updates = [None, None];
        for side in Side::BOTH {
            let i = side.index();
            let (edge, update) = follow(edges[i].take(), &fits[i], side, s);
            (edges[i], updates[i]) = (edge, update);
        }
        if s.parallel {
            share_curvature(&mut edges, &fits, &updates);
        }
        self.edges = edges.clone();
        Ok(RoadShape { points, moving, fits, updates, edges })
    }
}

fn measure(
    points: &[StaticPoint],
    edges: &[Option<EdgeTrack>; 2],
    s: &TrackerSettings,
) -> [Result<EdgeFit>; 2] {
    let map = match VoteMap::new(points, &s.hough) {
        Ok(map) => map,
        Err(reason) => return [Err(reason.clone()), Err(reason)],
    };
    if s.parallel {
        let pair = map
            .parallel_edges(s.width.as_ref())
            .and_then(|pair| fit_parallel(points, [0, 1].map(|i| (pair.a_per_m[i], pair.b_m[i])), &s.fit));
        if let Ok([left, right]) = pair {
            return [Ok(left), Ok(right)];
        }
    }
    Side::BOTH.map(|side| {
        let fit = map.edge(side).and_then(|peak| fit_edge(points, (peak.a_per_m, peak.b_m), side, &s.fit));
        let Some(edge) = &edges[side.index()] else { return fit };
        let fits = |f: &EdgeFit| edge.filter.gate(&f.measurement()).is_ok_and(|u| u.accepted);
        if fit.as_ref().is_ok_and(fits) {
            return fit;
        }
        // The vote may have missed what the prediction finds.
        let [c0, _, b] = edge.filter.state();
        match fit_edge(points, (0.5 * c0, b), side, &s.fit) {
            Ok(again) if fits(&again) => Ok(again),
            _ => fit,
        }
    })
}

fn follow(
    edge: Option<EdgeTrack>,
    fit: &Result<EdgeFit>,
    side: Side,
    s: &TrackerSettings,
) -> (Option<EdgeTrack>, Option<Update>) {
    let measurement = fit.as_ref().ok().map(EdgeFit::measurement);
    let start = || {
        let filter = ClothoidFilter::new(&measurement?, &s.filter).ok()?;
        let status = if s.confirm_scans <= 1 { EdgeStatus::Confirmed } else { EdgeStatus::Tentative };
        Some(EdgeTrack { side, status, filter, hits: 1, unseen_s: 0.0, unseen_m: 0.0, refused: 0 })
    };
    let Some(mut edge) = edge else { return (start(), None) };
    let update = measurement.and_then(|m| edge.filter.update(&m).ok());
    match update {
        Some(u) if u.accepted => {
            edge.hits += 1;
            edge.refused = 0;
            (edge.unseen_s, edge.unseen_m) = (0.0, 0.0);
            if edge.status == EdgeStatus::Coasting || edge.hits >= s.confirm_scans {
                edge.status = EdgeStatus::Confirmed;
            }
            return (Some(edge), update);
        }
        Some(_) => edge.refused += 1,
        None => {}
    }
    if edge.refused >= s.restart_scans.max(1) {
        return (start(), update);
    }
    if edge.status == EdgeStatus::Tentative {
        // Nothing is built on it yet: the next scan starts again.
        return (start(), update);
    }
    edge.status = EdgeStatus::Coasting;
    let b_std_m = edge.filter.covariance()[2][2].sqrt();
    let keep = edge.unseen_s <= s.coast_s && edge.unseen_m <= s.coast_m && b_std_m <= s.coast_b_std_m;
    (keep.then_some(edge), update)
}

/// An edge that is not seen takes the curvature of the other one, adjusted for their distance.
fn share_curvature(
    edges: &mut [Option<EdgeTrack>; 2],
    fits: &[Result<EdgeFit>; 2],
    updates: &[Option<Update>; 2],
) {
    for i in 0..2 {
        let seen = &fits[1 - i];
        let (Some(edge), Ok(seen)) = (edges[i].as_mut(), seen) else { continue };
        let taken = updates[1 - i].is_some_and(|u| u.accepted);
        if edge.status != EdgeStatus::Coasting || !taken {
            continue;
        }
        let shift = edge.filter.state()[2] - seen.b_m;
        let gain = 1.0 / (1.0 - 2.0 * seen.a_per_m * shift);
        if gain.is_finite() && gain > 0.0 {
            // A failed update leaves the edge as predicted.
            let _ = edge.filter.update_curvature(
                gain * seen.a_per_m,
                gain * gain * seen.covariance[0][0],
                gain * seen.cubic[0],
            );
        }
    }
}
