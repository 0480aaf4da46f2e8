//! Kinematics, forces and energy at a state.

use super::arrays::Fields;
use super::elastic::Ends;
use super::loads::Applied;
use super::{Beam, Coupling, Hub};
use crate::error::{Error, Result};
use crate::system::{Flow, Hamiltonian};

/// What follows from displacements alone.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// Couplings of `q'` to the rates of the angles: `c`, or `c1` and `c2`.
    pub columns: [Fields; 2],
    /// Inertia of the angles.
    pub inertia: [[f64; 2]; 2],
    /// `Q q`, or `(M - D1) q` with a joint.
    outward: Fields,
    /// `s_u - D0 q`: how the first moment along the beam changes.
    shortened: Fields,
    /// First moments of mass along the beam and across it.
    first: [f64; 2],
    spare: Fields,
}

/// Rates of displacements and angles, and the rotation of the beam's frame.
#[derive(Clone, Debug)]
pub struct Rates {
    /// `q'`.
    pub w: Fields,
    /// `phi1'`, `phi2'`; the prescribed one first.
    pub angles: [f64; 2],
}

impl Rates {
    /// `theta'`.
    pub fn theta(&self) -> f64 {
        self.angles[0] + self.angles[1]
    }
}

/// Generalised forces and what they do.
#[derive(Clone, Copy, Debug, Default)]
pub struct HubForces {
    /// On the angles.
    pub angles: [f64; 2],
    /// Power of torques, loads and prescribed rotation.
    pub power: f64,
    /// Power lost to damping.
    pub loss: f64,
}

/// Work space for one state at a time.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Displacements.
    pub q: Fields,
    /// Angles; the prescribed one first.
    pub phi: [f64; 2],
    /// Acceleration of a prescribed rotation.
    pub acceleration: f64,
    /// What follows from the two.
    pub geometry: Geometry,
    /// Rates.
    pub rates: Rates,
    /// Forces on `q`.
    pub forces: Fields,
    /// `M^-1` times the columns.
    pub solved: [Fields; 2],
    state: Vec<f64>,
    ends: Ends,
    spare: [Fields; 2],
    applied: Applied,
}

impl Geometry {
    fn new(nodes: usize) -> Geometry {
        let zeros = || Fields::zeros(nodes);
        Geometry {
            columns: [zeros(), zeros()],
            inertia: [[0.0; 2]; 2],
            outward: zeros(),
            shortened: zeros(),
            first: [0.0; 2],
            spare: zeros(),
        }
    }

    /// BEAM's arrays at `q` and `phi2`.
    fn update(&mut self, beam: &Beam, q: &Fields, phi2: f64) {
        let [m0, m1, j0] = beam.moments;
        let R = beam.parameters.radius;
        beam.apply_gyroscopic(q, &mut self.spare);
        beam.apply_outward(q, &mut self.outward);
        // c = a + G^T q.
        self.columns[0].set(&beam.a, -1.0, &self.spare);
        let square = 2.0 * beam.b.dot(q) + q.dot(&self.outward);
        if beam.needs_shortening() {
            self.spare.u.fill(0.0);
            beam.apply_shortening(q, &mut self.spare);
            self.shortened.set(&beam.along, -beam.shortens, &self.spare);
            let lost = beam.shortens * q.dot(&self.spare);
            self.first = [m1 + beam.along.dot(q) - 0.5 * lost, beam.across.dot(q)];
        }
        match beam.parameters.hub {
            Hub::Driven(_) => self.inertia[0][0] = j0 + 2.0 * R * m1 + R * R * m0 + square,
            Hub::Locked { inertia } => {
                self.inertia[0][0] = inertia + j0 + 2.0 * R * m1 + R * R * m0 + square;
            }
            Hub::Jointed { inertia, .. } => {
                let (sin, cos) = libm::sincos(phi2);
                let [one, two] = &mut self.columns;
                two.copy(one);
                one.add(R * cos, &beam.across);
                one.add(R * sin, &self.shortened);
                let J = j0 + square;
                let e = R * (cos * self.first[0] - sin * self.first[1]);
                self.inertia = [[inertia + m0 * R * R + J + 2.0 * e, J + e], [J + e, J]];
            }
        }
    }
}

impl Motion {
    /// For this beam.
    pub fn new(beam: &Beam) -> Motion {
        let zeros = || Fields::zeros(beam.nodes);
        Motion {
            q: zeros(),
            phi: [0.0; 2],
            acceleration: 0.0,
            geometry: Geometry::new(beam.nodes),
            rates: Rates { w: zeros(), angles: [0.0; 2] },
            forces: zeros(),
            solved: [zeros(), zeros()],
            state: vec![0.0; 2 * beam.dof()],
            ends: Ends::new(beam.nodes),
            spare: [zeros(), zeros()],
            applied: Applied::default(),
        }
    }

    /// Takes a prescribed rotation at its time.
    ///
    /// # Errors
    /// What the rotation reports.
    pub fn turn(&mut self, beam: &Beam, t: f64) -> Result<()> {
        if let Hub::Driven(rotation) = &beam.parameters.hub {
            let [angle, speed, acceleration] = rotation.at(t)?;
            (self.phi, self.rates.angles) = ([angle, 0.0], [speed, 0.0]);
            self.acceleration = acceleration;
        }
        Ok(())
    }

    /// Takes displacements and angles, and finds the arrays there.
    pub fn place(&mut self, beam: &Beam) {
        let phi2 = self.phi[1];
        self.geometry.update(beam, &self.q, phi2);
    }

    /// Rates from the momenta in `rates.w` and `angles`; displacements must be placed.
    fn solve_rates(&mut self, beam: &Beam, t: f64, momenta: [f64; 2]) -> Result<()> {
        let count = beam.angles();
        let Motion { geometry, rates, solved, .. } = self;
        if count == 0 {
            // w = M^-1 (p - omega c).
            rates.w.add(-rates.angles[0], &geometry.columns[0]);
            beam.mass.solve(&mut rates.w);
            return Ok(());
        }
        beam.mass.solve(&mut rates.w);
        for (solved, column) in solved.iter_mut().zip(&geometry.columns).take(count) {
            solved.copy(column);
            beam.mass.solve(solved);
        }
        let mut schur = geometry.inertia;
        let mut right = momenta;
        for i in 0..count {
            right[i] -= geometry.columns[i].dot(&rates.w);
            for j in 0..count {
                schur[i][j] -= geometry.columns[i].dot(&solved[j]);
            }
        }
        rates.angles = solve_hub(count, schur, right).ok_or_else(|| beam.indefinite(t, &self.q))?;
        for (rate, solved) in self.rates.angles.iter().zip(&self.solved).take(count) {
            self.rates.w.add(-rate, solved);
        }
        Ok(())
    }

    /// Forces `-dH/dq` in `forces`, and those on the angles: at the place, with the rates.
    ///
    /// # Errors
    /// What loads report.
    pub fn push(&mut self, beam: &Beam, t: f64) -> Result<HubForces> {
        let Motion { q, phi, geometry, rates, forces, ends, spare, applied, .. } = self;
        let super::Parameters { hub, radius: R, ground_spring, gravity, damping, .. } =
            &beam.parameters;
        let [one, _] = rates.angles;
        let theta_rate = rates.theta();
        let mut found = HubForces::default();
        // theta' G q' + theta'^2 (b + Q q)
        let [turning, other] = spare;
        beam.apply_gyroscopic(&rates.w, turning);
        forces.set(&geometry.outward, 1.0, &beam.b);
        let square = theta_rate * theta_rate;
        scale_and_add(forces, square, theta_rate, turning);
        beam.elastic.subtract_forces(1.0, q, ends, forces);
        if let Hub::Jointed { spring, .. } = hub {
            let (sin, cos) = libm::sincos(phi[1]);
            forces.add(R * one * cos * theta_rate, &geometry.shortened);
            forces.add(-R * one * sin * theta_rate, &beam.across);
            other.u.fill(0.0);
            beam.apply_shortening(&rates.w, other);
            forces.add(-R * one * sin * beam.shortens, other);
            let [along, across] = geometry.first;
            let turned = beam.across.dot(&rates.w) + theta_rate * along;
            let stretched = geometry.shortened.dot(&rates.w) - theta_rate * across;
            found.angles[1] = R * one * (cos * stretched - sin * turned) - spring * phi[1];
        }
        if *damping != [0.0; 2] {
            let [alpha, beta] = *damping;
            beam.apply_mass(&rates.w, turning);
            other.copy(turning);
            scale_and_add(other, -alpha, 0.0, turning);
            beam.elastic.subtract_linear(beta, &rates.w, ends, other);
            found.loss = -rates.w.dot(other);
            forces.add(1.0, other);
        }
        found.angles[0] -= ground_spring * phi[0];
        let angle = phi[0] + phi[1];
        let mut by_gravity = [0.0; 2];
        if *gravity != [0.0; 2] {
            let [x, y] = turned(*gravity, -angle);
            let [along, across] = geometry.first;
            forces.add(x, &geometry.shortened);
            forces.add(y, &beam.across);
            let moment = along * y - across * x;
            let [_, at_hub] = turned(*gravity, -phi[0]);
            by_gravity = [moment + beam.moments[0] * R * at_hub, moment];
            found.angles[0] += by_gravity[0];
            found.angles[1] += by_gravity[1];
        }
        if let Some(loads) = &beam.parameters.loads {
            loads.at(t, &self.state, applied)?;
            other.clear();
            let moments = beam.add_loads(applied, loads.follow(), q, *phi, other);
            let torques = [moments[0] + applied.hub, moments[1] + applied.joint];
            forces.add(1.0, other);
            found.power += rates.w.dot(other);
            if beam.angles() > 0 {
                let count = beam.angles();
                for i in 0..count {
                    found.angles[i] += torques[i];
                    found.power += torques[i] * rates.angles[i];
                }
            }
        }
        if beam.angles() == 0 {
            // The explicit rate of the energy under a prescribed rotation.
            let swing = geometry.columns[0].dot(&rates.w) + one * geometry.inertia[0][0];
            found.power -= self.acceleration * swing + one * by_gravity[0];
        }
        Ok(found)
    }

    /// The state that loads may ask for.
    pub fn see(&mut self, z: &[f64]) {
        self.state.copy_from_slice(z);
    }

    /// `out <- G w + 2 theta' (b + Q q)`: how forces change with the rotation.
    pub fn swing(&self, beam: &Beam, out: &mut Fields) {
        let twice = 2.0 * self.rates.theta();
        beam.apply_gyroscopic(&self.rates.w, out);
        out.add(twice, &beam.b);
        out.add(twice, &self.geometry.outward);
    }

    /// Rates of a state in place of those here; turns and places.
    ///
    /// # Errors
    /// A mass matrix that is not positive definite; what a rotation reports.
    pub fn start(&mut self, beam: &Beam, t: f64, z: &[f64]) -> Result<()> {
        let momenta = self.take(beam, t, z)?;
        self.solve_rates(beam, t, momenta)
    }

    /// Whether the mass matrix is positive definite at the place.
    ///
    /// # Errors
    /// The error that says it is not.
    pub fn check(&mut self, beam: &Beam, t: f64) -> Result<()> {
        let count = beam.angles();
        let Motion { geometry, solved, .. } = self;
        let mut schur = geometry.inertia;
        for j in 0..count {
            solved[j].copy(&geometry.columns[j]);
            beam.mass.solve(&mut solved[j]);
            for i in 0..count {
                schur[i][j] -= geometry.columns[i].dot(&solved[j]);
            }
        }
        match count == 0 || solve_hub(count, schur, [0.0; 2]).is_some() {
            true => Ok(()),
            false => Err(beam.indefinite(t, &self.q)),
        }
    }

    /// Reads a state, turns and places.
    fn take(&mut self, beam: &Beam, t: f64, z: &[f64]) -> Result<[f64; 2]> {
        let (n, count) = (3 * beam.nodes, beam.angles());
        let dof = n + count;
        self.q.read(&z[..n]);
        self.rates.w.read(&z[dof..dof + n]);
        let mut momenta = [0.0; 2];
        self.phi[..count].copy_from_slice(&z[n..dof]);
        momenta[..count].copy_from_slice(&z[dof + n..2 * dof]);
        self.state.copy_from_slice(&z[..2 * dof]);
        self.turn(beam, t)?;
        self.place(beam);
        Ok(momenta)
    }

    /// Kinetic and potential energy at the place, with the rates.
    pub fn energies(&mut self, beam: &Beam) -> [f64; 2] {
        let Motion { q, phi, geometry, rates, spare: [moved, _], .. } = self;
        let super::Parameters { hub, radius, ground_spring, gravity, .. } = &beam.parameters;
        beam.apply_mass(&rates.w, moved);
        let [one, two] = rates.angles;
        let mut kinetic = 0.5 * rates.w.dot(moved);
        match hub {
            Hub::Driven(_) => kinetic -= 0.5 * one * one * geometry.inertia[0][0],
            Hub::Locked { .. } => {
                kinetic += one * geometry.columns[0].dot(&rates.w)
                    + 0.5 * one * one * geometry.inertia[0][0];
            }
            Hub::Jointed { .. } => {
                kinetic += one * geometry.columns[0].dot(&rates.w)
                    + two * geometry.columns[1].dot(&rates.w);
                let [[m11, m12], [_, m22]] = geometry.inertia;
                kinetic += 0.5 * (one * one * m11 + two * two * m22) + one * two * m12;
            }
        }
        let mut potential = beam.elastic.energy(q) + 0.5 * ground_spring * phi[0] * phi[0];
        if let Hub::Jointed { spring, .. } = hub {
            potential += 0.5 * spring * phi[1] * phi[1];
        }
        if *gravity != [0.0; 2] {
            let [x, y] = turned(*gravity, -(phi[0] + phi[1]));
            let [at_hub, _] = turned(*gravity, -phi[0]);
            let [along, across] = geometry.first;
            potential -= beam.moments[0] * radius * at_hub + along * x + across * y;
        }
        [kinetic, potential]
    }
}

impl Fields {
    fn clear(&mut self) {
        self.parts_mut().into_iter().for_each(|part| part.fill(0.0));
    }
}

/// `out <- k out + l x`.
fn scale_and_add(out: &mut Fields, k: f64, l: f64, x: &Fields) {
    for (out, x) in out.parts_mut().into_iter().zip(x.parts()) {
        for (out, x) in out.iter_mut().zip(x) {
            *out = k * *out + l * x;
        }
    }
}

/// A vector turned by an angle.
fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(angle);
    [x * cos - y * sin, x * sin + y * cos]
}

/// Solves for the rates of the angles; `None` where the matrix is not positive definite.
pub fn solve_hub(count: usize, m: [[f64; 2]; 2], right: [f64; 2]) -> Option<[f64; 2]> {
    let positive = |x: f64| x > 0.0;
    if count == 1 {
        return positive(m[0][0]).then(|| [right[0] / m[0][0], 0.0]);
    }
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    (positive(m[0][0]) && positive(determinant)).then(|| {
        [
            (m[1][1] * right[0] - m[0][1] * right[1]) / determinant,
            (m[0][0] * right[1] - m[1][0] * right[0]) / determinant,
        ]
    })
}

/// `integral of v'^2` and of `(1 - x) v'^2` over an element of length 1, in chord, a, b.
const EVEN: [[f64; 3]; 3] =
    [[1.0, 0.0, 0.0], [0.0, 2.0 / 15.0, -1.0 / 30.0], [0.0, -1.0 / 30.0, 2.0 / 15.0]];
const INBOARD: [[f64; 3]; 3] = [
    [0.5, 1.0 / 12.0, -1.0 / 12.0],
    [1.0 / 12.0, 0.1, -1.0 / 60.0],
    [-1.0 / 12.0, -1.0 / 60.0, 1.0 / 30.0],
];

impl Beam {
    fn needs_shortening(&self) -> bool {
        matches!(self.parameters.hub, Hub::Jointed { .. }) || self.parameters.gravity != [0.0; 2]
    }

    /// Adds the generalised forces of loads on `q`; those on the angles.
    fn add_loads(
        &self,
        applied: &Applied,
        follow: bool,
        q: &Fields,
        phi: [f64; 2],
        out: &mut Fields,
    ) -> [f64; 2] {
        use super::arrays::PAD;
        let l = self.elastic.length();
        let angle = phi[0] + phi[1];
        // Axes of the beam; a load that follows turns with the slope of its section.
        let direct = |force: [f64; 2], slope: f64| match follow {
            true => turned(force, slope),
            false => turned(force, -angle),
        };
        let last = PAD + self.nodes - 1;
        let [mut pull, mut lift] = direct(applied.tip, q.theta[last]);
        out.u[last] += pull;
        out.v[last] += lift;
        let reach = l * self.nodes as f64 + q.u[last];
        let mut moment = reach * lift - q.v[last] * pull;
        let mut total = [pull, lift];
        for e in (0..self.nodes).rev() {
            let i = PAD + e;
            let chord = (q.v[i] - q.v[i - 1]) / l;
            let bent = [chord, q.theta[i - 1] - chord, q.theta[i] - chord];
            let [along, across] = match applied.distributed.get(e) {
                Some(force) => direct(*force, chord),
                None => [0.0; 2],
            };
            // Shortening lets forces along the beam do work: -1/2 integral of tension v'^2.
            let mut slopes = [0.0; 3];
            let mut raised = 0.0;
            for r in 0..3 {
                for c in 0..3 {
                    let (even, inboard) = (l * EVEN[r][c], l * l * INBOARD[r][c]);
                    slopes[r] -= (pull * even + along * inboard) * bent[c];
                    raised -= 0.5 * bent[r] * (lift * even + across * inboard) * bent[c];
                }
            }
            let slopes = slopes.map(|x| self.shortens * x);
            moment += self.shortens * raised;
            let shear = (slopes[0] - slopes[1] - slopes[2]) / l;
            let (half, twelfth) = (0.5 * l, l * l / 12.0);
            out.u[i] += half * along;
            out.v[i] += shear + half * across;
            out.theta[i] += slopes[2] - twelfth * across;
            if e > 0 {
                out.u[i - 1] += half * along;
                out.v[i - 1] += half * across - shear;
                out.theta[i - 1] += slopes[1] + twelfth * across;
            }
            let middle = l * (e as f64 + 0.5) + 0.5 * (q.u[i] + q.u[i - 1]);
            let area = half * (q.v[i] + q.v[i - 1]) + twelfth * (q.theta[i - 1] - q.theta[i]);
            moment += l * across * middle - along * area;
            // The axial shape functions weigh both ends alike.
            pull += l * along;
            lift += l * across;
            total = [pull, lift];
        }
        let [_, at_hub] = turned(total, phi[1]);
        [moment + self.parameters.radius * at_hub, moment]
    }

    /// The error for a mass matrix that is no longer positive definite.
    pub fn indefinite(&self, t: f64, q: &Fields) -> Box<Error> {
        let last = super::arrays::PAD + self.nodes - 1;
        let ratio = q.v[last].abs() / (self.elastic.length() * self.nodes as f64);
        let inertia = match self.parameters.hub {
            Hub::Locked { inertia } | Hub::Jointed { inertia, .. } => inertia,
            Hub::Driven(_) => 0.0,
        };
        let cure = match self.parameters.coupling {
            Coupling::First => {
                "the deflection is beyond first-order coupling, and \
                 coupling=\"third\" goes further, or the step is too large"
            }
            _ => "reduce the step, or raise the hub's inertia",
        };
        Box::new(Error::Model {
            message: format!(
                "beam: the mass matrix is no longer positive definite at t = {t:.6} s (coupling \
                 \"{}\", hub inertia {inertia:.3e} kg m^2, tip deflection v/L = {ratio:.3}); {cure}",
                self.parameters.coupling.name()
            ),
            t,
            step: 0,
        })
    }

    /// The error for a step whose matrix is not positive definite.
    pub fn unstable(&self, t: f64, theta: f64) -> Box<Error> {
        Box::new(Error::Model {
            message: format!(
                "beam: the tangent stiffness of a step is not positive definite at t = {t:.6} s, \
                 where the beam turns at {theta:.4} rad/s: it buckles, or spins too fast for its \
                 coupling"
            ),
            t,
            step: 0,
        })
    }

    /// Runs with work space of the beam's own.
    fn with_motion<R>(&self, run: impl FnOnce(&mut Motion) -> R) -> R {
        let kept = self.spare.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).pop();
        let mut motion = kept.unwrap_or_else(|| Motion::new(self));
        let result = run(&mut motion);
        self.spare.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(motion);
        result
    }

    /// Shows rates `q'` and the first angle's of a state.
    ///
    /// # Errors
    /// As [`Flow::rate`].
    pub fn start(&self, t: f64, z: &[f64], show: impl FnOnce(&[f64], f64)) -> Result<()> {
        self.with_motion(|motion| {
            motion.start(self, t, z)?;
            let mut w = vec![0.0; 3 * self.nodes];
            motion.rates.w.write(&mut w);
            show(&w, motion.rates.angles[0]);
            Ok(())
        })
    }

    /// As [`indefinite`](Self::indefinite), at displacements `u1 v1 theta1 u2 ..`.
    pub fn indefinite_at(&self, t: f64, q: &[f64]) -> Box<Error> {
        let mut fields = Fields::zeros(self.nodes);
        fields.read(q);
        self.indefinite(t, &fields)
    }

    /// Momenta of displacements, angles and rates, `[q; phi; q'; phi']`, in place of the rates.
    ///
    /// # Errors
    /// What a prescribed rotation reports.
    pub fn momenta(&self, t: f64, z: &mut [f64]) -> Result<()> {
        self.with_motion(|motion| {
            let (n, count) = (3 * self.nodes, self.angles());
            let rates = motion.take(self, t, z)?;
            if count > 0 {
                motion.rates.angles = rates;
            }
            let Motion { geometry, rates, spare: [p, _], .. } = motion;
            self.apply_mass(&rates.w, p);
            for j in 0..count.max(1) {
                p.add(rates.angles[j], &geometry.columns[j]);
            }
            let dof = n + count;
            p.write(&mut z[dof..dof + n]);
            for i in 0..count {
                let mut momentum = geometry.columns[i].dot(&rates.w);
                for j in 0..count {
                    momentum += geometry.inertia[i][j] * rates.angles[j];
                }
                z[dof + n + i] = momentum;
            }
            Ok(())
        })
    }

    /// Kinetic and potential energy of a state.
    ///
    /// # Errors
    /// As [`Flow::rate`].
    pub fn energies(&self, t: f64, z: &[f64]) -> Result<[f64; 2]> {
        self.with_motion(|motion| {
            let momenta = motion.take(self, t, z)?;
            motion.solve_rates(self, t, momenta)?;
            Ok(motion.energies(self))
        })
    }

    /// Rates `[q'; phi']` of a state; the prescribed speed is not among them.
    ///
    /// # Errors
    /// As [`Flow::rate`].
    pub fn rates(&self, t: f64, z: &[f64], out: &mut [f64]) -> Result<()> {
        self.with_motion(|motion| {
            let n = 3 * self.nodes;
            let momenta = motion.take(self, t, z)?;
            motion.solve_rates(self, t, momenta)?;
            motion.rates.w.write(&mut out[..n]);
            out[n..].copy_from_slice(&motion.rates.angles[..self.angles()]);
            Ok(())
        })
    }
}

impl Flow for Beam {
    fn len(&self) -> usize {
        2 * self.dof() + if self.keeps_books() { 2 } else { 0 }
    }

    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.with_motion(|motion| {
            let (n, dof, count) = (3 * self.nodes, self.dof(), self.angles());
            let momenta = motion.take(self, t, z)?;
            motion.solve_rates(self, t, momenta)?;
            let found = motion.push(self, t)?;
            motion.rates.w.write(&mut f[..n]);
            f[n..dof].copy_from_slice(&motion.rates.angles[..count]);
            motion.forces.write(&mut f[dof..dof + n]);
            f[dof + n..2 * dof].copy_from_slice(&found.angles[..count]);
            if self.keeps_books() {
                f[2 * dof..].copy_from_slice(&[found.power, found.loss]);
            }
            Ok(())
        })
    }
}

impl Hamiltonian for Beam {
    fn energy(&self, t: f64, z: &[f64]) -> Result<f64> {
        self.with_motion(|motion| {
            let momenta = motion.take(self, t, z)?;
            motion.solve_rates(self, t, momenta)?;
            let [kinetic, potential] = motion.energies(self);
            Ok(kinetic + potential)
        })
    }
}
