//! Taking the frames of a scan, as an operator would: set the camera, light, row after row or one sweep, dark.

use std::time::{Duration, Instant};

use devices::{CameraRequest, Trigger};
use station::{SharedFrame, StationLease, Sweep};

use crate::error::{AppError, ErrorKind};
use crate::jobs::plan::ScanPlan;
use crate::jobs::scan::TAKEN;
use crate::jobs::scan::recording::Hand;
use crate::jobs::{JobEnd, ScanMode, StationContext};
use crate::progress::Phase;

/// Time between two words about a sweep: people read no faster, and frames come by the hundred in a second.
const TOLD_EVERY: Duration = Duration::from_millis(50);

/// Frames after which a new exposure holds at the latest.
const LATE_FRAMES: usize = 5;

/// The camera rounds what is asked for.
const SAME_EXPOSURE: f64 = 0.02;

/// Takes the frames that are missing and hands them over. What was lost goes to `losses`, in words.
pub fn take_frames(
    ctx: &StationContext,
    plan: &ScanPlan,
    positions_mm: &[f64],
    losses: &mut Vec<String>,
    hand: &Hand,
) -> Result<(), JobEnd> {
    let lease = ctx.take_station("scanning")?;
    let capabilities = ctx.station.status().camera.capabilities.clone();
    let stands_still = plan.mode == ScanMode::StopAndGo;
    let triggered = stands_still && capabilities.triggers.contains(&Trigger::Software);
    lease.configure(&CameraRequest {
        exposure_us: capabilities.exposure_us.map(|range| range.clamp(plan.exposure_us)),
        trigger: triggered.then_some(Trigger::Software),
        ..CameraRequest::default()
    })?;
    let mut run = Run { ctx, plan, lease, hand, losses, done: positions_mm.len(), told_at: None };
    match plan.mode {
        ScanMode::StopAndGo => run.row_by_row(),
        ScanMode::Continuous => run.in_one_sweep(positions_mm.last().copied()),
    }
}

struct Run<'a> {
    ctx: &'a StationContext,
    plan: &'a ScanPlan,
    lease: StationLease,
    hand: &'a Hand,
    losses: &'a mut Vec<String>,
    /// Rows that are taken.
    done: usize,
    /// When that was told last.
    told_at: Option<Instant>,
}

impl Run<'_> {
    fn row_by_row(&mut self) -> Result<(), JobEnd> {
        let (mut lost, first) = (0, self.done);
        for row in self.done..self.plan.n_rows {
            self.ctx.go_on()?;
            let at_mm = self.lease.move_to(self.plan.position_mm(row), None, &self.ctx.cancel)?;
            if row == first {
                self.lease.laser_on(self.plan.laser_power)?;
            }
            let frames = self.exposures()?;
            lost += frames.iter().map(|frame| frame.lost_before).sum::<u64>();
            if frames.iter().any(|frame| !frame.laser_on) {
                return Err(dark(row).into());
            }
            self.give(frames, at_mm)?;
        }
        self.lease.laser_off()?;
        if lost > 0 {
            self.losses.push(format!("{lost} frames were lost on their way and had to be taken again"));
        }
        Ok(())
    }

    /// The frames of a row: one, or one of every exposure, the shortest first.
    fn exposures(&self) -> Result<Vec<SharedFrame>, JobEnd> {
        if self.plan.exposures_us.is_empty() {
            return Ok(vec![self.lease.grab(&self.ctx.cancel)?]);
        }
        self.plan.exposures_us.iter().map(|exposure_us| self.exposed(*exposure_us)).collect()
    }

    /// A frame that was exposed so long. A camera takes over a new exposure some frames late; it says with each which it
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
        let detail = format!("no frame was exposed for {accepted_us} µs though the camera accepted that");
        Err(AppError::new(ErrorKind::DeviceFault, detail).remedy("scan with one exposure").into())
    }

    fn in_one_sweep(&mut self, last_mm: Option<f64>) -> Result<(), JobEnd> {
        let plan = self.plan;
        let onwards = plan.direction();
        let from_mm = last_mm.map_or(plan.from_mm, |last| last + onwards * plan.step_mm);
        if (plan.to_mm - from_mm) * onwards <= 0.0 {
            return Ok(());
        }
        let (Some(speed_mm_s), Some(frame_rate_hz)) = (plan.speed_mm_s, plan.frame_rate_hz) else {
            return Err(AppError::new(ErrorKind::Internal, "a continuous scan without a speed").into());
        };
        self.lease.laser_on(plan.laser_power)?;
        let sweep = Sweep { from_mm, to_mm: plan.to_mm, speed_mm_s, frame_rate_hz };
        let stream = self.lease.sweep(&sweep, &self.ctx.cancel)?;
        let (mut nowhere, mut unlit) = (0, 0);
        for frame in stream.frames.iter() {
            unlit += u64::from(!frame.laser_on);
            match frame.position_mm {
                Some(position_mm) => self.give(vec![frame], position_mm)?,
                None => nowhere += 1,
            }
        }
        let dropped = stream.dropped.by_reason().into_iter().filter(|(_, n)| *n > 0);
        self.losses.extend(dropped.map(|(reason, n)| format!("{n} frames were lost: {reason}")));
        let others = [(nowhere, "have no stage position"), (unlit, "were taken without laser light")];
        let others = others.into_iter().filter(|(n, _)| *n > 0);
        self.losses.extend(others.map(|(n, what)| format!("{n} frames {what}")));
        match stream.broken() {
            Some(refusal) => Err(refusal.into()),
            None => Ok(self.lease.laser_off()?),
        }
    }

    fn give(&mut self, frames: Vec<SharedFrame>, position_mm: f64) -> Result<(), JobEnd> {
        self.hand.give(frames, position_mm)?;
        self.done += 1;
        let soon = self.told_at.is_some_and(|at| at.elapsed() < TOLD_EVERY);
        if self.plan.mode == ScanMode::Continuous && soon && self.done < self.plan.n_rows {
            return Ok(());
        }
        self.told_at = Some(Instant::now());
        let n_rows = self.plan.n_rows.max(self.done);
        let words = format!("row {} of {n_rows}", self.done);
        self.lease.activity(&format!("scanning, {words}"));
        let step = Phase::TakingRows.counted(self.done, n_rows);
        self.ctx.report(TAKEN * self.done as f64 / n_rows as f64, step, &words);
        Ok(())
    }
}

fn dark(row: usize) -> AppError {
    AppError::new(ErrorKind::DeviceFault, format!("the frame of row {} was taken without laser light", row + 1))
        .remedy("check laser and interlock, then resume the scan")
}

/// What is missing between the first and the last position of a continuous scan, in words: frames that were lost
/// without anybody counting them leave a gap.
pub fn gaps(plan: &ScanPlan, positions_mm: &[f64]) -> Vec<String> {
    /// A missing frame makes two steps of one; a camera on a busy machine exposes half a period late at worst.
    const GAP_STEPS: f64 = 1.75;
    let mut gaps = Vec::new();
    let mut before_mm = plan.from_mm;
    for at_mm in positions_mm.iter().copied().chain([plan.to_mm]) {
        if (at_mm - before_mm).abs() > GAP_STEPS * plan.step_mm {
            gaps.push(format!("no frame between {before_mm:.3} and {at_mm:.3} mm"));
        }
        before_mm = at_mm;
    }
    gaps
}
