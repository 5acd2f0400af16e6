//! From a checked scene file to everything in memory.

use crate::offline::animation::Placement;
use crate::offline::error::{Error, Result};
use crate::offline::gltf;
use crate::offline::mesh::{self, Mesh, Projection};
use crate::offline::scene::format::{Camera as CameraKeys, Object as ObjectKeys, Triple, Vector};
use crate::offline::scene::maps::{self, Displacement, Textures};
use crate::offline::scene::source::Span;
use crate::offline::scene::{Scene, lights, materials};
use crate::offline::world::{Camera, EnvironmentLight, Material, Object, World};
use crate::offline::{builtin, environment};
use glam::{DMat4, DQuat, DVec3, EulerRot};
use std::collections::HashMap;
use std::sync::Arc;
use toml::Spanned;

/// The world as the file has it, and which of the file's objects each of its objects is of.
pub(super) fn world(scene: &Scene) -> Result<(World, Vec<usize>)> {
    let file = &scene.file;
    let mut models = materials::Models::default();
    let mut textures = Textures::default();
    let mut all = Vec::new();
    let mut known = Known::default();
    for (name, material) in &file.materials {
        let keys = material.get_ref();
        let model = models.get(scene, keys.reflectance.get_ref())?;
        let (maps, displacement) = textures.of(scene, keys, &model)?;
        all.push(Material { name: name.clone(), model, maps });
        known.displacements.push(displacement);
    }
    drop(textures);
    let (mut objects, mut sources) = (Vec::new(), Vec::new());
    let mut file_camera = None;
    for (source, spanned) in file.objects.get_ref().iter().enumerate() {
        let object = spanned.get_ref();
        let transform = transform(object);
        if let Some(name) = &object.material {
            // Known since the check; the names are the map's own.
            let material = file.materials.keys().position(|known| known == name.get_ref()).unwrap_or_default();
            let mesh = known.mesh(scene, object, (material, all.get(material)))?;
            objects.push(Object { mesh, transform: transform.as_mat4(), material });
        }
        if object.is_gltf() && (object.material.is_none() || (file.camera.is_none() && file_camera.is_none())) {
            let model = known.model(scene, spanned, &mut all)?;
            file_camera = file_camera.or(model.camera.map(|camera| moved(camera, transform)));
            if object.material.is_none() {
                let placed = |(mesh, material): &(Arc<Mesh>, usize)| Object {
                    mesh: Arc::clone(mesh),
                    transform: transform.as_mat4(),
                    material: *material,
                };
                objects.extend(model.primitives.iter().map(placed));
            }
        }
        sources.resize(objects.len(), source);
    }
    let own = file.camera.as_ref().map(camera);
    let none = || scene.source.missing(&(0..0), "camera", "a table, as no glTF mesh has a perspective camera");
    let camera = own.or(file_camera).ok_or_else(none)?;
    let world = World {
        name: scene.name.clone(),
        camera,
        size: file.camera.as_ref().and_then(|camera| camera.size.as_ref()).map(|size| *size.get_ref()),
        environment: environment_light(scene)?,
        lights: lights::lights(file),
        shadows: lights::shadows(file, &scene.folder)?,
        objects,
        materials: all,
    };
    Ok((world, sources))
}

fn camera(keys: &CameraKeys) -> Camera {
    Camera { position: keys.position(), target: keys.target(), up: keys.up(), fov_y: number(&keys.fov_y, 40.0) }
}

/// A file's camera, placed like the file's object.
fn moved(camera: Camera, transform: DMat4) -> Camera {
    let point = |p| transform.transform_point3(p);
    let up = transform.transform_vector3(camera.up);
    Camera { position: point(camera.position), target: point(camera.target), up, ..camera }
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

/// Meshes that have been loaded or made so far: one that several objects use is there once.
#[derive(Default)]
struct Known {
    meshes: HashMap<String, Arc<Mesh>>,
    models: HashMap<String, Arc<Parts>>,
    /// Of the scene's own materials.
    displacements: Vec<Option<Displacement>>,
}

/// A glTF file with its own materials.
struct Parts {
    /// With indices into the world's materials.
    primitives: Vec<(Arc<Mesh>, usize)>,
    camera: Option<Camera>,
}

impl Known {
    /// The whole mesh of an object, as its material wants it.
    fn mesh(&mut self, scene: &Scene, object: &ObjectKeys, (index, material): (usize, Option<&Material>)) -> Result<Arc<Mesh>> {
        let name = |key: &Option<Spanned<String>>| key.as_ref().map_or(String::new(), |name| name.get_ref().clone());
        let detail = object.detail.as_ref().map_or(builtin::DEFAULT_DETAIL, |d| *d.get_ref());
        let key = format!("{} {} {} {detail}", name(&object.mesh), name(&object.builtin), name(&object.uv));
        if !self.meshes.contains_key(&key) {
            let mut mesh = match &object.mesh {
                Some(file) => mesh::read(&scene.folder.join(file.get_ref()))?,
                None => builtin::mesh(&name(&object.builtin), detail)?,
            };
            project(&mut mesh, scene, object)?;
            self.meshes.insert(key.clone(), Arc::new(mesh));
        }
        let plain = self.meshes.get(&key).map(Arc::clone).unwrap_or_default();
        let (Some(material), Some(at)) = (material, &object.material) else { return Ok(plain) };
        let displacement = self.displacements.get(index).and_then(Option::as_ref);
        let key = match displacement {
            Some(_) => format!("{key} displaced by {}", material.name),
            None if maps::wants_tangents(material) && plain.tangents.is_empty() => format!("{key} with tangents"),
            None => key,
        };
        let misfit = |lack| unfit(scene, &at.span(), material, lack);
        maps::fits(&plain, material, displacement).map_err(misfit)?;
        if !self.meshes.contains_key(&key) {
            let mut mesh = (*plain).clone();
            maps::prepare(&mut mesh, material, displacement);
            self.meshes.insert(key.clone(), Arc::new(mesh));
        }
        Ok(self.meshes.get(&key).map_or(plain, Arc::clone))
    }

    /// The parts of a glTF object, whose materials are added to `materials` the first time; only its camera if the object
    /// has a material of the scene.
    fn model(&mut self, scene: &Scene, object: &Spanned<ObjectKeys>, materials: &mut Vec<Material>) -> Result<Arc<Parts>> {
        let (at, object) = (object.span(), object.get_ref());
        let name = object.mesh.as_ref().map_or("", |file| file.get_ref());
        let key = format!("{name} {}", object.uv.as_ref().map_or("", |uv| uv.get_ref()));
        if let Some(parts) = self.models.get(&key) {
            return Ok(Arc::clone(parts));
        }
        let path = scene.folder.join(name);
        let file = gltf::read(&path)?;
        if object.material.is_some() {
            return Ok(Arc::new(Parts { primitives: Vec::new(), camera: file.camera }));
        }
        let first = materials.len();
        materials.extend(gltf::shaded(&path, &file.materials)?);
        let mut primitives = Vec::new();
        for mut primitive in file.primitives {
            project(&mut primitive.mesh, scene, object)?;
            let material = first + primitive.material;
            if let Some(m) = materials.get(material) {
                maps::fits(&primitive.mesh, m, None).map_err(|lack| unfit(scene, &at, m, lack))?;
                maps::prepare(&mut primitive.mesh, m, None);
            }
            primitives.push((Arc::new(primitive.mesh), material));
        }
        let parts = Arc::new(Parts { primitives, camera: file.camera });
        self.models.insert(key, Arc::clone(&parts));
        Ok(parts)
    }
}

/// That an object's mesh lacks what the textures of its material need.
fn unfit(scene: &Scene, at: &Span, material: &Material, lack: &str) -> Error {
    let expected = format!("a mesh with texture coordinates, or `uv`, for the maps of material `{}`", material.name);
    scene.source.error(at, expected, lack)
}

/// Gives a mesh the texture coordinates that its object asks for, in the place of its own.
fn project(mesh: &mut Mesh, scene: &Scene, object: &ObjectKeys) -> Result<()> {
    let Some(uv) = &object.uv else { return Ok(()) };
    let Some(projection) = Projection::named(uv.get_ref()) else { return Ok(()) };
    mesh.generate_uvs(projection, mesh::cache_folder().as_deref()).map_err(|e| match e {
        Error::Argument { expected, got, .. } => scene.source.error(&uv.span(), expected, got),
        other => other,
    })
}

/// World from object: as placed, or as given.
fn transform(object: &ObjectKeys) -> DMat4 {
    object.transform.as_ref().map_or_else(|| placement(Some(object)).transform(), |t| DMat4::from_cols_array(t.get_ref()))
}

/// Where an object without a matrix is.
pub(super) fn placement(object: Option<&ObjectKeys>) -> Placement {
    let vector = |key: Option<&Spanned<Vector>>| key.map_or(DVec3::ZERO, |v| DVec3::from(*v.get_ref()));
    let Triple(scale) = object.and_then(|o| o.scale.as_ref()).map_or(Triple([1.0; 3]), |v| *v.get_ref());
    Placement {
        translate: vector(object.and_then(|o| o.translate.as_ref())),
        rotate: rotation(vector(object.and_then(|o| o.rotate.as_ref()))),
        scale: DVec3::from(scale),
    }
}

/// Of degrees about X, then Y, then Z.
pub(super) fn rotation(degrees: DVec3) -> DQuat {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    DQuat::from_euler(EulerRot::ZYX, z, y, x)
}

fn number(key: &Option<Spanned<f64>>, default: f64) -> f64 {
    key.as_ref().map_or(default, |v| *v.get_ref())
}
