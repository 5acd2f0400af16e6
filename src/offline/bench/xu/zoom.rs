//! A scene's own camera motion, frame by frame: how errors change between consecutive frames, and how the sequence looks beside its
//! truth (Tan et al. 2005, figure 4).

use crate::Filter;
use crate::offline::animation::AnimatedWorld;
use crate::offline::bench::quality::Frame;
use crate::offline::bench::reference::Goal;
use crate::offline::bench::suites::Preset;
use crate::offline::bench::truths::Truths;
use crate::offline::bench::xu::cases::Light;
use crate::offline::bench::xu::report::{Zoom, ZoomRow};
use crate::offline::bench::xu::{Stage, finite, open};
use crate::offline::error::Result;
use crate::offline::metrics::{Exposure, Pair, Picture, compare};
use crate::offline::session::Session;
use crate::offline::world::Camera;
use std::time::Instant;

/// Those that are compared, if they are ordered.
const FILTERS: [&str; 5] = ["clusters", "bruteforce", "gmm", "toksvig", "vmf8"];
/// The most pixels a side of a frame; no more than stills have.
const MOST_SIDE: u32 = 128;
/// Frames of one place that are averaged where lobes or directions are drawn.
const DRAWN: u32 = 8;
/// Directions of each of them under an environment that a material does not let be looked up.
const DIRECTIONS: u32 = 64;
/// Of frames.
const SEED: u32 = 5;

impl Preset {
    /// Consecutive frames of an animation.
    fn frames_moving(self) -> u32 {
        match self {
            Self::Quick => 8,
            Self::Full => 64,
        }
    }
}

/// The camera in the first frames of an animation; none if there is none. Objects will not move.
pub(super) fn cameras(animated: &mut AnimatedWorld, preset: Preset) -> Vec<Camera> {
    let frames = animated.frames().unwrap_or_default().min(preset.frames_moving());
    let camera = |frame| {
        animated.show(frame);
        animated.world().camera
    };
    (0..frames).map(camera).collect()
}

/// Joint sub-samples of each truth: under an environment directions are drawn, too.
fn samples(light: Light) -> u32 {
    match light {
        Light::Point => 512,
        Light::Environment => 4096,
    }
}

/// A filter's frames, each the mean of two halves if anything is drawn.
struct Sequence {
    frames: Vec<Picture>,
    halves: Option<[Vec<Picture>; 2]>,
}

/// Every filter along `cameras`; `references` is how long truths took.
pub(super) fn measure(
    stage: &Stage<'_>,
    cameras: &[Camera],
    references: &mut f64,
    told: &mut dyn FnMut(&str, u64, u64),
) -> Result<Zoom> {
    let extent = stage.config.extent.map(|e| e.min(MOST_SIDE));
    let total = cameras.len() as u64;
    let clock = Instant::now();
    let samples = samples(stage.light);
    let mut truths = Truths::new(&stage.world, stage.device(), stage.order.cache.as_deref(), samples / 2);
    let goal = Goal { noise: 0.0, most: samples.into() };
    let (mut pictures, mut masks, mut halves): (Vec<Picture>, Vec<_>, [Vec<Picture>; 2]) = Default::default();
    for (done, camera) in (1..).zip(cameras) {
        let truth = truths.of(camera, extent, &goal, &mut |_, _| ())?;
        pictures.push(truth.image().picture);
        masks.push(truth.whole());
        halves.iter_mut().zip(truth.halves()).for_each(|(all, half)| all.push(half));
        told("truths of the zoom", done, total);
    }
    *references += clock.elapsed().as_secs_f64();
    // Flicker, JOD and colour error.
    let of = |a: &[Picture], b: &[Picture]| -> Result<[f64; 3]> {
        let pairs: Vec<Pair<'_>> = a.iter().zip(b).zip(&masks).map(|((a, b), mask)| Pair { a, b, mask }).collect();
        let found = compare(&pairs, Exposure::Auto, true)?.metrics;
        let jod = finite(found.jod.unwrap_or_default(), "the JOD")?;
        Ok([finite(found.flicker.unwrap_or_default(), "flicker")?, jod, found.color_error])
    };
    let [noise, noise_jod, _] = of(&halves[0], &halves[1])?;
    // The difference of halves has twice the spread of their mean.
    let noise = noise / 2.0;
    let known = stage.order.filters.iter().copied().filter(|f| FILTERS.contains(&f.name()));
    let mut rows = Vec::new();
    for filter in known {
        told(&format!("the zoom by {}", filter.name()), 0, total);
        let row = ZoomRow { filter: filter.name(), refused: None, found: None };
        rows.push(match sequence(stage, filter, extent, cameras)? {
            Ok(sequence) => {
                let [flicker, jod, color_error] = of(&sequence.frames, &pictures)?;
                let own = match &sequence.halves {
                    Some([a, b]) => of(a, b)?[0] / 2.0,
                    None => 0.0,
                };
                row.of([flicker, own, noise], jod, color_error)
            }
            Err(reason) => ZoomRow { refused: Some(reason), ..row },
        });
    }
    let scene = stage.world.name.clone();
    Ok(Zoom { scene, light: stage.light, extent, frames: cameras.len(), samples: samples.into(), noise, noise_jod, rows })
}

/// A session for the frames of one filter, or why there is none; and whether anything is drawn in them: light is looked up,
/// unless a material refuses that.
fn moving(stage: &Stage<'_>, filter: Filter, extent: [u32; 2]) -> Result<(std::result::Result<Session, String>, bool)> {
    if let Some(session) = stage.looked_up(filter, extent)? {
        return Ok((Ok(session), filter.is_random()));
    }
    let drawn = filter.is_random() || stage.light == Light::Environment;
    Ok((open(&stage.world, &stage.config(filter, extent, DIRECTIONS), stage.device())?, drawn))
}

/// The frames of one filter, or why there are none.
fn sequence(
    stage: &Stage<'_>,
    filter: Filter,
    extent: [u32; 2],
    cameras: &[Camera],
) -> Result<std::result::Result<Sequence, String>> {
    let (session, drawn) = moving(stage, filter, extent)?;
    let drawn = if drawn { DRAWN } else { 1 };
    let mut session = match session {
        Ok(session) => session,
        Err(reason) => return Ok(Err(reason)),
    };
    let mut world = stage.world.clone();
    let (mut frames, mut halves) = (Vec::new(), [Vec::new(), Vec::new()]);
    for (number, camera) in (0..).zip(cameras) {
        world.camera = *camera;
        session.show(&world)?;
        if drawn == 1 {
            session.frame([SEED, number])?;
            frames.push(Frame::read(&mut session)?.picture);
            continue;
        }
        let [a, b] = [0, 1].map(|half| mean(&mut session, half * drawn / 2..(half + 1) * drawn / 2, number * drawn));
        let [a, b] = [a?, b?];
        let both = a.rgb.iter().zip(&b.rgb).map(|(a, b)| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c])));
        frames.push(Picture { rgb: both.collect(), ..a });
        halves.iter_mut().zip([a, b]).for_each(|(all, half)| all.push(half));
    }
    Ok(Ok(Sequence { frames, halves: (drawn > 1).then_some(halves) }))
}

/// Of frames whose numbers are `first` and those of `which`.
fn mean(session: &mut Session, which: std::ops::Range<u32>, first: u32) -> Result<Picture> {
    let count = which.len() as f64;
    let mut sums: Vec<[f64; 3]> = Vec::new();
    let mut last = None;
    for number in which {
        session.frame([SEED, first + number])?;
        let picture = Frame::read(session)?.picture;
        sums.resize(picture.rgb.len(), [0.0; 3]);
        sums.iter_mut().zip(&picture.rgb).for_each(|(s, v)| *s = [0, 1, 2].map(|c| s[c] + f64::from(v[c])));
        last = Some((picture.width, picture.height));
    }
    let (width, height) = last.unwrap_or_default();
    Ok(Picture { width, height, rgb: sums.iter().map(|s| s.map(|v| (v / count) as f32)).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::scene::Scene;

    #[test]
    fn the_eye_goes_towards_the_disk_in_small_steps() {
        let mut disk = Scene::load("disk", &[]).unwrap().animated().unwrap();
        let all = cameras(&mut disk, Preset::Full);
        assert_eq!((all.len(), cameras(&mut disk, Preset::Quick).as_slice()), (64, &all[..8]));
        let distance = |camera: &Camera| (camera.position - camera.target).length();
        let steps: Vec<f64> = all.windows(2).map(|w| distance(&w[1]) / distance(&w[0])).collect();
        assert!(steps.iter().all(|s| (0.97..0.999).contains(s)), "{steps:?}");
        let mut still = Scene::load("sphere", &[]).unwrap().animated().unwrap();
        assert!(cameras(&mut still, Preset::Full).is_empty());
    }

    #[test]
    fn noise_is_taken_out_of_flicker() {
        let row = ZoomRow { filter: "clusters", refused: None, found: None };
        let found = row.clone().of([0.13, 0.03, 0.04], 9.6, 0.05).found.unwrap();
        assert!((found.less_noise - 0.12).abs() < 1e-12, "{found:?}");
        assert_eq!(row.of([0.1, 0.1, 0.1], 9.6, 0.05).found.unwrap().less_noise, 0.0);
    }
}
