//! Suns: the few small spots of an environment that outshine the rest of it, taken out of the map and kept as directional
//! lights. What is left has no spike for a look-up to smear, and a sun shows the reflectance itself and not its approximation.

use crate::sampling::latlong::direction;
use crate::sampling::{LatLong, luminance};
use glam::{DVec2, DVec3, IVec2};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// The most suns of one map.
pub const MAX_SUNS: usize = 8;
/// How many times the mean luminance the largest channel of a sun's texels is at least.
const BRIGHT: f64 = 100.0;
/// The largest angle in radians between a sun's brightest texel and its others, unless these are the next but one.
const RADIUS: f64 = 0.025;

/// The most points that stand for a sun.
pub const MAX_POINTS: usize = 64;

/// Groups of bright texels that are looked at, brightest first.
const MOST_GROUPS: usize = 64;

/// A spot of the map as a directional light.
#[derive(Clone, Debug, PartialEq)]
pub struct Sun {
    /// Towards it, in the map's own frame.
    pub direction: DVec3,
    /// Irradiance at normal incidence.
    pub irradiance: DVec3,
    /// Points that stand for it in reflectances in which its shape is seen, direction and irradiance of each: four a texel, or a
    /// square of them where that would be more than [`MAX_POINTS`], with the means and variances of what they stand for.
    pub points: Vec<[DVec3; 2]>,
    /// The largest angle in radians between `direction` and a point's.
    pub radius: f64,
    /// First and last column and row of its texels; columns wrap, and the first may be negative.
    pub texels: [i32; 4],
}

/// All suns of a map and the rule that tells their texels from others: those inside [`Sun::texels`] whose largest channel is
/// above `bright`, which shrink to have `kept` there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Suns {
    /// Brightest first, at most [`MAX_SUNS`].
    pub suns: Vec<Sun>,
    /// Largest channel that the rest of the map may have.
    pub bright: f32,
    /// Largest channel of a sun's texels in the rest of the map: the map's mean luminance.
    pub kept: f32,
}

/// Solid angle of a texel of row `y`.
fn solid_angle(map: &LatLong, y: u32) -> f64 {
    let edge = |y: u32| (PI * f64::from(y) / f64::from(map.height())).cos();
    (edge(y) - edge(y + 1)) * TAU / f64::from(map.width())
}

fn largest([r, g, b]: [f32; 3]) -> f32 {
    r.max(g).max(b)
}

fn place(map: &LatLong, i: usize) -> [i32; 2] {
    let width = map.width() as usize;
    [(i % width) as i32, (i / width) as i32]
}

/// Column and row of a texel's centre are whole numbers here.
fn towards(map: &LatLong, place: DVec2) -> DVec3 {
    direction((place + 0.5) / DVec2::new(map.width().into(), map.height().into()))
}

/// A texel of a sun: column and row, which may lie beyond a seam, and what it adds to irradiance.
type Part = ([i32; 2], DVec3);

/// Of several parts, the mean by luminance of columns and rows, their variances, and the sum.
fn together(parts: &[Part]) -> (DVec2, DVec2, DVec3) {
    let at = |[x, y]: [i32; 2]| DVec2::new(x.into(), y.into());
    let sum: DVec3 = parts.iter().map(|(_, taken)| *taken).sum();
    let mean = parts.iter().map(|(place, taken)| at(*place) * luminance(*taken)).sum::<DVec2>() / luminance(sum);
    let squares: DVec2 = parts.iter().map(|(place, taken)| (at(*place) - mean).powf(2.0) * luminance(*taken)).sum();
    (mean, squares / luminance(sum), sum)
}

/// At most [`MAX_POINTS`] points, column and row and share of irradiance: four for what lies in each square of as few texels as that
/// takes, which have its mean and variances. A texel's are those of the tent by which maps are looked up.
fn points(parts: &[Part]) -> Vec<(DVec2, DVec3)> {
    const TENT: f64 = 1.0 / 6.0;
    let by = |side: i32| {
        let mut squares: BTreeMap<[i32; 2], Vec<Part>> = BTreeMap::new();
        parts.iter().for_each(|part| squares.entry(part.0.map(|e| e.div_euclid(side))).or_default().push(*part));
        squares
    };
    let few = (1..).map(by).find(|squares| 4 * squares.len() <= MAX_POINTS).unwrap_or_default();
    let four = |square: Vec<Part>| {
        let (mean, variances, sum) = together(&square);
        let [x, y] = (variances + TENT).powf(0.5).to_array();
        [[-x, -y], [x, -y], [-x, y], [x, y]].map(|offset| (mean + DVec2::from(offset), sum / 4.0))
    };
    few.into_values().flat_map(four).collect()
}

impl Suns {
    /// The suns of `map`. A group of bright texels is one if all that are within twice its radius are within the radius: larger
    /// lights are not points, and stay in the map.
    pub fn of(map: &LatLong) -> Self {
        let texels = map.texels();
        let width = map.width() as usize;
        let rows = texels.chunks_exact(width).zip(0..);
        let sum: f64 = rows
            .map(|(row, y)| {
                let luminance = row.iter().map(|&[r, g, b]| luminance(DVec3::new(r.into(), g.into(), b.into()))).sum::<f64>();
                luminance * solid_angle(map, y)
            })
            .sum();
        let mean = sum / (4.0 * PI);
        let bright = (BRIGHT * mean) as f32;
        let mut found = Self { suns: Vec::new(), bright, kept: mean as f32 };
        let mut candidates: Vec<usize> = (0..texels.len()).filter(|&i| largest(texels[i]) > bright).collect();
        candidates.sort_by(|&a, &b| largest(texels[b]).total_cmp(&largest(texels[a])).then(a.cmp(&b)));
        let radius = RADIUS.max(2.5 * PI / f64::from(map.height()));
        let directions: Vec<DVec3> = candidates.iter().map(|&i| towards(map, IVec2::from(place(map, i)).as_dvec2())).collect();
        let (mut taken, mut groups) = (vec![false; candidates.len()], 0);
        for seed in 0..candidates.len() {
            if taken[seed] {
                continue;
            }
            if found.suns.len() == MAX_SUNS || groups == MOST_GROUPS {
                break;
            }
            groups += 1;
            let within = |r: f64| -> Vec<usize> {
                let (cosine, middle) = (r.cos(), directions[seed]);
                (0..directions.len()).filter(|&k| directions[k].dot(middle) >= cosine).collect()
            };
            let group = within(radius);
            let alone = group.iter().all(|&k| !taken[k]) && within(2.0 * radius).len() == group.len();
            group.iter().for_each(|&k| taken[k] = true);
            if alone {
                let members: Vec<_> = group.iter().map(|&k| place(map, candidates[k])).collect();
                found.add(map, &members, place(map, candidates[seed]));
            }
        }
        found
    }

    fn add(&mut self, map: &LatLong, members: &[[i32; 2]], seed: [i32; 2]) {
        let half = map.width() as i32 / 2;
        // Columns as near to the seed's as wrapping brings them.
        let column = |x: i32| seed[0] + (x - seed[0] + half).rem_euclid(map.width() as i32) - half;
        let bounds = members.iter().fold([i32::MAX, i32::MIN, i32::MAX, i32::MIN], |[x0, x1, y0, y1], &[x, y]| {
            let x = column(x);
            [x0.min(x), x1.max(x), y0.min(y), y1.max(y)]
        });
        // Its texels are known by their bounds.
        let number = self.suns.len();
        self.suns.push(Sun { direction: DVec3::ZERO, irradiance: DVec3::ZERO, points: Vec::new(), radius: 0.0, texels: bounds });
        let [x0, x1, y0, y1] = bounds;
        let mut parts = Vec::new();
        for place in (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| [x, y])) {
            let at = [place[0].rem_euclid(map.width() as i32), place[1]];
            let texel = map.texel(at[0].into(), at[1].into());
            if self.sun_of(map, at) == Some(number) {
                parts.push((place, (texel - texel * self.factor(texel)) * solid_angle(map, at[1] as u32)));
            }
        }
        let irradiance = parts.iter().map(|(_, taken)| *taken).sum();
        let points: Vec<_> = points(&parts).into_iter().map(|(place, taken)| [towards(map, place), taken]).collect();
        let direction = points.iter().map(|[at, taken]| at * luminance(*taken)).sum::<DVec3>().normalize();
        let radius = points.iter().map(|[at, _]| at.angle_between(direction)).fold(0.0, f64::max);
        self.suns[number] = Sun { direction, irradiance, points, radius, texels: bounds };
    }

    /// The sun that the texel in column and row `at` belongs to.
    fn sun_of(&self, map: &LatLong, [x, y]: [i32; 2]) -> Option<usize> {
        let bright = map.texel(x.into(), y.into()).max_element() > self.bright.into();
        let inside = |sun: &Sun| {
            let [x0, x1, y0, y1] = sun.texels;
            (x - x0).rem_euclid(map.width() as i32) <= x1 - x0 && (y0..=y1).contains(&y)
        };
        self.suns.iter().position(inside).filter(|_| bright)
    }

    fn factor(&self, texel: DVec3) -> f64 {
        f64::from(self.kept) / texel.max_element()
    }

    /// `map` without them.
    pub fn removed(&self, map: &LatLong) -> LatLong {
        let mut rest = map.clone();
        for (sun, at) in self
            .suns
            .iter()
            .map(|s| s.texels)
            .enumerate()
            .flat_map(|(i, [x0, x1, y0, y1])| (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| (i, [x, y]))))
        {
            let at = [at[0].rem_euclid(map.width() as i32), at[1]];
            if self.sun_of(map, at) == Some(sun) {
                let texel = map.texel(at[0].into(), at[1].into());
                rest.set(at.map(|e| e as u32), (texel * self.factor(texel)).as_vec3().to_array());
            }
        }
        rest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn power(map: &LatLong) -> DVec3 {
        let rows = map.texels().chunks_exact(map.width() as usize).zip(0..);
        rows.map(|(row, y)| {
            let sum: DVec3 = row.iter().map(|&[r, g, b]| DVec3::new(r.into(), g.into(), b.into())).sum();
            sum * solid_angle(map, y)
        })
        .sum()
    }

    /// Dim noise with spots of the given size and place in texels.
    fn map([width, height]: [u32; 2], spots: &[([i32; 2], i32)]) -> LatLong {
        let texel = |i: u32| {
            let [x, y] = [(i % width) as i32, (i / width) as i32];
            let inside =
                |&([sx, sy], side): &([i32; 2], i32)| (x - sx).rem_euclid(width as i32) < side && (sy..sy + side).contains(&y);
            let dim = 0.5 + (i.wrapping_mul(2_654_435_761) >> 20) as f32 / 4096.0;
            if spots.iter().any(inside) { [3e4, 2e4, 1e4] } else { [dim; 3] }
        };
        LatLong::new(width, height, (0..width * height).map(texel).collect()).unwrap()
    }

    #[test]
    fn energy_is_kept_and_spots_are_found() {
        // One over the seam, one alone, one as large as a window; another in the row beside a pole.
        for (size, spots, count) in [
            ([512, 256], vec![([511, 100], 3), ([200, 60], 2), ([300, 120], 24)], 2),
            ([301, 151], vec![([0, 40], 1), ([150, 0], 1)], 2),
            ([64, 32], vec![], 0),
        ] {
            let map = map(size, &spots);
            let suns = Suns::of(&map);
            assert_eq!(suns.suns.len(), count, "{size:?}");
            let rest = suns.removed(&map);
            let sum = power(&rest) + suns.suns.iter().map(|s| s.irradiance).sum::<DVec3>();
            let error = ((sum - power(&map)) / power(&map)).abs().max_element();
            assert!(error < 1e-7, "{size:?}: {error:e}");
            let (brightest, all) = (rest.texels().iter().copied().map(largest).fold(0.0, f32::max), map.texels().len());
            assert!(count != spots.len() || brightest <= suns.bright, "{brightest}");
            assert_eq!(
                rest.texels().iter().zip(map.texels()).filter(|(a, b)| a == b).count(),
                all - match count {
                    2 if size[0] == 512 => 9 + 4,
                    n => n,
                }
            );
        }
        let map = map([512, 256], &[([511, 100], 3)]);
        let sun = &Suns::of(&map).suns[0];
        let expected = direction(DVec2::new(0.5 / 512.0, 101.5 / 256.0));
        assert!(sun.direction.distance(expected) < 1e-3, "{sun:?}");
        assert_eq!(sun.points.len(), 36);
        let texel = PI / 256.0;
        assert!(sun.radius > 1.5 * texel && sun.radius < 2.1 * texel, "{}", sun.radius);
    }

    /// A sun of more texels than there may be points: what they add up to is the same.
    #[test]
    fn points_add_up_to_the_sun() {
        let map = map([3072, 1536], &[([700, 760], 9)]);
        let sun = &Suns::of(&map).suns[0];
        assert!(sun.points.len() <= MAX_POINTS && sun.points.len() >= MAX_POINTS / 4, "{}", sun.points.len());
        let sum: DVec3 = sun.points.iter().map(|[_, taken]| *taken).sum();
        assert!((sum / sun.irradiance - 1.0).abs().max_element() < 1e-12, "{sum} {}", sun.irradiance);
        // Of 9 texels in a row and of the tent of each.
        let height = |[at, _]: &[DVec3; 2]| (at.y.acos() - sun.direction.y.acos()) * 1536.0 / PI;
        let variance = sun.points.iter().map(|p| height(p).powi(2) * luminance(p[1])).sum::<f64>() / luminance(sum);
        assert!((variance / (80.0 / 12.0 + 1.0 / 6.0) - 1.0).abs() < 0.01, "{variance}");
    }

    #[test]
    fn dark_and_even_maps_have_none() {
        for radiance in [0.0, 1.0] {
            assert_eq!(Suns::of(&LatLong::new(8, 4, vec![[radiance; 3]; 32]).unwrap()).suns, []);
        }
    }
}
