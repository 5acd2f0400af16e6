//! The importance tables of a material: one, or where maps or a filter vary its roughness a ladder of them.

use crate::material::{Material, PointMaterial};
use crate::reflectance::{ImportanceTable, Model};
use glam::{DVec2, DVec3};
use half::f16;

/// Tables of a material whose roughness varies.
const MOST_STEPS: usize = 8;
/// From one to the next, log2 of alpha squared: a table for another alpha draws well within about this distance.
const STEP: f64 = 1.0;

/// Importance tables over steps of alpha squared, equal in its logarithm. A lobe's alpha squared is 2 / concentration, a
/// cosine's 2 / (exponent + 2), that of several lobes the sharpest one's.
#[derive(Clone, Debug)]
pub struct Ladder {
    points: Vec<PointMaterial>,
    /// log2 of the first step's alpha squared.
    first: f64,
    /// Steps a doubling of alpha squared.
    steps_per_log2: f64,
}

impl Ladder {
    /// Of a valid material, to whose alpha squared a filter may add up to `added`. Colour maps count with their mean.
    pub fn of(material: &Material, added: f64) -> Self {
        let own = own_square(&material.model);
        let mapped = material.roughness_range();
        let (Some(_), true) = (own, added > 0.0 || mapped.is_some()) else {
            return Self { points: vec![material.mean(None, 0.0)], first: 0.0, steps_per_log2: 0.0 };
        };
        let own = own.unwrap_or_default();
        let most = if matches!(material.model, Model::Vmf(_)) { 16.0 } else { 1.0 };
        let (low, high) = mapped.unwrap_or((own, own));
        let high = high + added;
        let [first, last] = [low, high].map(|square: f64| square.min(most).log2());
        let steps = (((last - first) / STEP).ceil() as usize + 1).clamp(1, MOST_STEPS);
        let steps_per_log2 = if last > first { (steps - 1) as f64 / (last - first) } else { 0.0 };
        let point = |i: usize| {
            let square = if i == 0 { first } else { first + i as f64 / steps_per_log2 }.exp2();
            match mapped {
                Some(_) => material.mean(Some(parameter(&material.model, square)), 0.0),
                None => material.mean(None, if i == 0 { 0.0 } else { square - own }),
            }
        };
        Self { points: (0..steps).map(point).collect(), first, steps_per_log2 }
    }

    /// Number of tables.
    pub fn steps(&self) -> usize {
        self.points.len()
    }

    /// What the shaders know, where the first table has the given number: first table, last step, log2 of the first step's
    /// alpha squared, steps a log2.
    pub fn record(&self, first: usize) -> [f32; 4] {
        [first as f32, (self.steps() - 1) as f32, self.first as f32, self.steps_per_log2 as f32]
    }

    /// The table of step `i`.
    pub fn table(&self, material: &Material, i: usize) -> ImportanceTable {
        let point = &self.points[i.min(self.points.len() - 1)];
        if material.maps.is_empty() && point.kernel == 0.0 {
            return ImportanceTable::build(&material.model);
        }
        ImportanceTable::build(&point.reflectance(&material.model))
    }
}

/// Alpha squared of a model that has one.
pub fn own_square(model: &Model) -> Option<f64> {
    match model {
        Model::Ggx(g) => Some(g.alpha * g.alpha),
        Model::BlinnPhong(b) => Some(2.0 / (b.exponent + 2.0)),
        Model::Vmf(vmf) => Some(2.0 / vmf.lobes().iter().map(|l| l.kappa).fold(1e-3, f64::max)),
        Model::Table(_) | Model::Turned(_) => None,
    }
}

/// The model's own parameter for an alpha squared.
fn parameter(model: &Model, square: f64) -> f64 {
    match model {
        Model::BlinnPhong(_) => (2.0 / square - 2.0).max(0.0),
        Model::Vmf(_) => 2.0 / square,
        Model::Ggx(_) | Model::Table(_) | Model::Turned(_) => square.sqrt(),
    }
}

impl Material {
    /// The material as its colour maps make it on average, with the given roughness and kernel.
    fn mean(&self, roughness: Option<f64>, kernel: f64) -> PointMaterial {
        let without = if matches!(self.model, Model::Vmf(_)) { DVec3::ZERO } else { DVec3::ONE };
        let mean = |map: Option<&std::sync::Arc<crate::Texture>>, without| {
            map.map_or(without, |m| m.sample(DVec2::ZERO, m.levels() as f64).truncate())
        };
        PointMaterial {
            normal: DVec3::Z,
            albedo: mean(self.maps.albedo.as_ref(), without),
            specular: mean(self.maps.specular.as_ref(), DVec3::ONE),
            roughness,
            kernel,
            lobes: None,
        }
    }

    /// The least and the greatest alpha squared that a roughness map gives.
    fn roughness_range(&self) -> Option<(f64, f64)> {
        let (map, kind) = self.maps.roughness.as_ref()?;
        let square = |value: f64| match (&self.model, self.model.roughness_from(*kind, value)) {
            (Model::BlinnPhong(_), exponent) => 2.0 / (exponent + 2.0),
            (Model::Vmf(_), kappa) => 2.0 / kappa.max(1e-3),
            (Model::Ggx(_) | Model::Table(_) | Model::Turned(_), alpha) => alpha * alpha,
        };
        let values = map.level(0).1.as_chunks::<2>().0.iter().map(|b| square(f16::from_le_bytes(*b).to_f64()));
        values.fold(None, |range, v| range.map_or(Some((v, v)), |(least, most): (f64, f64)| Some((least.min(v), most.max(v)))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::MOST_KERNEL;
    use crate::reflectance::Ggx;
    use crate::{Maps, Roughness, Texture};
    use std::sync::Arc;

    #[test]
    fn steps_span_the_roughness_of_the_map() {
        let ggx = Ggx { alpha: 0.3, f0: DVec3::ONE, albedo: DVec3::ZERO };
        let plain = Material::from(Model::Ggx(ggx));
        assert_eq!(Ladder::of(&plain, 0.0).record(7), [7.0, 0.0, 0.0, 0.0]);
        let map = |values: &[f32]| Some((Arc::new(Texture::scalar([2, 1], values).unwrap()), Roughness::Alpha));
        let with = |values: &[f32]| Material { maps: Maps { roughness: map(values), ..Maps::default() }, ..plain.clone() };
        // Alpha from 1/8 to 1/2 in steps of half a log2.
        let ladder = Ladder::of(&with(&[0.5, 0.125]), 0.0);
        assert_eq!(ladder.record(0), [0.0, 4.0, -6.0, 1.0]);
        let alphas: Vec<_> = ladder.points.iter().map(|p| p.roughness.unwrap()).collect();
        assert!((alphas[0] - 0.125).abs() < 1e-9 && (alphas[4] - 0.5).abs() < 1e-9 && (alphas[2] - 0.25).abs() < 1e-9);
        assert_eq!(Ladder::of(&with(&[0.25, 0.25]), 0.0).steps(), 1);
        assert_eq!(Ladder::of(&with(&[0.0, 1.0]), 0.0).steps(), MOST_STEPS);
        // A kernel widens from the model's own: 0.09 to 0.27.
        let widened = Ladder::of(&plain, MOST_KERNEL);
        assert_eq!((widened.steps(), widened.points[0].kernel, widened.points[0].roughness), (3, 0.0, None));
        assert!((widened.points[2].kernel - MOST_KERNEL).abs() < 1e-9);
    }
}
