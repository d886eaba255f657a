//! The three light models side by side, compared with the truth.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::commands::demo::Trial;
use report::tables::{measurement_json, measurement_text};

/// One line per model, then the measurements of the parts by each.
pub fn demo_text(trials: &[Trial]) -> String {
    let mut text =
        String::from("the three light models on the same images, compared with the truth of the simulation\n\n");
    let _ = writeln!(
        text,
        "  {:<9}{:>16}{:>16}{:>22}{:>22}",
        "", "systematic", "predicted σ", "gauge height 8.9 mm", "sphere radius 18.9 mm"
    );
    let _ = writeln!(
        text,
        "  {:<9}{:>16}{:>16}{:>22}{:>22}",
        "model", "depth RMSE µm", "of depth µm", "error ± U, µm", "error ± U, µm"
    );
    for trial in trials {
        let predicted =
            trial.calibrated.result.report.light.as_ref().map_or(0.0, |light| light.systematic_sigma_mm);
        let _ = write!(
            text,
            "  {:<9}{:>16.1}{:>16.1}",
            trial.kind.name(),
            trial.systematic_rmse_mm * 1e3,
            predicted * 1e3
        );
        for part in &trial.parts {
            let error_um = part.measurement.error.unwrap_or(0.0) * 1e3;
            let uncertainty_um = part.measurement.expanded_uncertainty * 1e3;
            let _ = write!(text, "{:>22}", format!("{error_um:+.1} ± {uncertainty_um:.1}"));
        }
        text.push('\n');
    }
    for trial in trials {
        let _ = writeln!(text, "\nwith {}", trial.kind);
        for part in &trial.parts {
            text.push_str(&measurement_text(&part.measurement));
        }
    }
    text
}

/// The same as JSON.
pub fn demo_json(trials: &[Trial]) -> Value {
    let models: Vec<Value> = trials
        .iter()
        .map(|trial| {
            let parts: serde_json::Map<String, Value> =
                trial.parts.iter().map(|part| (part.name.clone(), measurement_json(&part.measurement))).collect();
            json!({
                "model": trial.kind.name(),
                "calibration_id": trial.calibrated.document.calibration.id,
                "systematic_depth_rmse_mm": trial.systematic_rmse_mm,
                "predicted_systematic_sigma_mm":
                    trial.calibrated.result.report.light.as_ref().map(|light| light.systematic_sigma_mm),
                "measurements": parts,
            })
        })
        .collect();
    json!({ "models": models })
}
