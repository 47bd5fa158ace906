//! The TOML files: the first byte says which kind follows.
#![no_main]
mod check;

use catseye::road::scene_toml;
use catseye::scene::{radar_toml, scenario};
use catseye_io::recipe::Recipe;
use catseye_papers::study::file as study;
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, text)) = bytes.split_first() else { return };
    let Ok(text) = std::str::from_utf8(text) else { return };
    let file = Path::new("fuzz/fuzz.toml");
    match kind % 5 {
        0 => drop(check::read(scenario::parse(file, text))),
        1 => drop(check::read(radar_toml::parse(file, text))),
        2 => drop(check::read(scene_toml::parse(file, text))),
        3 => drop(check::read(study::parse(file, text, true))),
        _ => {
            let Some(recipe) = check::read(Recipe::parse(file, text, None)) else { return };
            check::read(recipe.draw(0));
        }
    }
});
