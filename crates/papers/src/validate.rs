//! The canonical table: targets and radar quantities with known values, measured on an engine.
//!
//! Expected values are closed forms, reference series or numbers computed by hand; each row says which, and
//! how close the measurement has to come. Cross sections are at 77 GHz, far field, three bounces, VV unless
//! the row says otherwise.

use crate::comparison::{Comparison, Tolerance};
use catseye::adc::cpu::synthesis::synthesise;
use catseye::adc::synthesis::{Plan, channel_path_m, point_echo};
use catseye::base::control::Control;
use catseye::base::error::{Error, Result};
use catseye::base::frames::{Pose, Target, World, direction_from_angles};
use catseye::base::matrix::Matrix2;
use catseye::base::units::{
    C0, DEFAULT_FREQUENCY_HZ, db_from_power, dbm_from_w, dbsm_from_amplitude, wavenumber,
};
use catseye::detect::locate;
use catseye::dsp::doa_beamform::Beamformer;
use catseye::dsp::{Snapshots, cfar_ca, cfar_os, window};
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::geom::Geometry;
use catseye::rcs::closed_form::{
    go_dihedral_m2, go_square_trihedral_m2, go_trihedral_m2, mie_sphere, po_cylinder, po_plate, rcs_m2,
};
use catseye::rcs::{Aspect, BistaticAspect, Distance, RayGrid, RcsOptions, Scattering};
use catseye::road::objects::ground;
use catseye::road::reflector::{CORNER_ELEVATION_DEG, Reflector};
use catseye::scene::radar::{Antenna, Pattern, Polarisation, Radar, Window};
use catseye::scene::waveform::Waveform;
use catseye::scene::{Scene, Shape, material, radar_toml};
use catseye::trace::cpu::points::point_echoes;
use catseye::trace::{Echo, Echoes, TraceOptions};
use glam::{DVec2, DVec3};
use num_complex::Complex64;
use std::f64::consts::{FRAC_PI_4, TAU};

/// A part of the table.
pub struct Group {
    /// Name of the part.
    pub name: &'static str,
    rows: fn(&Engine, &mut Rows) -> Result<()>,
}

impl Group {
    /// Measures the rows of this part on an engine.
    ///
    /// # Errors
    /// Returns the errors of the engine.
    pub fn measure(&self, engine: &Engine) -> Result<Vec<Comparison>> {
        let mut rows = Rows::default();
        (self.rows)(engine, &mut rows)?;
        Ok(rows.0)
    }
}

/// The parts of the table in their order.
pub const GROUPS: [Group; 13] = [
    Group { name: "trihedral", rows: trihedrals },
    Group { name: "dihedral", rows: dihedral },
    Group { name: "plate", rows: plate },
    Group { name: "sphere", rows: sphere },
    Group { name: "cylinder", rows: cylinder },
    Group { name: "marker", rows: marker },
    Group { name: "two rays", rows: two_rays },
    Group { name: "delay", rows: delay },
    Group { name: "level", rows: level },
    Group { name: "noise", rows: noise },
    Group { name: "processing gain", rows: processing_gain },
    Group { name: "window", rows: windows },
    Group { name: "cfar", rows: cfar },
];

const F: f64 = DEFAULT_FREQUENCY_HZ;
const V: usize = 0;
const H: usize = 1;

// ---- cross sections ----

fn aspect_deg(azimuth: f64, elevation: f64) -> Aspect {
    Aspect { azimuth: azimuth.to_radians(), elevation: elevation.to_radians() }
}

fn unit(a: Aspect) -> DVec3 {
    direction_from_angles(a.azimuth, a.elevation)
}

/// A reflector of the library, alone and rolled about its boresight by `roll` (rad).
fn scene(spec: &str, roll: f64) -> Result<Scene> {
    let mut scene = Scene::default();
    let pose = Pose::<Target, World>::from_yaw_pitch_roll(DVec3::ZERO, 0.0, 0.0, roll);
    Reflector::parse(spec)?.add_to(&mut scene, &material::by_name, ("target", ""), pose, DVec3::ZERO)?;
    Ok(scene)
}

fn sweep(engine: &Engine, scene: &Scene, aspects: &[Aspect]) -> Result<Vec<Scattering>> {
    let looks: Vec<BistaticAspect> = aspects.iter().map(|a| BistaticAspect::monostatic(*a)).collect();
    engine.rcs(scene, &[F], &looks, &RcsOptions::default())
}

fn level_dbsm(s: &Matrix2, rx: usize, tx: usize) -> f64 {
    dbsm_from_amplitude(s[rx][tx].norm())
}

/// |a/b|² in dB, at least -400, as JSON cannot hold minus infinity.
fn ratio_db(a: Complex64, b: Complex64) -> f64 {
    db_from_power((a.norm() / b.norm()).powi(2)).max(-400.0)
}

/// Level of the larger cross-polarised part relative to VV, dB.
fn cross_db(s: &Matrix2) -> f64 {
    ratio_db(s[V][H], s[V][V]).max(ratio_db(s[H][V], s[V][V]))
}

/// The rows of a part while they are measured.
#[derive(Default)]
struct Rows(Vec<Comparison>);

impl Rows {
    fn row(
        &mut self,
        name: impl ToString,
        unit: &str,
        to: (Option<f64>, Tolerance),
        ours: f64,
        source: &str,
    ) {
        self.0.push(Comparison::new(&name.to_string(), unit, to.0, to.1, ours, source));
    }

    /// Adds a row whose value must lie within `by` of `to`, in its unit.
    fn near(&mut self, name: impl ToString, unit: &str, (to, by): (f64, f64), ours: f64, source: &str) {
        self.row(name, unit, (Some(to), Tolerance::Within(by)), ours, source);
    }

    /// Adds a row whose value must lie within the share `by` of `to`.
    fn share(&mut self, name: impl ToString, unit: &str, (to, by): (f64, f64), ours: f64, source: &str) {
        self.row(name, unit, (Some(to), Tolerance::Share(by)), ours, source);
    }

    /// Adds a row whose value must be at most `most`.
    fn at_most(&mut self, name: impl ToString, unit: &str, most: f64, ours: f64, source: &str) {
        self.row(name, unit, (None, Tolerance::AtMost(most)), ours, source);
    }

    /// Adds a row of the co-polarised cross section of `s` in polarisation `p`, dBsm.
    fn dbsm(&mut self, name: impl ToString, to: f64, by: f64, (s, p): (&Matrix2, usize), source: &str) {
        self.near(name, "dBsm", (to, by), level_dbsm(s, p, p), source);
    }
}

const SPENCER: &str = "geometric optics, Spencer 1944";
const CURRENTS: &str = "physical optics, exact for flat facets";

fn trihedrals(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let corner = scene("trihedral:leg_m=0.1", 0.0)?;
    let off = [aspect_deg(5.0, CORNER_ELEVATION_DEG), aspect_deg(0.0, CORNER_ELEVATION_DEG + 5.0)];
    let aspects = [aspect_deg(0.0, CORNER_ELEVATION_DEG), off[0], off[1]];
    let s = sweep(engine, &corner, &aspects)?;
    for (name, p) in [("VV", V), ("HH", H)] {
        let exact = db_from_power(go_trihedral_m2(0.1, F, unit(aspects[0])));
        rows.dbsm(format!("0.1 m, boresight, last, {name}"), exact, 0.05, (&s[0].last, p), SPENCER);
        rows.dbsm(format!("0.1 m, boresight, every, {name}"), 14.53, 0.05, (&s[0].every, p), CURRENTS);
    }
    rows.at_most("0.1 m, boresight, cross-polarised", "dB", -60.0, cross_db(&s[0].every), "symmetry");
    let geometry = Geometry::build(&corner, 0.0, F)?;
    let grid = RayGrid { bounces: 3, rays_per_wavelength: 30.0, distance: Distance::Infinite };
    let dense = engine.rcs_rays(&geometry, &off, &grid)?;
    for (i, name) in ["5 deg in azimuth", "5 deg in elevation"].into_iter().enumerate() {
        let (exact_beams, dense) = (&s[i + 1], &dense[i]);
        let own = "a grid of 30 rays per wavelength";
        let pairs = [("every", &dense.every, &exact_beams.every), ("last", &dense.last, &exact_beams.last)];
        for (which, dense, beams) in pairs {
            let to = level_dbsm(dense, V, V);
            rows.dbsm(format!("0.1 m, {name}, {which}"), to, 0.1, (beams, V), own);
        }
        let exact = db_from_power(go_trihedral_m2(0.1, F, unit(off[i])));
        rows.dbsm(format!("0.1 m, {name}, last"), exact, 0.1, (&exact_beams.last, V), SPENCER);
    }
    let square = scene("square-trihedral:leg_m=0.1", 0.0)?;
    let s = &sweep(engine, &square, &aspects[..1])?[0];
    let exact = db_from_power(go_square_trihedral_m2(0.1, F, unit(aspects[0])));
    for (name, p) in [("VV", V), ("HH", H)] {
        let what = format!("square, 0.1 m, boresight, last, {name}");
        rows.dbsm(what, exact, 0.05, (&s.last, p), SPENCER);
    }
    let s = &sweep(engine, &scene("trihedral:leg_m=0.008", 0.0)?, &aspects[..1])?[0];
    let exact = db_from_power(go_trihedral_m2(0.008, F, unit(aspects[0])));
    rows.dbsm("8 mm, boresight, last", exact, 0.1, (&s.last, V), SPENCER);
    rows.dbsm("8 mm, boresight, every", -30.46, 0.1, (&s.every, V), CURRENTS);
    Ok(())
}

fn dihedral(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let spec = "dihedral:width_m=0.1,height_m=0.1";
    let face_on = [aspect_deg(0.0, 0.0)];
    let s = &sweep(engine, &scene(spec, 0.0)?, &face_on)?[0];
    let exact = db_from_power(go_dihedral_m2(0.1, 0.1, F));
    for (name, p, every) in [("VV", V, 22.16), ("HH", H, 22.23)] {
        rows.dbsm(format!("face on, last, {name}"), exact, 0.05, (&s.last, p), "8 pi w² h² / lambda²");
        rows.dbsm(format!("face on, every, {name}"), every, 0.05, (&s.every, p), CURRENTS);
    }
    let turn = |m: &Matrix2| (m[H][H] / m[V][V]).arg().to_degrees().abs();
    let two = "two reflections turn H once more than V";
    rows.near("phase of HH over VV, last", "deg", (180.0, 0.1), turn(&s.last), two);
    rows.near("phase of HH over VV, every", "deg", (180.0, 1.0), turn(&s.every), two);
    // Seen at 45 degrees it turns one linear polarisation into the other: from the matrix, and with the body rolled.
    for (name, gate, m) in [("last", -60.0, &s.last), ("every", -40.0, &s.every)] {
        let co = 0.5 * (m[V][V] + m[V][H] + m[H][V] + m[H][H]);
        let what = format!("45 deg linear, co-polarised over VV, {name}");
        rows.at_most(what, "dB", gate, ratio_db(co, m[V][V]), two);
    }
    let rolled = &sweep(engine, &scene(spec, FRAC_PI_4)?, &face_on)?[0];
    for (name, gate, m, level) in
        [("last", -60.0, &rolled.last, s.last[V][V]), ("every", -40.0, &rolled.every, s.every[V][V])]
    {
        let co = ratio_db(m[V][V], level).max(ratio_db(m[H][H], level));
        let what = format!("rolled by 45 deg, co-polarised over face on, {name}");
        rows.at_most(what, "dB", gate, co, two);
        let what = format!("rolled by 45 deg, cross-polarised over face on, {name}");
        rows.near(what, "dB", (0.0, 0.05), ratio_db(m[H][V], level), two);
    }
    Ok(())
}

/// Zeros of tan x = x: the main peak and the first side lobes of sinc x.
const LOBES: [f64; 4] = [0.0, 4.493_409_457_909_064, 7.725_251_836_937_707, 10.904_121_659_428_9];

fn plate(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let (w, h) = (0.1, 0.06);
    let g = scene("plate:width_m=0.1,height_m=0.06", 0.0)?;
    for (name, side) in [("azimuth", w), ("elevation", h)] {
        let angle = |x: f64| (x / (wavenumber(F) * side)).asin().to_degrees();
        let turned = |a: f64| if name == "azimuth" { aspect_deg(a, 0.0) } else { aspect_deg(0.0, a) };
        let aspects: Vec<Aspect> = LOBES.iter().flat_map(|x| [angle(*x), -angle(*x)]).map(turned).collect();
        let s = sweep(engine, &g, &aspects)?;
        for (i, x) in LOBES.iter().enumerate() {
            // The worse of the two sides and the two polarisations.
            let exact = db_from_power(rcs_m2(po_plate(w, h, F, unit(aspects[2 * i]))));
            let measured = [2 * i, 2 * i + 1]
                .iter()
                .flat_map(|j| [level_dbsm(&s[*j].every, V, V), level_dbsm(&s[*j].every, H, H)])
                .max_by(|a, b| (a - exact).abs().total_cmp(&(b - exact).abs()))
                .unwrap_or(f64::NAN);
            let what = format!("lobe {i} in {name}, {:.3} deg", angle(*x));
            rows.near(what, "dBsm", (exact, 0.01), measured, "physical optics, closed form");
        }
    }
    let (y, z) = (LOBES[1] / (wavenumber(F) * w), LOBES[1] / (wavenumber(F) * h));
    let diagonal = [Aspect { azimuth: (y / (1.0 - z * z).sqrt()).asin(), elevation: z.asin() }];
    let s = &sweep(engine, &g, &diagonal)?[0];
    let exact = db_from_power(rcs_m2(po_plate(w, h, F, unit(diagonal[0]))));
    let what = "lobe 1 in both";
    rows.near(what, "dBsm", (exact, 0.01), level_dbsm(&s.every, V, V), "physical optics, closed form");
    Ok(())
}

fn sphere(engine: &Engine, rows: &mut Rows) -> Result<()> {
    // At ka = 40 the false echo of the shadow boundary alone takes 0.12 dB of the gate.
    for ka in [40.5, 80.7] {
        let radius = ka / wavenumber(F);
        let g = scene(&format!("sphere:radius_m={radius}"), 0.0)?;
        let exact = dbsm_from_amplitude(mie_sphere(radius, F)?.norm());
        let s = &sweep(engine, &g, &[aspect_deg(13.0, 21.0)])?[0];
        rows.dbsm(format!("ka = {ka}"), exact, 0.15, (&s.every, V), "Mie series");
    }
    Ok(())
}

fn cylinder(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let (radius, length) = (0.003, 0.15);
    let g = scene("cylinder:radius_m=0.003,length_m=0.15", 0.0)?;
    let aspects = LOBES.map(|x| Aspect { azimuth: 0.3, elevation: (x / (wavenumber(F) * length)).asin() });
    let s = sweep(engine, &g, &aspects)?;
    for (i, (a, s)) in aspects.iter().zip(&s).enumerate() {
        let exact = db_from_power(rcs_m2(po_cylinder(radius, length, F, unit(*a))));
        let what = match i {
            0 => "6 x 150 mm, broadside".into(),
            _ => format!("6 x 150 mm, lobe {i}, {:.3} deg off", a.elevation.to_degrees()),
        };
        rows.dbsm(what, exact, 0.2, (&s.every, V), "physical optics, quadrature");
    }
    Ok(())
}

fn marker(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let marker = scene("type1:width_m=0.16,height_m=0.004", 0.0)?;
    let cut: Vec<Aspect> = (0..=40).map(|i| aspect_deg(0.0, 1.0 + 0.05 * f64::from(i))).collect();
    let found = sweep(engine, &marker, &cut)?;
    let top = found.iter().map(|s| level_dbsm(&s.every, V, V)).fold(f64::NEG_INFINITY, f64::max);
    let source = "exact physical optics; the value is rounded to 0.1 dB";
    rows.near("type1, W 160 H 4 mm, peak in elevation", "dBsm", (-0.9, 0.1), top, source);
    // The truth is the f64 engine; its own row shows rounding only.
    let wide: Vec<Aspect> = (0..=50)
        .flat_map(|e| (-8..=8).map(move |a| aspect_deg(5.0 * f64::from(a), 0.1 * f64::from(e))))
        .collect();
    let truth = sweep(&Engine::open("cpu", Precision::F64)?, &marker, &wide)?;
    let found = sweep(engine, &marker, &wide)?;
    let level = |s: &Scattering| level_dbsm(&s.every, V, V);
    let peak = truth.iter().map(level).fold(f64::NEG_INFINITY, f64::max);
    let strong = found.iter().zip(&truth).filter(|(_, t)| level(t) > peak - 30.0);
    let worst = strong.map(|(f, t)| (level(f) - level(t)).abs()).fold(0.0, f64::max);
    let what = "type1, W 160 H 4 mm, -40..40 x 0..5 deg, largest difference to f64";
    rows.at_most(what, "dB", 0.05, worst, "exact beams on the cpu");
    Ok(())
}

// ---- the radar ----

/// The small front radar without noise, with isotropic antennas of 0 dBi, one transmitter and one receiver.
fn one_channel() -> Result<Radar> {
    let mut radar = radar_toml::preset("demo77")?;
    let antenna = Antenna {
        position_m: DVec3::ZERO,
        polarisation: Polarisation::V,
        gain_dbi: 0.0,
        pattern: Pattern::Isotropic,
    };
    (radar.tx, radar.rx) = (vec![antenna.clone()], vec![antenna]);
    radar.thermal_noise = false;
    Ok(radar)
}

fn wide(cube: AnyCube) -> catseye::adc::Cube<f64> {
    match cube {
        AnyCube::F32(c) => c.to_f64(),
        AnyCube::F64(c) => c,
    }
}

fn mean_power(z: &[Complex64]) -> f64 {
    z.iter().map(|z| z.norm_sqr()).sum::<f64>() / z.len().max(1) as f64
}

fn two_rays(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let mut radar = one_channel()?;
    // Narrow, so that one wavelength holds.
    radar.waveform = Waveform::chirp(1e5, 40e-6, 55e-6);
    (radar.chirps, radar.samples) = (1, 16);
    // H turns round on a conductor at every angle.
    (radar.tx[0].polarisation, radar.rx[0].polarisation) = (Polarisation::H, Polarisation::H);
    let mut scene = Scene::default();
    let metal = scene.material_index(&material::by_name("pec")?);
    let plane = ground(DVec2::new(-1.0, -1.0), DVec2::new(60.0, 1.0), 0.0, metal);
    scene.add_mesh("plane", "road", plane, Pose::IDENTITY);
    scene.add_object("point", "", Shape::Point { rcs_dbsm: 0.0 }, Pose::IDENTITY, DVec3::ZERO);
    let pose = Pose::from_yaw_pitch_roll(DVec3::Z * 0.15, 0.0, 0.0, 0.0);
    let power = |d: f64| -> Result<f64> {
        let mut scene = scene.clone();
        scene.objects[1].pose.translation_m = DVec3::new(d, 0.0, 0.35);
        let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz)?;
        let echoes = Echoes {
            list: point_echoes(&geometry, &pose, DVec3::ZERO, &TraceOptions::default()),
            ..Default::default()
        };
        let (cube, _) = engine.cube(&radar, &echoes, &[], 0, 0, Control::default())?;
        // The fall with distance would move the extremes.
        Ok(mean_power(&wide(cube).data) * d.powi(4))
    };
    let extreme = |about: f64, sign: f64| -> Result<f64> {
        // Golden section within 3 %.
        let g = 0.5 * (5f64.sqrt() - 1.0);
        let (mut a, mut b) = (0.97 * about, 1.03 * about);
        for _ in 0..16 {
            let (c, d) = (b - g * (b - a), a + g * (b - a));
            if sign * power(c)? > sign * power(d)? { b = d } else { a = c }
        }
        Ok(0.5 * (a + b))
    };
    for (name, sign, list) in
        [("null", -1.0, [26.97, 13.48, 8.98, 6.73]), ("peak", 1.0, [53.9, 17.98, 10.78, 7.70])]
    {
        for (i, about) in list.into_iter().enumerate() {
            let what = format!("point 0.35 m, radar 0.15 m over a plane, {name} {}", i + 1);
            rows.share(what, "m", (about, 0.01), extreme(about, sign)?, "image method");
        }
    }
    Ok(())
}

/// Phase of the beat by CONVENTIONS eq. 11 and 12, rad.
fn beat_phase(radar: &Radar, r: &Echo, chirp: usize, n: usize) -> f64 {
    let t_n = radar.adc_start_s + n as f64 / radar.sample_rate_hz;
    let t = radar.chirp_start_s(chirp, 0) + t_n;
    let tau = (channel_path_m(radar, r, 0, 0) + r.path_rate_mps * t) / (C0 + 0.5 * r.path_rate_mps);
    let slope = radar.slope_hz_per_s();
    TAU * (radar.start_hz() * tau + slope * t_n * tau - 0.5 * slope * tau * tau)
}

fn delay(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let mut radar = one_channel()?;
    radar.carrier_hz = 77e9;
    radar.waveform = Waveform::chirp(2.46e9, 32.8e-6, 48e-6);
    (radar.sample_rate_hz, radar.samples, radar.chirps) = (62.5e6, 2050, 8);
    let echo = point_echo(DVec3::new(30.0, 4.0, 0.5), DVec3::new(-20.0, 0.0, 0.0), 10.0, 1);
    let echoes = Echoes { list: vec![echo], ..Default::default() };
    let exact = synthesise::<f64>(&Plan::new(&radar, &echoes)?, Control::default())?;
    let here = wide(engine.cube(&radar, &echoes, &[], 0, 0, Control::default())?.0);
    let level = exact.data[0].norm();
    let (mut phase, mut error) = (0.0f64, 0.0f64);
    for (i, (e, h)) in exact.data.iter().zip(&here.data).enumerate() {
        let turn = Complex64::cis(beat_phase(&radar, &echoes.list[0], i / radar.samples, i % radar.samples));
        phase = phase.max((e * turn.conj()).arg().abs());
        error = error.max((h - turn * level).norm() / level);
    }
    // What a delay held through each chirp would leave out.
    let r = &echoes.list[0];
    let last = radar.samples - 1;
    let rate = radar.slope_hz_per_s() * (r.path_length_m / C0) * TAU * last as f64 / radar.sample_rate_hz;
    let moved = beat_phase(&radar, r, 4, last) - beat_phase(&radar, r, 4, 0) - rate;
    let source = "delay of eq. 11 in eq. 12, every sample";
    rows.at_most("-20 m/s, 2.46 GHz, f64: largest phase error", "rad", 1e-6, phase, source);
    let error_db = 2.0 * db_from_power(error);
    rows.at_most("the same on this engine: largest error over the peak", "dB", -80.0, error_db, source);
    let what = "phase that stop-and-hop would miss over a chirp";
    rows.row(what, "rad", (None, Tolerance::Shown), moved, source);
    Ok(())
}

fn level(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let mut radar = radar_toml::preset("demo77")?;
    radar.thermal_noise = false;
    // 50 m in the middle of cell 125.
    let slope = C0 * radar.sample_rate_hz / (2.0 * radar.processing.range_fft as f64 * 0.4);
    let ramp_time_s = radar.samples as f64 / radar.sample_rate_hz;
    radar.waveform = Waveform::chirp(slope * ramp_time_s, ramp_time_s, radar.chirp_period_s());
    let mut scene = Scene::default();
    let at = Pose::from_yaw_pitch_roll(DVec3::new(50.0, 0.0, 0.0), 0.0, 0.0, 0.0);
    scene.add_object("post", "post", Shape::Point { rcs_dbsm: 10.0 }, at, DVec3::ZERO);
    let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz)?;
    let pose = Pose::IDENTITY;
    let echoes = engine.trace(&geometry, &radar, &pose, DVec3::ZERO, &TraceOptions::default())?;
    let (cube, _) = engine.cube(&radar, &echoes, &[], 0, 0, Control::default())?;
    let mut maps = vec![engine.range_doppler(&radar, &cube)?];
    let cell = maps[0].map.at(radar.processing.doppler_fft / 2, 125);
    let points = locate::points(engine, &radar, &mut maps, None)?;
    let point = points.first().ok_or_else(|| Error::Failed("the post at 50 m was not detected".into()))?;
    // 12 dBm + 2 x 12 dBi + 20 lg(3.89340 mm) + 10 dBsm - 30 lg(4 pi) - 40 lg(50).
    let hand = 46.0 - 48.1935 - 32.9763 - 67.9588;
    let source = "radar equation, worked out by hand";
    rows.near("10 dBsm at 50 m: cell of the map", "dBm", (hand, 0.05), dbm_from_w(cell), source);
    rows.near("10 dBsm at 50 m: point's power", "dBm", (hand, 0.05), point.power_dbm, source);
    rows.near("10 dBsm at 50 m: point's cross section", "dBsm", (10.0, 0.05), point.rcs_dbsm, source);
    rows.near("10 dBsm at 50 m: point's range", "m", (50.0, 0.04), point.range_m, "a tenth of a cell");
    Ok(())
}

fn noise(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let mut radar = radar_toml::preset("demo77")?;
    radar.chirps = 512;
    radar.processing.doppler_fft = 512;
    let (cube, _) = engine.cube(&radar, &Echoes::default(), &[], 7, 1, Control::default())?;
    let cube = wide(cube);
    // k T0 F fs with F = 13 dB and fs = 20 MHz.
    let hand = 1.380649e-23 * 290.0 * 10f64.powf(1.3) * 20e6;
    let source = "k T0 F fs, by hand";
    let what = format!("variance over {:.2e} samples", cube.data.len() as f64);
    rows.share(what, "W", (hand, 0.01), mean_power(&cube.data), source);
    Ok(())
}

fn processing_gain(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let mut radar = radar_toml::preset("demo77")?;
    radar.processing.angle_window = Window::Rectangle;
    let range = 100.0 * radar.range_bin_m();
    let echoes =
        Echoes { list: vec![point_echo(DVec3::X * range, DVec3::ZERO, 10.0, 1)], ..Default::default() };
    let quiet = Radar { thermal_noise: false, ..radar.clone() };
    let (signal, _) = engine.cube(&quiet, &echoes, &[], 0, 0, Control::default())?;
    let found = engine.range_doppler(&quiet, &signal)?;
    let at = found
        .cells
        .iter()
        .position(|c| (c.doppler as usize, c.range) == (radar.processing.doppler_fft / 2, 100))
        .ok_or_else(|| Error::Failed("the point in the middle of cell 100 was not detected".into()))?;
    let beam = Beamformer::new(&radar)?;
    let snapshot = Snapshots { channels: found.snapshots.channels, data: found.snapshots.of(at).to_vec() };
    let angular = engine.angular_power(&beam, &snapshot, &[0.0])?;
    // Between the grid's directions, which need not hold zero.
    let top = beam
        .strongest(&angular, snapshot.of(0), 0.0)
        .ok_or_else(|| Error::Failed("the beamformer found no direction for the point".into()))?;
    let gain_of_signal = top.amplitude.norm_sqr() / mean_power(&wide(signal).data);

    // Noise: cube to map, and channel by channel through the beamformer.
    let (noise, _) = engine.cube(&radar, &Echoes::default(), &[], 5, 0, Control::default())?;
    let map = engine.range_doppler(&radar, &noise)?.map.data;
    let noise = wide(noise);
    let power = mean_power(&noise.data);
    let to_map = map.iter().sum::<f64>() / map.len() as f64 / power;
    const CELLS: usize = 8192;
    let data: Vec<Complex64> = (0..CELLS)
        .flat_map(|i| {
            let (m, n) = (i / radar.samples, i % radar.samples);
            (0..noise.channels).map(move |c| (m, c, n))
        })
        .map(|(m, c, n)| noise.row(m, c)[n])
        .collect();
    let snapshots = Snapshots { channels: noise.channels, data };
    let beams = engine.angular_power(&beam, &snapshots, &vec![0.0; CELLS])?;
    let to_beam = beams.iter().sum::<f64>() / beams.len() as f64 / mean_power(&snapshots.data);

    let measured = db_from_power(gain_of_signal / (to_map * to_beam));
    // 256 samples, 128 chirps, 12 channels; each Hann window takes 10 lg 1.5.
    let hand = db_from_power(256.0 * 128.0 * 12.0) - 2.0 * db_from_power(1.5);
    let source = "samples x chirps x channels, less two Hann windows";
    rows.near("demo77", "dB", (hand, 0.1), measured, source);
    Ok(())
}

/// |W(f)|² of a window relative to that at zero, f in bins.
fn response(w: &[f64], f: f64) -> f64 {
    let n = w.len() as f64;
    let sum: Complex64 = w.iter().enumerate().map(|(i, w)| w * Complex64::cis(-TAU * f * i as f64 / n)).sum();
    (sum / w.iter().sum::<f64>()).norm_sqr()
}

/// Width between the half-power points in bins, and the highest side lobe in dB.
fn width_and_lobe(w: &[f64]) -> (f64, f64) {
    let (mut a, mut b) = (0.0, 3.0);
    // The response falls on the main lobe, which reaches farther than one bin.
    while response(w, b) < 0.5 && b > 0.3 {
        b *= 0.8;
    }
    b /= 0.8;
    for _ in 0..50 {
        let c = 0.5 * (a + b);
        if response(w, c) > 0.5 { a = c } else { b = c }
    }
    const STEP: f64 = 0.01;
    let mut f = b;
    while response(w, f + STEP) < response(w, f) {
        f += STEP;
    }
    let lobe = (0..1500).map(|i| response(w, f + STEP * f64::from(i))).fold(0.0, f64::max);
    (a + b, db_from_power(lobe))
}

fn windows(_: &Engine, rows: &mut Rows) -> Result<()> {
    for (name, kind, width, lobe) in [
        ("rectangle", Window::Rectangle, 0.886, -13.3),
        ("Hann", Window::Hann, 1.441, -31.5),
        ("Hamming", Window::Hamming, 1.303, -42.7),
    ] {
        let (w, l) = width_and_lobe(&window::coefficients(kind, 512)?);
        rows.near(format!("{name}: 3-dB width"), "bins", (width, 1e-3), w, "Harris 1978");
        rows.near(format!("{name}: highest side lobe"), "dB", (lobe, 0.1), l, "Harris 1978");
    }
    for db in [60.0, 80.0] {
        let kind = Window::DolphChebyshev { side_lobe_db: db };
        let (_, l) = width_and_lobe(&window::coefficients(kind, 256)?);
        let what = format!("Dolph-Chebyshev {db} dB: highest side lobe");
        rows.near(what, "dB", (-db, 0.1), l, "its definition");
    }
    Ok(())
}

fn cfar(engine: &Engine, rows: &mut Rows) -> Result<()> {
    let ca = |looks: usize, n: usize, pfa: f64| cfar_ca::factor(looks, n, pfa);
    let os = |looks: usize, n: usize, k: usize| cfar_os::factor(looks, n, k, 1e-3).map(|f| f.factor);
    let digits = |places: i32| 0.5 * 10f64.powi(-places);
    for (what, factor, ours, source) in [
        ("CA factor, N 100, Pfa 0.1, one look", (2.3293, digits(4)), ca(1, 100, 0.1)?, "closed form"),
        ("CA factor, N 216, Pfa 1e-3, 12 looks", (2.138, digits(3)), ca(12, 216, 1e-3)?, "F quantile"),
        ("OS factor, N 20, k 15, Pfa 1e-3, one look", (6.8554, digits(4)), os(1, 20, 15)?, "closed form"),
        ("OS factor, N 216, k 162, Pfa 1e-3, 12 looks", (1.82, digits(2)), os(12, 216, 162)?, "quadrature"),
    ] {
        rows.near(what, "", factor, ours, source);
    }
    // Rectangles, so that cells are independent.
    let mut radar = radar_toml::preset("demo77")?;
    (radar.processing.range_window, radar.processing.doppler_window) = (Window::Rectangle, Window::Rectangle);
    radar.processing.cfar.pfa = 0.01;
    let (mut alarms, mut cells) = (0, 0);
    for frame in 0..4 {
        let (cube, _) = engine.cube(&radar, &Echoes::default(), &[], 11, frame, Control::default())?;
        let mask = engine.range_doppler(&radar, &cube)?.detection.mask;
        alarms += mask.iter().filter(|m| **m).count();
        cells += mask.len();
    }
    // 99 % of a binomial count; neighbours share training cells, which widens it little (N 168).
    let limit = 2.576 * (0.99 / (0.01 * cells as f64)).sqrt();
    let what = format!("CA false-alarm rate over {cells} cells of noise, 12 looks");
    rows.share(what, "", (0.01, limit), alarms as f64 / cells as f64, "Pfa; 99 % binomial interval");
    Ok(())
}
