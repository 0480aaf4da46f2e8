//! Functions of many states at once.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use spim::Result;

use crate::convert::{self, real, slice_mut};
use crate::error::{guarded, to_python};
use crate::expm::shown;
use crate::watch;

/// What `make` writes of each state (k, m) at its time (k,): (k, width).
pub fn map<'py>(
    m: usize,
    t: &Bound<'py, PyAny>,
    z: &Bound<'py, PyAny>,
    width: usize,
    make: impl Fn(f64, &[f64], &mut [f64]) -> Result<()> + Sync,
) -> PyResult<Bound<'py, PyAny>> {
    let py = z.py();
    let (t, z) = (real("t", t)?, real("z", z)?);
    if z.shape().len() != 2 || z.shape()[1] != m || t.shape() != [z.shape()[0]] {
        return Err(PyValueError::new_err(format!(
            "z, t: must have shapes (k, {m}) and (k,), got {} and {}",
            shown(z.shape()),
            shown(t.shape())
        )));
    }
    let out = convert::empty(py, &[z.shape()[0], width])?;
    let (t, z) = (convert::copied("t", &t)?, convert::copied("z", &z)?);
    let rows = slice_mut(&out);
    py.detach(|| {
        guarded(|| {
            let mut signals = watch::signals();
            let states = t.iter().zip(z.chunks_exact(m));
            for ((t, z), out) in states.zip(rows.chunks_exact_mut(width)) {
                make(*t, z, out)?;
                signals()?;
            }
            Ok(())
        })
    })?
    .map_err(to_python)?;
    Ok(out.into_any())
}
