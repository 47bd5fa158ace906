//! Statistics over looks and runs, draws, and the time that an estimator takes.

use catseye::base::rng::Draws;
use std::time::Instant;

/// The random draws of a stream for a scenario's seed.
pub fn draws(seed: u64, stream: u32) -> Draws {
    Draws::new(seed as u32 ^ (seed >> 32) as u32, stream)
}

/// The mean of the values; None without values.
pub fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let v: Vec<f64> = values.into_iter().collect();
    (!v.is_empty()).then(|| v.iter().sum::<f64>() / v.len() as f64)
}

/// The root mean square of the values; None without values.
pub fn rms(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    mean(values.into_iter().map(|v| v * v)).map(f64::sqrt)
}

/// The value of `of` for the items of each run, in ascending order of runs; runs without a value are left
/// out.
pub fn over_runs<T>(items: &[T], run: impl Fn(&T) -> u32, of: impl Fn(&[&T]) -> Option<f64>) -> Vec<f64> {
    let mut runs: Vec<u32> = items.iter().map(&run).collect();
    runs.sort_unstable();
    runs.dedup();
    let one = |r: &u32| of(&items.iter().filter(|i| run(i) == *r).collect::<Vec<_>>());
    runs.iter().filter_map(one).collect()
}

/// The result of `work`, and the time that it took, s.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let clock = Instant::now();
    let result = work();
    (result, clock.elapsed().as_secs_f64())
}
