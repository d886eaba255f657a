//! Schema migrations: numbered files, applied in order, each in a transaction, after a backup of the database.

use std::path::Path;
use std::sync::LazyLock;
use std::time::{SystemTime, UNIX_EPOCH};

use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::{Connection, Row, SqlStr, SqliteConnection};

use crate::error::StoreError;
use crate::files::disk::{Disk, LocalDisk};
use crate::sqlite::error::{self, reading};
use crate::sqlite::seal;

/// The migrations of this version.
pub static MIGRATIONS: LazyLock<Migrator> = LazyLock::new(|| {
    let numbered = [
        (1, "station", include_str!("../../migrations/0001_station.sql")),
        (2, "seals", include_str!("../../migrations/0002_seals.sql")),
        (3, "settings", include_str!("../../migrations/0003_settings.sql")),
        (4, "recordings", include_str!("../../migrations/0004_recordings.sql")),
        (5, "recipes", include_str!("../../migrations/0005_recipes.sql")),
        (6, "doors", include_str!("../../migrations/0006_doors.sql")),
        (7, "studies", include_str!("../../migrations/0007_studies.sql")),
        (8, "models", include_str!("../../migrations/0008_models.sql")),
    ];
    let migration = |(version, name, sql): (i64, &'static str, &'static str)| {
        Migration::new(version, name.into(), MigrationType::Simple, SqlStr::from_static(sql), false)
    };
    Migrator::with_migrations(numbered.map(migration).into())
});

/// Refuses a database with a damaged structure or incomplete indices.
pub async fn check(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    const WHAT: &str = "check the database";
    let row = sqlx::query("PRAGMA integrity_check(1)").fetch_one(connection).await;
    let verdict: String = row.and_then(|row| row.try_get(0)).map_err(|cause| reading(cause, WHAT).broken())?;
    if verdict == "ok" {
        return Ok(());
    }
    Err(StoreError::Broken { what: WHAT, cause: verdict.into() })
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
        let backup = backups.join(backup_name(found));
        // An incomplete copy is useless and takes disk space.
        copy(connection, &backup).await.inspect_err(|_| drop(std::fs::remove_file(&backup)))?;
    }
    migrations
        .run_direct(None, connection, false)
        .await
        .map_err(|cause| StoreError::Database { what: "migrate the database", cause: Box::new(cause) })
}

/// Refuses a database whose schema differs from the one the migrations create.
pub async fn check_schema(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    const WHAT: &str = "check the tables";
    let failed = |cause| reading(cause, WHAT).broken();
    let mut fresh = SqliteConnection::connect("sqlite::memory:").await.map_err(failed)?;
    MIGRATIONS
        .run_direct(None, &mut fresh, false)
        .await
        .map_err(|cause| StoreError::Database { what: WHAT, cause: Box::new(cause) })?;
    seal::seal_old_rows(&mut fresh).await?;
    if schema(connection).await.map_err(failed)? == schema(&mut fresh).await.map_err(failed)? {
        return Ok(());
    }
    Err(StoreError::Broken { what: WHAT, cause: "the schema is not that of this program".into() })
}

/// The schema as SQLite stores it.
async fn schema(connection: &mut SqliteConnection) -> Result<Vec<Vec<u8>>, sqlx::Error> {
    const NOTED: &str = "SELECT CAST(type || '|' || name || '|' || tbl_name || '|' || COALESCE(sql, '') AS BLOB)
        FROM sqlite_master ORDER BY 1";
    sqlx::query_scalar(NOTED).fetch_all(connection).await
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

/// The wall clock only makes the names of copies unique.
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

#[cfg(test)]
mod tests {
    use std::fs;

    use sqlx::ConnectOptions;
    use sqlx::sqlite::SqliteConnectOptions;

    use remedy::Remedy as _;

    use super::*;

    const LATER: &str = "ALTER TABLE jobs ADD COLUMN note TEXT NOT NULL DEFAULT 'none';";
    const BROKEN: &str = "ALTER TABLE jobs ADD COLUMN note TEXT; INSERT INTO nowhere VALUES (1);";

    async fn connect(file: &Path) -> SqliteConnection {
        SqliteConnectOptions::new().filename(file).create_if_missing(true).connect().await.unwrap()
    }

    /// The newest version that this program knows.
    fn newest() -> i64 {
        MIGRATIONS.iter().map(|known| known.version).max().unwrap()
    }

    /// The migrations of a program that also knows `later`.
    async fn later_program(folder: &Path, later: &str) -> Migrator {
        let migrations = folder.join("migrations");
        fs::create_dir_all(&migrations).unwrap();
        for known in MIGRATIONS.iter() {
            let name = format!("{:04}_{}.sql", known.version, known.description);
            fs::write(migrations.join(name), known.sql.as_str()).unwrap();
        }
        fs::write(migrations.join(format!("{:04}_note.sql", newest() + 1)), later).unwrap();
        Migrator::new(migrations.as_path()).await.unwrap()
    }

    fn backups(folder: &Path) -> Vec<std::path::PathBuf> {
        let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        entries
            .filter(|path| path.file_name().unwrap().to_string_lossy().starts_with("catalogue-schema-"))
            .collect()
    }

    async fn first_version(folder: &Path) -> SqliteConnection {
        let mut connection = connect(&folder.join("catalogue.sqlite3")).await;
        migrate(&mut connection, &MIGRATIONS, folder).await.unwrap();
        sqlx::query("UPDATE sequences SET value = 41 WHERE name = 'event'")
            .execute(&mut connection)
            .await
            .unwrap();
        connection
    }

    async fn counter(connection: &mut SqliteConnection) -> i64 {
        sqlx::query_scalar("SELECT value FROM sequences WHERE name = 'event'").fetch_one(connection).await.unwrap()
    }

    #[tokio::test]
    async fn a_new_database_gets_the_schema_and_no_backup() {
        let folder = tempfile::tempdir().unwrap();
        let mut connection = first_version(folder.path()).await;
        assert_eq!(schema_version(&mut connection).await.unwrap(), newest());
        migrate(&mut connection, &MIGRATIONS, folder.path()).await.unwrap();
        assert!(backups(folder.path()).is_empty());
        check(&mut connection).await.unwrap();
    }

    #[tokio::test]
    async fn an_older_database_is_backed_up_and_migrated_with_its_records() {
        let folder = tempfile::tempdir().unwrap();
        let mut connection = first_version(folder.path()).await;
        let later = later_program(folder.path(), LATER).await;
        migrate(&mut connection, &later, folder.path()).await.unwrap();
        assert_eq!(schema_version(&mut connection).await.unwrap(), newest() + 1);
        assert_eq!(counter(&mut connection).await, 41);
        sqlx::query("SELECT note FROM jobs").fetch_all(&mut connection).await.unwrap();

        let [backup] = &backups(folder.path())[..] else { panic!("one backup") };
        let mut copy = connect(backup).await;
        assert_eq!((schema_version(&mut copy).await.unwrap(), counter(&mut copy).await), (newest(), 41));
    }

    #[tokio::test]
    async fn a_migration_that_fails_leaves_the_database_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let mut connection = first_version(folder.path()).await;
        let later = later_program(folder.path(), BROKEN).await;
        migrate(&mut connection, &later, folder.path()).await.unwrap_err();
        connection.close().await.unwrap();
        let mut connection = connect(&folder.path().join("catalogue.sqlite3")).await;
        assert_eq!(
            (schema_version(&mut connection).await.unwrap(), counter(&mut connection).await),
            (newest(), 41)
        );
        assert!(sqlx::query("SELECT note FROM jobs").fetch_all(&mut connection).await.is_err());
        migrate(&mut connection, &MIGRATIONS, folder.path()).await.unwrap();
    }

    #[tokio::test]
    async fn an_older_program_refuses_newer_data() {
        let folder = tempfile::tempdir().unwrap();
        let mut connection = first_version(folder.path()).await;
        let later = later_program(folder.path(), LATER).await;
        migrate(&mut connection, &later, folder.path()).await.unwrap();
        let error = migrate(&mut connection, &MIGRATIONS, folder.path()).await.unwrap_err();
        assert!(
            matches!(error, StoreError::TooNew { found, known } if (found, known) == (newest() + 1, newest())),
            "{error}"
        );
    }

    #[tokio::test]
    async fn a_database_whose_structure_is_damaged_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("catalogue.sqlite3");
        first_version(folder.path()).await.close().await.unwrap();
        let mut bytes = fs::read(&file).unwrap();
        let page_2 = 4096..4096 + 64;
        bytes[page_2].fill(0xff);
        fs::write(&file, bytes).unwrap();
        let mut connection = connect(&file).await;
        let error = check(&mut connection).await.unwrap_err();
        assert!(error.remedy().unwrap().contains("backup"), "{error}");
    }
}
