//! `sheaf scan`: the frames of a scan to a cloud, a mesh and a report.

use std::path::Path;

use scanning::files::{write_cloud, write_mesh};
use scanning::{Cloud, CloudFormat, Mesh, MeshFormat, MeshParams, mesh_from_cloud};
use serde_json::json;

use crate::calibration_file::read_document;
use crate::cli::ScanArgs;
use crate::commands::Answer;
use crate::failure::Failure;
use crate::output::write_file;
use crate::pipeline::{open_capture, scan_capture};
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

/// Meshes a cloud and writes the mesh.
pub fn write_part_mesh(path: &Path, format: MeshFormat, cloud: &Cloud) -> Result<Mesh, Failure> {
    let mesh = mesh_from_cloud(cloud, &MeshParams::default());
    write_mesh(path, format, &mesh)?;
    Ok(mesh)
}
