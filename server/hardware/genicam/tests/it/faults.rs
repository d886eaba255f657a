//! A camera that disappears, returns, loses frames or is in use elsewhere. Unplugging is covered by the contract suite.

use std::time::{Duration, Instant};

use devices::{CameraError, CameraRequest, DeviceSet, Driver, OpenError};
use genicam::GenicamDriver;

use crate::rig::{SERIAL, blank, fake, frame, open, open_small, settings, until};

/// A lost camera is reported within this time (`promises.md`).
const REPORT_LIMIT: Duration = Duration::from_secs(2);

/// Additional time on a machine that runs other tests.
const SLACK: Duration = Duration::from_secs(1);

#[test]
fn a_camera_that_hangs_is_reported_as_disconnected_and_recovers_with_its_settings() {
    let Some(fake) = fake(0) else { return };
    let mut camera = open_small(&settings(SERIAL), 50.0);
    let wanted = CameraRequest { exposure_us: Some(1234.0), gain_db: Some(3.0), ..CameraRequest::default() };
    camera.configure(&wanted).unwrap();
    camera.start().unwrap();
    let (mut image, set) = (blank(), camera.settings());
    frame(&mut *camera, &mut image);
    fake.hold();
    let held_at = Instant::now();
    let reason = until(&mut *camera, &mut image, "it is reported", |_, got| match got {
        Err(CameraError::Disconnected { reason }) => Some(reason),
        _ => None,
    });
    assert!(held_at.elapsed() < REPORT_LIMIT + SLACK, "reported after {:?}", held_at.elapsed());
    assert!(reason.contains("no longer responds"), "{reason}");
    fake.resume();
    camera.reconnect().unwrap();
    until(&mut *camera, &mut image, "it is reconnected", |_, got| got.ok());
    assert_eq!(camera.settings(), set);
    camera.start().unwrap();
    frame(&mut *camera, &mut image);
}

#[test]
fn a_restart_of_an_idle_camera_is_detected() {
    let Some(mut fake) = fake(0) else { return };
    let mut camera = open_small(&settings(SERIAL), 50.0);
    let (mut image, set) = (blank(), camera.settings());
    fake.restart().unwrap();
    let reason = until(&mut *camera, &mut image, "it is reported", |_, got| match got {
        Err(CameraError::Disconnected { reason }) => Some(reason),
        _ => None,
    });
    assert!(reason.contains("no longer controlled"), "{reason}");
    camera.reconnect().unwrap();
    until(&mut *camera, &mut image, "it is reconnected", |_, got| got.ok());
    assert_eq!(camera.settings(), set, "the lost settings were not set again");
}

#[test]
fn frames_lost_without_free_buffers_are_counted() {
    let Some(_fake) = fake(0) else { return };
    let mut wanted = settings(SERIAL);
    wanted.buffers = 4;
    let mut camera = open_small(&wanted, 100.0);
    camera.start().unwrap();
    let (mut image, mut shown, mut lost) = (blank(), 0, 0);
    for n in 0..60 {
        if n == 20 {
            // No frames are taken: four wait, the others find no buffer.
            std::thread::sleep(Duration::from_millis(500));
        }
        let info = frame(&mut *camera, &mut image);
        (shown, lost) = (shown + 1, lost + info.lost_before);
        assert_eq!(shown + lost, info.frame_id + 1);
    }
    let link = camera.details().unwrap().link();
    assert!(lost >= 20 && link.underruns > 0 && link.frames_missing >= 20, "{lost} lost, {link:?}");
}

#[test]
fn a_camera_in_use_is_reported_with_the_program_that_uses_it() {
    let Some(_fake) = fake(0) else { return };
    let _held = open(&settings(SERIAL));
    let wanted = DeviceSet { camera: true, ..DeviceSet::default() };
    match GenicamDriver(settings(SERIAL)).open(wanted) {
        Err(OpenError::Absent { what, .. }) => assert!(what.contains("in use by another program"), "{what}"),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("two programs opened it"),
    }
    let found = GenicamDriver(settings("")).discover();
    let ours = found.iter().find(|found| found.value == SERIAL).unwrap_or_else(|| panic!("{found:?}"));
    assert_eq!((ours.setting, ours.vendor.as_str(), ours.model.as_str()), ("serial", "Aravis", "Fake"));
    assert_eq!(ours.address, "127.0.0.1");
    assert!(ours.in_use_by.is_some(), "{ours:?}");
}

#[test]
fn a_missing_camera_is_absent_and_available_ones_are_listed() {
    let Some(_fake) = fake(0) else { return };
    let wanted = DeviceSet { camera: true, ..DeviceSet::default() };
    match GenicamDriver(settings("ANOTHER")).open(wanted) {
        Err(OpenError::Absent { what, .. }) => assert!(what.contains(SERIAL), "{what}"),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("opened another camera"),
    }
}
