//! The suites: which variants, in which scenes.

use crate::offline::bench::cases::{self, Case, Half};
use crate::offline::bench::environment::{self, EnvironmentTimes, Rebuilt, halved};
use crate::offline::bench::figures::{self, Figure};
use crate::offline::bench::quality::Frame;
use crate::offline::bench::reference::Converged;
use crate::offline::bench::report::{Head, Report, Row, SceneReport, Seconds, Skipped, gains};
use crate::offline::bench::runner::Runner;
use crate::offline::bench::variants::{self, Family};
use crate::offline::bench::{curves, joined, judge, reached, table};
use crate::offline::error::Result;
use crate::offline::headless::Options;
use crate::offline::progress::Progress;
use crate::offline::render::Settings;
use crate::offline::scene::Scene;
use crate::offline::world::World;
use crate::sampling::LatLong;
use std::path::PathBuf;
use std::time::Instant;

/// A suite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Suite {
    /// What each pass costs.
    Passes,
    /// Shading at other rates against full rate.
    Bagher,
    /// Light that is looked up and its residual against full rate.
    Residual,
    /// Filters, predicted rates and light that is looked up, alone and together, against supersampling.
    Joined,
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
    /// Whether to find the errors of reconstruction alone.
    pub curves: bool,
    /// Scene files or built-in names in the place of the suite's own.
    pub scenes: Vec<String>,
    /// Device.
    pub device: Options,
    /// The repository, under which fetched files are.
    pub root: PathBuf,
    /// Where references are kept.
    pub cache: Option<PathBuf>,
}

/// Scenes of the passes suite, all built in.
const PASSES_SCENES: [&str; 3] = ["trio", "maps", "crowd"];

impl Suite {
    /// As `--suite` names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Passes => "passes",
            Self::Bagher => "bagher",
            Self::Residual => "residual",
            Self::Joined => "joined",
        }
    }

    fn families(self) -> &'static [Family] {
        match self {
            Self::Passes => variants::PASSES,
            Self::Bagher => variants::BAGHER,
            Self::Residual => variants::RESIDUAL,
            Self::Joined => variants::JOINED,
        }
    }

    /// Frames of each variant from which errors are taken; 0 where they are of no interest.
    fn error_frames(self) -> u32 {
        match self {
            Self::Passes => 0,
            // Pairs of them give the noise of one.
            Self::Bagher | Self::Residual | Self::Joined => 2,
        }
    }

    /// The scenes' size, if these have none.
    fn extent(self, preset: Preset) -> [u32; 2] {
        match (self, preset) {
            // As supersampling has 64 times the samples.
            (Self::Joined, _) => preset.extent().map(|e| e / 2),
            _ => preset.extent(),
        }
    }

    /// The built-in scenes, if all are.
    fn scenes(self, preset: Preset) -> Option<Vec<String>> {
        let quick = preset == Preset::Quick;
        let names: Vec<&str> = match self {
            Self::Passes => PASSES_SCENES[..if quick { 1 } else { PASSES_SCENES.len() }].to_vec(),
            Self::Joined => joined::SCENES.iter().filter(|(_, in_quick)| *in_quick || !quick).map(|(name, _)| *name).collect(),
            Self::Bagher | Self::Residual => return None,
        };
        Some(names.into_iter().map(String::from).collect())
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

/// What becomes of figures: the scene's name and one of them.
pub type Keep<'a> = dyn FnMut(&str, Figure) -> Result<()> + 'a;

/// Runs a suite. `keep` is given the figures of scenes that are named in the order, and of those of the quick preset; without,
/// none are drawn. `found` is given the report so far after each scene, so that an interruption costs no more than one, and the whole at the end.
///
/// # Errors
/// Of the scenes, the device or the driver, of `keep` and of `found`.
pub fn run(
    order: &Order,
    keep: Option<&mut Keep<'_>>,
    progress: &mut Progress<'_>,
    found: &mut dyn FnMut(&Report) -> Result<()>,
) -> Result<Report> {
    let mut report = Report {
        head: Head::new(order.suite.name(), order.preset.name(), order.rounds.unwrap_or(order.preset.rounds())),
        scenes: Vec::new(),
        skipped: Vec::new(),
        summary: Vec::new(),
        table: Vec::new(),
        reached: Vec::new(),
        joined: Vec::new(),
        targets: Vec::new(),
        seconds: Seconds::default(),
    };
    let mut run = Run { order, clock: Instant::now(), report: &mut report, keep, progress, found, known: Vec::new() };
    let default = order.suite.scenes(order.preset);
    if let Some(names) = if order.scenes.is_empty() { default.as_ref() } else { Some(&order.scenes) } {
        // A name that is none is known before the work begins.
        let scenes: Vec<Scene> = names.iter().map(|name| Scene::load(name, &[])).collect::<Result<_>>()?;
        scenes.iter().try_for_each(|scene| run.scene(None, scene.name(), scene, true))?;
    } else {
        let quick = order.preset == Preset::Quick;
        let cases = if order.suite == Suite::Residual { cases::of_residual(quick) } else { cases::all(quick) };
        for (half, case) in cases {
            match case.scene(&order.root)? {
                Ok(scene) => run.scene(Some((half, case)), &case.name(), &scene, case.quick)?,
                Err(needs) => run.report.skipped.push(Skipped { scene: case.name(), needs }),
            }
        }
    }
    run.report.head.complete = true;
    run.tell()?;
    Ok(report)
}

/// A run and what it has found so far.
struct Run<'a, 'k, 'p> {
    order: &'a Order,
    clock: Instant,
    report: &'a mut Report,
    keep: Option<&'a mut Keep<'k>>,
    progress: &'a mut Progress<'p>,
    found: &'a mut dyn FnMut(&Report) -> Result<()>,
    /// Sizes of environments whose cost is known.
    known: Vec<[u32; 2]>,
}

impl Run<'_, '_, '_> {
    /// Loads and measures one scene, and draws its figures if it is `pictured`.
    fn scene(&mut self, case: Option<(Half, Case)>, name: &str, scene: &Scene, pictured: bool) -> Result<()> {
        (self.progress)(&format!("{name}: loading"), 0, 1);
        let mut world = scene.resolve()?;
        world.name = name.to_string();
        let order = self.order;
        let extent = order.extent.or(world.size).unwrap_or(order.suite.extent(order.preset));
        let base = Settings { device: order.device.clone(), ..Settings::new(scene.config(extent)) };
        let mut found = SceneReport {
            name: world.name.clone(),
            half: case.map(|c| c.0),
            case: case.map(|c| c.1),
            extent,
            environment: None,
            rebuilt: Vec::new(),
            curves: Vec::new(),
            reference: None,
            variants: Vec::new(),
        };
        let frames = self.frames(&world, &base, &mut found)?;
        if order.suite.error_frames() > 0 {
            let reference = self.judge(&world, &base, &frames, &mut found)?;
            let told = |progress: &mut Progress<'_>, what| progress(&format!("{name}: {what}"), 0, 1);
            if order.curves && order.suite == Suite::Bagher {
                told(self.progress, "curves");
                found.curves = curves::of(&world, &base)?;
            }
            if let (Some(light), Suite::Bagher) = (&world.environment, order.suite) {
                found.environment = Some(environment::times(&light.map, &base, self.report.head.rounds, Rebuilt::Bandwidth)?);
            }
            if let (Some(light), Suite::Residual) = (&world.environment, order.suite) {
                told(self.progress, "environment");
                found.rebuilt = self.rebuilt(&light.map, &base)?;
            }
            if let Some(keep) = self.keep.as_mut().filter(|_| pictured) {
                told(self.progress, "figures");
                let mask = if order.suite == Suite::Joined { reference.whole() } else { reference.mask() };
                let stage = figures::Stage { world: &world, base: &base, reference: &reference, mask, found: &found };
                match order.suite {
                    Suite::Residual => keep(name, stage.parts()?)?,
                    Suite::Joined => keep(name, stage.together()?)?,
                    Suite::Passes | Suite::Bagher => stage.draw(&mut |figure| keep(name, figure))?,
                }
            }
        }
        self.report.scenes.push(found);
        self.tell()
    }

    /// Of the scenes so far, with what follows from them.
    fn tell(&mut self) -> Result<()> {
        let report = &mut *self.report;
        report.summary = gains(&report.scenes);
        match self.order.suite {
            Suite::Passes => (),
            Suite::Bagher => {
                report.table = table::lines(&report.scenes);
                report.targets = table::targets(&report.scenes, &report.table);
            }
            Suite::Residual => {
                report.reached = reached::lines(&report.scenes);
                report.targets = reached::targets(&report.reached);
            }
            Suite::Joined => {
                report.joined = joined::lines(&report.scenes);
                report.targets = joined::targets(&report.joined);
            }
        }
        report.seconds.total = self.clock.elapsed().as_secs_f64();
        (self.found)(report)
    }

    /// What `map` costs pre-convolved in every frame, and at half of its size; nothing for a size that is known.
    fn rebuilt(&mut self, map: &LatLong, base: &Settings) -> Result<Vec<EnvironmentTimes>> {
        let size = [map.width(), map.height()];
        if self.known.contains(&size) {
            return Ok(Vec::new());
        }
        self.known.push(size);
        let rounds = self.report.head.rounds;
        let sizes = std::iter::once(map.clone()).chain(halved(map)?);
        sizes.map(|map| environment::times(&map, base, rounds, Rebuilt::Prefilter)).collect()
    }

    /// Times all variants into `found`; the images for errors.
    fn frames(&mut self, world: &World, base: &Settings, found: &mut SceneReport) -> Result<Vec<Vec<Frame>>> {
        let order = self.order;
        let variants = variants::variants(order.suite.families(), base, order.preset == Preset::Full);
        let progress = &mut *self.progress;
        let mut told = |what: &str, done, total| progress(&format!("{}: {what}", world.name), done, total);
        let mut runner = Runner::new(world, variants, &mut |done, total| told("set-up", done, total))?;
        let kept = order.suite.error_frames();
        runner.time(self.report.head.rounds, kept, &mut |done, total| told("frames", done, total))?;
        let frames = runner.images();
        let measured = runner.measured()?;
        self.report.head.device = measured.first().map(|m| m.stats.device.clone());
        let first = measured.first().map(|m| m.times.clone()).unwrap_or_default();
        found.variants = measured.into_iter().map(|m| Row::new(m, &first)).collect();
        Ok(frames)
    }

    /// Errors of `frames`; what they are against.
    fn judge(&mut self, world: &World, base: &Settings, frames: &[Vec<Frame>], found: &mut SceneReport) -> Result<Converged> {
        let clock = Instant::now();
        let what = format!("{}: reference", world.name);
        let progress = &mut *self.progress;
        let mut told = |done, total| progress(&what, done, total);
        let folder = self.order.cache.as_deref();
        let judge = if self.order.suite == Suite::Joined { judge::judge_by_truth } else { judge::judge };
        let (reference, image) = judge(world, base, folder, frames, &mut found.variants, &mut told)?;
        found.reference = Some(reference);
        if self.order.suite != Suite::Joined {
            judge::compare(&mut found.variants);
        }
        self.report.seconds.references += clock.elapsed().as_secs_f64();
        Ok(image)
    }
}
