//! Aligned mixtures of Gaussians in the mips of a map (Tan et al. 2005): of every texel of every level a few round Gaussians in the
//! stereographic plane of directions, fitted to the lobes below it so that those of one number are alike in neighbouring texels. Each is
//! stored as `(a, a mu.x, a mu.y, a (2 sigma^2 + mu.mu))`, which averages are exact for; the paper's own last number, with one `sigma^2`,
//! would count the distance of means twice.
//!
//! The paper has normals projected on their plane. In the stereographic plane, which angles do not change in, a round lobe is a
//! round Gaussian at any slant, and lobes towards the horizon stay what they are.

use crate::distribution::alignment::{self, Fit, Samples};
use crate::distribution::brdf_map::BrdfMap;
use crate::distribution::clusters::{Decoded, Placed};
use crate::distribution::expectation::GAUSSIANS;
use crate::distribution::filtered::Area;
use crate::distribution::vmf::{self, Lobe};
use crate::distribution::{elliptic, stereographic};
use crate::reflectance::vmf::LEAST_PROJECTED_AREA;
use glam::{DVec2, DVec3};

/// Numbers of a Gaussian in a texel: mass; mass times place in the plane from the map's middle, x and y; mass times the mean square of
/// this; mass times the place of the normal below, x and y, where lobes are not about it.
pub const MOMENTS: usize = 6;

/// Numbers of a texel.
pub(crate) const TEXEL: usize = GAUSSIANS * MOMENTS;

/// Less of a texel's mass is none.
const LEAST_SHARE: f64 = 1e-6;

/// The mixtures of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaussians {
    size: [u32; 2],
    fit: Fit,
    /// Whether lobes are not about the normals below.
    normals: bool,
    frame: Frame,
    /// Of each lobe of the map which Gaussian it is.
    labels: Vec<u8>,
    /// From level 1 on, texel by texel.
    levels: Vec<Vec<[f32; TEXEL]>>,
}

/// What the Gaussians of a map share. Numbers are such that 32 bits hold them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    /// From where places in the plane count.
    pub middle: DVec2,
    /// The least variance of a Gaussian, each way: half of the least of the map's lobes.
    pub floor: f64,
    /// The mean of 1 / kappa of the map's lobes.
    pub own: f64,
}

/// From where a device fits the mixtures of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Start {
    pub frame: Frame,
    /// What the coarsest level starts from: of each Gaussian mass, mass times place, x and y, mass times mean products xx, xy, yy.
    pub sums: [[f64; MOMENTS]; GAUSSIANS],
}

impl Start {
    /// Of a map whose lobes have the masses weight over `area` of concentration.
    pub fn of(map: &BrdfMap, area: Area) -> Self {
        let frame = Frame::of(map);
        Self { frame, sums: alignment::seed(map, frame.middle, area).0 }
    }
}

impl Frame {
    fn of(map: &BrdfMap) -> Self {
        let (mut middle, mut own, mut weight, mut least) = (DVec2::ZERO, 0.0, 0.0, f64::INFINITY);
        for lobe in map.lobes() {
            let placed = Placed::of(lobe);
            middle += lobe.weight * placed.at;
            own += lobe.weight * placed.own;
            weight += lobe.weight;
            least = least.min(placed.variance);
        }
        let round = |v: f64| f64::from(v as f32);
        let middle = middle / weight;
        Self { middle: DVec2::new(round(middle.x), round(middle.y)), floor: round(0.5 * least), own: round(own / weight) }
    }

    /// What a lobe of mass `q` over a normal adds.
    fn moments(&self, lobe: &Lobe, normal: Option<DVec3>, q: f64) -> [f64; MOMENTS] {
        let placed = Placed::of(lobe);
        let d = placed.at - self.middle;
        let below = normal.map_or(DVec2::ZERO, stereographic::of);
        [q, q * d.x, q * d.y, q * (d.length_squared() + 2.0 * placed.variance), q * below.x, q * below.y]
    }

    /// The place in the plane and the variance each way of a Gaussian of these moments.
    fn gaussian(&self, [q, x, y, square, ..]: [f64; MOMENTS]) -> (DVec2, f64) {
        let off = DVec2::new(x, y) / q;
        (self.middle + off, (0.5 * (square / q - off.length_squared())).max(self.floor))
    }
}

impl Gaussians {
    /// Of a map of vMF lobes, on so many threads.
    pub fn new(map: &BrdfMap, fit: Fit, threads: usize) -> Self {
        Self::on(map, |kappa| vmf::mean_cosine(kappa).max(LEAST_PROJECTED_AREA), fit, threads)
    }

    /// Of a map whose lobes have the masses weight over `area` of concentration. The same on any number of processors, all of which it
    /// takes.
    pub(crate) fn of(map: &BrdfMap, area: Area, fit: Fit) -> Self {
        Self::on(map, area, fit, std::thread::available_parallelism().map_or(1, usize::from))
    }

    /// The same on so many threads.
    pub(crate) fn on(map: &BrdfMap, area: Area, fit: Fit, threads: usize) -> Self {
        let (frame, normals) = (Frame::of(map), map.normal(0).is_some());
        let aligned = Samples::of(map, frame.middle, area).align(fit, threads);
        let texel = |fitted: &crate::distribution::alignment::Fitted| {
            let mut texel = [0.0; TEXEL];
            let all = fitted.sums.0.iter().zip(fitted.normals);
            for (out, ([q, x, y, xx, _, yy], n)) in texel.as_chunks_mut::<MOMENTS>().0.iter_mut().zip(all) {
                *out = [*q, *x, *y, xx + yy, n.x, n.y].map(|v| v as f32);
            }
            texel
        };
        let levels = aligned.levels.iter().map(|level| level.iter().map(texel).collect()).collect();
        Self { size: map.size(), fit, normals, frame, labels: aligned.labels, levels }
    }

    /// Those whose `labels` and `levels` are known; `None` unless they are those of a map of this kind.
    #[cfg_attr(not(feature = "offline"), expect(dead_code, reason = "only `offline` keeps them on disk"))]
    pub(crate) fn known(map: &BrdfMap, fit: Fit, labels: Vec<u8>, levels: Vec<Vec<[f32; TEXEL]>>) -> Option<Self> {
        let mut size = map.size();
        let mut right = labels.len() == map.lobes().len() && labels.iter().all(|l| usize::from(*l) < GAUSSIANS);
        for level in &levels {
            right &= size != [1, 1];
            size = crate::texture::halved(size);
            right &= level.len() == size[0] as usize * size[1] as usize;
            right &= level.as_flattened().iter().all(|v| v.is_finite());
        }
        let normals = map.normal(0).is_some();
        (right && size == [1, 1]).then(|| Self { size: map.size(), fit, normals, frame: Frame::of(map), labels, levels })
    }

    /// Width and height of the map.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// How they were fitted.
    pub fn fit(&self) -> Fit {
        self.fit
    }

    /// Whether they may be those of a map: of its size, with as many lobes.
    pub(crate) fn are_of(&self, map: &BrdfMap) -> bool {
        self.size == map.size() && self.labels.len() == map.lobes().len()
    }

    /// Of each lobe of the map, texel by texel, which Gaussian it is.
    #[cfg_attr(not(feature = "offline"), expect(dead_code, reason = "only `offline` keeps them on disk"))]
    pub(crate) fn labels(&self) -> &[u8] {
        &self.labels
    }

    /// From level 1 on, texel by texel.
    #[cfg_attr(not(feature = "offline"), expect(dead_code, reason = "only `offline` keeps them on disk"))]
    pub(crate) fn levels(&self) -> &[Vec<[f32; TEXEL]>] {
        &self.levels
    }

    pub(crate) fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Texel `i` of a level; level 0 is that of `map`, from which these were fitted. `None` where there is none.
    pub(crate) fn texel(&self, map: &BrdfMap, area: Area, level: usize, i: usize) -> Option<Vec<f64>> {
        if let Some(level) = level.checked_sub(1) {
            return Some(self.levels.get(level)?.get(i)?.iter().map(|v| f64::from(*v)).collect());
        }
        let lobes = map.texel(i);
        let labels = self.labels.get(i * lobes.len()..(i + 1) * lobes.len())?;
        let mut texel = vec![0.0; TEXEL];
        for (lobe, label) in lobes.iter().zip(labels) {
            let moments = self.frame.moments(lobe, map.normal(i).filter(|_| self.normals), lobe.weight / area(lobe.kappa));
            let own = texel.iter_mut().skip(usize::from(*label) * MOMENTS);
            own.zip(moments).for_each(|(sum, m)| *sum += m);
        }
        (!lobes.is_empty()).then_some(texel)
    }

    /// The place in the plane and the variance each way of each Gaussian in a texel, with its mass; those of none are left out.
    pub fn gaussians(&self, texel: &[f64]) -> Vec<(DVec2, f64, f64)> {
        let of = |m: &[f64; MOMENTS]| {
            let (at, variance) = self.frame.gaussian(*m);
            (at, variance, m[0])
        };
        self.there(texel).map(of).collect()
    }

    fn there<'a>(&self, texel: &'a [f64]) -> impl Iterator<Item = &'a [f64; MOMENTS]> {
        let all = texel.as_chunks::<MOMENTS>().0;
        let mass: f64 = all.iter().map(|m| m[0]).sum();
        all.iter().filter(move |m| m[0] > LEAST_SHARE * mass)
    }

    /// The lobes of a texel, of weights that sum to 1; and its mass.
    pub(crate) fn decode(&self, texel: &[f64]) -> (Vec<Decoded>, f64) {
        let mass: f64 = self.there(texel).map(|m| m[0]).sum();
        let lobe = |m: &[f64; MOMENTS]| {
            let (at, variance) = self.frame.gaussian(*m);
            let mu = stereographic::direction(at);
            let round = Lobe { mu, kappa: stereographic::scale(at).powi(2) / variance, weight: m[0] / mass };
            let normal = if self.normals { stereographic::direction(DVec2::new(m[4], m[5]) / m[0]) } else { mu };
            Decoded { lobe: elliptic::Lobe::from(round), normal, own: 1.0 / self.frame.own.max(1e-30), colour: None }
        };
        (self.there(texel).map(lobe).collect(), mass)
    }

    /// How far the Gaussians of neighbouring texels of a level are from each other: the mean over texels and their neighbours in the same
    /// row and column of the paper's exponent, the squared distances of means by the neighbours' shares. Level 0 is that of `map`.
    pub fn energy(&self, map: &BrdfMap, level: usize) -> f64 {
        let [w, h] = (0..level).fold(self.size, |size, _| crate::texture::halved(size)).map(|side| side as usize);
        let area: Area = |_| 1.0;
        let means = |i: usize| {
            let texel = self.texel(map, area, level, i).unwrap_or_default();
            let mass: f64 = texel.as_chunks::<MOMENTS>().0.iter().map(|m| m[0]).sum();
            let of = |m: &[f64; MOMENTS]| (m[0] / mass, self.frame.gaussian(*m).0);
            texel.as_chunks::<MOMENTS>().0.iter().map(of).collect::<Vec<_>>()
        };
        let all: Vec<_> = (0..w * h).map(means).collect();
        let (mut sum, mut count) = (0.0, 0.0f64);
        for i in 0..w * h {
            let right = (i % w + 1 < w).then_some(i + 1);
            for k in right.into_iter().chain((i + w < w * h).then_some(i + w)) {
                let both = all[i].iter().zip(&all[k]).filter(|(a, b)| a.0 > LEAST_SHARE && b.0 > LEAST_SHARE);
                sum += both.map(|(a, b)| b.0 * (a.1 - b.1).length_squared()).sum::<f64>();
                count += 1.0;
            }
        }
        sum / count.max(1.0)
    }
}
