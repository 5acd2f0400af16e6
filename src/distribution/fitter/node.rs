//! The fit at one view angle.

use super::chain::{Chain, NUMBERS, by_log2_kappa};
use super::grid::Grid;
use super::nnls;
use crate::distribution::fit::{FitLobe, FitNode};
use crate::distribution::vmf::normalisation;
use glam::DVec3;
use nalgebra::{DMatrix, DVector, DVectorViewMut};
use std::f64::consts::PI;

/// Share of the albedo, spread over the half sphere, that is added to the values by which squared errors are divided. With less,
/// what leaks below the horizon counts so much that broad lobes come out too narrow (0.02: up to 1.5 times the mean error).
const SOFTENING: f64 = 0.3;
/// How hard the chains are drawn to those of the node before, against a total of squared values of 1.
const PULL: f64 = 0.002;
/// The same of amplitudes, against each one's own share.
const AMPLITUDE_PULL: f64 = 1e-4;
/// A step that gains less than this share of the error is the last.
const LEAST_GAIN: f64 = 2e-3;

/// Chains and amplitudes of one view angle.
#[derive(Clone, Debug)]
pub struct State {
    pub chains: Vec<Chain>,
    /// Of all lobes and the cosine part, by channel.
    pub amplitudes: [DVector<f64>; 3],
    /// What was minimised.
    pub cost: f64,
}

/// A grid with what is the same in every step: the square roots of the weights, by channel.
pub struct Problem<'a> {
    grid: &'a Grid,
    weights: [Vec<f64>; 3],
}

/// Sums over a grid of the weighted products of values with each other, with the reflectance, and of its with itself.
pub struct Products {
    pub gram: DMatrix<f64>,
    pub b: DVector<f64>,
    pub squares: f64,
}

/// The lobes' values, and their derivatives by tilt and by log2 of the concentration.
struct Columns {
    values: DMatrix<f64>,
    slopes: [DMatrix<f64>; 2],
}

impl<'a> Problem<'a> {
    /// Squared errors over the values, so that the total of a channel without a fit is its share of the albedo.
    pub fn new(grid: &'a Grid) -> Self {
        let total = grid.albedo.element_sum().max(f64::MIN_POSITIVE);
        let weights = std::array::from_fn(|c| {
            let softening = (SOFTENING * grid.albedo[c] / PI).max(1e-30);
            let weight = |(f, s): (&DVec3, &f64)| s / (f[c] + softening);
            let weights: Vec<f64> = grid.values.iter().zip(&grid.solid_angles).map(weight).collect();
            let squares: f64 = weights.iter().zip(&grid.values).map(|(w, f)| w * f[c] * f[c]).sum();
            let scale = if squares > 0.0 { grid.albedo[c] / total / squares } else { 0.0 };
            weights.iter().map(|w| (w * scale).sqrt()).collect()
        });
        Self { grid, weights }
    }

    /// Chains and amplitudes refined in at most so many steps, drawn to those of `before`.
    pub fn refine(&self, chains: Vec<Chain>, before: Option<&State>, steps: usize) -> State {
        let mut columns = self.columns(&chains);
        let mut state = self.amplitudes(chains, &columns.values, before, before);
        let mut damping = 1e-2;
        for _ in 0..steps {
            let (gradient, curvature) = self.linearised(&state, &columns, before);
            let mut gained = 0.0;
            for _ in 0..5 {
                let mut damped = curvature.clone();
                for i in 0..damped.nrows() {
                    damped[(i, i)] += damping * curvature[(i, i)] + 1e-12;
                }
                let Some(step) = damped.cholesky().map(|factor| factor.solve(&gradient)) else { break };
                let move_by = |(c, by): (&Chain, &[f64])| {
                    let units = c.units();
                    let by: Vec<f64> = by.iter().zip(units).map(|(x, unit)| x.clamp(-1.0, 1.0) * unit).collect();
                    c.moved(&by)
                };
                let chains: Vec<Chain> = state.chains.iter().zip(step.as_slice().chunks(NUMBERS)).map(move_by).collect();
                let trial = self.columns(&chains);
                let tried = self.amplitudes(chains, &trial.values, Some(&state), before);
                if tried.cost < state.cost {
                    gained = 1.0 - tried.cost / state.cost;
                    (state, columns) = (tried, trial);
                    damping = (damping * 0.3).max(1e-6);
                    break;
                }
                damping *= 8.0;
            }
            if gained < LEAST_GAIN {
                break;
            }
        }
        state
    }

    fn columns(&self, chains: &[Chain]) -> Columns {
        let (points, lobes) = (self.grid.directions.len(), chains.iter().map(|c| c.count).sum::<usize>());
        let mut columns =
            Columns { values: DMatrix::zeros(points, lobes + 1), slopes: std::array::from_fn(|_| DMatrix::zeros(points, lobes)) };
        for (k, [tilt, log2_kappa]) in chains.iter().flat_map(|c| c.lobes(self.grid.view)).enumerate() {
            let (kappa, (sin, cos)) = (log2_kappa.exp2(), tilt.sin_cos());
            let peak = normalisation(kappa);
            let along = by_log2_kappa(kappa, 0.0);
            let [by_tilt, by_kappa] = &mut columns.slopes;
            let mut value = columns.values.column_mut(k);
            let (mut by_tilt, mut by_kappa) = (by_tilt.column_mut(k), by_kappa.column_mut(k));
            for (i, w) in self.grid.directions.iter().enumerate() {
                let exponent = kappa * (cos * w.z - sin * w.x - 1.0);
                if exponent > -30.0 {
                    let v = peak * exponent.exp();
                    value[i] = v;
                    by_tilt[i] = -v * kappa * (sin * w.z + cos * w.x);
                    by_kappa[i] = v * (along + std::f64::consts::LN_2 * exponent);
                }
            }
        }
        self.cosine(columns.values.column_mut(lobes));
        columns
    }

    /// Of the weighted values of lobes and of the reflectance, in one channel.
    fn products(&self, values: &DMatrix<f64>, channel: usize) -> Products {
        let (n, weights) = (values.ncols(), &self.weights[channel]);
        let mut with_target = DMatrix::zeros(values.nrows(), n + 1);
        for (to, from) in with_target.column_iter_mut().zip(values.column_iter()) {
            scale(to, from, weights);
        }
        let targets = self.grid.values.iter().zip(weights).map(|(f, w)| f[channel] * w);
        with_target.column_mut(n).iter_mut().zip(targets).for_each(|(to, from)| *to = from);
        let all = with_target.transpose() * &with_target;
        let gram = all.view((0, 0), (n, n)).into_owned();
        Products { gram, b: all.view((0, n), (n, 1)).column(0).into_owned(), squares: all[(n, n)] }
    }

    /// The products of `lobes` and of the cosine part, which is the last, by channel.
    pub fn products_of(&self, lobes: &[FitLobe]) -> [Products; 3] {
        let mut values = DMatrix::zeros(self.grid.directions.len(), lobes.len() + 1);
        for (mut column, lobe) in values.column_iter_mut().zip(lobes) {
            let (kappa, centre) = (lobe.log2_kappa.exp2(), lobe.direction());
            let peak = normalisation(kappa);
            let density = |w: &DVec3| peak * (kappa * (centre.dot(*w) - 1.0)).exp();
            column.iter_mut().zip(&self.grid.directions).for_each(|(v, w)| *v = density(w));
        }
        self.cosine(values.column_mut(lobes.len()));
        std::array::from_fn(|channel| self.products(&values, channel))
    }

    /// The values of the cosine part.
    fn cosine(&self, mut column: DVectorViewMut<'_, f64>) {
        column.iter_mut().zip(&self.grid.directions).for_each(|(v, w)| *v = w.z.max(0.0) / PI);
    }

    /// The best amplitudes of `chains`, searched from those of `start`.
    fn amplitudes(&self, chains: Vec<Chain>, values: &DMatrix<f64>, start: Option<&State>, before: Option<&State>) -> State {
        let n = values.ncols();
        let mut cost = before.map_or(0.0, |before| pull(&chains, before).map(|p| p * p).sum::<f64>() * PULL);
        let amplitudes = std::array::from_fn(|c| {
            let Products { mut gram, mut b, squares } = self.products(values, c);
            if squares <= 0.0 {
                return DVector::zeros(n);
            }
            for i in 0..n {
                let ridge = AMPLITUDE_PULL * gram[(i, i)] + 1e-14;
                gram[(i, i)] += ridge;
                b[i] += ridge * before.map_or(0.0, |before| before.amplitudes[c][i]);
            }
            let start = start.map_or_else(|| DVector::zeros(n), |start| start.amplitudes[c].clone());
            let x = nnls::solve(&gram, &b, &start);
            cost += squares + x.dot(&(&gram * &x)) - 2.0 * x.dot(&b);
            x
        });
        State { chains, amplitudes, cost }
    }

    /// Half the negative gradient by the chains' numbers in their units, and half the curvature, both as if the amplitudes
    /// followed (variable projection: Golub and Pereyra 1973; without the residual's second derivatives).
    fn linearised(&self, state: &State, columns: &Columns, before: Option<&State>) -> (DVector<f64>, DMatrix<f64>) {
        let (points, n) = columns.values.shape();
        let q = NUMBERS * state.chains.len();
        let (mut gradient, mut curvature) = (DVector::zeros(q), DMatrix::zeros(q, q));
        let mut first = 0;
        let mut slopes = Vec::new();
        for chain in &state.chains {
            slopes.push((first, chain.slopes(self.grid.view), chain.units()));
            first += chain.count;
        }
        for (c, weights) in self.weights.iter().enumerate() {
            let x = &state.amplitudes[c];
            let free: Vec<usize> = (0..n).filter(|&i| x[i] > 0.0).collect();
            if free.is_empty() {
                continue;
            }
            // Weighted: the derivatives, the values of the free lobes, and what is left of the target.
            let mut all = DMatrix::zeros(points, q + free.len() + 1);
            for (chain, (first, slopes, units)) in slopes.iter().enumerate() {
                for (lobe, by) in slopes.iter().enumerate() {
                    let amplitude = x[first + lobe];
                    if amplitude == 0.0 {
                        continue;
                    }
                    for number in 0..NUMBERS {
                        let factors = by[number].map(|d| d * amplitude * units[number]);
                        let [by_tilt, by_kappa] = columns.slopes.each_ref().map(|s| s.column(first + lobe));
                        let mut to = all.column_mut(NUMBERS * chain + number);
                        to.axpy(factors[0], &by_tilt, 1.0);
                        to.axpy(factors[1], &by_kappa, 1.0);
                    }
                }
            }
            for mut column in all.column_iter_mut().take(q) {
                column.iter_mut().zip(weights).for_each(|(v, w)| *v *= w);
            }
            for (j, &k) in free.iter().enumerate() {
                scale(all.column_mut(q + j), columns.values.column(k), weights);
            }
            let fitted = &columns.values * x;
            let rest = self.grid.values.iter().zip(fitted.iter()).zip(weights).map(|((f, a), w)| (f[c] - a) * w);
            all.column_mut(q + free.len()).iter_mut().zip(rest).for_each(|(to, from)| *to = from);

            let by_numbers = all.columns(0, q).transpose() * &all;
            let values = all.columns(q, free.len());
            let mut gram = values.transpose() * values;
            (0..free.len()).for_each(|i| gram[(i, i)] *= 1.0 + AMPLITUDE_PULL);
            let cross = by_numbers.view((0, q), (q, free.len())).into_owned();
            gradient += by_numbers.column(q + free.len());
            curvature += by_numbers.view((0, 0), (q, q));
            if let Some(factor) = gram.cholesky() {
                curvature -= &cross * factor.solve(&cross.transpose());
            }
        }
        if let Some(before) = before {
            for (i, pull) in pull(&state.chains, before).enumerate() {
                gradient[i] -= PULL * pull;
                curvature[(i, i)] += PULL;
            }
        }
        (gradient, curvature)
    }
}

/// The differences to the chains before, in their units.
fn pull(chains: &[Chain], before: &State) -> impl Iterator<Item = f64> {
    chains.iter().zip(&before.chains).flat_map(|(a, b)| {
        let units = b.units();
        (0..NUMBERS).map(move |i| (a.numbers[i] - b.numbers[i]) / units[i])
    })
}

fn scale<'a>(mut to: DVectorViewMut<'_, f64>, from: nalgebra::DVectorView<'a, f64>, weights: &[f64]) {
    to.iter_mut().zip(from.iter()).zip(weights).for_each(|((to, from), w)| *to = from * w);
}

impl State {
    /// As lobes, without the error.
    pub fn node(&self, view: f64) -> FitNode {
        let amplitude = |i: usize| DVec3::from_array(self.amplitudes.each_ref().map(|a| a[i]));
        let lobes: Vec<FitLobe> = self
            .chains
            .iter()
            .flat_map(|c| c.lobes(view))
            .enumerate()
            .map(|(i, [tilt, log2_kappa])| FitLobe { tilt, log2_kappa, amplitude: amplitude(i) })
            .collect();
        FitNode { diffuse: amplitude(lobes.len()), lobes, error: 0.0 }
    }
}
