//! Images of `tests/golden` and what the command renders today. On the software driver that made them every channel must
//! agree to a measured tolerance, at both vector widths; on any other, colour is judged by FLIP and layers by how many pixels
//! are off. `scripts/bless` writes them anew.

#[path = "support/chosen_device.rs"]
mod chosen_device;

use chosen_device::DEVICE;
use passband::offline::image_io::{LinearImage, read_exr};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A golden image.
struct Golden {
    name: &'static str,
    arguments: &'static [&'static str],
    /// Largest error of any pixel over its value plus the channel's mean: colour, and each layer's where it differs.
    tolerance: &'static [(&'static str, f64)],
    why: &'static str,
}

/// What all have in common: no default may change them.
const COMMON: [&str; 12] =
    ["--size", "96x96", "--rate", "full", "--samples", "64", "--estimator", "mis", "--filter", "point", "--seed", "0"];
/// Mean FLIP on another driver. Its rounding moves single sample directions across texels, which is seen in few pixels.
const FLIP: f64 = 0.01;
/// On another driver, the share of covered pixels whose layer may be off by more than `OFF`: those at silhouettes, mostly.
const SHARE: f64 = 0.03;
const OFF: f64 = 0.02;

const TRIO: Golden = Golden {
    name: "trio",
    arguments: &["trio", "--aa", "1"],
    tolerance: &[("", 2e-4)],
    why: "Bit-identical at vector widths 128 and 256 and with 1 or 2 threads. Without AVX and FMA (GALLIUM_NOSSE=1, \
          GALLIUM_OVERRIDE_CPU_CAPS=sse4.1) the worst pixel moved by 2.4e-5 of its value: another CPU's rounding.",
};
const MIRROR: Golden = Golden {
    name: "mirror-aa4",
    arguments: &["torus-knot", "--aa", "4", "--set", "materials.paint.reflectance.builtin=mirror-metal"],
    tolerance: &[("", 2e-4)],
    why: "Bit-identical at vector widths 128 and 256 and with 1 or 2 threads. Without AVX and FMA the worst pixel moved by \
          2.5e-5 of its value.",
};
const LAYERS: Golden = Golden {
    name: "bumpy-layers",
    arguments: &["bumpy-sphere", "--aa", "1", "--aov", "depth,normal,curvature"],
    tolerance: &[("", 2e-4), ("curvature", 2e-3)],
    why: "Bit-identical at vector widths 128 and 256 and with 1 or 2 threads. Without AVX and FMA colour moved by 7e-5 and \
          curvature by 8e-4, one step of the 16-bit floats that hold it.",
};

impl Golden {
    fn path(&self, extension: &str) -> PathBuf {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
        folder.join(format!("{}.{extension}", self.name))
    }

    /// Renders at a vector width; the image's path and the device.
    fn render(&self, width: u32) -> (PathBuf, Value) {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golden");
        std::fs::create_dir_all(&folder).unwrap();
        let [image, stats] = ["exr", "json"].map(|e| folder.join(format!("{}-{width}.{e}", self.name)));
        let mut command = command();
        command.arg("render").args(self.arguments).args(COMMON).args(["--device", DEVICE, "--validate"]);
        command.arg("-o").arg(&image).arg("--stats").arg(&stats);
        // The driver's cache does not tell widths apart: a shader of the other width would be run, and crash or corrupt.
        command.env("MESA_SHADER_CACHE_DIR", folder.join(format!("cache-{width}")));
        command.env("LP_NATIVE_VECTOR_WIDTH", width.to_string()).env("LP_NUM_THREADS", "2");
        run(command);
        let report: Value = serde_json::from_slice(&std::fs::read(stats).unwrap()).unwrap();
        (image, report["device"].clone())
    }

    fn check(&self) {
        if std::env::var_os("PASSBAND_BLESS").is_some() {
            return self.bless();
        }
        let read = |extension| {
            let path = self.path(extension);
            assert!(path.is_file(), "{} is missing: scripts/bless golden writes it", path.display());
            path
        };
        let golden = read_exr(&read("exr")).unwrap();
        let record: Value = serde_json::from_slice(&std::fs::read(read("json")).unwrap()).unwrap();
        assert_eq!(record["arguments"], self.record()["arguments"], "other arguments: scripts/bless golden");
        for width in [128, 256] {
            let (path, device) = self.render(width);
            let image = read_exr(&path).unwrap();
            let errors = if device["driver"] == record["driver"] {
                if width == 256 {
                    assert!(device["name"].as_str().unwrap().contains("256 bits"), "the width is not pinned: {device}");
                }
                differences(&image, &golden, &record["tolerance"])
            } else {
                let mut command = command();
                command.args(["compare", "--json"]).arg(&path).arg(self.path("exr"));
                let report: Value = serde_json::from_str(&run(command)).unwrap();
                resemblance(&image, &golden, report["flip"].as_f64().unwrap())
            };
            assert_eq!(errors, Vec::<String>::new(), "{} at {width} bits; see {}", self.name, path.display());
        }
    }

    /// All of the record but the device.
    fn record(&self) -> Value {
        let tolerance: serde_json::Map<_, _> =
            self.tolerance.iter().map(|&(layer, bound)| (layer.to_string(), json!(bound))).collect();
        let arguments: Vec<_> = self.arguments.iter().chain(&COMMON).collect();
        json!({ "arguments": arguments, "tolerance": tolerance, "why": self.why })
    }

    fn bless(&self) {
        let (image, device) = self.render(256);
        assert!(device["name"].as_str().unwrap().contains("llvmpipe"), "goldens are the software driver's, not {device}");
        let mut record = self.record();
        record["device"] = device["name"].clone();
        record["driver"] = device["driver"].clone();
        std::fs::create_dir_all(self.path("exr").parent().unwrap()).unwrap();
        std::fs::copy(image, self.path("exr")).unwrap();
        std::fs::write(self.path("json"), format!("{record:#}\n")).unwrap();
    }
}

fn command() -> Command {
    Command::new(env!("CARGO_BIN_EXE_passband"))
}

/// What a successful and silent command prints.
fn run(mut command: Command) -> String {
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.is_empty(), "{command:?}: {} {said}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

/// A channel's name, what was rendered and its golden.
type Channel<'a> = (&'a str, &'a [f32], &'a [f32]);

/// Channels side by side; or how the two images differ in shape.
fn paired<'a>(image: &'a LinearImage, golden: &'a LinearImage) -> Result<Vec<Channel<'a>>, Vec<String>> {
    let shape = |i: &LinearImage| {
        let mut names: Vec<_> = i.channels.iter().map(|c| c.0.clone()).collect();
        names.sort();
        (i.width, i.height, names)
    };
    if shape(image) != shape(golden) {
        return Err(vec![format!("expected {:?}, got {:?}", shape(golden), shape(image))]);
    }
    let pair =
        |(name, expected): &'a (String, Vec<f32>)| (name.as_str(), image.channel(name).unwrap_or(&[]), expected.as_slice());
    Ok(golden.channels.iter().map(pair).collect())
}

/// The layer that a channel belongs to, "" for colour and coverage.
fn layer(channel: &str) -> &str {
    channel.split_once('.').map_or("", |(layer, _)| layer)
}

/// Each pixel's error over its golden value plus the channel's mean; values that are not numbers are infinitely off.
fn errors(got: &[f32], expected: &[f32]) -> Vec<f64> {
    let mean = expected.iter().map(|v| f64::from(v.abs())).sum::<f64>() / expected.len() as f64;
    let error = |(g, e): (&f32, &f32)| {
        let error = (f64::from(*g) - f64::from(*e)).abs() / (f64::from(e.abs()) + mean).max(1e-30);
        if error.is_nan() { f64::INFINITY } else { error }
    };
    got.iter().zip(expected).map(error).collect()
}

/// The exact tier: channels with a pixel beyond their tolerance.
fn differences(image: &LinearImage, golden: &LinearImage, tolerance: &Value) -> Vec<String> {
    let channels = match paired(image, golden) {
        Ok(channels) => channels,
        Err(errors) => return errors,
    };
    let judge = |(name, got, expected): Channel<'_>| {
        let bound = tolerance.get(layer(name)).or(tolerance.get("")).and_then(Value::as_f64).unwrap_or(0.0);
        let (at, worst) =
            errors(got, expected).into_iter().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY));
        println!("{name}: {worst:.2e} of {bound:e}");
        let place = (at % golden.width as usize, at / golden.width as usize);
        (worst > bound).then(|| format!("{name}: pixel {place:?} is off by {worst:.2e}, above {bound:e}"))
    };
    channels.into_iter().filter_map(judge).collect()
}

/// The tier of other drivers.
fn resemblance(image: &LinearImage, golden: &LinearImage, flip: f64) -> Vec<String> {
    let channels = match paired(image, golden) {
        Ok(channels) => channels,
        Err(errors) => return errors,
    };
    let covered = golden.channel("A").map_or(0, |a| a.iter().filter(|a| **a > 0.0).count()) as f64;
    let judge = |(name, got, expected): Channel<'_>| {
        let share = errors(got, expected).into_iter().filter(|error| *error > OFF).count() as f64 / covered;
        (!layer(name).is_empty() && share > SHARE).then(|| format!("{name}: {share:.3} of the pixels are off, above {SHARE}"))
    };
    let mut found: Vec<_> = channels.into_iter().filter_map(judge).collect();
    found.extend((flip > FLIP).then(|| format!("FLIP is {flip:.4}, above {FLIP}")));
    found
}

#[test]
fn golden_trio() {
    TRIO.check();
}

#[test]
fn golden_mirror_antialiased() {
    MIRROR.check();
}

#[test]
fn golden_layers() {
    LAYERS.check();
}

#[test]
fn both_tiers_can_fail() {
    let ramp: Vec<f32> = (0..64).map(|i| i as f32 / 64.0).collect();
    let channels = ["R", "A", "depth.Z"].map(|name| (name.to_string(), ramp.clone()));
    let golden = LinearImage { width: 8, height: 8, channels: channels.to_vec() };
    let tolerance = json!({ "": 1e-3, "depth": 1e-1 });
    let change = |channel: usize, factor: f32, pixels: usize| {
        let mut image = golden.clone();
        image.channels[channel].1.iter_mut().skip(32).take(pixels).for_each(|v| *v *= factor);
        image
    };
    let count = |image: &LinearImage| (differences(image, &golden, &tolerance).len(), resemblance(image, &golden, 0.0).len());
    assert_eq!(count(&golden), (0, 0));
    assert_eq!(count(&change(0, 1.0005, 1)), (0, 0));
    assert_eq!(count(&change(0, 1.01, 1)), (1, 0));
    assert_eq!(count(&change(2, 1.05, 1)), (0, 0));
    assert_eq!(count(&change(2, 1.5, 32)), (1, 1));
    assert_eq!(count(&change(0, f32::NAN, 1)).0, 1);
    assert_eq!(resemblance(&golden, &golden, 0.02).len(), 1);
    let mut other = golden.clone();
    other.channels.pop();
    assert_eq!(count(&other), (1, 1));
}
