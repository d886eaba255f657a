//! Clouds written in pieces: no more points in memory than one call hands over.

use std::io::Write;
use std::path::Path;

use super::{CloudFormat, ContentError, FileError, atomically, buffered, csv, pcd, ply};
use crate::points::cloud::CloudPoint;

/// The formats that are written from front to back; E57 is not, its header holds offsets known last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stream {
    Ply,
    Csv,
    Pcd,
}

/// A cloud file in the making.
#[derive(Debug)]
pub struct CloudWriter<W: Write> {
    out: W,
    format: Stream,
    /// Points that the header promises and that have not come yet.
    n_missing: u64,
    /// Bytes of the points being written; its memory is used again.
    chunk: Vec<u8>,
}

impl<W: Write> CloudWriter<W> {
    /// Writes the header. `n_points` points must follow.
    ///
    /// # Errors
    /// [`ContentError::Io`] if `out` refuses; [`ContentError::Malformed`] for E57, which is no stream.
    pub fn begin(
        mut out: W,
        format: CloudFormat,
        comments: &[String],
        n_points: usize,
    ) -> Result<Self, ContentError> {
        let format = match format {
            CloudFormat::Ply => ply::write_cloud_header(&mut out, comments, n_points).map(|()| Stream::Ply),
            CloudFormat::Csv => csv::write_header(&mut out, comments).map(|()| Stream::Csv),
            CloudFormat::Pcd => pcd::write_header(&mut out, comments, n_points).map(|()| Stream::Pcd),
            CloudFormat::E57 => {
                Err(ContentError::malformed("E57", "its header is known last", "write the whole cloud at once"))
            }
        }?;
        Ok(Self { out, format, n_missing: n_points as u64, chunk: Vec::new() })
    }

    /// Adds the next points.
    ///
    /// # Errors
    /// [`ContentError::Io`] if `out` refuses, [`ContentError::Malformed`] for more points than were promised.
    pub fn add(&mut self, points: &[CloudPoint]) -> Result<(), ContentError> {
        self.n_missing = self.n_missing.checked_sub(points.len() as u64).ok_or_else(wrong_count)?;
        match self.format {
            Stream::Ply | Stream::Pcd => ply::write_vertices(&mut self.out, points, &mut self.chunk),
            Stream::Csv => csv::write_points(&mut self.out, points),
        }
    }

    /// Gives the output back.
    ///
    /// # Errors
    /// [`ContentError::Malformed`] for fewer points than were promised.
    pub fn finish(self) -> Result<W, ContentError> {
        if self.n_missing > 0 { Err(wrong_count()) } else { Ok(self.out) }
    }
}

fn wrong_count() -> ContentError {
    ContentError::malformed("points", "there are not as many as the header says", "write the file again")
}

/// Adds the next points.
pub type AddPoints<'a, E> = &'a mut dyn FnMut(&[CloudPoint]) -> Result<(), E>;

/// Writes a file of any format but E57 whole or not at all; `add_points` hands over its `n_points` points, some at a
/// time.
///
/// # Errors
/// What `add_points` answers; [`FileError::Write`] if the disk refuses, [`FileError::Malformed`] for E57, or for another
/// number of points.
pub fn write_cloud_in_pieces<E: From<FileError>>(
    path: &Path,
    format: CloudFormat,
    comments: &[String],
    n_points: usize,
    add_points: impl FnOnce(AddPoints<E>) -> Result<(), E>,
) -> Result<(), E> {
    let mut ended = Ok(());
    let written = atomically(path, |file| {
        let mut writer = CloudWriter::begin(buffered(file), format, comments, n_points)?;
        ended =
            add_points(&mut |points| writer.add(points).map_err(|error| E::from(FileError::writing(path, error))));
        match ended {
            Ok(()) => Ok(writer.finish()?.flush()?),
            // Nothing is kept of the file; why, says `ended`.
            Err(_) => Err(ContentError::Io(std::io::ErrorKind::Interrupted.into())),
        }
    });
    ended?;
    Ok(written?)
}
