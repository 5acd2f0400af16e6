//! Where sample directions come from: point sequences, discrete distributions and the lat-long sphere; f64 twins of `glsl/include`.

pub mod alias;
pub mod environment;
pub mod latlong;
pub mod sobol;

pub use alias::AliasTable;
pub use environment::EnvironmentImportance;
pub use latlong::LatLong;

/// Luminance of linear Rec.709 colour (the Y row of BT.709).
pub fn luminance(rgb: glam::DVec3) -> f64 {
    rgb.dot(glam::DVec3::new(0.2126, 0.7152, 0.0722))
}
