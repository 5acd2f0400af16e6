//! What the filters that read through mips make of a material's normals and roughness, in f64: twin of the passes `brdf_map` and
//! `vmf_mips` and of what `filter` decodes.

use crate::config::Filter;
use crate::distribution::effective::Rule;
use crate::distribution::{BrdfMap, Filtered, Mixture, vmf};
use crate::material::{LEAST_ALPHA, MOST_CONCENTRATION, Maps, Material, unit};
use crate::reflectance::{Ggx, Model};
use crate::texture::Texture;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// What of a material's lobes is filtered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Base {
    /// One lobe about the normal, of this spread where there is no map of roughness.
    Lobe {
        /// [`vmf::spread`].
        spread: f64,
    },
    /// Normals only: lobes that one parameter does not describe stay as they are.
    Normals,
}

/// How one lobe's concentration becomes alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parameter {
    /// sqrt(2 / concentration).
    Alpha,
    /// That of a cosine power, whose mean cosine is exact: sqrt(2 spread).
    Exponent,
}

impl Base {
    /// Of a material that has something to filter.
    pub fn of(material: &Material) -> Option<Self> {
        let maps = &material.maps;
        let base = match &material.model {
            Model::Ggx(ggx) => Self::Lobe { spread: vmf::spread(2.0 / ggx.alpha.max(LEAST_ALPHA).powi(2)) },
            Model::BlinnPhong(blinn_phong) => Self::Lobe { spread: 1.0 / (blinn_phong.exponent + 2.0) },
            Model::Vmf(mixture) => match mixture.lobes() {
                [lobe] if lobe.mu.z > 1.0 - 1e-9 => Self::Lobe { spread: vmf::spread(lobe.kappa) },
                _ => Self::Normals,
            },
            Model::Table(_) | Model::Turned(_) => Self::Normals,
        };
        (maps.normal.is_some() || base != Self::Normals && maps.roughness.is_some()).then_some(base)
    }

    /// The map of roughness that counts.
    pub fn roughness(self, material: &Material) -> Option<&Arc<Texture>> {
        material.maps.roughness.as_ref().filter(|_| self != Self::Normals).map(|(map, _)| map)
    }

    /// Texels of the map of moments: as many a side as the finer map has.
    pub fn size(self, material: &Material) -> [u32; 2] {
        let maps = [material.maps.normal.as_ref(), self.roughness(material)];
        maps.into_iter().flatten().fold([1, 1], |[w, h], map| [w.max(map.size()[0]), h.max(map.size()[1])])
    }
}

impl Parameter {
    /// Of a model with one lobe.
    pub fn of(model: &Model) -> Self {
        if matches!(model, Model::BlinnPhong(_)) { Self::Exponent } else { Self::Alpha }
    }
}

/// The lobe at each place of a material, at each scale.
#[derive(Clone, Debug)]
pub struct Moments {
    filtered: Filtered<'static>,
    base: Base,
}

impl Moments {
    /// Those that `filter` reads of a valid material; `None` for filters that read no mips of normals, and for materials without
    /// a map to filter.
    pub fn of(material: &Material, filter: Filter) -> Option<Self> {
        let (filter, base) = (filter.stored()?, Base::of(material)?);
        let sharp = || {
            let model = Model::Ggx(Ggx { alpha: LEAST_ALPHA, f0: DVec3::ONE, albedo: DVec3::ZERO });
            Material::new(model, Maps { normal: material.maps.normal.clone(), ..Maps::default() })
        };
        let map = match base {
            Base::Lobe { .. } => BrdfMap::of(material, base.size(material), Rule::Exact),
            Base::Normals => BrdfMap::of(&sharp(), base.size(material), Rule::Exact),
        };
        Some(Self { filtered: Filtered::keeping(filter, map.ok()?, false), base })
    }

    /// What is stored, with its mips.
    pub fn filtered(&self) -> &Filtered<'static> {
        &self.filtered
    }

    /// The shading normal, and the model's own parameter unless its lobes stay as they are, at `place` on the maps and a level
    /// of theirs.
    pub(crate) fn at(&self, model: &Model, place: DVec2, lod: f64) -> (DVec3, Option<f64>) {
        let Mixture::Vmf(lobes) = self.filtered.decode(&self.filtered.sample(place, lod)) else { return (DVec3::Z, None) };
        let Some(lobe) = lobes.first() else { return (DVec3::Z, None) };
        let own = match model {
            Model::Ggx(_) => (2.0 / lobe.kappa).sqrt().clamp(LEAST_ALPHA, 1.0),
            Model::BlinnPhong(_) => (1.0 / vmf::spread(lobe.kappa) - 2.0).clamp(0.0, MOST_CONCENTRATION),
            _ => lobe.kappa.clamp(0.0, MOST_CONCENTRATION),
        };
        (lobe.mu, (self.base != Base::Normals).then_some(own))
    }
}

/// About the most that normals add to the square of alpha under a filter that widens lobes: twice what all of the map's
/// together add, as a part of them may spread more; at most 1.
pub(crate) fn most_added(material: &Material, filter: Filter) -> f64 {
    let widens = matches!(filter, Filter::Toksvig | Filter::Vmf1) && matches!(Base::of(material), Some(Base::Lobe { .. }));
    let Some(map) = material.maps.normal.as_ref().filter(|_| widens) else { return 0.0 };
    let sum: DVec3 = map.texels().map(|texel| unit(texel.truncate().truncate())).sum();
    let mean = sum / map.texels().count().max(1) as f64;
    // Alpha squared is twice the spread.
    (4.0 * (1.0 - mean.length())).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Roughness;
    use crate::reflectance::{BlinnPhong, MerlTable, Vmf};

    fn tilted(x: f32) -> [f32; 3] {
        [x, 0.0, (1.0 - x * x).sqrt()]
    }

    fn maps(normals: [f32; 2]) -> Maps {
        let normal = Texture::normals([2, 1], &normals.map(tilted)).unwrap();
        Maps { normal: Some(Arc::new(normal)), ..Maps::default() }
    }

    #[test]
    fn normals_widen_a_lobe_by_their_spread() {
        let blinn_phong = Model::BlinnPhong(BlinnPhong { exponent: 98.0, specular: DVec3::ONE, albedo: DVec3::ZERO });
        let ggx = Model::Ggx(Ggx { alpha: 0.1, f0: DVec3::ONE, albedo: DVec3::ZERO });
        let one = Model::Vmf(Arc::new(Vmf::new(&[vmf::Lobe { mu: DVec3::Z, kappa: 200.0, weight: 1.0 }]).unwrap()));
        for (model, own, spread) in [(blinn_phong, 98.0, 0.01), (ggx, 0.1, vmf::spread(200.0)), (one, 200.0, vmf::spread(200.0))]
        {
            let material = Material::new(model.clone(), maps([0.3, -0.3]));
            let moments = Moments::of(&material, Filter::Vmf1).unwrap();
            let near = material.filtered_at(Some(&moments), DVec2::new(0.25, 0.5), [DVec2::ZERO; 2]);
            // Normals are stored in 16 bits.
            assert!((near.normal.x - 0.3).abs() < 1e-3 && (near.roughness.unwrap() / own - 1.0).abs() < 1e-5, "{near:?}");
            let far = material.filtered_at(Some(&moments), DVec2::new(0.25, 0.5), [DVec2::X, DVec2::Y]);
            let length = (1.0 - spread) * (1.0f64 - 0.09).sqrt();
            let (kappa, parameter) = (vmf::concentration(1.0 - length), far.roughness.unwrap());
            let expected = match &model {
                Model::Ggx(_) => (2.0 / kappa).sqrt(),
                Model::BlinnPhong(_) => 1.0 / (1.0 - length) - 2.0,
                _ => kappa,
            };
            assert!((parameter / expected - 1.0).abs() < 2e-3 && far.normal.z > 0.999_999, "{parameter} for {expected}");
            // Both normals together add 0.093 to alpha squared.
            assert!((most_added(&material, Filter::Vmf1) - 4.0 * (1.0 - 0.91f64.sqrt())).abs() < 1e-3);
            assert_eq!(most_added(&material, Filter::Naive), 0.0);
            assert!(most_added(&Material::new(model, maps([0.3, 0.3])), Filter::Toksvig) < 1e-5);
        }
    }

    #[test]
    fn tables_and_mixtures_keep_their_lobes() {
        let lobe = |x: f64| vmf::Lobe { mu: DVec3::new(x, 0.0, 1.0).normalize(), kappa: 40.0, weight: 0.5 };
        let mixture = Model::Vmf(Arc::new(Vmf::new(&[lobe(0.4), lobe(-0.4)]).unwrap()));
        let off = Model::Vmf(Arc::new(Vmf::new(&[lobe(0.4)]).unwrap()));
        let table = Model::Table(Arc::new(MerlTable::from_fn(|_, _, _| DVec3::ONE)));
        for model in [mixture, off, table] {
            let material = Material::new(model.clone(), maps([0.5, -0.3]));
            let moments = Moments::of(&material, Filter::Vmf1).unwrap();
            let far = material.filtered_at(Some(&moments), DVec2::ZERO, [DVec2::X, DVec2::Y]);
            let mean = DVec2::new(0.2, 0.75f64.sqrt() + 0.91f64.sqrt()).normalize();
            assert!((far.normal.x - mean.x).abs() < 1e-3 && far.roughness.is_none(), "{far:?}");
            let rough = Texture::scalar([1, 1], &[0.5]).unwrap();
            let rough = Maps { roughness: Some((Arc::new(rough), Roughness::Alpha)), ..Maps::default() };
            assert!(Moments::of(&Material::new(model, rough), Filter::Vmf1).is_none());
            assert!(Moments::of(&material, Filter::Tk).is_none());
        }
    }
}
