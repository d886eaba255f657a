//! Frames, their numbers and their times.

use std::time::Duration;

use devices::{Camera, CameraRequest, FrameInfo};
use v4l2::V4l2Camera;
use v4l2::device::Stamped;
use vision::{GreyImage, Pixels};

use crate::scripted::{Bench, Flaw, level, settings};

/// Exposure of these tests.
const EXPOSURE_US: f64 = 2000.0;

fn blank() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap()
}

fn started(bench: &Bench) -> V4l2Camera {
    let mut camera = bench.open(&settings()).unwrap();
    let wanted =
        CameraRequest { exposure_us: Some(EXPOSURE_US), frame_rate_hz: Some(200.0), ..CameraRequest::default() };
    camera.configure(&wanted).unwrap();
    camera.start().unwrap();
    camera
}

fn frame(camera: &mut V4l2Camera, image: &mut GreyImage) -> FrameInfo {
    loop {
        if let Some(info) = camera.next_frame(image, Duration::from_millis(100)).unwrap() {
            return info;
        }
    }
}

/// Receives frames with these flaws, then one good one: ids, frames lost before each, and how many of those were
/// damaged.
fn received(first_sequence: u32, flaws: Vec<Flaw>) -> Vec<(u64, u64, u64)> {
    let bench = Bench::default();
    let mut camera = started(&bench);
    let n_good = 1 + flaws.iter().filter(|flaw| !flaw.is_marked && flaw.missing_bytes == 0).count();
    (bench.camera().sequence, bench.camera().flaws) = (first_sequence, flaws);
    let mut image = blank();
    (0..n_good)
        .map(|_| {
            let info = frame(&mut camera, &mut image);
            (info.frame_id, info.lost_before, info.lost_incomplete)
        })
        .collect()
}

#[test]
fn gaps_in_the_drivers_count_are_lost_frames() {
    let gap = Flaw { lost_before: 3, ..Flaw::default() };
    assert_eq!(received(0, vec![Flaw::default(), gap]), [(0, 0, 0), (4, 3, 0), (5, 0, 0)]);
    assert_eq!(received(1, vec![Flaw::default()]), [(0, 0, 0), (1, 0, 0)], "a driver that counts from 1");
    assert_eq!(
        received(u32::MAX - 1, vec![Flaw::default(), gap]),
        [(0, 0, 0), (4, 3, 0), (5, 0, 0)],
        "the wrap-around"
    );
}

#[test]
fn damaged_frames_are_counted_and_never_delivered() {
    let marked = Flaw { is_marked: true, ..Flaw::default() };
    let short = Flaw { missing_bytes: 2, ..Flaw::default() };
    let gap = Flaw { lost_before: 1, ..Flaw::default() };
    assert_eq!(received(0, vec![Flaw::default(), marked, short, gap]), [(0, 0, 0), (4, 3, 2), (5, 0, 0)]);
    assert_eq!(received(0, vec![marked]), [(1, 1, 1)], "the first one");
}

#[test]
fn damaged_frames_are_known_before_a_good_one_arrives() {
    let bench = Bench::default();
    let mut camera = started(&bench);
    bench.camera().flaws = vec![Flaw { is_marked: true, ..Flaw::default() }; 1000];
    assert_eq!(camera.next_frame(&mut blank(), Duration::from_millis(100)).unwrap(), None);
    assert!(camera.n_incomplete() > 0);
    bench.camera().flaws.clear();
    frame(&mut camera, &mut blank());
    assert_eq!(camera.n_incomplete(), 0);
}

#[test]
fn images_equal_those_that_were_sent() {
    for format in ["YUYV", "MJPG"] {
        let bench = Bench::default();
        let mut camera = bench.open(&v4l2::V4l2Settings { format_8: format.to_owned(), ..settings() }).unwrap();
        camera.start().unwrap();
        let mut image = blank();
        for _ in 0..3 {
            let info = frame(&mut camera, &mut image);
            let Pixels::Eight(pixels) = image.pixels() else { panic!("{format}: not 8 bits") };
            let expected = level(info.frame_id as u32);
            // A uniform image survives JPEG except for rounding.
            assert!(
                pixels.iter().all(|pixel| pixel.abs_diff(expected) <= 1),
                "{format}: {} {expected}",
                pixels[0]
            );
        }
    }
}

#[test]
fn the_frame_time_is_the_middle_of_the_exposure() {
    let half = Duration::from_secs_f64(EXPOSURE_US * 0.5e-6);
    for stamped in [Stamped::ExposureStart, Stamped::FrameEnd] {
        let bench = Bench::default();
        bench.camera().stamped = stamped;
        let mut camera = started(&bench);
        for _ in 0..5 {
            let info = frame(&mut camera, &mut blank());
            let stamp = bench.camera().stamps[info.frame_id as usize];
            let expected = match stamped {
                Stamped::ExposureStart => stamp + half,
                Stamped::FrameEnd => stamp.checked_sub(half).unwrap(),
            };
            assert_eq!(info.exposed_at, expected, "{stamped:?}");
            assert_eq!(info.exposure_us, EXPOSURE_US);
        }
    }
}
