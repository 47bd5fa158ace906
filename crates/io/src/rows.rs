//! A frame in the form of a dataset: arrays of samples and powers, tables of points, echoes and truth.

use super::drawn_scene::DrawnScene;
use super::echo_file::{self, ECHOES, TRACES};
use super::files::{FrameMask, masks};
use super::follow::{EGO_MOTION, EgoRow};
use super::manifest::Axes;
use super::recipe::{Keep, Recipe};
use super::store::{Array, ArraySpec, Column, ColumnSpec, Compression, Data, Record, Table, TableSpec};
use catseye::base::error::Result;
use catseye::detect::bodies::{Bodies, Sight};
use catseye::detect::columns;
use catseye::detect::track_table::{TRACKS, TrackRow};
use catseye::engine::Stage;
use catseye::formats::column::{self, Get};
use catseye::road::actors::is_ground;
use catseye::road::labels::Polyline;
use catseye::road::mask::CellClass;
use catseye::road::{TruthBox, truth_boxes};
use catseye::scene::radar::Radar;
use catseye::simulate::Frame;
use catseye::simulate::lidar::{self, lidar_pose, scan};
use catseye::simulate::truth::{Visibility, lanes_of, visibility};
use serde::Serialize;
use std::collections::BTreeMap;

/// Largest distance from the ego vehicle at which lanes, lines and markers are kept, m.
pub const TRUTH_RANGE_M: f64 = 150.0;
/// How the names of arrays begin that hold the class of each cell of a grid, and those that hold its points.
const MASK: &str = "mask";
const GRID: &str = "grid";

/// Makes the record of frame `frame` of the dataset from one frame of all radars.
///
/// Arrays are named `adc`, `range_doppler`, `grid_road`, `mask_road`, `grid_markers` and `mask_markers`, with `_1` and so on for more ramps, and with the radar's name
/// where there are several.
///
/// # Errors
/// Returns an error for arrays or tables that do not match the layout.
pub fn record(recipe: &Recipe, site: &DrawnScene, frame: u64, mut radars: Vec<Frame>) -> Result<Record> {
    let tables = tables(recipe, site, &radars).into_iter().map(|made| made.table).collect();
    let mut arrays = Vec::new();
    for f in &mut radars {
        arrays_of(recipe.keep, site, f, &mut arrays)?;
    }
    Ok(Record { frame, arrays, tables })
}

/// Describes the tables of a recipe's dataset for its layout.
pub fn table_specs(recipe: &Recipe, site: &DrawnScene) -> Vec<TableSpec> {
    tables(recipe, site, &[]).into_iter().map(|made| made.spec).collect()
}

/// Describes the tables that a run of several frames has beside its frames.
pub fn run_table_specs() -> Vec<TableSpec> {
    let tracks = "one row for each confirmed track and frame of a run, in the world's plane (tracks.csv)";
    let motion =
        "one row for each frame and radar of a run, and one for all radars together (ego_motion.csv)";
    vec![
        Rows::<TrackRow>::new("tracks", tracks, []).columns(&TRACKS, |r| r).made().spec,
        Rows::<EgoRow>::new("ego_motion", motion, []).columns(&EGO_MOTION, |r| r).made().spec,
    ]
}

fn tables(recipe: &Recipe, site: &DrawnScene, radars: &[Frame]) -> Vec<Made> {
    let mut tables = vec![frame_table(recipe, site, radars), radar_table(recipe.keep, site, radars)];
    if recipe.keep.points {
        tables.push(point_table(site, radars));
    }
    if recipe.keep.returns {
        tables.push(return_table(site, radars));
    }
    if recipe.keep.echoes {
        tables.extend([trace_table(site, radars), echo_table(site, radars)]);
    }
    if recipe.keep.lidar {
        tables.extend(lidar_tables(site, radars));
    }
    if recipe.keep.truth {
        tables.extend(truth_tables(recipe.keep, site, radars));
    }
    tables
}

/// Name of an array: `base`, with the radar's name if there are several.
fn array_name(base: &str, site: &DrawnScene, radar: &Radar) -> String {
    match site.scenario.radars.len() {
        1 => base.to_string(),
        _ => format!("{base}_{}", radar.name.to_ascii_lowercase().replace('-', "_")),
    }
}

fn arrays_of(keep: Keep, site: &DrawnScene, f: &mut Frame, arrays: &mut Vec<Array>) -> Result<()> {
    let radar = &site.scenario.radars[f.radar];
    let dims = |names: &[&str]| names.iter().map(|n| n.to_string()).collect();
    if keep.range_doppler {
        for (ramp, map) in f.maps.iter().enumerate() {
            let base = if ramp == 0 { "range_doppler".to_string() } else { format!("range_doppler_{ramp}") };
            arrays.push(Array {
                name: array_name(&base, site, radar),
                dims: dims(&["doppler", "range"]),
                shape: vec![map.map.doppler_bins, map.map.range_bins],
                data: Data::F32(map.map.data.iter().map(|p| *p as f32).collect()),
                unit: "W".into(),
            });
        }
    }
    if keep.adc {
        let cube = f.take_samples()?.into_f32();
        arrays.push(Array {
            name: array_name("adc", site, radar),
            dims: dims(&["chirp", "virtual_channel", "sample"]),
            shape: vec![cube.chirps, cube.channels, cube.samples],
            data: Data::C32(cube.data),
            unit: "sqrt(W)".into(),
        });
    }
    if keep.masks {
        let lanes = lanes_of(f, site.road.as_ref());
        for FrameMask { name, grid, classes, points } in masks(&site.scene, f, &lanes) {
            let cells = [grid.rows, grid.columns];
            arrays.push(Array {
                name: array_name(&format!("{GRID}_{name}"), site, radar),
                dims: dims(&["plane", "row", "column"]),
                shape: [&[4], &cells[..]].concat(),
                data: Data::F32(points),
                unit: String::new(),
            });
            arrays.push(Array {
                name: array_name(&format!("{MASK}_{name}"), site, radar),
                dims: dims(&["row", "column"]),
                shape: cells.to_vec(),
                data: Data::U8(classes),
                unit: String::new(),
            });
        }
    }
    Ok(())
}

/// A table with what a layout says of it.
struct Made {
    table: Table,
    spec: TableSpec,
}

/// A table of a list of rows, which grows by columns: each has a name, whose end is the unit, and says what it holds.
struct Rows<T> {
    list: Vec<T>,
    made: Made,
}

impl<T> Rows<T> {
    fn new(name: &str, about: &str, list: impl IntoIterator<Item = T>) -> Self {
        let spec = TableSpec { name: name.into(), columns: Vec::new(), about: about.into() };
        let table = Table { name: name.into(), columns: Vec::new() };
        Rows { list: list.into_iter().collect(), made: Made { table, spec } }
    }
    fn put(mut self, name: &str, about: &str, column: impl Fn(&[T]) -> Column) -> Self {
        let column = column(&self.list);
        self.made.spec.columns.push(ColumnSpec {
            name: name.into(),
            kind: column.kind(),
            about: about.into(),
        });
        self.made.table.columns.push((name.into(), column));
        self
    }
    fn f64(self, name: &str, about: &str, of: impl Fn(&T) -> f64) -> Self {
        self.put(name, about, |l| Column::F64(l.iter().map(&of).collect()))
    }
    fn u32(self, name: &str, about: &str, of: impl Fn(&T) -> u32) -> Self {
        self.put(name, about, |l| Column::U32(l.iter().map(&of).collect()))
    }
    fn i64(self, name: &str, about: &str, of: impl Fn(&T) -> i64) -> Self {
        self.put(name, about, |l| Column::I64(l.iter().map(&of).collect()))
    }
    fn bool(self, name: &str, about: &str, of: impl Fn(&T) -> bool) -> Self {
        self.put(name, about, |l| Column::Bool(l.iter().map(&of).collect()))
    }
    fn text(self, name: &str, about: &str, of: impl Fn(&T) -> String) -> Self {
        self.put(name, about, |l| Column::Text(l.iter().map(&of).collect()))
    }
    /// More columns where a recipe asks for them.
    fn when(self, is_wanted: bool, more: impl FnOnce(Self) -> Self) -> Self {
        if is_wanted { more(self) } else { self }
    }
    fn vector(self, columns: [(&str, &str); 3], of: impl Fn(&T) -> [f64; 3]) -> Self {
        columns
            .into_iter()
            .enumerate()
            .fold(self, |rows, (i, (name, about))| rows.f64(name, about, |t| of(t)[i]))
    }
    /// A place in the world whose columns have a name before their axis.
    fn place(self, name: &str, about: &str, of: impl Fn(&T) -> [f64; 3]) -> Self {
        let names = ["x", "y", "z"].map(|axis| format!("{name}_{axis}_m"));
        names.iter().enumerate().fold(self, |rows, (i, name)| rows.f64(name, about, |t| of(t)[i]))
    }
    fn rotation(self, of: impl Fn(&T) -> [f64; 4]) -> Self {
        let names = ["rotation_x", "rotation_y", "rotation_z", "rotation_w"];
        let about = "component of the quaternion that rotates from its own axes to the world";
        names.into_iter().enumerate().fold(self, |rows, (i, name)| rows.f64(name, about, |t| of(t)[i]))
    }
    /// Columns of a part of each row.
    fn columns<U>(self, columns: &[column::Column<U>], part: impl Fn(&T) -> &U) -> Self {
        columns.iter().fold(self, |rows, c| match &c.get {
            Get::Number(get) | Get::Bound(get) => rows.f64(c.name, c.about, |t| get(part(t))),
            Get::Count(get) => rows.u32(c.name, c.about, |t| get(part(t))),
            Get::Small(get) => rows.u32(c.name, c.about, |t| get(part(t)).into()),
            Get::Flag(get) => rows.bool(c.name, c.about, |t| get(part(t))),
            Get::Text(_, get) => rows.text(c.name, c.about, |t| get(part(t)).into_owned()),
            Get::Ids(get) => rows.text(c.name, c.about, |t| column::ids(&get(part(t)))),
        })
    }
    fn made(self) -> Made {
        self.made
    }
}

const PLACE: [(&str, &str); 3] = [
    ("x_m", "position along the world's x axis"),
    ("y_m", "position along the world's y axis"),
    ("z_m", "height in the world"),
];
const VELOCITY: [(&str, &str); 3] = [
    ("velocity_x_mps", "velocity over the ground along the world's x axis"),
    ("velocity_y_mps", "velocity over the ground along the world's y axis"),
    ("velocity_z_mps", "velocity over the ground along the world's z axis"),
];

fn frame_table(recipe: &Recipe, site: &DrawnScene, radars: &[Frame]) -> Made {
    let ego = &site.scenario.ego;
    // All radars of a frame share its middle.
    Rows::new(
        "frames",
        "one row for each frame: scene, and pose and velocity of the ego vehicle in the world",
        radars.first(),
    )
    .u32("scene", "number of the scene", |_| site.number)
    .u32("frame_in_scene", "number of the frame in its scene", |f| f.index)
    .text("split", "train, validation or test", |_| recipe.split(site.number).to_string())
    .i64("time_ns", "time of the middle of the frame, from the middle of the scene's first frame", |f| {
        (f.time_s * 1e9).round() as i64
    })
    .i64("seed", "seed of the scene's noise and speckle", |_| site.scenario.seed as i64)
    .vector(PLACE, |f| ego.pose(f.time_s).translation_m.to_array())
    .rotation(|f| ego.pose(f.time_s).rotation.to_array())
    .vector(VELOCITY, |f| ego.at(f.time_s).velocity_mps.to_array())
    .f64(
        "yaw_rate_rad_per_s",
        "yaw rate of the vehicle about the world's z axis, positive to the left",
        |f| ego.at(f.time_s).spin_rad_per_s.z,
    )
    .made()
}

fn radar_table(keep: Keep, site: &DrawnScene, radars: &[Frame]) -> Made {
    let axes = |f: &&Frame| Axes::of(&site.scenario.radars[f.radar]);
    Rows::new(
        "radars",
        "one row for each radar: pose and velocity in the world, and axes of its range-Doppler map",
        radars,
    )
    .text("radar", "name of the radar", |f| site.scenario.radars[f.radar].name.clone())
    .f64("carrier_hz", "centre frequency of the sweep", |f| site.scenario.radars[f.radar].carrier_hz)
    .f64("first_range_m", "range of the first column of the range-Doppler map", |f| axes(f).range_m.first)
    .f64("range_bin_m", "range step between columns of the map", |f| axes(f).range_m.step)
    .f64("first_range_rate_mps", "range rate of the first row of the map", |f| axes(f).range_rate_mps.first)
    .f64("range_rate_bin_mps", "range-rate step between rows of the map", |f| axes(f).range_rate_mps.step)
    .u32("triangles", "number of triangles of the scene as traced", |f| f.triangles as u32)
    // Of a frame that was not traced nobody knows.
    .when(keep.products().reaches(Stage::Trace), |rows| {
        rows.u32("echoes", "number of echoes that the tracer found", |f| f.echoes.list.len() as u32)
    })
    .vector(PLACE, |f| f.pose.translation_m.to_array())
    .rotation(|f| f.pose.rotation.to_array())
    .vector(VELOCITY, |f| f.velocity_mps.to_array())
    .made()
}

/// Table with the columns of points.csv.
fn point_table(site: &DrawnScene, radars: &[Frame]) -> Made {
    let all = radars.iter().flat_map(|f| f.points.iter().map(move |p| (f, p)));
    Rows::new("points", "one row for each detected point of a radar, in that radar's frame of reference", all)
        .text("radar", "name of the radar", |(f, _)| site.scenario.radars[f.radar].name.clone())
        .columns(&columns::POINTS, |(_, p)| p)
        .made()
}

/// Table with the columns of returns.csv.
fn return_table(site: &DrawnScene, radars: &[Frame]) -> Made {
    let all = radars.iter().flat_map(|f| {
        let radar = &site.scenario.radars[f.radar];
        columns::received(radar, &f.echoes).into_iter().map(move |e| (radar, e))
    });
    Rows::new(
        "returns",
        "one row for each echo as the tracer found it, in the radar's frame of reference",
        all,
    )
    .text("radar", "name of the radar", |(radar, _)| radar.name.clone())
    .columns(&columns::echoes(), |(_, e)| e)
    .made()
}

/// Tables of the lidar's place and of its points, with the columns of lidar.csv.
fn lidar_tables(site: &DrawnScene, radars: &[Frame]) -> [Made; 2] {
    let (settings, ego) = (&site.scenario.lidar, &site.scenario.ego);
    // All radars of a frame share its middle.
    let time_s = radars.first().map(|f| f.time_s);
    let place = time_s.map(|t| lidar_pose(settings, ego, t));
    let places = Rows::new(
        "lidars",
        "one row for each frame: pose and velocity of the ideal lidar in the world",
        place,
    )
    .vector(PLACE, |(pose, _)| pose.translation_m.to_array())
    .rotation(|(pose, _)| pose.rotation.to_array())
    .vector(VELOCITY, |(_, velocity_mps)| velocity_mps.to_array())
    .made();
    let points = time_s.map(|t| scan(settings, &site.scene, ego, t));
    let points = Rows::new(
        "lidar",
        "one row for each point of the ideal lidar, in the vehicle's frame of reference",
        points.into_iter().flatten(),
    )
    .columns(&lidar::columns(), |p| p)
    .made();
    [places, points]
}

/// Table of what the traces of a frame follow from.
fn trace_table(site: &DrawnScene, radars: &[Frame]) -> Made {
    let kept = radars.iter().filter_map(|f| Some((f, f.kept.as_ref()?)));
    Rows::new(TRACES, "one row for each radar: inputs of its trace, read by `catseye dataset --from`", kept)
        .text("radar", "name of the radar", |(f, _)| site.scenario.radars[f.radar].name.clone())
        .text("origin", "scene, drive, position, band, duration, bounces and counts, as JSON", |(_, kept)| {
            // What cannot be written cannot be read either, which says so.
            echo_file::origin_text(kept, false).unwrap_or_default()
        })
        .made()
}

/// Table with every echo in full.
fn echo_table(site: &DrawnScene, radars: &[Frame]) -> Made {
    let all = radars.iter().flat_map(|f| {
        let kept = f.kept.iter().flat_map(echo_file::all);
        kept.map(move |(e, is_cut)| (f, echo_file::row(e, is_cut)))
    });
    let rows = Rows::new(
        ECHOES,
        "one row for each traced echo with all values (cached echoes), in the radar's frame of reference, before any is left out",
        all,
    );
    let rows = rows.text("radar", "name of the radar", |(f, _)| site.scenario.radars[f.radar].name.clone());
    let about = "value of the echo, as in the column of the same name in a run's echoes.npy";
    let columns = echo_file::COLUMNS.iter().enumerate();
    columns.fold(rows, |rows, (i, name)| rows.f64(name, about, |(_, row)| row[i])).made()
}

/// A value as the word of a file format.
fn word(value: impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(s)) => s,
        _ => String::new(),
    }
}

/// Tables of boxes, lanes, painted lines and markers, in the world.
fn truth_tables(keep: Keep, site: &DrawnScene, radars: &[Frame]) -> [Made; 4] {
    let time_s = radars.first().map_or(0.0, |f| f.time_s);
    let here = site.scenario.ego.pose(time_s).translation_m;
    let near = |p: &[f64; 3]| (p[0] - here.x).hypot(p[1] - here.y) <= TRUTH_RANGE_M;
    let numbered = |line: &Polyline| -> Vec<(u32, [f64; 3])> {
        line.iter().enumerate().filter(|(_, p)| near(p)).map(|(i, p)| (i as u32, *p)).collect()
    };
    let mut seen: BTreeMap<u32, Visibility> = BTreeMap::new();
    for f in radars {
        for (id, more) in visibility(&site.scenario.radars[f.radar], f, &site.scene) {
            let all = seen.entry(id).or_default();
            *all = all.and(more);
        }
    }
    let seen = |id: u32| seen.get(&id).copied().unwrap_or_default();
    let counts = |s: &Visibility| s.counts.unwrap_or_default();
    let views: Vec<(Bodies, &Radar)> = radars
        .iter()
        .map(|f| (Bodies::new(&site.scene, f.time_s, &f.pose), &site.scenario.radars[f.radar]))
        .collect();
    // Of several radars the one that sees most counts.
    let sight = |id: u32| {
        let of = views.iter().map(|(bodies, radar)| bodies.sight(id, radar));
        of.min_by(|a, b| (a.occluded.max(a.outside_view)).total_cmp(&b.occluded.max(b.outside_view)))
            .unwrap_or_default()
    };
    let listed = truth_boxes(&site.scene, time_s);
    let wholes: BTreeMap<u32, Sight> = listed
        .iter()
        .filter(|b| b.parent_id == b.id && !is_ground(&b.class))
        .map(|b| (b.id, sight(b.id)))
        .collect();
    let sight = |b: &TruthBox| wholes.get(&b.parent_id).copied().unwrap_or_default();
    let boxes = listed.iter().map(|b| (seen(b.id), b));
    let boxes = Rows::new("boxes", "one row for each object, in the world: whole objects (empty `part`) with a box around all of their parts, and parts with their own box", boxes)
        .u32("id", "id of the object", |(_, b)| b.id)
        .text("name", "name of the object", |(_, b)| b.name.clone())
        .text("class", "class of the object", |(_, b)| b.class.clone())
        .vector(PLACE, |(_, b)| b.centre_m)
        .vector(
            [
                ("length_m", "length of the box, along its own x axis"),
                ("width_m", "width of the box, along its own y axis"),
                ("height_m", "height of the box, along its own z axis"),
            ],
            |(_, b)| b.size_m)
        .rotation(|(_, b)| b.rotation_xyzw)
        .vector(VELOCITY, |(_, b)| b.velocity_mps)
        .vector(
            [
                ("spin_x_rad_per_s", "angular rate about the world's x axis"),
                ("spin_y_rad_per_s", "angular rate about the world's y axis"),
                ("spin_z_rad_per_s", "angular rate about the world's z axis"),
            ],
            |(_, b)| b.spin_rad_per_s)
        .u32("parent_id", "id of the whole object that the object is a part of; for a whole object its own id", |(_, b)| b.parent_id)
        .text("part", "name of the part, such as wheel; empty for a whole object", |(_, b)| b.part.clone())
        .bool("visible", "true: the object's strongest cell exceeds the thermal noise of a cell, for at least one radar", |(s, _)| s.visible)
        .u32("returns", "number of echoes of the object in the receivers' bands; for a whole object, including its parts", |(s, _)| s.returns as u32)
        .f64("power_dbm", "power of the coherent sum of the object's echoes in its strongest cell, for the radar that receives most; NaN without echoes", |(s, _)| s.power_dbm.unwrap_or(f64::NAN))
        .f64("occluded", "share of the whole object that other objects occlude, 0 to 1, for the radar that sees most of it", |(_, b)| sight(b).occluded)
        .f64("outside_view", "share of the whole object outside the radar's searched angles or beyond its range, 0 to 1", |(_, b)| sight(b).outside_view)
        .when(keep.points, |rows| {
            rows.u32("points", "number of points on the object, without ghost, side-lobe, folded and aliased points; for a whole object, including its parts", |(s, _)| counts(s).points as u32)
                .u32("ghosts", "number of ghost points of the object; for a whole object, including its parts", |(s, _)| counts(s).ghosts as u32)
                .u32("side_lobes", "number of points in side lobes of the object's echoes; for a whole object, including its parts", |(s, _)| counts(s).side_lobes as u32)
                .u32("folded", "number of points of the object whose position is wrong by an ambiguity interval; for a whole object, including its parts", |(s, _)| counts(s).folded as u32)
                .u32("aliased", "number of points of the object whose echo is beyond the sampled band; for a whole object, including its parts", |(s, _)| counts(s).aliased as u32)
        })
        .made();

    let roads = site.road.as_ref().map_or(&[][..], |r| &r.roads);
    let mut stations = Vec::new();
    for road in roads {
        for lane in &road.lanes {
            stations.extend(numbered(&lane.centre_m).into_iter().map(|(i, _)| (road, lane, i as usize)));
        }
    }
    let lanes = Rows::new("lanes", "one row for each station of a lane, in the world", stations)
        .text("road", "name of the road", |(road, ..)| road.name.clone())
        .i64("lane", "number of the lane", |(_, lane, _)| lane.number.into())
        .text("kind", "type of the lane", |(_, lane, _)| word(lane.kind))
        .text("driven", "driving direction relative to the axis", |(_, lane, _)| word(lane.driven))
        .u32("station", "number of the station along the lane", |(.., i)| *i as u32)
        .f64("s_m", "arc length along the road's axis", |(road, _, i)| road.s_m[*i])
        .f64("width_m", "width of the lane", |(_, lane, i)| lane.width_m[*i])
        .place("left", "coordinate of the lane's left border", |(_, lane, i)| lane.left_m[*i])
        .place("centre", "coordinate of the lane's centre line", |(_, lane, i)| lane.centre_m[*i])
        .place("right", "coordinate of the lane's right border", |(_, lane, i)| lane.right_m[*i])
        .made();

    struct Vertex {
        id: u32,
        name: String,
        kind: String,
        width_m: f64,
        number: u32,
        at: [f64; 3],
    }
    let mut vertices = Vec::new();
    for line in roads.iter().flat_map(|r| &r.lines) {
        let of = |(number, at)| Vertex {
            id: line.id,
            name: line.name.clone(),
            kind: word(line.kind),
            width_m: line.width_m,
            number,
            at,
        };
        vertices.extend(numbered(&line.points_m).into_iter().map(of));
    }
    let lines = Rows::new("lines", "one row for each vertex of a painted line, in the world", vertices)
        .u32("id", "id of the line", |v| v.id)
        .text("name", "name of the line", |v| v.name.clone())
        .text("kind", "type of the line", |v| v.kind.clone())
        .f64("width_m", "width of the line", |v| v.width_m)
        .u32("vertex", "number of the vertex along the line", |v| v.number)
        .vector(PLACE, |v| v.at)
        .made();

    let rows = site.road.as_ref().map_or(&[][..], |r| &r.marker_rows);
    let markers = rows.iter().flat_map(|r| r.markers.iter().map(move |m| (r, m)));
    let markers = Rows::new(
        "markers",
        "one row for each marker of the road, in the world",
        markers.filter(|(_, m)| near(&m.position_m)),
    )
    .u32("id", "id of the marker, as an object", |(_, m)| m.id)
    .text("row", "name of the row of markers", |(r, _)| r.name.clone())
    .text("road", "name of the road", |(r, _)| r.road.clone())
    .text("reflector", "reflector kind and parameters of the marker, as in `catseye rcs`", |(r, _)| {
        r.reflector.clone()
    })
    .f64("s_m", "arc length along the road's axis", |(_, m)| m.s_m)
    .vector(PLACE, |(_, m)| m.position_m)
    .i64(
        "bit",
        "position in the code word of the bit that the gap behind this marker encodes; -1 without a code",
        |(_, m)| m.bit.map_or(-1, |b| b as i64),
    )
    .text("word", "code word that the gaps of the row encode; empty without a code", |(r, _)| {
        r.word.clone().unwrap_or_default()
    })
    .made();
    [boxes, lanes, lines, markers]
}

/// The layout's description of an array. `pack_grids` compresses grids and masks, most cells of which are empty.
pub fn array_spec(array: &Array, pack_grids: bool) -> ArraySpec {
    let mut spec = array.spec();
    let of = |base: &str| spec.name.starts_with(base);
    if pack_grids && (of(MASK) || of(GRID)) {
        spec.compression = Some(Compression::Deflate(6));
    }
    let of = |base: &str| spec.name.starts_with(base);
    spec.about = match () {
        _ if of("adc") => {
            "ADC samples; the axis chirp counts loops of all transmitters".into()
        }
        _ if of(MASK) => {
            let names = CellClass::ALL.map(|c| format!("{} {}", c as u8, c.name())).join(", ");
            format!("class of each cell seen from above: {names}; row 0 at the radar, column 0 farthest left")
        }
        _ if of(GRID) => "points in the cells of the mask: their number, amplitude over the scan's largest, mean range in m and \
                          mean azimuth in rad"
            .into(),
        _ => "power, mean over channels; zero range rate in the middle row; axes in table radars".into(),
    };
    spec
}
