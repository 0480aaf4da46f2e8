//! When an iteration is at its end.

use crate::error::Result;
use crate::method::common::not_solved;

/// Iterations at most.
const CAP: u32 = 50;

/// What the next iteration may leave undone, in parts of the state.
const ROUNDING: f64 = 1e-15;

/// Change, in parts of the state, from which on momenta follow it to first order.
const SMALL: f64 = 1e-9;

/// Stops at rounding, or at a tolerance.
pub struct Limit(f64);

impl Limit {
    /// At rounding unless told otherwise.
    pub fn new(tolerance: Option<f64>) -> Limit {
        Limit(tolerance.unwrap_or(ROUNDING))
    }

    /// Whether a change of `moved`, of a state of `size`, is the last one; `last` keeps it for the
    /// next time.
    ///
    /// # Errors
    /// [`Error::Convergence`](crate::Error::Convergence) where it is no number, or at the cap.
    pub fn reached(
        &self,
        name: &str,
        t: f64,
        iteration: u32,
        moved: f64,
        size: f64,
        last: &mut f64,
    ) -> Result<bool> {
        // The next change shrinks as the last one has; nothing is known of the first.
        let left = if last.is_finite() { moved * (moved / *last).min(1.0) } else { moved };
        if moved <= SMALL * size && (left <= self.0 * size || moved >= *last) {
            return Ok(true);
        }
        if !moved.is_finite() || iteration == CAP {
            return Err(not_solved(name, t, 0, iteration, moved / size));
        }
        *last = moved;
        Ok(false)
    }
}
