//! What filters keep of materials beside averages, made on the host once a set of materials: the table of clusters, and the texels of
//! peaks and of Gaussians.

use crate::distribution::effective::Rule;
use crate::distribution::expectation::GAUSSIANS;
use crate::distribution::filtered::Area;
use crate::distribution::gaussians::{MOMENTS, Start};
use crate::distribution::peaks::Peaks;
use crate::distribution::{BrdfMap, Clusters, Filter, Gaussians};
use crate::gpu::image::ImageDesc;
use crate::material::Material;
use crate::moments::{self, Base, Parameter};
use crate::pass::brdf_map::{Group, Layers, Source};
use crate::pass::cluster_moments::Record;
use bytemuck::Zeroable;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// The clusters of all materials.
pub(crate) struct Table {
    pub records: Vec<Record>,
    /// Of each material.
    pub of: Vec<Own>,
}

/// The clusters of a material.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Own {
    pub first: u32,
    pub count: u32,
    /// Whether texels keep colours by them.
    pub coloured: bool,
}

impl Table {
    /// Of `materials`, of which `bases` say what is filtered. Materials of the same maps and lobes have the same clusters.
    pub fn of(materials: &[Material], bases: &[Option<Base>], filter: Filter) -> Self {
        let mut table = Self { records: Vec::new(), of: Vec::new() };
        for (i, (material, base)) in materials.iter().zip(bases).enumerate() {
            let colours = |m: &Material| m.maps.specular.as_ref().map(Arc::as_ptr);
            let same = |m: &Material| same_maps(m, material) && colours(m) == colours(material);
            let known = (0..i).find(|k| bases.get(*k) == Some(base) && same(&materials[*k]));
            // Without colours all of the same maps share what they keep.
            let alike = |k: &usize| bases.get(*k) == Some(base) && same_maps(&materials[*k], material);
            let shared = (0..i).filter(alike).filter_map(|k| table.of.get(k)).find(|own| !own.coloured && own.count > 0).copied();
            let own = match known.and_then(|k| table.of.get(k)) {
                Some(own) => *own,
                None => {
                    let own = base.as_ref().and_then(|base| moments::clusters(material, base, filter));
                    match (own, shared) {
                        (Some(clusters), Some(shared)) if !clusters.layout().colours => shared,
                        (Some(clusters), _) => table.push(&clusters),
                        (None, _) => Own::default(),
                    }
                }
            };
            table.of.push(own);
        }
        if table.records.is_empty() {
            // Something to bind.
            table.records.push(Record::zeroed());
        }
        table
    }

    fn push(&mut self, clusters: &Clusters) -> Own {
        let first = self.records.len() as u32;
        self.records.extend(clusters.all().iter().map(Record::from));
        Own { first, count: clusters.all().len() as u32, coloured: clusters.layout().colours }
    }

    /// The most that a material has, at least 1.
    pub fn most(&self) -> u32 {
        self.of.iter().map(|own| own.count).fold(1, u32::max)
    }

    /// Whether a material's keep colours.
    pub fn coloured(&self) -> bool {
        self.of.iter().any(|own| own.coloured)
    }
}

fn same_maps(a: &Material, b: &Material) -> bool {
    let key = |m: &Material| {
        (m.maps.normal.as_ref().map(Arc::as_ptr), m.maps.roughness.as_ref().map(|(map, kind)| (Arc::as_ptr(map), *kind)))
    };
    key(a) == key(b) && Parameter::of(&a.model) == Parameter::of(&b.model)
}

/// The texels of the layers of `desc`, level by level, zero but for what `fill` writes: from the level, the texels of one of its layers,
/// and those of all of them.
fn by_level(desc: &ImageDesc, mut fill: impl FnMut(usize, usize, &mut [[f32; 4]])) -> Vec<u8> {
    let mut texels: Vec<[f32; 4]> = Vec::new();
    for level in 0..desc.levels {
        let [width, height, _] = desc.level_extent(level);
        let area = width as usize * height as usize;
        let start = texels.len();
        texels.resize(start + area * desc.layers.unwrap_or(1) as usize, [0.0; 4]);
        fill(level as usize, area, &mut texels[start..]);
    }
    bytemuck::cast_slice(&texels).to_vec()
}

/// The texels of an image of peaks, level by level, in layers as many as are in `desc`: of the `sources`, materials with the first of
/// their layers, `count` peaks each and, where lobes are not about them, as many normals, over maps of `size`.
pub(crate) fn peaks(desc: &ImageDesc, size: [u32; 2], count: usize, sources: &[(&Material, usize)]) -> Vec<u8> {
    let of = |(material, first): &(&Material, usize)| {
        let map = BrdfMap::of(material, size, Rule::Exact).ok()?;
        let normals = map.normal(0).is_some();
        Some((Peaks::of(&map, count, Parameter::of(&material.model).area()), *first, normals))
    };
    let all: Vec<_> = sources.iter().filter_map(of).collect();
    by_level(desc, |level, area, layers| {
        for (peaks, first, normals) in &all {
            for (i, peak) in peaks.level(level + 1).iter().enumerate() {
                let (at, below, lobe) = (octahedron(peak.lobe.mu), octahedron(peak.normal), &peak.lobe);
                let texel = |layer: usize| (first + layer) * area + i / count;
                if let Some(texel) = layers.get_mut(texel(i % count)) {
                    *texel = [at.x, at.y, lobe.kappa, lobe.weight].map(|v| v as f32);
                }
                if let Some(texel) = layers.get_mut(texel(count + i % count)).filter(|_| *normals) {
                    *texel = [below.x, below.y, 0.0, 0.0].map(|v| v as f32);
                }
            }
        }
    })
}

/// The mixtures of a material.
pub(crate) enum Mixtures {
    /// With the map that they are of.
    Known { all: Arc<Gaussians>, map: BrdfMap, area: Area },
    /// Fitted by the device.
    Fitted(Start),
}

impl Mixtures {
    /// Of each of `materials`, of which `bases` say what is filtered, over maps of the sizes in `places`, which the device fits or not:
    /// none where the filter has none. Materials of the same maps and lobes have the same mixtures.
    pub fn of(
        materials: &[Material],
        bases: &[Option<Base>],
        places: &[Option<([u32; 2], bool)>],
        filter: Filter,
    ) -> Vec<Option<Self>> {
        let mut found: Vec<Option<Self>> = Vec::new();
        for (i, ((material, base), place)) in materials.iter().zip(bases).zip(places).enumerate() {
            let same =
                |k: &usize| bases.get(*k) == Some(base) && places.get(*k) == Some(place) && same_maps(&materials[*k], material);
            let known = (0..i).find(same).and_then(|k| found.get(k)?.as_ref());
            let own = |base: &Base, (size, on_device): ([u32; 2], bool)| {
                let area = Parameter::of(&material.model).area();
                let map = || BrdfMap::of(material, size, Rule::Exact).ok();
                if filter.gaussians().is_none() || base.lobes().is_empty() {
                    return None;
                }
                Some(match known {
                    Some(Self::Fitted(start)) => Self::Fitted(*start),
                    Some(Self::Known { all, .. }) => Self::Known { all: all.clone(), map: map()?, area },
                    None if on_device => Self::Fitted(Start::of(&map()?, area)),
                    None => Self::Known { all: moments::gaussians(material, base, size, filter)?, map: map()?, area },
                })
            };
            found.push(base.as_ref().zip(*place).and_then(|(base, place)| own(base, place)));
        }
        found
    }

    /// Of sources that are fitted, as their first layers of mixtures and these have it, from what.
    pub fn starts(group: &Group, here: &[(&Self, usize)]) -> Vec<Option<Start>> {
        let of = |(_, first): &(Source, Layers)| {
            let (mixtures, _) = here.iter().find(|(_, cells)| *cells == first.cells)?;
            if let Self::Fitted(start) = mixtures { Some(*start) } else { None }
        };
        group.sources.iter().map(of).collect()
    }

    /// What look-ups share, as `MapRecord::clusters` has it.
    pub fn shared(&self) -> [u32; 4] {
        let frame = match self {
            Self::Known { all, .. } => all.frame(),
            Self::Fitted(start) => &start.frame,
        };
        [frame.middle.x, frame.middle.y, frame.floor, frame.own].map(|v| (v as f32).to_bits())
    }
}

/// The texels of an image of Gaussians, level by level, in layers as many as are in `desc`: of the `sources`, mixtures with the first of
/// their layers, a layer for each Gaussian and, where lobes are not about their normals, as many for these.
pub(crate) fn gaussians(desc: &ImageDesc, sources: &[(&Mixtures, usize)]) -> Vec<u8> {
    by_level(desc, |level, area, layers| {
        for (mixtures, first) in sources {
            let Mixtures::Known { all, map, area: cosine } = mixtures else { continue };
            let normals = map.normal(0).is_some();
            for i in 0..area {
                let Some(texel) = all.texel(map, *cosine, level, i) else { continue };
                for (k, moments) in texel.as_chunks::<MOMENTS>().0.iter().enumerate() {
                    let [q, x, y, square, nx, ny] = moments.map(|v| v as f32);
                    if let Some(texel) = layers.get_mut((first + k) * area + i) {
                        *texel = [q, x, y, square];
                    }
                    if let Some(texel) = layers.get_mut((first + GAUSSIANS + k) * area + i).filter(|_| normals) {
                        *texel = [nx, ny, 0.0, 0.0];
                    }
                }
            }
        }
    })
}

/// Twin of `oct_encode` in `glsl/include/oct.glsl`.
fn octahedron(v: DVec3) -> DVec2 {
    let at = v.truncate() / (v.x.abs() + v.y.abs() + v.z.abs());
    let sign = |c: f64| if c >= 0.0 { 1.0 } else { -1.0 };
    if v.z < 0.0 { DVec2::new((1.0 - at.y.abs()) * sign(at.x), (1.0 - at.x.abs()) * sign(at.y)) } else { at }
}
