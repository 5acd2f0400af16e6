//! Indexed triangle meshes.

/// A triangle mesh in object space (right-handed, metres). All attributes are per vertex.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one per position.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one per position; zero where `has_uvs` is false.
    pub uvs: Vec<[f32; 2]>,
    /// Whether the source carried texture coordinates.
    pub has_uvs: bool,
    /// Three indices a triangle.
    pub indices: Vec<u32>,
}
