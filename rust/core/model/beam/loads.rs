//! What acts on the beam from outside.

use crate::error::Result;

/// Torques and forces at one time.
#[derive(Clone, Debug, Default)]
pub struct Applied {
    /// Torque on the hub, N m.
    pub hub: f64,
    /// Torque of the motor between hub and beam, N m.
    pub joint: f64,
    /// Force on the tip, N.
    pub tip: [f64; 2],
    /// Force on each element, N/m, uniform over it; empty where there is none.
    pub distributed: Vec<[f64; 2]>,
}

/// Torques and forces over time, which may depend on the state.
pub trait Loads: Send + Sync {
    /// Whether forces turn with the section they act on; they have fixed directions otherwise.
    fn follow(&self) -> bool;

    /// Those at a time and state `z = [q; phi; p]`.
    ///
    /// # Errors
    /// What the function reports.
    fn at(&self, t: f64, z: &[f64], applied: &mut Applied) -> Result<()>;
}
