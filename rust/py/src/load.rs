//! A load of a run: closed form as matrices, the rest by calls into Python, hundreds of steps each.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use spim::Result;
use spim::system::{Generator, Load, Record};

use crate::convert::{self, check_finite, real, slice};
use crate::error::{from_python, to_python};
use crate::expm::shown;

/// An object with `inputs`, `matrix`, `start`, `records`, `sampled`, `value(t)`, `impulses(k,
/// count)`; records are tuples of values, first step, and one or two arrays of weights.
pub struct Acting {
    object: Py<PyAny>,
    records: Vec<Record>,
    /// Whether there are impulses beyond those of the records.
    sampled: bool,
}

impl Acting {
    /// For methods that ask for values alone.
    pub fn of_values(object: &Bound<'_, PyAny>) -> Acting {
        Acting { object: object.clone().unbind(), records: Vec::new(), sampled: false }
    }

    /// For methods that step by exponentials, with the closed form taken out of the object.
    pub fn of_steps(object: &Bound<'_, PyAny>) -> PyResult<(Acting, Generator)> {
        let numbers = |name: &str| -> PyResult<Vec<f64>> {
            Ok(slice(&real(name, &object.getattr(name)?)?).to_vec())
        };
        let generator = Generator {
            inputs: numbers("inputs")?,
            matrix: numbers("matrix")?,
            start: numbers("start")?,
        };
        let sampled = object.getattr("sampled")?.is_truthy()?;
        let len = object.getattr("width")?.extract()?;
        let mut records = Vec::new();
        for record in object.getattr("records")?.try_iter()? {
            let (values, begin, early, late): (
                Bound<'_, PyAny>,
                i64,
                Bound<'_, PyAny>,
                Option<Bound<'_, PyAny>>,
            ) = record?.extract()?;
            let values = real("values", &values)?;
            let weights = |given: &Bound<'_, PyAny>| -> PyResult<Vec<f64>> {
                Ok(slice(&real("weights", given)?).to_vec())
            };
            let late = late.map_or(Ok(Vec::new()), |late| weights(&late))?;
            let (samples, width) = (convert::copied("values", &values)?, values.shape()[1]);
            let record = Record::new(samples, width, begin, [weights(&early)?, late], len);
            records.push(record.map_err(to_python)?);
        }
        Ok((Acting { object: object.clone().unbind(), records, sampled }, generator))
    }
}

/// Copies an array that Python has returned, which must have the right size and be finite unless
/// something has failed.
fn copy(given: &Bound<'_, PyAny>, out: &mut [f64], failed: bool) -> PyResult<()> {
    let given = real("load", given)?;
    let numbers = slice(&given);
    if numbers.len() != out.len() {
        return Err(PyValueError::new_err(format!(
            "load: {} numbers expected, got shape {}",
            out.len(),
            shown(given.shape())
        )));
    }
    if !failed {
        check_finite("load", given.shape(), numbers)?;
    }
    out.copy_from_slice(numbers);
    Ok(())
}

impl Load for Acting {
    fn value(&self, t: f64, f: &mut [f64]) -> Result<()> {
        Python::attach(|py| {
            let value = self.object.bind(py).call_method1(pyo3::intern!(py, "value"), (t,))?;
            copy(&value, f, false)
        })
        .map_err(from_python)
    }

    fn grid_values(&self, k: u64, rows: &mut [f64]) -> Result<()> {
        Python::attach(|py| {
            let call = (k, rows.len());
            let name = pyo3::intern!(py, "grid_values");
            copy(&self.object.bind(py).call_method1(name, call)?, rows, false)
        })
        .map_err(from_python)
    }

    fn is_sampled(&self) -> bool {
        self.sampled || !self.records.is_empty()
    }

    fn records(&self) -> Option<&[Record]> {
        (!self.sampled).then_some(&self.records)
    }

    fn impulses(&self, k: u64, rows: &mut [f64]) -> Result<()> {
        rows.fill(0.0);
        if self.sampled {
            self.called(k, rows)?;
        }
        self.records.iter().try_for_each(|record| record.add(k, rows))
    }
}

impl Acting {
    fn called(&self, k: u64, rows: &mut [f64]) -> Result<()> {
        Python::attach(|py| {
            let rows_of = self
                .object
                .bind(py)
                .call_method1(pyo3::intern!(py, "impulses"), (k, rows.len()))?;
            // After a failure the rows of the steps it spoils are no numbers.
            let failed = !self.object.bind(py).getattr(pyo3::intern!(py, "failure"))?.is_none();
            copy(&rows_of, rows, failed)
        })
        .map_err(from_python)
    }
}
