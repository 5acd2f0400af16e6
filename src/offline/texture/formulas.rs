//! Textures by formula, by name: the maps of normals and concentrations on which filters are compared, and the surfaces of the
//! built-in scenes.

use crate::offline::error::{Error, Result};
use crate::offline::texture::noise::{Noise, hash};
use crate::offline::texture::{Image, Samples, reliefs, surfaces};
use glam::{DVec3, dvec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

/// Names of the maps of normals and concentrations on which filters are compared.
pub const MAPS: [&str; 7] = ["checker", "cloth", "bumps", "disk", "dunes", "flake", "atlas"];

/// Names of the built-in maps of normals.
pub const NORMALS: [&str; 15] = [
    "checker", "cloth", "bumps", "disk", "dunes", "flake", "atlas", "facets", "tiles", "bricks", "flutes", "scales", "carving",
    "armour", "sand",
];

/// Names of the built-in maps of concentrations.
pub const CONCENTRATIONS: [&str; 13] =
    ["checker", "cloth", "bumps", "disk", "dunes", "flake", "atlas", "facets", "tiles", "bricks", "flutes", "damask", "patina"];

/// Names of the built-in colour maps.
pub const COLOURS: [&str; 5] = ["checker", "tiles", "bricks", "damask", "damask-sheen"];

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
    /// The built-in texture `name`, repeating. On [`MAPS`], of 1024x1024 or 512x512 texels, filters are compared: `checker` is
    /// flat, of 16-texel cells of concentration 24 (colour 0.7) and 768 (0.05); `cloth` woven of 64x64 threads and crumpled;
    /// `bumps` hemispheres of 32 texels with dull patches; `disk` engraved with rings and spokes; `dunes` ridges; `flake` of
    /// 2x2-texel facets; `atlas` a quarter each of bumps, disk, dunes and checker.
    ///
    /// Scenes are made of the others: `facets` (1024x1024), polished plateaus between rough grooves, drawn anew in each texel;
    /// `tiles` (2048x2048), 16x16 glazed tiles; `bricks` (1024x1024); `flutes` of a column with polished veins (1024x1024);
    /// `scales` of a skin (2048x2048); `damask`, silk and gold threads (2048x1024), whose reflectance is `damask-sheen`;
    /// `patina`, worn patches (671x457); `carving`, a plate in relief (512x512); `armour`, hemispherical scales (512x480); `sand`,
    /// dunes with ripples (1024x1024).
    ///
    /// # Errors
    /// [`Error::Argument`] for another name.
    pub fn builtin(name: &str, part: Part) -> Result<Self> {
        let ([width, height], texel) = match (name, part, surfaces::formula(name, part).or_else(|| reliefs::formula(name, part)))
        {
            (_, _, Some(formula)) => formula,
            ("checker", Part::Colour, _) => {
                let colour: Texel = Box::new(|x, y| DVec3::splat(if odd(x, y) { 0.7 } else { 0.05 }));
                ([1024; 2], colour)
            }
            (_, Part::Normal, _) => normals(name)?,
            (_, Part::Concentration, _) => concentrations(name)?,
            (_, Part::Colour, _) => return Err(Error::argument("built-in texture", COLOURS.join(", "), name)),
        };
        let texel = |i: usize| texel(i % width, i / width).as_vec3().to_array();
        let texels = (0..width * height).into_par_iter().map(texel).collect();
        let path = PathBuf::from(format!("builtin:{name}"));
        Ok(Self { path, size: [width as u32, height as u32], samples: Samples::Float(texels) })
    }
}

/// The texel in a column and row.
pub(super) type Texel = Box<dyn Fn(usize, usize) -> DVec3 + Sync>;

/// Width and height, and their texels.
pub(super) type Formula = ([usize; 2], Texel);

fn normals(name: &str) -> Result<Formula> {
    Ok(match name {
        "checker" => ([1024; 2], Box::new(|_, _| DVec3::Z)),
        "cloth" => {
            from_height([1024; 2], 0.75, |u, v| 1.2 * (TAU * 64.0 * u).sin() * (TAU * 64.0 * v).sin() + 10.0 * CREASES.at(u, v))
        }
        "bumps" => ([1024; 2], Box::new(|x, y| bump(x, y).normalize())),
        "disk" => from_height([512; 2], 0.8, disk),
        "dunes" => from_height([512; 2], 0.45, dunes),
        "flake" => ([512; 2], Box::new(flake)),
        "atlas" => {
            let [bumps, disk, dunes] = [normals("bumps")?.1, normals("disk")?.1, normals("dunes")?.1];
            ([1024; 2], quarters([bumps, disk, dunes, Box::new(|_, _| DVec3::Z)]))
        }
        _ => return Err(Error::argument("built-in texture", NORMALS.join(", "), name)),
    })
}

fn concentrations(name: &str) -> Result<Formula> {
    let even = |side, kappa| -> Formula { ([side; 2], Box::new(move |_, _| DVec3::splat(kappa))) };
    Ok(match name {
        "checker" => ([1024; 2], Box::new(|x, y| DVec3::splat(if odd(x, y) { 24.0 } else { 768.0 }))),
        "cloth" => even(1024, 128.0),
        "bumps" => (
            [1024; 2],
            Box::new(|x, y| DVec3::splat(if PATCHES.at(centre(x, 1024), centre(y, 1024)) > 0.02 { 40.0 } else { 400.0 })),
        ),
        "disk" => even(512, 300.0),
        "dunes" => even(512, 60.0),
        "flake" => even(512, 1500.0),
        "atlas" => {
            let [bumps, checker] = [concentrations("bumps")?.1, concentrations("checker")?.1];
            ([1024; 2], quarters([bumps, even(512, 300.0).1, even(512, 60.0).1, checker]))
        }
        _ => return Err(Error::argument("built-in texture", CONCENTRATIONS.join(", "), name)),
    })
}

/// The first 512x512 of each: top left, top right, bottom left, bottom right.
fn quarters(parts: [Texel; 4]) -> Texel {
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

/// The centre of a texel among `side`, from 0 to 1.
pub(super) fn centre(at: usize, side: usize) -> f64 {
    (at as f64 + 0.5) / side as f64
}

fn odd(x: usize, y: usize) -> bool {
    (x / 16 + y / 16) % 2 == 1
}

/// Normals by central differences over the repeating map, y along the rows; `scale` makes slopes of differences of heights.
pub(super) fn from_height(size: [usize; 2], scale: f64, height: impl Fn(f64, f64) -> f64 + Sync) -> Formula {
    let [w, h] = size;
    let heights: Vec<f64> = (0..w * h).into_par_iter().map(|i| height(centre(i % w, w), centre(i / w, h))).collect();
    let normal = move |x: usize, y: usize| {
        let at = |x: usize, y: usize| heights.get((y % h) * w + x % w).copied().unwrap_or_default();
        let along_x = at(x + 1, y) - at(x + w - 1, y);
        let along_y = at(x, y + 1) - at(x, y + h - 1);
        dvec3(-along_x * 0.5 * scale, -along_y * 0.5 * scale, 1.0).normalize()
    };
    (size, Box::new(normal))
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

const CREASES: Noise = Noise { base: 16, octaves: 6, gain: 0.55, seed: 11 };
const PATCHES: Noise = Noise { base: 32, octaves: 4, gain: 0.6, seed: 77 };

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

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

    #[test]
    fn every_name_has_a_map() {
        for (part, names) in [(Part::Normal, &NORMALS[..]), (Part::Concentration, &CONCENTRATIONS), (Part::Colour, &COLOURS)] {
            for name in names {
                let image = Image::builtin(name, part).unwrap();
                let [width, height] = image.size().map(|side| side as usize);
                let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
                for i in 0..width * height {
                    let texel = image.raw(i);
                    (least, most) = (least.min(texel), most.max(texel));
                    assert!(part != Part::Normal || texel.is_normalized() && texel.z > 0.05, "{name} {i}: {texel}");
                }
                let bounds = match part {
                    Part::Colour => 0.0..=1.0,
                    Part::Normal => -1.0..=1.0,
                    Part::Concentration => 1.0..=2000.0,
                };
                assert!(bounds.contains(&least.min_element()) && bounds.contains(&most.max_element()), "{name}: {least} {most}");
            }
            assert!(Image::builtin("fog", part).is_err());
        }
    }
}
