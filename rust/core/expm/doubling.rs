//! Scaling and doubling: from a short interval to the whole one.

use super::arithmetic::{Arithmetic, Slot};
use crate::error::{Error, Result};

/// What a slot holds at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// `T = exp(A) - I`.
    Increment,
    /// `exp(A)`: the increment was given up because the exponential decays.
    Whole,
}

/// `doublings` times `T <- 2 T + T T`, the increment of `exp(2 X) = exp(X)^2`.
///
/// Keeping the increment `T = W - I` keeps the digits of slow modes (Zhong's idea; eqs. 36–38 of the
/// paper). Where the exponential decays, `T` tends to `-I` and `W = I + T` would cancel; as soon as
/// the rounding bound of a squaring is the smaller one, the doubling changes over to `W <- W W`.
///
/// `form` says what the slot holds at the start.
#[inline(always)]
pub fn double(
    x: &mut impl Arithmetic,
    t: Slot,
    spare: Slot,
    mut form: Form,
    doublings: u32,
) -> Result<Form> {
    for i in 0..doublings {
        if form == Form::Increment && decays(x, t)? {
            whole(x, t, form);
            form = Form::Whole;
        }
        x.square(t, (form == Form::Increment).then_some(2.0), spare)?;
        if i % 16 == 15 && !x.norms(t)[0].is_finite() {
            return Err(overflow());
        }
    }
    Ok(form)
}

/// Makes the whole exponential of what a slot holds.
#[inline(always)]
pub fn whole(x: &mut impl Arithmetic, t: Slot, form: Form) {
    if form == Form::Increment {
        x.add_diagonal([1.0, 0.0], t);
    }
}

/// Whether squaring `W` rounds less than doubling `T`.
#[inline(always)]
pub fn decays(x: &impl Arithmetic, t: Slot) -> Result<bool> {
    // The 1-norm of W can only be small enough (below 0.8) if its whole diagonal is.
    if (0..x.layout().rows).any(|j| x.diagonal(t, j) > -0.2) {
        return Ok(false);
    }
    let [norm_t, norm_w] = x.norms(t);
    Ok(norm_w * norm_w < 0.1 * (norm_t * norm_t + 2.0 * norm_t))
}

/// The error for an exponential beyond the largest double.
pub fn overflow() -> Box<Error> {
    Error::overflow(
        "the exponential overflows: an entry exceeds 1.8e308; scale the matrix or shorten the step",
    )
}
