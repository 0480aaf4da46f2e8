//! The classical Runge–Kutta method of order 4: a baseline.
//!
//! Explicit, neither symplectic nor symmetric: it loses energy, and blows up beyond
//! `h w_max = 2.828`. Four evaluations a step.
//!
//! Source: Kutta (1901); Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, II.1.

use super::{MethodInfo, Needs, State, Stepper, Work, bind_flow};
use crate::error::{Error, Result};
use crate::system::Flow;

struct Rk4 {
    h: f64,
    /// Slopes k1..k4.
    k: [Vec<f64>; 4],
    stage: Vec<f64>,
}

impl<S: Flow + ?Sized> Stepper<S> for Rk4 {
    fn step(
        &mut self,
        system: &S,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let h = self.h;
        let z = &mut state.z;
        system.rate(t, z, &mut self.k[0])?;
        for (i, c) in [0.5, 0.5, 1.0].into_iter().enumerate() {
            for ((stage, z), slope) in self.stage.iter_mut().zip(&*z).zip(&self.k[i]) {
                *stage = z + c * h * slope;
            }
            system.rate(t + c * h, &self.stage, &mut self.k[i + 1])?;
        }
        let [k1, k2, k3, k4] = &self.k;
        for (i, stage) in self.stage.iter_mut().enumerate() {
            *stage = z[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
        if let Some(component) = self.stage.iter().position(|x| !x.is_finite()) {
            return Err(Box::new(Error::Model {
                message: format!(
                    "rk4: component {component} of the state would be {} after the step from t = \
                     {t}; explicit methods need h w_max < 2.828: reduce the step",
                    self.stage[component],
                ),
                t,
                step: k,
            }));
        }
        z.copy_from_slice(&self.stage);
        work.steps += 1;
        work.evaluations += 4;
        Ok(())
    }
}

pub(super) const RK4: MethodInfo = MethodInfo {
    name: "rk4",
    aliases: &[],
    summary: "classical Runge-Kutta, a baseline: loses energy, unstable beyond h w_max = 2.828",
    order: Some(4),
    symplectic: false,
    symmetric: false,
    energy_preserving: false,
    needs: Needs::Flow,
    reproducible: "every machine",
    reference: "Kutta (1901)",
    options: &[],
    build: |problem, h, _, _| {
        let len = problem.flow().len();
        let zeros = || vec![0.0; len];
        Ok(bind_flow(Rk4 { h, k: std::array::from_fn(|_| zeros()), stage: zeros() }, problem))
    },
};
