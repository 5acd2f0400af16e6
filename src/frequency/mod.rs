//! Frequency analysis of the light field (Bagher et al. 2011, sections 2.1, 2.2, 2.4 and the appendix) and the image that comes
//! out of shading at its levels, in f64.
//!
//! **One bandwidth.** Every source returns the frequency that holds 95 % of the energy in true cycles: angular cycles/radian,
//! spatial cycles/metre (textures: cycles per texture unit), image cycles/pixel. Wavelet estimates are divided by their bias
//! ([`wavelet::bias`]).

pub mod allocation;
pub mod calibration;
pub mod environment;
pub mod level;
pub mod luminance;
pub mod operators;
pub mod reconstruction;
pub mod texture;
pub mod wavelet;

pub use allocation::Allocation;
pub use environment::AngularBandwidth;
pub use operators::Operator;
pub use texture::{TextureBandwidth, TextureCells};
