//! Validity checks of a parsed document.

use nalgebra::Vector3;
use optics::stage::AngleError;

use crate::document::text::{CalibrationText, StageText};
use crate::document::{DocumentError, FORMAT};

/// Rounding of a unit vector converted to text.
const UNIT_TOLERANCE: f64 = 1e-6;

impl CalibrationText {
    pub(super) fn check(&self) -> Result<(), DocumentError> {
        if self.format != FORMAT {
            return Err(DocumentError::Format { found: self.format.clone() });
        }
        let wrong = |entry, problem| Err(DocumentError::Entry { entry, problem });
        let camera = &self.camera;
        if camera.width_px == 0 || camera.height_px == 0 {
            return wrong("camera.width_px", "must be positive, like height_px");
        }
        if !(camera.fx_px > 0.0 && camera.fy_px > 0.0) {
            return wrong("camera.fx_px", "must be positive, like fy_px");
        }
        if self.orders.is_empty() {
            return wrong("orders", "lists no order");
        }
        let depths = &self.depth_range;
        if !(depths.near_mm >= 0.0 && depths.far_mm >= depths.near_mm) {
            return wrong("depth_range", "must have 0 ≤ near_mm ≤ far_mm");
        }
        if let Some(StageText::Rotary(axis)) = &self.stage {
            let length = Vector3::from(axis.direction).norm();
            if !((length - 1.0).abs() < UNIT_TOLERANCE && axis.point_mm.iter().all(|value| value.is_finite())) {
                return wrong("stage.direction", "must be of length 1, and stage.point_mm finite");
            }
            if axis.angle_sigma_deg.is_some_and(|sigma_deg| AngleError::new(sigma_deg).is_none()) {
                return wrong("stage.angle_sigma_deg", "must be above 0");
            }
        }
        if let Some(StageText::Linear(travel)) = &self.stage {
            if travel.straightness.as_ref().is_some_and(|straightness| straightness.value().is_none()) {
                return wrong("stage.straightness", "must have sigma_mm > 0, last_mm > first_mm and n_nodes ≥ 2");
            }
            if travel.tilt.as_ref().is_some_and(|tilt| tilt.value().is_none()) {
                return wrong(
                    "stage.tilt",
                    "must have a sigmas_rad other than 0, last_mm > first_mm and n_nodes ≥ 2",
                );
            }
        }
        let n = self.light.parameters()
            + optics::CAMERA_PARAMETERS
            + self.stage.as_ref().map_or(0, |stage| stage.value().parameters());
        let rows = &self.covariance.matrix;
        if rows.len() != n || rows.iter().any(|row| row.len() != n) {
            return wrong("covariance.matrix", "does not have one row and column per parameter");
        }
        Ok(())
    }
}
