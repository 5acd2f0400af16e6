//! Animation of a scene file: the rules of its keys, and what they make of a world.

use crate::offline::animation::{AnimatedWorld, CameraMotion, Motion, Moving, Track};
use crate::offline::error::Result;
use crate::offline::mesh::Wave;
use crate::offline::scene::check::{Check, span};
use crate::offline::scene::format::{AnimatedObject, Animation, CameraKey, Key, ObjectKey, SceneFile, Triple, Vector};
use crate::offline::scene::{Scene, resolve};
use crate::offline::world::{Camera, Object, World};
use glam::DVec3;
use std::sync::Arc;
use toml::Spanned;

/// The most frames that a scene may have: more than an hour at 24 a second.
pub const MAX_FRAMES: u32 = 100_000;

impl Check<'_> {
    pub(super) fn animation(&mut self, animation: &Animation, file: &SceneFile) -> Result<()> {
        let frames = *animation.frames.get_ref();
        let fits = (1..=MAX_FRAMES).contains(&frames);
        self.require(fits, &animation.frames.span(), &format!("1 to {MAX_FRAMES} frames"), frames)?;
        let mut last = None;
        for key in &animation.camera {
            self.frame(&key.frame, frames, &mut last)?;
            self.each(&key.position, Self::vector)?;
            self.each(&key.target, Self::vector)?;
            self.each(&key.up, Self::direction)?;
            self.each(&key.fov_y, |c, v| c.number(v, "0 < degrees < 180", |v| v > 0.0 && v < 180.0))?;
        }
        let mut known = Vec::new();
        for object in &animation.objects {
            self.index(&object.object, file, &mut known)?;
            let index = *object.object.get_ref() as usize;
            let own = file.objects.get_ref().get(index).and_then(|o| span(&o.get_ref().transform));
            self.require(own.is_none(), &object.object.span(), "an object without a transform", "one with it")?;
            self.object_keys(&object.keyframes, frames)?;
        }
        let Some(wave) = &animation.wave else { return Ok(()) };
        self.number(&wave.amplitude, "0 to 1e6 metres", |v| (0.0..=1e6).contains(&v))?;
        self.number(&wave.length, "1e-6 to 1e6 metres", |v| (1e-6..=1e6).contains(&v))?;
        self.number(&wave.speed, "-1e6 to 1e6 metres a frame", |v| v.abs() <= 1e6)?;
        self.each(&wave.direction, Self::direction)?;
        let mut known = Vec::new();
        wave.objects.iter().flatten().try_for_each(|index| self.index(index, file, &mut known))
    }

    fn object_keys(&mut self, keys: &[ObjectKey], frames: u32) -> Result<()> {
        let (mut last, mut scale): (_, Option<Vector>) = (None, None);
        for key in keys {
            self.frame(&key.frame, frames, &mut last)?;
            self.each(&key.translate, Self::vector)?;
            self.each(&key.rotate, Self::vector)?;
            self.each(&key.scale, |c, v| {
                c.scale(v)?;
                let Triple(now) = *v.get_ref();
                let flips = scale.is_some_and(|before| before.iter().zip(&now).any(|(a, b)| a.signum() != b.signum()));
                scale = Some(now);
                c.require(!flips, &v.span(), "factors of the signs that the key before has", format!("{now:?}"))
            })?;
        }
        Ok(())
    }

    /// An object's number, named once.
    fn index(&self, value: &Spanned<u32>, file: &SceneFile, known: &mut Vec<u32>) -> Result<()> {
        let (index, count) = (*value.get_ref(), file.objects.get_ref().len());
        self.require((index as usize) < count, &value.span(), &format!("an index below {count}"), index)?;
        self.require(!known.contains(&index), &value.span(), "each object once", index)?;
        known.push(index);
        Ok(())
    }

    /// A keyframe's number: within the animation and after the one before.
    fn frame(&self, value: &Spanned<u32>, frames: u32, last: &mut Option<u32>) -> Result<()> {
        let frame = *value.get_ref();
        let fits = frame < frames && last.is_none_or(|last| frame > last);
        self.require(fits, &value.span(), &format!("rising frames below {frames}"), frame)?;
        *last = Some(frame);
        Ok(())
    }
}

/// The world of a checked scene with what changes in it; `sources` says for each of its objects which of the file's it is of.
pub(super) fn animated(scene: &Scene, world: World, sources: &[usize]) -> Result<AnimatedWorld> {
    let still = |o: &Object| Moving { rest: Arc::clone(&o.mesh), motion: None, wave: None };
    let mut objects: Vec<_> = world.objects.iter().map(still).collect();
    let Some(animation) = scene.file.animation.as_ref().map(Spanned::get_ref) else {
        return Ok(AnimatedWorld::new(world, None, None, objects));
    };
    let motions: Vec<_> = animation.objects.iter().map(|o| (*o.object.get_ref(), motion(scene, o))).collect();
    for (object, source) in objects.iter_mut().zip(sources) {
        object.motion = motions.iter().find(|(index, _)| *index as usize == *source).map(|(_, motion)| Arc::clone(motion));
        let Some(keys) = &animation.wave else { continue };
        let all = keys.objects.is_none();
        let named = keys.objects.iter().flatten().any(|index| *index.get_ref() as usize == *source);
        object.wave = (all || named).then(|| Wave {
            amplitude: *keys.amplitude.get_ref(),
            length: *keys.length.get_ref(),
            speed: *keys.speed.get_ref(),
            direction: keys.direction.as_ref().map_or(DVec3::X, |v| DVec3::from(*v.get_ref())),
        });
    }
    let camera = camera(scene, animation, world.camera)?;
    Ok(AnimatedWorld::new(world, Some(*animation.frames.get_ref()), camera, objects))
}

fn motion(scene: &Scene, object: &AnimatedObject) -> Arc<Motion> {
    let of = scene.file.objects.get_ref().get(*object.object.get_ref() as usize);
    let own = resolve::placement(of.map(Spanned::get_ref));
    Arc::new(Motion {
        own,
        translate: track(&object.keyframes, |k| vector(&k.frame, &k.translate)),
        rotate: track(&object.keyframes, |k| vector(&k.frame, &k.rotate).map(|(f, v)| (f, resolve::rotation(v)))),
        scale: track(&object.keyframes, |k| k.scale.as_ref().map(|v| (*k.frame.get_ref(), DVec3::from(v.get_ref().0)))),
    })
}

/// The camera's motion, if it has any. It must look somewhere in every frame.
fn camera(scene: &Scene, animation: &Animation, own: Camera) -> Result<Option<CameraMotion>> {
    let keys = &animation.camera;
    let motion = CameraMotion {
        own,
        position: track(keys, |k| vector(&k.frame, &k.position)),
        target: track(keys, |k| vector(&k.frame, &k.target)),
        up: track(keys, |k| vector(&k.frame, &k.up)),
        fov_y: track(keys, |k| k.fov_y.as_ref().map(|v| (*k.frame.get_ref(), *v.get_ref()))),
    };
    let frames = if keys.is_empty() { 0 } else { *animation.frames.get_ref() };
    match (0..frames).find(|frame| !looks(&motion.at(*frame))) {
        Some(frame) => {
            // The key that leads there.
            let at = |k: &&CameraKey| *k.frame.get_ref() <= frame;
            let at = keys.iter().rev().find(at).or(keys.first()).map_or(0..0, |k| k.frame.span());
            let expected = "a target away from the position and up across the view in every frame";
            Err(scene.source.error(&at, expected, format!("none in frame {frame}")))
        }
        None => Ok((frames > 0).then_some(motion)),
    }
}

/// Whether a camera has a view direction and an up that is not along it.
fn looks(camera: &Camera) -> bool {
    let view = camera.target - camera.position;
    let across = view.normalize_or_zero().cross(camera.up.normalize_or_zero());
    view.length() > 1e-9 && across.length() > 1e-6
}

fn vector(frame: &Spanned<u32>, key: &Key<Vector>) -> Option<(u32, DVec3)> {
    key.as_ref().map(|v| (*frame.get_ref(), DVec3::from(*v.get_ref())))
}

fn track<K, T>(keys: &[K], value: impl Fn(&K) -> Option<(u32, T)>) -> Track<T> {
    Track(keys.iter().filter_map(value).collect())
}
