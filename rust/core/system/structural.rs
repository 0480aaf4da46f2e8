//! `M q'' + (C + G) q' + K q = f(t)`.

use std::sync::Arc;

use super::Linear;
use crate::error::{Error, Result};
use crate::linalg::cholesky::{Cholesky, dot};

/// A linear structure, with its form of first order in `z = [q; p]`, `p = M q' + G q / 2`.
pub struct Structural {
    /// The form of first order, with the load.
    pub linear: Arc<Linear>,
    /// M, row by row.
    pub mass: Vec<f64>,
    /// C, row by row.
    pub damping: Vec<f64>,
    /// G, row by row.
    pub gyroscopic: Vec<f64>,
    /// K, row by row.
    pub stiffness: Vec<f64>,
}

impl Structural {
    /// Checks the sizes.
    ///
    /// # Errors
    /// [`Error::Argument`] for matrices that do not fit the state.
    pub fn check(self) -> Result<Structural> {
        let n = self.dof();
        let sizes = [&self.mass, &self.damping, &self.gyroscopic, &self.stiffness].map(|x| x.len());
        if sizes.iter().any(|&len| len != n * n) {
            return Err(Error::argument(format!(
                "a structure of {n} degrees of freedom needs {n} x {n} matrices"
            )));
        }
        Ok(self)
    }

    /// Degrees of freedom.
    pub fn dof(&self) -> usize {
        self.linear.rows() / 2
    }
}

/// Coordinates in which the energy is half the square of the state's length: with `M = L L^T` and
/// `K = F F^T` the state `(F^T q, L^-1 p)` moves by the skew matrix `[0 B; -B^T 0]`,
/// `B = F^T L^-T`. Matrices row by row, each entry a pair.
pub struct EnergyCoordinates {
    /// `B`.
    pub coupling: Vec<[f64; 2]>,
    /// `F^T` and its inverse.
    pub strain: [Vec<[f64; 2]>; 2],
    /// `L^-1` and its inverse.
    pub momentum: [Vec<[f64; 2]>; 2],
}

impl EnergyCoordinates {
    /// For symmetric matrices of `n` rows.
    ///
    /// # Errors
    /// [`Error::Argument`] naming the first pivot that is not positive.
    pub fn new(n: usize, mass: &[f64], stiffness: &[f64]) -> Result<EnergyCoordinates> {
        let definite = |what: &str, matrix: &[f64]| {
            Cholesky::new(n, matrix).map_err(|bad| {
                Error::argument(format!(
                    "coordinates: \"energy\" needs a positive definite {what}; the pivot of degree \
                     of freedom {bad} is not positive (a rigid mode?)"
                ))
            })
        };
        let (l, f) = (definite("mass", mass)?, definite("stiffness", stiffness)?);
        let (l_inverse, f_inverse) = (l.inverse(), f.inverse());
        let transposed = |x: &[[f64; 2]]| {
            let mut out = vec![[0.0; 2]; n * n];
            for i in 0..n {
                for j in 0..n {
                    out[j * n + i] = x[i * n + j];
                }
            }
            out
        };
        let f_transposed = transposed(f.factor());
        let mut coupling = vec![[0.0; 2]; n * n];
        for i in 0..n {
            // Row i of F^T begins at i, row j of L^-1 ends at j.
            for j in i..n {
                let terms = i..j + 1;
                let (x, y) = (&f_transposed[i * n..][terms.clone()], &l_inverse[j * n..][terms]);
                coupling[i * n + j] = dot(x, y);
            }
        }
        Ok(EnergyCoordinates {
            coupling,
            strain: [f_transposed, transposed(&f_inverse)],
            momentum: [l_inverse, l.factor().to_vec()],
        })
    }
}
