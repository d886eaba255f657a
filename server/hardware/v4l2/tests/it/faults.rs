//! A lost camera: the time until it is reported, in calls instead of seconds. Unplugging while frames arrive is covered
//! by the contract suite.

use std::time::Duration;

use devices::{Camera, CameraError, CameraRequest, CameraSettings};
use v4l2::V4l2Camera;
use vision::{GreyImage, Pixels};

use crate::scripted::{Bench, EXPOSURE, EXPOSURE_AUTO, settings};

/// Duration of a call, and the number of calls within which a lost camera must be reported: two seconds
/// (`promises.md`).
const LOOK: Duration = Duration::from_millis(50);
const NAMED_WITHIN_LOOKS: usize = 40;

fn blank() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap()
}

/// Calls until the camera is reported as gone; returns the number of calls, and the reason.
fn looks_until_gone(camera: &mut V4l2Camera) -> (usize, String) {
    for n_looks in 1..=NAMED_WITHIN_LOOKS {
        match camera.next_frame(&mut blank(), LOOK) {
            Err(CameraError::Gone { reason }) => return (n_looks, reason),
            Err(other) => panic!("{other}"),
            Ok(_) => {}
        }
    }
    panic!("not named within {NAMED_WITHIN_LOOKS} looks of {LOOK:?}");
}

#[test]
fn a_camera_that_is_unplugged_is_named_at_once_while_frames_come_and_soon_while_idle() {
    for is_streaming in [true, false] {
        let bench = Bench::default();
        let mut camera = bench.open(&settings()).unwrap();
        if is_streaming {
            camera.start().unwrap();
        }
        bench.unplug();
        let (n_looks, reason) = looks_until_gone(&mut camera);
        assert!(reason.contains("unplugged"), "{reason}");
        assert!(n_looks <= if is_streaming { 1 } else { 8 }, "after {n_looks} looks");
        assert!(camera.stop().is_ok(), "stop works in every state");
    }
}

#[test]
fn a_camera_that_comes_back_is_set_by_hand_as_it_was() {
    let bench = Bench::default();
    let mut camera = bench.open(&settings()).unwrap();
    let wanted = CameraRequest { exposure_us: Some(700.0), frame_rate_hz: Some(15.0), ..CameraRequest::default() };
    let set: CameraSettings = camera.configure(&wanted).unwrap();
    bench.unplug();
    looks_until_gone(&mut camera);
    camera.reconnect().unwrap();
    assert!(matches!(camera.next_frame(&mut blank(), LOOK), Err(CameraError::Gone { .. })), "it is not there yet");
    bench.replug();
    while camera.next_frame(&mut blank(), LOOK).is_err() {}
    assert_eq!(camera.settings(), set);
    let value = |id: v4l2::device::ControlId| bench.camera().controls[&id.0].value;
    assert_eq!((value(EXPOSURE_AUTO), value(EXPOSURE)), (1, 7), "the camera itself is not set so");
}

#[test]
fn a_setting_that_the_camera_refuses_is_no_fault_and_one_without_camera_is() {
    let bench = Bench::default();
    let mut camera = bench.open(&settings()).unwrap();
    let exposure = CameraRequest { exposure_us: Some(900.0), ..CameraRequest::default() };
    bench.camera().controls.get_mut(&EXPOSURE_AUTO.0).unwrap().value = 3;
    let refused = camera.configure(&exposure);
    assert!(matches!(refused, Err(CameraError::Unsupported { .. })), "{refused:?}");
    bench.unplug();
    let gone = camera.configure(&exposure);
    assert!(matches!(gone, Err(CameraError::Gone { .. })), "{gone:?}");
}
