//! A Vulkan-native renderer that shades as often as the light field needs.

pub mod error;
#[cfg(feature = "offline")]
pub mod offline;
pub mod reflectance;
pub mod sampling;

pub use ash;
pub use error::{Error, Result};
