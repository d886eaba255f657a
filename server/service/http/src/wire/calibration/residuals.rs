//! Residuals of a calibration on the wire.

use app::calibrations::residuals::{OrderResiduals, Residuals};
use serde::Serialize;
use utoipa::ToSchema;

/// Residuals of a calibration over the image.
#[derive(Debug, Serialize, ToSchema)]
pub struct ResidualsDto {
    /// Image width.
    pub width_px: usize,
    /// Image height.
    pub height_px: usize,
    /// Board corners of all images: detected u, v and reprojection error du, dv (detected minus predicted), px.
    pub corners: Vec<[f32; 4]>,
    /// Laser points by order, subsampled for display.
    pub orders: Vec<OrderResidualsDto>,
}

/// Residuals of one order.
#[derive(Debug, Serialize, ToSchema)]
pub struct OrderResidualsDto {
    /// The order.
    pub order: i8,
    /// Index of the pose, from 0; detected u, v; signed distance from the curve predicted by the light sheet,
    /// perpendicular to the line, px.
    pub points: Vec<[f32; 4]>,
}

impl From<Residuals> for ResidualsDto {
    fn from(residuals: Residuals) -> Self {
        let Residuals { width_px, height_px, corners, orders } = residuals;
        let of_order = |OrderResiduals { order, points }| OrderResidualsDto { order, points };
        Self { width_px, height_px, corners, orders: orders.into_iter().map(of_order).collect() }
    }
}
