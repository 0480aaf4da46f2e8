//! Padé approximants `[l/m]` of the exponential: at the small scale, or doubled apart (the paper's).
//!
//! `r(X) = D(X)^-1 N(X)`. Diagonal approximants, `l = m`, are symplectic for a Hamiltonian `X`
//! (Theorem 2 of the paper); off-diagonal ones are not.

use super::arithmetic::{Arithmetic, Division, Slot};
use super::coefficients::PADE_THETA;
use super::doubling::{Form, double};
use crate::error::Result;
use crate::linalg::dense::exponent_above;
use crate::linalg::twofold;

/// Largest degree of numerator and denominator.
pub const HIGHEST: usize = 13;

type Coefficients = [[f64; 2]; HIGHEST + 1];

/// The matrix to exponentiate; spoiled.
pub const A: Slot = super::sid::A;
/// The result.
pub const T: Slot = super::sid::T;
const A2: Slot = 2;
const A4: Slot = 3;
const A6: Slot = 4;
const P: Slot = 5;
const Q: Slot = 6;
const DENOMINATOR: Slot = 7;
const NUMERATOR: Slot = 8;

/// Matrices in use.
pub const SLOTS: usize = 9;

/// The increment by `[l/m]` at the small scale, `T = D^-1 (N - D)`, then doubling.
pub fn small_scale(
    x: &mut impl Division,
    [l, m]: [usize; 2],
    doublings: Option<u32>,
) -> Result<(Form, u32)> {
    let norm = x.norms(A)[0];
    let adaptive = || match norm {
        0.0 => 0,
        norm => exponent_above(norm / PADE_THETA[l][m]).max(0) as u32,
    };
    let doublings = doublings.unwrap_or_else(adaptive);
    x.scale(A, -(doublings as i32), 1);
    powers(x, l.max(m))?;
    let (numerator, denominator) = coefficients(l, m);
    if l == m {
        // N = V + U, D = V - U with V even and U odd, hence N - D = 2 U.
        let [even, odd] = split(&numerator);
        even_polynomial(x, &even, NUMERATOR)?;
        even_polynomial(x, &odd, Q)?;
        x.multiply(A, Q, None, P)?;
        x.sum([([1.0, 0.0], NUMERATOR), ([-1.0, 0.0], P)], DENOMINATOR);
        x.sum([([2.0, 0.0], P)], NUMERATOR);
    } else {
        let difference =
            std::array::from_fn(|j| twofold::sum(numerator[j], twofold::negative(denominator[j])));
        polynomial(x, &denominator, DENOMINATOR)?;
        polynomial(x, &difference, NUMERATOR)?;
    }
    x.solve(DENOMINATOR, NUMERATOR, P, T)?;
    let form = double(x, T, P, Form::Increment, doublings)?;
    Ok((form, doublings))
}

/// Eqs. (39), (44): increments of numerator and denominator doubled apart, one ratio at the end,
/// `T = (I + Tb)^-1 (Ta - Tb)`.
pub fn doubled_apart(
    x: &mut impl Division,
    [l, m]: [usize; 2],
    doublings: u32,
) -> Result<(Form, u32)> {
    x.scale(A, -(doublings as i32), 1);
    powers(x, l.max(m))?;
    let (mut numerator, mut denominator) = coefficients(l, m);
    // Eq. (44): keep Ta and Tb, never I + Ta and I + Tb, or their digits are lost.
    (numerator[0], denominator[0]) = ([0.0; 2], [0.0; 2]);
    polynomial(x, &numerator, NUMERATOR)?;
    polynomial(x, &denominator, DENOMINATOR)?;
    for slot in [NUMERATOR, DENOMINATOR] {
        if double(x, slot, P, Form::Increment, doublings)? == Form::Whole {
            x.add_diagonal([-1.0, 0.0], slot);
        }
    }
    x.sum([([1.0, 0.0], NUMERATOR), ([-1.0, 0.0], DENOMINATOR)], Q);
    x.add_diagonal([1.0, 0.0], DENOMINATOR);
    x.solve(DENOMINATOR, Q, P, T)?;
    Ok((Form::Increment, doublings))
}

/// Eqs. (36)–(38): the increment of a Taylor polynomial, doubled.
pub fn taylor(x: &mut impl Arithmetic, order: usize, doublings: u32) -> Result<(Form, u32)> {
    x.scale(A, -(doublings as i32), 1);
    x.sum([(twofold::ratio(1.0, order as f64), A)], T);
    for k in (1..order).rev() {
        // T <- (X + X T) / k
        x.multiply(A, T, Some((1.0, A)), P)?;
        x.sum([(twofold::ratio(1.0, k as f64), P)], T);
    }
    let form = double(x, T, P, Form::Increment, doublings)?;
    Ok((form, doublings))
}

/// Coefficients of numerator and denominator, as pairs.
fn coefficients(l: usize, m: usize) -> (Coefficients, Coefficients) {
    let (mut numerator, mut denominator) = ([[0.0; 2]; HIGHEST + 1], [[0.0; 2]; HIGHEST + 1]);
    (numerator[0], denominator[0]) = ([1.0, 0.0], [1.0, 0.0]);
    for j in 1..=l.max(m) {
        let below = ((l + m + 1 - j) * j) as f64;
        let next = |last: [f64; 2], degree: usize| {
            twofold::divide(twofold::times(last, (degree + 1).saturating_sub(j) as f64), below)
        };
        numerator[j] = next(numerator[j - 1], l);
        denominator[j] = twofold::negative(next(denominator[j - 1], m));
    }
    (numerator, denominator)
}

/// `A^2`, `A^4`, `A^6` as far as polynomials of this degree need them.
fn powers(x: &mut impl Arithmetic, degree: usize) -> Result<()> {
    for (from, to, needed) in [(A, A2, 2), (A2, A4, 4), (A4, A6, 6)] {
        if degree >= needed {
            let left = if to == A6 { A2 } else { from };
            x.multiply(left, from, None, to)?;
        }
    }
    Ok(())
}

/// Coefficients of even and of odd powers.
fn split(c: &Coefficients) -> [[[f64; 2]; 7]; 2] {
    [std::array::from_fn(|k| c[2 * k]), std::array::from_fn(|k| c[2 * k + 1])]
}

/// `out = sum c_k A^k`.
fn polynomial(x: &mut impl Arithmetic, c: &Coefficients, out: Slot) -> Result<()> {
    let [even, odd] = split(c);
    even_polynomial(x, &even, out)?;
    even_polynomial(x, &odd, Q)?;
    x.multiply(A, Q, Some((1.0, out)), P)?;
    x.swap(P, out);
    Ok(())
}

/// `out = sum c_k A^2k`, with `P` and `T` as work space.
fn even_polynomial(x: &mut impl Arithmetic, c: &[[f64; 2]; 7], out: Slot) -> Result<()> {
    let used = c.iter().rposition(|c| c[0] != 0.0).unwrap_or(0);
    match used {
        0 => x.sum([([0.0; 2], A)], out),
        1 => x.sum([(c[1], A2)], out),
        2 => x.sum([(c[1], A2), (c[2], A4)], out),
        3 => x.sum([(c[1], A2), (c[2], A4), (c[3], A6)], out),
        _ => {
            x.sum([(c[4], A2), (c[5], A4), (c[6], A6)], P);
            x.sum([(c[1], A2), (c[2], A4), (c[3], A6)], T);
            x.multiply(A6, P, Some((1.0, T)), out)?;
        }
    }
    x.add_diagonal(c[0], out);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_two_has_the_papers_coefficients() {
        let (n, d) = coefficients(2, 2);
        assert_eq!(n[..3], [[1.0, 0.0], [0.5, 0.0], twofold::ratio(1.0, 12.0)]);
        assert_eq!(d[..3], [[1.0, 0.0], [-0.5, 0.0], twofold::ratio(1.0, 12.0)]);
    }

    #[test]
    fn first_order_terms_of_numerator_and_denominator_differ_by_one() {
        for l in 0..=HIGHEST {
            for m in 0..=HIGHEST {
                if l + m > 0 {
                    let (n, d) = coefficients(l, m);
                    let one = twofold::sum(n[1], twofold::negative(d[1]));
                    assert!((one[0] - 1.0).abs() + one[1].abs() < 1e-31, "[{l}/{m}]: {one:?}");
                }
            }
        }
    }
}
