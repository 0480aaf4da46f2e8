//! The Python module `spim._core`: arguments in, arrays out, nothing computed here.

mod beam;
mod callback;
mod convert;
mod error;
mod expm;
mod flows;
mod integrate;
mod load;
mod matrices;
mod models;
mod phi;
mod propagator;
mod run;
mod states;
mod walker;
mod watch;

use pyo3::prelude::*;

/// The compiled core of spim.
#[pymodule]
mod _core {
    #[pymodule_export]
    use super::beam::RotatingBeam;
    #[pymodule_export]
    use super::callback::{Called, jacobian, rates};
    #[pymodule_export]
    use super::error::{
        ConvergenceError, InternalError, ModelError, PrecisionWarning, SingularMatrixError,
        SpimError, UnsupportedError, caught_panics,
    };
    #[pymodule_export]
    use super::expm::expm;
    #[pymodule_export]
    use super::flows::Flows;
    #[pymodule_export]
    use super::integrate::{Linear, grid, integrate, methods};
    #[pymodule_export]
    use super::matrices::{apply, energy_coordinates, quadratic, solve};
    #[pymodule_export]
    use super::models::Model;
    #[pymodule_export]
    use super::phi::phi;
    #[pymodule_export]
    use super::propagator::Propagator;
    #[pymodule_export]
    use super::run::Stepper;
    #[pymodule_export]
    use super::walker::Walker;
    #[pymodule_export]
    use super::{build_info, kernel_level};
}

/// Reads or forces the instruction set of the kernels.
///
/// Results are the same bits at every level; the slower ones are for tests and for seeing that it
/// is so.
///
/// Parameters
/// ----------
/// level : {"auto", "avx512", "avx2", "portable"}, optional
///     What to use from now on, in all threads. None only reads.
///
/// Returns
/// -------
/// str
///     The level in use.
///
/// Raises
/// ------
/// ValueError
///     Not a level, or one this machine does not have.
#[pyfunction]
#[pyo3(signature = (level=None))]
fn kernel_level(level: Option<&str>) -> PyResult<&'static str> {
    use spim::linalg::kernel::{self, Level};
    let Some(name) = level else {
        return Ok(kernel::level().name());
    };
    if name == "auto" {
        return Ok(kernel::force(None).name());
    }
    let wanted = Level::ALL.into_iter().find(|level| level.name() == name).ok_or_else(|| {
        pyo3::exceptions::PyValueError::new_err(format!(
            "level: must be \"auto\", \"avx512\", \"avx2\" or \"portable\", got {name:?}"
        ))
    })?;
    if wanted > kernel::best() {
        return Err(pyo3::exceptions::PyValueError::new_err(format!(
            "level: this machine has no {name}; its best is {}",
            kernel::best().name()
        )));
    }
    Ok(kernel::force(Some(wanted)).name())
}

/// Version, profile and target of the compiled core.
#[pyfunction]
fn build_info() -> (&'static str, &'static str, String) {
    let profile = if cfg!(debug_assertions) { "debug" } else { "release" };
    let target = format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS);
    (env!("CARGO_PKG_VERSION"), profile, target)
}
