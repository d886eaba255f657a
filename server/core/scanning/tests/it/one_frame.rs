//! Single frames, labelled the fast way and by the reference: the same profiles to the last bit, without a single
//! request for memory. What this does not show: that the labels are right; `labels.rs` does.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use crate::common::scene::scan;
use crate::common::{random, rig_a, station};
use optics::{Calibration, DepthRangeMm, Triangulator};
use scanning::files::peaks::pack_frame;
use scanning::{FrameLabeller, Profile, ScanFrame, label_frame, label_frame_by_reference};
use vision::{CentrelineExtractor, CentrelineParams, Centrelines, GreyImage, Pixels, Segment};

/// Points of what lines are torn into.
const SHRED_POINTS: usize = 30;
/// Pieces beyond which sets of them take several words.
const LARGEST_WORD: usize = 64;

/// Counts what the asking thread asks for.
struct Counting;

thread_local! {
    static N_REQUESTS: Cell<usize> = const { Cell::new(0) };
}

#[expect(unsafe_code, reason = "an allocator that counts cannot be written without")]
// SAFETY: every request is handed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        N_REQUESTS.with(|n| n.set(n.get() + 1));
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size_bytes: usize) -> *mut u8 {
        N_REQUESTS.with(|n| n.set(n.get() + 1));
        // SAFETY: the caller's promise.
        unsafe { System.realloc(block, layout, size_bytes) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Depths that a station allows: as calibrated, a few wraps of the labels, and less than one.
fn depth_ranges(calibration: &Calibration) -> [DepthRangeMm; 3] {
    let range = |near_mm, far_mm| DepthRangeMm { near_mm, far_mm };
    [calibration.depth_range_mm, range(340.0, 460.0), range(390.0, 412.0)]
}

/// Labels all frames both ways; returns points and points left out.
fn compare(name: &str, frames: &[ScanFrame], calibration: &Calibration) -> (usize, usize) {
    let triangulator = Triangulator::new(calibration.clone());
    let (mut labeller, mut profile) = (FrameLabeller::default(), Profile::default());
    let (mut n_points, mut n_dropped) = (0, 0);
    for depth_range_mm in depth_ranges(calibration) {
        for (idx, frame) in frames.iter().enumerate() {
            let lines = &frame.centrelines;
            labeller.label(lines, &triangulator, depth_range_mm, &mut profile);
            let reference = label_frame_by_reference(lines, &triangulator, depth_range_mm);
            assert_eq!(profile.labels, reference.labels, "{name}, frame {idx}, {depth_range_mm:?}");
            assert_eq!(profile.dropped, reference.dropped, "{name}, frame {idx}, {depth_range_mm:?}");
            assert!(profile.points == reference.points, "{name}, frame {idx}, {depth_range_mm:?}: points differ");
            n_points += profile.points.len();
            n_dropped += profile.dropped.total_points();
        }
    }
    (n_points, n_dropped)
}

#[test]
fn frames_of_random_scenes_are_labelled_as_by_the_reference() {
    let (mut n_points, mut n_dropped) = (0, 0);
    for seed in [3, 7, 14, 28, 46, 51] {
        let trial = random::trial(seed);
        let (points, dropped) = compare(&trial.name, &trial.known.frames, &trial.calibration);
        n_points += points;
        n_dropped += dropped;
    }
    // Both kinds of answers occur.
    assert!(n_points > 100_000 && n_dropped > 10_000, "{n_points} points, {n_dropped} left out");
}

#[test]
#[ignore = "minutes; the short one runs always"]
fn frames_of_a_campaign_are_labelled_as_by_the_reference() {
    for seed in 1..=60 {
        let trial = random::trial(seed);
        let counts = compare(&trial.name, &trial.known.frames, &trial.calibration);
        eprintln!("{}: {counts:?}", trial.name);
    }
}

#[test]
fn frames_of_rig_a_are_labelled_as_by_the_reference() {
    let Some(folder) = reference::data("rig-a") else { return };
    let calibration = rig_a::calibration(&folder);
    for scan in ["gauge", "sphere"] {
        compare(scan, &rig_a::truth_scan(&folder, scan).frames, &calibration);
    }
}

#[test]
fn lines_along_columns_and_stations_of_many_orders_are_labelled_as_by_the_reference() {
    let step = |x: f64, y: f64| if x.abs() < 12.0 && y.abs() < 10.0 { 391.0 } else { 400.0 };
    for (n_orders, turned) in [(5, true), (9, false), (17, false)] {
        let station = station(n_orders, turned);
        let known = scan(&station, &step, &[-6.0, 0.0, 4.0], turned);
        let (n_points, _) = compare("step", &known.frames, &station);
        assert!(n_points > 0);
    }
}

#[test]
fn frames_of_many_short_pieces_are_labelled_as_by_the_reference() {
    let station = station(5, false);
    let step = |x: f64, y: f64| if x.abs() < 12.0 && y.abs() < 10.0 { 391.0 } else { 400.0 };
    let mut known = scan(&station, &step, &[-6.0, 0.0, 4.0], false);
    for Centrelines { segments, .. } in known.frames.iter_mut().map(|frame| &mut frame.centrelines) {
        let shreds = segments.iter().flat_map(|segment| segment.points.chunks(SHRED_POINTS));
        *segments = shreds.map(|points| Segment { points: points.to_vec() }).collect();
        assert!(segments.len() > LARGEST_WORD, "{} shreds", segments.len());
    }
    let (n_points, n_dropped) = compare("shreds", &known.frames, &station);
    assert!(n_points > 10_000 && n_dropped > 100, "{n_points} points, {n_dropped} left out");
}

#[test]
fn frames_without_lines_have_empty_profiles() {
    let station = station(5, false);
    let known = scan(&station, &|_, _| 400.0, &[0.0], false);
    let triangulator = Triangulator::new(station.clone());
    let (mut labeller, mut profile) = (FrameLabeller::default(), Profile::default());
    labeller.label(&known.frames[0].centrelines, &triangulator, station.depth_range_mm, &mut profile);
    assert!(!profile.points.is_empty());
    labeller.label(&Centrelines::default(), &triangulator, station.depth_range_mm, &mut profile);
    assert_eq!(profile, Profile::default());
}

#[test]
fn frame_after_frame_asks_for_no_memory() {
    let station = station(5, false);
    let step = |x: f64, y: f64| if x.abs() < 12.0 && y.abs() < 10.0 { 391.0 } else { 400.0 };
    let frames = scan(&station, &step, &[-9.0, -6.0, -3.0, 0.0, 3.0, 6.0], false).frames;
    let triangulator = Triangulator::new(station.clone());
    let (mut labeller, mut profile) = (FrameLabeller::default(), Profile::default());
    let mut n_requests = [0; 2];
    for pass in &mut n_requests {
        let before = N_REQUESTS.get();
        for frame in &frames {
            labeller.label(&frame.centrelines, &triangulator, station.depth_range_mm, &mut profile);
        }
        *pass = N_REQUESTS.get() - before;
    }
    assert!(n_requests[0] > 0, "nothing is counted");
    assert_eq!(n_requests[1], 0, "requests in {} frames", frames.len());
    assert_eq!(profile, label_frame(&frames[5].centrelines, &triangulator, station.depth_range_mm));
}

#[test]
fn picture_after_picture_becomes_a_profile_and_a_record_without_asking_for_memory() {
    let Some(folder) = reference::data("rig-a") else { return };
    let calibration = rig_a::calibration(&folder);
    let depth_range_mm = calibration.depth_range_mm;
    let triangulator = Triangulator::new(calibration);
    let read = |idx: usize| {
        let picture = image::open(folder.join(format!("scan-sphere/{idx:05}.png"))).unwrap().into_luma8();
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        GreyImage::new(width, height, Pixels::Eight(picture.into_raw())).unwrap()
    };
    let pictures: Vec<GreyImage> = (0..40).step_by(4).map(read).collect();
    let (mut extractor, mut labeller) = (CentrelineExtractor::default(), FrameLabeller::default());
    let (mut lines, mut profile, mut record) = (Centrelines::default(), Profile::default(), Vec::new());
    let mut n_requests = [0; 3];
    for pass in &mut n_requests {
        let before = N_REQUESTS.get();
        for picture in &pictures {
            extractor.find(picture, &CentrelineParams::default(), &mut lines);
            labeller.label(&lines, &triangulator, depth_range_mm, &mut profile);
            pack_frame(&mut record, &lines, 0.0, None).unwrap();
            assert!(profile.points.len() > 2000, "{} points", profile.points.len());
        }
        *pass = N_REQUESTS.get() - before;
    }
    assert!(n_requests[0] > 0, "nothing is counted");
    assert_eq!(n_requests[2], 0, "requests in {} pictures, pass by pass: {n_requests:?}", pictures.len());
}
