//! The walk through time. It knows no method and no system.

use std::ops::ControlFlow;

use crate::error::{Error, Result};
use crate::method::{State, Step};
use crate::observe::{Observer, Poll, Recorder};

/// The grid of a run: `t0 + k h`, never summed; the last point is `t1` itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    /// Start.
    pub t0: f64,
    /// End.
    pub t1: f64,
    /// Signed step.
    pub h: f64,
    /// Number of steps.
    pub steps: u64,
}

/// Ratios of span and step this near an integer count as that integer; beyond 1e6 steps, within
/// their rounding.
const WHOLE: f64 = 1e-9;

impl Clock {
    /// Steps of size `step > 0` from `t0` to `t1`, backward if `t1 < t0`.
    ///
    /// A span that is no multiple of the step gets `N = ceil(span / step)` equal steps; the second
    /// value says so.
    ///
    /// # Errors
    /// [`Error::Argument`] for a step that is not positive and finite, a span that is not finite,
    /// or more than 2^53 steps.
    pub fn new(t0: f64, t1: f64, step: f64) -> Result<(Clock, bool)> {
        if !(step > 0.0 && step.is_finite()) {
            return Err(Error::argument(format!(
                "step: must be positive and finite, got {step}; to run backward, reverse t_span"
            )));
        }
        if !t0.is_finite() || !t1.is_finite() || !(t1 - t0).is_finite() {
            return Err(Error::argument(format!("t_span: must be finite, got ({t0}, {t1})")));
        }
        let span = t1 - t0;
        let ratio = span.abs() / step;
        if ratio > (1_u64 << 53) as f64 {
            return Err(Error::argument(format!(
                "step: {step:e} divides the span of {span:e} into {ratio:e} steps, more than 2^53"
            )));
        }
        let nearest = ratio.round();
        if (ratio - nearest).abs() <= WHOLE.max(4.0 * f64::EPSILON * nearest) {
            return Ok((Clock { t0, t1, h: step.copysign(span), steps: nearest as u64 }, false));
        }
        let steps = ratio.ceil();
        Ok((Clock { t0, t1, h: span / steps, steps: steps as u64 }, true))
    }

    /// `steps` steps of the signed size `h` from 0.
    pub fn steps(h: f64, steps: u64) -> Clock {
        Clock { t0: 0.0, t1: steps as f64 * h, h, steps }
    }

    /// The time of step `k`.
    pub fn t(&self, k: u64) -> f64 {
        if k == self.steps { self.t1 } else { self.t0 + k as f64 * self.h }
    }
}

/// How a run ended.
#[derive(Debug)]
pub enum End {
    /// At the end of the span.
    Finished,
    /// Where an observer said so.
    Stopped(String),
    /// At an error.
    Failed(Box<Error>),
}

/// What a run has come to. Rows recorded before an error are there.
#[derive(Debug)]
pub struct Outcome {
    /// The step reached.
    pub step: u64,
    /// Rows recorded.
    pub rows: usize,
    /// How it ended.
    pub end: End,
}

/// Rows made at once where not all of them are stored.
const CHUNK: usize = 64;

/// Steps `state` from step `from` to the end of the clock.
///
/// The recorder and the observers see each step; where nobody needs to look at single steps, the
/// method fills the recorder's memory by itself.
pub fn propagate(
    method: &mut dyn Step,
    clock: &Clock,
    from: u64,
    state: &mut State,
    recorder: &mut Recorder,
    observers: &mut [&mut dyn Observer],
    poll: &mut Poll,
) -> Outcome {
    let len = state.z.len();
    if from == 0 {
        recorder.record(0, clock.t0, &state.z);
    }
    let mut chunk: Vec<f64> = Vec::new();
    let mut k = from;
    let end = loop {
        if k == clock.steps {
            break End::Finished;
        }
        let most = usize::try_from((clock.steps - k).min(poll.stride())).unwrap_or(usize::MAX);
        let mut done = 0;
        let result;
        let mut stop = ControlFlow::Continue(());
        if observers.is_empty() && recorder.keeps_all() {
            result = method.fill(k, clock, state, recorder.next_rows(most, len), &mut done);
            recorder.filled(k, done, clock);
        } else {
            // A chunk of one if somebody may stop the run: the state must not be ahead of them.
            let most = if observers.is_empty() { most.min(CHUNK) } else { 1 };
            chunk.resize(most * len, 0.0);
            result = method.fill(k, clock, state, &mut chunk, &mut done);
            for (i, row) in chunk.chunks_exact(len).take(done).enumerate() {
                let k = k + 1 + i as u64;
                recorder.record(k, clock.t(k), row);
                for observer in observers.iter_mut() {
                    if stop.is_continue() {
                        stop = observer.observe(k, clock.t(k), row);
                    }
                }
            }
        }
        k += done as u64;
        if let Err(error) = result {
            break End::Failed(error);
        }
        if let ControlFlow::Break(reason) = stop {
            break End::Stopped(reason);
        }
        if let Err(error) = poll.after(done as u64, k, clock) {
            break End::Failed(error);
        }
    };
    Outcome { step: k, rows: recorder.rows(), end }
}
