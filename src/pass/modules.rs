//! The compiled modules of `spirv/`, embedded.

macro_rules! modules {
    ($($name:literal),* $(,)?) => {
        /// Names of all embedded modules, as in `spirv/NAME.spv`.
        pub const NAMES: &[&str] = &[$($name),*];

        /// The bytes of module `name`.
        pub(crate) fn spirv(name: &str) -> Option<&'static [u8]> {
            match name {
                $($name => Some(include_bytes!(concat!("../../spirv/", $name, ".spv"))),)*
                _ => None,
            }
        }
    };
}

modules! {
    "gbuffer.plain.vert",
    "gbuffer.plain.frag",
    "gbuffer.coordinates.vert",
    "gbuffer.coordinates.frag",
    "texture_space.vert",
    "texture_space.frag",
    "brdf_map.comp",
    "vmf_mips.cells.comp",
    "vmf_mips.comp",
    "cluster_moments.comp",
    "cluster_moments.levels.comp",
    "mixtures_lobes.comp",
    "mixtures_fit.comp",
    "mixtures_labels.comp",
    "filter.comp",
    "curvature.comp",
    "bandwidth.blocks.comp",
    "bandwidth.comp",
    "pyramid.comp",
    "shading_rate.comp",
    "classify.comp",
    "classify.levels.comp",
    "residual_level.comp",
    "base.comp",
    "allocate_count.comp",
    "allocate_share.comp",
    "allocate_sort.comp",
    "shade.comp",
    "upsample.comp",
    "resolve.comp",
    "environment_bandwidth_luminance.comp",
    "environment_bandwidth_level.comp",
    "environment_bandwidth_spread.comp",
    "environment_bandwidth_texel.comp",
    "luminance_tiles.comp",
    "luminance_mean.comp",
    "luminance_levels.comp",
    "prefilter_map.comp",
    "prefilter_rings.comp",
    "prefilter_convolve.comp",
    "tonemap.rgba8.comp",
    "tonemap.rgba16f.comp",
    "tonemap.rgba32f.comp",
}
