//! Two midpoint steps of half the size, on any system.

use crate::error::Result;
use crate::method::gauss::Gauss;
use crate::method::{State, Stepper, Work};
use crate::system::Flow;

/// A midpoint step of half the size, and the state before the first of two.
pub struct Halves {
    half: Gauss,
    h: f64,
    before: State,
}

impl Halves {
    /// Of the method for half a step.
    pub fn new(half: Gauss, h: f64) -> Halves {
        Halves { half, h, before: State { z: Vec::new(), carried: Vec::new() } }
    }
}

impl Stepper<dyn Flow> for Halves {
    fn carried_len(&self) -> usize {
        self.half.carried_len()
    }

    fn step(
        &mut self,
        system: &(dyn Flow + 'static),
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        keep(&mut self.before, state);
        self.half.step(system, k, t, state, work)?;
        // The second half goes on from the first, also in the first step.
        let second = self.half.step(system, k.max(1), t + 0.5 * self.h, state, work);
        work.steps -= 1;
        second.map_err(|error| {
            keep(state, &self.before);
            error.in_step(k)
        })
    }
}

/// Copies a state into memory that is there.
fn keep(to: &mut State, from: &State) {
    to.z.clone_from(&from.z);
    to.carried.clone_from(&from.carried);
}
