//! The Newmark family: baselines of structural dynamics, order 2.
//!
//! `q+ = q + h v + h^2 ((1/2 - beta) a + beta a+)`, `v+ = v + h ((1 - gamma) a + gamma a+)`, with the
//! equation of motion balanced between the ends of the step: its inertia at `1 - alpha_m`, the rest
//! at `1 - alpha_f` of the way. Newmark's own methods have both alphas 0; `beta = 0` is the central
//! difference; the alphas of Chung & Hulbert damp what the step does not resolve.
//!
//! The matrix of a step is inverted once, refined in pairs of doubles. `z = [q; p]` is the state;
//! velocity and acceleration are carried.
//!
//! Sources: Newmark, J. Eng. Mech. Div. ASCE 85 (1959); Chung & Hulbert, J. Appl. Mech. 60 (1993).

use std::sync::Arc;

use super::{Bound, MethodInfo, Needs, OptionInfo, Options, State, Step, Stepper, Work};
use crate::error::{Error, Result};
use crate::expm::quotient;
use crate::linalg::dense::Watch;
use crate::linalg::kernel::doubles_mut;
use crate::system::{Problem, Structural};

struct Rule {
    alpha_m: f64,
    alpha_f: f64,
    beta: f64,
    gamma: f64,
}

/// Grid points for which loads are asked for at once.
const AHEAD: usize = 256;

struct Newmark {
    h: f64,
    rule: Rule,
    /// Inverse of the matrix of the accelerations, and of the mass, row by row.
    inverse: Vec<f64>,
    inverse_mass: Vec<f64>,
    /// Loads at grid points from `from` on.
    loads: Vec<f64>,
    from: Option<u64>,
    work: [Vec<f64>; 5],
}

impl Newmark {
    fn new(system: &Structural, h: f64, rule: Rule, watch: &mut Watch) -> Result<Newmark> {
        let n = system.dof();
        let mut identity = vec![0.0; n * n];
        identity.iter_mut().step_by(n + 1).for_each(|x| *x = 1.0);
        let (early, late) = (1.0 - rule.alpha_m, 1.0 - rule.alpha_f);
        let matrix: Vec<f64> = (0..n * n)
            .map(|i| {
                let rates = system.damping[i] + system.gyroscopic[i];
                early * system.mass[i]
                    + late * h * (rule.gamma * rates + rule.beta * h * system.stiffness[i])
            })
            .collect();
        let mut inverses = [vec![0.0; n * n], vec![0.0; n * n]];
        for (inverse, matrix) in inverses.iter_mut().zip([&matrix, &system.mass]) {
            quotient(n, matrix, &identity, inverse, watch)?;
        }
        let [inverse, inverse_mass] = inverses;
        let loads = vec![0.0; if system.linear.load().is_some() { AHEAD * 2 * n } else { 0 }];
        let work = std::array::from_fn(|_| vec![0.0; n]);
        Ok(Newmark { h, rule, inverse, inverse_mass, loads, from: None, work })
    }

    /// Adds `factor` times the load at grid point `k` to `out`.
    fn add_load(&mut self, system: &Structural, k: u64, factor: f64, out: usize) -> Result<()> {
        let Some(load) = system.linear.load() else { return Ok(()) };
        let n = system.dof();
        if !self.from.is_some_and(|from| (from..from + AHEAD as u64).contains(&k)) {
            let from = k - k % AHEAD as u64;
            self.from = None;
            load.grid_values(from, &mut self.loads)?;
            self.from = Some(from);
        }
        let row = (k % AHEAD as u64) as usize * 2 * n + n;
        for (out, f) in self.work[out].iter_mut().zip(&self.loads[row..row + n]) {
            *out += factor * f;
        }
        Ok(())
    }
}

/// `out += factor A x`, A row by row.
fn add_product(a: &[f64], x: &[f64], factor: f64, out: &mut [f64]) {
    for (out, row) in out.iter_mut().zip(a.chunks_exact(x.len())) {
        *out += factor * row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
    }
}

/// Places in the work space: next displacements, velocities, the force, accelerations, means.
const FORCE: usize = 2;
const NEXT: usize = 3;

impl Stepper<Structural> for Newmark {
    fn carried_len(&self) -> usize {
        // Velocity and acceleration.
        (2 * self.work[NEXT].len()).div_ceil(8)
    }

    fn block(&self) -> u64 {
        AHEAD as u64
    }

    fn step(
        &mut self,
        system: &Structural,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let n = system.dof();
        let Rule { alpha_m, alpha_f, beta, gamma } = self.rule;
        let h = self.h;
        if k == 0 {
            // The acceleration that balances the start.
            self.work[FORCE].fill(0.0);
            self.add_load(system, 0, 1.0, FORCE)?;
            let (q, p) = state.z.split_at(n);
            let (v, a) = doubles_mut(&mut state.carried)[..2 * n].split_at_mut(n);
            self.work[NEXT].copy_from_slice(p);
            add_product(&system.gyroscopic, q, -0.5, &mut self.work[NEXT]);
            v.fill(0.0);
            add_product(&self.inverse_mass, &self.work[NEXT], 1.0, v);
            let force = &mut self.work[FORCE];
            add_product(&system.stiffness, q, -1.0, force);
            add_product(&system.damping, v, -1.0, force);
            add_product(&system.gyroscopic, v, -1.0, force);
            a.fill(0.0);
            add_product(&self.inverse_mass, force, 1.0, a);
            work.evaluations += 1;
        }
        self.work[FORCE].fill(0.0);
        self.add_load(system, k + 1, 1.0 - alpha_f, FORCE)?;
        if alpha_f != 0.0 {
            self.add_load(system, k, alpha_f, FORCE)?;
        }
        let (v, a) = doubles_mut(&mut state.carried)[..2 * n].split_at_mut(n);
        let [q_next, v_next, force, a_next, mean] = &mut self.work;
        for i in 0..n {
            q_next[i] = state.z[i] + h * v[i] + h * h * (0.5 - beta) * a[i];
            v_next[i] = v[i] + h * (1.0 - gamma) * a[i];
        }
        let mut resist = |matrix: &[f64], next: &[f64], now: &[f64], force: &mut [f64]| {
            for i in 0..n {
                mean[i] = (1.0 - alpha_f) * next[i] + alpha_f * now[i];
            }
            add_product(matrix, mean, -1.0, force);
        };
        resist(&system.stiffness, q_next, &state.z[..n], force);
        resist(&system.damping, v_next, v, force);
        resist(&system.gyroscopic, v_next, v, force);
        if alpha_m != 0.0 {
            add_product(&system.mass, a, -alpha_m, force);
        }
        work.evaluations += 1;
        a_next.fill(0.0);
        add_product(&self.inverse, force, 1.0, a_next);
        for i in 0..n {
            q_next[i] += h * h * beta * a_next[i];
            v_next[i] += h * gamma * a_next[i];
        }
        if let Some(dof) = (0..n).find(|&i| !(q_next[i] + v_next[i] + a_next[i]).is_finite()) {
            return Err(Box::new(Error::Model {
                message: format!(
                    "degree of freedom {dof} is not finite after the step from t = {t}: explicit \
                     methods need h w_max < 2; reduce the step, or the structure is unstable"
                ),
                t,
                step: k,
            }));
        }
        state.z[..n].copy_from_slice(q_next);
        v.copy_from_slice(v_next);
        a.copy_from_slice(a_next);
        let p = &mut state.z[n..];
        p.fill(0.0);
        add_product(&system.mass, v_next, 1.0, p);
        add_product(&system.gyroscopic, q_next, 0.5, p);
        work.steps += 1;
        Ok(())
    }
}

fn bind(problem: &Problem, h: f64, rule: Rule, watch: &mut Watch) -> Result<Box<dyn Step>> {
    let Problem::Structural(system) = problem else {
        return Err(Error::unsupported("needs a structure with mass and stiffness"));
    };
    let method = Newmark::new(system, h, rule, watch)?;
    Ok(Box::new(Bound::new(method, Arc::clone(system), String::new())))
}

/// A number among options, within bounds.
fn number(options: &Options, name: &str, default: f64, [least, most]: [f64; 2]) -> Result<f64> {
    let value = options.number(name)?.unwrap_or(default);
    if value >= least && value <= most {
        Ok(value)
    } else {
        Err(Error::argument(format!("{name}: must be {least} to {most}, got {value}")))
    }
}

pub(super) const NEWMARK: MethodInfo = MethodInfo {
    name: "newmark",
    aliases: &[],
    summary: "Newmark's average acceleration, a baseline: no damping, but every period elongated",
    order: Some(2),
    symplectic: true,
    symmetric: true,
    energy_preserving: true,
    needs: Needs::Structural,
    reproducible: "every machine",
    reference: "Newmark, J. Eng. Mech. Div. ASCE 85 (1959)",
    options: &[
        OptionInfo { name: "beta", doc: "0..1, default 1/4" },
        OptionInfo { name: "gamma", doc: "0..1, default 1/2; damps above 1/2, at order 1" },
    ],
    build: |problem, h, options, watch| {
        let beta = number(options, "beta", 0.25, [0.0, 1.0])?;
        let gamma = number(options, "gamma", 0.5, [0.0, 1.0])?;
        bind(problem, h, Rule { alpha_m: 0.0, alpha_f: 0.0, beta, gamma }, watch)
    },
};

pub(super) const GENERALIZED_ALPHA: MethodInfo = MethodInfo {
    name: "generalized_alpha",
    aliases: &[],
    summary: "Chung and Hulbert's, a baseline: damps what the step does not resolve",
    order: Some(2),
    symplectic: false,
    symmetric: false,
    energy_preserving: false,
    needs: Needs::Structural,
    reproducible: "every machine",
    reference: "Chung & Hulbert, J. Appl. Mech. 60 (1993)",
    options: &[OptionInfo {
        name: "rho_inf",
        doc: "0..1, default 0.8: what a step leaves of the highest modes; 1 damps nothing",
    }],
    build: |problem, h, options, watch| {
        let rho = number(options, "rho_inf", 0.8, [0.0, 1.0])?;
        let (alpha_m, alpha_f) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let gamma = 0.5 - alpha_m + alpha_f;
        let beta = 0.25 * (1.0 - alpha_m + alpha_f).powi(2);
        bind(problem, h, Rule { alpha_m, alpha_f, beta, gamma }, watch)
    },
};

pub(super) const CENTRAL_DIFFERENCE: MethodInfo = MethodInfo {
    name: "central_difference",
    aliases: &[],
    summary: "the explicit central difference, a baseline: unstable beyond h w_max = 2",
    order: Some(2),
    symplectic: true,
    symmetric: true,
    energy_preserving: false,
    needs: Needs::Structural,
    reproducible: "every machine",
    reference: "Newmark, J. Eng. Mech. Div. ASCE 85 (1959), beta = 0",
    options: &[],
    build: |problem, h, _, watch| {
        bind(problem, h, Rule { alpha_m: 0.0, alpha_f: 0.0, beta: 0.0, gamma: 0.5 }, watch)
    },
};
