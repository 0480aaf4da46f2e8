use spim::linalg::kernel::*;
use spim::linalg::pair::*;
use spim::linalg::twofold;
#[test]
fn pairs() {
    let layout = Layout::new(1);
    let mk = |x: f64, y: f64| { let mut h = [Eight::ZERO]; let mut l = [Eight::ZERO]; h[0].0[0] = x; l[0].0[0] = y; (h, l) };
    let (ah, al) = mk(0.3, 1.1e-17);
    let (bh, bl) = mk(0.7, -2.1e-17);
    let (mut ch, mut cl) = mk(0.0, 0.0);
    for depth in [Depth::Two, Depth::Three] {
        let mut mem = vec![Eight::ZERO; 6];
        let mut e = PairEngine::new(layout, depth, &mut mem);
        e.multiply(Pair { hi: &ah, lo: &al }, Pair { hi: &bh, lo: &bl }, None, &mut PairMut { hi: &mut ch, lo: &mut cl }, &mut || Ok(())).unwrap();
        println!("Eight {depth:?} {:?} {:?}", ch[0].0[0], cl[0].0[0]);
        for m in &mem { println!("Eight   {:?}", m.0[0]); }
    }
    let p = twofold::two_product(0.3, 0.7);
    println!("Eight {:?}", twofold::sum(p, [0.3 * -2.1e-17 + 0.7 * 1.1e-17, 0.0]));
    dispatch(Combination { terms: [([0.1, 1e-18], &ah[..], &al[..]), ([-5.0, 1e-17], &bh[..], &bl[..])], hi: &mut ch, lo: &mut cl });
    println!("Eight {:?} {:?}", ch[0].0[0], cl[0].0[0]);
}
