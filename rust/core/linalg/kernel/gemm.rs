//! The matrix product, one tile for every instruction set.
//!
//! Each entry of the result has one accumulator that takes its terms in the order of the inner
//! index, each by one fused multiply-add. The tile only decides which entries are computed side by
//! side, so all levels give the same bits.

use super::pack::{Lanes, Pack, packs, packs_mut};
use super::{Body, Eight, Layout, doubles};

/// `C = A B`, or `C = A B + alpha D`, column by column in storage.
///
/// `A` is square, the others have as many rows. The rows that pad a column to whole packs are
/// computed along with the others.
pub struct Product<'a> {
    /// How the columns of all four lie in memory.
    pub layout: Layout,
    /// Columns of `B`, `C`, `D`.
    pub columns: usize,
    /// Left factor.
    pub a: &'a [Eight],
    /// Right factor.
    pub b: &'a [Eight],
    /// What is added: a factor and a matrix.
    pub add: Option<(f64, &'a [Eight])>,
    /// The result.
    pub c: &'a mut [Eight],
}

impl Body for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(mut self) {
        if self.columns == self.layout.rows && self.layout.height == 1 {
            return match self.columns {
                1 => self.square::<V, 1>(),
                2 => self.square::<V, 2>(),
                3 => self.square::<V, 3>(),
                4 => self.square::<V, 4>(),
                5 => self.square::<V, 5>(),
                6 => self.square::<V, 6>(),
                7 => self.square::<V, 7>(),
                _ => self.square::<V, 8>(),
            };
        }
        let (height, _) = V::TILE;
        let mut row = 0;
        while row < self.layout.height {
            row += match self.layout.height - row {
                left if left >= 3 && height >= 3 => self.panel::<V, 3>(row),
                left if left >= 2 && height >= 2 => self.panel::<V, 2>(row),
                _ => self.panel::<V, 1>(row),
            };
        }
    }
}

impl Product<'_> {
    /// The whole of a square product of eight rows or fewer.
    #[inline(always)]
    fn square<V: Lanes, const M: usize>(self) {
        const FITS: &str = "M columns of one pack";
        let add = self.add.map(|(alpha, d)| (alpha, d.first_chunk().expect(FITS)));
        let sum = small_product::<V, M>(
            self.a.first_chunk().expect(FITS),
            self.b.first_chunk().expect(FITS),
            add,
        );
        let c: &mut [Pack<V>; M] = packs_mut(self.c).first_chunk_mut().expect(FITS);
        *c = sum;
    }

    /// `R` packs of rows, all columns.
    #[inline(always)]
    fn panel<V: Lanes, const R: usize>(&mut self, row: usize) -> usize {
        let (_, width) = V::TILE;
        let mut column = 0;
        while column < self.columns {
            column += match (self.columns - column).min(width) {
                8.. if width >= 8 => self.tile::<V, R, 8>(row, column),
                7 if width >= 8 => self.tile::<V, R, 7>(row, column),
                6 if width >= 6 => self.tile::<V, R, 6>(row, column),
                5 if width >= 6 => self.tile::<V, R, 5>(row, column),
                4 => self.tile::<V, R, 4>(row, column),
                3 => self.tile::<V, R, 3>(row, column),
                2 => self.tile::<V, R, 2>(row, column),
                _ => self.tile::<V, R, 1>(row, column),
            };
        }
        R
    }

    /// `R` packs of rows, `N` columns.
    #[inline(always)]
    fn tile<V: Lanes, const R: usize, const N: usize>(&mut self, row: usize, col: usize) -> usize {
        let Layout { rows, stride, .. } = self.layout;
        let mut b: [&[f64]; N] = [&[]; N];
        for (j, b) in b.iter_mut().enumerate() {
            *b = &doubles(self.b)[8 * stride * (col + j)..][..rows];
        }
        let mut sum = [[Pack::<V>::splat(0.0); R]; N];
        let a = packs::<V>(self.a);
        for k in 0..rows {
            let a: &[Pack<V>; R] = a[k * stride + row..].first_chunk().expect("R packs of rows");
            for j in 0..N {
                let x = Pack::splat(b[j][k]);
                for i in 0..R {
                    sum[j][i] = a[i].mul_add(x, sum[j][i]);
                }
            }
        }
        for j in 0..N {
            let at = (col + j) * stride + row;
            if let Some((alpha, d)) = self.add {
                let alpha = Pack::splat(alpha);
                let d: &[Pack<V>; R] = packs(&d[at..]).first_chunk().expect("R packs of rows");
                for i in 0..R {
                    sum[j][i] = alpha.mul_add(d[i], sum[j][i]);
                }
            }
            let c = packs_mut::<V>(&mut self.c[at..]);
            let c: &mut [Pack<V>; R] = c.first_chunk_mut().expect("R packs of rows");
            *c = sum[j];
        }
        N
    }
}

/// A product of matrices with eight rows or fewer, in straight lines.
#[inline(always)]
pub fn small_product<V: Lanes, const M: usize>(
    a: &[Eight; M],
    b: &[Eight; M],
    add: Option<(f64, &[Eight; M])>,
) -> [Pack<V>; M] {
    let a = packs::<V>(a);
    let mut sum = [Pack::<V>::splat(0.0); M];
    for k in 0..M {
        for j in 0..M {
            sum[j] = a[k].mul_add(Pack::splat(b[j].0[k]), sum[j]);
        }
    }
    if let Some((alpha, d)) = add {
        let (alpha, d) = (Pack::splat(alpha), packs::<V>(d));
        for j in 0..M {
            sum[j] = alpha.mul_add(d[j], sum[j]);
        }
    }
    sum
}
