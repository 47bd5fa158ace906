//! A frame in the form of a dataset: arrays of samples and powers, tables of points, echoes and truth.

use super::manifest::Axes;
use super::recipe::{Keep, Recipe};
use super::site::Site;
use super::store::{Array, ArraySpec, Column, Data, Record, Table, TableSpec};
use catseye::adc::synthesis::Levels;
use catseye::base::error::Result;
use catseye::base::frames::angles_from_direction;
use catseye::base::units::dbm_from_w;
use catseye::detect::Point;
use catseye::road::labels::Polyline;
use catseye::road::truth_boxes;
use catseye::scene::radar::Radar;
use catseye::simulate::Frame;
use catseye::simulate::truth::{Visibility, visibility};
use catseye::trace::Echo;
use serde::Serialize;
use std::collections::BTreeMap;

/// Largest distance from the ego vehicle at which lanes, lines and markers are kept, m.
pub const TRUTH_RANGE_M: f64 = 150.0;

/// Makes the record of frame `frame` of the dataset from one frame of all radars.
///
/// Arrays are named `adc` and `range_doppler`, with `_1` and so on for more ramps, and with the radar's name
/// where there are several.
///
/// # Errors
/// Returns an error for arrays or tables that do not match the layout.
pub fn record(recipe: &Recipe, site: &Site, frame: u64, mut radars: Vec<Frame>) -> Result<Record> {
    let keep = recipe.keep;
    let mut arrays = Vec::new();
    let mut tables = vec![frame_table(recipe, site, &radars), radar_table(site, &radars)];
    if keep.points {
        tables.push(point_table(site, &radars));
    }
    if keep.returns {
        tables.push(return_table(site, &radars));
    }
    if keep.truth {
        tables.extend(truth_tables(site, &radars));
    }
    for f in &mut radars {
        arrays_of(keep, site, f, &mut arrays);
    }
    Ok(Record { frame, arrays, tables })
}

/// Name of an array: `base`, with the radar's name if there are several.
fn array_name(base: &str, site: &Site, radar: &Radar) -> String {
    match site.scenario.radars.len() {
        1 => base.to_string(),
        _ => format!("{base}_{}", radar.name.to_ascii_lowercase().replace('-', "_")),
    }
}

fn arrays_of(keep: Keep, site: &Site, f: &mut Frame, arrays: &mut Vec<Array>) {
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
        let empty = catseye::engine::AnyCube::F32(catseye::adc::Cube {
            chirps: 0,
            channels: 0,
            samples: 0,
            data: vec![],
        });
        let cube = std::mem::replace(&mut f.cube, empty).into_f32();
        arrays.push(Array {
            name: array_name("adc", site, radar),
            dims: dims(&["chirp", "virtual_channel", "sample"]),
            shape: vec![cube.chirps, cube.channels, cube.samples],
            data: Data::C32(cube.data),
            unit: "sqrt(W)".into(),
        });
    }
}

/// Columns of a list of rows.
struct Rows<'a, T> {
    list: Vec<T>,
    columns: Vec<(String, Column)>,
    name: &'a str,
}

impl<'a, T> Rows<'a, T> {
    fn new(name: &'a str, list: impl IntoIterator<Item = T>) -> Self {
        Rows { list: list.into_iter().collect(), columns: Vec::new(), name }
    }
    fn put(mut self, name: &str, column: impl Fn(&[T]) -> Column) -> Self {
        self.columns.push((name.to_string(), column(&self.list)));
        self
    }
    fn f64(self, name: &str, of: impl Fn(&T) -> f64) -> Self {
        self.put(name, |l| Column::F64(l.iter().map(&of).collect()))
    }
    fn u32(self, name: &str, of: impl Fn(&T) -> u32) -> Self {
        self.put(name, |l| Column::U32(l.iter().map(&of).collect()))
    }
    fn i64(self, name: &str, of: impl Fn(&T) -> i64) -> Self {
        self.put(name, |l| Column::I64(l.iter().map(&of).collect()))
    }
    fn bool(self, name: &str, of: impl Fn(&T) -> bool) -> Self {
        self.put(name, |l| Column::Bool(l.iter().map(&of).collect()))
    }
    fn text(self, name: &str, of: impl Fn(&T) -> String) -> Self {
        self.put(name, |l| Column::Text(l.iter().map(&of).collect()))
    }
    fn vector(self, names: [&str; 3], of: impl Fn(&T) -> [f64; 3]) -> Self {
        self.f64(names[0], |t| of(t)[0]).f64(names[1], |t| of(t)[1]).f64(names[2], |t| of(t)[2])
    }
    fn rotation(self, of: impl Fn(&T) -> [f64; 4]) -> Self {
        let names = ["rotation_x", "rotation_y", "rotation_z", "rotation_w"];
        names.into_iter().enumerate().fold(self, |rows, (i, name)| rows.f64(name, |t| of(t)[i]))
    }
    fn table(self) -> Table {
        Table { name: self.name.to_string(), columns: self.columns }
    }
}

const PLACE: [&str; 3] = ["x_m", "y_m", "z_m"];
const VELOCITY: [&str; 3] = ["velocity_x_mps", "velocity_y_mps", "velocity_z_mps"];

fn frame_table(recipe: &Recipe, site: &Site, radars: &[Frame]) -> Table {
    let ego = &site.scenario.ego;
    // All radars of a frame share its middle.
    Rows::new("frames", radars.first())
        .u32("scene", |_| site.number)
        .u32("frame_in_scene", |f| f.index)
        .text("split", |_| recipe.split(site.number).to_string())
        .i64("time_ns", |f| (f.time_s * 1e9).round() as i64)
        .i64("seed", |_| site.scenario.seed as i64)
        .vector(PLACE, |f| ego.pose(f.time_s).translation_m.to_array())
        .rotation(|f| ego.pose(f.time_s).rotation.to_array())
        .vector(VELOCITY, |f| ego.at(f.time_s).velocity_mps.to_array())
        .table()
}

fn radar_table(site: &Site, radars: &[Frame]) -> Table {
    let axes = |f: &&Frame| Axes::of(&site.scenario.radars[f.radar]);
    Rows::new("radars", radars)
        .text("radar", |f| site.scenario.radars[f.radar].name.clone())
        .f64("carrier_hz", |f| site.scenario.radars[f.radar].carrier_hz)
        .f64("first_range_m", |f| axes(f).range_m.first)
        .f64("range_bin_m", |f| axes(f).range_m.step)
        .f64("first_range_rate_mps", |f| axes(f).range_rate_mps.first)
        .f64("range_rate_bin_mps", |f| axes(f).range_rate_mps.step)
        .u32("triangles", |f| f.triangles as u32)
        .u32("echoes", |f| f.echoes.list.len() as u32)
        .vector(PLACE, |f| f.pose.translation_m.to_array())
        .rotation(|f| f.pose.rotation.to_array())
        .vector(VELOCITY, |f| f.velocity_mps.to_array())
        .table()
}

/// Table with the columns of points.csv.
fn point_table(site: &Site, radars: &[Frame]) -> Table {
    let name = |f: &Frame| site.scenario.radars[f.radar].name.clone();
    let degrees = |x: Option<f64>| x.map_or(f64::NAN, f64::to_degrees);
    let all = radars.iter().flat_map(|f| f.points.iter().map(move |p| (f, p)));
    Rows::<(&Frame, &Point)>::new("points", all)
        .text("radar", |(f, _)| name(f))
        .f64("range_m", |(_, p)| p.range_m)
        .f64("range_rate_mps", |(_, p)| p.range_rate_mps)
        .f64("azimuth_deg", |(_, p)| p.azimuth_rad.to_degrees())
        .f64("elevation_deg", |(_, p)| p.elevation_rad.to_degrees())
        .vector(PLACE, |(_, p)| p.position_m.to_array())
        .f64("power_dbm", |(_, p)| p.power_dbm)
        .f64("snr_db", |(_, p)| p.snr_db)
        .f64("rcs_dbsm", |(_, p)| p.rcs_dbsm)
        .u32("object_id", |(_, p)| p.object_id)
        .text("class", |(_, p)| p.class.clone())
        .f64("range_std_m", |(_, p)| p.std.range_m)
        .f64("range_rate_std_mps", |(_, p)| p.std.range_rate_mps)
        .f64("azimuth_std_deg", |(_, p)| degrees(p.std.azimuth_rad))
        .f64("elevation_std_deg", |(_, p)| degrees(p.std.elevation_rad))
        .text("ambiguity", |(_, p)| p.ambiguity.name().to_string())
        .u32("bounces", |(_, p)| p.bounces.into())
        .bool("ghost", |(_, p)| p.ghost)
        .f64("share", |(_, p)| p.share)
        .f64("range_rate_modulo_mps", |(_, p)| p.modulo_mps)
        .bool("at_search_edge", |(_, p)| p.at_search_edge)
        .bool("side_lobe", |(_, p)| p.side_lobe)
        .table()
}

/// Table with the columns of returns.csv.
fn return_table(site: &Site, radars: &[Frame]) -> Table {
    struct EchoRow<'a> {
        radar: &'a Radar,
        of: &'a Echo,
        power_w: f64,
    }
    let mut echoes = Vec::new();
    for f in radars {
        let radar = &site.scenario.radars[f.radar];
        let levels = Levels::new(radar);
        let power_w = |of: &Echo| levels.amplitude(of).norm_sqr();
        echoes.extend(f.echoes.list.iter().map(|of| EchoRow { radar, of, power_w: power_w(of) }));
    }
    let chain = |r: &Echo| {
        let ids: Vec<String> = r.chain.iter().take_while(|id| **id != 0).map(u32::to_string).collect();
        ids.join(" ")
    };
    Rows::new("returns", echoes)
        .text("radar", |e| e.radar.name.clone())
        .f64("range_m", |e| e.of.range_m())
        .f64("range_rate_mps", |e| e.of.range_rate_mps())
        .f64("azimuth_deg", |e| angles_from_direction(e.of.arrival).0.to_degrees())
        .f64("elevation_deg", |e| angles_from_direction(e.of.arrival).1.to_degrees())
        .f64("power_dbm", |e| dbm_from_w(e.power_w))
        .text("chain", |e| chain(e.of))
        .u32("bounces", |e| e.of.bounces.into())
        .table()
}

/// A value as the word of a file format.
fn word(value: impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(s)) => s,
        _ => String::new(),
    }
}

/// Tables of boxes, lanes, painted lines and markers, in the world.
fn truth_tables(site: &Site, radars: &[Frame]) -> [Table; 4] {
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
    let boxes = truth_boxes(&site.scene, time_s).into_iter().map(|b| (seen(b.id), b));
    let boxes = Rows::new("boxes", boxes)
        .u32("id", |(_, b)| b.id)
        .text("name", |(_, b)| b.name.clone())
        .text("class", |(_, b)| b.class.clone())
        .vector(PLACE, |(_, b)| b.centre_m)
        .vector(["length_m", "width_m", "height_m"], |(_, b)| b.size_m)
        .rotation(|(_, b)| b.rotation_xyzw)
        .vector(VELOCITY, |(_, b)| b.velocity_mps)
        .vector(["spin_x_rad_per_s", "spin_y_rad_per_s", "spin_z_rad_per_s"], |(_, b)| b.spin_rad_per_s)
        .u32("parent_id", |(_, b)| b.parent_id)
        .text("part", |(_, b)| b.part.clone())
        .bool("visible", |(s, _)| s.visible)
        .u32("returns", |(s, _)| s.returns as u32)
        .f64("power_dbm", |(s, _)| s.power_dbm.unwrap_or(f64::NAN))
        .u32("points", |(s, _)| s.points as u32)
        .u32("ghosts", |(s, _)| s.ghosts as u32)
        .u32("side_lobes", |(s, _)| s.side_lobes as u32)
        .table();

    let roads = site.road.as_ref().map_or(&[][..], |r| &r.roads);
    let mut stations = Vec::new();
    for road in roads {
        for lane in &road.lanes {
            stations.extend(numbered(&lane.centre_m).into_iter().map(|(i, _)| (road, lane, i as usize)));
        }
    }
    let lanes = Rows::new("lanes", stations)
        .text("road", |(road, ..)| road.name.clone())
        .i64("lane", |(_, lane, _)| lane.number.into())
        .text("kind", |(_, lane, _)| word(lane.kind))
        .text("driven", |(_, lane, _)| word(lane.driven))
        .u32("station", |(.., i)| *i as u32)
        .f64("s_m", |(road, _, i)| road.s_m[*i])
        .f64("width_m", |(_, lane, i)| lane.width_m[*i])
        .vector(["left_x_m", "left_y_m", "left_z_m"], |(_, lane, i)| lane.left_m[*i])
        .vector(["centre_x_m", "centre_y_m", "centre_z_m"], |(_, lane, i)| lane.centre_m[*i])
        .vector(["right_x_m", "right_y_m", "right_z_m"], |(_, lane, i)| lane.right_m[*i])
        .table();

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
    let lines = Rows::new("lines", vertices)
        .u32("id", |v| v.id)
        .text("name", |v| v.name.clone())
        .text("kind", |v| v.kind.clone())
        .f64("width_m", |v| v.width_m)
        .u32("vertex", |v| v.number)
        .vector(PLACE, |v| v.at)
        .table();

    let rows = site.road.as_ref().map_or(&[][..], |r| &r.marker_rows);
    let markers = rows.iter().flat_map(|r| r.markers.iter().map(move |m| (r, m)));
    let markers = Rows::new("markers", markers.filter(|(_, m)| near(&m.position_m)))
        .u32("id", |(_, m)| m.id)
        .text("row", |(r, _)| r.name.clone())
        .text("road", |(r, _)| r.road.clone())
        .text("reflector", |(r, _)| r.reflector.clone())
        .f64("s_m", |(_, m)| m.s_m)
        .vector(PLACE, |(_, m)| m.position_m)
        .i64("bit", |(_, m)| m.bit.map_or(-1, |b| b as i64))
        .text("word", |(r, _)| r.word.clone().unwrap_or_default())
        .table();
    [boxes, lanes, lines, markers]
}

/// Meanings of tables and columns; units are the endings of names.
const TABLES: [(&str, &str); 8] = [
    ("frames", "one a frame: where the ego vehicle is, in the world, and which scene this is"),
    ("radars", "one a radar: where it is, in the world, and the axes of its map"),
    ("points", "one a detected point of a radar, in its frame of reference"),
    ("returns", "one an echo as the tracer found it"),
    (
        "boxes",
        "one an object, in the world: wholes (empty `part`) with a box around all of their parts, and parts with their own",
    ),
    ("lanes", "one a station of a lane, in the world"),
    ("lines", "one a vertex of a painted line, in the world"),
    ("markers", "one a marker of the road, in the world"),
];
const COLUMNS: [(&str, &str); 58] = [
    ("scene", "number of the scene"),
    ("frame_in_scene", "number of the frame in its scene"),
    ("split", "train, validation or test"),
    ("time_ns", "middle of the frame, from the middle of the scene's first"),
    ("seed", "of the scene's noise and speckle"),
    ("x_m", "forward"),
    ("y_m", "left"),
    ("z_m", "up"),
    ("rotation_x", "quaternion from its own axes to the world"),
    ("rotation_y", "quaternion from its own axes to the world"),
    ("rotation_z", "quaternion from its own axes to the world"),
    ("rotation_w", "quaternion from its own axes to the world"),
    ("radar", "name of the radar"),
    ("carrier_hz", "middle of the sweep"),
    ("first_range_m", "of the first column of the map"),
    ("range_bin_m", "from column to column of the map"),
    ("first_range_rate_mps", "of the first row of the map"),
    ("range_rate_bin_mps", "from row to row of the map"),
    ("triangles", "of the scene as it was traced"),
    ("echoes", "that the tracer found"),
    ("range_m", "in the middle of the frame"),
    ("range_rate_mps", "positive receding"),
    ("azimuth_deg", "positive left"),
    ("elevation_deg", "positive up"),
    (
        "power_dbm",
        "points: after beamforming at the peak; echoes: of this one alone, mean over channels; boxes: of the coherent sum of the object's echoes in the cell where it is largest, of the radar that hears most, NaN without echoes",
    ),
    ("snr_db", "after beamforming, over the noise of one channel's cell"),
    ("rcs_dbsm", "as the antennas' polarisation sees it"),
    ("object_id", "of the object whose echoes made the point, 0 for none"),
    (
        "class",
        "of the object; of a point that no object made leakage (inside the radar), noise (also other radars) or weather",
    ),
    ("range_std_m", "standard deviation"),
    ("range_rate_std_mps", "standard deviation"),
    ("azimuth_std_deg", "standard deviation; NaN where the array cannot tell"),
    ("elevation_std_deg", "standard deviation; NaN where the array cannot tell"),
    ("ambiguity", "of the range rate: unambiguous, resolved, ego_speed, ambiguous or unresolved"),
    ("chain", "ids of the objects met, in order"),
    ("bounces", "reflections; of a point, those of its strongest echo"),
    (
        "ghost",
        "the point stands where none of the objects is that its strongest echo met, and in that echo's main lobe",
    ),
    (
        "side_lobe",
        "the point lies in a side lobe of its strongest echo, which is elsewhere in range, range rate or direction",
    ),
    ("share", "of the cell's echoes, that the object gave, 0 to 1"),
    (
        "range_rate_modulo_mps",
        "the radar itself knows the range rate but for multiples of this; infinite: for none",
    ),
    ("at_search_edge", "the direction is the edge of the angles that are searched, no measured one"),
    ("id", "of the object"),
    ("parent_id", "id of the whole that the object is a part of; of a whole its own"),
    ("part", "what the object is called as a part of its whole, as wheel; empty for a whole"),
    ("visible", "the object's strongest cell exceeds the thermal noise of a cell, for any radar"),
    ("returns", "echoes of the object in the receivers' bands; of a whole, with those of its parts"),
    (
        "points",
        "points that stand on the object, ghosts and side lobes left out; of a whole, with those of its parts",
    ),
    ("ghosts", "points that are ghosts of the object; of a whole, with those of its parts"),
    ("side_lobes", "points in side lobes of the object's echoes; of a whole, with those of its parts"),
    ("lane", "number of the lane"),
    ("driven", "which way the lane is driven, seen along the axis"),
    ("station", "number of the station along the lane"),
    ("s_m", "arc length along the road's axis"),
    ("width_m", "of the object, lane or line"),
    ("vertex", "number of the vertex along the line"),
    ("reflector", "what the marker is, as `catseye rcs` takes it"),
    ("bit", "position in the code word of the bit that the gap behind this marker spells; -1 without a code"),
    ("word", "code word that the gaps of the row spell; empty without a code"),
];

/// The layout's description of a table.
pub fn table_spec(table: &Table) -> TableSpec {
    let known = |list: &[(&str, &str)], name: &str| {
        list.iter().find(|(n, _)| *n == name).map_or(String::new(), |(_, about)| about.to_string())
    };
    let mut spec = table.spec();
    spec.about = known(&TABLES, &spec.name);
    for c in &mut spec.columns {
        c.about = known(&COLUMNS, &c.name);
    }
    spec
}

/// The layout's description of an array.
pub fn array_spec(array: &Array) -> ArraySpec {
    let mut spec = array.spec();
    spec.about = match spec.name.as_bytes().first() {
        Some(b'a') => {
            "samples as the receiver's converter delivers them; chirps count loops of all transmitters".into()
        }
        _ => "power, mean over channels; zero range rate in the middle row; axes in table radars".into(),
    };
    spec
}
