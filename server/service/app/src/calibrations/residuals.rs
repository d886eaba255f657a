//! What a calibration left unexplained, point by point: the dots of residual maps.

use std::collections::BTreeMap;

use calibration::CalibrationReport;
use optics::Camera;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Residuals of a calibration over the picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Residuals {
    /// Columns of the pictures.
    pub width_px: usize,
    /// Rows of the pictures.
    pub height_px: usize,
    /// Board corners of all pictures: u, v where seen; du, dv from where the camera expects it to there, px.
    pub corners: Vec<[f32; 4]>,
    /// Laser points by order, thinned for drawing.
    pub orders: Vec<OrderResiduals>,
}

/// Residuals of one order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OrderResiduals {
    /// The order.
    pub order: i8,
    /// Number of the pose, from 0; u, v where seen; signed distance across the line from the curve that the light
    /// sheet predicts, px.
    pub points: Vec<[f32; 4]>,
}

impl Residuals {
    /// The residuals of a report on `camera`.
    pub fn of(report: &CalibrationReport, camera: &Camera) -> Self {
        let corners = report.camera.poses.iter().flat_map(|pose| &pose.residuals_px);
        let mut by_order: BTreeMap<i8, Vec<[f32; 4]>> = BTreeMap::new();
        for point in report.light.iter().flat_map(|light| &light.points) {
            let seen =
                [point.pose_idx as f64, point.u_px, point.v_px, point.residual_px].map(|value| value as f32);
            by_order.entry(point.order).or_default().push(seen);
        }
        Self {
            width_px: camera.width_px,
            height_px: camera.height_px,
            corners: corners.map(|corner| corner.map(|value| value as f32)).collect(),
            orders: by_order.into_iter().map(|(order, points)| OrderResiduals { order, points }).collect(),
        }
    }
}
