//! In which order the mixtures of a map's texels are fitted, and what each learns of its neighbours (Tan et al. 2005, section 4.1): labels
//! come from the texel above, from the coarsest level on, so that components of one number are alike wherever texels are averaged.

use crate::distribution::BrdfMap;
use crate::distribution::clustering::{clustered, divided};
use crate::distribution::clusters::Placed;
use crate::distribution::expectation::{Components, GAUSSIANS, Prior, Sample, Sums, fit};
use crate::distribution::filtered::Area;
use crate::distribution::stereographic;
use crate::distribution::stored::covered;
use crate::sampling::sobol;
use crate::texture::{bilinear, halved};
use glam::DVec2;
use std::ops::Range;

/// Rounds of a texel that starts from others', and of one that starts from nothing.
const ROUNDS: [usize; 2] = [8, 24];

/// Texels of the map that are looked at below one: all of them count once it is fitted.
const LOOKED_AT: usize = 1024;

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
    /// Places in a texel that are looked at where it has more.
    places: Vec<[f64; 2]>,
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
        let places = (0..LOOKED_AT as u32).map(|i| sobol::point(i, 11).map(sobol::to_unit)).collect();
        Self { size: map.size(), each: map.lobes_per_texel(), all, normals, places }
    }

    fn texel(&self, i: usize) -> &[Sample] {
        self.all.get(i * self.each..(i + 1) * self.each).unwrap_or_default()
    }

    /// Calls `see` for each texel below texel `i` of a level, with its share in it.
    fn below(&self, size: [u32; 2], i: usize, mut see: impl FnMut(usize, f64)) {
        let [x, y] = [i % size[0] as usize, i / size[0] as usize];
        for (row, of_row) in covered(y, size[1], self.size[1]) {
            for (column, of_column) in covered(x, size[0], self.size[0]) {
                see(row * self.size[0] as usize + column, of_row * of_column);
            }
        }
    }

    /// The lobes below a texel, or of many some.
    fn looked_at(&self, size: [u32; 2], i: usize) -> Vec<Sample> {
        let mut found = Vec::new();
        let [w, h] = self.size.map(|side| side as usize);
        if w * h <= LOOKED_AT * size[0] as usize * size[1] as usize {
            self.below(size, i, |texel, share| {
                found.extend(self.texel(texel).iter().map(|s| Sample { mass: s.mass * share, ..*s }));
            });
            return found;
        }
        let corner = [i % size[0] as usize, i / size[0] as usize].map(|c| c as f64);
        for [x, y] in &self.places {
            let column = ((corner[0] + x) * w as f64 / f64::from(size[0])) as usize;
            let row = ((corner[1] + y) * h as f64 / f64::from(size[1])) as usize;
            let share = 1.0 / LOOKED_AT as f64;
            found
                .extend(self.texel(row.min(h - 1) * w + column.min(w - 1)).iter().map(|s| Sample { mass: s.mass * share, ..*s }));
        }
        found
    }

    /// The moments of all lobes below a texel, by its components.
    fn moments(&self, size: [u32; 2], i: usize, components: &Components) -> Fitted {
        let mut fitted = Fitted { sums: Sums::ZERO, normals: [DVec2::ZERO; GAUSSIANS] };
        self.below(size, i, |texel, share| {
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
        // Coarsest first.
        let mut levels: Vec<Vec<Fitted>> = Vec::new();
        for (level, size) in sizes.iter().enumerate().skip(1).rev() {
            let above = levels.last().zip(sizes.get(level + 1)).map(|(fitted, size)| Above { size: *size, fitted });
            levels.push(self.level(how, *size, level as u32, above.as_ref(), threads));
        }
        let above = levels.last().zip(sizes.get(1)).map(|(fitted, size)| Above { size: *size, fitted });
        let count = self.size[0] as usize * self.size[1] as usize;
        let own = |i: usize| {
            let start = match (&above, how.order) {
                (Some(above), Order::Levels | Order::Scanline) => above.between(self.size, i),
                _ => clustered(self.texel(i), i as u32),
            };
            let components = Components::of(&start, &Prior::default());
            self.texel(i).iter().map(|s| components.nearest(s) as u8).collect::<Vec<_>>()
        };
        let labels = in_parallel(count, threads, &|texels| texels.flat_map(own).collect());
        levels.reverse();
        Aligned { labels, levels }
    }

    fn level(&self, how: Fit, size: [u32; 2], level: u32, above: Option<&Above<'_>>, threads: usize) -> Vec<Fitted> {
        let count = size[0] as usize * size[1] as usize;
        let fitted = |i: usize, start: &Sums, prior: &Prior, rounds: usize| {
            let lobes = self.looked_at(size, i);
            let (mut components, mut likelihood) = fit(start, &lobes, prior, rounds);
            while lobes.len() >= WORTH_DIVIDING.0 {
                let found = components.moments(lobes.iter()).0;
                let Some(start) = divided(&found, &components, &lobes) else { break };
                let (other, of_other) = fit(&start, &lobes, prior, rounds);
                if of_other < likelihood + WORTH_DIVIDING.1 {
                    break;
                }
                (components, likelihood) = (other, of_other);
            }
            self.moments(size, i, &components)
        };
        let alone = |i: usize| {
            let lobes = self.looked_at(size, i);
            fitted(i, &clustered(&lobes, i as u32 ^ level << 27), &Prior::default(), ROUNDS[1])
        };
        match (above, how.order) {
            (None, Order::Levels | Order::Scanline) => (0..count).map(|i| self.coarsest(size, i)).collect(),
            (Some(above), Order::Levels) => {
                let of = |i: usize| {
                    let start = above.between(size, i);
                    let mut prior = Prior { strength: how.strength, ..Prior::default() };
                    prior.add(&start, 1.0);
                    fitted(i, &start, &prior, ROUNDS[0])
                };
                in_parallel(count, threads, &|texels| texels.map(of).collect())
            }
            (Some(above), Order::Scanline) => {
                let mut done: Vec<Fitted> = Vec::with_capacity(count);
                for i in 0..count {
                    let start = above.parent(size, i).sums;
                    let mut prior = Prior { strength: how.strength, ..Prior::default() };
                    prior.add(&start, 1.0);
                    before(size, i).filter_map(|k| done.get(k)).for_each(|known| prior.add(&known.sums, 1.0));
                    done.push(fitted(i, &start, &prior, ROUNDS[0]));
                }
                done
            }
            (_, Order::Alone) => in_parallel(count, threads, &|texels| texels.map(alone).collect()),
        }
    }

    /// A texel without one above it: of several starts the most likely.
    fn coarsest(&self, size: [u32; 2], i: usize) -> Fitted {
        let lobes = self.looked_at(size, i);
        let of = |start: u32| fit(&clustered(&lobes, start), &lobes, &Prior::default(), ROUNDS[1]);
        let (mut best, mut likelihood) = of(0);
        for other in (1..STARTS).map(of) {
            if other.1 > likelihood {
                (best, likelihood) = other;
            }
        }
        self.moments(size, i, &best)
    }
}

/// The level above one.
struct Above<'a> {
    size: [u32; 2],
    fitted: &'a [Fitted],
}

impl Above<'_> {
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
