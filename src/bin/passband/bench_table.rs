//! A bench's report as tables on the terminal.

#[path = "bench_gains.rs"]
mod gains;

pub(super) use gains::targets as aims;

use comfy_table::{CellAlignment, Table, presets};
use passband::offline::bench::cases::Half;
use passband::offline::bench::equal::{Equal, Is};
use passband::offline::bench::report::{Against, Gain, Report, Row, SceneReport, Skipped, SpeedUp};
use passband::offline::bench::statistics::{Ratio, Summary};

const LEGEND: &str = "of the first's: frame time over the first variant's, with its 95 % interval
speed-up: over full rate with mis where that has the same rmse, with its interval; at PSNR: where it has the same PSNR
error: rmse over that of full rate with mis in the same time; over random: speed-up over full rate with brdf-random
< and > are bounds: full rate was not measured further";

const JOINED_LEGEND: &str =
    "of the first's: frame time over the first variant's, with its 95 % interval; errors against the truth of filters";

/// What the table of gains has in its columns.
const COLUMNS: &str = "Full rate against the predicted rate with as many directions (Bagher et al. 2011, figure 13)
equal N: full over predicted frame time, and predicted over full rmse there; equal rmse: full over predicted frame time where full
rate has the predicted one's rmse, which is adaptivity's gain alone; best: the same of the best setting of each scene; random: of
brdf-random on both sides; MIS alone: full rate with mis against full rate with brdf-random at equal rmse; together: the predicted
rate with mis against full rate with brdf-random; overhead: bandwidth, pyramid, classify and upsample over full rate's frame";

/// What the table of the suite residual has in its columns.
const REACHED: &str = "What is as good as full rate with mis of N directions, by PSNR and relMSE both, and full rate's frame time over its own
base: light looked up; cv: with what is left estimated everywhere; residual: where it is worth it; base cost: the whole frame of looked-up
light, in directions a covered pixel of full rate";

/// What the table of the suite joined has in its columns.
const JOINED: &str = "Joined frames, and what takes as long as it takes to be as good by PSNR and relMSE both, over them
supersampling: the fastest of several numbers of samples a pixel and directions of each; alone: the fastest of the filter at full rate, and
of predicted rates and light that is looked up without it; > where none is as good: what the slowest takes";

/// The whole report.
pub fn text(report: &Report) -> String {
    let device = report.head.device.as_ref().map_or("none".into(), |d| format!("{} ({})", d.name, d.driver));
    let mut parts = vec![format!(
        "suite {}, preset {}, {} rounds, device {device}\n{:.0} s, {:.0} s of them for references",
        report.head.suite, report.head.preset, report.head.rounds, report.seconds.total, report.seconds.references
    )];
    for scene in &report.scenes {
        parts.push(if scene.reference.is_some() { compared(scene) } else { passes(scene) });
    }
    if report.scenes.iter().any(|scene| scene.reference.is_some()) {
        parts.push(if report.joined.is_empty() { LEGEND } else { JOINED_LEGEND }.into());
    }
    if !report.table.is_empty() {
        parts.push(format!("{COLUMNS}\n{}", gains::halves(report)));
        parts.extend(gains::tables(&report.table));
    }
    if !report.reached.is_empty() {
        parts.push(format!("{REACHED}\n{}\n\n{}", gains::halves(report), gains::reached(&report.reached)));
    }
    if !report.joined.is_empty() {
        parts.push(format!("{JOINED}\n{}", gains::joined(&report.joined)));
    }
    if !report.targets.is_empty() {
        parts.push(format!("Aims\n{}", gains::targets(&report.targets)));
    }
    if report.scenes.iter().any(|scene| scene.environment.is_some()) {
        parts.push(format!("A new environment in every frame would cost\n{}", gains::environments(&report.scenes)));
    }
    if report.scenes.iter().any(|scene| !scene.rebuilt.is_empty()) {
        parts.push(format!("An environment that is another one in every frame costs\n{}", gains::rebuilt(&report.scenes)));
    }
    if !report.summary.is_empty() {
        parts.push(format!("Speed-up at equal error against full rate, over scenes\n{}", summary(&report.summary)));
    }
    parts.extend(skipped(&report.skipped));
    parts.join("\n\n")
}

/// Scenes that lack files, if there are any.
pub(super) fn skipped(all: &[Skipped]) -> Option<String> {
    let lines = all.iter().map(|s| match s.needs.as_slice() {
        [] => format!("  {}: run it in the repository", s.scene),
        needs => format!("  {}: scripts/fetch-assets {}", s.scene, needs.join(" ")),
    });
    (!all.is_empty()).then(|| format!("Skipped, as files are missing:\n{}", lines.collect::<Vec<_>>().join("\n")))
}

fn title(scene: &SceneReport) -> String {
    let half = scene.half.map_or("", |half| if half == Half::Tuning { " (tuning half)" } else { " (judged half)" });
    format!("{}{half}, {}x{}", scene.name, scene.extent[0], scene.extent[1])
}

/// Columns from `left` on are numbers.
pub(super) fn aligned(header: &[&str], left: usize, rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(header);
    table.add_rows(rows);
    for column in table.column_iter_mut().skip(left) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.trim_fmt()
}

fn milliseconds(ms: &Summary) -> [String; 4] {
    [ms.median, ms.p10, ms.p90, ms.mad].map(|v| format!("{v:.3}"))
}

fn passes(scene: &SceneReport) -> String {
    let row = |variant: &Row| {
        let line = |pass: &str, ms: &Summary, rest: [String; 2]| {
            [variant.name.clone(), pass.into()].into_iter().chain(milliseconds(ms)).chain(rest).collect::<Vec<_>>()
        };
        let none = || [String::new(), String::new()];
        let of_pass = variant
            .passes
            .iter()
            .map(|p| line(p.name, &p.ms, [format!("{:.3}", p.bytes as f64 * 1e-6), format!("{:.2}", p.gb_per_s)]));
        let mut lines: Vec<_> = of_pass.collect();
        lines.push(line("all passes", &variant.passes_ms, none()));
        lines.push(line("frame", &variant.frame_ms, none()));
        lines
    };
    let header = ["variant", "pass", "ms", "p10", "p90", "MAD", "MB", "GB/s"];
    let control = scene
        .variants
        .last()
        .and_then(|row| row.over_first.as_ref())
        .map_or(String::new(), |r| format!("\nthe first variant once more takes {} of its time", ratio(r)));
    format!("{}\n{}{control}", title(scene), aligned(&header, 2, scene.variants.iter().flat_map(row)))
}

fn ratio(r: &Ratio) -> String {
    format!("{:.3} [{:.3}, {:.3}]", r.ratio, r.interval[0], r.interval[1])
}

fn bounded(value: f64, is: Is) -> String {
    let sign = match is {
        Is::Found => "",
        Is::AtLeast => ">",
        Is::AtMost => "<",
    };
    format!("{sign}{value:.2}")
}

fn speed(e: &Equal) -> String {
    bounded(e.speed_up, e.speed_up_is)
}

fn with_interval(e: &Equal) -> String {
    format!("{} [{:.2}, {:.2}]", speed(e), e.interval[0], e.interval[1])
}

fn compared(scene: &SceneReport) -> String {
    let row = |row: &Row| {
        let error = row.error.as_ref();
        let against = |random: bool, of: fn(&Equal) -> String, shown: bool| {
            let asked = |a: &&Against| random != (a.estimator == "mis");
            let equal = row.against.iter().find(asked).and_then(|a| if shown { a.psnr } else { a.rmse });
            equal.map_or(String::new(), |e| of(&e))
        };
        vec![
            row.name.clone(),
            format!("{:.3}", row.shaded_fraction),
            format!("{:.2}", row.frame_ms.median),
            format!("{:.2}..{:.2}", row.frame_ms.p10, row.frame_ms.p90),
            row.over_first.as_ref().map_or(String::new(), ratio),
            error.map_or(String::new(), |e| format!("{:.3e}", e.rmse)),
            error.map_or(String::new(), |e| format!("{:.2}", e.psnr)),
            against(false, with_interval, false),
            against(false, speed, true),
            against(false, |e| bounded(e.error_ratio, e.error_ratio_is), false),
            against(true, speed, false),
        ]
    };
    let header =
        ["variant", "shaded", "ms", "p10..p90", "of the first's", "rmse", "PSNR", "speed-up", "at PSNR", "error", "over random"];
    // Truths of filters are compared with otherwise.
    let shown = if scene.variants.iter().all(|row| row.against.is_empty()) { 7 } else { header.len() };
    let rows = scene.variants.iter().map(|variant| row(variant).into_iter().take(shown).collect());
    let mut text = format!("{}\n{}", title(scene), aligned(&header[..shown], 1, rows));
    if let Some(r) = &scene.reference {
        text += &format!(
            "\nreference: {} directions a pixel ({} kept), noise {:.2e} ({:.1} dB), {:.1}x below the least error",
            r.directions, r.cached, r.noise.rmse, r.noise.psnr, r.margin
        );
        text += &r.agreement.map_or(String::new(), |agreement| format!(", agreement {agreement:.2}"));
    }
    text
}

/// Estimators against each other are in the table of gains.
fn same_estimator(gain: &&Gain) -> bool {
    !gain.variant.starts_with("full") && gain.variant.contains("brdf-random") == (gain.estimator == "brdf-random")
}

fn summary(gains: &[Gain]) -> String {
    let row = |gain: &Gain| {
        let factor = |gain: SpeedUp| bounded(gain.factor, gain.is);
        vec![
            gain.half.map_or("", |half| if half == Half::Tuning { "tuning" } else { "judged" }).into(),
            gain.variant.clone(),
            gain.estimator.into(),
            gain.measure.into(),
            gain.scenes.to_string(),
            factor(gain.median),
            factor(gain.least),
            gain.least_scene.clone(),
            factor(gain.most),
            gain.most_scene.clone(),
        ]
    };
    let header = ["half", "variant", "against full", "equal", "scenes", "median", "least", "in", "most", "in"];
    aligned(&header, 4, gains.iter().filter(same_estimator).map(row))
}
