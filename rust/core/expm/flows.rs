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
use crate::linalg::kernel::{Depth, Eight, Layout, doubles};
use crate::linalg::pair::{Pair, PairEngine, PairMut, add_transpose};
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

/// Energy flows of states over one step: forms, kept in pairs.
///
/// On a stiff beam the entries of a form exceed what a smooth state makes of them by ten orders.
pub struct Flows {
    layout: Layout,
    /// Leading parts and remainders, one form after the other.
    forms: [Vec<Eight>; 2],
}

impl Flows {
    /// For each symmetric form of `forms`, its integral over `tau` (signed) along `z' = A z`; all
    /// matrices row by row.
    ///
    /// # Errors
    /// Those of [`exponential`].
    pub fn new(
        rows: usize,
        a: &[f64],
        tau: f64,
        forms: &[f64],
        watch: &mut Watch,
    ) -> Result<Flows> {
        let layout = Layout::new(rows);
        let forms = integrals(layout, a, tau, forms, watch)?;
        Ok(Flows { layout, forms })
    }

    /// Numbers in a state.
    pub fn rows(&self) -> usize {
        self.layout.rows
    }

    /// Number of forms.
    pub fn count(&self) -> usize {
        self.forms[0].len() / self.layout.packs(self.layout.rows)
    }

    /// What each form makes of each state, form by form in `totals`; summed in pairs, rounded once.
    ///
    /// # Errors
    /// [`Error::Overflow`](crate::Error::Overflow); what `watch` reports.
    pub fn totals(&self, states: &[f64], totals: &mut [f64], watch: &mut Watch) -> Result<()> {
        let Flows { layout, forms: [hi, lo] } = self;
        let (rows, ld) = (layout.rows, layout.doubles());
        let count = states.len() / rows;
        let square = layout.packs(rows);
        // Columns at a time: the engine slices no more than a square.
        let packs = layout.packs(rows.min(count));
        let room = 4 * packs + PairEngine::pieces(Depth::Two) * square;
        let mut memory = dense::work_space(room, watch)?;
        let (work, slices) = memory.split_at_mut(4 * packs);
        let mut engine = PairEngine::new(*layout, Depth::Two, slices);
        for (block, states) in states.chunks(rows * rows).enumerate() {
            let columns = states.len() / rows;
            let [x, zero, y_hi, y_lo, ..] = dense::pieces::<4>(work, packs)
                .map(|piece| piece.split_at_mut(layout.packs(columns)).0);
            dense::pack(*layout, states, x);
            for (form, (hi, lo)) in hi.chunks_exact(square).zip(lo.chunks_exact(square)).enumerate()
            {
                let [left, right] = [Pair { hi, lo }, Pair { hi: x, lo: zero }];
                let mut out = PairMut { hi: y_hi, lo: y_lo };
                engine.multiply(left, right, None, &mut out, watch)?;
                let out = (doubles(y_hi).chunks_exact(ld)).zip(doubles(y_lo).chunks_exact(ld));
                let totals = &mut totals[form * count + block * rows..][..columns];
                for ((total, state), (hi, lo)) in
                    totals.iter_mut().zip(states.chunks_exact(rows)).zip(out)
                {
                    let terms = state.iter().zip(hi.iter().zip(lo));
                    *total = terms.fold([0.0; 2], |sum, (x, (hi, lo))| {
                        twofold::sum(sum, twofold::times([*hi, *lo], *x))
                    })[0];
                }
                if !dense::is_finite(totals) {
                    return Err(super::overflow());
                }
            }
        }
        Ok(())
    }
}

/// Leading parts and remainders of the integrals.
fn integrals(
    layout: Layout,
    a: &[f64],
    tau: f64,
    forms: &[f64],
    watch: &mut Watch,
) -> Result<[Vec<Eight>; 2]> {
    let rows = layout.rows;
    let (packs, size) = (layout.packs(rows), rows * rows);
    let count = forms.len() / size;
    let slots = FIRST + count;
    let mut hi = dense::work_space(count * packs, watch)?;
    let mut lo = dense::work_space(count * packs, watch)?;
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
    let found = hi.chunks_exact_mut(packs).zip(lo.chunks_exact_mut(packs));
    for (at, (hi, lo)) in found.enumerate() {
        let form = x.matrix(FIRST + at);
        hi.copy_from_slice(form.hi);
        lo.copy_from_slice(form.lo);
        if !dense::is_finite(doubles(hi)) {
            return Err(super::overflow());
        }
    }
    Ok([hi, lo])
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
