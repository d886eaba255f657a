//! Why the store did not do what it was asked.

/// Why the store did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// No such record.
    #[error("there is no {kind} {id}")]
    NotFound {
        /// Which collection.
        kind: &'static str,
        /// Which id.
        id: String,
    },
    /// A record of that id is there already.
    #[error("{kind} {id} exists already")]
    Exists {
        /// Which collection.
        kind: &'static str,
        /// Which id.
        id: String,
    },
    /// Somebody else was faster.
    #[error("{kind} {id} has changed meanwhile; read it again and repeat")]
    Changed {
        /// Which collection.
        kind: &'static str,
        /// Which id.
        id: String,
    },
    /// The change makes no sense in the present state.
    #[error("{kind} {id} {why}")]
    Refused {
        /// Which collection.
        kind: &'static str,
        /// Which id.
        id: String,
        /// Why, in words that continue the sentence.
        why: String,
    },
    /// No room.
    #[error("the disk is full; delete captures or scans that are no longer needed")]
    Full,
    /// A write failed before; nothing is written any more, so that nothing is promised that is not kept.
    #[error("the store is read-only since a write failed ({reason}); check the disk, then restart")]
    ReadOnly {
        /// What failed.
        reason: String,
    },
    /// The bytes of an artifact are not those it is named by.
    #[error("artifact {id} is damaged; restore it from a backup")]
    Damaged {
        /// Which.
        id: String,
    },
    /// A row of the database is not what was written.
    #[error(
        "{kind} {id} is damaged in the database; delete it if it can be made again, or restore the data \
         directory from a backup"
    )]
    DamagedRecord {
        /// Which collection.
        kind: &'static str,
        /// Its key, as it is found.
        id: String,
    },
    /// The data directory was written by a newer program.
    #[error("the data directory has schema {found}, this program knows {known}; use the newer program")]
    TooNew {
        /// Schema found.
        found: i64,
        /// Newest schema known.
        known: i64,
    },
    /// The catalogue is not the one of the artifacts beside it: starting on it would lose what they are.
    #[error("the catalogue {catalogue} {why}; {remedy}")]
    NotItsCatalogue {
        /// Which file.
        catalogue: String,
        /// What is wrong with it, in words that continue the sentence.
        why: &'static str,
        /// What to do, with the newest backup.
        remedy: String,
    },
    /// Another process has the data directory.
    #[error("the data directory {folder} is in use by another process; stop it or choose another --data")]
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
