//! Gauss methods on a rotating beam in the modes of beam and hub, all stages in one sweep.
//!
//! The linear part, oscillators, is solved within the stages: what an iteration leaves of the
//! equations of the stages is divided by `I - h A L`, three small products a mode. Iterations start
//! from the nonlinear remainder of the last step, extrapolated to the new stages, and end at rounding;
//! the state is summed with compensation.

use crate::error::{Error, Result};
use crate::linalg::kernel::{
    Body, Eight, Lanes, Pack, dispatch, doubles, doubles_mut, packs, packs_mut,
};
use crate::linalg::newton::Lu;
use crate::method::common::not_solved;
use crate::method::{State, Stepper, Work};
use crate::model::beam::{Beam, Frame, Hub, Modal};
use crate::tableau::Tableau;

/// Most elements in modal coordinates.
pub const MOST: usize = 64;

/// Iterations at most.
const CAP: u32 = 60;

/// Change, in parts of the state, that the next iteration may leave undone.
const ROUNDING: f64 = 1e-16;

/// Change below which one that does not shrink is rounding.
const SMALL: f64 = 1e-10;

/// Method and memory; stages are lanes.
pub struct GaussBeam {
    name: &'static str,
    h: f64,
    tableau: Tableau,
    modal: Modal,
    /// `h A`, column after column; `h b`; what extrapolates stages to those of the next step.
    weights: Vec<Eight>,
    last: Eight,
    ahead: Vec<Eight>,
    /// Of each mode `B = (I + h^2 w^2 A^2)^-1` and `h A B`, column after column.
    inverse: Vec<Eight>,
    /// Of each mode: `w^2`, `a`, `b`, damping.
    squares: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
    damping: [f64; 2],
    /// `G`, `Q`, row after row.
    matrices: [Vec<f64>; 2],
    inertia: f64,
    spring: f64,
    /// Whether inertia can be lost to foreshortening.
    guarded: bool,
    /// Least and largest inertia of the hub alone over the stages.
    sigma: [f64; 2],
    /// Modal coordinates and momenta with their remainders, and of the angle: 4 packs of rows.
    state: Vec<f64>,
    /// Stages, their rates and the remainders of these.
    stages: Vec<Eight>,
    rates: Vec<Eight>,
    remainder: Vec<Eight>,
    spare: Vec<Eight>,
    /// Angle and momentum at the start of the step.
    start: [f64; 2],
    /// Angle and momentum at the stages, rate of the angle and of its momentum.
    hub: [Eight; 4],
    /// Prescribed speeds and accelerations at the stages.
    driven: Option<[Eight; 2]>,
    books: [Eight; 2],
}

impl GaussBeam {
    /// For a plain beam of [`MOST`] elements at most.
    pub fn new(name: &'static str, tableau: Tableau, beam: &Beam, h: f64) -> Result<GaussBeam> {
        let modal = Modal::new(beam, Frame::Whole);
        let (N, s) = (modal.modes, tableau.b.len());
        let height = modal.layout.height;
        let column = |rows: &dyn Fn(usize) -> f64| -> Eight {
            Eight(std::array::from_fn(|i| if i < s { rows(i) } else { 0.0 }))
        };
        let weights = (0..s).map(|j| column(&|i| h * tableau.a[s * i + j])).collect();
        // Lagrange polynomials through the stages, at the places of the next ones.
        let ahead = (0..s)
            .map(|j| {
                column(&|i| {
                    let at = 1.0 + tableau.c[i];
                    (0..s)
                        .filter(|&k| k != j)
                        .map(|k| (at - tableau.c[k]) / (tableau.c[j] - tableau.c[k]))
                        .product()
                })
            })
            .collect();
        let squares = doubles(&modal.squares)[..N].to_vec();
        let mut inverse = Vec::with_capacity(2 * N * s);
        let mut lu = Lu::new(s);
        for square in &squares {
            let scale = h * h * square;
            for i in 0..s {
                for j in 0..s {
                    let product: f64 =
                        (0..s).map(|k| tableau.a[s * i + k] * tableau.a[s * k + j]).sum();
                    lu.matrix()[s * i + j] = scale * product + if i == j { 1.0 } else { 0.0 };
                }
            }
            if !lu.factor() {
                return Err(Error::argument(format!("{name}: I + h^2 w^2 A^2 is singular")));
            }
            let mut columns = vec![vec![0.0; s]; s];
            for (j, unit) in columns.iter_mut().enumerate() {
                unit[j] = 1.0;
                lu.solve(unit);
                inverse.push(column(&|i| unit[i]));
            }
            for unit in &columns {
                inverse.push(column(&|i| {
                    let row = &tableau.a[s * i..][..s];
                    h * row.iter().zip(unit).map(|(a, x)| a * x).sum::<f64>()
                }));
            }
        }
        let rows = |packed: &[Eight]| -> Vec<f64> {
            (0..N * N).map(|at| doubles(packed)[8 * height * (at % N) + at / N]).collect()
        };
        let matrices = [rows(&modal.gyroscopic), rows(&modal.outward)];
        let zeros = |packs: usize| vec![Eight::ZERO; packs];
        Ok(GaussBeam {
            name,
            h,
            tableau,
            weights,
            last: column(&|i| h * tableau.b[i]),
            ahead,
            inverse,
            squares,
            a: doubles(&modal.a)[..N].to_vec(),
            b: doubles(&modal.b)[..N].to_vec(),
            damping: beam.parameters().damping,
            matrices,
            inertia: beam.inertia(),
            spring: beam.springs()[0],
            guarded: beam.can_degenerate(),
            sigma: [0.0; 2],
            state: vec![0.0; 4 * N],
            stages: zeros(2 * N),
            rates: zeros(2 * N),
            remainder: zeros(2 * N),
            spare: zeros(5 * N),
            start: [0.0; 2],
            hub: [Eight::ZERO; 4],
            driven: None,
            books: [Eight::ZERO; 2],
            modal,
        })
    }
}

/// What ended a step.
enum Ending {
    Done(u32),
    Indefinite,
    Stopped(u32, f64),
}

impl Stepper<Beam> for GaussBeam {
    fn carried_len(&self) -> usize {
        let N = self.modal.modes;
        (4 * N).div_ceil(8) + 2 * N
    }

    fn step(
        &mut self,
        beam: &Beam,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let (N, n, dof) = (self.modal.modes, 3 * beam.nodes(), beam.dof());
        let free = beam.angles() == 1;
        let (kept, history) = state.carried.split_at_mut((4 * N).div_ceil(8));
        let z = &mut state.z;
        let (angle, momentum) = if free { (z[n], z[dof + n]) } else { (0.0, 0.0) };
        if k == 0 {
            self.state.fill(0.0);
            let (x, rest) = self.state.split_at_mut(N);
            self.modal.coordinates(&z[..n], x);
            self.modal.modal_momenta(&z[dof..dof + n], &mut rest[..N]);
            // Momenta of the modes are those that do not come of the hub's.
            for (y, a) in rest[..N].iter_mut().zip(&self.a) {
                *y -= a * self.modal.along * momentum;
            }
        } else {
            self.state.copy_from_slice(&doubles(kept)[..4 * N]);
        }
        self.start = [angle, momentum];
        self.hub = [Eight([angle; 8]), Eight([momentum; 8]), Eight::ZERO, Eight::ZERO];
        if let Hub::Driven(rotation) = &beam.parameters().hub {
            let mut at = [Eight::ZERO; 2];
            for lane in 0..8 {
                // Lanes without a stage repeat the first.
                let c = self.tableau.c.get(lane).unwrap_or(&self.tableau.c[0]);
                let [_, speed, acceleration] = rotation.at(t + c * self.h)?;
                (at[0].0[lane], at[1].0[lane]) = (speed, acceleration);
            }
            self.driven = Some(at);
        }
        let first = k == 0;
        let ending = match self.tableau.b.len() {
            2 => dispatch(Solve::<2> { method: self, history, first }),
            3 => dispatch(Solve::<3> { method: self, history, first }),
            4 => dispatch(Solve::<4> { method: self, history, first }),
            6 => dispatch(Solve::<6> { method: self, history, first }),
            _ => dispatch(Solve::<8> { method: self, history, first }),
        };
        match ending {
            Ending::Done(iterations) => {
                work.evaluations += u64::from(iterations) * self.tableau.b.len() as u64;
            }
            Ending::Indefinite => {
                let mut q = vec![0.0; n];
                self.modal.displace(&self.state[..N], &mut q);
                return Err(beam.indefinite_at(t, &q).in_step(k));
            }
            Ending::Stopped(iterations, residual) => {
                return Err(not_solved(self.name, t, k, iterations, residual));
            }
        }
        let b = self.last.0;
        let sum = |x: &Eight| b.iter().zip(x.0).map(|(b, x)| b * x).sum::<f64>();
        let (angle, momentum) = (angle + sum(&self.hub[2]), momentum + sum(&self.hub[3]));
        history.copy_from_slice(&self.remainder);
        doubles_mut(kept)[..4 * N].copy_from_slice(&self.state);
        // Back to nodes.
        let (x, y) = (&self.state[..N], &self.state[N..2 * N]);
        let height = self.modal.layout.height;
        let work_space = &mut self.spare[..2 * height];
        let (to_x, to_y) = work_space.split_at_mut(height);
        for (to, from) in doubles_mut(to_x).iter_mut().zip(x) {
            *to = *from;
        }
        for ((to, from), a) in doubles_mut(to_y).iter_mut().zip(y).zip(&self.a) {
            *to = from + a * self.modal.along * momentum;
        }
        let (q, p) = z.split_at_mut(dof);
        self.modal.unfold(to_x, to_y, &mut q[..n], &mut p[..n]);
        if free {
            (z[n], z[dof + n]) = (angle, momentum);
        }
        if beam.keeps_books() {
            z[2 * dof] += sum(&self.books[0]);
            z[2 * dof + 1] += sum(&self.books[1]);
        }
        work.steps += 1;
        Ok(())
    }
}

/// The stages of a step, and the modal state at its end.
struct Solve<'a, const S: usize> {
    method: &'a mut GaussBeam,
    /// The remainder of the last step.
    history: &'a [Eight],
    first: bool,
}

impl<const S: usize> Body for Solve<'_, S> {
    type Output = Ending;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Ending {
        let Solve { method, history, first } = self;
        let N = method.modal.modes;
        // Stages of the linear part under the extrapolated remainder: as a defect from the state.
        for k in 0..2 * N {
            packs_mut::<V>(&mut method.stages)[k] = Pack::splat(method.state[k]);
        }
        if first {
            if !evaluate::<V, S>(method) {
                return Ending::Indefinite;
            }
            take_remainder::<V>(method);
        } else {
            for k in 0..2 * N {
                packs_mut::<V>(&mut method.remainder)[k] =
                    stage_product::<V, S>(&method.ahead, &history[k].0);
            }
        }
        for k in 0..N {
            let square = Pack::<V>::splat(method.squares[k]);
            let (x, y) = (packs::<V>(&method.stages)[k], packs::<V>(&method.stages)[N + k]);
            let rate = packs_mut::<V>(&mut method.rates);
            rate[k] = y + packs::<V>(&method.remainder)[k];
            rate[N + k] = packs::<V>(&method.remainder)[N + k] - square * x;
        }
        correct::<V, S>(method);
        let mut size = [0.0_f64; 2];
        for (half, size) in size.iter_mut().enumerate() {
            for x in &method.state[half * N..][..N] {
                *size = size.max(x.abs());
            }
        }
        let mut last = f64::INFINITY;
        for iteration in 1..=CAP {
            if !evaluate::<V, S>(method) {
                return Ending::Indefinite;
            }
            let [x, y] = correct::<V, S>(method);
            let [x_size, y_size] = stage_sizes::<V>(method);
            let moved = (x / size[0].max(x_size).max(f64::MIN_POSITIVE))
                .max(y / size[1].max(y_size).max(f64::MIN_POSITIVE));
            if !moved.is_finite() {
                return Ending::Stopped(iteration, moved);
            }
            let left = if last.is_finite() { moved * (moved / last).min(1.0) } else { moved };
            if left <= ROUNDING || (moved >= last && moved <= SMALL) {
                // Rates at the corrected stages, to first order.
                for k in 0..N {
                    let square = Pack::<V>::splat(method.squares[k]);
                    let change = packs::<V>(&method.spare);
                    let (x, y) = (change[k], change[N + k]);
                    let rate = packs_mut::<V>(&mut method.rates);
                    rate[k] = rate[k] + y;
                    rate[N + k] = rate[N + k] - square * x;
                }
                take_remainder::<V>(method);
                for k in 0..2 * N {
                    let total = packs::<V>(&method.rates)[k] * packs::<V>(&[method.last])[0];
                    let (sum, lost) =
                        compensated(method.state[k], method.state[2 * N + k], total.sum());
                    (method.state[k], method.state[2 * N + k]) = (sum, lost);
                }
                // Where inertia has hardly changed over the stages it is there at the end as well.
                if method.guarded && method.sigma[0] < 0.5 * method.sigma[1] {
                    // Where the step ends, by a sweep whose rates nobody needs.
                    let books = (method.hub, method.books);
                    for k in 0..2 * N {
                        packs_mut::<V>(&mut method.stages)[k] = Pack::splat(method.state[k]);
                    }
                    if !evaluate::<V, S>(method) {
                        return Ending::Indefinite;
                    }
                    (method.hub, method.books) = books;
                }
                return Ending::Done(iteration);
            }
            last = moved;
        }
        Ending::Stopped(CAP, last)
    }
}

/// `x + (e + d)`: the sum and what it loses.
#[inline(always)]
fn compensated(x: f64, e: f64, d: f64) -> (f64, f64) {
    let d = e + d;
    let sum = x + d;
    (sum, d - (sum - x))
}

/// A product of a matrix of stages, column after column, and the stages of a quantity.
#[inline(always)]
fn stage_product<V: Lanes, const S: usize>(matrix: &[Eight], x: &[f64; 8]) -> Pack<V> {
    let columns = packs::<V>(matrix).first_chunk::<S>().expect("a column a stage");
    // Two chains, so that additions overlap.
    let mut sums = [Pack::<V>::splat(0.0); 2];
    for j in 0..S {
        sums[j % 2] = sums[j % 2] + columns[j] * Pack::splat(x[j]);
    }
    sums[0] + sums[1]
}

/// `sum of g_j x_j`.
#[inline(always)]
fn weighted<V: Lanes>(g: &[f64], x: &[Pack<V>]) -> Pack<V> {
    let mut sums = [Pack::<V>::splat(0.0); 2];
    let (pairs, others) = (g.chunks_exact(2), x.chunks_exact(2));
    if let ([g], [x]) = (pairs.remainder(), others.remainder()) {
        sums[0] = Pack::splat(*g) * *x;
    }
    for (g, x) in pairs.zip(others) {
        sums[0] = sums[0] + Pack::splat(g[0]) * x[0];
        sums[1] = sums[1] + Pack::splat(g[1]) * x[1];
    }
    sums[0] + sums[1]
}

/// The remainders of the rates beyond the linear part.
#[inline(always)]
fn take_remainder<V: Lanes>(method: &mut GaussBeam) {
    let N = method.modal.modes;
    for k in 0..N {
        let square = Pack::<V>::splat(method.squares[k]);
        let (x, y) = (packs::<V>(&method.stages)[k], packs::<V>(&method.stages)[N + k]);
        let (dx, dy) = (packs::<V>(&method.rates)[k], packs::<V>(&method.rates)[N + k]);
        let out = packs_mut::<V>(&mut method.remainder);
        out[k] = dx - y;
        out[N + k] = dy + square * x;
    }
}

/// Corrects the stages by what their rates leave of the equations; the largest changes.
#[inline(always)]
fn correct<V: Lanes, const S: usize>(method: &mut GaussBeam) -> [f64; 2] {
    let N = method.modal.modes;
    let mut largest = [Pack::<V>::splat(0.0); 2];
    let mut zeros = Pack::<V>::splat(0.0);
    // What the state and the rates make of the stages, less the stages.
    for k in 0..2 * N {
        let made = stage_product::<V, S>(&method.weights, &method.rates[k].0);
        let start = Pack::<V>::splat(method.state[k]);
        let late = Pack::<V>::splat(method.state[2 * N + k]);
        let stage = packs::<V>(&method.stages)[k];
        packs_mut::<V>(&mut method.spare)[2 * N + k] = (start - stage) + (late + made);
    }
    for k in 0..N {
        // dX = B D_x + h A B D_y, dY = B D_y - w^2 h A B D_x
        let (B, C) = method.inverse[2 * S * k..][..2 * S].split_at(S);
        let (x, y) = (&method.spare[2 * N + k].0, &method.spare[3 * N + k].0);
        let dx = stage_product::<V, S>(B, x) + stage_product::<V, S>(C, y);
        let pulled = Pack::splat(method.squares[k]) * stage_product::<V, S>(C, x);
        let dy = stage_product::<V, S>(B, y) - pulled;
        let spare = packs_mut::<V>(&mut method.spare);
        (spare[k], spare[N + k]) = (dx, dy);
        let stages = packs_mut::<V>(&mut method.stages);
        stages[k] = stages[k] + dx;
        stages[N + k] = stages[N + k] + dy;
        largest[0] = dx.abs().max(largest[0]);
        largest[1] = dy.abs().max(largest[1]);
        zeros = zeros + (dx + dy) * Pack::splat(0.0);
    }
    // A maximum drops what is not a number.
    let lost = zeros.sum();
    [largest[0].largest() + lost, largest[1].largest() + lost]
}

/// Largest coordinate and momentum of the stages.
#[inline(always)]
fn stage_sizes<V: Lanes>(method: &GaussBeam) -> [f64; 2] {
    let N = method.modal.modes;
    let mut largest = [Pack::<V>::splat(0.0); 2];
    for k in 0..N {
        largest[0] = packs::<V>(&method.stages)[k].abs().max(largest[0]);
        largest[1] = packs::<V>(&method.stages)[N + k].abs().max(largest[1]);
    }
    [largest[0].largest(), largest[1].largest()]
}

/// Rates at all stages; whether the mass matrix is positive definite at all of them.
#[inline(always)]
fn evaluate<V: Lanes, const S: usize>(method: &mut GaussBeam) -> bool {
    let N = method.modal.modes;
    let along = method.modal.along;
    let GaussBeam { stages, rates, spare, hub, squares, a, b, matrices, .. } = method;
    let [G, Q] = matrices;
    let zero = Pack::<V>::splat(0.0);
    let free = method.driven.is_none();
    let (x, y) = packs::<V>(stages).split_at(N);
    let (x, y) = (&x[..N], &y[..N]);
    let (column, rest) = packs_mut::<V>(spare).split_at_mut(N);
    let (outward, _) = rest.split_at_mut(N);
    // Without a spring the angle acts on nothing, and its momentum is kept.
    if free && method.spring != 0.0 {
        for half in 0..2 {
            let moved = stage_product::<V, S>(&method.weights, &hub[2 + half].0);
            packs_mut::<V>(&mut hub[..])[half] = Pack::splat(method.start[half]) + moved;
        }
    }
    let (mut m, mut cw, mut cx) = (zero, zero, zero);
    let (mut ac, mut ap, mut aa) = (zero, zero, 0.0);
    let momentum = packs::<V>(&hub[..])[1];
    for k in 0..N {
        let c = Pack::splat(a[k]) - weighted(&G[N * k..][..N], x);
        let out = weighted(&Q[N * k..][..N], x);
        column[k] = c;
        outward[k] = Pack::splat(b[k]) + out;
        m = m + x[k] * (Pack::splat(2.0 * b[k]) + out);
        let p = y[k] + Pack::splat(a[k] * along) * momentum;
        ac = ac + Pack::splat(a[k]) * c;
        ap = ap + Pack::splat(a[k]) * p;
        aa += a[k] * a[k];
        cw = cw + c * p;
        cx = cx + c * c;
    }
    let m = Pack::splat(method.inertia) + m;
    // The inverse of I + along a a^T is I - less a a^T.
    let less = Pack::<V>::splat(along / (1.0 + along * aa));
    let theta = match &method.driven {
        Some(at) => packs::<V>(at)[0],
        None => {
            let sigma = m - (cx - less * ac * ac);
            // The least over the stages, as a largest of negatives.
            let least = -(-sigma).largest();
            method.sigma = [least, sigma.largest()];
            if least <= 0.0 || least.is_nan() {
                return false;
            }
            (momentum - (cw - less * ac * ap)) / sigma
        }
    };
    let rate = packs_mut::<V>(rates);
    let mut aw = zero;
    for k in 0..N {
        let ak = Pack::<V>::splat(a[k]);
        rate[k] = match free {
            true => {
                let p = y[k] + Pack::splat(a[k] * along) * momentum;
                (p - less * ak * ap) - theta * (column[k] - less * ak * ac)
            }
            false => y[k] - theta * column[k],
        };
        aw = aw + ak * rate[k];
    }
    let pull = match free {
        true => Pack::splat(-method.spring) * packs::<V>(&hub[..])[0],
        false => zero,
    };
    let square = theta * theta;
    let [alpha, beta] = method.damping;
    let (mut loss, mut swing) = (zero, zero);
    for k in 0..N {
        let turned = weighted(&G[N * k..][..N], &rate[..N]);
        let force = (theta * turned + square * outward[k]) - Pack::splat(squares[k]) * x[k];
        let ak = Pack::<V>::splat(a[k] * along);
        let lost =
            Pack::splat(alpha) * (rate[k] + ak * aw) + Pack::splat(beta * squares[k]) * rate[k];
        loss = loss + lost * rate[k];
        swing = swing + column[k] * rate[k];
        rate[N + k] = (force - lost) - ak * pull;
    }
    let books = packs_mut::<V>(&mut method.books);
    books[1] = loss;
    if let Some(at) = &method.driven {
        books[0] = zero - packs::<V>(at)[1] * (swing + theta * m);
    }
    let hub = packs_mut::<V>(&mut hub[..]);
    hub[2] = theta;
    hub[3] = pull;
    true
}
