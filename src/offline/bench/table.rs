//! The table of the suite bagher (as figure 13 of Bagher et al. 2011), and what it is held against.

use crate::offline::bench::cases::{Gloss, Half};
use crate::offline::bench::equal::{Equal, Is};
use crate::offline::bench::report::{Row, SceneReport, SpeedUp};
use crate::offline::bench::runner::Part;
use crate::offline::bench::statistics::{Ratio, ratio_of_medians};
use serde::Serialize;

/// Numbers of directions at which full and predicted rate are compared.
const DIRECTIONS: [u32; 2] = [64, 256];
/// What the predicted rate does besides shading.
const OVERHEAD: [&str; 4] = ["bandwidth", "pyramid", "classify", "upsample"];
/// The environment with a sun, on which random reflectance directions never converge.
const SUN: &str = "sun-sky";

/// Full and predicted rate in one scene with as many directions a sample.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// The scene.
    pub scene: String,
    /// Its half; absent for scenes of the user's.
    pub half: Option<Half>,
    /// Directions a shaded sample.
    pub directions: u32,
    /// Median frame time at the full rate.
    pub full_ms: f64,
    /// Median frame time at the predicted rate.
    pub adaptive_ms: f64,
    /// Median times of the predicted frame's passes.
    pub passes: Vec<Pass>,
    /// Shaded over covered samples.
    pub shaded_fraction: f64,
    /// Full over predicted frame time.
    pub equal_directions: Option<Ratio>,
    /// Predicted over full error (root mean squares), at these times.
    pub error_ratio: Option<f64>,
    /// At equal error: what adaptivity alone gains, as both sides have the estimator mis.
    pub equal_error: Option<Gained>,
    /// The same with the estimator brdf-random on both sides.
    pub random: Option<Gained>,
    /// Full rate with mis against full rate with brdf-random at equal error: what the estimator alone gains.
    pub mis_alone: Option<Gained>,
    /// Both: the predicted rate with mis against full rate with brdf-random, which is what the paper compared with.
    pub together: Option<Gained>,
    /// The best of the default and the other settings, at equal error, with mis on both sides; absent if all that is known are
    /// upper bounds.
    pub best: Option<Best>,
    /// Time of the passes that full rate does not need, over full rate's frame time.
    pub overhead: f64,
    /// Frame time where the prediction gives up, over full rate's.
    pub fall_back: Option<Ratio>,
}

/// A pass of the predicted frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pass {
    /// Its name.
    pub name: &'static str,
    /// Median milliseconds.
    pub ms: f64,
}

/// A speed-up and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gained {
    /// The factor, or a bound on it.
    pub speed_up: SpeedUp,
    /// 95 % interval over rounds.
    pub interval: [f64; 2],
}

/// The setting that gains most.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Best {
    /// The variant.
    pub variant: String,
    /// What it gains.
    pub gained: Gained,
}

impl From<Equal> for Gained {
    fn from(e: Equal) -> Self {
        Self { speed_up: SpeedUp { factor: e.speed_up, is: e.speed_up_is }, interval: e.interval }
    }
}

/// Lines of all scenes in which both rates were measured.
pub fn lines(scenes: &[SceneReport]) -> Vec<Line> {
    let each = |directions: u32| scenes.iter().filter_map(move |scene| line(scene, directions));
    DIRECTIONS.into_iter().flat_map(each).collect()
}

fn line(scene: &SceneReport, directions: u32) -> Option<Line> {
    let row = |name: &str| scene.row(&format!("{name} {directions}"));
    let (full, adaptive) = (row("full")?, row("bandwidth")?);
    let gained = |row: Option<&Row>, estimator: &str| row.and_then(|row| row.against(estimator)).map(Gained::from);
    let over_full = |row: &Row| ratio_of_medians(&row.rounds_ms, &full.rounds_ms);
    let settings = scene.variants.iter().filter(|r| r.part == Part::Setting && r.name.ends_with(&format!(" {directions}")));
    let candidate = |row: &Row| Some(Best { variant: row.name.clone(), gained: gained(Some(row), "mis")? });
    // What gains at most so much may gain less than another.
    let found = |best: &Best| best.gained.speed_up.is != Is::AtMost;
    let best = settings.chain([adaptive]).filter_map(candidate).filter(found);
    let passes: Vec<Pass> = adaptive.passes.iter().map(|p| Pass { name: p.name, ms: p.ms.median }).collect();
    let extra: f64 = passes.iter().filter(|p| OVERHEAD.contains(&p.name)).map(|p| p.ms).sum();
    Some(Line {
        scene: scene.name.clone(),
        half: scene.half,
        directions,
        full_ms: full.frame_ms.median,
        adaptive_ms: adaptive.frame_ms.median,
        shaded_fraction: adaptive.shaded_fraction,
        equal_directions: ratio_of_medians(&full.rounds_ms, &adaptive.rounds_ms),
        error_ratio: full.error.as_ref().zip(adaptive.error.as_ref()).map(|(full, adaptive)| adaptive.rmse / full.rmse),
        equal_error: gained(Some(adaptive), "mis"),
        random: gained(row("bandwidth brdf-random"), "brdf-random"),
        mis_alone: gained(Some(full), "brdf-random"),
        together: gained(Some(adaptive), "brdf-random"),
        best: best.max_by(|a, b| a.gained.speed_up.factor.total_cmp(&b.gained.speed_up.factor)),
        overhead: if full.frame_ms.median > 0.0 { extra / full.frame_ms.median } else { 0.0 },
        fall_back: row("bandwidth falling back").and_then(over_full),
        passes,
    })
}

/// How a target was met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It was.
    Passed,
    /// It was not.
    Missed,
    /// What was found is a bound that says nothing of it.
    Undecided,
}

/// Something that was aimed at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Target {
    /// What.
    pub what: String,
    /// What was found.
    pub found: SpeedUp,
    /// The aim.
    pub aim: f64,
    /// Whether more is wanted, or less.
    pub at_least: bool,
    /// How many scenes it is found over.
    pub scenes: usize,
    /// The scene where it is worst.
    pub worst: String,
    /// Whether that is met.
    pub verdict: Verdict,
}

impl Target {
    /// Of what was found in each scene, from the least to the most, and over all of them.
    pub(super) fn new(what: String, sorted: &[(&str, SpeedUp)], found: SpeedUp, aim: f64, at_least: bool) -> Option<Self> {
        let worst = if at_least { sorted.first() } else { sorted.last() }?.0.to_string();
        let verdict = match (found.factor >= aim, found.factor <= aim, at_least, found.is) {
            (true, _, true, Is::Found | Is::AtLeast) | (_, true, false, Is::Found | Is::AtMost) => Verdict::Passed,
            (false, _, true, Is::Found | Is::AtMost) | (_, false, false, Is::Found | Is::AtLeast) => Verdict::Missed,
            _ => Verdict::Undecided,
        };
        Some(Self { what, found, aim, at_least, scenes: sorted.len(), worst, verdict })
    }
}

/// What was aimed at, as far as scenes were measured. Gains are judged on the judged half, what must never happen on all scenes.
pub fn targets(scenes: &[SceneReport], lines: &[Line]) -> Vec<Target> {
    let has_halves = lines.iter().any(|l| l.half == Some(Half::Judged));
    let case = |line: &Line| scenes.iter().find(|s| s.name == line.scene).and_then(|s| s.case);
    let at = |directions: u32| lines.iter().filter(move |l| l.directions == directions);
    let median = |what: &str, aim: f64, of: &dyn Fn(&Line) -> Option<Gained>, only: &dyn Fn(&Line) -> bool| {
        let judged = at(64).filter(|l| (!has_halves || l.half == Some(Half::Judged)) && only(l));
        let mut all: Vec<_> = judged.filter_map(|l| Some((l.scene.as_str(), of(l)?.speed_up))).collect();
        all.sort_by(|a, b| a.1.factor.total_cmp(&b.1.factor));
        let half = if has_halves { "judged half" } else { "scenes" };
        let middle = super::report::middle(&all)?;
        Target::new(format!("{what}, median of the {half}, N = 64"), &all, middle, aim, true)
    };
    let extreme = |what: &str, directions: u32, aim: f64, at_least: bool, of: &dyn Fn(&Line) -> Option<f64>| {
        let found = |factor: f64| SpeedUp { factor, is: Is::Found };
        let mut all: Vec<_> = at(directions).filter_map(|l| Some((l.scene.as_str(), found(of(l)?)))).collect();
        all.sort_by(|a, b| a.1.factor.total_cmp(&b.1.factor));
        let worst = if at_least { all.first() } else { all.last() }?.1;
        Target::new(format!("{what}, N = {directions}"), &all, worst, aim, at_least)
    };
    let gloss = |line: &Line, gloss: Gloss| case(line).is_some_and(|c| c.gloss() == gloss);
    let smooth = |line: &Line| gloss(line, Gloss::Glossy) && case(line).is_some_and(|c| c.is_smooth());
    let equal = |line: &Line| line.equal_error;
    let unhurried = |line: &Line| line.equal_directions.map(|r| r.ratio);
    let overhead = |line: &Line| Some(line.overhead);
    let fall_back = |line: &Line| line.fall_back.map(|r| r.ratio);
    let all = [
        median("speed-up at equal rmse, rough", 2.5, &equal, &|l| gloss(l, Gloss::Rough)),
        median("speed-up at equal rmse, glossy on smooth meshes", 1.8, &equal, &smooth),
        median("speed-up at equal rmse, all", 1.8, &equal, &|_| true),
        median("speed-up at equal rmse, brdf-random on both sides, no sun", 3.0, &|l| l.random, &|l| {
            case(l).is_some_and(|c| c.environment != SUN)
        }),
        extreme("full rate's frame time over the predicted one's, least of all scenes", 64, 0.97, true, &unhurried),
        extreme("full rate's frame time over the predicted one's, least of all scenes", 256, 0.97, true, &unhurried),
        extreme(
            "bandwidth, pyramid, classify and upsample over full rate's frame, most of all scenes",
            64,
            0.08,
            false,
            &overhead,
        ),
        extreme(
            "bandwidth, pyramid, classify and upsample over full rate's frame, most of all scenes",
            256,
            0.03,
            false,
            &overhead,
        ),
        extreme("frame that falls back over full rate's, most of all scenes", 64, 1.03, false, &fall_back),
        extreme("frame that falls back over full rate's, most of all scenes", 256, 1.03, false, &fall_back),
    ];
    all.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(scene: &str, half: Half, factor: f64, is: Is) -> Line {
        let gained = Gained { speed_up: SpeedUp { factor, is }, interval: [factor; 2] };
        Line {
            scene: scene.into(),
            half: Some(half),
            directions: 64,
            full_ms: 10.0,
            adaptive_ms: 10.0 / factor,
            passes: Vec::new(),
            shaded_fraction: 0.5,
            equal_directions: Some(Ratio { ratio: factor, interval: [factor; 2] }),
            error_ratio: Some(1.0),
            equal_error: Some(gained),
            random: None,
            mis_alone: None,
            together: None,
            best: None,
            overhead: 0.02 * factor,
            fall_back: None,
        }
    }

    #[test]
    fn gains_are_judged_on_the_judged_half_and_losers_count_anywhere() {
        let lines = [
            line("a", Half::Tuning, 0.9, Is::Found),
            line("b", Half::Judged, 1.7, Is::Found),
            line("c", Half::Judged, 2.0, Is::Found),
            line("d", Half::Judged, 5.0, Is::AtLeast),
        ];
        let found = targets(&[], &lines);
        let of = |what: &str| found.iter().find(|t| t.what.starts_with(what)).unwrap();
        let all = of("speed-up at equal rmse, all");
        assert_eq!((all.found.factor, all.scenes, all.worst.as_str(), all.verdict), (2.0, 3, "b", Verdict::Passed));
        let never = of("full rate's frame time");
        assert_eq!((never.found.factor, never.scenes, never.worst.as_str(), never.verdict), (0.9, 4, "a", Verdict::Missed));
        let overhead = of("bandwidth, pyramid");
        assert!((overhead.found.factor - 0.1).abs() < 1e-12);
        assert_eq!((overhead.worst.as_str(), overhead.verdict), ("d", Verdict::Missed));
        // Nothing was measured for the others.
        assert_eq!(found.len(), 3);
    }

    #[test]
    fn bounds_decide_only_on_their_own_side() {
        let verdict = |factor, is, at_least| {
            let found = SpeedUp { factor, is };
            Target::new(String::new(), &[("", found)], found, 2.0, at_least).unwrap().verdict
        };
        for (factor, is, at_least, expected) in [
            (2.0, Is::Found, true, Verdict::Passed),
            (1.9, Is::Found, true, Verdict::Missed),
            (3.0, Is::AtLeast, true, Verdict::Passed),
            (1.0, Is::AtLeast, true, Verdict::Undecided),
            (3.0, Is::AtMost, true, Verdict::Undecided),
            (1.0, Is::AtMost, true, Verdict::Missed),
            (1.0, Is::Found, false, Verdict::Passed),
            (1.0, Is::AtMost, false, Verdict::Passed),
            (3.0, Is::AtLeast, false, Verdict::Missed),
            (3.0, Is::AtMost, false, Verdict::Undecided),
            (1.0, Is::AtLeast, false, Verdict::Undecided),
        ] {
            assert_eq!(verdict(factor, is, at_least), expected, "{factor} {is:?} {at_least}");
        }
    }
}
