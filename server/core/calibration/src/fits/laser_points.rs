//! From the centrelines of all laser images to labelled observations without outliers.

use std::collections::BTreeSet;

use optics::{DepthRangeMm, LightSurfaces};
use statistics::SIGMA_PER_MAD;
use vision::Centrelines;

use crate::error::CalibrationError;
use crate::findings::report::Rejections;
use crate::first::board_lines::{
    BoardPiece, ImageLines, image_lines, label_by_prediction, observations, unlabel_beyond_board,
};
use crate::first::chaining::label_whole_lines;
use crate::fits::light_fit::{Scene, fit_light, lit_points};
use crate::fits::partial_sets::label_partial_sets;
use crate::input::CalibrationInput;
use crate::params::{
    DEPTH_RANGE_MARGIN, LASER_HUBER_SIGMAS, LASER_REJECT_SIGMAS, MAX_LINE_NOISE_RATIO, MIN_LASER_POSES,
    MIN_LINE_COLUMNS, MIN_RANKED_BOARDS, MIN_RELATIVE_DEPTH_SPAN, MIN_TIED_ORDERS, POINTS_PER_CORRELATION,
};
use crate::solving::bundle::sheet_residual;
use crate::solving::observation::{LaserObservation, huber};

/// The observations for the light fits.
#[derive(Debug, Clone, PartialEq)]
pub struct LaserPoints {
    /// Labelled points with σ scaled to the scatter of their residuals.
    pub observations: Vec<LaserObservation>,
    /// Rejected points, by reason.
    pub rejections: Rejections,
    /// Outliers per (block, order).
    pub outliers: Vec<(usize, i8)>,
    /// Depth range of the observed lines, with a margin.
    pub depth_range_mm: DepthRangeMm,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// Finds and labels the laser points of all poses and removes outliers.
///
/// # Errors
/// An image without lines, orders that cannot be determined, boards without depth range.
pub fn laser_points(input: &CalibrationInput, scene: &Scene) -> Result<LaserPoints, CalibrationError> {
    let mut rejections = Rejections::default();
    let mut pieces: Vec<BoardPiece> = Vec::new();
    let (mut most_side_by_side, mut correlation_px) = (0, 1.0_f64);
    let mut lines_of_images: Vec<Vec<Vec<usize>>> = Vec::new();
    let (mut lit, mut dark) = (BTreeSet::new(), Vec::new());
    let images = input.poses.iter().enumerate();
    let images = images.flat_map(|(block, pose)| pose.laser_images().map(move |lines| (block, pose, lines)));
    for (block, pose, centrelines) in images {
        let mut lines = lines_on_board(input, scene, block, centrelines);
        if lines.pieces.iter().filter(|piece| piece.on_pattern).map(|piece| piece.points.len()).sum::<usize>()
            < MIN_LINE_COLUMNS
        {
            dark.push(pose.name.as_str());
            continue;
        }
        lit.insert(block);
        let whole = match centrelines.lit_line {
            None => label_whole_lines(&mut lines.pieces, scene.orders, centrelines.direction, lines.pitch_px),
            Some(_) => Vec::new(),
        };
        rejections.off_board += lines.rejections.off_board;
        rejections.square_edge += lines.rejections.square_edge;
        most_side_by_side = most_side_by_side.max(lines.most_side_by_side).max(whole.len());
        correlation_px = correlation_px.max(lines.correlation_px);
        let n_before = pieces.len();
        lines_of_images
            .push(whole.into_iter().map(|line| line.into_iter().map(|idx| idx + n_before).collect()).collect());
        pieces.extend(lines.pieces);
    }
    if lit.len() < MIN_LASER_POSES {
        return Err(CalibrationError::LinesOffBoard {
            needed: MIN_LASER_POSES,
            got: lit.len(),
            dark: dark.join(", "),
        });
    }
    let spacing = (correlation_px / POINTS_PER_CORRELATION).round().max(1.0) as usize;
    let mut ranked = on_pattern(&pieces, spacing, correlation_px);
    if boards(ranked.iter()).len() < MIN_LASER_POSES
        && label_partial_sets(&mut pieces, &lines_of_images, scene, spacing)
    {
        ranked = on_pattern(&pieces, spacing, correlation_px);
    }
    check_ranked(scene, &ranked, most_side_by_side)?;
    let kind = scene.working_model();
    let light = fit_light(scene, &ranked, kind, None)?.light;
    label_by_prediction(&mut pieces, scene.camera, scene.poses, &light, scene.orders);
    unlabel_beyond_board(&mut pieces, scene.camera, scene.poses, &light);
    rejections.unlabelled = pieces.iter().filter(|p| p.order.is_none()).map(|p| p.points.len()).sum();
    let labelled = observations(&pieces, spacing, correlation_px);
    let mut warnings = check_seen(scene, &labelled)?;
    if !dark.is_empty() {
        let (n, names) = (dark.len(), dark.join(", "));
        warnings
            .push(format!("excluded from the light fit: {n} laser images without a line on the board ({names})"));
    }
    let light = fit_light(scene, &labelled, kind, Some(&light))?.light;
    let (observations, outliers, noise_ratio) = without_outliers(scene, &light, labelled);
    if noise_ratio > MAX_LINE_NOISE_RATIO {
        warnings.push(format!(
            "the lines scatter about the light model `{kind}` by {noise_ratio:.1} times their noise: boards that bend or \
             moved between their two images, curved sheets modelled as planes, or a surface that scatters light"
        ));
    }
    rejections.outlier = outliers.len();
    let depth_range_mm = depth_range(scene, &observations)?;
    Ok(LaserPoints { observations, rejections, outliers, depth_range_mm, warnings })
}

/// The pieces of an image; if only one line was switched on, all belong to it.
fn lines_on_board(input: &CalibrationInput, scene: &Scene, block: usize, centrelines: &Centrelines) -> ImageLines {
    let of =
        |orders: &[i8]| image_lines(block, centrelines, scene.camera, &scene.poses[block], &input.board, orders);
    match centrelines.lit_line {
        None => of(scene.orders),
        Some(order) => of(&[order]).of_line(order),
    }
}

/// The labelled points on the boards' patterns.
pub(super) fn on_pattern(pieces: &[BoardPiece], spacing: usize, correlation_px: f64) -> Vec<LaserObservation> {
    let on_pattern: Vec<BoardPiece> = pieces.iter().filter(|piece| piece.on_pattern).cloned().collect();
    observations(&on_pattern, spacing, correlation_px)
}

/// Checks that lines are ranked on at least two boards: fewer do not determine a sheet that predicts the others.
fn check_ranked(scene: &Scene, ranked: &[LaserObservation], seen: usize) -> Result<(), CalibrationError> {
    let images = boards(ranked.iter()).len();
    if images < MIN_RANKED_BOARDS {
        return Err(CalibrationError::OrdersUnobservable {
            needed: scene.orders.len(),
            seen,
            images,
            needed_images: MIN_RANKED_BOARDS,
        });
    }
    Ok(())
}

/// Orders observed on too few boards: refused where nothing relates them to the others, reported where the grating
/// does.
fn check_seen(scene: &Scene, laser: &[LaserObservation]) -> Result<Vec<String>, CalibrationError> {
    let needed = MIN_LASER_POSES;
    let seen_on = |order: i8| boards(laser.iter().filter(|p| p.order == order)).len();
    let rare: Vec<(i8, usize)> =
        scene.orders.iter().map(|&order| (order, seen_on(order))).filter(|(_, got)| *got < needed).collect();
    let tied =
        scene.nominal_wavelength_over_period.is_some() && scene.orders.len() - rare.len() >= MIN_TIED_ORDERS;
    match rare.first() {
        Some(&(order, got)) if !tied => Err(CalibrationError::OrderUnseen { order, got, needed }),
        _ => Ok(rare
            .into_iter()
            .map(|(order, got)| {
                format!("order {order} was found on {got} boards only: its sheet is determined by the grating and the other orders")
            })
            .collect()),
    }
}

/// The boards with points.
fn boards<'a>(points: impl Iterator<Item = &'a LaserObservation>) -> std::collections::BTreeSet<usize> {
    points.map(|point| point.block).collect()
}

/// Scales σ to the residuals' scatter, then removes outliers. Also returns (block, order) of the removed points, and
/// the scale.
fn without_outliers(
    scene: &Scene,
    light: &LightSurfaces,
    mut laser: Vec<LaserObservation>,
) -> (Vec<LaserObservation>, Vec<(usize, i8)>, f64) {
    let z_of = |p: &LaserObservation| {
        sheet_residual(scene.camera, light, &scene.poses[p.block], p, None)
            .map_or(f64::INFINITY, |sheet| sheet.residual_px.abs() / p.sigma_px)
    };
    let z: Vec<f64> = laser.iter().map(z_of).collect();
    let scale = robust_scale(&z);
    for point in &mut laser {
        point.sigma_px *= scale;
    }
    let mut outliers = Vec::new();
    let mut kept = Vec::with_capacity(laser.len());
    for (point, z) in laser.into_iter().zip(z) {
        if z / scale <= LASER_REJECT_SIGMAS {
            kept.push(point);
        } else {
            outliers.push((point.block, point.order));
        }
    }
    (kept, outliers, scale)
}

/// RMS of |z| with Huber weights around the current scale.
fn robust_scale(z: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = z.iter().copied().filter(|z| z.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let mut scale = sorted.get(sorted.len() / 2).map_or(1.0, |median| SIGMA_PER_MAD * median);
    for _ in 0..10 {
        let sum: f64 = sorted.iter().map(|z| huber(z / scale, LASER_HUBER_SIGMAS).1 * z * z).sum();
        scale = (sum / sorted.len().max(1) as f64).sqrt();
    }
    if scale.is_finite() && scale > 0.0 { scale } else { 1.0 }
}

/// Depth range of the lit points with a margin; refuses boards that are all at one depth.
fn depth_range(scene: &Scene, laser: &[LaserObservation]) -> Result<DepthRangeMm, CalibrationError> {
    let mut depths: Vec<f64> = lit_points(scene, laser).iter().map(|p| p.hit_in_camera.z).collect();
    depths.sort_by(f64::total_cmp);
    let (near, far) = match (depths.first(), depths.last()) {
        (Some(near), Some(far)) => (*near, *far),
        _ => (0.0, 0.0),
    };
    let (span_mm, needed_mm) = (far - near, MIN_RELATIVE_DEPTH_SPAN * far);
    if span_mm < needed_mm {
        return Err(CalibrationError::NoDepthRange { span_mm, needed_mm });
    }
    let margin = DEPTH_RANGE_MARGIN * span_mm;
    Ok(DepthRangeMm { near_mm: near - margin, far_mm: far + margin })
}
