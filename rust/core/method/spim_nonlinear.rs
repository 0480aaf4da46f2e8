//! The paper's nonlinear SPIM, eqs. 46 and 47, in phi-functions, which need no inverse:
//! `z1 = W z + h phi_1 r0 + h^2 phi_2 r1` for a remainder `r0 + r1 (t - t_k)` over a step.
//!
//! `spim_explicit` (46) takes `r1` along the flow, `spim_pc` (47) from a predicted end, `spim_implicit` from
//! the end itself: the symmetric exponential trapezoidal rule. Of order 2, not symplectic; the first two
//! drift. Other functions than straight lines are in `spim_fitted`.

use super::common::{PAIRS_TO, add_product, check_finite, iterate, largest, way};
use super::spim_fitted::{self, APPROXIMATION, Fit};
use super::{Bound, MethodInfo, Needs, Options, State, Step, Stepper, Work};
use crate::error::Result;
use crate::expm;
use crate::linalg::dense::Watch;
use crate::system::{Problem, SemiLinear};

/// Where a step knows from how the remainder changes.
#[derive(Clone, Copy, PartialEq)]
pub enum Slope {
    /// From where it starts.
    AlongTheFlow,
    /// From a predicted end.
    Predicted,
    /// From its end.
    Implicit,
}

struct SpimNonlinear {
    name: &'static str,
    h: f64,
    slope: Slope,
    /// `exp(h A)`, `h phi_1`, `h phi_2`, row by row.
    matrices: [Vec<f64>; 3],
    r0: Vec<f64>,
    r1: Vec<f64>,
    base: Vec<f64>,
    end: Vec<f64>,
    last: Vec<f64>,
}

fn build(
    name: &'static str,
    slope: Slope,
    problem: &Problem,
    h: f64,
    options: &Options,
    watch: &mut Watch,
) -> Result<Box<dyn Step>> {
    let system = problem.semilinear().expect("the record's need");
    let fit = Fit::of(options)?;
    if fit != Fit::Polynomial(1) {
        let method = spim_fitted::Fitted::new(name, slope, fit, &*system, h, watch)?;
        return Ok(Box::new(Bound::new(method, system, String::new())));
    }
    let m = system.len();
    let mut matrices = [(); 3].map(|()| vec![0.0; m * m]);
    {
        let mut outs: Vec<&mut [f64]> = matrices.iter_mut().map(|x| x.as_mut_slice()).collect();
        // Row by row as well: functions of a transposed matrix are transposed.
        expm::phis(m, m <= PAIRS_TO, system.matrix(), h, &mut outs, watch)?;
    }
    matrices[1].iter_mut().for_each(|x| *x *= h);
    matrices[2].iter_mut().for_each(|x| *x *= h);
    let zeros = || vec![0.0; m];
    let method = SpimNonlinear {
        name,
        h,
        slope,
        matrices,
        r0: zeros(),
        r1: zeros(),
        base: zeros(),
        end: zeros(),
        last: zeros(),
    };
    Ok(Box::new(Bound::new(method, system, String::new())))
}

impl SpimNonlinear {
    /// `h r1` by a difference along the flow, to a third of the digits of what it neglects.
    fn along_the_flow(&mut self, system: &dyn SemiLinear, t: f64, z: &[f64]) -> Result<()> {
        let rate = &mut self.last;
        system.rate(t, z, rate)?;
        let (size, speed) = (largest(z).max(f64::MIN_POSITIVE), largest(rate));
        let d =
            6e-6 * if speed > 0.0 { (size / speed).min(1e3 * self.h.abs()) } else { self.h.abs() };
        for (sign, out) in [(1.0, &mut self.r1), (-1.0, &mut self.base)] {
            for ((end, z), rate) in self.end.iter_mut().zip(z).zip(&self.last) {
                *end = z + sign * d * rate;
            }
            system.remainder(t + sign * d, &self.end, out)?;
        }
        for (r1, before) in self.r1.iter_mut().zip(&self.base) {
            *r1 = (*r1 - before) * (0.5 * self.h / d);
        }
        Ok(())
    }

    /// `end = base + h phi_2 (h r1)`.
    fn correct(&mut self) {
        self.end.copy_from_slice(&self.base);
        add_product(&self.matrices[2], &self.r1, &mut self.end);
    }
}

impl Stepper<dyn SemiLinear> for SpimNonlinear {
    fn step(
        &mut self,
        system: &dyn SemiLinear,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let z = &state.z;
        system.remainder(t, z, &mut self.r0)?;
        work.evaluations += 1;
        if self.slope == Slope::AlongTheFlow {
            self.along_the_flow(system, t, z)?;
            work.evaluations += 3;
        }
        self.base.fill(0.0);
        add_product(&self.matrices[0], z, &mut self.base);
        add_product(&self.matrices[1], &self.r0, &mut self.base);
        match self.slope {
            Slope::AlongTheFlow => self.correct(),
            Slope::Predicted => {
                system.remainder(t + self.h, &self.base, &mut self.r1)?;
                self.r1.iter_mut().zip(&self.r0).for_each(|(r1, r0)| *r1 -= r0);
                self.correct();
                work.evaluations += 1;
            }
            Slope::Implicit => {
                self.end.copy_from_slice(&self.base);
                iterate(self.name, t, k, || {
                    self.last.copy_from_slice(&self.end);
                    system.remainder(t + self.h, &self.last, &mut self.r1)?;
                    self.r1.iter_mut().zip(&self.r0).for_each(|(r1, r0)| *r1 -= r0);
                    self.correct();
                    work.evaluations += 1;
                    Ok(way(&mut self.last, &self.end))
                })?;
            }
        }
        check_finite(self.name, t, k, &self.end)?;
        state.z.copy_from_slice(&self.end);
        work.steps += 1;
        Ok(())
    }
}

/// Eq. 46.
pub const EXPLICIT: MethodInfo = MethodInfo {
    name: "spim_explicit",
    aliases: &[],
    summary: "the paper's nonlinear SPIM, slope of the remainder along the flow",
    order: Some(2),
    symplectic: false,
    symmetric: false,
    energy_preserving: false,
    needs: Needs::SemiLinear,
    reproducible: "on every machine",
    reference: "Huang, Deng & Yao, J. Sound Vib. 299 (2007), eq. 46",
    options: &[APPROXIMATION],
    build: |problem, h, options, watch| {
        build("spim_explicit", Slope::AlongTheFlow, problem, h, options, watch)
    },
};

/// Eq. 47.
pub const PREDICTED: MethodInfo = MethodInfo {
    name: "spim_pc",
    summary: "the paper's nonlinear SPIM, predictor and corrector",
    reference: "Huang, Deng & Yao, J. Sound Vib. 299 (2007), eq. 47",
    build: |problem, h, options, watch| {
        build("spim_pc", Slope::Predicted, problem, h, options, watch)
    },
    ..EXPLICIT
};

/// Eq. 47 to its end.
pub const IMPLICIT: MethodInfo = MethodInfo {
    name: "spim_implicit",
    summary: "eq. 47 iterated to its end: the exponential trapezoidal rule",
    symmetric: true,
    build: |problem, h, options, watch| {
        build("spim_implicit", Slope::Implicit, problem, h, options, watch)
    },
    ..PREDICTED
};
