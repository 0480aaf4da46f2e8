//! Functions given as pointers to machine code. They are called without the interpreter.

use std::cell::Cell;
use std::ffi::c_void;

use spim::Result;
use spim::linalg::kernel::{Eight, doubles_mut};

use super::function::{Columns, not_finite};

/// `void f(double t, const double *x, double *out)`.
type One = unsafe extern "C" fn(f64, *const f64, *mut f64);
/// `void f(double t, const double *x, double *out, void *user_data)`.
type OneWith = unsafe extern "C" fn(f64, *const f64, *mut f64, *mut c_void);
/// The same of eight states: `t[8]`, `x[inputs][8]`, `out[outputs][8]`.
type Batch = unsafe extern "C" fn(*const f64, *const f64, *mut f64);
/// With user data.
type BatchWith = unsafe extern "C" fn(*const f64, *const f64, *mut f64, *mut c_void);

/// Where a function is, and what it is given last, if anything.
#[derive(Clone, Copy)]
struct Pointer {
    address: *const c_void,
    user_data: Option<*mut c_void>,
}

impl Pointer {
    /// None for a null address, which Python code writes 0.
    fn new(given: Option<(usize, Option<usize>)>) -> Option<Pointer> {
        let (address, user_data) = given.filter(|(address, _)| *address != 0)?;
        Some(Pointer {
            address: address as *const c_void,
            user_data: user_data.map(|data| data as *mut c_void),
        })
    }
}

/// A function for one state, for eight, or both.
pub struct Compiled {
    one: Option<Pointer>,
    batch: Option<Pointer>,
}

// SAFETY: addresses of code and of what its author says it may read from any thread.
unsafe impl Send for Compiled {}
// SAFETY: as above.
unsafe impl Sync for Compiled {}

thread_local! {
    /// Eight copies of a state, and their results: for functions that take no single one.
    static SPACE: Cell<Vec<Eight>> = const { Cell::new(Vec::new()) };
}

/// What a function does not write must not pass for a number.
const NAN: Eight = Eight([f64::NAN; 8]);

impl Compiled {
    /// Addresses, each with what the function is given last; whoever calls answers for the signatures.
    pub fn new(
        one: Option<(usize, Option<usize>)>,
        batch: Option<(usize, Option<usize>)>,
    ) -> Compiled {
        Compiled { one: Pointer::new(one), batch: Pointer::new(batch) }
    }

    /// Whether there is one at all.
    pub fn is_some(&self) -> bool {
        self.one.is_some() || self.batch.is_some()
    }

    /// The result for one state, nan where it was not written.
    pub fn one(&self, t: f64, x: &[f64], out: &mut [f64]) {
        let Some(pointer) = self.one else {
            let mut space = SPACE.take();
            space.clear();
            space.extend(x.iter().map(|x| Eight([*x; 8])));
            space.resize(x.len() + out.len().max(x.len()), NAN);
            let (states, results) = space.split_at_mut(x.len());
            self.batch(&Eight([t; 8]), states, results);
            for (out, result) in out.iter_mut().zip(results) {
                *out = result.0[0];
            }
            SPACE.set(space);
            return;
        };
        if out.len() < x.len() {
            // Who takes an energy for a gradient writes as many numbers as there are components.
            let mut space = SPACE.take();
            space.clear();
            space.resize(x.len().div_ceil(8), NAN);
            let wide = &mut doubles_mut(&mut space)[..x.len()];
            self.one(t, x, wide);
            out.copy_from_slice(&wide[..out.len()]);
            SPACE.set(space);
            return;
        }
        out.fill(f64::NAN);
        // SAFETY: the signature was checked where the function was given, and sizes are what the
        // system was made with.
        unsafe {
            match pointer.user_data {
                None => {
                    let f: One = std::mem::transmute(pointer.address);
                    f(t, x.as_ptr(), out.as_mut_ptr());
                }
                Some(data) => {
                    let f: OneWith = std::mem::transmute(pointer.address);
                    f(t, x.as_ptr(), out.as_mut_ptr(), data);
                }
            }
        }
    }

    /// The results for a block of eight.
    fn batch(&self, t: &Eight, x: &[Eight], out: &mut [Eight]) {
        let Some(pointer) = self.batch else { return };
        out.fill(NAN);
        let (t, x, out) = (t.0.as_ptr(), x.as_ptr().cast::<f64>(), out.as_mut_ptr().cast::<f64>());
        // SAFETY: as in `one`; an `Eight` is eight doubles in a row.
        unsafe {
            match pointer.user_data {
                None => {
                    let f: Batch = std::mem::transmute(pointer.address);
                    f(t, x, out);
                }
                Some(data) => {
                    let f: BatchWith = std::mem::transmute(pointer.address);
                    f(t, x, out, data);
                }
            }
        }
    }

    /// The results for many states.
    pub fn many(
        &self,
        name: &str,
        given: &Columns,
        f: &mut [Eight],
        outputs: [usize; 2],
        scratch: &mut [f64],
    ) -> Result<()> {
        let [to, outputs] = outputs;
        let blocks = given.t.iter().zip(given.z.chunks_exact(given.stride));
        let rates = f.chunks_exact_mut(given.stride);
        for (block, ((t, z), f)) in blocks.zip(rates).enumerate() {
            let wanted = given.count.saturating_sub(8 * block).min(8);
            let (z, f) = (&z[given.from..][..given.inputs], &mut f[to..][..outputs]);
            if self.batch.is_some() {
                self.batch(t, z, f);
                for (component, f) in f.iter_mut().enumerate() {
                    for (lane, x) in f.0.iter_mut().enumerate() {
                        if !x.is_finite() {
                            if lane < wanted {
                                return Err(not_finite(name, t.0[lane], component, *x));
                            }
                            *x = 0.0;
                        }
                    }
                }
                continue;
            }
            let (x, rest) = scratch.split_at_mut(given.inputs);
            let out = &mut rest[..outputs];
            for lane in 0..wanted {
                for (x, z) in x.iter_mut().zip(z) {
                    *x = z.0[lane];
                }
                self.one(t.0[lane], x, out);
                for (component, (f, x)) in f.iter_mut().zip(&*out).enumerate() {
                    if !x.is_finite() {
                        return Err(not_finite(name, t.0[lane], component, *x));
                    }
                    f.0[lane] = *x;
                }
            }
        }
        Ok(())
    }
}
