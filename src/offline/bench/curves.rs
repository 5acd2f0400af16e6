//! What levels alone cost in error, without noise: converged values, reconstructed from the samples that each rate shades.

use crate::frequency::luminance;
use crate::offline::error::Result;
use crate::offline::rates::oracle::{self, Outcome};
use crate::offline::render::Settings;
use crate::offline::world::World;
use crate::{Config, Rate};
use serde::Serialize;

/// Samples a predicted cycle.
const SAMPLES_PER_CYCLE: [f32; 4] = [1.0, 2.0, 4.0, 8.0];
/// Contrasts that are not noticed.
const NOTICEABLE: [f64; 5] = [0.03, 0.08, 0.15, 0.3, 0.6];

/// One rate over its setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// As `--rate` calls it.
    pub rate: &'static str,
    /// From few samples to many, or the other way round.
    pub points: Vec<Point>,
}

/// What one setting comes to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// `spc` of `bandwidth`, and of the `oracle` that has no more error; the contrast of `luminance`.
    pub setting: Option<f64>,
    /// Shaded over covered samples.
    pub shaded_fraction: f64,
    /// Root mean squared difference of values as displayed, 0 to 1.
    pub error: f64,
}

/// All rates in `world`. Only directions of one frame go into levels by bandwidth: noise has no part.
///
/// # Errors
/// The device's.
pub fn of(world: &World, base: &Settings) -> Result<Vec<Curve>> {
    let config = Config { rate: Rate::Given, ..base.config() };
    let oracle = oracle::converged(world, &config, &base.device, base.seed)?;
    let covered = oracle.covered().max(1) as f64;
    let point = |setting: Option<f64>, outcome: Outcome| Point {
        setting,
        shaded_fraction: outcome.shaded as f64 / covered,
        error: outcome.error.sqrt(),
    };
    let samples = oracle.frame().len();
    let uniform = |rate, level| Curve { rate, points: vec![point(None, oracle.outcome(&vec![level; samples]))] };
    let contrast = |noticeable: f64| {
        let levels = luminance::levels(oracle.frame(), config.extent, 1, noticeable);
        point(Some(noticeable), oracle.outcome(&levels))
    };
    let mut curves = vec![
        uniform("full", 0),
        uniform("half", 1),
        uniform("quarter", 2),
        Curve { rate: "luminance", points: NOTICEABLE.map(contrast).to_vec() },
    ];
    let (mut bandwidth, mut best) = (Vec::new(), Vec::new());
    for spc in SAMPLES_PER_CYCLE {
        // The fewest directions that there are: levels do not depend on them where samples a cycle are given.
        let config = Config { samples_per_cycle: Some(spc), directions: 2, ..config.clone() };
        let outcome = oracle.outcome(&oracle::predicted(world, &config, &base.device, base.seed)?);
        bandwidth.push(point(Some(spc.into()), outcome));
        best.push(point(Some(spc.into()), oracle.cheapest(outcome.error).1));
    }
    curves.push(Curve { rate: "bandwidth", points: bandwidth });
    curves.push(Curve { rate: "oracle", points: best });
    Ok(curves)
}
