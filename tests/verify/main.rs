//! Claims about the core, one module a subject.

mod allocations;
mod beams;
mod exponentials;
mod labels;
mod levels;
mod loads;
mod measured;
mod properties;
mod restarts;
