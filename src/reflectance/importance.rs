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
use crate::distribution::fit::FitNode;
use crate::reflectance::half_row::{HalfRow, Rows};
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
const STEPS: u16 = u16::MAX;
const STEP: f32 = 1.0 / STEPS as f32;
const AZIMUTH_STEP: f32 = (PI / STEPS as f64) as f32;

/// The grid on which a target is tabulated: rows uniform in `sqrt(theta_h / (pi/2))`, so that a lobe of alpha 0.01 spans 40.
const FINE_ROWS: usize = 512;
const FINE_COLUMNS: usize = 64;
/// Share of the density that follows the reflectance; the rest follows the cosine, for what the table does not foresee.
const REFLECTANCE_SHARE: f64 = 0.9;
/// The same of a table for what a fit leaves.
const RESIDUAL_SHARE: f64 = 0.85;
/// Uniform density added everywhere, so that no cell is empty. It amounts to one row: with less, the last row would stretch
/// over all that is below the horizon and take part of the lobe with it (measured: up to twice the deviation of broad lobes).
const FLOOR: f64 = 1.0 / (2.0 * PI * ROWS as f64);
/// The view cosine that stands for the horizon, where there is nothing to reflect.
const GRAZING: f64 = 2e-3;
/// The smooth density's range: normal numbers in 16-bit floating point.
const DENSITY_RANGE: (f64, f64) = (1e-4, 6e4);

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
fn viewer(cos_o: f64) -> DVec3 {
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

/// The half vectors at which a target is evaluated: piecewise constant over [row][column].
struct FineGrid {
    /// Borders of the rows in t.
    t: Vec<f64>,
    /// Borders of the columns in the azimuth.
    phi: Vec<f64>,
    /// Sine and cosine of the polar angle at the rows' centres.
    polar: Vec<[f64; 2]>,
    /// Cosine and sine of the azimuth at the columns' centres.
    azimuths: [[f64; FINE_COLUMNS]; 2],
}

impl FineGrid {
    fn new() -> Self {
        // 1 - cos(theta) without cancellation near the normal.
        let t = |row: f64| 2.0 * (FRAC_PI_2 * (row / FINE_ROWS as f64).powi(2) / 2.0).sin().powi(2);
        let phi = |column: f64| PI * column / FINE_COLUMNS as f64;
        let polar = |row: usize| {
            let t = t(row as f64 + 0.5);
            [(t * (2.0 - t)).sqrt(), 1.0 - t]
        };
        let azimuth = |column: usize| phi(column as f64 + 0.5);
        Self {
            t: (0..=FINE_ROWS).map(|row| if row == FINE_ROWS { 1.0 } else { t(row as f64) }).collect(),
            phi: (0..=FINE_COLUMNS).map(|column| phi(column as f64)).collect(),
            polar: (0..FINE_ROWS).map(polar).collect(),
            azimuths: [std::array::from_fn(|i| azimuth(i).cos()), std::array::from_fn(|i| azimuth(i).sin())],
        }
    }

    /// Solid angle of a fine cell of `row`, at one sign of the azimuth.
    fn solid_angle(&self, row: usize) -> f64 {
        (self.t[row + 1] - self.t[row]) * PI / FINE_COLUMNS as f64
    }

    /// Calls `each` for the rows of which something is seen, those columns: the first ones, as the cosines fall with the azimuth.
    /// With the place of the row in a table of values and the number of columns whose light comes from above the horizon.
    fn each_row(&self, cos_o: f64, mut each: impl FnMut(usize, &HalfRow<'_>, usize)) {
        let wo = viewer(cos_o);
        for (row, &polar @ [sine, cosine]) in self.polar.iter().enumerate() {
            let cosines: [f64; FINE_COLUMNS] = self.azimuths[0].map(|x| wo.x * sine * x + wo.z * cosine);
            let lights = cosines.map(|c| 2.0 * c * cosine - wo.z);
            let seen = cosines.iter().take_while(|c| **c > 0.0).count();
            let lit = lights[..seen].iter().take_while(|light| **light > 0.0).count();
            if seen > 0 {
                let azimuths = self.azimuths.each_ref().map(|a| &a[..seen]);
                let row_of = HalfRow { wo, polar, azimuths, cosines: &cosines[..seen], lights: &lights[..seen] };
                each(row * FINE_COLUMNS, &row_of, lit);
            }
        }
    }

    /// The reflected luminance, as a density of half vectors: that of the light's direction times 4 (o.h) (Walter et al. 2007,
    /// equation 14).
    fn reflected(&self, rows: &Rows<'_>, cos_o: f64) -> Vec<f64> {
        let mut reflected = vec![0.0; FINE_ROWS * FINE_COLUMNS];
        self.each_row(cos_o, |at, row, lit| {
            if lit == 0 {
                return;
            }
            let (row, values) = (row.first(lit), &mut reflected[at..at + lit]);
            rows(&row, values);
            for ((f, c), light) in values.iter_mut().zip(row.cosines).zip(row.lights) {
                let value = *f * (4.0 * c * light);
                *f = if value > 0.0 && value < f64::INFINITY { value } else { 0.0 };
            }
        });
        reflected
    }

    /// What a fit leaves of a reflectance, and all of it, in the same way.
    fn residual(&self, residual: &Residual<'_>, fit: &FitNode, cos_o: f64) -> [Vec<f64>; 2] {
        let mut values = [vec![0.0; FINE_ROWS * FINE_COLUMNS], vec![0.0; FINE_ROWS * FINE_COLUMNS]];
        let mut of_row = [[0.0; FINE_COLUMNS]; 2];
        self.each_row(cos_o, |at, row, lit| {
            residual.row(fit, row, lit, of_row.each_mut());
            for (values, of_row) in values.iter_mut().zip(&of_row) {
                let columns = values[at..at + row.cosines.len()].iter_mut().zip(of_row).zip(row.cosines);
                columns.for_each(|((value, f), c)| *value = 4.0 * c * f);
            }
        });
        values
    }

    /// The density of half vectors to aim for, per steradian: `share` of it as `wanted`, the rest a cosine lobe of light, and the
    /// floor.
    fn target(&self, wanted: Vec<f64>, share: f64, cos_o: f64) -> Vec<f64> {
        let mut defensive = vec![0.0; FINE_ROWS * FINE_COLUMNS];
        self.each_row(cos_o, |at, row, lit| {
            for ((d, c), light) in defensive[at..at + lit].iter_mut().zip(row.cosines).zip(row.lights) {
                *d = (1.0 - share) / PI * (4.0 * c * light);
            }
        });
        let integral = self.integral(&wanted);
        let scale = if integral.is_normal() { share / integral } else { 0.0 };
        let mut target = wanted;
        target.iter_mut().zip(defensive).for_each(|(f, d)| *f = *f * scale + d + FLOOR);
        let integral = self.integral(&target);
        target.iter_mut().for_each(|f| *f /= integral);
        target
    }

    /// The integral over both signs of the azimuth.
    fn integral(&self, values: &[f64]) -> f64 {
        let rows = values.as_chunks::<FINE_COLUMNS>().0.iter().enumerate();
        rows.map(|(r, f)| 2.0 * f.iter().sum::<f64>() * self.solid_angle(r)).sum()
    }

    /// Appends one node's cells: strips of equal mass in t, each cut into intervals of equal mass in the azimuth.
    fn cut(&self, target: &[f64], cells: &mut Vec<Cell>) {
        let (fine_rows, _) = target.as_chunks::<FINE_COLUMNS>();
        let mass: Vec<f64> = fine_rows.iter().enumerate().map(|(r, f)| f.iter().sum::<f64>() * self.solid_angle(r)).collect();
        for t in in_steps(&quantiles::<ROWS>(&self.t, &mass), |t| t.sqrt().sqrt()).windows(2) {
            let [t0, t1, ..] = borders([t[0], t[1], 0, 0]).map(f64::from);
            let mut strip = [0.0; FINE_COLUMNS];
            for (row, f) in fine_rows.iter().enumerate() {
                let overlap = self.t[row + 1].min(t1) - self.t[row].max(t0);
                if overlap > 0.0 {
                    strip.iter_mut().zip(f).for_each(|(sum, f)| *sum += f * overlap);
                }
            }
            let columns = in_steps(&quantiles::<COLUMNS>(&self.phi, &strip), |phi| phi / PI);
            cells.extend(columns.windows(2).map(|phi| [t[0], t[1], phi[0], phi[1]]));
        }
    }

    /// Appends one node's smooth density: the target at the centres of the coarser bins.
    fn resample(&self, target: &[f64], density: &mut Vec<f32>) {
        for row in 0..DENSITY_ROWS {
            let fine_row = (row as f64 + 0.5) / DENSITY_ROWS as f64;
            for column in 0..DENSITY_COLUMNS {
                let cos_phi = 1.0 - 2.0 * (column as f64 + 0.5) / DENSITY_COLUMNS as f64;
                let (r0, r1, r) = clamped(fine_row, FINE_ROWS);
                let (c0, c1, c) = clamped(cos_phi.acos() / PI, FINE_COLUMNS);
                let along = |r: usize| {
                    let (a, b) = (target[r * FINE_COLUMNS + c0], target[r * FINE_COLUMNS + c1]);
                    a + (b - a) * c
                };
                let value = along(r0) + (along(r1) - along(r0)) * r;
                density.push(value.clamp(DENSITY_RANGE.0, DENSITY_RANGE.1) as f32);
            }
        }
    }
}

/// The `N + 1` borders that cut positive masses, spread evenly between their `borders`, into `N` equal parts.
fn quantiles<const N: usize>(borders: &[f64], mass: &[f64]) -> Vec<f64> {
    let total: f64 = mass.iter().sum();
    let mut cuts = Vec::with_capacity(N + 1);
    cuts.extend(borders.first());
    let mut below = 0.0;
    for (interval, mass) in borders.windows(2).zip(mass) {
        while cuts.len() < N && below + mass >= total * cuts.len() as f64 / N as f64 {
            let within = ((total * cuts.len() as f64 / N as f64 - below) / mass).clamp(0.0, 1.0);
            cuts.push(interval[0] + (interval[1] - interval[0]) * within);
        }
        below += mass;
    }
    cuts.extend(borders.last());
    cuts
}

/// The nearest steps to increasing `cuts`, of which `share` is the part of the range below them, that increase strictly and
/// fill the range.
fn in_steps(cuts: &[f64], share: impl Fn(f64) -> f64) -> Vec<u16> {
    let last = cuts.len().saturating_sub(1);
    let mut least = 0;
    let step = |(i, &cut): (usize, &f64)| {
        let nearest = (share(cut) * f64::from(STEPS)).round() as u16;
        let step = if i == last { STEPS } else { nearest.clamp(least, STEPS - (last - i) as u16) };
        least = step + u16::from(i < last);
        step
    };
    cuts.iter().enumerate().map(step).collect()
}
