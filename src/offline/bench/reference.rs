//! Converged images, kept on disk by the content of what they show.
//!
//! An image is the mean of many full-rate frames with independent seeds, in two halves whose difference says how noisy it is.
//! An entry's content is: width, height and directions a frame; for each half its number of frames and its mean `R G B A`; all
//! little-endian and of 32 bits. An entry is written every half minute and can be continued.

use crate::offline::bench::quality::{self, Frame, Noise};
use crate::offline::cache;
use crate::offline::error::Result;
use crate::offline::headless::Headless;
use crate::offline::metrics::Picture;
use crate::offline::render::Settings;
use crate::offline::session::Session;
use crate::offline::world::World;
use crate::{Config, Requirements};
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Changes with whatever changes the image of one world.
const VERSION: &str = "passband reference 1";
/// Seed of references; measured frames have others.
const SEED: u32 = 0x7265_6665;
/// Pixels times directions of one frame: half a minute on two cores.
const FRAME_BUDGET: u64 = 1 << 30;
/// The most directions of one frame: longer frames converge faster, as Sobol points do, and two of these are enough for most.
const MOST_DIRECTIONS: u64 = 4096;
/// Time between two saves.
const SAVE_EVERY: Duration = Duration::from_secs(30);

/// The folder of the user's cache in which references are kept; `None` on systems that have none.
pub fn cache_folder() -> Option<PathBuf> {
    cache::folder("reference")
}

/// A pixel is covered wholly from this share of it on.
const WHOLE: f32 = 0.9999;

/// When an image is good enough.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Noise (root mean square, linear) that is low enough.
    pub noise: f64,
    /// Directions a pixel after which it ends in any case.
    pub most: u64,
}

/// The sum of some frames.
#[derive(Clone, Debug, Default, PartialEq)]
struct Half {
    frames: u32,
    /// Row-major `R G B A`.
    sums: Vec<f64>,
}

impl Half {
    fn mean(&self) -> Vec<f32> {
        self.sums.iter().map(|s| (s / f64::from(self.frames.max(1))) as f32).collect()
    }
}

/// A converged image.
#[derive(Clone, Debug, PartialEq)]
pub struct Converged {
    extent: [u32; 2],
    /// Of one frame.
    directions: u32,
    halves: [Half; 2],
    /// Directions a pixel that came from the cache.
    pub cached: u64,
}

impl Converged {
    /// Without frames.
    fn new(extent: [u32; 2]) -> Self {
        let pixels = u64::from(extent[0]) * u64::from(extent[1]);
        let directions = (FRAME_BUDGET / pixels.max(1)).clamp(256, MOST_DIRECTIONS) as u32;
        Self::of(extent, directions)
    }

    /// Without frames, which will be of `directions`.
    pub(super) fn of(extent: [u32; 2], directions: u32) -> Self {
        Self { extent, directions, halves: Default::default(), cached: 0 }
    }

    pub(super) fn frames(&self) -> u32 {
        self.halves.iter().map(|h| h.frames).sum()
    }

    /// Adds row-major `R G B A` to the half that has fewer frames.
    fn add(&mut self, rgba: &[f32]) {
        let [a, b] = &mut self.halves;
        let half = if a.frames <= b.frames { a } else { b };
        half.sums.resize(rgba.len(), 0.0);
        half.sums.iter_mut().zip(rgba).for_each(|(s, v)| *s += f64::from(*v));
        half.frames += 1;
    }

    /// Columns and rows.
    pub fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// Directions a pixel so far.
    pub fn directions(&self) -> u64 {
        u64::from(self.frames()) * u64::from(self.directions)
    }

    /// The mean of all frames.
    pub fn image(&self) -> Frame {
        let [a, b] = &self.halves;
        let total = f64::from(self.frames().max(1));
        let rgba: Vec<f32> = a.sums.iter().zip(&b.sums).map(|(a, b)| ((a + b) / total) as f32).collect();
        Frame::of(self.extent, &rgba)
    }

    /// Covered pixels.
    pub fn mask(&self) -> Vec<bool> {
        self.image().coverage.iter().map(|a| *a > 0.0).collect()
    }

    /// Pixels that surfaces cover wholly: sums are rounded.
    pub fn whole(&self) -> Vec<bool> {
        self.image().coverage.iter().map(|a| *a >= WHOLE).collect()
    }

    /// The means of the halves.
    pub(super) fn halves(&self) -> [Picture; 2] {
        self.halves.each_ref().map(|half| Frame::of(self.extent, &half.mean()).picture)
    }

    /// What noise is left.
    ///
    /// # Errors
    /// Before both halves have a frame, and where no pixel is covered.
    pub fn noise(&self) -> Result<Noise> {
        let [a, b] = &self.halves();
        quality::noise([a, b], &self.mask())
    }

    /// Whether both halves have as many frames, at least one, and the goal is met.
    fn is_enough(&self, goal: &Goal) -> Result<bool> {
        let [a, b] = self.halves.each_ref().map(|h| h.frames);
        if a == 0 || a != b {
            return Ok(false);
        }
        Ok(self.directions() >= goal.most || self.noise()?.rmse <= goal.noise)
    }

    fn to_bytes(&self) -> Vec<u8> {
        let [width, height] = self.extent;
        let head = [width, height, self.directions];
        let half =
            |half: &Half| std::iter::once(half.frames).chain(half.mean().into_iter().map(f32::to_bits)).collect::<Vec<_>>();
        let words = head.into_iter().chain(self.halves.iter().flat_map(half));
        words.flat_map(u32::to_le_bytes).collect()
    }

    /// Nothing unless the entry is of the frames that `new` would make.
    fn from_bytes(content: &[u8], new: &Self) -> Option<Self> {
        let words: Vec<u32> = content.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
        let (head, rest) = words.split_first_chunk::<3>()?;
        let count = 1 + 4 * new.extent[0] as usize * new.extent[1] as usize;
        if *head != [new.extent[0], new.extent[1], new.directions] || rest.len() != 2 * count {
            return None;
        }
        let half = |words: &[u32]| {
            let (frames, means) = words.split_first()?;
            let sum = |word: &u32| f64::from(f32::from_bits(*word)) * f64::from(*frames);
            let half = Half { frames: *frames, sums: means.iter().map(sum).collect() };
            half.sums.iter().all(|s| s.is_finite()).then_some(half)
        };
        let (a, b) = rest.split_at(count);
        let mut found = Self { halves: [half(a)?, half(b)?], ..new.clone() };
        found.cached = found.directions();
        Some(found)
    }
}

/// The converged image of `world` as `base` filters it, one sample a pixel: from the cache as far as it is there, and rendered
/// at full rate with the default estimator until `goal` is met. `progress` is told how many of at most how many directions a
/// pixel are there.
///
/// # Errors
/// The library's or the device's. A cache that cannot be written only costs the time again.
pub fn converge(
    world: &World,
    base: &Settings,
    goal: &Goal,
    folder: Option<&Path>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Converged> {
    let image = Converged::new(base.config.extent);
    let entry = folder.map(|folder| folder.join(format!("{}.reference", key(world, &base.config, &image))));
    let mut session = None;
    refine(image, entry.as_deref(), goal, progress, &mut |image| {
        let session = match &mut session {
            Some(session) => session,
            none => none.insert(open(world, base, image)?),
        };
        session.frame([SEED, image.frames()])?;
        let (bytes, ..) = session.image("resolved")?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    })
}

/// Adds to `image`, or to what `entry` holds of it, the `R G B A` of `next` frames until `goal` is met.
pub(super) fn refine(
    mut image: Converged,
    entry: Option<&Path>,
    goal: &Goal,
    progress: &mut dyn FnMut(u64, u64),
    next: &mut dyn FnMut(&Converged) -> Result<Vec<f32>>,
) -> Result<Converged> {
    if let Some(known) = entry.and_then(|entry| Converged::from_bytes(&cache::read(entry)?, &image)) {
        image = known;
    }
    let (mut saved, mut unsaved) = (Instant::now(), false);
    while !image.is_enough(goal)? {
        let frame = next(&image)?;
        image.add(&frame);
        unsaved = true;
        progress(image.directions(), goal.most.max(image.directions()));
        if let Some(entry) = entry.filter(|_| saved.elapsed() > SAVE_EVERY) {
            cache::keep(entry, &image.to_bytes());
            (saved, unsaved) = (Instant::now(), false);
        }
    }
    if let Some(entry) = entry.filter(|_| unsaved) {
        cache::keep(entry, &image.to_bytes());
    }
    Ok(image)
}

/// Drops what is known of `world`.
pub fn forget(world: &World, base: &Settings, folder: &Path) {
    let name = format!("{}.reference", key(world, &base.config, &Converged::new(base.config.extent)));
    if let Err(e) = std::fs::remove_file(folder.join(name)) {
        log::warn!("a reference is not dropped: {e}");
    }
}

fn open(world: &World, base: &Settings, image: &Converged) -> Result<Session> {
    let config = Config {
        frames_in_flight: 1,
        filter: base.config.filter,
        bins: base.config.bins,
        geometric: base.config.geometric,
        directions: image.directions,
        ..Config::new(image.extent)
    };
    config.validate()?;
    Session::new(Headless::new(&base.device, &Requirements::of(&config))?, world, &config)
}

/// Hashes text as it is written.
#[derive(Default)]
pub(super) struct Hashed(Sha256);

impl Hashed {
    /// The hash so far, in letters.
    pub fn text(self) -> String {
        format!("{:x}", self.0.finalize())
    }
}

impl std::fmt::Write for Hashed {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

/// The name of a world's content. Its debugging text has every number to the last bit, and whatever a world comes to hold.
fn key(world: &World, config: &Config, image: &Converged) -> String {
    let mut hash = Hashed::default();
    let filter = if config.widened() { " widened" } else { "" };
    // A hash takes any text.
    let _ = write!(hash, "{VERSION} {:?} {}{filter} {world:?}", image.extent, image.directions);
    hash.text()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::scene::Scene;

    fn image(frames: u32) -> Converged {
        let mut image = Converged::new([2, 1]);
        for frame in 0..frames {
            let value = if frame % 2 == 0 { 1.0 } else { 1.5 };
            image.add(&[value, 2.0, 0.25, 1.0, 0.0, 0.0, 0.0, 0.0]);
        }
        image
    }

    #[test]
    fn halves_are_averaged_and_say_how_noisy_they_are() {
        let image = image(4);
        assert_eq!(image.directions(), 4 * MOST_DIRECTIONS);
        assert_eq!(image.image().picture.rgb, [[1.25, 2.0, 0.25], [0.0; 3]]);
        assert_eq!(image.mask(), [true, false]);
        // The halves differ by 0.5 in one of three channels.
        assert!((image.noise().unwrap().rmse - 0.25 / 3_f64.sqrt()).abs() < 1e-7);
        assert!(!image.is_enough(&Goal { noise: 0.1, most: 5 * MOST_DIRECTIONS }).unwrap());
        assert!(image.is_enough(&Goal { noise: 0.2, most: 5 * MOST_DIRECTIONS }).unwrap());
        assert!(image.is_enough(&Goal { noise: 0.1, most: 4 * MOST_DIRECTIONS }).unwrap());
        // Halves of different length are not weighed against each other.
        assert!(!super::tests::image(3).is_enough(&Goal { noise: 1.0, most: 1 }).unwrap());
    }

    #[test]
    fn entries_are_continued_and_those_of_other_frames_ignored() {
        let kept = image(4);
        let bytes = kept.to_bytes();
        let new = Converged::new([2, 1]);
        let found = Converged::from_bytes(&bytes, &new).unwrap();
        assert_eq!((&found.halves, found.cached), (&kept.halves, kept.directions()));
        // Damage is found by the cache's own checksum.
        for other in [&bytes[..bytes.len() - 4], &bytes[..20], &[]] {
            assert_eq!(Converged::from_bytes(other, &new), None);
        }
        assert_eq!(Converged::from_bytes(&bytes, &Converged::new([1, 2])), None);
        let mut infinite = kept.clone();
        infinite.halves[0].sums[0] = f64::INFINITY;
        assert_eq!(Converged::from_bytes(&infinite.to_bytes(), &new), None);
    }

    #[test]
    fn another_world_has_another_name() {
        let world = |overrides: &[(&str, &str)]| {
            let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
            Scene::load("sphere", &overrides).and_then(|s| s.resolve()).unwrap()
        };
        let config = Config::new([64, 64]);
        let name = |world: &World| key(world, &config, &Converged::new([64, 64]));
        let plain = name(&world(&[]));
        assert_eq!(plain, name(&world(&[])));
        let others = [
            ("camera.fov_y", "36.0001"),
            ("environment.rotation", "1"),
            ("environment.builtin", "studio"),
            ("objects.0.translate", "[0, 0.001, 0]"),
            ("materials.paint.reflectance.builtin", "rough"),
        ];
        for other in others {
            assert_ne!(plain, name(&world(&[other])), "{other:?}");
        }
        assert_ne!(plain, key(&world(&[]), &config, &Converged::new([64, 65])));
        assert_ne!(plain, key(&world(&[]), &Config { geometric: true, ..config.clone() }, &Converged::new([64, 64])));
    }
}
