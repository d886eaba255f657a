//! Writing to a scratch file while hashing.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use async_trait::async_trait;
use sha2::{Digest, Sha256};

use crate::artifacts::{ArtifactId, ArtifactWriter};
use crate::error::StoreError;
use crate::local::place::Place;
use crate::local::{blocking, file_error};
use crate::params::CHUNK_BYTES;

/// A scratch file with the hash of its bytes; deleted when dropped.
struct Draft {
    place: Arc<Place>,
    file: File,
    path: PathBuf,
    hash: Sha256,
    size_bytes: u64,
}

impl Draft {
    fn new(place: Arc<Place>) -> Result<Self, StoreError> {
        let (file, path) = place.new_scratch_file()?;
        Ok(Self { place, file, path, hash: Sha256::new(), size_bytes: 0 })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), StoreError> {
        self.place.check_writable()?;
        let written = self.place.disk().write(&mut self.file, bytes);
        written.map_err(|cause| self.place.write_failed("write", &self.path, cause))?;
        self.hash.update(bytes);
        self.size_bytes += bytes.len() as u64;
        Ok(())
    }

    fn keep(self) -> Result<ArtifactId, StoreError> {
        self.place.check_writable()?;
        let id = id_from(self.hash.clone());
        self.place.keep(&self.file, &self.path, &id, self.size_bytes)?;
        Ok(id)
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        // Already renamed if it was kept; the folder is emptied at the next start if this fails.
        let _ = fs::remove_file(&self.path);
    }
}

/// The id from a finished hash.
pub fn id_from(hash: Sha256) -> ArtifactId {
    let text: String = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    ArtifactId::parse(&text).expect("SHA-256 has 32 bytes, two digits each")
}

/// An artifact being written. Bytes are buffered, then hashed and written on a blocking thread.
pub struct LocalWriter {
    draft: Option<Draft>,
    gathered: Vec<u8>,
}

impl LocalWriter {
    /// An empty artifact.
    pub async fn create(place: Arc<Place>) -> Result<Self, StoreError> {
        let draft = blocking(move || Draft::new(place)).await?;
        Ok(Self { draft: Some(draft), gathered: Vec::new() })
    }

    /// After an error or an abandoned write, no more bytes can be added.
    fn take(&mut self) -> Result<Draft, StoreError> {
        self.draft.take().ok_or_else(|| {
            let cause = std::io::Error::other("an earlier write did not finish");
            file_error("write", Path::new("an artifact"), cause)
        })
    }

    async fn flush(&mut self) -> Result<(), StoreError> {
        let mut draft = self.take()?;
        let bytes = std::mem::take(&mut self.gathered);
        let (draft, mut bytes) = blocking(move || {
            draft.write(&bytes)?;
            Ok((draft, bytes))
        })
        .await?;
        bytes.clear();
        self.draft = Some(draft);
        self.gathered = bytes;
        Ok(())
    }
}

#[async_trait]
impl ArtifactWriter for LocalWriter {
    async fn write(&mut self, bytes: &[u8]) -> Result<(), StoreError> {
        for chunk in bytes.chunks(CHUNK_BYTES) {
            self.gathered.extend_from_slice(chunk);
            if self.gathered.len() >= CHUNK_BYTES {
                self.flush().await?;
            }
        }
        Ok(())
    }

    async fn finish(mut self: Box<Self>) -> Result<ArtifactId, StoreError> {
        self.flush().await?;
        let draft = self.take()?;
        blocking(move || draft.keep()).await
    }
}

/// Stores bytes; existing artifacts are not written again.
pub fn put(place: &Arc<Place>, bytes: &[u8]) -> Result<ArtifactId, StoreError> {
    place.check_writable()?;
    let id = id_from(Sha256::new_with_prefix(bytes));
    if place.hold_existing(&id, bytes.len() as u64)? {
        return Ok(id);
    }
    // Held again when the draft is kept.
    let written = write_new(place, bytes);
    place.holds().release([id]);
    written
}

fn write_new(place: &Arc<Place>, bytes: &[u8]) -> Result<ArtifactId, StoreError> {
    let mut draft = Draft::new(place.clone())?;
    draft.write(bytes)?;
    draft.keep()
}

/// Moves a finished file of `scratch` into the store.
pub fn adopt(place: &Place, path: &Path) -> Result<ArtifactId, StoreError> {
    place.check_writable()?;
    let cannot = |cause| file_error("adopt", path, cause);
    let folder = fs::canonicalize(path.parent().unwrap_or(path)).map_err(cannot)?;
    let own = folder.starts_with(fs::canonicalize(place.scratch()).map_err(cannot)?);
    if !own || !fs::symlink_metadata(path).map_err(cannot)?.is_file() {
        return Err(cannot(std::io::Error::other("it is not a file in the scratch folder")));
    }
    let mut file = File::open(path).map_err(cannot)?;
    let mut hash = Sha256::new();
    let mut size_bytes = 0;
    let mut chunk = vec![0; CHUNK_BYTES];
    loop {
        let n_bytes = file.read(&mut chunk).map_err(cannot)?;
        if n_bytes == 0 {
            break;
        }
        hash.update(&chunk[..n_bytes]);
        size_bytes += n_bytes as u64;
    }
    let id = id_from(hash);
    place.keep(&file, path, &id, size_bytes)?;
    Ok(id)
}
