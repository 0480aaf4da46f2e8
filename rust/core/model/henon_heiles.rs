//! Hénon & Heiles (1964): `H = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2 y - y^3/3`. Chaotic from an energy of 1/12
//! on, unbounded from 1/6.

use super::{Native, positive, separable};
use crate::error::Result;
use crate::system::{Flow, Hamiltonian, Separable};

/// The system; its state is `[x, y, px, py]`.
pub struct HenonHeiles;

/// Without parameters.
///
/// # Errors
/// [`Error::Argument`](crate::Error::Argument) for parameters.
pub fn make(parameters: &[f64]) -> Result<Native> {
    positive([], parameters)?;
    Ok(separable(HenonHeiles))
}

impl Flow for HenonHeiles {
    fn len(&self) -> usize {
        4
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.velocity(&z[2..], &mut f[..2])?;
        self.force(t, &z[..2], &mut f[2..])
    }
}

impl Separable for HenonHeiles {
    fn velocity(&self, p: &[f64], rate: &mut [f64]) -> Result<()> {
        rate.copy_from_slice(p);
        Ok(())
    }
    fn force(&self, _t: f64, q: &[f64], rate: &mut [f64]) -> Result<()> {
        let [x, y] = [q[0], q[1]];
        rate.copy_from_slice(&[-x - 2.0 * x * y, -y - (x * x - y * y)]);
        Ok(())
    }
}

impl Hamiltonian for HenonHeiles {
    fn energy(&self, _t: f64, z: &[f64]) -> Result<f64> {
        let [x, y, px, py] = *z else { unreachable!("4 components") };
        let kinetic = 0.5 * (px * px + py * py);
        Ok(kinetic + 0.5 * (x * x + y * y) + x * x * y - y * y * y / 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_energy() {
        assert!(super::super::rate_defect(&HenonHeiles, &[0.1, -0.2, 0.3, 0.05]) < 1e-11);
    }
}
