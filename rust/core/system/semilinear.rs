//! `z' = A z + F(z, t)`: a stiff linear part, and the rest.

use super::{Flow, Linear};
use crate::error::Result;
use crate::linalg::kernel::{Eight, doubles, doubles_mut};

/// A system split into a constant linear part and a remainder.
pub trait SemiLinear: Flow {
    /// A, row by row.
    fn matrix(&self) -> &[f64];

    /// `F(z, t)`.
    ///
    /// # Errors
    /// As [`Flow::rate`].
    fn remainder(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()>;

    /// Remainders of up to eight states at once, each a lane: of times, and of `len` components. The first
    /// `count` are wanted, lanes beyond hold a valid state; `scratch` has twice `len`.
    ///
    /// # Errors
    /// As [`Flow::rate`].
    fn remainders(
        &self,
        t: &Eight,
        z: &[Eight],
        f: &mut [Eight],
        count: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        let (state, rest) = scratch.split_at_mut(self.len());
        for lane in 0..count {
            for (x, z) in state.iter_mut().zip(doubles(z)[lane..].iter().step_by(8)) {
                *x = *z;
            }
            self.remainder(t.0[lane], state, rest)?;
            for (f, x) in doubles_mut(f)[lane..].iter_mut().step_by(8).zip(&*rest) {
                *f = *x;
            }
        }
        Ok(())
    }

    /// Whether the remainder is a force that coordinates alone, and time, make: `F = (0, f(q, t))`.
    fn is_force(&self) -> bool {
        false
    }
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

    fn is_force(&self) -> bool {
        self.load().is_none() && self.len().is_multiple_of(2)
    }
}
