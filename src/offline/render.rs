//! A still image of a world, with its layers and statistics.

use crate::frequency::allocation::Allocation;
use crate::gpu::timer::FrameTimings;
use crate::offline::aov::{Aov, SHADING_RATE};
use crate::offline::bench::quality::Noise;
use crate::offline::error::Result;
use crate::offline::headless::{Headless, Options};
use crate::offline::image_io::LinearImage;
use crate::offline::levels;
use crate::offline::progress::Progress;
use crate::offline::rates;
use crate::offline::session::Session;
use crate::offline::stats::{Pixels, Quantiles, Samples, Stats, pass_times};
use crate::offline::supersample;
use crate::offline::world::World;
use crate::{Config, Estimator, Rate, Requirements};
use serde_json::json;
use std::collections::BTreeMap;

/// What progress tells of beside materials.
pub(super) const FRAMES: &str = "frames";
/// Frames before timing starts.
pub(crate) const WARM_UP: u32 = 2;
/// Frames that are timed.
pub(super) const TIMED: u32 = 5;
/// Directions of one frame of a reference: independent frames are averaged, so that no single dispatch runs for minutes.
const REFERENCE_CHUNK: u32 = 1024;
/// The same where the filter finds lobes, of which drivers may not have rounds for more.
const REFERENCE_CHUNK_OF_LOBES: u32 = 256;

/// What to render.
#[derive(Clone)]
pub struct Settings {
    /// What the renderer is built for.
    pub config: Config,
    /// Whether the levels of [`Rate::Given`] are the oracle's.
    pub oracle: bool,
    /// Seed of the sample points.
    pub seed: u32,
    /// Extra layers.
    pub aovs: Vec<Aov>,
    /// Directions a pixel of a converged image instead, at the full rate with the default estimator.
    pub reference: Option<u32>,
    /// Joint sub-samples of position and direction a pixel, in the place of a filter and of the configuration's directions:
    /// [`supersample`]. At the full rate, one sample a pixel, with [`Estimator::Mis`] or [`Estimator::Brdf`], and without
    /// extra layers.
    pub supersample: Option<u32>,
    /// Whether to time frames.
    pub timed: bool,
    /// Device.
    pub device: Options,
}

impl Settings {
    /// One frame of `config` with nothing beside it.
    pub fn new(config: Config) -> Self {
        let (aovs, device) = (Vec::new(), Options::default());
        Self { config, oracle: false, seed: 0, aovs, reference: None, supersample: None, timed: false, device }
    }

    fn reference_chunk(&self) -> u32 {
        if self.config.filter.lobe_layers() > 0 { REFERENCE_CHUNK_OF_LOBES } else { REFERENCE_CHUNK }
    }

    /// Frames of the renderer, of [`open`]'s configuration, that make one image.
    pub(super) fn chunks(&self, config: &Config) -> u32 {
        match (self.supersample, self.reference) {
            (Some(samples), _) => supersample::frames(self, config, samples),
            (None, Some(directions)) => directions.div_ceil(self.reference_chunk()),
            (None, None) => 1,
        }
    }

    /// Brings a session of [`Self::config`] to where its first frame can follow.
    pub(super) fn prepare(&self, session: &mut Session, world: &World, config: &Config) -> Result<()> {
        rates::prepare(session, world, config, self.oracle && config.rate == Rate::Given, &self.device, self.seed)
    }

    /// The configuration in force: each frame is waited for, and a reference is its own.
    pub(crate) fn config(&self) -> Config {
        let base = Config {
            frames_in_flight: 1,
            curvature: self.config.curvature || self.aovs.iter().any(|a| a.needs_curvature()),
            coordinates: self.config.coordinates || self.aovs.iter().any(|a| a.needs_coordinates()),
            shading_rate: (self.config.coarsest() > 0 && self.aovs.contains(&Aov::ShadingRate)).then_some(SHADING_RATE),
            ..self.config.clone()
        };
        let Some(directions) = self.reference else { return base };
        let (rate, estimator, allocation) = (Rate::Full, Estimator::Mis, Allocation::Constant);
        Config { rate, estimator, allocation, shading_rate: None, directions: directions.min(self.reference_chunk()), ..base }
    }

    /// As `--rate` calls it.
    fn rate(&self) -> &'static str {
        match self.config().rate {
            Rate::Full => "full",
            Rate::Uniform(1) => "half",
            Rate::Uniform(2) => "quarter",
            Rate::Uniform(_) => "uniform",
            Rate::Bandwidth => "bandwidth",
            Rate::Luminance => "luminance",
            Rate::Given if self.oracle => "oracle",
            Rate::Given => "given",
        }
    }
}

/// An image and what it took.
pub struct Rendered {
    /// Linear radiance, coverage and the extra layers.
    pub image: LinearImage,
    /// Statistics; times are zero unless [`Settings::timed`].
    pub stats: Stats,
}

/// Renders `world`. `progress` is told how many of how many materials are fitted, then of frames.
///
/// # Errors
/// [`crate::offline::error::Error`] of the settings, the device or the driver.
pub fn render(world: &World, settings: &Settings, progress: &mut Progress<'_>) -> Result<Rendered> {
    let (mut session, config) = open(world, settings, progress)?;
    settings.prepare(&mut session, world, &config)?;
    let chunks = settings.chunks(&config);
    let total = chunks + if settings.timed { WARM_UP + TIMED } else { 0 };
    let mut done = 0u32;
    let shot = image(&mut session, settings, &config, 0, &mut |_| {
        done += 1;
        progress(FRAMES, u64::from(done), u64::from(total));
    })?;

    // A frame's times arrive when its slot is recorded again.
    let mut timings: Vec<FrameTimings> = Vec::new();
    for frame in 0..if settings.timed { WARM_UP + TIMED } else { 0 } {
        session.frame([settings.seed, 0])?;
        if frame >= WARM_UP {
            timings.extend(session.timings().cloned());
        }
        progress(FRAMES, u64::from(chunks + frame + 1), u64::from(total));
    }
    let counts = shot.counts(&mut session, settings, &config)?;
    let mut stats = report(world, settings, &config, &session, &timings, counts);
    stats.noise = shot.noise;
    Ok(Rendered { image: shot.image, stats })
}

/// A session of `world` with these settings.
pub(super) fn open(world: &World, settings: &Settings, progress: &mut Progress<'_>) -> Result<(Session, Config)> {
    let config = match settings.supersample {
        Some(samples) => settings.supersampled(world, samples)?,
        None => settings.config(),
    };
    config.validate()?;
    let headless = Headless::new(&settings.device, &Requirements::of(&config))?;
    let session = match settings.supersample {
        Some(_) => Session::opening(headless, &supersample::at_base(world), &config, progress)?,
        None => Session::opening(headless, world, &config, progress)?,
    };
    Ok((session, config))
}

/// An image and what is known of it.
pub(super) struct Shot {
    pub image: LinearImage,
    /// Of a supersampled one.
    pub noise: Option<Noise>,
    /// Of a supersampled one, over all pixels.
    coverage: Option<f64>,
}

impl Shot {
    /// Samples, and the directions drawn for them: of the session's last frame, or of all of a supersampled image, whose
    /// samples are its pixels.
    pub fn counts(&self, session: &mut Session, settings: &Settings, config: &Config) -> Result<(Pixels, u64)> {
        let Some((samples, coverage)) = settings.supersample.zip(self.coverage) else { return counts(session, config) };
        let alpha = self.image.channel("A").unwrap_or_default();
        let covered = alpha.iter().filter(|a| **a > 0.0).count() as u64;
        let taken = coverage * f64::from(supersample::taken(settings, config, samples));
        Ok((Pixels { covered, shaded: covered, by_level: BTreeMap::from([(0, covered)]) }, taken.round() as u64))
    }
}

/// What the session shows, as frame `number`, with its layers. `each` is called after every frame of the renderer, of which a
/// reference and a supersampled image have several.
pub(super) fn image(
    session: &mut Session,
    settings: &Settings,
    config: &Config,
    number: u32,
    each: &mut dyn FnMut(&Session),
) -> Result<Shot> {
    if let Some(samples) = settings.supersample {
        let found = supersample::image(session, settings, config, [samples, number], each)?;
        return Ok(Shot { image: found.image, noise: found.noise, coverage: Some(found.coverage) });
    }
    let chunks = settings.chunks(config);
    let mut sum: Vec<f64> = Vec::new();
    for chunk in 0..chunks {
        session.frame([settings.seed, number.wrapping_mul(chunks).wrapping_add(chunk)])?;
        each(session);
        let (bytes, ..) = session.image("resolved")?;
        let values: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
        sum.resize(values.len(), 0.0);
        sum.iter_mut().zip(&values).for_each(|(s, v)| *s += f64::from(*v));
    }
    let channel = |c: usize| sum.iter().skip(c).step_by(4).map(|s| (s / f64::from(chunks)) as f32).collect();
    let [width, height] = config.extent;
    let mut channels: Vec<_> = ["R", "G", "B", "A"].iter().enumerate().map(|(c, n)| (n.to_string(), channel(c))).collect();
    for aov in &settings.aovs {
        channels.extend(aov.read(session, config)?);
    }
    Ok(Shot { image: LinearImage { width, height, channels }, noise: None, coverage: None })
}

/// Of the session's last frame: samples, and the directions drawn for them.
pub(super) fn counts(session: &mut Session, config: &Config) -> Result<(Pixels, u64)> {
    let pixel = config.samples_per_side.ilog2() as i32;
    let mut by_level = BTreeMap::new();
    for (_, level) in levels::shaded(session)? {
        *by_level.entry(level as i32 - pixel).or_insert(0) += 1;
    }
    let shaded = by_level.values().sum();
    let (ids, ..) = session.image("ids")?;
    let covered = ids.chunks_exact(4).filter(|id| id.iter().any(|byte| *byte != 0)).count() as u64;
    let taken = levels::directions(session, config)?.iter().map(|(_, n)| u64::from(*n)).sum();
    Ok((Pixels { covered, shaded, by_level }, taken))
}

/// Statistics of the session's last frame and of the times of some.
pub(crate) fn statistics(
    world: &World,
    settings: &Settings,
    config: &Config,
    session: &mut Session,
    timings: &[FrameTimings],
) -> Result<Stats> {
    let counts = counts(session, config)?;
    Ok(report(world, settings, config, session, timings, counts))
}

/// Statistics of frames that took `timings` and, in the mean, shaded `pixels` with `taken` directions.
pub(super) fn report(
    world: &World,
    settings: &Settings,
    config: &Config,
    session: &Session,
    timings: &[FrameTimings],
    (pixels, taken): (Pixels, u64),
) -> Stats {
    let constant = config.allocation == Allocation::Constant;
    let budget = if constant { taken } else { pixels.shaded * u64::from(config.directions) };
    let values = BTreeMap::from([
        ("rate", json!(settings.rate())),
        ("lmax", json!(config.lmax)),
        ("filter", json!(settings.supersample.map_or(config.filter.name(), |_| "supersample"))),
        ("bins", json!(config.bins.name())),
        ("anisotropy", json!(config.anisotropy)),
        ("lobe_rule", json!(config.effective_rule().name())),
        ("probes", json!(config.probes)),
        ("spc", json!(config.samples_per_cycle)),
        ("operator", json!(format!("{:?}", config.operator).to_lowercase())),
        ("combine", json!(format!("{:?}", config.combine).to_lowercase())),
        ("eps", json!(config.eps)),
        ("lobe_components", json!(config.lobe_components)),
        ("geometric", json!(config.geometric)),
        ("estimator", json!(config.estimator.name())),
        ("reflectance_share", json!(config.reflectance_share)),
        ("fit_lobes", json!(config.fit_lobes)),
        ("fit_error", json!(config.fit_error)),
        ("residual_errors", json!(config.residual_errors)),
        ("exact_lobes", json!(config.exact_lobes)),
        ("samples", json!(settings.supersample.unwrap_or(config.directions))),
        ("np_rule", json!(config.allocation.name())),
        ("aa", json!(config.samples_per_side.pow(2))),
        ("seed", json!(settings.seed)),
        ("reference", json!(settings.reference)),
    ]);
    Stats {
        schema: 1,
        device: session.headless().info().clone(),
        scene: world.name.clone(),
        extent: settings.config.extent,
        settings: values,
        pixels,
        samples: Samples { taken, budget },
        noise: None,
        passes: pass_times(timings, session.pass_bytes()),
        frame_ms: Quantiles::of(timings.iter().map(|t| t.span_ms).collect()),
        setup_ms: session.setup().iter().copied().collect(),
        memory_bytes: session.headless().peak_bytes(),
        validation_messages: session.messages(),
    }
}
