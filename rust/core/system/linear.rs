//! `z' = A z + f(t)`.

use std::sync::Arc;

use super::{Flow, Generator, Hamiltonian, Load};
use crate::error::{Error, Result};
use crate::linalg::kernel::Layout;
use crate::linalg::{dense, symplectic, twofold};

/// A linear system with constant coefficients.
#[derive(Clone)]
pub struct Linear {
    rows: usize,
    a: Vec<f64>,
    hamiltonian: bool,
    load: Option<Arc<dyn Load>>,
    generator: Generator,
}

impl Linear {
    /// `a`: `rows x rows`, row by row, finite.
    ///
    /// # Errors
    /// [`Error::Argument`] for a size that does not fit, or an entry that is not finite;
    /// [`Error::Memory`].
    pub fn new(rows: usize, a: Vec<f64>) -> Result<Linear> {
        if rows == 0 || a.len() != rows * rows {
            return Err(Error::argument(format!(
                "A: {} entries are not a {rows} x {rows} matrix",
                a.len()
            )));
        }
        if let Some(at) = a.iter().position(|x| !x.is_finite()) {
            let (row, column) = (at / rows, at % rows);
            return Err(Error::argument(format!("A: entry ({row}, {column}) is {}", a[at])));
        }
        let layout = Layout::new(rows);
        let mut packed = dense::zeros(layout.packs(rows))?;
        // The transposed matrix, which is Hamiltonian when A is.
        dense::pack(layout, &a, &mut packed);
        let hamiltonian = symplectic::is_hamiltonian(layout, &packed);
        Ok(Linear { rows, a, hamiltonian, load: None, generator: Generator::default() })
    }

    /// The same system under a load, of which `generator` makes what is in closed form.
    ///
    /// # Errors
    /// [`Error::Argument`] for sizes that do not fit.
    pub fn with_load(&self, load: Arc<dyn Load>, generator: Generator) -> Result<Linear> {
        let size = generator.start.len();
        if generator.inputs.len() != self.rows * size || generator.matrix.len() != size * size {
            return Err(Error::argument(format!(
                "load: a generator of {size} components needs {} x {size} inputs and a {size} x \
                 {size} matrix",
                self.rows
            )));
        }
        Ok(Linear { load: Some(load), generator, ..self.clone() })
    }

    /// Components of the state.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The matrix, row by row.
    pub fn matrix(&self) -> &[f64] {
        &self.a
    }

    /// The load.
    pub fn load(&self) -> Option<&Arc<dyn Load>> {
        self.load.as_ref()
    }

    /// What is stepped along with the state, at the start of the run.
    pub fn generated(&self) -> &[f64] {
        &self.generator.start
    }

    /// `[A B; 0 Gamma]`, row by row: the matrix of the state and what is stepped along with it.
    pub fn whole(&self) -> Vec<f64> {
        let (m, k) = (self.rows, self.generator.start.len());
        let mut whole = Vec::with_capacity((m + k) * (m + k));
        for i in 0..m {
            whole.extend_from_slice(&self.a[i * m..][..m]);
            whole.extend_from_slice(&self.generator.inputs[i * k..][..k]);
        }
        for i in 0..k {
            whole.resize(whole.len() + m, 0.0);
            whole.extend_from_slice(&self.generator.matrix[i * k..][..k]);
        }
        whole
    }

    /// Whether `A` is Hamiltonian to rounding, so that there is an energy.
    pub fn is_hamiltonian(&self) -> bool {
        self.hamiltonian
    }
}

impl Flow for Linear {
    fn len(&self) -> usize {
        self.rows
    }

    fn linear(&self) -> Option<&[f64]> {
        Some(self.matrix())
    }

    fn jacobian(&self, _t: f64, _z: &[f64], out: &mut [f64]) -> Result<bool> {
        out.copy_from_slice(&self.a);
        Ok(true)
    }

    fn rate(&self, t: f64, z: &[f64], f: &mut [f64]) -> Result<()> {
        match &self.load {
            Some(load) => load.value(t, f)?,
            None => f.fill(0.0),
        }
        for (f, row) in f.iter_mut().zip(self.a.chunks_exact(self.rows)) {
            *f += row.iter().zip(z).map(|(a, z)| a * z).sum::<f64>();
        }
        Ok(())
    }
}

impl Hamiltonian for Linear {
    /// `H = z^T S z / 2` with `S = J^-1 A`, in pairs: in doubles, stiff structures lose ten digits.
    fn energy(&self, _t: f64, z: &[f64]) -> Result<f64> {
        if !self.hamiltonian {
            return Err(Error::unsupported(
                "energy: A is not Hamiltonian (J A is not symmetric for z = [q; p]), so no quadratic \
                 energy is conserved",
            ));
        }
        // With A z = [q'; p']: z^T S z = p . q' - q . p'.
        let half = self.rows / 2;
        let (q, p) = z.split_at(half);
        let mut total = [0.0; 2];
        for (i, (q, p)) in q.iter().zip(p).enumerate() {
            let row = |i: usize| self.a[i * self.rows..][..self.rows].iter().copied();
            let q_rate = twofold::dot(row(i), z.iter().copied());
            let p_rate = twofold::dot(row(half + i), z.iter().copied());
            total = twofold::sum(total, twofold::times(q_rate, *p));
            total = twofold::sum(total, twofold::negative(twofold::times(p_rate, *q)));
        }
        let energy = 0.5 * total[0];
        if energy.is_finite() {
            Ok(energy)
        } else {
            Err(Error::overflow("energy: exceeds 1.8e308"))
        }
    }
}
