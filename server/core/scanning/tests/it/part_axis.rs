//! The axis of a turntable from the part alone, compared with the true axis. Two lasers switched on one by one; lines
//! with white noise. Not covered: speckle, reflections, wobble of the table.

use nalgebra::Vector3;
use optics::{Calibration, RotaryAxis, StagePosition};
use scanning::{PartAxisError, ScanFrame, axis_from_part};
use vision::Centrelines;

use crate::common::KnownScan;
use crate::common::scene::scan_moved_with;
use crate::turntable::{about_axis, angles, axis, laser_light, solid, two_lasers};

/// Seeds of the noise.
const SEEDS: u64 = 3;
/// An error beyond this many of its own σ has a probability of 6 in 100 000.
const SIGMAS: f64 = 4.0;

/// Every frame as two, each with one laser on.
fn lit_one_by_one(known: &KnownScan) -> Vec<ScanFrame> {
    let of_line = |frame: usize, line: i8| {
        let ScanFrame { centrelines, position } = &known.frames[frame];
        let own = |idx: &usize| known.orders[frame][*idx].iter().flatten().next() == Some(&line);
        let segments = (0..centrelines.segments.len()).filter(own).map(|idx| centrelines.segments[idx].clone());
        let lines = Centrelines { segments: segments.collect(), lit_line: Some(line), ..centrelines.clone() };
        ScanFrame { centrelines: lines, position: *position }
    };
    (0..known.frames.len()).flat_map(|frame| [0, 1].map(|line| of_line(frame, line))).collect()
}

fn turn(seed: u64, positions: &[StagePosition], part: &(dyn Fn(&Vector3<f64>) -> f64 + Sync)) -> Vec<ScanFrame> {
    lit_one_by_one(&scan_moved_with(&two_lasers(), part, &laser_light, positions, seed))
}

/// The station without a stage, and an axis displaced by millimetres and a degree.
fn displaced_axis() -> (Calibration, RotaryAxis) {
    let station = Calibration { stage: None, ..two_lasers() };
    (station, axis().moved(&[0.015, -0.015, 1.5, -1.5]))
}

#[test]
fn the_surfaces_of_a_turned_part_coincide_about_the_true_axis() {
    let (station, start) = displaced_axis();
    let mut whitened = Vec::new();
    for seed in 0..SEEDS {
        let frames = turn(20 + seed, &angles(0.0, 390.0), &solid);
        let found = axis_from_part(&&frames[..], &station, &start).unwrap();
        let (first, second) = optics::rotation::completing_frame(&found.axis.direction);
        let truth = axis().with_point_near(&found.axis.point_mm);
        let off = truth.point_mm - found.axis.point_mm;
        let errors =
            [first.dot(&truth.direction), second.dot(&truth.direction), first.dot(&off), second.dot(&off)];
        let sigmas: Vec<f64> = (0..4).map(|idx| found.covariance[(idx, idx)].sqrt()).collect();
        eprintln!(
            "{} pairs, {:.1} µm apart, noise ratio {:.2}: tilts {:.1e} {:.1e} of {:.1e} {:.1e}, shifts {:.4} {:.4} of {:.4} {:.4} mm",
            found.n_pairs,
            1e3 * found.rms_mm,
            found.noise_ratio,
            errors[0],
            errors[1],
            sigmas[0],
            sigmas[1],
            errors[2],
            errors[3],
            sigmas[2],
            sigmas[3]
        );
        assert!(errors[2].hypot(errors[3]) < 0.02, "{off:?}");
        whitened.extend(errors.iter().zip(&sigmas).map(|(error, sigma)| error / sigma));
    }
    let rms = (whitened.iter().map(|z| z * z).sum::<f64>() / whitened.len() as f64).sqrt();
    eprintln!("errors over their σ: RMS {rms:.2}");
    assert!(whitened.iter().all(|z| z.abs() < SIGMAS), "{whitened:?}");
    // 12 standard normal values: 0.43 to 1.66 (99.8 %).
    assert!((0.43..1.66).contains(&rms), "{rms}");
}

#[test]
fn a_body_of_revolution_does_not_determine_the_axis() {
    let (station, start) = displaced_axis();
    let cylinder = |at: &Vector3<f64>| {
        let (_, height_mm, radius) = about_axis(at);
        if height_mm.abs() > 22.0 { -1.0 } else { 21.0 - radius }
    };
    let frames = turn(31, &angles(0.0, 390.0), &cylinder);
    let refused = axis_from_part(&&frames[..], &station, &start).unwrap_err();
    eprintln!("{refused}");
    assert!(matches!(refused, PartAxisError::Unconstrained { .. }), "{refused}");
}

#[test]
fn one_line_alone_does_not_determine_the_axis() {
    let (station, start) = displaced_axis();
    let mut frames = turn(32, &angles(0.0, 390.0), &solid);
    frames.retain(|frame| frame.centrelines.lit_line == Some(0));
    let refused = axis_from_part(&&frames[..], &station, &start).unwrap_err();
    eprintln!("{refused}");
    assert!(matches!(refused, PartAxisError::TooFewPairs { n_pairs: 0, .. }), "{refused}");
}
