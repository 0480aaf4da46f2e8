//! Exponentials by size and scheme: `expm/<scheme>/<rows>`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use spim::expm::{Recipe, Scheme, exponentials};

fn benches(criterion: &mut Criterion) {
    for (name, scheme, sizes) in [
        ("sid", Scheme::Sid, &[4, 6, 14, 32, 64, 128, 256][..]),
        ("exact", Scheme::Exact, &[4, 6, 14, 32, 64][..]),
    ] {
        for &m in sizes {
            // Norm about 10, no pattern that a kernel could profit from.
            let a: Vec<_> =
                (0..m * m).map(|i| ((i * 7919 + 13) % 101) as f64 / 101.0 - 0.5).collect();
            let a: Vec<_> = a.iter().map(|x| x * 40.0 / m as f64).collect();
            let mut out = vec![0.0; m * m];
            let recipe = Recipe { scheme, doublings: None };
            criterion.bench_function(&format!("expm/{name}/{m}"), |bench| {
                bench.iter(|| {
                    exponentials(m, recipe, black_box(&a), &mut out, &mut || Ok(())).unwrap()
                });
            });
        }
    }
}

criterion_group!(all, benches);
criterion_main!(all);
