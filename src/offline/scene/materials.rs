//! Reflectances of a scene's materials: one function a kind.

use crate::offline::error::{At, Error, Result};
use crate::offline::scene::format::{self, Reflectance, Triple};
use crate::offline::scene::source::Span;
use crate::offline::scene::{Scene, bakes};
use crate::offline::{cache, input};
use crate::reflectance::sgd::PARAMETERS;
use crate::reflectance::{BlinnPhong, Ggx, Lobe, MerlTable, Model, Reflectance as _, Rgl, Sgd, Vmf, sgd_table, stand_in};
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;

/// Models that have been made so far: a table that several materials use is read or baked once.
#[derive(Default)]
pub(super) struct Models {
    tables: HashMap<String, Model>,
}

impl Models {
    /// The model of a checked reflectance.
    pub(super) fn get(&mut self, scene: &Scene, keys: &Reflectance) -> Result<Model> {
        if let Some(file) = &keys.merl {
            return self.shared(format!("file {}", file.get_ref()), || read_merl(&scene.folder.join(file.get_ref())).map(table));
        }
        if let Some(name) = &keys.builtin {
            return self.shared(format!("built-in {}", name.get_ref()), || stand_in(scene, name).map(table));
        }
        if let Some(keys) = &keys.sgd {
            let parameters = sgd(scene, keys)?;
            return self.shared(format!("sgd {parameters:?}"), || Ok(table(parameters.bake())));
        }
        if let Some(file) = &keys.rgl {
            return self.shared(format!("rgl {}", file.get_ref()), || rgl(&scene.folder.join(file.get_ref())));
        }
        if let Some(keys) = &keys.ggx {
            return Ok(ggx(keys.get_ref()));
        }
        if let Some(keys) = &keys.blinn_phong {
            return blinn_phong(scene, keys);
        }
        if let Some(keys) = &keys.vmf {
            return vmf(scene, keys);
        }
        // The check lets no other key through.
        Err(Error::NotSupportedYet { what: "this reflectance".to_string() })
    }

    fn shared(&mut self, key: String, make: impl FnOnce() -> Result<Model>) -> Result<Model> {
        if let Some(model) = self.tables.get(&key) {
            return Ok(model.clone());
        }
        let model = make()?;
        self.tables.insert(key, model.clone());
        Ok(model)
    }
}

fn table(table: MerlTable) -> Model {
    Model::Table(Arc::new(table))
}

/// The MERL table `path`.
///
/// # Errors
/// [`Error::File`] with the byte offset of what is wrong.
pub fn read_merl(path: &Path) -> Result<MerlTable> {
    let bytes = input::read(path)?;
    MerlTable::from_bytes(&bytes).map_err(|e| Error::file(path, At::Byte(e.offset), e.field, e.expected, e.got))
}

/// The RGL file `path`.
///
/// # Errors
/// [`Error::File`] with the byte offset of what is wrong.
pub fn read_rgl(path: &Path) -> Result<Rgl> {
    rgl_of(path, &input::read(path)?)
}

fn rgl_of(path: &Path, bytes: &[u8]) -> Result<Rgl> {
    Rgl::from_bytes(bytes).map_err(|e| Error::file(path, At::Byte(e.offset), e.field, e.expected, e.got))
}

/// The row `name` of a CSV table of SGD parameters.
///
/// # Errors
/// [`Error::File`] with the line of what is wrong.
pub fn read_sgd(path: &Path, name: &str) -> Result<Sgd> {
    let bytes = input::read(path)?;
    sgd_table::find(&bytes, name).map_err(|e| Error::file(path, At::Line(e.line), e.field, e.expected, e.got))
}

/// An RGL file as the GPU shades it: one table if it is isotropic, tables over the azimuth if not.
fn rgl(path: &Path) -> Result<Model> {
    let bytes = input::read(path)?;
    let rgl = rgl_of(path, &bytes)?;
    if rgl.isotropic() {
        return Ok(table(rgl.bake()));
    }
    let tables = bakes::turned(&bytes, cache::folder("turned").as_deref(), || rgl.bake_turned())?;
    Ok(Model::Turned(Arc::new(tables)))
}

fn sgd(scene: &Scene, keys: &Spanned<format::Sgd>) -> Result<Sgd> {
    if let (Some(table), Some(name)) = (&keys.get_ref().table, &keys.get_ref().name) {
        return read_sgd(&scene.folder.join(table.get_ref()), name.get_ref());
    }
    // The check has seen every parameter.
    let given = keys.get_ref().parameters();
    let parameters = given.map(|key| key.as_ref().map_or([0.0; 3], |v| v.get_ref().0));
    let sgd = Sgd::from_rows(parameters);
    sgd.validate().map_err(|e| {
        let named = PARAMETERS.into_iter().zip(given).find(|(name, _)| e.to_string().starts_with(&format!("sgd.{name}:")));
        let at = named.and_then(|(_, key)| key.as_ref()).map_or(keys.span(), Spanned::span);
        at_key(scene, &at, e)
    })?;
    Ok(sgd)
}

fn stand_in(scene: &Scene, name: &Spanned<String>) -> Result<MerlTable> {
    let unknown = || scene.source.error(&name.span(), stand_in::names().join(", "), format!("`{}`", name.get_ref()));
    stand_in::table(name.get_ref()).ok_or_else(unknown)
}

fn ggx(keys: &format::Ggx) -> Model {
    Model::Ggx(Ggx { alpha: *keys.alpha.get_ref(), f0: colour(&keys.f0), albedo: colour(&keys.albedo) })
}

fn blinn_phong(scene: &Scene, keys: &Spanned<format::BlinnPhong>) -> Result<Model> {
    let k = keys.get_ref();
    let model = BlinnPhong { exponent: *k.exponent.get_ref(), specular: colour(&k.specular), albedo: colour(&k.albedo) };
    model.validate().map_err(|e| at_key(scene, &k.exponent.span(), e))?;
    Ok(Model::BlinnPhong(model))
}

fn vmf(scene: &Scene, keys: &Spanned<Vec<format::Vmf>>) -> Result<Model> {
    let lobe =
        |l: &format::Vmf| Lobe { mu: DVec3::from(*l.mu.get_ref()), kappa: *l.kappa.get_ref(), weight: *l.weight.get_ref() };
    let lobes: Vec<_> = keys.get_ref().iter().map(lobe).collect();
    let vmf = Vmf::new(&lobes).map_err(|e| at_key(scene, &keys.span(), e))?;
    Ok(Model::Vmf(Arc::new(vmf)))
}

fn colour(value: &Spanned<Triple>) -> DVec3 {
    DVec3::from(value.get_ref().0)
}

/// What a model refuses, as an error of the scene file.
fn at_key(scene: &Scene, span: &Span, error: crate::Error) -> Error {
    match error {
        crate::Error::InvalidInput { expected, got, .. } => scene.source.error(span, expected, got),
        other => other.into(),
    }
}
