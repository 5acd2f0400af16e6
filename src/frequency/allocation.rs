//! How many directions each shaded sample gets under a fixed mean (Bagher et al. 2011, section 2.3). Twin of
//! `glsl/include/allocation.glsl` and of the `allocate` pass.
//!
//! Equation 8 asks for directions in proportion to a bound on the integrand's variance. The mean square error of an image with
//! a variance `v` and `n` directions a sample is the sum of `v / n`, which for a fixed sum of `n` is least where `n` goes with
//! the *root* of `v` (Neyman 1934); what a viewer sees goes by `v` over the square of the mean.
//!
//! Whatever the rule, a sample has a weight, the greatest of the blocks under the cell that it stands for (section 3.1); the same
//! factor on all of them makes the mean of the clamped numbers the budget. It
//! is found on a histogram of weights. Numbers are powers of two, since that is what Sobol points are best at: at full rate the
//! built-in scene `trio` has 39.4, 41.2 and 40.8 dB at 56, 64 and 72 directions (`render --samples`, `compare`), while numbers off
//! by up to half an octave cost 4 % of variance.

use crate::sampling::sobol;

/// The rule by which shaded samples share the directions of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Allocation {
    /// The same number each: of all rules the best display-space PSNR at equal samples on `torus-knot`, `bunny-city` and `crowd` (by 0.4
    /// to 1.2 dB), and what relative deviations give on `trio` (`render --rate bandwidth --set settings.np_rule=…`, `compare`).
    #[default]
    Constant,
    /// Equation 8 to the letter: in proportion to the probes' sum of bandwidths of light and lobe times squared radiance times
    /// reflectance.
    Equation8,
    /// In proportion to the standard deviation of what the probes bring (`sqrt`).
    Deviation,
    /// In proportion to that over their mean (`relstd`), with [`CHANCE`] beside the first and [`DARK`] beside the second.
    RelativeDeviation,
}

/// What is added to the mean, over the mean radiance of the environment, since in the dark noise is not seen: where sRGB's straight
/// piece ends, of an image exposed to 0.3.
pub const DARK: f64 = 0.01;
/// The relative deviation to which that of the probes is added, as variances: a few of them may agree by chance, and a sample that
/// got the fewest directions for it would show.
pub const CHANCE: f64 = 0.5;
/// The least directions of a sample.
pub const LEAST: u32 = 4;
/// The most directions of a sample.
pub const MOST: u32 = 1024;
/// Bins of the histogram of weights.
pub const BINS: usize = 4096;
/// Bins that double a weight.
const BINS_AN_OCTAVE: f64 = 32.0;
/// Bins over which equal weights are spread, so that the one between two powers of two holds few samples.
const SPREAD: f64 = 4.0;
/// The logarithm to base 2 where the bins begin; they end at minus it. No weight at all counts as this.
pub const NONE: f64 = -64.0;

/// What a rule knows of a direction that a probe looked in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Integrand {
    /// Sum of the angular bandwidths of light and lobe in cycles/radian.
    pub bandwidth: f64,
    /// Radiance times reflectance, without the cosine.
    pub product: f64,
    /// Radiance times reflectance times cosine over the density of the direction.
    pub estimate: f64,
}

impl Allocation {
    /// As scene files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Equation8 => "eq8",
            Self::Deviation => "sqrt",
            Self::RelativeDeviation => "relstd",
        }
    }

    /// What each level adds to the logarithm of a weight. A sample that stands for `a` pixels brings its error to all of them:
    /// the sum of `a v / n` is least where `n` goes with the root of `a v`. Equation 8 takes a pixel for a pixel.
    pub fn by_level(self) -> f64 {
        if matches!(self, Self::Deviation | Self::RelativeDeviation) { 1.0 } else { 0.0 }
    }

    /// Logarithm to base 2 of the weight of a sample with these probes. Lights beside the environment bring `lights`; `dark` is
    /// [`DARK`] in radiance.
    pub fn log_weight(self, probes: &[Integrand], lights: f64, dark: f64) -> f64 {
        let mean = |f: &dyn Fn(&Integrand) -> f64| probes.iter().map(f).sum::<f64>() / probes.len().max(1) as f64;
        let average = mean(&|p| p.estimate);
        let deviation = (mean(&|p| p.estimate * p.estimate) - average * average).max(0.0).sqrt();
        let weight = match self {
            Self::Constant => 0.0,
            Self::Equation8 => mean(&|p| p.bandwidth * p.product * p.product) * probes.len() as f64,
            Self::Deviation => deviation,
            Self::RelativeDeviation => deviation.hypot(CHANCE * average) / (average + lights + dark).max(f64::MIN_POSITIVE),
        };
        if weight > 0.0 { weight.log2().clamp(NONE, -NONE) } else { NONE }
    }
}

/// The bin of a weight, by the sample's entry in the list; in 32 bits, so that it is the device's.
pub fn bin(log_weight: f64, entry: u32) -> usize {
    let spread = (SPREAD * sobol::to_unit(sobol::hash(entry))) as f32;
    (((log_weight as f32 - NONE as f32) * BINS_AN_OCTAVE as f32 + spread).floor().max(0.0) as usize).min(BINS - 1)
}

/// The fewest and most directions of a sample where the mean is `budget` and half a sample's directions come from `sources` other
/// than the reflectance: each of them gets one, as long as the budget allows it.
pub fn range(budget: u32, sources: u32) -> [u32; 2] {
    [LEAST.max(2 * sources).min(budget), MOST.max(budget)]
}

/// For each bin of `histogram` the logarithm to base 2 of its samples' directions before they become powers of two, so that
/// their mean is `budget`, with all within `range`.
pub fn shares(histogram: &[u32], budget: f64, range: [u32; 2]) -> Vec<f64> {
    let share = |bin: usize, scale: f64| scale + bin as f64 / BINS_AN_OCTAVE;
    let samples: f64 = histogram.iter().map(|n| f64::from(*n)).sum();
    let of = |(bin, n): (usize, &u32), scale: f64| f64::from(*n) * expected(share(bin, scale), range);
    let total = |scale: f64| histogram.iter().enumerate().map(|counted| of(counted, scale)).sum::<f64>();
    // All at the least, all at the most.
    let [least, most] = range.map(|n| f64::from(n).log2());
    let (mut low, mut high) = (least + 2.0 * NONE - 2.0, most + 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if total(middle) < budget * samples { &mut low } else { &mut high }) = middle;
    }
    (0..histogram.len()).map(|bin| share(bin, high)).collect()
}

/// Two neighbouring powers of two, within `range`, and how far from the first to the second the directions of a bin are: none of
/// the way in most bins, whose numbers are rounded to the nearest in ratio; in the bin of the threshold as far as the threshold is
/// through it, so that they rise with `share` without steps.
fn powers(share: f64, range: [u32; 2]) -> ([u32; 2], f64) {
    let rounded = share + 0.5;
    let lower = rounded.floor();
    let power = |k: f64| (k.clamp(0.0, 31.0).exp2() as u32).clamp(range[0], range[1]);
    let upper = ((rounded - lower - 1.0) * BINS_AN_OCTAVE + 1.0).clamp(0.0, 1.0);
    ([power(lower), power(lower + 1.0)], upper)
}

/// Mean directions of the samples of a bin.
pub fn expected(share: f64, range: [u32; 2]) -> f64 {
    let ([lower, upper], part) = powers(share, range);
    f64::from(lower) + (f64::from(upper) - f64::from(lower)) * part
}

/// Directions of one of them, by its entry in the list of samples: that mean, so that no sample is a large part of the budget off,
/// and in most bins a power of two.
pub fn directions(share: f64, range: [u32; 2], entry: u32) -> u32 {
    (expected(share, range) + sobol::to_unit(sobol::hash(!entry))).floor() as u32
}

#[cfg(test)]
#[path = "allocation_tests.rs"]
mod tests;
