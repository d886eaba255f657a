//! `sheaf scan`: computes a cloud, a mesh and a report from the frames of a scan.
//!
//! Peaks are kept in a temporary file beside the cloud, and points are written as they are computed, so that a scan need
//! not fit into memory unless an output needs all points at once (E57, mesh, report).

use std::path::Path;

use scanning::files::peaks::PeaksFile;
use scanning::files::{write_cloud, write_mesh};
use scanning::{Cloud, CloudFormat, Mesh, MeshFormat, MeshParams, ScanReport, mesh_from_cloud};
use serde_json::json;

use crate::answer::output::write_file;
use crate::arguments::ScanArgs;
use crate::commands::Answer;
use crate::commands::images::centrelines::{channel_json, levels_text, white_level_json};
use pipeline::Failure;
use pipeline::Reporter;
use pipeline::read_document;
use pipeline::{collected, evaluated_scan, open_capture, write_capture_peaks, write_scan_cloud};
use report::tables::{median_sigma_mm, scan_json, scan_text};

/// Scans and writes the cloud, then mesh and report if asked for.
pub fn run(args: &ScanArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let cloud_format = CloudFormat::from_path(&args.output)?;
    let mesh_format = args.mesh.as_deref().map(MeshFormat::from_path).transpose()?;
    let document = read_document(&args.calibration)?;
    let capture = open_capture(&args.capture, reporter)?;
    let folder = folder_beside(&args.output)?;
    let peaks = folder.path().join("peaks");
    write_capture_peaks(&capture, &document, &args.scan, &peaks, reporter)?;
    let (frames, calibration) = (PeaksFile::open(&peaks)?, document.calibration());
    let evaluation = evaluated_scan(&frames, &document, &calibration, &args.scan, reporter)
        .map_err(|failure| failure.in_file(&capture.manifest_path()))?;
    let output = |report: &ScanReport, median_sigma_mm: f64| {
        let mut text = levels_text(&capture);
        text.push_str(&scan_text(&args.scan, report, median_sigma_mm));
        text.push_str(&format!("cloud → {}\n", args.output.display()));
        let mut json = scan_json(&args.scan, report, median_sigma_mm);
        json["calibration_id"] = json!(document.calibration.id);
        json["channel"] = channel_json(capture.laser_channel());
        json["white_level"] = white_level_json(capture.white_level());
        json["output"] = json!(args.output);
        (text, json)
    };
    if cloud_format != CloudFormat::E57 && args.mesh.is_none() && args.report.is_none() {
        let nothing_else = |_: &[_]| Ok::<(), Failure>(());
        let written = write_scan_cloud(&args.output, cloud_format, &evaluation, 0, nothing_else);
        let (text, json) = output(&evaluation.report, written?.median_sigma_mm);
        return Ok(Answer::done(text, json));
    }
    let result = collected(evaluation)?;
    write_cloud(&args.output, cloud_format, &result.cloud)?;
    let (mut text, mut json) = output(&result.report, median_sigma_mm(&result));
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

/// A temporary folder in the folder of `path`, removed when dropped.
fn folder_beside(path: &Path) -> Result<tempfile::TempDir, Failure> {
    let home = path.parent().filter(|home| !home.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::Builder::new()
        .prefix(".sheaf-scan-")
        .tempdir_in(home)
        .map_err(|cause| Failure::unwritable(home, &cause))
}

/// Meshes a cloud and writes the mesh.
pub fn write_part_mesh(path: &Path, format: MeshFormat, cloud: &Cloud) -> Result<Mesh, Failure> {
    let mesh = mesh_from_cloud(cloud, &MeshParams::default());
    write_mesh(path, format, &mesh)?;
    Ok(mesh)
}
