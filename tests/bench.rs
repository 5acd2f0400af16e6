//! `passband bench` as users call it: small scenes, all of what it writes.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod bench;
}

use chosen_device::DEVICE;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::process::Stdio;
use std::time::Duration;
use support::bench::{Folder, number};

/// 64x64 pixels by the scene's own size.
const SCENE: &str = r#"
[camera]
position = [0, 0.5, 3.6]
fov_y = 36
size = [64, 64]
[environment]
builtin = "studio"
[[objects]]
builtin = "bumpy-sphere"
material = "paint"
detail = 64
[materials.paint]
reflectance = { ggx = { alpha = 0.2, f0 = 0.6, albedo = 0.2 } }
"#;

fn check_times(row: &Value) {
    let frame = &row["frame_ms"];
    let [low, median, high] = ["p10", "median", "p90"].map(|q| number(&frame[q]));
    assert!(0.0 < low && low <= median && median <= high && number(&frame["mad"]) >= 0.0, "{frame}");
    let [a, b] = [0, 1].map(|i| number(&frame["interval"][i]));
    assert!(low <= high && a <= median && median <= b, "{frame}");
    // Passes do not overlap on one queue of this driver; on a busy machine something may come between them.
    let sum = number(&row["passes_ms"]["median"]);
    assert!(sum <= 1.0001 * median && sum > 0.5 * median, "{sum} of {median}");
    for pass in row["passes"].as_array().unwrap() {
        let (bytes, ms) = (number(&pass["bytes"]), number(&pass["ms"]["median"]));
        assert!(bytes > 0.0 && ms > 0.0 && (number(&pass["gb_per_s"]) / (bytes * 1e-6 / ms) - 1.0).abs() < 1e-9, "{pass}");
    }
}

#[test]
fn rates_are_compared_with_full_rate_beside_their_error() {
    let folder = Folder::new("bagher");
    std::fs::write(folder.0.join("small.toml"), SCENE).unwrap();
    let args = ["small.toml", "--suite", "bagher", "--rounds", "3", "--plots", "plots", "--figures", "figures"];
    let (text, report) = folder.json(&args);
    assert_eq!(
        (&report["schema"], &report["suite"], &report["preset"], &report["rounds"]),
        (&1.into(), &"bagher".into(), &"quick".into(), &3.into())
    );
    assert!(report["device"]["name"].as_str().unwrap().contains(DEVICE));
    assert_eq!(report["complete"], true);
    let scene = &report["scenes"][0];
    assert_eq!((&scene["name"], &scene["half"], &scene["extent"]), (&"small".into(), &Value::Null, &serde_json::json!([64, 64])));
    let reference = &scene["reference"];
    assert!(number(&reference["margin"]) >= 8.0 && (0.7..1.4).contains(&number(&reference["agreement"])), "{reference}");
    assert_eq!(reference["cached"], 0);

    let rows = scene["variants"].as_array().unwrap();
    let row = |name: &str| rows.iter().find(|r| r["name"] == name).unwrap_or_else(|| panic!("no {name}"));
    rows.iter().for_each(check_times);
    assert_eq!(rows.first().unwrap()["name"], "full 64");
    assert_eq!(rows.last().unwrap()["name"], "control: full 64");
    assert_eq!(rows.first().unwrap()["over_first"]["ratio"], 1.0);
    let control = number(&rows.last().unwrap()["over_first"]["ratio"]);
    assert!((0.2..5.0).contains(&control), "{control}");
    let rmse = |name: &str| number(&row(name)["error"]["rmse"]);
    let shaded = |name: &str| number(&row(name)["shaded_fraction"]);
    // Errors fall with directions and rise with coarseness; the papers' own estimator is the worse one.
    assert!(rmse("full 16") > 1.5 * rmse("full 64") && rmse("full 64") > 1.5 * rmse("full 256"));
    assert!(rmse("quarter 64") > rmse("half 64") && rmse("half 64") > rmse("full 64"));
    assert!(rmse("full brdf-random 64") > rmse("full 64"));
    assert!(shaded("full 64") == 1.0 && shaded("half 64") < 0.7 && shaded("quarter 64") < shaded("half 64"));
    assert!(number(&row("full 64")["error"]["psnr"]) > number(&row("full 16")["error"]["psnr"]));
    // Nothing is compared with itself.
    let against = |name: &str| row(name)["against"].as_array().unwrap().clone();
    let with = |name: &str| against(name).iter().map(|a| a["estimator"].as_str().unwrap().to_string()).collect::<Vec<_>>();
    assert_eq!((with("full 64"), with("full brdf-random 64")), (vec!["brdf-random".into()], vec!["mis".into()]));
    for name in ["half 64", "quarter 256", "luminance 64", "oracle 64", "full brdf-random 64"] {
        let mis = against(name).into_iter().find(|a| a["estimator"] == "mis").unwrap();
        assert!(mis["estimator"] == "mis" && number(&mis["rmse"]["speed_up"]) > 0.0, "{name}: {mis}");
        let equal = &mis["rmse"];
        assert!(number(&equal["interval"][0]) <= number(&equal["interval"][1]), "{equal}");
        let gain = report["summary"]
            .as_array()
            .unwrap()
            .iter()
            .find(|g| g["variant"] == name && g["measure"] == "rmse" && g["estimator"] == "mis")
            .unwrap();
        assert_eq!((&gain["median"]["factor"], &gain["median"]["is"]), (&mis["rmse"]["speed_up"], &mis["rmse"]["speed_up_is"]));
    }
    check_rates(scene, &row);
    check_table(&report, &row);
    for figure in ["06", "11", "12", "14", "15"] {
        let path = folder.0.join("figures").join(format!("small-figure-{figure}.png"));
        let image = image::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).to_rgb8();
        let colours: std::collections::HashSet<_> = image.pixels().map(|p| p.0).collect();
        assert!(image.width() > 500 && image.height() > 200 && colours.len() > 100, "{figure}: {} colours", colours.len());
        assert!(text.contains(&format!("figures/small-figure-{figure}.png")), "{text}");
    }
    for what in ["small, 64x64", "control: full 64", "reference: ", "Speed-up at equal error", "plots/small.png"] {
        assert!(text.contains(what), "{what} is not in\n{text}");
    }
    assert!(folder.0.join("plots").join("small.png").metadata().unwrap().len() > 10_000);

    // The second run finds the reference; a damaged one is made again.
    let args = ["small.toml", "--suite", "bagher", "--rounds", "1"];
    let errors = |report: &Value| {
        report["scenes"][0]["variants"].as_array().unwrap().iter().map(|r| r["error"].clone()).collect::<Vec<_>>()
    };
    let (_, again) = folder.json(&args);
    assert_eq!(again["scenes"][0]["reference"]["cached"], reference["directions"]);
    assert_eq!(errors(&again).len(), errors(&report).len());
    let steady = |report: &Value| {
        // What follows the frame before depends on how many there were.
        let rows = report["scenes"][0]["variants"].as_array().unwrap().iter();
        rows.filter(|r| r["settings"]["rate"] != "luminance").map(|r| r["error"].clone()).collect::<Vec<_>>()
    };
    assert_eq!(steady(&again), steady(&report), "frames and references are deterministic");
    let [entry] = folder.kept("reference").try_into().unwrap();
    let whole = std::fs::read(&entry).unwrap();
    std::fs::write(&entry, &whole[..whole.len() / 2]).unwrap();
    let (_, third) = folder.json(&args);
    assert_eq!((&third["scenes"][0]["reference"], errors(&third)), (reference, errors(&again)));
    assert_eq!(std::fs::read(&entry).unwrap(), whole);

    // A whole entry of another image, as another version would have left it, is found out.
    std::fs::write(&entry, changed(&whole, |_, mean| 1.5 * mean)).unwrap();
    let (_, fourth) = folder.json(&args);
    assert_eq!((&fourth["scenes"][0]["reference"], errors(&fourth)), (reference, errors(&again)));
    // An interrupted one is continued: here nothing is in its second half yet.
    std::fs::write(&entry, changed(&whole, |half, mean| if half == 1 { 0.0 } else { mean })).unwrap();
    let (_, fifth) = folder.json(&args);
    let continued = &fifth["scenes"][0]["reference"];
    assert_eq!(2.0 * number(&continued["cached"]), number(&reference["directions"]));
    assert!(continued["directions"] == reference["directions"] && number(&continued["agreement"]) < 1.4, "{continued}");
}

/// All six rates beside each other, and their curves.
fn check_rates<'a>(scene: &Value, row: &impl Fn(&str) -> &'a Value) {
    for rate in ["full", "half", "quarter", "luminance", "bandwidth", "oracle"] {
        assert_eq!(row(&format!("{rate} 64"))["settings"]["rate"], rate);
    }
    let shaded = |name: &str| number(&row(name)["shaded_fraction"]);
    assert!(shaded("luminance 64") < 1.0 && shaded("oracle 64") < shaded("bandwidth 64"));
    assert!(shaded("bandwidth spc=1 64") < shaded("bandwidth 64") && shaded("bandwidth 64") < shaded("bandwidth spc=4 64"));
    assert_eq!((shaded("bandwidth falling back 64"), &row("bandwidth spc=4 64")["part"]), (1.0, &"setting".into()));
    assert!(number(&row("bandwidth 64")["record_ms"]["median"]) > 0.0);

    let curve = |rate: &str| scene["curves"].as_array().unwrap().iter().find(|c| c["rate"] == rate).unwrap()["points"].clone();
    let points = |rate: &str| {
        let point = |p: &Value| [number(&p["shaded_fraction"]), number(&p["error"])];
        curve(rate).as_array().unwrap().iter().map(point).collect::<Vec<_>>()
    };
    assert_eq!(points("full"), [[1.0, 0.0]]);
    let [half, quarter] = [points("half")[0], points("quarter")[0]];
    assert!(quarter[0] < half[0] && half[1] < quarter[1], "{half:?} {quarter:?}");
    for (ours, best) in points("bandwidth").iter().zip(points("oracle")) {
        assert!(best[0] <= ours[0] && best[1] <= ours[1], "{ours:?}, at best {best:?}");
    }
    let rising = points("bandwidth");
    assert!(rising.windows(2).all(|w| w[0][0] <= w[1][0] && w[0][1] >= w[1][1]) && rising.len() == 4, "{rising:?}");
    assert!(rising[0][0] < rising[3][0] && rising[0][1] > rising[3][1], "{rising:?}");
    let contrast = points("luminance");
    assert!(contrast.windows(2).all(|w| w[0][0] >= w[1][0]) && contrast[0][0] > contrast[4][0], "{contrast:?}");
    let environment = &scene["environment"];
    assert_eq!(environment["extent"], serde_json::json!([1024, 512]));
    assert!(["prepare_ms", "upload_ms", "bandwidth_ms"].iter().all(|t| number(&environment[t]["median"]) > 0.0));
}

/// What the table says is what its rows say.
fn check_table<'a>(report: &Value, row: &impl Fn(&str) -> &'a Value) {
    let lines = report["table"].as_array().unwrap();
    assert_eq!(lines.iter().map(|l| number(&l["directions"])).collect::<Vec<_>>(), [64.0, 256.0]);
    let line = &lines[0];
    let (full, adaptive) = (row("full 64"), row("bandwidth 64"));
    assert_eq!((&line["full_ms"], &line["adaptive_ms"]), (&full["frame_ms"]["median"], &adaptive["frame_ms"]["median"]));
    let speed = |row: &Value, estimator: &str| {
        let all = row["against"].as_array().unwrap();
        all.iter().find(|a| a["estimator"] == estimator).unwrap()["rmse"]["speed_up"].clone()
    };
    let factor = |field: &str| line[field]["speed_up"]["factor"].clone();
    assert_eq!(factor("equal_error"), speed(adaptive, "mis"));
    assert_eq!((factor("mis_alone"), factor("together")), (speed(full, "brdf-random"), speed(adaptive, "brdf-random")));
    assert_eq!(factor("random"), speed(row("bandwidth brdf-random 64"), "brdf-random"));
    let best = &line["best"];
    let others = ["bandwidth 64", "bandwidth spc=1 64", "bandwidth spc=4 64"];
    let most = others.iter().map(|name| number(&speed(row(name), "mis"))).fold(0.0, f64::max);
    assert_eq!(number(&best["gained"]["speed_up"]["factor"]), most);
    assert!(others.contains(&best["variant"].as_str().unwrap()));
    let extra: f64 = adaptive["passes"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|p| ["bandwidth", "pyramid", "classify", "upsample"].contains(&p["name"].as_str().unwrap()))
        .map(|p| number(&p["ms"]["median"]))
        .sum();
    assert!((number(&line["overhead"]) - extra / number(&line["full_ms"])).abs() < 1e-9);
    assert!(lines[1]["random"].is_null() && number(&line["fall_back"]["ratio"]) > 0.0);

    let targets = report["targets"].as_array().unwrap();
    let never = targets.iter().filter(|t| t["aim"] == 0.97).collect::<Vec<_>>();
    assert_eq!(never.len(), 2);
    for (target, line) in never.iter().zip(lines) {
        let ratio = number(&line["equal_directions"]["ratio"]);
        assert_eq!(number(&target["found"]["factor"]), ratio);
        assert_eq!(target["verdict"], if ratio >= 0.97 { "passed" } else { "missed" });
    }
}

#[test]
fn settings_of_the_scene_are_those_of_all_variants() {
    let folder = Folder::new("settings");
    std::fs::write(folder.0.join("own.toml"), format!("{SCENE}[settings]\nlmax = 1\ncombine = \"max\"\ngeometric = true\n"))
        .unwrap();
    let (_, report) = folder.json(&["own.toml", "--suite", "passes", "--rounds", "1"]);
    let rows = report["scenes"][0]["variants"].as_array().unwrap();
    for row in rows {
        let settings = &row["settings"];
        let own = serde_json::json!([settings["lmax"], settings["combine"], settings["geometric"]]);
        assert_eq!(own, serde_json::json!([1, "max", true]));
    }
    let levels = rows.iter().find(|r| r["name"] == "bandwidth 64").unwrap()["pixels"]["by_level"].as_object().unwrap();
    assert!(levels.keys().all(|level| level == "0" || level == "1"), "{levels:?}");
}

/// A cache entry of 64x64 pixels with other means, by half; a half whose means are all 0 counts no frames.
fn changed(entry: &[u8], mean: impl Fn(usize, f32) -> f32) -> Vec<u8> {
    const HALF: usize = 1 + 4 * 64 * 64;
    let mut words: Vec<u32> = entry[32..].as_chunks::<4>().0.iter().map(|w| u32::from_le_bytes(*w)).collect();
    assert_eq!((&words[..2], words.len()), ([64, 64].as_slice(), 3 + 2 * HALF));
    for (half, words) in words[3..].chunks_mut(HALF).enumerate() {
        words[1..].iter_mut().for_each(|w| *w = mean(half, f32::from_bits(*w)).to_bits());
        words[0] *= u32::from(words[1..].iter().any(|w| *w != 0));
    }
    let content: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
    [Sha256::digest(&content).to_vec(), content].concat()
}

#[test]
fn passes_are_timed_one_by_one() {
    let folder = Folder::new("passes");
    let (text, report) = folder.json(&["furnace", "sphere", "--suite", "passes", "--rounds", "2", "--size", "32x16"]);
    let names: Vec<_> = report["scenes"].as_array().unwrap().iter().map(|s| (&s["name"], &s["extent"])).collect();
    let extent = &serde_json::json!([32, 16]);
    assert_eq!(names, [(&"furnace".into(), extent), (&"sphere".into(), extent)]);
    for scene in report["scenes"].as_array().unwrap() {
        let rows = scene["variants"].as_array().unwrap();
        rows.iter().for_each(check_times);
        let passes = |row: &Value| {
            row["passes"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap().to_string()).collect::<Vec<_>>()
        };
        assert_eq!(passes(rows.first().unwrap()), passes(rows.last().unwrap()));
        assert!(passes(rows.first().unwrap()).contains(&"shade".to_string()));
        assert!(passes(&rows[1]).contains(&"upsample".to_string()) && scene["reference"].is_null());
    }
    assert!(text.contains("the first variant once more takes"), "{text}");
}

#[test]
fn an_interrupted_run_leaves_the_scenes_that_were_done() {
    let folder = Folder::new("interrupted");
    std::fs::write(folder.0.join("small.toml"), SCENE).unwrap();
    std::fs::write(folder.0.join("endless.toml"), SCENE.replace("size = [64, 64]", "size = [2048, 2048]")).unwrap();
    let args = ["small.toml", "endless.toml", "--suite", "passes", "--rounds", "10", "--json", "bench.json"];
    let path = folder.0.join("bench.json");
    let mut run = folder.command(&args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !path.exists() {
        assert_eq!(run.try_wait().unwrap(), None, "it ended before its first report");
        std::thread::sleep(Duration::from_millis(20));
    }
    run.kill().unwrap();
    run.wait().unwrap();
    let report: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let scenes: Vec<_> = report["scenes"].as_array().unwrap().iter().map(|s| s["name"].clone()).collect();
    assert_eq!((&report["complete"], scenes), (&false.into(), vec![Value::from("small")]));
}

#[test]
fn what_cannot_be_done_is_one_line() {
    let folder = Folder::new("refused");
    let cases: [(&[&str], &[&str]); 9] = [
        (&[], &["--suite"]),
        (&["--suite", "fast"], &["fast", "passes", "bagher"]),
        (&["--suite", "scaling"], &["not supported yet", "--suite"]),
        (&["--suite", "passes", "--rounds", "0"], &["--rounds"]),
        (&["--suite", "passes", "--report", "out.html"], &["not supported yet", "--report"]),
        (&["--suite", "passes", "trio", "nowhere"], &["scene", "nowhere"]),
        (&["--suite", "passes", "--json", "no/folder.json"], &["no/folder.json"]),
        (&["--suite", "bagher", "--plots", "file"], &["file"]),
        (&["--suite", "passes", "--figures", "figures"], &["not supported yet", "--figures"]),
    ];
    std::fs::write(folder.0.join("file"), "in the way").unwrap();
    for (args, parts) in cases {
        let output = folder.run(args);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.lines().count(), output.stdout.len()), (Some(2), 1, 0), "{args:?}: {said}");
        assert!(parts.iter().all(|part| said.contains(part)), "{args:?}: {said}");
    }
}
