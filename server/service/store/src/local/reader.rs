//! Reading with verification of the hash.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::FileExt as _;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use sha2::{Digest, Sha256};
use tokio::io::{AsyncRead, ReadBuf};

use crate::artifacts::{ArtifactId, ArtifactReader};
use crate::error::StoreError;
use crate::files::bytes::{ArtifactBytes, ByteRanges};
use crate::local::blocking;
use crate::local::place::Place;
use crate::local::writer::id_from;
use crate::params::CHUNK_BYTES;

/// All bytes, verified.
pub fn read(place: &Place, id: &ArtifactId) -> Result<Vec<u8>, StoreError> {
    let bytes = fs::read(place.file(id)).map_err(|cause| place.read_failed(id, cause))?;
    match id_from(Sha256::new_with_prefix(&bytes)) == *id {
        true => Ok(bytes),
        false => Err(damaged(id)),
    }
}

/// Verifies the hash of all bytes.
pub fn check(place: &Place, id: &ArtifactId) -> Result<(), StoreError> {
    let failed = |cause| place.read_failed(id, cause);
    let mut file = File::open(place.file(id)).map_err(failed)?;
    let (mut hash, mut chunk) = (Sha256::new(), vec![0; CHUNK_BYTES]);
    loop {
        match io::Read::read(&mut file, &mut chunk).map_err(failed)? {
            0 => break,
            n_bytes => hash.update(&chunk[..n_bytes]),
        }
    }
    if id_from(hash) == *id { Ok(()) } else { Err(damaged(id)) }
}

/// Random access to the bytes; the hash is not verified.
pub fn bytes(place: &Place, id: &ArtifactId) -> Result<ArtifactBytes, StoreError> {
    let failed = |cause| place.read_failed(id, cause);
    let file = File::open(place.file(id)).map_err(failed)?;
    let size_bytes = file.metadata().map_err(failed)?.len();
    Ok(ArtifactBytes::new(Arc::new(LocalBytes { file, size_bytes })))
}

/// A file that never changes.
struct LocalBytes {
    file: File,
    size_bytes: u64,
}

impl ByteRanges for LocalBytes {
    fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    fn read_at(&self, offset_bytes: u64, buffer: &mut [u8]) -> io::Result<usize> {
        self.file.read_at(buffer, offset_bytes)
    }
}

/// A reader that verifies the hash.
pub async fn open(place: &Arc<Place>, id: &ArtifactId) -> Result<ArtifactReader, StoreError> {
    let (place, id) = (place.clone(), id.clone());
    let opened = id.clone();
    let (file, size_bytes) = blocking(move || {
        let file = File::open(place.file(&opened)).map_err(|cause| place.read_failed(&opened, cause))?;
        let size_bytes = file.metadata().map_err(|cause| place.read_failed(&opened, cause))?.len();
        Ok((file, size_bytes))
    })
    .await?;
    if size_bytes == 0 && id_from(Sha256::new()) != id {
        return Err(damaged(&id));
    }
    let file = tokio::fs::File::from_std(file);
    let bytes = Box::new(Checked { id, file, hash: Sha256::new(), left_bytes: size_bytes });
    Ok(ArtifactReader { size_bytes, bytes })
}

fn damaged(id: &ArtifactId) -> StoreError {
    tracing::error!(id = id.as_str(), "an artifact is damaged");
    StoreError::Damaged { id: id.as_str().to_owned() }
}

/// A file being read. A client that knows the size never reads past the last byte, so the hash is verified with it:
/// the read that would complete a damaged artifact returns an error and no bytes.
struct Checked {
    id: ArtifactId,
    file: tokio::fs::File,
    hash: Sha256,
    left_bytes: u64,
}

impl Checked {
    fn verdict(&self) -> io::Result<()> {
        match id_from(self.hash.clone()) == self.id {
            true => Ok(()),
            false => Err(io::Error::new(io::ErrorKind::InvalidData, damaged(&self.id))),
        }
    }
}

impl AsyncRead for Checked {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        if self.left_bytes == 0 || buf.remaining() == 0 {
            return Poll::Ready(Ok(()));
        }
        let n_before = buf.filled().len();
        ready!(Pin::new(&mut self.file).poll_read(cx, buf))?;
        let new = &buf.filled()[n_before..];
        let n_new = new.len() as u64;
        self.hash.update(new);
        let shrunk_or_grown = n_new == 0 || n_new > self.left_bytes;
        self.left_bytes = self.left_bytes.saturating_sub(n_new);
        if shrunk_or_grown || self.left_bytes == 0 {
            let verdict = self.verdict();
            if verdict.is_err() {
                buf.set_filled(n_before);
                return Poll::Ready(verdict);
            }
        }
        Poll::Ready(Ok(()))
    }
}
