//! Uncertainty contributions that the cloud and its calibration do not state (`docs/maths/metrology.md`, "Contributions
//! to U").

use optics::Calibration;

use crate::fitting::sample::Samples;
use crate::interface::findings::Missing;
use crate::measuring::temperature::wavelength_drift;

/// Contributions that are missing regardless of the feature; `is_along_travel`: whether the value may extend along the
/// travel of the stage.
pub(crate) fn missing(
    samples: &Samples,
    calibration: Option<&Calibration>,
    is_along_travel: bool,
) -> Vec<Missing> {
    let stage = calibration.and_then(|calibration| calibration.stage);
    let turntable = stage.and_then(|stage| stage.rotary());
    let is_straight = stage.and_then(|stage| stage.linear()?.straightness).is_some();
    let is_level = stage.and_then(|stage| stage.linear()?.tilt).is_some();
    let parts = [
        (!samples.sigma_known, Missing::PointNoise),
        (calibration.is_none(), Missing::Calibration),
        (samples.stage.is_none(), Missing::StagePositions),
        (samples.line_sigma_mm.is_none(), Missing::LineThickness),
        (calibration.is_some_and(|calibration| wavelength_drift(calibration).is_none()), Missing::Wavelength),
        (is_along_travel && turntable.is_none() && !is_straight, Missing::StageStraightness),
        (is_along_travel && is_straight && !is_level, Missing::StageTilt),
        (turntable.is_some_and(|axis| axis.angle_error.is_none()), Missing::StageAngle),
    ];
    parts.into_iter().filter(|(is_missing, _)| *is_missing).map(|(_, part)| part).collect()
}
