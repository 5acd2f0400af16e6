//! The frame's passes, created from a configuration: only those that it records.

use crate::config::{Bins, Config, Estimator, GBufferSource, Rate};
use crate::distribution::alignment::Order;
use crate::error::Result;
use crate::frequency::allocation::Allocation;
use crate::gpu::pipeline::BridgeLayouts;
use crate::gpu::retire::{Build, Retired};
use crate::pass::gbuffer::GBuffer;
use crate::pass::maps::MomentPasses;
use crate::pass::{
    PassContext, allocate, brdf_map, classify, cluster_moments, curvature, environment_bandwidth, luminance, mixtures, prefilter,
    pyramid, resolve, shading_rate, texture_space, tonemap, upsample, vmf_mips,
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
    pub luminance: Option<luminance::Luminance>,
    pub pyramid: Option<pyramid::Pyramid>,
    /// Where levels are for hardware, too.
    pub shading_rate: Option<shading_rate::RatePass>,
    /// Where directions are drawn.
    pub classify: Option<classify::Classify>,
    /// Where samples have numbers of directions of their own.
    pub allocate: Option<allocate::Allocate>,
    pub upsample: Option<upsample::Upsample>,
    pub resolve: resolve::Resolve,
    pub tonemap: tonemap::Tonemap,
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
        let (top, predicted) = (config.coarsest(), config.predicts());
        let (looked_up, drawn) = (config.estimator.looks_up(), config.estimator != Estimator::Preconvolved);
        let allocated = config.allocation != Allocation::Constant;
        Ok(Self {
            environment_bandwidth: predicted
                .then(|| environment_bandwidth::EnvironmentBandwidth::new(&mut p, config.eps))
                .transpose()?,
            prefilter: looked_up.then(|| prefilter::Prefilter::new(&mut p)).transpose()?,
            moments: match config.filter.stores() {
                true => {
                    let (map, mips) = (brdf_map::BrdfMap::new(&mut p, config)?, vmf_mips::VmfMips::new(&mut p, config)?);
                    let clusters = config.filter.has_clusters().then(|| cluster_moments::ClusterMoments::new(&mut p));
                    let aligned = config.filter.gaussians().filter(|fit| fit.order == Order::Levels);
                    let mixtures = aligned.map(|fit| mixtures::Mixtures::new(&mut p, fit)).transpose()?;
                    Some((map, mips, clusters.transpose()?, mixtures))
                }
                false => None,
            },
            texture_space: (config.bins == Bins::Camera).then(|| texture_space::TextureSpace::new(&mut p)).transpose()?,
            gbuffer,
            curvature: config.curvature.then(|| curvature::Curvature::new(&mut p)).transpose()?,
            luminance: (top > 0 && config.rate == Rate::Luminance).then(|| luminance::Luminance::new(&mut p)).transpose()?,
            pyramid: (top > 0).then(|| pyramid::Pyramid::new(&mut p, top)).transpose()?,
            shading_rate: config.shading_rate.map(|rate| shading_rate::RatePass::new(&mut p, rate, config)).transpose()?,
            classify: drawn.then(|| classify::Classify::new(&mut p, top, predicted)).transpose()?,
            allocate: allocated.then(|| allocate::Allocate::new(&mut p, config)).transpose()?,
            upsample: (top > 0).then(|| upsample::Upsample::new(&mut p, top)).transpose()?,
            resolve: resolve::Resolve::new(&mut p, config)?,
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
        if let Some((map, mips, clusters, mixtures)) = self.moments {
            map.retire(bag);
            mips.retire(bag);
            clusters.into_iter().for_each(|pass| pass.retire(bag));
            mixtures.into_iter().for_each(|pass| pass.retire(bag));
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
        if let Some(pass) = self.luminance {
            pass.retire(bag);
        }
        if let Some(pass) = self.pyramid {
            pass.retire(bag);
        }
        if let Some(pass) = self.shading_rate {
            pass.retire(bag);
        }
        if let Some(pass) = self.classify {
            pass.retire(bag);
        }
        if let Some(pass) = self.allocate {
            pass.retire(bag);
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
