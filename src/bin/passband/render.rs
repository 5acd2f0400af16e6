//! `passband render`: a scene to an image file, or frames of an animation to numbered ones.

use crate::progress::Bar;
use clap::ValueEnum;
use passband::frequency::allocation::Allocation;
use passband::frequency::operators::Combine;
use passband::offline::error::{Error, Result};
use passband::offline::headless::Options;
use passband::offline::image_io::{LinearImage, check_writable, write_atomically, write_image};
use passband::offline::metrics::{Exposure, encode};
use passband::offline::render::{Settings, render};
use passband::offline::scene::{MAX_FRAMES, Scene};
use passband::offline::sequence::render_frames;
use passband::offline::supersample::DEFAULT_SAMPLES;
use passband::sampling::luminance;
use passband::{Config, Division, Estimator, Filter, Rule};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Renders a scene file or a built-in scene
///
/// EXR files hold linear radiance in R G B, coverage in A and every --aov as a layer; HDR files radiance alone; PNG files
/// the image exposed to a mean of 0.3 over the covered pixels (of the first of --frames), clamped and encoded as sRGB.
#[derive(clap::Args)]
pub struct Args {
    /// A scene file (.toml) or a built-in name (see `passband scenes`)
    scene: String,
    /// Where the image goes: .exr, .png or .hdr
    #[arg(short, long, value_name = "OUT", default_value = "out.exr")]
    output: PathBuf,
    /// Image size [default: the scene's, else 512x512]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Where to shade [default: bandwidth; full with --estimator preconvolved and cv and --filter supersample]
    #[arg(long)]
    rate: Option<Rate>,
    /// Directions a shaded pixel (64), their mean under a scene's settings.np_rule, and the budget that the scene asks for if not
    /// given; with --aa at --rate bandwidth a pixel has times its samples a side as many, shared by finer ones. With --filter
    /// supersample, sub-samples a pixel with a position and a direction each (4096)
    #[arg(long, value_name = "N")]
    samples: Option<u32>,
    /// How directions are drawn [default: residual; mis at other rates than bandwidth and full, and where the prediction of
    /// bandwidth is asked for: with --probes, --spc, --literal eq4, eq8 and eq9, --aov bandwidth or spread, settings.np_rule]
    #[arg(long)]
    estimator: Option<Method>,
    /// Antialiasing samples a pixel: 1, 4 or 16
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = side)]
    aa: u32,
    /// How materials are read at a pixel's scale; supersample averages points over the pixel, without any filter: the truth
    #[arg(long, default_value = "point")]
    filter: String,
    /// Probes of the bandwidth prediction (4), 1 to 256 a block of 2x2 pixels
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=256))]
    probes: Option<u32>,
    /// Samples that a predicted cycle gets: a number, or auto (2 at 64 samples, rising with their root)
    #[arg(long, value_name = "X|auto", value_parser = samples_per_cycle)]
    spc: Option<SamplesPerCycle>,
    /// Seed of the sample points
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Frames A to B - 1 of an animation, to OUT.0000.exr and so on (a plain render is frame 0)
    #[arg(long, value_name = "A..B", value_parser = frames)]
    frames: Option<Range<u32>>,
    /// A paper's own form of a step in the place of its correction
    #[arg(long, value_name = "NAME")]
    literal: Vec<Literal>,
    /// Override a key of the scene: camera.fov_y=40
    #[arg(long, value_name = "PATH=VALUE", value_parser = assignment)]
    set: Vec<(String, String)>,
    /// Extra layers of an EXR: depth, normal, material, object, uv, footprint, curvature, level,
    /// weight, shaded, samples, bandwidth and spread (with --rate bandwidth), base, fit-error and decision (with --estimator
    /// preconvolved, cv or residual), residual (with cv or residual), lobes (with a --filter that finds some)
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    aov: Vec<String>,
    /// A converged full-rate image of N directions a pixel instead
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    reference: Option<u32>,
    /// Write statistics, after timing at least 5 frames
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// A device's index or part of its name (see `passband info`)
    #[arg(long, value_name = "NAME|INDEX")]
    device: Option<String>,
    /// Run under the validation layer; exit code 3 if it says anything
    #[arg(long)]
    validate: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Rate {
    Full,
    Half,
    Quarter,
    Luminance,
    Bandwidth,
    Oracle,
}

/// Equations of Bagher et al. 2011, and all of Xu et al. 2017.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Literal {
    /// Bandwidth as a mean that is weighted by what is reflected, but divided by the light alone
    Eq4,
    /// Directions by a bound on the integrand's variance (a scene's settings.np_rule = "eq8")
    Eq8,
    /// One sample a cycle, half of what a cycle needs
    Eq9,
    /// Xu et al. 2017 for --filter vmf1, vmf4, vmf8 and vmf: concentrations by equations 8 and 9, normals and lobes joined by 13 and
    /// 14, cells divided by the length of their mean vectors
    Xu,
    /// The same, lengths from a table of 1024 concentrations, as it is rendered there
    XuTable,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    Mis,
    Brdf,
    BrdfRandom,
    Preconvolved,
    Cv,
    Residual,
}

const FILTERS: [&str; 19] = [
    "point",
    "naive",
    "fixed",
    "toksvig",
    "toksvig-lobe",
    "lean",
    "lean-lobe",
    "leadr",
    "tk",
    "fournier4",
    "fournier7",
    "gmm",
    "gmm-unaligned",
    "vmf1",
    "vmf4",
    "vmf8",
    "vmf",
    "clusters",
    "bruteforce",
];

/// `None` is auto.
#[derive(Clone, Copy)]
struct SamplesPerCycle(Option<f32>);

fn samples_per_cycle(text: &str) -> std::result::Result<SamplesPerCycle, String> {
    if text == "auto" {
        return Ok(SamplesPerCycle(None));
    }
    let rate = text.parse::<f32>().ok().filter(|x| x.is_finite() && *x > 0.0);
    rate.map(|x| SamplesPerCycle(Some(x))).ok_or_else(|| format!("expected a number > 0 or auto, got {text}"))
}

fn frames(text: &str) -> std::result::Result<Range<u32>, String> {
    let parse = |t: &str| t.parse::<u32>().ok().filter(|n| *n <= MAX_FRAMES);
    let range = text.split_once("..").and_then(|(a, b)| Some(parse(a)?..parse(b)?)).filter(|range| !range.is_empty());
    range.ok_or_else(|| format!("expected A..B with A below B and B at most {MAX_FRAMES}, got {text}"))
}

/// `path` with a frame's number before its extension.
fn numbered(path: &Path, frame: u32) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!(".{frame:04}."));
    name.push(path.extension().unwrap_or_default());
    path.with_file_name(name)
}

/// WIDTHxHEIGHT of an image.
pub fn size(text: &str) -> std::result::Result<[u32; 2], String> {
    let parse = |t: &str| t.parse::<u32>().ok().filter(|e| (1..=16384).contains(e));
    let sides = text.split_once('x').and_then(|(w, h)| Some([parse(w)?, parse(h)?]));
    sides.ok_or_else(|| format!("expected WxH of 1 to 16384 pixels a side, got {text}"))
}

fn side(text: &str) -> std::result::Result<u32, String> {
    match text {
        "1" => Ok(1),
        "4" => Ok(2),
        "16" => Ok(4),
        _ => Err(format!("expected 1, 4 or 16, got {text}")),
    }
}

fn assignment(text: &str) -> std::result::Result<(String, String), String> {
    let (path, value) = text.split_once('=').ok_or_else(|| format!("expected PATH=VALUE, got {text}"))?;
    Ok((path.into(), value.into()))
}

impl Args {
    /// Rate and estimator: those that are asked for, else the best that go with what is.
    fn method(&self, base: &Config) -> (Rate, Method) {
        let supersample = self.filter == "supersample";
        let predicted = self.probes.is_some()
            || self.spc.is_some()
            || self.literal.iter().any(|form| !matches!(form, Literal::Xu | Literal::XuTable))
            || self.aov.iter().any(|layer| ["bandwidth", "spread"].contains(&layer.as_str()))
            || base.allocation != Allocation::Constant;
        let everywhere = supersample || matches!(self.estimator, Some(Method::Preconvolved | Method::Cv));
        let rate = self.rate.unwrap_or(if everywhere { Rate::Full } else { Rate::Bandwidth });
        let plain = supersample || predicted || !matches!(rate, Rate::Full | Rate::Bandwidth);
        (rate, self.estimator.unwrap_or(if plain { Method::Mis } else { Method::Residual }))
    }

    /// In the place of what the scene says in `base`.
    fn settings(&self, base: Config) -> Result<Settings> {
        let (rate, estimator) = self.method(&base);
        let oracle = rate == Rate::Oracle;
        let rate = match rate {
            Rate::Full => passband::Rate::Full,
            Rate::Half => passband::Rate::Uniform(1),
            Rate::Quarter => passband::Rate::Uniform(2),
            Rate::Bandwidth => passband::Rate::Bandwidth,
            Rate::Luminance => passband::Rate::Luminance,
            Rate::Oracle => passband::Rate::Given,
        };
        let estimator = match estimator {
            Method::Mis => Estimator::Mis,
            Method::Brdf => Estimator::Brdf,
            Method::BrdfRandom => Estimator::BrdfRandom,
            Method::Preconvolved => Estimator::Preconvolved,
            Method::Cv => Estimator::Cv,
            Method::Residual => Estimator::Residual,
        };
        let supersample = self.filter == "supersample";
        if !FILTERS.contains(&self.filter.as_str()) && !supersample {
            return Err(Error::argument("--filter", format!("one of {}, supersample", FILTERS.join(", ")), &self.filter));
        }
        let name = if supersample { Filter::Point.name() } else { &self.filter };
        let filter = Filter::ALL.into_iter().find(|filter| filter.name() == name);
        let filter = filter.ok_or_else(|| Error::NotSupportedYet { what: format!("--filter {}", self.filter) })?;
        let literal = |form: Literal| self.literal.contains(&form);
        let forms = [(Literal::XuTable, Rule::Tabulated), (Literal::Xu, Rule::Literal)];
        let lobe_rule = forms.into_iter().find(|(form, _)| literal(*form)).map_or(Rule::Exact, |(_, rule)| rule);
        let config = Config {
            rate,
            probes: self.probes.unwrap_or(base.probes),
            samples_per_cycle: self.spc.and_then(|spc| spc.0).or(literal(Literal::Eq9).then_some(1.0)),
            combine: if literal(Literal::Eq4) { Combine::Literal } else { base.combine },
            allocation: if literal(Literal::Eq8) { Allocation::Equation8 } else { base.allocation },
            filter,
            lobe_rule,
            division: if lobe_rule.is_literal() && base.division == Division::default() {
                Division::PRINTED
            } else {
                base.division
            },
            directions: self.samples.filter(|_| !supersample).unwrap_or(base.directions),
            estimator,
            samples_per_side: self.aa,
            ..base
        };
        Ok(Settings {
            oracle,
            seed: self.seed,
            aovs: self.aov.iter().map(|name| name.parse()).collect::<Result<_>>()?,
            reference: self.reference,
            supersample: supersample.then(|| self.samples.unwrap_or(DEFAULT_SAMPLES)),
            timed: self.stats.is_some(),
            device: Options { device: self.device.clone(), validate: self.validate },
            ..Settings::new(config)
        })
    }
}

/// Image size where neither the command nor the scene says one.
const SIZE: [u32; 2] = [512, 512];

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.settings(Config::new(SIZE))?;
    let extension = args.output.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !["exr", "png", "hdr"].contains(&extension.as_str()) {
        return Err(Error::argument("--output", "a name that ends in .exr, .png or .hdr", args.output.display()));
    }
    // Before the work, not after it.
    match &args.frames {
        Some(frames) => frames.clone().try_for_each(|frame| check_writable(&numbered(&args.output, frame)))?,
        None => check_writable(&args.output)?,
    }
    args.stats.iter().try_for_each(|path| check_writable(path))?;
    let clock = Instant::now();
    let scene = Scene::load(&args.scene, &args.set)?;
    let mut world = scene.animated()?;
    let loading = clock.elapsed().as_secs_f64() * 1e3;
    let settings = args.settings(scene.config(args.size.or(world.world().size).unwrap_or(SIZE)))?;

    let bar = Bar::new();
    let mut progress = |what: &str, done, total| bar.tell(what, done, total);
    let mut stats = match args.frames.clone() {
        Some(frames) => {
            // One exposure for all, or the sequence would flicker.
            let mut exposure = None;
            let mut write = |frame, image: LinearImage| {
                let factor = *exposure.get_or_insert_with(|| auto_exposure(&image));
                write_image(&numbered(&args.output, frame), &image, &display(&image, factor))
            };
            render_frames(&mut world, &settings, frames, &mut progress, &mut write)?
        }
        None => {
            let rendered = render(world.world(), &settings, &mut progress)?;
            write_image(&args.output, &rendered.image, &display(&rendered.image, auto_exposure(&rendered.image)))?;
            rendered.stats
        }
    };
    bar.clear();
    stats.setup_ms.insert("loading", loading);
    if let Some(path) = &args.stats {
        let text = serde_json::to_string_pretty(&stats).map_err(|e| Error::argument("--stats", "numbers", e))?;
        write_atomically(path, |file| std::io::Write::write_all(file, text.as_bytes()))?;
    }
    for message in &stats.validation_messages {
        crate::complain(format_args!("validation: {message}"));
    }
    Ok(if stats.validation_messages.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

/// What makes the mean luminance over covered pixels 0.3.
fn auto_exposure(image: &LinearImage) -> f64 {
    let (Some(rgb), Some(coverage)) = (image.rgb(), image.channel("A")) else { return 1.0 };
    let covered = rgb.iter().zip(coverage).filter(|(_, a)| **a > 0.0);
    let (sum, count) =
        covered.fold((0.0, 0u64), |(sum, n), (&[r, g, b], _)| (sum + luminance(glam::Vec3::new(r, g, b).as_dvec3()), n + 1));
    Exposure::Auto.factor(sum / count.max(1) as f64)
}

/// Display bytes: exposed, clamped, sRGB.
fn display(image: &LinearImage, exposure: f64) -> Vec<u8> {
    let Some(rgb) = image.rgb() else { return Vec::new() };
    let byte = |linear: f64| (encode(linear.clamp(0.0, 1.0)) * 255.0).round() as u8;
    let opaque = |&[r, g, b]: &[f32; 3]| {
        [byte(f64::from(r) * exposure), byte(f64::from(g) * exposure), byte(f64::from(b) * exposure), 255]
    };
    rgb.iter().flat_map(opaque).collect()
}
