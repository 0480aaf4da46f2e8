//! Structure-preserving, high-precision time integration: the numerical core of `spim`.
//!
//! Numbers flow one way. A [`system`] is what is integrated; a [`method`] is bound to it once;
//! [`propagate`](propagate::propagate) walks time and shows each state to [`observe`]rs; the rows
//! come back in memory the caller owns. [`expm`] forms matrix exponentials and steps with them,
//! [`linalg`] holds the kernels, which give the same bits on every machine.
#![allow(non_snake_case)]

pub mod error;
pub mod expm;
pub mod linalg;
pub mod method;
pub mod model;
pub mod observe;
pub mod propagate;
pub mod system;
pub mod tableau;

pub use error::{Error, Result};
