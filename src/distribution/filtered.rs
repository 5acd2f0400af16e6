//! A map as a filter stores it: what a lobe adds to a texel, of which mips are averages, and the lobes that a texel decodes to.

use crate::distribution::brdf_map::BrdfMap;
use crate::distribution::clusters::{Clusters, Decoded, MOMENTS};
use crate::distribution::effective::Rule;
use crate::distribution::filter::{Division, Filter, Storage};
use crate::distribution::gaussians::Gaussians;
use crate::distribution::mip::Mips;
use crate::distribution::mixture::Mixture;
use crate::distribution::partition::Cells;
use crate::distribution::peaks::Peaks;
use crate::distribution::stored::{CELL, Cell, DIRECTION, KEPT, LEAST_WEIGHT, Sum, covered, encode, gaussian, kept, lobe_kept};
use crate::distribution::vmf::{self, Lobe};
use crate::reflectance::vmf::LEAST_PROJECTED_AREA;
use crate::texture::bilinear;
use glam::{DVec2, DVec3};
use std::borrow::Cow;
use std::ops::{Add, Range};
use std::sync::Arc;

/// How often cells are divided.
const DIVISIONS: usize = 2;

/// How much greater than its lobes' own spread a cell's spread may be before it is divided.
const SPREAD_RATIO: f64 = 1.5;

/// A map as a filter stores it, with its mips.
#[derive(Clone, Debug)]
pub struct Filtered<'a> {
    filter: Filter,
    storage: Storage,
    map: Cow<'a, BrdfMap>,
    rule: Rule,
    division: Division,
    /// The mean concentration of the map.
    constant: f64,
    /// The mean cosine of the material's lobe of a concentration, about its direction.
    area: Area,
    kept: Kept,
    mips: Mips,
}

/// The mean cosine of a lobe of some concentration.
pub(crate) type Area = fn(f64) -> f64;

/// What there is beside averages.
#[derive(Clone, Debug)]
enum Kept {
    Nothing,
    Clusters(Clusters),
    /// All look-ups' own.
    Peaks(Peaks),
    Base,
    Gaussians(Arc<Gaussians>),
}

/// What was found of a map before.
#[derive(Clone, Debug, Default)]
pub(crate) enum Known {
    #[default]
    Nothing,
    Clusters(Clusters),
    Gaussians(Arc<Gaussians>),
}

impl<'a> Filtered<'a> {
    /// `map` as `filter` stores it. Unless it is exact, `rule` takes for `vmf*` the paper's own relation of length and concentration (equations
    /// 8 and 9) and its tests of length (Algorithm 1, with the weights of equation 15, without which energy would grow with the
    /// number of cells). `None` for a filter that stores nothing.
    pub fn new(filter: Filter, map: &'a BrdfMap, rule: Rule) -> Option<Self> {
        let known = match filter.has_clusters() {
            true => Known::Clusters(Clusters::of(map.size(), map.normal(0).is_some(), &|i| map.texel(i).to_vec(), None)),
            false => Known::Nothing,
        };
        Self::over(filter, Cow::Borrowed(map), rule, known, |kappa| vmf::mean_cosine(kappa).max(LEAST_PROJECTED_AREA))
    }

    /// `map` with mixtures of it. `None` if they are of another size.
    pub fn of_gaussians(map: &'a BrdfMap, known: Gaussians) -> Option<Self> {
        let area: Area = |kappa| vmf::mean_cosine(kappa).max(LEAST_PROJECTED_AREA);
        let all = known.are_of(map).then(|| Known::Gaussians(Arc::new(known)))?;
        Self::over(Filter::Gmm, Cow::Borrowed(map), Rule::Exact, all, area)
    }

    /// The same, which keeps the map, with its clusters if the filter has some, or its mixtures if these are known.
    pub(crate) fn keeping(filter: Filter, map: BrdfMap, rule: Rule, known: Known, area: Area) -> Option<Filtered<'static>> {
        Filtered::over(filter, Cow::Owned(map), rule, known, area)
    }

    fn over(filter: Filter, map: Cow<'a, BrdfMap>, rule: Rule, known: Known, area: Area) -> Option<Self> {
        let storage = filter.storage()?;
        let constant =
            map.lobes().iter().map(|l| l.weight * l.kappa).sum::<f64>() * map.lobes_per_texel() as f64 / map.lobes().len() as f64;
        let kept = match (storage, known) {
            (Storage::Clusters, Known::Clusters(clusters)) => Kept::Clusters(clusters),
            (Storage::Clusters, _) => return None,
            (Storage::Gaussians(_), Known::Gaussians(known)) if known.are_of(&map) => Kept::Gaussians(known),
            (Storage::Gaussians(fit), _) => Kept::Gaussians(Arc::new(Gaussians::of(&map, area, fit))),
            (Storage::Peaks(count), _) => Kept::Peaks(Peaks::of(&map, count, area)),
            (Storage::Base, _) => Kept::Base,
            _ => Kept::Nothing,
        };
        let (slots, stride) = storage.layout(map.lobes_per_texel());
        let channels = if let Kept::Clusters(clusters) = &kept { clusters.all().len() * MOMENTS } else { slots * stride };
        let mips = Mips::new(map.size(), channels, |i, out| match &kept {
            Kept::Clusters(clusters) => encode_clusters(clusters, &map, i, area, out),
            _ => encode(storage, map.texel(i), map.normal(i), rule, out),
        });
        let division = if rule.is_literal() { Division::PRINTED } else { Division::default() };
        Some(Self { filter, storage, map, rule, division, constant, area, kept, mips })
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
        let lobes = self.map.texel(i);
        match &self.kept {
            Kept::Base => return self.below(level, i),
            Kept::Gaussians(all) => return all.texel(&self.map, self.area, level, i),
            Kept::Peaks(peaks) if level > 0 => {
                let texel = peaks.texel(level, i);
                let there = texel.iter().filter(|p| p.lobe.weight > 0.0);
                return (!texel.is_empty()).then(|| there.flat_map(|p| kept(&p.lobe, p.normal, p.lobe.weight)).collect());
            }
            _ if level > 0 => return self.mips.texel(level, i).map(<[f64]>::to_vec),
            Kept::Peaks(_) => return self.below(0, i),
            Kept::Clusters(clusters) => {
                let mut out = vec![0.0; clusters.all().len() * MOMENTS];
                encode_clusters(clusters, &self.map, i, self.area, &mut out);
                return (!lobes.is_empty()).then_some(out);
            }
            Kept::Nothing => {}
        }
        let (slots, stride) = self.storage.layout(self.map.lobes_per_texel());
        let mut out = vec![0.0; slots * stride];
        encode(self.storage, lobes, self.map.normal(i), self.rule, &mut out);
        (!lobes.is_empty()).then_some(out)
    }

    /// The lobes of all base texels below texel `i` of a level, one behind the other, with their masses.
    fn below(&self, level: usize, i: usize) -> Option<Vec<f64>> {
        let (size, from) = (self.size(level), self.map.size());
        let [x, y] = [i % size[0] as usize, i / size[0] as usize];
        let mut all = Vec::new();
        for (row, of_row) in covered(y, size[1], from[1]) {
            for (column, of_column) in covered(x, size[0], from[0]) {
                let texel = row * from[0] as usize + column;
                let normal = |l: &Lobe| self.map.normal(texel).unwrap_or(l.mu);
                let mass = |l: &Lobe| of_row * of_column * l.weight / (self.area)(l.kappa);
                all.extend(self.map.texel(texel).iter().flat_map(|l| kept(l, normal(l), mass(l))));
            }
        }
        (level < self.levels() && y < size[1] as usize).then_some(all)
    }

    /// What is stored at `uv`, linearly filtered within and between levels with repeat addressing; `v` grows upwards. Where texels
    /// keep lobes of their own, all of them.
    pub fn sample(&self, uv: DVec2, lod: f64) -> Vec<f64> {
        self.mean(std::iter::once(uv), lod)
    }

    /// The mean of what is stored at some places.
    pub(crate) fn mean(&self, places: impl ExactSizeIterator<Item = DVec2>, lod: f64) -> Vec<f64> {
        let last = self.levels() - 1;
        let lod = lod.clamp(0.0, last as f64);
        let sum = |texel: Option<Vec<f64>>| match self.kept {
            Kept::Peaks(_) | Kept::Base => Sum::Joined(texel.unwrap_or_default()),
            _ => Sum::Added(texel.unwrap_or_default()),
        };
        let at = |uv: DVec2, level: usize| bilinear(self.size(level), uv, |i| sum(self.texel(level, i)));
        let share = 1.0 / places.len() as f64;
        let between = |uv: DVec2| match lod.fract() {
            0.0 => at(uv, lod as usize),
            part => at(uv, lod as usize) * (1.0 - part) + at(uv, (lod as usize + 1).min(last)) * part,
        };
        places.map(|uv| between(uv) * share).reduce(Add::add).map_or_else(Vec::new, Sum::all)
    }

    /// The lobes of what is stored, or of an average of it.
    pub fn decode(&self, texel: &[f64]) -> Mixture {
        match self.storage {
            Storage::Directions { .. } => Mixture::Vmf(texel.as_chunks().0.iter().filter_map(|t| self.direction(*t)).collect()),
            Storage::Slopes { .. } => Mixture::Slopes(texel.as_chunks().0.iter().filter_map(|t| gaussian(*t)).collect()),
            Storage::Cells(_) => Mixture::Vmf(self.cells(texel).into_iter().map(|(lobe, _)| lobe).collect()),
            Storage::Clusters | Storage::Gaussians(_) => {
                let found = self.elliptic(texel).map_or_else(Vec::new, |found| found.0);
                Mixture::Elliptic(found.into_iter().map(|found| found.lobe).collect())
            }
            Storage::Peaks(_) | Storage::Base => {
                let mass = self.mass(texel).unwrap_or(1.0);
                Mixture::Vmf(texel.as_chunks().0.iter().filter_map(|t| lobe_kept(*t, mass)).map(|(lobe, _)| lobe).collect())
            }
        }
    }

    /// The lobes of clusters or Gaussians and their mass.
    fn elliptic(&self, texel: &[f64]) -> Option<(Vec<Decoded>, f64)> {
        match &self.kept {
            Kept::Clusters(clusters) => Some(clusters.decode(texel)),
            Kept::Gaussians(all) => Some(all.decode(texel)),
            Kept::Nothing | Kept::Peaks(_) | Kept::Base => None,
        }
    }

    /// The concentrations below each of the lobes of [`Self::decode`] beside which the rest of their widths is the spread of
    /// normals; none where lobes do not say it.
    pub fn own_concentrations(&self, texel: &[f64]) -> Vec<f64> {
        self.elliptic(texel).map_or_else(Vec::new, |found| found.0.iter().map(|l| l.own).collect())
    }

    /// The factors on the specular colour of each of the lobes of [`Self::decode`]; none where they share that of their place.
    pub fn colours(&self, texel: &[f64]) -> Vec<DVec3> {
        self.elliptic(texel).map_or_else(Vec::new, |found| found.0.iter().filter_map(|l| l.colour).collect())
    }

    /// Those of the map, if the filter has some.
    pub fn clusters_of_map(&self) -> Option<&Clusters> {
        if let Kept::Clusters(clusters) = &self.kept { Some(clusters) } else { None }
    }

    /// The mixtures of the map, if the filter has some.
    pub fn gaussians(&self) -> Option<&Gaussians> {
        if let Kept::Gaussians(all) = &self.kept { Some(all) } else { None }
    }

    /// The sum of the masses over solid angle of the lobes of [`Self::decode`], where that is stored: of lobes that each fill the
    /// projected area about their own normal.
    pub fn mass(&self, texel: &[f64]) -> Option<f64> {
        match self.storage {
            Storage::Clusters | Storage::Gaussians(_) => self.elliptic(texel).map(|found| found.1),
            Storage::Peaks(_) | Storage::Base => Some(texel.as_chunks().0.iter().map(|t: &[f64; KEPT]| t[4]).sum()),
            Storage::Directions { .. } | Storage::Slopes { .. } | Storage::Cells(_) => None,
        }
    }

    /// The normals below each lobe of [`Self::decode`], of any length above 0; none where lobes share theirs.
    pub fn normals(&self, texel: &[f64]) -> Vec<DVec3> {
        match self.storage {
            Storage::Cells(_) => self.cells(texel).into_iter().map(|(_, normal)| normal).collect(),
            Storage::Clusters | Storage::Gaussians(_) => {
                self.elliptic(texel).map_or_else(Vec::new, |f| f.0.iter().map(|l| l.normal).collect())
            }
            Storage::Peaks(_) | Storage::Base => {
                texel.as_chunks().0.iter().filter_map(|t| lobe_kept(*t, 1.0)).map(|(_, normal)| normal).collect()
            }
            Storage::Directions { .. } | Storage::Slopes { .. } => Vec::new(),
        }
    }

    /// The mean concentration of what is below each of the `count` lobes of [`Self::decode`]; none for slopes, and where
    /// [`Self::mass`] says it.
    pub fn concentrations_below(&self, texel: &[f64], count: usize) -> Vec<f64> {
        match self.storage {
            Storage::Directions { .. } if self.filter == Filter::Fixed => vec![self.constant; count],
            Storage::Directions { .. } => texel.as_chunks().0.iter().map(|t: &[f64; DIRECTION]| t[3] / t[4]).collect(),
            Storage::Cells(_) => {
                let all = texel.as_chunks().0.iter().fold(Cell([0.0; CELL]), |sum, t| sum.plus(&Cell(*t)));
                vec![vmf::concentration(all.base_spread()); count]
            }
            Storage::Slopes { .. } | Storage::Clusters | Storage::Peaks(_) | Storage::Base | Storage::Gaussians(_) => Vec::new(),
        }
    }

    /// The lobes of cells, and the normals below them.
    fn cells(&self, texel: &[f64]) -> Vec<(Lobe, DVec3)> {
        let cells: Vec<Cell> = texel.as_chunks().0.iter().map(|t| Cell(*t)).collect();
        let mut lobes = Vec::new();
        if self.filter == Filter::Vmf {
            self.divide(&cells, 0, 1.0, &mut lobes);
        } else {
            lobes.extend(cells.iter().filter_map(|cell| cell.lobe(self.rule, 1.0)));
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
            Storage::Clusters | Storage::Gaussians(_) => {
                let found = self.elliptic(texel).map_or_else(Vec::new, |found| found.0);
                found.iter().map(|l| l.lobe.round.weight * l.lobe.round.mu).sum()
            }
            Storage::Peaks(_) | Storage::Base => {
                texel.as_chunks().0.iter().map(|t: &[f64; KEPT]| DVec3::new(t[5], t[6], t[7])).sum()
            }
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
            lobes.extend(whole.lobe(self.rule, share * kept));
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

fn encode_clusters(clusters: &Clusters, map: &BrdfMap, texel: usize, area: Area, out: &mut [f64]) {
    out.fill(0.0);
    let (normal, colour) = (map.normal(texel), map.colour(texel).unwrap_or(DVec3::ONE));
    for lobe in map.texel(texel) {
        let (i, moments) = clusters.encode(lobe, normal, colour, lobe.weight / area(lobe.kappa));
        out[i * MOMENTS..].iter_mut().zip(moments).for_each(|(sum, m)| *sum += m);
    }
}
