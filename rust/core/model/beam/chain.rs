//! Matrices that couple a node to its neighbours, `u`, `v` and `theta` together, in 3 x 3 blocks:
//! what Newton's method needs. Eliminated without pivoting, which would choose by units.

use super::arrays::{Blocks, Fields, PAD, Skew, Tridiagonal};

type Block = [[f64; 3]; 3];

/// A block tridiagonal matrix, and its factors in the same memory.
#[derive(Clone, Debug)]
pub struct Chain {
    own: Vec<Block>,
    /// From a node's row to the next node's columns.
    next: Vec<Block>,
    /// From a node's row to the last node's columns.
    back: Vec<Block>,
}

impl Chain {
    /// Zeros.
    pub fn new(nodes: usize) -> Chain {
        let zeros = || vec![[[0.0; 3]; 3]; nodes];
        Chain { own: zeros(), next: zeros(), back: zeros() }
    }

    /// Sets a symmetric matrix with `u` apart.
    pub fn set(&mut self, axial: &Tridiagonal, bending: &Blocks) {
        for part in [&mut self.own, &mut self.next, &mut self.back] {
            part.fill([[0.0; 3]; 3]);
        }
        self.add(axial, bending);
    }

    /// Adds a symmetric matrix with `u` apart.
    pub fn add(&mut self, axial: &Tridiagonal, bending: &Blocks) {
        for i in 0..self.own.len() {
            let at = PAD + i;
            let [vv, vt, tt] = bending.own.each_ref().map(|x| x[at]);
            add(&mut self.own[i], &[[axial.own[at], 0.0, 0.0], [0.0, vv, vt], [0.0, vt, tt]]);
            let [vv, vt, tv, tt] = bending.next.each_ref().map(|x| x[at]);
            let next = [[axial.next[at], 0.0, 0.0], [0.0, vv, vt], [0.0, tv, tt]];
            add(&mut self.next[i], &next);
            if i + 1 < self.own.len() {
                add(&mut self.back[i + 1], &transposed(&next));
            }
        }
    }

    /// Adds `k` times a skew matrix.
    pub fn add_skew(&mut self, k: f64, skew: &Skew) {
        let n = self.own.len();
        for i in 0..n {
            let at = PAD + i;
            for c in 0..2 {
                self.own[i][0][c + 1] += k * skew.own[c][at];
                self.own[i][c + 1][0] -= k * skew.own[c][at];
                if i + 1 < n {
                    self.next[i][0][c + 1] += k * skew.next[c][at];
                    self.back[i + 1][c + 1][0] -= k * skew.next[c][at];
                    self.back[i + 1][0][c + 1] += k * skew.back[c][at];
                    self.next[i][c + 1][0] -= k * skew.back[c][at];
                }
            }
        }
    }

    /// `self <- A + k B + l C`.
    pub fn combine(&mut self, a: &Chain, k: f64, b: &Chain, l: f64, c: &Chain) {
        let rows = [
            (&mut self.own, &a.own, &b.own, &c.own),
            (&mut self.next, &a.next, &b.next, &c.next),
            (&mut self.back, &a.back, &b.back, &c.back),
        ];
        for (out, a, b, c) in rows {
            let blocks = out.iter_mut().zip(a).zip(b.iter().zip(c));
            for ((out, a), (b, c)) in blocks {
                for r in 0..3 {
                    for s in 0..3 {
                        out[r][s] = a[r][s] + (k * b[r][s] + l * c[r][s]);
                    }
                }
            }
        }
    }

    /// Adds `k` times couplings of `u` and `(v, theta)`, symmetric, as matrices of elements.
    pub fn add_cross(&mut self, k: f64, elements: &[[[f64; 4]; 2]]) {
        for (i, e) in elements.iter().enumerate() {
            for c in 0..2 {
                let mut add = |row: usize, column: usize, x: f64| {
                    let block = match (row, column) {
                        (0, 0) if i > 0 => &mut self.own[i - 1],
                        (0, 1) if i > 0 => &mut self.next[i - 1],
                        (1, 0) if i > 0 => &mut self.back[i],
                        (1, 1) => &mut self.own[i],
                        _ => return,
                    };
                    block[0][c + 1] += k * x;
                    // The transposed entry lies in the block on the other side.
                    let other = match (row, column) {
                        (0, 1) => &mut self.back[i],
                        (1, 0) => &mut self.next[i - 1],
                        (0, 0) => &mut self.own[i - 1],
                        _ => &mut self.own[i],
                    };
                    other[c + 1][0] += k * x;
                };
                add(0, 0, e[0][c]);
                add(0, 1, e[0][2 + c]);
                add(1, 0, e[1][c]);
                add(1, 1, e[1][2 + c]);
            }
        }
    }

    /// Factors; whether all pivots are positive.
    pub fn factor(&mut self) -> bool {
        let mut good = true;
        for i in 0..self.own.len() {
            if i > 0 {
                // `next` of the last node is its inverse pivot times the coupling already.
                let taken = product(&self.back[i], &self.next[i - 1]);
                for (row, taken) in self.own[i].iter_mut().zip(taken) {
                    row.iter_mut().zip(taken).for_each(|(x, taken)| *x -= taken);
                }
            }
            let (inverse, positive) = inverse(&self.own[i]);
            good &= positive;
            self.own[i] = inverse;
            self.next[i] = product(&inverse, &self.next[i]);
        }
        good
    }

    /// `x <- A^-1 x`, once factored.
    pub fn solve(&self, x: &mut Fields) {
        let n = self.own.len();
        let mut last = [0.0; 3];
        for i in 0..n {
            let at = PAD + i;
            let mut r = [x.u[at], x.v[at], x.theta[at]];
            if i > 0 {
                let taken = times(&self.back[i], last);
                r.iter_mut().zip(taken).for_each(|(r, taken)| *r -= taken);
            }
            last = times(&self.own[i], r);
            [x.u[at], x.v[at], x.theta[at]] = last;
        }
        for i in (0..n - 1).rev() {
            let at = PAD + i;
            let taken = times(&self.next[i], last);
            x.u[at] -= taken[0];
            x.v[at] -= taken[1];
            x.theta[at] -= taken[2];
            last = [x.u[at], x.v[at], x.theta[at]];
        }
    }
}

fn add(to: &mut Block, from: &Block) {
    for (to, from) in to.iter_mut().flatten().zip(from.iter().flatten()) {
        *to += from;
    }
}

fn transposed(a: &Block) -> Block {
    std::array::from_fn(|r| std::array::from_fn(|c| a[c][r]))
}

#[inline(always)]
fn times(a: &Block, x: [f64; 3]) -> [f64; 3] {
    a.map(|row| row[0] * x[0] + (row[1] * x[1] + row[2] * x[2]))
}

fn product(a: &Block, b: &Block) -> Block {
    a.map(|row| std::array::from_fn(|c| row[0] * b[0][c] + (row[1] * b[1][c] + row[2] * b[2][c])))
}

/// The inverse, and whether its pivots are positive.
fn inverse(a: &Block) -> (Block, bool) {
    let [[a00, a01, a02], [a10, a11, a12], [a20, a21, a22]] = *a;
    // Minors of the lower right first: `u` is stiff and couples least.
    let (c00, c01, c02) = (a11 * a22 - a12 * a21, a12 * a20 - a10 * a22, a10 * a21 - a11 * a20);
    let determinant = a00 * c00 + (a01 * c01 + a02 * c02);
    let k = 1.0 / determinant;
    let inverse = [
        [k * c00, k * (a02 * a21 - a01 * a22), k * (a01 * a12 - a02 * a11)],
        [k * c01, k * (a00 * a22 - a02 * a20), k * (a02 * a10 - a00 * a12)],
        [k * c02, k * (a01 * a20 - a00 * a21), k * (a00 * a11 - a01 * a10)],
    ];
    (inverse, a11 > 0.0 && c00 > 0.0 && determinant > 0.0)
}
