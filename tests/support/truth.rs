//! Images of more samples a pixel than a renderer takes.

use crate::chosen_device::DEVICE;
use passband::offline::bench::quality::Frame;
use passband::offline::headless::{Headless, Options};
use passband::offline::metrics::Picture;
use passband::offline::session::Session;
use passband::offline::world::World;
use passband::{Config, Rate, Requirements};

/// Seed of truths; frames that are judged have others.
const SEED: u32 = 0x7472_7574;

/// Every pixel from 64 samples, each shaded by `directions` directions: 16 samples a pixel of an image of twice the size, of
/// which each 2x2 pixels are averaged in linear light. The samples of both sizes stand on one regular grid, finer here.
pub fn supersampled(world: &World, extent: [u32; 2], directions: u32) -> Frame {
    let config =
        Config { frames_in_flight: 1, samples_per_side: 4, rate: Rate::Full, directions, ..Config::new(extent.map(|e| 2 * e)) };
    let options = Options { device: Some(DEVICE.into()), validate: false };
    let headless = Headless::new(&options, &Requirements::of(&config)).unwrap();
    let mut session = Session::new(headless, world, &config).unwrap();
    session.frame([SEED, 0]).unwrap();
    halved(&Frame::read(&mut session).unwrap())
}

/// Half the size by the mean of 2x2 pixels.
fn halved(frame: &Frame) -> Frame {
    let [width, height] = [frame.picture.width / 2, frame.picture.height / 2];
    let four = |i: u32| {
        let first = i / width * 2 * frame.picture.width + i % width * 2;
        [0, 1, frame.picture.width, frame.picture.width + 1].map(|offset| (first + offset) as usize)
    };
    let mean = |value: &dyn Fn(usize) -> f32, i| four(i).into_iter().map(value).sum::<f32>() / 4.0;
    let pixels = || 0..width * height;
    let rgb = pixels().map(|i| [0, 1, 2].map(|c| mean(&|p| frame.picture.rgb[p][c], i))).collect();
    let coverage = pixels().map(|i| mean(&|p| frame.coverage[p], i)).collect();
    Frame { picture: Picture { width, height, rgb }, coverage }
}
