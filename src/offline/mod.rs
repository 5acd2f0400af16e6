//! Headless rendering from files: scenes, meshes, images, the device, read-back, metrics and the f64 reference.
//! The only part of the crate that creates instances, devices or queues, reads files or the environment, or prints.

pub mod animation;
pub mod aov;
pub mod bench;
pub mod builtin;
mod cache;
pub mod decision;
pub mod environment;
pub mod error;
pub mod fit_cache;
pub mod footprint;
pub mod gaussians_cache;
pub mod gltf;
pub mod headless;
pub mod image_io;
mod input;
pub mod levels;
pub mod lobe_cache;
pub mod mesh;
mod mesh_buffers;
pub mod metrics;
mod model_key;
pub mod progress;
pub mod rates;
mod read_back;
pub use read_back::MomentLevels;
pub mod reference;
pub mod render;
pub mod scene;
pub mod sequence;
pub mod session;
mod shown;
pub mod stats;
pub mod supersample;
pub mod texture;
mod window;
pub mod world;
