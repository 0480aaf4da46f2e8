//! Factors of symmetric positive definite matrices that couple a node to its neighbours, `u` apart
//! from `(v, theta)`.
//!
//! Eliminated from both ends to the middle: twice as many independent operations. Nothing is
//! pivoted: growth is 1, and a pivot below zero is an unstable state.

use super::arrays::{Blocks, Fields, PAD, Tridiagonal};

/// What is kept of a node: the inverse of its pivot, and that times the coupling to the node it is
/// eliminated into.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    axial: f64,
    axial_next: f64,
    inverse: [f64; 3],
    next: [f64; 4],
}

/// The factors.
#[derive(Clone, Debug)]
pub struct Factor {
    nodes: Vec<Node>,
}

impl Factor {
    /// Factors a matrix; `None` where it is not positive definite.
    pub fn new(nodes: usize, axial: &Tridiagonal, bending: &Blocks) -> Option<Factor> {
        let mut made = Factor { nodes: vec![Node::default(); nodes] };
        made.refresh(axial, bending).then_some(made)
    }

    /// Factors another matrix in the same memory; whether it is positive definite.
    pub fn refresh(&mut self, axial: &Tridiagonal, bending: &Blocks) -> bool {
        let n = self.nodes.len();
        let middle = n / 2;
        let mut good = true;
        let mut pivot = |node: &mut Node, axial: f64, [vv, vt, tt]: [f64; 3]| {
            let determinant = vv * tt - vt * vt;
            good &= axial > 0.0 && vv > 0.0 && determinant > 0.0;
            node.axial = 1.0 / axial;
            node.inverse = [tt / determinant, -vt / determinant, vv / determinant];
        };
        let own = |i: usize| (axial.own[PAD + i], bending.own.each_ref().map(|x| x[PAD + i]));
        let next = |i: usize| (axial.next[PAD + i], bending.next.each_ref().map(|x| x[PAD + i]));
        let mut rest = [(0.0, [0.0; 3]); 2];
        for i in 0..middle {
            let (mut a, mut b) = own(i);
            subtract(&mut a, &mut b, rest[0]);
            let node = &mut self.nodes[i];
            pivot(node, a, b);
            rest[0] = node.eliminate(next(i));
        }
        for i in (middle + 1..n).rev() {
            let (mut a, mut b) = own(i);
            subtract(&mut a, &mut b, rest[1]);
            let (to_axial, [vv, vt, tv, tt]) = next(i - 1);
            let node = &mut self.nodes[i];
            pivot(node, a, b);
            rest[1] = node.eliminate((to_axial, [vv, tv, vt, tt]));
        }
        let (mut a, mut b) = own(middle);
        subtract(&mut a, &mut b, rest[0]);
        subtract(&mut a, &mut b, rest[1]);
        pivot(&mut self.nodes[middle], a, b);
        good
    }

    /// `x <- A^-1 x`.
    pub fn solve(&self, x: &mut Fields) {
        let n = self.nodes.len();
        let middle = n / 2;
        let Fields { u, v, theta } = x;
        let (u, v, theta) = (&mut u[PAD..PAD + n], &mut v[PAD..PAD + n], &mut theta[PAD..PAD + n]);
        let nodes = &self.nodes[..n];
        // Both halves in one loop, so that their chains overlap.
        let behind = n - 1 - middle;
        for i in 0..middle.max(behind) {
            if i < middle {
                let [to_u, to_v, to_theta] = nodes[i].across([u[i], v[i], theta[i]]);
                u[i + 1] -= to_u;
                v[i + 1] -= to_v;
                theta[i + 1] -= to_theta;
            }
            if i < behind {
                let j = n - 1 - i;
                let [to_u, to_v, to_theta] = nodes[j].across([u[j], v[j], theta[j]]);
                u[j - 1] -= to_u;
                v[j - 1] -= to_v;
                theta[j - 1] -= to_theta;
            }
        }
        [u[middle], v[middle], theta[middle]] =
            nodes[middle].solved([u[middle], v[middle], theta[middle]], [0.0; 3]);
        for i in 0..middle.max(behind) {
            if i < middle {
                let j = middle - 1 - i;
                let from = [u[j + 1], v[j + 1], theta[j + 1]];
                [u[j], v[j], theta[j]] = nodes[j].solved([u[j], v[j], theta[j]], from);
            }
            if i < behind {
                let j = middle + 1 + i;
                let from = [u[j - 1], v[j - 1], theta[j - 1]];
                [u[j], v[j], theta[j]] = nodes[j].solved([u[j], v[j], theta[j]], from);
            }
        }
    }
}

fn subtract(axial: &mut f64, bending: &mut [f64; 3], rest: (f64, [f64; 3])) {
    *axial -= rest.0;
    bending.iter_mut().zip(rest.1).for_each(|(x, rest)| *x -= rest);
}

impl Node {
    /// Sets the coupling to the node this one is eliminated into; what is subtracted from its pivot.
    fn eliminate(&mut self, (axial, [b0, b1, b2, b3]): (f64, [f64; 4])) -> (f64, [f64; 3]) {
        let [e0, e1, e2] = self.inverse;
        self.axial_next = self.axial * axial;
        let next = [e0 * b0 + e1 * b2, e0 * b1 + e1 * b3, e1 * b0 + e2 * b2, e1 * b1 + e2 * b3];
        self.next = next;
        let rest =
            [b0 * next[0] + b2 * next[2], b0 * next[1] + b2 * next[3], b1 * next[1] + b3 * next[3]];
        (self.axial_next * axial, rest)
    }

    /// What a right side here takes from the one of the node it is eliminated into.
    #[inline(always)]
    fn across(&self, [u, v, theta]: [f64; 3]) -> [f64; 3] {
        let [n0, n1, n2, n3] = self.next;
        [self.axial_next * u, n0 * v + n2 * theta, n1 * v + n3 * theta]
    }

    /// The solution here, given that of the node it was eliminated into.
    #[inline(always)]
    fn solved(&self, [u, v, theta]: [f64; 3], from: [f64; 3]) -> [f64; 3] {
        let [e0, e1, e2] = self.inverse;
        let [n0, n1, n2, n3] = self.next;
        [
            self.axial * u - self.axial_next * from[0],
            (e0 * v + e1 * theta) - (n0 * from[1] + n1 * from[2]),
            (e1 * v + e2 * theta) - (n2 * from[1] + n3 * from[2]),
        ]
    }
}
