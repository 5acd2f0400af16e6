//! The half vectors on which an importance table's targets are tabulated, and how its cells are cut out of them.

use crate::distribution::fit::FitNode;
use crate::reflectance::clamped;
use crate::reflectance::half_row::{HalfRow, Rows};
use crate::reflectance::importance::{COLUMNS, Cell, DENSITY_COLUMNS, DENSITY_ROWS, ROWS, STEPS, borders, viewer};
use crate::reflectance::residual::Residual;
use std::f64::consts::{FRAC_PI_2, PI};

/// The grid on which a target is tabulated: rows uniform in `sqrt(theta_h / (pi/2))`, so that a lobe of alpha 0.01 spans 40.
const FINE_ROWS: usize = 512;
const FINE_COLUMNS: usize = 64;
/// Uniform density added everywhere, so that no cell is empty. It amounts to one row: with less, the last row would stretch
/// over all that is below the horizon and take part of the lobe with it (measured: up to twice the deviation of broad lobes).
const FLOOR: f64 = 1.0 / (2.0 * PI * ROWS as f64);
/// The smooth density's range: normal numbers in 16-bit floating point.
const DENSITY_RANGE: (f64, f64) = (1e-4, 6e4);

/// The half vectors at which a target is evaluated: piecewise constant over [row][column].
pub(super) struct FineGrid {
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
    pub fn new() -> Self {
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
    pub fn reflected(&self, rows: &Rows<'_>, cos_o: f64) -> Vec<f64> {
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
    pub fn residual(&self, residual: &Residual<'_>, fit: &FitNode, cos_o: f64) -> [Vec<f64>; 2] {
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
    pub fn target(&self, wanted: Vec<f64>, share: f64, cos_o: f64) -> Vec<f64> {
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
    pub fn integral(&self, values: &[f64]) -> f64 {
        let rows = values.as_chunks::<FINE_COLUMNS>().0.iter().enumerate();
        rows.map(|(r, f)| 2.0 * f.iter().sum::<f64>() * self.solid_angle(r)).sum()
    }

    /// Appends one node's cells: strips of equal mass in t, each cut into intervals of equal mass in the azimuth.
    pub fn cut(&self, target: &[f64], cells: &mut Vec<Cell>) {
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
    pub fn resample(&self, target: &[f64], density: &mut Vec<f32>) {
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
