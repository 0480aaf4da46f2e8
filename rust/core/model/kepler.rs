//! Two bodies under gravity in a plane: `H = |p|^2/2 - mu/|q|`. Energy, angular momentum and the direction of
//! the ellipse are invariants.

use super::{Native, positive, separable};
use crate::error::Result;
use crate::linalg::kernel::{Lanes, Pack};
use crate::system::{Formula, SplitFormula, split_rate};

/// The system; its state is `[x, y, px, py]`.
pub struct Kepler {
    /// Gravitational parameter.
    mu: f64,
}

/// With mu.
///
/// # Errors
/// [`Error::Argument`](crate::Error::Argument) for a number that is not positive.
pub fn make(parameters: &[f64]) -> Result<Native> {
    let [mu] = positive(["mu"], parameters)?;
    Ok(separable(Kepler { mu }))
}

impl Formula for Kepler {
    fn len(&self) -> usize {
        4
    }
    #[inline(always)]
    fn energy<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>]) -> Pack<V> {
        let [x, y, px, py] = *z else { unreachable!("4 components") };
        0.5 * (px * px + py * py) - self.mu / (x * x + y * y).sqrt()
    }
    #[inline(always)]
    fn rate<V: Lanes>(&self, t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]) {
        split_rate(self, t, z, f);
    }
}

impl SplitFormula for Kepler {
    #[inline(always)]
    fn velocity<V: Lanes>(&self, p: &[Pack<V>], rate: &mut [Pack<V>]) {
        rate.copy_from_slice(p);
    }
    #[inline(always)]
    fn force<V: Lanes>(&self, _t: Pack<V>, q: &[Pack<V>], rate: &mut [Pack<V>]) {
        let [x, y] = *q else { unreachable!("2 coordinates") };
        let square = x * x + y * y;
        // No number where the bodies collide.
        let pull = self.mu / (square * square.sqrt());
        rate.copy_from_slice(&[-pull * x, -pull * y]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_energy() {
        assert!(super::super::rate_defect(&Kepler { mu: 1.3 }, &[0.8, -0.5, 0.3, 0.9]) < 1e-10);
    }
}
