//! Numbers as unevaluated sums `[hi, lo]` of two doubles: 106 bits.

use super::kernel::fused;

/// The rounded sum and its error, exactly (Knuth).
#[inline]
pub fn two_sum(a: f64, b: f64) -> [f64; 2] {
    let s = a + b;
    let t = s - a;
    [s, (a - (s - t)) + (b - t)]
}

/// The rounded product and its error, exactly.
#[inline]
pub fn two_product(a: f64, b: f64) -> [f64; 2] {
    let p = a * b;
    [p, fused(a, b, -p)]
}

/// `a + b`.
#[inline]
pub fn sum(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let [s, e] = two_sum(a[0], b[0]);
    two_sum(s, e + (a[1] + b[1]))
}

/// `a k`.
#[inline]
pub fn times(a: [f64; 2], k: f64) -> [f64; 2] {
    let [p, e] = two_product(a[0], k);
    two_sum(p, fused(a[1], k, e))
}

/// `a / k`.
pub fn divide(a: [f64; 2], k: f64) -> [f64; 2] {
    let q = a[0] / k;
    let rest = fused(-q, k, a[0]) + a[1];
    two_sum(q, rest / k)
}

/// `a b`.
#[inline]
pub fn product(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let [p, e] = two_product(a[0], b[0]);
    two_sum(p, fused(a[0], b[1], fused(a[1], b[0], e)))
}

/// `a / b`.
pub fn quotient(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let first = a[0] / b[0];
    let rest = sum(a, negative(times(b, first)));
    let second = rest[0] / b[0];
    let left = sum(rest, negative(times(b, second)));
    sum([first, 0.0], two_sum(second, left[0] / b[0]))
}

/// The square root.
pub fn root(a: [f64; 2]) -> [f64; 2] {
    let first = a[0].sqrt();
    let rest = sum(a, negative(two_product(first, first)));
    let second = rest[0] / (2.0 * first);
    // One more step of Newton takes what the square of the second leaves.
    let root = two_sum(first, second);
    let left = sum(a, negative(product(root, root)));
    sum(root, [left[0] / (2.0 * first), 0.0])
}

/// `a / b` of doubles.
pub fn ratio(a: f64, b: f64) -> [f64; 2] {
    divide([a, 0.0], b)
}

/// `-a`.
pub fn negative(a: [f64; 2]) -> [f64; 2] {
    [-a[0], -a[1]]
}

/// `x . y`, each term exactly multiplied, summed in pairs (Ogita, Rump & Oishi, 2005).
pub fn dot(x: impl IntoIterator<Item = f64>, y: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let (mut s, mut c) = (0.0, 0.0);
    for (x, y) in x.into_iter().zip(y) {
        let [p, e] = two_product(x, y);
        let [t, r] = two_sum(s, p);
        s = t;
        c += e + r;
    }
    two_sum(s, c)
}
