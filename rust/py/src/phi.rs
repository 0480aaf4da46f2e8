//! `spim.phi` and what Python code makes of it.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use spim::expm::{HIGHEST_PHI, Recipe, Scheme, phis};

use crate::convert::{self, real, slice, slice_mut};
use crate::error::{guarded, to_python};
use crate::expm::{square, warn_of_size};
use crate::watch;

/// The functions phi_0 .. phi_k of a square matrix, or of each of a stack of them.
///
/// phi_0 = exp, phi_k(A) = sum over j of A^j / (j + k)!: what constant, linear, ... loads do to a
/// linear system in one step. No inverse is formed, so that singular matrices are no exception.
///
/// Parameters
/// ----------
/// A : array_like (..., m, m)
///     Real.
/// k : int
///     0 to 8.
/// tau : float, optional
///     The functions are those of the exact product of `tau` and `A`. Default 1.
///
/// Returns
/// -------
/// list of ndarray (..., m, m)
///     k + 1 of them. To 32 rows in pairs of doubles, each entry rounded once; above in doubles.
///
/// Raises
/// ------
/// ValueError
///     Not square, or an entry that is not finite; `k` above 8.
/// TypeError
///     Not real numbers.
/// OverflowError
///     An entry of a result exceeds 1.8e308.
///
/// Warns
/// -----
/// PrecisionWarning
///     As `expm`.
#[pyfunction]
#[pyo3(signature = (A, k, *, tau=None), text_signature = "(A, k, *, tau=1.0)")]
#[allow(non_snake_case)]
pub fn phi<'py>(
    A: &Bound<'py, PyAny>,
    k: &Bound<'py, PyAny>,
    tau: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyList>> {
    let py = A.py();
    let tau = tau.map_or(Ok(1.0), |tau| convert::number("tau", tau))?;
    let a = real("A", A)?;
    let shape = a.shape();
    let rows = square(shape)?;
    convert::check_finite("A", shape, slice(&a))?;
    if !tau.is_finite() {
        return Err(PyValueError::new_err(format!("tau: must be finite, got {tau}")));
    }
    let k = convert::count("k", k)?;
    if k > HIGHEST_PHI as u64 {
        return Err(PyValueError::new_err(format!("k: must be 0 to {HIGHEST_PHI}, got {k}")));
    }
    // phi_1 is made even where only phi_0 is asked for.
    let count = (k as usize).max(1) + 1;
    let arrays = (0..count).map(|_| convert::empty(py, shape)).collect::<PyResult<Vec<_>>>()?;
    let recipe = Recipe::auto(rows);
    let size = rows * rows;
    let mut largest = 0.0_f64;
    if size > 0 {
        let pairs = recipe.scheme == Scheme::Exact;
        let copy = convert::copied("A", &a)?;
        let mut outs: Vec<_> =
            arrays.iter().map(|out| slice_mut(out).chunks_exact_mut(size)).collect();
        py.detach(|| {
            guarded(|| {
                let mut signals = watch::signals();
                for a in copy.chunks_exact(size) {
                    let mut outs: Vec<_> =
                        outs.iter_mut().map(|out| out.next().expect("as long as A")).collect();
                    let norm = phis(rows, pairs, a, tau, &mut outs, &mut signals)?;
                    signals()?;
                    largest = largest.max(norm);
                }
                Ok(())
            })
        })?
        .map_err(to_python)?;
        warn_of_size(py, rows, recipe, largest, tau, slice(&a))?;
    }
    PyList::new(py, &arrays[..=k as usize])
}
