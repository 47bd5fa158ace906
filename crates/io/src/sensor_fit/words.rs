//! Cubes whose signed counts were stored as unsigned words.

use catseye::base::error::{BadInput, Result};
use num_complex::Complex64;
use std::path::Path;

/// Reads real and imaginary parts as unsigned 16-bit words of two's complement: 65535 becomes −1.
///
/// # Errors
/// Returns `BadInput` with the index of the first part that is no whole number in 0..=65535.
pub fn from_unsigned16(path: &Path, data: &mut [Complex64]) -> Result<()> {
    let signed = |x: f64| -> Option<f64> {
        let is_word = (0.0..=65535.0).contains(&x) && x.fract() == 0.0;
        is_word.then_some(if x >= 32768.0 { x - 65536.0 } else { x })
    };
    for (i, z) in data.iter_mut().enumerate() {
        let (Some(re), Some(im)) = (signed(z.re), signed(z.im)) else {
            return Err(BadInput::new(format!("sample {i} is no pair of unsigned 16-bit words"))
                .file(path)
                .key("--words")
                .value(format!("{} and {}", z.re, z.im))
                .allowed("whole numbers in 0..=65535")
                .remedy("leave --words out for a cube of signed numbers")
                .into());
        };
        *z = Complex64::new(re, im);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_become_signed() {
        let mut z = [Complex64::new(65535.0, 0.0), Complex64::new(32767.0, 32768.0)];
        from_unsigned16(Path::new("a.npy"), &mut z).unwrap();
        assert_eq!(z, [Complex64::new(-1.0, 0.0), Complex64::new(32767.0, -32768.0)]);
        for bad in [-1.0, 65536.0, 0.5] {
            let e = from_unsigned16(Path::new("a.npy"), &mut [Complex64::new(1.0, bad)]).unwrap_err();
            assert!(e.exit_code() == 2 && e.to_string().contains("0..=65535"), "{e}");
        }
    }
}
