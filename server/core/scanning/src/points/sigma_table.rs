//! Systematic σ of the calibration at every point, interpolated from a coarse table: the exact value needs 19 × 19
//! products.

use nalgebra::Vector2;
use optics::Calibration;

use crate::params::SIGMA_TABLE_STEPS;

/// Systematic σ of one order over the image, bilinear between nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmaTable {
    order: i8,
    origin_px: [f64; 2],
    step_px: f64,
    n_nodes: [usize; 2],
    /// σ along the ray at the nodes, mm; `None` where the ray misses the sheet.
    sigmas_mm: Vec<Option<f64>>,
}

impl SigmaTable {
    /// Computes the table over the pixels between `low_px` and `high_px` (u, v).
    pub fn new(calibration: &Calibration, order: i8, low_px: [f64; 2], high_px: [f64; 2]) -> Self {
        let camera = &calibration.camera;
        let step_px = camera.width_px.max(camera.height_px) as f64 / SIGMA_TABLE_STEPS;
        let n_nodes = [0, 1].map(|axis| ((high_px[axis] - low_px[axis]) / step_px).ceil() as usize + 2);
        let sigmas_mm = (0..n_nodes[0] * n_nodes[1])
            .map(|idx| {
                let (column, row) = (idx % n_nodes[0], idx / n_nodes[0]);
                let u_px = low_px[0] + column as f64 * step_px;
                let v_px = low_px[1] + row as f64 * step_px;
                exact(calibration, order, u_px, v_px)
            })
            .collect();
        Self { order, origin_px: low_px, step_px, n_nodes, sigmas_mm }
    }

    /// σ at a pixel, mm; computed exactly where the table has no node.
    pub fn sigma_mm(&self, calibration: &Calibration, u_px: f64, v_px: f64) -> f64 {
        self.interpolated(u_px, v_px).or_else(|| exact(calibration, self.order, u_px, v_px)).unwrap_or(0.0)
    }

    fn interpolated(&self, u_px: f64, v_px: f64) -> Option<f64> {
        let x = (u_px - self.origin_px[0]) / self.step_px;
        let y = (v_px - self.origin_px[1]) / self.step_px;
        if !(x >= 0.0 && y >= 0.0 && x < (self.n_nodes[0] - 1) as f64 && y < (self.n_nodes[1] - 1) as f64) {
            return None;
        }
        let (column, row) = (x as usize, y as usize);
        let (fx, fy) = (x - column as f64, y - row as f64);
        let node = |dc: usize, dr: usize| self.sigmas_mm[(row + dr) * self.n_nodes[0] + column + dc];
        let upper = node(0, 0)? * (1.0 - fx) + node(1, 0)? * fx;
        let lower = node(0, 1)? * (1.0 - fx) + node(1, 1)? * fx;
        Some(upper * (1.0 - fy) + lower * fy)
    }
}

fn exact(calibration: &Calibration, order: i8, u_px: f64, v_px: f64) -> Option<f64> {
    let point = calibration.triangulate(order, &Vector2::new(u_px, v_px), None)?;
    calibration.systematic_sigma_mm(order, &point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, Vector3};
    use optics::{Camera, DepthRangeMm, Grating, LightSurfaces};

    /// Relative error of σ that is negligible beside its own uncertainty (a few per cent at best).
    const TOLERANCE: f64 = 0.02;

    #[test]
    fn the_table_matches_the_exact_sigma() {
        let normal = Vector3::new(0.0, 0.39, 0.92).normalize();
        let grating = Grating {
            source_mm: Vector3::new(1.0, -174.0, 11.0),
            axis: normal,
            fan: Vector3::x(),
            normal,
            groove: Vector3::x(),
            gap_mm: 18.5,
            wavelength_over_period: 0.033,
        };
        let matrix = [[2500.0, 0.0, 640.0], [0.0, 2500.0, 512.0], [0.0, 0.0, 1.0]];
        let sigmas = [
            0.1, 0.1, 0.3, 0.3, 1e-3, 1e-2, 1e-5, 1e-5, 1e-3, 0.05, 0.05, 0.05, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4,
            0.01, 1e-6,
        ];
        let calibration = Calibration {
            id: "test".into(),
            camera: Camera::from_opencv(1280, 1024, matrix, &[-0.1, 0.1]),
            orders: vec![2],
            light: LightSurfaces::Grating(grating),
            stage: None,
            depth_range_mm: DepthRangeMm { near_mm: 300.0, far_mm: 500.0 },
            covariance: DMatrix::from_fn(19, 19, |a, b| if a == b { f64::powi(sigmas[a], 2) } else { 0.0 }),
        };
        let table = SigmaTable::new(&calibration, 2, [0.0, 500.0], [1279.0, 800.0]);
        for idx in 0..500 {
            let (u_px, v_px) = (f64::from(idx * 37 % 1280), 500.0 + f64::from(idx * 53 % 300));
            let expected = exact(&calibration, 2, u_px, v_px).unwrap();
            let got = table.interpolated(u_px, v_px).unwrap();
            assert!((got / expected - 1.0).abs() < TOLERANCE, "({u_px}, {v_px}): {got} for {expected}");
        }
    }
}
