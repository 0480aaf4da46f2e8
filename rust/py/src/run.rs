//! One step at a time, for control and co-simulation.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use spim::linalg::dense;
use spim::linalg::kernel::{Eight, Layout, Product, dispatch, doubles};

use crate::convert::{self, real, slice, slice_mut};
use crate::error::to_python;
use crate::expm::shown;

/// `z <- W z + B u + v`: the step of a linear system under an input that is held.
#[pyclass(module = "spim._core")]
pub struct Stepper {
    /// Where the columns of `[W B]` lie.
    layout: Layout,
    matrix: Vec<Eight>,
    states: usize,
    inputs: usize,
    /// The state and the input, as the product reads them.
    given: Vec<Eight>,
    next: Vec<Eight>,
}

#[pymethods]
#[allow(non_snake_case)]
impl Stepper {
    /// `W` (m, m), `B` (m, r), the first state (m,).
    #[new]
    fn new(W: &Bound<'_, PyAny>, B: &Bound<'_, PyAny>, z: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (w, b, z) = (real("W", W)?, real("B", B)?, real("z", z)?);
        let (&[m, columns], &[rows, inputs]) = (w.shape(), b.shape()) else {
            return Err(PyValueError::new_err("W, B: must be matrices"));
        };
        if m != columns || m != rows || z.shape() != [m] || m == 0 {
            return Err(PyValueError::new_err(format!(
                "W, B, z: sizes do not match: {}, {}, {}",
                shown(w.shape()),
                shown(b.shape()),
                shown(z.shape())
            )));
        }
        let terms = m + inputs;
        let (height, stride) = (m.div_ceil(8), terms.div_ceil(8));
        let layout = Layout { rows: terms, height, stride };
        let mut matrix = dense::zeros(stride * terms).map_err(to_python)?;
        let all = slice(&w).chunks_exact(m).zip(slice(&b).chunks_exact(inputs.max(1)));
        for (i, (w, b)) in all.enumerate() {
            for (j, entry) in w.iter().chain(&b[..inputs]).enumerate() {
                matrix[j * stride + i / 8].0[i % 8] = *entry;
            }
        }
        let mut given = dense::zeros(stride).map_err(to_python)?;
        for (i, z) in slice(&z).iter().enumerate() {
            given[i / 8].0[i % 8] = *z;
        }
        let next = dense::zeros(stride).map_err(to_python)?;
        Ok(Stepper { layout, matrix, states: m, inputs, given, next })
    }

    /// One step with the input `u` (r,), or none, and `v` (m,) added, or nothing; the new state.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        u: Option<&Bound<'py, PyAny>>,
        v: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (m, r) = (self.states, self.inputs);
        let put = |given: &mut [Eight], at: usize, x: f64| given[at / 8].0[at % 8] = x;
        match u {
            None => (m..m + r).for_each(|at| put(&mut self.given, at, 0.0)),
            Some(u) => {
                let u = vector("force", u, r)?;
                let u = slice(&u);
                u.iter().enumerate().for_each(|(i, u)| put(&mut self.given, m + i, *u));
            }
        }
        let a = &self.matrix[..];
        let b = &self.given[..];
        dispatch(Product { layout: self.layout, columns: 1, a, b, add: None, c: &mut self.next });
        if let Some(v) = v {
            let v = vector("load", v, m)?;
            for (i, v) in slice(&v).iter().enumerate() {
                self.next[i / 8].0[i % 8] += v;
            }
        }
        let next = &doubles(&self.next)[..m];
        if !dense::is_finite(next) {
            return Err(to_python(spim::Error::overflow(
                "the state overflows: a component exceeds 1.8e308",
            )));
        }
        let out = convert::empty(py, &[m])?;
        slice_mut(&out).copy_from_slice(next);
        for (i, z) in next.iter().enumerate() {
            put(&mut self.given, i, *z);
        }
        Ok(out.into_any())
    }

    /// The state, (m,); setting it goes on from there.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let out = convert::empty(py, &[self.states])?;
        slice_mut(&out).copy_from_slice(&doubles(&self.given)[..self.states]);
        Ok(out.into_any())
    }

    #[setter]
    fn set_state(&mut self, z: &Bound<'_, PyAny>) -> PyResult<()> {
        let z = vector("state", z, self.states)?;
        for (i, z) in slice(&z).iter().enumerate() {
            self.given[i / 8].0[i % 8] = *z;
        }
        Ok(())
    }
}

fn vector<'py>(
    name: &str,
    given: &Bound<'py, PyAny>,
    len: usize,
) -> PyResult<convert::Doubles<'py>> {
    let given = real(name, given)?;
    if given.shape() != [len] {
        return Err(PyValueError::new_err(format!(
            "{name}: must have shape ({len},), got {}",
            shown(given.shape())
        )));
    }
    convert::check_finite(name, given.shape(), slice(&given))?;
    Ok(given)
}
