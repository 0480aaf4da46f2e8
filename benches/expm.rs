use spim::expm::*;
fn main() {
    let m = 6;
    let mut a = vec![0.0; m * m];
    for i in 0..m * m { a[i] = ((i * 7919 + 13) % 101) as f64 / 101.0 * 4.0 - 2.0; }
    let exact = std::env::args().any(|a| a == "exact");
    let r = Recipe { scheme: if exact { Scheme::Exact } else { Scheme::Sid }, doublings: None };
    let mut out = vec![0.0; m * m];
    let n = if std::env::args().any(|a| a == "long") { 1000000 } else { 2000 };
    let t = std::time::Instant::now();
    for _ in 0..n {
        exponentials(m, r, &a, &mut out, &mut || Ok(())).unwrap();
    }
    println!("{:?} {}", t.elapsed() / n, out[0]);
}
