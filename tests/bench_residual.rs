//! `passband bench --suite residual` as users call it: what it measures of light that is looked up, and what it draws.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod bench;
}

use serde_json::Value;
use support::bench::{Folder, number};

/// 64x64 pixels by the scene's own size; a mirror that no fit by lobes is good for at grazing view angles.
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
reflectance = { ggx = { alpha = 0.05, f0 = 0.6, albedo = 0.2 } }
"#;

#[test]
fn what_is_looked_up_is_compared_timed_and_drawn() {
    let folder = Folder::new("residual");
    std::fs::write(folder.0.join("small.toml"), SCENE).unwrap();
    let args = ["small.toml", "--suite", "residual", "--rounds", "3", "--plots", "plots", "--figures", "figures"];
    let (text, report) = folder.json(&args);
    let scene = &report["scenes"][0];
    let rows = scene["variants"].as_array().unwrap();
    let row = |name: &str| rows.iter().find(|r| r["name"] == name).unwrap_or_else(|| panic!("no {name}"));
    let psnr = |name: &str| number(&row(name)["error"]["psnr"]);
    assert!(psnr("cv 16") > psnr("full 16") + 3.0, "{} {}", psnr("cv 16"), psnr("full 16"));
    assert!(psnr("residual 64") > psnr("bandwidth 64"), "{} {}", psnr("residual 64"), psnr("bandwidth 64"));
    assert!(number(&row("residual 64")["shaded_fraction"]) < 1.0);
    assert_eq!(row("base 1")["samples"]["taken"], 0);

    let lines = report["reached"].as_array().unwrap();
    assert_eq!(lines.iter().map(|l| number(&l["directions"])).collect::<Vec<_>>(), [16.0, 64.0, 256.0]);
    for line in lines {
        let full = row(&format!("full {}", line["directions"]));
        assert_eq!((&line["psnr"], &line["full_ms"]), (&full["error"]["psnr"], &full["frame_ms"]["median"]));
        for way in line["ways"].as_array().unwrap().iter().filter(|w| !w.is_null()) {
            assert!(number(&way["psnr"]) >= number(&line["psnr"]) && number(&way["relmse"]) <= number(&line["relmse"]), "{line}");
        }
    }
    assert_eq!(report["targets"].as_array().unwrap().len(), 5);

    // An environment that is another one in every frame, at two sizes.
    let rebuilt = scene["rebuilt"].as_array().unwrap();
    let sizes: Vec<_> = rebuilt.iter().map(|r| r["extent"].clone()).collect();
    assert_eq!(sizes, [serde_json::json!([1024, 512]), serde_json::json!([512, 256])]);
    let ms = |i: usize, time: &str| number(&rebuilt[i][time]["median"]);
    assert!(ms(0, "prefilter_ms") > ms(1, "prefilter_ms") && ms(1, "prefilter_ms") > 0.0, "{rebuilt:?}");
    assert!(["upload_ms", "prepare_ms"].iter().all(|time| ms(0, time) > 0.0));
    // Two images with mips: four times the texels take four times the bytes, but for irradiance.
    let bytes = |i: usize| number(&rebuilt[i]["prefiltered_bytes"]);
    assert!(bytes(0) > 20e6 && bytes(0) < 4.1 * bytes(1) && bytes(0) > 3.5 * bytes(1), "{rebuilt:?}");
    assert!(scene["environment"] == Value::Null && rebuilt[0]["bandwidth_ms"] == Value::Null);

    let figure = image::open(folder.0.join("figures/small-parts.png")).unwrap().to_rgb8();
    let colours: std::collections::HashSet<_> = figure.pixels().map(|p| p.0).collect();
    assert!(figure.width() > 1000 && figure.height() > 700 && colours.len() > 1000, "{} colours", colours.len());
    assert!(folder.0.join("plots/small.png").metadata().unwrap().len() > 10_000);
    for what in ["What is as good", "another one in every frame", "1024x512", "figures/small-parts.png", "plots/small.png"] {
        assert!(text.contains(what), "{what} is not in\n{text}");
    }
}
