//! A Vulkan-native renderer that shades as often as the light field needs.

pub mod config;
pub mod error;
pub mod gpu;
pub mod light;
#[cfg(feature = "offline")]
pub mod offline;
pub mod pass;
mod plan;
pub mod reflectance;
mod renderer;
pub mod sampling;
mod targets;
mod view;

pub use ash;
pub use config::{Config, Estimator, GBufferSource};
pub use error::{Error, Result};
pub use gpu::{
    Access, AllocationError, Block, DedicatedAllocator, Host, HostAllocator, ImageRef, Location, MemoryRequest, Missing,
    Requirements, Retired,
};
pub use light::Light;
pub use pass::gbuffer::Draw;
pub use pass::tonemap::Transfer;
pub use plan::{Footprint, FootprintRow, memory_footprint};
pub use renderer::{EnvironmentUse, FrameInputs, GBufferInput, Output, Renderer};
pub use view::View;
