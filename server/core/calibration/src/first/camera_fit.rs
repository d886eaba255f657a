//! The camera from board corners: initial estimate from homographies, bundle adjustment, noise level, decision on k3,
//! checks.

use nalgebra::{DMatrix, Vector2};
use optics::{CAMERA_PARAMETERS, Camera};

use crate::error::CalibrationError;
use crate::first::homography::homography_from_points;
use crate::first::zhang::{PinholeGuess, pinhole_from_homographies, pose_from_homography};
use crate::params::{
    CORNER_HUBER_SIGMAS, K3_SIGNIFICANCE, MAX_RELATIVE_FOCAL_SIGMA, MIN_CAMERA_VIEWS, MIN_TILT_SPREAD_RAD,
};
use crate::solving::bundle::Bundle;
use crate::solving::bundle_state::{BoardPose, BundleState};
use crate::solving::normal::ArrowNormal;
use crate::solving::observation::{CornerView, huber};
use crate::solving::prior::Priors;
use crate::solving::solver::{Minimum, Problem, Termination, minimise};

/// Index of k3 among the camera's parameters.
const K3: usize = 8;

/// σ of every corner in the plain fit: far below any noise, so that the solver ends by its relative tolerance.
const PLAIN_SIGMA_PX: f64 = 1e-4;

/// Focal lengths tried when the homographies give none, relative to the image's longer side.
const FOCAL_CANDIDATES: [f64; 5] = [0.8, 1.3, 2.0, 3.5, 6.0];

/// A fitted camera.
#[derive(Debug, Clone)]
pub struct CameraFit {
    /// Camera and one pose per view.
    pub station: BundleState,
    /// The views with σ scaled to the noise of the residuals.
    pub views: Vec<CornerView>,
    /// Which camera parameters were estimated.
    pub free: Vec<bool>,
    /// Covariance of the camera's parameters.
    pub covariance: DMatrix<f64>,
    /// The normal equations at the minimum, from which the boards' poses follow the camera.
    pub normal: ArrowNormal,
    /// Termination reason of the last fit.
    pub termination: Termination,
    /// RMS 2-D distance of all corners.
    pub rms_px: f64,
    /// Noise per axis, from the residuals.
    pub corner_sigma_px: f64,
    /// Why k3 is estimated or not.
    pub k3_reason: String,
    /// The priors used.
    pub priors: Priors,
}

/// Fits camera and poses to `views`; view i is block i.
///
/// `k3`: `Some(true)` estimates it, `Some(false)` fixes it at zero, `None` lets the data decide.
///
/// # Errors
/// Too few views, parallel boards, a focal length that the data do not determine, or a fit that did not converge.
pub fn fit_camera(
    width_px: usize,
    height_px: usize,
    views: Vec<CornerView>,
    k3: Option<bool>,
) -> Result<CameraFit, CalibrationError> {
    if views.len() < MIN_CAMERA_VIEWS {
        return Err(CalibrationError::TooFewViews { needed: MIN_CAMERA_VIEWS, got: views.len() });
    }
    let start = first_station(width_px, height_px, &views)?;
    let priors =
        Priors { camera: Priors::of_camera(width_px, height_px, start.camera.fx_px), ..Priors::default() };
    let mut free = vec![true; CAMERA_PARAMETERS];
    free[K3] = k3 == Some(true);
    let mut views = views;
    let mut minimum = solve(&views, &free, &priors, start)?;
    check_tilts(&minimum.state.poses)?;
    // Twice: the σ of the corners depends on their residuals, the robust limits on the σ.
    for _ in 0..2 {
        let ratio = noise_ratio(&minimum.state, &views, free.iter().filter(|f| **f).count());
        scale_sigmas(&mut views, ratio);
        minimum = solve(&views, &free, &priors, minimum.state)?;
    }
    let mut k3_reason = match k3 {
        Some(true) => "estimated as requested".to_owned(),
        Some(false) => "fixed at zero as requested".to_owned(),
        None => String::new(),
    };
    if k3.is_none() {
        (minimum, k3_reason) = decide_k3(&views, &mut free, &priors, minimum)?;
    }
    let bundle = bundle_of(&views, &free, &priors);
    let normal = bundle.linearise(&minimum.state);
    let covariance = normal.global_covariance(&free).ok_or(CalibrationError::CameraUnobservable)?;
    let Minimum { state: station, termination, .. } = minimum;
    check_focal(&station.camera, &covariance)?;
    let n_corners: usize = views.iter().map(|v| v.corners.len()).sum();
    let rms_px = (squared_residuals(&station, &views) / n_corners as f64).sqrt();
    let n_parameters = free.iter().filter(|f| **f).count() + 6 * views.len();
    let degrees = (2 * n_corners).saturating_sub(n_parameters).max(1);
    let corner_sigma_px = (squared_residuals(&station, &views) / degrees as f64).sqrt();
    Ok(CameraFit {
        station,
        views,
        free,
        covariance,
        normal,
        termination,
        rms_px,
        corner_sigma_px,
        k3_reason,
        priors,
    })
}

/// A camera by plain least squares.
#[derive(Debug, Clone)]
pub struct PlainCamera {
    /// Camera and one pose per view.
    pub station: BundleState,
    /// RMS 2-D distance of all corners.
    pub rms_px: f64,
    /// Steps of the solver.
    pub n_steps: usize,
}

/// Fits camera (k1, k2, p1, p2, k3) and poses with equal weights: no σ, no robust weights, no priors. This is the
/// minimum of OpenCV's `calibrateCamera`, for comparison; view i is block i.
///
/// # Errors
/// Too few views, or corners that do not determine the camera.
pub fn fit_camera_plain(
    width_px: usize,
    height_px: usize,
    mut views: Vec<CornerView>,
) -> Result<PlainCamera, CalibrationError> {
    if views.len() < MIN_CAMERA_VIEWS {
        return Err(CalibrationError::TooFewViews { needed: MIN_CAMERA_VIEWS, got: views.len() });
    }
    for corner in views.iter_mut().flat_map(|view| &mut view.corners) {
        corner.sigma_px = PLAIN_SIGMA_PX;
    }
    let start = first_station(width_px, height_px, &views)?;
    let bundle = bundle_of(&views, &[true; CAMERA_PARAMETERS], &Priors::default()).without_corner_limit();
    let minimum = minimise(&bundle, start)
        .filter(|minimum| minimum.cost.is_finite())
        .ok_or(CalibrationError::CameraUnobservable)?;
    let n_corners: usize = views.iter().map(|view| view.corners.len()).sum();
    let rms_px = (squared_residuals(&minimum.state, &views) / n_corners as f64).sqrt();
    Ok(PlainCamera { station: minimum.state, rms_px, n_steps: minimum.n_steps })
}

fn bundle_of(views: &[CornerView], free: &[bool], priors: &Priors) -> Bundle {
    Bundle::new(views.to_vec(), Vec::new(), free.to_vec(), true, priors.clone(), views.len())
}

fn solve(
    views: &[CornerView],
    free: &[bool],
    priors: &Priors,
    start: BundleState,
) -> Result<Minimum<BundleState>, CalibrationError> {
    let minimum = minimise(&bundle_of(views, free, priors), start)
        .filter(|minimum| minimum.cost.is_finite())
        .ok_or(CalibrationError::CameraUnobservable)?;
    match minimum.termination {
        Termination::NotConverged => Err(CalibrationError::NotConverged { fit: "camera" }),
        Termination::Gradient | Termination::Step | Termination::Cost => Ok(minimum),
    }
}

/// Initial camera and poses: the pinhole estimate from all homographies, or the best of a few focal lengths.
fn first_station(
    width_px: usize,
    height_px: usize,
    views: &[CornerView],
) -> Result<BundleState, CalibrationError> {
    let homographies: Vec<_> = views
        .iter()
        .map(|view| {
            let board: Vec<Vector2<f64>> = view.corners.iter().map(|c| c.board_mm.xy()).collect();
            let pixels: Vec<Vector2<f64>> = view.corners.iter().map(|c| c.pixel).collect();
            homography_from_points(&board, &pixels).ok_or(CalibrationError::CameraUnobservable)
        })
        .collect::<Result<_, _>>()?;
    let (cx_px, cy_px) = ((width_px as f64 - 1.0) / 2.0, (height_px as f64 - 1.0) / 2.0);
    let side = width_px.max(height_px) as f64;
    let guesses: Vec<PinholeGuess> = match pinhole_from_homographies(&homographies, cx_px, cy_px) {
        Some(guess) if (0.2 * side..50.0 * side).contains(&guess.focal_px) => vec![guess],
        _ => FOCAL_CANDIDATES.map(|ratio| PinholeGuess { focal_px: ratio * side, cx_px, cy_px }).to_vec(),
    };
    let starts = guesses.iter().filter_map(|guess| {
        let poses: Option<Vec<BoardPose>> = homographies.iter().map(|h| pose_from_homography(h, guess)).collect();
        let matrix = [[guess.focal_px, 0.0, cx_px], [0.0, guess.focal_px, cy_px], [0.0, 0.0, 1.0]];
        let camera = Camera::from_opencv(width_px, height_px, matrix, &[]);
        Some(BundleState { camera, light: None, stage: None, poses: poses? })
    });
    starts
        .map(|station| (squared_residuals(&station, views), station))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, station)| station)
        .ok_or(CalibrationError::CameraUnobservable)
}

/// Estimates k3 and keeps it only if it is significant.
fn decide_k3(
    views: &[CornerView],
    free: &mut [bool],
    priors: &Priors,
    without: Minimum<BundleState>,
) -> Result<(Minimum<BundleState>, String), CalibrationError> {
    free[K3] = true;
    let with = match solve(views, free, priors, without.state.clone()) {
        Err(CalibrationError::NotConverged { .. }) => {
            free[K3] = false;
            return Ok((without, "fixed at zero: a fit with it did not converge".to_owned()));
        }
        with => with?,
    };
    let sigma = bundle_of(views, free, priors)
        .linearise(&with.state)
        .global_covariance(free)
        .map_or(f64::INFINITY, |covariance| covariance[(K3, K3)].sqrt());
    let significance = with.state.camera.k3.abs() / sigma;
    let value = format!("k3 = {:.4} ± {:.4}", with.state.camera.k3, sigma);
    if significance >= K3_SIGNIFICANCE {
        return Ok((with, format!("estimated: {value} is {significance:.1} σ from zero")));
    }
    free[K3] = false;
    Ok((without, format!("fixed at zero: {value} would be {significance:.1} σ from zero")))
}

/// Residual noise over predicted noise, both as 1-σ.
fn noise_ratio(station: &BundleState, views: &[CornerView], n_globals: usize) -> f64 {
    let mut sum = 0.0;
    let mut n = 0usize;
    for (_, sigma_px, error) in residuals(station, views) {
        let z = error.norm() / sigma_px;
        // The Huber weight keeps gross errors from dominating the scale.
        sum += huber(z, CORNER_HUBER_SIGMAS).1 * z * z;
        n += 2;
    }
    let degrees = n.saturating_sub(n_globals + 6 * views.len()).max(1);
    (sum / degrees as f64).sqrt()
}

fn scale_sigmas(views: &mut [CornerView], ratio: f64) {
    if !(ratio.is_finite() && ratio > 0.0) {
        return;
    }
    for corner in views.iter_mut().flat_map(|view| &mut view.corners) {
        corner.sigma_px *= ratio;
    }
}

fn squared_residuals(station: &BundleState, views: &[CornerView]) -> f64 {
    residuals(station, views).map(|(_, _, error)| error.norm_squared()).sum()
}

/// (view index, σ, predicted − observed) of every corner; for a corner behind the camera the residual is the image's
/// size.
pub fn residuals<'a>(
    station: &'a BundleState,
    views: &'a [CornerView],
) -> impl Iterator<Item = (usize, f64, Vector2<f64>)> + 'a {
    views.iter().enumerate().flat_map(move |(view_idx, view)| {
        let pose = station.pose_of(view);
        view.corners.iter().map(move |corner| {
            let seen = station.camera.project(&(pose.rotation * corner.board_mm + pose.translation_mm));
            let lost = Vector2::new(station.camera.width_px as f64, station.camera.height_px as f64);
            (view_idx, corner.sigma_px, seen.map_or(lost, |pixel| pixel - corner.pixel))
        })
    })
}

fn check_tilts(poses: &[BoardPose]) -> Result<(), CalibrationError> {
    let normals: Vec<_> = poses.iter().map(|pose| pose.axes().column(2).into_owned()).collect();
    let mut spread_rad: f64 = 0.0;
    for (idx, a) in normals.iter().enumerate() {
        for b in &normals[idx + 1..] {
            spread_rad = spread_rad.max(a.dot(b).clamp(-1.0, 1.0).acos());
        }
    }
    if spread_rad < MIN_TILT_SPREAD_RAD {
        return Err(CalibrationError::BoardsParallel {
            spread_deg: spread_rad.to_degrees(),
            needed_deg: MIN_TILT_SPREAD_RAD.to_degrees(),
        });
    }
    Ok(())
}

fn check_focal(camera: &Camera, covariance: &DMatrix<f64>) -> Result<(), CalibrationError> {
    let sigma_px = covariance[(0, 0)].sqrt().max(covariance[(1, 1)].sqrt());
    if sigma_px > MAX_RELATIVE_FOCAL_SIGMA * camera.fx_px {
        return Err(CalibrationError::FocalUnobservable { focal_px: camera.fx_px, sigma_px });
    }
    Ok(())
}
