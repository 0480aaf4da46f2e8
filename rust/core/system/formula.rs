//! What the author of a native model writes: formulas, once, for one state or eight at a time.

use std::sync::Arc;

use super::{Flow, Hamiltonian, SemiLinear, Separable};
use crate::error::Result;
use crate::linalg::kernel::{
    Body, Eight, Lanes, Pack, dispatch, packs, packs_mut, singles, singles_mut,
};

/// Energy and rates of a Hamiltonian model.
///
/// Methods of a model that take a [`Pack`] must be `#[inline(always)]`, as those of a [`Body`] must.
/// Where a state is outside what the model describes, they give what is not a number.
#[allow(clippy::len_without_is_empty)] // of models, which are never empty
pub trait Formula: Send + Sync {
    /// Length of the state `[q; p]`.
    fn len(&self) -> usize;
    /// The energy.
    fn energy<V: Lanes>(&self, t: Pack<V>, z: &[Pack<V>]) -> Pack<V>;
    /// `z'`: `q' = dH/dp`, `p' = -dH/dq`.
    fn rate<V: Lanes>(&self, t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]);
    /// See [`Flow::linear`].
    fn linear(&self) -> Option<&[f64]> {
        None
    }
}

/// A formula whose energy is a kinetic part of the momenta and a potential of the coordinates.
pub trait SplitFormula: Formula {
    /// `q'`.
    fn velocity<V: Lanes>(&self, p: &[Pack<V>], rate: &mut [Pack<V>]);
    /// `p'`.
    fn force<V: Lanes>(&self, t: Pack<V>, q: &[Pack<V>], rate: &mut [Pack<V>]);
    /// See [`Separable::semilinear`].
    fn semilinear(&self) -> Option<Arc<dyn SemiLinear>> {
        None
    }
}

/// The rate of a formula that is split.
#[inline(always)]
pub fn split_rate<V: Lanes>(
    model: &impl SplitFormula,
    t: Pack<V>,
    z: &[Pack<V>],
    f: &mut [Pack<V>],
) {
    let n = z.len() / 2;
    let ((q, p), (dq, dp)) = (z.split_at(n), f.split_at_mut(n));
    model.velocity(p, dq);
    model.force(t, q, dp);
}

/// A formula with a linear part, which [`Formula::linear`] gives, and a remainder.
pub trait Parts: Formula {
    /// `z' - A z`, without the loss of digits that a difference has.
    fn remainder<V: Lanes>(&self, t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]);
    /// See [`SemiLinear::is_force`].
    fn is_force(&self) -> bool {
        false
    }
}

/// Rates of blocks of eight states.
struct Sweep<'a, F> {
    model: &'a F,
    t: &'a [Eight],
    z: &'a [Eight],
    f: &'a mut [Eight],
}

impl<F: Formula> Body for Sweep<'_, F> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let len = self.model.len();
        let states = packs::<V>(self.z).chunks_exact(len);
        let rates = packs_mut::<V>(self.f).chunks_exact_mut(len);
        for ((t, z), f) in packs::<V>(self.t).iter().zip(states).zip(rates) {
            self.model.rate(*t, z, f);
        }
    }
}

/// Remainders of eight states.
struct Rest<'a, F> {
    model: &'a F,
    t: &'a Eight,
    z: &'a [Eight],
    f: &'a mut [Eight],
}

impl<F: Parts> Body for Rest<'_, F> {
    type Output = ();
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let [t] = *packs::<V>(std::slice::from_ref(self.t)) else { unreachable!("one pack") };
        self.model.remainder(t, packs::<V>(self.z), packs_mut::<V>(self.f));
    }
}

impl<F: Formula> Flow for F {
    fn len(&self) -> usize {
        Formula::len(self)
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        Formula::rate(self, Pack(t), singles(z), singles_mut(f));
        Ok(())
    }
    fn rates(
        &self,
        t: &[Eight],
        z: &[Eight],
        f: &mut [Eight],
        _: usize,
        _: &mut [f64],
    ) -> Result<()> {
        dispatch(Sweep { model: self, t, z, f });
        Ok(())
    }
    fn scratch_len(&self) -> usize {
        0
    }
    fn linear(&self) -> Option<&[f64]> {
        Formula::linear(self)
    }
}

impl<F: Formula> Hamiltonian for F {
    fn energy(&self, t: f64, z: &[f64]) -> Result<f64> {
        Ok(Formula::energy(self, Pack(t), singles(z)).0)
    }
}

impl<F: SplitFormula> Separable for F {
    fn velocity(&self, p: &[f64], rate: &mut [f64]) -> Result<()> {
        SplitFormula::velocity(self, singles(p), singles_mut(rate));
        Ok(())
    }
    fn force(&self, t: f64, q: &[f64], rate: &mut [f64]) -> Result<()> {
        SplitFormula::force(self, Pack(t), singles(q), singles_mut(rate));
        Ok(())
    }
    fn semilinear(&self) -> Option<Arc<dyn SemiLinear>> {
        SplitFormula::semilinear(self)
    }
}

impl<F: Parts> SemiLinear for F {
    fn matrix(&self) -> &[f64] {
        Formula::linear(self).expect("a formula in parts has a linear one")
    }
    fn remainder(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        Parts::remainder(self, Pack(t), singles(z), singles_mut(f));
        Ok(())
    }
    fn remainders(
        &self,
        t: &Eight,
        z: &[Eight],
        f: &mut [Eight],
        _: usize,
        _: &mut [f64],
    ) -> Result<()> {
        dispatch(Rest { model: self, t, z, f });
        Ok(())
    }
    fn is_force(&self) -> bool {
        Parts::is_force(self)
    }
}
