//! For tests: the device they run on, and comparisons of its results with f64 ones.

use super::context::{Gpu, Want};
use super::recorder::POISON;
use bytemuck::Pod;
use std::sync::OnceLock;

/// Part of the name of the adapter that GPU tests run on: `CATSEYE_TEST_DEVICE`, else `llvmpipe`.
pub fn test_device_name() -> String {
    std::env::var("CATSEYE_TEST_DEVICE").unwrap_or_else(|_| "llvmpipe".to_string())
}

/// The device that GPU tests share, with poisoned buffers.
///
/// # Panics
/// If there is none: a GPU test that cannot run has failed.
pub fn test_gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| opened_for_tests().with_poisoned_buffers())
}

/// The device that GPU tests run on, opened anew. With `CATSEYE_TEST_AS_HARDWARE` in the environment it takes the ways that only hardware
/// takes ([`Gpu::with_pretended_hardware`]). Its pipelines are not kept on disk.
///
/// # Panics
/// If there is none.
pub fn opened_for_tests() -> Gpu {
    let name = test_device_name();
    match Gpu::open_with_cache(Want::Named(&name), None) {
        Ok(gpu) if std::env::var_os("CATSEYE_TEST_AS_HARDWARE").is_some() => gpu.with_pretended_hardware(),
        Ok(gpu) => gpu,
        Err(e) => panic!(
            "GPU tests need the adapter {name:?}: {e}. Install a Vulkan driver (Debian: \
                 mesa-vulkan-drivers libvulkan1) or name another adapter in CATSEYE_TEST_DEVICE"
        ),
    }
}

/// Difference of two arrays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// sqrt(sum |got - want|^2 / sum |want|^2)
    pub relative_l2: f64,
    /// The largest |got - want| and where it is.
    pub max_abs: f64,
    /// Index at which they differ most.
    pub at: usize,
}

/// Whether these four bytes are what [`super::Recorder::buffer`] left there.
pub fn is_poison<T: Pod>(value: &T) -> bool {
    let bytes = bytemuck::bytes_of(value);
    !bytes.is_empty() && bytes.chunks(4).all(|c| *c == POISON.to_le_bytes()[..c.len()])
}

/// Fails unless every word of `guard`, space that a kernel must leave alone, still holds its poison.
///
/// # Errors
/// Returns a text that names the first word that was overwritten.
pub fn check_guard<T: Pod>(guard: &[T]) -> Result<(), String> {
    match guard.iter().position(|v| !is_poison(v)) {
        None => Ok(()),
        Some(i) => Err(format!("guard word {i} of {} was overwritten", guard.len())),
    }
}

/// Compares GPU values with f64 ones (cast complex arrays to their parts). Fails on unequal lengths, unwritten
/// values, NaN and infinities on either side; against all zeros only zeros have a finite distance.
///
/// # Errors
/// Returns a text that says what is wrong with the values.
pub fn difference(got: &[f32], want: &[f64]) -> Result<Difference, String> {
    if got.len() != want.len() {
        return Err(format!("{} values, {} expected", got.len(), want.len()));
    }
    if want.is_empty() {
        return Err("nothing to compare".to_string());
    }
    let (mut error, mut norm) = (0.0, 0.0);
    let (mut max_abs, mut at) = (0.0, 0);
    for (i, (&g, &w)) in got.iter().zip(want).enumerate() {
        if is_poison(&g) {
            return Err(format!("value {i} of {} was never written", got.len()));
        }
        if !g.is_finite() || !w.is_finite() {
            return Err(format!("value {i} is {g}, expected {w}"));
        }
        let d = (f64::from(g) - w).abs();
        error += d * d;
        norm += w * w;
        if d > max_abs {
            (max_abs, at) = (d, i);
        }
    }
    let relative_l2 = if error == 0.0 { 0.0 } else { (error / norm).sqrt() };
    Ok(Difference { relative_l2, max_abs, at })
}

/// Fails unless [`difference`] is within `relative_l2`.
///
/// # Errors
/// Returns a text that says by how much the values differ, or what is wrong with them.
pub fn check_close(got: &[f32], want: &[f64], relative_l2: f64) -> Result<Difference, String> {
    let d = difference(got, want)?;
    if d.relative_l2 <= relative_l2 {
        return Ok(d);
    }
    let (g, w) = (got[d.at], want[d.at]);
    Err(format!(
        "relative L2 difference {:.3e} exceeds {relative_l2:.1e}; worst at {}: {g:e}, expected {w:e}",
        d.relative_l2, d.at
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WANT: [f64; 4] = [1.0, -2.0, 2.0, 4.0];

    #[test]
    fn measures_what_it_says() {
        let d = difference(&[1.0, -2.0, 2.0, 4.5], &WANT).unwrap();
        assert_eq!(d, Difference { relative_l2: 0.1, max_abs: 0.5, at: 3 });
        assert_eq!(difference(&[0.0; 2], &[0.0; 2]).unwrap().relative_l2, 0.0);
    }

    #[test]
    fn wrong_data_are_refused() {
        let poison = f32::from_bits(POISON);
        for (got, message) in [
            (&[1.0, -2.0, 2.0, 4.001][..], "exceeds 1.0e-4; worst at 3"),
            (&[1.0, 2.0, 2.0, 4.0], "worst at 1"),
            (&[1.0, -2.0, 4.0, 2.0], "worst at"),
            (&[1.0, -2.0, 2.0], "3 values, 4 expected"),
            (&[1.0, -2.0, 2.0, f32::NAN], "value 3 is NaN"),
            (&[1.0, f32::INFINITY, 2.0, 4.0], "value 1 is inf"),
            (&[1.0, -2.0, 2.0, poison], "value 3 of 4 was never written"),
            (&[0.0; 4], "exceeds"),
        ] {
            let e = check_close(got, &WANT, 1e-4).expect_err(message);
            assert!(e.contains(message), "{e}");
        }
        assert!(check_close(&[1e-30], &[0.0], 1e-4).is_err());
        assert!(check_close(&[1.0], &[f64::NAN], 1e-4).is_err());
        assert!(check_close(&[], &[], 1e-4).is_err());
    }

    #[test]
    fn guards() {
        let poison = f32::from_bits(POISON);
        check_guard(&[[poison; 4]; 3]).unwrap();
        check_guard(&[POISON; 3]).unwrap();
        assert!(
            check_guard(&[[poison; 4], [poison, poison, 0.0, poison]])
                .unwrap_err()
                .contains("guard word 1 of 2")
        );
    }
}
