//! A bead on a spring along a swinging rod: study 6.3 of Huang, Deng & Yao (2007), eqs. 51-55.
//!
//! `H = px^2/(2 m) + pt^2/(2 (I + J)) + 1/2 M g L (1 - cos t) + m g (l - r cos t) + 1/2 k (m g/k + x)^2`, with
//! `I = M L^2/3`, `l = L + m g/k`, `r = l + x`, `J = m r^2` and the angle t. Eq. 54 as printed lacks the
//! constant `-m g`; the gradient of eq. 52 is used. The linear part is that at the equilibrium, the
//! rest exact.

use std::sync::Arc;

use super::{Native, positive};
use crate::error::Result;
use crate::linalg::kernel::{Lanes, Pack};
use crate::system::{Formula, Parts, Problem};

/// The pendulum; its state is `[x, t, px, pt]`.
#[derive(Clone, Debug)]
pub struct CompoundPendulum {
    rod_mass: f64,
    length: f64,
    bead_mass: f64,
    stiffness: f64,
    gravity: f64,
    /// The linear part, row by row.
    matrix: [f64; 16],
}

/// With the masses of rod and bead, length, stiffness and gravity.
///
/// # Errors
/// [`Error::Argument`](crate::Error::Argument) for numbers that are not positive.
pub fn make(parameters: &[f64]) -> Result<Native> {
    let names = ["rod_mass", "length", "bead_mass", "stiffness", "gravity"];
    let [rod_mass, length, bead_mass, stiffness, gravity] = positive(names, parameters)?;
    let model = CompoundPendulum::new(rod_mass, length, bead_mass, stiffness, gravity);
    let model = Arc::new(model);
    Ok(Native { problem: Problem::SemiLinear(model.clone()), hamiltonian: model })
}

impl CompoundPendulum {
    /// Masses in kg, length in m, stiffness in N/m, gravity in m/s^2, all positive.
    pub fn new(
        rod_mass: f64,
        length: f64,
        bead_mass: f64,
        stiffness: f64,
        gravity: f64,
    ) -> CompoundPendulum {
        let mut made =
            CompoundPendulum { rod_mass, length, bead_mass, stiffness, gravity, matrix: [0.0; 16] };
        let arm = made.rest();
        made.matrix[2] = 1.0 / bead_mass;
        made.matrix[4 + 3] = 1.0 / (made.inertia() + bead_mass * arm * arm);
        made.matrix[8] = -stiffness;
        made.matrix[12 + 1] = -(0.5 * rod_mass * length + bead_mass * arm) * gravity;
        made
    }

    fn inertia(&self) -> f64 {
        self.rod_mass * self.length * self.length / 3.0
    }

    /// What the bead's weight stretches the spring by.
    fn sag(&self) -> f64 {
        self.bead_mass * self.gravity / self.stiffness
    }

    /// The bead's distance from the pivot at rest.
    fn rest(&self) -> f64 {
        self.length + self.sag()
    }
}

impl Formula for CompoundPendulum {
    fn len(&self) -> usize {
        4
    }

    #[inline(always)]
    fn energy<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>]) -> Pack<V> {
        let CompoundPendulum { rod_mass, length, bead_mass: m, stiffness, gravity: g, .. } = *self;
        let [x, theta, px, ptheta] = *z else { unreachable!("4 components") };
        let (_, cos) = theta.sin_cos();
        let (r, stretch) = (self.rest() + x, self.sag() + x);
        px * px / (2.0 * m)
            + ptheta * ptheta / (2.0 * (self.inertia() + m * r * r))
            + 0.5 * rod_mass * g * length * (1.0 - cos)
            + m * g * (self.rest() - r * cos)
            + 0.5 * stiffness * stretch * stretch
    }

    #[inline(always)]
    fn rate<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]) {
        let CompoundPendulum { rod_mass, length, bead_mass: m, stiffness, gravity: g, .. } = *self;
        let [x, theta, px, ptheta] = *z else { unreachable!("4 components") };
        let (sin, cos) = theta.sin_cos();
        let arm = self.rest() + x;
        let moment = m * arm;
        let rate = ptheta / (self.inertia() + moment * arm);
        f.copy_from_slice(&[
            px * self.matrix[2],
            rate,
            moment * rate * rate - stiffness * x - m * g * (1.0 - cos),
            -(0.5 * rod_mass * length + moment) * g * sin,
        ]);
    }

    fn linear(&self) -> Option<&[f64]> {
        Some(&self.matrix)
    }
}

impl Parts for CompoundPendulum {
    #[inline(always)]
    fn remainder<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]) {
        let CompoundPendulum { rod_mass, length, bead_mass: m, gravity: g, .. } = *self;
        let [x, theta, _, ptheta] = *z else { unreachable!("4 components") };
        let (sin, cos) = theta.sin_cos();
        let arm = self.rest() + x;
        let moment = m * arm;
        let rate = ptheta / (self.inertia() + moment * arm);
        let weight = (0.5 * rod_mass * length + m * self.rest()) * g;
        f.copy_from_slice(&[
            Pack::splat(0.0),
            rate - self.matrix[7] * ptheta,
            moment * rate * rate - m * g * (1.0 - cos),
            weight * (theta - sin) - m * x * g * sin,
        ]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::{Flow, Hamiltonian, SemiLinear};

    #[test]
    fn rates_are_those_of_the_energy_and_the_split_adds_up() {
        let pendulum = CompoundPendulum::new(1.0, 1.0, 0.1, 100.0, 9.81914);
        let z = [0.1, 0.6, -0.2, 0.4];
        let (mut f, mut rest) = ([0.0; 4], [0.0; 4]);
        Flow::rate(&pendulum, 0.0, &z, &mut f).unwrap();
        SemiLinear::remainder(&pendulum, 0.0, &z, &mut rest).unwrap();
        for i in 0..4 {
            let d = 1e-5;
            let energy = |shift: f64| {
                let mut z = z;
                z[i] += shift;
                Hamiltonian::energy(&pendulum, 0.0, &z).unwrap()
            };
            let slope = (energy(d) - energy(-d)) / (2.0 * d);
            let rate = if i < 2 { -f[i + 2] } else { f[i - 2] };
            assert!((slope - rate).abs() <= 1e-8, "{i}");
            let linear: f64 = (0..4).map(|j| pendulum.matrix[4 * i + j] * z[j]).sum();
            assert!((linear + rest[i] - f[i]).abs() <= 1e-14, "{i}");
        }
    }
}
