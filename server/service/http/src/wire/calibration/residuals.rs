//! What a calibration left unexplained, on the wire.

use app::calibrations::residuals::{OrderResiduals, Residuals};
use serde::Serialize;
use utoipa::ToSchema;

/// Residuals of a calibration over the picture.
#[derive(Debug, Serialize, ToSchema)]
pub struct ResidualsDto {
    /// Columns of the pictures.
    pub width_px: usize,
    /// Rows of the pictures.
    pub height_px: usize,
    /// Board corners of all pictures: u, v where seen; du, dv from where the camera expects it to there, px.
    pub corners: Vec<[f32; 4]>,
    /// Laser points by order, thinned for drawing.
    pub orders: Vec<OrderResidualsDto>,
}

/// Residuals of one order.
#[derive(Debug, Serialize, ToSchema)]
pub struct OrderResidualsDto {
    /// The order.
    pub order: i8,
    /// Number of the pose, from 0; u, v where seen; signed distance across the line from the curve that the light
    /// sheet predicts, px.
    pub points: Vec<[f32; 4]>,
}

impl From<Residuals> for ResidualsDto {
    fn from(residuals: Residuals) -> Self {
        let Residuals { width_px, height_px, corners, orders } = residuals;
        let of_order = |OrderResiduals { order, points }| OrderResidualsDto { order, points };
        Self { width_px, height_px, corners, orders: orders.into_iter().map(of_order).collect() }
    }
}
