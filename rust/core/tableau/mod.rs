//! Coefficients of Runge-Kutta methods.

mod collocation;
mod gauss;

use std::borrow::Cow;

pub use collocation::{
    COLLOCATION2, COLLOCATION4, COLLOCATION6, COLLOCATION8, COLLOCATION12, COLLOCATION16,
    COLLOCATION24, COLLOCATION32,
};
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

/// A Gauss method as `L_i = h b_i f(Z_i)`, `Z_i = z + sum mu_ij L_j`, all stages solved together.
///
/// `mu_ij + mu_ji = 1` holds exactly, which makes the method symplectic as it is rounded. With the matrix
/// `b_i mu_ij = V diag(values) V^-1`, an iteration divides what is left of the equations by a linear part
/// for each eigenvalue alone.
#[derive(Clone, Copy, Debug)]
pub struct Collocation {
    /// Weights.
    pub b: &'static [f64],
    /// Places of the stages in the step.
    pub c: &'static [f64],
    /// `a_ij / b_j`, row by row.
    pub mu: &'static [f64],
    /// What extrapolates stages to those of the next step, row by row.
    pub ahead: &'static [f64],
    /// Eigenvalues with imaginary part of 0 or more: real parts.
    pub values_real: &'static [f64],
    /// Their rows of `V^-1`: real parts.
    pub forward_real: &'static [f64],
    /// Their columns of `V`, twice those of a pair of conjugates, one after another: real parts.
    pub backward_real: &'static [f64],
    /// Imaginary parts.
    pub values_imaginary: &'static [f64],
    /// Imaginary parts.
    pub forward_imaginary: &'static [f64],
    /// Imaginary parts.
    pub backward_imaginary: &'static [f64],
}

/// The tableau of a Gauss method of at most eight stages.
pub fn gauss(stages: usize) -> Option<Tableau> {
    match stages {
        1 => Some(GAUSS2),
        2 => Some(GAUSS4),
        3 => Some(GAUSS6),
        4 => Some(GAUSS8),
        6 => Some(GAUSS12),
        8 => Some(GAUSS16),
        _ => None,
    }
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

    const COLLOCATIONS: [Collocation; 8] = [
        COLLOCATION2,
        COLLOCATION4,
        COLLOCATION6,
        COLLOCATION8,
        COLLOCATION12,
        COLLOCATION16,
        COLLOCATION24,
        COLLOCATION32,
    ];

    #[test]
    fn ratios_are_symplectic_to_the_last_bit() {
        for table in COLLOCATIONS {
            let s = table.b.len();
            for i in 0..s {
                for j in 0..s {
                    assert_eq!(table.mu[s * i + j] + table.mu[s * j + i], 1.0, "{s}: {i} {j}");
                }
            }
        }
    }

    #[test]
    fn collocation_is_of_its_order() {
        for table in COLLOCATIONS {
            let s = table.b.len();
            for power in 0..2 * s {
                let sum: f64 = (0..s).map(|i| table.b[i] * table.c[i].powi(power as i32)).sum();
                assert!((sum - 1.0 / (power + 1) as f64).abs() <= 4e-16, "{s} {power}");
            }
            for i in 0..s {
                for power in 0..s {
                    let weight = |j: usize| table.mu[s * i + j] * table.b[j];
                    let sum: f64 =
                        (0..s).map(|j| weight(j) * table.c[j].powi(power as i32)).sum();
                    let wanted = table.c[i].powi(power as i32 + 1) / (power + 1) as f64;
                    assert!((sum - wanted).abs() <= 4e-16, "{s} {i} {power}");
                }
            }
        }
    }

    #[test]
    fn the_matrix_of_the_stages_is_that_of_its_eigenvalues() {
        for table in COLLOCATIONS {
            let (s, pairs) = (table.b.len(), table.values_real.len());
            let largest = table.backward_real.iter().fold(0.0_f64, |x, y| x.max(y.abs()));
            for i in 0..s {
                for j in 0..s {
                    let mut sum = 0.0;
                    for k in 0..pairs {
                        let [a, b] = [table.values_real[k], table.values_imaginary[k]];
                        let [c, d] =
                            [table.forward_real[s * k + j], table.forward_imaginary[s * k + j]];
                        // Complex products, of which the real part counts.
                        let (re, im) = (a * c - b * d, a * d + b * c);
                        let at = s * k + i;
                        sum += table.backward_real[at] * re - table.backward_imaginary[at] * im;
                    }
                    let wanted = table.b[i] * table.mu[s * i + j];
                    // Rounding of large vectors.
                    assert!((sum - wanted).abs() <= 1e-15 * largest.max(1.0), "{s}: {i} {j}");
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
