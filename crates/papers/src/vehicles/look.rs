//! One frame of one body: the level of its echoes, and the points that the radar makes of them.

use catseye::base::error::{BadInput, Result};
use catseye::base::frames::{Pose, Target, World};
use catseye::base::rng::Draws;
use catseye::base::units::{db_from_power, power_from_db, wavelength_m, wavenumber};
use catseye::engine::Engine;
use catseye::road::vehicle::{Body, Kind, vehicle};
use catseye::scene::scenario::{self, SitedScenario};
use catseye::scene::{Scene, material};
use catseye::simulate::Prepared;
use catseye::trace::Echo;
use glam::{DVec2, DVec3};
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::path::Path;

/// Height of the radar over the road, m.
pub const RADAR_HEIGHT_M: f64 = 0.5;
/// Frequencies over which the power of a body's echoes is averaged. Their spacing tells echoes 2 x 17 m apart.
const TONES: usize = 128;
/// A point this near to the outline of the body's box counts as on it, and this near to a corner as at the corner, m.
pub const NEAR_M: f64 = 0.5;
/// Bodies stand up to this far off the radar's boresight, rad.
const OFF_BORESIGHT_RAD: f64 = 0.15;
/// Bodies are pitched and rolled by up to this much, as by their load and the road, rad.
const TILT_RAD: f64 = 0.015;

/// What is looked at.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Grid {
    /// Kinds of the library.
    pub kinds: Vec<Kind>,
    /// Distances from the radar to the body's box along the line to its middle, m.
    pub distances_m: Vec<f64>,
    /// Number of directions around a body, evenly spaced; each look is moved within its step.
    pub aspects: usize,
    /// Number of looks in each direction. Every look has a body of its own: bodies differ in metal, bumper, tilt, the phase of wheels
    /// and limbs, direction, place and noise.
    pub bodies: usize,
    /// Seed of all draws.
    pub seed: u64,
}

impl Grid {
    /// Checks the grid's limits.
    ///
    /// # Errors
    /// Returns `BadInput` with the command's key for an empty list, a distance outside 3 to 50 m, fewer than 4 or more than 360
    /// directions, and a number of bodies outside 1 to 100.
    pub fn check(&self) -> Result<()> {
        let bad = |key: &str, problem: &str, value: String, allowed: &str| {
            BadInput::new(problem).key(key).value(value).allowed(allowed)
        };
        if self.kinds.is_empty() {
            return Err(bad(
                "--kinds",
                "the list of kinds is empty",
                "".into(),
                "kinds of the library, separated by commas",
            )
            .into());
        }
        if self.distances_m.is_empty() || self.distances_m.len() > 8 {
            let count = self.distances_m.len().to_string();
            return Err(bad(
                "--distances",
                "the number of distances is out of range",
                count,
                "1 to 8 distances",
            )
            .into());
        }
        if let Some(d) = self.distances_m.iter().find(|d| !(3.0..=50.0).contains(*d)) {
            let bad = bad("--distances", "is out of range", d.to_string(), "3..=50");
            return Err(bad.remedy("give distances in metres, separated by commas, such as 7,15,30").into());
        }
        if !(4..=360).contains(&self.aspects) {
            let count = self.aspects.to_string();
            return Err(bad("--aspects", "is out of range", count, "4..=360").into());
        }
        if !(1..=100).contains(&self.bodies) {
            let count = self.bodies.to_string();
            return Err(bad("--bodies", "is out of range", count, "1..=100").into());
        }
        Ok(())
    }

    /// Number of frames.
    pub fn looks(&self) -> usize {
        self.kinds.len() * self.distances_m.len() * self.aspects * self.bodies
    }

    /// The looks, each as its kind and the places in the lists of distances, directions and bodies.
    fn all(&self) -> Vec<(Kind, [usize; 3])> {
        let (d, a) = (self.distances_m.len(), self.aspects);
        let of = |k: &Kind| {
            let kind = *k;
            (0..d * a * self.bodies)
                .map(move |i| (kind, [i / (a * self.bodies), i / self.bodies % a, i % self.bodies]))
        };
        self.kinds.iter().flat_map(of).collect()
    }

    /// Looks at everything in turn, on the cpu engine on all cores. `done` is called after each look.
    ///
    /// # Errors
    /// Returns the errors of [`Grid::check`] and of the engine.
    pub fn run(&self, engine: &Engine, done: &(dyn Fn() + Sync)) -> Result<Vec<Look>> {
        self.check()?;
        let watch = watching()?;
        let one = |(kind, at): &(Kind, [usize; 3])| {
            let look = self.look(engine, &watch, *kind, *at);
            done();
            look
        };
        let all = self.all();
        match engine {
            Engine::Cpu(_) => all.par_iter().map(one).collect(),
            _ => all.iter().map(one).collect(),
        }
    }

    fn look(
        &self,
        engine: &Engine,
        watch: &SitedScenario,
        kind: Kind,
        [d, a, b]: [usize; 3],
    ) -> Result<Look> {
        let number = Kind::ALL.iter().position(|k| *k == kind).unwrap_or(0) as u32;
        let seed = (self.seed ^ (self.seed >> 32)) as u32;
        let stream = 16 * (b + 100 * (a + 360 * d)) as u32 + number;
        let mut draws = Draws::new(seed, stream);
        // Every look has a body of its own.
        let body = finished(vehicle(kind, &material::by_name)?, &mut draws)?;
        let mut within = |half: f64| half * (2.0 * draws.uniform() - 1.0);
        let step_deg = 360.0 / self.aspects as f64;
        let aspect_deg = (a as f64 * step_deg + within(0.5 * step_deg)).rem_euclid(360.0);
        let bearing = within(OFF_BORESIGHT_RAD);
        let tilt = [within(TILT_RAD), within(TILT_RAD)];
        let time_s = 0.5 + within(0.5);
        let speed_mps = speed_mps(kind);
        let bounds_m = body.bounds_m(speed_mps, time_s);
        let (pose, zenith_deg) = pose(bounds_m, self.distances_m[d], aspect_deg, bearing, tilt);
        let mut scene = Scene::default();
        body.add_to(&mut scene, "it", pose, speed_mps, time_s);
        let watch = SitedScenario { seed: self.seed.wrapping_add(u64::from(stream)), ..watch.clone() };
        let seen = see(engine, &watch, &Placed { scene, pose, bounds_m })?;
        Ok(Look { kind, body: b, distance_m: self.distances_m[d], aspect_deg, zenith_deg, seen })
    }
}

/// How fast a kind goes, m/s: its wheels turn and its limbs swing.
fn speed_mps(kind: Kind) -> f64 {
    match kind {
        Kind::Pedestrian | Kind::Child => 1.4,
        Kind::Cyclist => 4.0,
        _ => 5.0,
    }
}

/// The body with another metal and another thickness of its bumpers' skin.
fn finished(mut body: Body, draws: &mut Draws) -> Result<Body> {
    let metal = ["steel", "galvanised-steel", "aluminium"][((3.0 * draws.uniform()) as usize).min(2)];
    let skin_m = 0.002 + 0.002 * draws.uniform();
    for m in &mut body.materials {
        if m.name == "steel" {
            *m = material::by_name(metal)?;
        } else if m.name.starts_with("aluminium+polypropylene") {
            *m = material::parse_spec(&format!("aluminium+polypropylene:{skin_m:.5}"))?;
        }
    }
    Ok(body)
}

/// Where a body with this box stands so that the radar sees it from `aspect_deg` and its box begins at `distance_m` on the line to its
/// middle, and the zenith angle, degrees, of the direction to the radar.
fn pose(
    bounds_m: (DVec3, DVec3),
    distance_m: f64,
    aspect_deg: f64,
    bearing: f64,
    [pitch, roll]: [f64; 2],
) -> (Pose<Target, World>, f64) {
    let half = 0.5 * (bounds_m.1 - bounds_m.0);
    let middle = 0.5 * (bounds_m.1 + bounds_m.0);
    let aspect = aspect_deg.to_radians();
    let inside_m = (half.x / aspect.cos().abs().max(1e-9)).min(half.y / aspect.sin().abs().max(1e-9));
    let range_m = distance_m + inside_m;
    let yaw = PI + bearing - aspect;
    let turned = Pose::<Target, World>::from_yaw_pitch_roll(DVec3::ZERO, yaw, pitch, roll);
    let at = DVec3::new(range_m * bearing.cos(), range_m * bearing.sin(), 0.0);
    let off = turned.direction(middle.with_z(0.0)).with_z(0.0);
    let elevation = (RADAR_HEIGHT_M - middle.z).atan2(range_m);
    (Pose::from_yaw_pitch_roll(at - off, yaw, pitch, roll), 90.0 - elevation.to_degrees())
}

/// The radar front77 over the origin, which looks along x. There is no road.
fn watching() -> Result<SitedScenario> {
    let text = "name = \"watch\"\nradar = \"front77\"\n[[point]]\nposition_m = [500, 0, 0]\nrcs_dbsm = 0\n";
    let mut s = scenario::parse(Path::new("watch.toml"), text)?.without_roads()?;
    s.ego.position_m = DVec3::Z * RADAR_HEIGHT_M - s.radars[0].mounting.translation_m;
    Ok(s)
}

/// A scene of one body.
struct Placed {
    scene: Scene,
    pose: Pose<Target, World>,
    /// Box around the body in its own frame, m.
    bounds_m: (DVec3, DVec3),
}

/// Where on a body a point lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Region {
    /// Its echoes come from a wheel.
    Wheel,
    /// Within half a metre of a corner of the box.
    Corner,
    /// Within half a metre of the box's front, or before it.
    Front,
    /// Within half a metre of the box's rear, or behind it.
    Rear,
    /// Within half a metre of the box's left or right, or beside it.
    Side,
    /// Anywhere else.
    Middle,
}

impl Region {
    /// All regions.
    pub const ALL: [Region; 6] =
        [Region::Wheel, Region::Corner, Region::Front, Region::Rear, Region::Side, Region::Middle];

    /// Name of the region in tables.
    pub fn name(self) -> &'static str {
        ["wheel", "corner", "front", "rear", "side", "middle"][self as usize]
    }

    /// The region of a place in plan, m from the middle of a box of these half sizes, and its distance inwards from the box's outline
    /// (negative outside), m.
    fn of(class: &str, at: DVec2, half: DVec2) -> (Region, f64) {
        let beyond = at.abs() - half;
        let inwards_m = if beyond.max_element() > 0.0 {
            -beyond.max(DVec2::ZERO).length()
        } else {
            -beyond.max_element()
        };
        let region = if class.ends_with(".wheel") {
            Region::Wheel
        } else if beyond.length() <= NEAR_M {
            Region::Corner
        } else if beyond.max_element() < -NEAR_M {
            Region::Middle
        } else if beyond.y > beyond.x {
            Region::Side
        } else if at.x > 0.0 {
            Region::Front
        } else {
            Region::Rear
        };
        (region, inwards_m)
    }
}

/// The strongest point of a frame.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Spot {
    /// Cross section, dBsm.
    pub rcs_dbsm: f64,
    /// Where it lies along the body, as a share of half its length from its middle, positive forwards.
    pub along: f64,
    /// Where it lies across, as a share of half its width, positive to the left.
    pub across: f64,
    /// What is there.
    pub region: Region,
    /// Distance from the outline of the body's box inwards, m; negative outside.
    pub inwards_m: f64,
}

/// What a frame shows of a body.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Seen {
    /// Cross section of all its echoes, dBsm: the coherent sum, as mean power over the band of the radar. None without an echo.
    pub body_dbsm: Option<f64>,
    /// Its strongest point; None where the radar finds none.
    pub strongest: Option<Spot>,
    /// Sum of the powers of its points, dBsm.
    pub points_dbsm: Option<f64>,
    /// Number of its points.
    pub points: usize,
    /// Standard deviations of its points' places along and across the body, weighted by their powers, m. None with fewer than two.
    pub spread_m: Option<[f64; 2]>,
}

/// One look.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Look {
    /// Kind of the body.
    pub kind: Kind,
    /// Number of the body among those in its direction.
    pub body: usize,
    /// Distance to the body's box, m.
    pub distance_m: f64,
    /// Direction to the radar, seen from the body, degrees: 0 from the front, 90 from the left.
    pub aspect_deg: f64,
    /// Angle of that direction from the vertical, degrees.
    pub zenith_deg: f64,
    /// What the frame shows.
    pub seen: Seen,
}

/// Power of the coherent sum of echoes in VV as a cross section, m², averaged over tones across a band.
fn band_rcs_m2(echoes: &[Echo], carrier_hz: f64, bandwidth_hz: f64) -> f64 {
    let (k, dk) = (wavenumber(carrier_hz - 0.5 * bandwidth_hz), wavenumber(bandwidth_hz / TONES as f64));
    let mut sums = [Complex64::ZERO; TONES];
    for e in echoes {
        let mut s =
            e.path_gain[0][0] * e.range_m().powi(2) * Complex64::cis(-(k + 0.5 * dk) * e.path_length_m);
        let step = Complex64::cis(-dk * e.path_length_m);
        for sum in &mut sums {
            *sum += s;
            s *= step;
        }
    }
    4.0 * PI * sums.iter().map(|s| s.norm_sqr()).sum::<f64>() / TONES as f64
}

/// Frame 0 of a body.
fn see(engine: &Engine, watch: &SitedScenario, placed: &Placed) -> Result<Seen> {
    let frame =
        Prepared::new(watch, &placed.scene)?.without_cubes().frame(engine, 0, 0, Default::default())?;
    let radar = &watch.radars[0];
    let m2 = band_rcs_m2(&frame.echoes.list, radar.carrier_hz, radar.bandwidth_hz());
    // Under a millionth of a square wavelength there is no echo but rounding.
    let body_dbsm = (m2 > 1e-6 * wavelength_m(radar.carrier_hz).powi(2)).then(|| db_from_power(m2));
    let half = 0.5 * (placed.bounds_m.1 - placed.bounds_m.0).truncate();
    let middle = 0.5 * (placed.bounds_m.1 + placed.bounds_m.0).truncate();
    let to_body = placed.pose.inverse();
    let place = |p: DVec3| to_body.point(frame.pose.point(p)).truncate() - middle;
    // Points by their label: a side lobe or a ghost stands where nothing is.
    let own = || frame.points.iter().filter(|p| p.object_id != 0 && p.is_in_place());
    let strongest = own().max_by(|a, b| a.rcs_dbsm.total_cmp(&b.rcs_dbsm)).map(|p| {
        let at = place(p.position_m);
        let (region, inwards_m) = Region::of(&p.class, at, half);
        Spot { rcs_dbsm: p.rcs_dbsm, along: at.x / half.x, across: at.y / half.y, region, inwards_m }
    });
    let weighed: Vec<(f64, DVec2)> =
        own().map(|p| (power_from_db(p.rcs_dbsm), place(p.position_m))).collect();
    let sum: f64 = weighed.iter().map(|w| w.0).sum();
    let spread_m = (weighed.len() > 1).then(|| {
        let mean = weighed.iter().map(|(w, at)| *at * *w).sum::<DVec2>() / sum;
        let square = weighed.iter().map(|(w, at)| (*at - mean) * (*at - mean) * *w).sum::<DVec2>() / sum;
        [square.x.sqrt(), square.y.sqrt()]
    });
    Ok(Seen {
        body_dbsm,
        strongest,
        points_dbsm: (sum > 0.0).then(|| db_from_power(sum)),
        points: weighed.len(),
        spread_m,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use catseye::engine::Precision;
    use catseye::scene::{Material, Mesh};
    use std::f64::consts::TAU;

    fn placed(mesh: Mesh, half: DVec3, distance_m: f64, aspect_deg: f64) -> Placed {
        let bounds_m =
            (DVec3::new(-half.x, -half.y, RADAR_HEIGHT_M - half.z), half.with_z(RADAR_HEIGHT_M + half.z));
        let (pose, zenith_deg) = pose(bounds_m, distance_m, aspect_deg, 0.05, [0.0; 2]);
        assert!((zenith_deg - 90.0).abs() < 1e-9);
        let mut scene = Scene::default();
        scene.materials.push(Material::pec());
        scene.add_mesh("it", "target", mesh, Pose::new(pose.rotation, pose.translation_m));
        Placed { scene, pose, bounds_m }
    }

    /// A sphere of rows and columns with its own normals, at the radar's height.
    fn sphere(radius_m: f64, rows: u32) -> Mesh {
        let columns = 2 * rows;
        let mut mesh = Mesh::default();
        for i in 0..=rows {
            for j in 0..columns {
                let (polar, azimuth) =
                    (PI * f64::from(i) / f64::from(rows), TAU * f64::from(j) / f64::from(columns));
                let n = DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
                mesh.positions_m.push(n * radius_m + DVec3::Z * RADAR_HEIGHT_M);
                mesh.normals.push(n);
            }
        }
        for i in 0..rows {
            for j in 0..columns {
                let at = |i: u32, j: u32| i * columns + j % columns;
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                if i + 1 < rows {
                    mesh.triangles.push([a, b, c]);
                }
                if i > 0 {
                    mesh.triangles.push([a, c, d]);
                }
            }
        }
        mesh.material = vec![0; mesh.triangles.len()];
        mesh
    }

    /// The same path gives π a² of a sphere, less what its distance takes (π a² / (1 + a/R)²), from all sides, in the echoes' sum and in
    /// the strongest point, and places that point on its near side.
    #[test]
    fn a_sphere_has_its_cross_section_from_all_sides() {
        let (engine, watch) = (Engine::open("cpu", Precision::F32).unwrap(), watching().unwrap());
        let a = 0.25;
        let mesh = sphere(a, 24);
        for distance_m in [7.0, 15.0] {
            let expected = db_from_power(PI * a * a / (1.0 + a / distance_m).powi(2));
            for i in 0..12 {
                let aspect_deg = 31.0 * f64::from(i);
                let seen =
                    see(&engine, &watch, &placed(mesh.clone(), DVec3::splat(a), distance_m, aspect_deg))
                        .unwrap();
                println!("{distance_m} m, {aspect_deg} deg: expected {expected:.2}, {seen:?}");
                let body = seen.body_dbsm.unwrap();
                assert!((body - expected).abs() < 0.5, "{aspect_deg}: {body} {expected}");
                let spot = seen.strongest.unwrap();
                assert!((spot.rcs_dbsm - expected).abs() < 0.5, "{aspect_deg}: {spot:?}");
                let (x, y) = (aspect_deg.to_radians().cos(), aspect_deg.to_radians().sin());
                let off_m = a * (spot.along - x).hypot(spot.across - y);
                assert!(off_m < 0.25, "{aspect_deg}: {spot:?} is {off_m} m off");
                assert_eq!(seen.points, 1, "{aspect_deg}");
            }
        }
    }

    /// A plate of 8 cm: face on 4 π A² / λ², and from its edge nothing.
    #[test]
    fn a_plate_flashes_face_on_and_is_gone_from_the_side() {
        let (engine, watch) = (Engine::open("cpu", Precision::F32).unwrap(), watching().unwrap());
        let half = DVec3::new(1e-4, 0.04, 0.04);
        let v = |y: f64, z: f64| DVec3::new(0.0, 0.04 * y, RADAR_HEIGHT_M + 0.04 * z);
        let mesh = Mesh {
            positions_m: vec![v(-1., -1.), v(1., -1.), v(1., 1.), v(-1., 1.)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material: vec![0; 2],
            normals: Vec::new(),
        };
        let wave_m = wavelength_m(watch.radars[0].carrier_hz);
        let face = db_from_power(4.0 * PI * (0.08f64 * 0.08 / wave_m).powi(2));
        let on = see(&engine, &watch, &placed(mesh.clone(), half, 15.0, 0.0)).unwrap();
        println!("face {face:.2}: {on:?}");
        assert!((on.body_dbsm.unwrap() - face).abs() < 0.5, "{on:?}");
        assert!((on.strongest.unwrap().rcs_dbsm - face).abs() < 0.5, "{on:?}");
        let side = see(&engine, &watch, &placed(mesh, half, 15.0, 90.0)).unwrap();
        assert!(side.strongest.is_none() && side.points == 0, "{side:?}");
        assert!(side.body_dbsm.is_none_or(|x| x < face - 40.0), "{side:?}");
    }

    #[test]
    fn regions_of_a_box() {
        let half = DVec2::new(2.2, 0.9);
        for (class, at, region, inwards_m) in [
            ("car", DVec2::new(2.2, 0.0), Region::Front, 0.0),
            ("car", DVec2::new(-2.5, 0.0), Region::Rear, -0.3),
            ("car", DVec2::new(0.5, -0.8), Region::Side, 0.1),
            ("car", DVec2::new(2.1, 0.8), Region::Corner, 0.1),
            ("car", DVec2::new(0.0, 0.1), Region::Middle, 0.8),
            ("car.wheel", DVec2::new(1.3, 0.8), Region::Wheel, 0.1),
            ("car", DVec2::new(2.5, 1.3), Region::Corner, -0.5),
        ] {
            let (r, d) = Region::of(class, at, half);
            assert_eq!(r, region, "{at}");
            assert!((d - inwards_m).abs() < 1e-9, "{at}: {d}");
            assert_eq!(Region::ALL[r as usize], r);
        }
    }

    #[test]
    fn grids_that_cannot_be() {
        let good = Grid { kinds: vec![Kind::Sedan], distances_m: vec![7.0], aspects: 4, bodies: 1, seed: 0 };
        assert!(good.check().is_ok());
        assert_eq!(good.looks(), good.all().len());
        for (grid, parts) in [
            (Grid { kinds: vec![], ..good.clone() }, ["--kinds", "the list of kinds is empty"]),
            (Grid { distances_m: vec![], ..good.clone() }, ["--distances", "1 to 8"]),
            (Grid { distances_m: vec![2.0], ..good.clone() }, ["--distances", "3..=50"]),
            (Grid { distances_m: vec![f64::NAN], ..good.clone() }, ["--distances", "3..=50"]),
            (Grid { aspects: 3, ..good.clone() }, ["--aspects", "4..=360"]),
            (Grid { bodies: 0, ..good.clone() }, ["--bodies", "1..=100"]),
        ] {
            let e = grid.check().unwrap_err().to_string();
            assert!(parts.iter().all(|p| e.contains(p)), "{e}");
        }
    }

    /// Two runs give the same looks, another seed gives others.
    #[test]
    fn a_seed_is_a_set_of_bodies() {
        let engine = Engine::open("cpu", Precision::F32).unwrap();
        let grid =
            Grid { kinds: vec![Kind::Pedestrian], distances_m: vec![7.0], aspects: 4, bodies: 2, seed: 1 };
        let run = |grid: &Grid| grid.run(&engine, &|| ()).unwrap();
        let looks = run(&grid);
        assert_eq!(looks.len(), 8);
        assert_eq!(looks, run(&grid));
        assert_ne!(looks, run(&Grid { seed: 2, ..grid }));
        assert!(looks.iter().all(|l| l.seen.body_dbsm.is_some()), "{looks:?}");
    }
}
