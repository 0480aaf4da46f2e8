//! What is done with all stages at once, in packs.

use super::linear_part::{Group, Oscillator, numbers, times};
use super::stages::Gauss;
use crate::linalg::kernel::{Body, Eight, Lanes, Pack, doubles, packs, packs_mut};

/// What is left of an oscillator's first equation, in parts of the state, below which its second one
/// need not know it.
const SLIGHT: f64 = 1e-12;

/// One iteration, with S stages in B blocks; the largest change.
pub struct Correct<'a, const S: usize, const B: usize>(pub &'a mut Gauss);

impl<const S: usize, const B: usize> Body for Correct<'_, S, B> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Lanes>(self) -> f64 {
        let gauss = self.0;
        let part = std::mem::take(&mut gauss.part);
        let mut change = Change([Pack::<V>::splat(0.0); 2]);
        for &d in &part.free {
            follow::<V, B>(gauss, d, &mut change);
        }
        for group in &part.groups {
            divide::<V, S, B>(gauss, group, &mut change);
        }
        for pair in &part.oscillators {
            turn::<V, S, B>(gauss, pair, &mut change);
        }
        stages::<V, S, B, true>(gauss, &part.momenta);
        for pair in &part.oscillators {
            swing::<V, B>(gauss, pair, &mut change);
        }
        stages::<V, S, B, false>(gauss, &part.last);
        gauss.part = part;
        // What is no number is lost in a maximum, never in a sum.
        let [largest, sum] = change.0;
        if sum.sum().is_finite() { largest.largest() } else { f64::NAN }
    }
}

/// How far an iteration went: the largest step, and a sum.
struct Change<V>([Pack<V>; 2]);

impl<V: Lanes> Change<V> {
    #[inline(always)]
    fn note(&mut self, step: Pack<V>, count: f64) {
        self.0 = [self.0[0].max(step.abs() * count), self.0[1] + step];
    }
}

/// Stages of components and, where it is wanted, by how much they moved.
#[inline(always)]
fn stages<V: Lanes, const S: usize, const B: usize, const MOVED: bool>(
    gauss: &mut Gauss,
    components: &[usize],
) {
    let m = gauss.z.len();
    // Two by two, so that columns are loaded once for both.
    let (twos, one) = components.as_chunks::<2>();
    for two in twos {
        let sums =
            sums::<V, S, B, 2>(&gauss.columns.mu, &gauss.increments, m, *two, &mut gauss.spare);
        for (d, sums) in two.iter().zip(sums) {
            put::<V, B, MOVED>(gauss, *d, sums);
        }
    }
    for &d in one {
        let [sums] =
            sums::<V, S, B, 1>(&gauss.columns.mu, &gauss.increments, m, [d], &mut gauss.spare);
        put::<V, B, MOVED>(gauss, d, sums);
    }
}

/// Increments of a component without a linear part: what the rates say.
#[inline(always)]
fn follow<V: Lanes, const B: usize>(gauss: &mut Gauss, d: usize, change: &mut Change<V>) {
    let (m, hb) = (gauss.z.len(), blocks::<V, B>(&gauss.weights));
    for b in 0..B {
        let L = &mut packs_mut::<V>(&mut gauss.increments)[m * b + d];
        let new = hb[b] * packs::<V>(&gauss.rates)[m * b + d];
        change.note(new - *L, gauss.counts[d]);
        *L = new;
    }
}

/// What is left of the equations of a component.
#[inline(always)]
fn left<V: Lanes, const B: usize>(gauss: &Gauss, d: usize) -> [Pack<V>; B] {
    let (m, hb) = (gauss.z.len(), blocks::<V, B>(&gauss.weights));
    let (rates, increments) = (packs::<V>(&gauss.rates), packs::<V>(&gauss.increments));
    std::array::from_fn(|b| hb[b] * rates[m * b + d] - increments[m * b + d])
}

/// Adds to the increments of a component.
#[inline(always)]
fn add<V: Lanes, const B: usize>(
    gauss: &mut Gauss,
    d: usize,
    steps: [Pack<V>; B],
    change: &mut Change<V>,
) {
    let m = gauss.z.len();
    for (b, step) in steps.into_iter().enumerate() {
        let L = &mut packs_mut::<V>(&mut gauss.increments)[m * b + d];
        *L = *L + step;
        change.note(step, gauss.counts[d]);
    }
}

/// Increments of a group: what is left, divided in eigenvectors.
#[inline(always)]
fn divide<V: Lanes, const S: usize, const B: usize>(
    gauss: &mut Gauss,
    group: &Group,
    change: &mut Change<V>,
) {
    let r = group.members.len();
    for (at, &d) in group.members.iter().enumerate() {
        let left = left::<V, B>(gauss, d);
        packs_mut::<V>(&mut gauss.left).copy_from_slice(&left);
        let left = doubles(&gauss.left);
        let mut sums = [Pack::<V>::splat(0.0); 2];
        for (column, x) in gauss.columns.forward.iter().zip(&left[..S]) {
            let [re, im] = numbers::<V>(column);
            sums = [sums[0] + re * *x, sums[1] + im * *x];
        }
        packs_mut::<V>(&mut gauss.turned[at]).copy_from_slice(&sums);
    }
    for (i, &d) in group.members.iter().enumerate() {
        let mut sum = [Pack::<V>::splat(0.0); 2];
        let row = group.inverse[r * i..][..r].iter().zip(&group.zero[r * i..][..r]);
        for ((entry, zero), turned) in row.zip(&gauss.turned) {
            if !zero {
                let [x, y] = times(numbers::<V>(entry), numbers::<V>(turned));
                sum = [sum[0] + x, sum[1] + y];
            }
        }
        let mut lanes = [Eight::ZERO; 2];
        packs_mut::<V>(&mut lanes).copy_from_slice(&sum);
        let mut steps = [[Pack::<V>::splat(0.0); B]; 2];
        for (k, column) in gauss.columns.backward.chunks_exact(B).enumerate() {
            let (x, y) = (lanes[0].0[k], lanes[1].0[k]);
            for b in 0..B {
                let [re, im] = numbers::<V>(&column[b]);
                steps[0][b] = steps[0][b] + re * x;
                steps[1][b] = steps[1][b] + im * y;
            }
        }
        add(gauss, d, std::array::from_fn::<_, B, _>(|b| steps[0][b] - steps[1][b]), change);
    }
}

/// Increments of an oscillator's momentum, its displacement eliminated.
#[inline(always)]
fn turn<V: Lanes, const S: usize, const B: usize>(
    gauss: &mut Gauss,
    pair: &Oscillator,
    change: &mut Change<V>,
) {
    let hb = blocks::<V, B>(&gauss.weights);
    let (of_x, mut of_p) = (left::<V, B>(gauss, pair.x), left::<V, B>(gauss, pair.p));
    let size = of_x.iter().fold(Pack::<V>::splat(0.0), |size, x| size.max(x.abs()));
    if (size * gauss.counts[pair.x]).largest() > SLIGHT {
        packs_mut::<V>(&mut gauss.left).copy_from_slice(&of_x);
        let [moved] = sums::<V, S, B, 1>(&gauss.columns.mu, &gauss.left, 1, [0], &mut gauss.spare);
        for b in 0..B {
            of_p[b] = of_p[b] + pair.to_p * (hb[b] * moved[b]);
        }
    }
    packs_mut::<V>(&mut gauss.left).copy_from_slice(&of_p);
    let [steps] = sums::<V, S, B, 1>(&pair.inverse, &gauss.left, 1, [0], &mut gauss.spare);
    add(gauss, pair.p, steps, change);
}

/// Increments of an oscillator's displacement, as far as its momentum has moved.
#[inline(always)]
fn swing<V: Lanes, const B: usize>(gauss: &mut Gauss, pair: &Oscillator, change: &mut Change<V>) {
    let (m, hb) = (gauss.z.len(), blocks::<V, B>(&gauss.weights));
    for b in 0..B {
        let moved = packs::<V>(&gauss.moved)[m * b + pair.p];
        let L = &mut packs_mut::<V>(&mut gauss.increments)[m * b + pair.x];
        let new = hb[b] * (packs::<V>(&gauss.rates)[m * b + pair.x] + pair.to_x * moved);
        change.note(new - *L, gauss.counts[pair.x]);
        *L = new;
    }
}

/// Stages of a component.
#[inline(always)]
fn put<V: Lanes, const B: usize, const MOVED: bool>(
    gauss: &mut Gauss,
    d: usize,
    sums: [Pack<V>; B],
) {
    let m = gauss.z.len();
    let (z, e) = (Pack::splat(gauss.z[d]), Pack::splat(gauss.e[d]));
    for (b, sum) in sums.into_iter().enumerate() {
        let Z = &mut packs_mut::<V>(&mut gauss.stages)[m * b + d];
        let new = z + (e + sum);
        if MOVED {
            packs_mut::<V>(&mut gauss.moved)[m * b + d] = new - *Z;
        }
        *Z = new;
    }
}

/// The packs of as many blocks.
#[inline(always)]
fn blocks<V: Lanes, const B: usize>(memory: &[Eight]) -> [Pack<V>; B] {
    *packs::<V>(memory).first_chunk().expect("a pack a block")
}

/// `sum of columns_j x_j` for C of m components; even and odd terms apart, so that additions overlap.
///
/// They go through memory: compilers else put each off to where it is wanted, one chain after another.
#[inline(always)]
pub fn sums<V: Lanes, const S: usize, const B: usize, const C: usize>(
    columns: &[Eight],
    x: &[Eight],
    m: usize,
    components: [usize; C],
    spare: &mut [Eight; 4],
) -> [[Pack<V>; B]; C] {
    let mut even = [[Pack::<V>::splat(0.0); B]; C];
    let mut odd = even;
    let columns = columns.as_chunks::<B>().0.first_chunk::<S>().expect("a column a stage");
    for block in 0..B {
        let x = components.map(|d| &x[m * block + d].0);
        let (first, count) = (8 * block, (S - 8 * block).min(8));
        for at in 0..count / 2 {
            let (i, j) = (2 * at, 2 * at + 1);
            add_column::<V, B, C>(&mut even, &columns[first + i], x.map(|x| x[i]));
            add_column::<V, B, C>(&mut odd, &columns[first + j], x.map(|x| x[j]));
        }
        if count % 2 == 1 {
            add_column::<V, B, C>(&mut even, &columns[S - 1], x.map(|x| x[count - 1]));
        }
    }
    let spare = packs_mut::<V>(spare);
    for c in 0..C {
        for b in 0..B {
            spare[B * c + b] = even[c][b] + odd[c][b];
        }
    }
    std::array::from_fn(|c| std::array::from_fn(|b| spare[B * c + b]))
}

#[inline(always)]
fn add_column<V: Lanes, const B: usize, const C: usize>(
    sums: &mut [[Pack<V>; B]; C],
    column: &[Eight; B],
    x: [f64; C],
) {
    let column: [Pack<V>; B] = blocks(column);
    for (sum, x) in sums.iter_mut().zip(x.map(Pack::splat)) {
        for (sum, column) in sum.iter_mut().zip(column) {
            *sum = column.mul_add(x, *sum);
        }
    }
}

/// Rates of the last step, extrapolated, but for what the linear part adds to those at the state.
pub struct Ahead<'a, const S: usize, const B: usize>(pub &'a mut Gauss, pub &'a [Eight]);

impl<const S: usize, const B: usize> Body for Ahead<'_, S, B> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Ahead(gauss, history) = self;
        let m = gauss.z.len();
        for d in 0..m {
            let [sums] =
                sums::<V, S, B, 1>(&gauss.columns.ahead, history, m, [d], &mut gauss.spare);
            for (b, sum) in sums.into_iter().enumerate() {
                packs_mut::<V>(&mut gauss.rates)[m * b + d] = sum;
            }
        }
        for pair in &gauss.part.oscillators {
            for b in 0..B {
                packs_mut::<V>(&mut gauss.stages)[m * b + pair.p] = Pack::splat(gauss.z[pair.p]);
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
        let m = gauss.z.len();
        for b in 0..gauss.blocks {
            let stages = &packs::<V>(&gauss.stages)[m * b..][..m];
            let reciprocals = packs::<V>(&gauss.reciprocals)[b];
            for d in 0..m {
                let mut rest = packs::<V>(&gauss.increments)[m * b + d] * reciprocals;
                for (j, a) in &gauss.part.rows[d] {
                    rest = rest - *a * (stages[*j] - gauss.next[*j]);
                }
                packs_mut::<V>(history)[m * b + d] = rest;
            }
        }
    }
}
