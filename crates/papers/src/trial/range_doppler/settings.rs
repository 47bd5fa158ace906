//! The table `[lane.range_doppler]`.

use crate::trial::kit::*;
use catseye_lane::range_doppler::{CurveStart, LaneSettings, Options, RangeDopplerLane};

const METHOD: &str = "range_doppler";

/// The table `[lane.range_doppler]`: prior knowledge of the marked lane, accuracy of the vehicle's sensors,
/// and poses of single frames.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Distance between the two rows of markers, m. Default 2.8.
    #[schemars(range(min = 0.5, max = 10.0))]
    pub row_distance_m: f64,
    /// Spacing of the markers of the left row, m. Default 1.5.
    #[schemars(range(min = 0.1, max = 50.0))]
    pub left_spacing_m: f64,
    /// Spacing of the markers of the right row, m; if it equals that of the left row, the side is ambiguous. Default 2.
    #[schemars(range(min = 0.1, max = 50.0))]
    pub right_spacing_m: f64,
    /// Minimum range of markers, m. Default 1.5.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub near_m: f64,
    /// Maximum range of markers, m. Default 40.
    pub far_m: f64,
    /// Half the field of view, about the direction of motion, degrees. Default 70.
    #[schemars(range(min = 5.0, max = 180.0))]
    pub half_view_deg: f64,
    /// Maximum offset in the search, m. Default 1.5.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub max_offset_m: f64,
    /// Maximum heading in the search, degrees. Default 60.
    #[schemars(range(min = 0.5, max = 90.0))]
    pub max_heading_deg: f64,
    /// Minimum radius of a bend in the search, m. Default 5.
    pub min_radius_m: f64,
    /// Maximum distance to the start of a bend in the search, m. Default 30.
    #[schemars(range(min = 0.0, max = 300.0))]
    pub bend_within_m: f64,
    /// Minimum signal-to-noise ratio of a point, dB. Default 6.
    #[schemars(range(min = -50.0, max = 100.0))]
    pub min_snr_db: f64,
    /// Lower bound of the standard deviation of a marker's range, m. Default 0.05.
    #[schemars(range(min = 1e-3, max = 5.0))]
    pub least_range_std_m: f64,
    /// Lower bound of the standard deviation of a marker's range rate, m/s. Default 0.02.
    #[schemars(range(min = 1e-3, max = 5.0))]
    pub least_range_rate_std_mps: f64,
    /// true (default): the vehicle bus reports the speed; false: the speed is estimated from the range-Doppler map.
    pub bus_speed: bool,
    /// Standard deviation of the speed on the vehicle bus, m/s. Default 0.05.
    #[schemars(range(min = 1e-4, max = 10.0))]
    pub bus_speed_std_mps: f64,
    /// Quantisation step of the speed on the vehicle bus, m/s; 0: not quantised. Default 0.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub bus_speed_step_mps: f64,
    /// Standard deviation of the yaw rate on the vehicle bus, degrees/s. Default 0.1.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub bus_yaw_rate_std_deg_per_s: f64,
    /// Number of frames between full searches; in the frames between them only the neighbourhood of the last
    /// lane is searched. Default 20.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub search_every: u32,
    /// Maximum number of frames that are plotted. Default 12.
    #[schemars(range(max = 1000))]
    pub pictures: u32,
    /// Lane width of the roads of `case`, m; their rows of markers are inside the lane, `row_distance_m` from each other. Default 3.
    pub lane_width_m: f64,
    /// Markers of the roads of `case`: reflector kind and parameters, as in `catseye rcs`.
    pub marker: String,
    /// Single frames in place of the scenario's drive, each on its own road.
    pub case: Vec<Case>,
}

/// A pose of the radar in the lane, and the lane.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Case {
    /// Name of the case in plots and tables: letters, digits, `_` and `-`; unique.
    pub name: String,
    /// Lateral offset from the lane centre, m, positive to the left. Default 0.
    pub offset_m: f64,
    /// Heading of the motion relative to the lane, degrees, positive to the left. Default 0.
    pub heading_deg: f64,
    /// Radius of the bend ahead, m, positive to the left; 0 (default) for a straight road.
    pub radius_m: f64,
    /// Distance from the radar to the start of the bend, m. Default 10.
    pub bend_after_m: f64,
    /// true: both rows have the spacing of the left row. Default false.
    pub equal: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            row_distance_m: 2.8,
            left_spacing_m: 1.5,
            right_spacing_m: 2.0,
            near_m: 1.5,
            far_m: 40.0,
            half_view_deg: 70.0,
            max_offset_m: 1.5,
            max_heading_deg: 60.0,
            min_radius_m: 5.0,
            bend_within_m: 30.0,
            min_snr_db: 6.0,
            least_range_std_m: 0.05,
            least_range_rate_std_mps: 0.02,
            bus_speed: true,
            bus_speed_std_mps: 0.05,
            bus_speed_step_mps: 0.0,
            bus_yaw_rate_std_deg_per_s: 0.1,
            search_every: 20,
            pictures: 12,
            lane_width_m: 3.0,
            marker: "type1:width_m=0.16,height_m=0.004,material=aluminium".into(),
            case: Vec::new(),
        }
    }
}

impl Default for Case {
    fn default() -> Self {
        Case {
            name: "case".into(),
            offset_m: 0.0,
            heading_deg: 0.0,
            radius_m: 0.0,
            bend_after_m: 10.0,
            equal: false,
        }
    }
}

impl Settings {
    /// Checks the settings.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range.
    pub fn check(&self) -> Result<()> {
        limits::check_bounds(METHOD, self)?;
        let half = 0.5 * self.row_distance_m;
        limits::check(
            METHOD,
            &[
                ("far_m", self.far_m, self.near_m + 1.0, 300.0, LEAVE_OUT),
                ("min_radius_m", self.min_radius_m, half + 0.1, 1e4, LEAVE_OUT),
            ],
        )?;
        if !self.case.is_empty() {
            let lane = ("lane_width_m", self.lane_width_m, self.row_distance_m, 20.0, LEAVE_OUT);
            limits::check(METHOD, &[lane])?;
        }
        for (i, case) in self.case.iter().enumerate() {
            case.check(self, i)?;
            if self.case[..i].iter().any(|c| c.name == case.name) {
                let bad = BadInput::new("two cases have the same name");
                let bad = bad.key(format!("lane.range_doppler.case[{i}].name")).value(&case.name);
                return Err(bad
                    .remedy("give each case a name of its own, since its files have that name")
                    .into());
            }
        }
        Ok(())
    }

    /// Options of the estimator for a radar; with `equal` the right row has the spacing of the left one.
    pub fn options(&self, radar: &Radar, equal: bool) -> Options {
        let at = radar.mounting.translation_m;
        Options {
            radar_at_m: [at.x, at.y],
            frame_time_s: radar.frame_time_s(),
            min_snr_db: self.min_snr_db,
            least_range_std_m: self.least_range_std_m,
            least_range_rate_std_mps: self.least_range_rate_std_mps,
            speed_from_map: true,
            search_every: self.search_every,
            lane: LaneSettings {
                lane_width_m: self.row_distance_m,
                left_spacing_m: self.left_spacing_m,
                right_spacing_m: if equal { self.left_spacing_m } else { self.right_spacing_m },
                curve_start: CurveStart::UpTo(self.bend_within_m),
                radar_height_m: at.z.max(0.0),
                max_offset_m: self.max_offset_m,
                max_heading_rad: self.max_heading_deg.to_radians(),
                min_radius_m: self.min_radius_m,
                near_m: self.near_m,
                far_m: self.far_m,
                half_view_rad: self.half_view_deg.to_radians(),
                ..LaneSettings::default()
            },
        }
    }

    /// Lane settings for drawing rows as curves in front of the radar.
    pub fn lane_ahead(&self) -> LaneSettings {
        LaneSettings {
            lane_width_m: self.row_distance_m,
            near_m: 0.0,
            far_m: self.far_m,
            max_offset_m: self.max_offset_m,
            ..LaneSettings::default()
        }
    }

    /// Makes the estimator for a radar; with `equal` the spacings are the same on both sides.
    ///
    /// # Errors
    /// Returns an error for a setting outside its range.
    pub fn estimator(&self, radar: &Radar, equal: bool) -> Result<RangeDopplerLane> {
        RangeDopplerLane::new(self.options(radar, equal)).map_err(|r: LaneError| {
            BadInput::new(r.to_string())
                .key("lane.range_doppler")
                .remedy("change the setting that the message names")
                .into()
        })
    }
}

impl Case {
    fn check(&self, s: &Settings, i: usize) -> Result<()> {
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if self.name.is_empty() || self.name.len() > 60 || !self.name.chars().all(is_name) {
            let bad = BadInput::new("is not a valid name of a case")
                .key(format!("lane.range_doppler.case[{i}].name"));
            return Err(bad.value(&self.name).allowed("1 to 60 letters, digits, _ and -").into());
        }
        let mut limits = vec![
            ("offset_m", self.offset_m, -s.max_offset_m, s.max_offset_m),
            ("heading_deg", self.heading_deg, -s.max_heading_deg, s.max_heading_deg),
            ("bend_after_m", self.bend_after_m, 0.0, s.bend_within_m),
        ];
        if self.radius_m != 0.0 {
            // The lane's inner edge keeps a radius.
            let least = s.min_radius_m.max(0.5 * s.lane_width_m + 0.3);
            limits.push(("radius_m", self.radius_m.abs(), least, 1e5));
        }
        limits.iter().try_for_each(|(k, value, low, high)| {
            limits::check(METHOD, &[(&format!("case[{i}].{k}"), *value, *low, *high, LEAVE_OUT)])
        })
    }
}
