//! Random access to the bytes of an artifact.

use std::fmt;
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::Arc;

/// Bytes that can be read in ranges by any number of threads at once: a local file, or an object in a store that
/// supports range requests.
pub trait ByteRanges: Send + Sync {
    /// Number of bytes.
    fn size_bytes(&self) -> u64;

    /// Reads from `offset_bytes` into `buffer`, like [`std::io::Read::read`]; 0 after the last byte. Blocks.
    ///
    /// # Errors
    /// If the underlying storage fails.
    fn read_at(&self, offset_bytes: u64, buffer: &mut [u8]) -> io::Result<usize>;
}

/// A read cursor over the bytes of an artifact. Each clone has its own position. Reading blocks.
#[derive(Clone)]
pub struct ArtifactBytes {
    ranges: Arc<dyn ByteRanges>,
    offset_bytes: u64,
}

impl ArtifactBytes {
    /// At the first byte.
    pub fn new(ranges: Arc<dyn ByteRanges>) -> Self {
        Self { ranges, offset_bytes: 0 }
    }

    /// Number of bytes.
    pub fn size_bytes(&self) -> u64 {
        self.ranges.size_bytes()
    }

    /// The same bytes, with the cursor at the first one.
    pub fn from_start(&self) -> Self {
        Self::new(self.ranges.clone())
    }
}

impl fmt::Debug for ArtifactBytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at byte {} of {}", self.offset_bytes, self.size_bytes())
    }
}

impl Read for ArtifactBytes {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n_bytes = self.ranges.read_at(self.offset_bytes, buffer)?;
        self.offset_bytes += n_bytes as u64;
        Ok(n_bytes)
    }
}

impl Seek for ArtifactBytes {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let offset_bytes = match to {
            SeekFrom::Start(offset_bytes) => Some(offset_bytes),
            SeekFrom::Current(by) => self.offset_bytes.checked_add_signed(by),
            SeekFrom::End(by) => self.size_bytes().checked_add_signed(by),
        };
        self.offset_bytes = offset_bytes
            .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "a position before the first byte"))?;
        Ok(self.offset_bytes)
    }
}
