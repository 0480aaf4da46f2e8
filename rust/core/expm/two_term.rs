//! Two-term stepping of separable systems: `q_k+B + q_k-B = 2 cos(B tau w) q_k`, and the same for the
//! momenta, so that a step takes two products of half the size where `W` takes four.
//!
//! Kept as `q <- q + d`, `d <- d + 2 c q`, with the increment `c` of the cosine, so that slow motion
//! keeps its digits. The first two blocks are made by the propagator.

use std::sync::Arc;

use super::blocks::{Blocks, Walk};
use super::doubling::Form;
use super::propagator::{Correction, Propagator, state_overflow};
use crate::error::{Error, Result};
use crate::linalg::dense::{self, Watch};
use crate::linalg::kernel::{Eight, Layout, Product, Sums, dispatch, doubles, doubles_mut};

/// A free run of a separable system.
pub struct TwoTerm {
    blocks: Blocks,
    half: Layout,
    width: usize,
    /// `c` for coordinates and for momenta.
    cosines: [Vec<Eight>; 2],
    /// Two blocks of whole states, and what carries the first of them on.
    rows: [Vec<f64>; 2],
    first: Vec<Eight>,
    next: [Vec<Eight>; 2],
}

impl TwoTerm {
    /// For a propagator of a separable system.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for other propagators; [`Error::Memory`]; what `watch` reports.
    pub fn new(propagator: Arc<Propagator>, watch: &mut Watch) -> Result<TwoTerm> {
        let layout = propagator.layout();
        let n = layout.rows / 2;
        let last = propagator.powers(watch)?.len() - 1;
        let power = propagator.power(last);
        let plain = propagator.by_halves() && propagator.correction != Correction::Exact;
        if !plain || power.form != Form::Increment {
            return Err(Error::unsupported(
                "two_term: needs a separable system, as undamped structures are",
            ));
        }
        let half = Layout::new(n);
        let block = |from: usize| -> Result<Vec<Eight>> {
            let mut c = dense::zeros(half.packs(n))?;
            for j in 0..n {
                let column = &doubles(&power.hi)[(from + j) * layout.doubles() + from..][..n];
                doubles_mut(&mut c)[j * half.doubles()..][..n].copy_from_slice(column);
            }
            Ok(c)
        };
        let cosines = [block(0)?, block(n)?];
        let blocks = Blocks::new(propagator, 2 * n, 1, watch)?;
        let width = blocks.width();
        let packs = half.packs(width);
        Ok(TwoTerm {
            half,
            width,
            cosines,
            rows: [vec![0.0; 2 * n * width], vec![0.0; 2 * n * width]],
            first: dense::zeros(blocks.carried_len())?,
            next: [dense::zeros(packs)?, dense::zeros(packs)?],
            blocks,
        })
    }

    /// Packs of the block of one half.
    fn packs(&self) -> usize {
        self.half.packs(self.width)
    }
}

impl Walk for TwoTerm {
    fn width(&self) -> usize {
        self.width
    }

    fn carried_len(&self) -> usize {
        // Coordinates, momenta, and the difference of each to the next block.
        4 * self.packs()
    }

    fn start(&mut self, z: &[f64], carried: &mut [Eight]) -> Result<()> {
        let (n, width, packs) = (self.half.rows, self.width, self.packs());
        self.blocks.start(z, &mut self.first)?;
        self.blocks.read(&self.first, 0, width, &mut self.rows[0], &mut 0)?;
        self.blocks.advance(1, &mut self.first)?;
        self.blocks.read(&self.first, 0, width, &mut self.rows[1], &mut 0)?;
        carried.fill(Eight::ZERO);
        let [now, then] = &self.rows;
        for (part, carried) in carried.chunks_exact_mut(2 * packs).enumerate() {
            let (block, difference) = carried.split_at_mut(packs);
            let (block, difference) = (doubles_mut(block), doubles_mut(difference));
            for step in 0..width {
                for i in 0..n {
                    let (from, to) = (step * 2 * n + part * n + i, step * self.half.doubles() + i);
                    block[to] = now[from];
                    difference[to] = then[from] - now[from];
                }
            }
        }
        Ok(())
    }

    fn advance(&mut self, _: u64, carried: &mut [Eight]) -> Result<()> {
        let (layout, columns, packs) = (self.half, self.width, self.packs());
        // Both halves are looked at before either is changed.
        for carried in carried.chunks_exact(2 * packs) {
            let (block, difference) = carried.split_at(packs);
            let x = [block, difference];
            dispatch(Sums { x, c: [[1.0, 1.0]], outs: [&mut self.next[0][..]] });
            if !dense::is_finite(doubles(&self.next[0][..layout.stride])) {
                return Err(state_overflow());
            }
        }
        for (c, carried) in self.cosines.iter().zip(carried.chunks_exact_mut(2 * packs)) {
            let (block, difference) = carried.split_at_mut(packs);
            let [next, twice] = &mut self.next;
            let x = [&*block, &*difference];
            dispatch(Sums { x, c: [[1.0, 1.0]], outs: [&mut next[..]] });
            dispatch(Product { layout, columns, a: c, b: next, add: None, c: &mut twice[..] });
            block.copy_from_slice(next);
            next.copy_from_slice(difference);
            dispatch(Sums { x: [&*next, &*twice], c: [[1.0, 2.0]], outs: [difference] });
        }
        Ok(())
    }

    fn read_one(&self, carried: &[Eight], at: usize, row: &mut [f64]) -> Result<()> {
        let (n, at) = (self.half.rows, at * self.half.doubles());
        let parts = || carried.chunks_exact(2 * self.packs());
        let mut finite = true;
        parts().for_each(|part| finite &= dense::is_finite(&doubles(part)[at..at + n]));
        if !finite {
            return Err(state_overflow());
        }
        for (part, row) in parts().zip(row.chunks_exact_mut(n)) {
            row.copy_from_slice(&doubles(part)[at..at + n]);
        }
        Ok(())
    }
}
