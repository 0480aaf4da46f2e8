//! A load of a run: closed form as matrices, the rest by calls into Python, hundreds of steps each.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use spim::Result;
use spim::system::{Generator, Load};

use crate::convert::{check_finite, real, slice};
use crate::error::from_python;
use crate::expm::shown;

/// An object with `inputs`, `matrix`, `start`, `sampled`, `value(t)`, `impulses(k, count)`.
pub struct Acting {
    object: Py<PyAny>,
    sampled: bool,
}

impl Acting {
    /// Takes the closed form out of the object.
    pub fn new(object: &Bound<'_, PyAny>) -> PyResult<(Acting, Generator)> {
        let numbers = |name: &str| -> PyResult<Vec<f64>> {
            Ok(slice(&real(name, &object.getattr(name)?)?).to_vec())
        };
        let generator = Generator {
            inputs: numbers("inputs")?,
            matrix: numbers("matrix")?,
            start: numbers("start")?,
        };
        let sampled = object.getattr("sampled")?.is_truthy()?;
        Ok((Acting { object: object.clone().unbind(), sampled }, generator))
    }
}

/// Copies an array that Python has returned, which must be finite and have the right size.
fn copy(given: &Bound<'_, PyAny>, out: &mut [f64]) -> PyResult<()> {
    let given = real("load", given)?;
    let numbers = slice(&given);
    if numbers.len() != out.len() {
        return Err(PyValueError::new_err(format!(
            "load: {} numbers expected, got shape {}",
            out.len(),
            shown(given.shape())
        )));
    }
    check_finite("load", given.shape(), numbers)?;
    out.copy_from_slice(numbers);
    Ok(())
}

impl Load for Acting {
    fn value(&self, t: f64, f: &mut [f64]) -> Result<()> {
        Python::attach(|py| {
            let value = self.object.bind(py).call_method1(pyo3::intern!(py, "value"), (t,))?;
            copy(&value, f)
        })
        .map_err(from_python)
    }

    fn is_sampled(&self) -> bool {
        self.sampled
    }

    fn impulses(&self, k: u64, rows: &mut [f64]) -> Result<()> {
        Python::attach(|py| {
            let rows_of = self
                .object
                .bind(py)
                .call_method1(pyo3::intern!(py, "impulses"), (k, rows.len()))?;
            copy(&rows_of, rows)
        })
        .map_err(from_python)
    }
}
