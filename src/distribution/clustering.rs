//! From where the fit of a texel's mixture starts, if not from its neighbours: clusters of its lobes, of which one may be divided for a
//! component that has none (`glsl/include/divide.glsl` is the twin of that).

use crate::distribution::expectation::{Components, GAUSSIANS, Sample, Sums};
use crate::sampling::sobol;
use glam::DVec2;

/// Rounds in which lobes go to the nearest centre.
const ROUNDS: usize = 8;

/// The same where one component's are divided between two.
const HALVINGS: usize = 4;

/// A component of less of a texel's mass may have some of another's.
const FREE: f64 = 1e-3;

/// Clusters of samples from which a fit starts: those nearest to seeds that are far from each other, the first of which `seed` draws
/// (the paper draws all). Fewer where samples are alike.
pub(super) fn clustered(samples: &[Sample], seed: u32) -> Sums {
    let mut centres: Vec<Sample> = Vec::with_capacity(GAUSSIANS);
    let first = ((u64::from(sobol::hash(seed)) * samples.len() as u64) >> 32) as usize;
    centres.extend(samples.get(first));
    while centres.len() < GAUSSIANS {
        let far = |s: &Sample| s.mass * centres.iter().map(|c| apart(s, c)).fold(f64::INFINITY, f64::min);
        let next = samples.iter().map(|s| (far(s), s));
        let Some((far, next)) = next.reduce(|best, other| if other.0 > best.0 { other } else { best }) else { break };
        if far <= 1e-9 * next.mass {
            break;
        }
        centres.push(*next);
    }
    let mut assigned = vec![usize::MAX; samples.len()];
    let mut sums = Sums::ZERO;
    for _ in 0..ROUNDS {
        let (mut changed, mut logs) = (false, [0.0; GAUSSIANS]);
        sums = Sums::ZERO;
        for (s, assigned) in samples.iter().zip(&mut assigned) {
            let distances = centres.iter().map(|c| apart(s, c)).enumerate();
            let nearest = distances.fold((0, f64::INFINITY), |best, (i, d)| if d < best.1 { (i, d) } else { best }).0;
            changed |= std::mem::replace(assigned, nearest) != nearest;
            sums.take(nearest, s, 1.0);
            logs[nearest] += s.mass * s.variance.ln();
        }
        if !changed {
            break;
        }
        for ((centre, [q, x, y, ..]), log) in centres.iter_mut().zip(&sums.0).zip(logs).filter(|((_, m), _)| m[0] > 0.0) {
            *centre = Sample { at: DVec2::new(*x, *y) / q, variance: (log / q).exp(), mass: *q };
        }
    }
    sums
}

/// How far two lobes are from each other: places over widths, and widths.
fn apart(a: &Sample, b: &Sample) -> f64 {
    0.5 * (a.at - b.at).length_squared() / (a.variance * b.variance).sqrt() + 0.5 * (a.variance / b.variance).ln().powi(2)
}

/// The moments of the samples by component, of which one that has next to nothing has half of another: of that whose samples are the
/// furthest from its middle. `None` where all have some, or samples are alike.
pub(super) fn divided(found: &Sums, components: &Components, samples: &[Sample]) -> Option<Sums> {
    let free = found.0.iter().position(|m| m[0] < FREE * found.mass())?;
    let labels: Vec<usize> = samples.iter().map(|s| components.nearest(s)).collect();
    let mut middles = [Sample { at: DVec2::ZERO, variance: 1.0, mass: 0.0 }; GAUSSIANS];
    for (i, middle) in middles.iter_mut().enumerate() {
        if let Some(of) = self::middle(samples.iter().zip(&labels).filter(|(_, label)| **label == i).map(|(s, _)| s)) {
            *middle = of;
        }
    }
    let mut off = [0.0; GAUSSIANS];
    samples.iter().zip(&labels).for_each(|(s, label)| off[*label] += s.mass * apart(s, &middles[*label]));
    let wide = (0..GAUSSIANS).fold(0, |best, i| if off[i] > off[best] { i } else { best });
    let own = || samples.iter().zip(&labels).filter(|(_, label)| **label == wide).map(|(s, _)| s);
    let far = own().map(|s| (s.mass * apart(s, &middles[wide]), s));
    let (far, other) = far.reduce(|best, next| if next.0 > best.0 { next } else { best })?;
    if free == wide || far <= 1e-6 * other.mass {
        return None;
    }
    let mut centres = [middles[wide], *other];
    for _ in 0..HALVINGS {
        let [one, two] = centres;
        let of = |side: bool| own().filter(move |s| (apart(s, &two) < apart(s, &one)) == side);
        centres = [middle(of(false))?, middle(of(true))?];
    }
    let mut sums = Sums::ZERO;
    for (s, label) in samples.iter().zip(&labels) {
        let goes = *label == wide && apart(s, &centres[1]) < apart(s, &centres[0]);
        sums.take(if goes { free } else { *label }, s, 1.0);
    }
    Some(sums)
}

/// The mean of some samples, if there are any.
fn middle<'a>(samples: impl Iterator<Item = &'a Sample>) -> Option<Sample> {
    let (mut at, mut log, mut mass) = (DVec2::ZERO, 0.0, 0.0);
    for s in samples {
        at += s.mass * s.at;
        log += s.mass * s.variance.ln();
        mass += s.mass;
    }
    (mass > 0.0).then(|| Sample { at: at / mass, variance: (log / mass).exp(), mass })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distribution::expectation::{Prior, Rounds, fit};

    #[test]
    fn a_component_without_mass_has_half_of_another() {
        let at = |x: f64, variance| Sample { at: DVec2::new(x, 0.0), variance, mass: 1.0 };
        let samples: Vec<_> = (0..40).map(|i| at(0.01 * f64::from(i % 5), if i % 2 == 0 { 0.04 } else { 1e-3 })).collect();
        let mut start = Sums::ZERO;
        samples.iter().for_each(|s| start.take(2, s, 1.0));
        let components = Components::of(&start, &Prior::default());
        let start = divided(&start, &components, &samples).unwrap();
        let rounds = Rounds { most: 24, until_settled: true };
        let (found, _, likelihood) = fit(&start, &samples, &Prior::default(), rounds);
        let (sums, _) = found.moments(samples.iter());
        let shares: Vec<_> = sums.0.iter().map(|m| m[0] / 40.0).collect();
        assert!((shares[0] - 0.5).abs() < 0.05 && (shares[2] - 0.5).abs() < 0.05, "{shares:?}");
        let (_, whole) = components.moments(samples.iter());
        assert!(likelihood > whole + 0.5, "{likelihood} for {whole}");
        // What is alike is not divided, nor is anything where none is free.
        let alike = [samples[0]; 9];
        let mut one = Sums::ZERO;
        alike.iter().for_each(|s| one.take(0, s, 1.0));
        assert!(divided(&one, &Components::of(&one, &Prior::default()), &alike).is_none());
        let four = clustered(&samples, 0);
        assert!(divided(&four, &Components::of(&four, &Prior::default()), &samples).is_none());
    }
}
