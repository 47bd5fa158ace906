//! Runs a loop with the widest instructions that this machine has. The only `unsafe` of the cpu
//! engine: a call into code compiled for instructions whose presence was checked a line before.
#![allow(unsafe_code, reason = "a target_feature function can only be called this way")]

/// A computation whose `run` is `#[inline(always)]`, so that it is compiled again for each level.
pub trait Vectorised {
    /// What the computation gives.
    type Output;
    /// `FMA`: a·b + c is one instruction here, so `mul_add` is fast; elsewhere it would be a call.
    fn run<const FMA: bool>(self) -> Self::Output;
}

/// Whether the widest vectors are there, with all that compilers expect beside them.
#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    use std::arch::is_x86_feature_detected as has;
    has!("avx512f") && has!("avx512vl") && has!("avx512dq") && has!("avx512bw") && has!("avx2") && has!("fma")
}

/// `lanes!(8, l => f(l))`: f of each lane, as a loop where it stands. A closure given to `array::from_fn` may be compiled beside other
/// code, without the wide instructions.
macro_rules! lanes {
    ($count:expr, $lane:ident => $value:expr) => {{
        let mut out = [Default::default(); $count];
        for $lane in 0..$count {
            out[$lane] = $value;
        }
        out
    }};
}
pub(crate) use lanes;

/// Which instructions `vectorised` uses here, for reports.
pub fn level() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if has_avx512() {
        return "avx512";
    }
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        return "avx2+fma";
    }
    if cfg!(target_arch = "aarch64") { "neon" } else { "baseline" }
}

/// Runs a computation with the widest instructions of this machine.
pub fn vectorised<V: Vectorised>(work: V) -> V::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
        fn avx512<V: Vectorised>(work: V) -> V::Output {
            work.run::<true>()
        }
        if has_avx512() {
            // SAFETY: all of them were just found on this processor.
            return unsafe { avx512(work) };
        }
        #[target_feature(enable = "avx2,fma")]
        fn avx2<V: Vectorised>(work: V) -> V::Output {
            work.run::<true>()
        }
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: both features were just found on this processor.
            return unsafe { avx2(work) };
        }
    }
    if cfg!(target_arch = "aarch64") { work.run::<true>() } else { work.run::<false>() }
}
