//! Coarse-to-fine shading in f64 on plain arrays (Bagher 2011, section 3): which cells are shaded, and what the others take
//! from their parents. Twin of `pyramid`, `classify` and `upsample` (`glsl/include/levels.glsl`).
//!
//! A cell of level l is 2^l x 2^l samples; levels are over a sample, 0 is finest. The printed pseudo-code leaves holes; here
//! every covered cell whose level is at least its own gets a value, so every covered sample does.

use glam::{DMat3, DVec2, DVec3};

/// Distances from the surface's plane are weighted by a Gaussian of this many footprints of the child. Half a footprint instead
/// of two is worth 1.5 dB on a knot at half the rate and shades 0.4 % more; a quarter adds 0.3 dB and shades 2 % more.
pub const PLANE: f64 = 0.5;
/// The valid share of the parents' weight that up-sampling takes.
pub const ACCEPT: f64 = 0.5;

/// A surface seen at a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The object's number.
    pub object: u32,
    /// Distance along the view axis.
    pub depth: f64,
    /// Unit normal in world space.
    pub normal: DVec3,
}

/// All samples of a view.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Samples across and down.
    pub extent: [usize; 2],
    /// Row by row; `None` where nothing is seen.
    pub samples: Vec<Option<Sample>>,
    /// Columns right, up and backward in world space.
    pub axes: DMat3,
    /// View x and y at depth 1 = `ndc * ray.xy + ray.zw`.
    pub ray: [f64; 4],
}

impl Surface {
    fn at(&self, [x, y]: [usize; 2]) -> Option<Sample> {
        self.samples.get(y * self.extent[0] + x).copied().flatten().filter(|_| x < self.extent[0])
    }
}

/// A cell of any level with a covered sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The least level of its covered samples, at most the pyramid's coarsest.
    pub level: u32,
    /// The sample that stands for it: of its children's, the one nearest to its middle.
    pub sample: [usize; 2],
    /// The object seen there.
    pub object: u32,
    /// The depth there.
    pub depth: f64,
}

/// The cells of all levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Pyramid {
    /// Cells across and down, by level from 0.
    pub extents: Vec<[usize; 2]>,
    /// By level from 0, row by row; `None` where no sample is covered.
    pub cells: Vec<Vec<Option<Cell>>>,
}

impl Pyramid {
    /// Levels 0 to `top` over `surface`, whose samples have `levels`, row by row.
    pub fn new(surface: &Surface, levels: &[u8], top: u32) -> Self {
        let finest = |(i, sample): (usize, &Option<Sample>)| {
            let position = [i % surface.extent[0], i / surface.extent[0]];
            let level = levels.get(i).map_or(0, |l| u32::from(*l)).min(top);
            sample.map(|s| Cell { level, sample: position, object: s.object, depth: s.depth })
        };
        let mut pyramid =
            Self { extents: vec![surface.extent], cells: vec![surface.samples.iter().enumerate().map(finest).collect()] };
        for level in 1..=top {
            let extent = surface.extent.map(|e| e.div_ceil(1 << level));
            let cells = (0..extent[0] * extent[1]).map(|i| pyramid.above(level, [i % extent[0], i / extent[0]])).collect();
            pyramid.extents.push(extent);
            pyramid.cells.push(cells);
        }
        pyramid
    }

    /// The cell of `level` at `position`, `None` out of the image as well.
    pub fn cell(&self, level: u32, [x, y]: [usize; 2]) -> Option<Cell> {
        let [width, height] = self.extents.get(level as usize).copied().unwrap_or_default();
        if x >= width || y >= height {
            return None;
        }
        self.cells.get(level as usize)?.get(y * width + x).copied().flatten()
    }

    fn above(&self, level: u32, position: [usize; 2]) -> Option<Cell> {
        let children = children(position).into_iter().filter_map(|child| self.cell(level - 1, child));
        let middle = position.map(|p| ((p << level) + (1 << (level - 1))) as i64);
        let distance = |cell: &Cell| {
            let [x, y] = [0, 1].map(|axis| cell.sample[axis] as i64 - middle[axis]);
            x * x + y * y
        };
        let least = children.clone().map(|cell| cell.level).min()?;
        children.min_by_key(distance).map(|nearest| Cell { level: least, ..nearest })
    }
}

/// The four cells of the level below, row by row.
fn children([x, y]: [usize; 2]) -> [[usize; 2]; 4] {
    [[2 * x, 2 * y], [2 * x + 1, 2 * y], [2 * x, 2 * y + 1], [2 * x + 1, 2 * y + 1]]
}

/// Where a cell's value comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// It has none: nothing is seen, or all of it is finer.
    None,
    /// Its representative sample is shaded.
    Shading,
    /// Four parents.
    Parents(Weights),
    /// It is shaded, because its parents have too little valid weight.
    Refused(Weights),
}

impl Source {
    /// Whether the cell's representative sample is shaded.
    pub fn is_shaded(self) -> bool {
        matches!(self, Self::Shading | Self::Refused(_))
    }
}

/// What a cell takes from its four parents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// From left to right at the top and at the bottom, then from top to bottom: 0 to 1 in steps of 1/255.
    pub steps: [f64; 3],
    /// The valid share of the parents' weight.
    pub valid: f64,
}

/// The sources of all cells by level from 0, row by row.
pub fn classify(surface: &Surface, pyramid: &Pyramid) -> Vec<Vec<Source>> {
    let top = pyramid.cells.len() - 1;
    (0u32..)
        .zip(&pyramid.extents)
        .map(|(level, &[width, height])| {
            let source = |i: usize| {
                let position = [i % width, i / width];
                match pyramid.cell(level, position) {
                    Some(cell) if cell.level >= level && level as usize == top => Source::Shading,
                    Some(cell) if cell.level >= level => decide(surface, pyramid, level, position, &cell),
                    _ => Source::None,
                }
            };
            (0..width * height).map(source).collect()
        })
        .collect()
}

/// Of a cell below the coarsest level, whose own level is at least `level`.
fn decide(surface: &Surface, pyramid: &Pyramid, level: u32, position: [usize; 2], cell: &Cell) -> Source {
    let valid = |parent: &Cell| parent.level > level && parent.object == cell.object;
    let own = pyramid.cell(level + 1, position.map(|p| p / 2));
    if !own.is_some_and(|own| valid(&own)) {
        return Source::Shading;
    }
    let Some(child) = Child::of(surface, cell, level) else { return Source::None };
    let (mut weights, mut accepted, mut all) = ([0.0; 4], 0.0, 0.0);
    for (weight, parent) in weights.iter_mut().zip(parents(position)) {
        let Some(parent) = within(parent, pyramid.extents[level as usize + 1]) else { continue };
        let middle = parent.map(|p| (p << (level + 1)) + (1 << level));
        let found = pyramid.cell(level + 1, parent);
        let offset = child.offset(found.map_or(middle, |cell| cell.sample));
        let alpha = child.alpha(offset);
        all += alpha;
        if let Some(parent) = found.filter(valid) {
            let part = alpha * child.plane(offset, parent.depth);
            accepted += part;
            *weight = part * child.anisotropic(offset);
        }
    }
    let [a, b, c, d] = weights;
    let step = |part: f64, whole: f64| if whole > 0.0 { (part / whole * 255.0).round() / 255.0 } else { 0.0 };
    let steps = [step(b, a + b), step(d, c + d), step(c + d, a + b + c + d)];
    let weights = Weights { steps, valid: accepted / all };
    if accepted >= ACCEPT * all && a + b + c + d > 0.0 { Source::Parents(weights) } else { Source::Refused(weights) }
}

/// The places of the four parents around a cell, which may be out of the image: row by row, its own among them.
fn parents(position: [usize; 2]) -> [[i64; 2]; 4] {
    // Odd cells look right and down, even ones left and up.
    let [x, y] = position.map(|p| (p as i64 + 1) / 2 - 1);
    [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]
}

fn within(position: [i64; 2], extent: [usize; 2]) -> Option<[usize; 2]> {
    let [x, y] = position.map(|p| usize::try_from(p).ok());
    Some([x.filter(|x| *x < extent[0])?, y.filter(|y| *y < extent[1])?])
}

/// What the weights of a cell's parents are made of.
struct Child {
    sample: DVec2,
    /// Of the parents, in samples.
    spacing: f64,
    depth: f64,
    /// n . ray through the sample at depth 1, and its change a sample.
    towards: f64,
    slope: DVec2,
    /// Standard deviation of the plane distance in metres.
    sigma: f64,
    /// Unit normal: screen right and down, and towards the viewer.
    facing: DVec3,
}

impl Child {
    fn of(surface: &Surface, cell: &Cell, level: u32) -> Option<Self> {
        let Sample { depth, normal, .. } = surface.at(cell.sample)?;
        let [sx, sy, ox, oy] = surface.ray;
        let extent = DVec2::from(surface.extent.map(|e| e as f64));
        let sample = DVec2::from(cell.sample.map(|p| p as f64));
        let a_sample = 2.0 * DVec2::new(sx, sy) / extent;
        let n = surface.axes.transpose() * normal;
        let v = (sample + 0.5) * a_sample - DVec2::new(sx, sy) + DVec2::new(ox, oy);
        let side = f64::from(1 << level);
        Some(Self {
            sample,
            spacing: 2.0 * side,
            depth,
            towards: n.truncate().dot(v) - n.z,
            slope: n.truncate() * a_sample,
            sigma: PLANE * depth * a_sample.abs().max_element() * side,
            facing: (n.truncate() * a_sample.signum()).extend(n.z),
        })
    }

    fn offset(&self, sample: [usize; 2]) -> DVec2 {
        DVec2::from(sample.map(|p| p as f64)) - self.sample
    }

    /// Tent over the parents' true positions.
    fn alpha(&self, offset: DVec2) -> f64 {
        let tent = (1.0 - offset.abs() / self.spacing).max(DVec2::ZERO);
        tent.x * tent.y
    }

    /// Gaussian of a parent's distance from the plane of the child's surface.
    fn plane(&self, offset: DVec2, depth: f64) -> f64 {
        let distance = self.depth * self.towards - depth * (self.towards + self.slope.dot(offset));
        (-distance * distance / (2.0 * self.sigma * self.sigma)).exp()
    }

    /// exp(-v^T M v), M = R^T diag(1, cos^2) R over squared spacings, the first axis along the projected normal: there the
    /// surface turns away and the image changes fastest, by 1 / cos against the other axis.
    fn anisotropic(&self, offset: DVec2) -> f64 {
        let e = offset / self.spacing;
        let across = e.dot(self.facing.truncate());
        (-(across * across + self.facing.z * self.facing.z * e.length_squared())).exp()
    }
}

/// The values of all cells by level from 0, row by row: `shade` gives those of shaded samples, parents the others, from coarse
/// to fine. `None` where a cell has no value.
pub fn upsample(
    pyramid: &Pyramid,
    sources: &[Vec<Source>],
    mut shade: impl FnMut([usize; 2], u32) -> DVec3,
) -> Vec<Vec<Option<DVec3>>> {
    let mut values: Vec<Vec<Option<DVec3>>> = vec![Vec::new(); sources.len()];
    for (level, sources) in sources.iter().enumerate().rev() {
        let width = pyramid.extents[level][0];
        let value = |(i, source): (usize, &Source)| {
            let position = [i % width, i / width];
            match source {
                Source::None => None,
                Source::Shading | Source::Refused(_) => {
                    pyramid.cell(level as u32, position).map(|cell| shade(cell.sample, level as u32))
                }
                Source::Parents(weights) => {
                    let above = pyramid.extents[level + 1];
                    let parent = |p: [i64; 2]| {
                        let [x, y] = [0, 1].map(|axis| p[axis].clamp(0, above[axis] as i64 - 1) as usize);
                        values[level + 1][y * above[0] + x]
                    };
                    let [a, b, c, d] = parents(position).map(parent);
                    let [top, bottom, down] = weights.steps;
                    between(between(a, b, top), between(c, d, bottom), down)
                }
            }
        };
        values[level] = sources.iter().enumerate().map(value).collect();
    }
    values
}

/// What has no weight may have no value.
fn between(a: Option<DVec3>, b: Option<DVec3>, step: f64) -> Option<DVec3> {
    match step {
        0.0 => a,
        1.0 => b,
        _ => Some(a? + (b? - a?) * step),
    }
}
