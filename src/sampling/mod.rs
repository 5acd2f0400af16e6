//! Where sample directions come from: point sequences, alias tables and the lat-long sphere; f64 twins of `glsl/include`.

pub mod alias;
pub mod latlong;
pub mod sobol;

pub use latlong::LatLong;
