//! Claims about the core, one module a subject.

mod allocations;
mod exponentials;
mod labels;
mod levels;
mod loads;
mod properties;
mod restarts;
