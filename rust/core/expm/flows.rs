//! Integrals of quadratic forms along a linear motion: the integral of `exp(A s)^T Q exp(A s)` over a
//! step, for energy flows.
//!
//! Summed over a short interval and doubled with the motion, `N(2 t) = N(t) + W^T N(t) W`, in pairs:
//! a flow is the small difference of what stiff coordinates hold, and in doubles the rounding of
//! the doublings would show.

use super::arithmetic::{Arithmetic, Pairs, SLOTS, Slot};
use super::{Exponential, Recipe, exponential};
use crate::error::Result;
use crate::linalg::dense::{self, Watch, exponent_above};
use crate::linalg::kernel::{Depth, Eight, Layout};
use crate::linalg::pair::add_transpose;
use crate::linalg::twofold;

/// `A` times the short interval, then `T`.
const T: Slot = 0;
const TRANSPOSED: Slot = 1;
const TERM: Slot = 2;
const SPARE: Slot = 3;
const FIRST: Slot = 4;

/// Forms at most.
pub const MOST_FORMS: usize = SLOTS - FIRST;

/// Binary logarithm of the norm of the short interval, and the terms that leave `2^-74` there.
const SHORT: i32 = -2;
const TERMS: usize = 18;

/// For each symmetric form of `forms`, its integral over `tau` (signed) along `z' = A z`; all
/// matrices row by row, results rounded once.
///
/// # Errors
/// Those of [`exponential`].
pub fn flows(
    rows: usize,
    a: &[f64],
    tau: f64,
    forms: &[f64],
    outs: &mut [f64],
    watch: &mut Watch,
) -> Result<()> {
    let layout = Layout::new(rows);
    let (packs, size) = (layout.packs(rows), rows * rows);
    let count = forms.len() / size;
    let slots = FIRST + count;
    let mut memory = dense::work_space(packs * Pairs::matrices(slots, Depth::Two), watch)?;
    let mut norm = vec![0.0; rows];
    for row in a.chunks_exact(rows) {
        norm.iter_mut().zip(row).for_each(|(sum, x)| *sum += (tau * x).abs());
    }
    let norm = norm.into_iter().fold(0.0, f64::max);
    let doublings = match norm >= f64::MIN_POSITIVE {
        true => (exponent_above(norm) - SHORT).max(0),
        false => 0,
    };
    let short = tau * 0.5_f64.powi(doublings);
    let Exponential { hi: mut t_hi, lo: mut t_lo, .. } =
        exponential(rows, Recipe::EXACT, a, short, true, watch)?;
    dense::transpose(layout, &mut t_hi);
    dense::transpose(layout, &mut t_lo);
    let mut x = Pairs::new(layout, slots, Depth::Two, &mut memory, watch);
    // The interval's length comes in at the end of the series; here the product is rounded in pairs.
    let scaled = x.matrix(T);
    dense::pack(layout, a, scaled.hi);
    scaled.lo.fill(Eight::ZERO);
    dense::transpose(layout, scaled.hi);
    x.sum([([short, 0.0], T)], SPARE);
    x.swap(T, SPARE);
    for (at, form) in forms.chunks_exact(size).enumerate() {
        dense::pack(layout, form, x.matrix(TERM).hi);
        x.matrix(TERM).lo.fill(Eight::ZERO);
        series(&mut x, layout, FIRST + at, short)?;
    }
    x.matrix(T).hi.copy_from_slice(&t_hi);
    x.matrix(T).lo.copy_from_slice(&t_lo);
    for _ in 0..doublings {
        x.copy_transposed(T, TRANSPOSED);
        for slot in FIRST..slots {
            // N W, then W^T N W + N.
            x.multiply(slot, T, Some((1.0, slot)), TERM)?;
            x.multiply(TRANSPOSED, TERM, Some((1.0, TERM)), SPARE)?;
            x.sum([([1.0, 0.0], slot), ([1.0, 0.0], SPARE)], TERM);
            x.swap(slot, TERM);
        }
        x.square(T, Some(2.0), SPARE)?;
    }
    for (at, out) in outs.chunks_exact_mut(size).enumerate() {
        if !dense::unpack(layout, x.matrix(FIRST + at).hi, out) {
            return Err(super::overflow());
        }
    }
    Ok(())
}

/// `short` times the sum of `L^j(Q)/(j+1)!`, `L(X) = X A + (X A)^T`, of the form in its slot.
fn series(x: &mut Pairs, layout: Layout, total: Slot, short: f64) -> Result<()> {
    x.sum([([1.0, 0.0], TERM)], total);
    for j in 1..TERMS {
        x.multiply(TERM, T, None, SPARE)?;
        let product = x.matrix(SPARE);
        add_transpose(layout, [product.hi, product.lo]);
        x.sum([(twofold::ratio(1.0, (j + 1) as f64), SPARE)], TERM);
        x.sum([([1.0, 0.0], total), ([1.0, 0.0], TERM)], SPARE);
        x.swap(total, SPARE);
    }
    x.sum([([short, 0.0], total)], SPARE);
    x.swap(total, SPARE);
    Ok(())
}
