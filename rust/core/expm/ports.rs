//! Stepping for a few outputs under a few inputs: `y = O z` alone is shown, and between two blocks no
//! state is made.
//!
//! With `O W^i` at hand, the outputs of `B` steps and the state after them are one product of a
//! matrix and the state at their start, and inputs held in records act through `O W^i E`: a matrix of
//! `m + r B` rows is read once in `B` steps where plain stepping reads one of `m` rows every step.

use std::sync::Arc;

use super::blocks::{Walk, plain};
use super::doubling::Form;
use super::propagator::{Correction, Power, Propagator, state_overflow};
use crate::error::{Error, Result};
use crate::linalg::dense::{self, Watch};
use crate::linalg::kernel::{Eight, Layout, Product, dispatch, doubles, doubles_mut};
use crate::system::{Load, Record};

/// Steps in a block at most.
const LONGEST: usize = 64;

/// A run of which outputs are read.
pub struct Ports {
    propagator: Arc<Propagator>,
    /// Components that the load acts on, and that belong to the system.
    shown: usize,
    load: Option<Arc<dyn Load>>,
    /// Size of the state, outputs, steps in a block.
    sizes: [usize; 3],
    /// What the state at a block's start makes of the one at its end, and of the outputs.
    free: Vec<Eight>,
    /// Whether the state is to be added to what `free` makes of it.
    increment: bool,
    /// The same for samples: those at the starts of the block's steps and those at their ends, for
    /// each record one after the other.
    forced: Vec<Eight>,
    inputs: Vec<f64>,
    packed: Vec<Eight>,
    state: Vec<Eight>,
    next: [Vec<Eight>; 2],
}

impl Ports {
    /// Whether this pays: few outputs, and a load of few inputs that all come from records.
    pub fn pays(rows: usize, outputs: usize, load: Option<&Arc<dyn Load>>) -> bool {
        let inputs = match load.map(|load| (load.is_sampled(), load.records())) {
            None | Some((false, _)) => 0,
            Some((true, None)) => return false,
            Some((true, Some(records))) => records.iter().map(Record::width).sum(),
        };
        rows >= 16 && 8 * outputs <= rows && 16 * inputs <= rows
    }

    /// `outputs`: rows of as many entries as the load acts on components, the first of the state.
    ///
    /// # Errors
    /// [`Error::Argument`] for the exact correction, which this does not have; [`Error::Memory`]; what
    /// `watch` reports.
    pub fn new(
        propagator: Arc<Propagator>,
        outputs: &[f64],
        shown: usize,
        load: Option<Arc<dyn Load>>,
        watch: &mut Watch,
    ) -> Result<Ports> {
        if propagator.correction == Correction::Exact {
            return Err(Error::argument("outputs: the exact correction steps whole states"));
        }
        let layout = propagator.layout();
        let (m, r) = (layout.rows, outputs.len() / shown);
        let one = &propagator.powers(watch)?[0];
        // The longest block that the outputs leave worthwhile, and growth allows.
        let mut width = 1;
        let mut last = Power { form: one.form, hi: one.hi.clone(), lo: Vec::new() };
        last.lo = dense::zeros(last.hi.len())?;
        while 2 * width <= LONGEST && 2 * width * r <= 4 * m {
            match propagator.doubled(&last, watch) {
                Ok(power) => last = power,
                Err(error) if matches!(*error, Error::Overflow(_)) => break,
                Err(error) => return Err(error),
            }
            width *= 2;
        }
        let sizes = [m, r, width];
        let stride = stride(sizes);
        let mut free = dense::zeros(stride * m)?;
        // Rows of O W^i are columns of the transposed powers times O^T.
        let mut transposed = Power { form: one.form, hi: one.hi.clone(), lo: Vec::new() };
        dense::transpose(layout, &mut transposed.hi);
        let mut rows = dense::zeros(layout.packs(r))?;
        for (j, row) in outputs.chunks_exact(shown).enumerate() {
            doubles_mut(&mut rows[layout.packs(j)..])[..shown].copy_from_slice(row);
        }
        let mut after = rows.clone();
        let target = doubles_mut(&mut free);
        for column in 0..m {
            let from = &doubles(&last.hi)[column * layout.doubles()..][..m];
            target[column * 8 * stride..][..m].copy_from_slice(from);
        }
        for step in 0..width {
            for j in 0..r {
                let row = &doubles(&rows)[j * layout.doubles()..][..m];
                for (column, x) in row.iter().enumerate() {
                    target[column * 8 * stride + output(sizes, step, j)] = *x;
                }
            }
            plain(layout, &transposed, &rows, &mut after);
            std::mem::swap(&mut rows, &mut after);
            watch()?;
        }
        let mut ports = Ports {
            propagator: propagator.clone(),
            shown,
            load,
            sizes,
            free,
            increment: last.form == Form::Increment,
            forced: Vec::new(),
            inputs: Vec::new(),
            packed: Vec::new(),
            state: dense::zeros(stride)?,
            next: [dense::zeros(stride)?, dense::zeros(stride)?],
        };
        let one = propagator.power(0);
        ports.force(layout, one, watch)?;
        Ok(ports)
    }

    /// Works out what samples do.
    fn force(&mut self, layout: Layout, one: &Power, watch: &mut Watch) -> Result<()> {
        let [m, r, width] = self.sizes;
        let stride = stride(self.sizes);
        let load = self.load.clone();
        let records = load.as_deref().and_then(Load::records).unwrap_or_default();
        let kinds = records.iter().flat_map(|record| [(record, 0), (record, 1)]);
        let columns: usize = kinds.clone().map(|(record, _)| record.width() * width).sum();
        self.forced = dense::zeros(stride * columns)?;
        self.inputs = vec![0.0; columns];
        self.packed = dense::zeros(stride.max(columns.div_ceil(8)))?;
        let mut first = 0;
        for (record, late) in kinds {
            let w = record.width();
            let mut states = dense::zeros(layout.packs(w))?;
            for column in 0..w {
                if let Some(impulse) = record.impulse(late, column) {
                    let to = &mut doubles_mut(&mut states[layout.packs(column)..])[..impulse.len()];
                    to.copy_from_slice(impulse);
                }
            }
            let mut after = states.clone();
            // The sample of a step, `age` steps later.
            for age in 0..width {
                for column in 0..w {
                    let state = &doubles(&states)[column * layout.doubles()..][..m];
                    // At the end of the block it is that of one step alone.
                    let step = width - 1 - age;
                    let at = (first + step * w + column) * 8 * stride;
                    doubles_mut(&mut self.forced)[at..at + m].copy_from_slice(state);
                    for j in 0..r {
                        let shown: f64 = (0..m)
                            .map(|i| {
                                let row = i * 8 * stride + output(self.sizes, 0, j);
                                doubles(&self.free)[row] * state[i]
                            })
                            .sum();
                        for step in 0..width - 1 - age {
                            let at = (first + step * w + column) * 8 * stride;
                            let row = output(self.sizes, step + 1 + age, j);
                            doubles_mut(&mut self.forced)[at + row] = shown;
                        }
                    }
                }
                plain(layout, one, &states, &mut after);
                std::mem::swap(&mut states, &mut after);
                watch()?;
            }
            first += w * width;
        }
        Ok(())
    }

    /// Makes a block from the state at its start.
    fn make(&mut self, block: u64) -> Result<()> {
        let [m, r, width] = self.sizes;
        let stride = stride(self.sizes);
        if !dense::is_finite(&doubles(&self.state)[..m]) {
            return Err(state_overflow());
        }
        // The rows of a column beyond its outputs are zero; so is what they are added to.
        let height = m.div_ceil(8) + (r * width).div_ceil(8);
        let layout = Layout { rows: m, height, stride };
        let [first, second] = &mut self.next;
        let add = self.increment.then_some((1.0, &*self.state));
        let (a, b) = (&self.free[..], &self.state[..]);
        dispatch(Product { layout, columns: 1, a, b, add, c: &mut first[..] });
        let records = self.load.as_deref().and_then(Load::records).unwrap_or_default();
        if records.is_empty() {
            return Ok(());
        }
        let mut at = 0;
        for (record, late) in records.iter().flat_map(|record| [(record, 0), (record, 1)]) {
            let count = record.width() * width;
            if record.impulse(late, 0).is_some() {
                record.inputs(block * width as u64, late, &mut self.inputs[at..at + count]);
            }
            at += count;
        }
        doubles_mut(&mut self.packed)[..at].copy_from_slice(&self.inputs);
        let layout = Layout { rows: at, height, stride };
        let (a, b, add) = (&self.forced[..], &self.packed[..], Some((1.0, &first[..])));
        dispatch(Product { layout, columns: 1, a, b, add, c: &mut second[..] });
        std::mem::swap(first, second);
        Ok(())
    }

    fn store(&self, carried: &mut [Eight]) {
        let (block, start) = carried.split_at_mut(self.next[0].len());
        block.copy_from_slice(&self.next[0]);
        start.copy_from_slice(&self.state);
    }
}

/// Packs of a column: the state, then the outputs of each step.
fn stride([m, r, width]: [usize; 3]) -> usize {
    (m.div_ceil(8) + (r * width).div_ceil(8)) | 1
}

/// The row of an output of a step of the block.
fn output([m, r, _]: [usize; 3], step: usize, number: usize) -> usize {
    m.next_multiple_of(8) + step * r + number
}

impl Walk for Ports {
    fn width(&self) -> usize {
        self.sizes[2]
    }

    fn carried_len(&self) -> usize {
        // The block, and the state at its start.
        2 * stride(self.sizes)
    }

    fn start(&mut self, z: &[f64], carried: &mut [Eight]) -> Result<()> {
        self.state.fill(Eight::ZERO);
        doubles_mut(&mut self.state)[..z.len()].copy_from_slice(z);
        self.make(0)?;
        self.store(carried);
        Ok(())
    }

    fn advance(&mut self, block: u64, carried: &mut [Eight]) -> Result<()> {
        let packs = self.sizes[0].div_ceil(8);
        self.state[..packs].copy_from_slice(&carried[..packs]);
        self.make(block)?;
        self.store(carried);
        Ok(())
    }

    fn whole(&self, k: u64, carried: &[Eight]) -> Result<Vec<f64>> {
        let layout = self.propagator.layout();
        let mut state = carried[self.next[0].len()..][..layout.stride].to_vec();
        let mut next = state.clone();
        let mut impulse = vec![0.0; self.shown];
        for step in k - k % self.sizes[2] as u64..k {
            plain(layout, self.propagator.power(0), &state, &mut next);
            std::mem::swap(&mut state, &mut next);
            if let Some(load) = self.load.as_ref().filter(|load| load.is_sampled()) {
                load.impulses(step, &mut impulse)?;
                doubles_mut(&mut state).iter_mut().zip(&impulse).for_each(|(z, v)| *z += v);
            }
        }
        Ok(doubles(&state)[..self.shown].to_vec())
    }

    fn read_one(&self, carried: &[Eight], at: usize, row: &mut [f64]) -> Result<()> {
        let outputs = &doubles(carried)[output(self.sizes, at, 0)..][..self.sizes[1]];
        if !dense::is_finite(outputs) {
            return Err(state_overflow());
        }
        row.copy_from_slice(outputs);
        Ok(())
    }
}
