//! The one linear solve of a Padé ratio, by a library's factorisation.
//!
//! nalgebra up to 32 rows: plain loops, the same bits on every machine. faer above: its blocked
//! kernels choose instructions by themselves, so results are reproducible on one machine only; the
//! records of `pade` and `spim` say so.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{MatMut, MatRef};
use nalgebra::{DMatrix, Dyn};

use crate::error::{Error, Result};
use crate::linalg::dense::{self, Watch};
use crate::linalg::kernel::{Eight, Layout, doubles, doubles_mut};

const SMALL: usize = 32;

enum Factors {
    Small(nalgebra::LU<f64, Dyn, Dyn>),
    Large(PartialPivLu<f64>),
}

/// `P D = L U`.
pub struct Lu {
    layout: Layout,
    factors: Factors,
}

impl Lu {
    /// Factors a square matrix.
    ///
    /// # Errors
    /// [`Error::Singular`] where a pivot vanishes; what `watch` reports.
    pub fn new(layout: Layout, d: &[Eight], watch: &mut Watch) -> Result<Lu> {
        watch()?;
        let m = layout.rows;
        let factors = if m <= SMALL {
            let d = DMatrix::from_fn(m, m, |i, j| doubles(d)[j * layout.doubles() + i]);
            let lu = d.lu();
            if !lu.is_invertible() {
                return Err(singular());
            }
            Factors::Small(lu)
        } else {
            let d = MatRef::from_column_major_slice_with_stride(doubles(d), m, m, layout.doubles());
            Factors::Large(d.partial_piv_lu())
        };
        watch()?;
        Ok(Lu { layout, factors })
    }

    /// `X <- D^-1 X`.
    pub fn solve(&self, x: &mut [Eight]) {
        let (m, stride) = (self.layout.rows, self.layout.doubles());
        match &self.factors {
            Factors::Small(lu) => {
                let plain = DMatrix::from_fn(m, m, |i, j| doubles(x)[j * stride + i]);
                // A solution that is not to be had stays not a number; the residual check reports it.
                let plain = lu.solve(&plain).unwrap_or_else(|| DMatrix::repeat(m, m, f64::NAN));
                for (j, column) in plain.column_iter().enumerate() {
                    doubles_mut(x)[j * stride..][..m].copy_from_slice(column.as_slice());
                }
            }
            Factors::Large(lu) => {
                let x =
                    MatMut::from_column_major_slice_with_stride_mut(doubles_mut(x), m, m, stride);
                lu.solve_in_place(x);
            }
        }
    }

    /// Believes a solution whose residual `D X - B` is that of rounding.
    pub fn check(&self, residual: &[Eight], d: &[Eight], x: &[Eight], b: &[Eight]) -> Result<()> {
        let norm = |x| dense::norms(self.layout, x)[0];
        let rounding = f64::EPSILON * self.layout.rows as f64 * (norm(d) * norm(x) + norm(b));
        if norm(residual) <= 100.0 * rounding { Ok(()) } else { Err(singular()) }
    }

    /// Believes a refined solution whose last correction was below rounding.
    pub fn check_refined(&self, correction: f64, solution: f64) -> Result<()> {
        if correction <= f64::EPSILON * solution { Ok(()) } else { Err(singular()) }
    }
}

fn singular() -> Box<Error> {
    Box::new(Error::Singular(
        "the denominator of the Padé ratio is singular to working precision; take more doublings, \
         or method \"sid\" or \"exact\", which need no inverse"
            .into(),
    ))
}
