//! Markers found and missed, and the values of a look's table.

use crate::trial::drive::stretches;
use crate::trial::kit::*;

/// Counts of markers in one look.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    /// Number of markers in the field of view and in reach.
    pub markers: usize,
    /// Number of those with a point near them.
    pub detected: usize,
    /// Number of those with a member of a line near them.
    pub found: usize,
    /// Number of members of lines in reach; `right` is the number of those near a marker.
    pub members: usize,
    pub right: usize,
}

impl Tally {
    pub fn add(&mut self, o: &Tally) {
        self.markers += o.markers;
        self.detected += o.detected;
        self.found += o.found;
        self.members += o.members;
        self.right += o.right;
    }

    pub fn recall(&self) -> Option<f64> {
        ratio(self.found, self.markers)
    }

    pub fn precision(&self) -> Option<f64> {
        ratio(self.right, self.members)
    }

    pub fn detected_share(&self) -> Option<f64> {
        ratio(self.detected, self.markers)
    }

    /// Share of the detected markers that are found.
    pub fn of_detected(&self) -> Option<f64> {
        ratio(self.found, self.detected)
    }
}

fn ratio(a: usize, b: usize) -> Option<f64> {
    (b > 0).then(|| a as f64 / b as f64)
}

/// The part of the level plane that a radar sees.
#[derive(Debug, Clone, Copy)]
pub struct View {
    pub at_m: DVec2,
    pub heading_rad: f64,
    pub half_rad: f64,
    /// Least and largest distance from the vehicle's origin, m.
    pub reach_m: [f64; 2],
    /// Least distance from the radar, m.
    pub nearest_m: f64,
}

impl View {
    pub fn of(radar: &Radar, reach_m: [f64; 2], nearest_m: f64) -> View {
        let (at_m, heading_rad) = mount(radar);
        View { at_m, heading_rad, half_rad: radar.processing.azimuth_fov_rad, reach_m, nearest_m }
    }

    /// The part of the view between two distances, limited to its own reach.
    pub fn ring(&self, [from, to]: [f64; 2]) -> View {
        View { reach_m: [from.max(self.reach_m[0]), to.min(self.reach_m[1])], ..*self }
    }

    pub fn holds(&self, p: DVec2) -> bool {
        let d = p - self.at_m;
        let turn = DVec2::from_angle(-self.heading_rad).rotate(d).to_angle();
        turn.abs() <= self.half_rad
            && d.length() >= self.nearest_m
            && (self.reach_m[0]..=self.reach_m[1]).contains(&p.length())
    }
}

/// The markers in view at a time, in the level frame, m.
pub fn markers_in_view(drive: &Drive<'_>, time_s: f64, view: &View) -> Vec<[f64; 2]> {
    drive.markers(time_s).into_iter().filter(|p| view.holds(DVec2::from_array(*p))).collect()
}

/// The rows in view as lines that are to be found, and the vehicle's lane. A line on a row that has left the
/// view still counts as right or wrong.
pub fn truth_in_view(drive: &Drive<'_>, time_s: f64, view: &View) -> TrueLanes {
    let whole = drive.truth_of_rows(time_s, view.reach_m);
    let mut lines = Vec::new();
    // Where each line's first stretch in view went.
    let mut first: Vec<Option<usize>> = Vec::new();
    for line in &whole.lines {
        let mut own = None;
        for part in in_view(line, view) {
            own = own.or(Some(lines.len()));
            lines.push(part);
        }
        first.push(own);
    }
    let own = whole.own.map(|i| i.and_then(|i| first.get(i).copied().flatten()));
    TrueLanes { lines, own, also: whole.lines, ..whole }
}

/// Points a quarter of a metre apart along a polyline that are in view, split where it leaves the view.
fn in_view(line: &[[f64; 2]], view: &View) -> Vec<Vec<[f64; 2]>> {
    let places = line.windows(2).flat_map(|w| {
        let (a, b) = (DVec2::from_array(w[0]), DVec2::from_array(w[1]));
        let n = (a.distance(b) / 0.25).ceil().max(1.0) as usize;
        (0..n).map(move |k| a.lerp(b, k as f64 / n as f64))
    });
    stretches(places.map(|p| Some(p).filter(|p| view.holds(*p))))
}

/// Counts of one estimate, whose members are indices of `points`.
pub fn tally(
    estimate: &LaneEstimate,
    points: &[LanePoint],
    markers: &[[f64; 2]],
    every_marker: &[[f64; 2]],
    view: &View,
    within_m: f64,
) -> Tally {
    let members = estimate.lines.iter().flat_map(|l| &l.members).filter_map(|i| points.get(*i));
    let members: Vec<DVec2> = members.map(|p| DVec2::from_array(p.at_m)).collect();
    let near =
        |a: DVec2, list: &[[f64; 2]]| list.iter().any(|m| a.distance(DVec2::from_array(*m)) <= within_m);
    let places: Vec<[f64; 2]> = points.iter().map(|p| p.at_m).collect();
    let found: Vec<[f64; 2]> = members.iter().map(DVec2::to_array).collect();
    let counted: Vec<&DVec2> = members.iter().filter(|m| view.holds(**m)).collect();
    Tally {
        markers: markers.len(),
        detected: markers.iter().filter(|m| near(DVec2::from_array(**m), &places)).count(),
        found: markers.iter().filter(|m| near(DVec2::from_array(**m), &found)).count(),
        members: counted.len(),
        right: counted.iter().filter(|m| near(***m, every_marker)).count(),
    }
}
