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

/// A text that names no artifact.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("an artifact is named by 64 lower-case hexadecimal digits, not by \"{0}\"")]
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
    /// The id of that text; `None` if it is not 64 lower-case hexadecimal digits.
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
    /// How many there are.
    pub size_bytes: u64,
    /// Checks the hash while it is read; the read that would give the last bytes fails if it is wrong, with
    /// [`StoreError::Damaged`] inside the error.
    pub bytes: Box<dyn AsyncRead + Send + Unpin>,
}

/// An artifact in the making; dropped, it leaves nothing.
#[async_trait]
pub trait ArtifactWriter: Send {
    /// Adds bytes.
    async fn write(&mut self, bytes: &[u8]) -> Result<(), StoreError>;
    /// Makes the bytes durable and names them.
    async fn finish(self: Box<Self>) -> Result<ArtifactId, StoreError>;
}

/// Where artifacts are kept.
#[async_trait]
pub trait Artifacts: Send + Sync {
    /// Begins a new artifact.
    async fn create(&self) -> Result<Box<dyn ArtifactWriter>, StoreError>;
    /// Opens an artifact for reading.
    async fn open(&self, id: &ArtifactId) -> Result<ArtifactReader, StoreError>;
    /// The bytes of an artifact at any place. Its hash is not checked: for formats whose parts carry their own checksums.
    async fn bytes(&self, id: &ArtifactId) -> Result<ArtifactBytes, StoreError>;
    /// Reads an artifact once to its end.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] if its bytes are not those it is named by, [`StoreError::NotFound`] if it is not there.
    async fn check(&self, id: &ArtifactId) -> Result<(), StoreError>;
    /// All bytes of an artifact, checked.
    async fn read(&self, id: &ArtifactId) -> Result<Vec<u8>, StoreError>;
    /// Stores bytes that are in memory.
    async fn put(&self, bytes: &[u8]) -> Result<ArtifactId, StoreError>;
    /// Takes a file of the workbench in, durably; it is gone from there afterwards.
    async fn adopt(&self, file: FinishedFile) -> Result<ArtifactId, StoreError>;
    /// Where files in the making are.
    fn workbench(&self) -> &Workbench;
    /// Keeps an artifact that is there until a record names it anew, as if it had been stored just now.
    ///
    /// # Errors
    /// [`StoreError::NotFound`] if it is not there.
    async fn hold(&self, id: &ArtifactId) -> Result<(), StoreError>;
    /// What was stored or held is named by something that is no record, and that the sweeps know of.
    fn release(&self, id: &ArtifactId);
    /// Deletes artifacts that are not in `kept` and that nobody holds: what this process stored is held until a record
    /// names it. Returns how many bytes became free. Use [`Store::sweep_unreferenced`](crate::Store::sweep_unreferenced).
    async fn sweep(&self, kept: &std::collections::HashSet<ArtifactId>) -> Result<u64, StoreError>;
}
