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

use super::linear_part::{LinearPart, numbers, times};
use crate::error::Result;
use crate::linalg::kernel::{Body, Eight, Lanes, Pack, dispatch, doubles, doubles_mut, packs, packs_mut};
use crate::method::common::{check_finite, not_solved};
use crate::method::{State, Stepper, Work};
use crate::system::Flow;
use crate::tableau::Collocation;

/// Iterations at most.
const CAP: u32 = 100;

/// Change, in parts of the state, below which one that does not shrink is rounding.
const SMALL: f64 = 1e-11;

/// The same where it has not shrunk for some iterations: of rates that lose many digits.
const NOISE: f64 = 1e-7;

/// Change that is none.
const NOTHING: f64 = 1e-20;

/// Iterations after which it is asked whether a Jacobian would be cheaper.
const PATIENCE: u32 = 8;

/// What rounding leaves of a change, about.
const ROUNDING: f64 = 1e-16;

/// When iterations end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// Where nothing changes any more: no drift.
    Rounding,
    /// Where the next change would be below rounding: faster, with a drift that 1e6 steps show.
    Tolerance,
}

/// Method and memory. Stages lie in blocks of eight lanes: component d of block b at `b m + d`.
pub struct Gauss {
    name: &'static str,
    h: f64,
    ending: Ending,
    table: Collocation,
    blocks: usize,
    /// `h b` and its reciprocal, a pack a block; places of the stages, those of the first where there is
    /// no stage.
    weights: Vec<Eight>,
    reciprocals: Vec<Eight>,
    places: Vec<Eight>,
    /// Columns of mu and of what extrapolates, a pack a block each.
    mu: Vec<Eight>,
    ahead: Vec<Eight>,
    /// Columns, a stage each, of `V^-1`, lanes are eigenvalues; columns, an eigenvalue each, of V.
    forward: Vec<[Eight; 2]>,
    backward: Vec<[Eight; 2]>,
    part: LinearPart,
    /// Whether `part` is that of the system, not of a Jacobian.
    given: bool,
    times: Vec<Eight>,
    stages: Vec<Eight>,
    increments: Vec<Eight>,
    rates: Vec<Eight>,
    /// The state, its remainder, and by how much a change of each component counts.
    z: Vec<f64>,
    e: Vec<f64>,
    counts: Vec<f64>,
    next: Vec<f64>,
    slopes: Vec<f64>,
    /// In eigenvectors, of one group.
    turned: Vec<[Eight; 2]>,
    left: Vec<Eight>,
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
        let blocks = s.div_ceil(8);
        let part = match system.linear() {
            Some(matrix) => LinearPart::new(&table, h, matrix, m),
            None => LinearPart::none(m),
        };
        let lanes = |of: &dyn Fn(usize) -> f64, len: usize| -> Vec<Eight> {
            let lane = |i: usize| if i < len { of(i) } else { 0.0 };
            (0..len.div_ceil(8)).map(|b| Eight(std::array::from_fn(|i| lane(8 * b + i)))).collect()
        };
        let columns = |matrix: &[f64]| -> Vec<Eight> {
            (0..s).flat_map(|j| lanes(&|i| matrix[s * i + j], s)).collect()
        };
        // The middle one, or the two outer ones, make the sum h as it is rounded.
        let mut hb: Vec<f64> = table.b.iter().map(|b| h * b).collect();
        let excess = h - hb.iter().sum::<f64>();
        match s % 2 {
            1 => hb[s / 2] += excess,
            _ => {
                hb[0] += 0.5 * excess;
                hb[s - 1] += 0.5 * excess;
            }
        }
        let pairs = table.values_real.len();
        let forward = (0..s).map(|j| {
            let part = |of: &[f64]| lanes(&|k| of[s * k + j], pairs)[0];
            [part(table.forward_real), part(table.forward_imaginary)]
        });
        let backward = (0..pairs).flat_map(|k| {
            let part = |of: &[f64]| lanes(&|i| of[s * k + i], s);
            let (re, im) = (part(table.backward_real), part(table.backward_imaginary));
            re.into_iter().zip(im).map(|(re, im)| [re, im])
        });
        let zeros = |packs: usize| vec![Eight::ZERO; packs];
        let mut places = lanes(&|i| table.c[i], s);
        doubles_mut(&mut places)[s..].fill(table.c[0]);
        Gauss {
            name,
            h,
            ending,
            blocks,
            weights: lanes(&|i| hb[i], s),
            reciprocals: lanes(&|i| 1.0 / hb[i], s),
            places,
            mu: columns(table.mu),
            ahead: columns(table.ahead),
            forward: forward.collect(),
            backward: backward.collect(),
            turned: vec![[Eight::ZERO; 2]; m],
            left: zeros(blocks),
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
            scratch: vec![0.0; system.scratch_len()],
            table,
        }
    }

    /// Rates at all stages.
    fn sweep(&mut self, system: &dyn Flow, work: &mut Work) -> Result<()> {
        work.evaluations += self.table.b.len() as u64;
        system.rates(&self.times, &self.stages, &mut self.rates, &mut self.scratch)
    }

    /// Takes rates for what they are, and goes one iteration on; the change, in parts of the state.
    fn correct(&mut self) -> f64 {
        match self.table.b.len() {
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
    fn begin(&mut self, system: &dyn Flow, history: Option<&[Eight]>, work: &mut Work) -> Result<()> {
        let m = self.z.len();
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
        match self.table.b.len() {
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

    /// Takes the Jacobian at the start of the step for the linear part.
    fn differentiate(&mut self, system: &dyn Flow, t: f64, work: &mut Work) -> Result<()> {
        let m = self.z.len();
        let t = t + 0.5 * self.h;
        // The Jacobian, then a rate and another.
        self.slopes.resize(m * m + 2 * m, 0.0);
        let (jacobian, rates) = self.slopes.split_at_mut(m * m);
        let (known, moved) = rates.split_at_mut(m);
        system.rate(t, &self.z, known)?;
        let size = self.z.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        self.next.copy_from_slice(&self.z);
        for j in 0..m {
            // Half the digits for the difference, half for what it neglects.
            let d = 1.5e-8 * self.z[j].abs().max(1e-3 * size).max(1e-8);
            self.next[j] = self.z[j] + d;
            let d = self.next[j] - self.z[j];
            system.rate(t, &self.next, moved)?;
            for i in 0..m {
                jacobian[m * i + j] = (moved[i] - known[i]) / d;
            }
            self.next[j] = self.z[j];
        }
        work.evaluations += m as u64 + 1;
        self.part.renew(&self.table, self.h, &self.slopes[..m * m], m);
        Ok(())
    }

    /// How much a change of each component counts.
    fn weigh(&mut self) {
        let m = self.z.len();
        let half = m.div_ceil(2);
        let mut sizes = [0.0_f64; 2];
        let mut largest = |d: usize| {
            let last = self.increments[m * (self.blocks - 1) + d].0[0];
            let size = self.z[d].abs().max(last.abs()).max(self.increments[d].0[0].abs());
            self.counts[d] = size;
            sizes[d / half] = sizes[d / half].max(size);
        };
        (0..m).for_each(&mut largest);
        for (d, count) in self.counts.iter_mut().enumerate() {
            // Small ones beside large ones count as well, noise does not.
            let size = count.max(1e-6 * sizes[d / half]);
            *count = if size > 0.0 { 1.0 / size } else { 0.0 };
        }
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
        if *stiff {
            self.differentiate(system, t, work)?;
        }
        self.begin(system, history, work)?;
        self.weigh();
        let (mut last, mut iteration, mut since) = (f64::INFINITY, 0, 0);
        let (mut least, mut in_vain) = (f64::INFINITY, 0);
        loop {
            iteration += 1;
            since += 1;
            self.sweep(system, work)?;
            let change = self.correct();
            let rate = change / last;
            in_vain = if change < least { 0 } else { in_vain + 1 };
            least = least.min(change);
            let at_rest = (rate >= 1.0 && change <= SMALL) || (in_vain >= 3 && change <= NOISE);
            if change <= NOTHING || at_rest {
                return Ok(());
            }
            if self.ending == Ending::Tolerance && change * rate.min(1.0) <= ROUNDING {
                return Ok(());
            }
            let lost = !change.is_finite() || (since > 2 && rate >= 1.0 && change > 1e-3);
            let slow = since >= PATIENCE && change > SMALL && {
                let more = (ROUNDING / change).ln() / rate.ln();
                let jacobian = self.z.len() as f64 / self.table.b.len() as f64;
                !(0.0..=8.0 + jacobian).contains(&more)
            };
            if (lost || slow) && !*stiff && !self.given {
                *stiff = true;
                self.differentiate(system, t, work)?;
                if lost {
                    self.begin(system, None, work)?;
                }
                (last, least, since, in_vain) = (f64::INFINITY, f64::INFINITY, 0, 0);
                continue;
            }
            if !change.is_finite() || iteration >= CAP {
                return Err(not_solved(self.name, t, 0, iteration, change));
            }
            last = change;
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
        for (time, place) in doubles_mut(&mut self.times).iter_mut().zip(doubles(&self.places)) {
            *time = t + place * self.h;
        }
        let mut stiff = flag[0].0[0] != 0.0;
        let known = (k > 0).then_some(&*history);
        self.solve(system, t, known, &mut stiff, work).map_err(|error| error.in_step(k))?;
        for d in 0..m {
            let mut sum = 0.0;
            for b in (0..self.blocks).rev() {
                sum += dispatch_sum(&self.increments[m * b + d]);
            }
            let step = self.e[d] + sum;
            self.next[d] = self.z[d] + step;
            self.e[d] = step - (self.next[d] - self.z[d]);
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

/// The sum of eight lanes in the order of [`Lanes::sum`].
fn dispatch_sum(x: &Eight) -> f64 {
    let x = x.0;
    ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]))
}

/// One iteration, with S stages in B blocks; the largest change.
struct Correct<'a, const S: usize, const B: usize>(&'a mut Gauss);

impl<const S: usize, const B: usize> Body for Correct<'_, S, B> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Lanes>(self) -> f64 {
        let gauss = self.0;
        let m = gauss.z.len();
        let hb: [Pack<V>; B] = blocks(&gauss.weights);
        let mut change = Pack::<V>::splat(0.0);
        let mut bad = Pack::<V>::splat(0.0);
        for &d in &gauss.part.free {
            let counts = Pack::splat(gauss.counts[d]);
            for b in 0..B {
                let L = &mut packs_mut::<V>(&mut gauss.increments)[m * b + d];
                let new = hb[b] * packs::<V>(&gauss.rates)[m * b + d];
                let step = new - *L;
                *L = new;
                change = change.max(step.abs() * counts);
                bad = bad + step;
            }
        }
        for group in &gauss.part.groups {
            let r = group.members.len();
            for (&d, turned) in group.members.iter().zip(&mut gauss.turned) {
                for b in 0..B {
                    packs_mut::<V>(&mut gauss.left)[b] = hb[b]
                        * packs::<V>(&gauss.rates)[m * b + d]
                        - packs::<V>(&gauss.increments)[m * b + d];
                }
                let left = doubles(&gauss.left);
                let mut sums = [[Pack::<V>::splat(0.0); 2]; 2];
                for (j, column) in gauss.forward[..S].iter().enumerate() {
                    let x = Pack::splat(left[j]);
                    let [re, im] = numbers::<V>(column);
                    let sum = &mut sums[j % 2];
                    *sum = [sum[0] + re * x, sum[1] + im * x];
                }
                let turned = packs_mut::<V>(turned);
                (turned[0], turned[1]) = (sums[0][0] + sums[1][0], sums[0][1] + sums[1][1]);
            }
            for (i, &d) in group.members.iter().enumerate() {
                let mut sum = [Pack::<V>::splat(0.0); 2];
                for j in 0..r {
                    if group.zero[r * i + j] {
                        continue;
                    }
                    let [x, y] = times(
                        numbers::<V>(&group.inverse[r * i + j]),
                        numbers::<V>(&gauss.turned[j]),
                    );
                    sum = [sum[0] + x, sum[1] + y];
                }
                let mut lanes = [Eight::ZERO; 2];
                for (lanes, sum) in packs_mut::<V>(&mut lanes).iter_mut().zip(sum) {
                    *lanes = sum;
                }
                let counts = Pack::splat(gauss.counts[d]);
                let mut steps = [[Pack::<V>::splat(0.0); B]; 2];
                for k in 0..S.div_ceil(2) {
                    let (x, y) = (Pack::splat(lanes[0].0[k]), Pack::splat(lanes[1].0[k]));
                    for b in 0..B {
                        let [re, im] = numbers::<V>(&gauss.backward[B * k + b]);
                        steps[0][b] = steps[0][b] + re * x;
                        steps[1][b] = steps[1][b] + im * y;
                    }
                }
                for b in 0..B {
                    let step = steps[0][b] - steps[1][b];
                    let L = &mut packs_mut::<V>(&mut gauss.increments)[m * b + d];
                    *L = *L + step;
                    change = change.max(step.abs() * counts);
                    bad = bad + step;
                }
            }
        }
        for d in 0..m {
            let (z, e) = (Pack::splat(gauss.z[d]), Pack::splat(gauss.e[d]));
            let sums = stage_sums::<V, S, B>(&gauss.mu, &gauss.increments, m, d);
            for (b, sum) in sums.into_iter().enumerate() {
                packs_mut::<V>(&mut gauss.stages)[m * b + d] = z + (e + sum);
            }
        }
        // What is no number is lost in a maximum, never in a sum.
        let bad = bad.sum();
        if bad.is_finite() { change.largest() } else { f64::NAN }
    }
}

/// The packs of as many blocks.
#[inline(always)]
fn blocks<V: Lanes, const B: usize>(memory: &[Eight]) -> [Pack<V>; B] {
    *packs::<V>(memory).first_chunk().expect("a pack a block")
}

/// `sum of columns_j x_j` for component d, in two chains a block so that additions overlap.
#[inline(always)]
fn stage_sums<V: Lanes, const S: usize, const B: usize>(
    columns: &[Eight],
    x: &[Eight],
    m: usize,
    d: usize,
) -> [Pack<V>; B] {
    let mut sums = [[Pack::<V>::splat(0.0); B]; 2];
    for block in 0..B {
        let lanes = &x[m * block + d].0;
        for j in 8 * block..S.min(8 * block + 8) {
            let x = Pack::splat(lanes[j - 8 * block]);
            let column: [Pack<V>; B] = blocks(&columns[B * j..]);
            for b in 0..B {
                sums[j % 2][b] = sums[j % 2][b] + column[b] * x;
            }
        }
    }
    std::array::from_fn(|b| sums[0][b] + sums[1][b])
}

/// Rates of the last step, extrapolated, but for what the linear part adds to those at the state.
struct Ahead<'a, const S: usize, const B: usize>(&'a mut Gauss, &'a [Eight]);

impl<const S: usize, const B: usize> Body for Ahead<'_, S, B> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Ahead(gauss, history) = self;
        let m = gauss.z.len();
        for d in 0..m {
            let sums = stage_sums::<V, S, B>(&gauss.ahead, history, m, d);
            for (b, sum) in sums.into_iter().enumerate() {
                packs_mut::<V>(&mut gauss.rates)[m * b + d] = sum;
            }
        }
    }
}

/// Rates at the stages without what the linear part makes of their distance from the end of the step.
struct Remainder<'a>(&'a Gauss, &'a mut [Eight]);

impl Body for Remainder<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Remainder(gauss, history) = self;
        let m = gauss.z.len();
        for b in 0..gauss.blocks {
            let stages = &packs::<V>(&gauss.stages)[m * b..][..m];
            let reciprocals = packs::<V>(&gauss.reciprocals)[b];
            for d in 0..m {
                let mut rest = packs::<V>(&gauss.increments)[m * b + d] * reciprocals;
                for (j, a) in &gauss.part.rows[d] {
                    rest = rest - *a * (stages[*j] - gauss.next[*j]);
                }
                packs_mut::<V>(history)[m * b + d] = rest;
            }
        }
    }
}
