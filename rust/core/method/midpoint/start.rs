//! Where iterations start: rates of past half steps, extrapolated.

use crate::linalg::kernel::{Body, Eight, Lanes, Pack, dispatch, packs, packs_mut};

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

/// Rates of past half steps: in the carried state those of past steps, in slots by their numbers.
pub struct Starts {
    halves: usize,
    /// Whether fewer points are taken where they have been better: what does not resolve the stiffest
    /// modes magnifies them.
    judged: bool,
    /// Packs of the rates of a half step.
    len: usize,
    fresh: Vec<Eight>,
}

impl Starts {
    /// For rates of `len` packs.
    pub fn new(len: usize, halves: usize, judged: bool) -> Starts {
        Starts { halves, judged, len, fresh: vec![Eight::ZERO; len * halves] }
    }

    /// Packs of the carried state.
    pub fn carried_len(&self) -> usize {
        MEMORY * self.len
    }

    /// The rates to start half step `half` of step `k` from; left as they are at the first of all.
    pub fn guess(&self, k: u64, half: usize, carried: &[Eight], rates: &mut [Eight]) {
        let number = self.number(k, half);
        let count = number.min(MEMORY as u64) as usize;
        if count == 0 {
            return;
        }
        let first = self.number(k, 0);
        let past: [&[Eight]; MEMORY] = std::array::from_fn(|i| {
            let then = number - 1 - i.min(count - 1) as u64;
            match then.checked_sub(first) {
                Some(fresh) => &self.fresh[fresh as usize * self.len..][..self.len],
                None => &carried[(then % MEMORY as u64) as usize * self.len..][..self.len],
            }
        });
        let points = match self.judged && count == MEMORY {
            true => dispatch(Judge { past }),
            false => count,
        };
        dispatch(Extrapolate { past, ahead: AHEAD[points - 1], rates });
    }

    /// Where to keep the rates of a half step that has been taken.
    pub fn keep(&mut self, half: usize, rates: &[Eight]) {
        self.fresh[half * self.len..][..self.len].copy_from_slice(rates);
    }

    /// Puts those of a whole step where the next ones look.
    pub fn store(&self, k: u64, carried: &mut [Eight]) {
        for (half, rates) in self.fresh.chunks_exact(self.len).enumerate() {
            let slot = (self.number(k, half) % MEMORY as u64) as usize;
            carried[slot * self.len..][..self.len].copy_from_slice(rates);
        }
    }

    fn number(&self, k: u64, half: usize) -> u64 {
        k * self.halves as u64 + half as u64
    }
}

/// The number of points, 1, 2 or all, that would have come nearest to the last rates.
struct Judge<'a> {
    past: [&'a [Eight]; MEMORY],
}

impl Body for Judge<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<V: Lanes>(self) -> usize {
        let [x0, x1, x2, x3, x4] = self.past;
        let (x0, x1, x2) = (packs::<V>(x0), packs::<V>(x1), packs::<V>(x2));
        let (x3, x4) = (packs::<V>(x3), packs::<V>(x4));
        let [four, six] = [Pack::<V>::splat(4.0), Pack::splat(6.0)];
        let zero = Pack::<V>::splat(0.0);
        let mut off = [zero; 3];
        for i in 0..x0.len() {
            let one = x0[i] - x1[i];
            let line = one - (x1[i] - x2[i]);
            let cubic = x0[i] - ((four * x1[i] - six * x2[i]) + (four * x3[i] - x4[i]));
            off[0] = one.abs().max(off[0]);
            off[1] = line.abs().max(off[1]);
            off[2] = cubic.abs().max(off[2]);
        }
        let [one, line, cubic] = [off[0].largest(), off[1].largest(), off[2].largest()];
        if cubic <= line && cubic <= one {
            MEMORY
        } else if line <= one {
            2
        } else {
            1
        }
    }
}

struct Extrapolate<'a> {
    past: [&'a [Eight]; MEMORY],
    ahead: [f64; MEMORY],
    rates: &'a mut [Eight],
}

impl Body for Extrapolate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let [a, b, c, d, e] = self.ahead;
        let [a, b] = [Pack::<V>::splat(a), Pack::splat(b)];
        let [c, d, e] = [Pack::<V>::splat(c), Pack::splat(d), Pack::splat(e)];
        let out = packs_mut::<V>(self.rates);
        let [x0, x1, x2, x3, x4] = self.past;
        let (x0, x1, x2) = (packs::<V>(x0), packs::<V>(x1), packs::<V>(x2));
        let (x3, x4) = (packs::<V>(x3), packs::<V>(x4));
        for i in 0..out.len() {
            out[i] = (a * x0[i] + b * x1[i]) + ((c * x2[i] + d * x3[i]) + e * x4[i]);
        }
    }
}
