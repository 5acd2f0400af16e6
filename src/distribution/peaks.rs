//! A few lobes for each texel of each level, fitted to those below it, of which a look-up finds all (Fournier 1992, "Normal
//! distribution functions and multiple surfaces"). His peaks are Phong's; these are von Mises-Fisher lobes of the same kind.

use crate::distribution::brdf_map::BrdfMap;
use crate::distribution::vmf::{self, Lobe};
use crate::texture::{for_each_cover, halved};
use glam::DVec3;

/// Lobes no further apart than this, by weight, are one: what rounding leaves.
const SAME: f64 = 1e-12;

/// Rounds of a fit.
const ROUNDS: usize = 6;

const NONE: Peak = Peak { lobe: Lobe { mu: DVec3::Z, kappa: 1.0, weight: 0.0 }, normal: DVec3::Z };

/// A lobe whose weight is its mass, and the mean of the normals below it, of any length above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Of weight 0 if there is none.
    pub lobe: Lobe,
    /// Its own direction, if lobes are about their normals.
    pub normal: DVec3,
}

/// The peaks of the texels of a map's mips.
#[derive(Clone, Debug)]
pub struct Peaks {
    count: usize,
    /// From level 1 on, texel by texel, of weight 0 where fewer are enough. Weights are masses.
    levels: Vec<Vec<Peak>>,
}

impl Peaks {
    /// `count` peaks a texel, from the lobes of a map with the masses weight over `area` of concentration.
    pub fn of(map: &BrdfMap, count: usize, area: fn(f64) -> f64) -> Self {
        let peak = |i: usize, l: &Lobe| Peak {
            lobe: Lobe { weight: l.weight / area(l.kappa), ..*l },
            normal: map.normal(i).unwrap_or(l.mu),
        };
        let own = |i: usize| map.texel(i).iter().map(|l| peak(i, l)).collect::<Vec<_>>();
        let (mut levels, mut size): (Vec<Vec<Peak>>, _) = (Vec::new(), map.size());
        while size != [1, 1] {
            let next = halved(size);
            let mut texels = Vec::with_capacity(next[0] as usize * next[1] as usize * count);
            let mut below = Vec::new();
            for_each_cover(size, next, |_, covered| {
                below.clear();
                for (from, share) in covered {
                    let scaled = |p: &Peak| Peak { lobe: Lobe { weight: p.lobe.weight * share, ..p.lobe }, ..*p };
                    match levels.last() {
                        None => below.extend(own(*from).iter().map(scaled)),
                        Some(level) => below.extend(level[from * count..(from + 1) * count].iter().map(scaled)),
                    }
                }
                below.retain(|p: &Peak| p.lobe.weight > 0.0);
                fit(&mut below, count);
                texels.extend(below.iter().copied().chain(std::iter::repeat(NONE)).take(count));
            });
            levels.push(texels);
            size = next;
        }
        Self { count, levels }
    }

    /// Of texel `i` of a level above 0; none where there is none.
    pub fn texel(&self, level: usize, i: usize) -> &[Peak] {
        let level = level.checked_sub(1).and_then(|l| self.levels.get(l));
        level.and_then(|l| l.get(i * self.count..(i + 1) * self.count)).unwrap_or_default()
    }

    /// All of a level above 0, texel by texel.
    pub fn level(&self, level: usize) -> &[Peak] {
        level.checked_sub(1).and_then(|l| self.levels.get(l)).map_or(&[], Vec::as_slice)
    }
}

/// How far a lobe is from a peak: the difference of directions over their widths, and that of the widths.
fn distance(a: &Lobe, b: &Lobe) -> f64 {
    let (k, l) = (a.kappa.max(1e-2), b.kappa.max(1e-2));
    0.5 * (a.mu - b.mu).length_squared() * (k * l).sqrt() + 0.5 * (k / l).ln().powi(2)
}

/// Replaces lobes by at most `count`, each with the mean vector of those nearest to it.
fn fit(all: &mut Vec<Peak>, count: usize) {
    if all.len() <= count {
        return;
    }
    let lobes: Vec<Lobe> = all.iter().map(|p| p.lobe).collect();
    // The heaviest, then always that which is the farthest from all, by its weight.
    let farthest = |peaks: &[Lobe]| {
        let far = |l: &Lobe| l.weight * peaks.iter().map(|p| distance(l, p)).fold(1e9, f64::min);
        lobes.iter().map(|l| (far(l), *l)).fold((SAME, None), |best, (d, l)| if d > best.0 { (d, Some(l)) } else { best }).1
    };
    let mut peaks: Vec<Lobe> = Vec::with_capacity(count);
    while let Some(next) = farthest(&peaks).filter(|_| peaks.len() < count) {
        peaks.push(next);
    }
    let mut assigned = vec![usize::MAX; lobes.len()];
    for _ in 0..ROUNDS {
        let mut changed = false;
        for (lobe, assigned) in lobes.iter().zip(&mut assigned) {
            let all = peaks.iter().map(|p| distance(lobe, p)).enumerate();
            let nearest = all.fold((0, f64::INFINITY), |best, (i, d)| if d < best.1 { (i, d) } else { best }).0;
            changed |= std::mem::replace(assigned, nearest) != nearest;
        }
        if !changed {
            break;
        }
        for (i, peak) in peaks.iter_mut().enumerate() {
            let (mut mu, mut log, mut weight) = (DVec3::ZERO, 0.0, 0.0);
            for l in lobes.iter().zip(&assigned).filter(|(_, a)| **a == i).map(|(l, _)| l) {
                mu += l.weight * l.mu;
                log += l.weight * l.kappa.max(1e-2).ln();
                weight += l.weight;
            }
            if weight > 0.0 {
                *peak = Lobe { mu: mu.try_normalize().unwrap_or(peak.mu), kappa: (log / weight).exp(), weight };
            }
        }
    }
    let merged = |(i, peak): (usize, &Lobe)| {
        let (mut sum, mut normal, mut lost, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0, 0.0);
        let mut own = all.iter().zip(&assigned).filter(|(_, a)| **a == i).map(|(p, _)| p).inspect(|p| {
            sum += p.lobe.weight * p.lobe.mu;
            normal += p.lobe.weight * p.normal.normalize_or(DVec3::Z);
            lost += p.lobe.weight * vmf::spread(p.lobe.kappa);
            weight += p.lobe.weight;
        });
        let first = own.next();
        if own.count() == 0 {
            return first.copied();
        }
        // 1 - |r| of the mean vector, from the spread of directions and the lobes' own, of which neither cancels.
        let apart = 1.0 - sum.length() / weight;
        let kappa = vmf::concentration(apart + (1.0 - apart) * lost / weight);
        Some(Peak { lobe: Lobe { mu: sum.try_normalize().unwrap_or(peak.mu), kappa, weight }, normal })
    };
    let found: Vec<Peak> = peaks.iter().enumerate().filter_map(merged).collect();
    *all = found;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_are_the_lobes_where_these_are_few() {
        let lobe = |x: f64, kappa| Lobe { mu: DVec3::new(x, 0.0, 1.0).normalize(), kappa, weight: 1.0 };
        let kinds = [lobe(0.3, 50.0), lobe(-0.3, 50.0), lobe(-0.3, 900.0)];
        let map = BrdfMap::new([16, 16], 1, (0..256).map(|i| kinds[(i + i / 16) % 3]).collect()).unwrap();
        let peaks = Peaks::of(&map, 4, |_| 0.5);
        for level in 1..=4 {
            for i in 0..(16 >> level) * (16 >> level) {
                let texel: Vec<_> = peaks.texel(level, i).iter().map(|p| p.lobe).filter(|l| l.weight > 0.0).collect();
                // Level 1 has as many as there are below.
                assert!(texel.len() == if level == 1 { 4 } else { 3 }, "{level} {i}: {texel:?}");
                assert!((texel.iter().map(|l| l.weight).sum::<f64>() - 2.0).abs() < 1e-9);
                for l in texel {
                    let near = kinds.iter().any(|k| (k.mu - l.mu).length() < 1e-6 && (k.kappa / l.kappa - 1.0).abs() < 1e-3);
                    assert!(near, "{level} {i}: {l:?}");
                }
            }
        }
        assert!(peaks.texel(0, 0).is_empty() && peaks.texel(5, 0).is_empty() && peaks.level(1).len() == 64 * 4);
    }
}
