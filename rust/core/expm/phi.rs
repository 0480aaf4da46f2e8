//! The functions `phi_0 = exp`, `phi_k(A) = sum of A^j / (j + k)!`, without any inverse.
//!
//! They are kept as `psi_k = phi_k - I/k!`, `psi_0 = T`, so that slow modes keep their digits, and
//! doubled together with `T`:
//! `psi_k(2 X) = 2^-k [2 psi_k + T psi_k + T/k! + sum over 0 < j < k of psi_j/(k-j)!]`.

use super::arithmetic::{Arithmetic, Slot};
use super::doubling::{Form, decays, whole};
use crate::error::Result;
use crate::linalg::dense::exponent_above;
use crate::linalg::twofold;

/// Largest k.
pub const HIGHEST: usize = 8;

/// The matrix; spoiled.
pub const A: Slot = 0;
const T: Slot = 1;
const SPARE: Slot = 2;
const OTHER: Slot = 3;
const A2: Slot = 4;
const A3: Slot = 5;
const A4: Slot = 6;

/// Where `phi_k` ends up.
pub fn slot(k: usize) -> Slot {
    if k == 0 { T } else { OTHER + k }
}

/// Matrices in use for `phi_0` to `phi_p`.
pub fn slots(p: usize) -> usize {
    (slot(p) + 1).max(A4 + 1)
}

/// Largest norm the Taylor polynomial is used for.
const THETA: f64 = 0.5;

/// Blocks of four terms of the Taylor polynomial: at [`THETA`], what 24 terms leave is below
/// `2^-106` of the first.
const BLOCKS: usize = 6;

/// `1/n!` as pairs.
fn inverse_factorials() -> [[f64; 2]; 4 * BLOCKS + HIGHEST + 1] {
    let mut table = [[1.0, 0.0]; 4 * BLOCKS + HIGHEST + 1];
    for n in 1..table.len() {
        table[n] = twofold::divide(table[n - 1], n as f64);
    }
    table
}

/// `phi_0(A)` to `phi_p(A)`, `p >= 1`, each in its [`slot`].
pub fn phis(x: &mut impl Arithmetic, p: usize) -> Result<()> {
    let norm = x.norms(A)[0];
    let doublings = if norm > 0.0 { exponent_above(norm / THETA).max(0) } else { 0 };
    x.scale(A, -doublings, 1);
    let inverse = inverse_factorials();
    taylor(x, p, &inverse[p + 1..])?;
    for k in (0..p).rev() {
        // psi_k = A (psi_k+1 + I/(k+1)!)
        x.multiply(A, slot(k + 1), None, SPARE)?;
        x.sum([([1.0, 0.0], SPARE), (inverse[k + 1], A)], slot(k));
    }
    let mut form = Form::Increment;
    for _ in 0..doublings {
        if form == Form::Increment && decays(x, T)? {
            to_whole(x, p, &inverse);
            form = Form::Whole;
        }
        for k in (1..=p).rev() {
            double(x, k, form, &inverse)?;
        }
        x.square(T, (form == Form::Increment).then_some(2.0), SPARE)?;
    }
    if form == Form::Increment {
        to_whole(x, p, &inverse);
    }
    Ok(())
}

fn to_whole(x: &mut impl Arithmetic, p: usize, inverse: &[[f64; 2]]) {
    whole(x, T, Form::Increment);
    for k in 1..=p {
        x.add_diagonal(inverse[k], slot(k));
    }
}

/// `psi_p = A (c_0 I + c_1 A + ...)`, by blocks of four terms (Paterson & Stockmeyer).
fn taylor(x: &mut impl Arithmetic, p: usize, c: &[[f64; 2]]) -> Result<()> {
    x.multiply(A, A, None, A2)?;
    x.multiply(A2, A, None, A3)?;
    x.multiply(A2, A2, None, A4)?;
    for block in (0..BLOCKS).rev() {
        let c = &c[4 * block..];
        let terms = [(c[1], A), (c[2], A2), (c[3], A3)];
        if block == BLOCKS - 1 {
            x.sum(terms, OTHER);
        } else {
            x.multiply(A4, OTHER, None, SPARE)?;
            x.sum([([1.0, 0.0], SPARE), terms[0], terms[1], terms[2]], OTHER);
        }
        x.add_diagonal(c[0], OTHER);
    }
    x.multiply(A, OTHER, None, SPARE)?;
    x.swap(SPARE, slot(p));
    Ok(())
}

/// `psi_k`, or `phi_k` where the whole is kept, of twice the matrix.
fn double(x: &mut impl Arithmetic, k: usize, form: Form, inverse: &[[f64; 2]]) -> Result<()> {
    // 2 psi_k + T psi_k; of the whole, W phi_k + phi_k.
    let twice = if form == Form::Increment { 2.0 } else { 1.0 };
    x.multiply(T, slot(k), Some((twice, slot(k))), SPARE)?;
    let scaled = |n: usize| inverse[n].map(|c| c / (1_u32 << k) as f64);
    let unit = scaled(0);
    match form {
        Form::Increment => x.sum([(unit, SPARE), (scaled(k), T)], slot(k)),
        Form::Whole => x.sum([(unit, SPARE)], slot(k)),
    }
    for j in 1..k {
        x.sum([([1.0, 0.0], slot(k)), (scaled(k - j), slot(j))], SPARE);
        x.swap(SPARE, slot(k));
    }
    Ok(())
}
