//! The report of a calibration.

use optics::LightModelKind;

use crate::solving::solver::Termination;

/// The whole report.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationReport {
    /// Camera fit.
    pub camera: CameraReport,
    /// Light fit of the chosen model; `None` without laser images.
    pub light: Option<LightReport>,
    /// Comparison of the three models; `None` without laser images.
    pub cross_validation: Option<CrossValidation>,
    /// Stage fit; `None` without stage views.
    pub stage: Option<StageReport>,
    /// Axis of a turntable; `None` without views of one.
    pub axis: Option<AxisReport>,
    /// Warnings for the operator.
    pub warnings: Vec<String>,
}

/// Camera fit over all board images.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraReport {
    /// RMS distance between observed and predicted corners (2-D), as in OpenCV.
    pub rms_px: f64,
    /// Per image.
    pub poses: Vec<PoseResidual>,
    /// One-σ of fx, fy, cx, cy, k1, k2, p1, p2, k3 (0 for a fixed one).
    pub sigma: [f64; 9],
    /// Whether k3 was estimated, and why.
    pub k3_reason: String,
    /// Corner noise per axis as estimated from the residuals.
    pub corner_sigma_px: f64,
    /// Termination reason of the camera's fit.
    pub termination: Termination,
}

/// Corner residuals of one image.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseResidual {
    /// The image.
    pub name: String,
    /// RMS distance, 2-D.
    pub rms_px: f64,
    /// Corners used.
    pub n_corners: usize,
    /// Observed corner (u, v) and residual (du, dv), for maps.
    pub residuals_px: Vec<[f64; 4]>,
}

/// Light fit of the chosen model.
#[derive(Debug, Clone, PartialEq)]
pub struct LightReport {
    /// The model.
    pub model: LightModelKind,
    /// RMS distance of the centreline points to their predicted curves.
    pub rms_px: f64,
    /// Per pose and order.
    pub residuals: Vec<OrderResidual>,
    /// Rejected points, by reason, over all poses.
    pub rejections: Rejections,
    /// Points of the fit, thinned for plots.
    pub points: Vec<LaserPoint>,
    /// Estimated λ/d_g, its σ, and the nominal value.
    pub wavelength_over_period: Option<[f64; 3]>,
    /// Predicted systematic depth σ over the working volume, RMS, mm.
    pub systematic_sigma_mm: f64,
    /// Termination reason of the last fit of the light: the joint refinement's, or the light's own for the plane
    /// models.
    pub termination: Termination,
}

/// Residuals of one order in one pose.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderResidual {
    /// The image.
    pub pose: String,
    /// The order.
    pub order: i8,
    /// Points used.
    pub n_points: usize,
    /// Mean signed residual.
    pub mean_px: f64,
    /// RMS residual.
    pub rms_px: f64,
    /// RMS of residual / predicted σ.
    pub normalised_rms: f64,
    /// Points rejected as outliers of the fit.
    pub n_outliers: usize,
}

/// Unused centreline points, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rejections {
    /// Not on the board's pattern.
    pub off_board: usize,
    /// Close to an edge between a dark and a bright square.
    pub square_edge: usize,
    /// On a segment that could not be labelled reliably.
    pub unlabelled: usize,
    /// Too far from the fitted surface.
    pub outlier: usize,
}

/// One point of the light fit, for plots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserPoint {
    /// Index into the poses.
    pub pose_idx: usize,
    /// Its order.
    pub order: i8,
    /// Column.
    pub u_px: f64,
    /// Row.
    pub v_px: f64,
    /// Signed residual along the line's normal.
    pub residual_px: f64,
}

/// Held-out error of the models, by cross-validation over poses.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossValidation {
    /// One score per model, simplest first.
    pub scores: Vec<ModelScore>,
    /// The recommended model.
    pub recommended: LightModelKind,
    /// Reason for the recommendation, as a sentence.
    pub reason: String,
}

/// Held-out error of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelScore {
    /// The model.
    pub model: LightModelKind,
    /// RMS distance of held-out points to the predicted curves.
    pub held_out_rms_px: f64,
    /// The same as depth, along the camera ray.
    pub held_out_rms_mm: f64,
    /// Held-out RMS with each pose's smooth trend kept: mean of squares of per-pose-and-order means (bias part), mm.
    pub held_out_bias_mm: f64,
    /// RMS on the poses used for the fit.
    pub fit_rms_px: f64,
    /// Why the model could not be fitted, if it could not.
    pub failure: Option<String>,
}

/// Stage fit.
#[derive(Debug, Clone, PartialEq)]
pub struct StageReport {
    /// Direction vector per mm of travel in the camera frame.
    pub direction: [f64; 3],
    /// One-σ of each component.
    pub sigma: [f64; 3],
    /// Length − 1: the scale error.
    pub scale_error: f64,
    /// One-σ of the scale error.
    pub scale_sigma: f64,
    /// Per view: position, and deviation from the straight line (along, and two across), µm.
    pub straightness_um: Vec<[f64; 4]>,
    /// RMS deviation across the travel, µm.
    pub straightness_rms_um: f64,
    /// One-σ, per axis, of the deviation from straight and uniform travel: a contribution to every uncertainty along
    /// it, µm.
    pub straightness_sigma_um: f64,
    /// Per view: position, and rotation from the mean (about the travel, and about two axes across), µrad.
    pub tilt_urad: Vec<[f64; 4]>,
    /// One-σ of the rotation about its three principal axes, largest first, µrad: times the distance from the path of the
    /// board, the Abbe error.
    pub tilt_sigma_urad: [f64; 3],
}

/// Axis of a turntable.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisReport {
    /// The point of the axis nearest to the boards, camera frame.
    pub point_mm: [f64; 3],
    /// Unit vector about which increasing angles rotate the part by the right-hand rule, camera frame.
    pub direction: [f64; 3],
    /// One-σ of the direction, along the two vectors across it.
    pub tilt_sigma_deg: [f64; 2],
    /// One-σ of the point, along the same two vectors.
    pub shift_sigma_mm: [f64; 2],
    /// One-σ of the table's angles; `None` if unknown.
    pub angle_sigma_deg: Option<f64>,
    /// Whether this σ was specified; otherwise it was estimated from the views.
    pub angle_sigma_stated: bool,
    /// Per view: angle in degrees, and deviation of the board's middle from a pure rotation (along the rotation,
    /// radially, along the axis), µm.
    pub deviations_um: Vec<[f64; 4]>,
    /// RMS of the boards' deviations relative to their noise and the angle's σ.
    pub noise_ratio: f64,
}
