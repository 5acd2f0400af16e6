//! A mesh on the device.

use crate::Draw;
use crate::gpu::buffer::Buffer;
use crate::gpu::context::Context;
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::upload::BufferUpload;
use crate::offline::error::Result;
use crate::offline::headless::Headless;
use crate::offline::mesh::Mesh;
use crate::offline::session::closed;
use ash::vk;
use glam::{Mat4, Vec3};
use std::sync::Arc;

pub(super) struct MeshBuffers {
    /// Kept, so that no other mesh is at its address.
    _mesh: Arc<Mesh>,
    positions: Buffer,
    normals: Buffer,
    coordinates: Buffer,
    tangents: Option<Buffer>,
    indices: Buffer,
    count: u32,
    /// Of a closed mesh: its bounds, outside of which no back face is seen.
    bounds: Option<[Vec3; 2]>,
}

impl MeshBuffers {
    /// Uploads `mesh` and waits for it.
    pub fn upload(headless: &mut Headless, cx: &Context, mesh: &Arc<Mesh>) -> Result<Self> {
        let mut uploaded = None;
        headless.submit(|cmd, memory| {
            let vertex = vk::BufferUsageFlags::VERTEX_BUFFER;
            let (uploads, tangents) = Build::run(cx, memory, |build| {
                let tangents: &[u8] = bytemuck::cast_slice(&mesh.tangents);
                let uploads = [
                    BufferUpload::new(build, "positions", vertex, bytemuck::cast_slice(&mesh.positions))?,
                    BufferUpload::new(build, "normals", vertex, bytemuck::cast_slice(&mesh.normals))?,
                    BufferUpload::new(build, "coordinates", vertex, bytemuck::cast_slice(&mesh.uvs))?,
                    BufferUpload::new(build, "indices", vk::BufferUsageFlags::INDEX_BUFFER, bytemuck::cast_slice(&mesh.indices))?,
                ];
                let tangents =
                    (!tangents.is_empty()).then(|| BufferUpload::new(build, "tangents", vertex, tangents)).transpose()?;
                Ok((uploads, tangents))
            })?;
            let mut bag = Retired::default();
            // The wait at the end of the submission is all the synchronization that vertex input needs.
            let mut states = States::default();
            let mut rec = Recorder::new(cx, cmd, 0, &mut states, None);
            let [positions, normals, coordinates, indices] = uploads.map(|u| u.record(&mut rec, &mut bag));
            let tangents = tangents.map(|u| u.record(&mut rec, &mut bag));
            let count = mesh.indices.len() as u32;
            let bounds = mesh.is_closed().then(|| mesh.bounds().map(Vec3::from));
            let _mesh = Arc::clone(mesh);
            uploaded = Some(Self { _mesh, positions, normals, coordinates, tangents, indices, count, bounds });
            Ok(bag)
        })?;
        uploaded.ok_or_else(closed)
    }

    /// Of object `object`, seen from `eye` in world space.
    pub fn draw(&self, world_from_object: Mat4, eye: Vec3, material: u32, object: u32) -> Draw {
        let eye = world_from_object.inverse().transform_point3(eye);
        let inside = |[least, greatest]: [Vec3; 2]| eye.cmpge(least).all() && eye.cmple(greatest).all();
        Draw {
            positions: (self.positions.handle, 0),
            normals: (self.normals.handle, 0),
            coordinates: (self.coordinates.handle, 0),
            tangents: self.tangents.as_ref().map(|b| (b.handle, 0)),
            indices: (self.indices.handle, 0),
            index_count: self.count,
            closed: self.bounds.is_some_and(|bounds| !inside(bounds)),
            world_from_object: world_from_object.to_cols_array(),
            material,
            object,
        }
    }

    pub fn retire(self, bag: &mut Retired) {
        let all = [self.positions, self.normals, self.coordinates, self.indices];
        all.into_iter().chain(self.tangents).for_each(|buffer| buffer.retire(bag));
    }
}
