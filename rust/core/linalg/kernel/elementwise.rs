//! Sums of matrices and their norms.

use super::pack::{Lanes, Pack, packs, packs_mut};
use super::{Body, Eight, Layout};

/// `out = sum of c X`, each term by one fused multiply-add, in the order given.
pub struct Sum<'a, const N: usize> {
    /// Coefficients and matrices.
    pub terms: [(f64, &'a [Eight]); N],
    /// The result.
    pub out: &'a mut [Eight],
}

impl<const N: usize> Body for Sum<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let len = self.out.len();
        let out = packs_mut::<V>(self.out);
        let mut terms: [&[Pack<V>]; N] = [&[]; N];
        for (packed, (_, x)) in terms.iter_mut().zip(&self.terms) {
            *packed = &packs::<V>(x)[..len];
        }
        for (at, out) in out.iter_mut().enumerate() {
            let mut sum = Pack::<V>::splat(0.0);
            for i in 0..N {
                sum = Pack::splat(self.terms[i].0).mul_add(terms[i][at], sum);
            }
            *out = sum;
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
        let mut sum = zero;
        for x in packs::<V>(self.x) {
            // 0 for every finite number, not a number for the others.
            sum = x.mul_add(zero, sum);
        }
        sum.sum() == 0.0
    }
}
