//! The rotating beam under its methods: restarts, failures, memory and bits.

use std::sync::Arc;

use spim::linalg::kernel::{Level, force};
use spim::method::{MethodInfo, Options, State, Value, build, find};
use spim::model::beam::{Beam, Coupling, Elements, Hub, POINTS, Parameters, SpinUp};
use spim::propagate::Clock;
use spim::system::Problem;

use crate::allocations::allocated;

/// Gauss points and weights in (0, 1).
#[allow(clippy::excessive_precision)]
const RULE: [[f64; POINTS]; 2] = [
    [
        0.033_765_242_898_423_99,
        0.16939530676686774,
        0.38069040695840156,
        0.6193095930415985,
        0.8306046932331322,
        0.966234757101576,
    ],
    [
        0.08566224618958517,
        0.1803807865240693,
        0.23395696728634552,
        0.23395696728634552,
        0.1803807865240693,
        0.08566224618958517,
    ],
];

/// A uniform beam of length 1, mass 1, `EI` = 1 and `EA` = 1e4.
pub fn beam(count: usize, hub: Hub, coupling: Coupling) -> Beam {
    let l = 1.0 / count as f64;
    let mut e = Elements {
        length: l,
        axial_mass: vec![[[0.0; 2]; 2]; count],
        bending_mass: vec![[[0.0; 4]; 4]; count],
        gyroscopic: vec![[[0.0; 4]; 2]; count],
        shortening: vec![[[0.0; 4]; 4]; count],
        pull: vec![[[0.0; 4]; 4]; count],
        axial: vec![[0.0; 2]; count],
        axial_moment: vec![[0.0; 2]; count],
        bending: vec![[0.0; 4]; count],
        bending_moment: vec![[0.0; 4]; count],
        axial_stiffness: vec![1e4; count],
        bending_stiffness: vec![[1.0; POINTS]; count],
        rule: RULE,
        moments: [1.0, 0.5, 1.0 / 3.0],
        tip_inertia: 0.0,
    };
    for i in 0..count {
        for (x, weight) in RULE[0].into_iter().zip(RULE[1]) {
            let (dm, place) = (l * weight, l * (i as f64 + x));
            let u = [1.0 - x, x];
            let (x2, x3) = (x * x, x * x * x);
            let v = [
                1.0 - 3.0 * x2 + 2.0 * x3,
                l * (x - 2.0 * x2 + x3),
                3.0 * x2 - 2.0 * x3,
                l * (x3 - x2),
            ];
            let s = [
                6.0 * (x2 - x) / l,
                1.0 - 4.0 * x + 3.0 * x2,
                6.0 * (x - x2) / l,
                3.0 * x2 - 2.0 * x,
            ];
            let outboard = [1.0 - place, 0.5 * (1.0 - place * place)];
            for r in 0..4 {
                for c in 0..4 {
                    e.bending_mass[i][r][c] += dm * v[r] * v[c];
                    e.shortening[i][r][c] += dm * outboard[0] * s[r] * s[c];
                    e.pull[i][r][c] += dm * outboard[1] * s[r] * s[c];
                }
                e.bending[i][r] += dm * v[r];
                e.bending_moment[i][r] += dm * place * v[r];
            }
            for r in 0..2 {
                for c in 0..2 {
                    e.axial_mass[i][r][c] += dm * u[r] * u[c];
                }
                for c in 0..4 {
                    e.gyroscopic[i][r][c] += dm * u[r] * v[c];
                }
                e.axial[i][r] += dm * u[r];
                e.axial_moment[i][r] += dm * place * u[r];
            }
        }
    }
    let parameters = Parameters {
        hub,
        radius: 0.1,
        ground_spring: 0.3,
        coupling,
        gravity: [0.0; 2],
        damping: [0.0; 2],
        loads: None,
    };
    Beam::new(&e, parameters).unwrap()
}

fn free() -> Hub {
    Hub::Locked { inertia: 0.5 }
}

fn hubs() -> Vec<(Hub, Coupling)> {
    let driven = || Hub::Driven(Arc::new(SpinUp { speed: 2.0, duration: 1.0 }));
    vec![
        (free(), Coupling::First),
        (free(), Coupling::Third),
        (driven(), Coupling::First),
        (Hub::Jointed { inertia: 0.5, spring: 2.0 }, Coupling::Third),
    ]
}

/// The methods, with the whole Jacobian as well where there is the choice.
fn methods() -> Vec<(&'static MethodInfo, Options)> {
    let full = || Options(vec![("newton".into(), Value::Text("full".into()))]);
    let mut all = vec![(find("srk2").unwrap(), full())];
    for name in ["srk2", "midpoint", "gauss4", "gauss16", "rk4"] {
        all.push((find(name).unwrap(), Options::default()));
    }
    all
}

/// Swinging, at rest in the beam's frame.
fn start(beam: &Beam, size: f64) -> Vec<f64> {
    let problem = Problem::Beam(Arc::new(clone(beam)));
    let mut z = vec![0.0; problem.flow().len()];
    for node in 0..beam.nodes() {
        let x = (node + 1) as f64 / beam.nodes() as f64;
        z[3 * node + 1] = size * x * x;
        z[3 * node + 2] = 2.0 * size * x;
    }
    z
}

fn clone(of: &Beam) -> Beam {
    let p = of.parameters();
    beam(of.nodes(), p.hub.clone(), p.coupling)
}

/// Every case: name, problem, state, method, options.
fn cases(
    size: f64,
) -> impl Iterator<Item = (String, Problem, Vec<f64>, &'static MethodInfo, Options)> {
    [2, 9].into_iter().flat_map(move |count| {
        hubs().into_iter().flat_map(move |(hub, coupling)| {
            let beam = beam(count, hub, coupling);
            let z = start(&beam, size);
            let angles = beam.angles();
            let problem = Problem::Beam(Arc::new(beam));
            methods()
                .into_iter()
                .filter(move |(info, _)| {
                    // The general Runge-Kutta method is for few unknowns.
                    count < 9 || coupling == Coupling::First || !info.name.starts_with("gauss")
                })
                .map(move |(info, options)| {
                    let name = format!("{} {count} {coupling:?} {angles} {options:?}", info.name);
                    (name, problem.clone(), z.clone(), info, options)
                })
        })
    })
}

/// Steps that explicit methods stand.
fn step_of(info: &MethodInfo) -> f64 {
    if info.name == "rk4" { 1e-4 } else { 2e-3 }
}

#[test]
fn a_restart_of_a_beam_gives_the_same_bits() {
    for (name, problem, z, info, options) in cases(0.05) {
        let clock = Clock::steps(step_of(info), 40);
        let make = || build(info, &problem, clock.h, &options, &mut || Ok(())).unwrap();
        let mut whole = make();
        let mut state = State::new(&z, &*whole).unwrap();
        let mut rows = vec![0.0; z.len() * 40];
        whole.fill(0, &clock, &mut state, &mut rows, &mut 0).unwrap();
        for stop in [1_u64, 2, 3, 17] {
            let mut state = State::new(&z, &*whole).unwrap();
            let mut first = make();
            for k in 0..stop {
                first.step(k, clock.t(k), &mut state).unwrap();
            }
            let mut rest = vec![0.0; z.len() * (40 - stop as usize)];
            make().fill(stop, &clock, &mut state, &mut rest, &mut 0).unwrap();
            assert_eq!(rest, rows[z.len() * stop as usize..], "{name}, stop at {stop}");
        }
    }
}

#[test]
fn a_beam_is_the_same_bits_at_every_level() {
    for (name, problem, z, info, options) in cases(0.05) {
        let run = || {
            let clock = Clock::steps(step_of(info), 10);
            let mut method = build(info, &problem, clock.h, &options, &mut || Ok(())).unwrap();
            let mut state = State::new(&z, &*method).unwrap();
            let mut rows = vec![0.0; z.len() * 10];
            method.fill(0, &clock, &mut state, &mut rows, &mut 0).unwrap();
            rows
        };
        force(Some(Level::Portable));
        let expected = run();
        for level in [Level::Avx2, Level::Avx512] {
            force(Some(level));
            assert_eq!(run(), expected, "{name} {level:?}");
        }
        force(None);
    }
}

#[test]
fn stepping_a_beam_allocates_nothing() {
    for (name, problem, z, info, options) in cases(0.05) {
        let h = step_of(info);
        let mut method = build(info, &problem, h, &options, &mut || Ok(())).unwrap();
        let mut state = State::new(&z, &*method).unwrap();
        for k in 0..10 {
            method.step(k, h * k as f64, &mut state).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
        let before = allocated();
        for k in 10..30 {
            method.step(k, h * k as f64, &mut state).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
        assert_eq!(allocated() - before, 0, "{name}");
    }
}

#[test]
fn a_failed_step_of_a_beam_leaves_the_state_as_it_was() {
    // Deflected by its length: foreshortening has taken the inertia of the small hub.
    for (count, name) in [(2, "srk2"), (2, "gauss16"), (9, "srk2"), (9, "gauss8")] {
        let beam = beam(count, Hub::Locked { inertia: 1e-3 }, Coupling::First);
        let z = start(&beam, 1.0);
        let problem = Problem::Beam(Arc::new(beam));
        let info = find(name).unwrap();
        let method = build(info, &problem, 1e-3, &Options::default(), &mut || Ok(()));
        let mut method = method.unwrap();
        let mut state = State::new(&z, &*method).unwrap();
        let before = state.clone();
        let error = method.step(0, 0.0, &mut state).unwrap_err().to_string();
        assert!(error.contains("positive definite"), "{error}");
        assert!(error.contains("third"), "{error}");
        assert_eq!(state, before, "{name}");
    }
}

#[test]
fn ways_of_solving_a_step_agree() {
    for (hub, coupling) in hubs() {
        let beam = beam(5, hub, coupling);
        let (z, angles) = (start(&beam, 0.05), beam.angles());
        let problem = Problem::Beam(Arc::new(beam));
        let run = |newton: &str| {
            let info = find("srk2").unwrap();
            let options = Options(vec![("newton".into(), Value::Text(newton.into()))]);
            let mut method = build(info, &problem, 1e-3, &options, &mut || Ok(())).unwrap();
            let mut state = State::new(&z, &*method).unwrap();
            for k in 0..200 {
                method.step(k, 1e-3 * k as f64, &mut state).unwrap();
            }
            state.z
        };
        let (one, other) = (run("constant"), run("full"));
        let size = one.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        let off = one.iter().zip(&other).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        // 200 steps, each solved to 1e-14, of a motion that magnifies.
        assert!(off <= 1e-10 * size, "{coupling:?} {angles}: {off:e} of {size}");
    }
}

#[test]
fn a_linear_part_and_a_remainder_add_up_to_the_rates() {
    for coupling in [Coupling::First, Coupling::Zeroth] {
        let beam = Arc::new(beam(3, Hub::Locked { inertia: 2.0 }, coupling));
        let parts = Problem::Beam(beam.clone()).semilinear().unwrap();
        let m = parts.len();
        let z: Vec<f64> = (0..m).map(|i| 0.1 * ((7 * i) % 11) as f64 / 11.0 - 0.05).collect();
        let (mut whole, mut rest) = (vec![0.0; m], vec![0.0; m]);
        parts.rate(0.0, &z, &mut whole).unwrap();
        parts.remainder(0.0, &z, &mut rest).unwrap();
        let a = parts.matrix();
        for i in 0..m {
            let terms = a[m * i..][..m].iter().zip(&z).map(|(a, z)| a * z);
            let (linear, size) = terms.fold((0.0, 0.0_f64), |(s, n), x| (s + x, n.max(x.abs())));
            let off = (linear + rest[i] - whole[i]).abs();
            assert!(off <= 1e-13 * size.max(whole[i].abs()), "{i}: {off:e} of {size:e}");
        }
        // Remainders are of second order, to all digits: four times as large at twice the state.
        let tiny: Vec<f64> = z.iter().map(|z| z / (1_u64 << 40) as f64).collect();
        let twice: Vec<f64> = tiny.iter().map(|z| 2.0 * z).collect();
        let (mut one, mut two) = (vec![0.0; m], vec![0.0; m]);
        parts.remainder(0.0, &tiny, &mut one).unwrap();
        parts.remainder(0.0, &twice, &mut two).unwrap();
        let size = one.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        for (one, two) in one.iter().zip(&two) {
            assert!((4.0 * one - two).abs() <= 1e-10 * size, "{one:e} {two:e}");
        }
        assert!(size > 0.0);
    }
    for hub in [Hub::Jointed { inertia: 1.0, spring: 1.0 }, Hub::Locked { inertia: 1.0 }] {
        let problem = Problem::Beam(Arc::new(beam(2, hub, Coupling::Third)));
        let info = find("lawson_gauss4").unwrap();
        let refused = build(info, &problem, 1e-3, &Options::default(), &mut || Ok(()));
        assert!(refused.err().unwrap().to_string().contains("turns freely"));
    }
}

#[test]
fn exponential_methods_of_a_beam_restart_and_allocate_nothing() {
    for name in ["lawson_gauss8", "spim_pc", "spim_implicit", "eavf"] {
        let problem =
            Problem::Beam(Arc::new(beam(2, Hub::Locked { inertia: 2.0 }, Coupling::First)));
        let info = find(name).unwrap();
        let make = || build(info, &problem, 1e-3, &Options::default(), &mut || Ok(())).unwrap();
        let mut method = make();
        let z0: Vec<f64> = (0..14).map(|i| if i == 4 { 0.05 } else { 0.0 }).collect();
        let mut state = State::new(&z0, &*method).unwrap();
        for k in 0..50 {
            method.step(k, 1e-3 * k as f64, &mut state).unwrap();
        }
        let mut copy = state.clone();
        let before = allocated();
        for k in 50..100 {
            method.step(k, 1e-3 * k as f64, &mut state).unwrap();
        }
        assert_eq!(allocated() - before, 0, "{name}");
        let mut second = make();
        for k in 50..100 {
            second.step(k, 1e-3 * k as f64, &mut copy).unwrap();
        }
        assert_eq!(state, copy, "{name}");
    }
}
