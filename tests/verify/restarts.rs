//! A restart is a copy of the state: the same bits, for every method.

use std::sync::Arc;

use spim::method::{METHODS, MethodInfo, Needs, Options, State, Value, build};
use spim::propagate::Clock;
use spim::system::{Flow, Linear, Problem, Separable, Structural};

/// `M q'' + K q = 0` with diagonal M as a separable system.
struct Springs {
    mass: Vec<f64>,
    stiffness: Vec<f64>,
}

impl Flow for Springs {
    fn len(&self) -> usize {
        2 * self.mass.len()
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> spim::Result<()> {
        let n = self.mass.len();
        let ((q, p), (dq, dp)) = (z.split_at(n), f.split_at_mut(n));
        self.velocity(p, dq)?;
        self.force(t, q, dp)
    }
}

impl Separable for Springs {
    fn velocity(&self, p: &[f64], rate: &mut [f64]) -> spim::Result<()> {
        rate.iter_mut().zip(p.iter().zip(&self.mass)).for_each(|(rate, (p, m))| *rate = p / m);
        Ok(())
    }
    fn force(&self, _t: f64, q: &[f64], rate: &mut [f64]) -> spim::Result<()> {
        for (rate, row) in rate.iter_mut().zip(self.stiffness.chunks_exact(q.len())) {
            *rate = -row.iter().zip(q).map(|(k, q)| k * q).sum::<f64>();
        }
        Ok(())
    }
}

/// `M q'' + K q = 0` with diagonal M, as a method needs it: for modes without coupling.
pub fn structure(info: &MethodInfo, mass: &[f64], stiffness: &[f64]) -> Problem {
    if info.needs == Needs::Split {
        let springs = Springs { mass: mass.to_vec(), stiffness: stiffness.to_vec() };
        return Problem::Separable(Arc::new(springs));
    }
    let n = mass.len();
    let (mut a, mut m) = (vec![0.0; 4 * n * n], vec![0.0; n * n]);
    for i in 0..n {
        m[i * n + i] = mass[i];
        a[i * 2 * n + n + i] = 1.0 / mass[i];
        for j in (0..n).filter(|&j| i == j || info.needs != Needs::Modes) {
            a[(n + i) * 2 * n + j] = -stiffness[i * n + j];
        }
    }
    let linear = Arc::new(Linear::new(2 * n, a).unwrap());
    if info.needs != Needs::Structural {
        return Problem::Linear(linear);
    }
    let zero = vec![0.0; n * n];
    let structure = Structural {
        linear,
        mass: m,
        damping: zero.clone(),
        gyroscopic: zero,
        stiffness: stiffness.to_vec(),
    };
    Problem::Structural(Arc::new(structure.check().unwrap()))
}

fn problem(info: &MethodInfo) -> Problem {
    structure(info, &[1.0, 2.0], &[4.0, -1.0, -1.0, 3.0])
}

/// A method at its defaults and, where it has the option, with exact correction.
pub fn choices(info: &MethodInfo) -> Vec<Options> {
    let exact = Options(vec![("correction".into(), Value::Text("exact".into()))]);
    match info.options.iter().any(|option| option.name == "correction") {
        true => vec![Options::default(), exact],
        false => vec![Options::default()],
    }
}

#[test]
fn a_step_that_fails_leaves_the_state_as_it_was() {
    // Growth by e^5 a step: beyond the largest double amid a block, after 142 steps; by e^11.1: with
    // step 64, the first of a block.
    for (info, rate) in METHODS.iter().flat_map(|info| [(info, 5.0), (info, 11.1)]) {
        let a = vec![rate, 0.0, 0.0, 0.9 * rate];
        let problem = match info.needs {
            // A negative stiffness.
            Needs::Structural
            | Needs::Separable
            | Needs::Split
            | Needs::Canonical
            | Needs::Potential => structure(info, &[1.0], &[-rate * rate]),
            _ => Problem::Linear(Arc::new(Linear::new(2, a).unwrap())),
        };
        for options in choices(info) {
            let mut method = build(info, &problem, 1.0, &options, &mut || Ok(())).unwrap();
            let mut state = State::new(&[1.0, 1.0], &*method).unwrap();
            let mut k = 0;
            let before = loop {
                let before = state.clone();
                if method.step(k, k as f64, &mut state).is_err() {
                    break before;
                }
                k += 1;
                assert!(k < 10_000, "{}: no end of growth", info.name);
            };
            // Explicit compositions, far beyond their stability, grow by more.
            let least = if info.needs == Needs::Split { 3 } else { 40 };
            assert!(k > least, "{}: failed at step {k}", info.name);
            // As text: what is carried may hold numbers that are none, which equal nothing.
            let same = format!("{state:?}") == format!("{before:?}");
            assert!(same, "{} at step {k}", info.name);
            assert!(method.step(k, k as f64, &mut state).is_err(), "{}: not again", info.name);
        }
    }
}

#[test]
fn a_restart_anywhere_gives_the_same_bits() {
    let clock = Clock::steps(0.05, 200);
    for info in METHODS {
        for options in choices(info) {
            let make = || build(info, &problem(info), clock.h, &options, &mut || Ok(())).unwrap();
            let mut whole = make();
            let mut state = State::new(&[1.0, 0.0, 0.0, 2.0], &*whole).unwrap();
            let mut rows = vec![0.0; 4 * 200];
            whole.fill(0, &clock, &mut state, &mut rows, &mut 0).unwrap();
            for stop in [1, 7, 15, 16, 17, 63, 150] {
                let mut state = State::new(&[1.0, 0.0, 0.0, 2.0], &*whole).unwrap();
                let mut first = make();
                for k in 0..stop {
                    first.step(k, clock.t(k), &mut state).unwrap();
                }
                let mut copy = state.clone();
                let mut second = make();
                let mut rest = vec![0.0; 4 * (200 - stop as usize)];
                second.fill(stop, &clock, &mut copy, &mut rest, &mut 0).unwrap();
                assert_eq!(rest, rows[4 * stop as usize..], "{}, stop at {stop}", info.name);
            }
        }
    }
}
