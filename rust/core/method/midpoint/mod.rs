//! Implicit midpoint steps, one or two in a step: symplectic, symmetric, of order 2.
//!
//! `srk2` is the paper's two-stage method (eqs. 25-30), `a = [[1/4, 0], [1/2, 1/4]]`, `b = [1/2, 1/2]`:
//! two midpoint steps of half the size.

mod beam;
mod fused;
mod halves;
mod limit;
mod modal;
mod start;

use self::halves::Halves;
use super::gauss::{Ending, Gauss};
use super::{Bound, MethodInfo, Needs, OptionInfo, Options, Step};
use crate::error::{Error, Result};
use crate::model::beam::FEW;
use crate::system::Problem;
use crate::tableau;

const OPTIONS: &[OptionInfo] = &[
    OptionInfo {
        name: "newton",
        doc: "beams: \"constant\", a preconditioner that is not refreshed (default), or \"full\", \
              the whole Jacobian in each iteration, as the paper has it",
    },
    OptionInfo {
        name: "tolerance",
        doc: "what iterations may leave, in parts of the state: 1e-15 by default; 1e-14 drifts",
    },
];

/// The paper's two-stage method.
pub const SRK2: MethodInfo = MethodInfo {
    name: "srk2",
    aliases: &["srk"],
    summary: "symplectic Runge-Kutta, two midpoint steps of half the size",
    order: Some(2),
    symplectic: true,
    symmetric: true,
    energy_preserving: false,
    needs: Needs::Flow,
    reproducible: "on every machine",
    reference: "Huang, Deng & Yao, J. Sound Vib. 299 (2007), eqs. 25-30",
    options: OPTIONS,
    build: |problem, h, options, _| build("srk2", problem, h, 2, options),
};

/// One midpoint step.
pub const MIDPOINT: MethodInfo = MethodInfo {
    name: "midpoint",
    aliases: &["gauss2"],
    summary: "implicit midpoint rule",
    reference: "Hairer, Lubich & Wanner, Geometric Numerical Integration, II.1.1",
    build: |problem, h, options, _| build("midpoint", problem, h, 1, options),
    ..SRK2
};

fn build(
    name: &'static str,
    problem: &Problem,
    h: f64,
    halves: usize,
    options: &Options,
) -> Result<Box<dyn Step>> {
    let asked = match options.text("newton")? {
        None | Some("constant") => false,
        Some("full") => true,
        Some(other) => {
            return Err(Error::argument(format!(
                "newton: must be \"constant\" or \"full\", got \"{other}\""
            )));
        }
    };
    let tolerance = options.number("tolerance")?;
    if tolerance.is_some_and(|x| !(1e-16..1.0).contains(&x)) {
        return Err(Error::argument("tolerance: must be from 1e-16 to 1"));
    }
    match problem {
        Problem::Beam(beam) if !asked && beam.is_plain() && beam.nodes() <= FEW => {
            let method = modal::ModalMidpoint::new(name, beam, h, halves, tolerance);
            let choice = "modal coordinates: few elements".to_string();
            Ok(Box::new(Bound::new(method, beam.clone(), choice)))
        }
        Problem::Beam(beam) => {
            // Beside a clamped beam of many elements a joint has next to no inertia of its own: what a
            // constant preconditioner leaves out would be magnified.
            let full = asked || beam.angles() == 2;
            let method = beam::BeamMidpoint::new(name, beam, h, halves, full, tolerance)?;
            let choice = if full { "the whole Jacobian" } else { "nodal coordinates" };
            Ok(Box::new(Bound::new(method, beam.clone(), choice.into())))
        }
        _ => {
            let (flow, table) = (problem.flow(), tableau::COLLOCATION2);
            let part = h / halves as f64;
            let method = Gauss::new(name, table, Ending::Rounding, &*flow, part);
            match halves {
                1 => Ok(Box::new(Bound::new(method, flow, String::new()))),
                _ => Ok(Box::new(Bound::new(Halves::new(method, h), flow, String::new()))),
            }
        }
    }
}
