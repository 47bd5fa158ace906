//! Solves the cross sections that a study needs: each different one once, in batches, kept on disk as they
//! are finished.

use super::parameter::{TARGET_PREFIX, Value, Values, number_of, word_of};
use super::view::View;
use catseye::base::convention::Convention;
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::frames::{Pose, Target};
use catseye::base::matrix::Matrix2;
use catseye::em::sphere_marking::{BinShape, Marking, bin_share, mie_m2};
use catseye::engine::Purpose;
use catseye::engine::solver::Solver;
use catseye::formats::stage::{sha256_of_bytes, sha256_of_file, write_file};
use catseye::rcs::validity::Faces;
use catseye::rcs::{Aspect, BistaticAspect, Distance, RcsOptions, Scattering};
use catseye::road::reflector::Reflector;
use catseye::road::target::is_file;
use catseye::scene::gltf::ImportOptions;
use catseye::scene::{Scene, material, mesh_file};
use glam::DVec3;
use num_complex::Complex64;
use rayon::prelude::*;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

/// A target that the radar looks at.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// Index into [`Sources::scenes`].
    Scene(usize),
    /// A marking of metal spheres.
    SphereMarking(SphereMarking),
}

/// Metal spheres spread over a marking, their powers added (Feng 2019, section 3.2.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereMarking {
    /// Radius of a sphere, m.
    pub radius_m: f64,
    /// Width of the marking, m.
    pub width_m: f64,
    /// Length of the marking, m.
    pub length_m: f64,
    /// Whether only the share sin(elevation) that is not shadowed by other spheres counts.
    pub lit_only: bool,
    /// Length of a range cell in the middle of the marking that limits the spheres that count, m; None: all
    /// count.
    pub range_cell_m: Option<f64>,
}

impl SphereMarking {
    fn marking(&self) -> Marking {
        Marking { width_m: self.width_m, length_m: self.length_m }
    }

    /// Number of spheres: as many as fit, one to a square of side 2 r.
    pub fn count(&self) -> f64 {
        self.marking().balls(self.radius_m)
    }

    /// Backscatter cross section of one sphere, m²: the Mie series of a conducting sphere.
    ///
    /// # Errors
    /// Returns an error for a radius or frequency outside the range of the Mie series.
    pub fn one_m2(&self, frequency_hz: f64) -> Result<f64> {
        mie_m2(self.radius_m, frequency_hz)
    }

    /// Total cross section, m². An unweighted range cell collects the share of its sinc² response over the
    /// marking.
    ///
    /// # Errors
    /// Returns an error for a radius or frequency outside the range of the Mie series, or an invalid range
    /// cell.
    pub fn total_m2(&self, frequency_hz: f64, elevation: f64) -> Result<f64> {
        let lit = if self.lit_only { elevation.sin().abs() } else { 1.0 };
        let share = match self.range_cell_m {
            Some(cell) => bin_share(self.length_m * elevation.cos().abs(), cell, BinShape::Rectangle)?,
            None => 1.0,
        };
        Ok(self.one_m2(frequency_hz)? * self.count() * lit * share)
    }
}

/// One scene of a study's target.
#[derive(Debug, Clone)]
pub struct SceneSource {
    /// Description of the target, for tables.
    pub spec: String,
    /// Tilt with which the scene was built, rad.
    pub raise_rad: f64,
    /// Identity of the scene: its description, or the checksum of a file.
    identity: String,
    scene: Scene,
}

impl SceneSource {
    /// Its plane and curved faces.
    pub fn faces(&self) -> Faces {
        Faces::of(&self.scene)
    }

    /// The purpose for which an engine is opened that can take it at these frequencies (Hz).
    ///
    /// # Errors
    /// Returns the errors of [`Purpose::of_target`].
    pub fn purpose(&self, frequencies_hz: &[f64], accuracy_db: f64) -> Result<Purpose> {
        Purpose::of_target(&self.scene, frequencies_hz, accuracy_db)
    }
}

/// The scenes of a study, each built once.
#[derive(Debug, Default)]
pub struct Sources {
    folder: PathBuf,
    import: ImportOptions,
    /// The scenes, in order of first use.
    pub scenes: Vec<SceneSource>,
    index: HashMap<String, usize>,
}

impl Sources {
    /// Makes an empty set; target files are looked for beside the study's `file`.
    pub fn new(file: &Path, import: &ImportOptions) -> Self {
        let folder = file.parent().unwrap_or(Path::new("")).to_path_buf();
        Sources { folder, import: import.clone(), ..Default::default() }
    }

    /// The target that the parameters name; builds its scene if it is new.
    ///
    /// # Errors
    /// Returns an error for a missing target or parameter, or a target that is neither a reflector nor a
    /// readable file.
    pub fn of(&mut self, values: &Values) -> Result<Source> {
        let target = word_of(values, "target").ok_or_else(|| {
            BadInput::new("is missing")
                .key("target")
                .remedy("set or sweep it, as in target = \"type1:height_m=0.004\"")
        })?;
        if target == "balls" {
            let need = |name: &str| {
                number_of(values, name).ok_or_else(|| {
                    Error::from(BadInput::new("is missing").key(name).remedy("target = \"balls\" needs it"))
                })
            };
            return Ok(Source::SphereMarking(SphereMarking {
                radius_m: need("ball_radius_m")?,
                width_m: need("marking_width_m")?,
                length_m: need("marking_length_m")?,
                lit_only: word_of(values, "ball_model") == Some("lit"),
                range_cell_m: number_of(values, "range_cell_m"),
            }));
        }
        let raise_rad = number_of(values, "marker_raise_deg").unwrap_or(0.0).to_radians();
        let mut key = format!("{target}|{:x}", raise_rad.to_bits());
        let own = || values.iter().filter_map(|(n, v)| n.strip_prefix(TARGET_PREFIX).map(|n| (n, v)));
        for (n, v) in own() {
            key += &format!("|{n}={v}");
        }
        if let Some(&i) = self.index.get(&key) {
            return Ok(Source::Scene(i));
        }
        let built = self.build(target, own().collect(), raise_rad)?;
        self.scenes.push(built);
        self.index.insert(key, self.scenes.len() - 1);
        Ok(Source::Scene(self.scenes.len() - 1))
    }

    fn build(&self, target: &str, own: Vec<(&str, &Value)>, raise_rad: f64) -> Result<SceneSource> {
        let (mut scene, spec, identity) = if is_file(target) {
            if let Some((n, _)) = own.first() {
                let bad = BadInput::new("a target file has no parameters").key(format!("{TARGET_PREFIX}{n}"));
                return Err(bad.remedy("remove the sweep, or name a kind of reflector").into());
            }
            let path = self.folder.join(target);
            let scene = mesh_file::import_sized(&path, &self.import, mesh_file::OBJECT_M)?;
            let mut identity = sha256_of_file(&path)?;
            if self.import != ImportOptions::default() {
                identity += &format!("|{:?}", self.import);
            }
            (scene, target.to_string(), identity)
        } else {
            let reflector = with_parameters(target, &own)?;
            (reflector.to_scene(&material::parse_spec)?, reflector.spec(), reflector.spec())
        };
        raise(&mut scene, raise_rad);
        let identity = format!("{identity}|{:x}", raise_rad.to_bits());
        Ok(SceneSource { spec, raise_rad, identity, scene })
    }
}

/// Specification of the reflector that the parameters name, every parameter of it written out; None where the target is a file, a
/// marking of spheres or missing.
///
/// # Errors
/// Returns `BadInput` for a kind, a parameter or a value that no reflector has.
pub fn reflector_spec(values: &Values) -> Result<Option<String>> {
    let Some(target) = word_of(values, "target").filter(|t| *t != "balls" && !is_file(t)) else {
        return Ok(None);
    };
    let own: Vec<(&str, &Value)> =
        values.iter().filter_map(|(n, v)| n.strip_prefix(TARGET_PREFIX).map(|n| (n, v))).collect();
    Ok(Some(with_parameters(target, &own)?.spec()))
}

/// The reflector of `spec` with some of its parameters changed.
fn with_parameters(spec: &str, changed: &[(&str, &Value)]) -> Result<Reflector> {
    let (kind, rest) = spec.split_once(':').unwrap_or((spec, ""));
    // The text itself is checked first, so that a complaint is about what was written.
    Reflector::parse(spec)?;
    let changed: Vec<(&str, String)> = changed.iter().map(|(n, v)| (*n, v.to_string())).collect();
    let kept = rest.split(',').filter_map(|item| item.split_once('=')).map(|(n, v)| (n.trim(), v.trim()));
    let mut pairs: Vec<(&str, &str)> = kept.filter(|(n, _)| !changed.iter().any(|(c, _)| c == n)).collect();
    pairs.extend(changed.iter().map(|(n, v)| (*n, v.as_str())));
    Reflector::from_pairs(kind.trim(), &pairs)
}

/// Tilts the far side of the target upwards about its y axis and keeps its lowest height.
fn raise(scene: &mut Scene, angle: f64) {
    if angle == 0.0 {
        return;
    }
    let lowest = |s: &Scene| s.bounds_m(0.0).map_or(0.0, |b| b.0.z);
    let before = lowest(scene);
    let turn = Pose::<catseye::base::frames::World, catseye::base::frames::World>::from_yaw_pitch_roll(
        DVec3::ZERO,
        0.0,
        angle,
        0.0,
    );
    for o in &mut scene.objects {
        o.pose = o.pose.then(&turn);
    }
    let up = before - lowest(scene);
    for o in &mut scene.objects {
        o.pose = Pose::<Target, _>::new(o.pose.rotation, o.pose.translation_m + DVec3::Z * up);
    }
}

/// One cross section to solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Index of the scene.
    pub scene: usize,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Material of the ground; empty for none.
    pub ground: String,
    /// Azimuth of the radar seen from the target's foot, rad.
    pub azimuth: f64,
    /// Elevation of the radar seen from the target's foot, rad.
    pub elevation: f64,
    /// Distance of the radar from the target's foot, m; infinite for plane waves.
    pub range_m: f64,
    /// Height of the target's origin above its foot, m.
    pub height_m: f64,
}

impl Case {
    /// Makes the case of a scene in a view.
    pub fn new(scene: usize, frequency_hz: f64, ground: &str, view: &View) -> Self {
        Case {
            scene,
            frequency_hz,
            ground: ground.into(),
            azimuth: view.foot_azimuth,
            elevation: view.foot_elevation,
            range_m: view.foot_range_m,
            height_m: view.height_m,
        }
    }

    /// Key that is equal for cases that one call can solve.
    fn batch(&self) -> Key {
        let place = [self.range_m.to_bits(), self.height_m.to_bits()];
        (self.scene, self.frequency_hz.to_bits(), self.ground.clone(), place)
    }
}

/// Scene, frequency, ground, range and height.
type Key = (usize, u64, String, [u64; 2]);

/// Indices of the cases that one call solves.
type Batch = Vec<usize>;

/// Where finished work is kept, and how its identity begins.
pub struct Cache<'a> {
    /// Folder of the kept results.
    pub folder: &'a Path,
    /// Text that names program, engine and solver.
    pub prefix: String,
}

/// Number of looks in one call, so that progress shows and an interruption loses little.
const LOOKS: usize = 128;
/// Number of calls between two writes to disk.
const CALLS: usize = 128;

/// Solves the scattering matrix S of every case, in order. `options` returns the solver's options for a case;
/// `progress` is called with the number of cases newly done.
///
/// # Errors
/// Returns the errors of `options` and of the solver, an error for a radar inside its target, and an error if
/// the cache cannot be written.
pub fn solve(
    solver: &dyn Solver,
    sources: &Sources,
    cases: &[Case],
    convention: Convention,
    options: &(dyn Fn(&Case) -> Result<RcsOptions> + Sync),
    cache: Option<&Cache<'_>>,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Matrix2>> {
    let mut order: Vec<Batch> = Vec::new();
    let mut open: HashMap<Key, usize> = HashMap::new();
    for (i, c) in cases.iter().enumerate() {
        let key = c.batch();
        match open.get(&key) {
            Some(&b) if order[b].len() < LOOKS => order[b].push(i),
            _ => {
                open.insert(key, order.len());
                order.push(vec![i]);
            }
        }
    }
    let call = |batch: &Batch| -> Result<Vec<Matrix2>> {
        let first = &cases[batch[0]];
        let looks: Vec<BistaticAspect> = batch
            .iter()
            .map(|&i| {
                BistaticAspect::monostatic(Aspect {
                    azimuth: cases[i].azimuth,
                    elevation: cases[i].elevation,
                })
            })
            .collect();
        let options = options(first)?;
        let scene = &sources.scenes[first.scene].scene;
        if let Distance::At(r) = options.distance {
            for look in &looks {
                let range_m = r * options.distance_ratio(look.transmit);
                outside(scene, &sources.scenes[first.scene].spec, range_m)?;
            }
        }
        let s: Vec<Scattering> =
            solver.scattering(scene, &[first.frequency_hz], &looks, &options, &|_| ())?;
        progress(looks.len() as u64);
        Ok(s.iter().map(|s| *s.of(convention)).collect())
    };
    let mut out = vec![[[Complex64::ZERO; 2]; 2]; cases.len()];
    for group in order.chunks(CALLS) {
        let file = match cache {
            Some(c) => Some(c.folder.join(identity(c, sources, cases, group, options)?)),
            None => None,
        };
        let members = || group.iter().flatten();
        let known = file.as_ref().and_then(|f| read(f, members().count()));
        let solved = match known {
            Some(s) => {
                progress(s.len() as u64);
                s
            }
            None => {
                let parts: Vec<Vec<Matrix2>> = match solver.is_faster_in_parallel() {
                    true => group.par_iter().map(&call).collect::<Result<_>>()?,
                    false => group.iter().map(&call).collect::<Result<_>>()?,
                };
                let s: Vec<Matrix2> = parts.concat();
                if let Some(f) = &file {
                    write_file(f, true, &bytes(&s))?;
                }
                s
            }
        };
        for (&i, s) in members().zip(solved) {
            out[i] = s;
        }
    }
    Ok(out)
}

/// Returns an error for a radar inside the target.
fn outside(scene: &Scene, spec: &str, range_m: f64) -> Result<()> {
    let Some((lo, hi)) = scene.bounds_m(0.0) else { return Ok(()) };
    let farthest = lo.abs().max(hi.abs()).length();
    if farthest > 0.0 && range_m <= 1.05 * farthest {
        let bad = BadInput::new(format!("the radar is inside the target {spec}")).key("range_m");
        return Err(bad.value(range_m).allowed(format!("more than {:.4}", 1.05 * farthest)).into());
    }
    Ok(())
}

fn identity(
    cache: &Cache<'_>,
    sources: &Sources,
    cases: &[Case],
    group: &[Batch],
    options: &(dyn Fn(&Case) -> Result<RcsOptions> + Sync),
) -> Result<String> {
    let mut text = cache.prefix.clone();
    for batch in group {
        let first = &cases[batch[0]];
        text += &format!(
            "\n{}|{:x}|{:?}",
            sources.scenes[first.scene].identity,
            first.frequency_hz.to_bits(),
            options(first)?
        );
        for &i in batch {
            text += &format!("|{:x},{:x}", cases[i].azimuth.to_bits(), cases[i].elevation.to_bits());
        }
    }
    Ok(format!("{}.s", sha256_of_bytes(text.as_bytes())))
}

/// Serializes matrices as eight little-endian f64 each.
fn bytes(s: &[Matrix2]) -> Vec<u8> {
    s.iter().flatten().flatten().flat_map(|z| [z.re, z.im]).flat_map(f64::to_le_bytes).collect()
}

fn read(file: &Path, count: usize) -> Option<Vec<Matrix2>> {
    let bytes = std::fs::read(file).ok()?;
    if bytes.len() != 64 * count {
        return None;
    }
    let x: Vec<f64> =
        bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap_or([0; 8]))).collect();
    let z = |m: &[f64], i: usize| Complex64::new(m[2 * i], m[2 * i + 1]);
    Some(x.chunks_exact(8).map(|m| [[z(m, 0), z(m, 1)], [z(m, 2), z(m, 3)]]).collect())
}

/// Cross section |p_rᵀ S p_t|² 4π, m², for an entry of [`POLARISATIONS`](super::parameter::POLARISATIONS).
pub fn cross_section_m2(s: &Matrix2, polarisation: &str) -> f64 {
    let power = match polarisation {
        "vv" => s[0][0].norm_sqr(),
        "vh" => s[0][1].norm_sqr(),
        "hv" => s[1][0].norm_sqr(),
        "hh" => s[1][1].norm_sqr(),
        "45-total" => 0.5 * ((s[0][0] + s[0][1]).norm_sqr() + (s[1][0] + s[1][1]).norm_sqr()),
        _ => 0.25 * (s[0][0] + s[0][1] + s[1][0] + s[1][1]).norm_sqr(),
    };
    4.0 * PI * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_replaced_in_a_spec() {
        let v = Value::Number(0.006);
        let r = with_parameters("type1:width_m=0.16, height_m=0.004", &[("height_m", &v)]).unwrap();
        assert_eq!(r, Reflector::parse("type1:width_m=0.16,height_m=0.006").unwrap());
        let r = with_parameters("type1", &[("height_m", &v)]).unwrap();
        assert_eq!(r, Reflector::parse("type1:height_m=0.006").unwrap());
        assert!(with_parameters("type1", &[("hieght_m", &v)]).unwrap_err().to_string().contains("height_m"));
    }

    #[test]
    fn a_raised_plate_stands_on_its_front_edge() {
        let mut scene =
            Reflector::parse("type1:height_m=0.004").unwrap().to_scene(&material::parse_spec).unwrap();
        raise(&mut scene, 2f64.to_radians());
        let (lo, _) = scene.bounds_m(0.0).unwrap();
        assert!(lo.z.abs() < 1e-15);
        // The apex has risen by depth times sine.
        let apex = scene.objects[0].pose.point(DVec3::ZERO);
        assert!((apex.z - 0.08 * 2f64.to_radians().sin()).abs() < 1e-12, "{apex}");
    }

    #[test]
    fn matrices_survive_the_cache() {
        let t = tempfile::tempdir().unwrap();
        let f = t.path().join("x.s");
        let z = |re, im| Complex64::new(re, im);
        let s = vec![[[z(1.5, -2.0), z(0.0, 1e-300)], [z(f64::MIN_POSITIVE, 3.0), z(4.0, -0.25)]]; 3];
        std::fs::write(&f, bytes(&s)).unwrap();
        assert_eq!(read(&f, 3).unwrap(), s);
        assert_eq!(read(&f, 2), None);
    }

    #[test]
    fn polarisations() {
        let z = |x| Complex64::new(x, 0.0);
        let s = [[z(1.0), z(2.0)], [z(3.0), z(-5.0)]];
        for (name, amplitude) in
            [("vv", 1.0), ("vh", 2.0), ("hv", 3.0), ("hh", 5.0), ("45", 0.5), ("45-total", 6.5f64.sqrt())]
        {
            assert!((cross_section_m2(&s, name) - 4.0 * PI * amplitude * amplitude).abs() < 1e-12, "{name}");
        }
    }
}
