//! The calibration document: one versioned JSON text with everything to use, compare and reproduce a calibration.
//!
//! It holds no clock: the same inputs give the same bytes, and the id is the hash of the content.

use std::borrow::Cow;

use nalgebra::{DMatrix, Vector3};
use optics::stage::{AngleError, Straightness};
use optics::{
    Calibration, Camera, DepthRangeMm, Grating, LightSurfaces, Pencil, Plane, RotaryAxis, Stage, StageAxis,
};
use remedy::Remedy;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::calibrate::CalibrationResult;
use crate::findings::document_report::ReportText;

/// The only format this version reads and writes.
pub const FORMAT: &str = "sheaf-calibration/1";

/// Rounding of a unit vector that went through text.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Hexadecimal digits of the content's hash that make the id.
const ID_DIGITS: usize = 16;

/// An input file by its content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputHash {
    /// Path within the capture.
    pub path: String,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
}

/// The program that made the document.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Software {
    /// `sheaf`.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// Camera by OpenCV's convention.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct CameraText {
    pub width_px: usize,
    pub height_px: usize,
    pub fx_px: f64,
    pub fy_px: f64,
    pub cx_px: f64,
    pub cy_px: f64,
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
    pub k3: f64,
}

/// Light sheets of one model, camera frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum LightText {
    /// n·X + d = 0 per order.
    Planes { planes: Vec<PlaneText> },
    /// Planes through one line.
    Pencil { point_mm: [f64; 3], direction: [f64; 3], base_normal: [f64; 3], wavelength_over_period: f64 },
    /// The exact sheets.
    Grating {
        source_mm: [f64; 3],
        axis: [f64; 3],
        fan: [f64; 3],
        normal: [f64; 3],
        groove: [f64; 3],
        gap_mm: f64,
        wavelength_over_period: f64,
    },
}

/// One plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct PlaneText {
    pub order: i8,
    pub normal: [f64; 3],
    pub offset_mm: f64,
}

/// The stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum StageText {
    /// It travels.
    Linear(TravelText),
    /// It turns.
    Rotary(AxisText),
}

/// Axis of a turntable, camera frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisText {
    /// Always `rotary`.
    pub kind: RotaryWord,
    /// A point of the axis.
    pub point_mm: [f64; 3],
    /// Unit vector about which growing angles turn the part by the right-hand rule.
    pub direction: [f64; 3],
    /// One standard deviation of the table's angles; absent where that is unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_sigma_deg: Option<f64>,
}

/// The word that tells a turntable from a stage that travels, which has none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RotaryWord {
    /// It turns.
    Rotary,
}

/// Travel of a linear stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TravelText {
    /// Camera-frame millimetres per millimetre of nominal travel.
    pub direction_mm_per_mm: [f64; 3],
    /// How far the travel may be from straight; absent where that is unknown, as in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub straightness: Option<StraightnessText>,
}

/// Deviations from straight and even travel, see [`Straightness`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StraightnessText {
    /// One standard deviation along every axis.
    pub sigma_mm: f64,
    /// Stage position of the first node.
    pub first_mm: f64,
    /// Stage position of the last node.
    pub last_mm: f64,
    /// Nodes, evenly spaced.
    pub n_nodes: usize,
}

/// Joint covariance of all parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CovarianceText {
    /// Names of rows and columns: camera, light (local steps, see the maths), stage.
    pub parameters: Vec<String>,
    /// Rows.
    pub matrix: Vec<Vec<f64>>,
}

/// Depths covered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct DepthRangeText {
    pub near_mm: f64,
    pub far_mm: f64,
}

/// What is needed to use the calibration; small enough to travel in a cloud's header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationText {
    /// Always [`FORMAT`].
    pub format: String,
    /// First digits of the whole document's SHA-256, computed with an empty id.
    pub id: String,
    /// Camera.
    pub camera: CameraText,
    /// Orders from the top (left) of the image downwards (rightwards).
    pub orders: Vec<i8>,
    /// Light sheets.
    pub light: LightText,
    /// Stage, if calibrated.
    pub stage: Option<StageText>,
    /// Depths covered.
    pub depth_range: DepthRangeText,
    /// Joint covariance.
    pub covariance: CovarianceText,
}

/// The whole document.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationDocument {
    /// What is needed to use it.
    #[serde(flatten)]
    pub calibration: CalibrationText,
    /// What made it.
    pub software: Software,
    /// The files it was computed from.
    pub inputs: Vec<InputHash>,
    /// Constants of the computation that shape the result.
    pub parameters: std::collections::BTreeMap<String, f64>,
    /// Residuals, cross-validation, warnings.
    pub report: ReportText,
}

/// Why a document cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DocumentError {
    /// Not JSON, or not of this shape.
    #[error("the calibration document cannot be read")]
    Malformed(#[source] serde_json::Error),
    /// Another format.
    #[error("the calibration document has format `{found}`, this program reads `{FORMAT}`")]
    Format {
        /// As found.
        found: String,
    },
    /// A number is missing or makes no sense.
    #[error("the calibration document's `{entry}` {problem}")]
    Entry {
        /// The entry.
        entry: &'static str,
        /// What is wrong.
        problem: &'static str,
    },
}

impl Remedy for DocumentError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some("make it again with `sheaf calibrate`".into())
    }
}

impl CalibrationDocument {
    /// The document of a result; `inputs` are the files it was computed from, `software_version` the program's.
    pub fn new(result: &CalibrationResult, inputs: Vec<InputHash>, software_version: &str) -> Self {
        let mut document = Self {
            calibration: CalibrationText::of(&result.calibration),
            software: Software { name: "sheaf".to_owned(), version: software_version.to_owned() },
            inputs,
            parameters: crate::params::as_map(),
            report: ReportText::of(&result.report),
        };
        document.calibration.id = String::new();
        let digest = Sha256::digest(document.to_json().as_bytes());
        document.calibration.id =
            digest.iter().map(|byte| format!("{byte:02x}")).collect::<String>()[..ID_DIGITS].to_owned();
        document
    }

    /// Reads a document.
    ///
    /// # Errors
    /// [`DocumentError`] names the entry that is wrong.
    pub fn parse(text: &str) -> Result<Self, DocumentError> {
        let document: Self = serde_json::from_str(text).map_err(DocumentError::Malformed)?;
        document.calibration.check()?;
        Ok(document)
    }

    /// The document as indented JSON, numbers with full precision, keys in a fixed order.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a document of numbers and strings always has a JSON form")
    }

    /// The calibration value.
    pub fn calibration(&self) -> Calibration {
        self.calibration.value()
    }
}

impl CalibrationText {
    /// The text of a value.
    pub fn of(value: &Calibration) -> Self {
        let camera = &value.camera;
        let n = value.covariance.nrows();
        Self {
            format: FORMAT.to_owned(),
            id: value.id.clone(),
            camera: CameraText {
                width_px: camera.width_px,
                height_px: camera.height_px,
                fx_px: camera.fx_px,
                fy_px: camera.fy_px,
                cx_px: camera.cx_px,
                cy_px: camera.cy_px,
                k1: camera.k1,
                k2: camera.k2,
                p1: camera.p1,
                p2: camera.p2,
                k3: camera.k3,
            },
            orders: value.orders.clone(),
            light: LightText::of(&value.light),
            stage: value.stage.as_ref().map(StageText::of),
            depth_range: DepthRangeText {
                near_mm: value.depth_range_mm.near_mm,
                far_mm: value.depth_range_mm.far_mm,
            },
            covariance: CovarianceText {
                parameters: value.parameter_names(),
                matrix: (0..n).map(|i| (0..n).map(|j| value.covariance[(i, j)]).collect()).collect(),
            },
        }
    }

    /// Reads the text form, as kept in a cloud's header.
    ///
    /// # Errors
    /// [`DocumentError`] names the entry that is wrong.
    pub fn parse(text: &str) -> Result<Self, DocumentError> {
        let calibration: Self = serde_json::from_str(text).map_err(DocumentError::Malformed)?;
        calibration.check()?;
        Ok(calibration)
    }

    /// The value of a checked text.
    pub fn value(&self) -> Calibration {
        let camera = &self.camera;
        let matrix = [[camera.fx_px, 0.0, camera.cx_px], [0.0, camera.fy_px, camera.cy_px], [0.0, 0.0, 1.0]];
        let distortion = [camera.k1, camera.k2, camera.p1, camera.p2, camera.k3];
        let rows = &self.covariance.matrix;
        Calibration {
            id: self.id.clone(),
            camera: Camera::from_opencv(camera.width_px, camera.height_px, matrix, &distortion),
            orders: self.orders.clone(),
            light: self.light.value(),
            stage: self.stage.as_ref().map(StageText::value),
            depth_range_mm: DepthRangeMm { near_mm: self.depth_range.near_mm, far_mm: self.depth_range.far_mm },
            covariance: DMatrix::from_fn(rows.len(), rows.len(), |i, j| rows[i][j]),
        }
    }

    fn check(&self) -> Result<(), DocumentError> {
        if self.format != FORMAT {
            return Err(DocumentError::Format { found: self.format.clone() });
        }
        let wrong = |entry, problem| Err(DocumentError::Entry { entry, problem });
        let camera = &self.camera;
        if camera.width_px == 0 || camera.height_px == 0 {
            return wrong("camera.width_px", "must be positive, like height_px");
        }
        if !(camera.fx_px > 0.0 && camera.fy_px > 0.0) {
            return wrong("camera.fx_px", "must be positive, like fy_px");
        }
        if self.orders.is_empty() {
            return wrong("orders", "lists no order");
        }
        let depths = &self.depth_range;
        if !(depths.near_mm >= 0.0 && depths.far_mm >= depths.near_mm) {
            return wrong("depth_range", "must have 0 ≤ near_mm ≤ far_mm");
        }
        let straightness = match &self.stage {
            Some(StageText::Linear(travel)) => travel.straightness.as_ref(),
            _ => None,
        };
        if let Some(StageText::Rotary(axis)) = &self.stage {
            let length = Vector3::from(axis.direction).norm();
            if !((length - 1.0).abs() < UNIT_TOLERANCE && axis.point_mm.iter().all(|value| value.is_finite())) {
                return wrong("stage.direction", "must be of length 1, and stage.point_mm finite");
            }
            if axis.angle_sigma_deg.is_some_and(|sigma_deg| AngleError::new(sigma_deg).is_none()) {
                return wrong("stage.angle_sigma_deg", "must be above 0");
            }
        }
        if straightness.is_some_and(|straightness| straightness.value().is_none()) {
            return wrong("stage.straightness", "must have sigma_mm > 0, last_mm > first_mm and n_nodes ≥ 2");
        }
        let n = self.light.parameters()
            + optics::CAMERA_PARAMETERS
            + self.stage.as_ref().map_or(0, |stage| stage.value().parameters());
        let rows = &self.covariance.matrix;
        if rows.len() != n || rows.iter().any(|row| row.len() != n) {
            return wrong("covariance.matrix", "does not have one row and column per parameter");
        }
        Ok(())
    }
}

impl StageText {
    fn of(stage: &Stage) -> Self {
        match stage {
            Stage::Linear(axis) => Self::Linear(TravelText::of(axis)),
            Stage::Rotary(axis) => Self::Rotary(AxisText {
                kind: RotaryWord::Rotary,
                point_mm: axis.point_mm.into(),
                direction: axis.direction.into(),
                angle_sigma_deg: axis.angle_error.map(|error| error.sigma_rad().to_degrees()),
            }),
        }
    }

    fn value(&self) -> Stage {
        match self {
            Self::Linear(travel) => travel.value().into(),
            Self::Rotary(axis) => Stage::Rotary(RotaryAxis {
                point_mm: Vector3::from(axis.point_mm),
                direction: Vector3::from(axis.direction),
                angle_error: axis.angle_sigma_deg.and_then(|sigma_deg| AngleError::new(sigma_deg.to_radians())),
            }),
        }
    }
}

impl TravelText {
    fn of(stage: &StageAxis) -> Self {
        let straightness = stage.straightness.as_ref().map(|straightness| {
            let (first_mm, last_mm) = straightness.ends_mm();
            StraightnessText {
                sigma_mm: straightness.sigma_mm(),
                first_mm,
                last_mm,
                n_nodes: straightness.n_nodes(),
            }
        });
        Self { direction_mm_per_mm: stage.direction.into(), straightness }
    }

    fn value(&self) -> StageAxis {
        StageAxis {
            direction: Vector3::from(self.direction_mm_per_mm),
            straightness: self.straightness.as_ref().and_then(StraightnessText::value),
        }
    }
}

impl StraightnessText {
    fn value(&self) -> Option<Straightness> {
        Straightness::new(self.sigma_mm, self.first_mm, self.last_mm, self.n_nodes)
    }
}

impl LightText {
    fn of(light: &LightSurfaces) -> Self {
        match light {
            LightSurfaces::Planes(planes) => Self::Planes {
                planes: planes
                    .iter()
                    .map(|(order, plane)| PlaneText {
                        order: *order,
                        normal: plane.normal.into(),
                        offset_mm: plane.offset_mm,
                    })
                    .collect(),
            },
            LightSurfaces::Pencil(pencil) => Self::Pencil {
                point_mm: pencil.point_mm.into(),
                direction: pencil.direction.into(),
                base_normal: pencil.base_normal.into(),
                wavelength_over_period: pencil.wavelength_over_period,
            },
            LightSurfaces::Grating(grating) => Self::Grating {
                source_mm: grating.source_mm.into(),
                axis: grating.axis.into(),
                fan: grating.fan.into(),
                normal: grating.normal.into(),
                groove: grating.groove.into(),
                gap_mm: grating.gap_mm,
                wavelength_over_period: grating.wavelength_over_period,
            },
        }
    }

    fn value(&self) -> LightSurfaces {
        match self {
            Self::Planes { planes } => LightSurfaces::Planes(
                planes
                    .iter()
                    .map(|p| (p.order, Plane { normal: Vector3::from(p.normal), offset_mm: p.offset_mm }))
                    .collect(),
            ),
            Self::Pencil { point_mm, direction, base_normal, wavelength_over_period } => {
                LightSurfaces::Pencil(Pencil {
                    point_mm: Vector3::from(*point_mm),
                    direction: Vector3::from(*direction),
                    base_normal: Vector3::from(*base_normal),
                    wavelength_over_period: *wavelength_over_period,
                })
            }
            Self::Grating { source_mm, axis, fan, normal, groove, gap_mm, wavelength_over_period } => {
                LightSurfaces::Grating(Grating {
                    source_mm: Vector3::from(*source_mm),
                    axis: Vector3::from(*axis),
                    fan: Vector3::from(*fan),
                    normal: Vector3::from(*normal),
                    groove: Vector3::from(*groove),
                    gap_mm: *gap_mm,
                    wavelength_over_period: *wavelength_over_period,
                })
            }
        }
    }

    fn parameters(&self) -> usize {
        self.value().parameters()
    }
}
