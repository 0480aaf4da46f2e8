//! Singular values by rotations of columns (Hestenes 1958): to high relative accuracy, small ones too,
//! where columns differ in size (Demmel & Veselic 1992).

/// Sweeps at most; six do.
const SWEEPS: usize = 30;

/// Rotates the columns of `a`, `rows` x `columns` and column by column, until they are orthogonal, and
/// those of `v` alike. Lengths of the columns are then the singular values, in no order.
pub fn orthogonalise(rows: usize, a: &mut [f64], v: &mut [f64]) {
    let columns = a.len() / rows;
    let height = v.len() / columns;
    for _ in 0..SWEEPS {
        let mut settled = true;
        for j in 1..columns {
            for i in 0..j {
                let [x, y] = [&a[rows * i..][..rows], &a[rows * j..][..rows]];
                let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
                let (xx, yy, xy) = (dot(x, x), dot(y, y), dot(x, y));
                if xy.abs() <= 4.0 * f64::EPSILON * (xx * yy).sqrt() || xy == 0.0 {
                    continue;
                }
                settled = false;
                let zeta = (yy - xx) / (2.0 * xy);
                let tangent = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let cos = 1.0 / (1.0 + tangent * tangent).sqrt();
                rotate(a, rows, [i, j], cos, cos * tangent);
                rotate(v, height, [i, j], cos, cos * tangent);
            }
        }
        if settled {
            break;
        }
    }
}

fn rotate(a: &mut [f64], rows: usize, [i, j]: [usize; 2], cos: f64, sin: f64) {
    let (left, right) = a.split_at_mut(rows * j);
    for (x, y) in left[rows * i..][..rows].iter_mut().zip(&mut right[..rows]) {
        (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_graded_matrix_keeps_its_small_singular_value() {
        // Columns of sizes 1e8 and 1; the product of singular values is the determinant, 1e8.
        let mut a = [1e8, 1e8, 1.0, 2.0];
        let mut v = [1.0, 0.0, 0.0, 1.0];
        orthogonalise(2, &mut a, &mut v);
        let size = |x: &[f64]| (x[0] * x[0] + x[1] * x[1]).sqrt();
        let (large, small) = (size(&a[..2]).max(size(&a[2..])), size(&a[..2]).min(size(&a[2..])));
        assert!((large * small / 1e8 - 1.0).abs() < 1e-15);
        assert!((v[0] * v[2] + v[1] * v[3]).abs() < 1e-16);
    }
}
