//! What a texel of a mip holds, the distribution of microfacet normals under it, and light convolved with its lobes, in f64.
//! Nothing of Vulkan.
//!
//! **Conventions.** Directions lie in the surface's tangent frame, z along its normal. A lobe's `density` is over solid angle
//! and integrates to its weight; the weights of a texel sum to 1. What a texel stores is linear in its children and
//! multiplied by the lobe's weight, so that averages, and the hardware's own filters, are exact; it is decoded once, after them.

pub mod alignment;
pub(crate) mod below;
pub mod brdf_map;
pub mod chart;
pub(crate) mod cluster_search;
mod clustering;
pub mod clusters;
pub mod effective;
pub mod elliptic;
pub(crate) mod expectation;
pub mod filter;
pub mod filtered;
pub mod fit;
pub mod fitter;
pub mod gaussians;
pub mod literal;
pub mod mip;
pub mod mixture;
pub mod partition;
pub mod peaks;
pub mod prefilter;
pub mod reflected;
pub mod slope;
pub mod stereographic;
mod stored;
pub mod suns;
pub mod surface;
pub mod vmf;

pub use brdf_map::BrdfMap;
pub use clusters::Clusters;
pub use effective::Rule;
pub use filter::{Division, Filter, MOST_BASE_LOBES};
pub use filtered::Filtered;
pub use fit::LobeFit;
pub use fitter::Budget;
pub use gaussians::Gaussians;
pub use mixture::Mixture;
pub use partition::Cells;
pub use surface::Surface;
