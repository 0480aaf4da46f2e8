//! Coefficients of Gauss methods as packs, made once a process.

use std::sync::OnceLock;

use crate::linalg::kernel::{Eight, doubles_mut};
use crate::tableau::Collocation;

/// Columns of a table's matrices, a pack a block of eight stages each.
pub struct Columns {
    /// Blocks of stages.
    pub blocks: usize,
    /// Places of the stages, those of the first where there is no stage.
    pub places: Vec<Eight>,
    /// `a_ij / b_j`.
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
            (0..s).flat_map(|j| lanes(s, |i| matrix[s * i + j])).collect()
        };
        let forward = (0..s).map(|j| {
            let part = |of: &[f64]| lanes(pairs, |k| of[s * k + j])[0];
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
            mu: columns(table.mu),
            ahead: columns(table.ahead),
            values: [repeated(table.values_real), repeated(table.values_imaginary)],
            forward: forward.collect(),
            backward: backward.collect(),
        }
    }
}

/// Numbers in packs, zero where there is none.
pub fn lanes(len: usize, of: impl Fn(usize) -> f64) -> Vec<Eight> {
    let mut packs = vec![Eight::ZERO; len.div_ceil(8)];
    for (i, lane) in doubles_mut(&mut packs)[..len].iter_mut().enumerate() {
        *lane = of(i);
    }
    packs
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
