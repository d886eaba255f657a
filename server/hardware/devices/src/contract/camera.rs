//! The contract of a camera.

use std::time::{Duration, Instant};

use vision::{GreyImage, Pixels};

use super::Cable;
use super::calls::{SCHEDULING_SLACK, short, wait_for, within};
use super::stopwatch::Stopwatch;
use crate::{Camera, CameraError, CameraRequest, FrameInfo, PixelFormat, Roi, Trigger};

/// Properties of a camera for the suite.
pub struct CameraProfile {
    /// Frame rate for the free-running rules, Hz; `None` keeps the camera's own.
    pub frame_rate_hz: Option<f64>,
    /// Longest wait for a frame, exposure and computation included.
    pub frame_limit: Duration,
    /// Its cable, if the test can unplug it.
    pub cable: Option<Cable>,
}

/// The loss of a camera is detected within this time (`promises.md`: camera faults).
const GONE_LIMIT: Duration = Duration::from_secs(2);

/// Longest reconnection after the cable is plugged in again.
const RECONNECT_LIMIT: Duration = Duration::from_secs(5);

/// Frames examined by the rules on order and memory.
const N_FRAMES: usize = 8;

type Open<'a> = &'a mut dyn FnMut() -> Box<dyn Camera>;

/// Runs every rule of a camera, each on a newly opened device.
pub fn camera(open: Open, profile: &CameraProfile) {
    settings_are_those_accepted(open());
    numbers_are_clamped_to_their_range(open());
    unsupported_settings_are_refused_by_name(open());
    invalid_numbers_are_refused(open());
    no_frame_arrives_without_acquisition(open());
    frames_come_in_order(open(), profile);
    frames_have_the_accepted_size_and_format(open(), profile);
    a_second_start_has_no_effect(open(), profile);
    a_new_start_counts_from_zero(open(), profile);
    the_given_buffer_is_reused(open(), profile);
    waiting_for_a_frame_ends_in_time(open(), profile);
    stop_works_in_every_state(open(), profile);
    one_software_trigger_is_one_frame(open(), profile);
    software_triggers_need_their_mode(open());
    a_region_of_interest_is_read(open(), profile);
    reconnecting_a_working_camera_stops_it(open(), profile);
    camera_faults(open, profile);
}

/// Runs the rules about an unplugged cable, if the profile has one.
pub fn camera_faults(open: Open, profile: &CameraProfile) {
    if let Some(cable) = &profile.cable {
        an_unplugged_camera_reports_the_loss_until_it_is_reconnected(open(), profile, cable);
    }
}

fn settings_are_those_accepted(mut camera: Box<dyn Camera>) {
    let before = short("settings", || camera.settings());
    let unchanged =
        short("configure", || camera.configure(&CameraRequest::default())).expect("nothing was requested");
    assert_eq!(unchanged, before, "an empty request changed settings");
    if let Some(range) = camera.capabilities().exposure_us {
        let wanted_us = 0.5 * (range.min + range.max);
        let accepted = camera
            .configure(&CameraRequest { exposure_us: Some(wanted_us), ..Default::default() })
            .expect("in range");
        assert_eq!(camera.settings(), accepted, "`settings` differs from what `configure` returned");
        assert!(
            accepted.exposure_us >= range.min && accepted.exposure_us <= range.max,
            "accepted {} µs, outside its own range",
            accepted.exposure_us
        );
    }
}

fn numbers_are_clamped_to_their_range(mut camera: Box<dyn Camera>) {
    let capabilities = camera.capabilities();
    if let Some(range) = capabilities.exposure_us {
        let accepted =
            set(&mut *camera, CameraRequest { exposure_us: Some(range.max * 10.0), ..Default::default() });
        assert_eq!(accepted.exposure_us, range.max, "an exposure beyond the range was not moved to its end");
        let accepted = set(&mut *camera, CameraRequest { exposure_us: Some(0.0), ..Default::default() });
        assert_eq!(accepted.exposure_us, range.min, "an exposure below the range was not moved to its start");
    }
    if let Some(range) = capabilities.gain_db {
        let accepted = set(&mut *camera, CameraRequest { gain_db: Some(range.max + 100.0), ..Default::default() });
        assert_eq!(accepted.gain_db, range.max, "a gain beyond the range was not moved to its end");
    }
    if let Some(range) = capabilities.frame_rate_hz {
        let accepted = set(&mut *camera, CameraRequest { frame_rate_hz: Some(1e9), ..Default::default() });
        assert!(
            accepted.frame_rate_hz <= range.max,
            "a frame rate of {} Hz, beyond its own range, was accepted",
            accepted.frame_rate_hz
        );
    }
}

fn unsupported_settings_are_refused_by_name(mut camera: Box<dyn Camera>) {
    let capabilities = camera.capabilities();
    let mut impossible = Vec::new();
    if capabilities.exposure_us.is_none() {
        impossible.push(CameraRequest { exposure_us: Some(100.0), ..Default::default() });
    }
    if capabilities.gain_db.is_none() {
        impossible.push(CameraRequest { gain_db: Some(1.0), ..Default::default() });
    }
    if capabilities.frame_rate_hz.is_none() {
        impossible.push(CameraRequest { frame_rate_hz: Some(10.0), ..Default::default() });
    }
    for trigger in [Trigger::Free, Trigger::Software, Trigger::Hardware] {
        if !capabilities.triggers.contains(&trigger) {
            impossible.push(CameraRequest { trigger: Some(trigger), ..Default::default() });
        }
    }
    for format in [PixelFormat::Mono8, PixelFormat::Mono16] {
        if !capabilities.pixel_formats.contains(&format) {
            impossible.push(CameraRequest { pixel_format: Some(format), ..Default::default() });
        }
    }
    if !capabilities.roi {
        let roi = Roi { left_px: 1, top_px: 1, width_px: 2, height_px: 2 };
        impossible.push(CameraRequest { roi: Some(roi), ..Default::default() });
    }
    for request in impossible {
        refuses(&mut *camera, request);
    }
}

fn invalid_numbers_are_refused(mut camera: Box<dyn Camera>) {
    for nonsense in [f64::NAN, f64::INFINITY] {
        refuses(&mut *camera, CameraRequest { exposure_us: Some(nonsense), ..Default::default() });
        refuses(&mut *camera, CameraRequest { gain_db: Some(nonsense), ..Default::default() });
        refuses(&mut *camera, CameraRequest { frame_rate_hz: Some(nonsense), ..Default::default() });
    }
}

fn refuses(camera: &mut dyn Camera, request: CameraRequest) {
    let before = camera.settings();
    let refusal = camera.configure(&request);
    assert!(matches!(refusal, Err(CameraError::Unsupported { .. })), "{request:?} gave {refusal:?}, no refusal");
    assert_eq!(camera.settings(), before, "the refused {request:?} changed settings");
}

fn no_frame_arrives_without_acquisition(mut camera: Box<dyn Camera>) {
    let got =
        poll_frame(&mut *camera, &mut blank(), Duration::from_millis(20)).expect("not started is not a fault");
    assert_eq!(got, None, "a frame came before `start`");
}

fn frames_come_in_order(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    run_free(&mut *camera, profile);
    let mut image = blank();
    let mut expected_id = 0;
    let mut last_exposed_at: Option<Instant> = None;
    for _ in 0..N_FRAMES {
        let info = frame(&mut *camera, &mut image, profile);
        assert_eq!(
            info.frame_id,
            expected_id + info.lost_before,
            "frame {} came with {} lost where {expected_id} was next",
            info.frame_id,
            info.lost_before
        );
        expected_id = info.frame_id + 1;
        assert!(info.exposed_at <= crate::time::now(), "frame {} was exposed in the future", info.frame_id);
        if let Some(last) = last_exposed_at {
            assert!(info.exposed_at >= last, "frame {} was exposed before the one before it", info.frame_id);
        }
        last_exposed_at = Some(info.exposed_at);
    }
}

fn frames_have_the_accepted_size_and_format(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    let formats = camera.capabilities().pixel_formats;
    for format in formats {
        let set = set(&mut *camera, CameraRequest { pixel_format: Some(format), ..Default::default() });
        assert_eq!(set.pixel_format, format, "a pixel format it can do was not taken");
        run_free(&mut *camera, profile);
        let mut image = blank();
        frame(&mut *camera, &mut image, profile);
        let accepted_format =
            (set.roi.width_px, set.roi.height_px, if format == PixelFormat::Mono8 { 8 } else { 16 });
        let got = (image.width(), image.height(), image.bit_depth());
        assert_eq!(got, accepted_format, "columns, rows and bits of a frame are not those accepted_format");
        camera.stop().expect("stop");
    }
}

fn a_second_start_has_no_effect(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    run_free(&mut *camera, profile);
    let mut image = blank();
    let first = frame(&mut *camera, &mut image, profile);
    short("start", || camera.start()).expect("a second start is none");
    let second = frame(&mut *camera, &mut image, profile);
    assert!(second.frame_id > first.frame_id, "a second `start` began the count of frames again");
}

fn a_new_start_counts_from_zero(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    run_free(&mut *camera, profile);
    let mut image = blank();
    for _ in 0..3 {
        frame(&mut *camera, &mut image, profile);
    }
    camera.stop().expect("stop");
    camera.start().expect("start after stop");
    let first = frame(&mut *camera, &mut image, profile);
    assert_eq!(first.frame_id, first.lost_before, "frames of the acquisition before came after a new start");
}

fn the_given_buffer_is_reused(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    run_free(&mut *camera, profile);
    let mut image = blank();
    frame(&mut *camera, &mut image, profile);
    let buffer = address(&image);
    for _ in 0..N_FRAMES {
        frame(&mut *camera, &mut image, profile);
        assert_eq!(address(&image), buffer, "a frame was put into new memory instead of the given buffer");
    }
}

fn waiting_for_a_frame_ends_in_time(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    run_free(&mut *camera, profile);
    let mut image = blank();
    for timeout in [Duration::ZERO, Duration::from_millis(1), profile.frame_limit] {
        poll_frame(&mut *camera, &mut image, timeout).expect("running");
    }
}

fn stop_works_in_every_state(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    short("stop", || camera.stop()).expect("stop before start");
    run_free(&mut *camera, profile);
    let mut image = blank();
    frame(&mut *camera, &mut image, profile);
    short("stop", || camera.stop()).expect("stop while running");
    short("stop", || camera.stop()).expect("stop twice");
    let got = poll_frame(&mut *camera, &mut image, Duration::from_millis(20)).expect("stopped is not a fault");
    assert_eq!(got, None, "a frame came after `stop`");
}

fn one_software_trigger_is_one_frame(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    if !camera.capabilities().triggers.contains(&Trigger::Software) {
        return;
    }
    set(&mut *camera, CameraRequest { trigger: Some(Trigger::Software), ..Default::default() });
    camera.start().expect("start");
    let mut image = blank();
    for expected_id in 0..2 {
        short("trigger", || camera.trigger()).expect("started, and in its mode");
        let info = frame(&mut *camera, &mut image, profile);
        assert_eq!(info.frame_id, expected_id, "a trigger gave another frame than its own");
    }
    let more = poll_frame(&mut *camera, &mut image, Duration::from_millis(50)).expect("running");
    assert_eq!(more, None, "a frame came without a trigger");
}

fn software_triggers_need_their_mode(mut camera: Box<dyn Camera>) {
    let capabilities = camera.capabilities();
    if capabilities.triggers.contains(&Trigger::Software) {
        set(&mut *camera, CameraRequest { trigger: Some(Trigger::Software), ..Default::default() });
        let early = camera.trigger();
        assert!(matches!(early, Err(CameraError::NotTriggerable { .. })), "triggered before start: {early:?}");
    }
    if capabilities.triggers.contains(&Trigger::Free) {
        set(&mut *camera, CameraRequest { trigger: Some(Trigger::Free), ..Default::default() });
        camera.start().expect("start");
        let free = camera.trigger();
        assert!(matches!(free, Err(CameraError::NotTriggerable { .. })), "triggered while running free: {free:?}");
    }
}

fn a_region_of_interest_is_read(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    let capabilities = camera.capabilities();
    if !capabilities.roi {
        return;
    }
    let (columns, rows) = capabilities.sensor_px;
    let wanted = Roi { left_px: columns / 4, top_px: rows / 4, width_px: columns / 2, height_px: rows / 2 };
    let roi = set(&mut *camera, CameraRequest { roi: Some(wanted), ..Default::default() }).roi;
    assert!(
        roi.left_px + roi.width_px <= columns && roi.top_px + roi.height_px <= rows,
        "accepted {roi:?}, which leaves the sensor of {columns}×{rows}"
    );
    run_free(&mut *camera, profile);
    let mut image = blank();
    frame(&mut *camera, &mut image, profile);
    assert_eq!(
        (image.width(), image.height()),
        (roi.width_px, roi.height_px),
        "a frame is not of the region's size"
    );
}

fn reconnecting_a_working_camera_stops_it(mut camera: Box<dyn Camera>, profile: &CameraProfile) {
    run_free(&mut *camera, profile);
    let set = camera.settings();
    let mut image = blank();
    frame(&mut *camera, &mut image, profile);
    camera.reconnect().expect("nothing prevents it");
    let got = back(&mut *camera, &mut image);
    assert_eq!(got, None, "the camera is active after the reconnection");
    assert_eq!(camera.settings(), set, "the settings differ after the reconnection");
}

fn an_unplugged_camera_reports_the_loss_until_it_is_reconnected(
    mut camera: Box<dyn Camera>,
    profile: &CameraProfile,
    cable: &Cable,
) {
    run_free(&mut *camera, profile);
    let set = camera.settings();
    let mut image = blank();
    frame(&mut *camera, &mut image, profile);
    (cable.unplug)();
    wait_for(GONE_LIMIT, "the unplugged cable is detected", || {
        matches!(
            poll_frame(&mut *camera, &mut image, Duration::from_millis(20)),
            Err(CameraError::Disconnected { .. })
        )
        .then_some(())
    });
    let again = poll_frame(&mut *camera, &mut image, Duration::from_millis(20));
    assert!(matches!(again, Err(CameraError::Disconnected { .. })), "the loss is reported once, then {again:?}");
    short("stop", || camera.stop()).ok();
    (cable.replug)();
    short("reconnect", || camera.reconnect()).ok();
    assert_eq!(back(&mut *camera, &mut image), None, "the camera is active after the reconnection");
    assert_eq!(camera.settings(), set, "the settings differ after the reconnection");
    camera.start().expect("start after a reconnection");
    frame(&mut *camera, &mut image, profile);
}

/// Waits until a reconnected camera reports no fault; returns the frame it delivers then, if any.
fn back(camera: &mut dyn Camera, image: &mut GreyImage) -> Option<FrameInfo> {
    wait_for(RECONNECT_LIMIT, "the camera is reconnected", || {
        poll_frame(camera, image, Duration::from_millis(20)).ok()
    })
}

fn set(camera: &mut dyn Camera, request: CameraRequest) -> crate::CameraSettings {
    let accepted =
        short("configure", || camera.configure(&request)).unwrap_or_else(|e| panic!("{request:?} refused: {e}"));
    assert_eq!(camera.settings(), accepted, "`settings` differs from what `configure` returned");
    accepted
}

/// Starts free-running acquisition at the profile's rate.
fn run_free(camera: &mut dyn Camera, profile: &CameraProfile) {
    if camera.capabilities().triggers.contains(&Trigger::Free) {
        set(camera, CameraRequest { trigger: Some(Trigger::Free), ..Default::default() });
    }
    if camera.capabilities().frame_rate_hz.is_some() && profile.frame_rate_hz.is_some() {
        set(camera, CameraRequest { frame_rate_hz: profile.frame_rate_hz, ..Default::default() });
    }
    short("start", || camera.start()).expect("start");
}

/// The next frame; panics if there is none.
fn frame(camera: &mut dyn Camera, image: &mut GreyImage, profile: &CameraProfile) -> FrameInfo {
    let watch = Stopwatch::start();
    while watch.own_time() <= profile.frame_limit + SCHEDULING_SLACK {
        if let Some(info) = poll_frame(camera, image, profile.frame_limit).expect("running") {
            return info;
        }
    }
    panic!("no frame within {:?}", profile.frame_limit);
}

/// One call of `next_frame`, which must not exceed its timeout by more than [`crate::CALL_LIMIT`].
fn poll_frame(
    camera: &mut dyn Camera,
    image: &mut GreyImage,
    timeout: Duration,
) -> Result<Option<FrameInfo>, CameraError> {
    within(timeout + crate::CALL_LIMIT, "next_frame", || camera.next_frame(image, timeout))
}

fn blank() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel for one pixel")
}

/// Address of an image's pixels.
fn address(image: &GreyImage) -> usize {
    match image.pixels() {
        Pixels::Eight(pixels) => pixels.as_ptr().addr(),
        Pixels::Sixteen(pixels) => pixels.as_ptr().addr(),
    }
}
