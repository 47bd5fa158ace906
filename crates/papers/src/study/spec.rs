//! A study: what varies, what is computed and drawn, what is set beside a document, what is sought.

use super::parameter::{self, Value, Values};
use super::sigma_min::Detection;
use super::solve::Sources;
use super::view::{Mount, ViewKind, view};
use catseye::base::convention::Convention;
use catseye::base::error::Result;
use catseye::rcs::{Diffraction, Distance, Ground, RcsOptions};
use catseye::scene::gltf::ImportOptions;
use catseye::scene::material;
use catseye::scene::toml_file::At;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// How an axis is taken away.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reduce {
    /// Mean of the decibels.
    MeanDb,
    /// Mean of the powers, in decibels.
    MeanPower,
    /// By the largest value.
    Maximum,
    /// By the smallest value.
    Minimum,
    /// Of margin_db over a distance: the largest at which it is not negative.
    DetectionRange,
    /// Of margin_db over a distance: where it first turns negative after it was not.
    UnbrokenRange,
}

/// What is drawn of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PictureKind {
    /// Curves.
    #[default]
    Curves,
    /// A map.
    Map,
}

/// A parameter that varies.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Name of the parameter.
    pub parameter: String,
    /// Label in pictures, with the unit.
    pub label: String,
    /// Its values.
    pub values: Vec<Value>,
    /// One for each value.
    pub names: Vec<String>,
    /// How the axis is taken away; None where it stays.
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

/// What is drawn.
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
    /// Ends of the values' axis, where they are set.
    pub fn limits(&self) -> Option<[f64; 2]> {
        self.limits.as_ref().map(|l| l.value)
    }
}

/// A checked study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Name of the study.
    pub name: String,
    /// Title of the study.
    pub title: String,
    /// What it is set beside.
    pub reference: String,
    /// A remark for the report.
    pub note: String,
    /// What is computed.
    pub quantities: Vec<Quantity>,
    /// Parameters that do not vary.
    pub fixed: Values,
    /// Parameters that vary.
    pub sweeps: Vec<Sweep>,
    /// What distances are measured along.
    pub place: ViewKind,
    /// Radars on the vehicle.
    pub mounts: Vec<Mount>,
    /// Most facets met by one beam.
    pub bounces: usize,
    /// Error that curved bodies and finite ranges may have, dB.
    pub accuracy_db: f64,
    /// Which bounces radiate.
    pub convention: Convention,
    /// What is added at edges.
    pub diffraction: Diffraction,
    /// Of targets that are files.
    pub import: ImportOptions,
    /// What the least detectable cross section needs.
    pub detection: Option<Detection>,
    /// What is drawn.
    pub picture: PictureTable,
    /// Statements of a document.
    pub facts: Vec<Fact>,
    /// The search, where designs are sought.
    pub search: Option<SearchTable>,
    /// Grids have a quarter of their steps.
    pub quick: bool,
    /// The study's file.
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

    /// Number of points over all axes.
    pub fn points(&self) -> usize {
        self.sweeps.iter().map(|s| s.values.len()).product()
    }

    /// Options of the solver for a ground, a distance from the marker's foot and its height.
    ///
    /// # Errors
    /// A ground that no material is named after.
    pub fn options(&self, ground: &str, range_m: f64, height_m: f64) -> Result<RcsOptions> {
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
            height_m,
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
                self.options(parameter::word_of(&values, "ground").unwrap_or("none"), f64::INFINITY, 0.0)?;
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
    /// Elevation of the radar seen from the marker.
    ViewElevation,
    /// Distance of the radar from the marker.
    ViewRange,
    /// Of one metal ball.
    BallRcs,
    /// Number of metal balls.
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

    /// The quantity of this name.
    pub fn by_name(name: &str) -> Option<Quantity> {
        Quantity::ALL.into_iter().find(|q| q.1 == name).map(|q| q.0)
    }

    /// In pictures.
    pub fn label(self) -> &'static str {
        Quantity::ALL[self as usize].2
    }

    /// Whether cross sections are needed for it.
    pub fn needs_rcs(self) -> bool {
        matches!(self, Quantity::Rcs | Quantity::Margin | Quantity::BallRcs | Quantity::BallCount)
    }

    /// Whether a table `[detection]` is needed for it.
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
    /// Whether a table `[detection]` is needed for it.
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

    /// Its name in files.
    pub fn name(self) -> &'static str {
        self.words().0
    }

    /// Its label in pictures, with the unit.
    pub fn label(self) -> &'static str {
        self.words().1
    }
}

/// A parameter that is sought, with its limits.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitTable {
    /// Name of the parameter.
    pub name: At<String>,
    /// Least value.
    pub min: At<f64>,
    /// Largest value.
    pub max: At<f64>,
}

fn six() -> At<usize> {
    6.into()
}

fn forty() -> At<u64> {
    40.into()
}

/// A search for the parameters of the marker that serve a goal best.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SearchTable {
    /// The figure that the search makes as large as it can.
    pub goal: Goal,
    /// The parameter that costs; the best of the others is sought for each of its values.
    pub front: At<String>,
    /// Values of the parameter that costs.
    pub front_values: At<Vec<f64>>,
    /// Parameters to search, each with its limits.
    pub parameter: Vec<LimitTable>,
    /// Places from which to start (default 6).
    #[serde(default = "six")]
    pub starts: At<usize>,
    /// Steps of the simplex from each start (default 40).
    #[serde(default = "forty")]
    pub steps: At<u64>,
    /// Seed of the starts.
    #[serde(default)]
    pub seed: u64,
}

/// How a number is taken from the points that a fact chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FactKind {
    /// The one point.
    Value,
    /// The largest value.
    Maximum,
    /// The smallest value.
    Minimum,
    /// The mean.
    Mean,
    /// The median.
    Median,
    /// The greatest value less the least.
    Spread,
    /// The place of the maximum along the one axis that is left.
    Location,
    /// The width along the axis around the maximum, until `level` dB below it.
    Width,
    /// The largest place along the one axis at which the quantity crosses `level`.
    Crossing,
    /// The smallest place of that kind.
    FirstCrossing,
    /// The percentage of the points that lie at or above `level`.
    Share,
}

/// One row of a report.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    /// What the document states.
    pub text: String,
    /// Its number or words, where it gives any.
    pub document: Option<Value>,
    /// Unit of the number.
    pub unit: String,
    /// How the number is taken.
    pub kind: FactKind,
    /// Index into the outcome's fields.
    pub quantity: usize,
    /// (axis, value or name).
    pub at: Vec<(usize, Value)>,
    /// Axes and values of a point whose value is subtracted.
    pub minus: Vec<(usize, Value)>,
    /// (axis, limits).
    pub within: Vec<(usize, [f64; 2])>,
    /// The level that a width or a place is taken at.
    pub level: Option<f64>,
    /// Why ours differs, where it does.
    pub why: String,
}
