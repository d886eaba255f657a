//! Processor time per frame, compared with aravis' own loop, which receives and discards (`arv-camera-test-0.8`).

use std::process::Command;
use std::time::{Duration, Instant};

use devices::{CameraRequest, Driver, Roi};
use genicam::GenicamDriver;

use crate::rig::{SERIAL, blank, fake, open, settings};

/// Requested frame rate.
const RATE_HZ: f64 = 100.0;

/// Duration of each measurement.
const DURATION: Duration = Duration::from_secs(5);

/// Clock ticks of `/proc` per second, the same on every Linux.
const TICKS_PER_S: f64 = 100.0;

/// Processor time of this process, or of its ended children, seconds.
fn processor_s(children: bool) -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<f64> =
        stat.rsplit(')').next().unwrap().split_whitespace().skip(1).map(|field| field.parse().unwrap()).collect();
    let first = if children { 12 } else { 10 };
    (fields[first] + fields[first + 1]) / TICKS_PER_S
}

#[test]
#[ignore = "a measurement: needs a quiet machine"]
fn processor_time_per_frame_compared_with_aravis() {
    let Some(_camera) = fake(0) else { return };
    let mut camera = open(&settings(SERIAL));
    let roi = Roi { left_px: 0, top_px: 0, width_px: 512, height_px: 512 };
    let wanted = CameraRequest { roi: Some(roi), frame_rate_hz: Some(RATE_HZ), ..CameraRequest::default() };
    camera.configure(&wanted).unwrap();
    camera.start().unwrap();
    let packet_bytes = camera.details().unwrap().link().packet_size_bytes.unwrap();
    let (mut image, mut n_frames, mut lost) = (blank(), 0, 0);
    let (began, before_s) = (Instant::now(), processor_s(false));
    while began.elapsed() < DURATION {
        if let Some(info) = camera.next_frame(&mut image, Duration::from_millis(20)).unwrap() {
            (n_frames, lost) = (n_frames + 1, lost + info.lost_before);
        }
    }
    let ours_us = (processor_s(false) - before_s) * 1e6 / f64::from(n_frames);
    camera.stop().unwrap();
    drop(camera);
    // It is released on a separate thread.
    let is_held = || GenicamDriver(settings(SERIAL)).discover().iter().any(|found| found.in_use_by.is_some());
    while is_held() {}
    let before_s = processor_s(true);
    let mut library = Command::new("arv-camera-test-0.8");
    library.args(["--auto", "--no-packet-socket", "--frequency", &RATE_HZ.to_string()]);
    library.args(["--gv-packet-size", &packet_bytes.to_string(), "--duration", &DURATION.as_secs().to_string()]);
    let expected = String::from_utf8(library.output().unwrap().stdout).unwrap();
    let count = |name: &str| -> f64 {
        let line = expected.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{expected}"));
        line.split('=').nth(1).unwrap().trim().parse().unwrap()
    };
    let (received, failed) = (count("n_completed_buffers"), count("n_failures"));
    let theirs_us = (processor_s(true) - before_s) * 1e6 / (received + failed);
    println!("512×512 at {RATE_HZ} Hz, packets of {packet_bytes} bytes");
    println!("this driver: {n_frames} frames, {lost} lost, {ours_us:.0} µs of processor time each");
    println!("the library: {received} frames, {failed} incomplete, {theirs_us:.0} µs each");
}
