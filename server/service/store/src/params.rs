//! Names, sizes and limits of the data directory.

use std::time::Duration;

/// The database.
pub const CATALOGUE_FILE: &str = "catalogue.sqlite3";
/// Lock file of the process that uses the data directory.
pub const LOCK_FILE: &str = "lock";
/// The reserve file, deleted when the disk is full.
pub const RESERVE_FILE: &str = "reserve";
/// Artifacts by hash.
pub const ARTIFACTS_FOLDER: &str = "artifacts";
/// In the folder of the artifacts: the id of their station.
pub const STATION_FILE: &str = "station";
/// Unfinished files; emptied at start.
pub const SCRATCH_FOLDER: &str = "scratch";
/// Prefix of the name of a folder with artifacts that a restored catalogue does not refer to.
pub const SET_ASIDE_FOLDER: &str = "set-aside";
/// Copies of the database, made daily and before migrations.
pub const BACKUPS_FOLDER: &str = "backups";

/// Interval between copies of the database.
pub const BACKUP_PERIOD: Duration = Duration::from_secs(24 * 3600);
/// Number of daily copies kept.
pub const BACKUPS_KEPT: usize = 7;
/// Free space below which no copy is made: the rest is needed for records.
pub const BACKUP_FLOOR_BYTES: u64 = 256 * 1024 * 1024;

/// Size of the reserve: the write-ahead log of many deletions ([`WAL_LIMIT_BYTES`]) and its checkpoint fit in twice.
pub const RESERVE_BYTES: u64 = 16 * 1024 * 1024;
/// Size of the write-ahead log at which a checkpoint is made: rare enough to cost nothing per commit,
/// small enough to be read in a moment at the next start.
pub const WAL_LIMIT_BYTES: u64 = 4 * 1024 * 1024;
/// How long an artifact that no record refers to is held: the longest job takes a tenth of it between storing what it
/// made and committing the record. Artifacts of a failed job are deleted after it, or by the first sweep of the next
/// process.
pub const HOLD_LIMIT: Duration = Duration::from_secs(6 * 3600);
/// How long a connection waits for another one. Readers hold no lock for longer than one page of records takes.
pub const BUSY_TIMEOUT: Duration = Duration::from_secs(5);
/// Readers do not wait for the writer, and seldom for each other.
pub const N_READERS: u32 = 4;

/// Bytes hashed and written at once.
pub const CHUNK_BYTES: usize = 1024 * 1024;
