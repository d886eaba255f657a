//! The results of a measurement plan as text and as JSON.

use std::fmt::Write as _;

use metrology::{CharacteristicResult, FeatureResult, Finding, Geometry, PlanResult};
use serde_json::{Value, json};

use super::comparison::comparison_json;
use super::measurement::{finding_json, shape_json};

/// A line per characteristic with failure and notes below it, and the verdict on the part.
pub fn plan_text(result: &PlanResult) -> String {
    let mut text = format!(
        "{:<19} {:<16} {:>10} {:>10}{:>9}{:>9}{:>10}{:>10}  verdict\n",
        "characteristic", "measure", "nominal", "value", "lower", "upper", "error", "U (k=2)"
    );
    for characteristic in &result.characteristics {
        characteristic_text(&mut text, characteristic);
    }
    for feature in result.features.iter().filter(|feature| feature.failure.is_some()) {
        let reason = feature.failure.as_ref().map_or_else(String::new, ToString::to_string);
        let _ = writeln!(text, "feature {:<12}{}: {reason}", feature.id, feature.kind);
    }
    if let Some(error) = &result.alignment_failure {
        let _ = writeln!(text, "alignment           {error}");
    }
    let _ = writeln!(text, "part                {} (ISO 14253-1)", result.verdict.label());
    text
}

fn characteristic_text(text: &mut String, characteristic: &CharacteristicResult) {
    let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"));
    let signed = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:+.4}"));
    let _ = writeln!(
        text,
        "{:<19} {:<16} {:>10} {:>10}{:>9}{:>9}{:>10}{:>10}  {}",
        characteristic.id,
        format!("{} {}", characteristic.measure, characteristic.unit.symbol()),
        number(characteristic.nominal),
        number(characteristic.value),
        signed(characteristic.limits.lower),
        signed(characteristic.limits.upper),
        signed(characteristic.error),
        number(characteristic.expanded_uncertainty),
        characteristic.verdict.map_or("–", |verdict| verdict.label()),
    );
    if let Some(error) = &characteristic.failure {
        let _ = writeln!(text, "  not measured: {error}");
    }
    for note in &characteristic.notes {
        let _ = writeln!(text, "  note: {note}");
    }
}

/// The results as JSON. Geometry is in the datum frame, or in the part frame without an alignment.
pub fn plan_json(result: &PlanResult) -> Value {
    json!({
        "verdict": result.verdict.name(),
        "frame": if result.datum_from_part.is_some() { "datum" } else { "part" },
        "datum_from_part": result.datum_from_part.map(|pose| json!({
            "rotation": pose.axes().row_iter().map(|row| [row[0], row[1], row[2]]).collect::<Vec<_>>(),
            "translation_mm": pose.translation_mm.as_slice(),
        })),
        "alignment_failure": result.alignment_failure.as_ref().map(ToString::to_string),
        "features": result.features.iter().map(feature_json).collect::<Vec<_>>(),
        "characteristics": result.characteristics.iter().map(characteristic_json).collect::<Vec<_>>(),
    })
}

fn feature_json(feature: &FeatureResult) -> Value {
    json!({
        "id": feature.id,
        "kind": feature.kind,
        "geometry": feature.geometry.as_ref().map(geometry_json),
        "n_points": feature.n_points,
        "n_left_out": feature.n_left_out,
        "rms_mm": feature.rms_mm,
        "findings": feature.findings.iter().map(finding_json).collect::<Vec<_>>(),
        "failure": feature.failure.as_ref().map(ToString::to_string),
    })
}

fn characteristic_json(characteristic: &CharacteristicResult) -> Value {
    let found = |(id, finding): &(String, Finding)| {
        let mut json = finding_json(finding);
        json["feature"] = json!(id);
        json
    };
    json!({
        "id": characteristic.id,
        "measure": characteristic.measure,
        "unit": characteristic.unit.symbol(),
        "value": characteristic.value,
        "components": characteristic.components,
        "nominal": characteristic.nominal,
        "lower": characteristic.limits.lower,
        "upper": characteristic.limits.upper,
        "error": characteristic.error,
        "u_noise": characteristic.u_noise,
        "u_systematic": characteristic.u_systematic,
        "expanded_uncertainty": characteristic.expanded_uncertainty,
        "coverage_factor": 2,
        "uncertainty_complete": characteristic.missing.is_empty(),
        "uncertainty_missing": characteristic.missing.iter().map(|missing| missing.name()).collect::<Vec<_>>(),
        "findings": characteristic.findings.iter().map(found).collect::<Vec<_>>(),
        "verdict": characteristic.verdict.map(|verdict| verdict.name()),
        "failure": characteristic.failure.as_ref().map(ToString::to_string),
        "reason": characteristic.reason(),
        "notes": characteristic.notes,
        "comparison": characteristic.comparison.as_deref().map(comparison_json),
        "attributes": characteristic.attributes,
    })
}

fn geometry_json(geometry: &Geometry) -> Value {
    let xyz = |v: &nalgebra::Vector3<f64>| [v.x, v.y, v.z];
    match geometry {
        Geometry::Surface(shape) => shape_json(shape),
        Geometry::Circle { centre_mm, normal, radius_mm } => {
            json!({ "kind": "circle", "centre_mm": xyz(centre_mm), "normal": xyz(normal), "radius_mm": radius_mm })
        }
        Geometry::Slot { centre_mm, normal, direction, length_mm, width_mm } => json!({
            "kind": "slot", "centre_mm": xyz(centre_mm), "normal": xyz(normal), "direction": xyz(direction),
            "length_mm": length_mm, "width_mm": width_mm
        }),
        Geometry::Line { point_mm, direction } => {
            json!({ "kind": "line", "point_mm": xyz(point_mm), "direction": xyz(direction) })
        }
        Geometry::Point { at_mm } => json!({ "kind": "point", "at_mm": xyz(at_mm) }),
    }
}
