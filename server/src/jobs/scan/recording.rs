//! Frames on their way into a scan: centrelines on several threads, then in order to the peaks and to the viewers.
//!
//! Taking frames never waits for the disk or for labels as long as the queues have room; they are short, because
//! every frame in them holds a buffer of the station. Nothing is left out: a full queue holds the taker back.

use std::cell::Cell;
use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, Scope, ScopedJoinHandle};

use capture::write_png;
use optics::Triangulator;
use scanning::FrameLabeller;
use scanning::files::peaks::PeaksWriter;
use vision::{CentrelineExtractor, CentrelineParams, Centrelines};

use crate::jobs::scan::pictures::picture_path;
use crate::jobs::scan::timing::Timing;
use crate::jobs::{JobContext, JobEnd};
use crate::live::LiveFrame;
use crate::problem::{Problem, ProblemKind};
use crate::recycling::Recycling;
use crate::station::SharedFrame;
use crate::stored_scan::disk_problem;

/// Frames that wait for a thread, and results that wait to be written: each holds a buffer of the station, which
/// keeps sixteen beside those of its own recorder.
const QUEUE_FRAMES: usize = 3;

/// Most threads that look for centrelines: with the queues they hold ten buffers, and as many wait to be used again.
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

/// What a thread made of a frame.
struct Seen {
    idx: usize,
    position_mm: f64,
    found: Result<Arc<LiveFrame>, Problem>,
}

/// What is kept of the frames.
pub struct Kept<'k> {
    /// Where they were taken.
    pub positions_mm: &'k mut Vec<f64>,
    /// Their lines.
    pub peaks: &'k mut NewPeaks,
    /// How long that took.
    pub timing: &'k mut Timing,
}

/// What frames become; the memory of those that nobody looks at any more is used for the next ones.
type Results = Mutex<Recycling<LiveFrame>>;

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
    /// Runs `take`, which hands over frame after frame, and adds them to `kept`.
    ///
    /// Returns how taking ended; what was recorded before is good in any case. A failure to record comes first: it
    /// ended the taking.
    pub fn record(
        &self,
        kept: &mut Kept<'_>,
        take: impl FnOnce(&Hand) -> Result<(), JobEnd>,
    ) -> Result<(), JobEnd> {
        let (queue, taken) = sync_channel(QUEUE_FRAMES);
        let (sender, seen) = sync_channel(QUEUE_FRAMES);
        let (taken, results) = (Mutex::new(taken), Results::default());
        let failed = Arc::new(AtomicBool::new(false));
        let first = kept.positions_mm.len();
        let hand = Hand { queue, next: Cell::new(first), failed: failed.clone() };
        std::thread::scope(|scope| {
            for number in 0..n_threads() {
                let (sender, taken, results) = (sender.clone(), &taken, &results);
                let look = move || self.look_at_frames(taken, results, &sender);
                spawned(scope, format!("scan-lines-{number}"), look)?;
            }
            drop(sender);
            let keep = |idx, position_mm, found| self.keep(idx, position_mm, found, &results, kept);
            let keeper = spawned(scope, "scan-keep".to_owned(), || in_order(seen, first, &failed, keep))?;
            let ended = take(&hand);
            drop(hand);
            match keeper.join() {
                Ok(kept) => Ok(kept?),
                Err(panic) => std::panic::resume_unwind(panic),
            }
            .and(ended)
        })
    }

    fn look_at_frames(&self, taken: &Mutex<Receiver<Taken>>, results: &Results, sender: &SyncSender<Seen>) {
        let params = CentrelineParams {
            line_direction: crate::jobs::scan::pictures::line_direction(&self.ctx.config),
            ..CentrelineParams::default()
        };
        let (mut extractor, mut labeller) = (CentrelineExtractor::default(), FrameLabeller::default());
        let depth_range_mm = self.triangulator.calibration().depth_range_mm;
        let calibration_id = self.triangulator.calibration().id.as_str().into();
        loop {
            let next = taken.lock().unwrap_or_else(PoisonError::into_inner).recv();
            let Ok(taken) = next else { return };
            let (idx, position_mm) = (taken.idx, taken.position_mm);
            let kept = self.keep_picture(&taken);
            let found = kept.map(|()| {
                let mut result = fresh(results, taken.frame, &calibration_id);
                let LiveFrame { frame, centrelines, profile, .. } = Arc::get_mut(&mut result).expect(UNSHARED);
                extractor.find(&frame.image, &params, centrelines);
                let profile = profile.get_or_insert_default();
                labeller.label(centrelines, self.triangulator, depth_range_mm, profile);
                result
            });
            if sender.send(Seen { idx, position_mm, found }).is_err() {
                return;
            }
        }
    }

    fn keep_picture(&self, taken: &Taken) -> Result<(), Problem> {
        let Some(folder) = &self.pictures else { return Ok(()) };
        write_png(&folder.join(picture_path(taken.idx)), &taken.frame.image).map_err(disk_problem)
    }

    fn keep(
        &self,
        idx: usize,
        position_mm: f64,
        result: Arc<LiveFrame>,
        results: &Results,
        kept: &mut Kept<'_>,
    ) -> Result<(), Problem> {
        let live = &self.ctx.live;
        live.show(result.clone());
        kept.timing.shown(result.frame.arrived_at);
        let captured_at_ns = Some(result.frame.captured_at_ns);
        kept.peaks.add_lines(&result.centrelines, position_mm, captured_at_ns).map_err(disk_problem)?;
        // What the operating system has, the end of this process does not take away.
        kept.peaks.flush().map_err(disk_problem)?;
        kept.timing.kept(result.frame.arrived_at);
        if let Some(profile) = &result.profile {
            let calibration = self.triangulator.calibration();
            live.add_profile_points(self.scan_id, idx as u32, position_mm, profile, calibration);
        }
        kept.positions_mm.push(position_mm);
        lock(results).give_back(result);
        Ok(())
    }
}

/// Why the memory of a result can be written.
const UNSHARED: &str = "nobody else holds a result that was taken for a new frame";

/// Memory for what `frame` becomes.
fn fresh(results: &Results, frame: SharedFrame, calibration_id: &Arc<str>) -> Arc<LiveFrame> {
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

fn lock(results: &Results) -> std::sync::MutexGuard<'_, Recycling<LiveFrame>> {
    results.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A thread with a name, by which its work is found in measurements.
fn spawned<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    name: String,
    work: impl FnOnce() -> T + Send + 'scope,
) -> Result<ScopedJoinHandle<'scope, T>, Problem> {
    Builder::new().name(name).spawn_scoped(scope, work).map_err(|cause| {
        Problem::new(ProblemKind::Internal, "no thread can be started for the scan").because(cause.to_string())
    })
}

/// Keeps results in the order of their frames; after a failure it takes and forgets, so that nobody waits for ever.
fn in_order(
    seen: Receiver<Seen>,
    first: usize,
    failed: &AtomicBool,
    mut keep: impl FnMut(usize, f64, Arc<LiveFrame>) -> Result<(), Problem>,
) -> Result<(), Problem> {
    let mut early: Vec<Seen> = Vec::with_capacity(THREADS_MAX + QUEUE_FRAMES);
    let mut next = first;
    let mut outcome = Ok(());
    for result in seen {
        early.push(result);
        while let Some(at) = early.iter().position(|result| result.idx == next) {
            let Seen { idx, position_mm, found } = early.swap_remove(at);
            next += 1;
            if outcome.is_ok() {
                outcome = found.and_then(|found| keep(idx, position_mm, found));
                failed.store(outcome.is_err(), Ordering::Relaxed);
            }
        }
    }
    outcome
}

/// All cores: the station's thread needs little and is woken first, since it sleeps most of the time.
fn n_threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get().clamp(1, THREADS_MAX))
}
