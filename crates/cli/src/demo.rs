//! `catseye demo`: the built-in marked road, end to end, from nothing but this binary.

use super::bar::Kept;
use super::frames::draw_frame;
use super::global::{Global, print};
use super::simulate::{summary, tell};
use catseye::base::error::{Error, Result};
use catseye::base::units::dbsm_from_amplitude;
use catseye::engine::Purpose;
use catseye::formats::stage::StagedFile;
use catseye::rcs::{Aspect, BistaticAspect, RcsOptions};
use catseye::road::demo::MARKER;
use catseye::road::reflector::Reflector;
use catseye::scene::{material, scenario};
use catseye_io::run::{RunOptions, run};
use catseye_plot::{Curve, rcs_polar};
use catseye_view::{INLINE_BYTES, Thing};
use clap::Args;
use std::path::{Path, PathBuf};

/// Simulate the built-in marked road, end to end, into ./catseye-demo
#[derive(Debug, Args)]
pub struct Demo {
    /// Folder to write (default: catseye-demo, which replaces an older demo)
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
}

/// Name of the demo's page.
const PAGE: &str = "view.html";

/// The scenario of the demo, as a user would write it.
const SCENARIO: &str = include_str!("../../../scenes/presets/demo.toml");

impl Demo {
    pub fn run(&self, global: &Global) -> Result<()> {
        let mut scenario = scenario::parse(Path::new("demo.toml"), SCENARIO)?;
        if let Some(seed) = global.seed {
            scenario.seed = seed;
        }
        let (engine, rule) = global.engine_for(Purpose::Frames)?;
        let bar = global.bar("frames", scenario.frames.count.into(), Kept::All);
        let report = run(
            &engine,
            &scenario,
            self.output.as_deref().unwrap_or(Path::new("catseye-demo")),
            &RunOptions {
                kind: "demo",
                // In its own place an older demo is replaced without a question; elsewhere it is somebody's.
                force: global.force || self.output.is_none(),
                batch: None,
                from: None,
                convergence: false,
                rule,
                source: Some(SCENARIO.into()),
                pictures: &|scenario, scene, frame, truth, dir| {
                    draw_frame(scenario, scene, frame, truth, dir)?;
                    draw_marker(&engine, dir)
                },
                progress: &|done, _| bar.set_position(done.into()),
                add: Some(&|folder| {
                    let page = Thing::Run(folder.to_path_buf()).page()?;
                    page.write(&folder.join(PAGE), false, INLINE_BYTES, &|_| ()).map(drop)
                }),
            },
        )?;
        drop(bar);
        tell(&report.remarks, global);
        summary(&report, global)?;
        if !global.json {
            print(&format!(
                "pictures: {}",
                ["birds_eye", "range_doppler", "range_profile", "marker_rcs"]
                    .map(|p| report.folder.join(format!("frame_000000/{p}.png")).display().to_string())
                    .join(", ")
            ))?;
            print(&format!("to look around, open in a browser: {}", report.folder.join(PAGE).display()))?;
        }
        Ok(())
    }
}

/// RCS of the road's marker over azimuth at the elevation from which a car's radar sees it 10 m ahead.
fn draw_marker(engine: &catseye::engine::Engine, dir: &Path) -> Result<()> {
    let scene = Reflector::parse(MARKER)?.to_scene(&material::by_name)?;
    let elevation = (0.5f64 / 10.0).atan();
    let aspects: Vec<Aspect> =
        (-90..=90).map(|i| Aspect { azimuth: f64::from(i).to_radians(), elevation }).collect();
    let looks: Vec<BistaticAspect> = aspects.iter().map(|a| BistaticAspect::monostatic(*a)).collect();
    let swept = engine.rcs(&scene, &[77e9], &looks, &RcsOptions { last: false, ..Default::default() })?;
    let curve = |name: &str, i: usize| Curve {
        label: name.into(),
        points: aspects
            .iter()
            .zip(&swept)
            .map(|(a, s)| [a.azimuth.to_degrees(), dbsm_from_amplitude(s.every[i][i].norm())])
            .collect(),
    };
    let picture = rcs_polar(
        &format!("marker of the road, 77 GHz, elevation {:.1}°", elevation.to_degrees()),
        &[curve("VV", 0), curve("HH", 1)],
    )?;
    let staged = StagedFile::new(dir.join("marker_rcs.png"), true)?;
    std::fs::write(staged.path(), picture.png()?).map_err(|e| Error::io(staged.final_path(), e))?;
    staged.commit()?;
    Ok(())
}
