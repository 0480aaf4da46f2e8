//! Taylor polynomials of degree 4, 8, 15+ and 21+ in 2, 3, 4 and 5 products, and no solve.
//!
//! Sources: Sastre, Linear Algebra Appl. 539 (2018) for degree 8; Sastre, Ibáñez & Defez, Appl. Math.
//! Comput. 340 (2019) for 15+ and 21+. The coefficients are derived anew in multiprecision by
//! `tests/data/generate_coefficients.py`.

use super::arithmetic::{Arithmetic, Slot};
use super::coefficients::{SID15, SID21, TAYLOR8};
use super::doubling::{Form, double};
use crate::error::Result;
use crate::linalg::dense::exponent_above;

const ONE: [f64; 2] = [1.0, 0.0];

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

/// `T = exp(A) - I`, or `exp(A)` where it decays, with the number of doublings taken.
///
/// The scheme and the number of doublings follow from norms of `A` and its powers, unless
/// `doublings` fixes their number.
pub fn exponential(x: &mut impl Arithmetic, doublings: Option<u32>) -> Result<(Form, u32)> {
    let theta = x.thresholds();
    if let Some(doublings) = doublings {
        x.scale(A, -(doublings as i32), 1);
    }
    let norm = x.norms(A)[0];
    // Powers of larger matrices could overflow: they are formed of A / 2^reduced.
    let reduced = if norm > 1e90 { exponent_above(norm) } else { 0 };
    x.scale(A, -reduced, 1);
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
        let [second, third] = [x.norms(A2)[0].sqrt(), libm::cbrt(x.norms(A3)[0])];
        let norm = x.norms(A)[0];
        // |A^k| <= alpha^k for all k >= 2 (Al-Mohy & Higham, 2009).
        let alpha = norm.min(second.max(third));
        if doublings.is_none() && alpha > 0.0 {
            adaptive = (exponent_above(alpha / theta.sid21) + reduced).max(0);
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

fn taylor4(x: &mut impl Arithmetic) -> Result<()> {
    const SIXTH: [f64; 2] = [1.0 / 6.0, 9.25185853854297e-18];
    const TWENTY_FOURTH: [f64; 2] = [1.0 / 24.0, 2.3129646346357427e-18];
    x.sum([(SIXTH, A), (TWENTY_FOURTH, A2)], RIGHT);
    x.sum([([0.5, 0.0], A2), (ONE, A)], LEFT);
    x.multiply(A2, RIGHT, Some((1.0, LEFT)), T)
}

fn taylor8(x: &mut impl Arithmetic) -> Result<()> {
    let [c1, c2, c3, c4, c5, c6] = TAYLOR8;
    x.sum([(c1, A2), (c2, A)], RIGHT);
    x.multiply(A2, RIGHT, None, Y0)?;
    x.sum([(ONE, Y0), (c3, A2), (c4, A)], LEFT);
    x.sum([(ONE, Y0), (c5, A2)], RIGHT);
    x.sum([(c6, Y0), ([0.5, 0.0], A2), (ONE, A)], Y1);
    x.multiply(LEFT, RIGHT, Some((1.0, Y1)), T)
}

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

fn sid21(x: &mut impl Arithmetic) -> Result<()> {
    let [
        c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, //
        c11, c12, c13, c14, c15, c16, c17, c18, c19, c20,
    ] = SID21;
    x.sum([(c1, A3), (c2, A2), (c3, A)], RIGHT);
    x.multiply(A3, RIGHT, None, Y0)?;
    x.sum([(ONE, Y0), (c4, A3), (c5, A2), (c6, A)], LEFT);
    x.sum([(ONE, Y0), (c7, A3), (c8, A2)], RIGHT);
    x.sum([(c9, Y0), (c10, A3), (c11, A2)], T);
    x.multiply(LEFT, RIGHT, Some((1.0, T)), Y1)?;
    x.sum([(ONE, Y1), (c12, A3), (c13, A2), (c14, A)], LEFT);
    x.sum([(ONE, Y1), (c15, Y0), (c16, A)], RIGHT);
    x.sum([(c17, Y1), (c18, Y0), (c19, A3), (c20, A2), (ONE, A)], T);
    x.multiply(LEFT, RIGHT, Some((1.0, T)), Y0)?;
    x.swap(Y0, T);
    Ok(())
}
