//! `passband render`: a scene to an image file.

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use passband::offline::error::{Error, Result};
use passband::offline::headless::Options;
use passband::offline::image_io::{LinearImage, check_writable, write_atomically, write_image};
use passband::offline::metrics::{Exposure, encode};
use passband::offline::rates::Given;
use passband::offline::render::{Settings, render};
use passband::offline::scene::Scene;
use passband::sampling::luminance;
use passband::{Config, Estimator, Filter};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Renders a scene file or a built-in scene
///
/// EXR files hold linear radiance in R G B, coverage in A and every --aov as a layer; HDR files radiance alone; PNG files
/// the image exposed to a mean of 0.3 over the covered pixels, clamped and encoded as sRGB.
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
    /// Where to shade
    #[arg(long, default_value = "full")]
    rate: Rate,
    /// Directions a shaded pixel
    #[arg(long, value_name = "N", default_value_t = 64)]
    samples: u32,
    /// How directions are drawn
    #[arg(long, default_value = "mis")]
    estimator: Method,
    /// Antialiasing samples a pixel: 1, 4 or 16
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = side)]
    aa: u32,
    /// How materials are read at a pixel's scale
    #[arg(long, default_value = "point")]
    filter: String,
    /// Probes of the bandwidth prediction (4), 1 to 64 a block of 2x2 samples
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    probes: Option<u32>,
    /// Samples that a predicted cycle gets: a number, or auto (2 at 64 samples, rising with their root)
    #[arg(long, value_name = "X|auto", default_value = "auto", value_parser = samples_per_cycle)]
    spc: SamplesPerCycle,
    /// Seed of the sample points
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Frames of an animation
    #[arg(long, value_name = "A..B")]
    frames: Option<String>,
    /// A paper's own form of a step
    #[arg(long, value_name = "NAME")]
    literal: Vec<String>,
    /// Override a key of the scene: camera.fov_y=40
    #[arg(long, value_name = "PATH=VALUE", value_parser = assignment)]
    set: Vec<(String, String)>,
    /// Extra layers of an EXR: depth, normal, material, object, uv, footprint, curvature, level,
    /// weight, shaded, samples
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

#[derive(Clone, Copy, ValueEnum)]
enum Rate {
    Full,
    Half,
    Quarter,
    Luminance,
    Bandwidth,
    Oracle,
}

#[derive(Clone, Copy, ValueEnum)]
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
    /// In the place of what the scene says in `base`.
    fn settings(&self, base: Config) -> Result<Settings> {
        let later = |yes: bool, what: &str| if yes { Err(Error::NotSupportedYet { what: what.into() }) } else { Ok(()) };
        let (rate, given) = match self.rate {
            Rate::Full => (passband::Rate::Full, None),
            Rate::Half => (passband::Rate::Uniform(1), None),
            Rate::Quarter => (passband::Rate::Uniform(2), None),
            Rate::Bandwidth => (passband::Rate::Bandwidth, None),
            Rate::Luminance => (passband::Rate::Given, Some(Given::Luminance)),
            Rate::Oracle => (passband::Rate::Given, Some(Given::Oracle)),
        };
        let estimator = match self.estimator {
            Method::Mis => Estimator::Mis,
            Method::Brdf => Estimator::Brdf,
            Method::BrdfRandom => Estimator::BrdfRandom,
            Method::Preconvolved | Method::Cv | Method::Residual => {
                return Err(Error::NotSupportedYet { what: "--estimator preconvolved, cv and residual".into() });
            }
        };
        if !FILTERS.contains(&self.filter.as_str()) && self.filter != "supersample" {
            return Err(Error::argument("--filter", format!("one of {}, supersample", FILTERS.join(", ")), &self.filter));
        }
        let filter = match self.filter.as_str() {
            "point" => Filter::Point,
            "tk" => Filter::Tk,
            _ => return Err(Error::NotSupportedYet { what: "--filter other than point and tk".into() }),
        };
        later(self.frames.is_some(), "--frames")?;
        later(!self.literal.is_empty(), "--literal")?;
        let config = Config {
            rate,
            probes: self.probes.unwrap_or(base.probes),
            samples_per_cycle: self.spc.0,
            filter,
            directions: self.samples,
            estimator,
            samples_per_side: self.aa,
            ..base
        };
        Ok(Settings {
            given,
            seed: self.seed,
            aovs: self.aov.iter().map(|name| name.parse()).collect::<Result<_>>()?,
            reference: self.reference,
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
    std::iter::once(&args.output).chain(&args.stats).try_for_each(|path| check_writable(path))?;
    let clock = Instant::now();
    let scene = Scene::load(&args.scene, &args.set)?;
    let world = scene.resolve()?;
    let loading = clock.elapsed().as_secs_f64() * 1e3;
    let settings = args.settings(scene.config(args.size.or(world.size).unwrap_or(SIZE)))?;

    let style = ProgressStyle::with_template("{msg} {bar:30} {pos}/{len} {eta}").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(1).with_style(style).with_message("frames");
    let mut rendered = render(&world, &settings, &mut |done, total| {
        bar.set_length(total.into());
        bar.set_position(done.into());
    })?;
    bar.finish_and_clear();
    rendered.stats.setup_ms.insert("loading", loading);
    write_image(&args.output, &rendered.image, &display(&rendered.image))?;
    if let Some(path) = &args.stats {
        let text = serde_json::to_string_pretty(&rendered.stats).map_err(|e| Error::argument("--stats", "numbers", e))?;
        write_atomically(path, |file| std::io::Write::write_all(file, text.as_bytes()))?;
    }
    for message in &rendered.stats.validation_messages {
        crate::complain(format_args!("validation: {message}"));
    }
    Ok(if rendered.stats.validation_messages.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

/// Display bytes: exposed to a mean luminance of 0.3 over covered pixels, clamped, sRGB.
fn display(image: &LinearImage) -> Vec<u8> {
    let (Some(rgb), Some(coverage)) = (image.rgb(), image.channel("A")) else { return Vec::new() };
    let covered = rgb.iter().zip(coverage).filter(|(_, a)| **a > 0.0);
    let (sum, count) =
        covered.fold((0.0, 0u64), |(sum, n), (&[r, g, b], _)| (sum + luminance(glam::Vec3::new(r, g, b).as_dvec3()), n + 1));
    let exposure = Exposure::Auto.factor(sum / count.max(1) as f64);
    let byte = |linear: f64| (encode(linear.clamp(0.0, 1.0)) * 255.0).round() as u8;
    let opaque = |&[r, g, b]: &[f32; 3]| {
        [byte(f64::from(r) * exposure), byte(f64::from(g) * exposure), byte(f64::from(b) * exposure), 255]
    };
    rgb.iter().flat_map(opaque).collect()
}
