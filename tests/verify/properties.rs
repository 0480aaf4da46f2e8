//! Properties of exponentials over random sizes and values.

use proptest::prelude::*;
use spim::expm::{Correction, Propagator, Recipe, Scheme, exponentials};

/// A size and that many rows and columns of entries up to `largest`.
fn matrices(
    rows: std::ops::Range<usize>,
    largest: f64,
) -> impl Strategy<Value = (usize, Vec<f64>)> {
    rows.prop_flat_map(move |m| {
        (Just(m), proptest::collection::vec(-largest..largest, m * m..=m * m))
    })
}

fn expm(rows: usize, scheme: Scheme, a: &[f64]) -> spim::Result<Vec<f64>> {
    let mut out = vec![0.0; rows * rows];
    let recipe = Recipe { scheme, doublings: None };
    exponentials(rows, recipe, a, &mut out, &mut || Ok(()))?;
    Ok(out)
}

fn largest(x: impl IntoIterator<Item = f64>) -> f64 {
    x.into_iter().fold(0.0, |largest, x| x.abs().max(largest))
}

proptest! {
    #[test]
    fn all_schemes_agree_to_rounding((m, a) in matrices(1..13, 1.0)) {
        let exact = expm(m, Scheme::Exact, &a).unwrap();
        for scheme in [Scheme::Sid, Scheme::Pade([13, 13]), Scheme::Pade([7, 6])] {
            let x = expm(m, scheme, &a).unwrap();
            let error = largest(x.iter().zip(&exact).map(|(x, y)| x - y));
            // 20 u |A| of the largest entry; SciPy's worst in its own tests is of that size.
            let bound = 20.0 * f64::EPSILON * m as f64 * largest(exact.iter().copied());
            prop_assert!(error <= bound, "{scheme:?}: {error:e} > {bound:e}");
        }
    }

    #[test]
    fn any_finite_matrix_gives_finite_entries_or_an_error((m, a) in matrices(1..10, 1e300)) {
        for scheme in [Scheme::Exact, Scheme::Sid, Scheme::Spim([2, 2]), Scheme::Pim(4)] {
            if let Ok(x) = expm(m, scheme, &a) {
                prop_assert!(x.iter().all(|x| x.is_finite()));
            }
        }
    }

    #[test]
    fn propagators_of_hamiltonian_matrices_are_symplectic((n, a) in matrices(1..6, 1.0)) {
        // [A B; C -A^T] with B and C the symmetric parts of A.
        let m = 2 * n;
        let mut h = vec![0.0; m * m];
        for i in 0..n {
            for j in 0..n {
                let symmetric = a[i * n + j] + a[j * n + i];
                h[i * m + j] = a[i * n + j];
                h[(n + j) * m + n + i] = -a[i * n + j];
                h[i * m + n + j] = symmetric;
                h[(n + i) * m + j] = -symmetric;
            }
        }
        for correction in [Correction::Polish, Correction::Exact] {
            let recipe = Recipe::auto(m);
            let p = Propagator::new(m, &h, 0.3, recipe, Some(correction), &mut || Ok(())).unwrap();
            let mut w = vec![0.0; m * m];
            p.matrix(&mut w);
            let size = largest(w.iter().copied());
            let defect = p.symplectic_defect(&mut || Ok(())).unwrap();
            let rounding = match correction {
                Correction::Exact => 2.0_f64.powi(-95),
                _ => 4.0 * f64::EPSILON,
            };
            let bound = rounding * m as f64 * size * size;
            prop_assert!(defect <= bound, "{correction:?}: {defect:e} > {bound:e}");
        }
    }
}
