//! A map as a filter stores it: what a lobe adds to a texel, of which mips are averages, and the lobes that a texel decodes to.

use crate::distribution::brdf_map::BrdfMap;
use crate::distribution::filter::{Division, Filter, Storage};
use crate::distribution::literal;
use crate::distribution::mip::Mips;
use crate::distribution::mixture::Mixture;
use crate::distribution::partition::Cells;
use crate::distribution::slope;
use crate::distribution::vmf::{self, LEAST_SPREAD, Lobe};
use crate::texture::bilinear;
use glam::{DVec2, DVec3};
use std::borrow::Cow;
use std::ops::{Add, Mul, Range};

/// How often cells are divided.
const DIVISIONS: usize = 2;

/// How much greater than its lobes' own spread a cell's spread may be before it is divided.
const SPREAD_RATIO: f64 = 1.5;

/// Numbers of a texel for each lobe of directions: weight times mean direction, times concentration, and weight.
const DIRECTION: usize = 5;
/// For each lobe of slopes: weight times mean slope and mean products xx, xy, yy, and weight.
const SLOPE: usize = 6;
/// For each cell: weight times characteristic vector, weight, weight times the mean length of the characteristic vectors, and weight
/// times the normals below: those of lobes about them are their characteristic vectors.
const CELL: usize = 8;

impl Storage {
    /// Lobes or cells of a texel, and numbers of each.
    fn layout(self, lobes: usize) -> (usize, usize) {
        match self {
            Self::Directions { apart } => (if apart { lobes } else { 1 }, DIRECTION),
            Self::Slopes { apart } => (if apart { lobes } else { 1 }, SLOPE),
            Self::Cells(cells) => (cells.count(), CELL),
        }
    }

    /// Which lobe or cell of a texel its lobe `i` adds to.
    fn slot(self, i: usize, lobe: &Lobe) -> usize {
        match self {
            Self::Directions { apart } | Self::Slopes { apart } => i * usize::from(apart),
            Self::Cells(cells) => cells.of(lobe.mu),
        }
    }

    /// What a lobe of a texel with this normal adds; as many numbers as [`Self::layout`] says.
    fn encode(self, lobe: &Lobe, normal: Option<DVec3>, literal: bool) -> [f64; 8] {
        let w = lobe.weight;
        match self {
            Self::Directions { .. } => {
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
                let length = if literal { 1.0 - literal::spread(lobe.kappa) } else { vmf::mean_cosine(lobe.kappa) };
                let r = w * length * lobe.mu;
                let n = normal.map_or(r, |normal| w * normal);
                [r.x, r.y, r.z, w, w * length, n.x, n.y, n.z]
            }
        }
    }
}

/// A map as a filter stores it, with its mips.
#[derive(Clone, Debug)]
pub struct Filtered<'a> {
    filter: Filter,
    storage: Storage,
    map: Cow<'a, BrdfMap>,
    literal: bool,
    division: Division,
    /// The mean concentration of the map.
    constant: f64,
    mips: Mips,
}

impl<'a> Filtered<'a> {
    /// `map` as `filter` stores it. `literal` takes for `vmf*` the paper's own relation of length and concentration (equations
    /// 8 and 9) and its tests of length (Algorithm 1, with the weights of equation 15, without which energy would grow with the
    /// number of cells). `None` for a filter that stores nothing.
    pub fn new(filter: Filter, map: &'a BrdfMap, literal: bool) -> Option<Self> {
        Self::over(filter, Cow::Borrowed(map), literal)
    }

    /// The same, which keeps the map.
    pub fn keeping(filter: Filter, map: BrdfMap, literal: bool) -> Option<Filtered<'static>> {
        Filtered::over(filter, Cow::Owned(map), literal)
    }

    fn over(filter: Filter, map: Cow<'a, BrdfMap>, literal: bool) -> Option<Self> {
        let storage = filter.storage()?;
        let constant =
            map.lobes().iter().map(|l| l.weight * l.kappa).sum::<f64>() * map.lobes_per_texel() as f64 / map.lobes().len() as f64;
        let (slots, stride) = storage.layout(map.lobes_per_texel());
        let mips = Mips::new(map.size(), slots * stride, |i, out| encode(storage, map.texel(i), map.normal(i), literal, out));
        let division = if literal { Division::PRINTED } else { Division::default() };
        Some(Self { filter, storage, map, literal, division, constant, mips })
    }

    /// The same with another rule for the cells of [`Filter::Vmf`].
    pub fn divided(self, division: Division) -> Self {
        Self { division, ..self }
    }

    /// How many levels there are.
    pub fn levels(&self) -> usize {
        self.mips.levels()
    }

    /// Width and height of a level.
    pub fn size(&self, level: usize) -> [u32; 2] {
        self.mips.size(level)
    }

    /// What is stored of texel `i` of a level, row by row; for level 0 what its mips average. `None` where there is none.
    pub fn texel(&self, level: usize, i: usize) -> Option<Vec<f64>> {
        if level > 0 {
            return self.mips.texel(level, i).map(<[f64]>::to_vec);
        }
        let lobes = self.map.texel(i);
        let (slots, stride) = self.storage.layout(self.map.lobes_per_texel());
        let mut out = vec![0.0; slots * stride];
        encode(self.storage, lobes, self.map.normal(i), self.literal, &mut out);
        (!lobes.is_empty()).then_some(out)
    }

    /// What is stored at `uv`, linearly filtered within and between levels with repeat addressing; `v` grows upwards.
    pub fn sample(&self, uv: DVec2, lod: f64) -> Vec<f64> {
        let last = self.levels() - 1;
        let lod = lod.clamp(0.0, last as f64);
        let at = |level: usize| bilinear(self.size(level), uv, |i| Sum(self.texel(level, i).unwrap_or_default())).0;
        let near = at(lod as usize);
        if lod.fract() == 0.0 {
            return near;
        }
        let far = at((lod as usize + 1).min(last));
        near.iter().zip(far).map(|(a, b)| a + (b - a) * lod.fract()).collect()
    }

    /// The lobes of what is stored, or of an average of it.
    pub fn decode(&self, texel: &[f64]) -> Mixture {
        match self.storage {
            Storage::Directions { .. } => Mixture::Vmf(texel.as_chunks().0.iter().filter_map(|t| self.direction(*t)).collect()),
            Storage::Slopes { .. } => Mixture::Slopes(texel.as_chunks().0.iter().filter_map(|t| gaussian(*t)).collect()),
            Storage::Cells(_) => Mixture::Vmf(self.cells(texel).into_iter().map(|(lobe, _)| lobe).collect()),
        }
    }

    /// The normals below each lobe of [`Self::decode`], of any length above 0; none where lobes are not by cells.
    pub fn normals(&self, texel: &[f64]) -> Vec<DVec3> {
        match self.storage {
            Storage::Cells(_) => self.cells(texel).into_iter().map(|(_, normal)| normal).collect(),
            Storage::Directions { .. } | Storage::Slopes { .. } => Vec::new(),
        }
    }

    /// The mean concentration of what is below each of the `count` lobes of [`Self::decode`]; none for slopes.
    pub fn concentrations_below(&self, texel: &[f64], count: usize) -> Vec<f64> {
        match self.storage {
            Storage::Directions { .. } if self.filter == Filter::Fixed => vec![self.constant; count],
            Storage::Directions { .. } => texel.as_chunks().0.iter().map(|t: &[f64; DIRECTION]| t[3] / t[4]).collect(),
            Storage::Cells(_) => {
                let all = texel.as_chunks().0.iter().fold(Cell([0.0; CELL]), |sum, t| sum.plus(&Cell(*t)));
                vec![vmf::concentration(all.base_spread()); count]
            }
            Storage::Slopes { .. } => Vec::new(),
        }
    }

    /// The lobes of cells, and the normals below them.
    fn cells(&self, texel: &[f64]) -> Vec<(Lobe, DVec3)> {
        let cells: Vec<Cell> = texel.as_chunks().0.iter().map(|t| Cell(*t)).collect();
        let mut lobes = Vec::new();
        if self.filter == Filter::Vmf {
            self.divide(&cells, 0, 1.0, &mut lobes);
        } else {
            lobes.extend(cells.iter().filter_map(|cell| cell.lobe(self.literal, 1.0)));
        }
        lobes
    }

    /// A vector along the mean normal of what is stored, if lobes are about it: of slopes their frame's.
    pub fn mean_vector(&self, texel: &[f64]) -> DVec3 {
        match self.storage {
            Storage::Directions { .. } => {
                texel.as_chunks().0.first().map_or(DVec3::Z, |t: &[f64; DIRECTION]| DVec3::new(t[0], t[1], t[2]))
            }
            Storage::Cells(_) => texel.as_chunks().0.iter().map(|t| Cell(*t).normal()).sum(),
            Storage::Slopes { .. } => DVec3::Z,
        }
    }

    fn direction(&self, [x, y, z, kappa, weight]: [f64; DIRECTION]) -> Option<Lobe> {
        if weight <= LEAST_WEIGHT {
            return None;
        }
        let sum = DVec3::new(x, y, z);
        let length = (sum.length() / weight).min(1.0);
        let mean = kappa / weight;
        let kappa = match self.filter {
            Filter::Fixed => self.constant,
            // Toksvig's factor |N| / (|N| + s (1 - |N|)) on the exponent s.
            Filter::Toksvig | Filter::ToksvigLobe => mean * length / (length + mean * (1.0 - length)).max(f64::MIN_POSITIVE),
            _ => mean,
        };
        Some(Lobe { mu: sum.try_normalize().unwrap_or(DVec3::Z), kappa, weight })
    }

    /// The lobes of cells, all of them or the two halves of one of four: as one cell's lobe, divided, or between the two.
    fn divide(&self, cells: &[Cell], depth: usize, share: f64, lobes: &mut Vec<(Lobe, DVec3)>) {
        let whole = cells.iter().fold(Cell([0.0; CELL]), |sum, cell| sum.plus(cell));
        let kept = if depth == DIVISIONS { 1.0 } else { self.kept(&whole, depth) };
        if kept > 0.0 {
            lobes.extend(whole.lobe(self.literal, share * kept));
        }
        if kept < 1.0 {
            for part in cells.chunks(if depth == 0 { 2 } else { 1 }) {
                self.divide(part, depth + 1, share * (1.0 - kept), lobes);
            }
        }
    }

    /// How much of a cell's one lobe stays beside those of its parts: by how far its spread goes beyond that of its lobes, or
    /// all or none by the length of its mean vector.
    fn kept(&self, cell: &Cell, depth: usize) -> f64 {
        if let Division::Lengths(lengths) = self.division {
            return f64::from(u8::from(lengths.get(depth).is_none_or(|length| 1.0 - cell.spread() >= *length)));
        }
        let ratio = cell.spread() / (SPREAD_RATIO * cell.base_spread());
        let t = ((1.25 - ratio) / 0.5).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// The lobes of texel `i` of a level; none where there is no such texel.
    pub fn mixture(&self, level: usize, i: usize) -> Mixture {
        self.decode(&self.texel(level, i).unwrap_or_default())
    }

    /// Where in a texel of `vmf*` the cells are that make cell `cell` of a coarser partition.
    pub fn cells_of(&self, coarser: Cells, cell: usize) -> Option<Range<usize>> {
        let Storage::Cells(own) = self.storage else { return None };
        let each = own.count() / coarser.count();
        (each > 0 && cell < coarser.count()).then(|| cell * each * CELL..(cell + 1) * each * CELL)
    }
}

/// Stored numbers, added and scaled one by one.
struct Sum(Vec<f64>);

impl Add for Sum {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.iter().zip(other.0).map(|(a, b)| a + b).collect())
    }
}

impl Mul<f64> for Sum {
    type Output = Self;
    fn mul(mut self, factor: f64) -> Self {
        self.0.iter_mut().for_each(|c| *c *= factor);
        self
    }
}

/// Lobes of less weight are none.
const LEAST_WEIGHT: f64 = 1e-12;

fn encode(storage: Storage, lobes: &[Lobe], normal: Option<DVec3>, literal: bool, out: &mut [f64]) {
    out.fill(0.0);
    let (_, stride) = storage.layout(lobes.len());
    for (i, lobe) in lobes.iter().enumerate() {
        let at = storage.slot(i, lobe) * stride;
        out[at..at + stride].iter_mut().zip(storage.encode(lobe, normal, literal)).for_each(|(sum, c)| *sum += c);
    }
}

fn gaussian([x, y, xx, xy, yy, weight]: [f64; SLOPE]) -> Option<slope::Lobe> {
    let moments = [xx, xy, yy].map(|m| m / weight);
    (weight > LEAST_WEIGHT).then(|| slope::Lobe::from_moments(DVec2::new(x, y) / weight, moments, weight))
}

/// A stored cell.
#[derive(Clone, Copy)]
struct Cell([f64; CELL]);

impl Cell {
    fn plus(self, other: &Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }

    fn sum(&self) -> DVec3 {
        DVec3::new(self.0[0], self.0[1], self.0[2])
    }

    fn weight(&self) -> f64 {
        self.0[3]
    }

    /// Of its mean vector.
    fn spread(&self) -> f64 {
        (1.0 - self.sum().length() / self.weight().max(LEAST_WEIGHT)).max(LEAST_SPREAD)
    }

    /// The mean of its lobes' own.
    fn base_spread(&self) -> f64 {
        (1.0 - self.0[4] / self.weight().max(LEAST_WEIGHT)).max(LEAST_SPREAD)
    }

    fn normal(&self) -> DVec3 {
        DVec3::new(self.0[5], self.0[6], self.0[7])
    }

    /// Its lobe and the normal below.
    fn lobe(&self, literal: bool, share: f64) -> Option<(Lobe, DVec3)> {
        let kappa = if literal { literal::concentration(self.spread()) } else { vmf::concentration(self.spread()) };
        let mu = self.sum().try_normalize().unwrap_or(DVec3::Z);
        let lobe = Lobe { mu, kappa, weight: share * self.weight() };
        (self.weight() > LEAST_WEIGHT).then_some((lobe, self.normal()))
    }
}
