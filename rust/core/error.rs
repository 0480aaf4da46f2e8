//! What can go wrong, as users will read it.

use thiserror::Error;

/// Result of everything that can fail; one word wide.
pub type Result<T> = std::result::Result<T, Box<Error>>;

/// A failure that says what, where and what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// An argument is unusable.
    #[error("{0}")]
    Argument(String),
    /// An option or a method has no such name.
    #[error("{0}")]
    UnknownOption(String),
    /// The method cannot treat this system, or not in this way.
    #[error("{0}")]
    Unsupported(String),
    /// A result is beyond the largest double.
    #[error("{0}")]
    Overflow(String),
    /// More memory than there is.
    #[error("{0}")]
    Memory(String),
    /// A matrix that must be inverted is singular, at least to rounding.
    #[error("{0}")]
    Singular(String),
    /// A state is no longer a number, or outside what its model describes.
    #[error("{message}")]
    Model {
        /// The sentence.
        message: String,
        /// Time, in seconds.
        t: f64,
        /// Number of the step that failed.
        step: u64,
    },
    /// An iteration that did not come to its end.
    #[error("{message}")]
    Convergence {
        /// The sentence.
        message: String,
        /// Time, in seconds.
        t: f64,
        /// Number of the step that failed.
        step: u64,
        /// Iterations made.
        iterations: u32,
        /// What was left, in parts of the state.
        residual: f64,
    },
    /// What a caller's function reported, untouched.
    #[error("{0}")]
    Callback(Box<dyn std::error::Error + Send + Sync>),
}

impl Error {
    /// An unusable argument.
    pub fn argument(message: impl Into<String>) -> Box<Error> {
        Box::new(Error::Argument(message.into()))
    }
    /// The same failure, in this step.
    pub fn in_step(mut self: Box<Self>, k: u64) -> Box<Error> {
        if let Error::Model { step, .. } | Error::Convergence { step, .. } = &mut *self {
            *step = k;
        }
        self
    }
    /// A system or use that a method does not cover.
    pub fn unsupported(message: impl Into<String>) -> Box<Error> {
        Box::new(Error::Unsupported(message.into()))
    }
    /// Too large a result.
    pub fn overflow(message: impl Into<String>) -> Box<Error> {
        Box::new(Error::Overflow(message.into()))
    }
    /// Too large a request.
    pub fn memory(message: impl Into<String>) -> Box<Error> {
        Box::new(Error::Memory(message.into()))
    }
}
