//! Short cuts of the clipper leave the echoes of frames as they are.

use catseye::adc::budget::power_w;
use catseye::adc::synthesis::{Levels, passes};
use catseye::base::frames::{Pose, Sensor, World};
use catseye::base::units::{db_from_power, wavenumber};
use catseye::engine::{Engine, Precision};
use catseye::geom::{Geometry, curved};
use catseye::road::{site::Site, w3};
use catseye::scene::radar::Radar;
use catseye::scene::{Scene, material, radar_toml, scenario};
use catseye::simulate::{radar_pose, trace_options};
use catseye::trace::beams::BeamOptions;
use catseye::trace::cpu::beams;
use catseye::trace::cpu::echoes;
use catseye::trace::cpu::regions;
use catseye::trace::windows::windows;
use catseye::trace::{Echo, TraceOptions};
use catseye_io::{dataset, recipe::Recipe};
use glam::{DQuat, DVec3};
use num_complex::Complex64;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One look of a radar at a scene.
struct Look {
    name: &'static str,
    geometry: Geometry,
    radar: Radar,
    pose: Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: TraceOptions,
}

impl Look {
    fn of_frame(name: &'static str, s: &scenario::SitedScenario, scene: &Scene) -> Look {
        let radar = s.radars[0].clone();
        let refined = curved::sized_within(
            scene,
            s.trace.accuracy_db,
            wavenumber(radar.carrier_hz),
            s.trace.facets as usize,
        )
        .unwrap();
        let reach_s = 0.5 * radar.frame_time_s();
        let geometry = Geometry::of_frame(&refined, 0.0, radar.carrier_hz, reach_s).unwrap();
        let (pose, velocity_mps) = radar_pose(&radar, &s.ego, 0.0);
        Look { name, geometry, radar, pose, velocity_mps, options: trace_options(s, 0, 0).unwrap() }
    }

    /// All echoes, every target asking the tree for what hides it.
    fn plainly(&self) -> Vec<Echo> {
        let TraceOptions { bounces, accuracy_db, images, .. } = self.options;
        let beams =
            BeamOptions { images, occluders_listed: 0, ..BeamOptions::new(bounces, accuracy_db, false) };
        let windows = windows(&self.radar, &self.pose);
        let clipped = beams::clip_windows(self.geometry.faces(), &windows, &beams, None);
        echoes::from_clipped(&self.geometry, &clipped, &self.pose, self.velocity_mps, &self.options).list
    }
}

fn looks() -> [Look; 4] {
    let mut radar = radar_toml::preset("front77").unwrap();
    let at = DVec3::new(0.0, 0.0, w3::RADAR_HEIGHT_M);
    radar.mounting = Pose::new(DQuat::IDENTITY, at);
    let scene = w3::w3(true, &material::by_name).unwrap();
    let boxes = Look {
        name: "W3",
        geometry: Geometry::build(&scene, 0.0, radar.carrier_hz).unwrap(),
        options: TraceOptions { bandwidth_hz: radar.bandwidth_hz(), ..Default::default() },
        radar,
        pose: Pose::new(DQuat::IDENTITY, at),
        velocity_mps: DVec3::X * w3::EGO_SPEED_MPS,
    };
    let place = |file: &str| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes")).join(file);
    let text = "name = \"everything\"\nradar = \"front77\"\n[scene]\nroad = \"road_everything.toml\"\n\
                [ego]\nspeed_mps = 20\non_road = { lane = 1, s_m = 10 }\n";
    let driven = Site::new(&scenario::parse(&place("road/scenario.toml"), text).unwrap()).unwrap();
    let recipe = Recipe::load(Path::new(&place("recipes/template.toml")), None).unwrap();
    let drawn = dataset::drawn_scene(&recipe, 3).unwrap();
    let highways = std::fs::read_to_string(place("recipes/highways.toml")).unwrap();
    let recipe =
        Recipe::parse(&place("recipes/highways.toml"), &highways.replace("\"zarr\"", "\"frames\""), None)
            .unwrap();
    let motorway = dataset::drawn_scene(&recipe, 4).unwrap();
    [
        boxes,
        Look::of_frame("road_everything", &driven.scenario, &driven.scene),
        Look::of_frame("template, scene 3", &drawn.scenario, &drawn.scene),
        Look::of_frame("highways, scene 4", &motorway.scenario, &motorway.scene),
    ]
}

/// Beams find the same whether one task follows each of them or many do.
#[test]
fn tasks_find_what_one_thread_finds() {
    let of = |look: &Look, followed_alone: usize| {
        let TraceOptions { bounces, accuracy_db, images, .. } = look.options;
        let beams = BeamOptions { images, followed_alone, ..BeamOptions::new(bounces, accuracy_db, false) };
        let surfaces = &look.geometry.surfaces;
        let ends = beams::Ends {
            surfaces,
            wavenumber: wavenumber(look.radar.carrier_hz),
            least: 1e-3,
            keeps_weak: false,
        };
        beams::clip_windows(look.geometry.faces(), &windows(&look.radar, &look.pose), &beams, Some(ends))
    };
    for look in &looks()[..2] {
        let (alone, apart) = (of(look, usize::MAX), of(look, 0));
        let node = |n: &beams::Node| (n.parent, n.face, n.bounce, n.imaged, n.endless, n.normal);
        assert!(alone.nodes.iter().map(node).eq(apart.nodes.iter().map(node)), "{}", look.name);
        let same = |a: &[beams::Piece], b: &[beams::Piece]| {
            let of = |p: &beams::Piece| (p.node, p.polygon.corners().to_vec());
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| of(a) == of(b))
        };
        assert!(same(&alone.every, &apart.every) && same(&alone.imaged, &apart.imaged), "{}", look.name);
        let ended = |e: &beams::Ended| (e.node, e.face, e.place, e.left);
        assert!(alone.ended.iter().map(ended).eq(apart.ended.iter().map(ended)), "{}", look.name);
        let found = [alone.every.len(), alone.imaged.len(), alone.ended.len()];
        assert!(found.iter().all(|n| *n > 100), "{}: {found:?}", look.name);
    }
}

/// Scenes of two recipes beside those.
fn ten_looks() -> Vec<Look> {
    let place = |file: &str| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes")).join(file);
    let text = |file: &str| std::fs::read_to_string(place(file)).unwrap().replace("\"zarr\"", "\"frames\"");
    let mut all = Vec::from(looks());
    for (name, file, scenes) in
        [("template", "recipes/template.toml", 0..3), ("highways", "recipes/highways.toml", 0..3)]
    {
        let recipe = Recipe::parse(&place(file), &text(file), None).unwrap();
        for i in scenes {
            let drawn = dataset::drawn_scene(&recipe, i).unwrap();
            all.push(Look::of_frame(name, &drawn.scenario, &drawn.scene));
        }
    }
    all
}

/// The outline of every region encloses what its pieces cover.
#[test]
fn outlines_enclose_what_they_are_made_of() {
    let all = ten_looks();
    assert_eq!(all.len(), 10);
    for look in &all {
        let beams = BeamOptions { images: true, ..BeamOptions::new(3, look.options.accuracy_db, false) };
        let windows = windows(&look.radar, &look.pose);
        let clipped = beams::clip_windows(look.geometry.faces(), &windows, &beams, None);
        let areas = regions::region_areas_m2(&look.geometry, &clipped);
        let off = |[pieces, outline]: &[f64; 2]| (outline - pieces).abs() / pieces;
        let worst = areas.iter().map(off).fold(0.0, f64::max);
        println!("{}: {} regions, worst off by {worst:.1e}", look.name, areas.len());
        assert!(areas.len() > 10 && worst <= 1e-9, "{}: {worst}", look.name);
    }
}

/// Sums of echoes by the objects met and by stretches of the path: as the receiver hears them, and of their powers.
pub type Sums = BTreeMap<(Vec<u32>, i64), (Complex64, f64)>;

/// Those of a look at an accuracy.
fn sums(look: &Look, pose: &Pose<Sensor, World>, accuracy_db: f64) -> Sums {
    let engine = Engine::Cpu(Precision::F64);
    let options = TraceOptions { merge: false, least: 0.0, most_bounces: 0, accuracy_db, ..look.options };
    let echoes = engine.echoes(&look.geometry, &look.radar, pose, look.velocity_mps, &options);
    sums_of(&look.radar, &echoes.list)
}

/// Those of a list of echoes.
pub fn sums_of(radar: &Radar, list: &[Echo]) -> Sums {
    /// Longer than a cell, so that echoes of one thing stay together.
    const STRETCH_M: f64 = 5.0;
    let k = wavenumber(radar.carrier_hz);
    let levels = Levels::new(radar);
    let mut sums = Sums::new();
    for r in list.iter().filter(|r| passes(radar, r)) {
        let a = levels.amplitude(r);
        assert!(a.is_finite(), "{r:?}");
        let key = (r.chain[..r.bounces as usize].to_vec(), (r.path_length_m / STRETCH_M).round() as i64);
        let sum = sums.entry(key).or_default();
        sum.0 += a * Complex64::cis(-k * r.path_length_m);
        sum.1 += a.norm_sqr();
    }
    sums
}

/// Two sums of echoes beside each other: the largest change of a chain that holds at least `share` of the power, as a share of what
/// its echoes hold, and the sum of all changes as a share of all power.
pub fn changes<K: Ord>(
    a: &BTreeMap<K, (Complex64, f64)>,
    b: &BTreeMap<K, (Complex64, f64)>,
    share: f64,
) -> [f64; 2] {
    let total: f64 = a.values().map(|x| x.0.norm_sqr()).sum();
    let (mut worst, mut all) = (0f64, 0.0);
    for key in a.keys().chain(b.keys().filter(|k| !a.contains_key(k))) {
        let of = |sums: &BTreeMap<K, (Complex64, f64)>| sums.get(key).copied().unwrap_or_default();
        let ((p, power), (q, other)) = (of(a), of(b));
        all += (p - q).norm_sqr() / total;
        if power.max(other) > share * total {
            worst = worst.max((p - q).norm() / power.max(other).sqrt());
        }
    }
    [worst, all]
}

/// Nothing hangs on the last digit: the radar moved by 10 nm, along and across, turns phases by 3e-5 rad and changes nothing more.
#[test]
fn ten_nanometres_change_nothing() {
    for look in looks() {
        let before = sums(&look, &look.pose, look.options.accuracy_db);
        for by in [DVec3::new(1e-8, 0.0, 0.0), DVec3::new(0.0, -1e-8, 1e-8)] {
            let mut pose = look.pose;
            pose.translation_m += by;
            let after = sums(&look, &pose, look.options.accuracy_db);
            let [worst, all] = changes(&before, &after, 1e-6);
            let [weak, _] = changes(&before, &after, 1e-9);
            println!(
                "{} moved by {by}: worst {worst:.1e} of a chain, {weak:.1e} of a weak one, {all:.1e} of the power",
                look.name
            );
            // A hundredth of a decibel is 1.15e-3, and one chain of the template's scene moves by 1.23e-3. Chains of less than a millionth of the power end in slivers at grazing, whose edges
            // move by far more than the radar: they are printed, and hold less than 1e-9 of the power.
            assert!(worst < 1.5e-3 && all < 1e-8, "{}: {worst:e}, {all:e}", look.name);
        }
    }
}

/// What hides a face is found among what its beam meets, and only within the receiver's reach; the echoes that are received stay the
/// same.
#[test]
fn short_cuts_leave_what_is_heard() {
    for look in looks() {
        let Look { name, geometry, radar, pose, velocity_mps, options } = &look;
        let plain = look.plainly();
        let engine = Engine::Cpu(Precision::F64);
        let single = TraceOptions { merge: false, most_bounces: 0, ..*options };
        let short = engine.echoes(geometry, radar, pose, *velocity_mps, &single);
        let [n, m] = [&plain, &short.list].map(|list| list.iter().filter(|r| passes(radar, r)).count());
        // Sums with their phases: the order of the cuts decides on which of the waves of one corner a part of its amplitude goes, so that powers
        // of single echoes move where nothing that a receiver hears does.
        let [want, got] = [&plain, &short.list].map(|list| sums_of(radar, list));
        let [strong, moved] = changes(&want, &got, 1e-4);
        let [weak, _] = changes(&want, &got, 1e-6);
        let (far, faces) = (short.beyond_reach, geometry.faces().faces.len());
        println!("{name}: {far} of {faces} faces beyond reach");
        println!(
            "{name}: {n} and {m} echoes, {} sums; moved {moved:.1e} of the power, worst {strong:.1e}, of a weak one {weak:.1e}",
            want.len()
        );
        assert!(far > 0 && short.list.iter().filter(|r| !passes(radar, r)).count() < short.list.len() / 2);
        // An outline that does not close within the tolerance of corners gives the waves of all its pieces' sides, more of them for the
        // same sum.
        assert!(n > 1000 && n.abs_diff(m) <= n / 1000, "{name}: {n} and {m} echoes");
        // A curved facet is summed up in cells, which go with how its lit part was cut: its echo moves by 1e-4 to 1e-3 of itself with the order
        // of the cuts, and the sum of several that nearly cancel by 3.5e-3 of their powers' root. That is less than the 5e-3 which the window
        // leaves over of a surface that goes on. Flat facets alone move by 1e-12.
        assert!(moved < 1e-7 && strong < 5e-3 && weak < 1e-2, "{name}: {moved:e}, {strong:e}, {weak:e}");
    }
}

/// What the limit of bounces cuts off a frame is said: the power of what one bounce more brings, hardly too low, and too high where
/// the middle of a beam goes on and most of it does not. Paths that leave curved surfaces are not estimated: that is 0.3 dB more than 6 in the
/// template's scene, whose fourth bounce at -39.3 dB is all but left out.
#[test]
fn what_the_limit_cuts_off_is_said() {
    let engine = Engine::Cpu(Precision::F64);
    for look in looks() {
        let Look { name, geometry, radar, pose, velocity_mps, options } = &look;
        let echoes = |bounces| {
            let least_cut = options.least_cut.or(Some(0.0));
            let options = TraceOptions { bounces, most_bounces: 0, merge: false, least_cut, ..*options };
            engine.echoes(geometry, radar, pose, *velocity_mps, &options)
        };
        let mut cut = echoes(1);
        for bounces in 2..=4 {
            let more = echoes(bounces);
            // What it brings, with its phases: the one list less the other.
            let mut both = more.list.clone();
            both.extend(cut.list.iter().map(|r| {
                let mut r = r.clone();
                r.path_gain.as_flattened_mut().iter_mut().for_each(|z| *z = -*z);
                r
            }));
            let brought_w = power_w(radar, &both);
            let [said, brought] = [cut.cut_power_w, brought_w].map(|w| db_from_power(w / more.power_w));
            println!("{name}: bounce {bounces} brings {brought:.1} dB of the power; said {said:.1}");
            assert!(brought < -38.0 || (-7.0..20.0).contains(&(said - brought)), "{name}: {said} {brought}");
            cut = more;
        }
    }
}
