//! How the bandwidth of light becomes bandwidth in the image (Bagher et al. 2011, equations 3 to 5 and figure 4, with the
//! corrections measured since). Twin of `glsl/include/bandwidth.glsl`.
//!
//! Distant light has no spatial bandwidth. On a surface of curvature k it gets some, since the normal turns; the reflected
//! direction turns by twice as much, and a pixel at ray length d spans `d / cos` of surface: for each principal curvature the
//! image sees the reflected bandwidth `|1 + 2 d k / cos|` times. (The figure's two curvature shears add, k positive where
//! convex: the mirror flip lies between them. Mean or Gaussian curvature cancel on saddles or have the wrong unit; both
//! principal curvatures are tried.)

/// The least cosine of the view direction that counts.
pub const LEAST_COSINE: f64 = 0.02;

/// What reflection leaves of the light's bandwidth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Operator {
    /// Figure 4 to the letter: the angular bandwidth is cut to the lobe's, the spatial one that the first shear made of it is
    /// not. Never too low, and far too high where a dull lobe meets sharp light.
    Box,
    /// Distant light's spectrum is a line, of which the lobe cuts both ends.
    #[default]
    Clipped,
    /// Spectra of light and lobe as Gaussians, whose product is narrower than either: at most 1/sqrt 2 below [`Self::Clipped`].
    Covariance,
}

/// Where a pixel looks: plain numbers, as the shader has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Principal curvatures in 1/m, positive where convex.
    pub curvatures: [f64; 2],
    /// Length of the ray in metres.
    pub distance: f64,
    /// Cosine between normal and viewer.
    pub cosine: f64,
    /// Radians that a pixel spans ([`pixel_angle`]).
    pub pixel: f64,
}

impl Operator {
    /// Image bandwidth in cycles/pixel of light and lobe of angular bandwidths `light` and `lobe` in cycles/radian (either may be
    /// huge, not infinite).
    pub fn image(self, light: f64, lobe: f64, surface: &Surface) -> f64 {
        let (least, most) = (light.min(lobe), light.max(lobe));
        let product = if most > 0.0 { least / (1.0 + (least / most) * (least / most)).sqrt() } else { 0.0 };
        let (angular, sheared) = match self {
            Self::Box => (least, light + least),
            Self::Clipped => (least, least + least),
            Self::Covariance => (product, product + product),
        };
        let reach = surface.distance / surface.cosine.max(LEAST_COSINE);
        let along = |k: f64| (angular + reach * k * sheared).abs();
        let [a, b] = surface.curvatures;
        along(a).max(along(b)) * surface.pixel
    }
}

/// The largest angle in radians between the rays of neighbouring pixels at `ray` = (x, y) on the image plane at distance 1, of
/// pixels `step` wide and high there. Equation 5 takes field of view over pixels for it, which is 10 % less in the middle of
/// a view of 60 degrees.
pub fn pixel_angle(ray: [f64; 2], step: [f64; 2]) -> f64 {
    step[0].max(step[1]) / (1.0 + ray[0] * ray[0] + ray[1] * ray[1]).sqrt()
}

/// What a light at `distance` metres under `cosine` from the normal adds to the curvatures in 1/m: along the surface, its
/// direction turns by cosine / distance, and reflection by twice the curvature.
pub fn nearby(distance: f64, cosine: f64) -> f64 {
    0.5 * cosine / distance
}

/// How the bandwidths of the probes of a pixel are combined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Combine {
    /// Equation 4 as a mean: over the sum of its own weights.
    #[default]
    Mean,
    /// The largest of those that bring light (figure 6).
    Max,
    /// Equation 4 to the letter: over the sum of radiance alone, which scales with the reflectance.
    Literal,
}

/// One probe of equation 4.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Probe {
    /// Bandwidth by its direction.
    pub bandwidth: f64,
    /// Radiance from there.
    pub radiance: f64,
    /// Reflectance times cosine; for [`Combine::Mean`] over the density that it was drawn with.
    pub reflected: f64,
}

impl Combine {
    /// The bandwidth of a pixel; 0 where no probe brings light.
    pub fn over(self, probes: &[Probe]) -> f64 {
        let sum = |f: fn(&Probe) -> f64| probes.iter().map(f).sum::<f64>();
        let weighted = |of: f64| if of > 0.0 { sum(|p| p.bandwidth * p.radiance * p.reflected) / of } else { 0.0 };
        match self {
            Self::Mean => weighted(sum(|p| p.radiance * p.reflected)),
            Self::Literal => weighted(sum(|p| p.radiance)),
            Self::Max => probes.iter().filter(|p| p.radiance * p.reflected > 0.0).map(|p| p.bandwidth).fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
#[path = "operators_tests.rs"]
mod tests;
