//! The frame's passes, created from a configuration: only those that it records.

use crate::config::{Bins, Config, Estimator, GBufferSource, Rate};
use crate::error::Result;
use crate::frequency::allocation::Allocation;
use crate::gpu::pipeline::BridgeLayouts;
use crate::gpu::retire::{Build, Retired};
use crate::pass::gbuffer::GBuffer;
use crate::pass::maps::MomentPasses;
use crate::pass::{
    PassContext, allocate, bandwidth, base, brdf_map, classify, cluster_moments, curvature, environment_bandwidth, luminance,
    prefilter, pyramid, resolve, shade, texture_space, tonemap, upsample, vmf_mips,
};
use ash::vk;

/// Passes of the frame.
pub(crate) struct Passes {
    pub environment_bandwidth: Option<environment_bandwidth::EnvironmentBandwidth>,
    pub prefilter: Option<prefilter::Prefilter>,
    /// Those over the maps of materials, if the filter stores moments.
    pub moments: Option<MomentPasses>,
    /// Where objects have cells of their own.
    pub texture_space: Option<texture_space::TextureSpace>,
    pub gbuffer: Option<GBuffer>,
    pub curvature: Option<curvature::Curvature>,
    pub bandwidth: Option<bandwidth::Bandwidth>,
    pub luminance: Option<luminance::Luminance>,
    pub pyramid: Option<pyramid::Pyramid>,
    /// Pre-convolved light, or else samples that are listed and shaded.
    pub base: Option<base::Base>,
    pub sampled: Option<Sampled>,
    pub upsample: Option<upsample::Upsample>,
    pub resolve: resolve::Resolve,
    pub tonemap: tonemap::Tonemap,
}

/// What draws directions.
pub(crate) struct Sampled {
    pub classify: classify::Classify,
    /// Where samples have numbers of directions of their own.
    pub allocate: Option<allocate::Allocate>,
    pub shade: shade::Shade,
}

impl Passes {
    pub fn new(build: &mut Build<'_>, config: &Config, materials: vk::DescriptorSetLayout) -> Result<Self> {
        let none = BridgeLayouts { gbuffer: vk::DescriptorSetLayout::null(), materials };
        let mut p = PassContext { build, modules: &config.modules, bridge: none, slots: config.frames_in_flight };
        let gbuffer = match config.gbuffer {
            GBufferSource::Draws => Some(GBuffer::new(&mut p)?),
            GBufferSource::Host { .. } => None,
        };
        p.bridge.gbuffer = layout(&gbuffer, config);
        let (top, predicted) = (config.coarsest(), config.rate == Rate::Bandwidth);
        let looked_up = config.estimator == Estimator::Preconvolved;
        let sampled = |p: &mut PassContext<'_, '_>| -> Result<Sampled> {
            let allocated = config.allocation != Allocation::Constant;
            Ok(Sampled {
                classify: classify::Classify::new(p, top, predicted)?,
                allocate: allocated.then(|| allocate::Allocate::new(p, config)).transpose()?,
                shade: shade::Shade::new(p, config, top > 0)?,
            })
        };
        Ok(Self {
            environment_bandwidth: predicted
                .then(|| environment_bandwidth::EnvironmentBandwidth::new(&mut p, config.eps))
                .transpose()?,
            prefilter: looked_up.then(|| prefilter::Prefilter::new(&mut p)).transpose()?,
            moments: match config.filter.stores() {
                true => {
                    let (map, mips) = (brdf_map::BrdfMap::new(&mut p, config)?, vmf_mips::VmfMips::new(&mut p, config)?);
                    let clusters = config.filter.is_elliptic().then(|| cluster_moments::ClusterMoments::new(&mut p));
                    Some((map, mips, clusters.transpose()?))
                }
                false => None,
            },
            texture_space: (config.bins == Bins::Camera).then(|| texture_space::TextureSpace::new(&mut p)).transpose()?,
            gbuffer,
            curvature: config.curvature.then(|| curvature::Curvature::new(&mut p)).transpose()?,
            bandwidth: predicted.then(|| bandwidth::Bandwidth::new(&mut p, config)).transpose()?,
            luminance: (top > 0 && config.rate == Rate::Luminance).then(|| luminance::Luminance::new(&mut p)).transpose()?,
            pyramid: (top > 0).then(|| pyramid::Pyramid::new(&mut p, top)).transpose()?,
            base: looked_up.then(|| base::Base::new(&mut p, config)).transpose()?,
            sampled: (!looked_up).then(|| sampled(&mut p)).transpose()?,
            upsample: (top > 0).then(|| upsample::Upsample::new(&mut p, top)).transpose()?,
            resolve: resolve::Resolve::new(&mut p)?,
            tonemap: tonemap::Tonemap::new(&mut p)?,
        })
    }

    pub fn retire(self, bag: &mut Retired) {
        if let Some(pass) = self.environment_bandwidth {
            pass.retire(bag);
        }
        if let Some(pass) = self.prefilter {
            pass.retire(bag);
        }
        if let Some((map, mips, clusters)) = self.moments {
            map.retire(bag);
            mips.retire(bag);
            clusters.into_iter().for_each(|pass| pass.retire(bag));
        }
        if let Some(pass) = self.texture_space {
            pass.retire(bag);
        }
        if let Some(pass) = self.gbuffer {
            pass.retire(bag);
        }
        if let Some(pass) = self.curvature {
            pass.retire(bag);
        }
        if let Some(pass) = self.bandwidth {
            pass.retire(bag);
        }
        if let Some(pass) = self.luminance {
            pass.retire(bag);
        }
        if let Some(pass) = self.pyramid {
            pass.retire(bag);
        }
        if let Some(pass) = self.base {
            pass.retire(bag);
        }
        if let Some(Sampled { classify, allocate, shade }) = self.sampled {
            classify.retire(bag);
            if let Some(pass) = allocate {
                pass.retire(bag);
            }
            shade.retire(bag);
        }
        if let Some(pass) = self.upsample {
            pass.retire(bag);
        }
        self.resolve.retire(bag);
        self.tonemap.retire(bag);
    }
}

/// Layout of set 0: our own G-buffer's or the host's.
pub(crate) fn layout(own: &Option<GBuffer>, config: &Config) -> vk::DescriptorSetLayout {
    match (own, config.gbuffer) {
        (_, GBufferSource::Host { layout }) => layout,
        (Some(own), GBufferSource::Draws) => own.layout,
        (None, GBufferSource::Draws) => vk::DescriptorSetLayout::null(),
    }
}
