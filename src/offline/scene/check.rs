//! What the values of a scene file may be. Everything is checked first, the keys that this version cannot do yet
//! included; only then is the first of those reported.

use crate::offline::builtin;
use crate::offline::error::Result;
use crate::offline::scene::format::{
    Camera, Environment, Ggx, Material, Object, Reflectance, SceneFile, Sgd, Triple, Vector, Vmf,
};
use crate::offline::scene::source::{Source, Span};
use crate::reflectance::sgd::PARAMETERS;
use crate::reflectance::vmf::MAX_LOBES;
use glam::{DMat4, DVec3};
use std::path::Path;
use toml::Spanned;

/// Checks a whole scene.
pub(super) fn scene(source: &Source, file: &SceneFile) -> Result<()> {
    let mut check = Check { source };
    match &file.camera {
        Some(camera) => check.camera(camera)?,
        None if file.objects.get_ref().iter().any(|object| object.get_ref().is_gltf()) => {}
        None => return Err(source.missing(&(0..0), "camera", "a table, unless a glTF mesh has a camera")),
    }
    if let Some(environment) = &file.environment {
        check.environment(environment)?;
    }
    for light in &file.lights {
        check.light(light)?;
    }
    if file.objects.get_ref().is_empty() {
        return Err(source.error(&file.objects.span(), "at least one object", "none"));
    }
    for object in file.objects.get_ref() {
        check.object(object, file)?;
    }
    for material in file.materials.values() {
        check.material(material.get_ref())?;
    }
    if let Some(animation) = &file.animation {
        check.animation(animation.get_ref(), file)?;
    }
    check.settings(&file.settings)
}

/// The rules for single values.
pub(super) struct Check<'a> {
    pub(super) source: &'a Source,
}

impl Check<'_> {
    fn camera(&mut self, camera: &Camera) -> Result<()> {
        self.vector(&camera.position)?;
        self.each(&camera.target, Self::vector)?;
        self.each(&camera.up, Self::vector)?;
        self.each(&camera.fov_y, |c, v| c.number(v, "0 < degrees < 180", |v| v > 0.0 && v < 180.0))?;
        self.each(&camera.size, |c, size| {
            let fits = size.get_ref().iter().all(|side| (1..=16_384).contains(side));
            c.require(fits, &size.span(), "1 to 16384 pixels a side", format!("{:?}", size.get_ref()))
        })?;
        let view = camera.target() - camera.position();
        let at = camera.target.as_ref().unwrap_or(&camera.position).span();
        self.require(view.length() > 1e-9, &at, "a target away from the position", "the same point")?;
        let up = camera.up();
        let at = camera.up.as_ref().unwrap_or(&camera.position).span();
        let across = view.normalize_or_zero().cross(up.normalize_or_zero()).length();
        self.require(across > 1e-6, &at, "up not parallel to the view direction", format!("up {up}"))
    }

    fn environment(&mut self, environment: &Spanned<Environment>) -> Result<()> {
        let e = environment.get_ref();
        self.one(&environment.span(), &[("map", span(&e.map)), ("builtin", span(&e.builtin))])?;
        self.each(&e.map, |c, v| c.extension(v, &["exr", "hdr"]).map(drop))?;
        self.each(&e.builtin, |c, v| c.name(v, &builtin::ENVIRONMENTS))?;
        self.each(&e.intensity, |c, v| c.number(v, "a number >= 0", |v| v >= 0.0))?;
        self.each(&e.rotation, |c, v| c.number(v, "degrees", |_| true))
    }

    fn object(&mut self, object: &Spanned<Object>, file: &SceneFile) -> Result<()> {
        let o = object.get_ref();
        self.one(&object.span(), &[("mesh", span(&o.mesh)), ("builtin", span(&o.builtin))])?;
        self.each(&o.mesh, |c, v| {
            let stem = v.get_ref().to_lowercase();
            let plain = Spanned::new(v.span(), stem.strip_suffix(".gz").unwrap_or(&stem).to_string());
            c.extension(&plain, &["obj", "ply", "off", "glb", "gltf"]).map(drop)
        })?;
        self.each(&o.builtin, |c, v| c.name(v, &builtin::MESHES))?;
        self.each(&o.detail, |c, v| {
            c.require(o.builtin.is_some(), &v.span(), "a builtin beside it", "none")?;
            c.require((8..=4096).contains(v.get_ref()), &v.span(), "8 to 4096 segments", v.get_ref())
        })?;
        match &o.material {
            None if o.is_gltf() => {}
            None => return Err(self.source.missing(&object.span(), "material", "a name, unless the mesh is glTF")),
            Some(name) if file.materials.contains_key(name.get_ref()) => {}
            Some(name) => {
                let names: Vec<_> = file.materials.keys().map(String::as_str).collect();
                let expected = if names.is_empty() { "a [materials.NAME] table".to_string() } else { names.join(", ") };
                return Err(self.source.error(&name.span(), expected, format!("`{}`", name.get_ref())));
            }
        }
        self.each(&o.uv, |c, v| c.name(v, &["spherical", "box", "atlas"]))?;
        self.each(&o.translate, Self::vector)?;
        self.each(&o.rotate, Self::vector)?;
        self.each(&o.scale, Self::scale)?;
        let Some(transform) = &o.transform else { return Ok(()) };
        let parts = [span(&o.translate), span(&o.rotate), span(&o.scale)].into_iter().flatten().next();
        if let Some(part) = parts {
            return Err(self.source.error(&part, "no translate, rotate or scale beside transform", "both"));
        }
        let matrix = DMat4::from_cols_array(transform.get_ref());
        let affine = matrix.is_finite() && matrix.row(3).to_array() == [0.0, 0.0, 0.0, 1.0];
        let fits = affine && matrix.determinant().abs() > f64::MIN_POSITIVE;
        let expected = "an invertible column-major matrix whose last row is 0 0 0 1";
        self.require(fits, &transform.span(), expected, format!("{:?}", transform.get_ref()))?;
        let fits = transform.get_ref().iter().all(|c| single(*c)) && (1e-36..=1e36).contains(&matrix.determinant().abs());
        let expected = "a matrix in single precision, with a determinant between 1e-36 and 1e36";
        self.require(fits, &transform.span(), expected, format!("{:?}", transform.get_ref()))
    }

    fn material(&mut self, material: &Material) -> Result<()> {
        self.reflectance(&material.reflectance)?;
        self.maps(material)
    }

    fn reflectance(&mut self, reflectance: &Spanned<Reflectance>) -> Result<()> {
        let r = reflectance.get_ref();
        let choices = [
            ("merl", span(&r.merl)),
            ("sgd", span(&r.sgd)),
            ("rgl", span(&r.rgl)),
            ("ggx", span(&r.ggx)),
            ("blinn_phong", span(&r.blinn_phong)),
            ("vmf", span(&r.vmf)),
            ("builtin", span(&r.builtin)),
        ];
        self.one(&reflectance.span(), &choices)?;
        self.each(&r.merl, |c, v| c.text(v))?;
        self.each(&r.ggx, |c, v| c.ggx(v.get_ref()))?;
        self.each(&r.sgd, Self::sgd)?;
        self.each(&r.rgl, |c, v| c.extension(v, &["bsdf"]).map(drop))?;
        self.each(&r.blinn_phong, |c, v| {
            c.number(&v.get_ref().exponent, "a number >= 0", |v| v >= 0.0)?;
            c.fraction(&v.get_ref().specular)?;
            c.fraction(&v.get_ref().albedo)
        })?;
        self.each(&r.vmf, Self::vmf)
    }

    /// A row of a table, or every parameter.
    fn sgd(&mut self, sgd: &Spanned<Sgd>) -> Result<()> {
        let keys = sgd.get_ref();
        let mut given = PARAMETERS.into_iter().zip(keys.parameters());
        if let (Some(table), Some(name)) = (&keys.table, &keys.name) {
            self.extension(table, &["csv"])?;
            self.text(name)?;
            return match given.find_map(|(_, key)| span(key)) {
                Some(at) => Err(self.source.error(&at, "no parameters beside table", "both")),
                None => Ok(()),
            };
        }
        let lonely = [("name", &keys.table), ("table", &keys.name)];
        for (missing, key) in lonely {
            self.each(key, |c, v| c.require(false, &v.span(), &format!("a {missing} beside it"), "none"))?;
        }
        match given.find(|(_, key)| key.is_none()) {
            Some((missing, _)) => {
                let expected = format!("table and name, or {}", PARAMETERS.join(", "));
                Err(self.source.error(&sgd.span(), expected, format!("no {missing}")))
            }
            None => Ok(()),
        }
    }

    fn vmf(&mut self, lobes: &Spanned<Vec<Vmf>>) -> Result<()> {
        let count = lobes.get_ref().len();
        let expected = format!("1 to {MAX_LOBES} lobes");
        self.require((1..=MAX_LOBES).contains(&count), &lobes.span(), &expected, count)?;
        for lobe in lobes.get_ref() {
            self.direction(&lobe.mu)?;
            self.number(&lobe.kappa, "a number >= 0", |v| v >= 0.0)?;
            self.number(&lobe.weight, "a number >= 0", |v| v >= 0.0)?;
        }
        Ok(())
    }

    fn ggx(&mut self, ggx: &Ggx) -> Result<()> {
        self.number(&ggx.alpha, "0 < alpha <= 1", |v| v > 0.0 && v <= 1.0)?;
        self.fraction(&ggx.f0)?;
        self.fraction(&ggx.albedo)
    }

    /// Applies a rule to a key that is there.
    pub(super) fn each<T>(
        &mut self,
        key: &Option<Spanned<T>>,
        rule: impl FnOnce(&mut Self, &Spanned<T>) -> Result<()>,
    ) -> Result<()> {
        key.as_ref().map_or(Ok(()), |value| rule(self, value))
    }

    pub(super) fn require(&self, fits: bool, at: &Span, expected: &str, got: impl ToString) -> Result<()> {
        if fits { Ok(()) } else { Err(self.source.error(at, expected, got)) }
    }

    pub(super) fn number(&self, value: &Spanned<f64>, expected: &str, fits: impl Fn(f64) -> bool) -> Result<()> {
        let v = *value.get_ref();
        self.require(v.is_finite() && fits(v), &value.span(), expected, v)?;
        self.require(single(v), &value.span(), SINGLE, format!("{v:e}"))
    }

    pub(super) fn vector(&mut self, value: &Spanned<Vector>) -> Result<()> {
        let v = value.get_ref();
        self.require(v.iter().all(|c| c.is_finite()), &value.span(), "three finite numbers", format!("{v:?}"))?;
        self.require(v.iter().all(|c| single(*c)), &value.span(), SINGLE, format!("{v:?}"))
    }

    /// A finite vector that has a direction.
    pub(super) fn direction(&mut self, value: &Spanned<Vector>) -> Result<()> {
        let v = DVec3::from(*value.get_ref());
        let fits = v.is_finite() && v.length() > 0.0;
        self.require(fits, &value.span(), "a finite vector that is not 0", v)?;
        self.require(v.as_vec3().is_finite(), &value.span(), SINGLE, v)
    }

    pub(super) fn scale(&mut self, value: &Spanned<Triple>) -> Result<()> {
        let Triple(v) = value.get_ref();
        let fits = v.iter().all(|c| c.is_finite() && *c != 0.0);
        self.require(fits, &value.span(), "finite factors, none 0", format!("{v:?}"))?;
        // The volume must be a number of single precision, too.
        let sane = v.iter().all(|c| (1e-12..=1e12).contains(&c.abs()));
        self.require(sane, &value.span(), "factors between 1e-12 and 1e12", format!("{v:?}"))
    }

    /// A colour that a surface reflects at most.
    pub(super) fn fraction(&self, value: &Spanned<Triple>) -> Result<()> {
        let Triple(v) = value.get_ref();
        let fits = v.iter().all(|c| (0.0..=1.0).contains(c));
        self.require(fits, &value.span(), "0 to 1 in each channel", format!("{v:?}"))
    }

    pub(super) fn name(&self, value: &Spanned<String>, names: &[&str]) -> Result<()> {
        let known = names.contains(&value.get_ref().as_str());
        self.require(known, &value.span(), &names.join(", "), format!("`{}`", value.get_ref()))
    }

    pub(super) fn text(&self, value: &Spanned<String>) -> Result<()> {
        self.require(!value.get_ref().is_empty(), &value.span(), "a name", "an empty string")
    }

    /// A file name that ends in one of `extensions`; returns which, in lower case.
    pub(super) fn extension(&self, value: &Spanned<String>, extensions: &[&str]) -> Result<String> {
        let found = crate::offline::input::extension(Path::new(value.get_ref()));
        let expected = extensions.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(", ");
        let known = extensions.contains(&found.as_str());
        self.require(known, &value.span(), &format!("a file name that ends in {expected}"), format!("`{}`", value.get_ref()))?;
        Ok(found)
    }

    /// Exactly one of `choices`.
    fn one(&self, table: &Span, choices: &[(&str, Option<Span>)]) -> Result<()> {
        let expected = format!("exactly one of {}", choices.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "));
        let mut given: Vec<_> = choices.iter().filter_map(|(name, span)| Some((*name, span.clone()?))).collect();
        given.sort_by_key(|(_, span)| span.start);
        match given.as_slice() {
            [_] => Ok(()),
            [] => Err(self.source.error(table, expected, "none")),
            [(first, _), (second, at), ..] => Err(self.source.error(at, expected, format!("{first} and {second}"))),
        }
    }
}

/// What is said of numbers that the GPU cannot hold.
pub(super) const SINGLE: &str = "numbers that single precision holds";

/// Whether a number stays finite in single precision.
pub(super) fn single(value: f64) -> bool {
    (value as f32).is_finite()
}

/// Where a key's value stands, if it is there.
pub(super) fn span<T>(key: &Option<Spanned<T>>) -> Option<Span> {
    key.as_ref().map(Spanned::span)
}

impl Object {
    /// Whether the mesh is a file that has materials and cameras of its own.
    pub(super) fn is_gltf(&self) -> bool {
        let name = self.mesh.as_ref().map_or(String::new(), |mesh| mesh.get_ref().to_lowercase());
        let name = name.strip_suffix(".gz").unwrap_or(&name);
        name.ends_with(".glb") || name.ends_with(".gltf")
    }
}

impl Camera {
    pub(super) fn position(&self) -> DVec3 {
        DVec3::from(*self.position.get_ref())
    }

    pub(super) fn target(&self) -> DVec3 {
        self.target.as_ref().map_or(DVec3::ZERO, |v| DVec3::from(*v.get_ref()))
    }

    pub(super) fn up(&self) -> DVec3 {
        self.up.as_ref().map_or(DVec3::Y, |v| DVec3::from(*v.get_ref()))
    }
}
