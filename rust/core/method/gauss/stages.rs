//! Gauss methods on any system, at the rounding limit: Brouwer's law in place of drift.
//!
//! `Z_i = z + (e + sum mu_ij L_j)`, `L_i = h b_i f(Z_i)`: with `mu_ij + mu_ji = 1` exactly, a remainder e of
//! the state that is carried from step to step, and iterations that go on until they no longer
//! change. All stages are evaluated in one sweep. A constant linear part is solved within the
//! iterations: it divides what is left of the equations, and so never enters what they converge to.
//! Where iterations hardly converge, as of stiff systems without a linear part that is known, the
//! Jacobian at the start of the step, by differences, takes its place from then on.
//!
//! Sources: Hairer, McLachlan & Razakarivony, BIT 48 (2008); Antoñana, Makazaga & Murua, Numer.
//! Algorithms 76 (2017).

use super::columns::{Columns, lanes, weights};
use super::ending::{Changes, Ending, NOISE, SMALL, count};
use super::iteration::{Ahead, Correct, Remainder};
use super::linear_part::LinearPart;
use crate::error::Result;
use crate::linalg::kernel::{Eight, Lanes, dispatch, doubles, doubles_mut};
use crate::method::common::{self, check_finite, not_solved_from};
use crate::method::turn::add_compensated;
use crate::method::{State, Stepper, Work};
use crate::system::Flow;
use crate::tableau::Collocation;

/// Iterations at most.
const CAP: u32 = 100;

/// Components at most of which a Jacobian is taken: 128 bytes an entry.
const MOST: usize = 2048;

/// Change that is none.
const NOTHING: f64 = 1e-20;

/// Iterations after which it is asked whether a Jacobian would be cheaper.
const PATIENCE: u32 = 8;

/// Method and memory. Stages lie in blocks of eight lanes, in the order of [`Columns`]: component d of
/// block b at `b m + d` of `stages` and `rates`, as systems want them, and at `d blocks + b` of
/// `increments`.
pub struct Gauss {
    name: &'static str,
    h: f64,
    ending: Ending,
    s: usize,
    pub(super) blocks: usize,
    pub(super) columns: &'static Columns,
    /// `h b` and its reciprocal, a pack a block.
    pub(super) weights: Vec<Eight>,
    pub(super) reciprocals: Vec<Eight>,
    pub(super) part: LinearPart,
    /// Whether `part` is that of the system, not of a Jacobian.
    given: bool,
    times: Vec<Eight>,
    pub(super) stages: Vec<Eight>,
    pub(super) increments: Vec<Eight>,
    pub(super) rates: Vec<Eight>,
    /// The state, its remainder, and by how much a change of each component counts.
    pub(super) z: Vec<f64>,
    pub(super) e: Vec<f64>,
    pub(super) counts: Vec<f64>,
    pub(super) next: Vec<f64>,
    slopes: Vec<f64>,
    /// Rates at the state and beside it, and two states; what terms of rates amount to.
    trial: Vec<f64>,
    terms: Vec<f64>,
    /// In eigenvectors, of one group.
    pub(super) turned: Vec<[Eight; 2]>,
    scratch: Vec<f64>,
}

impl Gauss {
    /// For steps of `h`.
    pub fn new(
        name: &'static str,
        table: Collocation,
        ending: Ending,
        system: &dyn Flow,
        h: f64,
    ) -> Gauss {
        let (m, s) = (system.len(), table.b.len());
        let columns = Columns::of(&table);
        let blocks = columns.blocks;
        let part = match system.linear() {
            Some(matrix) => LinearPart::new(columns, h, matrix, m),
            None => LinearPart::none(m),
        };
        let hb = weights(&table, h);
        let zeros = |packs: usize| vec![Eight::ZERO; packs];
        Gauss {
            name,
            h,
            ending,
            s,
            blocks,
            columns,
            weights: lanes(s, |i| hb[i]),
            reciprocals: lanes(s, |i| 1.0 / hb[i]),
            turned: vec![[Eight::ZERO; 2]; m],
            given: system.linear().is_some(),
            part,
            times: zeros(blocks),
            stages: zeros(blocks * m),
            increments: zeros(blocks * m),
            rates: zeros(blocks * m),
            z: vec![0.0; m],
            e: vec![0.0; m],
            counts: vec![0.0; m],
            next: vec![0.0; m],
            slopes: Vec::new(),
            trial: vec![0.0; 4 * m],
            terms: vec![0.0; m],
            scratch: vec![0.0; system.scratch_len()],
        }
    }

    /// Rates at all stages.
    fn sweep(&mut self, system: &dyn Flow, work: &mut Work) -> Result<()> {
        work.evaluations += self.s as u64;
        system.rates(&self.times, &self.stages, &mut self.rates, self.s, &mut self.scratch)
    }

    /// Takes rates for what they are, and goes one iteration on; the change, in parts of the state.
    fn correct(&mut self) -> f64 {
        match self.s {
            1 => dispatch(Correct::<1, 1>(self)),
            2 => dispatch(Correct::<2, 1>(self)),
            3 => dispatch(Correct::<3, 1>(self)),
            4 => dispatch(Correct::<4, 1>(self)),
            6 => dispatch(Correct::<6, 1>(self)),
            8 => dispatch(Correct::<8, 1>(self)),
            12 => dispatch(Correct::<12, 2>(self)),
            _ => dispatch(Correct::<16, 2>(self)),
        }
    }

    /// Stages to begin with: those of the linear part under what was left of rates at the last step,
    /// extrapolated.
    fn begin(
        &mut self,
        system: &dyn Flow,
        history: Option<&[Eight]>,
        work: &mut Work,
    ) -> Result<()> {
        let m = self.z.len();
        // Nothing is slight yet; infinity would make lanes without a stage no numbers.
        self.counts.fill(f64::MAX);
        let Some(history) = history else {
            for b in 0..self.blocks {
                for (stage, z) in self.stages[m * b..].iter_mut().zip(&self.z) {
                    *stage = Eight([*z; 8]);
                }
            }
            self.sweep(system, work)?;
            self.increments.fill(Eight::ZERO);
            self.correct();
            return Ok(());
        };
        match self.s {
            1 => dispatch(Ahead::<1, 1>(self, history)),
            2 => dispatch(Ahead::<2, 1>(self, history)),
            3 => dispatch(Ahead::<3, 1>(self, history)),
            4 => dispatch(Ahead::<4, 1>(self, history)),
            6 => dispatch(Ahead::<6, 1>(self, history)),
            8 => dispatch(Ahead::<8, 1>(self, history)),
            12 => dispatch(Ahead::<12, 2>(self, history)),
            _ => dispatch(Ahead::<16, 2>(self, history)),
        }
        self.increments.fill(Eight::ZERO);
        self.correct();
        Ok(())
    }

    /// Takes the Jacobian at the start of the step for the linear part; by differences where the
    /// system does not know it.
    fn differentiate(&mut self, system: &dyn Flow, t: f64, work: &mut Work) -> Result<()> {
        let m = self.z.len();
        self.slopes.resize(m * m, 0.0);
        let (out, scratch) = (&mut self.slopes, &mut self.trial);
        let t = t + 0.5 * self.h;
        work.evaluations += common::jacobian(system, t, &self.z, self.h, out, scratch)?;
        self.part.renew(self.columns, self.h, &self.slopes, m);
        Ok(())
    }

    /// What the terms of each rate amount to over a step, by how much the state's components change it:
    /// near an equilibrium rates are small as large terms cancel, and their rounding is that of these.
    fn judge(&mut self, system: &dyn Flow, t: f64, work: &mut Work) -> Result<()> {
        let m = self.z.len();
        let t = t + 0.5 * self.h;
        let (known, moved) = self.trial[..2 * m].split_at_mut(m);
        system.rate(t, &self.z, known)?;
        self.next.copy_from_slice(&self.z);
        for j in (0..m).filter(|&j| self.z[j] != 0.0) {
            self.next[j] = self.z[j] * (1.0 + 1e-8);
            system.rate(t, &self.next, moved)?;
            for (term, (moved, known)) in self.terms.iter_mut().zip(moved.iter().zip(&*known)) {
                *term += (1e8 * self.h * (moved - known)).abs();
            }
            self.next[j] = self.z[j];
        }
        work.evaluations += m as u64 + 1;
        Ok(())
    }

    /// How much a change of each component counts; of how many there is nothing to compare it with.
    fn weigh(&mut self) -> usize {
        let m = self.z.len();
        for d in 0..m {
            let blocks = &self.increments[self.blocks * d..][..self.blocks];
            let size =
                blocks.iter().fold(self.z[d].abs(), |size, block| size.max(block.0[0].abs()));
            self.counts[d] = size.max(self.terms[d]);
        }
        count(&mut self.counts, 1e-6)
    }

    /// Finds the stages; iterations that took.
    fn solve(
        &mut self,
        system: &dyn Flow,
        t: f64,
        history: Option<&[Eight]>,
        stiff: &mut bool,
        work: &mut Work,
    ) -> Result<()> {
        self.terms.fill(0.0);
        if *stiff {
            self.differentiate(system, t, work)?;
        }
        self.begin(system, history, work)?;
        let mut unknown = self.weigh();
        let mut changes = Changes::new(self.ending, NOTHING);
        let (mut iteration, mut since) = (0, 0);
        let (mut judged, mut was_slow) = (false, false);
        loop {
            iteration += 1;
            since += 1;
            self.sweep(system, work)?;
            let change = self.correct();
            if unknown > 0 {
                // From rest components start to move one after another.
                let before = std::mem::replace(&mut unknown, self.weigh());
                if unknown < before {
                    changes.forget();
                    continue;
                }
            }
            if changes.end_with(change) {
                return Ok(());
            }
            let rate = changes.rate;
            let lost = !change.is_finite() || (since > 2 && rate >= 1.0 && change > 1e-3);
            let slow = since >= PATIENCE && change > SMALL && {
                let more = (self.ending.least() / change).ln() / rate.ln();
                let jacobian = self.z.len() as f64 / self.s as f64;
                !(0.0..=8.0 + jacobian).contains(&more)
            };
            let doubtful = slow || (changes.in_vain >= 3 && change > NOISE);
            if doubtful && change.is_finite() && !judged {
                judged = true;
                self.judge(system, t, work)?;
                unknown = self.weigh();
                changes.forget();
                was_slow = slow;
                continue;
            }
            let slow = slow || (std::mem::take(&mut was_slow) && change > SMALL);
            let can = !*stiff && !self.given && self.z.len() <= MOST;
            if (lost || slow) && can {
                *stiff = true;
                self.differentiate(system, t, work)?;
                if lost {
                    self.begin(system, None, work)?;
                    unknown = self.weigh();
                }
                changes.forget();
                since = 0;
                continue;
            }
            if iteration >= CAP && change <= SMALL {
                return Ok(());
            }
            if !change.is_finite() || iteration >= CAP {
                return Err(not_solved_from(self.name, system, (t, &self.z), iteration, change));
            }
        }
    }
}

impl Stepper<dyn Flow> for Gauss {
    /// The remainder of the state; of the rates, at the stages; whether Jacobians are needed.
    fn carried_len(&self) -> usize {
        self.z.len().div_ceil(8) + self.stages.len() + 1
    }

    fn step(
        &mut self,
        system: &dyn Flow,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let m = state.z.len();
        let (kept, history) = state.carried.split_at_mut(m.div_ceil(8));
        let (history, flag) = history.split_at_mut(self.stages.len());
        self.z.copy_from_slice(&state.z);
        self.e.copy_from_slice(&doubles(kept)[..m]);
        for (time, place) in
            doubles_mut(&mut self.times).iter_mut().zip(doubles(&self.columns.places))
        {
            *time = t + place * self.h;
        }
        let mut stiff = flag[0].0[0] != 0.0;
        let known = (k > 0).then_some(&*history);
        self.solve(system, t, known, &mut stiff, work).map_err(|error| error.in_step(k))?;
        for d in 0..m {
            let mut sum = 0.0;
            for block in self.increments[self.blocks * d..][..self.blocks].iter().rev() {
                sum += Lanes::sum(block.0);
            }
            self.next[d] = self.z[d];
            add_compensated(&mut self.next[d], &mut self.e[d], sum);
        }
        check_finite(self.name, t, k, &self.next)?;
        dispatch(Remainder(self, history));
        doubles_mut(kept)[..m].copy_from_slice(&self.e);
        flag[0].0[0] = f64::from(u8::from(stiff));
        state.z.copy_from_slice(&self.next);
        work.steps += 1;
        Ok(())
    }
}
