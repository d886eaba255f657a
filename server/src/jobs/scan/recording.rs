//! Frames on their way into a scan: centrelines on several threads, then in order to the peaks and to the viewers.
//!
//! Taking frames never waits for the disk or for labels as long as the queues have room; they are short, because
//! every frame in them holds a buffer of the station. Nothing is left out: a full queue holds the taker back.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use capture::write_png;
use optics::Triangulator;
use scanning::files::peaks::PeaksWriter;
use scanning::{Profile, ScanFrame, label_frame};
use vision::{CentrelineExtractor, CentrelineParams, Centrelines};

use crate::jobs::scan::pictures::picture_path;
use crate::jobs::{JobContext, JobEnd};
use crate::live::LiveFrame;
use crate::problem::{Problem, ProblemKind};
use crate::station::SharedFrame;
use crate::stored_scan::disk_problem;

/// Frames that wait for a thread, and results that wait to be written: each holds a buffer of the station, which
/// keeps sixteen beside those of its own recorder.
const QUEUE_FRAMES: usize = 3;

/// Most threads that look for centrelines: with the queues they hold ten buffers.
const THREADS_MAX: usize = 4;

/// The peaks file of a scan under way.
pub type NewPeaks = PeaksWriter<BufWriter<File>>;

/// What every frame goes through.
pub struct Recorder<'a> {
    /// The job.
    pub ctx: &'a JobContext,
    /// The scan.
    pub scan_id: &'a str,
    /// Labels what viewers see.
    pub triangulator: &'a Triangulator,
    /// Where pictures are kept, if they are.
    pub pictures: Option<PathBuf>,
}

/// Where whoever takes frames puts them.
pub struct Hand {
    queue: SyncSender<Taken>,
    next: Cell<usize>,
    failed: Arc<AtomicBool>,
}

struct Taken {
    idx: usize,
    frame: SharedFrame,
    position_mm: f64,
}

struct Seen {
    taken: Taken,
    found: Result<(Centrelines, Profile), Problem>,
}

impl Hand {
    /// Hands a frame over; waits if the threads are behind.
    ///
    /// # Errors
    /// If recording has failed; why, says [`Recorder::record`].
    pub fn give(&self, frame: SharedFrame, position_mm: f64) -> Result<(), JobEnd> {
        let taken = Taken { idx: self.next.get(), frame, position_mm };
        self.next.set(taken.idx + 1);
        if self.failed.load(Ordering::Relaxed) || self.queue.send(taken).is_err() {
            return Err(Problem::new(ProblemKind::Internal, "the frames could not be recorded").into());
        }
        Ok(())
    }
}

impl Recorder<'_> {
    /// Runs `take`, which hands over frame after frame, and adds them to `peaks`; where they were taken goes to
    /// `positions_mm`.
    ///
    /// Returns how taking ended; what was recorded before is good in any case. A failure to record comes first: it
    /// ended the taking.
    pub fn record(
        &self,
        positions_mm: &mut Vec<f64>,
        peaks: &mut NewPeaks,
        take: impl FnOnce(&Hand) -> Result<(), JobEnd>,
    ) -> Result<(), JobEnd> {
        let (queue, taken) = sync_channel(QUEUE_FRAMES);
        let (results, seen) = sync_channel(QUEUE_FRAMES);
        let taken = Mutex::new(taken);
        let failed = Arc::new(AtomicBool::new(false));
        let first = positions_mm.len();
        let hand = Hand { queue, next: Cell::new(first), failed: failed.clone() };
        std::thread::scope(|scope| {
            for _ in 0..n_threads() {
                let (results, taken) = (results.clone(), &taken);
                scope.spawn(move || self.look_at_frames(taken, &results));
            }
            drop(results);
            let keeper = scope.spawn(|| {
                let keep = |seen| self.keep(seen, positions_mm, peaks);
                in_order(seen, first, &failed, keep)
            });
            let ended = take(&hand);
            drop(hand);
            match keeper.join() {
                Ok(kept) => Ok(kept?),
                Err(panic) => std::panic::resume_unwind(panic),
            }
            .and(ended)
        })
    }

    fn look_at_frames(&self, taken: &Mutex<Receiver<Taken>>, results: &SyncSender<Seen>) {
        let params = CentrelineParams {
            line_direction: crate::jobs::scan::pictures::line_direction(&self.ctx.config),
            ..CentrelineParams::default()
        };
        let mut extractor = CentrelineExtractor::default();
        loop {
            let next = taken.lock().unwrap_or_else(PoisonError::into_inner).recv();
            let Ok(taken) = next else { return };
            let found = self.look_at(&taken, &params, &mut extractor);
            if results.send(Seen { taken, found }).is_err() {
                return;
            }
        }
    }

    fn look_at(
        &self,
        taken: &Taken,
        params: &CentrelineParams,
        extractor: &mut CentrelineExtractor,
    ) -> Result<(Centrelines, Profile), Problem> {
        let image = &taken.frame.image;
        if let Some(folder) = &self.pictures {
            write_png(&folder.join(picture_path(taken.idx)), image).map_err(disk_problem)?;
        }
        let mut centrelines = Centrelines::default();
        extractor.find(image, params, &mut centrelines);
        let depth_range_mm = self.triangulator.calibration().depth_range_mm;
        let profile = label_frame(&centrelines, self.triangulator, depth_range_mm);
        Ok((centrelines, profile))
    }

    fn keep(&self, seen: Seen, positions_mm: &mut Vec<f64>, peaks: &mut NewPeaks) -> Result<(), Problem> {
        let Seen { taken, found } = seen;
        let (centrelines, profile) = found?;
        let frame = ScanFrame { centrelines, position_mm: taken.position_mm };
        let captured_at_ns = Some(taken.frame.captured_at_ns);
        peaks.add(&frame, captured_at_ns).map_err(disk_problem)?;
        // What the operating system has, the end of this process does not take away.
        peaks.flush().map_err(disk_problem)?;
        let live = &self.ctx.live;
        let calibration = self.triangulator.calibration();
        live.add_profile_points(self.scan_id, taken.idx as u32, taken.position_mm, &profile, calibration);
        live.show(Arc::new(LiveFrame {
            frame: taken.frame,
            centrelines: frame.centrelines,
            profile: Some(profile),
            calibration_id: Some(calibration.id.clone()),
        }));
        positions_mm.push(taken.position_mm);
        Ok(())
    }
}

/// Keeps results in the order of their frames; after a failure it takes and forgets, so that nobody waits for ever.
fn in_order(
    seen: Receiver<Seen>,
    first: usize,
    failed: &AtomicBool,
    mut keep: impl FnMut(Seen) -> Result<(), Problem>,
) -> Result<(), Problem> {
    let mut early = BTreeMap::new();
    let mut next = first;
    let mut outcome = Ok(());
    for result in seen {
        early.insert(result.taken.idx, result);
        while let Some(result) = early.remove(&next) {
            next += 1;
            if outcome.is_ok() {
                outcome = keep(result);
                failed.store(outcome.is_err(), Ordering::Relaxed);
            }
        }
    }
    outcome
}

/// One core is left to the station.
fn n_threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get().saturating_sub(1).clamp(1, THREADS_MAX))
}
