//! What light and normals are distributed by, in f64: von Mises-Fisher lobes. Nothing of Vulkan; twins of `glsl/include`.

pub mod prefilter;
pub mod reflected;
pub mod suns;
