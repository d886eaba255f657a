//! The examination of a station: its checks in their order, and what they share.

use std::time::{Duration, Instant};

use devices::CameraRequest;
use pipeline::Reporter;
use remedy::Remedy as _;
use station::cancel::CancelFlag;
use station::{LaserLight, Purpose, StationHandle, StationLease, StationRefusal};
use tokio::runtime::Handle;

use super::check::{Check, Outcome};
use super::limits::OPENING_WAIT;

/// Pause between two looks at a status that is waited for.
const LOOK_PERIOD: Duration = Duration::from_millis(10);

/// Longest wait for the laser's state after it was opened: it is read ten times a second.
const READING_WAIT: Duration = Duration::from_secs(1);

/// Settings of the examination.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// Exposure, µs; `None`: as the camera is set.
    pub exposure_us: Option<f64>,
    /// Gain, dB; `None`: as the camera is set.
    pub gain_db: Option<f64>,
    /// Frames per second; `None`: as the camera is set.
    pub frame_rate_hz: Option<f64>,
    /// Share of full laser power.
    pub power: f64,
    /// The board by which the stage's scale is known, if it lies on the stage.
    pub board: capture::Target,
    /// Whether the lines run along rows.
    pub lines_along_rows: bool,
}

/// An examination that runs.
pub struct Examination<'s> {
    pub station: &'s StationHandle,
    pub wanted: &'s Wanted,
    pub cancel: &'s CancelFlag,
    pub reporter: &'s dyn Reporter,
    /// Where the station's asynchronous answers are waited for.
    pub runtime: Handle,
}

/// Why an examination ended early.
#[derive(Debug)]
pub struct Cancelled;

impl Examination<'_> {
    /// Checks without motion and laser.
    pub fn at_rest(&self) -> Result<Vec<Check>, Cancelled> {
        self.step("opening the devices")?;
        let mut checks = self.devices()?;
        checks.push(self.dark_at_start());
        if checks.iter().any(|check| check.name == "camera" && check.outcome == Outcome::NotOk) {
            return Ok(checks);
        }
        self.step("running the camera with the laser off")?;
        checks.extend(self.outcome("frame rate", self.free_run())?);
        Ok(checks)
    }

    /// Checks with laser and motion.
    pub fn emitting_and_moving(&self) -> Result<Vec<Check>, Cancelled> {
        self.step("turning the laser on and off")?;
        let mut checks = self.outcome("light", self.light())?;
        self.step("moving the stage")?;
        checks.extend(self.outcome("stage position", self.motion())?);
        Ok(checks)
    }

    /// Says what is done now, unless it was cancelled.
    fn step(&self, words: &str) -> Result<(), Cancelled> {
        if self.cancel.is_cancelled() {
            return Err(Cancelled);
        }
        self.reporter.note(&format!("{words} …"));
        Ok(())
    }

    /// The station in the examination's hands.
    pub fn lease(&self) -> Result<StationLease, StationRefusal> {
        self.station.lease(Purpose {
            job_id: "doctor".to_owned(),
            activity: "examining the station".to_owned(),
            epoch: self.station.stop_epoch(),
        })
    }

    /// How the camera is to be set.
    pub fn camera_request(&self) -> CameraRequest {
        CameraRequest {
            exposure_us: self.wanted.exposure_us,
            gain_db: self.wanted.gain_db,
            frame_rate_hz: self.wanted.frame_rate_hz,
            ..CameraRequest::default()
        }
    }

    /// Checks that came to their end, or one that says why they did not.
    fn outcome(
        &self,
        name: &'static str,
        checks: Result<Vec<Check>, StationRefusal>,
    ) -> Result<Vec<Check>, Cancelled> {
        let refusal = match checks {
            Ok(checks) => return Ok(checks),
            Err(refusal) => refusal,
        };
        let ended = matches!(
            refusal,
            StationRefusal::Cancelled
                | StationRefusal::Stopped { .. }
                | StationRefusal::Halted
                | StationRefusal::ShuttingDown
        );
        if ended || self.cancel.is_cancelled() {
            return Err(Cancelled);
        }
        let outcome = match refusal {
            StationRefusal::InError { .. } | StationRefusal::Absent { .. } => Outcome::NotRun,
            _ => Outcome::NotOk,
        };
        let remedy = refusal.remedy().unwrap_or_default().into_owned();
        Ok(vec![Check::said(name, outcome, refusal.to_string()).remedy(remedy)])
    }

    /// Each device: which one answers, or its fault.
    fn devices(&self) -> Result<Vec<Check>, Cancelled> {
        let began = Instant::now();
        loop {
            let status = self.station.status();
            let connected = [
                ("camera", status.camera.connected, &status.camera.identity),
                ("stage", status.stage.connected, &status.stage.identity),
                ("laser", status.laser.connected, &status.laser.identity),
            ];
            let is_known = |(device, connected, _): &(&str, bool, _)| {
                *connected || status.faults.iter().any(|fault| fault.device == *device)
            };
            if connected.iter().all(is_known) || began.elapsed() > OPENING_WAIT {
                let check =
                    |(name, is_connected, identity): (&'static str, bool, &devices::DeviceIdentity)| {
                        let fault = status.faults.iter().find(|fault| fault.device == name);
                        match fault {
                            Some(fault) => Check::said(name, Outcome::NotOk, fault.detail.clone())
                                .remedy(fault.remedy.clone()),
                            None if is_connected => {
                                let words = format!("{} {} {}", identity.driver, identity.vendor, identity.model);
                                let words: Vec<&str> = words.split_whitespace().collect();
                                Check::said(name, Outcome::Ok, words.join(" "))
                            }
                            None => Check::said(name, Outcome::NotOk, "does not respond")
                                .remedy("check cable and power"),
                        }
                    };
                return Ok(connected.map(check).to_vec());
            }
            if self.cancel.is_cancelled() {
                return Err(Cancelled);
            }
            std::thread::sleep(LOOK_PERIOD);
        }
    }

    fn dark_at_start(&self) -> Check {
        const NAME: &str = "laser off at the start";
        // Unknown until it was read once.
        self.wait_until(READING_WAIT, || self.station.status().laser_light != LaserLight::Unknown);
        match self.station.status().laser_light {
            LaserLight::Off | LaserLight::Armed => Check::said(NAME, Outcome::Ok, "off"),
            LaserLight::NotControlled => Check::said(NAME, Outcome::NotRun, "not controlled by the station")
                .remedy("the station cannot turn this laser off: ensure safety by other means"),
            LaserLight::On => Check::said(NAME, Outcome::NotOk, "on")
                .remedy("switch off the power supply of the laser, and check its driver"),
            LaserLight::Unknown => Check::said(NAME, Outcome::NotOk, "unknown")
                .remedy("treat it as on, and check the cable of its controller"),
        }
    }

    /// Waits until the status holds, at most so long; how long that took.
    pub fn wait_until(&self, limit: Duration, holds: impl Fn() -> bool) -> Option<Duration> {
        let began = Instant::now();
        while !holds() {
            if began.elapsed() > limit || self.cancel.is_cancelled() {
                return None;
            }
            std::thread::sleep(LOOK_PERIOD);
        }
        Some(began.elapsed())
    }
}
