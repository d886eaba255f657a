//! The watches on a scan: their results go into the report, the events, the state of the scan and the history.

use std::collections::VecDeque;
use std::time::Instant;

use parking_lot::Mutex;

use optics::Calibration;
use scanning::{
    Estimate, Evaluation, LostStepsWatch, Profile, Watch, WatchReport, WatchState, verdicts, watch_scan,
    with_wavelength_changed,
};
use serde_json::Value;
use station::params::RECORDER_FRAMES;
use store::{Change, ScanRecord, ScanState};

use crate::jobs::scan::ScanStory;
use crate::jobs::{ComputeContext, JobEnd};
use crate::resources::scan_run::{ScanPlan, ScanRun};
use crate::resources::watches::{WATCHES, WatchHistory, verdicts_json, warning, warnings};

/// Number of frames that may wait for the live watch: a quarter of those that the station can keep before it loses some.
const WAITING_FRAMES: usize = RECORDER_FRAMES / 4;

/// The watch for lost steps during acquisition.
///
/// It ends if frames arrive faster than they are processed, since a frame matters more than an early warning: every scan is
/// checked at its end.
pub struct LiveWatch(Mutex<Watching>);

struct Watching {
    watch: Option<LostStepsWatch>,
    backlog: Backlog,
}

/// When the last frames arrived, oldest first.
#[derive(Default)]
struct Backlog(VecDeque<Instant>);

impl Backlog {
    /// Adds a frame that is processed now; whether [`WAITING_FRAMES`] more have arrived since it did, at the rate of the
    /// last ones.
    fn is_long(&mut self, arrived_at: Instant, now: Instant) -> bool {
        self.0.push_back(arrived_at);
        let before = if self.0.len() > WAITING_FRAMES { self.0.pop_front() } else { None };
        before.is_some_and(|before| now.duration_since(arrived_at) > arrived_at.duration_since(before))
    }
}

impl LiveWatch {
    /// Inactive on stations without a linear stage.
    pub fn new(calibration: &Calibration) -> Self {
        Self(Mutex::new(Watching { watch: LostStepsWatch::new(calibration), backlog: Backlog::default() }))
    }

    /// Adds the next frame; an alarm becomes an event at once. The result for the whole scan follows at its end.
    pub fn note(
        &self,
        ctx: &ComputeContext,
        scan_id: &str,
        (profile, position_mm): (&Profile, f64),
        arrived_at: Instant,
    ) {
        let mut watching = self.0.lock();
        if watching.backlog.is_long(arrived_at, Instant::now()) && watching.watch.take().is_some() {
            tracing::warn!(scan_id, "frames are waiting: lost steps are looked for at the end of the scan only");
        }
        let Some(lost) = watching.watch.as_mut().and_then(|watch| watch.note(profile, position_mm)) else {
            return;
        };
        drop(watching);
        let of_scan = WatchReport { lost_steps: vec![lost], ..WatchReport::default() };
        let result = verdicts(&of_scan, f64::INFINITY, None).into_iter().find(|one| one.watch == Watch::LostSteps);
        let warnings: Vec<Change> = result.iter().map(|verdict| warning(scan_id, verdict)).collect();
        if let Err(error) = ctx.wait(ctx.catalogue.commit(warnings)) {
            tracing::error!(%error, "lost steps were detected, but the event cannot be stored");
        }
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_backlog_is_long_if_many_frames_have_arrived_since() {
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        let mut backlog = Backlog::default();
        // The first frames say nothing, however late.
        for idx in 0..WAITING_FRAMES as u64 {
            assert!(!backlog.is_long(at(2 * idx), at(2 * idx + 1000)));
        }
        let span_ms = 2 * WAITING_FRAMES as u64;
        for (waited_ms, is_long) in [(1, false), (span_ms, false), (span_ms + 1, true), (1, false)] {
            let arrived_ms = backlog.0.back().unwrap().duration_since(start).as_millis() as u64 + 2;
            assert_eq!(backlog.is_long(at(arrived_ms), at(arrived_ms + waited_ms)), is_long, "{waited_ms} ms");
        }
        // A pause of the computer at a low rate is no backlog.
        let mut slow = Backlog::default();
        assert!((0..40).all(|idx| !slow.is_long(at(50 * idx), at(50 * idx + 400))));
    }
}
