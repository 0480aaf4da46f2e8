//! Systems given as Python functions.

use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use spim::Result;
use spim::system::{Flow, Problem, SemiLinear, Separable};

use crate::convert::{self, check_finite, real, slice, slice_mut};
use crate::error::from_python;

/// `f(t, x) -> (len,)`, or `f(t, x, out)` that writes its result.
struct Function {
    name: &'static str,
    call: Py<PyAny>,
    len: usize,
    writes: bool,
}

impl Function {
    fn call(&self, t: f64, x: &[f64], out: &mut [f64]) -> Result<()> {
        Python::attach(|py| {
            let given = convert::empty(py, &[x.len()])?;
            slice_mut(&given).copy_from_slice(x);
            let result = if self.writes {
                let result = convert::empty(py, &[self.len])?;
                // What a function forgets to write must not pass for a number.
                slice_mut(&result).fill(f64::NAN);
                self.call.call1(py, (t, given, &result))?;
                result
            } else {
                real(self.name, self.call.call1(py, (t, given))?.bind(py))?
            };
            let numbers = slice(&result);
            if numbers.len() != self.len {
                return Err(PyValueError::new_err(format!(
                    "{}: must give {} numbers, gave {} at t = {t}",
                    self.name,
                    self.len,
                    numbers.len()
                )));
            }
            check_finite(&format!("{} at t = {t}", self.name), &[self.len], numbers)?;
            out.copy_from_slice(numbers);
            Ok(())
        })
        .map_err(from_python)
    }
}

/// `z' = J dH/dz` by the gradient.
struct Canonical(Function);

impl Flow for Canonical {
    fn len(&self) -> usize {
        self.0.len
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.0.call(t, z, f)?;
        let (q, p) = f.split_at_mut(z.len() / 2);
        for (dq, dp) in q.iter_mut().zip(p) {
            (*dq, *dp) = (*dp, -*dq);
        }
        Ok(())
    }
}

/// `z' = f(t, z)`, and nothing more is known.
struct Plain(Function);

impl Flow for Plain {
    fn len(&self) -> usize {
        self.0.len
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.0.call(t, z, f)
    }
}

/// `q' = M^-1 p` or `v(p)`, `p' = f(t, q)`.
struct Split {
    force: Function,
    velocity: Option<Function>,
    /// The inverse of the mass, row by row.
    inverse: Vec<f64>,
}

impl Flow for Split {
    fn len(&self) -> usize {
        2 * self.force.len
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        let n = self.force.len;
        let ((q, p), (dq, dp)) = (z.split_at(n), f.split_at_mut(n));
        self.velocity(p, dq)?;
        self.force(t, q, dp)
    }
}

impl Separable for Split {
    fn velocity(&self, p: &[f64], rate: &mut [f64]) -> Result<()> {
        if let Some(velocity) = &self.velocity {
            return velocity.call(0.0, p, rate);
        }
        for (rate, row) in rate.iter_mut().zip(self.inverse.chunks_exact(p.len())) {
            *rate = row.iter().zip(p).map(|(a, p)| a * p).sum();
        }
        Ok(())
    }
    fn force(&self, t: f64, q: &[f64], rate: &mut [f64]) -> Result<()> {
        self.force.call(t, q, rate)
    }
}

/// `z' = A z + F(t, z)`.
struct Rest {
    matrix: Vec<f64>,
    remainder: Function,
}

impl Flow for Rest {
    fn len(&self) -> usize {
        self.remainder.len
    }
    fn linear(&self) -> Option<&[f64]> {
        Some(&self.matrix)
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.remainder.call(t, z, f)?;
        for (f, row) in f.iter_mut().zip(self.matrix.chunks_exact(z.len())) {
            *f += row.iter().zip(z).map(|(a, z)| a * z).sum::<f64>();
        }
        Ok(())
    }
}

impl SemiLinear for Rest {
    fn matrix(&self) -> &[f64] {
        &self.matrix
    }
    fn remainder(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.remainder.call(t, z, f)
    }
}

/// A system of functions, as the core holds it.
#[pyclass(frozen, module = "spim._core")]
pub struct Called {
    /// The system.
    pub problem: Problem,
    size: usize,
}

#[pymethods]
impl Called {
    /// `kind`: "hamiltonian", "flow", "separable" or "semilinear"; `function` with what it is called in
    /// messages, of `len` numbers; `writes`: whether it writes its result; `matrix`: the inverse of the
    /// mass, or A.
    #[new]
    #[pyo3(signature = (kind, function, len, writes, matrix=None, velocity=None))]
    fn new(
        kind: &str,
        function: Py<PyAny>,
        len: usize,
        writes: bool,
        matrix: Option<&Bound<'_, PyAny>>,
        velocity: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let matrix = matrix.map(|given| convert::copied("matrix", &real("matrix", given)?));
        let matrix = matrix.transpose()?.unwrap_or_default();
        let named = |name, call, writes| Function { name, call, len, writes };
        let problem = match kind {
            "hamiltonian" => {
                Problem::Flow(Arc::new(Canonical(named("gradient", function, writes))))
            }
            "flow" => Problem::Flow(Arc::new(Plain(named("fun", function, writes)))),
            "separable" => Problem::Separable(Arc::new(Split {
                force: named("force", function, writes),
                velocity: velocity.map(|call| named("velocity", call, false)),
                inverse: matrix,
            })),
            _ => Problem::SemiLinear(Arc::new(Rest {
                matrix,
                remainder: named("nonlinear", function, writes),
            })),
        };
        let size = problem.flow().len();
        Ok(Called { problem, size })
    }

    /// Length of the state.
    #[getter]
    fn size(&self) -> usize {
        self.size
    }
}
