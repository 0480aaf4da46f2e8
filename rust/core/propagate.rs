//! The walk through time. It knows no method and no system.

use std::ops::{ControlFlow, Range};

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

    /// The clock of a run that started at `t0` with the signed step `h`, has come to step `from` and
    /// goes on to `t1`.
    ///
    /// # Errors
    /// [`Error::Argument`] where `t1` lies before that step, or no whole number of steps away.
    pub fn resumed(t0: f64, h: f64, from: u64, t1: f64) -> Result<Clock> {
        let t = t0 + from as f64 * h;
        let ratio = if h == 0.0 { 0.0 } else { (t1 - t0) / h };
        let nearest = ratio.round();
        let off = (ratio - nearest).abs();
        if !(t1.is_finite() && off <= WHOLE.max(4.0 * f64::EPSILON * nearest.abs())) {
            let end = t0 + ratio.ceil() * h;
            return Err(Error::argument(format!(
                "t_span: what is resumed takes steps of {h} from {t}, which do not end at {t1}; \
                 {end} is the next end that they reach"
            )));
        }
        if nearest < from as f64 || nearest > (1_u64 << 53) as f64 || (h == 0.0 && t1 != t0) {
            return Err(Error::argument(format!(
                "t_span: what is resumed is at {t} with steps of {h}; its end cannot be {t1}"
            )));
        }
        Ok(Clock { t0, t1, h, steps: nearest as u64 })
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

/// Steps `state` through the steps of a range.
///
/// The recorder and the observers see where a run begins and each step; a range that goes on with a
/// recorder that has rows begins nothing. Where nobody needs to look at single steps, the method
/// fills the recorder's memory by itself.
pub fn propagate(
    method: &mut dyn Step,
    clock: &Clock,
    steps: Range<u64>,
    state: &mut State,
    recorder: &mut Recorder,
    observers: &mut [&mut dyn Observer],
    poll: &mut Poll,
) -> Outcome {
    let len = state.z.len();
    let mut k = steps.start;
    let mut seen = Ok(ControlFlow::Continue(()));
    if recorder.rows() == 0 {
        recorder.start(k, clock.t(k), &state.z);
        seen = show(observers, k, clock.t(k), &state.z);
    }
    let mut chunk: Vec<f64> = Vec::new();
    let end = loop {
        match seen {
            Err(error) => break End::Failed(error),
            Ok(ControlFlow::Break(reason)) => {
                recorder.end(k, clock.t(k), &state.z);
                break End::Stopped(reason);
            }
            Ok(ControlFlow::Continue(())) => {}
        }
        if k >= steps.end {
            break End::Finished;
        }
        let most = usize::try_from((steps.end - k).min(poll.stride())).unwrap_or(usize::MAX);
        let mut done = 0;
        let result;
        seen = Ok(ControlFlow::Continue(()));
        if observers.is_empty() && recorder.keeps_all() {
            result = method.fill(k, clock, state, recorder.next_rows(most, len), &mut done);
            recorder.filled(k, done, clock);
        } else {
            // A chunk of one if somebody may stop the run: the state must not be ahead of them.
            let most = if observers.is_empty() { most.min(CHUNK) } else { 1 };
            chunk.resize(most * len, 0.0);
            result = method.fill(k, clock, state, &mut chunk, &mut done);
            for (k, row) in (k + 1..).zip(chunk.chunks_exact(len).take(done)) {
                recorder.record(k, clock.t(k), row);
                seen = show(observers, k, clock.t(k), row);
            }
        }
        k += done as u64;
        if let Err(error) = result {
            break End::Failed(error);
        }
        if let Err(error) = poll.after(done as u64, k, clock) {
            break End::Failed(error);
        }
    };
    Outcome { step: k, rows: recorder.rows(), end }
}

/// Shows a state to one observer after the other, until one has seen enough.
fn show(
    observers: &mut [&mut dyn Observer],
    step: u64,
    t: f64,
    z: &[f64],
) -> Result<ControlFlow<String>> {
    for observer in observers {
        if let ControlFlow::Break(reason) = observer.observe(step, t, z)? {
            return Ok(ControlFlow::Break(reason));
        }
    }
    Ok(ControlFlow::Continue(()))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::method::{self, Options};
    use crate::system::{Linear, Problem};

    /// Notes what it sees; stops or fails at a step.
    #[derive(Default)]
    struct Witness {
        seen: Vec<(u64, f64, f64)>,
        stop: Option<u64>,
        fail: Option<u64>,
    }

    impl Observer for Witness {
        fn observe(&mut self, step: u64, t: f64, z: &[f64]) -> Result<ControlFlow<String>> {
            self.seen.push((step, t, z[0]));
            if self.fail == Some(step) {
                return Err(Error::argument("seen enough"));
            }
            Ok(match self.stop {
                Some(stop) if stop == step => ControlFlow::Break("far enough".into()),
                _ => ControlFlow::Continue(()),
            })
        }
    }

    /// Runs an oscillator; the outcome, times and positions of its rows, and the state.
    fn run(
        range: Range<u64>,
        every: u64,
        state: Option<State>,
        witness: Option<&mut Witness>,
    ) -> (Outcome, Vec<f64>, Vec<f64>, State) {
        let system = Linear::new(2, vec![0.0, 1.0, -1.0, 0.0]).unwrap();
        let problem = Problem::Linear(Arc::new(system));
        let clock = Clock::new(1.0, 3.0, 0.1).unwrap().0;
        let info = method::find("rk4").unwrap();
        let options = Options::default();
        let mut method = method::build(info, &problem, clock.h, &options, &mut || Ok(())).unwrap();
        let mut state = state.unwrap_or_else(|| State::new(&[1.0, 0.0], &*method).unwrap());
        let rows = Recorder::rows_for(range.end - range.start, every, true).unwrap();
        let (mut t, mut z) = (vec![0.0; rows], vec![0.0; 2 * rows]);
        let mut recorder = Recorder::new(&mut t, &mut z, every, Some(range.end));
        let mut observers: Vec<&mut dyn Observer> = Vec::new();
        observers.extend(witness.map(|witness| witness as &mut dyn Observer));
        let mut check = |_, _| Ok(());
        let mut poll = Poll::new(&mut check);
        let recorder = &mut recorder;
        let outcome =
            propagate(&mut *method, &clock, range, &mut state, recorder, &mut observers, &mut poll);
        t.truncate(outcome.rows);
        let q = z.chunks_exact(2).take(outcome.rows).map(|z| z[0]).collect();
        (outcome, t, q, state)
    }

    #[test]
    fn observers_see_the_start_and_every_step_whatever_is_stored() {
        let mut witness = Witness::default();
        let (outcome, t, _, _) = run(0..20, 7, None, Some(&mut witness));
        assert!(matches!(outcome.end, End::Finished));
        assert_eq!(t.len(), 4); // 0, 7, 14 and the last
        let (_, all, q, _) = run(0..20, 1, None, None);
        let seen: Vec<_> = witness.seen.iter().map(|(_, t, q)| (*t, *q)).collect();
        assert_eq!(seen, all.into_iter().zip(q).collect::<Vec<_>>());
    }

    #[test]
    fn an_observer_stops_a_run_with_a_sentence_and_the_state_is_stored() {
        for stop in [0, 1, 9, 20] {
            let mut witness = Witness { stop: Some(stop), ..Witness::default() };
            let (outcome, t, q, state) = run(0..20, 7, None, Some(&mut witness));
            assert!(matches!(&outcome.end, End::Stopped(reason) if reason == "far enough"));
            assert_eq!(outcome.step, stop);
            assert_eq!(
                (t.last(), q.last()),
                (Some(&witness.seen[stop as usize].1), Some(&state.z[0]))
            );
        }
    }

    #[test]
    fn an_error_of_an_observer_ends_the_run_after_the_step_it_has_seen() {
        let mut witness = Witness { fail: Some(5), ..Witness::default() };
        let (outcome, t, _, _) = run(0..20, 1, None, Some(&mut witness));
        assert!(matches!(&outcome.end, End::Failed(error) if error.to_string() == "seen enough"));
        assert_eq!((outcome.step, t.len()), (5, 6));
    }

    #[test]
    fn a_run_that_is_resumed_stores_what_the_whole_run_does() {
        let (_, t, q, _) = run(0..20, 1, None, None);
        let (_, _, _, state) = run(0..8, 1, None, None);
        let (outcome, late, rest, _) = run(8..20, 3, Some(state), None);
        assert_eq!(outcome.step, 20);
        let every = |x: &[f64]| x.iter().skip(8).step_by(3).copied().collect::<Vec<_>>();
        assert_eq!((late, rest), (every(&t), every(&q)));
    }

    #[test]
    fn a_resumed_clock_keeps_its_grid() {
        let whole = Clock::new(1.0, 3.0, 0.1).unwrap().0;
        assert_eq!(Clock::resumed(1.0, 0.1, 8, 3.0).unwrap(), whole);
        for (from, end) in [(8, 2.95), (8, 1.5), (8, f64::NAN), (0, 0.9)] {
            assert!(Clock::resumed(1.0, 0.1, from, end).is_err(), "{end}");
        }
    }
}
