//! The camera of a station.

use parking_lot::Mutex;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use devices::features::{CameraDetails, CameraLink};
use devices::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, FrameInfo, OpenError,
    Trigger,
};
use vision::GreyImage;

use crate::aravis::AravisError;
use crate::details::Details;
use crate::gvcp::{self, Control};
use crate::laser::GenicamLaser;
use crate::names;
use crate::opened::{OpenedCamera, refused};
use crate::running::Running;
use crate::settings::GenicamSettings;
use crate::shared::Shared;

/// Interval of probes of a silent or idle camera: after three missing responses it is reported as disconnected within a
/// second.
const PROBE_PERIOD: Duration = Duration::from_millis(300);

/// How long a lost camera is searched for after a reconnection was requested.
const RECONNECT_LIMIT: Duration = Duration::from_secs(30);

/// Pause between two attempts to reopen it.
const RECONNECT_PAUSE: Duration = Duration::from_millis(100);

/// Interval of temperature readings.
const TEMPERATURE_PERIOD: Duration = Duration::from_secs(5);

/// A GigE Vision or USB3 Vision camera. Its calls take as long as the camera: a station uses it through
/// [`devices::ThreadedCamera`].
pub struct GenicamCamera {
    config: GenicamSettings,
    shared: Arc<Shared>,
    identity: DeviceIdentity,
    capabilities: CameraCapabilities,
    settings: CameraSettings,
    running: Option<Running>,
    last_id: Option<u64>,
    disconnected: Option<String>,
    /// Set when the disconnected camera is closed.
    is_closed: Arc<AtomicBool>,
    reconnecting: Option<Receiver<OpenedCamera>>,
    probed_at: Instant,
    temperature_at: Option<Instant>,
}

impl GenicamCamera {
    /// Opens the configured camera.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn open(config: &GenicamSettings) -> Result<Self, OpenError> {
        let opened = OpenedCamera::open(config, None)?;
        let (identity, capabilities) = (opened.identity(), opened.capabilities());
        let settings = opened.settings(Trigger::Free).map_err(|error| {
            let serial = &config.serial;
            OpenError::Settings {
                what: format!("the camera with serial number `{serial}` does not report its settings: {error}"),
                remedy: "restart the camera".to_owned(),
            }
        })?;
        let link = initial_link(&opened, config);
        let shared = Shared { opened: Mutex::new(Some(opened)), link: Mutex::new(link), ..Shared::default() };
        Ok(Self {
            config: config.clone(),
            shared: Arc::new(shared),
            identity,
            capabilities,
            settings,
            running: None,
            last_id: None,
            disconnected: None,
            is_closed: Arc::new(AtomicBool::new(true)),
            reconnecting: None,
            probed_at: Instant::now(),
            temperature_at: None,
        })
    }

    /// The laser on its output line.
    pub(crate) fn laser(&self) -> GenicamLaser {
        GenicamLaser::over(&self.config, self.shared.clone(), &self.identity)
    }

    fn check(&mut self) -> Result<(), CameraError> {
        if let Some(returned) = &self.reconnecting {
            match returned.try_recv() {
                Ok(opened) => self.install(opened),
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => self.reconnecting = None,
            }
        }
        self.disconnected.clone().map_or(Ok(()), |reason| Err(CameraError::Disconnected { reason }))
    }

    fn install(&mut self, opened: OpenedCamera) {
        let mut link = initial_link(&opened, &self.config);
        {
            let before = self.shared.link.lock();
            link.frames_complete = before.frames_complete;
            link.frames_incomplete = before.frames_incomplete;
            link.frames_missing = before.frames_missing;
        }
        if let Ok(settings) = opened.settings(self.settings.trigger) {
            self.settings = settings;
        }
        *self.shared.link.lock() = link;
        *self.shared.opened.lock() = Some(opened);
        (self.disconnected, self.reconnecting, self.last_id) = (None, None, None);
        self.probed_at = Instant::now();
    }

    /// Calls a function with the open camera; if the camera does not respond, the error is [`CameraError::Disconnected`].
    fn with_opened<T>(
        &mut self,
        setting: &'static str,
        call: impl FnOnce(&OpenedCamera) -> Result<T, AravisError>,
    ) -> Result<T, CameraError> {
        self.check()?;
        let outcome = self.shared.opened.lock().as_ref().map(call);
        match outcome {
            Some(Ok(value)) => Ok(value),
            Some(Err(error)) => {
                self.probe()?;
                Err(refused(setting)(error))
            }
            None => Err(CameraError::Disconnected { reason: "it is closed".to_owned() }),
        }
    }

    /// Checks that it is connected and still controlled by this program.
    fn probe(&mut self) -> Result<(), CameraError> {
        let (is_gige, address) = {
            let opened = self.shared.opened.lock();
            let Some(opened) = opened.as_ref() else { return Ok(()) };
            (opened.device.is_gige(), opened.listed.address.clone())
        };
        let problem = if is_gige {
            match gvcp::control(&address) {
                Some(Control::Held(_)) => None,
                Some(Control::Free) => {
                    Some("it is no longer controlled by this program: it restarted, or its link was interrupted")
                }
                None => Some("it no longer responds"),
            }
        } else {
            let answers = self.shared.opened.lock().as_ref().is_some_and(|opened| opened.device.answers());
            (!answers).then_some("it no longer responds")
        };
        self.probed_at = Instant::now();
        problem.map_or(Ok(()), |problem| Err(self.mark_disconnected(format!("{problem} ({address})"))))
    }

    /// Drops a disconnected camera; closing it takes seconds and is done on another thread.
    fn mark_disconnected(&mut self, reason: String) -> CameraError {
        self.close();
        self.disconnected = Some(reason.clone());
        CameraError::Disconnected { reason }
    }

    fn close(&mut self) {
        let (running, opened) = (self.running.take(), self.shared.opened.lock().take());
        self.is_closed = Arc::new(AtomicBool::new(false));
        let is_closed = self.is_closed.clone();
        let close = move || {
            drop(running);
            drop(opened);
            is_closed.store(true, Ordering::Release);
        };
        // If the thread cannot be created, the closure and the camera are dropped here; a reconnection waits until it
        // is closed.
        if thread::Builder::new().name("genicam-close".to_owned()).spawn(close).is_err() {
            self.is_closed.store(true, Ordering::Release);
        }
    }

    /// Probes a camera that has been silent for longer than normal.
    fn probe_if_silent(&mut self) -> Result<(), CameraError> {
        let normal_silence = self.running.as_ref().map_or(Duration::ZERO, Running::normal_silence);
        let received_at = self.running.as_ref().map_or(self.probed_at, |running| running.received_at);
        let silent = received_at.elapsed() > normal_silence.max(PROBE_PERIOD);
        if silent && self.probed_at.elapsed() > PROBE_PERIOD { self.probe() } else { Ok(()) }
    }

    fn read_temperature(&mut self) {
        if self.temperature_at.is_some_and(|at| at.elapsed() < TEMPERATURE_PERIOD) {
            return;
        }
        self.temperature_at = Some(Instant::now());
        // While a reader of features uses the camera, the temperature is read at the next opportunity.
        let Some(opened) = self.shared.opened.try_lock() else { return };
        let device = opened.as_ref().map(|opened| &opened.device);
        let read = |device: &crate::aravis::Device| device.number(device.first(&names::TEMPERATURE)?).ok();
        self.shared.link.lock().temperature_c = device.and_then(read).map(|number| number.value);
    }

    fn stop_running(&mut self) -> Result<(), CameraError> {
        let Some(running) = self.running.take() else { return Ok(()) };
        self.last_id = running.last_id();
        let stopped = self.with_opened("acquisition", |opened| opened.device.stop());
        drop(running);
        stopped
    }
}

/// Initial state of the link.
fn initial_link(opened: &OpenedCamera, config: &GenicamSettings) -> CameraLink {
    CameraLink {
        address: opened.listed.address.clone(),
        packet_size_bytes: Some(opened.packet_size_bytes).filter(|&bytes| bytes > 0),
        pixels_from: opened
            .source_format()
            .map_or_else(|error| error.to_string(), |format| format.description(config.sensor_colour)),
        ..CameraLink::default()
    }
}

/// A request for all settings.
fn full_request(settings: &CameraSettings, capabilities: &CameraCapabilities) -> CameraRequest {
    CameraRequest {
        exposure_us: capabilities.exposure_us.map(|_| settings.exposure_us),
        gain_db: capabilities.gain_db.map(|_| settings.gain_db),
        frame_rate_hz: capabilities.frame_rate_hz.map(|_| settings.frame_rate_hz),
        trigger: Some(settings.trigger),
        pixel_format: Some(settings.pixel_format),
        roi: Some(settings.roi),
    }
}

impl Camera for GenicamCamera {
    fn identity(&self) -> DeviceIdentity {
        self.identity.clone()
    }

    fn capabilities(&self) -> CameraCapabilities {
        self.capabilities.clone()
    }

    fn settings(&self) -> CameraSettings {
        self.settings
    }

    fn details(&self) -> Option<Arc<dyn CameraDetails>> {
        Some(Arc::new(Details(self.shared.clone())))
    }

    fn n_incomplete(&self) -> u64 {
        self.running.as_ref().map_or(0, Running::n_incomplete)
    }

    fn configure(&mut self, request: &CameraRequest) -> Result<CameraSettings, CameraError> {
        self.capabilities.expected(&self.settings, request)?;
        let now = self.settings;
        let needs_restart = request.trigger.is_some_and(|trigger| trigger != now.trigger)
            || request.roi.is_some_and(|roi| roi != now.roi)
            || request.pixel_format.is_some_and(|format| format != now.pixel_format);
        let is_restarted = needs_restart && self.running.is_some();
        if is_restarted {
            self.stop_running()?;
        }
        let (sensor_px, config) = (self.capabilities.sensor_px, self.config.clone());
        let trigger = request.trigger.unwrap_or(now.trigger);
        // Unchanged settings are skipped: each takes one or several round trips to the camera.
        let changed = CameraRequest {
            trigger: request.trigger.filter(|trigger| *trigger != now.trigger),
            roi: request.roi.filter(|roi| *roi != now.roi),
            pixel_format: request.pixel_format.filter(|format| *format != now.pixel_format),
            ..*request
        };
        let outcome = self.with_opened("setting", |opened| {
            opened.set(&changed, sensor_px, &config)?;
            let pixels_from = opened.source_format()?.description(config.sensor_colour);
            Ok((opened.settings(trigger)?, pixels_from))
        });
        if let Ok((settings, pixels_from)) = &outcome {
            self.settings = *settings;
            self.shared.link.lock().pixels_from = pixels_from.clone();
            if let Some(running) = &mut self.running {
                running.set(*settings);
            }
        }
        if is_restarted {
            self.start()?;
        }
        outcome.map(|(settings, _)| settings)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        self.check()?;
        if self.running.is_some() {
            return Ok(());
        }
        let (config, settings, last_id) = (self.config.clone(), self.settings, self.last_id);
        let started =
            self.with_opened("acquisition", |opened| Running::start(opened, &config, settings, last_id))?;
        self.running = Some(started);
        Ok(())
    }

    fn trigger(&mut self) -> Result<(), CameraError> {
        if self.settings.trigger != Trigger::Software {
            return Err(CameraError::NotTriggerable { reason: "it is not set to software triggers" });
        }
        if self.running.is_none() {
            self.check()?;
            return Err(CameraError::NotTriggerable { reason: "acquisition is not started" });
        }
        let sent_at = Instant::now();
        self.with_opened("trigger", |opened| opened.device.execute("TriggerSoftware"))?;
        if let Some(running) = &mut self.running {
            running.note_trigger(sent_at);
        }
        Ok(())
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        self.check()?;
        self.read_temperature();
        let Some(running) = &mut self.running else {
            self.probe_if_silent()?;
            thread::sleep(timeout);
            return Ok(None);
        };
        // The counters are stored after the wait, during which readers must not be blocked.
        let mut link = self.shared.link.lock().clone();
        let received = running.next_frame(image, timeout, &mut link);
        {
            let mut link_now = self.shared.link.lock();
            link.temperature_c = link_now.temperature_c;
            *link_now = link;
        }
        if let Ok(None) = received {
            self.probe_if_silent()?;
        }
        received
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        if self.disconnected.is_some() {
            return Ok(());
        }
        self.stop_running()
    }

    /// Closes the camera and searches for it until it responds; restores its settings and every feature set by name.
    fn reconnect(&mut self) -> Result<(), CameraError> {
        if self.reconnecting.is_some() {
            return Ok(());
        }
        let known = self.shared.opened.lock().as_ref().map(|opened| opened.listed.clone());
        self.close();
        self.disconnected = Some("it is being reconnected".to_owned());
        let (sender, receiver) = sync_channel(1);
        let (config, is_closed, shared) = (self.config.clone(), self.is_closed.clone(), self.shared.clone());
        let request = full_request(&self.settings, &self.capabilities);
        let sensor_px = self.capabilities.sensor_px;
        let reopen = move || {
            let until = Instant::now() + RECONNECT_LIMIT;
            while Instant::now() < until {
                if is_closed.load(Ordering::Acquire)
                    && let Ok(opened) = OpenedCamera::open(&config, known.as_ref())
                {
                    for (name, value) in shared.set_by_name.lock().iter() {
                        // A feature that is refused now keeps its current value, which is displayed.
                        let _ = opened.device.set_feature(name, value);
                    }
                    if opened.set(&request, sensor_px, &config).is_ok() {
                        let _ = sender.try_send(opened);
                        return;
                    }
                }
                thread::sleep(RECONNECT_PAUSE);
            }
        };
        let thread = thread::Builder::new().name("genicam-open".to_owned()).spawn(reopen);
        thread.map_err(|error| CameraError::Disconnected {
            reason: format!("its reconnection thread could not be created: {error}"),
        })?;
        self.reconnecting = Some(receiver);
        Ok(())
    }
}

impl Drop for GenicamCamera {
    /// Closes it before the program may end, so that it is not left in use; one that does not respond is abandoned.
    fn drop(&mut self) {
        if self.probe().is_ok() {
            drop(self.running.take());
            drop(self.shared.opened.lock().take());
        }
    }
}
