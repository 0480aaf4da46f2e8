//! Bodies under their mutual gravity, in space: the sun and its outer planets for one.
//!
//! `H = sum |p_i|^2/(2 m_i) - sum over pairs of G m_i m_j/|q_i - q_j|`. Energy, momentum and angular momentum are
//! invariants.

use super::{Native, separable};
use crate::error::{Error, Result};
use crate::linalg::kernel::{Lanes, Pack};
use crate::system::{Formula, SplitFormula, split_rate};

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
    /// What lies between two bodies, and the square of its length.
    #[inline(always)]
    fn between<V: Lanes>(q: &[Pack<V>], i: usize, j: usize) -> ([Pack<V>; 3], Pack<V>) {
        let d = [0, 1, 2].map(|k| q[3 * i + k] - q[3 * j + k]);
        let [x, y, z] = d;
        (d, x * x + y * y + z * z)
    }
}

impl Formula for Bodies {
    fn len(&self) -> usize {
        6 * self.masses.len()
    }
    #[inline(always)]
    fn energy<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>]) -> Pack<V> {
        let (q, p) = z.split_at(z.len() / 2);
        let mut total = Pack::splat(0.0);
        for (i, m) in self.masses.iter().enumerate() {
            for p in &p[3 * i..3 * i + 3] {
                total = total + *p * *p * (0.5 / m);
            }
        }
        for (i, m) in self.masses.iter().enumerate() {
            for (j, other) in self.masses[..i].iter().enumerate() {
                let (_, square) = Self::between(q, i, j);
                total = total - self.gravity * m * other / square.sqrt();
            }
        }
        total
    }
    #[inline(always)]
    fn rate<V: Lanes>(&self, t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]) {
        split_rate(self, t, z, f);
    }
}

impl SplitFormula for Bodies {
    #[inline(always)]
    fn velocity<V: Lanes>(&self, p: &[Pack<V>], rate: &mut [Pack<V>]) {
        for (i, (rate, p)) in rate.iter_mut().zip(p).enumerate() {
            *rate = *p / self.masses[i / 3];
        }
    }
    #[inline(always)]
    fn force<V: Lanes>(&self, _t: Pack<V>, q: &[Pack<V>], rate: &mut [Pack<V>]) {
        rate.fill(Pack::splat(0.0));
        for (i, m) in self.masses.iter().enumerate() {
            for (j, other) in self.masses[..i].iter().enumerate() {
                let (d, square) = Self::between(q, i, j);
                // No number where they collide.
                let pull = self.gravity * m * other / (square * square.sqrt());
                for k in 0..3 {
                    rate[3 * i + k] = rate[3 * i + k] - pull * d[k];
                    rate[3 * j + k] = rate[3 * j + k] + pull * d[k];
                }
            }
        }
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
