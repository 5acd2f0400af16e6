//! What was aimed at with clusters and with mixtures of Gaussians, as far as it was measured.

use crate::Filter;
use crate::offline::bench::table::Target;
use crate::offline::bench::xu::aims::{ratio, worst};
use crate::offline::bench::xu::report::{Row, SceneReport};

/// Ours, and the filters of which it is compared with the costs.
const OURS: &str = "clusters";
/// Every lobe kept: what no filter is better than but by chance.
const FLOOR: &str = "bruteforce";

/// Planes, at any distance, on which it comes nearest.
const NEAREST: [&str; 2] = ["checker-plane", "bumps-plane"];

/// Of all scenes: each is judged where it is worst.
pub(super) fn targets(scenes: &[SceneReport]) -> Vec<Target> {
    let worst = |what: &str, aim: f64, of: &dyn Fn(&SceneReport) -> Option<f64>| worst(scenes, what.into(), aim, false, of);
    let error = |row: &Row| Some(row.errors.as_ref()?.less_noise);
    let colour = |row: &Row| Some(row.errors.as_ref()?.color_error);
    let shading = |row: &Row| Some(row.cost.as_ref()?.shade_ms.median);
    let over = |rival: &'static str, of: fn(&Row) -> Option<f64>| {
        move |scene: &SceneReport| ratio(of(scene.row(OURS)?)?, of(scene.row(rival)?)?)
    };
    let on = |names: &'static [&'static str], of: &dyn Fn(&SceneReport) -> Option<f64>, scene: &SceneReport| {
        of(scene).filter(|_| names.iter().any(|name| scene.scene.starts_with(name)))
    };
    let best = |scene: &SceneReport| {
        let few = Filter::ALL.into_iter().filter(|f| f.most_lobes() <= 8 && f.name() != OURS);
        let least = few.filter_map(|f| error(scene.row(f.name())?)).fold(f64::INFINITY, f64::min);
        ratio(error(scene.row(OURS)?)?, least)
    };
    let all = [
        worst("rel_l2, less noise, of clusters over the least of all other filters with at most 8 lobes", 1.2, &best),
        worst("rel_l2, less noise, of clusters over bruteforce's", 1.6, &over(FLOOR, error)),
        worst("rel_l2, less noise, of clusters over bruteforce's on checker-plane and bumps-plane", 1.2, &|scene| {
            on(&NEAREST, &over(FLOOR, error), scene)
        }),
        worst("color error of clusters over toksvig's on disk-plane", 0.48, &|scene| {
            on(&["disk-plane"], &over("toksvig", colour), scene)
        }),
        worst("color error of clusters over fixed's on bumps-plane", 0.35, &|scene| {
            on(&["bumps-plane"], &over("fixed", colour), scene)
        }),
        worst("color error of gmm over toksvig's on disk-plane", 0.48, &|scene| {
            on(&["disk-plane"], &|scene| ratio(colour(scene.row("gmm")?)?, colour(scene.row("toksvig")?)?), scene)
        }),
        worst("color error of gmm over fixed's on bumps-plane", 0.35, &|scene| {
            on(&["bumps-plane"], &|scene| ratio(colour(scene.row("gmm")?)?, colour(scene.row("fixed")?)?), scene)
        }),
        worst("rel_l2, less noise, of gmm over gmm-unaligned's", 1.0, &|scene| {
            ratio(error(scene.row("gmm")?)?, error(scene.row("gmm-unaligned")?)?)
        }),
        worst("shading of clusters over vmf8's", 0.6, &over("vmf8", shading)),
        worst("shading of clusters over fournier4's", 0.25, &over("fournier4", shading)),
    ];
    all.into_iter().flatten().collect()
}
