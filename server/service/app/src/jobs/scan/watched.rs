//! The watches on a scan: their results go into the report, the events, the state of the scan and the history.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use optics::Calibration;
use scanning::{
    Estimate, Evaluation, FrameReducer, FrameSamples, LostSteps, LostStepsWatch, Profile, Watch, WatchReport,
    WatchState, verdicts, watch_scan, with_wavelength_changed,
};
use serde_json::Value;
use station::params::RECORDER_FRAMES;
use store::{Change, ScanRecord, ScanState};

use crate::jobs::scan::ScanStory;
use crate::jobs::{ComputeContext, JobEnd};
use crate::resources::scan_run::{ScanPlan, ScanRun};
use crate::resources::watches::{WATCHES, WatchHistory, verdicts_json, warning, warnings};

/// Number of frames that may wait for the live watch: as many as for the scan itself.
pub const WAITING_FRAMES: usize = RECORDER_FRAMES;

/// As of `nice`: a tenth of the weight of a thread that takes part in the scan.
#[cfg(target_os = "linux")]
const WATCH_NICE: i32 = 10;

/// The next frames of a scan for its [`LiveWatch`].
pub struct WatchedFrames {
    reducer: FrameReducer,
    queue: Option<SyncSender<(FrameSamples, f64)>>,
}

/// The watch for lost steps during acquisition, on a thread of its own: to tell a loss from noise takes longer than a frame.
pub struct LiveWatch {
    watch: LostStepsWatch,
    frames: Receiver<(FrameSamples, f64)>,
}

/// The live watch of a scan; `None` on stations without a linear stage.
pub fn live_watch(calibration: &Calibration) -> Option<(WatchedFrames, LiveWatch)> {
    let watch = LostStepsWatch::new(calibration)?;
    let (queue, frames) = sync_channel(WAITING_FRAMES);
    Some((WatchedFrames { reducer: watch.reducer(), queue: Some(queue) }, LiveWatch { watch, frames }))
}

impl WatchedFrames {
    /// Adds the next frame. If too many are waiting, the watch ends, since a frame matters more than an early warning:
    /// every scan is checked at its end.
    pub fn add(&mut self, scan_id: &str, profile: &Profile, position_mm: f64) {
        let Some(queue) = &self.queue else { return };
        let Some(samples) = self.reducer.reduce(profile, position_mm) else { return };
        if let Err(TrySendError::Full(_)) = queue.try_send((samples, position_mm)) {
            self.queue = None;
            tracing::warn!(scan_id, "frames are waiting: lost steps are looked for at the end of the scan only");
        }
    }
}

impl LiveWatch {
    /// Looks at every frame until no more are added; an alarm becomes an event at once. The result for the whole scan
    /// follows at its end.
    pub fn run(mut self, ctx: &ComputeContext, scan_id: &str) {
        give_way();
        for (samples, position_mm) in self.frames {
            if let Some(lost) = self.watch.note(samples, position_mm) {
                warn_of(ctx, scan_id, lost);
            }
        }
    }
}

/// Lets all other threads go first: this one computes for 0.1 s when a frame looks like a loss, and on two processors
/// new frames would wait for it.
fn give_way() {
    // Linux gives each thread a priority of its own.
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::setpriority_process(None, WATCH_NICE) {
        tracing::debug!(%error, "the live watch keeps its priority");
    }
}

fn warn_of(ctx: &ComputeContext, scan_id: &str, lost: LostSteps) {
    let of_scan = WatchReport { lost_steps: vec![lost], ..WatchReport::default() };
    let result = verdicts(&of_scan, f64::INFINITY, None).into_iter().find(|one| one.watch == Watch::LostSteps);
    let warnings: Vec<Change> = result.iter().map(|verdict| warning(scan_id, verdict)).collect();
    if let Err(error) = ctx.wait(ctx.catalogue.commit(warnings)) {
        tracing::error!(%error, "lost steps were detected, but the event cannot be stored");
    }
}

/// Results of the watches on a scan; empty on stations without a linear stage.
pub struct Watched {
    report: Option<WatchReport>,
    /// Whether the station has just captured the scan: only then does it describe the station.
    is_observation: bool,
}

impl Watched {
    /// Runs the watches on an evaluated scan.
    pub fn over(evaluation: &Evaluation, calibration: &Calibration) -> Result<Self, JobEnd> {
        Ok(Self { report: watch_scan(evaluation, calibration)?, is_observation: false })
    }

    /// The corrected calibration for the scan, if the orders show a significant change of the wavelength.
    pub fn corrected(&self, calibration: &Calibration) -> Option<Calibration> {
        Some(with_wavelength_changed(calibration, self.correction()?.value))
    }

    /// The header comment of a corrected cloud.
    pub fn comment(&self) -> Option<String> {
        let Estimate { value, sigma } = self.correction()?;
        Some(format!("wavelength_correction {value:.3e} sigma {sigma:.1e}"))
    }

    fn correction(&self) -> Option<Estimate> {
        self.report.as_ref()?.drift?.correction()
    }

    /// Puts the verdicts into the scan's `report`, and makes it invalid if one says so. Returns events of those that warn.
    /// `calibration_id` and `median_sigma_mm` are those of its cloud.
    pub fn apply_watches(
        &mut self,
        ctx: &ComputeContext,
        story: &mut ScanStory,
        report: &mut Value,
        (calibration_id, median_sigma_mm): (&str, f64),
    ) -> Result<Vec<Change>, JobEnd> {
        let Some(watched) = &mut self.report else { return Ok(Vec::new()) };
        let plan = ScanRun::from_stored(&story.plan).ok().and_then(|run| run.plan);
        self.is_observation = plan.is_some() && story.recomputed_from.is_none();
        let history = ctx.wait(WatchHistory::read(&ctx.catalogue))?;
        let reference = plan.as_ref().and_then(|plan| {
            let powers = watched.powers.as_mut()?;
            powers.log_total -= light_of(plan).ln();
            history.reference(calibration_id)
        });
        let verdicts = verdicts(watched, median_sigma_mm, reference.as_ref());
        report[WATCHES] = verdicts_json(&verdicts);
        let is_invalid = verdicts.iter().any(|verdict| verdict.state == WatchState::Invalid);
        story.state = match (story.state, story.losses.is_empty()) {
            (ScanState::Partial, _) => ScanState::Partial,
            (_, true) if !is_invalid => ScanState::Complete,
            _ => ScanState::Invalid,
        };
        Ok(warnings(&story.id, &verdicts))
    }

    /// The change that adds the scan to the history.
    pub fn remembered(self, ctx: &ComputeContext, record: &ScanRecord) -> Result<Option<Change>, JobEnd> {
        let Some(watched) = self.report.filter(|_| self.is_observation) else { return Ok(None) };
        let mut history = ctx.wait(WatchHistory::read(&ctx.catalogue))?;
        history.add(record, watched.powers);
        Ok(Some(history.change()))
    }
}

/// Light dose of the exposures of a scan: 1 is full power for one millisecond.
fn light_of(plan: &ScanPlan) -> f64 {
    (plan.exposure_us * 1e-3 * plan.laser_power).max(f64::MIN_POSITIVE)
}
