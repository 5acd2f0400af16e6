//! Surfaces that look different from near and from far, by formula: those of Tan et al. 2005.

use crate::offline::texture::Part;
use crate::offline::texture::formulas::{Formula, centre, from_height};
use crate::offline::texture::noise::Noise;
use glam::{DVec3, dvec3};
use std::f64::consts::TAU;

/// The map `name` for a part that it has.
pub(super) fn formula(name: &str, part: Part) -> Option<Formula> {
    Some(match (name, part) {
        ("carving", Part::Normal) => from_height([CARVING; 2], 1.0, |u, v| carving(2.0 * u - 1.0, 2.0 * v - 1.0)),
        ("armour", Part::Normal) => (ARMOUR, Box::new(scale)),
        ("sand", Part::Normal) => from_height([SAND; 2], 1.0, sand),
        _ => return None,
    })
}

const CARVING: usize = 512;
const ARMOUR: [usize; 2] = [512, 480];
const SAND: usize = 1024;

/// A parabola over -1 to 1 of height 1, 0 outside.
fn swell(x: f64) -> f64 {
    (1.0 - x * x).max(0.0)
}

/// From 0 to 1 between two ends.
fn smooth([from, to]: [f64; 2], x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Heights in texels of a plate in the unit circle: a rosette, a garland of turned tongues, a row of beads and a rim on a chased ground.
/// Shallow, so that hardly any of it is hidden from aside, as nothing ever hides anything here.
fn carving(x: f64, y: f64) -> f64 {
    const RADIUS: f64 = CARVING as f64 / 2.0;
    let (r, angle) = (x.hypot(y), y.atan2(x) / TAU);
    // Across one of `count` like parts, from -1 to 1.
    let part = |count: f64, turn: f64| 2.0 * (count * angle + turn).rem_euclid(1.0) - 1.0;
    let moulding = |middle: f64, half: f64| 0.35 * half * swell((r - middle) / half);
    let height = match r {
        r if r > 0.99 => 0.0,
        r if r > 0.92 => moulding(0.955, 0.035),
        r if r > 0.82 => {
            let half = 0.45 * TAU * 0.87 / 60.0;
            let along = part(60.0, 0.0) / 0.9;
            0.35 * half * swell(along.hypot((r - 0.87) / half))
        }
        r if r > 0.77 => moulding(0.807, 0.012) + moulding(0.783, 0.012),
        r if r > 0.47 => {
            let ends = smooth([0.47, 0.55], r) * smooth([0.77, 0.69], r);
            let across = part(26.0, 2.4 * r);
            ends * (0.022 * swell(across) - 0.004 * (-(across / 0.15).powi(2)).exp())
        }
        r if r > 0.42 => moulding(0.445, 0.02),
        r if r > 0.1 => {
            // Eight petals over eight that show between them.
            let petal = |turn: f64, length: f64| {
                let along = (2.0 * r - length) / length;
                let across = part(8.0, turn) / (1.15 * swell(along).sqrt()).max(1e-3);
                let veins = 0.0014 * (4.0 * TAU * across).sin() * smooth([0.1, 0.2], r);
                0.027 * swell(across) * swell(along).sqrt() + if across.abs() < 0.9 { veins } else { 0.0 }
            };
            petal(0.0, 0.34).max(petal(0.5, 0.39) - 0.01)
        }
        r => 0.03 * swell(r / 0.1),
    };
    let hammered = 0.7 * Noise { base: 48, octaves: 2, gain: 0.5, seed: 91 }.at(0.5 * x + 0.5, 0.5 * y + 0.5);
    // Rings that a graver left, six texels apart.
    let chased = 0.12 * (TAU * r * RADIUS / 6.0).sin();
    RADIUS * height + if r > 0.99 { 0.0 } else { hammered + chased }
}

/// Scales of an armour: hemispheres in rows, each second one shifted by half of one; each lies over two of the row that follows.
fn scale(x: usize, y: usize) -> DVec3 {
    const COLUMN: f64 = 64.0;
    const ROW: f64 = 48.0;
    const RADIUS: f64 = 38.0;
    const STEEPEST: f64 = 0.9;
    let [x, y] = [(x, ARMOUR[0]), (y, ARMOUR[1])].map(|(at, side)| centre(at, side) * side as f64);
    let row = (y / ROW).floor();
    for above in [1.0, 0.0, -1.0] {
        let across = x / COLUMN + if (row - above).rem_euclid(2.0) == 1.0 { 0.5 } else { 0.0 };
        let dx = (across - across.floor() - 0.5) * COLUMN / RADIUS;
        let dy = (y - (row - above + 0.5) * ROW) / RADIUS;
        let sine = dx.hypot(dy);
        if sine < 1.0 {
            let factor = if sine > STEEPEST { STEEPEST / sine } else { 1.0 };
            return dvec3(factor * dx, factor * dy, (1.0 - sine.min(STEEPEST).powi(2)).sqrt());
        }
    }
    DVec3::Z
}

/// Heights in texels of a desert: dunes across a wind that changes from place to place, ripples on their long sides, and grains.
fn sand(u: f64, v: f64) -> f64 {
    const WIND: Noise = Noise { base: 3, octaves: 3, gain: 0.45, seed: 31 };
    let wind = WIND.at(u, v);
    let across = (5.0 * v + 1.3 * wind).rem_euclid(1.0);
    let dune = smooth([0.0, 0.74], across) * smooth([1.0, 0.74], across);
    let size = 0.7 + 0.9 * Noise { base: 5, octaves: 2, gain: 0.5, seed: 32 }.at(u, v);
    // Sand that slid down has fewer.
    let gentle = smooth([0.02, 0.2], across) * smooth([0.78, 0.68], across);
    let ripple = (TAU * (68.0 * v + 6.0 * u + 9.0 * wind)).sin() * (0.35 + 0.65 * gentle);
    let grain = Noise { base: 256, octaves: 2, gain: 0.8, seed: 33 }.at(u, v);
    52.0 * size * dune + 1.0 * ripple + 0.5 * grain
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::texture::Image;

    /// Changes of normals from one texel to the next, summed over a line of them: columns or rows at `at`.
    fn change(image: &Image, at: usize, columns: bool) -> f64 {
        let [width, height] = image.size().map(|side| side as usize);
        let normal = |x: usize, y: usize| image.raw(y % height * width + x % width);
        let along = if columns { height } else { width };
        let pair = |i| if columns { (normal(at - 1, i), normal(at, i)) } else { (normal(i, at - 1), normal(i, at)) };
        (0..along).map(pair).map(|(a, b)| f64::from(a.distance(b))).sum()
    }

    #[test]
    fn maps_repeat_without_a_seam() {
        for (name, like) in [("carving", [3, 3]), ("armour", [64, 96]), ("sand", [300, 300])] {
            let image = Image::builtin(name, Part::Normal).unwrap();
            for (side, like, columns) in [(image.size()[0], like[0], true), (image.size()[1], like[1], false)] {
                let (border, inside) = (change(&image, side as usize, columns), change(&image, like, columns));
                assert!(border < 1.5 * inside + 1.0, "{name}: {border} {inside}");
            }
        }
    }

    #[test]
    fn scales_cover_everything_and_the_plate_is_round() {
        let sine = |n: DVec3| n.x.hypot(n.y);
        let steepest = (0..ARMOUR[0] * ARMOUR[1]).map(|i| sine(scale(i % ARMOUR[0], i / ARMOUR[0]))).fold(0.0, f64::max);
        assert!((steepest - 0.9).abs() < 1e-9, "{steepest}");
        // Where a scale is flat it is its own middle: there is one for each.
        let flat = (0..ARMOUR[0] * ARMOUR[1]).filter(|i| sine(scale(i % ARMOUR[0], i / ARMOUR[0])) < 0.03).count();
        assert!((flat as f64 / 80.0 - 4.0).abs() < 1.0, "{flat}");
        for turn in 0..32 {
            let (sin, cos) = (TAU * f64::from(turn) / 32.0).sin_cos();
            assert_eq!(carving(1.01 * cos, 1.01 * sin), 0.0);
            assert!(carving(0.955 * cos, 0.955 * sin) > 2.0);
        }
    }

    #[test]
    fn hardly_any_of_the_plate_is_hidden_from_aside() {
        let image = Image::builtin("carving", Part::Normal).unwrap();
        let steep = (0..CARVING * CARVING).filter(|i| image.raw(*i).z < 40f32.to_radians().cos()).count();
        assert!(steep < CARVING * CARVING / 50, "{steep}");
    }

    #[test]
    fn a_desert_has_dunes_and_ripples() {
        // Blocks of two ripples, whose own slopes cancel.
        const BLOCK: usize = 32;
        let image = Image::builtin("sand", Part::Normal).unwrap();
        let spread = |of: &mut dyn Iterator<Item = usize>| {
            let all: Vec<f64> = of.map(|i| f64::from(image.raw(i).y)).collect();
            let mean = all.iter().sum::<f64>() / all.len() as f64;
            (mean, (all.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt())
        };
        let blocks = (0..(SAND / BLOCK).pow(2)).map(|block| {
            let [left, top] = [block % (SAND / BLOCK), block / (SAND / BLOCK)].map(|at| at * BLOCK);
            spread(&mut (0..BLOCK * BLOCK).map(|i| (top + i / BLOCK) * SAND + left + i % BLOCK))
        });
        let (means, ripples): (Vec<f64>, Vec<f64>) = blocks.unzip();
        let rms = |of: &[f64]| (of.iter().map(|v| v * v).sum::<f64>() / of.len() as f64).sqrt();
        assert!(rms(&means) > 0.15 && rms(&ripples) > 0.15, "{} {}", rms(&means), rms(&ripples));
        let level = |of: &[f64]| of.iter().filter(|v| v.abs() < 0.1).count() as f64 / of.len() as f64;
        assert!(level(&means) > 0.1, "dunes have feet and crests: {}", level(&means));
    }
}
