//! Implicit midpoint steps of a beam of few elements, in modal coordinates: `M = I`, `K` diagonal.
//!
//! As in nodal coordinates, with `1 + delta^2 w_k^2` as preconditioner of each mode. The modal state is
//! carried; the state proper is made of it in each step and never read again.

use super::limit::Limit;
use super::start::Starts;
use crate::error::Result;
use crate::linalg::kernel::{
    Body, Eight, Lanes, Pack, dispatch, doubles, doubles_mut, packs, packs_mut,
};
use crate::method::{State, Stepper, Work};
use crate::model::beam::{Beam, Frame, Hub, Modal};

/// Places of the carried state, in packs: coordinates, momenta, then the history.
pub struct ModalMidpoint {
    name: &'static str,
    delta: f64,
    halves: usize,
    limit: Limit,
    modal: Modal,
    starts: Starts,
    /// Of each mode: what damping takes, and `1/(1 + delta^2 w^2 + delta c)`.
    damping: Vec<Eight>,
    inverse: Vec<Eight>,
    inertia: f64,
    spring: f64,
    /// Whether inertia can be lost to foreshortening.
    guarded: bool,
    /// Coordinates, momenta, rates with `theta'` after them, and work space.
    x: Vec<Eight>,
    y: Vec<Eight>,
    rates: Vec<Eight>,
    work: Vec<Eight>,
}

/// The angle, its momentum, work and loss over a half step.
struct Moved {
    angle: f64,
    momentum: f64,
    work: f64,
    loss: f64,
    evaluations: u64,
}

impl ModalMidpoint {
    /// Steps of `h` as `halves` midpoint steps.
    pub fn new(
        name: &'static str,
        beam: &Beam,
        h: f64,
        halves: usize,
        tolerance: Option<f64>,
    ) -> ModalMidpoint {
        let delta = 0.5 * h / halves as f64;
        let modal = Modal::new(beam, Frame::Held);
        let height = modal.layout.height;
        let [alpha, beta] = beam.parameters().damping;
        let zeros = |packs: usize| vec![Eight::ZERO; packs];
        let (mut damping, mut inverse) = (zeros(height), zeros(height));
        let squares = doubles(&modal.squares);
        for (k, square) in squares.iter().enumerate().take(modal.modes) {
            let lost = alpha + beta * square;
            doubles_mut(&mut damping)[k] = lost;
            doubles_mut(&mut inverse)[k] = 1.0 / (1.0 + delta * delta * square + delta * lost);
        }
        ModalMidpoint {
            name,
            delta,
            halves,
            limit: Limit::new(tolerance),
            starts: Starts::new(height + 1, halves, false),
            damping,
            inverse,
            inertia: beam.inertia(),
            spring: beam.springs()[0],
            guarded: beam.can_degenerate(),
            x: zeros(height),
            y: zeros(height),
            rates: zeros(height + 1),
            work: zeros(8 * height),
            modal,
        }
    }
}

impl Stepper<Beam> for ModalMidpoint {
    fn carried_len(&self) -> usize {
        2 * self.modal.layout.height + self.starts.carried_len()
    }

    fn step(
        &mut self,
        beam: &Beam,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let (n, dof, height) = (3 * beam.nodes(), beam.dof(), self.modal.layout.height);
        let free = beam.angles() == 1;
        let (modal, history) = state.carried.split_at_mut(2 * height);
        if k == 0 {
            let z = &state.z;
            self.modal.coordinates(&z[..n], &mut doubles_mut(&mut self.x)[..n]);
            self.modal.modal_momenta(&z[dof..dof + n], &mut doubles_mut(&mut self.y)[..n]);
            beam.start(t, &z[..2 * dof], |w, angle| {
                // Phi^-1 w = (M Phi)^T w
                let rates = doubles_mut(&mut self.rates);
                self.modal.coordinates(w, &mut rates[..n]);
                rates[8 * height] = angle;
            })
            .map_err(|error| error.in_step(k))?;
        } else {
            self.x.copy_from_slice(&modal[..height]);
            self.y.copy_from_slice(&modal[height..]);
        }
        let mut angle = if free { state.z[n] } else { 0.0 };
        let mut momentum = if free { state.z[dof + n] } else { 0.0 };
        let mut books = [0.0; 2];
        for half in 0..self.halves {
            self.starts.guess(k, half, history, &mut self.rates);
            let begin = t + 2.0 * self.delta * half as f64;
            let driven = match &beam.parameters().hub {
                Hub::Driven(rotation) => {
                    let [_, speed, acceleration] = rotation.at(begin + self.delta)?;
                    doubles_mut(&mut self.rates)[8 * height] = speed;
                    Some(acceleration)
                }
                _ => None,
            };
            let t = begin + self.delta;
            let moved = dispatch(Half { method: self, t, angle, momentum, driven })
                .map_err(|error| error.in_step(k))?;
            let Some(moved) = moved else {
                let mut q = vec![0.0; n];
                self.modal.displace(&doubles(&self.x)[..n], &mut q);
                return Err(beam.indefinite_at(begin, &q).in_step(k));
            };
            (angle, momentum) = (moved.angle, moved.momentum);
            books[0] += moved.work;
            books[1] += moved.loss;
            work.evaluations += moved.evaluations;
            self.starts.keep(half, &self.rates);
        }
        self.starts.store(k, history);
        modal[..height].copy_from_slice(&self.x);
        modal[height..].copy_from_slice(&self.y);
        let z = &mut state.z;
        let (q, p) = z.split_at_mut(dof);
        self.modal.unfold(&self.x, &self.y, &mut q[..n], &mut p[..n]);
        if free {
            (z[n], z[dof + n]) = (angle, momentum);
        }
        if beam.keeps_books() {
            z[2 * dof] += books[0];
            z[2 * dof + 1] += books[1];
        }
        work.steps += 1;
        Ok(())
    }
}

/// A midpoint step of `2 delta` around time `t`; `None` where the mass matrix is not positive definite.
struct Half<'a> {
    method: &'a mut ModalMidpoint,
    t: f64,
    angle: f64,
    momentum: f64,
    /// The acceleration of a prescribed rotation.
    driven: Option<f64>,
}

impl Body for Half<'_> {
    type Output = Result<Option<Moved>>;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Result<Option<Moved>> {
        let Half { method, t, angle, momentum, driven } = self;
        let ModalMidpoint { name, delta, limit, modal, inertia, spring, guarded, .. } = method;
        let ModalMidpoint { damping, inverse, x: x0, y: y0, rates, work, .. } = method;
        let (name, delta, spring, height) = (*name, *delta, *spring, modal.layout.height);
        let (squares, a, b) =
            (packs::<V>(&modal.squares), packs::<V>(&modal.a), packs::<V>(&modal.b));
        let (damping, inverse) = (packs::<V>(damping), packs::<V>(inverse));
        let (x0, y0) = (packs_mut::<V>(x0), packs_mut::<V>(y0));
        let (w, last_rate) = rates.split_at_mut(height);
        let mut theta = last_rate[0].0[0];
        let rest_inertia = *inertia;
        let (x, rest) = work.split_at_mut(height);
        let (gx, rest) = rest.split_at_mut(height);
        let (qx, rest) = rest.split_at_mut(height);
        let (gw, rest) = rest.split_at_mut(height);
        let (mid, rest) = rest.split_at_mut(height);
        let (change, rest) = rest.split_at_mut(height);
        let (column, solved) = rest.split_at_mut(height);
        let step = Pack::<V>::splat(delta);
        let zero = Pack::<V>::splat(0.0);
        for i in 0..height {
            packs_mut::<V>(x)[i] = x0[i] + step * packs::<V>(w)[i];
        }
        let mut size0 = zero;
        for x in x0.iter() {
            size0 = x.abs().max(size0);
        }
        let scale = size0.largest();
        let mut last = f64::INFINITY;
        for iteration in 1..=u32::MAX {
            products::<V>(modal, x, w, gx, qx, gw);
            let (rate, square) = (Pack::<V>::splat(theta), Pack::splat(theta * theta));
            let (mut cw, mut bx, mut xqx) = (zero, zero, zero);
            let (mut cy, mut cs, mut ww) = (zero, zero, zero);
            for i in 0..height {
                let (x, w) = (packs::<V>(x)[i], packs::<V>(w)[i]);
                let c = a[i] - packs::<V>(gx)[i];
                let out = packs::<V>(qx)[i];
                let moving = w + c * rate;
                let force = (rate * packs::<V>(gw)[i] + square * (b[i] + out))
                    - (squares[i] * x + damping[i] * w);
                let y = ((moving - y0[i]) - step * force) * inverse[i];
                let s = c * inverse[i];
                packs_mut::<V>(column)[i] = c;
                packs_mut::<V>(mid)[i] = moving;
                packs_mut::<V>(change)[i] = y;
                packs_mut::<V>(solved)[i] = s;
                cw = cw + c * w;
                bx = bx + b[i] * x;
                xqx = xqx + x * out;
                cy = cy + c * y;
                cs = cs + c * s;
                ww = ww + damping[i] * w * w;
            }
            let inertia = rest_inertia + (2.0 * bx.sum() + xqx.sum());
            let coupled = cw.sum();
            let (mut turned, mut force) = (0.0, 0.0);
            if driven.is_none() {
                force = -spring * (angle + delta * theta);
                let schur = inertia + delta * delta * spring - cs.sum();
                if schur.is_nan() || schur <= 0.0 {
                    return Ok(None);
                }
                let held = momentum + delta * force;
                turned = (held - (coupled + inertia * theta) + cy.sum()) / schur;
            }
            let by = Pack::<V>::splat(turned);
            let (mut moved, mut size, mut zeros) = (zero, zero, zero);
            for i in 0..height {
                let y = packs::<V>(change)[i] + by * packs::<V>(solved)[i];
                let rate = packs::<V>(w)[i] - y;
                packs_mut::<V>(change)[i] = y;
                packs_mut::<V>(w)[i] = rate;
                packs_mut::<V>(x)[i] = x0[i] + step * rate;
                moved = y.abs().max(moved);
                size = rate.abs().max(size);
                // A maximum drops what is not a number.
                zeros = zeros + y * zero;
            }
            let moved = delta.abs() * ((moved.largest() + zeros.sum()).max(turned.abs()));
            let size = scale.max(delta.abs() * size.largest());
            let power = match driven {
                None => 0.0,
                Some(acceleration) => -acceleration * (coupled + theta * inertia),
            };
            theta += turned;
            if !limit.reached(name, t, iteration, moved, size, &mut last)? {
                continue;
            }
            let (twice, two) = (Pack::<V>::splat(2.0 * delta), Pack::<V>::splat(2.0));
            for i in 0..height {
                let c = packs::<V>(column)[i];
                let middle = (packs::<V>(mid)[i] - packs::<V>(change)[i]) + by * c;
                y0[i] = two * middle - y0[i];
                x0[i] = x0[i] + twice * packs::<V>(w)[i];
                packs_mut::<V>(x)[i] = x0[i];
            }
            if *guarded {
                // m - c.c where the half step ends.
                products::<V>(modal, x, w, gx, qx, gw);
                let (mut bx, mut xqx, mut cc) = (zero, zero, zero);
                for i in 0..height {
                    let (x, c) = (packs::<V>(x)[i], a[i] - packs::<V>(gx)[i]);
                    bx = bx + b[i] * x;
                    xqx = xqx + x * packs::<V>(qx)[i];
                    cc = cc + c * c;
                }
                if rest_inertia + (2.0 * bx.sum() + xqx.sum()) <= cc.sum() {
                    return Ok(None);
                }
            }
            last_rate[0].0[0] = theta;
            // Where nothing acts on the angle its momentum is kept to the last bit.
            return Ok(Some(Moved {
                angle: angle + 2.0 * delta * theta,
                momentum: momentum + 2.0 * delta * (force - delta * spring * turned),
                work: 2.0 * delta * power,
                loss: 2.0 * delta * ww.sum(),
                evaluations: u64::from(iteration),
            }));
        }
        unreachable!("the loop ends at its cap")
    }
}

/// `G x`, `Q x` and `G w`.
#[inline(always)]
fn products<V: Lanes>(
    modal: &Modal,
    x: &[Eight],
    w: &[Eight],
    gx: &mut [Eight],
    qx: &mut [Eight],
    gw: &mut [Eight],
) {
    let height = modal.layout.height;
    let (G, Q) = (packs::<V>(&modal.gyroscopic), packs::<V>(&modal.outward));
    let (x, w) = (&doubles(x)[..modal.modes], &doubles(w)[..modal.modes]);
    for i in 0..height {
        let zero = Pack::<V>::splat(0.0);
        // Two chains each, so that additions overlap.
        let mut sums = [[zero; 3]; 2];
        for j in 0..modal.modes {
            let [gx, qx, gw] = sums[j % 2];
            let (xj, wj) = (Pack::<V>::splat(x[j]), Pack::splat(w[j]));
            let (g, q) = (G[j * height + i], Q[j * height + i]);
            sums[j % 2] = [gx + g * xj, qx + q * xj, gw + g * wj];
        }
        packs_mut::<V>(gx)[i] = sums[0][0] + sums[1][0];
        packs_mut::<V>(qx)[i] = sums[0][1] + sums[1][1];
        packs_mut::<V>(gw)[i] = sums[0][2] + sums[1][2];
    }
}
