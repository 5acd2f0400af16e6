//! Reflectances of a scene's materials: one function a kind.

use crate::offline::error::{At, Error, Result};
use crate::offline::input;
use crate::offline::scene::Scene;
use crate::offline::scene::format::{Ggx as GgxKeys, Reflectance};
use crate::reflectance::{Ggx, MerlTable, Model, stand_in};
use glam::DVec3;
use std::collections::HashMap;
use std::sync::Arc;
use toml::Spanned;

/// Models that have been made so far: a table that several materials use is read or baked once.
#[derive(Default)]
pub(super) struct Models {
    tables: HashMap<String, Arc<MerlTable>>,
}

impl Models {
    /// The model of a checked reflectance.
    pub(super) fn get(&mut self, scene: &Scene, keys: &Reflectance) -> Result<Model> {
        if let Some(file) = &keys.merl {
            return self.table(format!("file {}", file.get_ref()), || merl(scene, file.get_ref()));
        }
        if let Some(name) = &keys.builtin {
            return self.table(format!("built-in {}", name.get_ref()), || stand_in(scene, name));
        }
        if let Some(keys) = &keys.ggx {
            return Ok(ggx(keys.get_ref()));
        }
        Err(Error::NotSupportedYet { what: "this reflectance".to_string() })
    }

    fn table(&mut self, key: String, make: impl FnOnce() -> Result<MerlTable>) -> Result<Model> {
        if let Some(table) = self.tables.get(&key) {
            return Ok(Model::Table(Arc::clone(table)));
        }
        let table = Arc::new(make()?);
        self.tables.insert(key, Arc::clone(&table));
        Ok(Model::Table(table))
    }
}

fn merl(scene: &Scene, file: &str) -> Result<MerlTable> {
    let path = scene.folder.join(file);
    let bytes = input::read(&path)?;
    MerlTable::from_bytes(&bytes).map_err(|e| Error::file(&path, At::Byte(e.offset), e.field, e.expected, e.got))
}

fn stand_in(scene: &Scene, name: &Spanned<String>) -> Result<MerlTable> {
    let unknown = || scene.source.error(&name.span(), stand_in::names().join(", "), format!("`{}`", name.get_ref()));
    stand_in::table(name.get_ref()).ok_or_else(unknown)
}

fn ggx(keys: &GgxKeys) -> Model {
    let (f0, albedo) = (DVec3::from(keys.f0.get_ref().0), DVec3::from(keys.albedo.get_ref().0));
    Model::Ggx(Ggx { alpha: *keys.alpha.get_ref(), f0, albedo })
}
