//! Calls without a tuple of arguments. Python has them since 3.9 and promises them since 3.12: they are
//! looked up.

use std::ffi::{CStr, c_char, c_void};
use std::sync::OnceLock;

use pyo3::prelude::*;
use pyo3::{ffi, types::PyTuple};

type Vectorcall = unsafe extern "C" fn(
    *mut ffi::PyObject,
    *const *mut ffi::PyObject,
    usize,
    *mut ffi::PyObject,
) -> *mut ffi::PyObject;

#[cfg(unix)]
fn looked_up() -> Option<Vectorcall> {
    unsafe extern "C" {
        fn dlsym(handle: *mut c_void, name: *const c_char) -> *mut c_void;
    }
    const NAME: &CStr = c"PyObject_Vectorcall";
    // RTLD_DEFAULT.
    let everywhere = if cfg!(target_os = "macos") { -2_isize } else { 0 } as *mut c_void;
    // SAFETY: a name that ends with 0; what is found under it has had this signature since 3.9.
    unsafe {
        let found = dlsym(everywhere, NAME.as_ptr());
        (!found.is_null()).then(|| std::mem::transmute::<*mut c_void, Vectorcall>(found))
    }
}

#[cfg(not(unix))]
fn looked_up() -> Option<Vectorcall> {
    None
}

/// Arguments that fit on the stack, after an entry that the call may use.
const MOST: usize = 15;

/// Calls a function.
pub fn call<'a, 'py: 'a>(
    function: &Bound<'py, PyAny>,
    args: impl Iterator<Item = &'a Bound<'py, PyAny>> + Clone,
) -> PyResult<Bound<'py, PyAny>> {
    static FOUND: OnceLock<Option<Vectorcall>> = OnceLock::new();
    let py = function.py();
    if let Some(vectorcall) = FOUND.get_or_init(looked_up) {
        let mut given = [std::ptr::null_mut(); MOST + 1];
        let mut count = 0;
        for arg in args.clone().take(MOST + 1) {
            if count < MOST {
                given[count + 1] = arg.as_ptr();
            }
            count += 1;
        }
        if count <= MOST {
            // The highest bit: the entry before the arguments may be used (for `self`).
            let flags = count | (1 << (usize::BITS - 1));
            // SAFETY: `count` borrowed references that live as long as `args`, after an entry that may be
            // written; the result is a new reference, or null with an exception set.
            return unsafe {
                let first = given.as_mut_ptr().add(1);
                let result = vectorcall(function.as_ptr(), first, flags, std::ptr::null_mut());
                Bound::from_owned_ptr_or_err(py, result)
            };
        }
    }
    let args: Vec<_> = args.cloned().collect();
    function.call1(PyTuple::new(py, args)?)
}
