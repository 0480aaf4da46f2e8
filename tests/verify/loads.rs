//! Loads on linear systems, in closed form and step by step.

use std::sync::Arc;

use spim::method::{METHODS, MethodInfo, Needs, Options, State, build};
use spim::propagate::Clock;
use spim::system::{Generator, Linear, Load, Problem};

use crate::restarts::choices;

/// `x'' = 1 - x + cos(w t)`; the constant part acts by impulses, the other in closed form.
struct Constant {
    w: f64,
    h: f64,
    sampled: bool,
}

impl Load for Constant {
    fn value(&self, t: f64, f: &mut [f64]) -> spim::Result<()> {
        f.copy_from_slice(&[0.0, f64::from(u8::from(self.sampled)) + (self.w * t).cos()]);
        Ok(())
    }
    fn grid_values(&self, k: u64, rows: &mut [f64]) -> spim::Result<()> {
        let times = (k..).map(|k| k as f64 * self.h);
        times.zip(rows.chunks_exact_mut(2)).try_for_each(|(t, row)| self.value(t, row))
    }
    fn is_sampled(&self) -> bool {
        self.sampled
    }
    fn impulses(&self, _: u64, rows: &mut [f64]) -> spim::Result<()> {
        // phi_1(h A) h [0, 1] = [1 - cos h, sin h].
        for row in rows.chunks_exact_mut(2) {
            row.copy_from_slice(&[2.0 * (0.5 * self.h).sin().powi(2), self.h.sin()]);
        }
        Ok(())
    }
}

fn problem(load: Constant) -> Problem {
    let free = Linear::new(2, vec![0.0, 1.0, -1.0, 0.0]).unwrap();
    let w = load.w;
    let generator = Generator {
        inputs: vec![0.0, 0.0, 1.0, 0.0],
        matrix: vec![0.0, -w, w, 0.0],
        start: vec![1.0, 0.0],
    };
    Problem::Linear(Arc::new(free.with_load(Arc::new(load), generator).unwrap()))
}

fn linear_methods() -> impl Iterator<Item = (&'static MethodInfo, Options)> {
    METHODS
        .iter()
        .filter(|info| matches!(info.needs, Needs::Flow | Needs::Linear))
        .flat_map(|info| choices(info).into_iter().map(move |choice| (*info, choice)))
}

#[test]
fn a_resonant_and_a_constant_load_are_exact() {
    // From rest: x = t sin(t) / 2 + 1 - cos(t).
    let h = 0.125;
    for (info, options) in linear_methods().filter(|(info, _)| info.order.is_none()) {
        let problem = problem(Constant { w: 1.0, h, sampled: true });
        let clock = Clock::steps(h, 1000);
        let mut method = build(info, &problem, h, &options, &mut || Ok(())).unwrap();
        let mut state = State::new(&[0.0; 2], &*method).unwrap();
        let mut rows = vec![0.0; 2000];
        method.fill(0, &clock, &mut state, &mut rows, &mut 0).unwrap();
        for (k, row) in (1..).zip(rows.chunks_exact(2)) {
            let t = f64::from(k) * h;
            let x = 0.5 * t * t.sin() + 1.0 - t.cos();
            assert!(
                (row[0] - x).abs() < 1e-14 * (1.0 + t),
                "{options:?} at step {k}: {} for {x}",
                row[0]
            );
        }
    }
}

#[test]
fn a_restart_under_load_gives_the_same_bits() {
    for (info, options) in linear_methods() {
        for sampled in [false, true] {
            let h = 0.2;
            let problem = problem(Constant { w: 0.3, h, sampled });
            let clock = Clock::steps(h, 700);
            let make = || build(info, &problem, h, &options, &mut || Ok(())).unwrap();
            let mut whole = make();
            let mut state = State::new(&[1.0, 0.0], &*whole).unwrap();
            let mut rows = vec![0.0; 2 * 700];
            whole.fill(0, &clock, &mut state, &mut rows, &mut 0).unwrap();
            for stop in [1, 15, 16, 255, 256, 257, 600] {
                let mut state = State::new(&[1.0, 0.0], &*whole).unwrap();
                let mut first = make();
                for k in 0..stop {
                    first.step(k, clock.t(k), &mut state).unwrap();
                    assert_eq!(state.z, rows[2 * k as usize..][..2], "{} step {k}", info.name);
                }
                let mut rest = vec![0.0; 2 * (700 - stop as usize)];
                make().fill(stop, &clock, &mut state, &mut rest, &mut 0).unwrap();
                assert_eq!(rest, rows[2 * stop as usize..], "{}, stop at {stop}", info.name);
            }
        }
    }
}
