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

/// Of all scenes: each is judged where it is worst.
pub(super) fn targets(scenes: &[SceneReport]) -> Vec<Target> {
    let worst = |what: String, aim: f64, at_least: bool, of: &dyn Fn(&SceneReport) -> Option<f64>| {
        let name = |scene: &SceneReport| format!("{} {}", scene.scene, scene.light.name());
        let found: Vec<(String, SpeedUp)> =
            scenes.iter().filter_map(|scene| Some((name(scene), SpeedUp { factor: of(scene)?, is: Is::Found }))).collect();
        let mut sorted: Vec<(&str, SpeedUp)> = found.iter().map(|(name, found)| (name.as_str(), *found)).collect();
        sorted.sort_by(|a, b| a.1.factor.total_cmp(&b.1.factor));
        let worst = if at_least { sorted.first() } else { sorted.last() }?.1;
        Target::new(what, &sorted, worst, aim, at_least)
    };
    let errors = |light: Light, names: &'static [&'static str], aim: f64| {
        let what = format!("rel_l2 of {FINEST} over {RIVAL}'s on {}, {}", names.join(", "), light.name());
        worst(what, aim, false, &move |scene| {
            let error = |filter| Some(scene.row(filter)?.errors.as_ref()?.rel_l2);
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

fn ratio(a: f64, b: f64) -> Option<f64> {
    Some(a / b).filter(|r| r.is_finite())
}
