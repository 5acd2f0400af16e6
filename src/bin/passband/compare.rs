//! `passband compare`: how far an image or a sequence is from its reference, and the gate of continuous integration.

use comfy_table::{CellAlignment, Table, presets};
use passband::offline::error::{Error, Result};
use passband::offline::image_io::write_png;
use passband::offline::metrics::{Exposure, Mask, Metrics, Pair, compare, read_frames};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compares an image or a sequence with its reference
///
/// Prints rmse, rel_l2, relmse and max_abs of linear radiance and, after exposure, clamping and sRGB encoding, psnr (dB), flip
/// (mean, 67 pixels per degree), flip_p99 and color_error, all over the masked pixels. Sequences add flicker and jod
/// (ColorVideoVDP at 30 frames a second on a standard 4K display). Exit code 1 if a gate is breached.
#[derive(clap::Args)]
pub struct Args {
    /// The image under test: .exr, .hdr or .png (decoded from sRGB); a run of `#` in the file name makes a numbered sequence:
    /// frame_####.exr
    a: PathBuf,
    /// The reference, of the same size (and the same frame numbers)
    b: PathBuf,
    /// Count only pixels where this layer of B is above 0 [default: B's alpha; without alpha, all pixels]
    #[arg(long, value_name = "LAYER")]
    mask: Option<String>,
    /// Factor on both images before display; auto is 0.3 over B's mean masked luminance
    #[arg(long, value_name = "auto|X", default_value = "auto", allow_negative_numbers = true, value_parser = exposure)]
    exposure: Exposure,
    /// Print JSON only; null stands for infinity (psnr of identical images); flicker is left out below two frames
    #[arg(long)]
    json: bool,
    /// Write FLIP's error map in magma colours (of a sequence: the worst frame's)
    #[arg(long, value_name = "OUT.png")]
    diff: Option<PathBuf>,
    /// Exit with 1 if the metric is above X (repeatable)
    #[arg(long, value_name = "METRIC=X", value_parser = gate)]
    max: Vec<Gate>,
    /// Exit with 1 if the metric is below X (repeatable)
    #[arg(long, value_name = "METRIC=X", value_parser = gate)]
    min: Vec<Gate>,
}

/// A bound on one metric.
#[derive(Clone, Debug)]
struct Gate {
    metric: String,
    bound: f64,
}

fn gate(text: &str) -> std::result::Result<Gate, String> {
    let (metric, bound) = text.split_once('=').ok_or("expected METRIC=X")?;
    if !Metrics::NAMES.contains(&metric) {
        return Err(format!("expected one of {}, got {metric}", Metrics::NAMES.join(", ")));
    }
    match bound.parse::<f64>() {
        Ok(bound) if !bound.is_nan() => Ok(Gate { metric: metric.into(), bound }),
        _ => Err(format!("expected a number, got {bound}")),
    }
}

fn exposure(text: &str) -> std::result::Result<Exposure, String> {
    match text.parse::<f64>() {
        _ if text == "auto" => Ok(Exposure::Auto),
        Ok(factor) if factor.is_finite() && factor > 0.0 => Ok(Exposure::Factor(factor)),
        _ => Err(format!("expected auto or a number above 0, got {text}")),
    }
}

/// Runs the command; exit code 1 if a gate is breached.
///
/// # Errors
/// Unreadable or unequal inputs, gates on metrics that the inputs do not have, and an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    let b = read_frames(&args.b, args.mask.as_deref().map_or(Mask::Alpha, Mask::Layer))?;
    let a = read_frames(&args.a, Mask::All)?;
    if a.sequence != b.sequence || a.numbers != b.numbers {
        let describe = |frames: &[u64], sequence: bool| match (sequence, frames) {
            (true, [first, .., last]) => format!("{} frames from {first} to {last}", frames.len()),
            (true, [only]) => format!("frame {only}"),
            _ => "a single image".into(),
        };
        let (expected, got) = (describe(&b.numbers, b.sequence), describe(&a.numbers, a.sequence));
        return Err(Error::argument(args.a.display().to_string(), format!("{expected}, as {}", args.b.display()), got));
    }
    if let Some((a, b)) = a.pictures.iter().zip(&b.pictures).find(|(a, b)| (a.width, a.height) != (b.width, b.height)) {
        let expected = format!("{}x{} pixels, as {}", b.width, b.height, args.b.display());
        return Err(Error::argument(args.a.display().to_string(), expected, format!("{}x{}", a.width, a.height)));
    }
    let pairs = a.pictures.iter().zip(&b.pictures).zip(&b.masks);
    let pairs: Vec<Pair> = pairs.map(|((a, b), mask)| Pair { a, b, mask }).collect();
    let result = compare(&pairs, args.exposure, a.sequence)?;
    let breaches = breaches(args, &result.metrics)?;
    if let Some(path) = &args.diff {
        let opaque: Vec<u8> = result.map.magma().chunks_exact(3).flat_map(|rgb| rgb.iter().copied().chain([255])).collect();
        write_png(path, result.map.width, result.map.height, &opaque)?;
    }
    let text = if args.json { json(&result.metrics)? } else { table(&result.metrics) };
    crate::print(text)?;
    for breach in &breaches {
        crate::complain(breach);
    }
    Ok(if breaches.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// One line for each gate that does not hold.
fn breaches(args: &Args, metrics: &Metrics) -> Result<Vec<String>> {
    let value = |gate: &Gate| {
        let got = "a comparison without it";
        metrics.get(&gate.metric).ok_or_else(|| Error::argument(&gate.metric, "a sequence of at least two frames", got))
    };
    let mut breaches = Vec::new();
    for gate in &args.max {
        let value = value(gate)?;
        if value > gate.bound {
            breaches.push(format!("{} is {value}, above --max {}", gate.metric, gate.bound));
        }
    }
    for gate in &args.min {
        let value = value(gate)?;
        if value < gate.bound {
            breaches.push(format!("{} is {value}, below --min {}", gate.metric, gate.bound));
        }
    }
    Ok(breaches)
}

fn json(metrics: &Metrics) -> Result<String> {
    serde_json::to_string_pretty(metrics).map_err(|e| Error::Write { path: "standard output".into(), reason: e.to_string() })
}

fn table(metrics: &Metrics) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    let counts = [("frames", metrics.frames.to_string()), ("pixels", metrics.pixels.to_string())];
    for (name, value) in counts {
        table.add_row([name.into(), value]);
    }
    table.add_row(["exposure".into(), format!("{:.6}", metrics.exposure)]);
    for name in Metrics::NAMES {
        if let Some(value) = metrics.get(name) {
            let small = value != 0.0 && value.abs() < 1e-3;
            table.add_row([name.into(), if small { format!("{value:.4e}") } else { format!("{value:.6}") }]);
        }
    }
    if let Some(column) = table.column_mut(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.trim_fmt()
}
