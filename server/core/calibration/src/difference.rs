//! Difference of two calibrations of one station, in millimetres, over the measuring volume.
//!
//! Definition and limits: `server/docs/maths/calibration.md`, section "Difference of two calibrations".

use std::borrow::Cow;

use nalgebra::Vector2;
use optics::Calibration;
use remedy::Remedy;

/// Columns and rows of the grid of pixels at which depths are compared: finer than the structure of any distortion.
pub const GRID: (usize, usize) = (64, 48);

/// Why two calibrations cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DifferenceError {
    /// The images have different sizes.
    #[error(
        "one calibration is for images of {one_width_px}×{one_height_px} pixels, the other for \
         {other_width_px}×{other_height_px}"
    )]
    ImageSizeMismatch {
        /// Columns of the first.
        one_width_px: usize,
        /// Rows of the first.
        one_height_px: usize,
        /// Columns of the second.
        other_width_px: usize,
        /// Rows of the second.
        other_height_px: usize,
    },
    /// No pixel has a depth from both within the working volume of the first.
    #[error("the calibrations have no order in common within the working volume")]
    NoCommonOrder,
}

impl Remedy for DifferenceError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::ImageSizeMismatch { .. } => "compare calibrations of one camera at one resolution",
            Self::NoCommonOrder => "compare calibrations of one station",
        }))
    }
}

/// Pixel with the largest difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LargestDifference {
    /// Order of the line.
    pub order: i8,
    /// Column of the pixel.
    pub u_px: f64,
    /// Row of the pixel.
    pub v_px: f64,
    /// Depth there by the first calibration.
    pub depth_mm: f64,
}

/// Depth differences over many pixels, second minus first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthDifference {
    /// Pixels compared.
    pub n_pixels: usize,
    /// Mean, signed.
    pub mean_mm: f64,
    /// Root of the mean square.
    pub rms_mm: f64,
    /// The difference of largest magnitude, signed.
    pub max_mm: f64,
    /// Where it occurs.
    pub worst: LargestDifference,
}

/// The difference on the line of one order.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderDifference {
    /// The order.
    pub order: i8,
    /// All its pixels together.
    pub total: DepthDifference,
    /// Row by row over [`GRID`]: depth of the second minus depth of the first, mm; `None` outside the working volume.
    pub depth_mm: Vec<Option<f64>>,
}

/// The difference of two calibrations.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationDifference {
    /// Columns of the grids.
    pub columns: usize,
    /// Rows of the grids.
    pub rows: usize,
    /// All orders together.
    pub total: DepthDifference,
    /// Per common order, in the first one's sequence.
    pub orders: Vec<OrderDifference>,
}

/// Compares the depths that `one` and `other` give for the same pixels, within the depth range of `one`.
///
/// # Errors
/// [`DifferenceError`] if no pixel can be compared.
pub fn difference(one: &Calibration, other: &Calibration) -> Result<CalibrationDifference, DifferenceError> {
    let size = |calibration: &Calibration| (calibration.camera.width_px, calibration.camera.height_px);
    if size(one) != size(other) {
        let ((one_width_px, one_height_px), (other_width_px, other_height_px)) = (size(one), size(other));
        return Err(DifferenceError::ImageSizeMismatch {
            one_width_px,
            one_height_px,
            other_width_px,
            other_height_px,
        });
    }
    let (mut all, mut orders) = (Sum::default(), Vec::new());
    for &order in one.orders.iter().filter(|order| other.orders.contains(order)) {
        let mut of_order = Sum::default();
        let depth_mm = pixels(one).map(|pixel| compare(one, other, order, &pixel, &mut of_order)).collect();
        if let Some(total) = of_order.total() {
            all.join(&of_order);
            orders.push(OrderDifference { order, total, depth_mm });
        }
    }
    let total = all.total().ok_or(DifferenceError::NoCommonOrder)?;
    Ok(CalibrationDifference { columns: GRID.0, rows: GRID.1, total, orders })
}

/// The middles of the grid's cells, row by row.
fn pixels(calibration: &Calibration) -> impl Iterator<Item = Vector2<f64>> {
    let (width, height) = (calibration.camera.width_px as f64, calibration.camera.height_px as f64);
    let middle = |idx: usize, count: usize, side: f64| (idx as f64 + 0.5) * side / count as f64 - 0.5;
    (0..GRID.1).flat_map(move |row| {
        (0..GRID.0).map(move |column| Vector2::new(middle(column, GRID.0, width), middle(row, GRID.1, height)))
    })
}

fn compare(one: &Calibration, other: &Calibration, order: i8, pixel: &Vector2<f64>, sum: &mut Sum) -> Option<f64> {
    let depth_mm = one.triangulate(order, pixel, None)?.hit.depth_mm;
    if !one.depth_range_mm.contains(depth_mm) {
        return None;
    }
    let difference_mm = other.triangulate(order, pixel, None)?.hit.depth_mm - depth_mm;
    sum.add(difference_mm, LargestDifference { order, u_px: pixel.x, v_px: pixel.y, depth_mm });
    Some(difference_mm)
}

#[derive(Default)]
struct Sum {
    n_pixels: usize,
    sum_mm: f64,
    squares_mm2: f64,
    worst: Option<(f64, LargestDifference)>,
}

impl Sum {
    fn add(&mut self, difference_mm: f64, place: LargestDifference) {
        self.n_pixels += 1;
        self.sum_mm += difference_mm;
        self.squares_mm2 += difference_mm * difference_mm;
        self.keep_worst(difference_mm, place);
    }

    fn join(&mut self, other: &Self) {
        self.n_pixels += other.n_pixels;
        self.sum_mm += other.sum_mm;
        self.squares_mm2 += other.squares_mm2;
        if let Some((difference_mm, place)) = other.worst {
            self.keep_worst(difference_mm, place);
        }
    }

    fn keep_worst(&mut self, difference_mm: f64, place: LargestDifference) {
        if self.worst.is_none_or(|(worst_mm, _)| difference_mm.abs() > worst_mm.abs()) {
            self.worst = Some((difference_mm, place));
        }
    }

    fn total(&self) -> Option<DepthDifference> {
        let (max_mm, worst) = self.worst?;
        let n = self.n_pixels as f64;
        Some(DepthDifference {
            n_pixels: self.n_pixels,
            mean_mm: self.sum_mm / n,
            rms_mm: (self.squares_mm2 / n).sqrt(),
            max_mm,
            worst,
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, Vector3};
    use optics::{Camera, DepthRangeMm, LightSurfaces, Plane};

    use super::*;

    /// Rounding of depths near 400 mm through two divisions.
    const EXACT_MM: f64 = 1e-10;

    /// A pinhole camera and one tilted plane per order.
    fn calibration(scale: f64) -> Calibration {
        let camera = Camera {
            width_px: 1280,
            height_px: 1024,
            fx_px: 2500.0,
            fy_px: 2500.0,
            cx_px: 640.0,
            cy_px: 512.0,
            k1: 0.0,
            k2: 0.0,
            p1: 0.0,
            p2: 0.0,
            k3: 0.0,
        };
        let normal = Vector3::new(0.0, 0.8, 0.6);
        let plane = |offset_mm: f64| Plane { normal, offset_mm: -offset_mm * scale };
        Calibration {
            id: String::new(),
            camera,
            orders: vec![-1, 1],
            light: LightSurfaces::Planes(vec![(-1, plane(240.0)), (1, plane(250.0))]),
            stage: None,
            depth_range_mm: DepthRangeMm { near_mm: 360.0, far_mm: 440.0 },
            covariance: DMatrix::zeros(0, 0),
        }
    }

    /// A ray meets a plane n·X = d moved to n·X = d(1 + ε) at the depth z(1 + ε).
    #[test]
    fn planes_moved_by_a_tenth_of_a_percent_move_every_depth_by_that() {
        let epsilon = 1e-3;
        let found = difference(&calibration(1.0), &calibration(1.0 + epsilon)).unwrap();
        assert_eq!(found.orders.len(), 2);
        let one = calibration(1.0);
        for order in &found.orders {
            for (pixel, difference_mm) in pixels(&one).zip(&order.depth_mm) {
                let depth_mm = one.triangulate(order.order, &pixel, None).unwrap().hit.depth_mm;
                match difference_mm {
                    Some(difference_mm) => assert!((difference_mm - epsilon * depth_mm).abs() < EXACT_MM),
                    None => assert!(!one.depth_range_mm.contains(depth_mm)),
                }
            }
        }
        // The largest difference is where the working volume is deepest.
        let worst = found.total.worst;
        assert!((found.total.max_mm - epsilon * worst.depth_mm).abs() < EXACT_MM && worst.depth_mm > 430.0);
        assert!(found.total.mean_mm > 0.36 && found.total.mean_mm < found.total.rms_mm);
        assert!(found.total.rms_mm < found.total.max_mm && found.total.max_mm < 0.44 + EXACT_MM);
    }

    #[test]
    fn a_calibration_does_not_differ_from_itself_and_the_sign_is_second_minus_first() {
        let found = difference(&calibration(1.0), &calibration(1.0)).unwrap();
        assert_eq!((found.total.rms_mm, found.total.max_mm), (0.0, 0.0));
        assert!(difference(&calibration(1.0), &calibration(0.999)).unwrap().total.mean_mm < 0.0);
    }

    #[test]
    fn incomparable_calibrations_are_refused() {
        let mut small = calibration(1.0);
        small.camera.width_px = 640;
        let refused = difference(&calibration(1.0), &small);
        assert!(matches!(refused, Err(DifferenceError::ImageSizeMismatch { other_width_px: 640, .. })));
        let mut other = calibration(1.0);
        other.orders = vec![7];
        assert_eq!(difference(&calibration(1.0), &other), Err(DifferenceError::NoCommonOrder));
    }
}
