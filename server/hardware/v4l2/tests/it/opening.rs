//! Settings and refusals when a camera is opened.

use devices::{Camera, CameraError, CameraRequest, Driver as _, OpenError, PixelFormat, ValueRange};
use v4l2::{V4l2Driver, V4l2Settings};

use crate::scripted::{AUTO_WHITE_BALANCE, Bench, EXPOSURE, EXPOSURE_AUTO, GAIN, settings};

fn value(bench: &Bench, id: v4l2::device::ControlId) -> i32 {
    bench.camera().controls[&id.0].value
}

fn refusal(bench: &Bench, settings: &V4l2Settings) -> OpenError {
    bench.open(settings).err().expect("it must be refused")
}

#[test]
fn automatic_functions_are_off_before_exposure_and_gain_are_set() {
    let bench = Bench::default();
    let mut camera = bench.open(&V4l2Settings { gain: 20, ..settings() }).unwrap();
    assert_eq!((value(&bench, EXPOSURE_AUTO), value(&bench, AUTO_WHITE_BALANCE), value(&bench, GAIN)), (1, 0, 20));
    let wanted = CameraRequest { exposure_us: Some(3349.0), ..CameraRequest::default() };
    assert_eq!(camera.configure(&wanted).unwrap().exposure_us, 3300.0, "in steps of 100 µs");
    assert_eq!(value(&bench, EXPOSURE), 33);
    assert_eq!(bench.camera().set, [EXPOSURE_AUTO, AUTO_WHITE_BALANCE, GAIN, EXPOSURE]);
}

#[test]
fn a_gain_outside_the_range_of_the_camera_is_clamped() {
    for (wanted, set) in [(0, 4), (1000, 255)] {
        let bench = Bench::default();
        bench.open(&V4l2Settings { gain: wanted, ..settings() }).unwrap();
        assert_eq!(value(&bench, GAIN), set);
    }
}

#[test]
fn a_camera_whose_automatic_functions_cannot_be_turned_off_is_refused() {
    for (control, name) in
        [(EXPOSURE_AUTO, "automatic exposure"), (AUTO_WHITE_BALANCE, "automatic white balance"), (GAIN, "gain")]
    {
        let bench = Bench::default();
        bench.camera().fixed.push(control);
        let refused = refusal(&bench, &settings());
        assert!(matches!(refused, OpenError::Settings { .. }), "{refused}");
        assert!(refused.to_string().contains(name), "{refused}");
    }
}

#[test]
fn automatic_functions_are_turned_off_again_when_acquisition_starts() {
    let bench = Bench::default();
    let mut camera = bench.open(&settings()).unwrap();
    bench.camera().controls.get_mut(&EXPOSURE_AUTO.0).unwrap().value = 3;
    camera.start().unwrap();
    assert_eq!(value(&bench, EXPOSURE_AUTO), 1);
    camera.stop().unwrap();
    {
        let mut scripted = bench.camera();
        scripted.controls.get_mut(&EXPOSURE_AUTO.0).unwrap().value = 3;
        scripted.fixed.push(EXPOSURE_AUTO);
    }
    match camera.start() {
        Err(CameraError::Unsupported { setting, .. }) => assert_eq!(setting, "automatic exposure"),
        other => panic!("frames of automatic exposure: {other:?}"),
    }
}

#[test]
fn capabilities_equal_the_lists_of_the_device() {
    let capabilities = Bench::default().open(&settings()).unwrap().capabilities();
    assert_eq!(capabilities.sensor_px, (64, 48));
    assert_eq!(capabilities.exposure_us, Some(ValueRange { min: 100.0, max: 500_000.0 }));
    assert_eq!(capabilities.frame_rate_hz, Some(ValueRange { min: 5.0, max: 200.0 }));
    assert_eq!(capabilities.pixel_formats, [PixelFormat::Mono8, PixelFormat::Mono16]);
    assert_eq!((capabilities.gain_db, capabilities.roi), (None, false));
}

#[test]
fn without_a_size_the_largest_image_is_used() {
    let whole = V4l2Settings { width_px: 0, height_px: 0, ..settings() };
    assert_eq!(Bench::default().open(&whole).unwrap().capabilities().sensor_px, (1280, 720));
}

#[test]
fn the_nearest_frame_rate_is_set_and_kept_over_a_change_of_format() {
    let bench = Bench::default();
    let mut camera = bench.open(&settings()).unwrap();
    let rate = |rate_hz| CameraRequest { frame_rate_hz: Some(rate_hz), ..CameraRequest::default() };
    assert_eq!(camera.configure(&rate(13.0)).unwrap().frame_rate_hz, 15.0);
    let sixteen_bit = CameraRequest { pixel_format: Some(PixelFormat::Mono16), ..CameraRequest::default() };
    assert_eq!(camera.configure(&sixteen_bit).unwrap().frame_rate_hz, 15.0);
}

#[test]
fn an_unsupported_image_size_is_refused_with_the_size_sent() {
    let refused = refusal(&Bench::default(), &V4l2Settings { width_px: 100, height_px: 100, ..settings() });
    assert!(
        refused.to_string().contains("sends YUYV with 640×480 pixels instead of YUYV with 100×100"),
        "{refused}"
    );
}

#[test]
fn an_absent_or_busy_camera_may_become_available() {
    let bench = Bench::default();
    bench.camera().is_busy = true;
    let busy = refusal(&bench, &settings());
    assert!(matches!(busy, OpenError::Absent { .. }) && busy.to_string().contains("in use by another"), "{busy}");
    bench.unplug();
    let absent = refusal(&bench, &settings());
    assert!(
        matches!(absent, OpenError::Absent { .. }) && absent.to_string().contains("was not found"),
        "{absent}"
    );
}

#[test]
#[cfg(feature = "kernel")]
fn a_missing_file_and_a_file_that_is_no_camera_are_distinguished() {
    let wanted = devices::DeviceSet { camera: true, ..devices::DeviceSet::default() };
    let open = |device: &str| {
        let settings = V4l2Settings { device: device.to_owned(), ..V4l2Settings::default() };
        V4l2Driver(settings).open(wanted).err().expect("there is no camera")
    };
    assert!(matches!(open("/dev/video-absent"), OpenError::Absent { .. }));
    let none = open("/dev/null");
    assert!(matches!(none, OpenError::Settings { .. }), "{none}");
    assert!(none.to_string().contains("/dev/null does not respond as a video device"), "{none}");
}

#[test]
fn a_driver_without_a_device_file_reports_the_missing_setting() {
    assert_eq!(V4l2Driver(V4l2Settings::default()).missing().unwrap().name, "device");
    assert_eq!(V4l2Driver(settings()).missing(), None);
}
