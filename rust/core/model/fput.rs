//! A chain of stiff linear and soft quartic springs in turn (Fermi, Pasta, Ulam & Tsingou 1955; Hairer, Lubich
//! & Wanner, Geometric Numerical Integration, I.5.1).
//!
//! `q = (x, y)`: the middles of the m stiff springs and their lengths;
//! `H = |p|^2/2 + w^2/2 sum y_i^2 + 1/4 [(x_1 - y_1)^4 + sum (x_i+1 - y_i+1 - x_i - y_i)^4 + (x_m + y_m)^4]`.
//! The energy of the stiff springs is nearly conserved over long times, though they exchange it.

use std::sync::{Arc, OnceLock};

use super::{Native, positive, separable};
use crate::error::{Error, Result};
use crate::linalg::kernel::{Lanes, Pack};
use crate::system::{Formula, Parts, SemiLinear, SplitFormula, split_rate};

/// Stiff springs up to which there is a linear part: it is a full matrix, of 128 MiB then.
const LARGEST: usize = 1024;

/// And to which methods may take exponentials of it, some of which take twenty seconds then.
const EXPONENTIAL: usize = 256;

/// The chain; its state is `[x, y, px, py]`, m numbers each.
#[derive(Clone)]
pub struct Chain {
    springs: usize,
    frequency: f64,
    /// The linear part, row by row, from when somebody asks for it.
    matrix: Arc<OnceLock<Vec<f64>>>,
}

/// With the number of stiff springs and their frequency.
///
/// # Errors
/// [`Error::Argument`] for numbers that are not positive, or not whole, and for more than 1e6 springs.
pub fn make(parameters: &[f64]) -> Result<Native> {
    match *parameters {
        [springs, _] if !((1.0..=1e6).contains(&springs) && springs.fract() == 0.0) => {
            Err(Error::argument(format!(
                "springs: must be a whole number from 1 to 1e6, got {springs}"
            )))
        }
        [springs, frequency] => {
            positive(["frequency"], &[frequency])?;
            Ok(separable(Chain { springs: springs as usize, frequency, matrix: Arc::default() }))
        }
        _ => Err(Error::argument("model: 2 parameters are needed")),
    }
}

impl Chain {
    fn linear_part(&self) -> Vec<f64> {
        let (m, n) = (self.springs, 4 * self.springs);
        let mut matrix = vec![0.0; n * n];
        for i in 0..2 * m {
            matrix[n * i + 2 * m + i] = 1.0;
        }
        for i in m..2 * m {
            matrix[n * (2 * m + i) + i] = -self.frequency * self.frequency;
        }
        matrix
    }

    /// Adds the forces of the soft springs; their energy.
    #[inline(always)]
    fn soft<V: Lanes>(&self, q: &[Pack<V>], force: Option<&mut [Pack<V>]>) -> Pack<V> {
        let (m, zero) = (self.springs, Pack::splat(0.0));
        let (x, y) = q.split_at(m);
        // Between two stiff springs, and at the walls.
        let stretch = |i: usize| {
            let right = if i < m { x[i] - y[i] } else { zero };
            let left = if i > 0 { x[i - 1] + y[i - 1] } else { zero };
            right - left
        };
        if let Some(force) = force {
            let (on_x, on_y) = force.split_at_mut(m);
            let cube = |d: Pack<V>| d * d * d;
            let mut left = cube(stretch(0));
            for i in 0..m {
                let right = cube(stretch(i + 1));
                (on_x[i], on_y[i]) = (on_x[i] + (right - left), on_y[i] + (right + left));
                left = right;
            }
            return zero;
        }
        (0..=m).fold(zero, |total, i| {
            let square = stretch(i) * stretch(i);
            total + 0.25 * (square * square)
        })
    }
}

impl Formula for Chain {
    fn len(&self) -> usize {
        4 * self.springs
    }
    #[inline(always)]
    fn energy<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>]) -> Pack<V> {
        let (q, p) = z.split_at(2 * self.springs);
        let stiff = self.frequency * self.frequency * squares(&q[self.springs..]);
        0.5 * (squares(p) + stiff) + self.soft(q, None)
    }
    #[inline(always)]
    fn rate<V: Lanes>(&self, t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]) {
        split_rate(self, t, z, f);
    }
    fn linear(&self) -> Option<&[f64]> {
        let made = || &self.matrix.get_or_init(|| self.linear_part())[..];
        (self.springs <= LARGEST).then(made)
    }
}

#[inline(always)]
fn squares<V: Lanes>(x: &[Pack<V>]) -> Pack<V> {
    x.iter().fold(Pack::splat(0.0), |sum, x| sum + *x * *x)
}

impl SplitFormula for Chain {
    #[inline(always)]
    fn velocity<V: Lanes>(&self, p: &[Pack<V>], rate: &mut [Pack<V>]) {
        rate.copy_from_slice(p);
    }
    #[inline(always)]
    fn force<V: Lanes>(&self, _t: Pack<V>, q: &[Pack<V>], rate: &mut [Pack<V>]) {
        let m = self.springs;
        rate[..m].fill(Pack::splat(0.0));
        for (rate, y) in rate[m..].iter_mut().zip(&q[m..]) {
            *rate = -(self.frequency * self.frequency) * *y;
        }
        self.soft(q, Some(rate));
    }
    fn semilinear(&self) -> Option<Arc<dyn SemiLinear>> {
        (self.springs <= EXPONENTIAL).then(|| Arc::new(self.clone()) as Arc<dyn SemiLinear>)
    }
}

impl Parts for Chain {
    #[inline(always)]
    fn remainder<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]) {
        let n = 2 * self.springs;
        f.fill(Pack::splat(0.0));
        self.soft(&z[..n], Some(&mut f[n..]));
    }
    fn is_force(&self) -> bool {
        true
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

    #[test]
    fn a_chain_of_a_million_springs_has_rates_and_no_matrix() {
        let native = make(&[1e6, 50.0]).unwrap();
        let z = vec![0.5; 4_000_000];
        let mut f = vec![f64::NAN; z.len()];
        native.hamiltonian.rate(0.0, &z, &mut f).unwrap();
        assert!(f.iter().all(|x| x.is_finite()));
        assert!(native.problem.semilinear().is_none() && native.hamiltonian.linear().is_none());
    }
}
