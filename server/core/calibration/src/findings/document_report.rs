//! The report as stored in the calibration document: without the point lists, which are only plotted.

use serde::{Deserialize, Serialize};

use crate::findings::report::{
    AxisReport, CalibrationReport, CameraReport, CrossValidation, LightReport, StageReport,
};

/// Summary of the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ReportText {
    pub camera: CameraSummary,
    pub light: Option<LightSummary>,
    pub cross_validation: Option<CrossValidationSummary>,
    pub stage: Option<StageSummary>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<AxisSummary>,
    pub warnings: Vec<String>,
}

/// Camera fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct CameraSummary {
    pub rms_px: f64,
    pub corner_sigma_px: f64,
    /// Termination reason of the fit: `gradient`, `step` or `cost`; absent in documents of versions that did not state
    /// it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub termination: Option<String>,
    pub k3: String,
    /// One-σ of fx, fy, cx, cy, k1, k2, p1, p2, k3.
    pub sigma: [f64; 9],
    pub views: Vec<ViewSummary>,
}

/// One image of the board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ViewSummary {
    pub name: String,
    pub rms_px: f64,
    pub n_corners: usize,
}

/// Light fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct LightSummary {
    pub model: String,
    pub rms_px: f64,
    pub systematic_sigma_mm: f64,
    /// As for the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub termination: Option<String>,
    /// Estimate, one-σ, nominal value; absent for `planes`.
    pub wavelength_over_period: Option<[f64; 3]>,
    pub lines: Vec<LineSummary>,
    pub rejected_off_board: usize,
    pub rejected_square_edge: usize,
    pub rejected_unlabelled: usize,
    pub rejected_outlier: usize,
}

/// One order on one board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct LineSummary {
    pub pose: String,
    pub order: i8,
    pub n_points: usize,
    pub mean_px: f64,
    pub rms_px: f64,
    pub normalised_rms: f64,
    pub n_outliers: usize,
}

/// Comparison of the models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct CrossValidationSummary {
    pub models: Vec<ModelSummary>,
    pub recommended: String,
    pub reason: String,
}

/// Held-out error of one model; values are absent if it could not be fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ModelSummary {
    pub model: String,
    pub held_out_rms_px: Option<f64>,
    pub held_out_rms_mm: Option<f64>,
    pub held_out_bias_mm: Option<f64>,
    pub fit_rms_px: Option<f64>,
    pub failure: Option<String>,
}

/// Stage fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct StageSummary {
    pub sigma: [f64; 3],
    pub scale_error: f64,
    pub scale_sigma: f64,
    pub straightness_rms_um: f64,
    /// Position in mm; deviation along, and two across, in µm.
    pub straightness: Vec<[f64; 4]>,
}

/// Axis of a turntable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct AxisSummary {
    pub tilt_sigma_deg: [f64; 2],
    pub shift_sigma_mm: [f64; 2],
    pub angle_sigma_deg: Option<f64>,
    pub angle_sigma_stated: bool,
    pub noise_ratio: f64,
    /// Angle in degrees; deviation along the turn, radially and along the axis, in µm.
    pub deviations: Vec<[f64; 4]>,
}

impl ReportText {
    /// The summary of a report.
    pub fn of(report: &CalibrationReport) -> Self {
        Self {
            camera: camera_summary(&report.camera),
            light: report.light.as_ref().map(light_summary),
            cross_validation: report.cross_validation.as_ref().map(cross_validation_summary),
            stage: report.stage.as_ref().map(stage_summary),
            axis: report.axis.as_ref().map(axis_summary),
            warnings: report.warnings.clone(),
        }
    }
}

fn camera_summary(camera: &CameraReport) -> CameraSummary {
    let views = camera
        .poses
        .iter()
        .map(|pose| ViewSummary { name: pose.name.clone(), rms_px: pose.rms_px, n_corners: pose.n_corners })
        .collect();
    CameraSummary {
        rms_px: camera.rms_px,
        corner_sigma_px: camera.corner_sigma_px,
        termination: Some(camera.termination.name().to_owned()),
        k3: camera.k3_reason.clone(),
        sigma: camera.sigma,
        views,
    }
}

fn light_summary(light: &LightReport) -> LightSummary {
    let lines = light
        .residuals
        .iter()
        .map(|line| LineSummary {
            pose: line.pose.clone(),
            order: line.order,
            n_points: line.n_points,
            mean_px: line.mean_px,
            rms_px: line.rms_px,
            normalised_rms: line.normalised_rms,
            n_outliers: line.n_outliers,
        })
        .collect();
    LightSummary {
        model: light.model.name().to_owned(),
        rms_px: light.rms_px,
        systematic_sigma_mm: light.systematic_sigma_mm,
        termination: Some(light.termination.name().to_owned()),
        wavelength_over_period: light.wavelength_over_period,
        lines,
        rejected_off_board: light.rejections.off_board,
        rejected_square_edge: light.rejections.square_edge,
        rejected_unlabelled: light.rejections.unlabelled,
        rejected_outlier: light.rejections.outlier,
    }
}

fn cross_validation_summary(comparison: &CrossValidation) -> CrossValidationSummary {
    let finite = |value: f64| value.is_finite().then_some(value);
    let models = comparison
        .scores
        .iter()
        .map(|score| ModelSummary {
            model: score.model.name().to_owned(),
            held_out_rms_px: finite(score.held_out_rms_px),
            held_out_rms_mm: finite(score.held_out_rms_mm),
            held_out_bias_mm: finite(score.held_out_bias_mm),
            fit_rms_px: finite(score.fit_rms_px),
            failure: score.failure.clone(),
        })
        .collect();
    CrossValidationSummary {
        models,
        recommended: comparison.recommended.name().to_owned(),
        reason: comparison.reason.clone(),
    }
}

fn stage_summary(stage: &StageReport) -> StageSummary {
    StageSummary {
        sigma: stage.sigma,
        scale_error: stage.scale_error,
        scale_sigma: stage.scale_sigma,
        straightness_rms_um: stage.straightness_rms_um,
        straightness: stage.straightness_um.clone(),
    }
}

fn axis_summary(axis: &AxisReport) -> AxisSummary {
    AxisSummary {
        tilt_sigma_deg: axis.tilt_sigma_deg,
        shift_sigma_mm: axis.shift_sigma_mm,
        angle_sigma_deg: axis.angle_sigma_deg,
        angle_sigma_stated: axis.angle_sigma_stated,
        noise_ratio: axis.noise_ratio,
        deviations: axis.deviations_um.clone(),
    }
}
