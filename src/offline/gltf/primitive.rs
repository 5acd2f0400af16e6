//! One primitive of a glTF mesh, with its transform applied.

use crate::offline::error::Result;
use crate::offline::gltf::document::Document;
use crate::offline::mesh::Mesh;
use glam::{DMat3, DMat4, DVec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

/// Attributes as they stand in the file.
struct Attributes {
    positions: Vec<[f64; 3]>,
    normals: Option<Vec<[f64; 3]>>,
    uvs: Option<Vec<[f64; 2]>>,
    tangents: Option<Vec<[f64; 4]>>,
    indices: Vec<u32>,
}

/// The triangles of `primitive` in world space; none if it has points or lines.
///
/// Normals that are missing are those of the faces, and tangents then do not count (glTF 2.0 specification, 3.7.2.1).
pub(super) fn read(document: &Document, field: &str, primitive: &Primitive, world: DMat4) -> Result<Option<Mesh>> {
    let mode = match primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
        _ => return Ok(None),
    };
    let attributes = attributes(document, field, primitive, mode)?;
    let mesh = transformed(&attributes, world);
    let finite = mesh.positions.iter().flatten().chain(mesh.uvs.iter().flatten()).all(|c| c.is_finite());
    if !finite {
        return Err(document.error(field, "finite positions and coordinates in world space", "another number"));
    }
    Ok(Some(if attributes.normals.is_none() { flat(&mesh) } else { mesh }))
}

fn attributes(document: &Document, field: &str, primitive: &Primitive, mode: Mode) -> Result<Attributes> {
    use ComponentType::{F32, U8, U16, U32};
    let attribute = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let positions = attribute(Semantic::Positions).ok_or_else(|| document.error(field, "POSITION", "none"))?;
    let positions = document.elements_of::<3>(positions, Type::Vec3, &[F32])?;
    let normals = attribute(Semantic::Normals).map(|a| document.elements_of::<3>(a, Type::Vec3, &[F32])).transpose()?;
    let tangents = attribute(Semantic::Tangents).filter(|_| normals.is_some());
    let tangents = tangents.map(|a| document.elements_of::<4>(a, Type::Vec4, &[F32])).transpose()?;
    let uvs = attribute(Semantic::TexCoords(0)).map(|a| document.elements_of::<2>(a, Type::Vec2, &[F32, U8, U16])).transpose()?;
    let count = positions.len();
    let others = [normals.as_ref().map(Vec::len), tangents.as_ref().map(Vec::len), uvs.as_ref().map(Vec::len)];
    if let Some(other) = others.into_iter().flatten().find(|other| *other != count) {
        return Err(document.error(field, format!("{count} elements in every attribute"), other));
    }
    let listed: Vec<u32> = match primitive.indices {
        Some(index) => document.elements_of::<1>(index, Type::Scalar, &[U8, U16, U32])?.iter().map(|[i]| *i as u32).collect(),
        None => (0..u32::try_from(count).map_err(|_| document.error(field, "fewer than 2^32 vertices", count))?).collect(),
    };
    if let Some(bad) = listed.iter().find(|i| **i as usize >= count) {
        return Err(document.error(field, format!("indices below {count}"), bad));
    }
    Ok(Attributes { positions, normals, uvs, tangents, indices: triangles(document, field, mode, listed)? })
}

/// Lists, strips and fans as lists; every second triangle of a strip is turned round.
fn triangles(document: &Document, field: &str, mode: Mode, listed: Vec<u32>) -> Result<Vec<u32>> {
    let pairs = listed.iter().skip(1).zip(listed.iter().skip(2));
    match mode {
        Mode::TriangleStrip => {
            let turned = |(i, (a, (b, c))): (usize, (&u32, (&u32, &u32)))| if i % 2 == 0 { [*a, *b, *c] } else { [*b, *a, *c] };
            Ok(listed.iter().zip(pairs).enumerate().flat_map(turned).collect())
        }
        Mode::TriangleFan => Ok(listed.first().into_iter().flat_map(|a| pairs.clone().flat_map(|(b, c)| [*a, *b, *c])).collect()),
        _ if listed.len().is_multiple_of(3) => Ok(listed),
        _ => Err(document.error(field, "a multiple of 3 corners", listed.len())),
    }
}

fn transformed(attributes: &Attributes, world: DMat4) -> Mesh {
    let linear = DMat3::from_mat4(world);
    let mirrored = linear.determinant() < 0.0;
    // Normals go with the cofactors, which exist where the inverse does not; mirrored, they would point inwards.
    let cofactors = DMat3::from_cols(
        linear.y_axis.cross(linear.z_axis),
        linear.z_axis.cross(linear.x_axis),
        linear.x_axis.cross(linear.y_axis),
    ) * if mirrored { -1.0 } else { 1.0 };
    let count = attributes.positions.len();
    let zip = |all: &Option<Vec<[f64; 3]>>| all.clone().unwrap_or_else(|| vec![[0.0; 3]; count]);
    let normals: Vec<DVec3> = zip(&attributes.normals)
        .into_iter()
        .map(|n| (cofactors * DVec3::from(n)).try_normalize().filter(|n| n.is_finite()).unwrap_or(DVec3::Y))
        .collect();
    let tangent = |([x, y, z, w], n): (&[f64; 4], &DVec3)| {
        let t = linear * DVec3::new(*x, *y, *z);
        let t = (t - *n * n.dot(t)).try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        let sign = if (*w < 0.0) != mirrored { -1.0 } else { 1.0 };
        t.extend(sign).as_vec4().to_array()
    };
    let tangents = match (&attributes.tangents, &attributes.uvs) {
        (Some(all), Some(_)) => all.iter().zip(&normals).map(tangent).collect(),
        _ => Vec::new(),
    };
    let mut indices = attributes.indices.clone();
    if mirrored {
        indices.as_chunks_mut::<3>().0.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
    }
    let uvs = attributes.uvs.as_ref().map(|all| all.iter().map(|[u, v]| [*u as f32, (1.0 - *v) as f32]).collect());
    Mesh {
        positions: attributes.positions.iter().map(|p| world.transform_point3(DVec3::from(*p)).as_vec3().to_array()).collect(),
        normals: normals.iter().map(|n| n.as_vec3().to_array()).collect(),
        has_uvs: uvs.is_some(),
        uvs: uvs.unwrap_or_else(|| vec![[0.0; 2]; count]),
        tangents,
        indices,
    }
}

/// `mesh` with vertices of its own for each triangle, and the triangle's normal.
fn flat(mesh: &Mesh) -> Mesh {
    let corners = mesh.indices.iter().map(|i| *i as usize);
    let positions: Vec<[f32; 3]> = corners.clone().filter_map(|i| mesh.positions.get(i).copied()).collect();
    let uvs = corners.filter_map(|i| mesh.uvs.get(i).copied()).collect();
    let face = |[a, b, c]: &[[f32; 3]; 3]| {
        let [a, b, c] = [a, b, c].map(|p| DVec3::from(p.map(f64::from)));
        let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Y);
        [normal.as_vec3().to_array(); 3]
    };
    let normals = positions.as_chunks::<3>().0.iter().flat_map(face).collect();
    let indices = (0..mesh.indices.len() as u32).collect();
    Mesh { positions, normals, uvs, has_uvs: mesh.has_uvs, tangents: Vec::new(), indices }
}
