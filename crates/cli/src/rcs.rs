//! `catseye rcs`: the scattering matrix of a target over frequency and direction.

use super::angles::{LONGEST, parse_list};
use super::bar::Kept;
use super::global::{Global, choice, print, print_json};
use super::target::ImportArgs;
use catseye::base::convention::{Convention, MAX_BOUNCES};
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::units::{DEFAULT_FREQUENCY_HZ, dbsm_from_amplitude, level_text};
use catseye::engine::sweep::{Accuracy, Sweep};
use catseye::engine::{Engine, Purpose};
use catseye::formats::stage::{self, StagedFile};
use catseye::formats::{check_extension, rcs_csv};
use catseye::geom::validate::check_scene;
use catseye::rcs::polarisation::Derived;
use catseye::rcs::table::{RcsTable, Row};
use catseye::rcs::{Aspect, BistaticAspect, Diffraction, Distance, Ground, RcsOptions, Scattering};
use catseye::road::target;
use catseye::scene::material;
use catseye_plot::{PICTURE_EXTENSIONS, RcsRow, RcsStyle, rcs_picture};
use clap::{Args, ValueEnum};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Compute the radar cross section of a mesh file or a reflector: table, CSV, plot
#[derive(Debug, Args)]
#[command(
    after_help = "Angles are those of the radar as seen from the target's origin: azimuth positive left, elevation positive up. For \
                  a target above the ground (--height-m), angles and range are those from the point of the ground below its origin; cross \
                  sections are those of the target, for the distance of its origin. \
                  All kinds of reflectors with their parameters, defaults and units: catseye help reflectors."
)]
pub struct Rcs {
    /// Target: a .glb, .gltf, .stl or .obj file, or KIND:name=value,... such as type1:width_m=0.16,height_m=0.004
    pub target: String,
    /// Frequencies, Hz: a value, START:STOP:STEP (both included) or several separated by commas, as for every LIST
    #[arg(long, default_value_t = format!("{DEFAULT_FREQUENCY_HZ:e}"), allow_hyphen_values = true, value_name = "LIST")]
    pub frequency_hz: String,
    /// Azimuths of the radar as seen from the target's origin, positive to the left
    #[arg(long, default_value = "0", allow_hyphen_values = true, value_name = "LIST")]
    pub azimuth_deg: String,
    /// Elevations of the radar as seen from the target's origin, with --height-m from the point of the ground below it; positive up
    #[arg(long, default_value = "0", allow_hyphen_values = true, value_name = "LIST")]
    pub elevation_deg: String,
    /// Distance of the radar from the target's origin, with --height-m from the point of the ground below it, m; inf is a plane wave
    #[arg(long, default_value_t = f64::INFINITY, value_name = "R|inf")]
    pub range_m: f64,
    /// Bistatic: azimuths of the receiver (default: monostatic)
    #[arg(long, allow_hyphen_values = true, value_name = "LIST")]
    pub bistatic_azimuth_deg: Option<String>,
    /// Bistatic: elevations of the receiver, combined with all its azimuths
    #[arg(long, allow_hyphen_values = true, value_name = "LIST")]
    pub bistatic_elevation_deg: Option<String>,
    /// Maximum number of bounces of one beam, without the faces of bodies and sheets that it passes through
    /// (default: as many as the accuracy needs, at most 8)
    #[arg(long, value_name = "N")]
    pub bounces: Option<usize>,
    /// Bounces that radiate: every bounce, or only the last, from which a beam leaves
    #[arg(long, default_value = "every", value_parser = choice(&[("every", Convention::Every), ("last", Convention::Last)]))]
    pub convention: Convention,
    /// Error allowed for curved surfaces and finite range, dB (flat facets in the far field have none)
    #[arg(long, default_value_t = 0.1, value_name = "DB")]
    pub accuracy_db: f64,
    /// Edge diffraction of metal: none, or first-order physical theory of diffraction
    #[arg(long, default_value = "none", value_parser = choice(&[("none", Diffraction::None), ("ptd", Diffraction::Ptd)]))]
    pub diffraction: Diffraction,
    /// Infinite ground plane z = 0: none, pec, or a material
    #[arg(long, default_value = "none", value_name = "none|pec|MATERIAL")]
    pub ground: String,
    /// Height of the target's origin above the ground plane z = 0, m. Angles and range remain those seen from that plane
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true, value_name = "H")]
    pub height_m: f64,
    /// Yaw: rotates the target about its z axis, degrees, positive to the left
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true, value_name = "DEG")]
    pub yaw_deg: f64,
    /// Pitch: then rotates it about its new y axis, degrees, positive front down
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true, value_name = "DEG")]
    pub pitch_deg: f64,
    /// Roll: then rotates it about its new x axis, degrees, positive right side down
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true, value_name = "DEG")]
    pub roll_deg: f64,
    /// Radar material of all objects of the target with this name, in place of the material in the file (repeatable)
    #[arg(long, value_name = "PART=MATERIAL")]
    pub part_material: Vec<String>,
    /// Further polarisations in addition to VV, VH, HV and HH (several separated by commas)
    #[arg(long, value_delimiter = ',', value_name = "linear45,circular")]
    pub polarisation: Vec<PolarisationName>,
    /// Table to write: CSV, or Parquet by extension (`--features parquet`)
    #[arg(short, long, value_name = "F.csv")]
    pub output: Option<PathBuf>,
    /// Plot of all polarisations and frequencies to write: PNG, SVG or PDF by extension
    #[arg(long, value_name = "F.png|F.svg|F.pdf")]
    pub plot: Option<PathBuf>,
    #[command(flatten)]
    pub import: ImportArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PolarisationName {
    /// Linear at +45 and -45 deg
    Linear45,
    /// Right- and left-hand circular (IEEE)
    Circular,
}

impl PolarisationName {
    fn derived(self) -> Derived {
        match self {
            PolarisationName::Linear45 => Derived::Linear45,
            PolarisationName::Circular => Derived::Circular,
        }
    }
}

#[derive(serde::Serialize)]
struct JsonRow {
    frequency_hz: f64,
    azimuth_deg: f64,
    elevation_deg: f64,
    vv_dbsm: f64,
    vh_dbsm: f64,
    hv_dbsm: f64,
    hh_dbsm: f64,
    /// Azimuth of the receiver in a bistatic run, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    rx_azimuth_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rx_elevation_deg: Option<f64>,
    /// [[vv, vh], [hv, hh]], each [re, im] in m.
    s_m: [[[f64; 2]; 2]; 2],
    /// In the polarisations that were asked for, dBsm.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    derived_dbsm: BTreeMap<&'static str, f64>,
}

impl Rcs {
    pub fn run(&self, global: &Global) -> Result<()> {
        self.check()?;
        let frequencies = parse_list("frequency-hz", &self.frequency_hz)?;
        let transmit = aspects(["azimuth-deg", "elevation-deg"], &self.azimuth_deg, &self.elevation_deg)?;
        let receive = match (&self.bistatic_azimuth_deg, &self.bistatic_elevation_deg) {
            (None, None) => None,
            (az, el) => Some(aspects(
                ["bistatic-azimuth-deg", "bistatic-elevation-deg"],
                az.as_deref().unwrap_or("0"),
                el.as_deref().unwrap_or("0"),
            )?),
        };
        let options = RcsOptions {
            bounces: self.bounces.unwrap_or(3),
            most_bounces: self.bounces.unwrap_or(MAX_BOUNCES),
            distance: if self.range_m == f64::INFINITY {
                Distance::Infinite
            } else {
                Distance::At(self.range_m)
            },
            accuracy_db: self.accuracy_db,
            diffraction: self.diffraction,
            ground: self.ground()?,
            height_m: self.height_m,
            last: self.convention == Convention::Last,
        };
        let sweep = Sweep { frequencies_hz: frequencies, transmit, receive, options };
        sweep.check().map_err(as_option)?;
        let Sweep { frequencies_hz: frequencies, options, .. } = &sweep;
        let outputs: Vec<&Path> =
            [&self.output, &self.plot].into_iter().flatten().map(PathBuf::as_path).collect();
        stage::distinct(&outputs, &[Path::new(&self.target)])?;
        for (path, written) in [(&self.output, &["csv", "parquet"][..]), (&self.plot, &PICTURE_EXTENSIONS)] {
            path.as_ref().map_or(Ok(()), |p| check_extension(p, written))?;
        }
        let parquet = self.output.as_ref().map_or(Ok(false), rcs_csv::is_parquet)?;
        let csv = self.output.as_ref().map(|p| StagedFile::new(p, global.force)).transpose()?;
        if let Some(p) = &self.plot
            && p.exists()
            && !global.force
        {
            return Err(BadInput::new("the file exists").file(p).remedy("add --force to replace it").into());
        }
        let mut target = target::load(&self.target, &self.import.options()?)?;
        for given in &self.part_material {
            let pair = given.rsplit_once('=').ok_or_else(|| {
                BadInput::new("expected PART=MATERIAL")
                    .key("--part-material")
                    .value(given)
                    .remedy("write for example --part-material hood=steel")
            })?;
            target.cover(pair.0, pair.1).map_err(as_option)?;
        }
        let [yaw, pitch, roll] = [self.yaw_deg, self.pitch_deg, self.roll_deg].map(f64::to_radians);
        target.turn(yaw, pitch, roll);
        let target = target;
        for note in &target.scene.import.notes {
            global.say(&format!("note: {note}"));
        }
        let mut warnings: Vec<String> = Vec::new();
        let (reports, bad) = (check_scene(&target.scene, frequencies[0])?, |name: &str, e: BadInput| {
            let key = format!("object '{name}'");
            catseye::base::error::Error::from(e.key(key))
        });
        for (name, report) in &reports {
            if let Some(e) = report.error() {
                return Err(bad(name, e));
            }
            for w in report.warnings() {
                global.say(&format!("warning: {name}: {w}"));
                warnings.push(format!("{name}: {w}"));
            }
        }
        sweep.check_for(&target.scene).map_err(as_option)?;
        let convention = self.convention;
        let purpose =
            || Purpose::of_target(&target.scene, frequencies, options.accuracy_db).map_err(as_option);
        let (engine, rule) = global.engine_for_target(purpose)?;

        let directions = sweep.transmit.len() as u64 * sweep.receive.as_ref().map_or(1, |r| r.len() as u64);
        let bar = global.bar("directions", directions, Kept::Nothing);
        let boresight = Aspect {
            azimuth: target.boresight_deg.0.to_radians(),
            elevation: target.boresight_deg.1.to_radians(),
        };
        let mut warn = |w: &str| {
            bar.suspend(|| global.say(&format!("warning: {w}")));
            warnings.push(w.into());
        };
        let swept = sweep.take(&engine, &target.scene, &mut warn, &|n| bar.inc(n)).map_err(as_option)?;
        drop(bar);
        let both = RcsOptions { last: true, bounces: swept.bounces, ..options.clone() };
        // No radar looks from below the ground.
        let on_boresight = match options.ground != Ground::None && boresight.elevation < 0.0 {
            true => Vec::new(),
            false => {
                engine.rcs(&target.scene, frequencies, &[BistaticAspect::monostatic(boresight)], &both)?
            }
        };
        let looks = &swept.aspects;
        let rows =
            frequencies.iter().flat_map(|f| looks.iter().map(move |l| (*f, *l))).zip(&swept.scattering).map(
                |((frequency_hz, look), s)| Row {
                    frequency_hz,
                    aspect: look.transmit,
                    receive: sweep.receive.as_ref().map(|_| look.receive),
                    s: *s.of(convention),
                },
            );
        let mut table = RcsTable { comments: Vec::new(), rows: rows.collect() };
        table.comments =
            self.comments(&target.name, &engine, &target, frequencies, (&on_boresight, swept.bounces));
        table.comments.extend(rule.map(|rule| format!("engine_rule: {rule}")));
        table.comments.extend(target.scene.import.notes.iter().map(|n| format!("note: {n}")));
        table.comments.push(match swept.accuracy {
            Accuracy::Exact => "convergence: flat facets are integrated exactly in the far field; what is left is the error of physical optics".into(),
            Accuracy::Series => "convergence: the series of a sphere (Mie) is exact".into(),
            Accuracy::Measured(db) => format!(
                "convergence: {db:.4} dB between this and a run with cells of a quarter of the phase and curved facets of a quarter of the sagitta"
            ),
            Accuracy::Unknown => "convergence: not measured".into(),
            Accuracy::NoEcho => "convergence: no echo to compare".into(),
        });
        table.comments.extend(warnings.iter().map(|w| format!("warning: {w}")));

        if let Some(staged) = csv {
            match parquet {
                #[cfg(feature = "parquet")]
                true => table.write_parquet(staged.path(), &self.derived())?,
                _ => table.write_with(staged.path(), &self.derived())?,
            }
            staged.commit()?;
        }
        if let Some(p) = &self.plot {
            let derived = self.derived();
            let rows: Vec<RcsRow> = table.rows.iter().map(|r| plot_row(r, &derived)).collect();
            rcs_picture(&self.target, &rows, RcsStyle::Auto)?.write(p, global.force)?;
        }
        if global.json {
            return print_json(&serde_json::json!({
                "target": target.name,
                "convention": format!("{convention:?}").to_lowercase(),
                "bounces": swept.bounces,
                // JSON has no infinity: null is a plane wave.
                "range_m": self.range_m.is_finite().then_some(self.range_m),
                "ground": self.ground,
                "height_m": self.height_m,
                "turned_deg": [self.yaw_deg, self.pitch_deg, self.roll_deg],
                "warnings": warnings,
                // What was taken otherwise than the file has it.
                "notes": target.scene.import.notes,
                "version": env!("CARGO_PKG_VERSION"),
                "accuracy_db": self.accuracy_db,
                "convergence_db": swept.accuracy.db(),
                "diffraction": format!("{:?}", self.diffraction).to_lowercase(),
                "engine": engine.report(),
                "engine_rule": rule,
                "boresight": frequencies.iter().zip(&on_boresight).map(|(f, s)| boresight_json(*f, &target, s)).collect::<Vec<_>>(),
                "rows": table.rows.iter().map(|r| json_row(r, &self.derived())).collect::<Vec<_>>(),
            }));
        }
        self.summary(&table)
    }

    fn derived(&self) -> Vec<Derived> {
        self.polarisation.iter().map(|p| p.derived()).collect()
    }

    fn ground(&self) -> Result<Ground> {
        match self.ground.as_str() {
            "none" => Ok(Ground::None),
            name => match material::parse_spec(name) {
                Ok(m) => Ok(Ground::Plane(m)),
                Err(Error::Input(b)) => Err(b.key("--ground").value(name).into()),
                Err(e) => Err(e),
            },
        }
    }

    fn check(&self) -> Result<()> {
        if let Some((i, p)) =
            self.polarisation.iter().enumerate().find(|(i, p)| self.polarisation[..*i].contains(p))
        {
            return Err(BadInput::new("the polarisation is listed twice")
                .key("--polarisation")
                .value(format!("{p:?} at place {}", i + 1).to_lowercase())
                .into());
        }
        for (key, degrees) in
            [("--yaw-deg", self.yaw_deg), ("--pitch-deg", self.pitch_deg), ("--roll-deg", self.roll_deg)]
        {
            if !(-360.0..=360.0).contains(&degrees) {
                return Err(BadInput::new("out of range")
                    .key(key)
                    .value(degrees)
                    .allowed("-360..360")
                    .into());
            }
        }
        Ok(())
    }

    fn comments(
        &self,
        name: &str,
        engine: &Engine,
        target: &target::Target,
        frequencies: &[f64],
        (on_boresight, bounces): (&[Scattering], usize),
    ) -> Vec<String> {
        let mut lines = vec![
            format!("target: {name}"),
            format!(
                "convention: {} (which bounces radiate)",
                format!("{:?}", self.convention).to_lowercase()
            ),
            match self.bounces {
                Some(n) => format!("bounces: {n}"),
                None => {
                    format!("bounces: {bounces} (within {} dB of {MAX_BOUNCES})", self.accuracy_db)
                }
            },
            format!("range_m: {}", self.range_m),
            format!("ground: {}, target raised by {} m", self.ground, self.height_m),
            format!("diffraction: {}", format!("{:?}", self.diffraction).to_lowercase()),
            format!("accuracy_db: {} (curved surfaces, finite range)", self.accuracy_db),
            format!("engine: {}", engine.describe()),
            format!("version: catseye {}", env!("CARGO_PKG_VERSION")),
        ];
        if [self.yaw_deg, self.pitch_deg, self.roll_deg] != [0.0; 3] {
            lines.push(format!(
                "turned: yaw {} deg, pitch {} deg, roll {} deg",
                self.yaw_deg, self.pitch_deg, self.roll_deg
            ));
        }
        for (f, s) in frequencies.iter().zip(on_boresight) {
            let (az, el) = target.boresight_deg;
            let db = |m: &[[num_complex::Complex64; 2]; 2]| {
                let [vv, hh] = [0, 1].map(|i| level_text(dbsm_from_amplitude(m[i][i].norm()), 3));
                format!("VV {vv} HH {hh} dBsm")
            };
            lines.push(format!(
                "boresight (azimuth {az} deg, elevation {el:.4} deg) at {f} Hz: every {}; last {}",
                db(&s.every),
                db(&s.last)
            ));
        }
        lines
    }

    fn summary(&self, table: &RcsTable) -> Result<()> {
        for c in &table.comments {
            print(&format!("# {c}"))?;
        }
        const SHOWN: usize = 40;
        let derived = self.derived();
        if table.rows.len() <= SHOWN {
            // Where the receiver stands, in a bistatic run.
            let bistatic = table.rows.iter().any(|r| r.receive.is_some());
            let more: String = derived.iter().flat_map(|d| d.names()).map(|n| format!(" {n:>9}")).collect();
            let at = if bistatic { "  rx_azimuth_deg  rx_elevation_deg" } else { "" };
            print(&format!(
                "   frequency_hz  azimuth_deg  elevation_deg{at}   vv_dbsm   vh_dbsm   hv_dbsm   hh_dbsm{more}"
            ))?;
            for r in &table.rows {
                let at: String = r.receive.filter(|_| bistatic).map_or_else(String::new, |a| {
                    format!(" {:>15.4} {:>17.4}", a.azimuth.to_degrees(), a.elevation.to_degrees())
                });
                let levels: String = [r.dbsm(0, 0), r.dbsm(0, 1), r.dbsm(1, 0), r.dbsm(1, 1)]
                    .into_iter()
                    .chain(derived_dbsm(r, &derived).map(|(_, x)| x))
                    .map(|x| format!(" {:>9}", level_text(x, 3)))
                    .collect();
                print(&format!(
                    "{:>15} {:>12.4} {:>14.4}{at}{levels}",
                    r.frequency_hz,
                    r.aspect.azimuth.to_degrees(),
                    r.aspect.elevation.to_degrees(),
                ))?;
            }
        } else {
            for (name, i) in [("VV", 0), ("HH", 1)] {
                if let Some(best) = table.rows.iter().max_by(|a, b| a.dbsm(i, i).total_cmp(&b.dbsm(i, i))) {
                    let at = best.receive.map_or_else(String::new, |a| {
                        format!(
                            ", receiver at azimuth {:.4} deg, elevation {:.4} deg",
                            a.azimuth.to_degrees(),
                            a.elevation.to_degrees()
                        )
                    });
                    print(&format!(
                        "{name}: largest {} dBsm at azimuth {:.4} deg, elevation {:.4} deg{at}, {} Hz ({} directions)",
                        level_text(best.dbsm(i, i), 3),
                        best.aspect.azimuth.to_degrees(),
                        best.aspect.elevation.to_degrees(),
                        best.frequency_hz,
                        table.rows.len()
                    ))?;
                }
            }
        }
        for p in [&self.output, &self.plot].into_iter().flatten() {
            print(&format!("wrote {}", p.display()))?;
        }
        Ok(())
    }
}

/// The library's complaint about a value, with the option that gave it.
fn as_option(e: Error) -> Error {
    match e {
        Error::Input(mut b) => {
            // The file of a complaint is not of the command line.
            if b.file.is_none() {
                b.key = b.key.map(|k| k.split(' ').map(option_name).collect::<Vec<_>>().join(" "));
            }
            Error::Input(b)
        }
        e => e,
    }
}

fn option_name(word: &str) -> String {
    const OPTIONS: [&str; 11] = [
        "frequency_hz",
        "azimuth_deg",
        "elevation_deg",
        "bistatic_azimuth_deg",
        "bistatic_elevation_deg",
        "range_m",
        "height_m",
        "part_material",
        "bounces",
        "accuracy_db",
        "bistatic_...",
    ];
    let name = word.trim_matches(['(', ')']);
    match OPTIONS.contains(&name) {
        true => word.replace(name, &format!("--{}", name.replace('_', "-"))),
        false => word.into(),
    }
}

/// Product of two lists of angles, elevation outermost.
fn aspects(keys: [&str; 2], azimuth: &str, elevation: &str) -> Result<Vec<Aspect>> {
    let (azimuths, elevations) = (parse_list(keys[0], azimuth)?, parse_list(keys[1], elevation)?);
    if azimuths.len() as u128 * elevations.len() as u128 > LONGEST as u128 {
        return Err(BadInput::new("too many directions")
            .key(format!("--{} x --{}", keys[0], keys[1]))
            .value(azimuths.len() as u128 * elevations.len() as u128)
            .allowed(format!("at most {LONGEST}"))
            .remedy("use larger steps or split the sweep")
            .into());
    }
    let aspect = |az: &f64, el: &f64| Aspect { azimuth: az.to_radians(), elevation: el.to_radians() };
    Ok(elevations.iter().flat_map(|el| azimuths.iter().map(move |az| aspect(az, el))).collect())
}

fn plot_row(r: &Row, derived: &[Derived]) -> RcsRow {
    let pair = |d: Derived| {
        let [[a, b], [c, d]] = d.of(&r.s).map(|row| row.map(|z| dbsm_from_amplitude(z.norm())));
        [a, b, c, d]
    };
    RcsRow {
        frequency_hz: r.frequency_hz,
        azimuth_deg: r.azimuth_deg(),
        elevation_deg: r.elevation_deg(),
        vv_dbsm: r.dbsm(0, 0),
        vh_dbsm: r.dbsm(0, 1),
        hv_dbsm: r.dbsm(1, 0),
        hh_dbsm: r.dbsm(1, 1),
        derived_dbsm: Derived::ALL.map(|d| derived.contains(&d).then(|| pair(d))),
        receive_deg: r.receive.map(|a| [a.azimuth, a.elevation].map(rounded_degrees)),
    }
}

/// As the table's file has it.
fn rounded_degrees(x_rad: f64) -> f64 {
    (x_rad.to_degrees() * 1e9).round() / 1e9
}

/// Names and levels in the derived polarisations.
fn derived_dbsm<'a>(r: &'a Row, derived: &'a [Derived]) -> impl Iterator<Item = (&'static str, f64)> + 'a {
    derived.iter().flat_map(|d| {
        let levels: Vec<f64> =
            d.of(&r.s).as_flattened().iter().map(|z| dbsm_from_amplitude(z.norm())).collect();
        d.names().into_iter().zip(levels)
    })
}

fn json_row(r: &Row, derived: &[Derived]) -> JsonRow {
    let p = plot_row(r, &[]);
    JsonRow {
        rx_azimuth_deg: p.receive_deg.map(|a| a[0]),
        rx_elevation_deg: p.receive_deg.map(|a| a[1]),
        frequency_hz: p.frequency_hz,
        azimuth_deg: p.azimuth_deg,
        elevation_deg: p.elevation_deg,
        vv_dbsm: p.vv_dbsm,
        vh_dbsm: p.vh_dbsm,
        hv_dbsm: p.hv_dbsm,
        hh_dbsm: p.hh_dbsm,
        s_m: r.s.map(|row| row.map(|z| [z.re, z.im])),
        derived_dbsm: derived_dbsm(r, derived).collect(),
    }
}

fn boresight_json(frequency_hz: f64, target: &target::Target, s: &Scattering) -> serde_json::Value {
    let db = |m: &[[num_complex::Complex64; 2]; 2]| {
        serde_json::json!({
            "vv_dbsm": dbsm_from_amplitude(m[0][0].norm()),
            "hh_dbsm": dbsm_from_amplitude(m[1][1].norm()),
        })
    };
    serde_json::json!({
        "frequency_hz": frequency_hz,
        "azimuth_deg": target.boresight_deg.0,
        "elevation_deg": target.boresight_deg.1,
        "every": db(&s.every),
        "last": db(&s.last),
    })
}
