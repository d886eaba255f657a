//! `sheaf compare`: compares a cloud with the CAD model of its part.

use std::io::Write as _;
use std::path::Path;

use metrology::{AlignTo, CompareRequest, Comparison, Nominal, compare};
use pipeline::{Failure, Reporter};
use report::tables::{comparison_json, comparison_text};
use scanning::Cloud;
use scanning::files::{read_cloud, read_mesh};
use serde_json::json;

use crate::answer::exit::Exit;
use crate::answer::output::write_file;
use crate::arguments::CompareArgs;
use crate::commands::Answer;
use crate::commands::measure::{calibration_of, exit_of_part, read_plan, region_between};

/// Compares; the exit code is the verdict's.
pub fn run(args: &CompareArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let cloud = read_cloud(&args.cloud)?;
    let nominal =
        Nominal::new(&read_mesh(&args.part)?).map_err(|error| Failure::from(error).in_file(&args.part))?;
    let calibration = calibration_of(&cloud, args.calibration.as_deref())?;
    if calibration.is_none() {
        reporter.warn(
            "the cloud contains no calibration: the uncertainty is incomplete and no verdict is possible; give one with --calibration",
        );
    }
    let request = CompareRequest {
        align: alignment(args)?,
        tolerance_mm: args.tolerance_mm,
        reach_mm: args.reach_mm,
        capture_mm: args.capture_mm,
        region: args.region_mm.map(region_between),
        surface_region: None,
    };
    let comparison = compare(&cloud, calibration.as_ref(), &nominal, &request)
        .map_err(|error| Failure::from(error).in_file(&args.cloud))?;
    let mut text = comparison_text(&comparison);
    if let Some(path) = &args.map {
        write_file(path, &map_csv(&cloud, &comparison))?;
        text.push_str(&format!("deviations → {}\n", path.display()));
    }
    if let Some(path) = &args.report {
        let part = args.part.file_name().unwrap_or(args.part.as_os_str()).to_string_lossy();
        write_file(path, report::comparison_page(&part, &cloud, &comparison)?.as_bytes())?;
        text.push_str(&format!("report → {}\n", path.display()));
    }
    let mut json = comparison_json(&comparison);
    json["cloud"] = json!(args.cloud);
    json["part"] = json!(args.part);
    json["map"] = json!(args.map);
    json["report_file"] = json!(args.report);
    json["calibration_id"] = json!(calibration.map(|calibration| calibration.id));
    Ok(Answer { text, json, exit: comparison.verdict.map_or(Exit::Done, exit_of_part) })
}

fn alignment(args: &CompareArgs) -> Result<AlignTo, Failure> {
    let plan = args.plan.as_deref().map(|path: &Path| read_plan(path).map(Box::new)).transpose()?;
    Ok(match (plan, args.best_fit) {
        (Some(plan), true) => AlignTo::DatumsThenSurface(plan),
        (Some(plan), false) => AlignTo::Datums(plan),
        (None, _) => AlignTo::surface_near(args.start.unwrap_or_default()),
    })
}

fn map_csv(cloud: &Cloud, comparison: &Comparison) -> Vec<u8> {
    let mut csv = b"x_mm,y_mm,z_mm,deviation_mm,u_mm\n".to_vec();
    let deviations = comparison.deviations_mm.iter().zip(&comparison.u_mm);
    for (point, (deviation_mm, u_mm)) in cloud.points.iter().zip(deviations).filter(|(_, (d, _))| d.is_finite()) {
        // Writing to memory does not fail.
        let _ = writeln!(csv, "{},{},{},{deviation_mm},{u_mm}", point.x_mm, point.y_mm, point.z_mm);
    }
    csv
}
