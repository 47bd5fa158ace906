//! What the radar sees of moving things: points along the ground, clusters, tracks.

use crate::trial::drive::lane_track;
use crate::trial::hd_map::settings::Settings;
use crate::trial::kit::*;
use catseye::detect::ambiguity::is_unfolded;
use catseye::detect::cluster::{ClusterPoint, Dbscan};
use catseye::detect::kalman::Station;
use catseye::detect::plot::{Plot, plots_of_clusters};
use catseye::detect::tracker::{Coverage, Scan, TrackState, Tracker, TrackerSettings};
use catseye_lane::LaneTrack;

/// Least standard deviation of an azimuth, rad: arrays are not calibrated better.
const LEAST_AZIMUTH_STD_RAD: f64 = 1e-3;
/// Number of standard deviations within which the range rates of stationary points lie.
const STANDING_SIGMAS: f64 = 4.0;

/// A point of a frame, projected along the ground from the radar.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Mover {
    pub range_m: f64,
    /// Azimuth from the radar's boresight, rad, positive to the left.
    pub azimuth_rad: f64,
    /// Rate of the range along the ground, m/s, positive when receding.
    pub range_rate_mps: f64,
    /// Standard deviations of range (m), rate (m/s) and azimuth (rad).
    pub std: [f64; 3],
    /// Whether the rate may be folded.
    pub folded: bool,
}

/// One frame of points with an azimuth.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Sight {
    pub points: Vec<Mover>,
}

/// Index of the first radar of the scenario that measures azimuths.
///
/// # Errors
/// Returns an error if the scenario has no radar that measures ranges and azimuths.
pub fn radar(given: &TrialContext<'_>) -> Result<usize> {
    let radars = &given.scenario.radars;
    let found = point_radar(radars).filter(|i| radars[*i].virtual_channels() > 1);
    let allowed =
        "a radar that measures ranges and azimuths: fmcw, stepped or coded, with two channels or more";
    needed(found, given, "hd-map", allowed, "use radar = \"front77\"")
}

/// The points of a frame along the ground. Where the array measures no elevation, the echoes are assumed at
/// [`Settings::echo_height_m`]: a linear array measures the sine of the angle from its own plane, whatever
/// the elevation.
pub fn see(drive: &Drive<'_>, frame: &Frame, settings: &Settings) -> Sight {
    let radar = drive.radar(frame.radar);
    let (height_m, (_, yaw)) = (radar.mounting.translation_m.z, mount(radar));
    let points = frame.points.iter().filter_map(|p| {
        let azimuth_std = p.std.azimuth_rad?.max(LEAST_AZIMUTH_STD_RAD);
        let at = match p.std.elevation_rad {
            Some(_) => DVec2::from_angle(-yaw).rotate(radar.mounting.direction(p.position_m).truncate()),
            None => {
                let left = p.range_m * p.azimuth_rad.sin();
                let down = height_m - settings.echo_height_m;
                let ahead = p.range_m * p.range_m - left * left - down * down;
                (ahead > 0.0).then(|| DVec2::new(ahead.sqrt(), left))?
            }
        };
        let range_m = at.length();
        let sound = range_m.is_finite() && range_m > 0.1 && p.range_rate_mps.is_finite();
        let rate = p.range_rate_mps * p.range_m / range_m;
        // Or known but for folds of the transmitters' turns.
        let known = p.ambiguity.is_settled() || is_unfolded(p.modulo_mps, radar.max_velocity_mps());
        sound.then_some(Mover {
            range_m,
            azimuth_rad: at.to_angle(),
            range_rate_mps: rate,
            std: [p.std.range_m, p.std.range_rate_mps.max(0.3 * radar.velocity_bin_mps()), azimuth_std],
            folded: !known && radar.max_velocity_mps() < settings.fastest_mps,
        })
    });
    Sight { points: points.collect() }
}

/// Tracks moving things.
pub struct Follower {
    tracker: Tracker,
}

impl Follower {
    /// Makes a tracker with the default settings.
    ///
    /// # Errors
    /// Returns the tracker's error for invalid settings, which the default settings never are.
    pub fn new() -> Result<Follower> {
        Ok(Follower { tracker: Tracker::new(TrackerSettings::default())? })
    }

    /// Processes a frame and returns the confirmed tracks that were seen in it, in the vehicle's level frame.
    /// The radar's own motion is `speed_mps` along the vehicle and its yaw rate.
    ///
    /// # Errors
    /// Returns an error if a frame runs backwards in time.
    pub fn step(
        &mut self,
        sight: &Sight,
        radar: &Radar,
        level: &Level,
        speed_mps: f64,
        settings: &Settings,
        time_s: f64,
    ) -> Result<Vec<LaneTrack>> {
        // One that stands knows so.
        let stands = level.speed_mps == 0.0 && level.yaw_rate_rad_per_s == 0.0;
        let speed_mps = if stands { 0.0 } else { speed_mps };
        let (at_m, heading_rad, turn) = (level.at_m, level.heading_rad, level.yaw_rate_rad_per_s);
        let mut station = Station::on_vehicle(mount(radar), at_m, heading_rad, speed_mps, turn);
        station.velocity_std_mps = if stands { 0.0 } else { settings.speed_std_mps };
        let own = DVec2::from_angle(-station.heading_rad).rotate(station.velocity_mps);
        let span = 2.0 * radar.max_velocity_mps();
        let moves = |p: &&Mover| {
            let over = p.range_rate_mps + own.dot(DVec2::from_angle(p.azimuth_rad));
            let over = if p.folded { over - span * (over / span).round() } else { over };
            let aside = own.length() * p.std[2] * p.azimuth_rad.sin().abs();
            let std = p.std[1].hypot(station.velocity_std_mps).hypot(aside);
            over.abs() > settings.slowest_mps.max(STANDING_SIGMAS * std)
        };
        let plots: Vec<Plot> = sight
            .points
            .iter()
            .filter(moves)
            .map(|p| {
                let doubt = if p.folded { settings.fastest_mps / 3.0 } else { 0.0 };
                Plot::of_point(
                    [p.range_m, p.range_rate_mps, p.azimuth_rad, 0.0],
                    [p.std[0], p.std[1].hypot(doubt), p.std[2]],
                )
            })
            .filter(|p| p.check(0).is_ok())
            .collect();
        let place = |p: &Plot| {
            let at = p.position_m();
            ClusterPoint { x_m: at.x, y_m: at.y, range_rate_mps: p.range_rate_mps }
        };
        let places: Vec<ClusterPoint> = plots.iter().map(place).collect();
        // A far car may be one point.
        let labels = Dbscan { min_points: 1, ..Dbscan::default() }.labels(&places)?;
        let plots = plots_of_clusters(&plots, &labels);
        let azimuth_rad = radar.processing.azimuth_fov_rad;
        let coverage = Some(Coverage { max_range_m: radar.max_range_m(), azimuth_rad });
        self.tracker.step(&Scan { time_s, station, coverage, plots: &plots })?;
        let confirmed = self.tracker.tracks().iter().filter(|t| t.state == TrackState::Confirmed);
        let moves = |t: &LaneTrack| DVec2::from_array(t.velocity_mps).length() > settings.slowest_mps;
        Ok(confirmed.map(|t| lane_track(level, t)).filter(moves).collect())
    }
}
