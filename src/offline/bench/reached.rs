//! The table of the suite residual: what is as good as full rate with mis, by two measures at once, and how much sooner.

use crate::offline::bench::cases::Half;
use crate::offline::bench::equal::Is;
use crate::offline::bench::report::{Row, SceneReport, SpeedUp, middle};
use crate::offline::bench::runner::Part;
use crate::offline::bench::statistics::{Ratio, ratio_of_medians};
use crate::offline::bench::table::Target;
use serde::Serialize;

/// Directions of full rate that are to be reached.
const DIRECTIONS: [u32; 3] = [16, 64, 256];
/// Estimators that look light up, each with a column.
pub const WAYS: [&str; 3] = ["preconvolved", "cv", "residual"];

/// Full rate at one number of directions in one scene, and what is as good.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reached {
    /// The scene.
    pub scene: String,
    /// Its half; absent for scenes of the user's.
    pub half: Option<Half>,
    /// Directions of full rate.
    pub directions: u32,
    /// Its median frame time.
    pub full_ms: f64,
    /// Its error.
    pub psnr: f64,
    /// Its error, relative.
    pub relmse: f64,
    /// The fastest variant of each of [`WAYS`] with default settings that is as good by both, if there is one.
    pub ways: Vec<Option<Way>>,
    /// Time of the frame that only looks light up, over that of a direction of full rate at all covered pixels.
    pub base_cost: Option<f64>,
}

/// A variant that is as good.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Way {
    /// Its name.
    pub variant: String,
    /// Full rate's frame time over its own.
    pub speed_up: Ratio,
    /// Its error.
    pub psnr: f64,
    /// Its error, relative.
    pub relmse: f64,
}

impl Reached {
    /// The fastest of all ways.
    pub fn best(&self) -> Option<&Way> {
        self.ways.iter().flatten().max_by(|a, b| a.speed_up.ratio.total_cmp(&b.speed_up.ratio))
    }
}

/// Lines of all scenes, by directions.
pub fn lines(scenes: &[SceneReport]) -> Vec<Reached> {
    let each = |directions: u32| scenes.iter().filter_map(move |scene| line(scene, directions));
    DIRECTIONS.into_iter().flat_map(each).collect()
}

fn line(scene: &SceneReport, directions: u32) -> Option<Reached> {
    let full = scene.row(&format!("full {directions}"))?;
    let error = full.error.as_ref()?;
    // What would suit a scene is known only afterwards.
    let is = |row: &Row, way: &str| row.part == Part::Compared && row.setting("estimator") == way;
    let way = |name: &&str| {
        let reached = scene.variants.iter().filter(|row| is(row, name)).filter_map(|row| {
            let own = row.error.as_ref().filter(|own| own.psnr >= error.psnr && own.relmse <= error.relmse)?;
            let speed_up = ratio_of_medians(&full.rounds_ms, &row.rounds_ms)?;
            Some(Way { variant: row.name.clone(), speed_up, psnr: own.psnr, relmse: own.relmse })
        });
        reached.max_by(|a, b| a.speed_up.ratio.total_cmp(&b.speed_up.ratio))
    };
    Some(Reached {
        scene: scene.name.clone(),
        half: scene.half,
        directions,
        full_ms: full.frame_ms.median,
        psnr: error.psnr,
        relmse: error.relmse,
        ways: WAYS.iter().map(way).collect(),
        base_cost: base_cost(scene),
    })
}

/// What a direction takes follows from two numbers of them.
fn base_cost(scene: &SceneReport) -> Option<f64> {
    let [few, many] = [16, 256].map(|n| Some(scene.row(&format!("full {n}"))?.frame_ms.median));
    let direction = (many? - few?) / 240.0;
    (direction > 0.0).then_some(scene.row("base 1")?.frame_ms.median / direction)
}

/// What was aimed at, on the judged half if scenes have halves. A scene in which nothing is as good counts as 0.
pub fn targets(lines: &[Reached]) -> Vec<Target> {
    let has_halves = lines.iter().any(|l| l.half == Some(Half::Judged));
    let judged = |l: &&Reached| !has_halves || l.half == Some(Half::Judged);
    let found = |factor: f64| SpeedUp { factor, is: Is::Found };
    let half = if has_halves { "the judged half" } else { "scenes" };
    let mut all = Vec::new();
    for (directions, least, median) in [(64, 6.0, 12.0), (256, 10.0, 15.0)] {
        let of = |l: &Reached| l.best().map_or(0.0, |way| way.speed_up.ratio);
        let here = lines.iter().filter(|l| l.directions == directions).filter(judged);
        let mut gains: Vec<_> = here.map(|l| (l.scene.as_str(), found(of(l)))).collect();
        gains.sort_by(|a, b| a.1.factor.total_cmp(&b.1.factor));
        let what = |which: &str| format!("speed-up at equal PSNR and relMSE, {which} of {half}, N = {directions}");
        all.extend(gains.first().and_then(|worst| Target::new(what("least"), &gains, worst.1, least, true)));
        all.extend(middle(&gains).and_then(|middle| Target::new(what("median"), &gains, middle, median, true)));
    }
    let costs = lines.iter().filter(|l| l.directions == 64).filter_map(|l| Some((l.scene.as_str(), found(l.base_cost?))));
    let mut costs: Vec<_> = costs.collect();
    costs.sort_by(|a, b| a.1.factor.total_cmp(&b.1.factor));
    let what = "directions a covered pixel that the whole frame of looked-up light costs, most of all scenes".to_string();
    all.extend(costs.last().and_then(|worst| Target::new(what, &costs, worst.1, 8.0, false)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::bench::table::Verdict;

    fn line(scene: &str, half: Half, ratio: Option<f64>) -> Reached {
        let way = |ratio| Way {
            variant: "residual 16".into(),
            speed_up: Ratio { ratio, interval: [ratio; 2] },
            psnr: 50.0,
            relmse: 1e-4,
        };
        Reached {
            scene: scene.into(),
            half: Some(half),
            directions: 64,
            full_ms: 10.0,
            psnr: 40.0,
            relmse: 1e-3,
            ways: vec![None, ratio.map(|r| way(0.5 * r)), ratio.map(way)],
            base_cost: Some(7.0),
        }
    }

    #[test]
    fn what_is_not_reached_counts() {
        let lines = [
            line("a", Half::Tuning, None),
            line("b", Half::Judged, Some(20.0)),
            line("c", Half::Judged, Some(5.0)),
            line("d", Half::Judged, Some(30.0)),
        ];
        assert_eq!(lines[1].best().map(|w| w.speed_up.ratio), Some(20.0));
        let found = targets(&lines);
        let verdicts: Vec<_> = found.iter().map(|t| (t.found.factor, t.verdict, t.worst.as_str())).collect();
        assert_eq!(verdicts, [(5.0, Verdict::Missed, "c"), (20.0, Verdict::Passed, "c"), (7.0, Verdict::Passed, "d")]);
        let none = targets(&[line("e", Half::Judged, None)]);
        assert_eq!((none[0].found.factor, none[0].verdict), (0.0, Verdict::Missed));
    }
}
