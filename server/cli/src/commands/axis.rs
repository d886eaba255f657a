//! `sheaf axis`: the axis of a turntable from a full-turn scan of a part.

use nalgebra::Vector3;
use optics::RotaryAxis;
use serde_json::json;
use vision::LineDirection;

use crate::answer::output::write_file;
use crate::arguments::AxisArgs;
use crate::commands::Answer;
use pipeline::{Failure, FailureKind, Reporter, calibrate_axis, open_capture, read_document};

/// Estimates the axis and writes the calibration with it.
pub fn run(args: &AxisArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let document = read_document(&args.calibration)?;
    let capture = open_capture(&args.capture, reporter)?;
    let calibration = document.calibration();
    let known = calibration.stage.and_then(|stage| stage.rotary());
    let depths = calibration.depth_range_mm;
    // Lines lie along the axis, and the camera looks at it.
    let along = match capture.manifest.projector.direction_of(0) {
        LineDirection::Columns => [0.0, -1.0, 0.0],
        LineDirection::Rows => [1.0, 0.0, 0.0],
    };
    let default = ([0.0, 0.0, 0.5 * (depths.near_mm + depths.far_mm)], along);
    let default = known.map_or(default, |axis| (axis.point_mm.into(), axis.direction.into()));
    let near = Vector3::from(args.near_mm.unwrap_or(default.0));
    let along = Vector3::from(args.along.unwrap_or(default.1));
    if along.norm() == 0.0 {
        return Err(Failure::new(FailureKind::BadParameter, "--along has no direction")
            .remedy("give a vector along the axis, such as 0,-1,0"));
    }
    let start = RotaryAxis::new(near, along);
    let (found, calibrated) = calibrate_axis(&capture, &document, &args.scan, &start, reporter)
        .map_err(|failure| failure.in_file(&capture.manifest_path()))?;
    write_file(&args.output, calibrated.to_json().as_bytes())?;
    let sigmas: Vec<f64> = (0..4).map(|idx| found.covariance[(idx, idx)].sqrt()).collect();
    let (point, direction) = (found.axis.point_mm, found.axis.direction);
    let text = format!(
        "axis through ({:.3}; {:.3}; {:.3}) mm along ({:.5}; {:.5}; {:.5})\n\
         σ of the position {:.4} and {:.4} mm across, of the direction {:.4} and {:.4}°\n\
         {} surface points seen twice, RMS distance {:.1} µm: {:.2} times the expected noise\n\
         calibration {} → {}\n",
        point.x,
        point.y,
        point.z,
        direction.x,
        direction.y,
        direction.z,
        sigmas[2],
        sigmas[3],
        sigmas[0].to_degrees(),
        sigmas[1].to_degrees(),
        found.n_pairs,
        1e3 * found.rms_mm,
        found.noise_ratio,
        calibrated.calibration.id,
        args.output.display()
    );
    let json = json!({
        "calibration_id": calibrated.calibration.id,
        "point_mm": [point.x, point.y, point.z],
        "direction": [direction.x, direction.y, direction.z],
        "shift_sigma_mm": [sigmas[2], sigmas[3]],
        "tilt_sigma_deg": [sigmas[0].to_degrees(), sigmas[1].to_degrees()],
        "n_pairs": found.n_pairs,
        "rms_mm": found.rms_mm,
        "noise_ratio": found.noise_ratio,
        "output": args.output,
    });
    Ok(Answer::done(text, json))
}
