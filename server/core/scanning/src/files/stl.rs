//! Meshes as binary STL: millimetres, float32, one normal and three corners per triangle.

use std::collections::HashMap;
use std::io::{BufRead, Write};

use super::{ContentError, trusted_capacity};
use crate::mesh::Mesh;

/// Leading text; must not begin with `solid`, which would indicate ASCII.
const BANNER: &[u8] = b"binary STL, units mm, made by sheaf";

const HEADER_BYTES: usize = 80;
const TRIANGLE_BYTES: usize = 50;

pub(super) fn write(out: &mut impl Write, mesh: &Mesh) -> Result<(), ContentError> {
    let count = u32::try_from(mesh.triangles.len()).map_err(|_| {
        ContentError::malformed("triangles", "STL holds at most 2³² of them", "write the mesh as PLY")
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

pub(super) fn read(mut input: impl BufRead) -> Result<Mesh, ContentError> {
    let mut header = [0; HEADER_BYTES + 4];
    input.read_exact(&mut header).map_err(|cause| ContentError::truncated(cause, || "header".into()))?;
    if header.starts_with(b"solid ") && header.contains(&b'\n') {
        return Err(ContentError::malformed("header", "this is ASCII STL", "export it as binary STL"));
    }
    let count = u32::from_le_bytes([header[80], header[81], header[82], header[83]]);
    let mut mesh = Mesh { triangles: Vec::with_capacity(trusted_capacity(count.into())), ..Mesh::default() };
    let mut index_of: HashMap<[u32; 3], u32> = HashMap::new();
    let mut row = [0; TRIANGLE_BYTES];
    for idx in 0..count {
        let place = || format!("triangle {idx} of {count}");
        input.read_exact(&mut row).map_err(|cause| ContentError::truncated(cause, place))?;
        let mut triangle = [0; 3];
        for (slot, corner) in triangle.iter_mut().zip(row[12..48].chunks_exact(12)) {
            *slot = vertex_index(&mut mesh, &mut index_of, corner);
        }
        mesh.triangles.push(triangle);
    }
    mesh.checked()
}

/// The index of a corner; equal positions share one.
fn vertex_index(mesh: &mut Mesh, index_of: &mut HashMap<[u32; 3], u32>, corner: &[u8]) -> u32 {
    let bits =
        [0, 4, 8].map(|at| u32::from_le_bytes([corner[at], corner[at + 1], corner[at + 2], corner[at + 3]]));
    *index_of.entry(bits).or_insert_with(|| {
        mesh.vertices_mm.push(bits.map(|b| f64::from(f32::from_bits(b))));
        (mesh.vertices_mm.len() - 1) as u32
    })
}
