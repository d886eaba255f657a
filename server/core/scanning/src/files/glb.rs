//! Meshes as GLB, the binary container of glTF 2.0.
//!
//! glTF is in metres with y up; the part frame is in millimetres with y down. Positions are stored as metres
//! (float32: 0.03 µm at 400 mm), and the only node rotates them by 180° about x.

use std::io::{BufRead, Read, Write};

use serde_json::{Value, json};

use super::ContentError;
use crate::mesh::Mesh;

const MAGIC: u32 = 0x4654_6C67;
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BINARY: u32 = 0x004E_4942;
const COMPONENT_FLOAT: u32 = 5126;
const COMPONENT_UINT: u32 = 5125;
const TARGET_VERTICES: u32 = 34962;
const TARGET_INDICES: u32 = 34963;
const MM_PER_METRE: f64 = 1000.0;

pub(super) fn write(out: &mut impl Write, mesh: &Mesh) -> Result<(), ContentError> {
    let binary_bytes = 24 * mesh.vertices_mm.len() as u64 + 12 * mesh.triangles.len() as u64;
    let mut text = document(mesh, binary_bytes).to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() as u64 + 8 + binary_bytes;
    let total = u32::try_from(total)
        .map_err(|_| ContentError::malformed("mesh", "GLB holds at most 4 GiB", "write the mesh as PLY"))?;
    for word in [MAGIC, 2, total, text.len() as u32, CHUNK_JSON] {
        out.write_all(&word.to_le_bytes())?;
    }
    out.write_all(&text)?;
    for word in [binary_bytes as u32, CHUNK_BINARY] {
        out.write_all(&word.to_le_bytes())?;
    }
    for vertex in &mesh.vertices_mm {
        write_floats(out, metres(vertex))?;
    }
    for normal in mesh.vertex_normals() {
        write_floats(out, normal.map(|value| value as f32))?;
    }
    for index in mesh.triangles.iter().flatten() {
        out.write_all(&index.to_le_bytes())?;
    }
    Ok(())
}

fn metres(vertex_mm: &[f64; 3]) -> [f32; 3] {
    vertex_mm.map(|value| (value / MM_PER_METRE) as f32)
}

fn write_floats(out: &mut impl Write, values: [f32; 3]) -> Result<(), ContentError> {
    for value in values {
        out.write_all(&value.to_le_bytes())?;
    }
    Ok(())
}

fn document(mesh: &Mesh, binary_bytes: u64) -> Value {
    let (vertices, indices) = (mesh.vertices_mm.len(), 3 * mesh.triangles.len());
    let asset = json!({ "version": "2.0", "generator": "sheaf", "extras": { "comments": mesh.comments } });
    if indices == 0 {
        // Accessors and buffers of zero bytes are not allowed: an empty mesh is an empty node.
        return json!({ "asset": asset, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "name": "empty" }] });
    }
    let (low, high) = bounds(mesh);
    let block = 12 * vertices;
    json!({
        "asset": asset,
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": "part, y down turned to y up", "mesh": 0, "rotation": [1.0, 0.0, 0.0, 0.0] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2, "material": 0 }] }],
        "materials": [{
            "doubleSided": true,
            "pbrMetallicRoughness": { "baseColorFactor": [0.7, 0.72, 0.75, 1.0], "metallicFactor": 0.1 }
        }],
        "accessors": [
            { "bufferView": 0, "componentType": COMPONENT_FLOAT, "count": vertices, "type": "VEC3",
              "min": low, "max": high },
            { "bufferView": 1, "componentType": COMPONENT_FLOAT, "count": vertices, "type": "VEC3" },
            { "bufferView": 2, "componentType": COMPONENT_UINT, "count": indices, "type": "SCALAR" }
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": block, "target": TARGET_VERTICES },
            { "buffer": 0, "byteOffset": block, "byteLength": block, "target": TARGET_VERTICES },
            { "buffer": 0, "byteOffset": 2 * block, "byteLength": 4 * indices, "target": TARGET_INDICES }
        ],
        "buffers": [{ "byteLength": binary_bytes }]
    })
}

fn bounds(mesh: &Mesh) -> ([f32; 3], [f32; 3]) {
    let mut bounds = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for vertex in mesh.vertices_mm.iter().map(metres) {
        for (axis, value) in vertex.iter().enumerate() {
            bounds.0[axis] = bounds.0[axis].min(*value);
            bounds.1[axis] = bounds.1[axis].max(*value);
        }
    }
    bounds
}

/// Reads the first primitive of a GLB as written here: float32 positions in metres, uint32 indices, own buffer.
pub(super) fn read(mut input: impl BufRead) -> Result<Mesh, ContentError> {
    let head = words::<3>(&mut input, "header")?;
    if head[0] != MAGIC || head[1] != 2 {
        return Err(problem("header", "this is not a glTF 2.0 binary"));
    }
    let text = chunk(&mut input, CHUNK_JSON)?;
    let document: Value = serde_json::from_slice(&text)
        .map_err(|error| problem("JSON chunk", &format!("cannot be parsed ({error})")))?;
    let mut mesh = Mesh::default();
    if let Some(comments) = document["asset"]["extras"]["comments"].as_array() {
        mesh.comments = comments.iter().filter_map(Value::as_str).map(str::to_owned).collect();
    }
    let primitive = &document["meshes"][0]["primitives"][0];
    if primitive.is_null() {
        return Ok(mesh);
    }
    let binary = chunk(&mut input, CHUNK_BINARY)?;
    let positions = accessor(&document, &binary, &primitive["attributes"]["POSITION"], COMPONENT_FLOAT, 12)?;
    mesh.vertices_mm = positions.chunks_exact(12).map(position_mm).collect();
    let indices = accessor(&document, &binary, &primitive["indices"], COMPONENT_UINT, 4)?;
    mesh.triangles =
        indices.chunks_exact(12).map(|bytes| [0, 4, 8].map(|at| u32::from_le_bytes(four(bytes, at)))).collect();
    mesh.checked()
}

fn position_mm(bytes: &[u8]) -> [f64; 3] {
    [0, 4, 8].map(|at| f64::from(f32::from_le_bytes(four(bytes, at))) * MM_PER_METRE)
}

fn four(bytes: &[u8], at: usize) -> [u8; 4] {
    [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]
}

fn problem(place: &str, text: &str) -> ContentError {
    ContentError::malformed(place, text, "export the mesh as GLB with float32 positions and uint32 indices")
}

fn words<const N: usize>(input: &mut impl Read, place: &str) -> Result<[u32; N], ContentError> {
    let mut words = [0; N];
    for word in &mut words {
        let mut bytes = [0; 4];
        input.read_exact(&mut bytes).map_err(|cause| ContentError::truncated(cause, || place.into()))?;
        *word = u32::from_le_bytes(bytes);
    }
    Ok(words)
}

fn chunk(input: &mut impl Read, kind: u32) -> Result<Vec<u8>, ContentError> {
    let [length, found] = words(input, "chunk header")?;
    if found != kind {
        return Err(problem("chunk header", "expected a JSON chunk followed by a binary chunk"));
    }
    let mut bytes = Vec::new();
    input.take(length.into()).read_to_end(&mut bytes)?;
    if bytes.len() as u64 != u64::from(length) {
        return Err(ContentError::truncated(std::io::ErrorKind::UnexpectedEof.into(), || "chunk".into()));
    }
    Ok(bytes)
}

/// The bytes an accessor covers; tightly packed views only.
fn accessor<'a>(
    document: &Value,
    binary: &'a [u8],
    index: &Value,
    component: u32,
    element_bytes: u64,
) -> Result<&'a [u8], ContentError> {
    let lookup = || {
        let accessor = &document["accessors"][index.as_u64()? as usize];
        if accessor["componentType"].as_u64()? != u64::from(component) {
            return None;
        }
        let view = &document["bufferViews"][accessor["bufferView"].as_u64()? as usize];
        let offset = |value: &Value| value["byteOffset"].as_u64().unwrap_or(0);
        let start = offset(view).checked_add(offset(accessor))?;
        let end = start.checked_add(accessor["count"].as_u64()?.checked_mul(element_bytes)?)?;
        binary.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?)
    };
    lookup().ok_or_else(|| problem("JSON chunk", "an accessor is missing or points outside the file"))
}
