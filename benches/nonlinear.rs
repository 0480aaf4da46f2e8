//! A thousand steps of the paper's pendulum by method: `pendulum/<method>/<stages>`, with the ending
//! `tolerance` told where a method has one.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use spim::method::{Options, State, Value, build, find};
use spim::model;
use spim::propagate::Clock;

const STEPS: u64 = 1000;

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("pendulum");
    group.throughput(Throughput::Elements(STEPS)).sample_size(20);
    let pendulum = model::named("compound pendulum", &[1.0, 1.0, 0.1, 100.0, 9.81914]).unwrap();
    // Steps of equal errors, about 1e-13 after 10 s.
    for (name, stages, h) in
        [("gauss16", 8, 0.055), ("gauss32", 16, 0.2), ("lawson_gauss8", 4, 0.01)]
    {
        let info = find(name).unwrap();
        for ending in ["minimal", "tolerance"] {
            let has = info.options.iter().any(|option| option.name == "roundoff");
            let options = match (has, ending) {
                (false, "tolerance") => continue,
                (false, _) => Options::default(),
                _ => Options(vec![("roundoff".into(), Value::Text(ending.into()))]),
            };
            let label = if ending == "tolerance" {
                format!("{name}/{stages}/{ending}")
            } else {
                format!("{name}/{stages}")
            };
            let mut method = build(info, &pendulum.problem, h, &options, &mut || Ok(())).unwrap();
            let start = [0.1, std::f64::consts::FRAC_PI_6, 0.0, 0.0];
            let clock = Clock::steps(h, STEPS);
            group.bench_function(label, |bench| {
                bench.iter(|| {
                    let mut state = State::new(black_box(&start), &*method).unwrap();
                    for k in 0..STEPS {
                        method.step(k, clock.t(k), &mut state).unwrap();
                    }
                    assert!(state.z[1].abs() < 0.6, "swings on");
                    state
                });
            });
        }
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
