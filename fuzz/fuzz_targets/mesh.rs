//! OBJ (first byte even) and STL (odd); what is read is written and read again.
#![no_main]
mod check;

use catseye::scene::gltf::ImportOptions;
use catseye::scene::mesh_file;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, bytes)) = bytes.split_first() else { return };
    let name = if kind % 2 == 0 { "a.obj" } else { "a.stl" };
    let options = ImportOptions {
        unit_given: true,
        up_given: true,
        default_material: Some("pec".into()),
        ..ImportOptions::default()
    };
    let path = check::file(name, bytes);
    let Some(scene) = check::read(mesh_file::import(&path, &options)) else { return };
    if scene.triangle_count() < 10_000 {
        if let Ok(again) = mesh_file::write(&scene, &path, Some("m")) {
            let path = check::file(name, &again.bytes);
            // Triangles may lose their area where single precision rounds their corners.
            if let Some(read) = check::read(mesh_file::import(&path, &options)) {
                assert!(read.triangle_count() <= scene.triangle_count());
            }
        }
    }
});
