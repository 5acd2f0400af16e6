//! Flicker: how much errors change from frame to frame while the eye moves.

use crate::offline::bench::quality::Frame;
use crate::offline::bench::reference::Goal;
use crate::offline::bench::truths::Truths;
use crate::offline::bench::xu::report::{Flicker, Row};
use crate::offline::bench::xu::stills::Kept;
use crate::offline::bench::xu::{Stage, finite};
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

/// What the eye sees along one motion.
struct Path {
    cameras: Vec<Camera>,
    truths: Vec<Picture>,
    masks: Vec<Vec<bool>>,
}

impl Path {
    fn flicker(&self, a: &[Picture], b: &[Picture]) -> Result<f64> {
        let pairs: Vec<Pair<'_>> = a.iter().zip(b).zip(&self.masks).map(|((a, b), mask)| Pair { a, b, mask }).collect();
        finite(measure(&pairs)?, "flicker")
    }
}

/// Truths of both motions.
pub(super) struct Moving {
    paths: [Path; 2],
    extent: [u32; 2],
    /// Of the truths themselves, from their halves.
    pub noise: Flicker,
}

impl Moving {
    /// How long truths took is added to `references`.
    pub fn new(stage: &Stage<'_>, references: &mut f64, told: &mut dyn FnMut(&str, u64, u64)) -> Result<Self> {
        let clock = Instant::now();
        let extent = stage.config.extent.map(|e| e.min(MOST_SIDE));
        let mut path = |motion: Motion| -> Result<(Path, f64)> {
            let cameras: Vec<Camera> = (0..FRAMES).map(|frame| motion.camera(&stage.world.camera, frame)).collect();
            let mut truths = Truths::new(&stage.world, stage.device(), stage.order.cache.as_deref(), SAMPLES / 2);
            let goal = Goal { noise: 0.0, most: SAMPLES.into() };
            let mut path = Path { cameras: Vec::new(), truths: Vec::new(), masks: Vec::new() };
            let mut halves: [Vec<Picture>; 2] = Default::default();
            for (done, camera) in (1..).zip(&cameras) {
                let truth = truths.of(camera, extent, &goal, &mut |_, _| ())?;
                path.truths.push(truth.image().picture);
                path.masks.push(truth.whole());
                halves.iter_mut().zip(truth.halves()).for_each(|(all, half)| all.push(half));
                told("moving truths", done, u64::from(FRAMES));
            }
            // The difference of halves has twice the spread of their mean.
            let noise = path.flicker(&halves[0], &halves[1])? / 2.0;
            Ok((Path { cameras, ..path }, noise))
        };
        let ((zoom, zooming), (orbit, orbiting)) = (path(Motion::Zoom)?, path(Motion::Orbit)?);
        *references += clock.elapsed().as_secs_f64();
        Ok(Self { paths: [zoom, orbit], extent, noise: Flicker { zoom: zooming, orbit: orbiting } })
    }

    /// Flicker of every filter whose session is `kept`, into its row.
    pub fn flicker(
        &self,
        stage: &Stage<'_>,
        rows: &mut [Row],
        kept: &mut [Kept],
        told: &mut dyn FnMut(&str, u64, u64),
    ) -> Result<()> {
        // What is drawn anew in each frame flickers by that.
        let of: Vec<&mut Kept> = kept.iter_mut().filter(|kept| !kept.filter.is_random()).collect();
        let total = of.len() as u64;
        for (done, Kept { filter, session, .. }) in (1..).zip(of) {
            session.resize(self.extent)?;
            let mut world = stage.world.clone();
            let mut found = |path: &Path| -> Result<f64> {
                let mut frames = Vec::new();
                for (number, camera) in (0..).zip(&path.cameras) {
                    world.camera = *camera;
                    session.show(&world)?;
                    session.frame([SEED, number])?;
                    frames.push(Frame::read(session)?.picture);
                }
                path.flicker(&frames, &path.truths)
            };
            let [zoom, orbit] = [found(&self.paths[0])?, found(&self.paths[1])?];
            if let Some(row) = rows.iter_mut().find(|row| row.filter == filter.name()) {
                row.flicker = Some(Flicker { zoom, orbit });
            }
            session.resize(stage.config.extent)?;
            session.show(&stage.world)?;
            told("moving frames", done, total);
        }
        Ok(())
    }
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
