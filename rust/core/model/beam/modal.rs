//! The beam in modal coordinates, for few elements: `q = Phi x`, `p = (Phi^-1)^T y`.
//!
//! Either the modes of the beam alone, with the hub held, or, for a hub that moves freely, those of the
//! whole in which the hub swings along: in the latter the mass is `I + a a^T/J` and the linear part of
//! the motion is that of oscillators.

use super::arrays::{Fields, PAD};
use super::{Beam, Hub};
use crate::linalg::jacobi;
use crate::linalg::kernel::{Body, Eight, Lanes, Layout, Pack, dispatch, doubles, packs};

/// Most elements for which dense matrices are faster than chains of nodes, and as exact.
pub const FEW: usize = 5;

/// Which modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Of the beam, the hub held.
    Held,
    /// Of beam and hub.
    Whole,
}

/// The arrays of the beam in modal coordinates.
pub struct Modal {
    /// Where columns of the matrices lie.
    pub layout: Layout,
    /// Modes.
    pub modes: usize,
    /// Squares of frequencies, padded with zeros.
    pub squares: Vec<Eight>,
    /// `Phi^T G Phi` and `Phi^T Q Phi`, column after column.
    pub gyroscopic: Vec<Eight>,
    /// See `gyroscopic`.
    pub outward: Vec<Eight>,
    /// `Phi^T a` and `Phi^T b`.
    pub a: Vec<Eight>,
    /// See `a`.
    pub b: Vec<Eight>,
    /// `1/J` where the hub swings along, else 0.
    pub along: f64,
    /// `Phi`, `M Phi`, and their transposes: displacements and momenta of modal ones, and back.
    displacements: Vec<f64>,
    momenta: Vec<f64>,
    /// The first two, packed, for the way back of each step.
    back: [Vec<Eight>; 2],
}

impl Modal {
    /// Finds the modes.
    pub fn new(beam: &Beam, frame: Frame) -> Modal {
        let N = 3 * beam.nodes();
        let along = match (frame, &beam.parameters.hub) {
            (Frame::Whole, Hub::Locked { .. }) => 1.0 / beam.inertia(),
            _ => 0.0,
        };
        // Dense matrices, column by column, in the order u1 v1 theta1 u2 ..
        let dense = |apply: &dyn Fn(&Fields, &mut Fields)| -> Vec<f64> {
            let (mut x, mut out) = (Fields::zeros(beam.nodes()), Fields::zeros(beam.nodes()));
            let mut matrix = vec![0.0; N * N];
            for j in 0..N {
                let part = x.parts_mut().into_iter().nth(j % 3).expect("three parts");
                part[PAD + j / 3] = 1.0;
                apply(&x, &mut out);
                out.write(&mut matrix[N * j..][..N]);
                x.parts_mut().into_iter().nth(j % 3).expect("three parts")[PAD + j / 3] = 0.0;
            }
            matrix
        };
        let mass = dense(&|x, out| beam.apply_mass(x, out));
        let gyroscopic = dense(&|x, out| beam.apply_gyroscopic(x, out));
        let outward = dense(&|x, out| beam.apply_outward(x, out));
        let (mut a, mut b) = (vec![0.0; N], vec![0.0; N]);
        beam.lever().write(&mut a);
        beam.arm().write(&mut b);
        let mut reduced = mass;
        for j in 0..N {
            for i in 0..N {
                reduced[N * j + i] -= along * a[i] * a[j];
            }
        }
        let (squares, phi) = modes(beam, &reduced);
        let momenta = product(N, &reduced, &phi);
        // Phi^T A Phi
        let turned = |matrix: &[f64]| transposed_product(N, &phi, &product(N, matrix, &phi));
        let turned_vector = |x: &[f64]| -> Vec<f64> {
            (0..N).map(|j| phi[N * j..][..N].iter().zip(x).map(|(phi, x)| phi * x).sum()).collect()
        };
        let height = N.div_ceil(8);
        let layout = Layout { rows: N, height, stride: height };
        let packed = |matrix: &[f64]| -> Vec<Eight> {
            let mut out = vec![Eight::ZERO; height * matrix.len() / N];
            for (at, x) in matrix.iter().enumerate() {
                out[(at / N) * height + (at % N) / 8].0[at % N % 8] = *x;
            }
            out
        };
        Modal {
            layout,
            modes: N,
            squares: packed(&squares),
            gyroscopic: packed(&turned(&gyroscopic)),
            outward: packed(&turned(&outward)),
            a: packed(&turned_vector(&a)),
            b: packed(&turned_vector(&b)),
            along,
            back: [packed(&phi), packed(&momenta)],
            displacements: phi,
            momenta,
        }
    }

    /// Displacements of modal coordinates.
    pub fn displace(&self, x: &[f64], q: &mut [f64]) {
        spread(&self.displacements, x, q);
    }

    /// Displacements and momenta of modal ones.
    pub fn unfold(&self, x: &[Eight], y: &[Eight], q: &mut [f64], p: &mut [f64]) {
        dispatch(Unfold { modal: self, x, y, q, p });
    }

    /// Modal coordinates of displacements.
    pub fn coordinates(&self, q: &[f64], x: &mut [f64]) {
        gather(&self.momenta, q, x);
    }

    /// Modal momenta.
    pub fn modal_momenta(&self, p: &[f64], y: &mut [f64]) {
        gather(&self.displacements, p, y);
    }
}

struct Unfold<'a> {
    modal: &'a Modal,
    x: &'a [Eight],
    y: &'a [Eight],
    q: &'a mut [f64],
    p: &'a mut [f64],
}

impl Body for Unfold<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Unfold { modal, x, y, q, p } = self;
        let (height, count) = (modal.layout.height, modal.modes);
        let (phi, dual) = (packs::<V>(&modal.back[0]), packs::<V>(&modal.back[1]));
        let (x, y) = (&doubles(x)[..count], &doubles(y)[..count]);
        for i in 0..height {
            let (mut to_q, mut to_p) = (Pack::<V>::splat(0.0), Pack::<V>::splat(0.0));
            for j in 0..count {
                to_q = to_q + phi[j * height + i] * Pack::splat(x[j]);
                to_p = to_p + dual[j * height + i] * Pack::splat(y[j]);
            }
            to_q.store(&mut q[8 * i..]);
            to_p.store(&mut p[8 * i..]);
        }
    }
}

/// `out = A x`.
fn spread(matrix: &[f64], x: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for (column, x) in matrix.chunks_exact(out.len()).zip(x) {
        for (out, a) in out.iter_mut().zip(column) {
            *out += a * x;
        }
    }
}

/// `out = A^T x`.
fn gather(matrix: &[f64], x: &[f64], out: &mut [f64]) {
    for (column, out) in matrix.chunks_exact(x.len()).zip(out) {
        *out = column.iter().zip(x).map(|(a, x)| a * x).sum();
    }
}

/// `A B`, column by column.
fn product(n: usize, a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; n * n];
    for (column, b) in out.chunks_exact_mut(n).zip(b.chunks_exact(n)) {
        spread(a, b, column);
    }
    out
}

/// `A^T B`, column by column.
fn transposed_product(n: usize, a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; n * n];
    for (column, b) in out.chunks_exact_mut(n).zip(b.chunks_exact(n)) {
        gather(a, b, column);
    }
    out
}

/// Squares of frequencies and mass-normalised shapes, ascending: `K = F^T F` with a row of F for each
/// way an element deforms, so that the soft modes are as exact as the stiff ones.
fn modes(beam: &Beam, mass: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let N = 3 * beam.nodes();
    let deformations = beam.elastic().deformations();
    let rows = deformations.len() / N;
    // L of the mass, column by column.
    let mut lower = mass.to_vec();
    for j in 0..N {
        for k in 0..j {
            let factor = lower[N * k + j];
            for i in j..N {
                lower[N * j + i] -= factor * lower[N * k + i];
            }
        }
        let pivot = lower[N * j + j].sqrt();
        lower[N * j + j..N * (j + 1)].iter_mut().for_each(|x| *x /= pivot);
    }
    // F L^-T: row by row solved with L; kept column by column.
    let mut a = vec![0.0; rows * N];
    for (r, row) in deformations.chunks_exact(N).enumerate() {
        let mut x = row.to_vec();
        for j in 0..N {
            x[j] /= lower[N * j + j];
            for i in j + 1..N {
                x[i] -= lower[N * j + i] * x[j];
            }
            a[rows * j + r] = x[j];
        }
    }
    let mut v: Vec<f64> = (0..N * N).map(|at| if at / N == at % N { 1.0 } else { 0.0 }).collect();
    jacobi::orthogonalise(rows, &mut a, &mut v);
    let size = |column: &[f64]| column.iter().map(|x| x * x).sum::<f64>();
    let mut order: Vec<(f64, usize)> =
        a.chunks_exact(rows).enumerate().map(|(j, column)| (size(column), j)).collect();
    order.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut shapes = Vec::with_capacity(N * N);
    for (_, j) in &order {
        // Phi = L^-T V
        let mut x = v[N * j..][..N].to_vec();
        for i in (0..N).rev() {
            let sum: f64 = (i + 1..N).map(|k| lower[N * i + k] * x[k]).sum();
            x[i] = (x[i] - sum) / lower[N * i + i];
        }
        shapes.extend(x);
    }
    (order.into_iter().map(|(square, _)| square).collect(), shapes)
}
