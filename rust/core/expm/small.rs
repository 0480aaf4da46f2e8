//! Exponentials of eight rows or fewer, whole: one choice of the instruction set for all of it.
//!
//! The scheme is that of [`sid`], over arrays whose size the compiler knows; the results are the
//! bits of the general path.

use super::arithmetic::{Arithmetic, Slot, Thresholds};
use super::coefficients as table;
use super::doubling::whole;
use super::sid;
use crate::error::Result;
use crate::linalg::dense::power_of_two;
use crate::linalg::kernel::{
    Body, Eight, Lanes, Layout, Pack, SmallPairProduct, packs, packs_mut, small_combination,
    small_product,
};
use crate::linalg::twofold;

/// Most rows.
pub const LARGEST: usize = 8;

/// `x <- exp(x)`, columns of one pack.
pub struct Small<'a> {
    /// In pairs of doubles.
    pub pairs: bool,
    /// Number of doublings, if it is fixed.
    pub doublings: Option<u32>,
    /// The matrix.
    pub x: &'a mut [Eight],
}

impl Body for Small<'_> {
    type Output = Result<()>;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Result<()> {
        match self.x.len() {
            1 => V::call(Sized::<1>(self)),
            2 => V::call(Sized::<2>(self)),
            3 => V::call(Sized::<3>(self)),
            4 => V::call(Sized::<4>(self)),
            5 => V::call(Sized::<5>(self)),
            6 => V::call(Sized::<6>(self)),
            7 => V::call(Sized::<7>(self)),
            _ => V::call(Sized::<8>(self)),
        }
    }
}

struct Sized<'a, const M: usize>(Small<'a>);

impl<const M: usize> Body for Sized<'_, M> {
    type Output = Result<()>;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Result<()> {
        let matrix: &mut [Eight; M] = self.0.x.first_chunk_mut().expect("M columns of one pack");
        if self.0.pairs {
            let mut x = SmallPairs::<V, M>::new(matrix);
            let (form, _) = sid::exponential(&mut x, self.0.doublings)?;
            whole(&mut x, sid::T, form);
            *matrix = x.hi[sid::T];
        } else {
            let mut x = SmallDoubles::<V, M>::new(matrix);
            let (form, _) = sid::exponential(&mut x, self.0.doublings)?;
            whole(&mut x, sid::T, form);
            *matrix = x.slots[sid::T];
        }
        Ok(())
    }
}

struct SmallDoubles<V, const M: usize> {
    slots: [[Eight; M]; sid::SLOTS],
    lanes: std::marker::PhantomData<V>,
}

impl<V: Lanes, const M: usize> SmallDoubles<V, M> {
    #[inline(always)]
    fn new(a: &[Eight; M]) -> Self {
        let mut slots = [[Eight::ZERO; M]; sid::SLOTS];
        slots[sid::A] = *a;
        SmallDoubles { slots, lanes: std::marker::PhantomData }
    }
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

struct SmallPairs<V, const M: usize> {
    hi: [[Eight; M]; sid::SLOTS],
    lo: [[Eight; M]; sid::SLOTS],
    lanes: std::marker::PhantomData<V>,
}

impl<V: Lanes, const M: usize> SmallPairs<V, M> {
    #[inline(always)]
    fn new(a: &[Eight; M]) -> Self {
        let zero = [[Eight::ZERO; M]; sid::SLOTS];
        let mut x = SmallPairs { hi: zero, lo: zero, lanes: std::marker::PhantomData };
        x.hi[sid::A] = *a;
        x
    }
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
        let (mut hi, mut lo) = ([Eight::ZERO; M], [Eight::ZERO; M]);
        let view = |x: Slot| [&self.hi[x][..], &self.lo[x][..]];
        V::call(SmallPairProduct {
            rows: M,
            a: view(a),
            b: view(b),
            add: add.map(|(alpha, d)| (alpha, view(d))),
            c: [&mut hi, &mut lo],
        });
        (self.hi[c], self.lo[c]) = (hi, lo);
        Ok(())
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
                terms[i].1 = [packs(&self.hi[x[i]])[at], packs(&self.lo[x[i]])[at]];
            }
            for k in 0..K {
                for i in 0..N {
                    terms[i].0 = c[k][i];
                }
                let [hi, lo] = small_combination::<V, true, N>(&terms);
                packs_mut(&mut self.hi[outs[k]])[at] = hi;
                packs_mut(&mut self.lo[outs[k]])[at] = lo;
            }
        }
    }

    #[inline(always)]
    fn add_diagonal(&mut self, c: [f64; 2], x: Slot) {
        for j in 0..M {
            let (hi, lo) = (&mut self.hi[x][j].0[j], &mut self.lo[x][j].0[j]);
            [*hi, *lo] = twofold::sum(c, [*hi, *lo]);
        }
    }

    #[inline(always)]
    fn scale(&mut self, x: Slot, exponent: i32, times: i32) {
        scale::<V, M>(&mut self.hi[x], exponent, times);
        scale::<V, M>(&mut self.lo[x], exponent, times);
    }

    #[inline(always)]
    fn norms(&self, x: Slot) -> [f64; 2] {
        norms::<V, M>(&self.hi[x])
    }

    #[inline(always)]
    fn diagonal(&self, x: Slot, j: usize) -> f64 {
        self.hi[x][j].0[j]
    }

    #[inline(always)]
    fn swap(&mut self, x: Slot, y: Slot) {
        self.hi.swap(x, y);
        self.lo.swap(x, y);
    }
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
