//! What the `filter` pass knows of a material's maps.

use crate::distribution::MOST_BASE_LOBES;
use crate::material::{Material, Roughness};
use crate::moments::{Base, Parameter};
use crate::pass::brdf_map;
use crate::reflectance::Model;
use bytemuck::{Pod, Zeroable};

/// Mirrors `MapRecord` in `glsl/filter.comp`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Record {
    places: [u32; 4],
    tiling: [f32; 2],
    rule: [f32; 2],
    without: f32,
    moments: u32,
    cells: u32,
    lobes: u32,
    weights: [f32; MOST_BASE_LOBES],
    count: u32,
    upright: u32,
    concentration: f32,
    facing: f32,
    clusters: [u32; 4],
}

/// How the shader turns a roughness map's value into alpha, and the greatest alpha that comes of it.
pub(super) fn rule(material: &Material) -> [f32; 2] {
    let Some((_, kind)) = &material.maps.roughness else {
        return [0.0, if matches!(material.model, Model::Vmf(_)) { MOST_ALPHA } else { 1.0 }];
    };
    match (&material.model, kind) {
        (Model::Vmf(_), Roughness::Alpha) => [0.0, MOST_ALPHA],
        (Model::Vmf(_), Roughness::Kappa) => [1.0, MOST_ALPHA],
        (_, Roughness::Alpha) => [0.0, 1.0],
        (Model::BlinnPhong(_), Roughness::Kappa) => [2.0, 1.0],
        (_, Roughness::Kappa) => [1.0, 1.0],
    }
}

/// Of a lobe without concentration, in 16-bit floating point.
const MOST_ALPHA: f32 = 6e4;

impl Record {
    /// Of a material whose `lobes` are filtered, its clusters or what its Gaussians share, and the codes of its maps, its moments and its
    /// cells.
    pub fn of(
        material: &Material,
        lobes: &Base,
        clusters: [u32; 4],
        [albedo, specular, normal, roughness, moments, cells]: [u32; 6],
    ) -> Self {
        let own = lobes.lobes();
        Self {
            places: [albedo, specular, normal, roughness],
            tiling: material.maps.tiling,
            rule: rule(material),
            without: if matches!(material.model, Model::Vmf(_)) { 0.0 } else { 1.0 },
            moments,
            cells,
            lobes: brdf_map::lobes(!own.is_empty(), Parameter::of(&material.model)),
            weights: brdf_map::weights(own),
            count: own.len() as u32,
            upright: u32::from(lobes.upright()),
            concentration: own.first().map_or(0.0, |lobe| lobe.kappa as f32),
            facing: lobes.facing() as f32,
            clusters,
        }
    }
}
