//! Acquisition of the frames of a scan: camera settings, laser on, row by row or continuous motion, laser off.

use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::{CameraRequest, Trigger};
use station::{SharedFrame, StationLease, Sweep};

use crate::camera::background::Background;
use crate::error::{AppError, ErrorKind};
use crate::jobs::plan::ScanPlan;
use crate::jobs::progress::Phase;
use crate::jobs::scan::TAKEN;
use crate::jobs::scan::taking::backgrounds::{BackgroundLog, RowBackground};
use crate::jobs::scan::taking::recording::FrameSink;
use crate::jobs::{JobEnd, ScanMode, StationContext};
use crate::resources::scan_run::ScanRange;

/// Minimum interval of progress reports during a continuous scan: faster is not readable.
const REPORT_INTERVAL: Duration = Duration::from_millis(50);

/// Maximum number of frames until a new exposure takes effect.
const LATE_FRAMES: usize = 5;

/// Relative tolerance of an exposure: the camera rounds the requested value.
const SAME_EXPOSURE: f64 = 0.02;
/// A room that was dark enough is checked again after this many rows.
const AMBIENT_CHECK_ROWS: usize = 50;

/// The ambient light of a scan, in levels of 255, from laser-off images.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AmbientLight {
    /// In the first laser-off image.
    pub levels: Option<f64>,
    /// In the last laser-off image.
    pub last_levels: Option<f64>,
    /// Number of laser-off images.
    pub n_images: usize,
}

/// Captures the missing frames and passes them on. Losses are added to `losses` as text.
pub fn take_frames(
    ctx: &StationContext,
    plan: &ScanPlan,
    positions: &[f64],
    losses: &mut Vec<String>,
    log: &BackgroundLog,
    hand: &FrameSink,
) -> Result<AmbientLight, JobEnd> {
    let lease = ctx.take_station("scanning")?;
    let capabilities = ctx.station.status().camera.capabilities.clone();
    let stands_still = plan.mode == ScanMode::StopAndGo;
    let triggered = stands_still && capabilities.triggers.contains(&Trigger::Software);
    lease.configure(&CameraRequest {
        exposure_us: capabilities.exposure_us.map(|range| range.clamp(plan.exposure_us)),
        trigger: triggered.then_some(Trigger::Software),
        ..CameraRequest::default()
    })?;
    let mut run = Run {
        ctx,
        plan,
        lease,
        hand,
        losses,
        log,
        done: positions.len(),
        reported_at: None,
        ambient: AmbientLight::default(),
        background: None,
        looked_at: None,
    };
    match plan.mode {
        ScanMode::StopAndGo => run.row_by_row(),
        ScanMode::Continuous => run.in_one_sweep(positions.last().copied()),
    }?;
    Ok(run.ambient)
}

struct Run<'a> {
    ctx: &'a StationContext,
    plan: &'a ScanPlan,
    lease: StationLease,
    hand: &'a FrameSink,
    losses: &'a mut Vec<String>,
    log: &'a BackgroundLog,
    /// Rows captured.
    done: usize,
    /// When that was last reported.
    reported_at: Option<Instant>,
    ambient: AmbientLight,
    /// The laser-off image for the next frames.
    background: Option<Arc<RowBackground>>,
    /// The row before which the latest laser-off image was captured.
    looked_at: Option<usize>,
}

impl Run<'_> {
    fn row_by_row(&mut self) -> Result<(), JobEnd> {
        let (mut lost, first) = (0, self.done);
        for row in self.done..self.plan.n_rows {
            self.ctx.check_cancelled()?;
            let wanted = self.plan.range.position(row).value();
            let at = self.lease.move_to(wanted, None, &self.ctx.cancel)?;
            if self.is_background_due(row) {
                lost += self.capture_background(row)?;
            }
            if row == first || self.looked_at == Some(row) {
                self.lease.laser_on(self.plan.laser_power)?;
            }
            let frames = self.exposures()?;
            lost += frames.iter().map(|frame| frame.lost_before).sum::<u64>();
            if frames.iter().any(|frame| !frame.laser_on) {
                return Err(dark(row).into());
            }
            if self
                .background
                .as_ref()
                .is_some_and(|known| known.row != row && !known.image.suits(&frames[0].image))
            {
                lost += self.capture_background(row)?;
                self.lease.laser_on(self.plan.laser_power)?;
            }
            self.give(frames, at)?;
        }
        self.lease.laser_off()?;
        if lost > 0 {
            self.losses.push(format!("{lost} frames were lost and had to be captured again"));
        }
        Ok(())
    }

    /// The frames of a row: one, or one per exposure, shortest first.
    fn exposures(&self) -> Result<Vec<SharedFrame>, JobEnd> {
        if self.plan.exposures_us.is_empty() {
            return Ok(vec![self.lease.grab(&self.ctx.cancel)?]);
        }
        self.plan.exposures_us.iter().map(|exposure_us| self.exposed(*exposure_us)).collect()
    }

    /// A frame with this exposure. A camera applies a new exposure some frames later; each frame states the one it
    /// had.
    fn exposed(&self, exposure_us: f64) -> Result<SharedFrame, JobEnd> {
        let wanted = CameraRequest { exposure_us: Some(exposure_us), ..CameraRequest::default() };
        let accepted_us = self.lease.configure(&wanted)?.exposure_us;
        for _ in 0..LATE_FRAMES {
            let frame = self.lease.grab(&self.ctx.cancel)?;
            if (frame.exposure_us - accepted_us).abs() <= SAME_EXPOSURE * accepted_us {
                return Ok(frame);
            }
        }
        let detail = format!("no frame had the exposure of {accepted_us} µs that the camera accepted");
        Err(AppError::new(ErrorKind::DeviceFault, detail).remedy("scan with one exposure").into())
    }

    /// Whether a laser-off image is due before this row.
    fn is_background_due(&self, row: usize) -> bool {
        let Some(asked) = self.plan.background else { return false };
        let every = match &self.background {
            Some(_) => asked.every_rows.unwrap_or(1),
            // The room was dark enough: check whether it still is.
            None => AMBIENT_CHECK_ROWS,
        };
        self.looked_at.is_none_or(|looked_at| row >= looked_at + every)
    }

    /// Captures a laser-off image at the current stage position, to be subtracted from frames if the ambient light
    /// requires it; the laser stays off. Returns the number of frames lost meanwhile.
    fn capture_background(&mut self, row: usize) -> Result<u64, JobEnd> {
        let Some(asked) = self.plan.background else { return Ok(0) };
        self.lease.laser_off()?;
        let frame = self.lease.grab(&self.ctx.cancel)?;
        let background = RowBackground { row, image: Background::new(&frame) };
        let levels = background.image.ambient_levels();
        let ambient = &mut self.ambient;
        ambient.n_images += 1;
        ambient.levels.get_or_insert(levels);
        ambient.last_levels = Some(levels);
        self.looked_at = Some(row);
        self.background = None;
        if asked.above_levels.is_none_or(|limit| levels > limit) {
            self.log.keep(&background)?;
            self.background = Some(Arc::new(background));
        }
        Ok(frame.lost_before)
    }

    fn in_one_sweep(&mut self, last: Option<f64>) -> Result<(), JobEnd> {
        let (plan, range) = (self.plan, &self.plan.range);
        let onwards = range.direction();
        let from = last.map_or(range.from, |last| last + onwards * range.step);
        if (range.to - from) * onwards <= 0.0 {
            return Ok(());
        }
        let (Some(speed), Some(frame_rate_hz)) = (range.speed, plan.frame_rate_hz) else {
            return Err(AppError::new(ErrorKind::Internal, "a continuous scan without a speed").into());
        };
        if plan.background.is_some() {
            self.lease.move_to(from, None, &self.ctx.cancel)?;
            self.capture_background(self.done)?;
        }
        self.lease.laser_on(plan.laser_power)?;
        // The station uses the unit of its stage.
        let sweep = Sweep { from_mm: from, to_mm: range.to, speed_mm_s: speed, frame_rate_hz };
        let stream = self.lease.sweep(&sweep, &self.ctx.cancel)?;
        let (mut nowhere, mut unlit) = (0, 0);
        for frame in stream.frames.iter() {
            unlit += u64::from(!frame.laser_on);
            match frame.position_mm {
                Some(position) => self.give(vec![frame], position)?,
                None => nowhere += 1,
            }
        }
        let dropped = stream.dropped.by_reason().into_iter().filter(|(_, n)| *n > 0);
        self.losses.extend(dropped.map(|(reason, n)| format!("{n} frames were lost: {reason}")));
        let others = [(nowhere, "have no stage position"), (unlit, "were captured with the laser off")];
        let others = others.into_iter().filter(|(n, _)| *n > 0);
        self.losses.extend(others.map(|(n, what)| format!("{n} frames {what}")));
        match stream.end_reason() {
            Some(refusal) => return Err(refusal.into()),
            None => self.lease.laser_off()?,
        }
        if plan.background.is_some() {
            self.capture_background(self.done)?;
        }
        Ok(())
    }

    fn give(&mut self, frames: Vec<SharedFrame>, position: f64) -> Result<(), JobEnd> {
        self.hand.give(frames, self.plan.range.stage.position(position), self.background.clone())?;
        self.done += 1;
        let soon = self.reported_at.is_some_and(|at| at.elapsed() < REPORT_INTERVAL);
        if self.plan.mode == ScanMode::Continuous && soon && self.done < self.plan.n_rows {
            return Ok(());
        }
        self.reported_at = Some(Instant::now());
        let n_rows = self.plan.n_rows.max(self.done);
        let words = format!("row {} of {n_rows}", self.done);
        self.lease.activity(&format!("scanning, {words}"));
        let step = Phase::CapturingRows.counted(self.done, n_rows);
        self.ctx.report(TAKEN * self.done as f64 / n_rows as f64, step, &words);
        Ok(())
    }
}

fn dark(row: usize) -> AppError {
    AppError::new(ErrorKind::DeviceFault, format!("the frame of row {} was captured with the laser off", row + 1))
        .remedy("check laser and interlock, then resume the scan")
}

/// Gaps between the first and the last position of a continuous scan, as text: frames lost without being counted leave
/// a gap.
pub fn gaps(range: &ScanRange, positions: &[f64]) -> Vec<String> {
    /// A missing frame doubles the step; a camera on a busy machine exposes at most half a period late.
    const GAP_STEPS: f64 = 1.75;
    let mut gaps = Vec::new();
    let mut before = range.from;
    for at in positions.iter().copied().chain([range.to]) {
        if (at - before).abs() > GAP_STEPS * range.step {
            gaps.push(format!("no frame between {before:.3} and {at:.3} {}", range.stage.unit()));
        }
        before = at;
    }
    gaps
}
