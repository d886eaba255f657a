//! How the service is set up, as far as its use cases care; where the values come from is the program's business.

use std::path::PathBuf;

use capture::{ChessboardTarget, GratingProjector};
use station::config::StationConfig;

/// Height of the gauge block beside a station, mm: that of the paper.
pub const GAUGE_HEIGHT_MM: f64 = 8.9;

/// Radius of the ball beside a station, mm: that of the paper.
pub const SPHERE_RADIUS_MM: f64 = 18.9;

/// The configuration of the use cases.
#[derive(Debug, Clone, PartialEq)]
pub struct AppConfig {
    /// Where everything is kept.
    pub data: PathBuf,
    /// What the station is made of.
    pub station: StationConfig,
    /// The board used for calibration.
    pub target: ChessboardTarget,
    /// The projector by its data sheet.
    pub projector: GratingProjector,
}

impl AppConfig {
    /// Height of the gauge block and radius of the ball beside the station, mm: on the simulated one their true sizes.
    pub fn known_sizes_mm(&self) -> (f64, f64) {
        match &self.station {
            StationConfig::Twin(twin) => (twin.gauge_height_mm, twin.sphere_radius_mm),
            _ => (GAUGE_HEIGHT_MM, SPHERE_RADIUS_MM),
        }
    }

    /// Everything as the simulated station has it, with its data under `data`.
    pub fn simulated(data: PathBuf) -> Self {
        let shape = twin::StationShape::default();
        let (inner_columns, inner_rows) = twin::poses::BOARD_CORNERS;
        Self {
            data,
            station: StationConfig::Twin(station::config::TwinConfig {
                seed: 7,
                scene: "sphere".to_owned(),
                gauge_height_mm: GAUGE_HEIGHT_MM,
                sphere_radius_mm: SPHERE_RADIUS_MM,
                realistic_timing: false,
                frame_rate_hz: 30.0,
            }),
            target: ChessboardTarget { inner_columns, inner_rows, square_mm: 12.0.into() },
            projector: GratingProjector {
                wavelength_nm: shape.wavelength_nm,
                grating_lines_per_mm: shape.lines_per_mm,
                orders: shape.orders,
                line_direction: None,
            },
        }
    }
}
