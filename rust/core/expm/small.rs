//! Exponentials of eight rows or fewer, whole: one choice of the instruction set for all of it.
//!
//! The scheme is that of [`sid`], over arrays whose size the compiler knows; the results are the
//! bits of the general path.

use std::marker::PhantomData;

use super::arithmetic::{Arithmetic, Slot, Thresholds};
use super::balance::{balance, is_balanced, restore};
use super::coefficients as table;
use super::doubling::{overflow, whole};
use super::{Recipe, Scheme, depth_for, sid};
use crate::error::Result;
use crate::linalg::dense::power_of_two;
use crate::linalg::kernel::{
    Body, Depth, Eight, Lanes, Layout, Pack, PackColumns, SmallPairProduct, UnpackColumns, packs,
    packs_mut, small_combination, small_product,
};
use crate::linalg::twofold;

/// Most rows.
pub const LARGEST: usize = 8;

/// [`Scheme::Exact`] or [`Scheme::Sid`] from plain columns to plain columns.
///
/// The result is the 1-norm of the matrix, or `None` where pairs of two slices do not reach and
/// nothing was done.
pub struct Small<'a> {
    /// Rows and columns.
    pub rows: usize,
    /// The scheme.
    pub recipe: Recipe,
    /// The matrix.
    pub a: &'a [f64],
    /// Its exponential.
    pub out: &'a mut [f64],
}

impl Body for Small<'_> {
    type Output = Result<Option<f64>>;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Self::Output {
        match self.rows {
            1 => V::call(OfSize::<1>(self)),
            2 => V::call(OfSize::<2>(self)),
            3 => V::call(OfSize::<3>(self)),
            4 => V::call(OfSize::<4>(self)),
            5 => V::call(OfSize::<5>(self)),
            6 => V::call(OfSize::<6>(self)),
            7 => V::call(OfSize::<7>(self)),
            _ => V::call(OfSize::<8>(self)),
        }
    }
}

struct OfSize<'a, const M: usize>(Small<'a>);

impl<const M: usize> Body for OfSize<'_, M> {
    type Output = Result<Option<f64>>;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Self::Output {
        let Small { recipe, a, out, .. } = self.0;
        let layout = Layout::new(M);
        let mut matrix = [Eight::ZERO; M];
        PackColumns { layout, plain: a, packed: &mut matrix }.run::<V>();
        let norm = norms::<V, M>(&matrix)[0];
        let (mut scales, mut balanced) = (None, norm);
        if !is_balanced::<V>(layout, &matrix) {
            scales = balance(layout, &mut matrix);
            balanced = norms::<V, M>(&matrix)[0];
        }
        let pairs = recipe.scheme == Scheme::Exact;
        if pairs && depth_for(balanced) == Depth::Three {
            return Ok(None);
        }
        if pairs {
            let zero = [[Eight::ZERO; M]; sid::SLOTS + 1];
            let at = std::array::from_fn(|slot| slot);
            let lanes = PhantomData::<V>;
            let mut x = SmallPairs { hi: zero, lo: zero, at, free: sid::SLOTS, lanes };
            x.hi[sid::A] = matrix;
            let (form, _) = sid::exponential(&mut x, recipe.doublings)?;
            whole(&mut x, sid::T, form);
            matrix = x.hi[x.at[sid::T]];
        } else {
            let slots = [[Eight::ZERO; M]; sid::SLOTS];
            let mut x = SmallDoubles { slots, lanes: PhantomData::<V> };
            x.slots[sid::A] = matrix;
            let (form, _) = sid::exponential(&mut x, recipe.doublings)?;
            whole(&mut x, sid::T, form);
            matrix = x.slots[sid::T];
        }
        if let Some(scales) = scales {
            restore(layout, &scales, &mut matrix);
        }
        if !(UnpackColumns { layout, packed: &matrix, plain: out }).run::<V>() {
            return Err(overflow());
        }
        Ok(Some(norm))
    }
}

struct SmallDoubles<V, const M: usize> {
    slots: [[Eight; M]; sid::SLOTS],
    lanes: PhantomData<V>,
}

impl<V: Lanes, const M: usize> Arithmetic for SmallDoubles<V, M> {
    #[inline(always)]
    fn layout(&self) -> Layout {
        Layout::new(M)
    }

    #[inline(always)]
    fn thresholds(&self) -> Thresholds {
        Thresholds::DOUBLES
    }

    #[inline(always)]
    fn multiply(&mut self, a: Slot, b: Slot, add: Option<(f64, Slot)>, c: Slot) -> Result<()> {
        let add = add.map(|(alpha, d)| (alpha, &self.slots[d]));
        let product = small_product::<V, M>(&self.slots[a], &self.slots[b], add);
        packs_mut::<V>(&mut self.slots[c]).copy_from_slice(&product);
        Ok(())
    }

    #[inline(always)]
    fn square(&mut self, x: Slot, alpha: Option<f64>, _: Slot) -> Result<()> {
        // The product stays in registers until it is complete.
        self.multiply(x, x, alpha.map(|alpha| (alpha, x)), x)
    }

    #[inline(always)]
    fn sums<const N: usize, const K: usize>(
        &mut self,
        x: [Slot; N],
        c: [[[f64; 2]; N]; K],
        outs: [Slot; K],
    ) {
        for at in 0..M {
            for k in 0..K {
                let mut sum = Pack::<V>::splat(0.0);
                for i in 0..N {
                    let x = packs::<V>(&self.slots[x[i]])[at];
                    sum = Pack::splat(c[k][i][0]).mul_add(x, sum);
                }
                packs_mut::<V>(&mut self.slots[outs[k]])[at] = sum;
            }
        }
    }

    #[inline(always)]
    fn add_diagonal(&mut self, c: [f64; 2], x: Slot) {
        for j in 0..M {
            self.slots[x][j].0[j] += c[0];
        }
    }

    #[inline(always)]
    fn scale(&mut self, x: Slot, exponent: i32, times: i32) {
        scale::<V, M>(&mut self.slots[x], exponent, times);
    }

    #[inline(always)]
    fn norms(&self, x: Slot) -> [f64; 2] {
        norms::<V, M>(&self.slots[x])
    }

    #[inline(always)]
    fn diagonal(&self, x: Slot, j: usize) -> f64 {
        self.slots[x][j].0[j]
    }

    #[inline(always)]
    fn swap(&mut self, x: Slot, y: Slot) {
        self.slots.swap(x, y);
    }
}

/// A product is formed in the matrix that is free and takes the place of its slot.
struct SmallPairs<V, const M: usize> {
    hi: [[Eight; M]; sid::SLOTS + 1],
    lo: [[Eight; M]; sid::SLOTS + 1],
    /// The matrix of each slot.
    at: [usize; sid::SLOTS],
    free: usize,
    lanes: PhantomData<V>,
}

impl<V: Lanes, const M: usize> Arithmetic for SmallPairs<V, M> {
    #[inline(always)]
    fn layout(&self) -> Layout {
        Layout::new(M)
    }

    #[inline(always)]
    fn thresholds(&self) -> Thresholds {
        Thresholds::pairs(table::THETA_SID21_PAIR)
    }

    #[inline(always)]
    fn multiply(&mut self, a: Slot, b: Slot, add: Option<(f64, Slot)>, c: Slot) -> Result<()> {
        let [a, b] = [self.at[a], self.at[b]];
        let add = add.map(|(alpha, d)| (alpha, self.at[d]));
        let (c_hi, hi) = apart(&mut self.hi, self.free);
        let (c_lo, lo) = apart(&mut self.lo, self.free);
        V::call(SmallPairProduct {
            rows: M,
            a: [hi(a), lo(a)],
            b: [hi(b), lo(b)],
            add: add.map(|(alpha, d)| (alpha, [hi(d), lo(d)])),
            c: [c_hi, c_lo],
        });
        std::mem::swap(&mut self.at[c], &mut self.free);
        Ok(())
    }

    #[inline(always)]
    fn square(&mut self, x: Slot, alpha: Option<f64>, _: Slot) -> Result<()> {
        self.multiply(x, x, alpha.map(|alpha| (alpha, x)), x)
    }

    #[inline(always)]
    fn sums<const N: usize, const K: usize>(
        &mut self,
        x: [Slot; N],
        c: [[[f64; 2]; N]; K],
        outs: [Slot; K],
    ) {
        for at in 0..M {
            let mut terms = [([0.0; 2], [Pack::<V>::splat(0.0); 2]); N];
            for i in 0..N {
                let x = self.at[x[i]];
                terms[i].1 = [packs(&self.hi[x])[at], packs(&self.lo[x])[at]];
            }
            for k in 0..K {
                for i in 0..N {
                    terms[i].0 = c[k][i];
                }
                let [hi, lo] = small_combination::<V, true, N>(&terms);
                packs_mut(&mut self.hi[self.at[outs[k]]])[at] = hi;
                packs_mut(&mut self.lo[self.at[outs[k]]])[at] = lo;
            }
        }
    }

    #[inline(always)]
    fn add_diagonal(&mut self, c: [f64; 2], x: Slot) {
        let x = self.at[x];
        for j in 0..M {
            let (hi, lo) = (&mut self.hi[x][j].0[j], &mut self.lo[x][j].0[j]);
            [*hi, *lo] = twofold::sum(c, [*hi, *lo]);
        }
    }

    #[inline(always)]
    fn scale(&mut self, x: Slot, exponent: i32, times: i32) {
        scale::<V, M>(&mut self.hi[self.at[x]], exponent, times);
        scale::<V, M>(&mut self.lo[self.at[x]], exponent, times);
    }

    #[inline(always)]
    fn norms(&self, x: Slot) -> [f64; 2] {
        norms::<V, M>(&self.hi[self.at[x]])
    }

    #[inline(always)]
    fn diagonal(&self, x: Slot, j: usize) -> f64 {
        self.hi[self.at[x]][j].0[j]
    }

    #[inline(always)]
    fn swap(&mut self, x: Slot, y: Slot) {
        self.at.swap(x, y);
    }
}

/// One matrix to write and all others, by number, to read.
#[inline(always)]
fn apart<'a, const M: usize>(
    all: &'a mut [[Eight; M]],
    free: usize,
) -> (&'a mut [Eight], impl Fn(usize) -> &'a [Eight]) {
    let (below, rest) = all.split_at_mut(free);
    let (one, above) = rest.split_first_mut().expect("the free matrix is one of them");
    let (below, above) = (&*below, &*above);
    (one, move |at| if at < free { &below[at] } else { &above[at - free - 1] })
}

/// As [`dense::scale`](crate::linalg::dense::scale).
#[inline(always)]
fn scale<V: Lanes, const M: usize>(x: &mut [Eight; M], exponent: i32, times: i32) {
    let whole = exponent * times;
    let (rounds, parts) = match whole.abs() <= 1000 {
        true => (1, [whole, 0]),
        false => (times, [exponent / 2, exponent - exponent / 2]),
    };
    for _ in 0..rounds {
        for part in parts {
            let factor = Pack::<V>::splat(power_of_two(part));
            for x in packs_mut::<V>(x) {
                *x = *x * factor;
            }
        }
    }
}

/// As [`dense::norms`](crate::linalg::dense::norms).
#[inline(always)]
fn norms<V: Lanes, const M: usize>(x: &[Eight; M]) -> [f64; 2] {
    let (mut norm_t, mut norm_w) = (0.0, 0.0);
    for j in 0..M {
        let sum = packs::<V>(x)[j].abs().sum();
        let diagonal = x[j].0[j];
        norm_t = if sum <= norm_t { norm_t } else { sum };
        let with_identity = sum - diagonal.abs() + (1.0 + diagonal).abs();
        norm_w = if with_identity <= norm_w { norm_w } else { with_identity };
    }
    [norm_t, norm_w]
}
