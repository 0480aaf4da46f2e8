//! Splittings of `z' = A z + (0, f(q, t))` into the exact linear flow and kicks of the momenta: explicit,
//! symmetric, symplectic where A is Hamiltonian and f the slope of a potential.
//!
//! `strang` kicks, turns and kicks: the impulse method. `mollified_impulse` takes the potential at an average
//! of the coordinates along the linear flow, `U(S q)`, so that no step resonates with it. `mclachlan84` has
//! five kicks: of order 8 in the step where f is small, of order 4 where it is not. Linear flows are in
//! pairs of doubles, kicks are compensated sums.
//!
//! Sources: Deuflhard (1979); García-Archilla, Sanz-Serna & Skeel, SIAM J. Sci. Comput. 20 (1998) 930;
//! McLachlan, BIT 35 (1995) 258.

use super::common::{PAIRS_TO, add_product, check_finite};
use super::turn::{Turn, add_compensated};
use super::{Bound, MethodInfo, Needs, State, Step, Stepper, Work};
use crate::error::{Error, Result};
use crate::expm;
use crate::linalg::dense::Watch;
use crate::linalg::kernel::{doubles, doubles_mut};
use crate::system::{Problem, SemiLinear};

/// Turns and kicks of McLachlan's (8, 4), first to middle.
const TURNS: [f64; 2] = [0.075_346_960_269_892_89, 0.517_916_854_688_256_8];
const KICKS: [f64; 2] = [0.190_225_939_373_676_62, 0.846_524_070_443_526_3];

#[derive(Clone, Copy)]
enum Part {
    /// By the turn of this number.
    Turn(usize),
    /// By this part of the step, where that part of it is over.
    Kick(f64, f64),
}

struct Splitting {
    name: &'static str,
    h: f64,
    parts: Vec<Part>,
    turns: Vec<Turn>,
    /// S and its transposed, row by row; empty where there is none.
    filter: [Vec<f64>; 2],
    z: Vec<f64>,
    e: Vec<f64>,
    next: Vec<f64>,
    rest: Vec<f64>,
    /// Filtered coordinates and momenta, and the remainder there.
    place: Vec<f64>,
    force: Vec<f64>,
    kick: Vec<f64>,
}

/// One turn between two kicks.
const IMPULSE: [Part; 3] = [Part::Kick(0.5, 0.0), Part::Turn(0), Part::Kick(0.5, 1.0)];

fn build(
    name: &'static str,
    [parts, lengths]: [&[f64]; 2],
    filtered: bool,
    problem: &Problem,
    h: f64,
    watch: &mut Watch,
) -> Result<Box<dyn Step>> {
    let system = problem.semilinear().expect("the record's need");
    let (m, a) = (system.len(), system.matrix());
    let mut turns = Vec::new();
    for part in lengths {
        turns.push(Turn::new(m, a, part * h, watch)?);
    }
    let plan = match parts {
        [] => IMPULSE.to_vec(),
        kicks => {
            let (count, mut done, mut plan) = (2 * kicks.len() - 1, 0.0, Vec::new());
            for i in 0..count {
                let turn = i.min(count - i);
                done += lengths[turn];
                plan.push(Part::Turn(turn));
                plan.push(Part::Kick(kicks[i.min(count - 1 - i)], done));
            }
            plan.push(Part::Turn(0));
            plan
        }
    };
    let filter = match filtered {
        true => average(name, m, a, h, watch)?,
        false => [Vec::new(), Vec::new()],
    };
    let zeros = |len: usize| vec![0.0; len];
    let method = Splitting {
        name,
        h,
        parts: plan,
        turns,
        filter,
        z: zeros(m),
        e: zeros(m),
        next: zeros(m),
        rest: zeros(m),
        place: zeros(m),
        force: zeros(m),
        kick: zeros(m / 2),
    };
    Ok(Box::new(Bound::new(method, system, String::new())))
}

/// `S = 1/(2 h) integral of e^(s A) over -h < s < h`, its block of the coordinates, and its transposed.
fn average(name: &str, m: usize, a: &[f64], h: f64, watch: &mut Watch) -> Result<[Vec<f64>; 2]> {
    let n = m / 2;
    let diagonal = (0..m).any(|i| (0..n).any(|j| a[m * i + j + if i < n { 0 } else { n }] != 0.0));
    if diagonal {
        return Err(Error::unsupported(format!(
            "{name}: needs a linear part q' = P p, p' = R q, without damping or gyroscopic forces; \
             use strang or eavf"
        )));
    }
    let mut average = [vec![0.0; n * n], vec![0.0; n * n]];
    for tau in [h, -h] {
        let mut outs = [vec![0.0; m * m], vec![0.0; m * m]];
        {
            let mut outs: Vec<&mut [f64]> = outs.iter_mut().map(|x| x.as_mut_slice()).collect();
            expm::phis(m, m <= PAIRS_TO, a, tau, &mut outs, watch)?;
        }
        for i in 0..n {
            for j in 0..n {
                average[0][n * i + j] += 0.5 * outs[1][m * i + j];
            }
        }
    }
    for i in 0..n {
        for j in 0..n {
            average[1][n * i + j] = average[0][n * j + i];
        }
    }
    Ok(average)
}

impl Splitting {
    /// The force at the coordinates there are, in `kick`.
    fn push(&mut self, system: &dyn SemiLinear, t: f64, work: &mut Work) -> Result<()> {
        let n = self.kick.len();
        work.evaluations += 1;
        self.place.copy_from_slice(&self.z);
        if !self.filter[0].is_empty() {
            self.place[..n].fill(0.0);
            add_product(&self.filter[0], &self.z[..n], &mut self.place[..n]);
        }
        system.remainder(t, &self.place, &mut self.force)?;
        match self.filter[1].is_empty() {
            true => self.kick.copy_from_slice(&self.force[n..]),
            false => {
                self.kick.fill(0.0);
                add_product(&self.filter[1], &self.force[n..], &mut self.kick);
            }
        }
        Ok(())
    }
}

impl Stepper<dyn SemiLinear> for Splitting {
    /// What rounding left of the state; the force where it is.
    fn carried_len(&self) -> usize {
        self.z.len().div_ceil(8) + self.kick.len().div_ceil(8)
    }

    fn step(
        &mut self,
        system: &dyn SemiLinear,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let (m, n) = (state.z.len(), self.kick.len());
        let (kept, force) = state.carried.split_at_mut(m.div_ceil(8));
        self.z.copy_from_slice(&state.z);
        self.e.copy_from_slice(&doubles(kept)[..m]);
        for i in 0..self.parts.len() {
            match self.parts[i] {
                Part::Turn(number) => {
                    let turn = &self.turns[number];
                    turn.apply(&self.z, &self.e, &mut self.next, &mut self.rest);
                    self.z.copy_from_slice(&self.next);
                    self.e.copy_from_slice(&self.rest);
                }
                Part::Kick(weight, place) => {
                    match i == 0 && k > 0 {
                        true => self.kick.copy_from_slice(&doubles(force)[..n]),
                        false => self.push(system, t + place * self.h, work)?,
                    }
                    for (j, kick) in self.kick.iter().enumerate() {
                        let more = weight * self.h * kick;
                        add_compensated(&mut self.z[n + j], &mut self.e[n + j], more);
                    }
                }
            }
        }
        check_finite(self.name, t, k, &self.z)?;
        doubles_mut(kept)[..m].copy_from_slice(&self.e);
        doubles_mut(force)[..n].copy_from_slice(&self.kick);
        state.z.copy_from_slice(&self.z);
        work.steps += 1;
        Ok(())
    }
}

/// Kick, turn, kick.
pub const STRANG: MethodInfo = MethodInfo {
    name: "strang",
    aliases: &["impulse", "deuflhard"],
    summary: "kicks of a force between exact linear flows",
    order: Some(2),
    symplectic: true,
    symmetric: true,
    energy_preserving: false,
    needs: Needs::Potential,
    reproducible: "on every machine",
    reference: "Deuflhard, Z. angew. Math. Phys. 30 (1979) 177",
    options: &[],
    build: |problem, h, _, watch| build("strang", [&[], &[1.0]], false, problem, h, watch),
};

/// The same, of averaged coordinates.
pub const MOLLIFIED_IMPULSE: MethodInfo = MethodInfo {
    name: "mollified_impulse",
    aliases: &[],
    summary: "kicks at averaged coordinates: no resonance of step and frequency",
    reference: "García-Archilla, Sanz-Serna & Skeel, SIAM J. Sci. Comput. 20 (1998) 930",
    build: |problem, h, _, watch| {
        build("mollified_impulse", [&[], &[1.0]], true, problem, h, watch)
    },
    ..STRANG
};

/// Five kicks.
pub const MCLACHLAN84: MethodInfo = MethodInfo {
    name: "mclachlan84",
    aliases: &[],
    summary: "five kicks between exact linear flows, for small forces of order 8",
    order: Some(4),
    reference: "McLachlan, BIT 35 (1995) 258",
    build: |problem, h, _, watch| {
        let turns = [TURNS[0], TURNS[1], 0.5 - (TURNS[0] + TURNS[1])];
        let kicks = [KICKS[0], KICKS[1], 1.0 - 2.0 * (KICKS[0] + KICKS[1])];
        build("mclachlan84", [&kicks, &turns], false, problem, h, watch)
    },
    ..STRANG
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{Options, build as make};
    use crate::model::named;

    /// Largest relative energy error of the chain over 2e4 steps.
    fn spread(info: &MethodInfo, h: f64) -> f64 {
        let native = named("fput", &[3.0, 50.0]).unwrap();
        let z0 = [1.0, 0.0, 0.0, 1.0 / 50.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        let options = Options::default();
        let mut method = make(info, &native.problem, h, &options, &mut || Ok(())).unwrap();
        let mut state = State::new(&z0, &*method).unwrap();
        let energy = |z: &[f64]| native.hamiltonian.energy(0.0, z).unwrap();
        let (start, mut worst) = (energy(&z0), 0.0_f64);
        for k in 0..20_000 {
            if method.step(k, h * k as f64, &mut state).is_err() {
                return f64::INFINITY;
            }
            worst = worst.max((energy(&state.z) / start - 1.0).abs());
        }
        worst
    }

    #[test]
    fn impulses_resonate_where_mollified_ones_do_not() {
        // h w = pi and just beside.
        let h = 0.999 * std::f64::consts::PI / 50.0;
        let (impulse, mollified) = (spread(&STRANG, h), spread(&MOLLIFIED_IMPULSE, h));
        assert!(mollified <= 0.05, "{mollified:e}");
        assert!(impulse >= 5.0 * mollified, "{impulse:e} {mollified:e}");
    }

    #[test]
    fn small_forces_show_order_eight_in_the_step() {
        let native = named("henon-heiles", &[]).unwrap();
        // The forces are 1e-7 of the linear ones.
        let z0 = [0.0, 1e-7, 1.3e-7, 0.0];
        let end = |info: &MethodInfo, h: f64, steps: u64| {
            let options = Options::default();
            let mut method = make(info, &native.problem, h, &options, &mut || Ok(())).unwrap();
            let mut state = State::new(&z0, &*method).unwrap();
            for k in 0..steps {
                method.step(k, h * k as f64, &mut state).unwrap();
            }
            state.z
        };
        let exact = end(crate::method::find("gauss16").unwrap(), 0.05, 200);
        let error = |steps: u64| {
            let z = end(&MCLACHLAN84, 10.0 / steps as f64, steps);
            z.iter().zip(&exact).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
        };
        let slope = (error(8) / error(12)).ln() / 1.5_f64.ln();
        assert!(slope >= 7.0, "{slope} {:e} {:e}", error(8), error(12));
    }
}
