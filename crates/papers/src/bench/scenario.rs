//! Frames of roads, terrain and streets: W7, W8, W9, W12, W13.

use super::agreement::Limits;
use super::frame::Frame;
use super::scratch::Scratch;
use super::sheet::{Outcome, Settings, Sheet};
use super::stages;
use catseye::base::error::Result;
use catseye::base::frames::Pose;
use catseye::engine::Engine;
use catseye::road::site::Site;
use catseye::road::terrain::W8_QUADS;
use catseye::road::w3::RADAR_HEIGHT_M;
use catseye::road::{scene_toml, w8};
use catseye::scene::material;
use catseye::scene::radar::{Antenna, Radar};
use catseye::scene::scenario::{self, Scenario};
use catseye_io::dataset;
use catseye_io::recipe::Recipe;
use glam::{DQuat, DVec3};
use std::path::Path;

/// The road of W7 and W12.
const EVERYTHING: &str = include_str!("../../../../scenes/road/road_everything.toml");
/// The ego vehicle of W7 and W12; their road is the text above, not a file.
const ON_EVERYTHING: &str = "name = \"W7\"\nradar = \"front77\"\nscene = { road = \"road.toml\" }\n\
    ego = { speed_mps = 20, on_road = { lane = 1, s_m = 10 } }\n";
/// The radar of W8 stands where that of W3 does.
const ON_TERRAIN: &str = "name = \"W8\"\nradar = \"front77\"\nego = { speed_mps = 10 }\n";
/// The radar of W9 is 3.6 m ahead of the ego's rear axle, so at s = 5.6 m.
const IN_STREET: &str = "name = \"W9\"\nradar = \"front77\"\nscene = { road = \"road.toml\" }\n\
    ego = { speed_mps = 10, on_road = { lane = 1, s_m = 2 } }\ntrace = { accuracy_db = 0.2 }\n";
/// A street with pavements, kerbs and three cars, 10, 25 and 40 m ahead of the radar.
const STREET: &str = r#"
name = "street"
[[road]]
name = "street"
plan = [{ kind = "straight", length_m = 80 }]
centre_line = "dashed"
left = [{ width_m = 3.25, line = "solid" }, { kind = "sidewalk", width_m = 2, surface = "concrete" }]
right = [{ width_m = 3.25, line = "solid" }, { kind = "sidewalk", width_m = 2, surface = "concrete" }]
verge = [{ side = "left", width_m = 8 }, { side = "right", width_m = 8 }]
vehicle = [
    { kind = "sedan", s_m = 15.6, lateral = { lane = 11 }, speed_mps = 10 },
    { kind = "hatchback", s_m = 30.6, lateral = { lane = 1 }, speed_mps = 12 },
    { kind = "suv", s_m = 45.6, lateral = { lane = 11 }, speed_mps = 8 },
]
"#;
/// Chirps of W12 in a quick run, in place of 256.
const QUICK_CHIRPS: usize = 32;
/// Files of W13's recipe, which names the radar.
const AWR1843: [(&str, &str); 2] = [
    ("recipe.toml", include_str!("../../../../scenes/recipes/awr1843_street.toml")),
    ("awr1843_radar.toml", include_str!("../../../../scenes/recipes/awr1843_radar.toml")),
];

/// Parses a scenario whose road is not on the disk.
fn on_road(text: &str) -> Result<Scenario> {
    scenario::parse_with_road(Path::new("scenario.toml"), text, Some("road.toml"))
}

fn frame_on(scenario: &Scenario, road: &str) -> Result<Frame> {
    let site = Site::on(scenario, scene_toml::parse(Path::new("road.toml"), road)?)?;
    Frame::of(&site.scenario, site.scene)
}

pub(super) fn everything() -> Result<Frame> {
    frame_on(&on_road(ON_EVERYTHING)?, EVERYTHING)
}

/// Makes a filled row of 192 virtual elements half a wavelength apart: 16 receivers, and 12 transmitters
/// spaced by the length of that row of receivers.
fn imaging(radar: &mut Radar) {
    let half_m = 0.5 * radar.wavelength_m();
    let row = |n: usize, step: f64| (0..n).map(move |i| (i as f64 - 0.5 * (n - 1) as f64) * step * half_m);
    let put = |antenna: &Antenna, y_m: f64| Antenna { position_m: DVec3::Y * y_m, ..antenna.clone() };
    radar.tx = row(12, 16.0).map(|y_m| put(&radar.tx[0], y_m)).collect();
    radar.rx = row(16, 1.0).map(|y_m| put(&radar.rx[0], y_m)).collect();
    radar.processing.azimuth_bins = 512;
}

pub(super) fn imaging_frame(quick: bool) -> Result<Frame> {
    let mut scenario = on_road(ON_EVERYTHING)?;
    let radar = &mut scenario.radars[0];
    imaging(radar);
    if quick {
        (radar.chirps, radar.processing.doppler_fft) = (QUICK_CHIRPS, QUICK_CHIRPS);
    }
    frame_on(&scenario, EVERYTHING)
}

/// The frame of W8 with its terrain cut into 2 x `quads`² triangles.
pub(super) fn terrain(quads: u32) -> Result<Frame> {
    let mut scenario = scenario::parse(Path::new("scenario.toml"), ON_TERRAIN)?.without_roads()?;
    scenario.radars[0].mounting = Pose::new(DQuat::IDENTITY, DVec3::new(0.0, 0.0, RADAR_HEIGHT_M));
    Frame::of(&scenario, w8::w8_cut(quads, &material::by_name)?)
}

pub(super) fn street() -> Result<Frame> {
    frame_on(&on_road(IN_STREET)?, STREET)
}

/// The frame of scene 0 of the recipe for a radar like an AWR1843 board.
pub(super) fn awr1843() -> Result<Frame> {
    let scratch = Scratch::with("w13", &AWR1843)?;
    let recipe = Recipe::load(&scratch.path().join(AWR1843[0].0), None)?;
    let site = dataset::drawn_scene(&recipe, 0)?;
    Frame::of(&site.scenario, std::sync::Arc::unwrap_or_clone(site.scene))
}

pub(super) fn w7(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    stages::run(&everything()?, &Limits { loops: 64 }, engine, settings, sheet)
}

pub(super) fn w8(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    stages::run(&terrain(W8_QUADS)?, &Limits { loops: 16 }, engine, settings, sheet)
}

pub(super) fn w9(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    stages::run(&street()?, &Limits { loops: 64 }, engine, settings, sheet)
}

pub(super) fn w12(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    stages::run(&imaging_frame(settings.quick)?, &Limits { loops: 16 }, engine, settings, sheet)
}

pub(super) fn w13(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    stages::run(&awr1843()?, &Limits { loops: 64 }, engine, settings, sheet)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ego_of_w7_drives_on_its_road() {
        let frame = everything().unwrap();
        assert!((frame.ego_mps.length() - 20.0).abs() < 0.5, "{}", frame.ego_mps);
        assert!(frame.scene.objects.len() > 90);
        assert_eq!(frame.radar.virtual_channels(), 12);
        assert!(frame.reach_s > 0.0);
    }

    #[test]
    fn w12_is_w7_with_a_filled_row_of_192() {
        let (few, many) = (everything().unwrap(), imaging_frame(false).unwrap());
        assert_eq!(few.scene, many.scene);
        assert_eq!([many.radar.tx.len(), many.radar.rx.len()], [12, 16]);
        assert_eq!([many.radar.chirps, many.radar.samples], [256, 512]);
        let half_m = 0.5 * many.radar.wavelength_m();
        let mut row: Vec<f64> = many
            .radar
            .tx
            .iter()
            .flat_map(|t| many.radar.rx.iter().map(move |r| t.position_m.y + r.position_m.y))
            .collect();
        row.sort_by(f64::total_cmp);
        assert!(row.windows(2).all(|w| (w[1] - w[0] - half_m).abs() < 1e-9));
    }

    #[test]
    fn cars_of_w9_stand_where_they_are_said_to() {
        let frame = street().unwrap();
        assert!((frame.pose.translation_m.x - 5.6).abs() < 1e-6, "{}", frame.pose.translation_m);
        let boxes = catseye::road::truth_boxes(&frame.scene, 0.0);
        let mut cars: Vec<f64> =
            boxes.iter().filter(|b| b.class == "car").map(|b| b.centre_m[0] - 5.6).collect();
        cars.sort_by(f64::total_cmp);
        assert_eq!(cars.len(), 3);
        assert!(cars.iter().zip([10.0, 25.0, 40.0]).all(|(x, want)| (x - want).abs() < 0.3), "{cars:?}");
        assert_eq!(frame.options.accuracy_db, 0.2);
    }

    #[test]
    fn w8_has_the_terrain_and_the_radar_of_w3() {
        let frame = terrain(W8_QUADS).unwrap();
        assert_eq!(frame.pose.translation_m, DVec3::new(0.0, 0.0, RADAR_HEIGHT_M));
        assert_eq!(frame.ego_mps, DVec3::X * 10.0);
        assert_eq!(frame.scene.triangle_count(), 180_660);
    }

    #[test]
    fn w13_is_a_street_with_all_kinds_of_users() {
        let frame = awr1843().unwrap();
        for class in ["car", "pedestrian", "cyclist", "guard_rail"] {
            assert!(frame.scene.objects.iter().any(|o| o.class == class), "no {class}");
        }
        assert_eq!([frame.radar.tx.len(), frame.radar.rx.len()], [3, 4]);
        assert_eq!([frame.radar.chirps, frame.radar.samples], [128, 256]);
        assert!((frame.radar.range_bin_m() - 0.3).abs() < 0.01, "{}", frame.radar.range_bin_m());
        assert!(matches!(frame.budget, catseye::adc::budget::Budget::Sum(_)));
    }
}
