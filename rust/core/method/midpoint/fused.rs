//! The passes over the nodes of a midpoint step, each memory read once: for beams with a locked joint or
//! a prescribed rotation, without gravity, loads and damping.

use crate::linalg::kernel::{Body, Lanes, Pack};
use crate::model::beam::{Beam, Fields, PAD, at};

/// Momenta, residual and couplings at `q` with rates `w`, `theta'`; returns `c.w`, `b.q`, `q.Qq`.
pub struct Residual<'a> {
    /// The beam.
    pub beam: &'a Beam,
    /// Half the time of the step.
    pub delta: f64,
    /// `theta'`.
    pub theta: f64,
    /// Displacements.
    pub q: &'a Fields,
    /// Rates.
    pub w: &'a Fields,
    /// Momenta at the start.
    pub start: &'a Fields,
    /// Momenta.
    pub momenta: &'a mut Fields,
    /// `M w + c theta' - p0 - delta F`.
    pub residual: &'a mut Fields,
    /// `c`.
    pub column: &'a mut Fields,
    /// Where the whole Jacobian is wanted: its row and column of the angle, `c + delta d` and `c - delta
    /// d` with `d = G w + 2 theta' (b + Q q)`.
    pub border: Option<[&'a mut Fields; 2]>,
}

impl Body for Residual<'_> {
    type Output = [f64; 3];

    #[inline(always)]
    fn run<V: Lanes>(self) -> [f64; 3] {
        let Residual { beam, delta, theta, q, w, start, momenta, residual, column, .. } = self;
        let mut border = self.border;
        let (axial, bending) = beam.mass();
        let (skew, outward, elastic) = (beam.gyroscopic(), beam.outward(), beam.elastic());
        let (a, b) = (beam.lever(), beam.arm());
        let (rate, square) = (Pack::<V>::splat(theta), Pack::<V>::splat(theta * theta));
        let delta = Pack::<V>::splat(delta);
        let mut sums = [Pack::<V>::splat(0.0); 3];
        for i in (PAD..q.u.len() - PAD).step_by(8) {
            let [gq_u, gq_v, gq_t] = skew.rows::<V>(i, q.parts());
            let [gw_u, gw_v, gw_t] = skew.rows::<V>(i, w.parts());
            let c = [-gq_u, at::<V>(&a.v, i) - gq_v, at::<V>(&a.theta, i) - gq_t];
            let [mass_v, mass_t] = bending.rows::<V>(i, &w.v, &w.theta);
            let mass = [axial.rows::<V>(i, &w.u), mass_v, mass_t];
            let [out_v, out_t] = outward.rows::<V>(i, &q.v, &q.theta);
            let out = [axial.rows::<V>(i, &q.u), out_v, out_t];
            let [tension, across, _, right] = elastic.ends::<V>(None, i, q);
            let [next_tension, next_across, next_left, _] = elastic.ends::<V>(None, i + 1, q);
            let held = [tension - next_tension, across - next_across, right + next_left];
            let reach = at::<V>(&b.u, i);
            let pushed = [reach + out[0], out[1], out[2]];
            let turned = [gw_u, gw_v, gw_t];
            for (part, x) in w.parts().into_iter().enumerate() {
                let moving = mass[part] + c[part] * rate;
                let force = (rate * turned[part] + square * pushed[part]) - held[part];
                let left = (moving - at(start.parts()[part], i)) - delta * force;
                moving.store(&mut momenta.parts_mut()[part][i..]);
                left.store(&mut residual.parts_mut()[part][i..]);
                c[part].store(&mut column.parts_mut()[part][i..]);
                sums[0] = sums[0] + c[part] * at(x, i);
                sums[2] = sums[2] + out[part] * at(q.parts()[part], i);
                if let Some([row, column]) = &mut border {
                    let swing = delta * (turned[part] + (rate + rate) * pushed[part]);
                    (c[part] + swing).store(&mut row.parts_mut()[part][i..]);
                    (c[part] - swing).store(&mut column.parts_mut()[part][i..]);
                }
            }
            sums[1] = sums[1] + reach * at(&q.u, i);
        }
        [sums[0].sum(), sums[1].sum(), sums[2].sum()]
    }
}

/// `c.y` and `c.x`.
pub struct Products<'a> {
    /// c.
    pub column: &'a Fields,
    /// y.
    pub one: &'a Fields,
    /// x.
    pub two: &'a Fields,
}

impl Body for Products<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<V: Lanes>(self) -> [f64; 2] {
        let mut sums = [Pack::<V>::splat(0.0); 2];
        let others = self.one.parts().into_iter().zip(self.two.parts());
        for (c, (y, x)) in self.column.parts().into_iter().zip(others) {
            for i in (PAD..c.len() - PAD).step_by(8) {
                let c = at::<V>(c, i);
                sums[0] = sums[0] + c * at(y, i);
                sums[1] = sums[1] + c * at(x, i);
            }
        }
        [sums[0].sum(), sums[1].sum()]
    }
}

/// `y <- y + k x`, `w <- w - y`, `q <- q0 + delta w`; returns the largest of `y` and of `w`.
pub struct Update<'a> {
    /// k.
    pub k: f64,
    /// x.
    pub solved: &'a Fields,
    /// y.
    pub change: &'a mut Fields,
    /// w.
    pub w: &'a mut Fields,
    /// Half the time of the step.
    pub delta: f64,
    /// q0.
    pub start: &'a Fields,
    /// q.
    pub q: &'a mut Fields,
}

impl Body for Update<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<V: Lanes>(self) -> [f64; 2] {
        let Update { k, solved, change, w, delta, start, q } = self;
        let (k, delta, zero) =
            (Pack::<V>::splat(k), Pack::<V>::splat(delta), Pack::<V>::splat(0.0));
        let (mut moved, mut size, mut zeros) = (zero, zero, zero);
        let parts = change.parts_mut().into_iter().zip(w.parts_mut()).zip(q.parts_mut());
        for (((change, w), q), (solved, start)) in
            parts.zip(solved.parts().into_iter().zip(start.parts()))
        {
            for i in (PAD..start.len() - PAD).step_by(8) {
                let y = at::<V>(change, i) + k * at(solved, i);
                let rate = at::<V>(w, i) - y;
                y.store(&mut change[i..]);
                rate.store(&mut w[i..]);
                (at::<V>(start, i) + delta * rate).store(&mut q[i..]);
                moved = y.abs().max(moved);
                size = rate.abs().max(size);
                // A maximum drops what is not a number.
                zeros = zeros + y * zero;
            }
        }
        [moved.largest() + zeros.sum(), size.largest()]
    }
}

/// `p <- 2 (p - M y + k c) - p0` into `p0`, `q0 <- q0 + 2 delta w`.
pub struct Advance<'a> {
    /// The beam.
    pub beam: &'a Beam,
    /// y, the last change.
    pub change: &'a Fields,
    /// k, that of `theta'`.
    pub k: f64,
    /// c.
    pub column: &'a Fields,
    /// Momenta at the midpoint, but for the last change.
    pub momenta: &'a Fields,
    /// Rates.
    pub w: &'a Fields,
    /// Half the time of the step.
    pub delta: f64,
    /// p0.
    pub p: &'a mut Fields,
    /// q0.
    pub q: &'a mut Fields,
}

impl Body for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Advance { beam, change, k, column, momenta, w, delta, p, q } = self;
        let (axial, bending) = beam.mass();
        let (k, two) = (Pack::<V>::splat(k), Pack::<V>::splat(2.0));
        let twice = Pack::<V>::splat(2.0 * delta);
        for i in (PAD..w.u.len() - PAD).step_by(8) {
            let [v, theta] = bending.rows::<V>(i, &change.v, &change.theta);
            let taken = [axial.rows::<V>(i, &change.u), v, theta];
            let (p, q) = (p.parts_mut(), q.parts_mut());
            for (part, (p, q)) in p.into_iter().zip(q).enumerate() {
                let middle = (at::<V>(momenta.parts()[part], i) - taken[part])
                    + k * at(column.parts()[part], i);
                (two * middle - at(p, i)).store(&mut p[i..]);
                (at::<V>(q, i) + twice * at(w.parts()[part], i)).store(&mut q[i..]);
            }
        }
    }
}
