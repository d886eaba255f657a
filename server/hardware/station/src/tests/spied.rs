//! A camera that counts what is asked of it, and fails as no device should.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use devices::{Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, FrameInfo};
use vision::GreyImage;

use crate::parts::devices::{Opened, Parts, Wanted};

/// What the test sees and does.
#[derive(Default)]
pub struct Spy {
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

/// The same parts with the camera under observation.
pub fn spied(parts: Parts) -> (Parts, Arc<Spy>) {
    let spy = Arc::new(Spy::default());
    let (opener, observer) = (parts.opener, spy.clone());
    let opener = Arc::new(move |wanted: Wanted| {
        let opened = opener(wanted);
        let spied = |camera| Box::new(Spied { camera, spy: observer.clone() }) as Box<dyn Camera>;
        Opened { camera: opened.camera.map(spied), ..opened }
    });
    (Parts { opener, ..parts }, spy)
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
