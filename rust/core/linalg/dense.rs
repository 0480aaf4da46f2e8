//! Matrices of doubles in packed columns, and the operations exponentials are made of.

use std::cell::Cell;

use super::kernel::{
    ColumnSums, Eight, Layout, PackColumns, Product, Scale, Sums, UnpackColumns, dispatch,
    doubles_mut,
};
use crate::error::{Error, Result};

/// A look at the outside world from within long work: an error ends the work.
pub type Watch<'a> = dyn FnMut() -> Result<()> + 'a;

/// Zeroed memory for `packs` packs, or an error that says how much was asked for.
pub fn zeros(packs: usize) -> Result<Vec<Eight>> {
    work_space(packs, &mut || Ok(()))
}

/// Packs whose first touch takes some milliseconds.
const TOUCHED: usize = 1 << 18;

/// As [`zeros`], looking outside in between: the first touch of a gigabyte takes a second.
pub fn work_space(packs: usize, watch: &mut Watch) -> Result<Vec<Eight>> {
    let mut memory = Vec::new();
    memory.try_reserve_exact(packs).map_err(|_| {
        Error::memory(format!("{:.3e} bytes of work space are not to be had", 64.0 * packs as f64))
    })?;
    while memory.len() < packs {
        watch()?;
        memory.resize(packs.min(memory.len() + TOUCHED), Eight::ZERO);
    }
    Ok(memory)
}

thread_local! {
    /// Scratch kept from call to call: small exponentials would spend a tenth of their time on it.
    static SCRATCH: Cell<Vec<Eight>> = const { Cell::new(Vec::new()) };
}

/// Packs of scratch that are kept at most: 1 MiB a thread.
const KEPT: usize = 1 << 14;

/// Lends scratch memory, which holds whatever an earlier call has left in it.
#[inline]
pub fn with_scratch<R>(
    packs: usize,
    watch: &mut Watch,
    run: impl FnOnce(&mut [Eight], &mut Watch) -> Result<R>,
) -> Result<R> {
    if packs > KEPT {
        return run(&mut work_space(packs, watch)?, watch);
    }
    // Taken, not borrowed: a nested call finds it empty and makes its own.
    let mut memory = SCRATCH.take();
    if memory.len() < packs {
        memory.resize(packs, Eight::ZERO);
    }
    let result = run(&mut memory[..packs], watch);
    SCRATCH.set(memory);
    result
}

/// Cuts `N` pieces of `packs` packs off the front of a piece of memory; pieces it has no room for
/// are empty.
pub fn pieces<const N: usize>(memory: &mut [Eight], packs: usize) -> [&mut [Eight]; N] {
    let mut rest = memory.chunks_exact_mut(packs);
    std::array::from_fn(|_| rest.next().unwrap_or_default())
}

/// Copies plain contiguous columns into packed ones, with zeros in the rows that pad them.
#[inline]
pub fn pack(layout: Layout, plain: &[f64], packed: &mut [Eight]) {
    dispatch(PackColumns { layout, plain, packed });
}

/// Copies packed columns into plain contiguous ones; returns whether all numbers are finite.
#[inline]
pub fn unpack(layout: Layout, packed: &[Eight], plain: &mut [f64]) -> bool {
    dispatch(UnpackColumns { layout, packed, plain })
}

/// Exchanges rows and columns.
pub fn transpose(layout: Layout, x: &mut [Eight]) {
    let (m, ld) = (layout.rows, layout.doubles());
    let x = doubles_mut(x);
    for j in 0..m {
        for i in 0..j {
            x.swap(j * ld + i, i * ld + j);
        }
    }
}

/// `C = A B (+ alpha D)` with `A` square. Large products look outside between panels of columns.
#[inline]
pub fn multiply(
    layout: Layout,
    a: &[Eight],
    b: &[Eight],
    add: Option<(f64, &[Eight])>,
    c: &mut [Eight],
    watch: &mut Watch,
) -> Result<()> {
    if layout.rows < LONG {
        let columns = c.len() / layout.stride;
        dispatch(Product { layout, columns, a, b, add, c });
        return Ok(());
    }
    let panel = layout.packs(panel_columns(layout.rows));
    for (i, c) in c.chunks_mut(panel).enumerate() {
        watch()?;
        let (b, columns) = (&b[i * panel..], c.len() / layout.stride);
        let add = add.map(|(alpha, d)| (alpha, &d[i * panel..]));
        dispatch(Product { layout, columns, a, b, add, c });
    }
    Ok(())
}

/// Rows from which a product takes long enough to look outside in its midst.
pub const LONG: usize = 256;

/// Columns that are multiplied between two looks outside: a few milliseconds of work.
pub fn panel_columns(rows: usize) -> usize {
    ((1 << 28) / (rows * rows).max(1)).max(1).next_multiple_of(24)
}

/// `outs[k] = sum of c[k][i] X[i]`.
#[inline]
pub fn sums<const N: usize, const K: usize>(
    x: [&[Eight]; N],
    c: [[f64; N]; K],
    outs: [&mut [Eight]; K],
) {
    dispatch(Sums { x, c, outs });
}

/// 1-norms of `T` and of `I + T`; not a number where an entry is not.
#[inline]
pub fn norms(layout: Layout, t: &[Eight]) -> [f64; 2] {
    dispatch(ColumnSums { layout, t })
}

/// Multiplies by `2^exponent`, `times` times over: exact but for underflow, and free of spurious
/// overflow where `2^(exponent times)` is not a double.
#[inline]
pub fn scale(x: &mut [Eight], exponent: i32, times: i32) {
    if exponent == 0 {
        return;
    }
    if (exponent * times).abs() <= 1000 {
        return dispatch(Scale { x, factor: power_of_two(exponent * times) });
    }
    for _ in 0..times {
        for part in [exponent / 2, exponent - exponent / 2] {
            dispatch(Scale { x: &mut *x, factor: power_of_two(part) });
        }
    }
}

/// `2^exponent` for `-1022 <= exponent <= 1023`.
pub fn power_of_two(exponent: i32) -> f64 {
    debug_assert!((-1022..=1023).contains(&exponent));
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// The smallest `e` with `x <= 2^e`, for positive normal `x`.
pub fn exponent_above(x: f64) -> i32 {
    let bits = x.to_bits();
    let floor = ((bits >> 52) & 0x7ff) as i32 - 1023;
    if bits & ((1 << 52) - 1) == 0 { floor } else { floor + 1 }
}

/// Whether all entries are finite.
pub fn is_finite(x: &[f64]) -> bool {
    // Without an early end, so that it vectorises.
    !x.iter().fold(false, |found, x| found | !x.is_finite())
}
