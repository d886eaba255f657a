//! Residuals of a calibration, point by point, for residual maps.

use std::collections::BTreeMap;

use calibration::CalibrationReport;
use optics::Camera;
use serde::{Deserialize, Serialize};
use store::{ArtifactId, Artifacts, CalibrationRecord};

use crate::error::{AppError, ErrorKind};

/// Key of the residuals artifact in the summary of a calibration.
pub const RESIDUALS: &str = "residuals";

/// Residuals of a calibration over the image.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Image width.
    pub width_px: usize,
    /// Image height.
    pub height_px: usize,
    /// Board corners of all images: detected u, v and reprojection error du, dv (detected minus predicted), px.
    pub corners: Vec<[f32; 4]>,
    /// Laser points by order, subsampled for display.
    pub orders: Vec<OrderResiduals>,
}

/// Residuals of one order.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderResiduals {
    /// The order.
    pub order: i8,
    /// Index of the pose, from 0; detected u, v; signed distance from the curve predicted by the light sheet,
    /// perpendicular to the line, px.
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

    /// The stored form.
    pub fn to_stored(&self) -> Vec<u8> {
        let of_order = |of: &OrderResiduals| StoredOrder { order: of.order, points: of.points.clone() };
        let stored = StoredResiduals {
            width_px: self.width_px,
            height_px: self.height_px,
            corners: self.corners.clone(),
            orders: self.orders.iter().map(of_order).collect(),
        };
        serde_json::to_vec(&stored).expect("residuals are numbers")
    }

    /// From the stored form.
    ///
    /// # Errors
    /// If it has another form.
    pub fn from_stored(stored: &[u8]) -> Result<Self, serde_json::Error> {
        let StoredResiduals { width_px, height_px, corners, orders } = serde_json::from_slice(stored)?;
        let of_order = |StoredOrder { order, points }| OrderResiduals { order, points };
        Ok(Self { width_px, height_px, corners, orders: orders.into_iter().map(of_order).collect() })
    }
}

/// The stored form of [`Residuals`].
#[derive(Debug, Serialize, Deserialize)]
struct StoredResiduals {
    width_px: usize,
    height_px: usize,
    corners: Vec<[f32; 4]>,
    orders: Vec<StoredOrder>,
}

#[derive(Debug, Serialize, Deserialize)]
struct StoredOrder {
    order: i8,
    points: Vec<[f32; 4]>,
}

/// The stored residuals of a calibration.
///
/// # Errors
/// A problem if it has none or they are damaged.
pub async fn stored_residuals(
    artifacts: &dyn Artifacts,
    calibration: &CalibrationRecord,
) -> Result<Residuals, AppError> {
    let kept = calibration.summary[RESIDUALS].as_str().and_then(ArtifactId::parse).ok_or_else(|| {
        AppError::new(ErrorKind::NotFound, "this calibration has no stored residuals").remedy("calibrate again")
    })?;
    let what = format!("the residuals of calibration {}", calibration.id);
    let bytes = artifacts.read(&kept).await.map_err(|error| AppError::from(error).of_stored(&what))?;
    Residuals::from_stored(&bytes).map_err(|cause| AppError::damaged(&what, cause.to_string()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn the_stored_form_of_version_0_1_is_read_and_written() {
        let stored = br#"{"width_px":1280,"height_px":1024,"corners":[[1.5,2.0,0.25,-0.5]],"orders":[{"order":-1,"points":[[0.0,3.0,4.0,0.125]]}]}"#;
        let residuals = Residuals::from_stored(stored).unwrap();
        assert_eq!((residuals.height_px, residuals.corners[0]), (1024, [1.5, 2.0, 0.25, -0.5]));
        assert_eq!((residuals.orders[0].order, residuals.orders[0].points[0][3]), (-1, 0.125));
        assert_eq!(residuals.to_stored(), stored);
        assert!(Residuals::from_stored(b"{}").is_err());
    }
}
