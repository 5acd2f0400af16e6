//! The thin Vulkan layer: borrowed host handles, requirements, memory, images, buffers, barriers, pipelines, timers and
//! deferred destruction. The only place with feature bits and `pNext` chains.

pub mod access;
pub mod allocator;
pub mod buffer;
pub mod context;
pub mod image;
pub mod memory;
pub mod pipeline;
pub mod raster;
pub mod recorder;
pub mod requirements;
pub mod retire;
pub mod sampler;
pub mod timer;
pub mod upload;

pub use access::{Access, ImageRef};
#[cfg(feature = "gpu-allocator")]
pub use allocator::PooledAllocator;
pub use buffer::Buffer;
pub use context::Host;
pub use image::Image;
pub use memory::{AllocationError, Block, DedicatedAllocator, HostAllocator, Location, MemoryRequest};
pub use requirements::{Missing, Requirements};
pub use retire::Retired;
pub use timer::FrameTimings;
