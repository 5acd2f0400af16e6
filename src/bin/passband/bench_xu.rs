//! The report of the suites xu and tan as tables on the terminal.

use super::table::{aims, aligned, skipped};
use passband::offline::bench::statistics::{Ratio, Summary};
use passband::offline::bench::xu::report::{Cost, Errors, Moving, Report, Row, SceneReport, Zoom};

const ERRORS: &str = "Errors against the truth, over pixels that surfaces cover wholly
noise: the image's own, as a rel. L2; less noise: without what it and the truth's add to the error in the mean;
energy: mean radiance over the truth's; preconv.: rel. L2 where the environment is looked up as it is convolved beforehand, without noise of its own";

const COSTS: &str = "Costs on the device (Xu et al. 2017, table 1)
set-up: brdf_map, vmf_mips, cluster_moments and mixtures, on change; shading: filter and base (or shade), in every frame; 64x: one frame of filter point with 8
times the pixels a side; 64x over ...: its shading over the filter's, alone and with set-up; of LEAN's: shading over the filter lean's;
ns, bytes: of set-up, and of the materials' memory beyond that with filter point (maps with mips, tables of more roughnesses), a texel; mips GB/s: bytes that vmf_mips reads and writes, and the share of those that the device copies in that time";

const ZOOMS: &str = "Consecutive frames of the scene's own camera against as many truths
flicker: mean change of errors from frame to frame over the truth's mean; noise: the sequence's own; less noise: without what it and the truths'
add, as squares; JOD: ColorVideoVDP at 30 frames a second, 10 is no difference";

/// The whole report.
pub fn text(report: &Report) -> String {
    let device = report.head.device.as_ref().map_or("none".into(), |d| format!("{} ({})", d.name, d.driver));
    let mut parts = vec![format!(
        "suite {}, preset {}, {} rounds, device {device}\n{:.0} s, {:.0} s of them for truths",
        report.head.suite, report.head.preset, report.head.rounds, report.seconds.total, report.seconds.references
    )];
    parts.push(ERRORS.into());
    parts.extend(report.scenes.iter().map(errors));
    if !report.zooms.is_empty() {
        parts.push(ZOOMS.into());
        parts.extend(report.zooms.iter().map(zoom));
    }
    let copy = report
        .copy_gb_per_s
        .map_or(String::new(), |copy| format!("\nThe device copies {:.1} GB/s (read and written)", copy.median));
    parts.push(format!("{COSTS}{copy}"));
    parts.extend(report.scenes.iter().map(costs));
    if !report.targets.is_empty() {
        parts.push(format!("Aims\n{}", aims(&report.targets)));
    }
    parts.extend(skipped(&report.skipped));
    parts.join("\n\n")
}

fn title(scene: &SceneReport) -> String {
    format!("{}, {}, {}x{}", scene.scene, scene.light.name(), scene.extent[0], scene.extent[1])
}

fn errors(scene: &SceneReport) -> String {
    let of = |row: &Row, f: &dyn Fn(&Errors) -> String| row.errors.as_ref().map_or(String::new(), f);
    let row = |row: &Row| {
        vec![
            row.filter.into(),
            of(row, &|e| format!("{:.4}", e.rel_l2)),
            of(row, &|e| format!("{:.4}", e.less_noise)),
            of(row, &|e| format!("{:.4}", e.color_error)),
            of(row, &|e| format!("{:.2}", e.psnr)),
            of(row, &|e| format!("{:.4}", e.flip)),
            of(row, &|e| format!("{:.3}", e.energy)),
            of(row, &|e| if e.directions > 0 { format!("{:.4}", e.noise) } else { "-".into() }),
            row.preconvolved.as_ref().map_or(String::new(), |e| format!("{:.4}", e.rel_l2)),
            row.flicker.map_or(String::new(), |f| format!("{:.4}", f.zoom)),
            row.flicker.map_or(String::new(), |f| format!("{:.4}", f.orbit)),
            row.lobes.map_or(String::new(), |lobes| format!("{lobes:.2}")),
        ]
    };
    let header = [
        "filter",
        "rel. L2",
        "less noise",
        "color",
        "PSNR",
        "FLIP",
        "energy",
        "noise",
        "preconv.",
        "zoom flicker",
        "orbit flicker",
        "lobes/px",
    ];
    let mut text = format!("{}\n{}", title(scene), aligned(&header, 1, scene.rows.iter().map(row)));
    let truth = &scene.truth;
    text += &format!(
        "\ntruth: {} sub-samples a pixel ({} kept), noise {:.4} ({:.1} dB), {:.1}x below the least error, {} pixels judged",
        truth.samples, truth.cached, truth.noise.rel_l2, truth.noise.psnr, truth.margin, truth.pixels
    );
    if let Some(noise) = &scene.flicker_noise {
        text += &format!("; its noise alone flickers by {:.4} and {:.4}", noise.zoom, noise.orbit);
    }
    text += &format!("\nfrom best to worst: {}", scene.order.join(", "));
    for row in &scene.rows {
        text += &row.refused.as_ref().map_or(String::new(), |reason| format!("\n{}: {reason}", row.filter));
    }
    text
}

fn zoom(zoom: &Zoom) -> String {
    let rows = zoom.rows.iter().map(|row| {
        let of =
            |f: fn(&Moving) -> f64, places: usize| row.found.as_ref().map_or(String::new(), |m| format!("{:.places$}", f(m)));
        vec![
            row.filter.into(),
            of(|m| m.flicker, 4),
            of(|m| m.noise, 4),
            of(|m| m.less_noise, 4),
            of(|m| m.jod, 2),
            of(|m| m.color_error, 4),
        ]
    });
    let header = ["filter", "flicker", "noise", "less noise", "JOD", "color"];
    let mut text = format!(
        "{}, {}, {} frames of {}x{}\n{}\ntruths: {} sub-samples a pixel, whose noise flickers by {:.4}; JOD {:.2} of their halves",
        zoom.scene,
        zoom.light.name(),
        zoom.frames,
        zoom.extent[0],
        zoom.extent[1],
        aligned(&header, 1, rows),
        zoom.samples,
        zoom.noise,
        zoom.noise_jod
    );
    for row in &zoom.rows {
        text += &row.refused.as_ref().map_or(String::new(), |reason| format!("\n{}: {reason}", row.filter));
    }
    text
}

fn costs(scene: &SceneReport) -> String {
    let row = |name: &str, cost: &Cost| {
        let ms = |ms: &Summary| format!("{:.3}", ms.median);
        let ratio = |ratio: &Option<Ratio>| {
            ratio.map_or(String::new(), |r| format!("{:.2} [{:.2}, {:.2}]", r.ratio, r.interval[0], r.interval[1]))
        };
        vec![
            name.to_string(),
            cost.set_up_ms.as_ref().map_or(String::new(), ms),
            ms(&cost.shade_ms),
            ms(&cost.frame_ms),
            ratio(&cost.gain),
            ratio(&cost.gain_with_set_up),
            ratio(&cost.over_lean),
            cost.ns_a_texel.map_or(String::new(), |ns| format!("{ns:.1}")),
            cost.bytes_a_texel.map_or(String::new(), |bytes| format!("{bytes:.1}")),
            cost.mips.map_or(String::new(), |mips| format!("{:.1}", mips.gb_per_s)),
            cost.mips.and_then(|mips| mips.of_copy).map_or(String::new(), |share| format!("{share:.2}")),
        ]
    };
    let header = [
        "filter",
        "set-up ms",
        "shading ms",
        "frame ms",
        "64x over shading",
        "64x over both",
        "of LEAN's",
        "ns",
        "bytes",
        "mips GB/s",
        "of copies",
    ];
    let rows = scene.rows.iter().filter_map(|r| Some(row(r.filter, r.cost.as_ref()?)));
    let all = rows.chain([row("64x", &scene.supersampling)]);
    format!("{}, {}, {} texels\n{}", title(scene), scene.estimator, scene.texels, aligned(&header, 1, all))
}
