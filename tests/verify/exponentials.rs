use spim::expm::{Recipe, Scheme, exponentials};

fn expm(rows: usize, scheme: Scheme, a: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; rows * rows];
    let recipe = Recipe { scheme, doublings: None };
    exponentials(rows, recipe, a, &mut out, &mut || Ok(())).unwrap();
    out
}

#[test]
fn rotation() {
    let w = 4.25;
    for scheme in [Scheme::Exact, Scheme::Sid, Scheme::Pade([13, 13]), Scheme::Pade([5,3]), Scheme::Spim([2, 2]), Scheme::Pim(4)] {
        let x = expm(2, scheme, &[0.0, w, -w, 0.0]);
        println!("{scheme:?} {:e} {:e}", x[0] - w.cos(), x[1] - w.sin());
    }
}
