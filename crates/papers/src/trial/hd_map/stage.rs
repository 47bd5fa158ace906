//! The scenes of a trial, the map of each, the estimator on it, and the pose of its radar.

use crate::trial::hd_map::settings::{Kind, SceneTable, Settings};
use crate::trial::kit::*;
use catseye::scene::toml_file::referred;
use catseye_lane::hd_map::estimator::{Body, MapLanes, Options};
use catseye_lane::hd_map::of_road::{self, Stripes};
use catseye_lane::hd_map::{self, Across, HdMap, RadarPose, file};

/// One scene of a trial, ready to be driven.
pub struct Stage {
    pub kind: Option<Kind>,
    pub name: String,
    pub scenario: Scenario,
    /// Plan of a road file; None for other scenes, which are driven as they are.
    pub plan: Option<ScenePlan>,
    /// The true lanes; empty where nothing is known of them.
    pub lanes: Vec<Stripes>,
    pub table: Option<SceneTable>,
}

/// Spacing of the points of the lines that give true lanes, m.
const TRUTH_STEP_M: f64 = 2.0;

pub fn stages(given: &TrialContext<'_>, settings: &Settings) -> Result<Vec<Stage>> {
    let own = || -> Result<Stage> {
        let scenario = given.scenario.clone();
        let name = scenario.name.clone();
        let stage = |plan, lanes| Stage { kind: None, name, scenario, plan, lanes, table: None };
        if let SceneSource::Road { path } = &given.scenario.scene {
            let plan = scene_toml::load(path)?;
            let lanes = plan.roads.iter().map(|r| Stripes::of_road(&r.road, TRUTH_STEP_M)).collect();
            return Ok(stage(Some(plan), lanes));
        }
        let site = Site::new(given.scenario)?;
        let labels = site.road.as_ref().map_or(&[][..], |r| &r.roads[..]);
        Ok(stage(None, labels.iter().map(|l| Stripes::of_label(l, TRUTH_STEP_M)).collect()))
    };
    if settings.scene.is_empty() {
        return Ok(vec![own()?]);
    }
    let drawn = |(i, table): (usize, &SceneTable)| -> Result<Stage> {
        let mut scenario = given.scenario.clone();
        if let Some(road) = &table.road {
            scenario.scene = SceneSource::Road { path: referred(given.path, road)? };
        }
        let SceneSource::Road { path } = &scenario.scene else {
            let bad =
                BadInput::new("vehicles can only be drawn on the roads of a road file").file(given.path);
            return Err(bad
                .key(format!("lane.hd_map.scene[{i}].road"))
                .remedy("name a road scene (TOML)")
                .into());
        };
        let mut plan = scene_toml::load(path)?;
        for road in &mut plan.roads {
            road.things.retain(|t| !matches!(t.source, catseye::road::plan::Source::Vehicle { .. }));
        }
        if let (Some(on), Some(s_m)) = (scenario.ego.on_road_mut(), table.radar_s_m) {
            on.s_m = s_m;
        }
        let lanes: Vec<Stripes> =
            plan.roads.iter().map(|r| Stripes::of_road(&r.road, TRUTH_STEP_M)).collect();
        let numbers: Vec<i32> = plan.roads.iter().flat_map(|r| r.road.lanes().map(|l| l.2.number)).collect();
        if let Some(wrong) = table.lanes.iter().find(|n| !numbers.contains(n)) {
            let all = numbers.iter().map(i32::to_string).collect::<Vec<_>>().join(", ");
            let bad = BadInput::new("is not a lane of the scene").file(given.path).value(wrong);
            return Err(bad.key(format!("lane.hd_map.scene[{i}].lanes")).allowed(all).into());
        }
        let name = table.kind.map_or_else(|| plan.name.clone(), |k| k.name().to_string());
        Ok(Stage { kind: table.kind, name, scenario, plan: Some(plan), lanes, table: Some(table.clone()) })
    };
    settings.scene.iter().enumerate().map(drawn).collect()
}

/// The map that the estimator gets.
pub fn map_of(
    given: &TrialContext<'_>,
    settings: &Settings,
    stage: &Stage,
    draws: &mut Draws,
) -> Result<HdMap> {
    if let Some(name) = &settings.map {
        return file::read(&referred(given.path, name)?);
    }
    let bad = |problem: String| -> Error {
        let remedy =
            "give lane.hd_map.map, a map file, or a scene with roads whose lanes have numbers of their own";
        BadInput::new(problem).file(given.path).key("lane.hd_map.map").remedy(remedy).into()
    };
    let anchor = settings.anchor();
    let spaced: Vec<Stripes> = match &stage.plan {
        Some(plan) => plan.roads.iter().map(|r| Stripes::of_road(&r.road, settings.map_spacing_m)).collect(),
        None => match Site::new(&stage.scenario)?.road {
            Some(road) => road.roads.iter().map(|l| Stripes::of_label(l, settings.map_spacing_m)).collect(),
            None => Vec::new(),
        },
    };
    let map = of_road::map(&spaced, &anchor, &mut || settings.map_std_m * draws.normal())
        .ok_or_else(|| bad("the origin is not a position on the earth".into()))?;
    map.check().map_err(|fault| bad(format!("no map can be made of the roads of the scene: {fault}")))?;
    Ok(map)
}

pub fn estimator(settings: &Settings, map: &HdMap, radar: &Radar, change: Change) -> Result<MapLanes> {
    let (at, radar_yaw_rad) = mount(radar);
    let across = if change == Change::RadarAxis { Across::RadarAxis } else { settings.across };
    let to_middle = settings.to_middle && change != Change::AsTracked;
    let options = Options {
        settings: hd_map::Settings { across, map_std_m: settings.map_std_m, ..hd_map::Settings::default() },
        radar_at_m: at.to_array(),
        radar_yaw_rad,
        place_std_m: settings.place_std_m,
        azimuth_std_rad: settings.azimuth_std_deg.to_radians(),
        body: to_middle.then_some(Body::CAR),
        ..Options::default()
    };
    MapLanes::new(map.clone(), options)
        .map_err(|fault| BadInput::new(fault.to_string()).key("lane.hd_map.map").into())
}

/// Change of another reading of the same tracks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    None,
    /// Divides the line perpendicular to the radar's axis into lanes.
    RadarAxis,
    /// Uses tracks where they are.
    AsTracked,
}

/// The radar's pose as it is known: with the errors of its survey. None where the world's origin is no place
/// on the earth.
pub fn place(settings: &Settings, level: &Level, radar: &Radar, survey: [f64; 3]) -> Option<RadarPose> {
    let (at, yaw_rad) = mount(radar);
    let at = level.to_world(at) + DVec2::new(survey[0], survey[1]) * settings.place_std_m;
    let heading = level.heading_rad + yaw_rad + survey[2] * settings.azimuth_std_deg.to_radians();
    RadarPose::within(&settings.anchor(), at.extend(radar.mounting.translation_m.z), heading)
}
