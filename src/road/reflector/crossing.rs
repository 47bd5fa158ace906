//! Type 1 reflectors back to back (Feng 2019, figure 4.15c).

use super::kind::{
    Builder, HALF_WAVE_M, Kind, Param, choice, kind_of, length, number, thickened, thickness, whole,
};
use super::type1::{LENGTH, Type1, WIDTH};
use crate::base::error::Result;
use crate::base::frames::{Pose, Target};
use crate::road::shape::{Terrace, append, moved, polygon, terraces, weld};
use crate::scene::Mesh;
use glam::{DQuat, DVec2, DVec3};
use serde::Deserialize;

/// How many reflectors stand back to back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Count {
    /// Two.
    Two,
    /// Four.
    Four,
}

/// Two Type 1 reflectors that look to +x and -x, or four that look to +y and -y as well, on walls that
/// cross at the origin. As sheets the walls of four serve on both sides, and three facets meet where
/// they stand on the ground. With thickness it is one closed body: walls of that thickness about the
/// planes in which the sheets would lie, on a slab of that thickness under z = 0.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Crossing {
    /// Width, m.
    pub width_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Length of the bottom plate beyond the triangle, m.
    pub length_m: f64,
    /// How many reflectors there are.
    pub count: Count,
    /// Thickness of the plates, m; 0 for sheets.
    pub thickness_m: f64,
}

const COUNT: Param = choice("count", &["four", "two"], "number of reflectors");

/// The crossing in the registry.
pub static KIND: Kind = Kind {
    name: "crossing",
    summary: "two or four type1 reflectors back to back",
    pose: "walls cross over the origin, bottom plates on z = 0, reflectors open to +x, -x, +y, -y",
    params: &[
        length("width_m", 0.1, "width across each opening"),
        length("height_m", 0.006, "height of the walls"),
        LENGTH,
        COUNT,
        thickness(0.0),
    ],
    ..kind_of::<Crossing>()
};

impl Crossing {
    /// One of its reflectors.
    fn part(&self) -> Type1 {
        Type1 { width_m: self.width_m, height_m: self.height_m, length_m: self.length_m, ..Type1::default() }
    }

    fn sides(&self) -> &'static [u32] {
        if self.count == Count::Four { &[0, 1, 2, 3] } else { &[0, 2] }
    }

    fn sheet(&self) -> Mesh {
        let whole = self.part().mesh();
        // The ground of a Type 1 comes first, then its two walls of two facets each.
        let walls = whole.triangles.len() - 4;
        let mut ground = whole.clone();
        ground.triangles.truncate(walls);
        ground.material.truncate(walls);
        let mut mesh = Mesh::default();
        for &k in self.sides() {
            let part = if k % 2 == 0 { &whole } else { &ground };
            let mut turned = part.clone();
            for p in &mut turned.positions_m {
                *p = quarter_turns(p.truncate(), k).extend(p.z);
            }
            append(&mut mesh, &turned, &Pose::<Target, Target>::IDENTITY);
        }
        weld(mesh)
    }

    fn body(&self) -> Mesh {
        let (w, q) = (0.5 * self.width_m, self.thickness_m * std::f64::consts::FRAC_1_SQRT_2);
        let v = DVec2::new;
        let mut plan = Vec::new();
        let mut add = |corners: &[DVec2], turns: u32, level_m: f64| {
            let corners = corners.iter().map(|p| quarter_turns(*p, turns)).collect();
            plan.push(Terrace { corners, level_m });
        };
        for &k in self.sides() {
            add(&[v(q, 0.0), v(w, q - w), v(w, w - q)], k, 0.0);
            if self.length_m > 0.0 {
                let x = w + self.length_m;
                add(&[v(x, -w), v(x, w), v(w, w), v(w, w - q), v(w, q - w), v(w, -w)], k, 0.0);
            }
        }
        for k in 0..4 {
            add(&[v(q, 0.0), v(w, w - q), v(w, w), v(w - q, w), v(0.0, q)], k, self.height_m);
        }
        add(&[v(q, 0.0), v(0.0, q), v(-q, 0.0), v(0.0, -q)], 0, self.height_m);
        terraces(&plan, -self.thickness_m, 0)
    }
}

/// Exact, so that what meets goes on meeting.
fn quarter_turns(p: DVec2, turns: u32) -> DVec2 {
    (0..turns).fold(p, |p, _| DVec2::new(-p.y, p.x))
}

impl Builder for Crossing {
    fn check(&self, kind: &Kind) -> Result<()> {
        let most = 0.5 * self.width_m;
        if self.thickness_m >= most {
            return Err(kind
                .bad("thickness_m", self.thickness_m, "the walls would fill the corners")
                .allowed(format!("less than {most}"))
                .remedy("give a smaller thickness_m or a larger width_m")
                .into());
        }
        Ok(())
    }

    fn mesh(&self) -> Mesh {
        if self.thickness_m > 0.0 { self.body() } else { self.sheet() }
    }
}

/// A row of Type 1 reflectors or crossings, each turned against the one before (Feng 2019, figure
/// 4.17a).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Row {
    /// What stands in the row.
    pub element: Element,
    /// What is repeated, or the Type 1 of the same sizes.
    #[serde(flatten)]
    pub crossing: Crossing,
    /// Number of elements.
    pub number: u32,
    /// Distance from element to element, m.
    pub spacing_m: f64,
    /// Turn of each against the one before, degrees.
    pub turn_deg: f64,
}

/// What stands in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Element {
    /// A Type 1 reflector.
    Type1,
    /// A crossing of four.
    Crossing,
}

/// The row in the registry.
pub static STRING_KIND: Kind = Kind {
    name: "string",
    summary: "row of type1 reflectors or crossings, each rotated relative to the one before",
    pose: "first element at the origin in its own pose, the others behind it along -x, each rotated further to the left",
    params: &[
        choice("element", &["type1", "crossing"], "element that is repeated"),
        whole("number", 5, 1, 10_000, "how many elements"),
        length("spacing_m", 1.5, "spacing of the elements"),
        number("turn_deg", 15.0, -180.0, 180.0, "rotation of each element relative to the one before"),
        length("width_m", 0.1, "width across the opening"),
        length("height_m", 0.006, "height of the vertical plates"),
        LENGTH,
        COUNT,
        thickness(0.0),
    ],
    ..kind_of::<Row>()
};

impl Builder for Row {
    fn check(&self, kind: &Kind) -> Result<()> {
        self.crossing.check(kind)
    }

    fn mesh(&self) -> Mesh {
        let part = match self.element {
            Element::Type1 => Type1 { thickness_m: self.crossing.thickness_m, ..self.crossing.part() }.mesh(),
            Element::Crossing => self.crossing.mesh(),
        };
        let mut mesh = Mesh::default();
        for i in 0..self.number {
            let turn = DQuat::from_rotation_z((f64::from(i) * self.turn_deg).to_radians());
            let at = DVec3::NEG_X * f64::from(i) * self.spacing_m;
            append(
                &mut mesh,
                &moved(part.clone(), &Pose::<Target, Target>::new(turn, at)),
                &Pose::<Target, Target>::IDENTITY,
            );
        }
        mesh
    }
}

/// Type 1 whose standing plates are cut into steps (Feng 2019, figure 4.11c): risers of equal height,
/// each a tread of `step_m` behind the one below.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Stepped {
    /// Width, m.
    pub width_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Length of the bottom plate beyond the triangle, m.
    pub length_m: f64,
    /// Number of steps.
    pub steps: u32,
    /// Depth of a tread, m.
    pub step_m: f64,
    /// Thickness of the plates, m; 0 for sheets.
    pub thickness_m: f64,
}

/// The stepped reflector in the registry.
pub static STEPPED_KIND: Kind = Kind {
    name: "stepped",
    summary: "type1 with its vertical plates cut into steps",
    pose: "apex of the lowest step at the origin, bottom plate on z = 0, open to +x",
    params: &[
        WIDTH,
        length("height_m", 0.004, "total height of all steps"),
        LENGTH,
        whole("steps", 3, 1, 1000, "how many risers"),
        length("step_m", HALF_WAVE_M, "depth of a tread; half a wavelength at 77 GHz"),
        thickness(0.0),
    ],
    ..kind_of::<Stepped>()
};

impl Builder for Stepped {
    fn mesh(&self) -> Mesh {
        let one = Type1 { width_m: self.width_m, length_m: self.length_m, ..Type1::default() };
        let mut mesh = one.mesh();
        // Its ground.
        let ground = mesh.triangles.len() - 4;
        mesh.triangles.truncate(ground);
        mesh.material.truncate(ground);
        // Apex, left end and right end of the riser `i` at the height of edge `j`.
        let edge = |i: u32, j: u32| {
            let (back, z) =
                (f64::from(i) * self.step_m, self.height_m * f64::from(j) / f64::from(self.steps));
            let (w, d) = (0.5 * self.width_m, back * std::f64::consts::FRAC_1_SQRT_2);
            [DVec3::new(-2.0 * d, 0.0, z), DVec3::new(w - d, w + d, z), DVec3::new(w - d, -w - d, z)]
        };
        for i in 0..self.steps {
            let mut strips = vec![(edge(i, i), edge(i, i + 1))];
            if i + 1 < self.steps {
                strips.push((edge(i, i + 1), edge(i + 1, i + 1)));
            }
            for (low, high) in strips {
                polygon(&mut mesh, &[low[0], low[1], high[1], high[0]], 0);
                polygon(&mut mesh, &[low[2], low[0], high[0], high[2]], 0);
            }
        }
        let sheet = weld(mesh);
        // The metal is the sheet moved back and down: its own steps always leave room for it.
        thickened(sheet, self.thickness_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::reflector::Reflector;
    use crate::road::shape::{area_m2, area_vector_m2, is_watertight, volume_m3};
    use proptest::prelude::*;

    fn mesh(spec: &str) -> Mesh {
        Reflector::parse(spec).unwrap().mesh().unwrap()
    }

    #[test]
    fn sheets_and_bodies_of_crossings() {
        for (spec, sides, length) in
            [("crossing", 4.0, 0.0), ("crossing:count=two", 2.0, 0.0), ("crossing:length_m=0.03", 4.0, 0.03)]
        {
            let sheet = mesh(spec);
            let walls = 4.0 * 0.05 * 2f64.sqrt() * 0.006;
            let ground = sides * (0.05 * 0.05 + length * 0.1);
            assert!((area_m2(&sheet) - walls - ground).abs() < 1e-15, "{spec}");
            // Ground looks up; no facet is there twice.
            let up: f64 = (0..sheet.triangles.len()).map(|t| area_vector_m2(&sheet, t).z).sum();
            assert!((up - ground).abs() < 1e-15);
            let t = 0.001;
            let body = mesh(&format!("{spec}{}thickness_m={t}", if spec.contains(':') { "," } else { ":" }));
            assert!(is_watertight(&body), "{spec}");
            // Wall area in the plan: a square of edge W minus four right isosceles triangles.
            let q = t * 0.5f64.sqrt();
            let plan = 0.1 * 0.1 - 4.0 * (0.05 - q) * (0.05 - q);
            let open = sides * ((0.05 - q) * (0.05 - q) + length * 0.1);
            let volume = plan * (0.006 + t) + open * t;
            assert!((volume_m3(&body) / volume - 1.0).abs() < 1e-12, "{spec}: {} {volume}", volume_m3(&body));
        }
        assert!(Reflector::parse("crossing:width_m=0.01,thickness_m=0.006").is_err());
    }

    #[test]
    fn a_string_turns_and_recedes() {
        let m = mesh("string:number=7");
        assert_eq!(m.triangles.len(), 35);
        for i in 0..7 {
            let apex = m.positions_m[i * m.positions_m.len() / 7];
            assert!((apex - DVec3::new(-1.5 * i as f64, 0.0, 0.0)).length() < 1e-12);
            // The middle of its front edge points where it looks.
            let part: Vec<DVec3> = m.triangles[5 * i].map(|k| m.positions_m[k as usize] - apex).to_vec();
            let look = 0.5 * (part[1] + part[2]);
            assert!((look.y.atan2(look.x).to_degrees() - 15.0 * i as f64).abs() < 1e-9);
        }
        let crossings = mesh("string:element=crossing,thickness_m=0.001,number=3");
        assert!(is_watertight(&crossings));
    }

    #[test]
    fn steps_share_the_height() {
        let one = mesh("stepped:steps=1");
        assert!((area_m2(&one) - area_m2(&mesh("type1"))).abs() < 1e-15);
        let m = mesh("stepped:steps=4,thickness_m=0.0005");
        assert!(is_watertight(&m) && volume_m3(&m) > 0.0);
        let top = m.positions_m.iter().map(|p| p.z).fold(0.0, f64::max);
        assert!((top - 0.004).abs() < 1e-15);
        let risers: f64 = {
            let m = mesh("stepped:steps=4");
            (0..m.triangles.len())
                .map(|t| area_vector_m2(&m, t))
                .filter(|a| a.z.abs() < 1e-12)
                .map(|a| a.length())
                .sum()
        };
        // Riser i is longer by two step depths at the apex than its foot would be alone: the legs of V grow.
        let leg = |i: f64| 0.08 * 2f64.sqrt() + i * HALF_WAVE_M;
        let expected: f64 = (0..4).map(|i| 2.0 * leg(f64::from(i)) * 0.001).sum();
        assert!((risers / expected - 1.0).abs() < 1e-12, "{risers} {expected}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn thick_ones_are_closed(
            w in 0.02f64..0.3, h in 0.001f64..0.1, l in 0.0f64..0.2, t in 1e-4f64..0.005,
            two in any::<bool>(), steps in 1u32..9,
        ) {
            let count = if two { "two" } else { "four" };
            for spec in [
                format!("crossing:width_m={w},height_m={h},length_m={l},thickness_m={t},count={count}"),
                format!("stepped:width_m={w},height_m={h},length_m={l},thickness_m={t},steps={steps}"),
            ] {
                let m = mesh(&spec);
                prop_assert!(is_watertight(&m), "{}", spec);
                prop_assert!(volume_m3(&m) > 0.0, "{}", spec);
                prop_assert!((0..m.triangles.len()).all(|i| area_vector_m2(&m, i).length() > 0.0));
            }
        }
    }
}
