//! Artifacts: immutable bytes, named by their hash.

use async_trait::async_trait;
use serde::{Deserialize, Serialize};
use tokio::io::AsyncRead;

use crate::error::StoreError;
use crate::files::bytes::ArtifactBytes;
use crate::files::workbench::{FinishedFile, Workbench};

/// The SHA-256 of an artifact's bytes, lower-case hexadecimal.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ArtifactId(String);

/// Invalid artifact id.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("an artifact id has 64 lower-case hexadecimal digits, got \"{0}\"")]
pub struct NotAnArtifactId(String);

impl TryFrom<String> for ArtifactId {
    type Error = NotAnArtifactId;

    fn try_from(text: String) -> Result<Self, NotAnArtifactId> {
        Self::parse(&text).ok_or(NotAnArtifactId(text))
    }
}

impl From<ArtifactId> for String {
    fn from(id: ArtifactId) -> Self {
        id.0
    }
}

impl ArtifactId {
    /// Parses an id; `None` if it is not 64 lower-case hexadecimal digits.
    pub fn parse(text: &str) -> Option<Self> {
        let hex = text.len() == 64 && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
        hex.then(|| Self(text.to_owned()))
    }

    /// As text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// The bytes of an artifact.
pub struct ArtifactReader {
    /// Number of bytes.
    pub size_bytes: u64,
    /// Verifies the hash while reading; if it does not match, the read that would return the last bytes fails with
    /// [`StoreError::Damaged`] inside the error.
    pub bytes: Box<dyn AsyncRead + Send + Unpin>,
}

/// An artifact being written; dropping it discards the bytes.
#[async_trait]
pub trait ArtifactWriter: Send {
    /// Adds bytes.
    async fn write(&mut self, bytes: &[u8]) -> Result<(), StoreError>;
    /// Makes the bytes durable and returns their id.
    async fn finish(self: Box<Self>) -> Result<ArtifactId, StoreError>;
}

/// Storage of artifacts.
#[async_trait]
pub trait Artifacts: Send + Sync {
    /// Begins a new artifact.
    async fn create(&self) -> Result<Box<dyn ArtifactWriter>, StoreError>;
    /// Opens an artifact for reading.
    async fn open(&self, id: &ArtifactId) -> Result<ArtifactReader, StoreError>;
    /// Random access to the bytes of an artifact. Its hash is not verified: for formats whose parts carry their own
    /// checksums.
    async fn bytes(&self, id: &ArtifactId) -> Result<ArtifactBytes, StoreError>;
    /// Reads an artifact once to its end.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] if its bytes do not match its id, [`StoreError::NotFound`] if it does not exist.
    async fn check(&self, id: &ArtifactId) -> Result<(), StoreError>;
    /// All bytes of an artifact, checked.
    async fn read(&self, id: &ArtifactId) -> Result<Vec<u8>, StoreError>;
    /// Stores bytes from memory.
    async fn put(&self, bytes: &[u8]) -> Result<ArtifactId, StoreError>;
    /// Moves a file of the workbench into the store, durably.
    async fn adopt(&self, file: FinishedFile) -> Result<ArtifactId, StoreError>;
    /// The workbench for temporary files.
    fn workbench(&self) -> &Workbench;
    /// Holds an existing artifact until a record refers to it, as if it had just been stored.
    ///
    /// # Errors
    /// [`StoreError::NotFound`] if it does not exist.
    async fn hold(&self, id: &ArtifactId) -> Result<(), StoreError>;
    /// Releases a stored or held artifact that is referenced by something other than a record, which the sweeps consider.
    fn release(&self, id: &ArtifactId);
    /// Deletes artifacts that are not in `kept` and not held: artifacts stored by this process are held until a record
    /// refers to them. Returns the freed bytes. Use [`Store::sweep_unreferenced`](crate::Store::sweep_unreferenced).
    async fn sweep(&self, kept: &std::collections::HashSet<ArtifactId>) -> Result<u64, StoreError>;
}
