//! What a page is asked for.

use super::html::With;
use super::{Page, dataset, lanes, rcs, run, scene, study};
use catseye::base::error::{BadInput, Error, Result, json_in_words};
use catseye::formats::input::{LARGEST_TEXT, read};
use catseye::formats::stage::MANIFEST;
use catseye::road::reflector::Reflector;
use catseye::road::target::{self, Target};
use catseye::scene::gltf::ImportOptions;
use catseye::scene::{Scene, mesh_file};
use serde_json::json;
use std::path::{Path, PathBuf};

/// File that says that a folder is a dataset.
const DATASET: &str = "dataset.json";

/// What a page shows.
#[derive(Debug, Clone, PartialEq)]
pub enum Thing {
    /// All frames of a run.
    Run(PathBuf),
    /// One frame of the run in this folder.
    Frame(PathBuf, u32),
    /// A run or one frame of it with the lane estimates in a folder or file.
    Lanes(Box<Thing>, PathBuf),
    /// The frames of a dataset.
    Dataset(PathBuf),
    /// The studies that `catseye study` wrote into this folder.
    Study(PathBuf),
    /// Tables of cross sections, laid over each other.
    Rcs(Vec<PathBuf>),
}

/// A mesh's file or a reflector by its specification, to be shown. Files that state their unit, as glTF does, may hold whole
/// roads: their size is not doubted.
///
/// # Errors
/// Returns `BadInput` for a file that is no mesh, a mesh without a unit that is larger than a target, and an unknown reflector.
fn load(target: &str, options: &ImportOptions) -> Result<Target> {
    let mut options = options.clone();
    options.unit_given |= !mesh_file::leaves_unit_open(Path::new(target), &options);
    target::load(target, &options)
}

/// The kind of results that a folder's manifest states; empty where it states none.
///
/// # Errors
/// Returns `BadInput` for a manifest that is no JSON.
fn kind_of(folder: &Path) -> Result<String> {
    #[derive(serde::Deserialize)]
    struct Kind {
        #[serde(default)]
        kind: String,
    }
    let path = folder.join(MANIFEST);
    let bytes = read(&path, "a manifest", LARGEST_TEXT)?;
    let kind: Kind = serde_json::from_slice(&bytes).map_err(|e| {
        BadInput::new(format!("is not a manifest: {}", json_in_words(&e)))
            .file(&path)
            .remedy("give a folder that catseye completed")
    })?;
    Ok(kind.kind)
}

impl Thing {
    /// What lies at these paths: one of anything, several tables of cross sections, or a run before its lane estimates.
    ///
    /// # Errors
    /// Returns `BadInput` for what no page can show.
    pub fn of(paths: &[PathBuf]) -> Result<Thing> {
        if let [run, found] = paths
            && run.is_dir()
            && (lanes::is_lanes(found) || !Self::is_table(found))
        {
            return match Self::of_folder(run)? {
                run @ (Thing::Run(_) | Thing::Frame(..)) => Ok(Thing::Lanes(Box::new(run), found.clone())),
                _ => Err(BadInput::new("is not a run, and lane estimates can only be shown with a run")
                    .file(run)
                    .remedy(
                        "give the folder that `catseye simulate` wrote first, then that of `catseye lane`",
                    )
                    .into()),
            };
        }
        let [path] = paths else {
            if let Some(other) = paths.iter().find(|p| !Self::is_table(p)) {
                return Err(BadInput::new("cannot be shown together with other results")
                    .file(other)
                    .allowed("several tables of cross sections (.csv), a run and its lane estimates, or one of anything else")
                    .remedy("show it separately")
                    .into());
            }
            return Ok(Thing::Rcs(paths.to_vec()));
        };
        if path.is_dir() {
            return Self::of_folder(path);
        }
        if Self::is_table(path) {
            return Ok(Thing::Rcs(vec![path.clone()]));
        }
        Err(BadInput::new("a page cannot show this kind of file")
            .file(path)
            .allowed("the folder of a run, of one of its frames, of a dataset or of studies, or tables of cross sections (.csv)")
            .remedy("give a result of `catseye simulate` or `catseye rcs`")
            .into())
    }

    /// Whether a file's name says that it is a table.
    pub fn is_table(path: &Path) -> bool {
        path.extension().is_some_and(|e| ["csv", "parquet"].iter().any(|end| e.eq_ignore_ascii_case(end)))
    }

    fn of_folder(path: &Path) -> Result<Thing> {
        // A dataset has a manifest too.
        let is_run = |p: &Path| p.join(MANIFEST).is_file() && !p.join(DATASET).is_file();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let index = name.strip_prefix("frame_").and_then(|n| n.parse().ok());
        if let (Some(index), Some(run)) = (index, path.parent().filter(|p| is_run(p))) {
            return Ok(Thing::Frame(run.to_path_buf(), index));
        }
        if path.join(DATASET).is_file() {
            return Ok(Thing::Dataset(path.to_path_buf()));
        }
        if is_run(path) && path.join("frame_000000").is_dir() {
            return Ok(Thing::Run(path.to_path_buf()));
        }
        if lanes::is_lanes(path) {
            return Err(BadInput::new("contains lane estimates without the frames in which they were found")
                .file(path)
                .remedy("give the run of the same scenario before it: catseye view RUN LANES")
                .into());
        }
        if is_run(path) && kind_of(path)? == "study" {
            return Ok(Thing::Study(path.to_path_buf()));
        }
        Err(BadInput::new("a page cannot show this folder: it has no manifest.json of studies or with frames beside it, and no dataset.json")
            .file(path)
            .remedy("give a folder that `catseye simulate`, `catseye dataset` or `catseye study` completed")
            .into())
    }

    /// Its page.
    ///
    /// # Errors
    /// Returns `BadInput` for files that are not what they should be.
    pub fn page(&self) -> Result<Page> {
        match self {
            Thing::Run(folder) => run::page(folder, None, None),
            Thing::Lanes(run, lanes) => match run.as_ref() {
                Thing::Run(folder) => run::page(folder, None, Some(lanes)),
                Thing::Frame(folder, index) => run::page(folder, Some(*index), Some(lanes)),
                other => other.page(),
            },
            Thing::Dataset(folder) => dataset::page(folder),
            Thing::Study(folder) => study::page(folder),
            Thing::Frame(folder, index) => run::page(folder, Some(*index), None),
            Thing::Rcs(paths) => rcs::page(&paths.iter().map(PathBuf::as_path).collect::<Vec<_>>(), None),
        }
    }
}

impl Page {
    /// The page of what `catseye view` is asked for: the folder of a run, a frame, a dataset or studies, a file of a mesh, a reflector, tables of cross
    /// sections, a mesh or reflector before its tables, or a run before its lane estimates. `note` gets what was dropped or assumed when a mesh was read.
    ///
    /// # Errors
    /// Returns `BadInput` for what no page can show.
    pub fn of(things: &[PathBuf], options: &ImportOptions, note: &dyn Fn(&str)) -> Result<Page> {
        let table = |p: &PathBuf| Thing::is_table(p);
        let read = |p: &Path| {
            let target = load(&p.to_string_lossy(), options)?;
            target.scene.import.notes.iter().for_each(|n| note(n));
            Ok::<_, Error>(target)
        };
        match things {
            [one] if !one.is_dir() && !table(one) => {
                let spec = one.to_string_lossy();
                if one.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
                    return Err(BadInput::new("a scenario, study or recipe cannot be shown before it is run")
                        .file(one)
                        .remedy("use --live for a scenario, or give the result of `catseye simulate` or `catseye study`")
                        .into());
                }
                if target::is_file(&spec) {
                    let target = read(one)?;
                    return Page::of_scene(&target.name, &target.scene);
                }
                let mut reflector = Reflector::parse(&spec)?;
                if let Some(material) = &options.default_material {
                    reflector.material.clone_from(material);
                }
                Ok(Page::of_design(&reflector))
            }
            [one, tables @ ..] if !tables.is_empty() && !table(one) && tables.iter().all(table) => {
                let tables: Vec<&Path> = tables.iter().map(PathBuf::as_path).collect();
                Page::of_target(&tables, &read(one)?.scene)
            }
            _ => Thing::of(things)?.page(),
        }
    }

    /// The page of tables of cross sections beside the target that they are of, which turns to where they are read.
    ///
    /// # Errors
    /// Returns `BadInput` for a file that is no table of cross sections, and for a target of more triangles than a page takes.
    pub fn of_target(tables: &[&Path], target: &Scene) -> Result<Page> {
        rcs::page(tables, Some(target))
    }

    /// The page of a scene by itself.
    ///
    /// # Errors
    /// Returns `BadInput` for a scene of more triangles than a page takes.
    pub fn of_scene(name: &str, whole: &Scene) -> Result<Page> {
        scene::small(name, whole)?;
        let data = json!({ "kind": "scene", "title": name, "scene": scene::scene(whole, &[0.0]) });
        Ok(Page::still(name.into(), data))
    }

    /// The page in which a reflector is designed, beginning with this one: its parameters with sliders, its shape and its cross section, which
    /// the page works out itself.
    pub fn of_design(reflector: &Reflector) -> Page {
        let spec = reflector.spec();
        let data = json!({ "kind": "design", "title": reflector.kind().name, "spec": spec, "version": env!("CARGO_PKG_VERSION") });
        Page { with: With::Physics, ..Page::still(reflector.kind().name.into(), data) }
    }
}
