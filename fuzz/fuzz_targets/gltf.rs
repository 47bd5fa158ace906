//! glTF and GLB as bytes, without files beside them; what is read is written and read again.
#![no_main]
mod check;

use catseye::scene::gltf::{ImportOptions, import_bytes, to_glb};
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let import = |bytes: &[u8]| import_bytes(bytes, Path::new("fuzz.glb"), None, &ImportOptions::default());
    let Some(scene) = check::read(import(bytes)) else { return };
    if scene.triangle_count() < 10_000 {
        if let Ok(again) = to_glb(&scene) {
            let read = import(&again).expect("what is written can be read");
            assert_eq!(read.triangle_count(), scene.triangle_count());
        }
    }
});
