//! A world that changes from frame to frame: keyframes and waves.

use crate::offline::mesh::{Mesh, Wave};
use crate::offline::world::{Camera, World};
use glam::{DMat4, DQuat, DVec3};
use std::sync::Arc;

/// Values at rising frames: linear between two of them, the nearest before the first and after the last.
#[derive(Clone, Debug)]
pub(crate) struct Track<T>(pub Vec<(u32, T)>);

impl<T: Copy> Track<T> {
    /// The value in `frame`; `own` if there is none at all. Exact at keys.
    fn at(&self, frame: u32, own: T, between: impl Fn(T, T, f64) -> T) -> T {
        let next = self.0.partition_point(|(key, _)| *key <= frame);
        let before = next.checked_sub(1).and_then(|i| self.0.get(i));
        match (before, self.0.get(next)) {
            (Some(&(a, from)), Some(&(b, to))) if a != frame => between(from, to, f64::from(frame - a) / f64::from(b - a)),
            (Some(&(_, value)), _) | (None, Some(&(_, value))) => value,
            (None, None) => own,
        }
    }
}

/// Where an object is: scaled, then turned, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    pub translate: DVec3,
    pub rotate: DQuat,
    pub scale: DVec3,
}

impl Placement {
    /// World from object.
    pub fn transform(&self) -> DMat4 {
        DMat4::from_scale_rotation_translation(self.scale, self.rotate, self.translate)
    }
}

/// How an object is moved; what has no key stays as it is in `own`.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub own: Placement,
    pub translate: Track<DVec3>,
    /// By the shortest arc.
    pub rotate: Track<DQuat>,
    pub scale: Track<DVec3>,
}

impl Motion {
    fn at(&self, frame: u32) -> Placement {
        Placement {
            translate: self.translate.at(frame, self.own.translate, DVec3::lerp),
            rotate: self.rotate.at(frame, self.own.rotate, DQuat::slerp),
            scale: self.scale.at(frame, self.own.scale, DVec3::lerp),
        }
    }
}

/// As [`Motion`], of the camera.
#[derive(Clone, Debug)]
pub(crate) struct CameraMotion {
    pub own: Camera,
    pub position: Track<DVec3>,
    pub target: Track<DVec3>,
    pub up: Track<DVec3>,
    pub fov_y: Track<f64>,
}

impl CameraMotion {
    pub fn at(&self, frame: u32) -> Camera {
        Camera {
            position: self.position.at(frame, self.own.position, DVec3::lerp),
            target: self.target.at(frame, self.own.target, DVec3::lerp),
            up: self.up.at(frame, self.own.up, DVec3::lerp),
            fov_y: self.fov_y.at(frame, self.own.fov_y, |a, b, t| a + (b - a) * t),
        }
    }
}

/// What changes about an object of the world.
#[derive(Clone, Debug)]
pub(crate) struct Moving {
    /// The mesh without a wave.
    pub rest: Arc<Mesh>,
    pub motion: Option<Arc<Motion>>,
    pub wave: Option<Wave>,
}

/// A world in one of its frames.
#[derive(Clone, Debug)]
pub struct AnimatedWorld {
    world: World,
    frames: Option<u32>,
    camera: Option<CameraMotion>,
    /// One for each of the world's objects.
    objects: Vec<Moving>,
}

impl AnimatedWorld {
    /// `world` with what changes in it, in its first frame; `frames` is `None` if the scene says nothing of time.
    pub(crate) fn new(world: World, frames: Option<u32>, camera: Option<CameraMotion>, objects: Vec<Moving>) -> Self {
        let mut this = Self { world, frames, camera, objects };
        this.show(0);
        this
    }

    /// How many frames there are; `None` if the scene says nothing of time and stays as it is in all of them.
    pub fn frames(&self) -> Option<u32> {
        self.frames
    }

    /// The world as it is in the frame that was last shown.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// As [`Self::world`], for good.
    pub fn into_world(self) -> World {
        self.world
    }

    /// Goes to a frame. Only camera, transforms and the meshes under a wave change. Beyond the last keys their values hold;
    /// waves travel on.
    pub fn show(&mut self, frame: u32) {
        if let Some(motion) = &self.camera {
            self.world.camera = motion.at(frame);
        }
        let mut displaced: Vec<(&Arc<Mesh>, Arc<Mesh>)> = Vec::new();
        for (object, moving) in self.world.objects.iter_mut().zip(&self.objects) {
            if let Some(motion) = &moving.motion {
                object.transform = motion.at(frame).transform().as_mat4();
            }
            let Some(wave) = &moving.wave else { continue };
            // Objects that share a mesh share it under the wave, of which a scene has one.
            let known = displaced.iter().find(|(rest, _)| Arc::ptr_eq(rest, &moving.rest)).map(|(_, mesh)| Arc::clone(mesh));
            object.mesh = known.unwrap_or_else(|| {
                let mesh = Arc::new(wave.displaced(&moving.rest, frame));
                displaced.push((&moving.rest, Arc::clone(&mesh)));
                mesh
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracks_are_exact_at_keys_linear_between_and_hold_beyond() {
        let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let track = Track(vec![(2, 0.1), (5, 0.7), (6, -1.3)]);
        let at = |frame| track.at(frame, 9.0, lerp);
        assert_eq!([0, 2, 5, 6, 100].map(at), [0.1, 0.1, 0.7, -1.3, -1.3]);
        assert!((at(3) - 0.3).abs() < 1e-15 && (at(4) - 0.5).abs() < 1e-15);
        assert_eq!(Track(vec![]).at(3, 9.0, lerp), 9.0);
    }

    #[test]
    fn rotations_take_the_shortest_arc() {
        let turn = |degrees: f64| DQuat::from_rotation_y(degrees.to_radians());
        // From 350 to 10 degrees: over 0, not back over 180; the second quaternion has the other sign.
        for sign in [1.0, -1.0] {
            let own = Placement { translate: DVec3::ZERO, rotate: DQuat::IDENTITY, scale: DVec3::ONE };
            let rotate = Track(vec![(0, turn(350.0)), (4, turn(10.0) * sign)]);
            let motion = Motion { own, translate: Track(vec![]), rotate, scale: Track(vec![]) };
            for (frame, degrees) in [(0, -10.0), (1, -5.0), (2, 0.0), (3, 5.0), (4, 10.0)] {
                let got = motion.at(frame).rotate * DVec3::X;
                assert!(got.distance(turn(degrees) * DVec3::X) < 1e-12, "{frame}: {got}");
            }
            assert_eq!(motion.at(0).rotate, turn(350.0), "exact at keys");
        }
    }
}
