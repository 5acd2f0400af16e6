//! The truth for filtered materials: the mean over each pixel of what points in it show, positions and directions sampled
//! jointly.
//!
//! A pixel's box is cut into up to 16x16 cells. A frame of the renderer with the filter `point` shows one position in each
//! cell, all at the same place in theirs; places are points of a Sobol sequence, scrambled anew for each of two independent
//! halves of the work. Radiance and coverage of all positions, background too, are averaged in f64. Maps have no mips: every
//! position sees the base level of colours as of normals and roughness, bilinear.
//!
//! With the estimator `mis` a position takes two directions, one from the reflectance and one from the environment under the
//! balance heuristic, and N sub-samples are N/2 positions: the heuristic weighs both densities at one surface point, which a
//! pair at different points does not have. With `brdf`, and where only points and directions shine, which need none, a
//! position is one sub-sample. Each area light takes one direction more at each position.

use crate::Rate;
use crate::config::{Config, Estimator};
use crate::distribution::Filter;
use crate::frequency::allocation::Allocation;
use crate::offline::bench::quality::{self, Frame, Noise};
use crate::offline::error::{Error, Result};
use crate::offline::image_io::LinearImage;
use crate::offline::render::Settings;
use crate::offline::session::Session;
use crate::offline::window::Window;
use crate::offline::world::World;
use crate::sampling::sobol;
use crate::texture::{MAX_CLASSES, Texture};
use glam::DVec2;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Joint sub-samples of a pixel where none are asked for.
pub const DEFAULT_SAMPLES: u32 = 4096;
/// The fewest and the most.
pub const SAMPLES: [u32; 2] = [2, 1 << 24];
/// The most cells a side of a pixel.
const MOST_CELLS: u32 = 16;
/// The most positions a side of a frame: larger images are made of several.
const MOST_SIDE: u32 = 2048;

/// How positions are spread over pixels and frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    image: [u32; 2],
    /// A side of a pixel.
    cells: u32,
    /// Positions in each cell of one half.
    places: u32,
    /// Parts of the image, and pixels of each.
    tiles: [u32; 2],
    tile: [u32; 2],
}

impl Layout {
    /// Of at least `samples` sub-samples a pixel in two halves, at `directions` a position.
    pub fn new(image: [u32; 2], samples: u32, directions: u32) -> Self {
        let positions = samples.div_ceil(directions.max(1)).max(2);
        let mut cells = MOST_CELLS;
        while 2 * cells * cells > positions {
            cells /= 2;
        }
        let tiles = image.map(|e| e.div_ceil(MOST_SIDE / cells));
        let tile = [0, 1].map(|i| image[i].div_ceil(tiles[i]));
        Self { image, cells, places: positions.div_ceil(2 * cells * cells), tiles, tile }
    }

    /// Positions a frame.
    pub fn extent(&self) -> [u32; 2] {
        self.tile.map(|e| e * self.cells)
    }

    /// Frames of one half.
    fn frames(&self) -> u32 {
        self.places * self.tiles[0] * self.tiles[1]
    }

    /// Positions a pixel.
    fn positions(&self) -> u32 {
        2 * self.places * self.cells * self.cells
    }

    /// The first pixel of part number `tile`.
    fn origin(&self, tile: u32) -> [u32; 2] {
        [tile % self.tiles[0] * self.tile[0], tile / self.tiles[0] * self.tile[1]]
    }

    /// What a frame of part number `tile` shows whose positions are at `place` in their cells.
    fn window(&self, tile: u32, place: DVec2) -> Window {
        let vector = |pixels: [u32; 2]| DVec2::from(pixels.map(f64::from));
        let corner = vector(self.origin(tile)) + (place - 0.5) / f64::from(self.cells);
        Window { image: self.image, corner, size: vector(self.tile) }
    }

    /// Adds the sums over each pixel of a frame of part number `tile` to those of the image.
    fn add(&self, tile: u32, rgba: &[f32], sums: &mut [f64]) {
        let ([left, top], [width, height]) = (self.origin(tile).map(|e| e as usize), self.image.map(|e| e as usize));
        let (cells, columns) = (self.cells as usize, self.extent()[0] as usize);
        let rows = sums.par_chunks_mut(4 * width).skip(top).take((self.tile[1] as usize).min(height.saturating_sub(top)));
        rows.zip(rgba.par_chunks(4 * columns * cells)).for_each(|(sums, rows)| {
            for row in rows.chunks(4 * columns) {
                // What lies beyond the image has no sum.
                for (sum, positions) in sums.chunks_exact_mut(4).skip(left).zip(row.chunks_exact(4 * cells)) {
                    for position in positions.chunks_exact(4) {
                        sum.iter_mut().zip(position).for_each(|(s, v)| *s += f64::from(*v));
                    }
                }
            }
        });
    }
}

/// A supersampled image.
pub(super) struct Supersampled {
    pub image: LinearImage,
    /// Absent where nothing is seen.
    pub noise: Option<Noise>,
    /// Over all pixels.
    pub coverage: f64,
}

impl Settings {
    /// The configuration of the frames of `samples` sub-samples a pixel of `world`.
    pub(super) fn supersampled(&self, world: &World, samples: u32) -> Result<Config> {
        let refuse = |yes: bool, what: &str, expected: &str, got: String| {
            let expected = format!("{expected} with --filter supersample");
            if yes { Err(Error::argument(what, expected, got)) } else { Ok(()) }
        };
        let Config { rate, samples_per_side, mut estimator, .. } = self.config;
        refuse(rate != Rate::Full, "--rate", "full", format!("{rate:?}"))?;
        refuse(samples_per_side != 1, "--aa", "1, as positions are", samples_per_side.pow(2).to_string())?;
        let known = [Estimator::Mis, Estimator::Brdf].contains(&estimator);
        refuse(!known, "--estimator", "mis or brdf", format!("{estimator:?}"))?;
        refuse(self.reference.is_some(), "--reference", "none", self.reference.unwrap_or_default().to_string())?;
        refuse(!self.aovs.is_empty(), "--aov", "none", format!("{} layers", self.aovs.len()))?;
        refuse(world.shadows.is_some(), "lights.shadow", "none", "masks of whole pixels".into())?;
        let [least, most] = SAMPLES;
        refuse(!(least..=most).contains(&samples), "--samples", &format!("{least} to {most}"), samples.to_string())?;
        let shines = world.environment.as_ref().is_some_and(|e| e.intensity > 0.0);
        if !shines && !world.lights.iter().any(|light| light.is_area()) {
            estimator = Estimator::Brdf;
        }
        let config = Config {
            frames_in_flight: 1,
            estimator,
            directions: directions(estimator),
            allocation: Allocation::Constant,
            filter: Filter::Point,
            geometric: false,
            curvature: false,
            ..self.config.clone()
        };
        config.validate()?;
        Ok(Config { extent: Layout::new(config.extent, samples, config.directions).extent(), ..config })
    }
}

/// At each position.
fn directions(estimator: Estimator) -> u32 {
    if estimator == Estimator::Mis { 2 } else { 1 }
}

/// How `samples` sub-samples a pixel are laid out for frames of `config`, as [`Settings::supersampled`] has it.
pub(super) fn layout(settings: &Settings, config: &Config, samples: u32) -> Layout {
    Layout::new(settings.config.extent, samples, config.directions)
}

/// Frames of the renderer that make an image.
pub(super) fn frames(settings: &Settings, config: &Config, samples: u32) -> u32 {
    layout(settings, config, samples).frames().saturating_mul(2)
}

/// `world` with the base levels of its maps alone.
pub(super) fn at_base(world: &World) -> World {
    let mut world = world.clone();
    let mut known: BTreeMap<usize, Arc<Texture>> = BTreeMap::new();
    let mut kinds = Vec::new();
    for texture in world.materials.iter().flat_map(|m| m.maps.textures()).flatten() {
        known.entry(Arc::as_ptr(texture) as usize).or_insert_with(|| Arc::new(texture.base()));
        let kind = (texture.size(), texture.format());
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    if kinds.len() > MAX_CLASSES {
        // Some are resampled, with mips of their own, beside others; a sixteenth of a pixel hardly reaches them.
        return world;
    }
    let base = |texture: &mut Arc<Texture>| {
        if let Some(base) = known.get(&(Arc::as_ptr(texture) as usize)) {
            *texture = Arc::clone(base);
        }
    };
    for maps in world.materials.iter_mut().map(|m| &mut m.maps) {
        [&mut maps.albedo, &mut maps.specular, &mut maps.normal].into_iter().flatten().for_each(base);
        maps.roughness.iter_mut().for_each(|(texture, _)| base(texture));
    }
    world
}

/// Means over each pixel, row-major `R G B A`, of half number `half` of what `layout` says. `each` is called after every frame.
pub(super) fn half(
    session: &mut Session,
    layout: &Layout,
    [seed, half]: [u32; 2],
    each: &mut dyn FnMut(&Session),
) -> Result<Vec<f64>> {
    let mut sums = vec![0.0; 4 * layout.image[0] as usize * layout.image[1] as usize];
    let scramble = sobol::hash(seed ^ sobol::hash(half));
    let mut frame = half.wrapping_mul(layout.frames());
    for place in 0..layout.places {
        let [x, y] = sobol::point(place, scramble).map(sobol::to_unit);
        for tile in 0..layout.tiles[0] * layout.tiles[1] {
            session.look_through(&layout.window(tile, DVec2::new(x, y)));
            session.frame([seed, frame])?;
            frame = frame.wrapping_add(1);
            each(session);
            let (bytes, ..) = session.image("resolved")?;
            layout.add(tile, &bytemuck::pod_collect_to_vec::<u8, f32>(&bytes), &mut sums);
        }
    }
    let count = f64::from(layout.positions() / 2);
    sums.iter_mut().for_each(|s| *s /= count);
    Ok(sums)
}

/// What the session shows, as image `number`, in `samples` sub-samples a pixel.
pub(super) fn image(
    session: &mut Session,
    settings: &Settings,
    config: &Config,
    [samples, number]: [u32; 2],
    each: &mut dyn FnMut(&Session),
) -> Result<Supersampled> {
    let layout = layout(settings, config, samples);
    let mut take = |which: u32| half(session, &layout, [settings.seed, number.wrapping_mul(2).wrapping_add(which)], each);
    let (a, b) = (take(0)?, take(1)?);
    let mean: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (a + b) / 2.0).collect();
    let channel = |c: usize| mean.iter().skip(c).step_by(4).map(|v| *v as f32).collect::<Vec<_>>();
    let [width, height] = layout.image;
    let channels = ["R", "G", "B", "A"].iter().enumerate().map(|(c, name)| (name.to_string(), channel(c))).collect();
    let picture = |half: &[f64]| Frame::of(layout.image, &half.iter().map(|v| *v as f32).collect::<Vec<_>>()).picture;
    let mask: Vec<bool> = mean.iter().skip(3).step_by(4).map(|a| *a > 0.0).collect();
    let noise = mask.contains(&true).then(|| quality::noise([&picture(&a), &picture(&b)], &mask)).transpose()?;
    let coverage = mean.iter().skip(3).step_by(4).sum();
    Ok(Supersampled { image: LinearImage { width, height, channels }, noise, coverage })
}

/// Sub-samples that are taken of a wholly covered pixel.
pub(super) fn taken(settings: &Settings, config: &Config, samples: u32) -> u32 {
    layout(settings, config, samples).positions() * config.directions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_have_the_positions_that_are_asked_for() {
        for (samples, directions, cells, places) in
            [(4096, 2, 16, 4), (4096, 1, 16, 8), (512, 1, 16, 1), (511, 1, 8, 4), (64, 2, 4, 1), (2, 2, 1, 1), (5000, 2, 16, 5)]
        {
            let layout = Layout::new([300, 20], samples, directions);
            assert_eq!((layout.cells, layout.places), (cells, places), "{samples} {directions}");
            assert!(layout.positions() * directions >= samples);
            assert!(layout.extent().iter().all(|e| *e <= MOST_SIDE));
            assert!(layout.tiles[0] * layout.tile[0] >= 300 && layout.tiles[1] * layout.tile[1] >= 20);
        }
        let wide = Layout::new([300, 20], 512, 1);
        assert_eq!((wide.tiles, wide.tile, wide.frames()), ([3, 1], [100, 20], 3));
    }

    #[test]
    fn positions_fall_into_their_own_pixels() {
        let layout = Layout { image: [5, 3], cells: 2, places: 1, tiles: [2, 2], tile: [3, 2] };
        let mut sums = vec![0.0; 5 * 3 * 4];
        for tile in 0..4 {
            let [left, top] = layout.origin(tile);
            let window = layout.window(tile, DVec2::new(0.5, 0.5));
            assert_eq!(window.corner, DVec2::new(left.into(), top.into()));
            // Each position says which pixel it is in.
            let [columns, rows] = layout.extent();
            let pixel = |i: u32| [left + i % columns / 2, top + i / columns / 2];
            let rgba: Vec<f32> = (0..columns * rows).map(pixel).flat_map(|[x, y]| [x as f32, y as f32, 0.0, 1.0]).collect();
            layout.add(tile, &rgba, &mut sums);
        }
        for (i, sum) in sums.chunks(4).enumerate() {
            assert_eq!(sum, [4.0 * (i % 5) as f64, 4.0 * (i / 5) as f64, 0.0, 4.0], "pixel {i}");
        }
    }
}
