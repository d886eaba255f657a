//! The second part of a certificate: methods, conditions, and the results with their expanded uncertainties.

use std::collections::BTreeMap;

use calibration::CalibrationDocument;
use calibration::document::{
    AxisSummary, AxisText, CameraSummary, LightSummary, LineSummary, StageSummary, StageText, TravelText,
};

use super::administrative::software;
use super::element::{Element, leaf, parent, words};
use super::quantity::{Unit, count, list, plain, uncertain};

/// How the uncertainties are determined.
const UNCERTAINTY: &str = "Standard uncertainties from the joint covariance of all fitted parameters, multiplied by \
    the coverage factor k = 2, which covers about 95 % of a normal distribution. They contain the noise of the \
    located corners and lines, but neither the uncertainty of the board's dimensions nor effects of temperature.";

/// How a linear stage is calibrated.
const TRAVEL: &str = "Images of the board on the stage at several nominal positions; a straight and uniform travel is \
    fitted to the poses of the board.";

/// How a turntable is calibrated.
const ROTATION: &str = "Images of the board on the turntable at several nominal angles; a rotation about a fixed axis \
    is fitted to the poses of the board.";

/// How a stage was determined whose results are not part of the document.
const NOT_FROM_THE_BOARD: &str = "Not from images of the board; the notes to the camera state how.";

/// The measurement results.
pub fn results(document: &CalibrationDocument) -> Element {
    let report = &document.report;
    let parts = [
        Some(camera(document, &report.camera)),
        report.light.as_ref().map(|light| light_sheets(document, light)),
        document.calibration.stage.as_ref().map(|stage| match stage {
            StageText::Linear(travel) => linear_stage(document, travel, report.stage.as_ref()),
            StageText::Rotary(axis) => turntable(document, axis, report.axis.as_ref()),
        }),
    ];
    parent("dcc:measurementResults", parts.into_iter().flatten())
}

/// A measurement result in the order of the schema. Notes are the calibration's own warnings.
fn measurement(
    document: &CalibrationDocument,
    name: &str,
    method: &str,
    results: impl IntoIterator<Item = Element>,
    notes: &[String],
) -> Element {
    let used = |name: &str, text: &str| {
        parent("dcc:usedMethod", [words("dcc:name", name), words("dcc:description", text)])
    };
    let uncertainty = parent(
        "dcc:usedMethod",
        [
            words("dcc:name", "Measurement uncertainty"),
            words("dcc:description", UNCERTAINTY),
            leaf("dcc:norm", "JCGM 100:2008"),
        ],
    )
    .with("refType", "basic_methodMeasurementUncertainty");
    let unknown = parent("dcc:data", [words("dcc:text", "Not recorded.")]);
    let condition = parent("dcc:influenceCondition", [words("dcc:name", "Ambient conditions"), unknown]);
    let note = |text: &String| parent("dcc:metaData", [words("dcc:declaration", text)]);
    let notes = (!notes.is_empty()).then(|| parent("dcc:measurementMetaData", notes.iter().map(note)));
    let parts = [
        Some(words("dcc:name", name)),
        Some(parent("dcc:usedMethods", [used("Calibration", method), uncertainty])),
        Some(parent("dcc:usedSoftware", [software(&document.software.version, "Computed the calibration.")])),
        Some(parent("dcc:influenceConditions", [condition])),
        Some(parent("dcc:results", results)),
        notes,
    ];
    parent("dcc:measurementResult", parts.into_iter().flatten())
}

fn result(name: &str, quantities: impl IntoIterator<Item = Element>) -> Element {
    parent("dcc:result", [words("dcc:name", name), parent("dcc:data", quantities)])
}

fn camera(document: &CalibrationDocument, summary: &CameraSummary) -> Element {
    let camera = &document.calibration.camera;
    let values = [
        ("Focal length fx, pixels", camera.fx_px),
        ("Focal length fy, pixels", camera.fy_px),
        ("Principal point cx, pixels", camera.cx_px),
        ("Principal point cy, pixels", camera.cy_px),
        ("Radial distortion k1", camera.k1),
        ("Radial distortion k2", camera.k2),
        ("Tangential distortion p1", camera.p1),
        ("Tangential distortion p2", camera.p2),
        ("Radial distortion k3", camera.k3),
    ];
    let parameters =
        values.iter().zip(summary.sigma).map(|((name, value), sigma)| uncertain(name, Unit::One, *value, sigma));
    let n_corners: usize = summary.views.iter().map(|view| view.n_corners).sum();
    let of_images: Vec<(String, f64)> =
        summary.views.iter().map(|view| (view.name.clone(), view.rms_px)).collect();
    let mut residuals = vec![
        plain("Reprojection error of the board's corners, RMS, pixels", Unit::One, summary.rms_px),
        plain("Noise of a corner per axis, standard deviation, pixels", Unit::One, summary.corner_sigma_px),
        count("Number of images", summary.views.len()),
        count("Number of corners", n_corners),
    ];
    if !of_images.is_empty() {
        residuals.push(list("Reprojection error per image, RMS, pixels", Unit::One, &of_images));
    }
    let size = [count("Image width, pixels", camera.width_px), count("Image height, pixels", camera.height_px)];
    let method = "Images of a flat board with known dimensions in several poses; all parameters and poses are fitted \
        by least squares to the located corners. Camera model of OpenCV with three radial and two tangential \
        coefficients; pixel (0, 0) is the centre of the top left pixel. A parameter without uncertainty was fixed.";
    let results = [
        result("Board residuals", residuals),
        result("Camera parameters", parameters),
        result("Image size", size),
    ];
    measurement(document, "Camera", method, results, &document.report.warnings)
}

fn light_sheets(document: &CalibrationDocument, summary: &LightSummary) -> Element {
    let n_points: usize = summary.lines.iter().map(|line| line.n_points).sum();
    let mut residuals = vec![
        plain("Residual across the lines, RMS, pixels", Unit::One, summary.rms_px),
        count("Number of points", n_points),
    ];
    let by_order = rms_by_order(&summary.lines);
    if !by_order.is_empty() {
        residuals.push(list("Residual across the lines per order, RMS, pixels", Unit::One, &by_order));
    }
    let range = &document.calibration.depth_range;
    let mut depth = vec![
        plain("Nearest calibrated depth", Unit::Millimetre, range.near_mm),
        plain("Farthest calibrated depth", Unit::Millimetre, range.far_mm),
        plain(
            "Standard uncertainty of the depth of a point by the calibration alone, RMS over the working volume",
            Unit::Micrometre,
            summary.systematic_sigma_mm * 1e3,
        ),
    ];
    depth.extend(held_out(document, summary).into_iter().flatten());
    let mut results = vec![result("Sheet residuals", residuals), result("Depth", depth)];
    if let Some([value, sigma, nominal]) = summary.wavelength_over_period {
        let quantities = [
            uncertain("Wavelength over grating period", Unit::One, value, sigma),
            plain("Nominal wavelength over grating period", Unit::One, nominal),
        ];
        results.push(result("Grating", quantities));
    }
    let method = format!(
        "Laser lines on the same boards; model of the light sheets: {}. Residuals are distances of the located \
         points from the fitted curves.",
        summary.model
    );
    measurement(document, "Light sheets", &method, results, &[])
}

/// Errors of the model on boards that were left out of its fit.
fn held_out(document: &CalibrationDocument, light: &LightSummary) -> [Option<Element>; 2] {
    let models = document.report.cross_validation.iter().flat_map(|comparison| &comparison.models);
    let Some(model) = models.into_iter().find(|model| model.model == light.model) else { return [None, None] };
    let depth = |name: &str, mm: Option<f64>| Some(plain(name, Unit::Micrometre, mm? * 1e3));
    [
        depth("Error of the depth on boards left out of the fit, RMS of points", model.held_out_rms_mm),
        depth(
            "Error of the depth on boards left out of the fit, RMS of means per board and order",
            model.held_out_bias_mm,
        ),
    ]
}

/// RMS of the residuals of each order over all boards.
fn rms_by_order(lines: &[LineSummary]) -> Vec<(String, f64)> {
    let mut sums: BTreeMap<i8, (f64, f64)> = BTreeMap::new();
    for line in lines.iter().filter(|line| line.n_points > 0) {
        let (squares_px2, n) = sums.entry(line.order).or_default();
        *squares_px2 += line.rms_px * line.rms_px * line.n_points as f64;
        *n += line.n_points as f64;
    }
    sums.into_iter()
        .map(|(order, (squares_px2, n))| (format!("order_{order}"), (squares_px2 / n).sqrt()))
        .collect()
}

fn linear_stage(document: &CalibrationDocument, travel: &TravelText, summary: Option<&StageSummary>) -> Element {
    let sigma = summary.map_or([0.0; 3], |summary| summary.sigma);
    let component = |axis: usize| {
        let name = format!("Travel per nominal travel along {} of the camera", ["x", "y", "z"][axis]);
        uncertain(&name, Unit::One, travel.direction_mm_per_mm[axis], sigma[axis])
    };
    let mut results = vec![result("Direction of travel", (0..3).map(component))];
    if let Some(summary) = summary {
        let scale = 1.0 + summary.scale_error;
        results.push(result(
            "Scale of the stage",
            [uncertain("Travel per nominal travel", Unit::One, scale, summary.scale_sigma)],
        ));
        results.push(result(
            "Straightness",
            [plain("Deviation across the travel, RMS", Unit::Micrometre, summary.straightness_rms_um)],
        ));
    }
    if let Some(tilt) = &travel.tilt {
        let sigma = |(sigma_rad, which): (&[f64; 3], &str)| {
            let name = format!("Rotation about the {which} principal axis, standard deviation");
            let [x, y, z] = sigma_rad;
            plain(&name, Unit::Degree, x.hypot(*y).hypot(*z).to_degrees())
        };
        let axes = tilt.sigmas_rad.iter().zip(["first", "second", "third"]);
        results.push(result("Tilt of the carriage along the travel", axes.map(sigma)));
    }
    let method = match summary {
        Some(_) => TRAVEL,
        None => NOT_FROM_THE_BOARD,
    };
    measurement(document, "Stage", method, results, &[])
}

fn turntable(document: &CalibrationDocument, axis: &AxisText, summary: Option<&AxisSummary>) -> Element {
    let named = |what: &str, idx: usize| format!("{what} {} in the camera frame", ["x", "y", "z"][idx]);
    let point = (0..3).map(|idx| plain(&named("Point of the axis,", idx), Unit::Millimetre, axis.point_mm[idx]));
    let direction = (0..3).map(|idx| plain(&named("Direction of the axis,", idx), Unit::One, axis.direction[idx]));
    let mut results = vec![result("Point of the axis", point), result("Direction of the axis", direction)];
    if let Some(summary) = summary {
        let across = ["first", "second"];
        let deviation = |what: &str, idx: usize| format!("{what}, {} direction across the axis", across[idx]);
        let shift = (0..2).map(|idx| {
            let name = deviation("Deviation of the axis from its stated place", idx);
            uncertain(&name, Unit::Millimetre, 0.0, summary.shift_sigma_mm[idx])
        });
        let tilt = (0..2).map(|idx| {
            let name = deviation("Deviation of the axis from its stated direction", idx);
            uncertain(&name, Unit::Degree, 0.0, summary.tilt_sigma_deg[idx])
        });
        results.push(result("Uncertainty of the axis", shift.chain(tilt).collect::<Vec<_>>()));
    }
    let method = match summary {
        Some(_) => ROTATION,
        None => NOT_FROM_THE_BOARD,
    };
    measurement(document, "Turntable", method, results, &[])
}
