//! The Störmer-Verlet method and its symmetric compositions: explicit, symplectic, for separable systems.
//!
//! A composition takes Verlet steps of `gamma_i h`, some of them backward; forces where one ends serve where
//! the next begins. Sources: Yoshida (1990); Suzuki & Umeno (1993); Hairer, Lubich & Wanner, Geometric
//! Numerical Integration, I.1.4 and V.3.2.

use super::common::check_finite;
use super::{Bound, MethodInfo, Needs, State, Step, Stepper, Work};
use crate::error::Result;
use crate::system::{Problem, Separable};

/// Half of a palindrome and its middle: the weights of the steps, first to middle.
type Half = &'static [f64];

/// One step.
const ONE: Half = &[1.0];

/// `1/(2 - 2^(1/3))` and `1 - 2/(2 - 2^(1/3))`.
const FOURTH: Half = &[1.351_207_191_959_657_7, -1.702_414_383_919_315_3];

/// Yoshida's solution A of order 6, seven steps.
const SIXTH: Half = &[
    0.784_513_610_477_557_3,
    0.235_573_213_359_358_13,
    -1.177_679_984_178_871,
    1.315_186_320_683_911_2,
];

/// Suzuki & Umeno's fifteen steps of order 8.
const EIGHTH: Half = &[
    0.741_670_364_350_613,
    -0.409_100_825_800_031_6,
    0.190_754_710_296_238_4,
    -0.573_862_471_116_082_3,
    0.299_064_181_303_655_9,
    0.334_624_918_245_298_2,
    0.315_293_092_396_766_6,
    -0.796_887_939_352_916_4,
];

struct Composition {
    name: &'static str,
    h: f64,
    weights: Half,
    z: Vec<f64>,
    velocity: Vec<f64>,
    force: Vec<f64>,
}

fn build(name: &'static str, weights: Half, problem: &Problem, h: f64) -> Result<Box<dyn Step>> {
    let Problem::Separable(system) = problem else { unreachable!("the record's need") };
    let m = system.len();
    let zeros = |len: usize| vec![0.0; len];
    let method =
        Composition { name, h, weights, z: zeros(m), velocity: zeros(m / 2), force: zeros(m / 2) };
    Ok(Box::new(Bound::new(method, system.clone(), String::new())))
}

/// `x += k y`.
fn add(x: &mut [f64], k: f64, y: &[f64]) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x += k * y);
}

impl Stepper<dyn Separable> for Composition {
    fn step(
        &mut self,
        system: &dyn Separable,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        self.z.copy_from_slice(&state.z);
        let (q, p) = self.z.split_at_mut(self.force.len());
        system.force(t, q, &mut self.force)?;
        work.evaluations += 1;
        let mut time = t;
        let (half, count) = (self.weights, 2 * self.weights.len() - 1);
        for i in 0..count {
            let h = half[i.min(count - 1 - i)] * self.h;
            add(p, 0.5 * h, &self.force);
            system.velocity(p, &mut self.velocity)?;
            add(q, h, &self.velocity);
            time += h;
            system.force(time, q, &mut self.force)?;
            add(p, 0.5 * h, &self.force);
            work.evaluations += 1;
        }
        check_finite(self.name, t, k, &self.z)?;
        state.z.copy_from_slice(&self.z);
        work.steps += 1;
        Ok(())
    }
}

/// Order 2.
pub const VERLET: MethodInfo = MethodInfo {
    name: "verlet",
    aliases: &["stormer_verlet", "leapfrog"],
    summary: "Störmer-Verlet, explicit",
    order: Some(2),
    symplectic: true,
    symmetric: true,
    energy_preserving: false,
    needs: Needs::Split,
    reproducible: "on every machine",
    reference: "Hairer, Lubich & Wanner, Geometric Numerical Integration, I.1.4",
    options: &[],
    build: |problem, h, _, _| build("verlet", ONE, problem, h),
};

/// Order 4, three Verlet steps.
pub const YOSHIDA4: MethodInfo = MethodInfo {
    name: "yoshida4",
    aliases: &[],
    summary: "composition of 3 Verlet steps",
    order: Some(4),
    reference: "Yoshida, Phys. Lett. A 150 (1990) 262",
    build: |problem, h, _, _| build("yoshida4", FOURTH, problem, h),
    ..VERLET
};

/// Order 6, seven Verlet steps.
pub const YOSHIDA6: MethodInfo = MethodInfo {
    name: "yoshida6",
    summary: "composition of 7 Verlet steps",
    order: Some(6),
    build: |problem, h, _, _| build("yoshida6", SIXTH, problem, h),
    ..YOSHIDA4
};

/// Order 8, fifteen Verlet steps.
pub const YOSHIDA8: MethodInfo = MethodInfo {
    name: "yoshida8",
    summary: "composition of 15 Verlet steps",
    order: Some(8),
    reference: "Suzuki & Umeno (1993); Hairer, Lubich & Wanner, V.3.2",
    build: |problem, h, _, _| build("yoshida8", EIGHTH, problem, h),
    ..YOSHIDA4
};
