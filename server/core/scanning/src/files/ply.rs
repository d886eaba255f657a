//! PLY: the native cloud format (`sheaf-capture/1`), and meshes.

use std::io::{BufRead, Write};

use super::ply_reader::{Element, PlyReader};
use super::{ContentError, FIELDS, one_line, point_from_fields, push, trusted_capacity};
use crate::mesh::Mesh;
use crate::points::cloud::{Cloud, CloudPoint};

/// Vertex properties of a cloud, in file order.
const CLOUD_PROPERTIES: [(&str, &str); 9] = [
    ("double", "x"),
    ("double", "y"),
    ("double", "z"),
    ("char", "order"),
    ("uint", "frame"),
    ("float", "u"),
    ("float", "v"),
    ("float", "intensity"),
    ("float", "sigma_mm"),
];

/// Vertices encoded before each write: 360 kB fit in the processor's cache and need few system calls.
const CHUNK_POINTS: usize = 8192;

/// Bytes of one vertex.
const VERTEX_BYTES: usize = 3 * 8 + 1 + 4 + 4 * 4;

pub(super) fn write_cloud_header(
    out: &mut impl Write,
    comments: &[String],
    n_points: usize,
) -> Result<(), ContentError> {
    write_preamble(out, comments)?;
    writeln!(out, "element vertex {n_points}")?;
    for (kind, name) in CLOUD_PROPERTIES {
        writeln!(out, "property {kind} {name}")?;
    }
    Ok(writeln!(out, "end_header")?)
}

/// Writes the vertices as [`vertex_bytes`], many at a time; `chunk` is reusable memory.
pub(super) fn write_vertices(
    out: &mut impl Write,
    points: &[CloudPoint],
    chunk: &mut Vec<u8>,
) -> Result<(), ContentError> {
    for points in points.chunks(CHUNK_POINTS) {
        chunk.clear();
        points.iter().for_each(|point| chunk.extend_from_slice(&vertex_bytes(point)));
        out.write_all(chunk)?;
    }
    Ok(())
}

fn write_preamble(out: &mut impl Write, comments: &[String]) -> Result<(), ContentError> {
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    for comment in comments {
        writeln!(out, "comment {}", one_line(comment))?;
    }
    Ok(())
}

/// One vertex as little-endian bytes in the order of [`CLOUD_PROPERTIES`]; PCD uses the same layout.
pub(super) fn vertex_bytes(point: &CloudPoint) -> [u8; VERTEX_BYTES] {
    let mut bytes = [0; VERTEX_BYTES];
    bytes[0..8].copy_from_slice(&point.x_mm.to_le_bytes());
    bytes[8..16].copy_from_slice(&point.y_mm.to_le_bytes());
    bytes[16..24].copy_from_slice(&point.z_mm.to_le_bytes());
    bytes[24..25].copy_from_slice(&point.order.to_le_bytes());
    bytes[25..29].copy_from_slice(&point.frame.to_le_bytes());
    bytes[29..33].copy_from_slice(&point.u_px.to_le_bytes());
    bytes[33..37].copy_from_slice(&point.v_px.to_le_bytes());
    bytes[37..41].copy_from_slice(&point.intensity.to_le_bytes());
    bytes[41..45].copy_from_slice(&point.sigma_mm.to_le_bytes());
    bytes
}

pub(super) fn read_cloud(input: impl BufRead) -> Result<Cloud, ContentError> {
    let mut reader = CloudReader::open(input)?;
    let n_points = reader.n_points();
    let mut points = Vec::with_capacity(trusted_capacity(n_points));
    for point in &mut reader {
        push(&mut points, point?, n_points);
    }
    Ok(Cloud { points, comments: reader.into_comments() })
}

/// Iterator over the points of a cloud.
pub(super) struct CloudReader<R> {
    reader: PlyReader<R>,
    vertex: Element,
    slots: Vec<Option<usize>>,
    /// Index of the next point.
    next: u64,
    row: Vec<f64>,
}

impl<R: BufRead> CloudReader<R> {
    pub(super) fn open(input: R) -> Result<Self, ContentError> {
        let mut reader = PlyReader::open(input)?;
        let vertex = reader.skip_to("vertex")?;
        let slots = slots_of(&vertex)?;
        Ok(Self { reader, vertex, slots, next: 0, row: Vec::new() })
    }

    /// Number of points according to the header.
    pub(super) fn n_points(&self) -> u64 {
        self.vertex.count
    }

    pub(super) fn into_comments(self) -> Vec<String> {
        self.reader.comments
    }
}

impl<R: BufRead> Iterator for CloudReader<R> {
    type Item = Result<CloudPoint, ContentError>;

    fn next(&mut self) -> Option<Self::Item> {
        let idx = self.next;
        if idx == self.vertex.count {
            return None;
        }
        self.next += 1;
        if let Err(error) = self.reader.scalars(&self.vertex, idx, &mut self.row) {
            return Some(Err(error));
        }
        let mut values = [0.0; 9];
        for (slot, value) in self.slots.iter().zip(&self.row) {
            if let Some(field) = slot {
                values[*field] = *value;
            }
        }
        Some(point_from_fields(&values, || format!("vertex {idx}")))
    }
}

/// For every property of the file, its index in [`FIELDS`].
fn slots_of(vertex: &Element) -> Result<Vec<Option<usize>>, ContentError> {
    let slots: Vec<Option<usize>> = vertex
        .properties
        .iter()
        .map(|property| {
            FIELDS.iter().position(|field| *field == property.name || alias(field) == Some(property.name.as_str()))
        })
        .collect();
    match (0..3).find(|axis| !slots.contains(&Some(*axis))) {
        None => Ok(slots),
        Some(axis) => Err(ContentError::malformed(
            "header",
            format!("vertices have no property `{}`", FIELDS[axis]),
            "write the positions as x, y and z in millimetres",
        )),
    }
}

/// Names of the same field in other programs.
fn alias(field: &str) -> Option<&'static str> {
    (field == "intensity").then_some("scalar_intensity")
}

pub(super) fn write_mesh(out: &mut impl Write, mesh: &Mesh) -> Result<(), ContentError> {
    write_preamble(out, &mesh.comments)?;
    writeln!(out, "element vertex {}", mesh.vertices_mm.len())?;
    for axis in ["x", "y", "z"] {
        writeln!(out, "property double {axis}")?;
    }
    writeln!(out, "element face {}\nproperty list uchar uint vertex_indices", mesh.triangles.len())?;
    writeln!(out, "end_header")?;
    for value in mesh.vertices_mm.iter().flatten() {
        out.write_all(&value.to_le_bytes())?;
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        for index in triangle {
            out.write_all(&index.to_le_bytes())?;
        }
    }
    Ok(())
}

pub(super) fn read_mesh(input: impl BufRead) -> Result<Mesh, ContentError> {
    let mut reader = PlyReader::open(input)?;
    let vertex = reader.skip_to("vertex")?;
    let slots = slots_of(&vertex)?;
    let mut mesh = Mesh { vertices_mm: Vec::with_capacity(trusted_capacity(vertex.count)), ..Mesh::default() };
    let mut row = Vec::new();
    for idx in 0..vertex.count {
        reader.scalars(&vertex, idx, &mut row)?;
        let mut position = [0.0; 3];
        for (slot, value) in slots.iter().zip(&row) {
            if let Some(axis @ 0..3) = slot {
                position[*axis] = *value;
            }
        }
        mesh.vertices_mm.push(position);
    }
    read_faces(&mut reader, &mut mesh)?;
    mesh.comments = reader.comments;
    mesh.checked()
}

/// Polygons are split into fans of triangles.
fn read_faces(reader: &mut PlyReader<impl BufRead>, mesh: &mut Mesh) -> Result<(), ContentError> {
    let face = reader.skip_to("face")?;
    if !face.properties.iter().any(|property| property.name.starts_with("vertex_ind")) {
        return Err(ContentError::malformed(
            "header",
            "faces have no list `vertex_indices`",
            "export the mesh again with its faces",
        ));
    }
    let mut polygon = Vec::new();
    for idx in 0..face.count {
        reader.list(&face, idx, "vertex_ind", &mut polygon)?;
        for pair in polygon.windows(2).skip(1) {
            let corners = [polygon[0], pair[0], pair[1]];
            if corners.iter().any(|c| !(0.0..=f64::from(u32::MAX)).contains(c)) {
                return Err(ContentError::malformed(
                    format!("face {idx}"),
                    "a vertex index is negative or too large",
                    "export the mesh again",
                ));
            }
            mesh.triangles.push(corners.map(|corner| corner as u32));
        }
    }
    Ok(())
}
