//! `sheaf scan`: the frames of a scan to a cloud, a mesh and a report.

use std::path::Path;

use calibration::CalibrationDocument;
use capture::Capture;
use scanning::files::{write_cloud, write_mesh};
use scanning::{
    Cloud, CloudFormat, Mesh, MeshFormat, MeshParams, ScanFrame, ScanParams, ScanResult, mesh_from_cloud,
    scan_cloud,
};
use serde_json::json;

use crate::calibration_file::read_document;
use crate::cli::ScanArgs;
use crate::cloud_provenance::embed;
use crate::commands::Answer;
use crate::commands::calibrate::open_capture;
use crate::failure::Failure;
use crate::features::scan_centrelines;
use crate::output::write_file;
use crate::progress::Reporter;
use crate::report;
use crate::tables::{scan_json, scan_text};

/// Scans and writes the cloud, then mesh and report if asked for.
pub fn run(args: &ScanArgs, reporter: &Reporter) -> Result<Answer, Failure> {
    let cloud_format = CloudFormat::from_path(&args.output)?;
    let mesh_format = args.mesh.as_deref().map(MeshFormat::from_path).transpose()?;
    let document = read_document(&args.calibration)?;
    let capture = open_capture(&args.capture, reporter)?;
    let result = scan_capture(&capture, &document, &args.scan, reporter)?;
    write_cloud(&args.output, cloud_format, &result.cloud)?;
    let mut text = scan_text(&args.scan, &result);
    text.push_str(&format!("cloud → {}\n", args.output.display()));
    let mut json = scan_json(&args.scan, &result);
    json["calibration_id"] = json!(document.calibration.id);
    json["output"] = json!(args.output);
    if let (Some(path), Some(format)) = (&args.mesh, mesh_format) {
        let mesh = write_part_mesh(path, format, &result.cloud)?;
        let (n_vertices, n_triangles) = (mesh.vertices_mm.len(), mesh.triangles.len());
        text.push_str(&format!("mesh of {n_triangles} triangles → {}\n", path.display()));
        json["mesh"] = json!({ "file": path, "n_vertices": n_vertices, "n_triangles": n_triangles });
    }
    if let Some(path) = &args.report {
        let html = report::scan_page(&capture, &args.scan, &result, &document)?;
        write_file(path, html.as_bytes())?;
        text.push_str(&format!("report → {}\n", path.display()));
        json["report_file"] = json!(path);
    }
    Ok(Answer::done(text, json))
}

/// Scans one scan of the capture; the cloud carries its calibration.
pub fn scan_capture(
    capture: &Capture,
    document: &CalibrationDocument,
    name: &str,
    reporter: &Reporter,
) -> Result<ScanResult, Failure> {
    let calibration = document.calibration();
    check_camera(capture, &calibration.camera)?;
    let centrelines = scan_centrelines(capture, name, reporter)?;
    let positions = capture.scan(name)?.frames.iter().map(|frame| frame.position_mm);
    let frames: Vec<ScanFrame> = centrelines
        .into_iter()
        .zip(positions)
        .map(|(centrelines, position_mm)| ScanFrame { centrelines, position_mm })
        .collect();
    let mut result = scan_cloud(&frames, &calibration, &ScanParams::default())?;
    if result.cloud.points.is_empty() {
        return Err(nothing_seen(capture, name, &result));
    }
    let dark = frames.iter().filter(|frame| frame.centrelines.segments.is_empty()).count();
    if dark > 0 {
        reporter.warn(&format!("scan {name}: {dark} of {} frames show no laser line", frames.len()));
    }
    embed(&mut result.cloud, document, name);
    Ok(result)
}

fn check_camera(capture: &Capture, camera: &optics::Camera) -> Result<(), Failure> {
    let images = capture.manifest.camera;
    if (images.width_px, images.height_px) == (camera.width_px, camera.height_px) {
        return Ok(());
    }
    Err(Failure::bad_input(format!(
        "the capture's images have {}×{} pixels, the calibration is for {}×{}",
        images.width_px, images.height_px, camera.width_px, camera.height_px
    ))
    .in_file(&capture.manifest_path())
    .at_entry("camera")
    .remedy("use the calibration of this camera at this resolution"))
}

fn nothing_seen(capture: &Capture, name: &str, result: &ScanResult) -> Failure {
    let what = match result.report.n_segments {
        0 => format!("scan {name}: no frame shows a laser line"),
        n_segments => format!(
            "scan {name}: none of {n_segments} line pieces gave a point ({} points left out)",
            result.report.dropped.total_points()
        ),
    };
    Failure::unobservable(what)
        .in_file(&capture.manifest_path())
        .at_entry(format!("scans \"{name}\""))
        .remedy("check laser and exposure, that the part is within the calibrated depth, and that the calibration is of this station")
}

/// Meshes a cloud and writes the mesh.
pub fn write_part_mesh(path: &Path, format: MeshFormat, cloud: &Cloud) -> Result<Mesh, Failure> {
    let mesh = mesh_from_cloud(cloud, &MeshParams::default());
    write_mesh(path, format, &mesh)?;
    Ok(mesh)
}
