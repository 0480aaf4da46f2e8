//! Exponentials against closed forms.

use spim::expm::{Recipe, Scheme, exponential, exponentials};

fn expm(rows: usize, scheme: Scheme, a: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; rows * rows];
    let recipe = Recipe { scheme, doublings: None };
    exponentials(rows, recipe, a, &mut out, &mut || Ok(())).unwrap();
    out
}

#[test]
fn exact_rounds_a_rotation_correctly() {
    // cos and sin of 4.25 to 20 digits: -0.44608748991379282, -0.89498936...
    let x = expm(2, Scheme::Exact, &[0.0, 4.25, -4.25, 0.0]);
    assert_eq!((x[0], x[1]), (4.25_f64.cos(), 4.25_f64.sin()));
    assert_eq!((x[3], x[2]), (x[0], -x[1]));
}

#[test]
fn every_scheme_knows_a_rotation_to_a_few_units() {
    let schemes = [
        Scheme::Sid,
        Scheme::Pade([13, 13]),
        Scheme::Pade([5, 3]),
        Scheme::Spim([2, 2]),
        Scheme::Pim(4),
    ];
    for scheme in schemes {
        let x = expm(2, scheme, &[0.0, 4.25, -4.25, 0.0]);
        let error = (x[0] - 4.25_f64.cos()).abs().max((x[1] - 4.25_f64.sin()).abs());
        assert!(error <= 1e-15, "{scheme:?}: {error:e}"); // NUMERICS: 9 units of 1.1e-16
    }
}

#[test]
fn pairs_hold_a_hundred_bits() {
    // cos(0.3) - 1 and sin(0.3) of the double 0.3 as pairs, from mpmath at 60 digits.
    let expected = [
        [-0.04466351087439398, 3.0223687446409697e-19],
        [0.29552020666133955, 1.8315357276792536e-17],
    ];
    let a = [0.0, 0.3, -0.3, 0.0];
    let t = exponential(2, Recipe::EXACT, &a, 1.0, true, &mut || Ok(())).unwrap();
    for (i, [hi, lo]) in expected.into_iter().enumerate() {
        assert_eq!(t.hi[0].0[i], hi);
        let error = (t.lo[0].0[i] - lo).abs();
        assert!(error <= 2.0_f64.powi(-100), "entry {i}: {error:e}");
    }
}

#[test]
fn a_result_beyond_the_largest_double_is_an_error() {
    let mut out = [0.0];
    let result = exponentials(1, Recipe::EXACT, &[1000.0], &mut out, &mut || Ok(()));
    assert!(matches!(*result.unwrap_err(), spim::Error::Overflow(_)));
}

#[test]
fn decay_keeps_its_relative_accuracy() {
    // exp(-40) by squaring, not as 1 + increment, whose last digit is 1e-16.
    for scheme in [Scheme::Exact, Scheme::Sid] {
        let x = expm(1, scheme, &[-40.0])[0];
        let error = (x / (-40.0_f64).exp() - 1.0).abs();
        assert!(error <= 40.0 * f64::EPSILON, "{scheme:?}: {error:e}"); // u |A|
    }
}
