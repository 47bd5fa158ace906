//! The table `[lane.uwb]` of a scenario file.

use crate::trial::kit::*;
use catseye::scene::toml_file::At;
use catseye_lane::uwb::{Centre, options};

/// Kim's scenario that this scenario represents; Kim's values are printed beside the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StandsFor {
    /// A road without plates.
    Scenario1,
    /// A drive 30 cm from the line.
    Scenario2,
    /// A drive 120 cm from the line.
    Scenario3,
    /// A drive that leaves the lane between plates 4 and 5.
    Scenario4,
    /// A road with a round and a square manhole cover.
    Manholes,
}

/// Settings of the method `uwb`: an impulse radar above metal plates (Kim).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Kim's scenario that this scenario represents; default none: no values of Kim are printed.
    pub stands_for: Option<StandsFor>,
    /// Distance from the start of one plate to the start of the next, m.
    pub spacing_m: f64,
    /// Length of a plate, m.
    pub plate_length_m: f64,
    /// Width of the lane, m.
    pub lane_width_m: f64,
    /// Width of the vehicle, m.
    pub car_width_m: f64,
    /// Range gate [minimum, maximum], m; default by Kim (2) and (3) from the height of the radar and the
    /// lengths above.
    pub gate_m: Option<[f64; 2]>,
    /// Margin for the pulse length at both ends of the range gate, m.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub gate_margin_m: f64,
    /// true: the mean scan of the road without markers is subtracted from each scan first. Kim's rule, which
    /// does not subtract it, is reported in any case.
    pub take_background: bool,
    /// Definition of the centre of a pass.
    pub centre: Centre,
    /// Maximum error of a spacing that counts as correct, m; default a third of a plate.
    pub largest_error_m: Option<f64>,
    /// Number of successive correct spacings that confirm a lane.
    #[schemars(range(min = 1, max = 1000))]
    pub confirm_spacings: u32,
    /// Number of successive missing plates that trigger the departure warning.
    #[schemars(range(min = 1, max = 1000))]
    pub misses_to_warn: u32,
    /// Probability of false alarm: share of scans without markers that may exceed the threshold; default none
    /// of the simulated scans, as in Kim.
    #[schemars(range(min = 1e-9, max = 0.05))]
    pub false_alarm_probability: Option<f64>,
    /// Number of scans of the road without markers from which the threshold is computed.
    pub quiet_scans: u32,
    /// Speed of that drive and of the drive for the histogram, km/h. Both are without sway.
    #[schemars(range(min = 0.1, max = 200.0))]
    pub quiet_speed_kmh: f64,
    /// Maximum lateral offset of that drive to either side of the lane centre, m; default as far as the
    /// vehicle fits into the lane.
    pub quiet_aside_m: Option<f64>,
    /// Road file without markers, relative to the scenario; default the scenario's own road without objects.
    pub quiet_road: Option<At<String>>,
    /// Class of the plates: the road without markers is then the scenario's own road without objects of this
    /// class and without moving objects.
    pub plate_class: Option<String>,
    /// Number of scans of the slow drive past the plates for the histogram; 0: no histogram.
    #[schemars(range(max = 1_000_000))]
    pub histogram_scans: u32,
    /// true: the energy at the centre of a plate is also reported as a function of the lateral distance.
    pub offset_sweep: bool,
    /// Range of speeds from which the speed of each run is drawn, km/h, in place of the scenario's speed;
    /// default the scenario's speed.
    pub speed_range_kmh: Option<[f64; 2]>,
    /// Standard deviation of the speed on the vehicle bus, m/s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_std_mps: f64,
    /// Quantisation step of the speed on the vehicle bus, km/h; 0: not quantised.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub speed_step_kmh: f64,
    /// Assumed standard deviation of the lateral distance to a line, m.
    #[schemars(range(min = 1e-3, max = 5.0))]
    pub offset_std_m: f64,
    /// Asphalt between the plates.
    pub asphalt: Asphalt,
    /// In a comparison of methods: time between scans, s; default the frame time of the radar file.
    #[schemars(range(min = 1e-4, max = 10.0))]
    pub scan_interval_s: Option<f64>,
    /// In a comparison of methods: distance driven with the radar on before the first frame, m, limited by
    /// the start of the road; default three spacings.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub run_up_m: Option<f64>,
}

/// Asphalt in the band of impulse radars. The asphalt of the material table is smooth in this band; this one
/// scatters by Oh's model (CONVENTIONS eq. 147).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Asphalt {
    /// Relative permittivity; default that of ITU-R P.2040-3 for 1 to 40 GHz.
    #[schemars(range(min = 1.0, max = 100.0))]
    pub relative_permittivity: f64,
    /// RMS roughness (standard deviation of the surface height), mm; 0 for a smooth surface. The default is
    /// an assumption for a fine dense surface: no verifiable value for this band was found.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub roughness_mm: f64,
}

impl Default for Asphalt {
    fn default() -> Self {
        Asphalt { relative_permittivity: 4.83, roughness_mm: 0.3 }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            stands_for: None,
            spacing_m: options::spacing_m(),
            plate_length_m: options::plate_length_m(),
            lane_width_m: options::lane_width_m(),
            car_width_m: options::car_width_m(),
            gate_m: None,
            gate_margin_m: 0.0,
            take_background: true,
            centre: Centre::Level,
            largest_error_m: None,
            confirm_spacings: 1,
            misses_to_warn: 1,
            false_alarm_probability: None,
            quiet_scans: 6000,
            quiet_speed_kmh: 10.0,
            quiet_aside_m: None,
            quiet_road: None,
            plate_class: None,
            histogram_scans: 700,
            offset_sweep: true,
            speed_range_kmh: None,
            speed_std_mps: 0.1,
            speed_step_kmh: 1.0,
            offset_std_m: options::OFFSET_STD_M,
            asphalt: Asphalt::default(),
            scan_interval_s: None,
            run_up_m: None,
        }
    }
}

impl Settings {
    /// Distance that is driven before looks count, m.
    pub fn run_up_m(&self) -> f64 {
        self.run_up_m.unwrap_or(3.0 * self.spacing_m)
    }

    /// Largest error of a spacing that counts as right, m.
    pub fn largest_error_m(&self) -> f64 {
        self.largest_error_m.unwrap_or(self.plate_length_m / 3.0)
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// Returns an error for the first value outside its range, or if the road without markers is given twice.
    pub fn check(&self) -> Result<()> {
        let s = self;
        limits::check_bounds("uwb", s)?;
        let lane = options::lane_limits(s.spacing_m, s.plate_length_m, s.lane_width_m, s.car_width_m);
        limits::check("uwb", &lane)?;
        let half = 0.5 * s.spacing_m;
        let speed = s.speed_range_kmh.unwrap_or([20.0, 30.0]);
        let [near, far] = s.gate_m.unwrap_or([1.0, 2.0]);
        let least_quiet = if s.false_alarm_probability.is_some() { 200.0 } else { 20.0 };
        let quiet = "the document has about 6000; a tail needs 200 or more";
        let aside = s.quiet_aside_m.unwrap_or(0.0);
        limits::check(
            "uwb",
            &[
                ("gate_m[0]", near, 0.0, 100.0, "give metres from the radar"),
                ("gate_m[1]", far, near + 0.01, 100.0, "the gate ends behind its beginning"),
                ("largest_error_m", s.largest_error_m(), 1e-3, half, "at most half the spacing"),
                ("quiet_scans", s.quiet_scans.into(), least_quiet, 1e6, quiet),
                ("speed_range_kmh[0]", speed[0], 0.5, 300.0, "the document has [20, 30]"),
                ("speed_range_kmh[1]", speed[1], speed[0], 300.0, "the higher speed comes second"),
                ("quiet_aside_m", aside, 0.0, s.lane_width_m, "0 for a drive along the middle"),
            ],
        )?;
        match (&s.plate_class, &s.quiet_road) {
            (Some(_), Some(_)) => Err(BadInput::new("quiet_road and plate_class exclude each other")
                .key("lane.uwb.plate_class")
                .remedy("keep one of them")
                .into()),
            _ => Ok(()),
        }
    }
}
