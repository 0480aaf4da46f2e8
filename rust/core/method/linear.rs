//! Linear systems by their exponential: exact but for rounding, whatever the step.
//!
//! `spim` and `pim` are the paper's (eqs. 36–44), `auto` takes the most exact exponential. All step
//! in blocks ([`Blocks`]).

use std::sync::Arc;

use super::{Bound, MethodInfo, Needs, OptionInfo, Options, State, Step, Stepper, Work};
use crate::error::{Error, Result};
use crate::expm::{Blocks, Correction, Driven, Ports, Propagator, Recipe, Scheme, Walk};
use crate::linalg::dense::Watch;
use crate::linalg::symplectic::Group;
use crate::propagate::Clock;
use crate::system::Problem;

/// Blocks walked step by step: the block of step `k` is what is carried.
pub(super) struct LinearSteps<W> {
    blocks: W,
    /// The state, and what is stepped along with it: what a run starts from.
    first: Vec<f64>,
    /// Components of the state that a run's start sets; 0 where outputs are shown in its place.
    shown: usize,
}

impl<W: Walk> LinearSteps<W> {
    /// `along`: what is stepped along with a state of `shown` components.
    pub(super) fn new(blocks: W, shown: usize, along: &[f64]) -> Self {
        let mut first = vec![0.0; shown];
        first.extend_from_slice(along);
        LinearSteps { blocks, first, shown }
    }

    /// Makes the block that holds step `k` from what is carried; returns the step's place in it.
    fn prepare(&mut self, k: u64, state: &mut State, work: &mut Work) -> Result<usize> {
        let width = self.blocks.width() as u64;
        if k == 1 {
            // Step 0 is where a run starts: its block is made from the state itself.
            self.first[..self.shown].copy_from_slice(&state.z[..self.shown]);
            self.blocks.start(&self.first, &mut state.carried)?;
            work.products += u64::from(width.ilog2());
        }
        if k.is_multiple_of(width) {
            self.blocks.advance(k / width, &mut state.carried)?;
            work.products += 1;
        }
        Ok((k % width) as usize)
    }
}

impl<W: Walk, S: ?Sized> Stepper<S> for LinearSteps<W> {
    fn carried_len(&self) -> usize {
        self.blocks.carried_len()
    }

    fn step(&mut self, _: &S, k: u64, t: f64, state: &mut State, work: &mut Work) -> Result<()> {
        let at = self.prepare(k + 1, state, work)?;
        self.blocks
            .read_one(&state.carried, at, &mut state.z)
            .map_err(|error| located(error, k, t))?;
        work.steps += 1;
        Ok(())
    }

    fn fill(
        &mut self,
        _: &S,
        k: u64,
        clock: &Clock,
        state: &mut State,
        rows: &mut [f64],
        done: &mut usize,
        work: &mut Work,
    ) -> Result<()> {
        let len = state.z.len();
        let wanted = rows.len() / len;
        let mut result = Ok(());
        while *done < wanted && result.is_ok() {
            let next = k + *done as u64 + 1;
            result = self.prepare(next, state, work).and_then(|at| {
                let to = self.blocks.width().min(at + wanted - *done);
                let rows = &mut rows[*done * len..][..(to - at) * len];
                self.blocks.read(&state.carried, at, to, rows, done)
            });
        }
        if let Some(last) = rows[..*done * len].chunks_exact(len).next_back() {
            state.z.copy_from_slice(last);
        }
        work.steps += *done as u64;
        let reached = k + *done as u64;
        result.map_err(|error| located(error, reached, clock.t(reached)))
    }

    fn block(&self) -> u64 {
        self.blocks.width() as u64
    }

    fn whole(&self, k: u64, state: &State) -> Result<Vec<f64>> {
        match (self.shown, k) {
            (0, 0) => Ok(self.first.clone()),
            (0, _) => self.blocks.whole(k, &state.carried),
            _ => Ok(state.z.clone()),
        }
    }
}

/// Says at which step a state overflowed.
fn located(error: Box<Error>, step: u64, t: f64) -> Box<Error> {
    match *error {
        Error::Overflow(message) => Box::new(Error::Model {
            message: format!("{message} (after step {step}, t = {t:e})"),
            t,
            step,
        }),
        _ => error,
    }
}

/// The method that walks a propagator for `batch` trajectories, one after the other in the state.
///
/// # Errors
/// [`Error::Memory`]; what `watch` reports.
pub fn trajectory_method(
    propagator: Arc<Propagator>,
    batch: usize,
    watch: &mut Watch,
) -> Result<Box<dyn Step>> {
    let rows = propagator.rows();
    let steps = LinearSteps::new(Blocks::new(propagator, rows, batch, watch)?, batch * rows, &[]);
    Ok(Box::new(Bound::<_, ()>::new(steps, Arc::new(()), String::new())))
}

const CORRECTION: OptionInfo = OptionInfo {
    name: "correction",
    doc: "\"auto\" (\"none\" for pim), \"none\", \"polish\" or \"exact\": what is done about the \
          rounding of the stored exponential; \"exact\" works in pairs of doubles and keeps the \
          state correctly rounded",
};
const DOUBLINGS: OptionInfo = OptionInfo {
    name: "doublings",
    doc: "N >= 0: the step is halved N times before the approximation; default 20 for the paper's \
          schemes, from norms for \"auto\"",
};
const PADE: OptionInfo = OptionInfo {
    name: "pade",
    doc: "l or (l, m), 0..13, default 2: degrees of the Padé ratio; symplectic only where l = m",
};
const ORDER: OptionInfo =
    OptionInfo { name: "order", doc: "1..30, default 4: order of the Taylor polynomial" };
const COORDINATES: OptionInfo = OptionInfo {
    name: "coordinates",
    doc: "\"raw\" or \"energy\" (structures with positive definite K): steps states whose length is \
          the energy, by an orthogonal propagator",
};
const FORCING: OptionInfo = OptionInfo {
    name: "forcing",
    doc: "\"exact\" or \"inverse\": the paper's eq. 45, loads linear over each step by the inverse of \
          A, for comparison",
};
const REFERENCE: &str = "Huang, Deng & Yao, J. Sound Vib. 299 (2007)";

pub(super) const AUTO: MethodInfo = MethodInfo {
    name: "auto",
    aliases: &[],
    summary: "of linear systems, which its labels are of, the exponential right to the last bit (32 \
              states or fewer, separable ones) or SID 21+; of others lawson_gauss16, gauss16 or srk2, \
              with theirs",
    order: None,
    symplectic: true,
    symmetric: true,
    energy_preserving: true,
    needs: Needs::Linear,
    reproducible: "every machine",
    reference: "Sastre, Ibáñez & Defez, Appl. Math. Comput. 340 (2019); Ozaki et al., Numer. \
                Algorithms 59 (2012)",
    options: &[CORRECTION, COORDINATES, DOUBLINGS, FORCING],
    build: |problem, h, options, watch| build(problem, h, choice(options)?, options, watch),
};

pub(super) const HALF: MethodInfo = MethodInfo {
    name: "half",
    aliases: &[],
    summary: "half-size doubling in doubles: the quickest set-up, for free undamped motion of \
              moderate stiffness",
    order: None,
    symplectic: true,
    symmetric: true,
    energy_preserving: true,
    needs: Needs::Separable,
    reproducible: "every machine",
    reference: "Serbin & Blalock, SIAM J. Sci. Stat. Comput. 1 (1980)",
    options: &[CORRECTION],
    build: |problem, h, options, watch| {
        let recipe = Recipe { scheme: Scheme::Half, doublings: None };
        build(problem, h, |_, _| recipe, options, watch)
    },
};

pub(super) const SPIM: MethodInfo = MethodInfo {
    name: "spim",
    aliases: &[],
    summary: "the paper's symplectic precise integration: Padé ratio after N doublings",
    order: Some(4),
    symplectic: true,
    symmetric: true,
    energy_preserving: true,
    needs: Needs::Linear,
    reproducible: "every machine to 32 states; one machine above (the ratio's factorisation)",
    reference: REFERENCE,
    options: &[CORRECTION, DOUBLINGS, FORCING, PADE],
    build: |problem, h, options, watch| {
        let degrees = degrees(options.counts("pade")?)?;
        let recipe = Recipe { scheme: Scheme::Spim(degrees), doublings: doublings(options)? };
        build(problem, h, |_, _| recipe, options, watch)
    },
};

pub(super) const PIM: MethodInfo = MethodInfo {
    name: "pim",
    aliases: &[],
    summary: "precise integration: Taylor polynomial, N doublings of the increment",
    order: Some(4),
    symplectic: false,
    symmetric: false,
    energy_preserving: false,
    needs: Needs::Linear,
    reproducible: "every machine",
    reference: "Zhong & Williams, Proc. IMechE C 208 (1994); Huang, Deng & Yao, J. Sound Vib. 299 \
                (2007), eqs. 35-38",
    options: &[CORRECTION, DOUBLINGS, FORCING, ORDER],
    build: |problem, h, options, watch| {
        let scheme = Scheme::Pim(options.count("order")?.unwrap_or(4));
        let recipe = Recipe { scheme, doublings: doublings(options)? };
        build(problem, h, |_, _| recipe, options, watch)
    },
};

/// How the default method chooses its exponential.
fn choice(options: &Options) -> Result<impl FnOnce(usize, &[f64]) -> Recipe + use<>> {
    let doublings = doublings(options)?;
    Ok(move |rows: usize, a: &[f64]| match doublings {
        None => Recipe::for_steps(rows, a),
        _ => Recipe { doublings, ..Recipe::auto(rows) },
    })
}

fn doublings(options: &Options) -> Result<Option<u32>> {
    let count = options.count("doublings")?;
    Ok(count.map(|count| u32::try_from(count).unwrap_or(u32::MAX)))
}

/// `l` or `(l, m)`.
fn degrees(given: Option<Vec<usize>>) -> Result<[usize; 2]> {
    match given.as_deref() {
        None => Ok([2, 2]),
        Some(&[l]) => Ok([l, l]),
        Some(&[l, m]) => Ok([l, m]),
        Some(other) => Err(Error::argument(format!("pade: one degree or two, got {other:?}"))),
    }
}

fn build(
    problem: &Problem,
    h: f64,
    choose: impl FnOnce(usize, &[f64]) -> Recipe,
    options: &Options,
    watch: &mut Watch,
) -> Result<Box<dyn Step>> {
    let (propagator, why) = propagator(problem, h, choose, options, watch)?;
    let system = problem.linear().expect("checked with the propagator").clone();
    let (shown, along) = (system.rows(), system.generated());
    Ok(match system.load().cloned() {
        Some(load) if load.is_sampled() => {
            let steps = Driven::new(propagator, load, shown, watch)?;
            Box::new(Bound::new(LinearSteps::new(steps, shown, along), system.clone(), why))
        }
        _ => {
            let steps = Blocks::new(propagator, shown, 1, watch)?;
            Box::new(Bound::new(LinearSteps::new(steps, shown, along), system.clone(), why))
        }
    })
}

/// The default method where a few outputs are wanted and nothing else, from the state `z0`: the
/// state of a run is then these outputs. `None` where whole states cost no more.
///
/// # Errors
/// As [`build`](super::build).
pub fn output_method(
    problem: &Problem,
    h: f64,
    options: &Options,
    outputs: &[f64],
    z0: &[f64],
    watch: &mut Watch,
) -> Result<Option<Box<dyn Step>>> {
    let Some(system) = problem.linear().cloned() else { return Ok(None) };
    let (shown, along) = (system.rows(), system.generated());
    let exact = options.text("correction")? == Some("exact");
    if exact || !Ports::pays(shown + along.len(), outputs.len() / shown, system.load()) {
        return Ok(None);
    }
    options.check(&AUTO)?;
    let (propagator, why) = propagator(problem, h, choice(options)?, options, watch)?;
    let ports = Ports::new(propagator, outputs, shown, system.load().cloned(), watch)?;
    let mut steps = LinearSteps::new(ports, 0, z0);
    steps.first.extend_from_slice(along);
    let why = format!("{why}; outputs alone, without the states between blocks");
    Ok(Some(Box::new(Bound::new(steps, system, why))))
}

/// The exponential that a problem and its options ask for, and why it is that one.
fn propagator(
    problem: &Problem,
    h: f64,
    choose: impl FnOnce(usize, &[f64]) -> Recipe,
    options: &Options,
    watch: &mut Watch,
) -> Result<(Arc<Propagator>, String)> {
    let Some(system) = problem.linear() else {
        return Err(Error::unsupported("the exponential needs a linear system"));
    };
    let correction = options.text("correction")?.map_or(Ok(None), correction)?;
    let shown = problem.flow().len();
    let along = system.generated();
    let (size, whole) = (shown + along.len(), system.whole());
    let recipe = choose(size, &whole).check()?;
    // A polished PIM would be symplectic, which the paper's is not: only on request.
    let plain = matches!(recipe.scheme, Scheme::Pim(_)).then_some(Correction::None);
    let propagator = Propagator::new(size, &whole, h, recipe, correction.or(plain), watch)?;
    let scheme = match recipe.scheme {
        Scheme::Exact if propagator.by_halves() => {
            "correctly rounded exponential, by halves: the system is separable"
        }
        Scheme::Exact => "correctly rounded exponential: the state has 32 components or fewer",
        Scheme::Half => "half-size doubling in doubles",
        Scheme::Sid => "SID 21+ in doubles: the state has more than 32 components",
        _ => "",
    };
    let energy = one_of(options, "coordinates", ["raw", "energy"])? == 1;
    let coordinates = if energy { "energy coordinates" } else { "" };
    let correction = match propagator.correction {
        Correction::Exact if energy => "kept to rounding of their own matrix",
        Correction::Exact => "state kept correctly rounded",
        Correction::Polish => match propagator.group {
            Some(Group::Orthogonal) => "orthogonal polish: A is skew-symmetric",
            _ => "symplectic polish: A is Hamiltonian",
        },
        Correction::None => "",
    };
    let forcing = match one_of(options, "forcing", ["exact", "inverse"])? {
        1 => "loads taken as linear over each step, by the inverse of A (eq. 45)",
        _ => "",
    };
    let why = [scheme, coordinates, correction, forcing];
    let why = why.into_iter().filter(|why| !why.is_empty()).collect::<Vec<_>>().join("; ");
    Ok((Arc::new(propagator), why))
}

/// The number of the word an option has; 0 where it was not given.
fn one_of(options: &Options, name: &str, words: [&str; 2]) -> Result<usize> {
    let Some(word) = options.text(name)? else { return Ok(0) };
    words.iter().position(|known| *known == word).ok_or_else(|| {
        Error::argument(format!(
            "{name}: must be \"{}\" or \"{}\", got {word:?}",
            words[0], words[1]
        ))
    })
}

/// The correction of a name, `None` for `auto`.
///
/// # Errors
/// [`Error::Argument`] listing the names.
pub fn correction(name: &str) -> Result<Option<Correction>> {
    match name {
        "auto" => Ok(None),
        "none" => Ok(Some(Correction::None)),
        "polish" => Ok(Some(Correction::Polish)),
        "exact" => Ok(Some(Correction::Exact)),
        _ => Err(Error::argument(format!(
            "correction: must be \"auto\", \"none\", \"polish\" or \"exact\", got {name:?}"
        ))),
    }
}
