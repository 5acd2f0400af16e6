//! A still image of a world, with its layers and statistics.

use crate::gpu::timer::FrameTimings;
use crate::offline::aov::Aov;
use crate::offline::error::Result;
use crate::offline::headless::{Headless, Options};
use crate::offline::image_io::LinearImage;
use crate::offline::levels;
use crate::offline::rates::Given;
use crate::offline::session::Session;
use crate::offline::stats::{Pixels, Quantiles, Samples, Stats, pass_times};
use crate::offline::world::World;
use crate::plan::Directions;
use crate::{Config, Estimator, Filter, Rate, Requirements};
use serde_json::json;
use std::collections::BTreeMap;

/// Frames before timing starts.
pub(crate) const WARM_UP: u32 = 2;
/// Frames that are timed.
const TIMED: u32 = 5;
/// Directions of one frame of a reference: independent frames are averaged, so that no single dispatch runs for minutes.
const REFERENCE_CHUNK: u32 = 1024;

/// What to render.
#[derive(Clone)]
pub struct Settings {
    /// What the renderer is built for.
    pub config: Config,
    /// Who gives the levels of [`crate::Rate::Given`].
    pub given: Option<Given>,
    /// Seed of the sample points.
    pub seed: u32,
    /// Extra layers.
    pub aovs: Vec<Aov>,
    /// Directions a pixel of a converged image instead, at the full rate with the default estimator.
    pub reference: Option<u32>,
    /// Whether to time frames.
    pub timed: bool,
    /// Device.
    pub device: Options,
}

impl Settings {
    /// One frame of `config` with nothing beside it.
    pub fn new(config: Config) -> Self {
        Self { config, given: None, seed: 0, aovs: Vec::new(), reference: None, timed: false, device: Options::default() }
    }

    /// The configuration in force: each frame is waited for, and a reference is its own.
    pub(crate) fn config(&self) -> Config {
        let base = Config {
            frames_in_flight: 1,
            curvature: self.config.curvature || self.aovs.iter().any(|a| a.needs_curvature()),
            ..self.config.clone()
        };
        let Some(directions) = self.reference else { return base };
        Config { rate: Rate::Full, estimator: Estimator::Mis, directions: directions.min(REFERENCE_CHUNK), ..base }
    }

    /// Who gives the levels, if anybody does.
    pub(crate) fn given(&self) -> Option<Given> {
        self.given.filter(|_| self.config().rate == Rate::Given)
    }

    /// As `--rate` calls it.
    fn rate(&self) -> &'static str {
        match (self.config().rate, self.given) {
            (Rate::Full, _) => "full",
            (Rate::Uniform(1), _) => "half",
            (Rate::Uniform(2), _) => "quarter",
            (Rate::Uniform(_), _) => "uniform",
            (Rate::Bandwidth, _) => "bandwidth",
            (Rate::Given, given) => given.map_or("given", Given::name),
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
    let config = settings.config();
    config.validate()?;
    let headless = Headless::new(&settings.device, &Requirements::of(&config))?;
    let mut session = Session::new(headless, world, &config)?;
    let given = settings.given();
    given.iter().try_for_each(|given| given.prepare(&mut session, world, &config, &settings.device, settings.seed))?;
    let chunks = settings.reference.map_or(1, |n| n.div_ceil(config.directions));
    let total = chunks + if settings.timed { WARM_UP + TIMED } else { 0 };

    let mut sum: Vec<f64> = Vec::new();
    for chunk in 0..chunks {
        given.iter().try_for_each(|given| given.follow(&mut session, &config))?;
        session.frame([settings.seed, chunk])?;
        let (bytes, ..) = session.image("resolved")?;
        let values: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
        sum.resize(values.len(), 0.0);
        sum.iter_mut().zip(&values).for_each(|(s, v)| *s += f64::from(*v));
        progress(chunk + 1, total);
    }
    let channel = |c: usize| sum.iter().skip(c).step_by(4).map(|s| (s / f64::from(chunks)) as f32).collect();
    let [width, height] = config.extent;
    let mut channels: Vec<_> = ["R", "G", "B", "A"].iter().enumerate().map(|(c, n)| (n.to_string(), channel(c))).collect();
    for aov in &settings.aovs {
        channels.extend(aov.read(&mut session, config.samples_per_side, config.directions)?);
    }

    // A frame's times arrive when its slot is recorded again.
    let mut timings: Vec<FrameTimings> = Vec::new();
    for frame in 0..if settings.timed { WARM_UP + TIMED } else { 0 } {
        given.iter().try_for_each(|given| given.follow(&mut session, &config))?;
        session.frame([settings.seed, 0])?;
        if frame >= WARM_UP {
            timings.extend(session.timings().cloned());
        }
        progress(chunks + frame + 1, total);
    }
    let stats = statistics(world, settings, &config, &mut session, &timings)?;
    Ok(Rendered { image: LinearImage { width, height, channels }, stats })
}

/// Statistics of the session's last frame and of the times of some.
pub(crate) fn statistics(
    world: &World,
    settings: &Settings,
    config: &Config,
    session: &mut Session,
    timings: &[FrameTimings],
) -> Result<Stats> {
    let pixel = config.samples_per_side.ilog2() as i32;
    let mut by_level = BTreeMap::new();
    for (_, level) in levels::shaded(session)? {
        *by_level.entry(level as i32 - pixel).or_insert(0) += 1;
    }
    let shaded = by_level.values().sum();
    let (ids, ..) = session.image("ids")?;
    let covered = ids.chunks_exact(4).filter(|id| id.iter().any(|byte| *byte != 0)).count() as u64;
    let area_lights = world.lights.iter().filter(|l| l.is_area()).count() as u32;
    let shines = world.environment.as_ref().is_some_and(|e| e.intensity > 0.0);
    let taken = shaded * u64::from(Directions::of(config, shines, area_lights).total(area_lights));
    let estimator = match config.estimator {
        Estimator::Mis => "mis",
        Estimator::Brdf => "brdf",
        Estimator::BrdfRandom => "brdf-random",
        Estimator::Lookup => "lookup",
    };
    let values = BTreeMap::from([
        ("rate", json!(settings.rate())),
        ("lmax", json!(config.lmax)),
        ("filter", json!(if config.filter == Filter::Tk { "tk" } else { "point" })),
        ("probes", json!(config.probes)),
        ("spc", json!(config.samples_per_cycle)),
        ("operator", json!(format!("{:?}", config.operator).to_lowercase())),
        ("combine", json!(format!("{:?}", config.combine).to_lowercase())),
        ("geometric", json!(config.geometric)),
        ("estimator", json!(estimator)),
        ("samples", json!(config.directions)),
        ("aa", json!(config.samples_per_side.pow(2))),
        ("seed", json!(settings.seed)),
        ("reference", json!(settings.reference)),
    ]);
    Ok(Stats {
        schema: 1,
        device: session.headless().info().clone(),
        scene: world.name.clone(),
        extent: config.extent,
        settings: values,
        pixels: Pixels { covered, shaded, by_level },
        samples: Samples { taken, budget: taken },
        passes: pass_times(timings, session.pass_bytes()),
        frame_ms: Quantiles::of(timings.iter().map(|t| t.span_ms).collect()),
        setup_ms: session.setup().iter().copied().collect(),
        memory_bytes: session.headless().peak_bytes(),
        validation_messages: session.messages(),
    })
}
