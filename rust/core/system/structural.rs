//! `M q'' + (C + G) q' + K q = f(t)`.

use std::sync::Arc;

use super::Linear;
use crate::error::{Error, Result};

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
