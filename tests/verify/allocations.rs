//! Stepping allocates nothing: a run of a night asks for its memory in the evening.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use spim::method::{METHODS, State, build};
use spim::propagate::Clock;

use crate::restarts::{choices, structure};

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

/// What this thread has asked for so far.
pub fn allocated() -> u64 {
    COUNT.get()
}

/// The system's allocator, counting what each thread asks for.
struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

// SAFETY: every call goes to the system's allocator unchanged; the counter allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller's promise, handed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise, handed on.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[test]
fn the_counter_counts() {
    let before = COUNT.get();
    assert_eq!(std::hint::black_box(vec![1.0; 10]).len(), 10);
    assert_eq!(COUNT.get() - before, 1);
}

#[test]
fn stepping_allocates_nothing() {
    // A chain of 20 masses: 40 states, so that "auto" works in doubles.
    let (n, m) = (20, 40);
    let mut stiffness = vec![0.0; n * n];
    for i in 0..n {
        stiffness[i * n + i] = 2.0;
        if i > 0 {
            stiffness[i * n + i - 1] = -1.0;
            stiffness[(i - 1) * n + i] = -1.0;
        }
    }
    let clock = Clock::steps(0.05, 10_000);
    for info in METHODS {
        let problem = structure(info, &vec![1.0; n], &stiffness);
        for options in choices(info) {
            let mut method = build(info, &problem, clock.h, &options, &mut || Ok(())).unwrap();
            let mut state = State::new(&vec![1.0; m], &*method).unwrap();
            let mut rows = vec![0.0; 1000 * m];
            // The first block may still make work space.
            method.fill(0, &clock, &mut state, &mut rows, &mut 0).unwrap();
            let before = COUNT.get();
            method.fill(1000, &clock, &mut state, &mut rows, &mut 0).unwrap();
            for k in 2000..2100 {
                method.step(k, clock.t(k), &mut state).unwrap();
            }
            assert_eq!(COUNT.get() - before, 0, "{} {options:?}", info.name);
        }
    }
}
