//! One way out of long work: signals, about every 20 ms.

use std::time::{Duration, Instant};

use pyo3::prelude::*;
use spim::Result;

use crate::error::from_python;

const APART: Duration = Duration::from_millis(20);

/// A look at pending signals, gated by the clock: Ctrl-C raises `KeyboardInterrupt`.
pub fn signals() -> impl FnMut() -> Result<()> {
    let mut last = Instant::now();
    move || {
        if last.elapsed() < APART {
            return Ok(());
        }
        last = Instant::now();
        Python::attach(|py| py.check_signals()).map_err(from_python)
    }
}
