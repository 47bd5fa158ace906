//! Frames whose beams compute shaders follow, beside those that the host follows in f64, from the scene to the map.

use catseye::adc::budget::trim;
use catseye::base::control::Control;
use catseye::base::convention::Convention;
use catseye::base::frames::Pose;
use catseye::dsp::RangeDoppler;
use catseye::engine::{Engine, Extent, FrameInput, Precision, Tracing};
use catseye::geom::Geometry;
use catseye::gpu::Gpu;
use catseye::gpu::compare::{opened_for_tests, test_gpu};
use catseye::road::objects::ground;
use catseye::road::reflector::Reflector;
use catseye::road::site::Site;
use catseye::road::w3;
use catseye::scene::radar::Radar;
use catseye::scene::{Mesh, Scene, Shape, material, radar_toml, scenario};
use catseye::simulate::thermal_floor::thermal_floor_w;
use catseye::simulate::{self, Frame, Prepared, Wanted, noise_budget};
use catseye::trace::beams::BeamOptions;
use catseye::trace::cpu::beams::{self, Clipped};
use catseye::trace::view_clipper::{self, Traced};
use catseye::trace::windows::around;
use catseye::trace::{Echo, Echoes, TraceOptions, strength};
use glam::{DQuat, DVec2, DVec3};
use std::path::Path;

/// Relative amplitude by which an echo may move: f32 decides, and places are worked out in f64 after it.
const AMPLITUDE: f64 = 1e-4;

fn device() -> Engine {
    Engine::Gpu(Box::new(opened_for_tests()))
}

/// The frame of W3, traced and made by an engine.
fn w3_frame(engine: &Engine) -> (Radar, Echoes, RangeDoppler<f64>) {
    let mut radar = radar_toml::preset("front77").unwrap();
    let at = DVec3::new(0.0, 0.0, w3::RADAR_HEIGHT_M);
    radar.mounting = Pose::new(DQuat::IDENTITY, at);
    radar.thermal_noise = false;
    let scene = w3::w3(true, &material::by_name).unwrap();
    let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz).unwrap();
    let options = TraceOptions { bandwidth_hz: radar.bandwidth_hz(), ..Default::default() };
    let (pose, velocity) = (Pose::new(DQuat::IDENTITY, at), DVec3::X * w3::EGO_SPEED_MPS);
    let mut echoes = engine.trace(&geometry, &radar, &pose, velocity, &options).unwrap();
    let mut noisy = radar.clone();
    noisy.thermal_noise = true;
    trim(&noisy, &mut echoes, noise_budget(&noisy));
    let input = FrameInput {
        radar: &radar,
        echoes: &echoes,
        interference: &[],
        seed: 1,
        frame: 0,
        extent: Extent::CELLS,
    };
    let map = engine.frame(&input, Control::default()).unwrap().maps.remove(0);
    (noisy, echoes, map)
}

#[test]
fn a_frame_of_w3_is_that_of_the_host() {
    let engine = device();
    assert_eq!((engine.tracing(), engine.report().trace), (Tracing::Device, Tracing::Device));
    let before = engine.device_counts().unwrap();
    let (radar, echoes, got) = w3_frame(&engine);
    let counts = engine.device_counts().unwrap().since(&before);
    let (_, truth, want) = w3_frame(&Engine::Cpu(Precision::F64));
    assert!(echoes.on_device && echoes.fallback.is_none() && !truth.on_device, "{:?}", echoes.fallback);
    let noise_w = thermal_floor_w(&radar).unwrap();
    let (mut worst_db, mut moved, mut all, mut above) = (0f64, 0.0, 0.0, 0);
    for (a, b) in got.map.data.iter().zip(&want.map.data) {
        moved += (a - b).powi(2);
        all += b * b;
        if *b > noise_w {
            above += 1;
            worst_db = worst_db.max((10.0 * (a / b).log10()).abs());
        }
    }
    let l2 = (moved / all).sqrt();
    println!(
        "W3: {} and {} echoes, {above} cells above the noise, worst {worst_db:.2e} dB, map L2 {l2:.2e}; {} submissions",
        echoes.list.len(),
        truth.list.len(),
        counts.submits
    );
    assert!(above > 100 && worst_db < 0.1 && l2 < 1e-3, "{above} {worst_db} {l2}");
    // Tracing is more than the one submission that makes the rest of the frame.
    assert!(counts.submits > 1, "{counts:?}");
    // The same bytes twice.
    let (_, again, map) = w3_frame(&device());
    assert!(again == echoes && map == got);
}

/// A corner under a radar whose depth is open.
const OPEN: &str = "name = \"corner\"\nseed = 3\nradar = \"recipes/small_radar.toml\"\n\
                    [[object]]\nname = \"corner\"\nreflector = \"trihedral:leg_m=0.3\"\nposition_m = [12, 1, 0.6]\nyaw_deg = 180\n\
                    [ego]\nspeed_mps = 5\n[frames]\ncount = 3\ninterval_s = 0.1\n";

fn site(text: &str) -> Site {
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/s.toml");
    Site::new(&scenario::parse(&place, text).unwrap()).unwrap()
}

fn frames(engine: &Engine, site: &Site, count: u32) -> Vec<Frame> {
    let prepared = Prepared::new(&site.scenario, &site.scene).unwrap();
    let wanted: Vec<(usize, u32)> = (0..count).map(|index| (0, index)).collect();
    let mut made: Vec<Frame> = Vec::new();
    while made.len() < wanted.len() {
        let some = prepared.frames(engine, &wanted[made.len()..], Control::default());
        made.extend(some.into_iter().map(Result::unwrap));
    }
    made
}

/// Scenes that are unlike each other share submissions, and each has the echoes that it has alone, to the bit.
#[test]
fn scenes_that_are_traced_together_do_not_meet() {
    let roads = ["road/road_model_straight.toml", "road/road_model_right_curve.toml"];
    let mut sites: Vec<Site> = roads
        .iter()
        .map(|road| {
            site(&format!(
                "name = \"road\"\nradar = \"recipes/small_radar.toml\"\n[scene]\nroad = \"{road}\"\n\
                 [ego]\nposition_m = [2, -1.75, 0]\n[trace]\nbounces = 2\n"
            ))
        })
        .collect();
    sites.insert(1, site(OPEN));
    let engine = device();
    let prepared: Vec<_> = sites.iter().map(|s| Prepared::new(&s.scenario, &s.scene).unwrap()).collect();
    let wanted = |which: &[usize]| -> Vec<Wanted<'_, '_>> {
        which.iter().map(|i| Wanted { prepared: &prepared[*i], which: 0, index: 0 }).collect()
    };
    let count = |which: &[usize]| {
        let before = engine.device_counts().unwrap().submits;
        let made = simulate::frames(&engine, &wanted(which), Control::default());
        (made, engine.device_counts().unwrap().submits - before)
    };
    let (alone, submits): (Vec<_>, u64) = (0..3).fold((Vec::new(), 0), |(mut all, n), i| {
        let (mut made, more) = count(&[i]);
        all.extend(made.pop());
        (all, n + more)
    });
    let alone: Vec<Frame> = alone.into_iter().map(Result::unwrap).collect();
    for order in [[0, 1, 2], [2, 1, 0]] {
        let (made, together) = count(&order);
        assert_eq!(made.len(), 3);
        assert!(together < submits, "{together} of {submits}");
        for (made, i) in made.into_iter().zip(order) {
            let made = made.unwrap();
            assert!(made.echoes.on_device && !made.echoes.list.is_empty());
            assert!(made.echoes == alone[i].echoes && made.maps == alone[i].maps, "scene {i}");
        }
    }
    // Bindings that hold one of the scenes and not all of them part the scenes, each of which is as it is alone; ones that hold none leave
    // them to the host.
    for kilobytes in [512, 560, 700, 1200, 3072] {
        let engine = Engine::Gpu(Box::new(opened_for_tests().with_binding_limit(kilobytes << 10)));
        let poses: Vec<_> = wanted(&[0, 1, 2]);
        let mut made: Vec<Frame> = Vec::new();
        while made.len() < 3 {
            let some = simulate::frames(&engine, &poses[made.len()..], Control::default());
            made.extend(some.into_iter().map(Result::unwrap));
        }
        let on_device: Vec<bool> = made.iter().map(|m| m.echoes.on_device).collect();
        println!("{kilobytes} kB: on the device {on_device:?}");
        for (made, alone) in made.iter().zip(&alone) {
            assert_eq!(made.echoes.on_device, made.echoes.fallback.is_none());
            assert!(!made.echoes.on_device || made.echoes == alone.echoes, "{kilobytes}");
        }
        let count = on_device.iter().filter(|on| **on).count();
        assert!(match kilobytes {
            512 => count == 0,
            3072 => count == 3,
            _ => true,
        });
    }
}

/// The strongest echoes of two frames in the order of their paths.
fn strongest(echoes: &Echoes, least: f64) -> Vec<&Echo> {
    let most = echoes.list.iter().map(strength).fold(0.0, f64::max);
    let mut list: Vec<&Echo> = echoes.list.iter().filter(|e| strength(e) > least * most).collect();
    list.sort_by(|a, b| a.path_length_m.total_cmp(&b.path_length_m));
    list
}

/// Where a scenario leaves the depth open, the device is asked what one bounce more brings, as the host is, and goes as deep.
#[test]
fn the_depth_that_is_open_is_found_on_the_device() {
    let site = site(OPEN);
    assert!(site.scenario.trace.most_bounces > site.scenario.trace.bounces);
    let (got, want) = (frames(&device(), &site, 3), frames(&Engine::Cpu(Precision::F64), &site, 3));
    for (a, b) in got.iter().zip(&want) {
        let (g, w) = (&a.echoes, &b.echoes);
        assert!(g.on_device && g.fallback.is_none(), "{:?}", g.fallback);
        assert_eq!(g.bounces, w.bounces);
        let off = (g.power_w - w.power_w).abs() / w.power_w;
        println!("frame {}: {} bounces, power off by {off:.1e}", a.index, g.bounces);
        assert!(w.power_w > 0.0 && off < AMPLITUDE, "{off}");
        assert!(!a.points.is_empty() && a.points.len() == b.points.len());
    }
    // Made together they are as they are made singly, and again.
    let prepared = Prepared::new(&site.scenario, &site.scene).unwrap();
    let engine = device();
    for a in &got {
        let b = prepared.frame(&engine, 0, a.index, Control::default()).unwrap();
        assert!(a.echoes == b.echoes && a.maps == b.maps && a.points == b.points);
    }
    // From two bounces on as deep as a corner has to be followed.
    let (radar, geometry) = corner();
    let options = TraceOptions { bounces: 2, most_bounces: 6, least_cut: Some(0.0), ..Default::default() };
    let of = |e: &Engine| e.trace(&geometry, &radar, &Pose::IDENTITY, DVec3::ZERO, &options).unwrap();
    let (g, w) = (of(&engine), of(&Engine::Cpu(Precision::F64)));
    assert!(g.on_device && g.bounces == w.bounces && w.bounces >= 3, "{} {}", g.bounces, w.bounces);
    assert!((g.power_w - w.power_w).abs() < AMPLITUDE * w.power_w);
}

/// A corner 20 m ahead.
fn corner() -> (Radar, Geometry) {
    let radar = radar_toml::preset("front77").unwrap();
    let mut scene = Scene::default();
    let pose = Pose::from_yaw_pitch_roll(DVec3::X * 20.0, std::f64::consts::PI, 0.62, 0.0);
    let body = Reflector::parse("trihedral:leg_m=0.1").unwrap();
    body.add_to(&mut scene, &material::by_name, ("corner", ""), pose, DVec3::ZERO).unwrap();
    let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz).unwrap();
    (radar, geometry)
}

/// By lines, too: scenes that share submissions have the echoes that they have alone, to the bit, they are as deep and as strong as the host's,
/// and bindings that are too small for one leave it to the host with a reason.
#[test]
fn scenes_are_traced_together_by_lines() {
    let road = "name = \"road\"\nradar = \"recipes/small_radar.toml\"\n[scene]\nroad = \"road/road_model_straight.toml\"\n\
                [ego]\nposition_m = [2, -1.75, 0]\n[trace]\nbounces = 2\n";
    let sites = [site(road), site(OPEN)];
    let by_lines = |gpu: Gpu| Engine::Gpu(Box::new(gpu)).with_tracing(Tracing::Lines).unwrap();
    let engine = by_lines(opened_for_tests());
    assert_eq!((engine.tracing(), engine.report().trace), (Tracing::Lines, Tracing::Lines));
    let prepared: Vec<_> = sites.iter().map(|s| Prepared::new(&s.scenario, &s.scene).unwrap()).collect();
    let wanted = |which: &[usize]| -> Vec<Wanted<'_, '_>> {
        which.iter().map(|i| Wanted { prepared: &prepared[*i], which: 0, index: 0 }).collect()
    };
    let made = |engine: &Engine, which: &[usize]| -> (Vec<Frame>, u64) {
        let before = engine.device_counts().unwrap().submits;
        let (wanted, mut made) = (wanted(which), Vec::new());
        while made.len() < wanted.len() {
            let some = simulate::frames(engine, &wanted[made.len()..], Control::default());
            made.extend(some.into_iter().map(Result::unwrap));
        }
        (made, engine.device_counts().unwrap().submits - before)
    };
    let (mut alone, mut submits) = made(&engine, &[0]);
    let (open, more) = made(&engine, &[1]);
    alone.extend(open);
    submits += more;
    let (together, fewer) = made(&engine, &[1, 0]);
    assert!(fewer < submits, "{fewer} of {submits}");
    for (i, frame) in [(1, &together[0]), (0, &together[1])] {
        let (g, w) = (&frame.echoes, &prepared[i].echoes(&Engine::Cpu(Precision::F64), 0, 0).unwrap().echoes);
        assert!(g.on_device && g.fallback.is_none() && *g == alone[i].echoes && frame.maps == alone[i].maps);
        assert_eq!(g.bounces, w.bounces);
        assert!((g.power_w - w.power_w).abs() < AMPLITUDE * w.power_w, "{} {}", g.power_w, w.power_w);
    }
    for kilobytes in [128, 2000] {
        let engine = by_lines(opened_for_tests().with_binding_limit(kilobytes << 10));
        let (made, _) = made(&engine, &[0]);
        let got = &made[0].echoes;
        match &got.fallback {
            Some(why) => assert!(kilobytes == 128 && why.contains("binding"), "{kilobytes} kB: {why}"),
            None => assert!(kilobytes == 2000 && *got == alone[0].echoes, "{kilobytes} kB"),
        }
    }
    let e = Engine::Cpu(Precision::F32).with_tracing(Tracing::Lines).err().unwrap();
    assert!(e.exit_code() == 2 && e.to_string().contains("trace = lines"), "{e}");
}

/// Within a thousandth of the smallest binding that WebGPU promises, the device traces or says why it does not.
#[test]
fn small_bindings_are_worked_within_or_said() {
    let site = site(&OPEN.replace(
        "[[object]]",
        "[scene]\nroad = \"road/road_model_straight.toml\"\n[trace]\nfacets = 0\nbounces = 2\n[[object]]",
    ));
    let prepared = Prepared::new(&site.scenario, &site.scene).unwrap();
    let received = |engine: &Engine| prepared.echoes(engine, 0, 0).unwrap().echoes;
    let (want, unbound) = (received(&Engine::Cpu(Precision::F64)), received(&device()));
    assert!(unbound.on_device && (unbound.power_w - want.power_w).abs() < AMPLITUDE * want.power_w);
    for kilobytes in [128, 600, 700, 1000, 3000] {
        let got = received(&Engine::Gpu(Box::new(opened_for_tests().with_binding_limit(kilobytes << 10))));
        println!("{kilobytes} kB: {} echoes; fallback {:?}", got.list.len(), got.fallback);
        assert_eq!((got.on_device, got.fallback.is_none()), (kilobytes > 500, kilobytes > 500));
        match &got.fallback {
            // The host's own, to the bit.
            Some(why) => assert!(why.contains("binding") && got.list == want.list, "{why}"),
            None => assert!(got == unbound, "{kilobytes}"),
        }
    }
}

/// What the device has no way for takes the host without a word of refusal: it is known before.
#[test]
fn what_only_the_host_knows_takes_the_host() {
    let (radar, geometry) = corner();
    let engine = device();
    let of = |engine: &Engine, options: &TraceOptions| {
        engine.trace(&geometry, &radar, &Pose::IDENTITY, DVec3::ZERO, options).unwrap()
    };
    let options = TraceOptions { convention: Convention::Last, ..Default::default() };
    let (got, want) = (of(&engine, &options), of(&Engine::Cpu(Precision::F64), &options));
    assert!(!got.on_device && got.fallback.is_none() && got == want && !got.list.is_empty());
    // The corner itself.
    let (got, want) =
        (of(&engine, &TraceOptions::default()), of(&Engine::Cpu(Precision::F64), &TraceOptions::default()));
    assert!(got.on_device && got.list.len() == want.list.len(), "{} {}", got.list.len(), want.list.len());
    for (a, b) in strongest(&got, 1e-3).iter().zip(strongest(&want, 1e-3)) {
        assert!((strength(a) - strength(b)).abs() < AMPLITUDE * strength(b));
        assert!((a.path_length_m - b.path_length_m).abs() < 1e-6 && a.chain == b.chain);
    }
    // The host where it is asked for.
    let host = device().with_tracing(Tracing::Host).unwrap();
    assert_eq!((host.tracing(), host.report().trace), (Tracing::Host, Tracing::Host));
    let got = of(&host, &TraceOptions::default());
    assert!(got == want && !got.on_device);
    let e = Engine::Cpu(Precision::F32).with_tracing(Tracing::Device).err().unwrap();
    assert!(e.exit_code() == 2 && e.to_string().contains("trace = device"), "{e}");
}

#[test]
fn nothing_to_trace_is_traced() {
    let radar = radar_toml::preset("front77").unwrap();
    let engine = device();
    let options = TraceOptions::default();
    // A scene has a face or a point: here a point alone.
    let mut scene = Scene::default();
    let pose = Pose::from_yaw_pitch_roll(DVec3::X * 30.0, 0.0, 0.0, 0.0);
    scene.add_object("post", "post", Shape::Point { rcs_dbsm: 3.0 }, pose, DVec3::ZERO);
    let empty = Geometry::build(&scene, 0.0, radar.carrier_hz).unwrap();
    let all = engine.trace(&empty, &radar, &Pose::IDENTITY, DVec3::ZERO, &options).unwrap();
    let host = engine.echoes(&empty, &radar, &Pose::IDENTITY, DVec3::ZERO, &options);
    assert!(all.list.len() == 1 && all.on_device && all.beyond_reach == 0 && all.list == host.list);
    // Ten kilometres away, where no receiver hears.
    let mut scene = Scene::default();
    let pose = Pose::from_yaw_pitch_roll(DVec3::X * 1e4, std::f64::consts::PI, 0.0, 0.0);
    let body = Reflector::parse("plate:width_m=1,height_m=1").unwrap();
    body.add_to(&mut scene, &material::by_name, ("plate", ""), pose, DVec3::ZERO).unwrap();
    let far = Geometry::build(&scene, 0.0, radar.carrier_hz).unwrap();
    let all = engine.trace(&far, &radar, &Pose::IDENTITY, DVec3::ZERO, &options).unwrap();
    assert!(all.list.is_empty() && all.on_device && all.beyond_reach > 0, "{}", all.beyond_reach);
}

/// What is lit of `face` by way of a road and of `mirror`, m².
fn lit_by_road_and(clipped: &Clipped, faces: [u32; 3]) -> f64 {
    let is_lit_so = |mut node: u32| {
        let mut from = faces.iter().rev();
        while let Some(n) = clipped.nodes.get(node as usize) {
            if from.next() != Some(&n.face) {
                return false;
            }
            node = n.parent;
        }
        from.next().is_none()
    };
    let of_chain = clipped.imaged.iter().filter(|p| is_lit_so(p.node));
    of_chain.map(|p| p.polygon.area().abs()).sum()
}

/// A tilted plate on a road mirrors onto a facet that its plane crosses, which is seen at grazing: only what stands before the plate is
/// lit, however narrow it is in view.
#[test]
fn a_mirror_lights_what_stands_before_its_plane() {
    const TILT: f64 = 0.07;
    const BEFORE_M: f64 = 0.035;
    const LENGTH_M: f64 = 0.053;
    let radar = DVec3::Z * 0.5;
    let options = BeamOptions { images: true, ..BeamOptions::new(3, 0.2, false) };
    for (distance_m, grazing) in
        [10.0, 40.0].into_iter().flat_map(|d| [3e-4, 1e-3, 3e-3, 0.03].map(|g| (d, g)))
    {
        let mut scene = Scene::default();
        let metal = scene.material_index(&material::by_name("aluminium").unwrap());
        let road = ground(DVec2::new(0.0, -3.0), DVec2::new(60.0, 3.0), 0.0, metal);
        scene.add_mesh("road", "road", road, Pose::IDENTITY);
        let mut add = |name: &str, corners: &[DVec3]| {
            let triangles: Vec<[u32; 3]> = (2..corners.len() as u32).map(|i| [0, i - 1, i]).collect();
            let material = vec![metal; triangles.len()];
            let mesh = Mesh { positions_m: corners.to_vec(), triangles, material, normals: Vec::new() };
            scene.add_mesh(name, name, mesh, Pose::IDENTITY);
        };
        // Where the facet goes through the plate, as the radar sees it in the road.
        let at = DVec3::new(distance_m, 0.1, 0.6);
        let (up, across) = (DVec3::new(TILT.sin(), 0.0, TILT.cos()), DVec3::Y * 0.26);
        let (low, high) = (at - up * 0.08, at + up * 0.03);
        add("plate", &[low + across, low - across, high - across, high + across]);
        // Rays that the plate sends back rise by so much, and the facet by a little less.
        let rise = (at.z + radar.z).atan2(at.x) + 2.0 * TILT;
        let along = DVec3::new(-(rise - grazing).cos(), 0.0, (rise - grazing).sin());
        let behind = at - along * (LENGTH_M - BEFORE_M);
        add("facet", &[at + along * BEFORE_M, behind + DVec3::Y * 0.05, behind - DVec3::Y * 0.015]);
        let geometry = Geometry::build(&scene, 0.0, 77e9).unwrap();
        let windows = around(&Pose::new(DQuat::IDENTITY, radar));
        let faces = geometry.faces();
        assert_eq!(faces.faces.len(), 3);
        let bodies = [0, 1, 2].map(|body| faces.faces.iter().position(|f| f.body == body).unwrap() as u32);
        let host = beams::clip_windows(faces, &windows, &options, None);
        let Traced::Whole(device) =
            view_clipper::clip_windows(test_gpu(), faces, &windows, &options, None).unwrap()
        else {
            panic!("the device refuses three faces")
        };
        let [want, got] = [&host, &device].map(|c| lit_by_road_and(c, bodies));
        let before_m2 = 0.5 * LENGTH_M * 0.065 * (BEFORE_M / LENGTH_M).powi(2);
        println!(
            "{distance_m} m at {grazing}: {got:.6e} m2, host {want:.6e}, before the plate {before_m2:.6e}"
        );
        assert!((want - before_m2).abs() < 1e-6 * before_m2, "{distance_m} m at {grazing}");
        assert!((got - want).abs() < 1e-6 * want, "{distance_m} m at {grazing}");
    }
}
