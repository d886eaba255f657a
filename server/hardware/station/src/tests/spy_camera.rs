//! A camera that counts calls and injects faults.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use devices::features::CameraDetails;
use devices::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, DeviceSet, Driver,
    FrameInfo, OpenError, Opened, ThreadedCamera, Trigger,
};
use vision::{GreyImage, Pixels};

use crate::StationDevices;

/// Observations and injected faults.
#[derive(Debug, Default)]
pub struct Spy {
    /// How long the next opening hangs.
    pub open_hang_ms: AtomicU64,
    /// Number of triggers.
    pub triggers: AtomicU64,
    /// The next call for a frame panics.
    pub panics: AtomicBool,
    /// How long the next call for a frame hangs.
    pub frame_hang_ms: AtomicU64,
    /// Exposures: accepted triggers, or frame numbers of a free-running camera.
    pub exposed: AtomicU64,
    /// Number of next frames to be lost.
    pub loses: AtomicU64,
    /// Frames are lost because they arrive incomplete.
    pub loses_incomplete: AtomicBool,
    /// Frames arrive with half the height.
    pub halves_height: AtomicBool,
    /// Frames arrive with twice the bytes per pixel.
    pub doubles_depth: AtomicBool,
    /// It is unplugged.
    pub is_unplugged: AtomicBool,
}

/// The observed camera.
struct SpyCamera {
    camera: Box<dyn Camera>,
    spy: Arc<Spy>,
    /// Lost since the last delivered frame.
    lost: u64,
    /// It was unplugged and not reconnected since.
    is_disconnected: bool,
}

impl SpyCamera {
    fn check_connected(&mut self) -> Result<(), CameraError> {
        self.is_disconnected |= self.spy.is_unplugged.load(Ordering::SeqCst);
        match self.is_disconnected {
            true => Err(CameraError::Disconnected { reason: "its cable was unplugged".to_owned() }),
            false => Ok(()),
        }
    }

    /// Delivers, changes or drops a frame.
    fn deliver(&mut self, image: &mut GreyImage, info: FrameInfo) -> Option<FrameInfo> {
        let spy = &self.spy;
        let loses = |left: u64| left.checked_sub(1);
        if spy.loses.fetch_update(Ordering::SeqCst, Ordering::SeqCst, loses).is_ok() {
            self.lost += 1 + info.lost_before;
            return None;
        }
        let (width, height) = (image.width(), image.height());
        let n_pixels = if spy.halves_height.load(Ordering::SeqCst) { width * height / 2 } else { width * height };
        let is_deep = spy.doubles_depth.load(Ordering::SeqCst) || image.bit_depth() == 16;
        if n_pixels != width * height || spy.doubles_depth.load(Ordering::SeqCst) {
            let pixels =
                if is_deep { Pixels::Sixteen(vec![0; n_pixels]) } else { Pixels::Eight(vec![0; n_pixels]) };
            *image = GreyImage::new(width, n_pixels / width, pixels).unwrap();
        }
        let lost_before = info.lost_before + std::mem::take(&mut self.lost);
        if self.camera.settings().trigger != Trigger::Software {
            // Exposures after the last frame are unknown.
            spy.exposed.fetch_add(1 + lost_before, Ordering::SeqCst);
        }
        Some(FrameInfo { lost_before, ..info })
    }
}

/// A driver whose camera is observed.
#[derive(Debug)]
struct SpyDriver {
    driver: Arc<dyn Driver>,
    spy: Arc<Spy>,
    /// Whether the camera runs on its own thread.
    threaded: bool,
}

/// The same devices with an observed camera.
pub fn spied(devices: StationDevices) -> (StationDevices, Arc<Spy>) {
    observed(devices, false)
}

/// As [`spied`], with the camera on its own thread.
pub fn spied_on_its_own_thread(devices: StationDevices) -> (StationDevices, Arc<Spy>) {
    observed(devices, true)
}

fn observed(devices: StationDevices, threaded: bool) -> (StationDevices, Arc<Spy>) {
    let spy = Arc::new(Spy::default());
    let camera = Arc::new(SpyDriver { driver: devices.camera, spy: spy.clone(), threaded });
    (StationDevices { camera, ..devices }, spy)
}

impl Driver for SpyDriver {
    fn kind(&self) -> &'static str {
        self.driver.kind()
    }

    fn makes(&self) -> DeviceSet {
        self.driver.makes()
    }

    fn is_real(&self) -> bool {
        self.driver.is_real()
    }

    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let open_ms = self.spy.open_hang_ms.swap(0, Ordering::SeqCst);
        std::thread::sleep(Duration::from_millis(open_ms));
        let opened = self.driver.open(wanted)?;
        let spied = |camera| -> Box<dyn Camera> {
            let spied = SpyCamera { camera, spy: self.spy.clone(), lost: 0, is_disconnected: false };
            if self.threaded { Box::new(ThreadedCamera::over(spied)) } else { Box::new(spied) }
        };
        Ok(Opened { camera: opened.camera.map(spied), ..opened })
    }
}

impl Camera for SpyCamera {
    fn identity(&self) -> DeviceIdentity {
        self.camera.identity()
    }

    fn capabilities(&self) -> CameraCapabilities {
        self.camera.capabilities()
    }

    fn settings(&self) -> CameraSettings {
        self.camera.settings()
    }

    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        self.camera.configure(wanted)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        self.check_connected()?;
        self.lost = 0;
        self.camera.start()
    }

    fn trigger(&mut self) -> Result<(), CameraError> {
        self.spy.triggers.fetch_add(1, Ordering::SeqCst);
        self.check_connected()?;
        self.camera.trigger()?;
        self.spy.exposed.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        assert!(!self.spy.panics.swap(false, Ordering::SeqCst), "an injected panic");
        std::thread::sleep(Duration::from_millis(self.spy.frame_hang_ms.swap(0, Ordering::SeqCst)));
        self.check_connected()?;
        let taken = self.camera.next_frame(image, timeout);
        if matches!(taken, Err(CameraError::WrongFrame { .. }))
            && self.camera.settings().trigger != Trigger::Software
        {
            self.spy.exposed.fetch_add(1, Ordering::SeqCst);
        }
        Ok(taken?.and_then(|info| self.deliver(image, info)))
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.camera.stop()
    }

    fn reconnect(&mut self) -> Result<(), CameraError> {
        self.is_disconnected = false;
        self.camera.reconnect()
    }

    fn details(&self) -> Option<Arc<dyn CameraDetails>> {
        self.camera.details()
    }

    fn n_incomplete(&self) -> u64 {
        if self.spy.loses_incomplete.load(Ordering::SeqCst) { self.lost } else { 0 }
    }
}
