//! Bodies under their mutual gravity, in space: the sun and its outer planets for one.
//!
//! `H = sum |p_i|^2/(2 m_i) - sum over pairs of G m_i m_j/|q_i - q_j|`. Energy, momentum and angular momentum are
//! invariants.

use super::{Native, separable};
use crate::error::{Error, Result};
use crate::system::{Flow, Hamiltonian, Separable};

/// The bodies; the state is the places of all, then their momenta.
pub struct Bodies {
    gravity: f64,
    masses: Vec<f64>,
}

/// With G and the masses of two bodies or more.
///
/// # Errors
/// [`Error::Argument`] for numbers that are not positive, or fewer.
pub fn make(parameters: &[f64]) -> Result<Native> {
    let good = |x: &f64| *x > 0.0 && x.is_finite();
    match parameters {
        [gravity, masses @ ..] if masses.len() > 1 && parameters.iter().all(good) => {
            Ok(separable(Bodies { gravity: *gravity, masses: masses.to_vec() }))
        }
        _ => Err(Error::argument("masses: two positive ones or more are needed, and a positive G")),
    }
}

impl Bodies {
    /// Calls with each pair of bodies, what lies between them, and its length.
    fn pairs(&self, q: &[f64], mut with: impl FnMut(usize, usize, [f64; 3], f64)) {
        for i in 0..self.masses.len() {
            for j in 0..i {
                let d = std::array::from_fn(|k| q[3 * i + k] - q[3 * j + k]);
                let [x, y, z] = d;
                with(i, j, d, (x * x + y * y + z * z).sqrt());
            }
        }
    }
}

impl Flow for Bodies {
    fn len(&self) -> usize {
        6 * self.masses.len()
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        let n = z.len() / 2;
        self.velocity(&z[n..], &mut f[..n])?;
        self.force(t, &z[..n], &mut f[n..])
    }
}

impl Separable for Bodies {
    fn velocity(&self, p: &[f64], rate: &mut [f64]) -> Result<()> {
        for (i, (rate, p)) in rate.iter_mut().zip(p).enumerate() {
            *rate = p / self.masses[i / 3];
        }
        Ok(())
    }
    fn force(&self, t: f64, q: &[f64], rate: &mut [f64]) -> Result<()> {
        rate.fill(0.0);
        let mut nearest = f64::INFINITY;
        self.pairs(q, |i, j, d, distance| {
            nearest = nearest.min(distance);
            let pull =
                self.gravity * self.masses[i] * self.masses[j] / (distance * distance * distance);
            for k in 0..3 {
                rate[3 * i + k] -= pull * d[k];
                rate[3 * j + k] += pull * d[k];
            }
        });
        if nearest == 0.0 {
            let message = format!("outer solar system: two bodies collide at t = {t:.6}");
            return Err(Box::new(Error::Model { message, t, step: 0 }));
        }
        Ok(())
    }
}

impl Hamiltonian for Bodies {
    fn energy(&self, _t: f64, z: &[f64]) -> Result<f64> {
        let (q, p) = z.split_at(z.len() / 2);
        let square = |i: usize| p[3 * i..3 * i + 3].iter().map(|p| p * p).sum::<f64>();
        let mut total: f64 = self.masses.iter().enumerate().map(|(i, m)| 0.5 * square(i) / m).sum();
        self.pairs(q, |i, j, _, distance| {
            total -= self.gravity * self.masses[i] * self.masses[j] / distance;
        });
        Ok(total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_energy() {
        let bodies = Bodies { gravity: 0.7, masses: vec![1.0, 2.0, 0.5] };
        let z: Vec<f64> = (0..18).map(|i| ((7 * i) % 11) as f64 / 5.0 - 1.0).collect();
        assert!(super::super::rate_defect(&bodies, &z) < 1e-9);
    }
}
