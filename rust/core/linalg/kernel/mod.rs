//! Kernels that run at the best instruction set of the machine and give the same bits at every one.
//!
//! A kernel is a [`Body`]: a struct of its arguments and one generic `run`, written once over the
//! eight lanes of a [`Pack`]. [`dispatch`] picks the [`Level`] at run time. The vector width only
//! groups operations whose order the body has fixed, so no level changes a result.
//!
//! This folder is the only place of the core with `unsafe`.

mod elementwise;
mod gemm;
mod math;
mod pack;
mod pair;
mod stepping;

use std::sync::atomic::{AtomicU8, Ordering};

pub use elementwise::{ColumnSums, Finite, Maxima, PackColumns, Scale, Sides, Sums, UnpackColumns};
pub use gemm::{Product, small_product};
pub(crate) use pack::fused;
pub use pack::{Lanes, Pack, packs, packs_mut, singles, singles_mut};
pub use pair::{
    Combinations, Depth, PairProduct, Slices, SmallPairProduct, slice_bits, small_combination,
};
pub use stepping::{CutPropagator, CutStates};

/// Eight doubles, one cache line: the unit in which matrices and batches are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Eight(pub [f64; 8]);

impl Eight {
    /// Eight zeros.
    pub const ZERO: Eight = Eight([0.0; 8]);
}

/// Where the columns of a matrix lie: each starts at a whole pack and is padded to whole packs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Rows of the matrix.
    pub rows: usize,
    /// Packs a column fills.
    pub height: usize,
    /// Packs from one column to the next: odd for large matrices, so that columns do not crowd
    /// into the same sets of the cache.
    pub stride: usize,
}

impl Layout {
    /// The layout of matrices with `rows` rows.
    pub fn new(rows: usize) -> Layout {
        let height = rows.div_ceil(8);
        let stride = if height >= 8 { height | 1 } else { height };
        Layout { rows, height, stride }
    }

    /// Packs that `columns` columns take.
    pub fn packs(self, columns: usize) -> usize {
        self.stride * columns
    }

    /// Doubles from one column to the next.
    pub fn doubles(self) -> usize {
        8 * self.stride
    }
}

/// The same memory as plain doubles.
pub fn doubles(packs: &[Eight]) -> &[f64] {
    // SAFETY: `Eight` is `repr(C)` around `[f64; 8]`, so `n` of them are `8 n` doubles.
    unsafe { std::slice::from_raw_parts(packs.as_ptr().cast(), 8 * packs.len()) }
}

/// The same memory as plain doubles, to write.
pub fn doubles_mut(packs: &mut [Eight]) -> &mut [f64] {
    // SAFETY: as in `doubles`; the borrow is exclusive.
    unsafe { std::slice::from_raw_parts_mut(packs.as_mut_ptr().cast(), 8 * packs.len()) }
}

/// Instruction sets the kernels are compiled for, slowest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Level {
    /// Any machine. Without fused multiply-add in hardware it is done in software: slow, same bits.
    Portable = 1,
    /// AVX2 and FMA: x86-64 machines since 2013.
    Avx2 = 2,
    /// AVX-512 F, DQ and VL.
    Avx512 = 3,
}

impl Level {
    /// All levels, slowest first.
    pub const ALL: [Level; 3] = [Level::Portable, Level::Avx2, Level::Avx512];

    /// The name users see.
    pub fn name(self) -> &'static str {
        match self {
            Level::Portable => "portable",
            Level::Avx2 => "avx2",
            Level::Avx512 => "avx512",
        }
    }

    fn from_code(code: u8) -> Level {
        match code {
            3 => Level::Avx512,
            2 => Level::Avx2,
            _ => Level::Portable,
        }
    }
}

/// The best level of this machine.
pub fn best() -> Level {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("fma")
        {
            return Level::Avx512;
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return Level::Avx2;
        }
    }
    Level::Portable
}

static LEVEL: AtomicU8 = AtomicU8::new(0);

/// The level in use.
#[inline]
pub fn level() -> Level {
    match LEVEL.load(Ordering::Relaxed) {
        0 => force(None),
        code => Level::from_code(code),
    }
}

/// Uses `wanted` from now on, in every thread (`None`: the best); returns what is in use then.
///
/// A level the machine does not have leaves the best one it has. Since all levels give the same
/// bits, changing it while other threads compute does no harm.
pub fn force(wanted: Option<Level>) -> Level {
    let level = wanted.map_or(best(), |wanted| wanted.min(best()));
    LEVEL.store(level as u8, Ordering::Relaxed);
    level
}

/// A computation written once for all levels.
///
/// `run` and every function it calls with a `Pack` must be `#[inline(always)]`: what is not inlined
/// is compiled for the baseline and runs ten times slower, with the same bits.
pub trait Body {
    /// What the computation returns.
    type Output;
    /// The computation.
    fn run<V: Lanes>(self) -> Self::Output;
}

/// Runs a body at the level in use.
#[inline]
pub fn dispatch<B: Body>(body: B) -> B::Output {
    match level() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `level()` never exceeds `best()`, which found the features on this machine.
        Level::Avx512 => unsafe { pack::avx512(body) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Level::Avx2 => unsafe { pack::avx2(body) },
        _ => body.run::<[f64; 8]>(),
    }
}
