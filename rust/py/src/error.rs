//! From errors of the core to Python's exceptions: the only place.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};

use pyo3::create_exception;
use pyo3::exceptions::{
    PyException, PyMemoryError, PyOverflowError, PyTypeError, PyUserWarning, PyValueError,
};
use pyo3::prelude::*;
use spim::Error;

create_exception!(spim, SpimError, PyException, "Base class of spim's own exceptions.");
create_exception!(
    spim,
    ModelError,
    SpimError,
    "A state is not a number any more, or outside what its model describes.\n\n\
     Attributes: `t` (time), `step` (number of the step that failed), and, where a run had begun,\n\
     `partial`: the `Solution` up to there."
);
create_exception!(
    spim,
    ConvergenceError,
    SpimError,
    "An iteration did not come to its end.\n\n\
     Attributes: `t` (time), `step` (number of the step that failed), `iterations`, `residual` (in\n\
     parts of the state), and, where a run had begun, `partial`: the `Solution` up to there."
);
create_exception!(
    spim,
    SingularMatrixError,
    SpimError,
    "A matrix that must be inverted is singular to working precision."
);
create_exception!(
    spim,
    UnsupportedError,
    SpimError,
    "The method cannot treat this system, or not in this way."
);
create_exception!(
    spim,
    InternalError,
    SpimError,
    "A defect of spim itself; please report it with the call that led to it."
);
create_exception!(
    spim,
    PrecisionWarning,
    PyUserWarning,
    "The size of the matrix leaves no correct digits to rely on."
);

/// The Python exception of an error of the core.
pub fn to_python(error: Box<Error>) -> PyErr {
    let text = error.to_string();
    match *error {
        Error::Argument(_) => PyValueError::new_err(text),
        Error::UnknownOption(_) => PyTypeError::new_err(text),
        Error::Unsupported(_) => UnsupportedError::new_err(text),
        Error::Overflow(_) => PyOverflowError::new_err(text),
        Error::Memory(_) => PyMemoryError::new_err(text),
        Error::Singular(_) => SingularMatrixError::new_err(text),
        Error::Model { t, step, .. } => Python::attach(|py| {
            let error = ModelError::new_err(text);
            // Attributes are a help; an exception that cannot carry them is still the right one.
            let _ = error.value(py).setattr("t", t);
            let _ = error.value(py).setattr("step", step);
            error
        }),
        Error::Convergence { t, step, iterations, residual, .. } => Python::attach(|py| {
            let error = ConvergenceError::new_err(text);
            let value = error.value(py);
            let _ = value.setattr("t", t);
            let _ = value.setattr("step", step);
            let _ = value.setattr("iterations", iterations);
            let _ = value.setattr("residual", residual);
            error
        }),
        Error::Callback(inner) => match inner.downcast::<PyErr>() {
            Ok(error) => *error,
            Err(inner) => SpimError::new_err(inner.to_string()),
        },
        _ => SpimError::new_err(text),
    }
}

/// A Python exception on its way through the core.
pub fn from_python(error: PyErr) -> Box<Error> {
    Box::new(Error::Callback(Box::new(error)))
}

static PANICS: AtomicU64 = AtomicU64::new(0);

/// How many panics the last net has caught: 0, or there is a defect.
#[pyfunction]
pub fn caught_panics() -> u64 {
    PANICS.load(Ordering::Relaxed)
}

/// The last net: a panic becomes an exception that `except Exception` catches.
pub fn guarded<T>(run: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(run)).map_err(|_| {
        PANICS.fetch_add(1, Ordering::Relaxed);
        InternalError::new_err("a defect of spim: the core panicked; please report the call")
    })
}
