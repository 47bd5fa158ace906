//! Each stage of the chain on its own, on each engine. `CATSEYE_BENCH_DEVICE` names the device (as
//! `--device` does); without it the cpu engine runs, and Mesa's software adapter where there is one.

use catseye::base::control::Control;
use catseye::dsp::PowerMap;
use catseye::dsp::transform::Transform;
use catseye::dsp::{self, cpu};
use catseye::engine::{Engine, Precision};
use catseye::geom::Geometry;
use catseye_papers::bench::frame::Frame;
use catseye_papers::bench::{processing, ray_cast};
use criterion::{BenchmarkId, Criterion, Throughput};
use std::hint::black_box;
use std::time::Duration;

const SCREEN: [usize; 2] = [480, 270];

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    geometry(&mut criterion);
    for (name, engine) in devices::engines() {
        println!("{name}: {}", engine.describe());
        trace(&mut criterion, &name, &engine);
        synthesis(&mut criterion, &name, &engine);
        processing(&mut criterion, &name, &engine);
    }
    criterion.final_summary();
}

/// W3 with its scene placed.
fn placed(moving: bool) -> (Frame, Geometry) {
    let frame = Frame::w3(moving).unwrap();
    let geometry = frame.geometry(&frame.scene).unwrap();
    (frame, geometry)
}

/// The tree is built on the host whatever the device.
fn geometry(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("geometry");
    group.bench_function("W3, 1,406 triangles", |b| b.iter(|| black_box(placed(false))));
    group.bench_function("W6, 1,002,528 triangles", |b| b.iter(|| black_box(ray_cast::geometry().unwrap())));
    group.finish();
}

fn trace(criterion: &mut Criterion, name: &str, engine: &Engine) {
    let mut group = criterion.benchmark_group("trace");
    let terrain = ray_cast::geometry().unwrap();
    let caster = ray_cast::Caster::new(engine, &terrain).unwrap();
    let [width, height] = SCREEN;
    for (kind, rays) in [
        ("coherent", ray_cast::coherent(&terrain, SCREEN)),
        ("random", ray_cast::random(&terrain, width * height, 1)),
    ] {
        group.throughput(Throughput::Elements(rays.len() as u64));
        group.bench_function(BenchmarkId::new(format!("{kind} {width}x{height}"), name), |b| {
            b.iter(|| black_box(caster.cast(&rays).unwrap()))
        });
    }
    let (frame, geometry) = placed(false);
    let echoes = || frame.echoes(engine, &geometry, &frame.options, frame.budget).unwrap();
    group.throughput(Throughput::Elements(echoes().list.len() as u64));
    group.bench_function(BenchmarkId::new("W3 by beams", name), |b| b.iter(|| black_box(echoes())));
    group.finish();
}

/// Few echoes, as each meets every sample: what counts is echoes times samples.
fn synthesis(criterion: &mut Criterion, name: &str, engine: &Engine) {
    let mut group = criterion.benchmark_group("synthesis");
    for (kind, moving, count) in [("at rest", false, 16_384), ("moving", true, 256)] {
        let (frame, geometry) = placed(moving);
        let mut echoes = frame.echoes(engine, &geometry, &frame.options, frame.budget).unwrap();
        echoes.list.truncate(count);
        let chirps = if moving { frame.radar.chirps } else { 1 };
        let samples = chirps * frame.radar.channels() * frame.radar.samples;
        group.throughput(Throughput::Elements((echoes.list.len() * samples) as u64));
        let label = format!("{kind}, {} echoes", echoes.list.len());
        group.bench_function(BenchmarkId::new(label, name), |b| {
            b.iter(|| black_box(engine.cube(&frame.radar, &echoes, &[], 1, 0, Control::default()).unwrap()))
        });
    }
    group.finish();
}

fn processing(criterion: &mut Criterion, name: &str, engine: &Engine) {
    let mut group = criterion.benchmark_group("processing");
    let radar = processing::radar().unwrap();
    let cube = processing::cube(&radar, 1);
    let transform = Transform::of_cube(&cube, &radar).unwrap();
    let spectrum = cpu::fft::spectrum(&cube, &transform);
    let map: PowerMap<f32> = cpu::power::power(&spectrum);
    let (cfar, channels) = (&radar.processing.cfar, radar.channels());
    group.throughput(Throughput::Elements(cube.data.len() as u64));
    group.bench_function(BenchmarkId::new("FFT 12x512x1024", name), |b| match engine {
        Engine::Cpu(Precision::F64) => unreachable!("the benches open the cpu engine in f32"),
        Engine::Cpu(Precision::F32) => b.iter(|| black_box(cpu::fft::spectrum(&cube, &transform))),
        Engine::Gpu(gpu) => b.iter(|| {
            let mut recorder = gpu.recorder("fft");
            let spectrum = dsp::spectrum::record(&mut recorder, gpu, &cube, &transform).unwrap();
            recorder.submit().unwrap();
            black_box(spectrum)
        }),
    });
    group.throughput(Throughput::Elements(map.data.len() as u64));
    group.bench_function(BenchmarkId::new("OS-CFAR 512x1024, 216 cells", name), |b| match engine {
        Engine::Cpu(_) => b.iter(|| black_box(cpu::detect(&map, cfar, channels).unwrap())),
        Engine::Gpu(gpu) => b.iter(|| black_box(dsp::device::detect(gpu, &map, cfar, channels).unwrap())),
    });
    group.finish();
}
