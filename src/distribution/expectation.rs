//! A mixture of Gaussians for the lobes of one texel, by expectation and maximisation (Tan et al. 2005, section 4.1, as a maximum a
//! posteriori with the exact step for the prior). Its samples are not normals but lobes, each a Gaussian of its own: what a component
//! is likely to have made of one is the mean logarithm of its density over the lobe (Vasconcelos and Lippman 1998, "Learning
//! mixture hierarchies"), so that components part by roughness, too.

use crate::distribution::clusters::Placed;
use glam::DVec2;
use std::ops::{Add, Mul};

/// Components of a texel.
pub const GAUSSIANS: usize = 4;

/// As how many samples a lobe counts where it is shared out: of more, components overlap less. Of one in the first rounds, in which
/// components that have little of a texel find what they can have of it.
const SAMPLES_A_LOBE: f64 = 4.0;
/// These rounds.
const SOFT_ROUNDS: usize = 2;

/// Components of less of a texel's mass than this are none.
const LEAST_SHARE: f64 = 1e-9;

/// The likelihood of a lobe, in logarithms, that may end a fit if it changes by less from one round to the next.
const SETTLED: f64 = 1e-4;

/// A lobe of some mass in the plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub at: DVec2,
    /// Each way.
    pub variance: f64,
    pub mass: f64,
}

/// Moments of components: mass; mass times place, x and y; mass times mean products xx, xy, yy, with the lobes' own variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sums(pub [[f64; 6]; GAUSSIANS]);

/// What a texel's neighbours have of a component: the sum of its shares, and its mean place by these.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Neighbours {
    pub share: f64,
    pub mean: DVec2,
}

/// Where the components of neighbouring texels draw those of one, and how strongly: the paper's constant c.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Prior {
    pub of: [Neighbours; GAUSSIANS],
    pub strength: f64,
}

/// A component as samples are compared with it.
#[derive(Clone, Copy, Debug)]
struct Component {
    /// That of nothing is minus infinity.
    log: f64,
    mean: DVec2,
    /// Of the covariance: xx, xy, yy.
    inverse: [f64; 3],
}

/// Those of a texel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Components {
    all: [Component; GAUSSIANS],
    /// As how many samples a lobe counts.
    samples: f64,
}

impl Sums {
    pub const ZERO: Self = Self([[0.0; 6]; GAUSSIANS]);

    pub fn mass(&self) -> f64 {
        self.0.iter().map(|m| m[0]).sum()
    }

    /// Adds a sample to component `i`.
    pub fn take(&mut self, i: usize, s: &Sample, share: f64) {
        let (q, at) = (share * s.mass, s.at);
        let [x, y] = (q * at).to_array();
        let all = [q, x, y, x * at.x + q * s.variance, x * at.y, y * at.y + q * s.variance];
        self.0[i].iter_mut().zip(all).for_each(|(sum, m)| *sum += m);
    }
}

impl Add for Sums {
    type Output = Self;
    fn add(mut self, other: Self) -> Self {
        self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()).for_each(|(a, b)| *a += b);
        self
    }
}

impl Mul<f64> for Sums {
    type Output = Self;
    fn mul(mut self, factor: f64) -> Self {
        self.0.as_flattened_mut().iter_mut().for_each(|m| *m *= factor);
        self
    }
}

impl Prior {
    /// Adds a neighbour with these moments, by `weight`.
    pub fn add(&mut self, neighbour: &Sums, weight: f64) {
        let mass = neighbour.mass().max(f64::MIN_POSITIVE);
        for (of, [q, x, y, ..]) in self.of.iter_mut().zip(&neighbour.0) {
            let share = of.share + weight * q / mass;
            if *q > LEAST_SHARE * mass {
                of.mean += (DVec2::new(*x, *y) / q - of.mean) * (weight * q / mass / share);
                of.share = share;
            }
        }
    }
}

impl Components {
    /// The most probable components of these moments.
    pub fn of(sums: &Sums, prior: &Prior) -> Self {
        Self::counting(sums, prior, SAMPLES_A_LOBE)
    }

    /// The same for lobes that count as so many samples.
    fn counting(sums: &Sums, prior: &Prior, samples: f64) -> Self {
        let total = sums.mass();
        let part = |i: usize| {
            let [q, x, y, xx, xy, yy] = sums.0[i];
            if q.is_nan() || q <= LEAST_SHARE * total {
                return Component { log: f64::NEG_INFINITY, mean: DVec2::ZERO, inverse: [0.0; 3] };
            }
            let own = DVec2::new(x, y) / q;
            let [xx, xy, yy] = [xx / q - own.x * own.x, xy / q - own.x * own.y, yy / q - own.y * own.y];
            let Neighbours { share, mean: drawn } = prior.of[i];
            // The derivative of the likelihood is share (own - mean) / covariance, that of the prior 2 c times what neighbours have
            // of (drawn - mean): (own + P drawn) / (1 + P) with the matrix P = 2 c times their share over the own, times covariance.
            let pull = 2.0 * prior.strength * share * total / q;
            let [a, b, c] = [1.0 + pull * xx, pull * xy, 1.0 + pull * yy];
            let off = drawn - own;
            let drag = pull * DVec2::new(xx * off.x + xy * off.y, xy * off.x + yy * off.y);
            let moved = DVec2::new(c * drag.x - b * drag.y, a * drag.y - b * drag.x) / (a * c - b * b);
            let [xx, yy] = [xx + moved.x * moved.x, yy + moved.y * moved.y].map(|v| v.max(1e-12));
            let most = 0.999 * (xx * yy).sqrt();
            let xy = (xy + moved.x * moved.y).clamp(-most, most);
            let determinant = xx * yy - xy * xy;
            let log = (q / total).ln() - 0.5 * samples * determinant.ln();
            Component { log, mean: own + moved, inverse: [yy / determinant, -xy / determinant, xx / determinant] }
        };
        Self { all: std::array::from_fn(part), samples }
    }

    /// How much each component has of a sample, and the logarithm of its likelihood.
    pub fn shares(&self, s: &Sample) -> ([f64; GAUSSIANS], f64) {
        let scores = self.scores(s);
        let most = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let shares = scores.map(|score| (score - most).exp());
        let sum: f64 = shares.iter().sum();
        (shares.map(|share| share / sum), (most + sum.ln()) / self.samples)
    }

    /// The component that has the most of a sample.
    pub fn nearest(&self, s: &Sample) -> usize {
        let scores = self.scores(s).into_iter().enumerate();
        scores.fold((0, f64::NEG_INFINITY), |best, (i, score)| if score > best.1 { (i, score) } else { best }).0
    }

    fn scores(&self, s: &Sample) -> [f64; GAUSSIANS] {
        self.all.map(|c| {
            let (d, [xx, xy, yy]) = (s.at - c.mean, c.inverse);
            let square = xx * d.x * d.x + 2.0 * xy * d.x * d.y + yy * d.y * d.y;
            c.log - 0.5 * self.samples * (square + s.variance * (xx + yy))
        })
    }

    /// The moments of `samples` by these components, and the mean logarithm of their likelihood.
    pub fn moments<'a>(&self, samples: impl Iterator<Item = &'a Sample>) -> (Sums, f64) {
        let (mut sums, mut likelihood) = (Sums::ZERO, 0.0);
        for s in samples {
            let (shares, log) = self.shares(s);
            likelihood += s.mass * log;
            shares.iter().enumerate().filter(|(_, share)| **share > 1e-12).for_each(|(i, share)| sums.take(i, s, *share));
        }
        (sums, likelihood / sums.mass().max(f64::MIN_POSITIVE))
    }
}

/// How long a fit takes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rounds {
    pub most: usize,
    /// Whether it ends before where little changes.
    pub until_settled: bool,
}

/// The components of `samples`, from those of moments `start`; the moments that they are of, and the mean logarithm of the samples'
/// likelihood in the round before.
pub(super) fn fit(start: &Sums, samples: &[Sample], prior: &Prior, rounds: Rounds) -> (Components, Sums, f64) {
    let of =
        |sums: &Sums, round: usize| Components::counting(sums, prior, if round < SOFT_ROUNDS { 1.0 } else { SAMPLES_A_LOBE });
    let mut components = of(start, 0);
    let (mut found, mut last) = (*start, f64::NEG_INFINITY);
    for round in 1..=rounds.most {
        let (sums, likelihood) = components.moments(samples.iter());
        components = of(&sums, round);
        let settled = (likelihood - last).abs() < SETTLED && round > SOFT_ROUNDS;
        (found, last) = (sums, likelihood);
        if settled && rounds.until_settled {
            break;
        }
    }
    (components, found, last)
}

impl Sample {
    pub fn of(placed: &Placed, centre: DVec2, mass: f64) -> Self {
        Self { at: placed.at - centre, variance: placed.variance, mass }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distribution::clustering::clustered;
    use crate::sampling::sobol;

    fn until_settled(most: usize) -> Rounds {
        Rounds { most, until_settled: true }
    }

    fn samples() -> Vec<Sample> {
        // Four heaps, of which two are at one place and differ in width.
        let heaps = [(-0.4, 0.0, 1e-3), (0.3, 0.3, 1e-3), (0.3, -0.3, 1e-3), (0.3, -0.3, 0.05)];
        let sample = |i: u32| {
            let (x, y, variance) = heaps[(i % 4) as usize];
            let [u, v] = sobol::point(i / 4, 5).map(sobol::to_unit);
            Sample { at: DVec2::new(x + 0.02 * (u - 0.5), y + 0.08 * (v - 0.5)), variance, mass: 0.3 }
        };
        (0..400).map(sample).collect()
    }

    #[test]
    fn heaps_are_told_apart_by_place_and_width() {
        let samples = samples();
        let (found, ..) = fit(&clustered(&samples, 3), &samples, &Prior::default(), until_settled(64));
        let (sums, _) = found.moments(samples.iter());
        let mut shares: Vec<_> = sums.0.iter().map(|m| m[0] / sums.mass()).collect();
        shares.sort_by(f64::total_cmp);
        assert!(shares.iter().all(|s| (s - 0.25).abs() < 0.01), "{shares:?}");
        // Nothing is lost.
        let all = samples.iter().fold(Sums::ZERO, |mut all, s| {
            all.take(0, s, 1.0);
            all
        });
        for k in 0..6 {
            let sum: f64 = sums.0.iter().map(|m| m[k]).sum();
            assert!((sum - all.0[0][k]).abs() < 1e-9, "{k}: {sum}");
        }
        // The tall heap on the left has its shape.
        let left = sums.0.iter().find(|m| m[1] < -0.3 * m[0]).unwrap();
        let [xx, yy] = [left[3] / left[0] - (left[1] / left[0]).powi(2), left[5] / left[0] - (left[2] / left[0]).powi(2)];
        assert!(
            (xx - 1e-3 - 0.02f64.powi(2) / 12.0).abs() < 1e-5 && (yy - 1e-3 - 0.08f64.powi(2) / 12.0).abs() < 3e-5,
            "{left:?}"
        );
    }

    #[test]
    fn what_is_alike_is_one() {
        let one = Sample { at: DVec2::new(0.1, -0.2), variance: 0.01, mass: 0.7 };
        let samples = [one; 9];
        let (found, ..) = fit(&clustered(&samples, 1), &samples, &Prior::default(), until_settled(8));
        let (shares, _) = found.shares(&one);
        assert_eq!(shares.iter().filter(|s| **s > 0.0).count(), 1);
        assert_eq!(clustered(&[], 0), Sums::ZERO);
    }

    #[test]
    fn neighbours_draw_a_mean_as_far_as_it_is_most_probable() {
        let samples: Vec<_> = samples().into_iter().filter(|s| s.at.x < 0.0).collect();
        let start = clustered(&samples[..1], 0);
        let mut neighbour = Sums::ZERO;
        neighbour.take(0, &Sample { at: DVec2::new(0.5, 0.1), variance: 0.1, mass: 2.0 }, 1.0);
        let mut prior = Prior { strength: 1.0, ..Prior::default() };
        prior.add(&neighbour, 1.0);
        let (found, ..) = fit(&start, &samples, &prior, until_settled(64));
        let (mean, inverse) = (found.all[0].mean, found.all[0].inverse);
        // Where the derivative of log likelihood and prior is 0.
        let own = samples.iter().map(|s| s.at).sum::<DVec2>() / samples.len() as f64;
        let off = own - mean;
        let likelihood = DVec2::new(inverse[0] * off.x + inverse[1] * off.y, inverse[1] * off.x + inverse[2] * off.y);
        let drawn = 2.0 * (DVec2::new(0.5, 0.1) - mean);
        // The covariance in it is that of the round before the mean moved.
        assert!((likelihood + drawn).length() < 0.02 * drawn.length(), "{likelihood} {drawn}");
        assert!(mean.x > own.x + 1e-4);
    }
}
