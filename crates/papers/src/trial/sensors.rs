//! Sensors of a vehicle in addition to its radars: a bus that reports speed and yaw rate, an odometer that
//! integrates them, a satellite receiver; and the form in which a frame's points are kept.

use crate::trial::drive::{Level, lane_point, lane_track};
use crate::trial::stats::draws;
use catseye::base::error::Result;
use catseye::base::rng::Draws;
use catseye::detect::accuracy::PointStd;
use catseye::detect::ambiguity::Ambiguity;
use catseye::detect::points::Point;
use catseye::scene::motion::{Joint, Motion};
use catseye::scene::radar::Radar;
use catseye::scene::scenario::SitedScenario;
use catseye::simulate::Frame;
use catseye_io::follow::Follower;
use catseye_lane::camera_fusion::Image;
use catseye_lane::hd_map::RadarPose;
use catseye_lane::{LanePoint, LaneTrack, Measured, PulseScan, SensorInput};
use glam::{DQuat, DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Reading of a speed or a yaw rate on a vehicle's bus: with noise, and rounded to steps. Each seed has its
/// own sequence.
pub struct BusSensor {
    draws: Draws,
    std: f64,
    /// Rounding step; 0 for none.
    step: f64,
}

impl BusSensor {
    pub fn new(seed: u64, std: f64, step: f64) -> BusSensor {
        BusSensor { draws: draws(seed, 0x5eed), std, step }
    }

    pub fn read(&mut self, truth: f64) -> Measured {
        let noisy = truth + self.std * self.draws.normal();
        let value = if self.step > 0.0 { (noisy / self.step).round() * self.step } else { noisy };
        Measured { value, std: self.std.hypot(self.step / 12f64.sqrt()) }
    }
}

/// Speed and yaw rate on a vehicle's bus, each with noise.
pub struct Bus {
    pub speed: BusSensor,
    pub yaw_rate: BusSensor,
}

impl Bus {
    /// Makes a bus: `speed` holds the standard deviation and the step, m/s; `yaw_rate` has its own draws and
    /// a standard deviation in degrees/s.
    pub fn new(seed: u64, [std, step]: [f64; 2], (draws, std_deg): (Draws, f64)) -> Bus {
        let yaw_rate = BusSensor { draws, std: std_deg.to_radians(), step: 0.0 };
        Bus { speed: BusSensor::new(seed, std, step), yaw_rate }
    }

    /// Reads speed (m/s) and yaw rate (rad/s).
    pub fn read(&mut self, level: &Level) -> [Measured; 2] {
        [self.speed.read(level.speed_mps), self.yaw_rate.read(level.yaw_rate_rad_per_s)]
    }
}

/// A look that holds only the time and the readings of the bus.
pub fn look_of(time_s: f64, [speed, yaw_rate]: [Measured; 2]) -> SensorInput<'static> {
    SensorInput {
        time_s,
        speed_mps: Some(speed),
        yaw_rate_rad_per_s: Some(yaw_rate),
        ..SensorInput::default()
    }
}

/// A point of a frame without its labels: what an estimator may know.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct KeptPoint {
    /// Range, range rate, azimuth, elevation, position, power, signal-to-noise ratio, cross section, and
    /// standard deviation of the beat in cells; units as in [`Point`].
    numbers: [f64; 11],
    std: PointStd,
    ambiguity: Ambiguity,
    /// Ambiguity of the range rate; None for infinite, which JSON cannot hold.
    modulo_mps: Option<f64>,
}

impl KeptPoint {
    /// Converts a point; None where a number is infinite, as the cross section is where an antenna has no
    /// gain.
    pub fn of(p: &Point) -> Option<KeptPoint> {
        let [x, y, z] = p.position_m.to_array();
        let told = [p.range_m, p.range_rate_mps, p.azimuth_rad, p.elevation_rad, p.snr_db, p.rcs_dbsm];
        let stds = [p.std.range_m, p.std.range_rate_mps, p.beat_std_cells];
        let [range, rate, azimuth, elevation, snr, rcs] = told;
        let numbers = [range, rate, azimuth, elevation, x, y, z, p.power_dbm, snr, rcs, p.beat_std_cells];
        let modulo_mps = p.modulo_mps.is_finite().then_some(p.modulo_mps);
        let kept = KeptPoint { numbers, std: p.std, ambiguity: p.ambiguity, modulo_mps };
        told.iter().chain(&stds).all(|v| v.is_finite()).then_some(kept)
    }

    pub fn point(&self) -> Point {
        let [range_m, range_rate_mps, azimuth_rad, elevation_rad, x, y, z, ..] = self.numbers;
        let [.., power_dbm, snr_db, rcs_dbsm, beat_std_cells] = self.numbers;
        Point {
            range_m,
            range_rate_mps,
            azimuth_rad,
            elevation_rad,
            position_m: DVec3::new(x, y, z),
            power_dbm,
            snr_db,
            rcs_dbsm,
            std: self.std,
            beat_std_cells,
            ambiguity: self.ambiguity,
            modulo_mps: self.modulo_mps.unwrap_or(f64::INFINITY),
            object_id: 0,
            class: String::new(),
            bounces: 0,
            ghost: false,
            side_lobe: false,
            folded: false,
            aliased: false,
            share: 0.0,
            angle_ambiguity: None,
            other_angles_rad: vec![],
            at_search_edge: false,
            others_std_rad: [0.0; 2],
            cell: None,
        }
    }
}

/// The points of a frame in the form in which they are kept.
pub fn kept_points(frame: &Frame) -> Vec<KeptPoint> {
    frame.points.iter().filter_map(KeptPoint::of).collect()
}

/// Kept points in the form of lane estimators.
pub fn lane_points(radar: &Radar, seen: &[KeptPoint]) -> Vec<LanePoint> {
    seen.iter().filter_map(|s| lane_point(radar, &s.point())).collect()
}

/// Position of a vehicle by the readings of its bus, in a frame of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Odometer {
    pub now: Level,
    time_s: f64,
}

impl Odometer {
    pub fn new(time_s: f64, speed_mps: f64, yaw_rate_rad_per_s: f64) -> Odometer {
        Odometer { now: Level { at_m: DVec2::ZERO, heading_rad: 0.0, speed_mps, yaw_rate_rad_per_s }, time_s }
    }

    /// Advances to this time with the mean speed and yaw rate of both ends.
    pub fn step(&mut self, time_s: f64, speed_mps: f64, yaw_rate_rad_per_s: f64) {
        let dt = time_s - self.time_s;
        let speed = 0.5 * (self.now.speed_mps + speed_mps);
        let turn = 0.5 * (self.now.yaw_rate_rad_per_s + yaw_rate_rad_per_s) * dt;
        self.now.at_m += DVec2::from_angle(self.now.heading_rad + 0.5 * turn) * (speed * dt);
        self.now.heading_rad += turn;
        (self.now.speed_mps, self.now.yaw_rate_rad_per_s) = (speed_mps, yaw_rate_rad_per_s);
        self.time_s = time_s;
    }

    /// The scenario with the vehicle at this position and motion, and without other motion, for the tracker.
    pub fn scenario_of_tracker(&self, scenario: &SitedScenario) -> SitedScenario {
        let l = &self.now;
        let velocity = (DVec2::from_angle(l.heading_rad) * l.speed_mps).extend(0.0);
        let joints = vec![
            Joint::Spin {
                axis: DVec3::Z,
                rate_rad_per_s: l.yaw_rate_rad_per_s,
                angle_rad: l.heading_rad - l.yaw_rate_rad_per_s * self.time_s,
            },
            Joint::Fixed(DQuat::IDENTITY, l.at_m.extend(0.0) - velocity * self.time_s),
            Joint::Line(velocity),
        ];
        let mut told = scenario.clone();
        told.ego.motion = Some(Arc::new(Motion { joints }));
        told
    }
}

/// Tracks moving things, with the vehicle's motion from its own bus.
pub struct TrackFollower {
    follower: Follower,
    odometer: Option<Odometer>,
}

impl TrackFollower {
    /// Makes a tracker with the default settings.
    ///
    /// # Errors
    /// Returns the tracker's error for invalid settings, which the default settings never are.
    pub fn new() -> Result<TrackFollower> {
        Ok(TrackFollower { follower: Follower::new()?, odometer: None })
    }

    /// Processes a frame; returns the tracks to which its points were assigned, in the vehicle's level frame.
    pub fn step(
        &mut self,
        scenario: &SitedScenario,
        radar: &Radar,
        index: u32,
        seen: &[KeptPoint],
        [speed, yaw_rate]: [Measured; 2],
    ) -> Result<Vec<LaneTrack>> {
        let time_s = scenario.frames.time_s(index);
        let odometer =
            self.odometer.get_or_insert_with(|| Odometer::new(time_s, speed.value, yaw_rate.value));
        odometer.step(time_s, speed.value, yaw_rate.value);
        let points: Vec<Point> = seen.iter().map(KeptPoint::point).collect();
        self.follower.points(&odometer.scenario_of_tracker(scenario), radar, index, &points)?;
        let now = odometer.now;
        let fresh = self.follower.tracker.confirmed().filter(|t| t.seen_s == time_s);
        Ok(fresh.map(|t| lane_track(&now, t)).collect())
    }
}

/// A [`SensorInput`] that owns its data.
#[derive(Debug, Clone, Default)]
pub struct OwnedInput {
    /// Time of the look, s.
    pub time_s: f64,
    /// Speed from the bus, m/s.
    pub speed_mps: Option<Measured>,
    /// Yaw rate from the bus, rad/s.
    pub yaw_rate_rad_per_s: Option<Measured>,
    /// Detected points.
    pub points: Vec<LanePoint>,
    /// Tracks of moving things.
    pub tracks: Vec<LaneTrack>,
    /// Samples of an impulse radar's scan.
    pub pulse: Option<Vec<f64>>,
    /// Scans since the last look.
    pub scans: Vec<PulseScan>,
    /// Image of a camera.
    pub image: Option<Image>,
    /// Pose of the radar on the earth.
    pub place: Option<RadarPose>,
}

impl OwnedInput {
    /// The input in the form of estimators.
    pub fn input(&self) -> SensorInput<'_> {
        SensorInput {
            time_s: self.time_s,
            speed_mps: self.speed_mps,
            yaw_rate_rad_per_s: self.yaw_rate_rad_per_s,
            points: &self.points,
            tracks: &self.tracks,
            pulse: self.pulse.as_deref(),
            scans: &self.scans,
            image: self.image.as_ref(),
            place: self.place,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::base::frames::direction_from_angles;
    use catseye::road::site::Site;
    use catseye::scene::scenario::Scenario;
    use std::path::Path;

    /// A point of something with a range rate, beside its azimuth and distance.
    fn point(
        range_m: f64,
        azimuth_rad: f64,
        range_rate_mps: f64,
        ambiguity: Ambiguity,
        modulo_mps: f64,
    ) -> Point {
        Point {
            range_m,
            range_rate_mps,
            azimuth_rad,
            elevation_rad: 0.0,
            position_m: direction_from_angles(azimuth_rad, 0.0) * range_m,
            power_dbm: -80.0,
            snr_db: 20.0,
            rcs_dbsm: 0.0,
            std: PointStd {
                range_m: 0.05,
                range_rate_mps: 0.05,
                azimuth_rad: Some(0.005),
                elevation_rad: None,
            },
            beat_std_cells: 0.1,
            ambiguity,
            modulo_mps,
            object_id: 0,
            class: String::new(),
            bounces: 0,
            ghost: false,
            side_lobe: false,
            folded: false,
            aliased: false,
            share: 0.0,
            angle_ambiguity: None,
            other_angles_rad: vec![],
            at_search_edge: false,
            others_std_rad: [0.0; 2],
            cell: None,
        }
    }

    /// What a radar whose transmitters take turns knows of a rate, that it is λ/2T_c from the next one, is kept with the point: a car
    /// that one turn of the Doppler map tells from what stands has a track, with its speed.
    #[test]
    fn a_rate_known_but_for_the_transmitters_turns_still_makes_a_track() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/lane/camera_straight.toml");
        let scenario = Scenario::load(&path).and_then(|s| Site::new(&s)).unwrap().scenario;
        let radar = &scenario.radars[0];
        let span = 2.0 * radar.max_velocity_mps();
        let turns = span * radar.tx.len() as f64;
        let own_mps = 12.0;
        let read = [Measured { value: own_mps, std: 0.1 }, Measured { value: 0.0, std: 1e-3 }];
        let mut follower = TrackFollower::new().unwrap();
        let mut tracks = Vec::new();
        for index in 0..5 {
            let stands = (-8..=8).filter(|k| *k != 0).map(|k| {
                let azimuth = f64::from(k) * 0.08;
                let range_m = 20.0 + f64::from(k);
                point(range_m, azimuth, -own_mps * azimuth.cos(), Ambiguity::EgoSpeed, turns)
            });
            let rate = span - own_mps;
            let range_m = 40.0 + rate * scenario.frames.time_s(index);
            let car = point(range_m, 0.0, rate, Ambiguity::Ambiguous, turns);
            let kept: Vec<KeptPoint> =
                stands.chain([car]).map(|p| KeptPoint::of(&p).expect("finite numbers")).collect();
            // As an interrupted run finds them.
            let kept: Vec<KeptPoint> = serde_json::from_str(&serde_json::to_string(&kept).unwrap()).unwrap();
            assert!(kept.iter().all(|k| k.point().modulo_mps == turns), "{index}");
            tracks = follower.step(&scenario, radar, index, &kept, read).unwrap();
        }
        let [track] = &*tracks else { panic!("{} tracks", tracks.len()) };
        let [ahead, left] = track.velocity_mps;
        assert!((ahead - span).abs() < 0.2 && left.abs() < 1.0, "{ahead} {left}, not {span}");
    }

    #[test]
    fn a_point_is_kept_as_it_is() {
        for modulo_mps in [12.5, f64::INFINITY] {
            let p = point(17.0, 0.1, -3.0, Ambiguity::Unambiguous, modulo_mps);
            let kept = serde_json::to_string(&KeptPoint::of(&p).expect("finite numbers")).unwrap();
            assert_eq!(serde_json::from_str::<KeptPoint>(&kept).unwrap().point(), p);
        }
    }
}
