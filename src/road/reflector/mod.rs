//! Reflectors, each with its parameters and its documented pose in the target frame (x along
//! boresight to the radar, y left, z up). To add one: a file with a struct of its parameters, its `mesh` and a `KIND`,
//! and a row in [`kinds`].
//!
//! A reflector is named by a spec string, `"type1:width_m=0.16,height_m=0.004"`; the kind alone takes
//! every default.

pub mod crossing;
pub mod cylinder;
pub mod dihedral;
mod kind;
pub mod lattice;
pub mod manhole;
pub mod plate;
pub mod point;
pub mod roadside;
pub mod sphere;
pub mod trihedral;
pub mod type1;
pub mod type3;
pub mod type4;

use crate::base::error::{BadInput, Result, nearest};
use crate::base::frames::{Pose, Target, World};
use crate::road::materials::MaterialLookup;
use crate::scene::{Mesh, Scene, Shape};
use glam::DVec3;
use kind::{SAGITTA, joined};
use std::fmt;

pub use crossing::{Crossing, Element, Row, Stepped};
pub use cylinder::{Cylinder, Ends};
pub use dihedral::Dihedral;
pub use kind::{
    Builder, Built, CORNER_ELEVATION_DEG, DEFAULT_SAGITTA_M, Kind, MAX_TRIANGLES, Param, Range, Value, Values,
};
pub use lattice::{Chaff, Lattice, Wave};
pub use manhole::Manhole;
pub use plate::Plate;
pub use roadside::{GuardPost, GuardRail, Kerb, SignPole};
pub use sphere::Sphere;
pub use trihedral::{SquareTrihedral, Trihedral};
pub use type1::{Filled, PlateShape, Type1};
pub use type3::{Packing, Type3};
pub use type4::{Curve, Type4};

/// All kinds, in the order of the help text.
pub fn kinds() -> &'static [&'static Kind] {
    static KINDS: [&Kind; 25] = [
        &plate::KIND,
        &dihedral::KIND,
        &trihedral::KIND,
        &trihedral::SQUARE_KIND,
        &sphere::KIND,
        &cylinder::KIND,
        &type1::KIND,
        &type1::TYPE2_KIND,
        &type3::KIND,
        &type4::KIND,
        &crossing::KIND,
        &crossing::STRING_KIND,
        &lattice::STRIPES_KIND,
        &lattice::CROSSED_KIND,
        &crossing::STEPPED_KIND,
        &lattice::CHAFF_KIND,
        &lattice::MESH_KIND,
        &lattice::WAVE_KIND,
        &manhole::ROUND_KIND,
        &manhole::SQUARE_KIND,
        &roadside::RAIL_KIND,
        &roadside::POST_KIND,
        &roadside::KERB_KIND,
        &roadside::POLE_KIND,
        &point::KIND,
    ];
    &KINDS
}

/// All kinds with their poses and parameters, for a help text.
pub fn help() -> String {
    kinds().iter().map(|k| help_of(k)).collect::<Vec<_>>().join("\n")
}

/// A kind with its pose, its radar material and its parameters: name, default, range, unit and what it is.
pub fn help_of(k: &Kind) -> String {
    let mut text = format!("{}: {}\n    {}\n", k.name, k.summary, k.pose);
    let mut row = |name: &str, default: String, range: String, doc: &str| {
        text += &format!("      {:14} {:>9}  [{range}]  {doc}\n", name, default);
    };
    for p in k.params {
        row(p.name, shown(&p.range.default_value()), p.allowed(), p.doc);
    }
    if k.has_facets() {
        row(MATERIAL_PARAM, k.material.into(), "MATERIAL".into(), "radar material of its facets");
    }
    text
}

/// A default with four digits, which are enough for the eye.
fn shown(value: &Value) -> String {
    match value {
        Value::Number(x) if *x != 0.0 && x.abs() < 1e-3 => {
            let text = format!("{x:.3e}");
            let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
            format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.'))
        }
        Value::Number(x) => format!("{}", (x * 1e6).round() / 1e6),
        other => other.to_string(),
    }
}

/// The kind of that name.
///
/// # Errors
/// Returns an error for an unknown name, with the nearest and all names.
pub fn kind_named(name: &str) -> Result<&'static Kind> {
    kinds().iter().copied().find(|k| k.name == name).ok_or_else(|| {
        let names: Vec<&str> = kinds().iter().map(|k| k.name).collect();
        let e = BadInput::new("unknown kind of reflector")
            .key("kind")
            .value(format!("'{name}'"))
            .allowed(names.join(", "));
        match nearest(name, names.iter().copied()) {
            Some(n) => e.remedy(format!("did you mean '{n}'?")),
            None => e,
        }
        .into()
    })
}

/// The parameter that every kind with facets has besides its own.
pub const MATERIAL_PARAM: &str = "material";

/// A kind with checked parameters.
///
/// # Example
/// ```
/// use catseye::road::{reflector::Reflector, shape::area_m2};
///
/// let corner = Reflector::parse("trihedral:leg_m=0.1")?;
/// // Three right triangles with legs of 10 cm.
/// let area = corner.mesh().map(|mesh| area_m2(&mesh));
/// assert!(area.is_some_and(|a| (a - 1.5 * 0.1 * 0.1).abs() < 1e-12));
/// // The whole spec names every parameter, also those that were not given, and makes the same reflector.
/// assert_eq!(Reflector::parse(&corner.spec())?.spec(), corner.spec());
/// assert_eq!(Reflector::parse("point:rcs_dbsm=10")?.point_rcs_dbsm(), Some(10.0));
/// assert!(Reflector::parse("trihedral:leg_m=-1").is_err());
/// # Ok::<(), catseye::Error>(())
/// ```
#[derive(Clone)]
pub struct Reflector {
    kind: &'static Kind,
    values: Vec<Value>,
    /// Name of the radar material of all its facets.
    pub material: String,
}

impl fmt::Debug for Reflector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spec())
    }
}

impl PartialEq for Reflector {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name == other.kind.name && self.values == other.values && self.material == other.material
    }
}

impl Reflector {
    /// Reads `KIND` or `KIND:name=value,name=value`.
    ///
    /// # Errors
    /// Returns an error for an unknown kind or parameter, or a value out of range: they name the nearest one, all of
    /// them, and the allowed range with the default.
    pub fn parse(spec: &str) -> Result<Reflector> {
        let (kind, rest) = match spec.split_once(':') {
            Some((kind, rest)) => (kind.trim(), Some(rest)),
            None => (spec.trim(), None),
        };
        let mut pairs = Vec::new();
        for item in rest.iter().flat_map(|r| r.split(',')) {
            let (name, value) = item.split_once('=').ok_or_else(|| {
                BadInput::new("expected name=value")
                    .key(kind)
                    .value(format!("'{}'", item.trim()))
                    .remedy(format!("write for example {}", Self::example(kind)))
            })?;
            pairs.push((name.trim(), value.trim()));
        }
        Self::from_pairs(kind, &pairs)
    }

    /// Makes a reflector of a kind and its parameters as text.
    ///
    /// # Errors
    /// Returns an error for a kind or parameter that is unknown, or a value outside its range.
    pub fn from_pairs(kind_name: &str, pairs: &[(&str, &str)]) -> Result<Reflector> {
        let kind = kind_named(kind_name)?;
        let has_facets = kind.has_facets();
        let mut values: Vec<Option<Value>> = vec![None; kind.params.len()];
        let mut material: Option<String> = None;
        for &(name, text) in pairs {
            let key = format!("{kind_name}:{name}");
            let twice = || BadInput::new("given twice").key(&key).value(text).remedy("keep one");
            if name == MATERIAL_PARAM && has_facets {
                if text.is_empty() {
                    return Err(BadInput::new("the material has no name").key(key).into());
                }
                if material.replace(text.into()).is_some() {
                    return Err(twice().into());
                }
                continue;
            }
            let Some(i) = kind.params.iter().position(|p| p.name == name) else {
                let mut names: Vec<&str> = kind.params.iter().map(|p| p.name).collect();
                if has_facets {
                    names.push(MATERIAL_PARAM);
                }
                let mut e = BadInput::new(format!("{kind_name} has no such parameter"))
                    .key(key)
                    .value(text)
                    .allowed(names.join(", "));
                if let Some(n) = nearest(name, names.iter().copied()) {
                    e = e.remedy(format!("did you mean '{n}'?"));
                }
                return Err(e.into());
            };
            let param = &kind.params[i];
            let value = param.read(text).ok_or_else(|| {
                BadInput::new(match param.range {
                    Range::Number { .. } | Range::Whole { .. } => "is out of range or not a number",
                    Range::Material(_) => "is not the name of a material",
                    Range::Choice(_) => "is not one of the choices",
                })
                .key(&key)
                .value(format!("'{text}'"))
                .allowed(param.allowed())
                .remedy(format!("the default is {}", param.range.default_value()))
            })?;
            if values[i].replace(value).is_some() {
                return Err(twice().into());
            }
        }
        let values = values
            .into_iter()
            .zip(kind.params)
            .map(|(v, p)| v.unwrap_or_else(|| p.range.default_value()))
            .collect();
        let reflector =
            Reflector { kind, values, material: material.unwrap_or_else(|| kind.material.into()) };
        reflector.build()?;
        Ok(reflector)
    }

    fn build(&self) -> Result<Built> {
        (self.kind.build)(&Values { kind: self.kind, values: &self.values })
    }

    fn example(kind_name: &str) -> String {
        match kinds().iter().find(|k| k.name == kind_name) {
            Some(k) => format!("{}:{}={}", k.name, k.params[0].name, k.params[0].range.default_value()),
            None => "type1:width_m=0.16,height_m=0.004".into(),
        }
    }

    /// Row of the reflector's kind in the registry.
    pub fn kind(&self) -> &'static Kind {
        self.kind
    }

    /// The value of a parameter, or None when the kind has none of that name.
    pub fn value(&self, name: &str) -> Option<Value> {
        Some(self.values[self.kind.params.iter().position(|p| p.name == name)?].clone())
    }

    /// The spec string with every parameter written out; parses back to the same reflector.
    pub fn spec(&self) -> String {
        let mut items: Vec<String> =
            self.kind.params.iter().zip(&self.values).map(|(p, v)| format!("{}={v}", p.name)).collect();
        if self.kind.has_facets() {
            items.push(format!("{MATERIAL_PARAM}={}", self.material));
        }
        format!("{}:{}", self.kind.name, items.join(","))
    }

    /// Facets in the target frame; None for a point. Material 0 is the reflector's own, those of 1 and
    /// more are [`Reflector::further_materials`].
    pub fn mesh(&self) -> Option<Mesh> {
        match self.build() {
            Ok(Built::Mesh(b)) => Some(b.mesh()),
            Ok(Built::Swarm { part, at_m, .. }) => Some(joined(&part.mesh(), &at_m)),
            _ => None,
        }
    }

    /// Names of the materials beside the reflector's own.
    pub fn further_materials(&self) -> Vec<String> {
        match self.build() {
            Ok(Built::Mesh(b)) => b.further_materials(),
            _ => Vec::new(),
        }
    }

    /// Greatest depth of a facet below the curved surface that it stands for; None for a kind that has
    /// only flat faces.
    pub fn sagitta_m(&self) -> Option<f64> {
        match self.value(SAGITTA.name) {
            Some(Value::Number(x)) => Some(x),
            _ => None,
        }
    }

    /// The cross section of a point, dBsm; None for a reflector with facets.
    pub fn point_rcs_dbsm(&self) -> Option<f64> {
        match self.build() {
            Ok(Built::Point { rcs_dbsm }) => Some(rcs_dbsm),
            _ => None,
        }
    }

    /// Adds the reflector to a scene as a new object and returns the object's id.
    ///
    /// # Errors
    /// Returns an error for a material that `materials` does not have.
    pub fn add_to(
        &self,
        scene: &mut Scene,
        materials: MaterialLookup,
        (name, class): (&str, &str),
        pose: Pose<Target, World>,
        velocity_mps: DVec3,
    ) -> Result<u32> {
        let mut add_mesh = |mut mesh: Mesh, further: Vec<String>| -> Result<Shape> {
            let mut index = vec![scene.material_index(&materials(&self.material)?)];
            for name in further {
                index.push(scene.material_index(&materials(&name)?));
            }
            for m in &mut mesh.material {
                *m = index[*m as usize];
            }
            scene.meshes.push(mesh);
            Ok(Shape::Mesh(scene.meshes.len() - 1))
        };
        let shape = match self.build()? {
            Built::Point { rcs_dbsm } => Shape::Point { rcs_dbsm },
            Built::Mesh(b) => add_mesh(b.mesh(), b.further_materials())?,
            Built::Swarm { part, at_m, shared: false } => {
                add_mesh(joined(&part.mesh(), &at_m), part.further_materials())?
            }
            Built::Swarm { part, at_m, shared: true } => {
                let shape = add_mesh(part.mesh(), part.further_materials())?;
                let mut first = None;
                for at in at_m {
                    let pose = Pose::new(pose.rotation, pose.point(at));
                    let id = scene.add_object(name, class, shape, pose, velocity_mps);
                    first.get_or_insert(id);
                }
                return first.ok_or_else(|| BadInput::new("has no parts").key(self.spec()).into());
            }
        };
        Ok(scene.add_object(name, class, shape, pose, velocity_mps))
    }

    /// A scene that holds nothing but this reflector, at the origin and at rest.
    ///
    /// # Errors
    /// Returns an error for a material that `materials` does not have.
    pub fn to_scene(&self, materials: MaterialLookup) -> Result<Scene> {
        let mut scene = Scene::default();
        self.add_to(&mut scene, materials, (self.kind.name, "reflector"), Pose::IDENTITY, DVec3::ZERO)?;
        scene.import.triangles = scene.triangle_count();
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::shape::{area_vector_m2, volume_m3};
    use crate::scene::Material;
    use proptest::prelude::*;

    fn any_material(name: &str) -> Result<Material> {
        Ok(Material { name: name.into(), ..Material::pec() })
    }

    fn message(spec: &str) -> String {
        let e = Reflector::parse(spec).unwrap_err();
        assert_eq!(e.exit_code(), 2, "{spec}");
        let m = e.to_string();
        assert!(!m.contains('\n'), "{m}");
        m
    }

    #[test]
    fn parses_as_the_contract_writes_it() {
        let r = Reflector::parse("type1:width_m=0.16,height_m=0.004").unwrap();
        assert_eq!(r, Reflector::parse("type1").unwrap());
        assert_eq!(r.kind().name, "type1");
        assert_eq!(r.value("width_m"), Some(Value::Number(0.16)));
        assert_eq!(r.value("plates"), Some(Value::Word("strip")));
        assert_eq!(r.value("nothing"), None);
        assert_eq!(r.value("fill"), Some(Value::Material("none".into())));
        let r = Reflector::parse(" plate : width_m = 20e-2 , material = aluminium").unwrap();
        assert_eq!((r.value("width_m"), r.material.as_str()), (Some(Value::Number(0.2)), "aluminium"));
        let s = r.to_scene(&any_material).unwrap();
        assert_eq!((s.objects.len(), s.materials[0].name.as_str(), s.objects[0].id), (1, "aluminium", 1));
        let p = Reflector::parse("point:rcs_dbsm=-3.5").unwrap();
        assert_eq!((p.point_rcs_dbsm(), p.mesh()), (Some(-3.5), None));
        assert_eq!(
            p.to_scene(&|_| unreachable!("a point has no material")).unwrap().objects[0].shape,
            Shape::Point { rcs_dbsm: -3.5 }
        );
    }

    #[test]
    fn errors_say_what_is_allowed() {
        let m = message("trihedron");
        assert!(m.contains("did you mean 'trihedral'?") && m.contains("square-trihedral"), "{m}");
        let m = message("type1:widht_m=1");
        assert!(
            m.contains("did you mean 'width_m'?") && m.contains("slant_deg") && m.contains("material"),
            "{m}"
        );
        let m = message("type1:width_m=-1");
        assert!(m.contains("0.0001..100") && m.contains("default is 0.16"), "{m}");
        let m = message("type1:plates=round");
        assert!(m.contains("strip|triangle"), "{m}");
        for bad in [
            "",
            ":",
            "plate:",
            "plate:width_m",
            "plate:width_m=",
            "plate:width_m=nan",
            "plate:width_m=inf",
            "plate:width_m=1e400",
            "plate:width_m=0.1,width_m=0.2",
            "plate:width_m=0.1,",
            "plate:material=",
            "plate:material=a,material=b",
            "point:material=pec",
            "sphere:radius_m=100",
            "cylinder:radius_m=100,sagitta_m=1e-8,length_m=1,ends=flat",
        ] {
            message(bad);
        }
    }

    #[test]
    fn unknown_material_is_an_error() {
        let r = Reflector::parse("plate:material=unobtainium").unwrap();
        let none = |n: &str| Err(BadInput::new(format!("unknown material '{n}'")).into());
        assert!(r.to_scene(&none).is_err());
    }

    #[test]
    fn names_and_defaults_are_sound() {
        for k in kinds() {
            assert_eq!(kinds().iter().filter(|o| o.name == k.name).count(), 1);
            assert!(!k.params.is_empty() && !k.summary.is_empty() && !k.pose.is_empty());
            for p in k.params {
                assert!(!p.doc.is_empty() && p.name != MATERIAL_PARAM);
                assert_eq!(k.params.iter().filter(|o| o.name == p.name).count(), 1);
                assert!(help().contains(p.doc) && help().contains(k.name));
                assert_eq!(p.read(&p.range.default_value().to_string()), Some(p.range.default_value()));
            }
        }
    }

    fn check_mesh(m: &Mesh, materials: usize, what: &str) {
        assert!(!m.triangles.is_empty() && m.material.len() == m.triangles.len(), "{what}");
        assert!(m.material.iter().all(|&i| (i as usize) < materials), "{what}");
        assert!(m.positions_m.iter().all(|p| p.is_finite()), "{what}");
        assert!(m.normals.is_empty() || m.normals.len() == m.positions_m.len(), "{what}");
        for t in 0..m.triangles.len() {
            assert!(m.triangles[t].iter().all(|&i| (i as usize) < m.positions_m.len()), "{what}");
            let area = area_vector_m2(m, t);
            assert!(area.length() > 0.0, "{what}: triangle {t} has no area");
            for n in m.corner_normals(t).into_iter().flatten() {
                assert!((n.length() - 1.0).abs() < 1e-12 && n.dot(area) > 0.0, "{what}: normal of {t}");
            }
        }
    }

    /// Too large to build in a test at their limits.
    fn builds_quickly(spec: &str) -> bool {
        !["chaff:wires=1000000", "string:number=10000"].contains(&spec)
    }

    #[test]
    fn every_kind_builds_with_defaults_and_limits() {
        for k in kinds() {
            let ends = |p: &Param| match p.range {
                Range::Number { min, max, .. } => vec![min.to_string(), max.to_string()],
                Range::Whole { min, max, .. } => vec![min.to_string(), max.to_string()],
                Range::Material(_) => vec!["ice".into()],
                Range::Choice(w) => w.iter().map(|w| w.to_string()).collect(),
            };
            let specs = std::iter::once(k.name.to_string()).chain(
                k.params
                    .iter()
                    .flat_map(|p| ends(p).into_iter().map(move |v| format!("{}:{}={v}", k.name, p.name))),
            );
            for spec in specs.filter(|s| builds_quickly(s)) {
                // A few balls will do.
                let spec = match k.name {
                    "type3" if spec.contains(':') && !spec.contains("width_m") => spec + ",width_m=0.02",
                    _ => spec,
                };
                match Reflector::parse(&spec) {
                    Ok(r) => {
                        assert_eq!(Reflector::parse(&r.spec()).unwrap(), r);
                        assert_eq!(r.sagitta_m().is_some(), k.params.iter().any(|p| p.name == "sagitta_m"));
                        match r.mesh() {
                            Some(m) => check_mesh(&m, 1 + r.further_materials().len(), &spec),
                            None => assert!(r.point_rcs_dbsm().is_some()),
                        }
                    }
                    // Only an honest refusal of a size is allowed, and it names a parameter of the kind.
                    Err(e) => {
                        let e = e.to_string();
                        let named = k.params.iter().any(|p| e.contains(&format!("{}:{}", k.name, p.name)));
                        assert!(named && e.contains("give"), "{spec}: {e}");
                    }
                }
            }
            assert!(Reflector::parse(k.name).is_ok());
        }
    }

    #[test]
    fn closed_bodies_have_positive_volume() {
        for spec in [
            "sphere:radius_m=0.01",
            "cylinder",
            "plate:thickness_m=0.001",
            "dihedral:thickness_m=0.001",
            "trihedral:thickness_m=0.001",
            "square-trihedral:thickness_m=0.001",
            "type1:thickness_m=0.001",
            "type2:thickness_m=0.001",
            "type3:width_m=0.01",
            "type4:thickness_m=0.001",
            "crossing:thickness_m=0.001",
            "string:thickness_m=0.001",
            "stripes",
            "crossed-stripes",
            "stepped:thickness_m=0.0002",
            "mesh",
            "wave:thickness_m=0.0005",
            "manhole-round",
            "manhole-round:ribs=5",
            "manhole-square",
            "manhole-square:studs=6",
            "guard-rail:thickness_m=0.003",
            "guard-post:thickness_m=0.003",
            "kerb",
            "sign-pole",
        ] {
            let m = Reflector::parse(spec).unwrap().mesh().unwrap();
            assert!(crate::road::shape::is_watertight(&m), "{spec}");
            assert!(volume_m3(&m) > 0.0, "{spec}");
        }
    }

    /// Facets that are curved stay so in a file, with their normals; flat ones get none.
    #[test]
    fn a_file_keeps_the_smooth_normals() {
        use crate::scene::gltf;
        for (spec, smooth) in [
            ("sphere:radius_m=0.01", true),
            ("cylinder", true),
            ("kerb", true),
            ("type4:thickness_m=0.001,raise_deg=2", true),
            ("guard-rail", true),
            ("type1", false),
            ("manhole-square:studs=3", false),
        ] {
            let scene = Reflector::parse(spec).unwrap().to_scene(&any_material).unwrap();
            let bytes = gltf::to_glb(&scene).unwrap();
            let file = std::path::Path::new("r.glb");
            let back = gltf::import_bytes(&bytes, file, None, &gltf::ImportOptions::default()).unwrap();
            let (a, b) = (&scene.meshes[0], &back.meshes[0]);
            assert_eq!((a.is_smooth(), b.is_smooth()), (smooth, smooth), "{spec}");
            assert_eq!(b.normals.is_empty(), !smooth, "{spec}");
            assert_eq!(a.triangles.len(), b.triangles.len());
            for t in 0..a.triangles.len() {
                match (a.corner_normals(t), b.corner_normals(t)) {
                    (None, None) => {}
                    (Some(p), Some(q)) => {
                        assert!((0..3).all(|i| (p[i] - q[i]).length() < 1e-6), "{spec}: {t}");
                    }
                    _ => panic!("{spec}: facet {t} changed its kind"),
                }
            }
        }
    }

    proptest! {
        #[test]
        fn parser_never_panics(s in "\\PC{0,60}") {
            let _ = Reflector::parse(&s);
        }

        #[test]
        fn parser_survives_near_misses(
            k in prop::sample::select(vec!["type1", "plate", "sphere", "manhole-round", "point"]),
            p in prop::sample::select(vec!["width_m", "radius_m", "plates", "rcs_dbsm", "sagitta_m", "frame_m"]),
            v in "[-+0-9.eE]{0,8}",
        ) {
            if let Ok(r) = Reflector::parse(&format!("{k}:{p}={v}")) {
                prop_assert_eq!(&Reflector::parse(&r.spec()).unwrap(), &r);
            }
        }

        #[test]
        fn numbers_survive_the_spec(w in 1e-3f64..100.0, h in 0.1f64..0.99, g in -45.0f64..45.0) {
            // Higher ones may lean over until they cross.
            let h = h * w;
            let r = Reflector::parse(&format!("type1:width_m={w},height_m={h},slant_deg={g}")).unwrap();
            prop_assert_eq!(r.value("slant_deg"), Some(Value::Number(g)));
            prop_assert_eq!(&Reflector::parse(&r.spec()).unwrap(), &r);
            check_mesh(&r.mesh().unwrap(), 1, "type1");
        }
    }
}
