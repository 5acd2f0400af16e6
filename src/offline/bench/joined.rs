//! The suite joined: filters, predicted rates and light that is looked up, alone and together, beside what supersampling takes for as
//! small an error against the truth.

use crate::offline::bench::equal::Is;
use crate::offline::bench::report::{Row, SceneReport, SpeedUp};
use crate::offline::bench::runner::Part;
use crate::offline::bench::statistics::{Ratio, ratio_of_medians};
use crate::offline::bench::table::Target;
use serde::Serialize;

/// Scenes of maps, all built in, and whether the quick preset has them.
pub const SCENES: [(&str, bool); 7] = [
    ("cloth-plane", true),
    ("bumps-plane", false),
    ("disk-plane", false),
    ("dunes-plane", false),
    ("pillow", false),
    ("tablecloth", false),
    ("waves", false),
];
/// The filter that is joined with the rest, and that which filters nothing.
const JOINED: &str = "clusters";
const POINT: &str = "point";

/// How many times as fast the joined frame is to be as the fastest supersampling that is as good, on how many scenes.
const AIMS: [(&str, f64); 2] = [("residual", 15.0), ("preconvolved", 30.0)];
const AIMED_SCENES: usize = 3;

/// A joined variant in one scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// The scene.
    pub scene: String,
    /// The variant.
    pub variant: String,
    /// Its estimator.
    pub estimator: String,
    /// Its median frame time.
    pub ms: f64,
    /// Its error against the truth.
    pub psnr: f64,
    /// The same, relative.
    pub relmse: f64,
    /// The fastest that is as good by both, over it.
    pub supersampling: Over,
    /// The same of one method alone: a filter at full rate; no filter, at a predicted rate or with light looked up.
    pub alone: Over,
}

/// What is as good, and its frame time over that of what it is compared with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Over {
    /// The fastest that is as good; if none is, the slowest.
    pub variant: String,
    /// If none is as good, at least what the slowest takes.
    pub speed_up: SpeedUp,
    /// 95 % interval over rounds.
    pub interval: [f64; 2],
}

fn over<'a>(row: &Row, others: impl Iterator<Item = &'a Row>) -> Option<Over> {
    let own = row.error.as_ref()?;
    let time = |other: &Row| ratio_of_medians(&other.rounds_ms, &row.rounds_ms);
    let good = |other: &Row| other.error.as_ref().is_some_and(|e| e.psnr >= own.psnr && e.relmse <= own.relmse);
    let timed: Vec<(&Row, Ratio)> = others.filter_map(|other| Some((other, time(other)?))).collect();
    let by_time = |a: &&(&Row, Ratio), b: &&(&Row, Ratio)| a.1.ratio.total_cmp(&b.1.ratio);
    let fastest = timed.iter().filter(|(other, _)| good(other)).min_by(by_time);
    let (found, is) = match fastest {
        Some(found) => (found, Is::Found),
        None => (timed.iter().max_by(by_time)?, Is::AtLeast),
    };
    let speed_up = SpeedUp { factor: found.1.ratio, is };
    Some(Over { variant: found.0.name.clone(), speed_up, interval: found.1.interval })
}

/// Whether its samples are chosen by prediction, or light is looked up.
fn adapts(row: &Row) -> bool {
    row.setting("rate") == "bandwidth" || row.setting("estimator") != "mis"
}

/// Whether it is one method alone: a filter at full rate; a predicted rate or light that is looked up, of points.
fn is_alone(row: &Row) -> bool {
    let points = row.setting("filter") == POINT;
    if points { adapts(row) } else { !adapts(row) && row.setting("rate") == "full" }
}

/// Lines of all joined variants: of the filter, at a predicted rate or with light looked up.
pub fn lines(scenes: &[SceneReport]) -> Vec<Line> {
    let of_scene = |scene: &SceneReport| {
        let rows = |part| scene.variants.iter().filter(move |row| row.part == part);
        let joined = rows(Part::Compared).filter(|row| row.setting("filter") == JOINED && adapts(row));
        let line = |row: &Row| {
            let error = row.error.as_ref()?;
            Some(Line {
                scene: scene.name.clone(),
                variant: row.name.clone(),
                estimator: row.setting("estimator").into(),
                ms: row.frame_ms.median,
                psnr: error.psnr,
                relmse: error.relmse,
                supersampling: over(row, rows(Part::Supersampled))?,
                alone: over(row, rows(Part::Compared).filter(|other| is_alone(other)))?,
            })
        };
        joined.filter_map(line).collect::<Vec<_>>()
    };
    scenes.iter().flat_map(of_scene).collect()
}

/// The most of `of` that a variant of some estimator gains, in each scene, from the least.
fn best<'a>(lines: &'a [Line], estimator: Option<&str>, of: fn(&Line) -> &Over) -> Vec<(&'a str, SpeedUp)> {
    let mut all: Vec<(&str, SpeedUp)> = Vec::new();
    for line in lines.iter().filter(|line| estimator.is_none_or(|e| line.estimator == e)) {
        let own = of(line).speed_up;
        match all.iter_mut().find(|(scene, _)| *scene == line.scene) {
            Some((_, known)) if own.factor > known.factor => *known = own,
            Some(_) => (),
            None => all.push((line.scene.as_str(), own)),
        }
    }
    all.sort_by(|a, b| a.1.factor.total_cmp(&b.1.factor));
    all
}

/// What was aimed at.
pub fn targets(lines: &[Line]) -> Vec<Target> {
    let mut all = Vec::new();
    for (estimator, aim) in AIMS {
        let scenes = best(lines, Some(estimator), |line| &line.supersampling);
        let Some(others) = scenes.len().checked_sub(AIMED_SCENES) else { continue };
        let best = scenes.get(others..).unwrap_or_default();
        let what =
            format!("{estimator}: supersampling's frame time over its own, at equal PSNR and relMSE, third best of scenes");
        all.extend(best.first().and_then(|third| Target::new(what, best, third.1, aim, true)));
    }
    let scenes = best(lines, None, |line| &line.alone);
    let what = "each method's own frame time over the joined frame's, the same, least of all scenes".to_string();
    all.extend(scenes.first().and_then(|least| Target::new(what, &scenes, least.1, 1.0, true)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::bench::table::Verdict;

    fn line(scene: &str, estimator: &str, factor: f64) -> Line {
        let over = |factor| Over { variant: String::new(), speed_up: SpeedUp { factor, is: Is::Found }, interval: [factor; 2] };
        Line {
            scene: scene.into(),
            variant: format!("clusters {estimator}"),
            estimator: estimator.into(),
            ms: 10.0,
            psnr: 30.0,
            relmse: 1e-3,
            supersampling: over(factor),
            alone: over(factor / 10.0),
        }
    }

    #[test]
    fn aims_are_of_three_scenes_and_of_all() {
        let lines = [
            line("a", "residual", 20.0),
            line("a", "residual", 2.0),
            line("b", "residual", 16.0),
            line("c", "residual", 15.5),
            line("d", "residual", 3.0),
            line("d", "preconvolved", 12.0),
        ];
        let found = targets(&lines);
        // Of `preconvolved` there are too few.
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].found.factor, found[0].worst.as_str(), found[0].verdict), (15.5, "c", Verdict::Passed));
        // The best of each scene counts.
        assert_eq!((found[1].found.factor, found[1].worst.as_str(), found[1].scenes), (1.2, "d", 4));
    }
}
