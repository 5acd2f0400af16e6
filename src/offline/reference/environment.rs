//! The environment as a tree of quadrature rules over latitude and longitude.
//!
//! Every region holds 3x3 Gauss points and, per point, the integral of `radiance * sin(theta)` times the point's Lagrange
//! polynomial. A rule applied to `f` is thus the integral of radiance times the biquadratic interpolant of `f`: however
//! rough the environment is, only the smoothness of `f` decides how far a region must be split (product integration:
//! Davis and Rabinowitz, Methods of Numerical Integration, section 2.5.6).

use crate::sampling::LatLong;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Gauss points along one side of a region.
const SIDE: usize = 3;
/// Gauss points of a region.
pub const POINTS: usize = SIDE * SIDE;
/// `sqrt(3/5) / 2`: the outer Gauss points' distance from the middle of [0, 1].
const OUTER: f64 = 0.387_298_334_620_741_7;
/// Gauss-Legendre abscissae on [0, 1].
const NODES: [f64; SIDE] = [0.5 - OUTER, 0.5, 0.5 + OUTER];
/// Gauss-Legendre weights on [0, 1].
const WEIGHTS: [f64; SIDE] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];
/// Cells of the finest stored grid are at most this large (radians), so that `sin(theta)` is as good as a parabola there.
const CELL: f64 = 0.1;

/// A rectangle of map coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Rect {
    /// From and to in u.
    u: [f64; 2],
    /// From and to in v.
    v: [f64; 2],
}

/// A part of the sphere: a stored node, or a rectangle inside one bilinear cell whose weights are computed when asked for.
#[derive(Clone, Copy, Debug)]
pub enum Region {
    /// Index into the tree's nodes.
    Node(usize),
    /// Inside one bilinear cell.
    Cell(Rect),
}

/// Up to four parts that tile a region.
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    parts: [Region; 4],
    len: usize,
}

impl Parts {
    /// The parts in use.
    pub fn as_slice(&self) -> &[Region] {
        self.parts.get(..self.len).unwrap_or(&[])
    }

    fn push(&mut self, part: Region) {
        if let Some(slot) = self.parts.get_mut(self.len) {
            *slot = part;
            self.len += 1;
        }
    }

    fn new() -> Self {
        Self { parts: [Region::Node(0); 4], len: 0 }
    }
}

/// A stored region of more than one cell.
#[derive(Clone, Debug)]
struct Node {
    rect: Rect,
    parts: Parts,
    weights: [DVec3; POINTS],
}

/// The tree over one map. Directions are in the map's own frame.
#[derive(Clone, Debug)]
pub struct Tree<'a> {
    map: &'a LatLong,
    nodes: Vec<Node>,
    root: Region,
    mean: DVec3,
}

impl<'a> Tree<'a> {
    /// Builds the rules bottom-up: a parent's weights follow exactly from its parts', whose rules integrate its polynomials.
    pub fn new(map: &'a LatLong) -> Self {
        let mut tree = Self { map, nodes: Vec::new(), root: Region::Node(0), mean: DVec3::ZERO };
        let (w, h) = (f64::from(map.width()), f64::from(map.height()));
        // Bilinear cells lie between texel centres; beyond the outermost rows' centres the map is constant in v.
        let u = edges((0..=map.width()).map(|x| (f64::from(x) + 0.5) / w), CELL / TAU);
        let inner = (0..map.height()).map(|y| (f64::from(y) + 0.5) / h);
        let v = edges(std::iter::once(0.0).chain(inner).chain(std::iter::once(1.0)), CELL / PI);
        tree.root = tree.build(&u, &v);
        tree.mean = tree.apply(tree.root, |_| DVec3::ONE) / (4.0 * PI);
        tree
    }

    /// The region of the whole sphere.
    pub fn root(&self) -> Region {
        self.root
    }

    /// Mean radiance over the sphere.
    pub fn mean(&self) -> DVec3 {
        self.mean
    }

    /// The integral over `region` of radiance times the interpolant of `f`.
    pub fn apply(&self, region: Region, f: impl Fn(DVec3) -> DVec3) -> DVec3 {
        let (rect, weights) = self.rule(region);
        let phi = rect.points_u().map(|u| ((u - 0.5) * TAU).sin_cos());
        let theta = rect.points_v().map(|v| (v * PI).sin_cos());
        let mut sum = DVec3::ZERO;
        for ((sin_theta, cos_theta), row) in theta.into_iter().zip(weights.chunks_exact(SIDE)) {
            for ((sin_phi, cos_phi), weight) in phi.into_iter().zip(row) {
                sum += *weight * f(DVec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi));
            }
        }
        sum
    }

    /// Halves of `region` along its long sides (both, unless one is more than twice the other).
    pub fn split(&self, region: Region) -> Parts {
        let rect = match region {
            Region::Node(index) => return self.nodes.get(index).map_or(Parts::new(), |node| node.parts),
            Region::Cell(rect) => rect,
        };
        let [across, down] = rect.long_sides();
        let halves = |[a, b]: [f64; 2], split: bool| if split { vec2(a, b) } else { [Some([a, b]), None] };
        let mut parts = Parts::new();
        for v in halves(rect.v, down).into_iter().flatten() {
            for u in halves(rect.u, across).into_iter().flatten() {
                parts.push(Region::Cell(Rect { u, v }));
            }
        }
        parts
    }

    /// The direction of the middle and an angle (radians) within which all of the region lies.
    pub fn cone(&self, region: Region) -> (DVec3, f64) {
        let rect = self.rect(region);
        let [across, down] = rect.sides();
        let (phi, theta) = ((middle(rect.u) - 0.5) * TAU, middle(rect.v) * PI);
        let axis = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
        (axis, across.hypot(down) / 2.0)
    }

    fn rect(&self, region: Region) -> Rect {
        match region {
            Region::Cell(rect) => rect,
            Region::Node(index) => self.nodes.get(index).map_or(Rect { u: [0.0; 2], v: [0.0; 2] }, |node| node.rect),
        }
    }

    fn rule(&self, region: Region) -> (Rect, [DVec3; POINTS]) {
        let rect = match region {
            Region::Cell(rect) => rect,
            Region::Node(index) => match self.nodes.get(index) {
                Some(node) => return (node.rect, node.weights),
                None => return (Rect { u: [0.0; 2], v: [0.0; 2] }, [DVec3::ZERO; POINTS]),
            },
        };
        let (w, h) = (f64::from(self.map.width()), f64::from(self.map.height()));
        let (x, y) = ((middle(rect.u) * w - 0.5).floor(), (middle(rect.v) * h - 0.5).floor());
        let texel = |dx: i64, dy: i64| self.map.texel(x as i64 + dx, y as i64 + dy);
        let [a, b, c, d] = [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)];
        let area = (rect.u[1] - rect.u[0]) * TAU * (rect.v[1] - rect.v[0]) * PI;
        let mut weights = [DVec3::ZERO; POINTS];
        for ((v, weight_v), row) in rect.points_v().into_iter().zip(WEIGHTS).zip(weights.chunks_exact_mut(SIDE)) {
            let fy = v * h - 0.5 - y;
            let (left, right) = (a.lerp(c, fy), b.lerp(d, fy));
            for ((u, weight_u), out) in rect.points_u().into_iter().zip(WEIGHTS).zip(row) {
                *out = left.lerp(right, u * w - 0.5 - x) * (area * weight_u * weight_v * (v * PI).sin());
            }
        }
        (rect, weights)
    }

    fn build(&mut self, u: &[f64], v: &[f64]) -> Region {
        let ends = |edges: &[f64]| [edges.first().copied().unwrap_or(0.0), edges.last().copied().unwrap_or(0.0)];
        let rect = Rect { u: ends(u), v: ends(v) };
        let (can_u, can_v) = (u.len() > 2, v.len() > 2);
        if !can_u && !can_v {
            return Region::Cell(rect);
        }
        let [long_u, long_v] = rect.long_sides();
        let split_u = can_u && (long_u || !can_v);
        let split_v = can_v && (long_v || !can_u);
        let mut parts = Parts::new();
        for v in halves_of(v, split_v).into_iter().flatten() {
            for u in halves_of(u, split_u).into_iter().flatten() {
                parts.push(self.build(u, v));
            }
        }
        let mut weights = [DVec3::ZERO; POINTS];
        for part in parts.as_slice() {
            let (inner, inner_weights) = self.rule(*part);
            let lu = inner.points_u().map(|u| lagrange((u - rect.u[0]) / (rect.u[1] - rect.u[0])));
            let lv = inner.points_v().map(|v| lagrange((v - rect.v[0]) / (rect.v[1] - rect.v[0])));
            for (lv, row) in lv.iter().zip(inner_weights.chunks_exact(SIDE)) {
                for (lu, weight) in lu.iter().zip(row) {
                    for (lv, out) in lv.iter().zip(weights.chunks_exact_mut(SIDE)) {
                        for (lu, out) in lu.iter().zip(out) {
                            *out += *weight * (lu * lv);
                        }
                    }
                }
            }
        }
        self.nodes.push(Node { rect, parts, weights });
        Region::Node(self.nodes.len() - 1)
    }
}

impl Rect {
    fn points_u(&self) -> [f64; SIDE] {
        NODES.map(|x| self.u[0] + x * (self.u[1] - self.u[0]))
    }

    fn points_v(&self) -> [f64; SIDE] {
        NODES.map(|x| self.v[0] + x * (self.v[1] - self.v[0]))
    }

    /// Upper bounds of the lengths (radians on the sphere) along u and v.
    fn sides(&self) -> [f64; 2] {
        let [top, bottom] = self.v.map(|v| v * PI);
        let widest = if top < PI / 2.0 && bottom > PI / 2.0 { 1.0 } else { top.sin().max(bottom.sin()) };
        [(self.u[1] - self.u[0]) * TAU * widest, bottom - top]
    }

    /// Which of u and v are at least half as long as the other.
    fn long_sides(&self) -> [bool; 2] {
        let [across, down] = self.sides();
        [across >= down / 2.0, down >= across / 2.0]
    }
}

fn middle([a, b]: [f64; 2]) -> f64 {
    (a + b) / 2.0
}

fn vec2(a: f64, b: f64) -> [Option<[f64; 2]>; 2] {
    let middle = middle([a, b]);
    [Some([a, middle]), Some([middle, b])]
}

/// Two halves of a run of edges that share the middle one, or the whole.
fn halves_of(edges: &[f64], split: bool) -> [Option<&[f64]>; 2] {
    let middle = edges.len() / 2;
    if split { [edges.get(..=middle), edges.get(middle..)] } else { [Some(edges), None] }
}

/// `edges` with equal steps of at most `step` in between.
fn edges(edges: impl Iterator<Item = f64>, step: f64) -> Vec<f64> {
    let mut fine: Vec<f64> = Vec::new();
    for edge in edges {
        if let Some(&last) = fine.last() {
            let count = ((edge - last) / step).ceil().max(1.0) as u32;
            fine.extend((1..count).map(|i| last + (edge - last) * f64::from(i) / f64::from(count)));
        }
        fine.push(edge);
    }
    fine
}

/// The three Lagrange polynomials of the Gauss points at `x` in [0, 1].
fn lagrange(x: f64) -> [f64; SIDE] {
    let [a, b, c] = NODES;
    [(x - b) * (x - c) / ((a - b) * (a - c)), (x - a) * (x - c) / ((b - a) * (b - c)), (x - a) * (x - b) / ((c - a) * (c - b))]
}
