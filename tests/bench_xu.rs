//! `passband bench --suite xu` as users call it: small scenes, all of what it writes.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod bench;
}

use chosen_device::DEVICE;
use passband::Filter;
use passband::offline::image_io::write_png;
use serde_json::{Value, json};
use support::bench::{Folder, number};

/// Bumps, of which a pixel has several; the reflectance stands where it says so.
const SCENE: &str = r#"
[camera]
position = [0, 1, 1.19]
fov_y = 40
[environment]
builtin = "studio"
[[lights]]
type = "point"
position = [0.4, 1.1, -1]
intensity = 2
[[objects]]
builtin = "plane"
material = "surface"
scale = 1.7
[materials.surface]
reflectance = REFLECTANCE
normal_map = "bumps.png"
tiling = [24, 24]
"#;

/// What is compared: each kind of what is stored, and none.
const FILTERS: &str = "point,toksvig,vmf1,vmf8,clusters,fournier4,gmm";

/// Texels a side of the bumps.
const SIDE: u32 = 32;

/// Writes the scene `name` and its map into `folder`.
fn write(folder: &Folder, name: &str, reflectance: &str) {
    std::fs::write(folder.0.join(name), SCENE.replace("REFLECTANCE", reflectance)).unwrap();
    let texel = |i: u32| {
        let [x, y] = [i % SIDE, i / SIDE].map(|i| (i as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0);
        // A dome over most of each tile.
        let (x, y) = if x.hypot(y) < 0.9 { (0.7 * x, -0.7 * y) } else { (0.0, 0.0) };
        let z = (1.0 - x * x - y * y).sqrt();
        [x, y, z].map(|c| (127.5 * (c + 1.0)).round() as u8).into_iter().chain([255])
    };
    let texels: Vec<u8> = (0..SIDE * SIDE).flat_map(texel).collect();
    write_png(&folder.0.join("bumps.png"), SIDE, SIDE, &texels).unwrap();
}

/// The scene under one light.
fn under<'a>(report: &'a Value, light: &str) -> &'a Value {
    report["scenes"].as_array().unwrap().iter().find(|s| s["light"] == light).unwrap_or_else(|| panic!("not under {light}"))
}

fn row<'a>(scene: &'a Value, filter: &str) -> &'a Value {
    scene["rows"].as_array().unwrap().iter().find(|r| r["filter"] == filter).unwrap_or_else(|| panic!("no {filter}"))
}

#[test]
fn filters_are_compared_with_the_truth() {
    let folder = Folder::new("xu");
    let reflectance = "{ vmf = [{ mu = [0, 0, 1], kappa = 128, weight = 0.5 }] }";
    write(&folder, "small.toml", reflectance);
    let args = ["small.toml", "--suite", "xu", "--filters", FILTERS, "--size", "24x20", "--rounds", "2"];
    let (text, report) = folder.json(&[&args[..], &["--figures", "strips"]].concat());
    assert_eq!((&report["schema"], &report["suite"], &report["rounds"]), (&1.into(), &"xu".into(), &2.into()));
    assert!(report["device"]["name"].as_str().unwrap().contains(DEVICE));
    assert_eq!(report["scenes"].as_array().unwrap().len(), 2);
    let filters: Vec<_> = FILTERS.split(',').map(|name| json!(name)).collect();
    for light in ["point", "environment"] {
        let scene = under(&report, light);
        assert_eq!(
            (&scene["scene"], &scene["extent"], &scene["estimator"]),
            (&json!("small"), &json!([24, 20]), &json!("preconvolved"))
        );
        let rows = scene["rows"].as_array().unwrap();
        assert_eq!(rows.iter().map(|r| r["filter"].clone()).collect::<Vec<_>>(), filters);
        let truth = &scene["truth"];
        assert!(truth["samples"] == 4096 && truth["cached"] == 0 && number(&truth["pixels"]) > 300.0, "{truth}");
        let error = |filter: &str| number(&row(scene, filter)["errors"]["rel_l2"]);
        println!(
            "{light}: {}",
            filters.iter().map(|f| format!("{f} {:.3}", error(f.as_str().unwrap()))).collect::<Vec<_>>().join(", ")
        );
        assert!(error("vmf1") < 0.9 * error("point") && error("toksvig") < 0.9 * error("point"), "{scene}");
        assert!(number(&truth["noise"]["rel_l2"]) < 0.3 * error("vmf1"), "{truth}");
        let ranked = |f: &Value| number(&row(scene, f.as_str().unwrap())["errors"]["less_noise"]);
        let order: Vec<_> = scene["order"].as_array().unwrap().iter().map(ranked).collect();
        assert!(order.is_sorted() && order.len() == filters.len());
        for row in rows {
            check_row(row, light, number(&scene["texels"]));
        }
        let finer = number(&scene["supersampling"]["shade_ms"]["median"]);
        let ratio = finer / number(&row(scene, "vmf1")["cost"]["shade_ms"]["median"]);
        assert!((number(&row(scene, "vmf1")["cost"]["gain"]["ratio"]) / ratio - 1.0).abs() < 1e-9 && ratio > 1.0);
        let strip = format!("small-{light}.png");
        assert!(folder.0.join("strips").join(&strip).metadata().unwrap().len() > 10_000 && text.contains(&strip), "{text}");
    }
    assert_eq!(number(&under(&report, "point")["texels"]), f64::from(SIDE * SIDE));
    let aims = report["targets"].as_array().unwrap();
    let of = |part: &str| aims.iter().find(|t| t["what"].as_str().unwrap().contains(part));
    assert!(of("vmf8 over").is_none(), "these aims are of the suite's own scenes: {aims:?}");
    assert!(of("clusters over fournier4's").is_some() && of("clusters over vmf8's").is_some(), "{aims:?}");
    let clusters = |light: &str| number(&row(under(&report, light), "clusters")["errors"]["rel_l2"]);
    let cells = |light: &str| number(&row(under(&report, light), "vmf8")["errors"]["rel_l2"]);
    assert!(clusters("point") < cells("point") && clusters("environment") < 1.1 * cells("environment"));
    for what in ["small, point, 24x20", "Costs on the device", "from best to worst", "toksvig", "64x over shading"] {
        assert!(text.contains(what), "{what} is not in\n{text}");
    }

    // The second run finds the truths, and finds the same.
    assert_eq!(folder.kept("truth").len(), 2);
    const AGAIN: &str = "vmf1,clusters,gmm";
    let (_, again) = folder.json(&[&args[..3], &["--filters", AGAIN], &args[5..7], &["--rounds", "1"]].concat());
    for light in ["point", "environment"] {
        let (scene, former) = (under(&again, light), under(&report, light));
        assert_eq!(scene["truth"]["cached"], former["truth"]["samples"]);
        for filter in AGAIN.split(',') {
            let both = [scene, former].map(|scene| row(scene, filter));
            assert_eq!(
                (&both[0]["errors"], &both[0]["preconvolved"]),
                (&both[1]["errors"], &both[1]["preconvolved"]),
                "{filter}"
            );
        }
    }
}

fn check_row(row: &Value, light: &str, texels: f64) {
    assert!(row["refused"].is_null() && row["flicker"].is_null(), "{row}");
    // It draws lobes in any case.
    let random = row["filter"] == "bruteforce";
    let (errors, cost) = (&row["errors"], &row["cost"]);
    if let Some(mips) = cost["mips"].as_object() {
        let (rate, bytes) = (number(&mips["gb_per_s"]), number(&mips["bytes"]));
        if row["filter"] == "vmf1" {
            // 16 bytes a texel of each level and of the next.
            let side = |level: u32| f64::from((SIDE >> level) * (SIDE >> level));
            assert_eq!(bytes, (0..SIDE.ilog2()).map(|level| 16.0 * (side(level) + side(level + 1))).sum::<f64>());
        }
        assert!(
            (rate * 1e6 * number(&mips["ms"]["median"]) / bytes - 1.0).abs() < 1e-9 && number(&mips["of_copy"]) > 0.0,
            "{mips:?}"
        );
    }
    let all = ["rmse", "rel_l2", "color_error", "psnr", "flip", "energy"].map(|name| number(&errors[name]));
    assert!(all.iter().all(|v| *v > 0.0), "{errors}");
    let noise = number(&errors["noise"]);
    if light == "point" {
        assert!(errors["directions"] == 0 && (noise == 0.0) != random && row["preconvolved"].is_null(), "{row}");
    } else {
        assert!(number(&errors["directions"]) >= 512.0 && noise < 0.15 * number(&errors["rel_l2"]), "{row}");
        let ratio = number(&row["preconvolved"]["rel_l2"]) / number(&errors["rel_l2"]);
        assert!((0.5..2.0).contains(&ratio), "{row}");
    }
    let (shade, frame) = (number(&cost["shade_ms"]["median"]), number(&cost["frame_ms"]["median"]));
    assert!(0.0 < shade && shade < frame && number(&cost["gain"]["ratio"]) > 0.0, "{cost}");
    let stored = Filter::stored().any(|f| row["filter"] == f.name());
    assert_eq!(stored, !cost["set_up_ms"].is_null(), "{cost}");
    if stored {
        let set_up = number(&cost["set_up_ms"]["median"]);
        assert!((number(&cost["ns_a_texel"]) / (set_up * 1e6 / texels) - 1.0).abs() < 1e-9, "{cost}");
        // At least four components of 16 bits, and all mips of them.
        assert!(number(&cost["bytes_a_texel"]) > 8.0 * 1.33, "{cost}");
        assert!(number(&cost["gain_with_set_up"]["ratio"]) < number(&cost["gain"]["ratio"]), "{cost}");
    }
}

#[test]
fn tables_are_compared_as_far_as_filters_take_them() {
    let folder = Folder::new("xu-table");
    write(&folder, "table.toml", "{ builtin = \"metallic-paint\" }");
    let args = ["table.toml", "--suite", "xu", "--filters", "naive,vmf8,clusters", "--size", "12x12", "--rounds", "1"];
    let (text, report) = folder.json(&args);
    for light in ["point", "environment"] {
        let scene = under(&report, light);
        assert_eq!(scene["estimator"], "preconvolved");
        for filter in ["naive", "vmf8", "clusters"] {
            let row = row(scene, filter);
            if !row["refused"].is_null() {
                assert!(row["errors"].is_null() && text.contains(row["refused"].as_str().unwrap()), "{row}");
                continue;
            }
            assert_eq!(row["preconvolved"].is_null(), light == "point", "{row}");
            assert!(number(&row["errors"]["rel_l2"]) > 0.0, "{row}");
        }
    }
}

#[test]
fn motion_is_of_the_full_preset() {
    let folder = Folder::new("xu-full");
    write(&folder, "small.toml", "{ vmf = [{ mu = [0, 0, 1], kappa = 128, weight = 0.5 }] }");
    let args = [
        "small.toml",
        "--suite",
        "xu",
        "--filters",
        "point,vmf1,bruteforce",
        "--size",
        "12x12",
        "--rounds",
        "1",
        "--preset",
        "full",
    ];
    let (_, report) = folder.json(&args);
    for light in ["point", "environment"] {
        let scene = under(&report, light);
        assert!(number(&scene["flicker_noise"]["zoom"]) < 0.3 && number(&scene["flicker_noise"]["orbit"]) < 0.3, "{scene}");
        for filter in ["point", "vmf1", "bruteforce"] {
            let row = row(scene, filter);
            if filter == "bruteforce" {
                assert!(row["flicker"].is_null(), "{row}");
                continue;
            }
            assert!(number(&row["flicker"]["zoom"]) > 0.0 && number(&row["flicker"]["orbit"]) > 0.0, "{row}");
        }
        let flicker = |filter: &str| number(&row(scene, filter)["flicker"]["zoom"]);
        assert!(flicker("vmf1") < 0.8 * flicker("point"), "{light}: {} {}", flicker("vmf1"), flicker("point"));
    }
    // A still and two motions of 16 frames, under two lights.
    assert_eq!(folder.kept("truth").len(), 2 * (1 + 2 * 16));
}

#[test]
fn the_suite_tan_takes_the_same_order() {
    let folder = Folder::new("tan");
    write(&folder, "small.toml", "{ ggx = { alpha = 0.15, f0 = 0.9, albedo = 0 } }");
    let still = std::fs::read_to_string(folder.0.join("small.toml")).unwrap();
    let keys = "[{ frame = 0, position = [0, 1, 1.19] }, { frame = 3, position = [0, 0.7, 0.83] }]";
    std::fs::write(folder.0.join("small.toml"), format!("{still}\n[animation]\nframes = 4\ncamera = {keys}\n")).unwrap();
    let filters = "toksvig,clusters,bruteforce,point";
    let args = ["small.toml", "--suite", "tan", "--filters", filters, "--size", "8x8", "--rounds", "1"];
    let (text, report) = folder.json(&args);
    assert!(report["suite"] == "tan" && text.contains("suite tan") && text.contains("of clusters over"), "{text}");
    // Of its own scenes' aims there is none.
    assert!(report["targets"].as_array().unwrap().iter().all(|t| !t["what"].as_str().unwrap().contains("LEAN")), "{text}");
    // Microfacets are looked up as well as they are sampled.
    for filter in ["toksvig", "clusters", "bruteforce"] {
        let row = row(under(&report, "environment"), filter);
        let [looked_up, sampled] = ["preconvolved", "errors"].map(|of| number(&row[of]["energy"]));
        assert!((looked_up / sampled - 1.0).abs() < 0.2, "{row}");
    }
    // The camera moves: four frames of each of the filters that are compared so.
    let zooms = report["zooms"].as_array().unwrap();
    assert_eq!(zooms.len(), 2);
    for zoom in zooms {
        assert_eq!((&zoom["frames"], &zoom["extent"]), (&json!(4), &json!([8, 8])));
        let rows = zoom["rows"].as_array().unwrap();
        assert_eq!(rows.iter().map(|r| r["filter"].clone()).collect::<Vec<_>>(), ["toksvig", "clusters", "bruteforce"]);
        for row in rows {
            let [flicker, noise, less, jod] = ["flicker", "noise", "less_noise", "jod"].map(|of| number(&row["found"][of]));
            assert!(0.0 < flicker && less <= flicker && jod < 10.0 && (noise > 0.0) == (row["filter"] == "bruteforce"), "{row}");
        }
        assert!(number(&zoom["noise"]) > 0.0, "{zoom}");
    }
    for part in ["flicker, less noise, of clusters", "JOD of clusters", "on a 4-frame zoom", "4 frames of 8x8"] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
}

#[test]
fn what_the_suite_cannot_do_is_one_line() {
    let folder = Folder::new("xu-refused");
    for (args, part) in [(["--plots", "plots"], "--plots"), (["--report", "out.html"], "--report")] {
        let output = folder.run(&[&["--suite", "xu"], &args[..]].concat());
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.lines().count()), (Some(2), 1), "{said}");
        assert!(said.contains("not supported yet") && said.contains(part), "{said}");
    }
}
