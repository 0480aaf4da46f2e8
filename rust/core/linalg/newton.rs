//! LU factors in memory of their own: what Newton's method asks for in each step.
//!
//! Rows are exchanged for the largest pivot; plain loops, the same bits on every machine.

/// Factors of a square matrix.
pub struct Lu {
    rows: usize,
    /// Row by row.
    matrix: Vec<f64>,
    order: Vec<usize>,
    spare: Vec<f64>,
}

impl Lu {
    /// Room for a matrix.
    pub fn new(rows: usize) -> Lu {
        Lu {
            rows,
            matrix: vec![0.0; rows * rows],
            order: (0..rows).collect(),
            spare: vec![0.0; rows],
        }
    }

    /// The matrix to factor, row by row.
    pub fn matrix(&mut self) -> &mut [f64] {
        &mut self.matrix
    }

    /// Factors it; `false` where a pivot vanishes.
    #[must_use]
    pub fn factor(&mut self) -> bool {
        let n = self.rows;
        self.order.iter_mut().enumerate().for_each(|(i, order)| *order = i);
        for j in 0..n {
            let largest = (j..n).max_by(|&i, &k| {
                let [i, k] = [i, k].map(|i| self.matrix[i * n + j].abs());
                i.total_cmp(&k)
            });
            let at = largest.unwrap_or(j);
            if at != j {
                self.order.swap(at, j);
                for c in 0..n {
                    self.matrix.swap(at * n + c, j * n + c);
                }
            }
            let pivot = self.matrix[j * n + j];
            if pivot == 0.0 || !pivot.is_finite() {
                return false;
            }
            let (above, below) = self.matrix.split_at_mut((j + 1) * n);
            let above = &above[j * n..];
            for row in below.chunks_exact_mut(n) {
                let factor = row[j] / pivot;
                row[j] = factor;
                if factor != 0.0 {
                    for (x, y) in row[j + 1..].iter_mut().zip(&above[j + 1..]) {
                        *x -= factor * y;
                    }
                }
            }
        }
        true
    }

    /// `x <- A^-1 x`.
    pub fn solve(&mut self, x: &mut [f64]) {
        let n = self.rows;
        for (to, from) in self.spare.iter_mut().zip(&self.order) {
            *to = x[*from];
        }
        for i in 0..n {
            let row = &self.matrix[i * n..][..i];
            let sum: f64 = row.iter().zip(&x[..i]).map(|(a, x)| a * x).sum();
            x[i] = self.spare[i] - sum;
        }
        for i in (0..n).rev() {
            let row = &self.matrix[i * n..][..n];
            let sum: f64 = row[i + 1..].iter().zip(&x[i + 1..]).map(|(a, x)| a * x).sum();
            x[i] = (x[i] - sum) / row[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_with_a_zero_on_its_diagonal_is_solved() {
        let mut lu = Lu::new(3);
        lu.matrix().copy_from_slice(&[0.0, 2.0, 1.0, 1.0, 1.0, 1.0, 4.0, 0.0, -2.0]);
        assert!(lu.factor());
        // A (1, 2, 3)
        let mut x = [7.0, 6.0, -2.0];
        lu.solve(&mut x);
        assert_eq!(x, [1.0, 2.0, 3.0]);
        lu.matrix().fill(1.0);
        assert!(!lu.factor());
    }
}
