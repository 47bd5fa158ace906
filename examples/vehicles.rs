//! Writes every vehicle and person as `DIR/KIND.glb`, walking or driving: `cargo run --release --example vehicles DIR`.

use catseye::base::error::{Error, Result};
use catseye::base::frames::Pose;
use catseye::formats::stage::write_file;
use catseye::road::vehicle::{Kind, vehicle};
use catseye::scene::{Scene, gltf, material};
use std::path::PathBuf;

fn main() -> Result<()> {
    let dir = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "vehicles".into()));
    std::fs::create_dir_all(&dir).map_err(|e| Error::io(&dir, e))?;
    for kind in Kind::ALL {
        let body = vehicle(kind, &material::by_name)?;
        let mut scene = Scene::default();
        // A quarter of a second after a start at a walker's pace.
        body.add_to(&mut scene, kind.name(), Pose::IDENTITY, 1.4, 0.25);
        let file = write_file(dir.join(format!("{}.glb", kind.name())), false, &gltf::to_glb(&scene)?)?;
        println!("{}: {} parts, {} triangles", file.display(), body.parts.len(), body.triangle_count());
    }
    Ok(())
}
