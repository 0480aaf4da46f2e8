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

    /// `axial + k K` and `bending + k K`, `K` the second derivative of the energy at `q`, or at rest;
    /// `cross` receives `k` times that between `u` and `(v, theta)`, as matrices of elements, where it
    /// is wanted.
    pub fn add_tangent(
        &self,
        k: f64,
        q: Option<(&Fields, &mut Tangents)>,
        axial: &mut Tridiagonal,
        bending: &mut Blocks,
        mut cross: Option<&mut Vec<[[f64; 4]; 2]>>,
    ) {
        let l = self.length;
        let found = match (q, &self.curved) {
            (Some((q, tangents)), Some(curved)) => {
                dispatch(Tangent { elastic: self, curved, q, out: &mut *tangents });
                Some(tangents)
            }
            _ => None,
        };
        let elements = self.axial[PAD..].iter().take_while(|x| **x != 0.0).count();
        for e in 0..elements {
            let i = PAD + e;
            let EA = k * self.axial[i];
            axial.own[i] += EA;
            if e > 0 {
                axial.own[i - 1] += EA;
                axial.next[i - 1] -= EA;
            }
            // In chord c, a, b: cc, ca, cb, aa, ab, bb, and how the tension changes with each.
            let [cc, ca, cb, aa, ab, bb, pulls @ ..] = match &found {
                Some(tangents) => tangents.0.each_ref().map(|x| x[i]),
                None => {
                    let [aa, ab, bb] = self.bending.each_ref().map(|x| x[i]);
                    [0.0, 0.0, 0.0, aa, ab, bb, 0.0, 0.0, 0.0]
                }
            };
            // Of v at the right end, which is minus that at the left one.
            let [of_c, of_a, of_b] = [(cc - ca - cb) / l, (ca - aa - ab) / l, (cb - ab - bb) / l];
            let vv = (of_c - of_a - of_b) / l;
            bending.add(
                e,
                k,
                &[
                    [vv, -of_a, -vv, -of_b],
                    [-of_a, aa, of_a, ab],
                    [-vv, of_a, vv, of_b],
                    [-of_b, ab, of_b, bb],
                ],
            );
            if let Some(cross) = cross.as_deref_mut() {
                let [c, a, b] = pulls;
                let v = (c - a - b) / l;
                let row = [-v, a, v, b].map(|x| EA * x);
                cross.push([row.map(|x| -x), row]);
            }
        }
    }
}

/// Second derivatives of the elements' energies in chord c, a, b: cc, ca, cb, aa, ab, bb; and the
/// first of their stretch: c, a, b. By the node at the right end.
#[derive(Clone, Debug)]
pub struct Tangents([Vec<f64>; 9]);

impl Tangents {
    /// For a beam of so many nodes.
    pub fn new(nodes: usize) -> Tangents {
        Tangents(std::array::from_fn(|_| vec![0.0; field_len(nodes)]))
    }
}

struct Tangent<'a> {
    elastic: &'a Elastic,
    curved: &'a Curved,
    q: &'a Fields,
    out: &'a mut Tangents,
}

impl Body for Tangent<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Tangent { elastic, curved, q, out: Tangents(out) } = self;
        let (length, half) =
            (Pack::<V>::splat(elastic.length), Pack::<V>::splat(0.5 * elastic.length));
        let inverse = Pack::<V>::splat(1.0 / elastic.length);
        let (same, other) = (Pack::<V>::splat(SAME), Pack::splat(OTHER));
        let (one, two) = (Pack::<V>::splat(1.0), Pack::<V>::splat(2.0));
        for i in (PAD..q.u.len() - PAD).step_by(8) {
            let c = (at::<V>(&q.v, i) - at(&q.v, i - 1)) * inverse;
            let (a, b) = (at::<V>(&q.theta, i - 1) - c, at::<V>(&q.theta, i) - c);
            let (of_a, of_b) = (same * a + other * b, same * b + other * a);
            let square = c * c + (a * of_a + b * of_b);
            let EA = at::<V>(&elastic.axial, i);
            let stretch = at::<V>(&q.u, i) - at(&q.u, i - 1);
            let pull = EA * (stretch + half * square) * length;
            let (fc, fa, fb) = (length * c, length * of_a, length * of_b);
            let (mut cc, mut ca, mut cb) = (EA * fc * fc + pull, EA * fc * fa, EA * fc * fb);
            let mut aa = EA * fa * fa + pull * same;
            let mut ab = EA * fa * fb + pull * other;
            let mut bb = EA * fb * fb + pull * same;
            for point in 0..POINTS {
                let [slope, curvature] = shapes(elastic.rule[0][point]);
                let [sa, sb] = [Pack::<V>::splat(slope[0]), Pack::splat(slope[1])];
                let [wa, wb] = [Pack::<V>::splat(curvature[0]), Pack::splat(curvature[1])];
                let (bend, tilt) = (a * wa + b * wb, c + (a * sa + b * sb));
                let weight = Pack::splat(elastic.rule[1][point]) * inverse * at(&curved[point], i);
                let stiff = weight * (one + tilt * tilt);
                let mixed = weight * two * bend * tilt;
                let tilting = weight * bend * bend;
                cc = cc + tilting;
                ca = ca + (mixed * wa + tilting * sa);
                cb = cb + (mixed * wb + tilting * sb);
                aa = aa + (stiff * wa * wa + mixed * two * wa * sa + tilting * sa * sa);
                ab = ab + (stiff * wa * wb + mixed * (wa * sb + sa * wb) + tilting * sa * sb);
                bb = bb + (stiff * wb * wb + mixed * two * wb * sb + tilting * sb * sb);
            }
            let found = [cc, ca, cb, aa, ab, bb, fc, fa, fb];
            for (out, found) in out.iter_mut().zip(found) {
                found.store(&mut out[i..]);
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
