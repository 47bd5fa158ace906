//! What a look takes each lane estimator, on one core: looks of the comparison's straight drive (`scenes/lane/compare_straight.toml`),
//! ten a second. A pass over all looks is timed, the first of which begins anew; divide by their number.

use catseye::engine::{Engine, Precision};
use catseye_papers::trial::compared_drive;
use criterion::{Criterion, Throughput};
use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

const FRAMES: u32 = 8;

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(3))
        .configure_from_args();
    let engine = Engine::open("cpu", Precision::F32).expect("the cpu engine opens");
    println!("{}", engine.describe());
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("scenes/lane/compare_straight.toml");
    let driven = compared_drive::driven(&engine, &path, FRAMES).expect("the drive of the repository");
    let mut group = criterion.benchmark_group("lane, a pass over 8 looks");
    for mut d in driven {
        let points = d.looks.iter().map(|l| l.points.len()).sum::<usize>() / d.looks.len().max(1);
        let name = d.variant.name();
        println!("{name}: {} looks, {points} points a look", d.looks.len());
        group.throughput(Throughput::Elements(d.looks.len() as u64));
        group.bench_function(name, |b| {
            b.iter(|| {
                for look in &d.looks {
                    black_box(d.method.estimator.estimate(&look.input()));
                }
            })
        });
    }
    group.finish();
    criterion.final_summary();
}
