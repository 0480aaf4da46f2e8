//! Elastic forces of the beam, element by element.
//!
//! An element bends by its end slopes relative to its chord, `a = theta1 - c`, `b = theta2 - c`, `c =
//! (v2 - v1)/l`. Sums of assembled stiffnesses would lose what neighbours have in common: on 500
//! elements their rounding is seen in the eighth digit.

use super::Coupling;
use super::arrays::{Blocks, Fields, PAD, Tridiagonal, at, field_len};
use crate::linalg::kernel::{Body, Lanes, Pack, dispatch};

/// Gauss points of an element.
pub const POINTS: usize = 6;

/// Stiffnesses of the elements.
#[derive(Clone, Debug)]
pub struct Elastic {
    /// Length of an element.
    length: f64,
    /// `EA/l`, by the node at the right end.
    axial: Vec<f64>,
    /// Bending moments at the ends per slope: `aa`, `ab`, `bb`.
    bending: [Vec<f64>; 3],
    /// `EI` at the Gauss points, `[point][node]`, where bending is not linear.
    curved: Option<Curved>,
    /// Gauss points in (0, 1) and their weights.
    rule: [[f64; POINTS]; 2],
}

/// Slopes and curvatures, times l, of unit a and unit b at a point.
#[inline(always)]
fn shapes(x: f64) -> [[f64; 2]; 2] {
    let slopes = [1.0 - 4.0 * x + 3.0 * x * x, 3.0 * x * x - 2.0 * x];
    [slopes, [6.0 * x - 4.0, 6.0 * x - 2.0]]
}

/// `integral of v'^2` over an element of length 1: `c^2 + (2 (a^2 + b^2)/15 - a b/15)`.
const SAME: f64 = 2.0 / 15.0;
const OTHER: f64 = -1.0 / 30.0;

impl Elastic {
    /// `axial`: mean `EA` of each element; `bending`: `EI` at its Gauss points.
    pub fn new(
        length: f64,
        coupling: Coupling,
        axial: &[f64],
        bending: &[[f64; POINTS]],
        rule: [[f64; POINTS]; 2],
    ) -> Elastic {
        let nodes = axial.len();
        let field = || vec![0.0; field_len(nodes)];
        let mut made = Elastic {
            length,
            axial: field(),
            bending: [field(), field(), field()],
            curved: (coupling == Coupling::Third).then(|| std::array::from_fn(|_| field())),
            rule,
        };
        for (e, (stretching, EI)) in axial.iter().zip(bending).enumerate() {
            let i = PAD + e;
            made.axial[i] = stretching / length;
            for (point, EI) in EI.iter().enumerate() {
                let [_, [a, b]] = shapes(rule[0][point]);
                let weight = rule[1][point] * EI / length;
                made.bending[0][i] += weight * a * a;
                made.bending[1][i] += weight * a * b;
                made.bending[2][i] += weight * b * b;
                if let Some(curved) = &mut made.curved {
                    curved[point][i] = *EI;
                }
            }
        }
        made
    }

    /// What bends beyond linear elasticity.
    pub fn curved(&self) -> Option<&Curved> {
        self.curved.as_ref()
    }

    /// Length of an element.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// `F` with `K = F^T F`, row by row, in the order `u1 v1 theta1 u2 ..`: a row for each way an
    /// element deforms.
    pub fn deformations(&self) -> Vec<f64> {
        let elements = self.axial[PAD..].iter().take_while(|x| **x != 0.0).count();
        let (N, l) = (3 * elements, self.length);
        let mut rows = Vec::with_capacity(3 * elements * N);
        for e in 0..elements {
            let i = PAD + e;
            let [aa, ab, bb] = self.bending.each_ref().map(|x| x[i]);
            // aa a^2 + 2 ab a b + bb b^2 = (f a + g b)^2 + (h b)^2
            let f = aa.sqrt();
            let (g, h) = (ab / f, (bb - ab * ab / aa).sqrt());
            let stretch = self.axial[i].sqrt();
            // Of (u, v, theta) of both nodes.
            let one = [0.0, (f + g) / l, f, 0.0, -(f + g) / l, g];
            let two = [0.0, h / l, 0.0, 0.0, -h / l, h];
            for deformed in [[-stretch, 0.0, 0.0, stretch, 0.0, 0.0], one, two] {
                let mut row = vec![0.0; N];
                for (at, x) in deformed.into_iter().enumerate() {
                    // The first node is clamped.
                    if let Some(at) = (3 * e + at).checked_sub(3) {
                        row[at] = x;
                    }
                }
                rows.extend(row);
            }
        }
        rows
    }

    /// Whether forces are linear in displacements.
    pub fn is_linear(&self) -> bool {
        self.curved.is_none()
    }

    /// `out <- out - k dV/dq`.
    pub fn subtract_forces(&self, k: f64, q: &Fields, ends: &mut Ends, out: &mut Fields) {
        dispatch(Forces { elastic: self, curved: self.curved.as_ref(), k, q, ends, out });
    }

    /// `out <- out - k K x`, K the stiffness at rest.
    pub fn subtract_linear(&self, k: f64, x: &Fields, ends: &mut Ends, out: &mut Fields) {
        dispatch(Forces { elastic: self, curved: None, k, q: x, ends, out });
    }

    /// The elastic energy.
    pub fn energy(&self, q: &Fields) -> f64 {
        let mut total = 0.0;
        for i in PAD..PAD + (self.axial.len() - 2 * PAD) {
            if self.axial[i] == 0.0 {
                break;
            }
            let l = self.length;
            let [chord, a, b] = bent(l, q, i);
            let stretch = q.u[i] - q.u[i - 1];
            let [aa, ab, bb] = self.bending.each_ref().map(|x| x[i]);
            total += match &self.curved {
                None => {
                    0.5 * self.axial[i] * stretch * stretch
                        + 0.5 * (aa * a * a + 2.0 * ab * a * b + bb * b * b)
                }
                Some(curved) => {
                    let square = chord * chord + SAME * (a * a + b * b) + 2.0 * OTHER * a * b;
                    let stretch = stretch + 0.5 * l * square;
                    let mut bending = 0.0;
                    for point in 0..POINTS {
                        let [slope, curvature] = shapes(self.rule[0][point]);
                        let s = chord + a * slope[0] + b * slope[1];
                        let k = a * curvature[0] + b * curvature[1];
                        bending += self.rule[1][point] * curved[point][i] * k * k * (1.0 + s * s);
                    }
                    0.5 * self.axial[i] * stretch * stretch + 0.5 * bending / l
                }
            };
        }
        total
    }

    /// `axial + k K` and `bending + k K`, `K` the second derivative of the energy at `q`; `cross`
    /// receives `k` times that between `u` and `(v, theta)`, as matrices of elements, where it is
    /// wanted.
    pub fn add_tangent(
        &self,
        k: f64,
        q: Option<&Fields>,
        axial: &mut Tridiagonal,
        bending: &mut Blocks,
        mut cross: Option<&mut Vec<[[f64; 4]; 2]>>,
    ) {
        let l = self.length;
        let elements = self.axial[PAD..].iter().take_while(|x| **x != 0.0).count();
        for e in 0..elements {
            let i = PAD + e;
            let EA = k * self.axial[i];
            axial.own[i] += EA;
            if e > 0 {
                axial.own[i - 1] += EA;
                axial.next[i - 1] -= EA;
            }
            // In chord, a, b.
            let [aa, ab, bb] = self.bending.each_ref().map(|x| x[i]);
            let mut natural = [[0.0, 0.0, 0.0], [0.0, aa, ab], [0.0, ab, bb]];
            let mut slope_force = [0.0; 3];
            if let (Some(curved), Some(q)) = (&self.curved, q) {
                let [chord, a, b] = bent(l, q, i);
                let square = chord * chord + SAME * (a * a + b * b) + 2.0 * OTHER * a * b;
                let tension = self.axial[i] * (q.u[i] - q.u[i - 1] + 0.5 * l * square);
                // Derivatives of l/2 times the mean square slope.
                slope_force = [l * chord, l * (SAME * a + OTHER * b), l * (SAME * b + OTHER * a)];
                natural = [[0.0; 3]; 3];
                let mean = [[1.0, 0.0, 0.0], [0.0, SAME, OTHER], [0.0, OTHER, SAME]];
                for r in 0..3 {
                    for c in 0..3 {
                        natural[r][c] += self.axial[i] * slope_force[r] * slope_force[c]
                            + tension * l * mean[r][c];
                    }
                }
                for point in 0..POINTS {
                    let [slope, curvature] = shapes(self.rule[0][point]);
                    let (s, w) = ([1.0, slope[0], slope[1]], [0.0, curvature[0], curvature[1]]);
                    let bend = a * w[1] + b * w[2];
                    let tilt = chord + a * s[1] + b * s[2];
                    let weight = self.rule[1][point] * curved[point][i] / l;
                    for r in 0..3 {
                        for c in 0..3 {
                            natural[r][c] += weight
                                * ((1.0 + tilt * tilt) * w[r] * w[c]
                                    + 2.0 * bend * tilt * (w[r] * s[c] + s[r] * w[c])
                                    + bend * bend * s[r] * s[c]);
                        }
                    }
                }
            }
            // From (v1, theta1, v2, theta2) to chord, a, b.
            let map = [
                [-1.0 / l, 0.0, 1.0 / l, 0.0],
                [1.0 / l, 1.0, -1.0 / l, 0.0],
                [1.0 / l, 0.0, -1.0 / l, 1.0],
            ];
            let mut element = [[0.0; 4]; 4];
            for r in 0..4 {
                for c in 0..4 {
                    for x in 0..3 {
                        for y in 0..3 {
                            element[r][c] += map[x][r] * natural[x][y] * map[y][c];
                        }
                    }
                }
            }
            bending.add(e, k, &element);
            if let Some(cross) = cross.as_deref_mut() {
                let force: [f64; 4] =
                    std::array::from_fn(|c| (0..3).map(|x| slope_force[x] * map[x][c]).sum());
                let row = force.map(|x| EA * x);
                cross.push([row.map(|x| -x), row]);
            }
        }
    }
}

/// Chord slope, a, b of the element left of node index `i`.
#[inline(always)]
fn bent(l: f64, q: &Fields, i: usize) -> [f64; 3] {
    let chord = (q.v[i] - q.v[i - 1]) / l;
    [chord, q.theta[i - 1] - chord, q.theta[i] - chord]
}

/// Forces at the ends of elements, by the node at the right end: axial, transverse, and the moments
/// left and right.
#[derive(Clone, Debug)]
pub struct Ends([Vec<f64>; 4]);

impl Ends {
    /// For a beam of so many nodes.
    pub fn new(nodes: usize) -> Ends {
        Ends(std::array::from_fn(|_| vec![0.0; field_len(nodes)]))
    }
}

/// `EI` at the Gauss points, `[point][node]`.
pub type Curved = [Vec<f64>; POINTS];

impl Elastic {
    /// Forces at the ends of eight elements, those left of the nodes from index `i` on: axial,
    /// transverse, moments left and right; by the stiffness at rest where there is no `curved`.
    #[inline(always)]
    pub fn ends<V: Lanes>(&self, curved: Option<&Curved>, i: usize, q: &Fields) -> [Pack<V>; 4] {
        let (length, half) = (Pack::<V>::splat(self.length), Pack::<V>::splat(0.5 * self.length));
        let inverse = Pack::<V>::splat(1.0 / self.length);
        let chord = (at::<V>(&q.v, i) - at(&q.v, i - 1)) * inverse;
        let (a, b) = (at::<V>(&q.theta, i - 1) - chord, at::<V>(&q.theta, i) - chord);
        let stretch = at::<V>(&q.u, i) - at(&q.u, i - 1);
        let EA = at(&self.axial, i);
        let Some(curved) = curved else {
            let [aa, ab, bb] = &self.bending;
            let [aa, ab, bb] = [at::<V>(aa, i), at(ab, i), at(bb, i)];
            let (left, right) = (aa * a + ab * b, ab * a + bb * b);
            return [EA * stretch, -(left + right) * inverse, left, right];
        };
        let (same, other) = (Pack::splat(SAME), Pack::splat(OTHER));
        let of_a = same * a + other * b;
        let of_b = same * b + other * a;
        let square = chord * chord + (a * of_a + b * of_b);
        let tension = EA * (stretch + half * square);
        let pull = tension * length;
        let (mut to_a, mut to_b) = (pull * of_a, pull * of_b);
        let mut to_chord = pull * chord;
        for point in 0..POINTS {
            let [slope, curvature] = shapes(self.rule[0][point]);
            let [slope_a, slope_b] = [Pack::<V>::splat(slope[0]), Pack::splat(slope[1])];
            let [bend_a, bend_b] = [Pack::<V>::splat(curvature[0]), Pack::splat(curvature[1])];
            let s = chord + (a * slope_a + b * slope_b);
            let bend = a * bend_a + b * bend_b;
            let weight = Pack::splat(self.rule[1][point]) * inverse;
            let moment = weight * at(&curved[point], i) * bend;
            let by_bend = moment * (Pack::splat(1.0) + s * s);
            let by_slope = moment * bend * s;
            to_a = to_a + (by_bend * bend_a + by_slope * slope_a);
            to_b = to_b + (by_bend * bend_b + by_slope * slope_b);
            to_chord = to_chord + by_slope;
        }
        [tension, (to_chord - (to_a + to_b)) * inverse, to_a, to_b]
    }
}

struct Forces<'a> {
    elastic: &'a Elastic,
    curved: Option<&'a Curved>,
    k: f64,
    q: &'a Fields,
    ends: &'a mut Ends,
    out: &'a mut Fields,
}

impl Body for Forces<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Forces { elastic, curved, k, q, ends: Ends(ends), out } = self;
        let k = Pack::<V>::splat(k);
        for i in (PAD..q.u.len() - PAD).step_by(8) {
            let found = elastic.ends::<V>(curved, i, q);
            for (end, found) in ends.iter_mut().zip(found) {
                (k * found).store(&mut end[i..]);
            }
        }
        // A node is the right end of its element and the left end of the next.
        let [axial, transverse, left, right] = ends;
        for i in (PAD..q.u.len() - PAD).step_by(8) {
            (at::<V>(&out.u, i) - (at(axial, i) - at(axial, i + 1))).store(&mut out.u[i..]);
            (at::<V>(&out.v, i) - (at(transverse, i) - at(transverse, i + 1)))
                .store(&mut out.v[i..]);
            (at::<V>(&out.theta, i) - (at(right, i) + at(left, i + 1))).store(&mut out.theta[i..]);
        }
    }
}
