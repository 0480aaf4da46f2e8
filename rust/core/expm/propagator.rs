//! The exponential of one step, formed once and applied many times.

use std::sync::OnceLock;

use super::arithmetic::{Doubles, Pairs};
use super::doubling::{Form, double, overflow};
use super::{Exponential, Recipe, exponential, half};
use crate::error::{Error, Result};
use crate::linalg::dense::{self, Watch};
use crate::linalg::kernel::{Depth, Eight, Layout, Product, dispatch, doubles};
use crate::linalg::pair::{Pair, PairEngine, PairMut, add_diagonal};
use crate::linalg::symplectic::{self, Group, Polish};
use crate::linalg::twofold;

/// What is done about the rounding of the stored exponential, which acts like a fixed perturbation
/// of the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Correction {
    /// Nothing.
    None,
    /// The symplectic defect is taken out where it is above rounding.
    Polish,
    /// Exponential, state and products in pairs: the state stays correctly rounded.
    Exact,
}

/// `exp(tau A)`, ready to step.
pub struct Propagator {
    /// Step, in seconds or whatever `A` is per.
    pub tau: f64,
    /// How the exponential was formed.
    pub recipe: Recipe,
    /// What is done about rounding.
    pub correction: Correction,
    /// What the map keeps: Hamiltonian matrices make symplectic maps, skew ones orthogonal maps.
    pub group: Option<Group>,
    one: Exponential,
    powers: OnceLock<Vec<Power>>,
}

/// The exponential of a power-of-two number of steps.
pub(super) struct Power {
    pub form: Form,
    pub hi: Vec<Eight>,
    pub lo: Vec<Eight>,
}

impl Propagator {
    /// Forms `exp(tau A)` of the exact product; `a` is `rows x rows`, row by row.
    ///
    /// `correction: None` polishes where `A` is Hamiltonian to rounding, or skew, and the map near
    /// symplectic or orthogonal, and does nothing elsewhere.
    ///
    /// # Errors
    /// [`Error::Argument`] for a polish of what is not so; those of [`exponential`].
    pub fn new(
        rows: usize,
        a: &[f64],
        tau: f64,
        recipe: Recipe,
        correction: Option<Correction>,
        watch: &mut Watch,
    ) -> Result<Propagator> {
        let layout = Layout::new(rows);
        let mut packed = dense::zeros(layout.packs(rows))?;
        // Row by row is the transposed matrix column by column; it is Hamiltonian when A is.
        dense::pack(layout, a, &mut packed);
        let separable = half::is_separable(rows, a);
        let group = if separable || symplectic::is_hamiltonian(layout, &packed) {
            Some(Group::Symplectic)
        } else {
            symplectic::is_skew(layout, &packed).then_some(Group::Orthogonal)
        };
        let asked = correction;
        let mut correction = match correction {
            None if group.is_some() => Correction::Polish,
            None => Correction::None,
            Some(Correction::Polish) if group.is_none() => {
                return Err(Error::argument(
                    "correction: \"polish\" needs a Hamiltonian matrix, J A symmetric for z = [q; p], or \
                     a skew-symmetric one; use \"none\" or \"exact\"",
                ));
            }
            Some(correction) => correction,
        };
        let pairs = correction == Correction::Exact;
        let mut one = exponential(rows, recipe, a, tau, pairs, watch)?;
        dense::transpose(layout, &mut one.hi);
        if pairs {
            dense::transpose(layout, &mut one.lo);
            // A pair has digits enough for slow modes in the whole; in the increment, modes that
            // decay would lose theirs.
            if one.form == Form::Increment {
                add_diagonal(layout, [1.0, 0.0], [&mut one.hi, &mut one.lo]);
                one.form = Form::Whole;
            }
        } else {
            // What steps in doubles is the rounded increment.
            one.lo.fill(Eight::ZERO);
        }
        if let (Correction::Polish, Some(group)) = (correction, group) {
            let polish = match one.form {
                Form::Increment => symplectic::polish(layout, group, &mut one.hi, watch)?,
                Form::Whole => Polish::TooFar,
            };
            if polish == Polish::TooFar {
                if asked == Some(Correction::Polish) {
                    return Err(Error::argument(
                        "correction: \"polish\" cannot help: the map is far from symplectic, as growing \
                         motion and low orders make it; use \"none\" or \"exact\"",
                    ));
                }
                correction = Correction::None;
            }
        }
        let powers = OnceLock::new();
        Ok(Propagator { tau, recipe, correction, group, one, powers })
    }

    /// Where the columns of states lie.
    pub fn layout(&self) -> Layout {
        self.one.layout
    }

    /// Size of the state.
    pub fn rows(&self) -> usize {
        self.one.layout.rows
    }

    /// Whether the exponential was made by half-size doubling.
    pub fn by_halves(&self) -> bool {
        self.one.by_halves
    }

    /// Doublings taken.
    pub fn doublings(&self) -> u32 {
        self.one.doublings
    }

    /// 1-norm of the balanced `tau A^T`: what the digits of the exponential depend on.
    pub fn norm(&self) -> f64 {
        self.one.norm
    }

    /// `exp(tau A)`, row by row.
    pub fn matrix(&self, out: &mut [f64]) {
        self.entries(Form::Whole, out);
    }

    /// `exp(tau A) - I`, row by row.
    pub fn increment(&self, out: &mut [f64]) {
        self.entries(Form::Increment, out);
    }

    /// `exp(tau A)` as pairs `[hi, lo]`, row by row.
    pub fn pairs(&self, mut put: impl FnMut(usize, usize, [f64; 2])) {
        let (m, ld) = (self.rows(), self.layout().doubles());
        let (hi, lo) = (doubles(&self.one.hi), doubles(&self.one.lo));
        let shift = if self.one.form == Form::Increment { 1.0 } else { 0.0 };
        for i in 0..m {
            for j in 0..m {
                let unit = if i == j { shift } else { 0.0 };
                put(i, j, twofold::sum([unit, 0.0], [hi[j * ld + i], lo[j * ld + i]]));
            }
        }
    }

    fn entries(&self, wanted: Form, out: &mut [f64]) {
        let (m, ld) = (self.rows(), self.layout().doubles());
        let shift = match (self.one.form, wanted) {
            (Form::Increment, Form::Whole) => 1.0,
            (Form::Whole, Form::Increment) => -1.0,
            _ => 0.0,
        };
        let (hi, lo) = (doubles(&self.one.hi), doubles(&self.one.lo));
        for (i, row) in out.chunks_exact_mut(m).enumerate() {
            for (j, out) in row.iter_mut().enumerate() {
                let entry = [hi[j * ld + i], lo[j * ld + i]];
                *out = match i == j {
                    true => twofold::sum([shift, 0.0], entry)[0],
                    false => entry[0],
                };
            }
        }
    }

    /// The largest entry of `T* + T + T* T`, evaluated in pairs, of the increment that steps.
    ///
    /// # Errors
    /// [`Error::Argument`] for states of odd size.
    pub fn symplectic_defect(&self, watch: &mut Watch) -> Result<f64> {
        if !self.rows().is_multiple_of(2) {
            return Err(Error::argument(format!(
                "symplectic_defect: a state of odd size, {}, has no halves q and p",
                self.rows()
            )));
        }
        let t = Pair { hi: &self.one.hi, lo: &self.one.lo };
        if self.one.form == Form::Increment {
            return symplectic::defect(self.layout(), t, watch);
        }
        let (mut hi, mut lo) = (self.one.hi.clone(), self.one.lo.clone());
        add_diagonal(self.layout(), [-1.0, 0.0], [&mut hi, &mut lo]);
        symplectic::defect(self.layout(), Pair { hi: &hi, lo: &lo }, watch)
    }

    /// One step, `z <- z + T z`.
    ///
    /// # Errors
    /// [`Error::Overflow`] where the new state is beyond the largest double.
    #[inline]
    pub fn step(&self, z: &[f64], out: &mut [f64]) -> Result<()> {
        let layout = self.layout();
        let columns = layout.packs(1);
        let matrices = match self.correction {
            Correction::Exact => 4 * columns + PairEngine::pieces(Depth::Three) * self.one.hi.len(),
            _ => 2 * columns,
        };
        dense::with_scratch(matrices, &mut || Ok(()), |memory, watch| {
            let (states, rest) = memory.split_at_mut(2 * columns);
            let [state, next] = dense::pieces(states, columns);
            dense::pack(layout, z, state);
            let keep = self.one.form == Form::Increment;
            if self.correction == Correction::Exact {
                let (remainders, slices) = rest.split_at_mut(2 * columns);
                let [zero, lost] = dense::pieces(remainders, columns);
                zero.fill(Eight::ZERO);
                let z = Pair { hi: state, lo: zero };
                PairEngine::new(layout, Depth::Three, slices).multiply(
                    Pair { hi: &self.one.hi, lo: &self.one.lo },
                    z,
                    keep.then_some((1.0, z)),
                    &mut PairMut { hi: &mut *next, lo: lost },
                    watch,
                )?;
            } else {
                let add = keep.then_some((1.0, &*state));
                let (a, b) = (&self.one.hi, &*state);
                dispatch(Product { layout, columns: 1, a, b, add, c: &mut *next });
            }
            out.copy_from_slice(&doubles(next)[..layout.rows]);
            if dense::is_finite(out) { Ok(()) } else { Err(state_overflow()) }
        })
    }

    /// Exponentials of 1, 2, 4, … steps, as many as blocks of stepping use.
    pub(super) fn powers(&self, watch: &mut Watch) -> Result<&[Power]> {
        if let Some(powers) = self.powers.get() {
            return Ok(powers);
        }
        let mut powers =
            vec![Power { form: self.one.form, hi: self.one.hi.clone(), lo: self.one.lo.clone() }];
        // Small states gain from longer blocks, which hide the latency of short products.
        let most = if self.rows() <= 16 { 7 } else { 4 };
        while powers.len() < most {
            match self.doubled(powers.last().expect("one at least"), watch) {
                Ok(power) => powers.push(power),
                // Growth: shorter blocks do as well.
                Err(error) if matches!(*error, Error::Overflow(_)) => break,
                Err(error) => return Err(error),
            }
        }
        Ok(self.powers.get_or_init(|| powers))
    }

    /// A power that [`powers`](Self::powers) has formed.
    pub(super) fn power(&self, number: usize) -> &Power {
        &self.powers.get().expect("formed before stepping")[number]
    }

    /// The power of twice as many steps.
    pub(super) fn doubled(&self, power: &Power, watch: &mut Watch) -> Result<Power> {
        const SQUARE: usize = 0;
        let layout = self.layout();
        let packs = layout.packs(layout.rows);
        let (mut hi, lo, form);
        if self.correction == Correction::Exact {
            let mut memory = dense::zeros(packs * Pairs::matrices(2, Depth::Three))?;
            let mut x = Pairs::new(layout, 2, Depth::Three, &mut memory, watch);
            let t = x.matrix(SQUARE);
            t.hi.copy_from_slice(&power.hi);
            t.lo.copy_from_slice(&power.lo);
            form = double(&mut x, SQUARE, 1, power.form, 1)?;
            let t = x.matrix(SQUARE);
            (hi, lo) = (t.hi.to_vec(), t.lo.to_vec());
            // Cutting for the largest states must not overflow either.
            let largest = symplectic::largest(&hi);
            if largest.is_nan() || largest > 1e20 {
                return Err(overflow());
            }
        } else {
            let mut memory = dense::zeros(packs * 2)?;
            let mut x = Doubles::new(layout, &mut memory, watch);
            x.matrix(SQUARE).copy_from_slice(&power.hi);
            form = double(&mut x, SQUARE, 1, power.form, 1)?;
            (hi, lo) = (x.matrix(SQUARE).to_vec(), dense::zeros(packs)?);
            if !dense::is_finite(doubles(&hi)) {
                return Err(overflow());
            }
            if let (Correction::Polish, Form::Increment, Some(group)) =
                (self.correction, form, self.group)
            {
                // A power that is too far from symplectic is one of growing motion: left alone.
                let _ = symplectic::polish(layout, group, &mut hi, watch)?;
            }
        }
        Ok(Power { form, hi, lo })
    }
}

/// The error for a state beyond the largest double.
pub(super) fn state_overflow() -> Box<Error> {
    Error::overflow(
        "the state overflows: a component exceeds 1.8e308; the system grows without bound",
    )
}
