//! `sheaf calibrate`: computes a calibration document, tables and a report from a capture folder.

use calibration::{CalibrationOptions, LightModelChoice};
use serde_json::json;

use crate::answer::output::write_file;
use crate::arguments::CalibrateArgs;
use crate::commands::Answer;
use crate::commands::images::centrelines::{channel_json, channel_text};
use pipeline::Failure;
use pipeline::Reporter;
use pipeline::{Calibrated, calibrate_features, open_capture, read_features};
use report::tables::{calibration_json, calibration_text};

/// Calibrates and writes the document, then the report if asked for.
pub fn run(args: &CalibrateArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let capture = open_capture(&args.capture, reporter)?;
    let options = CalibrationOptions {
        light_model: args.light_model.kind().map_or(LightModelChoice::Auto, LightModelChoice::Fixed),
        estimate_k3: args.k3.estimate(),
    };
    let features = read_features(&capture, args.leave_out_unreadable, reporter)?;
    let Calibrated { result, document } = calibrate_features(&capture, &features, &options, reporter)?;
    write_file(&args.output, document.to_json().as_bytes())?;
    if let Some(path) = &args.report {
        let html = report::calibration_page(
            &capture,
            &capture.folder.display().to_string(),
            &features,
            &result,
            &document,
            None,
        )?;
        write_file(path, html.as_bytes())?;
    }
    let mut text = channel_text(&capture);
    text.push_str(&calibration_text(&result, &document.calibration.id));
    text.push_str(&format!("\ncalibration {} → {}\n", document.calibration.id, args.output.display()));
    if let Some(path) = &args.report {
        text.push_str(&format!("report → {}\n", path.display()));
    }
    let mut json = calibration_json(&result, &document.calibration.id);
    json["output"] = json!(args.output);
    json["report_file"] = json!(args.report);
    json["channel"] = channel_json(capture.laser_channel());
    json["left_out"] = json!(features.left_out);
    Ok(Answer::done(text, json))
}
