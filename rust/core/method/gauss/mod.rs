//! Gauss methods: collocation at Gauss points, of the highest order there is, symplectic and symmetric.

mod beam;

use super::{Bound, MethodInfo, Needs, Step, runge_kutta};
use crate::error::Result;
use crate::linalg::dense::Watch;
use crate::system::Problem;
use crate::tableau::{self, Tableau};

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
    reference: "Hairer, Lubich & Wanner, Geometric Numerical Integration, II.1.3",
    options: &[],
    build: |problem, h, _, watch| build("gauss4", tableau::GAUSS4, problem, h, watch),
};

/// Three stages.
pub const GAUSS6: MethodInfo = MethodInfo {
    name: "gauss6",
    summary: "Gauss collocation, 3 stages",
    order: Some(6),
    build: |problem, h, _, watch| build("gauss6", tableau::GAUSS6, problem, h, watch),
    ..GAUSS4
};

/// Four stages.
pub const GAUSS8: MethodInfo = MethodInfo {
    name: "gauss8",
    summary: "Gauss collocation, 4 stages",
    order: Some(8),
    build: |problem, h, _, watch| build("gauss8", tableau::GAUSS8, problem, h, watch),
    ..GAUSS4
};

/// Six stages.
pub const GAUSS12: MethodInfo = MethodInfo {
    name: "gauss12",
    summary: "Gauss collocation, 6 stages",
    order: Some(12),
    build: |problem, h, _, watch| build("gauss12", tableau::GAUSS12, problem, h, watch),
    ..GAUSS4
};

/// Eight stages.
pub const GAUSS16: MethodInfo = MethodInfo {
    name: "gauss16",
    summary: "Gauss collocation, 8 stages",
    order: Some(16),
    build: |problem, h, _, watch| build("gauss16", tableau::GAUSS16, problem, h, watch),
    ..GAUSS4
};

fn build(
    name: &'static str,
    tableau: Tableau,
    problem: &Problem,
    h: f64,
    watch: &mut Watch,
) -> Result<Box<dyn Step>> {
    match problem {
        Problem::Beam(beam) if beam.is_plain() && beam.nodes() <= beam::MOST => {
            let method = beam::GaussBeam::new(name, tableau, beam, h)?;
            let choice = "modes of beam and hub, solved within the stages".to_string();
            Ok(Box::new(Bound::new(method, beam.clone(), choice)))
        }
        _ => runge_kutta::build(name, tableau.into(), problem, h, watch),
    }
}
