//! Frames from echoes that were traced before: another front end, array, waveform or seed listens to the same waves.

use crate::base::convention::Convention;
use crate::base::error::{BadInput, Error, Result};
use crate::base::frames::{Pose, Sensor, World};
use crate::base::units::wavenumber;
use crate::engine::{self, reach};
use crate::formats::stage::sha256_of_bytes;
use crate::scene::Scene;
use crate::scene::scenario::SitedScenario;
use crate::trace::windows::lit_sides;
use crate::trace::{Echoes, TraceOptions, merge};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Echoes of a frame as they were traced, before any was left out, with what they follow from.
#[derive(Debug, Clone, PartialEq)]
pub struct KeptTrace {
    /// What they follow from.
    pub origin: TraceOrigin,
    /// Number of triangles that were traced.
    pub triangles: usize,
    /// The echoes.
    pub echoes: Echoes,
    /// File or folder that they were read from, for complaints; None for those of this run.
    pub file: Option<PathBuf>,
}

/// Function that gives the kept trace of radar number `which` in frame `index`.
pub type Recall<'a> = Box<dyn Fn(usize, u32) -> Result<KeptTrace> + Send + Sync + 'a>;

/// All that the echoes of a frame follow from. Echoes serve another radar where it asks for no more than this.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TraceOrigin {
    /// SHA-256 of the scene with its motions and materials.
    pub scene_sha256: String,
    /// SHA-256 of the vehicle's drive, and of the radar's motion on it.
    pub drive_sha256: String,
    /// SHA-256 of the weather.
    pub weather_sha256: String,
    /// SHA-256 of the radar, for which the powers of the echoes were reckoned.
    pub radar_sha256: String,
    /// Middle of the frame, from the middle of frame 0, s.
    pub time_s: f64,
    /// Place of the radar in the world, m.
    pub position_m: [f64; 3],
    /// Rotation from its axes to the world's, a quaternion x, y, z, w.
    pub rotation: [f64; 4],
    /// Duration of the frame, s: the paths are right at its start, middle and end.
    pub frame_s: f64,
    /// Frequency at which surfaces reflect and edges scatter, Hz.
    pub carrier_hz: f64,
    /// Lowest and highest frequency of the ramps, Hz.
    pub band_hz: [f64; 2],
    /// Which of six sides the transmit antennas light: ahead, left, right, behind, up, down.
    pub sides: [bool; 6],
    /// Distance beyond which nothing was traced, m; None where everything was.
    pub reach_m: Option<f64>,
    /// Bound on the rate of any path's length, m/s, from which such a distance follows.
    pub path_rate_mps: f64,
    /// What was followed and kept.
    pub settings: TraceSettings,
}

/// Settings of a trace that decide which echoes there are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TraceSettings {
    /// Bounces that were asked for.
    pub bounces: usize,
    /// Bounces up to which the trace might go by itself.
    pub most_bounces: usize,
    /// Which bounces of a chain radiate.
    pub convention: Convention,
    /// Error allowed in coherent sums, dB.
    pub accuracy_db: f64,
    /// Number of samples of rough surfaces.
    pub rays: u64,
    /// Seed of the scatterers on rough surfaces and of rain.
    pub seed: u64,
    /// Largest number of facets of a curved surface.
    pub facets: u64,
    /// Strength below which echoes are not kept, 1/m.
    pub least: f64,
    /// Whether echoes of one place were added up.
    pub merge: bool,
    /// Whether the places of all bounces are kept.
    pub places: bool,
}

/// Which frame is meant: of which radar, its number, and where the radar then is.
#[derive(Clone, Copy)]
pub(super) struct Of<'a> {
    pub(super) which: usize,
    pub(super) index: u32,
    pub(super) pose: &'a Pose<Sensor, World>,
}

/// Digests of what the frames of a scenario share; made once, since a scene may be large.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Digests {
    scene: String,
    drives: Vec<String>,
    radars: Vec<String>,
    weather: String,
}

impl Digests {
    pub(super) fn of(scenario: &SitedScenario, scene: &Scene) -> Digests {
        let digest = |text: String| sha256_of_bytes(text.as_bytes());
        let Scene { meshes, materials, tables, objects, .. } = scene;
        Digests {
            scene: digest(format!("{meshes:?} {materials:?} {tables:?} {objects:?}")),
            drives: scenario
                .radars
                .iter()
                .map(|r| digest(format!("{:?} {:?}", scenario.ego, r.motion)))
                .collect(),
            radars: scenario.radars.iter().map(|r| digest(format!("{r:?}"))).collect(),
            weather: digest(format!("{:?}", scenario.weather)),
        }
    }
}

impl TraceOrigin {
    /// What the trace follows from of a frame that asks with these options, with no path whose length changes faster than `path_rate_mps`.
    pub(super) fn new(
        scenario: &SitedScenario,
        digests: &Digests,
        of: Of<'_>,
        options: &TraceOptions,
        path_rate_mps: f64,
    ) -> TraceOrigin {
        let Of { which, index, pose } = of;
        let (radar, time_s) = (&scenario.radars[which], scenario.frames.time_s(index));
        let reach_m = options.reach_m.min(reach::reach_m(radar, path_rate_mps));
        let half_band_hz = 0.5 * options.bandwidth_hz;
        TraceOrigin {
            scene_sha256: digests.scene.clone(),
            drive_sha256: digests.drives[which].clone(),
            weather_sha256: digests.weather.clone(),
            radar_sha256: digests.radars[which].clone(),
            time_s,
            position_m: pose.translation_m.to_array(),
            rotation: pose.rotation.to_array(),
            frame_s: radar.frame_time_s(),
            carrier_hz: radar.carrier_hz,
            band_hz: [radar.carrier_hz - half_band_hz, radar.carrier_hz + half_band_hz],
            sides: lit_sides(radar),
            reach_m: reach_m.is_finite().then_some(reach_m),
            path_rate_mps,
            settings: TraceSettings {
                bounces: options.bounces,
                most_bounces: options.most_bounces,
                convention: options.convention,
                accuracy_db: options.accuracy_db,
                rays: options.rays,
                seed: options.seed,
                facets: scenario.trace.facets,
                least: options.least,
                merge: options.merge,
                places: options.places,
            },
        }
    }

    /// Refuses to serve a frame that needs more than this holds, with the reason.
    fn serve(&self, asked: &TraceOrigin, followed: usize) -> Result<()> {
        let no = |key: &str, problem: &str| BadInput::new(problem).key(key);
        let again = "leave out --from to trace this scenario";
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-9;
        let (s, a) = (&self.settings, &asked.settings);
        for (key, kept, wanted) in [
            ("scene", &self.scene_sha256, &asked.scene_sha256),
            ("ego", &self.drive_sha256, &asked.drive_sha256),
            ("weather", &self.weather_sha256, &asked.weather_sha256),
        ] {
            if kept != wanted {
                let problem = format!("the echoes were traced with another {key}");
                return Err(no(key, &problem).remedy(again).into());
            }
        }
        if !same(self.time_s, asked.time_s) {
            return Err(no("frames.interval_s", "the echoes belong to another time")
                .value(format!("{} s", asked.time_s))
                .allowed(format!("{} s", self.time_s))
                .remedy(again)
                .into());
        }
        let metres = self.position_m.iter().zip(asked.position_m).all(|(a, b)| same(*a, b));
        // A quaternion and its negative turn alike.
        let turn: f64 = self.rotation.iter().zip(asked.rotation).map(|(a, b)| a * b).sum();
        if !metres || (turn.abs() - 1.0).abs() > 1e-12 {
            return Err(no("mounting", "the echoes were traced from another position or orientation")
                .value(format!("{:?}", asked.position_m))
                .allowed(format!("{:?} in the world, with the same orientation", self.position_m))
                .remedy(again)
                .into());
        }
        if asked.frame_s > self.frame_s * (1.0 + 1e-12) {
            return Err(no(
                "waveform",
                "the frame is longer than the time for which the paths of the echoes are known",
            )
            .value(format!("{} s", asked.frame_s))
            .allowed(format!("up to {} s", self.frame_s))
            .remedy("transmit fewer chirps, or leave out --from")
            .into());
        }
        let [low, high] = self.band_hz;
        let slack = 1e-12 * high;
        if asked.band_hz[0] < low - slack || asked.band_hz[1] > high + slack {
            return Err(no("waveform", "the band is not within that of the echoes")
                .value(format!("{:?} Hz", asked.band_hz))
                .allowed(format!("within {:?} Hz", self.band_hz))
                .remedy(again)
                .into());
        }
        if self.sides.iter().zip(asked.sides).any(|(kept, wanted)| wanted && !kept) {
            return Err(no(
                "tx.pattern",
                "the transmit antennas illuminate sides of the radar that were not traced",
            )
            .remedy(again)
            .into());
        }
        if self.reach_m.is_some_and(|kept| asked.reach_m.is_none_or(|wanted| wanted > kept * (1.0 + 1e-12))) {
            return Err(no("waveform", "the receiver's range exceeds that of the echoes")
                .value(asked.reach_m.map_or("any distance".into(), |m| format!("{m:.1} m")))
                .allowed(format!("up to {:.1} m", self.reach_m.unwrap_or(f64::INFINITY)))
                .remedy(again)
                .into());
        }
        if a.bounces > followed {
            return Err(no("trace.bounces", "the echoes were followed over fewer bounces")
                .value(a.bounces)
                .allowed(format!("up to {followed}"))
                .remedy(again)
                .into());
        }
        // They cannot be taken out again: ways over a plane are in a trace of one bounce, and count as more.
        let most = a.bounces.max(a.most_bounces);
        if most < followed {
            return Err(no("trace.bounces", "the echoes were followed over more bounces")
                .value(most)
                .allowed(format!("{followed}, or trace.most_bounces of {followed} or more"))
                .remedy(again)
                .into());
        }
        if a.convention != s.convention {
            return Err(no("trace.convention", "the echoes follow another convention")
                .value(format!("{:?}", a.convention).to_lowercase())
                .allowed(format!("{:?}", s.convention).to_lowercase())
                .remedy(again)
                .into());
        }
        let finer = [
            ("trace.accuracy_db", a.accuracy_db < s.accuracy_db, a.accuracy_db, s.accuracy_db, "from"),
            ("trace.rays", a.rays > s.rays, a.rays as f64, s.rays as f64, "up to"),
            ("trace.facets", a.facets > s.facets, a.facets as f64, s.facets as f64, "up to"),
        ];
        if let Some((key, _, value, kept, word)) = finer.into_iter().find(|f| f.1) {
            return Err(no(key, "the echoes were traced less finely")
                .value(value)
                .allowed(format!("{word} {kept}"))
                .remedy(again)
                .into());
        }
        if a.least < s.least * (1.0 - 1e-12) {
            return Err(no("trace.floor_db", "echoes weaker than those traced are requested")
                .remedy("set trace.exact = true, or leave out trace.floor_db, in the run that traces")
                .into());
        }
        if s.merge && !a.merge {
            return Err(no("trace.exact", "echoes of the same position were summed")
                .value(true)
                .remedy(again)
                .into());
        }
        if a.places && !s.places {
            return Err(no(
                "output.return_places",
                "the echoes were traced without the positions of their bounces",
            )
            .remedy("set output.return_places = true in the run that traces")
            .into());
        }
        Ok(())
    }
}

/// The echoes of a kept trace as a frame hears them that asks with `options`.
///
/// # Errors
/// Returns `BadInput` where the trace does not serve.
pub(super) fn recalled(
    kept: KeptTrace,
    scenario: &SitedScenario,
    digests: &Digests,
    of: Of<'_>,
    options: &TraceOptions,
) -> Result<KeptTrace> {
    let KeptTrace { origin, triangles, mut echoes, file } = kept;
    let named = |e: Error| match &file {
        Some(file) => e.in_file(file),
        None => e,
    };
    let asked = TraceOrigin::new(scenario, digests, of, options, origin.path_rate_mps);
    origin.serve(&asked, echoes.bounces).map_err(named)?;
    if options.merge && !origin.settings.merge {
        echoes.merged = merge::merge(&mut echoes.list, wavenumber(origin.carrier_hz), 0.5 * origin.frame_s);
    }
    // The powers of the same radar are known, from before echoes of one place were added up.
    if origin.radar_sha256 != asked.radar_sha256 {
        engine::reckon_powers(&scenario.radars[of.which], options, &mut echoes);
        if !engine::is_deep_enough(options, &echoes) {
            let bad = BadInput::new("this radar needs one more bounce than was traced")
                .key("trace.bounces")
                .value(echoes.bounces)
                .allowed(format!("up to {} of the scenario", options.most_bounces))
                .remedy("set trace.bounces = N, trace more bounces, or leave out --from");
            return Err(named(bad.into()));
        }
    }
    Ok(KeptTrace { origin, triangles, echoes, file: None })
}
