//! The difference of two calibrations on the wire.

use calibration::{CalibrationDifference, DepthDifference, OrderDifference};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// Selects the calibration to compare with.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct DiffQuery {
    /// Id of the other calibration.
    pub with: String,
}

/// Depth difference of two calibrations over the working volume of the first.
#[derive(Debug, Serialize, ToSchema)]
pub struct CalibrationDifferenceDto {
    /// The first calibration.
    pub calibration_id: String,
    /// The second calibration; differences are second minus first.
    pub other_calibration_id: String,
    /// Number of grid columns.
    pub columns: usize,
    /// Number of grid rows.
    pub rows: usize,
    /// Statistics over all orders.
    pub total: DepthDifferenceDto,
    /// Per order that both calibrations have.
    pub orders: Vec<OrderDifferenceDto>,
}

/// Statistics of depth differences over many pixels.
#[derive(Debug, Serialize, ToSchema)]
pub struct DepthDifferenceDto {
    /// Number of pixels compared.
    pub n_pixels: usize,
    /// Signed mean.
    pub mean_mm: f64,
    /// Root mean square.
    pub rms_mm: f64,
    /// Largest difference, signed.
    pub max_mm: f64,
    /// Location of the largest difference: order.
    pub worst_order: i8,
    /// Location of the largest difference: column and row of the pixel.
    pub worst_px: [f64; 2],
    /// Location of the largest difference: depth measured with the first calibration.
    pub worst_depth_mm: f64,
}

/// Depth difference of one order.
#[derive(Debug, Serialize, ToSchema)]
pub struct OrderDifferenceDto {
    /// The order.
    pub order: i8,
    /// Statistics over all its pixels.
    pub total: DepthDifferenceDto,
    /// Grid, row by row; null outside the working volume.
    pub depth_mm: Vec<Option<f64>>,
}

impl From<&DepthDifference> for DepthDifferenceDto {
    fn from(difference: &DepthDifference) -> Self {
        Self {
            n_pixels: difference.n_pixels,
            mean_mm: difference.mean_mm,
            rms_mm: difference.rms_mm,
            max_mm: difference.max_mm,
            worst_order: difference.worst.order,
            worst_px: [difference.worst.u_px, difference.worst.v_px],
            worst_depth_mm: difference.worst.depth_mm,
        }
    }
}

impl CalibrationDifferenceDto {
    /// The difference of the two.
    pub fn new(calibration_id: String, other_calibration_id: String, difference: CalibrationDifference) -> Self {
        let order = |order: OrderDifference| OrderDifferenceDto {
            order: order.order,
            total: (&order.total).into(),
            depth_mm: order.depth_mm,
        };
        Self {
            calibration_id,
            other_calibration_id,
            columns: difference.columns,
            rows: difference.rows,
            total: (&difference.total).into(),
            orders: difference.orders.into_iter().map(order).collect(),
        }
    }
}
