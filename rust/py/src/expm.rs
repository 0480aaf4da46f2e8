//! `spim.expm`.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use spim::expm::{Recipe, Scheme, balanced_norm, exponentials};
use spim::linalg::dense::is_finite;
use spim::method::nearest;

use crate::convert::{self, Numbers, numbers, slice, slice_mut};
use crate::error::{PrecisionWarning, guarded, to_python};
use crate::watch;

const METHODS: [(&str, &[&str]); 7] = [
    ("auto", &["doublings"]),
    ("exact", &["doublings"]),
    ("sid", &["doublings"]),
    ("pade", &["pade", "doublings"]),
    ("pim", &["order", "doublings"]),
    ("spim", &["pade", "doublings"]),
    ("half", &[]),
];

/// Multiply-adds below which the interpreter is not let go: about 50 us of work.
const SHORT: usize = 400_000;

/// Doubles of a stack that are worked through at once: some 20 ms of work.
const PIECE: usize = 1 << 19;

/// The options of schemes, as given.
#[derive(Default)]
pub struct Given<'a, 'py> {
    /// One degree or two.
    pub pade: Option<&'a Bound<'py, PyAny>>,
    /// Order of a Taylor polynomial.
    pub order: Option<&'a Bound<'py, PyAny>>,
    /// Number of doublings.
    pub doublings: Option<&'a Bound<'py, PyAny>>,
}

impl Given<'_, '_> {
    /// Refuses options that the method does not have.
    fn check(&self, method: &str, allowed: &[&str]) -> PyResult<()> {
        let given = [("pade", self.pade), ("order", self.order), ("doublings", self.doublings)];
        match given.iter().find(|(name, value)| value.is_some() && !allowed.contains(name)) {
            None => Ok(()),
            Some((name, _)) => {
                let allowed = if allowed.is_empty() { "none".into() } else { allowed.join(", ") };
                Err(PyTypeError::new_err(format!(
                    "method '{method}' has no option '{name}'; it has {allowed}"
                )))
            }
        }
    }
}

/// What a name and options ask for, for matrices of `rows` rows.
pub fn recipe(rows: usize, method: &Bound<'_, PyAny>, given: &Given) -> PyResult<Recipe> {
    let method = convert::text("method", method)?;
    let Some((_, allowed)) = METHODS.iter().find(|(name, _)| *name == method) else {
        let names = METHODS.map(|(name, _)| name);
        return Err(PyValueError::new_err(format!(
            "unknown method '{method}'; did you mean '{}'? (methods: {})",
            nearest(&method, names.into_iter()),
            names.join(", ")
        )));
    };
    given.check(&method, allowed)?;
    let order = given.order.map(|order| convert::count("order", order)).transpose()?;
    let doublings = given.doublings.map(|count| convert::count("doublings", count)).transpose()?;
    let scheme = match &*method {
        "exact" => Scheme::Exact,
        "sid" => Scheme::Sid,
        "pade" => Scheme::Pade(given.pade.map_or(Ok([13, 13]), degrees)?),
        "pim" => Scheme::Pim(order.unwrap_or(4) as usize),
        "half" => Scheme::Half,
        "spim" => Scheme::Spim(given.pade.map_or(Ok([2, 2]), degrees)?),
        _ => Recipe::auto(rows).scheme,
    };
    let doublings = doublings.map(|count| u32::try_from(count).unwrap_or(u32::MAX));
    Recipe { scheme, doublings }.check().map_err(to_python)
}

/// `l` or `(l, m)`.
fn degrees(value: &Bound<'_, PyAny>) -> PyResult<[usize; 2]> {
    if let Ok((l, m)) = value.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() {
        return Ok([convert::count("pade", &l)? as usize, convert::count("pade", &m)? as usize]);
    }
    let l = convert::count("pade", value)? as usize;
    Ok([l, l])
}

/// Exponential of a square matrix, or of each of a stack of them.
///
/// Parameters
/// ----------
/// A : array_like (..., m, m)
///     Real or complex. Integers, booleans and single precision become float64; complex matrices
///     are treated as real ones of twice the size.
/// method : {"auto", "exact", "sid", "half", "pade", "pim", "spim"}
///     "exact" works in pairs of doubles: the error is at most 0.51 units in the last place of the
///     largest entry while the 1-norm is at most 1e12, and entries are correctly rounded but for
///     rare ones. "sid" is a Taylor scheme in doubles (Sastre, Ibáñez & Defez 2019), "pade" the
///     ratio at the small scale, "half" half-size doubling in doubles of separable matrices,
///     ``[0 P; R 0]`` with symmetric blocks: fast, for moderate stiffness. "pim" and "spim" are the paper's (eqs. 36-38; 39, 44), with fixed
///     numbers of doublings. "auto" is "exact" to m = 32 and "sid" above.
/// doublings : int, optional
///     How often the matrix is halved first; default 20 for "pim" and "spim", from norms otherwise.
/// pade : int or (int, int), optional
///     Degrees l or (l, m) of the ratio, 0 to 13; default 13 for "pade", 2 for "spim". The ratio is
///     symplectic for Hamiltonian matrices only where l = m.
/// order : int, optional
///     Order of the Taylor polynomial of "pim", 1 to 30, default 4.
///
/// Returns
/// -------
/// ndarray (..., m, m)
///     float64, or complex128 for complex input.
///
/// Raises
/// ------
/// ValueError
///     Not square, or an entry that is not finite (its index is named).
/// TypeError
///     Not numbers; an option the method does not have.
/// OverflowError
///     An entry of the result exceeds 1.8e308.
/// SingularMatrixError
///     The denominator of a ratio is singular ("pade", "spim").
///
/// Warns
/// -----
/// PrecisionWarning
///     1-norm above 1e13 (1e15 for "exact"): no digit of the result can be relied on.
#[pyfunction]
#[pyo3(
    signature = (A, *, method=None, pade=None, order=None, doublings=None),
    text_signature = "(A, *, method='auto', pade=None, order=None, doublings=None)"
)]
#[allow(non_snake_case)]
pub fn expm<'py>(
    A: &Bound<'py, PyAny>,
    method: Option<&Bound<'py, PyAny>>,
    pade: Option<&Bound<'py, PyAny>>,
    order: Option<&Bound<'py, PyAny>>,
    doublings: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let given = Given { pade, order, doublings };
    match numbers("A", A)? {
        Numbers::Real(a) => {
            let shape = a.shape();
            let rows = square(shape)?;
            let recipe = chosen(A.py(), rows, method, &given)?;
            let finite = |part: &[f64]| match is_finite(part) {
                true => Ok(()),
                false => convert::check_finite("A", shape, slice(&a)),
            };
            let out = convert::empty(a.py(), shape)?;
            run(a.py(), rows, recipe, slice(&a), finite, slice_mut(&out))?;
            Ok(out.into_any())
        }
        Numbers::Complex(re, im) => {
            let shape = re.shape().to_vec();
            let rows = square(&shape)?;
            let recipe = chosen(A.py(), rows, method, &given)?;
            let py = re.py();
            let (re, im) = (slice(&re), slice(&im));
            convert::check_finite("A", &shape, re)?;
            convert::check_finite("A (imaginary part)", &shape, im)?;
            let (out_re, out_im) = (convert::empty(py, &shape)?, convert::empty(py, &shape)?);
            let size = (rows * rows).max(1);
            let piece = size * (PIECE / 4 / size).max(1);
            let mut embedded = zeroed(4 * piece.min(re.len()))?;
            let mut whole = zeroed(embedded.len())?;
            let parts = re.chunks(piece).zip(im.chunks(piece));
            let outs =
                slice_mut(&out_re).chunks_mut(piece).zip(slice_mut(&out_im).chunks_mut(piece));
            for ((re, im), (out_re, out_im)) in parts.zip(outs) {
                let embedded = &mut embedded[..4 * re.len()];
                let whole = &mut whole[..4 * re.len()];
                embed(rows, re, im, embedded);
                run(py, 2 * rows, recipe, embedded, |_| Ok(()), whole)?;
                extract(rows, whole, out_re, out_im);
            }
            let unit = convert::numpy(py)?.getattr("complex128")?.call1((0.0, 1.0))?;
            out_re.into_any().add(out_im.into_any().mul(unit)?)
        }
    }
}

fn chosen(
    py: Python<'_>,
    rows: usize,
    method: Option<&Bound<'_, PyAny>>,
    given: &Given,
) -> PyResult<Recipe> {
    match method {
        Some(method) => recipe(rows, method, given),
        None => recipe(rows, pyo3::intern!(py, "auto").as_any(), given),
    }
}

/// The size of square matrices of this shape.
pub fn square(shape: &[usize]) -> PyResult<usize> {
    match shape {
        [.., rows, columns] if rows == columns => Ok(*rows),
        _ => Err(PyValueError::new_err(format!(
            "A: must be square, (..., m, m), got shape {}",
            shown(shape)
        ))),
    }
}

/// A shape as Python writes it.
pub fn shown(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

fn reserve(memory: &mut Vec<f64>, len: usize) -> PyResult<()> {
    memory.try_reserve_exact(len).map_err(|_| {
        PyMemoryError::new_err(format!("A: no memory for {len} doubles of work space"))
    })
}

fn zeroed(len: usize) -> PyResult<Vec<f64>> {
    let mut memory = Vec::new();
    reserve(&mut memory, len)?;
    memory.resize(len, 0.0);
    Ok(memory)
}

/// Row by row is the transposed problem column by column: `exp(A^T) = exp(A)^T`.
///
/// Long stacks go in pieces, looking outside between them: each is checked and copied while the
/// interpreter is held.
fn run(
    py: Python<'_>,
    rows: usize,
    recipe: Recipe,
    a: &[f64],
    finite: impl Fn(&[f64]) -> PyResult<()>,
    out: &mut [f64],
) -> PyResult<()> {
    if a.is_empty() {
        return Ok(());
    }
    let mut norm = 0.0_f64;
    if a.len() * rows <= SHORT {
        finite(a)?;
        norm =
            guarded(|| exponentials(rows, recipe, a, out, &mut || Ok(())))?.map_err(to_python)?;
    } else {
        let size = rows * rows;
        let piece = size * (PIECE / size).max(1);
        let mut copy = Vec::new();
        reserve(&mut copy, piece.min(a.len()))?;
        for (a, out) in a.chunks(piece).zip(out.chunks_mut(piece)) {
            finite(a)?;
            copy.clear();
            copy.extend_from_slice(a);
            let watch = &mut watch::signals();
            let found = py.detach(|| guarded(|| exponentials(rows, recipe, &copy, out, watch)))?;
            norm = norm.max(found.map_err(to_python)?);
            py.check_signals()?;
        }
    }
    warn_of_size(py, rows, recipe, norm, 1.0, a)
}

/// Warns where a 1-norm of `tau A`, in balanced units, leaves no digits, for matrices of a stack, row
/// by row; `about` is that of the transposed ones as given, infinite if it is not known.
pub fn warn_of_size(
    py: Python<'_>,
    rows: usize,
    recipe: Recipe,
    about: f64,
    tau: f64,
    stack: &[f64],
) -> PyResult<()> {
    // Norms of a matrix and of its transpose differ by no more than the number of rows.
    if about <= recipe.precision_limit() / rows as f64 {
        return Ok(());
    }
    let limit = recipe.precision_limit();
    let mut largest = 0.0_f64;
    for a in stack.chunks_exact(rows * rows) {
        let columns = (0..rows).map(|j| (0..rows).map(|i| (tau * a[i * rows + j]).abs()).sum());
        if columns.fold(0.0, f64::max) > limit {
            largest = largest.max(balanced_norm(rows, a, tau));
        }
    }
    if largest <= limit {
        return Ok(());
    }
    let text = std::ffi::CString::new(format!(
        "the 1-norm is {largest:.1e}: no digit of the exponential can be relied on above {:.0e}; \
         shorten the step or change units",
        limit
    ))
    .expect("no nul in the text");
    PyErr::warn(py, &py.get_type::<PrecisionWarning>(), &text, 1)
}

/// `[Re -Im; Im Re]` of each matrix.
fn embed(rows: usize, re: &[f64], im: &[f64], out: &mut [f64]) {
    let size = rows * rows;
    let parts = re.chunks_exact(size).zip(im.chunks_exact(size));
    for ((re, im), out) in parts.zip(out.chunks_exact_mut(4 * size)) {
        for i in 0..rows {
            for j in 0..rows {
                let (x, y) = (re[i * rows + j], im[i * rows + j]);
                out[i * 2 * rows + j] = x;
                out[i * 2 * rows + rows + j] = -y;
                out[(rows + i) * 2 * rows + j] = y;
                out[(rows + i) * 2 * rows + rows + j] = x;
            }
        }
    }
}

/// Real and imaginary parts back from the embedding.
fn extract(rows: usize, whole: &[f64], re: &mut [f64], im: &mut [f64]) {
    let size = rows * rows;
    let parts = re.chunks_exact_mut(size).zip(im.chunks_exact_mut(size));
    for (whole, (re, im)) in whole.chunks_exact(4 * size).zip(parts) {
        for i in 0..rows {
            let (top, bottom) = (&whole[i * 2 * rows..], &whole[(rows + i) * 2 * rows..]);
            re[i * rows..][..rows].copy_from_slice(&top[..rows]);
            im[i * rows..][..rows].copy_from_slice(&bottom[..rows]);
        }
    }
}
