//! Matrix work in pairs of doubles for Python code.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use spim::linalg::{cholesky, twofold};
use spim::system::EnergyCoordinates;

use crate::convert::{self, real, slice, slice_mut};
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

/// Leading parts and remainders of pairs, as matrices of `n` rows.
type Halves<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>);

/// Energy coordinates of a structure: `B`; `F^T`, `F^-T`; `L^-1`, `L`, each as a matrix of leading
/// parts and one of remainders.
#[pyfunction]
#[allow(non_snake_case)]
pub fn energy_coordinates<'py>(
    M: &Bound<'py, PyAny>,
    K: &Bound<'py, PyAny>,
) -> PyResult<[Halves<'py>; 5]> {
    let py = M.py();
    let (m, k) = (real("M", M)?, real("K", K)?);
    let n = m.shape()[0];
    if m.shape() != [n, n] || k.shape() != [n, n] {
        return Err(PyValueError::new_err("M and K: must be square and of one size"));
    }
    let (m, k) = (convert::copied("M", &m)?, convert::copied("K", &k)?);
    let found = py.detach(|| guarded(|| EnergyCoordinates::new(n, &m, &k)))?.map_err(to_python)?;
    let [strain, back] = &found.strain;
    let [momentum, forth] = &found.momentum;
    let halves = |pairs: &Vec<[f64; 2]>| -> PyResult<Halves<'py>> {
        let part = |which: usize| -> PyResult<Bound<'py, PyAny>> {
            let out = convert::empty(py, &[n, n])?;
            for (out, pair) in slice_mut(&out).iter_mut().zip(pairs) {
                *out = pair[which];
            }
            Ok(out.into_any())
        };
        Ok((part(0)?, part(1)?))
    };
    Ok([
        halves(&found.coupling)?,
        halves(strain)?,
        halves(back)?,
        halves(momentum)?,
        halves(forth)?,
    ])
}

/// `(hi + lo) x`, each component rounded once; hi and lo (n, n), x (n,).
#[pyfunction]
pub fn apply<'py>(
    hi: &Bound<'py, PyAny>,
    lo: &Bound<'py, PyAny>,
    x: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = hi.py();
    let (hi, lo, x) = (real("hi", hi)?, real("lo", lo)?, real("x", x)?);
    let n = x.shape().first().copied().unwrap_or(0);
    if n == 0 || hi.shape() != [n, n] || lo.shape() != [n, n] {
        return Err(PyValueError::new_err("apply: sizes do not match"));
    }
    let out = convert::empty(py, &[n])?;
    let x: Vec<_> = slice(&x).iter().map(|&x| [x, 0.0]).collect();
    let rows = slice(&hi).chunks_exact(n).zip(slice(&lo).chunks_exact(n));
    for (out, (hi, lo)) in slice_mut(&out).iter_mut().zip(rows) {
        let row: Vec<_> = hi.iter().zip(lo).map(|(&hi, &lo)| [hi, lo]).collect();
        *out = cholesky::dot(&row, &x)[0];
    }
    Ok(out.into_any())
}
