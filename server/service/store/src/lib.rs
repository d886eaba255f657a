//! Persistent storage of a station: a catalogue of records and the artifacts they refer to.
//!
//! A change for which `Ok` was returned survives a crash at any later moment; any other change is applied
//! completely or not at all (`promises.md` 1). Artifacts are named by the SHA-256 of their bytes, which every reader
//! verifies. The traits [`Catalogue`] and [`Artifacts`] are the extension point for other databases and object stores:
//! neither exposes a file or a path. Unfinished files are kept locally, in the [`Workbench`].

pub mod artifacts;
pub mod catalogue;
mod error;
mod files;
pub mod health;
mod holds;
mod identity;
pub mod local;
pub mod params;
pub mod records;
pub mod sqlite;
mod store;

pub use artifacts::{ArtifactId, ArtifactReader, ArtifactWriter, Artifacts};
pub use catalogue::{
    Catalogue, Change, DamagedRow, DeliveryFilter, ExpectedActive, InspectionFilter, Listed, MeasurementFilter,
    Page, RecipeFilter, ScanFilter, SetAside,
};
pub use error::StoreError;
pub use files::bytes::{ArtifactBytes, ByteRanges};
pub use files::disk;
pub use files::disk::{Disk, LocalDisk};
pub use files::workbench::{FinishedFile, Workbench};
pub use health::Health;
pub use local::LocalArtifacts;
pub use records::{
    ActivationRecord, CalibrationRecord, CaptureRecord, DeliveryRecord, DeliveryState, DoorRecord, EventRecord,
    IdempotencyRecord, InspectionRecord, JobOutcome, JobRecord, JobState, MeasurementRecord, ModelRecord,
    RecipeRecord, RecipeVersionRecord, RecordingRecord, RecordingState, ResultRef, ScanRecord, ScanState,
    SessionRecord, SettingRecord, StudyRecord,
};
pub use sqlite::SqliteCatalogue;
pub use store::Store;
