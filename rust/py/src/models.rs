//! Native nonlinear models for Python code.

use pyo3::prelude::*;
use spim::model::{self, Native};

use crate::convert::{self, real, slice};
use crate::error::to_python;
use crate::states;

/// A model made of numbers, as the core holds it.
#[pyclass(frozen, module = "spim._core")]
pub struct Model {
    /// The model.
    pub native: Native,
}

#[pymethods]
impl Model {
    /// By name, of its parameters.
    #[new]
    fn new(name: &str, parameters: &Bound<'_, PyAny>) -> PyResult<Self> {
        let parameters = real("parameters", parameters)?;
        let native = model::named(name, slice(&parameters)).map_err(to_python)?;
        Ok(Model { native })
    }

    /// Length m of the state.
    #[getter]
    fn size(&self) -> usize {
        self.native.hamiltonian.len()
    }

    /// The linear part (m, m) that exponential methods turn with; None where there is none.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(system) = self.native.problem.semilinear() else { return Ok(None) };
        let matrix = convert::empty(py, &[system.len(), system.len()])?;
        convert::slice_mut(&matrix).copy_from_slice(system.matrix());
        Ok(Some(matrix.into_any()))
    }

    /// Energies of states (k, m) at times (k,) -> (k, 1).
    fn energies<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let model = &self.native.hamiltonian;
        states::map(model.len(), t, z, 1, |t, z, out| {
            out[0] = model.energy(t, z)?;
            Ok(())
        })
    }

    /// `z'` of states (k, m) at times (k,).
    fn rate<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let model = &self.native.hamiltonian;
        states::map(model.len(), t, z, model.len(), |t, z, out| model.rate(t, z, out))
    }
}
