//! The table `[lane.markers]` of a scenario.

use crate::trial::kit::*;
use crate::trial::limits::Limit;
use catseye_lane::markers::{MarkerOptions, MarkersOptions};
use catseye_lane::track::TrackOptions;

/// Settings of `catseye lane markers`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Spacings of the markers along their rows, m, one for each kind of row. Default: those with which the
    /// scene's rows were laid.
    pub spacing_m: Vec<f64>,
    /// Largest difference of neighbours' distances from the spacing, m.
    pub tolerance_m: f64,
    /// Least number of points of a group.
    pub least_of_group: u32,
    /// Least number of points of a path.
    pub least_of_path: u32,
    /// Largest turn of a path from one step to the next, and largest change of that turn, degrees.
    pub turn_deg: [f64; 2],
    /// Range within which points lie in the ground clutter, m.
    pub nearest_m: f64,
    /// Largest gap in a row, in spacings.
    pub gap: u32,
    /// Whether points that no path took are searched for lines, circles and parabolas by a Hough transform.
    pub hough: bool,
    /// Error of range rates beyond their noise, m/s. Default: a quarter of the radar's Doppler cell.
    pub rate_error_mps: Option<f64>,
    /// Whether levels along a row have to agree with the cross section of its markers, which is computed in
    /// free space. This removes stones, and also true markers where two rows share cells and their powers are
    /// not resolved.
    pub levels: bool,
    /// Whether lines are tracked over frames.
    pub track: bool,
    /// Standard deviation of the speed on the vehicle's bus, m/s. Left out: the speed comes from the points
    /// alone.
    pub bus_speed_std_mps: Option<f64>,
    /// Standard deviation of the yaw rate on the bus, degrees/s. Left out: it comes from the points.
    pub bus_yaw_rate_std_deg_per_s: Option<f64>,
    /// Least and largest distance from the vehicle at which lines and markers are to be found, m.
    pub reach_m: [f64; 2],
    /// Largest distance of a member of a line from a marker that counts as found, m.
    pub within_m: f64,
    /// Shares of points that are removed after the chain, for the table of robustness.
    pub missing_share: Vec<f64>,
    /// Numbers of stationary points that are added on the road after the chain, for the same table.
    pub extra_points: Vec<u32>,
    /// Frame of the first run that pictures show. Default: the one with most points in rows.
    pub picture_frame: Option<u32>,
}

impl Default for Settings {
    fn default() -> Self {
        let o = MarkerOptions::default();
        Settings {
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
        }
    }
}

impl Settings {
    /// Checks the settings.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        let mut limits: Vec<Limit<'_>> = Vec::new();
        for d in &self.spacing_m {
            limits.push(("spacing_m", *d, 0.3, 50.0, "give the metres between neighbours of a row"));
            let half = "give less than half of the spacing, as in 0.2";
            limits.push(("tolerance_m", self.tolerance_m, 1e-3, 0.45 * d, half));
        }
        limits.extend([
            ("tolerance_m", self.tolerance_m, 1e-3, 20.0, "give metres, as in 0.2"),
            ("least_of_group", f64::from(self.least_of_group), 2.0, 1000.0, "the document has 4"),
            ("least_of_path", f64::from(self.least_of_path), 3.0, 1000.0, "the document has 5"),
        ]);
        limits.extend(self.turn_deg.map(|t| ("turn_deg", t, 0.1, 60.0, "give degrees, as in [20, 10]")));
        limits.extend([
            ("nearest_m", self.nearest_m, 0.0, 1000.0, "give metres, as in 5"),
            ("gap", f64::from(self.gap), 1.0, 50.0, "give a number of spacings, as in 5"),
        ]);
        let speeds = [
            ("rate_error_mps", self.rate_error_mps, 10.0, "give metres per second, as in 0.005"),
            ("bus_speed_std_mps", self.bus_speed_std_mps, 10.0, "give metres per second, as in 0.05"),
            (
                "bus_yaw_rate_std_deg_per_s",
                self.bus_yaw_rate_std_deg_per_s,
                90.0,
                "give degrees per second, as in 0.2",
            ),
        ];
        limits.extend(speeds.into_iter().filter_map(|(key, v, most, how)| Some((key, v?, 0.0, most, how))));
        let ([near, far], how) = (self.reach_m, "give [nearest, farthest] in metres, as in [5, 35]");
        limits.extend([
            ("reach_m", near, 0.0, 1000.0, how),
            ("reach_m", far, near + 1.0, 1000.0, how),
            ("within_m", self.within_m, 0.01, 10.0, "give metres, as in 0.3"),
        ]);
        let shares = self.missing_share.iter();
        limits.extend(shares.map(|s| ("missing_share", *s, 0.0, 1.0, "give shares, as in [0, 0.2]")));
        let points = self.extra_points.iter();
        limits
            .extend(points.map(|n| ("extra_points", f64::from(*n), 0.0, 1e4, "give numbers, as in [0, 10]")));
        limits::check("markers", &limits)
    }

    /// Options of the estimator for a radar, without levels.
    pub(super) fn options(&self, radar: &Radar, patterns: Vec<MarkerOptions>) -> MarkersOptions {
        let track = self.track.then(TrackOptions::default);
        MarkersOptions { patterns, track, radar_ahead_m: radar.mounting.translation_m.x, rcs: None }
    }

    /// Makes one pattern for each spacing.
    ///
    /// # Errors
    /// Returns an error if no spacing is given and the scene has no rows.
    pub(super) fn patterns(&self, radar: &Radar, road: Option<&RoadTruth>) -> Result<Vec<MarkerOptions>> {
        let spacings = match self.spacing_m.is_empty() {
            false => self.spacing_m.clone(),
            true => laid(road),
        };
        if spacings.is_empty() {
            return Err(BadInput::new("is not given, and the scene has no rows of markers that tell it")
                .key("lane.markers.spacing_m")
                .allowed("metres between neighbours of a row, one number for each kind of row")
                .remedy("give it, as in spacing_m = [2], or add [[road.markers]] to the scene")
                .into());
        }
        let of = |spacing_m: f64| MarkerOptions {
            spacing_m,
            tolerance_m: self.tolerance_m.min(0.45 * spacing_m),
            least: self.least_of_group as usize,
            path_least: self.least_of_path as usize,
            turn_rad: self.turn_deg.map(f64::to_radians),
            nearest_m: self.nearest_m,
            gap: self.gap as usize,
            rate_error_mps: self.rate_error_mps.unwrap_or(0.25 * radar.velocity_bin_mps()),
            // The windows of many side lobe decibels have main lobes of about eight cells.
            lobe_mps: 5.0 * radar.velocity_bin_mps(),
            radar_height_m: radar.mounting.translation_m.z.max(0.0),
            hough: self.hough,
            ..MarkerOptions::default()
        };
        Ok(spacings.into_iter().map(of).collect())
    }
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
