//! Eight doubles in registers: `[f64; 8]`, two AVX2 vectors, or one AVX-512 vector.
//!
//! Only this file names intrinsics. Every operation rounds as IEEE 754 says, so the three forms
//! agree to the last bit.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Body, Eight};

/// The operations a kernel may use on eight lanes.
///
/// The implementing types stay inside the kernel folder: only [`dispatch`](super::dispatch) can
/// bring them into play, after it has seen that the machine has their instructions.
pub trait Lanes: Copy + 'static {
    /// Height (packs) and width (columns) of the product tile that fits the registers.
    const TILE: (usize, usize);
    /// The same for a tile that keeps three accumulators an entry.
    const PAIR_TILE: (usize, usize);
    /// The same number in all lanes.
    fn splat(x: f64) -> Self;
    /// The number of one lane in all lanes.
    fn lane(self, lane: usize) -> Self;
    /// The first eight numbers, 0 in the lanes that memory has none for.
    fn load(from: &[f64]) -> Self;
    /// Writes as many lanes as there is room for.
    fn store(self, to: &mut [f64]);
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// Difference.
    fn sub(self, other: Self) -> Self;
    /// Product.
    fn mul(self, other: Self) -> Self;
    /// Quotient.
    fn div(self, other: Self) -> Self;
    /// `self * a + b`, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// The larger of two; `other` where one is not a number.
    fn max(self, other: Self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// `self` where the sign of `by` is negative, `other` elsewhere.
    fn where_negative(self, by: Self, other: Self) -> Self;
    /// The power of two at or below the magnitude; 0 for 0 and for subnormal numbers.
    fn binade(self) -> Self;
    /// `((x0 + x4) + (x2 + x6)) + ((x1 + x5) + (x3 + x7))`.
    fn sum(self) -> f64;
    /// The largest lane.
    fn largest(self) -> f64;
    /// Runs another body at the same level, as a function call of its own.
    fn call<B: Body>(body: B) -> B::Output;
}

/// Eight lanes with operators. Write formulas over this type.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Pack<V>(pub V);

/// The packs of a piece of memory.
#[inline(always)]
pub fn packs<V: Lanes>(memory: &[Eight]) -> &[Pack<V>] {
    const { assert!(size_of::<V>() == 64 && align_of::<V>() <= 64) }
    // SAFETY: a `Pack<V>` is eight doubles, as `Eight` is, and no stricter in alignment.
    unsafe { std::slice::from_raw_parts(memory.as_ptr().cast(), memory.len()) }
}

/// The packs of a piece of memory, to write.
#[inline(always)]
pub fn packs_mut<V: Lanes>(memory: &mut [Eight]) -> &mut [Pack<V>] {
    const { assert!(size_of::<V>() == 64 && align_of::<V>() <= 64) }
    // SAFETY: as in `packs`; the borrow is exclusive.
    unsafe { std::slice::from_raw_parts_mut(memory.as_mut_ptr().cast(), memory.len()) }
}

impl<V: Lanes> Pack<V> {
    /// The same number in all lanes.
    #[inline(always)]
    pub fn splat(x: f64) -> Self {
        Pack(V::splat(x))
    }
    /// The number of one lane in all lanes.
    #[inline(always)]
    pub fn lane(self, lane: usize) -> Self {
        Pack(self.0.lane(lane))
    }
    /// The first eight numbers, 0 in the lanes that memory has none for.
    #[inline(always)]
    pub fn load(from: &[f64]) -> Self {
        Pack(V::load(from))
    }
    /// Writes as many lanes as there is room for.
    #[inline(always)]
    pub fn store(self, to: &mut [f64]) {
        self.0.store(to);
    }
    /// `self * a + b`, rounded once.
    #[inline(always)]
    pub fn mul_add(self, a: Self, b: Self) -> Self {
        Pack(self.0.mul_add(a.0, b.0))
    }
    /// Magnitude.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Pack(self.0.abs())
    }
    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Pack(self.0.sqrt())
    }
    /// `self` where the sign of `by` is negative, `other` elsewhere.
    #[inline(always)]
    pub fn where_negative(self, by: Self, other: Self) -> Self {
        Pack(self.0.where_negative(by.0, other.0))
    }
    /// The larger of two; `other` where one is not a number.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Pack(self.0.max(other.0))
    }
    /// The power of two at or below the magnitude; 0 for 0 and for subnormal numbers.
    #[inline(always)]
    pub fn binade(self) -> Self {
        Pack(self.0.binade())
    }
    /// The sum of the lanes, in a fixed order.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.0.sum()
    }
    /// The largest lane.
    #[inline(always)]
    pub fn largest(self) -> f64 {
        self.0.largest()
    }
    /// The rounded sum and its error, exactly (Knuth).
    #[inline(always)]
    pub fn two_sum(self, b: Self) -> (Self, Self) {
        let s = self + b;
        let t = s - self;
        (s, (self - (s - t)) + (b - t))
    }
    /// The rounded product and its error, exactly.
    #[inline(always)]
    pub fn two_product(self, b: Self) -> (Self, Self) {
        let p = self * b;
        (p, self.mul_add(b, -p))
    }
}

macro_rules! operators {
    ($($trait:ident $method:ident)*) => {$(
        impl<V: Lanes> $trait for Pack<V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self { Pack(self.0.$method(other.0)) }
        }
    )*};
}
operators!(Add add Sub sub Mul mul Div div);

/// Formulas mix lanes and numbers that are the same in all.
macro_rules! mixed_operators {
    ($($trait:ident $method:ident)*) => {$(
        impl<V: Lanes> $trait<f64> for Pack<V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: f64) -> Self { Pack(self.0.$method(V::splat(other))) }
        }
        impl<V: Lanes> $trait<Pack<V>> for f64 {
            type Output = Pack<V>;
            #[inline(always)]
            fn $method(self, other: Pack<V>) -> Pack<V> { Pack(V::splat(self).$method(other.0)) }
        }
    )*};
}
mixed_operators!(Add add Sub sub Mul mul Div div);

impl<V: Lanes> Neg for Pack<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Pack::splat(-0.0) - self
    }
}

const EXPONENT: u64 = 0x7ff0_0000_0000_0000;

/// Fused multiply-add that never asks the platform's C library, whose version could change bits.
#[inline(always)]
pub(crate) fn fused(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
        a.mul_add(b, c)
    } else {
        libm::fma(a, b, c)
    }
}

impl Lanes for [f64; 8] {
    const TILE: (usize, usize) = (1, 4);
    const PAIR_TILE: (usize, usize) = (1, 2);
    #[inline(always)]
    fn splat(x: f64) -> Self {
        [x; 8]
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> Self {
        [self[lane]; 8]
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        std::array::from_fn(|i| from.get(i).copied().unwrap_or(0.0))
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        for (to, x) in to.iter_mut().zip(self) {
            *to = x;
        }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        std::array::from_fn(|i| self[i] + other[i])
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        std::array::from_fn(|i| self[i] - other[i])
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        std::array::from_fn(|i| self[i] * other[i])
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        std::array::from_fn(|i| self[i] / other[i])
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        std::array::from_fn(|i| fused(self[i], a[i], b[i]))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        std::array::from_fn(|i| if self[i] > other[i] { self[i] } else { other[i] })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f64::abs)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }
    #[inline(always)]
    fn where_negative(self, by: Self, other: Self) -> Self {
        std::array::from_fn(|i| if by[i].is_sign_negative() { self[i] } else { other[i] })
    }
    #[inline(always)]
    fn binade(self) -> Self {
        self.map(|x| f64::from_bits(x.to_bits() & EXPONENT))
    }
    #[inline(always)]
    fn sum(self) -> f64 {
        let x = self;
        ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]))
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.into_iter().fold(f64::NEG_INFINITY, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn call<B: Body>(body: B) -> B::Output {
        portable(body)
    }
}

/// One lane: a single state goes through the formulas that are written for eight.
impl Lanes for f64 {
    const TILE: (usize, usize) = (1, 1);
    const PAIR_TILE: (usize, usize) = (1, 1);
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn lane(self, _: usize) -> Self {
        self
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        from.first().copied().unwrap_or(0.0)
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        if let Some(to) = to.first_mut() {
            *to = self;
        }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self + other
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self - other
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self * other
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self / other
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        fused(self, a, b)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn where_negative(self, by: Self, other: Self) -> Self {
        if by.is_sign_negative() { self } else { other }
    }
    #[inline(always)]
    fn binade(self) -> Self {
        f64::from_bits(self.to_bits() & EXPONENT)
    }
    #[inline(always)]
    fn sum(self) -> f64 {
        self
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self
    }
    #[inline(always)]
    fn call<B: Body>(body: B) -> B::Output {
        body.run::<f64>()
    }
}

/// The lanes of single states.
#[inline(always)]
pub fn singles(x: &[f64]) -> &[Pack<f64>] {
    // SAFETY: `Pack` is `repr(transparent)`.
    unsafe { std::slice::from_raw_parts(x.as_ptr().cast(), x.len()) }
}

/// The lanes of single states, to write.
#[inline(always)]
pub fn singles_mut(x: &mut [f64]) -> &mut [Pack<f64>] {
    // SAFETY: as in `singles`; the borrow is exclusive.
    unsafe { std::slice::from_raw_parts_mut(x.as_mut_ptr().cast(), x.len()) }
}

#[inline(never)]
fn portable<B: Body>(body: B) -> B::Output {
    body.run::<[f64; 8]>()
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{avx2, avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;
    use std::hint::black_box;
    use std::mem::MaybeUninit;

    use super::{Body, EXPONENT, Eight, Lanes};

    /// Runs a body with AVX2 and FMA.
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn avx2<B: Body>(body: B) -> B::Output {
        at_cache_line();
        body.run::<[Ymm; 2]>()
    }

    /// Runs a body with AVX-512.
    #[target_feature(enable = "avx512f,avx512dq,avx512vl,fma")]
    pub unsafe fn avx512<B: Body>(body: B) -> B::Output {
        at_cache_line();
        body.run::<Zmm>()
    }

    /// Makes the stack of the function it is in begin at a cache line. Compilers keep there what does not
    /// fit into registers, and where it lies across two lines kernels are a tenth slower, or not, by who
    /// calls them.
    #[inline(always)]
    fn at_cache_line() {
        black_box(&MaybeUninit::<Eight>::uninit());
    }

    #[derive(Clone, Copy)]
    #[repr(transparent)]
    pub struct Ymm(__m256d);

    #[derive(Clone, Copy)]
    #[repr(transparent)]
    pub struct Zmm(__m512d);

    macro_rules! binary {
        ($($method:ident $ymm:ident $zmm:ident)*) => {
            impl Ymm { $(
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: a `Ymm` exists only below `avx2`, whose caller found AVX2.
                    Ymm(unsafe { $ymm(self.0, other.0) })
                }
            )* }
            impl Zmm { $(
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: a `Zmm` exists only below `avx512`, whose caller found AVX-512.
                    Zmm(unsafe { $zmm(self.0, other.0) })
                }
            )* }
        };
    }
    binary! {
        plus _mm256_add_pd _mm512_add_pd
        minus _mm256_sub_pd _mm512_sub_pd
        times _mm256_mul_pd _mm512_mul_pd
        over _mm256_div_pd _mm512_div_pd
        larger _mm256_max_pd _mm512_max_pd
        masked _mm256_and_pd _mm512_and_pd
    }

    impl Zmm {
        #[inline(always)]
        fn halves(self) -> [Ymm; 2] {
            // SAFETY: a `Zmm` exists only below `avx512`, whose caller found AVX-512, hence AVX2.
            unsafe {
                [Ymm(_mm512_castpd512_pd256(self.0)), Ymm(_mm512_extractf64x4_pd::<1>(self.0))]
            }
        }
    }

    /// The mask of the first `count` of eight lanes begins at `8 - count`.
    const MASKS: [i64; 16] = [-1, -1, -1, -1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 0, 0, 0];

    #[inline(always)]
    fn mask(count: usize) -> [__m256i; 2] {
        let mask: &[i64; 8] = MASKS[8 - count..].first_chunk().expect("count is 8 at most");
        // SAFETY: reached only below `avx2`; eight integers are there to read.
        unsafe {
            [
                _mm256_loadu_si256(mask.as_ptr().cast()),
                _mm256_loadu_si256(mask[4..].as_ptr().cast()),
            ]
        }
    }

    #[inline(always)]
    unsafe fn high(four: __m256d) -> __m128d {
        // SAFETY: the caller is below `avx2`.
        unsafe { _mm256_extractf128_pd::<1>(four) }
    }

    impl Lanes for [Ymm; 2] {
        const TILE: (usize, usize) = (1, 6);
        const PAIR_TILE: (usize, usize) = (1, 1);
        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: reached only below `avx2`.
            [Ymm(unsafe { _mm256_set1_pd(x) }); 2]
        }
        #[inline(always)]
        fn lane(self, lane: usize) -> Self {
            let four = self[lane / 4].0;
            // SAFETY: reached only below `avx2`.
            let all = unsafe {
                match lane % 4 {
                    0 => _mm256_permute4x64_pd::<0x00>(four),
                    1 => _mm256_permute4x64_pd::<0x55>(four),
                    2 => _mm256_permute4x64_pd::<0xaa>(four),
                    _ => _mm256_permute4x64_pd::<0xff>(four),
                }
            };
            [Ymm(all); 2]
        }
        #[inline(always)]
        fn load(from: &[f64]) -> Self {
            let [low, high] = mask(from.len().min(8));
            let start = from.as_ptr();
            // SAFETY: reached only below `avx2`; lanes beyond the slice are masked, not read.
            unsafe {
                [
                    Ymm(_mm256_maskload_pd(start, low)),
                    Ymm(_mm256_maskload_pd(start.wrapping_add(4), high)),
                ]
            }
        }
        #[inline(always)]
        fn store(self, to: &mut [f64]) {
            let [low, high] = mask(to.len().min(8));
            let start = to.as_mut_ptr();
            // SAFETY: as in `load`; the borrow is exclusive.
            unsafe {
                _mm256_maskstore_pd(start, low, self[0].0);
                _mm256_maskstore_pd(start.wrapping_add(4), high, self[1].0);
            }
        }
        #[inline(always)]
        fn add(self, o: Self) -> Self {
            [self[0].plus(o[0]), self[1].plus(o[1])]
        }
        #[inline(always)]
        fn sub(self, o: Self) -> Self {
            [self[0].minus(o[0]), self[1].minus(o[1])]
        }
        #[inline(always)]
        fn mul(self, o: Self) -> Self {
            [self[0].times(o[0]), self[1].times(o[1])]
        }
        #[inline(always)]
        fn div(self, o: Self) -> Self {
            [self[0].over(o[0]), self[1].over(o[1])]
        }
        #[inline(always)]
        fn mul_add(self, a: Self, b: Self) -> Self {
            // SAFETY: reached only below `avx2`.
            unsafe {
                [
                    Ymm(_mm256_fmadd_pd(self[0].0, a[0].0, b[0].0)),
                    Ymm(_mm256_fmadd_pd(self[1].0, a[1].0, b[1].0)),
                ]
            }
        }
        #[inline(always)]
        fn max(self, o: Self) -> Self {
            [self[0].larger(o[0]), self[1].larger(o[1])]
        }
        #[inline(always)]
        fn abs(self) -> Self {
            let mask = Self::splat(f64::from_bits(i64::MAX as u64));
            [self[0].masked(mask[0]), self[1].masked(mask[1])]
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: reached only below `avx2`.
            self.map(|x| Ymm(unsafe { _mm256_sqrt_pd(x.0) }))
        }
        #[inline(always)]
        fn where_negative(self, by: Self, o: Self) -> Self {
            // SAFETY: reached only below `avx2`.
            unsafe {
                [
                    Ymm(_mm256_blendv_pd(o[0].0, self[0].0, by[0].0)),
                    Ymm(_mm256_blendv_pd(o[1].0, self[1].0, by[1].0)),
                ]
            }
        }
        #[inline(always)]
        fn binade(self) -> Self {
            let mask = Self::splat(f64::from_bits(EXPONENT));
            [self[0].masked(mask[0]), self[1].masked(mask[1])]
        }
        #[inline(always)]
        fn sum(self) -> f64 {
            let four = self[0].plus(self[1]);
            // SAFETY: reached only below `avx2`.
            unsafe {
                let two = _mm_add_pd(_mm256_castpd256_pd128(four.0), high(four.0));
                _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)))
            }
        }
        #[inline(always)]
        fn largest(self) -> f64 {
            let four = self[0].larger(self[1]);
            // SAFETY: reached only below `avx2`.
            unsafe {
                let two = _mm_max_pd(_mm256_castpd256_pd128(four.0), high(four.0));
                _mm_cvtsd_f64(_mm_max_sd(two, _mm_unpackhi_pd(two, two)))
            }
        }
        #[inline(always)]
        fn call<B: Body>(body: B) -> B::Output {
            // SAFETY: reached only below `avx2`.
            unsafe { avx2(body) }
        }
    }

    impl Lanes for Zmm {
        const TILE: (usize, usize) = (3, 8);
        const PAIR_TILE: (usize, usize) = (2, 4);
        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: reached only below `avx512`.
            Zmm(unsafe { _mm512_set1_pd(x) })
        }
        #[inline(always)]
        fn lane(self, lane: usize) -> Self {
            // SAFETY: reached only below `avx512`.
            Zmm(unsafe { _mm512_permutexvar_pd(_mm512_set1_epi64(lane as i64), self.0) })
        }
        #[inline(always)]
        fn load(from: &[f64]) -> Self {
            let mask = (0xff_u16 >> (8 - from.len().min(8))) as u8;
            // SAFETY: reached only below `avx512`; lanes beyond the slice are masked, not read.
            Zmm(unsafe { _mm512_maskz_loadu_pd(mask, from.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, to: &mut [f64]) {
            let mask = (0xff_u16 >> (8 - to.len().min(8))) as u8;
            // SAFETY: as in `load`; the borrow is exclusive.
            unsafe { _mm512_mask_storeu_pd(to.as_mut_ptr(), mask, self.0) }
        }
        #[inline(always)]
        fn add(self, o: Self) -> Self {
            self.plus(o)
        }
        #[inline(always)]
        fn sub(self, o: Self) -> Self {
            self.minus(o)
        }
        #[inline(always)]
        fn mul(self, o: Self) -> Self {
            self.times(o)
        }
        #[inline(always)]
        fn div(self, o: Self) -> Self {
            self.over(o)
        }
        #[inline(always)]
        fn mul_add(self, a: Self, b: Self) -> Self {
            // SAFETY: reached only below `avx512`.
            Zmm(unsafe { _mm512_fmadd_pd(self.0, a.0, b.0) })
        }
        #[inline(always)]
        fn max(self, o: Self) -> Self {
            self.larger(o)
        }
        #[inline(always)]
        fn abs(self) -> Self {
            self.masked(Self::splat(f64::from_bits(i64::MAX as u64)))
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: reached only below `avx512`.
            Zmm(unsafe { _mm512_sqrt_pd(self.0) })
        }
        #[inline(always)]
        fn where_negative(self, by: Self, o: Self) -> Self {
            // SAFETY: reached only below `avx512`.
            unsafe {
                let negative = _mm512_movepi64_mask(_mm512_castpd_si512(by.0));
                Zmm(_mm512_mask_blend_pd(negative, o.0, self.0))
            }
        }
        #[inline(always)]
        fn binade(self) -> Self {
            self.masked(Self::splat(f64::from_bits(EXPONENT)))
        }
        #[inline(always)]
        fn sum(self) -> f64 {
            self.halves().sum()
        }
        #[inline(always)]
        fn largest(self) -> f64 {
            self.halves().largest()
        }
        #[inline(always)]
        fn call<B: Body>(body: B) -> B::Output {
            // SAFETY: reached only below `avx512`.
            unsafe { avx512(body) }
        }
    }
}
