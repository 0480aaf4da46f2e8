//! Matrix work in pairs of doubles for Python code.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use spim::linalg::twofold;

use crate::convert::{self, real, slice_mut};
use crate::error::{guarded, to_python};
use crate::expm::shown;
use crate::watch;

/// `D^-1 B` of square matrices, refined in pairs of doubles and rounded once.
#[pyfunction]
#[allow(non_snake_case)]
pub fn solve<'py>(D: &Bound<'py, PyAny>, B: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = D.py();
    let (d, b) = (real("D", D)?, real("B", B)?);
    let [rows, columns] = *d.shape() else {
        return Err(PyValueError::new_err("D: must be a matrix"));
    };
    if rows != columns || b.shape() != d.shape() || rows == 0 {
        return Err(PyValueError::new_err(format!(
            "D and B: must be square of one size, got {} and {}",
            shown(d.shape()),
            shown(b.shape())
        )));
    }
    let out = convert::empty(py, &[rows, rows])?;
    let (d, b) = (convert::copied("D", &d)?, convert::copied("B", &b)?);
    let target = slice_mut(&out);
    py.detach(|| guarded(|| spim::expm::quotient(rows, &d, &b, target, &mut watch::signals())))?
        .map_err(to_python)?;
    Ok(out.into_any())
}

/// `x^T S x / 2` of vectors, (..., n) -> (...), each rounded once; S symmetric (n, n).
#[pyfunction]
#[allow(non_snake_case)]
pub fn quadratic<'py>(S: &Bound<'py, PyAny>, x: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = S.py();
    let (s, x) = (real("S", S)?, real("x", x)?);
    let n = x.shape().last().copied().unwrap_or(0);
    if s.shape() != [n, n] || n == 0 {
        return Err(PyValueError::new_err(format!(
            "S: must be ({n}, {n}) for vectors of shape {}, got {}",
            shown(x.shape()),
            shown(s.shape())
        )));
    }
    let out = convert::empty(py, &x.shape()[..x.shape().len() - 1])?;
    let (s, x) = (convert::copied("S", &s)?, convert::copied("x", &x)?);
    let forms = slice_mut(&out);
    py.detach(|| {
        guarded(|| {
            let mut signals = watch::signals();
            // Matrices of structures are mostly zeros.
            let rows: Vec<Vec<(usize, f64)>> = s
                .chunks_exact(n)
                .map(|row| row.iter().copied().enumerate().filter(|(_, s)| *s != 0.0).collect())
                .collect();
            for (i, (form, x)) in forms.iter_mut().zip(x.chunks_exact(n)).enumerate() {
                let mut total = [0.0; 2];
                for (row, xi) in rows.iter().zip(x) {
                    let entries = row.iter().map(|(_, s)| *s);
                    let product = twofold::dot(entries, row.iter().map(|(j, _)| x[*j]));
                    total = twofold::sum(total, twofold::times(product, *xi));
                }
                *form = 0.5 * total[0];
                if !form.is_finite() {
                    let text = format!("energy: exceeds 1.8e308 for state {i}");
                    return Err(spim::Error::overflow(text));
                }
                signals()?;
            }
            Ok(())
        })
    })?
    .map_err(to_python)?;
    Ok(out.into_any())
}
