//! Results that only a sequence of frames gives: the ego-motion of each frame from its stationary points, and
//! tracks of moving objects. Both are made from the files of the frames, so that a resumed run gives the same
//! bytes.

use super::files::frame_name;
use catseye::base::error::{Error, Result};
use catseye::detect::accuracy::PointStd;
use catseye::detect::ambiguity::is_unfolded;
use catseye::detect::cluster::{ClusterPoint, Dbscan};
use catseye::detect::ego_motion::{EgoModel, EgoSettings, Fold, Radial, ego_motion};
use catseye::detect::kalman::Station;
use catseye::detect::plot::{Plot, plots_of_clusters};
use catseye::detect::points::Point;
use catseye::detect::same_slope;
use catseye::detect::track_table::{TrackRow, write_tracks};
use catseye::detect::tracker::{Coverage, Scan, Tracker, TrackerSettings};
use catseye::formats::csv::{Table, Writer};
use catseye::scene::radar::Radar;
use catseye::scene::scenario::SitedScenario;
use catseye::scene::waveform::Multiplex;
use catseye::simulate::radar_pose;
use glam::{DVec2, DVec3};
use std::fmt::Display;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Largest speed of a vehicle, m/s.
const FASTEST_MPS: f64 = 70.0;

/// Columns of `ego_motion.csv`; `reason` states why there is no velocity.
const EGO_COLUMNS: [&str; 10] = [
    "frame",
    "time_s",
    "radar",
    "vx_mps",
    "vy_mps",
    "vx_std_mps",
    "vy_std_mps",
    "standing_points",
    "points",
    "reason",
];

/// A point in the form that the tracker needs.
#[derive(Debug, Clone, Copy)]
pub struct SensorPoint {
    range_m: f64,
    range_rate_mps: f64,
    azimuth_rad: f64,
    elevation_rad: f64,
    std: PointStd,
    /// Whether the fold of its range rate is known.
    resolved: bool,
    /// Interval modulo which its range rate is known, m/s; infinite if it is unambiguous, or nothing is
    /// stated.
    modulo_mps: f64,
}

impl SensorPoint {
    /// Converts a detected point.
    pub fn of(p: &Point) -> SensorPoint {
        SensorPoint {
            range_m: p.range_m,
            range_rate_mps: p.range_rate_mps,
            azimuth_rad: p.azimuth_rad,
            elevation_rad: p.elevation_rad,
            std: p.std,
            resolved: p.ambiguity.is_settled(),
            modulo_mps: p.modulo_mps,
        }
    }

    /// Whether more is known of the rate than its row states: its fold, or its value up to folds of the
    /// transmitters' turns.
    fn is_unfolded(&self, radar: &Radar) -> bool {
        self.resolved || is_unfolded(self.modulo_mps, radar.max_velocity_mps())
    }
}

/// Tracks moving objects from the points of successive frames.
pub struct Follower {
    /// The tracker.
    pub tracker: Tracker,
}

impl Follower {
    /// Makes a follower with the default settings.
    ///
    /// # Errors
    /// Returns the tracker's error for invalid settings, which the default settings never are.
    pub fn new() -> Result<Follower> {
        Ok(Follower { tracker: Tracker::new(TrackerSettings::default())? })
    }

    /// Passes the moving points of a frame to the tracker, together with the ego vehicle's own motion.
    ///
    /// # Errors
    /// Returns an error for points with non-finite values, which the tracker refuses.
    pub fn points(
        &mut self,
        scenario: &SitedScenario,
        radar: &Radar,
        index: u32,
        points: &[Point],
    ) -> Result<()> {
        let all: Vec<SensorPoint> = points.iter().map(SensorPoint::of).collect();
        let (moving, _) = without_standing(radar, &all, scenario.seed, index);
        self.step(scenario, radar, scenario.frames.time_s(index), &moving)
    }

    fn step(
        &mut self,
        scenario: &SitedScenario,
        radar: &Radar,
        time_s: f64,
        moving: &[SensorPoint],
    ) -> Result<()> {
        let plots = clustered(radar, moving)?;
        let (pose, velocity_mps) = radar_pose(radar, &scenario.ego, time_s);
        let ahead = pose.direction(DVec3::X);
        let station = Station {
            position_m: pose.translation_m.truncate(),
            heading_rad: ahead.y.atan2(ahead.x),
            velocity_mps: velocity_mps.truncate(),
            ..Station::ORIGIN
        };
        let coverage = Some(Coverage {
            max_range_m: radar.max_range_m(),
            azimuth_rad: radar.processing.azimuth_fov_rad,
        });
        self.tracker.step(&Scan { time_s, station, coverage, plots: &plots })
    }
}

fn read_points(path: &Path) -> Result<Vec<SensorPoint>> {
    let table = Table::read(path)?;
    let column = |name: &str| table.numbers(name);
    let (range, rate) = (column("range_m")?, column("range_rate_mps")?);
    let (azimuth, elevation) = (column("azimuth_deg")?, column("elevation_deg")?);
    let (range_std, rate_std) = (column("range_std_m")?, column("range_rate_std_mps")?);
    let state = table.text("ambiguity")?;
    let azimuth_std: Vec<Option<f64>> =
        table.text("azimuth_std_deg")?.iter().map(|t| t.parse::<f64>().ok().map(f64::to_radians)).collect();
    let modulo: Vec<f64> = match table.text("range_rate_modulo_mps") {
        Ok(list) => list.iter().map(|t| t.parse().unwrap_or(f64::INFINITY)).collect(),
        Err(_) => vec![f64::INFINITY; table.len()],
    };
    Ok((0..table.len())
        .map(|i| SensorPoint {
            range_m: range[i],
            range_rate_mps: rate[i],
            azimuth_rad: azimuth[i].to_radians(),
            elevation_rad: elevation[i].to_radians(),
            std: PointStd {
                range_m: range_std[i],
                range_rate_mps: rate_std[i],
                azimuth_rad: azimuth_std[i],
                elevation_rad: None,
            },
            resolved: ["resolved", "unambiguous", "ego_speed"].contains(&&*state[i]),
            modulo_mps: modulo[i],
        })
        .collect())
}

/// Writes `ego_motion.csv` (velocity of each radar in its own frame, m/s) and `tracks.csv` (in the world's
/// plane) into the run's folder. Points that are stationary by their range rates make no tracks; the tracker
/// is given the ego vehicle's own motion.
///
/// # Errors
/// Returns an error if the points cannot be read.
pub fn write(dir: &Path, scenario: &SitedScenario) -> Result<()> {
    let mut follower = Follower::new()?;
    let mut rows: Vec<TrackRow> = Vec::new();
    let path = dir.join("ego_motion.csv");
    let out = File::create(&path).map_err(|e| Error::io(&path, e))?;
    let wrong = |e| Error::io(&path, e);
    let mut ego = Writer::new(BufWriter::new(out), &[], &EGO_COLUMNS).map_err(wrong)?;
    for index in 0..scenario.frames.count {
        let time_s = scenario.frames.time_s(index);
        for radar in &scenario.radars {
            let mut folder = dir.join(frame_name(index));
            if scenario.radars.len() > 1 {
                folder.push(&radar.name);
            }
            let points = read_points(&folder.join("points.csv"))?;
            let (moving, fit) = without_standing(radar, &points, scenario.seed, index);
            let empty = String::new();
            let text = |x: Option<f64>| x.map_or_else(|| empty.clone(), |v| v.to_string());
            let (count, known) = (points.len(), fit.as_ref().ok());
            let reason = fit.as_ref().err().map_or_else(|| empty.clone(), |e| e.to_string());
            let cells = [
                text(known.map(|f| f.velocity[0])),
                text(known.map(|f| f.velocity[1])),
                text(known.map(|f| f.std[0])),
                text(known.map(|f| f.std[1])),
            ];
            ego.row([
                &index as &dyn Display,
                &time_s,
                &radar.name,
                &cells[0],
                &cells[1],
                &cells[2],
                &cells[3],
                &known.map_or(0, |f| f.standing),
                &count,
                &reason,
            ])
            .map_err(wrong)?;
            follower.step(scenario, radar, time_s, &moving)?;
        }
        rows.extend(TrackRow::of_frame(index, time_s, &follower.tracker, false));
    }
    ego.finish().map_err(wrong)?;
    let path = dir.join("tracks.csv");
    let out = File::create(&path).map_err(|e| Error::io(&path, e))?;
    write_tracks(BufWriter::new(out), &rows).map_err(|e| Error::io(&path, e))?;
    Ok(())
}

/// The radar's own velocity as estimated from its points.
struct Fit {
    velocity: DVec2,
    std: DVec2,
    standing: usize,
}

/// The moving points, and the fit that separates them; without a fit all points, and the reason.
fn without_standing(
    radar: &Radar,
    points: &[SensorPoint],
    seed: u64,
    frame: u32,
) -> (Vec<SensorPoint>, std::result::Result<Fit, Error>) {
    let radials: Vec<Radial> = points
        .iter()
        .map(|p| Radial {
            azimuth_rad: p.azimuth_rad,
            elevation_rad: p.elevation_rad,
            range_rate_mps: p.range_rate_mps,
            range_rate_std_mps: p.std.range_rate_mps.max(0.5 * radar.velocity_bin_mps()),
            radar: 0,
        })
        .collect();
    // Pairs of slopes and empty Doppler bands have already unfolded their points.
    let bands = match radar.multiplex {
        Multiplex::Ddm { bands } if bands > radar.tx.len() => bands as f64,
        _ => 1.0,
    };
    let folded = one_slope(radar)
        .then(|| Fold { ambiguity_mps: 2.0 * radar.max_velocity_mps() * bands, max_speed_mps: FASTEST_MPS });
    let settings = EgoSettings { seed, frame, folded, ..EgoSettings::default() };
    match ego_motion(&radials, &EgoModel::Sensor, &settings) {
        Ok(motion) => {
            let fit = Fit {
                velocity: DVec2::new(motion.value[0], motion.value[1]),
                std: DVec2::new(motion.covariance[0][0].sqrt(), motion.covariance[1][1].sqrt()),
                standing: motion.standing.iter().filter(|s| **s).count(),
            };
            // A known rate far from that of stationary points is a mover's, even if it folds onto it.
            let moves = |i: &usize| {
                let over = EgoModel::Sensor.over_ground_mps(&radials[*i], &motion).abs();
                !motion.standing[*i] || (points[*i].is_unfolded(radar) && over > radar.max_velocity_mps())
            };
            let moving = (0..points.len()).filter(moves).map(|i| points[i]).collect();
            (moving, Ok(fit))
        }
        // No point is known to be stationary.
        Err(e) => (points.to_vec(), Err(e)),
    }
}

/// Whether all ramps have one slope: different slopes unfold each other's rates.
fn one_slope(radar: &Radar) -> bool {
    same_slope::ramps(radar).len() == 1
}

fn clustered(radar: &Radar, points: &[SensorPoint]) -> Result<Vec<Plot>> {
    // A rate that may be folded says little of the speed.
    let folds = one_slope(radar) && radar.max_velocity_mps() < FASTEST_MPS;
    let plots: Vec<Plot> = points
        .iter()
        .filter_map(|p| {
            let azimuth = p.std.azimuth_rad?;
            let doubt = if folds && !p.is_unfolded(radar) { FASTEST_MPS / 3.0 } else { 0.0 };
            let plot = Plot::of_point(
                [p.range_m, p.range_rate_mps, p.azimuth_rad, p.elevation_rad],
                [p.std.range_m, p.std.range_rate_mps.hypot(doubt), azimuth],
            );
            plot.check(0).is_ok().then_some(plot)
        })
        .collect();
    let places: Vec<ClusterPoint> = plots
        .iter()
        .map(|p| {
            let at = p.position_m();
            ClusterPoint { x_m: at.x, y_m: at.y, range_rate_mps: p.range_rate_mps }
        })
        .collect();
    // A far car may be one point.
    let labels = Dbscan { min_points: 1, ..Dbscan::default() }.labels(&places)?;
    Ok(plots_of_clusters(&plots, &labels))
}
