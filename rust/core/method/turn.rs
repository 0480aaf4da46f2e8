//! The exact linear flow, for methods that turn with it: over a step in pairs of doubles, of a state whose
//! remainder is carried, and to several places in a step at once.

use crate::error::{Error, Result};
use crate::expm::{Correction, Propagator, Recipe};
use crate::linalg::dense::Watch;
use crate::linalg::kernel::{Body, Eight, Lanes, Pack, dispatch, packs};

/// A matrix of pairs of doubles that is applied to pairs: columns in blocks of eight rows, those that
/// are zero left out.
pub struct Turn {
    rows: usize,
    /// Of each block the column, and leading parts and remainders of its eight rows.
    blocks: Vec<Vec<(usize, [Eight; 2])>>,
}

impl Turn {
    /// `exp(tau A)`; A row by row, `m` rows.
    ///
    /// # Errors
    /// Those of [`Propagator::new`].
    pub fn new(m: usize, a: &[f64], tau: f64, watch: &mut Watch) -> Result<Turn> {
        Turn::part(m, m, a, tau, watch)
    }

    /// The first `rows` rows of `exp(tau A)`: exact flow and integrals of what A holds beside it.
    ///
    /// # Errors
    /// Those of [`Propagator::new`].
    pub fn part(m: usize, rows: usize, a: &[f64], tau: f64, watch: &mut Watch) -> Result<Turn> {
        let made = Propagator::new(m, a, tau, Recipe::EXACT, Some(Correction::Exact), watch)?;
        let mut blocks: Vec<Vec<_>> = vec![Vec::new(); rows.div_ceil(8)];
        for block in &mut blocks {
            *block = (0..m).map(|j| (j, [Eight::ZERO; 2])).collect();
        }
        made.pairs(|i, j, [hi, lo]| {
            if i < rows {
                let (_, entry) = &mut blocks[i / 8][j];
                (entry[0].0[i % 8], entry[1].0[i % 8]) = (hi, lo);
            }
        });
        for block in &mut blocks {
            block.retain(|(_, entry)| *entry != [Eight::ZERO; 2]);
        }
        Ok(Turn { rows, blocks })
    }

    /// `(z, e) <- M (x, r)`: numbers and their remainders.
    pub fn apply(&self, x: &[f64], r: &[f64], z: &mut [f64], e: &mut [f64]) {
        dispatch(Apply { turn: self, x, r, z, e });
    }
}

struct Apply<'a> {
    turn: &'a Turn,
    x: &'a [f64],
    r: &'a [f64],
    z: &'a mut [f64],
    e: &'a mut [f64],
}

impl Body for Apply<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Apply { turn, x, r, z, e } = self;
        let out = z[..turn.rows].chunks_mut(8).zip(e[..turn.rows].chunks_mut(8));
        for (block, (z, e)) in turn.blocks.iter().zip(out) {
            let (mut sum, mut rest) = (Pack::<V>::splat(0.0), Pack::<V>::splat(0.0));
            for (j, entry) in block {
                let [hi, lo] = *packs::<V>(entry) else { unreachable!("two parts") };
                let (x, r) = (Pack::splat(x[*j]), Pack::splat(r[*j]));
                let (product, off) = hi.two_product(x);
                let lost;
                (sum, lost) = sum.two_sum(product);
                rest = rest + ((off + lost) + (hi * r + lo * x));
            }
            let (sum, rest) = sum.two_sum(rest);
            sum.store(z);
            rest.store(e);
        }
    }
}

/// Matrices for eight lanes at once, one each, row by row without what is zero in all.
pub struct Lanewise {
    starts: Vec<usize>,
    columns: Vec<usize>,
    entries: Vec<Eight>,
}

impl Lanewise {
    /// Of `m` rows; `entry(lane, i, j)`.
    pub fn new(m: usize, entry: impl Fn(usize, usize, usize) -> f64) -> Lanewise {
        let mut made = Lanewise { starts: vec![0], columns: Vec::new(), entries: Vec::new() };
        for i in 0..m {
            for j in 0..m {
                let pack = Eight(std::array::from_fn(|lane| entry(lane, i, j)));
                if pack != Eight::ZERO {
                    made.columns.push(j);
                    made.entries.push(pack);
                }
            }
            made.starts.push(made.columns.len());
        }
        made
    }

    /// Row `i` times a vector of packs.
    #[inline(always)]
    pub fn row<V: Lanes>(&self, i: usize, x: &[Pack<V>]) -> Pack<V> {
        let range = self.starts[i]..self.starts[i + 1];
        let entries = &packs::<V>(&self.entries)[range.clone()];
        let mut sum = Pack::splat(0.0);
        for (entry, &j) in entries.iter().zip(&self.columns[range]) {
            sum = sum + *entry * x[j];
        }
        sum
    }

    /// Row `i` times the same vector in all lanes.
    #[inline(always)]
    pub fn row_of_one<V: Lanes>(&self, i: usize, x: &[f64]) -> Pack<V> {
        let range = self.starts[i]..self.starts[i + 1];
        let entries = &packs::<V>(&self.entries)[range.clone()];
        let mut sum = Pack::splat(0.0);
        for (entry, &j) in entries.iter().zip(&self.columns[range]) {
            sum = sum + *entry * x[j];
        }
        sum
    }
}

/// `exp(tau A)` rounded, row by row.
///
/// # Errors
/// Those of [`Propagator::new`].
pub fn exponential(m: usize, a: &[f64], tau: f64, watch: &mut Watch) -> Result<Vec<f64>> {
    let recipe = Recipe::for_steps(m, a);
    let made = Propagator::new(m, a, tau, recipe, Some(Correction::None), watch)?;
    let mut out = vec![0.0; m * m];
    made.matrix(&mut out);
    match out.iter().all(|x| x.is_finite()) {
        true => Ok(out),
        false => Err(Error::overflow("the exponential of a step exceeds 1.8e308")),
    }
}

/// Adds to numbers and their remainders, exactly to the last bit of a remainder.
pub fn add_compensated(x: &mut f64, rest: &mut f64, more: f64) {
    let step = *rest + more;
    let [sum, lost] = crate::linalg::twofold::two_sum(*x, step);
    (*x, *rest) = (sum, lost);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::twofold;

    #[test]
    fn turns_keep_a_carried_state_to_more_than_a_double() {
        // x' = w y, y' = -w x, w = 1 and 3, apart: 1e5 turns and as many back.
        #[rustfmt::skip]
        let a = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 3.0, -1.0, 0.0, 0.0, 0.0, 0.0, -3.0, 0.0, 0.0];
        let there = Turn::new(4, &a, 0.1, &mut || Ok(())).unwrap();
        let back = Turn::new(4, &a, -0.1, &mut || Ok(())).unwrap();
        assert_eq!(there.blocks[0].len(), 4);
        let start = [0.3, -0.7, 1.1, 0.2];
        let (mut z, mut e) = (start, [0.0; 4]);
        for turn in [&there, &back] {
            for _ in 0..100_000 {
                let (x, r) = (z, e);
                turn.apply(&x, &r, &mut z, &mut e);
            }
        }
        for (i, start) in start.into_iter().enumerate() {
            let off = twofold::sum([z[i], e[i]], [-start, 0.0])[0];
            assert!(off.abs() <= 1e-24, "{off:e}"); // 2e5 steps of 1e-31
        }
    }
}
