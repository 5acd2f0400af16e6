//! The suites xu and tan: every filter against the truth, under a point light and under an environment, and what each costs (Xu et
//! al. 2017, table 1, figures 1, 2 and 4 to 6; Tan et al. 2005, section 5).

mod aims;
mod aims_tan;
pub mod cases;
pub mod motion;
pub mod report;
mod stills;
mod strips;
mod times;
mod zoom;

use crate::offline::bench::copy_rate;
use crate::offline::bench::reference::{Converged, Goal};
use crate::offline::bench::report::{Head, Seconds};
use crate::offline::bench::suites::{Keep, Preset};
use crate::offline::bench::truths::Truths;
use crate::offline::error::{Error, Result};
use crate::offline::headless::{Headless, Options};
use crate::offline::progress::Progress;
use crate::offline::session::Session;
use crate::offline::supersample;
use crate::offline::world::World;
use crate::{Config, Estimator, Filter, Requirements};
use cases::{Light, Shot};
use report::{Report, Row, SceneReport, TruthReport};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;
use times::SetUp;

/// Whose scenes and aims.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Suite {
    /// Of Xu et al. 2017, on the pinned inputs.
    Xu,
    /// Of Tan et al. 2005: the same surfaces at several scales, and a zoom.
    Tan,
}

impl Suite {
    /// As `--suite` names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Xu => "xu",
            Self::Tan => "tan",
        }
    }

    /// What is compared where nothing else is asked for: all filters, of the quick preset of tan those of which it has aims.
    pub fn filters(self, preset: Preset) -> Vec<Filter> {
        let compared = |filter: &Filter| aims_tan::COMPARED.contains(&filter.name());
        let all = Filter::ALL.into_iter();
        if (self, preset) == (Self::Tan, Preset::Quick) { all.filter(compared).collect() } else { all.collect() }
    }
}

/// What to run.
#[derive(Clone, Debug)]
pub struct Order {
    /// Which of the suites.
    pub suite: Suite,
    /// How much of it.
    pub preset: Preset,
    /// Timed frames of each filter; the preset's without.
    pub rounds: Option<u32>,
    /// Size of stills; the preset's without.
    pub extent: Option<[u32; 2]>,
    /// Scene files or built-in names in the place of the suite's own.
    pub scenes: Vec<String>,
    /// Filters that are compared, in this order.
    pub filters: Vec<Filter>,
    /// Device.
    pub device: Options,
    /// The repository, under which scene files and fetched files are.
    pub root: PathBuf,
    /// Where truths are kept.
    pub cache: Option<PathBuf>,
}

impl Preset {
    /// Of stills.
    fn still(self) -> [u32; 2] {
        match self {
            Self::Quick => [128; 2],
            Self::Full => [256; 2],
        }
    }

    /// Joint sub-samples of a still's truth at which it ends in any case.
    fn most_samples(self) -> u32 {
        match self {
            Self::Quick => supersample::DEFAULT_SAMPLES,
            Self::Full => 4 * supersample::DEFAULT_SAMPLES,
        }
    }

    fn frames_timed(self) -> u32 {
        match self {
            Self::Quick => 3,
            Self::Full => 7,
        }
    }
}

/// Runs the suite. `keep` is given a strip of images of each scene and light; without, none are drawn. `found` is given the
/// report so far after each scene and light, and the whole at the end.
///
/// # Errors
/// Of the scenes, the device or the driver, of `keep` and of `found`. What a filter refuses is an empty row.
pub fn run(
    order: &Order,
    mut keep: Option<&mut Keep<'_>>,
    progress: &mut Progress<'_>,
    found: &mut dyn FnMut(&Report) -> Result<()>,
) -> Result<Report> {
    let clock = Instant::now();
    let mut report = Report {
        head: Head::new(order.suite.name(), order.preset.name(), order.rounds.unwrap_or(order.preset.frames_timed())),
        scenes: Vec::new(),
        zooms: Vec::new(),
        skipped: Vec::new(),
        copy_gb_per_s: None,
        targets: Vec::new(),
        seconds: Seconds::default(),
    };
    // A name that is none is known before the work begins.
    let own = order.scenes.iter().map(|name| Shot::of(name)).collect::<Result<Vec<_>>>()?;
    let shots = if own.is_empty() { cases::shots(order, &mut report.skipped)? } else { own };
    report.copy_gb_per_s = copy_rate::measure(&order.device, report.head.rounds)?;
    for Shot { scene, frame } in shots {
        progress(&format!("{}: loading", scene.name()), 0, 1);
        let mut animated = scene.animated()?;
        // Once for all shots of an animation.
        let moves = order.suite == Suite::Tan && frame == 0;
        let cameras = if moves { zoom::cameras(&mut animated, order.preset) } else { Vec::new() };
        animated.show(frame);
        let world = animated.into_world();
        let config = scene.config(order.extent.unwrap_or(order.preset.still()));
        let mut made = BTreeMap::new();
        for light in Light::ALL {
            let stage = Stage { order, light, world: light.alone_in(&world)?, config: &config, rounds: report.head.rounds };
            let scene = stage.measure(&mut made, &mut report, &mut keep, progress)?;
            report.scenes.push(scene);
            if cameras.len() > 1 {
                let name = format!("{}, {}", stage.world.name, light.name());
                let mut told = |what: &str, done, total| progress(&format!("{name}: {what}"), done, total);
                let zoom = zoom::measure(&stage, &cameras, &mut report.seconds.references, &mut told)?;
                report.zooms.push(zoom);
            }
            report.targets = match order.suite {
                Suite::Xu => aims::targets(&report.scenes),
                Suite::Tan => Vec::new(),
            };
            // Those of clusters are of any scenes.
            report.targets.extend(aims_tan::targets(&report.scenes, &report.zooms));
            report.seconds.total = clock.elapsed().as_secs_f64();
            found(&report)?;
        }
    }
    report.head.complete = true;
    found(&report)?;
    Ok(report)
}

/// One scene under one light.
struct Stage<'a> {
    order: &'a Order,
    light: Light,
    world: World,
    /// The scene's own settings.
    config: &'a Config,
    rounds: u32,
}

impl Stage<'_> {
    fn device(&self) -> &Options {
        &self.order.device
    }

    /// Frames that are waited for one by one. Under a point light, where shading is exact, one direction finds nothing.
    fn config(&self, filter: Filter, extent: [u32; 2], directions: u32) -> Config {
        let (estimator, directions) = match self.light {
            Light::Point => (Estimator::Brdf, 1),
            Light::Environment => (Estimator::Mis, directions),
        };
        // Those that read texels look nothing up along a footprint (Tan et al. 2005, figure 7).
        let anisotropy = if matches!(filter, Filter::Fournier4 | Filter::Fournier7) { 1 } else { self.config.anisotropy };
        Config { frames_in_flight: 1, filter, extent, estimator, directions, anisotropy, ..self.config.clone() }
    }

    /// A session in which light is looked up, which some materials refuse.
    fn looked_up(&self, filter: Filter, extent: [u32; 2]) -> Result<Option<Session>> {
        let config = Config { estimator: Estimator::Preconvolved, ..self.config(filter, extent, 1) };
        Ok(open(&self.world, &config, self.device())?.ok())
    }

    /// `made` is what maps took under the scene's other light, if that was measured.
    fn measure(
        &self,
        made: &mut BTreeMap<&'static str, SetUp>,
        report: &mut Report,
        keep: &mut Option<&mut Keep<'_>>,
        progress: &mut Progress<'_>,
    ) -> Result<SceneReport> {
        let name = format!("{}, {}", self.world.name, self.light.name());
        let mut told = |what: &str, done, total| progress(&format!("{name}: {what}"), done, total);
        let extent = self.config.extent;
        let mut rows: Vec<Row> = self.order.filters.iter().copied().map(Row::new).collect();
        let cache = self.order.cache.as_deref();

        let clock = Instant::now();
        let first = supersample::DEFAULT_SAMPLES.into();
        let mut truths = Truths::new(&self.world, self.device(), cache, supersample::DEFAULT_SAMPLES / 2);
        let truth = truths.of(&self.world.camera, extent, &Goal { noise: 0.0, most: first }, &mut |done, total| {
            told("truth", done, total);
        })?;
        report.seconds.references += clock.elapsed().as_secs_f64();

        let moving = match self.order.preset {
            Preset::Quick => None,
            Preset::Full => Some(motion::Moving::new(self, &mut report.seconds.references, &mut told)?),
        };
        // Those that others are compared with are of the first group.
        let mut filters = self.order.filters.clone();
        filters.sort_by_key(|filter| !times::COMPARED.contains(filter));
        let (mut stills, mut costs, mut rest) = (Vec::new(), None, filters.as_slice());
        while !rest.is_empty() {
            let (group, more) = stills::take(self, &truth, rest, &mut rows, &mut |done, total| told("images", done, total))?;
            let mut kept = group.kept;
            stills.extend(group.stills);
            if let Some(moving) = &moving {
                moving.flicker(self, &mut rows, &mut kept, &mut told)?;
            }
            let frames = &mut |done, total| told("frames", done, total);
            let found = times::measure(self, &mut rows, kept, report.copy_gb_per_s, made, frames)?;
            costs.get_or_insert(found);
            rest = more;
        }
        let clock = Instant::now();
        let most = self.order.preset.most_samples().into();
        let mut judge = |truth: &Converged| {
            stills::judge(&mut stills, truth, &mut rows)?;
            Ok(rows.iter().filter_map(|r| r.errors.as_ref()).map(|e| e.rmse).fold(f64::INFINITY, f64::min))
        };
        let told_truth = &mut |done, total| told("truth", done, total);
        let (truth, smallest) = truths.judged(truth, &self.world.camera, most, &mut judge, told_truth)?;
        report.seconds.references += clock.elapsed().as_secs_f64();
        let noise = truth.noise()?;
        let cost = costs.ok_or_else(|| Error::argument("filters", "at least one", "none"))?;
        if let Some(keep) = keep.as_mut() {
            keep(&self.world.name, strips::strip(self, &truth, &stills, &rows))?;
        }
        report.head.device.get_or_insert(cost.device);
        Ok(SceneReport {
            scene: self.world.name.clone(),
            light: self.light,
            extent,
            truth: TruthReport {
                samples: truth.directions(),
                cached: truth.cached,
                noise,
                pixels: truth.whole().iter().filter(|m| **m).count(),
                margin: smallest / noise.rmse,
            },
            flicker_noise: moving.map(|moving| moving.noise),
            texels: cost.texels,
            estimator: cost.estimator,
            supersampling: cost.supersampling,
            order: report::order(&rows),
            rows,
        })
    }
}

/// A session of `config`, or why there is none: what a filter or an estimator refuses is no error of the suite.
fn open(world: &World, config: &Config, device: &Options) -> Result<std::result::Result<Session, String>> {
    match Session::new(Headless::new(device, &Requirements::of(config))?, world, config) {
        Ok(session) => Ok(Ok(session)),
        Err(e) if e.exit_code() == 2 => Ok(Err(e.to_string())),
        Err(e) => Err(e),
    }
}

/// `path` under `root`, as the user's system writes it.
fn under(root: &Path, path: &str) -> String {
    root.join(path).to_string_lossy().into_owned()
}

/// Numbers that JSON cannot hold are an error of the device's frames, not of the report.
fn finite(value: f64, what: &str) -> Result<f64> {
    if value.is_finite() { Ok(value) } else { Err(Error::Device(format!("{what} is {value}"))) }
}
