//! Results that only a sequence of frames gives: the ego motion of each frame from its stationary points, and tracks of
//! objects. Both are made from the files of the frames, so that a resumed run gives the same bytes.
//!
//! Nothing that a radar did not measure is used as measured: points whose direction is a bound (`at_search_edge`) or one of
//! several (`angle_ambiguity`) are left out, and an ambiguous range rate counts modulo its interval. The ego vehicle's own speed,
//! as its bus reports it, is known to both.

use super::files::frame_name;
use catseye::base::error::{Error, Result};
use catseye::base::frames::direction_from_angles;
use catseye::detect::accuracy::PointStd;
use catseye::detect::ambiguity::{Ambiguity, Standing, is_unfolded};
use catseye::detect::cluster::{ClusterPoint, Dbscan};
use catseye::detect::ego_motion::{
    EgoModel, EgoMotion, EgoSettings, KnownSpeed, MAX_SPEED_MPS, Mount, Radial, ego_motion,
};
use catseye::detect::files::write_rows;
use catseye::detect::kalman::Station;
use catseye::detect::plot::{Plot, plots_of_clusters};
use catseye::detect::points::Point;
use catseye::detect::same_slope;
use catseye::detect::track_table::{TrackRow, write_tracks};
use catseye::detect::tracker::{Coverage, Scan, Tracker, TrackerSettings};
use catseye::formats::column::{Column, Get};
use catseye::formats::csv::Table;
use catseye::scene::radar::Radar;
use catseye::scene::scenario::SitedScenario;
use catseye::scene::waveform::Multiplex;
use catseye::simulate::radar_pose;
use glam::{DVec2, DVec3};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Error of a speed on a vehicle's bus: a share, and a part that does not depend on the speed, m/s. Wheel speed sensors are within 1 %
/// with worn tyres; the rest is slip and yaw of a radar off the axle.
const BUS_SHARE: f64 = 0.05;
const BUS_MPS: f64 = 1.0;
/// Distance from the rear axle from which on a radar's lateral velocity says how fast a car turns, m.
const ARM_M: f64 = 0.5;

/// A row of `ego_motion.csv`.
#[derive(Debug, Clone, Default)]
pub struct EgoRow {
    /// Number of the frame.
    pub frame: u32,
    /// Middle of the frame, s.
    pub time_s: f64,
    /// Name of the radar; `all` where several were used together.
    pub radar: String,
    /// Velocity along the vehicle's axes, m/s; NaN without an estimate.
    pub velocity_mps: [f64; 2],
    /// Standard deviations of the velocity, m/s.
    pub velocity_std_mps: [f64; 2],
    /// Number of points that are stationary.
    pub standing: u32,
    /// Number of all points.
    pub points: u32,
    /// Why there is no estimate.
    pub reason: String,
    /// Yaw rate, rad/s, positive to the left, with its standard deviation; NaN without.
    pub yaw_rate: [f64; 2],
}

/// Columns of `ego_motion.csv`.
pub const EGO_MOTION: [Column<EgoRow>; 12] = [
    Column { name: "frame", about: "number of the frame", get: Get::Count(|r| r.frame) },
    Column::number("time_s", "time of the middle of the frame, from the middle of frame 0", |r| r.time_s),
    Column {
        name: "radar",
        about: "name of the radar; all for the estimate from the points of all radars",
        get: Get::Text(64, |r| r.radar.as_str().into()),
    },
    Column::number(
        "vx_mps",
        "forward velocity of the radar (for all: of the vehicle's origin) over the ground; empty without an estimate",
        |r| r.velocity_mps[0],
    ),
    Column::number("vy_mps", "velocity to the left, along the vehicle's y axis", |r| r.velocity_mps[1]),
    Column::number("vx_std_mps", "standard deviation of vx_mps", |r| r.velocity_std_mps[0]),
    Column::number("vy_std_mps", "standard deviation of vy_mps", |r| r.velocity_std_mps[1]),
    Column { name: "standing_points", about: "number of stationary points", get: Get::Count(|r| r.standing) },
    Column { name: "points", about: "number of all points of the frame", get: Get::Count(|r| r.points) },
    Column {
        name: "reason",
        about: "reason for a missing estimate",
        get: Get::Text(200, |r| r.reason.as_str().into()),
    },
    Column::number(
        "yaw_rate_rad_per_s",
        "yaw rate, positive to the left; for one radar under the assumption that the rear axle does not slip",
        |r| r.yaw_rate[0],
    ),
    Column::number("yaw_rate_std_rad_per_s", "standard deviation of the yaw rate", |r| r.yaw_rate[1]),
];

/// A point in the form that the tracker needs.
#[derive(Debug, Clone, Copy)]
pub struct SensorPoint {
    range_m: f64,
    range_rate_mps: f64,
    azimuth_rad: f64,
    elevation_rad: f64,
    std: PointStd,
    /// Whether the ambiguity interval of its range rate is known.
    resolved: bool,
    /// Whether the radar itself found it, and not the ego's speed.
    by_radar: bool,
    /// Interval modulo which its range rate is known, m/s; infinite if it is unambiguous, or nothing is
    /// stated.
    modulo_mps: f64,
    /// Whether its direction was measured, as one and no bound.
    has_direction: bool,
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
            by_radar: matches!(p.ambiguity, Ambiguity::Unambiguous | Ambiguity::Resolved),
            modulo_mps: p.modulo_mps,
            has_direction: !p.at_search_edge && p.angle_ambiguity != Some(Ambiguity::Ambiguous),
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
        let time_s = scenario.frames.time_s(index);
        let [_, moving] = by_motion(scenario, radar, time_s, &all);
        self.step(scenario, radar, time_s, &[moving])
    }

    /// Passes groups of points to the tracker; points of different groups are never one plot.
    fn step(
        &mut self,
        scenario: &SitedScenario,
        radar: &Radar,
        time_s: f64,
        groups: &[Vec<SensorPoint>],
    ) -> Result<()> {
        let plots: Vec<Vec<Plot>> = groups.iter().map(|g| clustered(radar, g)).collect::<Result<_>>()?;
        let plots = plots.concat();
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
    // Runs of older versions do not have all of these.
    let text = |name: &str| if table.has(name) { table.text(name).map(Some) } else { Ok(None) };
    let (at_edge, angles) = (text("at_search_edge")?, text("angle_ambiguity")?);
    let has_direction = |i: usize| {
        at_edge.as_ref().is_none_or(|e| !matches!(&*e[i], "1" | "true"))
            && angles.as_ref().is_none_or(|a| &*a[i] != "ambiguous")
    };
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
            by_radar: ["resolved", "unambiguous"].contains(&&*state[i]),
            modulo_mps: modulo[i],
            has_direction: has_direction(i),
        })
        .collect())
}

/// Writes `ego_motion.csv` ([`EGO_MOTION`], in the vehicle's axes) and `tracks.csv`
/// ([`catseye::detect::track_table::TRACKS`], in the world's plane) into the run's folder. Moving and standing objects are tracked; the
/// tracker is given the ego vehicle's own motion.
///
/// # Errors
/// Returns an error if the points cannot be read.
pub fn write(dir: &Path, scenario: &SitedScenario) -> Result<()> {
    let mut follower = Follower::new()?;
    let mut tracks: Vec<TrackRow> = Vec::new();
    let mut ego: Vec<EgoRow> = Vec::new();
    for index in 0..scenario.frames.count {
        let time_s = scenario.frames.time_s(index);
        let mut scans = Vec::with_capacity(scenario.radars.len());
        for radar in &scenario.radars {
            let mut folder = dir.join(frame_name(index));
            if scenario.radars.len() > 1 {
                folder.push(&radar.name);
            }
            let points = read_points(&folder.join("points.csv"))?;
            ego.push(EgoRow {
                frame: index,
                time_s,
                radar: radar.name.clone(),
                ..own_motion(scenario, radar, &points, index)
            });
            follower.step(scenario, radar, time_s, &by_motion(scenario, radar, time_s, &points))?;
            scans.push((radar, points));
        }
        if scans.len() > 1 {
            let row = motion_of_all(scenario, &scans, index);
            ego.push(EgoRow { frame: index, time_s, radar: "all".into(), ..row });
        }
        tracks.extend(TrackRow::of_frame(index, time_s, &follower.tracker, false));
    }
    let file = |name: &str| {
        let path = dir.join(name);
        File::create(&path).map(BufWriter::new).map_err(|e| Error::io(&path, e))
    };
    let wrong = |name: &str| {
        let path = dir.join(name);
        move |e| Error::io(&path, e)
    };
    write_rows(file("ego_motion.csv")?, &EGO_MOTION, &ego).map_err(wrong("ego_motion.csv"))?;
    write_tracks(file("tracks.csv")?, &tracks).map_err(wrong("tracks.csv"))?;
    Ok(())
}

/// Stationary points, and points that move over the ground, by the ego vehicle's own motion. Points without a measured direction are in
/// neither group.
fn by_motion(
    scenario: &SitedScenario,
    radar: &Radar,
    time_s: f64,
    points: &[SensorPoint],
) -> [Vec<SensorPoint>; 2] {
    let (pose, velocity_mps) = radar_pose(radar, &scenario.ego, time_s);
    let own = pose.inverse().direction(velocity_mps);
    let standing = Standing::seen_by(radar, own);
    let is_stationary = |p: &SensorPoint| {
        let off = p.range_rate_mps + own.dot(direction_from_angles(p.azimuth_rad, p.elevation_rad));
        let width = ambiguity_mps(radar, p);
        let off = if width.is_finite() { off - width * (off / width).round() } else { off };
        // An error of the direction changes the range rate that a stationary point has.
        let by_angle = 3.0 * p.std.azimuth_rad.unwrap_or(0.0) * own.length() * p.azimuth_rad.sin().abs();
        off.abs() <= standing.tolerance_mps + by_angle.max(3.0 * p.std.range_rate_mps)
    };
    let (still, moving): (Vec<_>, Vec<_>) =
        points.iter().filter(|p| p.has_direction).copied().partition(is_stationary);
    [still, moving]
}

/// The interval modulo which a range rate is known by the radar itself, m/s; infinite where it is known.
fn ambiguity_mps(radar: &Radar, p: &SensorPoint) -> f64 {
    match p.by_radar {
        true => f64::INFINITY,
        // Pairs of slopes have no intervals.
        false if !one_slope(radar) => f64::INFINITY,
        false if p.modulo_mps.is_finite() => p.modulo_mps,
        false => {
            // Empty Doppler bands have already been searched.
            let bands = match radar.multiplex {
                Multiplex::Ddm { bands } if bands > radar.tx.len() => bands as f64,
                _ => 1.0,
            };
            2.0 * radar.max_velocity_mps() * bands
        }
    }
}

fn radials(radar: &Radar, points: &[SensorPoint], number: usize, speed_mps: f64) -> Vec<Radial> {
    let measured = points.iter().filter(|p| p.has_direction && p.std.azimuth_rad.is_some());
    measured
        .map(|p| {
            let by_angle = speed_mps.abs() * p.azimuth_rad.sin().abs() * p.std.azimuth_rad.unwrap_or(0.0);
            Radial {
                azimuth_rad: p.azimuth_rad,
                elevation_rad: p.elevation_rad,
                range_rate_mps: p.range_rate_mps,
                range_rate_std_mps: p.std.range_rate_mps.max(0.5 * radar.velocity_bin_mps()).hypot(by_angle),
                ambiguity_mps: ambiguity_mps(radar, p),
                radar: number,
            }
        })
        .collect()
}

/// The ego's speed as its bus reports it, in axes that the vehicle's are turned to by `direction_rad`, at a place of the vehicle.
fn bus(scenario: &SitedScenario, index: u32, direction_rad: f64, arm_m: DVec2) -> KnownSpeed {
    let now = scenario.ego.at(scenario.frames.time_s(index));
    let speed_mps = now.velocity_mps.dot(now.rotation * DVec3::X);
    KnownSpeed::of_car(speed_mps, direction_rad, BUS_MPS + BUS_SHARE * speed_mps.abs(), arm_m)
}

/// Number of points without a measured direction, for a reason.
fn without_direction(points: &[SensorPoint]) -> String {
    let n = points.iter().filter(|p| !p.has_direction).count();
    if n == 0 { String::new() } else { format!("; {n} points without a measured direction were left out") }
}

/// The velocity of a radar from its points, in the vehicle's axes. The yaw rate is that of a car whose rear axle does not slip.
fn own_motion(scenario: &SitedScenario, radar: &Radar, points: &[SensorPoint], index: u32) -> EgoRow {
    let mount = mount(radar, scenario.frames.time_s(index));
    let speed = bus(scenario, index, -mount.yaw_rad, mount.position_m);
    let settings =
        EgoSettings { seed: scenario.seed, frame: index, speed: Some(speed), ..EgoSettings::default() };
    let count = points.len() as u32;
    match ego_motion(&radials(radar, points, 0, speed.speed_mps), &EgoModel::Sensor, &settings) {
        Ok(motion) => {
            let turn = DVec2::from_angle(mount.yaw_rad);
            let v = turn.rotate(DVec2::new(motion.value[0], motion.value[1]));
            let c = &motion.covariance;
            let variance = |along: DVec2| {
                let a = DVec2::from_angle(-mount.yaw_rad).rotate(along);
                a.x * a.x * c[0][0] + 2.0 * a.x * a.y * c[0][1] + a.y * a.y * c[1][1]
            };
            let std = [variance(DVec2::X), variance(DVec2::Y)].map(f64::sqrt);
            let arm = mount.position_m.x;
            let yaw_rate = if arm.abs() >= ARM_M { [v.y / arm, std[1] / arm.abs()] } else { [f64::NAN; 2] };
            EgoRow {
                velocity_mps: v.to_array(),
                velocity_std_mps: std,
                standing: standing(&motion),
                points: count,
                yaw_rate,
                ..EgoRow::default()
            }
        }
        Err(e) => no_motion(count, format!("{e}{}", without_direction(points))),
    }
}

/// The motion of the vehicle's origin from the points of several radars.
fn motion_of_all(scenario: &SitedScenario, scans: &[(&Radar, Vec<SensorPoint>)], index: u32) -> EgoRow {
    let (speed, time_s) = (bus(scenario, index, 0.0, DVec2::ZERO), scenario.frames.time_s(index));
    let settings =
        EgoSettings { seed: scenario.seed, frame: index, speed: Some(speed), ..EgoSettings::default() };
    let numbered = scans.iter().enumerate();
    let all: Vec<Radial> = numbered.flat_map(|(i, (r, p))| radials(r, p, i, speed.speed_mps)).collect();
    let mounts = scans.iter().map(|(r, _)| mount(r, time_s)).collect();
    let count = scans.iter().map(|(_, p)| p.len() as u32).sum();
    match ego_motion(&all, &EgoModel::Plane(mounts), &settings) {
        Ok(motion) => {
            let ([x, y, w], c) = (motion.value, &motion.covariance);
            EgoRow {
                velocity_mps: [x, y],
                velocity_std_mps: [c[0][0].sqrt(), c[1][1].sqrt()],
                standing: standing(&motion),
                points: count,
                yaw_rate: [w, c[2][2].sqrt()],
                ..EgoRow::default()
            }
        }
        Err(e) => no_motion(count, e.to_string()),
    }
}

fn no_motion(points: u32, reason: String) -> EgoRow {
    let none = [f64::NAN; 2];
    EgoRow { velocity_mps: none, velocity_std_mps: none, yaw_rate: none, points, reason, ..EgoRow::default() }
}

fn standing(motion: &EgoMotion) -> u32 {
    motion.standing.iter().filter(|s| **s).count() as u32
}

/// Where a radar is on its vehicle.
fn mount(radar: &Radar, time_s: f64) -> Mount {
    let at = radar.on_vehicle(time_s);
    let ahead = at.rotation * DVec3::X;
    Mount { position_m: at.translation_m.truncate(), yaw_rad: ahead.y.atan2(ahead.x) }
}

/// Whether all ramps have one slope: different slopes unfold each other's rates.
fn one_slope(radar: &Radar) -> bool {
    same_slope::ramps(radar).len() == 1
}

fn clustered(radar: &Radar, points: &[SensorPoint]) -> Result<Vec<Plot>> {
    // A rate that may be folded says little of the speed.
    let folds = one_slope(radar) && radar.max_velocity_mps() < MAX_SPEED_MPS;
    let plots: Vec<Plot> = points
        .iter()
        .filter_map(|p| {
            let azimuth = p.std.azimuth_rad?;
            let doubt = if folds && !p.is_unfolded(radar) { MAX_SPEED_MPS / 3.0 } else { 0.0 };
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
