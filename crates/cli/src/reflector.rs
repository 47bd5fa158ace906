//! `catseye reflector`: a reflector as glTF with its radar materials, as STL or OBJ, and a picture of it.

use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Result};
use catseye::base::units::{C0, DEFAULT_FREQUENCY_HZ};
use catseye::formats::{check_extension, stage};
use catseye::geom::validate::{MeshReport, check_mesh};
use catseye::road::reflector::{self, Reflector, Value};
use catseye::scene::{material, mesh_file};
use catseye_plot::{SolidView, solid_picture};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::LazyLock;

/// Make a reflector as glTF with its radar materials (-o F.glb), or for a workshop as -o F.stl or F.obj (in
/// mm, z up; --unit in for another unit), with an image of it beside it (F.png; --preview F.png writes it
/// elsewhere, --preview none omits it)
#[derive(Debug, Args)]
#[command(
    after_help = "Parameters of a KIND are options as well: --width-m 0.16 is width_m=0.16. All kinds with their \
                  parameters, defaults and units: catseye help reflectors; those of one: catseye help reflectors KIND."
)]
pub struct MakeReflector {
    /// Reflector: KIND, or KIND:name=value,... such as type1:width_m=0.16,height_m=0.004
    pub kind: String,
    #[command(flatten)]
    pub parameters: Parameters,
    /// File to write: binary glTF, or STL or OBJ for a workshop
    #[arg(short, long, value_name = "F.glb|F.stl|F.obj")]
    pub output: PathBuf,
    /// Unit of STL and OBJ: mm (default), cm, m, in, ft
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<String>,
    /// Image to write (default: beside the glTF); none: no image
    #[arg(long, value_name = "F.png|none")]
    pub preview: Option<PathBuf>,
}

/// Names of the parameters of all kinds, each with its option. `--seed` is an option of other commands, too.
static OPTIONS: LazyLock<BTreeMap<&'static str, String>> = LazyLock::new(|| {
    let names = reflector::kinds().iter().flat_map(|k| k.params).map(|p| p.name);
    let all = names.chain([reflector::MATERIAL_PARAM]).filter(|n| *n != "seed");
    all.map(|n| (n, n.replace('_', "-"))).collect()
});

/// What stands for the parameters of a kind on the command line: (name, value). Whether the kind has them is
/// [`Reflector`]'s to say.
#[derive(Debug)]
pub struct Parameters(Vec<(&'static str, String)>);

impl Args for Parameters {
    fn augment_args(command: Command) -> Command {
        command.args(OPTIONS.iter().map(|(name, option)| {
            let arg = Arg::new(*name).long(option.as_str()).hide(true).allow_hyphen_values(true);
            arg.action(ArgAction::Append).help("A parameter of some kinds: catseye help reflectors")
        }))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Parameters {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = |name: &&'static str| matches.get_many::<String>(name).into_iter().flatten().cloned();
        let pairs = OPTIONS.keys().flat_map(|name| given(name).map(move |value| (*name, value)));
        Ok(Parameters(pairs.collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

#[derive(serde::Serialize)]
struct Made {
    #[serde(serialize_with = "catseye::formats::path_text")]
    file: PathBuf,
    /// The picture.
    preview: Option<String>,
    target: String,
    triangles: usize,
    /// Greatest depth of a facet below the curved surface that it stands for.
    sagitta_m: Option<f64>,
    sagitta_in_wavelengths_at_77_ghz: Option<f64>,
    mesh: Option<MeshReport>,
    notes: Vec<String>,
    warnings: Vec<String>,
}

/// What the picture and the line on the terminal say of curvature.
fn sagitta_text(sagitta_m: f64) -> String {
    let part = C0 / DEFAULT_FREQUENCY_HZ / sagitta_m;
    format!("curved faces within {:.1} um of the surface (lambda/{part:.0} at 77 GHz)", sagitta_m * 1e6)
}

impl MakeReflector {
    pub fn run(&self, global: &Global) -> Result<()> {
        let seed = global.seed.map(|n| n.to_string());
        let pairs: Vec<(&str, &str)> = (self.parameters.0.iter().map(|(n, v)| (*n, v.as_str())))
            .chain(seed.iter().map(|n| ("seed", n.as_str())))
            .collect();
        let reflector = match self.kind.contains(':') {
            true if pairs.is_empty() => Reflector::parse(&self.kind)?,
            true => {
                return Err(BadInput::new(
                    "parameters after ':' and parameters as options exclude each other",
                )
                .key("KIND")
                .value(&self.kind)
                .remedy("use one of the two")
                .into());
            }
            false => Reflector::from_pairs(&self.kind, &pairs)?,
        };
        let (output, preview) = (&self.output, &self.preview);
        let outputs =
            std::iter::once(output.as_path()).chain(preview.as_deref().filter(|p| p.as_os_str() != "none"));
        stage::distinct(&outputs.collect::<Vec<_>>(), &[])?;
        check_extension(output, &["glb", "stl", "obj"])?;
        preview.as_ref().map_or(Ok(()), |p| check_extension(p, &["png"]))?;
        let scene = reflector.to_scene(&material::parse_spec)?;
        let mesh = reflector.mesh();
        let report = mesh.as_ref().map(|m| {
            // Material 0 is the reflector's own; of the others only dielectrics fill.
            let own = material::parse_spec(&reflector.material).is_ok_and(|m| m.is_dielectric());
            check_mesh(m, DEFAULT_FREQUENCY_HZ, &|i| i > 0 || own)
        });
        let report = report.transpose()?;
        if let Some(e) = report.as_ref().and_then(MeshReport::error) {
            return Err(e.key(reflector.spec()).into());
        }
        let written = mesh_file::write(&scene, output, self.unit.as_deref())?;
        let path = preview.clone().unwrap_or_else(|| output.with_extension("png"));
        // Nobody asked for a picture of that name, which may be that of the same body in another format.
        let is_kept = preview.is_none() && !global.force && path.exists();
        // Both or neither: the picture is made, and its name is free, before the first file is written.
        let picture = match &mesh {
            Some(mesh) if !is_kept && path.as_os_str() != "none" => {
                if !global.force && path.exists() {
                    return Err(BadInput::new("exists already")
                        .file(path)
                        .remedy("give --force to replace it, or another name")
                        .into());
                }
                let lines = lines(&reflector, mesh.triangles.len(), report.as_ref());
                let title = format!("{}: {}", reflector.kind().name, reflector.kind().summary);
                Some(solid_picture(&SolidView::new(&title, &lines, mesh))?)
            }
            _ => None,
        };
        let kept = (is_kept && mesh.is_some())
            .then(|| format!("{} exists and is left unchanged; --force replaces it", path.display()));
        let file = stage::write_file(output, global.force, &written.bytes)?;
        let preview =
            picture.map(|p| p.write(path, global.force)).transpose()?.map(|p| p.display().to_string());
        let made = Made {
            file,
            preview,
            target: reflector.spec(),
            triangles: scene.triangle_count(),
            sagitta_m: reflector.sagitta_m(),
            sagitta_in_wavelengths_at_77_ghz: reflector.sagitta_m().map(|s| s * DEFAULT_FREQUENCY_HZ / C0),
            notes: [
                report.as_ref().map_or_else(Vec::new, MeshReport::notes),
                written.notes,
                kept.into_iter().collect(),
            ]
            .concat(),
            warnings: report.as_ref().map_or_else(Vec::new, MeshReport::warnings),
            mesh: report,
        };
        if global.json {
            return print_json(&made);
        }
        let mut text = format!("{}: {}, {} triangles", made.file.display(), made.target, made.triangles);
        if let Some(s) = made.sagitta_m {
            text += &format!("; {}", sagitta_text(s));
        }
        if let Some(p) = &made.preview {
            text += &format!("; picture {p}");
        }
        if !global.quiet {
            for note in &made.notes {
                eprintln!("note: {note}");
            }
            for warning in &made.warnings {
                eprintln!("warning: {warning}");
            }
        }
        print(&text)
    }
}

/// What stands under the title of the picture.
fn lines(reflector: &Reflector, triangles: usize, report: Option<&MeshReport>) -> Vec<String> {
    let value = |name: &str| match reflector.value(name)? {
        // Four digits are enough for the eye.
        Value::Number(x) if x != 0.0 => {
            let digits = (3.0 - x.abs().log10().floor()).clamp(0.0, 9.0) as usize;
            let text = format!("{x:.digits$}");
            let short =
                if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
            Some(format!("{name} {short}"))
        }
        other => Some(format!("{name} {other}")),
    };
    // Curvature has words of its own.
    let names = reflector.kind().params.iter().map(|p| p.name).filter(|n| *n != "sagitta_m");
    let mut parameters: Vec<String> = names.filter_map(value).collect();
    if reflector.point_rcs_dbsm().is_none() {
        parameters.push(format!("material {}", reflector.material));
    }
    let parameters = parameters.join(",  ");
    let mut facts = format!("{triangles} triangles");
    if let Some(r) = report {
        let form = match (r.closed_parts, r.parts - r.closed_parts) {
            (1, 0) => ", a closed body".to_string(),
            (n, 0) => format!(", {n} closed bodies"),
            (0, 1) => ", a sheet".to_string(),
            (0, n) => format!(", {n} sheets"),
            (n, m) => format!(", {n} closed bodies and {m} sheets"),
        };
        facts += &form;
    }
    if let Some(s) = reflector.sagitta_m() {
        facts += &format!("; {}", sagitta_text(s));
    }
    vec![parameters, facts]
}
