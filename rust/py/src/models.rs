//! Native nonlinear models for Python code.

use std::sync::Arc;

use pyo3::prelude::*;
use spim::model::pendulum;
use spim::system::{Flow, Hamiltonian};

use crate::error::to_python;
use crate::states;

/// A bead on a spring along a swinging rod, as the core holds it.
#[pyclass(frozen, module = "spim._core")]
pub struct CompoundPendulum {
    /// The model.
    pub model: Arc<pendulum::CompoundPendulum>,
}

#[pymethods]
impl CompoundPendulum {
    #[new]
    fn new(
        rod_mass: f64,
        length: f64,
        bead_mass: f64,
        stiffness: f64,
        gravity: f64,
    ) -> PyResult<Self> {
        let made = pendulum::CompoundPendulum::new(rod_mass, length, bead_mass, stiffness, gravity);
        Ok(CompoundPendulum { model: Arc::new(made.map_err(to_python)?) })
    }

    /// Length of the state.
    #[getter]
    fn size(&self) -> usize {
        self.model.len()
    }

    /// Energies of states (k, 4) at times (k,) -> (k, 1).
    fn energies<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let model = &self.model;
        states::map(model.len(), t, z, 1, |t, z, out| {
            out[0] = model.energy(t, z)?;
            Ok(())
        })
    }

    /// `z'` of states (k, 4) at times (k,).
    fn rate<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let model = &self.model;
        states::map(model.len(), t, z, model.len(), |t, z, out| model.rate(t, z, out))
    }
}
