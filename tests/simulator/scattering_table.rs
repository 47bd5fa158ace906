//! Objects that carry a scattering table echo as the facets that the table was made of.

use catseye::base::frames::{Pose, Sensor, World, polarisation_basis};
use catseye::base::matrix::Matrix2;
use catseye::base::units::wavenumber;
use catseye::geom::Geometry;
use catseye::rcs::cpu::beam_sum::{FrequencyPoint, between, by_beams};
use catseye::rcs::table::{RcsTable, Row};
use catseye::rcs::{Aspect, BistaticAspect, Distance, point_sum};
use catseye::road::reflector::Reflector;
use catseye::scene::scatterer::{ScatteringTable, turned};
use catseye::scene::{Scene, Shape, material};
use catseye::trace::TraceOptions;
use catseye::trace::beams::{BeamOptions, Port};
use catseye::trace::cpu::points::point_echoes;
use catseye::trace::windows::around;
use glam::DVec3;
use num_complex::Complex64;
use std::sync::Arc;

const F: f64 = 77e9;

/// Every bounce's S of the facets by exact beams.
fn exact(geometry: &Geometry, aspects: &[Aspect]) -> Vec<Matrix2> {
    let tone = FrequencyPoint { wavenumber: wavenumber(F), surfaces: &geometry.surfaces };
    let looks: Vec<BistaticAspect> = aspects.iter().map(|a| BistaticAspect::monostatic(*a)).collect();
    let options = BeamOptions::new(3, 0.1, false);
    by_beams(geometry, &[tone], &looks, Distance::Infinite, &options)
        .unwrap()
        .iter()
        .map(|s| s[0].every)
        .collect()
}

/// The reflector's scattering as a file that went through the CSV, within 24 degrees of its x axis.
fn table_of(spec: &str) -> (Scene, Arc<ScatteringTable>) {
    let scene = Reflector::parse(spec).unwrap().to_scene(&material::by_name).unwrap();
    let geometry = Geometry::build(&scene, 0.0, F).unwrap();
    let steps = || (-24..=24).map(|d| f64::from(d).to_radians());
    let aspects: Vec<Aspect> =
        steps().flat_map(|elevation| steps().map(move |azimuth| Aspect { azimuth, elevation })).collect();
    let swept = exact(&geometry, &aspects);
    let rows = aspects
        .iter()
        .zip(swept)
        .map(|(a, s)| Row { frequency_hz: F, aspect: *a, receive: None, s })
        .collect();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("table.csv");
    RcsTable { comments: vec![], rows }.write(&path).unwrap();
    (scene, Arc::new(ScatteringTable::read(&path).unwrap()))
}

/// The scene's object, and the table in its place, at a pose.
fn both(
    scene: &Scene,
    table: &Arc<ScatteringTable>,
    pose: Pose<catseye::base::frames::Target, World>,
) -> [Geometry; 2] {
    let mut meshes = scene.clone();
    meshes.objects[0].pose = pose;
    let mut tables = Scene::default();
    let shape = Shape::Table(tables.table_index(table));
    tables.add_object("t", "", shape, pose, DVec3::ZERO);
    [meshes, tables].map(|s| Geometry::build(&s, 0.0, F).unwrap())
}

fn worst(a: &Matrix2, b: &Matrix2) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max)
}

/// (yaw, pitch, roll) in degrees and place.
const POSES: [([f64; 3], [f64; 3]); 5] = [
    ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    ([0.0, 0.0, 30.0], [0.1, -0.2, 0.05]),
    ([8.3, 0.0, 90.0], [0.0, 0.3, 0.0]),
    ([-5.0, 6.6, -41.0], [1.0, 0.2, -0.1]),
    ([-3.3, -11.2, 163.0], [-0.3, 0.0, 0.7]),
];

fn pose((angles, at): ([f64; 3], [f64; 3]), turn: f64) -> Pose<catseye::base::frames::Target, World> {
    let [yaw, pitch, roll] = angles.map(f64::to_radians);
    Pose::from_yaw_pitch_roll(at.into(), yaw + turn, pitch, roll)
}

/// A dihedral changes the polarisation when it rolls; a plate keeps it.
#[test]
fn a_table_scatters_as_the_facets_that_it_was_made_of() {
    for spec in ["dihedral:width_m=0.012,height_m=0.012", "plate:width_m=0.014,height_m=0.01"] {
        let (scene, table) = table_of(spec);
        let ahead = Aspect { azimuth: 0.0, elevation: 0.0 };
        let face_on = exact(&Geometry::build(&scene, 0.0, F).unwrap(), &[ahead])[0][0][0].norm();
        for p in POSES {
            let [facets, tables] = both(&scene, &table, pose(p, 0.0));
            for aspect in
                [Aspect { azimuth: 0.0, elevation: 0.0 }, Aspect { azimuth: 0.11, elevation: -0.07 }]
            {
                let a = exact(&facets, &[aspect])[0];
                let b =
                    point_sum(&tables, BistaticAspect::monostatic(aspect), F, Distance::Infinite).unwrap();
                let d = worst(&a, &b.every) / face_on;
                // Interpolation: at most 0.45 rad from line to line.
                assert!(d < 3e-3, "{spec} {p:?}: {d}\n{a:?}\n{:?}", b.every);
            }
        }
    }
}

#[test]
fn the_echo_of_a_table_is_that_of_its_facets_far_away() {
    let (scene, table) = table_of("dihedral:width_m=0.012,height_m=0.012");
    let k = wavenumber(F);
    let ahead = Aspect { azimuth: 0.0, elevation: 0.0 };
    let face_on = exact(&Geometry::build(&scene, 0.0, F).unwrap(), &[ahead])[0][0][0].norm();
    // Radars that look along +x, one with a roll of its own, 60 m before the objects, which face it.
    let place = DVec3::new(-60.0, 2.0, 1.0);
    let echo = |g: &Geometry, radar: &Pose<Sensor, World>| {
        let options = TraceOptions { amplitude_floor: 0.0, accuracy_db: 0.02, ..Default::default() };
        let mut s = [[Complex64::ZERO; 2]; 2];
        for r in catseye::trace::cpu::echoes::echoes(g, &around(radar), radar, DVec3::ZERO, &options).list {
            for (z, x) in s.as_flattened_mut().iter_mut().zip(r.path_gain.as_flattened()) {
                *z += x
                    * Complex64::cis(-k * (r.path_length_m - 2.0 * place.length()))
                    * place.length_squared();
            }
        }
        s
    };
    let level = Pose::new(glam::DQuat::IDENTITY, place);
    let rolled = Pose::from_yaw_pitch_roll(place, 0.02, -0.01, 0.3);
    for (n, p) in POSES.into_iter().enumerate() {
        let [facets, tables] = both(&scene, &table, pose(p, std::f64::consts::PI));
        // Exact beams from the radar's place: their H points the other way, as seen from the object.
        let tone = FrequencyPoint { wavenumber: k, surfaces: &facets.surfaces };
        let beams = BeamOptions::new(3, 0.02, false);
        let [[vv, vh], [hv, hh]] =
            between(facets.faces(), &[tone], Port::At(place), Port::At(place), &beams).unwrap()[0].every;
        let seen = [[vv, -vh], [-hv, hh]].map(|row| row.map(|z| z * place.length_squared()));
        let look = (DVec3::from(p.1) - place).normalize();
        let (v, h) = polarisation_basis(look);
        let (rv, rh) = polarisation_basis(rolled.rotation.inverse() * look);
        let (rv, rh) = (rolled.rotation * rv, rolled.rotation * rh);
        let seen_rolled = turned(&seen, [[rv.dot(v), rv.dot(h)], [rh.dot(v), rh.dot(h)]]);
        for (radar, seen) in [(&level, seen), (&rolled, seen_rolled)] {
            let d = worst(&seen, &echo(&tables, radar)) / face_on;
            assert!(d < 3e-3, "{p:?}: {d}\n{seen:?}");
        }
        // And the rays of a frame, where they meet more than the edges of this small body.
        if n < 3 {
            let d = worst(&echo(&facets, &rolled), &echo(&tables, &rolled)) / face_on;
            assert!(d < 0.05, "{p:?}: {d}");
        }
    }
    // Behind a wall there is nothing, and ahead of it the echo has the object's id.
    let [_, tables] = both(&scene, &table, pose(POSES[0], std::f64::consts::PI));
    let radar = Pose::new(glam::DQuat::IDENTITY, DVec3::X * -5.0);
    let echoes = point_echoes(&tables, &radar, DVec3::X * 3.0, &TraceOptions::default());
    assert_eq!((echoes.len(), echoes[0].object_id()), (1, 1));
    assert!((echoes[0].range_rate_mps() + 3.0).abs() < 1e-12 && (echoes[0].range_m() - 5.0).abs() < 1e-12);
    let mut walled = Scene::default();
    let shape = Shape::Table(walled.table_index(&table));
    walled.add_object("t", "", shape, Pose::IDENTITY, DVec3::ZERO);
    let wall = Reflector::parse("plate:width_m=1,height_m=1").unwrap();
    let at = Pose::new(glam::DQuat::IDENTITY, DVec3::X * -1.0);
    wall.add_to(&mut walled, &material::by_name, ("wall", ""), at, DVec3::ZERO).unwrap();
    let g = Geometry::build(&walled, 0.0, F).unwrap();
    assert!(point_echoes(&g, &radar, DVec3::ZERO, &TraceOptions::default()).is_empty());
    let behind = BistaticAspect::monostatic(Aspect { azimuth: std::f64::consts::PI, elevation: 0.0 });
    assert_eq!(point_sum(&g, behind, F, Distance::Infinite).unwrap(), Default::default());
}
