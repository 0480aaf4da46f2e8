//! Separable systems, `A = [0 P; R 0]` with symmetric blocks, at half the size: an eighth of the
//! work of each product.
//!
//! With `Y = P R`, `exp(A) = [I + c, S P; R S, (I + c)^T]`, `c = sum of Y^k/(2k)!` over `k > 0` (the
//! increment of the cosine) and `S = sum of Y^k/(2k+1)!`, doubled as
//! `S(4 Y) = S + S c`, `c(4 Y) = 4 c + 2 c^2`. The increment is a must: plain cosines lose two bits
//! a doubling.

use std::sync::LazyLock;

use super::arithmetic::{Arithmetic, Doubles, Pairs, Slot};
use super::doubling::{Form, overflow};
use super::sid::halvings;
use super::{Exponential, depth_for};
use crate::error::Result;
use crate::linalg::dense::{self, Watch, exponent_above, power_of_two};
use crate::linalg::kernel::{Depth, Eight, Layout, doubles, doubles_mut};
use crate::linalg::twofold;

const P: Slot = 0;
const R: Slot = 1;
const Y: Slot = 2;
const Y2: Slot = 3;
const Y3: Slot = 4;
const Y4: Slot = 5;
const C: Slot = 6;
const S: Slot = 7;
const SPARE: Slot = 8;
const SUM: Slot = 9;
const SLOTS: usize = 10;

/// Blocks of four terms of a series.
const BLOCKS: usize = 4;

/// `|Y|` up to which 16 terms leave `2^-78` of the first: enough for doubles and short pairs.
const LIMIT: f64 = 8.0;

/// The same for `2^-106`.
const LIMIT_LONG: f64 = 2.4;

/// Whether the diagonal blocks of a square matrix are zero and the others symmetric, to the bit.
pub fn is_separable(rows: usize, a: &[f64]) -> bool {
    let n = rows / 2;
    let at = |i: usize, j: usize| a[j * rows + i];
    rows.is_multiple_of(2)
        && (0..n).all(|j| {
            (0..n).all(|i| at(i, j) == 0.0 && at(n + i, n + j) == 0.0)
                && (0..j).all(|i| at(i, n + j) == at(j, n + i) && at(n + i, j) == at(n + j, i))
        })
}

/// `exp(tau A)` of the exact product, in doubles or in pairs as [`exponential`](super::exponential).
pub fn exponential(
    rows: usize,
    a: &[f64],
    tau: f64,
    wanted: Wanted,
    watch: &mut Watch,
) -> Result<Exponential> {
    let n = rows / 2;
    let layout = Layout::new(n);
    let packs = layout.packs(n);
    let at = |i: usize, j: usize| a[j * rows + i];
    let units = units(n, |i| [at(i, n + i), at(n + i, i)].map(|x| x * tau));
    // The blocks, balanced, times tau: exactly.
    let mut blocks = [dense::zeros(packs)?, dense::zeros(packs)?];
    let mut rests = [dense::zeros(packs)?, dense::zeros(packs)?];
    for (upper, (block, rest)) in [true, false].into_iter().zip(blocks.iter_mut().zip(&mut rests)) {
        let (first, scale) = if upper { (n * rows, &units.down) } else { (n, &units.up) };
        for j in 0..n {
            let column = &a[first + j * rows..][..n];
            let block = &mut doubles_mut(block)[j * layout.doubles()..][..n];
            let rest = &mut doubles_mut(rest)[j * layout.doubles()..][..n];
            for (((x, unit), block), rest) in column.iter().zip(scale).zip(block).zip(rest) {
                let [hi, lo] = twofold::two_product(tau, *x);
                [*block, *rest] = [hi * unit * scale[j], lo * unit * scale[j]];
            }
        }
    }
    let norm = blocks.iter().map(|x| dense::norms(layout, x)[0]).fold(0.0, f64::max);
    let depth = match wanted {
        Wanted::Rounded => Some(depth_for(norm)),
        Wanted::Pairs => Some(Depth::Three),
        Wanted::Doubles => None,
    };
    let whole = Layout::new(rows);
    let mut out = Exponential {
        layout: whole,
        form: Form::Increment,
        hi: dense::zeros(whole.packs(rows))?,
        lo: dense::zeros(whole.packs(rows))?,
        doublings: 0,
        norm,
        by_halves: true,
    };
    match depth {
        Some(depth) => {
            let matrices = Pairs::matrices(SLOTS, depth);
            let mut memory = dense::work_space(packs * matrices, watch)?;
            let mut x = Pairs::new(layout, SLOTS, depth, &mut memory, watch);
            for (slot, (block, rest)) in blocks.iter().zip(&rests).enumerate() {
                x.matrix(slot).hi.copy_from_slice(block);
                x.matrix(slot).lo.copy_from_slice(rest);
            }
            let limit = if depth == Depth::Two { LIMIT } else { LIMIT_LONG };
            out.doublings = cosine_and_sine(&mut x, limit)?;
            for (slot, place) in PLACES {
                let part = x.matrix(slot);
                assemble(layout, &units, [part.hi, part.lo], place, &mut out);
            }
        }
        None => {
            let mut memory = dense::work_space(packs * SLOTS, watch)?;
            let mut x = Doubles::new(layout, &mut memory, watch);
            x.matrix(P).copy_from_slice(&blocks[0]);
            x.matrix(R).copy_from_slice(&blocks[1]);
            out.doublings = cosine_and_sine(&mut x, LIMIT)?;
            let zero = &mut rests[0];
            zero.fill(Eight::ZERO);
            for (slot, place) in PLACES {
                assemble(layout, &units, [x.matrix(slot), zero], place, &mut out);
            }
        }
    }
    if dense::is_finite(doubles(&out.hi)) { Ok(out) } else { Err(overflow()) }
}

/// How far a result is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// Worked out in doubles.
    Doubles,
    /// In pairs, to be rounded to doubles.
    Rounded,
    /// In pairs, to 103 bits.
    Pairs,
}

/// The balancing `q = 2^d q'`: powers of two and their inverses.
struct Units {
    up: Vec<f64>,
    down: Vec<f64>,
}

/// Units in which both blocks have diagonals of like size, which bound what else there is in
/// definite blocks.
fn units(n: usize, diagonal: impl Fn(usize) -> [f64; 2]) -> Units {
    let exponent = |x: f64| (x.abs() >= f64::MIN_POSITIVE).then(|| exponent_above(x.abs()));
    let stiffest = (0..n)
        .filter_map(|i| {
            let [p, r] = diagonal(i).map(exponent);
            Some(p? + r?)
        })
        .max();
    let exponents = (0..n).map(|i| match diagonal(i).map(exponent) {
        [Some(p), r] => {
            // Free coordinates count as soft ones.
            let floor = stiffest.map(|stiffest| stiffest - 40 - p);
            let r = r.max(floor).unwrap_or(p);
            ((p - r) / 4).clamp(-200, 200)
        }
        _ => 0,
    });
    let up: Vec<_> = exponents.map(power_of_two).collect();
    Units { down: up.iter().map(|x| 1.0 / x).collect(), up }
}

/// `c` in its slot, `S P` in that of `Y` and `R S` in that of `Y2`; returns the doublings taken.
fn cosine_and_sine(x: &mut impl Arithmetic, limit: f64) -> Result<u32> {
    // Powers of huge blocks could overflow: they are formed of blocks / 2^reduced.
    let reduced = [P, R].map(|slot| {
        let norm = x.norms(slot)[0];
        let exponent = if norm > 1e40 && norm.is_finite() { exponent_above(norm) } else { 0 };
        x.scale(slot, -exponent, 1);
        exponent
    });
    x.multiply(P, R, None, Y)?;
    x.multiply(Y, Y, None, Y2)?;
    x.multiply(Y2, Y, None, Y3)?;
    let norms = [Y, Y2, Y3].map(|slot| x.norms(slot)[0]);
    let larger = reduced[0] + reduced[1];
    let halvings = halvings(norms, limit).map_or(0, |s| (s + larger).max(0) as u32);
    // Halving A quarters Y.
    let doublings = halvings.div_ceil(2);
    for (power, slot) in [(1, Y), (2, Y2), (3, Y3)] {
        x.scale(slot, larger - 2 * doublings as i32, power);
    }
    x.multiply(Y2, Y2, None, Y4)?;
    let [cosine, sine] = &*COEFFICIENTS;
    series(x, cosine, C)?;
    series(x, sine, S)?;
    x.add_diagonal([1.0, 0.0], S);
    for i in 0..doublings {
        x.multiply(S, C, Some((1.0, S)), SPARE)?;
        x.swap(S, SPARE);
        x.square(C, Some(2.0), SPARE)?;
        x.scale(C, 1, 1);
        if i % 16 == 15 && !(x.norms(C)[0].is_finite() && x.norms(S)[0].is_finite()) {
            return Err(overflow());
        }
    }
    for (slot, exponent) in [P, R].into_iter().zip(reduced) {
        x.scale(slot, exponent, 1);
    }
    x.multiply(S, P, None, Y)?;
    x.multiply(R, S, None, Y2)?;
    Ok(doublings)
}

/// Coefficients of `Y`, `Y^2`, … in `c` and in `S - I`, as pairs.
static COEFFICIENTS: LazyLock<[[[f64; 2]; 4 * BLOCKS]; 2]> = LazyLock::new(|| {
    let mut inverse = [1.0, 0.0];
    let mut table = [[[0.0; 2]; 4 * BLOCKS]; 2];
    for n in 2..=8 * BLOCKS + 1 {
        inverse = twofold::divide(inverse, n as f64);
        table[n % 2][n / 2 - 1] = inverse;
    }
    table
});

/// `c_1 Y + c_2 Y^2 + …`, by blocks of four terms (Paterson & Stockmeyer).
fn series(x: &mut impl Arithmetic, c: &[[f64; 2]], out: Slot) -> Result<()> {
    for (block, c) in c.chunks_exact(4).enumerate().rev() {
        let terms = [(c[0], Y), (c[1], Y2), (c[2], Y3), (c[3], Y4)];
        if block == BLOCKS - 1 {
            x.sum(terms, out);
        } else {
            x.sum(terms, SUM);
            x.multiply(Y4, out, Some((1.0, SUM)), SPARE)?;
            x.swap(out, SPARE);
        }
    }
    Ok(())
}

/// Where a result lies in the whole matrix, and how it is scaled and made symmetric.
#[derive(Clone, Copy)]
enum Place {
    Diagonal,
    Upper,
    Lower,
}

/// Copies a block into the whole matrix, undoing the balancing.
fn assemble(
    layout: Layout,
    units: &Units,
    [hi, lo]: [&[Eight]; 2],
    place: Place,
    out: &mut Exponential,
) {
    let n = layout.rows;
    let (hi, lo, ld) = (doubles(hi), doubles(lo), layout.doubles());
    let at = |i: usize, j: usize| [hi[j * ld + i], lo[j * ld + i]];
    let stride = out.layout.doubles();
    let (whole, rest) = (doubles_mut(&mut out.hi), doubles_mut(&mut out.lo));
    let mut put = |i: usize, j: usize, [x, y]: [f64; 2], scale: [f64; 2]| {
        let here = j * stride + i;
        [whole[here], rest[here]] = [x * scale[0] * scale[1], y * scale[0] * scale[1]];
    };
    if let Place::Diagonal = place {
        for j in 0..n {
            for i in 0..n {
                let scale = [units.up[i], units.down[j]];
                put(i, j, at(i, j), scale);
                put(n + j, n + i, at(i, j), scale);
            }
        }
        return;
    }
    let (first, scale) = match place {
        Place::Upper => ([0, n], &units.up),
        _ => ([n, 0], &units.down),
    };
    for j in 0..n {
        for i in 0..=j {
            // Symmetric but for rounding.
            let mean = twofold::sum(at(i, j), at(j, i)).map(|x| 0.5 * x);
            put(first[0] + i, first[1] + j, mean, [scale[i], scale[j]]);
            put(first[0] + j, first[1] + i, mean, [scale[j], scale[i]]);
        }
    }
}

const PLACES: [(Slot, Place); 3] = [(C, Place::Diagonal), (Y, Place::Upper), (Y2, Place::Lower)];
