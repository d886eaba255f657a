//! The camera device.

use std::io;
use std::thread;
use std::time::{Duration, Instant};

use devices::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, FrameInfo, OpenError,
};
use vision::GreyImage;

use crate::acquisition::Acquisition;
use crate::controls::{self, NotManual};
use crate::device::VideoDevice;
use crate::opened::{OpenedCamera, not_opened, refused};
use crate::settings::V4l2Settings;

/// Interval at which an idle or silent camera is probed.
const PROBE_PERIOD: Duration = Duration::from_millis(300);

/// How long a lost camera is searched for after a reconnection was requested.
const RECONNECT_LIMIT: Duration = Duration::from_secs(30);

/// Pause between two attempts to open it again.
const RECONNECT_PAUSE: Duration = Duration::from_millis(100);

/// Longest wait for one frame, irrespective of the caller's timeout: a driver that blocks longer counts as hanging.
const MAX_WAIT: Duration = Duration::from_millis(500);

/// Opens the device file.
pub type Open = Box<dyn FnMut() -> io::Result<Box<dyn VideoDevice>> + Send>;

/// A Video4Linux2 camera. Its calls block as long as the camera: a station uses it through [`devices::ThreadedCamera`].
pub struct V4l2Camera {
    config: V4l2Settings,
    open: Open,
    identity: DeviceIdentity,
    capabilities: CameraCapabilities,
    settings: CameraSettings,
    link: Link,
    acquisition: Option<Acquisition>,
    probed_at: Instant,
}

/// State of the connection.
enum Link {
    Open(OpenedCamera),
    Disconnected {
        reason: String,
    },
    /// Searched for until then; last attempt at.
    Searching {
        until: Instant,
        tried_at: Option<Instant>,
    },
}

impl V4l2Camera {
    /// Opens and prepares the camera: stopped, all automatic functions off.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn open(config: &V4l2Settings, mut open: Open) -> Result<Self, OpenError> {
        let device = open().map_err(|error| not_opened(&config.device, &error))?;
        let opened = OpenedCamera::prepare(device, config)?;
        let settings = opened.settings().map_err(|error| OpenError::Settings {
            what: format!("the camera {} does not report its settings: {error}", config.device),
            remedy: "plug it in again".to_owned(),
        })?;
        Ok(Self {
            config: config.clone(),
            open,
            identity: opened.identity(),
            capabilities: opened.capabilities(),
            settings,
            link: Link::Open(opened),
            acquisition: None,
            probed_at: Instant::now(),
        })
    }

    /// The camera, if it is connected; attempts to reopen one that is searched for.
    fn opened(&mut self) -> Result<&mut OpenedCamera, CameraError> {
        self.try_reconnect();
        match &mut self.link {
            Link::Open(opened) => Ok(opened),
            Link::Disconnected { reason } => Err(CameraError::Disconnected { reason: reason.clone() }),
            Link::Searching { .. } => {
                Err(CameraError::Disconnected { reason: "it is being reconnected".to_owned() })
            }
        }
    }

    fn try_reconnect(&mut self) {
        let Link::Searching { until, tried_at } = &mut self.link else { return };
        if tried_at.is_some_and(|at| at.elapsed() < RECONNECT_PAUSE) {
            return;
        }
        *tried_at = Some(Instant::now());
        if Instant::now() > *until {
            self.link = Link::Disconnected { reason: "it could not be reconnected".to_owned() };
            return;
        }
        if let Some(opened) = self.reopened() {
            (self.link, self.probed_at) = (Link::Open(opened), Instant::now());
        }
    }

    /// The reopened camera with its previous settings; `None` if it is missing, or is a different one.
    fn reopened(&mut self) -> Option<OpenedCamera> {
        let mut opened = OpenedCamera::prepare((self.open)().ok()?, &self.config).ok()?;
        if opened.capabilities() != self.capabilities {
            return None;
        }
        let capabilities = &self.capabilities;
        let wanted = CameraRequest {
            exposure_us: capabilities.exposure_us.map(|_| self.settings.exposure_us),
            frame_rate_hz: capabilities.frame_rate_hz.map(|_| self.settings.frame_rate_hz),
            pixel_format: Some(self.settings.pixel_format),
            ..CameraRequest::default()
        };
        opened.set(&wanted, &self.config).ok()?;
        self.settings = opened.settings().ok()?;
        Some(opened)
    }

    /// Closes the camera if the error means that it was unplugged.
    fn fail(&mut self, setting: &'static str, error: io::Error) -> CameraError {
        let failure = refused(setting, error);
        if let CameraError::Disconnected { reason } = &failure {
            self.acquisition = None;
            self.link = Link::Disconnected { reason: reason.clone() };
        }
        failure
    }

    /// Probes it at intervals.
    fn probe(&mut self) -> Result<(), CameraError> {
        if self.probed_at.elapsed() < PROBE_PERIOD {
            return Ok(());
        }
        self.probed_at = Instant::now();
        let answer = self.opened()?.device.card();
        answer.map(drop).map_err(|error| self.fail("device", error))
    }

    fn stop_streaming(&mut self) -> Result<(), CameraError> {
        self.acquisition = None;
        let Link::Open(opened) = &mut self.link else { return Ok(()) };
        opened.device.stop().map_err(|error| self.fail("acquisition", error))
    }
}

impl Camera for V4l2Camera {
    fn identity(&self) -> DeviceIdentity {
        self.identity.clone()
    }

    fn capabilities(&self) -> CameraCapabilities {
        self.capabilities.clone()
    }

    fn settings(&self) -> CameraSettings {
        self.settings
    }

    fn n_incomplete(&self) -> u64 {
        self.acquisition.as_ref().map_or(0, Acquisition::n_damaged)
    }

    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        self.capabilities.expected(&self.settings, wanted)?;
        self.opened()?;
        let restarted = self.acquisition.is_some() && OpenedCamera::needs_stop(&self.settings, wanted);
        if restarted {
            self.stop_streaming()?;
        }
        let config = self.config.clone();
        let opened = self.opened()?;
        let set = opened.set(wanted, &config).and_then(|()| opened.settings());
        match set {
            Ok(settings) => {
                self.settings = settings;
                if let Some(acquisition) = &mut self.acquisition {
                    acquisition.set(settings);
                }
            }
            Err(error) => return Err(self.fail("setting", error)),
        }
        if restarted {
            self.start()?;
        }
        Ok(self.settings)
    }

    /// Automatic functions are turned off again: another program may have turned one on.
    fn start(&mut self) -> Result<(), CameraError> {
        let (n_buffers, channel, settings) = (self.config.buffers, self.config.channel, self.settings);
        let is_running = self.acquisition.is_some();
        let opened = self.opened()?;
        if is_running {
            return Ok(());
        }
        let manual = controls::turn_off_automatic_functions(&mut *opened.device);
        let acquisition = Acquisition::new(opened.format, opened.source, channel, settings);
        let started = match manual {
            Ok(()) => opened.device.start(n_buffers).map_err(|error| ("acquisition", error)),
            Err(NotManual::StaysAutomatic(what)) => Err((what, io::Error::other("it cannot be turned off"))),
            Err(NotManual::Refused(what, error)) => Err((what, error)),
        };
        started.map_err(|(setting, error)| self.fail(setting, error))?;
        self.acquisition = Some(acquisition);
        Ok(())
    }

    fn trigger(&mut self) -> Result<(), CameraError> {
        Err(CameraError::NotTriggerable { reason: "it has no trigger" })
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        self.opened()?;
        let deadline = Instant::now() + timeout.min(MAX_WAIT);
        let (Link::Open(opened), Some(acquisition)) = (&mut self.link, &mut self.acquisition) else {
            self.probe()?;
            thread::sleep(timeout);
            return Ok(None);
        };
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let mut outcome = Ok(None);
            let came = opened.device.take(left, &mut |filled| {
                outcome = acquisition.take(filled, Instant::now(), image);
            });
            match (came, outcome) {
                (Err(error), _) => return Err(self.fail("acquisition", error)),
                (Ok(false), _) => return self.probe().map(|()| None),
                (Ok(true), Ok(None)) => {}
                (Ok(true), outcome) => return outcome,
            }
        }
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.stop_streaming()
    }

    /// Closes the camera and, on every use, tries to reopen it.
    fn reconnect(&mut self) -> Result<(), CameraError> {
        if !matches!(self.link, Link::Searching { .. }) {
            self.stop_streaming().ok();
            self.link = Link::Searching { until: Instant::now() + RECONNECT_LIMIT, tried_at: None };
        }
        Ok(())
    }
}

impl Drop for V4l2Camera {
    fn drop(&mut self) {
        self.stop_streaming().ok();
    }
}
