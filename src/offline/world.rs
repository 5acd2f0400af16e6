//! A scene that has been read and resolved: everything in memory, ready to be uploaded or integrated.

use crate::offline::mesh::Mesh;
use crate::offline::shadows::Shadows;
use crate::reflectance::Model;
use crate::sampling::LatLong;
use crate::{Light, Maps};
use glam::{DMat3, DMat4, DVec2, DVec3, Mat4};
use std::sync::Arc;

/// A pinhole camera with square pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Eye point.
    pub position: DVec3,
    /// Point at the image's centre.
    pub target: DVec3,
    /// Up, not parallel to the view direction.
    pub up: DVec3,
    /// Vertical field of view in degrees.
    pub fov_y: f64,
}

impl Camera {
    /// Columns right, up, backward in world space: the view looks along its own -z.
    pub fn world_from_view(&self) -> DMat3 {
        let back = (self.position - self.target).normalize();
        let right = self.up.cross(back).normalize();
        DMat3::from_cols(right, back.cross(right), back)
    }

    /// Unit world direction through `pixel` (x right, y down, centres at +0.5) of an image of `extent` pixels.
    pub fn ray(&self, pixel: DVec2, extent: [u32; 2]) -> DVec3 {
        let [w, h] = extent.map(f64::from);
        let t = (self.fov_y.to_radians() / 2.0).tan();
        let ndc = DVec2::new(2.0 * pixel.x / w - 1.0, 1.0 - 2.0 * pixel.y / h);
        (self.world_from_view() * DVec3::new(ndc.x * t * w / h, ndc.y * t, -1.0)).normalize()
    }
}

/// A distant environment and how it is used.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    /// Radiance over the sphere.
    pub map: LatLong,
    /// Factor on the map.
    pub intensity: f64,
    /// Degrees about +Y: the map's direction `w` lights the scene from `R_y(rotation) w`.
    pub rotation: f64,
    /// Whether the background shows it.
    pub visible: bool,
}

impl EnvironmentLight {
    /// Radiance that arrives from world direction `w` (unit).
    pub fn radiance(&self, w: DVec3) -> DVec3 {
        self.map.radiance(DMat3::from_rotation_y(-self.rotation.to_radians()) * w) * self.intensity
    }
}

/// One mesh in the world.
#[derive(Clone, Debug)]
pub struct Object {
    /// Shared geometry.
    pub mesh: Arc<Mesh>,
    /// World from object.
    pub transform: Mat4,
    /// Index into [`World::materials`].
    pub material: usize,
}

impl Object {
    /// World from object in f64.
    pub fn transform(&self) -> DMat4 {
        self.transform.as_dmat4()
    }
}

/// A named material.
#[derive(Clone, Debug)]
pub struct Material {
    /// The scene file's name for it.
    pub name: String,
    /// Its reflectance.
    pub model: Model,
    /// What varies it over a surface.
    pub maps: Maps,
}

impl Material {
    /// Without the name.
    pub fn surface(&self) -> crate::Material {
        crate::Material::new(self.model.clone(), self.maps.clone())
    }
}

/// A whole scene, resolved.
#[derive(Clone, Debug)]
pub struct World {
    /// The scene file's stem or the built-in's name.
    pub name: String,
    /// The camera.
    pub camera: Camera,
    /// Image size that the scene asks for, if it does.
    pub size: Option<[u32; 2]>,
    /// The distant environment, if any.
    pub environment: Option<EnvironmentLight>,
    /// Lights beside it.
    pub lights: Vec<Light>,
    /// What shadows them, as the camera sees it.
    pub shadows: Option<Arc<Shadows>>,
    /// Objects in scene order.
    pub objects: Vec<Object>,
    /// Materials, indexed by the objects.
    pub materials: Vec<Material>,
}

impl World {
    /// Nothing but a camera.
    pub fn empty(name: &str, camera: Camera) -> Self {
        Self {
            name: name.into(),
            camera,
            size: None,
            environment: None,
            lights: Vec::new(),
            shadows: None,
            objects: Vec::new(),
            materials: Vec::new(),
        }
    }
}
