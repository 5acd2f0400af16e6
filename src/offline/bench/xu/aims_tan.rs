//! What was aimed at with clusters and with mixtures of Gaussians, as far as it was measured.

use crate::Filter;
use crate::offline::bench::table::Target;
use crate::offline::bench::xu::aims::{judged, ratio, worst};
use crate::offline::bench::xu::report::{Row, SceneReport, Zoom};

/// Ours, and the filters of which it is compared with the costs.
const OURS: &str = "clusters";
/// Every lobe kept: what no filter is better than but by chance.
const FLOOR: &str = "bruteforce";

/// All that aims name.
pub(super) const COMPARED: [&str; 8] = ["fixed", "toksvig", "vmf8", "gmm", "gmm-unaligned", OURS, "fournier4", FLOOR];

/// Planes, at any distance, on which it comes nearest.
const NEAREST: [&str; 2] = ["checker-plane", "bumps-plane"];
/// Carved, from any distance.
const DISK: [&str; 1] = ["disk"];
/// Of hemispheres, where they are small.
const SCALES: [&str; 2] = ["armour x6", "bumps-plane"];

/// Of all scenes: each is judged where it is worst.
pub(super) fn targets(scenes: &[SceneReport], zooms: &[Zoom]) -> Vec<Target> {
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
        worst("color error of clusters over toksvig's on disks", 0.48, &|scene| on(&DISK, &over("toksvig", colour), scene)),
        worst("color error of clusters over fixed's on armour x6 and bumps-plane", 0.35, &|scene| {
            on(&SCALES, &over("fixed", colour), scene)
        }),
        worst("color error of gmm over toksvig's on disks", 0.48, &|scene| {
            on(&DISK, &|scene| ratio(colour(scene.row("gmm")?)?, colour(scene.row("toksvig")?)?), scene)
        }),
        worst("color error of gmm over fixed's on armour x6 and bumps-plane", 0.35, &|scene| {
            on(&SCALES, &|scene| ratio(colour(scene.row("gmm")?)?, colour(scene.row("fixed")?)?), scene)
        }),
        worst("rel_l2, less noise, of gmm over gmm-unaligned's", 1.0, &|scene| {
            ratio(error(scene.row("gmm")?)?, error(scene.row("gmm-unaligned")?)?)
        }),
        worst("shading of clusters over vmf8's", 0.6, &over("vmf8", shading)),
        worst("shading of clusters over fournier4's", 0.25, &over("fournier4", shading)),
    ];
    all.into_iter().flatten().chain(moving(zooms)).collect()
}

/// Of zooms.
fn moving(zooms: &[Zoom]) -> Vec<Target> {
    let frames = zooms.iter().map(|zoom| zoom.frames).max().unwrap_or_default();
    let judged = |what: &str, aim: f64, at_least: bool, of: &dyn Fn(&Zoom) -> Option<f64>| {
        let found = zooms.iter().filter_map(|zoom| Some((format!("{} {}", zoom.scene, zoom.light.name()), of(zoom)?)));
        judged(found, format!("{what} on a {frames}-frame zoom"), aim, at_least)
    };
    let all = [
        judged("flicker, less noise, of clusters over bruteforce's", 1.4, false, &|zoom| {
            ratio(zoom.found(OURS)?.less_noise, zoom.found(FLOOR)?.less_noise)
        }),
        judged("JOD of clusters", 9.5, true, &|zoom| Some(zoom.found(OURS)?.jod)),
    ];
    all.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::bench::table::Verdict;
    use crate::offline::bench::xu::cases::Light;
    use crate::offline::bench::xu::report::ZoomRow;

    #[test]
    fn filters_that_are_compared_are_filters() {
        let names = Filter::ALL.map(Filter::name);
        assert!(COMPARED.iter().all(|name| names.contains(name)), "{COMPARED:?}");
    }

    #[test]
    fn zooms_are_judged_where_they_are_worst() {
        let row = |filter, flicker, jod| ZoomRow { filter, refused: None, found: None }.of([flicker, 0.0, 0.0], jod, 0.1);
        let zoom = |light, rows| {
            let scene = "disk".into();
            Zoom { scene, light, extent: [8; 2], frames: 64, samples: 1024, noise: 0.0, noise_jod: 10.0, rows }
        };
        let zooms = [
            zoom(Light::Point, vec![row(OURS, 0.12, 9.4), row(FLOOR, 0.1, 9.9)]),
            zoom(Light::Environment, vec![row(OURS, 0.15, 9.7), row(FLOOR, 0.1, 9.9)]),
        ];
        let found = moving(&zooms);
        let of = |i: usize| (found[i].found.factor, found[i].worst.as_str(), found[i].verdict);
        assert!(found[0].what.ends_with("64-frame zoom") && (of(0).0 - 1.5).abs() < 1e-12, "{found:?}");
        assert_eq!((of(0).1, of(0).2), ("disk environment", Verdict::Missed));
        assert_eq!(of(1), (9.4, "disk point", Verdict::Missed));
        assert!(moving(&[]).is_empty());
        assert_eq!(moving(&[zoom(Light::Point, vec![row(OURS, 0.12, 9.6)])]).len(), 1, "there is nothing to compare it with");
    }
}
