//! Options of the method markers: the table `[lane.markers]` of a scenario, and the same keys in JSON and in
//! Python.

use super::estimator::{MarkerSearch, Markers};
use super::scan::MarkerPattern;
use crate::LaneEstimator;
use crate::limits::{self, Limit};
use crate::track::TrackOptions;
use catseye::base::error::{BadInput, Result};
use catseye::road::labels::RoadTruth;
use catseye::scene::radar::Radar;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The method's name in the keys of its table.
const TABLE: &str = "markers";
/// Spacing of the document's markers, m, for a caller without a scene.
const SPACING_M: f64 = 2.0;

/// Settings of `catseye lane markers`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Settings")]
pub struct MarkersOptions {
    /// Spacings of the markers along their rows, m, one for each kind of row. Default: the spacings of the
    /// scene's rows.
    #[schemars(inner(range(min = 0.3, max = 50.0)))]
    pub spacing_m: Vec<f64>,
    /// Maximum deviation of the distance between neighbours from the spacing, m.
    #[schemars(range(min = 1e-3, max = 20.0))]
    pub tolerance_m: f64,
    /// Minimum number of points of a group.
    #[schemars(range(min = 2, max = 1000))]
    pub least_of_group: u32,
    /// Minimum number of points of a path.
    #[schemars(range(min = 3, max = 1000))]
    pub least_of_path: u32,
    /// Maximum turn of a path from one step to the next, and maximum change of that turn, degrees.
    #[schemars(inner(range(min = 0.1, max = 60.0)))]
    pub turn_deg: [f64; 2],
    /// Range of the ground clutter, m; points at shorter range start no row, but may belong to one.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub nearest_m: f64,
    /// Maximum gap in a row, in spacings.
    #[schemars(range(min = 1, max = 50))]
    pub gap: u32,
    /// true: points without a path are searched for lines, circles and parabolas by a Hough transform.
    pub hough: bool,
    /// Error of range rates in addition to their noise, m/s. Default: a quarter of the radar's Doppler cell.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub rate_error_mps: Option<f64>,
    /// true: powers along a row must agree with the cross section of its markers, which is computed in free
    /// space. This removes stones, and also true markers where two rows share cells and their powers are not
    /// resolved.
    pub levels: bool,
    /// true: lines are tracked over frames.
    pub track: bool,
    /// Standard deviation of the speed on the vehicle bus, m/s. Default: the speed is estimated from the
    /// points alone.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub bus_speed_std_mps: Option<f64>,
    /// Standard deviation of the yaw rate on the vehicle bus, degrees/s. Default: the yaw rate is estimated from the points.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub bus_yaw_rate_std_deg_per_s: Option<f64>,
    /// Minimum and maximum distance from the vehicle at which lines and markers are scored, m.
    #[schemars(inner(range(min = 0.0, max = 1000.0)))]
    pub reach_m: [f64; 2],
    /// Maximum distance between a point of a line and a marker at which the marker counts as found, m.
    #[schemars(range(min = 0.01, max = 10.0))]
    pub within_m: f64,
    /// Shares of points that are removed after the signal chain, for the robustness table.
    #[schemars(inner(range(min = 0.0, max = 1.0)))]
    pub missing_share: Vec<f64>,
    /// Numbers of stationary points that are added on the road after the signal chain, for the robustness table.
    #[schemars(inner(range(max = 10_000)))]
    pub extra_points: Vec<u32>,
    /// Frame of the first run that the plots show. Default: the frame with the most points in rows.
    pub picture_frame: Option<u32>,
    // Only for points without a scenario: there the radar's own mounting and signal give these.
    /// Height of the radar above the road, m. Default 0.15. A scenario has it in the radar's mounting and
    /// refuses it here.
    #[schemars(skip)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radar_height_m: Option<f64>,
    /// Distance of the radar ahead of the rear axle, m. Default 3.6. A scenario has it in the radar's mounting
    /// and refuses it here.
    #[schemars(skip)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radar_ahead_m: Option<f64>,
}

impl Default for MarkersOptions {
    fn default() -> Self {
        let o = MarkerPattern::default();
        MarkersOptions {
            spacing_m: Vec::new(),
            tolerance_m: o.tolerance_m,
            least_of_group: o.least as u32,
            least_of_path: o.path_least as u32,
            turn_deg: o.turn_rad.map(|t| t.to_degrees().round()),
            nearest_m: o.nearest_m,
            gap: o.gap as u32,
            hough: true,
            rate_error_mps: None,
            levels: false,
            track: true,
            bus_speed_std_mps: None,
            bus_yaw_rate_std_deg_per_s: None,
            reach_m: [5.0, 35.0],
            within_m: 0.3,
            missing_share: vec![0.0, 0.2, 0.4],
            extra_points: vec![0, 30],
            picture_frame: None,
            radar_height_m: None,
            radar_ahead_m: None,
        }
    }
}

impl MarkersOptions {
    /// Checks the options.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        limits::check_bounds(TABLE, self)?;
        // The default tolerance gives way to a small spacing.
        let is_given = self.tolerance_m != MarkerPattern::default().tolerance_m;
        let half = "give less than half of the spacing, as in 0.2";
        let spacings = self.spacing_m.iter().filter(|_| is_given);
        let mut limits: Vec<Limit<'_>> =
            spacings.map(|d| ("tolerance_m", self.tolerance_m, 1e-3, 0.45 * d, half)).collect();
        let [near, far] = self.reach_m;
        limits.push((
            "reach_m",
            far,
            near + 1.0,
            1000.0,
            "give [nearest, farthest] in metres, as in [5, 35]",
        ));
        let radar = [
            ("radar_height_m", self.radar_height_m, 0.0, 100.0, "give metres, as in 0.15"),
            ("radar_ahead_m", self.radar_ahead_m, -100.0, 100.0, "give metres, as in 3.6"),
        ];
        limits
            .extend(radar.into_iter().filter_map(|(key, v, low, high, how)| Some((key, v?, low, high, how))));
        limits::check(TABLE, &limits)
    }

    /// Checks the options of a scenario's table.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range, and for a key that the scenario's radar gives.
    pub fn check_in_scenario(&self) -> Result<()> {
        let of_radar = [
            ("radar_height_m", self.radar_height_m.is_some()),
            ("radar_ahead_m", self.radar_ahead_m.is_some()),
        ];
        match of_radar.iter().find(|k| k.1) {
            Some((key, _)) => Err(BadInput::new("is given by the mounting of the scenario's radar")
                .key(format!("lane.{TABLE}.{key}"))
                .remedy("leave it out, or change the radar's mounting")
                .into()),
            None => self.check(),
        }
    }

    /// Checks the options of a caller with points of its own.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range, and for a key that only a trial on a scenario
    /// can follow.
    fn check_alone(&self) -> Result<()> {
        let d = MarkersOptions::default();
        let of_trial = [
            ("levels", self.levels != d.levels),
            ("bus_speed_std_mps", self.bus_speed_std_mps.is_some()),
            ("bus_yaw_rate_std_deg_per_s", self.bus_yaw_rate_std_deg_per_s.is_some()),
            ("reach_m", self.reach_m != d.reach_m),
            ("within_m", self.within_m != d.within_m),
            ("missing_share", self.missing_share != d.missing_share),
            ("extra_points", self.extra_points != d.extra_points),
            ("picture_frame", self.picture_frame.is_some()),
        ];
        match of_trial.iter().find(|k| k.1) {
            Some((key, _)) => Err(limits::refused(
                super::METHOD,
                format!("{key} is only allowed in the table [lane.{TABLE}] of a scenario"),
            )),
            None => self.check(),
        }
    }

    /// One pattern for each spacing, with the range rates and the height of the default radar.
    fn patterns_at(&self, spacings_m: &[f64]) -> Vec<MarkerPattern> {
        let d = MarkerPattern::default();
        let of = |spacing_m: &f64| MarkerPattern {
            spacing_m: *spacing_m,
            tolerance_m: self.tolerance_m.min(0.45 * spacing_m),
            least: self.least_of_group as usize,
            path_least: self.least_of_path as usize,
            turn_rad: self.turn_deg.map(f64::to_radians),
            nearest_m: self.nearest_m,
            gap: self.gap as usize,
            rate_error_mps: self.rate_error_mps.unwrap_or(d.rate_error_mps),
            radar_height_m: self.radar_height_m.unwrap_or(d.radar_height_m),
            hough: self.hough,
            ..d
        };
        spacings_m.iter().map(of).collect()
    }

    /// What the estimator looks for among points without a scenario: rows at the given spacings, or at the
    /// document's 2 m if none is given.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn search(&self) -> Result<MarkerSearch> {
        self.check()?;
        let spacings_m = if self.spacing_m.is_empty() { &[SPACING_M][..] } else { &self.spacing_m };
        let search = MarkerSearch::default();
        Ok(MarkerSearch {
            patterns: self.patterns_at(spacings_m),
            track: self.track.then(TrackOptions::default),
            radar_ahead_m: self.radar_ahead_m.unwrap_or(search.radar_ahead_m),
            rcs: None,
        })
    }

    /// What the estimator looks for with a scenario's radar on its road, without levels.
    ///
    /// # Errors
    /// Returns an error if no spacing is given and the scene has no rows.
    pub fn search_with(&self, radar: &Radar, road: Option<&RoadTruth>) -> Result<MarkerSearch> {
        let spacings_m = match self.spacing_m.is_empty() {
            false => self.spacing_m.clone(),
            true => laid(road),
        };
        if spacings_m.is_empty() {
            return Err(BadInput::new(
                "is not given, and the scene has no rows of markers from which it follows",
            )
            .key("lane.markers.spacing_m")
            .allowed("metres between neighbours of a row, one number for each kind of row")
            .remedy("give it, as in spacing_m = [2], or add [[road.markers]] to the scene")
            .into());
        }
        let of_radar = |p: MarkerPattern| MarkerPattern {
            rate_error_mps: self.rate_error_mps.unwrap_or(0.25 * radar.velocity_bin_mps()),
            // The windows of many side lobe decibels have main lobes of about eight cells.
            lobe_mps: 5.0 * radar.velocity_bin_mps(),
            radar_height_m: radar.mounting.translation_m.z.max(0.0),
            ..p
        };
        Ok(MarkerSearch {
            patterns: self.patterns_at(&spacings_m).into_iter().map(of_radar).collect(),
            track: self.track.then(TrackOptions::default),
            radar_ahead_m: radar.mounting.translation_m.x,
            rcs: None,
        })
    }
}

/// Makes the estimator from options as JSON.
///
/// # Errors
/// Returns an error for options that are unknown, outside their ranges, or only for a scenario.
pub fn from_json(options: &str) -> Result<Box<dyn LaneEstimator + Send>> {
    let options: MarkersOptions = limits::read_json(super::METHOD, options)?;
    options.check_alone()?;
    Ok(Box::new(Markers::new(options.search()?)))
}

/// Spacings with which rows were laid, to a centimetre, each once, ascending: the median of each row's gaps.
fn laid(road: Option<&RoadTruth>) -> Vec<f64> {
    let mut out: Vec<f64> = road
        .iter()
        .flat_map(|r| &r.marker_rows)
        .filter_map(|row| {
            let mut gaps: Vec<f64> = row.markers.windows(2).map(|w| (w[1].s_m - w[0].s_m).abs()).collect();
            gaps.sort_by(f64::total_cmp);
            gaps.get(gaps.len() / 2).map(|g| (g * 100.0).round() / 100.0)
        })
        .filter(|g| (0.3..=50.0).contains(g))
        .collect();
    out.sort_by(f64::total_cmp);
    out.dedup();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the radar's mounting gives has one place: a scenario's table refuses it, and points without a scenario take it.
    #[test]
    fn the_mounting_is_given_once() {
        let options = MarkersOptions { radar_height_m: Some(0.5), ..MarkersOptions::default() };
        let e = options.check_in_scenario().unwrap_err().to_string();
        assert!(e.contains("lane.markers.radar_height_m") && e.contains("mounting"), "{e}");
        assert_eq!(options.search().unwrap().patterns[0].radar_height_m, 0.5);
        MarkersOptions::default().check_in_scenario().unwrap();
    }
}
