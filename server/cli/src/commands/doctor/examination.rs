//! The examination of a station: the sequence of its checks, and what they share.

use std::time::{Duration, Instant};

use devices::CameraRequest;
use pipeline::Reporter;
use remedy::Remedy as _;
use station::cancel::CancelFlag;
use station::{LaserLight, Purpose, StationHandle, StationLease, StationRefusal};
use tokio::runtime::Handle;

use super::check::{Check, Outcome};
use super::limits::OPENING_WAIT;

/// Period of polling the station's status.
pub const POLL_PERIOD: Duration = Duration::from_millis(10);

/// Longest wait for the laser state after opening; it is read ten times per second.
const READING_WAIT: Duration = Duration::from_secs(1);

/// Settings of the examination.
#[derive(Debug, Clone)]
pub struct ExaminationSettings {
    /// Exposure, µs; `None`: the current camera setting.
    pub exposure_us: Option<f64>,
    /// Gain, dB; `None`: the current camera setting.
    pub gain_db: Option<f64>,
    /// Frames per second; `None`: the current camera setting.
    pub frame_rate_hz: Option<f64>,
    /// Laser power as a fraction of full power.
    pub power: f64,
    /// The board for checking the scale of the stage, if it lies on the stage.
    pub board: capture::Target,
    /// Whether the lines run along rows.
    pub lines_along_rows: bool,
}

/// A running examination.
pub struct Examination<'s> {
    pub station: &'s StationHandle,
    pub settings: &'s ExaminationSettings,
    pub cancel: &'s CancelFlag,
    pub reporter: &'s dyn Reporter,
    /// Runtime for the asynchronous requests to the station.
    pub runtime: Handle,
}

/// The examination was cancelled.
#[derive(Debug)]
pub struct Cancelled;

impl Examination<'_> {
    /// Checks without motion and laser.
    pub fn at_rest(&self) -> Result<Vec<Check>, Cancelled> {
        self.step("opening the devices")?;
        let mut checks = self.devices()?;
        checks.push(self.laser_off_at_start());
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

    /// Reports the next step.
    ///
    /// # Errors
    /// [`Cancelled`] if the examination was cancelled.
    fn step(&self, text: &str) -> Result<(), Cancelled> {
        if self.cancel.is_cancelled() {
            return Err(Cancelled);
        }
        self.reporter.note(&format!("{text} …"));
        Ok(())
    }

    /// Leases the station for the examination.
    pub fn lease(&self) -> Result<StationLease, StationRefusal> {
        self.station.lease(Purpose {
            job_id: "doctor".to_owned(),
            activity: "examining the station".to_owned(),
            epoch: self.station.stop_epoch(),
        })
    }

    /// The requested camera settings.
    pub fn camera_request(&self) -> CameraRequest {
        CameraRequest {
            exposure_us: self.settings.exposure_us,
            gain_db: self.settings.gain_db,
            frame_rate_hz: self.settings.frame_rate_hz,
            ..CameraRequest::default()
        }
    }

    /// The checks, or a single check `name` that states why they could not be finished.
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
        Ok(vec![Check::stated(name, outcome, refusal.to_string()).remedy(remedy)])
    }

    /// One check per device: its identity, or its fault.
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
                let check = |(device, is_connected, identity): (&'static str, bool, &devices::DeviceIdentity)| {
                    let fault = status.faults.iter().find(|fault| fault.device == device);
                    match fault {
                        Some(fault) => Check::stated(device, Outcome::NotOk, fault.detail.clone())
                            .remedy(fault.remedy.clone()),
                        None if is_connected => {
                            let name = format!("{} {} {}", identity.driver, identity.vendor, identity.model);
                            let parts: Vec<&str> = name.split_whitespace().collect();
                            Check::stated(device, Outcome::Ok, parts.join(" "))
                        }
                        None => Check::stated(device, Outcome::NotOk, "does not respond")
                            .remedy("check cable and power"),
                    }
                };
                return Ok(connected.map(check).to_vec());
            }
            if self.cancel.is_cancelled() {
                return Err(Cancelled);
            }
            std::thread::sleep(POLL_PERIOD);
        }
    }

    fn laser_off_at_start(&self) -> Check {
        const NAME: &str = "laser off at the start";
        // Unknown until the first reading.
        self.wait_until(READING_WAIT, || self.station.status().laser_light != LaserLight::Unknown);
        match self.station.status().laser_light {
            LaserLight::Off | LaserLight::Armed => Check::stated(NAME, Outcome::Ok, "off"),
            LaserLight::NotControlled => Check::stated(NAME, Outcome::NotRun, "not controlled by the station")
                .remedy("the station cannot turn this laser off: ensure safety by other means"),
            LaserLight::On => Check::stated(NAME, Outcome::NotOk, "on")
                .remedy("switch off the power supply of the laser, and check its driver"),
            LaserLight::Unknown => Check::stated(NAME, Outcome::NotOk, "unknown")
                .remedy("treat it as on, and check the cable of its controller"),
        }
    }

    /// Polls until `holds` returns true and returns the time this took; `None` after `limit` or if cancelled.
    pub fn wait_until(&self, limit: Duration, holds: impl Fn() -> bool) -> Option<Duration> {
        let began = Instant::now();
        while !holds() {
            if began.elapsed() > limit || self.cancel.is_cancelled() {
                return None;
            }
            std::thread::sleep(POLL_PERIOD);
        }
        Some(began.elapsed())
    }
}
