//! Metal balls on the footprint of a Type 1 (Feng 2019, figures 3.13b and 4.1b).

use super::kind::{
    Builder, Built, Kind, MAX_TRIANGLES, SAGITTA, Value, Values, choice, joined, length, number, whole,
};
use super::sphere::Sphere;
use super::type1::{LENGTH, WIDTH};
use crate::base::error::Result;
use crate::base::rng::philox4x32_10;
use crate::scene::Mesh;
use glam::{DVec2, DVec3};
use serde::Deserialize;

/// Balls lying on z = 0 with their centres inside the outline of a Type 1 of the same width and length.
/// Each is a geodesic sphere; they share one tessellation.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Type3 {
    /// Width of the footprint, m.
    pub width_m: f64,
    /// Length of the footprint, m.
    pub length_m: f64,
    /// Diameter of a ball, m.
    pub ball_m: f64,
    /// Distance from ball to ball, m.
    pub pitch_m: f64,
    /// How balls are packed.
    pub packing: Packing,
    /// Seed of the random packing.
    pub seed: u32,
    /// How far facets may lie off the balls, m.
    pub sagitta_m: f64,
}

/// How balls are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Packing {
    /// Rows across the boresight, every other one set off by half a pitch.
    Hexagonal,
    /// A square lattice.
    Square,
    /// Thrown one after the other, kept where no earlier one is nearer than the pitch.
    Random,
}

/// Type 3 in the registry.
pub static KIND: Kind = Kind {
    name: "type3",
    summary: "metal balls on the footprint of a type1",
    pose: "apex of the footprint at the origin, balls on z = 0, open to +x",
    params: &[
        WIDTH,
        LENGTH,
        length("ball_m", 0.0013, "diameter of a ball"),
        number(
            "pitch_m",
            0.0,
            0.0,
            1.0,
            "minimum distance between two centres; 0 is a ball's diameter: touching",
        ),
        choice(
            "packing",
            &["hexagonal", "square", "random"],
            "arrangement; random: sequential addition up to the jamming limit",
        ),
        whole("seed", 1, 0, u32::MAX, "seed for packing=random"),
        choice("copies", &["mesh", "objects"], "balls as one mesh, or as objects that share the mesh of one"),
        SAGITTA,
    ],
    boresight_deg: (0.0, 0.0),
    material: "pec",
    build,
};

fn build(v: &Values) -> Result<Built> {
    let mut t: Type3 = v.read();
    if t.pitch_m == 0.0 {
        t.pitch_m = t.ball_m;
    }
    if t.pitch_m < t.ball_m {
        return Err(v
            .kind
            .bad("pitch_m", t.pitch_m, "the balls would overlap")
            .allowed(format!("0, or at least the diameter of {}", t.ball_m))
            .remedy("give a larger pitch_m or a smaller ball_m")
            .into());
    }
    let shared = matches!(v.value("copies"), Value::Word("objects"));
    let part = t.ball();
    let (each, count) = (part.triangles(), t.most_balls());
    // Objects cost more than triangles do: an id, a name, a pose each.
    let cost = if shared { count * 100.0 } else { count * each };
    if cost > MAX_TRIANGLES {
        let problem = format!("about {count:.0} balls of {each:.0} triangles are too many");
        return Err(v
            .kind
            .bad("sagitta_m", t.sagitta_m, problem)
            .allowed(format!("{MAX_TRIANGLES:.0e} triangles, or {:.0e} objects", MAX_TRIANGLES / 100.0))
            .remedy("give a larger sagitta_m or pitch_m, a smaller footprint, or copies=objects")
            .into());
    }
    let at_m = t.centres_m();
    if at_m.is_empty() {
        return Err(v
            .kind
            .bad("pitch_m", t.pitch_m, "no ball fits on the footprint")
            .remedy("give a smaller pitch_m or a wider footprint")
            .into());
    }
    Ok(Built::Swarm { part: Box::new(part), at_m, shared })
}

impl Type3 {
    fn ball(&self) -> Sphere {
        Sphere { radius_m: 0.5 * self.ball_m, sagitta_m: self.sagitta_m }
    }

    fn area_m2(&self) -> f64 {
        (0.25 * self.width_m + self.length_m) * self.width_m
    }

    /// Upper bound for the number of balls, for the budget.
    fn most_balls(&self) -> f64 {
        // A hexagonal cell has sqrt(3)/2 pitch², and rows may begin on the edge.
        (self.area_m2() / (self.pitch_m * self.pitch_m * 0.866)
            + 2.0 * (self.width_m + self.length_m) / self.pitch_m)
            .ceil()
    }

    fn on_footprint(&self, p: DVec2) -> bool {
        let w = 0.5 * self.width_m;
        p.x >= 0.0 && p.x <= w + self.length_m && p.y.abs() <= p.x.min(w)
    }

    /// Centres of the balls, in a fixed order.
    pub fn centres_m(&self) -> Vec<DVec3> {
        let (w, depth) = (0.5 * self.width_m, 0.5 * self.width_m + self.length_m);
        let mut flat: Vec<DVec2> = Vec::new();
        match self.packing {
            Packing::Random => self.thrown(&mut flat),
            Packing::Hexagonal | Packing::Square => {
                let hexagonal = self.packing == Packing::Hexagonal;
                let row_m = self.pitch_m * if hexagonal { 0.75f64.sqrt() } else { 1.0 };
                let rows = (depth / row_m * (1.0 + 1e-12)) as i64;
                let columns = (w / self.pitch_m) as i64 + 1;
                for i in 0..=rows {
                    let shift = if hexagonal && i % 2 == 1 { 0.5 } else { 0.0 };
                    for j in -columns - 1..=columns {
                        flat.push(DVec2::new(i as f64 * row_m, (j as f64 + shift) * self.pitch_m));
                    }
                }
                flat.retain(|p| self.on_footprint(*p));
            }
        }
        flat.into_iter().map(|p| p.extend(0.5 * self.ball_m)).collect()
    }

    /// Random sequential addition: throws until 200 for each ball that could fit have been made, which
    /// reaches within a few per cent of the jamming limit.
    fn thrown(&self, kept: &mut Vec<DVec2>) {
        let depth = 0.5 * self.width_m + self.length_m;
        // Cells in which no two balls fit, so that one index each is enough.
        let cell = self.pitch_m / 2f64.sqrt();
        let place = |p: DVec2| ((p.x / cell).floor() as i64, (p.y / cell).floor() as i64);
        let mut grid = std::collections::HashMap::new();
        let throws = (200.0 * self.most_balls()) as u64;
        for k in 0..throws {
            let [a, b, c, d] = philox4x32_10([k as u32, (k >> 32) as u32, 0, 0], [self.seed, 0x7479_7033]);
            let unit =
                |hi: u32, lo: u32| ((u64::from(hi) << 21) ^ u64::from(lo >> 11)) as f64 / (1u64 << 53) as f64;
            let p = DVec2::new(unit(a, b) * depth, (unit(c, d) - 0.5) * self.width_m);
            if !self.on_footprint(p) {
                continue;
            }
            let (i, j) = place(p);
            let free = (i - 2..=i + 2).all(|i| {
                (j - 2..=j + 2)
                    .all(|j| grid.get(&(i, j)).is_none_or(|q: &DVec2| q.distance(p) >= self.pitch_m))
            });
            if free {
                grid.insert((i, j), p);
                kept.push(p);
            }
        }
    }
}

impl Builder for Type3 {
    fn mesh(&self) -> Mesh {
        joined(&self.ball().mesh(), &self.centres_m())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::reflector::Reflector;
    use crate::road::shape::{is_watertight, volume_m3};
    use crate::scene::{Shape, material};
    use std::f64::consts::PI;

    fn base(packing: Packing) -> Type3 {
        Type3 {
            width_m: 0.16,
            length_m: 0.0,
            ball_m: 0.0013,
            pitch_m: 0.0013,
            packing,
            seed: 3,
            sagitta_m: super::super::DEFAULT_SAGITTA_M,
        }
    }

    #[test]
    fn balls_do_not_overlap_and_fill_the_footprint() {
        let area: f64 = 0.08 * 0.08;
        for (packing, density) in [
            (Packing::Hexagonal, PI / 12f64.sqrt()),
            (Packing::Square, PI / 4.0),
            // Jamming limit of random sequential addition of discs, 0.5470 (Feder 1980).
            (Packing::Random, 0.547),
        ] {
            let t = base(packing);
            let c = t.centres_m();
            let covered = c.len() as f64 * PI * 0.25 * 0.0013f64.powi(2) / area;
            // Centres may lie on the rim, which adds up to half a ball along it.
            assert!((covered / density - 1.0).abs() < 0.06, "{packing:?}: {covered} {density}");
            assert!(c.len() as f64 <= t.most_balls());
            for (i, p) in c.iter().enumerate() {
                assert!(t.on_footprint(p.truncate()) && p.z == 0.00065);
                assert!(c[..i].iter().all(|q| q.distance(*p) > 0.0013 * (1.0 - 1e-9)), "{packing:?} {i}");
            }
        }
        let again = Type3 { seed: 4, ..base(Packing::Random) };
        assert_eq!(again.centres_m(), again.centres_m());
        assert_ne!(again.centres_m(), base(Packing::Random).centres_m());
    }

    #[test]
    fn one_mesh_or_many_objects() {
        let spec = "type3:width_m=0.02,sagitta_m=4e-5";
        let mesh = Reflector::parse(spec).unwrap().mesh().unwrap();
        let balls = Type3 { width_m: 0.02, sagitta_m: 4e-5, ..base(Packing::Hexagonal) }.centres_m().len();
        assert!(is_watertight(&mesh) && mesh.is_smooth());
        let one = volume_m3(&Sphere { radius_m: 0.00065, sagitta_m: 4e-5 }.mesh());
        assert!((volume_m3(&mesh) / (balls as f64 * one) - 1.0).abs() < 1e-9);
        let shared = Reflector::parse(&format!("{spec},copies=objects")).unwrap();
        let scene = shared.to_scene(&material::by_name).unwrap();
        assert_eq!((scene.meshes.len(), scene.objects.len()), (1, balls));
        assert_eq!(scene.triangle_count(), mesh.triangles.len());
        assert!(scene.objects.iter().all(|o| o.shape == Shape::Mesh(0)));
        let ids: std::collections::BTreeSet<u32> = scene.objects.iter().map(|o| o.id).collect();
        assert_eq!(ids.len(), balls);
    }

    #[test]
    fn budget_and_overlap_are_refused() {
        for (spec, says) in [
            ("type3:width_m=10", "copies=objects"),
            ("type3:pitch_m=0.001", "0.0013"),
            ("type3:width_m=100,copies=objects", "too many"),
        ] {
            let e = Reflector::parse(spec).unwrap_err().to_string();
            assert!(e.contains(says), "{e}");
        }
    }
}
