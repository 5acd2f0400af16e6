//! The importance tables of a material: one, or where a map varies its roughness a ladder of them.

use crate::material::{Material, PointMaterial};
use crate::reflectance::{ImportanceTable, Model};
use glam::DVec3;
use half::f16;

/// Tables of a material whose roughness varies.
const MOST_STEPS: usize = 8;
/// From one to the next, log2 of alpha: a table for another alpha draws well within about this distance.
const STEP: f64 = 0.5;
/// The least exponent or concentration that the logarithm takes.
const LEAST_CONCENTRATION: f64 = 0.125;

/// Importance tables over steps of a model's roughness parameter, equal in its logarithm.
#[derive(Clone, Debug)]
pub struct Ladder {
    points: Vec<PointMaterial>,
    /// log2 of the first step's parameter.
    first: f64,
    /// Steps a doubling of the parameter.
    steps_per_log2: f64,
}

impl Ladder {
    /// Of a valid material. Colour maps count with their mean.
    pub fn of(material: &Material) -> Self {
        let at = |roughness| material.mean(roughness);
        let Some((least, most)) = material.roughness_range() else {
            return Self { points: vec![at(None)], first: 0.0, steps_per_log2: 0.0 };
        };
        // A concentration is 2 / alpha^2: twice the step.
        let alpha = matches!(material.model, Model::Ggx(_));
        let (step, floor) = if alpha { (STEP, 0.0) } else { (2.0 * STEP, LEAST_CONCENTRATION) };
        let [least, most] = [least, most].map(|v| v.max(floor).log2());
        let steps = (((most - least) / step).ceil() as usize + 1).clamp(1, MOST_STEPS);
        let steps_per_log2 = if most > least { (steps - 1) as f64 / (most - least) } else { 0.0 };
        let parameter = |i: usize| if i == 0 { least } else { least + i as f64 / steps_per_log2 }.exp2();
        Self { points: (0..steps).map(|i| at(Some(parameter(i)))).collect(), first: least, steps_per_log2 }
    }

    /// Number of tables.
    pub fn steps(&self) -> usize {
        self.points.len()
    }

    /// What the shaders know, where the first table has the given number: first table, last step, log2 of the first step's
    /// parameter, steps a log2.
    pub fn record(&self, first: usize) -> [f32; 4] {
        [first as f32, (self.steps() - 1) as f32, self.first as f32, self.steps_per_log2 as f32]
    }

    /// The table of step `i`.
    pub fn table(&self, material: &Material, i: usize) -> ImportanceTable {
        if material.maps.is_empty() {
            return ImportanceTable::build(&material.model);
        }
        let point = self.points[i.min(self.points.len() - 1)];
        ImportanceTable::build(&point.reflectance(&material.model))
    }
}

impl Material {
    /// The material as its colour maps make it on average, with the given roughness.
    fn mean(&self, roughness: Option<f64>) -> PointMaterial {
        let without = if matches!(self.model, Model::Vmf(_)) { DVec3::ZERO } else { DVec3::ONE };
        let mean = |map: Option<&std::sync::Arc<crate::Texture>>, without| {
            map.map_or(without, |m| m.sample(glam::DVec2::ZERO, m.levels() as f64).truncate())
        };
        PointMaterial {
            normal: DVec3::Z,
            albedo: mean(self.maps.albedo.as_ref(), without),
            specular: mean(self.maps.specular.as_ref(), DVec3::ONE),
            roughness,
        }
    }

    /// The least and the greatest of the model's parameter that a roughness map gives.
    fn roughness_range(&self) -> Option<(f64, f64)> {
        let (map, kind) = self.maps.roughness.as_ref()?;
        let texels = map.level(0).1.as_chunks::<2>().0.iter();
        let values = texels.map(|b| self.model.roughness_from(*kind, f16::from_le_bytes(*b).to_f64()));
        values.fold(None, |range, v| range.map_or(Some((v, v)), |(least, most): (f64, f64)| Some((least.min(v), most.max(v)))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::Ggx;
    use crate::{Maps, Roughness, Texture};
    use std::sync::Arc;

    #[test]
    fn steps_span_the_roughness_of_the_map() {
        let ggx = Ggx { alpha: 0.3, f0: DVec3::ONE, albedo: DVec3::ZERO };
        let plain = Material::from(Model::Ggx(ggx));
        assert_eq!(Ladder::of(&plain).record(7), [7.0, 0.0, 0.0, 0.0]);
        let map = |values: &[f32]| Some((Arc::new(Texture::scalar([2, 1], values).unwrap()), Roughness::Alpha));
        let with = |values: &[f32]| Material { maps: Maps { roughness: map(values), ..Maps::default() }, ..plain.clone() };
        // From 1/8 to 1/2 in steps of half a log2.
        let ladder = Ladder::of(&with(&[0.5, 0.125]));
        assert_eq!(ladder.record(0), [0.0, 4.0, -3.0, 2.0]);
        let alphas: Vec<_> = ladder.points.iter().map(|p| p.roughness.unwrap()).collect();
        assert!((alphas[0] - 0.125).abs() < 1e-9 && (alphas[4] - 0.5).abs() < 1e-9 && (alphas[2] - 0.25).abs() < 1e-9);
        assert_eq!(Ladder::of(&with(&[0.25, 0.25])).steps(), 1);
        assert_eq!(Ladder::of(&with(&[0.0, 1.0])).steps(), MOST_STEPS);
    }
}
