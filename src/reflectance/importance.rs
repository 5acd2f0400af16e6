//! Vectors of importance samples, precomputed over the view angle (Bagher et al. 2011, section 3.3), here as a grid of cells
//! of equal probability over the half vector. Twin of `glsl/include/reflectance/importance.glsl`.
//!
//! Local frame: z is the normal and the viewer is in the xz-plane, `wo = (sin, 0, cos)`. A half vector h is known by
//! `t = 1 - cos(theta_h)` in [0, 1] and its azimuth in [-pi, pi], in which solid angle is `dt dphi`. The tables follow the
//! reflectance's mean over turns about the normal, which is the reflectance itself if it is isotropic; so the azimuth's sign
//! is a coin toss and they cover [0, pi].
//!
//! A table follows the reflectance, or what a fit by lobes leaves of it. That is drawn over the sphere, as a fit leaks below
//! the horizon, but for directions that no half vector above it reflects to: those with `wi.z < -wo.z`.

use crate::distribution::LobeFit;
use crate::reflectance::fine_grid::FineGrid;
use crate::reflectance::residual::Residual;
use crate::reflectance::{Reflectance, clamped};
use crate::sampling::LUMINANCE;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// View angles that have a table: node `i` covers `[i, i + 1] * 90 / 64` degrees.
pub const VIEW_ANGLES: usize = 64;
/// Strips of equal probability in t.
pub const ROWS: usize = 64;
/// Cells of equal probability in the azimuth, per strip.
pub const COLUMNS: usize = 16;
/// Rows of the smooth density, at bin centres of `sqrt(theta_h / (pi/2))`.
pub const DENSITY_ROWS: usize = 64;
/// Columns of the smooth density, at bin centres of `(1 - cos(phi_h)) / 2`.
pub const DENSITY_COLUMNS: usize = 16;

/// Of borders.
pub(super) const STEPS: u16 = u16::MAX;
const STEP: f32 = 1.0 / STEPS as f32;
const AZIMUTH_STEP: f32 = (PI / STEPS as f64) as f32;

/// Share of the density that follows the reflectance; the rest follows the cosine, for what the table does not foresee.
const REFLECTANCE_SHARE: f64 = 0.9;
/// The same of a table for what a fit leaves.
const RESIDUAL_SHARE: f64 = 0.85;
/// The view cosine that stands for the horizon, where there is nothing to reflect.
const GRAZING: f64 = 2e-3;

/// Borders of a cell in steps: from and to in t, from and to in the azimuth; see [`borders`]. Eight bytes, since what a frame
/// draws from all its materials' tables passes through the processor's caches: with floats, 64 materials took 1.3 times as long as one.
pub type Cell = [u16; 4];

/// The importance tables of one reflectance.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportanceTable {
    cells: Vec<Cell>,
    density: Vec<f32>,
}

/// A direction drawn from an [`ImportanceTable`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImportanceSample {
    /// To the light (unit).
    pub wi: DVec3,
    /// The half vector.
    pub h: DVec3,
    /// Density of `wi` per steradian.
    pub pdf: f64,
}

impl ImportanceTable {
    /// Tabulates `reflectance`. Each node's target is the average of those at both ends of its range of view angles, so that
    /// directions which are above the horizon for some pixel of the node are never left to the floor.
    pub fn build(reflectance: &dyn Reflectance) -> Self {
        let grid = FineGrid::new();
        let rows = reflectance.rows(LUMINANCE);
        Self::of(&grid, |cos_o| grid.target(grid.reflected(&rows, cos_o), REFLECTANCE_SHARE, cos_o))
    }

    /// Tabulates the mean over channels of `|f - a|` over the sphere, f the `reflectance` times the cosine and a its `fit`: for
    /// estimates of what the fit leaves. What turns about the normal change is missing in their mean: as much as the fit's
    /// errors say of it is taken to be where the reflectance is.
    pub fn build_residual(reflectance: &dyn Reflectance, fit: &LobeFit) -> Self {
        let grid = FineGrid::new();
        let residual = Residual::of(reflectance);
        let turns = !reflectance.isotropic();
        let target = |cos_o: f64| {
            let node = fit.at(cos_o);
            let [mut left, all] = grid.residual(&residual, &node, cos_o);
            let total = grid.integral(&all);
            let unseen = node.error - grid.integral(&left) / total;
            if turns && unseen > 0.0 {
                left.iter_mut().zip(all).for_each(|(left, all)| *left += unseen * all);
            }
            grid.target(left, RESIDUAL_SHARE, cos_o)
        };
        Self::of(&grid, target)
    }

    /// From the target under each view cosine.
    fn of(grid: &FineGrid, target: impl Fn(f64) -> Vec<f64>) -> Self {
        let mut table = Self { cells: Vec::new(), density: Vec::new() };
        let mut before = target(1.0);
        for node in 0..VIEW_ANGLES {
            let theta = FRAC_PI_2 * (node + 1) as f64 / VIEW_ANGLES as f64;
            let after = target(theta.cos().max(GRAZING));
            let mean: Vec<f64> = before.iter().zip(&after).map(|(a, b)| (a + b) / 2.0).collect();
            grid.cut(&mean, &mut table.cells);
            grid.resample(&mean, &mut table.density);
            before = after;
        }
        table
    }

    /// The cells, `[node][row][column]`: neighbours share borders, rows and columns fill the range of steps, none is empty.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// The smooth density, `[node][row][column]`; see [`Self::density`].
    pub fn density_texels(&self) -> &[f32] {
        &self.density
    }

    /// Draws a half vector for the view cosine `cos_o` from two numbers in [0, 1), with its density per steradian.
    pub fn half_vector(&self, cos_o: f64, u: [f64; 2]) -> (DVec3, f64) {
        let (row, along_t) = split(u[0], ROWS);
        let (sign, v) = if u[1] < 0.5 { (1.0, 2.0 * u[1]) } else { (-1.0, 2.0 * u[1] - 1.0) };
        let (column, along_phi) = split(v, COLUMNS);
        let cell = self.cell(node(cos_o), row, column);
        let [t0, t1, phi0, phi1] = borders(cell).map(f64::from);
        let (t, phi) = (t0 + (t1 - t0) * along_t, sign * (phi0 + (phi1 - phi0) * along_phi));
        let sine = (t * (2.0 - t)).sqrt();
        (DVec3::new(sine * phi.cos(), sine * phi.sin(), 1.0 - t), cell_density(cell))
    }

    /// Draws a light direction for the view cosine `cos_o` from two numbers in [0, 1). `None` is a rejected sample, below
    /// the horizon or seen from behind: it counts as zero in an estimate, not as not drawn.
    pub fn sample(&self, cos_o: f64, u: [f64; 2]) -> Option<ImportanceSample> {
        self.sample_sphere(cos_o, u).filter(|sample| sample.wi.z > 0.0)
    }

    /// The same, but for directions below the horizon, which count here.
    pub fn sample_sphere(&self, cos_o: f64, u: [f64; 2]) -> Option<ImportanceSample> {
        let (h, pdf_h) = self.half_vector(cos_o, u);
        let wo = viewer(cos_o);
        let cosine = wo.dot(h);
        let wi = 2.0 * cosine * h - wo;
        (cosine > 0.0).then(|| ImportanceSample { wi, h, pdf: pdf_h / (4.0 * cosine) })
    }

    /// The exact density per steradian with which [`Self::half_vector`] draws unit `h`; 0 below the horizon.
    pub fn pdf_half(&self, cos_o: f64, h: DVec3) -> f64 {
        if h.z < 0.0 {
            return 0.0;
        }
        let sine = h.x * h.x + h.y * h.y;
        let (t, phi) = ((sine / (1.0 + h.z)) as f32, h.y.abs().atan2(h.x) as f32);
        let node = node(cos_o);
        let row = (0..ROWS).find(|&r| t < borders(self.cell(node, r, 0))[1]).unwrap_or(ROWS - 1);
        let column = (0..COLUMNS).find(|&c| phi < borders(self.cell(node, row, c))[3]).unwrap_or(COLUMNS - 1);
        cell_density(self.cell(node, row, column))
    }

    /// The exact density per steradian with which [`Self::sample`] draws unit `wi`; 0 below the horizon.
    pub fn pdf(&self, cos_o: f64, wi: DVec3) -> f64 {
        if wi.z > 0.0 { self.pdf_sphere(cos_o, wi) } else { 0.0 }
    }

    /// The exact density per steradian with which [`Self::sample_sphere`] draws unit `wi`.
    pub fn pdf_sphere(&self, cos_o: f64, wi: DVec3) -> f64 {
        let wo = viewer(cos_o);
        let h = (wi + wo).normalize_or_zero();
        let cosine = wo.dot(h);
        if cosine > 0.0 { self.pdf_half(cos_o, h) / (4.0 * cosine) } else { 0.0 }
    }

    /// A smooth stand-in for the density of `h` per steradian, bilinear in its table: **for the weights of multiple
    /// importance sampling only**, where any positive function that depends on the direction alone is right, and a smooth
    /// one is cheaper to look up and no noisier than the cells' exact density.
    pub fn density(&self, cos_o: f64, h: DVec3) -> f64 {
        let sine = h.x.hypot(h.y);
        let cos_phi = if sine > 0.0 { h.x / sine } else { 1.0 };
        let (r0, r1, r) = clamped((sine.atan2(h.z) / FRAC_PI_2).sqrt(), DENSITY_ROWS);
        let (c0, c1, c) = clamped((1.0 - cos_phi) / 2.0, DENSITY_COLUMNS);
        let node = node(cos_o);
        let at = |r, c| f64::from(self.density[(node * DENSITY_ROWS + r) * DENSITY_COLUMNS + c]);
        let row = |r| at(r, c0) + (at(r, c1) - at(r, c0)) * c;
        row(r0) + (row(r1) - row(r0)) * r
    }

    fn cell(&self, node: usize, row: usize, column: usize) -> Cell {
        self.cells[(node * ROWS + row) * COLUMNS + column]
    }
}

/// The node whose table a view cosine uses.
pub fn node(cos_o: f64) -> usize {
    ((cos_o.clamp(0.0, 1.0).acos() / FRAC_PI_2 * VIEW_ANGLES as f64) as usize).min(VIEW_ANGLES - 1)
}

/// The viewer's direction in the local frame.
pub(super) fn viewer(cos_o: f64) -> DVec3 {
    DVec3::new((1.0 - cos_o * cos_o).max(0.0).sqrt(), 0.0, cos_o)
}

/// The borders `(t0, t1, phi0, phi1)` of a cell: `t` is the fourth power of its share of the steps, so that a lobe of alpha 0.001
/// has thousands of them; the azimuth is uniform in them. As the shader computes them, bit for bit.
pub fn borders(cell: Cell) -> [f32; 4] {
    let [t0, t1, phi0, phi1] = cell.map(f32::from);
    let t = |steps: f32| {
        let square = (steps * STEP) * (steps * STEP);
        square * square
    };
    [t(t0), t(t1), phi0 * AZIMUTH_STEP, phi1 * AZIMUTH_STEP]
}

/// Density per steradian in a cell: each has the same probability, half of it at either sign of the azimuth.
fn cell_density(cell: Cell) -> f64 {
    let [t0, t1, phi0, phi1] = borders(cell).map(f64::from);
    1.0 / ((2 * ROWS * COLUMNS) as f64 * (t1 - t0) * (phi1 - phi0))
}

/// Which of `parts` equal parts of [0, 1) holds `u`, and where in it.
fn split(u: f64, parts: usize) -> (usize, f64) {
    let x = u * parts as f64;
    let part = (x as usize).min(parts - 1);
    (part, x - part as f64)
}
