//! The settings. Each setting is a field: its doc comment is the description, its attributes define the allowed values,
//! and [`Settings::default`] the default; file, environment, flags and `sheaf config` follow from it.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use app::config::AppConfig;
use capture::{
    CharucoTarget, ChessboardTarget, CirclesTarget, GratingProjector, PlanesProjector, Projector, SquareMm, Target,
};
use http::HttpConfig;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use station::StationDevices;
use twin::StationShape;

use crate::config::Config;
use crate::config::certificate::CertificateSettings;
use crate::doors::DoorSettings;
use crate::drivers::StationSettings;

/// The whole file.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct Settings {
    /// address and port of the service, such as 127.0.0.1:8080
    pub listen: SocketAddr,
    /// data directory
    pub data: PathBuf,
    pub station: StationSettings,
    pub target: TargetSettings,
    pub projector: ProjectorSettings,
    pub http: HttpSettings,
    pub certificate: CertificateSettings,
    pub doors: DoorSettings,
}

/// `[target]`: the board used for calibration.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct TargetSettings {
    /// kind of the calibration board
    #[schemars(extend("enum" = ["chessboard", "charuco", "circles", "asymmetric_circles"]))]
    pub kind: String,
    /// inner corners along a row of a chessboard
    #[schemars(range(min = 2, max = 200))]
    pub inner_columns: usize,
    /// inner corners along a column of a chessboard
    #[schemars(range(min = 2, max = 200))]
    pub inner_rows: usize,
    /// squares of a ChArUco board, or discs of a circle grid, along a row
    #[schemars(range(min = 0, max = 200))]
    pub columns: usize,
    /// squares of a ChArUco board, or discs of a circle grid, along a column
    #[schemars(range(min = 0, max = 200))]
    pub rows: usize,
    /// square size, or spacing of a circle grid; two numbers (along a row, along a column) if they differ
    #[schemars(with = "SquareSetting")]
    pub square_mm: SquareMm,
    /// marker size of a ChArUco board
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub marker_mm: f64,
    /// OpenCV name of the marker dictionary of a ChArUco board, such as DICT_4X4_50
    pub dictionary: String,
    /// disc diameter of a circle grid
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub diameter_mm: f64,
}

/// Allowed values of `square_mm`.
#[derive(JsonSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "only its schema is used")]
enum SquareSetting {
    One(#[schemars(range(min = 0.01, max = 1000.0))] f64),
    Two(#[schemars(length(min = 2, max = 2), inner(range(min = 0.01, max = 1000.0)))] Vec<f64>),
}

/// `[projector]`: nominal values of the line projector.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct ProjectorSettings {
    /// what makes the lines: grating (one laser behind a grating) or planes (independent lasers, or lines of one)
    #[schemars(extend("enum" = ["grating", "planes"]))]
    pub kind: String,
    /// number of independent lines of kind planes
    #[schemars(range(min = 0, max = 41))]
    pub lines: usize,
    /// wavelength of the laser
    #[schemars(range(min = 100.0, max = 20_000.0))]
    pub wavelength_nm: f64,
    /// groove density of the grating
    #[schemars(range(min = 0.1, max = 10_000.0))]
    pub grating_lines_per_mm: f64,
    /// diffraction orders from the top of the image
    #[schemars(length(min = 1), inner(range(min = -100, max = 100)))]
    pub orders: Vec<i8>,
    /// direction of the lines
    #[schemars(extend("enum" = ["rows", "columns"]))]
    pub line_direction: String,
}

/// `[http]`: access to the service.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
pub struct HttpSettings {
    /// additional host names of this server
    pub allowed_hosts: Vec<String>,
    /// additional origins of pages that may use it
    pub allowed_origins: Vec<String>,
    /// a reverse proxy in front handles users and TLS
    pub trusted_proxy: bool,
}

/// Square size of the board of the simulated station; a test compares it with the twin.
const SQUARE_MM: f64 = 12.0;

impl Default for Settings {
    /// The simulated station, reachable from this computer only.
    fn default() -> Self {
        let (inner_columns, inner_rows) = twin::poses::BOARD_CORNERS;
        let shape = StationShape::default();
        Self {
            listen: (Ipv4Addr::LOCALHOST, 8080).into(),
            data: "sheaf-data".into(),
            station: StationSettings::default(),
            target: TargetSettings {
                kind: "chessboard".to_owned(),
                inner_columns,
                inner_rows,
                columns: 0,
                rows: 0,
                square_mm: SQUARE_MM.into(),
                marker_mm: 0.0,
                dictionary: String::new(),
                diameter_mm: 0.0,
            },
            projector: ProjectorSettings {
                kind: "grating".to_owned(),
                lines: 0,
                wavelength_nm: shape.wavelength_nm,
                grating_lines_per_mm: shape.lines_per_mm,
                orders: shape.orders,
                line_direction: "rows".to_owned(),
            },
            http: HttpSettings::default(),
            certificate: CertificateSettings::default(),
            doors: DoorSettings::default(),
        }
    }
}

impl TargetSettings {
    /// The board of the configured kind; entries of other kinds are ignored.
    pub fn board(&self) -> Target {
        let Self { inner_columns, inner_rows, columns, rows, square_mm, marker_mm, diameter_mm, .. } = *self;
        let grid = CirclesTarget { columns, rows, square_mm, diameter_mm };
        match self.kind.as_str() {
            "charuco" => {
                let dictionary = self.dictionary.clone();
                Target::Charuco(CharucoTarget { columns, rows, square_mm, marker_mm, dictionary })
            }
            "circles" => Target::Circles(grid),
            "asymmetric_circles" => Target::AsymmetricCircles(grid),
            _ => Target::Chessboard(ChessboardTarget { inner_columns, inner_rows, square_mm }),
        }
    }
}

impl ProjectorSettings {
    /// The projector of that kind; entries of other kinds do not matter.
    pub fn projector(&self) -> Projector {
        let line_direction = Some(self.line_direction.clone()).filter(|word| word != "rows");
        match self.kind.as_str() {
            "planes" => Projector::Planes(PlanesProjector { lines: self.lines, line_direction, switched: false }),
            _ => Projector::Grating(GratingProjector {
                wavelength_nm: self.wavelength_nm,
                grating_lines_per_mm: self.grating_lines_per_mm,
                orders: self.orders.clone(),
                line_direction,
            }),
        }
    }
}

impl Settings {
    /// What the drivers are opened with: a simulated station has the configured lasers.
    pub fn station(&self) -> StationSettings {
        let mut station = self.station.clone();
        station.twin.lasers = match self.projector.projector() {
            Projector::Planes(lasers) => Some(lasers),
            _ => None,
        };
        station
    }

    /// The configuration of a service with these devices.
    pub fn with(self, station: StationDevices) -> Config {
        let Self { listen, data, target, projector, http, certificate, doors, .. } = self;
        Config {
            listen,
            app: AppConfig {
                data,
                station,
                target: target.board(),
                projector: projector.projector(),
                issuer: certificate.into(),
            },
            http: HttpConfig {
                listen_ip: Some(listen.ip()),
                allowed_hosts: http.allowed_hosts,
                allowed_origins: http.allowed_origins,
                trusted_proxy: http.trusted_proxy,
            },
            doors,
        }
    }
}
