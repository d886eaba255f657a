//! Clouds written in pieces; only the points of one call are in memory.

use std::io::Write;
use std::path::Path;

use super::{CloudFormat, ContentError, FileError, atomically, buffered, csv, pcd, ply};
use crate::points::cloud::CloudPoint;

/// Formats written front to back; not E57, whose header holds offsets known only at the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StreamFormat {
    Ply,
    Csv,
    Pcd,
}

/// A cloud file being written.
#[derive(Debug)]
pub struct CloudWriter<W: Write> {
    out: W,
    format: StreamFormat,
    /// Points stated in the header that have not been added yet.
    n_missing: u64,
    /// Bytes of the points being written; its memory is reused.
    chunk: Vec<u8>,
}

impl<W: Write> CloudWriter<W> {
    /// Writes the header. `n_points` points must follow.
    ///
    /// # Errors
    /// [`ContentError::Io`] if writing fails; [`ContentError::Malformed`] for E57, which cannot be streamed.
    pub fn begin(
        mut out: W,
        format: CloudFormat,
        comments: &[String],
        n_points: usize,
    ) -> Result<Self, ContentError> {
        let format = match format {
            CloudFormat::Ply => ply::write_cloud_header(&mut out, comments, n_points).map(|()| StreamFormat::Ply),
            CloudFormat::Csv => csv::write_header(&mut out, comments).map(|()| StreamFormat::Csv),
            CloudFormat::Pcd => pcd::write_header(&mut out, comments, n_points).map(|()| StreamFormat::Pcd),
            CloudFormat::E57 => Err(ContentError::malformed(
                "E57",
                "its header is written last, so it cannot be streamed",
                "write the whole cloud at once",
            )),
        }?;
        Ok(Self { out, format, n_missing: n_points as u64, chunk: Vec::new() })
    }

    /// Adds the next points.
    ///
    /// # Errors
    /// [`ContentError::Io`] if writing fails, [`ContentError::Malformed`] for more points than stated.
    pub fn add(&mut self, points: &[CloudPoint]) -> Result<(), ContentError> {
        self.n_missing = self.n_missing.checked_sub(points.len() as u64).ok_or_else(wrong_count)?;
        match self.format {
            StreamFormat::Ply | StreamFormat::Pcd => ply::write_vertices(&mut self.out, points, &mut self.chunk),
            StreamFormat::Csv => csv::write_points(&mut self.out, points),
        }
    }

    /// Ends the file and returns the output.
    ///
    /// # Errors
    /// [`ContentError::Malformed`] for fewer points than stated.
    pub fn finish(self) -> Result<W, ContentError> {
        if self.n_missing > 0 { Err(wrong_count()) } else { Ok(self.out) }
    }
}

fn wrong_count() -> ContentError {
    ContentError::malformed("points", "their number differs from the header", "write the file again")
}

/// Callback that adds the next points.
pub type AddPoints<'a, E> = &'a mut dyn FnMut(&[CloudPoint]) -> Result<(), E>;

/// Writes a file of any format but E57 atomically; `add_points` passes its `n_points` points, some at a time.
///
/// # Errors
/// An error of `add_points`; [`FileError::Write`], or [`FileError::Malformed`] for E57 or for another number of points.
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
            // The file is discarded; the reason is in `ended`.
            Err(_) => Err(ContentError::Io(std::io::ErrorKind::Interrupted.into())),
        }
    });
    ended?;
    Ok(written?)
}
