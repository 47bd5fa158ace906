//! The frames of one scene of a dataset (`catseye dataset`) as sweeps for the exporters of [`crate`], from the dataset's tables and arrays in
//! any format.

use crate::sweeps::{Extras, MeasuredColumns, PointLabel, Sweeps};
use crate::{
    LaneArea, LidarCloud, LidarPlace, MaskedGrid, PowerImage, Sweep, SweepBox, SweepLane, SweepPoint,
};
use catseye::base::error::{BadInput, Error, Result};
use catseye::base::frames::{Pose, Vehicle, World};
use catseye::base::units::dbm_from_w;
use catseye::detect::columns::OUT_OF_PLACE;
use catseye::road::actors::is_ground;
use catseye::road::layout::LaneKind;
use catseye::road::mask::{self, CellClass, Grid};
use catseye_io::dataset::DatasetFile;
use catseye_io::store::{Column, Data, DatasetLayout, Table};
use glam::{DQuat, DVec3};
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

/// One scene of a dataset.
pub struct Scene {
    folder: PathBuf,
    layout: DatasetLayout,
    /// Number of its first frame in the dataset.
    first: u64,
    frames: u32,
    /// Names of the radars.
    radars: Vec<String>,
    /// Yaw rate of the vehicle in each frame, from the headings beside it, rad/s.
    yaw_rates: Vec<f64>,
}

/// Number of scenes of a dataset.
///
/// # Errors
/// Returns `BadInput` for a folder that holds no dataset.
pub fn scenes(folder: &Path) -> Result<u32> {
    Ok(DatasetFile::read(folder)?.scenes)
}

/// A table with its place for errors.
struct Rows<'a> {
    folder: &'a Path,
    table: Table,
}

impl Rows<'_> {
    fn column(&self, name: &str) -> Result<&Column> {
        self.table.column(name).ok_or_else(|| {
            BadInput::new("the table has no such column")
                .file(self.folder)
                .key(format!("{}.{name}", self.table.name))
                .remedy("make the dataset with this version of catseye")
                .into()
        })
    }

    fn numbers(&self, name: &str) -> Result<Vec<f64>> {
        Ok(match self.column(name)? {
            Column::I64(v) => v.iter().map(|x| *x as f64).collect(),
            Column::U32(v) => v.iter().map(|x| f64::from(*x)).collect(),
            Column::F64(v) => v.clone(),
            Column::F32(v) => v.iter().map(|x| f64::from(*x)).collect(),
            Column::Bool(v) => v.iter().map(|x| f64::from(u8::from(*x))).collect(),
            Column::Text(_) => {
                return Err(BadInput::new("the column contains text, not numbers")
                    .file(self.folder)
                    .key(name)
                    .into());
            }
        })
    }

    /// A flag; false in datasets of versions that did not have it.
    fn flag(&self, name: &str) -> Result<Vec<bool>> {
        match self.table.column(name) {
            Some(_) => Ok(self.numbers(name)?.into_iter().map(|x| x != 0.0).collect()),
            None => Ok(vec![false; self.table.rows()]),
        }
    }

    fn ids(&self, name: &str) -> Result<Vec<u32>> {
        Ok(self.numbers(name)?.into_iter().map(|x| x as u32).collect())
    }

    fn text(&self, name: &str) -> Result<&[String]> {
        match self.column(name)? {
            Column::Text(v) => Ok(v),
            _ => Err(BadInput::new("the column does not contain text").file(self.folder).key(name).into()),
        }
    }

    fn vectors(&self, names: [&str; 3]) -> Result<Vec<DVec3>> {
        let [x, y, z] = names.map(|name| self.numbers(name));
        let (x, y, z) = (x?, y?, z?);
        Ok((0..x.len()).map(|i| DVec3::new(x[i], y[i], z[i])).collect())
    }

    fn places(&self) -> Result<Vec<DVec3>> {
        self.vectors(["x_m", "y_m", "z_m"])
    }

    fn velocities(&self) -> Result<Vec<DVec3>> {
        self.vectors(["velocity_x_mps", "velocity_y_mps", "velocity_z_mps"])
    }

    fn rotations(&self) -> Result<Vec<DQuat>> {
        let v = self.vectors(["rotation_x", "rotation_y", "rotation_z"])?;
        let w = self.numbers("rotation_w")?;
        Ok(v.iter().zip(w).map(|(v, w)| DQuat::from_xyzw(v.x, v.y, v.z, w).normalize()).collect())
    }

    /// The pose of a row.
    fn pose<A>(&self, row: usize) -> Result<Pose<A, World>> {
        match (self.rotations()?.get(row), self.places()?.get(row)) {
            (Some(rotation), Some(place)) => Ok(Pose::new(*rotation, *place)),
            _ => Err(BadInput::new("the table lacks the row of a frame")
                .file(self.folder)
                .key(&self.table.name)
                .remedy("make the dataset again")
                .into()),
        }
    }
}

impl Scene {
    /// Opens a scene of a dataset.
    ///
    /// # Errors
    /// Returns `BadInput` for a folder that holds no dataset, a scene that it does not have, one whose shards are not complete, and a dataset
    /// without points or truth.
    pub fn open(folder: &Path, scene: u32) -> Result<Scene> {
        let file = DatasetFile::read(folder)?;
        if scene >= file.scenes {
            return Err(BadInput::new("the dataset has no such scene")
                .file(folder)
                .key("--scene")
                .value(scene)
                .allowed(format!("0 to {}", file.scenes.saturating_sub(1)))
                .into());
        }
        let layout = DatasetLayout::open(folder)?;
        for (table, keep) in [("points", "points"), ("boxes", "truth")] {
            if layout.table(table).is_err() {
                return Err(BadInput::new(format!("export needs the table {table}"))
                    .file(folder)
                    .key(format!("keep.{keep}"))
                    .value("false")
                    .remedy(format!("make the dataset with {keep} = true in [keep] of its recipe"))
                    .into());
            }
        }
        let first = u64::from(scene) * u64::from(file.frames_per_scene);
        let mut all = Scene {
            folder: folder.into(),
            layout,
            first,
            frames: file.frames_per_scene,
            radars: Vec::new(),
            yaw_rates: Vec::new(),
        };
        all.radars = all.rows("radars", first)?.text("radar")?.to_vec();
        let mut headings = Vec::new();
        for frame in 0..u64::from(all.frames) {
            let row = all.rows("frames", first + frame)?;
            let ahead = row.pose::<Vehicle>(0)?.direction(DVec3::X);
            headings.push((row.numbers("time_ns")?[0] * 1e-9, ahead.y.atan2(ahead.x)));
        }
        all.yaw_rates = (0..headings.len())
            .map(|i| {
                let (a, b) = (headings[i.saturating_sub(1)], headings[(i + 1).min(headings.len() - 1)]);
                let turn = (b.1 - a.1 + PI).rem_euclid(TAU) - PI;
                if b.0 > a.0 { turn / (b.0 - a.0) } else { 0.0 }
            })
            .collect();
        Ok(all)
    }

    fn rows(&self, name: &str, frame: u64) -> Result<Rows<'_>> {
        Ok(Rows { folder: &self.folder, table: self.layout.read_table(&self.folder, name, frame)? })
    }

    /// Data and shape of a radar's array; None where the dataset does not have it.
    fn array(&self, base: &str, radar: &str, frame: u64) -> Result<Option<(Data, Vec<usize>)>> {
        let name = match self.radars.len() {
            1 => base.to_string(),
            _ => format!("{base}_{}", radar.to_ascii_lowercase().replace('-', "_")),
        };
        if self.layout.array(&name).is_err() {
            return Ok(None);
        }
        let array = self.layout.read_array(&self.folder, &name, frame)?;
        Ok(Some((array.data, array.shape)))
    }

    fn map(&self, radar: &str, frame: u64) -> Result<Option<PowerImage>> {
        let Some((Data::F32(power_w), shape)) = self.array("range_doppler", radar, frame)? else {
            return Ok(None);
        };
        let rows = self.rows("radars", frame)?;
        let row = rows.text("radar")?.iter().position(|r| r == radar).unwrap_or(0);
        let of = |name: &str| -> Result<f64> { Ok(rows.numbers(name)?[row]) };
        Ok(Some(PowerImage {
            doppler_rows: shape[0],
            range_columns: shape[1],
            power_w,
            first_range_m: of("first_range_m")?,
            range_step_m: of("range_bin_m")?,
            first_range_rate_mps: of("first_range_rate_mps")?,
            range_rate_step_mps: of("range_rate_bin_mps")?,
        }))
    }

    fn grid(
        &self,
        name: &str,
        grid: Grid,
        classes: &[CellClass],
        radar: &str,
        frame: u64,
    ) -> Result<MaskedGrid> {
        let planes = self.array(&format!("grid_{name}"), radar, frame)?;
        let mask = self.array(&format!("mask_{name}"), radar, frame)?;
        let (Some((Data::F32(planes), _)), Some((Data::U8(mask), shape))) = (planes, mask) else {
            return Err(BadInput::new("the dataset has no grids, which this export needs")
                .file(&self.folder)
                .key("keep.masks")
                .value("false")
                .remedy("make the dataset with masks = true in [keep] of its recipe")
                .into());
        };
        if shape != [grid.rows, grid.columns] {
            return Err(BadInput::new("the grid has another size")
                .file(&self.folder)
                .key(format!("mask_{name}"))
                .value(format!("{shape:?}"))
                .allowed(format!("{:?}", [grid.rows, grid.columns]))
                .into());
        }
        Ok(MaskedGrid {
            name: name.into(),
            rows: grid.rows,
            columns: grid.columns,
            cell_m: [grid.ahead_m / grid.rows as f64, grid.across_m / grid.columns as f64],
            mask,
            classes: classes.to_vec(),
            planes,
        })
    }

    fn lidar(&self, frame: u64, vehicle_in_world: &Pose<Vehicle, World>) -> Result<Option<LidarCloud>> {
        if self.layout.table("lidar").is_err() {
            return Ok(None);
        }
        let in_vehicle = self.rows("lidars", frame)?.pose(0)?.then(&vehicle_in_world.inverse());
        let from_vehicle = in_vehicle.inverse();
        let rows = self.rows("lidar", frame)?;
        let (incidence_deg, channel) = (rows.numbers("incidence_deg")?, rows.ids("channel")?);
        let point = |(i, place): (usize, DVec3)| LidarPlace {
            position_m: from_vehicle.point(place),
            cos_incidence: incidence_deg[i].to_radians().cos().clamp(0.0, 1.0),
            channel: channel[i],
        };
        let points = rows.places()?.into_iter().enumerate().map(point).collect();
        Ok(Some(LidarCloud { in_vehicle, points }))
    }

    fn lanes(&self, frame: u64, into_vehicle: &Pose<World, Vehicle>) -> Result<Vec<SweepLane>> {
        let rows = self.rows("lines", frame)?;
        let (ids, names, places) = (rows.ids("id")?, rows.text("name")?, rows.places()?);
        let mut lines: BTreeMap<u32, (String, Vec<DVec3>)> = BTreeMap::new();
        for i in 0..ids.len() {
            let line = lines.entry(ids[i]).or_insert_with(|| (names[i].clone(), Vec::new()));
            line.1.push(into_vehicle.point(places[i]));
        }
        let lane = |(id, (name, points_m))| SweepLane { id, name, points_m };
        Ok((1..).zip(lines.into_values()).map(lane).collect())
    }

    fn drivable(&self, frame: u64) -> Result<Vec<LaneArea>> {
        let rows = self.rows("lanes", frame)?;
        let (road, number, kind) = (rows.text("road")?, rows.numbers("lane")?, rows.text("kind")?);
        let left = rows.vectors(["left_x_m", "left_y_m", "left_z_m"])?;
        let right = rows.vectors(["right_x_m", "right_y_m", "right_z_m"])?;
        let mut areas: BTreeMap<(&str, i64), LaneArea> = BTreeMap::new();
        for i in 0..road.len() {
            let kind: Option<LaneKind> = serde_json::from_value(kind[i].clone().into()).ok();
            if !kind.is_some_and(LaneKind::is_drivable) {
                continue;
            }
            let key = (road[i].as_str(), number[i] as i64);
            let area =
                areas.entry(key).or_insert_with(|| LaneArea { left_m: Vec::new(), right_m: Vec::new() });
            area.left_m.push(left[i]);
            area.right_m.push(right[i]);
        }
        Ok(areas.into_values().filter(|area| area.left_m.len() >= 2).collect())
    }

    /// Boxes of whole objects except the ground, and the box that each object is a part of.
    fn boxes(&self, frame: u64) -> Result<(Vec<SweepBox>, HashMap<u32, usize>)> {
        let rows = self.rows("boxes", frame)?;
        let (ids, parents, classes) = (rows.ids("id")?, rows.ids("parent_id")?, rows.text("class")?);
        let (places, rotations, velocities) = (rows.places()?, rows.rotations()?, rows.velocities()?);
        let sizes = rows.vectors(["length_m", "width_m", "height_m"])?;
        let mut boxes = Vec::new();
        let mut of: HashMap<u32, usize> = HashMap::new();
        for i in (0..ids.len()).filter(|i| ids[*i] == parents[*i] && !is_ground(&classes[*i])) {
            of.insert(ids[i], boxes.len());
            boxes.push(SweepBox {
                id: ids[i],
                class: classes[i].clone(),
                centre_m: places[i],
                size_m: sizes[i],
                rotation: rotations[i],
                velocity_mps: velocities[i],
                moving: velocities[i] != DVec3::ZERO,
            });
        }
        for (id, parent) in ids.iter().zip(&parents) {
            if let Some(whole) = of.get(parent).copied() {
                of.insert(*id, whole);
            }
        }
        Ok((boxes, of))
    }

    /// Points carry the id of the box that their object is a part of.
    fn points(
        &self,
        frame: u64,
        radar: &str,
        boxes: &[SweepBox],
        of: &HashMap<u32, usize>,
    ) -> Result<(Vec<SweepPoint>, Vec<&'static str>)> {
        let rows = self.rows("points", frame)?;
        let (whose, class, objects) = (rows.text("radar")?, rows.text("class")?, rows.ids("object_id")?);
        let places = rows.places()?;
        let numbers = |name: &str| rows.numbers(name);
        let measured = MeasuredColumns::read(numbers)?;
        let flags: Vec<Vec<bool>> = OUT_OF_PLACE.iter().map(|name| rows.flag(name)).collect::<Result<_>>()?;
        let point = |i: usize| {
            let owner = of.get(&objects[i]).and_then(|at| boxes.get(*at));
            let label = PointLabel {
                object_id: owner.map_or(objects[i], |b| b.id),
                class: owner.map_or_else(|| class[i].clone(), |b| b.class.clone()),
                ghost: flags.iter().any(|f| f[i]),
                moving: owner.map(|b| b.moving),
            };
            measured.point(i, places[i], label)
        };
        let missing = OUT_OF_PLACE.into_iter().filter(|name| rows.table.column(name).is_none()).collect();
        Ok(((0..whose.len()).filter(|i| whose[*i] == radar).map(point).collect(), missing))
    }

    fn at(&self, at: usize) -> Result<(u32, &str)> {
        if at >= self.len() {
            return Err(Error::Failed(format!("{}: sweep {at} of {}", self.folder.display(), self.len())));
        }
        Ok(((at / self.radars.len()) as u32, &self.radars[at % self.radars.len()]))
    }
}

impl Sweeps for Scene {
    fn len(&self) -> usize {
        self.frames as usize * self.radars.len()
    }

    fn sweep(&self, at: usize, extras: Extras) -> Result<Sweep> {
        let (index, radar) = self.at(at)?;
        let frame = self.first + u64::from(index);
        let ego = self.rows("frames", frame)?;
        let vehicle_in_world: Pose<Vehicle, World> = ego.pose(0)?;
        let radars = self.rows("radars", frame)?;
        let row = radars.text("radar")?.iter().position(|r| r == radar).unwrap_or(usize::MAX);
        let into_vehicle = vehicle_in_world.inverse();
        let sensor_in_vehicle = radars.pose(row)?.then(&into_vehicle);
        let (boxes, of) = self.boxes(frame)?;
        let (points, missing_flags) = self.points(frame, radar, &boxes, &of)?;
        let grids = match extras.grids {
            true => vec![
                self.grid("road", Grid::ROAD, &mask::ROAD_CLASSES, radar, frame)?,
                self.grid("markers", Grid::MARKERS, &mask::MARKER_CLASSES, radar, frame)?,
            ],
            false => Vec::new(),
        };
        Ok(Sweep {
            time_ns: ego.numbers("time_ns")?[0] as i64,
            frame: u64::from(index),
            radar: radar.into(),
            sensor_in_vehicle,
            vehicle_in_world,
            vehicle_velocity_mps: ego.velocities()?[0],
            yaw_rate_rad_per_s: self.yaw_rates[index as usize],
            sensor_velocity_mps: radars.velocities()?[row],
            points,
            missing_flags,
            boxes,
            range_doppler: if extras.map { self.map(radar, frame)? } else { None },
            lanes: self.lanes(frame, &into_vehicle)?,
            drivable: self.drivable(frame)?,
            grids,
            lidar: if extras.lidar { self.lidar(frame, &vehicle_in_world)? } else { None },
        })
    }

    fn highest_dbm(&self) -> Result<Option<f64>> {
        let mut highest = 0f32;
        for at in 0..self.len() {
            let (index, radar) = self.at(at)?;
            if let Some(map) = self.map(radar, self.first + u64::from(index))? {
                highest = map.power_w.iter().fold(highest, |m, p| m.max(*p));
            }
        }
        Ok((highest > 0.0).then(|| dbm_from_w(f64::from(highest))))
    }
}
