//! A measurement as text and as JSON.

use std::fmt::Write as _;

use metrology::{ErrorSummary, Finding, Measurement, PartVerdict, Shape};
use serde_json::{Value, json};

use super::order_name;

/// Value, uncertainty, verdict, and the table by orders as in the paper.
pub fn measurement_text(measurement: &Measurement) -> String {
    let unit = measurement.unit.symbol();
    let mut text = format!(
        "{:<12}{:.4} {unit}   {} {:.4} {unit} (k = 2)\n",
        measurement.tool.name(),
        measurement.value,
        if measurement.missing.is_empty() { "U =" } else { "U incomplete, at least" },
        measurement.expanded_uncertainty
    );
    let systematic = match measurement.u_systematic {
        Some(u) => format!("{u:.5} common to all points"),
        None => "unknown part common to all points".to_owned(),
    };
    let _ = writeln!(text, "  u           {:.5} from noise, {systematic}, {unit}", measurement.u_noise);
    if let (Some(nominal), Some(error)) = (measurement.nominal, measurement.error) {
        let _ = writeln!(text, "  nominal     {nominal:.4} {unit}   error {error:+.4} {unit}");
    }
    if let (Some(tolerance), Some(verdict)) = (measurement.tolerance, measurement.verdict) {
        let _ = writeln!(
            text,
            "  tolerance   ±{tolerance:.4} {unit}   {} (ISO 14253-1)",
            PartVerdict::from(verdict).label()
        );
    }
    for missing in &measurement.missing {
        let _ = writeln!(text, "  missing     {missing} (in U)");
    }
    for finding in &measurement.findings {
        let _ = writeln!(text, "  finding     {finding}");
    }
    if let Some([about_x, about_y]) = measurement.tilts_deg {
        let _ = writeln!(text, "  tilts       {about_x:+.5}° about x, {about_y:+.5}° about y");
    }
    for feature in &measurement.features {
        let _ = writeln!(
            text,
            "  {:<11} {} points, RMS {:.4} mm; rejected: {} off the surface, {} near the border",
            feature.role, feature.n_points, feature.rms_mm, feature.n_outliers, feature.n_border
        );
    }
    orders_text(&mut text, measurement);
    for note in &measurement.notes {
        let _ = writeln!(text, "  note: {note}");
    }
    text
}

fn orders_text(text: &mut String, measurement: &Measurement) {
    let with_centre = measurement.per_order.iter().any(|row| row.centre_mm.is_some());
    let centre_head = if with_centre { "        centre x, y, z mm" } else { "" };
    let _ = writeln!(
        text,
        "  {:<7}{:>9}{:>13}{:>11}{:>10}{:>12}{centre_head}",
        "order", "points", "mean err µm", "RMSE µm", "max µm", "value mm"
    );
    let mut line = |name: &str, errors: &ErrorSummary, value: Option<f64>, centre: Option<[f64; 3]>| {
        let value = value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"));
        let centre = centre.map_or_else(String::new, |[x, y, z]| format!("  {x:>9.4}{y:>10.4}{z:>10.4}"));
        let _ = writeln!(
            text,
            "  {name:<7}{:>9}{:>13.1}{:>11.1}{:>10.0}{value:>12}{centre}",
            errors.n_points,
            errors.mean_mm * 1e3,
            errors.rmse_mm * 1e3,
            errors.max_mm * 1e3
        );
    };
    for row in &measurement.per_order {
        line(&order_name(row.order), &row.errors, row.value_mm, row.centre_mm);
    }
    line("all", &measurement.errors, Some(measurement.value), None);
}

/// The measurement as JSON.
pub fn measurement_json(measurement: &Measurement) -> Value {
    let features: Vec<Value> = measurement
        .features
        .iter()
        .map(|feature| {
            json!({ "role": feature.role, "shape": shape_json(&feature.shape), "n_points": feature.n_points,
                "n_outliers": feature.n_outliers, "n_border": feature.n_border, "rms_mm": feature.rms_mm })
        })
        .collect();
    let per_order: Vec<Value> = measurement
        .per_order
        .iter()
        .map(|row| {
            json!({ "order": row.order, "errors": errors_json(&row.errors), "value_mm": row.value_mm,
                "centre_mm": row.centre_mm })
        })
        .collect();
    json!({
        "tool": measurement.tool.name(),
        "unit": measurement.unit.symbol(),
        "value": measurement.value,
        "nominal": measurement.nominal,
        "error": measurement.error,
        "u_noise": measurement.u_noise,
        "u_systematic": measurement.u_systematic,
        "expanded_uncertainty": measurement.expanded_uncertainty,
        "coverage_factor": 2,
        "uncertainty_complete": measurement.missing.is_empty(),
        "uncertainty_missing": measurement.missing.iter().map(|missing| missing.name()).collect::<Vec<_>>(),
        "findings": measurement.findings.iter().map(finding_json).collect::<Vec<_>>(),
        "tilts_deg": measurement.tilts_deg,
        "tolerance": measurement.tolerance,
        "verdict": measurement.verdict.map(|verdict| PartVerdict::from(verdict).name()),
        "errors": errors_json(&measurement.errors),
        "per_order": per_order,
        "features": features,
        "notes": measurement.notes,
    })
}

pub(super) fn finding_json(finding: &Finding) -> Value {
    json!({ "kind": finding.name(), "text": finding.to_string() })
}

fn errors_json(errors: &ErrorSummary) -> Value {
    json!({ "n_points": errors.n_points, "mean_mm": errors.mean_mm, "rmse_mm": errors.rmse_mm,
        "max_mm": errors.max_mm })
}

pub(super) fn shape_json(shape: &Shape) -> Value {
    let xyz = |v: &nalgebra::Vector3<f64>| [v.x, v.y, v.z];
    match shape {
        Shape::Plane { point_mm, normal } => {
            json!({ "kind": "plane", "point_mm": xyz(point_mm), "normal": xyz(normal) })
        }
        Shape::Sphere { centre_mm, radius_mm } => {
            json!({ "kind": "sphere", "centre_mm": xyz(centre_mm), "radius_mm": radius_mm })
        }
        Shape::Cylinder { point_mm, axis, radius_mm } => {
            json!({ "kind": "cylinder", "point_mm": xyz(point_mm), "axis": xyz(axis), "radius_mm": radius_mm })
        }
    }
}
