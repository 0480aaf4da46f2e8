//! Gauss methods: collocation at Gauss points, of the highest order there is, symplectic and symmetric.

mod beam;
mod columns;
mod ending;
mod iteration;
mod linear_part;
mod stages;

pub use self::columns::{Columns, matrix, product, weights};
pub use self::ending::{Changes, Ending, ROUNDOFF, count, ending};
pub use self::stages::Gauss;
use super::{Bound, MethodInfo, Needs, Options, Step};
use crate::error::Result;
use crate::system::Problem;
use crate::tableau::{self, Collocation};

/// Two stages.
pub const GAUSS4: MethodInfo = MethodInfo {
    name: "gauss4",
    aliases: &[],
    summary: "Gauss collocation, 2 stages",
    order: Some(4),
    symplectic: true,
    symmetric: true,
    energy_preserving: false,
    needs: Needs::Flow,
    reproducible: "on every machine",
    reference: "Hairer, McLachlan & Razakarivony, BIT 48 (2008)",
    options: &[ROUNDOFF],
    build: |problem, h, options, _| build("gauss4", tableau::COLLOCATION4, problem, h, options),
};

/// Three stages.
pub const GAUSS6: MethodInfo = MethodInfo {
    name: "gauss6",
    summary: "Gauss collocation, 3 stages",
    order: Some(6),
    build: |problem, h, options, _| build("gauss6", tableau::COLLOCATION6, problem, h, options),
    ..GAUSS4
};

/// Four stages.
pub const GAUSS8: MethodInfo = MethodInfo {
    name: "gauss8",
    summary: "Gauss collocation, 4 stages",
    order: Some(8),
    build: |problem, h, options, _| build("gauss8", tableau::COLLOCATION8, problem, h, options),
    ..GAUSS4
};

/// Six stages.
pub const GAUSS12: MethodInfo = MethodInfo {
    name: "gauss12",
    summary: "Gauss collocation, 6 stages",
    order: Some(12),
    build: |problem, h, options, _| build("gauss12", tableau::COLLOCATION12, problem, h, options),
    ..GAUSS4
};

/// Eight stages.
pub const GAUSS16: MethodInfo = MethodInfo {
    name: "gauss16",
    summary: "Gauss collocation, 8 stages",
    order: Some(16),
    build: |problem, h, options, _| build("gauss16", tableau::COLLOCATION16, problem, h, options),
    ..GAUSS4
};

/// Twelve stages.
pub const GAUSS24: MethodInfo = MethodInfo {
    name: "gauss24",
    summary: "Gauss collocation, 12 stages",
    order: Some(24),
    build: |problem, h, options, _| build("gauss24", tableau::COLLOCATION24, problem, h, options),
    ..GAUSS4
};

/// Sixteen stages.
pub const GAUSS32: MethodInfo = MethodInfo {
    name: "gauss32",
    summary: "Gauss collocation, 16 stages",
    order: Some(32),
    build: |problem, h, options, _| build("gauss32", tableau::COLLOCATION32, problem, h, options),
    ..GAUSS4
};

/// Makes a Gauss method for whatever system.
pub fn build(
    name: &'static str,
    table: Collocation,
    problem: &Problem,
    h: f64,
    options: &Options,
) -> Result<Box<dyn Step>> {
    let ending = ending(options)?;
    if let (Problem::Beam(beam), Some(tableau)) = (problem, tableau::gauss(table.b.len()))
        && beam.is_plain()
        && beam.nodes() <= beam::MOST
    {
        let method = beam::GaussBeam::new(name, tableau, beam, h)?;
        let choice = "modes of beam and hub, solved within the stages".to_string();
        return Ok(Box::new(Bound::new(method, beam.clone(), choice)));
    }
    let flow = problem.flow();
    let method = Gauss::new(name, table, ending, &*flow, h);
    Ok(Box::new(Bound::new(method, flow, String::new())))
}
