//! A camera that counts what is asked of it, and fails as no device should.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use devices::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, DeviceSet, Driver,
    FrameInfo, OpenError, Opened, ThreadedCamera,
};
use vision::GreyImage;

use crate::StationDevices;

/// What the test sees and does.
#[derive(Debug, Default)]
pub struct Spy {
    /// How long the next opening hangs.
    pub open_hangs_ms: AtomicU64,
    /// Exposures asked for.
    pub triggers: AtomicU64,
    /// The next call for a frame panics.
    pub panics: AtomicBool,
    /// How long the next call for a frame hangs.
    pub hangs_ms: AtomicU64,
}

/// A camera under observation.
struct Spied {
    camera: Box<dyn Camera>,
    spy: Arc<Spy>,
}

/// A driver whose camera is under observation.
#[derive(Debug)]
struct SpiedDriver {
    driver: Arc<dyn Driver>,
    spy: Arc<Spy>,
    /// Whether the camera has a thread of its own.
    threaded: bool,
}

/// The same devices with the camera under observation.
pub fn spied(devices: StationDevices) -> (StationDevices, Arc<Spy>) {
    observed(devices, false)
}

/// The same with the camera behind a thread of its own.
pub fn spied_behind_a_thread(devices: StationDevices) -> (StationDevices, Arc<Spy>) {
    observed(devices, true)
}

fn observed(devices: StationDevices, threaded: bool) -> (StationDevices, Arc<Spy>) {
    let spy = Arc::new(Spy::default());
    let camera = Arc::new(SpiedDriver { driver: devices.camera, spy: spy.clone(), threaded });
    (StationDevices { camera, ..devices }, spy)
}

impl Driver for SpiedDriver {
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
        let open_ms = self.spy.open_hangs_ms.swap(0, Ordering::SeqCst);
        std::thread::sleep(Duration::from_millis(open_ms));
        let opened = self.driver.open(wanted)?;
        let spied = |camera| -> Box<dyn Camera> {
            let spied = Spied { camera, spy: self.spy.clone() };
            if self.threaded { Box::new(ThreadedCamera::over(spied)) } else { Box::new(spied) }
        };
        Ok(Opened { camera: opened.camera.map(spied), ..opened })
    }
}

impl Camera for Spied {
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
        self.camera.start()
    }

    fn trigger(&mut self) -> Result<(), CameraError> {
        self.spy.triggers.fetch_add(1, Ordering::SeqCst);
        self.camera.trigger()
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        assert!(!self.spy.panics.swap(false, Ordering::SeqCst), "a planted defect");
        std::thread::sleep(Duration::from_millis(self.spy.hangs_ms.swap(0, Ordering::SeqCst)));
        self.camera.next_frame(image, timeout)
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.camera.stop()
    }

    fn reconnect(&mut self) -> Result<(), CameraError> {
        self.camera.reconnect()
    }
}
