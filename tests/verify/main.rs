//! Claims about the core, one module a subject.

mod exponentials;
mod levels;
mod restarts;
