//! Elementary functions over lanes: the same bits at every level, so without fused multiply-add.

use super::pack::{Lanes, Pack};

/// `pi/2` in parts of 33 bits, so that their products with whole numbers below 2^20 are exact.
const HALF_PI: [f64; 3] =
    [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_951e-21];

/// Adding and taking it away again rounds to a whole number.
const TO_WHOLE: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52

/// Below it no quarter turn is taken off.
const SMALL: f64 = 0.785;

/// Beyond it a reduction needs more parts of pi.
const FAR: f64 = 1e5;

/// `sin x = x + x^3 p(x^2)` below pi/4. Source: Sun Microsystems, fdlibm (1993), k_sin.c.
const SIN: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// `cos x = 1 - x^2/2 + x^4 p(x^2)` below pi/4. Source: as [`SIN`], k_cos.c.
const COS: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// `c_0 + c_1 x + ...`
#[inline(always)]
fn polynomial<V: Lanes>(c: &[f64; 6], x: Pack<V>) -> Pack<V> {
    // In pairs: half as many steps wait for each other.
    let square = x * x;
    let low = c[0] + c[1] * x;
    let middle = c[2] + c[3] * x;
    let high = c[4] + c[5] * x;
    low + square * (middle + square * high)
}

impl<V: Lanes> Pack<V> {
    /// Sine and cosine, within 1 unit in the last place.
    #[inline(always)]
    pub fn sin_cos(self) -> (Self, Self) {
        let x = self;
        let farthest = x.abs().largest();
        if farthest <= SMALL {
            return first_octants(x, Pack::splat(0.0));
        }
        let reducible = farthest <= FAR;
        if !reducible {
            return far(x);
        }
        let turns = (x * std::f64::consts::FRAC_2_PI + TO_WHOLE) - TO_WHOLE;
        // x - turns pi/2 = r + rest.
        let near = x - turns * HALF_PI[0];
        let second = turns * HALF_PI[1];
        let r = near - second;
        let rest = ((near - r) - second) - turns * HALF_PI[2];
        let (sin, cos) = first_octants(r, rest);
        // Quarter turns, -2 to 2: 1 and -1 swap the two, and some change their signs.
        let quarter = turns - 4.0 * ((0.25 * turns + TO_WHOLE) - TO_WHOLE);
        let odd = (quarter.abs() - 1.0).abs() - 0.5;
        let (s, c) = (cos.where_negative(odd, sin), sin.where_negative(odd, cos));
        let sign_s = (quarter + 0.5) * (1.5 - quarter);
        let sign_c = (quarter + 1.5) * (0.5 - quarter);
        ((-s).where_negative(sign_s, s), (-c).where_negative(sign_c, c))
    }
}

/// Sine and cosine of `r + rest`, r at most pi/4 and rest its rounding.
#[inline(always)]
fn first_octants<V: Lanes>(r: Pack<V>, rest: Pack<V>) -> (Pack<V>, Pack<V>) {
    let square = r * r;
    let cube = square * r;
    let sin = r + (cube * polynomial(&SIN, square) + rest * (1.0 - 0.5 * square));
    let half = 0.5 * square;
    let most = 1.0 - half;
    let cos =
        most + (((1.0 - most) - half) + (square * square * polynomial(&COS, square) - r * rest));
    (sin, cos)
}

/// Lane by lane, for arguments that are large or no numbers.
#[inline(never)]
fn far<V: Lanes>(x: Pack<V>) -> (Pack<V>, Pack<V>) {
    let mut lanes = [0.0; 8];
    x.store(&mut lanes);
    let both = lanes.map(libm::sincos);
    (Pack::load(&both.map(|both| both.0)), Pack::load(&both.map(|both| both.1)))
}

#[cfg(test)]
mod tests {
    use crate::linalg::kernel::{Body, Eight, Lanes, Level, Pack, dispatch, force, packs};

    struct SinCos(Eight);

    impl Body for SinCos {
        type Output = [[f64; 8]; 2];
        #[inline(always)]
        fn run<V: Lanes>(self) -> [[f64; 8]; 2] {
            let (sin, cos) = packs::<V>(&[self.0])[0].sin_cos();
            let mut out = [[0.0; 8]; 2];
            sin.store(&mut out[0]);
            cos.store(&mut out[1]);
            out
        }
    }

    #[test]
    fn sine_and_cosine_are_within_a_unit_of_the_last_place() {
        let mut x = 1.0_f64;
        for round in 0..40_000 {
            // Small, ordinary, near multiples of pi/2, and far.
            let scale = [1e-9, 0.3, 3.0, 1e2, 9e4, 1e9][round % 6];
            let at = Eight(std::array::from_fn(|i| {
                x = (x * 16807.0) % 2_147_483_647.0;
                let part = x / 2_147_483_647.0 - 0.5;
                match i {
                    0 => (part * 1e4).round() * std::f64::consts::FRAC_PI_2,
                    _ => 2.0 * scale * part,
                }
            }));
            let found = dispatch(SinCos(at));
            for (x, [sin, cos]) in at.0.iter().zip((0..8).map(|i| [found[0][i], found[1][i]])) {
                for (found, right) in [(sin, libm::sin(*x)), (cos, libm::cos(*x))] {
                    // libm itself is within 0.51 units.
                    let unit = f64::from_bits(right.abs().to_bits() + 1) - right.abs();
                    assert!((found - right).abs() <= 1.01 * unit, "{x:e}: {found:e} {right:e}");
                }
            }
            for level in Level::ALL {
                force(Some(level));
                assert_eq!(dispatch(SinCos(at)), found, "{level:?}");
            }
            force(None);
            let one = Pack::<f64>(at.0[3]).sin_cos();
            assert_eq!([one.0.0, one.1.0], [found[0][3], found[1][3]]);
        }
    }

    #[test]
    fn what_is_no_number_stays_none() {
        let found =
            dispatch(SinCos(Eight([f64::NAN, f64::INFINITY, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0])));
        assert!(found[0][0].is_nan() && found[0][1].is_nan() && found[0][2] == 0.0);
        assert!((found[1][5] - 3.0_f64.cos()).abs() < 1e-15);
    }
}
