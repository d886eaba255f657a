//! `sheaf recording`: shows, exports and repairs recordings.

use std::fmt::Write as _;

use pipeline::{Failure, FailureKind, Reporter, failure_of};
use recording::{FrameLosses, RecordingError, RecordingFile};
use serde_json::{Value, json};

use crate::answer::exit::Exit;
use crate::arguments::{
    RecordingAction, RecordingArgs, RecordingExportArgs, RecordingInfoArgs, RecordingRepairArgs,
};
use crate::commands::Answer;

/// Maximum number of gaps listed in the text; JSON lists all of them.
const GAPS_SHOWN: usize = 10;

/// Runs a subcommand.
pub fn run(args: &RecordingArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    match &args.action {
        RecordingAction::Info(args) => info(args),
        RecordingAction::Export(args) => export(args, reporter),
        RecordingAction::Repair(args) => repair(args),
    }
}

fn failed(error: RecordingError) -> Failure {
    failure_of(FailureKind::BadInput, &error)
}

fn ended(is_lossy: bool) -> Exit {
    if is_lossy { Exit::Lossy } else { Exit::Done }
}

fn info(args: &RecordingInfoArgs) -> Result<Answer, Failure> {
    let file = RecordingFile::open(&args.recording).map_err(failed)?;
    Ok(Answer { text: info_text(&file), json: info_json(&file), exit: ended(file.is_lossy()) })
}

fn info_text(file: &RecordingFile) -> String {
    let (header, summary) = (&file.header, file.summary());
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<13} {value}");
    };
    line("name", format!("{} ({})", header.name, header.origin));
    if let Some(simulated) = &header.simulated {
        line("simulated", simulated.clone());
    }
    line("calibration", header.calibration_id.clone().unwrap_or_else(|| "none".to_owned()));
    if let Some(scan_id) = &header.scan_id {
        line("scan", format!("{scan_id}, {} rows, {} of them missing", summary.n_rows, summary.n_rows_missing));
    }
    let size = summary.size_px.map_or_else(String::new, |(width, height)| {
        format!(", {width} × {height} px, {} bits", summary.bits_per_pixel.unwrap_or_default())
    });
    line("frames", format!("{} in {:.3} s{size}", summary.n_frames, summary.duration_s));
    line("lost", losses_text(&summary.lost));
    for gap in summary.gaps.iter().take(GAPS_SHOWN) {
        let after =
            gap.after_frame.map_or_else(|| "before the first".to_owned(), |idx| format!("after frame {idx}"));
        let at = gap.position.map_or_else(String::new, |position| format!(" at {position}"));
        line("gap", format!("{after}{at}: {}", losses_text(&gap.lost)));
    }
    if summary.gaps.len() > GAPS_SHOWN {
        line("gap", format!("and {} more", summary.gaps.len() - GAPS_SHOWN));
    }
    for topic in &summary.topics {
        line("messages", format!("{:>8} {}", topic.n_messages, topic.topic));
    }
    line("file", format!("{} bytes, {}", file.size_bytes, completeness(file)));
    for damage in &file.damaged_parts {
        line("damage", format!("{} bytes at {}: {}", damage.size_bytes, damage.at_bytes, damage.reason));
    }
    let end = file.end.as_ref().map_or_else(|| "interrupted".to_owned(), |end| end.reason.clone());
    line("ended", end);
    line("lossy", if file.is_lossy() { "yes" } else { "no" }.to_owned());
    text
}

fn completeness(file: &RecordingFile) -> &'static str {
    match file.is_complete {
        true => "complete",
        false => "without an index (sheaf recording repair adds one)",
    }
}

fn losses_text(lost: &FrameLosses) -> String {
    let some: Vec<String> =
        lost.by_reason().iter().filter(|(_, n)| *n > 0).map(|(reason, n)| format!("{n} {reason}")).collect();
    if some.is_empty() { "none".to_owned() } else { some.join(", ") }
}

fn losses_json(lost: &FrameLosses) -> Value {
    Value::Object(lost.by_reason().iter().map(|(reason, n)| ((*reason).to_owned(), json!(n))).collect())
}

fn info_json(file: &RecordingFile) -> Value {
    let (header, summary) = (&file.header, file.summary());
    let gaps: Vec<Value> = summary
        .gaps
        .iter()
        .map(|gap| {
            let (lost, position) = (losses_json(&gap.lost), gap.position.map(|position| position.value()));
            json!({ "after_frame": gap.after_frame, "position": position, "lost": lost })
        })
        .collect();
    let damaged_parts: Vec<Value> = file
        .damaged_parts
        .iter()
        .map(|one| json!({ "at_bytes": one.at_bytes, "size_bytes": one.size_bytes, "reason": one.reason }))
        .collect();
    let topics: serde_json::Map<String, Value> =
        summary.topics.iter().map(|topic| (topic.topic.clone(), json!(topic.n_messages))).collect();
    json!({
        "name": header.name,
        "origin": header.origin,
        "simulated": header.simulated,
        "software_version": header.software_version,
        "calibration_id": header.calibration_id,
        "scan_id": header.scan_id,
        "started_at_ms": header.started_at_ms,
        "stage": header.stage.kind.name(),
        "n_frames": summary.n_frames,
        "duration_s": summary.duration_s,
        "size_px": summary.size_px.map(|(width, height)| [width, height]),
        "bits_per_pixel": summary.bits_per_pixel,
        "n_rows": summary.n_rows,
        "n_rows_missing": summary.n_rows_missing,
        "lost": losses_json(&summary.lost),
        "gaps": gaps,
        "topics": topics,
        "size_bytes": file.size_bytes,
        "is_complete": file.is_complete,
        "damaged_parts": damaged_parts,
        "ended": file.end.as_ref().map(|end| end.reason.clone()),
        "lossy": file.is_lossy(),
    })
}

fn export(args: &RecordingExportArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    if args.output.exists() {
        return Err(Failure::new(FailureKind::BadParameter, format!("{} already exists", args.output.display()))
            .remedy("give a folder that does not exist yet"));
    }
    let file = RecordingFile::open(&args.recording).map_err(failed)?;
    let task = reporter.fraction("exporting");
    let report_progress = |row: usize, n_rows: usize| {
        task.at(&format!("image {} of {n_rows}", row + 1), row as f64 / n_rows.max(1) as f64);
    };
    let exported = recording::export(&file, &args.output, report_progress).map_err(failed)?;
    let is_lossy = exported.n_rows_missing > 0 || exported.n_without_position > 0 || file.is_lossy();
    let mut text =
        format!("{} frames as scan {:?} → {}\n", exported.n_frames, exported.scan, args.output.display());
    if exported.n_without_position > 0 {
        let _ = writeln!(text, "{} frames without a stage position were skipped", exported.n_without_position);
    }
    if exported.n_rows_missing > 0 {
        let _ = writeln!(text, "{} rows of the scan are missing from the recording", exported.n_rows_missing);
    }
    if let Some(path) = &exported.calibration {
        let _ = writeln!(text, "calibration → {}", path.display());
    }
    if is_lossy {
        let _ = writeln!(text, "the recording is incomplete: `sheaf recording info` lists what is missing");
    }
    let json = json!({
        "output": args.output,
        "scan": exported.scan,
        "n_frames": exported.n_frames,
        "n_without_position": exported.n_without_position,
        "n_rows_missing": exported.n_rows_missing,
        "calibration": exported.calibration,
        "lossy": is_lossy,
    });
    Ok(Answer { text, json, exit: ended(is_lossy) })
}

fn repair(args: &RecordingRepairArgs) -> Result<Answer, Failure> {
    let repaired = recording::repair(&args.recording, &args.output).map_err(failed)?;
    let mut text = format!("{} messages → {}\n", repaired.n_messages, args.output.display());
    if repaired.was_complete {
        let _ = writeln!(text, "the file already had an index");
    }
    for damage in &repaired.damaged_parts {
        let _ = writeln!(text, "skipped: {} bytes at {}: {}", damage.size_bytes, damage.at_bytes, damage.reason);
    }
    let damaged_parts: Vec<Value> = repaired
        .damaged_parts
        .iter()
        .map(|one| json!({ "at_bytes": one.at_bytes, "size_bytes": one.size_bytes, "reason": one.reason }))
        .collect();
    let json = json!({
        "output": args.output,
        "n_messages": repaired.n_messages,
        "was_complete": repaired.was_complete,
        "damaged_parts": damaged_parts,
        "lossy": repaired.is_lossy(),
    });
    Ok(Answer { text, json, exit: ended(repaired.is_lossy()) })
}
