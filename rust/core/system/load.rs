//! What acts on a linear system from outside.

use crate::error::Result;

/// A load on `z' = A z + f(t)`.
pub trait Load: Send + Sync {
    /// `f(t)`, one double a component of the state.
    ///
    /// # Errors
    /// What the load reports.
    fn value(&self, t: f64, f: &mut [f64]) -> Result<()>;

    /// Whether there is more to it than a [`Generator`] makes.
    fn is_sampled(&self) -> bool;

    /// What the load adds to the state in each of the steps `k`, `k + 1`, …, one row a step: the
    /// integral of `exp((h - s) A) f(t + s)` over `0 < s < h`, but for what a [`Generator`] makes.
    ///
    /// # Errors
    /// What the load reports.
    fn impulses(&self, k: u64, rows: &mut [f64]) -> Result<()>;
}

/// A load in closed form: `f(t) = B g(t)`, `g' = Gamma g`. It is stepped along with the state, by
/// the exponential of both together, and so is as exact as the state.
#[derive(Clone, Debug, Default)]
pub struct Generator {
    /// `B`: a row for each component of the state, a column for each of `g`; row by row.
    pub inputs: Vec<f64>,
    /// `Gamma`, square, row by row.
    pub matrix: Vec<f64>,
    /// `g` at the start of the run.
    pub start: Vec<f64>,
}
