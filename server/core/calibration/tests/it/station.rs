//! Complete calibrations from perfect features with white noise: the truth is recovered, σ is realistic, refusals name
//! their cause.

use crate::common::{Rig, calibrated};
use calibration::{
    CalibrationDocument, CalibrationError, CalibrationInput, CalibrationOptions, LightModelChoice,
    ProgressControl, calibrate,
};
use nalgebra::Vector2;
use optics::{Calibration, LightModelKind, LightSurfaces};

/// The depth errors of one station are mostly due to one parameter, the focal length: three of its σ.
const THREE_SIGMA: f64 = 3.0;

/// Depth errors over the sheets in the camera's view, in mm, and in units of the predicted σ.
fn depth_errors(rig: &Rig, calibration: &Calibration) -> (f64, f64) {
    let truth = LightSurfaces::Grating(rig.grating);
    let (mut squares, mut normalised, mut n) = (0.0, 0.0, 0.0);
    for &order in &rig.orders {
        for u in (40..1280).step_by(150) {
            for v in (150..900).step_by(60) {
                let pixel = Vector2::new(f64::from(u), f64::from(v));
                let ray = rig.camera.ray_from_pixel(&pixel).unwrap();
                let Some(hit) = truth.hit(order, &ray, None) else { continue };
                if !(375.0..425.0).contains(&hit.depth_mm) {
                    continue;
                }
                let point = calibration.triangulate(order, &pixel, None).unwrap();
                let error = point.hit.depth_mm - hit.depth_mm;
                let sigma = calibration.systematic_sigma_mm(order, &point).unwrap() / point.ray.norm();
                squares += error * error;
                normalised += (error / sigma).powi(2);
                n += 1.0;
            }
        }
    }
    ((squares / n).sqrt(), (normalised / n).sqrt())
}

#[test]
fn without_noise_the_truth_is_recovered() {
    let rig = Rig { corner_sigma_px: 0.0, line_sigma_px: 0.0, ..Rig::new(1) };
    let result = calibrated(&rig.input(8, 5)).unwrap();
    // The remaining error is from the linear interpolation of the simulated lines and the priors on gap and tilt.
    const TOLERANCE_MM: f64 = 0.002;
    let (rmse, _) = depth_errors(&rig, &result.calibration);
    assert!(rmse < TOLERANCE_MM, "{rmse} mm: {:?}", result.report.cross_validation);
    assert_eq!(result.report.cross_validation.unwrap().recommended, LightModelKind::Grating);
    let stage = result.calibration.stage.unwrap().linear().unwrap().direction;
    assert!((stage - rig.stage).norm() < 1e-5, "{stage}");
}

#[test]
fn errors_match_the_covariance() {
    // RMS of error/σ over a dozen stations: the errors of one are strongly correlated, so each counts about once; these
    // limits contain 99.9 % of the RMS of a dozen normal numbers.
    const STATIONS: u64 = 12;
    let (mut depth, mut focal, mut focal_mean) = (0.0, 0.0, 0.0);
    for seed in 10..10 + STATIONS {
        let rig = Rig { corner_sigma_px: 0.02, line_sigma_px: 0.1, ..Rig::new(seed) };
        let result = calibrated(&rig.input(10, 5)).unwrap();
        let (_, normalised) = depth_errors(&rig, &result.calibration);
        let z = (result.calibration.camera.fx_px - rig.camera.fx_px) / result.report.camera.sigma[0];
        depth += normalised * normalised;
        focal += z * z;
        focal_mean += z;
    }
    let n = STATIONS as f64;
    let (depth, focal, focal_mean) = ((depth / n).sqrt(), (focal / n).sqrt(), focal_mean / n);
    assert!((0.4..1.65).contains(&depth), "depth {depth}");
    assert!((0.4..1.65).contains(&focal), "focal length {focal}");
    // 99.9 % limits of the mean of a dozen normal numbers: a bias of the focal length is visible here first.
    assert!(focal_mean.abs() < 0.95, "mean pull on the focal length {focal_mean} σ");
}

#[test]
fn errors_of_a_plane_match_its_covariance_with_the_camera() {
    // Order 0 is a plane. A camera for which everything is too close puts the plane there as well: without their
    // covariance, depths would appear several times more certain than they are.
    const STATIONS: usize = 60;
    let options =
        CalibrationOptions { light_model: LightModelChoice::Fixed(LightModelKind::Planes), ..Default::default() };
    // A board whose square edges lie along the line has no usable points of it.
    let stations = (100..).filter_map(|seed| {
        let rig = Rig { orders: vec![0], corner_sigma_px: 0.02, line_sigma_px: 0.1, ..Rig::new(seed) };
        match calibrate(&rig.input(8, 0), &options, &mut |_, _| ProgressControl::Continue) {
            Err(CalibrationError::LinesOffBoard { .. }) => None,
            result => Some(depth_errors(&rig, &result.unwrap().calibration).1),
        }
    });
    let squares: f64 = stations.take(STATIONS).map(|normalised| normalised * normalised).sum();
    let normalised = (squares / STATIONS as f64).sqrt();
    eprintln!("depth by a plane over its σ: {normalised:.3}");
    // Contains 99 % of the RMS of 60 normal numbers; the errors of one station are mostly one number.
    assert!((0.77..1.24).contains(&normalised), "{normalised}");
}

#[test]
fn planes_do_not_fit_curved_sheets_and_the_report_states_it() {
    let result = calibrated(&Rig::new(2).input(8, 0)).unwrap();
    let scores = result.report.cross_validation.unwrap().scores;
    let bias = |kind| scores.iter().find(|s| s.model == kind).unwrap().held_out_bias_mm;
    assert!(bias(LightModelKind::Planes) > 10.0 * bias(LightModelKind::Grating));
    assert!(bias(LightModelKind::Pencil) > 10.0 * bias(LightModelKind::Grating));
}

#[test]
fn each_model_is_fitted_on_request() {
    let input = Rig::new(3).input(6, 5);
    for kind in LightModelKind::ALL {
        let options = CalibrationOptions { light_model: LightModelChoice::Fixed(kind), ..Default::default() };
        let result = calibrate(&input, &options, &mut |_, _| ProgressControl::Continue).unwrap();
        assert_eq!(result.calibration.light.kind(), kind);
        let names = result.calibration.parameter_names().len();
        assert_eq!(result.calibration.covariance.shape(), (names, names));
    }
}

#[test]
fn orders_listed_in_reverse_describe_the_same_light() {
    let rig = Rig::new(4);
    let mut input = rig.input(6, 0);
    input.projector.orders.reverse();
    let mirrored = calibrated(&input).unwrap().calibration;
    let straight = calibrated(&rig.input(6, 0)).unwrap().calibration;
    let pixel = Vector2::new(900.0, 350.0);
    let (a, b) = (straight.triangulate(-2, &pixel, None).unwrap(), mirrored.triangulate(2, &pixel, None).unwrap());
    assert!((a.hit.depth_mm - b.hit.depth_mm).abs() < 0.003, "{} {}", a.hit.depth_mm, b.hit.depth_mm);
}

#[test]
fn the_calibration_is_read_back_from_the_document_to_the_last_bit() {
    let result = calibrated(&Rig::new(5).input(5, 5)).unwrap();
    let document = CalibrationDocument::new(&result, Vec::new(), "1.2.3");
    let again = CalibrationDocument::parse(&document.to_json()).unwrap();
    let expected = Calibration { id: document.calibration.id.clone(), ..result.calibration.clone() };
    assert_eq!(again.calibration(), expected);
    assert_eq!(CalibrationDocument::new(&result, Vec::new(), "1.2.3").to_json(), document.to_json());
    assert_ne!(CalibrationDocument::new(&result, Vec::new(), "1.2.4").calibration.id, document.calibration.id);
}

#[test]
fn a_document_with_a_missing_row_is_refused_by_name() {
    let result = calibrated(&Rig::new(5).input(5, 0)).unwrap();
    let mut document = CalibrationDocument::new(&result, Vec::new(), "1");
    document.calibration.covariance.matrix.pop();
    let refused = CalibrationDocument::parse(&document.to_json()).unwrap_err().to_string();
    assert!(refused.contains("covariance.matrix"), "{refused}");
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let input = Rig::new(6).input(5, 3);
    let with_threads = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| CalibrationDocument::new(&calibrated(&input).unwrap(), Vec::new(), "1").to_json())
    };
    assert_eq!(with_threads(1), with_threads(3));
}

#[test]
fn cancelling_ends_the_calibration() {
    let cancelled = calibrate(&Rig::new(7).input(5, 0), &CalibrationOptions::default(), &mut |_, done| {
        if done > 0.3 { ProgressControl::Cancel } else { ProgressControl::Continue }
    });
    assert_eq!(cancelled, Err(CalibrationError::Cancelled));
}

#[test]
fn a_rocking_stage_is_reported_and_not_modelled_as_straight() {
    let rig = Rig::new(8);
    let mut input = rig.input(6, 5);
    // The third view lifted by half a pixel: 80 µm at 400 mm.
    for corner in &mut input.stage_views[2].corners.corners {
        corner.u_px += 0.5;
    }
    let report = calibrated(&input).unwrap().report;
    assert!(report.warnings.iter().any(|w| w.contains("does not travel straight")), "{:?}", report.warnings);
    assert!(report.stage.unwrap().straightness_rms_um > 20.0);
}

#[test]
fn gross_outliers_among_the_laser_points_are_rejected_and_counted() {
    let rig = Rig::new(9);
    let mut input = rig.input(6, 0);
    let lines = input.poses[1].centrelines.as_mut().unwrap();
    for point in lines.segments[2].points.iter_mut().skip(80).step_by(7) {
        point.v_px += 3.0;
    }
    let result = calibrated(&input).unwrap();
    assert!(result.report.light.unwrap().rejections.outlier > 2);
    assert!(depth_errors(&rig, &result.calibration).1 < THREE_SIGMA);
}

fn refusal(input: &CalibrationInput) -> CalibrationError {
    calibrated(input).unwrap_err()
}

#[test]
fn two_poses_are_too_few_for_camera_and_light() {
    assert_eq!(refusal(&Rig::new(1).input(2, 0)), CalibrationError::TooFewViews { needed: 3, got: 2 });
    assert_eq!(refusal(&Rig::new(1).input(2, 5)), CalibrationError::TooFewLaserPoses { needed: 3, got: 2 });
}

#[test]
fn parallel_boards_leave_the_focal_length_unobservable() {
    let refused = refusal(&Rig { tilt_rad: 0.0, ..Rig::new(1) }.input(6, 0));
    assert!(matches!(refused, CalibrationError::BoardsParallel { .. }), "{refused}");
    assert!(refused.to_string().contains("focal length"));
}

#[test]
fn a_laser_image_without_lines_on_the_board_is_excluded_and_named() {
    let mut input = Rig::new(1).input(5, 0);
    input.poses[3].centrelines = Some(vision::Centrelines::default());
    let warnings = calibrated(&input).unwrap().report.warnings;
    let named = |warning: &String| warning.contains("1 laser images") && warning.contains("board/003.png");
    assert!(warnings.iter().any(named), "{warnings:?}");
}

#[test]
fn too_few_laser_images_with_lines_on_the_board_are_refused_by_name() {
    let mut input = Rig::new(1).input(4, 0);
    for pose in &mut input.poses[2..] {
        pose.centrelines = Some(vision::Centrelines::default());
    }
    let dark = "board/002.png, board/003.png".to_owned();
    assert_eq!(refusal(&input), CalibrationError::LinesOffBoard { needed: 3, got: 2, dark });
}

#[test]
fn orders_out_of_order_are_refused() {
    let mut input = Rig::new(1).input(5, 0);
    input.projector.orders = vec![-2, 0, -1, 1, 2];
    assert!(matches!(refusal(&input), CalibrationError::OrdersUnsorted { .. }));
}

#[test]
fn lines_with_one_always_missing_are_identified_by_the_flat_order_0() {
    for missing in [0, 4] {
        let rig = Rig::new(1);
        let mut input = rig.input(8, 0);
        for pose in &mut input.poses {
            pose.centrelines.as_mut().unwrap().segments.remove(missing);
        }
        let result = calibrated(&input).unwrap();
        let expected = format!("order {} was found on 0 boards only", rig.orders[missing]);
        assert!(result.report.warnings.iter().any(|warning| warning.contains(&expected)), "{missing}");
        assert!(depth_errors(&rig, &result.calibration).1 < THREE_SIGMA, "{missing}");
    }
}

#[test]
fn a_line_missing_in_some_images_is_labelled_by_prediction() {
    let rig = Rig::new(12);
    let mut input = rig.input(8, 0);
    let boards_with = |input: &CalibrationInput, order: i8| -> Vec<String> {
        let lines = calibrated(input).unwrap().report.light.unwrap().residuals;
        lines.into_iter().filter(|line| line.order == order).map(|line| line.pose).collect()
    };
    let complete = boards_with(&input, 0);
    for pose in &mut input.poses[..4] {
        pose.centrelines.as_mut().unwrap().segments.remove(1);
    }
    assert_eq!(boards_with(&input, 0), complete);
    assert!(boards_with(&input, -1).iter().all(|pose| pose.as_str() >= "board/004.png"));
    assert!(depth_errors(&rig, &calibrated(&input).unwrap().calibration).1 < THREE_SIGMA);
}

#[test]
fn images_without_laser_give_only_a_camera() {
    let mut input = Rig::new(1).input(6, 5);
    for pose in &mut input.poses {
        pose.centrelines = None;
    }
    let result = calibrated(&input).unwrap();
    assert!((result.calibration.camera.fx_px - 2518.0).abs() < 1.0);
    assert!(result.report.light.is_none() && result.calibration.stage.is_some());
}

#[test]
fn lines_interrupted_on_every_dark_square_are_still_identified() {
    let rig = Rig::new(13);
    let mut input = rig.input(8, 0);
    // Every line in pieces of 90 columns out of 150, shifted from line to line: no column shows all five.
    for pose in &mut input.poses {
        let lines = pose.centrelines.as_mut().unwrap();
        let whole = std::mem::take(&mut lines.segments);
        for (line, segment) in whole.into_iter().enumerate() {
            let cell = |u_px: f64| (u_px as usize + 60 * line) / 150;
            let lit = |u_px: f64| (u_px as usize + 60 * line) % 150 < 90;
            let points: Vec<_> = segment.points.into_iter().filter(|p| lit(p.u_px)).collect();
            let pieces = points.chunk_by(|a, b| cell(a.u_px) == cell(b.u_px));
            lines.segments.extend(pieces.map(|piece| vision::Segment { points: piece.to_vec() }));
        }
    }
    let result = calibrated(&input).unwrap();
    assert!(depth_errors(&rig, &result.calibration).1 < THREE_SIGMA);
}

#[test]
fn an_order_with_few_points_on_the_boards_is_determined_by_the_others() {
    let rig = Rig::new(14);
    let mut input = rig.input(8, 0);
    for pose in &mut input.poses[2..] {
        pose.centrelines.as_mut().unwrap().segments.pop();
    }
    let result = calibrated(&input).unwrap();
    assert!(result.report.warnings.iter().any(|w| w.contains("order 2 was found on 2 boards only")));
    assert!(depth_errors(&rig, &result.calibration).1 < THREE_SIGMA);
}

/// Keeps the lines `kept(pose)` in the image of each pose.
fn keep_lines(input: &mut CalibrationInput, kept: impl Fn(usize) -> std::ops::Range<usize>) {
    for (idx, pose) in input.poses.iter_mut().enumerate() {
        let segments = &mut pose.centrelines.as_mut().unwrap().segments;
        *segments = segments[kept(idx)].to_vec();
    }
}

#[test]
fn lines_never_all_in_one_image_are_labelled_by_hypothesis() {
    for seed in 15..21 {
        let rig = Rig::new(seed);
        let mut input = rig.input(9, 0);
        keep_lines(&mut input, |pose| pose % 3..pose % 3 + 3);
        let result = calibrated(&input).unwrap();
        let seen = |pose: usize| -> Vec<i8> {
            let lines = &result.report.light.as_ref().unwrap().residuals;
            let name = &input.poses[pose].name;
            lines.iter().filter(|line| line.pose == *name).map(|line| line.order).collect()
        };
        for (pose, first) in [(0, -2), (1, -1), (2, 0)] {
            assert_eq!(seen(pose), [first, first + 1, first + 2], "seed {seed}");
        }
        assert!(depth_errors(&rig, &result.calibration).1 < THREE_SIGMA, "seed {seed}");
    }
}

#[test]
fn lines_that_could_be_their_neighbours_are_refused() {
    // So short and noisy that no bow is detectable.
    let mut input = Rig { line_sigma_px: 0.5, ..Rig::new(1) }.input(9, 0);
    keep_lines(&mut input, |pose| pose % 2..pose % 2 + 3);
    let segments = input.poses.iter_mut().flat_map(|pose| &mut pose.centrelines.as_mut().unwrap().segments);
    segments.for_each(|line| line.points.retain(|point| (point.u_px - 635.0).abs() < 150.0));
    assert!(matches!(refusal(&input), CalibrationError::OrdersUnobservable { needed: 5, seen: 3, .. }));
}
