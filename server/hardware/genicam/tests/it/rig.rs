//! Shared by the tests: a camera process, and the driver opened on it.

use std::time::{Duration, Instant};

use devices::{Camera, CameraError, CameraRequest, DeviceSet, Driver, FrameInfo, Roi};
use genicam::fake_camera::{FakeCamera, FakeOptions, PROGRAM};
use genicam::{GenicamDriver, GenicamSettings};
use vision::{GreyImage, Pixels};

/// Serial number of the camera process.
pub const SERIAL: &str = "SHEAF01";

/// Packet size of a network with jumbo frames: a busy machine loses packets of a burst of small ones.
const PACKET_SIZE_BYTES: u32 = 8000;

/// Longest wait for an expected event.
pub const WAIT_LIMIT: Duration = Duration::from_secs(20);

/// Starts a camera process that loses so many packets per thousand; `None`, with a note, if it is not installed.
pub fn fake(lost_per_thousand: u32) -> Option<FakeCamera> {
    if !reference::has_program(PROGRAM, "aravis-tools") {
        return None;
    }
    let options = FakeOptions { serial: SERIAL.to_owned(), lost_per_thousand, ..FakeOptions::default() };
    Some(FakeCamera::start(options).expect("the camera process starts"))
}

/// Driver settings for the camera with this serial number.
pub fn settings(serial: &str) -> GenicamSettings {
    let serial = serial.to_owned();
    GenicamSettings { serial, packet_size_bytes: PACKET_SIZE_BYTES, ..GenicamSettings::default() }
}

/// Opens the camera as a station does.
pub fn open(settings: &GenicamSettings) -> Box<dyn Camera> {
    let wanted = DeviceSet { camera: true, ..DeviceSet::default() };
    let opened = GenicamDriver(settings.clone()).open(wanted);
    opened.unwrap_or_else(|error| panic!("{error}")).camera.expect("a camera was wanted")
}

/// Opens it with a small image, which a busy machine receives without loss.
pub fn open_small(settings: &GenicamSettings, frame_rate_hz: f64) -> Box<dyn Camera> {
    let mut camera = open(settings);
    let roi = Roi { left_px: 16, top_px: 8, width_px: 128, height_px: 96 };
    let wanted = CameraRequest { roi: Some(roi), frame_rate_hz: Some(frame_rate_hz), ..CameraRequest::default() };
    camera.configure(&wanted).expect("a region and a rate");
    assert_eq!(camera.settings().roi, roi);
    camera
}

pub fn blank() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel for one pixel")
}

/// Receives frames until `seen` returns a value.
pub fn until<T>(
    camera: &mut dyn Camera,
    image: &mut GreyImage,
    what: &str,
    mut seen: impl FnMut(&GreyImage, Result<Option<FrameInfo>, CameraError>) -> Option<T>,
) -> T {
    let began = Instant::now();
    loop {
        let got = camera.next_frame(image, Duration::from_millis(20));
        if let Some(value) = seen(image, got) {
            return value;
        }
        assert!(began.elapsed() < WAIT_LIMIT, "{what}: not within {WAIT_LIMIT:?}");
    }
}

/// Returns the next frame.
pub fn frame(camera: &mut dyn Camera, image: &mut GreyImage) -> FrameInfo {
    until(camera, image, "a frame", |_, got| got.expect("the camera is connected"))
}
