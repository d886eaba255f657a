//! Labels of lines extracted from rendered images of clutter: wide lines, blocks exactly one wrap high. Not
//! covered: a calibration that deviates from the truth.

use std::collections::BTreeMap;
use std::path::Path;

use crate::common::rendered::{Rendered, block, clutter, crowded};
use crate::common::rig_a;
use crate::common::splatted::splatted;
use crate::common::truth_lines::{Score, TrueRay, TruthLine, lines_between, score};
use optics::{Calibration, StagePosition};
use rayon::prelude::*;
use scanning::{ScanFrame, ScanParams, scan_cloud};
use vision::{CentrelineParams, GreyImage, Pixels, find_centrelines};

/// Accepted fraction of points with a wrong order in clutter.
const WRONG: f64 = 1e-4;
/// Fraction of the visible line columns that must be found there; the extraction rejects edges and merged lines.
const RECOVERED: f64 = 0.95;

fn evaluated(name: &str, frames: &[ScanFrame], calibration: &Calibration, truth: &[Vec<TruthLine>]) -> Score {
    let start = std::time::Instant::now();
    let result = scan_cloud(frames, calibration, &ScanParams::default()).unwrap();
    let took = start.elapsed();
    let score = score(&result.cloud.points, truth, frames[0].centrelines.direction);
    eprintln!("{name}: {score}, {:?}, {took:.2?}", result.report.dropped);
    score
}

fn evaluate(scan: &Rendered) -> Score {
    evaluated(&scan.name, &scan.frames, &scan.calibration, &scan.truth)
}

/// The lines extracted from the images of a rig.
pub fn frames_of(folder: &Path, scan: &str) -> Vec<ScanFrame> {
    let found = rig_a::frames_of(folder, scan).into_par_iter().map(|(path, position_mm)| {
        let grey = image::open(path).unwrap().into_luma8();
        let (width, height) = (grey.width() as usize, grey.height() as usize);
        let image = GreyImage::new(width, height, Pixels::Eight(grey.into_raw())).unwrap();
        ScanFrame {
            centrelines: find_centrelines(&image, &CentrelineParams::default()),
            position: StagePosition::LinearMm(position_mm),
        }
    });
    found.collect()
}

/// The true lines of every frame, column by column between close rays of one order.
pub fn truth_of(folder: &Path, scan: &str, n_frames: usize) -> Vec<Vec<TruthLine>> {
    let mut rows: BTreeMap<usize, Vec<rig_a::TruthRow>> = rig_a::truth_rows(folder, scan);
    let ray = |&(order, along_px, across_px, [_, _, depth_mm]): &rig_a::TruthRow| TrueRay {
        order,
        along_px,
        across_px,
        depth_mm,
    };
    let rays = |frame| rows.remove(&frame).unwrap_or_default().iter().map(ray).collect::<Vec<TrueRay>>();
    (0..n_frames).map(rays).map(|rays| lines_between(&rays, 1280)).collect()
}

#[test]
fn clutter_of_blocks_one_wrap_high_has_no_wrong_order() {
    let Some(folder) = reference::data("rig-b") else { return };
    let frames = frames_of(&folder, "clutter");
    let truth = truth_of(&folder, "clutter", frames.len());
    let score = evaluated("rig-b", &frames, &rig_a::calibration(&folder), &truth);
    assert!(score.wrong() <= WRONG, "{score}");
    assert!(score.recovered() >= RECOVERED, "{score}");
}

#[test]
#[ignore = "takes minutes; a number of seeds from FIRST_SEED to LAST_SEED"]
fn a_campaign_of_rendered_clutter_has_no_wrong_order() {
    let number =
        |name: &str, default: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default);
    let mut all = Score::default();
    for seed in number("FIRST_SEED", 1)..=number("LAST_SEED", 30) {
        all.add(&evaluate(&clutter(seed)));
    }
    eprintln!("all: {all}");
    assert!(all.wrong() <= WRONG, "{all}");
}

#[test]
#[ignore = "takes minutes; a number of seeds from FIRST_SEED to LAST_SEED"]
fn a_campaign_of_crowded_scenes_has_no_wrong_order() {
    let number =
        |name: &str, default: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default);
    let mut all = Score::default();
    for seed in number("FIRST_SEED", 1)..=number("LAST_SEED", 20) {
        all.add(&evaluate(&crowded(seed)));
    }
    eprintln!("all: {all}");
    assert!(all.wrong() <= WRONG, "{all}");
}

#[test]
#[ignore = "takes minutes; a number of seeds from FIRST_SEED to LAST_SEED"]
fn a_campaign_of_scenes_drawn_as_rig_b_has_no_wrong_order() {
    let number =
        |name: &str, default: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default);
    let mut all = Score::default();
    for seed in number("FIRST_SEED", 1)..=number("LAST_SEED", 20) {
        all.add(&evaluate(&splatted(seed)));
    }
    eprintln!("all: {all}");
    assert!(all.wrong() <= WRONG, "{all}");
    assert!(all.recovered() >= RECOVERED, "{all}");
}

#[test]
#[ignore = "takes minutes"]
fn a_campaign_of_single_blocks_has_no_wrong_order() {
    let mut all = Score::default();
    for (idx, height_mm) in [25.0, 27.0, 28.0, 29.0, 29.5, 30.0, 30.5, 31.0, 32.0, 34.0].into_iter().enumerate() {
        for (fwhm_px, y_mm) in [(4.0, -30.0), (6.0, -15.0), (8.0, 15.0), (6.0, 30.0)] {
            let centre = [10.0 * idx as f64 - 45.0, y_mm];
            all.add(&evaluate(&block(idx as u64 + 1, fwhm_px, height_mm, centre, 24)));
        }
    }
    eprintln!("all: {all}");
    assert!(all.wrong() <= WRONG, "{all}");
}
