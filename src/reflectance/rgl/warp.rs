//! Functions and warps of the unit square that depend on parameters (Dupuy and Jakob 2018, section 4): values on a grid whose
//! outermost nodes are on the border, bilinear between them, one grid for each combination of the parameters' nodes, linear
//! between those.

use std::ops::{Add, Mul};

/// What a grid holds: numbers or colours.
pub(super) trait Value: Copy + Default + Add<Output = Self> + Mul<f64, Output = Self> {}
impl<T: Copy + Default + Add<Output = Self> + Mul<f64, Output = Self>> Value for T {}

/// A family of grids, the parameters' first axis slowest, then rows (y), then columns (x).
#[derive(Clone, Debug)]
pub(super) struct Grids<T> {
    /// Columns and rows, each at least 2.
    size: [usize; 2],
    /// Rising nodes of each parameter.
    axes: Vec<Vec<f64>>,
    values: Vec<T>,
}

/// A family of densities over the square that are turned into uniform ones, columns within rows.
#[derive(Clone, Debug)]
pub(super) struct Warp {
    density: Grids<f64>,
    /// `[slice][row][column]`: integral of the row up to the column.
    conditional: Vec<f64>,
    /// `[slice][row]`: integral up to the row.
    marginal: Vec<f64>,
}

/// Up to four slices with their weights.
type Slices = [(usize, f64); 4];

impl<T: Value> Grids<T> {
    /// `None` unless sizes and count of values agree.
    pub fn new(size: [usize; 2], axes: Vec<Vec<f64>>, values: Vec<T>) -> Option<Self> {
        let slices = axes.iter().try_fold(1usize, |n, axis| n.checked_mul(axis.len()))?;
        let count = slices.checked_mul(size[0])?.checked_mul(size[1])?;
        let fits = size.iter().all(|&side| side >= 2) && slices > 0 && axes.len() <= 2 && values.len() == count;
        fits.then_some(Self { size, axes, values })
    }

    /// The slices around parameters, one for each axis.
    fn slices(&self, parameters: &[f64]) -> Slices {
        let mut slices = [(0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)];
        let mut used = 1;
        for (axis, &parameter) in self.axes.iter().zip(parameters) {
            let (node, weight) = interval(axis, parameter);
            for i in 0..used {
                let (slice, share) = slices[i];
                let slice = slice * axis.len() + node;
                slices[i] = (slice, share * (1.0 - weight));
                if let Some(upper) = slices.get_mut(i + used) {
                    *upper = (slice + usize::from(weight > 0.0), share * weight);
                }
            }
            used *= 2;
        }
        slices
    }

    fn at(&self, slice: usize, row: usize, column: usize) -> T {
        self.values.get((slice * self.size[1] + row) * self.size[0] + column).copied().unwrap_or_default()
    }

    /// The cell that holds a point of the square, and where in it.
    fn cell(&self, u: [f64; 2]) -> ([usize; 2], [f64; 2]) {
        let along = |u: f64, side: usize| {
            let last = side - 2;
            let x = u.clamp(0.0, 1.0) * (last + 1) as f64;
            let cell = (x as usize).min(last);
            (cell, x - cell as f64)
        };
        let [(column, x), (row, y)] = [along(u[0], self.size[0]), along(u[1], self.size[1])];
        ([column, row], [x, y])
    }

    /// The value at `u` = (x, y) in the square.
    pub fn value(&self, u: [f64; 2], parameters: &[f64]) -> T {
        let ([column, row], [x, y]) = self.cell(u);
        let in_row = |slice, row| lerp(self.at(slice, row, column), self.at(slice, row, column + 1), x);
        let slices = self.slices(parameters).into_iter().filter(|s| s.1 > 0.0);
        slices.fold(T::default(), |sum, (slice, weight)| sum + lerp(in_row(slice, row), in_row(slice, row + 1), y) * weight)
    }
}

impl Warp {
    /// `None` if a slice has no integral above 0 or a negative value.
    pub fn new(mut density: Grids<f64>) -> Option<Self> {
        if density.values.iter().any(|v| *v < 0.0) {
            return None;
        }
        let [columns, rows] = density.size;
        let step = [1.0 / (columns - 1) as f64, 1.0 / (rows - 1) as f64];
        let (mut conditional, mut marginal) = (Vec::new(), Vec::new());
        for slice in density.values.chunks_exact_mut(columns * rows) {
            let row_sums: Vec<f64> = slice.chunks_exact(columns).map(|row| running(row, step[0]).last().unwrap_or(0.0)).collect();
            let total = running(&row_sums, step[1]).last().unwrap_or(0.0);
            if !total.is_normal() {
                return None;
            }
            slice.iter_mut().for_each(|v| *v /= total);
            slice.chunks_exact(columns).for_each(|row| conditional.extend(running(row, step[0])));
            let row_sums: Vec<f64> = row_sums.iter().map(|sum| sum / total).collect();
            marginal.extend(running(&row_sums, step[1]));
        }
        Some(Self { density, conditional, marginal })
    }

    /// The point of the square that the warp takes to `u` = (x, y).
    pub fn invert(&self, u: [f64; 2], parameters: &[f64]) -> [f64; 2] {
        let grids = &self.density;
        let [columns, rows] = grids.size;
        let step = [1.0 / (columns - 1) as f64, 1.0 / (rows - 1) as f64];
        let ([column, row], [x, y]) = grids.cell(u);
        let (mut below, mut across, mut left) = (0.0, [0.0; 2], 0.0);
        for (slice, weight) in grids.slices(parameters).into_iter().filter(|s| s.1 > 0.0) {
            let sum =
                |row: usize, column: usize| self.conditional.get((slice * rows + row) * columns + column).copied().unwrap_or(0.0);
            below += weight * self.marginal.get(slice * rows + row).copied().unwrap_or(0.0);
            for (i, across) in across.iter_mut().enumerate() {
                *across += weight * sum(row + i, columns - 1);
            }
            let value = |c: usize| lerp(grids.at(slice, row, c), grids.at(slice, row + 1, c), y);
            let before = lerp(sum(row, column), sum(row + 1, column), y);
            left += weight * (before + step[0] * partial(value(column), value(column + 1), x));
        }
        let whole = lerp(across[0], across[1], y);
        let first = if whole > 0.0 { left / whole } else { u[0] };
        let second = below + step[1] * partial(across[0], across[1], y);
        [first.clamp(0.0, 1.0), second.clamp(0.0, 1.0)]
    }
}

/// The interval of rising `nodes` that holds `x`, and the weight of its upper end; clamped.
fn interval(nodes: &[f64], x: f64) -> (usize, f64) {
    let last = nodes.len().saturating_sub(2);
    let node = nodes.partition_point(|n| *n <= x).saturating_sub(1).min(last);
    let weight = match (nodes.get(node), nodes.get(node + 1)) {
        (Some(a), Some(b)) if b > a => ((x - a) / (b - a)).clamp(0.0, 1.0),
        _ => 0.0,
    };
    (node, weight)
}

/// Integrals of a piecewise linear function from the first node up to each.
fn running(values: &[f64], step: f64) -> impl Iterator<Item = f64> {
    let pairs = values.windows(2).map(|pair| match pair {
        [a, b] => 0.5 * (a + b),
        _ => 0.0,
    });
    std::iter::once(0.0).chain(pairs).scan(0.0, move |sum, v| {
        *sum += v * step;
        Some(*sum)
    })
}

/// The integral of a linear function from 0 to `x` that is `a` at 0 and `b` at 1.
fn partial(a: f64, b: f64, x: f64) -> f64 {
    x * (a + 0.5 * x * (b - a))
}

fn lerp<T: Value>(a: T, b: T, t: f64) -> T {
    a * (1.0 - t) + b * t
}
