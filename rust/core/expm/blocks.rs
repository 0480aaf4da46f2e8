//! Stepping in blocks: `[z_B .. z_2B-1] = W^B [z_0 .. z_B-1]`, one product for `B` steps.
//!
//! Stepping with a stored matrix is bound by memory; a block does the work of a matrix product with
//! each matrix it reads. Which product makes a state depends on the number of its step alone, so
//! storing every state or one in a thousand, in one run or two, gives the same bits.
//!
//! With [`Correction::Exact`] a state is a pair `z + e`, and the propagator is cut so that its
//! leading part multiplies states without error; `e` enters the product, and the state stays
//! correctly rounded for a million steps.

use std::sync::Arc;

use super::doubling::Form;
use super::propagator::{Correction, Propagator, state_overflow};
use crate::error::Result;
use crate::linalg::dense::{self, Watch, exponent_above, power_of_two};
use crate::linalg::kernel::{
    CutPropagator, CutStates, Depth, Eight, Finite, Layout, Maxima, PairProduct, Product, dispatch,
    doubles, doubles_mut, slice_bits,
};

/// A bound is set this many powers of two above what it was found too small for.
const MARGIN: i32 = 3;

/// Blocks after which bounds that have become too wide are drawn in.
const REVIEW: u64 = 64;

/// Bounds stay within this factor of each other and of 1, so that cutting cannot overflow.
const WIDEST: f64 = 1e270;

/// The machinery of one run: `batch` trajectories side by side.
pub struct Blocks {
    propagator: Arc<Propagator>,
    batch: usize,
    width: usize,
    /// The block being made: states, and remainders where they are kept.
    next: Vec<Eight>,
    next_e: Vec<Eight>,
    /// Propagators cut for the bounds of the moment, one a power.
    cuts: Vec<Cut>,
    z1: Vec<Eight>,
    z2: Vec<Eight>,
    bounds: Vec<Eight>,
    maxima: Vec<Eight>,
    grain: f64,
}

#[derive(Default)]
struct Cut {
    bounds: Vec<Eight>,
    t1: Vec<Eight>,
    t2: Vec<Eight>,
}

impl Blocks {
    /// Prepares the powers of the propagator and the work space.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory); what `watch` reports.
    pub fn new(propagator: Arc<Propagator>, batch: usize, watch: &mut Watch) -> Result<Blocks> {
        let layout = propagator.layout();
        let powers = propagator.powers(watch)?.len();
        let width = 1 << (powers - 1);
        let packs = layout.packs(width).saturating_mul(batch);
        let exact = propagator.correction == Correction::Exact;
        let remainder = if exact { packs } else { 0 };
        Ok(Blocks {
            batch,
            width,
            next: dense::zeros(packs)?,
            next_e: dense::zeros(remainder)?,
            cuts: (0..powers).map(|_| Cut::default()).collect(),
            z1: dense::zeros(remainder)?,
            z2: dense::zeros(remainder)?,
            bounds: vec![Eight::ZERO; layout.stride],
            maxima: vec![Eight::ZERO; layout.stride],
            grain: power_of_two(-slice_bits(layout.rows)),
            propagator,
        })
    }

    /// Steps in a block.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Packs of memory that carry a run from block to block: the states of the block, and with
    /// [`Correction::Exact`] their remainders, the bounds of the components, and the largest
    /// magnitudes since the bounds were last reviewed.
    pub fn carried_len(&self) -> usize {
        self.next.len()
            + self.next_e.len()
            + if self.exact() { 2 * self.layout().stride } else { 0 }
    }

    fn exact(&self) -> bool {
        self.propagator.correction == Correction::Exact
    }

    fn layout(&self) -> Layout {
        self.propagator.layout()
    }

    /// Packs of one step: the states of all trajectories.
    fn step_packs(&self) -> usize {
        self.layout().packs(self.batch)
    }

    /// Makes the first block from the states `z`, one trajectory after the other.
    pub fn start(&mut self, z: &[f64], carried: &mut [Eight]) -> Result<()> {
        let one = self.step_packs();
        self.next.fill(Eight::ZERO);
        self.next_e.fill(Eight::ZERO);
        self.bounds.fill(Eight::ZERO);
        self.maxima.fill(Eight::ZERO);
        dense::pack(self.layout(), z, &mut self.next[..one]);
        let mut done = one;
        for power in 0..self.cuts.len() - 1 {
            let (from, to) = self.next.split_at_mut(done);
            let (from, to) = (&*from, &mut to[..done]);
            if self.next_e.is_empty() {
                plain(&self.propagator, power, from, to);
            } else {
                let (from_e, to_e) = self.next_e.split_at_mut(done);
                let states = States { from, from_e, to, to_e: &mut to_e[..done] };
                bound(self.propagator.layout(), from, &mut self.bounds, &mut self.maxima)?;
                exact(
                    &self.propagator,
                    power,
                    &mut self.cuts[power],
                    &self.bounds,
                    self.grain,
                    states,
                    (&mut self.z1, &mut self.z2),
                );
            }
            done *= 2;
        }
        self.store(carried);
        Ok(())
    }

    /// Makes block number `block` (1, 2, …) from the one before it.
    pub fn advance(&mut self, block: u64, carried: &mut [Eight]) -> Result<()> {
        let power = self.cuts.len() - 1;
        let (from, rest) = carried.split_at_mut(self.next.len());
        if self.next_e.is_empty() {
            plain(&self.propagator, power, from, &mut self.next);
        } else {
            let layout = self.propagator.layout();
            let (from_e, rest) = rest.split_at_mut(self.next_e.len());
            let (bounds, maxima) = rest.split_at_mut(layout.stride);
            self.bounds.copy_from_slice(bounds);
            self.maxima.copy_from_slice(maxima);
            if block.is_multiple_of(REVIEW) {
                review(layout, &mut self.bounds, &mut self.maxima);
            }
            bound(layout, from, &mut self.bounds, &mut self.maxima)?;
            let states = States { from, from_e, to: &mut self.next, to_e: &mut self.next_e };
            exact(
                &self.propagator,
                power,
                &mut self.cuts[power],
                &self.bounds,
                self.grain,
                states,
                (&mut self.z1, &mut self.z2),
            );
        }
        self.store(carried);
        Ok(())
    }

    fn store(&self, carried: &mut [Eight]) {
        let mut rest = carried;
        let exact = self.exact();
        let parts = [
            (&self.next, true),
            (&self.next_e, exact),
            (&self.bounds, exact),
            (&self.maxima, exact),
        ];
        for (part, _) in parts.into_iter().filter(|(_, kept)| *kept) {
            let (here, next) = rest.split_at_mut(part.len());
            here.copy_from_slice(part);
            rest = next;
        }
    }

    /// Copies the states of steps `from..to` of the block out, one after the other.
    ///
    /// # Errors
    /// [`Error::Overflow`](crate::Error::Overflow) at the first state that is not finite; `done`
    /// counts the steps copied before it.
    pub fn read(
        &self,
        carried: &[Eight],
        from: usize,
        to: usize,
        rows: &mut [f64],
        done: &mut usize,
    ) -> Result<()> {
        let one = self.step_packs();
        let states = &carried[from * one..to * one];
        if dispatch(Finite { x: states }) {
            dense::unpack(self.layout(), states, rows);
            *done += to - from;
            return Ok(());
        }
        let row_len = self.batch * self.layout().rows;
        for (states, row) in states.chunks_exact(one).zip(rows.chunks_exact_mut(row_len)) {
            if !dense::is_finite(doubles(states)) {
                return Err(state_overflow());
            }
            dense::unpack(self.layout(), states, row);
            *done += 1;
        }
        Ok(())
    }
}

struct States<'a> {
    from: &'a [Eight],
    from_e: &'a [Eight],
    to: &'a mut [Eight],
    to_e: &'a mut [Eight],
}

fn plain(propagator: &Propagator, power: usize, from: &[Eight], to: &mut [Eight]) {
    let layout = propagator.layout();
    let power = propagator.power(power);
    let add = (power.form == Form::Increment).then_some((1.0, from));
    let columns = to.len() / layout.stride;
    dispatch(Product { layout, columns, a: &power.hi, b: from, add, c: to });
}

fn exact(
    propagator: &Propagator,
    power: usize,
    cut: &mut Cut,
    bounds: &[Eight],
    grain: f64,
    states: States,
    (z1, z2): (&mut [Eight], &mut [Eight]),
) {
    let layout = propagator.layout();
    let power = propagator.power(power);
    if cut.bounds != bounds {
        cut.t1.resize(power.hi.len(), Eight::ZERO);
        cut.t2.resize(power.hi.len(), Eight::ZERO);
        let (t1, t2) = (&mut cut.t1, &mut cut.t2);
        dispatch(CutPropagator { layout, grain, bounds, hi: &power.hi, lo: &power.lo, t1, t2 });
        cut.bounds = bounds.to_vec();
    }
    let packs = states.from.len();
    let (z1, z2) = (&mut z1[..packs], &mut z2[..packs]);
    let (z, e) = (states.from, states.from_e);
    dispatch(CutStates { layout, grain, bounds, z, e, z1: &mut *z1, z2: &mut *z2 });
    dispatch(PairProduct {
        layout,
        columns: packs / layout.stride,
        depth: Depth::Two,
        a: [&cut.t1, &cut.t2, &[]],
        b: [z1, z2, &[], &[]],
        b_hi: z,
        add: (power.form == Form::Increment).then_some((1.0, z, e)),
        hi: states.to,
        lo: states.to_e,
    });
}

/// Widens the bounds of components that have outgrown them, and notes the largest magnitudes.
fn bound(
    layout: Layout,
    states: &[Eight],
    bounds: &mut [Eight],
    maxima: &mut [Eight],
) -> Result<()> {
    dispatch(Maxima { layout, x: states, largest: &mut *maxima });
    let maxima = &doubles(maxima)[..layout.rows];
    let bounds = &mut doubles_mut(bounds)[..layout.rows];
    let largest = maxima.iter().fold(0.0_f64, |a, &b| a.max(b));
    if largest > WIDEST {
        return Err(state_overflow());
    }
    // Bounds far below the largest would let the shifts of cutting overflow.
    let floor = power_of_two(exponent_above(largest.max(1e-250)) - 400);
    for (bound, &found) in bounds.iter_mut().zip(maxima) {
        if found > *bound || *bound < floor {
            *bound = power_of_two(exponent_above(found.max(floor)) + MARGIN);
        }
    }
    Ok(())
}

/// Draws in the bounds of components that have become much smaller, and begins to watch anew.
fn review(layout: Layout, bounds: &mut [Eight], maxima: &mut [Eight]) {
    let found = &mut doubles_mut(maxima)[..layout.rows];
    for (bound, found) in doubles_mut(bounds).iter_mut().zip(found) {
        let tight = power_of_two(exponent_above(found.max(1e-280)) + MARGIN);
        if *bound > 4.0 * tight {
            *bound = tight;
        }
        *found = 0.0;
    }
}
