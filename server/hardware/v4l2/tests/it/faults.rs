//! A lost camera: the time until it is reported, in calls instead of seconds. Unplugging while frames arrive is covered
//! by the contract suite.

use std::time::Duration;

use devices::{Camera, CameraError, CameraRequest, CameraSettings};
use v4l2::V4l2Camera;
use vision::{GreyImage, Pixels};

use crate::scripted::{Bench, EXPOSURE, EXPOSURE_AUTO, settings};

/// Duration of a call, and the number of calls within which a lost camera must be reported: two seconds
/// (`promises.md`).
const CALL: Duration = Duration::from_millis(50);
const REPORTED_WITHIN_CALLS: usize = 40;

fn blank() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap()
}

/// Calls until the camera is reported as gone; returns the number of calls, and the reason.
fn calls_until_gone(camera: &mut V4l2Camera) -> (usize, String) {
    for n_calls in 1..=REPORTED_WITHIN_CALLS {
        match camera.next_frame(&mut blank(), CALL) {
            Err(CameraError::Disconnected { reason }) => return (n_calls, reason),
            Err(other) => panic!("{other}"),
            Ok(_) => {}
        }
    }
    panic!("not reported within {REPORTED_WITHIN_CALLS} calls of {CALL:?}");
}

#[test]
fn an_unplugged_camera_is_reported_at_once_while_frames_arrive_and_soon_while_idle() {
    for is_streaming in [true, false] {
        let bench = Bench::default();
        let mut camera = bench.open(&settings()).unwrap();
        if is_streaming {
            camera.start().unwrap();
        }
        bench.unplug();
        let (n_calls, reason) = calls_until_gone(&mut camera);
        assert!(reason.contains("unplugged"), "{reason}");
        assert!(n_calls <= if is_streaming { 1 } else { 8 }, "after {n_calls} calls");
        assert!(camera.stop().is_ok(), "stop works in every state");
    }
}

#[test]
fn a_reconnected_camera_has_its_previous_settings() {
    let bench = Bench::default();
    let mut camera = bench.open(&settings()).unwrap();
    let wanted = CameraRequest { exposure_us: Some(700.0), frame_rate_hz: Some(15.0), ..CameraRequest::default() };
    let set: CameraSettings = camera.configure(&wanted).unwrap();
    bench.unplug();
    calls_until_gone(&mut camera);
    camera.reconnect().unwrap();
    assert!(
        matches!(camera.next_frame(&mut blank(), CALL), Err(CameraError::Disconnected { .. })),
        "it is not connected yet"
    );
    bench.replug();
    while camera.next_frame(&mut blank(), CALL).is_err() {}
    assert_eq!(camera.settings(), set);
    let value = |id: v4l2::device::ControlId| bench.camera().controls[&id.0].value;
    assert_eq!((value(EXPOSURE_AUTO), value(EXPOSURE)), (1, 7), "the camera itself is not set so");
}

#[test]
fn a_refused_setting_is_not_a_fault_but_a_missing_camera_is() {
    let bench = Bench::default();
    let mut camera = bench.open(&settings()).unwrap();
    let exposure = CameraRequest { exposure_us: Some(900.0), ..CameraRequest::default() };
    bench.camera().controls.get_mut(&EXPOSURE_AUTO.0).unwrap().value = 3;
    let refused = camera.configure(&exposure);
    assert!(matches!(refused, Err(CameraError::Unsupported { .. })), "{refused:?}");
    bench.unplug();
    let gone = camera.configure(&exposure);
    assert!(matches!(gone, Err(CameraError::Disconnected { .. })), "{gone:?}");
}
