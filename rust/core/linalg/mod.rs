//! Dense linear algebra: the only folder that names faer or nalgebra.

pub mod cholesky;
pub mod dense;
pub mod jacobi;
pub mod kernel;
pub mod newton;
pub mod pair;
pub mod symplectic;
pub mod twofold;
