//! Energy flows for Python code.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use spim::expm::MOST_FORMS;

use crate::convert::{self, real, slice_mut};
use crate::error::{guarded, to_python};
use crate::watch;

/// Integrals of `exp(A s)^T Q exp(A s)` over `0 < s < tau`, or `tau < s < 0`, for symmetric forms Q.
#[pyclass(module = "spim._core", frozen)]
pub struct Flows(spim::expm::Flows);

#[pymethods]
#[allow(non_snake_case)]
impl Flows {
    /// `A` (m, m), `forms` (f, m, m).
    #[new]
    fn new(A: &Bound<'_, PyAny>, tau: f64, forms: &Bound<'_, PyAny>) -> PyResult<Flows> {
        let (a, forms) = (real("A", A)?, real("forms", forms)?);
        let m = a.shape().first().copied().unwrap_or(0);
        let count = forms.shape().first().copied().unwrap_or(0);
        if m == 0 || a.shape() != [m, m] || forms.shape() != [count, m, m] || count > MOST_FORMS {
            return Err(PyValueError::new_err("Flows: sizes do not match"));
        }
        let (a, forms) = (convert::copied("A", &a)?, convert::copied("forms", &forms)?);
        let made = A.py().detach(|| {
            guarded(|| spim::expm::Flows::new(m, &a, tau, &forms, &mut watch::signals()))
        })?;
        Ok(Flows(made.map_err(to_python)?))
    }

    /// `x^T N x` of states, (k, m) -> (f, k), summed in pairs of doubles.
    fn totals<'py>(&self, states: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = states.py();
        let given = real("states", states)?;
        let &[count, rows] = given.shape() else {
            return Err(PyValueError::new_err("states: must have shape (k, m)"));
        };
        if rows != self.0.rows() {
            return Err(PyValueError::new_err("states: must have shape (k, m)"));
        }
        let states = convert::copied("states", &given)?;
        let out = convert::empty(py, &[self.0.count(), count])?;
        let totals = slice_mut(&out);
        py.detach(|| guarded(|| self.0.totals(&states, totals, &mut watch::signals())))?
            .map_err(to_python)?;
        Ok(out.into_any())
    }
}
