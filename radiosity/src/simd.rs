//! Sixteen numbers at a time: one source, run with whatever registers the processor has.
//!
//! A `Kernel` is written once over the operations of `Simd`, and `run` enters it with the widest set at
//! hand: AVX-512 (one register), AVX2 (two), or plain arrays. Every operation is exactly rounded, none is fused but
//! `fused` itself, and no sum is reordered, so the bits of the answer are the same with each: the plain one is the
//! scalar twin that the tests hold the others against.
//!
//! This is the only module with `unsafe` in it. What makes it sound: an `Avx2` or `Avx512` is made only by
//! `run`, after the processor was asked.

#![allow(unsafe_code, reason = "vector instructions, behind a token that proves they are there")]

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;
use std::sync::LazyLock;

/// Numbers in a block.
pub const LANES: usize = 16;

/// What the processor offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Plain arrays, compiled for whatever the crate was.
    Portable,
    /// AVX2 with FMA: eight numbers a register.
    Avx2,
    /// AVX-512 (F, VL, BW, DQ): sixteen.
    Avx512,
}

impl Level {
    /// The best that this processor offers.
    pub fn best() -> Self {
        static BEST: LazyLock<Level> = LazyLock::new(Level::asked);
        *BEST
    }

    /// Ask the processor.
    fn asked() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let has_512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq");
            let has_bits = is_x86_feature_detected!("bmi1") && is_x86_feature_detected!("bmi2");
            let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            if has_avx2 && has_bits {
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

/// Work over the operations of a [`Simd`]. `run`, and all it calls that matters, must be `#[inline(always)]`, and not a
/// closure: only what is inlined into it is compiled for the registers.
pub(crate) trait Kernel {
    /// What comes of it.
    type Output;
    /// Do it.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Run a kernel at a level, or at the best that the processor offers where that is less.
pub(crate) fn run<K: Kernel>(level: Level, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
        fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
            kernel.run(Avx2(()))
        }
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt,avx512f,avx512vl,avx512bw,avx512dq")]
        fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
            kernel.run(Avx512(()))
        }
        match level.min(Level::best()) {
            // SAFETY: `best` has found these features.
            Level::Avx512 => return unsafe { with_avx512(kernel) },
            // SAFETY: likewise.
            Level::Avx2 => return unsafe { with_avx2(kernel) },
            Level::Portable => {}
        }
    }
    let _ = level;
    kernel.run(Portable)
}

/// Have all of `numbers` brought nearer: they are wanted soon.
#[inline(always)]
pub(crate) fn fetch<T>(numbers: &[T]) {
    #[cfg(target_arch = "x86_64")]
    for place in (0..size_of_val(numbers)).step_by(64) {
        // SAFETY: nothing is read, and the place is there.
        unsafe { _mm_prefetch::<_MM_HINT_T1>(numbers.as_ptr().cast::<i8>().add(place)) }
    }
    let _ = numbers;
}

/// Operations on blocks of [`LANES`] numbers.
pub(crate) trait Simd: Copy {
    /// Single-precision numbers.
    type Floats: Copy;
    /// 32-bit integers.
    type Ints: Copy;
    /// A yes or no for each lane.
    type Mask: Copy;
    /// Double-precision numbers.
    type Doubles: Copy;

    fn splat(self, value: f32) -> Self::Floats;
    fn load(self, from: &[f32; LANES]) -> Self::Floats;
    fn store(self, value: Self::Floats, to: &mut [f32; LANES]);
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// `a` where a < b, else `b` (so also where either is no number).
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// `a` where a > b, else `b`.
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn greater(self, a: Self::Floats, b: Self::Floats) -> Self::Mask;
    fn select(self, mask: Self::Mask, yes: Self::Floats, no: Self::Floats) -> Self::Floats;
    /// The numbers' own bits.
    fn bits(self, a: Self::Floats) -> Self::Ints;

    fn splat_int(self, value: i32) -> Self::Ints;
    fn load_int(self, from: &[u32; LANES]) -> Self::Ints;
    fn store_int(self, value: Self::Ints, to: &mut [u32; LANES]);
    /// What stands in the lane before; in the first, what stands in the last of `earlier`.
    fn shifted(self, earlier: Self::Ints, a: Self::Ints) -> Self::Ints;
    fn add_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints;
    fn sub_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints;
    fn mul_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints;
    fn greater_int(self, a: Self::Ints, b: Self::Ints) -> Self::Mask;
    fn select_int(self, mask: Self::Mask, yes: Self::Ints, no: Self::Ints) -> Self::Ints;
    /// A bit for each lane in which `a` and `b` differ.
    fn differing(self, a: Self::Ints, b: Self::Ints) -> u32;
    fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// A bit for each lane that says yes.
    fn lanes(self, mask: Self::Mask) -> u32;
    /// Yes in each lane that has its bit.
    fn mask(self, lanes: u32) -> Self::Mask;
    fn equal(self, a: Self::Floats, b: Self::Floats) -> Self::Mask;
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// The same numbers in single precision.
    fn to_float(self, a: Self::Ints) -> Self::Floats;
    /// The square root.
    fn root(self, a: Self::Floats) -> Self::Floats;
    /// The whole part; where that does not fit 32 bits, anything.
    fn to_int(self, a: Self::Floats) -> Self::Ints;
    /// Put the lanes that have their bit one after the other into `to`; what follows them there may be overwritten.
    fn compress_int(self, lanes: u32, a: Self::Ints, to: &mut [u32; LANES]);

    /// The next of `packed` in each lane that has its bit in `mask`, lowest lane first; 0 in the others. Panics where
    /// there are not as many.
    fn expand(self, mask: u16, packed: &[f32]) -> Self::Floats;

    fn splat_double(self, value: f64) -> Self::Doubles;
    fn load_double(self, from: &[f64; LANES]) -> Self::Doubles;
    fn store_double(self, value: Self::Doubles, to: &mut [f64; LANES]);
    fn add_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    fn mul_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// The same numbers in double precision.
    fn widen(self, a: Self::Floats) -> Self::Doubles;
    fn sub_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    fn div_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// `a` where a < b, else `b`.
    fn min_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// `a` where a > b, else `b`.
    fn max_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    fn greater_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Mask;
    /// The square root.
    fn root_double(self, a: Self::Doubles) -> Self::Doubles;
    fn select_double(self, mask: Self::Mask, yes: Self::Doubles, no: Self::Doubles) -> Self::Doubles;
    /// The nearest numbers in single precision.
    fn narrow(self, a: Self::Doubles) -> Self::Floats;
    /// The whole part; where that does not fit 32 bits, anything.
    fn double_to_int(self, a: Self::Doubles) -> Self::Ints;

    /// 0, 1, 2 ... 15.
    #[inline(always)]
    fn ramp(self) -> Self::Floats {
        self.load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0])
    }

    /// The same as integers.
    #[inline(always)]
    fn ramp_int(self) -> Self::Ints {
        self.load_int(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15])
    }

    /// a b + c, rounded once.
    fn fused(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats;

    /// All lanes together, halves first: lane k takes to itself k + 8, then k + 4, k + 2 and k + 1.
    fn sum_double(self, a: Self::Doubles) -> f64;

    /// Those above zero, rounded to single precision, one after the other from the start of `to` (what follows them there
    /// means nothing); a bit for each in the answer.
    fn pack_positive(self, from: &[f64; LANES], to: &mut [f32; LANES]) -> u16;

    /// Have what stands at `place` of `numbers` brought nearer, where there is such a place: it is wanted soon.
    #[inline(always)]
    fn fetch(self, _numbers: &[f32], _place: usize) {}

    /// The same, but into the second cache: it is wanted later.
    #[inline(always)]
    fn fetch_far(self, _numbers: &[f32], _place: usize) {}

    /// [`Simd::expand`] of those from `at` on. Panics where no [`LANES`] stand there, whatever the mask.
    #[inline(always)]
    fn expand_padded(self, mask: u16, packed: Padded<'_>, at: usize) -> Self::Floats {
        self.expand(mask, &packed.numbers[at..at + LANES])
    }

    /// [`Simd::expand`], which leaves in `packed` those that were not taken.
    #[inline(always)]
    fn expand_next(self, mask: u16, packed: &mut &[f32]) -> Self::Floats {
        let lanes = self.expand(mask, packed);
        *packed = &packed[mask.count_ones() as usize..];
        lanes
    }
}

/// Packed numbers with [`LANES`] or more behind them that mean nothing, so that whole registers are read to the end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Padded<'a> {
    numbers: &'a [f32],
    /// Where the last whole register begins.
    last: usize,
}

impl<'a> Padded<'a> {
    /// Panics where there are fewer than [`LANES`] in all.
    #[inline(always)]
    pub(crate) fn new(numbers: &'a [f32]) -> Self {
        assert!(numbers.len() >= LANES, "a register of padding");
        Self { numbers, last: numbers.len() - LANES }
    }

    /// All of them.
    #[inline(always)]
    pub(crate) fn numbers(self) -> &'a [f32] {
        self.numbers
    }
}

/// Plain arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

/// The lanes that have their bit, one after the other.
#[inline(always)]
fn compress<T: Copy>(mut lanes: u32, from: &[T; LANES], to: &mut [T; LANES]) {
    let mut next = 0;
    while lanes != 0 {
        to[next] = from[lanes.trailing_zeros() as usize % LANES];
        next += 1;
        lanes &= lanes - 1;
    }
}

#[inline(always)]
fn each<A: Copy, B: Copy, C>(a: [A; LANES], b: [B; LANES], f: impl Fn(A, B) -> C) -> [C; LANES] {
    std::array::from_fn(|lane| f(a[lane], b[lane]))
}

impl Simd for Portable {
    type Floats = [f32; LANES];
    type Ints = [i32; LANES];
    type Mask = [bool; LANES];
    type Doubles = [f64; LANES];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::Floats {
        [value; LANES]
    }
    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> Self::Floats {
        *from
    }
    #[inline(always)]
    fn store(self, value: Self::Floats, to: &mut [f32; LANES]) {
        *to = value;
    }
    #[inline(always)]
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        each(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        each(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn greater(self, a: Self::Floats, b: Self::Floats) -> Self::Mask {
        each(a, b, |a, b| a > b)
    }
    #[inline(always)]
    fn select(self, mask: Self::Mask, yes: Self::Floats, no: Self::Floats) -> Self::Floats {
        std::array::from_fn(|lane| if mask[lane] { yes[lane] } else { no[lane] })
    }
    #[inline(always)]
    fn bits(self, a: Self::Floats) -> Self::Ints {
        a.map(|a| a.to_bits() as i32)
    }
    #[inline(always)]
    fn splat_int(self, value: i32) -> Self::Ints {
        [value; LANES]
    }
    #[inline(always)]
    fn load_int(self, from: &[u32; LANES]) -> Self::Ints {
        from.map(|value| value as i32)
    }
    #[inline(always)]
    fn store_int(self, value: Self::Ints, to: &mut [u32; LANES]) {
        *to = value.map(|value| value as u32);
    }
    #[inline(always)]
    fn shifted(self, earlier: Self::Ints, a: Self::Ints) -> Self::Ints {
        std::array::from_fn(|lane| if lane == 0 { earlier[LANES - 1] } else { a[lane - 1] })
    }
    #[inline(always)]
    fn add_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints {
        each(a, b, i32::wrapping_add)
    }
    #[inline(always)]
    fn sub_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints {
        each(a, b, i32::wrapping_sub)
    }
    #[inline(always)]
    fn mul_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints {
        each(a, b, i32::wrapping_mul)
    }
    #[inline(always)]
    fn greater_int(self, a: Self::Ints, b: Self::Ints) -> Self::Mask {
        each(a, b, |a, b| a > b)
    }
    #[inline(always)]
    fn select_int(self, mask: Self::Mask, yes: Self::Ints, no: Self::Ints) -> Self::Ints {
        std::array::from_fn(|lane| if mask[lane] { yes[lane] } else { no[lane] })
    }
    #[inline(always)]
    fn differing(self, a: Self::Ints, b: Self::Ints) -> u32 {
        (0..LANES).map(|lane| u32::from(a[lane] != b[lane]) << lane).sum()
    }
    #[inline(always)]
    fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        each(a, b, |a, b| a & b)
    }
    #[inline(always)]
    fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        each(a, b, |a, b| a | b)
    }
    #[inline(always)]
    fn lanes(self, mask: Self::Mask) -> u32 {
        (0..LANES).map(|lane| u32::from(mask[lane]) << lane).sum()
    }
    #[inline(always)]
    fn mask(self, lanes: u32) -> Self::Mask {
        std::array::from_fn(|lane| lanes >> lane & 1 == 1)
    }
    #[inline(always)]
    fn equal(self, a: Self::Floats, b: Self::Floats) -> Self::Mask {
        each(a, b, |a, b| a == b)
    }
    #[inline(always)]
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn to_float(self, a: Self::Ints) -> Self::Floats {
        a.map(|a| a as f32)
    }
    #[inline(always)]
    fn root(self, a: Self::Floats) -> Self::Floats {
        a.map(f32::sqrt)
    }
    #[inline(always)]
    fn to_int(self, a: Self::Floats) -> Self::Ints {
        a.map(|a| a as i32)
    }
    #[inline(always)]
    fn compress_int(self, lanes: u32, a: Self::Ints, to: &mut [u32; LANES]) {
        compress(lanes, &a.map(|a| a as u32), to);
    }
    #[inline(always)]
    fn expand(self, mask: u16, packed: &[f32]) -> Self::Floats {
        let mut next = packed[..mask.count_ones() as usize].iter();
        std::array::from_fn(|lane| match mask >> lane & 1 {
            0 => 0.0,
            _ => *next.next().expect("one for each bit"),
        })
    }
    #[inline(always)]
    fn splat_double(self, value: f64) -> Self::Doubles {
        [value; LANES]
    }
    #[inline(always)]
    fn load_double(self, from: &[f64; LANES]) -> Self::Doubles {
        *from
    }
    #[inline(always)]
    fn store_double(self, value: Self::Doubles, to: &mut [f64; LANES]) {
        *to = value;
    }
    #[inline(always)]
    fn add_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn mul_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn widen(self, a: Self::Floats) -> Self::Doubles {
        a.map(f64::from)
    }
    #[inline(always)]
    fn sub_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn div_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        each(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        each(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn root_double(self, a: Self::Doubles) -> Self::Doubles {
        a.map(f64::sqrt)
    }
    #[inline(always)]
    fn greater_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Mask {
        each(a, b, |a, b| a > b)
    }
    #[inline(always)]
    fn select_double(self, mask: Self::Mask, yes: Self::Doubles, no: Self::Doubles) -> Self::Doubles {
        std::array::from_fn(|lane| if mask[lane] { yes[lane] } else { no[lane] })
    }
    #[inline(always)]
    fn narrow(self, a: Self::Doubles) -> Self::Floats {
        a.map(|a| a as f32)
    }
    #[inline(always)]
    fn double_to_int(self, a: Self::Doubles) -> Self::Ints {
        a.map(|a| a as i32)
    }
    #[inline(always)]
    fn fused(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats {
        std::array::from_fn(|lane| a[lane].mul_add(b[lane], c[lane]))
    }
    #[inline(always)]
    fn sum_double(self, mut a: Self::Doubles) -> f64 {
        for half in [8, 4, 2, 1] {
            for lane in 0..half {
                a[lane] += a[lane + half];
            }
        }
        a[0]
    }
    #[inline(always)]
    fn pack_positive(self, from: &[f64; LANES], to: &mut [f32; LANES]) -> u16 {
        let (mut mask, mut packed) = (0, 0);
        for (lane, &value) in from.iter().enumerate() {
            if value > 0.0 {
                to[packed] = value as f32;
                packed += 1;
                mask |= 1 << lane;
            }
        }
        mask
    }
}

/// Proof that AVX2 is there.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

/// For each mask of eight lanes, which of the packed numbers each lane takes; a highest bit where it takes none.
#[cfg(target_arch = "x86_64")]
static EXPANSIONS: [[u32; 8]; 256] = {
    let mut table = [[1 << 31; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut next) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][lane] = next;
                next += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// The other way: for each mask of eight lanes, which lane each packed number comes from.
#[cfg(target_arch = "x86_64")]
static CONTRACTIONS: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut next) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][next] = lane;
                next += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// The same instruction on both halves of a block.
#[cfg(target_arch = "x86_64")]
macro_rules! both {
    ($op:expr; $($x:expr),+) => {
        // SAFETY: the token proves that AVX2 is there.
        unsafe { [$op($($x[0]),+), $op($($x[1]),+)] }
    };
}

#[cfg(target_arch = "x86_64")]
impl Simd for Avx2 {
    type Floats = [__m256; 2];
    type Ints = [__m256i; 2];
    type Mask = [__m256; 2];
    type Doubles = [__m256d; 4];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::Floats {
        // SAFETY: the token proves that AVX2 is there.
        unsafe { [_mm256_set1_ps(value); 2] }
    }
    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> Self::Floats {
        let at = from.as_ptr();
        // SAFETY: likewise; sixteen numbers stand there, and alignment is not asked for.
        unsafe { [_mm256_loadu_ps(at), _mm256_loadu_ps(at.add(8))] }
    }
    #[inline(always)]
    fn store(self, value: Self::Floats, to: &mut [f32; LANES]) {
        let at = to.as_mut_ptr();
        // SAFETY: likewise.
        unsafe {
            _mm256_storeu_ps(at, value[0]);
            _mm256_storeu_ps(at.add(8), value[1]);
        }
    }
    #[inline(always)]
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        both!(_mm256_add_ps; a, b)
    }
    #[inline(always)]
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        both!(_mm256_mul_ps; a, b)
    }
    #[inline(always)]
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        both!(_mm256_div_ps; a, b)
    }
    #[inline(always)]
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        both!(_mm256_min_ps; a, b)
    }
    #[inline(always)]
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        both!(_mm256_max_ps; a, b)
    }
    #[inline(always)]
    fn greater(self, a: Self::Floats, b: Self::Floats) -> Self::Mask {
        both!(_mm256_cmp_ps::<_CMP_GT_OQ>; a, b)
    }
    #[inline(always)]
    fn select(self, mask: Self::Mask, yes: Self::Floats, no: Self::Floats) -> Self::Floats {
        both!(_mm256_blendv_ps; no, yes, mask)
    }
    #[inline(always)]
    fn bits(self, a: Self::Floats) -> Self::Ints {
        both!(_mm256_castps_si256; a)
    }
    #[inline(always)]
    fn splat_int(self, value: i32) -> Self::Ints {
        // SAFETY: the token proves that AVX2 is there.
        unsafe { [_mm256_set1_epi32(value); 2] }
    }
    #[inline(always)]
    fn load_int(self, from: &[u32; LANES]) -> Self::Ints {
        let at = from.as_ptr();
        // SAFETY: likewise; sixteen numbers stand there, and alignment is not asked for.
        unsafe { [_mm256_loadu_si256(at.cast()), _mm256_loadu_si256(at.add(8).cast())] }
    }
    #[inline(always)]
    fn store_int(self, value: Self::Ints, to: &mut [u32; LANES]) {
        let at = to.as_mut_ptr();
        // SAFETY: likewise.
        unsafe {
            _mm256_storeu_si256(at.cast(), value[0]);
            _mm256_storeu_si256(at.add(8).cast(), value[1]);
        }
    }
    #[inline(always)]
    fn shifted(self, earlier: Self::Ints, a: Self::Ints) -> Self::Ints {
        // SAFETY: the token proves that AVX2 is there.
        unsafe {
            // Each register's halves with what stands before them, a lane apart.
            let before_low = _mm256_permute2x128_si256::<0x21>(earlier[1], a[0]);
            let before_high = _mm256_permute2x128_si256::<0x21>(a[0], a[1]);
            [_mm256_alignr_epi8::<12>(a[0], before_low), _mm256_alignr_epi8::<12>(a[1], before_high)]
        }
    }
    #[inline(always)]
    fn add_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints {
        both!(_mm256_add_epi32; a, b)
    }
    #[inline(always)]
    fn sub_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints {
        both!(_mm256_sub_epi32; a, b)
    }
    #[inline(always)]
    fn mul_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints {
        both!(_mm256_mullo_epi32; a, b)
    }
    #[inline(always)]
    fn greater_int(self, a: Self::Ints, b: Self::Ints) -> Self::Mask {
        let greater = both!(_mm256_cmpgt_epi32; a, b);
        both!(_mm256_castsi256_ps; greater)
    }
    #[inline(always)]
    fn select_int(self, mask: Self::Mask, yes: Self::Ints, no: Self::Ints) -> Self::Ints {
        let mask = both!(_mm256_castps_si256; mask);
        both!(_mm256_blendv_epi8; no, yes, mask)
    }
    #[inline(always)]
    fn differing(self, a: Self::Ints, b: Self::Ints) -> u32 {
        let equal = both!(_mm256_cmpeq_epi32; a, b);
        let equal = both!(_mm256_castsi256_ps; equal);
        let [low, high] = both!(_mm256_movemask_ps; equal);
        !(low as u32 | (high as u32) << 8) & 0xffff
    }
    #[inline(always)]
    fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        both!(_mm256_and_ps; a, b)
    }
    #[inline(always)]
    fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        both!(_mm256_or_ps; a, b)
    }
    #[inline(always)]
    fn lanes(self, mask: Self::Mask) -> u32 {
        let [low, high] = both!(_mm256_movemask_ps; mask);
        low as u32 | (high as u32) << 8
    }
    #[inline(always)]
    fn mask(self, lanes: u32) -> Self::Mask {
        let bit = self.load_int(&std::array::from_fn(|lane| 1 << lane));
        let given = self.splat_int(lanes as i32);
        let there = both!(_mm256_and_si256; bit, given);
        let there = both!(_mm256_cmpeq_epi32; there, bit);
        both!(_mm256_castsi256_ps; there)
    }
    #[inline(always)]
    fn equal(self, a: Self::Floats, b: Self::Floats) -> Self::Mask {
        both!(_mm256_cmp_ps::<_CMP_EQ_OQ>; a, b)
    }
    #[inline(always)]
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        both!(_mm256_sub_ps; a, b)
    }
    #[inline(always)]
    fn to_float(self, a: Self::Ints) -> Self::Floats {
        both!(_mm256_cvtepi32_ps; a)
    }
    #[inline(always)]
    fn root(self, a: Self::Floats) -> Self::Floats {
        both!(_mm256_sqrt_ps; a)
    }
    #[inline(always)]
    fn to_int(self, a: Self::Floats) -> Self::Ints {
        both!(_mm256_cvttps_epi32; a)
    }
    #[inline(always)]
    fn compress_int(self, lanes: u32, a: Self::Ints, to: &mut [u32; LANES]) {
        let mut from = [0; LANES];
        self.store_int(a, &mut from);
        compress(lanes, &from, to);
    }
    #[inline(always)]
    fn expand(self, mask: u16, packed: &[f32]) -> Self::Floats {
        let [low, high] = mask.to_le_bytes();
        let middle = low.count_ones() as usize;
        let wanted = middle + high.count_ones() as usize;
        // Whole registers are read: near the end, from a copy.
        let mut copy = [0.0; LANES];
        let packed: &[f32] = match packed.len() < LANES {
            false => packed,
            true => {
                copy[..wanted].copy_from_slice(&packed[..wanted]);
                &copy
            }
        };
        let half = |bits: u8, packed: &[f32]| {
            let packed: &[f32; 8] = packed.first_chunk().expect("eight or more");
            let lanes: &[u32; 8] = &EXPANSIONS[usize::from(bits)];
            // SAFETY: the token proves that AVX2 is there; eight numbers stand at each place.
            unsafe {
                let lanes = _mm256_loadu_si256(lanes.as_ptr().cast());
                let spread = _mm256_permutevar8x32_ps(_mm256_loadu_ps(packed.as_ptr()), lanes);
                _mm256_blendv_ps(spread, _mm256_setzero_ps(), _mm256_castsi256_ps(lanes))
            }
        };
        [half(low, packed), half(high, &packed[middle..])]
    }
    #[inline(always)]
    fn splat_double(self, value: f64) -> Self::Doubles {
        // SAFETY: the token proves that AVX2 is there.
        unsafe { [_mm256_set1_pd(value); 4] }
    }
    #[inline(always)]
    fn load_double(self, from: &[f64; LANES]) -> Self::Doubles {
        // SAFETY: likewise; sixteen numbers stand there, and alignment is not asked for.
        std::array::from_fn(|k| unsafe { _mm256_loadu_pd(from.as_ptr().add(4 * k)) })
    }
    #[inline(always)]
    fn store_double(self, value: Self::Doubles, to: &mut [f64; LANES]) {
        for (k, value) in value.into_iter().enumerate() {
            // SAFETY: likewise.
            unsafe { _mm256_storeu_pd(to.as_mut_ptr().add(4 * k), value) }
        }
    }
    #[inline(always)]
    fn add_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: the token proves that AVX2 is there.
        std::array::from_fn(|k| unsafe { _mm256_add_pd(a[k], b[k]) })
    }
    #[inline(always)]
    fn mul_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: likewise.
        std::array::from_fn(|k| unsafe { _mm256_mul_pd(a[k], b[k]) })
    }
    #[inline(always)]
    fn widen(self, [low, high]: Self::Floats) -> Self::Doubles {
        // SAFETY: likewise.
        unsafe {
            [
                _mm256_cvtps_pd(_mm256_castps256_ps128(low)),
                _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(low)),
                _mm256_cvtps_pd(_mm256_castps256_ps128(high)),
                _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(high)),
            ]
        }
    }
    #[inline(always)]
    fn sub_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: likewise.
        std::array::from_fn(|k| unsafe { _mm256_sub_pd(a[k], b[k]) })
    }
    #[inline(always)]
    fn div_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: likewise.
        std::array::from_fn(|k| unsafe { _mm256_div_pd(a[k], b[k]) })
    }
    #[inline(always)]
    fn min_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: likewise.
        std::array::from_fn(|k| unsafe { _mm256_min_pd(a[k], b[k]) })
    }
    #[inline(always)]
    fn max_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        // SAFETY: likewise.
        std::array::from_fn(|k| unsafe { _mm256_max_pd(a[k], b[k]) })
    }
    #[inline(always)]
    fn root_double(self, a: Self::Doubles) -> Self::Doubles {
        // SAFETY: likewise.
        std::array::from_fn(|k| unsafe { _mm256_sqrt_pd(a[k]) })
    }
    #[inline(always)]
    fn greater_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Mask {
        // SAFETY: likewise. Of each number's two equal halves one is kept.
        unsafe {
            let greater: [__m256; 4] =
                std::array::from_fn(|k| _mm256_castpd_ps(_mm256_cmp_pd::<_CMP_GT_OQ>(a[k], b[k])));
            std::array::from_fn(|k| {
                let mixed = _mm256_shuffle_ps::<0b10_00_10_00>(greater[2 * k], greater[2 * k + 1]);
                _mm256_castpd_ps(_mm256_permute4x64_pd::<0b11_01_10_00>(_mm256_castps_pd(mixed)))
            })
        }
    }
    #[inline(always)]
    fn select_double(self, mask: Self::Mask, yes: Self::Doubles, no: Self::Doubles) -> Self::Doubles {
        let [low, high] = both!(_mm256_castps_si256; mask);
        // SAFETY: likewise.
        unsafe {
            let wide = [
                _mm256_cvtepi32_epi64(_mm256_castsi256_si128(low)),
                _mm256_cvtepi32_epi64(_mm256_extracti128_si256::<1>(low)),
                _mm256_cvtepi32_epi64(_mm256_castsi256_si128(high)),
                _mm256_cvtepi32_epi64(_mm256_extracti128_si256::<1>(high)),
            ];
            std::array::from_fn(|k| _mm256_blendv_pd(no[k], yes[k], _mm256_castsi256_pd(wide[k])))
        }
    }
    #[inline(always)]
    fn narrow(self, a: Self::Doubles) -> Self::Floats {
        // SAFETY: likewise.
        unsafe {
            let half = |k: usize| _mm256_set_m128(_mm256_cvtpd_ps(a[k + 1]), _mm256_cvtpd_ps(a[k]));
            [half(0), half(2)]
        }
    }
    #[inline(always)]
    fn double_to_int(self, a: Self::Doubles) -> Self::Ints {
        // SAFETY: likewise.
        unsafe {
            let half = |k: usize| _mm256_set_m128i(_mm256_cvttpd_epi32(a[k + 1]), _mm256_cvttpd_epi32(a[k]));
            [half(0), half(2)]
        }
    }
    #[inline(always)]
    fn fused(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats {
        both!(_mm256_fmadd_ps; a, b, c)
    }
    #[inline(always)]
    fn fetch(self, numbers: &[f32], place: usize) {
        // SAFETY: nothing is read; wherever the place lies, it is a hint.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(numbers.as_ptr().wrapping_add(place).cast()) }
    }
    #[inline(always)]
    fn fetch_far(self, numbers: &[f32], place: usize) {
        // SAFETY: likewise.
        unsafe { _mm_prefetch::<_MM_HINT_T1>(numbers.as_ptr().wrapping_add(place).cast()) }
    }
    #[inline(always)]
    fn sum_double(self, [a, b, c, d]: Self::Doubles) -> f64 {
        // SAFETY: the token proves that AVX2 is there.
        unsafe {
            let four = _mm256_add_pd(_mm256_add_pd(a, c), _mm256_add_pd(b, d));
            let two = _mm_add_pd(_mm256_castpd256_pd128(four), _mm256_extractf128_pd::<1>(four));
            _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)))
        }
    }
    #[inline(always)]
    fn pack_positive(self, from: &[f64; LANES], to: &mut [f32; LANES]) -> u16 {
        let half = |from: &[f64]| {
            let from: &[f64; 8] = from.first_chunk().expect("eight");
            // SAFETY: the token proves that AVX2 is there; eight numbers stand there.
            unsafe {
                let (a, b) = (_mm256_loadu_pd(from.as_ptr()), _mm256_loadu_pd(from.as_ptr().add(4)));
                let above = |x| _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(x, _mm256_setzero_pd())) as u8;
                let mask = above(a) | above(b) << 4;
                let floats = _mm256_set_m128(_mm256_cvtpd_ps(b), _mm256_cvtpd_ps(a));
                let lanes = _mm256_loadu_si256(CONTRACTIONS[usize::from(mask)].as_ptr().cast());
                (mask, _mm256_permutevar8x32_ps(floats, lanes))
            }
        };
        let (low, high) = from.split_at(LANES / 2);
        let ((low, first), (high, second)) = (half(low), half(high));
        // The second half begins where the numbers of the first one end.
        for (at, lanes) in [(0, first), (low.count_ones() as usize, second)] {
            let to: &mut [f32; 8] = to[at..].first_chunk_mut().expect("eight or more");
            // SAFETY: likewise.
            unsafe { _mm256_storeu_ps(to.as_mut_ptr(), lanes) };
        }
        u16::from_le_bytes([low, high])
    }
}

/// Proof that AVX-512 (F, VL, BW, DQ) is there.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512(());

/// What stands in a register, which the compiler then takes from nowhere else.
///
/// # Safety
/// AVX-512 must be there.
#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt,avx512f,avx512vl,avx512bw,avx512dq")]
unsafe fn kept(mut register: __m512) -> __m512 {
    // SAFETY: no instruction at all.
    unsafe {
        std::arch::asm!("/* {0} */", inout(zmm_reg) register, options(pure, nomem, nostack, preserves_flags));
    }
    register
}

/// One instruction on a whole block.
#[cfg(target_arch = "x86_64")]
macro_rules! whole {
    ($op:expr; $($x:expr),*) => {
        // SAFETY: the token proves that AVX-512 is there.
        unsafe { $op($($x),*) }
    };
}

#[cfg(target_arch = "x86_64")]
impl Simd for Avx512 {
    type Floats = __m512;
    type Ints = __m512i;
    type Mask = __mmask16;
    type Doubles = [__m512d; 2];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::Floats {
        whole!(_mm512_set1_ps; value)
    }
    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> Self::Floats {
        // Sixteen numbers stand there, and alignment is not asked for.
        whole!(_mm512_loadu_ps; from.as_ptr())
    }
    #[inline(always)]
    fn store(self, value: Self::Floats, to: &mut [f32; LANES]) {
        whole!(_mm512_storeu_ps; to.as_mut_ptr(), value);
    }
    #[inline(always)]
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        whole!(_mm512_add_ps; a, b)
    }
    #[inline(always)]
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        whole!(_mm512_mul_ps; a, b)
    }
    #[inline(always)]
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        whole!(_mm512_div_ps; a, b)
    }
    #[inline(always)]
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        whole!(_mm512_min_ps; a, b)
    }
    #[inline(always)]
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        whole!(_mm512_max_ps; a, b)
    }
    #[inline(always)]
    fn greater(self, a: Self::Floats, b: Self::Floats) -> Self::Mask {
        whole!(_mm512_cmp_ps_mask::<_CMP_GT_OQ>; a, b)
    }
    #[inline(always)]
    fn select(self, mask: Self::Mask, yes: Self::Floats, no: Self::Floats) -> Self::Floats {
        whole!(_mm512_mask_blend_ps; mask, no, yes)
    }
    #[inline(always)]
    fn bits(self, a: Self::Floats) -> Self::Ints {
        whole!(_mm512_castps_si512; a)
    }
    #[inline(always)]
    fn splat_int(self, value: i32) -> Self::Ints {
        whole!(_mm512_set1_epi32; value)
    }
    #[inline(always)]
    fn load_int(self, from: &[u32; LANES]) -> Self::Ints {
        whole!(_mm512_loadu_si512; from.as_ptr().cast())
    }
    #[inline(always)]
    fn store_int(self, value: Self::Ints, to: &mut [u32; LANES]) {
        whole!(_mm512_storeu_si512; to.as_mut_ptr().cast(), value);
    }
    #[inline(always)]
    fn shifted(self, earlier: Self::Ints, a: Self::Ints) -> Self::Ints {
        whole!(_mm512_alignr_epi32::<15>; a, earlier)
    }
    #[inline(always)]
    fn add_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints {
        whole!(_mm512_add_epi32; a, b)
    }
    #[inline(always)]
    fn sub_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints {
        whole!(_mm512_sub_epi32; a, b)
    }
    #[inline(always)]
    fn mul_int(self, a: Self::Ints, b: Self::Ints) -> Self::Ints {
        whole!(_mm512_mullo_epi32; a, b)
    }
    #[inline(always)]
    fn greater_int(self, a: Self::Ints, b: Self::Ints) -> Self::Mask {
        whole!(_mm512_cmpgt_epi32_mask; a, b)
    }
    #[inline(always)]
    fn select_int(self, mask: Self::Mask, yes: Self::Ints, no: Self::Ints) -> Self::Ints {
        whole!(_mm512_mask_blend_epi32; mask, no, yes)
    }
    #[inline(always)]
    fn differing(self, a: Self::Ints, b: Self::Ints) -> u32 {
        u32::from(whole!(_mm512_cmpneq_epi32_mask; a, b))
    }
    #[inline(always)]
    fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        a & b
    }
    #[inline(always)]
    fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        a | b
    }
    #[inline(always)]
    fn lanes(self, mask: Self::Mask) -> u32 {
        u32::from(mask)
    }
    #[inline(always)]
    fn mask(self, lanes: u32) -> Self::Mask {
        lanes as __mmask16
    }
    #[inline(always)]
    fn equal(self, a: Self::Floats, b: Self::Floats) -> Self::Mask {
        whole!(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>; a, b)
    }
    #[inline(always)]
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        whole!(_mm512_sub_ps; a, b)
    }
    #[inline(always)]
    fn to_float(self, a: Self::Ints) -> Self::Floats {
        whole!(_mm512_cvtepi32_ps; a)
    }
    #[inline(always)]
    fn root(self, a: Self::Floats) -> Self::Floats {
        whole!(_mm512_sqrt_ps; a)
    }
    #[inline(always)]
    fn to_int(self, a: Self::Floats) -> Self::Ints {
        whole!(_mm512_cvttps_epi32; a)
    }
    #[inline(always)]
    fn compress_int(self, lanes: u32, a: Self::Ints, to: &mut [u32; LANES]) {
        // In a register, and then stored whole: compressing into memory is many times slower on some processors.
        self.store_int(whole!(_mm512_maskz_compress_epi32; lanes as __mmask16, a), to);
    }
    #[inline(always)]
    fn expand(self, mask: u16, packed: &[f32]) -> Self::Floats {
        // A whole register is read, near the end no more of it than is there.
        let packed = match packed.first_chunk() {
            Some(packed) => self.load(packed),
            None => {
                let packed = &packed[..mask.count_ones() as usize];
                let there = (1_u32 << packed.len()) as u16 - 1;
                whole!(_mm512_maskz_loadu_ps; there, packed.as_ptr())
            }
        };
        whole!(_mm512_maskz_expand_ps; mask, packed)
    }
    #[inline(always)]
    fn splat_double(self, value: f64) -> Self::Doubles {
        [whole!(_mm512_set1_pd; value); 2]
    }
    #[inline(always)]
    fn load_double(self, from: &[f64; LANES]) -> Self::Doubles {
        let (low, high) = from.split_at(LANES / 2);
        // Eight numbers stand at each, and alignment is not asked for.
        [whole!(_mm512_loadu_pd; low.as_ptr()), whole!(_mm512_loadu_pd; high.as_ptr())]
    }
    #[inline(always)]
    fn store_double(self, value: Self::Doubles, to: &mut [f64; LANES]) {
        let (low, high) = to.split_at_mut(LANES / 2);
        whole!(_mm512_storeu_pd; low.as_mut_ptr(), value[0]);
        whole!(_mm512_storeu_pd; high.as_mut_ptr(), value[1]);
    }
    #[inline(always)]
    fn add_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        [whole!(_mm512_add_pd; a[0], b[0]), whole!(_mm512_add_pd; a[1], b[1])]
    }
    #[inline(always)]
    fn mul_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        [whole!(_mm512_mul_pd; a[0], b[0]), whole!(_mm512_mul_pd; a[1], b[1])]
    }
    #[inline(always)]
    fn widen(self, a: Self::Floats) -> Self::Doubles {
        let low = whole!(_mm512_castps512_ps256; a);
        let high = whole!(_mm512_extractf32x8_ps::<1>; a);
        [whole!(_mm512_cvtps_pd; low), whole!(_mm512_cvtps_pd; high)]
    }
    #[inline(always)]
    fn sub_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        [whole!(_mm512_sub_pd; a[0], b[0]), whole!(_mm512_sub_pd; a[1], b[1])]
    }
    #[inline(always)]
    fn div_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        [whole!(_mm512_div_pd; a[0], b[0]), whole!(_mm512_div_pd; a[1], b[1])]
    }
    #[inline(always)]
    fn min_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        [whole!(_mm512_min_pd; a[0], b[0]), whole!(_mm512_min_pd; a[1], b[1])]
    }
    #[inline(always)]
    fn max_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
        [whole!(_mm512_max_pd; a[0], b[0]), whole!(_mm512_max_pd; a[1], b[1])]
    }
    #[inline(always)]
    fn root_double(self, a: Self::Doubles) -> Self::Doubles {
        [whole!(_mm512_sqrt_pd; a[0]), whole!(_mm512_sqrt_pd; a[1])]
    }
    #[inline(always)]
    fn greater_double(self, a: Self::Doubles, b: Self::Doubles) -> Self::Mask {
        let low = whole!(_mm512_cmp_pd_mask::<_CMP_GT_OQ>; a[0], b[0]);
        let high = whole!(_mm512_cmp_pd_mask::<_CMP_GT_OQ>; a[1], b[1]);
        u16::from(low) | u16::from(high) << 8
    }
    #[inline(always)]
    fn select_double(self, mask: Self::Mask, yes: Self::Doubles, no: Self::Doubles) -> Self::Doubles {
        let [low, high] = mask.to_le_bytes();
        [whole!(_mm512_mask_blend_pd; low, no[0], yes[0]), whole!(_mm512_mask_blend_pd; high, no[1], yes[1])]
    }
    #[inline(always)]
    fn narrow(self, a: Self::Doubles) -> Self::Floats {
        let (low, high) = (whole!(_mm512_cvtpd_ps; a[0]), whole!(_mm512_cvtpd_ps; a[1]));
        let low = whole!(_mm512_castps256_ps512; low);
        whole!(_mm512_insertf32x8::<1>; low, high)
    }
    #[inline(always)]
    fn double_to_int(self, a: Self::Doubles) -> Self::Ints {
        let (low, high) = (whole!(_mm512_cvttpd_epi32; a[0]), whole!(_mm512_cvttpd_epi32; a[1]));
        let low = whole!(_mm512_castsi256_si512; low);
        whole!(_mm512_inserti32x8::<1>; low, high)
    }
    #[inline(always)]
    fn fused(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats {
        whole!(_mm512_fmadd_ps; a, b, c)
    }
    #[inline(always)]
    fn fetch(self, numbers: &[f32], place: usize) {
        // SAFETY: nothing is read; wherever the place lies, it is a hint.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(numbers.as_ptr().wrapping_add(place).cast()) }
    }
    #[inline(always)]
    fn fetch_far(self, numbers: &[f32], place: usize) {
        // SAFETY: likewise.
        unsafe { _mm_prefetch::<_MM_HINT_T1>(numbers.as_ptr().wrapping_add(place).cast()) }
    }
    #[inline(always)]
    fn sum_double(self, [low, high]: Self::Doubles) -> f64 {
        let eight = whole!(_mm512_add_pd; low, high);
        // SAFETY: the token proves that AVX-512 is there, and with it AVX.
        unsafe {
            let four = _mm256_add_pd(_mm512_castpd512_pd256(eight), _mm512_extractf64x4_pd::<1>(eight));
            let two = _mm_add_pd(_mm256_castpd256_pd128(four), _mm256_extractf128_pd::<1>(four));
            _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)))
        }
    }
    #[inline(always)]
    fn pack_positive(self, from: &[f64; LANES], to: &mut [f32; LANES]) -> u16 {
        let [low, high] = self.load_double(from);
        let zero = whole!(_mm512_setzero_pd;);
        let above = [
            whole!(_mm512_cmp_pd_mask::<_CMP_GT_OQ>; low, zero),
            whole!(_mm512_cmp_pd_mask::<_CMP_GT_OQ>; high, zero),
        ];
        let mask = u16::from_le_bytes(above);
        if mask != 0 {
            let (low, high) = (whole!(_mm512_cvtpd_ps; low), whole!(_mm512_cvtpd_ps; high));
            let low = whole!(_mm512_castps256_ps512; low);
            let floats = whole!(_mm512_insertf32x8::<1>; low, high);
            // Packed in a register: packing to memory is many times slower.
            self.store(whole!(_mm512_maskz_compress_ps; mask, floats), to);
        }
        mask
    }
    #[inline(always)]
    fn expand_padded(self, mask: u16, packed: Padded<'_>, at: usize) -> Self::Floats {
        assert!(at <= packed.last, "a whole register of packed numbers");
        // SAFETY: they are there. Loaded by itself: opened as it is loaded it takes half as long again.
        unsafe { _mm512_maskz_expand_ps(mask, kept(_mm512_loadu_ps(packed.numbers.as_ptr().add(at)))) }
    }
    #[inline(always)]
    fn expand_next(self, mask: u16, packed: &mut &[f32]) -> Self::Floats {
        let taken = mask.count_ones() as usize;
        if packed.len() < LANES {
            let lanes = self.expand(mask, packed);
            *packed = &packed[taken..];
            return lanes;
        }
        // SAFETY: a mask has sixteen bits at most, and as many numbers stand there.
        unsafe {
            let lanes = _mm512_maskz_expand_ps(mask, _mm512_loadu_ps(packed.as_ptr()));
            *packed = packed.get_unchecked(taken..);
            lanes
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Every operation, on the same numbers.
    struct All {
        a: [f32; LANES],
        b: [f32; LANES],
        i: [u32; LANES],
        j: [u32; LANES],
    }

    fn floats_of(ints: [u32; LANES]) -> [f32; LANES] {
        ints.map(|value| value as f32)
    }

    impl Kernel for All {
        type Output = (Vec<[u32; LANES]>, u32, Vec<u64>);

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let (a, b) = (simd.load(&self.a), simd.load(&self.b));
            let (i, j) = (simd.load_int(&self.i), simd.load_int(&self.j));
            let masks = [simd.greater(a, b), simd.greater_int(i, j)];
            let both = simd.and(masks[0], masks[1]);
            let wide = [simd.widen(a), simd.widen(b)];
            let floats = [
                simd.narrow(simd.sub_double(wide[0], wide[1])),
                simd.narrow(simd.div_double(wide[0], wide[1])),
                simd.narrow(simd.min_double(wide[0], wide[1])),
                simd.narrow(simd.max_double(wide[0], wide[1])),
                simd.narrow(simd.root_double(wide[1])),
                simd.to_float(j),
                simd.narrow(simd.select_double(
                    simd.or(simd.greater_double(wide[1], wide[0]), simd.equal(a, b)),
                    wide[0],
                    wide[1],
                )),
                simd.select(simd.mask(self.j[2]), a, b),
                simd.sub(a, b),
                simd.root(b),
                simd.add(a, b),
                simd.mul(a, b),
                simd.div(a, b),
                simd.min(a, b),
                simd.max(a, b),
                simd.select(both, a, b),
                simd.add(simd.ramp(), simd.splat(self.a[3])),
                simd.fused(a, b, simd.load(&self.a.map(|a| a * 0.37))),
            ];
            let ints = [
                simd.add_int(i, j),
                simd.sub_int(i, j),
                simd.mul_int(i, j),
                simd.select_int(masks[1], i, simd.splat_int(7)),
                simd.shifted(i, j),
                simd.to_int(simd.min(simd.max(a, simd.splat(-1e9)), simd.splat(1e9))),
                simd.double_to_int(simd.mul_double(wide[0], simd.splat_double(1.7))),
                simd.splat_int(simd.lanes(simd.or(masks[0], masks[1])) as i32),
            ];
            let lanes = self.j[3] & 0xffff;
            let count = lanes.count_ones() as usize;
            let mut few_ints = [0; LANES];
            simd.compress_int(lanes, i, &mut few_ints);
            few_ints[count..].fill(0);
            let compressed = [few_ints];
            let stored_floats = floats.map(|value| {
                let mut floats = [0.0; LANES];
                simd.store(value, &mut floats);
                floats.map(f32::to_bits)
            });
            let stored_ints = floats.map(|value| simd.bits(value)).into_iter().chain(ints).map(|value| {
                let mut ints = [0; LANES];
                simd.store_int(value, &mut ints);
                ints
            });
            // As few packed numbers as will do, and more.
            let mask = self.j[0] as u16 | self.j[1].rotate_left(5) as u16;
            let few = simd.expand(mask, &self.b[..mask.count_ones() as usize]);
            let padded =
                simd.expand_padded(mask, Padded::new(&[self.a, self.b].concat()), self.j[4] as usize % LANES);
            let expanded = simd.add_double(
                simd.mul_double(simd.widen(few), simd.splat_double(f64::from(self.a[2]))),
                simd.widen(simd.expand(mask.reverse_bits(), &self.a)),
            );
            let mut doubles = [0.0; LANES];
            simd.store_double(
                simd.add_double(expanded, simd.load_double(&self.a.map(f64::from))),
                &mut doubles,
            );
            // What is packed, from all of it and from part; what lies behind means nothing.
            let packed = [self.a, self.b, floats_of(self.i)].map(|from| {
                let mut to = [0.0; LANES];
                let mask = simd.pack_positive(&from.map(|value| f64::from(value) / 3.0), &mut to);
                to[mask.count_ones() as usize..].fill(f32::from(mask));
                to.map(f32::to_bits)
            });
            let sum = simd.sum_double(simd.load_double(&self.a.map(|a| f64::from(a) * 1.1)));
            let mut left = &self.a[..];
            let next = simd.widen(simd.expand_next(mask, &mut left));
            let mut doubles = vec![doubles, [sum; LANES], [left.len() as f64; LANES]];
            for lanes in [next, simd.widen(padded)] {
                let mut stored = [0.0; LANES];
                simd.store_double(lanes, &mut stored);
                doubles.push(stored);
            }
            let doubles = doubles.concat().into_iter().map(f64::to_bits).collect();
            let stored =
                stored_floats.into_iter().chain(stored_ints).chain(packed).chain(compressed).collect();
            (stored, simd.differing(i, j), doubles)
        }
    }

    proptest! {
        #[test]
        fn every_level_computes_the_same_bits(
            a in proptest::array::uniform16(-1e9_f32..1e9),
            b in proptest::array::uniform16(prop_oneof![-10.0_f32..10.0, Just(0.0), Just(f32::INFINITY)]),
            i in proptest::array::uniform16(0_u32..5),
            j in proptest::array::uniform16(prop_oneof![0_u32..5, any::<u32>()]),
        ) {
            let plain = run(Level::Portable, All { a, b, i, j });
            for level in Level::available() {
                let (found, differing, doubles) = run(level, All { a, b, i, j });
                prop_assert_eq!(differing, plain.1);
                for (found, plain) in doubles.into_iter().zip(plain.2.clone()) {
                    let both_nan = f64::from_bits(found).is_nan() && f64::from_bits(plain).is_nan();
                    prop_assert!(found == plain || both_nan, "{level:?}: {found:x} {plain:x}");
                }
                for (found, plain) in found.iter().zip(&plain.0) {
                    for (&found, &plain) in found.iter().zip(plain) {
                        // What is no number has no bits of its own.
                        let both_nan = f32::from_bits(found).is_nan() && f32::from_bits(plain).is_nan();
                        prop_assert!(found == plain || both_nan, "{level:?}: {found:x} {plain:x}");
                    }
                }
            }
        }
    }
}
