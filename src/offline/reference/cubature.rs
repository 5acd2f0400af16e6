//! Direct light at one point by globally adaptive quadrature.

use crate::distribution::{Division, Filter, Rule};
use crate::material::Sampling;
use crate::offline::reference::environment::{Parts, Region, Tree};
use crate::reflectance::Reflectance;
use glam::{DMat3, DVec3};
use std::collections::BinaryHeap;
use std::f64::consts::FRAC_PI_2;

/// When a pixel is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Halving every step that was taken may change no channel by more than this share of it.
    pub tolerance: f64,
    /// Reflectance evaluations after which a pixel is given up; its [`Estimate::error`] then exceeds the tolerance.
    pub max_evaluations: u64,
    /// How materials are read. What [`Filter::Tk`] adds is a frame's own: its hits have a kernel of 0.
    pub filter: Filter,
    /// How maps are looked up.
    pub sampling: Sampling,
    /// What divides cells.
    pub division: Division,
    /// [`crate::Config::lobe_rule`].
    pub lobe_rule: Rule,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            max_evaluations: 5_000_000,
            filter: Filter::Point,
            sampling: Sampling::default(),
            division: Division::default(),
            lobe_rule: Rule::default(),
        }
    }
}

/// Outgoing radiance and how well it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Outgoing radiance (linear Rec.709).
    pub radiance: DVec3,
    /// Sum over all regions of what the last halving changed, relative to the radiance; the largest over the channels.
    pub error: f64,
    /// Reflectance evaluations spent.
    pub evaluations: u64,
}

/// Seeds are at most this large (radians).
const COARSEST: f64 = 0.4;
/// Seeds across the horizon are at most this many times the root of the tolerance in radius: a corner of the cosine that lies
/// between all quadrature points costs a share of the radius squared, and halving does not reveal it.
const HORIZON: f64 = 6.0;
/// Channels below this share of the environment's mean radiance need not converge: they are black.
const BLACK: f64 = 1e-9;

/// A region whose parts have been evaluated once.
struct Leaf {
    /// Largest relative change over the channels: what to split next.
    priority: f64,
    /// Absolute change when the region was replaced by its parts.
    change: DVec3,
    parts: Parts,
    values: [DVec3; 4],
}

impl PartialEq for Leaf {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Leaf {}

impl PartialOrd for Leaf {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Leaf {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.priority.total_cmp(&other.priority)
    }
}

/// The integrand without the environment: reflectance times cosine over directions in the map's frame.
struct Lobe<'a> {
    frame: Frame,
    normal: DVec3,
    /// In the local frame.
    view: DVec3,
    reflectance: &'a dyn Reflectance,
}

/// A surface's frame in the map's: unit vectors at right angles, left-handed where texture coordinates are mirrored.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    tangent: DVec3,
    bitangent: DVec3,
    normal: DVec3,
}

impl Frame {
    /// About unit `normal`, which may have been bent away from the tangent (with handedness); an arbitrary tangent without one.
    pub fn new(normal: DVec3, tangent: Option<(DVec3, f64)>) -> Self {
        let across = tangent.and_then(|(t, side)| Some(((t - normal * normal.dot(t)).try_normalize()?, side)));
        let (tangent, side) = across.unwrap_or_else(|| (normal.any_orthonormal_vector(), 1.0));
        Self { tangent, bitangent: normal.cross(tangent) * side, normal }
    }

    /// The same in other coordinates.
    pub fn turned(self, by: DMat3) -> Self {
        Self { tangent: by * self.tangent, bitangent: by * self.bitangent, normal: by * self.normal }
    }
}

impl Lobe<'_> {
    fn local(&self, w: DVec3) -> DVec3 {
        DVec3::new(w.dot(self.frame.tangent), w.dot(self.frame.bitangent), w.dot(self.normal))
    }

    fn at(&self, w: DVec3) -> DVec3 {
        let wi = self.local(w);
        if wi.z > 0.0 { self.reflectance.evaluate(wi, self.view) * wi.z } else { DVec3::ZERO }
    }

    /// Half the angle (radians) around the mirror direction within which the lobe keeps its magnitude, probed at
    /// halving distances along four directions; [`COARSEST`] for a broad lobe.
    fn width(&self, mirror: DVec3) -> f64 {
        let (s, t) = mirror.any_orthonormal_pair();
        let magnitude = |w: DVec3| self.at(w).max_element();
        let peak = magnitude(mirror);
        let steady = |delta: f64| {
            let (sin, cos) = delta.sin_cos();
            [s, -s, t, -t].into_iter().all(|side| {
                let w = mirror * cos + side * sin;
                let there = magnitude(w);
                w.dot(self.normal) <= 0.0 || (there <= 2.0 * peak && peak <= 2.0 * there)
            })
        };
        let mut delta = COARSEST;
        // Probing outwards-in could skip a narrow core inside a broad skirt that happens to pass, hence the full ladder.
        let mut width = COARSEST;
        while delta > 1e-4 {
            if !steady(delta) {
                width = delta / 2.0;
            }
            delta /= 2.0;
        }
        width
    }
}

/// `L(v) = integral of L_i(w) rho(w, v) (w.n)+ dw` (Bagher et al. 2011, eq. 1, no visibility) for a surface of `frame` and unit
/// direction `view` to the viewer, both in the map's coordinates.
///
/// Regions are split at their largest change, worst first, until the sum of the changes meets [`Options::tolerance`].
pub fn integrate(tree: &Tree, frame: Frame, view: DVec3, reflectance: &dyn Reflectance, options: &Options) -> Estimate {
    let normal = frame.normal;
    let mut lobe = Lobe { frame, normal, view, reflectance };
    lobe.view = lobe.local(view);
    let mirror = (normal * (2.0 * normal.dot(view)) - view).normalize();
    let seeds = seeds(tree, normal, mirror, lobe.width(mirror), HORIZON * options.tolerance.max(1e-8).sqrt());

    let above = |region: Region| {
        let (axis, radius) = tree.cone(region);
        radius >= FRAC_PI_2 || axis.dot(normal) > -radius.sin()
    };
    let mut evaluations = 0;
    let mut value = |region: Region| {
        if !above(region) {
            return DVec3::ZERO;
        }
        evaluations += super::environment::POINTS as u64;
        tree.apply(region, |w| lobe.at(w))
    };

    let floor = tree.mean() * BLACK + f64::MIN_POSITIVE;
    let seeds: Vec<_> = seeds.into_iter().map(|region| (region, value(region))).collect();
    let mut total: DVec3 = seeds.iter().map(|(_, value)| *value).sum();
    let mut error = DVec3::ZERO;
    let mut heap = BinaryHeap::with_capacity(4 * seeds.len());
    let mut halve = |region: Region, whole: DVec3, total: &mut DVec3| {
        let parts = tree.split(region);
        let mut values = [DVec3::ZERO; 4];
        for (part, out) in parts.as_slice().iter().zip(&mut values) {
            *out = value(*part);
        }
        let change = values.iter().sum::<DVec3>() - whole;
        *total += change;
        let change = change.abs();
        Leaf { priority: (change / total.max(floor)).max_element(), change, parts, values }
    };
    for (region, whole) in seeds {
        let leaf = halve(region, whole, &mut total);
        error += leaf.change;
        heap.push(leaf);
    }
    let mut spent = 0;
    let most = options.max_evaluations / super::environment::POINTS as u64;
    while (error.max(DVec3::ZERO) / total.max(floor)).max_element() > options.tolerance && spent < most && total.is_finite() {
        let Some(worst) = heap.pop() else { break };
        error -= worst.change;
        for (part, whole) in worst.parts.as_slice().iter().zip(worst.values) {
            let leaf = halve(*part, whole, &mut total);
            spent += leaf.parts.as_slice().len() as u64;
            error += leaf.change;
            heap.push(leaf);
        }
    }
    // Summed anew: the running sums carry the rounding of everything that was replaced.
    let (mut radiance, mut error) = (DVec3::ZERO, DVec3::ZERO);
    for leaf in heap.into_vec() {
        radiance += leaf.values.iter().sum::<DVec3>();
        error += leaf.change;
    }
    Estimate { radiance, error: (error / radiance.max(floor)).max_element(), evaluations }
}

/// The regions to start from: at most [`COARSEST`] in radius, shrinking towards the mirror direction down to `finest`, so
/// that no lobe hides between quadrature points. What lies below the horizon is left out.
fn seeds(tree: &Tree, normal: DVec3, mirror: DVec3, finest: f64, horizon: f64) -> Vec<Region> {
    let (mut stack, mut seeds) = (vec![tree.root()], Vec::new());
    while let Some(region) = stack.pop() {
        let (axis, radius) = tree.cone(region);
        if radius < FRAC_PI_2 && axis.dot(normal) <= -radius.sin() {
            continue;
        }
        let distance = axis.angle_between(mirror);
        let across = axis.dot(normal) < radius.sin() || radius >= FRAC_PI_2;
        let most = if across { horizon.min(COARSEST) } else { COARSEST };
        if radius > (0.8 * distance).max(finest).min(most) {
            stack.extend_from_slice(tree.split(region).as_slice());
        } else {
            seeds.push(region);
        }
    }
    seeds
}
