//! The simulated camera with faults that a simulated sensor does not have.

use std::sync::Arc;
use std::time::Duration;

use devices::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, DeviceSet, Driver,
    FrameInfo, OpenError, Opened,
};
use twin::TwinDriver;
use vision::{GreyImage, Pixels};

/// What is wrong with the camera.
#[derive(Debug, Clone, Copy)]
pub struct Unsound {
    /// Its response: light to the power of 1/gamma.
    pub gamma: f64,
    /// Every other time stamp is early by so much.
    pub jitter_ms: f64,
    /// From that fall of darkness on, counted from 1, pictures show the light that was there before; 0: never.
    pub lit_from_fall: usize,
}

impl Default for Unsound {
    /// Nothing.
    fn default() -> Self {
        Self { gamma: 1.0, jitter_ms: 0.0, lit_from_fall: 0 }
    }
}

/// Makes that camera of a simulated world.
#[derive(Debug)]
pub struct UnsoundCamera {
    pub twin: Arc<TwinDriver>,
    pub unsound: Unsound,
}

impl Driver for UnsoundCamera {
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
        let unsound = self.unsound;
        let camera = opened
            .camera
            .map(|camera| Box::new(Opening { camera, unsound, lit: None, n_falls: 0 }) as Box<dyn Camera>);
        Ok(Opened { camera, ..Opened::default() })
    }
}

struct Opening {
    camera: Box<dyn Camera>,
    unsound: Unsound,
    /// The last picture with light, as long as nothing dark came after it.
    lit: Option<GreyImage>,
    n_falls: usize,
}

/// Brightest grey level of a picture in the dark: eight levels and six sigma of noise, with as much again.
const BRIGHTEST_IN_THE_DARK: f32 = 40.0;

impl Opening {
    fn keep_light(&mut self, image: &mut GreyImage) {
        let mut levels = (0..image.height()).flat_map(|v| (0..image.width()).map(move |u| (u, v)));
        if levels.any(|(u, v)| image.at(u, v) > BRIGHTEST_IN_THE_DARK) {
            self.lit = Some(image.clone());
        } else if let Some(lit) = &self.lit {
            if self.n_falls + 1 == self.unsound.lit_from_fall {
                image.clone_from(lit);
            } else {
                (self.lit, self.n_falls) = (None, self.n_falls + 1);
            }
        }
    }
}

impl Camera for Opening {
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
        if self.unsound.gamma != 1.0
            && let Pixels::Eight(pixels) = image.pixels()
        {
            let (width, height) = (image.width(), image.height());
            let curve =
                |&pixel: &u8| (255.0 * (f64::from(pixel) / 255.0).powf(1.0 / self.unsound.gamma)).round() as u8;
            let bent = pixels.iter().map(curve).collect();
            *image = GreyImage::new(width, height, Pixels::Eight(bent)).expect("as many pixels as before");
        }
        self.keep_light(image);
        if info.frame_id % 2 == 1 {
            info.exposed_at -= Duration::from_secs_f64(self.unsound.jitter_ms * 1e-3);
        }
        Ok(Some(info))
    }
}
