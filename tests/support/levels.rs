//! Random levels and surfaces, and what a frame decided on them, read back into the types of the f64 twin.
#![allow(dead_code, reason = "each test file uses its part")]

use crate::chosen_device::DEVICE;
use glam::{DMat3, DVec3};
use passband::frequency::reconstruction::{self as twin, Pyramid, Sample, Source, Surface};
use passband::offline::headless::{Headless, Options};
use passband::offline::levels;
use passband::offline::scene::Scene;
use passband::offline::session::Session;
use passband::offline::world::World;
use passband::sampling::sobol;
use passband::{Config, Requirements};
use std::collections::BTreeSet;

/// A number in [0, 1) for each `i` of stream `seed`.
pub fn unit(i: usize, seed: u32) -> f64 {
    sobol::to_unit(sobol::random(i as u32, seed)[0])
}

/// Levels 0 to 6 in patches of 1 to 32 samples, with single samples of any level strewn in.
pub fn random_levels([width, height]: [usize; 2], seed: u32) -> Vec<u8> {
    let patch = (unit(0, seed) * 6.0) as usize;
    let noise = unit(1, seed).powi(3);
    let level = |i: usize| (unit(i, seed ^ 0x5bd1) * 7.0) as u8;
    let at = |i: usize| {
        let (x, y) = (i % width, i / width);
        let own = unit(i + 2, seed ^ 0x77aa) < noise;
        if own { level(i) } else { level(((y >> patch) * width + (x >> patch)) ^ 0x00ff_0000) }
    };
    (0..width * height).map(at).collect()
}

/// Balls before a tilted floor, seen by a camera that is nowhere special.
pub fn random_surface(extent: [usize; 2], seed: u32) -> Surface {
    let [width, height] = extent.map(|e| e as f64);
    let tan = 0.3 + 0.5 * unit(0, seed);
    let ray = [tan * width / height, -tan, 0.1 * unit(1, seed), -0.1 * unit(2, seed)];
    let axes = DMat3::from_rotation_y(6.0 * unit(3, seed)) * DMat3::from_rotation_x(unit(4, seed) - 0.5);
    let ball = |k: usize| {
        let [x, y, z] = [5, 6, 7].map(|j| unit(10 * k + j, seed));
        (DVec3::new(2.0 * x - 1.0, 2.0 * y - 1.0, -2.0 - 2.0 * z), 0.2 + 0.5 * unit(10 * k + 8, seed))
    };
    let balls: Vec<_> = (0..1 + (unit(9, seed) * 4.0) as usize).map(ball).collect();
    let tilt = DVec3::new(0.0, 1.0, 0.3 * unit(8, seed)).normalize();
    let seen = |i: usize| {
        let (x, y) = ((i % extent[0]) as f64, (i / extent[0]) as f64);
        let v = DVec3::new(
            ((x + 0.5) / width * 2.0 - 1.0) * ray[0] + ray[2],
            ((y + 0.5) / height * 2.0 - 1.0) * ray[1] + ray[3],
            -1.0,
        );
        let floor = -0.8 / tilt.dot(v);
        let mut nearest = (floor > 0.0 && floor < 8.0).then_some((floor, tilt, 9));
        for (k, (centre, radius)) in balls.iter().enumerate() {
            let (a, b) = (v.length_squared(), v.dot(*centre));
            let root = b * b - a * (centre.length_squared() - radius * radius);
            let depth = (b - root.max(0.0).sqrt()) / a;
            if root > 0.0 && nearest.is_none_or(|(d, ..)| depth < d) {
                nearest = Some((depth, (v * depth - *centre) / *radius, k as u32));
            }
        }
        nearest.map(|(depth, n, object)| Sample { object, depth, normal: axes * n })
    };
    Surface { extent, samples: (0..extent[0] * extent[1]).map(seen).collect(), axes, ray }
}

pub fn session(world: &World, config: &Config) -> Session {
    let options = Options { device: Some(DEVICE.into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(config)).unwrap();
    Session::new(headless, world, config).unwrap()
}

pub fn scene(name: &str) -> World {
    Scene::load(name, &[]).unwrap().resolve().unwrap()
}

/// What the last frame saw.
pub fn surface(session: &mut Session, world: &World, config: &Config) -> Surface {
    let (texels, _, extent) = session.image("surface").unwrap();
    let (ids, ..) = session.image("ids").unwrap();
    let (texels, ids): (Vec<[f32; 4]>, Vec<u32>) = (bytemuck::pod_collect_to_vec(&texels), bytemuck::pod_collect_to_vec(&ids));
    let sample = |([x, y, z, depth], id): (&[f32; 4], &u32)| {
        let object = id.checked_sub(1)? >> 16;
        let normal = DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z));
        Some(Sample { object, depth: f64::from(*depth), normal })
    };
    let tan = (world.camera.fov_y.to_radians() / 2.0).tan();
    let aspect = f64::from(config.extent[0]) / f64::from(config.extent[1]);
    let samples = texels.iter().zip(&ids).map(sample).collect();
    let extent = extent.map(|e| e as usize);
    Surface { extent, samples, axes: world.camera.world_from_view(), ray: [tan * aspect, -tan, 0.0, 0.0] }
}

/// The device's pyramid, sources and values of the last frame.
pub struct Frame {
    pub pyramid: Pyramid,
    pub sources: Vec<Vec<Source>>,
    pub values: Vec<Vec<DVec3>>,
}

impl Frame {
    /// `of` gives extents and depths of the samples, `top` the coarsest level.
    pub fn read(session: &mut Session, of: &Pyramid) -> Self {
        let top = of.extents.len() - 1;
        let (words, blocks) = (session.words("cells").unwrap(), session.words("blocks").unwrap());
        let (weights, counts) = (session.words("weights").unwrap(), session.words("block arguments").unwrap());
        let mut cells = vec![of.cells[0].clone()];
        let mut sources: Vec<_> = of.extents.iter().map(|[w, h]| vec![Source::None; w * h]).collect();
        let mut first = 0;
        for level in 1..=top {
            let [width, height] = of.extents[level];
            let cell = |i: usize| {
                let word = words[2 * (first + i)];
                let place = [i % width, i / width].map(|p| p << level);
                let sample = [place[0] + (word >> 3 & 31) as usize, place[1] + (word >> 8 & 31) as usize];
                let depth = f64::from(f32::from_bits(words[2 * (first + i) + 1]));
                (word & 7 != 7).then_some(twin::Cell { level: word & 7, sample, object: word >> 16, depth })
            };
            cells.push((0..width * height).map(cell).collect());
            for slot in first..first + counts[4 * level + 3] as usize {
                let [x, y] = [blocks[2 * slot] & 0xffff, blocks[2 * slot] >> 16].map(|p| 2 * p as usize);
                let below = of.extents[level - 1];
                for k in 0..4 {
                    let word = weights[4 * slot + k];
                    let [x, y] = [x + k % 2, y + k / 2];
                    let steps = [0, 8, 16].map(|shift| f64::from(word >> shift & 255) / 255.0);
                    let found = twin::Weights { steps, valid: f64::from(word >> 24 & 63) / 63.0 };
                    if word >> 30 == 0 {
                        continue;
                    }
                    let source = &mut sources[level - 1][y * below[0] + x];
                    assert_eq!(*source, Source::None, "decided twice");
                    *source = match (word >> 30, word & 0x3fff_ffff) {
                        (1, 0) => Source::Shading,
                        (1, _) => Source::Refused(found),
                        _ => Source::Parents(found),
                    };
                }
            }
            first += width * height;
        }
        let mut listed = BTreeSet::new();
        for ([x, y], level) in levels::shaded(session).unwrap() {
            assert!(listed.insert((level, x, y)), "{x}, {y} is listed twice at level {level}");
            let at = [x, y].map(|p| p as usize >> level);
            if level as usize == top {
                sources[top][at[1] * of.extents[top][0] + at[0]] = Source::Shading;
            }
        }
        let pyramid = Pyramid { extents: of.extents.clone(), cells };
        let mut shaded = BTreeSet::new();
        for (level, sources) in (0u32..).zip(&sources) {
            let width = of.extents[level as usize][0];
            for (i, _) in sources.iter().enumerate().filter(|(_, source)| source.is_shaded()) {
                let [x, y] = pyramid.cell(level, [i % width, i / width]).unwrap().sample.map(|p| p as u32);
                shaded.insert((level, x, y));
            }
        }
        assert_eq!(listed, shaded, "the list and the sources");
        let images = ["radiance", "odd"].map(|name| {
            let (bytes, _, [width, _]) = session.image(name).unwrap();
            (bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&bytes), width as usize)
        });
        let value = |(level, &[width, height]): (usize, &[usize; 2])| {
            let (texels, stride) = &images[level % 2];
            let row: usize = (level % 2..level).step_by(2).map(|l| of.extents[l][1]).sum();
            let at = |i: usize| texels[(row + i / width) * stride + i % width].map(f64::from);
            (0..width * height).map(|i| DVec3::from_slice(&at(i)[..3])).collect()
        };
        let values = of.extents.iter().enumerate().map(value).collect();
        Self { pyramid, sources, values }
    }

    /// Whether the device decided as the twin did: borderline shares may fall either way.
    pub fn agrees(&self, expected: &[Vec<Source>]) {
        let parts = |w: &twin::Weights| {
            let [top, bottom, down] = w.steps;
            [(1.0 - top) * (1.0 - down), top * (1.0 - down), (1.0 - bottom) * down, bottom * down]
        };
        let close = |a: &twin::Weights, b: &twin::Weights| {
            let near = parts(a).into_iter().zip(parts(b)).all(|(a, b)| (a - b).abs() < 2.02 / 255.0);
            near && (a.valid - b.valid).abs() < 0.51 / 63.0
        };
        for (level, (got, expected)) in self.sources.iter().zip(expected).enumerate() {
            for (i, pair) in got.iter().zip(expected).enumerate() {
                let fits = match pair {
                    (Source::Parents(a), Source::Parents(b)) => close(a, b),
                    // Of parents without weight nothing is left but their share; without that it looks like never asked.
                    (Source::Refused(a), Source::Refused(b)) => (a.valid - b.valid).abs() < 0.51 / 63.0,
                    (Source::Shading, Source::Refused(b)) => b.valid < 0.51 / 63.0,
                    (Source::Parents(a), Source::Refused(b)) | (Source::Refused(a), Source::Parents(b)) => {
                        close(a, b) && (b.valid - twin::ACCEPT).abs() < 1e-4
                    }
                    (a, b) => a == b,
                };
                assert!(fits, "level {level}, cell {i}: {pair:?}");
            }
        }
    }

    /// Up-samples the device's own shaded values as the device decided.
    pub fn checked_values(&self, surface: &Surface) {
        let width = |level: u32| self.pyramid.extents[level as usize][0];
        let shade = |sample: [usize; 2], level: u32| {
            let [x, y] = sample.map(|p| p >> level);
            self.values[level as usize][y * width(level) + x]
        };
        let values = twin::upsample(&self.pyramid, &self.sources, shade);
        for (i, sample) in surface.samples.iter().enumerate() {
            assert_eq!(sample.is_some(), values[0][i].is_some(), "sample {i}");
        }
        let largest = values.iter().flatten().flatten().fold(0.0, |m: f64, v| m.max(v.max_element()));
        for (level, (got, expected)) in self.values.iter().zip(&values).enumerate() {
            for (i, (got, expected)) in got.iter().zip(expected).enumerate() {
                if let Some(expected) = expected {
                    let error = (*got - *expected).abs().max_element();
                    assert!(
                        error <= 1e-6 * expected.max_element() + 1e-7 * largest,
                        "level {level}, cell {i}: {got} for {expected}"
                    );
                }
            }
        }
    }
}
