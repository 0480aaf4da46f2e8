//! Python functions: `f(t, x)` that returns its result, or `f(t, x, out)` that writes it; of one state,
//! or vectorised, of all at once.
//!
//! Arrays go on to the next call where the function has kept none of them.

use std::sync::{Mutex, PoisonError};

use numpy::PyUntypedArrayMethods;
use pyo3::PyVisit;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::pyclass::PyTraverseError;
use pyo3::types::{PyFloat, PyList, PyTuple};
use spim::Result;
use spim::linalg::kernel::Eight;

use super::function::{Columns, not_finite};
use super::vectorcall::call;
use crate::convert::{Kept, real, slice};
use crate::error::from_python;
use crate::expm::shown;

/// Arrays that wait for a next call, at most: one set a thread and number of states.
const WAITING: usize = 16;

/// A function and how it is called.
pub struct Called {
    call: Py<PyAny>,
    args: Vec<Py<PyAny>>,
    writes: bool,
    vectorized: bool,
    inputs: usize,
    outputs: Vec<usize>,
    waiting: Mutex<Vec<Arrays>>,
}

/// What a call is made with.
struct Arrays {
    /// States.
    count: usize,
    /// Times, of a vectorised function.
    t: Option<Kept>,
    x: Kept,
    out: Option<Kept>,
}

impl Called {
    pub fn new(
        call: Py<PyAny>,
        args: Vec<Py<PyAny>>,
        writes: bool,
        vectorized: bool,
        inputs: usize,
        outputs: Vec<usize>,
    ) -> Called {
        Called { call, args, writes, vectorized, inputs, outputs, waiting: Mutex::default() }
    }

    pub fn traverse(&self, visit: &PyVisit<'_>) -> std::result::Result<(), PyTraverseError> {
        visit.call(&self.call)?;
        self.args.iter().try_for_each(|arg| visit.call(arg))
    }

    /// Shape of what `count` states give.
    fn shape(&self, count: usize) -> Vec<usize> {
        let mut shape = self.outputs.clone();
        if self.vectorized {
            shape.push(count);
        }
        shape
    }

    /// Arrays for `count` states.
    fn arrays(&self, py: Python<'_>, count: usize) -> PyResult<Arrays> {
        {
            let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(at) = waiting.iter().rposition(|arrays| arrays.count == count) {
                return Ok(waiting.swap_remove(at));
            }
        }
        let states: &[usize] = if self.vectorized { &[count] } else { &[] };
        let t = self.vectorized.then(|| Kept::new(py, states)).transpose()?;
        let x = Kept::new(py, &[&[self.inputs], states].concat())?;
        let out = self.writes.then(|| Kept::new(py, &self.shape(count))).transpose()?;
        Ok(Arrays { count, t, x, out })
    }

    /// Leaves arrays to the next call, if nobody else has them.
    fn leave(&self, py: Python<'_>, arrays: Arrays) {
        let Arrays { t, x, out, .. } = &arrays;
        if [t.as_ref(), Some(x), out.as_ref()].into_iter().flatten().all(|kept| kept.is_free(py)) {
            let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
            if waiting.len() < WAITING {
                waiting.push(arrays);
            }
        }
    }

    /// Calls with what `fill` writes into times and components; `take` gets the result, in C order.
    fn run(
        &self,
        py: Python<'_>,
        name: &str,
        count: usize,
        first: f64,
        fill: impl FnOnce(&mut [f64], &mut [f64]),
        take: impl FnOnce(&[f64]) -> PyResult<()>,
    ) -> PyResult<()> {
        let arrays = self.arrays(py, count)?;
        let times = arrays.t.as_ref().map(|t| t.slice_mut(py));
        fill(times.unwrap_or_default(), arrays.x.slice_mut(py));
        let time = match &arrays.t {
            Some(t) => t.array(py).clone(),
            None => PyFloat::new(py, first).into_any(),
        };
        let args = self.args.iter().map(|arg| arg.bind(py));
        match &arrays.out {
            Some(out) => {
                // What a function forgets to write must not pass for a number.
                out.slice_mut(py).fill(f64::NAN);
                let given = [&time, arrays.x.array(py), out.array(py)];
                let returned = call(self.call.bind(py), given.into_iter().chain(args))?;
                let written = out.numbers(py).ok_or_else(|| {
                    PyValueError::new_err(format!(
                        "{name}: `out` has another shape or type than it was given at t = {first}; \
                         write to it as out[:] = ..."
                    ))
                })?;
                if !returned.is_none() && written.iter().all(|x| x.is_nan()) {
                    return Err(PyValueError::new_err(format!(
                        "{name}: has three arguments, so that it must write its result to the third, \
                         and has written nothing at t = {first}; give what else it takes as args=(...)"
                    )));
                }
                take(written)?;
            }
            None => {
                let given = [&time, arrays.x.array(py)];
                let result = call(self.call.bind(py), given.into_iter().chain(args))?;
                self.read(name, count, first, &result, take)?;
            }
        }
        drop(time);
        self.leave(py, arrays);
        Ok(())
    }

    /// The numbers of a result.
    fn read(
        &self,
        name: &str,
        count: usize,
        t: f64,
        result: &Bound<'_, PyAny>,
        take: impl FnOnce(&[f64]) -> PyResult<()>,
    ) -> PyResult<()> {
        let shape = self.shape(count);
        let size = shape.iter().product::<usize>();
        let mut few = [0.0; 16];
        if shape.len() <= 1 && size <= few.len() && floats(result, &mut few[..size]) {
            return take(&few[..size]);
        }
        if result.is_none() {
            return Err(PyTypeError::new_err(format!(
                "{name}: returned None at t = {t}; return the numbers, or take a third argument, an \
                 array to write them to"
            )));
        }
        let array = real(name, result)?;
        // One number may come as such.
        let scalar = size == 1 && self.outputs.len() == 1 && array.shape().is_empty();
        // Sums over components, as energies are, lack the axis of one.
        let row = self.outputs == [1] && self.vectorized && array.shape() == [count];
        if array.shape() != shape && !scalar && !row {
            return Err(PyValueError::new_err(format!(
                "{name}: must give {size} numbers, shape {}, gave shape {} at t = {t}",
                shown(&shape),
                shown(array.shape())
            )));
        }
        take(slice(&array))
    }

    /// The result for one state.
    pub fn one(&self, name: &str, t: f64, x: &[f64], out: &mut [f64]) -> Result<()> {
        let fill = |times: &mut [f64], to: &mut [f64]| {
            times.fill(t);
            to.copy_from_slice(x);
        };
        let take = |numbers: &[f64]| {
            out.copy_from_slice(numbers);
            Ok(())
        };
        Python::attach(|py| self.run(py, name, 1, t, fill, take)).map_err(from_python)
    }

    /// The results for many states.
    pub fn many(
        &self,
        name: &str,
        given: &Columns,
        f: &mut [Eight],
        to: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        let outputs = self.outputs.iter().product::<usize>();
        let (count, stride) = (given.count, given.stride);
        if !self.vectorized {
            let (x, rest) = scratch.split_at_mut(given.inputs);
            let out = &mut rest[..outputs];
            return Python::attach(|_| {
                for at in 0..count {
                    let (block, lane) = (at / 8, at % 8);
                    let t = given.t[block].0[lane];
                    let z = &given.z[stride * block + given.from..][..given.inputs];
                    x.iter_mut().zip(z).for_each(|(x, z)| *x = z.0[lane]);
                    self.one(name, t, x, out)?;
                    let f = &mut f[stride * block + to..][..outputs];
                    for (component, (f, x)) in f.iter_mut().zip(&*out).enumerate() {
                        if !x.is_finite() {
                            return Err(not_finite(name, t, component, *x));
                        }
                        f.0[lane] = *x;
                    }
                }
                Ok(())
            });
        }
        let fill = |times: &mut [f64], to: &mut [f64]| {
            for (at, time) in times.iter_mut().enumerate() {
                *time = given.t[at / 8].0[at % 8];
            }
            for (component, row) in to.chunks_exact_mut(count).enumerate() {
                for (block, part) in row.chunks_mut(8).enumerate() {
                    let z = &given.z[stride * block + given.from + component].0;
                    part.copy_from_slice(&z[..part.len()]);
                }
            }
        };
        let mut wrong = None;
        let take = |numbers: &[f64]| {
            for (component, row) in numbers.chunks_exact(count).enumerate() {
                for (block, part) in row.chunks(8).enumerate() {
                    f[stride * block + to + component].0[..part.len()].copy_from_slice(part);
                    if let Some(lane) = part.iter().position(|x| !x.is_finite()) {
                        wrong.get_or_insert((8 * block + lane, component, part[lane]));
                    }
                }
            }
            Ok(())
        };
        let first = given.t[0].0[0];
        Python::attach(|py| self.run(py, name, count, first, fill, take)).map_err(from_python)?;
        match wrong {
            None => Ok(()),
            Some((at, component, x)) => {
                Err(not_finite(name, given.t[at / 8].0[at % 8], component, x))
            }
        }
    }
}

/// Floats of a list or tuple, or a float; whether there are as many as wanted, and nothing else.
fn floats(given: &Bound<'_, PyAny>, out: &mut [f64]) -> bool {
    let read = |item: &Bound<'_, PyAny>, out: &mut f64| match item.cast::<PyFloat>() {
        Ok(float) => {
            *out = float.value();
            true
        }
        Err(_) => false,
    };
    if let Ok(list) = given.cast_exact::<PyList>() {
        return list.len() == out.len() && list.iter().zip(out).all(|(item, out)| read(&item, out));
    }
    if let Ok(tuple) = given.cast_exact::<PyTuple>() {
        return tuple.len() == out.len()
            && tuple.iter_borrowed().zip(out).all(|(item, out)| read(&item, out));
    }
    let [out] = out else { return false };
    read(given, out)
}
