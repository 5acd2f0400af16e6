//! From a checked scene file to everything in memory.

use crate::offline::error::Result;
use crate::offline::mesh::{self, Mesh};
use crate::offline::scene::format::{Object as ObjectKeys, Triple};
use crate::offline::scene::{Scene, lights, materials};
use crate::offline::world::{Camera, EnvironmentLight, Material, Object, World};
use crate::offline::{builtin, environment};
use glam::{DMat4, DQuat, DVec3, EulerRot};
use std::collections::HashMap;
use std::sync::Arc;
use toml::Spanned;

pub(super) fn world(scene: &Scene) -> Result<World> {
    let file = &scene.file;
    let camera = Camera {
        position: file.camera.position(),
        target: file.camera.target(),
        up: file.camera.up(),
        fov_y: number(&file.camera.fov_y, 40.0),
    };
    let mut models = materials::Models::default();
    let mut all = Vec::new();
    for (name, material) in &file.materials {
        let model = models.get(scene, material.get_ref().reflectance.get_ref())?;
        all.push(Material { name: name.clone(), model });
    }
    let mut meshes = HashMap::new();
    let mut objects = Vec::new();
    for object in file.objects.get_ref() {
        let object = object.get_ref();
        let mesh = shared_mesh(scene, object, &mut meshes)?;
        // Known since the check; the names are the map's own.
        let material = file.materials.keys().position(|name| name == object.material.get_ref()).unwrap_or_default();
        objects.push(Object { mesh, transform: transform(object).as_mat4(), material });
    }
    Ok(World {
        name: scene.name.clone(),
        camera,
        size: file.camera.size.as_ref().map(|size| *size.get_ref()),
        environment: environment_light(scene)?,
        lights: lights::lights(file),
        objects,
        materials: all,
    })
}

fn environment_light(scene: &Scene) -> Result<Option<EnvironmentLight>> {
    let Some(keys) = scene.file.environment.as_ref().map(Spanned::get_ref) else { return Ok(None) };
    let map = match (&keys.map, &keys.builtin) {
        (Some(map), _) => environment::read(&scene.folder.join(map.get_ref()))?,
        (None, Some(name)) => builtin::environment(name.get_ref(), builtin::DEFAULT_WIDTH)?,
        (None, None) => return Ok(None),
    };
    let intensity = number(&keys.intensity, 1.0);
    Ok(Some(EnvironmentLight { map, intensity, rotation: number(&keys.rotation, 0.0), visible: keys.visible }))
}

/// The object's mesh; one that several objects use is loaded once.
fn shared_mesh(scene: &Scene, object: &ObjectKeys, meshes: &mut HashMap<String, Arc<Mesh>>) -> Result<Arc<Mesh>> {
    let (key, file, name) = match (&object.mesh, &object.builtin) {
        (Some(file), _) => (format!("file {}", file.get_ref()), Some(file.get_ref()), ""),
        (None, name) => {
            let name = name.as_ref().map_or("", |name| name.get_ref().as_str());
            (format!("built-in {name}"), None, name)
        }
    };
    if let Some(mesh) = meshes.get(&key) {
        return Ok(Arc::clone(mesh));
    }
    let mesh = Arc::new(match file {
        Some(file) => mesh::read_obj(&scene.folder.join(file))?,
        None => builtin::mesh(name, builtin::DEFAULT_DETAIL)?,
    });
    meshes.insert(key, Arc::clone(&mesh));
    Ok(mesh)
}

/// World from object: scaled, turned about X, then Y, then Z, then moved; or as given.
fn transform(object: &ObjectKeys) -> DMat4 {
    if let Some(transform) = &object.transform {
        return DMat4::from_cols_array(transform.get_ref());
    }
    let translate = object.translate.as_ref().map_or(DVec3::ZERO, |v| DVec3::from(*v.get_ref()));
    let degrees = object.rotate.as_ref().map_or(DVec3::ZERO, |v| DVec3::from(*v.get_ref()));
    let Triple(scale) = object.scale.as_ref().map_or(Triple([1.0; 3]), |v| *v.get_ref());
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    let rotation = DQuat::from_euler(EulerRot::ZYX, z, y, x);
    DMat4::from_scale_rotation_translation(DVec3::from(scale), rotation, translate)
}

fn number(key: &Option<Spanned<f64>>, default: f64) -> f64 {
    key.as_ref().map_or(default, |v| *v.get_ref())
}
