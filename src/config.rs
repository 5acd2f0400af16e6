//! What a renderer is built for. Everything here is fixed until [`crate::Renderer::resize`] or a new renderer.

use crate::distribution::fit::MOST_LOBES;
use crate::distribution::fitter::Budget;
use crate::distribution::{Division, Filter, Rule};
use crate::error::{Error, Result};
use crate::frequency::allocation::Allocation;
use crate::frequency::environment::EPS;
use crate::frequency::luminance::COARSEST;
use crate::frequency::operators::{Combine, Operator};
use crate::gpu::pipeline::Modules;
use crate::reflectance::bandwidth;
use ash::vk;

/// How directions are drawn and combined at a shaded sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Multiple importance sampling of reflectance and environment with Owen-scrambled Sobol points, half each.
    #[default]
    Mis,
    /// Reflectance importance sampling with the same points.
    Brdf,
    /// Reflectance importance sampling with independent random points (Bagher 2011, section 3.3).
    BrdfRandom,
    /// None: the environment is convolved beforehand with lobes by concentration, and each sample looks it up under the lobes of
    /// its material. Free of noise, at [`Rate::Full`] only, with points and directions as lights.
    Preconvolved,
    /// That, and what the lobes leave of the reflectance estimated as [`Self::Mis`] does: they are its control variate, so that the
    /// mean is right. At [`Rate::Full`] only.
    Cv,
    /// The same, but as factors on what is looked up, which up-sampling carries instead of radiance; only where a fit's error says
    /// that it is worth it ([`Config::residual_errors`]), and as far as it is no noise: of each sample's estimate the lobes are taken
    /// out as much as makes its variance least, and one that is smaller than its own noise is none. At [`Rate::Full`] it is
    /// [`Self::Cv`].
    Residual,
    /// No estimate: reflectance and radiance looked up in hashed directions and summed. Its time is the least that any
    /// estimator with as many directions can take on a device.
    Lookup,
}

impl Estimator {
    /// The name by which it is asked for.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mis => "mis",
            Self::Brdf => "brdf",
            Self::BrdfRandom => "brdf-random",
            Self::Preconvolved => "preconvolved",
            Self::Cv => "cv",
            Self::Residual => "residual",
            Self::Lookup => "lookup",
        }
    }

    /// Whether light is looked up under lobes that stand for materials.
    pub fn looks_up(self) -> bool {
        matches!(self, Self::Preconvolved | Self::Cv | Self::Residual)
    }

    /// Whether what those leave is estimated.
    pub fn has_residual(self) -> bool {
        matches!(self, Self::Cv | Self::Residual)
    }

    /// Whether directions are drawn from reflectance and lights both.
    pub(crate) fn combines(self) -> bool {
        self == Self::Mis || self.has_residual()
    }
}

/// Where samples are shaded. Levels are of output pixels: 0 is a pixel, +1 is 2x2 coarser; the samples of a pixel are at
/// negative ones. Every sample that is not shaded is up-sampled from coarser cells. A host with its own bridge replaces the
/// modules `pyramid.comp` and `classify.levels.comp` too, unless the rate is full, and for [`Rate::Bandwidth`] also
/// `bandwidth.blocks.comp` and `bandwidth.comp`; for [`Config::shading_rate`] `shading_rate.comp`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rate {
    /// Every sample.
    #[default]
    Full,
    /// The same level everywhere: 1 is half the pixels a side, 2 a quarter. At most 5 over the level of a sample.
    Uniform(u32),
    /// A level for each sample, from [`crate::FrameInputs::levels`].
    Given,
    /// The level at which the predicted bandwidth of the image asks for samples (Bagher 2011); of [`Estimator::Residual`], that which
    /// the error of the material's fit asks for.
    Bandwidth,
    /// Level 0, 1 or 2 by the contrast of the frame before ([`crate::frequency::luminance`]); the first frame, and the first after
    /// [`crate::Renderer::resize`], has level 0.
    Luminance,
}

/// The frame whose cells of directions filters with cells gather lobes in. Lobes of one cell become one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bins {
    /// The surface's tangent frame: made once a set of materials, whatever geometry and camera do.
    #[default]
    Tangent,
    /// The camera's, of each draw that is shown, made anew in every frame (Xu et al. 2017, section 4): lobes change their cells as
    /// the camera turns, and these hold what the mesh curves within a texel, too, so that [`Config::geometric`] counts it twice.
    /// Needs [`Renderer::reserve_cells`], texture coordinates in the unit square under tiling 1 that no two places of a draw share
    /// ([`crate::distribution::chart`], which a host asks itself), and an object number of its own for every draw.
    ///
    /// [`Renderer::reserve_cells`]: crate::Renderer::reserve_cells
    Camera,
}

impl Bins {
    /// The name by which they are asked for.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tangent => "tangent",
            Self::Camera => "camera",
        }
    }
}

/// The level of shading as an attachment of `VK_KHR_fragment_shading_rate`, for hosts that shade with the hardware's rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShadingRate {
    /// Pixels that a texel stands for, powers of two from 4 to 64: within the device's minimum, maximum and aspect ratio, which the
    /// host knows.
    pub texel: [u32; 2],
    /// The coarsest rate that is asked for: 0 is a pixel; 1 is 2x2, which every device with the extension has; 2 is 4x4.
    pub coarsest: u32,
}

/// Where the G-buffer comes from.
#[derive(Clone, Copy, Debug, Default)]
pub enum GBufferSource {
    /// The renderer rasterises draws into its own.
    #[default]
    Draws,
    /// The host's own, read through its replacement of `glsl/bridge/gbuffer.glsl` (see [`Config::modules`]).
    Host {
        /// Layout of the host's descriptor set 0.
        layout: vk::DescriptorSetLayout,
    },
}

/// [`Config::residual_errors`] unless they are set.
const RESIDUAL_ERRORS: [f32; 3] = [0.0, 0.1, 0.25];

/// Levels over a sample that a frame can have.
pub(crate) const MAX_LEVEL: u32 = 5;

/// Settings of a [`crate::Renderer`].
#[derive(Clone)]
pub struct Config {
    /// Output width and height in pixels, 1 to 16384 each.
    pub extent: [u32; 2],
    /// Shading samples a side of an output pixel: 1, 2 or 4 (1, 4 or 16 samples a pixel).
    pub samples_per_side: u32,
    /// Frames that may be in flight, 1 to 8: as many slots as `record` is called with.
    pub frames_in_flight: usize,
    /// Estimator.
    pub estimator: Estimator,
    /// Where samples are shaded.
    pub rate: Rate,
    /// Coarsest level of all rates but [`Rate::Full`] and [`Rate::Uniform`], 0 to 5, in output pixels; no cell is wider than 32 samples.
    pub lmax: u32,
    /// Directions in which the prediction looks, 1 to 256 a block of 2x2 pixels.
    pub probes: u32,
    /// Samples that a predicted cycle gets; by [`crate::frequency::level::samples_per_cycle`] if `None`.
    pub samples_per_cycle: Option<f32>,
    /// What the prediction takes for reflection.
    pub operator: Operator,
    /// How it combines its probes.
    pub combine: Combine,
    /// Details below this share of the largest do not count in the analyses of environment, lobes and textures
    /// ([`crate::frequency::wavelet`]): 0.001 to 0.1.
    pub eps: f64,
    /// Principal components that are kept, beside their mean, of the tiles that say how fast lobes vary (Bagher 2011, section 2.4 and figure 8), 0
    /// to 16; the tiles as they are if `None`. They are stored whole in either case: it is a study of what compression costs
    /// ([`crate::reflectance::LobeBandwidth::compressed`] has its error).
    pub lobe_components: Option<u32>,
    /// How materials are read.
    pub filter: Filter,
    /// Where filters with cells have these. [`Bins::Camera`] asks for such a filter, and for draws.
    pub bins: Bins,
    /// Most look-ups along the longer axis of what a pixel covers of a map, 1 to 16.
    pub anisotropy: u32,
    /// Added to the level at which maps are looked up, -16 to 16.
    pub lod_bias: f32,
    /// What divides a cell for [`Filter::Vmf`].
    pub division: Division,
    /// How the filters of Xu et al. 2017 make one lobe of a base lobe and the normals under it; others have their own.
    pub lobe_rule: Rule,
    /// Whether the mesh's curvature widens lobes as [`Filter::Tk`] does, whatever the filter.
    pub geometric: bool,
    /// Directions a shaded sample, 1 to 65536, or as many as [`Renderer::record`](crate::Renderer::record) says on drivers that end loops
    /// early (Mesa's llvmpipe: some 32700, and fewer with lobes, lights or several samples a pixel); at least 2 where [`Estimator`] combines two kinds. Where [`Rate::Bandwidth`] chooses among several
    /// samples a pixel, whatever stands for a pixel or more gets [`Config::samples_per_side`] times as many, and each finer level a
    /// quarter of the level above.
    pub directions: u32,
    /// Share of a sample's directions that are drawn from the reflectance, or from what its lobes leave of it, above 0 and below 1: where
    /// [`Estimator`] combines two kinds.
    pub reflectance_share: f32,
    /// The most lobes that a material is fitted by where light is looked up, 1 to 24.
    pub fit_lobes: u32,
    /// The mean error of a fit at which fewer lobes are enough, 0 to 1.
    pub fit_error: f64,
    /// Errors of a fit up to which the residual of [`Estimator::Residual`] is left out, unless it holds area lights; with [`Rate::Bandwidth`] is shaded at the
    /// coarsest level; is shaded at that of half the pixels a side. Beyond it is shaded at every sample. Lobes that a filter found are never
    /// left out; levels follow from what they are measured to miss.
    pub residual_errors: [f32; 3],
    /// Whether lobes are taken to be what look-ups of them hold, texel by texel, and none to be sharper than the sharpest level: with
    /// [`Estimator::Cv`] nothing is left that makes its mean wrong, at several times the cost. To test with.
    pub exact_lobes: bool,
    /// How shaded samples share them. All but [`Allocation::Constant`] need [`Rate::Bandwidth`], whose prediction they go by, and
    /// levels above a sample; `directions` is the mean then.
    pub allocation: Allocation,
    /// Whether and how levels are written for hardware that shades by them. Needs a rate that has levels.
    pub shading_rate: Option<ShadingRate>,
    /// Whether the curvature pass runs (an output of its own until something in the frame reads it).
    pub curvature: bool,
    /// Whether the renderer's own G-buffer holds texture coordinates, their derivatives and tangents also where no material depends
    /// on them, which takes longer; they are zero there without.
    pub coordinates: bool,
    /// Where the G-buffer comes from.
    pub gbuffer: GBufferSource,
    /// Replacements of compiled modules.
    pub modules: Modules,
}

impl Config {
    /// Defaults for an output of `extent` pixels: one sample a pixel, 64 directions, two frames in flight.
    pub fn new(extent: [u32; 2]) -> Self {
        Self {
            extent,
            samples_per_side: 1,
            frames_in_flight: 2,
            estimator: Estimator::default(),
            rate: Rate::default(),
            lmax: 3,
            probes: 4,
            samples_per_cycle: None,
            operator: Operator::default(),
            combine: Combine::default(),
            eps: EPS,
            lobe_components: None,
            filter: Filter::default(),
            bins: Bins::default(),
            anisotropy: 1,
            lod_bias: 0.0,
            division: Division::default(),
            lobe_rule: Rule::default(),
            geometric: false,
            directions: 64,
            reflectance_share: 0.5,
            fit_lobes: MOST_LOBES as u32,
            fit_error: Budget::default().error,
            residual_errors: RESIDUAL_ERRORS,
            exact_lobes: false,
            allocation: Allocation::default(),
            shading_rate: None,
            curvature: false,
            coordinates: false,
            gbuffer: GBufferSource::default(),
            modules: Modules::default(),
        }
    }

    /// Of fits of materials.
    pub(crate) fn fit_budget(&self) -> Budget {
        Budget { lobes: self.fit_lobes as usize, error: self.fit_error }
    }

    /// Whether levels follow from the predicted bandwidth of the image.
    pub(crate) fn predicts(&self) -> bool {
        self.rate == Rate::Bandwidth && !self.estimator.looks_up()
    }

    /// Whether what is estimated beside looked-up light is a factor on it.
    pub(crate) fn residual_is_factor(&self) -> bool {
        self.estimator == Estimator::Residual && self.rate != Rate::Full
    }

    /// Whether the mesh's curvature widens lobes.
    pub(crate) fn widened(&self) -> bool {
        self.geometric || self.filter == Filter::Tk
    }

    /// How normals and lobes make one with the filter that there is.
    pub(crate) fn effective_rule(&self) -> Rule {
        if self.filter.is_vmf() { self.lobe_rule } else { Rule::Exact }
    }

    /// Samples a side of the blocks that the prediction works on: 2x2 pixels.
    pub(crate) fn block_side(&self) -> u32 {
        2 * self.samples_per_side
    }

    /// Levels below a pixel's that share the pixel's directions. As many a pixel whatever its level make noise the same there,
    /// and edges, where fine samples are needed, cost no more than other pixels.
    pub(crate) fn sharing_levels(&self) -> u32 {
        let shared = self.rate == Rate::Bandwidth && self.allocation == Allocation::Constant;
        if shared { self.samples_per_side.ilog2() } else { 0 }
    }

    /// Directions of a sample that stands for a pixel or more: halfway, in decibels of noise, between those of one sample and of
    /// all samples of a pixel.
    pub(crate) fn directions_a_pixel(&self) -> u32 {
        self.directions << self.sharing_levels()
    }

    /// The coarsest level of shading, in levels over a sample: 0 where every sample is shaded.
    pub(crate) fn coarsest(&self) -> u32 {
        let above = self.samples_per_side.ilog2();
        let level = match self.rate {
            Rate::Full => return 0,
            Rate::Uniform(level) => level,
            Rate::Given | Rate::Bandwidth => self.lmax,
            Rate::Luminance => self.lmax.min(COARSEST),
        };
        level.saturating_add(above).min(MAX_LEVEL)
    }

    pub(crate) fn validate(&self) -> Result<()> {
        let check = |ok: bool, field: &str, expected: &str, got: String| {
            if ok { Ok(()) } else { Err(Error::invalid(format!("Config::{field}"), expected, got)) }
        };
        let side = self.samples_per_side;
        check(matches!(side, 1 | 2 | 4), "samples_per_side", "1, 2 or 4", side.to_string())?;
        let fits = |e: u32| (1..=16384).contains(&e) && e * side <= 65535;
        check(
            self.extent.into_iter().all(fits),
            "extent",
            "1 to 16384 pixels a side",
            format!("{}x{}", self.extent[0], self.extent[1]),
        )?;
        check((1..=8).contains(&self.frames_in_flight), "frames_in_flight", "1 to 8", self.frames_in_flight.to_string())?;
        let above = side.ilog2();
        if let Rate::Uniform(level) = self.rate {
            check(level <= MAX_LEVEL - above, "rate", &format!("a level up to {}", MAX_LEVEL - above), format!("{level}"))?;
        }
        check(self.lmax <= MAX_LEVEL, "lmax", &format!("0 to {MAX_LEVEL}"), self.lmax.to_string())?;
        let most = self.extent.into_iter().max().unwrap_or_default() * side;
        check(
            self.coarsest() == 0 || most <= 16384,
            "extent",
            "at most 16384 samples a side where samples are not all shaded",
            most.to_string(),
        )?;
        let everywhere = matches!(self.estimator, Estimator::Preconvolved | Estimator::Cv);
        check(
            !everywhere || self.rate == Rate::Full,
            "rate",
            &format!("Full, as the estimator is {:?}", self.estimator),
            format!("{:?}", self.rate),
        )?;
        let share = self.reflectance_share;
        check(share > 0.0 && share < 1.0, "reflectance_share", "above 0 and below 1", share.to_string())?;
        let most = MOST_LOBES as u32;
        check((1..=most).contains(&self.fit_lobes), "fit_lobes", &format!("1 to {most}"), self.fit_lobes.to_string())?;
        check((0.0..=1.0).contains(&self.fit_error), "fit_error", "0 to 1", self.fit_error.to_string())?;
        let ascending = self.residual_errors.is_sorted() && self.residual_errors.iter().all(|e| e.is_finite());
        check(ascending, "residual_errors", "three finite numbers in ascending order", format!("{:?}", self.residual_errors))?;
        check((1..=256).contains(&self.probes), "probes", "1 to 256", self.probes.to_string())?;
        check((1..=16).contains(&self.anisotropy), "anisotropy", "1 to 16", self.anisotropy.to_string())?;
        let texels = matches!(self.filter, Filter::Fournier4 | Filter::Fournier7);
        check(!texels || self.anisotropy == 1, "anisotropy", "1 with fournier4 and fournier7", self.anisotropy.to_string())?;
        if self.bins == Bins::Camera {
            let expected = "tangent, unless the filter is vmf4, vmf8 or vmf";
            check(self.filter.has_cells(), "bins", expected, format!("camera with {}", self.filter.name()))?;
            let draws = matches!(self.gbuffer, GBufferSource::Draws);
            check(draws, "bins", "tangent, unless the G-buffer is made of draws", "camera with the host's G-buffer".into())?;
        }
        check(self.lod_bias.abs() <= 16.0, "lod_bias", "-16 to 16", self.lod_bias.to_string())?;
        if let Division::Lengths(lengths) = self.division {
            let inside = lengths.iter().all(|length| *length > 0.0 && *length < 1.0);
            check(inside, "division", "two lengths above 0 and below 1", format!("{lengths:?}"))?;
        }
        check((1e-3..=0.1).contains(&self.eps), "eps", "0.001 to 0.1", self.eps.to_string())?;
        let (components, tiles) = (self.lobe_components.unwrap_or(0), bandwidth::SIDE as u32);
        check(components <= tiles, "lobe_components", &format!("0 to {tiles}"), components.to_string())?;
        let rate = self.samples_per_cycle.unwrap_or(1.0);
        check(rate > 0.0 && rate.is_finite(), "samples_per_cycle", "a finite number > 0", rate.to_string())?;
        let least = if self.estimator.combines() { 2 } else { 1 };
        check(
            (least..=65536).contains(&self.directions),
            "directions",
            &format!("{least} to 65536"),
            self.directions.to_string(),
        )?;
        if let Some(ShadingRate { texel, coarsest }) = self.shading_rate {
            let fits = texel.into_iter().all(|e| e.is_power_of_two() && (4..=64).contains(&e));
            check(fits, "shading_rate.texel", "two powers of two from 4 to 64", format!("{texel:?}"))?;
            check(coarsest <= 2, "shading_rate.coarsest", "0 to 2", coarsest.to_string())?;
            check(
                self.coarsest() > 0,
                "shading_rate",
                "none, unless samples have levels",
                format!("one at the rate {:?}", self.rate),
            )?;
        }
        let weighed = self.allocation != Allocation::Constant;
        check(
            !weighed || self.predicts(),
            "allocation",
            "constant, unless the rate is bandwidth and the estimator no residual's",
            format!("{} at the rate {:?} with {}", self.allocation.name(), self.rate, self.estimator.name()),
        )?;
        check(
            !weighed || self.coarsest() > 0,
            "lmax",
            "at least 1, unless directions are constant",
            format!("{} with {}", self.lmax, self.allocation.name()),
        )
    }
}
