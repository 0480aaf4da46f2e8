//! What several methods say and do.

use crate::error::{Error, Result};
use crate::system::Flow;

/// `out += M x`, M row by row.
pub fn add_product(matrix: &[f64], x: &[f64], out: &mut [f64]) {
    for (out, row) in out.iter_mut().zip(matrix.chunks_exact(x.len())) {
        *out += row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
    }
}

/// Largest magnitude; not a number where an entry is not.
pub fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |largest: f64, x| if x.abs() <= largest { largest } else { x.abs() })
}

/// The error of an iteration that does not end; `left` in parts of the state.
pub fn not_solved(name: &str, t: f64, step: u64, iterations: u32, left: f64) -> Box<Error> {
    Box::new(Error::Convergence {
        message: format!(
            "{name}: iterations stopped at t = {t:.6} after {iterations}, change {left:.1e} of the \
             state; reduce the step, or give the system its jacobian= or linear="
        ),
        t,
        step,
        iterations,
        residual: left,
    })
}

/// The same of a step from a state; where rates there are no numbers, an error that says so.
pub fn not_solved_from<S: Flow + ?Sized>(
    name: &str,
    system: &S,
    (t, z): (f64, &[f64]),
    iterations: u32,
    left: f64,
) -> Box<Error> {
    let mut f = vec![0.0; z.len()];
    if left.is_finite() || system.rate(t, z, &mut f).is_err() {
        return not_solved(name, t, 0, iterations, left);
    }
    match f.iter().position(|x| !x.is_finite()) {
        None => not_solved(name, t, 0, iterations, f64::INFINITY),
        Some(component) => Box::new(Error::Model {
            message: format!(
                "{name}: component {component} of z' is {} at t = {t}",
                f[component].to_string().to_lowercase()
            ),
            t,
            step: 0,
        }),
    }
}

/// Iterations at most.
const CAP: u32 = 100;

/// Change, in parts of the state, below which one that does not shrink is rounding.
const SMALL: f64 = 1e-12;

/// Iterates until nothing moves, or rounding alone; `go` gives how far the newest iteration moved, and the
/// size of what it moved.
///
/// # Errors
/// Those of `go`; [`Error::Convergence`] where it does not end.
pub fn iterate(
    name: &str,
    t: f64,
    step: u64,
    mut go: impl FnMut() -> Result<[f64; 2]>,
) -> Result<()> {
    let mut before = f64::INFINITY;
    for iteration in 1.. {
        let [moved, size] = go()?;
        if moved == 0.0 || (moved >= before && moved <= SMALL * size) {
            break;
        }
        if iteration == CAP || !moved.is_finite() {
            return Err(not_solved(name, t, step, iteration, moved / size));
        }
        before = moved;
    }
    Ok(())
}

/// How far it is from `last`, which becomes the way, to `end`, and the size of that.
pub fn way(last: &mut [f64], end: &[f64]) -> [f64; 2] {
    last.iter_mut().zip(end).for_each(|(last, end)| *last -= end);
    [largest(last), largest(end)]
}

/// Rows to which phi-functions are formed in pairs of doubles.
pub const PAIRS_TO: usize = 32;

/// The Jacobian of a system, row by row; by differences where the system does not know it, with four
/// states of scratch. Evaluations it took.
///
/// # Errors
/// Those of the system.
pub fn jacobian(
    system: &dyn Flow,
    t: f64,
    z: &[f64],
    h: f64,
    out: &mut [f64],
    scratch: &mut [f64],
) -> Result<u64> {
    if system.jacobian(t, z, out)? {
        return Ok(0);
    }
    let m = z.len();
    let (known, scratch) = scratch.split_at_mut(m);
    let (moved, scratch) = scratch.split_at_mut(m);
    let (state, distance) = scratch.split_at_mut(m);
    system.rate(t, z, known)?;
    state.copy_from_slice(z);
    distances(z, known, h, distance);
    for j in 0..m {
        state[j] = z[j] + distance[j];
        let d = state[j] - z[j];
        system.rate(t, state, moved)?;
        for i in 0..m {
            out[m * i + j] = (moved[i] - known[i]) / d;
        }
        state[j] = z[j];
    }
    Ok(m as u64 + 1)
}

/// The distance for a difference in each component of a rate: half the digits for the difference, half
/// for what it neglects; of one that is zero, by what a step makes of it.
fn distances(z: &[f64], rate: &[f64], h: f64, out: &mut [f64]) {
    let made = |z: f64, rate: f64| z.abs().max((h * rate).abs());
    let size = z.iter().zip(rate).fold(0.0_f64, |size, (z, rate)| size.max(made(*z, *rate)));
    for ((out, z), rate) in out.iter_mut().zip(z).zip(rate) {
        let own = made(*z, *rate).max(1e-3 * size);
        *out = 1.5e-8 * if own > 0.0 { own } else { 1.0 };
    }
}

/// Refuses a new state that is not finite.
///
/// # Errors
/// [`Error::Model`] naming the component.
pub fn check_finite(name: &str, t: f64, step: u64, z: &[f64]) -> Result<()> {
    match z.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(component) => Err(Box::new(Error::Model {
            message: format!(
                "{name}: component {component} of the state would be {} after the step from t = {t}",
                z[component]
            ),
            t,
            step,
        })),
    }
}
