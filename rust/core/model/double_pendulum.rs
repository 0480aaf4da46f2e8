//! Two point masses on rods, one hanging from the other; angles from the vertical. Chaotic, and no part of
//! its energy is separable.

use std::sync::Arc;

use super::{Native, positive};
use crate::error::Result;
use crate::linalg::kernel::{Lanes, Pack};
use crate::system::{Formula, Problem};

/// The pendulum; its state is `[theta1, theta2, p1, p2]`.
pub struct DoublePendulum {
    masses: [f64; 2],
    lengths: [f64; 2],
    gravity: f64,
}

/// With masses, lengths and gravity.
///
/// # Errors
/// [`Error::Argument`](crate::Error::Argument) for numbers that are not positive.
pub fn make(parameters: &[f64]) -> Result<Native> {
    let names = ["mass1", "mass2", "length1", "length2", "gravity"];
    let [m1, m2, l1, l2, gravity] = positive(names, parameters)?;
    let model = Arc::new(DoublePendulum { masses: [m1, m2], lengths: [l1, l2], gravity });
    Ok(Native { problem: Problem::Hamiltonian(model.clone()), hamiltonian: model })
}

impl Formula for DoublePendulum {
    fn len(&self) -> usize {
        4
    }
    #[inline(always)]
    fn energy<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>]) -> Pack<V> {
        let ([m1, m2], [l1, l2], g) = (self.masses, self.lengths, self.gravity);
        let [theta1, theta2, p1, p2] = *z else { unreachable!("4 components") };
        let (sin, cos) = (theta1 - theta2).sin_cos();
        let (cos1, cos2) = (theta1.sin_cos().1, theta2.sin_cos().1);
        let square = m2 * l2 * l2 * p1 * p1 + (m1 + m2) * l1 * l1 * p2 * p2
            - 2.0 * m2 * l1 * l2 * p1 * p2 * cos;
        let kinetic = square / (2.0 * m2 * l1 * l1 * l2 * l2 * (m1 + m2 * sin * sin));
        kinetic - (m1 + m2) * g * l1 * cos1 - m2 * g * l2 * cos2
    }
    #[inline(always)]
    fn rate<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]) {
        let ([m1, m2], [l1, l2], g) = (self.masses, self.lengths, self.gravity);
        let [theta1, theta2, p1, p2] = *z else { unreachable!("4 components") };
        let (sin, cos) = (theta1 - theta2).sin_cos();
        let (sin1, sin2) = (theta1.sin_cos().0, theta2.sin_cos().0);
        let D = m1 + m2 * sin * sin;
        let both = m1 + m2;
        // 2 K = square / (m2 l1^2 l2^2 D); how it changes with the difference of the angles.
        let square =
            m2 * l2 * l2 * p1 * p1 + both * l1 * l1 * p2 * p2 - 2.0 * m2 * l1 * l2 * p1 * p2 * cos;
        let by_cos = p1 * p2 * sin / (l1 * l2 * D);
        let by_sin = square * sin * cos / (l1 * l1 * l2 * l2 * D * D);
        f.copy_from_slice(&[
            (l2 * p1 - l1 * p2 * cos) / (l1 * l1 * l2 * D),
            (both * l1 * p2 - m2 * l2 * p1 * cos) / (m2 * l1 * l2 * l2 * D),
            -both * g * l1 * sin1 - by_cos + by_sin,
            -m2 * g * l2 * sin2 + by_cos - by_sin,
        ]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_energy() {
        let native = make(&[1.0, 0.7, 1.2, 0.9, 9.81]).unwrap();
        let z = [0.7, -0.4, 0.5, 1.1];
        assert!(super::super::rate_defect(&*native.hamiltonian, &z) < 1e-9);
    }
}
