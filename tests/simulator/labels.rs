//! Labels of points and the truth of a frame: ghosts, shares, visibility, sides.

use catseye::base::frames::{Pose, Sensor, World, angles_from_direction};
use catseye::base::units::power_from_db;
use catseye::detect::accuracy::PointStd;
use catseye::detect::ambiguity::Ambiguity;
use catseye::detect::{Bodies, Labeller, Point};
use catseye::engine::{Engine, Precision};
use catseye::road::reflector::Reflector;
use catseye::road::shape::cuboid;
use catseye::road::{Library, site::Site};
use catseye::scene::front_end::Leakage;
use catseye::scene::radar::Antenna;
use catseye::scene::scenario::{self, SitedScenario};
use catseye::scene::{Scene, Shape, material, radar_toml};
use catseye::simulate::simulate;
use catseye::simulate::truth::Truth;
use catseye::trace::{Echo, Echoes};
use glam::DVec3;
use std::path::Path;

const RADAR_HEIGHT_M: f64 = 0.5;

fn scenario(text: &str) -> SitedScenario {
    scenario::parse(Path::new("s.toml"), text).unwrap().without_roads().unwrap()
}

/// The shortest way to a box along its own axes.
fn outside_m(p: DVec3, pose: &Pose<catseye::base::frames::Target, World>, half: DVec3) -> f64 {
    let q = pose.inverse().point(p);
    (q.abs() - half).max(DVec3::ZERO).length()
}

/// A metal block left of the way, and a metal wall to the right in which its near face is seen square on.
fn walled() -> (Scene, Pose<catseye::base::frames::Target, World>, DVec3) {
    let mut s = Scene::default();
    let metal = s.material_index(&material::by_name("pec").unwrap());
    let size = DVec3::new(3.0, 1.8, 1.5);
    let at = DVec3::new(15.0, 1.0, 0.75);
    // Of the radar's image in the wall at y = -4.
    let image = DVec3::new(0.0, -8.0, RADAR_HEIGHT_M);
    let to = image - at;
    let pose = Pose::from_yaw_pitch_roll(at, to.y.atan2(to.x), 0.0, 0.0);
    s.add_mesh("car", "car", cuboid(size, DVec3::ZERO, metal), pose);
    let wall = cuboid(DVec3::new(40.0, 0.2, 3.0), DVec3::new(20.0, -4.1, 1.5), metal);
    s.add_mesh("wall", "wall", wall, Pose::IDENTITY);
    (s, pose, 0.5 * size)
}

#[test]
fn a_car_beside_a_wall_has_a_ghost_behind_it() {
    let (scene, pose, half) = walled();
    let mut s = scenario(
        "name = \"wall\"\nradar = \"demo77\"\n[[point]]\nposition_m = [500, 0, 0]\nrcs_dbsm = 0\n\
         [trace]\nbounces = 3\n",
    );
    // The radar, not the vehicle, stands where the wall's image of the block looks square.
    s.ego.position_m = DVec3::Z * RADAR_HEIGHT_M - s.radars[0].mounting.translation_m;
    let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
    let mine: Vec<&Point> = frame.points.iter().filter(|p| p.class == "car").collect();
    let world = |p: &Point| frame.pose.point(p.position_m);
    for p in &mine {
        println!(
            "{:.2} {} bounces {} share {:.2} {:.1} dBm",
            world(p),
            p.ghost,
            p.bounces,
            p.share,
            p.power_dbm
        );
    }
    // Behind the wall stands nothing: what the radar sees there is a ghost of the car.
    let behind: Vec<_> = mine.iter().filter(|p| world(p).y < -4.5).collect();
    assert!(!behind.is_empty() && behind.iter().all(|p| p.ghost && p.bounces == 3), "{}", behind.len());
    // Its image in the wall.
    let mirrored = |p: DVec3| DVec3::new(p.x, -8.0 - p.y, p.z);
    let strongest = behind.iter().max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm)).unwrap();
    assert!(outside_m(mirrored(world(strongest)), &pose, half) < 0.5, "{}", world(strongest));
    assert!(strongest.share > 0.9);
    // Turned to the radar, the block itself is none.
    let (mut facing, at) = (scene.clone(), pose.translation_m);
    let turned = Pose::from_yaw_pitch_roll(at, (-at.y).atan2(-at.x), 0.0, 0.0);
    facing.objects.iter_mut().find(|o| o.class == "car").unwrap().pose = turned;
    let seen = simulate(&Engine::Cpu(Precision::F32), &s, &facing, 0).unwrap();
    let place = |p: &Point| outside_m(seen.pose.point(p.position_m), &turned, half);
    let there: Vec<_> = seen.points.iter().filter(|p| p.class == "car" && place(p) < 0.3).collect();
    assert!(!there.is_empty() && there.iter().all(|p| !p.ghost), "{there:?}");
    // The truth counts them apart.
    let truth = Truth::new(&s, &scene, &frame, None);
    let car = truth.actors.iter().find(|a| a.whole.class == "car").unwrap();
    assert!(car.seen.visible && car.seen.returns > 0);
    let counts = car.seen.counts.unwrap();
    assert_eq!(counts.points + counts.ghosts + counts.side_lobes, mine.len());
    assert_eq!(counts.ghosts, mine.iter().filter(|p| p.ghost).count());
    assert!(truth.free_space.is_none() && truth.lanes.is_empty());
}

#[test]
fn bounces_in_one_body_are_no_ghost() {
    let mut scene = Scene::default();
    let reflector = Reflector::parse("trihedral:leg_m=0.15").unwrap();
    let look = Pose::from_yaw_pitch_roll(DVec3::new(12.0, 1.0, 0.3), std::f64::consts::PI, 0.0, 0.0);
    reflector.add_to(&mut scene, &material::by_name, ("corner", "reflector"), look, DVec3::ZERO).unwrap();
    let s = scenario("name = \"t\"\nradar = \"demo77\"\n[[point]]\nposition_m = [500, 0, 0]\nrcs_dbsm = 0\n");
    let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
    let p = frame.points.iter().max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm)).unwrap();
    assert_eq!((p.class.as_str(), p.ghost), ("reflector", false));
    assert!(p.bounces >= 2, "{}", p.bounces);
    assert!(p.share > 0.999, "{}", p.share);
}

/// Image theory for a target over a conducting wall: straight out and back over the wall, or the other way round, are two
/// echoes at the mean of both lengths, one from the target's direction and one from its image's. With one transmitter and
/// sixteen receivers the radar sees them where they come in.
#[test]
fn half_way_over_a_wall_is_a_ghost_of_its_object() {
    let (mut scene, _, _) = walled();
    scene.objects.retain(|o| o.class == "wall");
    let target = DVec3::new(15.0, 1.0, RADAR_HEIGHT_M);
    let at = Pose::new(glam::DQuat::IDENTITY, target);
    let id = scene.add_object("target", "car", Shape::Point { rcs_dbsm: 10.0 }, at, DVec3::ZERO);
    let mut s = scenario(
        "name = \"wall\"\nradar = \"demo77\"\n[[point]]\nposition_m = [500, 0, 0]\nrcs_dbsm = 0\n\
         [trace]\nbounces = 3\n",
    );
    s.ego.position_m = DVec3::Z * RADAR_HEIGHT_M - s.radars[0].mounting.translation_m;
    let radar = &mut s.radars[0];
    let half = 0.5 * radar.wavelength_m();
    radar.tx.truncate(1);
    radar.tx[0].position_m = DVec3::ZERO;
    let antenna = radar.rx[0].clone();
    radar.rx = (0..16)
        .map(|i| Antenna { position_m: DVec3::Y * (half * (f64::from(i) - 7.5)), ..antenna.clone() })
        .collect();
    let frame = simulate(&Engine::Cpu(Precision::F64), &s, &scene, 0).unwrap();
    // Seen from the radar; the wall's face is the plane y = -4.
    let direct = target - frame.pose.translation_m;
    let image = DVec3::new(direct.x, -8.0 - direct.y, direct.z);
    let half_way_m = 0.5 * (direct.length() + image.length());
    let azimuth = |p: DVec3| p.y.atan2(p.x);
    let near = |p: &&Point, range_m: f64, azimuth_rad: f64| {
        (p.range_m - range_m).abs() < 0.1 && (p.azimuth_rad - azimuth_rad).abs() < 1.5f64.to_radians()
    };
    let of = |range_m: f64, from: DVec3| frame.points.iter().find(|p| near(p, range_m, azimuth(from)));
    let ghost = of(half_way_m, direct).or_else(|| of(half_way_m, image)).unwrap();
    println!("{} {} ghost {} share {:.3}", ghost.object_id, ghost.class, ghost.ghost, ghost.share);
    assert_eq!((ghost.object_id, ghost.class.as_str(), ghost.bounces, ghost.ghost), (id, "car", 2, true));
    assert!(ghost.share > 0.99, "{}", ghost.share);
    // There and back over the wall: its image, a ghost too. Straight: the target itself.
    let twice = of(image.length(), image).unwrap();
    assert_eq!((twice.object_id, twice.bounces, twice.ghost), (id, 3, true));
    let itself = of(direct.length(), direct).unwrap();
    assert_eq!((itself.object_id, itself.bounces, itself.ghost), (id, 1, false));
}

/// Noise, what leaks inside the radar, and one target: the first two by where they have to be.
#[test]
fn leakage_and_noise_are_no_objects() {
    for delay_s in [0.2e-9, 5e-9] {
        let text = "name = \"n\"\nradar = \"demo77\"\n[[point]]\nname = \"post\"\nclass = \"post\"\n\
                    position_m = [33.6, 0, 0.5]\nrcs_dbsm = 10\n";
        let mut s = scenario(text);
        let radar = &mut s.radars[0];
        radar.front_end.leakage = Some(Leakage { isolation_db: 40.0, delay_s });
        // One false alarm in a thousand cells.
        radar.processing.cfar.pfa = 1e-3;
        radar.processing.max_points = 1000;
        let (cell_m, bins) = (radar.range_bin_m(), radar.range_bins());
        let rate_mps = radar.velocity_bin_mps();
        let scene = s.build(&Library).unwrap();
        let frame = simulate(&Engine::Cpu(Precision::F64), &s, &scene, 0).unwrap();
        // Samples and lines of this radar are as many as the bins: cells are resolution cells.
        let leak = 0.5 * catseye::base::units::C0 * delay_s / cell_m;
        let leak_dbm = s.radars[0].tx_power_dbm - 40.0;
        let (mut leaked, mut noise, mut wrapped) = (0, 0, 0);
        for p in &frame.points {
            let bin = p.range_m / cell_m;
            let still = p.range_rate_mps.abs() < 2.0 * rate_mps;
            let turned = |from: f64| {
                let off = bin - from;
                (off - bins as f64 * (off / bins as f64).round()).abs()
            };
            assert!(bin > 0.49 && p.rcs_dbsm > -150.0, "{p:?}");
            assert!(p.object_id != 0 || (p.share, p.ghost, p.bounces) == (0.0, false, 0), "{p:?}");
            match p.class.as_str() {
                "post" => {
                    assert!(turned(30.0 / cell_m) < 12.0 && p.object_id != 0, "{p:?}");
                    // The main lobe of Hann windows ends two cells from the post.
                    let off = turned(30.0 / cell_m).max(p.range_rate_mps.abs() / rate_mps);
                    assert!(!p.side_lobe || off > 1.9 || p.azimuth_rad.abs() > 0.1, "{p:?}");
                    assert!(p.side_lobe || (off < 2.1 && p.azimuth_rad.abs() < 0.5), "{p:?}");
                }
                "leakage" => {
                    leaked += 1;
                    wrapped += usize::from(bin > 0.9 * bins as f64);
                    // A Hann window's transform stays below 1/(πx(x² − 1)); a tenth of the power makes a point.
                    let x = turned(leak).max(1.2);
                    let lobe_db = -20.0 * (std::f64::consts::PI * x * (x * x - 1.0)).log10();
                    assert!(p.power_dbm < leak_dbm + lobe_db.min(0.0) + 11.0 && p.object_id == 0, "{p:?}");
                }
                "noise" => {
                    noise += 1;
                    // A few decibels over the detector's threshold, but in the skirts of what is strong.
                    let skirt = turned(leak).min(turned(30.0 / cell_m)) < 20.0;
                    assert!(p.object_id == 0 && (p.snr_db < 25.0 || skirt), "{p:?}");
                }
                other => panic!("{other}: {p:?}"),
            }
            // In the lobe of either nothing else can be.
            if still && turned(leak) < 1.0 {
                assert_eq!(p.class, "leakage", "{p:?}");
            }
            if still && turned(30.0 / cell_m) < 1.0 {
                assert_eq!(p.class, "post", "{p:?}");
            }
        }
        println!(
            "{delay_s}: {} points, {noise} noise, {leaked} leakage, {wrapped} at the end",
            frame.points.len()
        );
        assert!(noise > 5 && leaked > 0 && (leak > 0.5 || wrapped > 0));
    }
}

/// A strong target over a rectangle's window, whose side lobes stand over the noise: each point of it but one is a side lobe,
/// of the target and of no ghost, and the truth counts them apart.
#[test]
fn side_lobes_are_labelled_and_counted() {
    let text = "name = \"n\"\nradar = \"demo77\"\n[[point]]\nname = \"post\"\nclass = \"post\"\n\
                position_m = [33.6, 0, 0.5]\nrcs_dbsm = 30\n";
    let mut s = scenario(text);
    let radar = &mut s.radars[0];
    radar.processing.range_window = catseye::scene::radar::Window::Rectangle;
    radar.processing.group = [0, 0];
    let (cell_m, rate_mps) = (radar.range_bin_m(), radar.velocity_bin_mps());
    let scene = s.build(&Library).unwrap();
    let frame = simulate(&Engine::Cpu(Precision::F64), &s, &scene, 0).unwrap();
    let mine: Vec<&Point> = frame.points.iter().filter(|p| p.class == "post").collect();
    let range_m = (DVec3::new(33.6, 0.0, 0.5) - frame.pose.translation_m).length();
    let off = |p: &Point| ((p.range_m - range_m).abs() / cell_m).max(p.range_rate_mps.abs() / rate_mps);
    // A rectangle's main lobe ends one cell from the target.
    let (lobes, own): (Vec<&Point>, Vec<&Point>) = mine.iter().partition(|p| p.side_lobe);
    println!("{} own, {} side lobes", own.len(), lobes.len());
    assert!(lobes.len() > 5 && own.len() == 1, "{} {}", lobes.len(), own.len());
    assert!(off(own[0]) < 0.5 && lobes.iter().all(|p| off(p) > 0.9), "{lobes:?}");
    assert!(mine.iter().all(|p| !p.ghost && p.object_id == 1 && p.bounces == 1));
    // Their envelope is 1/πx: what is labelled has the level of a lobe.
    for p in &lobes {
        let lobe_db = p.power_dbm - own[0].power_dbm + 20.0 * (std::f64::consts::PI * off(p)).log10();
        assert!((-30.0..1.0).contains(&lobe_db), "{lobe_db}: {p:?}");
    }
    let truth = Truth::new(&s, &scene, &frame, None);
    let seen = truth.actors[0].seen;
    let counts = seen.counts.unwrap();
    assert_eq!((counts.points, counts.ghosts, counts.side_lobes), (1, 0, lobes.len()));
}

/// Where a part's echo counts: for the part and for its whole.
#[test]
fn a_whole_has_the_echoes_and_points_of_its_parts() {
    let scene = street();
    let (car, wheel) = (2, 3);
    let mut s =
        scenario("name = \"t\"\nradar = \"front77\"\n[[point]]\nposition_m = [500, 0, 0]\nrcs_dbsm = 0\n");
    s.ego.position_m = sensor().translation_m - s.radars[0].mounting.translation_m;
    // Any frame: its echoes and points are those of this test.
    let far = s.build(&Library).unwrap();
    let mut frame = simulate(&Engine::Cpu(Precision::F32), &s, &far, 0).unwrap();
    let (on_body, body) = seen(DVec3::new(28.0, 0.2, 0.7), &[car], true);
    let (on_wheel, of_wheel) = seen(DVec3::new(35.0, 0.9, 0.3), &[wheel], true);
    frame.echoes = Echoes { list: vec![body, of_wheel], ..Default::default() };
    frame.points = vec![
        Point { object_id: car, ..on_body },
        Point { object_id: wheel, ..on_wheel.clone() },
        Point { object_id: wheel, side_lobe: true, ..on_wheel },
    ];
    let seen = catseye::simulate::truth::visibility(&s.radars[0], &frame, &scene);
    let counts = |id: u32| {
        let points = seen[&id].counts.unwrap_or_default();
        (seen[&id].returns, points.points, points.ghosts, points.side_lobes)
    };
    assert_eq!((counts(car), counts(wheel)), ((2, 2, 0, 1), (1, 1, 0, 1)));
    assert!(!seen.contains_key(&4) && seen[&wheel].visible);
    // The wheel is farther by a quarter: its own power is 40 lg(35.01/28) dB less than the whole's strongest cell.
    let apart = seen[&car].power_dbm.unwrap() - seen[&wheel].power_dbm.unwrap();
    assert!((apart - 40.0 * (35.01f64 / 28.0).log10()).abs() < 0.1, "{apart}");
    // Two radars together.
    let none = catseye::simulate::truth::Visibility::default();
    assert_eq!((seen[&car].and(none), none.and(seen[&car])), (seen[&car], seen[&car]));
    assert_eq!(seen[&car].and(seen[&wheel]).returns, 3);
    assert_eq!(seen[&wheel].and(seen[&car]).power_dbm, seen[&car].power_dbm);
    // The boxes say what belongs to what.
    let truth = Truth::new(&s, &scene, &frame, None);
    let told: Vec<_> = truth.boxes.iter().map(|b| (b.id, b.parent_id, b.part.as_str())).collect();
    assert_eq!(told, [(1, 1, ""), (car, car, ""), (wheel, car, "wheel"), (4, 4, "")]);
    let whole = truth.actors.iter().find(|a| a.whole.id == car).unwrap();
    assert_eq!((whole.whole.clone(), whole.seen), (truth.boxes[1].clone(), seen[&car]));
}

/// A road, a car of two parts on it, a lamp over it.
fn street() -> Scene {
    let mut s = Scene::default();
    let at = |x: f64, y: f64, z: f64| Pose::new(glam::DQuat::IDENTITY, DVec3::new(x, y, z));
    let block = |size: DVec3| cuboid(size, DVec3::ZERO, 0);
    s.add_mesh("road", "road", block(DVec3::new(200.0, 20.0, 0.2)), at(50.0, 0.0, -0.1));
    s.add_mesh("car", "car", block(DVec3::new(4.0, 1.8, 1.4)), at(30.0, 0.0, 0.75));
    s.add_mesh("car wheel", "car.wheel", block(DVec3::new(0.6, 0.2, 0.6)), at(28.7, 0.9, 0.3));
    s.add_mesh("lamp", "pole", block(DVec3::new(0.2, 0.2, 0.2)), at(25.0, 3.0, 8.0));
    s
}

fn sensor() -> Pose<Sensor, World> {
    Pose::new(glam::DQuat::IDENTITY, DVec3::new(0.0, 0.0, RADAR_HEIGHT_M))
}

/// A point and the echo that made it, at a place in the world, over the objects of a chain.
fn seen(place: DVec3, chain: &[u32], with_elevation: bool) -> (Point, Echo) {
    let at = place - sensor().translation_m;
    let (azimuth_rad, elevation_rad) = angles_from_direction(at);
    let mut echo = catseye::adc::synthesis::point_echo(at, DVec3::ZERO, power_from_db(10.0), chain[0]);
    echo.chain[..chain.len()].copy_from_slice(chain);
    echo.bounces = chain.len() as u8;
    // An array on a line reads u_y and takes the rest for level.
    let (azimuth_rad, elevation) = match with_elevation {
        true => (azimuth_rad, elevation_rad),
        false => ((at.y / at.length()).asin(), 0.0),
    };
    let point = Point {
        range_m: at.length(),
        range_rate_mps: 0.0,
        azimuth_rad,
        elevation_rad: elevation,
        position_m: at,
        power_dbm: -105.0,
        snr_db: 30.0,
        rcs_dbsm: 10.0,
        object_id: 0,
        class: String::new(),
        bounces: 0,
        ghost: false,
        side_lobe: false,
        folded: false,
        aliased: false,
        share: 0.0,
        angle_ambiguity: None,
        other_angles_rad: vec![],
        at_search_edge: false,
        others_std_rad: [0.0; 2],
        cell: None,
        std: PointStd {
            range_m: 0.01,
            range_rate_mps: 0.02,
            azimuth_rad: Some(0.002),
            elevation_rad: with_elevation.then_some(0.004),
        },
        beat_std_cells: 0.1,
        ambiguity: Ambiguity::Unresolved,
        modulo_mps: f64::INFINITY,
    };
    (point, echo)
}

#[test]
fn ghosts_by_chain_and_place() {
    let radar = radar_toml::preset("front77").unwrap();
    let scene = street();
    let bodies = Bodies::new(&scene, 0.0, &sensor());
    let (road, car, wheel, lamp) = (1, 2, 3, 4);
    let ghost = |place: [f64; 3], chain: &[u32], with_elevation: bool| {
        let (point, echo) = seen(DVec3::from_array(place), chain, with_elevation);
        let echoes = Echoes { list: vec![echo], ..Default::default() };
        let label = Labeller::new(&radar, &echoes, &bodies).unwrap().label(&point);
        assert_eq!((usize::from(label.bounces), label.share), (chain.len(), 1.0));
        (label.object_id, label.ghost)
    };
    // Over the road and back by it, at the car's own place: it is there.
    assert_eq!(ghost([28.0, 0.2, 0.7], &[road, car, road], true), (car, false));
    assert_eq!(ghost([28.05, 0.2, -0.7], &[road, car, road], false), (car, false));
    // Its image under the road, where elevation is measured.
    assert_eq!(ghost([28.0, 0.2, -0.7], &[road, car, road], true), (car, true));
    // Between two things, at neither of them.
    assert_eq!(ghost([26.5, 1.5, 4.0], &[car, lamp], true), (car, true));
    assert_eq!(ghost([25.0, 3.0, 8.0], &[lamp, car], true), (lamp, false));
    // A car and its own wheel are one: on the body is in place, and elsewhere is not.
    assert_eq!(ghost([28.0, 0.2, 0.7], &[car, wheel], true), (car, false));
    assert_eq!(ghost([33.0, 4.0, 0.5], &[car, wheel], true), (car, true));
    assert_eq!(ghost([35.0, 3.0, 0.5], &[car, car, car], true), (car, true));
    // Three standard deviations: 3 x 0.002 x 28 = 0.17 m beside the body's 0.9 m.
    assert_eq!(ghost([28.0, -1.05, 0.7], &[road, car], true), (car, false));
    assert_eq!(ghost([28.0, -1.10, 0.7], &[road, car], true), (car, true));
    // Without elevation the lamp's height is no offence: u_y and the range are right.
    assert_eq!(ghost([25.0, 3.0, 8.0], &[road, lamp], false), (lamp, false));
    assert_eq!(ghost([25.5, 3.0, 8.0], &[road, lamp], false), (lamp, true));
    // The ground is everywhere and no place to stand.
    assert_eq!(ghost([60.0, 0.0, -0.05], &[road, car, road], true), (car, true));
}

#[test]
fn truth_of_the_marked_road() {
    let text = "name = \"m\"\nradar = \"demo77\"\n[scene]\nbuiltin = \"marked-road\"\n\
                [ego]\nposition_m = [2, -1.5, 0]\nyaw_deg = 2\nspeed_mps = 10\n";
    let plan = scenario::parse(Path::new("s.toml"), text).unwrap();
    let Site { scenario: s, scene, road } = Site::new(&plan).unwrap();
    let road = road.unwrap();
    let frame = simulate(&Engine::Cpu(Precision::F32), &s, &scene, 0).unwrap();
    let truth = Truth::new(&s, &scene, &frame, Some(&road));
    let place = truth.ego_lane.as_ref().unwrap();
    assert_eq!(place.number, 3);
    assert!((place.s_m - 2.0).abs() < 1e-9 && (place.width_m - 3.5).abs() < 1e-9);
    assert!((place.offset_m - 0.25).abs() < 1e-12 && (place.heading_rad - 2f64.to_radians()).abs() < 1e-12);
    assert_eq!((truth.lanes.len(), truth.lane_lines.len(), truth.markers.len()), (4, 3, 60));
    assert!(truth.markers.iter().all(|m| m.row.is_some() && m.word.is_none()));
    assert_eq!(truth.markers[0].position_m, [5.0, 3.5, 0.002]);
    // Nothing here has parts.
    assert!(truth.boxes.iter().all(|b| b.parent_id == b.id && b.part.is_empty()));
    // No ground among the actors; posts, markers, cars are.
    assert_eq!(truth.actors.len(), scene.objects.len() - 3);
    assert!(truth.actors.iter().all(|a| a.whole.class != "road" && a.parts == [a.whole.id]));
    let cars: Vec<_> = truth.actors.iter().filter(|a| a.whole.class == "car").collect();
    assert!(cars.iter().all(|c| c.seen.visible && c.seen.returns > 0), "{cars:?}");
    let points: usize =
        truth.actors.iter().filter_map(|a| a.seen.counts).map(|n| n.points + n.ghosts + n.side_lobes).sum();
    let labelled =
        frame.points.iter().filter(|p| p.object_id != 0 && !["road", "verge"].contains(&p.class.as_str()));
    assert_eq!(points, labelled.count());
    // The way ahead: the standing car's tail at x = 62 - 2.2 or so, its lane to the right of the axis.
    let free = truth.free_space.as_ref().unwrap();
    let ahead = &free.distance_m[170..190];
    assert!(ahead.iter().any(|d| (50.0..61.0).contains(d)), "{ahead:?}");
    assert!(free.distance_m.iter().all(|d| *d <= 98.1));
    // To the side the edge of the pavement: 4.5 m from the axis.
    let radar = frame.pose.translation_m;
    let left = free.distance_m[180 + 88];
    assert!((left - (4.5 - radar.y)).abs() < 0.02, "{left}");
    // The text holds the same truth.
    let text = serde_json::to_string(&truth).unwrap();
    let back: Truth = serde_json::from_str(&text).unwrap();
    assert_eq!(back.actors.len(), truth.actors.len());
    let near = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-9);
    assert_eq!(back.lanes.len(), 4);
    for (a, b) in back.lanes.iter().zip(&truth.lanes) {
        assert!(a.number == b.number && a.left_m.iter().zip(&b.left_m).all(|(p, q)| near(p, q)));
    }
}
