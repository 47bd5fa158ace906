//! Host side of `shaders/shared/df64.wgsl`, `numbers_df64.wgsl`, `numbers_f64.wgsl` and `phase.wgsl`.

/// Source of the numbers of some 48 bits that kernels compute with on every adapter: pairs of f32.
pub const PAIRS: &str = include_str!("../../shaders/shared/numbers_df64.wgsl");

/// What takes the place of [`PAIRS`] where the adapter computes in f64.
pub const DOUBLES: &str = include_str!("../../shaders/shared/numbers_f64.wgsl");

/// Splits x into a double-f32 (hi, lo): hi + lo is x to about 48 bits.
pub fn df_from_f64(x: f64) -> [f32; 2] {
    let hi = x as f32;
    [hi, (x - f64::from(hi)) as f32]
}

/// The fraction of a turn of `x` turns, in units of 2^-32 turn. `x` may be of any size; its own
/// rounding (1e-11 turns at 1e5) is what is left of the error.
pub fn turns_from_f64(x: f64) -> u32 {
    let scaled = (x - x.floor()) * 4_294_967_296.0;
    // Rounding can reach 2^32, which is zero.
    scaled.round() as u64 as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn double_f32_keeps_48_bits(x in -1e6..1e6_f64) {
            let [hi, lo] = df_from_f64(x);
            prop_assert!((f64::from(hi) + f64::from(lo) - x).abs() <= x.abs() * 2f64.powi(-48));
        }

        #[test]
        fn turns_wrap(x in -1e3..1e3_f64, n in -1000i32..1000) {
            let difference = turns_from_f64(x + f64::from(n)).wrapping_sub(turns_from_f64(x)) as i32;
            // 2^-43 of the sum of up to 2000 is 1 unit
            prop_assert!(difference.abs() <= 1);
        }
    }

    #[test]
    fn turns_of_known_angles() {
        assert_eq!(turns_from_f64(0.25), 1 << 30);
        assert_eq!(turns_from_f64(-0.25), 3 << 30);
        assert_eq!(turns_from_f64(1.0 - 1e-12), 0);
        assert_eq!(turns_from_f64(205_000.5), 1 << 31);
    }
}
