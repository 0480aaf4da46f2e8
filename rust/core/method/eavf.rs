//! The exponential average vector field method: energy without drift, for stiff linear parts.
//!
//! `z1 = e^V z + h phi_1(V) integral of F((1 - s) z + s z1) over 0 < s < 1`, `V = h A`, by Gauss quadrature:
//! the energy is conserved as far as that is exact, which with s nodes it is for potentials of degree
//! `2 s`. Of order 2, symmetric, not symplectic. Source: Li & Wu, SIAM J. Sci. Comput. 38 (2016) A1876.

use super::common::{check_finite, iterate, way};
use super::turn::{Turn, add_compensated};
use super::{Bound, MethodInfo, Needs, OptionInfo, State, Step, Stepper, Work};
use crate::error::{Error, Result};
use crate::linalg::dense::Watch;
use crate::linalg::kernel::{
    Body, Eight, Lanes, Pack, dispatch, doubles, doubles_mut, packs, packs_mut,
};
use crate::method::Options;
use crate::system::{Problem, SemiLinear};
use crate::tableau::{self, Collocation};

const NAME: &str = "eavf";

struct Eavf {
    h: f64,
    nodes: Collocation,
    places: Eight,
    /// `[e^V, h phi_1(V)]`.
    turn: Turn,
    times: Eight,
    stages: Vec<Eight>,
    rates: Vec<Eight>,
    /// State and mean remainder, and what rounding left of them.
    given: Vec<f64>,
    rests: Vec<f64>,
    end: Vec<f64>,
    end_rest: Vec<f64>,
    last: Vec<f64>,
    scratch: Vec<f64>,
}

fn build(problem: &Problem, h: f64, options: &Options, watch: &mut Watch) -> Result<Box<dyn Step>> {
    let system = problem.semilinear().expect("the record's need");
    let nodes = match options.count("nodes")? {
        Some(1) => tableau::COLLOCATION2,
        Some(2) => tableau::COLLOCATION4,
        Some(3) => tableau::COLLOCATION6,
        Some(4) => tableau::COLLOCATION8,
        Some(6) => tableau::COLLOCATION12,
        None | Some(8) => tableau::COLLOCATION16,
        Some(other) => {
            return Err(Error::argument(format!("nodes: must be 1, 2, 3, 4, 6 or 8, got {other}")));
        }
    };
    let m = system.len();
    // z' = A z + y, y' = 0.
    let mut whole = vec![0.0; 4 * m * m];
    for (i, row) in whole.chunks_exact_mut(2 * m).take(m).enumerate() {
        row[..m].copy_from_slice(&system.matrix()[m * i..][..m]);
        row[m + i] = 1.0;
    }
    let c = nodes.c;
    let method = Eavf {
        h,
        places: Eight(std::array::from_fn(|i| c.get(i).copied().unwrap_or(c[0]))),
        turn: Turn::part(2 * m, m, &whole, h, watch)?,
        nodes,
        times: Eight::ZERO,
        stages: vec![Eight::ZERO; m],
        rates: vec![Eight::ZERO; m],
        given: vec![0.0; 2 * m],
        rests: vec![0.0; 2 * m],
        end: vec![0.0; m],
        end_rest: vec![0.0; m],
        last: vec![0.0; m],
        scratch: vec![0.0; 2 * m],
    };
    Ok(Box::new(Bound::new(method, system, String::new())))
}

impl Eavf {
    /// The end that a mean remainder makes.
    fn advance(&mut self) {
        self.turn.apply(&self.given, &self.rests, &mut self.end, &mut self.end_rest);
    }

    /// The mean remainder between the state and an end.
    fn average(&mut self, system: &dyn SemiLinear, work: &mut Work) -> Result<()> {
        let (m, s) = (self.end.len(), self.nodes.b.len());
        dispatch(Between(self));
        let Eavf { times, stages, rates, scratch, .. } = self;
        system.remainders(times, stages, rates, s, scratch)?;
        work.evaluations += s as u64;
        for (d, rate) in rates.iter().enumerate() {
            let (mut sum, mut rest) = (0.0, 0.0);
            for (weight, rate) in self.nodes.b.iter().zip(rate.0) {
                add_compensated(&mut sum, &mut rest, weight * rate);
            }
            (self.given[m + d], self.rests[m + d]) = (sum, rest);
        }
        Ok(())
    }

    /// Iterates to the end of the step.
    fn solve(&mut self, system: &dyn SemiLinear, t: f64, work: &mut Work) -> Result<()> {
        iterate(NAME, t, 0, || {
            self.last.copy_from_slice(&self.end);
            self.average(system, work)?;
            self.advance();
            Ok(way(&mut self.last, &self.end))
        })
    }
}

/// States on the way from the start to the end.
struct Between<'a>(&'a mut Eavf);

impl Body for Between<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Eavf { places, stages, given, rests, end, end_rest, .. } = self.0;
        let [c] = *packs::<V>(std::slice::from_ref(places)) else { unreachable!("one pack") };
        for (d, stage) in packs_mut::<V>(stages).iter_mut().enumerate() {
            let way = (end[d] - given[d]) + (end_rest[d] - rests[d]);
            *stage = Pack::splat(given[d]) + (c * way + rests[d]);
        }
    }
}

impl Stepper<dyn SemiLinear> for Eavf {
    /// What rounding left of the state; the last mean remainder.
    fn carried_len(&self) -> usize {
        2 * self.end.len().div_ceil(8)
    }

    fn step(
        &mut self,
        system: &dyn SemiLinear,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let m = state.z.len();
        let (kept, mean) = state.carried.split_at_mut(m.div_ceil(8));
        self.given[..m].copy_from_slice(&state.z);
        self.rests[..m].copy_from_slice(&doubles(kept)[..m]);
        self.times = Eight(self.places.0.map(|place| t + place * self.h));
        self.rests[m..].fill(0.0);
        if k == 0 {
            system.remainder(t, &state.z, &mut self.given[m..])?;
            work.evaluations += 1;
        } else {
            self.given[m..].copy_from_slice(&doubles(mean)[..m]);
        }
        self.advance();
        self.solve(system, t, work).map_err(|error| error.in_step(k))?;
        check_finite(NAME, t, k, &self.end)?;
        doubles_mut(kept)[..m].copy_from_slice(&self.end_rest);
        doubles_mut(mean)[..m].copy_from_slice(&self.given[m..]);
        state.z.copy_from_slice(&self.end);
        work.steps += 1;
        Ok(())
    }
}

/// The method.
pub const EAVF: MethodInfo = MethodInfo {
    name: NAME,
    aliases: &[],
    summary: "exponential average vector field: keeps the energy",
    order: Some(2),
    symplectic: false,
    symmetric: true,
    energy_preserving: true,
    needs: Needs::Canonical,
    reproducible: "on every machine",
    reference: "Li & Wu, SIAM J. Sci. Comput. 38 (2016) A1876",
    options: &[OptionInfo {
        name: "nodes",
        doc: "1, 2, 3, 4, 6 or 8 (default) Gauss nodes of the quadrature: as far as it is exact, and so for \
              potentials of twice the degree, the energy is kept",
    }],
    build,
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{Value, build as make};
    use crate::model::named;

    #[test]
    fn two_nodes_keep_a_quartic_energy_and_one_does_not() {
        let native = named("fput", &[3.0, 50.0]).unwrap();
        let z0 = [1.0, 0.0, 0.0, 1.0 / 50.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        for (nodes, kept) in [(1, false), (2, true), (8, true)] {
            let options = Options(vec![("nodes".into(), Value::Integers(vec![nodes]))]);
            // Ten times what h w < 2 would allow.
            let mut method = make(&EAVF, &native.problem, 0.4, &options, &mut || Ok(())).unwrap();
            let mut state = State::new(&z0, &*method).unwrap();
            let energy = |z: &[f64]| native.hamiltonian.energy(0.0, z).unwrap();
            let mut worst = 0.0_f64;
            for k in 0..10_000 {
                method.step(k, 0.4 * k as f64, &mut state).unwrap();
                worst = worst.max((energy(&state.z) / energy(&z0) - 1.0).abs());
            }
            assert_eq!(worst <= 1e-13, kept, "{nodes}: {worst:e}"); // 10 u sqrt(N)
            assert!(kept || worst >= 1e-6, "{nodes}: {worst:e}");
        }
    }
}
