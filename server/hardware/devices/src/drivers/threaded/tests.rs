//! A driver that hangs in any of its calls blocks no caller, is reported in time, and recovers. Not covered: vendor
//! libraries; and opening, which the station does on separate threads (its tests `mixed`).

use std::sync::atomic::{AtomicU64, Ordering};

use super::*;
use crate::contract::{self, CameraProfile};
use crate::{CALL_LIMIT, PixelFormat, Roi, Trigger, ValueRange};

/// Time between exposures of the test's camera.
const PERIOD: Duration = Duration::from_millis(10);

/// Time that the operating system may add to a call beside other tests.
const SLACK: Duration = Duration::from_millis(80);

/// The call that hangs next, and for how long.
#[derive(Default)]
struct Script {
    call: Mutex<&'static str>,
    hang_ms: AtomicU64,
}

impl Script {
    fn hang(&self, call: &'static str, time: Duration) {
        *self.call.lock() = call;
        self.hang_ms.store(time.as_millis() as u64, Ordering::SeqCst);
    }

    fn enter(&self, call: &str) {
        if *self.call.lock() == call {
            let hang_ms = self.hang_ms.swap(0, Ordering::SeqCst);
            assert!(hang_ms != u64::MAX, "an injected panic");
            std::thread::sleep(Duration::from_millis(hang_ms));
        }
    }
}

/// A camera that exposes every [`PERIOD`], keeps only the newest frame, and blocks according to its script.
struct Blocking {
    script: Arc<Script>,
    settings: CameraSettings,
    started: Option<Instant>,
    next_id: u64,
}

impl Camera for Blocking {
    fn identity(&self) -> DeviceIdentity {
        let text = String::new;
        DeviceIdentity { driver: "test", vendor: text(), model: text(), serial: text(), firmware: text() }
    }

    fn capabilities(&self) -> CameraCapabilities {
        CameraCapabilities {
            sensor_px: (4, 3),
            exposure_us: Some(ValueRange { min: 10.0, max: 1000.0 }),
            gain_db: None,
            frame_rate_hz: None,
            triggers: vec![Trigger::Free],
            pixel_formats: vec![PixelFormat::Mono8],
            roi: false,
        }
    }

    fn settings(&self) -> CameraSettings {
        self.settings
    }

    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        self.script.enter("configure");
        self.settings = self.capabilities().expected(&self.settings, wanted)?;
        Ok(self.settings)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        self.script.enter("start");
        if self.started.is_none() {
            (self.started, self.next_id) = (Some(Instant::now()), 0);
        }
        Ok(())
    }

    fn trigger(&mut self) -> Result<(), CameraError> {
        Err(CameraError::NotTriggerable { reason: "it runs freely" })
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        self.script.enter("next_frame");
        let deadline = Instant::now() + timeout;
        let Some(started) = self.started else {
            std::thread::sleep(timeout);
            return Ok(None);
        };
        let due = started + PERIOD * self.next_id as u32;
        if due > deadline {
            std::thread::sleep(timeout);
            return Ok(None);
        }
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let newest = (started.elapsed().as_nanos() / PERIOD.as_nanos()) as u64;
        image.eight_mut(4, 3).unwrap().fill(newest as u8);
        let info = FrameInfo {
            frame_id: newest,
            device_timestamp_ns: None,
            exposed_at: started + PERIOD * newest as u32,
            lost_before: newest - self.next_id,
            lost_incomplete: 0,
            exposure_us: self.settings.exposure_us,
            recorded_position_mm: None,
        };
        self.next_id = newest + 1;
        Ok(Some(info))
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.script.enter("stop");
        self.started = None;
        Ok(())
    }

    fn reconnect(&mut self) -> Result<(), CameraError> {
        self.stop()
    }
}

fn camera() -> (ThreadedCamera, Arc<Script>) {
    let script = Arc::new(Script::default());
    let settings = CameraSettings {
        exposure_us: 100.0,
        gain_db: 0.0,
        frame_rate_hz: 100.0,
        trigger: Trigger::Free,
        pixel_format: PixelFormat::Mono8,
        roi: Roi { left_px: 0, top_px: 0, width_px: 4, height_px: 3 },
    };
    let camera = Blocking { script: script.clone(), settings, started: None, next_id: 0 };
    (ThreadedCamera::over(camera), script)
}

/// Makes a call and checks its duration.
fn short<T>(limit: Duration, name: &str, call: impl FnOnce() -> T) -> T {
    let begun = Instant::now();
    let result = call();
    assert!(begun.elapsed() <= limit + SLACK, "`{name}` blocked its caller for {:?}", begun.elapsed());
    result
}

fn next(camera: &mut ThreadedCamera) -> Result<Option<FrameInfo>, CameraError> {
    let timeout = Duration::from_millis(5);
    short(timeout + CALL_LIMIT, "next_frame", || camera.next_frame(&mut no_image(), timeout))
}

/// Requests frames until `seen` returns true; returns the time taken.
fn request_until(
    camera: &mut ThreadedCamera,
    seen: impl Fn(&Result<Option<FrameInfo>, CameraError>) -> bool,
) -> Duration {
    let begun = Instant::now();
    while !seen(&next(camera)) {
        assert!(begun.elapsed() < Duration::from_secs(10), "never");
    }
    begun.elapsed()
}

fn is_gone<T>(outcome: &Result<T, CameraError>) -> bool {
    matches!(outcome, Err(CameraError::Disconnected { .. }))
}

#[test]
fn a_camera_behind_a_thread_passes_the_suite() {
    let profile = CameraProfile { frame_rate_hz: None, frame_limit: Duration::from_millis(100), cable: None };
    contract::camera(&mut || Box::new(camera().0), &profile);
}

#[test]
fn a_driver_that_hangs_in_any_call_blocks_no_caller_is_reported_in_time_and_recovers() {
    for call in ["configure", "start", "next_frame", "stop"] {
        println!("{call}");
        let (mut camera, script) = camera();
        camera.start().unwrap();
        request_until(&mut camera, |frame| matches!(frame, Ok(Some(_))));
        let hang = HANG_LIMIT + Duration::from_secs(1);
        if call == "start" {
            camera.stop().unwrap();
        }
        script.hang(call, hang);
        let hung_at = Instant::now();
        match call {
            "configure" => {
                let wanted = CameraRequest { exposure_us: Some(1e9), ..CameraRequest::default() };
                let expected = short(CALL_LIMIT, call, || camera.configure(&wanted)).unwrap();
                assert_eq!(expected.exposure_us, 1000.0, "not what its capabilities let expect");
            }
            "start" => short(CALL_LIMIT, call, || camera.start()).unwrap(),
            "stop" => short(CALL_LIMIT, call, || camera.stop()).unwrap(),
            _ => {}
        }
        request_until(&mut camera, is_gone);
        let named_after = hung_at.elapsed();
        assert!(
            named_after >= HANG_LIMIT && named_after < Duration::from_secs(2),
            "reported after {named_after:?}"
        );
        let why = next(&mut camera).unwrap_err().to_string();
        assert!(why.contains(call), "{why}");
        // While it hangs no call blocks.
        short(CALL_LIMIT, "stop", || camera.stop()).unwrap();
        assert!(is_gone(&short(CALL_LIMIT, "start", || camera.start())));
        assert!(is_gone(&short(CALL_LIMIT, "configure", || camera.configure(&CameraRequest::default()))));
        std::thread::sleep((hung_at + hang + PERIOD).saturating_duration_since(Instant::now()));
        assert!(is_gone(&next(&mut camera)), "it reconnected without a request");
        short(CALL_LIMIT, "reconnect", || camera.reconnect()).unwrap();
        let mut back = next(&mut camera);
        while is_gone(&back) && hung_at.elapsed() < hang * 3 {
            back = next(&mut camera);
        }
        assert!(matches!(back, Ok(None)), "after the reconnection: {back:?}");
        camera.start().unwrap();
        request_until(&mut camera, |frame| matches!(frame, Ok(Some(_))));
    }
}

#[test]
fn frames_lost_while_the_driver_blocked_are_counted_exactly() {
    let (mut camera, script) = camera();
    camera.start().unwrap();
    let (mut expected_id, mut lost) = (0, 0);
    for n in 0..10 {
        if n == 5 {
            script.hang("next_frame", PERIOD * 30);
        }
        let mut frame = None;
        while frame.is_none() {
            frame = next(&mut camera).unwrap();
        }
        let info = frame.unwrap();
        assert_eq!(info.frame_id, expected_id + info.lost_before);
        (expected_id, lost) = (info.frame_id + 1, lost + info.lost_before);
    }
    assert!(lost >= 29, "{lost} lost in a pause of thirty periods");
}

#[test]
fn dropping_a_hung_camera_returns_at_once() {
    let (mut camera, script) = camera();
    camera.start().unwrap();
    script.hang("next_frame", Duration::from_secs(2));
    next(&mut camera).unwrap();
    short(CALL_LIMIT, "drop", || drop(camera));
}

#[test]
fn a_driver_that_panics_is_reported_as_disconnected() {
    let (mut camera, script) = camera();
    script.hang("start", Duration::from_millis(u64::MAX));
    camera.start().ok();
    request_until(&mut camera, is_gone);
}
