//! `catseye scene`: a road scene as glTF with its radar materials and labels.

use super::global::{Global, print, print_json};
use catseye::base::error::{BadInput, Result};
use catseye::base::units::DEFAULT_FREQUENCY_HZ;
use catseye::formats::stage;
use catseye::geom::validate::check_scene;
use catseye::road::labels::RoadTruth;
use catseye::road::{build, glb, scene_toml};
use clap::Args;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Make a road scene (roads, markers, rails, walls, vehicles) as glTF with its radar materials and labels
#[derive(Debug, Args)]
pub struct MakeScene {
    /// TOML file that describes the roads
    pub file: PathBuf,
    /// File to write, binary glTF (default: the name of FILE with .glb)
    #[arg(short, long, value_name = "F.glb")]
    pub output: Option<PathBuf>,
}

#[derive(serde::Serialize)]
struct Made {
    #[serde(serialize_with = "catseye::formats::path_text")]
    file: PathBuf,
    name: String,
    objects: usize,
    triangles: usize,
    /// Objects of each class.
    classes: BTreeMap<String, usize>,
    lanes: usize,
    lane_lines: usize,
    markers: usize,
    warnings: Vec<String>,
}

impl MakeScene {
    pub fn run(&self, global: &Global) -> Result<()> {
        let output = self.output.clone().unwrap_or_else(|| self.file.with_extension("glb"));
        if output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("glb")) {
            return Err(BadInput::new("is not the name of a binary glTF file")
                .key("-o")
                .value(output.display())
                .allowed("a name that ends in .glb")
                .into());
        }
        stage::distinct(&[&output], &[&self.file])?;
        let plan = scene_toml::load(&self.file)?;
        let (scene, truth) = build::build(&plan)?;
        let mut warnings = Vec::new();
        for (name, report) in check_scene(&scene, DEFAULT_FREQUENCY_HZ)? {
            warnings.extend(report.warnings().iter().map(|w| format!("{name}: {w}")));
        }
        let file = stage::write_file(&output, global.force, &glb::to_glb(&scene, &truth)?)?;
        let mut classes = BTreeMap::new();
        for o in &scene.objects {
            *classes.entry(o.class.clone()).or_insert(0) += 1;
        }
        let count = |f: fn(&RoadTruth) -> usize| f(&truth);
        let made = Made {
            file,
            name: plan.name,
            objects: scene.objects.len(),
            triangles: scene.triangle_count(),
            classes,
            lanes: count(|t| t.roads.iter().map(|r| r.lanes.len()).sum()),
            lane_lines: count(|t| t.roads.iter().map(|r| r.lines.len()).sum()),
            markers: count(|t| t.marker_rows.iter().map(|r| r.markers.len()).sum()),
            warnings,
        };
        if global.json {
            return print_json(&made);
        }
        for w in &made.warnings {
            global.say(&format!("warning: {w}"));
        }
        print(&format!(
            "{}: {}, {} objects, {} triangles; {} lanes, {} lane lines, {} markers",
            made.file.display(),
            made.name,
            made.objects,
            made.triangles,
            made.lanes,
            made.lane_lines,
            made.markers
        ))
    }
}
