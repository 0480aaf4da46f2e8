//! Between NumPy arrays and slices: the only place that touches the memory of arrays.

use numpy::{PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyList, PyModule, PyString, PyTuple};
use spim::linalg::dense::is_finite;

/// An array of doubles in C order and native byte order.
pub type Doubles<'py> = Bound<'py, PyArrayDyn<f64>>;

/// What an argument may be.
pub enum Numbers<'py> {
    /// Real numbers.
    Real(Doubles<'py>),
    /// Complex ones: real and imaginary parts.
    Complex(Doubles<'py>, Doubles<'py>),
}

/// NumPy itself.
pub fn numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let module = NUMPY.get_or_try_init(py, || py.import("numpy").map(Bound::unbind))?;
    Ok(module.bind(py))
}

/// The numbers of an argument; nothing is converted that would lose its meaning.
pub fn numbers<'py>(name: &str, given: &Bound<'py, PyAny>) -> PyResult<Numbers<'py>> {
    if let Some(array) = as_it_is(given) {
        return Ok(Numbers::Real(array));
    }
    let py = given.py();
    let numpy = numpy(py)?;
    let plain = given.is_exact_instance_of::<PyTuple>() || given.is_exact_instance_of::<PyList>();
    if !plain {
        let masked = numpy.getattr("ma")?.getattr("MaskedArray")?;
        if given.is_instance(&masked)? && given.getattr("mask")?.call_method0("any")?.extract()? {
            return Err(PyValueError::new_err(format!(
                "{name}: has masked entries; fill them first"
            )));
        }
    }
    let array = numpy.call_method1("asarray", (given,)).map_err(|error| {
        match error.is_instance_of::<PyValueError>(py) {
            true => PyValueError::new_err(format!("{name}: {}", error.value(py))),
            false => error,
        }
    })?;
    if let Some(array) = as_it_is(&array) {
        return Ok(Numbers::Real(array));
    }
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    let contiguous = |part: Bound<'py, PyAny>| -> PyResult<Doubles<'py>> {
        let part = part.call_method1("astype", ("=f8",))?;
        // `ascontiguousarray` would turn a number into an array of one.
        Ok(numpy.call_method1("require", (part, "=f8", "C"))?.cast_into()?)
    };
    match kind.as_str() {
        "b" | "i" | "u" | "f" => Ok(Numbers::Real(contiguous(array)?)),
        "c" => Ok(Numbers::Complex(
            contiguous(array.getattr("real")?)?,
            contiguous(array.getattr("imag")?)?,
        )),
        _ => Err(PyTypeError::new_err(format!(
            "{name}: needs an array of numbers, got dtype {dtype}{}",
            if kind == "O" { " (a sparse matrix? use .toarray(); a system? use .A)" } else { "" }
        ))),
    }
}

/// An array that needs no conversion.
fn as_it_is<'py>(given: &Bound<'py, PyAny>) -> Option<Doubles<'py>> {
    let array = given.cast_exact::<PyArrayDyn<f64>>().ok()?;
    // Memory from files and records may begin anywhere.
    let aligned = array.data().is_aligned();
    (aligned && array.is_c_contiguous()).then(|| array.clone())
}

/// As [`numbers`], refusing complex ones.
pub fn real<'py>(name: &str, given: &Bound<'py, PyAny>) -> PyResult<Doubles<'py>> {
    match numbers(name, given)? {
        Numbers::Real(array) => Ok(array),
        Numbers::Complex(..) => Err(PyTypeError::new_err(format!(
            "{name}: must be real, got complex numbers; take real and imaginary parts apart"
        ))),
    }
}

/// The numbers of an array that [`numbers`] has returned, while the interpreter is held.
pub fn slice<'a>(array: &'a Doubles<'_>) -> &'a [f64] {
    // SAFETY: C-contiguous doubles, and nothing writes to them while this thread holds the
    // interpreter; callers copy before they let it go.
    unsafe { array.as_slice() }.expect("contiguous by construction")
}

/// A copy that the interpreter need not be held for; memory that is not to be had is an error.
pub fn copied(name: &str, array: &Doubles<'_>) -> PyResult<Vec<f64>> {
    let numbers = slice(array);
    let mut copy = Vec::new();
    copy.try_reserve_exact(numbers.len()).map_err(|_| {
        PyMemoryError::new_err(format!("{name}: no memory for a copy of {} doubles", numbers.len()))
    })?;
    copy.extend_from_slice(numbers);
    Ok(copy)
}

/// The memory of a new array that Python code has not seen yet.
#[allow(clippy::mut_from_ref)] // as NumPy's own accessor; see SAFETY
pub fn slice_mut<'a>(array: &'a Doubles<'_>) -> &'a mut [f64] {
    // SAFETY: made by `empty`, contiguous, and not shared with anybody before it is returned.
    unsafe { array.as_slice_mut() }.expect("contiguous by construction")
}

/// A new array, through NumPy: its memory is touched five times faster than ours, and what cannot
/// be had is a `MemoryError`.
pub fn empty<'py>(py: Python<'py>, shape: &[usize]) -> PyResult<Doubles<'py>> {
    let count = shape.iter().try_fold(8_usize, |bytes, &n| bytes.checked_mul(n));
    match count {
        Some(bytes) if bytes <= 4096 => {
            // SAFETY: all entries are written before the array is returned to Python.
            Ok(unsafe { PyArrayDyn::new(py, shape, false) })
        }
        Some(bytes) if bytes <= isize::MAX as usize => {
            Ok(numpy(py)?.call_method1("empty", (shape.to_vec(),))?.cast_into()?)
        }
        _ => Err(PyMemoryError::new_err(format!("an array of shape {shape:?} is too large"))),
    }
}

/// The first `rows` of an array, sharing its memory.
pub fn first_rows<'py>(array: &Doubles<'py>, rows: usize) -> PyResult<Bound<'py, PyAny>> {
    if array.shape()[0] == rows {
        return Ok(array.clone().into_any());
    }
    array.get_item(pyo3::types::PySlice::new(array.py(), 0, rows as isize, 1))
}

/// Refuses numbers that are not finite, naming the first.
pub fn check_finite(name: &str, shape: &[usize], values: &[f64]) -> PyResult<()> {
    if is_finite(values) {
        return Ok(());
    }
    let at = values.iter().position(|x| !x.is_finite()).expect("not all are finite");
    let mut rest = at;
    let mut index: Vec<_> = shape
        .iter()
        .rev()
        .map(|&n| {
            let i = rest % n.max(1);
            rest /= n.max(1);
            i.to_string()
        })
        .collect();
    index.reverse();
    let value = values[at].to_string().to_lowercase();
    Err(PyValueError::new_err(format!("{name}: entry ({}) is {value}", index.join(", "))))
}

/// How many steps apart states are stored: 1 or more; beyond what can be counted is never.
pub fn every(given: &Bound<'_, PyAny>) -> PyResult<u64> {
    match count("every", given) {
        Ok(0) => Err(PyValueError::new_err("every: must be 1 or more, got 0")),
        Err(_) if given.extract::<u64>().is_err() && given.gt(u64::MAX).unwrap_or(false) => {
            Ok(u64::MAX)
        }
        other => other,
    }
}

/// A word.
pub fn text<'a>(name: &str, given: &'a Bound<'_, PyAny>) -> PyResult<std::borrow::Cow<'a, str>> {
    match given.cast::<PyString>() {
        Ok(text) => text.to_cow(),
        Err(_) => Err(PyTypeError::new_err(format!(
            "{name}: must be a string, got {}",
            given.get_type().name()?
        ))),
    }
}

/// A number, but not text.
pub fn number(name: &str, given: &Bound<'_, PyAny>) -> PyResult<f64> {
    given.extract().map_err(|_| {
        let got = given.get_type().name().map_or_else(|_| "?".into(), |name| name.to_string());
        PyTypeError::new_err(format!("{name}: must be a real number, got {got}"))
    })
}

/// A count given as an int (or anything with `__index__`), not as a float.
pub fn count(name: &str, given: &Bound<'_, PyAny>) -> PyResult<u64> {
    let index = given.call_method0("__index__").map_err(|_| {
        let got = given.get_type().name().map_or_else(|_| "?".into(), |name| name.to_string());
        PyTypeError::new_err(format!("{name}: must be an integer, got {got}"))
    })?;
    if index.lt(0)? {
        return Err(PyValueError::new_err(format!("{name}: must not be negative, got {index}")));
    }
    index
        .extract()
        .map_err(|_| PyValueError::new_err(format!("{name}: {index} is too large a number")))
}

/// An array that is handed to Python code again and again, as long as nobody keeps it.
pub struct Kept {
    array: Py<PyAny>,
    shape: Vec<usize>,
}

impl Kept {
    /// A new one; entries are written before each use.
    pub fn new(py: Python<'_>, shape: &[usize]) -> PyResult<Kept> {
        Ok(Kept { array: empty(py, shape)?.into_any().unbind(), shape: shape.to_vec() })
    }

    /// The array.
    pub fn array<'a, 'py>(&'a self, py: Python<'py>) -> &'a Bound<'py, PyAny> {
        self.array.bind(py)
    }

    fn doubles<'a, 'py>(&'a self, py: Python<'py>) -> &'a Doubles<'py> {
        // SAFETY: made by `empty`; that it still holds doubles is checked before they are touched.
        unsafe { self.array.bind(py).cast_unchecked() }
    }

    /// Whether memory, type and shape are what they were: Python code can change all of them.
    fn is_intact(&self, py: Python<'_>) -> bool {
        let array = self.doubles(py);
        array.shape() == self.shape
            && array.is_c_contiguous()
            && array.dtype().is_equiv_to(&numpy::dtype::<f64>(py))
    }

    /// Whether the next call may have it: nobody else does, and it is as it was made.
    pub fn is_free(&self, py: Python<'_>) -> bool {
        // SAFETY: a living array, and a living object.
        let (flags, holders) = unsafe {
            let array = self.doubles(py).as_array_ptr();
            ((*array).fields.flags, pyo3::ffi::Py_REFCNT(self.array.as_ptr()))
        };
        holders == 1 && flags & numpy::npyffi::NPY_ARRAY_WRITEABLE != 0 && self.is_intact(py)
    }

    /// The numbers, if the array is still what it was.
    pub fn numbers<'a>(&'a self, py: Python<'a>) -> Option<&'a [f64]> {
        self.is_intact(py).then(|| slice(self.doubles(py)))
    }

    /// The memory, of an array that is new or free.
    #[allow(clippy::mut_from_ref)] // as `slice_mut`
    pub fn slice_mut<'a>(&'a self, py: Python<'a>) -> &'a mut [f64] {
        slice_mut(self.doubles(py))
    }
}
