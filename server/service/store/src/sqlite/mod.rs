//! The catalogue in one SQLite file: one writer, a few readers, a write-ahead log that is synced at every commit.

mod changes;
mod error;
mod listing;
mod migrate;
mod named;
mod row;
mod seal;
mod tables;
#[cfg(test)]
mod tests;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use async_trait::async_trait;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};
use sqlx::{ConnectOptions, SqliteConnection, SqlitePool};
use tokio::sync::Mutex;

use crate::artifacts::ArtifactId;
use crate::catalogue::{
    Catalogue, Change, DeliveryFilter, InspectionFilter, Listed, MeasurementFilter, Page, RecipeFilter,
    ScanFilter, SetAside,
};
use crate::error::StoreError;
use crate::files::reserve::Reserve;
use crate::health::Health;
use crate::holds::Holds;
use crate::params::{BACKUPS_FOLDER, BUSY_TIMEOUT, CATALOGUE_FILE, N_READERS, WAL_LIMIT_BYTES};
use crate::records::{
    ActivationRecord, CalibrationRecord, CaptureRecord, DeliveryRecord, DoorRecord, EventRecord,
    IdempotencyRecord, InspectionRecord, JobRecord, JobState, MeasurementRecord, ModelRecord, RecipeRecord,
    RecipeVersionRecord, RecordingRecord, ScanRecord, SessionRecord, SettingRecord, StudyRecord,
};
use crate::sqlite::changes::Committed;

/// The catalogue in an SQLite file.
#[derive(Clone)]
pub struct SqliteCatalogue {
    writer: Arc<Mutex<SqliteConnection>>,
    readers: SqlitePool,
    wal: PathBuf,
    health: Arc<Health>,
    holds: Arc<Holds>,
    reserve: Reserve,
}

impl SqliteCatalogue {
    /// Opens the database of the data directory `folder`, created or migrated if necessary, with a backup first. What its
    /// records refer to is released from `holds`; `reserve` is released for changes that free space.
    ///
    /// # Errors
    /// [`StoreError::TooNew`] if a newer program wrote it, [`StoreError::Database`] if it is damaged.
    pub(crate) async fn open(
        folder: &Path,
        health: Arc<Health>,
        holds: Arc<Holds>,
        reserve: Reserve,
    ) -> Result<Self, StoreError> {
        let (file, backups) = (folder.join(CATALOGUE_FILE), folder.join(BACKUPS_FOLDER));
        let options = connect_options(&file);
        let mut writer = options.connect().await.map_err(|cause| error::opening(cause, "open the database"))?;
        migrate::check(&mut writer).await?;
        migrate::migrate(&mut writer, &migrate::MIGRATIONS, &backups).await?;
        seal::seal_old_rows(&mut writer).await?;
        migrate::check_schema(&mut writer).await?;
        let readers = SqlitePoolOptions::new()
            .max_connections(N_READERS)
            .connect_with(options.pragma("query_only", "ON"))
            .await
            .map_err(|cause| error::opening(cause, "open the database"))?;
        let mut wal = file.as_os_str().to_owned();
        wal.push("-wal");
        let catalogue =
            Self { writer: Arc::new(Mutex::new(writer)), readers, wal: wal.into(), health, holds, reserve };
        catalogue.fold_wal(&mut *catalogue.writer.lock().await).await;
        Ok(catalogue)
    }

    /// Closes the readers; the writer closes when the last clone is dropped.
    pub async fn close(&self) {
        self.readers.close().await;
    }

    /// Writes a copy of the database, as it is now, to the new file `target`.
    pub async fn copy_to(&self, target: &Path) -> Result<(), StoreError> {
        migrate::copy(&mut *self.writer.lock().await, target).await
    }

    /// The same on a separate connection, so that writers do not wait.
    pub(crate) async fn copy_file(folder: &Path, target: &Path) -> Result<(), StoreError> {
        let options = SqliteConnectOptions::new().filename(folder.join(CATALOGUE_FILE)).read_only(true);
        let mut reader = options
            .busy_timeout(BUSY_TIMEOUT)
            .connect()
            .await
            .map_err(|cause| error::opening(cause, "open the database"))?;
        migrate::copy(&mut reader, target).await
    }

    /// On a full disk the reserve is released for changes that free space; a sweep restores it.
    async fn commit_on_any_disk(&self, changes: Vec<Change>) -> Result<Vec<EventRecord>, StoreError> {
        if !changes.iter().any(Change::makes_room) {
            return self.commit_now(changes).await;
        }
        match self.commit_now(changes.clone()).await {
            Err(StoreError::Full) => {
                self.reserve.release()?;
                self.commit_now(changes).await
            }
            committed => committed,
        }
    }

    async fn commit_now(&self, changes: Vec<Change>) -> Result<Vec<EventRecord>, StoreError> {
        self.health.check()?;
        let mut writer = self.writer.lock().await;
        self.health.check()?;
        let Committed { events, named } = changes::apply_all(&mut writer, changes, &self.health).await?;
        self.holds.release(named);
        if std::fs::metadata(&self.wal).is_ok_and(|wal| wal.len() >= WAL_LIMIT_BYTES) {
            self.fold_wal(&mut writer).await;
        }
        Ok(events)
    }

    /// Checkpoints the write-ahead log and truncates it. SQLite would do so automatically, but would not report that
    /// the database could not be synced. If it fails, the commits are still in the log.
    async fn fold_wal(&self, writer: &mut SqliteConnection) {
        let folded = sqlx::raw_sql("PRAGMA wal_checkpoint(TRUNCATE)").execute(&mut *writer).await;
        if let Err(cause) = folded
            && !error::is_busy(&cause)
        {
            // Latched and logged; the next commit is refused.
            let _ = error::writing(cause, "fold the log", &self.health);
        }
    }
}

fn connect_options(file: &Path) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(file)
        .create_if_missing(true)
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full)
        .foreign_keys(true)
        .busy_timeout(BUSY_TIMEOUT)
        .pragma("wal_autocheckpoint", "0")
        .disable_statement_logging()
}

#[async_trait]
impl Catalogue for SqliteCatalogue {
    async fn commit(&self, changes: Vec<Change>) -> Result<Vec<EventRecord>, StoreError> {
        if changes.is_empty() {
            return Ok(Vec::new());
        }
        // A separate task: if the caller is cancelled, no transaction stays open.
        let catalogue = self.clone();
        tokio::spawn(async move { catalogue.commit_on_any_disk(changes).await })
            .await
            .map_err(|cause| StoreError::Database { what: "finish a commit", cause: Box::new(cause) })?
    }

    async fn job(&self, id: &str) -> Result<JobRecord, StoreError> {
        tables::jobs::one(&self.readers, id).await
    }

    async fn jobs(&self, state: Option<JobState>, page: &Page) -> Result<Listed<JobRecord>, StoreError> {
        tables::jobs::page(&self.readers, state, page).await
    }

    async fn queue(&self) -> Result<Listed<JobRecord>, StoreError> {
        tables::jobs::queue(&self.readers).await
    }

    async fn capture(&self, id: &str) -> Result<CaptureRecord, StoreError> {
        tables::captures::one(&self.readers, id).await
    }

    async fn captures(&self, page: &Page) -> Result<Listed<CaptureRecord>, StoreError> {
        tables::captures::page(&self.readers, page).await
    }

    async fn recording(&self, id: &str) -> Result<RecordingRecord, StoreError> {
        tables::recordings::one(&self.readers, id).await
    }

    async fn recordings(&self, page: &Page) -> Result<Listed<RecordingRecord>, StoreError> {
        tables::recordings::page(&self.readers, page).await
    }

    async fn calibration(&self, id: &str) -> Result<CalibrationRecord, StoreError> {
        tables::calibrations::one(&self.readers, id).await
    }

    async fn calibrations(&self, page: &Page) -> Result<Listed<CalibrationRecord>, StoreError> {
        tables::calibrations::page(&self.readers, page).await
    }

    async fn active(&self) -> Result<Option<ActivationRecord>, StoreError> {
        tables::calibrations::active(&self.readers).await
    }

    async fn activations(&self, page: &Page) -> Result<Listed<ActivationRecord>, StoreError> {
        tables::calibrations::activations(&self.readers, page).await
    }

    async fn scan(&self, id: &str) -> Result<ScanRecord, StoreError> {
        tables::scans::one(&self.readers, id).await
    }

    async fn scans(&self, filter: &ScanFilter, page: &Page) -> Result<Listed<ScanRecord>, StoreError> {
        tables::scans::page(&self.readers, filter, page).await
    }

    async fn measurements(
        &self,
        filter: &MeasurementFilter,
        page: &Page,
    ) -> Result<Listed<MeasurementRecord>, StoreError> {
        tables::measurements::page(&self.readers, filter, page).await
    }

    async fn measurement(&self, id: &str) -> Result<MeasurementRecord, StoreError> {
        tables::measurements::one(&self.readers, id).await
    }

    async fn model(&self, id: &str) -> Result<ModelRecord, StoreError> {
        tables::models::one(&self.readers, id).await
    }

    async fn models(&self, page: &Page) -> Result<Listed<ModelRecord>, StoreError> {
        tables::models::page(&self.readers, page).await
    }

    async fn recipe(&self, id: &str) -> Result<RecipeRecord, StoreError> {
        tables::recipes::one(&self.readers, id).await
    }

    async fn recipes(&self, filter: &RecipeFilter, page: &Page) -> Result<Listed<RecipeRecord>, StoreError> {
        tables::recipes::page(&self.readers, filter, page).await
    }

    async fn recipe_version(&self, id: &str, version: i64) -> Result<RecipeVersionRecord, StoreError> {
        tables::recipes::version(&self.readers, id, version).await
    }

    async fn recipe_versions(&self, id: &str, page: &Page) -> Result<Listed<RecipeVersionRecord>, StoreError> {
        tables::recipes::versions(&self.readers, id, page).await
    }

    async fn inspection(&self, id: &str) -> Result<InspectionRecord, StoreError> {
        tables::inspections::one(&self.readers, id).await
    }

    async fn inspections(
        &self,
        filter: &InspectionFilter,
        page: &Page,
    ) -> Result<Listed<InspectionRecord>, StoreError> {
        tables::inspections::page(&self.readers, filter, page).await
    }

    async fn inspections_after(
        &self,
        filter: &InspectionFilter,
        seq: i64,
        limit: u32,
    ) -> Result<Listed<InspectionRecord>, StoreError> {
        tables::inspections::after(&self.readers, filter, seq, limit).await
    }

    async fn session(&self, id: &str) -> Result<SessionRecord, StoreError> {
        tables::sessions::one(&self.readers, id).await
    }

    async fn sessions(&self, page: &Page) -> Result<Listed<SessionRecord>, StoreError> {
        tables::sessions::page(&self.readers, page).await
    }

    async fn study(&self, id: &str) -> Result<StudyRecord, StoreError> {
        tables::studies::one(&self.readers, id).await
    }

    async fn studies(&self, page: &Page) -> Result<Listed<StudyRecord>, StoreError> {
        tables::studies::page(&self.readers, page).await
    }

    async fn setting(&self, name: &str) -> Result<Option<SettingRecord>, StoreError> {
        tables::settings::one(&self.readers, name).await
    }

    async fn events_after(&self, seq: i64, limit: u32) -> Result<Listed<EventRecord>, StoreError> {
        tables::events::after(&self.readers, seq, limit).await
    }

    async fn last_event_seq(&self) -> Result<i64, StoreError> {
        tables::events::last_seq(&self.readers).await
    }

    async fn door(&self, name: &str) -> Result<Option<DoorRecord>, StoreError> {
        tables::doors::one(&self.readers, name).await
    }

    async fn delivery(&self, door: &str, seq: i64) -> Result<DeliveryRecord, StoreError> {
        tables::doors::delivery(&self.readers, door, seq).await
    }

    async fn deliveries(
        &self,
        filter: &DeliveryFilter,
        seq: i64,
        limit: u32,
    ) -> Result<Listed<DeliveryRecord>, StoreError> {
        tables::doors::deliveries(&self.readers, filter, seq, limit).await
    }

    async fn set_aside(&self, door: &str) -> Result<SetAside, StoreError> {
        tables::doors::set_aside(&self.readers, door).await
    }

    async fn idempotency(&self, key: &str) -> Result<Option<IdempotencyRecord>, StoreError> {
        tables::events::idempotency(&self.readers, key).await
    }

    async fn artifacts_named(&self) -> Result<HashSet<ArtifactId>, StoreError> {
        named::artifacts(&self.readers).await
    }
}
