//! What this host draws: two meshes, two materials, a sky and a camera. Nothing here concerns Vulkan.

use glam::{DVec3, Mat4, Vec3, Vec4, dvec3, vec3};
use passband::reflectance::{Ggx, Model};
use passband::sampling::{LatLong, latlong};
use passband::{Error, Material, View};

/// Near plane in metres; `HOST_NEAR` of `bridge/gbuffer.glsl`.
pub const NEAR: f32 = 0.1;
/// The eye, what it looks at, and the vertical field of view in degrees.
pub const EYE: DVec3 = dvec3(1.5, 1.2, 3.5);
pub const TARGET: DVec3 = dvec3(0.0, -0.2, 0.0);
pub const FOV_Y: f64 = 45.0;

/// A triangle mesh, its place and its material.
pub struct Object {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub indices: Vec<u32>,
    pub offset: Vec3,
    pub material: u32,
}

impl Object {
    pub fn world_from_object(&self) -> Mat4 {
        Mat4::from_translation(self.offset)
    }
}

/// A ball on a floor.
pub fn objects() -> [Object; 2] {
    let (columns, rows) = (48u32, 24u32);
    let ball: Vec<[f32; 3]> = (0..=rows)
        .flat_map(|row| (0..=columns).map(move |column| (row, column)))
        .map(|(row, column)| {
            let (v, u) = (f64::from(row) / f64::from(rows), f64::from(column) / f64::from(columns));
            latlong::direction(glam::dvec2(u, v)).as_vec3().to_array()
        })
        .collect();
    let cell = |row: u32, column: u32| {
        let (a, b) = (row * (columns + 1) + column, (row + 1) * (columns + 1) + column);
        [a, b, a + 1, a + 1, b, b + 1]
    };
    let indices = (0..rows).flat_map(|row| (0..columns).flat_map(move |column| cell(row, column))).collect();
    let floor = [[-4.0, 0.0, -4.0], [4.0, 0.0, -4.0], [-4.0, 0.0, 2.0], [4.0, 0.0, 2.0]];
    [
        Object { positions: ball.clone(), normals: ball, indices, offset: vec3(0.2, 0.0, 0.0), material: 0 },
        Object {
            positions: floor.to_vec(),
            normals: vec![[0.0, 1.0, 0.0]; 4],
            indices: vec![0, 2, 1, 1, 2, 3],
            offset: vec3(0.0, -1.0, 0.0),
            material: 1,
        },
    ]
}

/// By the objects' material numbers.
pub fn materials() -> [Material; 2] {
    let ggx = |alpha, f0, albedo| Material::from(Model::Ggx(Ggx { alpha, f0, albedo }));
    [
        ggx(0.3, dvec3(0.9, 0.6, 0.3), DVec3::ZERO), //
        ggx(0.5, DVec3::splat(0.04), dvec3(0.3, 0.35, 0.4)),
    ]
}

/// A smooth sky over dark ground, brighter towards +x.
pub fn sky() -> Result<LatLong, Error> {
    let (width, height) = (64, 32);
    let texel = |i: u32| {
        let uv = glam::dvec2((f64::from(i % width) + 0.5) / 64.0, (f64::from(i / width) + 0.5) / 32.0);
        let w = latlong::direction(uv);
        let blue = dvec3(0.5, 0.7, 1.0).lerp(dvec3(2.0, 1.8, 1.5), 0.5 + 0.5 * w.x);
        (blue * (0.55 + 0.45 * w.y)).as_vec3().to_array()
    };
    LatLong::new(width, height, (0..width * height).map(texel).collect())
}

/// The camera for an image of `extent` pixels: reversed depth, no far plane.
pub fn view(extent: [u32; 2]) -> View {
    let back = (EYE - TARGET).normalize();
    let right = DVec3::Y.cross(back).normalize();
    let column = |v: DVec3, w: f32| v.as_vec3().extend(w);
    let world_from_view =
        Mat4::from_cols(column(right, 0.0), column(back.cross(right), 0.0), column(back, 0.0), column(EYE, 1.0));
    let scale = 1.0 / (FOV_Y.to_radians() / 2.0).tan();
    let aspect = f64::from(extent[0]) / f64::from(extent[1]);
    let clip_from_view = Mat4::from_cols(
        Vec4::new((scale / aspect) as f32, 0.0, 0.0, 0.0),
        Vec4::new(0.0, -scale as f32, 0.0, 0.0), // Vulkan's y points down
        Vec4::new(0.0, 0.0, 0.0, -1.0),
        Vec4::new(0.0, 0.0, NEAR, 0.0),
    );
    View { world_from_view: world_from_view.to_cols_array(), clip_from_view: clip_from_view.to_cols_array() }
}
