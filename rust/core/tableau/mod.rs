//! Coefficients of Runge-Kutta methods.

mod gauss;

use std::borrow::Cow;

pub use gauss::{GAUSS2, GAUSS4, GAUSS6, GAUSS8, GAUSS12, GAUSS16};

use crate::error::{Error, Result};

/// `a`, row by row, `b` and `c` of `Z_i = z + h sum a_ij f(Z_j)`, `z + h sum b_i f(Z_i)`.
#[derive(Clone, Copy, Debug)]
pub struct Tableau {
    /// Of the stages.
    pub a: &'static [f64],
    /// Of the step.
    pub b: &'static [f64],
    /// Places of the stages in the step.
    pub c: &'static [f64],
}

/// The paper's two stages, eq. 30.
pub const SRK2: Tableau = Tableau { a: &[0.25, 0.0, 0.5, 0.25], b: &[0.5, 0.5], c: &[0.25, 0.75] };

/// A tableau of whatever origin.
#[derive(Clone, Debug)]
pub struct Stages {
    /// Row by row.
    pub a: Cow<'static, [f64]>,
    /// Weights.
    pub b: Cow<'static, [f64]>,
    /// Places.
    pub c: Cow<'static, [f64]>,
}

impl From<Tableau> for Stages {
    fn from(given: Tableau) -> Stages {
        Stages { a: given.a.into(), b: given.b.into(), c: given.c.into() }
    }
}

impl Stages {
    /// Of a user's numbers; places are the sums of rows.
    ///
    /// # Errors
    /// [`Error::Argument`] for sizes that do not match, numbers that are not finite, or weights that
    /// do not add up to 1.
    pub fn new(a: &[f64], b: &[f64]) -> Result<Stages> {
        let s = b.len();
        if s == 0 || a.len() != s * s {
            return Err(Error::argument("tableau: a must be (s, s) and b (s,)"));
        }
        if !a.iter().chain(b).all(|x| x.is_finite()) {
            return Err(Error::argument("tableau: all coefficients must be finite"));
        }
        let total: f64 = b.iter().sum();
        if (total - 1.0).abs() > 1e-12 {
            return Err(Error::argument(format!("tableau: b must add up to 1, not to {total}")));
        }
        let c: Vec<f64> = a.chunks_exact(s).map(|row| row.iter().sum()).collect();
        Ok(Stages { a: a.to_vec().into(), b: b.to_vec().into(), c: c.into() })
    }

    /// Number of stages.
    pub fn count(&self) -> usize {
        self.b.len()
    }

    /// How stages depend on each other.
    pub fn shape(&self) -> Shape {
        let s = self.count();
        let zero = |i: usize, j: usize| self.a[s * i + j] == 0.0;
        let upper = (0..s).all(|i| (i + 1..s).all(|j| zero(i, j)));
        match (upper, (0..s).all(|i| zero(i, i))) {
            (true, true) => Shape::Explicit,
            (true, false) => Shape::Diagonal,
            (false, _) => Shape::Full,
        }
    }

    /// Largest `|b_i a_ij + b_j a_ji - b_i b_j|`: 0 for symplectic methods (Theorem 1 of the paper;
    /// Sanz-Serna 1988, Lasagni 1988, Suris 1988).
    pub fn symplectic_defect(&self) -> f64 {
        let (s, b) = (self.count(), &self.b);
        let mut worst = 0.0_f64;
        for i in 0..s {
            for j in 0..s {
                let [ij, ji] = [self.a[s * i + j], self.a[s * j + i]];
                worst = worst.max((b[i] * ij + b[j] * ji - b[i] * b[j]).abs());
            }
        }
        worst
    }
}

/// How stages depend on each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// On those before alone.
    Explicit,
    /// On those before and on themselves.
    Diagonal,
    /// All on all.
    Full,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_tableaus_are_symplectic_and_of_their_order() {
        for (s, tableau) in
            [(1, GAUSS2), (2, GAUSS4), (3, GAUSS6), (4, GAUSS8), (6, GAUSS12), (8, GAUSS16)]
        {
            let stages = Stages::from(tableau);
            // Rounding of products of numbers below 1.
            assert!(stages.symplectic_defect() <= 2e-16, "{s}");
            // Quadrature of order 2 s, and stages of order s: both give order 2 s (Butcher's B, C, D).
            for power in 0..2 * s {
                let sum: f64 = (0..s).map(|i| stages.b[i] * stages.c[i].powi(power as i32)).sum();
                assert!((sum - 1.0 / (power + 1) as f64).abs() <= 4e-16, "{s} {power}");
            }
            for i in 0..s {
                for power in 0..s {
                    let row = &stages.a[s * i..][..s];
                    let sum: f64 = (0..s).map(|j| row[j] * stages.c[j].powi(power as i32)).sum();
                    let wanted = stages.c[i].powi(power as i32 + 1) / (power + 1) as f64;
                    assert!((sum - wanted).abs() <= 4e-16, "{s} {i} {power}");
                }
            }
        }
    }

    #[test]
    fn the_papers_tableau_is_symplectic_and_the_classical_one_is_not() {
        assert_eq!(Stages::from(SRK2).symplectic_defect(), 0.0);
        let a = [0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let classical = Stages::new(&a, &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0]).unwrap();
        assert_eq!(classical.shape(), Shape::Explicit);
        assert!((classical.symplectic_defect() - 1.0 / 9.0).abs() < 1e-15);
    }
}
