//! Where sample directions come from: point sequences, discrete distributions and the lat-long sphere; f64 twins of `glsl/include`.

pub mod alias;
pub mod environment;
pub mod latlong;
pub mod sobol;

pub use alias::AliasTable;
pub use environment::EnvironmentImportance;
pub use latlong::LatLong;

/// What the channels of linear Rec.709 colour count in its luminance (the Y row of BT.709).
pub const LUMINANCE: glam::DVec3 = glam::DVec3::new(0.2126, 0.7152, 0.0722);

/// Luminance of linear Rec.709 colour.
pub fn luminance(rgb: glam::DVec3) -> f64 {
    rgb.dot(LUMINANCE)
}
