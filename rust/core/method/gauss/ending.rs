//! When iterations over stages end.

use crate::error::{Error, Result};
use crate::method::options::wrong;
use crate::method::{OptionInfo, Options, Value};

/// Change, in parts of the state, below which one that does not shrink is rounding.
pub const SMALL: f64 = 1e-11;

/// The same where it has not shrunk for some iterations: of rates that lose many digits.
pub const NOISE: f64 = 1e-7;

/// What rounding leaves of a change, about.
const ROUNDING: f64 = 1e-16;

/// Sizes whose reciprocals are no numbers any more are none.
const TINY: f64 = 1e-290;

/// When iterations end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// Where nothing changes any more: no drift.
    Rounding,
    /// Where the next change, in parts of the state, would be below this: faster, with a drift that
    /// 1e6 steps show.
    Tolerance(f64),
}

/// The largest tolerance there is.
const LOOSEST: f64 = 1e-6;

impl Ending {
    /// The change, in parts of the state, that iterations are to come to.
    pub fn least(self) -> f64 {
        match self {
            Ending::Rounding => ROUNDING,
            Ending::Tolerance(limit) => limit,
        }
    }
}

/// The option `roundoff`.
pub const ROUNDOFF: OptionInfo = OptionInfo {
    name: "roundoff",
    doc: "\"minimal\" (default): iterates until nothing changes, no drift; \"tolerance\": until the \
          next change is below rounding, faster, with a drift that 1e6 steps show; (\"tolerance\", \
          1e-13): until it is below that part of the state. Rotating beams that Gauss methods solve in \
          modes, as solution.method says, end by themselves",
};

/// What the option says.
///
/// # Errors
/// [`Error::Argument`] for another word, a tolerance that is not positive or above 1e-6.
pub fn ending(options: &Options) -> Result<Ending> {
    match options.value("roundoff") {
        None => Ok(Ending::Rounding),
        Some(Value::Text(word)) if word == "minimal" => Ok(Ending::Rounding),
        Some(Value::Text(word)) if word == "tolerance" => Ok(Ending::Tolerance(ROUNDING)),
        Some(Value::Named(word, limit)) if word == "tolerance" => {
            if !(*limit > 0.0 && *limit <= LOOSEST) {
                return Err(Error::argument(format!(
                    "roundoff: the tolerance is a part of the state, positive and {LOOSEST:e} at \
                     most, got {limit:e}"
                )));
            }
            Ok(Ending::Tolerance(limit.max(ROUNDING)))
        }
        Some(other) => {
            Err(wrong("roundoff", "'minimal', 'tolerance' or ('tolerance', number)", other))
        }
    }
}

/// Changes of iterations, in parts of the state.
pub struct Changes {
    ending: Ending,
    /// Change that is none.
    nothing: f64,
    last: f64,
    least: f64,
    /// The newest beside the one before.
    pub rate: f64,
    /// Iterations since the smallest.
    pub in_vain: u32,
}

impl Changes {
    /// Of no iteration yet.
    pub fn new(ending: Ending, nothing: f64) -> Changes {
        let infinity = f64::INFINITY;
        Changes { ending, nothing, last: infinity, least: infinity, rate: 0.0, in_vain: 0 }
    }

    /// Begins anew, as after a change of what changes are measured by.
    pub fn forget(&mut self) {
        *self = Changes::new(self.ending, self.nothing);
    }

    /// Takes the next one; whether it is the last that is needed.
    pub fn end_with(&mut self, change: f64) -> bool {
        // The first change has none before it to be compared with.
        let compared = self.last.is_finite();
        self.rate = change / self.last;
        self.in_vain = if change < self.least { 0 } else { self.in_vain + 1 };
        self.least = self.least.min(change);
        self.last = change;
        let at_rest =
            (self.rate >= 1.0 && change <= SMALL) || (self.in_vain >= 3 && change <= NOISE);
        let near = compared
            && self.ending != Ending::Rounding
            && change * self.rate.min(1.0) <= self.ending.least();
        change <= self.nothing || at_rest || near
    }
}

/// From sizes of components to how much a change of each counts: small ones beside large ones of their
/// half of the state count as well, but for less than `part` of those, which is noise; of how many
/// there is nothing to compare it with.
pub fn count(sizes: &mut [f64], part: f64) -> usize {
    let mut unknown = 0;
    let half = sizes.len().div_ceil(2);
    let (coordinates, momenta) = sizes.split_at_mut(half);
    for sizes in [coordinates, momenta] {
        let least = part * sizes.iter().fold(0.0_f64, |largest, size| largest.max(*size));
        for count in sizes {
            let size = count.max(least);
            unknown += usize::from(size == 0.0);
            *count = if size > TINY { 1.0 / size } else { 0.0 };
        }
    }
    unknown
}
