//! Compiles `glsl/` into `spirv/`.
