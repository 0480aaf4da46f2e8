//! The Störmer-Verlet method and its symmetric compositions: explicit, symplectic, for separable systems.
//!
//! A composition takes Verlet steps of `gamma_i h`, some of them backward, whose kicks are joined; the force
//! where a step ends serves where the next begins. Blanes and Moan's schemes are not of that form, and
//! better than most that are. All sums are compensated, so that energies do not drift by rounding.
//! Sources: Yoshida (1990); Suzuki & Umeno (1993); Kahan & Li, Math. Comput. 66 (1997) 1089; Blanes & Moan,
//! J. Comput. Appl. Math. 142 (2002) 313; Sofroniou & Spaletta, Optim. Methods Softw. 20 (2005) 597; Hairer,
//! Lubich & Wanner, Geometric Numerical Integration, I.1.4 and V.3.2.

use super::common::check_finite;
use super::turn::add_compensated;
use super::{Bound, MethodInfo, Needs, State, Step, Stepper, Work};
use crate::error::Result;
use crate::linalg::kernel::{doubles, doubles_mut};
use crate::system::{Problem, Separable};

/// Half of a palindrome and its middle: the weights of the steps, first to middle.
type Half = &'static [f64];

/// One step.
const ONE: Half = &[1.0];

/// `1/(2 - 2^(1/3))` and `1 - 2/(2 - 2^(1/3))`.
const FOURTH: Half = &[1.351_207_191_959_657_7, -1.702_414_383_919_315_3];

/// Yoshida's solution A of order 6, seven steps.
const SIXTH: Half = &[
    0.784_513_610_477_557_3,
    0.235_573_213_359_358_13,
    -1.177_679_984_178_871,
    1.315_186_320_683_911_2,
];

/// Suzuki & Umeno's fifteen steps of order 8.
const EIGHTH: Half = &[
    0.741_670_364_350_613,
    -0.409_100_825_800_031_6,
    0.190_754_710_296_238_4,
    -0.573_862_471_116_082_3,
    0.299_064_181_303_655_9,
    0.334_624_918_245_298_2,
    0.315_293_092_396_766_6,
    -0.796_887_939_352_916_4,
];

/// Kahan & Li's seventeen steps of order 8.
const EIGHTH_OF_17: Half = &[
    0.130_202_483_088_890_08,
    0.561_162_981_775_108_4,
    -0.389_474_962_644_847_3,
    0.158_841_906_555_155_6,
    -0.395_903_894_133_237_6,
    0.184_539_640_978_315_7,
    0.258_374_387_686_322_04,
    0.295_011_723_609_310_3,
    -0.605_508_533_830_034_5,
];

/// Sofroniou & Spaletta's thirty-five steps of order 10.
const TENTH: Half = &[
    0.078_795_722_521_686_42,
    0.313_096_103_415_108_5,
    0.027_918_383_235_078_066,
    -0.229_592_841_593_907_1,
    0.130_962_061_077_164_86,
    -0.269_733_405_654_510_7,
    0.074_973_343_155_891_44,
    0.111_993_423_999_810_2,
    0.366_133_449_546_226_75,
    -0.399_105_630_136_035_9,
    0.103_087_398_527_471_07,
    0.411_430_873_955_890_24,
    -0.004_866_360_583_135_262,
    -0.392_033_353_708_639_9,
    0.051_942_502_962_449_65,
    0.050_665_090_759_924_495,
    0.049_674_370_639_729_88,
    0.049_317_735_759_594_54,
];

/// Drifts but the middle one, and kicks but the middle pair, of Blanes & Moan's six kicks of order 4.
const SIX: [Half; 2] = [
    &[0.079_203_696_431_195_7, 0.353_172_906_049_774, -0.042_065_080_357_719_5],
    &[0.209_515_106_613_362, -0.143_851_773_179_818],
];

/// The same of their ten kicks of order 6.
const TEN: [Half; 2] = [
    &[
        0.050_262_764_400_392_2,
        0.413_514_300_428_344,
        0.045_079_889_794_397_7,
        -0.188_054_853_819_569,
        0.541_960_678_450_780,
    ],
    &[0.148_816_447_901_042, -0.132_385_865_767_784, 0.067_307_604_692_185, 0.432_666_402_578_175],
];

/// A part of a step.
#[derive(Clone, Copy)]
enum Part {
    /// Of the momenta.
    Kick(f64),
    /// Of the coordinates.
    Drift(f64),
}

/// Of Verlet steps.
fn composed(half: Half) -> Vec<Part> {
    let (mut parts, mut before) = (Vec::new(), 0.0);
    for &step in half.iter().chain(half.iter().rev().skip(1)) {
        parts.extend([Part::Kick(0.5 * (before + step)), Part::Drift(step)]);
        before = step;
    }
    parts.push(Part::Kick(0.5 * before));
    parts
}

/// Of halves that begin with a drift.
fn alternating([drifts, kicks]: [Half; 2]) -> Vec<Part> {
    let pair = 0.5 - kicks.iter().sum::<f64>();
    let mut parts = Vec::new();
    for (drift, kick) in drifts.iter().zip(kicks.iter().chain([&pair])) {
        parts.extend([Part::Drift(*drift), Part::Kick(*kick)]);
    }
    let back: Vec<Part> = parts.iter().rev().copied().collect();
    parts.push(Part::Drift(1.0 - 2.0 * drifts.iter().sum::<f64>()));
    parts.extend(back);
    parts
}

struct Composition {
    name: &'static str,
    h: f64,
    plan: Vec<Part>,
    /// The state and what rounding left of it.
    z: Vec<f64>,
    e: Vec<f64>,
    velocity: Vec<f64>,
    force: Vec<f64>,
}

fn build(name: &'static str, plan: Vec<Part>, problem: &Problem, h: f64) -> Result<Box<dyn Step>> {
    let Problem::Separable(system) = problem else { unreachable!("the record's need") };
    let m = system.len();
    let zeros = |len: usize| vec![0.0; len];
    let method = Composition {
        name,
        h,
        plan,
        z: zeros(m),
        e: zeros(m),
        velocity: zeros(m / 2),
        force: zeros(m / 2),
    };
    Ok(Box::new(Bound::new(method, system.clone(), String::new())))
}

/// `x += k y`, compensated.
fn add(x: &mut [f64], rest: &mut [f64], k: f64, y: &[f64]) {
    for ((x, rest), y) in x.iter_mut().zip(rest).zip(y) {
        add_compensated(x, rest, k * y);
    }
}

impl Stepper<dyn Separable> for Composition {
    /// What rounding left of the state; the force where it is.
    fn carried_len(&self) -> usize {
        self.z.len().div_ceil(8) + self.force.len().div_ceil(8)
    }

    fn step(
        &mut self,
        system: &dyn Separable,
        k: u64,
        t: f64,
        state: &mut State,
        work: &mut Work,
    ) -> Result<()> {
        let (m, n) = (state.z.len(), self.force.len());
        let (kept, known) = state.carried.split_at_mut(m.div_ceil(8));
        self.z.copy_from_slice(&state.z);
        self.e.copy_from_slice(&doubles(kept)[..m]);
        let (q, p) = self.z.split_at_mut(n);
        let (q_rest, p_rest) = self.e.split_at_mut(n);
        let mut done = 0.0;
        for (i, part) in self.plan.iter().enumerate() {
            match *part {
                Part::Drift(part) => {
                    system.velocity(p, &mut self.velocity)?;
                    add(q, q_rest, part * self.h, &self.velocity);
                    done += part;
                }
                Part::Kick(part) => {
                    if i == 0 && k > 0 {
                        self.force.copy_from_slice(&doubles(known)[..n]);
                    } else {
                        system.force(t + done * self.h, q, &mut self.force)?;
                        work.evaluations += 1;
                    }
                    add(p, p_rest, part * self.h, &self.force);
                }
            }
        }
        check_finite(self.name, t, k, &self.z)?;
        doubles_mut(kept)[..m].copy_from_slice(&self.e);
        doubles_mut(known)[..n].copy_from_slice(&self.force);
        state.z.copy_from_slice(&self.z);
        work.steps += 1;
        Ok(())
    }
}

/// Order 2.
pub const VERLET: MethodInfo = MethodInfo {
    name: "verlet",
    aliases: &["stormer_verlet", "leapfrog"],
    summary: "Störmer-Verlet, explicit",
    order: Some(2),
    symplectic: true,
    symmetric: true,
    energy_preserving: false,
    needs: Needs::Split,
    reproducible: "on every machine",
    reference: "Hairer, Lubich & Wanner, Geometric Numerical Integration, I.1.4",
    options: &[],
    build: |problem, h, _, _| build("verlet", composed(ONE), problem, h),
};

/// Order 4, three Verlet steps.
pub const YOSHIDA4: MethodInfo = MethodInfo {
    name: "yoshida4",
    aliases: &[],
    summary: "composition of 3 Verlet steps",
    order: Some(4),
    reference: "Yoshida, Phys. Lett. A 150 (1990) 262",
    build: |problem, h, _, _| build("yoshida4", composed(FOURTH), problem, h),
    ..VERLET
};

/// Order 6, seven Verlet steps.
pub const YOSHIDA6: MethodInfo = MethodInfo {
    name: "yoshida6",
    summary: "composition of 7 Verlet steps",
    order: Some(6),
    build: |problem, h, _, _| build("yoshida6", composed(SIXTH), problem, h),
    ..YOSHIDA4
};

/// Order 8, fifteen Verlet steps.
pub const YOSHIDA8: MethodInfo = MethodInfo {
    name: "yoshida8",
    summary: "composition of 15 Verlet steps",
    order: Some(8),
    reference: "Suzuki & Umeno (1993); Hairer, Lubich & Wanner, V.3.2",
    build: |problem, h, _, _| build("yoshida8", composed(EIGHTH), problem, h),
    ..YOSHIDA4
};

/// Explicit splitting, 6 kicks.
pub const BLANES_MOAN4: MethodInfo = MethodInfo {
    name: "blanes_moan4",
    summary: "explicit splitting, 6 kicks",
    order: Some(4),
    reference: "Blanes & Moan, J. Comput. Appl. Math. 142 (2002) 313",
    build: |problem, h, _, _| build("blanes_moan4", alternating(SIX), problem, h),
    ..YOSHIDA4
};

/// Explicit splitting, 10 kicks.
pub const BLANES_MOAN6: MethodInfo = MethodInfo {
    name: "blanes_moan6",
    summary: "explicit splitting, 10 kicks",
    order: Some(6),
    reference: "Blanes & Moan, J. Comput. Appl. Math. 142 (2002) 313",
    build: |problem, h, _, _| build("blanes_moan6", alternating(TEN), problem, h),
    ..YOSHIDA4
};

/// Composition of 17 Verlet steps.
pub const KAHAN_LI8: MethodInfo = MethodInfo {
    name: "kahan_li8",
    summary: "composition of 17 Verlet steps",
    order: Some(8),
    reference: "Kahan & Li, Math. Comput. 66 (1997) 1089",
    build: |problem, h, _, _| build("kahan_li8", composed(EIGHTH_OF_17), problem, h),
    ..YOSHIDA4
};

/// Composition of 35 Verlet steps.
pub const SOFRONIOU_SPALETTA10: MethodInfo = MethodInfo {
    name: "sofroniou_spaletta10",
    summary: "composition of 35 Verlet steps",
    order: Some(10),
    reference: "Sofroniou & Spaletta, Optim. Methods Softw. 20 (2005) 597",
    build: |problem, h, _, _| build("sofroniou_spaletta10", composed(TENTH), problem, h),
    ..YOSHIDA4
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_to_a_step() {
        let composed = [ONE, FOURTH, SIXTH, EIGHTH, EIGHTH_OF_17, TENTH].map(composed);
        for plan in composed.into_iter().chain([SIX, TEN].map(alternating)) {
            let mut sums = [0.0; 2];
            for part in plan {
                match part {
                    Part::Kick(part) => sums[0] += part,
                    Part::Drift(part) => sums[1] += part,
                }
            }
            for sum in sums {
                assert!((sum - 1.0_f64).abs() <= 4e-15, "{sum}"); // 15 digits are given of some
            }
        }
    }
}
