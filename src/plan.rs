//! The frame's arithmetic: extents, image descriptions, memory footprint. No GPU.

use crate::config::{Config, GBufferSource};
use crate::gpu::image::ImageDesc;
use crate::light::{LightRecord, MAX_LIGHTS};
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
    pub curvature: Option<ImageDesc>,
    pub radiance: ImageDesc,
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
        let storage = sampled | vk::ImageUsageFlags::STORAGE;
        let own = matches!(config.gbuffer, GBufferSource::Draws);
        Self {
            shading,
            gbuffer: own.then(|| {
                [
                    image("surface", vk::Format::R32G32B32A32_SFLOAT, shading, target),
                    image("ids", vk::Format::R32_UINT, shading, target),
                    image("coordinate", vk::Format::R32G32B32A32_SFLOAT, shading, target),
                    image("derivative", vk::Format::R32G32B32A32_SFLOAT, shading, target),
                    image("depth", vk::Format::D32_SFLOAT, shading, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
                ]
            }),
            normals: image("normals", vk::Format::R32G32B32A32_SFLOAT, shading, storage),
            factors: image("factors", vk::Format::R32G32B32A32_UINT, shading, storage),
            curvature: config.curvature.then(|| image("curvature", vk::Format::R16G16B16A16_SFLOAT, shading, storage)),
            radiance: image("radiance", vk::Format::R32G32B32A32_SFLOAT, shading, storage),
            resolved: image("resolved", vk::Format::R32G32B32A32_SFLOAT, config.extent, storage),
        }
    }

    fn images(&self) -> impl Iterator<Item = &ImageDesc> {
        let all = [&self.normals, &self.factors, &self.radiance, &self.resolved];
        self.gbuffer.iter().flatten().chain(&self.curvature).chain(all)
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
    /// Half of the configured number from the reflectance; the other half in equal parts from the environment, if it shines,
    /// and each of `area_lights`, at least one each.
    pub fn of(config: &Config, environment: bool, area_lights: u32) -> Self {
        let n = config.directions;
        let sources = u32::from(environment) + area_lights;
        if config.estimator != crate::Estimator::Mis || sources == 0 {
            return Self { brdf: n, environment: 0, light: 0 };
        }
        let light = if area_lights > 0 { (n / 2 / sources).max(1) } else { 0 };
        let rest = (n / 2).saturating_sub(light * area_lights).max(1);
        Self { brdf: n.div_ceil(2), environment: if environment { rest } else { 0 }, light }
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
        // surface, coordinate, derivative, normals, factors, radiance 16 bytes; ids, depth, list 4; resolved 16
        assert_eq!(memory_footprint(&base).total(), pixels * (6 * 16 + 3 * 4 + 16) + 16 + 16 + 2 * (144 + 256 * 64));
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
    fn impossible_settings_name_the_field() {
        let base = Config::new([0, 4]);
        assert!(base.validate().unwrap_err().to_string().contains("Config::extent"));
        let base = Config { directions: 1, ..Config::new([4, 4]) };
        assert!(base.validate().unwrap_err().to_string().contains("Config::directions"));
        assert!(Config { samples_per_side: 3, ..Config::new([4, 4]) }.validate().is_err());
        assert!(Config { samples_per_side: 4, ..Config::new([16384, 1]) }.validate().is_err());
    }
}
