//! Stand-ins for measured materials. They are **synthetic**: analytic lobes baked into tables at MERL resolution, so that
//! everything made for measured tables can be shown and tested without a download. Each is a function of the half vector's
//! angles in which the two directions play the same part, and so is reciprocal.

use crate::reflectance::MerlTable;
use crate::reflectance::ggx::{distribution, masking, schlick};
use crate::reflectance::merl::{Angles, PHI_DIFF, THETA_DIFF, THETA_HALF};
use crate::sampling::sobol::{hash, to_unit};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// One GGX lobe.
struct Lobe {
    weight: f64,
    alpha: f64,
    /// Specular reflectance at normal incidence.
    f0: DVec3,
    /// What `f0` becomes at grazing incidence, before Schlick's term.
    edge: DVec3,
}

/// A coat of fibres that shines at the rim and back towards the light: a distribution of normals that grows with the sine of
/// theta_half (Estevez and Kulla 2017, "Production Friendly Microfacet Sheen BRDF", equation 2; masking after Neubelt and
/// Pettineo 2013).
struct Sheen {
    colour: DVec3,
    alpha: f64,
}

/// Lobes whose weights sum to one and a sheen, over a diffuse base that gets what the first lobe's Fresnel term lets through.
struct StandIn {
    name: &'static str,
    lobes: &'static [Lobe],
    sheen: Option<Sheen>,
    albedo: DVec3,
    /// Standard deviation of the logarithm of a factor on each cell, whose mean is 1: what a measurement would leave.
    noise: f64,
}

const fn lobe(weight: f64, alpha: f64, f0: DVec3) -> Lobe {
    Lobe { weight, alpha, f0, edge: f0 }
}

const METALLIC_PAINT: &[Lobe] = &[lobe(0.6, 0.15, DVec3::new(0.22, 0.3, 0.4)), lobe(0.4, 0.35, DVec3::new(0.12, 0.3, 0.4))];

const ALL: &[StandIn] = &[
    StandIn {
        name: "mirror-metal",
        lobes: &[lobe(0.96, 0.03, DVec3::new(0.95, 0.85, 0.6)), lobe(0.04, 0.35, DVec3::new(0.95, 0.85, 0.6))],
        sheen: None,
        albedo: DVec3::ZERO,
        noise: 0.0,
    },
    StandIn { name: "metallic-paint", lobes: METALLIC_PAINT, sheen: None, albedo: DVec3::new(0.02, 0.05, 0.08), noise: 0.0 },
    StandIn {
        name: "rough",
        lobes: &[lobe(1.0, 0.45, DVec3::splat(0.04))],
        sheen: None,
        albedo: DVec3::new(0.5, 0.4, 0.3),
        noise: 0.0,
    },
    // Clear coat over flakes.
    StandIn {
        name: "red-paint",
        lobes: &[lobe(0.25, 0.05, DVec3::splat(0.05)), lobe(0.75, 0.28, DVec3::new(0.55, 0.06, 0.05))],
        sheen: None,
        albedo: DVec3::new(0.09, 0.01, 0.01),
        noise: 0.0,
    },
    // Interference flakes: teal seen face on, violet aslant.
    StandIn {
        name: "shift-paint",
        lobes: &[
            lobe(0.2, 0.06, DVec3::splat(0.05)),
            Lobe { weight: 0.8, alpha: 0.22, f0: DVec3::new(0.05, 0.5, 0.42), edge: DVec3::new(0.5, 0.05, 0.6) },
        ],
        sheen: None,
        albedo: DVec3::new(0.01, 0.02, 0.03),
        noise: 0.0,
    },
    StandIn {
        name: "gloss-plastic",
        lobes: &[lobe(1.0, 0.045, DVec3::splat(0.042))],
        sheen: None,
        albedo: DVec3::new(0.03, 0.12, 0.4),
        noise: 0.0,
    },
    StandIn {
        name: "satin",
        lobes: &[lobe(0.7, 0.25, DVec3::new(0.2, 0.17, 0.14)), lobe(0.3, 0.6, DVec3::new(0.2, 0.17, 0.14))],
        sheen: Some(Sheen { colour: DVec3::new(0.12, 0.1, 0.08), alpha: 0.5 }),
        albedo: DVec3::new(0.38, 0.3, 0.24),
        noise: 0.0,
    },
    StandIn {
        name: "rubber",
        lobes: &[lobe(1.0, 0.6, DVec3::splat(0.03))],
        sheen: None,
        albedo: DVec3::splat(0.035),
        noise: 0.0,
    },
    StandIn {
        name: "felt",
        lobes: &[lobe(1.0, 0.9, DVec3::splat(0.01))],
        sheen: Some(Sheen { colour: DVec3::new(0.35, 0.5, 0.4), alpha: 0.3 }),
        albedo: DVec3::new(0.05, 0.2, 0.09),
        noise: 0.0,
    },
    // The metallic paint, measured badly.
    StandIn { name: "noisy-paint", lobes: METALLIC_PAINT, sheen: None, albedo: DVec3::new(0.02, 0.05, 0.08), noise: 0.2 },
];

/// The stand-ins' names: a mirror-like metal, a metallic paint, a rough dielectric over a diffuse base, two further metallic
/// paints of which the second shifts its colour with the angle, glossy plastic, satin, rubber, felt, and the metallic paint with noise of
/// 20 % in each cell.
pub fn names() -> &'static [&'static str] {
    const NAMES: [&str; ALL.len()] = {
        let mut names = [""; ALL.len()];
        let mut i = 0;
        while i < names.len() {
            names[i] = ALL[i].name;
            i += 1;
        }
        names
    };
    &NAMES
}

/// Bakes the synthetic table of that name, or `None` if there is no such stand-in.
pub fn table(name: &str) -> Option<MerlTable> {
    let material = ALL.iter().find(|s| s.name == name)?;
    let value = |theta_half, theta_diff, phi_diff| {
        let angles = Angles { theta_half, theta_diff, phi_diff };
        material.evaluate(angles) * material.disturbance(angles)
    };
    Some(MerlTable::from_fn_parallel(value))
}

impl Lobe {
    fn fresnel(&self, cosine: f64) -> DVec3 {
        schlick(self.f0 + (self.edge - self.f0) * (1.0 - cosine * cosine), cosine)
    }
}

impl Sheen {
    fn evaluate(&self, angles: Angles, wi: DVec3, wo: DVec3) -> DVec3 {
        let power = 1.0 / self.alpha;
        let density = (2.0 + power) * angles.theta_half.sin().powf(power) / (2.0 * PI);
        let (i, o) = (wi.z.max(0.0), wo.z.max(0.0));
        self.colour * (density / (4.0 * (i + o - i * o).max(1e-3)))
    }
}

impl StandIn {
    /// The factor on the cell at `angles`: log-normal, the same in all channels and whenever it is asked for.
    fn disturbance(&self, angles: Angles) -> f64 {
        if self.noise == 0.0 {
            return 1.0;
        }
        let cell = |share: f64, count: usize| (share * count as f64) as u32;
        let half = cell((angles.theta_half / FRAC_PI_2).sqrt(), THETA_HALF);
        let diff = cell(angles.theta_diff / FRAC_PI_2, THETA_DIFF);
        let number = (half * THETA_DIFF as u32 + diff) * PHI_DIFF as u32 + cell(angles.phi_diff / PI, PHI_DIFF);
        // Box and Muller's normal deviate.
        let [u, v] = [2 * number, 2 * number + 1].map(|n| to_unit(hash(n)));
        let deviate = (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos();
        (self.noise * (deviate - 0.5 * self.noise)).exp()
    }

    /// Reflectance in 1/sr. Below the horizon it goes on as at the horizon, so that the bins which straddle it are not dark.
    fn evaluate(&self, angles: Angles) -> DVec3 {
        let (wi, wo) = angles.directions();
        let h = DVec3::new(angles.theta_half.sin(), 0.0, angles.theta_half.cos());
        let cosine = angles.theta_diff.cos();
        let specular: DVec3 = self
            .lobes
            .iter()
            .map(|lobe| {
                let shape = distribution(lobe.alpha, h) * masking(lobe.alpha, wi.z.max(0.0)) * masking(lobe.alpha, wo.z.max(0.0));
                lobe.fresnel(cosine) * (lobe.weight * shape)
            })
            .sum();
        let through = self.lobes.first().map_or(DVec3::ONE, |lobe| DVec3::ONE - lobe.fresnel(cosine));
        let sheen = self.sheen.as_ref().map_or(DVec3::ZERO, |s| s.evaluate(angles, wi, wo));
        specular + sheen + self.albedo * through / PI
    }
}
