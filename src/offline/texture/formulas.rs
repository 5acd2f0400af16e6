//! Textures by formula, by name: the maps of normals and concentrations on which filters are compared.

use crate::offline::error::{Error, Result};
use crate::offline::texture::{Image, Samples};
use glam::{DVec3, dvec3};
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

/// Names of the built-in maps of normals and concentrations.
pub const MAPS: [&str; 7] = ["checker", "cloth", "bumps", "disk", "dunes", "flake", "atlas"];

/// Names of the built-in colour maps.
pub const COLOURS: [&str; 1] = ["checker"];

/// What a texture is for: formulas have one for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// Linear colour.
    Colour,
    /// Signed unit normals, y as the rows grow.
    Normal,
    /// Concentration of a von Mises-Fisher lobe of normals about the mapped one.
    Concentration,
}

impl Image {
    /// The built-in texture `name`: repeating, 1024x1024 or 512x512. `checker` is flat, of 16-texel cells of concentration 24
    /// (colour 0.7) and 768 (0.05); `cloth` woven of 64x64 threads and crumpled; `bumps` hemispheres of 32 texels with dull
    /// patches; `disk` engraved with rings and spokes; `dunes` ridges; `flake` of 2x2-texel facets; `atlas` a quarter each of
    /// bumps, disk, dunes and checker.
    ///
    /// # Errors
    /// [`Error::Argument`] for another name.
    pub fn builtin(name: &str, part: Part) -> Result<Self> {
        let (side, texel): (usize, Box<dyn Fn(usize, usize) -> DVec3>) = match (name, part) {
            ("checker", Part::Colour) => (1024, Box::new(|x, y| DVec3::splat(if odd(x, y) { 0.7 } else { 0.05 }))),
            (_, Part::Normal) => normals(name)?,
            (_, Part::Concentration) => concentrations(name)?,
            (_, Part::Colour) => return Err(Error::argument("built-in texture", COLOURS.join(", "), name)),
        };
        let texels = (0..side * side).map(|i| texel(i % side, i / side).as_vec3().to_array()).collect();
        let path = PathBuf::from(format!("builtin:{name}"));
        Ok(Self { path, size: [side as u32; 2], samples: Samples::Float(texels) })
    }
}

/// Side, and the texel in a column and row.
type Formula = (usize, Box<dyn Fn(usize, usize) -> DVec3>);

fn normals(name: &str) -> Result<Formula> {
    Ok(match name {
        "checker" => (1024, Box::new(|_, _| DVec3::Z)),
        "cloth" => {
            from_height(1024, 0.75, |u, v| 1.2 * (TAU * 64.0 * u).sin() * (TAU * 64.0 * v).sin() + 10.0 * CREASES.at(u, v))
        }
        "bumps" => (1024, Box::new(|x, y| bump(x, y).normalize())),
        "disk" => from_height(512, 0.8, disk),
        "dunes" => from_height(512, 0.45, dunes),
        "flake" => (512, Box::new(flake)),
        "atlas" => {
            let [bumps, disk, dunes] = [normals("bumps")?.1, normals("disk")?.1, normals("dunes")?.1];
            (1024, quarters([bumps, disk, dunes, Box::new(|_, _| DVec3::Z)]))
        }
        _ => return Err(Error::argument("built-in texture", MAPS.join(", "), name)),
    })
}

fn concentrations(name: &str) -> Result<Formula> {
    let even = |side, kappa| -> Formula { (side, Box::new(move |_, _| DVec3::splat(kappa))) };
    Ok(match name {
        "checker" => (1024, Box::new(|x, y| DVec3::splat(if odd(x, y) { 24.0 } else { 768.0 }))),
        "cloth" => even(1024, 128.0),
        "bumps" => {
            (1024, Box::new(|x, y| DVec3::splat(if PATCHES.at(centre(x, 1024), centre(y, 1024)) > 0.02 { 40.0 } else { 400.0 })))
        }
        "disk" => even(512, 300.0),
        "dunes" => even(512, 60.0),
        "flake" => even(512, 1500.0),
        "atlas" => {
            let [bumps, checker] = [concentrations("bumps")?.1, concentrations("checker")?.1];
            (1024, quarters([bumps, even(512, 300.0).1, even(512, 60.0).1, checker]))
        }
        _ => return Err(Error::argument("built-in texture", MAPS.join(", "), name)),
    })
}

/// The first 512x512 of each: top left, top right, bottom left, bottom right.
fn quarters(parts: [Box<dyn Fn(usize, usize) -> DVec3>; 4]) -> Box<dyn Fn(usize, usize) -> DVec3> {
    Box::new(move |x, y| {
        let [a, b, c, d] = &parts;
        let part = match (x < 512, y < 512) {
            (true, true) => a,
            (false, true) => b,
            (true, false) => c,
            (false, false) => d,
        };
        part(x % 512, y % 512)
    })
}

fn centre(at: usize, side: usize) -> f64 {
    (at as f64 + 0.5) / side as f64
}

fn odd(x: usize, y: usize) -> bool {
    (x / 16 + y / 16) % 2 == 1
}

/// Normals by central differences over the repeating map, y along the rows.
fn from_height(side: usize, scale: f64, height: impl Fn(f64, f64) -> f64) -> Formula {
    let heights: Vec<f64> = (0..side * side).map(|i| height(centre(i % side, side), centre(i / side, side))).collect();
    let normal = move |x: usize, y: usize| {
        let at = |x: usize, y: usize| heights.get((y % side) * side + x % side).copied().unwrap_or_default();
        let along_x = at(x + 1, y) - at(x + side - 1, y);
        let along_y = at(x, y + 1) - at(x, y + side - 1);
        dvec3(-along_x * 0.5 * scale, -along_y * 0.5 * scale, 1.0).normalize()
    };
    (side, Box::new(normal))
}

/// A hemisphere, steep at most asin 0.9, and flat between.
fn bump(x: usize, y: usize) -> DVec3 {
    let [x, y] = [x, y].map(|at| (centre(at % 32, 32) * 2.0 - 1.0) / 0.92);
    let square = x * x + y * y;
    if square >= 1.0 {
        return DVec3::Z;
    }
    let factor = if square < 0.81 { 1.0 } else { 0.9 / square.sqrt() };
    dvec3(x * factor, y * factor, (1.0 - square.min(0.81)).sqrt())
}

fn disk(u: f64, v: f64) -> f64 {
    let (x, y) = (u * 2.0 - 1.0, v * 2.0 - 1.0);
    let (r, a) = (x.hypot(y), y.atan2(x));
    if r > 0.97 {
        return 0.0;
    }
    let rings = 1.0 / (1.0 + (-8.0 * (r * 70.0 + 3.0 * (a * 5.0).sin()).sin()).exp());
    let spokes = 0.8 / (1.0 + (-9.0 * (a * 24.0 + 8.0 * r).sin() * (r * 30.0).sin()).exp());
    let spokes = if r > 0.3 && r < 0.75 { spokes } else { 0.0 };
    3.0 * (rings + spokes + 0.7 * Noise { base: 32, octaves: 3, gain: 0.5, seed: 5 }.at(u, v))
}

fn dunes(u: f64, v: f64) -> f64 {
    let w = Noise { base: 4, octaves: 4, gain: 0.5, seed: 31 }.at(u, v);
    let p = (24.0 * v + 3.0 * w + 100.0).rem_euclid(1.0);
    let ridge = if p < 0.75 { p / 0.75 } else { (1.0 - p) / 0.25 };
    let grain = Noise { base: 64, octaves: 3, gain: 0.6, seed: 9 }.at(u, v);
    ridge * 5.0 + 40.0 * w + 4.0 * grain + 2.0 * (2.0 * PI * (96.0 * u + 20.0 * v + 6.0 * w)).sin()
}

fn flake(x: usize, y: usize) -> DVec3 {
    let which = (hash(x as i64 / 2, y as i64 / 2, 9) * 4.0) as usize;
    let (x, y) = ([0.18, -0.18, -0.18, 0.18][which & 3], [0.18, 0.18, -0.18, -0.18][which & 3]);
    dvec3(x, y, 1.0).normalize()
}

/// Octaves of smooth noise on repeating grids of random values, minus one half each.
struct Noise {
    /// Cells of the first octave; each other has twice as many.
    base: i64,
    octaves: i64,
    gain: f64,
    seed: i64,
}

const CREASES: Noise = Noise { base: 16, octaves: 6, gain: 0.55, seed: 11 };
const PATCHES: Noise = Noise { base: 32, octaves: 4, gain: 0.6, seed: 77 };

impl Noise {
    fn at(&self, u: f64, v: f64) -> f64 {
        let (mut sum, mut weight, mut period) = (0.0, 1.0, self.base);
        for octave in 0..self.octaves {
            sum += weight * (value(u * period as f64, v * period as f64, period, self.seed + octave) - 0.5);
            (period, weight) = (period * 2, weight * self.gain);
        }
        sum
    }
}

fn value(x: f64, y: f64, period: i64, seed: i64) -> f64 {
    let smooth = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (fx, fy) = (smooth(x - x.floor()), smooth(y - y.floor()));
    let corner = |i: i64, j: i64| hash((x.floor() as i64 + i) % period, (y.floor() as i64 + j) % period, seed);
    let row = |j| corner(0, j) + (corner(1, j) - corner(0, j)) * fx;
    row(0) + (row(1) - row(0)) * fy
}

/// A number in [0, 1) for each cell.
fn hash(x: i64, y: i64, seed: i64) -> f64 {
    let all = (x as u32).wrapping_mul(374_761_393).wrapping_add((y as u32).wrapping_mul(668_265_263));
    let mut h = all.wrapping_add((seed as u32).wrapping_mul(2_246_822_519));
    h = (h ^ h >> 13).wrapping_mul(1_274_126_177);
    h ^= h >> 16;
    h = h.wrapping_mul(2_246_822_519);
    h ^= h >> 13;
    f64::from(h >> 8) / 16_777_216.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texels of the reference implementation in Python (numpy) of the same formulas: x and y of the normal, concentration.
    const PINNED: [(&str, usize, usize, [f32; 2], f32); 14] = [
        ("checker", 0, 0, [0.0, 0.0], 768.0),
        ("checker", 17, 3, [0.0, 0.0], 24.0),
        ("cloth", 0, 0, [-0.163450, -0.061943], 128.0),
        ("cloth", 517, 40, [0.080956, 0.327979], 128.0),
        ("cloth", 1015, 589, [-0.202788, -0.284288], 128.0),
        ("bumps", 17, 3, [0.101902, -0.849185], 400.0),
        ("bumps", 517, 40, [-0.713315, -0.509511], 400.0),
        ("disk", 261, 40, [-0.034251, 0.076370], 300.0),
        ("dunes", 261, 40, [-0.704182, -0.308658], 60.0),
        ("dunes", 503, 333, [0.277954, -0.091406], 60.0),
        ("flake", 17, 3, [-0.174437, -0.174437], 1500.0),
        ("flake", 503, 333, [-0.174437, 0.174437], 1500.0),
        ("atlas", 100, 1023, [-0.326049, -0.296811], 60.0),
        ("atlas", 1015, 589, [0.0, 0.0], 24.0),
    ];

    #[test]
    fn texels_are_those_of_the_reference_implementation() {
        for name in MAPS {
            let [normal, kappa] = [Part::Normal, Part::Concentration].map(|part| Image::builtin(name, part).unwrap());
            assert_eq!(normal.size(), kappa.size());
            let side = normal.size()[0] as usize;
            for (_, x, y, [nx, ny], k) in PINNED.iter().filter(|p| p.0 == name) {
                let (n, found) = (normal.raw(y * side + x), kappa.raw(y * side + x));
                assert!((n.x - nx).abs() < 2e-6 && (n.y - ny).abs() < 2e-6 && n.is_normalized(), "{name} {x} {y}: {n}");
                assert_eq!(found.x, *k, "{name} {x} {y}");
            }
        }
        // A share of the bumps is dull; the others are all of one kind or two in equal parts.
        let bumps = Image::builtin("bumps", Part::Concentration).unwrap();
        let dull = (0..1 << 20).filter(|i| bumps.raw(*i).x == 40.0).count() as f64 / f64::from(1 << 20);
        assert!((0.3..0.6).contains(&dull), "{dull}");
        assert!(Image::builtin("bumps", Part::Colour).is_err() && Image::builtin("fog", Part::Normal).is_err());
        let checks = Image::builtin("checker", Part::Colour).unwrap();
        assert_eq!([checks.raw(0).x, checks.raw(16).x], [0.05, 0.7]);
    }
}
