//! `passband material`: what a reflectance does, in numbers and as a plot.

use comfy_table::{Table, presets};
use glam::DVec3;
use passband::distribution::fit::MOST_LOBES;
use passband::distribution::{Budget, LobeFit};
use passband::frequency::environment::EPS;
use passband::offline::error::{Error, Result};
use passband::offline::fit_cache::{self, lobe_fit};
use passband::offline::lobe_cache::{self, lobe_bandwidth};
use passband::offline::scene::{read_merl, read_rgl, read_sgd};
use passband::reflectance::analysis::{HIGHLIGHT, albedo, highlight, reciprocity_error};
use passband::reflectance::bake::{self, BakeError};
use passband::reflectance::{LobeBandwidth, MerlTable, Model, Reflectance, stand_in};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[path = "material_plot.rs"]
mod plot;

/// View angles at which the energy is reported, in degrees.
const ANGLES: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0];
/// Pairs at which what is baked is compared with what it was baked of.
const PAIRS: u32 = 50_000;
/// Numbers of principal components whose error is reported.
const COMPONENTS: [usize; 4] = [0, 1, 2, 4];

/// Reports a reflectance's energy, reciprocity, highlight, bandwidth and fit by lobes, and plots its lobes and slices
#[derive(clap::Args)]
pub struct Args {
    /// A MERL table (.binary), an RGL file (.bsdf), a row of an SGD table (TABLE.csv:NAME) or a built-in's name
    #[arg(value_name = "FILE|NAME")]
    material: String,
    /// Plot to write (.png)
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Report fits by at most so many lobes, too
    #[arg(long, value_name = "N", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=MOST_LOBES as i64))]
    lobes: Vec<u32>,
}

/// A reflectance to look at.
struct Subject {
    title: String,
    reflectance: Box<dyn Reflectance>,
    /// What the GPU shades instead, and how far that is off.
    shaded: Model,
    baked: BakeError,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<ExitCode> {
    if let Some(output) = &args.output
        && output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png"))
    {
        return Err(Error::argument("--output", "a name that ends in .png", output.display()));
    }
    let subject = load(&args.material)?;
    let bandwidth = report(&subject)?;
    let fit = report_fit(&subject, &args.lobes)?;
    if let Some(output) = &args.output {
        plot::write(output, &subject.title, subject.reflectance.as_ref(), &bandwidth, &fit)?;
        crate::print(format_args!("\nplot: {}", output.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn load(material: &str) -> Result<Subject> {
    if let Some(table) = stand_in::table(material) {
        return Ok(measured(format!("{material} (built-in, synthetic)"), table));
    }
    // The last colon, as a path may hold one too.
    if let Some((table, name)) = material.rsplit_once(':').filter(|(table, _)| table.to_lowercase().ends_with(".csv")) {
        let sgd = read_sgd(Path::new(table), name)?;
        let shaded = packed(&sgd.bake());
        let baked = bake::error(&sgd, &shaded, PAIRS);
        return Ok(Subject { title: format!("{name} (SGD)"), reflectance: Box::new(sgd), shaded, baked });
    }
    let path = Path::new(material);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match extension.as_str() {
        "binary" => Ok(measured(format!("{stem} (MERL)"), read_merl(path)?)),
        "bsdf" => {
            let rgl = read_rgl(path)?;
            let (kind, shaded) = if rgl.isotropic() {
                ("isotropic", packed(&rgl.bake()))
            } else {
                ("anisotropic", Model::Turned(rgl.bake_turned()?.into()))
            };
            let baked = bake::error(&rgl, &shaded, PAIRS);
            Ok(Subject { title: format!("{stem} (RGL, {kind})"), reflectance: Box::new(rgl), shaded, baked })
        }
        _ => {
            let expected = format!("FILE.binary, FILE.bsdf, TABLE.csv:NAME or one of {}", stand_in::names().join(", "));
            Err(Error::argument("material", expected, format!("`{material}`")))
        }
    }
}

fn measured(title: String, table: MerlTable) -> Subject {
    let shaded = packed(&table);
    let baked = bake::error(&table, &shaded, PAIRS);
    Subject { title, reflectance: Box::new(table), shaded, baked }
}

/// The table as the GPU holds it.
fn packed(table: &MerlTable) -> Model {
    let (scale, entries) = table.packed();
    Model::Table(MerlTable::unpacked(scale, &entries).into())
}

/// Returns the bandwidth of its lobes.
fn report(subject: &Subject) -> Result<LobeBandwidth> {
    let reflectance = subject.reflectance.as_ref();
    crate::print(format_args!("{}\n\nreflected share of light, over the view angle:", subject.title))?;
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(["degrees", "red", "green", "blue"]);
    for degrees in ANGLES {
        let rgb = albedo(reflectance, degrees).to_array().map(|c| format!("{c:.4}"));
        table.add_row([format!("{degrees}")].into_iter().chain(rgb));
    }
    crate::print(format_args!("{table}\n"))?;
    let found = highlight(reflectance);
    let width = found.half_width.map_or("none".into(), |w| format!("{w:.2} degrees"));
    let bake = subject.baked;
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.add_row(["largest reciprocity error".into(), format!("{:.2e}", reciprocity_error(reflectance))]);
    table.add_row([format!("peak at {HIGHLIGHT} degrees"), format!("{:.4} 1/sr, {:.2} degrees off", found.peak, found.at)]);
    table.add_row(["half-width at half maximum".into(), width]);
    let error = format!("rms {:.2e}, median {:.2e}, 99 % {:.2e}", bake.rms, bake.median, bake.p99);
    table.add_row(["table on the GPU, relative error".into(), error]);
    crate::print(table)?;
    crate::print(format_args!("\nangular bandwidth of the lobe around the mirror direction, over the view angle:"))?;
    let bandwidth = lobe_bandwidth(&subject.shaded, EPS, lobe_cache::cache_folder().as_deref());
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(["degrees", "cycles/radian"]);
    for degrees in ANGLES {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let at = bandwidth.at(DVec3::new(-sine, 0.0, cosine), DVec3::new(sine, 0.0, cosine));
        table.add_row([format!("{degrees}"), format!("{at:.2}")]);
    }
    crate::print(table)?;
    let errors = COMPONENTS.map(|k| format!("{k}: {:.3}", bandwidth.compressed(k).1)).join(", ");
    crate::print(format_args!("\nits relative error from the mean and so many principal components: {errors}"))?;
    crate::print(format_args!("components that hold 95 % of its energy around the mean: {}", bandwidth.components_for(0.95)))?;
    Ok(bandwidth)
}

/// Returns the fit of what the GPU shades; reports others by at most so many `lobes` beside it.
fn report_fit(subject: &Subject, lobes: &[u32]) -> Result<LobeFit> {
    let mut table = Table::new();
    let degrees = ANGLES.map(|degrees| format!("{degrees}"));
    let header = ["degrees".into()].into_iter().chain(degrees).chain(["mean", "seconds"].map(String::from));
    table.load_style(presets::NOTHING).set_header(header);
    let mut found = |budget| {
        let clock = std::time::Instant::now();
        let fit = lobe_fit(&subject.shaded, budget, fit_cache::cache_folder().as_deref());
        let seconds = clock.elapsed().as_secs_f64();
        let errors = ANGLES.map(|degrees| fit.at(degrees.to_radians().cos()).error).into_iter().chain([fit.mean_error()]);
        let numbers = errors.map(|e| format!("{e:.4}")).chain([format!("{seconds:.2}")]);
        table.add_row([format!("{} lobes", fit.count())].into_iter().chain(numbers));
        fit
    };
    let fit = found(Budget::default());
    lobes.iter().for_each(|n| drop(found(Budget { lobes: *n as usize, ..Budget::default() })));
    let used = |degrees: f64| fit.at(degrees.to_radians().cos()).lobes.iter().filter(|l| l.amplitude != DVec3::ZERO).count();
    table.add_row(["lobes of the first used".into()].into_iter().chain(ANGLES.map(|degrees| used(degrees).to_string())));
    crate::print(format_args!(
        "\nmissed share of the light, fitted by lobes and a cosine, found or read in so many seconds:\n{table}"
    ))?;
    Ok(fit)
}
