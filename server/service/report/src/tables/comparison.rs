//! A comparison with a CAD model as text and as JSON.

use std::fmt::Write as _;

use metrology::Comparison;
use serde_json::{Value, json};

/// Deviations by area, the largest deviations, the verdict.
pub fn comparison_text(comparison: &Comparison) -> String {
    let statistics = &comparison.statistics;
    let covered_percent = 100.0 * statistics.covered_mm2 / statistics.area_mm2;
    let [low, high] = statistics.range_mm;
    let [p025, p500, p975] = statistics.percentiles_mm;
    let mut text = format!(
        "deviation   mean {:+.4}, RMS {:.4}, std {:.4} mm; points from {low:+.4} to {high:+.4} mm\n\
         percentiles 2.5 %: {p025:+.4}, 50 %: {p500:+.4}, 97.5 %: {p975:+.4} mm (by area)\n\
         covered     {:.0} of {:.0} mm² ({covered_percent:.1} %), {} points, {} too far away (--reach-mm)\n",
        statistics.mean_mm,
        statistics.rms_mm,
        statistics.std_mm,
        statistics.covered_mm2,
        statistics.area_mm2,
        statistics.n_points,
        statistics.n_beyond,
    );
    if let Some(rms_mm) = comparison.fit_rms_mm {
        let _ = writeln!(text, "best fit    RMS {rms_mm:.4} mm");
    }
    if let (Some(tolerance_mm), Some(verdict)) = (comparison.tolerance_mm, comparison.verdict) {
        let _ = writeln!(
            text,
            "tolerance   ±{tolerance_mm:.4} mm: {:.1} mm² out of tolerance, {:.1} mm² by more than U   {} (ISO 14253-1)",
            statistics.out_of_tolerance_mm2.unwrap_or(0.0),
            statistics.surely_out_of_tolerance_mm2.unwrap_or(0.0),
            verdict.label()
        );
    }
    for place in &comparison.worst {
        let [x, y, z] = place.at_mm;
        let _ = writeln!(
            text,
            "  {:+.4} mm ± {:.4} at {x:.2}, {y:.2}, {z:.2} ({} points)",
            place.deviation_mm, place.expanded_uncertainty_mm, place.n_points
        );
    }
    for note in &comparison.notes {
        let _ = writeln!(text, "  note: {note}");
    }
    text
}

/// The comparison as JSON, without the deviations of single points.
pub fn comparison_json(comparison: &Comparison) -> Value {
    let statistics = &comparison.statistics;
    let pose = &comparison.datum_from_part;
    let worst = comparison.worst.iter().map(|place| {
        json!({ "at_mm": place.at_mm, "deviation_mm": place.deviation_mm,
            "expanded_uncertainty_mm": place.expanded_uncertainty_mm, "n_points": place.n_points })
    });
    json!({
        "verdict": comparison.verdict.map(|verdict| verdict.name()),
        "tolerance_mm": comparison.tolerance_mm,
        "datum_from_part": {
            "rotation": pose.axes().row_iter().map(|row| [row[0], row[1], row[2]]).collect::<Vec<_>>(),
            "translation_mm": pose.translation_mm.as_slice(),
        },
        "locked": comparison.locked,
        "fit_rms_mm": comparison.fit_rms_mm,
        "n_points": statistics.n_points,
        "n_beyond": statistics.n_beyond,
        "mean_mm": statistics.mean_mm,
        "rms_mm": statistics.rms_mm,
        "std_mm": statistics.std_mm,
        "range_mm": statistics.range_mm,
        "percentiles": { "p2_5_mm": statistics.percentiles_mm[0], "p50_mm": statistics.percentiles_mm[1],
            "p97_5_mm": statistics.percentiles_mm[2] },
        "area_mm2": statistics.area_mm2,
        "covered_mm2": statistics.covered_mm2,
        "out_of_tolerance_mm2": statistics.out_of_tolerance_mm2,
        "surely_out_of_tolerance_mm2": statistics.surely_out_of_tolerance_mm2,
        "worst": worst.collect::<Vec<_>>(),
        "uncertainty_complete": comparison.missing.is_empty(),
        "uncertainty_missing": comparison.missing.iter().map(|missing| missing.name()).collect::<Vec<_>>(),
        "notes": comparison.notes,
    })
}
