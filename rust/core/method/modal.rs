//! Modal stepping: every mode by its own exact exponential, a few operations a step and mode.
//!
//! The modes themselves are where digits are lost, up to three of the energy on stiff beams
//! (`u w_max^2 / w_low`), which is why this is never the default.

use std::sync::Arc;

use super::{Bound, MethodInfo, Needs, State, Stepper, Work};
use crate::error::{Error, Result};
use crate::expm::{Propagator, Recipe};
use crate::linalg::dense;
use crate::system::{Linear, Load};

/// Steps whose impulses are fetched at once.
const AHEAD: u64 = 64;

struct Modal {
    /// `exp(h A) - I` of each mode, row by row.
    modes: Vec<[f64; 4]>,
    load: Option<Arc<dyn Load>>,
    /// Impulses of the steps from `from` on, one row a step; empty before the first.
    impulses: Vec<f64>,
    from: u64,
    /// The state being made.
    next: Vec<f64>,
}

impl Modal {
    /// Fetches the impulses of step `k` and those around it.
    fn fetch(&mut self, k: u64, len: usize) -> Result<()> {
        let Some(load) = &self.load else { return Ok(()) };
        let from = k - k % AHEAD;
        if self.impulses.is_empty() || self.from != from {
            self.impulses.resize(AHEAD as usize * len, 0.0);
            self.from = from;
            if let Err(error) = load.impulses(from, &mut self.impulses) {
                self.impulses.clear();
                return Err(error);
            }
        }
        Ok(())
    }
}

impl Stepper<Linear> for Modal {
    fn block(&self) -> u64 {
        AHEAD
    }

    fn step(
        &mut self,
        _: &Linear,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let n = self.modes.len();
        self.fetch(k, 2 * n)?;
        let impulse = self.load.is_some().then(|| {
            let at = (k - self.from) as usize * 2 * n;
            &self.impulses[at..at + 2 * n]
        });
        let (q, p) = state.z.split_at(n);
        let (next_q, next_p) = self.next.split_at_mut(n);
        for (i, [a, b, c, d]) in self.modes.iter().enumerate() {
            next_q[i] = q[i] + (a * q[i] + b * p[i]);
            next_p[i] = p[i] + (c * q[i] + d * p[i]);
        }
        work.products += 1;
        if let Some(impulse) = impulse {
            self.next.iter_mut().zip(impulse).for_each(|(z, v)| *z += v);
        }
        if !dense::is_finite(&self.next) {
            return Err(Box::new(Error::Model {
                message: format!(
                    "modal: the state overflows in the step from t = {t:e}: the system grows \
                     without bound"
                ),
                t,
                step: k,
            }));
        }
        state.z.copy_from_slice(&self.next);
        work.steps += 1;
        Ok(())
    }
}

/// Whether a system is one of oscillators, each by itself.
pub(super) fn is_decoupled(system: &Linear) -> bool {
    let (m, a) = (system.rows(), system.matrix());
    let n = m / 2;
    m.is_multiple_of(2) && (0..m).all(|i| (0..m).all(|j| i % n == j % n || a[i * m + j] == 0.0))
}

pub(super) const MODAL: MethodInfo = MethodInfo {
    name: "modal",
    aliases: &[],
    summary: "every mode by its own exponential: cheap steps, up to three digits of the energy \
              fewer on stiff structures",
    order: None,
    symplectic: true,
    symmetric: true,
    energy_preserving: true,
    needs: Needs::Modes,
    reproducible: "one machine (the modes are LAPACK's)",
    reference: "Clough & Penzien, Dynamics of Structures (1975)",
    options: &[],
    build: |problem, h, _, watch| {
        let Some(system) = problem.linear() else {
            return Err(Error::unsupported("modal: needs a structure"));
        };
        let (m, a) = (system.rows(), system.matrix());
        let n = m / 2;
        if !system.generated().is_empty() {
            return Err(Error::unsupported("modal: takes loads as impulses of steps alone"));
        }
        let mut modes = Vec::with_capacity(n);
        for i in 0..n {
            let at = |row: usize, column: usize| a[row * m + column];
            let mode = [at(i, i), at(i, n + i), at(n + i, i), at(n + i, n + i)];
            let mut increment = [0.0; 4];
            Propagator::new(2, &mode, h, Recipe::EXACT, None, watch)?.increment(&mut increment);
            modes.push(increment);
        }
        let load = system.load().cloned();
        let modal = Modal { modes, load, impulses: Vec::new(), from: 0, next: vec![0.0; m] };
        Ok(Box::new(Bound::new(modal, system.clone(), format!("{n} modes"))))
    },
};
