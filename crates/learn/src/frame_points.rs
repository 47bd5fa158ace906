//! Points of frames as they are stored: what the radar measured, and what the simulation knows of each.

use crate::cloud::{Cloud, MeasuredPoint};
use crate::source::{POINTS, Place, Source, Store};
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::frames::{Pose, Sensor, World};
use catseye::detect::columns::OUT_OF_PLACE;
use catseye::formats::csv::Table;
use catseye::formats::input;
use catseye::road::mask::{CellClass, Level};
use catseye_io::store::Column;
use glam::{DQuat, DVec3};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// What of `truth.json` is needed: how the radar stands in the world.
#[derive(Deserialize)]
struct Truth {
    radar: PoseRead,
}

#[derive(Deserialize)]
struct PoseRead {
    position_m: [f64; 3],
    rotation_xyzw: [f64; 4],
}

/// Columns of the points of one radar in one frame.
struct Columns {
    /// The file or folder, for complaints.
    path: PathBuf,
    /// Numbers of its rows in a table that holds several radars.
    rows: Vec<usize>,
    held: Held,
}

enum Held {
    Text(Table),
    Stored(Vec<(String, Column)>),
}

impl Columns {
    fn read(source: &Source) -> Result<Columns> {
        match &source.at {
            Place::Folder(folder) => {
                let path = folder.join(POINTS);
                let table = Table::read(&path)?;
                Ok(Columns { path, rows: (0..table.len()).collect(), held: Held::Text(table) })
            }
            Place::Stored { store, frame, suffix } => {
                let columns = store.layout.read_table(&store.dir, "points", *frame)?.columns;
                let mut all =
                    Columns { path: store.dir.clone(), rows: Vec::new(), held: Held::Stored(columns) };
                let radars = match all.stored("radar") {
                    Some(Column::Text(names)) => names,
                    _ => return Err(all.without("radar").into()),
                };
                let own = |(row, name): (usize, &String)| (name == suffix).then_some(row);
                all.rows = radars.iter().enumerate().filter_map(own).collect();
                Ok(all)
            }
        }
    }

    fn stored(&self, name: &str) -> Option<&Column> {
        match &self.held {
            Held::Stored(columns) => columns.iter().find(|(n, _)| n == name).map(|(_, c)| c),
            Held::Text(_) => None,
        }
    }

    fn without(&self, name: &str) -> BadInput {
        let bad = BadInput::new("the points have no such column").file(&self.path).key(name);
        bad.remedy("simulate again with this version of catseye")
    }

    /// Values of all rows that are this radar's.
    fn own<T: Clone>(&self, all: &[T]) -> Vec<T> {
        self.rows.iter().filter_map(|row| all.get(*row)).cloned().collect()
    }

    fn numbers(&self, name: &str) -> Result<Vec<f64>> {
        match (&self.held, self.stored(name)) {
            (Held::Text(table), _) => table.numbers(name),
            (_, Some(Column::F64(all))) => Ok(self.own(all)),
            _ => Err(self.without(name).into()),
        }
    }

    fn finite(&self, name: &str) -> Result<Vec<f64>> {
        let numbers = self.numbers(name)?;
        match numbers.iter().position(|v| !v.is_finite()) {
            None => Ok(numbers),
            Some(row) => {
                let mut bad = BadInput::new("is not finite").file(&self.path).key(name).value(numbers[row]);
                if let Held::Text(table) = &self.held {
                    bad = bad.line(table.line(row));
                }
                Err(bad.remedy("simulate again with this version of catseye").into())
            }
        }
    }

    fn text(&self, name: &str) -> Result<Vec<String>> {
        match (&self.held, self.stored(name)) {
            (Held::Text(table), _) => Ok(table.text(name)?.into_iter().map(String::from).collect()),
            (_, Some(Column::Text(all))) => Ok(self.own(all)),
            _ => Err(self.without(name).into()),
        }
    }

    /// A flag; false in the results of versions that did not have it.
    fn flag(&self, name: &str) -> Result<Vec<bool>> {
        match (&self.held, self.stored(name)) {
            (Held::Text(table), _) if table.has(name) => {
                Ok(table.text(name)?.iter().map(|cell| matches!(&**cell, "1" | "true")).collect())
            }
            (_, Some(Column::Bool(all))) => Ok(self.own(all)),
            (_, Some(_)) => Err(self.without(name).into()),
            _ => Ok(vec![false; self.rows.len()]),
        }
    }
}

/// How the radar of a frame stands in the world.
fn pose(source: &Source) -> Result<Pose<Sensor, World>> {
    let (position, rotation, path) = match &source.at {
        Place::Folder(folder) => {
            let path = folder.join("truth.json");
            let bad = |problem: String| {
                let remedy = "set truth = true in [output] of the scenario and simulate it again";
                BadInput::new(problem).file(&path).key("radar").remedy(remedy)
            };
            if !path.is_file() {
                return Err(bad("the frame does not state the pose of its radar".into()).into());
            }
            let bytes = input::read(&path, "the truth of a frame", input::LARGEST_TEXT)?;
            let truth: Truth = serde_json::from_slice(&bytes)
                .map_err(|e| bad(format!("is not the truth of a frame: {e}")))?;
            (truth.radar.position_m, truth.radar.rotation_xyzw, path)
        }
        Place::Stored { store, frame, suffix } => stored_pose(store, *frame, suffix)?,
    };
    let rotation = DQuat::from_array(rotation);
    let position = DVec3::from_array(position);
    if !(rotation.is_finite() && rotation.length() > 0.5 && position.is_finite()) {
        let bad = BadInput::new("is not a pose of a radar").file(path).key("radar").value(rotation);
        return Err(bad.remedy("simulate again with this version of catseye").into());
    }
    Ok(Pose::new(rotation.normalize(), position))
}

fn stored_pose(store: &Store, frame: u64, radar: &str) -> Result<([f64; 3], [f64; 4], PathBuf)> {
    let table = store.layout.read_table(&store.dir, "radars", frame)?;
    let of = |name: &str| table.columns.iter().find(|(n, _)| n == name).map(|(_, c)| c);
    let row = match of("radar") {
        Some(Column::Text(names)) => names.iter().position(|n| n == radar),
        _ => None,
    };
    let number = |name: &str| match (of(name), row) {
        (Some(Column::F64(all)), Some(row)) if row < all.len() => Ok(all[row]),
        _ => {
            let bad = BadInput::new("the radars have no such column").file(&store.dir).key(name);
            Err(Error::from(bad.remedy("make the dataset with this version of catseye")))
        }
    };
    let position = [number("x_m")?, number("y_m")?, number("z_m")?];
    let r = |axis: &str| number(&format!("rotation_{axis}"));
    Ok((position, [r("x")?, r("y")?, r("z")?, r("w")?], store.dir.clone()))
}

/// What the radar measured in a frame, in the order of its table.
///
/// # Errors
/// Returns `BadInput` if a column or the radar's pose is missing, or a place or a range rate is not finite.
pub fn read_cloud(source: &Source) -> Result<Cloud> {
    let columns = Columns::read(source)?;
    let pose = pose(source)?;
    let level = Level::of(&pose);
    let (x, y, z) = (columns.finite("x_m")?, columns.finite("y_m")?, columns.finite("z_m")?);
    let (rate, power) = (columns.finite("range_rate_mps")?, columns.finite("power_dbm")?);
    let strongest = power.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let point = |k: usize| MeasuredPoint {
        at_m: level.from_world(pose.point(DVec3::new(x[k], y[k], z[k]))),
        amplitude: 10f64.powf((power[k] - strongest) / 20.0),
        range_rate_mps: rate[k],
    };
    Ok(Cloud { points: (0..x.len()).map(point).collect() })
}

/// The class that the simulation knows for each point of a frame, in the order of its table: that of the object on which it lies.
/// Ghosts and points in side lobes lie on none, and are of no class, as are points that no object made.
///
/// # Errors
/// Returns `BadInput` if a column is missing or a class is empty, which says that nothing is known of the scene.
pub fn read_truth(source: &Source) -> Result<Vec<CellClass>> {
    let columns = Columns::read(source)?;
    let classes = columns.text("class")?;
    let flags: Vec<Vec<bool>> = OUT_OF_PLACE.iter().map(|name| columns.flag(name)).collect::<Result<_>>()?;
    let class = |k: usize| match classes[k].as_str() {
        "" => Err(unlabelled(&columns.path)),
        _ if flags.iter().any(|f| f[k]) => Ok(CellClass::Undefined),
        name => Ok(CellClass::of(name).unwrap_or(CellClass::Undefined)),
    };
    (0..classes.len()).map(class).collect()
}

fn unlabelled(path: &Path) -> Error {
    let bad =
        BadInput::new("a point has no class, so nothing can be learned from it").file(path).key("class");
    bad.remedy("give points of a simulation; recorded ones have no truth").into()
}
