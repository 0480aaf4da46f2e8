//! Coefficients of Gauss methods as packs, made once a process.

use std::sync::OnceLock;

use crate::linalg::kernel::{Eight, Lanes, Pack, doubles_mut, packs};
use crate::tableau::Collocation;

/// Columns of a table's matrices, a pack a block of eight stages each. Stages are in their order; of 16
/// of them the second block mirrors the first, from the last one to the middle.
pub struct Columns {
    /// Blocks of stages.
    pub blocks: usize,
    /// Places of the stages, those of the first where there is no stage.
    pub places: Vec<Eight>,
    /// `a_ij / b_j`; of 16 stages as [`gather`] takes them.
    pub mu: Vec<Eight>,
    /// What extrapolates.
    pub ahead: Vec<Eight>,
    /// Eigenvalues, the first where there is none; real and imaginary parts.
    pub values: [Eight; 2],
    /// Columns of `V^-1`, a stage each; lanes are eigenvalues.
    pub forward: Vec<[Eight; 2]>,
    /// Columns of V, an eigenvalue each, twice those of a pair.
    pub backward: Vec<[Eight; 2]>,
}

/// The stages there are tables for.
const STAGES: [usize; 8] = [1, 2, 3, 4, 6, 8, 12, 16];

impl Columns {
    /// Of one of the tables.
    pub fn of(table: &Collocation) -> &'static Columns {
        static MADE: [OnceLock<Columns>; STAGES.len()] = [const { OnceLock::new() }; STAGES.len()];
        let at = STAGES.iter().position(|s| *s == table.b.len()).expect("a table of ours");
        MADE[at].get_or_init(|| Columns::new(table))
    }

    fn new(table: &Collocation) -> Columns {
        let (s, pairs) = (table.b.len(), table.values_real.len());
        let columns = |matrix: &[f64]| -> Vec<Eight> {
            (0..s).flat_map(|j| lanes(s, |i| matrix[s * i + stage(s, j)])).collect()
        };
        let forward = (0..s).map(|j| {
            let part = |of: &[f64]| eight(pairs, |k| of[s * k + stage(s, j)]);
            [part(table.forward_real), part(table.forward_imaginary)]
        });
        let backward = (0..pairs).flat_map(|k| {
            let part = |of: &[f64]| lanes(s, |i| of[s * k + i]);
            let (re, im) = (part(table.backward_real), part(table.backward_imaginary));
            re.into_iter().zip(im).map(|(re, im)| [re, im])
        });
        let repeated = |of: &[f64]| Eight(std::array::from_fn(|k| *of.get(k).unwrap_or(&of[0])));
        let mut places = lanes(s, |i| table.c[i]);
        doubles_mut(&mut places)[s..].fill(table.c[0]);
        Columns {
            blocks: s.div_ceil(8),
            places,
            mu: if s == 16 { folded(table.mu) } else { columns(table.mu) },
            ahead: columns(table.ahead),
            values: [repeated(table.values_real), repeated(table.values_imaginary)],
            forward: forward.collect(),
            backward: backward.collect(),
        }
    }
}

/// The stage of a lane.
fn stage(s: usize, lane: usize) -> usize {
    if s == 16 && lane >= 8 { 23 - lane } else { lane }
}

/// Numbers of s stages in packs, zero where there is none.
pub fn lanes(s: usize, of: impl Fn(usize) -> f64) -> Vec<Eight> {
    let mut packs = vec![Eight::ZERO; s.div_ceil(8)];
    for (i, lane) in doubles_mut(&mut packs)[..s].iter_mut().enumerate() {
        *lane = of(stage(s, i));
    }
    packs
}

/// Some numbers in a pack, zero beyond.
fn eight(len: usize, of: impl Fn(usize) -> f64) -> Eight {
    Eight(std::array::from_fn(|i| if i < len { of(i) } else { 0.0 }))
}

/// Columns of `Q`, then of `-Q'`: with `mu = 1/2 + [A B; -B -A]` of stages and their mirror images, A
/// antisymmetric and B symmetric, `Q = (A + B) / 2`.
fn folded(mu: &[f64]) -> Vec<Eight> {
    let q = |i: usize, j: usize| 0.5 * ((mu[16 * i + j] - 0.5) + (mu[16 * i + 15 - j] - 0.5));
    let across = (0..8).map(|j| eight(8, |i| q(i, j)));
    across.chain((0..8).map(|j| eight(8, |i| -q(j, i)))).collect()
}

/// `h b`: the middle one, or the two outer ones, make the sum h as it is rounded.
pub fn weights(table: &Collocation, h: f64) -> Vec<f64> {
    let s = table.b.len();
    let mut hb: Vec<f64> = table.b.iter().map(|b| h * b).collect();
    let excess = h - hb.iter().sum::<f64>();
    match s % 2 {
        1 => hb[s / 2] += excess,
        _ => {
            hb[0] += 0.5 * excess;
            hb[s - 1] += 0.5 * excess;
        }
    }
    hb
}

/// The columns of a matrix of S stages.
#[inline(always)]
pub fn matrix<const S: usize, const B: usize>(columns: &[Eight]) -> &[[Eight; B]; S] {
    columns.as_chunks().0.first_chunk().expect("a column a stage")
}

/// `sum of columns_j x_j`, of C matrices and as many x; even and odd terms apart, so that additions
/// overlap.
#[inline(always)]
pub fn product<V: Lanes, const S: usize, const B: usize, const C: usize>(
    columns: [&[[Eight; B]; S]; C],
    x: [[Pack<V>; B]; C],
) -> [[Pack<V>; B]; C] {
    let mut even = [[Pack::<V>::splat(0.0); B]; C];
    let mut odd = even;
    for at in 0..S / 2 {
        add_column(&mut even, columns, x, 2 * at);
        add_column(&mut odd, columns, x, 2 * at + 1);
    }
    if S % 2 == 1 {
        add_column(&mut even, columns, x, S - 1);
    }
    for (even, odd) in even.as_flattened_mut().iter_mut().zip(odd.as_flattened()) {
        *even = *even + *odd;
    }
    even
}

#[inline(always)]
fn add_column<V: Lanes, const S: usize, const B: usize, const C: usize>(
    sums: &mut [[Pack<V>; B]; C],
    columns: [&[[Eight; B]; S]; C],
    x: [[Pack<V>; B]; C],
    j: usize,
) {
    for c in 0..C {
        let x = x[c][j / 8].lane(j % 8);
        for (sum, column) in sums[c].iter_mut().zip(packs(&columns[c][j])) {
            *sum = column.mul_add(x, *sum);
        }
    }
}

/// `sum of mu_ij x_j`. Gauss points are symmetric: of 16 stages sums and differences of mirror images have
/// half as many products.
#[inline(always)]
pub fn gather<V: Lanes, const S: usize, const B: usize, const C: usize>(
    mu: &[Eight],
    x: [[Pack<V>; B]; C],
) -> [[Pack<V>; B]; C] {
    if S != 16 {
        return product([matrix::<S, B>(mu); C], x);
    }
    let (mut sums, mut differences) = ([[Pack::splat(0.0)]; C], [[Pack::splat(0.0)]; C]);
    for c in 0..C {
        let (one, mirrored) = (x[c][0], x[c][B - 1]);
        (sums[c], differences[c]) = ([one + mirrored], [one - mirrored]);
    }
    let across = product([matrix::<8, 1>(mu); C], sums);
    let along = product([matrix::<8, 1>(&mu[8..]); C], differences);
    let mut out = x;
    for c in 0..C {
        let along = Pack::splat(0.5 * sums[c][0].sum()) + along[c][0];
        (out[c][0], out[c][B - 1]) = (along + across[c][0], along - across[c][0]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::kernel::{Body, Level, dispatch, force};
    use crate::tableau::COLLOCATION32;

    struct Gathered<'a>(&'a Columns, [Eight; 2]);

    impl Body for Gathered<'_> {
        type Output = [[f64; 8]; 2];
        #[inline(always)]
        fn run<V: Lanes>(self) -> [[f64; 8]; 2] {
            let x = packs::<V>(&self.1).first_chunk().expect("two packs");
            let [sums] = gather::<V, 16, 2, 1>(&self.0.mu, [*x]);
            let mut out = [[0.0; 8]; 2];
            for (out, sum) in out.iter_mut().zip(sums) {
                sum.store(out);
            }
            out
        }
    }

    #[test]
    fn mirror_images_add_up_to_the_whole_matrix() {
        let columns = Columns::of(&COLLOCATION32);
        let x: [f64; 16] = std::array::from_fn(|i| (1.7 * i as f64 + 0.3).sin());
        let mut lanes = [Eight::ZERO; 2];
        for (i, x) in x.iter().enumerate() {
            doubles_mut(&mut lanes)[if i < 8 { i } else { 23 - i }] = *x;
        }
        let found = dispatch(Gathered(columns, lanes));
        for i in 0..16 {
            let row = &COLLOCATION32.mu[16 * i..][..16];
            let right: f64 = row.iter().zip(&x).map(|(mu, x)| mu * x).sum();
            let found = if i < 8 { found[0][i] } else { found[1][15 - i] };
            assert!((found - right).abs() <= 4e-15, "{i}: {found} {right}");
        }
        for level in Level::ALL {
            force(Some(level));
            assert_eq!(dispatch(Gathered(columns, lanes)), found, "{level:?}");
        }
        force(None);
    }
}
