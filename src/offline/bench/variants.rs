//! What is measured in a scene: ways of shading, each at several numbers of directions.

use crate::offline::bench::runner::{Part, Variant};
use crate::offline::render::Settings;
use crate::{Config, Estimator, Filter, Rate};

/// Some numbers of directions with the rest the same.
pub struct Family {
    name: &'static str,
    part: Part,
    rate: Rate,
    oracle: bool,
    estimator: Estimator,
    /// Samples a pixel's side that are averaged into one.
    finer: u32,
    /// In the place of a default.
    change: fn(&mut Config),
    /// Of the quick preset.
    directions: &'static [u32],
    /// Of the full one, besides.
    more: &'static [u32],
}

/// Full rate with the default estimator.
const FULL: Family = Family {
    name: "full",
    part: Part::Compared,
    rate: Rate::Full,
    oracle: false,
    estimator: Estimator::Mis,
    finer: 1,
    change: |_| (),
    directions: &[64],
    more: &[],
};
const HALF: Family = Family { name: "half", rate: Rate::Uniform(1), ..FULL };
const QUARTER: Family = Family { name: "quarter", rate: Rate::Uniform(2), ..FULL };
const LUMINANCE: Family = Family { name: "luminance", rate: Rate::Luminance, ..FULL };
const BANDWIDTH: Family = Family { name: "bandwidth", rate: Rate::Bandwidth, ..FULL };

/// What every pass costs, with and without levels. The first variant is the control's.
pub const PASSES: &[Family] = &[FULL, HALF, BANDWIDTH];

const fn compared(family: Family) -> Family {
    Family { directions: &[64, 256], more: &[16], ..family }
}

/// One setting other than the default, in both presets.
const fn setting(name: &'static str, change: fn(&mut Config)) -> Family {
    Family { name, part: Part::Setting, change, ..BANDWIDTH }
}

/// One setting other than the default, in the full preset.
const fn further(name: &'static str, change: fn(&mut Config)) -> Family {
    Family { directions: &[], more: &[64], ..setting(name, change) }
}

/// Samples a cycle that no frame has: the prediction gives up, and what is left of its cost is what is of interest.
const HOPELESS: f32 = 1e6;

/// Full rate with each estimator is the ladder on which gains are found; that of the one that needs more directions reaches further.
pub const BAGHER: &[Family] = &[
    Family { directions: &[64, 4, 16, 256], ..FULL },
    Family { name: "full brdf-random", estimator: Estimator::BrdfRandom, directions: &[64, 256], more: &[16, 512], ..FULL },
    compared(HALF),
    compared(QUARTER),
    compared(LUMINANCE),
    compared(BANDWIDTH),
    // Each is searched for anew.
    Family { name: "oracle", rate: Rate::Given, oracle: true, more: &[16, 256], ..FULL },
    Family { name: "bandwidth brdf-random", estimator: Estimator::BrdfRandom, more: &[256], ..BANDWIDTH },
    Family {
        name: "bandwidth falling back",
        part: Part::FallBack,
        change: |c| c.samples_per_cycle = Some(HOPELESS),
        more: &[256],
        ..BANDWIDTH
    },
    setting("bandwidth spc=1", |c| c.samples_per_cycle = Some(1.0)),
    setting("bandwidth spc=4", |c| c.samples_per_cycle = Some(4.0)),
    further("bandwidth probes=1", |c| c.probes = 1),
    further("bandwidth spc=1.4", |c| c.samples_per_cycle = Some(1.4)),
    further("bandwidth spc=2.8", |c| c.samples_per_cycle = Some(2.8)),
    further("bandwidth probes=16", |c| c.probes = 16),
    further("bandwidth lmax=2", |c| c.lmax = 2),
    further("bandwidth lmax=4", |c| c.lmax = 4),
    further("bandwidth spc=1 lmax=4", |c| (c.samples_per_cycle, c.lmax) = (Some(1.0), 4)),
    further("bandwidth spc=4 lmax=4", |c| (c.samples_per_cycle, c.lmax) = (Some(4.0), 4)),
];

/// Light that is looked up, and what of it is estimated, beside full rate.
pub const RESIDUAL: &[Family] = &[
    Family { directions: &[64, 16, 256], more: &[4], ..FULL },
    Family { name: "base", estimator: Estimator::Preconvolved, directions: &[1], ..FULL },
    Family { name: "cv", estimator: Estimator::Cv, directions: &[16], more: &[4, 64], ..FULL },
    Family { name: "residual", estimator: Estimator::Residual, directions: &[16, 64], more: &[256], ..BANDWIDTH },
    Family { name: "full brdf-random", estimator: Estimator::BrdfRandom, directions: &[64], ..FULL },
    Family { name: "bandwidth", directions: &[64], more: &[16, 256], ..BANDWIDTH },
    base("base lobes=4", |c| c.fit_lobes = 4),
    base("base lobes=8", |c| c.fit_lobes = 8),
    share("cv share=.25", |c| c.reflectance_share = 0.25),
    share("cv share=.75", |c| c.reflectance_share = 0.75),
    further_residual("residual share=.75", |c| c.reflectance_share = 0.75),
    further_residual("residual above .05", |c| c.residual_errors = [0.05, 0.1, 0.25]),
    further_residual("residual above .2", |c| c.residual_errors = [0.2, 0.2, 0.25]),
];

/// Filters, predicted rates and light that is looked up, each alone and joined; and supersampling, by samples a pixel's side and
/// directions of each.
pub const JOINED: &[Family] = &[
    point(FULL, "point full", &[64], &[16, 256]),
    point(HALF, "point half", &[], &[64]),
    point(QUARTER, "point quarter", &[], &[64]),
    point(LUMINANCE, "point luminance", &[], &[64]),
    point(BANDWIDTH, "point bandwidth", &[64], &[16, 256]),
    point(Family { estimator: Estimator::Residual, ..BANDWIDTH }, "point residual", &[16], &[64]),
    point(Family { estimator: Estimator::Preconvolved, ..FULL }, "point base", &[1], &[]),
    vmf8(FULL, "vmf8 full", &[], &[16, 64, 256]),
    vmf8(BANDWIDTH, "vmf8 bandwidth", &[], &[64]),
    vmf8(Family { estimator: Estimator::Residual, ..BANDWIDTH }, "vmf8 residual", &[], &[64]),
    vmf8(Family { estimator: Estimator::Preconvolved, ..FULL }, "vmf8 base", &[], &[1]),
    clusters(FULL, "clusters full", &[64], &[16, 256]),
    clusters(HALF, "clusters half", &[], &[64]),
    clusters(QUARTER, "clusters quarter", &[], &[64]),
    clusters(LUMINANCE, "clusters luminance", &[], &[64]),
    clusters(Family { rate: Rate::Given, oracle: true, ..FULL }, "clusters oracle", &[], &[64]),
    clusters(BANDWIDTH, "clusters bandwidth", &[64], &[16, 256]),
    clusters(Family { estimator: Estimator::Residual, ..BANDWIDTH }, "clusters residual", &[16], &[64]),
    clusters(Family { estimator: Estimator::Preconvolved, ..FULL }, "clusters base", &[1], &[]),
    supersampled("supersampled 2x2", 2, &[], &[16, 64]),
    supersampled("supersampled 4x4", 4, &[4], &[16, 64]),
    supersampled("supersampled 8x8", 8, &[2], &[4, 16]),
];

const fn of(family: Family, name: &'static str, directions: &'static [u32], more: &'static [u32]) -> Family {
    Family { name, directions, more, ..family }
}

const fn point(family: Family, name: &'static str, directions: &'static [u32], more: &'static [u32]) -> Family {
    Family { change: |c| c.filter = Filter::Point, ..of(family, name, directions, more) }
}

const fn vmf8(family: Family, name: &'static str, directions: &'static [u32], more: &'static [u32]) -> Family {
    Family { change: |c| c.filter = Filter::Vmf8, ..of(family, name, directions, more) }
}

const fn clusters(family: Family, name: &'static str, directions: &'static [u32], more: &'static [u32]) -> Family {
    Family { change: |c| c.filter = Filter::Clusters, ..of(family, name, directions, more) }
}

const fn supersampled(name: &'static str, finer: u32, directions: &'static [u32], more: &'static [u32]) -> Family {
    Family { part: Part::Supersampled, finer, ..point(FULL, name, directions, more) }
}

/// Another fit than the default, in the full preset.
const fn base(name: &'static str, change: fn(&mut Config)) -> Family {
    Family { rate: Rate::Full, estimator: Estimator::Preconvolved, more: &[1], ..further(name, change) }
}

/// Another share of directions from what the lobes leave than half, in the full preset.
const fn share(name: &'static str, change: fn(&mut Config)) -> Family {
    Family { rate: Rate::Full, estimator: Estimator::Cv, more: &[16], ..further(name, change) }
}

const fn further_residual(name: &'static str, change: fn(&mut Config)) -> Family {
    Family { estimator: Estimator::Residual, ..further(name, change) }
}

/// All of `families`, in the place of what `base` says. `all` is for the full preset. Those of as many directions follow each other,
/// the first one's before all: they are compared, and a machine that other work slows down does so for seconds.
pub fn variants(families: &[Family], base: &Settings, all: bool) -> Vec<Variant> {
    let of = |family: &Family| {
        let more = if all { family.more } else { &[] };
        let variant = |directions: &u32| {
            let Family { rate, estimator, .. } = *family;
            let mut config = Config { rate, estimator, directions: *directions, ..base.config.clone() };
            (family.change)(&mut config);
            config.extent = config.extent.map(|e| e * family.finer);
            let settings = Settings { config, oracle: family.oracle, ..base.clone() };
            Variant { name: format!("{} {directions}", family.name), part: family.part, settings, finer: family.finer }
        };
        family.directions.iter().chain(more).map(variant).collect::<Vec<_>>()
    };
    let mut variants: Vec<_> = families.iter().flat_map(of).collect();
    let first = variants.first().map(|v| v.settings.config.directions);
    variants.sort_by_key(|v| (Some(v.settings.config.directions) != first, v.settings.config.directions));
    variants
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_are_apart_and_scenes_keep_their_own_settings() {
        let base = Settings::new(Config { lmax: 5, geometric: true, ..Config::new([64, 64]) });
        let quick = variants(BAGHER, &base, false);
        let full = variants(BAGHER, &base, true);
        let names = |all: &[Variant]| all.iter().map(|v| v.name.clone()).collect::<BTreeSet<_>>();
        assert!(names(&quick).is_subset(&names(&full)) && names(&full).len() == full.len());
        for variant in &full {
            let config = &variant.settings.config;
            assert!(config.geometric && (config.lmax == 5) != variant.name.contains("lmax"), "{}", variant.name);
            assert_eq!(config.rate == Rate::Given, variant.settings.oracle, "{}", variant.name);
        }
        let changed = |v: &&Variant| v.part == Part::Setting;
        for variant in full.iter().filter(changed) {
            let [changed, default] = [&variant.settings.config, &base.config];
            let same = (changed.samples_per_cycle, changed.probes, changed.lmax)
                == (default.samples_per_cycle, default.probes, default.lmax);
            assert!(!same, "{} is the default", variant.name);
        }
    }
}
