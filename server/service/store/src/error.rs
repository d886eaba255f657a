//! Errors of the store.

use std::borrow::Cow;

use remedy::Remedy;

/// An error of the store.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// No such record.
    #[error("{kind} {id} does not exist")]
    NotFound {
        /// Which collection.
        kind: &'static str,
        /// Which id.
        id: String,
    },
    /// A record with this id already exists.
    #[error("{kind} {id} already exists")]
    Exists {
        /// Which collection.
        kind: &'static str,
        /// Which id.
        id: String,
    },
    /// Changed concurrently.
    #[error("{kind} {id} was changed in the meantime")]
    Changed {
        /// Which collection.
        kind: &'static str,
        /// Which id.
        id: String,
    },
    /// The change is not possible in the current state.
    #[error("{kind} {id} {why}")]
    Refused {
        /// Which collection.
        kind: &'static str,
        /// Which id.
        id: String,
        /// Why; continues the sentence.
        why: String,
        /// What to do instead, if possible.
        remedy: Option<&'static str>,
    },
    /// The disk is full.
    #[error("the disk is full")]
    Full,
    /// A write failed earlier; the store refuses further writes because they could not be guaranteed.
    #[error("the store has been read-only since a write failed ({reason})")]
    ReadOnly {
        /// What failed.
        reason: String,
    },
    /// The bytes of an artifact do not match its id.
    #[error("artifact {id} is damaged")]
    Damaged {
        /// Which.
        id: String,
    },
    /// The checksum of a database row does not match.
    #[error("{kind} {id} is damaged in the database")]
    DamagedRecord {
        /// Which collection.
        kind: &'static str,
        /// Its key as stored.
        id: String,
    },
    /// The data directory was written by a newer program.
    #[error("the data directory has schema {found}, this program supports {known}")]
    TooNew {
        /// Schema found.
        found: i64,
        /// Newest schema known.
        known: i64,
    },
    /// The catalogue does not belong to the artifacts beside it: starting with it would lose them.
    #[error("the catalogue {catalogue} {why}")]
    NotItsCatalogue {
        /// Which file.
        catalogue: String,
        /// What is wrong with it; continues the sentence.
        why: &'static str,
        /// What to do, with the newest backup.
        remedy: String,
    },
    /// The data directory is in use by another process.
    #[error("the data directory {folder} is in use by another process")]
    InUse {
        /// Which.
        folder: String,
    },
    /// The database failed.
    #[error("the catalogue cannot be used: {what}")]
    Database {
        /// What was attempted.
        what: &'static str,
        /// Why.
        #[source]
        cause: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The database is damaged, or not that of this program.
    #[error("the catalogue cannot be used: {what}")]
    Broken {
        /// What was attempted.
        what: &'static str,
        /// What was found.
        #[source]
        cause: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A file failed.
    #[error("cannot {what} {path}")]
    File {
        /// What was attempted.
        what: &'static str,
        /// Which file.
        path: String,
        /// Why.
        #[source]
        cause: std::io::Error,
    },
}

impl Remedy for StoreError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::NotFound { .. } | Self::Exists { .. } | Self::Database { .. } | Self::File { .. } => {
                return None;
            }
            Self::Changed { .. } => "read it again and repeat",
            Self::Refused { remedy, .. } => return remedy.map(Cow::Borrowed),
            Self::Full => "delete captures or scans that are no longer needed",
            Self::ReadOnly { .. } => "check the disk, then restart",
            Self::Damaged { .. } => "restore it from a backup",
            Self::DamagedRecord { .. } => {
                "delete it if it can be created again, or restore the data directory from a backup"
            }
            Self::TooNew { .. } => "use the newer program",
            Self::NotItsCatalogue { remedy, .. } => remedy,
            Self::InUse { .. } => "stop it, or use another --data",
            Self::Broken { .. } => "restore the database from a backup",
        }))
    }
}

impl StoreError {
    /// The same for a check of the whole database; its findings are not retried.
    pub(crate) fn broken(self) -> Self {
        match self {
            Self::Database { what, cause } => Self::Broken { what, cause },
            other => other,
        }
    }
}
