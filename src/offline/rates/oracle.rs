//! The fewest shaded samples for a given error, found from the converged image: what a rate that knew the result would shade.
//!
//! Every level is reconstructed on its own; a cell then costs the samples that are shaded in it and the error that is left,
//! and the quadtree of least cost follows from the finest cells upwards (as Breiman et al. 1984 prune trees). The price of error
//! is found by bisection over the true reconstruction of the mixture.

use crate::frequency::reconstruction::{self, Pyramid, Sample, Source, Surface};
use crate::offline::error::Result;
use crate::offline::headless::{Headless, Options};
use crate::offline::metrics::{Exposure, encode};
use crate::offline::session::Session;
use crate::offline::world::World;
use crate::sampling::luminance;
use crate::{Config, Estimator, Rate, Requirements};
use glam::DVec3;

/// Directions a sample of the converged image.
pub const REFERENCE: u32 = 1024;
/// Bisections of the price of error.
const STEPS: u32 = 16;

/// What is shaded and what is wrong where levels are reconstructed from converged values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Samples shaded.
    pub shaded: usize,
    /// Mean squared difference over covered samples and channels, of sRGB-encoded values in [0, 1] exposed to a mean luminance
    /// of 0.3.
    pub error: f64,
}

impl Outcome {
    /// Peak signal-to-noise ratio in dB.
    pub fn psnr(self) -> f64 {
        -10.0 * self.error.log10()
    }
}

/// A converged view.
pub struct Oracle {
    surface: Surface,
    /// `R G B` of each sample, of no meaning where nothing is seen, and whether something is.
    frame: Vec<[f32; 4]>,
    shown: Vec<DVec3>,
    exposure: f64,
    covered: usize,
    top: u32,
    /// Of the cells of each level from 0, row by row, where that level is everywhere: samples shaded, and squared error.
    cells: Vec<Vec<(f64, f64)>>,
}

impl Oracle {
    /// Of `surface` with the converged linear `R G B` of its samples (the fourth value is not looked at), for levels up to `top`.
    pub fn new(surface: Surface, radiance: Vec<[f32; 4]>, top: u32) -> Self {
        let covered = surface.samples.iter().flatten().count();
        let seen = |([r, g, b, _], sample): ([f32; 4], &Option<_>)| match sample {
            Some(_) => [r, g, b, 1.0],
            None => [0.0; 4],
        };
        let frame: Vec<[f32; 4]> = radiance.into_iter().zip(&surface.samples).map(seen).collect();
        let mean = frame.iter().map(|texel| luminance(colour(texel))).sum::<f64>() / covered.max(1) as f64;
        let exposure = Exposure::Auto.factor(mean);
        let shown = frame.iter().map(|texel| show(colour(texel), exposure)).collect();
        let mut oracle = Self { surface, frame, shown, exposure, covered, top, cells: Vec::new() };
        oracle.cells = (0..=top).map(|level| oracle.uniform(level)).collect();
        oracle
    }

    /// Linear radiance and coverage of each sample, row by row.
    pub fn frame(&self) -> &[[f32; 4]] {
        &self.frame
    }

    /// Samples that see something.
    pub fn covered(&self) -> usize {
        self.covered
    }

    /// What `levels` of the samples, row by row, come to.
    pub fn outcome(&self, levels: &[u8]) -> Outcome {
        let (pyramid, sources) = self.decide(levels);
        let shaded = sources.iter().flatten().filter(|source| source.is_shaded()).count();
        let error: f64 = self.errors(&pyramid, &sources).sum();
        Outcome { shaded, error: error / (3 * self.covered.max(1)) as f64 }
    }

    /// The levels of the samples, row by row, that cost least, with a squared error (of one channel of one sample) of 1 worth
    /// `price` shaded samples.
    pub fn levels(&self, price: f64) -> Vec<u8> {
        let cost = |&(shaded, error): &(f64, f64)| shaded + price * error;
        let mut best: Vec<f64> = self.cells[0].iter().map(cost).collect();
        let [width, height] = self.surface.extent;
        let mut levels = vec![0; width * height];
        let mut below = self.surface.extent;
        for (level, cells) in (0u8..).zip(&self.cells).skip(1) {
            let extent = self.surface.extent.map(|e| e.div_ceil(1 << level));
            let mut costs = Vec::with_capacity(cells.len());
            for (i, cell) in cells.iter().enumerate() {
                let [x, y] = [i % extent[0], i / extent[0]];
                let children = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[dx, dy]| [2 * x + dx, 2 * y + dy]);
                let within = children.iter().filter(|[x, y]| *x < below[0] && *y < below[1]);
                let split: f64 = within.map(|[x, y]| best[y * below[0] + x]).sum();
                let whole = cost(cell);
                costs.push(whole.min(split));
                if whole <= split {
                    let side = 1 << level;
                    for row in (y * side..(y * side + side).min(height)).map(|y| y * width) {
                        levels[row + x * side..row + (x * side + side).min(width)].fill(level);
                    }
                }
            }
            (best, below) = (costs, extent);
        }
        levels
    }

    /// The levels of the samples, row by row, and what they come to, with the fewest shaded samples that were found for an error
    /// of at most `most`; all samples are shaded where coarser ones do not reach it.
    pub fn cheapest(&self, most: f64) -> (Vec<u8>, Outcome) {
        let finest = vec![0; self.frame.len()];
        let mut best = (self.outcome(&finest), finest);
        // Logarithms of prices: from error that is free to error of half a step of 8 bits that is worth more than its sample.
        let [mut low, mut high] = [-10.0, 20.0];
        for _ in 0..STEPS {
            let middle = 0.5 * (low + high);
            let levels = self.levels(f64::exp2(middle));
            let outcome = self.outcome(&levels);
            if outcome.error > most {
                low = middle;
                continue;
            }
            high = middle;
            if outcome.shaded < best.0.shaded {
                best = (outcome, levels);
            }
        }
        (best.1, best.0)
    }

    fn decide(&self, levels: &[u8]) -> (Pyramid, Vec<Vec<Source>>) {
        let pyramid = Pyramid::new(&self.surface, levels, self.top);
        let sources = reconstruction::classify(&self.surface, &pyramid);
        (pyramid, sources)
    }

    /// The squared errors of all samples, row by row, over their channels.
    fn errors(&self, pyramid: &Pyramid, sources: &[Vec<Source>]) -> impl Iterator<Item = f64> {
        let width = self.surface.extent[0];
        let mut values = reconstruction::upsample(pyramid, sources, |[x, y], _| colour(&self.frame[y * width + x]));
        let finest = values.swap_remove(0).into_iter().zip(&self.shown);
        finest.map(|(value, expected)| value.map_or(0.0, |c| (show(c, self.exposure) - *expected).length_squared()))
    }

    /// Of each cell of `level`, where all samples are at that level.
    fn uniform(&self, level: u32) -> Vec<(f64, f64)> {
        let [width, height] = self.surface.extent;
        let (pyramid, sources) = self.decide(&vec![level as u8; width * height]);
        let columns = width.div_ceil(1 << level);
        let mut cells = vec![(0.0, 0.0); columns * height.div_ceil(1 << level)];
        let mut cell = |[x, y]: [usize; 2], shaded: f64, error: f64| {
            let cell = &mut cells[(y >> level) * columns + (x >> level)];
            *cell = (cell.0 + shaded, cell.1 + error);
        };
        for (level, sources) in sources.iter().enumerate() {
            for (of, _) in pyramid.cells[level].iter().zip(sources).filter(|(_, source)| source.is_shaded()) {
                if let Some(of) = of {
                    cell(of.sample, 1.0, 0.0);
                }
            }
        }
        for (i, error) in self.errors(&pyramid, &sources).enumerate() {
            cell([i % width, i / width], 0.0, error);
        }
        cells
    }
}

fn colour(&[r, g, b, _]: &[f32; 4]) -> DVec3 {
    DVec3::new(r.into(), g.into(), b.into())
}

fn show(linear: DVec3, exposure: f64) -> DVec3 {
    (linear * exposure).map(encode)
}

/// The levels of the samples with the fewest shaded ones that come to no more error than those of [`Rate::Bandwidth`] with the
/// same settings. `seed` is of the frames.
///
/// # Errors
/// The device's.
pub fn levels(world: &World, config: &Config, device: &Options, seed: u32) -> Result<Vec<u8>> {
    let oracle = converged(world, config, device, seed)?;
    let bandwidth = predicted(world, config, device, seed)?;
    Ok(oracle.cheapest(oracle.outcome(&bandwidth).error).0)
}

/// The converged view of `world`.
///
/// # Errors
/// The device's.
pub fn converged(world: &World, config: &Config, device: &Options, seed: u32) -> Result<Oracle> {
    let full = Config { rate: Rate::Full, estimator: Estimator::Mis, directions: REFERENCE, ..config.clone() };
    let mut session = Session::new(Headless::new(device, &Requirements::of(&full))?, world, &full)?;
    session.frame([seed, 0])?;
    let (bytes, ..) = session.image("radiance")?;
    let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
    let top = Config { rate: Rate::Bandwidth, ..config.clone() }.coarsest();
    Ok(Oracle::new(surface(&mut session, world)?, texels, top))
}

/// The levels of [`Rate::Bandwidth`] in `world`.
///
/// # Errors
/// The device's.
pub fn predicted(world: &World, config: &Config, device: &Options, seed: u32) -> Result<Vec<u8>> {
    let predicted = Config { rate: Rate::Bandwidth, ..config.clone() };
    let mut session = Session::new(Headless::new(device, &Requirements::of(&predicted))?, world, &predicted)?;
    session.frame([seed, 0])?;
    let (bytes, ..) = session.image("level")?;
    let levels = bytemuck::pod_collect_to_vec::<u8, u32>(&bytes);
    // Where the prediction gave up, it has left most levels as they were.
    let fell_back = session.words("block arguments")?.get(3) == Some(&0);
    Ok(levels.into_iter().map(|level| if fell_back { 0 } else { level.min(255) as u8 }).collect())
}

/// The surfaces that the last frame of `session` saw of `world`.
fn surface(session: &mut Session, world: &World) -> Result<Surface> {
    let (texels, _, extent) = session.image("surface")?;
    let (ids, ..) = session.image("ids")?;
    let (texels, ids): (Vec<[f32; 4]>, Vec<u32>) = (bytemuck::pod_collect_to_vec(&texels), bytemuck::pod_collect_to_vec(&ids));
    let sample = |(&[x, y, z, depth], id): (&[f32; 4], &u32)| {
        let object = id.checked_sub(1)? >> 16;
        Some(Sample { object, depth: depth.into(), normal: DVec3::new(x.into(), y.into(), z.into()) })
    };
    let samples = texels.iter().zip(&ids).map(sample).collect();
    let tan = (world.camera.fov_y.to_radians() / 2.0).tan();
    let aspect = f64::from(extent[0]) / f64::from(extent[1]);
    let axes = world.camera.world_from_view();
    Ok(Surface { extent: extent.map(|e| e as usize), samples, axes, ray: [tan * aspect, -tan, 0.0, 0.0] })
}
