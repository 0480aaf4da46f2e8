//! Nodal fields of a beam, and the constant operators on them.
//!
//! Fields lie one after the other, `u`, `v` and `theta`, so that eight nodes are one pack. Operators
//! couple a node to its neighbours alone and are kept by diagonals, indexed as the nodes are.

use crate::linalg::kernel::{Body, Lanes, Pack, dispatch};

/// Zeros before the first node and after the last.
pub const PAD: usize = 8;

/// Axial and transverse displacement and slope of all nodes but the clamped one, between zeros.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fields {
    /// Axial.
    pub u: Vec<f64>,
    /// Transverse.
    pub v: Vec<f64>,
    /// Slope.
    pub theta: Vec<f64>,
}

/// Doubles of a field of `nodes` nodes.
pub fn field_len(nodes: usize) -> usize {
    2 * PAD + nodes.next_multiple_of(8)
}

impl Fields {
    /// Zeros.
    pub fn zeros(nodes: usize) -> Fields {
        let field = || vec![0.0; field_len(nodes)];
        Fields { u: field(), v: field(), theta: field() }
    }

    /// Reads `u1 v1 theta1 u2 ..`.
    pub fn read(&mut self, q: &[f64]) {
        for (i, node) in q.chunks_exact(3).enumerate() {
            (self.u[PAD + i], self.v[PAD + i], self.theta[PAD + i]) = (node[0], node[1], node[2]);
        }
    }

    /// Writes `u1 v1 theta1 u2 ..`.
    pub fn write(&self, q: &mut [f64]) {
        for (i, node) in q.chunks_exact_mut(3).enumerate() {
            node.copy_from_slice(&[self.u[PAD + i], self.v[PAD + i], self.theta[PAD + i]]);
        }
    }

    /// The three fields.
    pub fn parts(&self) -> [&[f64]; 3] {
        [&self.u, &self.v, &self.theta]
    }

    /// The three fields, to write.
    pub fn parts_mut(&mut self) -> [&mut [f64]; 3] {
        [&mut self.u, &mut self.v, &mut self.theta]
    }

    /// The scalar product.
    pub fn dot(&self, other: &Fields) -> f64 {
        dispatch(Dot { x: self, y: other })
    }

    /// `self <- self + k x`.
    pub fn add(&mut self, k: f64, x: &Fields) {
        dispatch(Combine { out: self, x, k, keep: 1.0 });
    }

    /// `self <- y + k x`.
    pub fn set(&mut self, y: &Fields, k: f64, x: &Fields) {
        self.copy(y);
        self.add(k, x);
    }

    /// `self <- x`.
    pub fn copy(&mut self, x: &Fields) {
        for (to, from) in self.parts_mut().into_iter().zip(x.parts()) {
            to.copy_from_slice(from);
        }
    }

    /// Largest magnitude; not a number where an entry is not.
    pub fn largest(&self) -> f64 {
        dispatch(Largest(self))
    }
}

struct Largest<'a>(&'a Fields);

impl Body for Largest<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Lanes>(self) -> f64 {
        let zero = Pack::<V>::splat(0.0);
        // A maximum drops what is not a number; a sum of zeros does not.
        let (mut largest, mut zeros) = (zero, zero);
        for part in self.0.parts() {
            for x in part.chunks_exact(8) {
                let x = Pack::<V>::load(x);
                largest = x.abs().max(largest);
                zeros = zeros + x * zero;
            }
        }
        largest.largest() + zeros.sum()
    }
}

struct Dot<'a> {
    x: &'a Fields,
    y: &'a Fields,
}

impl Body for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Lanes>(self) -> f64 {
        let mut sums = [Pack::<V>::splat(0.0); 3];
        for ((sum, x), y) in sums.iter_mut().zip(self.x.parts()).zip(self.y.parts()) {
            for (x, y) in x.chunks_exact(8).zip(y.chunks_exact(8)) {
                *sum = *sum + Pack::load(x) * Pack::load(y);
            }
        }
        ((sums[0] + sums[1]) + sums[2]).sum()
    }
}

struct Combine<'a> {
    out: &'a mut Fields,
    x: &'a Fields,
    k: f64,
    keep: f64,
}

impl Body for Combine<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let (k, keep) = (Pack::<V>::splat(self.k), Pack::<V>::splat(self.keep));
        for (out, x) in self.out.parts_mut().into_iter().zip(self.x.parts()) {
            for (out, x) in out.chunks_exact_mut(8).zip(x.chunks_exact(8)) {
                (keep * Pack::load(out) + k * Pack::load(x)).store(out);
            }
        }
    }
}

/// A symmetric operator on one field: `x_i`'s row is `own[i] x_i + next[i] x_(i+1) + next[i-1]
/// x_(i-1)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Tridiagonal {
    /// The diagonal.
    pub own: Vec<f64>,
    /// Above it.
    pub next: Vec<f64>,
}

/// A symmetric operator on `v` and `theta`, of 2 x 2 blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocks {
    /// On the diagonal: `vv`, `v theta`, `theta theta`.
    pub own: [Vec<f64>; 3],
    /// Above it, from a node's row to the next node's column: `vv`, `v theta`, `theta v`, `theta
    /// theta`.
    pub next: [Vec<f64>; 4],
}

/// A skew operator between `u` and `(v, theta)`: rows of `u`; those of `v` and `theta` are minus the
/// transpose.
#[derive(Clone, Debug, PartialEq)]
pub struct Skew {
    /// Columns of the node itself: `v`, `theta`.
    pub own: [Vec<f64>; 2],
    /// Columns of the next node.
    pub next: [Vec<f64>; 2],
    /// From the next node's row to this node's columns.
    pub back: [Vec<f64>; 2],
}

impl Tridiagonal {
    /// Zeros.
    pub fn zeros(nodes: usize) -> Self {
        Tridiagonal { own: vec![0.0; field_len(nodes)], next: vec![0.0; field_len(nodes)] }
    }

    /// Adds the matrices of elements.
    pub fn assemble(&mut self, elements: &[[[f64; 2]; 2]]) {
        for (e, k) in elements.iter().enumerate() {
            let right = PAD + e;
            self.own[right] += k[1][1];
            if e > 0 {
                self.own[right - 1] += k[0][0];
                self.next[right - 1] += k[0][1];
            }
        }
    }

    /// All diagonals.
    pub fn parts_mut(&mut self) -> [&mut Vec<f64>; 2] {
        [&mut self.own, &mut self.next]
    }

    /// `self <- k A + l B`.
    pub fn combine(&mut self, k: f64, a: &Tridiagonal, l: f64, b: &Tridiagonal) {
        mix(&mut self.own, k, &a.own, l, &b.own);
        mix(&mut self.next, k, &a.next, l, &b.next);
    }

    /// What comes of `x` at eight nodes from index `i` on.
    #[inline(always)]
    pub fn rows<V: Lanes>(&self, i: usize, x: &[f64]) -> Pack<V> {
        at(&self.own, i) * at(x, i)
            + (at(&self.next, i) * at(x, i + 1) + at(&self.next, i - 1) * at(x, i - 1))
    }
}

impl Blocks {
    /// Zeros.
    pub fn zeros(nodes: usize) -> Self {
        let field = || vec![0.0; field_len(nodes)];
        Blocks { own: [field(), field(), field()], next: [field(), field(), field(), field()] }
    }

    /// Adds `k` times the matrices of elements, in `v`, `theta` of the left node and the right one.
    pub fn assemble(&mut self, k: f64, elements: &[[[f64; 4]; 4]]) {
        for (e, m) in elements.iter().enumerate() {
            self.add(e, k, m);
        }
    }

    /// Adds `k` times the matrix of element `e`.
    pub fn add(&mut self, e: usize, k: f64, m: &[[f64; 4]; 4]) {
        let right = PAD + e;
        for (at, [i, j]) in [[2, 2], [2, 3], [3, 3]].into_iter().enumerate() {
            self.own[at][right] += k * m[i][j];
        }
        if e == 0 {
            return;
        }
        for (at, [i, j]) in [[0, 0], [0, 1], [1, 1]].into_iter().enumerate() {
            self.own[at][right - 1] += k * m[i][j];
        }
        for (at, [i, j]) in [[0, 2], [0, 3], [1, 2], [1, 3]].into_iter().enumerate() {
            self.next[at][right - 1] += k * m[i][j];
        }
    }

    /// All diagonals.
    pub fn parts_mut(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        self.own.iter_mut().chain(&mut self.next)
    }

    /// `self <- k A + l B`.
    pub fn combine(&mut self, k: f64, a: &Blocks, l: f64, b: &Blocks) {
        for (out, (a, b)) in self.own.iter_mut().zip(a.own.iter().zip(&b.own)) {
            mix(out, k, a, l, b);
        }
        for (out, (a, b)) in self.next.iter_mut().zip(a.next.iter().zip(&b.next)) {
            mix(out, k, a, l, b);
        }
    }

    /// What comes of `v` and `theta` at eight nodes from index `i` on.
    #[inline(always)]
    pub fn rows<V: Lanes>(&self, i: usize, v: &[f64], theta: &[f64]) -> [Pack<V>; 2] {
        let (own, next) = (&self.own, &self.next);
        let [vv, vt, tt] = [at::<V>(&own[0], i), at(&own[1], i), at(&own[2], i)];
        let right = [at::<V>(&next[0], i), at(&next[1], i), at(&next[2], i), at(&next[3], i)];
        let j = i - 1;
        let left = [at::<V>(&next[0], j), at(&next[1], j), at(&next[2], j), at(&next[3], j)];
        let [v_left, v_own, v_right] = [at(v, i - 1), at(v, i), at(v, i + 1)];
        let [t_left, t_own, t_right] = [at(theta, i - 1), at(theta, i), at(theta, i + 1)];
        [
            (vv * v_own + vt * t_own)
                + ((right[0] * v_right + right[1] * t_right)
                    + (left[0] * v_left + left[2] * t_left)),
            (vt * v_own + tt * t_own)
                + ((right[2] * v_right + right[3] * t_right)
                    + (left[1] * v_left + left[3] * t_left)),
        ]
    }
}

impl Skew {
    /// Assembles elements: rows of `u`, columns of `v`, `theta` of the left node and the right one.
    pub fn assembled(nodes: usize, elements: &[[[f64; 4]; 2]]) -> Self {
        let field = || vec![0.0; field_len(nodes)];
        let pair = || [field(), field()];
        let mut skew = Skew { own: pair(), next: pair(), back: pair() };
        for (e, g) in elements.iter().enumerate() {
            let right = PAD + e;
            for c in 0..2 {
                skew.own[c][right] += g[1][2 + c];
                if e > 0 {
                    skew.own[c][right - 1] += g[0][c];
                    skew.next[c][right - 1] += g[0][2 + c];
                    skew.back[c][right - 1] += g[1][c];
                }
            }
        }
        skew
    }

    /// What comes of three fields at eight nodes from index `i` on.
    #[inline(always)]
    pub fn rows<V: Lanes>(&self, i: usize, [u, v, theta]: [&[f64]; 3]) -> [Pack<V>; 3] {
        let across = at(&self.own[0], i) * at(v, i) + at(&self.own[1], i) * at(theta, i);
        let right = at(&self.next[0], i) * at(v, i + 1) + at(&self.next[1], i) * at(theta, i + 1);
        let left =
            at(&self.back[0], i - 1) * at(v, i - 1) + at(&self.back[1], i - 1) * at(theta, i - 1);
        let [u_left, u_own, u_right] = [at::<V>(u, i - 1), at(u, i), at(u, i + 1)];
        let v_row = at(&self.own[0], i) * u_own
            + (at(&self.next[0], i - 1) * u_left + at(&self.back[0], i) * u_right);
        let theta_row = at(&self.own[1], i) * u_own
            + (at(&self.next[1], i - 1) * u_left + at(&self.back[1], i) * u_right);
        [across + (right + left), -v_row, -theta_row]
    }
}

fn mix(out: &mut [f64], k: f64, a: &[f64], l: f64, b: &[f64]) {
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = k * a + l * b;
    }
}

/// Eight nodes from node index `i` on.
#[inline(always)]
pub fn at<V: Lanes>(x: &[f64], i: usize) -> Pack<V> {
    Pack::load(&x[i..i + 8])
}

/// `out <- M x`.
pub struct Symmetric<'a> {
    /// On `u`; nothing where there is none.
    pub axial: Option<&'a Tridiagonal>,
    /// On `v` and `theta`.
    pub bending: &'a Blocks,
    /// What it acts on.
    pub x: &'a Fields,
    /// What comes of it.
    pub out: &'a mut Fields,
}

impl Body for Symmetric<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Fields { u, v, theta } = self.x;
        for i in (PAD..u.len() - PAD).step_by(8) {
            if let Some(axial) = self.axial {
                axial.rows::<V>(i, u).store(&mut self.out.u[i..]);
            }
            let [to_v, to_theta] = self.bending.rows::<V>(i, v, theta);
            to_v.store(&mut self.out.v[i..]);
            to_theta.store(&mut self.out.theta[i..]);
        }
    }
}

/// `out <- G x`.
pub struct Across<'a> {
    /// G.
    pub skew: &'a Skew,
    /// What it acts on.
    pub x: &'a Fields,
    /// What comes of it.
    pub out: &'a mut Fields,
}

impl Body for Across<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let parts = self.x.parts();
        for i in (PAD..parts[0].len() - PAD).step_by(8) {
            let [u, v, theta] = self.skew.rows::<V>(i, parts);
            u.store(&mut self.out.u[i..]);
            v.store(&mut self.out.v[i..]);
            theta.store(&mut self.out.theta[i..]);
        }
    }
}
