//! The report of a calibration.

use calibration::{CalibrationDocument, CalibrationReport, CalibrationResult, LightReport};
use capture::Capture;
use maud::{Markup, html};

use super::chapters::dark_frame::{self, ImageCorrection};
use super::chapters::{camera, correlation, light, stage, turntable};
use super::drawing::labelled_images::{LabelledPixel, labelled_image};
use super::drawing::page::{Page, Tile, gallery, legend};
use crate::drawing::palette::order_hex;
use crate::tables::order_name;
use pipeline::Failure;
use pipeline::Features;

/// Maximum number of laser images shown.
const MAX_IMAGES: usize = 12;

/// The report of a calibration; `source` names the origin of the images, `correction` how a station corrected them, if
/// one captured them.
pub fn calibration_page(
    capture: &Capture,
    source: &str,
    features: &Features,
    result: &CalibrationResult,
    document: &CalibrationDocument,
    correction: Option<&ImageCorrection>,
) -> Result<String, Failure> {
    let lead = format!(
        "Calibration {} of {source}: camera, light sheets and stage with their quality figures.",
        document.calibration.id,
    );
    let mut page = Page::new("Calibration report", &lead);
    calibration_sections(&mut page, capture, features, result)?;
    if let Some(correction) = correction {
        page.section(
            "Dark frame",
            "What the sensor shows without light. Its hot pixels are replaced in every image, and its fixed pattern is subtracted, before corners and lines are located.",
            dark_frame::content(correction),
        );
    }
    Ok(page.finish())
}

/// Headline figures and all sections of a calibration.
pub fn calibration_sections(
    page: &mut Page,
    capture: &Capture,
    features: &Features,
    result: &CalibrationResult,
) -> Result<(), Failure> {
    let report = &result.report;
    page.tiles(&tiles(report));
    notes(page, features, report);
    if let Some(models) = &report.cross_validation {
        page.section(
            "Light models",
            "Each model is fitted without some poses and predicts these; the error on held-out poses is the error to expect in a scan.",
            light::models(models),
        );
    }
    if let Some(fit) = &report.light {
        page.section(
            "Light sheets",
            "Distance of every laser point from the curve its light sheet predicts, across the line, in pixels.",
            light::residuals(fit, &capture.manifest.projector),
        );
        page.section(
            "Detections",
            "Centrelines in the laser images, coloured by diffraction order; grey: detected but not used.",
            laser_images(capture, features, fit)?,
        );
    }
    page.section(
        "Camera",
        "Reprojection error of the corners.",
        camera::content(&result.calibration.camera, &report.camera),
    );
    if let Some(fit) = &report.stage {
        page.section(
            "Stage",
            "Direction and scale of the stage travel, from the board on the stage.",
            stage::content(fit),
        );
    }
    if let Some(axis) = &report.axis {
        page.section(
            "Turntable",
            "The axis of the turntable, from the board on the table.",
            turntable::content(axis),
        );
    }
    page.section(
        "Covariance",
        "Correlations of the parameters. They are part of the uncertainty of every point and measurement.",
        correlation::content(&result.calibration),
    );
    Ok(())
}

fn tiles(report: &CalibrationReport) -> Vec<Tile> {
    let camera = &report.camera;
    let mut tiles = vec![Tile::new(
        format!("{:.4} px", camera.rms_px),
        "camera RMS",
        format!("{} images, corner noise {:.4} px per axis", camera.poses.len(), camera.corner_sigma_px),
    )];
    if let Some(light) = &report.light {
        tiles.push(Tile::new(
            format!("{:.1} µm", light.systematic_sigma_mm * 1e3),
            "systematic depth σ",
            "over the working volume, 1 σ",
        ));
        tiles.push(Tile::new(
            light.model.name(),
            "light model",
            format!("RMS {:.4} px across the lines", light.rms_px),
        ));
    }
    if let Some(stage) = &report.stage {
        tiles.push(Tile::new(
            format!("{:+.3} %", stage.scale_error * 100.0),
            "stage scale error",
            format!(
                "± {:.3} %, straight within {:.1} µm RMS",
                stage.scale_sigma * 100.0,
                stage.straightness_rms_um
            ),
        ));
    }
    if let Some(axis) = &report.axis {
        tiles.push(Tile::new(
            format!("{:.1} µm", axis.shift_sigma_mm[0].max(axis.shift_sigma_mm[1]) * 1e3),
            "turntable axis σ",
            format!("direction ± {:.4}°", axis.tilt_sigma_deg[0].max(axis.tilt_sigma_deg[1])),
        ));
    }
    tiles
}

fn notes(page: &mut Page, features: &Features, report: &CalibrationReport) {
    let left_out = features.left_out.iter().map(|image| format!("excluded: {image}"));
    let notes: Vec<String> = report.warnings.iter().cloned().chain(left_out).collect();
    if !notes.is_empty() {
        let content = html! { @for note in &notes { p.verdict.note { (note) } } };
        page.section("Notes", "Warnings and notes on this calibration.", content);
    }
}

fn laser_images(capture: &Capture, features: &Features, fit: &LightReport) -> Result<Markup, Failure> {
    let mut figures = Vec::new();
    for (pose_idx, pose) in features.input.poses.iter().enumerate() {
        if pose.centrelines.is_none() || figures.len() == MAX_IMAGES {
            continue;
        }
        let entry = capture.manifest.poses.iter().find(|entry| entry.board.display().to_string() == pose.name);
        let Some(laser) = entry.and_then(|entry| entry.laser.as_ref()) else { continue };
        let labelled: Vec<LabelledPixel> = fit
            .points
            .iter()
            .filter(|point| point.pose_idx == pose_idx)
            .map(|point| (point.u_px, point.v_px, point.order))
            .collect();
        let caption = laser.display().to_string();
        figures.push(labelled_image(capture, laser, pose.centrelines.as_ref(), &labelled, &caption)?);
    }
    let keys: Vec<(String, String)> = capture
        .manifest
        .projector
        .orders()
        .iter()
        .map(|order| (format!("order {}", order_name(*order)), order_hex(*order)))
        .collect();
    Ok(html! { (legend(&keys)) (gallery(&figures)) })
}
