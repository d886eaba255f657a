//! One measurement, from the cloud to the verdict.

use optics::Calibration;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use scanning::Cloud;

use crate::features::{Found, Search, light_in_camera};
use crate::footprint::line_sigma_mm;
use crate::measurement::{FittedFeature, Measurement, Unit};
use crate::noise::{self, FeatureNoise};
use crate::orders;
use crate::params::{COVERAGE_FACTOR, FLATNESS_TRIM_SIGMAS, MIN_FEATURE_POINTS, TRIM_SIGMAS};
use crate::request::{MeasureError, MeasureRequest, Tool};
use crate::robust::within;
use crate::sample::{Samples, median};
use crate::shape::Shape;
use crate::systematic::Retriangulation;
use crate::value::{FirstPoints, band_width, value};
use crate::verdict::verdict;

/// Residuals this much larger than the predicted noise are worth a note.
const NOTEWORTHY_RATIO: f64 = 1.25;

/// A tool with the side on which an angle is read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Question {
    pub(crate) tool: Tool,
    pub(crate) supplement: bool,
}

/// Measures a cloud.
///
/// `calibration`: the one the scan was made with; without it the uncertainty holds the image noise alone.
/// The value itself does not depend on it. Same arguments, same result, whatever the number of threads.
///
/// # Errors
/// [`MeasureError`]: no such feature, too few points, or a calibration that does not belong to the cloud.
pub fn measure(
    cloud: &Cloud,
    calibration: Option<&Calibration>,
    request: &MeasureRequest,
) -> Result<Measurement, MeasureError> {
    check(request)?;
    let samples = Samples::from_cloud(cloud, request.region.as_ref(), calibration.and_then(light_in_camera));
    if samples.all.len() < MIN_FEATURE_POINTS {
        return Err(MeasureError::TooFewPoints { needed: MIN_FEATURE_POINTS, got: samples.all.len() });
    }
    let mut notes = Vec::new();
    let mut search = Search { samples: &samples, rng: Pcg64Mcg::seed_from_u64(request.seed) };
    let features = find(&mut search, request, &mut notes)?;
    let (question, measured) = read_value(&samples, &features, request)?;
    let retriangulation = calibration
        .map(|calibration| Retriangulation::new(cloud, &samples, &features, calibration))
        .transpose()?;
    let u_noise =
        noise_uncertainty(cloud, &samples, &features, request.tool, retriangulation.as_ref(), &mut notes)?;
    let u_systematic =
        systematic_uncertainty(&question, &features, retriangulation.as_ref(), &mut notes).map(|u| {
            u.hypot(line_width_uncertainty(cloud, &question, &features, retriangulation.as_ref(), &mut notes))
        });
    describe(&samples, &features, request.tool, &mut notes);

    let expanded_uncertainty = COVERAGE_FACTOR * u_noise.hypot(u_systematic.unwrap_or(0.0));
    let error = request.nominal_mm.map(|nominal| measured - nominal);
    let (errors, per_order) =
        orders::table(&samples, request.tool, &features, request.nominal_mm.unwrap_or(measured));
    Ok(Measurement {
        tool: request.tool,
        features: features.iter().map(|feature| fitted(&samples, feature)).collect(),
        value: measured,
        unit: if request.tool == Tool::Angle { Unit::Degree } else { Unit::Mm },
        nominal: request.nominal_mm,
        error,
        u_noise,
        u_systematic,
        expanded_uncertainty,
        tolerance: request.tolerance_mm,
        verdict: error.zip(request.tolerance_mm).map(|(error, t)| verdict(error, t, expanded_uncertainty)),
        errors,
        per_order,
        notes,
    })
}

fn check(request: &MeasureRequest) -> Result<(), MeasureError> {
    if let Some(value) = request.nominal_mm.filter(|v| !v.is_finite()) {
        return Err(MeasureError::BadNumber { name: "the nominal value", value, condition: "" });
    }
    if let Some(value) = request.tolerance_mm.filter(|v| !(v.is_finite() && *v > 0.0)) {
        return Err(MeasureError::BadNumber { name: "the tolerance", value, condition: " above zero" });
    }
    Ok(())
}

/// Finds the features of a tool, in the order [`value`] expects.
fn find(
    search: &mut Search,
    request: &MeasureRequest,
    notes: &mut Vec<String>,
) -> Result<Vec<Found>, MeasureError> {
    let all = search.samples.indices();
    let missing = |feature| MeasureError::FeatureNotFound { feature, n_points: all.len() };
    let nominal = request.nominal_mm;
    match request.tool {
        Tool::Plane => Ok(vec![search.plane("plane", &all).ok_or(missing("plane"))?]),
        Tool::Flatness => {
            let mut plane = search.plane("plane", &all).ok_or(missing("plane"))?;
            keep_form(search.samples, &mut plane);
            Ok(vec![plane])
        }
        Tool::Sphere => {
            let off_table = search.off_table();
            Ok(vec![search.sphere("sphere", &off_table, nominal).ok_or(missing("sphere"))?])
        }
        Tool::Cylinder => {
            let off_table = search.off_table();
            Ok(vec![search.cylinder("cylinder", &off_table, nominal).ok_or(missing("cylinder"))?])
        }
        Tool::Step => {
            let base = search.plane("base", &all).ok_or(missing("plane"))?;
            let top =
                second_plane(search, &base, nominal, notes).ok_or(missing("second plane parallel to the base"))?;
            if base.shape.distance_mm(&centroid(search.samples, &top)) < 0.0 {
                notes.push("the second plane lies below the base plane: the value is a depth".into());
            }
            Ok(vec![base, top])
        }
        Tool::Distance => distance_features(search, nominal, notes).ok_or(missing("pair of planes or spheres")),
        Tool::Angle => {
            let first = search.plane("first plane", &all).ok_or(missing("plane"))?;
            let rest = search.without(&all, &first);
            let second = search.plane("second plane", &rest).ok_or(missing("second plane"))?;
            Ok(vec![first, second])
        }
    }
}

fn second_plane(
    search: &mut Search,
    base: &Found,
    height_mm: Option<f64>,
    notes: &mut Vec<String>,
) -> Option<Found> {
    let rest = search.without(&search.samples.indices(), base);
    if height_mm.is_some() {
        if let Some(found) = search.parallel_plane("top", &rest, &base.shape, height_mm) {
            return Some(found);
        }
        notes.push("no plane near the nominal height; the largest parallel plane was taken".into());
    }
    search.parallel_plane("top", &rest, &base.shape, None)
}

/// Two parallel planes, or two spheres if they hold more than twice the points of the second plane.
fn distance_features(search: &mut Search, nominal: Option<f64>, notes: &mut Vec<String>) -> Option<Vec<Found>> {
    let all = search.samples.indices();
    let off_table = search.off_table();
    let first = search.sphere("first sphere", &off_table, None);
    let rest = first.as_ref().map(|first| search.without(&off_table, first)).unwrap_or_default();
    let second = first.as_ref().and_then(|_| search.sphere("second sphere", &rest, None));
    let planes = search.plane("first plane", &all).and_then(|base| {
        let top = second_plane(search, &base, nominal, notes)?;
        Some((base, Found { role: "second plane", ..top }))
    });
    let n_spheres = first.as_ref().zip(second.as_ref()).map_or(0, |(a, b)| a.inliers.len() + b.inliers.len());
    match planes {
        Some((base, top)) if n_spheres <= 2 * top.inliers.len() => {
            notes.push("distance between two parallel planes".into());
            Some(vec![base, top])
        }
        _ => {
            notes.push("distance between the centres of two spheres".into());
            Some(vec![first?, second?])
        }
    }
}

/// Widens a plane's points to all inside its outline that are form rather than stray.
fn keep_form(samples: &Samples, plane: &mut Found) {
    let mut normalised: Vec<f64> = plane
        .inliers
        .iter()
        .map(|&idx| crate::robust::normalised_distance(&plane.shape, samples.at(idx)).abs())
        .collect();
    let scale = crate::robust::SIGMA_PER_MAD * median(&mut normalised);
    let kept = within(samples, &plane.inside, &plane.shape, scale * FLATNESS_TRIM_SIGMAS.max(TRIM_SIGMAS));
    plane.n_outliers = plane.inside.len() - kept.len();
    plane.inliers = kept;
}

/// The value, and for an angle the side on which it is read.
fn read_value(
    samples: &Samples,
    features: &[Found],
    request: &MeasureRequest,
) -> Result<(Question, f64), MeasureError> {
    let shapes: Vec<Shape> = features.iter().map(|f| f.shape).collect();
    let inliers = &features[0].inliers;
    let first = FirstPoints {
        positions: inliers.iter().map(|&idx| samples.at(idx).in_part.xyz).collect(),
        camera: samples.mean_camera(inliers),
    };
    let read = |supplement| {
        value(request.tool, &shapes, &first, supplement)
            .ok_or(MeasureError::FeatureNotFound { feature: request.tool.name(), n_points: samples.all.len() })
    };
    let direct = read(false)?;
    let mirrored = 180.0 - direct;
    let supplement = request.tool == Tool::Angle
        && request.nominal_mm.is_some_and(|nominal| (mirrored - nominal).abs() < (direct - nominal).abs());
    Ok((Question { tool: request.tool, supplement }, if supplement { mirrored } else { direct }))
}

fn noise_uncertainty(
    cloud: &Cloud,
    samples: &Samples,
    features: &[Found],
    tool: Tool,
    retriangulation: Option<&Retriangulation>,
    notes: &mut Vec<String>,
) -> Result<f64, MeasureError> {
    let noises: Vec<FeatureNoise> = features
        .iter()
        .enumerate()
        .map(|(idx, feature)| match retriangulation.filter(|_| samples.sigma_known) {
            Some(retriangulation) => retriangulation.noise_of(samples, idx, feature),
            None => {
                FeatureNoise { sigma_mm: feature.inliers.iter().map(|&idx| samples.at(idx).sigma_mm).collect() }
            }
        })
        .collect();
    let result = noise::propagate(cloud, samples, tool, features, &noises)
        .ok_or(MeasureError::FeatureNotFound { feature: tool.name(), n_points: samples.all.len() })?;
    if !samples.sigma_known {
        notes.push("the cloud carries no sigma: the noise was taken from the residuals".into());
    } else if result.ratio > NOTEWORTHY_RATIO {
        notes.push(format!(
            "residuals are {:.2} times the predicted noise: the surface has form, or the model does not fit it; \
             the uncertainty was widened by that factor",
            result.ratio
        ));
    }
    Ok(result.standard_uncertainty)
}

fn systematic_uncertainty(
    question: &Question,
    features: &[Found],
    retriangulation: Option<&Retriangulation>,
    notes: &mut Vec<String>,
) -> Option<f64> {
    let Some(retriangulation) = retriangulation else {
        notes.push("no calibration was given: the uncertainty holds the noise of the points alone".into());
        return None;
    };
    match retriangulation.standard_uncertainty(question, features) {
        Some((u, 0)) => Some(u),
        Some((u, failed)) => {
            notes.push(format!(
                "{failed} modes of the calibration's covariance gave no value and are missing in U"
            ));
            Some(u)
        }
        None => {
            notes.push("the calibration's part of the uncertainty could not be computed".into());
            None
        }
    }
}

/// What the thickness of the lines adds on curved features; 0 where it plays no part or is not known, with a note.
fn line_width_uncertainty(
    cloud: &Cloud,
    question: &Question,
    features: &[Found],
    retriangulation: Option<&Retriangulation>,
    notes: &mut Vec<String>,
) -> f64 {
    if features.iter().all(|feature| matches!(feature.shape, Shape::Plane { .. })) {
        return 0.0;
    }
    let known = retriangulation.zip(line_sigma_mm(cloud));
    let u =
        known.and_then(|(pixels, line_sigma_mm)| pixels.line_width_uncertainty(question, features, line_sigma_mm));
    match u {
        Some(u) => notes.push(format!(
            "the lines' thickness on the curved surface adds {:.1} µm to the calibration's part of u",
            1e3 * u
        )),
        None => notes.push(
            "the cloud does not state its lines' thickness: its pull on curved features is missing in U".into(),
        ),
    }
    u.unwrap_or(0.0)
}

/// Notes on what the features are.
fn describe(samples: &Samples, features: &[Found], tool: Tool, notes: &mut Vec<String>) {
    for feature in features.iter().filter(|feature| !feature.border_trimmed) {
        notes.push(format!("{}: too small or too coarsely sampled to leave its border out", feature.role));
    }
    if tool == Tool::Flatness {
        let mut residuals: Vec<f64> = features[0]
            .inliers
            .iter()
            .map(|&idx| features[0].shape.distance_mm(&samples.at(idx).in_part.xyz))
            .collect();
        let rms = (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt();
        notes.push(format!(
            "flatness is the band of 99.9 % of the points ({:.4} mm) with RMS {rms:.4} mm, image noise included",
            band_width(&mut residuals)
        ));
    }
}

fn centroid(samples: &Samples, feature: &Found) -> nalgebra::Vector3<f64> {
    let sum: nalgebra::Vector3<f64> = feature.inliers.iter().map(|&idx| samples.at(idx).in_part.xyz).sum();
    sum / feature.inliers.len() as f64
}

fn fitted(samples: &Samples, feature: &Found) -> FittedFeature {
    let square: f64 =
        feature.inliers.iter().map(|&idx| feature.shape.distance_mm(&samples.at(idx).in_part.xyz).powi(2)).sum();
    FittedFeature {
        role: feature.role,
        shape: feature.shape,
        n_points: feature.inliers.len(),
        n_outliers: feature.n_outliers,
        n_border: feature.n_border,
        rms_mm: (square / feature.inliers.len() as f64).sqrt(),
    }
}
