//! Why no verdict is possible: unknown uncertainty contributions, and models that do not fit.

use std::fmt;

/// An uncertainty contribution that the measurement needs and that is unknown: U is incomplete without it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// The points have no σ; the residuals are used instead.
    PointNoise,
    /// No calibration was given.
    Calibration,
    /// Some modes of the calibration's covariance gave no value.
    CalibrationModes,
    /// The cloud does not state the stage position of each frame.
    StagePositions,
    /// The cloud does not state the thickness of the light sheets.
    LineThickness,
    /// The effect of temperature on this light model is unknown.
    Wavelength,
    /// The straightness of the stage is unknown, and the value is a length along its travel.
    StageStraightness,
    /// The tilt of the stage (pitch, yaw, roll) is unknown, and the value is a length along its travel.
    StageTilt,
    /// The angular accuracy of the turntable is unknown.
    StageAngle,
    /// The intensity of the lines does not fall before they end at a rim, so the position of the rim is unknown.
    EdgeThreshold,
}

impl Missing {
    /// Its name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::PointNoise => "point_noise",
            Self::Calibration => "calibration",
            Self::CalibrationModes => "calibration_modes",
            Self::StagePositions => "stage_positions",
            Self::LineThickness => "line_thickness",
            Self::Wavelength => "wavelength",
            Self::StageStraightness => "stage_straightness",
            Self::StageTilt => "stage_tilt",
            Self::StageAngle => "stage_angle",
            Self::EdgeThreshold => "edge_threshold",
        }
    }
}

/// What is missing, and the remedy.
impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PointNoise => "the noise of the points (the cloud has no sigma)",
            Self::Calibration => "the calibration's contribution (no calibration was given)",
            Self::CalibrationModes => "a part of the calibration's covariance (some modes gave no value)",
            Self::StagePositions => {
                "the stage positions of the frames (the cloud does not state them: scan again)"
            }
            Self::LineThickness => "the thickness of the light sheets (the cloud does not state it: scan again)",
            Self::Wavelength => "the temperature's effect on the light (a single light plane does not determine it)",
            Self::StageStraightness => "the straightness of the stage (the calibration does not state it)",
            Self::StageTilt => {
                "the tilt of the stage along its travel (the calibration does not state it: calibrate again)"
            }
            Self::StageAngle => {
                "the error of the turntable's angle (the calibration does not state it: give stage.angle_sigma_deg in \
                 the capture and calibrate again)"
            }
            Self::EdgeThreshold => {
                "the position of the rim (the lines do not fade before they end: reduce the exposure or the point spacing)"
            }
        })
    }
}

/// A sign that the tool does not suit the part.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// The residuals are larger than noise and form error explain.
    ModelMisfit {
        /// The feature.
        role: &'static str,
        /// RMS of the residuals along the normal, mm.
        rms_mm: f64,
        /// Largest RMS explained by noise and a usual form error, mm.
        allowed_mm: f64,
    },
    /// Too many points inside the feature's outline are not on it.
    OffSurface {
        /// The feature.
        role: &'static str,
        /// Their fraction, 0–1.
        fraction: f64,
    },
    /// The points cover too short an arc to determine the radius.
    ShortArc {
        /// The feature.
        role: &'static str,
        /// Angle between the outermost normals, degrees.
        arc_deg: f64,
    },
}

impl Finding {
    /// Its name in JSON.
    pub fn name(&self) -> &'static str {
        match self {
            Self::ModelMisfit { .. } => "model_misfit",
            Self::OffSurface { .. } => "off_surface",
            Self::ShortArc { .. } => "short_arc",
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ModelMisfit { role, rms_mm, allowed_mm } => write!(
                f,
                "{role}: the model does not fit: residuals of {rms_mm:.3} mm RMS, noise and form explain {allowed_mm:.3} mm; \
                 check the tool, or give a region around the feature"
            ),
            Self::OffSurface { role, fraction } => write!(
                f,
                "{role}: the model does not fit: {:.0} % of the points inside its outline are off its surface; check \
                 the tool, or give a region around the feature",
                1e2 * fraction
            ),
            Self::ShortArc { role, arc_deg } => {
                write!(f, "{role}: an arc of {arc_deg:.0}° is too short to determine a radius; scan more of it")
            }
        }
    }
}
