//! Runge-Kutta methods of any tableau, on any system: eqs. 24-30 of the paper.
//!
//! Implicit stages are found by Newton's method with the Jacobian at the step's middle, taken by
//! differences unless the system is linear, and iterated until rounding. Stages that depend on those
//! before and on themselves alone are solved one after the other.

use super::common::{self, check_finite, not_solved};
use super::{Bound, MethodInfo, Needs, OptionInfo, State, Step, Stepper, Work};
use crate::error::{Error, Result};
use crate::linalg::dense::Watch;
use crate::linalg::newton::Lu;
use crate::system::{Flow, Problem};
use crate::tableau::{self, Shape, Stages};

/// Iterations at most.
const CAP: u32 = 30;

/// Rows of the matrix that is factored, at most.
const MOST: usize = 8192;

/// Change, in parts of the state, that the next iteration may leave undone: far below rounding, as a
/// Jacobian by differences shrinks the stiffest parts last.
const ROUNDING: f64 = 1e-22;

/// Change below which one that does not shrink is rounding.
const SMALL: f64 = 1e-12;

struct RungeKutta {
    name: &'static str,
    h: f64,
    stages: Stages,
    shape: Shape,
    /// The matrix of a linear system, row by row.
    linear: Option<Vec<f64>>,
    /// Entry `(i, j)` of `df_i/dz_j`.
    jacobian: Vec<f64>,
    lu: Lu,
    /// Rates at the stages.
    rates: Vec<f64>,
    /// Stages less the state.
    increments: Vec<f64>,
    stage: Vec<f64>,
    change: Vec<f64>,
    known: Vec<f64>,
    scratch: Vec<f64>,
}

/// Makes a method of a tableau for whatever system.
pub fn build(
    name: &'static str,
    stages: Stages,
    problem: &Problem,
    h: f64,
    _watch: &mut Watch,
) -> Result<Box<dyn Step>> {
    let flow = problem.flow();
    let (m, s) = (flow.len(), stages.count());
    let shape = stages.shape();
    let rows = match shape {
        Shape::Explicit => 0,
        Shape::Diagonal => m,
        Shape::Full => m * s,
    };
    if rows > MOST {
        return Err(Error::unsupported(format!(
            "{name}: {m} components in {s} stages would be solved by a full matrix of {rows} rows; \
             at most {MOST}: take a Gauss method, or an explicit one"
        )));
    }
    let linear = problem.linear().map(|system| system.matrix().to_vec());
    let zeros = |len: usize| vec![0.0; len];
    let method = RungeKutta {
        name,
        h,
        shape,
        linear,
        jacobian: zeros(if rows > 0 { m * m } else { 0 }),
        lu: Lu::new(rows),
        rates: zeros(m * s),
        increments: zeros(m * s),
        stage: zeros(m),
        change: zeros(rows.max(m)),
        known: zeros(m),
        scratch: zeros(4 * m),
        stages,
    };
    Ok(Box::new(Bound::new(method, flow, String::new())))
}

impl RungeKutta {
    /// Rate at stage `i`, whose increment is known.
    fn evaluate(&mut self, system: &dyn Flow, t: f64, z: &[f64], i: usize) -> Result<()> {
        let m = z.len();
        let increment = &self.increments[m * i..][..m];
        for (stage, (z, d)) in self.stage.iter_mut().zip(z.iter().zip(increment)) {
            *stage = z + d;
        }
        let time = t + self.stages.c[i] * self.h;
        system.rate(time, &self.stage, &mut self.rates[m * i..][..m])
    }

    /// The Jacobian at the state, in the middle of the step.
    fn differentiate(
        &mut self,
        system: &dyn Flow,
        t: f64,
        z: &[f64],
        work: &mut Work,
    ) -> Result<()> {
        if let Some(linear) = &self.linear {
            self.jacobian.copy_from_slice(linear);
            return Ok(());
        }
        let t = t + 0.5 * self.h;
        let (out, scratch) = (&mut self.jacobian, &mut self.scratch);
        work.evaluations += common::jacobian(system, t, z, self.h, out, scratch)?;
        Ok(())
    }

    /// `I - h a J`, for the stages that are solved together.
    fn factor(&mut self, a: &[f64], together: usize) -> bool {
        let m = self.known.len();
        let rows = m * together;
        let matrix = self.lu.matrix();
        for row in 0..rows {
            for column in 0..rows {
                let unit = if row == column { 1.0 } else { 0.0 };
                let a = a[(row / m) * together + column / m];
                let slope = self.jacobian[(row % m) * m + column % m];
                matrix[row * rows + column] = unit - self.h * a * slope;
            }
        }
        self.lu.factor()
    }

    /// Finds the increments of `together` stages from `first` on.
    fn solve(
        &mut self,
        system: &dyn Flow,
        t: f64,
        z: &[f64],
        [first, together]: [usize; 2],
        work: &mut Work,
    ) -> Result<()> {
        let (m, s, h) = (z.len(), self.stages.count(), self.h);
        // Coordinates and momenta differ in size; at rest there is only what the step adds.
        let half = m.div_ceil(2);
        let mut sizes = [0.0_f64; 2];
        for (at, x) in z.iter().enumerate() {
            // Near an equilibrium rates are small as large terms cancel.
            let row = &self.jacobian[m * at..][..m];
            let terms: f64 = row.iter().zip(z).map(|(a, z)| (a * z).abs()).sum();
            sizes[at / half] = sizes[at / half].max(x.abs()).max((h * terms).abs());
        }
        let mut last = f64::INFINITY;
        for iteration in 1..=CAP {
            for i in first..first + together {
                self.evaluate(system, t, z, i)?;
            }
            work.evaluations += together as u64;
            for i in 0..together {
                let row = &self.stages.a[s * (first + i)..][..s];
                let out = &mut self.change[m * i..][..m];
                out.fill(0.0);
                for (a, rates) in row.iter().zip(self.rates.chunks_exact(m)) {
                    if *a != 0.0 {
                        out.iter_mut().zip(rates).for_each(|(out, rate)| *out += h * a * rate);
                    }
                }
                let increment = &self.increments[m * (first + i)..][..m];
                out.iter_mut().zip(increment).for_each(|(out, d)| *out -= d);
            }
            let change = &mut self.change[..m * together];
            self.lu.solve(change);
            let mut changes = [0.0_f64; 2];
            for (at, (d, x)) in self.increments[m * first..].iter_mut().zip(&*change).enumerate() {
                *d += x;
                let part = at % m / half;
                sizes[part] = sizes[part].max(d.abs());
                // Not a number stays.
                changes[part] = if x.abs() <= changes[part] { changes[part] } else { x.abs() };
            }
            let [one, other] = [0, 1].map(|part| match changes[part] {
                0.0 => 0.0,
                change => change / sizes[part],
            });
            let moved = if one >= other || one.is_nan() { one } else { other };
            if !moved.is_finite() {
                break;
            }
            let left = if last.is_finite() { moved * (moved / last).min(1.0) } else { moved };
            if left <= ROUNDING || (moved >= last && moved <= SMALL) {
                return Ok(());
            }
            if iteration == CAP {
                break;
            }
            last = moved;
        }
        Err(not_solved(self.name, t, 0, CAP, last))
    }
}

impl Stepper<dyn Flow> for RungeKutta {
    fn step(
        &mut self,
        system: &dyn Flow,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let z = &state.z;
        let (m, s, h) = (z.len(), self.stages.count(), self.h);
        if self.shape != Shape::Explicit {
            self.differentiate(system, t, z, work)?;
        }
        self.increments.fill(0.0);
        self.rates.fill(0.0);
        let singular = |name: &str| {
            Box::new(Error::Singular(format!(
                "{name}: the matrix of the stages, I - h a J, is singular at t = {t:.6}; change the step"
            )))
        };
        match self.shape {
            Shape::Full => {
                let a = self.stages.a.clone();
                if !self.factor(&a, s) {
                    return Err(singular(self.name));
                }
                self.solve(system, t, z, [0, s], work).map_err(|error| error.in_step(k))?;
            }
            shape => {
                let mut factored = f64::NAN;
                for i in 0..s {
                    // What the stages before give.
                    self.known.fill(0.0);
                    for j in 0..i {
                        let a = h * self.stages.a[s * i + j];
                        let rates = &self.rates[m * j..][..m];
                        self.known.iter_mut().zip(rates).for_each(|(x, rate)| *x += a * rate);
                    }
                    self.increments[m * i..][..m].copy_from_slice(&self.known);
                    let own = self.stages.a[s * i + i];
                    if shape == Shape::Explicit || own == 0.0 {
                        self.evaluate(system, t, z, i)?;
                        work.evaluations += 1;
                        continue;
                    }
                    if own != factored && !self.factor(&[own], 1) {
                        return Err(singular(self.name));
                    }
                    factored = own;
                    self.solve(system, t, z, [i, 1], work).map_err(|error| error.in_step(k))?;
                }
            }
        }
        self.change[..m].fill(0.0);
        for (b, rates) in self.stages.b.iter().zip(self.rates.chunks_exact(m)) {
            self.change.iter_mut().zip(rates).for_each(|(x, rate)| *x += h * b * rate);
        }
        for (stage, (z, d)) in self.stage.iter_mut().zip(z.iter().zip(&self.change)) {
            *stage = z + d;
        }
        check_finite(self.name, t, k, &self.stage)?;
        state.z.copy_from_slice(&self.stage);
        work.steps += 1;
        Ok(())
    }
}

/// A user's tableau.
pub const RUNGE_KUTTA: MethodInfo = MethodInfo {
    name: "runge_kutta",
    aliases: &[],
    summary: "Runge-Kutta method of any tableau; Gauss of order 4 by default",
    order: Some(4),
    symplectic: true,
    symmetric: true,
    energy_preserving: false,
    needs: Needs::Flow,
    reproducible: "on every machine",
    reference: "Hairer, Lubich & Wanner, Geometric Numerical Integration, II.1",
    options: &[
        OptionInfo { name: "a", doc: "(s, s), of the stages" },
        OptionInfo { name: "b", doc: "(s,), of the step" },
    ],
    build: |problem, h, options, watch| {
        let stages = match (options.numbers("a")?, options.numbers("b")?) {
            (None, None) => tableau::GAUSS4.into(),
            (Some(a), Some(b)) => Stages::new(a, b)?,
            _ => return Err(Error::argument("runge_kutta: give both a and b")),
        };
        build("runge_kutta", stages, problem, h, watch)
    },
};
