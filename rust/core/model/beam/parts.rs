//! The beam on a free hub as `z' = A z + F(z)`: A is what holds at rest, hub included, and so singular; F
//! is formed without the difference of the two.
//!
//! With `x = M^-1 c`, `sigma = m - c.x` and zeros for what they are at rest, `theta' = (p_theta - c.M^-1 p) / sigma`
//! differs from its linear part by `-(g.M^-1 p + theta0' (sigma - sigma0)) / sigma`, `g = G^T q`.

use std::sync::{Arc, Mutex};

use super::arrays::Fields;
use super::{Beam, Hub};
use crate::error::Result;
use crate::system::{Flow, SemiLinear};

/// A beam and its linear part.
pub struct BeamParts {
    beam: Arc<Beam>,
    matrix: Vec<f64>,
    /// `M^-1 a` and sigma at rest.
    solved: Fields,
    sigma: f64,
    /// Work space, as much as threads have asked for at once.
    spare: Mutex<Vec<[Fields; 6]>>,
}

impl Beam {
    /// Whether [`BeamParts`] covers it.
    pub fn has_parts(&self) -> bool {
        matches!(self.parameters.hub, Hub::Locked { .. }) && self.is_plain() && !self.keeps_books()
    }
}

impl BeamParts {
    /// The parts of a beam that has them.
    pub fn new(beam: Arc<Beam>) -> Option<BeamParts> {
        if !beam.has_parts() {
            return None;
        }
        let mut solved = beam.a.clone();
        beam.mass.solve(&mut solved);
        let sigma = beam.inertia() - beam.a.dot(&solved);
        let matrix = at_rest(&beam)?;
        Some(BeamParts { beam, matrix, solved, sigma, spare: Mutex::default() })
    }
}

/// `A = [0 P; R 0]`, row by row: rates of states so small that all but linear terms vanish.
fn at_rest(beam: &Beam) -> Option<Vec<f64>> {
    const SMALL: f64 = 1.0 / (1_u128 << 100) as f64;
    let (m, n) = (beam.len(), beam.dof());
    let mut matrix = vec![0.0; m * m];
    let (mut z, mut f) = (vec![0.0; m], vec![0.0; m]);
    for j in 0..m {
        z[j] = SMALL;
        beam.rate(0.0, &z, &mut f).ok()?;
        z[j] = 0.0;
        for i in (0..m).filter(|i| (*i < n) != (j < n)) {
            matrix[m * i + j] = f[i] / SMALL;
        }
    }
    for (rows, columns) in [(0, n), (n, 0)] {
        for i in 0..n {
            for j in 0..i {
                let at = [m * (rows + i) + columns + j, m * (rows + j) + columns + i];
                let mean = 0.5 * (matrix[at[0]] + matrix[at[1]]);
                at.into_iter().for_each(|at| matrix[at] = mean);
            }
        }
    }
    Some(matrix)
}

impl Flow for BeamParts {
    fn len(&self) -> usize {
        self.beam.len()
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.beam.rate(t, z, f)
    }
    fn linear(&self) -> Option<&[f64]> {
        Some(&self.matrix)
    }
}

impl SemiLinear for BeamParts {
    fn matrix(&self) -> &[f64] {
        &self.matrix
    }

    fn remainder(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        let beam = &*self.beam;
        let (n, dof) = (3 * beam.nodes, beam.dof());
        let kept = self.spare.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).pop();
        let mut work = kept.unwrap_or_else(|| [(); 6].map(|()| Fields::zeros(beam.nodes)));
        let [q, w, g, moved, outward, out] = &mut work;
        q.read(&z[..n]);
        w.read(&z[dof..dof + n]);
        beam.mass.solve(w);
        beam.apply_gyroscopic(q, out);
        // g = G^T q
        g.parts_mut().into_iter().for_each(|part| part.fill(0.0));
        g.add(-1.0, out);
        moved.copy(g);
        beam.mass.solve(moved);
        beam.apply_outward(q, outward);
        let more = 2.0 * beam.b.dot(q) + q.dot(outward) - 2.0 * self.solved.dot(g) - g.dot(moved);
        let sigma = self.sigma + more;
        let found = if sigma > 0.0 { Ok(()) } else { Err(beam.indefinite(t, q)) };
        let linear = (z[dof + n] - beam.a.dot(w)) / self.sigma;
        let rest = -(g.dot(w) + linear * more) / sigma;
        let theta = linear + rest;
        // w = M^-1 p - theta' (x0 + M^-1 g)
        out.set(&self.solved, 0.0, g);
        out.parts_mut().into_iter().flatten().for_each(|x| *x *= -rest);
        out.add(-theta, moved);
        out.write(&mut f[..n]);
        w.add(-theta, &self.solved);
        w.add(-theta, moved);
        // theta' G q' + theta'^2 (b + Q q)
        beam.apply_gyroscopic(w, out);
        outward.add(1.0, &beam.b);
        out.parts_mut().into_iter().flatten().for_each(|x| *x *= theta);
        out.add(theta * theta, outward);
        out.write(&mut f[dof..dof + n]);
        (f[n], f[dof + n]) = (rest, 0.0);
        self.spare.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(work);
        found
    }
}
