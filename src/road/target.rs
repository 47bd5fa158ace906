//! What a cross section is taken of: a file of a mesh, or a reflector of the library with its parameters.

use super::reflector::{Reflector, kinds};
use crate::base::error::{BadInput, Result, nearest};
use crate::base::frames::{Pose, World, angles_from_direction, direction_from_angles};
use crate::scene::gltf::ImportOptions;
use crate::scene::mesh_file;
use crate::scene::{Scene, Shape, material};
use glam::DVec3;
use std::path::Path;

/// A target with its name and the direction from which it is meant to be seen.
pub struct Target {
    /// Name of the target.
    pub name: String,
    /// The target as a scene.
    pub scene: Scene,
    /// Azimuth and elevation from which the target is meant to be seen, degrees.
    pub boresight_deg: (f64, f64),
}

impl Target {
    /// Turns the target about its origin: yaw positive left, then pitch positive front down, then roll positive right side down.
    /// The direction from which it is meant to be seen turns with it; of a file that is its x axis.
    pub fn turn(&mut self, yaw: f64, pitch: f64, roll: f64) {
        if [yaw, pitch, roll] == [0.0; 3] {
            return;
        }
        let turn = Pose::<World, World>::from_yaw_pitch_roll(DVec3::ZERO, yaw, pitch, roll);
        for o in &mut self.scene.objects {
            o.pose = o.pose.then(&turn);
        }
        let (azimuth, elevation) = self.boresight_deg;
        let boresight = turn.direction(direction_from_angles(azimuth.to_radians(), elevation.to_radians()));
        let (azimuth, elevation) = angles_from_direction(boresight);
        // To the grain of tables: a turn by 30 deg is one by 30 deg.
        let degrees = |x: f64| (x.to_degrees() * 1e9).round() / 1e9 + 0.0;
        self.boresight_deg = (degrees(azimuth), degrees(elevation));
    }

    /// Gives the objects with the name `part` the radar material `spec`, whatever the file said of them.
    ///
    /// # Errors
    /// Returns an error if no object of that name has a mesh, or no material has that name.
    pub fn cover(&mut self, part: &str, spec: &str) -> Result<()> {
        let scene = &mut self.scene;
        let index = scene.material_index(&material::parse_spec(spec)?);
        let mut found = false;
        for i in 0..scene.objects.len() {
            let Shape::Mesh(m) = scene.objects[i].shape else { continue };
            if scene.objects[i].name != part {
                continue;
            }
            found = true;
            // Other parts may share the mesh.
            let mut mesh = scene.meshes[m].clone();
            mesh.material.iter_mut().for_each(|k| *k = index);
            scene.meshes.push(mesh);
            scene.objects[i].shape = Shape::Mesh(scene.meshes.len() - 1);
        }
        if found {
            return Ok(());
        }
        let mut names: Vec<&str> = (scene.objects.iter().filter(|o| matches!(o.shape, Shape::Mesh(_))))
            .map(|o| o.name.as_str())
            .collect();
        names.dedup();
        names.truncate(40);
        let bad = BadInput::new("no part of the target has this name").key("part_material").value(part);
        let bad = bad.allowed(names.join(", "));
        Err(match nearest(part, names) {
            Some(n) => bad.remedy(format!("did you mean '{n}'?")),
            None => bad.remedy("correct the name"),
        }
        .into())
    }
}

/// A target by its name: a file of a mesh, or a reflector as [`Reflector::parse`] reads it ([`is_file`] tells). `options` are those of
/// the file; their default material is also that of a reflector that names none.
///
/// # Errors
/// Returns an error if the file cannot be imported, or the reflector or a material is unknown.
pub fn load(target: &str, options: &ImportOptions) -> Result<Target> {
    let path = Path::new(target);
    if is_file(target) {
        let scene = mesh_file::import_sized(path, options, mesh_file::OBJECT_M)?;
        return Ok(Target { name: target.into(), scene, boresight_deg: (0.0, 0.0) });
    }
    let mut reflector = Reflector::parse(target)?;
    if let Some(m) = &options.default_material
        && !target.contains("material=")
    {
        reflector.material = m.clone();
    }
    Ok(Target {
        name: reflector.spec(),
        scene: reflector.to_scene(&material::parse_spec)?,
        boresight_deg: reflector.kind().boresight_deg,
    })
}

/// Whether a target is meant as a file: no kind of reflector has its name, and it looks like a file's.
pub fn is_file(target: &str) -> bool {
    let kind = target.split_once(':').map_or(target, |(kind, _)| kind).trim();
    !kinds().iter().any(|k| k.name == kind) && mesh_file::is_file_name(target)
}
