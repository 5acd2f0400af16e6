//! Rules for the keys that the format knows and this version cannot do yet: their values are checked like all others.

use crate::offline::error::Result;
use crate::offline::scene::check::{Check, SINGLE, span};
use crate::offline::scene::format::{Animation, Settings, Vector};
use glam::DVec3;
use toml::Spanned;

impl Check<'_> {
    pub(super) fn animation(&mut self, animation: &Spanned<Animation>, objects: usize) -> Result<()> {
        let a = animation.get_ref();
        let frames = *a.frames.get_ref();
        self.require(frames > 0, &a.frames.span(), "at least one frame", frames)?;
        let mut last = None;
        for key in &a.camera {
            self.frame(&key.frame, frames, &mut last)?;
            self.each(&key.position, Self::vector)?;
            self.each(&key.target, Self::vector)?;
            self.each(&key.up, Self::direction)?;
            self.each(&key.fov_y, |c, v| c.number(v, "0 < degrees < 180", |v| v > 0.0 && v < 180.0))?;
        }
        for object in &a.objects {
            let index = *object.object.get_ref();
            let expected = format!("an index below {objects}");
            self.require((index as usize) < objects, &object.object.span(), &expected, index)?;
            let mut last = None;
            for key in &object.keyframes {
                self.frame(&key.frame, frames, &mut last)?;
                self.each(&key.translate, Self::vector)?;
                self.each(&key.rotate, Self::vector)?;
                self.each(&key.scale, Self::scale)?;
            }
        }
        if let Some(wave) = &a.wave {
            self.number(&wave.amplitude, "a number >= 0", |v| v >= 0.0)?;
            self.number(&wave.length, "a number above 0", |v| v > 0.0)?;
            self.number(&wave.speed, "a finite number", |_| true)?;
        }
        self.later.push(animation.span());
        Ok(())
    }

    pub(super) fn settings(&mut self, s: &Settings) -> Result<()> {
        self.each(&s.operator, |c, v| c.name(v, &["box", "clipped", "covariance"]))?;
        self.each(&s.combine, |c, v| c.name(v, &["mean", "max"]))?;
        self.each(&s.np_rule, |c, v| c.name(v, &["constant", "eq8", "sqrt", "relstd"]))?;
        self.each(&s.bins, |c, v| c.name(v, &["camera", "tangent"]))?;
        for threshold in [&s.eps, &s.eps0, &s.eps1] {
            self.each(threshold, |c, v| c.number(v, "0 < threshold < 1", |v| v > 0.0 && v < 1.0))?;
        }
        let directions = "a whole number from 1 to 65536";
        self.each(&s.budget, |c, v| c.require((1..=65536).contains(v.get_ref()), &v.span(), directions, v.get_ref()))?;
        self.each(&s.lmax, |c, v| c.require(*v.get_ref() <= 5, &v.span(), "a level from 0 to 5", v.get_ref()))?;
        self.each(&s.anisotropy, |c, v| c.number(v, "1 to 16", |v| (1.0..=16.0).contains(&v)))?;
        self.each(&s.lod_bias, |c, v| c.number(v, "-16 to 16", |v| v.abs() <= 16.0))?;
        let all = [span(&s.eps), span(&s.bins), span(&s.eps0), span(&s.eps1), span(&s.anisotropy), span(&s.lod_bias)];
        self.later.extend(all.into_iter().flatten());
        Ok(())
    }

    /// A finite vector that has a direction.
    pub(super) fn direction(&mut self, value: &Spanned<Vector>) -> Result<()> {
        let v = DVec3::from(*value.get_ref());
        let fits = v.is_finite() && v.length() > 0.0;
        self.require(fits, &value.span(), "a finite vector that is not 0", v)?;
        self.require(v.as_vec3().is_finite(), &value.span(), SINGLE, v)
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
