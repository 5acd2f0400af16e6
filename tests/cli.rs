//! The command as users call it: flags, errors and exit codes, what it writes and what it says.

#[path = "support/chosen_device.rs"]
mod chosen_device;

use chosen_device::DEVICE;
use passband::offline::image_io::{LinearImage, PngSamples, read_exr, read_hdr, read_png};
use passband::sampling::luminance;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a run said.
#[derive(Debug)]
struct Run {
    code: i32,
    stdout: String,
    stderr: String,
}

impl Run {
    /// Asserts success in silence and returns what was printed.
    fn quiet(self) -> String {
        assert_eq!((self.code, self.stderr.as_str()), (0, ""), "{self:?}");
        self.stdout
    }

    /// Asserts an exit code, one line that holds all of `parts`, and no output.
    fn refused(self, code: i32, parts: &[&str]) {
        let one_line = self.stderr.ends_with('\n') && self.stderr.lines().count() == 1;
        let named = self.stderr.starts_with("passband: ") && parts.iter().all(|part| self.stderr.contains(part));
        assert!(self.code == code && one_line && named && self.stdout.is_empty(), "expected {code}, {parts:?}: {self:?}");
    }
}

/// A folder of the test's own, in which the command runs.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli").join(test);
        if path.exists() {
            std::fs::remove_dir_all(&path).unwrap();
        }
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn run(&self, args: &[&str]) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_passband"));
        let output = command.args(args).current_dir(&self.0).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Run { code: output.status.code().unwrap(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    /// `render` on the reference driver under the validation layer, any message of which is a failure; small, at full rate and
    /// with the plain estimator unless told otherwise.
    fn render(&self, scene: &str, args: &[&str]) -> Run {
        let size: &[&str] = if args.contains(&"--size") { &[] } else { &["--size", "8x8"] };
        let validate: &[&str] = if args.contains(&"--validate") { &[] } else { &["--validate"] };
        let told = args.iter().any(|arg| ["--rate", "--estimator", "supersample"].contains(arg));
        let plain: &[&str] = if told { &[] } else { &["--rate", "full", "--estimator", "mis"] };
        self.run(&[&["render", scene, "--device", DEVICE], size, validate, plain, args].concat())
    }

    fn exr(&self, name: &str) -> LinearImage {
        read_exr(&self.0.join(name)).unwrap()
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&std::fs::read(self.0.join(name)).unwrap()).unwrap()
    }

    /// Names of all files, hidden ones too.
    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

#[test]
fn every_documented_flag_works_or_is_not_supported_yet() {
    let folder = Folder::new("flags");
    let filters = "point naive fixed toksvig toksvig-lobe lean lean-lobe leadr tk fournier4 fournier7 gmm gmm-unaligned vmf1 vmf4 \
                   vmf8 vmf clusters bruteforce supersample";
    let layers = "level weight samples bandwidth spread shaded lobes mip depth normal material curvature uv base residual \
                  fit-error decision";
    let choices = [
        ("--rate", "full half quarter luminance bandwidth oracle"),
        ("--estimator", "mis brdf brdf-random preconvolved cv residual"),
        ("--aa", "1 4 16"),
        ("--filter", filters),
        ("--aov", layers),
        ("--samples", "2 64"),
        ("--probes", "4"),
        ("--spc", "auto 2.5"),
        ("--seed", "0 4294967295"),
        ("--frames", "0..3"),
        ("--literal", "eq4 eq8 eq9 xu"),
        ("--set", "camera.fov_y=40"),
        ("--reference", "16"),
        ("--stats", "stats.json"),
        ("--size", "16384x1"),
    ];
    let (mut worked, mut later) = (Vec::new(), Vec::new());
    for (flag, values) in choices {
        for value in values.split_whitespace() {
            // What the prediction finds is there where there is one.
            let predicted = flag == "--literal" || ["bandwidth", "spread"].contains(&value) && flag == "--aov";
            let beside: &[&str] = match value {
                _ if predicted => &["--rate", "bandwidth"],
                "base" | "fit-error" => &["--estimator", "preconvolved"],
                "decision" => &["--estimator", "residual", "--rate", "bandwidth"],
                "residual" if flag == "--aov" => &["--estimator", "residual", "--rate", "bandwidth"],
                "lobes" => &["--filter", "vmf"],
                "shading-rate" => &["--rate", "half"],
                _ => &[],
            };
            let run = folder.render("furnace", &[&[flag, value, "-o", "out.exr"], beside].concat());
            if run.code == 0 {
                run.quiet();
                worked.push(format!("{flag} {value}"));
                let written = folder.files().into_iter().filter(|name| name.starts_with("out"));
                written.for_each(|name| std::fs::remove_file(folder.0.join(name)).unwrap());
            } else {
                run.refused(2, &["not supported yet", flag]);
                later.push(format!("{flag} {value}"));
            }
        }
    }
    println!("worked: {worked:?}\nlater: {later:?}");
    // What the main job promises.
    for flag in [
        "--rate full",
        "--rate half",
        "--rate quarter",
        "--aov level",
        "--estimator mis",
        "--estimator brdf-random",
        "--aa 16",
        "--filter point",
        "--filter tk",
        "--filter supersample",
        "--rate bandwidth",
        "--probes 4",
        "--spc 2.5",
        "--aov curvature",
        "--aov bandwidth",
        "--aov spread",
        "--aov fit-error",
        "--aov decision",
        "--frames 0..3",
        "--literal eq8",
    ] {
        assert!(worked.iter().any(|w| w == flag), "{flag}");
    }
    assert_eq!(folder.files(), ["stats.json"]);
}

/// What is not asked for is the best that goes with what is.
#[test]
fn defaults_follow_from_what_is_asked_for() {
    let folder = Folder::new("defaults");
    let cases: [(&[&str], [&str; 2]); 9] = [
        (&[], ["bandwidth", "residual"]),
        (&["--rate", "full"], ["full", "residual"]),
        (&["--rate", "half"], ["half", "mis"]),
        (&["--estimator", "brdf"], ["bandwidth", "brdf"]),
        (&["--estimator", "cv"], ["full", "cv"]),
        (&["--filter", "supersample"], ["full", "mis"]),
        (&["--probes", "8"], ["bandwidth", "mis"]),
        (&["--aov", "bandwidth"], ["bandwidth", "mis"]),
        (&["--filter", "vmf8"], ["bandwidth", "residual"]),
    ];
    for (args, expected) in cases {
        let common = ["render", "furnace", "--device", DEVICE, "--size", "8x8", "--samples", "4", "--stats", "stats.json"];
        folder.run(&[&common[..], args].concat()).quiet();
        let settings = &folder.json("stats.json")["settings"];
        assert_eq!(["rate", "estimator"].map(|key| settings[key].as_str().unwrap()), expected, "{args:?}");
    }
}

/// Wrong files, outputs and drivers are the rows of `tests/unbreakable`.
#[test]
fn wrong_arguments_end_with_2_and_leave_nothing() {
    let folder = Folder::new("wrong");
    std::fs::write(folder.0.join("key.toml"), "[camera]\nposition = [0, 0, 3]\nzoom = 2\n").unwrap();
    let before = folder.files();
    let cases: &[(&[&str], &[&str])] = &[
        (&["teapot"], &["scene", "trio", "`teapot`"]),
        (&["key.toml"], &["key.toml:3", "zoom"]),
        (&["furnace", "--size", "0x0"], &["--size", "1 to 16384", "0x0"]),
        (&["furnace", "--size", "99999x1"], &["--size", "1 to 16384", "99999x1"]),
        (&["furnace", "--size", "abc"], &["--size", "WxH", "abc"]),
        (&["furnace", "--size", "8"], &["--size", "WxH"]),
        (&["furnace", "-o", "out.jpg"], &["--output", ".exr, .png or .hdr", "out.jpg"]),
        (&["furnace", "-o", "out"], &["--output", "out"]),
        (&["furnace", "--aov", "albedo"], &["--aov", "depth", "`albedo`"]),
        (&["furnace", "--aov", "depth,"], &["--aov"]),
        (&["furnace", "--aov", "fit-error", "--estimator", "mis"], &["--aov fit-error", "preconvolved, cv or residual", "mis"]),
        (&["furnace", "--aov", "decision", "--rate", "half"], &["--aov decision", "preconvolved, cv or residual", "mis"]),
        (&["furnace", "--aov", "residual", "--estimator", "preconvolved"], &["--aov residual", "cv or residual"]),
        (&["furnace", "--samples", "0"], &["2 to 65536", "got 0"]),
        (&["furnace", "--samples", "1"], &["2 to 65536", "got 1"]),
        (&["furnace", "--samples", "0", "--estimator", "brdf"], &["1 to 65536", "got 0"]),
        (&["furnace", "--samples", "-1"], &["-1"]),
        (&["furnace", "--reference", "1"], &["--reference", "1"]),
        (&["furnace", "--aa", "2"], &["--aa", "1, 4 or 16", "got 2"]),
        (&["furnace", "--estimator", "guess"], &["--estimator", "brdf-random", "guess"]),
        (&["furnace", "--rate", "double"], &["--rate", "double"]),
        (&["furnace", "--filter", "box"], &["--filter", "clusters", "box"]),
        (&["furnace", "--filter", "supersample", "--rate", "half"], &["--rate", "full", "supersample"]),
        (&["furnace", "--filter", "supersample", "--aa", "4"], &["--aa", "supersample", "got 4"]),
        (&["furnace", "--filter", "supersample", "--estimator", "preconvolved"], &["--estimator", "mis or brdf"]),
        (&["furnace", "--filter", "supersample", "--aov", "depth"], &["--aov", "supersample"]),
        (&["furnace", "--filter", "supersample", "--reference", "16"], &["--reference", "supersample", "got 16"]),
        (&["furnace", "--filter", "supersample", "--samples", "1"], &["--samples", "2 to", "got 1"]),
        (&["furnace", "--set", "camera.fov_y"], &["--set", "PATH=VALUE"]),
        (&["furnace", "--set", "camera.fov_y=-3"], &["camera.fov_y", "-3"]),
        (&["furnace", "--set", "camera.zoom=2"], &["camera.zoom"]),
        (&["furnace", "--set", "objects.0.mesh=missing.obj"], &["missing.obj"]),
        (&["furnace", "--colour"], &["--colour"]),
        (&[], &["SCENE"]),
    ];
    for (args, parts) in cases {
        folder.run(&[&["render", "--device", DEVICE], *args].concat()).refused(2, parts);
        assert_eq!(folder.files(), before, "{args:?}");
    }
    folder.run(&[]).refused(2, &["subcommand"]);
    folder.run(&["draw"]).refused(2, &["draw"]);
}

#[test]
fn no_such_device_ends_with_3_and_leaves_nothing() {
    let folder = Folder::new("device");
    let render = ["render", "furnace", "--size", "8x8"];
    folder.run(&[&render[..], &["--device", "nonsense"]].concat()).refused(3, &["nonsense", DEVICE]);
    folder.run(&[&render[..], &["--device", "99"]].concat()).refused(3, &["99", DEVICE]);
    assert_eq!(folder.files(), Vec::<String>::new());
}

/// The number at `path` of a report.
fn number(report: &Value, path: &str) -> f64 {
    report.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: expected a number in {report}"))
}

#[test]
fn statistics_hold_every_field() {
    let folder = Folder::new("stats");
    let args = ["--size", "40x24", "--samples", "6", "--aa", "4", "--seed", "7", "--aov", "curvature", "--validate"];
    folder.render("furnace", &[&args[..], &["--stats", "stats.json", "-o", "out.exr"]].concat()).quiet();
    let report = folder.json("stats.json");
    assert_eq!(report["schema"], 1);
    assert_eq!(report["scene"], "furnace");
    assert_eq!(report["extent"], serde_json::json!([40, 24]));
    assert_eq!(report["validation_messages"], serde_json::json!([]));
    if DEVICE == "llvmpipe" {
        assert_eq!(report["device"]["type"], "cpu");
    }
    for field in ["name", "driver", "api"] {
        assert!(report["device"][field].as_str().is_some_and(|text| !text.is_empty()), "device.{field}: {report}");
    }
    assert!(report["device"]["name"].as_str().unwrap().contains(DEVICE));
    let settings = [("rate", "\"full\""), ("estimator", "\"mis\""), ("filter", "\"point\""), ("samples", "6"), ("aa", "4")];
    for (name, value) in settings.into_iter().chain([("seed", "7"), ("reference", "null")]) {
        assert_eq!(report["settings"][name].to_string(), value, "settings.{name}");
    }
    // The finest samples: the image's coverage is their mean over each pixel.
    let coverage: f64 = folder.exr("out.exr").channel("A").unwrap().iter().map(|a| f64::from(*a)).sum();
    assert_eq!(number(&report, "/pixels/covered"), (4.0 * coverage).round());
    assert_eq!(number(&report, "/pixels/shaded"), number(&report, "/pixels/by_level/-1"), "a quarter of a pixel each");
    assert_eq!(number(&report, "/samples/taken"), 6.0 * number(&report, "/pixels/shaded"));
    assert!(number(&report, "/samples/budget") >= number(&report, "/samples/taken"));

    let passes = report["passes"].as_array().unwrap();
    let names: Vec<_> = passes.iter().map(|pass| pass["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["gbuffer", "filter", "curvature", "classify", "shade", "resolve"]);
    for pass in passes {
        let [median, low, high] = ["ms_median", "ms_p10", "ms_p90"].map(|key| pass[key].as_f64().unwrap());
        assert!(0.0 <= low && low <= median && median <= high, "{pass}");
        assert!(pass["bytes"].as_u64().unwrap() > 0, "{pass}");
    }
    let [median, low, high] = ["median", "p10", "p90"].map(|key| number(&report, &format!("/frame_ms/{key}")));
    assert!(0.0 < low && low <= median && median <= high, "{report}");
    let longest = passes.iter().map(|pass| pass["ms_p10"].as_f64().unwrap()).fold(0.0, f64::max);
    assert!(longest > 0.0 && longest <= high, "a pass outlasts the frame: {report}");
    for name in ["loading", "pipelines", "materials", "environment", "meshes"] {
        assert!(number(&report, &format!("/setup_ms/{name}")) > 0.0, "setup_ms.{name}");
    }
    // At least the RGBA32F radiance of 80x48 samples.
    assert!(number(&report, "/memory_bytes") > 80.0 * 48.0 * 16.0);
}

#[test]
fn coarse_rates_count_by_output_level() {
    let folder = Folder::new("coarse");
    let args = ["--size", "64x48", "--samples", "2", "--aa", "4", "--rate", "half", "--aov", "level,weight,shaded", "--validate"];
    folder.render("trio", &[&args[..], &["--stats", "stats.json", "-o", "out.exr"]].concat()).quiet();
    let report = folder.json("stats.json");
    assert_eq!(report["settings"]["rate"], "half");
    let counts: BTreeMap<i32, u64> = serde_json::from_value(report["pixels"]["by_level"].clone()).unwrap();
    assert!(counts.keys().all(|level| (-1..=1).contains(level)) && counts[&1] > 100, "{counts:?}");
    assert_eq!(number(&report, "/pixels/shaded"), counts.values().sum::<u64>() as f64);
    assert!(number(&report, "/pixels/shaded") < 0.25 * number(&report, "/pixels/covered"));
    assert_eq!(number(&report, "/samples/taken"), 2.0 * number(&report, "/pixels/shaded"));
    let names: Vec<_> = report["passes"].as_array().unwrap().iter().map(|pass| pass["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["gbuffer", "filter", "level", "pyramid", "classify", "shade", "upsample", "resolve"]);
    let image = folder.exr("out.exr");
    let layer = |name: &str| image.channel(name).unwrap();
    for (i, alpha) in layer("A").iter().enumerate().filter(|(_, alpha)| **alpha == 1.0) {
        assert_eq!(layer("level.Y")[i], 1.0, "{i}: {alpha}");
        assert!((0.0..=1.0).contains(&layer("weight.Y")[i]) && [0.0, 1.0].contains(&layer("shaded.Y")[i]));
    }
    assert!(layer("weight.Y").contains(&1.0) && layer("shaded.Y").contains(&1.0));
}

#[test]
fn rates_to_compare_with_are_rendered() {
    let folder = Folder::new("compared-rates");
    for rate in ["luminance", "oracle"] {
        let args = ["--size", "64x48", "--samples", "4", "--rate", rate, "--validate", "--stats", "stats.json", "-o", "out.exr"];
        folder.render("trio", &args).quiet();
        let report = folder.json("stats.json");
        assert_eq!(report["settings"]["rate"], rate);
        assert!(number(&report, "/pixels/shaded") < number(&report, "/pixels/covered"), "{report}");
    }
}

#[test]
fn layers_land_in_the_exr_under_their_names() {
    let folder = Folder::new("layers");
    let all = "depth,normal,material,object,uv,footprint,curvature,shaded,samples";
    let args = ["--size", "48x32", "--samples", "4", "-o", "out.exr", "--aov"];
    folder.render("trio", &[&args[..], &[all]].concat()).quiet();
    let image = folder.exr("out.exr");
    let mut names: Vec<_> = image.channels.iter().map(|(name, _)| name.as_str()).collect();
    names.sort_unstable();
    let expected = "A B G R curvature.X curvature.Y depth.Z footprint.W footprint.X footprint.Y footprint.Z material.Y normal.X \
                    normal.Y normal.Z object.Y samples.Y shaded.Y uv.X uv.Y";
    assert_eq!(names, expected.split_whitespace().collect::<Vec<_>>());
    let at = |name: &str, i: usize| image.channel(name).unwrap()[i];
    let mut objects = std::collections::BTreeSet::new();
    for i in 0..48 * 32 {
        if at("A", i) == 0.0 {
            assert_eq!([at("depth.Z", i), at("shaded.Y", i), at("samples.Y", i)], [0.0; 3]);
            assert_eq!([at("material.Y", i), at("object.Y", i)], [-1.0; 2]);
            continue;
        }
        let normal = ["normal.X", "normal.Y", "normal.Z"].map(|name| at(name, i));
        assert!((normal.iter().map(|c| c * c).sum::<f32>() - 1.0).abs() < 1e-4, "{normal:?}");
        // The camera is 6.7 m away from three objects of about 1 m.
        assert!((4.0..9.0).contains(&at("depth.Z", i)), "{}", at("depth.Z", i));
        assert!((0.0..=1.0).contains(&at("uv.X", i)) && (0.0..=1.0).contains(&at("uv.Y", i)));
        assert!(at("curvature.X", i).abs() >= at("curvature.Y", i).abs());
        assert_eq!([at("shaded.Y", i), at("samples.Y", i)], [1.0, 4.0]);
        objects.insert((at("object.Y", i) as i32, at("material.Y", i) as i32));
    }
    // Materials are numbered by name.
    assert_eq!(objects.len(), 3, "{objects:?}");
    assert_eq!(objects.iter().map(|o| o.0).collect::<Vec<_>>(), [0, 1, 2]);
}

#[test]
fn built_in_scenes_are_listed_and_render_without_a_validation_message() {
    let folder = Folder::new("scenes");
    let listing = folder.run(&["scenes"]).quiet();
    let names = [
        "trio",
        "sphere",
        "bumpy-sphere",
        "torus-knot",
        "maps",
        "waves",
        "furnace",
        "cloth-plane",
        "atlas-plane",
        "pillow",
        "hall",
        "disk",
        "armour",
        "dunes",
    ];
    for name in names {
        let line = listing.lines().find(|line| line.split_whitespace().next() == Some(name));
        assert!(line.is_some_and(|line| line.split_whitespace().count() > 4), "{name} in {listing}");
        let all = ["--samples", "4", "--aa", "4", "--aov", "curvature,normal", "--validate", "--stats", "stats.json"];
        folder.render(name, &[&all[..], &["--size", "24x16"]].concat()).quiet();
        assert_eq!(folder.json("stats.json")["validation_messages"], serde_json::json!([]), "{name}");
        let image = folder.exr("out.exr");
        assert_eq!((image.width, image.height), (24, 16));
        assert!(image.rgb().unwrap().iter().flatten().all(|c| c.is_finite() && *c >= 0.0), "{name}");
        assert!(image.channel("A").unwrap().iter().any(|a| *a > 0.0), "{name}");
    }
    for reflectance in ["mirror-metal", "metallic-paint", "rough"] {
        assert!(listing.contains(reflectance), "{listing}");
    }
}

#[test]
fn formats_load_back_and_agree() {
    let folder = Folder::new("formats");
    for name in ["out.exr", "out.hdr", "out.png"] {
        folder.render("bumpy-sphere", &["--size", "32x24", "--samples", "16", "-o", name]).quiet();
    }
    assert_eq!(folder.files(), ["out.exr", "out.hdr", "out.png"]);
    let exr = folder.exr("out.exr");
    let rgb = exr.rgb().unwrap();
    let hdr = read_hdr(&folder.0.join("out.hdr")).unwrap();
    // A shared exponent: half a step of eight bits under the largest channel, which fills the upper half of them.
    for (a, b) in rgb.iter().zip(hdr.rgb().unwrap()) {
        let largest = a.iter().fold(0f32, |x, y| x.max(*y));
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= largest / 127.0), "{a:?} {b:?}");
    }
    let alpha = exr.channel("A").unwrap();
    let covered: Vec<f64> =
        rgb.iter().zip(alpha).filter(|(_, a)| **a > 0.0).map(|(&c, _)| luminance(glam::Vec3::from(c).as_dvec3())).collect();
    let exposure = 0.3 * covered.len() as f64 / covered.iter().sum::<f64>();
    let png = read_png(&folder.0.join("out.png")).unwrap();
    assert_eq!((png.width, png.height, png.channels), (32, 24, 4));
    let PngSamples::Bits8(bytes) = &png.samples else { panic!("expected 8 bits a sample") };
    for (i, pixel) in rgb.iter().enumerate() {
        for (c, linear) in pixel.iter().enumerate() {
            let x = (f64::from(*linear) * exposure).clamp(0.0, 1.0);
            let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            let got = f64::from(bytes[i * 4 + c]);
            assert!((got - encoded * 255.0).abs() <= 1.0, "pixel {i}, channel {c}: {got}, expected {}", encoded * 255.0);
        }
    }
}

#[test]
fn a_scene_key_can_be_overridden() {
    let folder = Folder::new("set");
    let render = |name: &str, sets: &[&str]| {
        let args = ["--size", "32x32", "--samples", "16", "-o", name];
        folder.render("furnace", &[&args[..], sets].concat()).quiet();
        let image = folder.exr(name);
        let sum = |channel| image.channel(channel).unwrap().iter().map(|v| f64::from(*v)).sum::<f64>();
        (sum("R"), sum("A"))
    };
    let plain = render("plain.exr", &[]);
    let brighter = render("brighter.exr", &["--set", "environment.intensity=2"]);
    assert!((brighter.0 / plain.0 - 2.0).abs() < 1e-5 && brighter.1 == plain.1, "{plain:?} {brighter:?}");
    let smaller = render("smaller.exr", &["--set", "camera.fov_y=72", "--set", "materials.ggx.reflectance.ggx.alpha=0.5"]);
    assert!(smaller.1 < 0.5 * plain.1, "{plain:?} {smaller:?}");
}

#[test]
fn two_runs_write_the_same_bytes_and_another_seed_others() {
    let folder = Folder::new("same");
    let args = ["--size", "40x40", "--samples", "8", "--aa", "4", "--aov", "curvature,footprint"];
    for (name, seed) in [("a.exr", "1"), ("b.exr", "1"), ("c.exr", "2")] {
        folder.render("trio", &[&args[..], &["--seed", seed, "-o", name]].concat()).quiet();
    }
    let [a, b, c] = ["a.exr", "b.exr", "c.exr"].map(|name| std::fs::read(folder.0.join(name)).unwrap());
    assert!(a == b, "two runs differ");
    assert!(a != c, "the seed does not matter");
}

#[test]
fn info_holds_every_device_against_the_requirements() {
    let folder = Folder::new("info");
    let report: Value = serde_json::from_str(&folder.run(&["info", "--json"]).quiet()).unwrap();
    assert_eq!(report["schema"], 1);
    assert!(number(&report, "/footprint_512x512_bytes") > 512.0 * 512.0 * 16.0);
    let devices = report["devices"].as_array().unwrap();
    let reference = devices.iter().find(|d| d["device"]["name"].as_str().unwrap().contains(DEVICE));
    let reference = reference.unwrap_or_else(|| panic!("the reference driver is not in {report}"));
    assert_eq!(reference["suitable"], true);
    let rows = reference["requirements"].as_array().unwrap();
    assert!(rows.len() > 5, "{reference}");
    for row in rows {
        assert!(["name", "needed", "found"].iter().all(|key| row[key].is_string()) && row["ok"] == true, "{row}");
    }
    let text = folder.run(&["info"]).quiet();
    assert!(text.contains(DEVICE) && text.contains("requirement") && text.contains("MiB"), "{text}");
}
