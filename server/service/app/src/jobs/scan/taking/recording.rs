//! Frames into a scan: centrelines on several threads, then in order to the viewers and the peaks file.
//!
//! Acquisition does not wait for labels or the disk as long as the queues have room; the queues before line extraction
//! are short because every frame in them holds a buffer of the station. No frame is dropped: a full queue blocks the
//! acquisition.

use parking_lot::Mutex;
use std::cell::Cell;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, Scope, ScopedJoinHandle};
use std::time::Instant;

use capture::write_png;
use live::LiveFrame;
use optics::{StagePosition, Triangulator};
use scanning::files::peaks::pack_frame;
use scanning::{ExposureLines, FusionCounts, fuse_exposures};
use station::SharedFrame;
use station::recycling::Recycling;
use vision::{CentrelineExtractor, CentrelineParams, Centrelines, GreyImage};

use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::jobs::scan::images::image_path;
use crate::jobs::scan::taking::backgrounds::{BackgroundLog, RowBackground};
use crate::jobs::scan::taking::writing::{FreeRecords, Kept, QUEUE_RECORDS, Record};
use crate::jobs::scan::watched::{WatchedFrames, live_watch};
use crate::jobs::{JobEnd, StationContext};
use crate::recordings::notes::Notes;

/// Frames waiting for a thread, and results waiting to be shown: each holds a buffer of the station, which has sixteen in
/// addition to those of its own recorder.
const QUEUE_FRAMES: usize = 3;

/// Maximum number of centreline threads: together with the queues they hold ten buffers, and as many are free for reuse.
const THREADS_MAX: usize = 4;

/// The processing chain of each frame.
pub struct Recorder<'a> {
    /// The job.
    pub ctx: &'a StationContext,
    /// The scan.
    pub scan_id: &'a str,
    /// Labels the live profiles.
    pub triangulator: &'a Triangulator,
    /// Folder for kept images, if any.
    pub images: Option<PathBuf>,
    /// HDR statistics.
    pub fusion: Mutex<FusionCounts>,
    /// Which background was subtracted from each frame.
    pub log: &'a BackgroundLog,
    /// Where the recording notes which frames are rows, if the scan is recorded.
    pub notes: Option<Notes>,
}

/// The input queue for acquired frames.
pub struct FrameSink {
    queue: SyncSender<Taken>,
    next: Cell<usize>,
    failed: Arc<AtomicBool>,
    notes: Option<Notes>,
}

struct Taken {
    idx: usize,
    /// One, or one per exposure, shortest first.
    frames: Vec<SharedFrame>,
    position: StagePosition,
    /// For a row with one exposure.
    background: Option<Arc<RowBackground>>,
}

/// The result of a frame.
struct Seen {
    idx: usize,
    position: StagePosition,
    found: Result<Found, AppError>,
}

/// For viewers and for the file.
struct Found {
    live: Arc<LiveFrame>,
    record: Vec<u8>,
}

/// Buffers for reuse.
#[derive(Default)]
struct Memory {
    results: Mutex<Recycling<LiveFrame>>,
    records: FreeRecords,
}

impl FrameSink {
    /// Submits a row (one frame per exposure) with its background; blocks if the threads are behind.
    ///
    /// # Errors
    /// If processing has failed; [`Recorder::record`] returns the reason.
    pub fn give(
        &self,
        frames: Vec<SharedFrame>,
        position: StagePosition,
        background: Option<Arc<RowBackground>>,
    ) -> Result<(), JobEnd> {
        let taken = Taken { idx: self.next.get(), frames, position, background };
        self.next.set(taken.idx + 1);
        if let (Some(notes), Some(frame)) = (&self.notes, taken.frames.last()) {
            notes.row(taken.idx, frame.sequence, position.value());
        }
        if self.failed.load(Ordering::Relaxed) || self.queue.send(taken).is_err() {
            return Err(AppError::new(ErrorKind::Internal, "the frames could not be recorded").into());
        }
        Ok(())
    }
}

impl Recorder<'_> {
    /// Runs `take`, which submits frame after frame, and adds them to `kept`.
    ///
    /// Returns how the acquisition ended; frames recorded before are valid in any case. A recording failure takes
    /// precedence: it ended the acquisition.
    pub fn record<T>(
        &self,
        kept: &mut Kept<'_>,
        take: impl FnOnce(&FrameSink) -> Result<T, JobEnd>,
    ) -> Result<T, JobEnd> {
        let (queue, taken) = sync_channel(QUEUE_FRAMES);
        let (sender, seen) = sync_channel(QUEUE_FRAMES);
        let (to_disk, records) = sync_channel(QUEUE_RECORDS);
        let (taken, memory) = (Mutex::new(taken), Memory::default());
        let (mut watched, watch) = live_watch(self.triangulator.calibration()).unzip();
        let failed = Arc::new(AtomicBool::new(false));
        let first = kept.positions.len();
        let hand = FrameSink { queue, next: Cell::new(first), failed: failed.clone(), notes: self.notes.clone() };
        let (taken, memory, failed) = (&taken, &memory, &*failed);
        std::thread::scope(|scope| {
            for number in 0..n_threads() {
                let sender = sender.clone();
                let look = move || self.extract_lines(taken, memory, &sender);
                spawned(scope, format!("scan-lines-{number}"), look)?;
            }
            drop(sender);
            let write = move || kept.write(&records, &memory.records, failed);
            let writer = spawned(scope, "scan-write".to_owned(), write)?;
            if let Some(watch) = watch {
                spawned(scope, "scan-watch".to_owned(), move || watch.run(self.ctx, self.scan_id))?;
            }
            let show =
                move |idx, position, found| self.show((idx, position), found, memory, &to_disk, watched.as_mut());
            let shower = spawned(scope, "scan-show".to_owned(), move || in_order(seen, first, failed, show))?;
            let ended = take(&hand);
            drop(hand);
            let shown = joined(shower);
            joined(writer).and(shown)?;
            ended
        })
    }

    fn extract_lines(&self, taken: &Mutex<Receiver<Taken>>, memory: &Memory, sender: &SyncSender<Seen>) {
        let params = CentrelineParams {
            line_direction: self.ctx.config.projector.direction_of(0),
            ..CentrelineParams::default()
        };
        let (mut extractor, mut shorter) = (CentrelineExtractor::default(), Vec::new());
        let depth_range_mm = self.triangulator.calibration().depth_range_mm;
        let calibration_id = self.triangulator.calibration().id.as_str().into();
        loop {
            let next = taken.lock().recv();
            let Ok(taken) = next else { return };
            let Taken { idx, mut frames, position, background } = taken;
            // Viewers see the longest exposure.
            let Some(longest) = frames.pop() else { continue };
            let captured_at_ns = longest.captured_at_ns;
            let kept = self.keep_picture(idx, &longest);
            let found = kept.and_then(|()| {
                let mut live = fresh(&memory.results, longest, &calibration_id);
                let LiveFrame { frame, centrelines, profile, .. } = Arc::get_mut(&mut live).expect(UNSHARED);
                match self.freed(idx, &frame.image, background.as_ref())? {
                    Some(freed) => {
                        extractor.find(&freed, &params, centrelines);
                        let size_px = (freed.width(), freed.height());
                        centrelines.mark_saturated(size_px, |u, v| frame.image.is_saturated(u, v));
                    }
                    None => extractor.find(&frame.image, &params, centrelines),
                }
                if !frames.is_empty() {
                    shorter.resize_with(frames.len(), Centrelines::default);
                    for (frame, lines) in frames.iter().zip(&mut shorter) {
                        extractor.find(&frame.image, &params, lines);
                    }
                    *centrelines = self.fused(&frames, &shorter, (frame.exposure_us, &*centrelines));
                    // Their buffers are returned before the next row.
                    frames.clear();
                }
                profile.get_or_insert_default().fill(centrelines, self.triangulator, depth_range_mm);
                let mut record = memory.records.take();
                let at = position.value();
                pack_frame(&mut record, centrelines, at, Some(captured_at_ns)).map_err(disk_problem)?;
                Ok(Found { live, record })
            });
            if sender.send(Seen { idx, position, found }).is_err() {
                return;
            }
        }
    }

    /// The lines of several exposures as one frame's.
    fn fused(&self, frames: &[SharedFrame], lines: &[Centrelines], longest: (f64, &Centrelines)) -> Centrelines {
        let of_shorter = frames.iter().map(|frame| frame.exposure_us).zip(lines);
        let exposed: Vec<ExposureLines> = of_shorter
            .chain([longest])
            .map(|(exposure_us, centrelines)| ExposureLines { exposure_us, centrelines })
            .collect();
        let (fused, counts) = fuse_exposures(&exposed);
        self.fusion.lock().add(&counts);
        fused
    }

    /// A frame with its background subtracted, if it matches.
    fn freed(
        &self,
        idx: usize,
        frame: &GreyImage,
        background: Option<&Arc<RowBackground>>,
    ) -> Result<Option<GreyImage>, AppError> {
        let freed = background.and_then(|background| background.image.subtracted_from(frame));
        self.log.used(idx, background.filter(|_| freed.is_some()))?;
        Ok(freed)
    }

    fn keep_picture(&self, idx: usize, frame: &SharedFrame) -> Result<(), AppError> {
        let Some(folder) = &self.images else { return Ok(()) };
        write_png(&folder.join(image_path(idx)), &frame.image).map_err(disk_problem)
    }

    fn show(
        &self,
        (idx, position): (usize, StagePosition),
        found: Found,
        memory: &Memory,
        to_disk: &SyncSender<Record>,
        watched: Option<&mut WatchedFrames>,
    ) -> Result<(), AppError> {
        let Found { live: result, record } = found;
        let (live, arrived_at) = (&self.ctx.live, result.frame.arrived_at);
        live.show(result.clone());
        let shown_at = Instant::now();
        if let Some(profile) = &result.profile {
            let calibration = self.triangulator.calibration();
            live.add_profile_points(self.scan_id, idx as u32, position, profile, calibration);
            if let Some(watched) = watched {
                watched.add(self.scan_id, profile, position.value());
            }
        }
        lock(&memory.results).give_back(result);
        let gone = |_| AppError::new(ErrorKind::Internal, "the thread that writes the scan has ended");
        to_disk.send(Record { bytes: record, position: position.value(), arrived_at, shown_at }).map_err(gone)
    }
}

/// Why the memory of a result is writable.
const UNSHARED: &str = "a result taken for a new frame is not shared";

/// Memory for what `frame` becomes.
fn fresh(results: &Mutex<Recycling<LiveFrame>>, frame: SharedFrame, calibration_id: &Arc<str>) -> Arc<LiveFrame> {
    let used = lock(results).take();
    match used {
        Some(mut result) => {
            Arc::get_mut(&mut result).expect(UNSHARED).frame = frame;
            result
        }
        None => Arc::new(LiveFrame {
            frame,
            centrelines: Centrelines::default(),
            profile: None,
            calibration_id: Some(calibration_id.clone()),
        }),
    }
}

fn lock(results: &Mutex<Recycling<LiveFrame>>) -> parking_lot::MutexGuard<'_, Recycling<LiveFrame>> {
    results.lock()
}

/// A named thread, identifiable in profilers.
fn spawned<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    name: String,
    work: impl FnOnce() -> T + Send + 'scope,
) -> Result<ScopedJoinHandle<'scope, T>, AppError> {
    Builder::new().name(name).spawn_scoped(scope, work).map_err(|cause| {
        AppError::new(ErrorKind::Internal, "no thread can be started for the scan").because(cause.to_string())
    })
}

fn joined<T>(thread: ScopedJoinHandle<'_, T>) -> T {
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// Passes results on in frame order; after a failure it accepts and discards, so that no sender blocks.
fn in_order(
    seen: Receiver<Seen>,
    first: usize,
    failed: &AtomicBool,
    mut hand_on: impl FnMut(usize, StagePosition, Found) -> Result<(), AppError>,
) -> Result<(), AppError> {
    let mut early: Vec<Seen> = Vec::with_capacity(THREADS_MAX + QUEUE_FRAMES);
    let mut next = first;
    let mut outcome = Ok(());
    for result in seen {
        early.push(result);
        while let Some(at) = early.iter().position(|result| result.idx == next) {
            let Seen { idx, position, found } = early.swap_remove(at);
            next += 1;
            if outcome.is_ok() {
                outcome = found.and_then(|found| hand_on(idx, position, found));
                if outcome.is_err() {
                    failed.store(true, Ordering::Relaxed);
                }
            }
        }
    }
    outcome
}

/// All cores: the station thread needs little CPU time and gets priority because it mostly sleeps.
fn n_threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get().clamp(1, THREADS_MAX))
}
