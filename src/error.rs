//! What can go wrong between the library and its host.

use ash::vk;

/// Result of every fallible call of the library.
pub type Result<T> = std::result::Result<T, Error>;

/// Every error names what was asked, what would be right and what was found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A value handed in by the host is not usable.
    #[error("{field}: expected {expected}, got {got}")]
    InvalidInput {
        /// The field or argument, as a host writes it.
        field: String,
        /// What would be right.
        expected: String,
        /// What was handed in.
        got: String,
    },
    /// The device lacks something that [`crate::Requirements`] lists.
    #[error("the device does not meet the requirements: {0}")]
    MissingRequirements(String),
    /// A call came before one that it depends on.
    #[error("{called} was called before {before}")]
    CallOrder {
        /// The call that was made.
        called: &'static str,
        /// The call that must come first.
        before: &'static str,
    },
    /// A shader module does not load or does not fit its pass.
    #[error("shader {name}: {reason}")]
    Shader {
        /// Module name, as in `spirv/`.
        name: String,
        /// Why it was refused.
        reason: String,
    },
    /// Memory could not be had.
    #[error("{bytes} bytes for {resource} could not be allocated: {reason}")]
    Allocation {
        /// The image or buffer.
        resource: String,
        /// Its size.
        bytes: u64,
        /// The allocator's own word.
        reason: String,
    },
    /// A Vulkan call failed.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The entry point.
        call: &'static str,
        /// Its result.
        result: vk::Result,
    },
}

impl Error {
    /// Shorthand for [`Error::InvalidInput`].
    pub fn invalid(field: impl Into<String>, expected: impl Into<String>, got: impl ToString) -> Self {
        Self::InvalidInput { field: field.into(), expected: expected.into(), got: got.to_string() }
    }
}
