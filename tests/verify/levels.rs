//! The same bits at every instruction set.

use std::sync::Arc;

use spim::expm::{Correction, Propagator, Recipe, Scheme, exponentials};
use spim::linalg::kernel::{Level, force};
use spim::method::{State, trajectory_method};
use spim::propagate::Clock;

/// Entries without pattern in (-1, 1).
fn entries(count: usize) -> Vec<f64> {
    let mut x = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = || {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        (x >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

fn at_all_levels<T: PartialEq + std::fmt::Debug>(run: impl Fn() -> T) {
    force(Some(Level::Portable));
    let expected = run();
    for level in [Level::Avx2, Level::Avx512] {
        force(Some(level));
        assert_eq!(run(), expected, "{level:?}");
    }
    force(None);
}

#[test]
fn exponentials_are_the_same_bits_at_every_level() {
    for m in [1, 2, 3, 5, 6, 8, 13, 16, 17, 31, 33, 64, 71] {
        let a: Vec<_> = entries(m * m).iter().map(|x| 3.0 * x).collect();
        for scheme in [Scheme::Exact, Scheme::Sid, Scheme::Pim(4)] {
            at_all_levels(|| {
                let mut out = vec![0.0; m * m];
                let recipe = Recipe { scheme, doublings: None };
                exponentials(m, recipe, &a, &mut out, &mut || Ok(())).unwrap();
                out.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
            });
        }
    }
}

#[test]
fn trajectories_are_the_same_bits_at_every_level() {
    for (m, correction) in [(6, Correction::Exact), (6, Correction::None), (20, Correction::Exact)]
    {
        let a: Vec<_> = entries(m * m).iter().map(|x| 0.2 * x).collect();
        at_all_levels(|| {
            let p = Propagator::new(m, &a, 0.1, Recipe::auto(m), Some(correction), &mut || Ok(()));
            let mut method = trajectory_method(Arc::new(p.unwrap()), 1, &mut || Ok(())).unwrap();
            let mut state = State::new(&vec![1.0; m], &*method).unwrap();
            let mut rows = vec![0.0; 100 * m];
            let clock = Clock::steps(0.1, 100);
            method.fill(0, &clock, &mut state, &mut rows, &mut 0).unwrap();
            rows.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
        });
    }
}
