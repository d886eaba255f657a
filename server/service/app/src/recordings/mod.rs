//! Recordings: everything the camera delivers, with device states and events, as an MCAP file; one at a time.
//!
//! Frames come through a non-blocking tap of the station; one thread writes them, and only it waits for the disk. While
//! running, a recording is a file under `recordings/` of the data directory and a record in the state `recording`; at its
//! end the file becomes an artifact. Recordings of a crashed process are repaired after the next start.

pub mod figures;
mod follow;
mod keeping;
pub mod notes;
mod params;
mod writing;

use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use live::LiveBus;
use parking_lot::Mutex;
use recording::{FrameLosses, RecordingHeader, RecordingWriter};
use remedy::with_causes;
use station::wall_clock::now_ms;
use station::{FrameTap, StationHandle, StationRefusal};
use store::{Artifacts, Change, RecordingRecord, RecordingState};
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::config::AppConfig;
use crate::config::limits::FREE_FLOOR_BYTES;
use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::events::{Event, RecordingStarted, event};
use crate::recordings::figures::{Ended, RecordingFigures};
use crate::recordings::notes::{Clock, Notes};
use crate::recordings::params::{BEGIN_BYTES, END_WAIT};
use crate::recordings::writing::{Counted, Progress, Writing};
use crate::resources::stored_scan::new_id;

/// What is recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RecordingOf {
    /// The live view, until it ends.
    Live,
    /// A scan, while its frames are captured.
    Scan {
        /// Its id.
        scan_id: String,
        /// Its calibration.
        calibration_id: String,
        /// Disk space that the scan itself still needs, bytes.
        needed_bytes: u64,
    },
}

/// The recorder. Clones share it.
#[derive(Clone)]
pub struct Recordings(Arc<Shared>);

/// Dependencies of the recorder.
pub struct RecordingParts {
    /// Configuration.
    pub config: Arc<AppConfig>,
    /// The catalogue and its events.
    pub catalogue: EventedCatalogue,
    /// The artifact store.
    pub artifacts: Arc<dyn Artifacts>,
    /// The hardware.
    pub station: StationHandle,
    /// The live bus.
    pub live: LiveBus,
    /// Bytes free on the disk of the data directory.
    pub free_bytes: Arc<dyn Fn() -> u64 + Send + Sync>,
}

struct Shared {
    parts: RecordingParts,
    /// Held while a recording starts or ends.
    turn: tokio::sync::Mutex<()>,
    current: Mutex<Option<Current>>,
}

/// The recording that is running or being finished.
#[derive(Clone)]
struct Current {
    record: RecordingRecord,
    progress: Arc<Progress>,
    notes: Notes,
    /// The reason for its end; the first one counts.
    ending: Arc<Mutex<Option<Ended>>>,
    /// Its final record.
    kept: watch::Receiver<Option<RecordingRecord>>,
}

impl Recordings {
    /// An idle recorder. Called within the runtime.
    pub fn new(parts: RecordingParts) -> Self {
        Self(Arc::new(Shared { parts, turn: tokio::sync::Mutex::default(), current: Mutex::default() }))
    }

    /// Repairs recordings of a crashed process. Called before requests are served; slow work is done in the background.
    pub async fn recover(&self) {
        let left = keeping::interrupted(&self.0.parts).await;
        let this = self.clone();
        tokio::spawn(async move {
            for record in left {
                keeping::store_interrupted(&this.0.parts, record).await;
            }
        });
    }

    /// Starts a recording; durable when it returns. What `and` returns is stored in the same transaction.
    ///
    /// # Errors
    /// [`ErrorKind::Conflict`] while another recording runs, [`ErrorKind::StorageFull`] near the lower limit of free space, an
    /// error of a device or the disk.
    pub async fn begin<E: From<AppError>>(
        &self,
        name: &str,
        of: RecordingOf,
        actor: Option<&str>,
        and: impl FnOnce(&RecordingRecord) -> Result<Vec<Change>, E>,
    ) -> Result<RecordingRecord, E> {
        if of != RecordingOf::Live {
            // The live view ends with the scan, and its recording with it.
            self.end(None, Ended::ScanBegan).await;
        }
        let _turn = self.0.turn.lock().await;
        self.wait_for_ending().await;
        if let Some(current) = self.current() {
            let detail = format!("\"{}\" is being recorded", current.record.name);
            return Err(AppError::new(ErrorKind::Conflict, detail).remedy("stop that recording first").into());
        }
        let floor_bytes = self.floor_bytes(&of);
        self.check_room(floor_bytes.saturating_add(BEGIN_BYTES))?;
        let (header, calibration) = self.header(name, &of).await?;
        let tap = self.0.parts.station.tap().await.map_err(AppError::from)?;
        let begun = self.write(header, calibration, of, tap, floor_bytes, actor, and).await;
        if begun.is_err() {
            self.close_tap().await;
        }
        begun
    }

    #[allow(clippy::too_many_arguments, reason = "the steps of a start, separate from their clean-up")]
    async fn write<E: From<AppError>>(
        &self,
        header: RecordingHeader,
        calibration: Option<Vec<u8>>,
        of: RecordingOf,
        tap: FrameTap,
        floor_bytes: u64,
        actor: Option<&str>,
        and: impl FnOnce(&RecordingRecord) -> Result<Vec<Change>, E>,
    ) -> Result<RecordingRecord, E> {
        let parts = &self.0.parts;
        let record = begun_record(&header);
        let path = keeping::path_of(&*parts.artifacts, &record.id);
        let progress = Arc::new(Progress::default());
        let stage = parts.station.status().stage.capabilities.kind;
        let (notes, receiver) = Notes::new(stage, Clock::start());
        let (writer, file) = {
            let (path, progress) = (path.clone(), progress.clone());
            let made = tokio::task::spawn_blocking(move || made_file(&path, &header, calibration, progress)).await;
            made.map_err(disk_problem).and_then(|made| made)?
        };
        // From before the start, which is an event itself.
        let events = follow::events(parts.catalogue.clone(), notes.clone());
        let mut changes = and(&record).inspect_err(|_| keeping::remove(&path))?;
        changes.push(Change::InsertRecording(record.clone()));
        let scan_id = record.scan_id.clone();
        let body = RecordingStarted { name: record.name.clone(), scan_id, actor: actor.map(str::to_owned) };
        changes.push(event(&record.id, Event::RecordingStarted(body)));
        if let Err(error) = parts.catalogue.commit(changes).await {
            keeping::remove(&path);
            return Err(AppError::from(error).into());
        }
        let writing = Writing {
            writer,
            file,
            tap,
            notes: receiver,
            queue: notes.clone(),
            stage,
            progress,
            free_bytes: parts.free_bytes.clone(),
            floor_bytes,
        };
        self.run(record.clone(), path, writing, notes, events, of);
        Ok(record)
    }

    /// Starts the writer thread and the followers; stores the record when the recording has ended.
    fn run(
        &self,
        record: RecordingRecord,
        path: PathBuf,
        writing: Writing,
        notes: Notes,
        events: impl Future<Output = ()> + Send + 'static,
        of: RecordingOf,
    ) {
        let (keep, kept) = watch::channel(None);
        let ending: Arc<Mutex<Option<Ended>>> = Arc::default();
        let progress = writing.progress.clone();
        let current =
            Current { record: record.clone(), progress, notes: notes.clone(), ending: ending.clone(), kept };
        *self.0.current.lock() = Some(current);
        let mut followers = self.followers(&notes, &of);
        followers.push(tokio::spawn(events));
        drop(notes);
        let this = self.clone();
        tokio::spawn(async move {
            let why = move || ending.lock().unwrap_or(Ended::ServiceEnded);
            let written = tokio::task::spawn_blocking(move || writing.run(why)).await;
            followers.iter().for_each(JoinHandle::abort);
            this.close_tap().await;
            let record = keeping::keep(&this.0.parts, record, &path, written).await;
            *this.0.current.lock() = None;
            // There may be no receiver.
            let _ = keep.send(Some(record));
        });
    }

    fn followers(&self, notes: &Notes, of: &RecordingOf) -> Vec<JoinHandle<()>> {
        let parts = &self.0.parts;
        let mut all = vec![
            tokio::spawn(follow::devices(parts.station.clone(), notes.clone())),
            tokio::spawn(follow::profiles(parts.live.clone(), notes.clone())),
        ];
        if *of == RecordingOf::Live {
            let (this, station) = (self.clone(), parts.station.clone());
            all.push(tokio::spawn(async move {
                follow::end_of_live_view(station).await;
                this.publish(None, Ended::LiveEnded).await;
            }));
        }
        all
    }

    /// Ends the recording `id`, or the running one, and returns its final record; `None` if there is none.
    pub async fn end(&self, id: Option<&str>, why: Ended) -> Option<RecordingRecord> {
        let mut kept = self.publish(id, why).await?;
        let ended = tokio::time::timeout(END_WAIT, kept.wait_for(Option::is_some)).await;
        ended.ok()?.ok()?.clone()
    }

    /// The same without waiting; returns a receiver of the final record.
    async fn publish(&self, id: Option<&str>, why: Ended) -> Option<watch::Receiver<Option<RecordingRecord>>> {
        let current = self.current().filter(|current| id.is_none_or(|id| current.record.id == id))?;
        current.ending.lock().get_or_insert(why);
        self.close_tap().await;
        Some(current.kept)
    }

    /// Waits until a recording that is ending is stored: its record says so a moment before another one may begin.
    async fn wait_for_ending(&self) {
        if let Some(mut current) = self.current().filter(|current| current.ending.lock().is_some()) {
            // After the limit it counts as running.
            let _ = tokio::time::timeout(END_WAIT, current.kept.wait_for(Option::is_some)).await;
        }
    }

    /// The note queue for rows of the recorded scan; `None` if no scan is recorded.
    pub fn notes(&self, id: &str) -> Option<Notes> {
        self.current().filter(|current| current.record.id == id).map(|current| current.notes)
    }

    /// A record with its current state; for the running recording, with the figures so far. One that was stored with its
    /// end a moment ago keeps its final figures.
    pub fn now(&self, record: RecordingRecord) -> RecordingRecord {
        let is_running =
            |current: &Current| record.state == RecordingState::Recording && current.record.id == record.id;
        let Some(current) = self.current().filter(is_running) else { return record };
        let of = |count: &std::sync::atomic::AtomicU64| count.load(Ordering::Relaxed);
        let progress = &current.progress;
        // Their reasons are known at the end.
        let lost = FrameLosses {
            camera: of(&progress.n_lost),
            recorder: of(&progress.n_untaken),
            ..FrameLosses::default()
        };
        let duration_s = (now_ms() - record.started_at_ms).max(0) as f64 * 1e-3;
        let figures =
            RecordingFigures { n_frames: of(&progress.n_frames), lost, duration_s, ..RecordingFigures::default() };
        RecordingRecord { size_bytes: of(&progress.size_bytes), summary: stored(&figures), ..record }
    }

    fn current(&self) -> Option<Current> {
        self.0.current.lock().clone()
    }

    async fn close_tap(&self) {
        match self.0.parts.station.close_tap().await {
            Ok(()) | Err(StationRefusal::ShuttingDown) => {}
            Err(refusal) => tracing::warn!(%refusal, "the recording's tap could not be closed"),
        }
    }

    fn floor_bytes(&self, of: &RecordingOf) -> u64 {
        match of {
            RecordingOf::Live => FREE_FLOOR_BYTES,
            RecordingOf::Scan { needed_bytes, .. } => FREE_FLOOR_BYTES.saturating_add(*needed_bytes),
        }
    }

    fn check_room(&self, needed_bytes: u64) -> Result<(), AppError> {
        let free_bytes = (self.0.parts.free_bytes)();
        if free_bytes >= needed_bytes {
            return Ok(());
        }
        let (needed, free) = (needed_bytes >> 20, free_bytes >> 20);
        let detail = format!("a recording needs {needed} MiB of free disk space, {free} MiB are free");
        Err(AppError::new(ErrorKind::StorageFull, detail)
            .remedy("delete recordings, captures or scans that are no longer needed"))
    }

    async fn header(&self, name: &str, of: &RecordingOf) -> Result<(RecordingHeader, Option<Vec<u8>>), AppError> {
        let parts = &self.0.parts;
        let (scan_id, calibration_id) = match of {
            RecordingOf::Live => {
                let active = parts.catalogue.read().active().await?;
                (None, active.and_then(|act| act.calibration_id))
            }
            RecordingOf::Scan { scan_id, calibration_id, .. } => {
                (Some(scan_id.clone()), Some(calibration_id.clone()))
            }
        };
        let calibration = match &calibration_id {
            Some(id) => Some(keeping::calibration_bytes(parts, id).await?),
            None => None,
        };
        let status = parts.station.status();
        let stage = match status.stage.capabilities.kind {
            devices::StageKind::Linear => capture::StageKind::Linear,
            devices::StageKind::Rotary => capture::StageKind::Rotary,
        };
        let header = RecordingHeader {
            name: name.to_owned(),
            origin: if scan_id.is_some() { "scan" } else { "live" }.to_owned(),
            scan_id,
            calibration_id,
            software_version: env!("CARGO_PKG_VERSION").to_owned(),
            simulated: status.simulated.map(str::to_owned),
            started_at_ms: now_ms(),
            target: parts.config.target.clone(),
            projector: parts.config.projector.clone(),
            stage: capture::StageDescription { kind: stage, angle_sigma_deg: None },
        };
        Ok((header, calibration))
    }
}

fn begun_record(header: &RecordingHeader) -> RecordingRecord {
    RecordingRecord {
        id: new_id(),
        name: header.name.clone(),
        origin: header.origin.clone(),
        state: RecordingState::Recording,
        scan_id: header.scan_id.clone(),
        calibration_id: header.calibration_id.clone(),
        file: None,
        size_bytes: 0,
        summary: stored(&RecordingFigures::default()),
        started_at_ms: header.started_at_ms,
    }
}

/// Creates the file with its header, durably. Blocks.
fn made_file(
    path: &std::path::Path,
    header: &RecordingHeader,
    calibration: Option<Vec<u8>>,
    progress: Arc<Progress>,
) -> Result<(RecordingWriter<Counted>, File), AppError> {
    let folder = path.parent().unwrap_or(path);
    std::fs::create_dir_all(folder).map_err(disk_problem)?;
    let file = File::create_new(path).map_err(disk_problem)?;
    let made = || -> Result<_, AppError> {
        let out = Counted::new(file.try_clone().map_err(disk_problem)?, progress);
        let writer = RecordingWriter::create(out, header, calibration.as_deref()).map_err(|error| {
            let kind = if error.is_full_disk() { ErrorKind::StorageFull } else { ErrorKind::Internal };
            AppError::new(kind, "the recording cannot be written").because(with_causes(&error))
        })?;
        file.sync_all().map_err(disk_problem)?;
        File::open(folder).and_then(|folder| folder.sync_all()).map_err(disk_problem)?;
        Ok(writer)
    };
    let writer = made().inspect_err(|_| keeping::remove(path))?;
    Ok((writer, file))
}

/// The code of a state or a reason in events and responses.
fn code(value: impl serde::Serialize) -> String {
    let word = serde_json::to_value(value).ok().and_then(|value| value.as_str().map(str::to_owned));
    word.expect("states and reasons are enums without fields, which serde writes as words")
}

/// The statistics in their stored form.
fn stored(figures: &RecordingFigures) -> serde_json::Value {
    serde_json::to_value(figures).expect("figures are numbers and words")
}
