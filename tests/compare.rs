//! The metrics on images small enough to work out by hand, and the `compare` command's exit codes.
#![cfg(feature = "offline")]

use exr::prelude::*;
use passband::offline::metrics::{Comparison, Exposure, Metrics, Pair, Picture, compare};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::slice;

fn picture(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [f32; 3]) -> Picture {
    Picture { width, height, rgb: (0..width * height).map(|i| pixel(i % width, i / width)).collect() }
}

fn grey(value: f32) -> Picture {
    picture(8, 8, |_, _| [value; 3])
}

fn measure(a: &[Picture], b: &[Picture], mask: &[bool], exposure: Exposure, sequence: bool) -> Comparison {
    let pairs: Vec<Pair> = a.iter().zip(b).map(|(a, b)| Pair { a, b, mask }).collect();
    compare(&pairs, exposure, sequence).unwrap()
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-6 * b.abs().max(1e-3), "{a} is not {b}");
}

fn encode(v: f64) -> f64 {
    1.055 * v.powf(1.0 / 2.4) - 0.055
}

#[test]
fn linear_metrics_by_hand() {
    // Two masked pixels; the third would spoil every metric.
    let a = picture(3, 1, |x, _| [[1.0, 0.0, 0.5], [0.5, 1.0, 0.0], [9.0, 9.0, 9.0]][x as usize]);
    let b = picture(3, 1, |x, _| [[0.5, 0.0, 0.5], [0.5, 0.5, 1.0], [0.0, 0.0, 0.0]][x as usize]);
    let m = measure(&[a], &[b], &[true, true, false], Exposure::Factor(1.0), false).metrics;
    assert_eq!((m.frames, m.pixels, m.flicker, m.jod), (1, 2, None, None));
    // Differences .5 0 0 0 .5 -1.
    close(m.rmse, (1.5_f64 / 6.0).sqrt());
    close(m.rel_l2, (1.5_f64 / 2.0).sqrt());
    close(m.max_abs, 1.0);
    // Mean of B is .5: epsilon .0025.
    close(m.relmse, (2.0 * 0.25 / 0.2525 + 1.0 / 1.0025) / 6.0);
}

#[test]
fn display_metrics_by_hand() {
    let (a, b) = (grey(0.5), grey(0.25));
    let m = measure(slice::from_ref(&a), slice::from_ref(&b), &[true; 64], Exposure::Factor(1.0), false).metrics;
    let step = encode(0.5) - encode(0.25);
    close(m.color_error, step);
    close(m.psnr, -20.0 * step.log10());
    // Auto exposure brings B to 0.3, and A to 0.6 with it.
    let m = measure(&[a], &[b], &[true; 64], Exposure::Auto, false).metrics;
    close(m.exposure, 1.2);
    close(m.color_error, encode(0.6) - encode(0.3));
    // What is brighter than white is white.
    let m = measure(&[grey(3.0)], &[grey(2.0)], &[true; 64], Exposure::Factor(1.0), false).metrics;
    assert_eq!((m.color_error, m.psnr, m.flip), (0.0, f64::INFINITY, 0.0));
    close(m.rmse, 1.0);
    // One channel off by everything: a distance of 1 over sqrt 3.
    let red = picture(8, 8, |_, _| [1.0, 0.0, 0.0]);
    let m = measure(&[red], &[grey(0.0)], &[true; 64], Exposure::Auto, false).metrics;
    close(m.color_error, 1.0 / 3.0_f64.sqrt());
    close(m.psnr, -10.0 * (1.0_f64 / 3.0).log10());
    close(m.exposure, 1.0);
}

#[test]
fn flip_is_that_of_its_library_over_the_mask() {
    let (w, h) = (16, 12);
    let a = picture(w, h, |x, y| [0.1 * (x % 3) as f32, 0.08 * y as f32, 0.3]);
    let b = picture(w, h, |x, y| [0.1 * (x % 4) as f32, 0.08 * y as f32, 0.3]);
    let mask: Vec<bool> = (0..w * h).map(|i| i % 5 != 0).collect();
    let found = measure(slice::from_ref(&a), slice::from_ref(&b), &mask, Exposure::Factor(1.0), false);
    let srgb = |v: f32| if v <= 0.0031308 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    let bytes = |p: &Picture| p.rgb.iter().flatten().map(|v| (255.0 * srgb(*v)).round() as u8).collect::<Vec<_>>();
    let image = |p: &Picture| nv_flip::FlipImageRgb8::with_data(w, h, &bytes(p));
    let map = nv_flip::flip(image(&b), image(&a), 67.0).to_vec();
    let mut masked: Vec<f64> = map.iter().zip(&mask).filter(|(_, m)| **m).map(|(v, _)| f64::from(*v)).collect();
    close(found.metrics.flip, masked.iter().sum::<f64>() / masked.len() as f64);
    assert!(found.metrics.flip > 0.01 && found.metrics.flip < 1.0);
    // 153 masked pixels: rank 152 of 153 is the 99th percentile.
    masked.sort_by(f64::total_cmp);
    assert_eq!(masked.len(), 153);
    close(found.metrics.flip_p99, masked[151]);
    assert_eq!(found.map.values, map);
    // Black against white is the largest error there is.
    let extreme = measure(&[grey(1.0)], &[grey(0.0)], &[true; 64], Exposure::Factor(1.0), false).metrics;
    assert!(extreme.flip > 0.9, "{}", extreme.flip);
}

#[test]
fn identical_images_and_black_references() {
    let m = measure(&[grey(0.4)], &[grey(0.4)], &[true; 64], Exposure::Auto, true).metrics;
    assert_eq!((m.rmse, m.rel_l2, m.relmse, m.max_abs, m.flip, m.flip_p99, m.color_error), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0));
    assert_eq!((m.psnr, m.jod, m.flicker), (f64::INFINITY, Some(10.0), None));
    let json = serde_json::to_value(&m).unwrap();
    assert!(json["psnr"].is_null() && json.get("flicker").is_none());
    let black = measure(&[grey(0.0)], &[grey(0.0)], &[true; 64], Exposure::Auto, false).metrics;
    assert_eq!((black.rel_l2, black.relmse, black.exposure), (0.0, 0.0, 1.0));
    let lit = measure(&[grey(0.1)], &[grey(0.0)], &[true; 64], Exposure::Auto, false).metrics;
    assert_eq!((lit.rel_l2, lit.relmse), (f64::INFINITY, f64::INFINITY));
}

#[test]
fn sequences_flicker() {
    let b = vec![grey(0.5); 3];
    // The error goes 0.1, 0, 0.3: steps of 0.1 and 0.3 over a mean of 0.5.
    let a = [grey(0.6), grey(0.5), grey(0.8)];
    let m = measure(&a, &b, &[true; 64], Exposure::Auto, true).metrics;
    close(m.flicker.unwrap(), 0.2 / 0.5);
    assert_eq!((m.frames, m.pixels), (3, 192));
    let jod = m.jod.unwrap();
    assert!(jod < 9.9, "{jod}");
    // A constant error does not flicker.
    let steady = measure(&vec![grey(0.6); 3], &b, &[true; 64], Exposure::Auto, true).metrics;
    close(steady.flicker.unwrap(), 0.0);
    // Half the error is seen less.
    let faint = measure(&[grey(0.55), grey(0.5), grey(0.65)], &b, &[true; 64], Exposure::Auto, true).metrics;
    assert!(faint.jod.unwrap() > jod && faint.jod.unwrap() < 10.0, "{:?} {jod}", faint.jod);
    // Outside the mask nothing counts.
    let half: Vec<bool> = (0..64).map(|i| i < 32).collect();
    let bottom = |v: f32| picture(8, 8, |_, y| [if y < 4 { 0.5 } else { v }; 3]);
    let m = measure(&[bottom(0.1), bottom(0.9)], &b[..2], &half, Exposure::Auto, true).metrics;
    assert_eq!((m.rmse, m.flicker, m.jod), (0.0, Some(0.0), Some(10.0)));
}

#[test]
fn jod_is_that_of_its_library() {
    use colorvideovdp::{Color, Cvvdp, DisplayModel, Image, Options};
    let checks =
        |k: u32, size: u32| picture(16, 16, move |x, y| [if (x / size + y / size + k).is_multiple_of(2) { 0.2 } else { 0.4 }; 3]);
    let (a, b) = ([checks(0, 4), checks(1, 4)], [checks(0, 4), checks(0, 4)]);
    let found = measure(&a, &b, &[true; 256], Exposure::Factor(1.0), true).metrics.jod.unwrap();
    let srgb = |v: &f32| encode(f64::from(*v)) as f32;
    let image = |p: &Picture| Image::new(16, 16, 3, p.rgb.iter().flatten().map(srgb).collect()).unwrap();
    let metric = Cvvdp::new(DisplayModel::from_name("standard_4k").unwrap(), Options::default()).unwrap();
    let direct = metric.predict_video(&a.each_ref().map(image), &b.each_ref().map(image), 30.0, Color::Srgb).unwrap();
    assert!((found - f64::from(direct.jod)).abs() < 1e-4 && found < 9.5, "{found} {}", direct.jod);
}

#[test]
fn unusable_inputs_are_errors() {
    let fails = |a: &Picture, b: &Picture, mask: &[bool], sequence| {
        compare(&[Pair { a, b, mask }], Exposure::Auto, sequence).unwrap_err().to_string()
    };
    let small = picture(3, 3, |_, _| [0.5; 3]);
    assert!(fails(&small, &grey(0.5), &[true; 64], false).contains("size of frame 0: expected 8x8, got 3x3"));
    assert!(fails(&grey(0.5), &grey(0.5), &[false; 64], false).contains("mask"));
    assert!(fails(&grey(f32::NAN), &grey(0.5), &[true; 64], false).contains("finite"));
    assert!(fails(&small, &small, &[true; 9], true).contains("jod"));
    assert!(compare(&[], Exposure::Auto, false).is_err());
}

/// Runs `passband compare` in `folder`.
fn passband(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_passband")).arg("compare").args(args).current_dir(folder).output().unwrap()
}

/// Exit code and one line on standard error.
fn failure(folder: &Path, args: &[&str]) -> (i32, String) {
    let output = passband(folder, args);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(output.status.code() == Some(1) || output.stdout.is_empty());
    (output.status.code().unwrap(), text)
}

/// Writes an 8x8 EXR: `value` everywhere, alpha 1 in the upper half, and a layer `level` that is 1 in column 0.
fn write(folder: &Path, name: &str, value: f32) -> PathBuf {
    let path = folder.join(name);
    let plane = |name: &str, f: &dyn Fn(usize) -> f32| AnyChannel::new(name, FlatSamples::F32((0..64).map(f).collect()));
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for name in ["R", "G", "B"] {
        channels.push(plane(name, &|_| value));
    }
    channels.push(plane("A", &|i| if i < 32 { 1.0 } else { 0.0 }));
    channels.push(plane("level.Y", &|i| if i % 8 == 0 { 1.0 } else { 0.0 }));
    Image::from_channels((8, 8), AnyChannels::sort(channels)).write().to_file(&path).unwrap();
    path
}

#[test]
fn the_command_prints_gates_and_fails() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "a.exr", 0.5);
    write(folder, "b.exr", 0.25);
    write(folder, "nan.exr", f32::NAN);
    let run = passband(folder, &["a.exr", "b.exr"]);
    let text = String::from_utf8(run.stdout).unwrap();
    assert!(run.status.success() && Metrics::NAMES[..8].iter().all(|name| text.contains(name)), "{text}");

    let json = |args: &[&str]| {
        let run = passband(folder, args);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        serde_json::from_slice::<serde_json::Value>(&run.stdout).unwrap()
    };
    let found = json(&["a.exr", "b.exr", "--json"]);
    assert_eq!((&found["pixels"], &found["rmse"]), (&32.into(), &0.25.into()));
    assert!((found["exposure"].as_f64().unwrap() - 1.2).abs() < 1e-9);
    assert_eq!(json(&["a.exr", "b.exr", "--json", "--mask", "level"])["pixels"], 8);
    assert_eq!(json(&["a.exr", "b.exr", "--json", "--exposure", "0.5"])["exposure"], 0.5);
    assert!(json(&["a.exr", "a.exr", "--json", "--min", "psnr=99"])["psnr"].is_null());

    assert!(passband(folder, &["a.exr", "b.exr", "--max", "rmse=0.25", "--min", "rel_l2=1"]).status.success());
    let (code, text) = failure(folder, &["a.exr", "b.exr", "--max", "rmse=0.2"]);
    assert!(code == 1 && text.contains("rmse is 0.25, above --max 0.2"), "{text}");
    let (code, text) = failure(folder, &["a.exr", "b.exr", "--json", "--min", "psnr=60"]);
    assert!(code == 1 && text.contains("below --min 60"), "{text}");

    for (args, what) in [
        (&["a.exr", "missing.exr"][..], "missing.exr"),
        (&["a.exr", "b.txt"], "expected .exr, .hdr or .png, got .txt"),
        (&["nan.exr", "b.exr"], "64 pixels, first at (0, 0)"),
        (&["a.exr", "b.exr", "--mask", "depth"], "layer depth"),
        (&["a.exr", "b.exr", "--max", "rmse"], "METRIC=X"),
        (&["a.exr", "b.exr", "--max", "blur=1"], "blur"),
        (&["a.exr", "b.exr", "--max", "flicker=1"], "flicker"),
        (&["a.exr", "b.exr", "--exposure", "-1"], "exposure"),
        (&["a.exr", "b.exr", "--bogus"], "--bogus"),
        (&["a.exr"], "<B>"),
        (&["a.exr", "b_##.exr"], "b_##.exr"),
        (&["a.exr", "b.exr", "--diff", "no/such/folder.png"], "cannot write no/such/folder.png"),
    ] {
        let (code, text) = failure(folder, args);
        assert!(code == 2 && text.contains(what), "{args:?}: {code} {text}");
    }
}

#[test]
fn the_command_reads_png_and_hdr_and_writes_maps() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "b.exr", 1.0);
    image::RgbaImage::from_fn(8, 8, |_, y| image::Rgba([188, 188, 188, if y < 2 { 255 } else { 0 }]))
        .save(folder.join("a.png"))
        .unwrap();
    image::Rgb32FImage::from_pixel(8, 8, image::Rgb([0.5; 3])).save(folder.join("a.hdr")).unwrap();
    image::Rgb32FImage::from_pixel(8, 8, image::Rgb([4.0; 3])).save(folder.join("bright.hdr")).unwrap();
    image::RgbImage::new(4, 4).save(folder.join("small.png")).unwrap();
    let run = passband(folder, &["a.hdr", "a.png", "--json", "--diff", "map.png"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let found: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    // 188 is the byte nearest to a linear half; B's alpha leaves two rows.
    assert!(found["max_abs"].as_f64().unwrap() < 4e-3 && found["pixels"] == 16, "{found}");
    // Radiance above 1 is kept.
    let run = passband(folder, &["bright.hdr", "b.exr", "--json"]);
    assert_eq!(serde_json::from_slice::<serde_json::Value>(&run.stdout).unwrap()["max_abs"], 3.0);
    let map = image::open(folder.join("map.png")).unwrap();
    assert_eq!((map.width(), map.height()), (8, 8));
    assert_eq!(std::fs::read_dir(folder).unwrap().count(), 6, "a temporary file was left behind");
    let (code, text) = failure(folder, &["small.png", "b.exr"]);
    assert!(code == 2 && text.contains("small.png: expected 8x8 pixels, as b.exr, got 4x4"), "{text}");
    std::fs::write(folder.join("broken.exr"), b"not an image").unwrap();
    assert_eq!(failure(folder, &["broken.exr", "b.exr"]).0, 2);
}

#[test]
fn the_command_compares_sequences() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Frames 8 to 10: the number outgrows its padding.
    for (k, value) in [(8, 0.6), (9, 0.5), (10, 0.8)] {
        write(folder, &format!("a_{k}.exr"), value);
        write(folder, &format!("b_{k}.exr"), 0.5);
    }
    write(folder, "c_1.exr", 0.5);
    write(folder, "a_x.exr", 0.5);
    let run = passband(folder, &["a_#.exr", "b_#.exr", "--json", "--max", "flicker=0.41", "--min", "jod=1"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let found: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert!((found["flicker"].as_f64().unwrap() - 0.4).abs() < 1e-6 && found["jod"].as_f64().unwrap() < 9.9, "{found}");
    assert_eq!(found["frames"], 3);
    let still: serde_json::Value = serde_json::from_slice(&passband(folder, &["c_#.exr", "c_#.exr", "--json"]).stdout).unwrap();
    assert_eq!(still["jod"], 10.0);
    for (a, b) in [("a_#.exr", "b_8.exr"), ("c_#.exr", "b_#.exr")] {
        let (code, text) = failure(folder, &[a, b]);
        assert!(code == 2 && text.contains(a), "{text}");
    }
}
