//! Where a map's clusters are: by its lobes at some thousand texels, and as many clusters as bring the error down that is measured
//! over blocks of texels against all their lobes. Nothing is random: the same map has the same clusters.

use crate::distribution::clusters::{Cluster, Clusters, Layout, MOMENTS, MOST_CLUSTERS, Placed};
use crate::distribution::vmf::Lobe;
use crate::sampling::sobol;
use glam::{DVec2, DVec3};

/// Texels whose lobes are looked at.
const TEXELS: u32 = 4096;
/// Concentrations of two classes of roughness differ by more than this factor in the mean.
const CLASSES_DIFFER_BY: f64 = 2.0;
/// Starts of each search.
const STARTS: u32 = 3;
/// Rounds of each search: by distance, and then by Gaussians.
const ROUNDS: usize = 12;
/// Blocks of each size over which errors are measured.
const BLOCKS: u32 = 40;
/// Texels a side of these.
const SIDES: [u32; 3] = [4, 16, 64];
/// Texels of a block that are looked at.
const BELOW: u32 = 64;
/// Half vectors of a block.
const HALF_VECTORS: u32 = 20;
/// Fewer clusters are taken if their error is greater by less than this factor, or below that in any case.
const AS_GOOD: [f64; 2] = [1.05, 0.01];

/// The lobes of a texel of a map, row by row.
pub(crate) type Texels<'a> = dyn Fn(usize) -> Vec<Lobe> + 'a;

/// The factor on their specular colour.
pub(crate) type Colours<'a> = dyn Fn(usize) -> DVec3 + 'a;

#[derive(Clone, Copy)]
struct Sample {
    placed: Placed,
    weight: f64,
}

/// Lobes of one roughness: where their variances begin or end, as [`Cluster::bound`].
struct Class {
    samples: Vec<Sample>,
    bound: f64,
}

/// Texels below a coarser one.
struct Block {
    size: usize,
    /// With the factors on their colours.
    lobes: Vec<(Lobe, DVec3)>,
    /// Half vectors, and the exact density there times these.
    half: Vec<(DVec3, DVec3)>,
}

impl Clusters {
    /// Those of a map of `size`. With `normals` texels keep these, too; and `colours`, if there are some, where these and fewer clusters
    /// are nearer than the mean colour and more of them.
    pub(crate) fn of([width, height]: [u32; 2], normals: bool, texels: &Texels<'_>, colours: Option<&Colours<'_>>) -> Self {
        let all = width.saturating_mul(height);
        let at = |i: u32| match all <= TEXELS {
            true => i as usize,
            false => {
                let [x, y] = sobol::point(i, 1).map(sobol::to_unit);
                ((y * f64::from(height)) as u32 * width + (x * f64::from(width)) as u32) as usize
            }
        };
        let lobes = (0..all.min(TEXELS)).flat_map(|i| texels(at(i)));
        let classes = classes(lobes.map(|l| Sample { placed: Placed::of(&l), weight: l.weight }).collect());
        let blocks = blocks([width, height], texels, colours.unwrap_or(&|_| DVec3::ONE));
        let plain = Layout { normals, colours: false };
        let most = plain.most();
        let best = match classes.as_slice() {
            [one] => (1..=most).map(|k| fit(one, k, &blocks)).collect(),
            [rough, sharp] => {
                let [rough, sharp] = [rough, sharp].map(|class| (1..most).map(|k| fit(class, k, &blocks)).collect::<Vec<_>>());
                let pairs = (1..most).flat_map(|a| (1..most).map(move |b| (a - 1, b - 1))).filter(|(a, b)| a + b + 2 <= most);
                pairs.map(|(a, b)| [rough[a].as_slice(), sharp[b].as_slice()].concat()).collect()
            }
            _ => Vec::new(),
        };
        let coloured = Layout { normals, colours: true };
        let few = best.iter().filter(|c| colours.is_some() && c.len() <= coloured.most()).cloned().map(|c| (c, coloured));
        let few: Vec<_> = few.collect();
        chosen(best.into_iter().map(|c| (c, plain)).chain(few), &blocks).unwrap_or_else(|| Self::new(Vec::new(), plain))
    }
}

/// The one of `candidates` with the least bytes that is about as good as the best.
fn chosen(candidates: impl Iterator<Item = (Vec<Cluster>, Layout)>, blocks: &[Block]) -> Option<Clusters> {
    let all = candidates.map(|(clusters, layout)| Clusters::new(clusters, layout));
    let mut all: Vec<_> = all.map(|c| (c.bytes(), error(&c, blocks), c)).collect();
    let least = all.iter().map(|c| c.1).fold(f64::INFINITY, f64::min);
    let enough = (least * AS_GOOD[0]).max(AS_GOOD[1]);
    all.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    all.into_iter().find(|c| c.1 <= enough).map(|c| c.2)
}

/// One class, or a rough one and a sharp one.
fn classes(samples: Vec<Sample>) -> Vec<Class> {
    let log = |s: &Sample| s.placed.own.ln();
    let range = samples.iter().map(log).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    let mut means = range;
    for _ in 0..ROUNDS {
        let between = 0.5 * (means[0] + means[1]);
        let mut sums = [[0.0f64; 2]; 2];
        for s in &samples {
            let sum = &mut sums[usize::from(log(s) >= between)];
            *sum = [sum[0] + s.weight * log(s), sum[1] + s.weight];
        }
        means = [0, 1].map(|i: usize| if sums[i][1] > 0.0 { sums[i][0] / sums[i][1] } else { means[i] });
    }
    if means[1] - means[0] <= CLASSES_DIFFER_BY.ln() {
        return vec![Class { samples, bound: 0.0 }];
    }
    let bound = f64::from((0.5 * (means[0] + means[1])).exp() as f32);
    let (rough, sharp) = samples.into_iter().partition(|s| s.placed.own >= bound);
    vec![Class { samples: rough, bound }, Class { samples: sharp, bound: -bound }]
}

/// The `k` clusters of a class, of several starts those with the least error over its lobes.
fn fit(class: &Class, k: usize, blocks: &[Block]) -> Vec<Cluster> {
    let own: Vec<_> = blocks.iter().filter_map(|block| block.of_class(class.bound)).collect();
    let mut best = (f64::INFINITY, Vec::new());
    for start in 0..if k == 1 { 1 } else { STARTS } {
        let by_distance = rounds(&class.samples, seeds(&class.samples, k, start), false);
        let by_density = rounds(&class.samples, by_distance.clone(), true);
        for found in [by_distance, by_density] {
            let found: Vec<_> = found.into_iter().map(|c| Cluster { bound: class.bound, ..c }.rounded()).collect();
            let off = error(&Clusters::new(found.clone(), Layout::default()), &own);
            if off < best.0 || best.1.is_empty() {
                best = (off, found);
            }
        }
    }
    best.1
}

fn round(centre: DVec2) -> Cluster {
    Cluster { centre, inverse: [1.0, 0.0, 1.0], constant: 0.0, floor: 0.0, own: 0.0, bound: 0.0 }
}

/// Samples far from each other (Arthur and Vassilvitskii 2007, "k-means++").
fn seeds(samples: &[Sample], k: usize, start: u32) -> Vec<Cluster> {
    let mut found: Vec<Cluster> = Vec::new();
    let mut far: Vec<f64> = samples.iter().map(|s| s.weight).collect();
    for i in 0..k {
        let total: f64 = far.iter().sum();
        let mut left = sobol::to_unit(sobol::random(i as u32, 7 + start)[0]) * total;
        let drawn = far.iter().position(|f| {
            left -= f;
            left < 0.0
        });
        let Some(sample) = drawn.and_then(|i| samples.get(i)) else { break };
        found.push(round(sample.placed.at));
        for (far, s) in far.iter_mut().zip(samples) {
            let near = found.iter().map(|c| c.distance(&Placed { own: 1.0, ..s.placed })).fold(f64::INFINITY, f64::min);
            *far = s.weight * near;
        }
    }
    found
}

/// Assigns samples and finds their clusters again, until nothing changes.
fn rounds(samples: &[Sample], mut clusters: Vec<Cluster>, by_density: bool) -> Vec<Cluster> {
    let mut assigned = vec![usize::MAX; samples.len()];
    for _ in 0..ROUNDS {
        let (mut sums, mut floors) = (vec![[0.0; MOMENTS]; clusters.len()], vec![f64::INFINITY; clusters.len()]);
        let mut owns = vec![0.0; clusters.len()];
        let mut changed = false;
        for (s, assigned) in samples.iter().zip(&mut assigned) {
            let placed = Placed { own: 1.0, ..s.placed };
            let nearest = clusters.iter().map(|c| c.distance(&placed)).enumerate();
            let nearest = nearest.fold((0, f64::INFINITY), |best, (i, d)| if d < best.1 { (i, d) } else { best }).0;
            changed |= std::mem::replace(assigned, nearest) != nearest;
            let moments = round(DVec2::ZERO).moments(&s.placed, s.weight);
            sums[nearest].iter_mut().zip(moments).for_each(|(sum, m)| *sum += m);
            floors[nearest] = floors[nearest].min(s.placed.variance);
            owns[nearest] += s.weight * s.placed.own;
        }
        let there = sums.iter().zip(floors).zip(owns).filter(|((sum, _), _)| sum[0] > 0.0);
        let cluster = |((sum, floor), own): ((&[f64; MOMENTS], f64), f64)| Cluster {
            own: own / sum[0],
            ..of_moments(*sum, floor, by_density)
        };
        clusters = there.map(cluster).collect();
        if !changed {
            break;
        }
    }
    clusters
}

/// Half of the least variance of lobes in it is the least of what is decoded: between the samples lobes may be sharper.
fn of_moments([q, x, y, xx, xy, yy, ..]: [f64; MOMENTS], floor: f64, by_density: bool) -> Cluster {
    let centre = DVec2::new(x, y) / q;
    let floor = 0.5 * floor;
    if !by_density {
        return Cluster { floor, ..round(centre) };
    }
    let xx = (xx / q - centre.x * centre.x).max(floor);
    let yy = (yy / q - centre.y * centre.y).max(floor);
    let most = 0.999 * (xx * yy).sqrt();
    let xy = (xy / q - centre.x * centre.y).clamp(-most, most);
    let determinant = xx * yy - xy * xy;
    let inverse = [yy / determinant, -xy / determinant, xx / determinant];
    Cluster { inverse, constant: determinant.ln() - 2.0 * q.ln(), floor, ..round(centre) }
}

/// Blocks spread over the map.
fn blocks([width, height]: [u32; 2], texels: &Texels<'_>, colours: &Colours<'_>) -> Vec<Block> {
    let block = |size: usize, number: u32| {
        let side = SIDES[size];
        let [w, h] = [width, height].map(|all| side.min(all));
        let [x, y] = sobol::point(number, 2 + size as u32).map(sobol::to_unit);
        let corner = [(x * f64::from(width - w + 1)) as u32, (y * f64::from(height - h + 1)) as u32];
        let inside = (0..BELOW.min(w * h)).flat_map(|i| {
            let [x, y] = match w * h <= BELOW {
                true => [i % w, i / w],
                false => sobol::point(i, hash([number, size as u32])).map(|u| (f64::from(side) * sobol::to_unit(u)) as u32),
            };
            let texel = ((corner[1] + y.min(h - 1)) * width + corner[0] + x.min(w - 1)) as usize;
            let colour = colours(texel);
            texels(texel).into_iter().map(move |lobe| (lobe, colour))
        });
        let lobes: Vec<_> = inside.collect();
        Block { size, half: half_vectors(&lobes, number), lobes }
    };
    (0..SIDES.len()).flat_map(|size| (0..BLOCKS).map(move |number| block(size, number))).collect()
}

fn hash([number, size]: [u32; 2]) -> u32 {
    sobol::hash(number << 2 | size)
}

/// Half vectors drawn from the lobes, one in four from anywhere.
fn half_vectors(lobes: &[(Lobe, DVec3)], number: u32) -> Vec<(DVec3, DVec3)> {
    let any = (Lobe { mu: DVec3::Z, kappa: 2.0, weight: 1.0 }, DVec3::ONE);
    let half = |j: u32| {
        let [a, b] = sobol::point(j, sobol::hash(number)).map(sobol::to_unit);
        let drawn = sobol::to_unit(sobol::random(j, number)[0]) * lobes.len() as f64;
        let h = lobes.get(drawn as usize).filter(|_| !j.is_multiple_of(4)).unwrap_or(&any).0.sample([a, b]);
        (h, exact(lobes, h))
    };
    (0..HALF_VECTORS).map(half).collect()
}

/// Densities of lobes at `h` with their colours, of a weight of 1 in all.
fn exact(lobes: &[(Lobe, DVec3)], h: DVec3) -> DVec3 {
    let weight = lobes.iter().map(|(l, _)| l.weight).sum::<f64>().max(f64::MIN_POSITIVE);
    lobes.iter().map(|(l, colour)| l.density(h) * *colour).sum::<DVec3>() / weight
}

impl Block {
    /// Its lobes of one class, without their colours.
    fn of_class(&self, bound: f64) -> Option<Self> {
        let class = Cluster { bound, inverse: [0.0; 3], ..round(DVec2::ZERO) };
        let lobes: Vec<_> =
            self.lobes.iter().map(|(l, _)| (*l, DVec3::ONE)).filter(|(l, _)| class.distance(&Placed::of(l)) < 1.0).collect();
        let half = self.half.iter().map(|(h, _)| (*h, exact(&lobes, *h))).collect();
        (!lobes.is_empty()).then_some(Self { size: self.size, half, lobes })
    }
}

/// The relative L2 error of the density times colours, in the mean over the sizes of blocks. Lobes whose colours are not kept have the
/// mean of the block's.
fn error(clusters: &Clusters, blocks: &[Block]) -> f64 {
    let mut sums = [[0.0f64; 2]; SIDES.len()];
    for block in blocks {
        let mut texel = [0.0; MOMENTS * MOST_CLUSTERS];
        let mut mean = (DVec3::ZERO, f64::MIN_POSITIVE);
        for (lobe, colour) in &block.lobes {
            mean = (mean.0 + lobe.weight * *colour, mean.1 + lobe.weight);
            let (i, moments) = clusters.encode(lobe, None, *colour, lobe.weight);
            texel[i * MOMENTS..].iter_mut().zip(moments).for_each(|(sum, m)| *sum += m);
        }
        let (lobes, _) = clusters.decode(&texel);
        for (h, exact) in &block.half {
            let found: DVec3 = lobes.iter().map(|l| l.lobe.density(*h) * l.colour.unwrap_or(mean.0 / mean.1)).sum();
            let sum = &mut sums[block.size];
            *sum = [sum[0] + (found - *exact).length_squared(), sum[1] + exact.length_squared()];
        }
    }
    sums.iter().map(|[off, all]| (off / all.max(f64::MIN_POSITIVE)).sqrt()).sum::<f64>() / SIDES.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lobe(x: f64, y: f64, kappa: f64) -> Vec<Lobe> {
        vec![Lobe { mu: DVec3::new(x, y, 1.0).normalize(), kappa, weight: 1.0 }]
    }

    #[test]
    fn there_are_as_many_as_the_map_asks_for() {
        let flat = |_| lobe(0.2, -0.1, 90.0);
        let checker = |i: usize| lobe(0.0, 0.0, if (i / 4 + i / 256).is_multiple_of(2) { 24.0 } else { 768.0 });
        let side = |i: usize| if i.is_multiple_of(2) { 0.3 } else { -0.3 };
        let facets = |i: usize| lobe(side(i), side(i / 64), 900.0);
        let of = |texels: &Texels<'_>| Clusters::of([64; 2], false, texels, None);
        assert_eq!([of(&flat), of(&checker), of(&facets)].map(|c| c.all().len()), [1, 2, 4]);
        let two = of(&checker);
        assert!(two.all()[0].bound == -two.all()[1].bound && two.all()[0].bound > 0.0, "{two:?}");
    }

    #[test]
    fn colours_are_kept_where_they_go_together_with_lobes() {
        let checker = |i: usize| (i / 4 + i / 256).is_multiple_of(2);
        let lobes = |i: usize| lobe(0.0, 0.0, if checker(i) { 24.0 } else { 768.0 });
        let gold = DVec3::new(0.9, 0.6, 0.2);
        let together = |i: usize| if checker(i) { DVec3::splat(0.3) } else { gold };
        let of = |colours: &Colours<'_>| Clusters::of([64; 2], false, &lobes, Some(colours));
        assert_eq!([of(&together), of(&|_| gold)].map(|c| (c.all().len(), c.layout().colours)), [(2, true), (2, false)]);
    }

    #[test]
    fn the_same_map_has_the_same_clusters() {
        let waves = |i: usize| lobe(0.5 * (0.3 * i as f64).sin(), 0.5 * (0.041 * i as f64).cos(), 60.0);
        let of = || Clusters::of([67, 45], true, &waves, None);
        assert_eq!(of(), of());
        assert!(of().all().len() > 2 && of().bytes() <= 96);
        // One texel is enough.
        assert_eq!(Clusters::of([1, 1], false, &waves, None).all().len(), 1);
    }
}
