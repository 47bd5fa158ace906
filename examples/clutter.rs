//! Power of road and rain clutter against range, a frame of the simulator beside its closed form, as a picture:
//! `cargo run --release --example clutter -- docs/images/clutter.png`

use catseye::base::control::Control;
use catseye::base::frames::{Pose, Sensor, World};
use catseye::base::units::{C0, dbm_from_w, power_from_db, w_from_dbm, wavenumber};
use catseye::em::weather::{RainBackscatter, rain_attenuation_db_per_m};
use catseye::engine::{AnyCube, Engine, Precision};
use catseye::geom::Geometry;
use catseye::road::objects::ground;
use catseye::scene::backscatter::Backscatter;
use catseye::scene::radar::{Pattern, Radar};
use catseye::scene::weather::Weather;
use catseye::scene::{Material, Scene, material, radar_toml};
use catseye::trace::TraceOptions;
use catseye::trace::air::Air;
use catseye_plot::{Axis, Chart, Layer, Pen, Symbol};
use glam::{DQuat, DVec2, DVec3};
use num_complex::Complex64;
use std::error::Error;
use std::f64::consts::{PI, TAU};

const HEIGHT_M: f64 = 0.5;
const RAIN_MM_PER_H: f64 = 25.0;
const BINS: usize = 220;

fn main() -> Result<(), Box<dyn Error>> {
    draw(&std::env::args().nth(1).unwrap_or_else(|| "clutter.png".into()))
}

/// Draws the picture into a file.
///
/// # Errors
/// A file that cannot be written.
pub fn draw(file: &str) -> Result<(), Box<dyn Error>> {
    let mut radar = radar_toml::preset("demo77")?;
    radar.tx.truncate(1);
    radar.rx.truncate(1);
    (radar.chirps, radar.thermal_noise) = (1, false);
    let engine = Engine::Cpu(Precision::F32);
    let mut chart = Chart::new(
        "clutter in its range bin, radar 0.5 m, demo77, V",
        Axis::new("range (m)", 0.0, BINS as f64 * bin_m(&radar)),
        Axis::new("power (dBm)", -160.0, -60.0),
    );
    (chart.width, chart.height) = (760.0, 420.0);
    let shades = [[0, 158, 115], [213, 94, 0], [0, 114, 178]];
    for ((label, spec, weather), colour) in [
        ("asphalt, 0.5 mm (Oh)", Some("oh"), Weather::default()),
        ("low grass (Kulemin)", Some("kulemin:low-grass"), Weather::default()),
        ("rain, 25 mm/h", None, Weather { rain_mm_per_h: RAIN_MM_PER_H, ..Default::default() }),
    ]
    .into_iter()
    .zip(shades)
    {
        let mut scene = Scene::default();
        // Without a road the rain has a wall behind it.
        let base = material::by_name("asphalt")?;
        let backscatter = spec.map(Backscatter::parse).transpose()?;
        let m = scene.material_index(&Material { roughness_rms_m: 0.5e-3, backscatter, ..base });
        let (lo, hi) = match spec {
            Some(_) => (DVec2::new(-1.0, -110.0), DVec2::new(110.0, 110.0)),
            None => (DVec2::new(-9.0, -1.0), DVec2::new(-8.0, 1.0)),
        };
        scene.add_mesh("ground", "road", ground(lo, hi, 0.0, m), Pose::IDENTITY);
        let geometry = Geometry::build(&scene, 0.0, radar.carrier_hz)?;
        let pose: Pose<Sensor, World> = Pose::new(DQuat::IDENTITY, DVec3::Z * HEIGHT_M);
        let air = Air::of(&weather, radar.carrier_hz)?;
        let options = TraceOptions {
            bandwidth_hz: radar.bandwidth_hz(),
            amplitude_floor: 0.0,
            air,
            ..Default::default()
        };
        let echoes = engine.trace(&geometry, &radar, &pose, DVec3::ZERO, &options)?;
        let (cube, _) = engine.cube(&radar, &echoes, &[], 0, 0, Control::default())?;
        let at = |r: usize| r as f64 * bin_m(&radar);
        let seen = spectrum(&radar, &cube).iter().enumerate().map(|(r, p)| [at(r), dbm_from_w(*p)]).collect();
        // Hann's window takes in 1.5 bins of noise.
        let width = 1.5 * bin_m(&radar);
        let surface = &geometry.surfaces[m as usize];
        let eta = RainBackscatter::of(radar.carrier_hz, weather.temperature_c, RAIN_MM_PER_H)?.eta_per_m;
        let loss = rain_attenuation_db_per_m(radar.carrier_hz, RAIN_MM_PER_H)[0];
        let want = (3..BINS).map(|b| {
            let r = at(b);
            let power = match spec {
                Some(_) => {
                    let sin = HEIGHT_M / r;
                    let (sigma0, _) = surface.sigma0(wavenumber(radar.carrier_hz), sin);
                    sigma0.vv * ring(&radar, |azimuth| (azimuth, -sin.asin())) / r.powi(3)
                }
                None => {
                    let steps = 200;
                    let step = PI / f64::from(steps);
                    let over = (0..steps).map(|i| {
                        let e = (f64::from(i) + 0.5) * step - 0.5 * PI;
                        ring(&radar, |azimuth| (azimuth, e)) * e.cos() * step
                    });
                    eta * over.sum::<f64>() / (r * r) * power_from_db(-2.0 * loss * r)
                }
            };
            [r, dbm_from_w(power * width * level(&radar))]
        });
        let pen = Pen::solid(colour, 0.8);
        chart.layers.push(Layer::Line { points: seen, pen });
        chart.key(label, Symbol::Line(pen));
        let dashes = Pen::dashed([40, 40, 40], 1.4, [6.0, 4.0]);
        chart.layers.push(Layer::Line { points: want.collect(), pen: dashes });
        if colour == shades[2] {
            chart.key("closed forms", Symbol::Line(dashes));
        }
    }
    println!("{}", chart.draw()?.write(file, true)?.display());
    Ok(())
}

fn bin_m(r: &Radar) -> f64 {
    r.sample_rate_hz * C0 / (2.0 * r.slope_hz_per_s().abs() * r.samples as f64)
}

/// P G_t G_r lambda^2 / (4 pi)^3.
fn level(r: &Radar) -> f64 {
    let peak = power_from_db(r.tx[0].gain_dbi + r.rx[0].gain_dbi);
    w_from_dbm(r.tx_power_dbm) * peak * r.wavelength_m().powi(2) / (4.0 * PI).powi(3)
}

/// Integral of the squared pattern over azimuth.
fn ring(r: &Radar, at: impl Fn(f64) -> (f64, f64)) -> f64 {
    let pattern: &Pattern = &r.tx[0].pattern;
    let steps = 200;
    let step = PI / f64::from(steps);
    (0..steps)
        .map(|i| {
            let (azimuth, elevation) = at((f64::from(i) + 0.5) * step - 0.5 * PI);
            pattern.power_gain(azimuth, elevation).powi(2) * step
        })
        .sum()
}

/// |X|^2 of the first chirp's range bins under a Hann window.
fn spectrum(radar: &Radar, cube: &AnyCube) -> Vec<f64> {
    let n = radar.samples;
    let x = match cube {
        AnyCube::F32(c) => c.to_f64().data,
        AnyCube::F64(c) => c.data.clone(),
    };
    let w: Vec<f64> = (0..n).map(|i| 0.5 - 0.5 * (TAU * i as f64 / n as f64).cos()).collect();
    let sum: f64 = w.iter().sum();
    (0..BINS)
        .map(|r| {
            let turn = |i: usize| Complex64::cis(-TAU * (r * i % n) as f64 / n as f64);
            let s: Complex64 = (0..n).map(|i| x[i] * w[i] * turn(i)).sum();
            (s / sum).norm_sqr()
        })
        .collect()
}
