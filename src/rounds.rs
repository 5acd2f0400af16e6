//! Rounds of loops that an invocation of `shade.comp` or `bandwidth.comp` takes: some drivers end all its loops after so many of them
//! together, without a word ([`Context::most_rounds`](crate::gpu::context::Context::most_rounds)). A loop takes one round more than it has
//! steps; those that are unrolled take none.

use crate::config::{Config, Estimator};
use crate::distribution::suns::{MAX_POINTS, MAX_SUNS};
use crate::error::{Error, Result};
use crate::frequency::allocation::{self, Allocation};
use crate::kinds::Kinds;
use crate::plan::Directions;

/// Of evaluating a reflectance, and of one loop over the lobes that the filter found.
fn of_reflectance(config: &Config, kinds: Kinds) -> [u64; 2] {
    let layers = config.filter.lobe_layers() / if config.filter.has_slopes() { 2 } else { 1 };
    let found = if layers > 0 { u64::from(layers) + 1 } else { 0 };
    [u64::from(kinds.most_own_lobes.saturating_sub(2)) + 1 + found, found]
}

/// The most of a sample with these directions, of materials of these kinds, so many exact and so many area lights.
fn of_sample(config: &Config, kinds: Kinds, directions: Directions, [exact, area]: [u32; 2]) -> u64 {
    let [suns, points] = [MAX_SUNS, MAX_POINTS].map(|most| most as u64);
    let [evaluated, found] = of_reflectance(config, kinds);
    let residual = config.estimator.has_residual();
    // Lobe by lobe, which is too much to unroll, the four texels of two levels.
    let texels = if config.exact_lobes && residual { 11 * u64::from(kinds.most_lobes) + 1 } else { 0 };
    let lights = if exact + area > 0 { u64::from(area) + 1 } else { 0 };
    let suns = if config.residual_is_factor() { suns * (u64::from(kinds.most_lobes) + 2 + points * (evaluated + 1)) } else { 0 };
    let once = 2 * (u64::from(kinds.most_own_lobes) + found) + u64::from(exact + 1) * (evaluated + 1) + 2 * lights + suns + 8;
    let each = 1 + evaluated + texels;
    let [brdf, environment, light] = [directions.brdf, directions.environment, directions.light * area].map(u64::from);
    once + brdf * (each + 2 * found + lights) + (environment + light) * each
}

/// Refuses more directions, probes or lights than there are rounds for, if there are at most `most`.
pub fn check(most: Option<u64>, config: &Config, kinds: Kinds, lit: bool, lights: [u32; 2]) -> Result<()> {
    let Some(most) = most else { return Ok(()) };
    let said = |most_that_fit: String| {
        format!("{most_that_fit} with these materials, lights and filter on this driver, which ends loops after {most} rounds")
    };
    let needed = |directions: u32| {
        let each = config.directions_a_pixel() / config.directions.max(1);
        of_sample(config, kinds, Directions::split(config, directions.saturating_mul(each), lit, lights[1]), lights)
    };
    if config.estimator != Estimator::Preconvolved && needed(config.directions) > most {
        let (mut fits, mut step) = (0, 1 << 16);
        while step > 0 {
            fits += if needed(fits + step) <= most { step } else { 0 };
            step /= 2;
        }
        return Err(Error::invalid("Config::directions", said(format!("at most {fits}")), config.directions));
    }
    if config.allocation != Allocation::Constant && needed(allocation::MOST) > most {
        let expected = said(format!("constant, as others give samples up to {} directions", allocation::MOST));
        return Err(Error::invalid("Config::allocation", expected, config.allocation.name()));
    }
    let [evaluated, found] = of_reflectance(config, kinds);
    let predicted = (u64::from(config.probes) + u64::from(lights[0] + lights[1])) * (1 + evaluated + 3 * found) + 4 * found + 64;
    if config.predicts() && predicted > most {
        return Err(Error::invalid("Config::probes", said("fewer".into()), config.probes));
    }
    Ok(())
}
