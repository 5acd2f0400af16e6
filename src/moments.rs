//! What the filters that read through mips make of a material's normals and roughness, in f64: twin of the passes `brdf_map` and
//! `vmf_mips` and of what `filter` decodes.

use crate::distribution::brdf_map::UPRIGHT;
use crate::distribution::cluster_search::Colours;
use crate::distribution::effective::{self, Rule, ggx_mean_cosine};
use crate::distribution::filtered::{Area, Known};
use crate::distribution::surface::FoundLobes;
use crate::distribution::{BrdfMap, Clusters, Division, Filter, Filtered, Gaussians, MOST_BASE_LOBES, Mixture, vmf};
use crate::material::{LEAST_ALPHA, Maps, Material, Reach, unit};
use crate::reflectance::vmf::LEAST_PROJECTED_AREA;
use crate::reflectance::{Ggx, Lobe, Model};
use crate::texture::Texture;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// The lobes of a model that filters take apart, of weights that sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BaseLobes {
    all: [Lobe; MOST_BASE_LOBES],
    count: usize,
}

impl BaseLobes {
    /// By `rule`; `None` for tables, which have none of their own, and for more lobes than are taken apart.
    pub fn of(model: &Model, rule: Rule) -> Option<Self> {
        let least = |ggx: &Ggx| Model::Ggx(Ggx { alpha: ggx.alpha.max(LEAST_ALPHA), ..*ggx });
        let lobes = match model {
            Model::Ggx(ggx) => effective::base(&least(ggx), None, rule)?,
            other => effective::base(other, None, rule)?,
        };
        let none = Lobe { mu: DVec3::Z, kappa: 0.0, weight: 0.0 };
        let mut all = [none; MOST_BASE_LOBES];
        all.get_mut(..lobes.len())?.copy_from_slice(&lobes);
        Some(Self { all, count: lobes.len() })
    }

    /// They.
    pub fn lobes(&self) -> &[Lobe] {
        self.all.get(..self.count).unwrap_or_default()
    }

    /// The mean cosine of their directions to the normal.
    pub fn facing(&self) -> f64 {
        self.lobes().iter().map(|lobe| lobe.weight * lobe.mu.z).sum()
    }

    /// Whether all are about the normal.
    pub fn upright(&self) -> bool {
        self.lobes().iter().all(|lobe| lobe.mu.z > UPRIGHT)
    }
}

/// What of a material is filtered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Base {
    /// Lobes under its normals and its roughness.
    Lobes(BaseLobes),
    /// Normals only: its lobes stay as they are.
    Normals,
}

/// What a concentration is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parameter {
    /// A lobe of alpha sqrt(2 / concentration).
    Alpha,
    /// A cosine power, whose mean cosine is exact, of alpha sqrt(2 spread).
    Exponent,
    /// GGX of that alpha, which has a mean cosine of its own.
    Ggx,
}

impl Base {
    /// Of a material that has something to filter.
    pub fn of(material: &Material, rule: Rule) -> Option<Self> {
        let maps = &material.maps;
        let base = BaseLobes::of(&material.model, rule).map_or(Self::Normals, Self::Lobes);
        (maps.normal.is_some() || base != Self::Normals && maps.roughness.is_some()).then_some(base)
    }

    /// The lobes that are filtered; none if they stay.
    pub fn lobes(&self) -> &[Lobe] {
        match self {
            Self::Lobes(base) => base.lobes(),
            Self::Normals => &[],
        }
    }

    /// [`BaseLobes::facing`], 1 if they stay.
    pub fn facing(&self) -> f64 {
        if let Self::Lobes(base) = self { base.facing() } else { 1.0 }
    }

    /// Whether a mean normal is stored beside lobes that are not about it.
    pub fn upright(&self) -> bool {
        matches!(self, Self::Lobes(base) if base.upright())
    }

    /// The map of roughness that counts.
    pub fn roughness<'a>(&self, material: &'a Material) -> Option<&'a Arc<Texture>> {
        material.maps.roughness.as_ref().filter(|_| *self != Self::Normals).map(|(map, _)| map)
    }

    /// Texels of the map of moments: as many a side as the finer map has.
    pub fn size(&self, material: &Material) -> [u32; 2] {
        let maps = [material.maps.normal.as_ref(), self.roughness(material)];
        maps.into_iter().flatten().fold([1, 1], |[w, h], map| [w.max(map.size()[0]), h.max(map.size()[1])])
    }
}

impl Parameter {
    /// The mean cosine over solid angle of a lobe of some concentration about its direction.
    pub fn area(self) -> Area {
        match self {
            Self::Ggx => |kappa| ggx_mean_cosine((2.0 / kappa).sqrt().clamp(LEAST_ALPHA, 1.0)),
            Self::Alpha | Self::Exponent => |kappa| vmf::mean_cosine(kappa).max(LEAST_PROJECTED_AREA),
        }
    }

    /// Of a model's lobes.
    pub fn of(model: &Model) -> Self {
        match model {
            Model::BlinnPhong(_) => Self::Exponent,
            Model::Ggx(_) => Self::Ggx,
            Model::Table(_) | Model::Turned(_) | Model::Vmf(_) => Self::Alpha,
        }
    }
}

/// The clusters of a material of which `base` is filtered by `filter`, if that has some.
pub(crate) fn clusters(material: &Material, base: &Base, filter: Filter) -> Option<Clusters> {
    let plain = base.lobes();
    if !filter.has_clusters() || plain.is_empty() {
        return None;
    }
    let size = base.size(material);
    let centre = |i: usize| {
        let [w, h] = size.map(f64::from);
        let (x, y) = ((i % size[0] as usize) as f64, (i / size[0] as usize) as f64);
        DVec2::new((x + 0.5) / w, 1.0 - (y + 0.5) / h)
    };
    let texel = |i: usize| {
        let uv = centre(i);
        let normal = material.maps.normal.as_ref().map_or(DVec3::Z, |map| unit(map.sample(uv, 0.0).truncate().truncate()));
        let roughness = base.roughness(material).zip(material.maps.roughness.as_ref());
        let lobes = roughness.and_then(|(map, (_, kind))| {
            let value = material.model.roughness_from(*kind, map.sample(uv, 0.0).x);
            effective::base(&material.model, Some(value), Rule::Exact)
        });
        effective::lobes(lobes.as_deref().unwrap_or(plain), normal, Rule::Exact)
    };
    // At the level of whose texels one here has about one.
    let finer = |map: &Texture| (0..2).map(|a| f64::from(map.size()[a]) / f64::from(size[a])).fold(1.0, f64::max).log2();
    let colour = |map: &Texture, i: usize| map.sample(centre(i), finer(map)).truncate();
    let specular = material.maps.specular.as_ref();
    let colours = specular.map(|map| move |i| colour(map, i));
    Some(Clusters::of(size, !base.upright(), &texel, colours.as_ref().map(|c| c as &Colours<'_>)))
}

/// The mixtures of a material of which `base` is filtered by `filter`, over maps of `size`, if the filter has some: those that are known
/// if they are of this size.
pub(crate) fn gaussians(material: &Material, base: &Base, size: [u32; 2], filter: Filter) -> Option<Arc<Gaussians>> {
    let fit = filter.gaussians().filter(|_| !base.lobes().is_empty())?;
    let map = BrdfMap::of(material, size, Rule::Exact).ok()?;
    let known = material.gaussians.clone().filter(|known| known.are_of(&map) && known.fit() == fit);
    Some(known.unwrap_or_else(|| Arc::new(Gaussians::of(&map, Parameter::of(&material.model).area(), fit))))
}

/// The lobes at each place of a material, at each scale.
#[derive(Clone, Debug)]
pub struct Moments {
    filter: Filter,
    lobes: Option<Filtered<'static>>,
    /// The mean normal, where lobes are not about it.
    normals: Option<Filtered<'static>>,
    size: [u32; 2],
    facing: f64,
}

impl Moments {
    /// Those that `filter` reads of a valid material; `None` for filters that read no mips of normals, and for materials without
    /// a map to filter. `rule` is [`crate::Config::lobe_rule`].
    pub fn of(material: &Material, filter: Filter, division: Division, rule: Rule) -> Option<Self> {
        if !filter.stores() {
            return None;
        }
        let rule = if filter.is_vmf() { rule } else { Rule::Exact };
        let base = Base::of(material, rule)?;
        let size = base.size(material);
        let keep = |material: &Material, filter, rule| {
            let gaussians = || gaussians(material, &base, size, filter).map_or(Known::Nothing, Known::Gaussians);
            let known = clusters(material, &base, filter).map_or_else(gaussians, Known::Clusters);
            let area = Parameter::of(&material.model).area();
            let map = BrdfMap::of(material, size, rule).ok()?;
            let map = match (&known, &material.maps.specular) {
                (Known::Clusters(clusters), Some(colours)) if clusters.layout().colours => map.coloured(colours),
                _ => map,
            };
            Some(Filtered::keeping(filter, map, rule, known, area)?.divided(division))
        };
        let lobes = if base == Base::Normals { None } else { Some(keep(material, filter, rule)?) };
        let normals = if base.upright() {
            None
        } else {
            let model = Model::Ggx(Ggx { alpha: LEAST_ALPHA, f0: DVec3::ONE, albedo: DVec3::ZERO });
            let maps = Maps { normal: material.maps.normal.clone(), ..Maps::default() };
            Some(keep(&Material::new(model, maps), Filter::Naive, Rule::Exact)?)
        };
        Some(Self { filter, lobes, normals, size, facing: base.facing() })
    }

    /// What is stored of the lobes, with its mips; `None` if the material's stay as they are.
    pub fn lobes(&self) -> Option<&Filtered<'static>> {
        self.lobes.as_ref()
    }

    /// What is stored of the mean normal, if lobes are not about it.
    pub fn normals(&self) -> Option<&Filtered<'static>> {
        self.normals.as_ref()
    }

    /// Texels of the map.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// What is found of a material at places on the maps, averaged: no lobes if these stay as they are.
    pub(crate) fn at(&self, uv: DVec2, reach: &Reach) -> FoundLobes {
        let mean = |map: &Filtered<'_>| map.mean(reach.places(uv), reach.lod);
        let direction = |map: &Filtered<'_>, texel: &[f64]| map.mean_vector(texel).try_normalize().unwrap_or(DVec3::Z);
        let of_normals = || self.normals.as_ref().map(|map| direction(map, &mean(map)));
        let (masking, facing) = (self.filter.masking(), self.facing);
        let Some(map) = &self.lobes else {
            let normal = of_normals().unwrap_or(DVec3::Z);
            let (normals, below) = (Vec::new(), Vec::new());
            return FoundLobes {
                normal,
                lobes: Mixture::Vmf(Vec::new()),
                normals,
                below,
                mass: None,
                own: Vec::new(),
                colours: Vec::new(),
                facing,
                masking,
            };
        };
        let texel = mean(map);
        let lobes = map.decode(&texel);
        if let Mixture::Slopes(_) = &lobes {
            let (normals, below) = (Vec::new(), Vec::new());
            let (own, colours) = (Vec::new(), Vec::new());
            return FoundLobes { normal: DVec3::Z, lobes, normals, below, mass: None, own, colours, facing, masking };
        }
        let by_cell = map.normals(&texel);
        let normal = match (of_normals(), by_cell.is_empty() || map.mass(&texel).is_some()) {
            (Some(normal), true) => normal,
            _ => direction(map, &texel),
        };
        let normals = (0..lobes.count()).map(|i| by_cell.get(i).and_then(|n| n.try_normalize()).unwrap_or(normal)).collect();
        let below = map.concentrations_below(&texel, lobes.count());
        let (mass, own, colours) = (map.mass(&texel), map.own_concentrations(&texel), map.colours(&texel));
        FoundLobes { normal, lobes, normals, below, mass, own, colours, facing, masking }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distribution::vmf;
    use crate::material::{Roughness, Sampling};
    use crate::reflectance::{BlinnPhong, MerlTable, Vmf};

    fn tilted(x: f32) -> [f32; 3] {
        [x, 0.0, (1.0 - x * x).sqrt()]
    }

    fn maps(normals: [f32; 2]) -> Maps {
        let normal = Texture::normals([2, 1], &normals.map(tilted)).unwrap();
        Maps { normal: Some(Arc::new(normal)), ..Maps::default() }
    }

    fn found(material: &Material, filter: Filter, footprint: [DVec2; 2]) -> FoundLobes {
        let moments = Moments::of(material, filter, Division::default(), Rule::Exact).unwrap();
        moments.at(DVec2::new(0.25, 0.5), &Reach::of(footprint, moments.size(), Sampling::default()))
    }

    #[test]
    fn normals_widen_a_lobe_by_their_spread() {
        let blinn_phong = Model::BlinnPhong(BlinnPhong { exponent: 98.0, specular: DVec3::ONE, albedo: DVec3::ZERO });
        let ggx = Model::Ggx(Ggx { alpha: 0.1, f0: DVec3::ONE, albedo: DVec3::ZERO });
        let one = Model::Vmf(Arc::new(Vmf::new(&[Lobe { mu: DVec3::Z, kappa: 200.0, weight: 0.4 }]).unwrap()));
        for (model, spread) in [(blinn_phong, 0.01), (ggx, vmf::spread(200.0)), (one, vmf::spread(200.0))] {
            let material = Material::new(model, maps([0.3, -0.3]));
            let near = found(&material, Filter::Vmf1, [DVec2::ZERO; 2]);
            let Mixture::Vmf(lobes) = &near.lobes else { panic!("{near:?}") };
            // Normals are stored in 16 bits.
            assert!((near.normal.x - 0.3).abs() < 1e-3 && (vmf::spread(lobes[0].kappa) / spread - 1.0).abs() < 1e-5, "{near:?}");
            let far = found(&material, Filter::Vmf1, [DVec2::X, DVec2::Y]);
            let Mixture::Vmf(lobes) = &far.lobes else { panic!("{far:?}") };
            let length = (1.0 - spread) * (1.0f64 - 0.09).sqrt();
            assert!((vmf::mean_cosine(lobes[0].kappa) / length - 1.0).abs() < 2e-3 && far.normal.z > 0.999_999, "{far:?}");
            assert!(far.normals == [far.normal] && lobes.len() == 1 && (lobes[0].weight - 1.0).abs() < 1e-12);
            // The two normals are in cells of their own.
            let apart = found(&material, Filter::Vmf4, [DVec2::X, DVec2::Y]);
            let Mixture::Vmf(lobes) = &apart.lobes else { panic!("{apart:?}") };
            assert!(lobes.len() == 2 && lobes.iter().all(|l| (vmf::spread(l.kappa) / spread - 1.0).abs() < 1e-5), "{apart:?}");
        }
    }

    #[test]
    fn tables_and_large_mixtures_keep_their_lobes() {
        let lobe = |x: f64| Lobe { mu: DVec3::new(x, 0.0, 1.0).normalize(), kappa: 40.0, weight: 0.2 };
        let mixture = Model::Vmf(Arc::new(Vmf::new(&[-0.4, -0.2, 0.0, 0.2, 0.4].map(lobe)).unwrap()));
        let table = Model::Table(Arc::new(MerlTable::from_fn(|_, _, _| DVec3::ONE)));
        for model in [mixture, table] {
            let material = Material::new(model.clone(), maps([0.5, -0.3]));
            let far = found(&material, Filter::Vmf8, [DVec2::X, DVec2::Y]);
            let mean = DVec2::new(0.2, 0.75f64.sqrt() + 0.91f64.sqrt()).normalize();
            assert!((far.normal.x - mean.x).abs() < 1e-3 && far.lobes.count() == 0, "{far:?}");
            let rough = Texture::scalar([1, 1], &[0.5]).unwrap();
            let rough = Maps { roughness: Some((Arc::new(rough), Roughness::Alpha)), ..Maps::default() };
            assert!(Moments::of(&Material::new(model, rough), Filter::Vmf1, Division::default(), Rule::Exact).is_none());
            assert!(Moments::of(&material, Filter::Tk, Division::default(), Rule::Exact).is_none());
        }
    }

    #[test]
    fn lobes_about_other_directions_have_a_mean_normal_beside_them() {
        let lobe = |x: f64| Lobe { mu: DVec3::new(x, 0.0, 1.0).normalize(), kappa: 40.0, weight: 0.5 };
        let cloth = Model::Vmf(Arc::new(Vmf::new(&[1.0, -1.0].map(lobe)).unwrap()));
        let material = Material::new(cloth, maps([0.2, 0.2]));
        for (filter, count) in
            [(Filter::Vmf1, 1), (Filter::Toksvig, 1), (Filter::ToksvigLobe, 2), (Filter::Vmf4, 2), (Filter::Vmf, 2)]
        {
            let far = found(&material, filter, [DVec2::X, DVec2::Y]);
            assert!(far.normals.len() == count && far.lobes.count() == count, "{far:?}");
            assert!(far.normals.iter().all(|n| (n.x - 0.2).abs() < 1e-3) && (far.facing - 0.5f64.sqrt()).abs() < 1e-12);
            assert!((far.normal.x - 0.2).abs() < 1e-3 && (far.lobes.weight() - 1.0).abs() < 1e-9, "{far:?}");
        }
    }
}
