//! What texels hold, and how it is added.

use crate::distribution::effective::Rule;
use crate::distribution::filter::Storage;
use crate::distribution::vmf::{self, LEAST_SPREAD, Lobe};
use crate::distribution::{literal, slope};
use glam::{DVec2, DVec3};
use std::ops::{Add, Mul};

/// Numbers of a lobe that is kept as it is: mass times direction, times concentration, mass; mass times the normal below.
pub(super) const KEPT: usize = 8;

/// For each cell: weight times characteristic vector, weight, weight times the mean length of the characteristic vectors, and weight
/// times the normals below: those of lobes about them are their characteristic vectors.
pub(super) const CELL: usize = 8;

/// Numbers of a texel for each lobe of directions: weight times mean direction, times concentration, and weight.
pub(super) const DIRECTION: usize = 5;
/// For each lobe of slopes: weight times mean slope and mean products xx, xy, yy, and weight.
pub(super) const SLOPE: usize = 6;

impl Storage {
    /// Lobes or cells of a texel, and numbers of each.
    pub fn layout(self, lobes: usize) -> (usize, usize) {
        match self {
            Self::Directions { apart } => (if apart { lobes } else { 1 }, DIRECTION),
            Self::Slopes { apart } => (if apart { lobes } else { 1 }, SLOPE),
            Self::Cells(cells) => (cells.count(), CELL),
            // As many as there are.
            Self::Clusters | Self::Peaks(_) | Self::Base | Self::Gaussians(_) => (0, 0),
        }
    }

    /// Which lobe or cell of a texel its lobe `i` adds to.
    fn slot(self, i: usize, lobe: &Lobe) -> usize {
        match self {
            Self::Directions { apart } | Self::Slopes { apart } => i * usize::from(apart),
            Self::Cells(cells) => cells.of(lobe.mu),
            Self::Clusters | Self::Peaks(_) | Self::Base | Self::Gaussians(_) => 0,
        }
    }

    /// What a lobe of a texel with this normal adds; as many numbers as [`Self::layout`] says.
    fn encode(self, lobe: &Lobe, normal: Option<DVec3>, rule: Rule) -> [f64; 8] {
        let w = lobe.weight;
        match self {
            Self::Directions { .. } | Self::Clusters | Self::Peaks(_) | Self::Base | Self::Gaussians(_) => {
                let mu = w * lobe.mu;
                [mu.x, mu.y, mu.z, w * lobe.kappa, w, 0.0, 0.0, 0.0]
            }
            Self::Slopes { apart } => {
                let b = slope::of(lobe.mu);
                let baked = slope::variance(lobe.kappa);
                let [xx, xy, yy] = if apart { slope::carried(b, lobe.kappa) } else { [baked, 0.0, baked] };
                [w * b.x, w * b.y, w * (b.x * b.x + xx), w * (b.x * b.y + xy), w * (b.y * b.y + yy), w, 0.0, 0.0]
            }
            Self::Cells(_) => {
                let length = match rule {
                    Rule::Exact => vmf::mean_cosine(lobe.kappa),
                    Rule::Literal => 1.0 - literal::spread(lobe.kappa),
                    Rule::Tabulated => 1.0 - literal::SPREADS.spread(lobe.kappa),
                };
                let r = w * length * lobe.mu;
                let n = normal.map_or(r, |normal| w * normal);
                [r.x, r.y, r.z, w, w * length, n.x, n.y, n.z]
            }
        }
    }
}

/// Lobes of less weight are none.
pub(super) const LEAST_WEIGHT: f64 = 1e-12;

/// Stored numbers, scaled one by one; added one by one, or one behind the other.
pub(super) enum Sum {
    Added(Vec<f64>),
    Joined(Vec<f64>),
}

impl Sum {
    pub fn all(self) -> Vec<f64> {
        match self {
            Self::Added(all) | Self::Joined(all) => all,
        }
    }
}

impl Add for Sum {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match self {
            Self::Added(all) => Self::Added(all.iter().zip(other.all()).map(|(a, b)| a + b).collect()),
            Self::Joined(mut all) => {
                all.extend(other.all());
                Self::Joined(all)
            }
        }
    }
}

impl Mul<f64> for Sum {
    type Output = Self;
    fn mul(mut self, factor: f64) -> Self {
        let (Self::Added(all) | Self::Joined(all)) = &mut self;
        all.iter_mut().for_each(|c| *c *= factor);
        self
    }
}

/// The texels of `from` that texel `i` of `size` covers, on one axis, and their shares.
pub(super) fn covered(i: usize, size: u32, from: u32) -> impl Iterator<Item = (usize, f64)> {
    let (size, from) = (size as usize, from as usize);
    let (start, end) = (i * from, (i + 1) * from);
    let share = move |k: usize| (end.min((k + 1) * size) - start.max(k * size)) as f64 / from as f64;
    (start / size..end.div_ceil(size)).map(move |k| (k, share(k)))
}

/// A lobe with the mass `q`.
pub(super) fn kept(l: &Lobe, normal: DVec3, q: f64) -> [f64; KEPT] {
    let n = q * normal.normalize_or(DVec3::Z);
    [q * l.mu.x, q * l.mu.y, q * l.mu.z, q * l.kappa, q, n.x, n.y, n.z]
}

pub(super) fn lobe_kept([x, y, z, kappa, q, nx, ny, nz]: [f64; KEPT], mass: f64) -> Option<(Lobe, DVec3)> {
    let mu = DVec3::new(x, y, z).try_normalize().unwrap_or(DVec3::Z);
    (q > 0.0).then(|| (Lobe { mu, kappa: kappa / q, weight: q / mass }, DVec3::new(nx, ny, nz)))
}

/// A stored cell.
#[derive(Clone, Copy)]
pub(super) struct Cell(pub [f64; CELL]);

impl Cell {
    pub fn plus(self, other: &Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }

    pub fn sum(&self) -> DVec3 {
        DVec3::new(self.0[0], self.0[1], self.0[2])
    }

    pub fn weight(&self) -> f64 {
        self.0[3]
    }

    /// Of its mean vector.
    pub fn spread(&self) -> f64 {
        (1.0 - self.sum().length() / self.weight().max(LEAST_WEIGHT)).max(LEAST_SPREAD)
    }

    /// The mean of its lobes' own.
    pub fn base_spread(&self) -> f64 {
        (1.0 - self.0[4] / self.weight().max(LEAST_WEIGHT)).max(LEAST_SPREAD)
    }

    pub fn normal(&self) -> DVec3 {
        DVec3::new(self.0[5], self.0[6], self.0[7])
    }

    /// Its lobe and the normal below.
    pub fn lobe(&self, rule: Rule, share: f64) -> Option<(Lobe, DVec3)> {
        let kappa = if rule.is_literal() { literal::concentration(self.spread()) } else { vmf::concentration(self.spread()) };
        let mu = self.sum().try_normalize().unwrap_or(DVec3::Z);
        let lobe = Lobe { mu, kappa, weight: share * self.weight() };
        (self.weight() > LEAST_WEIGHT).then_some((lobe, self.normal()))
    }
}

/// What the lobes of a texel add, lobe by lobe or cell by cell.
pub(super) fn encode(storage: Storage, lobes: &[Lobe], normal: Option<DVec3>, rule: Rule, out: &mut [f64]) {
    out.fill(0.0);
    let (_, stride) = storage.layout(lobes.len());
    for (i, lobe) in lobes.iter().enumerate() {
        let at = storage.slot(i, lobe) * stride;
        out[at..at + stride].iter_mut().zip(storage.encode(lobe, normal, rule)).for_each(|(sum, c)| *sum += c);
    }
}

pub(super) fn gaussian([x, y, xx, xy, yy, weight]: [f64; SLOPE]) -> Option<slope::Lobe> {
    let moments = [xx, xy, yy].map(|m| m / weight);
    (weight > LEAST_WEIGHT).then(|| slope::Lobe::from_moments(DVec2::new(x, y) / weight, moments, weight))
}
