//! The writer thread of a recording. Only it waits for the disk.

use std::fs::File;
use std::io::BufWriter;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Instant;

use devices::StageKind;
use recording::{FrameLosses, FrameNote, RecordingEnd, RecordingError, RecordingWriter};
use remedy::with_causes;
use station::{FrameTap, TappedFrame};

use crate::recordings::figures::{Ended, RecordingFigures};
use crate::recordings::notes::{Note, Notes, Timed, recorded_position};
use crate::recordings::params::{FLUSH_EVERY, NOTES, NOTES_PER_TURN, TURN};

/// Progress of a recording, for readers on other threads.
#[derive(Debug, Default)]
pub struct Progress {
    /// Frames written.
    pub n_frames: AtomicU64,
    /// Frames that arrived but were not written in time.
    pub n_untaken: AtomicU64,
    /// Exposures that did not arrive.
    pub n_lost: AtomicU64,
    /// Bytes passed to the operating system.
    pub size_bytes: AtomicU64,
}

/// A recording that is being written.
pub struct Writing {
    /// The file.
    pub writer: RecordingWriter<Counted>,
    /// The same file, for syncing.
    pub file: File,
    /// The frame source.
    pub tap: FrameTap,
    /// The note source.
    pub notes: Receiver<Timed>,
    /// The note queue: its losses and the clock.
    pub queue: Notes,
    /// The kind of stage.
    pub stage: StageKind,
    /// Progress.
    pub progress: Arc<Progress>,
    /// Bytes free on the disk.
    pub free_bytes: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// Free-space limit at which the recording ends.
    pub floor_bytes: u64,
}

/// Counts the written data.
pub struct Counted {
    file: BufWriter<File>,
    progress: Arc<Progress>,
}

impl Counted {
    /// For a newly created file.
    pub fn new(file: File, progress: Arc<Progress>) -> Self {
        Self { file: BufWriter::with_capacity(1 << 20, file), progress }
    }
}

impl std::io::Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let n_bytes = self.file.write(bytes)?;
        self.progress.size_bytes.fetch_add(n_bytes as u64, Ordering::Relaxed);
        Ok(n_bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// The outcome.
pub struct Written {
    /// Statistics.
    pub figures: RecordingFigures,
    /// Whether index and end were written.
    pub is_complete: bool,
}

/// Why writing ended on its own.
enum Cause {
    Closed,
    DiskFloor,
    Failed(RecordingError),
}

impl Writing {
    /// Writes until the tap is closed, the free-space limit is reached, or writing fails. `ended` returns why the tap was
    /// closed.
    pub fn run(mut self, ended: impl FnOnce() -> Ended) -> Written {
        let mut account = Account::default();
        let syncing = Syncing::begin(&self.file);
        let cause = match self.write(&mut account, &syncing) {
            Ok(cause) => cause,
            Err(error) => Cause::Failed(error),
        };
        drop(syncing);
        let (ended, failure) = match cause {
            Cause::Closed => (ended(), None),
            Cause::DiskFloor => (Ended::DiskFloor, None),
            Cause::Failed(error) if error.is_full_disk() => (Ended::DiskFull, Some(error)),
            Cause::Failed(error) => (Ended::WriteFailed, Some(error)),
        };
        if ended != Ended::DiskFloor && failure.is_none() {
            // Exposures after the last frame in the file.
            account.lost.recorder = self.tap.dropped.recorder.load(Ordering::Relaxed);
        }
        let n_notes_lost = self.queue.n_lost();
        let reason = ended.text().to_owned();
        let end = RecordingEnd { reason, n_frames: account.n_frames, lost: account.lost, n_notes_lost };
        let finished = match failure {
            Some(error) => Err(error),
            None => self.writer.finish(&end).and_then(|out| {
                let file = out.file.into_inner().map_err(|error| mcap_io(error.into_error()))?;
                file.sync_all().map_err(mcap_io)
            }),
        };
        let problem = finished.as_ref().err().map(|error| with_causes(error));
        if let Some(problem) = &problem {
            tracing::error!(problem, "the recording could not be finished");
        }
        let duration_s =
            account.first_last_ns.map_or(0.0, |(first, last)| last.saturating_sub(first) as f64 * 1e-9);
        let figures = RecordingFigures {
            n_frames: account.n_frames,
            lost: account.lost,
            n_gaps: account.n_gaps,
            n_rows: account.n_rows,
            n_notes_lost,
            duration_s,
            ended: Some(ended),
            problem,
        };
        Written { is_complete: finished.is_ok(), figures }
    }

    fn write(&mut self, account: &mut Account, syncing: &Syncing) -> Result<Cause, RecordingError> {
        let (mut flushed_at, mut is_dirty) = (Instant::now(), true);
        loop {
            match self.tap.frames.recv_timeout(TURN) {
                Ok(tapped) => {
                    self.add_frame(&tapped, account)?;
                    is_dirty = true;
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    self.add_notes(NOTES, account)?;
                    return Ok(Cause::Closed);
                }
            }
            is_dirty |= self.add_notes(NOTES_PER_TURN, account)?;
            if flushed_at.elapsed() >= FLUSH_EVERY {
                flushed_at = Instant::now();
                if is_dirty {
                    self.writer.flush()?;
                    syncing.ask();
                    is_dirty = false;
                }
                if (self.free_bytes)() < self.floor_bytes {
                    return Ok(Cause::DiskFloor);
                }
            }
        }
    }

    fn add_frame(&mut self, tapped: &TappedFrame, account: &mut Account) -> Result<(), RecordingError> {
        let frame = &tapped.frame;
        let lost_before = FrameLosses {
            camera: tapped.lost.camera,
            incomplete: tapped.lost.incomplete,
            no_buffer: tapped.lost.no_buffer,
            malformed: tapped.lost.malformed,
            recorder: tapped.untaken,
        };
        let at_ns = self.queue.clock().at_ns(frame.captured_at);
        let note = FrameNote {
            sequence: frame.sequence,
            captured_at_ns: frame.captured_at_ns,
            position: recorded_position(self.stage, frame.position_mm),
            exposure_us: frame.exposure_us,
            laser_on: frame.laser_on,
            lost_before,
        };
        self.writer.frame(at_ns, &note, &frame.image)?;
        account.add(at_ns, &lost_before);
        self.progress.n_frames.fetch_add(1, Ordering::Relaxed);
        self.progress.n_untaken.fetch_add(lost_before.recorder, Ordering::Relaxed);
        self.progress.n_lost.fetch_add(lost_before.total() - lost_before.recorder, Ordering::Relaxed);
        Ok(())
    }

    /// Writes at most so many notes; returns whether there were any.
    fn add_notes(&mut self, n_most: usize, account: &mut Account) -> Result<bool, RecordingError> {
        let mut any = false;
        for (at_ns, note) in self.notes.try_iter().take(n_most) {
            any = true;
            match note {
                Note::Stage(note) => self.writer.note(at_ns, &note)?,
                Note::Row(note) => {
                    account.n_rows += 1;
                    self.writer.note(at_ns, &note)?;
                }
                Note::Settings(note) => self.writer.note(at_ns, &*note)?,
                Note::Event(note) => self.writer.note(at_ns, &*note)?,
                Note::Peaks(note) => self.writer.note(at_ns, &note)?,
                Note::Profile(points) => self.writer.profile(at_ns, points)?,
            }
        }
        Ok(any)
    }
}

fn mcap_io(cause: std::io::Error) -> RecordingError {
    RecordingError::Mcap(cause.into())
}

/// The statistics so far.
#[derive(Default)]
struct Account {
    n_frames: u64,
    n_gaps: u64,
    n_rows: u64,
    lost: FrameLosses,
    first_last_ns: Option<(u64, u64)>,
}

impl Account {
    fn add(&mut self, at_ns: u64, lost_before: &FrameLosses) {
        self.n_frames += 1;
        self.n_gaps += u64::from(lost_before.total() > 0);
        self.lost.add(lost_before);
        let first = self.first_last_ns.map_or(at_ns, |(first, _)| first);
        self.first_last_ns = Some((first, at_ns));
    }
}

/// Syncs the file on its own thread, so that a slow disk delays no frame.
struct Syncing {
    ask: Option<SyncSender<()>>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Syncing {
    fn begin(file: &File) -> Self {
        let (ask, asked) = sync_channel(1);
        let Ok(file) = file.try_clone() else { return Self { ask: None, thread: None } };
        let sync = move || {
            for () in asked {
                if let Err(cause) = file.sync_data() {
                    tracing::error!(%cause, "a recording could not be synced");
                }
            }
        };
        let thread = std::thread::Builder::new().name("record-sync".to_owned()).spawn(sync).ok();
        Self { ask: Some(ask), thread }
    }

    /// A pending sync covers this one.
    fn ask(&self) {
        let _ = self.ask.as_ref().map(|ask| ask.try_send(()));
    }
}

impl Drop for Syncing {
    fn drop(&mut self) {
        self.ask = None;
        if let Some(thread) = self.thread.take() {
            // It ends with its queue; a panic in it is in the log.
            let _ = thread.join();
        }
    }
}
