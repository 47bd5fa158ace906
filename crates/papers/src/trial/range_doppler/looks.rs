//! Looks of one radar at one site, with the truth.

use crate::trial::drive::true_lanes;
use crate::trial::kit::*;
use crate::trial::range_doppler::settings::Settings;
use catseye::detect::points::{Point, range_rate_mps};
use catseye_lane::range_doppler::{LaneLook, RangeDopplerLane};

/// Value that replaces an unknown standard deviation, as result files hold no infinity.
pub const UNKNOWN_STD: f64 = 1e6;

/// Data kept of a frame for the estimator and for pictures.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KeptLook {
    pub points: Vec<LanePoint>,
    pub map: Option<MapPicture>,
}

/// The strongest cell of each patch of the map, dBm.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MapPicture {
    /// Edges of the map in range, m.
    pub range_m: [f64; 2],
    pub range_rate_mps: [f64; 2],
    pub rows: usize,
    pub columns: usize,
    pub dbm: Vec<f32>,
}

/// Truth of the radar: offset and heading, speed, its markers.
pub type OfRadar = (Option<[f64; 2]>, f64, Vec<([f64; 2], bool)>);

/// One look with all data for rows and pictures.
pub struct RadarLook {
    pub step: Step,
    pub look: LaneLook,
    /// True offset of the radar from the lane's centre line (m) and heading of its motion (rad).
    pub radar: Option<[f64; 2]>,
    /// True speed of the radar over ground, m/s.
    pub speed_mps: f64,
    /// Range (m) and range rate (m/s) of each true marker in reach, and whether it is behind the radar.
    pub markers: Vec<([f64; 2], bool)>,
    pub seen: KeptLook,
    pub case: Option<usize>,
}

/// One radar's looks at one site.
pub struct RadarDrive<'a> {
    which: usize,
    settings: &'a Settings,
    estimator: RangeDopplerLane,
    bus: Bus,
    /// Whether the map of a frame is kept for a picture.
    pictured: &'a dyn Fn(u32) -> bool,
    pub made: Vec<RadarLook>,
}

impl<'a> RadarDrive<'a> {
    pub fn new(
        drive: &Drive<'_>,
        which: usize,
        settings: &'a Settings,
        equal: bool,
        pictured: &'a dyn Fn(u32) -> bool,
    ) -> Result<RadarDrive<'a>> {
        let seed = drive.site.scenario.seed;
        let yaw_rate = (draws(seed.wrapping_add(0x9e37_79b9), 0x5eed), settings.bus_yaw_rate_std_deg_per_s);
        let bus = Bus::new(seed, [settings.bus_speed_std_mps, settings.bus_speed_step_mps], yaw_rate);
        let estimator = settings.estimator(drive.radar(which), equal)?;
        Ok(RadarDrive { which, settings, estimator, bus, pictured, made: Vec::new() })
    }

    /// Truth of the radar rather than of the vehicle's reference point.
    fn of_radar(&self, now: &Now<'_>, truth: &TrueLanes) -> OfRadar {
        let (drive, level) = (now.drive, now.level);
        let mounting = drive.radar(self.which).mounting.translation_m;
        let lever = mounting.truncate();
        // As a body turns, the radar's motion points another way than the vehicle.
        let motion = DVec2::new(
            level.speed_mps - level.yaw_rate_rad_per_s * lever.y,
            level.yaw_rate_rad_per_s * lever.x,
        );
        let speed = motion.length();
        let along = motion.normalize_or(DVec2::X);
        let there =
            Level { at_m: level.to_world(lever), heading_rad: level.heading_rad + along.to_angle(), ..level };
        let lane = drive.site.road.as_ref().map(|r| true_lanes(r, &there, truth.range_m));
        let place = lane.and_then(|l| Some([l.offset_m?, l.heading_rad?]));
        let markers = drive.markers(now.time_s).into_iter().filter_map(|m| {
            let d = DVec2::from_array(m) - lever;
            let range = d.extend(mounting.z).length();
            let ahead = d.dot(along) / range.max(1e-9);
            (range <= self.settings.far_m).then_some(([range, -speed * ahead], ahead < 0.0))
        });
        (place, speed, markers.collect())
    }
}

impl Looks for RadarDrive<'_> {
    type Kept = KeptLook;

    fn keep(&self, now: &Now<'_>, frame: &Frame) -> KeptLook {
        let radar = now.drive.radar(self.which);
        let picture = || map_picture(radar, frame, self.settings.far_m, now.level.speed_mps);
        let map = (self.pictured)(now.frame).then(picture).flatten();
        KeptLook { points: points_of(radar, frame), map }
    }

    fn look(&mut self, now: &Now<'_>, seen: KeptLook) -> Result<()> {
        let [speed, yaw_rate] = self.bus.read(&now.level);
        let yaw_rate = Measured { std: yaw_rate.std.max(1e-6), ..yaw_rate };
        let look = look_of(now.time_s, [speed, yaw_rate]);
        let speed_mps = look.speed_mps.filter(|_| self.settings.bus_speed);
        let look = SensorInput { speed_mps, points: &seen.points, ..look };
        let (look, seconds) = timed(|| self.estimator.look(&look));
        let mut truth = now.drive.truth_of_rows(now.time_s, [self.settings.near_m, self.settings.far_m]);
        // What lies behind is not to be found by a radar that looks ahead.
        truth.lines.iter_mut().for_each(|line| line.retain(|p| p[0] > 0.0));
        let (radar, speed_mps, markers) = self.of_radar(now, &truth);
        let step = Step::new(now.run, now.frame, (look.estimate.clone(), seconds), truth);
        self.made.push(RadarLook { step, look, radar, speed_mps, markers, seen, case: None });
        Ok(())
    }
}

/// Points with range and range rate, with or without an angle.
pub fn points_of(radar: &Radar, frame: &Frame) -> Vec<LanePoint> {
    let finite = |v: f64, or: f64| if v.is_finite() { v } else { or };
    let point = |p: &Point| {
        let at = radar.mounting.point(p.position_m);
        let from = at - radar.mounting.translation_m;
        let across = p.std.azimuth_rad.map_or(UNKNOWN_STD, |s| finite(s * p.range_m, UNKNOWN_STD));
        LanePoint {
            at_m: [finite(at.x, 0.0), finite(at.y, 0.0)],
            std_m: [finite(p.std.range_m, UNKNOWN_STD), across],
            range_rate_mps: p.range_rate_mps,
            range_rate_std_mps: finite(p.std.range_rate_mps, UNKNOWN_STD),
            range_m: p.range_m,
            azimuth_rad: from.y.atan2(from.x),
            rcs_dbsm: finite(p.rcs_dbsm, -300.0),
            snr_db: finite(p.snr_db, 200.0),
            power_dbm: None,
        }
    };
    let is_number = |p: &&Point| p.range_m.is_finite() && p.range_rate_mps.is_finite();
    frame.points.iter().filter(is_number).map(point).collect()
}

/// The part of the map that closing markers within `far_m` fill; None where the map is empty.
pub fn map_picture(radar: &Radar, frame: &Frame, far_m: f64, speed_mps: f64) -> Option<MapPicture> {
    const MOST: usize = 360;
    let map = &frame.maps.first()?.map;
    let (rows, columns) = (map.doppler_bins, map.range_bins);
    let last =
        (((far_m - radar.first_range_m()) / radar.range_bin_m()).ceil().max(1.0) as usize).min(columns);
    let rate = |row: usize| range_rate_mps(radar, row as f64);
    let wanted = (-1.15 * speed_mps.abs() - 0.5)..=0.5;
    let first = (0..rows).find(|r| wanted.contains(&rate(*r)))?;
    let end = (first..rows).take_while(|r| wanted.contains(&rate(*r))).count() + first;
    if end - first < 2 || last < 2 {
        return None;
    }
    let (by_row, by_column) = ((end - first).div_ceil(MOST), last.div_ceil(MOST));
    let (tall, wide) = ((end - first).div_ceil(by_row), last.div_ceil(by_column));
    let mut dbm = Vec::with_capacity(tall * wide);
    for i in 0..tall {
        for j in 0..wide {
            let mut most = 0.0f64;
            for r in (first + i * by_row)..(first + (i + 1) * by_row).min(end) {
                for c in (j * by_column)..((j + 1) * by_column).min(last) {
                    most = most.max(map.data[r * columns + c]);
                }
            }
            dbm.push((10.0 * (most.max(1e-30) * 1e3).log10()) as f32);
        }
    }
    let (bin, step) = (radar.range_bin_m(), radar.velocity_bin_mps());
    let from = radar.first_range_m() - 0.5 * bin;
    let low = rate(first) - 0.5 * step;
    Some(MapPicture {
        range_m: [from, from + bin * (wide * by_column) as f64],
        range_rate_mps: [low, low + step * (tall * by_row) as f64],
        rows: tall,
        columns: wide,
        dbm,
    })
}

/// Errors of the radar's offset (m) and heading (rad). Of a lane whose sign is unknown, the nearer of the two
/// readings counts.
pub fn errors(m: &RadarLook) -> Option<[f64; 2]> {
    let (lane, [offset, heading]) = (m.look.lane.as_ref()?, m.radar?);
    let of = |sign: f64| [sign * lane.offset_m.value - offset, sign * lane.heading_rad.value - heading];
    let (same, other) = (of(1.0), of(-1.0));
    let size =
        |e: [f64; 2]| (e[0] / lane.offset_m.std.max(1e-6)).hypot(e[1] / lane.heading_rad.std.max(1e-6));
    Some(if m.look.estimate.mirror && size(other) < size(same) { other } else { same })
}
