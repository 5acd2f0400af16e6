//! Lights of a scene file: their rules, and the lights themselves.

use crate::offline::error::Result;
use crate::offline::scene::check::{Check, single, span};
use crate::offline::scene::format::{Key, Light, SceneFile, Triple, Vector};
use crate::offline::shadows::Shadows;
use crate::offline::texture;
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;

impl Check<'_> {
    pub(super) fn light(&mut self, light: &Spanned<Light>) -> Result<()> {
        let l = light.get_ref();
        let given = [
            ("position", span(&l.position)),
            ("direction", span(&l.direction)),
            ("u", span(&l.u)),
            ("v", span(&l.v)),
            ("radius", span(&l.radius)),
            ("intensity", span(&l.intensity)),
            ("irradiance", span(&l.irradiance)),
            ("radiance", span(&l.radiance)),
        ];
        self.name(&l.r#type, &["point", "directional", "sphere", "rectangle"])?;
        let wanted: &[&str] = match l.r#type.get_ref().as_str() {
            "point" => &["position", "intensity"],
            "directional" => &["direction", "irradiance"],
            "sphere" => &["position", "radius", "radiance"],
            _ => &["position", "u", "v", "radiance"],
        };
        let expected = format!("{} of a {} light", wanted.join(", "), l.r#type.get_ref());
        for (name, at) in given {
            match at {
                None if wanted.contains(&name) => {
                    return Err(self.source.error(&light.span(), expected, format!("no {name}")));
                }
                Some(at) if !wanted.contains(&name) => return Err(self.source.error(&at, expected, name)),
                _ => {}
            }
        }
        self.each(&l.position, Self::vector)?;
        for vector in [&l.direction, &l.u, &l.v] {
            self.each(vector, Self::direction)?;
        }
        if let (Some(u), Some(v)) = (&l.u, &l.v) {
            let spans = DVec3::from(*u.get_ref()).cross(DVec3::from(*v.get_ref())).length() > 1e-10;
            self.require(spans, &light.span(), "half-edges u and v that span an area", "parallel ones")?;
        }
        self.each(&l.radius, |c, v| c.number(v, "a number above 0", |v| v > 0.0))?;
        for colour in [&l.intensity, &l.irradiance, &l.radiance] {
            self.each(colour, |c, v| {
                let Triple(rgb) = v.get_ref();
                let fits = rgb.iter().all(|c| single(*c) && *c >= 0.0);
                c.require(fits, &v.span(), "finite channels >= 0", format!("{rgb:?}"))
            })?;
        }
        self.each(&l.shadow, |c, v| c.extension(v, &texture::EXTENSIONS).map(drop))
    }
}

/// Their masks, of files under `folder`.
///
/// # Errors
/// Of the files.
pub(super) fn shadows(file: &SceneFile, folder: &Path) -> Result<Option<Arc<Shadows>>> {
    let masks: Vec<_> = file.lights.iter().map(|l| l.get_ref().shadow.as_ref().map(|file| folder.join(file.get_ref()))).collect();
    Ok(Shadows::read(masks.iter().map(Option::as_deref))?.map(Arc::new))
}

/// The lights of a checked file.
pub(super) fn lights(file: &SceneFile) -> Vec<crate::Light> {
    let vector = |key: &Key<Vector>| key.as_ref().map_or([0.0; 3], |v| v.get_ref().map(|c| c as f32));
    let colour = |key: &Key<Triple>| key.as_ref().map_or([0.0; 3], |v| v.get_ref().0.map(|c| c as f32));
    let light = |l: &Light| match l.r#type.get_ref().as_str() {
        "point" => crate::Light::Point { position: vector(&l.position), intensity: colour(&l.intensity) },
        "directional" => crate::Light::Directional { direction: vector(&l.direction), irradiance: colour(&l.irradiance) },
        "sphere" => crate::Light::Sphere {
            position: vector(&l.position),
            radius: l.radius.as_ref().map_or(0.0, |r| *r.get_ref() as f32),
            radiance: colour(&l.radiance),
        },
        _ => crate::Light::Rectangle {
            position: vector(&l.position),
            u: vector(&l.u),
            v: vector(&l.v),
            radiance: colour(&l.radiance),
        },
    };
    file.lights.iter().map(|l| light(l.get_ref())).collect()
}
