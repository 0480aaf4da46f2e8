//! Stepping under a load: `z_k+1 = W z_k + v_k`, in blocks at the speed of matrix products.
//!
//! A block of steps is cut into chunks, which stand side by side as columns. All chunks are walked
//! at once from zero; what they end with, and powers of `W`, give the state each begins with, one
//! chunk after the other; a second walk at once from these gives all states. Twice the work of
//! stepping, at many times the speed.
//!
//! With [`Correction::Exact`] a state is a pair and the walk goes step by step.

use std::sync::Arc;

use super::blocks::{Exact, Walk, carried_len, copy_out, store, visible};
use super::doubling::Form;
use super::propagator::{Correction, Power, Propagator, state_overflow};
use crate::error::Result;
use crate::linalg::dense::{self, Watch};
use crate::linalg::kernel::{
    Eight, Layout, PackColumns, Product, Sums, UnpackColumns, dispatch, doubles, doubles_mut,
};
use crate::linalg::twofold;
use crate::system::Load;

/// Chunks in a block.
const CHUNKS: usize = 16;

/// Binary logarithm of the steps in a chunk, at most.
const LONGEST: usize = 4;

/// A run under a load.
pub struct Driven {
    propagator: Arc<Propagator>,
    load: Arc<dyn Load>,
    /// Where the components that the load acts on, and that are shown, lie.
    shown: Layout,
    chunks: usize,
    /// The number of the power of the propagator that walks a chunk.
    number: usize,
    /// Impulses of a block, one row a step.
    rows: Vec<f64>,
    /// The same as columns: the first step of every chunk, then the second, and so on.
    impulses: Vec<Eight>,
    /// The states of the block being made, laid out likewise, and the first one of the next.
    next: Vec<Eight>,
    ends: Vec<Eight>,
    spare: Vec<Eight>,
    exact: Option<Exact>,
}

impl Driven {
    /// Prepares the powers of the propagator and the work space; the load acts on the first `shown`
    /// components of states, which are read.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory); what `watch` reports.
    pub fn new(
        propagator: Arc<Propagator>,
        load: Arc<dyn Load>,
        shown: usize,
        watch: &mut Watch,
    ) -> Result<Driven> {
        let layout = propagator.layout();
        let number = LONGEST.min(propagator.powers(watch)?.len() - 1);
        let pairs = propagator.correction == Correction::Exact;
        let exact = pairs.then(|| Exact::new(layout, 1, layout.stride)).transpose()?;
        let steps = CHUNKS << number;
        let chunks = if pairs { 1 } else { CHUNKS };
        // Chunks are read as if each had as many columns as all of them.
        let packs = layout.packs(steps + chunks);
        Ok(Driven {
            load,
            shown: visible(layout, shown),
            chunks,
            number,
            rows: vec![0.0; steps * shown],
            impulses: dense::zeros(packs)?,
            next: dense::zeros(packs)?,
            ends: dense::zeros(layout.packs(chunks))?,
            spare: dense::zeros(layout.packs(chunks))?,
            exact,
            propagator,
        })
    }

    fn layout(&self) -> Layout {
        self.propagator.layout()
    }

    /// Steps in a chunk.
    fn length(&self) -> usize {
        self.width() / self.chunks
    }

    /// The layout of the states of one chunk.
    fn chunk_layout(&self) -> Layout {
        Layout { stride: self.chunks * self.shown.stride, ..self.shown }
    }

    /// Where the state of a step lies.
    fn column(&self, step: usize) -> usize {
        (step % self.length()) * self.chunks + step / self.length()
    }

    /// Makes block `block` from its first state, which lies in its place.
    fn make(&mut self, block: u64) -> Result<()> {
        self.load.impulses(block * self.width() as u64, &mut self.rows)?;
        let (layout, length, m) = (self.chunk_layout(), self.length(), self.shown.rows);
        for (chunk, plain) in self.rows.chunks_exact(length * m).enumerate() {
            let packed = &mut self.impulses[chunk * self.shown.stride..];
            dispatch(PackColumns { layout, plain, packed });
        }
        match &mut self.exact {
            None => self.at_once(),
            Some(_) => self.one_by_one()?,
        }
        if dense::is_finite(doubles(&self.next[..self.layout().stride])) {
            Ok(())
        } else {
            Err(state_overflow())
        }
    }

    fn at_once(&mut self) {
        let (layout, length, width) = (self.layout(), self.length(), self.width());
        let column = layout.packs(1);
        let all = layout.packs(self.chunks);
        let (one, many) = (self.propagator.power(0), self.propagator.power(self.number));
        // All chunks from zero.
        self.ends.copy_from_slice(&self.impulses[..all]);
        for i in 1..length {
            let impulses = &self.impulses[i * all..][..all];
            // The states behind the first are not in use yet.
            let to = &mut self.next[all..2 * all];
            step(layout, one, &self.ends, impulses, &mut self.spare, to);
            self.ends.copy_from_slice(to);
        }
        // The first state of each chunk; the last lies where the next block begins.
        for chunk in 0..self.chunks {
            let to = if chunk + 1 < self.chunks { chunk + 1 } else { width };
            let (from, rest) = self.next[chunk * column..].split_at_mut(column);
            let to = &mut rest[(to - chunk - 1) * column..][..column];
            let end = &self.ends[chunk * column..][..column];
            step(layout, many, from, end, &mut self.spare[..column], to);
        }
        // All chunks from there.
        for i in 0..length - 1 {
            let impulses = &self.impulses[i * all..][..all];
            let (from, to) = self.next[i * all..].split_at_mut(all);
            step(layout, one, from, impulses, &mut self.spare, &mut to[..all]);
        }
    }

    fn one_by_one(&mut self) -> Result<()> {
        let column = self.layout().packs(1);
        let power = self.propagator.power(0);
        let exact = self.exact.as_mut().expect("only with pairs");
        let mut e = std::mem::take(&mut exact.e);
        let mut done = Ok(());
        for step in 0..self.rows.len() / self.shown.rows {
            let (from, to) = self.next[step * column..].split_at_mut(column);
            let to = &mut to[..column];
            done = exact.multiply(0, power, [from, &e], [&mut *to, &mut self.spare]);
            if done.is_err() {
                break;
            }
            let impulse = doubles(&self.impulses[step * column..][..column]);
            let lost = doubles_mut(&mut self.spare).iter_mut();
            for ((z, lost), v) in doubles_mut(to).iter_mut().zip(lost).zip(impulse) {
                [*z, *lost] = twofold::sum([*z, *lost], [*v, 0.0]);
            }
            e.copy_from_slice(&self.spare);
        }
        exact.e = e;
        done
    }
}

impl Walk for Driven {
    fn width(&self) -> usize {
        CHUNKS << self.number
    }

    fn carried_len(&self) -> usize {
        carried_len(&self.next, self.exact.as_ref())
    }

    fn start(&mut self, z: &[f64], carried: &mut [Eight]) -> Result<()> {
        let (layout, column) = (self.layout(), self.layout().packs(1));
        dense::pack(layout, z, &mut self.next[..column]);
        if let Some(exact) = &mut self.exact {
            exact.clear();
        }
        self.make(0)?;
        store(&self.next, self.exact.as_ref(), carried);
        Ok(())
    }

    fn advance(&mut self, block: u64, carried: &mut [Eight]) -> Result<()> {
        let column = self.layout().packs(1);
        let first = self.width() * column;
        self.next[..column].copy_from_slice(&carried[first..][..column]);
        if !dense::is_finite(doubles(&self.next[..column])) {
            return Err(state_overflow());
        }
        if let Some(exact) = &mut self.exact {
            let (e, bounds) = carried[self.next.len()..].split_at(column);
            exact.e.copy_from_slice(e);
            exact.resume(block, bounds);
        }
        self.make(block)?;
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
        let (length, m) = (self.length(), self.shown.rows);
        let mut step = from;
        let mut rows = rows;
        while step < to {
            let upto = to.min((step / length + 1) * length);
            let (here, rest) = rows.split_at_mut((upto - step) * m);
            let packed = &carried[self.column(step) * self.shown.stride..];
            let layout = self.chunk_layout();
            if dispatch(UnpackColumns { layout, packed, plain: &mut *here }) {
                *done += upto - step;
            } else {
                self.read_each(carried, step, upto, here, done)?;
            }
            rows = rest;
            step = upto;
        }
        Ok(())
    }

    fn read_one(&self, carried: &[Eight], at: usize, row: &mut [f64]) -> Result<()> {
        let stride = self.shown.stride;
        copy_out(self.shown, &carried[self.column(at) * stride..][..stride], row)
    }
}

/// `to = W from + impulses`.
fn step(
    layout: Layout,
    power: &Power,
    from: &[Eight],
    impulses: &[Eight],
    spare: &mut [Eight],
    to: &mut [Eight],
) {
    let columns = to.len() / layout.stride;
    let (a, b) = (&power.hi[..], from);
    let add = match power.form {
        Form::Whole => impulses,
        Form::Increment => {
            dispatch(Sums { x: [from, impulses], c: [[1.0, 1.0]], outs: [&mut *spare] });
            &*spare
        }
    };
    dispatch(Product { layout, columns, a, b, add: Some((1.0, add)), c: to });
}
