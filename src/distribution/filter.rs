//! Filters of normal and BRDF maps: what they are and what each stores.

use crate::distribution::alignment::Fit;
use crate::distribution::clusters::MOST_CLUSTERS;
use crate::distribution::expectation::GAUSSIANS;
use crate::distribution::mixture::Masking;
use crate::distribution::partition::Cells;

/// How a material is read at a pixel's scale. Filters that read normals and roughness through mips make lobes of them, in the place
/// of the model's own: of GGX, Blinn-Phong and vMF lobes about the normal each one a facet, with its direction for a normal; of
/// mixtures of at most [`MOST_BASE_LOBES`] other vMF lobes one distribution of normals. Tables and larger mixtures keep their lobes,
/// about the mean normal ([`crate::Moments`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// At the pixel's centre: colours through their mips, normals and roughness as they are there.
    #[default]
    Point,
    /// The same, with lobes widened by how far the interpolated normal turns within the pixel: geometric specular antialiasing
    /// (Tokuyoshi and Kaplanyan 2021). Tabulated reflectances stay as they are.
    Tk,
    /// Normals and concentrations each averaged over the pixel, through their mips.
    Naive,
    /// Normals averaged over the pixel; the concentration is the map's mean.
    Fixed,
    /// The mean concentration, reduced by the length of the mean normal (Toksvig 2005, "Mipmapping Normal Maps"); a material's
    /// lobes count as one.
    Toksvig,
    /// The same for each of a material's lobes.
    ToksvigLobe,
    /// Mean and covariance of slopes (Olano and Baker 2010, "LEAN Mapping"); a material's lobes count as one.
    Lean,
    /// The same for each of a material's lobes.
    LeanLobe,
    /// As [`Filter::Lean`], with the masking that follows from these moments (Dupuy et al. 2013).
    Leadr,
    /// One von Mises-Fisher lobe of the pixel's mean vector (Xu et al. 2017).
    Vmf1,
    /// One in each quadrant of directions about the surface's normal.
    Vmf4,
    /// One in each of eight cells of these directions.
    Vmf8,
    /// As many of these cells as the spread within them asks for.
    Vmf,
    /// One elliptic lobe in each of up to eight clusters, where the map's lobes are, apart by roughness.
    Clusters,
    /// Four lobes a texel of each level, of which a look-up finds all (Fournier 1992).
    Fournier4,
    /// Seven.
    Fournier7,
    /// The lobes of all base texels below the pixel, by the same look-ups: what no filter can be better than. A frame draws
    /// [`DRAWN_LOBES`] of them; its mean over frames has all.
    BruteForce,
    /// A mixture of four Gaussians of each texel of each level, of which those of one number are alike in neighbours and averaged
    /// (Tan et al. 2005).
    Gmm,
    /// The same of mixtures that were fitted each on its own.
    GmmUnaligned,
}

/// What a texel of a filter's mips holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Storage {
    /// Mean directions and concentrations, of each lobe or of all.
    Directions { apart: bool },
    /// Mean slopes and their products, of each lobe or of all.
    Slopes { apart: bool },
    /// Characteristic vectors of all lobes, by cells of directions.
    Cells(Cells),
    /// Moments of all lobes, by clusters that the map has.
    Clusters,
    /// This many lobes.
    Peaks(usize),
    /// Nothing beside the base texels' lobes.
    Base,
    /// Moments of Gaussians, each texel's own.
    Gaussians(Fit),
}

impl Filter {
    /// All, those that store nothing first.
    pub const ALL: [Self; 19] = [
        Self::Point,
        Self::Tk,
        Self::Naive,
        Self::Fixed,
        Self::Toksvig,
        Self::ToksvigLobe,
        Self::Lean,
        Self::LeanLobe,
        Self::Leadr,
        Self::Vmf1,
        Self::Vmf4,
        Self::Vmf8,
        Self::Vmf,
        Self::Clusters,
        Self::Fournier4,
        Self::Fournier7,
        Self::BruteForce,
        Self::Gmm,
        Self::GmmUnaligned,
    ];

    /// The name by which it is asked for.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Tk => "tk",
            Self::Naive => "naive",
            Self::Fixed => "fixed",
            Self::Toksvig => "toksvig",
            Self::ToksvigLobe => "toksvig-lobe",
            Self::Lean => "lean",
            Self::LeanLobe => "lean-lobe",
            Self::Leadr => "leadr",
            Self::Vmf1 => "vmf1",
            Self::Vmf4 => "vmf4",
            Self::Vmf8 => "vmf8",
            Self::Vmf => "vmf",
            Self::Clusters => "clusters",
            Self::Fournier4 => "fournier4",
            Self::Fournier7 => "fournier7",
            Self::BruteForce => "bruteforce",
            Self::Gmm => "gmm",
            Self::GmmUnaligned => "gmm-unaligned",
        }
    }

    /// Those that read normals and roughness through mips of what they store.
    pub fn stored() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|filter| filter.stores())
    }

    /// Whether it is one of [`Self::stored`].
    pub fn stores(self) -> bool {
        self.storage().is_some()
    }

    /// Whether it is of Xu et al. 2017.
    pub fn is_vmf(self) -> bool {
        matches!(self.storage(), Some(Storage::Cells(_)))
    }

    /// How its lobes are masked.
    pub fn masking(self) -> Masking {
        if self == Self::Leadr { Masking::Slopes } else { Masking::Cavities }
    }

    /// What it stores in a map's texels, if it stores anything.
    pub(crate) fn storage(self) -> Option<Storage> {
        match self {
            Self::Point | Self::Tk => None,
            Self::Naive | Self::Fixed | Self::ToksvigLobe => Some(Storage::Directions { apart: true }),
            Self::Toksvig => Some(Storage::Directions { apart: false }),
            Self::Lean | Self::Leadr => Some(Storage::Slopes { apart: false }),
            Self::LeanLobe => Some(Storage::Slopes { apart: true }),
            Self::Vmf1 => Some(Storage::Cells(Cells::One)),
            Self::Vmf4 => Some(Storage::Cells(Cells::Four)),
            // Of which those of four and of one are sums.
            Self::Vmf8 | Self::Vmf => Some(Storage::Cells(Cells::Eight)),
            Self::Clusters => Some(Storage::Clusters),
            Self::Fournier4 => Some(Storage::Peaks(4)),
            Self::Fournier7 => Some(Storage::Peaks(7)),
            Self::BruteForce => Some(Storage::Base),
            Self::Gmm => Some(Storage::Gaussians(Fit::ALIGNED)),
            Self::GmmUnaligned => Some(Storage::Gaussians(Fit::ALONE)),
        }
    }

    /// Whether its lobes are Gaussians of slopes.
    pub(crate) fn has_slopes(self) -> bool {
        matches!(self.storage(), Some(Storage::Slopes { .. }))
    }

    /// Whether it stores several cells of directions beside lobes.
    pub(crate) fn has_cells(self) -> bool {
        matches!(self.storage(), Some(Storage::Cells(Cells::Four | Cells::Eight)))
    }

    /// Whether it stores mixtures of Gaussians, and how these are fitted.
    pub(crate) fn gaussians(self) -> Option<Fit> {
        if let Some(Storage::Gaussians(fit)) = self.storage() { Some(fit) } else { None }
    }

    /// Whether base texels keep their lobes as they are, and mips are in an image of their own, if there are some. These begin at half
    /// the size, but those of Gaussians with the base texels.
    pub(crate) fn keeps_base(self) -> bool {
        let apart = Some(Storage::Base) == self.storage() || self.has_clusters() || self.gaussians().is_some();
        self.has_cells() || apart || matches!(self.storage(), Some(Storage::Peaks(_)))
    }

    /// Whether it has such an image.
    pub(crate) fn has_coarser(self) -> bool {
        self.keeps_base() && self.storage() != Some(Storage::Base)
    }

    /// Whether it stores moments by clusters.
    pub(crate) fn has_clusters(self) -> bool {
        self.storage() == Some(Storage::Clusters)
    }

    /// Whether its lobes are elliptic, of normals that follow the half vector.
    pub(crate) fn is_elliptic(self) -> bool {
        self.has_clusters() || self.gaussians().is_some()
    }

    /// Whether frames differ in the lobes that they find.
    pub fn is_random(self) -> bool {
        self.storage() == Some(Storage::Base)
    }

    /// The most lobes that it finds at a sample of a material that has one, 0 if it makes none.
    pub fn most_lobes(self) -> u32 {
        let apart = matches!(self.storage(), Some(Storage::Directions { apart: true } | Storage::Slopes { apart: true }));
        let each = if self.has_slopes() { 2 } else { 1 };
        self.lobe_layers() / each / if apart { MOST_BASE_LOBES as u32 } else { 1 }
    }

    /// Layers of the image of a sample's lobes: one a lobe, two a Gaussian of slopes; none if it makes no lobes.
    pub fn lobe_layers(self) -> u32 {
        let lobes = |apart| if apart { MOST_BASE_LOBES } else { 1 };
        let layers = match self.storage() {
            None => 0,
            Some(Storage::Directions { apart }) => lobes(apart),
            Some(Storage::Slopes { apart }) => 2 * lobes(apart),
            // One cell, its four parts and their eight, where it blends between them.
            Some(Storage::Cells(_)) if self == Self::Vmf => 13,
            Some(Storage::Cells(cells)) => cells.count(),
            Some(Storage::Clusters) => MOST_CLUSTERS,
            // Four texels of each of two levels.
            Some(Storage::Peaks(count)) => 8 * count,
            Some(Storage::Base) => DRAWN_LOBES,
            Some(Storage::Gaussians(_)) => GAUSSIANS,
        };
        layers as u32
    }
}

/// When [`Filter::Vmf`] divides a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Division {
    /// By how far its spread goes beyond that of the lobes in it, with a blend from one to the other.
    #[default]
    SpreadRatio,
    /// Where the mean vector of all, and then of a quarter, is shorter than this (epsilon 0 and 1 of Xu et al. 2017, Algorithm 1).
    Lengths([f64; 2]),
}

/// As printed.
pub const PRINTED_LENGTHS: [f64; 2] = [0.95, 0.85];

impl Division {
    /// By [`PRINTED_LENGTHS`].
    pub const PRINTED: Self = Self::Lengths(PRINTED_LENGTHS);
}

/// Lobes of a material that filters take apart.
pub const MOST_BASE_LOBES: usize = 4;

/// Lobes that a frame draws with [`Filter::BruteForce`].
pub const DRAWN_LOBES: usize = 32;
