//! Matrices of doubles in packed columns, and the operations exponentials are made of.

use super::kernel::{ColumnSums, Eight, Layout, Product, Sum, dispatch, doubles, doubles_mut};
use crate::error::{Error, Result};

/// A look at the outside world from within long work: an error ends the work.
pub type Watch<'a> = dyn FnMut() -> Result<()> + 'a;

/// Zeroed memory for `packs` packs, or an error that says how much was asked for.
pub fn zeros(packs: usize) -> Result<Vec<Eight>> {
    let mut memory = Vec::new();
    memory.try_reserve_exact(packs).map_err(|_| {
        Error::memory(format!("{:.3e} bytes of work space are not to be had", 64.0 * packs as f64))
    })?;
    memory.resize(packs, Eight::ZERO);
    Ok(memory)
}

/// Lends zeroed scratch memory: from the stack where it is small.
#[inline]
pub fn with_scratch<R>(packs: usize, run: impl FnOnce(&mut [Eight]) -> Result<R>) -> Result<R> {
    match packs {
        0..=48 => run(&mut [Eight::ZERO; 48][..packs]),
        49..=96 => run(&mut [Eight::ZERO; 96][..packs]),
        97..=192 => run(&mut [Eight::ZERO; 192][..packs]),
        193..=512 => run(&mut [Eight::ZERO; 512][..packs]),
        _ => run(&mut zeros(packs)?),
    }
}

/// Cuts `N` pieces of `packs` packs off the front of a piece of memory; pieces it has no room for
/// are empty.
pub fn pieces<const N: usize>(memory: &mut [Eight], packs: usize) -> [&mut [Eight]; N] {
    let mut rest = memory.chunks_exact_mut(packs);
    std::array::from_fn(|_| rest.next().unwrap_or_default())
}

/// Copies plain contiguous columns into packed ones.
pub fn pack(layout: Layout, plain: &[f64], packed: &mut [Eight]) {
    for (column, packed) in
        plain.chunks_exact(layout.rows).zip(packed.chunks_exact_mut(layout.stride))
    {
        doubles_mut(packed)[..layout.rows].copy_from_slice(column);
    }
}

/// Copies packed columns into plain contiguous ones.
pub fn unpack(layout: Layout, packed: &[Eight], plain: &mut [f64]) {
    for (column, packed) in
        plain.chunks_exact_mut(layout.rows).zip(packed.chunks_exact(layout.stride))
    {
        column.copy_from_slice(&doubles(packed)[..layout.rows]);
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
    let panel = layout.packs(panel_columns(layout.rows));
    if c.len() <= panel {
        let columns = c.len() / layout.stride;
        dispatch(Product { layout, columns, a, b, add, c });
        return Ok(());
    }
    for (i, c) in c.chunks_mut(panel).enumerate() {
        watch()?;
        let (b, columns) = (&b[i * panel..], c.len() / layout.stride);
        let add = add.map(|(alpha, d)| (alpha, &d[i * panel..]));
        dispatch(Product { layout, columns, a, b, add, c });
    }
    Ok(())
}

/// Columns that are multiplied between two looks outside: a few milliseconds of work.
pub fn panel_columns(rows: usize) -> usize {
    ((1 << 28) / (rows * rows).max(1)).max(1).next_multiple_of(24)
}

/// `out = sum of c X`.
#[inline]
pub fn sum<const N: usize>(terms: [(f64, &[Eight]); N], out: &mut [Eight]) {
    dispatch(Sum { terms, out });
}

/// 1-norms of `T` and of `I + T`; not a number where an entry is not.
#[inline]
pub fn norms(layout: Layout, t: &[Eight]) -> [f64; 2] {
    dispatch(ColumnSums { layout, t })
}

/// Multiplies by `2^exponent`, `times` times over: exact but for underflow, and free of spurious
/// overflow where `2^(exponent times)` is not a double.
pub fn scale(x: &mut [Eight], exponent: i32, times: u32) {
    if exponent == 0 {
        return;
    }
    for _ in 0..times {
        let (half, rest) = (exponent / 2, exponent - exponent / 2);
        for factor in [power_of_two(half), power_of_two(rest)] {
            for x in doubles_mut(x) {
                *x *= factor;
            }
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

/// Adds the identity.
pub fn add_identity(layout: Layout, x: &mut [Eight]) {
    let x = doubles_mut(x);
    for j in 0..layout.rows {
        x[j * layout.doubles() + j] += 1.0;
    }
}

/// Whether all entries are finite.
pub fn is_finite(x: &[Eight]) -> bool {
    doubles(x).iter().all(|x| x.is_finite())
}
