//! The results of a calibration as text and as JSON.

use std::fmt::Write as _;

use calibration::{AxisReport, CalibrationResult, CrossValidation, LightReport, StageReport};
use optics::CAMERA_PARAMETER_NAMES;
use serde_json::{Value, json};

use super::order_name;

/// The results as text.
pub fn calibration_text(result: &CalibrationResult, id: &str) -> String {
    let mut text = String::new();
    camera_text(&mut text, result);
    if let Some(light) = &result.report.light {
        light_text(&mut text, light);
    }
    if let Some(cross_validation) = &result.report.cross_validation {
        models_text(&mut text, cross_validation);
    }
    if let Some(stage) = &result.report.stage {
        stage_text(&mut text, stage);
    }
    if let Some(axis) = &result.report.axis {
        axis_text(&mut text, axis);
    }
    for warning in &result.report.warnings {
        let _ = writeln!(text, "\nnote: {warning}");
    }
    let _ = id;
    text
}

fn camera_text(text: &mut String, result: &CalibrationResult) {
    let camera = &result.report.camera;
    let n_corners: usize = camera.poses.iter().map(|pose| pose.n_corners).sum();
    let _ = writeln!(
        text,
        "camera   RMS {:.4} px over {} images, {n_corners} corners; corner noise {:.4} px per axis",
        camera.rms_px,
        camera.poses.len(),
        camera.corner_sigma_px
    );
    let values = result.calibration.camera.parameters();
    for ((name, value), sigma) in CAMERA_PARAMETER_NAMES.iter().zip(values).zip(camera.sigma) {
        let fixed = if sigma == 0.0 { "fixed".to_owned() } else { format!("± {sigma:.6}") };
        let _ = writeln!(text, "  {name:<6} {value:>14.6}  {fixed}");
    }
    let _ = writeln!(text, "  k3: {}", camera.k3_reason);
    let _ = writeln!(text, "  {}", camera.termination.sentence());
}

fn light_text(text: &mut String, light: &LightReport) {
    let n_points: usize = light.residuals.iter().map(|residual| residual.n_points).sum();
    let _ = writeln!(
        text,
        "\nlight    model {}, RMS {:.4} px over {n_points} points; systematic depth σ {:.1} µm",
        light.model,
        light.rms_px,
        light.systematic_sigma_mm * 1e3
    );
    let rejected = &light.rejections;
    let _ = writeln!(
        text,
        "  rejected: {} off the board, {} at square edges, {} unlabelled, {} outliers",
        rejected.off_board, rejected.square_edge, rejected.unlabelled, rejected.outlier
    );
    let _ = writeln!(text, "  {}", light.termination.sentence());
    if let Some([value, sigma, nominal]) = light.wavelength_over_period {
        let _ = writeln!(text, "  λ/d {value:.6} ± {sigma:.6} (nominal {nominal:.6})");
    }
    let _ = writeln!(
        text,
        "  {:<7}{:>9}{:>12}{:>11}{:>12}{:>10}",
        "order", "points", "mean px", "RMS px", "RMS/σ", "outliers"
    );
    for order in order_sums(light) {
        let _ = writeln!(
            text,
            "  {:<7}{:>9}{:>12.4}{:>11.4}{:>12.2}{:>10}",
            order_name(order.order),
            order.n_points,
            order.mean_px,
            order.rms_px,
            order.normalised_rms,
            order.n_outliers
        );
    }
}

fn models_text(text: &mut String, models: &CrossValidation) {
    let _ = writeln!(text, "\nmodels, error on held-out poses");
    let _ = writeln!(
        text,
        "  {:<9}{:>14}{:>14}{:>16}{:>12}",
        "", "held-out px", "held-out µm", "thereof bias µm", "fit px"
    );
    for score in &models.scores {
        let mark = if score.model == models.recommended { "← recommended" } else { "" };
        match &score.failure {
            Some(reason) => {
                let _ = writeln!(text, "  {:<9}not fitted: {reason}", score.model.name());
            }
            None => {
                let _ = writeln!(
                    text,
                    "  {:<9}{:>14.4}{:>14.1}{:>16.1}{:>12.4}  {mark}",
                    score.model.name(),
                    score.held_out_rms_px,
                    score.held_out_rms_mm * 1e3,
                    score.held_out_bias_mm * 1e3,
                    score.fit_rms_px
                );
            }
        }
    }
    let _ = writeln!(text, "  {}", models.reason);
}

fn stage_text(text: &mut String, stage: &StageReport) {
    let [x, y, z] = stage.direction;
    let [sx, sy, sz] = stage.sigma;
    let _ = writeln!(text, "\nstage    ({x:+.6}, {y:+.6}, {z:+.6}) ± ({sx:.6}, {sy:.6}, {sz:.6}) mm per mm");
    let _ = writeln!(
        text,
        "  scale error {:+.4} % ± {:.4} %, straightness {:.1} µm RMS over {} views, σ {:.1} µm per axis",
        stage.scale_error * 100.0,
        stage.scale_sigma * 100.0,
        stage.straightness_rms_um,
        stage.straightness_um.len(),
        stage.straightness_sigma_um
    );
    let [largest, middle, least] = stage.tilt_sigma_urad;
    let _ = writeln!(
        text,
        "  tilt (pitch, yaw, roll) σ {largest:.0}, {middle:.0}, {least:.0} µrad about its principal axes"
    );
}

fn axis_text(text: &mut String, axis: &AxisReport) {
    let [[px, py, pz], [dx, dy, dz]] = [axis.point_mm, axis.direction];
    let ([s1, s2], [t1, t2]) = (axis.shift_sigma_mm, axis.tilt_sigma_deg);
    let _ =
        writeln!(text, "\nturntable axis through ({px:+.4}, {py:+.4}, {pz:+.4}) mm ± {s1:.4}, {s2:.4} mm across");
    let _ = writeln!(text, "  along ({dx:+.6}, {dy:+.6}, {dz:+.6}) ± {t1:.4}°, {t2:.4}°");
    let angle = match (axis.angle_sigma_deg, axis.angle_sigma_stated) {
        (None, _) => "angles of unknown accuracy".to_owned(),
        (Some(sigma), true) => format!("angles ± {sigma:.4}° as stated"),
        (Some(sigma), false) => format!("angles ± {sigma:.4}° from the views"),
    };
    let _ = writeln!(
        text,
        "  {angle}; {} views deviate from a pure rotation by {:.2} times their noise",
        axis.deviations_um.len(),
        axis.noise_ratio
    );
}

/// Residuals of one order over all poses.
pub struct OrderSum {
    /// The order.
    pub order: i8,
    /// Points used.
    pub n_points: usize,
    /// Mean signed residual.
    pub mean_px: f64,
    /// RMS residual.
    pub rms_px: f64,
    /// RMS of residual over predicted σ.
    pub normalised_rms: f64,
    /// Outliers.
    pub n_outliers: usize,
}

/// Residuals per order, sorted by order.
pub fn order_sums(light: &LightReport) -> Vec<OrderSum> {
    let mut orders: Vec<i8> = light.residuals.iter().map(|residual| residual.order).collect();
    orders.sort_unstable();
    orders.dedup();
    orders
        .into_iter()
        .map(|order| {
            let of_order = || light.residuals.iter().filter(move |residual| residual.order == order);
            let n_points: usize = of_order().map(|residual| residual.n_points).sum();
            let mean = |value: &dyn Fn(&calibration::OrderResidual) -> f64| {
                of_order().map(|r| value(r) * r.n_points as f64).sum::<f64>() / n_points.max(1) as f64
            };
            OrderSum {
                order,
                n_points,
                mean_px: mean(&|r| r.mean_px),
                rms_px: mean(&|r| r.rms_px * r.rms_px).sqrt(),
                normalised_rms: mean(&|r| r.normalised_rms * r.normalised_rms).sqrt(),
                n_outliers: of_order().map(|residual| residual.n_outliers).sum(),
            }
        })
        .collect()
}

/// The results as JSON.
pub fn calibration_json(result: &CalibrationResult, id: &str) -> Value {
    let camera = &result.report.camera;
    let values = result.calibration.camera.parameters();
    let parameters: serde_json::Map<String, Value> = CAMERA_PARAMETER_NAMES
        .iter()
        .zip(values.iter().zip(camera.sigma))
        .map(|(name, (value, sigma))| ((*name).to_owned(), json!({ "value": value, "sigma": sigma })))
        .collect();
    let poses: Vec<Value> = camera
        .poses
        .iter()
        .map(|pose| json!({ "image": pose.name, "rms_px": pose.rms_px, "n_corners": pose.n_corners }))
        .collect();
    json!({
        "calibration_id": id,
        "camera": { "rms_px": camera.rms_px, "corner_sigma_px": camera.corner_sigma_px,
            "k3_reason": camera.k3_reason, "parameters": parameters, "images": poses },
        "light": result.report.light.as_ref().map(light_json),
        "models": result.report.cross_validation.as_ref().map(models_json),
        "stage": result.report.stage.as_ref().map(stage_json),
        "axis": result.report.axis.as_ref().map(axis_json),
        "warnings": result.report.warnings,
    })
}

fn light_json(light: &LightReport) -> Value {
    let residuals: Vec<Value> = light
        .residuals
        .iter()
        .map(|r| {
            json!({ "image": r.pose, "order": r.order, "n_points": r.n_points, "mean_px": r.mean_px,
                "rms_px": r.rms_px, "normalised_rms": r.normalised_rms, "n_outliers": r.n_outliers })
        })
        .collect();
    let rejected = &light.rejections;
    json!({
        "model": light.model.name(),
        "rms_px": light.rms_px,
        "systematic_sigma_mm": light.systematic_sigma_mm,
        "termination": light.termination.name(),
        "rejected": { "off_board": rejected.off_board, "square_edge": rejected.square_edge,
            "unlabelled": rejected.unlabelled, "outlier": rejected.outlier },
        "wavelength_over_period": light.wavelength_over_period.map(|[value, sigma, nominal]| {
            json!({ "value": value, "sigma": sigma, "nominal": nominal })
        }),
        "residuals": residuals,
    })
}

fn models_json(models: &CrossValidation) -> Value {
    let scores: Vec<Value> = models
        .scores
        .iter()
        .map(|s| {
            json!({ "model": s.model.name(), "held_out_rms_px": s.held_out_rms_px,
                "held_out_rms_mm": s.held_out_rms_mm, "held_out_bias_mm": s.held_out_bias_mm,
                "fit_rms_px": s.fit_rms_px, "failure": s.failure })
        })
        .collect();
    json!({ "scores": scores, "recommended": models.recommended.name(), "reason": models.reason })
}

fn stage_json(stage: &StageReport) -> Value {
    json!({ "direction": stage.direction, "sigma": stage.sigma, "scale_error": stage.scale_error,
        "scale_sigma": stage.scale_sigma, "straightness_rms_um": stage.straightness_rms_um,
        "straightness_sigma_um": stage.straightness_sigma_um, "straightness_um": stage.straightness_um,
        "tilt_sigma_urad": stage.tilt_sigma_urad, "tilt_urad": stage.tilt_urad })
}

fn axis_json(axis: &AxisReport) -> Value {
    json!({ "point_mm": axis.point_mm, "direction": axis.direction, "shift_sigma_mm": axis.shift_sigma_mm,
        "tilt_sigma_deg": axis.tilt_sigma_deg, "angle_sigma_deg": axis.angle_sigma_deg,
        "angle_sigma_stated": axis.angle_sigma_stated, "noise_ratio": axis.noise_ratio,
        "deviations_um": axis.deviations_um })
}
