//! The tables of a bench's gains: full against predicted rate, aims, and what environments cost.

use super::{aligned, bounded};
use passband::offline::bench::cases::Half;
use passband::offline::bench::environment::EnvironmentTimes;
use passband::offline::bench::joined;
use passband::offline::bench::reached::{Reached, Way};
use passband::offline::bench::report::{Report, SceneReport};
use passband::offline::bench::statistics::Ratio;
use passband::offline::bench::table::{Gained, Line, Target, Verdict};

/// Passes that have a column; the others are together in the last one.
const PASSES: [&str; 6] = ["gbuffer", "bandwidth", "pyramid", "classify", "shade", "upsample"];

/// Which scenes defaults were chosen on, and which they are judged on.
pub fn halves(report: &Report) -> String {
    let of = |half: Half| {
        let names = report.scenes.iter().filter(|s| s.half == Some(half)).map(|s| s.name.as_str());
        names.collect::<Vec<_>>().join(", ")
    };
    if report.scenes.iter().all(|scene| scene.half.is_none()) {
        return "scenes of your own: in neither half".into();
    }
    format!("tuning half, on which the one default was chosen: {}\njudged half: {}", of(Half::Tuning), of(Half::Judged))
}

/// Times, then gains, for each number of directions.
pub fn tables(lines: &[Line]) -> Vec<String> {
    let mut directions: Vec<u32> = lines.iter().map(|l| l.directions).collect();
    directions.dedup();
    let each = |n: u32| {
        let lines: Vec<&Line> = lines.iter().filter(|l| l.directions == n).collect();
        [format!("N = {n}, milliseconds\n{}", times(&lines)), format!("N = {n}, speed-ups\n{}", speeds(&lines))]
    };
    directions.into_iter().flat_map(each).collect()
}

fn half(line: &Line) -> String {
    line.half.map_or("", |half| if half == Half::Tuning { "tuning" } else { "judged" }).into()
}

fn times(lines: &[&Line]) -> String {
    let row = |line: &&Line| {
        let of = |name: &str| line.passes.iter().filter(|p| p.name == name).map(|p| p.ms).sum::<f64>();
        let others: f64 = line.passes.iter().filter(|p| !PASSES.contains(&p.name)).map(|p| p.ms).sum();
        let numbers = [line.full_ms, line.adaptive_ms].into_iter().chain(PASSES.map(of)).chain([others]);
        let numbers = numbers.map(|ms| format!("{ms:.2}"));
        let shaded = format!("{:.1} %", 100.0 * line.shaded_fraction);
        [line.scene.clone(), half(line)].into_iter().chain(numbers).chain([shaded]).collect()
    };
    let header: Vec<&str> =
        ["scene", "half", "full", "predicted"].into_iter().chain(PASSES).chain(["others", "shaded"]).collect();
    aligned(&header, 2, lines.iter().map(row))
}

fn speeds(lines: &[&Line]) -> String {
    let gained = |g: Option<Gained>| g.map_or(String::new(), |g| bounded(g.speed_up.factor, g.speed_up.is));
    let wide = |g: Gained| format!("{} [{:.2}, {:.2}]", bounded(g.speed_up.factor, g.speed_up.is), g.interval[0], g.interval[1]);
    let ratio = |r: Option<Ratio>| r.map_or(String::new(), |r| format!("{:.2}", r.ratio));
    let row = |line: &&Line| {
        let default = format!("bandwidth {}", line.directions);
        let setting = line.best.as_ref().map_or("", |b| match b.variant == default {
            true => "default",
            // Between the rate's name and the number of directions.
            false => b.variant.trim_start_matches("bandwidth ").rsplit_once(' ').map_or("", |(setting, _)| setting),
        });
        vec![
            line.scene.clone(),
            half(line),
            ratio(line.equal_directions),
            line.error_ratio.map_or(String::new(), |e| format!("{e:.2}")),
            line.equal_error.map_or(String::new(), wide),
            gained(line.best.as_ref().map(|b| b.gained)),
            setting.to_string(),
            gained(line.random),
            gained(line.mis_alone),
            gained(line.together),
            format!("{:.1} %", 100.0 * line.overhead),
            line.fall_back.map_or(String::new(), |r| format!("{:.3}", r.ratio)),
        ]
    };
    let header = [
        "scene",
        "half",
        "equal N",
        "rmse",
        "equal rmse",
        "best",
        "with",
        "random",
        "MIS alone",
        "together",
        "overhead",
        "fall-back",
    ];
    aligned(&header, 2, lines.iter().map(row))
}

/// What is as good as full rate, one line a scene and number of directions.
pub fn reached(lines: &[Reached]) -> String {
    let way = |way: &Option<Way>| {
        way.as_ref().map_or(String::new(), |w| {
            format!("{:.1} [{:.1}, {:.1}]", w.speed_up.ratio, w.speed_up.interval[0], w.speed_up.interval[1])
        })
    };
    let row = |line: &Reached| {
        let best = line.best().map_or(["none".into(), String::new(), String::new()], |w| {
            [w.variant.clone(), format!("{:.1}", w.psnr), format!("{:.1e}", w.relmse)]
        });
        let full = [format!("{:.1}", line.full_ms), format!("{:.1}", line.psnr), format!("{:.1e}", line.relmse)];
        let cost = line.base_cost.map_or(String::new(), |c| format!("{c:.1}"));
        let half = line.half.map_or("", |half| if half == Half::Tuning { "tuning" } else { "judged" });
        let start = [line.scene.clone(), half.into(), line.directions.to_string()];
        start.into_iter().chain(full).chain(line.ways.iter().map(way)).chain(best).chain([cost]).collect()
    };
    let header = [
        "scene",
        "half",
        "N",
        "full ms",
        "PSNR",
        "relMSE",
        "base",
        "cv",
        "residual",
        "best",
        "its PSNR",
        "its relMSE",
        "base cost",
    ];
    aligned(&header, 2, lines.iter().map(row))
}

/// Joined frames beside supersampling and each method alone.
pub fn joined(lines: &[joined::Line]) -> String {
    let over = |over: &joined::Over| {
        let [least, most] = over.interval;
        [format!("{} [{least:.2}, {most:.2}]", bounded(over.speed_up.factor, over.speed_up.is)), over.variant.clone()]
    };
    let row = |line: &joined::Line| {
        let own = [format!("{:.1}", line.ms), format!("{:.2}", line.psnr), format!("{:.1e}", line.relmse)];
        let start = [line.scene.clone(), line.variant.clone()].into_iter().chain(own);
        start.chain(over(&line.supersampling)).chain(over(&line.alone)).collect()
    };
    let header = ["scene", "variant", "ms", "PSNR", "relMSE", "supersampling", "by", "alone", "by"];
    aligned(&header, 2, lines.iter().map(row))
}

/// Each aim and whether it is met.
pub fn targets(targets: &[Target]) -> String {
    let row = |target: &Target| {
        let verdict = match target.verdict {
            Verdict::Passed => "passed",
            Verdict::Missed => "missed",
            Verdict::Undecided => "undecided",
        };
        let aim = format!("{} {}", if target.at_least { ">=" } else { "<=" }, target.aim);
        let found = match target.at_least {
            true => bounded(target.found.factor, target.found.is),
            // Shares and what is nearly 1: of times, which are no bounds.
            false => format!("{:.3}", target.found.factor),
        };
        vec![verdict.into(), target.what.clone(), found, aim, target.scenes.to_string(), target.worst.clone()]
    };
    aligned(&["", "", "found", "aim", "scenes", "worst in"], 2, targets.iter().map(row))
}

/// What an environment would cost if it were another one in every frame.
pub fn environments(scenes: &[SceneReport]) -> String {
    let row = |scene: &SceneReport| {
        let e = scene.environment.as_ref()?;
        let ms = [e.bandwidth_ms?, e.upload_ms, e.prepare_ms].map(|s| format!("{:.2}", s.median));
        let record = scene.row("bandwidth 64").map_or(String::new(), |row| format!("{:.3}", row.record_ms.median));
        let size = format!("{}x{}", e.extent[0], e.extent[1]);
        Some([scene.name.clone(), size].into_iter().chain(ms).chain([record]).collect())
    };
    let header =
        ["scene", "map", "environment_bandwidth ms", "upload ms", "CPU: tables ms", "CPU: recording a predicted frame ms"];
    aligned(&header, 1, scenes.iter().filter_map(row))
}

/// What an environment costs that is pre-convolved in every frame, beside the frame that looks it up.
pub fn rebuilt(scenes: &[SceneReport]) -> String {
    let rows = scenes.iter().flat_map(|scene| scene.rebuilt.iter().map(move |times| (scene, times)));
    let row = |(scene, e): (&SceneReport, &EnvironmentTimes)| {
        let ms = [e.prefilter_ms?, e.upload_ms, e.prepare_ms].map(|s| format!("{:.2}", s.median));
        let frame = scene.row("base 1").map_or(String::new(), |row| format!("{:.2}", row.frame_ms.median));
        let looked_up = format!("{:.1}", e.prefiltered_bytes? as f64 * 1e-6);
        let size = format!("{}x{}", e.extent[0], e.extent[1]);
        Some([scene.name.clone(), size].into_iter().chain(ms).chain([frame, looked_up]).collect())
    };
    let header =
        ["environment of", "map", "prefilter ms", "upload ms", "CPU: tables ms", "frame of the base ms", "looked up: MB"];
    aligned(&header, 1, rows.filter_map(row))
}
