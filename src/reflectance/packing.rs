//! Three non-negative numbers in 32 bits: nine bits each under a shared five-bit exponent, the layout of Vulkan's
//! `E5B9G9R9_UFLOAT_PACK32` (Khronos Data Format Specification, "Shared exponent floating-point formats").

use glam::DVec3;

/// The largest number that the format holds.
pub const MAX: f64 = 65408.0;

const MANTISSA_BITS: i32 = 9;
const BIAS: i32 = 15;

/// Packs `rgb`, each channel rounded to the nearest step. Negative and NaN channels become 0; channels above [`MAX`] become
/// [`MAX`]. The error is at most half a step: 2^-10 of the largest channel, or 2^-25 below 2^-15.
pub fn encode(rgb: DVec3) -> u32 {
    let rgb = rgb.to_array().map(|c| if c > 0.0 { c.min(MAX) } else { 0.0 });
    let largest = rgb.into_iter().fold(0.0, f64::max);
    // Nine bits below the largest channel's leading bit, or ten where it rounds up to the next power of two.
    let mut exponent = (largest.log2().floor() as i32 + 1 + BIAS).clamp(0, 31);
    if (largest / step(exponent)).round() >= (1 << MANTISSA_BITS).into() {
        exponent += 1;
    }
    let [r, g, b] = rgb.map(|c| (c / step(exponent)).round() as u32);
    (exponent as u32) << 27 | b << 18 | g << 9 | r
}

/// The numbers that `packed` stands for.
pub fn decode(packed: u32) -> DVec3 {
    let mantissa = |shift: u32| f64::from(packed >> shift & 0x1ff);
    DVec3::new(mantissa(0), mantissa(9), mantissa(18)) * step((packed >> 27) as i32)
}

/// The distance between neighbouring numbers under an exponent.
fn step(exponent: i32) -> f64 {
    f64::from(exponent - BIAS - MANTISSA_BITS).exp2()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::sobol;

    #[test]
    fn known_values() {
        // One is mantissa 256 under exponent 16: 256 * 2^(16 - 24).
        assert_eq!(encode(DVec3::new(1.0, 0.0, 0.0)), 16 << 27 | 256);
        assert_eq!(encode(DVec3::new(0.0, 0.5, 1.0)), 16 << 27 | 256 << 18 | 128 << 9);
        assert_eq!(decode(u32::MAX), DVec3::splat(MAX));
        assert_eq!(encode(DVec3::splat(MAX)), u32::MAX);
        assert_eq!(encode(DVec3::new(f64::INFINITY, -1.0, f64::NAN)), 31 << 27 | 511);
        assert_eq!(decode(0), DVec3::ZERO);
        // 511.75 does not round into nine bits: the exponent goes up by one.
        assert_eq!(decode(encode(DVec3::splat(511.75))), DVec3::splat(512.0));
    }

    #[test]
    fn error_is_at_most_half_a_step() {
        for i in 0..100_000 {
            let [a, b] = sobol::random(i, 1).map(sobol::to_unit);
            let [c, d] = sobol::random(i, 2).map(sobol::to_unit);
            let rgb = DVec3::new(a, b, c) * (40.0 * d - 25.0).exp2();
            let bound = rgb.max_element().max((-15f64).exp2()) * (-10f64).exp2();
            let error = (decode(encode(rgb)) - rgb).abs().max_element();
            assert!(error <= bound, "{rgb} is off by {error}");
        }
    }

    #[test]
    fn packing_what_was_unpacked_changes_nothing() {
        for i in 0..100_000 {
            let [bits, _] = sobol::random(i, 3);
            let once = decode(bits);
            assert_eq!(decode(encode(once)), once);
        }
    }
}
