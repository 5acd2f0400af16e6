//! Least squares under the condition that no unknown is negative.

use nalgebra::{DMatrix, DVector};

/// The `x >= 0` that minimises `x' G x / 2 - b' x` for a positive definite `gram` (Lawson and Hanson 1974, "Solving Least Squares
/// Problems", chapter 23, on the normal equations as in Bro and de Jong 1997), from `start`, of which negative numbers count
/// as 0. Should the matrix turn out not to be positive definite in some subset, what has been found until then.
pub fn solve(gram: &DMatrix<f64>, b: &DVector<f64>, start: &DVector<f64>) -> DVector<f64> {
    let n = b.len();
    let mut x = start.map(|v| if v > 0.0 && v.is_finite() { v } else { 0.0 });
    let mut free: Vec<usize> = (0..n).filter(|&i| x[i] > 0.0).collect();
    let tolerance = 1e-10 * b.amax();
    for _ in 0..3 * n {
        // To the best point of the free unknowns, or until all that would be negative are held at 0.
        while !free.is_empty() {
            let part = DMatrix::from_fn(free.len(), free.len(), |i, j| gram[(free[i], free[j])]);
            let Some(factor) = part.cholesky() else { return x };
            let best = factor.solve(&DVector::from_fn(free.len(), |i, _| b[free[i]]));
            let reach = free.iter().zip(best.iter()).filter(|(_, best)| **best <= 0.0);
            let Some(reach) = reach.map(|(&i, best)| x[i] / (x[i] - best)).reduce(f64::min) else {
                free.iter().zip(best.iter()).for_each(|(&i, best)| x[i] = *best);
                break;
            };
            free.iter().zip(best.iter()).for_each(|(&i, best)| x[i] += (best - x[i]) * reach);
            let kept: Vec<usize> =
                free.iter().zip(best.iter()).filter(|(i, best)| **best > 0.0 || x[**i] > 1e-14).map(|(i, _)| *i).collect();
            free.iter().filter(|i| !kept.contains(i)).for_each(|&i| x[i] = 0.0);
            if kept.len() == free.len() {
                // Rounding: the one that stopped the step.
                let least = free.iter().copied().min_by(|&i, &j| x[i].total_cmp(&x[j]));
                free.retain(|i| Some(*i) != least);
                least.into_iter().for_each(|i| x[i] = 0.0);
            } else {
                free = kept;
            }
        }
        let slope = b - gram * &x;
        let steepest = (0..n).filter(|i| !free.contains(i)).max_by(|&i, &j| slope[i].total_cmp(&slope[j]));
        match steepest {
            Some(i) if slope[i] > tolerance => free.push(i),
            _ => break,
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::sobol;

    #[test]
    fn no_direction_leads_further_down() {
        for case in 0..200 {
            let n = 1 + case as usize % 12;
            let random = |i: u32| sobol::to_unit(sobol::random(case * 1000 + i, 7)[0]) - 0.4;
            let a = DMatrix::from_fn(20, n, |i, j| random((i * n + j) as u32));
            let b = a.transpose() * DVector::from_fn(20, |i, _| random(500 + i as u32));
            let gram = a.transpose() * &a;
            let start = DVector::from_fn(n, |i, _| random(700 + i as u32));
            for start in [DVector::zeros(n), start] {
                let x = solve(&gram, &b, &start);
                let slope = &b - &gram * &x;
                for i in 0..n {
                    assert!(x[i] >= 0.0 && slope[i] < 1e-8 && (x[i] == 0.0 || slope[i] > -1e-8), "{case}: {x} {slope}");
                }
            }
        }
    }
}
