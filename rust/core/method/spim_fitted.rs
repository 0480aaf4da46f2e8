//! The paper's nonlinear SPIM with other functions than straight lines for the remainder over a step, as
//! it allows: parabolas, cubics, and `r0 + r1 sin(w s)/w + r2 (1 - cos(w s))/w^2`.
//!
//! They go through the remainders at the last grid points and, corrected, at the end of the step. Each has
//! its exact step: `z1 = W z + sum Theta_j r_j`, `Theta_j` the integral of `e^((h - s) A) g_j(s)`. With three
//! points of order 3, with four of order 4. Steps without a history are Lawson-Gauss steps of order 8.

use super::common::{PAIRS_TO, add_product, check_finite, iterate, way};
use super::gauss::Ending;
use super::lawson::LawsonGauss;
use super::options::wrong;
use super::spim_nonlinear::Slope;
use super::{OptionInfo, Options, State, Stepper, Value, Work};
use crate::error::{Error, Result};
use crate::expm::{self, Correction, Propagator, Recipe};
use crate::linalg::dense::{self, Watch};
use crate::linalg::kernel::{doubles, doubles_mut};
use crate::system::SemiLinear;
use crate::tableau;

/// Points of a fit at most.
const MOST: usize = 4;

/// The option.
pub const APPROXIMATION: OptionInfo = OptionInfo {
    name: "approximation",
    doc: "of the remainder over a step: \"linear\" (default), \"quadratic\", \"cubic\", of order 2, 3, 4, or \
          (\"trigonometric\", w) with w in rad per unit of time, of order 3; all but the first through the \
          remainders at the last grid points, and so not symmetric",
};

/// What the remainder is taken for over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fit {
    /// A polynomial of this degree.
    Polynomial(usize),
    /// A constant, and sine and cosine of this frequency.
    Trigonometric(f64),
}

impl Fit {
    /// What the option says.
    ///
    /// # Errors
    /// [`Error::Argument`] for something else.
    pub fn of(options: &Options) -> Result<Fit> {
        let name = APPROXIMATION.name;
        match options.value(name) {
            None => Ok(Fit::Polynomial(1)),
            Some(Value::Text(word)) => match word.as_str() {
                "linear" => Ok(Fit::Polynomial(1)),
                "quadratic" => Ok(Fit::Polynomial(2)),
                "cubic" => Ok(Fit::Polynomial(3)),
                "trigonometric" => Err(Error::argument(
                    "approximation: \"trigonometric\" needs a frequency, as in (\"trigonometric\", 2.0)",
                )),
                other => Err(Error::argument(format!(
                    "approximation: must be 'linear', 'quadratic', 'cubic' or ('trigonometric', w), got \
                     '{other}'"
                ))),
            },
            Some(Value::Named(word, w)) if word == "trigonometric" => {
                match *w > 0.0 && w.is_finite() {
                    true => Ok(Fit::Trigonometric(*w)),
                    false => Err(Error::argument(format!(
                        "approximation: the frequency must be positive and finite, got {w}"
                    ))),
                }
            }
            Some(value) => {
                Err(wrong(name, "'linear', 'quadratic', 'cubic' or ('trigonometric', w)", value))
            }
        }
    }

    /// Points it goes through.
    fn points(self) -> usize {
        match self {
            Fit::Polynomial(degree) => degree + 1,
            Fit::Trigonometric(_) => 3,
        }
    }

    /// Its functions `g_j`, a part of the step from its start.
    fn functions(self, part: f64, h: f64) -> [f64; MOST] {
        match self {
            Fit::Polynomial(_) => [1.0, part, part * part, part * part * part],
            Fit::Trigonometric(w) => {
                let (sin, half) = ((w * part * h).sin(), (0.5 * w * part * h).sin());
                [1.0, sin / w, 2.0 * half * half / (w * w), 0.0]
            }
        }
    }

    /// `W`, then `Theta_j`.
    fn integrals(self, m: usize, a: &[f64], h: f64, watch: &mut Watch) -> Result<Vec<Vec<f64>>> {
        let mut found = vec![vec![0.0; m * m]; self.points() + 1];
        match self {
            Fit::Polynomial(_) => {
                let mut outs: Vec<&mut [f64]> =
                    found.iter_mut().map(|x| x.as_mut_slice()).collect();
                expm::phis(m, m <= PAIRS_TO, a, h, &mut outs, watch)?;
                let mut factor = h;
                for (j, matrix) in found.iter_mut().enumerate().skip(1) {
                    // h j! phi_j+1 of (s / h)^j
                    factor *= (j - 1).max(1) as f64;
                    matrix.iter_mut().for_each(|x| *x *= factor);
                }
            }
            Fit::Trigonometric(w) => {
                // y0' = y1, y1' = y2, y2' = -w^2 y1 begins at (r0, r1, r2); z' = A z + y0.
                let width = 4 * m;
                let mut whole = vec![0.0; width * width];
                for i in 0..m {
                    whole[width * i..][..m].copy_from_slice(&a[m * i..][..m]);
                    for block in 0..3 {
                        whole[width * (block * m + i) + (block + 1) * m + i] = 1.0;
                    }
                    whole[width * (3 * m + i) + 2 * m + i] = -w * w;
                }
                let recipe = Recipe::auto(width);
                let none = Some(Correction::None);
                let made = Propagator::new(width, &whole, h, recipe, none, watch)?;
                let mut entries = vec![0.0; width * width];
                made.matrix(&mut entries);
                for (j, matrix) in found.iter_mut().enumerate() {
                    for i in 0..m {
                        let row = &entries[width * i + j * m..][..m];
                        matrix[m * i..][..m].copy_from_slice(row);
                    }
                }
            }
        }
        Ok(found)
    }

    /// What each remainder at `places`, parts of the step, adds to a step.
    fn weights(self, places: &[f64], integrals: &[Vec<f64>], h: f64) -> Result<Vec<Vec<f64>>> {
        let count = places.len();
        let mut work = [[0.0; 2 * MOST]; MOST];
        for (row, place) in work.iter_mut().zip(places) {
            row[..count].copy_from_slice(&self.functions(*place, h)[..count]);
        }
        for (i, row) in work.iter_mut().enumerate().take(count) {
            row[count + i] = 1.0;
        }
        // What columns are of where they can be told apart.
        let sizes = match self {
            Fit::Polynomial(_) => [1.0; MOST],
            Fit::Trigonometric(w) => {
                let short = h.abs().min(1.0 / w);
                [1.0, short, short * short, 1.0]
            }
        };
        if !reduce(&mut work, count, sizes) {
            return Err(Error::argument(format!(
                "approximation: a step of {h} cannot tell its functions apart; take another frequency \
                 or step"
            )));
        }
        // r_j = sum of work[j][count + i] F_i
        let matrix = |i: usize| {
            let mut sum = vec![0.0; integrals[0].len()];
            for (j, integral) in integrals[1..].iter().enumerate().take(count) {
                let part = work[j][count + i];
                sum.iter_mut().zip(integral).for_each(|(sum, x)| *sum += part * x);
            }
            sum
        };
        Ok((0..count).map(matrix).collect())
    }
}

/// Gauss-Jordan elimination of `[M | I]`; whether there is an inverse.
fn reduce(work: &mut [[f64; 2 * MOST]; MOST], count: usize, sizes: [f64; MOST]) -> bool {
    for column in 0..count {
        let size = |row: &[f64; 2 * MOST]| row[column].abs();
        let mut pivot = column;
        for i in column + 1..count {
            if size(&work[i]) > size(&work[pivot]) {
                pivot = i;
            }
        }
        let pivot_size = size(&work[pivot]);
        if pivot_size.is_nan() || pivot_size <= 1e-6 * sizes[column] {
            return false;
        }
        work.swap(column, pivot);
        let divisor = work[column][column];
        work[column].iter_mut().for_each(|x| *x /= divisor);
        let row = work[column];
        for (i, other) in work.iter_mut().enumerate().take(count) {
            let factor = other[column];
            if i != column {
                other.iter_mut().zip(row).for_each(|(x, y)| *x -= factor * y);
            }
        }
    }
    true
}

/// Method and memory.
pub struct Fitted {
    name: &'static str,
    h: f64,
    slope: Slope,
    /// `e^(h A)`.
    turn: Vec<f64>,
    /// For remainders at the start, one step before, and so on: of the step, or of its prediction.
    explicit: Vec<Vec<f64>>,
    /// The same with that at the end first, of corrected steps.
    corrected: Vec<Vec<f64>>,
    /// Remainders from before that a step needs.
    needed: usize,
    /// Makes the first steps, in a state of its own.
    starter: LawsonGauss,
    starting: State,
    /// Remainders: at the start, one step before, ..
    past: Vec<Vec<f64>>,
    base: Vec<f64>,
    end: Vec<f64>,
    last: Vec<f64>,
    new: Vec<f64>,
}

impl Fitted {
    /// For steps of `h`.
    ///
    /// # Errors
    /// [`Error::Argument`] for a frequency that does not go with the step; those of exponentials.
    pub fn new(
        name: &'static str,
        slope: Slope,
        fit: Fit,
        system: &dyn SemiLinear,
        h: f64,
        watch: &mut Watch,
    ) -> Result<Fitted> {
        let (m, points) = (system.len(), fit.points());
        let integrals = fit.integrals(m, system.matrix(), h, watch)?;
        let places: Vec<f64> = (0..=points).map(|i| 1.0 - i as f64).collect();
        let back =
            |fit: Fit, integrals: &[Vec<f64>]| fit.weights(&places[1..=fit.points()], integrals, h);
        let (explicit, corrected, needed) = match slope {
            Slope::AlongTheFlow => (back(fit, &integrals)?, Vec::new(), points - 1),
            Slope::Predicted | Slope::Implicit => {
                // One point fewer will do for the prediction.
                let before = Fit::Polynomial(points - 2);
                let explicit = back(before, &before.integrals(m, system.matrix(), h, watch)?)?;
                (explicit, fit.weights(&places[..points], &integrals, h)?, points - 2)
            }
        };
        let table = tableau::COLLOCATION8;
        let starter = LawsonGauss::new(name, table, Ending::Rounding, system, h, watch)?;
        let zeros = || vec![0.0; m];
        Ok(Fitted {
            name,
            h,
            slope,
            turn: integrals.into_iter().next().unwrap_or_default(),
            explicit,
            corrected,
            needed,
            starting: State { z: zeros(), carried: dense::zeros(starter.carried_len())? },
            starter,
            past: vec![zeros(); needed + 1],
            base: zeros(),
            end: zeros(),
            last: zeros(),
            new: zeros(),
        })
    }

    /// `end = W z + sum of weights times remainders`; with that at the end first, where it counts.
    fn predict(&mut self, z: &[f64]) {
        self.end.fill(0.0);
        add_product(&self.turn, z, &mut self.end);
        for (weight, past) in self.explicit.iter().zip(&self.past) {
            add_product(weight, past, &mut self.end);
        }
    }

    fn correct(&mut self) {
        self.end.copy_from_slice(&self.base);
        add_product(&self.corrected[0], &self.new, &mut self.end);
    }

    /// A step with a history.
    fn advance(
        &mut self,
        system: &dyn SemiLinear,
        k: u64,
        t: f64,
        z: &[f64],
        work: &mut Work,
    ) -> Result<()> {
        self.predict(z);
        if self.slope == Slope::AlongTheFlow {
            return Ok(());
        }
        self.base.fill(0.0);
        add_product(&self.turn, z, &mut self.base);
        for (weight, past) in self.corrected[1..].iter().zip(&self.past) {
            add_product(weight, past, &mut self.base);
        }
        let (name, slope) = (self.name, self.slope);
        let mut refine = || {
            self.last.copy_from_slice(&self.end);
            system.remainder(t + self.h, &self.last, &mut self.new)?;
            work.evaluations += 1;
            self.correct();
            Ok(way(&mut self.last, &self.end))
        };
        match slope {
            Slope::Predicted => refine().map(|_| ()),
            _ => iterate(name, t, k, refine),
        }
    }
}

impl Stepper<dyn SemiLinear> for Fitted {
    /// How many remainders there are, those, and what the first steps carry.
    fn carried_len(&self) -> usize {
        1 + self.needed * self.end.len().div_ceil(8) + self.starting.carried.len()
    }

    fn step(
        &mut self,
        system: &(dyn SemiLinear + 'static),
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let m = state.z.len();
        let packs = m.div_ceil(8);
        let (count, rest) = state.carried.split_at_mut(1);
        let (kept, started) = rest.split_at_mut(self.needed * packs);
        let known = if k == 0 { 0 } else { count[0].0[0] as usize };
        for (past, kept) in self.past[1..].iter_mut().zip(kept.chunks_exact(packs.max(1))) {
            past.copy_from_slice(&doubles(kept)[..m]);
        }
        system.remainder(t, &state.z, &mut self.past[0])?;
        work.evaluations += 1;
        if known < self.needed {
            self.starting.z.copy_from_slice(&state.z);
            self.starting.carried.copy_from_slice(started);
            let mut inner = Work::default();
            self.starter.step(system, k, t, &mut self.starting, &mut inner)?;
            work.evaluations += inner.evaluations;
            self.end.copy_from_slice(&self.starting.z);
        } else {
            self.advance(system, k, t, &state.z, work)?;
        }
        check_finite(self.name, t, k, &self.end)?;
        if known < self.needed {
            started.copy_from_slice(&self.starting.carried);
        }
        count[0].0[0] = (known + 1).min(self.needed) as f64;
        for (past, kept) in self.past.iter().zip(kept.chunks_exact_mut(packs.max(1))) {
            doubles_mut(kept)[..m].copy_from_slice(past);
        }
        state.z.copy_from_slice(&self.end);
        work.steps += 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{MethodInfo, build, find};
    use crate::model::named;

    const PENDULUM: [f64; 5] = [1.0, 1.0, 0.1, 100.0, 9.81914];

    fn end(info: &MethodInfo, value: Option<Value>, h: f64, steps: u64) -> Vec<f64> {
        let native = named("compound pendulum", &PENDULUM).unwrap();
        let options = value.map(|value| ("approximation".to_string(), value));
        let options = Options(options.into_iter().collect());
        let mut method = build(info, &native.problem, h, &options, &mut || Ok(())).unwrap();
        let z0 = [0.1, std::f64::consts::FRAC_PI_6, 0.0, 0.0];
        let mut state = State::new(&z0, &*method).unwrap();
        for k in 0..steps {
            method.step(k, h * k as f64, &mut state).unwrap();
        }
        state.z
    }

    #[test]
    fn more_points_are_of_higher_order() {
        let exact = end(find("gauss16").unwrap(), None, 0.01, 200);
        let word = |word: &str| Value::Text(word.into());
        let wave = Value::Named("trigonometric".into(), 3.0);
        let cases = [(word("quadratic"), 3.0), (word("cubic"), 4.0), (wave, 3.0)];
        for name in ["spim_explicit", "spim_pc", "spim_implicit"] {
            for (value, order) in &cases {
                let info = find(name).unwrap();
                let errors = [800, 1200, 1600, 2400].map(|steps| {
                    let z = end(info, Some(value.clone()), 2.0 / steps as f64, steps);
                    z.iter().zip(&exact).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
                });
                let slope = (errors[0] / errors[3]).ln() / 3.0_f64.ln();
                assert!((slope - order).abs() <= 0.15, "{name} {value:?}: {slope} {errors:?}");
            }
        }
    }

    #[test]
    fn restarts_in_and_after_the_first_steps_give_the_same_bits() {
        let native = named("compound pendulum", &PENDULUM).unwrap();
        let values = [
            Value::Text("quadratic".into()),
            Value::Text("cubic".into()),
            Value::Named("trigonometric".into(), 3.0),
        ];
        for name in ["spim_explicit", "spim_pc", "spim_implicit"] {
            for value in &values {
                let options = Options(vec![("approximation".into(), value.clone())]);
                let make = || {
                    let info = find(name).unwrap();
                    build(info, &native.problem, 0.01, &options, &mut || Ok(())).unwrap()
                };
                let mut whole = make();
                let mut state = State::new(&[0.1, 0.5, 0.0, 0.0], &*whole).unwrap();
                let mut seen = vec![state.clone()];
                for k in 0..12 {
                    whole.step(k, 0.01 * k as f64, &mut state).unwrap();
                    seen.push(state.clone());
                }
                for stop in 1..6 {
                    let mut method = make();
                    let mut state = seen[stop].clone();
                    for k in stop..12 {
                        method.step(k as u64, 0.01 * k as f64, &mut state).unwrap();
                    }
                    assert_eq!(state, seen[12], "{name} {value:?}, stop at {stop}");
                }
            }
        }
    }

    #[test]
    fn a_wave_without_frequency_is_a_parabola() {
        let info = find("spim_implicit").unwrap();
        let slow = end(info, Some(Value::Named("trigonometric".into(), 1e-3)), 0.01, 200);
        let parabola = end(info, Some(Value::Text("quadratic".into())), 0.01, 200);
        let off = slow.iter().zip(&parabola).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        assert!(off <= 1e-9, "{off:e}"); // (w h)^2, and digits of sine and cosine
    }
}
