//! Stations generated from seeds.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use twin::{CaptureRequest, ScanRequest, SceneKind, StationModel, StationShape};
use vision::LineDirection;

/// Working distances, mm.
const STANDOFFS_MM: [f64; 3] = [150.0, 400.0, 1000.0];
/// Cameras, columns and rows: 1.3, 5 and 12.3 megapixels.
const CAMERAS_PX: [[usize; 2]; 3] = [[1280, 1024], [2448, 2048], [4096, 3000]];
/// Fraction of half the image available to the outermost line.
const LINES_FRACTION: f64 = 0.62;
/// Radius of the ball in a field of ±100 mm, mm.
const BALL_MM: f64 = 18.9;

/// A simulated station.
pub struct Station {
    pub model: StationModel,
    /// Radius of the ball on its stage.
    pub ball_mm: f64,
    pub n_frames: usize,
}

impl Station {
    /// The station of a seed. Working distance, camera and orders cycle with periods of three, three and nine.
    pub fn seeded(seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let standoff_mm = STANDOFFS_MM[(seed % 3) as usize];
        let camera_px = CAMERAS_PX[(seed / 3 % 3) as usize];
        let n_orders = 1 + (seed * 2 + seed / 9) % 9;
        let field_half_width_mm = standoff_mm * between(0.18, 0.3);
        let line_direction = if seed % 4 == 3 { LineDirection::Columns } else { LineDirection::Rows };
        let line_sigma_px = between(1.3, 2.6) * (camera_px[0] as f64 / 1280.0).sqrt();
        let ball = between(0.4, 1.3);
        let station = Self::of(
            seed,
            standoff_mm,
            camera_px,
            n_orders as i8,
            field_half_width_mm,
            line_direction,
            line_sigma_px,
        );
        Self { ball_mm: ball * station.ball_mm, ..station }
    }

    /// A station with the given number of orders, spaced as far apart as the image allows.
    pub fn of(
        seed: u64,
        standoff_mm: f64,
        [width_px, height_px]: [usize; 2],
        n_orders: i8,
        field_half_width_mm: f64,
        line_direction: LineDirection,
        line_sigma_px: f64,
    ) -> Self {
        let first = -(n_orders / 2);
        let orders: Vec<i8> = (first..first + n_orders).collect();
        let outermost = orders.iter().map(|order| order.abs()).max().unwrap_or(0).max(1);
        let half_across_mm = match line_direction {
            LineDirection::Rows => field_half_width_mm * height_px as f64 / width_px as f64,
            LineDirection::Columns => field_half_width_mm,
        };
        let wavelength_nm = 660.0;
        let spread = LINES_FRACTION * half_across_mm / standoff_mm / f64::from(outermost);
        let shape = StationShape {
            width_px,
            height_px,
            orders,
            line_direction,
            standoff_mm,
            field_half_width_mm,
            line_sigma_px,
            wavelength_nm,
            lines_per_mm: (spread / (wavelength_nm * 1e-6)).min(100.0).round(),
            ..StationShape::default()
        };
        let ball_mm = BALL_MM * shape.field_scale();
        Self { model: StationModel::seeded(seed, &shape).unwrap(), ball_mm, n_frames: 40 }
    }

    fn scale(&self) -> f64 {
        self.model.shape.field_scale()
    }

    pub fn request(&self) -> CaptureRequest {
        let scale = self.scale();
        let part = SceneKind::Sphere { radius_mm: self.ball_mm };
        CaptureRequest {
            n_poses: 12,
            stage_positions: [-20.0, -10.0, 0.0, 10.0, 20.0].map(|at: f64| at * scale).to_vec(),
            scans: vec![ScanRequest {
                name: "sphere".to_owned(),
                part,
                n_frames: self.n_frames,
                step: 32.0 * scale / self.n_frames as f64,
            }],
        }
    }

    pub fn name(&self) -> String {
        let shape = &self.model.shape;
        format!(
            "seed {}: {:.0} mm, {} × {}, {} orders, ±{:.0} mm, {} lines/mm, {:?}, σ {:.1} px, ball {:.1} mm",
            self.model.seed,
            shape.standoff_mm,
            shape.width_px,
            shape.height_px,
            shape.orders.len(),
            shape.field_half_width_mm,
            shape.lines_per_mm,
            shape.line_direction,
            shape.line_sigma_px,
            self.ball_mm
        )
    }
}
