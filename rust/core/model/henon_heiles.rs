//! Hénon & Heiles (1964): `H = (px^2 + py^2)/2 + (x^2 + y^2)/2 + x^2 y - y^3/3`. Chaotic from an energy of 1/12
//! on, unbounded from 1/6.

use std::sync::Arc;

use super::{Native, positive, separable};
use crate::error::Result;
use crate::linalg::kernel::{Lanes, Pack};
use crate::system::{Formula, Parts, SemiLinear, SplitFormula, split_rate};

/// The linear part: two oscillators of frequency 1.
#[rustfmt::skip]
const OSCILLATORS: [f64; 16] = [
    0.0, 0.0, 1.0, 0.0,
    0.0, 0.0, 0.0, 1.0,
    -1.0, 0.0, 0.0, 0.0,
    0.0, -1.0, 0.0, 0.0,
];

/// The system; its state is `[x, y, px, py]`.
pub struct HenonHeiles;

/// Without parameters.
///
/// # Errors
/// [`Error::Argument`](crate::Error::Argument) for parameters.
pub fn make(parameters: &[f64]) -> Result<Native> {
    positive([], parameters)?;
    Ok(separable(HenonHeiles))
}

impl Formula for HenonHeiles {
    fn len(&self) -> usize {
        4
    }
    #[inline(always)]
    fn energy<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>]) -> Pack<V> {
        let [x, y, px, py] = *z else { unreachable!("4 components") };
        let kinetic = 0.5 * (px * px + py * py);
        kinetic + 0.5 * (x * x + y * y) + x * x * y - y * y * y / 3.0
    }
    #[inline(always)]
    fn rate<V: Lanes>(&self, t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]) {
        split_rate(self, t, z, f);
    }
    fn linear(&self) -> Option<&[f64]> {
        Some(&OSCILLATORS)
    }
}

impl SplitFormula for HenonHeiles {
    #[inline(always)]
    fn velocity<V: Lanes>(&self, p: &[Pack<V>], rate: &mut [Pack<V>]) {
        rate.copy_from_slice(p);
    }
    #[inline(always)]
    fn force<V: Lanes>(&self, _t: Pack<V>, q: &[Pack<V>], rate: &mut [Pack<V>]) {
        let [x, y] = *q else { unreachable!("2 coordinates") };
        rate.copy_from_slice(&[-x - 2.0 * x * y, -y - (x * x - y * y)]);
    }
    fn semilinear(&self) -> Option<Arc<dyn SemiLinear>> {
        Some(Arc::new(HenonHeiles))
    }
}

impl Parts for HenonHeiles {
    #[inline(always)]
    fn remainder<V: Lanes>(&self, _t: Pack<V>, z: &[Pack<V>], f: &mut [Pack<V>]) {
        let [x, y, ..] = *z else { unreachable!("4 components") };
        let zero = Pack::splat(0.0);
        f.copy_from_slice(&[zero, zero, -2.0 * x * y, y * y - x * x]);
    }
    fn is_force(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_energy() {
        assert!(super::super::rate_defect(&HenonHeiles, &[0.1, -0.2, 0.3, 0.05]) < 1e-11);
    }
}
