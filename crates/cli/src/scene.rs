//! `catseye scene`: a road scene as glTF with its radar materials and labels.

use super::global::{Global, print, print_json};
use super::target::ImportArgs;
use catseye::base::error::{BadInput, Result};
use catseye::base::units::DEFAULT_FREQUENCY_HZ;
use catseye::formats::stage;
use catseye::geom::remarks::of_targets;
use catseye::geom::validate::check_scene;
use catseye::road::labels::RoadTruth;
use catseye::road::{build, glb, scene_toml};
use catseye::scene::mesh_file;
use clap::Args;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Make a road scene (roads, markers, rails, walls, vehicles) as glTF with radar materials and labels, or check one
#[derive(Debug, Args)]
pub struct MakeScene {
    /// Road file (TOML); with --check also a .glb, .gltf, .stl or .obj file
    pub file: PathBuf,
    /// Write nothing, and report possible causes of wrong results: defects of meshes, creases and vertices
    /// that are interpreted differently from the file, bodies of dielectrics that are open or curved,
    /// duplicate metal surfaces
    #[arg(long, conflicts_with = "output")]
    pub check: bool,
    /// Binary glTF file to write (default: the name of FILE with .glb)
    #[arg(short, long, value_name = "F.glb")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub import: ImportArgs,
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

#[derive(serde::Serialize)]
struct Checked {
    #[serde(serialize_with = "catseye::formats::path_text")]
    file: PathBuf,
    objects: usize,
    triangles: usize,
    /// What was taken otherwise than the file has it.
    notes: Vec<String>,
    /// What may make results wrong.
    warnings: Vec<String>,
}

impl MakeScene {
    fn check(&self, global: &Global) -> Result<()> {
        let is_mesh = mesh_file::READ.contains(&mesh_file::extension(&self.file).as_str());
        let scene = match is_mesh {
            true => mesh_file::import_sized(&self.file, &self.import.options()?, mesh_file::SCENE_M)?,
            false => build::build(&scene_toml::load(&self.file)?)?.0,
        };
        let mut notes = scene.import.notes.clone();
        if scene.import.degenerate_triangles_dropped > 0 {
            notes.push(format!(
                "triangles without area that were left out: {}",
                scene.import.degenerate_triangles_dropped
            ));
        }
        let checked = Checked {
            file: self.file.clone(),
            objects: scene.objects.len(),
            triangles: scene.triangle_count(),
            notes,
            warnings: [scene.warnings.clone(), of_targets(&scene, DEFAULT_FREQUENCY_HZ)?].concat(),
        };
        if global.json {
            return print_json(&checked);
        }
        for n in &checked.notes {
            print(&format!("note: {n}"))?;
        }
        for w in &checked.warnings {
            print(&format!("warning: {w}"))?;
        }
        print(&format!(
            "{}: {} objects, {} triangles, {} notes, {} warnings",
            checked.file.display(),
            checked.objects,
            checked.triangles,
            checked.notes.len(),
            checked.warnings.len()
        ))
    }

    pub fn run(&self, global: &Global) -> Result<()> {
        if self.check {
            return self.check(global);
        }
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
        let mut warnings = scene.warnings.clone();
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
