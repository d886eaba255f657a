//! The results of a scan as text and as JSON.

use std::fmt::Write as _;

use scanning::{ClosureGap, DropReason, ScanReport, ScanResult};
use serde_json::{Value, json};

use super::order_name;

/// Points, losses, agreement of the orders.
pub fn scan_text(name: &str, report: &ScanReport, median_sigma_mm: f64) -> String {
    let mut text = format!("scan {name}: {} points from {} line segments\n", report.n_points, report.n_segments);
    let _ = writeln!(text, "  median σ {:.1} µm along the ray", median_sigma_mm * 1e3);
    let losses: Vec<String> =
        losses(report).into_iter().map(|(why, points, _)| format!("{points} {why}")).collect();
    let _ =
        writeln!(text, "  rejected: {}", if losses.is_empty() { "none".to_owned() } else { losses.join(", ") });
    let _ = writeln!(text, "  labels: {}", report.envelope);
    text.push_str(&closure_text(report));
    if report.self_consistency.is_empty() {
        return text;
    }
    let _ = writeln!(
        text,
        "  surfaces seen by two orders:\n  {:<9}{:>9}{:>11}{:>10}",
        "orders", "pairs", "bias µm", "RMS µm"
    );
    for pair in &report.self_consistency {
        let _ = writeln!(
            text,
            "  {:<9}{:>9}{:>11.1}{:>10.1}",
            format!("{} {}", order_name(pair.order_a), order_name(pair.order_b)),
            pair.n_pairs,
            pair.bias_mm * 1e3,
            pair.rms_mm * 1e3
        );
    }
    text
}

/// The results as JSON.
pub fn scan_json(name: &str, report: &ScanReport, median_sigma_mm: f64) -> Value {
    let left_out: Vec<Value> = losses(report)
        .into_iter()
        .map(|(reason, points, pieces)| json!({ "reason": reason, "n_points": points, "n_pieces": pieces }))
        .collect();
    let pairs: Vec<Value> = report
        .self_consistency
        .iter()
        .map(|pair| {
            json!({ "order_a": pair.order_a, "order_b": pair.order_b, "n_pairs": pair.n_pairs,
                "bias_mm": pair.bias_mm, "rms_mm": pair.rms_mm })
        })
        .collect();
    let envelope = &report.envelope;
    json!({
        "scan": name,
        "n_points": report.n_points,
        "n_segments": report.n_segments,
        "median_sigma_mm": median_sigma_mm,
        "left_out": left_out,
        "self_consistency": pairs,
        "closure": report.closure.map(|closure| json!({
            "same_line": closure.same_line.as_ref().map(gap_json),
            "other_lines": closure.other_lines.as_ref().map(gap_json),
        })),
        "envelope": {
            "stated_mm": [envelope.stated_mm.near_mm, envelope.stated_mm.far_mm],
            "unambiguous_mm": [envelope.unambiguous_mm.near_mm, envelope.unambiguous_mm.far_mm],
        },
    })
}

/// Closure after a full turn; empty without one.
fn closure_text(report: &ScanReport) -> String {
    let mut text = String::new();
    for (name, gap) in closure_gaps(report) {
        let _ = writeln!(
            text,
            "  closure after a turn, {name}: bias {:+.1} µm, RMS {:.1} µm over {} pairs ({} rejected)",
            gap.bias_mm * 1e3,
            gap.rms_mm * 1e3,
            gap.n_pairs,
            gap.n_outliers
        );
    }
    text
}

/// Closure gaps after a full turn, by the line that saw the surface again.
pub fn closure_gaps(report: &ScanReport) -> Vec<(&'static str, ClosureGap)> {
    let Some(closure) = report.closure else { return Vec::new() };
    let gaps = [("same line", closure.same_line), ("other line", closure.other_lines)];
    gaps.into_iter().filter_map(|(name, gap)| Some((name, gap?))).collect()
}

fn gap_json(gap: &ClosureGap) -> Value {
    json!({ "n_pairs": gap.n_pairs, "bias_mm": gap.bias_mm, "rms_mm": gap.rms_mm, "n_outliers": gap.n_outliers })
}

/// Rejections: reason, number of points, number of whole pieces.
pub fn losses(report: &ScanReport) -> Vec<(&'static str, usize, usize)> {
    DropReason::ALL
        .into_iter()
        .map(|reason| (reason.name(), report.dropped.n_points(reason), report.dropped.n_pieces(reason)))
        .filter(|(_, points, _)| *points > 0)
        .collect()
}

/// Median of the points' own σ.
pub fn median_sigma_mm(result: &ScanResult) -> f64 {
    pipeline::median_mm(result.cloud.points.iter().map(|point| point.sigma_mm).collect())
}
