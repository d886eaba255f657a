//! The difference of two calibrations on the wire.

use calibration::{CalibrationDifference, DepthDifference, OrderDifference};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// With which other calibration.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct DiffQuery {
    /// Id of the other one.
    pub with: String,
}

/// How far one calibration reads from another, over the working volume of the first.
#[derive(Debug, Serialize, ToSchema)]
pub struct DifferenceDto {
    /// The first.
    pub calibration_id: String,
    /// The second; differences are second minus first.
    pub with: String,
    /// Columns of the grids.
    pub columns: usize,
    /// Rows of the grids.
    pub rows: usize,
    /// All orders together.
    pub total: DepthDifferenceDto,
    /// Per order that both know.
    pub orders: Vec<OrderDifferenceDto>,
}

/// Differences in depth over many pixels.
#[derive(Debug, Serialize, ToSchema)]
pub struct DepthDifferenceDto {
    /// Pixels compared.
    pub n_pixels: usize,
    /// Mean, signed.
    pub mean_mm: f64,
    /// Root of the mean square.
    pub rms_mm: f64,
    /// The largest, signed.
    pub max_mm: f64,
    /// Where that is: order.
    pub worst_order: i8,
    /// Where that is: column and row of the pixel.
    pub worst_px: [f64; 2],
    /// Where that is: depth by the first.
    pub worst_depth_mm: f64,
}

/// The difference on the line of one order.
#[derive(Debug, Serialize, ToSchema)]
pub struct OrderDifferenceDto {
    /// The order.
    pub order: i8,
    /// All its pixels together.
    pub total: DepthDifferenceDto,
    /// Row by row over the grid; nothing outside the working volume.
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

impl DifferenceDto {
    /// The difference of the two.
    pub fn new(calibration_id: String, with: String, difference: CalibrationDifference) -> Self {
        let order = |order: OrderDifference| OrderDifferenceDto {
            order: order.order,
            total: (&order.total).into(),
            depth_mm: order.depth_mm,
        };
        Self {
            calibration_id,
            with,
            columns: difference.columns,
            rows: difference.rows,
            total: (&difference.total).into(),
            orders: difference.orders.into_iter().map(order).collect(),
        }
    }
}
