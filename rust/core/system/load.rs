//! What acts on a linear system from outside.

use crate::error::{Error, Result};
use crate::linalg::dense;
use crate::linalg::kernel::{Eight, Layout, Product, dispatch, doubles, doubles_mut};

/// A load on `z' = A z + f(t)`.
pub trait Load: Send + Sync {
    /// `f(t)`, one double a component of the state.
    ///
    /// # Errors
    /// What the load reports.
    fn value(&self, t: f64, f: &mut [f64]) -> Result<()>;

    /// `f` at the grid points `k`, `k + 1`, … of the run, one row each; what lies beyond its end is of
    /// no matter.
    ///
    /// # Errors
    /// What the load reports.
    fn grid_values(&self, k: u64, rows: &mut [f64]) -> Result<()>;

    /// Whether there is more to it than a [`Generator`] makes.
    fn is_sampled(&self) -> bool;

    /// What the load adds to the state in each of the steps `k`, `k + 1`, …, one row a step: the
    /// integral of `exp((h - s) A) f(t + s)` over `0 < s < h`, but for what a [`Generator`] makes.
    ///
    /// # Errors
    /// What the load reports.
    fn impulses(&self, k: u64, rows: &mut [f64]) -> Result<()>;

    /// The records whose impulses are all that there are; `None` where there are others.
    fn records(&self) -> Option<&[Record]> {
        None
    }
}

/// A load in closed form: `f(t) = B g(t)`, `g' = Gamma g`. It is stepped along with the state, by
/// the exponential of both together, and so is as exact as the state.
#[derive(Clone, Debug, Default)]
pub struct Generator {
    /// `B`: a row for each component of the state, a column for each of `g`; row by row.
    pub inputs: Vec<f64>,
    /// `Gamma`, square, row by row.
    pub matrix: Vec<f64>,
    /// `g` at the start of the run.
    pub start: Vec<f64>,
}

/// A record whose samples lie on the grid of the run: held, or linear from sample to sample.
pub struct Record {
    samples: Vec<f64>,
    /// Numbers of a sample.
    width: usize,
    /// The step at whose start the first sample is taken.
    begin: i64,
    /// Where columns of samples and of states lie, and those of the weights: a product has as many
    /// terms as a sample has numbers.
    sample: Layout,
    state: Layout,
    product: Layout,
    /// Impulses of unit samples at the start of a step and, unless samples are held, at its end.
    weights: [Vec<Eight>; 2],
}

/// Steps whose impulses are formed at once.
const PIECE: usize = 32;

impl Record {
    /// `samples`: rows of `width` numbers, the first for the start of step `begin`; `weights`: the
    /// impulses (a row for each of `len` components of the state, a column for each number of a
    /// sample) of a unit sample at the start of a step, and at its end (empty: samples are held).
    ///
    /// # Errors
    /// [`Error::Argument`] for sizes that do not fit; [`Error::Memory`].
    pub fn new(
        samples: Vec<f64>,
        width: usize,
        begin: i64,
        weights: [Vec<f64>; 2],
        len: usize,
    ) -> Result<Record> {
        let fits = |weights: &Vec<f64>| weights.len() == len * width;
        let [early, late] = &weights;
        if !fits(early) || !(late.is_empty() || fits(late)) || width == 0 {
            return Err(Error::argument("record: weights do not fit samples and states"));
        }
        let (across, height) = (width.div_ceil(8), len.div_ceil(8));
        let stride = height.max(across);
        let state = Layout { rows: len, height, stride };
        let packed = |weights: &[f64]| -> Result<Vec<Eight>> {
            let mut packed = dense::zeros(if weights.is_empty() { 0 } else { stride * width })?;
            // Row by row is the transposed matrix column by column.
            for (j, column) in packed.chunks_exact_mut(stride).enumerate() {
                for (i, entry) in doubles_mut(column)[..len].iter_mut().enumerate() {
                    *entry = weights[i * width + j];
                }
            }
            Ok(packed)
        };
        let weights = [packed(early)?, packed(late)?];
        let sample = Layout { rows: width, height: across, stride };
        let product = Layout { rows: width, height, stride };
        Ok(Record { samples, width, begin, sample, state, product, weights })
    }

    /// Numbers of a sample.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The samples at the start (`late` 0) or the end (1) of the steps `k`, `k + 1`, …, one row a
    /// step; zero for steps that the record does not span.
    pub fn inputs(&self, k: u64, late: usize, rows: &mut [f64]) {
        rows.fill(0.0);
        let samples = (self.samples.len() / self.width) as i64;
        let ends = i64::from(!self.weights[1].is_empty());
        let k = k as i64 - self.begin;
        for (step, row) in (k..).zip(rows.chunks_exact_mut(self.width)) {
            if step >= 0 && step < samples - ends {
                row.copy_from_slice(
                    &self.samples[(step as usize + late) * self.width..][..self.width],
                );
            }
        }
    }

    /// The impulse of a unit sample, number `column`, at the start (`late` 0) or the end of a step;
    /// `None` where samples are held.
    pub fn impulse(&self, late: usize, column: usize) -> Option<&[f64]> {
        let weights = doubles(&self.weights[late]);
        let stride = 8 * self.state.stride;
        (!weights.is_empty()).then(|| &weights[column * stride..][..self.state.rows])
    }

    /// Adds the impulses of steps `k`, `k + 1`, … to rows of one state each.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn add(&self, k: u64, rows: &mut [f64]) -> Result<()> {
        let ends = usize::from(!self.weights[1].is_empty());
        let samples = (self.samples.len() / self.width) as i64;
        let len = self.state.rows;
        let k = k as i64;
        let end = k + (rows.len() / len) as i64;
        let (from, to) = (self.begin.max(k), end.min(self.begin + samples - ends as i64));
        let mut step = from;
        while step < to {
            let steps = PIECE.min((to - step) as usize);
            let first = (step - self.begin) as usize * self.width;
            let samples = &self.samples[first..][..(steps + ends) * self.width];
            self.add_piece(samples, &mut rows[(step - k) as usize * len..][..steps * len])?;
            step += steps as i64;
        }
        Ok(())
    }

    fn add_piece(&self, samples: &[f64], rows: &mut [f64]) -> Result<()> {
        let stride = self.state.stride;
        let steps = rows.len() / self.state.rows;
        let columns = samples.len() / self.width;
        let packs = stride * (columns + 2 * steps);
        dense::with_scratch(packs, &mut || Ok(()), |memory, _| {
            let (given, states) = memory.split_at_mut(stride * columns);
            let (mut sum, mut next) = states.split_at_mut(stride * steps);
            dense::pack(self.sample, samples, given);
            dense::pack(self.state, rows, sum);
            for (shift, a) in self.weights.iter().enumerate().filter(|(_, a)| !a.is_empty()) {
                let b = &given[shift * stride..][..steps * stride];
                let (layout, add) = (self.product, Some((1.0, &*sum)));
                dispatch(Product { layout, columns: steps, a, b, add, c: &mut *next });
                std::mem::swap(&mut sum, &mut next);
            }
            dense::unpack(self.state, sum, rows);
            Ok(())
        })
    }
}
