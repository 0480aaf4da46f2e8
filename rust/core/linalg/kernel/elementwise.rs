//! Moves of matrices, their sums and norms.

use super::pack::{Lanes, Pack, packs, packs_mut};
use super::{Body, Eight, Layout};

/// Copies plain contiguous columns into packed ones, with zeros in the rows that pad them.
pub struct PackColumns<'a> {
    /// How the packed columns lie in memory.
    pub layout: Layout,
    /// The plain columns.
    pub plain: &'a [f64],
    /// The packed columns.
    pub packed: &'a mut [Eight],
}

impl Body for PackColumns<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Layout { rows, height, stride } = self.layout;
        let columns = self.plain.chunks_exact(rows).zip(self.packed.chunks_exact_mut(stride));
        for (plain, packed) in columns {
            for (i, packed) in packs_mut::<V>(&mut packed[..height]).iter_mut().enumerate() {
                *packed = Pack::load(&plain[8 * i..]);
            }
        }
    }
}

/// Copies packed columns into plain contiguous ones; returns whether all numbers are finite.
pub struct UnpackColumns<'a> {
    /// How the packed columns lie in memory.
    pub layout: Layout,
    /// The packed columns.
    pub packed: &'a [Eight],
    /// The plain columns.
    pub plain: &'a mut [f64],
}

impl Body for UnpackColumns<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<V: Lanes>(self) -> bool {
        let Layout { rows, height, stride } = self.layout;
        let zero = Pack::<V>::splat(0.0);
        // 0 for every finite number, not a number for the others.
        let mut sum = zero;
        let columns = self.packed.chunks_exact(stride).zip(self.plain.chunks_exact_mut(rows));
        for (packed, plain) in columns {
            for (i, packed) in packs::<V>(&packed[..height]).iter().enumerate() {
                packed.store(&mut plain[8 * i..]);
                sum = packed.mul_add(zero, sum);
            }
        }
        sum.sum() == 0.0
    }
}

/// Several sums `outs[k] = sum of c[k][i] X[i]` of the same matrices in one pass, each term by one
/// fused multiply-add, in the order given.
pub struct Sums<'a, const N: usize, const K: usize> {
    /// The matrices.
    pub x: [&'a [Eight]; N],
    /// Coefficients of each sum.
    pub c: [[f64; N]; K],
    /// The results.
    pub outs: [&'a mut [Eight]; K],
}

impl<const N: usize, const K: usize> Body for Sums<'_, N, K> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let len = self.outs[0].len();
        let mut x: [&[Pack<V>]; N] = [&[]; N];
        for i in 0..N {
            x[i] = &packs::<V>(self.x[i])[..len];
        }
        for at in 0..len {
            for k in 0..K {
                let mut sum = Pack::<V>::splat(0.0);
                for i in 0..N {
                    sum = Pack::splat(self.c[k][i]).mul_add(x[i][at], sum);
                }
                packs_mut::<V>(self.outs[k])[at] = sum;
            }
        }
    }
}

/// Multiplies by a number.
pub struct Scale<'a> {
    /// The matrix.
    pub x: &'a mut [Eight],
    /// The number.
    pub factor: f64,
}

impl Body for Scale<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let factor = Pack::<V>::splat(self.factor);
        for x in packs_mut::<V>(self.x) {
            *x = *x * factor;
        }
    }
}

/// The largest column sums of magnitudes (1-norms) of `T` and of `I + T`.
pub struct ColumnSums<'a> {
    /// How the columns lie in memory.
    pub layout: Layout,
    /// The matrix, square.
    pub t: &'a [Eight],
}

impl Body for ColumnSums<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<V: Lanes>(self) -> [f64; 2] {
        let Layout { rows, height, stride } = self.layout;
        let (mut norm_t, mut norm_w) = (0.0, 0.0);
        for j in 0..rows {
            let column = &self.t[j * stride..][..height];
            let mut sum = Pack::<V>::splat(0.0);
            for x in packs::<V>(column) {
                sum = sum + x.abs();
            }
            let sum = sum.sum();
            let diagonal = column[j / 8].0[j % 8];
            // Written so that a sum that is not a number is kept, not passed over.
            norm_t = if sum <= norm_t { norm_t } else { sum };
            let with_identity = sum - diagonal.abs() + (1.0 + diagonal).abs();
            norm_w = if with_identity <= norm_w { norm_w } else { with_identity };
        }
        [norm_t, norm_w]
    }
}

/// The largest magnitude of each row over some columns, merged into `largest`.
pub struct Maxima<'a> {
    /// How the columns lie in memory.
    pub layout: Layout,
    /// The columns.
    pub x: &'a [Eight],
    /// What has been found so far: `height` packs.
    pub largest: &'a mut [Eight],
}

impl Body for Maxima<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Layout { height, stride, .. } = self.layout;
        let x = packs::<V>(self.x);
        for (i, largest) in packs_mut::<V>(self.largest)[..height].iter_mut().enumerate() {
            let mut found = *largest;
            for x in x[i..].iter().step_by(stride) {
                found = x.abs().max(found);
            }
            *largest = found;
        }
    }
}

/// Sums of magnitudes of rows and of columns.
pub struct Sides<'a> {
    /// How the columns lie in memory.
    pub layout: Layout,
    /// The matrix, square.
    pub a: &'a [Eight],
    /// Sums of rows: `height` packs.
    pub rows: &'a mut [Eight],
    /// Sums of columns, one double each.
    pub columns: &'a mut [f64],
}

impl Body for Sides<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Layout { height, stride, .. } = self.layout;
        let rows = &mut packs_mut::<V>(self.rows)[..height];
        for row in &mut *rows {
            *row = Pack::splat(0.0);
        }
        for (column, total) in packs::<V>(self.a).chunks_exact(stride).zip(self.columns) {
            let mut sum = Pack::<V>::splat(0.0);
            for (x, row) in column.iter().zip(&mut *rows) {
                *row = *row + x.abs();
                sum = sum + x.abs();
            }
            *total = sum.sum();
        }
    }
}

/// Whether all entries are finite.
pub struct Finite<'a> {
    /// The entries.
    pub x: &'a [Eight],
}

impl Body for Finite<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<V: Lanes>(self) -> bool {
        let zero = Pack::<V>::splat(0.0);
        // 0 for every finite number, not a number for the others; four sums, so that none waits.
        let mut sums = [zero; 4];
        let mut groups = packs::<V>(self.x).chunks_exact(4);
        for group in &mut groups {
            for i in 0..4 {
                sums[i] = group[i].mul_add(zero, sums[i]);
            }
        }
        for x in groups.remainder() {
            sums[0] = x.mul_add(zero, sums[0]);
        }
        ((sums[0] + sums[1]) + (sums[2] + sums[3])).sum() == 0.0
    }
}
