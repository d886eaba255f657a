//! The simulated station through the traits: what is commanded is what is seen.

#![allow(clippy::unwrap_used, missing_docs)]

use std::time::{Duration, Instant};

use devices::{Camera, CameraRequest, FrameInfo, Laser, Stage, Trigger};
use twin::live::{BOARD_EXPOSURE_US, LASER_EXPOSURE_US};
use twin::{SceneKind, StationModel, StationShape, TwinCamera, TwinOptions, TwinStation};
use vision::{GreyImage, Pixels};

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(20);

/// A station small enough to be rendered in a few milliseconds.
fn model() -> StationModel {
    let shape = StationShape { width_px: 320, height_px: 256, ..StationShape::default() };
    StationModel::seeded(11, &shape).unwrap()
}

fn station() -> TwinStation {
    TwinStation::new(model(), TwinOptions::default())
}

fn blank() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap()
}

fn software(camera: &mut TwinCamera, exposure_us: f64) {
    let wanted = CameraRequest {
        trigger: Some(Trigger::Software),
        exposure_us: Some(exposure_us),
        ..CameraRequest::default()
    };
    camera.configure(&wanted).unwrap();
    camera.start().unwrap();
}

fn grab(camera: &mut TwinCamera, image: &mut GreyImage) -> FrameInfo {
    camera.trigger().unwrap();
    camera.next_frame(image, PATIENCE).unwrap().unwrap()
}

#[test]
fn pictures_follow_the_stage_and_the_laser() {
    let station = station();
    let (mut camera, mut stage, mut laser) = station.devices();
    let control = station.control();
    software(&mut camera, LASER_EXPOSURE_US);
    let (mut image, mut other) = (blank(), blank());
    laser.switch_on(1.0, Duration::from_secs(1)).unwrap();
    grab(&mut camera, &mut image);
    stage.start_move(5.0, 1e9).unwrap();
    let arrived = Instant::now() + Duration::from_millis(5);
    while stage.poll().unwrap().moving {
        assert!(Instant::now() < arrived + PATIENCE);
    }
    assert_eq!(stage.poll().unwrap().position_mm, Some(5.0));
    assert_eq!(control.true_position_mm(), 5.0);
    laser.renew(Duration::from_secs(1)).unwrap();
    grab(&mut camera, &mut other);
    assert_ne!(image, other);
    laser.switch_off().unwrap();
    control.place_part(&SceneKind::Plate);
    camera.configure(&CameraRequest { exposure_us: Some(BOARD_EXPOSURE_US), ..CameraRequest::default() }).unwrap();
    grab(&mut camera, &mut image);
    assert!(image.at(160, 128) > 100.0, "{}", image.at(160, 128));
}
