//! The study TOML: its keys, their checks, and the study that they describe.

use super::parameter::{self, TARGET_PREFIX, Value, Values};
use super::sigma_min::{Curve, Detection, GroundClutter, Magnitudes, noise_dbm};
use super::spec::{
    Fact, FactKind, Goal, PictureKind, PictureTable, Quantity, Reduce, SearchTable, Study, StudySweep,
};
use super::view::{Mount, ViewKind};
use catseye::base::convention::Convention;
use catseye::base::error::{BadInput, Error, Result, nearest};
use catseye::base::units::DEFAULT_FREQUENCY_HZ;
use catseye::rcs::Diffraction;
use catseye::road::target::is_file;
use catseye::scene::gltf::ImportOptions;
use catseye::scene::mesh_file::{self, ImportTable};
use catseye::scene::radar_toml;
use catseye::scene::toml_file::{At, Document, read_text};
use catseye::trace::MAX_BOUNCES;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A study file: quantities over sweeps of parameters. Lengths are in metres, angles in degrees.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "catseye study")]
pub struct StudyFile {
    /// Name of the study and of its files: letters, digits, '-', '_', '.'.
    pub name: At<String>,
    /// Title of plot and report.
    pub title: String,
    /// Publication that the study is compared with, as in "Feng 2019, figure 3.9".
    #[serde(default)]
    pub reference: String,
    /// Note for the report.
    #[serde(default)]
    pub note: String,
    /// Quantities to compute (default rcs_dbsm).
    #[serde(default)]
    pub quantities: Vec<At<String>>,
    /// Parameters with fixed values.
    #[serde(default)]
    pub set: BTreeMap<String, At<Value>>,
    /// Swept parameters: the first is the horizontal axis, the second gives the curves (or the vertical axis
    /// of a map), the third the panels.
    #[serde(default)]
    pub sweep: Vec<SweepTable>,
    /// Settings of the cross-section solver.
    #[serde(default)]
    pub solver: SolverTable,
    /// Settings for reading mesh files.
    pub import: Option<ImportKeys>,
    /// Data for sigma_min_dbsm and margin_db.
    pub detection: Option<DetectionTable>,
    /// Radars on the vehicle (default: one). A marker counts as detected if one of them detects it.
    #[serde(default)]
    pub mount: Vec<MountTable>,
    /// Settings of the plot.
    #[serde(default)]
    pub picture: PictureTable,
    /// Reference values of a publication to compare with.
    #[serde(default)]
    pub fact: Vec<FactTable>,
    /// Parameter optimisation in place of a table of the sweeps.
    pub search: Option<SearchTable>,
}

/// A swept parameter: its values, or start, stop and step.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepTable {
    /// Name of the parameter, or target.NAME for a parameter of the reflector.
    pub parameter: At<String>,
    /// First value of the grid.
    pub start: Option<At<f64>>,
    /// Last value of the grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<At<f64>>,
    /// Step of the grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<At<f64>>,
    /// List of values; alternative to a grid.
    pub values: Option<At<Vec<Value>>>,
    /// Names of the values in legend, reference values and CSV.
    pub names: Option<At<Vec<String>>>,
    /// Label of the axis.
    pub label: Option<String>,
    /// Reduction of the sweep to one number, in place of an axis.
    pub reduce: Option<At<Reduce>>,
}

/// Settings for reading mesh files.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImportKeys {
    /// Unit of length: m (default for glTF; required for STL and OBJ), cm, mm, in or ft.
    pub unit: Option<At<String>>,
    /// Up axis: y (default for glTF; required for STL and OBJ) or z.
    pub up: Option<At<String>>,
    /// Animations of the file that are played: all (default), none, or the name of one.
    pub animation: Option<At<String>>,
    /// Crease angle: edges at which adjacent facets turn by more than this are creases, degrees (default 30; with 0 every facet is flat).
    pub smooth_deg: Option<At<f64>>,
    /// Radar material of surfaces whose material is missing or unknown; required for STL.
    pub default_material: Option<At<String>>,
    /// Map from the file's material names to radar materials of the table.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, At<String>>,
}

impl<'a> From<&'a ImportKeys> for ImportTable<'a> {
    fn from(t: &'a ImportKeys) -> Self {
        ImportTable {
            unit: &t.unit,
            up: &t.up,
            animation: &t.animation,
            smooth_deg: &t.smooth_deg,
            default_material: &t.default_material,
            materials: &t.materials,
        }
    }
}

/// Settings of the cross-section solver.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverTable {
    /// Maximum number of bounces of one beam (default 3).
    #[schemars(range(min = 1, max = MAX_BOUNCES))]
    pub bounces: usize,
    /// Error allowed for curved surfaces and finite ranges, dB (default 0.1).
    #[schemars(range(min = 1e-4, max = 3.0))]
    pub accuracy_db: f64,
    /// Bounces that radiate: "every" (default) or "last".
    pub convention: Convention,
    /// Edge diffraction: "none" (default) or "ptd".
    pub diffraction: DiffractionName,
}

impl Default for SolverTable {
    fn default() -> Self {
        let (convention, diffraction) = (Convention::Every, DiffractionName::None);
        SolverTable { bounces: 3, accuracy_db: 0.1, convention, diffraction }
    }
}

/// Edge diffraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DiffractionName {
    /// No edge diffraction.
    None,
    /// Physical theory of diffraction.
    Ptd,
}

/// Data for sigma_min = sigma_ref - (M_ref - max(M_ground, M_noise + SNR)) + antenna compensation.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DetectionTable {
    /// Preset or radar file: gives the antenna patterns, and for the radar equation all other values.
    pub radar: At<String>,
    /// Source of the received magnitudes.
    pub method: MethodName,
    /// Radar cross section of the reference, dBsm.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub reference_rcs_dbsm: f64,
    /// Height of the reference above the radar in the measurement, m.
    #[serde(default)]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub reference_rise_m: f64,
    /// "measured": [q1, q2] of 20 lg(1/R^q1) + q2 fitted to the maxima of the reference's magnitude.
    pub peaks_fit: Option<At<[f64; 2]>>,
    /// "measured": [q1, q2] of the same curve fitted to its minima.
    pub troughs_fit: Option<At<[f64; 2]>>,
    /// "measured": curve of [range in m, magnitude in dB], in place of the fits.
    pub reference_db: Option<At<Vec<[f64; 2]>>>,
    /// "measured": magnitude of the noise, dB.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub noise_db: Option<At<f64>>,
    /// "measured": magnitude of the ground as a curve of [range in m, magnitude in dB].
    pub ground_db: Option<At<Vec<[f64; 2]>>>,
    /// "radar-equation": backscatter coefficient of the ground (cross section per area), dB.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub ground_sigma0_db: Option<At<f64>>,
    /// "radar-equation": azimuth width of the ground area in one cell, degrees.
    #[schemars(range(max = 180.0), extend("exclusiveMinimum" = 0.0))]
    pub ground_beam_deg: Option<At<f64>>,
}

/// Source of the magnitudes for sigma_min.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    /// A measured curve.
    Measured,
    /// The radar equation.
    RadarEquation,
}

/// One of several radars on the vehicle.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MountTable {
    /// Distance forward of the position that the parameters give, m.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub forward_m: f64,
    /// Distance to the left of that position, m.
    #[serde(default)]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub left_m: f64,
    /// Angle added to radar_azimuth_deg, degrees, positive to the left.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub azimuth_deg: f64,
    /// Angle added to radar_elevation_deg, degrees, positive upwards.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub elevation_deg: f64,
}

/// A reference value: a number of a publication that is compared with the result of this study.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FactTable {
    /// Description of the reference value.
    pub text: String,
    /// The publication's number, or its words.
    pub document: Option<At<Value>>,
    /// Unit of the number.
    #[serde(default)]
    pub unit: String,
    /// Statistic by which this study's number is computed from the selected points.
    pub of: FactKind,
    /// Quantity of the number (default: the first that the study computes).
    pub quantity: Option<At<String>>,
    /// Position on each axis: a number (interpolated) or a value's name.
    #[serde(default)]
    pub at: BTreeMap<String, At<Value>>,
    /// Second position on the axes; the number there is subtracted.
    #[serde(default)]
    pub minus: BTreeMap<String, At<Value>>,
    /// Ranges of axes, each as [lowest, highest]; points outside are excluded.
    #[serde(default)]
    pub within: BTreeMap<String, At<[f64; 2]>>,
    /// Threshold: for `width` in dB below the maximum, for `crossing` and `share` the value itself.
    pub level: Option<At<f64>>,
    /// Explanation of the difference between the two numbers, for the report.
    #[serde(default)]
    pub why: String,
}

/// Largest number of points of a study.
pub const MOST_POINTS: usize = 4_000_000;

/// Thins a grid for `--quick`: a quarter of the steps, evenly between the same ends.
fn thinned(values: Vec<f64>) -> Vec<f64> {
    const LESS: usize = 4;
    let steps = values.len().saturating_sub(1);
    if steps < 2 * LESS {
        return values;
    }
    let (first, last, n) = (values[0], values[steps], steps.div_ceil(LESS));
    let step = (last - first) / n as f64;
    (0..=n).map(|i| on_grain(first + step * i as f64, step)).collect()
}

/// Loads the study of a TOML file. With `quick`, grids are four times as coarse.
///
/// # Errors
/// Returns `BadInput` with line and key for anything with which the study cannot run.
pub fn load(path: &Path, quick: bool) -> Result<Study> {
    parse(path, &read_text(path)?, quick)
}

/// Parses a study from text. `file` is named in errors, and other files are looked for beside it.
///
/// # Errors
/// Returns `BadInput` with file, line and remedy for a key or value that is not valid in a study.
pub fn parse(file: &Path, text: &str, quick: bool) -> Result<Study> {
    let doc = Document::parse(file, text)?;
    let table: StudyFile = doc.read()?;
    Reader { doc: &doc, table: &table, quick }.study(text)
}

struct Reader<'a> {
    doc: &'a Document<'a>,
    table: &'a StudyFile,
    quick: bool,
}

impl Reader<'_> {
    /// Adds the place of `at` in the file to the error `b`.
    fn here<T>(&self, at: &At<T>, b: BadInput) -> Error {
        b.placed(self.doc.bad(&at.span, "")).into()
    }

    /// Returns an error about a value of the file.
    fn refused<R, T>(&self, at: &At<T>, problem: &str, remedy: &str) -> Result<R> {
        Err(self.here(at, BadInput::new(problem).remedy(remedy)))
    }

    /// Makes an error about a key that may be missing.
    fn about(&self, key: &str, problem: &str) -> BadInput {
        BadInput::new(problem).file(self.doc.file()).key(key)
    }

    /// Makes an error about a missing key.
    fn missing(&self, key: &str, remedy: &str) -> Error {
        self.about(key, "is missing").remedy(remedy).into()
    }

    /// Returns an error about a value of the file, with the allowed values.
    fn only<R, T>(&self, at: &At<T>, problem: impl Into<String>, allowed: impl Into<String>) -> Result<R> {
        Err(self.here(at, BadInput::new(problem).allowed(allowed)))
    }

    fn inside(&self, e: Error) -> Error {
        match e {
            Error::Input(b) if b.file.is_none() => (*b).file(self.doc.file()).into(),
            e => e,
        }
    }

    fn study(&self, source: &str) -> Result<Study> {
        let t = self.table;
        let name = &t.name.value;
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if name.is_empty() || name.len() > 80 || !name.chars().all(plain) || name.starts_with('.') {
            let allowed = "up to 80 letters, digits, '-', '_' and '.', not starting with '.'";
            return self.only(&t.name, "is not a valid file name", allowed);
        }
        let quantities = self.quantities()?;
        let mut fixed = Values::new();
        for (key, at) in &t.set {
            if key.starts_with(TARGET_PREFIX) {
                let remedy = "write target = \"KIND:name=value,…\"";
                return self.refused(at, "belongs in the text of target", remedy);
            }
            parameter::check(key, &at.value).map_err(|b| self.here(at, b))?;
            if let ("target", Value::Word(target)) = (key.as_str(), &at.value) {
                self.target(target, &at.span)?;
            }
            fixed.insert(key.clone(), at.value.clone());
        }
        let sweeps = t.sweep.iter().map(|s| self.sweep(s, &fixed)).collect::<Result<Vec<_>>>()?;
        for (i, s) in sweeps.iter().enumerate() {
            if sweeps[..i].iter().any(|o| o.parameter == s.parameter) {
                return self.refused(&t.sweep[i].parameter, "is swept twice", "keep one");
            }
        }
        let default = |fixed: &mut Values, name: &str, value: Value| {
            if !sweeps.iter().any(|s| s.parameter == name) {
                fixed.entry(name.into()).or_insert(value);
            }
        };
        default(&mut fixed, "frequency_hz", Value::Number(DEFAULT_FREQUENCY_HZ));
        default(&mut fixed, "polarisation", Value::Word("vv".into()));
        default(&mut fixed, "ground", Value::Word("none".into()));
        let searched: Vec<&str> =
            t.search.iter().flat_map(|s| s.parameter.iter().map(|p| p.name.value.as_str())).collect();
        let names = fixed.keys().map(String::as_str).chain(sweeps.iter().map(|s| s.parameter.as_str()));
        let place = ViewKind::of(names.chain(searched)).map_err(|b| Error::from(b.file(self.doc.file())))?;
        let axes = sweeps.iter().filter(|s| s.reduce.is_none()).count();
        if t.search.is_none() {
            if axes == 0 {
                let remedy = "give a [[sweep]] with a parameter and its values";
                return Err(self.about("sweep", "nothing varies").remedy(remedy).into());
            }
            if axes > 3 {
                let bad = self
                    .about("sweep", "there are more sweeps than a plot has axes, curves and panels")
                    .value(axes);
                let bad = bad.allowed("up to 3 that are not reduced");
                return Err(bad.remedy("fix or reduce some, or write two studies").into());
            }
        }
        let points = sweeps.iter().fold(1usize, |n, s| n.saturating_mul(s.values.len()));
        if points > MOST_POINTS {
            let bad = self.about("sweep", "the sweeps have too many points").value(points);
            let bad = bad.allowed(format!("up to {MOST_POINTS}"));
            return Err(bad.remedy("use larger steps or split the study").into());
        }
        let s = &t.solver;
        let detection = t.detection.as_ref().map(|d| self.detection(d)).transpose()?;
        let needs = quantities.iter().any(|q| q.needs_detection())
            || t.search.as_ref().is_some_and(|s| s.goal.needs_detection());
        if needs && detection.is_none() {
            return Err(self.missing("detection", "sigma_min_dbsm and margin_db need a [detection] table"));
        }
        let mut study = Study {
            name: name.clone(),
            title: t.title.clone(),
            reference: t.reference.clone(),
            note: t.note.clone(),
            quantities,
            fixed,
            sweeps,
            place,
            mounts: self.mounts(),
            bounces: s.bounces,
            accuracy_db: s.accuracy_db,
            convention: s.convention,
            diffraction: match s.diffraction {
                DiffractionName::None => Diffraction::None,
                DiffractionName::Ptd => Diffraction::Ptd,
            },
            import: self.import()?,
            detection,
            picture: self.picture()?,
            facts: Vec::new(),
            search: None,
            quick: self.quick,
            file: self.doc.file().to_path_buf(),
            source: source.to_string(),
        };
        self.check_reduce(&study)?;
        if let Some(s) = &t.search {
            self.search(s, &study)?;
            study.search = Some(s.clone());
        }
        study.check_points().map_err(|e| self.inside(e))?;
        study.facts = t.fact.iter().map(|f| self.fact(f, &study)).collect::<Result<_>>()?;
        self.check_picture(&study)?;
        Ok(study)
    }

    fn quantities(&self) -> Result<Vec<Quantity>> {
        let mut out = Vec::new();
        for q in &self.table.quantities {
            let found = self.quantity(q)?;
            if out.contains(&found) {
                return self.refused(q, "is listed twice", "keep one");
            }
            out.push(found);
        }
        if out.is_empty() {
            out.push(Quantity::Rcs);
        }
        Ok(out)
    }

    /// Options for reading mesh files, from the table.
    fn import(&self) -> Result<ImportOptions> {
        let table = self.table.import.as_ref();
        table.map_or_else(|| Ok(ImportOptions::default()), |t| ImportTable::from(t).options(self.doc))
    }

    /// Returns an error if the target is a file that is missing or that states no unit.
    fn target(&self, target: &str, span: &std::ops::Range<usize>) -> Result<()> {
        if !is_file(target) {
            return Ok(());
        }
        self.doc.existing(span, &self.doc.file().parent().unwrap_or(Path::new("")).join(target))?;
        mesh_file::check_stated(self.doc, span, target, &self.import()?)
    }

    fn quantity(&self, at: &At<String>) -> Result<Quantity> {
        Quantity::by_name(&at.value).ok_or_else(|| {
            let names = Quantity::names();
            let near = nearest(&at.value, names.iter().copied());
            let remedy = near.map_or("choose one of them".into(), |n| format!("did you mean '{n}'?"));
            self.here(at, BadInput::new("is not a quantity").allowed(names.join(", ")).remedy(remedy))
        })
    }

    fn sweep(&self, t: &SweepTable, fixed: &Values) -> Result<StudySweep> {
        let name = t.parameter.value.clone();
        if fixed.contains_key(&name) {
            return self.refused(&t.parameter, "is set and swept", "keep one of the two");
        }
        if !name.starts_with(TARGET_PREFIX) && parameter::find(&name).is_none() {
            return Err(self.here(&t.parameter, parameter::unknown(&name)));
        }
        let values = match (&t.values, &t.start, &t.stop, &t.step) {
            (Some(v), None, None, None) => {
                if v.value.is_empty() {
                    return self.refused(v, "the list is empty", "give values");
                }
                for x in &v.value {
                    parameter::check(&name, x).map_err(|b| self.here(v, b))?;
                    if let ("target", Value::Word(target)) = (name.as_str(), x) {
                        self.target(target, &v.span)?;
                    }
                }
                v.value.clone()
            }
            (None, Some(a), Some(b), Some(step)) => {
                let grid = grid(a.value, b.value, step.value).map_err(|e| self.here(step, e))?;
                let grid = if self.quick { thinned(grid) } else { grid };
                let grid: Vec<Value> = grid.into_iter().map(Value::Number).collect();
                for x in &grid {
                    parameter::check(&name, x).map_err(|b| self.here(a, b))?;
                }
                grid
            }
            _ => {
                let allowed = "values, or all of start, stop, step";
                return self.only(&t.parameter, "the sweep has no values", allowed);
            }
        };
        let names = match &t.names {
            Some(n) if n.value.len() == values.len() && t.values.is_some() => n.value.clone(),
            Some(n) => {
                let problem = format!("has {} names for {} values", n.value.len(), values.len());
                return self.only(n, problem, "one name for each entry of values");
            }
            None => values.iter().map(Value::to_string).collect(),
        };
        Ok(StudySweep {
            label: t.label.clone().unwrap_or_else(|| parameter::label(&name)),
            parameter: name,
            values,
            names,
            reduce: t.reduce.as_ref().map(|r| r.value),
        })
    }

    fn check_reduce(&self, study: &Study) -> Result<()> {
        for (t, s) in self.table.sweep.iter().zip(&study.sweeps) {
            let (Some(at), Some(reduce)) = (&t.reduce, s.reduce) else { continue };
            if !matches!(reduce, Reduce::DetectionRange | Reduce::UnbrokenRange) {
                continue;
            }
            if study.quantities != [Quantity::Margin] {
                let bad = BadInput::new("a detection range needs margin_db")
                    .allowed("quantities = [\"margin_db\"]");
                return Err(self.here(at, bad.remedy("list only margin_db in quantities")));
            }
            let ascending = s.numbers().is_some_and(|x| x.windows(2).all(|w| w[0] < w[1]));
            if !ascending || s.values.len() < 2 {
                return self.refused(
                    at,
                    "a detection range needs distances in ascending order",
                    "sweep longitudinal_m",
                );
            }
            if study.sweeps.iter().filter(|o| o.reduce.is_some()).count() > 1 {
                let problem = "a detection range excludes other reductions";
                return self.refused(at, problem, "keep one");
            }
        }
        Ok(())
    }

    fn mounts(&self) -> Vec<Mount> {
        let mounts = self.table.mount.iter().map(|m| Mount {
            forward_m: m.forward_m,
            left_m: m.left_m,
            azimuth_rad: m.azimuth_deg.to_radians(),
            elevation_rad: m.elevation_deg.to_radians(),
        });
        match self.table.mount.is_empty() {
            true => vec![Mount::default()],
            false => mounts.collect(),
        }
    }

    fn picture(&self) -> Result<PictureTable> {
        let p = &self.table.picture;
        if let Some(l) = &p.limits
            && !(l.value[0] < l.value[1] && l.value.iter().all(|x| x.is_finite()))
        {
            return Err(self.here(l, BadInput::new("must be two numbers in ascending order")));
        }
        Ok(p.clone())
    }

    fn check_picture(&self, study: &Study) -> Result<()> {
        if study.picture.kind != PictureKind::Map || study.search.is_some() {
            return Ok(());
        }
        let axes: Vec<&StudySweep> = study.sweeps.iter().filter(|s| s.reduce.is_none()).collect();
        let bad = |problem: &str| {
            let bad = self.about("picture.kind", problem).value("map");
            let bad = bad.allowed("two sweeps of evenly spaced numbers first");
            Err(bad.remedy("use kind = \"curves\", or a grid").into())
        };
        if axes.len() < 2 {
            return bad("a map has two axes");
        }
        for s in &axes[..2] {
            let x: Vec<f64> = s.values.iter().map(|v| v.number().unwrap_or(f64::NAN)).collect();
            let step = (x[x.len() - 1] - x[0]) / (x.len().max(2) - 1) as f64;
            // A word on the axis is NaN and on no grid.
            let on_grid = |(i, v): (usize, &f64)| (v - x[0] - i as f64 * step).abs() <= 1e-6 * step.abs();
            if !x.iter().enumerate().all(on_grid) {
                return bad("the axis of a map is evenly spaced");
            }
        }
        Ok(())
    }

    fn detection(&self, d: &DetectionTable) -> Result<Detection> {
        let radar = radar_toml::named(self.doc, &d.radar.value, &d.radar.span)?;
        let doc = self.doc;
        let missing = |key: &str, remedy: &str| self.missing(&format!("detection.{key}"), remedy);
        let belongs = |span: &std::ops::Range<usize>, to: &str| -> Error {
            doc.bad(span, format!("applies only to method = \"{to}\"")).remedy("remove the key").into()
        };
        let curve = |c: &At<Vec<[f64; 2]>>| -> Result<Vec<[f64; 2]>> {
            let sound = !c.value.is_empty()
                && c.value.iter().all(|p| p[0] > 0.0 && p.iter().all(|x| x.is_finite()))
                && c.value.windows(2).all(|w| w[0][0] < w[1][0]);
            match sound {
                true => Ok(c.value.clone()),
                false => self.only(c, "is not a curve", "[[range in m, dB], …] with ascending ranges"),
            }
        };
        let magnitudes = match d.method {
            MethodName::Measured => {
                if let Some(s) = d.ground_sigma0_db.as_ref().or(d.ground_beam_deg.as_ref()) {
                    return Err(belongs(&s.span, "radar-equation"));
                }
                let reference = match (&d.peaks_fit, &d.troughs_fit, &d.reference_db) {
                    (Some(a), Some(b), None) => Curve::Fits([a.value, b.value]),
                    (None, None, Some(p)) => Curve::Points(curve(p)?),
                    _ => {
                        return Err(missing(
                            "reference_db",
                            "give reference_db, or both peaks_fit and troughs_fit",
                        ));
                    }
                };
                let noise = d.noise_db.as_ref();
                Magnitudes::Measured {
                    reference,
                    noise_db: noise.ok_or_else(|| missing("noise_db", "give the noise's magnitude"))?.value,
                    ground: d.ground_db.as_ref().map(curve).transpose()?,
                }
            }
            MethodName::RadarEquation => {
                let fits = d.peaks_fit.as_ref().or(d.troughs_fit.as_ref()).map(|a| &a.span);
                let of_reference = d.reference_db.as_ref().map(|a| &a.span);
                let noise = d.noise_db.as_ref().map(|a| &a.span);
                let ground = d.ground_db.as_ref().map(|a| &a.span);
                if let Some(span) = fits.or(of_reference).or(noise).or(ground) {
                    return Err(belongs(span, "measured"));
                }
                let ground = match (&d.ground_sigma0_db, &d.ground_beam_deg) {
                    (Some(s), Some(b)) => Some(GroundClutter {
                        sigma0_db: s.value,
                        beam_rad: b.value.to_radians(),
                        cell_m: radar.range_bin_m(),
                    }),
                    (None, None) => None,
                    (Some(_), None) => {
                        return Err(missing("ground_beam_deg", "give the width of the patch of ground"));
                    }
                    (None, Some(_)) => {
                        let remedy = "give the cross section per area of the patch of ground";
                        return Err(missing("ground_sigma0_db", remedy));
                    }
                };
                Magnitudes::RadarEquation { noise_dbm: noise_dbm(&radar)?, ground }
            }
        };
        let snr = self.table.set.contains_key("snr_db")
            || self.table.sweep.iter().any(|s| s.parameter.value == "snr_db");
        if !snr {
            let remedy = "give the signal-to-noise ratio at which a marker counts as detected, as in 10";
            return Err(self.missing("set.snr_db", remedy));
        }
        Ok(Detection {
            magnitudes,
            reference_dbsm: d.reference_rcs_dbsm,
            reference_rise_m: d.reference_rise_m,
            radar,
        })
    }

    fn search(&self, t: &SearchTable, study: &Study) -> Result<()> {
        let own = |at: &At<String>| -> Result<()> {
            let n = &at.value;
            if study.fixed.contains_key(n) || study.sweeps.iter().any(|s| &s.parameter == n) {
                return self.refused(at, "is also set or swept", "keep one of the two");
            }
            let is_number =
                matches!(parameter::find(n).map(|p| p.kind), Some(parameter::Kind::Number { .. }));
            if n.starts_with(TARGET_PREFIX) || is_number {
                return Ok(());
            }
            Err(self.here(at, parameter::unknown(n)))
        };
        own(&t.front)?;
        let front = &t.front_values;
        if front.value.is_empty() || !front.value.iter().all(|x| x.is_finite()) {
            return self.refused(front, "must be finite numbers", "give some");
        }
        for (i, p) in t.parameter.iter().enumerate() {
            own(&p.name)?;
            if p.name == t.front || t.parameter[..i].iter().any(|l| l.name == p.name) {
                return self.refused(&p.name, "is listed twice", "keep one of them");
            }
            if !(p.min.value.is_finite() && p.max.value.is_finite() && p.min.value < p.max.value) {
                let remedy = "give a fixed parameter in target";
                return self.refused(&p.max, "must be larger than min", remedy);
            }
        }
        let distances = |s: &StudySweep| s.parameter == "longitudinal_m" && s.values.len() > 1;
        if t.goal == Goal::DetectionRange && !study.sweeps.iter().any(distances) {
            let bad = self.about("search.goal", "a detection range needs distances");
            return Err(bad.remedy("sweep longitudinal_m").into());
        }
        Ok(())
    }

    fn fact(&self, t: &FactTable, study: &Study) -> Result<Fact> {
        let quantity = match &t.quantity {
            Some(q) => {
                let found = self.quantity(q)?;
                study.quantities.iter().position(|x| *x == found).ok_or_else(|| {
                    self.here(q, BadInput::new("is not computed here").remedy("add it to quantities"))
                })?
            }
            None => 0,
        };
        let axes: Vec<&StudySweep> = study.sweeps.iter().filter(|s| s.reduce.is_none()).collect();
        let on_axis = |key: &str, at: &dyn Fn(BadInput) -> Error| -> Result<usize> {
            axes.iter().position(|s| s.parameter == key).ok_or_else(|| {
                let names: Vec<&str> = axes.iter().map(|s| s.parameter.as_str()).collect();
                at(BadInput::new(format!("{key} is not an axis of the result")).allowed(names.join(", ")))
            })
        };
        let chosen = |map: &BTreeMap<String, At<Value>>| -> Result<Vec<(usize, Value)>> {
            map.iter()
                .map(|(key, at)| {
                    let i = on_axis(key, &|b| self.here(at, b))?;
                    let s = axes[i];
                    let named = s.names.iter().any(|n| *n == at.value.to_string());
                    let between = at.value.number().zip(s.numbers()).is_some_and(|(x, numbers)| {
                        let lo = numbers.iter().copied().fold(f64::INFINITY, f64::min);
                        let hi = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                        (lo - 1e-9..=hi + 1e-9).contains(&x)
                    });
                    if !named && !between {
                        let names = s.names.iter().take(12).cloned().collect::<Vec<_>>().join(", ");
                        return self.only(at, format!("the sweep of {key} has no such value"), names);
                    }
                    Ok((i, at.value.clone()))
                })
                .collect()
        };
        let within = t.within.iter().map(|(key, at)| Ok((on_axis(key, &|b| self.here(at, b))?, at.value)));
        let within = within.collect::<Result<Vec<_>>>()?;
        let fact = Fact {
            text: t.text.clone(),
            document: t.document.as_ref().map(|d| d.value.clone()),
            unit: t.unit.clone(),
            kind: t.of,
            quantity,
            at: chosen(&t.at)?,
            minus: chosen(&t.minus)?,
            within,
            level: t.level.as_ref().map(|l| self.doc.finite(l, "give a number")).transpose()?,
            why: t.why.clone(),
        };
        if study.search.is_none() {
            fact.check(axes.len()).map_err(|b| {
                Error::from(b.file(self.doc.file()).key("fact").value(format!("\"{}\"", t.text)))
            })?;
        }
        Ok(fact)
    }
}

/// Values `start`, `start + step`, … up to and including `stop`.
fn grid(start: f64, stop: f64, step: f64) -> Result<Vec<f64>, BadInput> {
    if ![start, stop, step].iter().all(|x| x.is_finite()) || step == 0.0 || (stop - start) / step < 0.0 {
        return Err(BadInput::new("the step does not lead from start to stop"));
    }
    let steps = ((stop - start) / step * (1.0 + 1e-12) + 1e-9).floor();
    if steps >= MOST_POINTS as f64 {
        return Err(BadInput::new(format!("the sweep has too many values ({:.0})", steps + 1.0))
            .allowed(format!("up to {MOST_POINTS}"))
            .remedy("use a larger step"));
    }
    Ok((0..=steps as usize).map(|i| on_grain(start + i as f64 * step, step)).collect())
}

/// Rounded to a billionth of the step: 0.30000000000000004 would end up in files.
fn on_grain(x: f64, step: f64) -> f64 {
    parameter::rounded_to(x, step.abs().log10().floor() as i32 - 9)
}

/// JSON schema of the study TOML, as text.
pub fn schema() -> String {
    serde_json::to_string_pretty(&schemars::schema_for!(StudyFile)).unwrap_or_default() + "\n"
}
