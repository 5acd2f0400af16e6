//! In which order the mixtures of a map's texels are fitted, and what each learns of its neighbours (Tan et al. 2005, section 4.1): labels
//! come from the texel above, from the coarsest level on, so that components of one number are alike wherever texels are averaged.
//! [`Order::Levels`] is the f64 twin of the pass `mixtures`.

use crate::distribution::BrdfMap;
use crate::distribution::below::Below;
use crate::distribution::clustering::{clustered, divided};
use crate::distribution::clusters::Placed;
use crate::distribution::expectation::{Components, GAUSSIANS, Prior, Rounds, Sample, Sums, fit};
use crate::distribution::filtered::Area;
use crate::distribution::stereographic;
use crate::texture::{bilinear, halved};
use glam::DVec2;
use std::ops::Range;

/// Rounds of a texel that starts from others': as many in each, so that all are fitted alike wherever they are.
const FROM_ABOVE: Rounds = Rounds { most: 8, until_settled: false };
/// Of one that starts from nothing.
const FROM_NOTHING: Rounds = Rounds { most: 24, until_settled: true };

/// A component that has nothing of a texel has some of another's, if there are as many lobes below, and if that raises the mean
/// logarithm of their likelihood by this.
const WORTH_DIVIDING: (usize, f64) = (16, 0.3);

/// Starts of the coarsest texel.
const STARTS: u32 = 4;

/// In which order texels are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Order {
    /// All of a level at once, each from the moments interpolated between those of the level above, which are its neighbours.
    Levels,
    /// One after another, in rows, as printed: each from the texel above, its neighbours that and those of its level that are fitted.
    Scanline,
    /// Each on its own.
    Alone,
}

/// How mixtures are fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// One of them.
    pub order: Order,
    /// How strongly neighbours draw on means: the paper's c, for samples of mass 1 in all.
    pub strength: f64,
}

impl Fit {
    /// As the paper aligns, all texels of a level at once.
    pub const ALIGNED: Self = Self { order: Order::Levels, strength: 1.0 };
    /// Not aligned.
    pub const ALONE: Self = Self { order: Order::Alone, strength: 0.0 };
}

/// The lobes of a map in the plane.
pub(super) struct Samples {
    size: [u32; 2],
    each: usize,
    /// Texel by texel.
    all: Vec<Sample>,
    /// The normal of each texel, if lobes are about other directions.
    normals: Vec<DVec2>,
    below: Below,
}

/// What is fitted of a texel: moments, and mass times the place of the normal, by component.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fitted {
    pub sums: Sums,
    pub normals: [DVec2; GAUSSIANS],
}

/// Of a map: the component of each of its lobes, and the levels from 1 on.
pub(super) struct Aligned {
    pub labels: Vec<u8>,
    pub levels: Vec<Vec<Fitted>>,
}

impl Samples {
    /// Of a map, from `centre`, in the masses weight over `area`.
    pub fn of(map: &BrdfMap, centre: DVec2, area: Area) -> Self {
        let sample = |l: &crate::reflectance::Lobe| Sample::of(&Placed::of(l), centre, l.weight / area(l.kappa));
        let all = map.lobes().iter().map(sample).collect();
        let count = map.lobes().len() / map.lobes_per_texel().max(1);
        let normals = (0..count).map_while(|i| map.normal(i)).map(stereographic::of).collect();
        Self { size: map.size(), each: map.lobes_per_texel(), all, normals, below: Below::new(map.size()) }
    }

    fn texel(&self, i: usize) -> &[Sample] {
        self.all.get(i * self.each..(i + 1) * self.each).unwrap_or_default()
    }

    /// The lobes below a texel, or of many some.
    fn looked_at(&self, size: [u32; 2], i: usize) -> Vec<Sample> {
        let mut found = Vec::new();
        self.below.looked_at(size, i, |texel, share| {
            found.extend(self.texel(texel).iter().map(|s| Sample { mass: s.mass * share, ..*s }));
        });
        found
    }

    /// The moments of all lobes below a texel, by its components.
    fn moments(&self, size: [u32; 2], i: usize, components: &Components) -> Fitted {
        let mut fitted = Fitted { sums: Sums::ZERO, normals: [DVec2::ZERO; GAUSSIANS] };
        self.below.all(size, i, |texel, share| {
            for s in self.texel(texel) {
                let (shares, _) = components.shares(s);
                for (k, of) in shares.into_iter().enumerate().filter(|(_, of)| *of > 1e-12) {
                    fitted.sums.take(k, s, share * of);
                    if let Some(normal) = self.normals.get(texel) {
                        fitted.normals[k] += *normal * (share * of * s.mass);
                    }
                }
            }
        });
        fitted
    }

    /// Fits all texels, on so many threads: the same on any number.
    pub fn align(&self, how: Fit, threads: usize) -> Aligned {
        let mut sizes = vec![self.size];
        while let Some(size) = sizes.last().filter(|size| **size != [1, 1]) {
            sizes.push(halved(*size));
        }
        // Coarsest first. Above all of them is what is found from nothing.
        let seed = Fitted { sums: coarsest(&self.looked_at([1, 1], 0)), normals: [DVec2::ZERO; GAUSSIANS] };
        let mut above = Above { size: [1, 1], fitted: vec![seed] };
        let mut levels: Vec<Vec<Fitted>> = Vec::new();
        for (level, size) in sizes.iter().enumerate().skip(1).rev() {
            let fitted = self.level(how, *size, level as u32, &above, threads);
            levels.push(std::mem::replace(&mut above, Above { size: *size, fitted }).fitted);
        }
        let count = self.size[0] as usize * self.size[1] as usize;
        let own = |i: usize| {
            let start = match how.order {
                Order::Levels | Order::Scanline => above.between(self.size, i),
                Order::Alone => clustered(self.texel(i), i as u32),
            };
            let components = Components::of(&start, &Prior::default());
            self.texel(i).iter().map(|s| components.nearest(s) as u8).collect::<Vec<_>>()
        };
        let labels = in_parallel(count, threads, &|texels| texels.flat_map(own).collect());
        levels.push(above.fitted);
        levels.reverse();
        levels.pop();
        Aligned { labels, levels }
    }

    fn level(&self, how: Fit, size: [u32; 2], level: u32, above: &Above, threads: usize) -> Vec<Fitted> {
        let count = size[0] as usize * size[1] as usize;
        let fitted = |i: usize, start: &Sums, prior: &Prior, rounds: Rounds| {
            let lobes = self.looked_at(size, i);
            let (mut components, mut found, mut likelihood) = fit(start, &lobes, prior, rounds);
            // Each time another component has a part of the others'.
            for _ in 1..GAUSSIANS {
                let start = (lobes.len() >= WORTH_DIVIDING.0).then(|| divided(&found, &components, &lobes)).flatten();
                let Some(other) = start.map(|start| fit(&start, &lobes, prior, rounds)) else { break };
                if other.2 < likelihood + WORTH_DIVIDING.1 {
                    break;
                }
                (components, found, likelihood) = other;
            }
            self.moments(size, i, &components)
        };
        let prior = |start: &Sums| {
            let mut prior = Prior { strength: how.strength, ..Prior::default() };
            prior.add(start, 1.0);
            prior
        };
        match how.order {
            Order::Levels => {
                let of = |i: usize| {
                    let start = above.between(size, i);
                    fitted(i, &start, &prior(&start), FROM_ABOVE)
                };
                in_parallel(count, threads, &|texels| texels.map(of).collect())
            }
            Order::Scanline => {
                let mut done: Vec<Fitted> = Vec::with_capacity(count);
                for i in 0..count {
                    let start = above.parent(size, i).sums;
                    let mut prior = prior(&start);
                    before(size, i).filter_map(|k| done.get(k)).for_each(|known| prior.add(&known.sums, 1.0));
                    done.push(fitted(i, &start, &prior, FROM_ABOVE));
                }
                done
            }
            Order::Alone => {
                let of = |i: usize| {
                    let start = clustered(&self.looked_at(size, i), i as u32 ^ level << 27);
                    fitted(i, &start, &Prior::default(), FROM_NOTHING)
                };
                in_parallel(count, threads, &|texels| texels.map(of).collect())
            }
        }
    }
}

/// The moments from which the coarsest level starts: of several fits to the lobes that it looks at the most likely.
fn coarsest(lobes: &[Sample]) -> Sums {
    let of = |start: u32| fit(&clustered(lobes, start), lobes, &Prior::default(), FROM_NOTHING);
    let mut best = of(0);
    for other in (1..STARTS).map(of) {
        if other.2 > best.2 {
            best = other;
        }
    }
    best.0.moments(lobes.iter()).0
}

/// The same of a map alone.
pub(super) fn seed(map: &BrdfMap, centre: DVec2, area: Area) -> Sums {
    let mut lobes = Vec::new();
    Below::new(map.size()).looked_at([1, 1], 0, |texel, share| {
        lobes.extend(map.texel(texel).iter().map(|l| Sample::of(&Placed::of(l), centre, share * l.weight / area(l.kappa))));
    });
    coarsest(&lobes)
}

/// The level above one.
struct Above {
    size: [u32; 2],
    fitted: Vec<Fitted>,
}

impl Above {
    /// Its moments at the centre of texel `i` of a level below.
    fn between(&self, size: [u32; 2], i: usize) -> Sums {
        let [x, y] = [i % size[0] as usize, i / size[0] as usize].map(|c| c as f64 + 0.5);
        let uv = DVec2::new(x / f64::from(size[0]), 1.0 - y / f64::from(size[1]));
        bilinear(self.size, uv, |i| self.fitted.get(i).map_or(Sums::ZERO, |f| f.sums))
    }

    /// The texel above texel `i`.
    fn parent(&self, size: [u32; 2], i: usize) -> Fitted {
        let at = |c: usize, axis: usize| {
            ((2 * c + 1) * self.size[axis] as usize / (2 * size[axis] as usize)).min(self.size[axis] as usize - 1)
        };
        let [x, y] = [at(i % size[0] as usize, 0), at(i / size[0] as usize, 1)];
        let none = Fitted { sums: Sums::ZERO, normals: [DVec2::ZERO; GAUSSIANS] };
        self.fitted.get(y * self.size[0] as usize + x).copied().unwrap_or(none)
    }
}

/// The neighbours of texel `i` that come before it: to its left and in the row before.
fn before(size: [u32; 2], i: usize) -> impl Iterator<Item = usize> {
    let [w, x, y] = [size[0] as usize, i % size[0] as usize, i / size[0] as usize];
    let row = if y > 0 { x.saturating_sub(1)..(x + 2).min(w) } else { 0..0 };
    row.map(move |x| (y - 1) * w + x).chain((x > 0).then(|| i - 1))
}

/// What `of` makes of `count` texels in a row, in parts on so many threads.
fn in_parallel<T: Send>(count: usize, threads: usize, of: &(dyn Fn(Range<usize>) -> Vec<T> + Sync)) -> Vec<T> {
    let part = count.div_ceil(threads.max(1)).max(1);
    if part >= count {
        return of(0..count);
    }
    std::thread::scope(|scope| {
        let parts = (0..count).step_by(part).map(|first| first..(first + part).min(count));
        let running: Vec<_> = parts.map(|texels| (texels.clone(), scope.spawn(move || of(texels)))).collect();
        running.into_iter().flat_map(|(texels, thread)| thread.join().unwrap_or_else(|_| of(texels))).collect()
    })
}
