//! A checked study: what varies, what is computed and drawn, what is compared with a document, what is
//! sought.

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

/// Reduction of an axis to one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reduce {
    /// Mean of the values in dB.
    MeanDb,
    /// Mean of the linear powers, in dB.
    MeanPower,
    /// Maximum.
    Maximum,
    /// Minimum.
    Minimum,
    /// Maximum distance at which margin_db is not negative.
    DetectionRange,
    /// Distance at which margin_db first becomes negative after it was not.
    UnbrokenRange,
}

/// Kind of plot of a study.
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
pub struct StudySweep {
    /// Name of the parameter.
    pub parameter: String,
    /// Label in pictures, with the unit.
    pub label: String,
    /// Values of the parameter.
    pub values: Vec<Value>,
    /// Names of the values, one for each.
    pub names: Vec<String>,
    /// Method of reducing the axis; None where it remains.
    pub reduce: Option<Reduce>,
}

impl StudySweep {
    /// The numbers along the sweep, or None when a word is among them.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        self.values.iter().map(Value::number).collect()
    }

    /// The numbers along the sweep; 0, 1, 2, … when a word is among them.
    pub fn places(&self) -> Vec<f64> {
        self.numbers().unwrap_or_else(|| (0..self.values.len()).map(|i| i as f64).collect())
    }
}

fn two() -> usize {
    2
}

/// Settings of the plot.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PictureTable {
    /// Kind of plot (default: curves).
    #[serde(default)]
    pub kind: PictureKind,
    /// Limits of the quantity, in dB or its own unit, for the vertical axis or the colour scale.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limits: Option<At<[f64; 2]>>,
    /// Number of panels side by side (default 2).
    #[serde(default = "two")]
    #[schemars(range(min = 1, max = 6))]
    pub columns: usize,
    /// Contour values on a map.
    #[serde(default)]
    pub contours: Vec<f64>,
}

impl Default for PictureTable {
    fn default() -> Self {
        PictureTable { kind: PictureKind::Curves, limits: None, columns: two(), contours: Vec::new() }
    }
}

impl PictureTable {
    /// Limits of the values' axis, where they are set.
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
    /// Source that the study is compared with.
    pub reference: String,
    /// A remark for the report.
    pub note: String,
    /// Quantities that are computed.
    pub quantities: Vec<Quantity>,
    /// Parameters that do not vary.
    pub fixed: Values,
    /// Parameters that vary.
    pub sweeps: Vec<StudySweep>,
    /// Kind of place of radar and marker.
    pub place: ViewKind,
    /// Radars on the vehicle.
    pub mounts: Vec<Mount>,
    /// Largest number of facets met by one beam.
    pub bounces: usize,
    /// Error allowed for curved bodies and finite ranges, dB.
    pub accuracy_db: f64,
    /// Which bounces radiate.
    pub convention: Convention,
    /// Diffraction that is added at edges.
    pub diffraction: Diffraction,
    /// Options for reading targets from files.
    pub import: ImportOptions,
    /// Data for the least detectable cross section.
    pub detection: Option<Detection>,
    /// Settings of the plot.
    pub picture: PictureTable,
    /// Reference values of a publication to compare with.
    pub facts: Vec<Fact>,
    /// The search, where designs are sought.
    pub search: Option<SearchTable>,
    /// Whether grids have a quarter of their steps.
    pub quick: bool,
    /// Path of the study's file.
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

    /// Options of the solver for a ground, a distance from the marker's foot (m) and a height of its origin
    /// (m).
    ///
    /// # Errors
    /// Returns an error if `ground` names no material.
    pub fn options(&self, ground: &str, range_m: f64, height_m: f64) -> Result<RcsOptions> {
        let ground = match ground {
            "none" => Ground::None,
            name => Ground::Plane(material::parse_spec(name)?),
        };
        Ok(RcsOptions {
            bounces: self.bounces,
            most_bounces: self.bounces,
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

    /// Checks each point once, so that errors come before the work.
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

/// A quantity that a study may compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Radar cross section in the chosen polarisation, dBsm.
    Rcs,
    /// Least detectable cross section of the best radar, dBsm.
    SigmaMin,
    /// Cross section minus the least detectable one, of the best radar, dB.
    Margin,
    /// Azimuth of the radar seen from the marker.
    ViewAzimuth,
    /// Elevation of the radar seen from the marker.
    ViewElevation,
    /// Distance of the radar from the marker.
    ViewRange,
    /// Radar cross section of one metal sphere.
    BallRcs,
    /// Number of metal spheres.
    BallCount,
}

impl Quantity {
    /// All quantities, each with its name in files and its label in pictures.
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

    /// Names of all quantities.
    pub fn names() -> [&'static str; 8] {
        Quantity::ALL.map(|q| q.1)
    }

    /// Its name in files.
    pub fn name(self) -> &'static str {
        Quantity::ALL[self as usize].1
    }

    /// The quantity of this name.
    pub fn by_name(name: &str) -> Option<Quantity> {
        Quantity::ALL.into_iter().find(|q| q.1 == name).map(|q| q.0)
    }

    /// Its label in pictures.
    pub fn label(self) -> &'static str {
        Quantity::ALL[self as usize].2
    }

    /// Whether it needs cross sections.
    pub fn needs_rcs(self) -> bool {
        matches!(self, Quantity::Rcs | Quantity::Margin | Quantity::BallRcs | Quantity::BallCount)
    }

    /// Whether it needs a table `[detection]`.
    pub fn needs_detection(self) -> bool {
        matches!(self, Quantity::SigmaMin | Quantity::Margin)
    }
}

/// Quantity that an optimisation maximises. Its window is all points of the study's sweeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Goal {
    /// Percentage of the window in which the marker is detected.
    Coverage,
    /// Minimum margin over the minimum detectable cross section in the window.
    LeastMargin,
    /// Minimum cross section in the window.
    LeastRcs,
    /// Maximum detection distance, in the worst case of the other sweeps.
    DetectionRange,
}

impl Goal {
    /// Whether it needs a table `[detection]`.
    pub fn needs_detection(self) -> bool {
        self != Goal::LeastRcs
    }

    /// Its name in files, and its label in pictures.
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

/// A parameter to optimise, with its limits.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitTable {
    /// Name of the parameter.
    pub name: At<String>,
    /// Minimum.
    pub min: At<f64>,
    /// Maximum.
    pub max: At<f64>,
}

fn six() -> usize {
    6
}

fn forty() -> u64 {
    40
}

/// Optimisation of the marker's parameters.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SearchTable {
    /// Quantity to maximise.
    pub goal: Goal,
    /// Name of the cost parameter; the other parameters are optimised for each of its values.
    pub front: At<String>,
    /// Values of the cost parameter.
    pub front_values: At<Vec<f64>>,
    /// Parameters to optimise, each with its limits.
    #[schemars(length(min = 1, max = 8))]
    pub parameter: Vec<LimitTable>,
    /// Number of start points (default 6).
    #[serde(default = "six")]
    #[schemars(range(min = 1, max = 1000))]
    pub starts: usize,
    /// Number of steps of the simplex (Nelder-Mead) from each start point (default 40).
    #[serde(default = "forty")]
    #[schemars(range(min = 1, max = 10_000))]
    pub steps: u64,
    /// Seed of the start points.
    #[serde(default)]
    pub seed: u64,
}

/// Statistic of the selected points of a reference value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FactKind {
    /// Value at the selected point.
    Value,
    /// Maximum.
    Maximum,
    /// Minimum.
    Minimum,
    /// Mean.
    Mean,
    /// Median.
    Median,
    /// Maximum minus minimum.
    Spread,
    /// Position of the maximum along the remaining axis.
    Location,
    /// Width along the axis around the maximum, down to `level` dB below it.
    Width,
    /// Largest position along the axis at which the quantity crosses `level`.
    Crossing,
    /// Smallest position along the axis at which the quantity crosses `level`.
    FirstCrossing,
    /// Percentage of the points at or above `level`.
    Share,
}

/// A statement of a document and how this study's number for it is taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    /// Description of the reference value.
    pub text: String,
    /// The document's number or words, where it gives any.
    pub document: Option<Value>,
    /// Unit of the number.
    pub unit: String,
    /// How the number is taken.
    pub kind: FactKind,
    /// Index into the outcome's fields.
    pub quantity: usize,
    /// Place on the axes as (axis, value or name).
    pub at: Vec<(usize, Value)>,
    /// Axes and values of a point whose value is subtracted.
    pub minus: Vec<(usize, Value)>,
    /// Limits of axes as (axis, [lowest, highest]).
    pub within: Vec<(usize, [f64; 2])>,
    /// Level for a width, a crossing or a share.
    pub level: Option<f64>,
    /// The reason why the two numbers differ, where they do.
    pub why: String,
}
