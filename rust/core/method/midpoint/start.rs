//! Where iterations start: rates of past half steps, extrapolated.

use crate::linalg::kernel::{Eight, doubles, doubles_mut};
use crate::model::beam::{Beam, Fields, PAD, Rates};

/// Half steps that are remembered.
const MEMORY: usize = 5;

/// Of polynomials through the last 1 to 5 points, one interval ahead; the last point first.
const AHEAD: [[f64; MEMORY]; MEMORY] = [
    [1.0, 0.0, 0.0, 0.0, 0.0],
    [2.0, -1.0, 0.0, 0.0, 0.0],
    [3.0, -3.0, 1.0, 0.0, 0.0],
    [4.0, -6.0, 4.0, -1.0, 0.0],
    [5.0, -10.0, 10.0, -5.0, 1.0],
];

/// Phase of the fastest mode over a half step up to which many points help; beyond it they magnify
/// it.
const RESOLVED: f64 = 0.5;

/// Rates of past half steps: in the carried state those of past steps, in slots by their numbers.
pub struct Starts {
    halves: usize,
    points: usize,
    /// Doubles of a field.
    field: usize,
    fresh: Vec<Rates>,
}

impl Starts {
    /// For half steps of `2 delta`.
    pub fn new(beam: &Beam, delta: f64, halves: usize) -> Starts {
        let zeros = Fields::zeros(beam.nodes());
        let field = zeros.u.len();
        let points = if 2.0 * delta.abs() * beam.fastest() <= RESOLVED { MEMORY } else { 2 };
        let fresh = vec![Rates { w: zeros, angles: [0.0; 2] }; halves];
        Starts { halves, points, field, fresh }
    }

    /// Packs of the carried state.
    pub fn carried_len(&self) -> usize {
        MEMORY * (3 * self.field / 8 + 1)
    }

    /// The rates to start half step `half` of step `k` from; left as they are at the first of all.
    pub fn guess(&self, k: u64, half: usize, carried: &[Eight], rates: &mut Rates) {
        let number = self.number(k, half);
        let count = number.min(self.points as u64) as usize;
        if count == 0 {
            return;
        }
        let past = |i: usize| -> ([&[f64]; 3], [f64; 2]) {
            let then = number - 1 - i as u64;
            match then.checked_sub(self.number(k, 0)) {
                Some(fresh) => {
                    let Rates { w, angles } = &self.fresh[fresh as usize];
                    (w.parts(), *angles)
                }
                None => {
                    let slot = self.slot(then, carried);
                    let part = |c: usize| &slot[c * self.field..][..self.field];
                    ([part(0), part(1), part(2)], [slot[3 * self.field], slot[3 * self.field + 1]])
                }
            }
        };
        let [a, b, c, d, e] = AHEAD[count - 1];
        let all: [_; MEMORY] = std::array::from_fn(|i| past(i.min(count - 1)));
        for (part, out) in rates.w.parts_mut().into_iter().enumerate() {
            let inner = PAD..self.field - PAD;
            let [x0, x1, x2, x3, x4] = all.each_ref().map(|(parts, _)| &parts[part][inner.clone()]);
            let out = &mut out[inner];
            for i in 0..out.len() {
                out[i] = (a * x0[i] + b * x1[i]) + ((c * x2[i] + d * x3[i]) + e * x4[i]);
            }
        }
        let angle = |j: usize| -> f64 {
            let x = all.each_ref().map(|(_, angles)| angles[j]);
            (a * x[0] + b * x[1]) + ((c * x[2] + d * x[3]) + e * x[4])
        };
        rates.angles = [angle(0), angle(1)];
    }

    /// Keeps the rates of a half step that has been taken.
    pub fn keep(&mut self, half: usize, rates: &Rates) {
        self.fresh[half].w.copy(&rates.w);
        self.fresh[half].angles = rates.angles;
    }

    /// Puts those of a whole step where the next ones look.
    pub fn store(&self, k: u64, carried: &mut [Eight]) {
        let len = doubles(carried).len() / MEMORY;
        for (half, Rates { w, angles }) in self.fresh.iter().enumerate() {
            let at = (self.number(k, half) % MEMORY as u64) as usize;
            let slot = &mut doubles_mut(carried)[at * len..][..len];
            for (to, from) in slot.chunks_exact_mut(self.field).zip(w.parts()) {
                to.copy_from_slice(from);
            }
            slot[3 * self.field..3 * self.field + 2].copy_from_slice(angles);
        }
    }

    fn number(&self, k: u64, half: usize) -> u64 {
        k * self.halves as u64 + half as u64
    }

    fn slot<'a>(&self, number: u64, carried: &'a [Eight]) -> &'a [f64] {
        let len = doubles(carried).len() / MEMORY;
        &doubles(carried)[(number % MEMORY as u64) as usize * len..][..len]
    }
}
