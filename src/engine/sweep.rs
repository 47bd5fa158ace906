//! A cross section as it is asked for: the request, checked.

use crate::base::error::{BadInput, Result};
use crate::geom::Geometry;
use crate::rcs::{Aspect, BistaticAspect, Distance, RcsOptions};
use crate::scene::Scene;
use crate::trace::MAX_BOUNCES;
use glam::DVec3;

/// Most directions of one sweep, all frequencies together.
pub const MAX_LOOKS: usize = 10_000_000;

/// What to take of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// 1e8..=1e12.
    pub frequencies_hz: Vec<f64>,
    /// Directions to the transmitter.
    pub transmit: Vec<Aspect>,
    /// Directions to receive in, each with every one of `transmit`; None: where the transmitter stands.
    pub receive: Option<Vec<Aspect>>,
    /// How to take the cross section.
    pub options: RcsOptions,
}

/// How sure a sweep is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Accuracy {
    /// Flat facets seen from infinity.
    Exact,
    /// The series of a sphere.
    Series,
    /// Change against a run with a quarter of the phase across cells and a quarter of the sagitta of curved facets, dB.
    Measured(f64),
    /// No echo to compare.
    NoEcho,
    /// It was not measured: the solver does not, or its finer run was too large.
    Unknown,
}

impl Accuracy {
    /// What was measured.
    pub fn db(self) -> Option<f64> {
        match self {
            Accuracy::Measured(db) => Some(db),
            _ => None,
        }
    }
}

impl RcsOptions {
    /// Checks what is asked for.
    ///
    /// # Errors
    /// A value that is out of range, by its name here.
    pub fn check(&self) -> Result<()> {
        let ranged = |key: &str, value: String, allowed: &str| {
            Err(BadInput::new("out of range").key(key).value(value).allowed(allowed).into())
        };
        if !(1..=MAX_BOUNCES).contains(&self.bounces) {
            return ranged("bounces", self.bounces.to_string(), &format!("1..={MAX_BOUNCES}"));
        }
        if self.most_bounces > MAX_BOUNCES {
            return ranged("most_bounces", self.most_bounces.to_string(), &format!("0..={MAX_BOUNCES}"));
        }
        if !(1e-4..=3.0).contains(&self.accuracy_db) {
            return ranged("accuracy_db", self.accuracy_db.to_string(), "1e-4..=3");
        }
        if !(-1e6..=1e6).contains(&self.height_m) {
            return ranged("height_m", self.height_m.to_string(), "-1e6..1e6");
        }
        match self.distance {
            Distance::At(r) if r.is_nan() || r <= 0.0 => {
                ranged("range_m", r.to_string(), "a positive number, or inf")
            }
            _ => Ok(()),
        }
    }
}

impl Sweep {
    /// Checks what is asked for.
    ///
    /// # Errors
    /// Frequencies or options out of range, too many directions.
    pub fn check(&self) -> Result<()> {
        if let Some(f) = self.frequencies_hz.iter().find(|f| !(1e8..=1e12).contains(*f)) {
            return Err(BadInput::new("the frequency is out of range")
                .key("frequency_hz")
                .value(f)
                .allowed("1e8..1e12")
                .into());
        }
        self.options.check()?;
        check_angles(&self.transmit, ["azimuth_deg", "elevation_deg"])?;
        if let Some(receive) = &self.receive {
            check_angles(receive, ["bistatic_azimuth_deg", "bistatic_elevation_deg"])?;
        }
        check_size([
            self.frequencies_hz.len(),
            self.transmit.len(),
            self.receive.as_ref().map_or(1, Vec::len),
        ])
    }

    /// A radar inside the target has no aspect.
    ///
    /// # Errors
    /// One that stands there; a material without a value.
    pub fn check_for(&self, scene: &Scene) -> Result<()> {
        let (Distance::At(range_m), Some(frequency_hz)) =
            (self.options.distance, self.frequencies_hz.first())
        else {
            return Ok(());
        };
        let geometry = Geometry::build(scene, 0.0, *frequency_hz)?;
        let (centre, radius) = geometry.bounding_sphere_m();
        let centre = centre + DVec3::Z * self.options.height_m;
        let least = 1.05 * (centre.length() + radius);
        if !geometry.triangles.is_empty() && range_m <= least {
            return Err(BadInput::new("the radar would be inside the target's bounding sphere")
                .key("range_m")
                .value(range_m)
                .allowed(format!("more than {least:.4}"))
                .into());
        }
        Ok(())
    }

    pub(super) fn aspects(&self) -> Vec<BistaticAspect> {
        match &self.receive {
            None => self.transmit.iter().copied().map(BistaticAspect::monostatic).collect(),
            Some(list) => self
                .transmit
                .iter()
                .flat_map(|t| list.iter().map(|r| BistaticAspect { transmit: *t, receive: *r }))
                .collect(),
        }
    }
}

/// Checks the size of a product of so many values.
///
/// # Errors
/// More than [`MAX_LOOKS`] in a product of so many values.
pub fn check_size(counts: impl IntoIterator<Item = usize>) -> Result<()> {
    let count = counts.into_iter().fold(1u128, |n, c| n.saturating_mul(c as u128));
    match count <= MAX_LOOKS as u128 {
        true => Ok(()),
        false => Err(BadInput::new("too many directions")
            .key("azimuth_deg x elevation_deg x frequency_hz (x bistatic_...)")
            .value(count)
            .allowed(format!("at most {MAX_LOOKS}"))
            .remedy("use larger steps or split the sweep")
            .into()),
    }
}

fn check_angles(list: &[Aspect], keys: [&str; 2]) -> Result<()> {
    let angles = list.iter().flat_map(|a| [(0, a.azimuth, 360.0), (1, a.elevation, 90.0)]);
    for (key, radians, limit) in angles {
        // To the grain of files: the limits themselves survive the way to radians and back.
        let degrees = (radians.to_degrees() * 1e9).round() / 1e9;
        if degrees.is_nan() || degrees.abs() > limit {
            return Err(BadInput::new("the angle is out of range")
                .key(keys[key])
                .value(degrees)
                .allowed(format!("-{limit}..{limit}"))
                .into());
        }
    }
    Ok(())
}
