//! One function of a system, however it was given.

use pyo3::PyVisit;
use pyo3::prelude::*;
use pyo3::pyclass::PyTraverseError;
use spim::linalg::kernel::Eight;
use spim::{Error, Result};

use super::compiled::Compiled;
use super::python::Called;

/// As Python code describes it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Given {
    /// What it is called in messages.
    name: String,
    inputs: usize,
    outputs: Vec<usize>,
    /// The function itself; kept alive where it is compiled.
    call: Py<PyAny>,
    args: Vec<Py<PyAny>>,
    writes: bool,
    vectorized: bool,
    /// Address and, perhaps, user data of functions of one state and of eight.
    one: Option<(usize, Option<usize>)>,
    batch: Option<(usize, Option<usize>)>,
}

/// Part of the components of many states: a block holds `stride` of them, `inputs` from `from` on are
/// what a function is given.
pub struct Columns<'a> {
    /// Times.
    pub t: &'a [Eight],
    /// States.
    pub z: &'a [Eight],
    /// How many are wanted.
    pub count: usize,
    /// Components of a state.
    pub stride: usize,
    /// First component.
    pub from: usize,
    /// Components.
    pub inputs: usize,
}

/// A function of time and components of a state.
pub struct Function {
    pub name: String,
    inputs: usize,
    outputs: usize,
    compiled: Compiled,
    python: Called,
}

/// What is no number where one was needed.
pub fn not_finite(name: &str, t: f64, component: usize, x: f64) -> Box<Error> {
    let shown = x.to_string().to_lowercase();
    Box::new(Error::Model {
        message: format!("{name}: component {component} is {shown} at t = {t}"),
        t,
        step: 0,
    })
}

impl Function {
    pub fn new(given: Given) -> Function {
        let outputs = given.outputs.iter().product();
        Function {
            compiled: Compiled::new(given.one, given.batch),
            python: Called::new(
                given.call,
                given.args,
                given.writes,
                given.vectorized,
                given.inputs,
                given.outputs,
            ),
            name: given.name,
            inputs: given.inputs,
            outputs,
        }
    }

    /// Numbers it gives.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// Components it is given.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Whether it needs the interpreter.
    pub fn is_python(&self) -> bool {
        !self.compiled.is_some()
    }

    /// Its result, whether it is a number or not.
    pub fn value(&self, t: f64, x: &[f64], out: &mut [f64]) -> Result<()> {
        if self.compiled.is_some() {
            self.compiled.one(t, x, out);
            return Ok(());
        }
        self.python.one(&self.name, t, x, out)
    }

    /// Its result.
    pub fn call(&self, t: f64, x: &[f64], out: &mut [f64]) -> Result<()> {
        self.value(t, x, out)?;
        match out.iter().position(|x| !x.is_finite()) {
            None => Ok(()),
            Some(at) => Err(not_finite(&self.name, t, at, out[at])),
        }
    }

    /// Its results for many states, into components of `f` from `to` on; `scratch`: as many doubles as
    /// there are inputs and outputs.
    pub fn calls(
        &self,
        given: &Columns,
        f: &mut [Eight],
        to: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        if self.compiled.is_some() {
            return self.compiled.many(&self.name, given, f, [to, self.outputs], scratch);
        }
        self.python.many(&self.name, given, f, to, scratch)
    }

    /// What the garbage collector must know of.
    pub fn traverse(&self, visit: &PyVisit<'_>) -> std::result::Result<(), PyTraverseError> {
        self.python.traverse(visit)
    }
}
