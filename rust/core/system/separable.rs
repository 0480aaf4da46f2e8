//! `q' = v(p)`, `p' = f(t, q)`: what explicit splitting needs.

use std::sync::Arc;

use super::{Flow, SemiLinear};
use crate::error::Result;

/// A system whose energy is a kinetic part of the momenta and a potential of the coordinates.
pub trait Separable: Flow {
    /// `q'`.
    ///
    /// # Errors
    /// As [`Flow::rate`].
    fn velocity(&self, p: &[f64], rate: &mut [f64]) -> Result<()>;

    /// `p'`.
    ///
    /// # Errors
    /// As [`Flow::rate`].
    fn force(&self, t: f64, q: &[f64], rate: &mut [f64]) -> Result<()>;

    /// The same with its stiff linear part apart, where it has one.
    fn semilinear(&self) -> Option<Arc<dyn SemiLinear>> {
        None
    }
}
