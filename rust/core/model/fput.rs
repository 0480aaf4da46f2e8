//! A chain of stiff linear and soft quartic springs in turn (Fermi, Pasta, Ulam & Tsingou 1955; Hairer, Lubich
//! & Wanner, Geometric Numerical Integration, I.5.1).
//!
//! `q = (x, y)`: the middles of the m stiff springs and their lengths;
//! `H = |p|^2/2 + w^2/2 sum y_i^2 + 1/4 [(x_1 - y_1)^4 + sum (x_i+1 - y_i+1 - x_i - y_i)^4 + (x_m + y_m)^4]`.
//! The energy of the stiff springs is nearly conserved over long times, though they exchange it.

use std::sync::Arc;

use super::{Native, separable};
use crate::error::{Error, Result};
use crate::system::{Flow, Hamiltonian, SemiLinear, Separable};

/// The chain; its state is `[x, y, px, py]`, m numbers each.
#[derive(Clone)]
pub struct Chain {
    springs: usize,
    frequency: f64,
    /// The linear part, row by row.
    matrix: Vec<f64>,
}

/// With the number of stiff springs and their frequency.
///
/// # Errors
/// [`Error::Argument`] for numbers that are not positive, or not whole.
pub fn make(parameters: &[f64]) -> Result<Native> {
    match *parameters {
        [springs, frequency]
            if springs >= 1.0
                && springs.fract() == 0.0
                && springs <= 1e6
                && frequency > 0.0
                && frequency.is_finite() =>
        {
            let (m, n) = (springs as usize, 4 * springs as usize);
            let mut matrix = vec![0.0; n * n];
            for i in 0..2 * m {
                matrix[n * i + 2 * m + i] = 1.0;
            }
            for i in m..2 * m {
                matrix[n * (2 * m + i) + i] = -frequency * frequency;
            }
            Ok(separable(Chain { springs: m, frequency, matrix }))
        }
        _ => Err(Error::argument("springs, frequency: must be a whole and a positive number")),
    }
}

impl Chain {
    /// Adds the forces of the soft springs; their energy.
    fn soft(&self, q: &[f64], mut push: impl FnMut(usize, f64)) -> f64 {
        let m = self.springs;
        let (x, y) = q.split_at(m);
        let mut total = 0.0;
        for i in 0..=m {
            let right = if i < m { x[i] - y[i] } else { 0.0 };
            let left = if i > 0 { x[i - 1] + y[i - 1] } else { 0.0 };
            let d = right - left;
            total += 0.25 * d * d * d * d;
            let force = d * d * d;
            if i < m {
                push(i, -force);
                push(m + i, force);
            }
            if i > 0 {
                push(i - 1, force);
                push(m + i - 1, force);
            }
        }
        total
    }
}

impl Flow for Chain {
    fn len(&self) -> usize {
        4 * self.springs
    }
    fn linear(&self) -> Option<&[f64]> {
        Some(&self.matrix)
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        let n = 2 * self.springs;
        self.velocity(&z[n..], &mut f[..n])?;
        self.force(t, &z[..n], &mut f[n..])
    }
}

impl Separable for Chain {
    fn velocity(&self, p: &[f64], rate: &mut [f64]) -> Result<()> {
        rate.copy_from_slice(p);
        Ok(())
    }
    fn force(&self, _t: f64, q: &[f64], rate: &mut [f64]) -> Result<()> {
        let m = self.springs;
        rate[..m].fill(0.0);
        for (rate, y) in rate[m..].iter_mut().zip(&q[m..]) {
            *rate = -self.frequency * self.frequency * y;
        }
        self.soft(q, |i, force| rate[i] += force);
        Ok(())
    }
    fn semilinear(&self) -> Option<Arc<dyn SemiLinear>> {
        Some(Arc::new(self.clone()))
    }
}

impl SemiLinear for Chain {
    fn matrix(&self) -> &[f64] {
        &self.matrix
    }
    fn remainder(&self, _t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        let n = 2 * self.springs;
        f.fill(0.0);
        self.soft(&z[..n], |i, force| f[n + i] += force);
        Ok(())
    }
}

impl Hamiltonian for Chain {
    fn energy(&self, _t: f64, z: &[f64]) -> Result<f64> {
        let n = 2 * self.springs;
        let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        let stiff = self.frequency * self.frequency * square(&z[self.springs..n]);
        Ok(0.5 * (square(&z[n..]) + stiff) + self.soft(&z[..n], |_, _| ()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_energy_and_the_split_adds_up() {
        let native = make(&[3.0, 5.0]).unwrap();
        let z: Vec<f64> = (0..12).map(|i| ((5 * i) % 7) as f64 / 10.0 - 0.3).collect();
        assert!(super::super::rate_defect(&*native.hamiltonian, &z) < 1e-10);
        let split = native.problem.semilinear().unwrap();
        let (mut rest, mut whole) = (vec![0.0; 12], vec![0.0; 12]);
        split.remainder(0.0, &z, &mut rest).unwrap();
        split.rate(0.0, &z, &mut whole).unwrap();
        for i in 0..12 {
            let linear: f64 = (0..12).map(|j| split.matrix()[12 * i + j] * z[j]).sum();
            assert!((linear + rest[i] - whole[i]).abs() < 1e-14);
        }
    }
}
