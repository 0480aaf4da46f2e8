//! The figures of `rust/core/method/measured.csv`: what is committed is what is measured here.
//! `docs/methods.md` says how; with `RENEW=1`, as in `make methods`, the file is written.

use std::f64::consts::TAU;
use std::sync::Arc;

use spim::method::measured::{HEAD, Measured, TABLE};
use spim::method::{METHODS, MethodInfo, Needs, State, Tangent, Work, build, find};
use spim::model::named;
use spim::propagate::Clock;
use spim::system::{Flow, Hamiltonian, Problem, SemiLinear};

use crate::labels::{bare, defect};
use crate::restarts::structure;

/// Step of all figures but the order.
const H: f64 = 0.125;

/// Steps over which energy and cost are measured.
const STEPS: u64 = 100_000;

/// Errors between which the order is measured: above rounding, below the size of the motion.
const FLOOR: f64 = 1e-11;
const CEILING: f64 = 1e-2;

/// Step sizes the order is measured with, each 2^(1/16) smaller than the one before, and steps of a
/// run: at most so many.
const SIZES: usize = 16;
const MOST: u64 = 1200;

/// An oscillator in sheared coordinates, `q = x, p = y + x^2` with `x'' = -x`, `y = x'`:
/// `H = ((p - q^2)^2 + q^2) / 2`. Nonlinear, with motions in closed form that have no poles at any
/// complex time, so that errors of high order are soon those of small steps.
struct Sheared;

const OSCILLATOR: [f64; 4] = [0.0, 1.0, -1.0, 0.0];

impl Sheared {
    fn exact(z: &[f64], t: f64) -> Vec<f64> {
        let (x, y) = (z[0], z[1] - z[0] * z[0]);
        let (sin, cos) = t.sin_cos();
        let (x, y) = (x * cos + y * sin, y * cos - x * sin);
        vec![x, y + x * x]
    }
}

impl Flow for Sheared {
    fn len(&self) -> usize {
        2
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> spim::Result<()> {
        self.remainder(t, z, f)?;
        f[0] += z[1];
        f[1] -= z[0];
        Ok(())
    }
    fn linear(&self) -> Option<&[f64]> {
        Some(&OSCILLATOR)
    }
}

impl SemiLinear for Sheared {
    fn matrix(&self) -> &[f64] {
        &OSCILLATOR
    }
    fn remainder(&self, _t: f64, z: &[f64], f: &mut [f64]) -> spim::Result<()> {
        f.copy_from_slice(&[-z[0] * z[0], 2.0 * z[0] * (z[1] - z[0] * z[0])]);
        Ok(())
    }
}

/// Whether it is measured on a linear system.
fn is_linear(info: &MethodInfo) -> bool {
    info.needs.is_exponential() || info.needs == Needs::Structural
}

/// Two coupled oscillators of frequencies 1.1 and 2.1 as the method needs them.
fn springs(info: &MethodInfo) -> Problem {
    structure(info, &[1.0, 2.0], &[4.0, -1.0, -1.0, 3.0])
}

/// The state at the end of a run; `None` where it fails.
fn run(info: &MethodInfo, problem: &Problem, end: f64, steps: u64, z0: &[f64]) -> Option<Vec<f64>> {
    let clock = Clock::steps(end / steps as f64, steps);
    let mut method = build(info, problem, clock.h, &bare(info), &mut || Ok(())).unwrap();
    let mut state = State::new(z0, &*method).unwrap();
    for k in 0..steps {
        method.step(k, clock.t(k), &mut state).ok()?;
    }
    Some(state.z)
}

/// A problem the order shows on, the time it is run for, and pairs of starts and exact ends.
struct Runs {
    problem: Problem,
    end: f64,
    pairs: Vec<[Vec<f64>; 2]>,
}

fn runs(info: &MethodInfo, order: usize) -> Runs {
    // Four phases: where one has an error that crosses zero, another has not.
    let phases = (0..4).map(|k| (0.1 + TAU / 8.0 * f64::from(k)).sin_cos());
    if is_linear(info) || (info.needs == Needs::Flow && order >= 12) {
        // Iterations of Gauss methods of high order end where steps are still too small for errors
        // above rounding, but for a linear system, which is solved within.
        let (exact, end) = (find("auto").unwrap(), if order >= 12 { 60.0 } else { 2.0 });
        let pairs = phases.map(|(sin, cos)| {
            let z = vec![cos, -0.5 * cos, 0.5 * sin, 2.0 * sin];
            let last = run(exact, &springs(exact), end, 1, &z).unwrap();
            [z, last]
        });
        return Runs { pairs: pairs.collect(), problem: springs(info), end };
    }
    if matches!(info.needs, Needs::Flow | Needs::SemiLinear | Needs::Canonical) {
        let end = if order >= 8 { 20.0 } else { 2.0 };
        let pairs = phases.map(|(sin, cos)| {
            let (x, y) = (0.3 * cos, 0.3 * sin);
            let z = vec![x, y + x * x];
            let last = Sheared::exact(&z, end);
            [z, last]
        });
        let problem = Problem::SemiLinear(Arc::new(Sheared));
        return Runs { pairs: pairs.collect(), problem, end };
    }
    let problem = named("henon-heiles", &[]).unwrap().problem;
    let end = if order >= 10 { 20.0 } else { 2.0 };
    let pairs = phases.map(|(sin, cos)| {
        let z = vec![0.2 * cos, 0.1 * sin, 0.3 * sin, -0.2 * cos];
        let last = run(find("gauss16").unwrap(), &problem, end, 16 * end as u64, &z).unwrap();
        [z, last]
    });
    Runs { pairs: pairs.collect(), problem: problem.clone(), end }
}

/// The order as errors show it: `p` of `log error = c + p log h + a h^2 (+ b h^4)` by least squares,
/// the series with two terms for orders above 16, which rounding hides before steps are small.
fn order(info: &MethodInfo) -> Option<f64> {
    let stated = info.order?;
    let Runs { problem, end, pairs } = runs(info, stated);
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut last = 0;
    for k in 0.. {
        let steps = (4.0 * (f64::from(k) / 16.0).exp2()).round() as u64;
        if steps == last {
            continue;
        }
        if steps > MOST {
            break;
        }
        last = steps;
        let mut squares = [0.0; 2];
        for [start, exact] in &pairs {
            let found = run(info, &problem, end, steps, start);
            let found = found.unwrap_or_else(|| vec![f64::INFINITY; start.len()]);
            squares[0] += found.iter().zip(exact).map(|(x, y)| (x - y).powi(2)).sum::<f64>();
            squares[1] += exact.iter().map(|y| y * y).sum::<f64>();
        }
        let error = (squares[0] / squares[1]).sqrt();
        if error < FLOOR {
            break;
        }
        if error < CEILING {
            points.push([end / steps as f64, error]);
        }
    }
    let points = &points[points.len().saturating_sub(SIZES)..];
    assert!(points.len() >= 6, "{}: its order does not show, {points:?}", info.name);
    Some(slope(points, if stated > 16 { 2 } else { 1 }))
}

/// `p` of the least squares with so many terms of the series.
fn slope(points: &[[f64; 2]], terms: i32) -> f64 {
    let rows: Vec<Vec<f64>> = points
        .iter()
        .map(|[h, error]| {
            let s = h / points[0][0];
            let mut row = vec![1.0];
            row.extend((1..=terms).map(|j| s.powi(2 * j)));
            row.extend([s.ln(), error.ln()]);
            row
        })
        .collect();
    // Gram and Schmidt: what of log h and log error the other columns leave.
    let mut columns: Vec<Vec<f64>> =
        (0..rows[0].len()).map(|j| rows.iter().map(|row| row[j]).collect()).collect();
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let last = columns.len() - 2;
    for i in 0..last {
        let (done, rest) = columns.split_at_mut(i + 1);
        for column in rest {
            let part = dot(&done[i], column) / dot(&done[i], &done[i]);
            column.iter_mut().zip(&done[i]).for_each(|(x, y)| *x -= part * y);
        }
    }
    dot(&columns[last], &columns[last + 1]) / dot(&columns[last], &columns[last])
}

/// All figures of a method, on the springs or on Hénon and Heiles' system below its chaos.
fn measure(info: &MethodInfo) -> Measured {
    let stars = named("henon-heiles", &[]).unwrap();
    let (problem, z0) = match is_linear(info) {
        true => (springs(info), [1.0, -0.5, 0.25, 2.0]),
        false => (stars.problem, [0.1, 0.0, 0.2, 0.2]),
    };
    let make = |h| build(info, &problem, h, &bare(info), &mut || Ok(())).unwrap();
    let energy = |z: &[f64]| match problem.linear() {
        Some(linear) => linear.energy(0.0, z).unwrap(),
        None => stars.hamiltonian.energy(0.0, z).unwrap(),
    };
    let step = |h: f64, z: &[f64]| {
        let mut method = make(h);
        let mut state = State::new(z, &*method).unwrap();
        method.step(0, 0.0, &mut state).unwrap();
        state.z
    };

    let unit = |j| std::array::from_fn::<f64, 4, _>(|i| f64::from(u8::from(i == j)));
    let columns: Vec<Vec<f64>> = if is_linear(info) {
        (0..4).map(|j| step(H, &unit(j))).collect()
    } else {
        let mut method = make(H);
        let mut map: Vec<f64> = (0..4).flat_map(unit).collect();
        let state = State::new(&z0, &*method).unwrap();
        Tangent::new(&state).apply(&mut *method, 0.0, &z0, &mut map).unwrap();
        (0..4).map(|j| map.iter().skip(j).step_by(4).copied().collect()).collect()
    };

    let apart = |x: f64, (z, w): (&f64, &f64)| x.max((z - w).abs());
    let size = z0.iter().fold(0.0_f64, |most, z| most.max(z.abs()));
    let back = step(-H, &step(H, &z0));

    let mut method = make(H);
    let mut state = State::new(&z0, &*method).unwrap();
    let clock = Clock::steps(H, STEPS);
    let start = energy(&z0);
    // A run that fails has lost it all.
    let errors: Vec<f64> = (0..STEPS)
        .map(|k| match method.step(k, clock.t(k), &mut state) {
            Ok(()) => energy(&state.z) / start - 1.0,
            Err(_) => f64::INFINITY,
        })
        .collect();
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    let tenth = errors.len() / 10;
    let Work { steps, evaluations, products } = method.work();

    Measured {
        order: order(info),
        symplectic_defect: defect(&columns),
        reversibility_defect: back.iter().zip(&z0).fold(0.0, apart) / size,
        energy_error: errors.iter().fold(0.0, |most, error| most.max(error.abs())),
        energy_drift: (mean(&errors[errors.len() - tenth..]) - mean(&errors[..tenth])).abs(),
        evaluations: evaluations as f64 / steps as f64,
        products: products as f64 / steps as f64,
    }
}

#[test]
fn the_order_is_the_measured_slope() {
    for info in METHODS {
        let Some(stated) = info.order else { continue };
        let found = order(info).unwrap();
        assert!((found - stated as f64).abs() <= 0.15, "{}: {found}", info.name);
    }
}

#[test]
fn the_table_is_what_is_measured() {
    let lines = METHODS.iter().map(|info| measure(info).line(info.name));
    let found: String = [HEAD.to_string()].into_iter().chain(lines).map(|x| x + "\n").collect();
    if std::env::var_os("RENEW").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/rust/core/method/measured.csv");
        std::fs::write(path, found).unwrap();
        return;
    }
    for (found, committed) in found.lines().zip(TABLE.lines()) {
        assert_eq!(found, committed, "measured, committed; `make methods` renews the table");
    }
    assert_eq!(found.lines().count(), TABLE.lines().count(), "`make methods` renews the table");
}
