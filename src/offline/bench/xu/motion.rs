//! Flicker: how much errors change from frame to frame while the eye moves.

use crate::offline::bench::quality::Frame;
use crate::offline::bench::reference::Goal;
use crate::offline::bench::xu::report::{Flicker, Report, Row};
use crate::offline::bench::xu::stills::Kept;
use crate::offline::bench::xu::truths::Truths;
use crate::offline::bench::xu::{Stage, finite, stills};
use crate::offline::error::Result;
use crate::offline::metrics::{Pair, Picture, flicker as measure};
use crate::offline::world::Camera;
use glam::DQuat;
use std::time::Instant;

/// Of each motion.
pub const FRAMES: u32 = 16;
/// The most pixels a side of a frame; no more than stills have.
const MOST_SIDE: u32 = 128;
/// Joint sub-samples of each truth: fewer than of a still, as there are many. What their noise makes of flicker is reported.
const SAMPLES: u32 = 512;
/// Of frames.
const SEED: u32 = 4;

/// How the eye moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    /// From 0.7 to 1.4 times the scene's distance from its target, in equal ratios.
    Zoom,
    /// A degree a frame about the vertical through its target.
    Orbit,
}

impl Motion {
    fn camera(self, camera: &Camera, frame: u32) -> Camera {
        let offset = camera.position - camera.target;
        let along = f64::from(frame) / f64::from(FRAMES - 1);
        let moved = match self {
            Self::Zoom => offset * 0.7 * 2f64.powf(along),
            Self::Orbit => {
                let degrees = f64::from(FRAMES - 1) * (along - 0.5);
                DQuat::from_axis_angle(camera.up.normalize(), degrees.to_radians()) * offset
            }
        };
        Camera { position: camera.target + moved, ..*camera }
    }
}

/// Flicker of every filter that took the still, in the session that is `kept` of it, into its row; and that of truths, from their halves.
pub(super) fn flicker(
    stage: &Stage<'_>,
    rows: &mut [Row],
    kept: &mut [Kept],
    report: &mut Report,
    told: &mut dyn FnMut(&str, u64, u64),
) -> Result<Flicker> {
    let mut found: Vec<[f64; 2]> = vec![[0.0; 2]; kept.len()];
    let mut noise = [0.0; 2];
    let frames_of = kept.len() as u64;
    let total = u64::from(FRAMES);
    let extent = stage.config.extent.map(|e| e.min(MOST_SIDE));
    for (which, motion) in [Motion::Zoom, Motion::Orbit].into_iter().enumerate() {
        let cameras: Vec<Camera> = (0..FRAMES).map(|frame| motion.camera(&stage.world.camera, frame)).collect();
        let clock = Instant::now();
        let mut truths = Truths::new(&stage.world, stage.device(), stage.order.cache.as_deref(), SAMPLES / 2);
        let goal = Goal { noise: 0.0, most: SAMPLES.into() };
        let (mut pictures, mut masks, mut halves): (Vec<Picture>, Vec<_>, [Vec<Picture>; 2]) = Default::default();
        for (done, camera) in (0..).zip(&cameras) {
            let truth = truths.of(camera, extent, &goal, &mut |_, _| ())?;
            pictures.push(truth.image().picture);
            masks.push(stills::mask(&truth));
            halves.iter_mut().zip(truth.halves()).for_each(|(all, half)| all.push(half));
            told("moving truths", done + 1, total);
        }
        report.seconds.references += clock.elapsed().as_secs_f64();
        let of = |a: &[Picture], b: &[Picture]| -> Result<f64> {
            let pairs: Vec<Pair<'_>> = a.iter().zip(b).zip(&masks).map(|((a, b), mask)| Pair { a, b, mask }).collect();
            finite(measure(&pairs)?, "flicker")
        };
        // The difference of halves has twice the spread of their mean.
        noise[which] = of(&halves[0], &halves[1])? / 2.0;
        for (done, (Kept { filter, session, .. }, found)) in (1..).zip(kept.iter_mut().zip(&mut found)) {
            // What is drawn anew in each frame flickers by that.
            if !filter.is_random() {
                let mut world = stage.world.clone();
                let mut frames = Vec::new();
                session.resize(extent)?;
                for (number, camera) in (0..).zip(&cameras) {
                    world.camera = *camera;
                    session.show(&world)?;
                    session.frame([SEED, number])?;
                    frames.push(Frame::read(session)?.picture);
                }
                session.resize(stage.config.extent)?;
                session.show(&stage.world)?;
                found[which] = of(&frames, &pictures)?;
            }
            told("moving frames", done, frames_of);
        }
    }
    for (kept, [zoom, orbit]) in kept.iter().zip(found).filter(|(kept, _)| !kept.filter.is_random()) {
        if let Some(row) = rows.iter_mut().find(|row| row.filter == kept.filter.name()) {
            row.flicker = Some(Flicker { zoom, orbit });
        }
    }
    let [zoom, orbit] = noise;
    Ok(Flicker { zoom, orbit })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn the_eye_stays_on_its_target() {
        let camera = Camera { position: DVec3::new(1.0, 2.0, 3.0), target: DVec3::new(0.5, 0.0, 0.0), up: DVec3::Y, fov_y: 40.0 };
        let distance = |motion: Motion, frame| (motion.camera(&camera, frame).position - camera.target).length();
        let own = (camera.position - camera.target).length();
        assert!((distance(Motion::Zoom, 0) / own - 0.7).abs() < 1e-12 && (distance(Motion::Zoom, 15) / own - 1.4).abs() < 1e-12);
        let positions: Vec<_> = (0..FRAMES).map(|frame| Motion::Orbit.camera(&camera, frame)).collect();
        for pair in positions.windows(2) {
            let [a, b] = [0, 1].map(|i| (pair[i].position - camera.target).with_y(0.0).normalize());
            assert!((a.dot(b).acos().to_degrees() - 1.0).abs() < 1e-6 && (pair[1].position.y - 2.0).abs() < 1e-12);
        }
    }
}
