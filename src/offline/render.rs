//! A still image of a world, with its layers and statistics.

use crate::frequency::operators::{Combine, Operator};
use crate::gpu::timer::FrameTimings;
use crate::offline::aov::Aov;
use crate::offline::error::Result;
use crate::offline::headless::{Headless, Options};
use crate::offline::image_io::LinearImage;
use crate::offline::levels;
use crate::offline::rates::Rate;
use crate::offline::session::Session;
use crate::offline::stats::{Pixels, Quantiles, Samples, Stats, pass_times};
use crate::offline::world::World;
use crate::plan::Directions;
use crate::{Config, Estimator, Filter, Requirements};
use serde_json::json;
use std::collections::BTreeMap;

/// Frames before timing starts.
pub(crate) const WARM_UP: u32 = 2;
/// Frames that are timed.
pub(super) const TIMED: u32 = 5;
/// Directions of one frame of a reference: independent frames are averaged, so that no single dispatch runs for minutes.
const REFERENCE_CHUNK: u32 = 1024;

/// What to render.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Output pixels.
    pub extent: [u32; 2],
    /// Where samples are shaded.
    pub rate: Rate,
    /// Coarsest level, in output pixels; `None` is the default.
    pub lmax: Option<u32>,
    /// Directions in which the prediction of bandwidth looks.
    pub probes: u32,
    /// Samples that a predicted cycle gets; `None` is the rule.
    pub samples_per_cycle: Option<f32>,
    /// What the prediction takes for reflection.
    pub operator: Operator,
    /// How it combines its probes.
    pub combine: Combine,
    /// Details below this share of the largest do not count in its analyses.
    pub eps: f64,
    /// How materials are read.
    pub filter: Filter,
    /// Whether the mesh's curvature widens lobes, whatever the filter.
    pub geometric: bool,
    /// Directions a shaded sample.
    pub samples: u32,
    /// Estimator.
    pub estimator: Estimator,
    /// Shading samples a side of a pixel.
    pub samples_per_side: u32,
    /// Seed of the sample points.
    pub seed: u32,
    /// Extra layers.
    pub aovs: Vec<Aov>,
    /// Directions a pixel of a converged image instead, with the default estimator.
    pub reference: Option<u32>,
    /// Whether to time frames.
    pub timed: bool,
    /// Device.
    pub device: Options,
}

impl Settings {
    /// Defaults for an image of `extent` pixels: full rate, 64 directions, one sample a pixel, nothing beside it.
    pub fn new(extent: [u32; 2]) -> Self {
        let base = Config::new(extent);
        Self {
            extent,
            rate: base.rate.into(),
            lmax: None,
            probes: base.probes,
            samples_per_cycle: base.samples_per_cycle,
            operator: base.operator,
            combine: base.combine,
            eps: base.eps,
            filter: base.filter,
            geometric: base.geometric,
            samples: base.directions,
            estimator: base.estimator,
            samples_per_side: base.samples_per_side,
            seed: 0,
            aovs: Vec::new(),
            reference: None,
            timed: false,
            device: Options::default(),
        }
    }

    pub(super) fn rate(&self) -> Rate {
        if self.reference.is_some() { crate::Rate::Full.into() } else { self.rate }
    }

    /// Frames of the renderer that make one image.
    pub(super) fn chunks(&self) -> u32 {
        self.reference.map_or(1, |n| n.div_ceil(REFERENCE_CHUNK))
    }

    pub(crate) fn config(&self) -> Config {
        let base = Config::new(self.extent);
        Config {
            samples_per_side: self.samples_per_side,
            frames_in_flight: 1,
            estimator: if self.reference.is_some() { Estimator::Mis } else { self.estimator },
            rate: self.rate().of_renderer(),
            lmax: self.lmax.unwrap_or(base.lmax),
            probes: self.probes,
            samples_per_cycle: self.samples_per_cycle,
            operator: self.operator,
            combine: self.combine,
            eps: self.eps,
            filter: self.filter,
            geometric: self.geometric,
            directions: self.reference.map_or(self.samples, |n| n.min(REFERENCE_CHUNK)),
            curvature: self.aovs.iter().any(|a| a.needs_curvature()),
            ..base
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

/// Renders `world`. `progress` is told how many of how many frames are done.
///
/// # Errors
/// [`crate::offline::error::Error`] of the settings, the device or the driver.
pub fn render(world: &World, settings: &Settings, progress: &mut dyn FnMut(u32, u32)) -> Result<Rendered> {
    let (mut session, config) = open(world, settings)?;
    let rate = settings.rate();
    rate.prepare(&mut session, world, &config, &settings.device, settings.seed)?;
    let chunks = settings.chunks();
    let total = chunks + if settings.timed { WARM_UP + TIMED } else { 0 };
    let mut done = 0;
    let image = image(&mut session, settings, &config, 0, &mut |_| {
        done += 1;
        progress(done, total);
    })?;

    // A frame's times arrive when its slot is recorded again.
    let mut timings: Vec<FrameTimings> = Vec::new();
    for frame in 0..if settings.timed { WARM_UP + TIMED } else { 0 } {
        session.frame([settings.seed, 0])?;
        if frame >= WARM_UP {
            timings.extend(session.timings().cloned());
        }
        progress(chunks + frame + 1, total);
    }
    let stats = statistics(world, settings, &config, &mut session, &timings)?;
    Ok(Rendered { image, stats })
}

/// A session of `world` with these settings.
pub(super) fn open(world: &World, settings: &Settings) -> Result<(Session, Config)> {
    let config = settings.config();
    config.validate()?;
    let headless = Headless::new(&settings.device, &Requirements::of(&config))?;
    Ok((Session::new(headless, world, &config)?, config))
}

/// What the session shows, as frame `number`, with its layers. `each` is called after every frame of the renderer, of which a
/// reference has several.
pub(super) fn image(
    session: &mut Session,
    settings: &Settings,
    config: &Config,
    number: u32,
    each: &mut dyn FnMut(&Session),
) -> Result<LinearImage> {
    let chunks = settings.chunks();
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
    let [width, height] = settings.extent;
    let mut channels: Vec<_> = ["R", "G", "B", "A"].iter().enumerate().map(|(c, n)| (n.to_string(), channel(c))).collect();
    for aov in &settings.aovs {
        channels.extend(aov.read(session, settings.samples_per_side, config.directions)?);
    }
    Ok(LinearImage { width, height, channels })
}

/// Counts of the session's last frame.
pub(super) fn pixels(session: &mut Session, config: &Config) -> Result<Pixels> {
    let pixel = config.samples_per_side.ilog2() as i32;
    let mut by_level = BTreeMap::new();
    for (_, level) in levels::shaded(session)? {
        *by_level.entry(level as i32 - pixel).or_insert(0) += 1;
    }
    let shaded = by_level.values().sum();
    let (ids, ..) = session.image("ids")?;
    let covered = ids.chunks_exact(4).filter(|id| id.iter().any(|byte| *byte != 0)).count() as u64;
    Ok(Pixels { covered, shaded, by_level })
}

/// Statistics of the session's last frame and of the times of some.
pub(crate) fn statistics(
    world: &World,
    settings: &Settings,
    config: &Config,
    session: &mut Session,
    timings: &[FrameTimings],
) -> Result<Stats> {
    let pixels = pixels(session, config)?;
    Ok(report(world, settings, config, session, timings, pixels))
}

/// Statistics of frames that took `timings` and, in the mean, shaded `pixels`.
pub(super) fn report(
    world: &World,
    settings: &Settings,
    config: &Config,
    session: &Session,
    timings: &[FrameTimings],
    pixels: Pixels,
) -> Stats {
    let area_lights = world.lights.iter().filter(|l| l.is_area()).count() as u32;
    let shines = world.environment.as_ref().is_some_and(|e| e.intensity > 0.0);
    let taken = pixels.shaded * u64::from(Directions::of(config, shines, area_lights).total(area_lights));
    let estimator = match config.estimator {
        Estimator::Mis => "mis",
        Estimator::Brdf => "brdf",
        Estimator::BrdfRandom => "brdf-random",
        Estimator::Lookup => "lookup",
    };
    let values = BTreeMap::from([
        ("rate", json!(settings.rate().name())),
        ("lmax", json!(config.lmax)),
        ("filter", json!(config.filter.name())),
        ("probes", json!(config.probes)),
        ("spc", json!(config.samples_per_cycle)),
        ("operator", json!(format!("{:?}", config.operator).to_lowercase())),
        ("combine", json!(format!("{:?}", config.combine).to_lowercase())),
        ("eps", json!(config.eps)),
        ("geometric", json!(config.geometric)),
        ("estimator", json!(estimator)),
        ("samples", json!(config.directions)),
        ("aa", json!(config.samples_per_side.pow(2))),
        ("seed", json!(settings.seed)),
        ("reference", json!(settings.reference)),
    ]);
    Stats {
        schema: 1,
        device: session.headless().info().clone(),
        scene: world.name.clone(),
        extent: settings.extent,
        settings: values,
        pixels,
        samples: Samples { taken, budget: taken },
        passes: pass_times(timings, session.pass_bytes()),
        frame_ms: Quantiles::of(timings.iter().map(|t| t.span_ms).collect()),
        setup_ms: session.setup().iter().copied().collect(),
        memory_bytes: session.headless().peak_bytes(),
        validation_messages: session.messages(),
    }
}
