//! The surfaces that built-in scenes are made of, by formula.

use crate::offline::texture::Part;
use crate::offline::texture::formulas::{Formula, Texel, centre, from_height};
use crate::offline::texture::noise::{Noise, hash};
use glam::{DVec3, dvec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// The map `name` for a part that it has.
pub(super) fn formula(name: &str, part: Part) -> Option<Formula> {
    let scalar = |size, value: fn(usize, usize) -> f64| -> Formula { (size, Box::new(move |x, y| DVec3::splat(value(x, y)))) };
    let plain = |size, texel: fn(usize, usize) -> DVec3| -> Formula { (size, Box::new(texel) as Texel) };
    Some(match (name, part) {
        ("facets", Part::Normal) => plain(FACETS, facet),
        ("facets", Part::Concentration) => scalar(FACETS, |x, y| if plateau(x, y) { 1500.0 } else { 60.0 }),
        ("tiles", Part::Normal) => from_height(TILES, 0.5, |u, v| TILING.height(u, v)),
        ("tiles", Part::Concentration) => scalar(TILES, |x, y| TILING.of(x, y).concentration([80.0, 1500.0], 12.0)),
        ("tiles", Part::Colour) => plain(TILES, tile_colour),
        ("bricks", Part::Normal) => from_height(BRICKS, 0.5, |u, v| WALL.height(u, v)),
        ("bricks", Part::Concentration) => scalar(BRICKS, |x, y| WALL.of(x, y).concentration([10.0, 120.0], 5.0)),
        ("bricks", Part::Colour) => plain(BRICKS, brick_colour),
        ("flutes", Part::Normal) => from_height(FLUTES, 0.5, flutes),
        ("flutes", Part::Concentration) => scalar(FLUTES, |x, y| if vein(x, y) { 900.0 } else { 90.0 }),
        ("scales", Part::Normal) => plain([2048; 2], scale),
        ("damask", Part::Concentration) => scalar(DAMASK, |x, y| thread(x, y).concentration()),
        ("damask", Part::Colour) => plain(DAMASK, |x, y| thread(x, y).albedo()),
        ("damask-sheen", Part::Colour) => plain(DAMASK, |x, y| thread(x, y).sheen()),
        ("patina", Part::Concentration) => scalar(PATINA, worn),
        _ => return None,
    })
}

const FACETS: [usize; 2] = [1024; 2];
const TILES: [usize; 2] = [2048; 2];
const BRICKS: [usize; 2] = [1024; 2];
const FLUTES: [usize; 2] = [1024; 2];
const DAMASK: [usize; 2] = [2048, 1024];
const PATINA: [usize; 2] = [671, 457];

/// Whether a facet is polished rather than in a groove: of each sort more in some places than in others.
fn plateau(x: usize, y: usize) -> bool {
    let share = 0.5 + 0.9 * Noise { base: 6, octaves: 3, gain: 0.5, seed: 41 }.at(centre(x, FACETS[0]), centre(y, FACETS[1]));
    hash(x as i64, y as i64, 43) < share
}

/// A normal of its own in each texel: slopes are normally distributed, about 0 or about those of a groove's two sides.
fn facet(x: usize, y: usize) -> DVec3 {
    let draw = |seed| hash(x as i64, y as i64, seed);
    let radius = (-2.0 * (1.0 - draw(44)).ln()).sqrt();
    let (sin, cos) = (TAU * draw(45)).sin_cos();
    let (side, deviation) = match (plateau(x, y), draw(46) < 0.5) {
        (true, _) => (0.0, 0.02),
        (false, true) => (0.35, 0.1),
        (false, false) => (-0.35, 0.1),
    };
    dvec3(side + deviation * radius * cos, deviation * radius * sin, 1.0).normalize()
}

/// Rows of blocks with joints between them.
struct Masonry {
    /// Of the map.
    size: [usize; 2],
    /// Texels of a block with half a joint on each side.
    block: [usize; 2],
    /// Half the width of a joint in texels.
    joint: f64,
    /// By how many texels each second row is shifted.
    shift: usize,
    /// How far blocks slope at most, in heights a texel, and how high their own relief is.
    tilt: f64,
    relief: f64,
    /// Of that relief.
    noise: Noise,
}

/// Where a texel lies in its block.
struct Place {
    /// Of the block.
    column: i64,
    row: i64,
    /// From its middle, in texels.
    x: f64,
    y: f64,
    in_joint: bool,
    /// Texels to the joint's edge, negative inside it.
    edge: f64,
}

const TILING: Masonry = Masonry {
    size: TILES,
    block: [128; 2],
    joint: 3.0,
    shift: 0,
    tilt: 0.05,
    relief: 5.0,
    noise: Noise { base: 48, octaves: 3, gain: 0.5, seed: 51 },
};

const WALL: Masonry = Masonry {
    size: BRICKS,
    block: [128, 64],
    joint: 4.0,
    shift: 64,
    tilt: 0.1,
    relief: 8.0,
    noise: Noise { base: 48, octaves: 4, gain: 0.6, seed: 61 },
};

impl Masonry {
    fn of(&self, x: usize, y: usize) -> Place {
        let [width, height] = self.block;
        let row = y / height;
        let x = (x + if row % 2 == 1 { self.shift } else { 0 }) % self.size[0];
        let [from_x, from_y] = [x % width, y % height];
        let [to_x, to_y] = [width - 1 - from_x, height - 1 - from_y];
        let edge = from_x.min(to_x).min(from_y).min(to_y) as f64 + 0.5 - self.joint;
        let [x_, y_] = [(from_x, width), (from_y, height)].map(|(at, side)| (centre(at, side) - 0.5) * side as f64);
        Place { column: (x / width) as i64, row: row as i64, x: x_, y: y_, in_joint: edge < 0.0, edge }
    }

    /// Of the surface at a texel's centre, in texels but for a factor.
    fn height(&self, u: f64, v: f64) -> f64 {
        let [x, y] = [(u, self.size[0]), (v, self.size[1])].map(|(at, side)| (at * side as f64) as usize);
        let place = self.of(x, y);
        let relief = self.relief * self.noise.at(u, v);
        if place.in_joint {
            return 0.5 * relief - 6.0;
        }
        let [along_x, along_y] = [52, 53].map(|seed| self.tilt * (2.0 * place.hash(seed) - 1.0));
        relief + along_x * place.x + along_y * place.y - 3.0 * (-place.edge / 3.0).exp()
    }
}

impl Place {
    fn hash(&self, seed: i64) -> f64 {
        hash(self.column, self.row, seed)
    }

    /// Each block has its own between two, evenly on a logarithmic scale.
    fn concentration(&self, [least, most]: [f64; 2], joint: f64) -> f64 {
        if self.in_joint { joint } else { least * (most / least).powf(self.hash(54)) }
    }
}

fn tile_colour(x: usize, y: usize) -> DVec3 {
    let place = TILING.of(x, y);
    let colour = match (place.in_joint, (place.column + place.row) % 2 == 0) {
        (true, _) => return dvec3(0.32, 0.3, 0.27),
        (false, true) => dvec3(0.55, 0.45, 0.31),
        (false, false) => dvec3(0.07, 0.1, 0.1),
    };
    colour * (0.75 + 0.5 * place.hash(55))
}

fn brick_colour(x: usize, y: usize) -> DVec3 {
    let place = WALL.of(x, y);
    if place.in_joint {
        return DVec3::splat(0.45);
    }
    dvec3(0.4, 0.15, 0.09).lerp(dvec3(0.22, 0.09, 0.07), place.hash(55)) * (0.8 + 0.4 * place.hash(56))
}

/// Sixteen hollows from left to right, fillets between them, and pits.
fn flutes(u: f64, v: f64) -> f64 {
    let across = 2.0 * (16.0 * u).fract() - 1.0;
    let hollow = (FRAC_PI_2 * (across / 0.85).clamp(-1.0, 1.0)).cos();
    4.0 * Noise { base: 64, octaves: 4, gain: 0.6, seed: 71 }.at(u, v) - 22.0 * hollow
}

fn vein(x: usize, y: usize) -> bool {
    Noise { base: 5, octaves: 5, gain: 0.6, seed: 73 }.at(centre(x, FLUTES[0]), centre(y, FLUTES[1])).abs() < 0.05
}

/// Bowls of 32x32 texels in rows, each second one shifted by half of one; each covers part of the row that follows.
fn scale(x: usize, y: usize) -> DVec3 {
    const SIDE: usize = 32;
    // A scale hangs from the top of its row as far as into the middle of the next one.
    let hanging = |rows_up: usize| {
        let row = (y / SIDE + 64 - rows_up) % 64;
        let x = (x + if row % 2 == 1 { SIDE / 2 } else { 0 }) % SIDE;
        let along = 2.0 * centre(x, SIDE) - 1.0;
        let down = (centre(y % SIDE, SIDE) + rows_up as f64) / 1.5;
        (along * along + down.powi(4) < 1.0).then_some((along, down))
    };
    let (along, down) = hanging(1).or(hanging(0)).unwrap_or((0.0, 0.0));
    dvec3(0.75 * along, 0.9 * down * down - 0.15, 1.0).normalize()
}

/// What lies on top of a woven cloth.
#[derive(Clone, Copy)]
enum Thread {
    /// Of the ground: dull across, glossy along.
    Weft,
    Warp,
    /// Of the figures.
    Silk,
    Gold,
}

/// A cloth of threads two texels wide: a ground of satin with figures, which are offset by half from column to column.
fn thread(x: usize, y: usize) -> Thread {
    let [width, height] = [256, 256];
    let column = x / width;
    let y = if column % 2 == 1 { y + height / 2 } else { y };
    let [u, v] = [(x, width), (y, height)].map(|(at, side)| 2.0 * centre(at % side, side) - 1.0);
    let (radius, angle) = (u.hypot(v), v.atan2(u));
    let flower = radius < 0.45 + 0.22 * (6.0 * angle).cos() && radius > 0.12;
    let stem = (u - 0.25 * (1.5 * TAU * v).sin()).abs() < 0.045 || (0.8..0.88).contains(&radius);
    match (flower || stem, (x / 2).is_multiple_of(3), (y / 2).is_multiple_of(3)) {
        (true, _, true) => Thread::Silk,
        (true, _, false) => Thread::Gold,
        (false, true, _) => Thread::Weft,
        (false, false, _) => Thread::Warp,
    }
}

impl Thread {
    fn concentration(self) -> f64 {
        match self {
            Self::Weft => 8.0,
            Self::Warp => 180.0,
            Self::Silk => 40.0,
            Self::Gold => 1000.0,
        }
    }

    fn albedo(self) -> DVec3 {
        match self {
            Self::Weft => dvec3(0.22, 0.012, 0.03),
            Self::Warp => dvec3(0.3, 0.015, 0.03),
            Self::Silk => dvec3(0.5, 0.38, 0.2),
            Self::Gold => dvec3(0.12, 0.07, 0.02),
        }
    }

    fn sheen(self) -> DVec3 {
        match self {
            Self::Weft => DVec3::splat(0.04),
            Self::Warp => dvec3(0.16, 0.08, 0.08),
            Self::Silk => DVec3::splat(0.15),
            Self::Gold => dvec3(0.9, 0.66, 0.28),
        }
    }
}

/// Polished where it is worn, dull elsewhere, with specks of each in the other.
fn worn(x: usize, y: usize) -> f64 {
    let (u, v) = (centre(x, PATINA[0]), centre(y, PATINA[1]));
    let level = Noise { base: 6, octaves: 6, gain: 0.65, seed: 81 }.at(u, v);
    if level > 0.03 { 800.0 } else { 25.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::texture::Image;

    fn share(name: &str, part: Part, of: impl Fn(glam::Vec3) -> bool) -> f64 {
        let image = Image::builtin(name, part).unwrap();
        let [width, height] = image.size().map(|side| side as usize);
        (0..width * height).filter(|i| of(image.raw(*i))).count() as f64 / (width * height) as f64
    }

    #[test]
    fn sizes_are_those_of_their_scenes() {
        for (name, part, size) in [
            ("facets", Part::Normal, [1024, 1024]),
            ("tiles", Part::Colour, [2048, 2048]),
            ("scales", Part::Normal, [2048, 2048]),
            ("damask", Part::Colour, [2048, 1024]),
            ("damask-sheen", Part::Colour, [2048, 1024]),
            ("damask", Part::Concentration, [2048, 1024]),
            ("patina", Part::Concentration, [671, 457]),
        ] {
            assert_eq!(Image::builtin(name, part).unwrap().size(), size, "{name}");
        }
    }

    /// Where a map mixes two sorts of texels, there is much of both.
    #[test]
    fn sorts_have_their_share() {
        for (name, least, most) in [("facets", 0.4, 0.6), ("flutes", 0.1, 0.4), ("damask", 0.1, 0.5), ("patina", 0.3, 0.7)] {
            let polished = share(name, Part::Concentration, |texel| texel.x >= 800.0);
            assert!((least..most).contains(&polished), "{name}: {polished}");
        }
        // Joints of 6 texels in 128, and of 8 in 128 and 64.
        let joints = |name, kappa| share(name, Part::Concentration, |texel| texel.x == kappa);
        assert!((joints("tiles", 12.0) - (1.0 - (122.0f64 / 128.0).powi(2))).abs() < 1e-9, "{}", joints("tiles", 12.0));
        assert!((joints("bricks", 5.0) - (1.0 - 120.0 / 128.0 * 56.0 / 64.0)).abs() < 1e-9, "{}", joints("bricks", 5.0));
        // Facets lean to both sides alike.
        let [left, right] = [-1.0, 1.0].map(|side| share("facets", Part::Normal, |n| n.x * side > 0.2));
        assert!((left - right).abs() < 0.01 && left > 0.15, "{left} {right}");
    }

    /// Maps repeat without a seam: normals change no more across the border than elsewhere.
    #[test]
    fn borders_are_no_seams() {
        for name in ["tiles", "bricks", "flutes", "scales"] {
            let image = Image::builtin(name, Part::Normal).unwrap();
            let [width, height] = image.size().map(|side| side as usize);
            let change = |a: [usize; 2], b: [usize; 2]| {
                let [a, b] = [a, b].map(|[x, y]| image.raw(y % height * width + x % width));
                f64::from(a.distance(b))
            };
            // Blocks begin there, so the like place is where another block of the same row parity begins.
            let block = 128;
            let down = |x| (0..height).map(|y| change([x - 1, y], [x, y])).sum::<f64>();
            let along = |y| (0..width).map(|x| change([x, y - 1], [x, y])).sum::<f64>();
            assert!(down(width) < 1.5 * down(block) + 1.0, "{name}: {} {}", down(width), down(block));
            assert!(along(height) < 1.5 * along(block) + 1.0, "{name}: {} {}", along(height), along(block));
        }
    }
}
