//! The schema: numbered files, applied in order, each in a transaction, after a copy of what was there.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use sqlx::migrate::Migrator;
use sqlx::{Row, SqliteConnection};

use crate::catalogue::StoreError;
use crate::disk::{Disk, LocalDisk};
use crate::sqlite::error::{self, reading};

/// What this program knows.
pub static MIGRATIONS: Migrator = sqlx::migrate!();

/// Refuses a database whose structure is damaged.
pub async fn check(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    const WHAT: &str = "check the database; restore it from a backup";
    let row = sqlx::query("PRAGMA quick_check(1)").fetch_one(connection).await;
    let verdict: String = row.and_then(|row| row.try_get(0)).map_err(|cause| reading(cause, WHAT))?;
    if verdict == "ok" {
        return Ok(());
    }
    Err(StoreError::Database { what: WHAT, cause: verdict.into() })
}

/// Brings the schema to the newest of `migrations`. An existing database is copied to `backups` before.
pub async fn migrate(
    connection: &mut SqliteConnection,
    migrations: &Migrator,
    backups: &Path,
) -> Result<(), StoreError> {
    let known = migrations.iter().map(|migration| migration.version).max().unwrap_or(0);
    let found = schema_version(connection).await?;
    if found > known {
        return Err(StoreError::TooNew { found, known });
    }
    if found > 0 && found < known {
        copy(connection, &backups.join(backup_name(found))).await?;
    }
    migrations
        .run_direct(None, connection, false)
        .await
        .map_err(|cause| StoreError::Database { what: "migrate the database", cause: Box::new(cause) })
}

/// The newest migration that was applied; 0 in a new database.
async fn schema_version(connection: &mut SqliteConnection) -> Result<i64, StoreError> {
    const WHAT: &str = "read the schema's version";
    let table = sqlx::query("SELECT name FROM sqlite_master WHERE name = '_sqlx_migrations'")
        .fetch_optional(&mut *connection)
        .await
        .map_err(|cause| reading(cause, WHAT))?;
    if table.is_none() {
        return Ok(0);
    }
    sqlx::query_scalar("SELECT COALESCE(MAX(version), 0) FROM _sqlx_migrations")
        .fetch_one(connection)
        .await
        .map_err(|cause| reading(cause, WHAT))
}

/// The wall clock only keeps the names of several copies apart.
fn backup_name(version: i64) -> String {
    let now_ms = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis());
    format!("catalogue-schema-{version}-{now_ms}.sqlite3")
}

/// Writes a durable copy of the database to the new file `target`.
pub async fn copy(connection: &mut SqliteConnection, target: &Path) -> Result<(), StoreError> {
    const WHAT: &str = "copy the database";
    let text =
        target.to_str().ok_or_else(|| StoreError::Database { what: WHAT, cause: "path is not UTF-8".into() })?;
    sqlx::query("VACUUM INTO $1")
        .bind(text)
        .execute(connection)
        .await
        .map_err(|cause| error::opening(cause, WHAT))?;
    sync(target).map_err(|cause| StoreError::File { what: "sync", path: text.to_owned(), cause })
}

fn sync(file: &Path) -> std::io::Result<()> {
    LocalDisk.sync_file(&std::fs::File::open(file)?)?;
    LocalDisk.sync_folder(file.parent().unwrap_or(Path::new(".")))
}
