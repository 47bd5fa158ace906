//! What is the same thing echoes the same, however its mesh is cut up and however roughly its file holds it.

use catseye::base::frames::{Pose, Sensor, Target, World};
use catseye::base::units::wavenumber;
use catseye::geom::Geometry;
use catseye::road::reflector::Reflector;
use catseye::scene::{Mesh, Scene, material};
use catseye::trace::cpu::echoes;
use catseye::trace::windows::around;
use catseye::trace::{Echoes, TraceOptions};
use glam::{DMat3, DQuat, DVec3};
use num_complex::Complex64;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// How a rectangle is cut up and held.
#[derive(Clone, Copy)]
pub(super) struct Cut {
    /// Quadrilaterals along both sides.
    pub(super) n: [u32; 2],
    /// Every second row is shifted by half of one, so that corners lie on sides.
    pub(super) bricks: bool,
    /// Each has corners of its own.
    pub(super) apart: bool,
    /// In the file's own axes, m and rad.
    pub(super) offset_m: DVec3,
    pub(super) yaw: f64,
    /// Largest along each axis, m.
    pub(super) noise_m: f64,
    /// Places are rounded to f32.
    pub(super) f32: bool,
}

pub(super) const WHOLE: Cut =
    Cut { n: [1, 1], bricks: false, apart: false, offset_m: DVec3::ZERO, yaw: 0.0, noise_m: 0.0, f32: false };

/// Numbers in -1..1 that look random.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// The parallelogram from `corner` along `sides`, as the file holds it, and the pose that brings it back.
fn sheet(corner: DVec3, sides: [DVec3; 2], cut: Cut, seed: u64) -> (Mesh, Pose<Target, World>) {
    let mut noise = Noise(seed);
    let turn = DQuat::from_rotation_z(cut.yaw);
    let mut held = |p: DVec3| {
        let p = turn * p + cut.offset_m + DVec3::new(noise.next(), noise.next(), noise.next()) * cut.noise_m;
        if cut.f32 { p.as_vec3().as_dvec3() } else { p }
    };
    let mut mesh = Mesh::default();
    let mut known: BTreeMap<[i64; 2], u32> = BTreeMap::new();
    let [n, m] = cut.n;
    for j in 0..m {
        let shift = cut.bricks && j % 2 == 1;
        // In halves of a quadrilateral.
        let starts: Vec<[u32; 2]> = match shift {
            false => (0..n).map(|i| [2 * i, 2 * i + 2]).collect(),
            true => {
                let inner = (0..n - 1).map(|i| [2 * i + 1, 2 * i + 3]);
                [[0, 1]].into_iter().chain(inner).chain([[2 * n - 1, 2 * n]]).collect()
            }
        };
        for [a, b] in starts {
            let mut vertex = |i: u32, j: u32| {
                let mut new = || {
                    let (s, t) = (f64::from(i) / f64::from(2 * n), f64::from(j) / f64::from(m));
                    mesh.positions_m.push(held(corner + sides[0] * s + sides[1] * t));
                    mesh.positions_m.len() as u32 - 1
                };
                if cut.apart { new() } else { *known.entry([i.into(), j.into()]).or_insert_with(new) }
            };
            let q = [vertex(a, j), vertex(b, j), vertex(b, j + 1), vertex(a, j + 1)];
            mesh.triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
            mesh.material.extend([0, 0]);
        }
    }
    (mesh, Pose::new(turn.inverse(), -(turn.inverse() * cut.offset_m)))
}

pub(super) fn seen(scene: &Scene, at: DVec3) -> (Echoes, Geometry) {
    seen_turned(scene, at, DQuat::IDENTITY)
}

fn seen_turned(scene: &Scene, at: DVec3, turn: DQuat) -> (Echoes, Geometry) {
    let geometry = Geometry::of_frame(scene, 0.0, 77e9, 0.0).unwrap();
    let pose: Pose<Sensor, World> = Pose::new(turn, at);
    let options = TraceOptions { amplitude_floor: 0.0, ..Default::default() };
    (echoes::echoes(&geometry, &around(&pose), &pose, DVec3::ZERO, &options), geometry)
}

/// The sum of all echoes of each chain, for H.
pub(super) fn by_chain(found: &Echoes) -> BTreeMap<Vec<u32>, Complex64> {
    let k = wavenumber(77e9);
    let mut sums = BTreeMap::new();
    for r in &found.list {
        let sum: &mut Complex64 = sums.entry(r.chain[..r.bounces as usize].to_vec()).or_default();
        *sum += r.path_gain[1][1] * Complex64::cis(-k * r.path_length_m);
    }
    sums
}

pub(super) fn db(z: Complex64) -> f64 {
    20.0 * z.norm().log10()
}

/// A wall beside the road with a point and a corner before it.
pub(super) fn walled(cut: Cut, seed: u64) -> Scene {
    let mut scene = Scene::default();
    scene.material_index(&material::by_name("steel").unwrap());
    let (wall, pose) =
        sheet(DVec3::new(4.0, 4.0, 0.0), [DVec3::new(16.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 3.0)], cut, seed);
    scene.add_mesh("wall", "wall", wall, pose);
    for (spec, place) in [
        ("point:rcs_dbsm=10", DVec3::new(20.0, -1.0, 0.8)),
        ("trihedral:leg_m=0.1", DVec3::new(18.0, 0.5, 0.6)),
    ] {
        let body = Reflector::parse(spec).unwrap();
        let pose = Pose::from_yaw_pitch_roll(place, PI - 0.25, 0.4, 0.0);
        body.add_to(&mut scene, &material::by_name, (spec, ""), pose, DVec3::ZERO).unwrap();
    }
    scene
}

/// A wall's ghosts, half and full, of a point and of a corner are those of the same wall as one quadrilateral.
#[test]
fn a_wall_is_a_wall_however_it_is_cut_up() {
    let radar = DVec3::new(0.0, 0.0, 0.5);
    let (found, _) = seen(&walled(WHOLE, 0), radar);
    let want = by_chain(&found);
    let ghosts: Vec<&Vec<u32>> =
        want.keys().filter(|c| c.contains(&1) && c.iter().any(|id| *id > 1) && c.len() < 4).collect();
    let strongest = ghosts.iter().map(|c| db(want[*c])).fold(f64::NEG_INFINITY, f64::max);
    println!("ghosts {ghosts:?} {:?}", want.iter().map(|(c, z)| (c, db(*z))).collect::<Vec<_>>());
    assert!(ghosts.iter().filter(|c| c.contains(&2)).count() == 3 && ghosts.len() >= 6);
    let base = Cut { f32: true, ..WHOLE };
    let mut cuts = Vec::new();
    for n in [[1, 1], [2, 1], [10, 10], [100, 100]] {
        for (yaw, offset) in [(0.3, 20.0), (1.9, 500.0), (4.1, 5000.0)] {
            let offset_m = DVec3::new(offset, -0.7 * offset, 0.0);
            cuts.push(Cut { n, yaw, offset_m, ..base });
            cuts.push(Cut { n, yaw: yaw + 0.7, offset_m, noise_m: 1e-4, ..base });
        }
    }
    let yaws = (0..20).map(|i| Cut {
        n: [10, 10],
        yaw: 0.314 * f64::from(i),
        offset_m: DVec3::new(250.0 * f64::from(i), 31.0, 2.0),
        noise_m: 1e-4,
        ..base
    });
    cuts.extend(yaws);
    let own = Cut { n: [10, 10], yaw: 0.8, offset_m: DVec3::new(80.0, 90.0, 0.0), noise_m: 1e-4, ..base };
    cuts.extend([
        Cut { apart: true, ..own },
        Cut { bricks: true, ..own },
        Cut { n: [9, 7], bricks: true, ..own },
    ]);
    for (seed, cut) in cuts.into_iter().enumerate() {
        let (found, geometry) = seen(&walled(cut, seed as u64 + 1), radar);
        let got = by_chain(&found);
        let off = |c: &&Vec<u32>| got.get(*c).map_or(f64::INFINITY, |z| (db(*z) - db(want[*c])).abs());
        let most = |weak: bool| {
            let counts = |c: &&&Vec<u32>| weak == (db(want[**c]) < strongest - 60.0);
            ghosts.iter().filter(counts).map(off).fold(0.0, f64::max)
        };
        let (most, most_of_weak) = (most(false), most(true));
        println!(
            "{:?} bricks {} apart {} yaw {:.1} at {} noise {}: {} faces, {} patches, {most:.3} dB, {most_of_weak:.3} of weak ones",
            cut.n,
            cut.bricks,
            cut.apart,
            cut.yaw,
            cut.offset_m.x,
            cut.noise_m,
            geometry.faces().faces.len(),
            geometry.faces().patch_area_m2.len()
        );
        assert!(most < 0.5, "{most}");
        // Noisy bricks leave slits of 0.1 mm, through which ghosts 67 dB under the strongest are off by 1.3 dB.
        assert!(most_of_weak < if cut.bricks { 1.5 } else { 0.5 }, "{most_of_weak}");
    }
}

/// A graded and banked road of quadrilaterals of 0.7 m, 500 m from its file's origin, fades as two rays over its plane.
#[test]
fn a_graded_road_of_many_facets_fades_as_two_rays() {
    let k = wavenumber(77e9);
    let along = DVec3::new(1.0, 0.0, 0.04).normalize();
    let across = DVec3::new(0.0, 1.0, 0.03);
    let across = (across - along * along.dot(across)).normalize();
    let up = along.cross(across);
    let cut = Cut {
        n: [60, 12],
        yaw: 0.6,
        offset_m: DVec3::new(400.0, 300.0, 12.0),
        noise_m: 0.0,
        f32: true,
        ..WHOLE
    };
    for (noise_m, bound) in [(0.0, 0.3), (1e-4, 0.3)] {
        let (mesh, placed) =
            sheet(along * -6.0 - across * 4.2, [along * 42.0, across * 8.4], Cut { noise_m, ..cut }, 5);
        let (radar, mut squares, mut count) = (up * 0.15, 0.0, 0);
        for i in 0..60 {
            let place = along * (12.0 + 0.1 * f64::from(i)) + up * 0.35 + across * 0.3;
            let mut scene = Scene::default();
            scene.material_index(&material::by_name("pec").unwrap());
            scene.add_mesh("road", "road", mesh.clone(), placed);
            let point = Reflector::parse("point:rcs_dbsm=0").unwrap();
            let pose = Pose::new(DQuat::IDENTITY, place);
            point.add_to(&mut scene, &material::by_name, ("point", ""), pose, DVec3::ZERO).unwrap();
            let turn = DQuat::from_mat3(&DMat3::from_cols(along, across, up));
            let (found, _) = seen_turned(&scene, radar, turn);
            let got: Complex64 =
                by_chain(&found).iter().filter(|(c, _)| c.contains(&2)).map(|(_, z)| *z).sum();
            // Two rays over the plane, for H: the image's field is the negative one.
            let d = place - radar;
            let (r, image) = (d.length(), (d + up * 0.3).length());
            let field = Complex64::cis(-k * r) / r - Complex64::cis(-k * image) / image;
            let want = field * field / (4.0 * PI).sqrt();
            squares += (db(got) - db(want)).powi(2);
            count += 1;
        }
        let rms = (squares / f64::from(count)).sqrt();
        println!("noise {noise_m}: two-ray error {rms:.3} dB rms");
        assert!(rms < bound, "{noise_m}: {rms}");
    }
}

/// A marker that stands on a road returns what it returns a hair's breadth above it, also where rounding puts its bottom into the
/// road's plane or behind it.
#[test]
fn a_marker_on_the_road_lies_on_it() {
    let level = |height_m: f64, ground: &str, d: f64| {
        let mut scene = Scene::default();
        scene.material_index(&material::by_name(ground).unwrap());
        let (road, pose) = sheet(DVec3::new(-5.0, -10.0, 0.0), [DVec3::X * 60.0, DVec3::Y * 20.0], WHOLE, 0);
        scene.add_mesh("road", "road", road, pose);
        let body = Reflector::parse("type1:height_m=0.03,length_m=0.05").unwrap();
        let pose = Pose::from_yaw_pitch_roll(DVec3::new(d, 0.1, height_m), PI, 0.0, 0.0);
        body.add_to(&mut scene, &material::by_name, ("marker", ""), pose, DVec3::ZERO).unwrap();
        let (found, _) = seen(&scene, DVec3::new(0.0, 0.0, 0.5));
        let all: Complex64 = by_chain(&found).iter().filter(|(c, _)| c.contains(&2)).map(|(_, z)| *z).sum();
        db(all * d * d)
    };
    for (ground, d) in [("asphalt", 12.0), ("asphalt", 21.0), ("pec", 9.0)] {
        let want = level(1e-6, ground, d);
        for height_m in [0.0, -1e-6, -5e-5, 1e-7, 1e-4] {
            let got = level(height_m, ground, d);
            println!("{ground} {d} m, {height_m} m: {got:.3} dB, {want:.3} dB");
            assert!((got - want).abs() < 0.15, "{ground} {d} m, {height_m} m: {got} {want}");
        }
        // Up to two millimetres the ways over the road turn by 0.3 rad, and the level goes with them, without a leap.
        let mut before = want;
        for i in 1..=8 {
            let height_m = 2.5e-4 * f64::from(i);
            let got = level(height_m, ground, d);
            println!("{ground} {d} m, {height_m} m: {got:.3} dB");
            assert!((got - before).abs() < 0.3, "{ground} {d} m, {height_m} m: {got} after {before}");
            before = got;
        }
    }
}

/// What physical optics gives at `target` of the field that a radar at the origin sends as H, by way of a conducting plate, summed up over
/// cells: the component that H of a way straight `from` there takes.
fn by_quadrature(corner: DVec3, sides: [DVec3; 2], target: DVec3, from: DVec3) -> Complex64 {
    let k = wavenumber(77e9);
    let h_of = |d: DVec3| DVec3::Z.cross(d).normalize();
    let normal = sides[0].cross(sides[1]).normalize();
    let cells = sides.map(|s| (s.length() / 4e-4).ceil());
    let area = sides[0].cross(sides[1]).length() / (cells[0] * cells[1]);
    let mut sum = Complex64::ZERO;
    let seen_by = h_of(target - from);
    for i in 0..cells[0] as u32 {
        let row = corner + sides[0] * ((f64::from(i) + 0.5) / cells[0]);
        for j in 0..cells[1] as u32 {
            let p = row + sides[1] * ((f64::from(j) + 0.5) / cells[1]);
            let (r, away) = (p.length(), target - p);
            let (dir, s) = (p / r, away.normalize());
            // eta J = 2 n x (k x E), and what it radiates across s.
            let current = 2.0 * normal.cross(dir.cross(h_of(dir)));
            let across = current - s * s.dot(current);
            let z = Complex64::cis(-k * (r + away.length())) / (r * away.length());
            sum += z * (across.dot(seen_by) * area);
        }
    }
    sum * Complex64::new(0.0, -k / (4.0 * PI))
}

/// Plates of 0.3 to 3 m that mirror a point: half ghosts are what the integral over the plate gives, on the plate's middle, at its
/// side, and beside it, and they go with its size without a leap.
#[test]
fn plates_of_any_size_mirror_by_one_law() {
    let target = DVec3::new(9.0, -1.0, 0.4);
    // The place of mirror reflection on the plane y = 2, whose normal is -y.
    let foot = DVec3::new(9.0 * 2.0 / 5.0, 2.0, 0.4 * 2.0 / 5.0);
    let ghost = |width: f64, height: f64, shift: f64| {
        let corner = foot + DVec3::new(-0.5 * width + shift, 0.0, -0.5 * height);
        let sides = [DVec3::X * width, DVec3::Z * height];
        let (mesh, pose) = sheet(corner, sides, WHOLE, 0);
        let mut scene = Scene::default();
        scene.material_index(&material::by_name("pec").unwrap());
        scene.add_mesh("plate", "", mesh, pose);
        let point = Reflector::parse("point:rcs_dbsm=0").unwrap();
        let at = Pose::new(DQuat::IDENTITY, target);
        point.add_to(&mut scene, &material::by_name, ("point", ""), at, DVec3::ZERO).unwrap();
        let (found, _) = seen(&scene, DVec3::ZERO);
        let all = by_chain(&found);
        let half = |c: [u32; 2]| all.get(c.as_slice()).copied().unwrap_or_default();
        assert!((half([1, 2]) - half([2, 1])).norm() <= 1e-12 * half([1, 2]).norm());
        (half([1, 2]), corner, sides)
    };
    for (width, height, shift) in [
        (0.3, 0.3, 0.0),
        (0.5, 0.3, 0.1),
        (1.0, 0.6, 0.0),
        (1.0, 0.6, 0.48),
        (1.0, 0.6, 0.5),
        (1.0, 0.6, 0.54),
        (1.0, 0.6, 0.62),
        (3.0, 0.5, 0.7),
    ] {
        let (got, corner, sides) = ghost(width, height, shift);
        let want = by_quadrature(corner, sides, target, DVec3::ZERO) / ((4.0 * PI).sqrt() * target.length());
        let off = db(got) - db(want);
        println!(
            "{width} x {height} m, {shift} m off: {:.2} dB, quadrature {:.2}, off {off:.2}",
            db(got),
            db(want)
        );
        assert!(off.abs() < 1.0, "{width} {height} {shift}: {off}");
    }
    let (mut before, mut largest) = (None, 0f64);
    for i in 0..=1150 {
        let width = 0.3 * 1.002f64.powi(i);
        let level = db(ghost(width, width, 0.03).0);
        if let Some(before) = before.replace(level) {
            largest = largest.max((level - before).abs());
        }
    }
    println!("0.2 % of size changes the level by {largest:.3} dB at most");
    assert!(largest < 0.25, "{largest}");
}

/// Plates mirror a sphere's mesh, out, back and both ways, by the physical-optics integral over the plate: within 0.3 dB where they
/// are no endless mirrors to it (CONVENTIONS eq. 65), and where they are, within the ripple of a plate of 1 m, 2.5 dB each way at 25 m.
#[test]
fn plates_mirror_meshes_by_the_integral() {
    const RADIUS_M: f64 = 0.0564;
    for (target, wall_m) in [(DVec3::new(9.0, -1.0, 0.4), 2.0), (DVec3::new(25.0, -2.0, 0.6), 3.0)] {
        for (width, shift) in [
            (0.3, 0.0),
            (0.45, 0.1),
            (0.6, 0.0),
            (0.9, 0.0),
            (0.9, 0.4),
            (0.99, 0.0),
            (1.01, 0.0),
            (1.5, 0.3),
            (2.0, 0.0),
        ] {
            let share = wall_m / (2.0 * wall_m - target.y);
            let foot = DVec3::new(target.x * share, wall_m, target.z * share);
            let corner = foot + DVec3::new(-0.5 * width + shift, 0.0, -0.5 * width);
            let sides = [DVec3::X * width, DVec3::Z * width];
            let (mesh, pose) = sheet(corner, sides, WHOLE, 0);
            let mut scene = Scene::default();
            scene.material_index(&material::by_name("pec").unwrap());
            scene.add_mesh("plate", "", mesh, pose);
            let at = Pose::from_yaw_pitch_roll(target, PI, 0.0, 0.0);
            let body = Reflector::parse(&format!("sphere:radius_m={RADIUS_M}")).unwrap();
            body.add_to(&mut scene, &material::by_name, ("target", ""), at, DVec3::ZERO).unwrap();
            let all = by_chain(&seen(&scene, DVec3::ZERO).0);
            let level = |chain: &[u32]| all.get(chain).map_or(f64::NEG_INFINITY, |z| db(*z));
            let got = [&[1, 2][..], &[2, 1], &[1, 2, 1]].map(|chain| level(chain) - level(&[2]));
            // Against the field that arrives straight. A sphere sends as much back in all directions near it, H as H, from the place that
            // mirrors one way into the other.
            let image = DVec3::Y * (2.0 * wall_m);
            let to = [DVec3::ZERO, image].map(|p| (p - target).normalize());
            let way = |mirrors: DVec3| {
                let place = target + mirrors.normalize() * RADIUS_M;
                db(by_quadrature(corner, sides, place, image) * place.length())
            };
            let (half, both) = (way(to[0] + to[1]), 2.0 * way(to[1]));
            println!(
                "{} m, plate of {width} m, {shift} m off: {got:.2?} dB, integral {half:.2} and {both:.2}",
                target.x
            );
            let bounds = if width < 1.0 { [0.2, 0.2, 0.3] } else { [2.7, 2.7, 5.3] };
            for ((got, want), bound) in got.into_iter().zip([half, half, both]).zip(bounds) {
                assert!((got - want).abs() < bound, "{target} {width} {shift}: {got} {want}");
            }
        }
    }
}
