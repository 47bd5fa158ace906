//! What a kind of reflector is: its row in the registry, its parameters with their ranges, and the builder that
//! is deserialised from them.

use crate::base::error::{BadInput, Error, Result};
use crate::base::frames::{Pose, Target};
use crate::base::units::{C0, DEFAULT_FREQUENCY_HZ};
use crate::road::shape::{append, moved, thicken};
use crate::scene::Mesh;
use glam::{DQuat, DVec3};
use serde::de::DeserializeOwned;
use std::fmt;

/// Default greatest depth of a facet below a curved surface: a 504th of the wavelength at 77 GHz, with which
/// cross sections accurate to 0.1 dB need no finer facets (CONVENTIONS eq. 56).
pub const DEFAULT_SAGITTA_M: f64 = C0 / DEFAULT_FREQUENCY_HZ / 504.0;

/// Number of triangles above which a reflector is refused.
pub const MAX_TRIANGLES: f64 = 4e6;

/// The boresight of a corner whose three legs make equal angles with it: atan(1/sqrt 2).
pub const CORNER_ELEVATION_DEG: f64 = 35.264_389_682_754_654;

/// A reflector with facets, deserialised from the parameters of its kind by their names.
pub trait Builder {
    /// Checks the parameters together.
    ///
    /// # Errors
    /// Returns an error if the parameters do not go together.
    fn check(&self, _kind: &Kind) -> Result<()> {
        Ok(())
    }

    /// Triangles of material 0 are of the reflector's own material, those of 1 and more of
    /// [`Builder::further_materials`].
    fn mesh(&self) -> Mesh;

    /// Materials beside the one that every kind has.
    fn further_materials(&self) -> Vec<String> {
        Vec::new()
    }
}

/// What a kind builds.
pub enum Built {
    /// One mesh.
    Mesh(Box<dyn Builder>),
    /// Many copies of one part, as one mesh or as objects that share the part's mesh.
    Swarm {
        /// The part.
        part: Box<dyn Builder>,
        /// Where the copies are, m.
        at_m: Vec<DVec3>,
        /// Whether they are objects that share one mesh.
        shared: bool,
    },
    /// An isotropic scatterer.
    Point {
        /// Radar cross section, dBsm.
        rcs_dbsm: f64,
    },
}

/// One row of the registry.
pub struct Kind {
    /// Name of the kind.
    pub name: &'static str,
    /// One line for the help text.
    pub summary: &'static str,
    /// Pose in the target frame.
    pub pose: &'static str,
    /// Its parameters.
    pub params: &'static [Param],
    /// Azimuth and elevation from which the reflector is meant to be seen, degrees.
    pub boresight_deg: (f64, f64),
    /// Radar material unless another is given.
    pub material: &'static str,
    pub(super) build: fn(&Values) -> Result<Built>,
}

/// A parameter: its name carries the unit.
pub struct Param {
    /// Name, with the unit at its end.
    pub name: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// What it may be.
    pub range: Range,
}

/// The values that a parameter may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// A finite number from `min` to `max`, both included.
    /// A number.
    Number {
        /// Value where none is given.
        default: f64,
        /// Least value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// A whole number from `min` to `max`, both included.
    /// A whole number.
    Whole {
        /// Value where none is given.
        default: u32,
        /// Least value.
        min: u32,
        /// Largest value.
        max: u32,
    },
    /// The name of a radar material, or "none"; whether there is one of that name shows when a scene is
    /// made.
    Material(&'static str),
    /// One of the words; the first is the default.
    Choice(&'static [&'static str]),
}

impl Kind {
    /// Whether it has facets and thus a material: every kind but the point.
    pub(super) fn has_facets(&self) -> bool {
        self.name != "point"
    }

    /// A complaint about the value of a parameter.
    pub(super) fn bad(&self, param: &str, value: impl fmt::Display, problem: impl Into<String>) -> BadInput {
        BadInput::new(problem).key(format!("{}:{param}", self.name)).value(value)
    }

    /// Returns an error if the metal behind the sheet would fold over itself.
    pub(super) fn check_thickness(&self, sheet: &Mesh, thickness_m: f64) -> Result<()> {
        if thickness_m > 0.0 && thicken(sheet, thickness_m).is_none() {
            return Err(self.too_thick(thickness_m));
        }
        Ok(())
    }

    pub(super) fn too_thick(&self, thickness_m: f64) -> Error {
        self.bad(
            "thickness_m",
            thickness_m,
            "the metal is too thick for the bends and the distances of the faces",
        )
        .remedy("give a smaller thickness_m, or 0 for a sheet")
        .into()
    }

    /// Returns an error for a facet count that would not fit in memory.
    pub(super) fn check_triangles(&self, triangles: f64) -> Result<()> {
        if triangles <= MAX_TRIANGLES {
            return Ok(());
        }
        Err(BadInput::new(format!("this size and sagitta need about {triangles:.1e} triangles"))
            .key(format!("{}:sagitta_m", self.name))
            .allowed(format!("at most {MAX_TRIANGLES:.0e}"))
            .remedy("give a larger sagitta_m or a smaller body")
            .into())
    }
}

/// A kind whose parameters are the fields of `T`: of pec, seen along x, and without words or parameters yet.
pub(super) const fn kind_of<T: Builder + DeserializeOwned + 'static>() -> Kind {
    Kind {
        name: "",
        summary: "",
        pose: "",
        params: &[],
        boresight_deg: (0.0, 0.0),
        material: "pec",
        build: |v| built(v.kind, v.read::<T>()),
    }
}

/// The builder, when its parameters go together.
pub(super) fn built<T: Builder + 'static>(kind: &Kind, builder: T) -> Result<Built> {
    builder.check(kind)?;
    Ok(Built::Mesh(Box::new(builder)))
}

impl Param {
    /// Unit that the parameter's name ends with; none for counts and words.
    pub fn unit(&self) -> Option<&'static str> {
        match self.name.rsplit_once('_')?.1 {
            "m" => Some("m"),
            "deg" => Some("deg"),
            "dbsm" => Some("dBsm"),
            _ => None,
        }
    }

    /// The allowed range with its unit.
    pub fn allowed(&self) -> String {
        match self.unit() {
            Some(unit) => format!("{} {unit}", self.range),
            None => self.range.to_string(),
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Range::Number { min, max, .. } => write!(f, "{min}..{max}"),
            Range::Whole { min, max, .. } => write!(f, "{min}..{max}, whole"),
            Range::Material(_) => f.write_str("none|MATERIAL"),
            Range::Choice(words) => f.write_str(&words.join("|")),
        }
    }
}

impl Range {
    /// The value where none is given.
    pub fn default_value(&self) -> Value {
        match *self {
            Range::Number { default, .. } => Value::Number(default),
            Range::Whole { default, .. } => Value::Number(f64::from(default)),
            Range::Material(name) => Value::Material(name.into()),
            Range::Choice(words) => Value::Word(words[0]),
        }
    }
}

/// A parameter's value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// One of the words.
    Word(&'static str),
    /// A material by its name.
    Material(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(x) => write!(f, "{x}"),
            Value::Word(w) => f.write_str(w),
            Value::Material(m) => f.write_str(m),
        }
    }
}

/// A checked value for each parameter of a kind, in its order.
pub struct Values<'a> {
    pub(super) kind: &'static Kind,
    pub(super) values: &'a [Value],
}

impl Values<'_> {
    pub(super) fn value(&self, name: &str) -> &Value {
        let i = self.kind.params.iter().position(|p| p.name == name);
        &self.values[i.expect("a builder asks only for the parameters of its own KIND")]
    }

    pub(super) fn number(&self, name: &str) -> f64 {
        match self.value(name) {
            Value::Number(x) => *x,
            _ => f64::NAN,
        }
    }

    /// The values as the fields of a builder. A builder has no fields but the parameters of its own kind.
    pub(super) fn read<T: DeserializeOwned>(&self) -> T {
        let json = |(p, v): (&Param, &Value)| {
            let value = match (v, p.range) {
                (Value::Number(x), Range::Whole { .. }) => (*x as u32).into(),
                (Value::Number(x), _) => (*x).into(),
                (word, _) => word.to_string().into(),
            };
            (p.name.to_string(), value)
        };
        let fields = self.kind.params.iter().zip(self.values).map(json).collect();
        serde_json::from_value(serde_json::Value::Object(fields))
            .expect("the fields of a builder are its parameters")
    }
}

impl Param {
    pub(super) fn read(&self, text: &str) -> Option<Value> {
        match self.range {
            Range::Number { min, max, .. } => {
                let x: f64 = text.parse().ok()?;
                (min..=max).contains(&x).then_some(Value::Number(x))
            }
            Range::Whole { min, max, .. } => {
                let x: u32 = text.parse().ok()?;
                (min..=max).contains(&x).then_some(Value::Number(f64::from(x)))
            }
            Range::Material(_) => (!text.is_empty()).then(|| Value::Material(text.into())),
            Range::Choice(words) => words.iter().find(|w| **w == text).map(|w| Value::Word(w)),
        }
    }
}

pub(super) fn joined(part: &Mesh, at_m: &[DVec3]) -> Mesh {
    let mut mesh = Mesh::default();
    for at in at_m {
        append(&mut mesh, part, &Pose::<Target, Target>::new(DQuat::IDENTITY, *at));
    }
    mesh
}

/// The sheet, or its closed body; for sheets that leave room for any thickness behind them.
pub(super) fn thickened(sheet: Mesh, thickness_m: f64) -> Mesh {
    match thickness_m > 0.0 {
        true => thicken(&sheet, thickness_m).unwrap_or(sheet),
        false => sheet,
    }
}

/// Lifts the corner of a low reflector: turns it about its front edge on z = 0 at `front_m`.
pub(super) fn raised(mesh: Mesh, raise_deg: f64, front_m: f64) -> Mesh {
    if raise_deg == 0.0 {
        return mesh;
    }
    let turn = DQuat::from_rotation_y(raise_deg.to_radians());
    let edge = DVec3::X * front_m;
    moved(mesh, &Pose::<Target, Target>::new(turn, edge - turn * edge))
}

pub(super) const fn number(name: &'static str, default: f64, min: f64, max: f64, doc: &'static str) -> Param {
    Param { name, doc, range: Range::Number { default, min, max } }
}

/// A length from 0.1 mm to 100 m.
pub(super) const fn length(name: &'static str, default: f64, doc: &'static str) -> Param {
    number(name, default, 1e-4, 100.0, doc)
}

/// One of the words; the first is the default.
pub(super) const fn choice(name: &'static str, words: &'static [&'static str], doc: &'static str) -> Param {
    Param { name, doc, range: Range::Choice(words) }
}

pub(super) const fn whole(name: &'static str, default: u32, min: u32, max: u32, doc: &'static str) -> Param {
    Param { name, doc, range: Range::Whole { default, min, max } }
}

/// Thickness of the metal.
pub(super) const fn thickness(default: f64) -> Param {
    number("thickness_m", default, 0.0, 1.0, "thickness of the metal behind its face; 0 is a sheet")
}

/// Half a wavelength at 77 GHz, the width of the document's stripes, steps and chaff.
pub(super) const HALF_WAVE_M: f64 = C0 / DEFAULT_FREQUENCY_HZ / 2.0;

pub(super) const SAGITTA: Param = number(
    "sagitta_m",
    DEFAULT_SAGITTA_M,
    1e-8,
    1.0,
    "maximum depth of a facet below the curved surface through its corners",
);
