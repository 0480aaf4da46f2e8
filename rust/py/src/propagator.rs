//! `spim.Propagator`.

use std::sync::Arc;

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use spim::expm::{Correction, Propagator as Core, Recipe};
use spim::method::{State, correction as correction_named, trajectory_method};
use spim::observe::{Poll, Recorder};
use spim::propagate::{Clock, End, propagate};

use crate::convert::{self, real, slice, slice_mut};
use crate::error::{guarded, to_python};
use crate::expm::{Given, recipe, shown, warn_of_size};
use crate::watch;

/// The exponential of one step, `exp(tau A)`, formed once and applied many times.
///
/// Parameters
/// ----------
/// A : array_like (m, m), or a system with an attribute ``A``
///     Real. The exponential is that of the exact product of the doubles `tau` and `A`.
/// tau : float
///     Step; may be negative, not 0.
/// method : {"auto", "exact", "sid", "half", "pade", "pim", "spim"}
///     As for `expm`. Separable matrices, ``[0 P; R 0]`` with symmetric blocks, as undamped
///     structures have them, are done at half the size: in pairs of doubles by "auto" and "exact", in
///     doubles by "half".
/// correction : {"auto", "none", "polish", "exact"}
///     What is done about the rounding of the stored exponential, which acts like a fixed
///     perturbation of the system and makes the energy drift. "polish" takes the symplectic defect
///     out where it is above rounding. "exact" keeps exponential and state in pairs of doubles: the
///     state stays correctly rounded for a million steps, but for components that decay by more
///     than e^-30 in a step beside others that do not. "auto" is "polish" where `A` is Hamiltonian
///     to rounding and the map near symplectic, "none" elsewhere. In doubles, errors are relative
///     to the largest component of the state.
/// pade, doublings, order : optional
///     As for `expm`.
///
/// Raises
/// ------
/// ValueError
///     `A` not square, empty or not finite; `tau` 0 or not finite; "polish" for a matrix that is not
///     Hamiltonian, or a map that is far from symplectic.
/// TypeError
///     Not numbers; an option the method does not have.
/// OverflowError
///     The exponential exceeds 1.8e308.
/// SingularMatrixError
///     The denominator of a ratio is singular ("pade", "spim").
///
/// Warns
/// -----
/// PrecisionWarning
///     As `expm`.
#[pyclass(frozen, module = "spim", name = "Propagator")]
pub struct Propagator {
    core: Arc<Core>,
    matrix: Vec<f64>,
    method: String,
    correction: String,
    options: Py<PyDict>,
}

#[pymethods]
#[allow(non_snake_case)]
impl Propagator {
    #[new]
    #[pyo3(
        signature = (
            A, tau, *, method=None, correction=None, pade=None, order=None, doublings=None
        ),
        text_signature = "(A, tau, *, method='auto', correction='auto', pade=None, order=None, \
                          doublings=None)"
    )]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        A: &Bound<'_, PyAny>,
        tau: &Bound<'_, PyAny>,
        method: Option<&Bound<'_, PyAny>>,
        correction: Option<&Bound<'_, PyAny>>,
        pade: Option<&Bound<'_, PyAny>>,
        order: Option<&Bound<'_, PyAny>>,
        doublings: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let tau = convert::number("tau", tau)?;
        let word = |name: &str, given: Option<&Bound<'_, PyAny>>| -> PyResult<String> {
            given.map_or(Ok("auto".into()), |given| Ok(convert::text(name, given)?.into_owned()))
        };
        let (method, correction) = (word("method", method)?, word("correction", correction)?);
        let held = match A.hasattr("A")? && !A.hasattr("__array__")? {
            true => &A.getattr("A")?,
            false => A,
        };
        let a = real("A", held)?;
        let shape = a.shape();
        let [rows, columns] = shape else {
            return Err(PyValueError::new_err(format!("A: must be (m, m), got {}", shown(shape))));
        };
        if rows != columns || *rows == 0 {
            return Err(PyValueError::new_err(format!(
                "A: must be square and not empty, got shape {}",
                shown(shape)
            )));
        }
        if tau == 0.0 || !tau.is_finite() {
            return Err(PyValueError::new_err(format!("tau: must be finite and not 0, got {tau}")));
        }
        convert::check_finite("A", shape, slice(&a))?;
        let rows = *rows;
        let mut recipe =
            recipe(rows, PyString::new(py, &method).as_any(), &Given { pade, order, doublings })?;
        let wanted = correction_named(&correction).map_err(to_python)?;
        let matrix = convert::copied("A", &a)?;
        if method == "auto" && doublings.is_none() {
            recipe = Recipe::for_steps(rows, &matrix);
        }
        let core = py
            .detach(|| {
                guarded(|| Core::new(rows, &matrix, tau, recipe, wanted, &mut watch::signals()))
            })?
            .map_err(to_python)?;
        warn_of_size(py, rows, recipe, core.norm(), tau, &matrix)?;
        let options = PyDict::new(py);
        let given = [("pade", pade), ("order", order), ("doublings", doublings)];
        for (name, value) in given.into_iter().filter_map(|(name, value)| Some((name, value?))) {
            options.set_item(name, value)?;
        }
        let options = options.unbind();
        Ok(Propagator { core: Arc::new(core), matrix, method, correction, options })
    }

    /// exp(tau A), (m, m): each entry of increment + I rounded once.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let out = convert::empty(py, &[self.core.rows(); 2])?;
        self.core.matrix(slice_mut(&out));
        Ok(out.into_any())
    }

    /// exp(tau A) - I, (m, m), to its own full relative accuracy.
    #[getter]
    fn increment<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let out = convert::empty(py, &[self.core.rows(); 2])?;
        self.core.increment(slice_mut(&out));
        Ok(out.into_any())
    }

    /// Largest entry of T* + T + T* T, T the increment in use, evaluated without cancellation.
    ///
    /// 0 for an exactly symplectic map. ValueError for a state of odd size.
    #[getter]
    fn symplectic_defect(&self, py: Python<'_>) -> PyResult<f64> {
        py.detach(|| guarded(|| self.core.symplectic_defect(&mut watch::signals())))?
            .map_err(to_python)
    }

    /// Order of the approximation; None where it is exact to rounding.
    #[getter]
    fn order(&self) -> Option<usize> {
        self.core.recipe.order()
    }

    /// How often the step was halved.
    #[getter]
    fn doublings(&self) -> u32 {
        self.core.doublings()
    }

    /// The step.
    #[getter]
    fn tau(&self) -> f64 {
        self.core.tau
    }

    /// The method asked for.
    #[getter]
    fn method(&self) -> &str {
        &self.method
    }

    /// The correction in use: "none", "polish" or "exact".
    #[getter]
    fn correction(&self) -> &'static str {
        match self.core.correction {
            Correction::None => "none",
            Correction::Polish => "polish",
            Correction::Exact => "exact",
        }
    }

    /// One step.
    ///
    /// Parameters
    /// ----------
    /// z : array_like (m,)
    ///
    /// Returns
    /// -------
    /// ndarray (m,)
    ///
    /// Equal to the first row of `trajectory` after the start but for rounding (of the largest
    /// component). With correction="exact" each call rounds the state it returns; `trajectory`
    /// carries the remainder.
    fn step<'py>(&self, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let z = real("z", z)?;
        let rows = self.core.rows();
        if z.shape() != [rows] {
            return Err(PyValueError::new_err(format!(
                "z: must have shape ({rows},), got {}",
                shown(z.shape())
            )));
        }
        convert::check_finite("z", z.shape(), slice(&z))?;
        let out = convert::empty(z.py(), &[rows])?;
        guarded(|| self.core.step(slice(&z), slice_mut(&out)))?.map_err(to_python)?;
        Ok(out.into_any())
    }

    /// Many steps, in blocks at the speed of matrix products.
    ///
    /// Parameters
    /// ----------
    /// z0 : array_like (m,) or (b, m)
    ///     One state, or a batch of them.
    /// steps : int
    ///     Number of steps, 0 or more.
    /// every : int
    ///     Only each `every`-th state is stored: the same bits as with every=1.
    ///
    /// Returns
    /// -------
    /// ndarray (k, m) or (k, b, m)
    ///     ``k = steps // every + 1`` states, `z0` first.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     The state overflows; ``error.partial`` holds the states before that.
    /// KeyboardInterrupt
    ///     Within 0.1 s of Ctrl-C; ``error.partial`` likewise.
    /// MemoryError
    ///     The result is larger than the memory to be had.
    #[pyo3(signature = (z0, steps, every=None))]
    fn trajectory<'py>(
        &self,
        z0: &Bound<'py, PyAny>,
        steps: &Bound<'py, PyAny>,
        every: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = z0.py();
        let z0 = real("z0", z0)?;
        let m = self.core.rows();
        let batch = match z0.shape() {
            [n] if *n == m => 1,
            [b, n] if *n == m => *b,
            shape => {
                return Err(PyValueError::new_err(format!(
                    "z0: must have shape ({m},) or (b, {m}), got {}",
                    shown(shape)
                )));
            }
        };
        convert::check_finite("z0", z0.shape(), slice(&z0))?;
        let steps = convert::count("steps", steps)?;
        let every = every.map_or(Ok(1), convert::every)?;
        let rows = Recorder::rows_for(steps, every, false).map_err(to_python)?;
        let mut shape = vec![rows];
        shape.extend_from_slice(z0.shape());
        let out = convert::empty(py, &shape)?;
        if batch == 0 {
            return Ok(out.into_any());
        }
        let start = convert::copied("z0", &z0)?;
        let target = slice_mut(&out);
        let core = self.core.clone();
        let (kept, error) = py
            .detach(|| guarded(|| walk(core, batch, &start, steps, every, target)))?
            .map_err(to_python)?;
        let Some(error) = error else { return Ok(out.into_any()) };
        let error = to_python(error);
        let partial = convert::first_rows(&out, kept)?;
        let _ = error.value(py).setattr("partial", partial);
        Err(error)
    }

    fn __repr__(&self) -> String {
        format!(
            "Propagator({m} x {m}, tau={}, method='{}', correction='{}')",
            self.core.tau,
            self.method,
            self.correction(),
            m = self.core.rows()
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let rows = this.core.rows();
        let a = convert::empty(py, &[rows, rows])?;
        slice_mut(&a).copy_from_slice(&this.matrix);
        let keywords = this.options.bind(py).copy()?;
        keywords.set_item("method", &this.method)?;
        keywords.set_item("correction", &this.correction)?;
        let functools = py.import("functools")?;
        let class = functools.getattr("partial")?.call((slf.get_type(),), Some(&keywords))?;
        Ok((class, (a, this.core.tau)).into_pyobject(py)?.into_any())
    }
}

type Walked = spim::Result<(usize, Option<Box<spim::Error>>)>;

fn walk(
    core: Arc<Core>,
    batch: usize,
    start: &[f64],
    steps: u64,
    every: u64,
    out: &mut [f64],
) -> Walked {
    let mut signals = watch::signals();
    let clock = Clock::steps(core.tau, steps);
    let mut method = trajectory_method(core, batch, &mut signals)?;
    let mut state = State::new(start, &*method)?;
    let mut recorder = Recorder::new(&mut [], out, every, None);
    let mut check = |_: u64, _: f64| signals();
    let mut poll = Poll::new(&mut check);
    let outcome = propagate(
        &mut *method,
        &clock,
        0..clock.steps,
        &mut state,
        &mut recorder,
        &mut [],
        &mut poll,
    );
    let error = match outcome.end {
        End::Failed(error) => Some(error),
        _ => None,
    };
    Ok((outcome.rows, error))
}
