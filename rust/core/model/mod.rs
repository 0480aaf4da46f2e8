//! Models, one a file or a folder.

pub mod beam;
pub mod pendulum;
