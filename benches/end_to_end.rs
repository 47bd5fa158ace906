//! One frame of W3 at rest from the geometry to detected cells, and one direction of W1, on each engine.
//! `CATSEYE_BENCH_DEVICE` as in `stages`.

use catseye::base::control::Control;
use catseye::base::units::DEFAULT_FREQUENCY_HZ;
use catseye::engine::Engine;
use catseye_papers::bench::cross_section::{ReflectorSweep, trihedral};
use catseye_papers::bench::frame::Frame;
use criterion::{BenchmarkId, Criterion};
use std::hint::black_box;
use std::time::Duration;

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(5))
        .configure_from_args();
    for (name, engine) in devices::engines() {
        println!("{name}: {}", engine.describe());
        road(&mut criterion, &name, &engine);
        corner(&mut criterion, &name, &engine);
    }
    criterion.final_summary();
}

fn road(criterion: &mut Criterion, name: &str, engine: &Engine) {
    let mut group = criterion.benchmark_group("end to end");
    group.bench_function(BenchmarkId::new("W3-static", name), |b| {
        b.iter(|| {
            let frame = Frame::w3(false).unwrap();
            let geometry = frame.geometry(&frame.scene).unwrap();
            let echoes = frame.echoes(engine, &geometry, &frame.options, frame.budget).unwrap();
            let (cube, _) = engine.cube(&frame.radar, &echoes, &[], 1, 0, Control::default()).unwrap();
            black_box(engine.range_doppler(&frame.radar, &cube).unwrap())
        })
    });
    group.finish();
}

fn corner(criterion: &mut Criterion, name: &str, engine: &Engine) {
    let mut group = criterion.benchmark_group("cross section");
    let sweep = trihedral(true);
    let (scene, looks, options) = (sweep.scene().unwrap(), sweep.looks(), ReflectorSweep::options());
    group.bench_function(BenchmarkId::new("W1, 46 directions", name), |b| {
        b.iter(|| black_box(engine.rcs(&scene, &[DEFAULT_FREQUENCY_HZ], &looks, &options).unwrap()))
    });
    group.finish();
}
