//! The checks that an adapter must pass before it is used: exact error terms of sums and products,
//! phase of long paths, Philox, sine and cosine. Drivers are free to simplify float arithmetic, and
//! some do in ways that ruin double-f32.

use super::cache::cache_folder;
use super::context::{Gpu, Want};
use super::kernel::{Access, Kernel, Tolerance};
use super::numbers::{df_from_f64, turns_from_f64};
use super::recorder::Threads;
use crate::base::error::Result;
use crate::base::rng::{PHILOX_KNOWN_ANSWERS, philox4x32_10};
use crate::base::units::{DEFAULT_FREQUENCY_HZ, wavelength_m};
use crate::gpu_struct;
use std::f64::consts::TAU;
use std::path::Path;

gpu_struct! {
    /// Uniform of `shaders/gpu/selftest.wgsl`.
    pub struct SelfTestParams {
        pub count: u32,
        /// Always zero, which the compiler of the shader must not know.
        pub zero: u32,
    }
}

/// No engine runs this kernel; its truth is computed here.
pub static KERNEL: Kernel = Kernel {
    stem: "gpu/selftest",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/df64.wgsl"),
        include_str!("../../shaders/shared/phase.wgsl"),
        include_str!("../../shaders/shared/rng.wgsl"),
        include_str!("../../shaders/gpu/selftest.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(SelfTestParams::LAYOUT),
    storage: &[Access::Read, Access::ReadWrite],
    structs: &[],
    tolerance: Tolerance { relative_l2: 0.0, reason: "each check has its own bound, see `verify`" },
};

/// Largest error of the phase of a path in rad: 16 units of the 2^-48 that a double-f32 resolves at
/// 1e5 turns, and four of the 2^-32 turn in which it is expressed.
const PHASE_BOUND_RAD: f64 = TAU * (16.0 * 1e5 / 281_474_976_710_656.0 + 4.0 / 4_294_967_296.0);
/// Largest error of cosine and sine: the polynomial's 1e-8, two roundings, and that of the angle.
const CIS_BOUND: f64 = 3e-7;

const PAIRS: usize = 2048;
const PATHS: usize = 512;
const DRAWS: usize = 64;
const ANGLES: usize = 2048;

enum Question {
    /// two_sum and two_prod.
    Exact {
        a: f32,
        b: f32,
    },
    /// Turns of the way between two points in m.
    Path {
        from: [f64; 3],
        to: [f64; 3],
    },
    Philox {
        counter: [u32; 4],
        key: [u32; 2],
    },
    /// cis of a phase, and of the same in f32 turns.
    Cis {
        turns: u32,
        turns_f: f32,
    },
}

impl Question {
    fn words(&self) -> [u32; 16] {
        let mut w = [0; 16];
        match *self {
            Question::Exact { a, b } => w[1..3].copy_from_slice(&[a.to_bits(), b.to_bits()]),
            Question::Path { from, to } => {
                w[0] = 1;
                for (at, point) in [(1, from), (7, to)] {
                    for (i, x) in point.into_iter().enumerate() {
                        let [hi, lo] = df_from_f64(x);
                        w[at + i] = hi.to_bits();
                        w[at + 3 + i] = lo.to_bits();
                    }
                }
                w[13..15].copy_from_slice(&df_from_f64(test_wavelength()).map(f32::to_bits));
            }
            Question::Philox { counter, key } => {
                w[0] = 2;
                w[1..5].copy_from_slice(&counter);
                w[5..7].copy_from_slice(&key);
            }
            Question::Cis { turns, turns_f } => {
                w[0] = 3;
                w[1..3].copy_from_slice(&[turns, turns_f.to_bits()]);
            }
        }
        w
    }
}

fn test_wavelength() -> f64 {
    wavelength_m(DEFAULT_FREQUENCY_HZ)
}

/// The value that the device sees for x: hi + lo of its double-f32.
fn as_seen(x: f64) -> f64 {
    let [hi, lo] = df_from_f64(x);
    f64::from(hi) + f64::from(lo)
}

fn questions() -> Vec<Question> {
    let mut questions = Vec::new();
    let draw = |i: usize, stream: u32| philox4x32_10([i as u32, 0, 0, 0], [stream, 0x5e1f]);
    let unit = |w: u32| f64::from(w) / 4_294_967_296.0;

    // Pairs on which simplified arithmetic loses something: neighbours of powers of two, cancelling and
    // absorbed terms, both orders; then random mantissas at all distances that matter.
    let edges = [1.0, 1.0 + f32::EPSILON, 1.0 - f32::EPSILON / 2.0, 4097.0, 4095.0, 1.0 / 3.0, 16_777_215.0];
    for a in edges {
        for b in edges {
            for scale in [1.0, -1.0, f32::EPSILON, -f32::EPSILON, 16_777_216.0] {
                questions.push(Question::Exact { a, b: b * scale });
                questions.push(Question::Exact { a: b * scale, b: a });
            }
        }
    }
    for i in questions.len()..PAIRS {
        let [p, q, r, _] = draw(i, 1);
        let float = |w: u32, exponent: u32| f32::from_bits((w & 0x807f_ffff) | (exponent << 23));
        questions.push(Question::Exact { a: float(p, 112 + r % 31), b: float(q, 112 + (r >> 16) % 31) });
    }
    // A radar in a world of some hundred metres and points up to 400 m (one way) away.
    for i in 0..PATHS {
        let ([x, y, z, r], [a, b, c, _]) = (draw(i, 2), draw(i, 3));
        let from = [x, y, z].map(|w| 600.0 * (unit(w) - 0.5));
        let d = [a, b, c].map(|w| unit(w) - 0.5);
        let length = 0.05 + 399.9 * unit(r);
        let norm = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt().max(1e-3);
        let to = [0, 1, 2].map(|k| from[k] + d[k] / norm * length);
        questions.push(Question::Path { from: from.map(as_seen), to: to.map(as_seen) });
    }
    for (counter, key, _) in PHILOX_KNOWN_ANSWERS {
        questions.push(Question::Philox { counter, key });
    }
    for i in 0..DRAWS {
        let [a, b, ..] = draw(i, 5);
        questions.push(Question::Philox { counter: draw(i, 4), key: [a, b] });
    }
    for i in 0..ANGLES {
        let turns = match i {
            // around the eighths of a turn, where the octant changes
            0..64 => ((i as u32 / 8) << 29).wrapping_add(i as u32 % 8).wrapping_sub(4),
            _ => draw(i, 6)[0],
        };
        let turns_f = (i as f32 / ANGLES as f32 - 0.5) * 4.0;
        questions.push(Question::Cis { turns, turns_f });
    }
    questions
}

/// Ok, or which check failed and by how much.
fn verify(questions: &[Question], answers: &[[u32; 4]]) -> Result<(), String> {
    let mut phase_rad = 0.0_f64;
    let mut cis = 0.0_f64;
    for (question, answer) in questions.iter().zip(answers) {
        let floats = answer.map(f32::from_bits);
        match *question {
            Question::Exact { a, b } => {
                let (wide_a, wide_b) = (f64::from(a), f64::from(b));
                // The f64 product is exact; the f64 sum is not for distant terms, its error term is.
                let sum = a + b;
                let part = sum - a;
                let rest = (a - (sum - part)) + (b - part);
                let product = a * b;
                let product_rest = (wide_a * wide_b - f64::from(product)) as f32;
                for (name, got, want) in [
                    ("two_sum's sum", floats[0], sum),
                    ("two_sum's error term", floats[1], rest),
                    ("two_prod's product", floats[2], product),
                    ("two_prod's error term", floats[3], product_rest),
                ] {
                    // as numbers: the sign of a zero is free
                    if got != want {
                        return Err(format!("{name} of {a:e} and {b:e} is {got:e}, must be {want:e}"));
                    }
                }
            }
            Question::Path { from, to } => {
                let squares: f64 = (0..3).map(|i| (from[i] - to[i]).powi(2)).sum();
                let want = turns_from_f64(squares.sqrt() / as_seen(test_wavelength()));
                let error = answer[0].wrapping_sub(want) as i32;
                phase_rad = phase_rad.max(f64::from(error).abs() / 4_294_967_296.0 * TAU);
            }
            Question::Philox { counter, key } => {
                let want = philox4x32_10(counter, key);
                if *answer != want {
                    return Err(format!("Philox of {counter:x?} is {answer:x?}, must be {want:x?}"));
                }
            }
            Question::Cis { turns, turns_f } => {
                let (s, c) = (f64::from(turns) / 4_294_967_296.0 * TAU).sin_cos();
                let (sf, cf) = (f64::from(turns_f) * TAU).sin_cos();
                for (got, want) in floats.into_iter().zip([c, s, cf, sf]) {
                    let error = (f64::from(got) - want).abs();
                    // NaN is an error of any size
                    cis = if error.is_nan() { f64::INFINITY } else { cis.max(error) };
                }
            }
        }
    }
    if phase_rad > PHASE_BOUND_RAD {
        return Err(format!(
            "the phase of paths up to 400 m at 77 GHz is off by {phase_rad:.2e} rad, allowed are {PHASE_BOUND_RAD:.2e}"
        ));
    }
    if cis > CIS_BOUND {
        return Err(format!("sine and cosine are off by {cis:.2e}, allowed are {CIS_BOUND:.0e}"));
    }
    Ok(())
}

fn ask(gpu: &Gpu, kernel: &'static Kernel, questions: &[Question]) -> Result<Vec<[u32; 4]>> {
    let items: Vec<[u32; 16]> = questions.iter().map(Question::words).collect();
    let mut recorder = gpu.recorder("self-test");
    let input = recorder.upload("items", &items);
    let output = recorder.buffer::<[u32; 4]>("answers", items.len());
    let params = SelfTestParams { count: items.len() as u32, zero: 0 };
    recorder.dispatch(kernel, &params, &[&input, &output], Threads::Linear(items.len() as u64));
    let answers = recorder.read(&output);
    Ok(recorder.submit()?.take(answers))
}

impl Gpu {
    /// Opens an adapter, with its own limits of sizes and those of every WebGPU device for what kernels bind and share, and runs the self-test on it. Compiled
    /// pipelines are kept in the user's cache folder ([`cache_folder`]).
    ///
    /// # Errors
    /// Returns `BadInput` if no adapter is as wanted; `Error::Gpu` if it cannot be opened or fails the self-test.
    pub fn open(want: Want<'_>) -> Result<Gpu> {
        // Unit tests leave the user's folder alone.
        let folder = if cfg!(test) { None } else { cache_folder() };
        Gpu::open_with_cache(want, folder.as_deref())
    }

    /// [`Gpu::open`] with compiled pipelines kept between starts in a file of `folder`, in place of the user's ([`cache_folder`]); None
    /// keeps nothing.
    ///
    /// # Errors
    /// Returns the errors of [`Gpu::open`]. A folder that cannot be read or written is none.
    pub fn open_with_cache(want: Want<'_>, folder: Option<&Path>) -> Result<Gpu> {
        let mut gpu = Gpu::open_untested(want)?;
        if let Some(folder) = folder {
            gpu = gpu.with_cache(folder);
        }
        run(&gpu, &KERNEL)?;
        Ok(gpu)
    }
}

/// Runs the self-test; a failure is `Error::Gpu`.
pub(super) fn run(gpu: &Gpu, kernel: &'static Kernel) -> Result<()> {
    let questions = questions();
    let answers = ask(gpu, kernel, &questions)?;
    verify(&questions, &answers)
        .map_err(|problem| gpu.error(kernel.stem, format!("the adapter failed its self-test: {problem}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::compare::test_gpu;

    #[test]
    fn passes_on_the_test_device() {
        run(test_gpu(), &KERNEL).unwrap();
    }

    #[test]
    fn each_check_can_fail() {
        let questions = questions();
        let right = ask(test_gpu(), &KERNEL, &questions).unwrap();
        verify(&questions, &right).unwrap();
        let mut last = usize::MAX;
        for (word, change, message) in [
            (0, 1, "two_sum's sum"),
            (1, 1, "two_sum's error term"),
            (3, 1, "two_prod's error term"),
            (0, 1 << 12, "off by"),
            (2, 1, "Philox"),
            (1, 64, "sine and cosine are off"),
        ] {
            let kind = match message {
                "off by" => 1,
                "Philox" => 2,
                "sine and cosine are off" => 3,
                _ => 0,
            };
            // the last question of its kind, so that every loop reaches its end
            let at = questions.iter().rposition(|q| q.words()[0] == kind).unwrap();
            let mut wrong = right.clone();
            wrong[at][word] ^= change;
            let e = verify(&questions, &wrong).expect_err(message);
            assert!(e.contains(message), "{e}");
            last = last.min(at);
        }
        let mut nan = right.clone();
        *nan.last_mut().unwrap() = [f32::NAN.to_bits(); 4];
        assert!(verify(&questions, &nan).unwrap_err().contains("inf"));
        assert!(last > 0);
    }

    /// On llvmpipe the compiler does fold (a + b) - a; without the barrier the adapter is refused.
    #[test]
    fn double_f32_without_its_barrier_is_refused() {
        let df64 = KERNEL.sources[1];
        let fusable = df64.replace("return bitcast<f32>(bitcast<u32>(x) ^ barrier_zero);", "return x;");
        assert_ne!(df64, fusable);
        let sources: Vec<&'static str> =
            KERNEL.sources.iter().map(|s| if *s == df64 { &*fusable.clone().leak() } else { *s }).collect();
        let kernel: &'static Kernel =
            Box::leak(Box::new(Kernel { stem: "test/no-barrier", sources: sources.leak(), ..KERNEL }));
        let gpu = test_gpu();
        let result = run(gpu, kernel);
        if gpu.report().name.contains("llvmpipe") {
            let e = result.unwrap_err().to_string();
            assert!(e.contains("failed its self-test") && e.contains("test/no-barrier"), "{e}");
        }
    }
}
