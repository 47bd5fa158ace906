//! `catseye reflector`: a reflector as glTF with its radar materials, as STL or OBJ, and a picture of it.

use super::{Global, print, print_json};
use crate::error::{BadInput, Result};
use crate::formats::{check_extension, stage};
use crate::geom::validate::{MeshReport, check_mesh};
use crate::plot::{SolidView, solid_picture};
use crate::road::reflector::{self, Reflector, Value};
use crate::scene::{material, mesh_file};
use crate::units::{C0, DEFAULT_FREQUENCY_HZ};
use clap::Args;
use std::path::PathBuf;

/// Make a reflector as glTF with its radar materials (-o F.glb), or for a workshop as -o F.stl or F.obj (in mm, --unit in for another
/// unit, with z up), and a picture of it beside it (F.png; --preview F.png puts it elsewhere, --preview none leaves it out)
#[derive(Debug, Args)]
#[command(after_help = format!("Parameters of a KIND are options: --width-m 0.16 is width_m=0.16.\n\n{}", reflector::help()))]
pub struct MakeReflector {
    /// KIND, or KIND:name=value,...
    pub kind: String,
    /// Its parameters as options: --width-m 0.16 --height-m 0.004 ...
    #[arg(allow_hyphen_values = true, trailing_var_arg = true, value_name = "--PARAMETER VALUE")]
    pub parameters: Vec<String>,
}

#[derive(serde::Serialize)]
struct Made {
    file: PathBuf,
    /// The picture.
    preview: Option<PathBuf>,
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
        let mut global = global.clone();
        let mut output: Option<PathBuf> = None;
        let mut preview: Option<PathBuf> = None;
        let mut unit: Option<String> = None;
        let mut pairs: Vec<(String, String)> = Vec::new();
        let mut items = self.parameters.iter();
        // clap hands over everything after KIND, for the parameters differ from kind to kind.
        while let Some(item) = items.next() {
            let (name, inline) = match item.split_once('=') {
                Some((n, v)) => (n, Some(v.to_string())),
                None => (item.as_str(), None),
            };
            match name {
                "--json" => global.json = true,
                "--quiet" => global.quiet = true,
                "--force" => global.force = true,
                _ => {
                    let value = inline.or_else(|| items.next().cloned()).ok_or_else(|| {
                        BadInput::new("has no value").key(name).remedy("write --PARAMETER VALUE")
                    })?;
                    match name {
                        "-o" | "--output" => output = Some(value.into()),
                        "--preview" => preview = Some(value.into()),
                        "--unit" => unit = Some(value),
                        "--device" | "--precision" | "--seed" => {}
                        n if n.starts_with("--") => pairs.push((n[2..].replace('-', "_"), value)),
                        _ => {
                            return Err(BadInput::new("is not an option")
                                .key(name)
                                .remedy("write --PARAMETER VALUE, and -o FILE.glb")
                                .into());
                        }
                    }
                }
            }
        }
        let reflector = match self.kind.contains(':') {
            true if pairs.is_empty() => Reflector::parse(&self.kind)?,
            true => {
                return Err(BadInput::new("parameters are given twice, after ':' and as options")
                    .key("KIND")
                    .value(&self.kind)
                    .remedy("use one of the two")
                    .into());
            }
            false => {
                let pairs: Vec<(&str, &str)> = pairs.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
                Reflector::from_pairs(&self.kind, &pairs)?
            }
        };
        let output = output
            .ok_or_else(|| BadInput::new("no output file is given").key("-o").remedy("write -o FILE.glb"))?;
        let outputs =
            std::iter::once(output.as_path()).chain(preview.as_deref().filter(|p| p.as_os_str() != "none"));
        stage::distinct(&outputs.collect::<Vec<_>>(), &[])?;
        check_extension(&output, &["glb", "stl", "obj"])?;
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
        let written = mesh_file::write(&scene, &output, unit.as_deref())?;
        // Both or neither: the picture is made before the first file is written.
        let picture = match (&mesh, &preview) {
            (Some(_), Some(p)) if p.as_os_str() == "none" => None,
            (Some(mesh), _) => {
                let lines = lines(&reflector, mesh.triangles.len(), report.as_ref());
                let title = format!("{}: {}", reflector.kind().name, reflector.kind().summary);
                let path = preview.clone().unwrap_or_else(|| output.with_extension("png"));
                Some((path, solid_picture(&SolidView::new(&title, &lines, mesh))?))
            }
            (None, _) => None,
        };
        let file = stage::write_file(&output, global.force, &written.bytes)?;
        let preview = match picture {
            Some((path, picture)) => Some(picture.write(path, global.force)?),
            None => None,
        };
        let made = Made {
            file,
            preview,
            target: reflector.spec(),
            triangles: scene.triangle_count(),
            sagitta_m: reflector.sagitta_m(),
            sagitta_in_wavelengths_at_77_ghz: reflector.sagitta_m().map(|s| s * DEFAULT_FREQUENCY_HZ / C0),
            notes: [report.as_ref().map_or_else(Vec::new, MeshReport::notes), written.notes].concat(),
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
            text += &format!("; picture {}", p.display());
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
