//! The suites: which variants, in which scenes.

use crate::offline::bench::cases::{self, Half};
use crate::offline::bench::equal::{Rung, equal};
use crate::offline::bench::quality::{self, Frame};
use crate::offline::bench::reference::{self, Goal};
use crate::offline::bench::report::{Against, ReferenceReport, Report, Row, SceneReport, Seconds, Skipped, gains};
use crate::offline::bench::runner::{Runner, Variant};
use crate::offline::error::{Error, Result};
use crate::offline::headless::Options;
use crate::offline::render::Settings;
use crate::offline::scene::Scene;
use crate::offline::world::World;
use crate::{Estimator, Rate};
use std::path::PathBuf;
use std::time::Instant;

/// A suite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Suite {
    /// What each pass costs.
    Passes,
    /// Shading at other rates against full rate.
    Bagher,
}

/// How much of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Few scenes, small images.
    Quick,
    /// All scenes at 512x512.
    Full,
}

/// What to run.
#[derive(Clone, Debug)]
pub struct Order {
    /// The suite.
    pub suite: Suite,
    /// How much of it.
    pub preset: Preset,
    /// Timed frames of each variant; the preset's without.
    pub rounds: Option<u32>,
    /// Image size; the scene's, else the preset's, without.
    pub extent: Option<[u32; 2]>,
    /// Scene files or built-in names in the place of the suite's own.
    pub scenes: Vec<String>,
    /// Device.
    pub device: Options,
    /// The repository, under which fetched files are.
    pub root: PathBuf,
    /// Where references are kept.
    pub cache: Option<PathBuf>,
}

/// Some numbers of directions with the rest the same.
struct Family {
    name: &'static str,
    rate: Rate,
    estimator: Estimator,
    /// Of the quick preset.
    directions: &'static [u32],
    /// Of the full one, besides.
    more: &'static [u32],
}

/// What every pass costs, with and without levels. The first variant is the control's.
const PASSES: [Family; 3] = [
    Family { name: "full", rate: Rate::Full, estimator: Estimator::Mis, directions: &[64], more: &[] },
    Family { name: "half", rate: Rate::Uniform(1), estimator: Estimator::Mis, directions: &[64], more: &[] },
    Family { name: "bandwidth", rate: Rate::Bandwidth, estimator: Estimator::Mis, directions: &[64], more: &[] },
];

/// Full rate with each estimator is the ladder on which gains are found: it has more directions than the others, and fewer.
const BAGHER: [Family; 6] = [
    Family { name: "full", rate: Rate::Full, estimator: Estimator::Mis, directions: &[64, 4, 16, 256], more: &[1024] },
    Family {
        name: "full brdf-random",
        rate: Rate::Full,
        estimator: Estimator::BrdfRandom,
        directions: &[16, 64, 256],
        more: &[1024],
    },
    Family { name: "half", rate: Rate::Uniform(1), estimator: Estimator::Mis, directions: &[64, 256], more: &[16] },
    Family { name: "quarter", rate: Rate::Uniform(2), estimator: Estimator::Mis, directions: &[64, 256], more: &[16] },
    Family { name: "bandwidth", rate: Rate::Bandwidth, estimator: Estimator::Mis, directions: &[64, 256], more: &[16] },
    Family {
        name: "bandwidth brdf-random",
        rate: Rate::Bandwidth,
        estimator: Estimator::BrdfRandom,
        directions: &[64],
        more: &[256],
    },
];

/// Scenes of the passes suite, all built in.
const PASSES_SCENES: [&str; 3] = ["trio", "maps", "crowd"];

impl Suite {
    /// As `--suite` names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Passes => "passes",
            Self::Bagher => "bagher",
        }
    }

    fn families(self) -> &'static [Family] {
        match self {
            Self::Passes => &PASSES,
            Self::Bagher => &BAGHER,
        }
    }

    /// Frames of each variant from which errors are taken; 0 where they are of no interest.
    fn error_frames(self) -> u32 {
        match self {
            Self::Passes => 0,
            // Pairs of them give the noise of one.
            Self::Bagher => 2,
        }
    }
}

impl Preset {
    /// As `--preset` names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Full => "full",
        }
    }

    fn extent(self) -> [u32; 2] {
        match self {
            Self::Quick => [256; 2],
            Self::Full => [512; 2],
        }
    }

    fn rounds(self) -> u32 {
        match self {
            Self::Quick => 5,
            Self::Full => 9,
        }
    }
}

/// The smallest error is to be ten times the noise of a reference; it is only estimated before, from two frames.
const MARGIN: f64 = 12.0;
/// Directions a pixel after which a reference is not refined further.
const MOST_DIRECTIONS: u64 = 1 << 18;
/// An [agreement](ReferenceReport::agreement) above this is no chance: what the cache held is of another renderer.
const MOST_DISAGREEMENT: f64 = 1.4;

/// One step of a run: what, and how much of it is done.
pub type Progress<'a> = dyn FnMut(&str, u64, u64) + 'a;

/// Runs a suite.
///
/// # Errors
/// Of the scenes, the device or the driver.
pub fn run(order: &Order, progress: &mut Progress<'_>) -> Result<Report> {
    let clock = Instant::now();
    let mut report = Report {
        schema: 1,
        passband: env!("CARGO_PKG_VERSION"),
        suite: order.suite.name(),
        preset: order.preset.name(),
        rounds: order.rounds.unwrap_or(order.preset.rounds()),
        device: None,
        scenes: Vec::new(),
        skipped: Vec::new(),
        summary: Vec::new(),
        seconds: Seconds::default(),
    };
    let named = |name: &str| -> Loaded { Ok(Ok(Scene::load(name, &[])?.resolve()?)) };
    let default = matches!(order.suite, Suite::Passes).then(|| {
        let count = if order.preset == Preset::Quick { 1 } else { PASSES_SCENES.len() };
        PASSES_SCENES.iter().take(count).map(|name| name.to_string()).collect::<Vec<_>>()
    });
    if let Some(names) = if order.scenes.is_empty() { default.as_ref() } else { Some(&order.scenes) } {
        // A name that is none is known before the work begins.
        names.iter().try_for_each(|name| Scene::load(name, &[]).map(drop))?;
        names.iter().try_for_each(|name| scene(order, &mut report, None, name, &named, progress))?;
    } else {
        for (half, case) in cases::all(order.preset == Preset::Quick) {
            scene(order, &mut report, Some(half), &case.name(), &|_| case.world(&order.root), progress)?;
        }
    }
    report.summary = gains(&report.scenes);
    report.seconds.total = clock.elapsed().as_secs_f64();
    Ok(report)
}

/// A world, or what has to be fetched for it.
type Loaded = Result<std::result::Result<World, Vec<&'static str>>>;

/// Loads and measures one scene, or notes what it lacks.
fn scene(
    order: &Order,
    report: &mut Report,
    half: Option<Half>,
    name: &str,
    load: &dyn Fn(&str) -> Loaded,
    progress: &mut Progress<'_>,
) -> Result<()> {
    progress(&format!("{name}: loading"), 0, 1);
    match load(name)? {
        Ok(world) => {
            let found = measure(order, report, half, &world, progress)?;
            report.scenes.push(found);
        }
        Err(needs) => report.skipped.push(Skipped { scene: name.into(), needs }),
    }
    Ok(())
}

fn measure(
    order: &Order,
    report: &mut Report,
    half: Option<Half>,
    world: &World,
    progress: &mut Progress<'_>,
) -> Result<SceneReport> {
    let extent = order.extent.or(world.size).unwrap_or(order.preset.extent());
    let step = |what: &'static str| {
        let what = format!("{}: {what}", world.name);
        move |progress: &mut Progress<'_>, done: u64, total: u64| progress(&what, done, total)
    };
    let variants = variants(order, extent, world);
    let told = step("set-up");
    let mut runner = Runner::new(variants, &mut |done, total| told(progress, done, total))?;
    let told = step("frames");
    runner.time(report.rounds, &mut |done, total| told(progress, done, total))?;
    let told = step("images");
    let frames = runner.frames(order.suite.error_frames(), &mut |done, total| told(progress, done, total))?;
    let measured = runner.measured()?;
    // Sessions are large, and a reference opens another.
    drop(runner);
    report.device = measured.first().map(|(_, m)| m.stats.device.clone());
    let first = measured.first().map(|(_, m)| m.times.clone()).unwrap_or_default();
    let mut variants: Vec<Row> = measured.into_iter().map(|(name, m)| Row::new(name, m, &first)).collect();
    let mut reference = None;
    if order.suite.error_frames() > 0 {
        let clock = Instant::now();
        let told = step("reference");
        reference = Some(judge(order, world, extent, &frames, &mut variants, &mut |done, total| told(progress, done, total))?);
        report.seconds.references += clock.elapsed().as_secs_f64();
        compare(&mut variants);
    }
    Ok(SceneReport { name: world.name.clone(), half, extent, reference, variants })
}

fn variants<'a>(order: &Order, extent: [u32; 2], world: &'a World) -> Vec<Variant<'a>> {
    let of = |family: &'static Family| {
        let more = if order.preset == Preset::Full { family.more } else { &[] };
        family.directions.iter().chain(more).map(move |directions| Variant {
            name: format!("{} {directions}", family.name),
            settings: Settings {
                rate: family.rate.into(),
                estimator: family.estimator,
                samples: *directions,
                device: order.device.clone(),
                ..Settings::new(extent)
            },
            world,
        })
    };
    order.suite.families().iter().flat_map(of).collect()
}

/// Errors of all variants against a reference that is as good as that needs.
fn judge(
    order: &Order,
    world: &World,
    extent: [u32; 2],
    frames: &[Vec<Frame>],
    rows: &mut [Row],
    progress: &mut dyn FnMut(u64, u64),
) -> Result<ReferenceReport> {
    let spread = |frames: &Vec<Frame>| quality::spread(frames).filter(|s| *s > 0.0);
    let smallest = frames.iter().filter_map(spread).fold(f64::INFINITY, f64::min);
    let goal = Goal { noise: if smallest.is_finite() { smallest / MARGIN } else { 0.0 }, most: MOST_DIRECTIONS };
    let finest = rows.iter().zip(frames).filter(|(row, _)| is(row, "rate", "full") && is(row, "estimator", "mis"));
    let finest = finest.max_by_key(|(row, _)| row.samples.taken).map(|(_, frames)| frames);
    let mut fresh = false;
    loop {
        let image = reference::converge(world, &order.device, extent, &goal, order.cache.as_deref(), progress)?;
        let (picture, mask) = (image.image().picture, image.mask());
        let of_finest = finest.map(|frames| Ok::<_, Error>((quality::error(frames, &picture, &mask)?.rmse, spread(frames))));
        let agreement = match of_finest.transpose()? {
            Some((error, Some(spread))) => error / spread,
            _ => 1.0,
        };
        if let (true, false, true, Some(cache)) = (agreement > MOST_DISAGREEMENT, fresh, image.cached > 0, &order.cache) {
            log::warn!("{}: the kept reference is of something else: rendered anew", world.name);
            reference::forget(world, extent, cache);
            fresh = true;
            continue;
        }
        for (row, frames) in rows.iter_mut().zip(frames) {
            row.error = Some(quality::error(frames, &picture, &mask)?);
        }
        let noise = image.noise()?;
        let smallest = rows.iter().filter_map(|r| r.error.as_ref()).map(|e| e.rmse).fold(f64::INFINITY, f64::min);
        let margin = smallest / noise.rmse;
        return Ok(ReferenceReport { directions: image.directions(), cached: image.cached, noise, margin, agreement });
    }
}

/// Whether a setting has this value.
fn is(row: &Row, setting: &str, value: &str) -> bool {
    row.settings.get(setting).is_some_and(|v| v == value)
}

/// Every variant against full rate with the default estimator and with its own, but for the rungs of that ladder.
fn compare(rows: &mut [Row]) {
    // Both fall as a power of the directions: the root mean square of radiance, and that of what is displayed.
    let errors = |row: &Row| row.error.as_ref().map(|e| [e.rmse, 10_f64.powf(-e.psnr / 20.0)]);
    let ladder = |estimator: &str, measure: usize| -> Vec<Rung> {
        let full = rows.iter().filter(|row| is(row, "rate", "full") && is(row, "estimator", estimator));
        let rung = |row: &Row| {
            let directions = row.settings.get("samples")?.as_u64()? as u32;
            Some(Rung { directions, error: errors(row)?[measure], times: row.rounds_ms.clone() })
        };
        full.filter_map(rung).collect()
    };
    let ladders = ["mis", "brdf-random"].map(|estimator| (estimator, [0, 1].map(|measure| ladder(estimator, measure))));
    for row in rows {
        let Some([linear, shown]) = errors(row) else { continue };
        let own = ladders.iter().filter(|(estimator, _)| match is(row, "estimator", estimator) {
            true => !is(row, "rate", "full"),
            false => *estimator == "mis",
        });
        let against = |(estimator, [rmse, psnr]): &(&'static str, [Vec<Rung>; 2])| Against {
            estimator,
            rmse: equal(rmse, linear, &row.rounds_ms),
            psnr: equal(psnr, shown, &row.rounds_ms),
        };
        row.against = own.map(against).collect();
    }
}
