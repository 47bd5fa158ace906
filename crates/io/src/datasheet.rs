//! Description of a complete dataset: README, schema, statistics, pictures of some frames, and the manifest
//! with the checksum of every file.

use super::cards::{CROISSANT, croissant, front_matter};
use super::dataset::{DATASET, DatasetFile, Device, Marker, drawn_scene, frames_of, ready, write_json};
use super::files::{PICTURES_BYTES, Truth};
use super::recipe::{Recipe, SPLITS};
use super::rows::TRUTH_RANGE_M;
use super::run::Pictures;
use super::store::{ArraySpec, DatasetLayout, LAYOUT};
use super::tally::{ClassTally, Tally};
use catseye::base::control::Control;
use catseye::base::error::{Error, Result};
use catseye::engine::Engine;
use catseye::formats::stage::{self, MANIFEST, sha256_of_file};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Name of the text for readers.
pub const README: &str = "README.md";
/// Name of the file that describes arrays and columns.
pub const SCHEMA: &str = "schema.json";
/// Name of the file of counts.
pub const STATISTICS: &str = "statistics.json";
/// Folder of the pictures.
pub const PREVIEWS: &str = "previews";
/// Number of frames of which pictures are made.
pub const PICTURED: u32 = 4;

/// A dataset whose shards are all complete.
pub struct Made<'a> {
    /// The recipe from which it was made.
    pub recipe: &'a Recipe,
    /// Its `dataset.json`.
    pub file: &'a DatasetFile,
    /// Layout of its arrays and tables.
    pub layout: &'a DatasetLayout,
    /// Markers of its shards.
    pub markers: &'a [Marker],
    /// Counts over all frames.
    pub tally: &'a Tally,
    /// Size of all shards, bytes.
    pub bytes: u64,
}

/// Content of the `manifest.json` of a dataset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatasetManifest {
    /// Version of catseye.
    pub catseye: String,
    /// Name of the dataset.
    pub name: String,
    /// Name of the recipe's file.
    pub recipe: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Devices that made shards, in the order of the shards.
    pub devices: Vec<Device>,
    /// Rules by which `auto` chose the engines that made shards, in the order of the shards: in the file a text, or a list where there
    /// are several. Shards of an engine that was named followed none.
    #[serde(default, skip_serializing_if = "Vec::is_empty", with = "one_or_several")]
    pub engine_rule: Vec<String>,
    /// Number of frames.
    pub frames: u64,
    /// Number of shards.
    pub shards: u64,
    /// SHA-256 of every other file, by path.
    pub checksums: BTreeMap<String, String>,
}

/// Whether a name is that of a file under construction.
pub fn is_unfinished(name: &str) -> bool {
    name.starts_with('.') && name.contains(".partial")
}

/// Whether a file outside the shards belongs to a dataset.
pub fn is_own(name: &str, shards: u64) -> bool {
    let marker = || (0..shards).any(|s| name == Marker::name(s));
    [DATASET, LAYOUT, README, SCHEMA, STATISTICS, CROISSANT, MANIFEST].contains(&name)
        || name == "zarr.json"
        || name.ends_with("/zarr.json")
        || (name.starts_with(PREVIEWS) && name.ends_with(".png"))
        || (name.starts_with("shards/") && marker())
}

/// Writes the whole description, the manifest last.
///
/// # Errors
/// Returns an error if a picture cannot be made, or a file cannot be read or written.
pub fn write(engine: &Engine, made: &Made<'_>, out: &Path, pictures: Pictures<'_>) -> Result<()> {
    tidy(out, false)?;
    write_json(out, STATISTICS, &statistics(made))?;
    write_json(out, SCHEMA, &schema(made.layout))?;
    let pictured = previews(engine, made.recipe, out, pictures)?;
    write_json(out, CROISSANT, &croissant(made.file, made.layout))?;
    let readme = front_matter(made.file, made.layout) + &readme(made, &pictured);
    stage::write_file(out.join(README), true, readme.as_bytes())?;
    let mut known: BTreeMap<&str, &str> = BTreeMap::new();
    for file in made.markers.iter().flat_map(|m| &m.files) {
        known.insert(&file.path, &file.sha256);
    }
    let mut checksums = BTreeMap::new();
    for name in stage::files_of(out)? {
        if name == MANIFEST || name.split('/').any(is_unfinished) {
            continue;
        }
        match known.get(name.as_str()) {
            Some(sum) => checksums.insert(name.clone(), sum.to_string()),
            None if is_own(&name, made.layout.shards()) => {
                checksums.insert(name.clone(), sha256_of_file(out.join(&name))?)
            }
            // A foreign file, which `catseye verify` reports.
            None => None,
        };
    }
    let manifest = DatasetManifest {
        catseye: made.file.catseye.clone(),
        name: made.file.name.clone(),
        recipe: made.file.recipe.clone(),
        seed: made.file.seed,
        devices: distinct(made.markers.iter().map(|m| &m.device)),
        engine_rule: distinct(made.markers.iter().filter_map(|m| m.engine_rule.as_ref())),
        frames: made.layout.frames,
        shards: made.layout.shards(),
        checksums,
    };
    write_json(out, MANIFEST, &manifest)
}

/// The different ones among these, in the order in which they first come.
fn distinct<'a, T: Clone + PartialEq + 'a>(all: impl Iterator<Item = &'a T>) -> Vec<T> {
    let mut found = Vec::new();
    for one in all {
        if !found.contains(one) {
            found.push(one.clone());
        }
    }
    found
}

/// A list that is a text in the file where it has one entry, as all manifests had it before several runs could share a folder.
mod one_or_several {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Kept {
        One(String),
        Several(Vec<String>),
    }

    pub fn serialize<S: Serializer>(list: &[String], s: S) -> Result<S::Ok, S::Error> {
        match list {
            [one] => one.serialize(s),
            several => several.serialize(s),
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<String>, D::Error> {
        Ok(match Kept::deserialize(d)? {
            Kept::One(one) => vec![one],
            Kept::Several(several) => several,
        })
    }
}

/// Removes what ended runs left. All shards are complete, so nobody works on one; the files at the top and
/// the pictures may be in use by another run, unless this one is `alone`.
///
/// # Errors
/// Returns an error if a folder cannot be read or a file cannot be removed.
pub fn tidy(out: &Path, alone: bool) -> Result<()> {
    fn walk(dir: &Path, spare_files: bool, alone: bool) -> Result<()> {
        for entry in fs::read_dir(dir).map_err(|e| Error::io(dir, e))? {
            let entry = entry.map_err(|e| Error::io(dir, e))?;
            let path = entry.path();
            let name = entry.file_name().to_string_lossy().into_owned();
            let is_dir = entry.file_type().map_err(|e| Error::io(&path, e))?.is_dir();
            let gone = match (is_unfinished(&name), is_dir) {
                (true, true) => fs::remove_dir_all(&path),
                (true, false) if !spare_files => fs::remove_file(&path),
                (false, true) if alone || name != PREVIEWS => {
                    walk(&path, false, alone)?;
                    Ok(())
                }
                _ => Ok(()),
            };
            match gone {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(Error::io(&path, e)),
                _ => {}
            }
        }
        Ok(())
    }
    walk(out, !alone, alone)
}

/// Makes pictures of the first frames of some scenes, spread over the dataset, and returns the frames'
/// numbers.
fn previews(engine: &Engine, recipe: &Recipe, out: &Path, pictures: Pictures<'_>) -> Result<Vec<u64>> {
    let n = PICTURED.min(recipe.scenes);
    let draw = |k: u32| -> Result<u64> {
        let scene = (u64::from(k) * u64::from(recipe.scenes) / u64::from(n)) as u32;
        let number = u64::from(scene) * u64::from(recipe.frames_per_scene);
        let folder = out.join(PREVIEWS).join(format!("frame_{number:06}"));
        if folder.is_dir() {
            return Ok(number);
        }
        let site = drawn_scene(recipe, scene)?;
        let prepared = ready(recipe, &site)?;
        let temporary = folder.with_file_name(format!(".frame_{number:06}.partial-{}", std::process::id()));
        for frame in frames_of(engine, &site, &prepared, 0, Control::default())? {
            let radar = &site.scenario.radars[frame.radar];
            let dir = match site.scenario.radars.len() {
                1 => temporary.clone(),
                _ => temporary.join(&radar.name),
            };
            fs::create_dir_all(&dir).map_err(|e| Error::io(&dir, e))?;
            let truth = Truth::new(&site.scenario, &site.scene, &frame, site.road.as_ref());
            pictures(&site.scenario, &site.scene, &frame, &truth, &dir)?;
        }
        match fs::rename(&temporary, &folder) {
            // Another run was faster; its pictures are the same.
            Err(_) if folder.is_dir() => {
                fs::remove_dir_all(&temporary).map_err(|e| Error::io(&temporary, e))?
            }
            Err(e) => return Err(Error::io(&folder, e)),
            Ok(()) => {}
        }
        Ok(number)
    };
    (0..n).into_par_iter().map(draw).collect()
}

/// Approximate size of the datasheet's pictures, markers and checksums beside the shards, bytes: a file of a
/// shard has two lines of some 100 bytes.
pub fn expected_bytes(recipe: &Recipe, radars: usize, files: u64) -> u64 {
    u64::from(PICTURED.min(recipe.scenes)) * PICTURES_BYTES * radars as u64 + 300 * files
}

/// Content of `statistics.json`.
fn statistics(made: &Made<'_>) -> serde_json::Value {
    let t = made.tally;
    let mean = |n: u64| n as f64 / t.frames.max(1) as f64;
    serde_json::json!({
        "frames": t.frames,
        "scenes": t.scenes,
        "frames_of_split": t.splits,
        "bytes": made.bytes,
        "bytes_a_frame": mean(made.bytes),
        "array_bytes_a_frame_uncompressed": made.layout.array_bytes(),
        "points": t.points_a_frame.map(|_| t.points),
        "points_a_frame": { "mean": t.points_a_frame.map(|_| mean(t.points)), "least_and_greatest": t.points_a_frame },
        "echoes_a_frame_mean": mean(t.echoes),
        "rows_a_frame_most": t.rows_a_frame_most,
        "points_by_snr_db": { "bin_db": super::tally::SNR_BIN_DB, "counts": t.snr_db },
        "trace_fallbacks": t.trace_fallbacks,
        "points_by_range_m": { "bin_m": super::tally::RANGE_BIN_M, "counts": t.range_m },
        "classes": t.classes,
        "vehicles_drawn_again": t.redrawn,
        "vehicles_left_out": t.dropped,
    })
}

/// Content of `schema.json`: what is stored, with types, shapes, units and meanings.
fn schema(layout: &DatasetLayout) -> serde_json::Value {
    let arrays: serde_json::Map<String, serde_json::Value> = layout
        .arrays
        .iter()
        .map(|a| {
            let mut dims = vec!["frame".to_string()];
            dims.extend(a.dims.iter().cloned());
            let mut shape = vec![layout.frames];
            shape.extend(a.shape.iter().map(|n| *n as u64));
            let v = serde_json::json!({
                "type": a.kind, "dims": dims, "shape": shape, "unit": a.unit, "about": a.about,
            });
            (a.name.clone(), v)
        })
        .collect();
    let tables: serde_json::Map<String, serde_json::Value> = layout
        .tables
        .iter()
        .map(|t| {
            let mut columns = serde_json::Map::new();
            columns.insert(
                "frame".into(),
                serde_json::json!({ "type": "int64", "about": "number of the frame" }),
            );
            for c in &t.columns {
                columns.insert(c.name.clone(), serde_json::json!({ "type": c.kind, "about": c.about }));
            }
            (t.name.clone(), serde_json::json!({ "about": t.about, "columns": columns }))
        })
        .collect();
    serde_json::json!({
        "format": layout.format,
        "compression": layout.compression,
        "frames": layout.frames,
        "frames_per_shard": layout.frames_per_shard,
        "axes": "ISO 8855: x forward, y left, z up; metres, seconds, degrees; units are the ends of names",
        "arrays": arrays,
        "tables": tables,
    })
}

fn readme(made: &Made<'_>, pictured: &[u64]) -> String {
    let (f, l, t) = (made.file, made.layout, made.tally);
    let devices: BTreeSet<String> = made.markers.iter().map(|m| m.device.to_string()).collect();
    let devices = devices.into_iter().collect::<Vec<_>>().join("; ");
    let splits = SPLITS.iter().zip(made.recipe.split_counts());
    let splits: String = splits
        .map(|(name, n)| format!("| {name} | {n} | {} |\n", t.splits.get(*name).copied().unwrap_or(0)))
        .collect();
    let array = |a: &ArraySpec| {
        let (dims, kind) = (a.dims.join(", "), a.kind.name());
        format!("| `{}` | {dims} | {:?} | {kind} | {} |\n", a.name, a.shape, a.unit)
    };
    let mut arrays: String = l.arrays.iter().map(array).collect();
    if !arrays.is_empty() {
        arrays =
            format!("| array | axes | shape of a frame | type | unit |\n|---|---|---|---|---|\n{arrays}\n");
    }
    let tables: String = l.tables.iter().map(|t| format!("| `{}` | {} |\n", t.name, t.about)).collect();
    let class = |(class, n): (&String, &ClassTally)| {
        let name = if class.is_empty() { "(none)" } else { class };
        format!(
            "| {name} | {} | {} | {} | {} | {} | {} |\n",
            n.objects, n.points, n.ghosts, n.side_lobes, n.folded, n.aliased
        )
    };
    let classes: String = t.classes.iter().map(class).collect();
    let mut limits = String::new();
    if t.dropped > 0 {
        limits += &format!("* {} vehicles were left out because no draw gave them room.\n", t.dropped);
    }
    if t.redrawn > 0 {
        limits += &format!(
            "* Places of vehicles were drawn again {} times because two stood in one another, so near neighbours are rarer than the recipe's distributions say.\n",
            t.redrawn
        );
    }
    for (why, n) in &t.trace_fallbacks {
        limits += &format!(
            "* Of {n} frames the device left the beams to the host, in f64: it met {why}. They are as accurate as the others.\n"
        );
    }
    let pictures: String =
        pictured.iter().map(|k| format!("* frame {k}: `{PREVIEWS}/frame_{k:06}/`\n")).collect();
    let mean = |n: u64| n as f64 / t.frames.max(1) as f64;
    let points = t.points_a_frame.map_or_else(
        || "No points are made".to_string(),
        |[least, greatest]| format!("{:.1} points a frame ({least} to {greatest})", mean(t.points)),
    );
    format!(
        "# {name}

{frames} frames of automotive radar, simulated: {scenes} scenes with {of_scene} frame{s} each. Nothing here was measured.

## How it was made

catseye {version}, seed {seed}, recipe {recipe}. The recipe is `recipe_text` of `{DATASET}`:

```
catseye dataset recipe.toml -o DIR --seed {seed}
```

Each scene is drawn from (seed, number of the scene) alone, noise and speckle from (seed of the scene, number of the frame): any frame can be made again by itself. `catseye dataset recipe.toml --scene 17 -o DIR` writes a scene for `catseye simulate`, `catseye verify DIR` checks this folder.

Made on: {devices}.

## Parts

All frames of a scene are in one part (column `split` of table `frames`).

| part | scenes | frames |
|---|---|---|
{splits}
## What is in a frame

Format {format}, compression {compression}, {of_shard} frames a shard, {bytes:.0} bytes a frame as stored. Types, units and meanings of all columns: `{SCHEMA}`.

{arrays}| table | rows |
|---|---|
{tables}
Axes are those of ISO 8855: x forward, y left, z up. Points are in the frame of their radar, truth and poses in the world; a rotation (x, y, z, w) turns from the one to the other. Range rates are positive when the target recedes. Lanes, lines and markers reach {TRUTH_RANGE_M} m around the vehicle. `object_id` of points is `id` of `boxes` in the same frame, 0 for none. Rows of `boxes` with an empty `part` are wholes, one for each car, around all of its parts; `parent_id` of any row is the `id` of its whole.

## Statistics

{points}, {echoes:.0} echoes a frame. More in `{STATISTICS}`.

| class | objects in all scenes | points | ghosts among them | side lobes among them | folded | aliased |
|---|---|---|---|---|---|---|
{classes}
## Licence of the data

{licence}

## Limits

* Simulated echoes: what the simulator leaves out, the data leave out (README of catseye).
* Labels of points name the object whose echoes made them; `ghost`, `side_lobe`, `folded` and `aliased` mark those that are not on it. Points that no object made have `object_id` 0 and the class leakage, noise or weather.
{limits}
## Pictures

{pictures}",
        name = f.name,
        frames = l.frames,
        scenes = f.scenes,
        of_scene = f.frames_per_scene,
        s = if f.frames_per_scene == 1 { "" } else { "s" },
        version = f.catseye,
        seed = f.seed,
        recipe = f.recipe,
        format = l.format.name(),
        compression = l.compression,
        of_shard = l.frames_per_shard,
        bytes = made.bytes as f64 / l.frames as f64,
        echoes = mean(t.echoes),
        licence = f.licence.as_deref().unwrap_or("Not stated by its maker."),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(engine_rule: &[&str]) -> DatasetManifest {
        DatasetManifest {
            catseye: String::new(),
            name: String::new(),
            recipe: String::new(),
            seed: 0,
            devices: Vec::new(),
            engine_rule: engine_rule.iter().map(|rule| rule.to_string()).collect(),
            frames: 0,
            shards: 0,
            checksums: BTreeMap::new(),
        }
    }

    #[test]
    fn manifests_list_different_rules_and_read_a_single_one() {
        for (rules, text) in [
            (&[][..], None),
            (&["auto"][..], Some(serde_json::json!("auto"))),
            (&["auto", "other"][..], Some(serde_json::json!(["auto", "other"]))),
        ] {
            let json = serde_json::to_value(manifest(rules)).unwrap();
            assert_eq!(json.get("engine_rule"), text.as_ref());
            assert_eq!(serde_json::from_value::<DatasetManifest>(json).unwrap(), manifest(rules));
        }
        let list = ["b", "a", "b", "c", "a"].map(String::from);
        assert_eq!(distinct(list.iter()), ["b", "a", "c"]);
    }
}
