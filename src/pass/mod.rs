//! The frame's passes, one file each, all of one shape: name, push constants, `Io` (all that it reads and writes), the
//! pass, `new`, `record`.

pub mod allocate;
pub mod bandwidth;
pub mod base;
pub mod brdf_map;
pub mod classify;
pub mod cluster_moments;
pub mod curvature;
pub mod environment;
pub mod environment_bandwidth;
pub mod filter;
pub(crate) mod fits;
pub mod gbuffer;
pub(crate) mod groups;
pub(crate) mod kept;
pub(crate) mod level;
pub mod luminance;
pub(crate) mod map_record;
pub(crate) mod maps;
pub mod materials;
pub mod mixtures;
pub mod modules;
pub(crate) mod object_cells;
pub mod prefilter;
#[cfg(feature = "offline")]
pub(crate) mod probe;
pub mod pyramid;
pub mod residual_level;
pub mod resolve;
pub mod shade;
pub mod shading_rate;
pub(crate) mod suns;
pub(crate) mod surfaces;
pub mod texture_space;
pub mod tonemap;
pub mod upsample;
pub mod vmf_mips;

use crate::gpu::pipeline::{BridgeLayouts, Interface, Modules};
use crate::gpu::retire::Build;
use bytemuck::{Pod, Zeroable};

/// What every pass knows of the frame (`glsl/include/frame.glsl`, std140).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct FrameUniform {
    pub world_from_view: [[f32; 4]; 3],
    pub eye: [f32; 4],
    pub ray: [f32; 4],
    pub extent: [u32; 4],
    pub sampling: [u32; 4],
    pub environment: [f32; 4],
    pub lights: [u32; 4],
    pub levels: [[i32; 4]; 6],
}

/// What passes are built from.
pub(crate) struct PassContext<'a, 'b> {
    pub build: &'a mut Build<'b>,
    pub modules: &'a Modules,
    pub bridge: BridgeLayouts,
    pub slots: usize,
}

/// The shader interfaces of all compute modules, for tests and host profilers.
pub fn interfaces() -> Vec<Interface> {
    let mut all = vec![filter::INTERFACE, curvature::INTERFACE, bandwidth::BLOCKS, bandwidth::INTERFACE, pyramid::INTERFACE];
    all.extend(classify::INTERFACES);
    all.extend(allocate::INTERFACES);
    all.extend([residual_level::INTERFACE, base::INTERFACE, shade::INTERFACE, upsample::INTERFACE, resolve::INTERFACE]);
    all.push(shading_rate::INTERFACE);
    all.extend(tonemap::INTERFACES);
    all.extend(environment_bandwidth::INTERFACES);
    all.extend(luminance::INTERFACES);
    all.extend(prefilter::INTERFACES);
    all.extend([brdf_map::INTERFACE, vmf_mips::CELLS, vmf_mips::INTERFACE]);
    all.extend([cluster_moments::INTERFACE, cluster_moments::LEVELS]);
    all.extend(mixtures::INTERFACES);
    all
}
