//! Angular bandwidth of reflected lobes (Bagher et al. 2011, section 2.4): for 16 view angles, the local frequency of
//! reflectance times cosine over the hemisphere of light directions, by the environment's wavelets and at their threshold. A
//! material takes a strip of 16 tiles of 16 x 16 texels, each the mean of its samples, weighted by what they reflect: an even
//! mean loses narrow lobes among their dark surroundings. Twin of `glsl/include/lobe_bandwidth.glsl`, which says where.
//!
//! Beside [`analytic`] the estimate reads 1.1 to 1.5 times for Gaussian lobes (concentrations 1000 to 10) and 1.1 to 2 times for
//! GGX, whose tails go on: on the safe side.

use crate::distribution::reflected::ReflectedLobe;
use crate::distribution::vmf;
use crate::frequency::environment::FLOOR;
use crate::frequency::wavelet::{Grid, LocalFrequency};
use crate::reflectance::{Model, Reflectance, turned};
use crate::sampling::luminance;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, SQRT_2, TAU};

/// View angles, evenly spaced in theta, and texels a side of the tile of each.
pub const SIDE: usize = 16;
/// Columns of a material's strip of [`SIDE`] rows.
pub const WIDTH: usize = SIDE * SIDE;
/// Samples a side of the slices that are analysed.
const SLICE: usize = 256;
/// Radians between samples: the hemisphere's 2 pi steradians over the pi/4 of the square that its disc fills.
const SPACING: f64 = 2.0 * SQRT_2 / SLICE as f64;
/// Turns of the surface that are tried where they matter.
const TURNS: usize = 4;
/// Of a normal distribution over the plane 95 % lie within this many standard deviations of its centre: sqrt(-2 ln 0.05).
/// (Bagher's section 2 has 1.645, the one-sided quantile on a line.)
const QUANTILE: f64 = 2.447_746_830_680_816;
/// Lobes whose standard deviation is below this many samples are not left to the slices.
const RESOLVED: f64 = 2.0;

/// A material's bandwidths in cycles/radian.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeBandwidth {
    texels: Vec<f32>,
}

impl LobeBandwidth {
    /// Analyses the luminance of `model` at threshold `eps`. Where turning the surface matters, the largest over four turns counts. Lobes too
    /// narrow for the slices (a GGX alpha below 0.02 or so) have their analytic bandwidth in every direction.
    pub fn build(model: &Model, eps: f64) -> Self {
        let turns = if model.isotropic() { 1 } else { TURNS };
        let mut tiles = vec![0.0; SIDE * SIDE * SIDE];
        // Independent tiles, a few at a time: each takes some ten megabytes while it is made.
        std::thread::scope(|scope| {
            for (first, group) in tiles.chunks_mut(4 * SIDE * SIDE).enumerate() {
                scope.spawn(move || {
                    for (angle, tile) in group.chunks_exact_mut(SIDE * SIDE).enumerate() {
                        let theta = view_angle(4 * first + angle);
                        match analytic(model, theta.cos()).filter(|narrow| narrow.deviation < RESOLVED * SPACING) {
                            Some(narrow) => tile.fill(narrow.bandwidth as f32),
                            None => {
                                (0..turns).for_each(|k| analyse(model, eps, [theta, TAU * k as f64 / (2 * turns) as f64], tile));
                            }
                        }
                    }
                });
            }
        });
        Self { texels: strip(&tiles) }
    }

    /// From what [`Self::texels`] gave; `None` if there are not as many or some are no frequencies.
    pub fn from_texels(texels: Vec<f32>) -> Option<Self> {
        let whole = texels.len() == WIDTH * SIDE && texels.iter().all(|b| b.is_finite() && *b >= 0.0);
        whole.then_some(Self { texels })
    }

    /// [`SIDE`] rows of [`WIDTH`] texels in cycles/radian: the tiles of the view angles side by side.
    pub fn texels(&self) -> &[f32] {
        &self.texels
    }

    /// The bandwidth around light direction `wi`, seen from `wo` (unit, z the normal), of the nearest texel.
    pub fn at(&self, wi: DVec3, wo: DVec3) -> f64 {
        let [x, y] = texel(wi, wo);
        self.texels.get(y * WIDTH + x).copied().unwrap_or_default().into()
    }

    /// The strip from the mean of the tiles and their first `components` principal components (section 2.4, figure 8), and its
    /// error: the root of the squared differences over that of the squared values.
    pub fn compressed(&self, components: usize) -> (Self, f64) {
        let tile = |angle: usize| move |i: usize| (i / SIDE) * WIDTH + angle * SIDE + i % SIDE;
        let all: Vec<Vec<f64>> = (0..SIDE).map(|a| (0..WIDTH).map(|i| f64::from(self.texels[tile(a)(i)])).collect()).collect();
        let mean: Vec<f64> = (0..WIDTH).map(|i| all.iter().map(|t| t[i]).sum::<f64>() / SIDE as f64).collect();
        let centred: Vec<Vec<f64>> = all.iter().map(|t| t.iter().zip(&mean).map(|(a, m)| a - m).collect()).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        // The components are combinations of the tiles: those of the small matrix of their products.
        let weights = principal(centred.iter().map(|a| centred.iter().map(|b| dot(a, b)).collect()).collect());
        let mut rest = centred.clone();
        for w in weights.iter().take(components) {
            let component: Vec<f64> = (0..WIDTH).map(|i| w.iter().zip(&centred).map(|(w, t)| w * t[i]).sum()).collect();
            for (left, w) in rest.iter_mut().zip(w) {
                left.iter_mut().zip(&component).for_each(|(left, c)| *left -= w * c);
            }
        }
        let squares = |v: &[Vec<f64>]| v.iter().map(|t| dot(t, t)).sum::<f64>();
        let error = if squares(&all) > 0.0 { (squares(&rest) / squares(&all)).sqrt() } else { 0.0 };
        let mut texels = self.texels.clone();
        for (angle, (all, rest)) in all.iter().zip(&rest).enumerate() {
            for i in 0..WIDTH {
                texels[tile(angle)(i)] = (all[i] - rest[i]).max(0.0) as f32;
            }
        }
        (Self { texels }, error)
    }

    /// The fewest principal components that hold `share` of the energy around the mean of the tiles.
    pub fn components_for(&self, share: f64) -> usize {
        let lost = |components| self.compressed(components).1.powi(2);
        let most = (1.0 - share) * lost(0);
        (0..SIDE).find(|&components| lost(components) <= most).unwrap_or(SIDE)
    }
}

/// A narrow lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Narrow {
    /// Cycles/radian.
    pub bandwidth: f64,
    /// Standard deviation of the reflected lobe in radians.
    pub deviation: f64,
}

/// The narrowest lobe of a model that says how concentrated its normals are, seen at `cosine`: a lobe of concentration k about
/// mu reflects into one of k / (4 |mu.wo|) (Wang et al. 2009, "All-frequency rendering of dynamic, spatially-varying
/// reflectance", section 3). GGX counts as the Gaussian of its centre, k = 2 / alpha^2. `None` for tables and where nothing shines.
pub fn analytic(model: &Model, cosine: f64) -> Option<Narrow> {
    let lobes: Vec<(DVec3, f64)> = match model {
        Model::Table(_) | Model::Turned(_) => Vec::new(),
        Model::Ggx(m) => vec![(DVec3::Z, if m.f0 == DVec3::ZERO { 0.0 } else { 2.0 / (m.alpha * m.alpha) })],
        Model::BlinnPhong(m) => vec![(DVec3::Z, if m.specular == DVec3::ZERO { 0.0 } else { m.exponent })],
        Model::Vmf(m) => m.lobes().iter().map(|l| (l.mu, if l.weight > 0.0 { l.kappa } else { 0.0 })).collect(),
    };
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    // Turned towards the viewer's far side, where the reflected lobe is narrowest.
    let towards = |mu: DVec3| (mu.z * cosine - mu.x.hypot(mu.y) * sine).abs().max(0.05);
    let narrowest = lobes.into_iter().map(|(mu, kappa)| kappa / (4.0 * towards(mu))).fold(0.0, f64::max);
    (narrowest > 0.0).then(|| Narrow { bandwidth: lobe_cycles(narrowest), deviation: narrowest.sqrt().recip() })
}

/// Cycles/radian of a lobe of light directions of concentration `kappa`: its power spectrum is normal, with deviation
/// sqrt(kappa / 2) / 2 pi.
pub fn lobe_cycles(kappa: f64) -> f64 {
    QUANTILE * (kappa / 2.0).sqrt() / TAU
}

/// Concentration that stands for a cosine over the horizon.
const COSINE: f64 = 2.0;

/// Cycles/radian about the light direction `wi` (unit, z the normal) where the reflectance is `lobes`, as a filter finds them, each with how many
/// times narrower than its concentration says it is across its axis, and a diffuse part in 1/sr: the mean over them by what each
/// reflects from there, or that of the narrowest. Twin of `glsl/include/found_bandwidth.glsl`.
pub fn found(lobes: &[(ReflectedLobe, f64)], diffuse: f64, wi: DVec3) -> f64 {
    let share = |(l, narrower): &(ReflectedLobe, f64)| {
        let height = vmf::normalisation(l.kappa) * (-0.5 * l.kappa * (wi - l.direction).length_squared()).exp();
        (l.weight.element_sum() / 3.0 * height, lobe_cycles(l.kappa) * narrower)
    };
    let each: Vec<_> = lobes.iter().map(share).chain([(diffuse * wi.z, lobe_cycles(COSINE))]).collect();
    let weights: f64 = each.iter().map(|(weight, _)| weight).sum();
    match weights > 0.0 {
        true => each.iter().map(|(weight, cycles)| weight * cycles).sum::<f64>() / weights,
        false => each[..lobes.len()].iter().map(|(_, cycles)| *cycles).fold(0.0, f64::max),
    }
}

/// Theta of the viewer of tile `angle`.
fn view_angle(angle: usize) -> f64 {
    (angle as f64 + 0.5) / SIDE as f64 * FRAC_PI_2
}

/// Raises `tile` to the bandwidths of one slice, seen at `theta` with the surface turned by `turn`.
fn analyse(model: &Model, eps: f64, [theta, turn]: [f64; 2], tile: &mut [f32]) {
    let turn = DVec2::from_angle(turn);
    let wo = turned(turn, DVec3::new(theta.sin(), 0.0, theta.cos()));
    let values: Vec<f64> = (0..SLICE * SLICE)
        .map(|i| {
            let square = DVec2::new((i % SLICE) as f64 + 0.5, (i / SLICE) as f64 + 0.5) / SLICE as f64;
            direction(square).map_or(0.0, |wi| luminance(model.evaluate(turned(turn, wi), wo)) * wi.z)
        })
        .collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let slice = Grid { width: SLICE, values };
    let [across, down] = LocalFrequency::of(&slice, eps, FLOOR * mean).axes;
    // Blocks of two samples a side of a texel.
    let blocks = SLICE / 2 / SIDE;
    for (i, texel) in tile.iter_mut().enumerate() {
        let (x, y) = (i % SIDE * blocks, i / SIDE * blocks);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (x, y) in (0..blocks * blocks).map(|k| (x + k % blocks, y + k / blocks)) {
            let at = y * across.width + x;
            // What shines counts, and a little what does not, so that dark blocks have a mean too.
            let weight = slice.values[2 * y * SLICE + 2 * x] + 1e-6 * mean;
            sum += weight * across.values[at].max(down.values[at]);
            weights += weight;
        }
        if weights > 0.0 {
            *texel = texel.max((sum / weights / SPACING) as f32);
        }
    }
}

/// The tiles side by side.
fn strip(tiles: &[f32]) -> Vec<f32> {
    let at = |x: usize, y: usize| tiles[x / SIDE * WIDTH + y * SIDE + x % SIDE];
    (0..WIDTH * SIDE).map(|i| at(i % WIDTH, i / WIDTH)).collect()
}

/// The light direction at a place of the unit square: the disc that fills it is the hemisphere, equal in area (Lambert's
/// azimuthal projection). `None` in the corners.
fn direction(square: DVec2) -> Option<DVec3> {
    let p = 2.0 * square - 1.0;
    let r = p.length_squared();
    (r < 1.0).then(|| (p * (2.0 - r).sqrt()).extend(1.0 - r))
}

/// Column and row in a material's strip of light direction `wi` seen from `wo`, both unit with z the normal and above the
/// horizon. The tiles have the viewer at azimuth 0.
pub fn texel(wi: DVec3, wo: DVec3) -> [usize; 2] {
    let sine = wo.x.hypot(wo.y);
    let viewer = if sine > 0.0 { DVec2::new(wo.x, wo.y) / sine } else { DVec2::X };
    let p = DVec2::new(viewer.x * wi.x + viewer.y * wi.y, viewer.x * wi.y - viewer.y * wi.x) / (1.0 + wi.z.max(0.0)).sqrt();
    let side = |c: f64| ((c * SIDE as f64).max(0.0) as usize).min(SIDE - 1);
    [side(wo.z.clamp(0.0, 1.0).acos() / FRAC_PI_2) * SIDE + side(0.5 + 0.5 * p.x), side(0.5 + 0.5 * p.y)]
}

/// Eigenvectors of a symmetric matrix that is not negative, of length one, by falling eigenvalue (Jacobi's method).
fn principal(mut m: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let n = m.len();
    let mut vectors: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for _ in 0..30 {
        for (p, q) in (0..n).flat_map(|p| (p + 1..n).map(move |q| (p, q))) {
            if m[p][q].abs() <= 1e-15 * (m[p][p] * m[q][q]).abs().sqrt() {
                continue;
            }
            let (s, c) = (0.5 * (2.0 * m[p][q]).atan2(m[p][p] - m[q][q])).sin_cos();
            let turn = |a: f64, b: f64| (c * a + s * b, c * b - s * a);
            for row in &mut m {
                (row[p], row[q]) = turn(row[p], row[q]);
            }
            for j in 0..n {
                (m[p][j], m[q][j]) = turn(m[p][j], m[q][j]);
                (vectors[p][j], vectors[q][j]) = turn(vectors[p][j], vectors[q][j]);
            }
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| m[b][b].total_cmp(&m[a][a]));
    order.into_iter().map(|i| std::mem::take(&mut vectors[i])).collect()
}

#[cfg(test)]
#[path = "bandwidth_tests.rs"]
mod tests;
