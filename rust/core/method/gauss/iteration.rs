//! What is done with all stages at once, in packs.

use super::columns::{gather, matrix, product};
use super::linear_part::{Group, Oscillator, numbers, times};
use super::stages::Gauss;
use crate::linalg::kernel::{Body, Eight, Lanes, Pack, packs, packs_mut};

/// What is left of an oscillator's first equation, in parts of the state, below which its second one
/// need not know it.
const SLIGHT: f64 = 1e-12;

/// One iteration, with S stages in B blocks; the largest change.
pub struct Correct<'a, const S: usize, const B: usize>(pub &'a mut Gauss);

impl<const S: usize, const B: usize> Body for Correct<'_, S, B> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Lanes>(self) -> f64 {
        let Gauss {
            part, turned, columns, weights, z, e, counts, rates, stages, increments, ..
        } = self.0;
        let m = z.len();
        let (forward, backward) = (&columns.forward, &columns.backward);
        let mut all = All::<V, S, B> {
            mu: &columns.mu,
            weights: packs(weights).first_chunk().expect("a pack a block"),
            z,
            e: &e[..m],
            counts: &counts[..m],
            rates: split(packs(rates), m),
            stages: split_mut(packs_mut(stages), m),
            increments: &mut increments.as_chunks_mut().0[..m],
            largest: Pack::splat(0.0),
            total: Pack::splat(0.0),
        };
        // Two at a time: each waits for itself.
        let (twos, one) = part.free.as_chunks::<2>();
        for two in twos {
            all.follow(*two);
        }
        for one in one {
            all.follow([*one]);
        }
        for group in &part.groups {
            all.divide(group, forward, backward, turned);
        }
        let (twos, one) = part.oscillators.as_chunks::<2>();
        for two in twos {
            all.swing(two);
        }
        for one in one.as_chunks::<1>().0 {
            all.swing(one);
        }
        // What is no number is lost in a maximum, never in a sum.
        if all.total.sum().is_finite() { all.largest.largest() } else { f64::NAN }
    }
}

/// What an iteration works on; components have a pack a block.
struct All<'a, V, const S: usize, const B: usize> {
    mu: &'a [Eight],
    weights: &'a [Pack<V>; B],
    z: &'a [f64],
    e: &'a [f64],
    counts: &'a [f64],
    rates: [&'a [Pack<V>]; B],
    stages: [&'a mut [Pack<V>]; B],
    increments: &'a mut [[Eight; B]],
    /// The largest change, and the sum of all.
    largest: Pack<V>,
    total: Pack<V>,
}

impl<V: Lanes, const S: usize, const B: usize> All<'_, V, S, B> {
    /// Components without a linear part: their increments are what the rates say.
    #[inline(always)]
    fn follow<const C: usize>(&mut self, components: [usize; C]) {
        let mut new = [[Pack::splat(0.0); B]; C];
        for (new, d) in new.iter_mut().zip(components) {
            *new = blocks(|b| self.weights[b] * self.rates[b][d]);
            self.set(d, *new);
        }
        self.put(components, new);
    }

    /// A group: what is left of its equations, divided in eigenvectors.
    #[inline(always)]
    fn divide(
        &mut self,
        group: &Group,
        forward: &[[Eight; 2]],
        backward: &[[Eight; 2]],
        turned: &mut [[Eight; 2]],
    ) {
        let r = group.members.len();
        for (&d, turned) in group.members.iter().zip(&mut *turned) {
            let left = self.left(d);
            let mut sums = [Pack::<V>::splat(0.0); 2];
            for (j, column) in forward[..S].iter().enumerate() {
                let ([re, im], x) = (numbers::<V>(column), left[j / 8].lane(j % 8));
                sums = [sums[0] + re * x, sums[1] + im * x];
            }
            packs_mut::<V>(turned).copy_from_slice(&sums);
        }
        for (i, &d) in group.members.iter().enumerate() {
            let mut sum = [Pack::<V>::splat(0.0); 2];
            let row = group.inverse[r * i..][..r].iter().zip(&group.zero[r * i..][..r]);
            for ((entry, zero), turned) in row.zip(&*turned) {
                if !zero {
                    let [x, y] = times(numbers::<V>(entry), numbers::<V>(turned));
                    sum = [sum[0] + x, sum[1] + y];
                }
            }
            let mut steps = [[Pack::<V>::splat(0.0); B]; 2];
            for (k, column) in backward.as_chunks::<B>().0.iter().enumerate() {
                let (x, y) = (sum[0].lane(k), sum[1].lane(k));
                for b in 0..B {
                    let [re, im] = numbers::<V>(&column[b]);
                    steps[0][b] = steps[0][b] + re * x;
                    steps[1][b] = steps[1][b] + im * y;
                }
            }
            let new = self.add(d, blocks(|b| steps[0][b] - steps[1][b]));
            self.put([d], [new]);
        }
    }

    /// Oscillators: their momenta with the displacements eliminated, and these as far as the momenta
    /// have moved.
    #[inline(always)]
    fn swing<const C: usize>(&mut self, pairs: &[Oscillator; C]) {
        // Checked at once: compilers put sums off until after later checks.
        let (xs, ps) = (pairs.each_ref().map(|pair| pair.x), pairs.each_ref().map(|pair| pair.p));
        assert!(xs.iter().chain(&ps).all(|d| *d < self.z.len()), "components of the system");
        let mut left = [[Pack::splat(0.0); B]; C];
        for (left, p) in left.iter_mut().zip(ps) {
            *left = self.left(p);
        }
        let inverses = pairs.each_ref().map(|pair| matrix::<S, B>(&pair.inverse));
        let mut steps = product(inverses, left);
        for (pair, steps) in pairs.iter().zip(&mut steps) {
            let of_x = self.left(pair.x);
            let size = of_x.iter().fold(Pack::<V>::splat(0.0), |size, x| size.max(x.abs()));
            if (size * self.counts[pair.x]).largest() > SLIGHT {
                let [more] = product([matrix::<S, B>(&pair.from_x)], [of_x]);
                for b in 0..B {
                    steps[b] = steps[b] + more[b];
                }
            }
        }
        for (steps, p) in steps.iter_mut().zip(ps) {
            *steps = self.add(p, *steps);
        }
        let mut moved = self.put(ps, steps);
        for (pair, moved) in pairs.iter().zip(&mut moved) {
            let rates: [_; B] = blocks(|b| self.rates[b][pair.x] + pair.to_x * moved[b]);
            *moved = blocks(|b| self.weights[b] * rates[b]);
            self.set(pair.x, *moved);
        }
        self.put(xs, moved);
    }

    /// What is left of the equations of a component.
    #[inline(always)]
    fn left(&self, d: usize) -> [Pack<V>; B] {
        let increments = packs(&self.increments[d]);
        blocks(|b| self.weights[b] * self.rates[b][d] - increments[b])
    }

    /// Adds to the increments of a component; what they are then.
    #[inline(always)]
    fn add(&mut self, d: usize, steps: [Pack<V>; B]) -> [Pack<V>; B] {
        let increments = packs_mut::<V>(&mut self.increments[d]);
        let new = blocks(|b| increments[b] + steps[b]);
        increments.copy_from_slice(&new);
        self.note(d, steps);
        new
    }

    /// Sets the increments of a component.
    #[inline(always)]
    fn set(&mut self, d: usize, new: [Pack<V>; B]) {
        let increments = packs_mut::<V>(&mut self.increments[d]);
        let steps = blocks(|b| new[b] - increments[b]);
        increments.copy_from_slice(&new);
        self.note(d, steps);
    }

    #[inline(always)]
    fn note(&mut self, d: usize, steps: [Pack<V>; B]) {
        for step in steps {
            self.largest = self.largest.max(step.abs() * self.counts[d]);
            self.total = self.total + step;
        }
    }

    /// Stages of components with these increments; by how much they moved.
    #[inline(always)]
    fn put<const C: usize>(
        &mut self,
        components: [usize; C],
        increments: [[Pack<V>; B]; C],
    ) -> [[Pack<V>; B]; C] {
        let mut sums = gather::<V, S, B, C>(self.mu, increments);
        for (d, sums) in components.into_iter().zip(&mut sums) {
            let (z, e) = (Pack::splat(self.z[d]), Pack::splat(self.e[d]));
            for b in 0..B {
                let stage = &mut self.stages[b][d];
                let new = z + (e + sums[b]);
                sums[b] = new - *stage;
                *stage = new;
            }
        }
        sums
    }
}

/// A pack a block.
#[inline(always)]
fn blocks<V: Lanes, const B: usize>(of: impl Fn(usize) -> Pack<V>) -> [Pack<V>; B] {
    let mut packs = [Pack::splat(0.0); B];
    for (b, pack) in packs.iter_mut().enumerate() {
        *pack = of(b);
    }
    packs
}

/// Block by block.
#[inline(always)]
fn split<T, const B: usize>(all: &[T], m: usize) -> [&[T]; B] {
    std::array::from_fn(|b| &all[m * b..][..m])
}

#[inline(always)]
fn split_mut<T, const B: usize>(all: &mut [T], m: usize) -> [&mut [T]; B] {
    let mut blocks = all.chunks_exact_mut(m);
    std::array::from_fn(|_| blocks.next().expect("m components a block"))
}

/// Rates of the last step, extrapolated, but for what the linear part adds to those at the state.
pub struct Ahead<'a, const S: usize, const B: usize>(pub &'a mut Gauss, pub &'a [Eight]);

impl<const S: usize, const B: usize> Body for Ahead<'_, S, B> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Ahead(gauss, history) = self;
        let m = gauss.z.len();
        let ahead = matrix::<S, B>(&gauss.columns.ahead);
        let rates = split_mut::<_, B>(packs_mut::<V>(&mut gauss.rates), m);
        for (d, history) in packs(history).as_chunks().0[..m].iter().enumerate() {
            let [sums] = product([ahead], [*history]);
            for b in 0..B {
                rates[b][d] = sums[b];
            }
        }
        let mut stages = split_mut::<_, B>(packs_mut::<V>(&mut gauss.stages), m);
        for pair in &gauss.part.oscillators {
            for stages in &mut stages {
                stages[pair.p] = Pack::splat(gauss.z[pair.p]);
            }
        }
    }
}

/// Rates at the stages without what the linear part makes of their distance from the end of the step.
pub struct Remainder<'a>(pub &'a Gauss, pub &'a mut [Eight]);

impl Body for Remainder<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Remainder(gauss, history) = self;
        let (m, B) = (gauss.z.len(), gauss.blocks);
        for b in 0..B {
            let stages = &packs::<V>(&gauss.stages)[m * b..][..m];
            let reciprocals = packs::<V>(&gauss.reciprocals)[b];
            for d in 0..m {
                let mut rest = packs::<V>(&gauss.increments)[B * d + b] * reciprocals;
                for (j, a) in &gauss.part.rows[d] {
                    rest = rest - *a * (stages[*j] - gauss.next[*j]);
                }
                packs_mut::<V>(history)[B * d + b] = rest;
            }
        }
    }
}
