//! What can be integrated.

mod about;
mod formula;
mod linear;
mod load;
mod semilinear;
mod separable;
mod structural;

use std::sync::Arc;

pub use about::About;
pub use formula::{Formula, Parts, SplitFormula, split_rate};
pub use linear::Linear;
pub use load::{Generator, Load, Record};
pub use semilinear::SemiLinear;
pub use separable::Separable;
pub use structural::{EnergyCoordinates, Structural};

use crate::error::Result;
use crate::linalg::kernel::{Eight, doubles, doubles_mut};
use crate::model::beam::{Beam, BeamParts};

/// A system `z' = f(t, z)`.
///
/// The base of all systems: methods that need no structure ask for no more. What a system can do
/// beyond this is a trait of its own ([`Hamiltonian`]) and a variant of [`Problem`].
pub trait Flow: Send + Sync {
    /// Length of the state.
    fn len(&self) -> usize;

    /// Whether there is no state.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The rate of one state.
    ///
    /// # Errors
    /// What the system reports, a user's exception as [`Error::Callback`](crate::Error::Callback).
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()>;

    /// The rates of `count` states at once, in blocks of eight: one [`Eight`] of times a block, then
    /// `len` of components. Lanes beyond hold a valid state; their rates may stay as they are.
    ///
    /// # Errors
    /// As [`rate`](Self::rate).
    fn rates(
        &self,
        t: &[Eight],
        z: &[Eight],
        f: &mut [Eight],
        count: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        let len = self.len();
        let (state, rate) = scratch[..2 * len].split_at_mut(len);
        for (block, t) in t.iter().enumerate() {
            let z = &doubles(z)[8 * len * block..][..8 * len];
            let f = &mut doubles_mut(f)[8 * len * block..][..8 * len];
            for (lane, t) in t.0.iter().enumerate().take(count.saturating_sub(8 * block)) {
                for (component, x) in state.iter_mut().enumerate() {
                    *x = z[8 * component + lane];
                }
                self.rate(*t, state, rate)?;
                for (component, x) in rate.iter().enumerate() {
                    f[8 * component + lane] = *x;
                }
            }
        }
        Ok(())
    }

    /// Doubles of scratch that [`rates`](Self::rates) needs.
    fn scratch_len(&self) -> usize {
        2 * self.len()
    }

    /// A constant part `A` of the rates, row by row, that implicit methods solve within their
    /// iterations: it says how fast they converge, never what they converge to.
    fn linear(&self) -> Option<&[f64]> {
        None
    }

    /// The Jacobian of the rates, row by row; false where the system does not know it.
    ///
    /// # Errors
    /// As [`rate`](Self::rate).
    fn jacobian(&self, _t: f64, _z: &[f64], _out: &mut [f64]) -> Result<bool> {
        Ok(false)
    }
}

/// A system with an energy, `z = [q; p]`, `q' = dH/dp`, `p' = -dH/dq`.
pub trait Hamiltonian: Flow {
    /// The energy of a state.
    ///
    /// # Errors
    /// As [`Flow::rate`].
    fn energy(&self, t: f64, z: &[f64]) -> Result<f64>;
}

/// A system as methods see it: by its structure, most specific first.
#[derive(Clone)]
pub enum Problem {
    /// A linear structure with its matrices.
    Structural(Arc<Structural>),
    /// `z' = A z + f(t)`.
    Linear(Arc<Linear>),
    /// A beam on a rotating hub.
    Beam(Arc<Beam>),
    /// Kinetic energy of momenta, potential of coordinates.
    Separable(Arc<dyn Separable>),
    /// A stiff linear part and a remainder.
    SemiLinear(Arc<dyn SemiLinear>),
    /// A system with an energy.
    Hamiltonian(Arc<dyn Hamiltonian>),
    /// Any system.
    Flow(Arc<dyn Flow>),
}

impl Problem {
    /// The system as a mere flow.
    pub fn flow(&self) -> Arc<dyn Flow> {
        match self {
            Problem::Structural(system) => system.linear.clone(),
            Problem::Linear(system) => system.clone(),
            Problem::Beam(system) => system.clone(),
            Problem::Separable(system) => system.clone(),
            Problem::SemiLinear(system) => system.clone(),
            Problem::Hamiltonian(system) => system.clone(),
            Problem::Flow(system) => system.clone(),
        }
    }

    /// The system as a linear one, if it is.
    pub fn linear(&self) -> Option<&Arc<Linear>> {
        match self {
            Problem::Structural(system) => Some(&system.linear),
            Problem::Linear(system) => Some(system),
            _ => None,
        }
    }

    /// The system as a linear part and a remainder, if it is known as one.
    pub fn semilinear(&self) -> Option<Arc<dyn SemiLinear>> {
        match self {
            Problem::SemiLinear(system) => Some(system.clone()),
            Problem::Separable(system) => system.semilinear(),
            Problem::Beam(beam) => {
                BeamParts::new(beam.clone()).map(|parts| Arc::new(parts) as Arc<dyn SemiLinear>)
            }
            _ => Some(self.linear()?.clone()),
        }
    }

    /// What the structure is called in messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Problem::Structural(_) => "a linear structure",
            Problem::Linear(_) => "a linear system",
            Problem::Beam(_) => "a rotating beam",
            Problem::Separable(_) => "a separable system",
            Problem::SemiLinear(_) => "a semilinear system",
            Problem::Hamiltonian(_) => "a Hamiltonian system",
            Problem::Flow(_) => "a general system z' = f(t, z)",
        }
    }
}
