//! Where frames to learn from lie: folders of runs, and datasets in any format.

use crate::scan::GridKind;
use catseye::base::error::{BadInput, Error, Result};
use catseye::detect::grid::PointGrid;
use catseye::formats::npy;
use catseye_io::dataset::DATASET;
use catseye_io::store::{Column, Data, DatasetLayout};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The file of a frame's points.
pub(crate) const POINTS: &str = "points.csv";

/// One frame of one radar, not read yet.
#[derive(Debug, Clone)]
pub struct Source {
    /// Number of its scene: a run is one, a dataset has many. Scenes of different folders have different numbers.
    pub scene: usize,
    /// Which set the dataset puts it into, `train`, `validation` or `test`; None in a run.
    pub split: Option<String>,
    pub(crate) at: Place,
}

#[derive(Debug, Clone)]
pub(crate) enum Place {
    /// A frame's folder.
    Folder(PathBuf),
    /// A frame of a dataset: of grids, of the radar whose arrays end with `suffix`; of points, of the radar of this name.
    Stored { store: Arc<Store>, frame: u64, suffix: String },
}

#[derive(Debug)]
pub(crate) struct Store {
    pub(crate) dir: PathBuf,
    pub(crate) layout: DatasetLayout,
}

impl Source {
    /// Number of its frame, and the name of its radar; the latter is empty where the frame has one radar only.
    pub fn name(&self) -> (u64, String) {
        match &self.at {
            Place::Stored { frame, suffix, .. } => (*frame, suffix.clone()),
            Place::Folder(folder) => {
                let name = |f: &Path| f.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let number = |f: &Path| name(f).strip_prefix("frame_").and_then(|n| n.parse().ok());
                match number(folder) {
                    Some(frame) => (frame, String::new()),
                    None => (folder.parent().and_then(number).unwrap_or(0), name(folder)),
                }
            }
        }
    }

    /// What the radar measured in each cell of a grid.
    ///
    /// # Errors
    /// Returns `BadInput` if the grid is missing, of another size, or holds a value that is not finite.
    pub fn points(&self, kind: GridKind) -> Result<PointGrid> {
        let (grid, name) = (kind.grid(), format!("grid_{}", kind.name()));
        let data = match &self.at {
            Place::Folder(frame) => {
                let path = frame.join(format!("{name}.npy"));
                let array = npy::read_f32(&path)?;
                check_shape(&path, &array.shape, &[4, grid.rows, grid.columns])?;
                npy::check_finite(&path, &array, f32::is_finite)?;
                array.data
            }
            Place::Stored { store, frame, suffix } => {
                let array = store.layout.read_array(&store.dir, &format!("{name}{suffix}"), *frame)?;
                check_shape(&store.dir, &array.shape, &[4, grid.rows, grid.columns])?;
                let Data::F32(data) = array.data else {
                    return Err(other_type(&store.dir, &name, "float32").into());
                };
                if let Some(wrong) = data.iter().find(|v| !v.is_finite()) {
                    let bad = BadInput::new("a value is not finite").file(&store.dir).key(name).value(wrong);
                    return Err(bad.allowed("finite numbers").remedy("make the dataset again").into());
                }
                data
            }
        };
        let plane = |k: usize| data[k * grid.cells()..(k + 1) * grid.cells()].to_vec();
        Ok(PointGrid { grid, count: plane(0), amplitude: plane(1), range_m: plane(2), azimuth_rad: plane(3) })
    }

    /// The number of the true class of each cell, `[row, column]`, and the file for complaints about them.
    ///
    /// # Errors
    /// Returns `BadInput` if the mask is missing or of another size.
    pub fn mask(&self, kind: GridKind) -> Result<(Vec<u8>, PathBuf)> {
        let (grid, name) = (kind.grid(), format!("mask_{}", kind.name()));
        let (path, array) = match &self.at {
            Place::Folder(frame) => {
                let path = frame.join(format!("{name}.npy"));
                if !path.exists() {
                    return Err(without_masks(&path).into());
                }
                let array = npy::read::<u8>(&path)?;
                (path, (array.shape, array.data))
            }
            Place::Stored { store, frame, suffix } => {
                let array = store.layout.read_array(&store.dir, &format!("{name}{suffix}"), *frame)?;
                match array.data {
                    Data::U8(data) => (store.dir.clone(), (array.shape, data)),
                    _ => return Err(other_type(&store.dir, &name, "uint8").into()),
                }
            }
        };
        check_shape(&path, &array.0, &[grid.rows, grid.columns])?;
        Ok((array.1, path))
    }
}

fn other_type(dir: &Path, array: &str, allowed: &str) -> BadInput {
    let bad = BadInput::new("the array has another type").file(dir).key(array).allowed(allowed);
    bad.remedy("make the dataset with this version of catseye")
}

fn check_shape(path: &Path, found: &[usize], wanted: &[usize]) -> Result<()> {
    if found == wanted {
        return Ok(());
    }
    let bad = BadInput::new("the grid has another size").file(path).key("shape").value(format!("{found:?}"));
    Err(bad.allowed(format!("{wanted:?}")).remedy("use a run that this version of catseye simulated").into())
}

fn without_masks(path: &Path) -> BadInput {
    let bad = BadInput::new("the run has no masks").file(path).key("masks").value("false").allowed("true");
    bad.remedy("set masks = true in [output] of the scenario and simulate it again")
}

/// All frames of some folders that hold grids of this kind, each of a run or a dataset, in order.
///
/// # Errors
/// Returns `BadInput` if a folder is missing, holds no frames, or its frames have no grids.
pub fn sources(folders: &[PathBuf], kind: GridKind) -> Result<Vec<Source>> {
    all_of(folders, Some(kind))
}

/// All frames of some folders that hold points, each of a run or a dataset, in order: one for each radar of a frame.
///
/// # Errors
/// Returns `BadInput` if a folder is missing, holds no frames, or its frames have no points.
pub fn point_sources(folders: &[PathBuf]) -> Result<Vec<Source>> {
    all_of(folders, None)
}

/// Frames with grids of a kind, or with points.
fn all_of(folders: &[PathBuf], grids: Option<GridKind>) -> Result<Vec<Source>> {
    let (mut all, mut scenes) = (Vec::new(), 0);
    for folder in folders {
        let found = of_folder(folder, grids)?;
        let next = found.iter().map(|s| s.scene + 1).max().unwrap_or(0);
        all.extend(found.into_iter().map(|s| Source { scene: scenes + s.scene, ..s }));
        scenes += next;
    }
    Ok(all)
}

fn of_folder(folder: &Path, grids: Option<GridKind>) -> Result<Vec<Source>> {
    if !folder.is_dir() {
        let bad = BadInput::new("is not the folder of a run or a dataset").file(folder);
        return Err(bad.remedy("give a folder that catseye simulate or catseye dataset wrote").into());
    }
    match (folder.join(DATASET).is_file(), grids) {
        (false, _) => of_run(folder, grids),
        (true, Some(kind)) => grids_of_dataset(folder, kind),
        (true, None) => points_of_dataset(folder),
    }
}

fn of_run(run: &Path, grids: Option<GridKind>) -> Result<Vec<Source>> {
    let frames: Vec<PathBuf> = folders(run)?
        .into_iter()
        .filter(|f| f.file_name().is_some_and(|n| n.to_string_lossy().starts_with("frame_")))
        .collect();
    let name = grids.map_or_else(|| POINTS.to_string(), |kind| format!("grid_{}.npy", kind.name()));
    let mut found = Vec::new();
    for frame in &frames {
        // With several radars each has a folder in that of the frame.
        let inner = folders(frame)?;
        found.extend(std::iter::once(frame.clone()).chain(inner).filter(|f| f.join(&name).is_file()));
    }
    match (frames.first(), found.is_empty()) {
        (None, _) => {
            let bad = BadInput::new("contains no frames").file(run);
            Err(bad.remedy("give a folder that catseye simulate or catseye dataset wrote").into())
        }
        (Some(first), true) if grids.is_some() => Err(without_masks(&first.join(name)).into()),
        (Some(first), true) => {
            let bad =
                BadInput::new("the run has no points").file(first.join(name)).key("points").value("false");
            let remedy = "set points = true in [output] of the scenario and simulate it again";
            Err(bad.allowed("true").remedy(remedy).into())
        }
        _ => Ok(found.into_iter().map(|f| Source { scene: 0, split: None, at: Place::Folder(f) }).collect()),
    }
}

/// Frames with grids of a dataset's complete shards.
fn grids_of_dataset(dir: &Path, kind: GridKind) -> Result<Vec<Source>> {
    let layout = DatasetLayout::open(dir)?;
    let base = format!("grid_{}", kind.name());
    let suffixes: Vec<String> =
        layout.arrays.iter().filter_map(|a| a.name.strip_prefix(&base).map(String::from)).collect();
    if suffixes.is_empty() {
        let bad = BadInput::new("the dataset has no masks").file(dir).key("keep.masks").value("false");
        let remedy = "set masks = true in [keep] of the recipe and make the dataset again";
        return Err(bad.allowed("true").remedy(remedy).into());
    }
    of_dataset(dir, layout, &|_, _| Ok(suffixes.clone()))
}

/// Frames with points of a dataset's complete shards.
fn points_of_dataset(dir: &Path) -> Result<Vec<Source>> {
    let layout = DatasetLayout::open(dir)?;
    if !layout.tables.iter().any(|t| t.name == "points") {
        let bad = BadInput::new("the dataset has no points").file(dir).key("keep.points").value("false");
        let remedy = "set points = true in [keep] of the recipe and make the dataset again";
        return Err(bad.allowed("true").remedy(remedy).into());
    }
    of_dataset(dir, layout, &|store, frame| {
        let radars = store.layout.read_table(&store.dir, "radars", frame)?;
        match radars.columns.into_iter().find(|(name, _)| name == "radar") {
            Some((_, Column::Text(names))) => Ok(names),
            _ => {
                let bad = BadInput::new("the table does not name its radars").file(dir).key("radars");
                Err(bad.remedy("make the dataset with this version of catseye").into())
            }
        }
    })
}

/// One source for each radar of each frame.
fn of_dataset(
    dir: &Path,
    layout: DatasetLayout,
    radars: &dyn Fn(&Store, u64) -> Result<Vec<String>>,
) -> Result<Vec<Source>> {
    let store = Arc::new(Store { dir: dir.to_path_buf(), layout });
    let mut scenes: BTreeMap<u32, usize> = BTreeMap::new();
    let mut found = Vec::new();
    for frame in 0..store.layout.frames {
        let row = store.layout.read_table(dir, "frames", frame)?;
        let column = |name: &str| row.columns.iter().find(|(n, _)| n == name).map(|(_, c)| c);
        let (Some(Column::U32(scene)), Some(Column::Text(split))) = (column("scene"), column("split")) else {
            let bad = BadInput::new("is not the table of the frames of a dataset").file(dir).key("frames");
            return Err(bad.remedy("make the dataset with this version of catseye").into());
        };
        let (Some(scene), Some(split)) = (scene.first(), split.first()) else {
            let bad =
                BadInput::new("the table lacks the row of a frame").file(dir).key("frames").value(frame);
            return Err(bad.remedy("make the dataset with this version of catseye").into());
        };
        let next = scenes.len();
        let scene = *scenes.entry(*scene).or_insert(next);
        found.extend(radars(&store, frame)?.into_iter().map(|suffix| Source {
            scene,
            split: Some(split.clone()),
            at: Place::Stored { store: store.clone(), frame, suffix },
        }));
    }
    Ok(found)
}

fn folders(of: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(of).map_err(|e| Error::io(of, e))? {
        let path = entry.map_err(|e| Error::io(of, e))?.path();
        if path.is_dir() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
