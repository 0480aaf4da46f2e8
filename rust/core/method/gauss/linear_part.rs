//! The linear part of a system within the stages: what an iteration leaves of their equations is divided
//! by `I - h (b mu) (x) A`, for each group of components that A couples: in the eigenvectors of the
//! stages' matrix; of an oscillator, two components without more, with one of them eliminated.

use super::columns::Columns;
use crate::linalg::kernel::{Body, Eight, Lanes, Pack, dispatch, packs, packs_mut};

/// Components that A couples, and `(I - h value A)^-1` for each eigenvalue: one a lane.
pub struct Group {
    /// The components.
    pub members: Vec<usize>,
    /// Entry `(i, j)`: real and imaginary part.
    pub inverse: Vec<[Eight; 2]>,
    /// Whether an entry is zero in all lanes.
    pub zero: Vec<bool>,
    /// `[I - h value A | I]`.
    work: Vec<[Eight; 2]>,
}

/// `x' = to_x p, p' = to_p x`.
pub struct Oscillator {
    pub x: usize,
    pub p: usize,
    pub to_x: f64,
    /// Columns of `(I - h^2 to_x to_p (b mu)^2)^-1`, a pack a block each.
    pub inverse: Vec<Eight>,
    /// Columns of this times `h to_p b mu`: what is left of x' in that of p'.
    pub from_x: Vec<Eight>,
}

/// A constant matrix, and what it makes of the equations of the stages.
#[derive(Default)]
pub struct LinearPart {
    /// Of each component: where A is not zero, and the entry.
    pub rows: Vec<Vec<(usize, f64)>>,
    /// Coupled components, but for oscillators.
    pub groups: Vec<Group>,
    /// Two that A couples alone.
    pub oscillators: Vec<Oscillator>,
    /// Components without a linear part.
    pub free: Vec<usize>,
}

impl LinearPart {
    /// Of A, `m` rows, for steps of `h`.
    pub fn new(columns: &Columns, h: f64, matrix: &[f64], m: usize) -> LinearPart {
        let rows: Vec<Vec<(usize, f64)>> = (0..m)
            .map(|i| {
                let row = &matrix[m * i..][..m];
                row.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect()
            })
            .collect();
        let mut part = LinearPart { rows, ..LinearPart::default() };
        for members in coupled(&part.rows) {
            if let Some(oscillator) = Oscillator::new(columns, h, &part.rows, &members) {
                part.oscillators.push(oscillator);
                continue;
            }
            let mut group = Group::new(members);
            let empty = group.members.iter().all(|&d| part.rows[d].is_empty());
            // Without an inverse iterations are still right.
            match !empty && group.invert(columns, h, matrix, m) {
                true => part.groups.push(group),
                false => part.free.append(&mut group.members),
            }
        }
        part
    }

    /// For a system without one.
    pub fn none(m: usize) -> LinearPart {
        LinearPart { rows: vec![Vec::new(); m], free: (0..m).collect(), ..LinearPart::default() }
    }

    /// Of another matrix, without a look at what it couples; in memory that is there from the second time
    /// on.
    pub fn renew(&mut self, columns: &Columns, h: f64, matrix: &[f64], m: usize) {
        self.free.clear();
        self.oscillators.clear();
        if !matches!(&self.groups[..], [whole] if whole.members.len() == m) {
            self.groups = vec![Group::new((0..m).collect())];
            self.free.reserve(m);
            for row in &mut self.rows {
                row.reserve(m);
            }
        }
        for (i, row) in self.rows.iter_mut().enumerate() {
            row.clear();
            row.extend(matrix[m * i..][..m].iter().copied().enumerate());
        }
        if !self.groups[0].invert(columns, h, matrix, m) {
            self.groups[0].identity();
        }
    }
}

/// Groups of components that entries connect.
fn coupled(rows: &[Vec<(usize, f64)>]) -> Vec<Vec<usize>> {
    fn root(label: &mut [usize], mut i: usize) -> usize {
        while label[i] != i {
            label[i] = label[label[i]];
            i = label[i];
        }
        i
    }
    let mut label: Vec<usize> = (0..rows.len()).collect();
    for (i, row) in rows.iter().enumerate() {
        for (j, _) in row {
            let (i, j) = (root(&mut label, i), root(&mut label, *j));
            // The smaller one, so that groups come in the order of their first components.
            label[i.max(j)] = i.min(j);
        }
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); rows.len()];
    for i in 0..rows.len() {
        groups[root(&mut label, i)].push(i);
    }
    groups.retain(|members| !members.is_empty());
    groups
}

impl Oscillator {
    fn new(
        columns: &Columns,
        h: f64,
        rows: &[Vec<(usize, f64)>],
        members: &[usize],
    ) -> Option<Oscillator> {
        let &[x, p] = members else { return None };
        let (&[(to, to_x)], &[(from, to_p)]) = (&rows[x][..], &rows[p][..]) else { return None };
        if to != p || from != x {
            return None;
        }
        let zeros = || vec![Eight::ZERO; columns.forward.len() * columns.blocks];
        let (mut inverse, mut from_x) = (zeros(), zeros());
        let square = h * h * to_x * to_p;
        if !dispatch(Inverse { columns, square, factor: None, out: &mut inverse })
            || !dispatch(Inverse { columns, square, factor: Some(h * to_p), out: &mut from_x })
        {
            return None;
        }
        Some(Oscillator { x, p, to_x, inverse, from_x })
    }
}

/// Columns of `(I - square (b mu)^2)^-1`, or of it times `factor b mu`; whether they are finite.
struct Inverse<'a> {
    columns: &'a Columns,
    square: f64,
    factor: Option<f64>,
    out: &'a mut [Eight],
}

impl Body for Inverse<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<V: Lanes>(self) -> bool {
        let Inverse { columns, square, factor, out } = self;
        let values = numbers::<V>(&columns.values);
        let [re, im] = times(values, values).map(|part| part * square);
        let re = 1.0 - re;
        let size = re * re + im * im;
        let mut divisor = [re / size, im / size];
        if let Some(factor) = factor {
            divisor = times(divisor, values.map(|part| part * factor));
        }
        for (forward, column) in columns.forward.iter().zip(out.chunks_exact_mut(columns.blocks)) {
            let mut lanes = ZERO;
            put(&mut lanes, times(numbers::<V>(forward), divisor));
            let backward = columns.backward.chunks_exact(columns.blocks);
            for ((backward, re), im) in backward.zip(lanes[0].0).zip(lanes[1].0) {
                for (entry, backward) in packs_mut::<V>(column).iter_mut().zip(backward) {
                    let [x, y] = numbers::<V>(backward);
                    *entry = *entry + (x * re - y * im);
                }
            }
        }
        let total = packs::<V>(out).iter().fold(Pack::<V>::splat(0.0), |total, x| total + *x);
        total.sum().is_finite()
    }
}

const ZERO: [Eight; 2] = [Eight::ZERO; 2];
const ONE: [Eight; 2] = [Eight([1.0; 8]), Eight::ZERO];

impl Group {
    fn new(members: Vec<usize>) -> Group {
        let entries = members.len() * members.len();
        Group {
            members,
            inverse: vec![ZERO; entries],
            zero: vec![false; entries],
            work: vec![ZERO; 2 * entries],
        }
    }

    /// `(I - h value A)^-1`; whether there is one.
    fn invert(&mut self, columns: &Columns, h: f64, matrix: &[f64], m: usize) -> bool {
        let r = self.members.len();
        let [re, im] = columns.values.map(|part| Eight(part.0.map(|value| h * value)));
        self.work.fill(ZERO);
        for (i, row) in self.work.chunks_exact_mut(2 * r).enumerate() {
            for (j, [x, y]) in row[..r].iter_mut().enumerate() {
                let a = matrix[m * self.members[i] + self.members[j]];
                let unit = f64::from(u8::from(i == j));
                *x = Eight(re.0.map(|value| unit - value * a));
                *y = Eight(im.0.map(|value| -value * a));
            }
            row[r + i] = ONE;
        }
        if !dispatch(Reduce { work: &mut self.work, r }) {
            return false;
        }
        for i in 0..r {
            let (row, found) = (&mut self.inverse[r * i..][..r], &self.work[2 * r * i + r..][..r]);
            row.copy_from_slice(found);
            for (zero, entry) in self.zero[r * i..][..r].iter_mut().zip(found) {
                *zero = *entry == ZERO;
            }
        }
        true
    }

    fn identity(&mut self) {
        self.inverse.fill(ZERO);
        self.zero.fill(true);
        for i in 0..self.members.len() {
            let at = i * (self.members.len() + 1);
            (self.inverse[at], self.zero[at]) = (ONE, false);
        }
    }
}

/// Gauss-Jordan elimination of `[M | I]`, `r` rows of complex numbers, a matrix a lane, with the same
/// pivots; whether there was an inverse in all of them.
struct Reduce<'a> {
    work: &'a mut [[Eight; 2]],
    r: usize,
}

impl Body for Reduce<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<V: Lanes>(self) -> bool {
        let Reduce { work, r } = self;
        let width = 2 * r;
        for column in 0..r {
            let (mut pivot, mut largest) = (column, 0.0);
            for i in column..r {
                let [x, y] = numbers::<V>(&work[width * i + column]);
                let size = (x.abs() + y.abs()).sum();
                if size > largest {
                    (pivot, largest) = (i, size);
                }
            }
            let [x, y] = numbers::<V>(&work[width * pivot + column]);
            let square = x * x + y * y;
            let reciprocal = [x / square, -y / square];
            let total = (1.0 / square).sum();
            if !total.is_finite() {
                return false;
            }
            for at in 0..width {
                let moved = work[width * column + at];
                let entry = times(numbers::<V>(&work[width * pivot + at]), reciprocal);
                work[width * pivot + at] = moved;
                put(&mut work[width * column + at], entry);
            }
            for i in (0..r).filter(|&i| i != column) {
                if work[width * i + column] == ZERO {
                    continue;
                }
                let factor = numbers::<V>(&work[width * i + column]);
                for at in column..width {
                    let [x, y] = times(factor, numbers::<V>(&work[width * column + at]));
                    let [a, b] = numbers::<V>(&work[width * i + at]);
                    put(&mut work[width * i + at], [a - x, b - y]);
                }
            }
        }
        true
    }
}

/// Real and imaginary part.
#[inline(always)]
pub fn numbers<V: Lanes>(memory: &[Eight; 2]) -> [Pack<V>; 2] {
    *packs::<V>(memory).first_chunk().expect("two parts")
}

#[inline(always)]
fn put<V: Lanes>(memory: &mut [Eight; 2], x: [Pack<V>; 2]) {
    packs_mut::<V>(memory).copy_from_slice(&x);
}

/// A complex product.
#[inline(always)]
pub fn times<V: Lanes>(a: [Pack<V>; 2], b: [Pack<V>; 2]) -> [Pack<V>; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tableau::COLLOCATION6;

    #[test]
    fn oscillators_and_a_free_mass_are_told_apart() {
        // x' = p, p' = -4 x; a = 2 apart; y' = v, nothing else.
        #[rustfmt::skip]
        let matrix = [
            0.0, 0.0, 1.0, 0.0, 0.0,
            0.0, 0.0, 0.0, 0.0, 1.0,
            -4.0, 0.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, 0.0, 0.0,
        ];
        let part = LinearPart::new(Columns::of(&COLLOCATION6), 0.5, &matrix, 5);
        let pairs: Vec<_> = part.oscillators.iter().map(|pair| (pair.x, pair.p)).collect();
        assert_eq!(pairs, [(0, 2)]);
        let members: Vec<_> = part.groups.iter().map(|group| group.members.clone()).collect();
        assert_eq!(members, [vec![1, 4]]);
        assert_eq!(part.free, [3]);
        // (I - h v A)^-1 = [1, h v; 0, 1].
        let entry = part.groups[0].inverse[1].map(|part| part.0[1]);
        let v = [COLLOCATION6.values_real[1], COLLOCATION6.values_imaginary[1]];
        assert!(entry.iter().zip(v).all(|(x, v)| (x - 0.5 * v).abs() < 1e-15), "{entry:?}");
    }

    #[test]
    fn the_inverse_of_an_oscillator_is_one() {
        let table = COLLOCATION6;
        let matrix = [0.0, 2.0, -8.0, 0.0];
        let part = LinearPart::new(Columns::of(&table), 0.5, &matrix, 2);
        let inverse = |i: usize, j: usize| part.oscillators[0].inverse[j].0[i];
        let b = |i: usize, j: usize| 0.5 * table.b[i] * table.mu[3 * i + j];
        for i in 0..3 {
            for j in 0..3 {
                let square = |i: usize, j: usize| (0..3).map(|k| b(i, k) * b(k, j)).sum::<f64>();
                let unit = f64::from(u8::from(i == j));
                let product: f64 = (0..3)
                    .map(|k| inverse(i, k) * (f64::from(u8::from(k == j)) + 16.0 * square(k, j)))
                    .sum();
                assert!((product - unit).abs() < 1e-13, "{i} {j}: {product}");
            }
        }
    }
}
