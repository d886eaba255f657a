//! A station with the simulated GigE Vision camera of aravis and a simulated stage and laser: discovery, live view, scan,
//! disconnection.
//!
//! Not shown here: a scan with lines, since that camera renders a ramp.

#[cfg(not(feature = "genicam"))]
#[test]
fn a_station_with_a_gige_camera() {
    reference::without_feature("genicam", "the Debian packages libaravis-dev and libusb-1.0-0-dev");
}

#[cfg(feature = "genicam")]
mod stations {
    use std::time::{Duration, Instant};

    use genicam::fake_camera::{FakeCamera, FakeOptions, PROGRAM};
    use serde_json::{Value, json};
    use tempfile::TempDir;

    use crate::common::server::Server;
    use crate::common::{out, sheaf_ok, small_capture};

    const SERIAL: &str = "SHEAF02";
    const SETTINGS: &str = "/api/v1/devices/camera/settings";
    const FEATURES: &str = "/api/v1/devices/camera/features";

    /// Longest wait for an expected state.
    const PATIENCE: Duration = Duration::from_secs(60);

    /// A station with a camera that loses `lost_per_thousand` of its packets, with a client in control.
    struct Rig {
        camera: FakeCamera,
        server: Server,
        control: String,
        _folder: TempDir,
    }

    impl Rig {
        fn start(lost_per_thousand: u32) -> Option<Self> {
            if !reference::has_program(PROGRAM, "aravis-tools") {
                return None;
            }
            let options = FakeOptions { serial: SERIAL.to_owned(), lost_per_thousand, ..FakeOptions::default() };
            let camera = FakeCamera::start(options).unwrap();
            let folder = TempDir::new().unwrap();
            let serial = format!("station.genicam.serial={SERIAL}");
            let settings = ["--set", "station.camera.kind=genicam", "--set", &serial];
            let server = Server::start(&folder.path().join("data"), &settings);
            let lease = server.post("/api/v1/station/control", &json!({ "holder": "Anna" })).expect(201);
            let control = lease["id"].as_str().unwrap().to_owned();
            let rig = Self { camera, server, control, _folder: folder };
            rig.wait_for("the camera", |station| station["camera"]["connected"] == true);
            Some(rig)
        }

        fn station(&self) -> Value {
            self.server.get("/api/v1/station").expect(200)
        }

        #[track_caller]
        fn wait_for(&self, what: &str, seen: impl Fn(&Value) -> bool) -> Value {
            let began = Instant::now();
            loop {
                let station = self.station();
                if seen(&station) {
                    return station;
                }
                assert!(began.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}: {station:#}");
                std::thread::sleep(Duration::from_millis(20));
            }
        }

        #[track_caller]
        fn send(&self, method: &str, path: &str, more: &[(&str, &str)], body: &Value) -> Value {
            let answer = self.try_send(method, path, more, body);
            assert!(answer.0 < 300, "{method} {path}: {answer:?}");
            answer.1
        }

        fn try_send(&self, method: &str, path: &str, more: &[(&str, &str)], body: &Value) -> (u16, Value) {
            // Work that takes longer than a lease takes control again.
            let renewed =
                self.server.post("/api/v1/station/control", &json!({ "holder": "Anna", "take_over": true }));
            let control = match renewed.status {
                201 => renewed.json()["id"].as_str().unwrap().to_owned(),
                _ => self.control.clone(),
            };
            let mut headers = vec![("content-type", "application/json"), ("sheaf-control", control.as_str())];
            headers.extend(more);
            let answer = self.server.send(method, path, &headers, body.to_string().as_bytes());
            (answer.status, answer.json())
        }

        fn set_camera(&self, wanted: &Value) -> Value {
            let version = self.server.get(SETTINGS).header("etag").unwrap().to_owned();
            self.send("PATCH", SETTINGS, &[("if-match", &version)], wanted)
        }

        fn live(&self, running: bool) {
            let laser_power = if running { 0.5 } else { 0.0 };
            let body = json!({ "running": running, "laser_power": laser_power });
            self.send("PUT", "/api/v1/station/live", &[], &body);
        }

        fn link(&self) -> Value {
            self.server.get(FEATURES).expect(200)["link"].clone()
        }
    }

    fn arrived(station: &Value) -> u64 {
        station["frames"]["arrived"].as_u64().unwrap()
    }

    fn dropped(station: &Value) -> u64 {
        let by_reason = station["frames"]["dropped"].as_object().unwrap();
        let of_exposures = by_reason.iter().filter(|(reason, _)| *reason != "recorder");
        of_exposures.map(|(_, count)| count.as_u64().unwrap()).sum()
    }

    #[test]
    fn a_live_view_and_a_scan_account_for_every_frame() {
        let Some(rig) = Rig::start(0) else { return };
        let listed: Value = serde_json::from_str(&out(&sheaf_ok(&["devices", "--json"]))).unwrap();
        let ours = listed["devices"].as_array().unwrap().iter().find(|device| device["value"] == SERIAL).unwrap();
        assert_eq!((&ours["setting"], &ours["model"]), (&json!("station.genicam.serial"), &json!("Fake")));
        assert!(ours["in_use_by"].is_string(), "{ours:#}");
        let station = rig.station();
        assert_eq!((&station["simulated"], &station["faults"]), (&Value::Null, &json!([])), "{station:#}");

        let capture = small_capture();
        let source = json!({ "kind": "capture", "capture_id": rig.server.upload(&capture) });
        let calibration_id = rig.server.result_of("/api/v1/calibrations", &json!({ "source": source }));
        rig.server.put("/api/v1/calibrations/active", &json!({ "calibration_id": calibration_id })).expect(200);
        rig.send("POST", "/api/v1/devices/stage/home", &[], &json!({}));
        rig.wait_for("homing", |station| station["stage"]["homed"] == true && station["stage"]["moving"] == false);
        let roi = json!({ "left_px": 0, "top_px": 0, "width_px": 640, "height_px": 512 });
        let set = rig.set_camera(&json!({ "roi": roi, "frame_rate_hz": 20.0, "exposure_us": 2000.0 }));
        assert_eq!((&set["roi"], &set["exposure_us"]), (&roi, &json!(2000.0)));

        rig.live(true);
        rig.wait_for("a live view", |station| arrived(station) >= 10);
        let snapshot = rig.server.get("/api/v1/devices/camera/snapshot.jpg");
        assert_eq!((snapshot.status, &snapshot.body[..2]), (200, &[0xff, 0xd8][..]));
        rig.live(false);

        let (link_before, before) = (rig.link(), rig.station());
        let wish = json!({
            "source": { "kind": "station" }, "name": "ramp", "mode": "stop_and_go",
            "from_mm": -2.0, "to_mm": 2.0, "step_mm": 0.5,
        });
        let job = rig.send("POST", "/api/v1/scans", &[], &wish);
        let made = rig.server.wait_for_job(&format!("/api/v1/jobs/{}", job["id"].as_str().unwrap()));
        // A ramp has no lines: all images are captured, but there is no cloud.
        assert_ne!(made["problem"]["kind"], "device_fault", "{made:#}");
        let (link_after, after) = (rig.link(), rig.station());
        let taken = arrived(&after) - arrived(&before);
        let lost = dropped(&after) - dropped(&before);
        let more = |name: &str| link_after[name].as_u64().unwrap() - link_before[name].as_u64().unwrap();
        assert_eq!(taken, 9, "every row has its frame: {made:#}");
        assert_eq!(taken, more("frames_complete"), "{link_after:#}");
        // A busy machine may lose packets; the row is then exposed again.
        assert_eq!(lost, more("frames_incomplete") + more("frames_missing"), "{link_after:#}");
    }

    /// Number of frames recorded at the full rate of the camera.
    const RECORDED: u64 = 2000;

    /// Records a live view at the maximum rate of the camera and compares all counts with each other.
    fn record_at_full_rate(lost_per_thousand: u32) {
        let Some(rig) = Rig::start(lost_per_thousand) else { return };
        let roi = json!({ "left_px": 0, "top_px": 0, "width_px": 128, "height_px": 96 });
        let camera = rig.server.get("/api/v1/devices/camera").expect(200);
        let fastest_hz = camera["capabilities"]["frame_rate_hz"]["max"].as_f64().unwrap();
        // Slow enough that the recording begins before the first frame.
        rig.set_camera(&json!({ "roi": roi, "frame_rate_hz": 1.0 }));
        let (link_before, before, href) = loop {
            rig.set_camera(&json!({ "exposure_us": 500.0 }));
            let (link, station) = (rig.link(), rig.station());
            rig.live(true);
            let begun = rig.send("POST", "/api/v1/recordings", &[], &json!({ "name": "full rate" }));
            let href = format!("/api/v1/recordings/{}", begun["id"].as_str().unwrap());
            // Counts are published every 100 ms; with changed settings at once, so also those of before the recording.
            rig.set_camera(&json!({ "exposure_us": 400.0 }));
            rig.wait_for("the new settings", |_| rig.server.get(SETTINGS).expect(200)["exposure_us"] == 400.0);
            if arrived(&rig.station()) == arrived(&station) {
                break (link, station, href);
            }
            // A frame may have arrived before it: once more.
            rig.live(false);
            rig.wait_for("the end", |_| rig.server.get(&href).expect(200)["state"] == "complete");
        };
        rig.set_camera(&json!({ "frame_rate_hz": fastest_hz }));
        let recording = || rig.server.get(&href).expect(200);
        rig.wait_for("frames", |_| recording()["n_frames"].as_u64().unwrap() >= RECORDED);
        // Slow again, so that no frame is in transit when the view ends.
        rig.set_camera(&json!({ "frame_rate_hz": 1.0 }));
        std::thread::sleep(Duration::from_secs(2));
        let n_arrived = arrived(&rig.station());
        rig.wait_for("the last frame", |station| arrived(station) > n_arrived);
        rig.live(false);
        rig.wait_for("the end", |_| recording()["state"] == "complete");
        let (ended, link_after, after) = (recording(), rig.link(), rig.station());
        assert_eq!(ended["ended"], "live_ended", "{ended:#}");
        let count = |value: &Value| value.as_u64().unwrap();
        let more = |name: &str| count(&link_after[name]) - count(&link_before[name]);
        let lost = |reason: &str| count(&ended["lost"][reason]);
        let dropped_more = |reason: &str| {
            count(&after["frames"]["dropped"][reason]) - count(&before["frames"]["dropped"][reason])
        };
        let triggered = more("frames_complete") + more("frames_incomplete") + more("frames_missing");
        let processed = arrived(&after) - arrived(&before);
        println!(
            "{fastest_hz} Hz asked, {} recorded in {} s, lost {}; the camera's link: {link_after}",
            ended["n_frames"], ended["duration_s"], ended["lost"]
        );
        assert_eq!(
            triggered,
            processed + dropped(&after) - dropped(&before),
            "triggered is processed and dropped"
        );
        assert_eq!(processed, count(&ended["n_frames"]) + lost("recorder"), "processed is recorded and dropped");
        for reason in ["camera", "incomplete", "no_buffer", "malformed", "recorder"] {
            assert_eq!(lost(reason), dropped_more(reason), "{reason}: {ended:#}");
        }
        let file = rig.server.get(ended["file"].as_str().unwrap()).body;
        let path = rig._folder.path().join("full.mcap");
        std::fs::write(&path, file).unwrap();
        let file = recording::RecordingFile::open(&path).unwrap();
        let sequences: Vec<u64> = file.frames.iter().map(|frame| frame.note.sequence).collect();
        assert_eq!(sequences[0], arrived(&before) + 1, "the first frame is in the file");
        assert_eq!(sequences.last(), Some(&arrived(&after)), "and the last");
        let kept = file.summary().lost;
        assert_eq!((kept.total(), kept.recorder), (triggered - count(&ended["n_frames"]), lost("recorder")));
    }

    #[test]
    fn a_recording_at_the_cameras_full_rate_accounts_for_every_frame() {
        record_at_full_rate(0);
    }

    #[test]
    fn a_recording_with_lost_packets_accounts_for_every_frame() {
        record_at_full_rate(10);
    }

    #[test]
    fn lost_packets_and_a_disconnected_camera_are_counted_reported_and_recovered() {
        let Some(mut rig) = Rig::start(10) else { return };
        let roi = json!({ "left_px": 0, "top_px": 0, "width_px": 256, "height_px": 128 });
        rig.set_camera(&json!({ "roi": roi, "frame_rate_hz": 50.0, "exposure_us": 1000.0 }));
        rig.live(true);
        let seen = rig.wait_for("lost packets", |station| {
            station["frames"]["dropped"]["incomplete"].as_u64().unwrap() >= 5 && arrived(station) >= 50
        });
        let link = rig.link();
        let count = |name: &str| link[name].as_u64().unwrap();
        assert!(count("frames_complete") >= arrived(&seen), "{link:#}");
        assert!(count("packets_missing") > 0 && count("resend_requests") > 0, "{link:#}");

        rig.camera.kill();
        let killed_at = Instant::now();
        let station = rig.wait_for("the fault", |station| !station["faults"].as_array().unwrap().is_empty());
        println!("named after {:?}", killed_at.elapsed());
        let fault = &station["faults"][0];
        assert_eq!((&fault["device"], &fault["kind"]), (&json!("camera"), &json!("disconnected")), "{station:#}");
        rig.camera.restart().unwrap();
        rig.send("POST", "/api/v1/station/reset", &[], &json!({}));
        let station = rig.wait_for("the way back", |station| station["faults"] == json!([]));
        let settings = rig.server.get(SETTINGS).expect(200);
        assert_eq!((&settings["roi"], &settings["exposure_us"]), (&roi, &json!(1000.0)), "it forgot its settings");
        rig.live(true);
        let before = arrived(&station);
        rig.wait_for("frames again", |station| arrived(station) >= before + 10);
        rig.live(false);
    }

    #[test]
    fn features_are_read_and_set_by_name() {
        let Some(rig) = Rig::start(0) else { return };
        let all = rig.server.get(FEATURES).expect(200);
        let exposure = |all: &Value| {
            let features = all["features"].as_array().unwrap();
            features.iter().find(|feature| feature["name"] == "ExposureTimeAbs").unwrap().clone()
        };
        assert_eq!((&exposure(&all)["kind"], &exposure(&all)["min"]), (&json!("float"), &json!(10.0)));
        assert_eq!(all["link"]["address"], "127.0.0.1");
        let wish = json!({ "features": [{ "name": "ExposureTimeAbs", "value": "2500" }] });
        let set = rig.send("PATCH", FEATURES, &[], &wish);
        assert_eq!(set[0]["name"], "ExposureTimeAbs");
        rig.wait_for("settings read again", |station| station["camera"]["settings"]["exposure_us"] == 2500.0);
        let unknown =
            json!({ "features": [{ "name": "TestRegister", "value": "5" }, { "name": "No", "value": "1" }] });
        let (status, problem) = rig.try_send("PATCH", FEATURES, &[], &unknown);
        assert_eq!((status, &problem["pointer"]), (422, &json!("/features/1")), "{problem:#}");
        let answer =
            rig.server.send("PATCH", FEATURES, &[("content-type", "application/json")], b"{\"features\":[]}");
        assert_ne!(answer.status, 200, "nobody is in control");
        let events = rig.server.get("/api/v1/events?limit=200").expect(200);
        let is_set = |event: &&Value| event["kind"] == "camera.features_set";
        let n_events = events["items"].as_array().unwrap().iter().filter(is_set).count();
        assert_eq!(n_events, 2, "{events:#}");
    }
}
