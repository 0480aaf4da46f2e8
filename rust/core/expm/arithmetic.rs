//! The matrix operations exponentials are written in, over doubles or over pairs of doubles.
//!
//! Matrices live in numbered slots of one piece of work space, so a scheme reads as its formulas do:
//! `x.multiply(A, A, None, A2)?`. A scheme is written once and runs in either arithmetic.

use super::coefficients as table;
use super::lu::Lu;
use crate::error::Result;
use crate::linalg::dense::{self, Watch};
use crate::linalg::kernel::{Depth, Eight, Layout, doubles, doubles_mut};
use crate::linalg::pair::{self, Pair, PairEngine, PairMut};
use crate::linalg::twofold;

/// Number of a matrix.
pub type Slot = usize;

/// Most slots of a work space.
pub const SLOTS: usize = 12;

/// Largest 1-norms at which a scheme is exact to rounding.
pub struct Thresholds {
    /// Taylor polynomial of degree 4, two products.
    pub taylor4: f64,
    /// Taylor polynomial of degree 8, three products.
    pub taylor8: f64,
    /// SID 15+, four products.
    pub sid15: f64,
    /// SID 21+, five products.
    pub sid21: f64,
}

impl Thresholds {
    /// In doubles.
    pub const DOUBLES: Thresholds = Thresholds {
        taylor4: table::THETA_TAYLOR4,
        taylor8: table::THETA_TAYLOR8,
        sid15: table::THETA_SID15,
        sid21: table::THETA_SID21,
    };

    /// In pairs, where only SID 21+ is of use.
    pub const fn pairs(sid21: f64) -> Thresholds {
        Thresholds { taylor4: 0.0, taylor8: 0.0, sid15: 0.0, sid21 }
    }
}

/// Operations on matrices in slots. A result never shares a slot with what it is made of.
pub trait Arithmetic {
    /// Where columns lie.
    fn layout(&self) -> Layout;
    /// Largest norms for the schemes of this arithmetic.
    fn thresholds(&self) -> Thresholds;
    /// `C = A B (+ alpha D)`, `alpha` a power of two.
    fn multiply(&mut self, a: Slot, b: Slot, add: Option<(f64, Slot)>, c: Slot) -> Result<()>;
    /// `X <- X X (+ alpha X)`; spoils `spare`.
    #[inline(always)]
    fn square(&mut self, x: Slot, alpha: Option<f64>, spare: Slot) -> Result<()> {
        self.multiply(x, x, alpha.map(|alpha| (alpha, x)), spare)?;
        self.swap(x, spare);
        Ok(())
    }
    /// `outs[k] = sum of c[k][i] X[i]`, coefficients as pairs; the sums share one pass over memory.
    fn sums<const N: usize, const K: usize>(
        &mut self,
        x: [Slot; N],
        c: [[[f64; 2]; N]; K],
        outs: [Slot; K],
    );
    /// One sum.
    #[inline]
    fn sum<const N: usize>(&mut self, terms: [([f64; 2], Slot); N], out: Slot) {
        self.sums(terms.map(|(_, x)| x), [terms.map(|(c, _)| c)], [out]);
    }
    /// `X <- X + c I`.
    fn add_diagonal(&mut self, c: [f64; 2], x: Slot);
    /// Multiplies `times` times by `2^exponent`, exactly.
    fn scale(&mut self, x: Slot, exponent: i32, times: i32);
    /// 1-norms of `X` and of `I + X`.
    fn norms(&self, x: Slot) -> [f64; 2];
    /// Entry `(j, j)`, rounded.
    fn diagonal(&self, x: Slot, j: usize) -> f64;
    /// Exchanges two slots.
    fn swap(&mut self, x: Slot, y: Slot);
}

/// What ratios need besides.
pub trait Division: Arithmetic {
    /// `X <- D^-1 B`; spoils no other slot but `spare`.
    fn solve(&mut self, d: Slot, b: Slot, spare: Slot, x: Slot) -> Result<()>;
}

/// Matrices of doubles.
pub struct Doubles<'a, 'w> {
    layout: Layout,
    slots: [&'a mut [Eight]; SLOTS],
    watch: &'a mut Watch<'w>,
}

impl<'a, 'w> Doubles<'a, 'w> {
    /// `memory`: one matrix for each slot in use, [`SLOTS`] at most.
    #[inline]
    pub fn new(layout: Layout, memory: &'a mut [Eight], watch: &'a mut Watch<'w>) -> Self {
        Doubles { layout, slots: dense::pieces(memory, layout.packs(layout.rows)), watch }
    }

    /// A matrix.
    pub fn matrix(&mut self, x: Slot) -> &mut [Eight] {
        self.slots[x]
    }
}

impl Arithmetic for Doubles<'_, '_> {
    fn layout(&self) -> Layout {
        self.layout
    }

    fn thresholds(&self) -> Thresholds {
        Thresholds::DOUBLES
    }

    #[inline]
    fn multiply(&mut self, a: Slot, b: Slot, add: Option<(f64, Slot)>, c: Slot) -> Result<()> {
        let out = std::mem::take(&mut self.slots[c]);
        let add = add.map(|(alpha, d)| (alpha, &*self.slots[d]));
        let done = dense::multiply(self.layout, self.slots[a], self.slots[b], add, out, self.watch);
        self.slots[c] = out;
        done
    }

    #[inline]
    fn sums<const N: usize, const K: usize>(
        &mut self,
        x: [Slot; N],
        c: [[[f64; 2]; N]; K],
        outs: [Slot; K],
    ) {
        let mut targets = outs.map(|out| std::mem::take(&mut self.slots[out]));
        let c = c.map(|c| c.map(|[hi, _]| hi));
        dense::sums(x.map(|x| &*self.slots[x]), c, targets.each_mut().map(|out| &mut **out));
        for (out, target) in outs.into_iter().zip(targets) {
            self.slots[out] = target;
        }
    }

    fn add_diagonal(&mut self, c: [f64; 2], x: Slot) {
        let step = self.layout.doubles() + 1;
        for x in doubles_mut(self.slots[x]).iter_mut().step_by(step).take(self.layout.rows) {
            *x += c[0];
        }
    }

    fn scale(&mut self, x: Slot, exponent: i32, times: i32) {
        dense::scale(self.slots[x], exponent, times);
    }

    #[inline]
    fn norms(&self, x: Slot) -> [f64; 2] {
        dense::norms(self.layout, self.slots[x])
    }

    #[inline]
    fn diagonal(&self, x: Slot, j: usize) -> f64 {
        doubles(self.slots[x])[j * (self.layout.doubles() + 1)]
    }

    fn swap(&mut self, x: Slot, y: Slot) {
        self.slots.swap(x, y);
    }
}

impl Division for Doubles<'_, '_> {
    fn solve(&mut self, d: Slot, b: Slot, spare: Slot, x: Slot) -> Result<()> {
        let lu = Lu::new(self.layout, self.slots[d], self.watch)?;
        let out = std::mem::take(&mut self.slots[x]);
        out.copy_from_slice(self.slots[b]);
        lu.solve(out);
        // A factorisation is believed when its residual is that of rounding.
        let residual = std::mem::take(&mut self.slots[spare]);
        let add = Some((-1.0, &*self.slots[b]));
        let done = dense::multiply(self.layout, self.slots[d], out, add, residual, self.watch)
            .and_then(|()| lu.check(residual, self.slots[d], out, self.slots[b]));
        (self.slots[x], self.slots[spare]) = (out, residual);
        done
    }
}

/// Matrices of pairs.
pub struct Pairs<'a, 'w> {
    layout: Layout,
    depth: Depth,
    hi: [&'a mut [Eight]; SLOTS],
    lo: [&'a mut [Eight]; SLOTS],
    engine: PairEngine<'a>,
    watch: &'a mut Watch<'w>,
}

impl<'a, 'w> Pairs<'a, 'w> {
    /// Matrices of work space for `slots` slots.
    pub const fn matrices(slots: usize, depth: Depth) -> usize {
        2 * slots + PairEngine::pieces(depth)
    }

    /// `memory`: [`matrices`](Self::matrices) matrices.
    #[inline]
    pub fn new(
        layout: Layout,
        slots: usize,
        depth: Depth,
        memory: &'a mut [Eight],
        watch: &'a mut Watch<'w>,
    ) -> Self {
        let packs = layout.packs(layout.rows);
        let (hi, rest) = memory.split_at_mut(slots * packs);
        let (lo, slices) = rest.split_at_mut(slots * packs);
        let engine = PairEngine::new(layout, depth, slices);
        Pairs {
            layout,
            depth,
            hi: dense::pieces(hi, packs),
            lo: dense::pieces(lo, packs),
            engine,
            watch,
        }
    }

    /// A matrix.
    pub fn matrix(&mut self, x: Slot) -> PairMut<'_> {
        PairMut { hi: self.hi[x], lo: self.lo[x] }
    }

    /// `Y = X^T`.
    pub fn copy_transposed(&mut self, x: Slot, y: Slot) {
        let mut out = self.take(y);
        for (to, from) in [(&mut out.hi, &*self.hi[x]), (&mut out.lo, &*self.lo[x])] {
            to.copy_from_slice(from);
            dense::transpose(self.layout, to);
        }
        self.put(y, out);
    }

    /// Takes a matrix out, to write to it while others are read.
    fn take(&mut self, x: Slot) -> PairMut<'a> {
        PairMut { hi: std::mem::take(&mut self.hi[x]), lo: std::mem::take(&mut self.lo[x]) }
    }

    fn put(&mut self, x: Slot, matrix: PairMut<'a>) {
        (self.hi[x], self.lo[x]) = (matrix.hi, matrix.lo);
    }
}

/// A matrix of a [`Pairs`], borrowing only the slots.
macro_rules! view {
    ($pairs:expr, $slot:expr) => {
        Pair { hi: &*$pairs.hi[$slot], lo: &*$pairs.lo[$slot] }
    };
}

impl Arithmetic for Pairs<'_, '_> {
    fn layout(&self) -> Layout {
        self.layout
    }

    fn thresholds(&self) -> Thresholds {
        Thresholds::pairs(match self.depth {
            Depth::Two => table::THETA_SID21_PAIR,
            Depth::Three => table::THETA_SID21_DOUBLE_PAIR,
        })
    }

    #[inline]
    fn multiply(&mut self, a: Slot, b: Slot, add: Option<(f64, Slot)>, c: Slot) -> Result<()> {
        let mut out = self.take(c);
        let add = add.map(|(alpha, d)| (alpha, view!(self, d)));
        let (a, b) = (view!(self, a), view!(self, b));
        let done = self.engine.multiply(a, b, add, &mut out, self.watch);
        self.put(c, out);
        done
    }

    #[inline]
    fn sums<const N: usize, const K: usize>(
        &mut self,
        x: [Slot; N],
        c: [[[f64; 2]; N]; K],
        outs: [Slot; K],
    ) {
        let mut targets = outs.map(|out| self.take(out));
        let views = targets.each_mut().map(|out| PairMut { hi: out.hi, lo: out.lo });
        pair::combine(x.map(|x| view!(self, x)), c, views);
        for (out, target) in outs.into_iter().zip(targets) {
            self.put(out, target);
        }
    }

    fn add_diagonal(&mut self, c: [f64; 2], x: Slot) {
        pair::add_diagonal(self.layout, c, [&mut *self.hi[x], &mut *self.lo[x]]);
    }

    fn scale(&mut self, x: Slot, exponent: i32, times: i32) {
        dense::scale(self.hi[x], exponent, times);
        dense::scale(self.lo[x], exponent, times);
    }

    #[inline]
    fn norms(&self, x: Slot) -> [f64; 2] {
        dense::norms(self.layout, self.hi[x])
    }

    #[inline]
    fn diagonal(&self, x: Slot, j: usize) -> f64 {
        doubles(self.hi[x])[j * (self.layout.doubles() + 1)]
    }

    fn swap(&mut self, x: Slot, y: Slot) {
        self.hi.swap(x, y);
        self.lo.swap(x, y);
    }
}

impl Division for Pairs<'_, '_> {
    /// Refines a solution in doubles until its residual, taken in pairs, no longer moves it.
    fn solve(&mut self, d: Slot, b: Slot, spare: Slot, x: Slot) -> Result<()> {
        let lu = Lu::new(self.layout, self.hi[d], self.watch)?;
        let out = self.take(x);
        let mut residual = self.take(spare);
        out.hi.copy_from_slice(self.hi[b]);
        lu.solve(out.hi);
        out.lo.fill(Eight::ZERO);
        let mut last = f64::INFINITY;
        let mut done = Ok(());
        for _ in 0..8 {
            let add = Some((-1.0, view!(self, b)));
            let d = view!(self, d);
            done = self.engine.multiply(d, out.view(), add, &mut residual, self.watch);
            if done.is_err() {
                break;
            }
            lu.solve(residual.hi);
            let change = dense::norms(self.layout, residual.hi)[0];
            if change.is_nan() || change >= 0.5 * last {
                break;
            }
            last = change;
            let (x_hi, x_lo) = (doubles_mut(out.hi), doubles_mut(out.lo));
            for ((hi, lo), r) in x_hi.iter_mut().zip(x_lo).zip(doubles(residual.hi)) {
                [*hi, *lo] = twofold::sum([*hi, *lo], [-r, 0.0]);
            }
        }
        let scale = dense::norms(self.layout, out.hi)[0];
        self.put(x, out);
        self.put(spare, residual);
        done?;
        lu.check_refined(last, scale)
    }
}
