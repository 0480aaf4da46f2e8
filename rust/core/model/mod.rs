//! Models, one a file or a folder. A new one is a file and, if it is made of numbers alone, a line in
//! [`MODELS`].

pub mod beam;
pub mod double_pendulum;
pub mod fput;
pub mod henon_heiles;
pub mod kepler;
pub mod pendulum;
pub mod solar_system;

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::system::{Hamiltonian, Problem};

/// A model as methods see it, and its energy.
#[derive(Clone)]
pub struct Native {
    /// The system.
    pub problem: Problem,
    /// The same, with its energy.
    pub hamiltonian: Arc<dyn Hamiltonian>,
}

/// Makes a model of its parameters.
pub type Make = fn(&[f64]) -> Result<Native>;

/// Models made of numbers alone, by name.
pub const MODELS: &[(&str, Make)] = &[
    ("compound pendulum", pendulum::make),
    ("double pendulum", double_pendulum::make),
    ("fput", fput::make),
    ("henon-heiles", henon_heiles::make),
    ("kepler", kepler::make),
    ("outer solar system", solar_system::make),
];

/// Makes a model.
///
/// # Errors
/// [`Error::Argument`] for a name there is not; those of the model.
pub fn named(name: &str, parameters: &[f64]) -> Result<Native> {
    match MODELS.iter().find(|(known, _)| *known == name) {
        Some((_, make)) => make(parameters),
        None => Err(Error::argument(format!("model: there is no '{name}'"))),
    }
}

/// The parameters of a model that has `N`, named in `names`: positive and finite.
fn positive<const N: usize>(names: [&str; N], given: &[f64]) -> Result<[f64; N]> {
    let given: [f64; N] = given
        .try_into()
        .map_err(|_| Error::argument(format!("model: {N} parameters are needed")))?;
    for (name, x) in names.into_iter().zip(given) {
        if !(x > 0.0 && x.is_finite()) {
            return Err(Error::argument(format!("{name}: must be positive and finite, got {x}")));
        }
    }
    Ok(given)
}

/// A separable model.
fn separable<M: Hamiltonian + crate::system::Separable + 'static>(model: M) -> Native {
    let model = Arc::new(model);
    Native { problem: Problem::Separable(model.clone()), hamiltonian: model }
}

/// Whether rates are those of the energy: the largest difference from central differences.
#[cfg(test)]
fn rate_defect(model: &dyn Hamiltonian, z: &[f64]) -> f64 {
    let (n, d) = (z.len() / 2, 1e-4);
    let mut f = vec![0.0; z.len()];
    model.rate(0.0, z, &mut f).unwrap();
    let mut worst = 0.0_f64;
    for i in 0..z.len() {
        let at = |shift: f64| {
            let mut moved = z.to_vec();
            moved[i] += shift * d;
            model.energy(0.0, &moved).unwrap()
        };
        let slope = (at(-2.0) - 8.0 * at(-1.0) + 8.0 * at(1.0) - at(2.0)) / (12.0 * d);
        let rate = if i < n { -f[i + n] } else { f[i - n] };
        worst = worst.max((slope - rate).abs());
    }
    worst
}
