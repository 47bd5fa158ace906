//! Every strong cell has an owner: ten unlike scenes, seven unlike radars. What stands over the thermal noise in a map without noise
//! is a point of an object, and points of vehicles and people that no flag calls out of place are on their bodies.

use catseye::base::frames::Pose;
use catseye::detect::Point;
use catseye::engine::{Engine, Precision};
use catseye::road::Library;
use catseye::road::actors::{actor_boxes, actors, base_class};
use catseye::road::shape::cuboid;
use catseye::scene::radar::Radar;
use catseye::scene::scenario::{self, SitedScenario};
use catseye::scene::{Mesh, Scene, material, radar_toml};
use catseye::simulate::simulate;
use catseye::simulate::thermal_floor::thermal_floor_w;
use glam::DVec3;
use std::path::Path;

/// Seven radars: TDM with I and Q; TDM with a falling ramp; real samples behind a filter that lets aliases through; a phase code whose
/// period ends at 80 m; empty Doppler bands; four slopes; transmitters that send at once in slow loops. All of few samples, so that
/// seventy frames take seconds.
pub fn radars() -> Vec<(&'static str, Radar)> {
    let array = "[[tx]]\nposition_half_wavelengths = [0, 0, 0]\n[[tx]]\nposition_half_wavelengths = [0, 4, 0]\n\
                 [[rx]]\nposition_half_wavelengths = [0, 0, 0]\n[[rx]]\nposition_half_wavelengths = [0, 1, 0]\n\
                 [[rx]]\nposition_half_wavelengths = [0, 2, 0]\n[[rx]]\nposition_half_wavelengths = [0, 3, 0]\n\
                 [antenna]\npolarisation = \"V\"\ngain_dbi = 12\npattern = \"cosine-power\"\nazimuth_exponent = 2\n\
                 elevation_exponent = 10\n[mounting]\nposition_m = [3.6, 0, 0.6]\n[transmitter]\npower_dbm = 12\n\
                 [processing]\nrange_window = { kind = \"hann\" }\ndoppler_window = { kind = \"hann\" }\n\
                 angle_window = { kind = \"rectangle\" }\nazimuth_bins = 64\nazimuth_max_deg = 60\nmax_points = 400\n\
                 [processing.cfar]\nkind = \"ca\"\nguard_range_cells = 2\nguard_doppler_cells = 2\n\
                 train_range_cells = 6\ntrain_doppler_cells = 4\nfalse_alarm_probability = 1e-5\n";
    let made = |name: &'static str, head: &str| {
        let text = format!("name = \"{name}\"\n{head}\n{array}");
        (name, radar_toml::parse(Path::new("r.toml"), &text).unwrap())
    };
    vec![
        made(
            "tdm",
            "[waveform]\ncarrier_hz = 77e9\nbandwidth_hz = 400e6\nramp_time_s = 20e-6\nchirp_period_s = 24e-6\n\
             chirps = 128\n[receiver]\nsampling = \"iq\"\nsample_rate_hz = 12e6\nsamples = 192\nadc_start_s = 3e-6\n\
             noise_figure_db = 12",
        ),
        made(
            "falling, TDM, early samples",
            "[waveform]\ncarrier_hz = 79e9\nbandwidth_hz = -1e9\nramp_time_s = 40e-6\nchirp_period_s = 44e-6\n\
             chirps = 96\n[receiver]\nsampling = \"iq\"\nsample_rate_hz = 10e6\nsamples = 160\nadc_start_s = 1e-6\n\
             noise_figure_db = 14",
        ),
        made(
            "real samples and a filter",
            "[waveform]\ncarrier_hz = 76.5e9\nbandwidth_hz = 300e6\nramp_time_s = 20e-6\nchirp_period_s = 22e-6\n\
             chirps = 128\n[receiver]\nsampling = \"real\"\nsample_rate_hz = 12e6\nsamples = 224\nadc_start_s = 1e-6\n\
             noise_figure_db = 12\n[front_end.low_pass]\ncorner_hz = 6e6\norder = 2",
        ),
        made(
            "pmcw",
            "[waveform]\nkind = \"pmcw\"\ncarrier_hz = 79e9\nchip_rate_hz = 250e6\ncode_degree = 7\n\
             chirp_period_s = 0.6e-6\nchirps = 512\nmultiplex = \"bpm\"\n[receiver]\nsampling = \"iq\"\n\
             sample_rate_hz = 250e6\nsamples = 127\nnoise_figure_db = 12",
        ),
        made(
            "ddm",
            "[waveform]\ncarrier_hz = 77e9\nbandwidth_hz = 300e6\nramp_time_s = 18e-6\nchirp_period_s = 20e-6\n\
             chirps = 192\nmultiplex = \"ddm\"\nempty_bands = 1\n[receiver]\nsampling = \"iq\"\nsample_rate_hz = 12e6\n\
             samples = 192\nadc_start_s = 1.5e-6\nnoise_figure_db = 12",
        ),
        {
            let ramp = |bandwidth: &str| {
                format!(
                    "[[waveform.ramp]]\nbandwidth_hz = {bandwidth}\nramp_time_s = 40e-6\nchirp_period_s = 45e-6\n"
                )
            };
            let ramps = ["400e6", "-400e6", "250e6", "-120e6"].map(ramp).concat();
            made(
                "four slopes",
                &format!(
                    "[waveform]\ncarrier_hz = 77e9\nchirps = 64\n{ramps}[receiver]\nsampling = \"iq\"\n\
                     sample_rate_hz = 5e6\nsamples = 180\nadc_start_s = 3e-6\nnoise_figure_db = 12"
                ),
            )
        },
        made(
            "bpm",
            "[waveform]\ncarrier_hz = 76.5e9\nbandwidth_hz = -500e6\nramp_time_s = 24e-6\nchirp_period_s = 30e-6\n\
             chirps = 96\nmultiplex = \"bpm\"\n[receiver]\nsampling = \"iq\"\nsample_rate_hz = 12e6\n\
             samples = 192\nadc_start_s = 4e-6\nnoise_figure_db = 12",
        ),
    ]
}

/// A wall of metal along an arc about (x, y), from one angle to another, 4 m high.
fn arc_wall(s: &mut Scene, centre: [f64; 2], radius_m: f64, angles: [f64; 2]) {
    let metal = s.material_index(&material::by_name("pec").unwrap());
    let steps = 24;
    let mut mesh = Mesh::default();
    for i in 0..=steps {
        let a = angles[0] + (angles[1] - angles[0]) * f64::from(i) / f64::from(steps);
        for z in [0.0, 4.0] {
            let at = DVec3::new(centre[0] + radius_m * a.cos(), centre[1] + radius_m * a.sin(), z);
            mesh.positions_m.push(at);
        }
    }
    for i in 0..steps as u32 {
        let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3];
        // Both sides.
        for t in [[a, c, b], [b, c, d], [a, b, c], [b, d, c]] {
            mesh.triangles.push(t);
            mesh.material.push(metal);
        }
    }
    s.add_mesh("arc", "wall", mesh, Pose::IDENTITY);
}

fn vehicle(kind: &str, from: [f64; 2], to: [f64; 2]) -> String {
    let [x, y] = from;
    let [u, v] = to;
    format!(
        "[[object]]\nvehicle = \"{kind}\"\nname = \"{kind}\"\n[object.trajectory]\nwaypoint = [{{ time_s = -1, position_m = \
         [{x}, {y}, 0] }}, {{ time_s = 1, position_m = [{u}, {v}, 0] }}]\ninterpolation = \"linear\"\n"
    )
}

pub fn point(at: [f64; 3], velocity: [f64; 3], rcs_dbsm: f64) -> String {
    format!("[[point]]\nposition_m = {at:?}\nvelocity_mps = {velocity:?}\nrcs_dbsm = {rcs_dbsm:?}\n")
}

/// Name, scenario, and what is added to the scene.
type NamedScene = (&'static str, String, fn(&mut Scene));

/// Ten scenes.
fn scenes() -> Vec<NamedScene> {
    let none: fn(&mut Scene) = |_| {};
    let far =
        |v: f64| point([95.0, 3.0, 0.6], [v, 0.0, 0.0], 35.0) + &point([140.0, -8.0, 0.6], [0.0; 3], 40.0);
    let rows: String = (0..12).map(|i| point([8.0 + 3.0 * f64::from(i), 4.0, 0.3], [0.0; 3], 0.0)).collect();
    vec![
        ("standing points", rows, none),
        (
            "fast points",
            point([20.0, 3.0, 0.6], [-38.0, 2.0, 0.0], 15.0)
                + &point([33.0, -6.0, 0.6], [27.0, 0.0, 0.0], 20.0),
            none,
        ),
        ("points beyond the range", far(-20.0), none),
        ("lone hatchback", vehicle("hatchback", [32.0, 1.0], [16.0, 1.0]), none),
        ("crossing cyclist", vehicle("cyclist", [14.0, -6.0], [14.0, 2.0]), none),
        ("pedestrian", vehicle("pedestrian", [13.0, 1.0], [10.0, 1.5]), none),
        ("car before a bent wall", vehicle("sedan", [30.0, 0.0], [18.0, 0.0]), |s| {
            arc_wall(s, [10.0, -25.0], 32.0, [0.35, 2.4])
        }),
        ("post beside a wall", point([22.0, -2.0, 0.5], [5.0, 1.0, 0.0], 15.0), |s| {
            let metal = s.material_index(&material::by_name("pec").unwrap());
            let wall = cuboid(DVec3::new(60.0, 0.3, 3.0), DVec3::new(25.0, -6.0, 1.5), metal);
            s.add_mesh("wall", "wall", wall, Pose::IDENTITY);
        }),
        ("truck on a road", vehicle("truck", [38.0, -3.5], [26.0, -3.5]), |s| {
            let asphalt = s.material_index(&material::by_name("asphalt").unwrap());
            let road = cuboid(DVec3::new(120.0, 12.0, 0.2), DVec3::new(50.0, 0.0, -0.1), asphalt);
            s.add_mesh("road", "road", road, Pose::IDENTITY);
        }),
        (
            "rain over a van",
            format!("{}[weather]\nrain_mm_per_h = 10\n", vehicle("van", [25.0, 2.0], [21.0, 2.0])),
            none,
        ),
    ]
}

pub fn framed(text: &str, radar: &Radar, noise: bool) -> SitedScenario {
    let head = "name = \"s\"\nradar = \"demo77\"\n";
    let ego = "[ego]\nspeed_mps = 9\n";
    let mut s =
        scenario::parse(Path::new("s.toml"), &format!("{head}{text}{ego}")).unwrap().without_roads().unwrap();
    s.radars[0] = radar.clone();
    s.radars[0].thermal_noise = noise;
    s
}

/// A car at 80 degrees, where the search ends at 60: a direction at the edge is a bound, and the point is not on the car.
#[test]
fn a_point_at_the_edge_of_the_search_is_not_on_an_object_beyond_it() {
    let radar = radars().remove(0).1;
    for (angle_deg, is_beyond) in [(80f64, true), (30.0, false)] {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let at = [3.6 + 25.0 * cos, 25.0 * sin, 0.0];
        let text =
            format!("[[object]]\nvehicle = \"sedan\"\nposition_m = {at:?}\nyaw_deg = {}\n", angle_deg - 90.0);
        let mut s = framed(&text, &radar, false);
        s.ego.speed_mps = 0.0;
        let scene = s.build(&Library).unwrap();
        let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
        let of_car = || frame.points.iter().filter(|p| base_class(&p.class) == "car");
        assert!(
            of_car().any(|p| p.at_search_edge == is_beyond),
            "{angle_deg} degrees: {} points",
            of_car().count()
        );
        let on_car = of_car().filter(|p| p.is_in_place()).count();
        assert_eq!(on_car == 0, is_beyond, "{angle_deg} degrees: {on_car} on the car");
    }
}

/// A point of an approaching car whose Doppler ambiguity is wrong is before or behind it, but no ghost: its echo is a single reflection.
#[test]
fn a_wrong_ambiguity_is_folded_and_no_ghost() {
    let mut radar = radars().remove(0).1;
    // One transmitter cannot resolve it; 15 m/s wide and a slow ramp: 77e9/4e12 s of 15 m/s are 0.3 m, half a cell 0.2 m.
    radar.tx.truncate(1);
    radar.waveform = catseye::scene::waveform::Waveform::chirp(400e6, 100e-6, 120e-6);
    (radar.sample_rate_hz, radar.samples) = (2.2e6, 200);
    let text = point([30.0, 1.0, 0.6], [-26.0, 0.0, 0.0], 15.0);
    let s = framed(&text, &radar, true);
    let scene = s.build(&Library).unwrap();
    let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
    let p = frame.points.iter().max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm)).unwrap();
    // The ego drives 9 m/s.
    let at = DVec3::new(30.0 - 3.6, 1.0, 0.0);
    let off = p.range_m - at.length();
    println!("{:.2} m/s, {off:+.2} m, {:?}", p.range_rate_mps, p.ambiguity);
    assert!((p.range_rate_mps + 35.0).abs() > 5.0, "the radar resolved it: {}", p.range_rate_mps);
    assert_eq!((p.object_id, p.flag(), p.bounces), (1, "folded", 1));
    assert!(off.abs() > 0.2, "{off}");

    // As fast the other way a car's rear appears by as much inside the car, which is where it is.
    let text = vehicle("passenger-car", [30.0 - 44.0, 1.0], [30.0 + 44.0, 1.0]);
    let s = framed(&text, &radar, true);
    let scene = s.build(&Library).unwrap();
    let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
    let p = frame.points.iter().max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm)).unwrap();
    println!("{:.2} m/s at {:.2} m, {:?}", p.range_rate_mps, p.range_m, p.ambiguity);
    assert!((p.range_rate_mps - 35.0).abs() > 5.0, "the radar resolved it: {}", p.range_rate_mps);
    assert_eq!((p.class.as_str(), p.flag(), p.bounces), ("car", "", 1));
}

#[test]
fn no_strong_cell_is_noise_and_points_are_on_their_bodies() {
    let (mut strong, mut lost, mut of_bodies, mut off) = (0, Vec::new(), 0, Vec::new());
    for (scene_name, text, more) in scenes() {
        for (radar_name, radar) in radars() {
            let s = framed(&text, &radar, false);
            let mut scene = s.build(&Library).unwrap();
            more(&mut scene);
            let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
            let floor_dbm = 30.0 + 10.0 * thermal_floor_w(&radar).unwrap().log10();
            let boxes = actor_boxes(&scene, frame.time_s);
            let owner = |p: &Point| {
                let of = actors(&scene.objects).into_iter();
                of.zip(&boxes)
                    .find(|(parts, _)| parts.iter().any(|i| scene.objects[*i].id == p.object_id))
                    .map(|(_, b)| b)
            };
            for p in &frame.points {
                let is_strong = p.power_dbm > floor_dbm + 3.0;
                strong += usize::from(is_strong);
                if is_strong && p.class == "noise" {
                    lost.push(format!(
                        "{scene_name}, {radar_name}: {:.2} m {:.2} m/s {:.1} dBm",
                        p.range_m, p.range_rate_mps, p.power_dbm
                    ));
                }
                let class = base_class(&p.class);
                if !["car", "van", "truck", "pedestrian", "cyclist"].contains(&class)
                    || !p.is_in_place()
                    || !is_strong
                {
                    continue;
                }
                of_bodies += 1;
                let b = owner(p).unwrap();
                let at = b.pose.inverse().point(frame.pose.point(p.position_m));
                let outside = (b.lower_m - at).max(at - b.upper_m).max(DVec3::ZERO).truncate().length();
                if outside > 2.0 {
                    off.push(format!(
                        "{scene_name}, {radar_name}: {} {:.1} m outside, {:.1} m {:.1}° ± {:?} {:.1} m/s snr {:.0} {:?} bounces {} edge {}",
                        p.class, outside, p.range_m, p.azimuth_rad.to_degrees(), p.std.azimuth_rad.map(f64::to_degrees), p.range_rate_mps,
                        p.power_dbm - floor_dbm, p.ambiguity, p.bounces, p.at_search_edge
                    ));
                }
            }
            // Beyond a code's period of 76 m, and beyond the sampled band of real samples behind a filter that does not stop them.
            let flag = match radar_name {
                "pmcw" => "folded",
                "real samples and a filter" => "aliased",
                _ => "",
            };
            if scene_name == "points beyond the range" && !flag.is_empty() {
                let of_objects = || frame.points.iter().filter(|p| p.object_id != 0);
                assert!(of_objects().any(|p| p.flag() == flag), "{radar_name}: no point is {flag}");
                assert!(of_objects().all(|p| [flag, "side_lobe"].contains(&p.flag())), "{radar_name}");
            }
            println!("{scene_name:26} {radar_name:28} {} points", frame.points.len());
        }
    }
    println!("{strong} strong, {} noise; {of_bodies} on bodies, {} off", lost.len(), off.len());
    for line in lost.iter().chain(&off) {
        println!("{line}");
    }
    assert!(lost.is_empty() && off.is_empty());
}

/// Thermal noise keeps its share: with targets in the scene as many points are `noise` as without any, and as the false-alarm
/// probability says.
#[test]
fn noise_keeps_its_share_of_false_alarms() {
    const PFA: f64 = 5e-4;
    const FRAMES: u64 = 3;
    for (name, radar) in radars() {
        let mut radar = radar;
        radar.processing.cfar.pfa = PFA;
        radar.processing.group = [0, 0];
        let count = |text: &str| {
            let noise = |seed: u64| {
                let mut s = framed(text, &radar, true);
                s.seed = seed;
                let scene = s.build(&Library).unwrap();
                let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
                frame.points.iter().filter(|p| p.class == "noise").count()
            };
            (0..FRAMES).map(noise).sum::<usize>() as f64
        };
        let none = count(&point([500.0, 0.0, 0.6], [0.0; 3], -30.0));
        let some = count(
            &(point([18.0, 2.0, 0.6], [0.0; 3], 10.0) + &point([27.0, -3.0, 0.6], [-7.0, 0.0, 0.0], 15.0)),
        );
        let cells = (FRAMES as usize * radar.range_bins() * radar.doppler_rows()) as f64;
        println!("{name:28} {none} without targets, {some} with; {:.0} expected", PFA * cells);
        // Five deviations of counts; cells about targets are part of their lobes, at most 3 %.
        let far = |a: f64, b: f64| (a - b).abs() > 5.0 * (a + b).sqrt() + 0.03 * b;
        assert!(!far(some, none), "{name}: {some} and {none}");
        // Cells nearer than half a range cell are none, cells at the edges have fewer neighbours: 10 %.
        // Noise of three slopes at once makes no pair.
        let want = if radar.waveform.parts() > 1 { 0.0 } else { PFA * cells };
        assert!((none - want).abs() <= 5.0 * want.sqrt() + 0.1 * want, "{name}: {none} of {want}");
    }
}
