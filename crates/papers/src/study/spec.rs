//! A study: what varies, what is computed and drawn, what is set beside a document, what is sought.

use super::parameter::{self, Value, Values};
use super::sigma_min::Detection;
use super::solve::Sources;
use super::view::{Mount, ViewKind, view};
use catseye::error::Result;
use catseye::rcs::{Diffraction, Distance, Ground, RcsOptions};
use catseye::scene::gltf::ImportOptions;
use catseye::scene::material;
use catseye::trace::Convention;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reduce {
    /// Mean of the decibels.
    MeanDb,
    /// Mean of the powers, in decibels.
    MeanPower,
    Maximum,
    Minimum,
    /// Of margin_db over a distance: the largest at which it is not negative.
    DetectionRange,
    /// Of margin_db over a distance: where it first turns negative after it was not.
    UnbrokenRange,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PictureKind {
    #[default]
    Curves,
    Map,
}

/// A parameter that varies.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    pub parameter: String,
    pub label: String,
    pub values: Vec<Value>,
    /// One for each value.
    pub names: Vec<String>,
    pub reduce: Option<Reduce>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct PictureSpec {
    pub kind: PictureKind,
    pub limits: Option<[f64; 2]>,
    pub columns: usize,
    pub contours: Vec<f64>,
}

/// A checked study.
#[derive(Debug, Clone)]
pub struct Study {
    pub name: String,
    pub title: String,
    pub reference: String,
    pub note: String,
    pub quantities: Vec<Quantity>,
    pub fixed: Values,
    pub sweeps: Vec<Sweep>,
    pub place: ViewKind,
    pub mounts: Vec<Mount>,
    pub bounces: usize,
    pub accuracy_db: f64,
    pub convention: Convention,
    pub diffraction: Diffraction,
    /// Of targets that are files.
    pub import: ImportOptions,
    pub detection: Option<Detection>,
    pub picture: PictureSpec,
    pub facts: Vec<Fact>,
    pub search: Option<Search>,
    /// Grids have a quarter of their steps.
    pub quick: bool,
    pub file: PathBuf,
    /// The text of the file.
    pub source: String,
}

impl Study {
    /// The values of all parameters at point `index` (row-major, the last sweep runs fastest).
    pub fn values_at(&self, index: usize) -> Values {
        let mut values = self.fixed.clone();
        let mut rest = index;
        for s in self.sweeps.iter().rev() {
            let n = s.values.len();
            values.insert(s.parameter.clone(), s.values[rest % n].clone());
            rest /= n;
        }
        values
    }

    pub fn points(&self) -> usize {
        self.sweeps.iter().map(|s| s.values.len()).product()
    }

    /// Options of the solver for a ground and a distance.
    ///
    /// # Errors
    /// A ground that no material is named after.
    pub fn options(&self, ground: &str, range_m: f64) -> Result<RcsOptions> {
        let ground = match ground {
            "none" => Ground::None,
            name => Ground::Plane(material::parse_spec(name)?),
        };
        Ok(RcsOptions {
            bounces: self.bounces,
            distance: if range_m.is_finite() { Distance::At(range_m) } else { Distance::Infinite },
            accuracy_db: self.accuracy_db,
            diffraction: self.diffraction,
            ground,
            last: self.convention == Convention::Last,
        })
    }

    /// Whether any quantity needs a cross section.
    pub fn needs_rcs(&self) -> bool {
        self.search.is_some() || self.quantities.iter().any(|q| q.needs_rcs())
    }

    /// Looks at each point once, so that whatever is wrong comes before the work.
    pub(super) fn check_points(&self) -> Result<()> {
        let mut sources = Sources::new(&self.file, &self.import);
        let mut base = self.clone();
        if let Some(s) = &self.search {
            for l in &s.limits {
                base.fixed.insert(l.name.clone(), Value::Number(l.min));
            }
            for &x in &s.front_values {
                base.fixed.insert(s.front.clone(), Value::Number(x));
                sources.of(&base.values_at(0))?;
            }
            for l in &s.limits {
                base.fixed.insert(l.name.clone(), Value::Number(l.max));
            }
        }
        for i in 0..base.points() {
            let values = base.values_at(i);
            for m in &self.mounts {
                view(self.place, &values, m)?;
            }
            if self.needs_rcs() {
                sources.of(&values)?;
                self.options(parameter::word_of(&values, "ground").unwrap_or("none"), f64::INFINITY)?;
            }
        }
        Ok(())
    }
}

/// What a study may compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Radar cross section in the chosen polarisation.
    Rcs,
    /// The least that is detected, of the best radar.
    SigmaMin,
    /// Cross section less the least detectable, of the best radar.
    Margin,
    /// Of the radar seen from the marker.
    ViewAzimuth,
    ViewElevation,
    ViewRange,
    /// Of one metal ball.
    BallRcs,
    BallCount,
}

impl Quantity {
    pub const ALL: [Quantity; 8] = [
        Quantity::Rcs,
        Quantity::SigmaMin,
        Quantity::Margin,
        Quantity::ViewAzimuth,
        Quantity::ViewElevation,
        Quantity::ViewRange,
        Quantity::BallRcs,
        Quantity::BallCount,
    ];

    /// In files.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Rcs => "rcs_dbsm",
            Quantity::SigmaMin => "sigma_min_dbsm",
            Quantity::Margin => "margin_db",
            Quantity::ViewAzimuth => "view_azimuth_deg",
            Quantity::ViewElevation => "view_elevation_deg",
            Quantity::ViewRange => "view_range_m",
            Quantity::BallRcs => "ball_rcs_dbsm",
            Quantity::BallCount => "ball_count",
        }
    }

    pub fn by_name(name: &str) -> Option<Quantity> {
        Quantity::ALL.into_iter().find(|q| q.name() == name)
    }

    /// In pictures.
    pub fn label(self) -> &'static str {
        match self {
            Quantity::Rcs => "RCS (dBsm)",
            Quantity::SigmaMin => "least detectable RCS (dBsm)",
            Quantity::Margin => "RCS over the least detectable (dB)",
            Quantity::ViewAzimuth => "azimuth at the marker (deg)",
            Quantity::ViewElevation => "elevation at the marker (deg)",
            Quantity::ViewRange => "range (m)",
            Quantity::BallRcs => "RCS of one ball (dBsm)",
            Quantity::BallCount => "number of balls",
        }
    }

    pub fn needs_rcs(self) -> bool {
        matches!(self, Quantity::Rcs | Quantity::Margin | Quantity::BallRcs | Quantity::BallCount)
    }

    pub fn needs_detection(self) -> bool {
        matches!(self, Quantity::SigmaMin | Quantity::Margin)
    }
}

/// What is to be large. The window is every point of the study's sweeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Goal {
    /// Percentage of the window in which the marker is detected.
    Coverage,
    /// The least margin over the least detectable cross section in the window.
    LeastMargin,
    /// The least cross section in the window.
    LeastRcs,
    /// The largest distance of detection, in the worst of the other sweeps.
    DetectionRange,
}

impl Goal {
    pub fn needs_detection(self) -> bool {
        self != Goal::LeastRcs
    }

    pub fn name(self) -> &'static str {
        match self {
            Goal::Coverage => "coverage_percent",
            Goal::LeastMargin => "least_margin_db",
            Goal::LeastRcs => "least_rcs_dbsm",
            Goal::DetectionRange => "detection_range_m",
        }
    }

    pub fn label(self) -> &'static str {
        match self {
            Goal::Coverage => "share of the window in which the marker is detected (percent)",
            Goal::LeastMargin => "least margin in the window (dB)",
            Goal::LeastRcs => "least RCS in the window (dBsm)",
            Goal::DetectionRange => "detection range in the worst direction (m)",
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    pub name: String,
    pub min: f64,
    pub max: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    pub goal: Goal,
    pub front: String,
    pub front_values: Vec<f64>,
    pub limits: Vec<Limit>,
    pub starts: usize,
    pub steps: u64,
    pub seed: u64,
}

/// How a number is taken from the points that a fact chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FactKind {
    /// The one point.
    Value,
    Maximum,
    Minimum,
    Mean,
    Median,
    /// Greatest less least.
    Spread,
    /// Place of the maximum along the one axis that is left.
    Location,
    /// Width of the axis around the maximum until `level` dB below it.
    Width,
    /// Largest place along the one axis where the quantity crosses `level`.
    Crossing,
    /// Smallest such place.
    FirstCrossing,
    /// Percentage of the points at or above `level`.
    Share,
}

/// One row of a report.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    pub text: String,
    pub document: Option<Value>,
    pub unit: String,
    pub kind: FactKind,
    /// Index into the outcome's fields.
    pub quantity: usize,
    /// (axis, value or name).
    pub at: Vec<(usize, Value)>,
    pub minus: Vec<(usize, Value)>,
    /// (axis, limits).
    pub within: Vec<(usize, [f64; 2])>,
    pub level: Option<f64>,
    pub why: String,
}
