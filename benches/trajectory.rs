//! A thousand stored steps by size and correction: `trajectory/<correction>/<states>`.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use spim::expm::{Correction, Propagator, Recipe};
use spim::method::{State, trajectory_method};
use spim::propagate::Clock;

const STEPS: usize = 1000;

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("trajectory");
    group.throughput(Throughput::Elements(STEPS as u64)).sample_size(20);
    for (name, correction) in [("none", Correction::None), ("exact", Correction::Exact)] {
        for m in [6, 14, 60, 480] {
            // A chain of springs: bounded motion.
            let n = m / 2;
            let mut a = vec![0.0; m * m];
            for i in 0..n {
                a[i * m + n + i] = 1.0;
                a[(n + i) * m + i] = -2.0;
                if i > 0 {
                    a[(n + i) * m + i - 1] = 1.0;
                    a[(n + i - 1) * m + i] = 1.0;
                }
            }
            let p = Propagator::new(m, &a, 0.5, Recipe::auto(m), Some(correction), &mut || Ok(()));
            let mut method = trajectory_method(Arc::new(p.unwrap()), 1, &mut || Ok(())).unwrap();
            let start = vec![1.0; m];
            let mut rows = vec![0.0; STEPS * m];
            let clock = Clock::steps(0.5, STEPS as u64);
            group.bench_function(format!("{name}/{m}"), |bench| {
                bench.iter(|| {
                    let mut state = State::new(black_box(&start), &*method).unwrap();
                    method.fill(0, &clock, &mut state, &mut rows, &mut 0).unwrap();
                });
            });
        }
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
