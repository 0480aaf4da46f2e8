//! Lawson-Gauss methods at the rounding limit: Gauss collocation in the variables that turn with the
//! exact linear flow, so that its stiffness neither limits the step nor enters the error. Symplectic
//! where the linear part and the remainder are Hamiltonian.
//!
//! `L_i = h b_i e^(-c_i h A) F(Z_i)`, `Z_i = e^(c_i h A) (z + (e + sum mu_ij L_j))`, and the step ends at
//! `e^(h A) (z + (e + sum L_i))`, with `mu_ij + mu_ji = 1` exactly, iterations that go on until nothing
//! changes, a remainder e of the state that is carried, and the last exponential in pairs of doubles. Of
//! a Hamiltonian A the rounded inverse is the transposed of what is rounded there, so that the method
//! is symplectic as it is rounded. All stages are evaluated in one sweep.
//!
//! Sources: Lawson (1967); Mei & Wu, J. Comput. Phys. 338 (2017); Antoñana, Makazaga & Murua, Numer.
//! Algorithms 76 (2017).

use super::common::{check_finite, not_solved_from};
use super::gauss::{Changes, Columns, Ending, ROUNDOFF, count, ending, matrix, product, weights};
use super::turn::{Lanewise, Turn, add_compensated, exponential};
use super::{Bound, MethodInfo, Needs, Options, State, Step, Stepper, Work};
use crate::error::Result;
use crate::linalg::dense::Watch;
use crate::linalg::kernel::{
    Body, Eight, Lanes, Pack, dispatch, doubles, doubles_mut, packs, packs_mut,
};
use crate::system::{Linear, Problem, SemiLinear};
use crate::tableau::{self, Collocation};

/// Iterations at most.
const CAP: u32 = 100;

/// Method and memory; stages are lanes.
pub struct LawsonGauss {
    name: &'static str,
    h: f64,
    ending: Ending,
    table: Collocation,
    /// `h b`, 0 where there is no stage; places of the stages, those of the first where there is none.
    weights: Eight,
    places: Eight,
    columns: &'static Columns,
    /// `e^(c_i h A)` and its inverse, `e^(h A)`.
    forth: Lanewise,
    back: Lanewise,
    turn: Turn,
    times: Eight,
    /// What the state alone makes of the stages, the stages, their remainders, `L`, and work space.
    bases: Vec<Eight>,
    stages: Vec<Eight>,
    rates: Vec<Eight>,
    increments: Vec<Eight>,
    spare: Vec<Eight>,
    z: Vec<f64>,
    e: Vec<f64>,
    /// By how much a change of each component counts.
    counts: Vec<f64>,
    next: Vec<f64>,
    rest: Vec<f64>,
    scratch: Vec<f64>,
}

impl LawsonGauss {
    /// For steps of `h`, with at most eight stages.
    ///
    /// # Errors
    /// Those of exponentials.
    pub fn new(
        name: &'static str,
        table: Collocation,
        ending: Ending,
        system: &dyn SemiLinear,
        h: f64,
        watch: &mut Watch,
    ) -> Result<LawsonGauss> {
        let (m, s, a) = (system.len(), table.b.len(), system.matrix());
        let hamiltonian = Linear::new(m, a.to_vec())?.is_hamiltonian();
        let (mut forth, mut back) = (Vec::new(), Vec::new());
        for c in table.c {
            forth.push(exponential(m, a, c * h, watch)?);
            if !hamiltonian {
                back.push(exponential(m, a, -c * h, watch)?);
            }
        }
        let lane = |i: usize| if i < s { i } else { 0 };
        let force = system.is_force();
        let inverse = |i: usize, row: usize, column: usize| {
            let n = m / 2;
            match (hamiltonian, row < n, column < n) {
                // Such a remainder has nothing there.
                (_, _, true) if force => 0.0,
                (false, ..) => back[lane(i)][m * row + column],
                // [a b; c d]^-1 = [d' -b'; -c' a'].
                (true, true, true) => forth[lane(i)][m * (column + n) + row + n],
                (true, true, false) => -forth[lane(i)][m * (column - n) + row + n],
                (true, false, true) => -forth[lane(i)][m * (column + n) + row - n],
                (true, false, false) => forth[lane(i)][m * (column - n) + row - n],
            }
        };
        let hb = weights(&table, h);
        let zeros = || vec![Eight::ZERO; m];
        Ok(LawsonGauss {
            name,
            h,
            ending,
            weights: Eight(std::array::from_fn(|i| hb.get(i).copied().unwrap_or(0.0))),
            places: Eight(std::array::from_fn(|i| table.c[lane(i)])),
            columns: Columns::of(&table),
            back: Lanewise::new(m, inverse),
            forth: Lanewise::new(m, |i, row, column| forth[lane(i)][m * row + column]),
            turn: Turn::new(m, a, h, watch)?,
            times: Eight::ZERO,
            bases: zeros(),
            stages: zeros(),
            rates: zeros(),
            increments: zeros(),
            spare: zeros(),
            z: vec![0.0; m],
            e: vec![0.0; m],
            counts: vec![0.0; m],
            next: vec![0.0; m],
            rest: vec![0.0; m],
            scratch: vec![0.0; 2 * m],
            table,
        })
    }

    fn sweep(&mut self, system: &dyn SemiLinear, work: &mut Work) -> Result<()> {
        let stages = self.table.b.len();
        work.evaluations += stages as u64;
        let LawsonGauss { times, stages: z, rates, scratch, .. } = self;
        system.remainders(times, z, rates, stages, scratch)
    }

    /// Takes remainders for what they are, and goes one iteration on; the change, in parts of the state.
    fn correct(&mut self) -> f64 {
        match self.table.b.len() {
            1 => dispatch(Correct::<1>(self)),
            2 => dispatch(Correct::<2>(self)),
            3 => dispatch(Correct::<3>(self)),
            4 => dispatch(Correct::<4>(self)),
            6 => dispatch(Correct::<6>(self)),
            _ => dispatch(Correct::<8>(self)),
        }
    }

    /// Remainders at the stages of the last step, extrapolated.
    fn extrapolate(&mut self, history: &[Eight]) {
        match self.table.b.len() {
            1 => dispatch(Ahead::<1>(self, history)),
            2 => dispatch(Ahead::<2>(self, history)),
            3 => dispatch(Ahead::<3>(self, history)),
            4 => dispatch(Ahead::<4>(self, history)),
            6 => dispatch(Ahead::<6>(self, history)),
            _ => dispatch(Ahead::<8>(self, history)),
        }
    }

    /// How much a change of each component counts.
    fn weigh(&mut self) {
        for (d, z) in self.z.iter().enumerate() {
            // A stage may be small as what the state makes of it and what the remainder adds cancel.
            let parts = [&self.stages[d].0, &self.bases[d].0];
            let ends = parts.map(|x| x[0].abs().max(x[self.table.b.len() - 1].abs()));
            self.counts[d] = z.abs().max(ends[0]).max(ends[1]);
        }
        count(&mut self.counts, 1e-3);
    }

    /// Finds the stages.
    fn solve(
        &mut self,
        system: &dyn SemiLinear,
        t: f64,
        history: Option<&[Eight]>,
        work: &mut Work,
    ) -> Result<()> {
        dispatch(Bases(self));
        match history {
            Some(history) => self.extrapolate(history),
            None => self.sweep(system, work)?,
        }
        self.correct();
        self.weigh();
        let mut changes = Changes::new(self.ending, 0.0);
        for iteration in 1.. {
            self.sweep(system, work)?;
            let change = self.correct();
            if changes.end_with(change) {
                break;
            }
            if !change.is_finite() || iteration >= CAP {
                return Err(not_solved_from(self.name, system, (t, &self.z), iteration, change));
            }
        }
        Ok(())
    }
}

impl Stepper<dyn SemiLinear> for LawsonGauss {
    /// The remainder of the state; of the right side, at the stages.
    fn carried_len(&self) -> usize {
        self.z.len().div_ceil(8) + self.z.len()
    }

    fn step(
        &mut self,
        system: &dyn SemiLinear,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let m = state.z.len();
        let (kept, history) = state.carried.split_at_mut(m.div_ceil(8));
        self.z.copy_from_slice(&state.z);
        self.e.copy_from_slice(&doubles(kept)[..m]);
        self.times = Eight(self.places.0.map(|place| t + place * self.h));
        self.solve(system, t, (k > 0).then_some(&*history), work)
            .map_err(|error| error.in_step(k))?;
        for d in 0..m {
            // Outer stages, whose weights are small, first.
            let sum = Lanes::sum(self.increments[d].0);
            add_compensated(&mut self.z[d], &mut self.e[d], sum);
        }
        self.turn.apply(&self.z, &self.e, &mut self.next, &mut self.rest);
        check_finite(self.name, t, k, &self.next)?;
        history.copy_from_slice(&self.rates);
        doubles_mut(kept)[..m].copy_from_slice(&self.rest);
        state.z.copy_from_slice(&self.next);
        work.steps += 1;
        Ok(())
    }
}

/// What the state alone makes of the stages; the stages begin there.
struct Bases<'a>(&'a mut LawsonGauss);

impl Body for Bases<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let lawson = self.0;
        for d in 0..lawson.z.len() {
            let base = lawson.forth.row_of_one::<V>(d, &lawson.z);
            packs_mut::<V>(&mut lawson.bases)[d] = base;
            packs_mut::<V>(&mut lawson.stages)[d] = base;
        }
        lawson.increments.fill(Eight::ZERO);
    }
}

/// One iteration, with S stages; the largest change.
struct Correct<'a, const S: usize>(&'a mut LawsonGauss);

impl<const S: usize> Body for Correct<'_, S> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Lanes>(self) -> f64 {
        let lawson = self.0;
        let m = lawson.z.len();
        let [hb] = packs::<V>(std::slice::from_ref(&lawson.weights)) else {
            unreachable!("a pack")
        };
        let spare = packs_mut::<V>(&mut lawson.spare);
        for (spare, rate) in spare.iter_mut().zip(packs::<V>(&lawson.rates)) {
            *spare = *hb * *rate;
        }
        let mut change = Pack::<V>::splat(0.0);
        let mut bad = Pack::<V>::splat(0.0);
        for (d, L) in packs_mut::<V>(&mut lawson.increments).iter_mut().enumerate() {
            let new = lawson.back.row(d, packs::<V>(&lawson.spare));
            let step = new - *L;
            *L = new;
            change = change.max(step.abs() * Pack::splat(lawson.counts[d]));
            bad = bad + step;
        }
        let mu = matrix::<S, 1>(&lawson.columns.mu);
        for d in 0..m {
            let [[sum]] = product([mu], [[packs::<V>(&lawson.increments)[d]]]);
            packs_mut::<V>(&mut lawson.spare)[d] = Pack::splat(lawson.e[d]) + sum;
        }
        for d in 0..m {
            let moved = lawson.forth.row(d, packs::<V>(&lawson.spare));
            packs_mut::<V>(&mut lawson.stages)[d] = packs::<V>(&lawson.bases)[d] + moved;
        }
        // What is no number is lost in a maximum, never in a sum.
        let bad = bad.sum();
        if bad.is_finite() { change.largest() } else { f64::NAN }
    }
}

/// Remainders of the last step, extrapolated.
struct Ahead<'a, const S: usize>(&'a mut LawsonGauss, &'a [Eight]);

impl<const S: usize> Body for Ahead<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Ahead(lawson, history) = self;
        let m = lawson.z.len();
        let ahead = matrix::<S, 1>(&lawson.columns.ahead);
        for d in 0..m {
            let [[sum]] = product([ahead], [[packs::<V>(history)[d]]]);
            packs_mut::<V>(&mut lawson.rates)[d] = sum;
        }
    }
}

fn build(
    name: &'static str,
    table: Collocation,
    problem: &Problem,
    h: f64,
    options: &Options,
    watch: &mut Watch,
) -> Result<Box<dyn Step>> {
    let system = problem.semilinear().expect("the record's need");
    let method = LawsonGauss::new(name, table, ending(options)?, &*system, h, watch)?;
    Ok(Box::new(Bound::new(method, system, String::new())))
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
    options: &[ROUNDOFF],
    build: |problem, h, options, watch| {
        build("lawson_gauss2", tableau::COLLOCATION2, problem, h, options, watch)
    },
};

/// Two stages.
pub const LAWSON_GAUSS4: MethodInfo = MethodInfo {
    name: "lawson_gauss4",
    summary: "Gauss collocation along the exact linear flow, 2 stages",
    order: Some(4),
    build: |problem, h, options, watch| {
        build("lawson_gauss4", tableau::COLLOCATION4, problem, h, options, watch)
    },
    ..LAWSON_GAUSS2
};

/// Three stages.
pub const LAWSON_GAUSS6: MethodInfo = MethodInfo {
    name: "lawson_gauss6",
    summary: "Gauss collocation along the exact linear flow, 3 stages",
    order: Some(6),
    build: |problem, h, options, watch| {
        build("lawson_gauss6", tableau::COLLOCATION6, problem, h, options, watch)
    },
    ..LAWSON_GAUSS2
};

/// Four stages.
pub const LAWSON_GAUSS8: MethodInfo = MethodInfo {
    name: "lawson_gauss8",
    summary: "Gauss collocation along the exact linear flow, 4 stages",
    order: Some(8),
    build: |problem, h, options, watch| {
        build("lawson_gauss8", tableau::COLLOCATION8, problem, h, options, watch)
    },
    ..LAWSON_GAUSS2
};

/// Six stages.
pub const LAWSON_GAUSS12: MethodInfo = MethodInfo {
    name: "lawson_gauss12",
    summary: "Gauss collocation along the exact linear flow, 6 stages",
    order: Some(12),
    build: |problem, h, options, watch| {
        build("lawson_gauss12", tableau::COLLOCATION12, problem, h, options, watch)
    },
    ..LAWSON_GAUSS2
};

/// Eight stages.
pub const LAWSON_GAUSS16: MethodInfo = MethodInfo {
    name: "lawson_gauss16",
    summary: "Gauss collocation along the exact linear flow, 8 stages",
    order: Some(16),
    build: |problem, h, options, watch| {
        build("lawson_gauss16", tableau::COLLOCATION16, problem, h, options, watch)
    },
    ..LAWSON_GAUSS2
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{build, find};
    use crate::model::named;

    /// Largest relative energy error over a run.
    fn drift(model: &str, parameters: &[f64], z0: &[f64], h: f64, steps: u64) -> f64 {
        let native = named(model, parameters).unwrap();
        let info = find("lawson_gauss8").unwrap();
        let options = Options::default();
        let mut method = build(info, &native.problem, h, &options, &mut || Ok(())).unwrap();
        let mut state = State::new(z0, &*method).unwrap();
        let energy = |z: &[f64]| native.hamiltonian.energy(0.0, z).unwrap();
        let (start, mut worst) = (energy(z0), 0.0_f64);
        for k in 0..steps {
            method.step(k, h * k as f64, &mut state).unwrap();
            worst = worst.max((energy(&state.z) / start - 1.0).abs());
        }
        worst
    }

    #[test]
    fn a_million_steps_lose_energy_as_a_random_walk_does() {
        let chain = [1.0, 0.0, 0.0, 1.0 / 50.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        let pendulum = [1.0, 1.0, 0.1, 100.0, 9.81914];
        let angle = std::f64::consts::FRAC_PI_6;
        let cases: [(&str, &[f64], &[f64], f64); 3] = [
            ("henon-heiles", &[], &[0.0, 0.1, 0.48, 0.0], 0.05),
            ("fput", &[3.0, 50.0], &chain, 0.003),
            ("compound pendulum", &pendulum, &[0.1, angle, 0.0, 0.0], 0.005),
        ];
        for (model, parameters, z0, h) in cases {
            let short = drift(model, parameters, z0, h, 10_000);
            let long = drift(model, parameters, z0, h, 1_000_000);
            assert!(short <= 2e-15, "{model}: truncation shows, {short:e}");
            assert!(long <= 1e-14, "{model}: {long:e}"); // 1e3 roundings of h F, beside 10 u sqrt(N) = 1e-12
        }
    }
}
