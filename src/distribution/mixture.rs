//! What a filter decodes: lobes, and the microfacet distribution that they are.

use crate::distribution::{elliptic, slope, vmf};
use crate::reflectance::cavity;
use crate::reflectance::vmf::LEAST_PROJECTED_AREA;
use glam::{DVec2, DVec3};

/// Lobes of one kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Mixture {
    /// Mean direction and concentration.
    Vmf(Vec<vmf::Lobe>),
    /// The same with concentrations along an axis and across.
    Elliptic(Vec<elliptic::Lobe>),
    /// Mean slope and its covariance.
    Slopes(Vec<slope::Lobe>),
}

/// How much of the lobes' normals is seen and lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Masking {
    /// V-cavities, which need the half vector only.
    Cavities,
    /// Smith's, from the mean and the covariance of all slopes (Dupuy et al. 2013).
    Slopes,
}

impl Mixture {
    /// How many lobes there are.
    pub fn count(&self) -> usize {
        match self {
            Self::Vmf(lobes) => lobes.len(),
            Self::Elliptic(lobes) => lobes.len(),
            Self::Slopes(lobes) => lobes.len(),
        }
    }

    /// The sum of the weights.
    pub fn weight(&self) -> f64 {
        match self {
            Self::Vmf(lobes) => lobes.iter().map(|l| l.weight).sum(),
            Self::Elliptic(lobes) => lobes.iter().map(|l| l.round.weight).sum(),
            Self::Slopes(lobes) => lobes.iter().map(|l| l.weight).sum(),
        }
    }

    /// The density at unit `h`, per steradian; its integral over the sphere is [`Self::weight`].
    pub fn density(&self, h: DVec3) -> f64 {
        match self {
            Self::Vmf(lobes) => lobes.iter().map(|l| l.density(h)).sum(),
            Self::Elliptic(lobes) => lobes.iter().map(|l| l.density(h)).sum(),
            Self::Slopes(lobes) => lobes.iter().map(|l| l.density(h)).sum(),
        }
    }

    /// The density of [`Self::sample`] at unit `h`.
    pub fn pdf(&self, h: DVec3) -> f64 {
        self.density(h) / self.weight().max(f64::MIN_POSITIVE)
    }

    /// A half vector for `u` uniform in the unit cube: its lobe by the first number, in the lobe by the others. It may lie below
    /// the horizon. +Z without any lobe.
    pub fn sample(&self, u: [f64; 3]) -> DVec3 {
        let within = [u[1], u[2]];
        let mut left = u[0] * self.weight();
        // Rounding may leave a little after the last.
        let mut chosen = |weight: f64| {
            left -= weight;
            left < 0.0
        };
        match self {
            Self::Vmf(lobes) => {
                let lobe = lobes.iter().find(|l| chosen(l.weight)).or(lobes.last());
                lobe.map_or(DVec3::Z, |l| l.sample(within))
            }
            Self::Elliptic(lobes) => {
                let lobe = lobes.iter().find(|l| chosen(l.round.weight)).or(lobes.last());
                lobe.map_or(DVec3::Z, |l| l.sample(within))
            }
            Self::Slopes(lobes) => {
                let lobe = lobes.iter().find(|l| chosen(l.weight)).or(lobes.last());
                lobe.map_or(DVec3::Z, |l| l.sample(within))
            }
        }
    }

    /// The density D of microfacet normals at unit `h` above the horizon, per steradian and area of the macro surface, times the
    /// weight: the integral of `D cos` is the weight. Of directions, by the projected area that their mean vectors give
    /// (`n . sum(w r) / sum(w)`, at least 0.05, where what is below the horizon counts); of slopes, each has its own.
    pub fn distribution(&self, h: DVec3) -> f64 {
        let projected = match self {
            Self::Vmf(lobes) => lobes.iter().map(|l| l.mean().z).sum::<f64>(),
            Self::Elliptic(lobes) => lobes.iter().map(|l| l.mean().z).sum(),
            Self::Slopes(_) => return self.density(h) / h.z.max(f64::MIN_POSITIVE),
        };
        self.density(h) / (projected / self.weight().max(f64::MIN_POSITIVE)).max(LEAST_PROJECTED_AREA)
    }

    /// One lobe of slopes with the moments and the weight of all.
    pub fn slopes(&self) -> slope::Lobe {
        let lobe = |l: &vmf::Lobe| {
            let mean = slope::of(l.mu);
            slope::Lobe { mean, covariance: slope::carried(mean, l.kappa), weight: l.weight }
        };
        let ellipse = |l: &elliptic::Lobe| {
            let round = &l.round;
            let mean = slope::of(round.mu);
            let cosine = round.mu.z.max(slope::LEAST_COSINE);
            let mut covariance = [0.0; 3];
            for (tangent, kappa) in [(l.axis, round.kappa / l.ratio), (round.mu.cross(l.axis), round.kappa * l.ratio)] {
                let by = -(tangent.truncate() + mean * tangent.z) / cosine;
                let products = [by.x * by.x, by.x * by.y, by.y * by.y];
                covariance.iter_mut().zip(products).for_each(|(sum, product)| *sum += product * slope::variance(kappa));
            }
            slope::Lobe { mean, covariance, weight: round.weight }
        };
        let lobes: Vec<_> = match self {
            Self::Vmf(lobes) => lobes.iter().map(lobe).collect(),
            Self::Elliptic(lobes) => lobes.iter().map(ellipse).collect(),
            Self::Slopes(lobes) => lobes.clone(),
        };
        let total = self.weight();
        let (mut mean, mut second) = (DVec2::ZERO, [0.0; 3]);
        for l in &lobes {
            let (first, products) = l.moments();
            let share = l.weight / total.max(f64::MIN_POSITIVE);
            mean += share * first;
            second.iter_mut().zip(products).for_each(|(sum, product)| *sum += share * product);
        }
        slope::Lobe::from_moments(mean, second, total)
    }

    /// `D G / (4 cos cos)`: the reflectance of white, 0 where either direction is at or below the horizon. A Fresnel term, which
    /// is the same for all lobes at a given half vector, is a factor on it.
    pub fn specular(&self, wi: DVec3, wo: DVec3, masking: Masking) -> f64 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return 0.0;
        }
        let h = (wi + wo).normalize();
        let open = match masking {
            Masking::Cavities => cavity::masking(wi, wo, h),
            Masking::Slopes => self.slopes().masking(wi, wo),
        };
        self.distribution(h) * open
    }
}
