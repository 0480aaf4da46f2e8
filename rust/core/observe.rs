//! What looks on while a run goes: the recorder, observers, and one clock-gated poll.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::propagate::Clock;

/// Something that sees where a run begins and every step, and may end it with a sentence.
pub trait Observer {
    /// Sees the state at step `step`, time `t`.
    ///
    /// # Errors
    /// What ends the run; the step has been taken.
    fn observe(&mut self, step: u64, t: f64, z: &[f64]) -> Result<ControlFlow<String>>;
}

/// Stores every `every`-th state from where a run begins, and the last one if asked, in memory the
/// caller owns.
pub struct Recorder<'a> {
    t: &'a mut [f64],
    z: &'a mut [f64],
    every: u64,
    last: Option<u64>,
    /// The step the run begins with, and the one stored last.
    first: u64,
    newest: u64,
    rows: usize,
    outputs: Option<&'a Outputs>,
}

/// What is stored of states: a few sums of components.
pub struct Outputs {
    rows: Vec<Vec<(usize, f64)>>,
}

impl Outputs {
    /// `matrix`: a row for each output, a column for each of `len` components; row by row.
    ///
    /// # Errors
    /// [`Error::Argument`] for a size that does not fit.
    pub fn new(matrix: &[f64], len: usize) -> Result<Outputs> {
        if len == 0 || matrix.is_empty() || !matrix.len().is_multiple_of(len) {
            return Err(Error::argument(format!("outputs: rows must have {len} entries")));
        }
        let entries = |row: &[f64]| -> Vec<(usize, f64)> {
            row.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect()
        };
        Ok(Outputs { rows: matrix.chunks_exact(len).map(entries).collect() })
    }

    /// Numbers of a stored row.
    pub fn width(&self) -> usize {
        self.rows.len()
    }

    /// The outputs of a state.
    pub fn of(&self, z: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.width()];
        self.write(z, &mut out);
        out
    }

    fn write(&self, z: &[f64], out: &mut [f64]) {
        for (out, row) in out.iter_mut().zip(&self.rows) {
            *out = row.iter().map(|(at, x)| x * z[*at]).sum();
        }
    }
}

impl<'a> Recorder<'a> {
    /// Rows that a run of `steps` steps fills.
    ///
    /// # Errors
    /// [`Error::Memory`] where the number does not fit the machine.
    pub fn rows_for(steps: u64, every: u64, with_last: bool) -> Result<usize> {
        let rows = steps / every + 1 + u64::from(with_last && !steps.is_multiple_of(every));
        usize::try_from(rows).map_err(|_| Error::memory(format!("{rows} rows are too many")))
    }

    /// `t`: one double a row, or empty where nobody asks for times; `z`: one state a row; `last`: the
    /// number of a step to store whatever `every` says.
    pub fn new(t: &'a mut [f64], z: &'a mut [f64], every: u64, last: Option<u64>) -> Self {
        Recorder { t, z, every, last, first: 0, newest: 0, rows: 0, outputs: None }
    }

    /// Stores outputs in place of states: `z` has room for one row of them each.
    pub fn with_outputs(self, outputs: Option<&'a Outputs>) -> Self {
        Recorder { outputs, ..self }
    }

    /// Rows filled so far.
    pub fn rows(&self) -> usize {
        self.rows
    }

    pub(crate) fn keeps_all(&self) -> bool {
        self.every == 1 && self.outputs.is_none()
    }

    /// The memory of the next rows, `most` at most.
    pub(crate) fn next_rows(&mut self, most: usize, len: usize) -> &mut [f64] {
        &mut self.z[self.rows * len..][..most * len]
    }

    /// Notes that `done` rows were written in place, for the steps after `step`.
    pub(crate) fn filled(&mut self, step: u64, done: usize, clock: &Clock) {
        for (i, t) in self.t.iter_mut().skip(self.rows).take(done).enumerate() {
            *t = clock.t(step + 1 + i as u64);
        }
        self.rows += done;
        self.newest = step + done as u64;
    }

    /// Stores where a run begins.
    pub(crate) fn start(&mut self, step: u64, t: f64, z: &[f64]) {
        self.first = step;
        self.store(step, t, z);
    }

    /// Stores a state if it is one to store.
    pub(crate) fn record(&mut self, step: u64, t: f64, z: &[f64]) {
        if (step - self.first).is_multiple_of(self.every) || self.last == Some(step) {
            self.store(step, t, z);
        }
    }

    /// Stores where a run has been stopped.
    pub(crate) fn end(&mut self, step: u64, t: f64, z: &[f64]) {
        if self.newest != step {
            self.store(step, t, z);
        }
    }

    fn store(&mut self, step: u64, t: f64, z: &[f64]) {
        if let Some(row) = self.t.get_mut(self.rows) {
            *row = t;
        }
        match self.outputs {
            None => self.z[self.rows * z.len()..][..z.len()].copy_from_slice(z),
            Some(outputs) => {
                let width = outputs.width();
                outputs.write(z, &mut self.z[self.rows * width..][..width]);
            }
        }
        self.rows += 1;
        self.newest = step;
    }
}

/// A look at the outside world about every 20 ms: interrupts and progress.
pub struct Poll<'a> {
    check: &'a mut dyn FnMut(u64, f64) -> Result<()>,
    stride: u64,
    since: u64,
    last: Instant,
}

/// Looks are at least this far apart.
const APART: Duration = Duration::from_millis(20);

impl<'a> Poll<'a> {
    /// `check` gets the step reached and its time; an error ends the run.
    pub fn new(check: &'a mut dyn FnMut(u64, f64) -> Result<()>) -> Self {
        Poll { check, stride: 1, since: 0, last: Instant::now() }
    }

    /// Steps that may pass before the next look at the clock.
    pub(crate) fn stride(&self) -> u64 {
        self.stride
    }

    pub(crate) fn after(&mut self, steps: u64, step: u64, clock: &Clock) -> Result<()> {
        self.since += steps;
        if self.since < self.stride {
            return Ok(());
        }
        let elapsed = self.last.elapsed();
        if elapsed < APART / 4 && self.stride < 1 << 24 {
            self.stride *= 2;
        }
        self.since = 0;
        if elapsed < APART {
            return Ok(());
        }
        if elapsed > 2 * APART && self.stride > 1 {
            self.stride /= 2;
        }
        self.last = Instant::now();
        (self.check)(step, clock.t(step))
    }
}
