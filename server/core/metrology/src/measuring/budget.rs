//! The uncertainty budget of a value: its contributions, and which are missing (`docs/maths/metrology.md`,
//! "Contributions to U").

use optics::Calibration;

use crate::fitting::features::FeatureFit;
use crate::fitting::sample::Samples;
use crate::interface::findings::Missing;
use crate::interface::request::Tool;
use crate::interface::shape::Shape;
use crate::measuring::measure::Measurand;
use crate::measuring::missing::missing;
use crate::measuring::noise::{self, FeatureNoise};
use crate::measuring::systematic::Retriangulation;
use crate::params::{AVERAGING_SIGMA, EXPANSION_PER_K, FOOTPRINT_SIGMA, TEMPERATURE_SIGMA_K};

/// Ratio of residuals to predicted noise above which a note is added.
const NOTEWORTHY_RATIO: f64 = 1.25;

/// Standard uncertainties of a value.
pub(crate) struct Budget {
    /// From the noise of the points.
    pub(crate) u_noise: f64,
    /// From the contributions common to all points; `None` without a calibration.
    pub(crate) u_systematic: Option<f64>,
    /// Correction of the value for the thickness of the lines on curved features and for averaging along them.
    pub(crate) correction: f64,
    /// Contributions included in neither.
    pub(crate) missing: Vec<Missing>,
    /// RMS of every feature along its normal predicted from the noise, mm.
    pub(crate) expected_mm: Vec<f64>,
}

/// Combines the known contributions and names the missing ones; `None` if the features do not determine the value.
pub(crate) fn budget(
    (samples, features): (&Samples, &[FeatureFit]),
    measurand: &Measurand,
    value: f64,
    (calibration, retriangulation): (Option<&Calibration>, Option<&Retriangulation>),
    notes: &mut Vec<String>,
) -> Option<Budget> {
    let noises = noises(samples, features, retriangulation);
    let noise = noise::propagate(samples, measurand, features, &noises)?;
    if samples.sigma_known && noise.ratio > NOTEWORTHY_RATIO {
        notes.push(format!(
            "residuals are {:.2} times the predicted noise: the surface has form errors, or the model does not fit; the noise \
             part of U was increased by that factor",
            noise.ratio
        ));
    }
    let mut missing = missing(samples, calibration, is_length_along_travel(measurand, features));
    let mut lacks = |is_missing: bool, part: Missing| {
        if is_missing {
            missing.push(part);
        }
    };
    let modes = retriangulation.and_then(|pixels| pixels.standard_uncertainty(measurand, features));
    let failed = modes.map_or(retriangulation.is_some(), |(_, failed)| failed > 0);
    lacks(failed, Missing::CalibrationModes);
    let curved = curved_corrections(samples, measurand, features, retriangulation);
    lacks(
        samples.line_sigma_mm.is_some() && retriangulation.is_some() && curved.thickness.is_none(),
        Missing::LineThickness,
    );
    let (thickness, averaging) = (curved.thickness.unwrap_or(0.0), curved.averaging);
    let correction = thickness + averaging;
    let of_curves = (FOOTPRINT_SIGMA * thickness).hypot(AVERAGING_SIGMA * averaging);
    if correction != 0.0 {
        notes.push(format!(
            "the value was corrected by {:+.1} µm for the thickness of the lines on the curved surface and by {:+.1} µm for \
             averaging along them and the lens's blur, which contribute {:.1} µm to the systematic part of u",
            1e3 * thickness,
            1e3 * averaging,
            1e3 * of_curves
        ));
    }
    let u_systematic = modes.map(|(u, _)| u.hypot(of_curves).hypot(expansion(measurand, value)));
    let (u_noise, expected_mm) = (noise.standard_uncertainty, noise.expected_mm);
    Some(Budget { u_noise, u_systematic, correction, missing, expected_mm })
}

/// The noise of every feature's points, without the calibration's contribution to their σ.
fn noises(
    samples: &Samples,
    features: &[FeatureFit],
    retriangulation: Option<&Retriangulation>,
) -> Vec<FeatureNoise> {
    let own = |(idx, feature): (usize, &FeatureFit)| match retriangulation.filter(|_| samples.sigma_known) {
        Some(retriangulation) => retriangulation.noise_of(samples, idx, &feature.inliers),
        None => FeatureNoise { sigma_mm: feature.inliers.iter().map(|&idx| samples.at(idx).sigma_mm).collect() },
    };
    features.iter().enumerate().map(own).collect()
}

/// Whether the value is a distance along the travel of the stage.
fn is_length_along_travel(measurand: &Measurand, features: &[FeatureFit]) -> bool {
    measurand.tool == Tool::Distance && features.iter().all(|f| matches!(f.shape, Shape::Sphere { .. }))
}

/// Contribution of the part's thermal expansion to a length.
fn expansion(measurand: &Measurand, value: f64) -> f64 {
    match measurand.tool {
        Tool::Sphere | Tool::Cylinder | Tool::Step | Tool::Distance => {
            value.abs() * EXPANSION_PER_K * TEMPERATURE_SIGMA_K
        }
        Tool::Plane | Tool::Angle | Tool::Flatness => 0.0,
    }
}

/// Corrections of a value for lines on curved features.
struct Curved {
    /// For their thickness; `None` if it is unknown.
    thickness: Option<f64>,
    /// For averaging along them and the blur of the lens.
    averaging: f64,
}

fn curved_corrections(
    samples: &Samples,
    measurand: &Measurand,
    features: &[FeatureFit],
    retriangulation: Option<&Retriangulation>,
) -> Curved {
    if features.iter().all(|feature| matches!(feature.shape, Shape::Plane { .. })) {
        return Curved { thickness: Some(0.0), averaging: 0.0 };
    }
    let Some(pixels) = retriangulation else { return Curved { thickness: None, averaging: 0.0 } };
    let thickness = samples.line_sigma_mm.and_then(|mm| pixels.thickness_correction(measurand, features, mm));
    let averaging = pixels.averaging_correction(measurand, features).unwrap_or(0.0);
    Curved { thickness, averaging }
}
