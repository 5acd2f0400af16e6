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
mod thin;

use crate::distribution::fit::{FitNode, LobeFit, MOST_LOBES, NODES};
use crate::reflectance::analysis::highlight;
use crate::reflectance::{Reflectance, turned};
use chain::Chain;
use glam::{DVec2, DVec3};
use grid::Grid;
use node::{Problem, State};
use std::f64::consts::TAU;

/// Lobes of the chains that are tried, from the sharpest to the broadest.
const LAYOUTS: &[&[usize]] =
    &[&[1], &[3, 1], &[3, 3, 1, 1], &[5, 3, 3, 1], &[5, 3, 3, 3, 1], &[7, 5, 5, 3, 1], &[5, 5, 5, 5, 3, 1]];
/// As good as the best of the layouts: this much more error.
const AS_GOOD: f64 = 1.05;
/// An amplitude below this share of the greatest albedo is none, if it is so at every node.
const NONE: f64 = 1e-5;
/// The node from which the others are reached.
const FIRST: usize = 40;
/// Of the nodes that choose the layout, one in so many.
const STRIDE: usize = 4;
/// Steps at the first node and at the others.
const STEPS: [usize; 2] = [40, 10];
/// How much finer the grid is on which errors are measured.
const FINER: f64 = 1.5;
/// Turns about the normal over which the error of an anisotropic reflectance is averaged.
const TURNS: u32 = 12;
/// Range of the half width of a highlight, in radians, that grids follow.
const WIDTHS: [f64; 2] = [2e-3, 0.5];

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

impl LobeFit {
    /// Fits `reflectance` (its mean over turns about the normal) by the fewest lobes whose mean error, as far as one node in
    /// four tells, is at most that of the budget, or about the least within it. The same on any number of threads; two are
    /// used, for one to four seconds (a table that is not isotropic: two more).
    pub fn build(reflectance: &dyn Reflectance, budget: Budget) -> Self {
        let samples = Samples::of(reflectance);
        let mut tried: Vec<(State, f64)> = Vec::new();
        for layout in LAYOUTS.iter().take_while(|l| l.iter().sum::<usize>() <= budget.lobes.max(1)) {
            let first = start(&Problem::new(&samples.grids[FIRST]), layout, samples.width);
            let some = samples.fit(&first, STRIDE);
            let error = some.iter().map(|n| n.error).sum::<f64>() / some.len() as f64;
            tried.push((first, error));
            if error <= budget.error {
                break;
            }
        }
        let least = tried.iter().map(|t| t.1).fold(f64::INFINITY, f64::min);
        let enough = tried.into_iter().find(|t| t.1 <= budget.error.max(AS_GOOD * least));
        // Nothing where nothing is a number.
        let nodes = enough.map_or_else(|| vec![FitNode::default(); NODES], |(first, _)| samples.fit(&first, 1));
        let nodes = thin::thinned(&samples, nodes, budget.error);
        let fit = Self::of(nodes).without_idle_lobes();
        if reflectance.isotropic() {
            return fit;
        }
        let with_turns = |i: usize| {
            let node = &fit.nodes()[i];
            FitNode { error: turning_error(reflectance, node, &samples.grids[i]), ..node.clone() }
        };
        Self::of(both(with_turns))
    }

    /// The mean over nodes of their errors.
    pub fn mean_error(&self) -> f64 {
        self.nodes().iter().map(|n| n.error).sum::<f64>() / NODES as f64
    }

    /// What the fit seen under cosine `cos_o` misses of `reflectance`, as [`FitNode::error`] says, measured on directions of its own.
    pub fn missed(&self, reflectance: &dyn Reflectance, cos_o: f64) -> f64 {
        let view = cos_o.clamp(0.0, 1.0).acos();
        let grid = Grid::new(reflectance, view, width(reflectance), FINER);
        if reflectance.isotropic() { error(&self.at(cos_o), &grid) } else { turning_error(reflectance, &self.at(cos_o), &grid) }
    }

    /// Without lobes that have no amplitude at any node.
    fn without_idle_lobes(self) -> Self {
        let greatest = self.nodes().iter().map(|n| n.lobes.iter().map(|l| l.amplitude).sum::<DVec3>() + n.diffuse);
        let least = NONE * greatest.fold(0.0, |most: f64, all| most.max(all.max_element()));
        let used = |k: &usize| self.nodes().iter().any(|n| n.lobes[*k].amplitude.max_element() > least);
        let used: Vec<usize> = (0..self.count()).filter(used).collect();
        let nodes = self.nodes().iter().map(|n| FitNode { lobes: used.iter().map(|&k| n.lobes[k]).collect(), ..*n });
        Self::new(nodes.collect()).unwrap_or(self)
    }
}

/// What half vectors vary over, in radians.
fn width(reflectance: &dyn Reflectance) -> f64 {
    highlight(reflectance).half_width.filter(|w| w.is_finite()).map_or(WIDTHS[1], f64::to_radians).clamp(WIDTHS[0], WIDTHS[1])
}

/// A reflectance at the directions of every node.
struct Samples {
    width: f64,
    grids: Vec<Grid>,
    /// On which errors are measured.
    finer: Vec<Grid>,
}

impl Samples {
    fn of(reflectance: &dyn Reflectance) -> Self {
        let width = width(reflectance);
        let grids = |finer| both(|i| Grid::new(reflectance, LobeFit::angle(i), width, finer));
        Self { width, grids: grids(1.0), finer: grids(FINER) }
    }

    /// The fits of every `stride`-th node to both sides of [`FIRST`], of which it is `first`, in their order.
    fn fit(&self, first: &State, stride: usize) -> Vec<FitNode> {
        let walk = |nodes: &mut dyn Iterator<Item = usize>| -> Vec<FitNode> {
            let mut before = first.clone();
            let next = |i: usize| {
                before = Problem::new(&self.grids[i]).refine(before.chains.clone(), Some(&before), STEPS[1]);
                let node = before.node(self.grids[i].view);
                FitNode { error: error(&node, &self.finer[i]), ..node }
            };
            nodes.map(next).collect()
        };
        let down = || walk(&mut (0..=FIRST).rev().step_by(stride));
        let (mut nodes, upper) = beside(down, || walk(&mut (FIRST + stride..NODES).step_by(stride)));
        nodes.reverse();
        nodes.extend(upper);
        nodes
    }
}

/// Both, the first on a thread of its own.
fn beside<T: Send>(first: impl Fn() -> T + Sync, second: impl FnOnce() -> T) -> (T, T) {
    std::thread::scope(|scope| {
        let running = scope.spawn(&first);
        let second = second();
        (running.join().unwrap_or_else(|_| first()), second)
    })
}

/// One of each node, half of them on a thread of its own.
fn both<T: Send>(make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let (mut lower, upper) = beside(|| (0..FIRST).map(&make).collect::<Vec<_>>(), || (FIRST..NODES).map(&make).collect());
    lower.extend(upper);
    lower
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
    let (first, others) = beside(|| vec![begin(sharpest - 2.5)], || [sharpest - 5.0, 1.0].map(begin).into());
    let all = first.into_iter().chain(others);
    all.reduce(|best, other| if other.cost < best.cost { other } else { best }).unwrap_or_else(|| begin(1.0))
}

/// Integral of |f - a| over that of f, each the mean over channels.
fn error(node: &FitNode, grid: &Grid) -> f64 {
    let values = grid.directions.iter().zip(&grid.values).zip(&grid.solid_angles);
    let missed: f64 = values.map(|((w, f), s)| (*f - node.evaluate(*w)).abs().element_sum() * s).sum();
    over(missed, grid)
}

/// The same for a reflectance that is not isotropic, and the mean over turns about the normal.
fn turning_error(reflectance: &dyn Reflectance, node: &FitNode, grid: &Grid) -> f64 {
    let wo = DVec3::new(grid.view.sin(), 0.0, grid.view.cos());
    // Even over the circle, whatever the symmetry.
    let turns: Vec<_> = (0..TURNS).map(|i| DVec2::from_angle(TAU * 0.618_033_988_75 * f64::from(i))).collect();
    let mut missed = 0.0;
    for (w, s) in grid.directions.iter().zip(&grid.solid_angles) {
        let a = node.evaluate(*w);
        let at = |w: DVec3, turn: DVec2| {
            let f = reflectance.evaluate(turned(turn, w), turned(turn, wo)) * w.z.max(0.0);
            (if f.is_finite() { f.max(DVec3::ZERO) - a } else { -a }).abs().element_sum()
        };
        let both_sides = turns.iter().map(|t| at(*w, *t) + at(DVec3::new(w.x, -w.y, w.z), *t));
        missed += s * both_sides.sum::<f64>() / f64::from(2 * TURNS);
    }
    over(missed, grid)
}

fn over(missed: f64, grid: &Grid) -> f64 {
    let all = grid.albedo.element_sum();
    if all > 0.0 { missed / all } else { 0.0 }
}
