//! What acts on a linear system from outside.

use crate::error::Result;
use crate::linalg::dense;
use crate::linalg::kernel::{Layout, Product, dispatch};

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
    /// Numbers of a sample.
    pub width: usize,
    /// Samples, one row each.
    pub values: Vec<f64>,
    /// The step at whose start the first sample is taken.
    pub begin: i64,
    /// Impulse of a unit sample at the start of a step, and (or empty, if samples are held) at its
    /// end: a row for each component of the state, a column for each number of a sample.
    pub weights: [Vec<f64>; 2],
}

impl Record {
    /// Adds the impulses of steps `k`, `k + 1`, … to rows of `len` numbers.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory).
    pub fn add(&self, k: u64, len: usize, rows: &mut [f64]) -> Result<()> {
        let samples = (self.values.len() / self.width) as i64;
        let [early, late] = &self.weights;
        let last = self.begin + samples - i64::from(!late.is_empty());
        let end = k as i64 + (rows.len() / len) as i64;
        let (from, to) = (self.begin.max(k as i64), last.min(end));
        if from >= to {
            return Ok(());
        }
        let steps = (to - from) as usize;
        let rows = &mut rows[(from - k as i64) as usize * len..][..steps * len];
        let height = len.div_ceil(8);
        let stride = height.max(self.width.div_ceil(8));
        let states = Layout { rows: len, height, stride };
        let sample = Layout { rows: self.width, height: self.width.div_ceil(8), stride };
        // A product with as many terms as a sample has numbers.
        let layout = Layout { rows: self.width, height, stride };
        let packed = |layout: Layout, columns: usize, plain: &[f64]| -> Result<_> {
            let mut packed = dense::zeros(stride * columns)?;
            dense::pack(layout, plain, &mut packed);
            Ok(packed)
        };
        let first = (from - self.begin) as usize * self.width;
        let columns = steps + usize::from(!late.is_empty());
        let b = packed(sample, columns, &self.values[first..][..columns * self.width])?;
        let mut sum = packed(states, steps, rows)?;
        let mut c = dense::zeros(stride * steps)?;
        for (shift, weights) in [early, late].into_iter().enumerate() {
            if weights.is_empty() {
                continue;
            }
            // Row by row is the transposed matrix column by column.
            let columns: Vec<f64> = (0..self.width)
                .flat_map(|j| (0..len).map(move |i| weights[i * self.width + j]))
                .collect();
            let a = packed(states, self.width, &columns)?;
            let b = &b[shift * stride..][..steps * stride];
            dispatch(Product {
                layout,
                columns: steps,
                a: &a,
                b,
                add: Some((1.0, &sum)),
                c: &mut c,
            });
            std::mem::swap(&mut sum, &mut c);
        }
        dense::unpack(states, &sum, rows);
        Ok(())
    }
}
