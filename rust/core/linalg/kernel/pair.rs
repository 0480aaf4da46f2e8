//! Products of matrices held as unevaluated sums `hi + lo`, at the speed of ordinary products.
//!
//! The left factor is cut row by row, the right one column by column, into slices of `b` bits, with
//! `2 b + log2(inner) <= 53`. The product of two leading slices is then exact in ordinary
//! arithmetic, in whatever order it is summed; what is left is small enough that rounding it does
//! no harm. Two slices a factor cost three ordinary products and leave an error of `2^-53-b` of the
//! row's and column's largest entries, three slices cost six and leave `2^-53-2b`.
//!
//! Source: Ozaki, Ogita, Oishi & Rump, Numer. Algorithms 59 (2012), here on pairs.

use super::pack::{Lanes, Pack, packs, packs_mut};
use super::{Body, Eight, Layout, doubles};

/// How deep factors are cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// Two slices, three products: 78 bits.
    Two,
    /// Three slices, six products: 103 bits.
    Three,
}

/// Bits of a slice for sums of `inner` terms.
pub fn slice_bits(inner: usize) -> i32 {
    let log = usize::BITS - inner.max(1).saturating_sub(1).leading_zeros();
    (53 - log as i32) / 2
}

/// What rounds a number to a multiple of `2^-bits` of twice its binade when added and taken off.
#[inline(always)]
fn shift(bits: i32) -> f64 {
    1.5 * f64::from_bits(((1023 + 53 - bits) as u64) << 52)
}

/// Cuts a matrix of pairs into slices of `bits` bits.
pub struct Slices<'a> {
    /// Rows together (for a left factor) or columns together (for a right factor).
    pub rows: bool,
    /// How the columns lie in memory.
    pub layout: Layout,
    /// Columns.
    pub columns: usize,
    /// Bits of a slice.
    pub bits: i32,
    /// Slices to make.
    pub depth: Depth,
    /// The matrix: leading parts.
    pub hi: &'a [Eight],
    /// The matrix: remainders.
    pub lo: &'a [Eight],
    /// The slices, largest first, the last with all that is left. At [`Depth::Three`] the fourth
    /// becomes the sum of the second and third, if there is one; at [`Depth::Two`] only the first
    /// two are made.
    pub out: [&'a mut [Eight]; 4],
}

impl Body for Slices<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(mut self) {
        let factor = Pack::<V>::splat(shift(self.bits));
        let Layout { height, stride, .. } = self.layout;
        let columns = self.columns;
        let hi = packs::<V>(self.hi);
        if self.rows {
            for i in 0..height {
                let mut largest = Pack::<V>::splat(0.0);
                for j in 0..columns {
                    largest = hi[j * stride + i].abs().max(largest);
                }
                let shift = largest.binade() * factor;
                for j in 0..columns {
                    self.cut(j * stride + i, shift);
                }
            }
        } else {
            for j in 0..columns {
                let column = &hi[j * stride..][..height];
                let mut largest = Pack::<V>::splat(0.0);
                for x in column {
                    largest = x.abs().max(largest);
                }
                let shift = Pack::splat(largest.largest()).binade() * factor;
                for i in 0..height {
                    self.cut(j * stride + i, shift);
                }
            }
        }
    }
}

impl Slices<'_> {
    #[inline(always)]
    fn cut<V: Lanes>(&mut self, at: usize, shift: Pack<V>) {
        let (hi, lo) = (packs::<V>(self.hi)[at], packs::<V>(self.lo)[at]);
        let first = (hi + shift) - shift;
        let rest = hi - first;
        packs_mut::<V>(self.out[0])[at] = first;
        match self.depth {
            Depth::Two => packs_mut::<V>(self.out[1])[at] = rest + lo,
            Depth::Three => {
                let finer = shift * Pack::splat(f64::from_bits(((1023 - self.bits) as u64) << 52));
                let second = (rest + finer) - finer;
                packs_mut::<V>(self.out[1])[at] = second;
                packs_mut::<V>(self.out[2])[at] = (rest - second) + lo;
                if let Some(both) = packs_mut::<V>(self.out[3]).get_mut(at) {
                    *both = rest + lo;
                }
            }
        }
    }
}

/// `C = A B`, or `C = A B + alpha D` with `alpha` a power of two, on pairs.
pub struct PairProduct<'a> {
    /// How the columns of all matrices lie in memory.
    pub layout: Layout,
    /// Columns of `B`, `C`, `D`.
    pub columns: usize,
    /// How deep the factors were cut.
    pub depth: Depth,
    /// Slices of the left factor, by rows.
    pub a: [&'a [Eight]; 3],
    /// Slices of the right factor, by columns, four of them at [`Depth::Three`].
    pub b: [&'a [Eight]; 4],
    /// The right factor's leading parts, whole.
    pub b_hi: &'a [Eight],
    /// What is added: a factor, leading parts, remainders.
    pub add: Option<(f64, &'a [Eight], &'a [Eight])>,
    /// The result: leading parts, correctly rounded sums of the pair.
    pub hi: &'a mut [Eight],
    /// The result: remainders.
    pub lo: &'a mut [Eight],
}

impl Body for PairProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(mut self) {
        match self.depth {
            Depth::Two => self.sweep::<V, false>(),
            Depth::Three => self.sweep::<V, true>(),
        }
    }
}

impl<'a> PairProduct<'a> {
    #[inline(always)]
    fn sweep<V: Lanes, const DEEP: bool>(&mut self) {
        let (height, _) = V::PAIR_TILE;
        let mut row = 0;
        while row < self.layout.height {
            row += if height >= 2 && self.layout.height - row >= 2 {
                self.panel::<V, DEEP, 2>(row)
            } else {
                self.panel::<V, DEEP, 1>(row)
            };
        }
    }

    #[inline(always)]
    fn panel<V: Lanes, const DEEP: bool, const R: usize>(&mut self, row: usize) -> usize {
        let (_, width) = V::PAIR_TILE;
        let mut column = 0;
        while column < self.columns {
            column += match (self.columns - column).min(width) {
                4.. if width >= 4 => self.tile::<V, DEEP, R, 4>(row, column),
                3 if width >= 4 => self.tile::<V, DEEP, R, 3>(row, column),
                2 => self.tile::<V, DEEP, R, 2>(row, column),
                _ => self.tile::<V, DEEP, R, 1>(row, column),
            };
        }
        R
    }

    #[inline(always)]
    fn tile<V: Lanes, const DEEP: bool, const R: usize, const N: usize>(
        &mut self,
        row: usize,
        col: usize,
    ) -> usize {
        let Layout { rows, stride, .. } = self.layout;
        let column = |x: &'a [Eight], j: usize| &doubles(x)[8 * stride * (col + j)..][..rows];
        let mut b: [[&[f64]; 5]; N] = [[&[]; 5]; N];
        for (j, b) in b.iter_mut().enumerate() {
            let [b1, b2, b3, b23] = self.b;
            *b = [column(b1, j), column(b2, j), &[], &[], column(self.b_hi, j)];
            if DEEP {
                (b[2], b[3]) = (column(b3, j), column(b23, j));
            }
        }
        let [a1, a2, a3] = [packs::<V>(self.a[0]), packs::<V>(self.a[1]), packs::<V>(self.a[2])];
        let zero = [[Pack::<V>::splat(0.0); R]; N];
        // Exact; exact too with three slices; rounded.
        let (mut first, mut second, mut third) = (zero, zero, zero);
        for k in 0..rows {
            let at = k * stride + row;
            let a1: &[Pack<V>; R] = a1[at..].first_chunk().expect("R packs of rows");
            let a2: &[Pack<V>; R] = a2[at..].first_chunk().expect("R packs of rows");
            if DEEP {
                let a3: &[Pack<V>; R] = a3[at..].first_chunk().expect("R packs of rows");
                for j in 0..N {
                    let b1 = Pack::splat(b[j][0][k]);
                    let b2 = Pack::splat(b[j][1][k]);
                    let b3 = Pack::splat(b[j][2][k]);
                    let b23 = Pack::splat(b[j][3][k]);
                    let whole = Pack::splat(b[j][4][k]);
                    for i in 0..R {
                        first[j][i] = a1[i].mul_add(b1, first[j][i]);
                        second[j][i] = a1[i].mul_add(b2, second[j][i]);
                        second[j][i] = a2[i].mul_add(b1, second[j][i]);
                        // a1 b3 + a2 (b2 + b3) + a3 (b1 + b2 + b3)
                        third[j][i] = a1[i].mul_add(b3, third[j][i]);
                        third[j][i] = a2[i].mul_add(b23, third[j][i]);
                        third[j][i] = a3[i].mul_add(whole, third[j][i]);
                    }
                }
            } else {
                for j in 0..N {
                    let b1 = Pack::splat(b[j][0][k]);
                    let b2 = Pack::splat(b[j][1][k]);
                    let whole = Pack::splat(b[j][4][k]);
                    for i in 0..R {
                        first[j][i] = a1[i].mul_add(b1, first[j][i]);
                        second[j][i] = a1[i].mul_add(b2, second[j][i]);
                        third[j][i] = a2[i].mul_add(whole, third[j][i]);
                    }
                }
            }
        }
        for j in 0..N {
            for i in 0..R {
                let at = (col + j) * stride + row + i;
                let (mut h, mut l) = first[j][i].two_sum(second[j][i]);
                l = l + third[j][i];
                if let Some((alpha, d_hi, d_lo)) = self.add {
                    let alpha = Pack::splat(alpha);
                    let (s, e) = (alpha * packs::<V>(d_hi)[at]).two_sum(h);
                    h = s;
                    l = alpha.mul_add(packs::<V>(d_lo)[at], l + e);
                }
                let (h, l) = h.two_sum(l);
                packs_mut::<V>(self.hi)[at] = h;
                packs_mut::<V>(self.lo)[at] = l;
            }
        }
        N
    }
}

/// [`PairProduct`] of square matrices of eight rows or fewer at [`Depth::Two`], factors cut on the
/// way: the slices never leave the registers and the first cache lines.
pub struct SmallPairProduct<'a> {
    /// Rows and columns.
    pub rows: usize,
    /// Left factor: leading parts, remainders.
    pub a: [&'a [Eight]; 2],
    /// Right factor.
    pub b: [&'a [Eight]; 2],
    /// What is added: a factor, leading parts, remainders.
    pub add: Option<(f64, [&'a [Eight]; 2])>,
    /// The result: leading parts, remainders.
    pub c: [&'a mut [Eight]; 2],
}

impl Body for SmallPairProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        match self.rows {
            1 => self.square::<V, 1>(),
            2 => self.square::<V, 2>(),
            3 => self.square::<V, 3>(),
            4 => self.square::<V, 4>(),
            5 => self.square::<V, 5>(),
            6 => self.square::<V, 6>(),
            7 => self.square::<V, 7>(),
            _ => self.square::<V, 8>(),
        }
    }
}

impl SmallPairProduct<'_> {
    #[inline(always)]
    fn square<V: Lanes, const M: usize>(self) {
        const FITS: &str = "M columns of one pack";
        let factor = Pack::<V>::splat(shift(slice_bits(M)));
        let a_hi: &[Pack<V>; M] = packs(self.a[0]).first_chunk().expect(FITS);
        let a_lo: &[Pack<V>; M] = packs(self.a[1]).first_chunk().expect(FITS);
        let mut largest = Pack::<V>::splat(0.0);
        for k in 0..M {
            largest = a_hi[k].abs().max(largest);
        }
        let cut = largest.binade() * factor;
        let b_hi: &[Eight; M] = self.b[0].first_chunk().expect(FITS);
        let b_lo: &[Eight; M] = self.b[1].first_chunk().expect(FITS);
        let (mut b1, mut b2) = ([Eight::ZERO; M], [Eight::ZERO; M]);
        for j in 0..M {
            let (hi, lo) = (packs::<V>(b_hi)[j], packs::<V>(b_lo)[j]);
            let cut = Pack::splat(hi.abs().largest()).binade() * factor;
            let first = (hi + cut) - cut;
            packs_mut::<V>(&mut b1)[j] = first;
            packs_mut::<V>(&mut b2)[j] = (hi - first) + lo;
        }
        let zero = [Pack::<V>::splat(0.0); M];
        let (mut first, mut second, mut third) = (zero, zero, zero);
        for k in 0..M {
            let a1 = (a_hi[k] + cut) - cut;
            let a2 = (a_hi[k] - a1) + a_lo[k];
            for j in 0..M {
                first[j] = a1.mul_add(Pack::splat(b1[j].0[k]), first[j]);
                second[j] = a1.mul_add(Pack::splat(b2[j].0[k]), second[j]);
                third[j] = a2.mul_add(Pack::splat(b_hi[j].0[k]), third[j]);
            }
        }
        for j in 0..M {
            let (h, l) = first[j].two_sum(second[j]);
            (first[j], second[j]) = (h, l + third[j]);
        }
        if let Some((alpha, [d_hi, d_lo])) = self.add {
            let alpha = Pack::splat(alpha);
            let d_hi: &[Pack<V>; M] = packs(d_hi).first_chunk().expect(FITS);
            let d_lo: &[Pack<V>; M] = packs(d_lo).first_chunk().expect(FITS);
            for j in 0..M {
                let (s, e) = (alpha * d_hi[j]).two_sum(first[j]);
                (first[j], second[j]) = (s, alpha.mul_add(d_lo[j], second[j] + e));
            }
        }
        let [hi, lo] = self.c;
        let hi: &mut [Pack<V>; M] = packs_mut(hi).first_chunk_mut().expect(FITS);
        let lo: &mut [Pack<V>; M] = packs_mut(lo).first_chunk_mut().expect(FITS);
        for j in 0..M {
            (hi[j], lo[j]) = first[j].two_sum(second[j]);
        }
    }
}

/// Several sums `outs[k] = sum of c[k][i] X[i]` of the same matrices of pairs in one pass;
/// coefficients are pairs too.
pub struct Combinations<'a, const N: usize, const K: usize> {
    /// The matrices: leading parts, remainders.
    pub x: [(&'a [Eight], &'a [Eight]); N],
    /// Coefficients of each sum; terms with 0 are left out.
    pub c: [[[f64; 2]; N]; K],
    /// The results: leading parts, remainders.
    pub outs: [(&'a mut [Eight], &'a mut [Eight]); K],
}

impl<const N: usize, const K: usize> Body for Combinations<'_, N, K> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        for (c, (hi, lo)) in self.c.iter().zip(self.outs) {
            let mut terms = [([0.0; 2], (&[] as &[Eight], &[] as &[Eight])); N];
            let mut count = 0;
            for (c, x) in c.iter().zip(self.x) {
                if c[0] != 0.0 {
                    terms[count] = (*c, x);
                    count += 1;
                }
            }
            match &terms[..count] {
                [] => (hi.fill(Eight::ZERO), lo.fill(Eight::ZERO)).0,
                [a] => combination::<V, 1>([*a], hi, lo),
                [a, b] => combination::<V, 2>([*a, *b], hi, lo),
                [a, b, c] => combination::<V, 3>([*a, *b, *c], hi, lo),
                [a, b, c, d] => combination::<V, 4>([*a, *b, *c, *d], hi, lo),
                [a, b, c, d, e] => combination::<V, 5>([*a, *b, *c, *d, *e], hi, lo),
                more => unreachable!("{} terms; no scheme has more than five", more.len()),
            }
        }
    }
}

type Term<'a> = ([f64; 2], (&'a [Eight], &'a [Eight]));

/// One sum of exactly `N` terms: coefficients as pairs, matrices of pairs.
#[inline(always)]
fn combination<V: Lanes, const N: usize>(terms: [Term; N], hi: &mut [Eight], lo: &mut [Eight]) {
    let len = hi.len();
    let (hi, lo) = (packs_mut::<V>(hi), &mut packs_mut::<V>(lo)[..len]);
    let mut x_hi: [&[Pack<V>]; N] = [&[]; N];
    let mut x_lo: [&[Pack<V>]; N] = [&[]; N];
    for i in 0..N {
        let (_, (hi, lo)) = terms[i];
        x_hi[i] = &packs::<V>(hi)[..len];
        x_lo[i] = &packs::<V>(lo)[..len];
    }
    for at in 0..len {
        let mut terms_at = [([0.0; 2], [Pack::<V>::splat(0.0); 2]); N];
        for i in 0..N {
            terms_at[i] = (terms[i].0, [x_hi[i][at], x_lo[i][at]]);
        }
        [hi[at], lo[at]] = small_combination::<V, false, N>(&terms_at);
    }
}

/// `sum of c x` of pairs; with `SPARSE`, terms with coefficient 0 are left out.
#[inline(always)]
pub fn small_combination<V: Lanes, const SPARSE: bool, const N: usize>(
    terms: &[([f64; 2], [Pack<V>; 2]); N],
) -> [Pack<V>; 2] {
    let mut sum = Pack::<V>::splat(0.0);
    let mut rest = Pack::<V>::splat(0.0);
    for i in 0..N {
        let ([c_hi, c_lo], [x_hi, x_lo]) = terms[i];
        if SPARSE && c_hi == 0.0 {
            continue;
        }
        let (c_hi, c_lo) = (Pack::splat(c_hi), Pack::splat(c_lo));
        let (p, e) = c_hi.two_product(x_hi);
        let e = c_hi.mul_add(x_lo, c_lo.mul_add(x_hi, e));
        let (s, t) = sum.two_sum(p);
        (sum, rest) = (s, rest + (t + e));
    }
    let (hi, lo) = sum.two_sum(rest);
    [hi, lo]
}
