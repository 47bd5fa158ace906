//! A dataset whose frames hold their echoes, from which frames of other radars are made.

use super::dataset::{DATASET, DatasetFile};
use super::echo_file::{COLUMNS, ECHOES, KeptEchoes, TRACES, assembled};
use super::recipe::Recipe;
use super::store::{Column, DatasetLayout};
use catseye::base::error::{BadInput, Error, Result};
use catseye::formats::stage::sha256_of_file;
use catseye::simulate::kept::KeptTrace;
use std::path::{Path, PathBuf};

/// The echoes of a dataset.
#[derive(Debug)]
pub struct KeptDataset {
    folder: PathBuf,
    layout: DatasetLayout,
    file: DatasetFile,
    /// SHA-256 of its `dataset.json`.
    digest: String,
}

impl KeptDataset {
    /// Opens the folder of a dataset.
    ///
    /// # Errors
    /// Returns `BadInput` for a folder that holds no dataset, or one without echoes.
    pub fn open(folder: &Path) -> Result<KeptDataset> {
        let file = DatasetFile::read(folder)?;
        let layout = DatasetLayout::open(folder)?;
        if layout.table(ECHOES).is_err() || layout.table(TRACES).is_err() {
            return Err(BadInput::new("the dataset was made without its echoes")
                .file(folder)
                .key("--from")
                .remedy("set keep.echoes = true in its recipe and make the dataset again")
                .into());
        }
        let digest = sha256_of_file(folder.join(DATASET))?;
        Ok(KeptDataset { folder: folder.into(), layout, file, digest })
    }

    /// The recipe with its frames made of these echoes.
    ///
    /// # Errors
    /// Returns `BadInput` for a recipe with other draws, more scenes or more frames of each.
    pub fn serving(self, mut recipe: Recipe) -> Result<Recipe> {
        let path = recipe.path().to_path_buf();
        let bad = |key: &str, value: u64, problem: &str, allowed: String| -> Error {
            let b = BadInput::new(problem).file(&path).key(key).value(value).allowed(allowed);
            b.remedy("give the values of the recipe of that dataset, or leave out --from").into()
        };
        if recipe.seed != self.file.seed {
            let (seed, own) = (recipe.seed, self.file.seed);
            return Err(bad(
                "seed",
                seed,
                "another seed draws scenes other than those that were traced",
                own.to_string(),
            ));
        }
        let (scenes, frames) = (self.file.scenes, self.file.frames_per_scene);
        if recipe.scenes > scenes {
            let problem = "the dataset has fewer scenes";
            return Err(bad("scenes", recipe.scenes.into(), problem, format!("up to {scenes}")));
        }
        if recipe.frames_per_scene > frames {
            let problem = "the scenes of the dataset have fewer frames";
            return Err(bad(
                "frames_per_scene",
                recipe.frames_per_scene.into(),
                problem,
                format!("up to {frames}"),
            ));
        }
        let digest = self.digest.clone();
        let give = Box::new(move |scene, index, radar: &str, alone| self.trace(scene, index, radar, alone));
        recipe.kept = Some(KeptEchoes { digest, give });
        Ok(recipe)
    }

    /// The echoes of a radar in a frame of a scene; of the only radar whatever its name.
    ///
    /// # Errors
    /// Returns `BadInput` for a radar that the dataset does not have, or a shard that is missing or damaged.
    pub fn trace(&self, scene: u32, index: u32, radar: &str, alone: bool) -> Result<KeptTrace> {
        let frame = u64::from(scene) * u64::from(self.file.frames_per_scene) + u64::from(index);
        let damaged = |what: &str| BadInput::new(format!("damaged: {what}")).file(&self.folder);
        let traces = self.layout.read_table(&self.folder, TRACES, frame)?;
        let (Some(Column::Text(names)), Some(Column::Text(origins))) =
            (traces.column("radar"), traces.column("origin"))
        else {
            return Err(damaged("the table of traces has unexpected columns").into());
        };
        let at = match (alone, &names[..]) {
            (true, [_]) => 0,
            _ => names.iter().position(|n| n == radar).ok_or_else(|| {
                BadInput::new("the dataset has no radar of this name")
                    .file(&self.folder)
                    .key("radars.name")
                    .value(radar)
                    .allowed(names.join(", "))
                    .remedy("use the name of the radar in the dataset")
            })?,
        };
        let name = &names[at];
        assembled(origins[at].as_bytes(), &self.folder, &self.folder, &|width| {
            let table = self.layout.read_table(&self.folder, ECHOES, frame)?;
            let of: Option<Vec<&Vec<f64>>> = COLUMNS
                .iter()
                .map(|name| match table.column(name) {
                    Some(Column::F64(numbers)) => Some(numbers),
                    _ => None,
                })
                .collect();
            let (Some(Column::Text(radars)), Some(of), true) =
                (table.column("radar"), of, width == COLUMNS.len())
            else {
                return Err(damaged("the table of echoes has unexpected columns").into());
            };
            let rows = radars.iter().enumerate().filter(|(_, r)| *r == name);
            let numbers: Vec<f64> = rows.flat_map(|(i, _)| of.iter().map(move |c| c[i])).collect();
            match numbers.iter().all(|x| x.is_finite()) {
                true => Ok(numbers),
                false => Err(damaged(&format!("an echo of frame {frame} is not finite")).into()),
            }
        })
    }
}
