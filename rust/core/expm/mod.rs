//! Matrix exponentials by scaling and doubling, and what is built on them.

mod arithmetic;
mod balance;
mod blocks;
mod coefficients;
mod doubling;
mod driven;
mod flows;
mod half;
mod lu;
mod pade;
mod phi;
mod ports;
mod propagator;
mod sid;
mod small;
mod two_term;

pub use balance::balanced_norm;
pub use blocks::{Blocks, Walk};
pub use doubling::Form;
pub use driven::Driven;
pub use flows::{Flows, MOST_FORMS};
pub use half::is_separable;
pub use phi::HIGHEST as HIGHEST_PHI;
pub use ports::Ports;
pub use propagator::{Correction, Propagator};
pub use two_term::TwoTerm;

use arithmetic::{Arithmetic, Division, Doubles, Pairs};
use doubling::{overflow, whole};

use crate::error::{Error, Result};
use crate::linalg::dense::{self, Watch};
use crate::linalg::kernel::{Depth, Eight, Layout, dispatch, doubles, doubles_mut};
use crate::linalg::pair::add_diagonal;
use crate::linalg::twofold;

/// How an exponential is formed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// SID 21+ in pairs of doubles, or half-size doubling in pairs for separable matrices: correctly
    /// rounded but for rare entries.
    Exact,
    /// Taylor, SID 15+ or SID 21+ in doubles, by norm.
    Sid,
    /// Padé `[l/m]` at the small scale.
    Pade([usize; 2]),
    /// The paper's: numerator and denominator of `[l/m]` doubled apart, eqs. (39), (44).
    Spim([usize; 2]),
    /// Half-size doubling in doubles, for separable matrices alone: fast, and for moderate stiffness.
    Half,
    /// The paper's PIM: Taylor polynomial of this order, doubled, eqs. (36)–(38).
    Pim(usize),
}

/// The paper's number of doublings, N.
pub const PAPER_DOUBLINGS: u32 = 20;

/// Rows up to which pairs of doubles are the default arithmetic.
const SMALL: usize = 32;

/// Most doublings a caller may ask for.
pub const MOST_DOUBLINGS: u32 = 1000;

/// Largest order of the Taylor polynomial of [`Scheme::Pim`].
pub const HIGHEST_TAYLOR: usize = 30;

/// A scheme and the number of doublings, fixed or left to the scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recipe {
    /// How the exponential is formed.
    pub scheme: Scheme,
    /// How often the interval is halved; `None`: from norms ([`PAPER_DOUBLINGS`] for the paper's).
    pub doublings: Option<u32>,
}

impl Recipe {
    /// Correctly rounded.
    pub const EXACT: Recipe = Recipe { scheme: Scheme::Exact, doublings: None };

    /// The default for `rows x rows` matrices: [`Scheme::Exact`] to 32, [`Scheme::Sid`] above.
    pub fn auto(rows: usize) -> Recipe {
        let scheme = if rows <= SMALL { Scheme::Exact } else { Scheme::Sid };
        Recipe { scheme, doublings: None }
    }

    /// The default for a matrix that pays once for many steps: in pairs for separable ones too.
    pub fn for_steps(rows: usize, a: &[f64]) -> Recipe {
        if half::is_separable(rows, a) { Recipe::EXACT } else { Recipe::auto(rows) }
    }

    /// Checks degrees and counts.
    pub fn check(self) -> Result<Recipe> {
        match self.scheme {
            Scheme::Pade([l, m]) | Scheme::Spim([l, m])
                if l > pade::HIGHEST || m > pade::HIGHEST || l + m == 0 =>
            {
                return Err(Error::argument(format!(
                    "pade: degrees run from 0 to {}, not both 0; got [{l}/{m}]",
                    pade::HIGHEST
                )));
            }
            Scheme::Pim(order) if order == 0 || order > HIGHEST_TAYLOR => {
                return Err(Error::argument(format!(
                    "order: the Taylor polynomial has order 1 to {HIGHEST_TAYLOR}; got {order}"
                )));
            }
            _ => {}
        }
        match self.doublings {
            Some(doublings) if doublings > MOST_DOUBLINGS => Err(Error::argument(format!(
                "doublings: at most {MOST_DOUBLINGS}; got {doublings}"
            ))),
            _ => Ok(self),
        }
    }

    /// 1-norm from which the digits of the result are in doubt.
    pub fn precision_limit(self) -> f64 {
        if self.scheme == Scheme::Exact { 1e15 } else { 1e13 }
    }

    /// Order of the approximation where it is a fixed one.
    pub fn order(self) -> Option<usize> {
        match self.scheme {
            Scheme::Exact | Scheme::Sid | Scheme::Half => None,
            Scheme::Pade([l, m]) | Scheme::Spim([l, m]) => Some(l + m),
            Scheme::Pim(order) => Some(order),
        }
    }

    /// Whether the scheme is evaluated in pairs of doubles and rounded once: always for
    /// [`Scheme::Exact`], for the paper's while that costs less than a microsecond or so.
    fn in_pairs(self, rows: usize) -> bool {
        match self.scheme {
            Scheme::Exact => true,
            Scheme::Spim(_) | Scheme::Pim(_) => rows <= SMALL,
            Scheme::Sid | Scheme::Pade(_) | Scheme::Half => false,
        }
    }

    /// Matrices the scheme works with.
    fn slots(self) -> usize {
        match self.scheme {
            Scheme::Exact | Scheme::Sid | Scheme::Half => sid::SLOTS,
            _ => pade::SLOTS,
        }
    }

    fn run(self, x: &mut impl Division) -> Result<(Form, u32)> {
        let fixed = self.doublings.unwrap_or(PAPER_DOUBLINGS);
        match self.scheme {
            // Halves are done by themselves.
            Scheme::Exact | Scheme::Sid | Scheme::Half => sid::exponential(x, self.doublings),
            Scheme::Pade(degrees) => pade::small_scale(x, degrees, self.doublings),
            Scheme::Spim(degrees) => pade::doubled_apart(x, degrees, fixed),
            Scheme::Pim(order) => pade::taylor(x, order, fixed),
        }
    }
}

/// Exponentials of a stack of square matrices, each `rows x rows` and contiguous; returns the
/// largest 1-norm met (of the matrices as stored column by column).
///
/// Storage row by row serves as well: it is the transposed problem, `exp(A^T) = exp(A)^T`.
///
/// # Errors
/// [`Error::Overflow`], [`Error::Singular`] (ratios only), [`Error::Memory`]; what `watch` reports.
pub fn exponentials(
    rows: usize,
    recipe: Recipe,
    stack: &[f64],
    out: &mut [f64],
    watch: &mut Watch,
) -> Result<f64> {
    if stack.is_empty() {
        return Ok(0.0);
    }
    let layout = Layout::new(rows);
    let size = rows * rows;
    if recipe.scheme == Scheme::Half {
        return in_halves(rows, recipe, stack, out, watch);
    }
    let pairs = recipe.in_pairs(rows);
    let tiny = rows <= small::LARGEST && matches!(recipe.scheme, Scheme::Exact | Scheme::Sid);
    let matrices = match (tiny, pairs) {
        (true, _) => 0,
        (_, true) => Pairs::matrices(recipe.slots(), Depth::Three),
        (_, false) => recipe.slots(),
    };
    let memory = layout.packs(rows).checked_mul(matrices);
    let memory = memory.ok_or_else(|| Error::memory("matrix too large"))?;
    let mut norm = 0.0;
    dense::with_scratch(memory, watch, |memory, watch| {
        for (i, (a, out)) in stack.chunks_exact(size).zip(out.chunks_exact_mut(size)).enumerate() {
            if i > 0 && i % 64 == 0 {
                watch()?;
            }
            let found = match (tiny, pairs) {
                (true, _) => {
                    let done = dispatch(small::Small { rows, recipe, a, out: &mut *out })?;
                    match done {
                        Some(norm) => norm,
                        None => in_pairs_apart(layout, recipe, a, out, watch)?,
                    }
                }
                (_, true) => in_pairs(layout, recipe, a, out, memory, watch)?,
                (_, false) => in_doubles(layout, recipe, a, out, memory, watch)?,
            };
            norm = if found > norm { found } else { norm };
        }
        Ok(norm)
    })
}

fn in_doubles(
    layout: Layout,
    recipe: Recipe,
    a: &[f64],
    out: &mut [f64],
    memory: &mut [Eight],
    watch: &mut Watch,
) -> Result<f64> {
    let mut x = Doubles::new(layout, memory, watch);
    dense::pack(layout, a, x.matrix(sid::A));
    let norm = x.norms(sid::A)[0];
    let scales = balance::balance(layout, x.matrix(sid::A));
    let (form, _) = recipe.run(&mut x)?;
    whole(&mut x, sid::T, form);
    finish(layout, scales.as_deref(), x.matrix(sid::T), out)?;
    Ok(norm)
}

fn in_pairs(
    layout: Layout,
    recipe: Recipe,
    a: &[f64],
    out: &mut [f64],
    memory: &mut [Eight],
    watch: &mut Watch,
) -> Result<f64> {
    // The first matrix of the work space is the leading part of the first slot at either depth.
    let (first, _) = memory.split_at_mut(layout.packs(layout.rows));
    dense::pack(layout, a, first);
    let norm = dense::norms(layout, first)[0];
    let scales = balance::balance(layout, first);
    let depth = depth_for(dense::norms(layout, first)[0]);
    let mut x = Pairs::new(layout, recipe.slots(), depth, memory, watch);
    x.matrix(sid::A).lo.fill(Eight::ZERO);
    let (form, _) = recipe.run(&mut x)?;
    whole(&mut x, sid::T, form);
    finish(layout, scales.as_deref(), x.matrix(sid::T).hi, out)?;
    Ok(norm)
}

/// As [`in_pairs`], in scratch memory.
fn in_pairs_apart(
    layout: Layout,
    recipe: Recipe,
    a: &[f64],
    out: &mut [f64],
    watch: &mut Watch,
) -> Result<f64> {
    let memory = layout.packs(layout.rows) * Pairs::matrices(recipe.slots(), Depth::Three);
    dense::with_scratch(memory, watch, |memory, watch| {
        in_pairs(layout, recipe, a, out, memory, watch)
    })
}

/// As [`exponentials`], by halves.
fn in_halves(
    rows: usize,
    recipe: Recipe,
    stack: &[f64],
    out: &mut [f64],
    watch: &mut Watch,
) -> Result<f64> {
    let size = rows * rows;
    let mut norm = 0.0_f64;
    for (a, out) in stack.chunks_exact(size).zip(out.chunks_exact_mut(size)) {
        let Exponential { layout, mut hi, mut lo, norm: found, .. } =
            exponential(rows, recipe, a, 1.0, false, watch)?;
        add_diagonal(layout, [1.0, 0.0], [&mut hi, &mut lo]);
        finish(layout, None, &mut hi, out)?;
        norm = norm.max(found);
    }
    Ok(norm)
}

/// Undoes the balancing and copies an exponential out.
fn finish(layout: Layout, scales: Option<&[i32]>, w: &mut [Eight], out: &mut [f64]) -> Result<()> {
    if let Some(scales) = scales {
        balance::restore(layout, scales, w);
    }
    if dense::unpack(layout, w, out) { Ok(()) } else { Err(overflow()) }
}

/// Two slices leave 78 bits, of which every doubling costs one; the result needs 53 and some.
fn depth_for(norm: f64) -> Depth {
    if norm <= 1024.0 { Depth::Two } else { Depth::Three }
}

/// An increment as a pair of matrices, or a whole exponential where it decays.
pub struct Exponential {
    /// Where columns lie.
    pub layout: Layout,
    /// Which of the two it is.
    pub form: Form,
    /// Leading parts.
    pub hi: Vec<Eight>,
    /// Remainders; 0 where the scheme ran in doubles.
    pub lo: Vec<Eight>,
    /// Doublings taken.
    pub doublings: u32,
    /// 1-norm of the matrix, as stored column by column.
    pub norm: f64,
    /// Whether it was made by half-size doubling.
    pub by_halves: bool,
}

/// `exp(tau A)` of the exact product of the doubles `tau` and `A`, in doubles or (`pairs`) in pairs
/// to 103 bits; `a` column by column.
///
/// # Errors
/// As [`exponentials`].
pub fn exponential(
    rows: usize,
    recipe: Recipe,
    a: &[f64],
    tau: f64,
    pairs: bool,
    watch: &mut Watch,
) -> Result<Exponential> {
    if let Some(wanted) = by_halves(rows, recipe, a, pairs)? {
        return half::exponential(rows, a, tau, wanted, watch);
    }
    let Prepared { layout, mut hi, mut lo, scales } = prepare(rows, a, tau)?;
    let packs = hi.len();
    let norm = dense::norms(layout, &hi)[0];
    let (form, doublings);
    if pairs || recipe.in_pairs(rows) {
        let depth = if pairs { Depth::Three } else { depth_for(norm) };
        let matrices = Pairs::matrices(recipe.slots(), depth);
        let mut memory = dense::work_space(packs * matrices, watch)?;
        let mut x = Pairs::new(layout, recipe.slots(), depth, &mut memory, watch);
        let matrix = x.matrix(sid::A);
        matrix.hi.copy_from_slice(&hi);
        matrix.lo.copy_from_slice(&lo);
        (form, doublings) = recipe.run(&mut x)?;
        let t = x.matrix(sid::T);
        hi.copy_from_slice(t.hi);
        lo.copy_from_slice(t.lo);
    } else {
        let mut memory = dense::work_space(packs * recipe.slots(), watch)?;
        let mut x = Doubles::new(layout, &mut memory, watch);
        x.matrix(sid::A).copy_from_slice(&hi);
        (form, doublings) = recipe.run(&mut x)?;
        hi.copy_from_slice(x.matrix(sid::T));
        lo.fill(Eight::ZERO);
    }
    if let Some(scales) = scales {
        balance::restore(layout, &scales, &mut hi);
        balance::restore(layout, &scales, &mut lo);
    }
    if !dense::is_finite(doubles(&hi)) {
        return Err(overflow());
    }
    Ok(Exponential { layout, form, hi, lo, doublings, norm, by_halves: false })
}

/// How far half-size doubling goes, where it is what the recipe asks for.
fn by_halves(rows: usize, recipe: Recipe, a: &[f64], pairs: bool) -> Result<Option<half::Wanted>> {
    let asked = recipe.scheme == Scheme::Half;
    if !asked && (recipe.scheme != Scheme::Exact || recipe.doublings.is_some()) {
        return Ok(None);
    }
    match half::is_separable(rows, a) {
        true if pairs => Ok(Some(half::Wanted::Pairs)),
        true if asked => Ok(Some(half::Wanted::Doubles)),
        true => Ok(Some(half::Wanted::Rounded)),
        false if asked => Err(Error::argument(
            "method: \"half\" needs a separable matrix, [0 P; R 0] with symmetric blocks for \
             z = [q; p], as undamped structures have it; use \"auto\"",
        )),
        false => Ok(None),
    }
}

/// The exact product of a number and a balanced matrix.
struct Prepared {
    layout: Layout,
    hi: Vec<Eight>,
    lo: Vec<Eight>,
    scales: Option<Vec<i32>>,
}

fn prepare(rows: usize, a: &[f64], tau: f64) -> Result<Prepared> {
    let layout = Layout::new(rows);
    let packs = layout.packs(rows);
    let (mut hi, mut lo) = (dense::zeros(packs)?, dense::zeros(packs)?);
    dense::pack(layout, a, &mut hi);
    // Balancing commutes with the product by tau but for overflow, which the final check finds.
    let scales = balance::balance(layout, &mut hi);
    for (hi, lo) in doubles_mut(&mut hi).iter_mut().zip(doubles_mut(&mut lo)) {
        [*hi, *lo] = twofold::two_product(tau, *hi);
    }
    if !dense::is_finite(doubles(&hi)) {
        return Err(Error::overflow(format!(
            "tau * A overflows: an entry exceeds 1.8e308 for tau = {tau:e}"
        )));
    }
    Ok(Prepared { layout, hi, lo, scales })
}

/// `phi_0(tau A)` to `phi_p(tau A)` of the exact product, `1 <= p <= HIGHEST_PHI`, in pairs of
/// doubles or in doubles; `a` and the results column by column. Returns the 1-norm of `tau A`.
///
/// # Errors
/// As [`exponentials`].
pub fn phis(
    rows: usize,
    pairs: bool,
    a: &[f64],
    tau: f64,
    outs: &mut [&mut [f64]],
    watch: &mut Watch,
) -> Result<f64> {
    let Prepared { layout, hi, lo, scales } = prepare(rows, a, tau)?;
    let norm = dense::norms(layout, &hi)[0];
    let p = outs.len() - 1;
    let slots = phi::slots(p);
    let mut outs = outs.iter_mut().enumerate();
    let scales = scales.as_deref();
    if pairs {
        let matrices = Pairs::matrices(slots, Depth::Three);
        let mut memory = dense::work_space(hi.len() * matrices, watch)?;
        let mut x = Pairs::new(layout, slots, Depth::Three, &mut memory, watch);
        x.matrix(phi::A).hi.copy_from_slice(&hi);
        x.matrix(phi::A).lo.copy_from_slice(&lo);
        phi::phis(&mut x, p)?;
        outs.try_for_each(|(k, out)| finish(layout, scales, x.matrix(phi::slot(k)).hi, out))?;
    } else {
        let mut memory = dense::work_space(hi.len() * slots, watch)?;
        let mut x = Doubles::new(layout, &mut memory, watch);
        x.matrix(phi::A).copy_from_slice(&hi);
        phi::phis(&mut x, p)?;
        outs.try_for_each(|(k, out)| finish(layout, scales, x.matrix(phi::slot(k)), out))?;
    }
    Ok(norm)
}

/// `D^-1 B` of square matrices, row by row, refined in pairs of doubles and rounded once.
///
/// # Errors
/// [`Error::Singular`], [`Error::Memory`].
pub fn quotient(
    rows: usize,
    d: &[f64],
    b: &[f64],
    out: &mut [f64],
    watch: &mut Watch,
) -> Result<()> {
    const D: usize = 0;
    const B: usize = 1;
    const SPARE: usize = 2;
    const X: usize = 3;
    let layout = Layout::new(rows);
    let matrices = Pairs::matrices(4, Depth::Three);
    let mut memory = dense::work_space(layout.packs(rows) * matrices, watch)?;
    let mut x = Pairs::new(layout, 4, Depth::Three, &mut memory, watch);
    for (slot, matrix) in [(D, d), (B, b)] {
        dense::pack(layout, matrix, x.matrix(slot).hi);
        x.matrix(slot).lo.fill(Eight::ZERO);
        // Row by row was the transposed matrix.
        dense::transpose(layout, x.matrix(slot).hi);
    }
    x.solve(D, B, SPARE, X)?;
    dense::transpose(layout, x.matrix(X).hi);
    if dense::unpack(layout, x.matrix(X).hi, out) { Ok(()) } else { Err(overflow()) }
}
