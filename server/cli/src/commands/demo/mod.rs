//! `sheaf demo`: calibration, scan and measurement on a simulated station, compared with the ground truth.

mod page;
mod table;

use std::path::{Path, PathBuf};

use calibration::{CalibrationOptions, LightModelChoice};
use capture::Capture;
use metrology::{MeasureRequest, Measurement, Tool, measure};
use optics::LightModelKind;
use scanning::files::write_cloud;
use scanning::{CloudFormat, MeshFormat, ScanResult};
use serde_json::json;
use twin::{CaptureRequest, StationShape};

use crate::answer::output::{create_folder, write_file};
use crate::arguments::DemoArgs;
use crate::commands::Answer;
use crate::commands::scan::write_part_mesh;
use crate::commands::twin::{record, seeded};
use crate::inputs::photographs::{self, Photograph};
use crate::inputs::truth::{TruePoint, read_truth, systematic_depth_rmse_mm};
use app::config::{GAUGE_HEIGHT_MM, SPHERE_RADIUS_MM};
use pipeline::Failure;
use pipeline::Features;
use pipeline::Reporter;
use pipeline::{Calibrated, calibrate_features, open_capture, read_features, scan_capture};
use table::{demo_json, demo_text};

/// Image size of the simulated station: small enough to render and evaluate in a minute on two cores.
const IMAGE_PX: [usize; 2] = [960, 768];

/// Folder of the photographs in the output folder.
const PHOTOGRAPHS: &str = "photographs";

/// The two parts: scan name, tool, nominal value.
const PARTS: [(&str, Tool, f64); 2] =
    [("gauge", Tool::Step, GAUGE_HEIGHT_MM), ("sphere", Tool::Sphere, SPHERE_RADIUS_MM)];

/// Result of one light model on the simulated station.
pub struct Trial {
    /// The model.
    pub kind: LightModelKind,
    /// Calibration and report.
    pub calibrated: Calibrated,
    /// RMS depth error on the twin's noise-free pixels.
    pub systematic_rmse_mm: f64,
    /// Scan and measurement of each part.
    pub parts: Vec<MeasuredPart>,
}

/// A part as scanned and measured.
pub struct MeasuredPart {
    /// Name of the scan.
    pub name: String,
    /// The scan.
    pub scan: ScanResult,
    /// The measurement.
    pub measurement: Measurement,
}

/// Renders, calibrates with all models, scans, measures and compares.
pub fn run(args: &DemoArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    create_folder(&args.out)?;
    let folder = args.out.join("capture");
    render(&folder, args.seed, reporter)?;
    let capture = open_capture(&folder, reporter)?;
    let truth = all_truth(&folder)?;
    let features = read_features(&capture, false, reporter)?;
    let trials: Vec<Trial> = LightModelKind::ALL
        .into_iter()
        .map(|kind| attempt(kind, &capture, &features, &truth, reporter))
        .collect::<Result<_, Failure>>()?;
    let photographs = photographs(&args.out, reporter)?;
    let mut files = write_results(&args.out, &capture, &features, &trials, &photographs)?;
    if !photographs.is_empty() {
        files.push((
            PathBuf::from(PHOTOGRAPHS),
            "laser lines detected in photographs of a real scanner".to_owned(),
        ));
    }
    let mut text = demo_text(&trials);
    text.push_str(&format!("\nwritten to {}:\n", args.out.display()));
    for (file, what) in &files {
        text.push_str(&format!("  {:<28} {what}\n", file.display()));
    }
    let mut json = demo_json(&trials);
    json["output"] = json!(args.out);
    json["files"] = json!(files.iter().map(|(file, _)| file).collect::<Vec<_>>());
    Ok(Answer::done(text, json))
}

/// Renders the capture. A capture of an earlier demo is replaced, any other folder is left alone.
fn render(folder: &Path, seed: u64, reporter: &dyn Reporter) -> Result<(), Failure> {
    if folder.join("truth.json").is_file() && folder.join("capture.json").is_file() {
        std::fs::remove_dir_all(folder).map_err(|error| Failure::unwritable(folder, &error))?;
    }
    let [width_px, height_px] = IMAGE_PX;
    let shape = StationShape { width_px, height_px, ..StationShape::default() };
    let model = seeded(seed, &shape)?;
    record(&model, &CaptureRequest::standard(&model), folder, reporter).map(|_| ())
}

/// Lines detected in the photographs of the reference data, as images in their own folder; none without the data.
fn photographs(out: &Path, reporter: &dyn Reporter) -> Result<Vec<Photograph>, Failure> {
    let Some(data) = photographs::folder() else {
        reporter.note("no photographs: set SHEAF_DATA to the folder with real/ciclop");
        return Ok(Vec::new());
    };
    let found = photographs::with_lines(&data)?;
    photographs::write(&out.join(PHOTOGRAPHS), &found)?;
    Ok(found)
}

fn all_truth(folder: &Path) -> Result<Vec<TruePoint>, Failure> {
    let mut points = Vec::new();
    for (name, ..) in PARTS {
        points.extend(read_truth(&folder.join(format!("truth-{name}.csv")))?);
    }
    Ok(points)
}

fn attempt(
    kind: LightModelKind,
    capture: &Capture,
    features: &Features,
    truth: &[TruePoint],
    reporter: &dyn Reporter,
) -> Result<Trial, Failure> {
    let options =
        CalibrationOptions { light_model: LightModelChoice::Fixed(kind), ..CalibrationOptions::default() };
    reporter.note(&format!("light model {kind}"));
    let calibrated = calibrate_features(capture, features, &options, reporter)?;
    let calibration = calibrated.document.calibration();
    let parts = PARTS
        .into_iter()
        .map(|(name, tool, nominal_mm)| {
            let scan = scan_capture(capture, &calibrated.document, name, reporter)?;
            let request = MeasureRequest { nominal_mm: Some(nominal_mm), ..MeasureRequest::new(tool) };
            let measurement = measure(&scan.cloud, Some(&calibration), &request)?;
            Ok(MeasuredPart { name: name.to_owned(), scan, measurement })
        })
        .collect::<Result<_, Failure>>()?;
    let systematic_rmse_mm = systematic_depth_rmse_mm(&calibration, truth);
    Ok(Trial { kind, calibrated, systematic_rmse_mm, parts })
}

/// Writes documents, clouds and meshes of the best model, and the report; returns the files with descriptions.
fn write_results(
    out: &Path,
    capture: &Capture,
    features: &Features,
    trials: &[Trial],
    photographs: &[Photograph],
) -> Result<Vec<(PathBuf, String)>, Failure> {
    let mut files =
        vec![(PathBuf::from("capture"), "capture of the simulated station, with its ground truth".to_owned())];
    let best = recommended(trials);
    for trial in trials {
        let name = PathBuf::from(format!("cal-{}.json", trial.kind));
        write_file(&out.join(&name), trial.calibrated.document.to_json().as_bytes())?;
        files.push((name, format!("calibration with {}", trial.kind)));
    }
    for part in &best.parts {
        let cloud = PathBuf::from(format!("{}.ply", part.name));
        write_cloud(&out.join(&cloud), CloudFormat::Ply, &part.scan.cloud)?;
        files.push((cloud, format!("{} points with {}", part.scan.cloud.points.len(), best.kind)));
        for (extension, format) in [("stl", MeshFormat::Stl), ("glb", MeshFormat::Glb)] {
            let mesh = PathBuf::from(format!("{}.{extension}", part.name));
            let triangles = write_part_mesh(&out.join(&mesh), format, &part.scan.cloud)?.triangles.len();
            files.push((mesh, format!("{triangles} triangles")));
        }
    }
    let page = PathBuf::from("report.html");
    write_file(&out.join(&page), page::demo_page(capture, features, trials, best, photographs)?.as_bytes())?;
    files.push((page, "report (HTML)".to_owned()));
    Ok(files)
}

/// The trial whose model cross-validation recommends.
fn recommended(trials: &[Trial]) -> &Trial {
    let last = &trials[trials.len() - 1];
    let recommended = last.calibrated.result.report.cross_validation.as_ref().map(|models| models.recommended);
    trials.iter().find(|trial| Some(trial.kind) == recommended).unwrap_or(last)
}
