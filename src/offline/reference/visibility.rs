//! Which surface each pixel centre sees, by f64 ray-triangle intersection.

use crate::error::{Error, Result};
use crate::material::PointMaterial;
use crate::moments::Moments;
use crate::offline::reference::cubature::Options;
use crate::offline::world::{Object, World};
use glam::{DMat3, DVec2, DVec3, DVec4};

/// Normals are bent so that their cosine with the view direction is at least this.
pub const MIN_COSINE: f64 = 0.02;

/// What a pixel centre sees.
#[derive(Clone, Debug, PartialEq)]
pub struct Hit {
    /// Index into [`World::objects`].
    pub object: usize,
    /// Index into [`World::materials`].
    pub material: usize,
    /// Unit shading normal in world space, by the material's normal map if it has one, bent towards the viewer ([`bend`]).
    pub normal: DVec3,
    /// Direction of growing `u` across the normal before it was bent, and handedness, if the mesh has tangents.
    pub tangent: Option<(DVec3, f64)>,
    /// What the material's maps say.
    pub point: PointMaterial,
    /// Unit direction to the viewer in world space.
    pub view: DVec3,
    /// Distance along the view axis in metres.
    pub depth: f64,
}

/// Turns a unit normal that faces away from unit `view` (cosine below [`MIN_COSINE`] = c) towards it until the cosine is c:
/// `n' = c v + sqrt(1 - c^2) t`, where `t` is the normalised part of `n` perpendicular to `v`.
pub fn bend(normal: DVec3, view: DVec3) -> DVec3 {
    let cosine = normal.dot(view);
    if cosine >= MIN_COSINE {
        return normal;
    }
    let aside = normal - view * cosine;
    // Exactly opposite normals have no direction to bend along; any will do.
    let aside = if aside.length() > 1e-9 { aside.normalize() } else { view.any_orthonormal_vector() };
    view * MIN_COSINE + aside * (1.0 - MIN_COSINE * MIN_COSINE).sqrt()
}

/// The nearest triangle of a pixel so far.
#[derive(Clone, Copy)]
struct Nearest {
    distance: f64,
    object: usize,
    corners: [usize; 3],
    weights: DVec3,
}

/// Row-major hits through the pixel centres of an image of `extent` pixels. Triangles are two-sided. Each triangle is
/// intersected with the rays of its projected bounding box, so that the cost is linear in triangles and covered pixels.
/// Materials are read as `options` say.
///
/// # Errors
/// [`Error::InvalidInput`] for an empty extent, a camera without a direction, or an index out of range.
pub fn trace(world: &World, extent: [u32; 2], options: &Options) -> Result<Vec<Option<Hit>>> {
    let [width, height] = extent.map(|n| n as usize);
    if width == 0 || height == 0 {
        return Err(Error::invalid("extent", "at least 1x1", format!("{width}x{height}")));
    }
    let axes = world.camera.world_from_view();
    if !axes.is_finite() {
        return Err(Error::invalid("camera", "a target off the position and an up off the view direction", "neither"));
    }
    let centre = |i: usize| DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
    let rays: Vec<DVec3> = (0..width * height).map(|i| world.camera.ray(centre(i), extent)).collect();
    let mut nearest: Vec<Option<Nearest>> = vec![None; rays.len()];
    let screen = Screen::new(world, extent);
    for (index, object) in world.objects.iter().enumerate() {
        if object.material >= world.materials.len() {
            let expected = format!("a material below {}", world.materials.len());
            return Err(Error::invalid(format!("objects[{index}].material"), expected, object.material));
        }
        let transform = object.transform();
        let points: Vec<DVec3> =
            object.mesh.positions.iter().map(|p| transform.transform_point3(p.map(f64::from).into())).collect();
        for triangle in object.mesh.indices.chunks_exact(3) {
            let mut corners = [0; 3];
            let mut at = [DVec3::ZERO; 3];
            for ((corner, at), id) in corners.iter_mut().zip(&mut at).zip(triangle) {
                *corner = *id as usize;
                *at = *points.get(*corner).ok_or_else(|| {
                    Error::invalid(format!("objects[{index}].mesh.indices"), format!("below {}", points.len()), id)
                })?;
            }
            let Some([x, y]) = screen.bounds(at) else { continue };
            for row in y[0]..y[1] {
                for i in row * width + x[0]..row * width + x[1] {
                    let (Some(ray), Some(pixel)) = (rays.get(i), nearest.get_mut(i)) else { continue };
                    let Some((distance, weights)) = intersect(world.camera.position, *ray, at) else { continue };
                    if pixel.is_none_or(|found| distance < found.distance) {
                        *pixel = Some(Nearest { distance, object: index, corners, weights });
                    }
                }
            }
        }
    }
    let materials: Vec<_> = world.materials.iter().map(|m| m.surface()).collect();
    let moments: Vec<_> = materials.iter().map(|m| Moments::of(m, options.filter, options.division, options.lobe_rule)).collect();
    let hits = rays.iter().zip(nearest).enumerate().map(|(i, (ray, found))| {
        let found = found?;
        let object = world.objects.get(found.object)?;
        let depth = -found.distance * ray.dot(axes.z_axis);
        let (uv, footprint) = coordinates(world, extent, &found, [i % width, i / width]).unwrap_or_default();
        let point =
            materials.get(object.material)?.filtered_at(moments.get(object.material)?.as_ref(), uv, footprint, options.sampling);
        let smooth = shading_normal(object, &found);
        let tangent = tangent(object, &found, smooth);
        let mapped = tangent.map_or(smooth, |(t, side)| {
            (t * point.normal.x + smooth.cross(t) * (side * point.normal.y) + smooth * point.normal.z).normalize()
        });
        let across = |(t, side): (DVec3, f64)| Some(((t - mapped * mapped.dot(t)).try_normalize()?, side));
        Some(Hit {
            object: found.object,
            material: object.material,
            normal: bend(mapped, -*ray),
            tangent: tangent.and_then(across),
            point,
            view: -*ray,
            depth,
        })
    });
    Ok(hits.collect())
}

/// Interpolates in object space, transforms by the inverse transpose and normalises; the triangle's own normal where the
/// interpolated one vanishes.
fn shading_normal(object: &Object, found: &Nearest) -> DVec3 {
    let mesh = &object.mesh;
    let get = |list: &[[f32; 3]], i: usize| list.get(i).map_or(DVec3::ZERO, |p| DVec3::from(p.map(f64::from)));
    let [a, b, c] = found.corners;
    let w = found.weights;
    let smooth = get(&mesh.normals, a) * w.x + get(&mesh.normals, b) * w.y + get(&mesh.normals, c) * w.z;
    let linear = linear(object);
    // The inverse transpose up to a positive factor, defined for singular matrices too.
    let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
    let sign = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
    let cofactor = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
    let flat = || {
        let [a, b, c] = [a, b, c].map(|i| get(&mesh.positions, i));
        (cofactor * (b - a).cross(c - a)).try_normalize()
    };
    (cofactor * smooth).try_normalize().or_else(flat).unwrap_or(DVec3::Y)
}

/// World from object without translation.
fn linear(object: &Object) -> DMat3 {
    DMat3::from_mat4(object.transform())
}

/// The interpolated tangent across unit `normal` and its handedness, which a mirror image swaps.
fn tangent(object: &Object, found: &Nearest, normal: DVec3) -> Option<(DVec3, f64)> {
    let [a, b, c] = found.corners.map(|i| object.mesh.tangents.get(i).map(|t| DVec4::from(t.map(f64::from))));
    let w = found.weights;
    let smooth = a? * w.x + b? * w.y + c? * w.z;
    let linear = linear(object);
    let along = linear * smooth.truncate();
    let side = smooth.w * linear.determinant();
    Some(((along - normal * normal.dot(along)).try_normalize()?, if side < 0.0 { -1.0 } else { 1.0 }))
}

/// Texture coordinate of pixel (x, y), and its differences between the pixels of its quad in x and in y, over the triangle's
/// plane: what a rasteriser knows.
fn coordinates(world: &World, extent: [u32; 2], found: &Nearest, [x, y]: [usize; 2]) -> Option<(DVec2, [DVec2; 2])> {
    let object = world.objects.get(found.object)?;
    let transform = object.transform();
    let corner = |i: usize| Some(transform.transform_point3(object.mesh.positions.get(i)?.map(f64::from).into()));
    let coordinate = |i: usize| object.mesh.uvs.get(i).map(|t| DVec2::from(t.map(f64::from)));
    let [a, b, c] = found.corners;
    let triangle = [corner(a)?, corner(b)?, corner(c)?];
    let [a, b, c] = [coordinate(a)?, coordinate(b)?, coordinate(c)?];
    let uv = |w: DVec3| a * w.x + b * w.y + c * w.z;
    let at = |x: usize, y: usize| {
        let ray = world.camera.ray(DVec2::new(x as f64 + 0.5, y as f64 + 0.5), extent);
        plane(world.camera.position, ray, triangle).map(|(_, weights)| uv(weights))
    };
    let across = at(x | 1, y)? - at(x & !1, y)?;
    let down = at(x, y | 1)? - at(x, y & !1)?;
    Some((uv(found.weights), [across, down]))
}

/// Distance along the unit ray and barycentric coordinates (Moller and Trumbore 1997); edges belong to the triangle.
fn intersect(origin: DVec3, ray: DVec3, triangle: [DVec3; 3]) -> Option<(f64, DVec3)> {
    plane(origin, ray, triangle).filter(|(distance, weights)| weights.min_element() >= 0.0 && *distance > 0.0)
}

/// The same for the triangle's plane: coordinates may be negative.
fn plane(origin: DVec3, ray: DVec3, [a, b, c]: [DVec3; 3]) -> Option<(f64, DVec3)> {
    let (ab, ac) = (b - a, c - a);
    let p = ray.cross(ac);
    let det = ab.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = origin - a;
    let q = s.cross(ab);
    let (u, v, distance) = (s.dot(p) / det, ray.dot(q) / det, ac.dot(q) / det);
    Some((distance, DVec3::new(1.0 - u - v, u, v)))
}

/// Projection to pixels, for bounding boxes only.
struct Screen {
    eye: DVec3,
    view_from_world: DMat3,
    half: DVec2,
    pixels_per_tangent: f64,
    extent: [u32; 2],
}

impl Screen {
    fn new(world: &World, extent: [u32; 2]) -> Self {
        let half = DVec2::from(extent.map(f64::from)) / 2.0;
        Self {
            eye: world.camera.position,
            view_from_world: world.camera.world_from_view().transpose(),
            half,
            pixels_per_tangent: half.y / (world.camera.fov_y.to_radians() / 2.0).tan(),
            extent,
        }
    }

    /// Half-open pixel ranges in x and y whose centres the triangle may cover; all of the image if it reaches behind the eye.
    fn bounds(&self, triangle: [DVec3; 3]) -> Option<[[usize; 2]; 2]> {
        let view = triangle.map(|p| self.view_from_world * (p - self.eye));
        if view.iter().all(|p| p.z >= 0.0) {
            return None;
        }
        if view.iter().any(|p| p.z >= -1e-9) {
            return Some(self.extent.map(|n| [0, n as usize]));
        }
        let pixels = view.map(|p| self.half + DVec2::new(p.x, -p.y) * (self.pixels_per_tangent / -p.z));
        // A hair wider than exact: the intersection test decides.
        let low = pixels.into_iter().fold(DVec2::INFINITY, DVec2::min) - (0.5 + 1e-6);
        let high = pixels.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max) - (0.5 - 1e-6);
        // Casts saturate, so that what lies off the image ends as an empty range.
        let range = |low: f64, high: f64, n: u32| [low.ceil().max(0.0) as usize, ((high.floor() + 1.0) as usize).min(n as usize)];
        let [w, h] = self.extent;
        let (x, y) = (range(low.x, high.x, w), range(low.y, high.y, h));
        (x[0] < x[1] && y[0] < y[1]).then_some([x, y])
    }
}
