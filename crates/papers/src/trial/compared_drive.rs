//! One drive with all methods. Each radar's frame is simulated once, and its output and that of the vehicle's
//! other sensors go to every method that uses them.

use crate::trial::drive::own_alone;
use crate::trial::edges::Edges;
use crate::trial::ready::{Finds, SPEED_STD_MPS};
use crate::trial::sensors::{Bus, KeptPoint, TrackFollower, kept_points, lane_points};
use crate::trial::stats::{draws, timed};
use crate::trial::{Drive, LaneTable, Method, OwnedInput, ReadyMethod, Step, TrialContext};
use catseye::base::error::{BadInput, Error, Result};
use catseye::engine::Engine;
use catseye::road::site::Site;
use catseye::scene::scenario::Scenario;
use catseye::simulate::Frame;
use catseye_lane::LaneTrack;
use catseye_lane::score::TrueLanes;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Standard deviation of the yaw rate on the vehicle bus, degrees/s.
const YAW_RATE_STD_DEG_PER_S: f64 = 0.2;

/// A method in the variant that a comparison runs.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct MethodVariant {
    /// The method.
    pub method: Method,
    /// Sensors and light of a method with several variants; otherwise empty.
    pub variant: String,
}

impl MethodVariant {
    /// Name of the variant in tables.
    pub fn name(&self) -> String {
        match self.variant.as_str() {
            "" => self.method.name().into(),
            variant => format!("{} ({variant})", self.method.name()),
        }
    }

    /// Name of its folder.
    pub fn file_name(&self) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
        match self.variant.as_str() {
            "" => self.method.name().into(),
            variant => {
                format!("{}_{}", self.method.name(), variant.replace(", ", "_")).chars().map(plain).collect()
            }
        }
    }
}

/// A method on one drive.
pub struct Driven {
    /// The variant.
    pub variant: MethodVariant,
    /// The method, ready to run.
    pub method: ReadyMethod,
    /// Its inputs, if they are kept.
    pub looks: Vec<OwnedInput>,
    /// Its results, one step for each look.
    pub steps: Vec<Step>,
}

/// Results of all methods on a drive.
#[derive(Default)]
pub struct ComparedDrive {
    /// The methods that ran.
    pub driven: Vec<Driven>,
    /// The methods that cannot use the scenario, with the reasons.
    pub cannot: Vec<(MethodVariant, String)>,
}

impl ComparedDrive {
    fn ready(
        given: &TrialContext<'_>,
        table: &LaneTable,
        drive: &Drive<'_>,
        run: u32,
    ) -> Result<ComparedDrive> {
        let mut out = ComparedDrive::default();
        for method in Method::ALL.into_iter().filter(|m| m.is_built()) {
            let named = |variant: String| MethodVariant { method, variant };
            match table.method(method).ready(given, drive, run) {
                Ok(found) => out.driven.extend(found.into_iter().map(|(variant, method)| {
                    let variant = named(variant);
                    Driven { variant, method, looks: Vec::new(), steps: Vec::new() }
                })),
                // What a scenario lacks for a method is a result; what is wrong with a file or a device is not.
                Err(Error::Input(why)) => {
                    // The table names the scenario itself.
                    let why = BadInput { file: why.file.filter(|f| f != given.path), ..*why };
                    out.cannot.push((named(String::new()), why.to_string()));
                }
                Err(e) => return Err(e),
            }
        }
        out.driven.sort_by(|a, b| a.variant.cmp(&b.variant));
        Ok(out)
    }
}

/// The first drive of a scenario file: every method that can use it, with its inputs.
///
/// # Errors
/// Returns the errors of the file and of the frames.
pub fn driven(engine: &Engine, path: &Path, frames: u32) -> Result<Vec<Driven>> {
    let table = LaneTable::load(path)?;
    let mut scenario = Scenario::load(path)?;
    scenario.frames.count = frames;
    let given = TrialContext { scenario: &scenario, path, engine, runs: 1, keep: None, watch: &|_, _| {} };
    Ok(drive_once(&given, &table, 0, true, &mut |_| {})?.driven)
}

/// Output of one radar at one look.
struct RadarLook {
    frame: Frame,
    points: Vec<KeptPoint>,
    tracks: Vec<LaneTrack>,
}

/// Runs one drive with all methods, `with_looks` or without. `told` is given the number of finished frames: 0 once the methods are
/// prepared, which may take a drive of its own, and then each count.
///
/// # Errors
/// Returns the errors of the site and of the frames.
pub fn drive_once(
    given: &TrialContext<'_>,
    table: &LaneTable,
    run: u32,
    with_looks: bool,
    told: &mut dyn FnMut(u32),
) -> Result<ComparedDrive> {
    let site = Site::new(&given.scenario_of(run))?;
    let drive = Drive::new(&site, given.engine)?;
    let mut out = ComparedDrive::ready(given, table, &drive, run)?;
    let scenario = &site.scenario;
    let edges = Edges::of(&site.scene, site.road.as_ref());
    let yaw_rate = (draws(scenario.seed, 0x6759_726f), YAW_RATE_STD_DEG_PER_S);
    let mut bus = Bus::new(scenario.seed, [SPEED_STD_MPS, 0.0], yaw_rate);
    // For each radar that a method uses, the follower of its tracks if a method uses these.
    let mut radars: BTreeMap<usize, Option<TrackFollower>> = BTreeMap::new();
    for method in out.driven.iter().map(|d| &d.method) {
        let Some(which) = method.radar else { continue };
        let follower = radars.entry(which).or_default();
        if method.tracks && follower.is_none() {
            *follower = Some(TrackFollower::new()?);
        }
    }
    told(0);
    for index in 0..drive.frames() {
        let time_s = drive.time_s(index);
        let level = drive.level(time_s);
        let read = bus.read(&level);
        let [speed_mps, yaw_rate_rad_per_s] = read.map(Some);
        let base = OwnedInput { time_s, speed_mps, yaw_rate_rad_per_s, ..OwnedInput::default() };
        let mut seen: BTreeMap<usize, RadarLook> = BTreeMap::new();
        for (which, follower) in &mut radars {
            let frame = drive.frame(*which, index)?;
            let points = kept_points(&frame);
            let tracks = match follower {
                Some(f) => f.step(scenario, drive.radar(*which), index, &points, read)?,
                None => Vec::new(),
            };
            seen.insert(*which, RadarLook { frame, points, tracks });
        }
        let truth = own_lines(&drive, &edges, time_s);
        let bounds = TrueLanes { also: truth.also.clone(), ..edges.truth(&level, RANGE_M) };
        let region = region_edges(&drive, &truth, time_s);
        for Driven { method, looks, steps, .. } in &mut out.driven {
            let mut look = base.clone();
            let radar = method.radar.and_then(|which| seen.get(&which));
            if let Some(RadarLook { frame, points, tracks }) = radar {
                if method.points {
                    look.points = lane_points(drive.radar(frame.radar), points);
                }
                if method.tracks {
                    look.tracks.clone_from(tracks);
                }
            }
            if let Some(sense) = &mut method.sense {
                sense(&drive, radar.map(|r| &r.frame), index, &mut look)?;
            }
            let estimate = timed(|| method.estimator.estimate(&look.input()));
            let truth = match method.finds {
                Finds::OwnLines => &truth,
                Finds::RoadEdges => &bounds,
                Finds::LaneRegion => &region,
            };
            steps.push(Step::new(run, index, estimate, truth.clone()));
            if with_looks {
                looks.push(look);
            }
        }
        told(index + 1);
    }
    Ok(out)
}

/// Least and largest distance at which lines are compared, m.
const RANGE_M: [f64; 2] = [5.0, 40.0];

/// The outer edges of the lanes, with all other true lines of the road in `also` as `own` has them.
fn region_edges(drive: &Drive<'_>, own: &TrueLanes, time_s: f64) -> TrueLanes {
    let mut region = drive.truth_of_region(time_s, RANGE_M);
    region.lines.iter_mut().for_each(|line| line.retain(|p| p[0] > 0.0));
    region.also.clone_from(&own.also);
    region
}

/// The lines of the vehicle's own lane, with all other true lines of the road in `also`.
fn own_lines(drive: &Drive<'_>, edges: &Edges, time_s: f64) -> TrueLanes {
    let all = drive.truth(time_s, RANGE_M);
    let mut own = own_alone(&all);
    // Radars and cameras look ahead: what lies behind is not to be found.
    own.lines.iter_mut().for_each(|line| line.retain(|p| p[0] > 0.0));
    own.also = all.lines;
    own.also.extend(drive.rows(time_s).into_iter().map(|r| r.1));
    let near = edges.near(&drive.level(time_s), RANGE_M[1] + 20.0);
    own.also.extend(near.sides.into_iter().flatten());
    own
}
