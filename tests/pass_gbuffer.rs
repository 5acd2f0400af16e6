//! The rasterised G-buffer and the curvature pass against closed forms in f64.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;

use common::{assert_clean, headless};
use glam::{DVec2, DVec3, DVec4, EulerRot, Mat4, Quat, Vec3, dvec2, dvec3, vec3};
use half::f16;
use passband::offline::builtin;
use passband::offline::mesh::Mesh;
use passband::offline::session::Session;
use passband::offline::world::{Camera, Material, Object, World};
use passband::reflectance::frame;
use passband::{Config, Maps};
use std::collections::HashSet;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const EXTENT: [u32; 2] = [96, 72];

/// One covered sample.
#[derive(Clone, Copy)]
struct Sample {
    pixel: [u32; 2],
    normal: DVec3,
    depth: f64,
    object: u32,
    material: u32,
    uv: DVec2,
    /// Tangent and handedness.
    tangent: Option<(DVec3, f64)>,
    /// d(uv)/dx, d(uv)/dy
    footprint: DVec4,
    curvature: DVec2,
    /// World position by the sample's ray and depth.
    position: DVec3,
    /// Cosine between normal and viewer.
    facing: f64,
}

fn camera(position: DVec3) -> Camera {
    Camera { position, target: DVec3::ZERO, up: DVec3::Y, fov_y: 40.0 }
}

/// The covered samples of one validated frame of `objects` (mesh, transform, material).
fn render(camera: Camera, objects: Vec<(Mesh, Mat4, usize)>) -> Vec<Sample> {
    let config = Config { directions: 2, curvature: true, coordinates: true, ..Config::new(EXTENT) };
    let material = |i: i32| Material { name: format!("{i}"), model: common::rig::grey(), maps: Default::default() };
    let world = World {
        name: "test".into(),
        camera,
        size: None,
        environment: None,
        lights: Vec::new(),
        shadows: None,
        objects: objects
            .into_iter()
            .map(|(mesh, transform, material)| Object { mesh: Arc::new(mesh), transform, material })
            .collect(),
        materials: (0..3).map(material).collect(),
    };
    let mut session = Session::new(headless(&config), &world, &config).unwrap();
    session.frame([0, 0]).unwrap();
    let mut read = |name: &str| session.image(name).unwrap().0;
    let surface: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&read("surface"));
    let ids: Vec<u32> = bytemuck::pod_collect_to_vec(&read("ids"));
    let coordinate: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&read("coordinate"));
    let derivative: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&read("derivative"));
    let curvature: Vec<[f16; 4]> = bytemuck::pod_collect_to_vec(&read("curvature"));
    assert_clean(&session.messages());
    let forward = (camera.target - camera.position).normalize();
    let sample = |i: usize| {
        let pixel = [i as u32 % EXTENT[0], i as u32 / EXTENT[0]];
        let ray = camera.ray(dvec2(f64::from(pixel[0]) + 0.5, f64::from(pixel[1]) + 0.5), EXTENT);
        let [x, y, z, depth] = surface[i].map(f64::from);
        Sample {
            pixel,
            normal: dvec3(x, y, z),
            depth,
            object: (ids[i] - 1) >> 16,
            material: (ids[i] - 1) & 0xffff,
            uv: dvec2(coordinate[i][0].into(), coordinate[i][1].into()),
            tangent: frame::decode(dvec3(x, y, z), coordinate[i][2].into()),
            footprint: DVec4::from(derivative[i].map(f64::from)),
            curvature: dvec2(curvature[i][0].to_f64(), curvature[i][1].to_f64()),
            position: camera.position + ray * (depth / ray.dot(forward)),
            facing: -dvec3(x, y, z).dot(ray),
        }
    };
    (0..ids.len()).filter(|&i| ids[i] != 0).map(sample).collect()
}

fn ray(camera: &Camera, pixel: [u32; 2]) -> DVec3 {
    camera.ray(dvec2(f64::from(pixel[0]) + 0.5, f64::from(pixel[1]) + 0.5), EXTENT)
}

/// The largest of `error` over `samples`, with a lower bound on how many there are.
#[track_caller]
fn worst<'a>(samples: impl Iterator<Item = &'a Sample>, least: usize, error: impl Fn(&Sample) -> f64) -> f64 {
    let errors: Vec<f64> = samples.map(error).collect();
    assert!(errors.len() >= least, "{} samples", errors.len());
    // NaN is the worst of all.
    errors.into_iter().fold(0.0, |a, b| if b <= a { a } else { b })
}

/// Where the unit-parameter ray meets a sphere, if it does.
fn meet(origin: DVec3, ray: DVec3, centre: DVec3, radius: f64) -> Option<DVec3> {
    let to = centre - origin;
    let along = to.dot(ray);
    let square = along * along - to.length_squared() + radius * radius;
    (square > 0.0).then(|| origin + ray * (along - square.sqrt()))
}

/// Texture coordinates of the built-in sphere in direction `d`.
fn sphere_uv(d: DVec3) -> DVec2 {
    dvec2(0.5 + d.x.atan2(d.z) / TAU, 1.0 - d.y.acos() / PI)
}

#[test]
fn spheres_agree_with_intersected_rays() {
    let (centre, radius) = (dvec3(0.3, -0.2, 0.1), 0.8);
    let camera = camera(dvec3(0.5, 0.6, 3.0));
    let transform = Mat4::from_translation(centre.as_vec3()) * Mat4::from_scale(vec3(0.8, 0.8, 0.8));
    let samples = render(camera, vec![(builtin::mesh("sphere", 1024).unwrap(), transform, 2)]);

    // Coverage: every pixel whose ray meets the sphere, but for the silhouette, where facets cut up to 4e-6 off.
    let met = |pixel| meet(camera.position, ray(&camera, pixel), centre, radius);
    let expected = (0..EXTENT[0] * EXTENT[1]).filter(|i| met([i % EXTENT[0], i / EXTENT[0]]).is_some()).count();
    assert!(samples.len().abs_diff(expected) <= 2, "{} covered, {expected} expected", samples.len());

    assert!(samples.iter().all(|s| s.object == 0 && s.material == 2));
    let forward = (camera.target - camera.position).normalize();
    // Vertices snap to 1/256 of a pixel, here 1e-4 m: positions and normals measure 4e-5 off.
    let inner = || samples.iter().filter(|s| s.facing > 0.2);
    let error = worst(inner(), 1000, |s| met(s.pixel).unwrap().distance(s.position));
    assert!(error < 1e-4, "position {error}");
    let error = worst(inner(), 1000, |s| ((met(s.pixel).unwrap() - camera.position).dot(forward) - s.depth).abs());
    assert!(error < 1e-4, "depth {error}");
    let error = worst(inner(), 1000, |s| ((met(s.pixel).unwrap() - centre) / radius).distance(s.normal));
    assert!(error < 1e-4, "normal {error}");
    assert!(worst(samples.iter(), 1000, |s| (s.normal.length() - 1.0).abs()) < 1e-6);

    // Curvatures of a sphere are both one over its radius, up to what central differences see.
    let error =
        worst(samples.iter().filter(|s| s.facing > 0.5), 700, |s| (s.curvature * radius - DVec2::ONE).abs().max_element());
    assert!(error < 0.005, "curvature {error}");
    assert!(samples.iter().all(|s| s.curvature.x.abs() >= s.curvature.y.abs()));

    // Texture coordinate, and (by facets, each with its own slope: 7 % measured) its derivative between the two pixels of a quad, each way.
    let uv = |pixel| met(pixel).map(|p| sphere_uv((p - centre) / radius));
    let error = worst(inner(), 1000, |s| uv(s.pixel).unwrap().distance(s.uv));
    assert!(error < 1e-4, "uv {error}");
    let difference = |s: &Sample, axis: usize| {
        let (mut a, mut b) = (s.pixel, s.pixel);
        (a[axis], b[axis]) = (s.pixel[axis] & !1, s.pixel[axis] | 1);
        uv(b).unwrap() - uv(a).unwrap()
    };
    let error = worst(samples.iter().filter(|s| s.facing > 0.5), 700, |s| {
        let (dx, dy) = (difference(s, 0), difference(s, 1));
        let truth = DVec4::new(dx.x, dx.y, dy.x, dy.y);
        (s.footprint - truth).length() / truth.length()
    });
    assert!(error < 0.1, "footprint {error}");
}

#[test]
fn planes_agree_with_intersected_rays() {
    let camera = camera(dvec3(0.4, 1.5, 2.0));
    let samples = render(camera, vec![(builtin::mesh("plane", 64).unwrap(), Mat4::IDENTITY, 1)]);
    assert!(samples.iter().all(|s| s.object == 0 && s.material == 1 && s.normal == DVec3::Y));
    let hit = |pixel| {
        let ray = ray(&camera, pixel);
        camera.position - ray * (camera.position.y / ray.y)
    };
    let uv = |pixel| {
        let p = hit(pixel);
        dvec2(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.z)
    };
    let error = worst(samples.iter(), 1000, |s| hit(s.pixel).distance(s.position));
    assert!(error < 1e-5, "position {error}");
    let error = worst(samples.iter(), 1000, |s| uv(s.pixel).distance(s.uv));
    assert!(error < 1e-5, "uv {error}");
    let error = worst(samples.iter(), 1000, |s| {
        let [x, y] = s.pixel;
        let (dx, dy) = (uv([x | 1, y]) - uv([x & !1, y]), uv([x, y | 1]) - uv([x, y & !1]));
        let truth = DVec4::new(dx.x, dx.y, dy.x, dy.y);
        (s.footprint - truth).length() / truth.length()
    });
    assert!(error < 1e-4, "footprint {error}");
    // One normal for all: no difference, no curvature, up to the border.
    assert!(samples.iter().all(|s| s.curvature == DVec2::ZERO));
}

const TORUS: [f64; 2] = [0.7, 0.25];

/// A torus about +Y with exact normals.
fn torus() -> Mesh {
    let (columns, rows) = (512u32, 256u32);
    let mut mesh = Mesh { has_uvs: true, ..Default::default() };
    for i in 0..=rows {
        for j in 0..=columns {
            let (u, v) = (f64::from(j) / f64::from(columns), f64::from(i) / f64::from(rows));
            let out = dvec3((u * TAU).sin(), 0.0, (u * TAU).cos());
            let normal = out * (v * TAU).cos() + DVec3::Y * (v * TAU).sin();
            mesh.positions.push((out * TORUS[0] + normal * TORUS[1]).as_vec3().to_array());
            mesh.normals.push(normal.as_vec3().to_array());
            mesh.uvs.push([u as f32, v as f32]);
        }
    }
    for i in 0..rows {
        for j in 0..columns {
            let (a, b) = (i * (columns + 1) + j, (i + 1) * (columns + 1) + j);
            mesh.indices.extend([a, a + 1, b, b, a + 1, b + 1]);
        }
    }
    mesh
}

/// Across the tube 1/r; along it cos(v) over the distance from the axis: positive outside, a saddle inside.
#[test]
fn torus_curvatures_are_the_closed_form() {
    let samples = render(camera(dvec3(0.0, 2.0, 1.6)), vec![(torus(), Mat4::IDENTITY, 0)]);
    let truth = |s: &Sample| {
        let from_axis = s.position.x.hypot(s.position.z);
        dvec2(1.0 / TORUS[1], (from_axis - TORUS[0]) / TORUS[1] / from_axis)
    };
    let inner = || samples.iter().filter(|s| s.facing > 0.6);
    assert!(inner().any(|s| truth(s).y < -0.3) && inner().any(|s| truth(s).y > 0.3), "both kinds of points are seen");
    let error = worst(inner(), 500, |s| (s.curvature - truth(s)).abs().max_element() * TORUS[1]);
    assert!(error < 0.02, "curvature {error}");
}

/// One principal curvature of any tube is one over its radius.
#[test]
fn knot_curvatures_are_those_of_a_tube() {
    const TUBE: f64 = 0.17;
    let samples = render(camera(dvec3(0.3, 0.4, 3.2)), vec![(builtin::mesh("torus-knot", 512).unwrap(), Mat4::IDENTITY, 0)]);
    let inner: Vec<_> = samples.iter().filter(|s| s.facing > 0.7).collect();
    assert!(inner.len() > 300, "{}", inner.len());
    let off = |s: &Sample| s.curvature.to_array().map(|k| (k * TUBE - 1.0).abs()).into_iter().fold(f64::MAX, f64::min);
    let wrong = inner.iter().filter(|s| off(s) > 0.1).count();
    assert!(wrong * 20 < inner.len(), "{wrong} of {} are off by more than 10 %", inner.len());
}

/// A roof of two flat halves: where they are two objects, no difference is taken across the ridge.
#[test]
fn neighbours_of_another_object_are_not_used() {
    let plane = builtin::mesh("plane", 64).unwrap();
    let half = |side: f32| {
        let tilt = Mat4::from_quat(Quat::from_euler(EulerRot::XYZ, 0.0, 0.0, -side * 0.6));
        tilt * Mat4::from_translation(vec3(side, 0.0, 0.0))
    };
    let camera = camera(dvec3(0.2, 2.5, 2.0));
    let two = render(camera, vec![(plane.clone(), half(1.0), 0), (plane.clone(), half(-1.0), 1)]);
    for object in [0, 1] {
        assert!(two.iter().filter(|s| s.object == object && s.material == object).count() > 500);
    }
    // A sample with no neighbour of its object on an axis (a corner) says so by the largest curvature that it can show.
    let places: HashSet<_> = two.iter().map(|s| (s.pixel, s.object)).collect();
    let beside = |s: &&Sample, [x, y]: [u32; 2]| {
        let [px, py] = s.pixel;
        places.contains(&([px + x, py + y], s.object)) || places.contains(&([px.wrapping_sub(x), py.wrapping_sub(y)], s.object))
    };
    let known: Vec<_> = two.iter().filter(|s| beside(s, [1, 0]) && beside(s, [0, 1])).collect();
    assert!(two.len() - known.len() < 10, "{} of {}", known.len(), two.len());
    // Interpolating equal normals rounds, so that flat is not exactly zero.
    let error = worst(known.into_iter(), 1000, |s| s.curvature.abs().max_element());
    assert!(error < 1e-3, "curvature {error}");

    // The same roof as one object is bent at the ridge: without the rule, so were the two.
    let mut roof = Mesh { has_uvs: true, ..Default::default() };
    for side in [1.0, -1.0] {
        let first = roof.positions.len() as u32;
        let place = half(side);
        roof.positions.extend(plane.positions.iter().map(|p| place.transform_point3((*p).into()).to_array()));
        roof.normals.extend(plane.normals.iter().map(|n| place.transform_vector3((*n).into()).to_array()));
        roof.uvs.extend(&plane.uvs);
        roof.indices.extend(plane.indices.iter().map(|i| first + i));
    }
    let one = render(camera, vec![(roof, Mat4::IDENTITY, 0)]);
    assert_eq!(one.len(), two.len());
    let bent = one.iter().filter(|s| s.curvature.x > 5.0).count();
    assert!(bent > 30, "{bent} samples");
}

#[test]
fn tangents_follow_growing_u_under_every_transform() {
    let mut mesh = builtin::mesh("sphere", 1024).unwrap();
    mesh.compute_tangents();
    // Uneven and mirrored: a tangent is transformed as a difference of points is, and a mirror image swaps the bitangent's side.
    let uneven = Mat4::from_euler(EulerRot::XYZ, 0.4, 0.7, 0.2) * Mat4::from_scale(vec3(0.9, 0.5, -0.7));
    for (transform, handedness) in [(Mat4::IDENTITY, 1.0), (uneven, -1.0)] {
        let samples = render(camera(dvec3(0.4, 0.5, 3.0)), vec![(mesh.clone(), transform, 0)]);
        let back = transform.as_dmat4().inverse();
        // Away from the poles and from the silhouette, where facets are seen from the side.
        let inner = samples.iter().filter(|s| s.facing > 0.3 && back.transform_point3(s.position).y.abs() < 0.8);
        let error = worst(inner, 500, |s| {
            let p = back.transform_point3(s.position);
            let along = transform.as_dmat4().transform_vector3(dvec3(p.z, 0.0, -p.x));
            let expected = (along - s.normal * s.normal.dot(along)).normalize();
            let (tangent, side) = s.tangent.unwrap();
            if side == handedness { tangent.distance(expected) } else { 2.0 }
        });
        // Facets: a vertex's tangent is the mean of those of its triangles.
        assert!(error < 0.01, "tangent {error}");
    }
    let plain = render(camera(dvec3(0.4, 0.5, 3.0)), vec![(builtin::mesh("sphere", 64).unwrap(), Mat4::IDENTITY, 0)]);
    assert!(plain.iter().all(|s| s.tangent.is_none()));
}

/// A sphere seen from outside, mirrored, and from inside; each looks like one that lacks a triangle at its far end, which makes it
/// an open sheet whose back faces are drawn.
#[test]
fn back_faces_of_solids_are_not_missed() {
    let solid = builtin::mesh("torus-knot", 128).unwrap();
    let camera = camera(dvec3(0.5, 0.6, 3.0));
    for transform in [Mat4::from_rotation_x(0.4), Mat4::from_scale(vec3(-1.0, 0.7, 0.9)), Mat4::from_scale(Vec3::splat(8.0))] {
        let seen = |mesh: &Mesh| render(camera, vec![(mesh.clone(), transform, 0)]);
        // The corner that is furthest away is behind others.
        let far = |triangle: &[u32; 3]| {
            let at = transform.transform_point3(Vec3::from(solid.positions[triangle[0] as usize])).as_dvec3();
            at.distance(camera.position)
        };
        let triangles = solid.indices.as_chunks::<3>().0;
        let last = (0..triangles.len()).max_by(|i, j| far(&triangles[*i]).total_cmp(&far(&triangles[*j]))).unwrap();
        let mut open = solid.clone();
        open.indices.drain(3 * last..3 * last + 3);
        assert!(solid.is_closed() && !open.is_closed());
        let (culled, drawn) = (seen(&solid), seen(&open));
        assert!(culled.len() > 500, "{}", culled.len());
        let pixels = |samples: &[Sample]| samples.iter().map(|s| s.pixel).collect::<HashSet<_>>();
        assert!(pixels(&culled).symmetric_difference(&pixels(&drawn)).count() <= 1);
        let same = culled.iter().zip(&drawn).filter(|(a, b)| (a.depth - b.depth).abs() < 1e-4 * a.depth).count();
        assert!(same + 2 >= culled.len().min(drawn.len()), "{same} of {}", culled.len());
    }
}

/// Texture coordinates are zero where nothing depends on them, unless they are asked for.
#[test]
fn coordinates_are_there_where_they_are_read() {
    let white = Arc::new(passband::texture::Texture::colour8([1, 1], &[[255; 3]]).unwrap());
    let mapped = Maps { albedo: Some(white), ..Maps::default() };
    for (maps, coordinates, there) in [(Maps::default(), false, false), (Maps::default(), true, true), (mapped, false, true)] {
        let config = Config { directions: 2, coordinates, ..Config::new(EXTENT) };
        let object = Object { mesh: Arc::new(builtin::mesh("sphere", 64).unwrap()), transform: Mat4::IDENTITY, material: 0 };
        let world = World {
            name: "test".into(),
            camera: camera(dvec3(0.5, 0.6, 3.0)),
            size: None,
            environment: None,
            lights: Vec::new(),
            shadows: None,
            objects: vec![object],
            materials: vec![Material { name: "grey".into(), model: common::rig::grey(), maps }],
        };
        let mut session = Session::new(headless(&config), &world, &config).unwrap();
        for _ in 0..2 {
            session.frame([0, 0]).unwrap();
            for name in ["coordinate", "derivative"] {
                let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&session.image(name).unwrap().0);
                assert_eq!(texels.iter().any(|texel| *texel != [0.0; 4]), there, "{name}");
            }
        }
        assert_clean(&session.messages());
    }
}
