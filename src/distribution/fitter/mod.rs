//! Fitting a reflectance by lobes: at each view angle, chains of lobes of light directions in the plane of incidence whose shapes
//! follow by nonlinear least squares and whose amplitudes, at least 0, by linear ones.
//!
//! What is minimised is the integral of `|a - f|^2 / (f + e)` over the whole sphere, f the reflectance times the cosine, 0 below
//! the horizon, so that what the fit leaks there counts. The nodes are walked from one in the middle to both ends, each
//! starting from its neighbour and drawn to it, so that a lobe is the same one throughout and can be interpolated.

mod chain;
mod grid;
mod nnls;
mod node;

use crate::distribution::fit::{FitNode, LobeFit, MOST_LOBES, NODES};
use crate::reflectance::analysis::highlight;
use crate::reflectance::{Reflectance, turned};
use chain::Chain;
use glam::{DVec2, DVec3};
use grid::Grid;
use node::{Problem, State};
use std::f64::consts::TAU;

/// The node from which the others are reached.
const FIRST: usize = 40;
/// Steps at the first node and at the others.
const STEPS: [usize; 2] = [40, 8];
/// How much finer the grid is on which errors are measured.
const FINER: f64 = 1.5;
/// Turns about the normal over which the error of an anisotropic reflectance is averaged.
const TURNS: u32 = 12;

/// What a fit may cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// The most lobes, at least 1; no more than [`MOST_LOBES`] are used.
    pub lobes: usize,
    /// The mean error over nodes at which fewer lobes are enough.
    pub error: f64,
}

impl Default for Budget {
    fn default() -> Self {
        Self { lobes: MOST_LOBES, error: 0.02 }
    }
}

/// Lobes of the chains that are tried, from the sharpest to the broadest.
pub const LAYOUTS: &[&[usize]] = &[
    &[1],
    &[3, 1],
    &[3, 3, 1],
    &[5, 3, 1],
    &[5, 3, 3, 1],
    &[5, 5, 3, 1, 1],
    &[7, 5, 5, 3, 1],
    &[7, 7, 5, 3, 1, 1],
];

/// One layout.
pub fn fit(reflectance: &dyn Reflectance, layout: &[usize]) -> Vec<FitNode> {
    let width = highlight(reflectance).half_width.map_or(0.5, f64::to_radians).clamp(2e-3, 0.5);
    let first = {
        let grid = Grid::new(reflectance, LobeFit::angle(FIRST), width, 1.0);
        start(&Problem::new(&grid), layout, width)
    };
    let walk = |nodes: &mut dyn Iterator<Item = usize>| {
        let mut before = first.clone();
        let mut found = Vec::new();
        for i in nodes {
            let grid = Grid::new(reflectance, LobeFit::angle(i), width, 1.0);
            before = Problem::new(&grid).refine(before.chains.clone(), Some(&before), STEPS[1]);
            let mut node = before.node(grid.view);
            node.error = error(reflectance, &node, grid.view, width);
            found.push(node);
        }
        found
    };
    std::thread::scope(|scope| {
        let down = scope.spawn(|| walk(&mut (0..=FIRST).rev()));
        let up = walk(&mut (FIRST + 1..NODES));
        let mut nodes = down.join().unwrap_or_else(|_| walk(&mut (0..=FIRST).rev()));
        nodes.reverse();
        nodes.extend(up);
        nodes
    })
}

/// The best of some ways to begin.
fn start(problem: &Problem<'_>, layout: &[usize], width: f64) -> State {
    let sharpest = 2.0 * (1.4 / width).log2();
    let begin = |broadest: f64| {
        let chain = |(i, &count): (usize, &usize)| {
            let share = if layout.len() > 1 { i as f64 / (layout.len() - 1) as f64 } else { 0.0 };
            Chain { count, numbers: [0.0, sharpest + (broadest.max(0.0) - sharpest) * share, 1.0] }
        };
        let chains: Vec<_> = layout.iter().enumerate().map(chain).collect();
        problem.refine(chains, None, STEPS[0])
    };
    let tried = [sharpest - 2.5, sharpest - 5.0, 1.0].map(begin);
    let [mut best, rest @ ..] = tried;
    for other in rest {
        if other.cost < best.cost {
            best = other;
        }
    }
    best
}

/// Integral of |f - a| over that of f, each the mean over channels, and over turns about the normal.
fn error(reflectance: &dyn Reflectance, node: &FitNode, view: f64, width: f64) -> f64 {
    let isotropic = reflectance.isotropic();
    let grid = Grid::new(reflectance, view, width, if isotropic { FINER } else { 1.0 });
    let wo = DVec3::new(view.sin(), 0.0, view.cos());
    let mut missed = 0.0;
    for ((w, s), f) in grid.directions.iter().zip(&grid.solid_angles).zip(&grid.values) {
        let a = node.evaluate(*w);
        missed += s * if isotropic {
            (*f - a).abs().element_sum()
        } else {
            // Even over the circle, whatever the symmetry.
            let turn = |i: u32| DVec2::from_angle(TAU * 0.618_033_988_75 * f64::from(i / 2));
            let at = |i: u32| {
                let w = if i % 2 == 0 { *w } else { DVec3::new(w.x, -w.y, w.z) };
                let f = reflectance.evaluate(turned(turn(i), w), turned(turn(i), wo)) * w.z.max(0.0);
                (if f.is_finite() { f.max(DVec3::ZERO) } else { DVec3::ZERO } - a).abs().element_sum()
            };
            (0..2 * TURNS).map(at).sum::<f64>() / f64::from(2 * TURNS)
        };
    }
    let all = grid.albedo.element_sum();
    if all > 0.0 { missed / all } else { 0.0 }
}
