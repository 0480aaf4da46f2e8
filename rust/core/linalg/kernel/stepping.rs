//! Cutting propagators and states for stepping to the last bit.
//!
//! As in [`pair`](super::pair), but along bounds that are known beforehand: component `j` of every
//! state is at most `F_j`, a power of two. The leading part of `T` then consists of multiples of
//! `R_i / F_j 2^-b` with `R_i` the largest `|T_ij| F_j` of the row, the leading part of a state of
//! multiples of `F_j 2^-b`, and their product is exact in ordinary arithmetic.

use super::pack::{Lanes, Pack, packs, packs_mut};
use super::{Body, Eight, Layout, doubles};

/// `1.5 2^52`: what rounds a double of magnitude below `2^51` to an integer when added.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Cuts a propagator: `t1` exact in products with cut states, `t2 = T - t1`.
pub struct CutPropagator<'a> {
    /// How the columns lie in memory.
    pub layout: Layout,
    /// `2^-b`.
    pub grain: f64,
    /// The bounds `F_j`, one a component.
    pub bounds: &'a [Eight],
    /// The propagator: leading parts.
    pub hi: &'a [Eight],
    /// The propagator: remainders.
    pub lo: &'a [Eight],
    /// The part with exact products.
    pub t1: &'a mut [Eight],
    /// The rest.
    pub t2: &'a mut [Eight],
}

impl Body for CutPropagator<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Layout { rows, height, stride } = self.layout;
        let (hi, lo) = (packs::<V>(self.hi), packs::<V>(self.lo));
        let (t1, t2) = (packs_mut::<V>(self.t1), packs_mut::<V>(self.t2));
        let bounds = &doubles(self.bounds)[..rows];
        let factor = Pack::<V>::splat(2.0 * ROUND * self.grain);
        for i in 0..height {
            let mut largest = Pack::<V>::splat(0.0);
            for (j, bound) in bounds.iter().enumerate() {
                largest = (hi[j * stride + i].abs() * Pack::splat(*bound)).max(largest);
            }
            let row = largest.binade() * factor;
            for (j, bound) in bounds.iter().enumerate() {
                let at = j * stride + i;
                let shift = row / Pack::splat(*bound);
                let first = (hi[at] + shift) - shift;
                t1[at] = first;
                t2[at] = (hi[at] - first) + lo[at];
            }
        }
    }
}

/// Cuts states: `z1` exact in products with a cut propagator, `z2 = z - z1 + e`.
///
/// A state much smaller than the bounds, as in motion that decays or beside larger ones in a batch,
/// is cut for bounds smaller by one power of two throughout: products stay exact.
pub struct CutStates<'a> {
    /// How the columns lie in memory.
    pub layout: Layout,
    /// `2^-b`.
    pub grain: f64,
    /// The bounds `F_j`, one a component.
    pub bounds: &'a [Eight],
    /// Their inverses; 0 in the rows that pad.
    pub inverses: &'a [Eight],
    /// The states: leading parts.
    pub z: &'a [Eight],
    /// The states: remainders.
    pub e: &'a [Eight],
    /// The part with exact products.
    pub z1: &'a mut [Eight],
    /// The rest.
    pub z2: &'a mut [Eight],
}

impl Body for CutStates<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Layout { height, stride, .. } = self.layout;
        let (bounds, inverses) = (packs::<V>(self.bounds), packs::<V>(self.inverses));
        let factor = Pack::<V>::splat(ROUND * self.grain);
        let columns = packs::<V>(self.z).chunks(stride).zip(packs::<V>(self.e).chunks(stride));
        let cut = packs_mut::<V>(self.z1)
            .chunks_mut(stride)
            .zip(packs_mut::<V>(self.z2).chunks_mut(stride));
        for ((z, e), (z1, z2)) in columns.zip(cut) {
            let mut largest = Pack::<V>::splat(0.0);
            for i in 0..height {
                largest = (z[i].abs() * inverses[i]).max(largest);
            }
            // The power of two above the largest part of its bound.
            let scale = Pack::splat(2.0 * largest.largest()).binade() * factor;
            for i in 0..height {
                let shift = bounds[i] * scale;
                let first = (z[i] + shift) - shift;
                z1[i] = first;
                z2[i] = (z[i] - first) + e[i];
            }
        }
    }
}
