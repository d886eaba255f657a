//! The camera contract suite with aravis' GigE Vision camera; and aravis' in-process camera, which has neither triggers
//! nor a network.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use devices::contract::{self, Cable, CameraProfile};
use genicam::aravis::enable_fake;

use crate::rig::{SERIAL, blank, fake, frame, open_small, settings};

/// Frame rate of the free-running tests.
const RATE_HZ: f64 = 20.0;

#[test]
fn a_gige_camera_passes_the_suite() {
    let Some(camera) = fake(0) else { return };
    let camera = Arc::new(Mutex::new(camera));
    let (unplugged, replugged) = (camera.clone(), camera.clone());
    let cable = Cable {
        unplug: Box::new(move || unplugged.lock().unwrap().kill()),
        replug: Box::new(move || replugged.lock().unwrap().restart().unwrap()),
    };
    let profile =
        CameraProfile { frame_rate_hz: Some(RATE_HZ), frame_limit: Duration::from_secs(10), cable: Some(cable) };
    contract::camera(
        &mut || {
            // It keeps its settings; each test begins with a freshly started camera.
            camera.lock().unwrap().restart().unwrap();
            // Small images: a burst of large ones overflows the socket with its default buffer size.
            open_small(&settings(SERIAL), RATE_HZ)
        },
        &profile,
    );
}

#[test]
fn the_librarys_own_camera_delivers_frames_without_a_network() {
    enable_fake();
    let mut camera = open_small(&settings("1"), RATE_HZ);
    assert_eq!(camera.identity().driver, "genicam");
    let mut image = blank();
    for _ in 0..2 {
        camera.start().unwrap();
        for expected_id in 0..5 {
            let info = frame(&mut *camera, &mut image);
            assert_eq!((info.frame_id, info.lost_before), (expected_id, 0));
            assert_eq!((image.width(), image.height()), (128, 96));
        }
        camera.stop().unwrap();
    }
    let link = camera.details().unwrap().link();
    assert!(link.frames_complete >= 10 && link.packet_size_bytes.is_none(), "{link:?}");
}
