//! `z' = A z + F(z, t)`: a stiff linear part, and the rest.

use super::{Flow, Linear};
use crate::error::Result;

/// A system split into a constant linear part and a remainder.
pub trait SemiLinear: Flow {
    /// A, row by row.
    fn matrix(&self) -> &[f64];

    /// `F(z, t)`.
    ///
    /// # Errors
    /// As [`Flow::rate`].
    fn remainder(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()>;
}

impl SemiLinear for Linear {
    fn matrix(&self) -> &[f64] {
        Linear::matrix(self)
    }

    fn remainder(&self, t: f64, _z: &[f64], f: &mut [f64]) -> Result<()> {
        match self.load() {
            Some(load) => load.value(t, f),
            None => {
                f.fill(0.0);
                Ok(())
            }
        }
    }
}
