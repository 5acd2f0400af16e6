//! Fewer lobes at view angles that do not need all of them: a chain is long for grazing views, where lobes are stretched most; seen
//! from above its lobes lie one upon the other.

use super::node::{Problem, Products};
use super::{Samples, error, nnls};
use crate::distribution::fit::{FitLobe, FitNode};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// As good as all lobes of a node: this much more error, or this share of the error at which a fit is good enough. Frames of mirrors
/// lose 1 dB; with 1.25 and 0.5 they lose 4, for a tenth of the time.
const NEARLY_AS_GOOD: f64 = 1.1;
const GOOD: f64 = 0.25;

/// The lobes of `nodes` without which more of the light would be missed, where `enough` is what a fit may miss; the amplitudes of the
/// others are 0. A lobe that is needed at one view angle stays at all that are more grazing, so that few begin between two nodes.
pub fn thinned(samples: &Samples, nodes: Vec<FitNode>, enough: f64) -> Vec<FitNode> {
    let mut kept: Option<Vec<usize>> = None;
    let thin = |(i, node): (usize, FitNode)| {
        let limit = (NEARLY_AS_GOOD * node.error).max(GOOD * enough);
        let choice = Choice { products: Problem::new(&samples.grids[i]).products_of(&node.lobes), node: &node };
        let with = |kept: &[usize]| {
            let node = choice.with(kept);
            FitNode { error: error(&node, &samples.finer[i]), ..node }
        };
        let mut set = kept.take().unwrap_or_else(|| choice.fewest(|set| with(set).error <= limit));
        let mut thin = with(&set);
        while thin.error > limit {
            let Some(next) = choice.most_missing(&set) else { break };
            set.push(next);
            thin = with(&set);
        }
        // All of them are as they were fitted.
        let thin = if thin.error > limit { node.clone() } else { thin };
        kept = Some(set);
        thin
    };
    nodes.into_iter().enumerate().map(thin).collect()
}

/// Which of a node's lobes to keep.
struct Choice<'a> {
    node: &'a FitNode,
    products: [Products; 3],
}

impl Choice<'_> {
    /// The best amplitudes, by channel, of some lobes and the cosine part, and the squared error that is left.
    fn amplitudes(&self, set: &[usize]) -> ([DVector<f64>; 3], f64) {
        let places: Vec<usize> = set.iter().copied().chain([self.node.lobes.len()]).collect();
        let mut cost = 0.0;
        let amplitudes = self.products.each_ref().map(|Products { gram, b, squares }| {
            let ridge = |i: usize, j: usize| if i == j { 1e-9 * gram[(places[i], places[i])] + 1e-14 } else { 0.0 };
            let gram = DMatrix::from_fn(places.len(), places.len(), |i, j| gram[(places[i], places[j])] + ridge(i, j));
            let b = DVector::from_fn(places.len(), |i, _| b[places[i]]);
            let x = nnls::solve(&gram, &b, &DVector::zeros(places.len()));
            cost += squares + x.dot(&(&gram * &x)) - 2.0 * x.dot(&b);
            x
        });
        (amplitudes, cost)
    }

    /// The node with those lobes alone.
    fn with(&self, set: &[usize]) -> FitNode {
        let (amplitudes, _) = self.amplitudes(set);
        let amplitude = |i: usize| DVec3::from_array(amplitudes.each_ref().map(|a| a[i]));
        let mut lobes: Vec<FitLobe> = self.node.lobes.iter().map(|l| FitLobe { amplitude: DVec3::ZERO, ..*l }).collect();
        set.iter().enumerate().for_each(|(i, &lobe)| lobes[lobe].amplitude = amplitude(i));
        FitNode { lobes, diffuse: amplitude(set.len()), error: 0.0 }
    }

    /// Lobes are left out, of all the one whose loss costs least, while what is left is `enough`.
    fn fewest(&self, enough: impl Fn(&[usize]) -> bool) -> Vec<usize> {
        let mut set: Vec<usize> = (0..self.node.lobes.len()).collect();
        while !set.is_empty() {
            let without = |lobe: usize| set.iter().copied().filter(|k| *k != lobe).collect::<Vec<_>>();
            let tried = set.iter().map(|&lobe| (self.amplitudes(&without(lobe)).1, lobe));
            let Some((_, least)) = tried.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
            let fewer = without(least);
            if !enough(&fewer) {
                break;
            }
            set = fewer;
        }
        set
    }

    /// The lobe that gains most beside `set`.
    fn most_missing(&self, set: &[usize]) -> Option<usize> {
        let others = (0..self.node.lobes.len()).filter(|k| !set.contains(k));
        let with = |k: usize| {
            let all: Vec<usize> = set.iter().copied().chain([k]).collect();
            (self.amplitudes(&all).1, k)
        };
        others.map(with).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k)| k)
    }
}
