//! One source, compiled several times over: for any processor, and for those with wider registers.
//!
//! A kernel is plain Rust over short fixed arrays, which the compiler turns into vector instructions of the width
//! it is allowed. [`run`] enters it under the features of the processor at hand. The arithmetic is the same
//! at every level (no fused products, no sums in another order), and so are the bits of the answer: the
//! portable level is the scalar twin of the others, and the tests hold them against it.
//!
//! This is the only module with `unsafe` in it: a function compiled for AVX-512 may be called only where AVX-512 is.

#![allow(unsafe_code, reason = "entering a function compiled for features that were found present")]

/// How many numbers the kernels treat at a time: an AVX-512 register of single-precision numbers.
pub const LANES: usize = 16;

/// What the processor offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Whatever the crate was compiled for.
    Portable,
    /// AVX2: eight numbers at a time.
    Avx2,
    /// AVX-512 (F, VL, BW, DQ): sixteen.
    Avx512,
}

impl Level {
    /// The best that this processor offers.
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let has_512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq");
            let has_bits = is_x86_feature_detected!("bmi1") && is_x86_feature_detected!("bmi2");
            if is_x86_feature_detected!("avx2") && has_bits {
                return if has_512 { Self::Avx512 } else { Self::Avx2 };
            }
        }
        Self::Portable
    }

    /// All that this processor offers, from the least.
    pub fn available() -> Vec<Self> {
        let all = [Self::Portable, Self::Avx2, Self::Avx512];
        all.into_iter().filter(|&level| level <= Self::best()).collect()
    }
}

/// Work that [`run`] compiles for each level. `run`, and all it calls that matters, must be `#[inline(always)]`.
pub(crate) trait Kernel {
    /// What comes of it.
    type Output;
    /// Do it.
    fn run(self) -> Self::Output;
}

/// Run a kernel at a level, or at the best that the processor offers where that is less.
pub(crate) fn run<K: Kernel>(level: Level, kernel: K) -> K::Output {
    match level.min(Level::best()) {
        Level::Portable => kernel.run(),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `best` has found these features.
        Level::Avx2 => unsafe { run_avx2(kernel) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `best` has found these features.
        Level::Avx512 => unsafe { run_avx512(kernel) },
        #[cfg(not(target_arch = "x86_64"))]
        _ => kernel.run(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,popcnt,lzcnt")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,popcnt,lzcnt,avx512f,avx512vl,avx512bw,avx512dq")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}
