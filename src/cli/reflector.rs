//! `catseye reflector`: a reflector as glTF with its radar materials.

use super::{Global, print, print_json};
use crate::error::{BadInput, Result};
use crate::formats::stage;
use crate::road::reflector::{self, Reflector};
use crate::scene::{gltf, material};
use clap::Args;
use std::path::PathBuf;

/// Make a reflector as glTF with its radar materials
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
    target: String,
    triangles: usize,
}

impl MakeReflector {
    pub fn run(&self, global: &Global) -> Result<()> {
        let mut global = global.clone();
        let mut output: Option<PathBuf> = None;
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
        let scene = reflector.to_scene(&material::parse_spec)?;
        let bytes = gltf::to_glb(&scene)?;
        let file = stage::write_file(&output, global.force, &bytes)?;
        let made = Made { file, target: reflector.spec(), triangles: scene.triangle_count() };
        if global.json {
            return print_json(&made);
        }
        print(&format!("{}: {}, {} triangles", made.file.display(), made.target, made.triangles))
    }
}
