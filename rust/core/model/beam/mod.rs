//! A flexible beam on a rotating hub, by finite elements: Huang, Deng & Yao (2007), eqs. 1-23.
//!
//! The hub turns by `phi1`, the beam relative to it by `phi2` (which may be locked), so that the beam's
//! frame is at `theta = phi1 + phi2`. In that frame a node has axial and transverse displacement and
//! slope, `q = (u, v, theta)` node by node. With rates as primes,
//!
//! `T = 1/2 q'^T M q' + q'.(c1 phi1' + c2 phi2') + 1/2 phi'^T m phi'`, `c2 = a_v - G q`, and momenta `p`
//! are its derivatives; the state is `z = [q; phi; p]`. Where the rotation is prescribed there are no
//! angles in the state, and the energy is that of the motion relative to it.

mod arrays;
mod chain;
mod elastic;
mod factor;
mod loads;
mod modal;
mod motion;
mod parts;
mod rotation;

use std::sync::{Arc, Mutex};

pub use arrays::at;
pub use arrays::{Across, Blocks, Fields, PAD, Skew, Symmetric, Tridiagonal};
pub use chain::Chain;
pub use elastic::{Elastic, Ends, POINTS, Tangents};
pub use factor::Factor;
pub use loads::{Applied, Loads};
pub use modal::{FEW, Frame, Modal};
pub use motion::{Geometry, HubForces, Motion, Rates, solve_hub};
pub use parts::BeamParts;
pub use rotation::{Prescribed, SpinUp, Table};

use crate::error::{Error, Result};
use crate::linalg::kernel::dispatch;

/// How rotation and deflection are coupled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coupling {
    /// No foreshortening: softens with spin. For comparison.
    Zeroth,
    /// Foreshortening to first order, the paper's.
    First,
    /// Exact kinetic energy, elastic energy to third order.
    Third,
}

impl Coupling {
    /// The name in calls.
    pub fn name(self) -> &'static str {
        match self {
            Coupling::Zeroth => "zoac",
            Coupling::First => "foac",
            Coupling::Third => "third",
        }
    }
}

/// How the hub moves.
#[derive(Clone)]
pub enum Hub {
    /// Freely, with the beam fixed to it.
    Locked {
        /// Rotary inertia, kg m^2.
        inertia: f64,
    },
    /// Freely, with the beam on a spring.
    Jointed {
        /// Rotary inertia, kg m^2.
        inertia: f64,
        /// Stiffness of the spring, N m/rad.
        spring: f64,
    },
    /// As prescribed.
    Driven(Arc<dyn Prescribed>),
}

/// Matrices of elements and totals, as finite elements give them; nodes left then right.
pub struct Elements {
    /// Length of each, m.
    pub length: f64,
    /// `integral of N_u N_u^T dm`.
    pub axial_mass: Vec<[[f64; 2]; 2]>,
    /// `integral of N_v N_v^T dm`.
    pub bending_mass: Vec<[[f64; 4]; 4]>,
    /// `integral of N_u N_v^T dm`.
    pub gyroscopic: Vec<[[f64; 4]; 2]>,
    /// `integral of g0 N_v' N_v'^T`, `g0` the mass outboard.
    pub shortening: Vec<[[f64; 4]; 4]>,
    /// `integral of g1 N_v' N_v'^T`, `g1` the first moment of the mass outboard.
    pub pull: Vec<[[f64; 4]; 4]>,
    /// `integral of N_u dm`.
    pub axial: Vec<[f64; 2]>,
    /// `integral of x N_u dm`.
    pub axial_moment: Vec<[f64; 2]>,
    /// `integral of N_v dm`.
    pub bending: Vec<[f64; 4]>,
    /// `integral of x N_v dm`.
    pub bending_moment: Vec<[f64; 4]>,
    /// Mean `EA`, N.
    pub axial_stiffness: Vec<f64>,
    /// `EI` at the Gauss points, N m^2.
    pub bending_stiffness: Vec<[f64; POINTS]>,
    /// Gauss points in (0, 1) and weights.
    pub rule: [[f64; POINTS]; 2],
    /// `integral of dm`, `x dm` and `x^2 dm`, tip mass included.
    pub moments: [f64; 3],
    /// Rotary inertia of the tip, in the masses already, kg m^2.
    pub tip_inertia: f64,
}

/// Everything else.
pub struct Parameters {
    /// How the hub moves.
    pub hub: Hub,
    /// Radius of the hub, m.
    pub radius: f64,
    /// Stiffness of the spring between hub and ground, N m/rad.
    pub ground_spring: f64,
    /// The coupling.
    pub coupling: Coupling,
    /// Gravity along x and y, m/s^2.
    pub gravity: [f64; 2],
    /// Damping `alpha M + beta K`.
    pub damping: [f64; 2],
    /// What acts from outside.
    pub loads: Option<Arc<dyn Loads>>,
}

/// The beam on its hub.
pub struct Beam {
    nodes: usize,
    parameters: Parameters,
    /// 1 with foreshortening, 0 without.
    shortens: f64,
    axial_mass: Tridiagonal,
    bending_mass: Blocks,
    gyroscopic: Skew,
    /// On `v` and `theta`, with the axial mass: what `theta'^2` pushes outward; Q where there is no
    /// joint, `M - D1` where there is.
    outward: Blocks,
    /// `D0`, without the factor for no foreshortening.
    shortening: Blocks,
    /// Integrals of the shape functions: `s_u` along the beam, `s_v` across it.
    along: Fields,
    across: Fields,
    /// The same times x, plus the radius times them where there is no joint: `b` and `a`.
    b: Fields,
    a: Fields,
    moments: [f64; 3],
    elastic: Elastic,
    mass: Factor,
    fastest: f64,
    /// Work space for evaluations from outside a method, as many as threads have asked at once.
    spare: Mutex<Vec<Motion>>,
}

impl Beam {
    /// Assembles elements.
    ///
    /// # Errors
    /// [`Error::Argument`] for sizes that do not match, or a mass that is not positive definite.
    pub fn new(elements: &Elements, parameters: Parameters) -> Result<Beam> {
        let nodes = elements.axial_mass.len();
        let sizes = [
            elements.bending_mass.len(),
            elements.gyroscopic.len(),
            elements.shortening.len(),
            elements.pull.len(),
            elements.axial.len(),
            elements.axial_moment.len(),
            elements.bending.len(),
            elements.bending_moment.len(),
            elements.axial_stiffness.len(),
            elements.bending_stiffness.len(),
        ];
        if nodes == 0 || sizes.iter().any(|len| *len != nodes) {
            return Err(Error::argument("beam: arrays of elements differ in length"));
        }
        let coupling = parameters.coupling;
        let shortens = if coupling == Coupling::First { 1.0 } else { 0.0 };
        let mut axial_mass = Tridiagonal::zeros(nodes);
        axial_mass.assemble(&elements.axial_mass);
        let mut bending_mass = Blocks::zeros(nodes);
        bending_mass.assemble(1.0, &elements.bending_mass);
        let mut shortening = Blocks::zeros(nodes);
        shortening.assemble(1.0, &elements.shortening);
        let locked = !matches!(parameters.hub, Hub::Jointed { .. });
        let radius = if locked { parameters.radius } else { 0.0 };
        let mut outward = bending_mass.clone();
        outward.assemble(-shortens, &elements.pull);
        outward.assemble(-shortens * radius, &elements.shortening);
        // What turns with its section is not flung outward by the turning.
        outward.own[2][PAD + nodes - 1] -= elements.tip_inertia;
        let (along, across) = moments(nodes, &elements.axial, &elements.bending);
        let (mut b, mut a) = moments(nodes, &elements.axial_moment, &elements.bending_moment);
        b.add(radius, &along);
        a.add(radius, &across);
        let elastic = Elastic::new(
            elements.length,
            coupling,
            &elements.axial_stiffness,
            &elements.bending_stiffness,
            elements.rule,
        );
        let mass = Factor::new(nodes, &axial_mass, &bending_mass)
            .ok_or_else(|| Error::argument("beam: the mass matrix is not positive definite"))?;
        let fastest = fastest(nodes, &mass, &elastic);
        Ok(Beam {
            nodes,
            shortens,
            axial_mass,
            bending_mass,
            gyroscopic: Skew::assembled(nodes, &elements.gyroscopic),
            outward,
            shortening,
            along,
            across,
            b,
            a,
            moments: elements.moments,
            elastic,
            mass,
            fastest,
            spare: Mutex::default(),
            parameters,
        })
    }

    /// Nodes but the clamped one, as many as elements.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Angles in the state: 0, 1 or 2.
    pub fn angles(&self) -> usize {
        match self.parameters.hub {
            Hub::Driven(_) => 0,
            Hub::Locked { .. } => 1,
            Hub::Jointed { .. } => 2,
        }
    }

    /// Degrees of freedom.
    pub fn dof(&self) -> usize {
        3 * self.nodes + self.angles()
    }

    /// Whether work and dissipation are integrated along, as two more components of the state.
    pub fn keeps_books(&self) -> bool {
        let Parameters { hub, damping, loads, .. } = &self.parameters;
        matches!(hub, Hub::Driven(_)) || *damping != [0.0; 2] || loads.is_some()
    }

    /// Whether nothing acts but what the modal form of the beam covers.
    pub fn is_plain(&self) -> bool {
        let Parameters { hub, gravity, loads, coupling, .. } = &self.parameters;
        !matches!(hub, Hub::Jointed { .. })
            && *gravity == [0.0; 2]
            && loads.is_none()
            && *coupling != Coupling::Third
    }

    /// Whether the mass matrix can lose its definiteness: foreshortening takes inertia away.
    pub fn can_degenerate(&self) -> bool {
        self.parameters.coupling == Coupling::First && self.angles() > 0
    }

    /// The parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// G.
    pub fn gyroscopic(&self) -> &Skew {
        &self.gyroscopic
    }

    /// What `theta'^2` pushes outward, on `v` and `theta`.
    pub fn outward(&self) -> &Blocks {
        &self.outward
    }

    /// `a`: how the beam couples to the rotation at rest.
    pub fn lever(&self) -> &Fields {
        &self.a
    }

    /// Inertia of the angle at rest, of a locked joint or a prescribed rotation.
    pub fn inertia(&self) -> f64 {
        let [m0, m1, j0] = self.moments;
        let R = self.parameters.radius;
        let hub = match self.parameters.hub {
            Hub::Locked { inertia } | Hub::Jointed { inertia, .. } => inertia,
            Hub::Driven(_) => 0.0,
        };
        hub + j0 + 2.0 * R * m1 + R * R * m0
    }

    /// `b`, the first moment along the beam times its distance.
    pub fn arm(&self) -> &Fields {
        &self.b
    }

    /// Springs of the angles: to ground, in the joint.
    pub fn springs(&self) -> [f64; 2] {
        match self.parameters.hub {
            Hub::Jointed { spring, .. } => [self.parameters.ground_spring, spring],
            _ => [self.parameters.ground_spring, 0.0],
        }
    }

    /// An upper estimate of the largest natural frequency, rad/s.
    pub fn fastest(&self) -> f64 {
        self.fastest
    }

    /// The elastic part.
    pub fn elastic(&self) -> &Elastic {
        &self.elastic
    }

    /// Mass: on `u`, and on `v` and `theta`.
    pub fn mass(&self) -> (&Tridiagonal, &Blocks) {
        (&self.axial_mass, &self.bending_mass)
    }

    /// `out <- M x`.
    pub fn apply_mass(&self, x: &Fields, out: &mut Fields) {
        let (axial, bending) = (Some(&self.axial_mass), &self.bending_mass);
        dispatch(Symmetric { axial, bending, x, out });
    }

    /// `out <- G x`.
    pub fn apply_gyroscopic(&self, x: &Fields, out: &mut Fields) {
        dispatch(Across { skew: &self.gyroscopic, x, out });
    }

    /// `out <- Q x`, or `(M - D1) x` where there is a joint.
    pub fn apply_outward(&self, x: &Fields, out: &mut Fields) {
        dispatch(Symmetric { axial: Some(&self.axial_mass), bending: &self.outward, x, out });
    }

    /// `out <- D0 x` on `v` and `theta`; `u` is left as it is.
    pub fn apply_shortening(&self, x: &Fields, out: &mut Fields) {
        dispatch(Symmetric { axial: None, bending: &self.shortening, x, out });
    }
}

/// The largest natural frequency by some steps of the power method, as in its last digits nobody is
/// interested.
fn fastest(nodes: usize, mass: &Factor, elastic: &Elastic) -> f64 {
    let (mut x, mut y) = (Fields::zeros(nodes), Fields::zeros(nodes));
    let mut ends = Ends::new(nodes);
    for (i, [u, v]) in
        x.u[PAD..PAD + nodes].iter_mut().zip(&mut x.v[PAD..]).map(|(u, v)| [u, v]).enumerate()
    {
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        (*u, *v) = (sign, sign * 0.5);
    }
    let mut square = 0.0;
    for _ in 0..30 {
        let size = x.dot(&x).sqrt();
        y.parts_mut().into_iter().for_each(|part| part.fill(0.0));
        elastic.subtract_linear(-1.0 / size, &x, &mut ends, &mut y);
        mass.solve(&mut y);
        std::mem::swap(&mut x, &mut y);
        square = x.dot(&x).sqrt();
    }
    square.sqrt()
}

/// Vectors of elements, assembled: along the beam and across it.
fn moments(nodes: usize, axial: &[[f64; 2]], bending: &[[f64; 4]]) -> (Fields, Fields) {
    let (mut along, mut across) = (Fields::zeros(nodes), Fields::zeros(nodes));
    for (e, (axial, bending)) in axial.iter().zip(bending).enumerate() {
        for (side, i) in [PAD + e - 1, PAD + e].into_iter().enumerate() {
            if e + side > 0 {
                along.u[i] += axial[side];
                across.v[i] += bending[2 * side];
                across.theta[i] += bending[2 * side + 1];
            }
        }
    }
    (along, across)
}
