//! Balancing by powers of two: `A' = S^-1 A S`, exact, with rows and columns of like size.
//!
//! Structural matrices mix metres and radians, stiffnesses and flexibilities; in balanced
//! coordinates their norm is near their spectral radius, so fewer doublings do and no entry is lost
//! beside a larger one.

use crate::linalg::dense::{self, exponent_above, power_of_two};
use crate::linalg::kernel::{Body, Eight, Lanes, Layout, Sides, dispatch, doubles, doubles_mut};

/// Rows and columns that differ by less than this factor are left alone: balancing would gain no
/// doubling.
const WORTHWHILE: f64 = 8.0;

/// Exponent of entries that need no further balancing: no scheme halves a matrix of this size.
const SMALL: i32 = -4;

/// Largest exponent of a scale, so that the ratio of two is a double.
const LARGEST: i32 = 500;

/// Exponents of scales `2^d` that balance `a`, already applied to it, or `None` where `a` is
/// balanced well enough as it is.
pub fn balance(layout: Layout, a: &mut [Eight]) -> Option<Vec<i32>> {
    if dispatch(Balanced { layout, a }) {
        return None;
    }
    let mut exponents = vec![0; layout.rows];
    // Osborne's iteration: one coordinate after the other, until none gains.
    for _ in 0..20 {
        let mut settled = true;
        for i in 0..layout.rows {
            let change = match sides(layout, a, i) {
                (Some(row), Some(column))
                    if row.max(column) > SMALL && (row - column).abs() > 1 =>
                {
                    (row - column).div_euclid(2)
                }
                // Nothing feeds back: the one side can be made as small as is of use.
                (Some(row), None) if row > SMALL => row - SMALL,
                (None, Some(column)) if column > SMALL => SMALL - column,
                _ => 0,
            };
            let change = (exponents[i] + change).clamp(-LARGEST, LARGEST) - exponents[i];
            if change != 0 {
                exponents[i] += change;
                rescale(layout, a, i, change);
                settled = false;
            }
        }
        if settled {
            break;
        }
    }
    exponents.iter().any(|&d| d != 0).then_some(exponents)
}

/// 1-norm of `tau A` in balanced coordinates, or as given where that is less; `a` row by row.
pub fn balanced_norm(rows: usize, a: &[f64], tau: f64) -> f64 {
    let layout = Layout::new(rows);
    let scaled: Vec<f64> = a.iter().map(|a| tau * a).collect();
    let Ok(mut packed) = dense::zeros(layout.packs(rows)) else {
        return f64::INFINITY;
    };
    dense::pack(layout, &scaled, &mut packed);
    dense::transpose(layout, &mut packed);
    let given = dense::norms(layout, &packed)[0];
    balance(layout, &mut packed);
    given.min(dense::norms(layout, &packed)[0])
}

/// Turns `X' = S^-1 X S` back into `X`.
pub fn restore(layout: Layout, exponents: &[i32], x: &mut [Eight]) {
    let x = doubles_mut(x);
    for (j, dj) in exponents.iter().enumerate() {
        let column = &mut x[j * layout.doubles()..][..layout.rows];
        for (x, di) in column.iter_mut().zip(exponents) {
            *x *= power_of_two(di - dj);
        }
    }
}

/// Whether balancing would gain nothing.
struct Balanced<'a> {
    layout: Layout,
    a: &'a [Eight],
}

impl Body for Balanced<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<V: Lanes>(self) -> bool {
        is_balanced::<V>(self.layout, self.a)
    }
}

/// Whether balancing would gain nothing, from the sums of rows and columns.
#[inline(always)]
pub fn is_balanced<V: Lanes>(layout: Layout, a: &[Eight]) -> bool {
    let mut short = [Eight::ZERO; 8];
    let mut long = Vec::new();
    let sums = if layout.height <= 4 {
        &mut short[..2 * layout.height]
    } else {
        long.resize(2 * layout.height, Eight::ZERO);
        &mut long[..]
    };
    let (rows, columns) = sums.split_at_mut(layout.height);
    Sides { layout, a, rows: &mut *rows, columns: doubles_mut(columns) }.run::<V>();
    let small = power_of_two(SMALL);
    let sides = doubles(rows).iter().zip(doubles(columns)).take(layout.rows);
    sides.fold(true, |balanced, (&row, &column)| {
        let even = (row <= WORTHWHILE * column) & (column <= WORTHWHILE * row);
        balanced & (even | ((row <= small) & (column <= small)))
    })
}

/// Exponents of the largest magnitudes off the diagonal in row and column `i`.
fn sides(layout: Layout, a: &[Eight], i: usize) -> (Option<i32>, Option<i32>) {
    let a = doubles(a);
    let larger = |largest: f64, x: f64| if x.abs() > largest { x.abs() } else { largest };
    let others = || (0..layout.rows).filter(|&j| j != i);
    let row = others().map(|j| a[j * layout.doubles() + i]).fold(0.0, larger);
    let column = others().map(|j| a[i * layout.doubles() + j]).fold(0.0, larger);
    let exponent = |x: f64| (x >= f64::MIN_POSITIVE).then(|| exponent_above(x));
    (exponent(row), exponent(column))
}

/// Multiplies column `i` by `2^change` and row `i` by its inverse.
fn rescale(layout: Layout, a: &mut [Eight], i: usize, change: i32) {
    let (up, down) = (power_of_two(change), power_of_two(-change));
    let a = doubles_mut(a);
    for j in (0..layout.rows).filter(|&j| j != i) {
        a[i * layout.doubles() + j] *= up;
        a[j * layout.doubles() + i] *= down;
    }
}
