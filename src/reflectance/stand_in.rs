//! Three stand-ins for measured materials. They are **synthetic**: analytic microfacet lobes baked into tables at MERL
//! resolution, so that everything made for measured tables can be shown and tested without a download.

use crate::reflectance::MerlTable;
use crate::reflectance::ggx::{distribution, masking, schlick};
use crate::reflectance::merl::Angles;
use glam::DVec3;
use std::f64::consts::PI;

/// One microfacet lobe.
struct Lobe {
    weight: f64,
    alpha: f64,
    f0: DVec3,
}

/// Lobes whose weights sum to one, over a diffuse base that gets what the first lobe's Fresnel term lets through.
struct StandIn {
    name: &'static str,
    lobes: &'static [Lobe],
    albedo: DVec3,
}

const ALL: &[StandIn] = &[
    StandIn {
        name: "mirror-metal",
        lobes: &[
            Lobe { weight: 0.96, alpha: 0.03, f0: DVec3::new(0.95, 0.85, 0.6) },
            Lobe { weight: 0.04, alpha: 0.35, f0: DVec3::new(0.95, 0.85, 0.6) },
        ],
        albedo: DVec3::ZERO,
    },
    StandIn {
        name: "metallic-paint",
        lobes: &[
            Lobe { weight: 0.6, alpha: 0.15, f0: DVec3::new(0.22, 0.3, 0.4) },
            Lobe { weight: 0.4, alpha: 0.35, f0: DVec3::new(0.12, 0.3, 0.4) },
        ],
        albedo: DVec3::new(0.02, 0.05, 0.08),
    },
    StandIn {
        name: "rough",
        lobes: &[Lobe { weight: 1.0, alpha: 0.45, f0: DVec3::splat(0.04) }],
        albedo: DVec3::new(0.5, 0.4, 0.3),
    },
];

/// The stand-ins' names: a mirror-like metal, a metallic paint, and a rough dielectric over a diffuse base.
pub fn names() -> &'static [&'static str] {
    const NAMES: [&str; ALL.len()] = [ALL[0].name, ALL[1].name, ALL[2].name];
    &NAMES
}

/// Bakes the synthetic table of that name, or `None` if there is no such stand-in.
pub fn table(name: &str) -> Option<MerlTable> {
    let material = ALL.iter().find(|s| s.name == name)?;
    Some(MerlTable::from_fn(|theta_half, theta_diff, phi_diff| material.evaluate(Angles { theta_half, theta_diff, phi_diff })))
}

impl StandIn {
    /// Reflectance in 1/sr. Below the horizon it goes on as at the horizon, so that the bins which straddle it are not dark.
    fn evaluate(&self, angles: Angles) -> DVec3 {
        let (wi, wo) = angles.directions();
        let h = DVec3::new(angles.theta_half.sin(), 0.0, angles.theta_half.cos());
        let fresnel = |lobe: &Lobe| schlick(lobe.f0, angles.theta_diff.cos());
        let specular: DVec3 = self
            .lobes
            .iter()
            .map(|lobe| {
                let shape = distribution(lobe.alpha, h) * masking(lobe.alpha, wi.z.max(0.0)) * masking(lobe.alpha, wo.z.max(0.0));
                fresnel(lobe) * (lobe.weight * shape)
            })
            .sum();
        let through = self.lobes.first().map_or(DVec3::ONE, |lobe| DVec3::ONE - fresnel(lobe));
        specular + self.albedo * through / PI
    }
}
