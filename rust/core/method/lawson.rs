//! Lawson-Gauss methods: Gauss collocation in the variables that turn with the exact linear flow, so that
//! its stiffness neither limits the step nor enters the error. Symplectic where the linear part and the
//! remainder are Hamiltonian.
//!
//! `Y_i = e^(c_i h A) z + h sum a_ij e^((c_i - c_j) h A) F(Y_j)`, `z1 = e^(h A) z + h sum b_i e^((1 - c_i) h A)
//! F(Y_i)`. Stages are iterated until they no longer change. Source: Lawson (1967); Mei & Wu, J. Comput.
//! Phys. 338 (2017).

use super::common::{add_product, check_finite, not_solved};
use super::{Bound, MethodInfo, Needs, State, Step, Stepper, Work};
use crate::error::Result;
use crate::expm::{self, Recipe};
use crate::linalg::dense::Watch;
use crate::system::{Problem, SemiLinear};
use crate::tableau::{self, Tableau};

/// Iterations at most.
const CAP: u32 = 100;

struct LawsonGauss {
    name: &'static str,
    h: f64,
    tableau: Tableau,
    /// `e^(c_i h A)` of the stages, then `e^(h A)`.
    ahead: Vec<Vec<f64>>,
    /// `h a_ij e^((c_i - c_j) h A)`, then `h b_i e^((1 - c_i) h A)`.
    weights: Vec<Vec<f64>>,
    /// Stages, their remainders, what the state alone makes of them, the end.
    stages: Vec<f64>,
    remainders: Vec<f64>,
    bases: Vec<f64>,
    next: Vec<f64>,
}

fn build(
    name: &'static str,
    tableau: Tableau,
    problem: &Problem,
    h: f64,
    watch: &mut Watch,
) -> Result<Box<dyn Step>> {
    let system = problem.semilinear().expect("the record's need");
    let (m, s) = (system.len(), tableau.b.len());
    let mut exponential = |part: f64, factor: f64| -> Result<Vec<f64>> {
        let scaled: Vec<f64> = system.matrix().iter().map(|a| part * h * a).collect();
        let mut out = vec![0.0; m * m];
        expm::exponentials(m, Recipe::auto(m), &scaled, &mut out, watch)?;
        out.iter_mut().for_each(|x| *x *= factor);
        Ok(out)
    };
    let (c, mut ahead, mut weights) = (tableau.c, Vec::new(), Vec::new());
    for i in 0..=s {
        ahead.push(exponential(c.get(i).copied().unwrap_or(1.0), 1.0)?);
    }
    for i in 0..s {
        for j in 0..s {
            weights.push(exponential(c[i] - c[j], h * tableau.a[s * i + j])?);
        }
    }
    for i in 0..s {
        weights.push(exponential(1.0 - c[i], h * tableau.b[i])?);
    }
    let zeros = |len: usize| vec![0.0; len];
    let method = LawsonGauss {
        name,
        h,
        tableau,
        ahead,
        weights,
        stages: zeros(m * s),
        remainders: zeros(m * s),
        bases: zeros(m * (s + 1)),
        next: zeros(m),
    };
    Ok(Box::new(Bound::new(method, system, String::new())))
}

impl Stepper<dyn SemiLinear> for LawsonGauss {
    fn step(
        &mut self,
        system: &dyn SemiLinear,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let z = &state.z;
        let (m, s) = (z.len(), self.tableau.b.len());
        self.bases.fill(0.0);
        for (ahead, base) in self.ahead.iter().zip(self.bases.chunks_exact_mut(m)) {
            add_product(ahead, z, base);
        }
        self.stages.copy_from_slice(&self.bases[..m * s]);
        let mut before = f64::INFINITY;
        for iteration in 1.. {
            for i in 0..s {
                let time = t + self.tableau.c[i] * self.h;
                let stage = &self.stages[m * i..][..m];
                system.remainder(time, stage, &mut self.remainders[m * i..][..m])?;
            }
            work.evaluations += s as u64;
            let (mut moved, mut size) = (0.0_f64, 0.0_f64);
            for i in 0..s {
                self.next.copy_from_slice(&self.bases[m * i..][..m]);
                for (j, remainder) in self.remainders.chunks_exact(m).enumerate() {
                    add_product(&self.weights[s * i + j], remainder, &mut self.next);
                }
                for (stage, next) in self.stages[m * i..][..m].iter_mut().zip(&self.next) {
                    let change = (next - *stage).abs();
                    // Not a number stays.
                    moved = if change <= moved { moved } else { change };
                    size = size.max(next.abs());
                    *stage = *next;
                }
            }
            if moved == 0.0 || (moved >= before && moved <= 1e-12 * size) {
                break;
            }
            if iteration == CAP || !moved.is_finite() {
                return Err(not_solved(self.name, t, k, iteration, moved / size));
            }
            before = moved;
        }
        self.next.copy_from_slice(&self.bases[m * s..]);
        for (i, remainder) in self.remainders.chunks_exact(m).enumerate() {
            add_product(&self.weights[s * s + i], remainder, &mut self.next);
        }
        check_finite(self.name, t, k, &self.next)?;
        state.z.copy_from_slice(&self.next);
        work.steps += 1;
        Ok(())
    }
}

/// One stage.
pub const LAWSON_GAUSS2: MethodInfo = MethodInfo {
    name: "lawson_gauss2",
    aliases: &[],
    summary: "Gauss collocation along the exact linear flow, 1 stage",
    order: Some(2),
    symplectic: true,
    symmetric: true,
    energy_preserving: false,
    needs: Needs::SemiLinear,
    reproducible: "on every machine",
    reference: "Mei & Wu, J. Comput. Phys. 338 (2017)",
    options: &[],
    build: |problem, h, _, watch| build("lawson_gauss2", tableau::GAUSS2, problem, h, watch),
};

/// Two stages.
pub const LAWSON_GAUSS4: MethodInfo = MethodInfo {
    name: "lawson_gauss4",
    summary: "Gauss collocation along the exact linear flow, 2 stages",
    order: Some(4),
    build: |problem, h, _, watch| build("lawson_gauss4", tableau::GAUSS4, problem, h, watch),
    ..LAWSON_GAUSS2
};

/// Three stages.
pub const LAWSON_GAUSS6: MethodInfo = MethodInfo {
    name: "lawson_gauss6",
    summary: "Gauss collocation along the exact linear flow, 3 stages",
    order: Some(6),
    build: |problem, h, _, watch| build("lawson_gauss6", tableau::GAUSS6, problem, h, watch),
    ..LAWSON_GAUSS2
};

/// Four stages.
pub const LAWSON_GAUSS8: MethodInfo = MethodInfo {
    name: "lawson_gauss8",
    summary: "Gauss collocation along the exact linear flow, 4 stages",
    order: Some(8),
    build: |problem, h, _, watch| build("lawson_gauss8", tableau::GAUSS8, problem, h, watch),
    ..LAWSON_GAUSS2
};
