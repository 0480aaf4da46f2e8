//! Stepping in blocks: `[z_B .. z_2B-1] = W^B [z_0 .. z_B-1]`, one product for `B` steps.
//!
//! Stepping with a stored matrix is bound by memory; a block does the work of a matrix product with
//! each matrix it reads. Which product makes a state depends on the number of its step alone, so
//! storing every state or one in a thousand, in one run or two, gives the same bits.
//!
//! With [`Correction::Exact`] a state is a pair `z + e`, and the propagator is cut so that its
//! leading part multiplies states without error; `e` enters the product, and the state stays
//! correctly rounded for a million steps. A component that becomes much smaller beside the others
//! than its bound is as exact as one product after the other leaves it.

use std::sync::Arc;

use super::doubling::Form;
use super::propagator::{Correction, Power, Propagator, state_overflow};
use crate::error::{Error, Result};
use crate::linalg::dense::{self, Watch, exponent_above, power_of_two};
use crate::linalg::kernel::{
    CutPropagator, CutStates, Depth, Eight, Layout, Maxima, PairProduct, Product, dispatch,
    doubles, doubles_mut, slice_bits,
};

/// A bound is set this many powers of two above what it was found too small for.
const MARGIN: i32 = 3;

/// Blocks after which bounds that have become too wide are drawn in.
const REVIEW: u64 = 64;

/// Packs of a block at most, 64 MiB: large batches take shorter blocks.
const LARGEST: usize = 1 << 20;

/// Bounds stay within this factor of each other and of 1, so that cutting cannot overflow.
const WIDEST: f64 = 1e270;

/// A run in blocks: the block of a step is what is carried.
pub trait Walk: Send {
    /// Steps in a block.
    fn width(&self) -> usize;

    /// Packs of memory that carry a run from block to block.
    fn carried_len(&self) -> usize;

    /// Makes the first block from the states `z`, one trajectory after the other.
    ///
    /// # Errors
    /// [`Error::Overflow`]; what is carried is then as it was.
    fn start(&mut self, z: &[f64], carried: &mut [Eight]) -> Result<()>;

    /// Makes block number `block` (1, 2, …) from the one before it.
    ///
    /// # Errors
    /// [`Error::Overflow`] where its first state is not finite; what is
    /// carried is then as it was.
    fn advance(&mut self, block: u64, carried: &mut [Eight]) -> Result<()>;

    /// Copies the states of steps `from..to` of the block out, one after the other.
    ///
    /// # Errors
    /// [`Error::Overflow`] at the first state that is not finite; `done`
    /// counts the steps copied before it.
    fn read(
        &self,
        carried: &[Eight],
        from: usize,
        to: usize,
        rows: &mut [f64],
        done: &mut usize,
    ) -> Result<()> {
        self.read_each(carried, from, to, rows, done)
    }

    /// As [`read`](Self::read), one step after the other: up to one that is not finite.
    ///
    /// # Errors
    /// As there.
    fn read_each(
        &self,
        carried: &[Eight],
        from: usize,
        to: usize,
        rows: &mut [f64],
        done: &mut usize,
    ) -> Result<()> {
        let len = rows.len() / (to - from).max(1);
        for (at, row) in (from..to).zip(rows.chunks_exact_mut(len)) {
            self.read_one(carried, at, row)?;
            *done += 1;
        }
        Ok(())
    }

    /// Copies the states of step `at` of the block out.
    ///
    /// # Errors
    /// [`Error::Overflow`] where a state is not finite; nothing is copied.
    fn read_one(&self, carried: &[Eight], at: usize, row: &mut [f64]) -> Result<()>;

    /// The whole state after step `k`, where what is read is not that; the block is carried.
    ///
    /// # Errors
    /// Those of a load.
    fn whole(&self, _k: u64, _carried: &[Eight]) -> Result<Vec<f64>> {
        Err(Error::unsupported("states are read as they are"))
    }
}

/// The free motion of `batch` trajectories side by side.
pub struct Blocks {
    propagator: Arc<Propagator>,
    /// Where the components that are shown lie; the others are stepped along.
    shown: Layout,
    batch: usize,
    powers: usize,
    /// The block being made.
    next: Vec<Eight>,
    /// What [`Correction::Exact`] needs besides.
    exact: Option<Exact>,
}

impl Blocks {
    /// Prepares the powers of the propagator and the work space; the first `shown` components of
    /// states are read.
    ///
    /// # Errors
    /// [`Error::Memory`]; what `watch` reports.
    pub fn new(
        propagator: Arc<Propagator>,
        shown: usize,
        batch: usize,
        watch: &mut Watch,
    ) -> Result<Blocks> {
        let layout = propagator.layout();
        let mut powers = propagator.powers(watch)?.len();
        while powers > 1 && layout.packs(batch).saturating_mul(1 << (powers - 1)) > LARGEST {
            powers -= 1;
        }
        let packs = layout.packs(1 << (powers - 1)).saturating_mul(batch);
        let exact = match propagator.correction {
            Correction::Exact => Some(Exact::new(layout, powers, packs)?),
            _ => None,
        };
        let shown = visible(layout, shown);
        Ok(Blocks { shown, batch, powers, next: dense::zeros(packs)?, exact, propagator })
    }

    fn layout(&self) -> Layout {
        self.propagator.layout()
    }

    /// Packs of one step: the states of all trajectories.
    fn step_packs(&self) -> usize {
        self.layout().packs(self.batch)
    }
}

impl Walk for Blocks {
    fn width(&self) -> usize {
        1 << (self.powers - 1)
    }

    fn carried_len(&self) -> usize {
        carried_len(&self.next, self.exact.as_ref())
    }

    fn start(&mut self, z: &[f64], carried: &mut [Eight]) -> Result<()> {
        let mut done = self.step_packs();
        self.next.fill(Eight::ZERO);
        dense::pack(self.layout(), z, &mut self.next[..done]);
        if let Some(exact) = &mut self.exact {
            exact.clear();
        }
        for number in 0..self.powers - 1 {
            let power = self.propagator.power(number);
            let (from, to) = self.next.split_at_mut(done);
            let (from, to) = (&*from, &mut to[..done]);
            match &mut self.exact {
                None => plain(self.propagator.layout(), power, from, to),
                Some(exact) => exact.double(number, power, from, to)?,
            }
            done *= 2;
        }
        store(&self.next, self.exact.as_ref(), carried);
        Ok(())
    }

    fn advance(&mut self, block: u64, carried: &mut [Eight]) -> Result<()> {
        let number = self.powers - 1;
        let power = self.propagator.power(number);
        let (from, rest) = carried.split_at(self.next.len());
        match &mut self.exact {
            None => plain(self.propagator.layout(), power, from, &mut self.next),
            Some(exact) => exact.advance(block, number, power, from, rest, &mut self.next)?,
        }
        // A later state that is not finite is found when it is read; the block up to it is good.
        if !dense::is_finite(doubles(&self.next[..self.step_packs()])) {
            return Err(state_overflow());
        }
        store(&self.next, self.exact.as_ref(), carried);
        Ok(())
    }

    fn read(
        &self,
        carried: &[Eight],
        from: usize,
        to: usize,
        rows: &mut [f64],
        done: &mut usize,
    ) -> Result<()> {
        let one = self.step_packs();
        let states = &carried[from * one..to * one];
        if dense::unpack(self.shown, states, rows) {
            *done += to - from;
            return Ok(());
        }
        self.read_each(carried, from, to, rows, done)
    }

    fn read_one(&self, carried: &[Eight], at: usize, row: &mut [f64]) -> Result<()> {
        let one = self.step_packs();
        copy_out(self.shown, &carried[at * one..][..one], row)
    }
}

/// Copies states out if all of them are finite.
pub(super) fn copy_out(shown: Layout, states: &[Eight], row: &mut [f64]) -> Result<()> {
    if !dense::is_finite(doubles(states)) {
        return Err(state_overflow());
    }
    dense::unpack(shown, states, row);
    Ok(())
}

/// Packs that [`store`] needs.
pub(super) fn carried_len(states: &[Eight], exact: Option<&Exact>) -> usize {
    let parts = exact.map(|exact| exact.carried().map(<[Eight]>::len));
    states.len() + parts.map_or(0, |lengths| lengths.iter().sum())
}

/// Copies a block, and what goes with it, to where it is carried.
pub(super) fn store(states: &[Eight], exact: Option<&Exact>, carried: &mut [Eight]) {
    let (here, mut rest) = carried.split_at_mut(states.len());
    here.copy_from_slice(states);
    for part in exact.into_iter().flat_map(Exact::carried) {
        let (here, next) = rest.split_at_mut(part.len());
        here.copy_from_slice(part);
        rest = next;
    }
}

/// The layout of the first `rows` rows of columns.
pub(super) fn visible(layout: Layout, rows: usize) -> Layout {
    Layout { rows, height: rows.div_ceil(8), stride: layout.stride }
}

pub(super) fn plain(layout: Layout, power: &Power, from: &[Eight], to: &mut [Eight]) {
    let add = (power.form == Form::Increment).then_some((1.0, from));
    let columns = to.len() / layout.stride;
    dispatch(Product { layout, columns, a: &power.hi, b: from, add, c: to });
}

/// Remainders of states, the bounds of components, and propagators cut for them.
pub(super) struct Exact {
    layout: Layout,
    grain: f64,
    /// Remainders of the block being made.
    pub(super) e: Vec<Eight>,
    bounds: Vec<Eight>,
    maxima: Vec<Eight>,
    inverses: Vec<Eight>,
    /// Propagators cut for the bounds of the moment, one a power.
    cuts: Vec<Cut>,
    z1: Vec<Eight>,
    z2: Vec<Eight>,
}

#[derive(Default)]
struct Cut {
    bounds: Vec<Eight>,
    t1: Vec<Eight>,
    t2: Vec<Eight>,
}

impl Exact {
    pub(super) fn new(layout: Layout, powers: usize, packs: usize) -> Result<Exact> {
        Ok(Exact {
            layout,
            grain: power_of_two(-slice_bits(layout.rows)),
            e: dense::zeros(packs)?,
            bounds: vec![Eight::ZERO; layout.stride],
            maxima: vec![Eight::ZERO; layout.stride],
            inverses: vec![Eight::ZERO; layout.stride],
            cuts: (0..powers).map(|_| Cut::default()).collect(),
            z1: dense::zeros(packs)?,
            z2: dense::zeros(packs)?,
        })
    }

    /// What is carried from block to block.
    pub(super) fn carried(&self) -> [&[Eight]; 3] {
        [&self.e, &self.bounds, &self.maxima]
    }

    pub(super) fn clear(&mut self) {
        for part in [&mut self.e, &mut self.bounds, &mut self.maxima] {
            part.fill(Eight::ZERO);
        }
    }

    /// Makes the second half of a first block, `to`, from its first half.
    fn double(
        &mut self,
        number: usize,
        power: &Power,
        from: &[Eight],
        to: &mut [Eight],
    ) -> Result<()> {
        let mut all = std::mem::take(&mut self.e);
        let (from_e, to_e) = all.split_at_mut(from.len());
        let done = self.multiply(number, power, [from, from_e], [to, &mut to_e[..from.len()]]);
        self.e = all;
        done
    }

    /// Makes a block from the one before it and what was carried with that.
    fn advance(
        &mut self,
        block: u64,
        number: usize,
        power: &Power,
        from: &[Eight],
        carried: &[Eight],
        to: &mut [Eight],
    ) -> Result<()> {
        let (from_e, rest) = carried.split_at(self.e.len());
        self.resume(block, rest);
        let mut to_e = std::mem::take(&mut self.e);
        let done = self.multiply(number, power, [from, from_e], [to, &mut to_e]);
        self.e = to_e;
        done
    }

    /// Takes up the bounds that were carried.
    pub(super) fn resume(&mut self, block: u64, carried: &[Eight]) {
        let (bounds, maxima) = carried.split_at(self.layout.stride);
        self.bounds.copy_from_slice(bounds);
        self.maxima.copy_from_slice(maxima);
        if block.is_multiple_of(REVIEW) {
            review(self.layout, &mut self.bounds, &mut self.maxima);
        }
    }

    /// States `z + e` times a power of the propagator.
    pub(super) fn multiply(
        &mut self,
        number: usize,
        power: &Power,
        [z, e]: [&[Eight]; 2],
        [hi, lo]: [&mut [Eight]; 2],
    ) -> Result<()> {
        let (layout, grain) = (self.layout, self.grain);
        bound(layout, z, &mut self.bounds, &mut self.maxima)?;
        let (bounds, cut) = (&self.bounds, &mut self.cuts[number]);
        if cut.bounds != *bounds {
            if cut.t1.is_empty() {
                (cut.t1, cut.t2) = (dense::zeros(power.hi.len())?, dense::zeros(power.hi.len())?);
            }
            let (t1, t2) = (&mut cut.t1, &mut cut.t2);
            dispatch(CutPropagator { layout, grain, bounds, hi: &power.hi, lo: &power.lo, t1, t2 });
            cut.bounds.clone_from(bounds);
        }
        let (z1, z2) = (&mut self.z1[..z.len()], &mut self.z2[..z.len()]);
        for (inverse, bound) in doubles_mut(&mut self.inverses).iter_mut().zip(doubles(bounds)) {
            *inverse = if *bound > 0.0 { 1.0 / bound } else { 0.0 };
        }
        let inverses = &self.inverses;
        dispatch(CutStates { layout, grain, bounds, inverses, z, e, z1: &mut *z1, z2: &mut *z2 });
        dispatch(PairProduct {
            layout,
            columns: z.len() / layout.stride,
            depth: Depth::Two,
            a: [&cut.t1, &cut.t2, &[]],
            b: [z1, z2, &[], &[]],
            b_hi: z,
            add: (power.form == Form::Increment).then_some((1.0, z, e)),
            hi,
            lo,
        });
        Ok(())
    }
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
        return Err(Error::overflow(
            "correction: \"exact\" reaches to states of 1e270; use \"none\" beyond",
        ));
    }
    // Bounds far below the largest would let the shifts of cutting overflow.
    let floor = power_of_two((exponent_above(largest.max(1e-290)) - 400).max(-1000));
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
