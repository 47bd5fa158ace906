//! Vehicles and people as rigid parts: a body, and what moves on it so that it shows in Doppler (wheels,
//! cranks, limbs). Sizes are those of classes, of no make.
//!
//! A body's frame is the target frame: x forwards, y left, z up, origin on the road below its middle.

pub mod car;
pub mod cyclist;
pub mod motion;
pub mod motorcycle;
pub mod part;
pub mod pedestrian;
pub mod shell;
pub mod surface;
pub mod truck;
pub mod wheel;

use crate::base::error::{BadInput, Result, nearest};
use crate::base::frames::{Pose, Target, World};
use crate::road::materials::MaterialLookup;
use crate::scene::{Material, Scene, material::Layer, motion as scene_motion};
use glam::DVec3;
use motion::Joint;
pub use part::{Paint, Part};
use std::str::FromStr;

/// Kinds of vehicles and people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Mid-size car with a boot.
    Sedan,
    /// Compact car with a steep tail.
    Hatchback,
    /// A sports utility vehicle: a passenger car that is taller.
    Suv,
    /// Delivery van.
    Van,
    /// Two-axle lorry with a box body.
    Truck,
    /// Tractor and semi-trailer.
    SemiTrailer,
    /// A motorcycle with its rider.
    Motorcycle,
    /// A bicycle with its rider.
    Cyclist,
    /// An adult who walks, of 1.75 m.
    Pedestrian,
    /// A child of seven years, 1.22 m.
    Child,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 10] = [
        Kind::Sedan,
        Kind::Hatchback,
        Kind::Suv,
        Kind::Van,
        Kind::Truck,
        Kind::SemiTrailer,
        Kind::Motorcycle,
        Kind::Cyclist,
        Kind::Pedestrian,
        Kind::Child,
    ];

    /// Name of the kind in files.
    pub fn name(self) -> &'static str {
        self.words().0
    }

    /// Class of the objects: car, van, truck, motorcycle, cyclist or pedestrian.
    pub fn class(self) -> &'static str {
        self.words().1
    }

    /// (name, class).
    fn words(self) -> (&'static str, &'static str) {
        match self {
            Kind::Sedan => ("sedan", "car"),
            Kind::Hatchback => ("hatchback", "car"),
            Kind::Suv => ("suv", "car"),
            Kind::Van => ("van", "van"),
            Kind::Truck => ("truck", "truck"),
            Kind::SemiTrailer => ("semi-trailer", "truck"),
            Kind::Motorcycle => ("motorcycle", "motorcycle"),
            Kind::Cyclist => ("cyclist", "cyclist"),
            Kind::Pedestrian => ("pedestrian", "pedestrian"),
            Kind::Child => ("child", "pedestrian"),
        }
    }
}

impl FromStr for Kind {
    type Err = crate::base::error::Error;

    fn from_str(name: &str) -> Result<Kind> {
        let names = || Kind::ALL.iter().map(|k| k.name());
        Kind::ALL.into_iter().find(|k| k.name() == name).ok_or_else(|| {
            let remedy = match nearest(name, names()) {
                Some(n) => format!("did you mean '{n}'?"),
                None => "choose one of the list".into(),
            };
            BadInput::new("is not a kind of vehicle or person")
                .value(name)
                .allowed(names().collect::<Vec<_>>().join(", "))
                .remedy(remedy)
                .into()
        })
    }
}

/// A vehicle or person.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// What it is.
    pub kind: Kind,
    /// Its rigid parts.
    pub parts: Vec<Part>,
    /// What the parts' meshes index.
    pub materials: Vec<Material>,
}

impl Body {
    /// Triangles of all parts.
    pub fn triangle_count(&self) -> usize {
        self.parts.iter().map(|p| p.mesh.triangles.len()).sum()
    }

    /// Box around all parts in the body's frame at a time, at a speed.
    pub fn bounds_m(&self, speed_mps: f64, time_s: f64) -> (DVec3, DVec3) {
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for part in &self.parts {
            let pose = part.pose_at(speed_mps, time_s).pose;
            for p in &part.mesh.positions_m {
                let p = pose.point(*p);
                bounds = (bounds.0.min(p), bounds.1.max(p));
            }
        }
        bounds
    }

    /// Adds the body as one object for each part, named `name` and `name PART`, at `pose` at time zero and going at `speed_mps` along
    /// its own x, its limbs' clock `time_s` ahead. Wheels and limbs turn as the scene's time goes on.
    ///
    /// Returns the ids, in the order of the parts.
    pub fn add_to(
        &self,
        scene: &mut Scene,
        name: &str,
        pose: Pose<Target, World>,
        speed_mps: f64,
        time_s: f64,
    ) -> Vec<u32> {
        let index: Vec<u32> = self.materials.iter().map(|m| scene.material_index(m)).collect();
        let mut known: Vec<(usize, usize)> = Vec::new();
        let mut ids = Vec::with_capacity(self.parts.len());
        for (i, part) in self.parts.iter().enumerate() {
            // Wheels of one kind share their mesh.
            let same = known.iter().find(|(j, _)| self.parts[*j].mesh == part.mesh).map(|k| k.1);
            let mesh = same.unwrap_or_else(|| {
                let mut mesh = part.mesh.clone();
                mesh.material.iter_mut().for_each(|m| *m = index[*m as usize]);
                scene.meshes.push(mesh);
                known.push((i, scene.meshes.len() - 1));
                scene.meshes.len() - 1
            });
            let motion = part.pose_at(speed_mps, time_s);
            let at = motion.pose.then(&pose);
            let velocity = pose.direction(DVec3::X * speed_mps + motion.velocity_mps);
            let class = match part.suffix {
                "" => self.kind.class().to_string(),
                suffix => format!("{}.{suffix}", self.kind.class()),
            };
            let name =
                if part.suffix.is_empty() { name.to_string() } else { format!("{name} {}", part.name) };
            let id = scene.add_object(&name, &class, crate::scene::Shape::Mesh(mesh), at, velocity);
            if part.moves() {
                let hinge = |j: &Joint| scene_motion::Joint::Hinge {
                    at_m: j.at_m,
                    axis: j.axis,
                    turn: j.turn,
                    speed_mps,
                    clock_s: time_s,
                    way_m: None,
                };
                let fixed = |rotation, place| scene_motion::Joint::Fixed(rotation, place);
                let mut joints: Vec<_> = part.joints.iter().rev().map(hinge).collect();
                joints.push(fixed(part.pose.rotation, part.pose.translation_m));
                joints.push(fixed(pose.rotation, pose.translation_m));
                joints.push(scene_motion::Joint::Line(pose.direction(DVec3::X * speed_mps)));
                scene.move_by(id, scene_motion::Motion { joints });
            }
            ids.push(id);
        }
        scene.import.triangles = scene.triangle_count();
        ids
    }
}

/// The body of a kind with materials found by their names (table in `scene/material.rs`).
///
/// # Errors
/// Returns what `materials` fails with. (The shapes are fixed; a test checks that their sections fit together.)
pub fn vehicle(kind: Kind, materials: MaterialLookup) -> Result<Body> {
    let paints = Paints::new(materials)?;
    let parts = match kind {
        Kind::Sedan => car::parts(&car::SEDAN),
        Kind::Hatchback => car::parts(&car::HATCHBACK),
        Kind::Suv => car::parts(&car::SUV),
        Kind::Van => car::parts(&car::VAN),
        Kind::Truck => truck::rigid(),
        Kind::SemiTrailer => truck::semi_trailer(),
        Kind::Motorcycle => Some(motorcycle::parts()),
        Kind::Cyclist => Some(cyclist::parts()),
        Kind::Pedestrian => Some(pedestrian::parts(1.75)),
        Kind::Child => Some(pedestrian::parts(1.22)),
    };
    let unfit = || BadInput::new("the sections of its skin do not fit together").key(kind.name());
    Ok(paints.body(kind, parts.ok_or_else(unfit)?))
}

struct Paints(Vec<Material>);

impl Paints {
    fn new(find: MaterialLookup) -> Result<Paints> {
        let over = |base: &str, layer: &str, thickness_m: f64| {
            let coat = Layer::new(find(layer)?, thickness_m)?;
            let name = format!("{base}+{layer}:{thickness_m}");
            Material { name, ..find(base)? }.with_layers(vec![coat])
        };
        Ok(Paints(vec![
            find("steel")?,
            find("glass")?,
            find("aluminium")?,
            over("aluminium", "polypropylene", 0.003)?,
            over("steel", "rubber", 0.01)?,
            find("skin")?,
        ]))
    }

    fn body(self, kind: Kind, mut parts: Vec<Part>) -> Body {
        let used = |i: u32| parts.iter().any(|p| p.mesh.material.contains(&i));
        let keep: Vec<u32> = (0..self.0.len() as u32).filter(|&i| used(i)).collect();
        for m in parts.iter_mut().flat_map(|p| &mut p.mesh.material) {
            *m = keep.iter().position(|k| k == m).unwrap_or(0) as u32;
        }
        let materials = keep.iter().map(|&i| self.0[i as usize].clone()).collect();
        Body { kind, parts, materials }
    }
}

#[cfg(test)]
mod tests;
