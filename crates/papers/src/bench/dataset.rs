//! W10, W11 and W14: many frames of drawn scenes written to shards, as `catseye dataset` does.

use super::agreement::{self, Limits};
use super::frame::Frame;
use super::scratch::Scratch;
use super::sheet::{Outcome, Settings, Sheet};
use catseye::base::error::{Error, Result};
use catseye::engine::Engine;
use catseye::scene::scenario::template;
use catseye_io::dataset;
use catseye_io::produce::{Options, produce};
use catseye_io::recipe::Recipe;
use std::sync::atomic::AtomicBool;

const SMALL_ROAD: &str = include_str!("../../../../scenes/recipes/small_road.toml");
const SMALL_RADAR: (&str, &str) =
    ("small_radar.toml", include_str!("../../../../scenes/recipes/small_radar.toml"));
const POINTS: &str = include_str!("../../../../scenes/recipes/points.toml");
const POINTS_RADAR: (&str, &str) =
    ("points_radar.toml", include_str!("../../../../scenes/recipes/points_radar.toml"));
/// Name of a recipe in its temporary folder.
const RECIPE: &str = "recipe.toml";

/// Number of scenes that are drawn, and of frames of each.
struct Size {
    scenes: u32,
    frames_per_scene: u32,
}

/// Replaces these numbers in the text of a recipe, and stores frames as folders, which every build can write.
///
/// # Errors
/// Returns an error if the recipe does not have these keys at the beginning of a line.
fn resized(text: &str, size: &Size) -> Result<String> {
    let mut missing = vec!["scenes", "frames_per_scene", "[store]"];
    let mut out = String::new();
    for line in text.lines() {
        let key = line.split('=').next().unwrap_or("").trim();
        missing.retain(|k| *k != key);
        match key {
            "scenes" => out += &format!("scenes = {}", size.scenes),
            "frames_per_scene" => out += &format!("frames_per_scene = {}", size.frames_per_scene),
            "[store]" => out += "[store]\nformat = \"frames\"",
            "format" => continue,
            _ => out += line,
        }
        out.push('\n');
    }
    match missing.first() {
        Some(key) => Err(Error::Failed(format!("the recipe of the workload has no line of {key}"))),
        None => Ok(out),
    }
}

fn run(
    text: &str,
    size: &Size,
    engine: &Engine,
    settings: &Settings,
    mut sheet: Sheet<'_>,
) -> Result<Outcome> {
    let workload = sheet.outcome.workload.to_lowercase();
    let scratch = Scratch::with(&workload, &[(RECIPE, &resized(text, size)?), SMALL_RADAR, POINTS_RADAR])?;
    let recipe = Recipe::load(&scratch.path().join(RECIPE), Some(settings.seed))?;
    let cancel = AtomicBool::new(false);
    let mut runs = 0;
    let report = sheet.stage("produced", || {
        // A complete folder would be found and kept.
        runs += 1;
        let options = Options {
            jobs: None,
            batch: None,
            shards: None,
            mixed_devices: false,
            force: false,
            cancel: &cancel,
            progress: &|_| (),
            pictures: &|_, _, _, _, _| Ok(()),
            say: &|_| (),
            rule: None,
        };
        produce(engine, &recipe, &scratch.path().join(format!("data-{runs}")), &options)
    })?;
    let frames = report.frames_made;
    sheet.count("scenes", recipe.scenes);
    sheet.count("frames", frames);
    sheet.count("echoes", report.tally.echoes);
    sheet.count("points", report.tally.points);
    sheet.count("bytes_a_frame", report.bytes / frames.max(1));
    sheet.accuracy("frames_a_second", frames as f64 / sheet.outcome.total_seconds);
    if let Some(core_s) = sheet.outcome.core_seconds {
        sheet.accuracy("core_seconds_a_frame", core_s / frames as f64);
    }
    sheet.accuracy("complete", report.complete);
    let usage = &report.usage;
    sheet.count("workers", usage.workers);
    if let Some(share) = usage.processor_utilisation {
        sheet.accuracy("processor_utilisation", share);
    }
    if let Some(share) = usage.device_utilisation {
        sheet.accuracy("device_utilisation", share);
    }
    sheet.note(format!("limited by {}", usage.limited_by));
    let site = dataset::drawn_scene(&recipe, 0)?;
    let frame = Frame::of(&site.scenario, std::sync::Arc::unwrap_or_clone(site.scene))?;
    let geometry = frame.geometry(&*frame.refined(frame.options.accuracy_db)?)?;
    let echoes = frame.echoes(engine, &geometry, &frame.options, frame.budget)?;
    drop(geometry);
    agreement::compare(&frame, &echoes, &Limits { loops: 64 }, engine, &mut sheet)?;
    sheet.note("frames are written as folders and checksummed; the frame that gives the layout and those of the previews, whose \
         pictures are left out, are part of the time; the comparison is that of frame 0 of scene 0");
    Ok(sheet.finish())
}

pub(super) fn w10(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    let scenes = if settings.quick { 8 } else { 128 };
    run(SMALL_ROAD, &Size { scenes, frames_per_scene: 8 }, engine, settings, sheet)
}

pub(super) fn w11(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    let scenes = if settings.quick { 2 } else { 10 };
    run(template("recipe")?, &Size { scenes, frames_per_scene: 4 }, engine, settings, sheet)
}

pub(super) fn w14(engine: &Engine, settings: &Settings, sheet: Sheet<'_>) -> Result<Outcome> {
    let scenes = if settings.quick { 10 } else { 100 };
    run(POINTS, &Size { scenes, frames_per_scene: 10 }, engine, settings, sheet)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recipes_are_resized_and_nothing_else_is_changed() {
        for text in [SMALL_ROAD, POINTS, template("recipe").unwrap()] {
            let size = Size { scenes: 3, frames_per_scene: 2 };
            let scratch = Scratch::with(
                "resized",
                &[(RECIPE, &resized(text, &size).unwrap()), SMALL_RADAR, POINTS_RADAR],
            )
            .unwrap();
            let recipe = Recipe::load(&scratch.path().join(RECIPE), Some(1)).unwrap();
            assert_eq!((recipe.scenes, recipe.frames_per_scene, recipe.seed), (3, 2, 1));
            assert_eq!(recipe.format, catseye_io::store::Format::Frames);
            assert!(dataset::drawn_scene(&recipe, 0).is_ok());
        }
        assert!(resized("scenes = 3\n", &Size { scenes: 1, frames_per_scene: 1 }).is_err());
    }
}
