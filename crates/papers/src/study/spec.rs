//! A study: what varies, what is computed and drawn, what is set beside a document, what is sought.

use super::parameter::{self, Value, Values};
use super::sigma_min::Detection;
use super::solve::Sources;
use super::view::{Mount, ViewKind, view};
use catseye::error::Result;
use catseye::rcs::{Diffraction, Distance, Ground, RcsOptions};
use catseye::scene::gltf::ImportOptions;
use catseye::scene::material;
use catseye::scene::toml_file::At;
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

impl Sweep {
    /// The numbers along the sweep, or None when a word is among them.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        self.values.iter().map(Value::number).collect()
    }

    /// The numbers along the sweep; 0, 1, 2, … when a word is among them.
    pub fn places(&self) -> Vec<f64> {
        self.numbers().unwrap_or_else(|| (0..self.values.len()).map(|i| i as f64).collect())
    }
}

fn two() -> At<usize> {
    2.into()
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PictureTable {
    /// Default: curves.
    #[serde(default)]
    pub kind: PictureKind,
    /// Limits of the quantity in dB or its own unit: of the upward axis, or of the colours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limits: Option<At<[f64; 2]>>,
    /// Panels side by side (default 2).
    #[serde(default = "two")]
    pub columns: At<usize>,
    /// Levels to outline on a map.
    #[serde(default)]
    pub contours: Vec<f64>,
}

impl Default for PictureTable {
    fn default() -> Self {
        PictureTable { kind: PictureKind::Curves, limits: None, columns: two(), contours: Vec::new() }
    }
}

impl PictureTable {
    pub fn limits(&self) -> Option<[f64; 2]> {
        self.limits.as_ref().map(|l| l.value)
    }
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
    pub picture: PictureTable,
    pub facts: Vec<Fact>,
    pub search: Option<SearchTable>,
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
            for l in &s.parameter {
                base.fixed.insert(l.name.value.clone(), Value::Number(l.min.value));
            }
            for &x in &s.front_values.value {
                base.fixed.insert(s.front.value.clone(), Value::Number(x));
                sources.of(&base.values_at(0))?;
            }
            for l in &s.parameter {
                base.fixed.insert(l.name.value.clone(), Value::Number(l.max.value));
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
    /// Each with its name in files and its label in pictures.
    const ALL: [(Quantity, &str, &str); 8] = [
        (Quantity::Rcs, "rcs_dbsm", "RCS (dBsm)"),
        (Quantity::SigmaMin, "sigma_min_dbsm", "least detectable RCS (dBsm)"),
        (Quantity::Margin, "margin_db", "RCS over the least detectable (dB)"),
        (Quantity::ViewAzimuth, "view_azimuth_deg", "azimuth at the marker (deg)"),
        (Quantity::ViewElevation, "view_elevation_deg", "elevation at the marker (deg)"),
        (Quantity::ViewRange, "view_range_m", "range (m)"),
        (Quantity::BallRcs, "ball_rcs_dbsm", "RCS of one ball (dBsm)"),
        (Quantity::BallCount, "ball_count", "number of balls"),
    ];

    /// The names of all.
    pub fn names() -> [&'static str; 8] {
        Quantity::ALL.map(|q| q.1)
    }

    /// In files.
    pub fn name(self) -> &'static str {
        Quantity::ALL[self as usize].1
    }

    pub fn by_name(name: &str) -> Option<Quantity> {
        Quantity::ALL.into_iter().find(|q| q.1 == name).map(|q| q.0)
    }

    /// In pictures.
    pub fn label(self) -> &'static str {
        Quantity::ALL[self as usize].2
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

    /// The name in files, and the label in pictures.
    fn words(self) -> (&'static str, &'static str) {
        match self {
            Goal::Coverage => {
                ("coverage_percent", "share of the window in which the marker is detected (percent)")
            }
            Goal::LeastMargin => ("least_margin_db", "least margin in the window (dB)"),
            Goal::LeastRcs => ("least_rcs_dbsm", "least RCS in the window (dBsm)"),
            Goal::DetectionRange => ("detection_range_m", "detection range in the worst direction (m)"),
        }
    }

    pub fn name(self) -> &'static str {
        self.words().0
    }

    pub fn label(self) -> &'static str {
        self.words().1
    }
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitTable {
    pub name: At<String>,
    pub min: At<f64>,
    pub max: At<f64>,
}

fn six() -> At<usize> {
    6.into()
}

fn forty() -> At<u64> {
    40.into()
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SearchTable {
    pub goal: Goal,
    /// The parameter that costs; the best of the others is sought for each of its values.
    pub front: At<String>,
    pub front_values: At<Vec<f64>>,
    /// Parameters to search, each with its limits.
    pub parameter: Vec<LimitTable>,
    /// Places from which to start (default 6).
    #[serde(default = "six")]
    pub starts: At<usize>,
    /// Steps of the simplex from each start (default 40).
    #[serde(default = "forty")]
    pub steps: At<u64>,
    #[serde(default)]
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
