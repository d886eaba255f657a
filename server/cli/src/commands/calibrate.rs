//! `sheaf calibrate`: computes a calibration document, tables and a report from a capture folder.

use calibration::{CalibrationDocument, CalibrationOptions, LightModelChoice};
use serde_json::json;
use time::OffsetDateTime;

use crate::answer::output::write_file;
use crate::arguments::{CalibrateArgs, SettingsArgs};
use crate::commands::Answer;
use crate::commands::images::centrelines::{channel_json, levels_text, white_level_json};
use crate::commands::service::config::effective_of;
use pipeline::Reporter;
use pipeline::{Calibrated, calibrate_features, open_capture, read_features};
use pipeline::{Failure, FailureKind, failure_of};
use report::certificate::{Certificate, CertificateError, Issuer, calibration_certificate};
use report::tables::{calibration_json, calibration_text};

/// Calibrates and writes the document, then the report if asked for.
pub fn run(args: &CalibrateArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let issuer = args.certificate.as_ref().map(|_| issuer(args)).transpose()?;
    let capture = open_capture(&args.capture, reporter)?;
    let options = CalibrationOptions {
        light_model: args.light_model.kind().map_or(LightModelChoice::Auto, LightModelChoice::Fixed),
        estimate_k3: args.k3.estimate(),
    };
    let features = read_features(&capture, args.leave_out_unreadable, reporter)?;
    let Calibrated { result, document } = calibrate_features(&capture, &features, &options, reporter)?;
    write_file(&args.output, document.to_json().as_bytes())?;
    if let (Some(path), Some(issuer)) = (&args.certificate, issuer) {
        write_file(path, certificate(&document, issuer)?.as_bytes())?;
    }
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
    let mut text = levels_text(&capture);
    text.push_str(&calibration_text(&result, &document.calibration.id));
    text.push_str(&format!("\ncalibration {} → {}\n", document.calibration.id, args.output.display()));
    if let Some(path) = &args.report {
        text.push_str(&format!("report → {}\n", path.display()));
    }
    if let Some(path) = &args.certificate {
        text.push_str(&format!("certificate → {}\n", path.display()));
    }
    let mut json = calibration_json(&result, &document.calibration.id);
    json["output"] = json!(args.output);
    json["report_file"] = json!(args.report);
    json["certificate_file"] = json!(args.certificate);
    json["channel"] = channel_json(capture.laser_channel());
    json["white_level"] = white_level_json(capture.white_level());
    json["left_out"] = json!(features.left_out);
    Ok(Answer::done(text, json))
}

/// Who issues the certificate by the configuration; refused before anything is computed if that is not stated.
fn issuer(args: &CalibrateArgs) -> Result<Issuer, Failure> {
    let settings = SettingsArgs { config: args.config.clone(), ..SettingsArgs::default() };
    let issuer = effective_of(&settings)?.config.app.issuer;
    issuer.check().map_err(refused)?;
    Ok(issuer)
}

/// The certificate, calibrated and issued today (UTC): images do not record when and by which devices they were
/// captured.
fn certificate(document: &CalibrationDocument, issuer: Issuer) -> Result<String, Failure> {
    let today = OffsetDateTime::now_utc().date();
    let (begun, ended, issued) = (today, today, today);
    let certificate = Certificate { issuer, begun, ended, issued, parts: Vec::new(), simulated: None };
    calibration_certificate(document, &certificate).map_err(refused)
}

fn refused(error: CertificateError) -> Failure {
    failure_of(FailureKind::BadInput, &error)
}
