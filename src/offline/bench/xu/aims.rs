//! What was aimed at, as far as it was measured.

use crate::offline::bench::equal::Is;
use crate::offline::bench::report::SpeedUp;
use crate::offline::bench::table::Target;
use crate::offline::bench::xu::cases::Light;
use crate::offline::bench::xu::report::{Row, SceneReport};

/// The paper's method: three levels of subdivision.
const OURS: &str = "vmf";
/// One of them.
const ONE: &str = "vmf1";
/// The finest alone.
const FINEST: &str = "vmf8";
/// The best filter of one lobe for each of the reflectance's.
const RIVAL: &str = "toksvig-lobe";

/// Which scenes: all, or the planes of these names.
const LOBED: &[&str] = &["cloth-plane", "bumps-plane", "disk-plane"];
const SMOOTH: &[&str] = &["dunes-plane"];

/// An aim of those of `scenes` of which `of` finds something, judged where it is worst.
pub(super) fn worst(
    scenes: &[SceneReport],
    what: String,
    aim: f64,
    at_least: bool,
    of: &dyn Fn(&SceneReport) -> Option<f64>,
) -> Option<Target> {
    let name = |scene: &SceneReport| format!("{} {}", scene.scene, scene.light.name());
    judged(scenes.iter().filter_map(|scene| Some((name(scene), of(scene)?))), what, aim, at_least)
}

/// An aim of what was `found`, by names, judged where it is worst.
pub(super) fn judged(found: impl Iterator<Item = (String, f64)>, what: String, aim: f64, at_least: bool) -> Option<Target> {
    let found: Vec<_> = found.collect();
    let one = |factor: f64| SpeedUp { factor, is: Is::Found };
    let mut sorted: Vec<(&str, SpeedUp)> = found.iter().map(|(name, factor)| (name.as_str(), one(*factor))).collect();
    sorted.sort_by(|a, b| a.1.factor.total_cmp(&b.1.factor));
    let worst = if at_least { sorted.first() } else { sorted.last() }?.1;
    Target::new(what, &sorted, worst, aim, at_least)
}

/// Of all scenes: each is judged where it is worst.
pub(super) fn targets(scenes: &[SceneReport]) -> Vec<Target> {
    let worst = |what, aim, at_least, of: &dyn Fn(&SceneReport) -> Option<f64>| worst(scenes, what, aim, at_least, of);
    let errors = |light: Light, names: &'static [&'static str], aim: f64| {
        let what = format!("rel_l2, less noise, of {FINEST} over {RIVAL}'s on {}, {}", names.join(", "), light.name());
        worst(what, aim, false, &move |scene| {
            let error = |filter| Some(scene.row(filter)?.errors.as_ref()?.less_noise);
            let judged = scene.light == light && names.contains(&scene.scene.as_str());
            ratio(error(FINEST).filter(|_| judged)?, error(RIVAL)?)
        })
    };
    let cost = |of: &'static dyn Fn(&Row) -> Option<f64>| move |scene: &SceneReport| of(scene.row(OURS)?);
    let set_up = |row: &Row| Some(row.cost.as_ref()?.set_up_ms?.median);
    let gain = cost(&|row| Some(row.cost.as_ref()?.gain?.ratio));
    let with_set_up = cost(&|row| Some(row.cost.as_ref()?.gain_with_set_up?.ratio));
    let over_lean = cost(&|row| Some(row.cost.as_ref()?.over_lean?.ratio));
    let build = |scene: &SceneReport| ratio(set_up(scene.row(OURS)?)?, set_up(scene.row(ONE)?)?);
    let all = [
        errors(Light::Point, LOBED, 0.85),
        errors(Light::Point, SMOOTH, 0.95),
        errors(Light::Environment, LOBED, 0.85),
        errors(Light::Environment, SMOOTH, 0.95),
        worst(format!("64x supersampling's shading over {OURS}'s, least of all scenes"), 8.0, true, &gain),
        worst(format!("{OURS}'s shading over LEAN's, most of all scenes"), 3.0, false, &over_lean),
        worst(format!("64x supersampling's shading over {OURS}'s with set-up, least of all scenes"), 2.0, true, &with_set_up),
        worst(format!("set-up of three subdivision levels ({OURS}) over one's ({ONE}), most of all scenes"), 1.5, false, &build),
    ];
    all.into_iter().flatten().collect()
}

pub(super) fn ratio(a: f64, b: f64) -> Option<f64> {
    Some(a / b).filter(|r| r.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Filter;
    use crate::offline::bench::quality::Noise;
    use crate::offline::bench::statistics::{Ratio, Summary};
    use crate::offline::bench::table::Verdict;
    use crate::offline::bench::xu::report::{Cost, Errors, TruthReport};

    fn row(filter: &'static str, rel_l2: f64, set_up: f64, gain: f64) -> Row {
        let times = |median| Summary { median, ..Summary::default() };
        let ratio = |ratio| Some(Ratio { ratio, interval: [ratio; 2] });
        Row {
            filter,
            errors: Some(Errors {
                rmse: 0.0,
                rel_l2,
                color_error: 0.0,
                psnr: 20.0,
                flip: 0.1,
                energy: 1.0,
                directions: 0,
                noise: 0.0,
                less_noise: rel_l2,
            }),
            cost: Some(Cost {
                set_up_ms: Some(times(set_up)),
                mips: None,
                shade_ms: times(1.0),
                frame_ms: times(2.0),
                gain: ratio(gain),
                gain_with_set_up: ratio(gain / 2.0),
                over_lean: ratio(1.5),
                ns_a_texel: None,
                bytes_a_texel: None,
            }),
            ..Row::new(Filter::Point)
        }
    }

    fn scene(name: &str, light: Light, rows: Vec<Row>) -> SceneReport {
        let noise = Noise { rmse: 0.0, rel_l2: 0.0, relmse: 0.0, psnr: 60.0 };
        let supersampling = row("point", 0.0, 0.0, 1.0).cost.unwrap();
        SceneReport {
            scene: name.into(),
            light,
            extent: [8, 8],
            truth: TruthReport { samples: 4096, cached: 0, noise, pixels: 64, margin: 10.0 },
            flicker_noise: None,
            texels: 1,
            estimator: "preconvolved",
            supersampling,
            order: Vec::new(),
            rows,
        }
    }

    #[test]
    fn each_aim_is_judged_where_it_is_worst() {
        let rows =
            |error, gain| vec![row("vmf8", error, 1.0, 1.0), row("toksvig-lobe", 0.5, 1.0, 1.0), row("vmf", 0.1, 3.0, gain)];
        let scenes = [
            scene("cloth-plane", Light::Point, rows(0.3, 20.0)),
            scene("disk-plane", Light::Point, rows(0.45, 10.0)),
            // Of no aim's errors, but of all costs.
            scene("hall", Light::Point, rows(5.0, 7.0)),
            scene("dunes-plane", Light::Environment, [rows(0.4, 30.0), vec![row("vmf1", 0.2, 2.5, 1.0)]].concat()),
        ];
        let found = targets(&scenes);
        let of = |what: &str| found.iter().find(|t| t.what.contains(what)).map(|t| (t.found.factor, t.worst.as_str(), t.verdict));
        assert_eq!(of("disk-plane, point"), Some((0.9, "disk-plane point", Verdict::Missed)));
        assert_eq!(of("dunes-plane, environment"), Some((0.8, "dunes-plane environment", Verdict::Passed)));
        assert_eq!(of("dunes-plane, point"), None, "it was not measured");
        assert_eq!(of("over vmf's, least"), Some((7.0, "hall point", Verdict::Missed)));
        assert_eq!(of("over vmf's with set-up"), Some((3.5, "hall point", Verdict::Passed)));
        assert_eq!(of("three subdivision levels"), Some((1.2, "dunes-plane environment", Verdict::Passed)));
        assert_eq!(of("over LEAN's").map(|t| t.2), Some(Verdict::Passed));
        assert_eq!(found.len(), 6);
    }
}
