//! A restart is a copy of the state: the same bits, for every method.

use std::sync::Arc;

use spim::method::{METHODS, Options, State, Value, build};
use spim::propagate::Clock;
use spim::system::{Linear, Problem};

const A: [f64; 16] = [
    0.0, 0.0, 1.0, 0.0, //
    0.0, 0.0, 0.0, 0.5, //
    -4.0, 1.0, 0.0, 0.0, //
    1.0, -3.0, 0.0, 0.0,
];

fn problem() -> Problem {
    Problem::Linear(Arc::new(Linear::new(4, A.to_vec()).unwrap()))
}

#[test]
fn a_restart_anywhere_gives_the_same_bits() {
    let clock = Clock::steps(0.05, 200);
    for info in METHODS {
        let exact = Options(vec![("correction".into(), Value::Text("exact".into()))]);
        let choices = match info.options.iter().any(|option| option.name == "correction") {
            true => vec![Options::default(), exact],
            false => vec![Options::default()],
        };
        for options in choices {
            let make = || build(info, &problem(), clock.h, &options, &mut || Ok(())).unwrap();
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
