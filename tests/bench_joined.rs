//! `passband bench --suite joined` as users call it: what filters, rates and light that is looked up gain together.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod bench;
}

use support::bench::{Folder, number};

/// 32x32 pixels of which each covers many texels.
const SCENE: &str = r#"
[camera]
position = [0, 1.2, 2.0]
fov_y = 30
size = [32, 32]
[environment]
builtin = "studio"
[[objects]]
builtin = "plane"
material = "paint"
[materials.paint]
reflectance = { ggx = { alpha = 0.2, f0 = 0.6, albedo = 0.2 } }
normal_map = "builtin:bumps"
tiling = [2, 2]
"#;

#[test]
fn joined_frames_are_judged_by_the_truth() {
    let folder = Folder::new("joined");
    std::fs::write(folder.0.join("small.toml"), SCENE).unwrap();
    let (text, report) = folder.json(&["small.toml", "--suite", "joined", "--rounds", "3", "--figures", "figures"]);
    let scene = &report["scenes"][0];
    let rows = scene["variants"].as_array().unwrap();
    let row = |name: &str| rows.iter().find(|r| r["name"] == name).unwrap_or_else(|| panic!("no {name}"));
    let psnr = |name: &str| number(&row(name)["error"]["psnr"]);
    // Supersampled images are averaged before they are judged, and filters are nearer than points.
    let covered = |name: &str| number(&row(name)["pixels"]["covered"]);
    let ratio = covered("supersampled 8x8 2") / covered("point full 64");
    assert!((60.0..68.0).contains(&ratio), "{ratio}");
    assert!(psnr("supersampled 8x8 2") > psnr("point full 64") + 3.0, "{}", psnr("supersampled 8x8 2"));
    assert!(psnr("clusters full 64") > psnr("point full 64") + 3.0, "{}", psnr("clusters full 64"));
    assert!(scene["reference"]["agreement"].is_null() && number(&scene["reference"]["directions"]) >= 4096.0);

    let lines = report["joined"].as_array().unwrap();
    let names: Vec<_> = lines.iter().map(|l| l["variant"].as_str().unwrap()).collect();
    assert!(
        ["clusters bandwidth 64", "clusters residual 16", "clusters base 1"].iter().all(|name| names.contains(name)),
        "{names:?}"
    );
    for line in lines {
        let own = row(line["variant"].as_str().unwrap());
        assert_eq!((&line["psnr"], &line["ms"]), (&own["error"]["psnr"], &own["frame_ms"]["median"]));
        for beside in ["supersampling", "alone"] {
            let over = &line[beside];
            let other = row(over["variant"].as_str().unwrap());
            let name = other["name"].as_str().unwrap();
            let alone = ["clusters full 64", "point bandwidth 64", "point residual 16", "point base 1"].contains(&name);
            assert!(if beside == "alone" { alone } else { name.starts_with("supersampled") }, "{line}");
            let good = ["psnr", "relmse"].map(|measure| (number(&other["error"][measure]), number(&line[measure])));
            let as_good = good[0].0 >= good[0].1 && good[1].0 <= good[1].1;
            assert_eq!(as_good, over["speed_up"]["is"] == "found", "{line}");
            assert!(number(&over["speed_up"]["factor"]) > 0.0);
        }
    }
    // The others are of three scenes.
    assert_eq!(report["targets"].as_array().unwrap().len(), 1);

    let figure = image::open(folder.0.join("figures/small-together.png")).unwrap().to_rgb8();
    let colours: std::collections::HashSet<_> = figure.pixels().map(|p| p.0).collect();
    assert!(figure.width() > 1000 && colours.len() > 100, "{} colours", colours.len());
    for what in ["Joined frames", "supersampled 8x8 2", "figures/small-together.png"] {
        assert!(text.contains(what), "{what} is not in\n{text}");
    }
}
