//! The camera contract suite, with the camera on its own thread as in a station.

use std::time::Duration;

use devices::contract::{self, Cable, CameraProfile};
use devices::{CameraRequest, ThreadedCamera};
use v4l2::V4l2Settings;

use devices::Camera as _;

use crate::scripted::{Bench, settings};

fn passes(settings: &V4l2Settings) {
    let bench = Bench::default();
    let (unplugged, replugged) = (bench.clone(), bench.clone());
    let cable =
        Cable { unplug: Box::new(move || unplugged.unplug()), replug: Box::new(move || replugged.replug()) };
    let profile =
        CameraProfile { frame_rate_hz: Some(200.0), frame_limit: Duration::from_secs(5), cable: Some(cable) };
    contract::camera(
        &mut || {
            bench.unplug();
            bench.replug();
            let mut camera = bench.open(settings).unwrap_or_else(|error| panic!("{error}"));
            camera.configure(&CameraRequest { exposure_us: Some(1000.0), ..CameraRequest::default() }).unwrap();
            Box::new(ThreadedCamera::over(camera))
        },
        &profile,
    );
}

#[test]
fn a_camera_that_sends_raw_pixels_passes_the_suite() {
    passes(&settings());
}

#[test]
fn a_camera_that_sends_jpeg_images_passes_the_suite() {
    passes(&V4l2Settings { format_8: "MJPG".to_owned(), ..settings() });
}
