//! The tangent map of steps: the derivative of a state by the one before it.
//!
//! Central differences of order 8 of the step itself, each from a fresh start of the method. The
//! distance is as large as differences of order 6 and 8 agree: rounding counts for little then.

use super::{State, Step};
use crate::error::Result;
use crate::linalg::kernel::Eight;

/// Weights of differences over 1 to 4 distances, of orders 6 and 8.
const SIXTH: [f64; 3] = [3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0];
const EIGHTH: [f64; 4] = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];

/// The first distance tried, in parts of a component's size, and the smallest.
const FIRST: f64 = 1.0 / 16.0;
const LEAST: f64 = 1e-6;

/// The size of a component beside that of its half of the state, at least.
const SMALL: f64 = 0.25;

/// Where orders 6 and 8 differ by no more of the largest entry, order 8 is right to rounding.
const AGREE: f64 = 1e-11;

/// Where they have differed by no more, a larger difference is rounding.
const NEARLY: f64 = 1e-6;

/// Memory for the tangent maps of one method.
pub struct Tangent {
    state: State,
    column: [Vec<f64>; 2],
    best: Vec<f64>,
    distances: Vec<f64>,
    map: Vec<f64>,
    next: Vec<f64>,
}

impl Tangent {
    /// For a method on states like `state`.
    pub fn new(state: &State) -> Tangent {
        let m = state.z.len();
        let zeros = |len: usize| vec![0.0; len];
        Tangent {
            state: state.clone(),
            column: [zeros(m), zeros(m)],
            best: zeros(m),
            distances: vec![FIRST; m],
            map: zeros(m * m),
            next: zeros(m * m),
        }
    }

    /// Puts the tangent map of the step from `z` at `t` before `product`, (m, n) row by row: that of
    /// the first n components.
    ///
    /// # Errors
    /// Those of the step.
    pub fn apply(
        &mut self,
        method: &mut dyn Step,
        t: f64,
        z: &[f64],
        product: &mut [f64],
    ) -> Result<()> {
        let m = z.len();
        let n = product.len() / m;
        for j in 0..m {
            self.differentiate(method, t, z, j)?;
            for (row, entry) in self.map.chunks_exact_mut(m).zip(&self.best) {
                row[j] = *entry;
            }
        }
        for (row, next) in self.map.chunks_exact(m).zip(self.next.chunks_exact_mut(m)) {
            let next = &mut next[..n];
            next.fill(0.0);
            for (a, from) in row.iter().zip(product.chunks_exact(n)) {
                next.iter_mut().zip(from).for_each(|(next, x)| *next += a * x);
            }
        }
        for (row, next) in product.chunks_exact_mut(n).zip(self.next.chunks_exact(m)) {
            row.copy_from_slice(&next[..n]);
        }
        Ok(())
    }

    /// Finds column `j`.
    fn differentiate(&mut self, method: &mut dyn Step, t: f64, z: &[f64], j: usize) -> Result<()> {
        let half = z.len().div_ceil(2);
        let largest = |z: &[f64]| z.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        let own = largest(if j < half { &z[..half] } else { &z[half..] });
        let size = z[j].abs().max(SMALL * own);
        let size = if size > 0.0 { size } else { 1.0 };
        let mut least = f64::INFINITY;
        // What a step has found may be too near for the next.
        let mut part = (4.0 * self.distances[j]).min(FIRST);
        loop {
            // A power of two, so that distances are what they are meant to be.
            let result = self.over(method, t, z, j, (size * part).log2().round().exp2());
            let [sixth, eighth] = &self.column;
            let pairs = sixth.iter().zip(eighth);
            let apart = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()))
                / largest(eighth).max(f64::MIN_POSITIVE);
            if result.is_ok() && apart < least {
                least = apart;
                self.distances[j] = part;
                self.best.copy_from_slice(&self.column[1]);
            } else if least <= NEARLY {
                // Nearer still, rounding wins.
                return Ok(());
            }
            if least <= AGREE || (least.is_finite() && part < LEAST) {
                return Ok(());
            }
            if part < LEAST {
                return result;
            }
            part *= 0.25;
        }
    }

    /// Differences over multiples of `d`.
    fn over(&mut self, method: &mut dyn Step, t: f64, z: &[f64], j: usize, d: f64) -> Result<()> {
        self.column.iter_mut().for_each(|column| column.fill(0.0));
        for (i, eighth) in EIGHTH.iter().enumerate() {
            let sixth = SIXTH.get(i).copied().unwrap_or(0.0);
            for sign in [1.0, -1.0] {
                self.state.z.copy_from_slice(z);
                self.state.z[j] += sign * (i + 1) as f64 * d;
                self.state.carried.fill(Eight::ZERO);
                method.step(0, t, &mut self.state)?;
                let [six, eight] = &mut self.column;
                for ((six, eight), x) in six.iter_mut().zip(eight).zip(&self.state.z) {
                    *six += sign * sixth / d * x;
                    *eight += sign * eighth / d * x;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{Options, build, find};
    use crate::model::named;
    use crate::system::Problem;

    /// The product of the tangent maps of `count` steps of `h` from `z`, row by row.
    fn product(problem: &Problem, method: &str, h: f64, z: &[f64], count: u64) -> Vec<f64> {
        let m = z.len();
        let info = find(method).unwrap();
        let mut method = build(info, problem, h, &Options::default(), &mut || Ok(())).unwrap();
        let mut state = State::new(z, &*method).unwrap();
        let mut tangent = Tangent::new(&state);
        let mut product = vec![0.0; m * m];
        product.iter_mut().step_by(m + 1).for_each(|x| *x = 1.0);
        for k in 0..count {
            let z = state.z.clone();
            tangent.apply(&mut *method, k as f64 * h, &z, &mut product).unwrap();
            method.step(k, k as f64 * h, &mut state).unwrap();
        }
        product
    }

    /// The largest entry of `T' J T - J`.
    fn symplectic_defect(t: &[f64], m: usize) -> f64 {
        let n = m / 2;
        let at = |i: usize, j: usize| t[m * i + j];
        let mut worst = 0.0_f64;
        for i in 0..m {
            for j in 0..m {
                let form = (0..n).map(|k| at(k, i) * at(n + k, j) - at(n + k, i) * at(k, j));
                let unit = f64::from(u8::from(j == i + n)) - f64::from(u8::from(i == j + n));
                worst = worst.max((form.sum::<f64>() - unit).abs());
            }
        }
        worst
    }

    #[test]
    fn steps_of_symplectic_methods_have_symplectic_tangents() {
        let kepler = named("kepler", &[1.0]).unwrap().problem;
        let z = [0.5, 0.0, 0.0, 3.0_f64.sqrt()];
        for method in ["verlet", "yoshida8", "midpoint", "gauss6", "gauss16"] {
            let map = product(&kepler, method, 0.05, &z, 40);
            // Rounding over distances of 1e-2 to 1e-3: 1e-13 a step.
            let defect = symplectic_defect(&map, 4);
            assert!(defect <= 2e-11, "{method}: {defect:e}");
        }
        let defect = symplectic_defect(&product(&kepler, "rk4", 0.05, &z, 40), 4);
        assert!(defect >= 1e-6, "rk4: {defect:e}");
    }

    #[test]
    fn distances_shrink_until_orders_agree() {
        // An angle of a thousand turns is no length.
        let pendulum = named("double pendulum", &[1.0; 5]).unwrap().problem;
        let near = product(&pendulum, "gauss8", 0.1, &[0.3, -0.2, 0.5, 0.1], 1);
        let turns = 6283.185307179586;
        let far = product(&pendulum, "gauss8", 0.1, &[0.3 + turns, -0.2, 0.5, 0.1], 1);
        let off = near.iter().zip(&far).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        // What is left of digits of the angle, over the distance.
        assert!(off <= 1e-9, "{off:e}");
    }
}
