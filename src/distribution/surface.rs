//! Reflection by the lobes that a filter finds at a sample, the twin of `glsl/include/lobes.glsl`.
//!
//! A lobe is a *facet*: a surface of its own, with the normal of what is below it, so that its masking, its base and its cosine are
//! those of normals that the pixel has, and not of their mean. Each place below has its lobes about its own normal, where they fill
//! the projected area: their integral over directions is 1 over the mean cosine there, and that of a wider lobe is made the same.
//! Gaussians of slopes (LEAN, LEADR) are one distribution about the surface's own normal, which fills its area.

use crate::distribution::effective;
use crate::distribution::elliptic;
use crate::distribution::mixture::{Masking, Mixture};
use crate::distribution::vmf::{self, Lobe};
use crate::material::{LEAST_ALPHA, MOST_CONCENTRATION};
use crate::reflectance::vmf::LEAST_PROJECTED_AREA;
use crate::reflectance::{Model, Reflectance, ggx};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// The least cosine of a facet to the viewer: one that faces away counts as bent to there, as shading normals are.
const FACING: f64 = 0.02;

/// Lobes found at a place of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundLobes {
    /// The shading normal, unit, in the tangent frame: the mean of the normals, or the frame's own for slopes.
    pub normal: DVec3,
    /// In the tangent frame, of weights that sum to 1.
    pub lobes: Mixture,
    /// The normals below each lobe, unit; none for slopes.
    pub normals: Vec<DVec3>,
    /// The mean concentration of the lobes below each; none for slopes, and where the mass is known.
    pub below: Vec<f64>,
    /// What the lobes below integrate to over solid angle, of one direction each, if it is known.
    pub mass: Option<f64>,
    /// The concentrations of the lobes below each, beside which the rest of its width is the spread of their normals: towards a half
    /// vector the normal is that of the places whose lobes are there. None where normals stay the mean ones.
    pub own: Vec<f64>,
    /// The factor on the specular colour of each, of which their mean is the place's; none where they share that.
    pub colours: Vec<DVec3>,
    /// The mean cosine of the directions of a place's lobes to its normal.
    pub facing: f64,
    /// How they are masked, if they are slopes.
    pub masking: Masking,
}

impl FoundLobes {
    /// The mean of the lobes' colours; 0 without.
    fn mean_colour(&self) -> DVec3 {
        let Mixture::Elliptic(lobes) = &self.lobes else { return DVec3::ZERO };
        let weights: f64 = lobes.iter().map(|l| l.round.weight).sum();
        self.colours.iter().zip(lobes).map(|(colour, l)| *colour * l.round.weight).sum::<DVec3>() / weights
    }

    /// The same with `kernel` added to every lobe's 2 / concentration, that is half of it to every variance of slopes.
    pub fn widened(mut self, kernel: f64) -> Self {
        match &mut self.lobes {
            Mixture::Vmf(lobes) => lobes.iter_mut().for_each(|l| l.kappa /= 1.0 + 0.5 * l.kappa * kernel),
            Mixture::Elliptic(lobes) => lobes.iter_mut().for_each(|l| *l = l.widened(kernel)),
            Mixture::Slopes(lobes) => {
                lobes.iter_mut().for_each(|l| [0, 2].into_iter().for_each(|i| l.covariance[i] += 0.5 * kernel));
            }
        }
        self
    }
}

/// The mean cosine over solid angle of a model's lobe of concentration `kappa` about its direction.
fn mean_cosine(model: &Model, kappa: f64) -> f64 {
    match model {
        Model::Ggx(_) => effective::ggx_mean_cosine((2.0 / kappa).sqrt().clamp(LEAST_ALPHA, 1.0)),
        _ => vmf::mean_cosine(kappa).max(LEAST_PROJECTED_AREA),
    }
}

/// A lobe and the normal below it.
#[derive(Clone, Debug)]
struct Facet {
    lobe: elliptic::Lobe,
    /// The mean.
    normal: DVec3,
    /// How far the normals follow the half vector along the axis and across, of 1.
    follows: [f64; 2],
    /// Its specular colour over that of the place.
    colour: DVec3,
}

impl Facet {
    /// The normal of the places whose lobes are at `h`: turned as the mean normal is from the lobe's direction.
    fn normal_at(&self, h: DVec3) -> DVec3 {
        let [along, across] = self.follows;
        if along <= 0.0 {
            return self.normal;
        }
        let (mu, axis) = (self.lobe.round.mu, self.lobe.axis);
        let (off, other) = (h - mu, mu.cross(axis));
        let part = mu * (1.0 - along * 0.5 * off.length_squared());
        let at = (part + axis * (along * off.dot(axis)) + other * (across * off.dot(other))).normalize_or(mu);
        let (turn, cosine) = (mu.cross(self.normal), mu.dot(self.normal));
        at * cosine + turn.cross(at) + turn * (turn.dot(at) / (1.0 + cosine).max(1e-3))
    }
}

/// A model with the lobes that were found in the place of its own, in the frame about the shading normal.
#[derive(Clone, Debug)]
pub struct Surface {
    /// With the colours of its maps.
    model: Model,
    facets: Vec<Facet>,
    /// In their place.
    slopes: Option<Mixture>,
    masking: Masking,
    /// Factor on what is specular, and albedo below: of vMF lobes, which have none of their own.
    specular: DVec3,
    base: DVec3,
}

impl Surface {
    /// `model` with `found`. `specular` and `base` are a factor on, and the albedo under, vMF lobes.
    pub fn new(model: Model, found: &FoundLobes, specular: DVec3, base: DVec3) -> Self {
        let frame = effective::about(found.normal).transpose();
        let area = |kappa| mean_cosine(&model, kappa);
        let mean = found.mean_colour();
        let of = |i: usize| found.mass.map_or_else(|| found.below.get(i).map_or(1.0, |kappa| area(*kappa)), |mass| 1.0 / mass);
        let turned = |(i, l): (usize, elliptic::Lobe)| {
            let weight = l.round.weight * area(l.round.kappa) / (found.facing * of(i));
            let normal = frame * found.normals.get(i).copied().unwrap_or(found.normal);
            let follows = found.own.get(i).map_or([0.0; 2], |own| {
                [l.round.kappa / l.ratio, l.round.kappa * l.ratio].map(|kappa| (1.0 - kappa / own).max(0.0))
            });
            let round = Lobe { mu: frame * l.round.mu, weight, ..l.round };
            let part = |own: f64, all: f64| if all > 0.0 { own / all } else { 1.0 };
            let over = |own: &DVec3| DVec3::from_array([0, 1, 2].map(|c| part(own[c], mean[c])));
            let colour = found.colours.get(i).map_or(DVec3::ONE, over);
            Facet { lobe: elliptic::Lobe { round, axis: frame * l.axis, ..l }, normal, follows, colour }
        };
        let (facets, slopes) = match &found.lobes {
            Mixture::Vmf(lobes) => (lobes.iter().map(|l| (*l).into()).enumerate().map(turned).collect(), None),
            Mixture::Elliptic(lobes) => (lobes.iter().copied().enumerate().map(turned).collect(), None),
            slopes @ Mixture::Slopes(_) => (Vec::new(), Some(slopes.clone())),
        };
        let total = match &model {
            Model::Vmf(vmf) => vmf.lobes().iter().map(|l| l.weight).sum(),
            _ => 1.0,
        };
        let (specular, base) = match &model {
            Model::Ggx(g) => (g.f0, g.albedo),
            Model::BlinnPhong(b) => (b.specular, b.albedo),
            Model::Vmf(_) | Model::Table(_) | Model::Turned(_) => (specular * total, base),
        };
        Self { model, facets, slopes, masking: found.masking, specular, base }
    }

    /// Fresnel reflectance of a specular colour.
    fn fresnel(&self, specular: DVec3, cosine: f64) -> DVec3 {
        match self.model {
            Model::Ggx(_) => ggx::schlick(specular.min(DVec3::ONE), cosine),
            Model::BlinnPhong(_) => specular.min(DVec3::ONE),
            _ => specular,
        }
    }

    /// `D G / (4 cos cos)` of a facet whose normal has the cosines `ci`, `co` and `ch` to light, viewer and half vector; `square` is the
    /// squared distance of the half vector from the lobe's direction, which sharp lobes need, `factor` that on the concentration
    /// towards it, `across` its cosine to the viewer.
    fn facet(&self, kappa: f64, factor: f64, [ci, co, ch]: [f64; 3], square: f64, across: f64) -> f64 {
        let cosine = 1.0 - 0.5 * square;
        let sine = (square * (1.0 - 0.25 * square)).max(0.0);
        let cavity = (0.25 / (ci * co)).min(0.5 * ch.max(0.0) / (across * ci.max(co)));
        match &self.model {
            Model::Ggx(_) if cosine > 0.0 => {
                let alpha = (2.0 / kappa).sqrt().clamp(LEAST_ALPHA, 1.0);
                let a = alpha * alpha;
                a / (PI * (a * cosine * cosine + factor * sine).powi(2)) * ggx::masking(alpha, ci) * ggx::masking(alpha, co)
            }
            Model::BlinnPhong(_) if cosine > 0.0 => {
                let exponent = (1.0 / vmf::spread(kappa) - 2.0).clamp(0.0, MOST_CONCENTRATION);
                let there = (factor * (exponent + 2.0) - 2.0).max(0.0);
                (exponent + 2.0) / TAU * (0.5 * there * (-sine.min(1.0)).ln_1p()).exp() * cavity
            }
            Model::Vmf(_) => elliptic::height(kappa, factor, square) / vmf::mean_cosine(kappa).max(LEAST_PROJECTED_AREA) * cavity,
            _ => 0.0,
        }
    }
}

impl Reflectance for Surface {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return DVec3::ZERO;
        }
        let h = (wi + wo).normalize();
        let across = wo.dot(h);
        let fresnel = self.fresnel(self.specular, across);
        let below = if matches!(self.model, Model::Ggx(_)) { self.base * (DVec3::ONE - fresnel) } else { self.base };
        let (specular, lit) = if let Some(slopes) = &self.slopes {
            let lit = |b: DVec2| (-b).extend(1.0).normalize().dot(wi).max(0.0);
            let lit = if let Mixture::Slopes(lobes) = slopes { lobes.iter().map(|l| l.weight * lit(l.mean)).sum() } else { 0.0 };
            (fresnel * slopes.specular(wi, wo, self.masking), lit / wi.z)
        } else {
            let (mut specular, mut lit, mut weights) = (DVec3::ZERO, 0.0, 0.0);
            for facet in &self.facets {
                let Facet { lobe, normal: mean, .. } = facet;
                let (round, normal) = (&lobe.round, facet.normal_at(h));
                weights += round.weight;
                lit += round.weight * mean.dot(wi).max(0.0);
                let ci = normal.dot(wi);
                if ci <= 0.0 {
                    continue;
                }
                let cosines = [ci, normal.dot(wo).max(FACING), normal.dot(h)];
                let square = (h - round.mu).length_squared();
                let value = self.facet(round.kappa, lobe.factor(h), cosines, square, across);
                specular += self.fresnel(self.specular * facet.colour, across) * (round.weight * ci * value);
            }
            (specular / wi.z, lit / wi.z / f64::max(weights, f64::MIN_POSITIVE))
        };
        specular + below * (lit / PI)
    }

    fn isotropic(&self) -> bool {
        false
    }
}
