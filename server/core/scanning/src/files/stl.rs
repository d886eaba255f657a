//! Meshes as STL, mm: written as binary (float32, one normal and three corners per triangle), read as binary or
//! ASCII.

use std::collections::HashMap;
use std::io::{BufRead, Write};

use super::ContentError;
use crate::mesh::Mesh;

/// Text of the header; must not begin with `solid`, which would indicate ASCII.
const BANNER: &[u8] = b"binary STL, units mm, made by sheaf";

const HEADER_BYTES: usize = 80;

/// Most triangles whose corners fit into 32-bit indices.
const MAX_TRIANGLES: usize = (u32::MAX / 3) as usize;

pub(super) fn write(out: &mut impl Write, mesh: &Mesh) -> Result<(), ContentError> {
    let count = u32::try_from(mesh.triangles.len()).map_err(|_| {
        ContentError::malformed("mesh", "STL holds at most 2³² triangles", "write the mesh as PLY")
    })?;
    let mut header = [b' '; HEADER_BYTES];
    header[..BANNER.len()].copy_from_slice(BANNER);
    out.write_all(&header)?;
    out.write_all(&count.to_le_bytes())?;
    for triangle in &mesh.triangles {
        let normal = mesh.triangle_normal(triangle);
        let corners = triangle.map(|index| mesh.vertices_mm[index as usize]);
        for value in normal.iter().chain(corners.iter().flatten()) {
            out.write_all(&(*value as f32).to_le_bytes())?;
        }
        out.write_all(&[0, 0])?;
    }
    Ok(())
}

/// Reads binary or ASCII STL; coincident corners share a vertex.
pub(super) fn read(mut input: impl BufRead) -> Result<Mesh, ContentError> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes)?;
    let triangles = stl::read(&bytes, MAX_TRIANGLES)
        .map_err(|error| ContentError::malformed("STL", error.to_string(), error.advice()))?;
    let mut mesh = Mesh { triangles: Vec::with_capacity(triangles.len()), ..Mesh::default() };
    let mut index_of: HashMap<[u64; 3], u32> = HashMap::new();
    for triangle in triangles {
        let corners = triangle.map(|corner| {
            *index_of.entry(corner.map(f64::to_bits)).or_insert_with(|| {
                mesh.vertices_mm.push(corner);
                (mesh.vertices_mm.len() - 1) as u32
            })
        });
        mesh.triangles.push(corners);
    }
    mesh.checked()
}
