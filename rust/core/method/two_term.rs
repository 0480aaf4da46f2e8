//! Two-term stepping: free motion of separable systems at half the products.

use std::sync::Arc;

use super::linear::LinearSteps;
use super::{Bound, MethodInfo, Needs};
use crate::error::Error;
use crate::expm::{Propagator, Recipe, TwoTerm, is_separable};
use crate::system::Linear;

/// Whether a system is one this steps.
pub(super) fn takes(system: &Linear) -> bool {
    system.load().is_none() && is_separable(system.rows(), system.matrix())
}

pub(super) const TWO_TERM: MethodInfo = MethodInfo {
    name: "two_term",
    aliases: &[],
    summary: "three-level recurrence with exact cosines: half the products, for free undamped motion; \
              rounding grows with the square of time",
    order: None,
    symplectic: true,
    symmetric: true,
    energy_preserving: true,
    needs: Needs::Separable,
    reproducible: "every machine",
    reference: "Hairer, Lubich & Wanner, Geometric Numerical Integration (2006), XIII.1",
    options: &[],
    build: |problem, h, _, watch| {
        let Some(system) = problem.linear() else {
            return Err(Error::unsupported("two_term: needs a linear system"));
        };
        let (rows, matrix) = (system.rows(), system.matrix());
        let propagator = Propagator::new(rows, matrix, h, Recipe::EXACT, None, watch)?;
        let steps = LinearSteps::new(TwoTerm::new(Arc::new(propagator), watch)?, rows, &[]);
        Ok(Box::new(Bound::new(steps, system.clone(), String::new())))
    },
};
