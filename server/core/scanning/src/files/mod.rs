//! Clouds and meshes as files.
//!
//! | format | positions | order, frame, u, v, intensity, σ | comments |
//! |---|---|---|---|
//! | PLY (binary little endian) | mm, float64 | all | all |
//! | CSV | mm, shortest exact decimal | all | all |
//! | PCD (binary) | mm, float64 | all | all |
//! | E57 | **metres**, float64 (1 ulp lost in the conversion) | intensity as E57's own, the others as attributes of the
//! extension `sheaf`: other programs ignore them | in the description |
//! | mesh PLY | mm, float64 | – | all |
//! | mesh STL (binary; text is read, too) | mm, float32, vertices repeated per triangle | – | lost |
//! | mesh GLB | **metres**, float32; a node turns y down into glTF's y up | – | in `asset.extras` |
//!
//! [`peaks`] stores the input of a scan.
//!
//! Writing to a path is atomic: the bytes go to a hidden temporary file, which is synced and renamed. Counts in
//! headers are not trusted: memory grows with the bytes actually read.

mod csv;
mod e57;
mod error;
mod glb;
mod pcd;
pub mod peaks;
mod ply;
mod ply_reader;
mod stl;
mod writer;

use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Read, Seek, Write};
use std::path::Path;

pub use error::FileError;
pub use writer::{AddPoints, CloudWriter, write_cloud_in_pieces};

pub use crate::error::ContentError;
use crate::mesh::Mesh;
use crate::points::cloud::{Cloud, CloudPoint};
use ply::CloudReader;

/// Most records for which memory is reserved in advance, whatever a header claims.
const MAX_TRUSTED_COUNT: u64 = 1 << 16;

/// Bytes buffered before each write.
const WRITE_BUFFER_BYTES: usize = 1 << 18;

/// Longest line of a text header: it may hold a whole calibration.
const MAX_LINE_BYTES: u64 = 16 << 20;

/// The formats a cloud can be written in and read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CloudFormat {
    /// Polygon File Format, binary little endian; the native cloud format.
    Ply,
    /// Comma-separated text with `#` comments.
    Csv,
    /// Point Cloud Library's format, binary.
    Pcd,
    /// ASTM E2807.
    E57,
}

impl CloudFormat {
    /// All formats.
    pub const ALL: [Self; 4] = [Self::Ply, Self::Csv, Self::Pcd, Self::E57];

    /// The file name extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Pcd => "pcd",
            Self::E57 => "e57",
        }
    }

    /// The format named by a path's extension.
    ///
    /// # Errors
    /// [`FileError::UnknownFormat`].
    pub fn from_path(path: &Path) -> Result<Self, FileError> {
        by_extension(path, &Self::ALL, Self::extension)
    }
}

/// The formats a mesh can be written in and read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MeshFormat {
    /// Stereolithography, binary.
    Stl,
    /// glTF 2.0, binary container.
    Glb,
    /// Polygon File Format, binary little endian.
    Ply,
}

impl MeshFormat {
    /// All formats.
    pub const ALL: [Self; 3] = [Self::Stl, Self::Glb, Self::Ply];

    /// The file name extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Glb => "glb",
            Self::Ply => "ply",
        }
    }

    /// The format named by a path's extension.
    ///
    /// # Errors
    /// [`FileError::UnknownFormat`].
    pub fn from_path(path: &Path) -> Result<Self, FileError> {
        by_extension(path, &Self::ALL, Self::extension)
    }
}

fn by_extension<F: Copy>(path: &Path, known: &[F], name: impl Fn(F) -> &'static str) -> Result<F, FileError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    known.iter().copied().find(|format| name(*format) == extension).ok_or_else(|| FileError::UnknownFormat {
        path: path.to_owned(),
        known: known.iter().map(|format| format!(".{}", name(*format))).collect::<Vec<_>>().join(", "),
    })
}

/// Writes a cloud to `path` atomically.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_cloud(path: &Path, format: CloudFormat, cloud: &Cloud) -> Result<(), FileError> {
    atomically(path, |file| write_cloud_to(file, format, cloud))
}

/// Writes a cloud to an empty file.
///
/// # Errors
/// [`ContentError::Io`] if writing fails.
pub fn write_cloud_to(
    out: impl Read + Write + Seek,
    format: CloudFormat,
    cloud: &Cloud,
) -> Result<(), ContentError> {
    if format == CloudFormat::E57 {
        return e57::write(out, &cloud.comments, || Ok(cloud.points.iter().copied().map(Ok)));
    }
    let mut writer = CloudWriter::begin(buffered(out), format, &cloud.comments, cloud.points.len())?;
    writer.add(&cloud.points)?;
    Ok(writer.finish()?.flush()?)
}

/// Converts the cloud of a PLY file to another format, some points at a time. `input` opens the PLY file; E57 reads it
/// twice.
///
/// # Errors
/// [`ContentError::Io`] if writing to `out` or reading `input` fails, otherwise as [`read_cloud`].
pub fn convert_cloud<R: BufRead>(
    input: impl Fn() -> std::io::Result<R>,
    format: CloudFormat,
    out: impl Read + Write + Seek,
) -> Result<(), ContentError> {
    let open = || CloudReader::open(input()?);
    let header = open()?;
    let n_points = header.n_points();
    let comments = header.into_comments();
    if format == CloudFormat::E57 {
        return e57::write(out, &comments, open);
    }
    let mut writer = CloudWriter::begin(buffered(out), format, &comments, n_points as usize)?;
    for point in open()? {
        writer.add(&[point?])?;
    }
    Ok(writer.finish()?.flush()?)
}

fn buffered<W: Write>(out: W) -> BufWriter<W> {
    BufWriter::with_capacity(WRITE_BUFFER_BYTES, out)
}

/// Reads a cloud in the format named by its extension.
///
/// Points in files of other programs need only x, y and z; missing fields are 0 (a σ of 0 means "unknown").
///
/// # Errors
/// [`FileError::UnknownFormat`], [`FileError::Read`], or [`FileError::Malformed`] with the place and the remedy.
pub fn read_cloud(path: &Path) -> Result<Cloud, FileError> {
    let format = CloudFormat::from_path(path)?;
    let file = File::open(path).map_err(|cause| FileError::Read { path: path.to_owned(), cause })?;
    let content = match format {
        CloudFormat::E57 => e57::read(BufReader::new(file)),
        _ => read_cloud_from(&mut BufReader::new(file), format),
    };
    content.map_err(|error| FileError::reading(path, error))
}

/// Reads a cloud from bytes of a known format (E57 is read into memory first).
///
/// # Errors
/// As [`read_cloud`], without the path.
pub fn read_cloud_from(input: &mut dyn BufRead, format: CloudFormat) -> Result<Cloud, ContentError> {
    match format {
        CloudFormat::Ply => ply::read_cloud(input),
        CloudFormat::Csv => csv::read(input),
        CloudFormat::Pcd => pcd::read(input),
        CloudFormat::E57 => {
            let mut bytes = Vec::new();
            input.read_to_end(&mut bytes)?;
            e57::read(std::io::Cursor::new(bytes))
        }
    }
}

/// Writes a mesh to `path` atomically.
///
/// # Errors
/// [`FileError::Write`], or [`FileError::Malformed`] if the format cannot hold so large a mesh.
pub fn write_mesh(path: &Path, format: MeshFormat, mesh: &Mesh) -> Result<(), FileError> {
    atomically(path, |file| {
        let mut out = buffered(file);
        write_mesh_to(&mut out, format, mesh)?;
        Ok(out.flush()?)
    })
}

/// Streams a mesh to `out`.
///
/// # Errors
/// [`ContentError::Io`] if writing fails, [`ContentError::Malformed`] if the format cannot hold so large a mesh.
pub fn write_mesh_to(out: &mut impl Write, format: MeshFormat, mesh: &Mesh) -> Result<(), ContentError> {
    match format {
        MeshFormat::Stl => stl::write(out, mesh),
        MeshFormat::Glb => glb::write(out, mesh),
        MeshFormat::Ply => ply::write_mesh(out, mesh),
    }
}

/// Reads a mesh in the format named by its extension.
///
/// STL repeats every vertex per triangle; identical positions are merged.
///
/// # Errors
/// [`FileError::UnknownFormat`], [`FileError::Read`], or [`FileError::Malformed`] with the place and the remedy.
pub fn read_mesh(path: &Path) -> Result<Mesh, FileError> {
    let format = MeshFormat::from_path(path)?;
    let file = File::open(path).map_err(|cause| FileError::Read { path: path.to_owned(), cause })?;
    read_mesh_from(BufReader::new(file), format).map_err(|error| FileError::reading(path, error))
}

/// Reads a mesh from bytes of a known format.
///
/// # Errors
/// As [`read_mesh`], without the path.
pub fn read_mesh_from(input: impl BufRead, format: MeshFormat) -> Result<Mesh, ContentError> {
    match format {
        MeshFormat::Stl => stl::read(input),
        MeshFormat::Glb => glb::read(input),
        MeshFormat::Ply => ply::read_mesh(input),
    }
}

/// Runs `write` on a hidden temporary file beside `path`, syncs it and renames it.
fn atomically(path: &Path, write: impl FnOnce(&mut File) -> Result<(), ContentError>) -> Result<(), FileError> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let partial = path.with_file_name(format!(".{name}.{}.part", std::process::id()));
    let written = write_and_sync(&partial, write).and_then(|()| Ok(std::fs::rename(&partial, path)?));
    written.map_err(|error| {
        // The write error is returned, not an error of the clean-up.
        let _ = std::fs::remove_file(&partial);
        FileError::writing(path, error)
    })
}

fn write_and_sync(
    partial: &Path,
    write: impl FnOnce(&mut File) -> Result<(), ContentError>,
) -> Result<(), ContentError> {
    let mut file = File::options().read(true).write(true).create(true).truncate(true).open(partial)?;
    write(&mut file)?;
    Ok(file.sync_all()?)
}

/// Number of records to reserve memory for when a header claims `count`.
fn trusted_capacity(count: u64) -> usize {
    count.min(MAX_TRUSTED_COUNT) as usize
}

/// Appends one of `n_records` records without reserving memory for more.
fn push<T>(records: &mut Vec<T>, record: T, n_records: u64) {
    if records.len() == records.capacity() {
        let missing = n_records.saturating_sub(records.len() as u64).max(1);
        records.reserve_exact(records.len().max(1).min(missing as usize));
    }
    records.push(record);
}

/// A comment as one line of text.
fn one_line(comment: &str) -> String {
    comment.replace(['\r', '\n'], " ").trim().to_owned()
}

/// Reads one line of a text header without its line ending; `None` at the end of the file.
fn header_line(input: &mut impl BufRead, line_number: &mut u64) -> Result<Option<String>, ContentError> {
    let mut bytes = Vec::new();
    input.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes)?;
    *line_number += 1;
    if bytes.is_empty() {
        return Ok(None);
    }
    if bytes.len() as u64 == MAX_LINE_BYTES {
        return Err(ContentError::malformed(
            format!("line {line_number}"),
            "the line is too long",
            "check that the content matches the file extension",
        ));
    }
    while matches!(bytes.last(), Some(b'\n' | b'\r')) {
        bytes.pop();
    }
    String::from_utf8(bytes).map(Some).map_err(|_| {
        ContentError::malformed(
            format!("line {line_number}"),
            "text is not UTF-8",
            "check that the content matches the file extension",
        )
    })
}

/// The numeric fields of a point in tabular formats.
const FIELDS: [&str; 9] = ["x", "y", "z", "order", "frame", "u", "v", "intensity", "sigma_mm"];

/// Builds a point from values in the order of [`FIELDS`].
fn point_from_fields(values: &[f64; 9], place: impl Fn() -> String) -> Result<CloudPoint, ContentError> {
    if values.iter().any(|value| !value.is_finite()) {
        return Err(ContentError::malformed(
            place(),
            "a value is not a finite number",
            "remove points without a position from the file",
        ));
    }
    let (order, frame) = (values[3], values[4]);
    if order.fract() != 0.0 || !(-128.0..=127.0).contains(&order) {
        return Err(ContentError::malformed(
            place(),
            format!("order {order} is not an integer from -128 to 127"),
            "write the diffraction order as int8",
        ));
    }
    if frame.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&frame) {
        return Err(ContentError::malformed(
            place(),
            format!("frame {frame} is not an index"),
            "write the frame index as uint32",
        ));
    }
    Ok(CloudPoint {
        x_mm: values[0],
        y_mm: values[1],
        z_mm: values[2],
        order: order as i8,
        frame: frame as u32,
        u_px: values[5] as f32,
        v_px: values[6] as f32,
        intensity: values[7] as f32,
        sigma_mm: values[8] as f32,
    })
}

#[cfg(test)]
mod tests;
