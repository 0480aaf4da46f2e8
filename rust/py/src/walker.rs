//! Any system, one step at a time.

use std::sync::{Mutex, MutexGuard, TryLockError};

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use spim::linalg::kernel::{Eight, doubles, doubles_mut};
use spim::method::{self, State, Step, Tangent};

use crate::convert::{self, check_finite, real, slice, slice_mut};
use crate::error::{guarded, to_python};
use crate::expm::shown;
use crate::integrate::{Matrices, options_of, problem_of};
use crate::watch;

/// A method bound to a system, and where it is.
#[pyclass(frozen, module = "spim._core")]
pub struct Walker {
    inner: Mutex<Walking>,
    size: usize,
}

struct Walking {
    method: Box<dyn Step>,
    state: State,
    t0: f64,
    h: f64,
    k: u64,
}

impl Walking {
    fn t(&self) -> f64 {
        self.t0 + self.k as f64 * self.h
    }
}

#[pymethods]
impl Walker {
    /// From `z` at `t` in steps of the signed size `h`; the rest as for `integrate`.
    #[new]
    #[allow(clippy::too_many_arguments)]
    fn new(
        system: &Bound<'_, PyAny>,
        matrices: Option<Matrices<'_>>,
        load: Option<&Bound<'_, PyAny>>,
        z: &Bound<'_, PyAny>,
        t: f64,
        h: f64,
        method: &str,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let py = system.py();
        let info = method::find(method).map_err(to_python)?;
        let problem = problem_of(system, matrices, load, Some(info))?;
        let size = problem.flow().len();
        let start = vector("z0", z, size)?;
        let options = options_of(options)?;
        let make = || -> spim::Result<_> {
            let method = method::build(info, &problem, h, &options, &mut watch::signals())?;
            let state = State::new(&start, &*method)?;
            Ok(Walking { method, state, t0: t, h, k: 0 })
        };
        let inner = py.detach(|| guarded(make))?.map_err(to_python)?;
        Ok(Walker { inner: Mutex::new(inner), size })
    }

    /// One step; the new state, (m,).
    fn step<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut walking = self.free()?;
        let walking = &mut *walking;
        py.detach(|| {
            guarded(|| {
                let (k, t) = (walking.k, walking.t());
                walking.method.step(k, t, &mut walking.state)?;
                walking.k += 1;
                Ok(())
            })
        })?
        .map_err(to_python)?;
        array(py, &walking.state.z)
    }

    /// Begins anew from `z` at `t`.
    fn restart(&self, t: f64, z: &Bound<'_, PyAny>) -> PyResult<()> {
        let z = vector("state", z, self.size)?;
        let mut walking = self.free()?;
        (walking.t0, walking.k) = (t, 0);
        walking.state.z.copy_from_slice(&z);
        walking.state.carried.fill(Eight::ZERO);
        Ok(())
    }

    /// The time reached.
    #[getter]
    fn t(&self) -> PyResult<f64> {
        Ok(self.free()?.t())
    }

    /// The state, (m,).
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array(py, &self.free()?.state.z)
    }

    /// Evaluations of the right side so far.
    #[getter]
    fn evaluations(&self) -> PyResult<u64> {
        Ok(self.free()?.method.work().evaluations)
    }

    /// All there is to go on from: time of the start, step, state and what is carried.
    #[allow(clippy::type_complexity)]
    fn checkpoint<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(f64, u64, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let walking = self.free()?;
        let carried = array(py, doubles(&walking.state.carried))?;
        Ok((walking.t0, walking.k, array(py, &walking.state.z)?, carried))
    }

    /// Goes back to a checkpoint.
    fn restore(
        &self,
        t0: f64,
        k: u64,
        z: &Bound<'_, PyAny>,
        carried: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let z = vector("checkpoint", z, self.size)?;
        let carried = real("checkpoint", carried)?;
        let mut walking = self.free()?;
        let to = doubles_mut(&mut walking.state.carried);
        if to.len() != slice(&carried).len() {
            return Err(PyValueError::new_err("checkpoint: is that of another method"));
        }
        to.copy_from_slice(slice(&carried));
        walking.state.z.copy_from_slice(&z);
        (walking.t0, walking.k) = (t0, k);
        Ok(())
    }

    /// The product, (m, n), of the tangent maps of single steps from states (k, m) at times (k,), put
    /// before `product`, (m, n). The walker is where it was.
    fn tangent<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
        product: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = t.py();
        let (t, z, product) = (real("t", t)?, real("z", z)?, real("product", product)?);
        let m = self.size;
        let (&[rows, columns], &[height, n]) = (z.shape(), product.shape()) else {
            return Err(PyValueError::new_err("z, product: must be matrices"));
        };
        if t.shape() != [rows] || columns != m || height != m || n == 0 || n > m {
            return Err(PyValueError::new_err("t, z, product: sizes do not match"));
        }
        let (times, states) = (convert::copied("t", &t)?, convert::copied("z", &z)?);
        let mut product = convert::copied("product", &product)?;
        let mut walking = self.free()?;
        let walking = &mut *walking;
        py.detach(|| {
            guarded(|| {
                let mut signals = watch::signals();
                let mut tangent = Tangent::new(&walking.state);
                for (t, z) in times.iter().zip(states.chunks_exact(m)) {
                    tangent.apply(&mut *walking.method, *t, z, &mut product)?;
                    signals()?;
                }
                Ok(())
            })
        })?
        .map_err(to_python)?;
        let out = convert::empty(py, &[m, n])?;
        slice_mut(&out).copy_from_slice(&product);
        Ok(out.into_any())
    }
}

impl Walker {
    /// Nobody else may be in the middle of a step.
    fn free(&self) -> PyResult<MutexGuard<'_, Walking>> {
        match self.inner.try_lock() {
            Ok(guard) => Ok(guard),
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => {
                Err(PyRuntimeError::new_err("a step of this run is under way; one at a time"))
            }
        }
    }
}

fn vector(name: &str, given: &Bound<'_, PyAny>, len: usize) -> PyResult<Vec<f64>> {
    let given = real(name, given)?;
    if given.shape() != [len] {
        return Err(PyValueError::new_err(format!(
            "{name}: must have shape ({len},), got {}",
            shown(given.shape())
        )));
    }
    check_finite(name, given.shape(), slice(&given))?;
    convert::copied(name, &given)
}

fn array<'py>(py: Python<'py>, numbers: &[f64]) -> PyResult<Bound<'py, PyAny>> {
    let out = convert::empty(py, &[numbers.len()])?;
    slice_mut(&out).copy_from_slice(numbers);
    Ok(out.into_any())
}
