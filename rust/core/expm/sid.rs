//! Taylor polynomials of degree 4, 8, 15+ and 21+ in 2, 3, 4 and 5 products, and no solve.
//!
//! Sources: Sastre, Linear Algebra Appl. 539 (2018) for degree 8; Sastre, Ibáñez & Defez, Appl. Math.
//! Comput. 340 (2019) for 15+ and 21+. The coefficients are derived anew in multiprecision by
//! `tests/data/generate_coefficients.py`.
//!
//! Everything here is inlined, so that small matrices run it whole at one instruction set.

use super::arithmetic::{Arithmetic, Slot};
use super::coefficients::{SID15, SID21, TAYLOR8};
use super::doubling::{Form, double};
use crate::error::Result;
use crate::linalg::dense::exponent_above;

const ONE: [f64; 2] = [1.0, 0.0];
const ZERO: [f64; 2] = [0.0, 0.0];

/// The matrix to exponentiate; spoiled.
pub const A: Slot = 0;
/// The result.
pub const T: Slot = 1;
const A2: Slot = 2;
const A3: Slot = 3;
const Y0: Slot = 4;
const Y1: Slot = 5;
const LEFT: Slot = 6;
const RIGHT: Slot = 7;

/// Matrices in use.
pub const SLOTS: usize = 8;

/// `T = exp(A) - I`, or `exp(A)` where it decays, with the number of doublings taken.
///
/// The scheme and the number of doublings follow from norms of `A` and its powers, unless
/// `doublings` fixes their number.
#[inline(always)]
pub fn exponential(x: &mut impl Arithmetic, doublings: Option<u32>) -> Result<(Form, u32)> {
    let theta = x.thresholds();
    if let Some(doublings) = doublings {
        x.scale(A, -(doublings as i32), 1);
    }
    let mut norm = x.norms(A)[0];
    // Powers of larger matrices could overflow: they are formed of A / 2^reduced.
    let mut reduced = 0;
    if norm > 1e90 {
        reduced = exponent_above(norm);
        x.scale(A, -reduced, 1);
        norm = x.norms(A)[0];
    }
    x.multiply(A, A, None, A2)?;
    let mut adaptive = 0;
    if norm <= theta.taylor4 {
        taylor4(x)?;
    } else if norm <= theta.taylor8 {
        taylor8(x)?;
    } else if norm <= theta.sid15 {
        sid15(x)?;
    } else {
        x.multiply(A2, A, None, A3)?;
        if doublings.is_none() {
            let norms = [norm, x.norms(A2)[0], x.norms(A3)[0]];
            adaptive = halvings(norms, theta.sid21).map_or(0, |s| (s + reduced).max(0));
        }
        for (matrix, power) in [(A, 1), (A2, 2), (A3, 3)] {
            x.scale(matrix, reduced - adaptive, power);
        }
        sid21(x)?;
    }
    let doublings = doublings.unwrap_or(adaptive as u32);
    let form = double(x, T, LEFT, Form::Increment, doublings)?;
    Ok((form, doublings))
}

/// The least `s` with `alpha <= theta 2^s`, `alpha = min(|A|, max(|A^2|^(1/2), |A^3|^(1/3)))`, which
/// bounds all `|A^k|^(1/k)`, `k >= 2` (Al-Mohy & Higham, 2009); `None` where `alpha` is 0.
#[inline(always)]
pub(super) fn halvings([one, two, three]: [f64; 3], theta: f64) -> Option<i32> {
    let exponent = |norm: f64| (norm >= f64::MIN_POSITIVE).then(|| exponent_above(norm));
    let ceiling = |x: i32, n: i32| -(-x).div_euclid(n);
    let one = exponent(one / theta)?;
    let two = exponent(two / (theta * theta)).map(|e| ceiling(e, 2));
    let three = exponent(three / (theta * theta * theta)).map(|e| ceiling(e, 3));
    // `None` is less than any number.
    two.max(three).map(|powers| powers.min(one))
}

#[inline(always)]
fn taylor4(x: &mut impl Arithmetic) -> Result<()> {
    const SIXTH: [f64; 2] = [1.0 / 6.0, 9.25185853854297e-18];
    const TWENTY_FOURTH: [f64; 2] = [1.0 / 24.0, 2.3129646346357427e-18];
    x.sum([(SIXTH, A), (TWENTY_FOURTH, A2)], RIGHT);
    x.sum([([0.5, 0.0], A2), (ONE, A)], LEFT);
    x.multiply(A2, RIGHT, Some((1.0, LEFT)), T)
}

#[inline(always)]
fn taylor8(x: &mut impl Arithmetic) -> Result<()> {
    let [c1, c2, c3, c4, c5, c6] = TAYLOR8;
    x.sum([(c1, A2), (c2, A)], RIGHT);
    x.multiply(A2, RIGHT, None, Y0)?;
    x.sum([(ONE, Y0), (c3, A2), (c4, A)], LEFT);
    x.sum([(ONE, Y0), (c5, A2)], RIGHT);
    x.sum([(c6, Y0), ([0.5, 0.0], A2), (ONE, A)], Y1);
    x.multiply(LEFT, RIGHT, Some((1.0, Y1)), T)
}

#[inline(always)]
fn sid15(x: &mut impl Arithmetic) -> Result<()> {
    let [c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11, c12, c13, c14] = SID15;
    x.sum([(c1, A2), (c2, A)], RIGHT);
    x.multiply(A2, RIGHT, None, Y0)?;
    x.sum([(ONE, Y0), (c3, A2), (c4, A)], LEFT);
    x.sum([(ONE, Y0), (c5, A2)], RIGHT);
    x.sum([(c6, Y0), (c7, A2)], T);
    x.multiply(LEFT, RIGHT, Some((1.0, T)), Y1)?;
    x.sum([(ONE, Y1), (c8, A2), (c9, A)], LEFT);
    x.sum([(ONE, Y1), (c10, Y0), (c11, A)], RIGHT);
    x.sum([(c12, Y1), (c13, Y0), (c14, A2), (ONE, A)], A3);
    x.multiply(LEFT, RIGHT, Some((1.0, A3)), T)
}

#[inline(always)]
fn sid21(x: &mut impl Arithmetic) -> Result<()> {
    let [
        c1,
        c2,
        c3,
        c4,
        c5,
        c6,
        c7,
        c8,
        c9,
        c10, //
        c11,
        c12,
        c13,
        c14,
        c15,
        c16,
        c17,
        c18,
        c19,
        c20,
    ] = SID21;
    x.sum([(c1, A3), (c2, A2), (c3, A)], RIGHT);
    x.multiply(A3, RIGHT, None, Y0)?;
    let first = [[ONE, c4, c5, c6], [ONE, c7, c8, ZERO], [c9, c10, c11, ZERO]];
    x.sums([Y0, A3, A2, A], first, [LEFT, RIGHT, T]);
    x.multiply(LEFT, RIGHT, Some((1.0, T)), Y1)?;
    let last = [[ONE, ZERO, c12, c13, c14], [ONE, c15, ZERO, ZERO, c16], [c17, c18, c19, c20, ONE]];
    x.sums([Y1, Y0, A3, A2, A], last, [LEFT, RIGHT, T]);
    x.multiply(LEFT, RIGHT, Some((1.0, T)), Y0)?;
    x.swap(Y0, T);
    Ok(())
}
