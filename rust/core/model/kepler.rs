//! Two bodies under gravity in a plane: `H = |p|^2/2 - mu/|q|`. Energy, angular momentum and the direction of
//! the ellipse are invariants.

use super::{Native, positive, separable};
use crate::error::{Error, Result};
use crate::system::{Flow, Hamiltonian, Separable};

/// The system; its state is `[x, y, px, py]`.
pub struct Kepler {
    /// Gravitational parameter.
    mu: f64,
}

/// With mu.
///
/// # Errors
/// [`Error::Argument`] for a number that is not positive.
pub fn make(parameters: &[f64]) -> Result<Native> {
    let [mu] = positive(["mu"], parameters)?;
    Ok(separable(Kepler { mu }))
}

impl Flow for Kepler {
    fn len(&self) -> usize {
        4
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.velocity(&z[2..], &mut f[..2])?;
        self.force(t, &z[..2], &mut f[2..])
    }
}

impl Separable for Kepler {
    fn velocity(&self, p: &[f64], rate: &mut [f64]) -> Result<()> {
        rate.copy_from_slice(p);
        Ok(())
    }
    fn force(&self, t: f64, q: &[f64], rate: &mut [f64]) -> Result<()> {
        let square = q[0] * q[0] + q[1] * q[1];
        if square == 0.0 {
            let message = format!("kepler: the bodies collide at t = {t:.6}");
            return Err(Box::new(Error::Model { message, t, step: 0 }));
        }
        let pull = self.mu / (square * square.sqrt());
        rate.copy_from_slice(&[-pull * q[0], -pull * q[1]]);
        Ok(())
    }
}

impl Hamiltonian for Kepler {
    fn energy(&self, _t: f64, z: &[f64]) -> Result<f64> {
        let [x, y, px, py] = *z else { unreachable!("4 components") };
        Ok(0.5 * (px * px + py * py) - self.mu / (x * x + y * y).sqrt())
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
