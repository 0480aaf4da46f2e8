//! Matrices as unevaluated sums `hi + lo` of two matrices of doubles: 106 bits.

use super::dense::{self, Watch};
use super::kernel::{
    Combinations, Depth, Eight, Layout, PairProduct, Slices, SmallPairProduct, dispatch,
    doubles_mut, slice_bits,
};
use super::twofold;
use crate::error::Result;

/// A matrix of pairs, to read.
#[derive(Clone, Copy)]
pub struct Pair<'a> {
    /// Leading parts.
    pub hi: &'a [Eight],
    /// Remainders, below half a unit in the last place of the leading parts.
    pub lo: &'a [Eight],
}

/// A matrix of pairs, to write.
pub struct PairMut<'a> {
    /// Leading parts.
    pub hi: &'a mut [Eight],
    /// Remainders.
    pub lo: &'a mut [Eight],
}

impl PairMut<'_> {
    /// The matrix, to read.
    pub fn view(&self) -> Pair<'_> {
        Pair { hi: self.hi, lo: self.lo }
    }
}

/// Products of pairs of one size and depth, with the memory for their slices.
pub struct PairEngine<'a> {
    layout: Layout,
    depth: Depth,
    bits: i32,
    left: [&'a mut [Eight]; 3],
    right: [&'a mut [Eight]; 4],
}

impl<'a> PairEngine<'a> {
    /// Matrices of work space an engine needs.
    pub const fn pieces(depth: Depth) -> usize {
        match depth {
            Depth::Two => 4,
            Depth::Three => 7,
        }
    }

    /// An engine working in `memory`: [`pieces`](Self::pieces) matrices.
    pub fn new(layout: Layout, depth: Depth, memory: &'a mut [Eight]) -> Self {
        let packs = layout.packs(layout.rows);
        let (mut left, mut right): ([&mut [Eight]; 3], [&mut [Eight]; 4]) = Default::default();
        let mut rest = memory.chunks_exact_mut(packs);
        let (lefts, rights) = if depth == Depth::Two { (2, 2) } else { (3, 4) };
        for slice in left[..lefts].iter_mut().chain(&mut right[..rights]) {
            *slice = rest.next().expect("work space of `pieces` matrices");
        }
        PairEngine { layout, depth, bits: slice_bits(layout.rows), left, right }
    }

    /// `C = A B (+ alpha D)`, `alpha` a power of two. Large products look outside.
    pub fn multiply(
        &mut self,
        a: Pair,
        b: Pair,
        add: Option<(f64, Pair)>,
        c: &mut PairMut,
        watch: &mut Watch,
    ) -> Result<()> {
        let rows = self.layout.rows;
        if self.depth == Depth::Two && rows <= 8 && b.hi.len() == self.layout.packs(rows) {
            dispatch(SmallPairProduct {
                rows,
                a: [a.hi, a.lo],
                b: [b.hi, b.lo],
                add: add.map(|(alpha, d)| (alpha, [d.hi, d.lo])),
                c: [&mut *c.hi, &mut *c.lo],
            });
            return Ok(());
        }
        let (layout, bits, depth) = (self.layout, self.bits, self.depth);
        let columns = b.hi.len() / layout.stride;
        let [one, two, three] = self.left.each_mut().map(|slice| &mut **slice);
        let out = [one, two, three, &mut []];
        let (hi, lo) = (a.hi, a.lo);
        dispatch(Slices { rows: true, layout, columns: rows, bits, depth, hi, lo, out });
        let out = self.right.each_mut().map(|slice| &mut **slice);
        dispatch(Slices { rows: false, layout, columns, bits, depth, hi: b.hi, lo: b.lo, out });
        let a = [&*self.left[0], &*self.left[1], &*self.left[2]];
        let slices = self.right.each_ref().map(|slice| &**slice);
        let whole = c.hi.len();
        let long = layout.rows >= LONG;
        let panel = if long { layout.packs(columns_between_looks(layout.rows)) } else { whole };
        let mut from = 0;
        while from < whole {
            if long {
                watch()?;
            }
            let to = whole.min(from + panel);
            dispatch(PairProduct {
                layout,
                columns: (to - from) / layout.stride,
                depth,
                a,
                b: slices.map(|slice| slice.get(from..).unwrap_or_default()),
                b_hi: &b.hi[from..],
                add: add.map(|(alpha, d)| (alpha, &d.hi[from..], &d.lo[from..])),
                hi: &mut c.hi[from..to],
                lo: &mut c.lo[from..to],
            });
            from = to;
        }
        Ok(())
    }
}

/// Rows from which a product takes long enough to look outside: one of pairs is as much work as several
/// of doubles.
const LONG: usize = dense::LONG / 4;

/// Columns that are multiplied between two looks outside.
fn columns_between_looks(rows: usize) -> usize {
    (dense::panel_columns(rows) / 2).next_multiple_of(24)
}

/// `outs[k] = sum of c[k][i] X[i]`, coefficients pairs too.
pub fn combine<const N: usize, const K: usize>(
    x: [Pair; N],
    c: [[[f64; 2]; N]; K],
    outs: [PairMut; K],
) {
    dispatch(Combinations {
        x: x.map(|x| (x.hi, x.lo)),
        c,
        outs: outs.map(|out| (out.hi, out.lo)),
    });
}

/// `X <- X + c I`.
pub fn add_diagonal(layout: Layout, c: [f64; 2], [hi, lo]: [&mut [Eight]; 2]) {
    let step = layout.doubles() + 1;
    let hi = doubles_mut(hi).iter_mut().step_by(step).take(layout.rows);
    let lo = doubles_mut(lo).iter_mut().step_by(step).take(layout.rows);
    for (hi, lo) in hi.zip(lo) {
        [*hi, *lo] = twofold::sum(c, [*hi, *lo]);
    }
}

/// `X <- X + X^T`.
pub fn add_transpose(layout: Layout, [hi, lo]: [&mut [Eight]; 2]) {
    let (hi, lo, ld) = (doubles_mut(hi), doubles_mut(lo), layout.doubles());
    for j in 0..layout.rows {
        for i in 0..=j {
            let (here, there) = (j * ld + i, i * ld + j);
            let sum = twofold::sum([hi[here], lo[here]], [hi[there], lo[there]]);
            [hi[here], lo[here]] = sum;
            [hi[there], lo[there]] = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn products_that_take_long_look_outside_and_end_where_that_fails() {
        for (rows, looks) in [(LONG - 1, false), (LONG, true), (500, true)] {
            let layout = Layout::new(rows);
            let packs = layout.packs(rows);
            let (a, mut hi, mut lo) =
                (vec![Eight([0.5; 8]); packs], vec![Eight::ZERO; packs], vec![Eight::ZERO; packs]);
            let zero = vec![Eight::ZERO; packs];
            let mut memory = vec![Eight::ZERO; packs * PairEngine::pieces(Depth::Two)];
            let mut engine = PairEngine::new(layout, Depth::Two, &mut memory);
            let x = Pair { hi: &a, lo: &zero };
            let mut seen = 0;
            let done =
                engine.multiply(x, x, None, &mut PairMut { hi: &mut hi, lo: &mut lo }, &mut || {
                    seen += 1;
                    if rows == 500 { Err(Error::argument("enough")) } else { Ok(()) }
                });
            assert_eq!((seen > 0, done.is_err()), (looks, rows == 500), "{rows}");
        }
    }
}
