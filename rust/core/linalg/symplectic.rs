//! Symplectic tools for matrices of even size, `z = [q; p]`, `J = [0 I; -I 0]`; the polish serves
//! orthogonal maps as well.

use super::dense::{self, Watch, exponent_above, power_of_two};
use super::kernel::{Depth, Eight, Layout, doubles, doubles_mut};
use super::pair::{Pair, PairEngine, PairMut, combine};
use crate::error::{Error, Result};

/// `X* = J^-1 X^T J`: the inverse of `X` where `X` is symplectic; `[D^T -B^T; -C^T A^T]` for
/// `X = [A B; C D]`.
pub fn adjoint(layout: Layout, x: &[Eight], out: &mut [Eight]) {
    let (m, ld) = (layout.rows, layout.doubles());
    let half = m / 2;
    let other = |i: usize| if i < half { i + half } else { i - half };
    let (x, out) = (doubles(x), doubles_mut(out));
    for j in 0..m {
        for i in 0..m {
            let value = x[other(i) * ld + other(j)];
            out[j * ld + i] = if (i < half) == (j < half) { value } else { -value };
        }
    }
}

/// Whether `A` is Hamiltonian, `J A` symmetric, as far as its own rounding can tell.
pub fn is_hamiltonian(layout: Layout, a: &[Eight]) -> bool {
    let (m, ld) = (layout.rows, layout.doubles());
    if m == 0 || !m.is_multiple_of(2) {
        return false;
    }
    let half = m / 2;
    let a = doubles(a);
    let at = |i: usize, j: usize| a[j * ld + i];
    // Pairs that must agree: A and -D^T; B and B^T; C and C^T. Each to rounding of its block.
    let mut worst = [0.0_f64; 3];
    let mut largest = [0.0_f64; 3];
    for i in 0..half {
        for j in 0..half {
            let pairs = [
                (at(i, j), -at(half + j, half + i)),
                (at(i, half + j), at(j, half + i)),
                (at(half + i, j), at(half + j, i)),
            ];
            for (block, (x, y)) in pairs.into_iter().enumerate() {
                worst[block] = worst[block].max((x - y).abs());
                largest[block] = largest[block].max(x.abs()).max(y.abs());
            }
        }
    }
    (0..3).all(|block| worst[block] <= 1e-13 * largest[block])
}

/// Whether `A` is skew-symmetric, to the bit: lengths are then kept.
pub fn is_skew(layout: Layout, a: &[Eight]) -> bool {
    let (m, ld) = (layout.rows, layout.doubles());
    let a = doubles(a);
    (0..m).all(|j| (0..=j).all(|i| a[j * ld + i] == -a[i * ld + j]))
}

/// Exponents of a symplectic scaling `2^d`, `d[i + n] = -d[i]`, that brings rows and columns of `T`
/// near each other.
fn balance(layout: Layout, t: &[Eight]) -> Vec<i32> {
    let (m, ld) = (layout.rows, layout.doubles());
    let half = m / 2;
    let t = doubles(t);
    let mut d = vec![0; m];
    for _ in 0..4 {
        for i in 0..half {
            let k = i + half;
            // Magnitudes that grow and that shrink with the scale of coordinate i.
            let (mut grow, mut shrink) = (0.0_f64, 0.0_f64);
            for j in (0..m).filter(|&j| j != i && j != k) {
                let scaled = |row: usize, column: usize| {
                    t[column * ld + row].abs() * power_of_two((d[column] - d[row]).clamp(-900, 900))
                };
                grow = grow.max(scaled(j, i)).max(scaled(k, j));
                shrink = shrink.max(scaled(i, j)).max(scaled(j, k));
            }
            let cross = |row: usize, column: usize| {
                t[column * ld + row].abs() * power_of_two((d[column] - d[row]).clamp(-900, 900))
            };
            let (grow, shrink) = (grow.max(cross(k, i).sqrt()), shrink.max(cross(i, k).sqrt()));
            if grow >= f64::MIN_POSITIVE && shrink >= f64::MIN_POSITIVE {
                let change = (exponent_above(shrink) - exponent_above(grow)) / 2;
                d[i] = (d[i] + change).clamp(-400, 400);
                d[k] = -d[i];
            }
        }
    }
    d
}

/// What a polish has come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polish {
    /// The defect was within rounding.
    NotNeeded,
    /// The defect has been taken out.
    Done,
    /// The map is not near a symplectic one; it is as it was.
    TooFar,
}

/// Defects from which a map is not taken for a symplectic one with errors: exponentials that grow
/// are symplectic to a relative error only, low orders hardly at all.
const FAR: f64 = 1e-3;

/// Most rounds; each squares the defect.
const ROUNDS: usize = 4;

/// Defects whose squares are below rounding: no further round is needed.
const SETTLED: f64 = 1e-9;

/// What a map keeps; its inverse is its adjoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// `J`; the adjoint is `J^-1 X^T J`.
    Symplectic,
    /// Lengths; the adjoint is the transpose.
    Orthogonal,
}

/// Newton's method towards a group, `T <- T - (E + T E) / 2`, `E = T* + T + T* T`, until the
/// defect `E` is within rounding.
pub fn polish(layout: Layout, group: Group, t: &mut [Eight], watch: &mut Watch) -> Result<Polish> {
    let packs = layout.packs(layout.rows);
    let mut memory = dense::zeros(5 * packs)?;
    let [scaled, adjoint_t, sum, defect, bound] = dense::pieces(&mut memory, packs);
    scaled.copy_from_slice(t);
    // A scaling would not leave lengths as they are.
    let d = match group {
        Group::Symplectic => balance(layout, scaled),
        Group::Orthogonal => vec![0; layout.rows],
    };
    rescale(layout, &d, scaled, 1);
    let mut done = Polish::NotNeeded;
    for _ in 0..ROUNDS {
        match group {
            Group::Symplectic => adjoint(layout, scaled, adjoint_t),
            Group::Orthogonal => {
                adjoint_t.copy_from_slice(scaled);
                dense::transpose(layout, adjoint_t);
            }
        }
        dense::sums([&*adjoint_t, &*scaled], [[1.0, 1.0]], [&mut *sum]);
        dense::multiply(layout, adjoint_t, scaled, Some((1.0, sum)), defect, watch)?;
        // |T*| |T|, entry by entry, bounds what rounding alone can make of E.
        let magnitudes = |x: &mut [Eight]| doubles_mut(x).iter_mut().for_each(|x| *x = x.abs());
        magnitudes(adjoint_t);
        sum.copy_from_slice(scaled);
        magnitudes(sum);
        dense::multiply(layout, adjoint_t, sum, None, bound, watch)?;
        let (found, rounding) = (largest(defect), f64::EPSILON * largest(bound));
        if found <= rounding {
            break;
        }
        if found.is_nan() || found >= FAR {
            return Ok(Polish::TooFar);
        }
        dense::multiply(layout, scaled, defect, Some((1.0, defect)), bound, watch)?;
        dense::sums([&*scaled, &*bound], [[1.0, -0.5]], [&mut *sum]);
        scaled.copy_from_slice(sum);
        done = Polish::Done;
        if found <= SETTLED {
            break;
        }
    }
    if done == Polish::Done {
        rescale(layout, &d, scaled, -1);
        t.copy_from_slice(scaled);
    }
    Ok(done)
}

/// The largest entry of `T* + T + T* T`, evaluated in pairs: how far `I + T` is from symplectic.
pub fn defect(layout: Layout, t: Pair, watch: &mut Watch) -> Result<f64> {
    let packs = layout.packs(layout.rows);
    let mut memory = dense::zeros((6 + PairEngine::pieces(Depth::Three)) * packs)?;
    let (matrices, slices) = memory.split_at_mut(6 * packs);
    let [star_hi, star_lo, sum_hi, sum_lo, hi, lo] = dense::pieces(matrices, packs);
    adjoint(layout, t.hi, star_hi);
    adjoint(layout, t.lo, star_lo);
    let star = Pair { hi: star_hi, lo: star_lo };
    let one = [1.0, 0.0];
    combine([star, t], [[one, one]], [PairMut { hi: &mut *sum_hi, lo: &mut *sum_lo }]);
    let sum = Pair { hi: sum_hi, lo: sum_lo };
    let mut engine = PairEngine::new(layout, Depth::Three, slices);
    engine.multiply(star, t, Some((1.0, sum)), &mut PairMut { hi: &mut *hi, lo }, watch)?;
    let defect = largest(hi);
    if defect.is_finite() {
        Ok(defect)
    } else {
        Err(Error::overflow("symplectic_defect: exceeds 1.8e308: the motion grows too much"))
    }
}

/// The largest magnitude; not a number where an entry is not.
pub fn largest(x: &[Eight]) -> f64 {
    doubles(x).iter().fold(0.0, |largest, x| if x.abs() <= largest { largest } else { x.abs() })
}

fn rescale(layout: Layout, d: &[i32], x: &mut [Eight], sign: i32) {
    let x = doubles_mut(x);
    for (j, dj) in d.iter().enumerate() {
        for (x, di) in x[j * layout.doubles()..][..layout.rows].iter_mut().zip(d) {
            *x *= power_of_two(sign * (dj - di));
        }
    }
}
