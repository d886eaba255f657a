//! The configuration of the use cases; the program decides where the values come from.

pub mod limits;

use std::path::PathBuf;

use capture::{ChessboardTarget, GratingProjector, Projector, Target};
use station::StationDevices;
use twin::{TwinDriver, TwinSettings};

pub use report::certificate::{Contact, Issuer, Place};
pub use twin::params::{GAUGE_HEIGHT_MM, SPHERE_RADIUS_MM};

/// The configuration of the use cases.
#[derive(Debug, Clone)]
pub struct AppConfig {
    /// The data directory.
    pub data: PathBuf,
    /// Station devices.
    pub station: StationDevices,
    /// The board used for calibration.
    pub target: Target,
    /// Nominal values of the line projector: laser and grating, or independent lasers.
    pub projector: Projector,
    /// Who issues certificates of calibrations; empty: nobody does.
    pub issuer: Issuer,
}

impl AppConfig {
    /// Height of the gauge block and radius of the ball beside the station, mm: where its camera is simulated, their true
    /// sizes.
    pub fn known_sizes_mm(&self) -> (f64, f64) {
        match self.station.twin.as_deref().map(TwinDriver::settings) {
            Some(twin) => (twin.gauge_height_mm, twin.sphere_radius_mm),
            None => (GAUGE_HEIGHT_MM, SPHERE_RADIUS_MM),
        }
    }

    /// The configuration of the simulated station, with its data under `data`.
    pub fn simulated(data: PathBuf) -> Self {
        let shape = twin::StationShape::default();
        let (inner_columns, inner_rows) = twin::poses::BOARD_CORNERS;
        Self {
            data,
            station: StationDevices::twin(TwinDriver::new(TwinSettings::default())),
            target: ChessboardTarget { inner_columns, inner_rows, square_mm: 12.0.into() }.into(),
            projector: Projector::Grating(GratingProjector {
                wavelength_nm: shape.wavelength_nm,
                grating_lines_per_mm: shape.lines_per_mm,
                orders: shape.orders,
                line_direction: None,
            }),
            issuer: Issuer::default(),
        }
    }
}
