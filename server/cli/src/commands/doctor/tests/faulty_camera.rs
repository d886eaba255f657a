//! The simulated camera with injected faults that the twin does not provide.

use std::sync::Arc;
use std::time::Duration;

use devices::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, DeviceSet, Driver,
    FrameInfo, OpenError, Opened,
};
use twin::TwinDriver;
use vision::{GreyImage, Pixels};

/// Faults of the camera.
#[derive(Debug, Clone, Copy)]
pub struct CameraFaults {
    /// Gamma of the response: light to the power of 1/gamma.
    pub gamma: f64,
    /// Every other time stamp is early by this amount.
    pub jitter_ms: f64,
    /// From this laser switch-off on, counted from 1, images still show the laser light; 0: never.
    pub lit_from_switch_off: usize,
}

impl Default for CameraFaults {
    /// No faults.
    fn default() -> Self {
        Self { gamma: 1.0, jitter_ms: 0.0, lit_from_switch_off: 0 }
    }
}

/// Driver of the simulated camera with these faults.
#[derive(Debug)]
pub struct FaultyCameraDriver {
    pub twin: Arc<TwinDriver>,
    pub faults: CameraFaults,
}

impl Driver for FaultyCameraDriver {
    fn kind(&self) -> &'static str {
        "twin"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet { camera: true, ..DeviceSet::default() }
    }

    fn is_real(&self) -> bool {
        false
    }

    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let opened = self.twin.open(wanted)?;
        let faults = self.faults;
        let camera = opened.camera.map(|camera| {
            Box::new(FaultyCamera { camera, faults, lit: None, n_switch_offs: 0 }) as Box<dyn Camera>
        });
        Ok(Opened { camera, ..Opened::default() })
    }
}

struct FaultyCamera {
    camera: Box<dyn Camera>,
    faults: CameraFaults,
    /// The last image with laser light, until a dark one follows.
    lit: Option<GreyImage>,
    n_switch_offs: usize,
}

/// Maximum grey level of a laser-off image: twice the sum of eight levels and six sigma of noise.
const MAX_DARK_LEVEL: f32 = 40.0;

impl FaultyCamera {
    fn keep_light(&mut self, image: &mut GreyImage) {
        let mut levels = (0..image.height()).flat_map(|v| (0..image.width()).map(move |u| (u, v)));
        if levels.any(|(u, v)| image.at(u, v) > MAX_DARK_LEVEL) {
            self.lit = Some(image.clone());
        } else if let Some(lit) = &self.lit {
            if self.n_switch_offs + 1 == self.faults.lit_from_switch_off {
                image.clone_from(lit);
            } else {
                (self.lit, self.n_switch_offs) = (None, self.n_switch_offs + 1);
            }
        }
    }
}

impl Camera for FaultyCamera {
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
        self.camera.trigger()
    }
    fn is_computing(&self) -> bool {
        self.camera.is_computing()
    }
    fn stop(&mut self) -> Result<(), CameraError> {
        self.camera.stop()
    }
    fn reconnect(&mut self) -> Result<(), CameraError> {
        self.camera.reconnect()
    }
    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        let taken = self.camera.next_frame(image, timeout)?;
        let Some(mut info) = taken else { return Ok(None) };
        if self.faults.gamma != 1.0
            && let Pixels::Eight(pixels) = image.pixels()
        {
            let (width, height) = (image.width(), image.height());
            let curve =
                |&pixel: &u8| (255.0 * (f64::from(pixel) / 255.0).powf(1.0 / self.faults.gamma)).round() as u8;
            let bent = pixels.iter().map(curve).collect();
            *image = GreyImage::new(width, height, Pixels::Eight(bent)).expect("as many pixels as before");
        }
        self.keep_light(image);
        if info.frame_id % 2 == 1 {
            info.exposed_at -= Duration::from_secs_f64(self.faults.jitter_ms * 1e-3);
        }
        Ok(Some(info))
    }
}
