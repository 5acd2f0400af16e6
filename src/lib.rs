#![doc = include_str!("../README.md")]

pub mod config;
pub mod distribution;
pub mod error;
mod frame;
pub mod frequency;
pub mod gpu;
#[cfg(feature = "offline")]
mod inspect;
mod kinds;
pub mod light;
pub mod material;
pub mod moments;
#[cfg(feature = "offline")]
pub mod offline;
pub mod pass;
mod passes;
mod plan;
pub mod reflectance;
mod renderer;
mod rounds;
pub mod sampling;
mod set_up;
mod targets;
pub mod texture;
mod view;

pub use ash;
pub use config::{Bins, Config, Estimator, GBufferSource, Rate, ShadingRate};
pub use distribution::{Division, Filter, Rule};
pub use error::{Error, Result};
pub use frame::{EnvironmentUse, FrameInputs, GBufferInput, Output, SHADOW_FORMATS, ShadowMasks};
pub use glam;
pub use gpu::{
    Access, AllocationError, Block, DedicatedAllocator, FrameTimings, Host, HostAllocator, ImageRef, Location, MemoryRequest,
    Missing, Requirements, Retired,
};
pub use light::Light;
pub use material::{Maps, Material, PointMaterial, Roughness, Sampling};
pub use moments::Moments;
pub use pass::gbuffer::Draw;
pub use pass::tonemap::Transfer;
pub use plan::{Footprint, FootprintRow, memory_footprint};
pub use renderer::Renderer;
pub use texture::Texture;
pub use view::View;
