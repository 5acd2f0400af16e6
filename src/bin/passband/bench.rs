//! `passband bench`: variants of a frame measured side by side.

use crate::progress::Bar;
use crate::sheet;
use clap::ValueEnum;
use passband::Filter;
use passband::offline::bench::figures::Figure;
use passband::offline::bench::report::Report;
use passband::offline::bench::{reference, suites, truths, xu};
use passband::offline::error::{Error, Result};
use passband::offline::headless::Options;
use passband::offline::image_io::{check_writable, write_atomically};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[path = "bench_plot.rs"]
mod plot;
#[path = "bench_table.rs"]
mod table;
#[path = "bench_xu.rs"]
mod xu_table;

/// Measures what passes cost, what variants of a frame gain at which error, and how far filters are from the truth
///
/// Frames of all variants alternate in one run; the last row is the first variant once more, whose difference from the first is
/// the noise of the measurement. Errors are against converged images, which are rendered when first needed and kept in the
/// user's cache. Scenes that need fetched files are looked for under the working directory.
#[derive(clap::Args)]
pub struct Args {
    /// Scene files or built-in names [default: the suite's own]
    scenes: Vec<String>,
    /// What to measure
    #[arg(long)]
    suite: Suite,
    /// How much of it: few scenes at 256x256, or all at 512x512; of xu, tan and joined some at 128x128, or all at 256x256, of the
    /// first two in motion, too
    #[arg(long, default_value = "quick")]
    preset: Preset,
    /// Timed frames of each variant [default: 5 of quick, 9 of full; of xu and tan 3 and 7]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    rounds: Option<u32>,
    /// Filters that xu and tan compare [default: all; of quick tan those that it has aims of]
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = filter)]
    filters: Vec<Filter>,
    /// Image size [default: the scene's, else the preset's]
    #[arg(long, value_name = "WxH", value_parser = crate::render::size)]
    size: Option<[u32; 2]>,
    /// A device's index or part of its name (see `passband info`)
    #[arg(long, value_name = "NAME|INDEX")]
    device: Option<String>,
    /// Write everything that was found, after each scene
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write plots of error over time and over directions into this folder, one for each scene; of bagher over shaded pixels, too
    #[arg(long, value_name = "FOLDER")]
    plots: Option<PathBuf>,
    /// Write figures into this folder: of bagher those of Bagher et al. 2011 (6, 11, 12, 14 and 15), of residual what is looked up,
    /// what that leaves and the result, of joined what filters and rates do, all of each scene of the quick preset or named here; of xu and tan the truth beside every filter, of each scene
    #[arg(long, value_name = "FOLDER")]
    figures: Option<PathBuf>,
    /// Write a page to look at
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Compare with an earlier run
    #[arg(long, value_name = "FILE.json")]
    baseline: Option<PathBuf>,
    /// Go on with an interrupted run
    #[arg(long, value_name = "FILE.json")]
    resume: Option<PathBuf>,
    /// Write a trace for viewers of traces
    #[arg(long, value_name = "FILE.json")]
    trace: Option<PathBuf>,
    /// Exit with 1 if the metric is above X (repeatable)
    #[arg(long, value_name = "METRIC=X")]
    max: Vec<String>,
    /// Exit with 1 if the metric is below X (repeatable)
    #[arg(long, value_name = "METRIC=X")]
    min: Vec<String>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Suite {
    Passes,
    Bagher,
    Xu,
    Tan,
    Residual,
    Joined,
    Scaling,
    All,
}

#[derive(Clone, Copy, ValueEnum)]
enum Preset {
    Quick,
    Full,
}

impl Args {
    /// Refuses what no suite can do yet.
    fn check(&self) -> Result<()> {
        later(self.report.is_some(), "--report")?;
        later(self.baseline.is_some(), "--baseline")?;
        later(self.resume.is_some(), "--resume")?;
        later(self.trace.is_some(), "--trace")?;
        later(!self.max.is_empty(), "bench --max")?;
        later(!self.min.is_empty(), "bench --min")
    }

    fn preset(&self) -> suites::Preset {
        match self.preset {
            Preset::Quick => suites::Preset::Quick,
            Preset::Full => suites::Preset::Full,
        }
    }

    fn options(&self) -> Options {
        Options { device: self.device.clone(), validate: false }
    }

    /// Of the suites of filters.
    fn of_filters(&self, suite: xu::Suite) -> Result<xu::Order> {
        later(self.plots.is_some(), "--plots of --suite xu and tan")?;
        Ok(xu::Order {
            suite,
            preset: self.preset(),
            rounds: self.rounds,
            extent: self.size,
            scenes: self.scenes.clone(),
            filters: if self.filters.is_empty() { suite.filters(self.preset()) } else { self.filters.clone() },
            device: self.options(),
            root: PathBuf::new(),
            cache: truths::cache_folder(),
        })
    }

    fn order(&self) -> Result<suites::Order> {
        let suite = match self.suite {
            Suite::Passes => suites::Suite::Passes,
            Suite::Bagher => suites::Suite::Bagher,
            Suite::Residual => suites::Suite::Residual,
            Suite::Joined => suites::Suite::Joined,
            Suite::Xu | Suite::Tan | Suite::Scaling | Suite::All => {
                return Err(Error::NotSupportedYet { what: "--suite scaling and all".into() });
            }
        };
        let pictured = self.plots.is_some() || self.figures.is_some();
        later(pictured && suite == suites::Suite::Passes, "--plots and --figures of the suite passes")?;
        later(self.plots.is_some() && suite == suites::Suite::Joined, "--plots of the suite joined")?;
        Ok(suites::Order {
            suite,
            preset: self.preset(),
            rounds: self.rounds,
            extent: self.size,
            curves: self.plots.is_some(),
            scenes: self.scenes.clone(),
            device: self.options(),
            root: PathBuf::new(),
            cache: if suite == suites::Suite::Joined { truths::cache_folder() } else { reference::cache_folder() },
        })
    }

    /// Keeps what was found so far, if that is asked for.
    fn write(&self, report: &impl serde::Serialize) -> Result<()> {
        let Some(path) = &self.json else { return Ok(()) };
        let text = serde_json::to_string_pretty(report).map_err(|e| Error::argument("--json", "numbers", e))?;
        write_atomically(path, |file| file.write_all(text.as_bytes()))
    }
}

/// A filter by its name.
fn filter(name: &str) -> std::result::Result<Filter, String> {
    let names = || Filter::ALL.map(Filter::name).join(", ");
    Filter::ALL.into_iter().find(|filter| filter.name() == name).ok_or_else(|| format!("expected one of {}", names()))
}

fn later(yes: bool, what: &str) -> Result<()> {
    if yes { Err(Error::NotSupportedYet { what: what.into() }) } else { Ok(()) }
}

/// What was asked of either kind of suite.
enum Order {
    Rates(suites::Order),
    Filters(xu::Order),
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.check()?;
    let order = match args.suite {
        Suite::Xu => Order::Filters(args.of_filters(xu::Suite::Xu)?),
        Suite::Tan => Order::Filters(args.of_filters(xu::Suite::Tan)?),
        _ => Order::Rates(args.order()?),
    };
    // Before the work, not after it.
    if let Some(path) = &args.json {
        check_writable(path)?;
    }
    for folder in args.plots.iter().chain(&args.figures) {
        std::fs::create_dir_all(folder).map_err(|e| Error::Write { path: folder.clone(), reason: e.to_string() })?;
    }
    let bar = Bar::new();
    let mut drawn = Vec::new();
    let mut keep = |scene: &str, figure: Figure| {
        let Some(folder) = &args.figures else { return Ok(()) };
        let path = folder.join(format!("{}-{}.png", file_stem(scene), figure.name));
        sheet::contact(&path, &figure.title, figure.columns, &figure.tiles)?;
        drawn.push(path);
        Ok(())
    };
    let keep: Option<&mut suites::Keep<'_>> = if args.figures.is_some() { Some(&mut keep) } else { None };
    let mut progress = |what: &str, done, total| bar.tell(what, done, total);
    match &order {
        Order::Rates(order) => {
            let report = suites::run(order, keep, &mut progress, &mut |report| args.write(report))?;
            bar.clear();
            crate::print(table::text(&report))?;
            if let Some(folder) = &args.plots {
                plots(folder, &report)?;
            }
        }
        Order::Filters(order) => {
            let report = xu::run(order, keep, &mut progress, &mut |report| args.write(report))?;
            bar.clear();
            crate::print(xu_table::text(&report))?;
        }
    }
    drawn.iter().try_for_each(|path| crate::print(format_args!("figure: {}", path.display())))?;
    Ok(ExitCode::SUCCESS)
}

/// A scene file's stem may hold anything but separators.
fn file_stem(scene: &str) -> String {
    scene.replace(' ', "-")
}

fn plots(folder: &Path, report: &Report) -> Result<()> {
    for scene in &report.scenes {
        let path = folder.join(format!("{}.png", file_stem(&scene.name)));
        plot::write(&path, scene)?;
        crate::print(format_args!("plot: {}", path.display()))?;
    }
    Ok(())
}
