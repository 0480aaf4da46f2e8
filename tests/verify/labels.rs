//! What the records say of the methods is true.

use std::sync::Arc;

use spim::method::{METHODS, MethodInfo, Needs, Options, State, Value, build, find};
use spim::model::named;
use spim::model::pendulum::CompoundPendulum;
use spim::system::{Flow, Hamiltonian, Problem};

use crate::restarts::structure;

/// Two coupled oscillators, `z = [q; p]`; for methods that are exact for them the compound pendulum.
fn problem(info: &MethodInfo) -> Problem {
    if info.needs == Needs::Potential {
        return named("fput", &[1.0, 2.0]).unwrap().problem;
    }
    if is_high(info) {
        return named("henon-heiles", &[]).unwrap().problem;
    }
    if is_split(info) {
        let pendulum = CompoundPendulum::new(1.0, 1.0, 1.0, 6.0, 3.0);
        return Problem::SemiLinear(Arc::new(pendulum));
    }
    structure(info, &[1.0, 2.0], &[4.0, -1.0, -1.0, 3.0])
}

/// Whether it splits a linear part off, so that oscillators tell nothing.
fn is_split(info: &MethodInfo) -> bool {
    matches!(info.needs, Needs::SemiLinear | Needs::Canonical | Needs::Potential)
}

/// Whether the pendulum is too wild for methods of high order at large steps.
fn is_high(info: &MethodInfo) -> bool {
    is_split(info) && info.order.is_some_and(|order| order > 8)
}

/// The schemes as they are without doubling, so that their order shows.
pub fn bare(info: &MethodInfo) -> Options {
    let fixed = info.order.is_some() && info.options.iter().any(|o| o.name == "doublings");
    let options = [("doublings".to_string(), Value::Integers(vec![0]))];
    Options(options.into_iter().filter(|_| fixed).collect())
}

/// The state after a step of `h`.
fn step(info: &MethodInfo, h: f64, z0: &[f64]) -> Vec<f64> {
    let mut method = build(info, &problem(info), h, &bare(info), &mut || Ok(())).unwrap();
    let mut state = State::new(z0, &*method).unwrap();
    method.step(0, 0.0, &mut state).unwrap();
    state.z
}

/// The matrix of one step, column by column; its derivative where the problem is not linear.
fn step_matrix(info: &MethodInfo, h: f64) -> Vec<Vec<f64>> {
    if is_split(info) {
        return (0..4).map(|j| slope(info, h, j)).collect();
    }
    let unit = |j| (0..4).map(|i| f64::from(u8::from(i == j))).collect::<Vec<_>>();
    (0..4).map(|j| step(info, h, &unit(j))).collect()
}

/// The derivative of a step by component `j`, by central differences of order 4.
fn slope(info: &MethodInfo, h: f64, j: usize) -> Vec<f64> {
    let d = 1e-3;
    let at = |shift: f64| {
        let mut z = [0.3, -0.5, 0.25, 0.8];
        z[j] += shift * d;
        step(info, h, &z)
    };
    let (near, far) = ([at(1.0), at(-1.0)], [at(2.0), at(-2.0)]);
    (0..4)
        .map(|i| {
            let difference = 8.0 * (near[0][i] - near[1][i]) - (far[0][i] - far[1][i]);
            difference / (12.0 * d)
        })
        .collect()
}

/// Largest entry of `W^T J W - J`.
pub fn defect(w: &[Vec<f64>]) -> f64 {
    let form =
        |x: &[f64], y: &[f64]| (0..2).map(|i| x[i] * y[i + 2] - x[i + 2] * y[i]).sum::<f64>();
    let mut worst = 0.0_f64;
    for (i, x) in w.iter().enumerate() {
        for (j, y) in w.iter().enumerate() {
            let j_entry = f64::from(u8::from(j == i + 2)) - f64::from(u8::from(i == j + 2));
            worst = worst.max((form(x, y) - j_entry).abs());
        }
    }
    worst
}

#[test]
fn symplectic_says_so_of_the_step() {
    for info in METHODS {
        let found = defect(&step_matrix(info, 0.3));
        // 10 u; of derivatives what differences leave.
        let rounding = if is_split(info) { 1e-11 } else { 2e-15 };
        match info.symplectic {
            true => assert!(found <= rounding, "{}: {found:e}", info.name),
            false => assert!(found >= 1e-6, "{}: {found:e}", info.name), // (0.3 * 2)^6 / 72
        }
    }
}

#[test]
fn symmetric_says_so_of_a_step_back() {
    let z0 = [1.0, -0.5, 0.25, 2.0];
    for info in METHODS {
        let back = step(info, -0.3, &step(info, 0.3, &z0));
        let found = back.iter().zip(z0).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        match info.symmetric {
            true => assert!(found <= 4e-15, "{}: {found:e}", info.name), // 10 u of |z|
            false => assert!(found >= 1e-6, "{}: {found:e}", info.name),
        }
    }
}

/// `H = p^2/2 - cos q`: unlike oscillators, not a quadratic form, which many methods conserve.
struct Pendulum;

impl Flow for Pendulum {
    fn len(&self) -> usize {
        2
    }
    fn rate(&self, _t: f64, z: &[f64], f: &mut [f64]) -> spim::Result<()> {
        f.copy_from_slice(&[z[1], -z[0].sin()]);
        Ok(())
    }
}

#[test]
fn energy_preserving_says_so_of_ten_thousand_steps() {
    let problem_of = problem;
    for info in METHODS {
        // Far enough for a method of high order to show.
        let h = match (info.order, info.needs) {
            (Some(9..), _) if is_split(info) => 2.2,
            (Some(9..), Needs::Split) => 0.8,
            (_, Needs::Split) => 0.3,
            _ if is_split(info) => 0.3,
            (Some(20..), _) => 4.0,
            (Some(5..), _) => 2.0,
            _ => 0.3,
        };
        let (problem, z0) = match info.needs {
            Needs::Flow => (Problem::Flow(Arc::new(Pendulum)), vec![2.0, 0.0]),
            _ if is_high(info) => (problem(info), vec![0.0, 0.1, 0.48, 0.0]),
            _ if is_split(info) => (problem(info), vec![0.3, 1.0, 0.0, 0.0]),
            _ => (problem(info), vec![1.0, -0.5, 0.25, 2.0]),
        };
        let springs = problem_of(find("rk4").unwrap());
        let pendulum = CompoundPendulum::new(1.0, 1.0, 1.0, 6.0, 3.0);
        let energy = |z: &[f64]| match &problem {
            Problem::Flow(_) => 0.5 * z[1] * z[1] - z[0].cos(),
            Problem::SemiLinear(_) => pendulum.energy(0.0, z).unwrap(),
            Problem::Separable(_) if is_high(info) => {
                let stars = named("henon-heiles", &[]).unwrap();
                stars.hamiltonian.energy(0.0, z).unwrap()
            }
            Problem::Separable(_) if is_split(info) => {
                let chain = named("fput", &[1.0, 2.0]).unwrap();
                chain.hamiltonian.energy(0.0, z).unwrap()
            }
            Problem::Separable(_) => springs.linear().unwrap().energy(0.0, z).unwrap(),
            other => other.linear().unwrap().energy(0.0, z).unwrap(),
        };
        let mut method = build(info, &problem, h, &bare(info), &mut || Ok(())).unwrap();
        let mut state = State::new(&z0, &*method).unwrap();
        let mut found = 0.0_f64;
        for k in 0..10_000 {
            method.step(k, h * k as f64, &mut state).unwrap();
            found = found.max((energy(&state.z) / energy(&z0) - 1.0).abs());
        }
        match info.energy_preserving {
            true => assert!(found <= 1e-11, "{}: {found:e}", info.name), // 10 u a step
            false => assert!(found >= 1e-8, "{}: {found:e}", info.name),
        }
    }
}
