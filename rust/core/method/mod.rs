//! Integrators, one a file, and the list of their records.
//!
//! An author writes a struct with its caches, `impl Stepper` for the structure it needs, and a
//! [`MethodInfo`]; a line in [`METHODS`] does the rest: the Python API, the printed table and the
//! verification suite read the records.

mod common;
mod composition;
mod eavf;
mod gauss;
mod lawson;
mod linear;
pub mod measured;
mod midpoint;
mod modal;
mod newmark;
mod options;
mod rk4;
mod runge_kutta;
mod spim_fitted;
mod spim_nonlinear;
mod splitting;
mod tangent;
mod turn;
mod two_term;

use std::sync::Arc;

pub use linear::{correction, output_method, trajectory_method};
pub use options::{OptionInfo, Options, Value, nearest};
pub use tangent::Tangent;

use crate::error::{Error, Result};
use crate::linalg::dense::Watch;
use crate::linalg::kernel::Eight;
use crate::propagate::Clock;
use crate::system::{Flow, Linear, Problem, SemiLinear};

/// All that changes from step to step. A copy of it is a checkpoint.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The state `[q; p]` of the system.
    pub z: Vec<f64>,
    /// What the method carries over: compensations, histories, blocks. Zero at the start.
    pub carried: Vec<Eight>,
}

impl State {
    /// The state a run with this method starts from.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn new(z: &[f64], method: &dyn Step) -> Result<State> {
        Ok(State { z: z.to_vec(), carried: crate::linalg::dense::zeros(method.carried_len())? })
    }
}

/// What a run has cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Steps taken.
    pub steps: u64,
    /// Evaluations of the right side.
    pub evaluations: u64,
    /// Products of a matrix and a block of states.
    pub products: u64,
}

/// An integrator of systems with the structure `S`: what an author of a method writes.
///
/// All memory is allocated when it is made; the step `h` is fixed then. `step` takes the state from
/// step `k`, time `t`, to step `k + 1`; `k == 0` is the only sign of a first step. A step that fails
/// leaves the state as it was.
pub trait Stepper<S: ?Sized>: Send {
    /// Packs of memory it carries from step to step, all zero at the start.
    fn carried_len(&self) -> usize {
        0
    }

    /// One step.
    ///
    /// # Errors
    /// Those of the system and of the method; the state is then as it was.
    fn step(
        &mut self,
        system: &S,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()>;

    /// As many steps as `rows` has room for, each state copied into its row; `done` counts them.
    ///
    /// # Errors
    /// As [`step`](Self::step); what was done before is kept.
    #[allow(clippy::too_many_arguments)]
    fn fill(
        &mut self,
        system: &S,
        k: u64,
        clock: &Clock,
        state: &mut State,
        rows: &mut [f64],
        done: &mut usize,
        work: &mut Work,
    ) -> Result<()> {
        for (k, row) in (k..).zip(rows.chunks_exact_mut(state.z.len())) {
            let stepped = self.step(system, k, clock.t(k), state, work);
            stepped.map_err(|error| error.in_step(k))?;
            row.copy_from_slice(&state.z);
            *done += 1;
        }
        Ok(())
    }

    /// Steps for which a load is asked at once: what there is at a step may know it to the end of the
    /// block that holds the step, or of the run.
    fn block(&self) -> u64 {
        1
    }

    /// The whole state after step `k`, where `state.z` holds outputs.
    ///
    /// # Errors
    /// Those of a load.
    fn whole(&self, _k: u64, state: &State) -> Result<Vec<f64>> {
        Ok(state.z.clone())
    }
}

/// An integrator bound to its system, as the driver sees it.
pub trait Step: Send {
    /// See [`Stepper::carried_len`].
    fn carried_len(&self) -> usize;
    /// See [`Stepper::step`].
    ///
    /// # Errors
    /// As there.
    fn step(&mut self, k: u64, t: f64, state: &mut State) -> Result<()>;
    /// See [`Stepper::fill`].
    ///
    /// # Errors
    /// As there.
    fn fill(
        &mut self,
        k: u64,
        clock: &Clock,
        state: &mut State,
        rows: &mut [f64],
        done: &mut usize,
    ) -> Result<()>;
    /// See [`Stepper::block`].
    fn block(&self) -> u64;
    /// See [`Stepper::whole`].
    ///
    /// # Errors
    /// As there.
    fn whole(&self, k: u64, state: &State) -> Result<Vec<f64>>;
    /// What it has cost so far.
    fn work(&self) -> Work;
    /// What was chosen and why, beyond the method's name; empty where there was no choice.
    fn choice(&self) -> &str;
}

/// A [`Stepper`] and its system.
pub struct Bound<M, S: ?Sized> {
    method: M,
    system: Arc<S>,
    work: Work,
    choice: String,
}

impl<M: Stepper<S>, S: ?Sized> Bound<M, S> {
    /// Binds a method to its system.
    pub fn new(method: M, system: Arc<S>, choice: String) -> Self {
        Bound { method, system, work: Work::default(), choice }
    }
}

impl<M: Stepper<S>, S: ?Sized + Send + Sync> Step for Bound<M, S> {
    fn carried_len(&self) -> usize {
        self.method.carried_len()
    }
    fn step(&mut self, k: u64, t: f64, state: &mut State) -> Result<()> {
        let stepped = self.method.step(&self.system, k, t, state, &mut self.work);
        stepped.map_err(|error| error.in_step(k))
    }
    fn fill(
        &mut self,
        k: u64,
        clock: &Clock,
        state: &mut State,
        rows: &mut [f64],
        done: &mut usize,
    ) -> Result<()> {
        self.method.fill(&self.system, k, clock, state, rows, done, &mut self.work)
    }
    fn block(&self) -> u64 {
        self.method.block()
    }
    fn whole(&self, k: u64, state: &State) -> Result<Vec<f64>> {
        self.method.whole(k, state)
    }
    fn work(&self) -> Work {
        self.work
    }
    fn choice(&self) -> &str {
        &self.choice
    }
}

/// What is true of a method at its default options. The verification suite tests every line.
#[derive(Debug)]
pub struct MethodInfo {
    /// Name in calls.
    pub name: &'static str,
    /// Other names it answers to.
    pub aliases: &'static [&'static str],
    /// One line for tables.
    pub summary: &'static str,
    /// Order of convergence; `None`: exact but for rounding.
    pub order: Option<usize>,
    /// Whether the step map is symplectic on Hamiltonian systems.
    pub symplectic: bool,
    /// Whether a step back undoes a step.
    pub symmetric: bool,
    /// Whether the energy of Hamiltonian systems is conserved, but for rounding.
    pub energy_preserving: bool,
    /// The structure it needs.
    pub needs: Needs,
    /// Where its bits are the same.
    pub reproducible: &'static str,
    /// Source.
    pub reference: &'static str,
    /// Options it takes.
    pub options: &'static [OptionInfo],
    /// Makes it for a problem and a signed step; checked options.
    pub build: Build,
}

/// Makes a method for a problem and a signed step.
pub type Build = fn(&Problem, f64, &Options, &mut Watch) -> Result<Box<dyn Step>>;

/// The structure a method needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Any system.
    Flow,
    /// `z' = A z + f(t)`.
    Linear,
    /// Mass, damping and stiffness.
    Structural,
    /// A linear system in modal coordinates: `n` oscillators, each by itself.
    Modes,
    /// `z' = A z + F(z, t)`.
    SemiLinear,
    /// The same with a Hamiltonian A.
    Canonical,
    /// `z' = A z + (0, f(q, t))`.
    Potential,
    /// `q' = v(p)`, `p' = f(t, q)`.
    Split,
    /// A free linear system `q' = P p`, `p' = R q` with symmetric matrices.
    Separable,
}

impl Needs {
    /// Whether it steps by exponentials, and takes loads as impulses.
    pub fn is_exponential(self) -> bool {
        matches!(self, Needs::Linear | Needs::Modes | Needs::Separable)
    }

    /// The word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Needs::Flow => "flow",
            Needs::Linear => "linear",
            Needs::Structural | Needs::Modes => "structure",
            Needs::SemiLinear => "semilinear",
            Needs::Canonical => "canonical",
            Needs::Potential => "potential",
            Needs::Split => "split",
            Needs::Separable => "separable",
        }
    }
}

/// All methods.
pub const METHODS: &[&MethodInfo] = &[
    &linear::AUTO,
    &linear::SPIM,
    &linear::PIM,
    &linear::HALF,
    &modal::MODAL,
    &two_term::TWO_TERM,
    &newmark::NEWMARK,
    &newmark::GENERALIZED_ALPHA,
    &newmark::CENTRAL_DIFFERENCE,
    &midpoint::SRK2,
    &midpoint::MIDPOINT,
    &spim_nonlinear::EXPLICIT,
    &spim_nonlinear::PREDICTED,
    &spim_nonlinear::IMPLICIT,
    &lawson::LAWSON_GAUSS2,
    &lawson::LAWSON_GAUSS4,
    &lawson::LAWSON_GAUSS6,
    &lawson::LAWSON_GAUSS8,
    &lawson::LAWSON_GAUSS12,
    &lawson::LAWSON_GAUSS16,
    &eavf::EAVF,
    &splitting::STRANG,
    &splitting::MOLLIFIED_IMPULSE,
    &splitting::MCLACHLAN84,
    &composition::VERLET,
    &composition::YOSHIDA4,
    &composition::YOSHIDA6,
    &composition::YOSHIDA8,
    &composition::BLANES_MOAN4,
    &composition::BLANES_MOAN6,
    &composition::KAHAN_LI8,
    &composition::SOFRONIOU_SPALETTA10,
    &gauss::GAUSS4,
    &gauss::GAUSS6,
    &gauss::GAUSS8,
    &gauss::GAUSS12,
    &gauss::GAUSS16,
    &gauss::GAUSS24,
    &gauss::GAUSS32,
    &runge_kutta::RUNGE_KUTTA,
    &rk4::RK4,
];

/// Components beyond which models are not split for exponentials.
const LARGEST: usize = 1024;

/// Looks a method up by name.
///
/// # Errors
/// [`Error::Argument`] naming the nearest.
pub fn find(name: &str) -> Result<&'static MethodInfo> {
    let answers = |info: &&&MethodInfo| info.name == name || info.aliases.contains(&name);
    METHODS.iter().find(answers).copied().ok_or_else(|| {
        let names: Vec<_> = METHODS.iter().map(|info| info.name).collect();
        Error::argument(format!(
            "unknown method '{name}'; did you mean '{}'? (methods: {})",
            nearest(name, names.iter().copied()),
            names.join(", ")
        ))
    })
}

/// Checks options against the record and makes the method.
///
/// # Errors
/// [`Error::UnknownOption`], [`Error::Unsupported`], those of the method.
pub fn build(
    info: &MethodInfo,
    problem: &Problem,
    h: f64,
    options: &Options,
    watch: &mut Watch,
) -> Result<Box<dyn Step>> {
    options.check(info)?;
    let (enough, needed) = match info.needs {
        Needs::Flow => (true, "any system"),
        Needs::Linear => (problem.linear().is_some(), "a linear system z' = A z + f(t)"),
        Needs::Split => {
            (matches!(problem, Problem::Separable(_)), "a separable system q' = v(p), p' = f(q)")
        }
        Needs::SemiLinear => {
            (problem.semilinear().is_some(), "a semilinear system z' = A z + F(z, t)")
        }
        Needs::Canonical => (
            problem.semilinear().is_some_and(|system| has_energy(&*system)),
            "a semilinear system z' = A z + F(z, t) with a Hamiltonian A (J A symmetric)",
        ),
        Needs::Potential => (
            problem.semilinear().is_some_and(|system| system.is_force()),
            "a system z' = A z + (0, f(q, t)) that says so: its remainder a force of the coordinates \
             alone",
        ),
        Needs::Modes => (
            problem.linear().is_some_and(|system| modal::is_decoupled(system)),
            "a structure, whose modes it finds, or a system in modal coordinates",
        ),
        Needs::Separable => (
            problem.linear().is_some_and(|system| two_term::takes(system)),
            "a separable system without a load, as free undamped structures are",
        ),
        Needs::Structural => {
            (matches!(problem, Problem::Structural(_)), "a structure with mass and stiffness")
        }
    };
    if !enough {
        let more = match (problem, info.needs) {
            (Problem::Beam(_), Needs::SemiLinear | Needs::Canonical) => {
                "; a beam is one where its hub turns freely, joint locked, to first or zeroth order of \
                 coupling, without gravity, damping and loads"
            }
            (
                Problem::Separable(system),
                Needs::SemiLinear | Needs::Canonical | Needs::Potential,
            ) if system.len() > LARGEST => {
                "; exponentials are full matrices, and models beyond 1024 components take none"
            }
            _ => "",
        };
        return Err(Error::unsupported(format!(
            "{}: needs {needed}, got {}{more}",
            info.name,
            problem.kind()
        )));
    }
    (info.build)(problem, h, options, watch)
}

/// Whether the linear part is Hamiltonian.
fn has_energy(system: &dyn SemiLinear) -> bool {
    let made = Linear::new(system.len(), system.matrix().to_vec());
    made.is_ok_and(|linear| linear.is_hamiltonian())
}

/// Binds a method that needs no more than a flow.
fn bind_flow<M: Stepper<dyn Flow> + 'static>(method: M, problem: &Problem) -> Box<dyn Step> {
    Box::new(Bound::new(method, problem.flow(), String::new()))
}
