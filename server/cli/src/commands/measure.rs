//! `sheaf measure`: one measurement on a cloud, with its uncertainty and, with a tolerance, the verdict.

use crate::answer::exit::Exit;
use std::path::Path;

use metrology::{MeasureRequest, Measurement, Region, Verdict, measure};
use optics::Calibration;
use scanning::Cloud;
use scanning::files::read_cloud;
use serde_json::json;

use crate::arguments::MeasureArgs;
use crate::commands::Answer;
use pipeline::Failure;
use pipeline::Reporter;
use pipeline::extract;
use pipeline::read_document;
use report::tables::{measurement_json, measurement_text};

/// Measures; the exit code is the verdict's.
pub fn run(args: &MeasureArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let cloud = read_cloud(&args.cloud)?;
    let calibration = calibration_of(&cloud, args.calibration.as_deref())?;
    if calibration.is_none() {
        reporter.warn(
            "the cloud contains no calibration: the uncertainty is incomplete and no verdict is possible; give one with --calibration",
        );
    }
    let measurement = measure(&cloud, calibration.as_ref(), &request(args))
        .map_err(|error| Failure::from(error).in_file(&args.cloud))?;
    let mut json = measurement_json(&measurement);
    json["cloud"] = json!(args.cloud);
    json["calibration_id"] = json!(calibration.map(|calibration| calibration.id));
    Ok(Answer { text: measurement_text(&measurement), json, exit: exit_of(&measurement) })
}

fn request(args: &MeasureArgs) -> MeasureRequest {
    let region = args.region_mm.as_deref().map(|corners| {
        let corner = |idx: usize| [corners[idx], corners[idx + 3]];
        let [x, y, z] = [corner(0), corner(1), corner(2)];
        Region { min_mm: [x, y, z].map(|[a, b]| f64::min(a, b)), max_mm: [x, y, z].map(|[a, b]| f64::max(a, b)) }
    });
    MeasureRequest {
        nominal_mm: args.nominal_mm,
        tolerance_mm: args.tolerance_mm,
        seed: args.seed,
        region,
        ..MeasureRequest::new(args.tool.into())
    }
}

/// The calibration the cloud was made with: as named, else as carried by the cloud.
fn calibration_of(cloud: &Cloud, named: Option<&Path>) -> Result<Option<Calibration>, Failure> {
    match named {
        Some(path) => Ok(Some(read_document(path)?.calibration())),
        None => Ok(extract(cloud)?.map(|text| text.value())),
    }
}

fn exit_of(measurement: &Measurement) -> Exit {
    match measurement.verdict {
        None | Some(Verdict::Pass) => Exit::Done,
        Some(Verdict::Fail) => Exit::VerdictFail,
        Some(Verdict::Undecided) => Exit::VerdictUndecided,
    }
}
