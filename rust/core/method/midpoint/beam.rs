//! Implicit midpoint steps of the rotating beam, in nodal coordinates: O(n).
//!
//! Over `2 delta` the unknown is the rate `w = (y - y0)/delta` of the midpoint y, where the momenta are
//! `p = M(y) w`; no mass matrix is inverted. The residual `R = p - p0 - delta F` is brought to rounding
//! by a preconditioner that is never refreshed (`M + delta^2 K`, for linear elasticity), once a half
//! step (third order), or in each iteration (`newton="full"`, as the paper has it). Angles are
//! eliminated by their exact Schur complement.

use super::fused;
use super::limit::Limit;
use super::start::Starts;
use crate::error::{Error, Result};
use crate::linalg::kernel::{Eight, dispatch, doubles, doubles_mut};
use crate::method::{State, Stepper, Work};
use crate::model::beam::{
    Beam, Blocks, Chain, Factor, Fields, HubForces, Motion, Rates, Tangents, Tridiagonal, solve_hub,
};

/// Iterations after which a tangent is taken anew.
const REFRESHED: u32 = 6;

/// What the residual is divided by.
enum Preconditioner {
    Constant(Factor),
    /// The tangent where a step starts.
    Tangent(Chain),
    /// The whole Jacobian, in each iteration.
    Full(Box<Whole>),
}

/// `M + delta C + delta^2 (K_T - theta'^2 Q) - 2 delta theta' G`.
struct Whole {
    /// What does not change where elasticity is linear; Q; G.
    parts: [Chain; 3],
    chain: Chain,
}

impl Whole {
    fn new(beam: &Beam, delta: f64, matrices: &mut (Tridiagonal, Blocks)) -> Whole {
        let mut parts = [(); 3].map(|()| Chain::new(beam.nodes()));
        let ((axial, bending), (a, b)) = (beam.mass(), matrices);
        let [alpha, beta] = beam.parameters().damping;
        a.combine(1.0 + delta * alpha, axial, 0.0, axial);
        b.combine(1.0 + delta * alpha, bending, 0.0, bending);
        let stiffness = delta * beta + if beam.elastic().is_linear() { delta * delta } else { 0.0 };
        beam.elastic().add_tangent(stiffness, None, a, b, None);
        parts[0].set(a, b);
        parts[1].set(axial, beam.outward());
        parts[2].add_skew(1.0, beam.gyroscopic());
        Whole { parts, chain: Chain::new(beam.nodes()) }
    }

    /// Whether the pivots are positive.
    fn refresh(&mut self, delta: f64, theta: f64, curved: impl FnOnce(&mut Chain)) -> bool {
        let [constant, outward, skew] = &self.parts;
        let turn = delta * theta;
        self.chain.combine(constant, -turn * turn, outward, -2.0 * turn, skew);
        curved(&mut self.chain);
        self.chain.factor()
    }
}

pub struct BeamMidpoint {
    name: &'static str,
    delta: f64,
    /// Midpoint steps in a step.
    halves: usize,
    /// Whether the fused passes cover all that acts.
    plain: bool,
    /// Whether this is the first midpoint step of a step.
    first: bool,
    limit: Limit,
    preconditioner: Preconditioner,
    starts: Starts,
    /// Rates, field after field, then those of the angles.
    flat: Vec<Eight>,
    motion: Motion,
    /// The state where a half step begins, and its end.
    q: Fields,
    p: Fields,
    angles: [f64; 2],
    momenta: [f64; 2],
    books: [f64; 2],
    /// Momenta at the midpoint, the residual and what comes of it.
    mid: Fields,
    residual: Fields,
    spare: Fields,
    /// What the rotation does with the displacements, for the whole Jacobian.
    swing: Fields,
    solved: [Fields; 2],
    z: Vec<f64>,
    matrices: (Tridiagonal, Blocks),
    cross: Vec<[[f64; 4]; 2]>,
    tangents: Tangents,
}

impl BeamMidpoint {
    /// Steps of `h` as `halves` midpoint steps.
    pub fn new(
        name: &'static str,
        beam: &Beam,
        h: f64,
        halves: usize,
        full: bool,
        tolerance: Option<f64>,
    ) -> Result<BeamMidpoint> {
        let nodes = beam.nodes();
        let delta = 0.5 * h / halves as f64;
        let (axial, bending) = beam.mass();
        let mut matrices = (axial.clone(), bending.clone());
        let [alpha, beta] = beam.parameters().damping;
        let preconditioner = if full {
            Preconditioner::Full(Box::new(Whole::new(beam, delta, &mut matrices)))
        } else if beam.elastic().is_linear() {
            let (mass, stiffness) = (1.0 + delta * alpha, delta * delta + delta * beta);
            let (a, b) = &mut matrices;
            a.combine(mass, axial, 0.0, axial);
            b.combine(mass, bending, 0.0, bending);
            beam.elastic().add_tangent(stiffness, None, a, b, None);
            let factor = Factor::new(nodes, a, b).ok_or_else(|| {
                Error::argument(format!(
                    "{name}: M + h^2 K/16 is not positive definite; is damping negative?"
                ))
            })?;
            Preconditioner::Constant(factor)
        } else {
            Preconditioner::Tangent(Chain::new(nodes))
        };
        let zeros = || Fields::zeros(nodes);
        let len = 3 * zeros().u.len() / 8 + 1;
        Ok(BeamMidpoint {
            name,
            delta,
            halves,
            first: true,
            plain: beam.is_plain() && beam.parameters().damping == [0.0; 2],
            limit: Limit::new(tolerance),
            preconditioner,
            starts: Starts::new(len, halves, true),
            flat: vec![Eight::ZERO; len],
            motion: Motion::new(beam),
            q: zeros(),
            p: zeros(),
            angles: [0.0; 2],
            momenta: [0.0; 2],
            books: [0.0; 2],
            mid: zeros(),
            residual: zeros(),
            spare: zeros(),
            swing: zeros(),
            solved: [zeros(), zeros()],
            z: vec![0.0; 2 * beam.dof()],
            matrices,
            cross: Vec::new(),
            tangents: Tangents::new(nodes),
        })
    }

    /// As [`half`](Self::half), where the fused passes cover all that acts.
    fn plain_half(&mut self, beam: &Beam, t: f64, work: &mut Work) -> Result<()> {
        let (delta, free) = (self.delta, beam.angles() == 1);
        let t = t + delta;
        self.motion.turn(beam, t)?;
        let Motion { q, geometry, rates, .. } = &mut self.motion;
        let [column, _] = &mut geometry.columns;
        let [solved, _] = &mut self.solved;
        let spring = beam.springs()[0];
        q.set(&self.q, delta, &rates.w);
        let scale = self.q.largest();
        let (mut last, mut force) = (f64::INFINITY, 0.0);
        for iteration in 1.. {
            let theta = rates.angles[0];
            let [coupled, reach, square] = dispatch(fused::Residual {
                beam,
                delta,
                theta,
                q,
                w: &rates.w,
                start: &self.p,
                momenta: &mut self.mid,
                residual: &mut self.residual,
                column,
                border: match &self.preconditioner {
                    Preconditioner::Full(_) if free => Some([&mut self.swing, &mut *solved]),
                    _ => None,
                },
            });
            work.evaluations += 1;
            let row = match &mut self.preconditioner {
                Preconditioner::Constant(factor) => {
                    if free && iteration == 1 {
                        solved.copy(column);
                        factor.solve(solved);
                    }
                    factor.solve(&mut self.residual);
                    &*column
                }
                Preconditioner::Full(whole) => {
                    if !whole.refresh(delta, theta, |_| ()) {
                        return Err(beam.unstable(t, theta));
                    }
                    if free {
                        whole.chain.solve(solved);
                    }
                    whole.chain.solve(&mut self.residual);
                    &self.swing
                }
                Preconditioner::Tangent(_) => unreachable!("linear elasticity"),
            };
            let mut change = 0.0;
            let inertia = beam.inertia() + 2.0 * reach + square;
            if free {
                force = -spring * (self.angles[0] + delta * theta);
                let held = self.momenta[0] + delta * force;
                let [by_residual, by_column] =
                    dispatch(fused::Products { column: row, one: &self.residual, two: solved });
                let schur = inertia + delta * delta * spring - by_column;
                if schur.is_nan() || schur <= 0.0 {
                    return Err(beam.indefinite(t, q));
                }
                change = (held - (coupled + inertia * theta) + by_residual) / schur;
                rates.angles[0] += change;
            }
            let [moved, size] = dispatch(fused::Update {
                k: change,
                solved,
                change: &mut self.residual,
                w: &mut rates.w,
                delta,
                start: &self.q,
                q,
            });
            let length = delta.abs();
            let (moved, size) = (length * moved.max(change.abs()), scale.max(length * size));
            if self.limit.reached(self.name, t, iteration, moved, size, &mut last)? {
                dispatch(fused::Advance {
                    beam,
                    change: &self.residual,
                    k: change,
                    column,
                    momenta: &self.mid,
                    w: &rates.w,
                    delta,
                    p: &mut self.p,
                    q: &mut self.q,
                });
                if free {
                    self.angles[0] += 2.0 * delta * rates.angles[0];
                    // Where nothing acts on the angle its momentum is kept to the last bit.
                    self.momenta[0] += 2.0 * delta * (force - delta * spring * change);
                }
                if !free {
                    // The explicit rate of the energy under a prescribed rotation.
                    let swing = coupled + theta * inertia;
                    self.books[0] -= 2.0 * delta * self.motion.acceleration * swing;
                }
                return Ok(());
            }
        }
        unreachable!("the loop ends at its cap")
    }

    /// One midpoint step of `2 delta` from time `t`: `q`, `p`, angles and momenta move on.
    fn half(&mut self, beam: &Beam, t: f64, work: &mut Work) -> Result<()> {
        let (delta, count) = (self.delta, beam.angles());
        let t = t + delta;
        let springs = beam.springs();
        self.motion.turn(beam, t)?;
        let scale = self.q.largest();
        let mut last = f64::INFINITY;
        for iteration in 1.. {
            let forces = self.evaluate(beam, t)?;
            work.evaluations += 1;
            self.precondition(beam, t, iteration)?;
            // D dw + C dphi' = -R and C^T dw + H dphi' = -r, by the Schur complement.
            match &self.preconditioner {
                Preconditioner::Constant(factor) => factor.solve(&mut self.residual),
                Preconditioner::Tangent(chain) => chain.solve(&mut self.residual),
                Preconditioner::Full(whole) => whole.chain.solve(&mut self.residual),
            }
            let full = matches!(self.preconditioner, Preconditioner::Full(_));
            let Motion { geometry, rates, .. } = &mut self.motion;
            // Of the Jacobian, times x; the whole one has what the rotation does with q.
            let row = |i: usize, x: &Fields| {
                let swing = if full { delta * self.swing.dot(x) } else { 0.0 };
                geometry.columns[i].dot(x) + swing
            };
            let mut change = [0.0; 2];
            if count > 0 {
                let mut schur = geometry.inertia;
                let mut right = [0.0; 2];
                for i in 0..count {
                    let held = self.momenta[i] + delta * forces.angles[i];
                    let mut momentum = geometry.columns[i].dot(&rates.w);
                    for j in 0..count {
                        momentum += schur[i][j] * rates.angles[j];
                    }
                    right[i] = held - momentum + row(i, &self.residual);
                }
                for i in 0..count {
                    schur[i][i] += delta * delta * springs[i];
                    for j in 0..count {
                        schur[i][j] -= row(i, &self.solved[j]);
                    }
                }
                let solved = solve_hub(count, schur, right);
                change = solved.ok_or_else(|| beam.indefinite(t, &self.motion.q))?;
            }
            let rates = &mut self.motion.rates;
            for j in 0..count {
                self.residual.add(change[j], &self.solved[j]);
                rates.angles[j] += change[j];
            }
            rates.w.add(-1.0, &self.residual);
            let length = delta.abs();
            let moved = change.iter().fold(self.residual.largest(), |x, c| x.max(c.abs()));
            let (moved, size) = (length * moved, scale.max(length * rates.w.largest()));
            if self.limit.reached(self.name, t, iteration, moved, size, &mut last)? {
                self.advance(beam, forces, change);
                return Ok(());
            }
        }
        unreachable!("the loop ends at its cap")
    }

    /// The residual at the midpoint of the present rates.
    fn evaluate(&mut self, beam: &Beam, t: f64) -> Result<HubForces> {
        let (delta, count) = (self.delta, beam.angles());
        let motion = &mut self.motion;
        motion.q.set(&self.q, delta, &motion.rates.w);
        if count > 0 {
            for i in 0..count {
                motion.phi[i] = self.angles[i] + delta * motion.rates.angles[i];
            }
        }
        motion.place(beam);
        beam.apply_mass(&motion.rates.w, &mut self.mid);
        for j in 0..count.max(1) {
            self.mid.add(motion.rates.angles[j], &motion.geometry.columns[j]);
        }
        if beam.parameters().loads.is_some() {
            // Functions of the state see the midpoint.
            let (n, dof) = (3 * beam.nodes(), beam.dof());
            motion.q.write(&mut self.z[..n]);
            self.mid.write(&mut self.z[dof..dof + n]);
            self.z[n..dof].copy_from_slice(&motion.phi[..count]);
            for i in 0..count {
                let geometry = &motion.geometry;
                let mut momentum = geometry.columns[i].dot(&motion.rates.w);
                for j in 0..count {
                    momentum += geometry.inertia[i][j] * motion.rates.angles[j];
                }
                self.z[dof + n + i] = momentum;
            }
            motion.see(&self.z);
        }
        let forces = motion.push(beam, t)?;
        self.residual.set(&self.mid, -1.0, &self.p);
        self.residual.add(-delta, &motion.forces);
        Ok(forces)
    }

    fn precondition(&mut self, beam: &Beam, t: f64, iteration: u32) -> Result<()> {
        let (delta, count) = (self.delta, beam.angles());
        let Motion { q, rates, .. } = &self.motion;
        let theta = rates.theta();
        let (axial, bending) = beam.mass();
        let (a, b) = &mut self.matrices;
        let good = match &mut self.preconditioner {
            Preconditioner::Constant(_) => true,
            // The same for the whole step, unless it is not good enough.
            Preconditioner::Tangent(_)
                if !iteration.is_multiple_of(REFRESHED) && (iteration > 1 || !self.first) =>
            {
                true
            }
            Preconditioner::Tangent(chain) => {
                let [alpha, beta] = beam.parameters().damping;
                let keep = 1.0 - (delta * theta) * (delta * theta) + delta * alpha;
                a.combine(keep, axial, 0.0, axial);
                b.combine(keep, bending, 0.0, bending);
                self.cross.clear();
                let stiffness = delta * delta;
                beam.elastic().add_tangent(
                    stiffness,
                    Some((q, &mut self.tangents)),
                    a,
                    b,
                    Some(&mut self.cross),
                );
                beam.elastic().add_tangent(delta * beta, None, a, b, None);
                chain.set(a, b);
                chain.add_cross(1.0, &self.cross);
                chain.factor()
            }
            Preconditioner::Full(whole) => whole.refresh(delta, theta, |chain| {
                if beam.elastic().is_linear() {
                    return;
                }
                for field in a.parts_mut().into_iter().chain(b.parts_mut()) {
                    field.fill(0.0);
                }
                self.cross.clear();
                let stiffness = delta * delta;
                beam.elastic().add_tangent(
                    stiffness,
                    Some((q, &mut self.tangents)),
                    a,
                    b,
                    Some(&mut self.cross),
                );
                chain.add(a, b);
                chain.add_cross(1.0, &self.cross);
            }),
        };
        if !good {
            return Err(beam.unstable(t, theta));
        }
        let full = matches!(self.preconditioner, Preconditioner::Full(_));
        if count > 0 && (iteration == 1 || full || iteration.is_multiple_of(REFRESHED)) {
            if full {
                self.motion.swing(beam, &mut self.swing);
            }
            for (solved, column) in
                self.solved.iter_mut().zip(&self.motion.geometry.columns).take(count)
            {
                solved.copy(column);
                match &self.preconditioner {
                    Preconditioner::Constant(factor) => factor.solve(solved),
                    Preconditioner::Tangent(chain) => chain.solve(solved),
                    Preconditioner::Full(whole) => {
                        solved.add(-delta, &self.swing);
                        whole.chain.solve(solved);
                    }
                }
            }
        }
        Ok(())
    }

    /// From the midpoint to the end; the last change is not in the momenta yet.
    fn advance(&mut self, beam: &Beam, forces: HubForces, change: [f64; 2]) {
        let (delta, count) = (self.delta, beam.angles());
        let Motion { geometry, rates, .. } = &self.motion;
        beam.apply_mass(&self.residual, &mut self.spare);
        self.mid.add(-1.0, &self.spare);
        for (change, column) in change.iter().zip(&geometry.columns).take(count) {
            self.mid.add(*change, column);
        }
        self.q.add(2.0 * delta, &rates.w);
        // p1 = 2 p - p0
        std::mem::swap(&mut self.p, &mut self.spare);
        self.p.set(&self.mid, 1.0, &self.mid);
        self.p.add(-1.0, &self.spare);
        let springs = beam.springs();
        for i in 0..count {
            self.angles[i] += 2.0 * delta * rates.angles[i];
            // Where nothing acts on an angle its momentum is kept to the last bit.
            let force = forces.angles[i] - delta * springs[i] * change[i];
            self.momenta[i] += 2.0 * delta * force;
        }
        self.books[0] += 2.0 * delta * forces.power;
        self.books[1] += 2.0 * delta * forces.loss;
    }
}

fn flatten(rates: &Rates, flat: &mut [Eight]) {
    let len = rates.w.u.len();
    let flat = doubles_mut(flat);
    for (to, from) in flat.chunks_exact_mut(len).zip(rates.w.parts()) {
        to.copy_from_slice(from);
    }
    flat[3 * len..3 * len + 2].copy_from_slice(&rates.angles);
}

fn unflatten(flat: &[Eight], rates: &mut Rates) {
    let len = rates.w.u.len();
    let flat = doubles(flat);
    for (from, to) in flat.chunks_exact(len).zip(rates.w.parts_mut()) {
        to.copy_from_slice(from);
    }
    rates.angles.copy_from_slice(&flat[3 * len..3 * len + 2]);
}

impl Stepper<Beam> for BeamMidpoint {
    fn carried_len(&self) -> usize {
        self.starts.carried_len()
    }

    fn step(
        &mut self,
        beam: &Beam,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let (n, dof, count) = (3 * beam.nodes(), beam.dof(), beam.angles());
        let z = &state.z;
        if k == 0 {
            self.motion.start(beam, t, &z[..2 * dof]).map_err(|error| error.in_step(k))?;
        }
        self.q.read(&z[..n]);
        self.p.read(&z[dof..dof + n]);
        self.angles[..count].copy_from_slice(&z[n..dof]);
        self.momenta[..count].copy_from_slice(&z[dof + n..2 * dof]);
        if beam.keeps_books() {
            self.books.copy_from_slice(&z[2 * dof..]);
        }
        for half in 0..self.halves {
            if k > 0 || half > 0 {
                self.starts.guess(k, half, &state.carried, &mut self.flat);
                unflatten(&self.flat, &mut self.motion.rates);
            }
            self.first = half == 0;
            let begin = t + 2.0 * self.delta * half as f64;
            let done = match self.plain {
                true => self.plain_half(beam, begin, work),
                false => self.half(beam, begin, work),
            };
            done.map_err(|error| error.in_step(k))?;
            flatten(&self.motion.rates, &mut self.flat);
            self.starts.keep(half, &self.flat);
        }
        if beam.can_degenerate() {
            self.motion.q.copy(&self.q);
            self.motion.place(beam);
            self.motion.check(beam, t).map_err(|error| error.in_step(k))?;
        }
        self.starts.store(k, &mut state.carried);
        let z = &mut state.z;
        self.q.write(&mut z[..n]);
        self.p.write(&mut z[dof..dof + n]);
        z[n..dof].copy_from_slice(&self.angles[..count]);
        z[dof + n..2 * dof].copy_from_slice(&self.momenta[..count]);
        if beam.keeps_books() {
            z[2 * dof..].copy_from_slice(&self.books);
        }
        work.steps += 1;
        Ok(())
    }
}
