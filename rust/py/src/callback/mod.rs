//! Systems given as functions: Python's, or pointers to compiled ones.

mod compiled;
mod function;
mod python;
mod vectorcall;

use std::collections::BTreeMap;
use std::sync::Arc;

use pyo3::PyVisit;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::pyclass::PyTraverseError;
use spim::Result;
use spim::linalg::kernel::Eight;
use spim::system::{About, Flow, Hamiltonian, Problem, SemiLinear, Separable};

use self::function::{Columns, Function, Given};
use crate::convert::{self, real};
use crate::integrate::problem_of;
use crate::states;

/// All components of many states.
fn whole<'a>(count: usize, t: &'a [Eight], z: &'a [Eight], stride: usize) -> Columns<'a> {
    Columns { t, z, count, stride, from: 0, inputs: stride }
}

/// `f += A x`.
fn add_linear(matrix: &[f64], x: &[f64], f: &mut [f64]) {
    for (f, row) in f.iter_mut().zip(matrix.chunks_exact(x.len())) {
        *f += row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
    }
}

/// `f += A x` of the lanes of one block.
fn add_linear_block(matrix: &[f64], x: &[Eight], f: &mut [Eight]) {
    for (f, row) in f.iter_mut().zip(matrix.chunks_exact(x.len())) {
        let mut sums = [0.0; 8];
        for (a, x) in row.iter().zip(x) {
            for (sum, x) in sums.iter_mut().zip(x.0) {
                *sum += a * x;
            }
        }
        f.0.iter_mut().zip(sums).for_each(|(f, sum)| *f += sum);
    }
}

/// From a gradient to rates, or from a Hessian to a Jacobian, row by row: `J x`.
fn turned(x: &mut [f64]) {
    let (q, p) = x.split_at_mut(x.len() / 2);
    for (dq, dp) in q.iter_mut().zip(p) {
        (*dq, *dp) = (*dp, -*dq);
    }
}

/// `z' = f(t, z)`.
struct General {
    rate: Arc<Function>,
    jacobian: Option<Arc<Function>>,
    linear: Option<Vec<f64>>,
}

impl Flow for General {
    fn len(&self) -> usize {
        self.rate.inputs()
    }
    fn linear(&self) -> Option<&[f64]> {
        self.linear.as_deref()
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.rate.call(t, z, f)
    }
    fn rates(
        &self,
        t: &[Eight],
        z: &[Eight],
        f: &mut [Eight],
        count: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        self.rate.calls(&whole(count, t, z, self.len()), f, 0, scratch)
    }
    fn jacobian(&self, t: f64, z: &[f64], out: &mut [f64]) -> Result<bool> {
        let Some(jacobian) = &self.jacobian else { return Ok(false) };
        jacobian.call(t, z, out).map(|()| true)
    }
}

/// `z' = J dH/dz` by the gradient.
struct Canonical {
    gradient: Arc<Function>,
    hessian: Option<Arc<Function>>,
    energy: Option<Arc<Function>>,
    linear: Option<Vec<f64>>,
}

impl Flow for Canonical {
    fn len(&self) -> usize {
        self.gradient.inputs()
    }
    fn linear(&self) -> Option<&[f64]> {
        self.linear.as_deref()
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.gradient.call(t, z, f)?;
        turned(f);
        Ok(())
    }
    fn rates(
        &self,
        t: &[Eight],
        z: &[Eight],
        f: &mut [Eight],
        count: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        let m = self.len();
        self.gradient.calls(&whole(count, t, z, m), f, 0, scratch)?;
        for block in f.chunks_exact_mut(m) {
            let (q, p) = block.split_at_mut(m / 2);
            for (dq, dp) in q.iter_mut().zip(p) {
                (*dq, *dp) = (*dp, Eight(dq.0.map(|x| -x)));
            }
        }
        Ok(())
    }
    fn jacobian(&self, t: f64, z: &[f64], out: &mut [f64]) -> Result<bool> {
        let Some(hessian) = &self.hessian else { return Ok(false) };
        hessian.call(t, z, out)?;
        turned(out);
        Ok(true)
    }
}

impl Hamiltonian for Canonical {
    fn energy(&self, t: f64, z: &[f64]) -> Result<f64> {
        let mut out = [0.0];
        match &self.energy {
            Some(energy) => energy.value(t, z, &mut out)?,
            None => return Err(spim::Error::unsupported("energy: was not given")),
        }
        Ok(out[0])
    }
}

/// `q' = M^-1 p` or `v(p)`, `p' = f(t, q)`.
struct Split {
    force: Arc<Function>,
    velocity: Option<Arc<Function>>,
    /// The inverse of the mass, row by row.
    inverse: Vec<f64>,
    jacobian: Option<Arc<Function>>,
    /// The same in parts.
    parts: Option<Arc<Rest>>,
}

impl Flow for Split {
    fn len(&self) -> usize {
        2 * self.force.inputs()
    }
    fn linear(&self) -> Option<&[f64]> {
        self.parts.as_ref().map(|parts| &parts.matrix[..])
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        let n = self.force.inputs();
        let ((q, p), (dq, dp)) = (z.split_at(n), f.split_at_mut(n));
        self.velocity(p, dq)?;
        self.force(t, q, dp)
    }
    fn rates(
        &self,
        t: &[Eight],
        z: &[Eight],
        f: &mut [Eight],
        count: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        let n = self.force.inputs();
        let half = |from| Columns { t, z, count, stride: 2 * n, from, inputs: n };
        match &self.velocity {
            Some(velocity) => velocity.calls(&half(n), f, 0, scratch)?,
            None => {
                for (z, f) in z.chunks_exact(2 * n).zip(f.chunks_exact_mut(2 * n)) {
                    f[..n].fill(Eight::ZERO);
                    add_linear_block(&self.inverse, &z[n..], &mut f[..n]);
                }
            }
        }
        self.force.calls(&half(0), f, n, scratch)
    }
    fn jacobian(&self, t: f64, z: &[f64], out: &mut [f64]) -> Result<bool> {
        let Some(jacobian) = &self.jacobian else { return Ok(false) };
        jacobian.call(t, z, out).map(|()| true)
    }
}

impl Separable for Split {
    fn velocity(&self, p: &[f64], rate: &mut [f64]) -> Result<()> {
        if let Some(velocity) = &self.velocity {
            return velocity.call(0.0, p, rate);
        }
        rate.fill(0.0);
        add_linear(&self.inverse, p, rate);
        Ok(())
    }
    fn force(&self, t: f64, q: &[f64], rate: &mut [f64]) -> Result<()> {
        self.force.call(t, q, rate)
    }
    fn semilinear(&self) -> Option<Arc<dyn SemiLinear>> {
        let parts = self.parts.as_ref()?;
        Some(parts.clone())
    }
}

/// `z' = A z + F(t, z)`.
struct Rest {
    matrix: Vec<f64>,
    remainder: Arc<Function>,
    jacobian: Option<Arc<Function>>,
    /// Whether both are of a force `f(t, q)` alone, `F = (0, f)`.
    is_force: bool,
}

impl Flow for Rest {
    fn len(&self) -> usize {
        if self.is_force { 2 * self.remainder.inputs() } else { self.remainder.inputs() }
    }
    fn linear(&self) -> Option<&[f64]> {
        Some(&self.matrix)
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        SemiLinear::remainder(self, t, z, f)?;
        add_linear(&self.matrix, z, f);
        Ok(())
    }
    fn rates(
        &self,
        t: &[Eight],
        z: &[Eight],
        f: &mut [Eight],
        count: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        let m = self.len();
        self.many(count, t, z, f, scratch)?;
        for (z, f) in z.chunks_exact(m).zip(f.chunks_exact_mut(m)) {
            add_linear_block(&self.matrix, z, f);
        }
        Ok(())
    }
    fn jacobian(&self, t: f64, z: &[f64], out: &mut [f64]) -> Result<bool> {
        let Some(jacobian) = &self.jacobian else { return Ok(false) };
        if self.is_force {
            let (n, m) = (z.len() / 2, z.len());
            jacobian.call(t, &z[..n], &mut out[..n * n])?;
            // From the front to the lower left block, below all of it.
            for i in 0..n {
                out.copy_within(n * i..n * (i + 1), m * (n + i));
                out[m * (n + i) + n..m * (n + i + 1)].fill(0.0);
            }
            out[..m * n].fill(0.0);
        } else {
            jacobian.call(t, z, out)?;
        }
        out.iter_mut().zip(&self.matrix).for_each(|(out, a)| *out += a);
        Ok(true)
    }
}

impl Rest {
    /// Remainders of many states.
    fn many(
        &self,
        count: usize,
        t: &[Eight],
        z: &[Eight],
        f: &mut [Eight],
        scratch: &mut [f64],
    ) -> Result<()> {
        let m = self.len();
        if !self.is_force {
            return self.remainder.calls(&whole(count, t, z, m), f, 0, scratch);
        }
        f.chunks_exact_mut(m).for_each(|f| f[..m / 2].fill(Eight::ZERO));
        let half = Columns { t, z, count, stride: m, from: 0, inputs: m / 2 };
        self.remainder.calls(&half, f, m / 2, scratch)
    }
}

impl SemiLinear for Rest {
    fn matrix(&self) -> &[f64] {
        &self.matrix
    }
    fn remainder(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        if !self.is_force {
            return self.remainder.call(t, z, f);
        }
        let n = self.remainder.inputs();
        f[..n].fill(0.0);
        self.remainder.call(t, &z[..n], &mut f[n..])
    }
    fn remainders(
        &self,
        t: &Eight,
        z: &[Eight],
        f: &mut [Eight],
        count: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        self.many(count, std::slice::from_ref(t), z, f, scratch)
    }
    fn is_force(&self) -> bool {
        self.is_force
    }
}

/// A system of functions, as the core holds it.
#[pyclass(frozen, module = "spim._core")]
pub struct Called {
    /// The system.
    pub problem: Problem,
    functions: BTreeMap<String, Arc<Function>>,
    size: usize,
    python: bool,
}

/// Functions that steps call once and again.
const RATES: [&str; 6] = ["rate", "gradient", "force", "velocity", "nonlinear", "kick"];

impl Called {
    /// Whether steps call Python.
    pub fn is_python(&self) -> bool {
        self.python
    }
}

#[pymethods]
impl Called {
    /// `kind`: "flow", "hamiltonian", "separable" or "semilinear"; `functions` by their parts in it, each a
    /// dict as `spim._calls.given` makes it; `matrix`: a constant linear part; `inverse`: of the mass.
    /// What a linear part leaves is "nonlinear", of a state, or "kick", a force of coordinates.
    #[new]
    #[pyo3(signature = (kind, functions, matrix=None, inverse=None))]
    fn new(
        kind: &str,
        functions: BTreeMap<String, Given>,
        matrix: Option<&Bound<'_, PyAny>>,
        inverse: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let copied = |given: &Bound<'_, PyAny>| convert::copied("matrix", &real("matrix", given)?);
        let linear = matrix.map(copied).transpose()?;
        let inverse = inverse.map(copied).transpose()?.unwrap_or_default();
        let made = |(part, given)| (part, Arc::new(Function::new(given)));
        let functions: BTreeMap<_, _> = functions.into_iter().map(made).collect();
        let perhaps = |part: &str| functions.get(part).cloned();
        let needed = |part: &str| {
            perhaps(part).ok_or_else(|| PyTypeError::new_err(format!("{kind}: needs {part}")))
        };
        let rest = |jacobian| -> Option<Arc<Rest>> {
            let kick = perhaps("kick");
            let is_force = kick.is_some();
            let remainder = kick.or_else(|| perhaps("nonlinear"))?;
            Some(Arc::new(Rest { matrix: linear.clone()?, remainder, jacobian, is_force }))
        };
        let problem = match kind {
            "flow" => Problem::Flow(Arc::new(General {
                rate: needed("rate")?,
                jacobian: perhaps("jacobian"),
                linear,
            })),
            "hamiltonian" => {
                let canonical = Arc::new(Canonical {
                    gradient: needed("gradient")?,
                    hessian: perhaps("hessian"),
                    energy: perhaps("hamiltonian"),
                    linear,
                });
                match canonical.energy {
                    Some(_) => Problem::Hamiltonian(canonical),
                    None => Problem::Flow(canonical),
                }
            }
            "separable" => Problem::Separable(Arc::new(Split {
                force: needed("force")?,
                velocity: perhaps("velocity"),
                inverse,
                jacobian: perhaps("jacobian"),
                parts: rest(None),
            })),
            _ => {
                let rest = rest(perhaps("jacobian"));
                Problem::SemiLinear(rest.ok_or_else(|| {
                    PyTypeError::new_err("semilinear: needs a matrix and nonlinear or kick")
                })?)
            }
        };
        let size = problem.flow().len();
        let python = RATES.iter().any(|part| perhaps(part).is_some_and(|f| f.is_python()));
        Ok(Called { problem, functions, size, python })
    }

    /// Any other system, split at a matrix.
    #[staticmethod]
    fn about(system: &Bound<'_, PyAny>, matrix: &Bound<'_, PyAny>) -> PyResult<Self> {
        let flow = problem_of(system, None, None, None)?.flow();
        let size = flow.len();
        let matrix = convert::copied("A", &real("A", matrix)?)?;
        let problem = Problem::SemiLinear(Arc::new(About::new(flow, matrix)));
        let python = system.cast::<Called>().is_ok_and(|called| called.get().python);
        Ok(Called { problem, functions: BTreeMap::new(), size, python })
    }

    /// Length of the state.
    #[getter]
    fn size(&self) -> usize {
        self.size
    }

    /// A function of states (k, …) at times (k,), by its part: (k, outputs).
    fn values<'py>(
        &self,
        part: &str,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let function = self
            .functions
            .get(part)
            .ok_or_else(|| PyTypeError::new_err(format!("there is no function for the {part}")))?;
        states::map(function.inputs(), t, z, function.outputs(), |t, z, out| {
            function.value(t, z, out)
        })
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> std::result::Result<(), PyTraverseError> {
        let held = match &self.problem {
            Problem::Separable(system) => Arc::strong_count(system),
            Problem::SemiLinear(system) => Arc::strong_count(system),
            Problem::Hamiltonian(system) => Arc::strong_count(system),
            Problem::Flow(system) => Arc::strong_count(system),
            _ => 2,
        };
        // What somebody else holds too, a run that is under way, must not be taken for garbage.
        if held > 1 {
            return Ok(());
        }
        self.functions.values().try_for_each(|function| function.traverse(&visit))
    }
}

/// `z'` of states (k, m) at times (k,), of any system without a load.
#[pyfunction]
pub fn rates<'py>(
    system: &Bound<'py, PyAny>,
    t: &Bound<'py, PyAny>,
    z: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let flow = problem_of(system, None, None, None)?.flow();
    states::map(flow.len(), t, z, flow.len(), |t, z, out| flow.rate(t, z, out))
}

/// The Jacobian of `z'` at a state (m,), (1, m m); None where the system does not know it.
#[pyfunction]
pub fn jacobian<'py>(
    system: &Bound<'py, PyAny>,
    t: &Bound<'py, PyAny>,
    z: &Bound<'py, PyAny>,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let flow = problem_of(system, None, None, None)?.flow();
    let m = flow.len();
    let known = std::sync::atomic::AtomicBool::new(true);
    let found = states::map(m, t, z, m * m, |t, z, out| {
        let there = flow.jacobian(t, z, out)?;
        known.fetch_and(there, std::sync::atomic::Ordering::Relaxed);
        if !there {
            out.fill(0.0);
        }
        Ok(())
    })?;
    Ok(known.into_inner().then_some(found))
}
