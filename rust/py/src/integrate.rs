//! Systems and `integrate`: one walk in, arrays out.

use std::ops::ControlFlow;
use std::sync::Arc;

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use spim::expm::{Recipe, Scheme};
use spim::linalg::kernel::{doubles, doubles_mut};
use spim::method::measured::Measured;
use spim::method::{self, METHODS, MethodInfo, Options, State, Value};
use spim::observe::{Observer, Outputs, Poll, Recorder};
use spim::propagate::{Clock, End, propagate};
use spim::system::{self, Flow, Generator, Hamiltonian, Problem};

use crate::beam::RotatingBeam;
use crate::callback::Called;
use crate::convert::{self, real, slice, slice_mut};
use crate::error::{from_python, guarded, to_python};
use crate::expm::{shown, warn_of_size};
use crate::load::Acting;
use crate::models::Model;
use crate::watch;

/// A homogeneous linear system `z' = A z`, as the core holds it.
#[pyclass(frozen, module = "spim._core")]
pub struct Linear {
    system: Arc<system::Linear>,
}

#[pymethods]
#[allow(non_snake_case)]
impl Linear {
    #[new]
    fn new(A: &Bound<'_, PyAny>) -> PyResult<Self> {
        let a = real("A", A)?;
        let shape = a.shape();
        if shape.len() != 2 || shape[0] != shape[1] || shape[0] == 0 {
            return Err(PyValueError::new_err(format!(
                "A: must be square, (m, m), and not empty, got shape {}",
                shown(shape)
            )));
        }
        let system = system::Linear::new(shape[0], convert::copied("A", &a)?).map_err(to_python)?;
        Ok(Linear { system: Arc::new(system) })
    }

    /// The matrix, (m, m).
    #[getter]
    fn A<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let m = self.system.len();
        let out = convert::empty(py, &[m, m])?;
        slice_mut(&out).copy_from_slice(self.system.matrix());
        Ok(out.into_any())
    }

    /// Whether J A is symmetric to rounding, z = [q; p].
    #[getter]
    fn hamiltonian(&self) -> bool {
        self.system.is_hamiltonian()
    }

    /// Energies of states, (..., m) -> (...), in pairs of doubles.
    fn energy<'py>(&self, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = z.py();
        let z = real("z", z)?;
        let m = self.system.len();
        if z.shape().last() != Some(&m) {
            return Err(PyValueError::new_err(format!(
                "z: must have shape (..., {m}), got {}",
                shown(z.shape())
            )));
        }
        convert::check_finite("z", z.shape(), slice(&z))?;
        let out = convert::empty(py, &z.shape()[..z.shape().len() - 1])?;
        let states = convert::copied("z", &z)?;
        let energies = slice_mut(&out);
        let system = &self.system;
        py.detach(|| {
            guarded(|| {
                let mut signals = watch::signals();
                for (i, (energy, z)) in energies.iter_mut().zip(states.chunks_exact(m)).enumerate()
                {
                    *energy = system.energy(0.0, z).map_err(|error| match *error {
                        spim::Error::Overflow(text) => {
                            spim::Error::overflow(format!("{text} for state {i}"))
                        }
                        _ => error,
                    })?;
                    signals()?;
                }
                Ok(())
            })
        })?
        .map_err(to_python)?;
        Ok(out.into_any())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let matrix = slf.get().A(slf.py())?;
        Ok((slf.get_type(), (matrix,)).into_pyobject(slf.py())?.into_any())
    }
}

/// Mass, damping, gyroscopic matrix and stiffness of a structure, for the methods that want them.
pub type Matrices<'py> = [Bound<'py, PyAny>; 4];

/// Walks a system through time.
///
/// With `outputs`, a matrix of m columns, rows of z are these outputs of states.
///
/// `resume`: what came back as `state` of a run that began at `t0` with the same signed `step`; `z0`
/// is then the `last` of that run. `watch(step, t, z)` sees where the run begins and each step; text
/// that it returns stops the run.
///
/// Returns a dict: t, z, last (the state reached), state, h, steps, uneven, choice, work, error (None
/// or the exception), stopped.
#[pyfunction]
#[pyo3(signature = (
    system, matrices, load, z0, t0, t1, step, method, every, outputs, options, progress, resume=None,
    watch=None
))]
#[allow(clippy::too_many_arguments)]
pub fn integrate<'py>(
    system: &Bound<'py, PyAny>,
    matrices: Option<Matrices<'py>>,
    load: Option<&Bound<'py, PyAny>>,
    z0: &Bound<'py, PyAny>,
    t0: f64,
    t1: f64,
    step: f64,
    method: &str,
    every: &Bound<'py, PyAny>,
    outputs: Option<&Bound<'py, PyAny>>,
    options: &Bound<'py, PyDict>,
    progress: Option<Py<PyAny>>,
    resume: Option<&Bound<'py, PyAny>>,
    watch: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let py = system.py();
    let info = method::find(method).map_err(to_python)?;
    let problem = problem_of(system, matrices, load, Some(info))?;
    let m = problem.flow().len();
    let z0 = real("z0", z0)?;
    if z0.shape() != [m] {
        return Err(PyValueError::new_err(format!(
            "z0: must have shape ({m},), got {}",
            shown(z0.shape())
        )));
    }
    convert::check_finite("z0", z0.shape(), slice(&z0))?;
    let every = convert::every(every)?;
    let resumed = resume.map(Resumed::of).transpose()?;
    let (clock, uneven) = match &resumed {
        Some(resumed) => (Clock::resumed(t0, step, resumed.reached(), t1), false),
        None => Clock::new(t0, t1, step)
            .map_or_else(|error| (Err(error), false), |(clock, uneven)| (Ok(clock), uneven)),
    };
    let clock = clock.map_err(to_python)?;
    let from = resumed.as_ref().map_or(0, Resumed::reached);
    let options = options_of(options)?;
    options.check(info).map_err(to_python)?;
    if let (true, Some(linear)) = (info.needs.is_exponential(), problem.linear()) {
        let recipe = match info.name {
            "auto" => Recipe::for_steps(m, linear.matrix()),
            _ => Recipe { scheme: Scheme::Spim([2, 2]), doublings: None },
        };
        warn_of_size(py, m, recipe, f64::INFINITY, clock.h, linear.matrix())?;
    }
    let rows = Recorder::rows_for(clock.steps - from, every, true).map_err(to_python)?;
    let wanted = outputs.map(|given| convert::copied("outputs", &real("outputs", given)?));
    let wanted = wanted.transpose()?;
    let outputs = wanted.as_ref().map(|wanted| Outputs::new(wanted, m)).transpose();
    let outputs = outputs.map_err(to_python)?;
    let z = convert::empty(py, &[rows, outputs.as_ref().map_or(m, Outputs::width)])?;
    let t = convert::empty(py, &[rows])?;
    let start = slice(&z0).to_vec();
    let (times, states) = (slice_mut(&t), slice_mut(&z));
    let run = || -> spim::Result<_> {
        let mut signals = watch::signals();
        // Whoever looks on wants whole states; what is resumed goes on as it was.
        let may = watch.is_none() && resumed.as_ref().is_none_or(|resumed| resumed.few);
        let few = match (&wanted, info.name, may) {
            (Some(wanted), "auto", true) => {
                method::output_method(&problem, clock.h, &options, wanted, &start, &mut signals)?
            }
            _ => None,
        };
        let is_few = few.is_some();
        if resumed.as_ref().is_some_and(|resumed| resumed.few != is_few) {
            return Err(spim::Error::argument(
                "resume: its run stepped outputs alone; give the same outputs=, and nothing that \
                 looks on",
            ));
        }
        let mut recorder = Recorder::new(times, states, every, Some(clock.steps));
        let mut first = start.clone();
        let mut method = match (few, &outputs) {
            (Some(method), Some(outputs)) => {
                // The states of this method are the outputs.
                first = outputs.of(&start);
                method
            }
            _ => {
                recorder = recorder.with_outputs(outputs.as_ref());
                method::build(info, &problem, clock.h, &options, &mut signals)?
            }
        };
        let mut state = State::new(&first, &*method)?;
        let mut kept = None;
        if let Some(resumed) = &resumed {
            resumed.put(&mut state)?;
            kept = Some((resumed.step, state.clone()));
            for k in resumed.step..from {
                method.step(k, clock.t(k), &mut state)?;
                signals()?;
            }
        }
        let mut looks_on = watch.map(Watcher);
        let mut observers: Vec<&mut dyn Observer> = Vec::new();
        observers.extend(looks_on.as_mut().map(|watcher| watcher as &mut dyn Observer));
        let mut check = |step: u64, t: f64| look(progress.as_ref(), step, &clock, t);
        let mut poll = Poll::new(&mut check);
        // A block that the end of the run cuts knows no load beyond: whoever goes on from there makes
        // it anew, from the last step before it.
        let load = problem.linear().and_then(|linear| linear.load());
        let block = load.map_or(1, |_| method.block());
        let cut = match block {
            1 => clock.steps,
            _ => (clock.steps - clock.steps % block).saturating_sub(1),
        };
        let recorder = &mut recorder;
        let method = &mut *method;
        let (one, two) = (from..cut.max(from), cut.max(from)..clock.steps);
        let mut outcome =
            propagate(method, &clock, one, &mut state, recorder, &mut observers, &mut poll);
        if cut >= from {
            kept = Some((outcome.step, state.clone()));
        }
        if !two.is_empty() && matches!(outcome.end, End::Finished) {
            outcome =
                propagate(method, &clock, two, &mut state, recorder, &mut observers, &mut poll);
        }
        let mut last = method.whole(outcome.step, &state)?;
        last.truncate(m);
        let kept = kept.unwrap_or((outcome.step, state));
        Ok((outcome, method.work(), method.choice().to_string(), last, kept, is_few))
    };
    // Functions in Python need the interpreter at every call: taking it each time costs as much as the call.
    let python = system.cast::<Called>().is_ok_and(|called| called.get().is_python());
    let ran = if python { guarded(run)? } else { py.detach(|| guarded(run))? };
    let (outcome, work, choice, last, (kept_step, kept), is_few) = ran.map_err(to_python)?;
    let result = PyDict::new(py);
    result.set_item("t", convert::first_rows(&t, outcome.rows)?)?;
    result.set_item("z", convert::first_rows(&z, outcome.rows)?)?;
    let end = convert::empty(py, &[m])?;
    slice_mut(&end).copy_from_slice(&last);
    result.set_item("last", end)?;
    let carried = convert::empty(py, &[kept.carried.len(), 8])?;
    slice_mut(&carried).copy_from_slice(doubles(&kept.carried));
    let z = convert::empty(py, &[kept.z.len()])?;
    slice_mut(&z).copy_from_slice(&kept.z);
    result.set_item("state", (z, carried, kept_step, outcome.step - kept_step, is_few))?;
    result.set_item("h", clock.h)?;
    result.set_item("steps", outcome.step)?;
    result.set_item("uneven", uneven)?;
    result.set_item("method", info.name)?;
    result.set_item("choice", choice)?;
    let counts = PyDict::new(py);
    counts.set_item("steps", work.steps)?;
    counts.set_item("evaluations", work.evaluations)?;
    counts.set_item("products", work.products)?;
    result.set_item("work", counts)?;
    let (error, stopped) = match outcome.end {
        End::Finished => (None, None),
        End::Stopped(reason) => (None, Some(reason)),
        End::Failed(error) => (Some(to_python(error)), None),
    };
    result.set_item("error", error.map(|error| error.into_value(py)))?;
    result.set_item("stopped", stopped)?;
    Ok(result)
}

/// A state to go on from: that at step `step`, and how many steps to take from there before anything
/// is new.
struct Resumed {
    z: Vec<f64>,
    carried: Vec<f64>,
    step: u64,
    ahead: u64,
    /// Whether z holds outputs.
    few: bool,
}

impl Resumed {
    fn of(given: &Bound<'_, PyAny>) -> PyResult<Resumed> {
        let (z, carried, step, ahead, few): (Bound<'_, PyAny>, Bound<'_, PyAny>, u64, u64, bool) =
            given.extract()?;
        let numbers = |name: &str, given: &Bound<'_, PyAny>| {
            real(name, given).and_then(|array| convert::copied(name, &array))
        };
        let (z, carried) = (numbers("resume", &z)?, numbers("resume", &carried)?);
        Ok(Resumed { z, carried, step, ahead, few })
    }

    fn reached(&self) -> u64 {
        self.step.saturating_add(self.ahead)
    }

    fn put(&self, state: &mut State) -> spim::Result<()> {
        let carried = doubles_mut(&mut state.carried);
        if self.z.len() != state.z.len() || self.carried.len() != carried.len() {
            return Err(spim::Error::argument(
                "resume: the state is that of another method or of another system",
            ));
        }
        state.z.copy_from_slice(&self.z);
        carried.copy_from_slice(&self.carried);
        Ok(())
    }
}

/// `watch(step, t, z)`, which may return text.
struct Watcher(Py<PyAny>);

impl Observer for Watcher {
    fn observe(&mut self, step: u64, t: f64, z: &[f64]) -> spim::Result<ControlFlow<String>> {
        Python::attach(|py| {
            let state = convert::empty(py, &[z.len()])?;
            slice_mut(&state).copy_from_slice(z);
            let said: Option<String> = self.0.call1(py, (step, t, state))?.extract(py)?;
            Ok(said.map_or(ControlFlow::Continue(()), ControlFlow::Break))
        })
        .map_err(from_python)
    }
}

/// The system as methods see it, under its load, which depends on the method.
pub fn problem_of(
    system: &Bound<'_, PyAny>,
    matrices: Option<Matrices<'_>>,
    load: Option<&Bound<'_, PyAny>>,
    info: Option<&MethodInfo>,
) -> PyResult<Problem> {
    if let Ok(beam) = system.cast::<RotatingBeam>() {
        return Ok(Problem::Beam(beam.get().beam.clone()));
    }
    if let Ok(called) = system.cast::<Called>() {
        return Ok(called.get().problem.clone());
    }
    if let Ok(model) = system.cast::<Model>() {
        return Ok(model.get().native.problem.clone());
    }
    let mut linear = system.cast::<Linear>()?.get().system.clone();
    if let Some(load) = load {
        // Impulses are of exponential steps alone.
        let (load, generator) = match info {
            Some(info) if info.needs.is_exponential() => Acting::of_steps(load)?,
            _ => (Acting::of_values(load), Generator::default()),
        };
        linear = Arc::new(linear.with_load(Arc::new(load), generator).map_err(to_python)?);
    }
    let Some(given) = matrices else {
        return Ok(Problem::Linear(linear));
    };
    let copied = |i: usize| convert::copied("matrix", &real("matrix", &given[i])?);
    let structure = system::Structural {
        linear,
        mass: copied(0)?,
        damping: copied(1)?,
        gyroscopic: copied(2)?,
        stiffness: copied(3)?,
    };
    Ok(Problem::Structural(Arc::new(structure.check().map_err(to_python)?)))
}

/// The grid of a run: signed step, number of steps, and whether the span was no multiple of the step;
/// of a run that goes on from step `resumed` with a signed step, the number since its start.
#[pyfunction]
#[pyo3(signature = (t0, t1, step, resumed=None))]
pub fn grid(t0: f64, t1: f64, step: f64, resumed: Option<u64>) -> PyResult<(f64, u64, bool)> {
    if let Some(from) = resumed {
        let clock = Clock::resumed(t0, step, from, t1).map_err(to_python)?;
        return Ok((clock.h, clock.steps, false));
    }
    let (clock, uneven) = Clock::new(t0, t1, step).map_err(to_python)?;
    Ok((clock.h, clock.steps, uneven))
}

/// Signals, then progress as the fraction of steps done and the time reached.
fn look(progress: Option<&Py<PyAny>>, step: u64, clock: &Clock, t: f64) -> spim::Result<()> {
    Python::attach(|py| {
        py.check_signals()?;
        // Where a run holds the interpreter, others get it now.
        py.detach(|| ());
        if let Some(progress) = progress {
            progress.call1(py, (step as f64 / clock.steps as f64, t))?;
        }
        Ok(())
    })
    .map_err(from_python)
}

pub fn options_of(given: &Bound<'_, PyDict>) -> PyResult<Options> {
    let mut options = Vec::new();
    for (name, value) in given {
        if value.is_none() {
            continue;
        }
        let name: String = name.extract()?;
        let value = if let Ok(text) = value.extract::<String>() {
            Value::Text(text)
        } else if let Ok(whole) = value.extract::<i64>() {
            Value::Integers(vec![whole])
        } else if let Ok(whole) = value.extract::<Vec<i64>>() {
            Value::Integers(whole)
        } else if let Ok(numbers) = value.extract::<Vec<f64>>() {
            Value::Numbers(numbers)
        } else if let Ok(number) = value.extract::<f64>() {
            Value::Number(number)
        } else if let Ok((word, number)) = named(&value) {
            Value::Named(word, number)
        } else {
            Value::Other(value.repr()?.to_string())
        };
        options.push((name, value));
    }
    Ok(Options(options))
}

/// A word and a number, in a tuple or a list.
fn named(value: &Bound<'_, PyAny>) -> PyResult<(String, f64)> {
    let pair: Vec<Bound<'_, PyAny>> = value.extract()?;
    match &pair[..] {
        [word, number] => Ok((word.extract()?, number.extract()?)),
        _ => Err(PyValueError::new_err("not two")),
    }
}

/// The records of all methods and what was measured of them, one dict each.
#[pyfunction]
pub fn methods(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    for info in METHODS {
        let record = PyDict::new(py);
        record.set_item("name", info.name)?;
        record.set_item("aliases", info.aliases)?;
        record.set_item("summary", info.summary)?;
        record.set_item("order", info.order)?;
        record.set_item("symplectic", info.symplectic)?;
        record.set_item("symmetric", info.symmetric)?;
        record.set_item("energy_preserving", info.energy_preserving)?;
        record.set_item("needs", info.needs.name())?;
        record.set_item("reproducible", info.reproducible)?;
        record.set_item("reference", info.reference)?;
        let options = PyDict::new(py);
        for option in info.options {
            options.set_item(option.name, option.doc)?;
        }
        record.set_item("options", options)?;
        if let Some(found) = Measured::find(info.name) {
            record.set_item("measured_order", found.order)?;
            record.set_item("symplectic_defect", found.symplectic_defect)?;
            record.set_item("reversibility_defect", found.reversibility_defect)?;
            record.set_item("energy_error", found.energy_error)?;
            record.set_item("energy_drift", found.energy_drift)?;
            record.set_item("evaluations", found.evaluations)?;
            record.set_item("products", found.products)?;
        }
        list.append(record)?;
    }
    Ok(list)
}
