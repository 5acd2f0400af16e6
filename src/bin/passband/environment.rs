//! `passband environment`: an environment and how fast it varies around each direction (Bagher et al. 2011, figure 7).

use crate::sheet::{RANGE, false_colour};
use comfy_table::{Table, presets};
use passband::frequency::environment::EPS;
use passband::frequency::{AngularBandwidth, calibration, wavelet};
use passband::offline::error::{Error, Result};
use passband::offline::image_io::write_png;
use passband::offline::{builtin, environment};
use passband::sampling::{LatLong, luminance};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Columns of either half of the plot.
const WIDTH: usize = 1024;
/// Reports an environment's angular bandwidth, and plots it beside the environment
#[derive(clap::Args)]
pub struct Args {
    /// A lat-long map (.exr, .hdr) or a built-in's name
    #[arg(value_name = "FILE|NAME", required_unless_present = "calibrate")]
    environment: Option<String>,
    /// Plot to write (.png)
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Details below this share of the largest do not count
    #[arg(long, default_value_t = EPS)]
    eps: f64,
    /// Print what the estimate makes of light of one frequency at several --eps instead
    #[arg(long, conflicts_with_all = ["environment", "output", "eps"])]
    calibrate: bool,
}

/// Thresholds of the calibration.
const THRESHOLDS: [f64; 8] = [0.001, 0.002, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1];

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<ExitCode> {
    if let Some(output) = &args.output
        && output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png"))
    {
        return Err(Error::argument("--output", "a name that ends in .png", output.display()));
    }
    if !(1e-3..=0.1).contains(&args.eps) {
        return Err(Error::argument("--eps", "a number from 0.001 to 0.1", args.eps));
    }
    let Some(name) = args.environment.as_deref() else { return calibrate() };
    let map = if builtin::ENVIRONMENTS.contains(&name) {
        builtin::environment(name, builtin::DEFAULT_WIDTH)?
    } else {
        environment::read(Path::new(name))?
    };
    let clock = Instant::now();
    let bandwidth = AngularBandwidth::of(&map, args.eps);
    let seconds = clock.elapsed().as_secs_f64();

    let mut sorted = bandwidth.map.values.clone();
    sorted.sort_by(f64::total_cmp);
    let at = |q: f64| sorted.get(((sorted.len() - 1) as f64 * q) as usize).copied().unwrap_or_default();
    crate::print(format_args!("{name}: {}x{}, analysed in {seconds:.2} s at eps {}", map.width(), map.height(), args.eps))?;
    crate::print(format_args!(
        "cycles/radian over the map's texels: 5 % {:.2}, median {:.2}, 95 % {:.2}, largest {:.2}",
        at(0.05),
        at(0.5),
        at(0.95),
        at(1.0)
    ))?;
    let changed = [0.5, 2.0].map(|factor| {
        let other = AngularBandwidth::of(&map, (args.eps * factor).clamp(1e-3, 0.1));
        bandwidth.other_levels(&other)
    });
    crate::print(format_args!(
        "at another level at half of that and at twice: {:.1} % and {:.1} % of them",
        100.0 * changed[0],
        100.0 * changed[1]
    ))?;
    if let Some(output) = &args.output {
        write_png(output, 2 * WIDTH as u32, WIDTH as u32 / 2, &plot(&map, &bandwidth))?;
        crate::print(format_args!(
            "plot: {} (black {} to white {} cycles/radian, logarithmic)",
            output.display(),
            RANGE[0],
            RANGE[1]
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn calibrate() -> Result<ExitCode> {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header([
        "eps",
        "bias",
        "measured",
        "median over truth",
        "of a wave, least",
        "greatest",
        "5 % of places",
        "95 %",
    ]);
    for eps in THRESHOLDS {
        let found = calibration::reading(eps)?;
        let bias = wavelet::bias(eps);
        let [low, high] = found.medians;
        let numbers = [found.median, low, high, found.spread[0], found.spread[1]].map(|x| format!("{x:.3}"));
        table.add_row([format!("{eps}"), format!("{bias:.2}"), format!("{:.2}", bias * found.median)].into_iter().chain(numbers));
    }
    crate::print(format_args!("the estimate of one frequency, in three directions and at three frequencies:\n{table}"))?;
    Ok(ExitCode::SUCCESS)
}

/// The environment as a display would show it, and its bandwidth in false colour: RGBA.
fn plot(map: &LatLong, bandwidth: &AngularBandwidth) -> Vec<u8> {
    let texels = map.texels().iter().map(|t| luminance(glam::DVec3::from(t.map(f64::from))));
    let mean = texels.sum::<f64>() / map.texels().len() as f64;
    let exposure = if mean > 0.0 { 0.3 / mean } else { 1.0 };
    let byte = |c: f64| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
    let pixel = |i: usize| {
        let (x, y) = (i % (2 * WIDTH), i / (2 * WIDTH));
        let (u, v) = (((x % WIDTH) as f64 + 0.5) / WIDTH as f64, (y as f64 + 0.5) * 2.0 / WIDTH as f64);
        let rgb = if x < WIDTH {
            let [x, y] = [u * f64::from(map.width()), v * f64::from(map.height())];
            (map.texel(x as i64, y as i64) * exposure).to_array().map(|c| c.powf(1.0 / 2.2))
        } else {
            let [x, y] = [u * bandwidth.map.width as f64, v * bandwidth.map.height() as f64];
            false_colour(bandwidth.map.wrapped(x as i64, y as i64))
        };
        let [r, g, b] = rgb.map(byte);
        [r, g, b, 255]
    };
    (0..WIDTH * WIDTH).flat_map(pixel).collect()
}
