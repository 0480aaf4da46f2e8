//! Cholesky factors in pairs of doubles.

use super::twofold;

/// `A = L L^T`, `L` lower triangular; row by row, in pairs.
pub struct Cholesky {
    n: usize,
    l: Vec<[f64; 2]>,
}

impl Cholesky {
    /// Factors a symmetric matrix, of which the lower triangle is read, row by row.
    ///
    /// # Errors
    /// The number of the first pivot that is not positive.
    pub fn new(n: usize, a: &[f64]) -> Result<Cholesky, usize> {
        let mut l = vec![[0.0; 2]; n * n];
        for i in 0..n {
            let (above, rest) = l.split_at_mut(i * n);
            let row = &mut rest[..n];
            for j in 0..i {
                let other = &above[j * n..][..=j];
                let left = twofold::sum([a[i * n + j], 0.0], minus_dot(&row[..j], &other[..j]));
                row[j] = twofold::quotient(left, other[j]);
            }
            let pivot = twofold::sum([a[i * n + i], 0.0], minus_dot(&row[..i], &row[..i]));
            // What rounding alone leaves of a zero is no pivot.
            if pivot[0].is_nan() || pivot[0] <= 1e-28 * a[i * n + i].abs() {
                return Err(i);
            }
            row[i] = twofold::root(pivot);
        }
        Ok(Cholesky { n, l })
    }

    /// `L`.
    pub fn factor(&self) -> &[[f64; 2]] {
        &self.l
    }

    /// `L^-1`.
    pub fn inverse(&self) -> Vec<[f64; 2]> {
        let n = self.n;
        // By columns of the inverse, kept as rows so that sums run along memory.
        let mut columns = vec![[0.0; 2]; n * n];
        for (j, column) in columns.chunks_exact_mut(n).enumerate() {
            column[j] = twofold::quotient([1.0, 0.0], self.l[j * n + j]);
            for i in j + 1..n {
                let row = &self.l[i * n..][..=i];
                column[i] = twofold::quotient(minus_dot(&row[j..i], &column[j..i]), row[i]);
            }
        }
        let mut inverse = vec![[0.0; 2]; n * n];
        for i in 0..n {
            for j in 0..=i {
                inverse[i * n + j] = columns[j * n + i];
            }
        }
        inverse
    }
}

fn minus_dot(x: &[[f64; 2]], y: &[[f64; 2]]) -> [f64; 2] {
    twofold::negative(dot(x, y))
}

/// `x . y` of pairs.
pub fn dot(x: &[[f64; 2]], y: &[[f64; 2]]) -> [f64; 2] {
    let terms = x.iter().zip(y);
    terms.fold([0.0; 2], |total, (x, y)| twofold::sum(total, twofold::product(*x, *y)))
}
