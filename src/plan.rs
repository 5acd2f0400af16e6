//! The frame's arithmetic: extents, image descriptions, memory footprint. No GPU.

use crate::config::{Config, GBufferSource, MAX_LEVEL, Rate};
use crate::frequency::allocation::{Allocation, BINS};
use crate::gpu::image::ImageDesc;
use crate::light::{LightRecord, MAX_LIGHTS};
use crate::pass::{bandwidth, luminance, shading_rate};
use ash::vk;

/// Sizes that follow from a [`Config`].
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// Shading samples.
    pub shading: [u32; 2],
    /// The renderer's own G-buffer: surface, ids, coordinate, derivative, depth.
    pub gbuffer: Option<[ImageDesc; 5]>,
    pub normals: ImageDesc,
    pub factors: ImageDesc,
    /// Layers for the lobes that the filter finds; one texel where it finds none.
    pub lobes: ImageDesc,
    /// A texel in the place of the host's masks, where it gives none.
    pub unshadowed: ImageDesc,
    pub curvature: Option<ImageDesc>,
    pub levels: Levels,
    /// The level of each sample, where the renderer itself writes it.
    pub level: Option<ImageDesc>,
    /// What the `bandwidth` pass finds in each block of samples.
    pub prediction: Option<ImageDesc>,
    /// Whether each sample of the list gets a number of directions of its own.
    pub allocated: bool,
    /// Bytes of the shading-rate attachment's texels.
    pub rate_bytes: Option<u64>,
    /// Linear radiance: of samples, and below them of cells of even levels.
    pub radiance: ImageDesc,
    /// Linear radiance that is looked up, where `radiance` is what is left.
    pub base: Option<ImageDesc>,
    /// Linear radiance of cells of odd levels, one level below another.
    pub odd: Option<ImageDesc>,
    pub resolved: ImageDesc,
}

/// One row of the memory footprint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FootprintRow {
    /// Image or buffer.
    pub name: &'static str,
    /// Bytes without the driver's padding.
    pub bytes: u64,
}

/// Device memory that a renderer takes at creation, before environments and materials.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Footprint {
    /// Every resource.
    pub rows: Vec<FootprintRow>,
}

impl Footprint {
    /// Sum over the rows in bytes.
    pub fn total(&self) -> u64 {
        self.rows.iter().map(|r| r.bytes).sum()
    }
}

/// Levels of shading over the samples, level 0 (`glsl/include/levels.glsl`): a cell of level l is 2^l x 2^l samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Levels {
    /// Coarsest level, at most [`MAX_LEVEL`].
    pub top: u32,
    /// Cells across and down of levels 0 to `top`.
    pub extents: Vec<[u32; 2]>,
}

impl Levels {
    fn of(config: &Config, shading: [u32; 2]) -> Self {
        let top = config.coarsest();
        Self { top, extents: (0..=top).map(|l| shading.map(|e| e.div_ceil(1 << l))).collect() }
    }

    /// Cells of all levels above 0 and below `level`.
    pub fn cells_below(&self, level: u32) -> u64 {
        self.extents.iter().take(level as usize).skip(1).map(|[w, h]| u64::from(*w) * u64::from(*h)).sum()
    }

    /// Cells of all levels above 0.
    pub fn cells(&self) -> u64 {
        self.cells_below(self.top + 1)
    }

    /// Rows of values of the levels below `level` in the same image: even levels share one, odd ones the other.
    fn rows_below(&self, level: u32) -> u32 {
        let rows = (0u32..).zip(&self.extents);
        rows.filter(|(l, _)| *l < level && l % 2 == level % 2).map(|(_, [_, h])| h).sum()
    }

    /// Of each level: cells across and down, its first cell, its first row of values.
    pub fn uniform(&self) -> [[i32; 4]; MAX_LEVEL as usize + 1] {
        let mut all = [[0; 4]; MAX_LEVEL as usize + 1];
        for ((l, [w, h]), level) in (0u32..).zip(&self.extents).zip(&mut all) {
            *level = [*w as i32, *h as i32, self.cells_below(l) as i32, self.rows_below(l) as i32];
        }
        all
    }
}

/// Bytes of a cell of a level above 0: its word and its depth.
pub(crate) const CELL_BYTES: u64 = 8;
/// Bytes of a block: its cell and what its children are.
pub(crate) const BLOCK_BYTES: u64 = 8;
/// Bytes of a block's weights.
pub(crate) const WEIGHT_BYTES: u64 = 16;
/// Bytes of the arguments of the dispatches over all blocks and over those of each level.
pub(crate) const BLOCK_ARGUMENT_BYTES: u64 = (MAX_LEVEL as u64 + 1) * ARGUMENT_BYTES;

/// Bytes of the arguments of the indirect dispatch: groups in x, y, z and the number of listed samples.
pub(crate) const ARGUMENT_BYTES: u64 = 16;

/// Bytes of one slot's lights.
pub(crate) const LIGHT_BYTES: u64 = (MAX_LIGHTS * size_of::<LightRecord>()) as u64;

impl Plan {
    pub fn of(config: &Config) -> Self {
        let shading = config.extent.map(|e| e.saturating_mul(config.samples_per_side));
        let image = |name, format, [w, h]: [u32; 2], usage| ImageDesc::new(name, format, [w, h, 1], usage);
        let sampled = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC;
        let target = sampled | vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let cleared = target | vk::ImageUsageFlags::TRANSFER_DST;
        let storage = sampled | vk::ImageUsageFlags::STORAGE;
        let levels = Levels::of(config, shading);
        // Above the coarsest level, so that all of them are below.
        let (even_rows, odd_rows) = (levels.rows_below(MAX_LEVEL + 1), levels.rows_below(MAX_LEVEL + 2));
        let values = |name, width, rows| image(name, vk::Format::R32G32B32A32_SFLOAT, [width, rows], storage);
        let own = matches!(config.gbuffer, GBufferSource::Draws);
        Self {
            shading,
            gbuffer: own.then(|| {
                [
                    image("surface", vk::Format::R32G32B32A32_SFLOAT, shading, target),
                    image("ids", vk::Format::R32_UINT, shading, target),
                    image("coordinate", vk::Format::R32G32B32A32_SFLOAT, shading, cleared),
                    image("derivative", vk::Format::R32G32B32A32_SFLOAT, shading, cleared),
                    image("depth", vk::Format::D32_SFLOAT, shading, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
                ]
            }),
            normals: image("normals", vk::Format::R32G32B32A32_SFLOAT, shading, storage),
            factors: image("factors", vk::Format::R32G32B32A32_UINT, shading, storage),
            lobes: {
                let layers = config.filter.lobe_layers();
                let extent = if layers > 0 { shading } else { [1, 1] };
                ImageDesc { layers: Some(layers.max(1)), ..image("lobes", vk::Format::R32G32B32A32_UINT, extent, storage) }
            },
            unshadowed: ImageDesc { layers: Some(1), ..image("unshadowed", vk::Format::R8_UNORM, [1, 1], sampled) },
            curvature: config.curvature.then(|| image("curvature", vk::Format::R16G16B16A16_SFLOAT, shading, storage)),
            level: (levels.top > 0 && config.rate != Rate::Given)
                .then(|| image("level", vk::Format::R32_UINT, shading, storage | vk::ImageUsageFlags::TRANSFER_DST)),
            prediction: config.predicts().then(|| {
                let blocks = shading.map(|e| e.div_ceil(config.block_side()));
                image("prediction", vk::Format::R16G16B16A16_SFLOAT, blocks, storage | vk::ImageUsageFlags::TRANSFER_DST)
            }),
            allocated: config.allocation != Allocation::Constant,
            rate_bytes: config.shading_rate.map(|rate| shading_rate::bytes(rate, config.extent)),
            radiance: values("radiance", shading[0], even_rows),
            base: config.estimator.has_residual().then(|| values("base", shading[0], shading[1])),
            odd: (levels.top > 0).then(|| values("odd", shading[0].div_ceil(2), odd_rows)),
            levels,
            resolved: image("resolved", vk::Format::R32G32B32A32_SFLOAT, config.extent, storage),
        }
    }

    fn images(&self) -> impl Iterator<Item = &ImageDesc> {
        let values = self.level.iter().chain(&self.prediction).chain(&self.odd).chain(&self.base).chain([
            &self.normals,
            &self.factors,
            &self.lobes,
            &self.unshadowed,
            &self.radiance,
            &self.resolved,
        ]);
        self.gbuffer.iter().flatten().chain(&self.curvature).chain(values)
    }

    /// Name and bytes of the buffers over cells, none where every sample is shaded.
    pub fn cell_buffers(&self) -> [(&'static str, u64); 4] {
        let cells = self.levels.cells();
        let arguments = if cells > 0 { BLOCK_ARGUMENT_BYTES } else { 0 };
        let [cell, block, weight] = [CELL_BYTES, BLOCK_BYTES, WEIGHT_BYTES].map(|bytes| bytes * cells);
        [("cells", cell), ("blocks", block), ("weights", weight), ("block arguments", arguments)]
    }

    /// Name and bytes of the buffers of [`Rate::Luminance`].
    pub fn luminance_buffers(&self, config: &Config) -> Option<[(&'static str, u64); 2]> {
        let tiles: u64 = luminance::tiles(config.extent).into_iter().map(u64::from).product();
        let used = config.rate == Rate::Luminance && self.levels.top > 0;
        used.then_some([("tiles", luminance::TILE_BYTES * tiles), ("mean luminance", luminance::MEAN_BYTES)])
    }

    /// The largest storage buffer.
    pub fn largest_buffer(&self) -> u64 {
        let all = self.cell_buffers().into_iter().chain(self.allocation_buffers());
        all.map(|(_, bytes)| bytes).fold(self.list_bytes(), u64::max)
    }

    /// Name and bytes of the buffers that share directions out, none where all samples get the same.
    pub fn allocation_buffers(&self) -> [(&'static str, u64); 4] {
        let bins = if self.allocated { BINS as u64 } else { 0 };
        let list = if self.allocated { 2 * self.list_bytes() } else { 0 };
        [("histogram", 4 * bins), ("shares", 8 * bins), ("cursors", 4 * bins), ("allocated", list)]
    }

    /// Bytes of the list of samples to shade.
    pub fn list_bytes(&self) -> u64 {
        4 * u64::from(self.shading[0]) * u64::from(self.shading[1])
    }
}

/// How the directions of a shaded sample are shared out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Directions {
    /// From the reflectance.
    pub brdf: u32,
    /// From the environment.
    pub environment: u32,
    /// From each area light.
    pub light: u32,
}

impl Directions {
    /// As [`Self::split`], of the number of a sample that stands for a pixel or more.
    pub fn of(config: &Config, environment: bool, area_lights: u32) -> Self {
        let n = if config.estimator == crate::Estimator::Preconvolved { 0 } else { config.directions_a_pixel() };
        Self::split(config, n, environment, area_lights)
    }

    /// [`Config::reflectance_share`] of `n` from the reflectance; the others in equal parts from the environment, if it shines, and each of
    /// `area_lights`, at least one each. Twin of `split` in `glsl/shade.comp`.
    pub fn split(config: &Config, n: u32, environment: bool, area_lights: u32) -> Self {
        let sources = u32::from(environment) + area_lights;
        if !config.estimator.combines() || sources == 0 {
            return Self { brdf: n, environment: 0, light: 0 };
        }
        let other = ((n as f32 * (1.0 - config.reflectance_share)) as u32).min(n.saturating_sub(1));
        let light = if area_lights > 0 { (other / sources).max(1) } else { 0 };
        let rest = other.saturating_sub(light * area_lights).max(1);
        Self { brdf: n - other, environment: if environment { rest } else { 0 }, light }
    }

    /// Of a sample that stands for a cell of `level`, in levels over a sample (twin of `share` in `glsl/shade.comp`).
    #[cfg(any(test, feature = "offline"))]
    pub fn at(self, level: u32, config: &Config) -> Self {
        let share = |n: u32| (n >> (2 * config.sharing_levels().saturating_sub(level))).max(n.min(1));
        Self { brdf: share(self.brdf), environment: share(self.environment), light: share(self.light) }
    }

    /// All directions of a sample.
    #[cfg(any(test, feature = "offline"))]
    pub fn total(self, area_lights: u32) -> u32 {
        self.brdf + self.environment + self.light * area_lights
    }
}

/// What a renderer of `config` will allocate at creation: pure arithmetic.
pub fn memory_footprint(config: &Config) -> Footprint {
    let plan = Plan::of(config);
    let mut rows: Vec<_> = plan.images().map(|d| FootprintRow { name: d.name, bytes: d.bytes() }).collect();
    rows.push(FootprintRow { name: "list", bytes: plan.list_bytes() });
    let buffers = plan.cell_buffers().into_iter().chain(plan.allocation_buffers());
    rows.extend(buffers.filter(|b| b.1 > 0).map(|(name, bytes)| FootprintRow { name, bytes }));
    rows.extend(plan.luminance_buffers(config).into_iter().flatten().map(|(name, bytes)| FootprintRow { name, bytes }));
    rows.extend(plan.rate_bytes.map(|bytes| FootprintRow { name: "rates", bytes }));
    if let Some(blocks) = plan.prediction {
        let [width, height, _] = blocks.extent;
        rows.push(FootprintRow { name: "forecast", bytes: bandwidth::FORECAST_BYTES });
        rows.push(FootprintRow { name: "predicted", bytes: bandwidth::list_bytes([width, height]) });
    }
    rows.push(FootprintRow { name: "arguments", bytes: ARGUMENT_BYTES });
    rows.push(FootprintRow {
        name: "frame",
        bytes: config.frames_in_flight as u64 * size_of::<crate::pass::FrameUniform>() as u64,
    });
    rows.push(FootprintRow { name: "lights", bytes: config.frames_in_flight as u64 * LIGHT_BYTES });
    if plan.gbuffer.is_some() {
        rows.push(FootprintRow { name: "no tangent", bytes: crate::pass::gbuffer::NO_TANGENT.len() as u64 });
    }
    Footprint { rows }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn footprint_grows_with_samples_and_extent() {
        let base = Config::new([640, 360]);
        let pixels = 640 * 360;
        let list = |f: &Footprint| f.rows.iter().find(|r| r.name == "list").map(|r| r.bytes);
        assert_eq!(list(&memory_footprint(&base)), Some(4 * pixels));
        let fine = Config { samples_per_side: 4, ..base.clone() };
        assert_eq!(list(&memory_footprint(&fine)), Some(16 * 4 * pixels));
        // surface, coordinate, derivative, normals, factors, radiance 16 bytes; ids, depth, list 4; resolved 16; a texel of lobes, one of no masks
        assert_eq!(memory_footprint(&base).total(), pixels * (6 * 16 + 3 * 4 + 16) + 16 + 1 + 16 + 16 + 2 * (240 + 256 * 64));
    }

    #[test]
    fn levels_halve_and_find_their_places() {
        let config = Config { rate: Rate::Given, ..Config::new([13, 7]) };
        let plan = Plan::of(&config);
        assert_eq!(plan.levels.extents, [[13, 7], [7, 4], [4, 2], [2, 1]]);
        let uniform = plan.levels.uniform();
        assert_eq!(uniform[..4], [[13, 7, 0, 0], [7, 4, 0, 0], [4, 2, 28, 7], [2, 1, 36, 4]]);
        assert_eq!((plan.radiance.extent, plan.odd.map(|i| i.extent)), ([13, 9, 1], Some([7, 5, 1])));
        assert_eq!(plan.level, None, "the host's");
        let cells = 28 + 8 + 2;
        assert_eq!(plan.cell_buffers().map(|b| b.1), [8 * cells, 8 * cells, 16 * cells, 96]);
        // Coarser than any device's tile never; nothing at all at the full rate.
        for (rate, lmax, side, top) in [(Rate::Given, 5, 4, 5), (Rate::Uniform(u32::MAX), 0, 2, 5), (Rate::Uniform(0), 3, 4, 2)] {
            let config = Config { rate, lmax, samples_per_side: side, ..config.clone() };
            assert_eq!(Plan::of(&config).levels.top, top);
        }
        let full = Plan::of(&Config::new([13, 7]));
        assert_eq!((full.radiance.extent, full.odd, full.level, full.levels.cells()), ([13, 7, 1], None, None, 0));
        assert_eq!(full.largest_buffer(), full.list_bytes());
    }

    #[test]
    fn directions_are_shared_out() {
        for n in [2, 3, 64, 65] {
            let config = Config { directions: n, ..Config::new([1, 1]) };
            let d = Directions::of(&config, true, 0);
            assert_eq!((d.total(0), d.light), (n, 0));
            assert!(d.brdf - d.environment <= 1);
            assert_eq!(Directions::of(&config, false, 0), Directions { brdf: n, environment: 0, light: 0 });
        }
        let config = Config::new([1, 1]);
        let d = Directions::of(&config, true, 3);
        assert_eq!((d.brdf, d.environment, d.light, d.total(3)), (32, 8, 8, 64));
        let d = Directions::of(&config, true, 100);
        assert_eq!((d.environment, d.light), (1, 1));
        let brdf = Config { estimator: crate::Estimator::Brdf, ..config };
        assert_eq!(Directions::of(&brdf, true, 3), Directions { brdf: 64, environment: 0, light: 0 });
    }

    #[test]
    fn finer_levels_share_a_pixels_directions() {
        let adaptive = |side| Config { rate: Rate::Bandwidth, samples_per_side: side, ..Config::new([1, 1]) };
        for (side, totals) in [(1, [64, 64, 64]), (2, [32, 128, 128]), (4, [16, 64, 256])] {
            let config = adaptive(side);
            let d = Directions::of(&config, true, 0);
            assert_eq!([0, 1, 2].map(|level| d.at(level, &config).total(0)), totals);
            assert_eq!(d.at(5, &config), d);
            let full = Config { rate: Rate::Full, ..config };
            let d = Directions::of(&full, true, 0);
            assert_eq!((d.total(0), d.at(0, &full)), (64, d));
        }
        let few = Config { directions: 2, ..adaptive(4) };
        assert_eq!(Directions::of(&few, true, 1).at(0, &few), Directions { brdf: 1, environment: 1, light: 1 });
        assert_eq!(Directions::of(&few, false, 0).at(0, &few).environment, 0, "without light nothing is drawn from it");
    }

    #[test]
    fn impossible_settings_name_the_field() {
        let base = Config::new([0, 4]);
        assert!(base.validate().unwrap_err().to_string().contains("Config::extent"));
        let base = Config { directions: 1, ..Config::new([4, 4]) };
        assert!(base.validate().unwrap_err().to_string().contains("Config::directions"));
        assert!(Config { samples_per_side: 3, ..Config::new([4, 4]) }.validate().is_err());
        let weighed = Config { allocation: Allocation::Deviation, ..Config::new([4, 4]) };
        for rate in [Rate::Full, Rate::Uniform(1), Rate::Given] {
            let said = Config { rate, ..weighed.clone() }.validate().unwrap_err().to_string();
            assert!(
                ["Config::allocation", "constant, unless", "sqrt at the rate"].iter().all(|part| said.contains(part)),
                "{said}"
            );
        }
        let predicted = Config { rate: Rate::Bandwidth, ..weighed };
        assert!(predicted.validate().is_ok());
        let fine = Config { lmax: 0, ..predicted.clone() };
        assert!(fine.validate().unwrap_err().to_string().contains("Config::lmax"));
        assert!(Config { lmax: 0, samples_per_side: 2, ..predicted }.validate().is_ok());
        assert!(Config { samples_per_side: 4, ..Config::new([16384, 1]) }.validate().is_err());
    }
}
