//! At which level materials' maps are looked up.

use crate::Config;
use crate::material::{Material, Reach, Sampling};
use crate::moments::Base;
use crate::offline::error::Result;
use crate::offline::session::Session;
use glam::DVec2;

/// For each sample of the last frame, row by row, the level of mips at which the finest of its material's maps is looked up, 0 for its
/// texels: of colours, and with filters that read normals and roughness through mips also of these. 0 without such maps, and without a
/// surface. `reach_of` of `glsl/include/look_up.glsl` is the same on the device.
///
/// # Errors
/// The device's, on read-back.
pub fn mips(session: &mut Session, config: &Config) -> Result<Vec<f32>> {
    let (ids, ..) = session.image("ids")?;
    let (derivatives, ..) = session.image("derivative")?;
    let ids: Vec<u32> = bytemuck::pod_collect_to_vec(&ids);
    let derivatives: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&derivatives);
    let sampling = Sampling { anisotropy: config.anisotropy, lod_bias: config.lod_bias.into() };
    let maps: Vec<_> = session.materials.iter().map(|material| (material.maps.tiling, sizes(material, config))).collect();
    let level = |(id, derivative): (&u32, &[f32; 4])| {
        let Some((tiling, sizes)) = id.checked_sub(1).and_then(|id| maps.get(id as usize & 0xffff)) else { return 0.0 };
        let tiling = DVec2::from(tiling.map(f64::from));
        let [ux, vx, uy, vy] = derivative.map(f64::from);
        let footprint = [DVec2::new(ux, vx) * tiling, DVec2::new(uy, vy) * tiling];
        sizes.iter().map(|size| Reach::of(footprint, *size, sampling).lod).fold(0.0, f64::max) as f32
    };
    Ok(ids.iter().zip(&derivatives).map(level).collect())
}

/// Sizes of the maps of a material that are read through mips.
fn sizes(material: &Material, config: &Config) -> Vec<[u32; 2]> {
    let [albedo, specular, ..] = material.maps.textures();
    let base = if config.filter.stores() { Base::of(material, config.effective_rule()) } else { None };
    let moments = base.map(|base| base.size(material));
    [albedo, specular].into_iter().flatten().map(|map| map.size()).chain(moments).collect()
}
