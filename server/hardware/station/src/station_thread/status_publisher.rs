//! Publishing to the rest of the service: status, frames, the start.

use parking_lot::Mutex;
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use devices::features::CameraDetails;
use devices::{
    CameraCapabilities, CameraSettings, DeviceIdentity, Homing, LaserCapabilities, PixelFormat, Roi,
    StageCapabilities, Trigger,
};
use tokio::sync::watch;

use crate::params::STATUS_PERIOD;
use crate::parts::light::Light;
use crate::parts::motion::Motion;
use crate::shared::dark_frame::DarkFrameUse;
use crate::shared::frame::SharedFrame;
use crate::shared::status::{
    DeviceStatus, LaserLight, MachineState, OperationalState, StateHistory, StationStatus,
};
use crate::shared::stop_latch::StopLatch;
use crate::shared::viewers::Viewers;
use crate::station_thread::station::Station;

/// The senders of all published values.
pub struct StatusPublisher {
    pub(crate) status: watch::Sender<Arc<StationStatus>>,
    pub(crate) newest: watch::Sender<Option<SharedFrame>>,
    pub(crate) stop_latch: Arc<StopLatch>,
    pub(crate) simulated: Option<&'static str>,
    /// The viewers.
    pub(crate) viewers: Arc<Viewers>,
    /// How long a live view continues unwatched.
    pub(crate) live_unwatched: Duration,
    /// How long its light stays on unwatched.
    pub(crate) live_light_unwatched: Duration,
    /// Notified once the first attempt to open the devices has ended.
    pub(crate) opened: Option<SyncSender<()>>,
    /// The camera's own features and link state.
    pub(crate) camera_details: Arc<Mutex<Option<Arc<dyn CameraDetails>>>>,
    pub(crate) published_at: Option<Instant>,
    pub(crate) published: Option<Highlights<'static>>,
}

/// The part of the status that is published as soon as it changes; the rest are numbers, published at intervals.
#[derive(PartialEq)]
pub(crate) struct Highlights<'a> {
    changes: u64,
    activity: Cow<'a, str>,
    faults: usize,
    moving: bool,
    homed: bool,
    light: LaserLight,
    interlock_closed: Option<bool>,
    settings: Option<CameraSettings>,
    corrected: bool,
}

impl Highlights<'_> {
    fn into_owned(self) -> Highlights<'static> {
        let Self { changes, activity, faults, moving, homed, light, interlock_closed, settings, corrected } = self;
        let activity = Cow::Owned(activity.into_owned());
        Highlights { changes, activity, faults, moving, homed, light, interlock_closed, settings, corrected }
    }
}

impl StatusPublisher {
    /// Publishes a frame; only the newest is kept.
    pub fn publish_frame(&self, frame: SharedFrame) {
        self.newest.send_replace(Some(frame));
    }

    /// Publishes a camera's own features.
    pub fn publish_camera_details(&self, details: Option<Arc<dyn CameraDetails>>) {
        *self.camera_details.lock() = details;
    }

    /// Notifies the caller that waits for the start.
    pub fn notify_opened(&mut self) {
        if let Some(opened) = self.opened.take() {
            // A caller that has stopped waiting needs no answer.
            let _ = opened.try_send(());
        }
    }
}

impl Station {
    /// Publishes the status: at once if more than numbers changed, else every 100 ms.
    pub(crate) fn publish(&mut self) {
        let now = Instant::now();
        let highlights = self.highlights();
        let due = self.publisher.published_at.is_none_or(|at| now - at >= STATUS_PERIOD);
        if !due && self.publisher.published.as_ref() == Some(&highlights) {
            return;
        }
        (self.publisher.published_at, self.publisher.published) = (Some(now), Some(highlights.into_owned()));
        let status = self.status(now);
        self.publisher.status.send_if_modified(|shown| {
            let changed = **shown != status;
            if changed {
                *shown = Arc::new(status);
            }
            changed
        });
    }

    fn highlights(&self) -> Highlights<'_> {
        Highlights {
            changes: self.history.newest(),
            activity: Cow::Borrowed(self.activity()),
            faults: self.faults.len(),
            moving: self.stage.as_ref().is_some_and(Motion::is_moving),
            homed: self.stage.as_ref().is_some_and(Motion::homed),
            light: self.laser_light(),
            interlock_closed: self.interlock_closed(),
            settings: self.camera.as_ref().map(|camera| camera.settings()),
            corrected: self.dark_frame.is_some(),
        }
    }

    fn status(&mut self, now: Instant) -> StationStatus {
        StationStatus {
            state: self.machine,
            state_history: self.history.clone(),
            activity: self.activity().to_owned(),
            simulated: self.publisher.simulated,
            camera: self.camera_status(),
            camera_settings: self.camera.as_ref().map_or(no_settings(), |camera| camera.settings()),
            dark_frame_use: self.dark_frame_use(),
            frame_rate_hz: self.stamping.rate_hz(now),
            stage: self.stage_status(),
            position_mm: self.stage.as_ref().and_then(Motion::position_mm),
            moving: self.stage.as_ref().is_some_and(Motion::is_moving),
            homed: self.stage.as_ref().is_some_and(Motion::homed),
            laser: self.laser_status(),
            laser_lost_host: self.laser.as_mut().map(|laser| laser.device().lost_host()),
            laser_light: self.laser_light(),
            laser_power: self.laser.as_ref().and_then(Light::state).map_or(0.0, |state| state.power),
            interlock_closed: self.interlock_closed(),
            job_id: self.holder.as_ref().map(|holder| holder.purpose.job_id.clone()),
            faults: self.faults.clone(),
            frames_arrived: self.stamping.arrived(),
            frames_dropped: self.drops.by_reason(),
        }
    }

    fn dark_frame_use(&mut self) -> DarkFrameUse {
        let (Some(dark), Some(camera)) = (&self.dark_frame, &mut self.camera) else {
            return DarkFrameUse::NoDarkFrame;
        };
        let identity = camera.device().identity();
        dark.use_for(&identity, &camera.settings())
    }

    fn laser_light(&self) -> LaserLight {
        let Some(laser) = &self.laser else { return LaserLight::Unknown };
        if !laser.is_switched() {
            return LaserLight::NotControlled;
        }
        if self.is_faulted("laser") || laser.state().is_none() {
            return LaserLight::Unknown;
        }
        let may_emit = self.holder.is_some() || laser.is_requested();
        match (laser.is_on(), may_emit) {
            (true, _) => LaserLight::On,
            (false, true) => LaserLight::Armed,
            (false, false) => LaserLight::Off,
        }
    }

    fn interlock_closed(&self) -> Option<bool> {
        self.laser.as_ref().and_then(Light::state).and_then(|state| state.interlock_closed)
    }

    /// Current activity in the operator's words.
    pub(crate) fn activity(&self) -> &str {
        if let Some(holder) = &self.holder {
            return &holder.purpose.activity;
        }
        let moving = self.stage.as_ref().is_some_and(Motion::is_moving);
        match self.machine {
            MachineState::Preoperational if self.is_opening() || self.resetting.is_some() => {
                "connecting the devices"
            }
            MachineState::Preoperational => "devices are missing",
            MachineState::Halted => "stopped",
            MachineState::Error => "in error",
            MachineState::Operational(_) if moving => "moving manually",
            MachineState::Operational(OperationalState::ContinuousExecution) => "live view",
            MachineState::Operational(OperationalState::Initialized) if !self.calibrated => "not calibrated",
            MachineState::Operational(OperationalState::Initialized) => "not homed",
            MachineState::Operational(_) => "ready",
        }
    }

    fn camera_status(&mut self) -> DeviceStatus<CameraCapabilities> {
        let connected = self.camera.is_some() && !self.is_unreachable("camera");
        match &mut self.camera {
            Some(camera) => {
                let device = camera.device();
                DeviceStatus { connected, identity: device.identity(), capabilities: device.capabilities() }
            }
            None => DeviceStatus { connected, identity: unknown_identity(), capabilities: no_camera() },
        }
    }

    fn stage_status(&mut self) -> DeviceStatus<StageCapabilities> {
        let connected = self.stage.is_some() && !self.is_unreachable("stage");
        match &mut self.stage {
            Some(stage) => {
                let device = stage.device();
                DeviceStatus { connected, identity: device.identity(), capabilities: device.capabilities() }
            }
            None => DeviceStatus { connected, identity: unknown_identity(), capabilities: no_stage() },
        }
    }

    fn laser_status(&mut self) -> DeviceStatus<LaserCapabilities> {
        let connected = self.laser.is_some() && !self.is_unreachable("laser");
        match &mut self.laser {
            Some(laser) => {
                let device = laser.device();
                DeviceStatus { connected, identity: device.identity(), capabilities: device.capabilities() }
            }
            None => DeviceStatus { connected, identity: unknown_identity(), capabilities: no_laser() },
        }
    }
}

/// The status before the devices are known.
pub fn first_status(simulated: Option<&'static str>, state: MachineState) -> StationStatus {
    StationStatus {
        state,
        state_history: StateHistory::default(),
        activity: "connecting the devices".to_owned(),
        simulated,
        camera: DeviceStatus { connected: false, identity: unknown_identity(), capabilities: no_camera() },
        camera_settings: no_settings(),
        dark_frame_use: DarkFrameUse::NoDarkFrame,
        frame_rate_hz: 0.0,
        stage: DeviceStatus { connected: false, identity: unknown_identity(), capabilities: no_stage() },
        position_mm: None,
        moving: false,
        homed: false,
        laser: DeviceStatus { connected: false, identity: unknown_identity(), capabilities: no_laser() },
        laser_lost_host: None,
        laser_light: LaserLight::Unknown,
        laser_power: 0.0,
        interlock_closed: None,
        job_id: None,
        faults: Vec::new(),
        frames_arrived: 0,
        frames_dropped: Vec::new(),
    }
}

fn unknown_identity() -> DeviceIdentity {
    let none = String::new;
    DeviceIdentity { driver: "none", vendor: none(), model: none(), serial: none(), firmware: none() }
}

fn no_camera() -> CameraCapabilities {
    CameraCapabilities {
        sensor_px: (0, 0),
        exposure_us: None,
        gain_db: None,
        frame_rate_hz: None,
        triggers: Vec::new(),
        pixel_formats: Vec::new(),
        roi: false,
    }
}

fn no_settings() -> CameraSettings {
    CameraSettings {
        exposure_us: 0.0,
        gain_db: 0.0,
        frame_rate_hz: 0.0,
        trigger: Trigger::Software,
        pixel_format: PixelFormat::Mono8,
        roi: Roi { left_px: 0, top_px: 0, width_px: 0, height_px: 0 },
    }
}

fn no_stage() -> StageCapabilities {
    StageCapabilities {
        kind: devices::StageKind::Linear,
        travel_mm: (0.0, 0.0),
        max_speed_mm_s: 0.0,
        acceleration_mm_s2: None,
        homing: Homing::Required,
        resolution_mm: 0.0,
        follows_frames: false,
        frame_pitch_mm: None,
    }
}

fn no_laser() -> LaserCapabilities {
    LaserCapabilities { switched: true, power: None, interlock: false }
}
