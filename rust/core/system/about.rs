//! Any system, split at a given matrix: usually that of its linearisation at a point.

use std::sync::Arc;

use super::{Flow, SemiLinear};
use crate::error::Result;
use crate::linalg::kernel::Eight;
use crate::linalg::twofold;

/// `z' = A z + (f(t, z) - A z)`.
pub struct About {
    flow: Arc<dyn Flow>,
    matrix: Vec<f64>,
}

impl About {
    /// Of a system and A, row by row, as large as its state.
    pub fn new(flow: Arc<dyn Flow>, matrix: Vec<f64>) -> About {
        About { flow, matrix }
    }
}

impl Flow for About {
    fn len(&self) -> usize {
        self.flow.len()
    }
    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.flow.rate(t, z, f)
    }
    fn rates(
        &self,
        t: &[Eight],
        z: &[Eight],
        f: &mut [Eight],
        count: usize,
        scratch: &mut [f64],
    ) -> Result<()> {
        self.flow.rates(t, z, f, count, scratch)
    }
    fn scratch_len(&self) -> usize {
        self.flow.scratch_len()
    }
    fn linear(&self) -> Option<&[f64]> {
        Some(&self.matrix)
    }
    fn jacobian(&self, t: f64, z: &[f64], out: &mut [f64]) -> Result<bool> {
        self.flow.jacobian(t, z, out)
    }
}

impl SemiLinear for About {
    fn matrix(&self) -> &[f64] {
        &self.matrix
    }
    /// The difference is rounded once, so that what it lacks is what the rates themselves lack.
    fn remainder(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        self.flow.rate(t, z, f)?;
        for (f, row) in f.iter_mut().zip(self.matrix.chunks_exact(z.len())) {
            let linear = twofold::dot(row.iter().copied(), z.iter().copied());
            *f = twofold::sum([*f, 0.0], twofold::negative(linear))[0];
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::henon_heiles::HenonHeiles;

    #[test]
    fn a_split_at_the_linear_part_is_the_exact_remainder_but_for_rounding_of_the_rates() {
        let flow: Arc<dyn Flow> = Arc::new(HenonHeiles);
        let split = About::new(flow.clone(), flow.linear().unwrap().to_vec());
        let z = [0.31, -0.22, 0.13, 0.07];
        let (mut given, mut exact) = ([0.0; 4], [0.0; 4]);
        split.remainder(0.0, &z, &mut given).unwrap();
        SemiLinear::remainder(&HenonHeiles, 0.0, &z, &mut exact).unwrap();
        for (x, y) in given.iter().zip(exact) {
            // Rates of 0.3 are rounded to 2^-54, twice.
            assert!((x - y).abs() <= 1.2e-16, "{x} {y}");
        }
    }
}
